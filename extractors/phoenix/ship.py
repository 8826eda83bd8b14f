"""Phoenix' pictures, the blocks of the mother ship, and the beam when it switches shots.

The display program spends 18 lines on each row of birds or bats. It switches shots every two lines.
The column of a switch depends on the other work of that loop iteration; the columns below are
counted in its cycles.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Pictures, match, when
from ocjax.extractors.phoenix.ram import ROM


def _in_page(page: int, table: int, count: int, height: int) -> Pictures:
    """Pictures with the low bytes of their addresses in a table."""
    return ROM.pictures([page + int(low) for low in ROM.bytes(table, count)], height)


BIRD_PICTURES = _in_page(0xD00, 0xBDB, 4, 10)
BAT_PICTURES = _in_page(0xF00, 0xBE6, 8, 12)
BOSSES = _in_page(0xD00, 0xBD3, 4, 16)
UPRIGHT = int(ROM.bytes(0xBF2, 1)[0])  # low byte of the address of the player's wide picture
NARROW = int(ROM.bytes(0xBF3, 1)[0])

START_Y = 0x88  # `ship_y` of a new ship; the lines of the blocks below refer to it
DOMES_BOTTOM = 78
BELT_LINES = (78, 80)
WIDE_LINES = (82, 85)  # rows of 24 blocks
MIDDLE_LINES = (88, 91, 94)  # rows of 16 blocks
NARROW_LINES = (97, 100)  # rows of 8 blocks
OUTER = {7: 32, 6: 36, 5: 40, 4: 44, 0: 112, 1: 116, 2: 120, 3: 124}  # column of each bit
LEFT = {bit: 48 + 4 * bit for bit in range(8)}
RIGHT = {bit: 108 - 4 * bit for bit in range(8)}
INNER = {4: 64, 5: 68, 6: 72, 7: 76, 3: 80, 2: 84, 1: 88, 0: 92}
LAYOUT = (
    *((part, y) for y in (*BELT_LINES, *WIDE_LINES) for part in (OUTER, LEFT, RIGHT)),
    *((part, y) for y in MIDDLE_LINES for part in (LEFT, RIGHT)),
    *((INNER, y) for y in NARROW_LINES),
)  # columns of the bits, and line, of each byte
WHOLE = ROM.bytes(0x1EF4, 20)  # blocks of a new ship
# Byte, bit, column and line of each block.
BLOCKS = np.array(
    [
        (i, bit, x, y)
        for i, (part, y) in enumerate(LAYOUT)
        for bit, x in part.items()
        if WHOLE[i] >> bit & 1
    ]
)
BELT = BLOCKS[BLOCKS[:, 3] < WIDE_LINES[0]]
HULL = BLOCKS[BLOCKS[:, 3] >= WIDE_LINES[0]]
BELT_ROWS = 2  # lines of a block
HULL_ROWS = 3

NO_ROW = 255
ROW_LINES = 18  # lines that the program spends on a row of birds or bats
ZONE = 0x20  # below this row the program draws the player
LINE_PLUS_ROW = 195  # minus the row of a change: the first line that shows it

# Columns of the beam when a change becomes visible: at the first row of birds, at the first row of
# bats, at the second row, at other rows, at the first row below them, elsewhere.
SHOT_BEAM = (73, 55, 34, 50, 0, 7)
ON_BEAM = (70, 43, 22, 22, 0, 0)
OFF_BEAM = (34, 22, 1, 1, 58, 73)
EARLIER = 15  # columns that the beam is ahead if no row ends above
ZONE_BEAM = 28
SHIP_BEAM = 58


class Sky(NamedTuple):
    """The objects that keep the display program busy."""

    rows: jax.Array  # first rows of birds or bats, `[7]`
    birds: jax.Array  # whether the rows hold birds
    ship: jax.Array  # whether the mother ship is there


def place(sky: Sky, y: jax.Array) -> jax.Array:
    """Rows from the first row of the birds or bats above down to `y`."""
    below = (sky.rows[i] - y for i in range(7))
    return functools.reduce(jnp.minimum, (jnp.where(b >= 0, b, NO_ROW) for b in below))


def line_of(sky: Sky, y: jax.Array, x: jax.Array, beams: tuple[int, ...]) -> jax.Array:
    """The first line that shows, at column x, a change of the display program at row y."""
    birds, bats, second, others, after, elsewhere = beams
    offset = place(sky, y)
    follows = functools.reduce(jnp.logical_or, (sky.rows[i] - y == ROW_LINES for i in range(7)))
    beam = match(
        (y < ZONE, ZONE_BEAM),
        (offset == 0, jnp.where(sky.birds, birds, bats) + jnp.where(follows, 0, EARLIER)),
        (offset == 2, second),
        (offset < ROW_LINES, others),
        (offset == ROW_LINES, after),
        (sky.ship, SHIP_BEAM),
        otherwise=elsewhere,
    )
    return LINE_PLUS_ROW - y + when(x < beam, 1)
