"""The rocks of Hero's rooms.

The second bank of the ROM has tables of the rooms. Each room has three parts, one below the other.
The playfield shows eight dots of a part in two bytes, mirrored or repeated.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Box, box, lookup, match, pick, when
from ocjax.extractors.hero.ram import ROM, Form, Ram

BANK = 0x1000  # offset of the second bank

STARTS = ROM.bytes(BANK + 0xF00, 20)  # the first room of each level
LASTS = ROM.bytes(BANK + 0xF28, 20)  # number of the last room of each level
# Dots of each room's middle part; 256 entries later, dots of its bottom part.
ROOM_DOTS = np.stack([ROM.bytes(BANK + 0xA00, 512), ROM.bytes(BANK + 0xC00, 512)], axis=1)
FORMS = ROM.bytes(BANK + 0xE00, 256)  # bits of `Form` for each room
FIRST_RIVER = 11  # the first room of a level with a river
FIRST_PULSE = 13  # the first level with moving lava

MOST = 6  # most rocks in a part
PART = np.repeat((0, 1, 2), MOST)
SLOT = np.arange(3 * MOST)
UPPER_SLOT = MOST - 1  # of the wall in the upper part
LAVA_SLOT = MOST
WALL_SLOT = 2 * MOST - 1
TOPS = (20, 61, 100)  # first lit row of each part
HEIGHTS = (39, 37, 39)  # lit rows
EDGES = (8, 152)  # left columns of the dots at the sides
GAP = (76, 84)  # between rocks; lava closes it

LAVA_HUE = 64  # of a colour
HALF_WALL = 128  # least `hits` that leave half a wall


def _runs(side: int, dots: np.ndarray, mirrored: bool, edge: int = 0) -> list[int]:
    """The playfield's solid stretches, left edge | width << 8; `edge` begins 8 further columns."""
    inner = [dots[0] >> (7 - i) & 1 for i in range(8)], [dots[1] >> i & 1 for i in range(8)]
    half = np.concatenate([[side] * 4, *inner])
    dots_shown = np.repeat(np.concatenate([half, half[::-1] if mirrored else half]), 4)
    column = np.arange(len(dots_shown))
    is_solid = (dots_shown == 1) | (column >= edge) & (column < edge + 8)
    line = np.where(is_solid & (column >= 8), 1, 0)  # the beam blanks the first 8 columns
    ends = np.flatnonzero(np.diff(line, prepend=0, append=0)).reshape(-1, 2).tolist()
    return [a | b - a << 8 for a, b in ends]


def _room_rocks(room: int, side: int) -> list[int]:
    """The rocks of a room, with or without the rocks at the sides of its middle part."""
    number = room - max(start for start in STARTS.tolist() if start <= room)
    above = _dots_above(room, number)
    edge = place if not side and (place := int(FORMS[room]) & Form.PLACE) in EDGES else 0
    middle = _runs(side, ROOM_DOTS[room], not FORMS[room] & Form.REPEATS, edge)
    parts = _runs(1, above, True), middle, _runs(1, ROOM_DOTS[room + 256], True)
    return [rock for rocks in parts for rock in [*rocks, *[0] * MOST][:MOST]]


def _dots_above(room: int, number: int) -> np.ndarray:
    """The dots of a room's ceiling, by the room's number in its level."""
    if number >= FIRST_RIVER:
        return np.array((255, 255))
    return ROOM_DOTS[room + 255] if number else np.array((192, 0))


ROOMS = np.array([_room_rocks(room, side) for side in (1, 0) for room in range(256)]).ravel()


def rock_boxes(m: Ram) -> Box:
    """The rocks of each part, and the destructible wall, which has two parts in room 0."""
    first, last = _closed_by_lava(m, *_stored(m))
    wall_slots = (SLOT == WALL_SLOT) | ((SLOT == UPPER_SLOT) & (m.room == 0))
    wall = wall_slots & (m.wall > EDGES[0] + 1) & (m.wall <= EDGES[1])
    x = jnp.where(wall, m.wall - 1, first)
    end = jnp.where(wall, x + jnp.where(m.hits >= HALF_WALL, 4, 8), last)
    color = rock_colors(m)
    there = (end > x) & (color > 1)
    return box(x, np.array(TOPS)[PART], end - x, np.array(HEIGHTS)[PART], there, color=color & ~1)


def is_lava(m: Ram) -> jax.Array:
    """True if the rocks of the middle part are lava."""
    return (m.color[1] & 240) == LAVA_HUE


def rock_colors(m: Ram) -> jax.Array:
    return jnp.repeat(m.color, MOST, total_repeat_length=len(PART))


def _stored(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The first columns of the rocks, and the columns right of them."""
    room = (pick(m.level, STARTS.tolist()) + m.room) & 255
    packed = lookup(ROOMS, len(PART) * (room + when(m.side == 0, 256)) + SLOT)
    return packed & 255, (packed & 255) + (packed >> 8)


def _closed_by_lava(m: Ram, x: jax.Array, end: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The same columns after lava has closed the gap in the middle, or a part of it."""
    has_gap = (end[LAVA_SLOT] == GAP[0]) & (x[LAVA_SLOT + 1] == GAP[1])
    moves = has_gap & (m.level >= FIRST_PULSE)
    reach = 48 + 4 * jax.lax.population_count(m.dots)
    closed = reach == 80
    closed_end = jnp.where(moves & (SLOT == LAVA_SLOT), jnp.where(closed, 160, reach), end)
    right = moves & (SLOT == LAVA_SLOT + 1)
    closed_x = match((right & closed, closed_end), (right, 160 - reach), otherwise=x)
    return closed_x, closed_end


def free(rocks: Box, begin: jax.Array, end: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Remove rocks from a range of columns in each part; `begin` and `end` are `[3]`."""
    x = rocks.x.reshape(3, MOST)
    w = rocks.w.reshape(3, MOST)
    a = begin[:, None]
    b = end[:, None]
    left = jnp.max(jnp.where((x <= a) & (x + w > a), x + w, a), axis=1)
    return left, jnp.min(jnp.where((x < b) & (x + w >= b), x, b), axis=1)
