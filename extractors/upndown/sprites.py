"""The boxes of Up'n Down's sprites: the visible rows of their pictures, and their positions.

A row of the screen shows one sprite only. If sprites are less than NEAR_ROWS apart, the game skips
them alternately. If other sprites do not leave each other enough rows, one of them gives way on
each frame: it loses its last rows to the sprite below it, and its first rows to the one above it.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Box, Pictures, among, box, match, when
from ocjax.extractors.upndown.drawn import Drawn
from ocjax.extractors.upndown.ram import BANK, ROM, Kind, Ram

VIEW = (8, 27, 160, 194)
CLEARED_FROM = 142  # from this column, the last row of a picture is cleared before it is drawn
LAST_ROW = 158  # records restart below this row
PICTURE_ROWS = 16
CAR_KINDS = 4
COLLECTABLE_KINDS = 4
NEAR_ROWS = 4  # rows between sprites
SPACE = 24  # free rows for a sprite that is moved out of the way
BOTTOM = 152  # end of the free rows below the last sprite
FIRST_PLACE = 2  # row of a sprite that is moved above all others
NOWHERE = 255  # rows to a missing sprite
SET_UP_ROWS = 3  # for a sprite between the one above it and its picture
SPRITES = np.arange(4)
OTHERS = ~np.eye(4, dtype=bool)
LAST_RANK = 3


class Look:  # in `PICTURE_EXTENTS`; smaller ones are the other cars
    PLAYER = 3  # also the look of a car
    FLAG = 4
    COLLECTABLE = 5  # the first of four


class Rows(NamedTuple):
    """The visible rows of the sprites' pictures, the last row first: `low` + 1 to `high`."""

    low: jax.Array
    high: jax.Array


class Neighbours(NamedTuple):
    """The neighbours of each sprite."""

    rank: jax.Array  # from the top
    above: jax.Array  # rows to the next sprite above
    below: jax.Array  # rows to the next sprite below
    is_drawn_below: jax.Array  # whether the next sprite below is drawn


def _picture(kind: int) -> np.ndarray:
    """Rows of both players of a picture from its last row up to its first."""
    low = int(ROM.data[BANK + 0xA5F + kind])
    page = int(ROM.data[BANK + 0xA8F + kind])
    first = ((page & 15) << 8) + low
    return ROM.bytes(first, PICTURE_ROWS + 1) | ROM.bytes(first | 0x100, PICTURE_ROWS + 1)


def _extents() -> Pictures:
    """Extents of the pictures with only some visible `Rows`, by look."""
    at = np.arange(PICTURE_ROWS + 1)
    collectables = range(Kind.COLLECTABLE, Kind.COLLECTABLE + COLLECTABLE_KINDS)
    kinds = (*range(CAR_KINDS), Kind.FLAG, *collectables)
    shown = [
        np.where((at > low) & (at <= high), _picture(kind), 0)[:0:-1]
        for kind in kinds
        for high in range(PICTURE_ROWS + 1)
        for low in range(PICTURE_ROWS + 1)
    ]
    return Pictures.of(shown, look=len(kinds), high=PICTURE_ROWS + 1, low=PICTURE_ROWS + 1)


PICTURE_EXTENTS = _extents()


def object_boxes(m: Ram, d: Drawn) -> Box:
    """The boxes of all four sprites, with the rows that the others leave them."""
    rows = _rows_shown(m, d)
    look = _look_of(d.kind)
    low = jnp.where(d.x >= CLEARED_FROM, jnp.maximum(rows.low, 1), rows.low)
    index = PICTURE_EXTENTS.index(look=look, high=rows.high, low=low)
    left, top, w, h = PICTURE_EXTENTS.extent(index, mirrored=m.mirrored)
    is_car = look < Look.FLAG  # its dots are two columns wide
    x = d.x + jnp.where(is_car, 2 * left, left - 1)
    width = jnp.where(is_car, 2 * w, w)
    return box(x, d.y + PICTURE_ROWS + top, width, h, (d.y <= LAST_ROW) & (h > 0)).clip(*VIEW)


