"""The walls of the dungeon, its tunnels and the boxes of waiting worriors.

The drawing loop ($FA4F-$FAC5) shows eleven lines of the playfield from tables in the ROM: the walls
beside a row of cells, the walls below it, and so on. The code around it draws the rest.
"""

import itertools

import jax
import numpy as np
from ocjax.authoring import WIDTH, TerrainKind, TerrainMap, playfield, when
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

LINES = 2 * ROWS - 1  # lines in a table; the first line is the last byte
OUTSIDE = (0xF9A, 0xF8F)  # tables for PF0: with shut doors, with open ones
MAZES = ROM.bytes(0xFD1, 4).reshape(2, 2) + 0xF00  # tables for PF1 and for PF2 of both mazes
EDGE = 0x80  # PF0 of the outer walls
SOLID = 0xFF  # PF1 and PF2 of a wall from side to side
BOX_SIDE = 0x20  # PF1
BOX_FLOOR = 0xE0

WALL_PIXEL = (22, 14)  # line and column of a pixel that always shows a wall
FREE_PIXEL = (22, 4)  # and of one that never does


def _bits(*pf: int) -> np.ndarray:
    """A line of the playfield, bool `[160]`."""
    return playfield(*map(np.array, pf), mirrored=True)


def _walls(maze: int, outside: int) -> np.ndarray:
    """All walls and closed doors, bool `[210, 160]`."""
    tables = outside, *MAZES[:, maze]
    lines = playfield(*(ROM.data[at : at + LINES][::-1] for at in tables), mirrored=True)
    walls = np.zeros((HEIGHT, WIDTH), bool)
    walls[TOP - POST : TOP] = _bits(EDGE, SOLID, SOLID)
    for number, line in enumerate(lines):
        top = TOP + number // 2 * DOWN + number % 2 * CELL_HEIGHT
        walls[top:FLOOR] = line  # up to the next line
    walls[FLOOR:BOXES] = _bits(EDGE, SOLID, SOLID)
    walls[BOXES:BOX_BOTTOM] = _bits(EDGE, BOX_SIDE, 0)
    walls[BOX_BOTTOM : BOX_BOTTOM + POST] = _bits(EDGE, BOX_FLOOR, 0)
    return walls


def _places() -> dict[str, np.ndarray]:
    """The pixels of the dungeon at which each kind may be, bool `[210, 160]`."""
    line, column = np.arange(HEIGHT)[:, None], np.arange(WIDTH)[None, :]
    upper = line - (line >= TOP + ROWS * DOWN - POST)  # the lowest cells are a line higher
    beside = (upper - TOP) % DOWN < CELL_HEIGHT
    over = (column - LEFT) % ACROSS < CELL_WIDTH
    at_door = (line >= DOOR_TOP) & (line < DOOR_TOP + CELL_HEIGHT)
    door = beside & at_door & np.isin(column // POST * POST, DOOR_X)
    return {
        "horizontal_wall": ~beside & over,
        "vertical_wall": beside & ~over & ~door,
        "post": ~beside & ~over,
        "door": door,
    }


PLACES = _places()
LAYOUTS = np.stack(
    [
        [_walls(maze, outside) & place for place in PLACES.values()]
        for maze, outside in itertools.product(range(len(MAZES)), OUTSIDE)
    ]
)


def layout(m: Ram) -> jax.Array:
    """The level's maze, with shut or open doors."""
    drawn = as_drawn(m)
    return (drawn.level & 1) * len(OUTSIDE) + when(drawn.frame >= DOORS_OPEN, 1)


def seen(frame: jax.Array) -> dict[str, jax.Array]:
    """The pixels in the colour of the outer wall, by their place."""
    color = frame[WALL_PIXEL]
    walls = (frame == color) & (color != frame[FREE_PIXEL])
    return {name: walls & place for name, place in PLACES.items()}


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
