"""Adventure's screen as it was drawn.

A turn of the game takes three frames, on which it shows the same two things. If there are more in
the room, others have the next turn. What it shows is copied first, so that only the player has to
be put back: he moves before the first frame, and if he ran into something, he goes back and tries
to move up or down before the second frame, and to the side before the third.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.lax import clz
from ocjax.console.boxes import Box, box, choose, edges
from ocjax.console.ops import extremes, lookup, match, pick, when
from ocjax.console.registers import larger_part
from ocjax.console.rom import Pictures
from ocjax.extractors.adventure import rooms
from ocjax.extractors.adventure.ram import (
    AUTHOR,
    BAT,
    BLACK_GATE,
    BLACK_KEY,
    BRIDGE,
    CHALICE,
    DOT,
    DRAGONS,
    ENTRY_BYTES,
    GATES,
    LEVEL,
    MAGNET,
    RED_DRAGON,
    ROM,
    SWORD,
    WHITE_GATE,
    WHITE_KEY,
    YELLOW_GATE,
    YELLOW_KEY,
    Mouth,
    Push,
    Ram,
    Shown,
    Wait,
)

THING_LINE = 238  # line of a thing's first row if its `y` is 0, which counts pairs of lines upwards
PLAYER_LINE = 230  # likewise, of the player
STRIDE = 4
LEAST_X = 3  # the player's `x` in a room
MOST_X = 0x9E
WRAPPED = 0xF0  # from here on, `x` is less than 0

# The pictures of things, all of which end with an empty row.
PICTURE_ROWS_AT = 0xFB15  # three bytes before the first one
PICTURE_ROWS = ROM.bytes(0xB15, 0x307)
ROW_LINES = 2


def _until_empty(first: int) -> np.ndarray:
    """The rows of the picture that begins there, up to the empty one."""
    rest = PICTURE_ROWS[first:]
    ends = np.flatnonzero(rest == 0)
    return rest[: ends[0]] if len(ends) else rest


EXTENTS = Pictures.of(_until_empty(first) for first in range(len(PICTURE_ROWS)))
FOUR_ROWS = np.lib.stride_tricks.sliding_window_view(np.append(PICTURE_ROWS, (0, 0, 0)), 4) @ (
    1 << 8 * np.arange(4)
)  # from each byte on, packed, the first one lowest

TOP_Y = 0x69  # things further up are moved down to it
SECOND_TOP_Y = 0x68  # of the second thing that is drawn


class Sprite(NamedTuple):
    """One of the two things that are drawn."""

    x: jax.Array
    y: jax.Array
    picture: jax.Array  # index in PICTURE_ROWS
    rows: jax.Array
    solid: jax.Array  # whether it is a thing of usual width


class Drawn(NamedTuple):
    """What the game drew."""

    room: jax.Array
    dark: jax.Array
    color: jax.Array  # of walls and player
    x: jax.Array  # of the player
    y: jax.Array
    first: Sprite
    second: Sprite


def as_drawn(m: Ram) -> Drawn:
    """The room on the screen, and where the player and two things were in it."""
    known = lookup(rooms.ADDRESSES & 0xFFF, m.room) == (m.walls_low | m.walls_high << 8) & 0xFFF
    room = jnp.where((m.wait == Wait.THIRD) | ~known, m.last_room, m.room)
    room = jnp.minimum(room, rooms.ROOMS - 1)
    y = PLAYER_LINE - 2 * m.drawn_y
    dark, color = rooms.hides_things(room), lookup(rooms.COLORS, room)
    first = _sprite_of(m.first, m.first_x, jnp.minimum(m.first_y, TOP_Y), first_address(m))
    second = _sprite_of(
        m.second, m.second_x, jnp.minimum(m.second_y, SECOND_TOP_Y), second_address(m)
    )
    return Drawn(room, dark, color, _player_x(m, room, y, (first, second)) - 2, y, first, second)


def first_address(m: Ram) -> jax.Array:
    return m.first_page << 8 | m.first_picture


def second_address(m: Ram) -> jax.Array:
    return m.second_page << 8 | m.second_picture


def _sprite_of(entry: jax.Array, x: jax.Array, y: jax.Array, address: jax.Array) -> Sprite:
    picture = address - PICTURE_ROWS_AT
    *_, rows = EXTENTS.extent(picture)
    nothing = (entry == Shown.LIGHT) | (entry == ENTRY_BYTES * (BRIDGE + 1))
    return Sprite(x - 1, THING_LINE - 2 * y, picture, rows, ~nothing)


def _blocked(
    room: jax.Array, x: jax.Array, y: jax.Array, sprites: tuple[Sprite, Sprite]
) -> jax.Array:
    """Whether the player runs into a wall or a thing there."""
    # He has the four columns from `x - 2` on, the four high bits of the walls there.
    upper, lower = (rooms.walls_at(room, rooms.row_of(line), x - 2) for line in (y, y + 7))
    first, second = (
        s.solid & (abs(2 * (x - s.x) - 8) < 12) & (y + 8 > s.y) & (y < s.y + ROW_LINES * s.rows)
        for s in sprites
    )
    return ((upper | lower) > 15) | first | second


def _player_x(m: Ram, room: jax.Array, y: jax.Array, sprites: tuple[Sprite, Sprite]) -> jax.Array:
    """The column from which he was drawn, plus 2."""
    right, left, up, down = (
        (m.stick & bit) == 0 for bit in (Push.RIGHT, Push.LEFT, Push.UP, Push.DOWN)
    )
    moved = m.last_x + when(right, STRIDE) - when(left, STRIDE)
    moved_y = y - when(up, 2 * STRIDE) + when(down, 2 * STRIDE)
    turned = match(
        ((moved < LEAST_X) | (moved >= WRAPPED), MOST_X), (moved > MOST_X, LEAST_X), otherwise=moved
    )
    _, yellow, green = m.dragon
    eaten = (yellow == Mouth.FULL) | (green == Mouth.FULL)
    in_corner = _blocked(room, moved, y, sprites) & _blocked(room, m.last_x, moved_y, sprites)
    return match(
        ((m.wait == Wait.FIRST) | ((m.wait == Wait.THIRD) & (eaten | in_corner)), turned),
        (m.wait == Wait.THIRD, m.last_x),
        otherwise=m.x,
    )


def _over_player(sprite: Sprite, drawn: Drawn) -> jax.Array:
    """The dots of a thing that are before the player: four bits for each of his four rows."""
    row = drawn.y - sprite.y >> 1
    dots = lookup(FOUR_ROWS, sprite.picture + row) >> 8 * np.arange(4) & 255
    there = (row + np.arange(4) >= 0) & (row + np.arange(4) < sprite.rows) & sprite.solid
    aside = jnp.clip(drawn.x - sprite.x, -4, 8)
    return when(there, dots << 4 >> 8 - aside & 15)


def player_box(drawn: Drawn) -> Box:
    """What shows of the player, who has the colour of the walls."""
    line = drawn.y + ROW_LINES * np.arange(4)
    walls = rooms.walls_at(drawn.room, rooms.row_of(line), drawn.x) >> 4
    before = _over_player(drawn.first, drawn) | _over_player(drawn.second, drawn)
    seen = ~(walls | when(~drawn.dark, before)) & 15
    top, bottom = extremes(seen > 0, line, line + ROW_LINES)
    ink = jax.lax.reduce(seen, np.int32(0), jax.lax.bitwise_or, (0,))
    left, right = clz(ink) - 28, 4 - (31 - clz(ink & -ink))
    return edges(drawn.x + left, top, drawn.x + right, bottom, ink > 0).clip(*rooms.VIEW)


class Place(NamedTuple):
    """Where a thing is, as this frame shows it."""

    x: jax.Array
    y: jax.Array
    picture: jax.Array  # low byte of the address
    there: jax.Array


class Size(NamedTuple):
    """What the picture of a thing covers."""

    left: int | jax.Array
    width: int | jax.Array
    rows: int | jax.Array


# fmt: off
FIXED = {  # things that stay: room, x and y
    YELLOW_GATE: (0x11, 0x4D, 0x31),
    WHITE_GATE:  (0x0F, 0x4D, 0x31),
    BLACK_GATE:  (0x10, 0x4D, 0x31),
    AUTHOR:      (0x1E, 0x50, 0x69),
    LEVEL:       (0x00, 0x50, 0x40),
}
SIZES = {  # of things with one picture
    AUTHOR:      Size(0, 8, 95),
    SWORD:       Size(0, 8, 5),
    BRIDGE:      Size(0, 8, 24),
    YELLOW_KEY:  Size(0, 8, 3),
    WHITE_KEY:   Size(0, 8, 3),
    BLACK_KEY:   Size(0, 8, 3),
    DOT:         Size(0, 1, 1),
    CHALICE:     Size(0, 8, 9),
    MAGNET:      Size(0, 8, 8),
}
# fmt: on


class Low:  # low bytes of the addresses of things with several pictures
    OPEN_GATE = 0x24  # a gate that is less open begins earlier
    GATE_END = 0x28
    DRAGON = 0x3A
    BITING_DRAGON = 0x66
    DEAD_DRAGON = 0x4F
    BAT_UP = 0x1A
    BAT_DOWN = 0x22
    LEVELS = (0xF4, 0xF4, 0x04, 0x04, 0x0C)  # by `Ram.level`


GATE_STEPS = 12
BAT_UP_MOST = 3  # `Ram.bat` of the first picture
BOTTOM_Y = 9  # nothing is drawn of things further down
FAR_Y = 0xE8  # nor of things whose `y` is larger than this


def _by_state(m: Ram, number: int) -> jax.Array | int:
    """Which picture a thing's state asks for."""
    if number in GATES:
        step = jnp.clip((m.gate[number] + 3 >> 2) - 1, 0, GATE_STEPS)
        return Low.OPEN_GATE - 2 * jnp.minimum(step, GATE_STEPS - step)
    if number in DRAGONS:
        state = m.dragon[number - RED_DRAGON]
        return match(
            ((state == Mouth.ROAMS) | (state == Mouth.FULL), Low.DRAGON),
            (state == Mouth.OPEN, Low.BITING_DRAGON),
            otherwise=Low.DEAD_DRAGON,
        )
    if number == BAT:
        return jnp.where(m.bat <= BAT_UP_MOST, Low.BAT_UP, Low.BAT_DOWN)
    return pick(m.level, Low.LEVELS)


