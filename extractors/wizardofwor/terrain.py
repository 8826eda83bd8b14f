"""The walls of the dungeon, its tunnels and the boxes of waiting worriors.

The drawing loop ($FA4F-$FAC5) shows eleven lines of the playfield from tables in the ROM: the walls
beside a row of cells, the walls below it, and so on. The code around it draws the rest.
"""

import itertools

import jax
import numpy as np
from ocjax.authoring import WIDTH, TerrainKind, TerrainMap, area_mask, playfield, when
from ocjax.extractors.wizardofwor.drawn import DOORS_OPEN, as_drawn
from ocjax.extractors.wizardofwor.ram import ROM, Ram
from ocjax.extractors.wizardofwor.walls import (
    CELL_HEIGHT,
    CELL_WIDTH,
    DOOR_TOP,
    DOOR_X,
    FLOOR,
    LEFT,
    POST,
    ROWS,
    TOP,
)

HEIGHT = 210
ACROSS = CELL_WIDTH + POST  # columns from one cell to the next
DOWN = CELL_HEIGHT + POST
BOXES = FLOOR + POST  # top of the boxes
BOX_BOTTOM = BOXES + CELL_HEIGHT
BOTTOM = BOX_BOTTOM + POST

LINE_COUNT = 2 * ROWS - 1  # lines in a table; the first line is the last byte
# The lines alternate: the sides of cells, and the walls between cells. The lowest one is higher.
LINE_HEIGHTS = (*(CELL_HEIGHT, POST) * (ROWS - 1), CELL_HEIGHT + 1)
OUTSIDES = (0xF9A, 0xF8F)  # tables for PF0: with shut doors, with open ones
MAZES = ROM.bytes(0xFD1, 4).reshape(2, 2) + 0xF00  # tables for PF1 and for PF2 of both mazes
EDGE = 0x80  # PF0 of the outer walls
SOLID = 0xFF  # PF1 and PF2 of a wall from side to side
BOX_SIDE = 0x20  # PF1
BOX_FLOOR = 0xE0

WALL_PIXEL = (22, 14)  # line and column of a pixel that always shows a wall
FREE_PIXEL = (22, 4)  # and of one that never does


def _wall(pf0: int, pf1: int, pf2: int, count: int) -> np.ndarray:
    """Equal lines, bool `[count, 160]`."""
    return np.tile(playfield(pf0, pf1, pf2, mirrored=True), (count, 1))


def _table(at: int) -> np.ndarray:
    """A table of the drawing loop, from the top line on."""
    return ROM.data[at : at + LINE_COUNT][::-1]


def _dungeon(maze: int, outside: int) -> np.ndarray:
    """All walls and closed doors, bool `[210, 160]`."""
    pf1, pf2 = MAZES[:, maze]
    lines = playfield(_table(outside), _table(pf1), _table(pf2), mirrored=True)
    parts = [
        _wall(0, 0, 0, TOP - POST),
        _wall(EDGE, SOLID, SOLID, POST),
        lines.repeat(LINE_HEIGHTS, axis=0),
        _wall(EDGE, SOLID, SOLID, POST),
        _wall(EDGE, BOX_SIDE, 0, CELL_HEIGHT),
        _wall(EDGE, BOX_FLOOR, 0, POST),
        _wall(0, 0, 0, HEIGHT - BOTTOM),
    ]
    return np.concatenate(parts)


def _places() -> dict[str, np.ndarray]:
    """The pixels of the dungeon at which each kind may be, bool `[210, 160]`."""
    number = np.arange(HEIGHT)
    upper = number - (number >= FLOOR - 1)  # the lowest cells are a line higher
    beside = ((upper - TOP) % DOWN < CELL_HEIGHT)[:, None]
    column = np.arange(WIDTH)
    over = ((column - LEFT) % ACROSS < CELL_WIDTH)[None, :]
    door = np.logical_or.reduce(
        [area_mask((x, DOOR_TOP, x + POST, DOOR_TOP + CELL_HEIGHT)) for x in DOOR_X]
    )
    return {
        "horizontal_wall": ~beside & over,
        "vertical_wall": beside & ~over & ~door,
        "post": ~beside & ~over,
        "door": door,
    }


KIND_PLACES = _places()
LAYOUTS = np.stack(
    [
        [_dungeon(maze, outside) & place for place in KIND_PLACES.values()]
        for maze, outside in itertools.product(range(MAZES.shape[1]), OUTSIDES)
    ]
)


def layout(m: Ram) -> jax.Array:
    """The level's maze, with shut or open doors."""
    drawn = as_drawn(m)
    return (drawn.level & 1) * len(OUTSIDES) + when(drawn.frame >= DOORS_OPEN, 1)


def seen(frame: jax.Array) -> dict[str, jax.Array]:
    """The pixels in the colour of the outer wall, by their place."""
    color = frame[WALL_PIXEL]
    walls = (frame == color) & (color != frame[FREE_PIXEL])
    return {name: walls & place for name, place in KIND_PLACES.items()}


TERRAIN = TerrainMap(
    kinds=(
        TerrainKind(
            "horizontal_wall",
            "walls above and below cells",
            effect="blocks",
            category="HorizontalWall",
        ),
        TerrainKind(
            "vertical_wall", "walls beside cells", effect="blocks", category="VerticalWall"
        ),
        TerrainKind("post", "the corners of cells, at the walls' ends", effect="blocks"),
        TerrainKind("door", "to the tunnels, while shut", effect="blocks", category="Door"),
    ),
    layouts=LAYOUTS,
    layout=layout,
    seen=seen,
)
