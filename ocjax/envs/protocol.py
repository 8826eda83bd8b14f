"""How an environment is stepped: the evaluation protocols of the field by name."""

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any


@dataclasses.dataclass(frozen=True)
class Protocol:
    """What a step and an episode are. The defaults are those of gymnasium's "v5".

    Args:
        frame_skip: emulated frames a step; a pair (low, high) for random numbers from low to high - 1, as gymnasium has it.
        repeat_action_probability: sticky actions, per emulated frame.
        max_episode_frames: emulated frames after which an episode is truncated.
        full_action_space: all 18 actions instead of the game's own.
        noop_max: a game begins with 1 to so many frames without action; 0 for none.
        fire_reset: an episode begins with a step of FIRE and one of the action after it, where the game has FIRE and two more actions.
        clip_rewards: only the sign of a reward.
        episodic_life: an episode ends with each life; the game goes on in the next one.

    Raises:
        ValueError: a number out of range.
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
        if not isinstance(self.frame_skip, int):  # a list where it was read from a file
            object.__setattr__(self, "frame_skip", tuple(self.frame_skip))
        low, high = self.skip_range
        if not (1 <= low < high and self.max_episode_frames >= 1):
            raise ValueError(
                "frame_skip and max_episode_frames must be at least 1, and of two frame_skips the second the larger, "
                f"got {self.frame_skip} and {self.max_episode_frames}"
            )
        if not 0 <= self.repeat_action_probability < 1:
            raise ValueError(f"repeat_action_probability must be in [0, 1), got {self.repeat_action_probability}")
        if self.noop_max < 0:
            raise ValueError(f"noop_max must not be negative, got {self.noop_max}")

    @property
    def skip_range(self) -> tuple[int, int]:
        """Least emulated frames a step, and one more than the most."""
        return (self.frame_skip, self.frame_skip + 1) if isinstance(self.frame_skip, int) else self.frame_skip

    def to_dict(self) -> dict[str, Any]:
        """The fields, fit for JSON; `Protocol(**...)` takes them back."""
        return dataclasses.asdict(self)


# "v5", "v4", "deterministic-v4", "noframeskip": gymnasium's ids of those names. "dqn": Mnih et al. 2015 as the usual wrappers have it
# (for evaluation, without clip_rewards and episodic_life). "machado": Machado et al. 2018, with frame skip 5 and episodes of five minutes.
PRESETS: Mapping[str, Protocol] = MappingProxyType(
    {
        "v5": Protocol(),
        "v4": Protocol(frame_skip=(2, 5), repeat_action_probability=0.0),
        "deterministic-v4": Protocol(repeat_action_probability=0.0),
        "noframeskip": Protocol(frame_skip=1, repeat_action_probability=0.0),
        "dqn": Protocol(repeat_action_probability=0.0, noop_max=30, fire_reset=True, clip_rewards=True, episodic_life=True),
        "machado": Protocol(frame_skip=5, full_action_space=True, max_episode_frames=18_000),
    }
)


def protocol(preset: str = "v5", **changes: Any) -> Protocol:
    """A protocol by name, with what is not None of `changes` changed.

    Raises:
        ValueError: no such preset, or a number out of range.
    """
    if preset not in PRESETS:
        raise ValueError(f"no preset {preset!r}: there are {', '.join(PRESETS)}")
    return dataclasses.replace(PRESETS[preset], **{k: v for k, v in changes.items() if v is not None})
