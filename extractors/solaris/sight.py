"""Solaris' objects in frames: their colours and shapes, in space, on planets and on the chart.

Most pictures have several colours, and share them with others; sizes and numbers of pixels tell
those apart.
"""

import functools

from ocjax.extractors.solaris.panel import COLORS, LEFT_CELL, RIGHT_CELL, WINDOW
from ocjax.extractors.solaris.pictures import BOTTOM, TOP
from ocjax.extractors.solaris.vision import IN_SPACE, ON_PLANET, DarkEdges
from ocjax.vision.filters import ShortRuns
from ocjax.vision.rules import Blobs, Bounds
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Raised

VIEW = (8, TOP, 160, BOTTOM)
GROUND_VIEW = (8, 82, 160, BOTTOM)  # below the hills
SHIP_ROWS = (8, 144, 160, 151)  # its colours are in them; two rows above are dark
WHITE = (0x08, 0x0E)
BLUES = (0x86, 0x88, 0x8A, 0x8C, 0x8E)
REDS = (0x40, 0x42, 0x44, 0x46, 0x48)
SHIP_COLORS = (0x92, 0x76, 0x78, 0x6A, 0x6C)
GROUND_SHIP_COLORS = (0x42, 0x34, 0x26, 0x28, 0x1A, 0x1C)
CRATER_COLORS = (0x60, 0x00)

space = functools.partial(Blobs, region=VIEW, filters=(IN_SPACE,))
ground = functools.partial(Blobs, region=VIEW, filters=(ON_PLANET,))


def _shapes(*sizes: tuple[int, int, int]) -> tuple[Shape, ...]:
    """Shapes by width, height and number of pixels."""
    return tuple(Shape(w, h, pixels) for w, h, pixels in sizes)


SHIP = Bounds(SHIP_COLORS, SHIP_ROWS, (9, 7), (11, 7), then=(Raised(2),))
GROUND_SHIP = Bounds(GROUND_SHIP_COLORS, SHIP_ROWS, (9, 7), (11, 7), then=(Raised(2),))
SHOTS = Blobs(WHITE, VIEW, Shape((1, 8), (1, 8)), gap=(3, 3))

RED_SHAPES = (
    Shape(1, 1),
    Shape(2, 2),
    Shape(3, (2, 4), pixels=(6, 12)),
    Shape(4, (2, 5)),
    Shape(5, (2, 6), pixels=(8, 12)),
    Shape(5, (2, 6), pixels=(14, 30)),
    Shape((6, 16), (1, 24)),
)
RED_PLANETS = space(REDS, shapes=RED_SHAPES)
DOTS = space(0x8A, shapes=Shape(1, 1))
BLUE_SHAPES = (
    Shape(2, 2, pixels=4),
    Shape((3, 4), (2, 5), pixels=(6, 20)),
    Shape((5, 16), (2, 24), pixels=(10, 304)),
)
BLUE_PLANETS = space(BLUES, shapes=BLUE_SHAPES, also=(DOTS,), then=(DarkEdges(),))
RINGS = space((0x66, 0x68, 0xA2), shapes=Shape((2, 16), (2, 14)), gap=(1, 1))
CRATERS = Blobs(
    CRATER_COLORS,
    GROUND_VIEW,
    Shape((6, 28), (1, 9)),
    gap=(3, 1),
    filters=(ON_PLANET, ShortRuns(30, across=True)),
)

