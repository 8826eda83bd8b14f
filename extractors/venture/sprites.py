"""Venture's sprites as they were drawn.

Sprites move after every second frame, three on one and three on the next, and the dot moves after
each one ($F4FE-$F6DF). `moves` says how far.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.ops import among, match, pick, when
from ocjax.console.rom import Pictures
from ocjax.extractors.venture.ram import ROM, Ram, Room, Status

ROWS = (5, 7, 9, 13)  # rows of pictures, two lines each
USUAL_ROWS = ROWS.index(9)
PAGE = np.append(ROM.bytes(0xE00, 256), ROM.bytes(0xF00, 16))
SPRITE_PICTURES = Pictures.of(PAGE[low : low + rows] for rows in ROWS for low in range(256))
SPEEDS = ROM.bytes(0xE48, 8).tolist()  # by the lowest bits of `status`

VIEW = (0, 24, 160, 186)
SPRITE = np.arange(6)
FIRST_LINE = np.array((26, 27, 27, 26, 27, 27))  # of each sprite
THIRDS = (7, 7, 7, 1, 1, 1, 1, 1, 7, 7)  # shift of the third sprite of a frame, by room
DOT = 6  # the dot's place after the sprites
GONE = 81  # `y` of a sprite that is not there
NO_GUEST = 128  # from here on, `guest` is no sprite
PAUSED = 128  # from here on, `flags` of a game that stands still
LAST_TICK = 1  # `timer` of a sprite that has just turned round


def swaps(m: Ram) -> jax.Array:
    """Which sprite has changed places with the larger hall monster."""
    return (m.swapped > 0) & (m.guest == SPRITE)


def _places(m: Ram, dx: jax.Array, dy: jax.Array) -> tuple[jax.Array, jax.Array]:
    """`x` and `y` of the sprites as they were drawn."""
    x = jnp.where(swaps(m), m.guest_x, m.x) - dx
    return x, jnp.where(swaps(m), m.guest_y, m.y) - dy


def sprites(m: Ram, dx: jax.Array, dy: jax.Array) -> Box:
    """The six sprites."""
    x, y = _places(m, dx, dy)
    before = jnp.where(swaps(m), m.guest_picture - dy, m.picture + dy) + y  # its first row
    size = match(*((m.height == 256 - n, i) for i, n in enumerate(ROWS)), otherwise=USUAL_ROWS)
    left, top, width, height = SPRITE_PICTURES.extent(256 * size + ((before + 1) & 255))
    line = FIRST_LINE + 2 * (jnp.where(y >= 128, y - 256, y) + top)
    shift = jnp.where(SPRITE % 3 == 2, pick(m.room, THIRDS), 1)
    spread = jnp.where((m.room == Room.WALLS) & (SPRITE % 3 > 0), 4, 1)
    there = (height > 0) & (y != GONE)
    return box(x - shift + spread * left, line, width, 2 * height, there).clip(*VIEW)


def winky(m: Ram, dx: jax.Array, dy: jax.Array) -> Box:
    x, y = _places(m, dx, dy)
    return box(x[0] - 1, 26 + 2 * y[0], 8, 12)


def guest(m: Ram, dx: jax.Array, dy: jax.Array) -> Box:
    """The larger hall monster in a room, in the first slot; it takes turns with sprite 3 or 4."""

    def of_host(sides: jax.Array | np.ndarray) -> jax.Array:
        return jnp.where(m.guest == 4, sides[4], sides[3])

    swapped = m.swapped > 0
    x = jnp.where(swapped, of_host(m.x - dx), m.guest_x)
    y = jnp.where(swapped, of_host(m.y - dy), m.guest_y)
    color = jnp.where(swapped, of_host(m.color), m.guest_color) & ~1
    there = (m.guest < NO_GUEST) & (SPRITE == 0) & (y != GONE)
    return box(x - 1, of_host(FIRST_LINE) + 2 * y, 8, 16, there, color=color).clip(*VIEW)


def moves(m: Ram) -> tuple[jax.Array, jax.Array]:
    """How far the sprites and the dot have moved since they were drawn: `[7]`."""
    mover, all_move = np.arange(7), m.next_turn == 0
    in_room = ~among(m.room, Room.HALLS)
    since = all_move | ((mover >= 3) & (mover != DOT))
    moved = since & _has_turn(m) & (m.status != Status.DEAD)
    shot = (mover == DOT) & ~all_move & in_room
    moved = (moved | shot) & (m.flags < PAUSED)
    turns_round = (m.timer == LAST_TICK) & (mover != DOT) & ~((mover == 0) & in_room)
    step = when(moved, jnp.where(turns_round, -1, 1))
    dx, dy = _way(m)
    return step * dx, step * dy


def _way(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The way that the sprites and the dot go: 1 is right or down, -1 left or up."""
    right, left, down, up = (
        (m.status & bit) == 0 for bit in (Status.RIGHT, Status.LEFT, Status.DOWN, Status.UP)
    )
    return match((right, 1), (left, -1), otherwise=0), match((down, 1), (up, -1), otherwise=0)


def _has_turn(m: Ram) -> jax.Array:
    """Whether the sprites' and the dot's speeds let them move at their last turn."""
    first, second, third = m.turns
    before = jnp.stack((first >> 1 | (first & 1) << 7, second >> 1, third >> 1))
    turns = jnp.where(m.next_turn == 0, m.turns, before)
    speed = m.status & Status.SPEED
    turn = match(
        (among(speed, (0, 2, 4)), turns[0]),
        (among(speed, (1, 5)), turns[1]),
        otherwise=turns[2],
    )
    return (turn & pick(speed, SPEEDS)) != 0