def _size_of(number: int, picture: jax.Array) -> Size:
    """What a thing's picture covers."""
    if number in GATES:
        return Size(0, 7, Low.GATE_END - picture)
    if number in DRAGONS:
        rows = match(
            (picture == Low.BITING_DRAGON, 17),
            (picture == Low.DEAD_DRAGON, 22),
            otherwise=20,
        )
        return Size(0, 8, rows)
    if number == BAT:
        return Size(0, 8, jnp.where(picture == Low.BAT_UP, 7, 11))
    if number == LEVEL:
        is_one = picture == Low.LEVELS[0]
        return Size(jnp.where(is_one, 4, 3), jnp.where(is_one, 3, 5), 7)
    return SIZES[number]


def place_of(m: Ram, drawn: Drawn, number: int) -> Place:
    """Where a thing is: from what was copied if this frame shows it."""
    entry, at = ENTRY_BYTES * (number + 1), number - RED_DRAGON
    first, second = m.first == entry, m.second == entry
    moves = number >= RED_DRAGON
    room, x, y = (m.thing_room[at], m.thing_x[at], m.thing_y[at]) if moves else FIXED[number]
    x, y, picture = (
        match((first, one), (second, other), otherwise=own)
        for one, other, own in (
            (m.first_x, m.second_x, x),
            (m.first_y, m.second_y, y),
            (m.first_picture, m.second_picture, _by_state(m, number)),
        )
    )
    there = first | second | ((drawn.room == room) & (m.second != Shown.NOTHING))
    top = THING_LINE - 2 * jnp.minimum(y, jnp.where(second, SECOND_TOP_Y, TOP_Y))
    return Place(x - 1, top, picture, there & (y >= BOTTOM_Y) & (y <= FAR_Y))


