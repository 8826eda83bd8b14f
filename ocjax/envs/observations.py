"""The kinds of observations, and how each is computed.

The fields of each class are the options of the observation. A `Computed` observation is a pure JAX
function of a snapshot of the environments and of a memory, so it works with worker processes and
inside `jax.lax.scan`. B is the number of environments in a batch, and H x 160 the size of the
game's screen.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar, NamedTuple

import gymnasium as gym
import jax
import jax.numpy as jnp
import numpy as np

from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.extraction.records import FIELDS, no_objects
from ocjax.transforms import masks
from ocjax.vision.unknown import UNKNOWN


class Snapshot(NamedTuple):
    """The current state of a batch of environments, the input of observations."""

    rem: Objects | None  # of batch shape [B]
    vem: Objects | None  # of batch shape [B]
    gray: jax.Array | None  # uint8 [B, H, 160], the last emulated frame
    pooled: jax.Array | None  # uint8 [B, H, 160], the pixelwise maximum of the step's last two
    started: jax.Array  # bool [B], whether an episode has just begun
    # uint8 [B, H, 160] of palette indices, or [B, H, 160, 3] of RGB, the last emulated frame
    screen: jax.Array | None = None
    ram: jax.Array | None = None  # uint8 [B, 128]

    @property
    def objects(self) -> Objects:
        """The objects from RAM if they are extracted, else those from pixels."""
        objects = self.vem if self.rem is None else self.rem
        assert objects is not None  # `requested_kinds` rejects such observations in mode "raw"
        return objects


def push(started: jax.Array, latest: jax.Array, memory: jax.Array) -> jax.Array:
    """Append the latest entry, `[B, ...]`, to a memory `[B, n, ...]` and drop the oldest.

    At the start of an episode all entries become the latest one.
    """
    shifted = jnp.concatenate([memory[:, 1:], latest[:, None]], axis=1)
    started = started.reshape(-1, *[1] * (memory.ndim - 1))
    return jnp.where(started, jnp.broadcast_to(latest[:, None], shifted.shape), shifted)


@dataclass(frozen=True)
class Observation(ABC):
    """Base class of the kinds of observations: each is `Computed` or `Copied`."""

    needs_objects: ClassVar[bool] = False

    @property
    def screens(self) -> tuple[str, ...]:
        """The required pixel arrays, by their names in `EmulatorPool`."""
        return ()

    @abstractmethod
    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The observation space of one environment."""


class Computed(Observation):
    """An observation that is computed from the current snapshot and a carried memory."""

    def initial(self, game: Game, mode: str, num_envs: int) -> Any:
        """The memory before the first observation, a pytree of NumPy arrays `[num_envs, ...]`.

        JAX computes nothing here, so environments can be made before a process forks.
        """
        return ()

    @abstractmethod
    def update(self, game: Game, mode: str, snapshot: Snapshot, memory: Any) -> tuple[Any, Any]:
        """The observation, an array `[B, ...]` or a pytree of them, and the new memory."""


class Copied(Observation):
    """An observation that is a copy of an existing array."""

    @abstractmethod
    def source(self, arrays: Mapping[str, Any], objects: Mapping[str, Objects]) -> Any:
        """The array or pytree to copy.

        Args:
            arrays: the emulators' arrays by name, `[B, ...]`.
            objects: the objects by method, "rem" or "vem".
        """


def object_space(game: Game) -> gym.spaces.Dict:
    """The space of a game's `Objects` in one environment: a Dict of their fields."""
    n, (height, width) = game.num_slots, game.screen
    integers = np.iinfo(np.int32)
    return gym.spaces.Dict(
        xywh=gym.spaces.Box(0, max(height, width), (n, 4), np.int16),
        valid=gym.spaces.MultiBinary(n),
        orientation=gym.spaces.Box(UNKNOWN, 15, (n,), np.int8),
        value=gym.spaces.Box(integers.min, integers.max, (n,), np.int32),
        rgb=gym.spaces.Box(0, 255, (n, 3), np.uint8),
    )


def no_objects_of(game: Game, num_envs: int) -> Objects:
    """Empty slots, of batch shape `[num_envs]`, as NumPy arrays."""
    fields: Any = no_objects((num_envs,), game.num_slots)
    return Objects(**fields, game=game)


