"""The kinds of observations, and how each is computed.

Each kind is a small class whose fields are its options. An observation that needs computation is a pure JAX function of a snapshot of the
environments and of a memory, which carries state from one step to the next. The same code therefore works with worker processes and inside
`jax.lax.scan`.
Below, B is the number of environments in a batch, and H x 160 is the size of the game's screen.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass
from typing import Any, ClassVar, Literal, NamedTuple, get_args

import gymnasium as gym
import jax
import jax.numpy as jnp
import numpy as np

from ocjax.extraction.categories import Category
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.extraction.records import FIELDS, no_objects
from ocjax.transforms import masks
from ocjax.transforms.tracking import track
from ocjax.vision.unknown import UNKNOWN, UNKNOWN_VALUE

FEATURES = ("x", "y", "w", "h", "dx", "dy", "nx", "ny", "mx", "my", "orientation", "value", "valid")
NEAR, MIDDLE = 8.0, 32.0  # pixels
_VALUE_UNIT = np.log1p(1e6)  # a value of a million is normalised to 1


class Snapshot(NamedTuple):
    """The present state of a batch of environments, from which observations are computed."""

    rem: Objects | None  # of batch shape [B]
    vem: Objects | None  # of batch shape [B]
    gray: jax.Array | None  # uint8 [B, H, 160], the last emulated frame
    pooled: jax.Array | None  # uint8 [B, H, 160], the pixelwise maximum of the last two
    started: jax.Array  # bool [B], whether an episode has just begun

    @property
    def objects(self) -> Objects:
        """The objects from RAM if they are extracted, else those from pixels."""
        objects = self.vem if self.rem is None else self.rem
        assert objects is not None  # environments refuse observations of objects that they do not extract
        return objects


def _push(started: jax.Array, latest: jax.Array, memory: jax.Array) -> jax.Array:
    """Drop the oldest entry of a memory `[B, n, ...]` and append the latest, `[B, ...]`; at the start of an episode all are the latest."""
    shifted = jnp.concatenate([memory[:, 1:], latest[:, None]], axis=1)
    started = started.reshape(-1, *[1] * (memory.ndim - 1))
    return jnp.where(started, jnp.broadcast_to(latest[:, None], shifted.shape), shifted)


@dataclass(frozen=True)
class Observation(ABC):
    """Base class of the kinds of observations, each of which is either `Computed` or `Copied`."""

    needs_objects: ClassVar[bool] = False

    @property
    def screens(self) -> tuple[str, ...]:
        """The pixel arrays that it needs, by their names in `EmulatorPool`."""
        return ()

    @abstractmethod
    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The observation space of one environment."""


class Computed(Observation):
    """An observation that is computed from the current snapshot and a carried memory."""

    def initial(self, game: Game, mode: str, num_envs: int) -> Any:
        """The memory before the first observation, a pytree of NumPy arrays `[num_envs, ...]`.

        Environments are made without a computation by JAX, so that they can be made before processes are forked.
        """
        return ()

    @abstractmethod
    def update(self, game: Game, mode: str, snapshot: Snapshot, memory: Any) -> tuple[Any, Any]:
        """The observation, an array `[B, ...]` or a pytree of them, and the new memory."""


class Copied(Observation):
    """An observation that is a copy of an existing array."""

    @abstractmethod
    def source(self, arrays: Mapping[str, Any], objects: Mapping[str, Objects]) -> Any:
        """What is copied.

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


def _no_objects(game: Game, num_envs: int) -> Objects:
    """Empty slots, of batch shape `[num_envs]`, in NumPy's arrays."""
    fields: Any = no_objects((num_envs,), game.num_slots)
    return Objects(**fields, game=game)


