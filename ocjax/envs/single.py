"""Single environments with objects as observations."""

import warnings
from typing import Any

import gymnasium as gym
import jax
import numpy as np
from gymnasium.vector.utils import iterate

from ocjax.emulators.checks import Uncopied
from ocjax.emulators.states import States
from ocjax.envs.vector import TENSORS, ObjectVectorEnv
from ocjax.extraction.objects import Objects
from ocjax.transforms.game_objects import GameObject

_KEYS = {"NOOP": "e", "UP": "w", "DOWN": "s", "LEFT": "a", "RIGHT": "d", "FIRE": " "}


def _parts(action: str) -> list[str]:
    return [part for part in _KEYS if part in action]


class ObjectEnv(Uncopied, gym.Env):
    """One instance of a game, stepped in this process; `ocjax.make` makes it.

    Args:
        envs: a vector environment of one instance, with autoreset disabled.
    """

    def __init__(self, envs: ObjectVectorEnv) -> None:
        self.envs, self.game = envs, envs.game
        self.observation_space = envs.single_observation_space
        self.action_space = envs.single_action_space
        self.metadata = {
            name: value for name, value in envs.metadata.items() if name != "autoreset_mode"
        }
        self.render_mode = envs.render_mode

    def _first(self, observation: Any) -> Any:
        return next(iter(iterate(self.envs.observation_space, observation)))

    @staticmethod
    def _first_info(info: dict[str, Any]) -> dict[str, Any]:
        return {name: value[0] for name, value in info.items() if not name.startswith("_")}

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: a number >= 0; with None, the current random state continues.
            options: None; a single environment has no options.

        Returns:
            The observation and `info`.

        Raises:
            ValueError: the seed is negative, or `options` is not empty.
        """
        if options:
            raise ValueError(f"unknown options {sorted(options)}: there are none")
        observation, info = self.envs.reset(seed=None if seed is None else [seed])
        super().reset(seed=seed)  # seeds `np_random`
        return self._first(observation), self._first_info(info)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Take one agent step.

        Returns:
            The observation, reward, terminated, truncated and `info`.

        Raises:
            ValueError: the action does not exist, or the episode has ended.
        """
        actions = (
            np.asarray(action)[None] if self.envs.continuous else np.asarray(action).reshape(1)
        )
        observation, reward, terminated, truncated, info = self.envs.step(actions)
        return (
            self._first(observation),
            float(reward[0]),
            bool(terminated[0]),
            bool(truncated[0]),
            self._first_info(info),
        )

    def render(self) -> Any:
        """The last frame, or None without a render mode; see `ObjectVectorEnv.render`."""
        frames = self.envs.render()
        return None if frames is None else frames[0]

    def close(self) -> None:
        """Release the emulator."""
        self.envs.close()

    @property
    def objects(self) -> Objects | dict[str, Objects]:
        """The current objects, without a batch dimension.

        In mode "both" it is a dict of both methods' objects.

        Raises:
            ValueError: the mode is "raw", or the environment has not been reset.
        """
        return jax.tree.map(lambda field: field[0], self.envs.objects)

    def views(self, method: str | None = None) -> list[GameObject]:
        """The objects as OCAtari's list of Python objects; see `ObjectVectorEnv.views`."""
        return self.envs.views(0, method)

    @property
    def objects_v(self) -> list[GameObject]:
        """Deprecated form of `views("vem")`."""
        warnings.warn('env.objects_v is now env.views("vem")', DeprecationWarning, stacklevel=2)
        return self.views("vem")

    @property
    def tensors(self) -> Objects | dict[str, Objects]:
        """Deprecated form of `objects`, with batch shape `[1]`."""
        warnings.warn(TENSORS, DeprecationWarning, stacklevel=2)
        return self.envs.objects

    @property
    def features(self) -> Any:
        """The meaning of each number of "vector" observations; see `ObjectVectorEnv.features`."""
        return self.envs.features

    @property
    def ale(self) -> Any:
        """The emulator, an `ale_py.ALEInterface`, once the game has been reset."""
        return self.envs.pool.emulator(0)

    def get_action_meanings(self) -> list[str]:
        """The names of the actions, as in ale-py's environments."""
        return [a.name for a in self.envs.pool.actions]

    def get_keys_to_action(self) -> dict[tuple[str, ...], int]:
        """The action of each key combination, as in ale-py, for `gymnasium.utils.play`.

        The keys are w, a, s, d and space; e is the key of the action NOOP.

        Raises:
            AttributeError: the actions are continuous.
        """
        if self.envs.continuous:
            raise AttributeError(
                "continuous actions have no keys: make the environment without continuous=True"
            )
        return {
            tuple(_KEYS[part] for part in _parts(a.name)): i
            for i, a in enumerate(self.envs.pool.actions)
        }

    def get_ram(self) -> np.ndarray:
        """The RAM, uint8 `[128]`."""
        return self.envs.get_ram()[0]

    def set_ram(self, address: int, value: int) -> None:
        """Write one byte of the RAM.

        REM's objects change at once; the frame changes with the next step.

        Raises:
            ValueError: the address or the value is out of range.
        """
        if not (0 <= address < 128 and 0 <= value < 256):
            raise ValueError(
                f"an address is 0 to 127 and a value 0 to 255, got {address} and {value}"
            )
        ram = self.envs.get_ram()
        ram[0, address] = value
        self.envs.set_ram(ram)

    def clone_state(self) -> States:
        """Save the state."""
        return self.envs.clone_state()

    def restore_state(self, states: States) -> tuple[Any, dict[str, Any]]:
        """Restore a saved state; return its observation and `info`."""
        observation, info = self.envs.restore_state(states)
        return self._first(observation), self._first_info(info)
