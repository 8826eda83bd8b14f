"""Solaris' objects in frames: their colours and shapes, in space, on planets and on the chart.

Most pictures have several colours, and share them with others; sizes and numbers of pixels tell
those apart.
"""

from typing import Any

from ocjax.extractors.solaris.panel import COLORS, LEFT_CELL, RIGHT_CELL, WINDOW
from ocjax.extractors.solaris.pictures import BOTTOM, GROUND_TOP, TOP
from ocjax.extractors.solaris.vision import DarkEdges, Look, Looks, in_space, no_lines, on_planet
from ocjax.vision.rules import Blobs, Bounds
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Raised

VIEW = (8, TOP, 160, BOTTOM)
GROUND_VIEW = (8, GROUND_TOP, 160, BOTTOM)
SHIP_ROWS = (8, 144, 160, 151)  # its colours are in them; two rows above are dark
SHIP_COLORS = (0x92, 0x76, 0x78, 0x6A, 0x6C)
GROUND_SHIP_COLORS = (0x42, 0x34, 0x26, 0x28, 0x1A, 0x1C)

# A look is what one search finds: one kind in space and, in other colours, one on planets. They are
# never on one frame, and have one search if their parts are joined alike (`gap`). Where the kind on
# planets is not the one that the look is named for, a comment names it.
SHOT = Look(all=(0x0E, 0x08))
ENEMY_SHOT = Look(all=(0x9E, 0x7E, 0x6E))
FIGHTER = Look(space=(0x56, 0x58, 0x5A, 0x5C, 0x5E), planet=(0x1A, 0x4E, 0xAC))
PIRATE = Look(space=(0x14, 0x16, 0x18, 0x1A, 0x1E))
WARP = Look(space=(0x46, 0x48, 0x8A, 0x8C, 0x8E))
DARTER = Look(
    space=(0x40, 0x42, 0x44, 0x46, 0x48),
    planet=(0x1E, 0x46, 0x48, 0x4A, 0x4C, 0x84, 0x86, 0x88, 0x8A, 0x8C),  # raiders
)
JUMPER = Look(
    space=(
        *(0x42, 0x44, 0x46, 0x48, 0x4C),
        *(0x84, 0x86, 0x88, 0x8A, 0x8C, 0x8E),
        *(0xC4, 0xC6, 0xC8, 0xCA),
    ),
    planet=(0x46, 0x48, 0x4A, 0x4C, 0x5A, 0x6A),  # pirates
)
MAN = Look(planet=(0x18, 0x1C, 0x46, 0x48, 0x4C, 0x88, 0x8A))
KILLER = Look(
    space=(0xA4, 0xA6, 0xA8, 0xAA, 0xAC, 0xAE),
    planet=(0x46, 0x48, 0x4A, 0x4C, 0x4E),  # landing zones
)
BLOCKADER = Look(
    space=(0x86, 0x88, 0xC6, 0xCA, 0xCC, 0xCE),
    planet=(0x56, 0x58, 0x5A, 0x5C, 0x5E, 0x8C),  # towers
)
BLAST = Look(space=(0x8E, 0xAA), planet=(0xBC, 0x1E))
FLASH = Look(space=(0x1E,))
RING = Look(space=(0x66, 0x68, 0xA2))
CRATER = Look(planet=(0x60, 0x00))
BLUE_DOT = Look(space=(0x8A,))
BLUE = Look(space=(0x86, 0x88, 0x8A, 0x8C, 0x8E))
SEARCHED = Looks(
    (
        *(SHOT, ENEMY_SHOT, FIGHTER, PIRATE, WARP, DARTER, JUMPER, MAN, KILLER, BLOCKADER),
        *(BLAST, FLASH, RING, CRATER, BLUE, BLUE_DOT),
    )
)
Outline = Shape | tuple[Shape, ...]


def _space(look: Look, like: Outline, **more: Any) -> Blobs:
    """What a look shows in space."""
    return Blobs(look.space, VIEW, like, filters=(SEARCHED.of(look),), frames=in_space, **more)


def _ground(look: Look, like: Outline, **more: Any) -> Blobs:
    """What a look shows on planets."""
    return Blobs(look.planet, VIEW, like, filters=(SEARCHED.of(look),), frames=on_planet, **more)


def _shapes(*sizes: tuple[int, int, int]) -> tuple[Shape, ...]:
    """Outline by width, height and number of pixels."""
    return tuple(Shape(w, h, pixels) for w, h, pixels in sizes)


