"""What an environment's observations are made of.

A kind of observation is a small class of options. Its `update` is a pure JAX function of what there is to see now and of its memory (what
it keeps from one step to the next), so that the same code serves environments in worker processes and inside `jax.lax.scan`.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar, Literal, NamedTuple

import gymnasium as gym
import jax
import jax.numpy as jnp
import numpy as np

from ocjax import masks
from ocjax.game import Game
from ocjax.objects import Objects
from ocjax.tracking import track

FEATURES = ("x", "y", "w", "h", "dx", "dy", "orientation", "value", "valid")
_LARGE = np.log1p(1e6)  # a value of a million is 1 where features are normalised


class Now(NamedTuple):
    """What there is to see in a batch of `B` environments."""

    rem: Objects | None
    vem: Objects | None
    gray: jax.Array | None  # uint8 [B, 2, H, 160], the last two emulated frames
    started: jax.Array  # bool [B]: an episode began

    @property
    def objects(self) -> Objects:
        """From RAM where that is extracted, else from pixels."""
        found = self.vem if self.rem is None else self.rem
        assert found is not None  # the environment refuses observations of objects that it does not extract
        return found


def _fresh(started: jax.Array, new: jax.Array, old: jax.Array) -> jax.Array:
    """`new` where an episode began, else `old`."""
    return jnp.where(started.reshape(-1, *[1] * (old.ndim - 1)), new, old)


def _stacked(started: jax.Array, latest: jax.Array, memory: jax.Array) -> jax.Array:
    """The memory with the latest added and the oldest dropped; all the latest where an episode began."""
    moved = jnp.concatenate([memory[:, 1:], latest[:, None]], axis=1)
    return _fresh(started, jnp.broadcast_to(latest[:, None], moved.shape), moved)


@dataclass(frozen=True)
class Observation(ABC):
    """Base of the kinds: either `Computed` or `Copied`."""

    needs_objects: ClassVar[bool] = False

    @property
    def screens(self) -> tuple[str, ...]:
        """Arrays of pixels that it needs."""
        return ()

    @abstractmethod
    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The space of one environment."""


class Computed(Observation):
    """Computed from what there is to see, and from what it remembers of the steps before."""

    def initial(self, game: Game, mode: str, num_envs: int) -> Any:
        """The memory before the first observation."""
        return ()

    @abstractmethod
    def update(self, game: Game, mode: str, now: Now, memory: Any) -> tuple[Any, Any]:
        """The observation of a batch, and the new memory."""


class Copied(Observation):
    """A copy of something that is there anyway."""

    @abstractmethod
    def source(self, arrays: Mapping[str, Any], objects: Mapping[str, Objects]) -> Any:
        """What it is a copy of, from the emulators' arrays and each method's objects."""


def object_space(game: Game) -> gym.spaces.Dict:
    """The space of a game's `Objects` for one environment, as a Dict of its fields."""
    n, (height, width) = game.num_slots, game.screen
    integers = np.iinfo(np.int32)
    return gym.spaces.Dict(
        xywh=gym.spaces.Box(0, max(height, width), (n, 4), np.int16),
        valid=gym.spaces.MultiBinary(n),
        orientation=gym.spaces.Box(0, 15, (n,), np.int8),
        value=gym.spaces.Box(integers.min, integers.max, (n,), np.int32),
        rgb=gym.spaces.Box(0, 255, (n, 3), np.uint8),
    )


