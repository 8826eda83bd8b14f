"""Relate the objects of successive frames: merge flickering objects, and keep slots stable.

Objects are matched greedily within a category: the pair with the nearest centres first, then the
nearest remaining pair, and so on. Distances are compared as integers (squared, in half pixels), so
ties are exact. Ties go to the lower slot in the first frame, then to the lower slot in the second.
"""

import dataclasses
import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax.console.boxes import WIDTH
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.objects import Objects, whose
from ocjax.extraction.records import FIELDS

__all__ = ["MERGE_RADIUS", "TRACK_RADIUS", "check_states", "first_states", "merge_frames", "track"]

MERGE_RADIUS = 5.0  # pixels, for frames that are one emulated frame apart
TRACK_RADIUS = 16.0  # pixels, for a step of four emulated frames with 4 pixels each

_BLOCK = 8  # slots compared at once in the search for the nearest

_NONE = np.int32(np.iinfo(np.int32).max)  # larger than any distance
_LONGEST = 4 * (WIDTH**2 + 256**2)  # largest squared distance in half pixels
# half pixels; -_AWAY, _AWAY and 2 * _AWAY are out of reach of the screen and of each other
_AWAY = 4096


def _nearest(
    a: tuple[jax.Array, jax.Array], b: tuple[jax.Array, jax.Array], limit: jax.Array
) -> jax.Array:
    """Find the nearest `b` within reach of each `a`.

    Blocks of `b` are compared sequentially, because a reduction over all distances does not
    vectorise.

    Args:
        a, b: columns and rows of centres in half pixels, int32 `[B, n]` each.
        limit: largest squared distance, int32.

    Returns:
        int32 `[B, n]`: squared distance times n plus slot, or `_NONE`.
    """
    lanes, n = a[0].shape
    size = min(n, _BLOCK)
    blocks = -(-n // size)
    x, y = (
        jnp.pad(p, ((0, 0), (0, blocks * size - n)), constant_values=away).T.reshape(
            blocks, size, lanes, 1
        )
        for p, away in zip(b, (2 * _AWAY, 0), strict=True)
    )

    def step(
        nearest: jax.Array, block: tuple[jax.Array, jax.Array, jax.Array]
    ) -> tuple[jax.Array, None]:
        for at_x, at_y, slot in zip(*block, strict=True):
            dx, dy = a[0] - at_x, a[1] - at_y
            distance = dx * dx + dy * dy
            nearest = jnp.minimum(nearest, jnp.where(distance <= limit, distance * n + slot, _NONE))
        return nearest, None

    slots = jnp.arange(blocks * size, dtype=jnp.int32).reshape(blocks, size)
    return lax.scan(step, jnp.full(a[0].shape, _NONE), (x, y, slots))[0]


def _match(a: Objects, b: Objects, limit: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Match one category's slots greedily, one to one; batch shape `[B]`.

    Greedy matching takes mutually nearest objects before any other pair of either. Therefore, each
    round takes all such pairs, and one or two rounds are usually enough.

    Returns:
        For each slot of `a` the matched slot of `b` or n, int32 `[B, n]`; and masks of the
        unmatched objects of `a` and of `b`, bool `[B, n]` each.
    """
    n = a.valid.shape[1]
    slots = jnp.arange(n, dtype=jnp.int32)[None]

    def center(o: Objects, away: int) -> tuple[jax.Array, jax.Array]:
        """Columns and rows of centres in half pixels; empty slots have the column `away`."""
        box = o.xywh.astype(jnp.int32)
        return jnp.where(o.valid, 2 * box[..., 0] + box[..., 2], away), 2 * box[..., 1] + box[
            ..., 3
        ]

    def mutual(one: jax.Array, other: jax.Array) -> jax.Array:
        """True if each slot is the nearest of its nearest."""
        back = jnp.take_along_axis(
            other, lax.rem(one, jnp.full_like(one, n)), axis=1, mode="promise_in_bounds"
        )
        return (one != _NONE) & (lax.rem(back, jnp.full_like(back, n)) == slots)

    def take(state: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
        from_a, partner, ax, bx = state
        from_b = _nearest((bx, by), (ax, ay), limit)
        paired = mutual(from_a, from_b)
        partner = jnp.where(paired, lax.rem(from_a, jnp.full_like(from_a, n)), partner)
        ax, bx = jnp.where(paired, -_AWAY, ax), jnp.where(mutual(from_b, from_a), _AWAY, bx)
        return _nearest((ax, ay), (bx, by), limit), partner, ax, bx

    (ax, ay), (bx, by) = center(a, -_AWAY), center(b, _AWAY)
    start = (_nearest((ax, ay), (bx, by), limit), jnp.full(a.valid.shape, n, jnp.int32), ax, bx)
    _, partner, ax, bx = lax.while_loop(lambda state: jnp.any(state[0] != _NONE), take, start)
    return partner, ax != -_AWAY, bx != _AWAY


def _rank(mask: jax.Array) -> jax.Array:
    """For each set slot, the number of set slots before it, int32 `[B, n]`."""
    return jnp.cumsum(mask, axis=1, dtype=jnp.int32) - 1


def _deal(new: jax.Array, free: jax.Array, turn: jax.Array) -> jax.Array:
    """Assign new objects to free slots.

    Args:
        new: bool `[B, n]`, slots of the new objects, assigned in this order.
        free: bool `[B, n]`, the free slots.
        turn: int32 `[B, n]`, position of each free slot in the filling order.

    Returns:
        int32 `[B, n]`: each slot's new object, or n.
    """
    lanes, n = new.shape
    lane, slots = (
        jnp.arange(lanes, dtype=jnp.int32)[:, None],
        jnp.broadcast_to(jnp.arange(n, dtype=jnp.int32)[None], new.shape),
    )
    queue = (
        jnp.full(new.shape, n, jnp.int32)
        .at[lane, jnp.where(new, _rank(new), n)]
        .set(slots, mode="drop")
    )
    return jnp.take_along_axis(queue, jnp.where(free, turn, n), axis=1, mode="fill", fill_value=n)


def _merge_category(earlier: Objects, later: Objects, limit: jax.Array) -> Objects:
    n = later.valid.shape[1]
    _, missing, _ = _match(earlier, later, limit)
    free = ~later.valid
    slots = jnp.where(
        free, n + _deal(missing, free, _rank(free)), jnp.arange(n, dtype=jnp.int32)[None]
    )
    return jax.tree.map(lambda a, b: jnp.concatenate((a, b), axis=1), later, earlier).take(slots)


def _track_category(
    previous: Objects, current: Objects, first: jax.Array, limit: jax.Array
) -> Objects:
    n = current.valid.shape[1]
    partner, gone, new = _match(previous, current, limit)
    unused = ~previous.valid
    turn = jnp.where(
        unused, _rank(unused), jnp.sum(unused, axis=1, keepdims=True, dtype=jnp.int32) + _rank(gone)
    )
    slots = jnp.where(partner < n, partner, _deal(new, unused | gone, turn))
    return current.take(jnp.where(first[:, None], jnp.arange(n, dtype=jnp.int32)[None], slots))


def _runs(game: Declaration) -> list[tuple[slice, bool]]:
    """Divide the slots into runs, each with a flag: its objects may change slots.

    Each category of `Blobs` with several slots is such a run. Other adjacent categories, with fixed
    places or a single slot, form one run without the flag.
    """
    runs: list[tuple[slice, bool]] = []
    for category, s in zip(game.categories, game.slices.values(), strict=True):
        movable = not category.has_places and category.count > 1
        if runs and not movable and not runs[-1][1]:
            runs[-1] = (slice(runs[-1][0].start, s.stop), False)
        else:
            runs.append((s, movable))
    return runs


def _cut(objects: Objects, s: slice) -> Objects:
    return jax.tree.map(lambda a: a[:, s], objects)


def _flat(objects: Objects) -> Objects:
    """Reshape to one batch dimension, without the reference to the game."""
    batch = objects.valid.shape[:-1]
    objects = dataclasses.replace(objects, game=None)
    return jax.tree.map(lambda a: a.reshape(math.prod(batch), *a.shape[len(batch) :]), objects)


def _joined(parts: list[Objects], game: Declaration, batch: tuple[int, ...]) -> Objects:
    """Concatenate runs of slots to all slots of a game, and restore the batch shape."""
    whole = (
        parts[0] if len(parts) == 1 else jax.tree.map(lambda *a: jnp.concatenate(a, axis=1), *parts)
    )
    return dataclasses.replace(
        jax.tree.map(lambda a: a.reshape(*batch, *a.shape[1:]), whole), game=game
    )


@functools.partial(jax.jit, static_argnums=0)
def _merge(game: Declaration, limit: jax.Array, earlier: Objects, later: Objects) -> Objects:
    def here(a: jax.Array, b: jax.Array, valid: jax.Array) -> jax.Array:
        return jnp.where(valid.reshape(*valid.shape, *[1] * (b.ndim - 2)), b, a)

    batch, parts = later.valid.shape[:-1], []
    earlier, later = _flat(earlier), _flat(later)
    for s, movable in _runs(game):
        a, b = _cut(earlier, s), _cut(later, s)
        parts.append(
            _merge_category(a, b, limit)
            if movable
            else jax.tree.map(functools.partial(here, valid=b.valid), a, b)
        )
    return _joined(parts, game, batch)


@functools.partial(jax.jit, static_argnums=0)
def _track(
    game: Declaration, limit: jax.Array, previous: Objects, current: Objects, is_first: jax.Array
) -> Objects:
    batch, parts = current.valid.shape[:-1], []
    previous, current, first = _flat(previous), _flat(current), is_first.reshape(-1)
    for s, movable in _runs(game):
        b = _cut(current, s)
        parts.append(_track_category(_cut(previous, s), b, first, limit) if movable else b)
    return _joined(parts, game, batch)


def _limit(radius: float) -> jax.Array:
    """Convert a radius in pixels to the largest squared distance in half pixels."""
    if not radius >= 0:
        raise ValueError(f"radius must be a number of pixels of at least 0, got {radius!r}")
    return jnp.int32(min(4.0 * float(radius) ** 2, _LONGEST))


def check_states(**states: Objects) -> tuple[Declaration, tuple[int, ...]]:
    """Check the fields' shapes against the game's slots, and return the game and batch shape.

    Raises:
        ValueError: the objects are of different games, the shapes do not fit the game's slots, or
            the batch shapes differ.
    """
    game, other = (whose(objects) for objects in states.values())
    if game is not other:
        raise ValueError(
            f"{' and '.join(states)} must be objects of the same game, got {game} and {other}"
        )
    batch: tuple[int, ...] | None = None
    for name, objects in states.items():
        for field, (_, tail) in FIELDS.items():
            shape = np.shape(getattr(objects, field))
            batch = shape[: len(shape) - 1 - len(tail)] if batch is None else batch
            if shape != (*batch, game.num_slots, *tail):
                expected = ", ".join(str(n) for n in (game.num_slots, *tail))
                both = " and ".join(states)
                raise ValueError(
                    f"{game.name}: {name}.{field} must have shape [..., {expected}] with one "
                    f"batch shape for {both}, got {list(shape)}"
                )
    assert batch is not None
    return game, batch


def first_states(
    is_first: jax.Array | np.ndarray | bool | None, batch: tuple[int, ...]
) -> jax.Array:
    """Check the argument `is_first`, and return it as bool of the batch shape; by default False.

    Raises:
        ValueError: it has another shape.
        TypeError: it is not bool.
    """
    first = jnp.zeros(batch, jnp.bool_) if is_first is None else jnp.asarray(is_first)
    if first.dtype != jnp.bool_:
        raise TypeError(f"is_first must be bool, got {first.dtype}")
    if first.shape != batch:
        raise ValueError(
            f"is_first must have the objects' batch shape {list(batch)}, got {list(first.shape)}"
        )
    return first


def merge_frames(earlier: Objects, later: Objects, radius: float = MERGE_RADIUS) -> Objects:
    """Merge VEM's objects of two successive emulated frames.

    The console draws some objects only every other frame. The result holds the later frame's
    objects in their slots, and the earlier frame's objects without a counterpart in the later one.
    A moved object does not count twice. Counterparts are matched one to one within a category,
    nearest centres first. Added objects fill the category's free slots in order, and surplus
    objects are dropped. In categories whose slots are places (`Category.has_places`: slot i is
    region or cell i), each slot holds the later object or else the earlier one, at any distance.

    This is a pure function that works under `jit`, `vmap` and `scan`.

    Args:
        earlier, later: results of `game.vem` on two successive emulated frames, of any batch shape.
        radius: largest distance between the centres of counterparts in pixels; a Python number.

    Returns:
        Objects of the same batch shape. Added objects keep their positions and colours from the
        earlier frame.

    Raises:
        ValueError: the shapes do not fit the game's slots, the batch shapes differ, or the radius
            is negative or nan.
    """
    game, _ = check_states(earlier=earlier, later=later)
    return _merge(game, _limit(radius), earlier, later)


def track(
    previous: Objects,
    current: Objects,
    radius: float = TRACK_RADIUS,
    is_first: jax.Array | np.ndarray | bool | None = None,
) -> Objects:
    """Move current objects to the slots of their previous objects, so slots become identities.

    Objects are matched one to one within a category, nearest centres first. A new object gets the
    first slot that was empty before, or else the first slot whose object is gone. In categories
    whose slots are places (`Category.has_places`: slot i is region or cell i), objects stay in
    their slots. No object is added, lost or changed.

    This is a pure function that works under `jit`, `vmap` and `scan`. Its result is the next call's
    `previous`:

        tracked = ocjax.track(tracked, game.vem(frame))

    Only the previous objects are remembered. An object that is missed once loses its identity and
    may return in another slot. For flickering objects, track the result of `merge_frames` on the
    last two emulated frames.

    Args:
        previous, current: objects of two successive states, of any batch shape.
        radius: largest movement of an object's centre, in pixels; a Python number.
        is_first: bool `[...]`, of the batch shape: whether the state begins an episode. If so,
            `current` is returned unchanged.

    Returns:
        Objects of the same batch shape.

    Raises:
        ValueError: the shapes do not fit the game's slots, the batch shapes differ, or the radius
            is negative or nan.
        TypeError: `is_first` is not bool.
    """
    game, batch = check_states(previous=previous, current=current)
    first = first_states(is_first, batch)
    return _track(game, _limit(radius), previous, current, first)
