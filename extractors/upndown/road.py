"""The two roads of Up'n Down: their columns in each row, and the positions of their pieces.

In most rows, both roads are at the same distance from the middle of the screen, one on each side.
In other rows, both roads lead the same way, one 80 columns to the right of the other. One number
encodes either case: the distance from the middle, or the left road's column plus `SAME_WAY`. It is
called the road's `course` in that row.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import lookup, when
from ocjax.extractors.upndown.ram import BANK, ROM, Ram

MAPS = 3  # each for the two roads of some rounds
ROUND_MAPS = ((ROM.bytes(BANK + 0xBE3, 10) & 15) - 12).tolist()  # the map, by round, starting at 1
BYTES = 256  # of a map
ROWS = 1024  # of a map
MIDDLE = 72  # origin of courses, a column
CROSSING = 1  # the least course, at a crossing of the roads
SAME_WAY = 128  # added to courses that are columns
ROADS_APART = 80  # columns between two roads that lead the same way
RIGHT_FROM = MIDDLE + 4  # least column of a car on the right one of these

HASHES = 1024  # of the pieces
HASH = np.array((125, 153, 27))  # of a piece's three bytes: few pieces share a hash


def _all_courses() -> np.ndarray:
    """The courses of all rows, `[map, row]`, flat."""
    row = np.arange(ROWS)
    road = ROM.bytes(BANK + 0xC00, MAPS * BYTES).astype(int).reshape(MAPS, BYTES)
    here = road[:, 2 * (row >> 3) & BYTES - 1]
    there = road[:, 2 * (row >> 3) + 2 & BYTES - 1]
    bend = ((there & 0x3E) - (here & 0x3E)) * (row & 7) >> 3
    left = (here & 0x3E) + 16 + bend + (bend < 0)
    double = (here >= 0x80) & (left < MIDDLE)
    return np.where(double, left + SAME_WAY, np.maximum(MIDDLE - left, CROSSING)).ravel()


def _all_places() -> np.ndarray:
    """The first and the last position of the pieces by hash: `[which, map, hash]`, flat."""
    of_maps = [_hashes_of(number) for number in range(MAPS)]
    last = [dict(zip(listed, range(BYTES), strict=True)) for listed in of_maps]
    first = [dict(zip(listed[::-1], range(BYTES)[::-1], strict=True)) for listed in of_maps]
    by_map = [[by_hash.get(h, 0) for h in range(HASHES)] for by_hash in (*first, *last)]
    return np.array(by_map).ravel()


def _hashes_of(number: int) -> list[int]:
    """The hashes of the pieces of a map."""
    pages = ROM.bytes(0x500 + MAPS * BYTES * number, MAPS * BYTES).astype(int).reshape(3, BYTES)
    return (HASH @ pages[[1, 2, 0]] % HASHES).tolist()


COURSES = _all_courses()
PLACES = _all_places()


def course_at(m: Ram, row: jax.Array) -> jax.Array:
    """The roads' courses in rows of the map."""
    return lookup(COURSES, ROWS * lookup(ROUND_MAPS, m.level) + (row & (ROWS - 1)))


def column_near(course: jax.Array, x: jax.Array) -> jax.Array:
    """The column of an object on the road with a course, one step before it was in column `x`."""
    opposite = jnp.where(x >= MIDDLE, MIDDLE + course, MIDDLE - course)
    double = course - SAME_WAY + when(x >= RIGHT_FROM, ROADS_APART)
    return jnp.where(course >= SAME_WAY, double, opposite)


def is_on_road(course: jax.Array, x: jax.Array) -> jax.Array:
    """True if an object in column `x` is on a road with this course."""
    opposite = jnp.minimum(jnp.abs(x - MIDDLE), MIDDLE)
    double = jnp.where(x >= RIGHT_FROM, x - ROADS_APART, x) + SAME_WAY
    return (course == opposite) | (course == double)


def piece_places(m: Ram) -> jax.Array:
    """Possible positions on the map of the last drawn piece, int32 `[2]`."""
    at = HASHES * lookup(ROUND_MAPS, m.level) + (jnp.sum(m.piece * HASH) & (HASHES - 1))
    return lookup(PLACES, at + MAPS * HASHES * np.arange(2))