@dataclass(frozen=True)
class ObjectFields(Copied):
    """The fields of `Objects` as a Dict of arrays `[N, ...]`; in mode "both" a Dict of both methods' ("rem", "vem")."""

    needs_objects = True

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The space of one environment."""
        one = object_space(game)
        return gym.spaces.Dict(rem=one, vem=object_space(game)) if mode == "both" else one

    def source(self, arrays: Mapping[str, Any], objects: Mapping[str, Objects]) -> Any:
        """What it is a copy of."""
        fields = {
            name: {"xywh": o.xywh, "valid": o.valid.astype(np.int8), "orientation": o.orientation, "value": o.value, "rgb": o.rgb}
            for name, o in objects.items()
        }
        return fields if len(fields) > 1 else next(iter(fields.values()))


@dataclass(frozen=True)
class Vector(Computed):
    """Features of all slots as one flat float32 vector.

    The order is: states from the oldest to the latest, slots in the game's order, features in the order named (`features_of` names
    each number). A slot that is not valid is zero. dx and dy are the movement of the centre since the step before, zero where the object
    was not there or an episode began. In mode "vem" identities are tracked from step to step (`ocjax.track`).

    Args:
        features: of x, y, w, h, dx, dy, orientation, value, valid.
        history: states.
        normalize: lengths in screen widths or heights, orientations in turns, values as sign(v) log(1 + |v|) / log(1 + 10^6); else
            pixels, compass points 0-15 and values.

    Raises:
        ValueError: unknown features or none, a history below 1.
    """

    needs_objects = True

    features: tuple[str, ...] = ("x", "y", "w", "h", "dx", "dy", "valid")
    _: KW_ONLY
    history: int = 1
    normalize: bool = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "features", tuple(self.features))
        if not self.features or not set(self.features) <= set(FEATURES) or len(set(self.features)) < len(self.features):
            raise ValueError(f"features must be different ones of {', '.join(FEATURES)}, got {self.features}")
        if self.history < 1:
            raise ValueError(f"history must be at least 1, got {self.history}")

    def features_of(self, game: Game) -> tuple[tuple[int, str, int, str], ...]:
        """What each number is: (steps ago, category, slot within it, feature)."""
        slots = [(c.name, i) for c in game.categories for i in range(c.count)]
        return tuple((ago, name, i, f) for ago in reversed(range(self.history)) for name, i in slots for f in self.features)

    def _scale(self, game: Game) -> dict[str, tuple[float, float, float]]:
        """Feature -> (its unit, least and most of it)."""
        height, width = game.screen
        integers = np.iinfo(np.int32)
        most = {"x": width, "y": height, "w": width, "h": height, "orientation": 16, "valid": 1, "dx": width, "dy": height}
        out = {f: (float(n) if self.normalize else 1.0, -n if f in ("dx", "dy") else 0.0, float(n)) for f, n in most.items()}
        out = {f: (unit, low / unit, high / unit) for f, (unit, low, high) in out.items()}
        limit = float(np.log1p(2.0**31) / _LARGE)
        out["value"] = (1.0, -limit, limit) if self.normalize else (1.0, float(integers.min), float(integers.max))
        return out

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The space of one environment."""
        bounds = np.array([self._scale(game)[f][1:] for f in self.features], np.float32)
        low, high = np.tile(bounds, (self.history * game.num_slots, 1)).T
        return gym.spaces.Box(low, high, dtype=np.float32)

    def initial(self, game: Game, mode: str, num_envs: int) -> Any:
        """The memory before the first observation: the objects before, and the states before."""
        n = game.num_slots
        shapes = jax.eval_shape(game.rem, jax.ShapeDtypeStruct((num_envs, 128), jnp.uint8))
        before = jax.tree.map(lambda s: jnp.zeros(s.shape, s.dtype), shapes)
        return before, jnp.zeros((num_envs, self.history, n * len(self.features)), jnp.float32)

    def update(self, game: Game, mode: str, now: Now, memory: Any) -> tuple[Any, Any]:
        """The observation of a batch, and the new memory."""
        before, history = memory
        objects = now.objects
        if mode == "vem":
            objects = track(before, objects, is_first=now.started)
        there = objects.valid & before.valid & ~now.started[:, None]
        moved = jnp.where(there[..., None], objects.center - before.center, jnp.float32(0))
        scale, columns = self._scale(game), []
        for name in self.features:
            column = moved[..., ("dx", "dy").index(name)] if name in ("dx", "dy") else getattr(objects, name).astype(jnp.float32)
            if name == "value" and self.normalize:
                column = jnp.sign(column) * jnp.log1p(jnp.abs(column)) / jnp.float32(_LARGE)
            columns.append(column / jnp.float32(scale[name][0]))
        latest = jnp.stack(columns, axis=-1).reshape(objects.valid.shape[0], -1)
        history = _stacked(now.started, latest, history)
        return history.reshape(history.shape[0], -1), (objects, history)


