"""Adventure's things: positions, extents of pictures, and visible parts in dark rooms."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.lax import clz
from ocjax.authoring import Box, box, choose, edges, extremes, larger_part, match, pick
from ocjax.extractors.adventure import rooms
from ocjax.extractors.adventure.drawn import (
    SECOND_TOP_Y,
    THING_LINE,
    TOP_Y,
    Drawn,
    Sprite,
)
from ocjax.extractors.adventure.pictures import ROW_DOTS, ROW_LINES, four_rows, ink_columns, united
from ocjax.extractors.adventure.ram import (
    DRAGONS,
    ENTRY_BYTES,
    GATES,
    ROM,
    THINGS,
    Mouth,
    Ram,
    Shown,
    Thing,
)


class Place(NamedTuple):
    """The position of a thing in this frame."""

    x: jax.Array
    y: jax.Array
    picture: jax.Array  # low byte of the address
    there: jax.Array


class Size(NamedTuple):
    """The extent of a thing's picture."""

    left: int | jax.Array
    width: int | jax.Array
    rows: int | jax.Array


class Own(NamedTuple):
    """The position in a thing's record: `x` is a column more, `y` counts pairs of lines upwards."""

    room: int | jax.Array
    x: int | jax.Array
    y: int | jax.Array


FIXED = {  # things that never move
    Thing.YELLOW_GATE: Own(room=0x11, x=0x4D, y=0x31),
    Thing.WHITE_GATE: Own(room=0x0F, x=0x4D, y=0x31),
    Thing.BLACK_GATE: Own(room=0x10, x=0x4D, y=0x31),
    Thing.AUTHOR: Own(room=0x1E, x=0x50, y=0x69),
    Thing.LEVEL: Own(room=0x00, x=0x50, y=0x40),
}
SIZES = {  # things with one picture
    Thing.AUTHOR: Size(left=0, width=8, rows=95),
    Thing.SWORD: Size(left=0, width=8, rows=5),
    Thing.BRIDGE: Size(left=0, width=8, rows=24),
    Thing.YELLOW_KEY: Size(left=0, width=8, rows=3),
    Thing.WHITE_KEY: Size(left=0, width=8, rows=3),
    Thing.BLACK_KEY: Size(left=0, width=8, rows=3),
    Thing.DOT: Size(left=0, width=1, rows=1),
    Thing.CHALICE: Size(left=0, width=8, rows=9),
    Thing.MAGNET: Size(left=0, width=8, rows=8),
}
FOURS = np.arange(0, 24, 4)  # rows of the tallest thing in a dark room
EACH_ROW = 0x01010101  # one bit in each byte of a word
COLORS = (ROM.bytes(0xF44 + ENTRY_BYTES + 6, THINGS, step=ENTRY_BYTES) & ~1).tolist()


class Low:  # low bytes of the addresses of things with several pictures
    OPEN_GATE = 0x24  # with its four rows; the picture of a less open gate begins earlier
    GATE_END = 0x28
    DRAGON = 0x3A
    BITING_DRAGON = 0x66
    DEAD_DRAGON = 0x4F
    BAT_UP = 0x1A
    BAT_DOWN = 0x22
    LEVELS = (0xF4, 0xF4, 0x04, 0x04, 0x0C)  # by `Ram.level`


GATE_STEPS = 12  # at 0 and 12 it is open, at 6 closed
BAT_UP_MOST = 3  # `Ram.bat` of the first picture
BOTTOM_Y = 9  # the game draws no things further down
FAR_Y = 0xE8  # greatest `y` of a drawn thing


def _by_state(m: Ram, number: int) -> jax.Array | int:
    """The low byte of the picture for a thing's state."""
    if number in GATES:
        step = jnp.clip((m.gate[number] + 3 >> 2) - 1, 0, GATE_STEPS)
        return Low.OPEN_GATE - 2 * jnp.minimum(step, GATE_STEPS - step)
    if number in DRAGONS:
        state = m.dragon[number - Thing.RED_DRAGON]
        return match(
            ((state == Mouth.ROAMS) | (state == Mouth.FULL), Low.DRAGON),
            (state == Mouth.OPEN, Low.BITING_DRAGON),
            otherwise=Low.DEAD_DRAGON,
        )
    if number == Thing.BAT:
        return jnp.where(m.bat <= BAT_UP_MOST, Low.BAT_UP, Low.BAT_DOWN)
    return pick(m.level, Low.LEVELS)


def _size_of(number: int, picture: jax.Array) -> Size:
    """The extent of a thing's picture."""
    if number in GATES:
        return Size(0, 7, Low.GATE_END - picture)
    if number in DRAGONS:
        rows = match(
            (picture == Low.BITING_DRAGON, 17),
            (picture == Low.DEAD_DRAGON, 22),
            otherwise=20,
        )
        return Size(0, 8, rows)
    if number == Thing.BAT:
        return Size(0, 8, jnp.where(picture == Low.BAT_UP, 7, 11))
    if number == Thing.LEVEL:
        is_one = picture == Low.LEVELS[0]
        return Size(jnp.where(is_one, 4, 3), jnp.where(is_one, 3, 5), 7)
    return SIZES[number]


