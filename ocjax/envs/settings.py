"""The emulation settings that evaluations in the literature use, by name."""

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any


@dataclasses.dataclass(frozen=True)
class Settings:
    """What a step and an episode are. The defaults are those of Gymnasium's "v5" environments.

    Args:
        frame_skip: emulated frames per step; a pair (low, high) draws the number from low to high - 1 in each step, as in Gymnasium.
        repeat_action_probability: the probability that an emulated frame repeats the previous action ("sticky actions").
        max_episode_frames: emulated frames after which an episode is truncated.
        full_action_space: whether all 18 actions are available, rather than the game's minimal set.
        noop_max: a game begins with 1 to `noop_max` no-op frames, drawn at random; 0 for none.
        fire_reset: whether an episode begins with one step of FIRE and one of the next action, in games that need FIRE to begin.
        clip_rewards: whether rewards are reduced to their sign.
        episodic_life: whether the loss of a life ends the episode. The next episode continues the game.

    Raises:
        ValueError: a number is out of range.
    """

    frame_skip: int | tuple[int, int] = 4
    repeat_action_probability: float = 0.25
    max_episode_frames: int = 108_000
    full_action_space: bool = False
    noop_max: int = 0
    fire_reset: bool = False
    clip_rewards: bool = False
    episodic_life: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.frame_skip, int):  # JSON turns the pair into a list
            object.__setattr__(self, "frame_skip", tuple(self.frame_skip))
        low, high = self.skip_range
        if not (1 <= low < high and self.max_episode_frames >= 1):
            raise ValueError(
                "frame_skip and max_episode_frames must be at least 1, and a pair of frame skips must increase, "
                f"got {self.frame_skip} and {self.max_episode_frames}"
            )
        if not 0 <= self.repeat_action_probability < 1:
            raise ValueError(f"repeat_action_probability must be in [0, 1), got {self.repeat_action_probability}")
        if self.noop_max < 0:
            raise ValueError(f"noop_max must not be negative, got {self.noop_max}")

    @property
    def skip_range(self) -> tuple[int, int]:
        """The fewest emulated frames per step, and one more than the most."""
        return (self.frame_skip, self.frame_skip + 1) if isinstance(self.frame_skip, int) else self.frame_skip

    def to_dict(self) -> dict[str, Any]:
        """The fields, ready for JSON. `Settings(**fields)` is the inverse."""
        return dataclasses.asdict(self)


# "v5", "v4", "deterministic-v4" and "noframeskip" are Gymnasium's IDs of these names. "dqn" is Mnih et al. (2015) as the usual wrappers
# implement it; evaluations turn clip_rewards and episodic_life off. "machado" is Machado et al. (2018), with frame skip 5 and episodes of
# five minutes.
PRESETS: Mapping[str, Settings] = MappingProxyType(
    {
        "v5": Settings(),
        "v0": Settings(frame_skip=(2, 5)),
        "v4": Settings(frame_skip=(2, 5), repeat_action_probability=0.0),
        "deterministic-v0": Settings(),
        "deterministic-v4": Settings(repeat_action_probability=0.0),
        "noframeskip-v0": Settings(frame_skip=1),
        "noframeskip": Settings(frame_skip=1, repeat_action_probability=0.0),
        "dqn": Settings(repeat_action_probability=0.0, noop_max=30, fire_reset=True, clip_rewards=True, episodic_life=True),
        "machado": Settings(frame_skip=5, full_action_space=True, max_episode_frames=18_000),
    }
)


def settings(preset: str = "v5", **changes: Any) -> Settings:
    """The settings of a preset, with every argument that is not None changed.

    Raises:
        ValueError: there is no such preset, or a number is out of range.
    """
    if preset not in PRESETS:
        raise ValueError(f"no preset {preset!r}: there are {', '.join(PRESETS)}")
    return dataclasses.replace(PRESETS[preset], **{name: value for name, value in changes.items() if value is not None})
