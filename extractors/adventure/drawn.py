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
from ocjax.console.boxes import Box, box, choose, edges
from ocjax.console.ops import extremes, lookup, match, pick, when
from ocjax.console.registers import larger_part
from ocjax.console.rom import Pictures
from ocjax.extractors.adventure import rooms
from ocjax.extractors.adventure.ram import (
    ENTRY,
    ROM,
    THINGS,
    Mouth,
    Push,
    Ram,
    Shown,
    Wait,
)

STEP = 4
LEAST_X = 3  # the player's `x` in a room
MOST_X = 0x9E
WRAPPED = 0xF0  # from here on, `x` is less than 0

# The pictures of things, all of which end with an empty row.
PICTURES_AT = 0xFB18
PICTURES = ROM.bytes(0xB18, 0x304)
TALLEST = 24  # rows
ROW_LINES = 2


class Drawn(NamedTuple):
    """What the game drew."""

    room: jax.Array
    dark: jax.Array
    x: jax.Array  # of the player
    y: jax.Array
    saver: jax.Array


def as_drawn(m: Ram) -> Drawn:
    """The room on the screen, and where the player was in it."""
    known = lookup(rooms.ADDRESSES & 0xFFF, m.room) == (m.walls_low | m.walls_high << 8) & 0xFFF
    room = jnp.where((m.wait == Wait.THIRD) | ~known, m.last_room, m.room)
    room = jnp.minimum(room, rooms.ROOMS - 1)
    return Drawn(room, rooms.hides(m, room), _player_x(m) - 2, 230 - 2 * m.drawn_y, m.saver)


def _player_x(m: Ram) -> jax.Array:
    right, left = ((m.stick & bit) == 0 for bit in (Push.RIGHT, Push.LEFT))
    moved = m.last_x + when(right, STEP) - when(left, STEP)
    turned = match(
        ((moved < LEAST_X) | (moved >= WRAPPED), MOST_X), (moved > MOST_X, LEAST_X), otherwise=moved
    )
    _, yellow, green = m.dragon
    eaten = (yellow == Mouth.FULL) | (green == Mouth.FULL)
    return match(
        ((m.wait == Wait.FIRST) | ((m.wait == Wait.THIRD) & eaten), turned),
        (m.wait == Wait.THIRD, m.last_x),
        otherwise=m.x,
    )


def player_box(drawn: Drawn) -> Box:
    """What shows of the player, who has the colour of the walls."""
    x, y = drawn.x, drawn.y
    upper, lower = rooms.row_of(y), rooms.row_of(y + 7)
    free_above = ~rooms.walls_at(drawn.room, upper, x) >> 4 & 15
    free_below = ~rooms.walls_at(drawn.room, lower, x) >> 4 & 15
    free = free_above | free_below
    left = match(*((free >= limit, i) for i, limit in enumerate((8, 4, 2))), otherwise=3)
    right = match(*((free & (1 << i) > 0, 4 - i) for i in range(4)), otherwise=0)
    next_row = rooms.ROW * lower + rooms.BEFORE_ROWS
    top = jnp.where(free_above > 0, y, next_row)
    bottom = jnp.where((free_below > 0) | (upper == lower), y + 8, next_row)
    return edges(x + left, top, x + right, bottom, free > 0).clip(*rooms.VIEW)


class Things(NamedTuple):
    """All things: `[17]`."""

    x: jax.Array
    y: jax.Array
    picture: jax.Array  # address in PICTURES
    there: jax.Array
    shown: jax.Array  # whether this frame shows them


# fmt: off
FIXED_ROOM = np.array((0x11, 0x0F, 0x10, 0x1E, 0x00))  # the gates, the author's name, the level
FIXED_X = np.array((0x4D, 0x4D, 0x4D, 0x50, 0x50))
FIXED_Y = np.array((0x31, 0x31, 0x31, 0x69, 0x40))
# fmt: on
ENTRIES = ENTRY * np.arange(1, THINGS + 1)
END_PICTURE = 0xFB24  # of the last step of an open gate; others begin two rows earlier a step
GATE_STEPS = 12
DRAGON = 0xFD3A
BITING_DRAGON = 0xFD66
DEAD_DRAGON = 0xFD4F
BAT_UP = 0xFD1A
BAT_DOWN = 0xFD22
BAT_UP_MOST = 3  # `Ram.bat` of the first picture
LEVELS = (0xFCF4, 0xFCF4, 0xFD04, 0xFD04, 0xFD0C)  # by `Ram.level`
AUTHOR_PICTURE = 0xFD88
# From the sword on: sword, bridge, three keys; and after the bat: dot, chalice, magnet.
BEFORE_BAT = np.array((0xFD7C, 0xFCDB, 0xFD00, 0xFD00, 0xFD00))
AFTER_BAT = np.array((0xFD86, 0xFDF3, 0xFE12))


def _whole(first: int) -> np.ndarray:
    """The rows of the picture that begins there, up to the empty one."""
    rest = PICTURES[first:]
    ends = np.flatnonzero(rest == 0)
    return rest[: ends[0]] if len(ends) else rest


