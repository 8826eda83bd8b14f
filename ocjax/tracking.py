"""From one frame to the next: objects that flicker put together, and slots that stay with their objects.

Objects are matched by their centres, within a category: the nearest pair first, then the nearest of what is left, and so on. Distances are
compared as integers (squares, in half pixels), so that ties are exact: of equally near pairs the one with the lower slot in the first frame
goes first, then the one with the lower slot in the second.
"""

import functools
import math

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax.boxes import WIDTH
from ocjax.game import Game
from ocjax.objects import Objects, whose
from ocjax.rules import Blobs

MERGE_RADIUS = 5.0  # pixels; one emulated frame apart
TRACK_RADIUS = 16.0  # pixels; a step of four frames, 4 pixels a frame

BLOCK = 8  # slots at a time in the search for the nearest

_NONE = np.int32(np.iinfo(np.int32).max)  # more than any distance
_LONGEST = 4 * (WIDTH**2 + 256**2)  # squared, in half pixels
_AWAY = 4096  # half pixels; farther than any reach from what is on the screen, from its opposite and from its double

_TAILS = {"xywh": (4,), "valid": (), "orientation": (), "value": (), "rgb": (3,)}


def _nearest(a: tuple[jax.Array, jax.Array], b: tuple[jax.Array, jax.Array], limit: int) -> jax.Array:
    """Of each `a` the nearest `b` within reach: distance times n plus slot, or `_NONE`; ordered by distance, then slot.

    Centres are columns and rows, each int32 `[B, n]`. A few of `b` at a time: a reduction of all distances does not vectorise.
    """
    lanes, n = a[0].shape
    size = min(n, BLOCK)
    blocks = -(-n // size)
    x, y = (
        jnp.pad(p, ((0, 0), (0, blocks * size - n)), constant_values=away).T.reshape(blocks, size, lanes, 1)
        for p, away in zip(b, (2 * _AWAY, 0), strict=True)
    )

    def step(nearest: jax.Array, block: tuple[jax.Array, jax.Array, jax.Array]) -> tuple[jax.Array, None]:
        for at_x, at_y, slot in zip(*block, strict=True):
            dx, dy = a[0] - at_x, a[1] - at_y
            distance = dx * dx + dy * dy
            nearest = jnp.minimum(nearest, jnp.where(distance <= limit, distance * n + slot, _NONE))
        return nearest, None

    slots = jnp.arange(blocks * size, dtype=jnp.int32).reshape(blocks, size)
    return lax.scan(step, jnp.full(a[0].shape, _NONE), (x, y, slots))[0]


def _match(a: Objects, b: Objects, limit: int) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Greedy one-to-one matching of one category's slots; batch shape `[B]`.

    Pairs that are each other's nearest are what the greedy order takes before any other pair of either, so all of them are taken at once,
    until no pair is left: mostly after one or two rounds.

    Returns:
        Of each slot of `a` the slot of `b`, int32 `[B, n]`, n where there is none; which of `a` and of `b` are left over, bool `[B, n]`.
    """
    n = a.valid.shape[1]
    slots = jnp.arange(n, dtype=jnp.int32)[None]

    def center(o: Objects, away: int) -> tuple[jax.Array, jax.Array]:
        """In half pixels; `away`, where nothing is in reach, if there is no object."""
        box = o.xywh.astype(jnp.int32)
        return jnp.where(o.valid, 2 * box[..., 0] + box[..., 2], away), 2 * box[..., 1] + box[..., 3]

    def mutual(one: jax.Array, other: jax.Array) -> jax.Array:
        """Whether the nearest one's nearest is the slot itself."""
        back = jnp.take_along_axis(other, lax.rem(one, jnp.full_like(one, n)), axis=1, mode="promise_in_bounds")
        return (one != _NONE) & (lax.rem(back, jnp.full_like(back, n)) == slots)

    def take(state: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
        from_a, partner, ax, bx = state
        from_b = _nearest((bx, by), (ax, ay), limit)
        now = mutual(from_a, from_b)
        partner = jnp.where(now, lax.rem(from_a, jnp.full_like(from_a, n)), partner)
        ax, bx = jnp.where(now, -_AWAY, ax), jnp.where(mutual(from_b, from_a), _AWAY, bx)
        return _nearest((ax, ay), (bx, by), limit), partner, ax, bx

    (ax, ay), (bx, by) = center(a, -_AWAY), center(b, _AWAY)
    start = (_nearest((ax, ay), (bx, by), limit), jnp.full(a.valid.shape, n, jnp.int32), ax, bx)
    _, partner, ax, bx = lax.while_loop(lambda state: jnp.any(state[0] != _NONE), take, start)
    return partner, ax != -_AWAY, bx != _AWAY


def _rank(mask: jax.Array) -> jax.Array:
    """Of each slot that is set, how many before it are: int32 `[B, n]`."""
    return jnp.cumsum(mask, axis=1, dtype=jnp.int32) - 1


def _deal(new: jax.Array, free: jax.Array, turn: jax.Array) -> jax.Array:
    """Deal the new ones, in order, to the free slots, in the order of `turn`: which one each slot gets, n where none; all `[B, n]`."""
    lanes, n = new.shape
    lane, slots = jnp.arange(lanes, dtype=jnp.int32)[:, None], jnp.broadcast_to(jnp.arange(n, dtype=jnp.int32)[None], new.shape)
    queue = jnp.full(new.shape, n, jnp.int32).at[lane, jnp.where(new, _rank(new), n)].set(slots, mode="drop")
    return jnp.take_along_axis(queue, jnp.where(free, turn, n), axis=1, mode="fill", fill_value=n)


def _pick(objects: Objects, slots: jax.Array) -> Objects:
    """The objects in the given slots `[B, n]`; nothing where there is no such slot."""

    def one(field: jax.Array) -> jax.Array:
        index = slots.reshape(*slots.shape, *[1] * (field.ndim - 2))
        return jnp.take_along_axis(field, index, axis=1, mode="fill", fill_value=0)

    return jax.tree.map(one, objects)


def _merge_category(earlier: Objects, later: Objects, limit: int) -> Objects:
    n = later.valid.shape[1]
    _, missing, _ = _match(earlier, later, limit)
    free = ~later.valid
    slots = jnp.where(free, n + _deal(missing, free, _rank(free)), jnp.arange(n, dtype=jnp.int32)[None])
    return _pick(jax.tree.map(lambda a, b: jnp.concatenate((a, b), axis=1), later, earlier), slots)


def _track_category(previous: Objects, current: Objects, first: jax.Array, limit: int) -> Objects:
    n = current.valid.shape[1]
    partner, gone, new = _match(previous, current, limit)
    unused = ~previous.valid
    turn = jnp.where(unused, _rank(unused), jnp.sum(unused, axis=1, keepdims=True, dtype=jnp.int32) + _rank(gone))
    slots = jnp.where(partner < n, partner, _deal(new, unused | gone, turn))
    return _pick(current, jnp.where(first[:, None], jnp.arange(n, dtype=jnp.int32)[None], slots))


def _runs(game: Game) -> list[tuple[slice, bool]]:
    """The slots in runs: those of a category whose objects may be in any slot (True), or of one or more whose slots are places (False).

    A category of one slot is of the second kind: there is nothing to choose.
    """
    runs: list[tuple[slice, bool]] = []
    for category, s in zip(game.categories, game.slices.values(), strict=True):
        movable = isinstance(category.rule, Blobs) and category.count > 1
        if runs and not movable and not runs[-1][1]:
            runs[-1] = (slice(runs[-1][0].start, s.stop), False)
        else:
            runs.append((s, movable))
    return runs


def _cut(objects: Objects, s: slice) -> Objects:
    return jax.tree.map(lambda a: a[:, s], objects)


def _flat(objects: Objects) -> Objects:
    """With one batch dimension."""
    batch = objects.valid.shape[:-1]
    return jax.tree.map(lambda a: a.reshape(math.prod(batch), *a.shape[len(batch) :]), objects)


def _joined(parts: list[Objects], batch: tuple[int, ...]) -> Objects:
    whole = parts[0] if len(parts) == 1 else jax.tree.map(lambda *a: jnp.concatenate(a, axis=1), *parts)
    return jax.tree.map(lambda a: a.reshape(*batch, *a.shape[1:]), whole)


@functools.partial(jax.jit, static_argnums=(0, 1))
def _merge(game: Game, limit: int, earlier: Objects, later: Objects) -> Objects:
    def here(a: jax.Array, b: jax.Array, valid: jax.Array) -> jax.Array:
        return jnp.where(valid.reshape(*valid.shape, *[1] * (b.ndim - 2)), b, a)

    batch, parts = later.valid.shape[:-1], []
    earlier, later = _flat(earlier), _flat(later)
    for s, movable in _runs(game):
        a, b = _cut(earlier, s), _cut(later, s)
        parts.append(_merge_category(a, b, limit) if movable else jax.tree.map(functools.partial(here, valid=b.valid), a, b))
    return _joined(parts, batch)


@functools.partial(jax.jit, static_argnums=(0, 1))
def _track(game: Game, limit: int, previous: Objects, current: Objects, is_first: jax.Array) -> Objects:
    batch, parts = current.valid.shape[:-1], []
    previous, current, first = _flat(previous), _flat(current), is_first.reshape(-1)
    for s, movable in _runs(game):
        b = _cut(current, s)
        parts.append(_track_category(_cut(previous, s), b, first, limit) if movable else b)
    return _joined(parts, batch)


def _limit(radius: float) -> int:
    """The radius as the largest squared distance in half pixels."""
    if not radius >= 0:
        raise ValueError(f"radius must be a number of pixels, 0 or more, got {radius!r}")
    return int(min(4.0 * float(radius) ** 2, _LONGEST))


def _check(**states: Objects) -> tuple[Game, tuple[int, ...]]:
    """The game and the batch shape of the states: all of their fields must have it and the game's slots."""
    game, other = (whose(objects) for objects in states.values())
    if game is not other:
        raise ValueError(f"{' and '.join(states)} must be objects of one game, got {game} and {other}")
    batch: tuple[int, ...] | None = None
    for name, objects in states.items():
        for field, tail in _TAILS.items():
            shape = np.shape(getattr(objects, field))
            batch = shape[: len(shape) - 1 - len(tail)] if batch is None else batch
            if shape != (*batch, game.num_slots, *tail):
                want = ", ".join(str(n) for n in (game.num_slots, *tail))
                both = " and ".join(states)
                raise ValueError(
                    f"{game.name}: {name}.{field} must have shape [..., {want}], the same batch shape in all of {both}, got {list(shape)}"
                )
    assert batch is not None
    return game, batch


def merge_frames(earlier: Objects, later: Objects, radius: float = MERGE_RADIUS) -> Objects:
    """What two successive emulated frames show together: for objects that the console draws only every other frame.

    The later frame's objects, each in its slot, and those of the earlier frame that have no counterpart in the later one: an object that
    has moved does not count twice. Counterparts are matched one to one within a category, nearest centres first. The added objects fill the
    category's free slots in order; those that do not fit are left out. In categories whose slots are places (`Bounds`, `Cells`: slot i is
    region or cell i) each slot holds the later object or else the earlier one, whatever the radius. A pure function that works under `jit`,
    `vmap` and `scan`.

    Args:
        earlier, later: what `game.vem` found on two successive emulated frames, any batch shape.
        radius: how far a counterpart's centre may be, in pixels; a Python number.

    Returns:
        Objects of the same batch shape; added objects have the places and colours that they had on the earlier frame.

    Raises:
        ValueError: the shapes are not those of the game's slots, the batch shapes differ, or the radius is negative or nan.
    """
    game, _ = _check(earlier=earlier, later=later)
    return _merge(game, _limit(radius), earlier, later)


def track(
    previous: Objects, current: Objects, radius: float = TRACK_RADIUS, is_first: jax.Array | np.ndarray | bool | None = None
) -> Objects:
    """The current objects, in the slots of the previous objects that they continue: slots become identities.

    Objects are matched one to one within a category, nearest centres first. An object that continues none gets the first slot that was free
    before or, when there is none, the first whose object has gone. In categories whose slots are places (`Bounds`, `Cells`: slot i is
    region or cell i) objects stay where they are. No object is added, lost or changed. A pure function that works under `jit`, `vmap` and
    `scan`; the result is the next call's `previous`:

        tracked = ocjax.track(tracked, game.vem(frame))

    Only the previous objects are remembered: one that is not seen once loses its identity, and is new when it comes back, maybe in another
    slot. Where objects flicker, give the objects that `merge_frames` makes of the last two emulated frames.

    Args:
        previous, current: objects of two successive states, any batch shape.
        radius: how far an object's centre may have moved, in pixels; a Python number.
        is_first: bool `[...]`, the batch shape: the state begins an episode, nothing continues, and `current` is returned as it is.

    Returns:
        Objects of the same batch shape.

    Raises:
        ValueError: the shapes are not those of the game's slots, the batch shapes differ, or the radius is negative or nan.
        TypeError: `is_first` is not bool.
    """
    game, batch = _check(previous=previous, current=current)
    first = jnp.zeros(batch, jnp.bool_) if is_first is None else jnp.asarray(is_first)
    if first.dtype != jnp.bool_:
        raise TypeError(f"is_first must be bool, got {first.dtype}")
    if first.shape != batch:
        raise ValueError(f"is_first must have the objects' batch shape {list(batch)}, got {list(first.shape)}")
    return _track(game, _limit(radius), previous, current, first)
