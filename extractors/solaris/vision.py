"""VEM's colours, shapes and rules for flying objects in Solaris.

Most pictures have several colours, and share them with other pictures. Sizes and numbers of pixels
distinguish these.
"""

import functools
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from ocjax.authoring import (
    Bitmap,
    Blobs,
    Bounds,
    Context,
    Detected,
    Raised,
    Shape,
    ShortRuns,
    Step,
    boxes,
    color_mask,
)
from ocjax.extractors.solaris.pictures import GROUND_TOP, VIEW_BOTTOM, VIEW_TOP
from ocjax.extractors.solaris.records import VIEW
from ocjax.extractors.solaris.screens import Look, Looks, in_space, on_planet

GROUND_VIEW = (8, GROUND_TOP, 160, VIEW_BOTTOM)
SHIP_ROWS = (8, 144, 160, 151)  # rows with its colours; two rows above are dark

# Colours of the pictures in space.
SHIP_COLORS = (146, 118, 120, 106, 108)
SHOT_COLORS = (14, 8)  # over planets, too
ENEMY_SHOT_COLORS = (158, 126, 110)  # over planets, too
FIGHTER_COLORS = (86, 88, 90, 92, 94)
PIRATE_COLORS = (20, 22, 24, 26, 30)
WARP_COLORS = (70, 72, 138, 140, 142)
DARTER_COLORS = (64, 66, 68, 70, 72)  # of red planets, too
JUMPER_COLORS = (
    *(66, 68, 70, 72, 76),
    *(132, 134, 136, 138, 140, 142),
    *(196, 198, 200, 202),
)
KILLER_COLORS = (164, 166, 168, 170, 172, 174)
BLOCKADER_COLORS = (134, 136, 198, 202, 204, 206)
EXPLOSION_COLORS = (142, 170)
FLASH_COLORS = (30,)  # of the three smallest explosions
RING_COLORS = (102, 104, 162)
BLUE_PLANET_COLORS = (134, 136, 138, 140, 142)
BLUE_DOT_COLORS = (138,)  # of a blue planet of one pixel

# Colours of the pictures over planets.
GROUND_SHIP_COLORS = (66, 52, 38, 40, 26, 28)
GROUND_FIGHTER_COLORS = (26, 78, 172)
GROUND_PIRATE_COLORS = (70, 72, 74, 76, 90, 106)
RAIDER_COLORS = (30, 70, 72, 74, 76, 132, 134, 136, 138, 140)
MAN_COLORS = (24, 28, 70, 72, 76, 136, 138)
ZONE_COLORS = (70, 72, 74, 76, 78)
TOWER_COLORS = (86, 88, 90, 92, 94, 140)
GROUND_EXPLOSION_COLORS = (188, 30)
CRATER_COLORS = (96, 0)

SHOT = Look(all=SHOT_COLORS)
ENEMY_SHOT = Look(all=ENEMY_SHOT_COLORS)
FIGHTER = Look(space=FIGHTER_COLORS, planet=GROUND_FIGHTER_COLORS)
PIRATE = Look(space=PIRATE_COLORS)
WARP = Look(space=WARP_COLORS)
DARTER_OR_RAIDER = Look(space=DARTER_COLORS, planet=RAIDER_COLORS)
JUMPER_OR_PIRATE = Look(space=JUMPER_COLORS, planet=GROUND_PIRATE_COLORS)
MAN = Look(planet=MAN_COLORS)
KILLER_OR_ZONE = Look(space=KILLER_COLORS, planet=ZONE_COLORS)
BLOCKADER_OR_TOWER = Look(space=BLOCKADER_COLORS, planet=TOWER_COLORS)
EXPLOSION = Look(space=EXPLOSION_COLORS, planet=GROUND_EXPLOSION_COLORS)
FLASH = Look(space=FLASH_COLORS)
RING = Look(space=RING_COLORS)
CRATER = Look(planet=CRATER_COLORS)
BLUE_PLANET = Look(space=BLUE_PLANET_COLORS)
BLUE_DOT = Look(space=BLUE_DOT_COLORS)
SEARCHED = Looks(
    (
        *(SHOT, ENEMY_SHOT, FIGHTER, PIRATE, WARP, DARTER_OR_RAIDER, JUMPER_OR_PIRATE, MAN),
        *(KILLER_OR_ZONE, BLOCKADER_OR_TOWER, EXPLOSION, FLASH, RING, CRATER, BLUE_PLANET),
        BLUE_DOT,
    )
)
Outline = Shape | tuple[Shape, ...]


def _space(look: Look, like: Outline, **more: Any) -> Blobs:
    """A rule for a look in space."""
    return Blobs(look.space, VIEW, like, filters=(SEARCHED.of(look),), frames=in_space, **more)