class Cuts(NamedTuple):
    """What a dark room shows of the two things that are drawn."""

    first: Box
    second: Box


def cut_things(drawn: Drawn) -> Cuts:
    return Cuts(_uncovered(drawn.first, drawn.room), _uncovered(drawn.second, drawn.room))


def thing_box(m: Ram, drawn: Drawn, cut: Cuts, number: int) -> Box:
    """A thing other than the bridge: in a dark room what shows of it, if this frame shows it."""
    at, entry = place_of(m, drawn, number), ENTRY_BYTES * (number + 1)
    left, width, rows = _size_of(number, at.picture)
    whole = box(larger_part(at.x, 8) + left, at.y, width, ROW_LINES * rows)
    hidden = drawn.dark | (drawn.color == THING_COLORS[number])
    of_second = choose(hidden & (m.second == entry), cut.second, whole)
    shown = choose(hidden & (m.first == entry), cut.first, of_second)
    return shown.where(at.there).clip(*rooms.VIEW)


THING_COLORS = (ROM.bytes(0xF44 + ENTRY_BYTES + 6, 17, step=ENTRY_BYTES) & ~1).tolist()
FOURS = np.arange(0, 24, 4)  # rows of the tallest thing in a dark room
EACH_ROW = 0x01010101


def _until(row: jax.Array) -> jax.Array:
    """The rows of FOURS that are above a row, as words that have their bits set."""
    rows = jnp.clip(row - FOURS, 0, 4)
    return jnp.where(rows == 4, -1, (1 << 8 * (rows & 3)) - 1)


