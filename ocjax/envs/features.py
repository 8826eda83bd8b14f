"""The observation "vector": features of all slots as one flat vector."""

import functools
import math
from dataclasses import KW_ONLY, dataclass
from typing import Any

import gymnasium as gym
import jax
import jax.numpy as jnp
import numpy as np

from ocjax.envs.observations import Computed, Snapshot, no_objects_of, push
from ocjax.extraction.categories import Category
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects, whose
from ocjax.transforms.tracking import check_states, first_states, track
from ocjax.vision.unknown import UNKNOWN, UNKNOWN_VALUE

FEATURES = ("x", "y", "w", "h", "dx", "dy", "nx", "ny", "mx", "my", "orientation", "value", "valid")
NEAR, MIDDLE = 8.0, 32.0  # pixels
_VALUE_UNIT = np.log1p(1e6)  # normalises a value of one million to 1


@dataclass(frozen=True)
class Vector(Computed):
    """Features of all slots as one flat vector, float32 `[history * n]`.

    n is the number of features of all slots. Entries are ordered by time (oldest state first), then
    by slot in the game's order, then by feature in the given order; `features_of` names each entry.
    Slots that are not valid are zero.

    dx and dy are the movement of the centre since the previous step, or zero if the object was not
    valid before, or if an episode has just begun.

    nx, ny, mx and my measure the position relative to the object in the first slot, which is the
    player in most games. With the distance d in pixels from the player's centre to the object's
    centre, nx and ny are tanh(d / 8), and mx and my are tanh(d / 32). They are zero while the
    player is not valid. nx and ny resolve positions next to the player finely but are nearly
    constant beyond 20 pixels, where mx and my still show approaching objects.

    In mode "vem", `ocjax.track` keeps objects in the same slots from step to step.

    Args:
        features: distinct names of x, y, w, h, dx, dy, nx, ny, mx, my, orientation, value and
            valid, for all slots. With None, a slot has x, y, w, h, dx and dy, then orientation and
            value if its category has them, and valid. Display objects with a value, such as scores,
            have no x to dy: their box only reflects the number of digits.
        grid_features: the features for slots of fixed grids such as Breakout's bricks, which never
            move (`Category.on_grid`). With None, they have the same features as others.
        history: number of states.
        normalize: whether features are scaled. Lengths become fractions of the screen's width or
            height, orientations become turns, and values v become sign(v) log(1 + |v|) / log(1 +
            10^6). Without it, lengths are in pixels and orientations are compass points 0 to 15.
            Unknown orientations are -1, or -1/16 turns. Values that VEM cannot read are encoded as
            v = -1.

    Raises:
        ValueError: a feature is unknown or repeated, the features are empty, or the history is
            below 1.
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
                    raise ValueError(
                        f"{option} must be None or distinct names of {', '.join(FEATURES)}, got "
                        f"{names}"
                    )
        if self.history < 1:
            raise ValueError(f"history must be at least 1, got {self.history}")

    def features_of(self, game: Declaration) -> tuple[tuple[int, str, int, str], ...]:
        """The meaning of each number: (steps ago, category, index within the category, feature)."""
        slots = [(c.name, i, self._features(c)) for c in game.categories for i in range(c.count)]
        return tuple(
            (ago, name, i, f)
            for ago in reversed(range(self.history))
            for name, i, features in slots
            for f in features
        )

    def _features(self, category: Category) -> tuple[str, ...]:
        if self.grid_features is not None and category.on_grid:
            return self.grid_features
        if self.features is not None:
            return self.features
        box = (
            ()
            if category.hud and "value" in category.attributes
            else ("x", "y", "w", "h", "dx", "dy")
        )
        return (
            *box,
            *(name for name in ("orientation", "value") if name in category.attributes),
            "valid",
        )

    def _scales(self, game: Declaration) -> dict[str, tuple[float, float, float]]:
        """The unit of each feature, and its least and greatest number in this unit."""
        height, width = game.screen
        relative = dict.fromkeys(("nx", "ny", "mx", "my"), 1)
        moved = {"dx": width, "dy": height}
        most = {"x": width, "y": height, "w": width, "h": height, "orientation": 16, "valid": 1}
        most |= moved | relative
        least = {f: -n for f, n in (moved | relative).items()} | {"orientation": UNKNOWN}
        unit = {f: float(n) if self.normalize else 1.0 for f, n in most.items()}
        out = {f: (unit[f], least.get(f, 0) / unit[f], n / unit[f]) for f, n in most.items()}
        limit = float(np.log1p(2.0**31) / _VALUE_UNIT) if self.normalize else 2.0**31
        return out | {"value": (1.0, -limit, limit)}

    def space(self, game: Game, mode: str) -> gym.Space[Any]:
        """See `Observation`."""
        scales = self._scales(game)
        low, high = np.array([scales[f][1:] for *_, f in self.features_of(game)], np.float32).T
        return gym.spaces.Box(low, high, dtype=np.float32)

    def initial(self, game: Game, mode: str, num_envs: int) -> Any:
        """See `Computed`."""
        n = len(self.features_of(game)) // self.history
        return no_objects_of(game, num_envs), np.zeros((num_envs, self.history, n), np.float32)

    def of(
        self,
        objects: Objects,
        previous: Objects | None = None,
        is_first: jax.Array | np.ndarray | bool | None = None,
    ) -> jax.Array:
        """The features of recorded objects, equal to an environment's observations.

            features = Vector().of(objects[1:], objects[:-1], is_first=resets[1:])

        Use `ocjax.track` first for VEM's objects, as environments do.

        Args:
            objects: of any batch shape, such as `[T, B]`.
            previous: the objects of the step before. Without them, dx and dy are zero.
            is_first: bool of the batch shape: whether the state begins an episode, which also sets
                dx and dy to zero.

        Returns:
            float32 `[..., n]`, with the features that `features_of` names.

        Raises:
            ValueError: the history is above 1, the objects are of different games, or the shapes
                differ.
            TypeError: an argument is not an `Objects`, or `is_first` is not bool.
        """
        if self.history > 1:
            raise ValueError(
                f"history must be 1 for recorded objects, got {self.history}: concatenate the "
                "features of successive states"
            )
        before = objects if previous is None else previous
        _, batch = check_states(objects=objects, previous=before)
        return _recorded(self, objects, before, first_states(is_first, batch))

    def update(self, game: Game, mode: str, snapshot: Snapshot, memory: Any) -> tuple[Any, Any]:
        """See `Computed`."""
        previous, history = memory
        objects = snapshot.objects
        if mode == "vem":
            objects = track(previous, objects, is_first=snapshot.started)
        latest = self._latest(game, objects, previous, snapshot.started)
        history = push(snapshot.started, latest, history)
        return history.reshape(history.shape[0], -1), (objects, history)

    def _latest(
        self, game: Declaration, objects: Objects, previous: Objects, started: jax.Array
    ) -> jax.Array:
        """The features of states of batch shape `[B]`, float32 `[B, n]`.

        `started`, bool `[B]`, marks the first states of episodes.
        """
        continued = objects.valid & previous.valid & ~started[:, None]
        moved = jnp.where(continued[..., None], objects.center - previous.center, jnp.float32(0))
        both = objects.valid & objects.valid[:, :1]
        distance = jnp.where(
            both[..., None], objects.center - objects.center[:, :1], jnp.float32(0)
        )
        vectors = {
            "d": moved,
            "n": jnp.tanh(distance / jnp.float32(NEAR)),
            "m": jnp.tanh(distance / jnp.float32(MIDDLE)),
        }
        derived = {
            name + axis: v[..., i] for name, v in vectors.items() for i, axis in enumerate("xy")
        }
        columns = {
            f: self._column(game, f, derived[f] if f in derived else getattr(objects, f))
            for f in FEATURES
        }
        parts = [
            jnp.stack([columns[f][:, s] for f in features], axis=-1)
            for s, features in game.spans(self._features)
        ]
        flat = [part.reshape(part.shape[0], math.prod(part.shape[1:])) for part in parts]
        return jnp.concatenate(flat, axis=-1)

    def _column(self, game: Declaration, name: str, numbers: jax.Array) -> jax.Array:
        """A feature of all slots in its unit, float32 `[B, N]`."""
        if name == "value":
            numbers = jnp.where(numbers == UNKNOWN_VALUE, jnp.int32(UNKNOWN), numbers)
        column = numbers.astype(jnp.float32)
        if name == "value" and self.normalize:
            column = jnp.sign(column) * jnp.log1p(jnp.abs(column)) / jnp.float32(_VALUE_UNIT)
        return column / jnp.float32(self._scales(game)[name][0])


@functools.partial(jax.jit, static_argnums=0)
def _recorded(kind: Vector, objects: Objects, previous: Objects, is_first: jax.Array) -> jax.Array:
    batch = objects.batch_shape
    flat = [
        jax.tree.map(lambda a: a.reshape(math.prod(batch), *a.shape[len(batch) :]), tree)
        for tree in (objects, previous, is_first)
    ]
    latest = kind._latest(whose(objects), *flat)
    return latest.reshape(*batch, latest.shape[-1])