def place_of(m: Ram, drawn: Drawn, number: int) -> Place:
    """The position of a thing: the game's copy if this frame shows it, otherwise its record."""
    entry = ENTRY_BYTES * (number + 1)
    is_first = m.first == entry
    is_second = m.second == entry
    own = _own_place(m, number)
    x = match((is_first, m.first_x), (is_second, m.second_x), otherwise=own.x)
    y = match((is_first, m.first_y), (is_second, m.second_y), otherwise=own.y)
    picture = match(
        (is_first, m.first_picture), (is_second, m.second_picture), otherwise=_by_state(m, number)
    )
    waits = (drawn.room == own.room) & (m.second != Shown.NOTHING)  # for its turn to be drawn
    in_view = (y >= BOTTOM_Y) & (y <= FAR_Y)
    highest = jnp.where(is_second, SECOND_TOP_Y, TOP_Y)
    top = THING_LINE - ROW_LINES * jnp.minimum(y, highest)
    return Place(x - 1, top, picture, (is_first | is_second | waits) & in_view)


def _own_place(m: Ram, number: int) -> Own:
    """The position in a thing's record."""
    if number in FIXED:
        return FIXED[number]
    at = number - Thing.RED_DRAGON
    return Own(m.thing_room[at], m.thing_x[at], m.thing_y[at])


class Cuts(NamedTuple):
    """The visible parts of the two drawn things in a dark room."""

    first: Box
    second: Box


def cut_things(drawn: Drawn) -> Cuts:
    """The parts of the drawn things that walls do not hide."""
    return Cuts(_uncovered(drawn.first, drawn.room), _uncovered(drawn.second, drawn.room))


def thing_box(m: Ram, drawn: Drawn, cut: Cuts, number: int) -> Box:
    """A thing other than the bridge: in a dark room the visible part, if this frame shows it."""
    at = place_of(m, drawn, number)
    entry = ENTRY_BYTES * (number + 1)
    left, width, rows = _size_of(number, at.picture)
    whole = box(larger_part(at.x, ROW_DOTS) + left, at.y, width, ROW_LINES * rows)
    is_hidden = drawn.dark | (drawn.color == COLORS[number])
    of_second = choose(is_hidden & (m.second == entry), cut.second, whole)
    shown = choose(is_hidden & (m.first == entry), cut.first, of_second)
    return shown.where(at.there).clip(*rooms.VIEW)


def _uncovered(sprite: Sprite, room: jax.Array) -> Box:
    """The part of a thing that walls do not hide."""
    seen = _rows_left(sprite, room)
    first = FOURS + (31 - clz(seen & -seen) >> 3)
    last = FOURS + (31 - clz(seen) >> 3)
    top, bottom = extremes(seen != 0, first, last + 1)
    ink = _one_row(united(seen))
    left, right = ink_columns(ink, ROW_DOTS)
    return edges(
        left=sprite.x + left,
        top=sprite.y + ROW_LINES * top,
        right=sprite.x + right,
        bottom=sprite.y + ROW_LINES * bottom,
        valid=ink > 0,
    )


def _one_row(four: jax.Array) -> jax.Array:
    """The bitwise or of the four rows in a word."""
    two = (four | four >> 2 * ROW_DOTS) & 0xFFFF
    return (two | two >> ROW_DOTS) & 0xFF


def _rows_left(sprite: Sprite, room: jax.Array) -> jax.Array:
    """The rows of a picture without the pixels behind a dark room's walls, four per word.

    The result has six words. At most three rows of walls cover a thing.
    """
    row = rooms.row_of(sprite.y)
    walls = rooms.walls_at(room, row + np.arange(3), sprite.x) * EACH_ROW
    second_line = rooms.ROW_HEIGHT * (row + 1) + rooms.BEFORE_ROWS
    second_from = (second_line - sprite.y) >> 1
    above_second = _until(second_from)
    above_third = _until(second_from + rooms.ROW_HEIGHT // ROW_LINES)
    lower = walls[1] & above_third | walls[2] & ~above_third
    hidden = walls[0] & above_second | lower & ~above_second
    in_view = (rooms.VIEW_BOTTOM - sprite.y) >> 1
    visible = _until(jnp.minimum(sprite.rows, in_view))
    return four_rows(sprite.picture, FOURS) & ~hidden & visible


def _until(row: jax.Array) -> jax.Array:
    """A mask of the rows of FOURS above a row, as words."""
    rows = jnp.clip(row - FOURS, 0, 4)
    return jnp.where(rows == 4, -1, (1 << ROW_DOTS * (rows & 3)) - 1)