@dataclass(frozen=True)
class ObjectFields(Copied):
    """The fields of `Objects` as a Dict; in mode "both" a Dict of the fields of each method, "rem" and "vem"."""

    needs_objects = True

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The observation space of one environment."""
        one = object_space(game)
        return gym.spaces.Dict(rem=one, vem=object_space(game)) if mode == "both" else one

    def source(self, arrays: Mapping[str, Any], objects: Mapping[str, Objects]) -> Any:
        """What is copied: the fields, with `valid` as int8."""
        fields = {method: {name: getattr(o, name) for name in FIELDS} | {"valid": o.valid.astype(np.int8)} for method, o in objects.items()}
        return fields if len(fields) > 1 else next(iter(fields.values()))


@dataclass(frozen=True)
class Vector(Computed):
    """Features of all slots as one flat vector, float32 `[history * n]`, where n is the number of features of all slots.

    Entries are ordered by time from the oldest state to the latest, then by slot in the game's order, then by feature in the order given;
    `features_of` names each entry. Slots that are not valid are zero. dx and dy are the movement of the centre since the previous step.
    They are zero if the object was not valid before, or if an episode has just begun. nx and ny are tanh(d / 8) of the distance d in pixels
    from the centre of the first slot's object, which is the player in most games, to the object's centre; mx and my are tanh(d / 32). They
    are zero while there is no player. nx and ny resolve positions next to the player finely but are nearly constant beyond 20 pixels, where
    mx and my still tell what approaches. In mode "vem", `ocjax.track` keeps objects in the same slots from step to step.

    Args:
        features: distinct names of x, y, w, h, dx, dy, nx, ny, mx, my, orientation, value and valid, for all slots. With None,
            a slot has x, y, w, h, dx and dy, then orientation and value if its category has them, and valid. Display objects that have a
            value, such as scores, do not have x to dy: their boxes only tell how many digits are shown.
        grid_features: likewise, for the slots of fixed grids such as Breakout's bricks, whose objects never move
            (`Category.on_grid`). With None, they have the same features as others.
        history: number of states.
        normalize: whether features are scaled: lengths to units of the screen's width or height, orientations to turns, and values v to
            sign(v) log(1 + |v|) / log(1 + 10^6). Without it, lengths are in pixels and orientations are compass points 0 to 15.
            Orientations that are not known, as in mode "vem", are -1, or -1/16 turns. Values that VEM cannot read are those of v = -1.

    Raises:
        ValueError: a feature is unknown or repeated, there is none, or the history is below 1.
    """

    needs_objects = True

    features: tuple[str, ...] | None = None
    _: KW_ONLY
    grid_features: tuple[str, ...] | None = None
    history: int = 1
    normalize: bool = True

    def __post_init__(self) -> None:
        for option in ("features", "grid_features"):
            names = getattr(self, option)
            if names is not None:
                object.__setattr__(self, option, tuple(names))
                if not names or not set(names) <= set(FEATURES) or len(set(names)) < len(names):
                    raise ValueError(f"{option} must be None or distinct names of {', '.join(FEATURES)}, got {names}")
        if self.history < 1:
            raise ValueError(f"history must be at least 1, got {self.history}")

    def features_of(self, game: Game) -> tuple[tuple[int, str, int, str], ...]:
        """The meaning of each number: (steps ago, category, index within the category, feature)."""
        slots = [(c.name, i, self._features(c)) for c in game.categories for i in range(c.count)]
        return tuple((ago, name, i, f) for ago in reversed(range(self.history)) for name, i, features in slots for f in features)

    def _features(self, category: Category) -> tuple[str, ...]:
        """The features of a category's slots."""
        if self.grid_features is not None and category.on_grid:
            return self.grid_features
        if self.features is not None:
            return self.features
        box = () if category.hud and "value" in category.attributes else ("x", "y", "w", "h", "dx", "dy")
        return (*box, *(name for name in ("orientation", "value") if name in category.attributes), "valid")

    def _runs(self, game: Game) -> list[tuple[slice, tuple[str, ...]]]:
        """The slots in as few runs as possible that have the same features, with these features."""
        runs: list[tuple[slice, tuple[str, ...]]] = []
        for category, s in zip(game.categories, game.slices.values(), strict=True):
            features = self._features(category)
            if runs and runs[-1][1] == features:
                runs[-1] = (slice(runs[-1][0].start, s.stop), features)
            else:
                runs.append((s, features))
        return runs

    def _scales(self, game: Game) -> dict[str, tuple[float, float, float]]:
        """The unit of each feature, and its least and greatest number in this unit."""
        height, width = game.screen
        integers = np.iinfo(np.int32)
        most = {"x": width, "y": height, "w": width, "h": height, "orientation": 16, "valid": 1, "dx": width, "dy": height}
        relative = ("nx", "ny", "mx", "my")
        most |= dict.fromkeys(relative, 1)
        least = {"orientation": UNKNOWN, "dx": -width, "dy": -height} | dict.fromkeys(relative, -1)
        out = {f: (float(n) if self.normalize else 1.0, float(least.get(f, 0)), float(n)) for f, n in most.items()}
        out = {f: (unit, low / unit, high / unit) for f, (unit, low, high) in out.items()}
        limit = float(np.log1p(2.0**31) / _VALUE_UNIT)
        out["value"] = (1.0, -limit, limit) if self.normalize else (1.0, float(integers.min), float(integers.max))
        return out

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The observation space of one environment."""
        scales = self._scales(game)
        low, high = np.array([scales[f][1:] for *_, f in self.features_of(game)], np.float32).T
        return gym.spaces.Box(low, high, dtype=np.float32)

    def initial(self, game: Game, mode: str, num_envs: int) -> Any:
        """The memory before the first observation: the previous objects, and the previous states."""
        n = len(self.features_of(game)) // self.history
        return _no_objects(game, num_envs), np.zeros((num_envs, self.history, n), np.float32)

    def update(self, game: Game, mode: str, snapshot: Snapshot, memory: Any) -> tuple[Any, Any]:
        """The observation and the new memory."""
        previous, history = memory
        objects = snapshot.objects
        if mode == "vem":
            objects = track(previous, objects, is_first=snapshot.started)
        continued = objects.valid & previous.valid & ~snapshot.started[:, None]
        moved = jnp.where(continued[..., None], objects.center - previous.center, jnp.float32(0))
        both = objects.valid & objects.valid[:, :1]
        distance = jnp.where(both[..., None], objects.center - objects.center[:, :1], jnp.float32(0))
        vectors = {"d": moved, "n": jnp.tanh(distance / jnp.float32(NEAR)), "m": jnp.tanh(distance / jnp.float32(MIDDLE))}
        derived = {name + axis: v[..., i] for name, v in vectors.items() for i, axis in enumerate("xy")}
        columns = {f: self._column(game, f, derived[f] if f in derived else getattr(objects, f)) for f in FEATURES}
        parts = [jnp.stack([columns[f][:, s] for f in features], axis=-1) for s, features in self._runs(game)]
        latest = jnp.concatenate([part.reshape(part.shape[0], -1) for part in parts], axis=-1)
        history = _push(snapshot.started, latest, history)
        return history.reshape(history.shape[0], -1), (objects, history)

    def _column(self, game: Game, name: str, numbers: jax.Array) -> jax.Array:
        """A feature of all slots in its unit, float32 `[B, N]`."""
        if name == "value":
            numbers = jnp.where(numbers == UNKNOWN_VALUE, jnp.int32(UNKNOWN), numbers)
        column = numbers.astype(jnp.float32)
        if name == "value" and self.normalize:
            column = jnp.sign(column) * jnp.log1p(jnp.abs(column)) / jnp.float32(_VALUE_UNIT)
        return column / jnp.float32(self._scales(game)[name][0])


@dataclass(frozen=True)
class Dqn(Computed):
    """The frames of Mnih et al. (2015): grey, the maximum of the last two emulated frames, resized by area, uint8 `[stack, *size]`.

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
        """The pixel arrays that it needs."""
        return ("pooled",) if self.max_pool else ("gray",)

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The observation space of one environment."""
        return gym.spaces.Box(0, 255, (self.stack, *self.size), np.uint8)

    def initial(self, game: Game, mode: str, num_envs: int) -> Any:
        """The memory before the first observation: the stack."""
        return np.zeros((num_envs, self.stack, *self.size), np.uint8)

    def update(self, game: Game, mode: str, snapshot: Snapshot, memory: Any) -> tuple[Any, Any]:
        """The observation and the new memory, which are the same."""
        frame = snapshot.pooled if self.max_pool else snapshot.gray
        assert frame is not None  # the environment records what `screens` names
        memory = _push(snapshot.started, masks.resize(frame, self.size), memory)
        return memory, memory


@dataclass(frozen=True)
class Masks(Computed):
    """Masks of objects, uint8 `[stack * planes, height, width]`.

    Args:
        kind: the kind of mask; see `ocjax.transforms.masks.masks`, which also explains `size`, `draw` and `pixels`.
        size: (height, width); None for the size of the screen.
        draw: "output" or "screen".
        pixels: whether the grey frame is appended as a plane.
        stack: number of steps, the latest last; all are the same at the start of an episode.

    Raises:
        ValueError: there is no such kind or way to draw, or the stack is below 1.
    """

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
        """The pixel arrays that it needs."""
        return ("gray",) if self.pixels or self.kind == "object" else ()

    def _shape(self, game: Game) -> tuple[int, ...]:
        return (self.stack, masks.num_planes(game, self.kind, self.pixels), *(self.size or game.screen))

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The observation space of one environment."""
        stack, planes, *size = self._shape(game)
        return gym.spaces.Box(0, 255, (stack * planes, *size), np.uint8)

    def initial(self, game: Game, mode: str, num_envs: int) -> Any:
        """The memory before the first observation: the stack."""
        return np.zeros((num_envs, *self._shape(game)), np.uint8)

    def update(self, game: Game, mode: str, snapshot: Snapshot, memory: Any) -> tuple[Any, Any]:
        """The observation and the new memory."""
        drawn = masks.masks(snapshot.objects, self.kind, gray=snapshot.gray, size=self.size, draw=self.draw, pixels=self.pixels)
        memory = _push(snapshot.started, drawn, memory)
        return memory.reshape(memory.shape[0], -1, *memory.shape[3:]), memory