@dataclass(frozen=True)
class ObjectFields(Copied):
    """The fields of `Objects` as a Dict.

    In mode "both" it is a Dict of both methods, "rem" and "vem", each a Dict of fields.
    """

    needs_objects = True

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """See `Observation`."""
        one = object_space(game)
        return gym.spaces.Dict(rem=one, vem=object_space(game)) if mode == "both" else one

    def source(self, arrays: Mapping[str, Any], objects: Mapping[str, Objects]) -> Any:
        """The fields, with `valid` as int8."""
        fields = {
            method: {name: getattr(o, name) for name in FIELDS} | {"valid": o.valid.astype(np.int8)}
            for method, o in objects.items()
        }
        return fields if len(fields) > 1 else next(iter(fields.values()))


@dataclass(frozen=True)
class Dqn(Computed):
    """The frames of Mnih et al. (2015), uint8 `[stack, *size]`.

    Each frame is grey, the maximum of the step's last two emulated frames, and resized by area.
    With a frame skip of 1 it is the single emulated frame.

    Args:
        stack: number of steps, the latest last; all are the same at the start of an episode.
        max_pool: False takes the last frame only, as OCAtari does.
        size: (height, width).

    Raises:
        ValueError: the stack is below 1.
    """

    stack: int = 4
    max_pool: bool = True
    size: tuple[int, int] = (84, 84)

    def __post_init__(self) -> None:
        if self.stack < 1:
            raise ValueError(f"stack must be at least 1, got {self.stack}")

    @property
    def screens(self) -> tuple[str, ...]:
        """See `Observation`."""
        return ("pooled",) if self.max_pool else ("gray",)

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """See `Observation`."""
        return gym.spaces.Box(0, 255, (self.stack, *self.size), np.uint8)

    def initial(self, game: Game, mode: str, num_envs: int) -> Any:
        """See `Computed`."""
        return np.zeros((num_envs, self.stack, *self.size), np.uint8)

    def update(self, game: Game, mode: str, snapshot: Snapshot, memory: Any) -> tuple[Any, Any]:
        """See `Computed`."""
        frame = snapshot.pooled if self.max_pool else snapshot.gray
        assert frame is not None  # the environment records the arrays in `screens`
        memory = push(snapshot.started, masks.resize(frame, self.size), memory)
        return memory, memory


@dataclass(frozen=True)
class Masks(Computed):
    """Masks of objects, uint8 `[stack * planes, height, width]`.

    `ocjax.transforms.masks.masks` explains `kind`, `size`, `draw` and `pixels`.

    Args:
        kind: the kind of mask.
        size: (height, width), or None for the size of the screen.
        draw: "output", "screen" or "pixels".
        pixels: whether the grey frame is appended as a plane.
        stack: number of steps, the latest last; all are the same at the start of an episode.

    Raises:
        ValueError: the kind or `draw` is unknown, or the stack is below 1.
    """

    needs_objects = True

    kind: masks.MaskKind = "object"
    _: KW_ONLY
    size: tuple[int, int] | None = (84, 84)
    draw: masks.Draw = "output"
    pixels: bool = False
    stack: int = 4

    def __post_init__(self) -> None:
        if self.kind not in masks.KINDS or self.draw not in masks.DRAWS or self.stack < 1:
            raise ValueError(
                f"kind must be one of {masks.KINDS}, draw one of {masks.DRAWS}, stack at least "
                f"1, got {self}"
            )

    @property
    def screens(self) -> tuple[str, ...]:
        """See `Observation`."""
        gray = ("gray",) if self.pixels or self.kind == "object" else ()
        return (*gray, "screen") if self.draw == "pixels" else gray

    def _shape(self, game: Game) -> tuple[int, ...]:
        return (
            self.stack,
            masks.num_planes(game, self.kind, self.pixels),
            *(self.size or game.screen),
        )

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """See `Observation`."""
        stack, planes, *size = self._shape(game)
        return gym.spaces.Box(0, 255, (stack * planes, *size), np.uint8)

    def initial(self, game: Game, mode: str, num_envs: int) -> Any:
        """See `Computed`."""
        return np.zeros((num_envs, *self._shape(game)), np.uint8)

    def update(self, game: Game, mode: str, snapshot: Snapshot, memory: Any) -> tuple[Any, Any]:
        """See `Computed`."""
        drawn = masks.masks(
            snapshot.objects,
            self.kind,
            gray=snapshot.gray,
            frames=snapshot.screen,
            size=self.size,
            draw=self.draw,
            pixels=self.pixels,
        )
        memory = push(snapshot.started, drawn, memory)
        return memory.reshape(memory.shape[0], -1, *memory.shape[3:]), memory


