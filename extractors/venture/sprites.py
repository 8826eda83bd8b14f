"""Venture's sprites as drawn.

Sprites move after every second frame, three on one and three on the next, and the dot moves after
each one ($F4FE-$F6DF). `as_drawn` undoes this.

The larger hall monster of a room, the guest, alternates with a sprite: it swaps with it at $FB00,
every other turn.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Box, Pictures, among, box, match, pick, when
from ocjax.extractors.venture.ram import PAUSED, ROM, Ram, Room, Status

ROW_COUNTS = (5, 7, 9, 13)  # rows of pictures, two lines each
USUAL_ROWS = ROW_COUNTS.index(9)
PAGE = np.append(ROM.bytes(0xE00, 256), ROM.bytes(0xF00, 16))
PAGE_BYTES = 256
SPRITE_PICTURES = Pictures.of(
    (PAGE[low : low + rows] for rows in ROW_COUNTS for low in range(PAGE_BYTES)),
    rows=len(ROW_COUNTS),
    low=PAGE_BYTES,
)
ALL_ROWS = 256  # minus the rows gives `height`
SPEEDS = ROM.bytes(0xE48, 8).tolist()  # bits of `turns` on which a sprite moves, by its speed
FIRST_TURNS = (0, 2, 4)  # speeds that use the first of `turns`
SECOND_TURNS = (1, 5)  # speeds that use the second of `turns`

VIEW = (0, 24, 160, 186)
SPRITE = np.arange(6)
IS_THIRD = SPRITE % 3 == 2  # of a frame
FIRST_LINE = np.array((26, 27, 27, 26, 27, 27))  # of each sprite
DOT_FIRST_LINE = 25
# `x` minus the column: for the third sprite of a frame, by room, and for all others.
THIRD_SHIFTS = (7, 7, 7, 1, 1, 1, 1, 1, 7, 7)
SHIFT = 1
WALL_SPREAD = 4  # columns of a dot of moving walls
UPWARDS = 128  # least `y` that is negative
GONE = 81  # `y` of a missing sprite

WINKY = 0  # his sprite in a room
WINKY_SIZE = (8, 12)
GUEST_SIZE = (8, 16)
NO_GUEST = 128  # least `guest` that is no sprite
HOSTS = (3, 4)  # sprites that alternate with a guest

MOVERS = np.arange(7)  # the sprites and the dot
DOT = 6
SECOND_HALF = (MOVERS >= 3) & (MOVERS != DOT)  # they move on every other frame
LAST_TICK = 1  # `timer` of a sprite that has just turned round


class Drawn(NamedTuple):
    """The sprites, `[6]`, and the dot as drawn."""

    x: jax.Array  # of the figure that each sprite shows
    y: jax.Array
    picture: jax.Array  # low byte of the address of its first row, minus 1
    own_x: jax.Array  # of the sprite itself, while it shows a guest
    own_y: jax.Array
    dot_x: jax.Array
    dot_y: jax.Array


def as_drawn(m: Ram) -> Drawn:
    """Undo the moves since the frame was drawn."""
    moved_x, moved_y = _moves(m)
    dx = moved_x[:DOT]
    dy = moved_y[:DOT]
    of_guest = m.guest_picture + m.guest_y - 2 * dy  # the reason for the factor is unknown
    return Drawn(
        x=jnp.where(swaps(m), m.guest_x, m.x) - dx,
        y=jnp.where(swaps(m), m.guest_y, m.y) - dy,
        picture=jnp.where(swaps(m), of_guest, m.picture + m.y),
        own_x=m.x - dx,
        own_y=m.y - dy,
        dot_x=m.dot_x - moved_x[DOT],
        dot_y=m.dot_y - moved_y[DOT],
    )


def swaps(m: Ram) -> jax.Array:
    """True for the sprite that has swapped with the larger hall monster."""
    return (m.swapped > 0) & (m.guest == SPRITE)


def sprite_boxes(m: Ram, drawn: Drawn) -> Box:
    """The six sprites."""
    rows = match(
        *((m.height == ALL_ROWS - count, i) for i, count in enumerate(ROW_COUNTS)),
        otherwise=USUAL_ROWS,
    )
    index = SPRITE_PICTURES.index(rows=rows, low=drawn.picture + 1 & 0xFF)
    left, top, width, height = SPRITE_PICTURES.extent(index)
    y = jnp.where(drawn.y >= UPWARDS, drawn.y - 256, drawn.y)
    sprite_x = drawn.x - jnp.where(IS_THIRD, pick(m.room, THIRD_SHIFTS), SHIFT)
    is_wall = (m.room == Room.WALLS) & (SPRITE % 3 > 0)
    x = sprite_x + jnp.where(is_wall, WALL_SPREAD * left, left)
    there = (height > 0) & (drawn.y != GONE)
    return box(x, FIRST_LINE + 2 * (y + top), width, 2 * height, there).clip(*VIEW)


def dot_box(drawn: Drawn, color: jax.Array) -> Box:
    """The hunter in a hall, or his shot."""
    return box(drawn.dot_x - 1, DOT_FIRST_LINE + 2 * drawn.dot_y, 1, 2, color=color)


def winky_box(drawn: Drawn) -> Box:
    """The hunter in a room."""
    y = FIRST_LINE[WINKY] + 2 * drawn.y[WINKY]
    return box(drawn.x[WINKY] - SHIFT, y, *WINKY_SIZE)


def guest_box(m: Ram, drawn: Drawn) -> Box:
    """The larger hall monster in a room, in the first slot; it alternates with sprite 3 or 4."""

    def of_host(values: jax.Array | np.ndarray) -> jax.Array:
        return jnp.where(m.guest == HOSTS[1], values[HOSTS[1]], values[HOSTS[0]])

    has_swapped = m.swapped > 0
    x = jnp.where(has_swapped, of_host(drawn.own_x), m.guest_x)
    y = jnp.where(has_swapped, of_host(drawn.own_y), m.guest_y)
    color = jnp.where(has_swapped, of_host(m.color), m.guest_color) & ~1
    there = (m.guest < NO_GUEST) & (SPRITE == 0) & (y != GONE)
    line = of_host(FIRST_LINE) + 2 * y
    return box(x - SHIFT, line, *GUEST_SIZE, there, color=color).clip(*VIEW)


def _moves(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Columns and pairs of lines that the sprites and the dot have moved since: `[7]`."""
    in_room = ~among(m.room, Room.HALLS)
    turns_round = (m.timer == LAST_TICK) & (MOVERS != DOT) & ~((MOVERS == WINKY) & in_room)
    step = when(_has_moved(m, in_room), jnp.where(turns_round, -1, 1))
    dx, dy = _way(m)
    return step * dx, step * dy