def _look_of(kind: jax.Array) -> jax.Array:
    return match(
        (kind == Kind.PLAYER, Look.PLAYER),
        (is_collectable(kind), Look.COLLECTABLE + (kind & COLLECTABLE_KINDS - 1)),
        (kind < Kind.FLAG, kind & CAR_KINDS - 1),
        otherwise=Look.FLAG,
    )


def is_collectable(kind: jax.Array) -> jax.Array:
    """True for kinds that are collectables."""
    return among(kind, range(Kind.COLLECTABLE, Kind.COLLECTABLE + 8))


def _rows_shown(m: Ram, d: Drawn) -> Rows:
    """The visible rows of the pictures; all rows for sprites skipped on this frame."""
    skipped = _is_skipped(m, d.y)
    y = jnp.where(skipped, _place_aside(d.y), d.y)
    near = _neighbours_of(y, is_drawn=~skipped & (d.kind != Kind.HIDDEN))
    room = _rows_free(d, y, near.above)
    gives_way = ((m.counter - 1 + near.rank) & 1) == 0
    lost = jnp.minimum(PICTURE_ROWS + SET_UP_ROWS - near.below, room - 2)
    cut = when(gives_way & (near.rank < LAST_RANK) & near.is_drawn_below, lost)
    low = jnp.clip(cut, 0, PICTURE_ROWS)
    is_last_cut = (near.rank == LAST_RANK) & ((m.counter & 1) == 0)
    is_cut = gives_way | (near.rank == 0) | is_last_cut
    high = jnp.clip(jnp.where(is_cut, room, PICTURE_ROWS), 0, PICTURE_ROWS)
    return Rows(jnp.where(skipped, 0, low), jnp.where(skipped, PICTURE_ROWS, high))


def _rows_free(d: Drawn, y: jax.Array, above: jax.Array) -> jax.Array:
    """Rows from the sprite above, or from the top of the view, to a sprite's own end."""
    from_top = y + 1 - ((d.fine & 2) >> 1)
    lost_to_road = when(((y - above + d.fine + 1) & 2) == 0, 1)
    return jnp.where(above == NOWHERE, from_top, above - 2 - lost_to_road)


def _is_skipped(m: Ram, y: jax.Array) -> jax.Array:
    """True for sprites skipped on this frame because another one is near; they alternate."""
    is_near = jnp.any((jnp.abs(_rows_apart(y)) < NEAR_ROWS) & OTHERS, axis=1)
    return is_near & (((_ranks(y) + m.counter) & 1) == 0)


def _place_aside(y: jax.Array) -> jax.Array:
    """The new row of skipped sprites: the first one with free rows below."""
    below = _least((_rows_apart(y) < 0) & OTHERS, -_rows_apart(y))
    free_below = jnp.minimum(below, BOTTOM - y)
    first_free = _least(free_below >= SPACE, y)
    return jnp.where(jnp.min(y) >= SPACE, FIRST_PLACE, first_free) + NEAR_ROWS


def _neighbours_of(y: jax.Array, is_drawn: jax.Array) -> Neighbours:
    """The neighbours of sprites in some rows."""
    apart = _rows_apart(y)
    below = _least(apart <= -NEAR_ROWS, -apart)
    is_drawn_below = jnp.any((apart == -below[:, None]) & is_drawn[None, :], axis=1)
    return Neighbours(_ranks(y), _least(apart >= NEAR_ROWS, apart), below, is_drawn_below)


def _rows_apart(y: jax.Array) -> jax.Array:
    """Rows from each other sprite down to each sprite, `[4, 4]`."""
    return y[:, None] - y[None, :]


def _ranks(y: jax.Array) -> jax.Array:
    """The sprites' order from the top; in one row, by their numbers."""
    is_after = SPRITES[:, None] > SPRITES[None, :]
    return jnp.sum(when((_rows_apart(y) > 0) | ((_rows_apart(y) == 0) & is_after), 1), axis=1)


def _least(condition: jax.Array, values: jax.Array) -> jax.Array:
    """The least value for which the condition holds, along the last axis; otherwise NOWHERE."""
    return jnp.min(jnp.where(condition, values, NOWHERE), axis=-1)
