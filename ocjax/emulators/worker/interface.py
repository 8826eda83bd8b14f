"""What a pool and its workers share: commands, configuration and the arrays in shared memory.

The pool sends commands with numbers over the socket. The worker notes in `CommandArrays.finished`
that it has executed one, or has failed, and replies with one byte to wake the pool up. What went
wrong it writes to stderr. A command that comes again has its old number and is not executed again.
"""

import dataclasses
import json
import struct
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np

RESET, STEP, SAVE, RESTORE, WRITE = b"R", b"S", b"C", b"L", b"W"  # commands
MESSAGE = struct.Struct("<cq")  # a command and its number, which is positive and rises
REPLY = b"."

NEXT_STEP, SAME_STEP, DISABLED = "next step", "same step", "disabled"
AUTORESET_MODES = (NEXT_STEP, SAME_STEP, DISABLED)

STATE_BYTES = 2**14  # capacity for one saved emulator; ale-py 0.12 needs up to 14,560 bytes
ALIGNMENT = 64  # bytes, a cache line


@dataclass(frozen=True)
class WorkerConfig:
    """How a worker runs its emulators; sent as one line of JSON."""

    num_envs: int  # of the whole pool
    block: tuple[int, int]  # the worker's emulators: first, and one past the last
    screen_size: tuple[int, int]  # height, width
    screens: tuple[str, ...]  # the pixel arrays to fill, names in SCREENS
    autoreset: str  # one of AUTORESET_MODES
    rom: str  # ale-py's name of the ROM
    md5: str  # of the ROM
    rom_path: str
    actions: tuple[int, ...]  # ale-py's numbers of the game's actions
    frame_skip: tuple[int, int]  # fewest emulated frames per step, and one more than the most
    repeat_action_probability: float
    max_episode_frames: int
    max_episode_steps: int | None
    noop_max: int
    start_actions: tuple[
        int, ...
    ]  # indices of the actions that each episode starts with, one step each
    episodic_life: bool
    game_modes: tuple[int | None, ...]  # one per emulator of the pool, None for the game's default
    game_difficulties: tuple[int | None, ...]  # likewise
    hooks: tuple[
        tuple[str, str], ...
    ]  # name of each hook, and the hook pickled by value, in hexadecimal
    starts: tuple[
        tuple[tuple[str, str], ...], ...
    ]  # likewise, for each emulator of the pool, what its games begin with

    def to_json(self) -> str:
        """The configuration as one line of JSON."""
        return json.dumps(dataclasses.asdict(self))

    @classmethod
    def from_json(cls, line: str | bytes) -> Self:
        """The inverse of `to_json`."""
        values: dict[str, Any] = json.loads(line)
        for name, value in values.items():
            if isinstance(value, list):
                values[name] = tuple(tuple(v) if isinstance(v, list) else v for v in value)
        return cls(**values)


def _array(dtype: str, *shape: int) -> dict[str, Any]:
    """Metadata of a field: an array of this dtype and shape `[N, *shape]`."""
    return {"dtype": dtype, "shape": shape}


def _screen(frames: int, *channels: int) -> dict[str, Any]:
    """Metadata of an optional field: an array of frames, uint8 `[N, frames, H, W, *channels]`."""
    return {"frames": frames, "channels": channels}


@dataclass(frozen=True, kw_only=True, slots=True)
class ObservedArrays:
    """What observations and their info are made of, for N emulators with screens of H x W pixels.

    These are the arrays that are preserved in `EmulatorArrays.final` when an episode ends and the
    next one starts in the same step.
    """

    ram: np.ndarray = field(metadata=_array("uint8", 128))  # the console's RAM
    lives: np.ndarray = field(metadata=_array("int32"))
    frame_number: np.ndarray = field(
        metadata=_array("int64")
    )  # emulated frames since the game began
    episode_return: np.ndarray = field(
        metadata=_array("float64")
    )  # unclipped rewards since the game began
    episode_length: np.ndarray = field(metadata=_array("int64"))  # agent steps since the game began
    game_over: np.ndarray = field(
        metadata=_array("bool")
    )  # the step ended the game: the next episode begins a new one
    executed: np.ndarray = field(
        metadata=_array("int32")
    )  # the action of the last emulated frame, as ale-py numbers it
    screen: np.ndarray | None = field(
        default=None, metadata=_screen(2)
    )  # palette indices of the last two emulated frames, the latest last
    gray: np.ndarray | None = field(
        default=None, metadata=_screen(1)
    )  # the last emulated frame in shades of grey
    pooled: np.ndarray | None = field(
        default=None, metadata=_screen(1)
    )  # the pixelwise maximum of the step's last two in shades of grey
    rgb: np.ndarray | None = field(default=None, metadata=_screen(1, 3))  # the last emulated frame