SHIP = Bounds(SHIP_COLORS, SHIP_ROWS, (9, 7), (11, 7), then=(Raised(2),))
GROUND_SHIP = Bounds(GROUND_SHIP_COLORS, SHIP_ROWS, (9, 7), (11, 7), then=(Raised(2),))
SHOTS = Blobs(SHOT.all, VIEW, Shape((1, 8), (1, 8)), gap=(3, 3), filters=(SEARCHED.of(SHOT),))
ENEMY_SHOTS = Blobs(
    ENEMY_SHOT.all, VIEW, Shape((1, 5), (1, 7)), gap=(1, 1), filters=(SEARCHED.of(ENEMY_SHOT),)
)

RED_SHAPES = (
    Shape(1, 1),
    Shape(2, 2),
    Shape(3, (2, 4), pixels=(6, 12)),
    Shape(4, (2, 5)),
    Shape(5, (2, 6), pixels=(8, 12)),
    Shape(5, (2, 6), pixels=(14, 30)),
    Shape((6, 16), (1, 24)),
)
RED_PLANETS = _space(DARTER, RED_SHAPES)
BLUE_SHAPES = (
    Shape(2, 2, pixels=4),
    Shape((3, 4), (2, 5), pixels=(6, 20)),
    Shape((5, 16), (2, 24), pixels=(10, 304)),
)
DOTS = _space(BLUE_DOT, Shape(1, 1))
BLUE_PLANETS = _space(BLUE, BLUE_SHAPES, also=(DOTS,), then=(DarkEdges(),))
RINGS = _space(RING, Shape((2, 16), (2, 14)))
CRATERS = Blobs(
    CRATER.planet,
    GROUND_VIEW,
    Shape((6, 28), (1, 9)),
    gap=(4, 1),
    filters=(SEARCHED.of(CRATER), no_lines),
)

GROUND_FIGHTERS = _ground(FIGHTER, _shapes((8, 9, 32), (6, 6, 16), (4, 3, 6)))
FIGHTERS = _space(FIGHTER, Shape((1, 8), (1, 12)), also=(GROUND_FIGHTERS,))
GROUND_PIRATES = _ground(JUMPER, (Shape(8, 10, (32, 34)), Shape(6, 8, (22, 24)), Shape(4, 5, 10)))
PIRATES = _space(PIRATE, Shape((1, 8), (1, 9)), gap=(2, 2), also=(GROUND_PIRATES,))
WARPS = _space(WARP, Shape(8, 8, 18), gap=(1, 1))
DARTERS = _space(DARTER, (Shape(2, 1), Shape(5, 5, pixels=13), Shape(3, 3, pixels=5)))
RAIDERS = _ground(DARTER, _shapes((7, 8, 30), (3, 5, 12)))
JUMPERS = _space(JUMPER, _shapes((8, 10, 54), (6, 8, 32), (5, 6, 21), (3, 3, 7)))
MEN = _ground(MAN, (Shape((5, 8), (6, 11), (15, 40)), Shape(3, 5, (7, 9))), gap=(0, 1))
KILLERS = _space(
    KILLER, (Shape(2, 1), Shape((4, 16), (2, 12))), first=(0xA4, 0xA6, 0xA8, 0xAC, 0xAE)
)
ZONE_SHAPES = _shapes(
    (16, 10, 112),
    (14, 8, 82),
    (12, 7, 64),
    (10, 6, 46),
    (8, 5, 32),
    (6, 4, 20),
    (4, 3, 10),
    (3, 2, 6),
)
ZONES = _ground(KILLER, ZONE_SHAPES)
BLOCKADER_SHAPES = _shapes((8, 9, 34), (3, 9, 17), (5, 5, 11), (3, 3, 4))
BLOCKADERS = _space(BLOCKADER, (*BLOCKADER_SHAPES, Shape(4, 7, (13, 15))))
TOWERS = _ground(BLOCKADER, (Shape(8, 10, (40, 41)), Shape(6, 8, (26, 28)), Shape(4, 5, 14)))
FLASHES = _space(FLASH, _shapes((8, 10, 61), (5, 6, 24), (3, 4, 8)))
GROUND_BLASTS = _ground(BLAST, Shape((5, 16), (6, 16)), gap=(7, 4))
EXPLOSIONS = _space(
    BLAST,
    Shape((6, 28), (9, 28)),
    gap=(7, 4),
    also=(FLASHES, GROUND_BLASTS),
)

WINDOW_COLORS = tuple(sorted(set(COLORS)))
SCANNER = Bounds(WINDOW_COLORS, WINDOW, min_size=(40, 15))
TARGET = Bounds(0x0E, WINDOW)
LEFT_ARROW = (LEFT_CELL, 173, LEFT_CELL + 8, 180)
RIGHT_ARROW = (RIGHT_CELL, 173, RIGHT_CELL + 8, 180)
ARROWS = Bounds(0xB8, (LEFT_ARROW, RIGHT_ARROW))
