"""Relate the objects of successive frames: merge flickering objects, and keep slots stable.

Objects are matched greedily within a category: the pair with the nearest centres first, then the
nearest remaining pair, and so on. Distances are compared as integers (squared, in half pixels).
Ties go to the lower slot in the first frame, then in the second.
"""

import dataclasses
import functools
import math
from collections.abc import Callable
from typing import NamedTuple

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


class _Matching(NamedTuple):
    """The state of `_match` between two rounds."""

    nearest: jax.Array  # int32 [B, n]: the nearest `b` of each `a`, see `_nearest`
    partner: jax.Array  # int32 [B, n]: slot of `b`, or n
    ax: jax.Array  # int32 [B, n]: columns; `-_AWAY` and `_AWAY` for empty and matched slots
    bx: jax.Array


def _match(a: Objects, b: Objects, limit: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Match one category's slots greedily, one to one; batch shape `[B]`.

    Mutually nearest objects match before any other pair of either, so each round takes all such
    pairs.

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
        back = jnp.take_along_axis(
            other, lax.rem(one, jnp.full_like(one, n)), axis=1, mode="promise_in_bounds"
        )
        return (one != _NONE) & (lax.rem(back, jnp.full_like(back, n)) == slots)

    def one_round(state: _Matching) -> _Matching:
        from_a, partner, ax, bx = state
        from_b = _nearest((bx, by), (ax, ay), limit)
        paired = mutual(from_a, from_b)
        partner = jnp.where(paired, lax.rem(from_a, jnp.full_like(from_a, n)), partner)
        # Matched objects move out of reach.
        ax, bx = jnp.where(paired, -_AWAY, ax), jnp.where(mutual(from_b, from_a), _AWAY, bx)
        return _Matching(_nearest((ax, ay), (bx, by), limit), partner, ax, bx)

    (ax, ay), (bx, by) = center(a, -_AWAY), center(b, _AWAY)
    nobody = jnp.full(a.valid.shape, n, jnp.int32)
    start = _Matching(_nearest((ax, ay), (bx, by), limit), nobody, ax, bx)
    end = lax.while_loop(lambda state: jnp.any(state.nearest != _NONE), one_round, start)
    return end.partner, end.ax != -_AWAY, end.bx != _AWAY


def _rank(mask: jax.Array) -> jax.Array:
    """For each set slot, the number of set slots before it, int32 `[B, n]`."""
    return jnp.cumsum(mask, axis=1, dtype=jnp.int32) - 1


def _deal(new: jax.Array, free: jax.Array, turn: jax.Array) -> jax.Array:
    """Assign new objects to free slots.

    Args:
        new: bool `[B, n]`, slots of the new objects, assigned in this order.
        free: bool `[B, n]`.
        turn: int32 `[B, n]`, position of each free slot in the filling order.

    Returns:
        int32 `[B, n]`: each slot's new object, or n.
    """
    lanes, n = new.shape
    lane = jnp.arange(lanes, dtype=jnp.int32)[:, None]
    slots = jnp.broadcast_to(jnp.arange(n, dtype=jnp.int32)[None], new.shape)
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


def _by_runs(
    game: Declaration,
    first: Objects,
    second: Objects,
    move: Callable[[Objects, Objects], Objects],
    stay: Callable[[Objects, Objects], Objects],
) -> Objects:
    """Combine the slots of two states, flattened to batch shape `[B]`, category by category.

    `move` combines a category whose objects may change slots: `Blobs` with several slots. `stay`
    combines adjacent other categories at once.
    """
    batch = second.valid.shape[:-1]

    def flat(objects: Objects) -> Objects:
        shape = math.prod(batch), game.num_slots
        return jax.tree.map(
            lambda a: a.reshape(*shape, *a.shape[len(batch) + 1 :]),
            dataclasses.replace(objects, game=None),
        )

    first, second = flat(first), flat(second)
    parts = []
    for s, moving in game.spans(lambda c: None if c.has_places or c.count == 1 else c.name):
        a, b = (jax.tree.map(lambda field, s=s: field[:, s], state) for state in (first, second))
        parts.append(move(a, b) if moving else stay(a, b))
    whole = jax.tree.map(lambda *fields: jnp.concatenate(fields, axis=1), *parts)
    whole = jax.tree.map(lambda a: a.reshape(*batch, *a.shape[1:]), whole)
    return dataclasses.replace(whole, game=game)


@functools.partial(jax.jit, static_argnums=0)
def _merge(game: Declaration, limit: jax.Array, earlier: Objects, later: Objects) -> Objects:
    def in_place(before: Objects, after: Objects) -> Objects:
        return jax.tree.map(
            lambda a, b: jnp.where(after.valid.reshape(*b.shape[:2], *[1] * (b.ndim - 2)), b, a),
            before,
            after,
        )

    return _by_runs(game, earlier, later, functools.partial(_merge_category, limit=limit), in_place)


@functools.partial(jax.jit, static_argnums=0)
def _track(
    game: Declaration, limit: jax.Array, previous: Objects, current: Objects, is_first: jax.Array
) -> Objects:
    move = functools.partial(_track_category, first=is_first.reshape(-1), limit=limit)
    return _by_runs(game, previous, current, move, lambda _, after: after)


def _limit(radius: float) -> jax.Array:
    """Convert a radius in pixels to the largest squared distance in half pixels."""
    if not radius >= 0:
        raise ValueError(f"radius must be a number of pixels of at least 0, got {radius!r}")
    return jnp.int32(min(4.0 * float(radius) ** 2, _LONGEST))


def check_states(**states: Objects) -> tuple[Declaration, tuple[int, ...]]:
    """Check the fields' shapes against the game's slots, and return the game and batch shape.

    Raises:
        ValueError: the objects are of different games, or the shapes do not fit.
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
    """Check the argument `is_first`, and return it as bool of the batch shape; by default False."""
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
    objects in their slots, and the earlier frame's objects without a counterpart in the later one,
    in the category's free slots; surplus objects are dropped. Counterparts are matched one to one
    within a category, nearest centres first. In categories whose slots are places
    (`Category.has_places`), each slot holds the later object or else the earlier one, at any
    distance.

    This is a pure function that works under `jit`, `vmap` and `scan`.

    Args:
        earlier, later: results of `game.vem` on two successive emulated frames, of any batch shape.
        radius: largest distance between the centres of counterparts in pixels; a Python number.

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
    whose slots are places (`Category.has_places`), objects stay in their slots. No object is added,
    lost or changed.

    This is a pure function that works under `jit`, `vmap` and `scan`. Its result is the next call's
    `previous`:

        tracked = ocjax.track(tracked, game.vem(frame))

    An object that is missed once loses its identity. For flickering objects, track the result of
    `merge_frames` on the last two emulated frames.

    Args:
        previous, current: objects of two successive states, of any batch shape.
        radius: largest movement of an object's centre, in pixels; a Python number.
        is_first: bool of the batch shape: whether the state begins an episode. If so, `current` is
            returned unchanged.

    Raises:
        ValueError: the shapes do not fit the game's slots, the batch shapes differ, or the radius
            is negative or nan.
        TypeError: `is_first` is not bool.
    """
    game, batch = check_states(previous=previous, current=current)
    first = first_states(is_first, batch)
    return _track(game, _limit(radius), previous, current, first)