EXTENTS = Pictures.of(_whole(first) for first in range(len(PICTURES)))
FOUR_ROWS = np.lib.stride_tricks.sliding_window_view(np.append(PICTURES, (0, 0, 0)), 4) @ (
    1 << 8 * np.arange(4)
)  # from each byte on, packed
TOP_Y = 0x69  # things further up are moved down to it
BOTTOM_Y = 9  # nothing is drawn of things further down
FAR_Y = 0xE8  # nor of those beyond


def _pictures(m: Ram) -> jax.Array:
    """Where the pictures of all things begin, by their states."""
    step = jnp.clip((m.gate + 3 >> 2) - 1, 0, GATE_STEPS)
    gates = END_PICTURE - 2 * jnp.minimum(step, GATE_STEPS - step)
    dragons = match(
        ((m.dragon == 0) | (m.dragon == Mouth.FULL), DRAGON),
        (m.dragon == Mouth.OPEN, BITING_DRAGON),
        otherwise=DEAD_DRAGON,
    )
    bat = jnp.where(m.bat <= BAT_UP_MOST, BAT_UP, BAT_DOWN)
    single = jnp.stack((jnp.int32(AUTHOR_PICTURE), pick(m.level, LEVELS)))
    return jnp.concatenate((gates, single, dragons, BEFORE_BAT, bat[None], AFTER_BAT))


def _top(y: jax.Array) -> jax.Array:
    return 238 - 2 * jnp.minimum(y, TOP_Y)


def things(m: Ram, drawn: Drawn) -> Things:
    """What is in the room, as this frame shows it."""
    first, second = m.first == ENTRIES, m.second == ENTRIES
    room, x, y = (
        jnp.concatenate((fixed, place))
        for fixed, place in (
            (FIXED_ROOM, m.thing_room),
            (FIXED_X, m.thing_x),
            (FIXED_Y, m.thing_y),
        )
    )
    x, y, picture = (
        match((first, one), (second, other), otherwise=own)
        for one, other, own in (
            (m.first_x, m.second_x, x),
            (m.first_y, m.second_y, y),
            (
                m.first_page << 8 | m.first_picture,
                m.second_page << 8 | m.second_picture,
                _pictures(m),
            ),
        )
    )
    shown = first | second
    others = (room == drawn.room) & (m.second != Shown.NOTHING)
    there = (shown | others) & (y >= BOTTOM_Y) & (y <= FAR_Y)
    return Things(x - 1, _top(y), picture - PICTURES_AT, there, shown)


def thing_boxes(m: Ram, drawn: Drawn) -> Box:
    """All things but the bridge, `[17]`: in dark rooms what shows of those that this frame shows."""
    all_things = things(m, drawn)
    left, _, width, height = EXTENTS.extent(all_things.picture)
    x = larger_part(all_things.x, 8) + left
    whole = box(x, all_things.y, width, ROW_LINES * height, all_things.there)
    first = _cut(m.first_x, m.first_y, m.first_page << 8 | m.first_picture, drawn)
    second = _cut(m.second_x, m.second_y, m.second_page << 8 | m.second_picture, drawn)
    of_second = choose(drawn.dark & (m.second == ENTRIES), second, whole)
    boxes = choose(drawn.dark & (m.first == ENTRIES), first, of_second)
    return boxes.where(all_things.there).clip(*rooms.VIEW)


def _dots(picture: jax.Array) -> jax.Array:
    """The rows of a picture: `[24]`."""
    fours = lookup(FOUR_ROWS, picture + np.arange(0, TALLEST, 4))
    return (fours[:, None] >> (8 * np.arange(4))[None] & 255).reshape(-1)


def _walls_before(line: jax.Array, x: jax.Array, drawn: Drawn) -> jax.Array:
    """The walls in each line of a thing, which lies in three rows of walls at most."""
    row = rooms.row_of(line)
    first, second, third = rooms.walls_at(drawn.room, row[0] + np.arange(3), x)
    return match((row == row[0], first), (row == row[0] + 1, second), otherwise=third)


def _cut(thing_x: jax.Array, thing_y: jax.Array, address: jax.Array, drawn: Drawn) -> Box:
    """What the walls of a dark room leave of a thing."""
    row, picture = np.arange(TALLEST), address - PICTURES_AT
    x, y = thing_x - 1, _top(thing_y)
    line = y + ROW_LINES * row
    *_, height = EXTENTS.extent(picture)
    visible = (row < height) & (line < rooms.VIEW[3])
    seen = jnp.where(visible, _dots(picture) & ~_walls_before(line, x, drawn), 0)
    top, bottom = extremes(seen > 0, line, line + ROW_LINES)
    ink = jax.lax.reduce(seen, np.int32(0), jax.lax.bitwise_or, (0,))
    left = match(*((ink >= 128 >> i, i) for i in range(8)), otherwise=8)
    right = match(*((ink & (1 << i) > 0, 8 - i) for i in range(8)), otherwise=0)
    return edges(x + left, top, x + right, bottom, ink > 0)
