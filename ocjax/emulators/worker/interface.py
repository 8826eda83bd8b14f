"""The data that a pool shares with its workers: commands, configuration and arrays.

The pool sends numbered commands over the socket. The worker records the number of an executed
command in `CommandArrays.finished`, replies with one byte to wake the pool up, and writes errors to
stderr. A command with an old number is not executed again.
"""

import dataclasses
import json
import struct
from dataclasses import dataclass, field
from typing import Any, Self, TypeVar

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
    rom_path: str
    actions: tuple[int, ...]  # ale-py's numbers of the game's actions
    frame_skip: tuple[int, int]  # fewest emulated frames per step, and one more than the most
    repeat_action_probability: float
    max_episode_frames: int
    max_episode_steps: int | None
    noop_max: int
    start_actions: tuple[int, ...]  # indices of the first actions of each episode, one step each
    episodic_life: bool
    game_modes: tuple[int | None, ...]  # one per emulator of the pool, None for the game's default
    game_difficulties: tuple[int | None, ...]  # one per emulator of the pool
    # The name of each hook, and the hook pickled by value, in hexadecimal.
    hooks: tuple[tuple[str, str], ...]
    # In the same form, the hooks at the start of games, for each emulator of the pool.
    starts: tuple[tuple[tuple[str, str], ...], ...]

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
    """The arrays for observations and `info`, for N emulators with screens of H x W pixels."""

    ram: np.ndarray = field(metadata=_array("uint8", 128))
    lives: np.ndarray = field(metadata=_array("int32"))
    # Since the game began: emulated frames, unclipped rewards, and agent steps.
    frame_number: np.ndarray = field(metadata=_array("int64"))
    episode_return: np.ndarray = field(metadata=_array("float64"))
    episode_length: np.ndarray = field(metadata=_array("int64"))
    # The step ended the game: the next episode begins a new one.
    game_over: np.ndarray = field(metadata=_array("bool"))
    # ale-py's number of the action of the last emulated frame.
    executed: np.ndarray = field(metadata=_array("int32"))
    # Palette indices of the last two emulated frames, the latest last.
    screen: np.ndarray | None = field(default=None, metadata=_screen(2))
    # The last emulated frame in grey.
    gray: np.ndarray | None = field(default=None, metadata=_screen(1))
    # The pixelwise maximum of the step's last two frames in grey.
    pooled: np.ndarray | None = field(default=None, metadata=_screen(1))
    rgb: np.ndarray | None = field(default=None, metadata=_screen(1, 3))  # the last emulated frame


@dataclass(frozen=True, kw_only=True, slots=True)
class EmulatorArrays(ObservedArrays):
    """The results of a step."""

    reward: np.ndarray = field(metadata=_array("float64"))  # unclipped
    terminated: np.ndarray = field(metadata=_array("bool"))
    truncated: np.ndarray = field(metadata=_array("bool"))
    started: np.ndarray = field(metadata=_array("bool"))  # an episode began in this step
    # With same-step autoreset: the arrays at the end of each emulator's last episode.
    final: ObservedArrays | None = None


@dataclass(frozen=True, kw_only=True, slots=True)
class CommandArrays:
    """Arguments and results of the commands."""

    action: np.ndarray = field(metadata=_array("int32"))  # STEP: index into the action set
    strength: np.ndarray = field(metadata=_array("float32"))  # STEP: fraction of a paddle's speed
    seed: np.ndarray = field(metadata=_array("int64"))  # RESET: -1 for none
    # RESET, RESTORE and WRITE: the emulators that the command applies to.
    chosen: np.ndarray = field(metadata=_array("bool"))
    loaded: np.ndarray = field(metadata=_array("bool"))  # the emulator has loaded its ROM
    # RESTORE: the emulator did not accept its state.
    rejected: np.ndarray = field(metadata=_array("bool"))
    new_ram: np.ndarray = field(metadata=_array("uint8", 128))  # WRITE: the desired RAM
    # SAVE and RESTORE, the fields of `snapshot.EmulatorState`; the generator is PCG64's, in words.
    state: np.ndarray = field(metadata=_array("uint8", STATE_BYTES))
    state_bytes: np.ndarray = field(metadata=_array("int64"))
    phase: np.ndarray = field(metadata=_array("uint8"))
    held_strength: np.ndarray = field(metadata=_array("float32"))
    generator: np.ndarray = field(metadata=_array("uint64", 6))
    before: np.ndarray = field(metadata=_array("uint8", 128))
    has_before: np.ndarray = field(metadata=_array("bool"))
    # The number of the worker's last command, in the row of its first emulator; negative after a
    # failure.
    finished: np.ndarray = field(metadata=_array("int64"))


SCREENS: dict[str, int] = {
    f.name: f.metadata["frames"]
    for f in dataclasses.fields(ObservedArrays)
    if "frames" in f.metadata
}
GRAY, POOLED = "gray", "pooled"
OBSERVED: tuple[str, ...] = tuple(f.name for f in dataclasses.fields(ObservedArrays))

_Arrays = TypeVar("_Arrays", ObservedArrays, EmulatorArrays, CommandArrays)


def _layout(config: WorkerConfig) -> tuple[dict[tuple[str, str], tuple[Any, ...]], int]:
    """The shape, dtype and offset of each array, by group and name, and the total size in bytes."""
    groups: list[tuple[str, type]] = [("shown", EmulatorArrays), ("command", CommandArrays)]
    if config.autoreset == SAME_STEP:
        groups.append(("final", ObservedArrays))
    places, offset = {}, 0
    for group, kind in groups:
        for f in dataclasses.fields(kind):
            if "dtype" in f.metadata:
                dtype, shape = f.metadata["dtype"], (config.num_envs, *f.metadata["shape"])
            elif f.name in config.screens:
                frame = (*config.screen_size, *f.metadata["channels"])
                dtype, shape = "uint8", (config.num_envs, f.metadata["frames"], *frame)
            else:
                continue
            places[group, f.name] = shape, dtype, offset
            offset += -(-int(np.prod(shape)) * np.dtype(dtype).itemsize // ALIGNMENT) * ALIGNMENT
    return places, offset


def memory_size(config: WorkerConfig) -> int:
    """Bytes of shared memory for a pool."""
    return _layout(config)[1]


def shared_arrays(buffer: Any, config: WorkerConfig) -> tuple[EmulatorArrays, CommandArrays]:
    """The arrays of a pool as views of its shared memory."""
    places, _ = _layout(config)

    def views(group: str, kind: type[_Arrays], **more: Any) -> _Arrays:
        arrays = {
            name: np.ndarray(shape, dtype, buffer, offset)
            for (g, name), (shape, dtype, offset) in places.items()
            if g == group
        }
        return kind(**arrays, **more)

    final = views("final", ObservedArrays) if config.autoreset == SAME_STEP else None
    return views("shown", EmulatorArrays, final=final), views("command", CommandArrays)
