"""Venture's RAM, and the sprites as they were drawn.

Sprites move after every second frame, three on one and three on the next, and the dot moves after
each one ($F4FE-$F6DF). `moves` says how far.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.ops import among, match, pick, when
from ocjax.console.ram import RamMap, bcd, byte
from ocjax.console.rom import Pictures, Rom

ROM = Rom("venture", "3e899eba0ca8cd2972da1ae5479b4f0d")
ROWS = (5, 7, 9, 13)  # rows of pictures, two lines each
USUAL_ROWS = ROWS.index(9)
PAGE = np.append(ROM.bytes(0xE00, 256), ROM.bytes(0xF00, 16))
PICTURES = Pictures.of(PAGE[low : low + rows] for rows in ROWS for low in range(256))
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


class Room:  # of `Ram.room`
    WALLS = 3
    SECOND_HALL = 9
    HALLS = (8, SECOND_HALL)
    BEYOND_SECOND_HALL = range(4, 8)


class Status:  # bits of `Ram.status`; a direction's is 0 where the sprite goes there
    SPEED = 7
    UP = 16
    DOWN = 32
    LEFT = 64
    RIGHT = 128
    DEAD = 242  # the whole byte


class Ram(RamMap):
    picture = byte(0, 2, 4, 6, 8, 10)  # low byte of its address, less the row
    guest_picture = byte(14)
    door = byte(16)  # of the hall, that he used last: a bit
    taken = byte(18)  # 255: the treasure
    y = byte(20, 21, 22, 23, 24, 25)  # in two lines
    dot_y = byte(26)
    guest_y = byte(27)
    status = byte(28, 29, 30, 31, 32, 33, 34)  # the last one of the dot
    color = byte(36, 37, 38, 39, 40, 41)
    height = byte(42, 43, 44, 45, 46, 47)  # 256 less the rows
    guest_color = byte(48)
    timer = byte(50, 51, 52, 53, 54, 55, 56)
    turns = byte(58, 59, 60)  # bits go round: who moves
    next_turn = byte(61)  # first sprite of the next frame
    flags = byte(63)
    icons = byte(70)  # lives left
    score = bcd((71, 72))  # hundreds
    pause = byte(76)  # frames until a scene begins
    x = byte(79, 80, 81, 82, 83, 84)
    dot_x = byte(85)  # x + 1
    guest_x = byte(86)
    guest = byte(89)  # the sprite that the larger hall monster has a turn with
    room = byte(90)
    swapped = byte(91)
    split = byte(105)  # row from which the third sprite of the frame is drawn


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
    left, top, width, rows = PICTURES.extent(256 * size + ((before + 1) & 255))
    line = FIRST_LINE + 2 * (jnp.where(y >= 128, y - 256, y) + top)
    shift = jnp.where(SPRITE % 3 == 2, pick(m.room, THIRDS), 1)
    spread = jnp.where((m.room == Room.WALLS) & (SPRITE % 3 > 0), 4, 1)
    there = (rows > 0) & (y != GONE)
    return box(x - shift + spread * left, line, width, 2 * rows, there).clip(*VIEW)


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
    right, left, down, up = (
        (m.status & way) == 0 for way in (Status.RIGHT, Status.LEFT, Status.DOWN, Status.UP)
    )
    dx = match((right, 1), (left, -1), otherwise=0)
    return step * dx, step * match((down, 1), (up, -1), otherwise=0)


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
    return (turn & pick(speed, SPEEDS)) > 0
