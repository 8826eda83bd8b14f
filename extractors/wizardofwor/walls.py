"""The walls of Wizard of Wor: the sides of cells, from the ways out of cells in the ROM."""

import numpy as np
from ocjax.extractors.wizardofwor.ram import ROM, Way

EXITS = (0xDBE, 0xDDF)  # the ways out of all cells of each maze, four bits a cell, row by row
ROWS = 6
COLUMNS = 11
CELL_WIDTH = 12  # columns from a cell to the next
CELL_HEIGHT = 20
LEFT = 16  # of the first cell
TOP = 24
POST = 4  # columns and rows between two cells
BOTTOM = 141  # of the last row of cells
TUNNEL_ROW = 2
DUNGEON = (LEFT - POST, TOP - POST, LEFT + COLUMNS * CELL_WIDTH, BOTTOM + POST)  # with its walls
# fmt: off
OUTSIDE = (  # walls of the tunnels, then of the boxes in which worriors wait; left top width height
    (4, 60, 8, 4), (148, 60, 8, 4), (4, 80, 8, 4), (148, 80, 8, 4),
    (12, 145, 4, 16), (24, 145, 4, 16), (132, 145, 4, 16), (144, 145, 4, 16),
    (16, 161, 8, 4), (136, 161, 8, 4),
)
# fmt: on


def _exits(maze: int) -> np.ndarray:
    """The ways out of a maze's cells, int32 `[row, column]`."""
    pairs = ROM.bytes(EXITS[maze], ROWS * COLUMNS // 2)
    return np.stack([pairs >> 4, pairs & 15], axis=-1).reshape(ROWS, COLUMNS)


def _across(maze: int) -> np.ndarray:
    """Whether there is a wall above each cell, and below those of the last row."""
    closed = np.ones((ROWS + 1, COLUMNS), bool)
    closed[1:ROWS] = (_exits(maze)[1:] & Way.UP) == 0
    return closed


def _upright(maze: int) -> np.ndarray:
    """Whether there is a wall left of each cell, and right of the last column; doors are none."""
    closed = np.ones((ROWS, COLUMNS + 1), bool)
    closed[:, 1:COLUMNS] = (_exits(maze)[:, 1:] & Way.LEFT) == 0
    closed[TUNNEL_ROW, (0, COLUMNS)] = False
    return closed


def _places_across() -> list[tuple[int, int, int, int]]:
    """Left, top, width and height of all places for walls that run across."""
    tops = [*(TOP - POST + CELL_HEIGHT * row for row in range(ROWS)), BOTTOM]
    lefts = range(LEFT, LEFT + CELL_WIDTH * COLUMNS, CELL_WIDTH)
    return [(left, top, CELL_WIDTH - POST, POST) for top in tops for left in lefts]


def _places_upright() -> list[tuple[int, int, int, int]]:
    """Those of upright walls; the last row has one row of the screen more."""
    ends = [*(TOP + CELL_HEIGHT * row + CELL_HEIGHT - POST for row in range(ROWS - 1)), BOTTOM]
    lefts = range(LEFT - POST, LEFT + CELL_WIDTH * COLUMNS, CELL_WIDTH)
    tops = range(TOP, BOTTOM, CELL_HEIGHT)
    return [
        (left, top, POST, end - top) for top, end in zip(tops, ends, strict=True) for left in lefts
    ]


def _in_mazes() -> np.ndarray:
    """Which of all places have a wall in each maze, bool `[maze, place]`."""
    inside = [np.concatenate([_across(k).ravel(), _upright(k).ravel()]) for k in range(len(EXITS))]
    return np.pad(np.stack(inside), ((0, 0), (0, len(OUTSIDE))), constant_values=True)


_USED = _in_mazes().any(axis=0)
WALLED = _in_mazes()[:, _USED]
"""Which walls are in each maze, bool `[maze, wall]`."""
PLACES = np.array([*_places_across(), *_places_upright(), *OUTSIDE])[_USED]
"""Left, top, width and height of the walls, int `[wall, 4]`."""