GROUND_FIGHTERS = ground((0x1A, 0x4E, 0xAC), shapes=_shapes((8, 9, 32), (6, 6, 16), (4, 3, 6)))
FIGHTERS = space(
    (0x56, 0x58, 0x5A, 0x5C, 0x5E), shapes=Shape((1, 8), (1, 12)), also=(GROUND_FIGHTERS,)
)
GROUND_PIRATES = ground(
    (0x46, 0x48, 0x4A, 0x4C, 0x5A, 0x6A),
    shapes=(Shape(8, 10, (32, 34)), Shape(6, 8, (22, 24)), Shape(4, 5, 10)),
)
PIRATES = space(
    (0x14, 0x16, 0x18, 0x1A, 0x1E),
    shapes=Shape((1, 8), (1, 9)),
    gap=(2, 2),
    also=(GROUND_PIRATES,),
)
WARPS = space((0x46, 0x48, 0x8A, 0x8C, 0x8E), shapes=Shape(8, 8, 18), gap=(1, 1))
DARTERS = space(REDS, shapes=(Shape(2, 1), Shape(5, 5, pixels=13), Shape(3, 3, pixels=5)))
JUMPERS = space(
    (0x42, 0x44, 0x46, 0x48, 0x4C, 0x84, 0x86, 0x88, 0x8A, 0x8C, 0x8E, 0xC4, 0xC6, 0xC8, 0xCA),
    shapes=_shapes((8, 10, 54), (6, 8, 32), (5, 6, 21), (3, 3, 7)),
)
KILLER_COLORS = (0xA4, 0xA6, 0xA8, 0xAA, 0xAC, 0xAE)
KILLER_SHAPES = (Shape(2, 1), Shape((4, 16), (2, 12)))
FIVE_ROWS = space(KILLER_COLORS, shapes=Shape(6, 5, pixels=18), first=0xAA)
KILLERS = space(
    KILLER_COLORS,
    shapes=KILLER_SHAPES,
    first=(0xA4, 0xA6, 0xA8, 0xAC, 0xAE),
    also=(FIVE_ROWS,),
)
BLOCKADERS = space(
    (0x86, 0x88, 0xC6, 0xCA, 0xCC, 0xCE),
    shapes=(*_shapes((8, 9, 34), (3, 9, 17), (5, 5, 11), (3, 3, 4)), Shape(4, 7, (13, 15))),
)
RAIDER_COLORS = (0x1E, 0x46, 0x48, 0x4A, 0x4C, 0x84, 0x86, 0x88, 0x8A, 0x8C)
RAIDERS = ground(RAIDER_COLORS, shapes=_shapes((7, 8, 30), (3, 5, 12)))
MEN = ground(
    (0x18, 0x1C, 0x46, 0x48, 0x4C, 0x88, 0x8A),
    shapes=(Shape((5, 8), (6, 11), (15, 40)), Shape(3, 5, (7, 9))),
    gap=(0, 1),
)
ZONE_COLORS = (0x46, 0x48, 0x4A, 0x4C, 0x4E)
ZONES = ground(
    ZONE_COLORS,
    shapes=_shapes(
        (16, 10, 112),
        (14, 8, 82),
        (12, 7, 64),
        (10, 6, 46),
        (8, 5, 32),
        (6, 4, 20),
        (4, 3, 10),
        (3, 2, 6),
    ),
)
TOWERS = ground(
    (0x56, 0x58, 0x5A, 0x5C, 0x5E, 0x8C),
    shapes=(Shape(8, 10, (40, 41)), Shape(6, 8, (26, 28)), Shape(4, 5, 14)),
)
ENEMY_SHOTS = Blobs((0x9E, 0x7E, 0x6E), VIEW, Shape((1, 5), (1, 7)), gap=(1, 1))
FLASHES = space(0x1E, shapes=_shapes((8, 10, 61), (5, 6, 24), (3, 4, 8)))
GROUND_BLASTS = ground((0xBC, 0x1E), shapes=Shape((5, 16), (6, 16)), gap=(3, 3))
EXPLOSIONS = space(
    (0x8E, 0xAA),
    shapes=Shape((6, 28), (9, 28)),
    gap=(7, 4),
    also=(FLASHES, GROUND_BLASTS),
)

WINDOW_COLORS = tuple(sorted(set(COLORS)))
SCANNER = Bounds(WINDOW_COLORS, WINDOW, min_size=(40, 15))
TARGET = Bounds(0x0E, WINDOW)
LEFT_ARROW = (LEFT_CELL, 173, LEFT_CELL + 8, 180)
RIGHT_ARROW = (RIGHT_CELL, 173, RIGHT_CELL + 8, 180)
ARROWS = Bounds(0xB8, (LEFT_ARROW, RIGHT_ARROW))
