"""Adventure's rooms: their walls and colours, as the ROM has them.

A room is seven rows of walls. A row has 20 cells of four columns, which the right half repeats,
mostly from right to left. All is drawn from line 28 on, the first row 16 lines high and others 32.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import lookup
from ocjax.extractors.adventure.ram import ROM

ROOMS = 31
ROOM_TABLE = ROM.bytes(0xE1B, 9 * ROOMS).reshape(ROOMS, 9)
COLORS = ROOM_TABLE[:, 2] & ~1
CONTROLS = ROOM_TABLE[:, 4]  # of each room: bits
MIRRORED = 1
IN_FRONT = 4  # walls are in front of things: they have the dark background's colour
THIN_RIGHT = 64  # a wall of two columns from top to bottom, which is a missile
THIN_LEFT = 128
ADDRESSES = ROOM_TABLE[:, 0] | ROOM_TABLE[:, 1] << 8  # of the rooms' pictures

VIEW_BOTTOM = 220
VIEW = (0, 28, 160, VIEW_BOTTOM)
ROW_COUNT = 7
CELL_COUNT = 40
CELL_WIDTH = 4  # columns
ROW_HEIGHT = 32  # lines
BEFORE_ROWS = 12  # lines before the first row, if that were as high as others


def _wall_cells(room: int) -> np.ndarray:
    """Which cells of a room are walls: bool `[7, 40]`."""
    rows = ROM.bytes(ADDRESSES[room] & 0xFFF, 3 * ROW_COUNT).reshape(ROW_COUNT, 3)
    # the three registers of a row differ in order
    first = (rows[:, :1] >> np.arange(4, 8)) & 1
    second = (rows[:, 1:2] >> np.arange(7, -1, -1)) & 1
    third = (rows[:, 2:] >> np.arange(8)) & 1
    half = np.concatenate((first, second, third), axis=1)
    other = half[:, ::-1] if CONTROLS[room] & MIRRORED else half
    return np.concatenate((half, other), axis=1) == 1


WALLS = np.stack([_wall_cells(room) for room in range(ROOMS)])


def _from_cells(cells: np.ndarray) -> np.ndarray:
    """The walls that begin at each cell and go on for two more, one bit a column: `[..., 40]`."""
    wide = np.repeat(cells, CELL_WIDTH, axis=-1)
    column = np.arange(wide.shape[-1])
    at_left = (CONTROLS & THIN_LEFT > 0)[:, None, None] & np.isin(column, (11, 12))
    at_right = (CONTROLS & THIN_RIGHT > 0)[:, None, None] & np.isin(column, (148, 149))
    columns = wide | at_left | at_right
    padded = np.concatenate((columns, columns[..., : 3 * CELL_WIDTH]), axis=-1)
    starts = CELL_WIDTH * np.arange(CELL_COUNT)[:, None] + np.arange(3 * CELL_WIDTH)
    return (padded[..., starts] << np.arange(3 * CELL_WIDTH)[::-1]).sum(axis=-1)


WALL_SPANS = _from_cells(WALLS).ravel()


def row_of(line: jax.Array) -> jax.Array:
    """The row of walls that a line of the screen is in."""
    return jnp.clip((line - BEFORE_ROWS) >> 5, 0, ROW_COUNT - 1)


def walls_at(room: jax.Array, row: jax.Array, x: jax.Array) -> jax.Array:
    """The walls in a row, from a column on: eight bits, the first column the highest one."""
    cell = jnp.clip(x >> 2, 0, CELL_COUNT - 1)
    span = lookup(WALL_SPANS, (jnp.minimum(room, ROOMS - 1) * ROW_COUNT + row) * CELL_COUNT + cell)
    return span >> (CELL_WIDTH - (x & 3)) & 255


def hides_things(room: jax.Array) -> jax.Array:
    """Whether a room is dark, its walls unseen and before all things."""
    return lookup(CONTROLS & IN_FRONT, room) > 0