@dataclass(frozen=True)
class Dqn(Computed):
    """Frames as DQN has them: uint8 `[stack, 84, 84]` of grey, each the brighter of the last two emulated frames, resized over areas.

    Args:
        stack: steps, the latest last; all the same when an episode begins.
        max_pool: False takes the last frame alone, as OCAtari does.
        size: (height, width).
    """

    stack: int = 4
    max_pool: bool = True
    size: tuple[int, int] = (84, 84)

    def __post_init__(self) -> None:
        if self.stack < 1:
            raise ValueError(f"stack must be at least 1, got {self.stack}")

    @property
    def screens(self) -> tuple[str, ...]:
        """Arrays of pixels that it needs."""
        return ("gray",)

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The space of one environment."""
        return gym.spaces.Box(0, 255, (self.stack, *self.size), np.uint8)

    def initial(self, game: Game, mode: str, num_envs: int) -> Any:
        """The memory before the first observation."""
        return jnp.zeros((num_envs, self.stack, *self.size), jnp.uint8)

    def update(self, game: Game, mode: str, now: Now, memory: Any) -> tuple[Any, Any]:
        """The observation of a batch, and the new memory."""
        assert now.gray is not None  # the environment gives what `screens` names
        frame = jnp.maximum(now.gray[:, 0], now.gray[:, 1]) if self.max_pool else now.gray[:, 1]
        memory = _stacked(now.started, masks.resize(frame, self.size), memory)
        return memory, memory


@dataclass(frozen=True)
class Masks(Computed):
    """Objects drawn as masks, uint8 `[stack * planes, height, width]`; see `ocjax.masks.masks` for the kinds and options."""

    needs_objects = True

    kind: masks.Kind = "object"
    _: KW_ONLY
    size: tuple[int, int] | None = (84, 84)
    draw: Literal["output", "screen"] = "output"
    pixels: bool = False
    stack: int = 4

    def __post_init__(self) -> None:
        if self.kind not in masks.KINDS or self.draw not in ("output", "screen") or self.stack < 1:
            raise ValueError(f"kind must be one of {masks.KINDS}, draw 'output' or 'screen', stack at least 1, got {self}")

    @property
    def screens(self) -> tuple[str, ...]:
        """Arrays of pixels that it needs."""
        return ("gray",) if self.pixels or self.kind == "object" else ()

    def _shape(self, game: Game) -> tuple[int, ...]:
        return (self.stack, masks.num_planes(game, self.kind, self.pixels), *(self.size or game.screen))

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The space of one environment."""
        stack, planes, *size = self._shape(game)
        return gym.spaces.Box(0, 255, (stack * planes, *size), np.uint8)

    def initial(self, game: Game, mode: str, num_envs: int) -> Any:
        """The memory before the first observation."""
        return jnp.zeros((num_envs, *self._shape(game)), jnp.uint8)

    def update(self, game: Game, mode: str, now: Now, memory: Any) -> tuple[Any, Any]:
        """The observation of a batch, and the new memory."""
        gray = None if now.gray is None else now.gray[:, 1]
        drawn = masks.masks(now.objects, self.kind, gray=gray, size=self.size, draw=self.draw, pixels=self.pixels)
        memory = _stacked(now.started, drawn, memory)
        return memory.reshape(memory.shape[0], -1, *memory.shape[3:]), memory


@dataclass(frozen=True)
class Pixels(Copied):
    """The last emulated frame, uint8 `[H, 160, 3]` of RGB."""

    @property
    def screens(self) -> tuple[str, ...]:
        """Arrays of pixels that it needs."""
        return ("rgb",)

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The space of one environment."""
        return gym.spaces.Box(0, 255, (*game.screen, 3), np.uint8)

    def source(self, arrays: Mapping[str, Any], objects: Mapping[str, Objects]) -> Any:
        """What it is a copy of."""
        return arrays["rgb"][:, -1]


@dataclass(frozen=True)
class Ram(Copied):
    """The RAM, uint8 `[128]`."""

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The space of one environment."""
        return gym.spaces.Box(0, 255, (128,), np.uint8)

    def source(self, arrays: Mapping[str, Any], objects: Mapping[str, Objects]) -> Any:
        """What it is a copy of."""
        return arrays["ram"]


Kind = Computed | Copied
NAMES: Mapping[str, Kind] = {
    "objects": ObjectFields(), "vector": Vector(), "dqn": Dqn(), "pixels": Pixels(), "ram": Ram(), "object_masks": Masks("object"),
    "binary_masks": Masks("binary"), "class_masks": Masks("class"), "planes": Masks("planes"),
}  # fmt: skip

Wanted = str | Kind | Sequence[str] | Mapping[str, str | Kind]


def parse(obs: Wanted) -> Kind | dict[str, Kind]:
    """An observation by name, by its class, or several in a dict.

    Raises:
        ValueError: no observation of that name.
    """
    if isinstance(obs, Kind):
        return obs
    if isinstance(obs, str):
        if obs not in NAMES:
            raise ValueError(f"no observation {obs!r}: there are {', '.join(NAMES)}, and the classes in ocjax.envs with options")
        return NAMES[obs]
    named = obs if isinstance(obs, Mapping) else {name: name for name in obs}
    if not named:
        raise ValueError("several observations were asked for, but none was named")
    out = {name: parse(one) for name, one in named.items()}
    if not all(isinstance(one, Kind) for one in out.values()):
        raise ValueError(f"several observations must be names or classes, not several again: {obs!r}")
    return out  # pyright: ignore[reportReturnType]