def _ground(look: Look, like: Outline, **more: Any) -> Blobs:
    """A rule for a look over planets."""
    return Blobs(look.planet, VIEW, like, filters=(SEARCHED.of(look),), frames=on_planet, **more)


def _everywhere(look: Look, like: Outline, **more: Any) -> Blobs:
    """A rule for a look on all screens."""
    return Blobs(look.all, VIEW, like, filters=(SEARCHED.of(look),), **more)


def _pictures(*sizes: tuple[int, int, int]) -> tuple[Shape, ...]:
    """The shapes of known pictures: width, height and number of pixels of each."""
    return tuple(Shape(w, h, pixels) for w, h, pixels in sizes)


# Craters are narrower than the lines of the ground.
WITHOUT_LINES = ShortRuns(30, across=True)
BLACK = (0,)


def _no_lines(mask: Bitmap, planes: jax.Array) -> Bitmap:
    """The pixels of craters outside the black lines of the ground."""
    found = mask[:, GROUND_TOP:VIEW_BOTTOM]
    lines = found & ~WITHOUT_LINES(found, planes)
    in_black = color_mask(planes[:, :, GROUND_TOP:VIEW_BOTTOM], BLACK)
    around = ((0, 0), (GROUND_TOP, mask.shape[1] - VIEW_BOTTOM), (0, 0))
    return jnp.pad(found & ~(lines & in_black), around)


class Edge(NamedTuple):
    """Dark rows of a blue planet, in colours that space has, too."""

    width: int  # of the planet
    above: int  # its bright part
    below: int


DARK_EDGES = (Edge(16, 3, 6), Edge(14, 2, 5), Edge(12, 0, 3), Edge(10, 0, 1))