@dataclass(frozen=True)
class TerrainCells(Computed):
    """The cells that contain each kind of terrain, uint8 0 or 1 `[kinds, rows, columns]`.

    The kinds are `game.terrain`, read from RAM in every mode.

    Args:
        cell: height and width of a cell in pixels.
        around: rows and columns of cells around the middle of the player, or None for the screen.
            Cells beyond the screen are 0, and all are 0 without a player.

    Raises:
        ValueError: a number is below 1.
    """

    cell: tuple[int, int] = (8, 8)
    _: KW_ONLY
    around: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        if min(*self.cell, *(self.around or (1, 1))) < 1:
            raise ValueError(f"cell and around must be at least 1, got {self}")

    @property
    def needs_objects(self) -> bool:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Whether the observation depends on the player's place."""
        return self.around is not None

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """See `Observation`.

        Raises:
            ValueError: the game has no terrain, or `around` is given and it has no player.
        """
        if game.terrain is None:
            raise ValueError(f"{game.name} has no terrain: choose another observation")
        if self.around is not None:
            player_slot(game)
        height, width = game.screen
        rows, columns = self.around or (-(-height // self.cell[0]), -(-width // self.cell[1]))
        return gym.spaces.Box(0, 1, (len(game.terrain), rows, columns), np.uint8)

    def update(self, game: Game, mode: str, snapshot: Snapshot, memory: Any) -> tuple[Any, Any]:
        """See `Computed`."""
        assert snapshot.ram is not None  # every environment reads the RAM
        terrain = game.terrain_of(snapshot.ram)
        if self.around is None:
            return terrain.grid(self.cell).astype(jnp.uint8), memory
        slot = player_slot(game)
        x, y = jnp.moveaxis(snapshot.objects.center[:, slot], -1, 0).astype(jnp.int32)
        own = jax.vmap(self._around)(terrain.masks, x, y)
        there = snapshot.objects.valid[:, slot].reshape(-1, 1, 1, 1)
        return jnp.where(there, own, jnp.uint8(0)), memory

    def _around(self, masks: jax.Array, x: jax.Array, y: jax.Array) -> jax.Array:
        """Cells around a pixel, uint8 `[kinds, rows, columns]`, from `[kinds, H, W]`."""
        assert self.around is not None
        (rows, columns), (height, width) = self.around, self.cell
        size = rows * height, columns * width
        padded = jnp.pad(masks, ((0, 0), (size[0], size[0]), (size[1], size[1])))
        start = jnp.int32(0), y + size[0] - size[0] // 2, x + size[1] - size[1] // 2
        window = jax.lax.dynamic_slice(padded, start, (len(masks), *size))
        cells = window.reshape(len(masks), rows, height, columns, width)
        return cells.any((2, 4)).astype(jnp.uint8)


def player_slot(game: Game) -> int:
    """The first slot of the player; raises ValueError if the game has none."""
    for category in game.categories:
        if category.role == "player":
            return game.slices[category.name].start
    raise ValueError(f"{game.name} has no category with the role 'player'")


@dataclass(frozen=True)
class Pixels(Copied):
    """The last emulated frame in RGB, uint8 `[H, 160, 3]`."""

    @property
    def screens(self) -> tuple[str, ...]:
        """See `Observation`."""
        return ("rgb",)

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """See `Observation`."""
        return gym.spaces.Box(0, 255, (*game.screen, 3), np.uint8)

    def source(self, arrays: Mapping[str, Any], objects: Mapping[str, Objects]) -> Any:
        """See `Copied`."""
        return arrays["rgb"][:, -1]


@dataclass(frozen=True)
class Ram(Copied):
    """The RAM, uint8 `[128]`."""

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """See `Observation`."""
        return gym.spaces.Box(0, 255, (128,), np.uint8)

    def source(self, arrays: Mapping[str, Any], objects: Mapping[str, Objects]) -> Any:
        """See `Copied`."""
        return arrays["ram"]