def _rows_left(sprite: Sprite, room: jax.Array) -> jax.Array:
    """What the walls of a dark room leave of the rows of a picture: four in each of six words."""
    row = rooms.row_of(sprite.y)
    first, second, third = rooms.walls_at(room, row + np.arange(3), sprite.x) * EACH_ROW
    second_from = (rooms.ROW_HEIGHT * (row + 1) + rooms.BEFORE_ROWS - sprite.y) >> 1
    above_second, above_third = (
        _until(second_from),
        _until(second_from + rooms.ROW_HEIGHT // ROW_LINES),
    )
    walls = first & above_second | ~above_second & (second & above_third | third & ~above_third)
    visible = _until(jnp.minimum(sprite.rows, (rooms.VIEW[3] - sprite.y) >> 1))
    return lookup(FOUR_ROWS, sprite.picture + FOURS) & ~walls & visible


def _uncovered(sprite: Sprite, room: jax.Array) -> Box:
    """What walls leave of a thing."""
    x, y, seen = sprite.x, sprite.y, _rows_left(sprite, room)
    first, last = FOURS + (31 - clz(seen & -seen) >> 3), FOURS + (31 - clz(seen) >> 3)
    top, bottom = extremes(seen != 0, first, last + 1)
    ink = jax.lax.reduce(seen, np.int32(0), jax.lax.bitwise_or, (0,))
    ink = (ink | ink >> 16) & 0xFFFF
    ink = (ink | ink >> 8) & 0xFF
    left, right = clz(ink) - 24, 8 - (31 - clz(ink & -ink))
    return edges(x + left, y + 2 * top, x + right, y + 2 * bottom, ink > 0)
