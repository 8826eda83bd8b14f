"""Emulation settings, and the presets of evaluations in the literature."""

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from ocjax.emulators.checks import integer

_FRAMES_PER_SECOND = 60  # of the console
_MOST_FRAMES = 108_000  # of a step, and of the no-ops at the start of a game: half an hour
_MOST_EPISODE_FRAMES = 2**31 - 1  # ALE's counter


@dataclasses.dataclass(frozen=True)
class Settings:
    """Emulation settings, which define steps and episodes.

    The defaults match Gymnasium's "v5".

    Args:
        frame_skip: emulated frames per step. With a pair (low, high), each step draws a number from
            low to high - 1, as in Gymnasium.
        repeat_action_probability: the probability that an emulated frame repeats the previous
            action ("sticky actions").
        max_episode_frames: emulated frames after which an episode is truncated.
        max_episode_steps: agent steps of a game after which an episode is truncated, or None.
        full_action_space: whether all 18 actions are available instead of the game's minimal set.
        noop_max: a game begins with 1 to `noop_max` no-op frames, drawn at random; 0 for none.
        fire_reset: whether episodes begin with one step of FIRE and one step of the next action, in
            games that need FIRE to begin.
        clip_rewards: whether rewards are clipped to their sign.
        episodic_life: whether the loss of a life ends the episode; the next one continues the game.

    Raises:
        ValueError: a number is out of range.
    """

    frame_skip: int | tuple[int, int] = 4
    repeat_action_probability: float = 0.25
    max_episode_frames: int = 108_000
    max_episode_steps: int | None = None
    full_action_space: bool = False
    noop_max: int = 0
    fire_reset: bool = False
    clip_rewards: bool = False
    episodic_life: bool = False

    def __post_init__(self) -> None:
        p = self.repeat_action_probability
        if not isinstance(p, int | float | np.number) or not 0 <= p < 1:
            raise ValueError(f"repeat_action_probability must be in [0, 1), got {p!r}")
        checked = {
            "frame_skip": _frame_skip(self.frame_skip),
            "repeat_action_probability": float(p),
            "max_episode_frames": integer(
                "max_episode_frames", self.max_episode_frames, 1, _MOST_EPISODE_FRAMES
            ),
            "noop_max": integer("noop_max", self.noop_max, 0, _MOST_FRAMES),
        }
        if self.max_episode_steps is not None:
            checked["max_episode_steps"] = integer(
                "max_episode_steps", self.max_episode_steps, 1, _MOST_EPISODE_FRAMES
            )
        for name in ("full_action_space", "fire_reset", "clip_rewards", "episodic_life"):
            value = getattr(self, name)
            if not isinstance(value, bool | np.bool):
                raise ValueError(f"{name} must be True or False, got {value!r}")
            checked[name] = bool(value)
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def skip_range(self) -> tuple[int, int]:
        """The minimum of emulated frames per step, and the maximum plus one."""
        return (
            (self.frame_skip, self.frame_skip + 1)
            if isinstance(self.frame_skip, int)
            else self.frame_skip
        )

    @property
    def steps_per_second(self) -> float:
        """Agent steps per second of real time; emulated frames if the frame skip is random."""
        return (
            _FRAMES_PER_SECOND / self.frame_skip
            if isinstance(self.frame_skip, int)
            else float(_FRAMES_PER_SECOND)
        )

    def to_dict(self) -> dict[str, Any]:
        """The fields that are not None, ready for JSON. `Settings(**fields)` is the inverse."""
        return {
            name: value for name, value in dataclasses.asdict(self).items() if value is not None
        }


def _frame_skip(value: Any) -> int | tuple[int, int]:
    """A frame skip in the types of `Settings`; JSON turns the pair into a list."""
    if not isinstance(value, tuple | list):
        return integer("frame_skip", value, 1, _MOST_FRAMES)
    if len(value) != 2:
        raise ValueError(
            f"frame_skip must be a number of frames or a pair (low, high), got {value!r}"
        )
    low = integer("the lower end of frame_skip", value[0], 1, _MOST_FRAMES)
    return low, integer("the upper end of frame_skip", value[1], low + 1, _MOST_FRAMES + 1)


# "v5", "v4", "deterministic-v4" and "noframeskip" are named after Gymnasium's IDs. "dqn" is Mnih et
# al. (2015) as in the usual wrappers. "machado" is Machado et al. (2018), with frame skip 5 and
# episodes of five minutes.
PRESETS: Mapping[str, Settings] = MappingProxyType(
    {
        "v5": Settings(),
        "v0": Settings(frame_skip=(2, 5)),
        "v4": Settings(frame_skip=(2, 5), repeat_action_probability=0.0),
        "deterministic-v0": Settings(),
        "deterministic-v4": Settings(repeat_action_probability=0.0),
        "noframeskip-v0": Settings(frame_skip=1),
        "noframeskip": Settings(frame_skip=1, repeat_action_probability=0.0),
        "dqn": Settings(
            repeat_action_probability=0.0,
            noop_max=30,
            fire_reset=True,
            clip_rewards=True,
            episodic_life=True,
        ),
        "machado": Settings(frame_skip=5, full_action_space=True, max_episode_frames=18_000),
    }
)


def settings(preset: str = "v5", **changes: Any) -> Settings:
    """A preset with changes; arguments that are None change nothing.

    Raises:
        ValueError: the preset is unknown, or a number is out of range.
    """
    if preset not in PRESETS:
        raise ValueError(f"no preset {preset!r}: there are {', '.join(PRESETS)}")
    return dataclasses.replace(
        PRESETS[preset], **{name: value for name, value in changes.items() if value is not None}
    )