def _has_moved(m: Ram, in_room: jax.Array) -> jax.Array:
    """True for sprites that have moved since the frame was drawn, and for a moved dot."""
    all_move = m.next_turn == 0
    sprite_moved = (all_move | SECOND_HALF) & _has_turn(m) & (m.status != Status.DEAD)
    shot_flies = (MOVERS == DOT) & ~all_move & in_room
    return (sprite_moved | shot_flies) & (m.flags < PAUSED)


def _way(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The direction of the sprites and the dot: 1 is right or down, -1 left or up."""
    right = (m.status & Status.RIGHT) == 0
    left = (m.status & Status.LEFT) == 0
    down = (m.status & Status.DOWN) == 0
    up = (m.status & Status.UP) == 0
    return match((right, 1), (left, -1), otherwise=0), match((down, 1), (up, -1), otherwise=0)


def _has_turn(m: Ram) -> jax.Array:
    """True if the speeds of the sprites and the dot let them move at their last turn."""
    first, second, third = m.turns
    before = jnp.stack((first >> 1 | (first & 1) << 7, second >> 1, third >> 1))
    turns = jnp.where(m.next_turn == 0, m.turns, before)
    speed = m.status & Status.SPEED
    turn = match(
        (among(speed, FIRST_TURNS), turns[0]),
        (among(speed, SECOND_TURNS), turns[1]),
        otherwise=turns[2],
    )
    return (turn & pick(speed, SPEEDS)) != 0
