"""Adventure's rooms: their walls and colours in the ROM.

A room is seven rows of walls. A row has 20 cells of four columns, which the right half repeats,
mostly from right to left. Rows start at line 28; the first row is 16 lines high, the others 32.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import div, lookup
from ocjax.extractors.adventure.ram import ROM

ROOMS = 31
ROOM_TABLE = ROM.bytes(0xE1B, 9 * ROOMS).reshape(ROOMS, 9)
COLORS = ROOM_TABLE[:, 2] & ~1
CONTROLS = ROOM_TABLE[:, 4]  # bits of each room
MIRRORED = 1
IN_FRONT = 4  # walls in the dark background's colour are in front of things
THIN_RIGHT = 64  # a missile that forms a wall of two columns from top to bottom
THIN_LEFT = 128
THIN_LEFT_X = 11
THIN_RIGHT_X = 148
THIN_WIDTH = 2
ADDRESSES = ROOM_TABLE[:, 0] | ROOM_TABLE[:, 1] << 8  # of the rooms' pictures

VIEW_BOTTOM = 220
VIEW = (0, 28, 160, VIEW_BOTTOM)
ROW_COUNT = 7
CELL_COUNT = 40
CELL_WIDTH = 4  # columns
ROW_HEIGHT = 32  # lines
BEFORE_ROWS = 12  # lines before the first row, if it had the height of the others


def _wall_cells(room: int) -> np.ndarray:
    """The wall cells of a room: bool `[7, 40]`."""
    rows = ROM.bytes(ADDRESSES[room] & 0xFFF, 3 * ROW_COUNT).reshape(ROW_COUNT, 3)
    # The three registers of a row differ in bit order.
    first = (rows[:, :1] >> np.arange(4, 8)) & 1
    second = (rows[:, 1:2] >> np.arange(7, -1, -1)) & 1
    third = (rows[:, 2:] >> np.arange(8)) & 1
    half = np.concatenate((first, second, third), axis=1)
    other = half[:, ::-1] if CONTROLS[room] & MIRRORED else half
    return np.concatenate((half, other), axis=1) == 1


WALLS = np.stack([_wall_cells(room) for room in range(ROOMS)])


def _is_thin(column: np.ndarray, left: int) -> np.ndarray:
    """The columns of a thin wall."""
    return (column >= left) & (column < left + THIN_WIDTH)


def _from_cells(cells: np.ndarray) -> np.ndarray:
    """The walls in each cell and the next two, one bit per column: `[..., 40]`."""
    wide = np.repeat(cells, CELL_WIDTH, axis=-1)
    column = np.arange(wide.shape[-1])
    at_left = (CONTROLS & THIN_LEFT > 0)[:, None, None] & _is_thin(column, THIN_LEFT_X)
    at_right = (CONTROLS & THIN_RIGHT > 0)[:, None, None] & _is_thin(column, THIN_RIGHT_X)
    columns = wide | at_left | at_right
    padded = np.concatenate((columns, columns[..., : 3 * CELL_WIDTH]), axis=-1)
    starts = CELL_WIDTH * np.arange(CELL_COUNT)[:, None] + np.arange(3 * CELL_WIDTH)
    return (padded[..., starts] << np.arange(3 * CELL_WIDTH)[::-1]).sum(axis=-1)


WALL_SPANS = _from_cells(WALLS).ravel()


def row_of(line: jax.Array) -> jax.Array:
    """The row of walls at a line of the screen."""
    return jnp.clip(div(line - BEFORE_ROWS, ROW_HEIGHT), 0, ROW_COUNT - 1)


def walls_at(room: jax.Array, row: jax.Array, x: jax.Array) -> jax.Array:
    """The walls in a row from column `x`: eight bits, the first column in the highest bit."""
    cell = jnp.clip(div(x, CELL_WIDTH), 0, CELL_COUNT - 1)
    span = lookup(WALL_SPANS, (jnp.minimum(room, ROOMS - 1) * ROW_COUNT + row) * CELL_COUNT + cell)
    return span >> (CELL_WIDTH - (x & CELL_WIDTH - 1)) & 255


def hides_things(room: jax.Array) -> jax.Array:
    """True for dark rooms: their walls are invisible and before all things."""
    return lookup(CONTROLS & IN_FRONT, room) > 0