@dataclass(frozen=True)
class Pixels(Copied):
    """The last emulated frame in RGB, uint8 `[H, 160, 3]`."""

    @property
    def screens(self) -> tuple[str, ...]:
        """The pixel arrays that it needs."""
        return ("rgb",)

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The observation space of one environment."""
        return gym.spaces.Box(0, 255, (*game.screen, 3), np.uint8)

    def source(self, arrays: Mapping[str, Any], objects: Mapping[str, Objects]) -> Any:
        """What is copied: the last frame."""
        return arrays["rgb"][:, -1]


@dataclass(frozen=True)
class Ram(Copied):
    """The RAM, uint8 `[128]`."""

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """The observation space of one environment."""
        return gym.spaces.Box(0, 255, (128,), np.uint8)

    def source(self, arrays: Mapping[str, Any], objects: Mapping[str, Objects]) -> Any:
        """What is copied: the RAM."""
        return arrays["ram"]


Kind = Computed | Copied
NAMES: Mapping[str, Kind] = {
    "objects": ObjectFields(),
    "vector": Vector(),
    "dqn": Dqn(),
    "pixels": Pixels(),
    "ram": Ram(),
    "object_masks": Masks("object"),
    "binary_masks": Masks("binary"),
    "class_masks": Masks("class"),
    "planes": Masks("planes"),
}

Request = str | Kind | Sequence[str] | Mapping[str, str | Kind]  # a kind by name or class, several by name, or a dict of either


def parse(request: Request) -> Kind | dict[str, Kind]:
    """The kind of observation that is requested, or the kinds by their names if several are requested.

    Raises:
        ValueError: there is no observation of that name, or several are requested and none is named.
    """
    if isinstance(request, Kind):
        return request
    if isinstance(request, str):
        if request not in NAMES:
            raise ValueError(f"no observation {request!r}: there are {', '.join(NAMES)}, and the classes in ocjax.envs with options")
        return NAMES[request]
    named = request if isinstance(request, Mapping) else {name: name for name in request}
    if not named:
        raise ValueError(f"obs must name at least one observation, got {request!r}")
    out: dict[str, Kind] = {}
    for name, one in named.items():
        kind = parse(one)
        if isinstance(kind, dict):
            raise ValueError(f"obs must map names to single observations, got {request!r}")
        out[name] = kind
    return out


Mode = Literal["rem", "vem", "both", "raw"]
MODES = get_args(Mode)


def requested_kinds(mode: str, obs: Request | None) -> tuple[dict[str, Kind], bool]:
    """The kinds of observations that are requested of an environment; by default the objects, or in mode "raw" the RAM.

    Returns:
        The kinds by name, and whether a single one is requested, whose name is then "".

    Raises:
        ValueError: the mode or an observation is unknown, or objects are requested that mode "raw" does not extract.
    """
    if mode not in MODES:
        raise ValueError(f"mode must be one of {MODES}, got {mode!r}; the mode of the game is game_mode")
    parsed = parse(obs if obs is not None else "ram" if mode == "raw" else "objects")
    kinds = parsed if isinstance(parsed, dict) else {"": parsed}
    for kind in kinds.values():
        if kind.needs_objects and mode == "raw":
            raise ValueError(f"{kind} shows objects, which mode 'raw' does not extract: use mode 'rem' or 'vem'")
    return kinds, not isinstance(parsed, dict)


def required_screens(mode: str, kinds: Mapping[str, Kind]) -> set[str]:
    """The pixel arrays that the mode and the observations need."""
    needed = {name for kind in kinds.values() for name in kind.screens}
    return needed | {"screen"} if mode in ("vem", "both") else needed