@dataclass(frozen=True)
class WithDarkEdges(Step):
    """Boxes of blue planets with their dark edges."""

    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step."""
        above = sum(jnp.where(found.w == edge.width, edge.above, 0) for edge in DARK_EDGES)
        below = sum(jnp.where(found.w == edge.width, edge.below, 0) for edge in DARK_EDGES)
        first_row = jnp.maximum(found.y - above, VIEW_TOP)
        end_row = jnp.minimum(found.y + found.h + below, VIEW_BOTTOM)
        return found._replace(
            box=boxes(found.x, first_row, found.w, end_row - first_row, found.valid)
        )


class Size(NamedTuple):
    """Columns and rows of a picture."""

    w: int
    h: int


RED_OF_JUMPERS = (Size(4, 2), Size(8, 6))  # no planet is so large, unless the view cuts it off


@dataclass(frozen=True)
class WithoutJumpers(Step):
    """Drop jumpers' red rows that have as many pixels as parts of planets."""

    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step."""
        sizes = [(found.w == size.w) & (found.h == size.h) for size in RED_OF_JUMPERS]
        whole = (found.y > VIEW_TOP) & (found.y + found.h < VIEW_BOTTOM)
        return found.where(~(functools.reduce(jnp.logical_or, sizes) & whole))


SHIP = Bounds(SHIP_COLORS, SHIP_ROWS, (9, 7), (11, 7), then=(Raised(2),))
GROUND_SHIP = Bounds(GROUND_SHIP_COLORS, SHIP_ROWS, (9, 7), (11, 7), then=(Raised(2),))
PLAYER_COLORS = (*SHIP_COLORS, *GROUND_SHIP_COLORS, 64, 132, 160, 162)
SHOTS = _everywhere(SHOT, Shape((1, 8), (1, 8)), gap=(3, 3))
ENEMY_SHOTS = _everywhere(ENEMY_SHOT, Shape((1, 5), (1, 7)), gap=(1, 1))

RED_GAP = (0, 1)  # before an alarm, large red planets lack single rows
# Jumpers have red rows, too. With the gaps filled, these are 4 x 2, 5 x 4, 6 x 3, 8 x 6 and 8 x 7
# columns and rows with 10, 21, 20, 48 and 52 pixels.
RED_SHAPES = (
    Shape(1, 1),
    Shape(2, 2),
    Shape(3, (3, 4), pixels=(10, 11)),  # a darter has 8
    Shape(4, (2, 5)),
    Shape(5, 2),
    Shape(5, 3, pixels=18),
    Shape(5, 4, pixels=23),  # a darter has 17
    Shape(5, (5, 6), pixels=(28, 31)),  # a darter has 18
    Shape(6, (1, 2)),
    Shape(6, 3, pixels=(21, 24)),
    Shape(6, (4, 24)),
    Shape((7, 8), (1, 6)),
    Shape((7, 8), 7, pixels=(53, 64)),
    Shape((7, 8), (8, 24)),
    Shape((9, 16), (1, 24)),
)
RED_PLANETS = _space(DARTER_OR_RAIDER, RED_SHAPES, gap=RED_GAP, then=(WithoutJumpers(),))
BLUE_SHAPES = (
    Shape(2, 2, pixels=4),
    Shape((3, 4), (2, 5), pixels=(6, 20)),
    Shape(5, (2, 24), pixels=(10, 304)),
    Shape(6, (2, 5), pixels=(10, 304)),
    Shape(6, 6, pixels=(30, 36)),  # the blue rows of a jumper have 26
    Shape((6, 16), (7, 24), pixels=(10, 304)),
    Shape((7, 16), (2, 6), pixels=(10, 304)),
)
LONE_DOTS = SEARCHED.lone(BLUE_DOT, BLUE_PLANET)
BLUE_DOTS = Blobs(BLUE_DOT.space, VIEW, Shape(1, 1), filters=(LONE_DOTS,), frames=in_space)
BLUE_PLANETS = _space(BLUE_PLANET, BLUE_SHAPES, also=(BLUE_DOTS,), then=(WithDarkEdges(),))
RINGS = _space(RING, Shape((2, 16), (2, 14)))
CRATERS = Blobs(
    CRATER_COLORS,
    GROUND_VIEW,
    Shape((6, 28), (1, 9)),
    gap=(4, 1),
    filters=(SEARCHED.of(CRATER), _no_lines),
)

GROUND_FIGHTERS = _ground(FIGHTER, _pictures((8, 9, 32), (6, 6, 16), (4, 3, 6)))
FIGHTERS = _space(FIGHTER, Shape((1, 8), (1, 12)), also=(GROUND_FIGHTERS,))
GROUND_PIRATE_SHAPES = (Shape(8, 10, (32, 34)), Shape(6, 8, (22, 24)), Shape(4, 5, 10))
GROUND_PIRATES = _ground(JUMPER_OR_PIRATE, GROUND_PIRATE_SHAPES)
PIRATES = _space(PIRATE, Shape((1, 8), (1, 9)), gap=(2, 2), also=(GROUND_PIRATES,))
ALL_PIRATE_COLORS = (*PIRATES.palette, 18)
WARPS = _space(WARP, Shape(8, 8, 18), gap=(1, 1))
DARTER_SHAPES = (Shape(2, 1), Shape(5, 5, 18), Shape(5, 4, 17), Shape(3, 3, 8))
DARTERS = _space(DARTER_OR_RAIDER, DARTER_SHAPES, gap=RED_GAP)
RAIDERS = _ground(DARTER_OR_RAIDER, _pictures((7, 8, 40), (3, 5, 15)), gap=RED_GAP)
# Jumpers before black, then those without their rows in the colour of an alarm.
JUMPER_SHAPES = (
    *_pictures((8, 10, 54), (6, 8, 32), (5, 6, 21), (3, 3, 7)),
    *_pictures((8, 7, 40), (8, 9, 50), (6, 6, 26)),
)
JUMPERS = _space(JUMPER_OR_PIRATE, JUMPER_SHAPES)
MEN = _ground(MAN, (Shape((5, 8), (6, 11), (15, 40)), Shape(3, 5, (7, 9))), gap=(0, 1))
KILLER_TOPS = (164, 166, 168, 172, 174)  # colours of their first rows
KILLERS = _space(KILLER_OR_ZONE, (Shape(2, 1), Shape((4, 16), (2, 12))), first=KILLER_TOPS)
ZONE_SHAPES = _pictures(
    (16, 10, 112),
    (14, 8, 82),
    (12, 7, 64),
    (10, 6, 46),
    (8, 5, 32),
    (6, 4, 20),
    (4, 3, 10),
    (3, 2, 6),
)
ZONES = _ground(KILLER_OR_ZONE, ZONE_SHAPES)
BLOCKADER_SHAPES = _pictures((8, 9, 34), (3, 9, 17), (5, 5, 11), (3, 3, 4))
BLOCKADERS = _space(BLOCKADER_OR_TOWER, (*BLOCKADER_SHAPES, Shape(4, 7, (13, 15))))
TOWER_SHAPES = (Shape(8, 10, (40, 41)), Shape(6, 8, (26, 28)), Shape(4, 5, 14))
TOWERS = _ground(BLOCKADER_OR_TOWER, TOWER_SHAPES)
FLASHES = _space(FLASH, _pictures((8, 10, 61), (5, 6, 24), (3, 4, 8)))
GROUND_EXPLOSIONS = _ground(EXPLOSION, Shape((5, 16), (6, 16)), gap=(7, 4))
EXPLOSIONS = _space(
    EXPLOSION,
    Shape((6, 28), (9, 28)),
    gap=(7, 4),
    also=(FLASHES, GROUND_EXPLOSIONS),
)