@dataclass(frozen=True, kw_only=True, slots=True)
class EmulatorArrays(ObservedArrays):
    """Everything that a pool shows after a step."""

    reward: np.ndarray = field(metadata=_array("float64"))  # unclipped
    terminated: np.ndarray = field(metadata=_array("bool"))
    truncated: np.ndarray = field(metadata=_array("bool"))
    started: np.ndarray = field(metadata=_array("bool"))  # an episode began in this step
    final: ObservedArrays | None = (
        None  # with same-step autoreset: the arrays at the end of each emulator's last episode
    )


@dataclass(frozen=True, kw_only=True, slots=True)
class CommandArrays:
    """Arguments and results of the commands."""

    action: np.ndarray = field(metadata=_array("int32"))  # STEP: index into the action set
    strength: np.ndarray = field(
        metadata=_array("float32")
    )  # STEP: the part of a paddle's full speed
    seed: np.ndarray = field(metadata=_array("int64"))  # RESET: -1 for none
    chosen: np.ndarray = field(
        metadata=_array("bool")
    )  # RESET, RESTORE and WRITE: which emulators they apply to
    loaded: np.ndarray = field(metadata=_array("bool"))  # which emulators have loaded their ROM
    rejected: np.ndarray = field(
        metadata=_array("bool")
    )  # RESTORE: which emulators did not take over their state
    new_ram: np.ndarray = field(metadata=_array("uint8", 128))  # WRITE: the desired RAM
    state: np.ndarray = field(
        metadata=_array("uint8", STATE_BYTES)
    )  # SAVE and RESTORE, as `snapshot` packs it
    state_bytes: np.ndarray = field(
        metadata=_array("int64")
    )  # SAVE and RESTORE: how many of these bytes are used
    # The number of the last command that the worker executed, in the row of its first emulator;
    # negative if that failed.
    finished: np.ndarray = field(metadata=_array("int64"))


SCREENS: dict[str, int] = {
    f.name: f.metadata["frames"]
    for f in dataclasses.fields(ObservedArrays)
    if "frames" in f.metadata
}
GRAY, POOLED = "gray", "pooled"
OBSERVED: tuple[str, ...] = tuple(f.name for f in dataclasses.fields(ObservedArrays))

_Arrays = TypeVar("_Arrays", ObservedArrays, EmulatorArrays, CommandArrays)


class _Place(NamedTuple):
    """Where an array lies in the shared memory."""

    dtype: str
    shape: tuple[int, ...]
    offset: int


def _layout(config: WorkerConfig) -> tuple[dict[tuple[str, str], _Place], int]:
    """The place of each array, by group and name, and the size of all of them in bytes."""
    groups: list[tuple[str, type]] = [("shown", EmulatorArrays), ("command", CommandArrays)]
    if config.autoreset == SAME_STEP:
        groups.append(("final", ObservedArrays))
    places, offset = {}, 0
    for group, kind in groups:
        for f in dataclasses.fields(kind):
            if "dtype" in f.metadata:
                dtype, shape = f.metadata["dtype"], (config.num_envs, *f.metadata["shape"])
            elif f.name in config.screens:
                dtype, shape = (
                    "uint8",
                    (
                        config.num_envs,
                        f.metadata["frames"],
                        *config.screen_size,
                        *f.metadata["channels"],
                    ),
                )
            else:
                continue
            places[group, f.name] = _Place(dtype, shape, offset)
            offset += -(-int(np.prod(shape)) * np.dtype(dtype).itemsize // ALIGNMENT) * ALIGNMENT
    return places, offset


def memory_size(config: WorkerConfig) -> int:
    """Bytes of shared memory that a pool takes."""
    return _layout(config)[1]


def shared_arrays(buffer: Any, config: WorkerConfig) -> tuple[EmulatorArrays, CommandArrays]:
    """The arrays of a pool as views of its shared memory."""
    places, _ = _layout(config)

    def views(group: str, kind: type[_Arrays], **more: Any) -> _Arrays:
        mine = {name: place for (g, name), place in places.items() if g == group}
        return kind(
            **{name: np.ndarray(p.shape, p.dtype, buffer, p.offset) for name, p in mine.items()},
            **more,
        )

    final = views("final", ObservedArrays) if config.autoreset == SAME_STEP else None
    return views("shown", EmulatorArrays, final=final), views("command", CommandArrays)
