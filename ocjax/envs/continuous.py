"""Continuous actions, as in ale-py: a joystick's deflection and angle, and its button."""

from typing import Any

import gymnasium as gym
import numpy as np
from ale_py.env import AtariEnv

from ocjax.emulators.checks import is_integer

DEFAULT_THRESHOLD = 0.5

# ale-py's action numbers by axis: left, centre, right; down, centre, up; button released, pressed.
_ACTIONS = np.array(
    [
        [
            [AtariEnv.map_action_idx(across, up, fire).value for fire in (False, True)]
            for up in (-1, 0, 1)
        ]
        for across in (-1, 0, 1)
    ]
)


class ContinuousActions:
    """Map continuous actions to the 18 discrete actions of an emulator.

    Args:
        threshold: the deflection above which a joystick's contact closes, and the same for the
            button.
    """

    def __init__(self, threshold: float) -> None:
        number = isinstance(threshold, float | np.floating) or is_integer(threshold)
        if not number or not 0 <= threshold <= 1:
            raise ValueError(
                f"continuous_action_threshold must be a number from 0 to 1, got {threshold!r}"
            )
        self._threshold = float(threshold)

    @property
    def space(self) -> gym.spaces.Box:
        """The action space of one environment, float32 `[3]`: deflection, angle and button.

        The angle is in radians: 0 is right, pi / 2 is up.
        """
        low, high = np.array([[0, -np.pi, 0], [1, np.pi, 1]], np.float32)
        return gym.spaces.Box(low, high, dtype=np.float32)

    def to_discrete(self, actions: Any, num_envs: int) -> tuple[np.ndarray, np.ndarray]:
        """The emulators' actions, int32 `[N]`, and the fractions of a paddle's speed, float32."""
        actions = np.asarray(actions)
        if actions.shape != (num_envs, 3) or not np.issubdtype(actions.dtype, np.floating):
            raise ValueError(
                f"actions must be floats of shape ({num_envs}, 3), got {actions.dtype} of shape "
                f"{actions.shape}"
            )
        actions = actions.astype(np.float32)
        if not ((actions >= self.space.low) & (actions <= self.space.high)).all():
            raise ValueError(
                f"actions must be from {self.space.low.tolist()} to {self.space.high.tolist()}, "
                f"got {actions.tolist()}"
            )
        deflection, angle, fire = actions.T
        across, up = (
            self._contact(deflection * np.cos(angle)),
            self._contact(deflection * np.sin(angle)),
        )
        pressed = (fire > self._threshold).astype(int)
        return _ACTIONS[across + 1, up + 1, pressed].astype(np.int32), deflection

    def _contact(self, deflection: np.ndarray) -> np.ndarray:
        return (deflection > self._threshold).astype(int) - (deflection < -self._threshold).astype(
            int
        )
