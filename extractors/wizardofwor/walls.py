"""The walls of Wizard of Wor: sides of cells, from the exits of cells in the ROM."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from ocjax.extractors.wizardofwor.ram import ROM, Way

WAYS_OUT = (0xDBE, 0xDDF)  # the exits of all cells of each maze, four bits per cell, row by row
ROWS = 6
COLUMNS = 11
CELL_WIDTH = 8
CELL_HEIGHT = 16
POST = 4  # columns and rows between two cells
LEFT = 16  # of the first cell
TOP = 24
FLOOR = 141  # top of the lowest walls
TUNNEL_ROW = 2
DOOR_X = (12, 144)
DOOR_TOP = 64
DUNGEON = (LEFT - POST, TOP - POST, LEFT + COLUMNS * (CELL_WIDTH + POST), FLOOR + POST)
# Left and top of fixed walls: of the tunnels, and of the boxes of waiting worriors.
OUTER_HORIZONTAL = ((4, 60), (148, 60), (4, 80), (148, 80), (16, 161), (136, 161))
OUTER_VERTICAL = ((12, 145), (24, 145), (132, 145), (144, 145))


class Walls(NamedTuple):
    """Walls of one direction."""

    x: tuple[int, ...]
    y: tuple[int, ...]
    mazes: np.ndarray  # True for the walls of each maze, bool `[maze, wall]`


def _exits(maze: int) -> np.ndarray:
    """The exits of a maze's cells, int32 `[row, column]`."""
    pairs = ROM.bytes(WAYS_OUT[maze], ROWS * COLUMNS // 2)
    return np.stack([pairs >> 4, pairs & 15], axis=-1).reshape(ROWS, COLUMNS)


def _closed_above(maze: int) -> np.ndarray:
    """True for a wall above each cell; the last entries are below the maze."""
    inner = (_exits(maze)[1:] & Way.UP) == 0
    return np.pad(inner, ((1, 1), (0, 0)), constant_values=True)


def _closed_left(maze: int) -> np.ndarray:
    """True for a wall (not a door) left of each cell; the last entries are right of the maze."""
    inner = (_exits(maze)[:, 1:] & Way.LEFT) == 0
    in_tunnel_row = np.arange(ROWS)[:, None] == TUNNEL_ROW
    is_door = in_tunnel_row & np.isin(np.arange(COLUMNS + 1), (0, COLUMNS))
    return np.pad(inner, ((0, 0), (1, 1)), constant_values=True) & ~is_door


def _placed(
    lefts: Iterable[int],
    tops: Iterable[int],
    closed: list[np.ndarray],
    outer: tuple[tuple[int, int], ...],
) -> Walls:
    """All walls that are closed in a maze, row by row, then the fixed ones."""
    mazes = np.stack(closed).reshape(len(closed), -1)
    used = mazes.any(axis=0)
    places = np.array([(x, y) for y in tops for x in lefts])[used].tolist()
    x, y = zip(*places, *outer, strict=True)
    stay = np.ones((len(closed), len(outer)), bool)
    return Walls(x, y, np.concatenate([mazes[:, used], stay], axis=1))


_ROW_TOPS = [TOP + (CELL_HEIGHT + POST) * row for row in range(ROWS)]
_COLUMN_LEFTS = [LEFT + (CELL_WIDTH + POST) * column for column in range(COLUMNS + 1)]
HORIZONTAL = _placed(
    _COLUMN_LEFTS[:COLUMNS],
    [*(top - POST for top in _ROW_TOPS), FLOOR],
    [_closed_above(maze) for maze in range(len(WAYS_OUT))],
    OUTER_HORIZONTAL,
)
VERTICAL = _placed(
    [left - POST for left in _COLUMN_LEFTS],
    _ROW_TOPS,
    [_closed_left(maze) for maze in range(len(WAYS_OUT))],
    OUTER_VERTICAL,
)
