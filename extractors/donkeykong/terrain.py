"""The girders and ladders of Donkey Kong's two boards.

Timeline, in cycles of a scan line: on the first board, the drawing loop (F7D2) writes PF1 at 21,
PF2 at 29, PF0 and PF1 of the right half at 37 and 45, and clears PF2 at 54. On the second board,
where the right half is mirrored, it writes PF1 at 19 and PF2 at 27 and 47 (F8D8).
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import WIDTH, TerrainKind, TerrainMap, area_mask, playfield
from ocjax.extractors.donkeykong.ram import ROM, Ram

BOARD = (28, 40, 132, 196)
DRUM = (36, 181, 44, 192)
PLATFORMS = (
    *((32, 35, 80, 37), (32, 60, 120, 65), (40, 81, 128, 93), (32, 109, 120, 121)),
    *((40, 137, 128, 149), (32, 165, 120, 177), (32, 193, 128, 195)),
)
# Column, first rung and the row below the last one of the first board's ladders.
LADDERS = (
    *((32, 40, 57), (76, 40, 57), (76, 68, 85), (108, 68, 81), (48, 92, 109), (68, 92, 109)),
    *((100, 88, 113), (64, 116, 141), (88, 120, 137), (108, 120, 137), (48, 148, 165)),
    *((80, 148, 169), (72, 176, 193), (108, 176, 193)),
)
BLUE_PLATFORMS = (
    (32, 35, 128, 37),  # Donkey Kong's, which is thinner
    *((32, y, 128, y + 5) for y in range(60, 173, 28)),
)
BLUE_LADDERS = tuple((x, y, y + 17) for y in range(40, 153, 28) for x in (40, 60, 96, 116))
GIRDERS_AT = np.array(PLATFORMS + BLUE_PLATFORMS)
LADDERS_AT = np.array([(x, top, x + 4, bottom) for x, top, bottom in LADDERS + BLUE_LADDERS])
RIVET_X = np.array([52, 104] * 4)
RIVET_Y = np.repeat([144, 116, 88, 60], 2)

HEIGHT = 210  # lines of the screen
SCREEN_LINE = np.arange(HEIGHT)[:, None]
GIRDER_TOP = 35  # the upper line of Donkey Kong's girder
FLOORS = range(6)  # below it
FIRST_FLOOR = 40  # its first line
FLOOR_LINES = np.arange(0x1B, -1, -1)  # of a floor; the loop counts them down
BLANK_LINES = (2, 2, 2, 2, 2, 12)  # and stops at these
HALF_DRAWN = (
    14  # down to this line, the left PF1 and the right PF0 are 0 on the second floor (F7A7)
)
KINDS = (
    TerrainKind("platform", "girders", effect="carries", category="Platform"),
    TerrainKind("ladder", "rungs of the ladders", effect="carries", category="Ladder"),
)
# Offsets of the registers' rows by floor, upper first: PF1, PF2, then the right PF0 and PF1.
FIRST_PAGES = np.array((0xE00, 0xE00, 0xF00, 0xD00))
FIRST_ROWS = FIRST_PAGES[:, None] + [ROM.bytes(at, 6)[::-1] for at in (0xFE4, 0xFEA, 0xFF0, 0xE09)]
# The same of the second board without rivets: PF1, PF2, then the right PF2.
SECOND_ROWS = 0xA00 + np.array([ROM.bytes(at + 18, 6)[::-1] for at in (0xBAF, 0xBC7, 0xBDF)])
NO_DOTS = np.zeros(len(FLOOR_LINES), np.int32)
LONG_GIRDER = (80, 128)  # columns of Donkey Kong's girder that the second board has


def _first_board(floor: int) -> np.ndarray:
    """The playfield on the lines of a floor, bool `[lines, 160]`."""
    pf1, pf2, right_pf0, right_pf1 = ROM.data[FIRST_ROWS[:, floor, None] + FLOOR_LINES]
    is_drawn = (floor != 1) | (FLOOR_LINES < HALF_DRAWN)
    right = np.where(is_drawn, right_pf0, 0), right_pf1, NO_DOTS
    return playfield(NO_DOTS, np.where(is_drawn, pf1, 0), pf2, right, mirrored=False)


def _second_board(floor: int) -> np.ndarray:
    pf1, pf2, right_pf2 = ROM.data[SECOND_ROWS[:, floor, None] + FLOOR_LINES]
    return playfield(NO_DOTS, pf1, pf2, (NO_DOTS, pf1, right_pf2), mirrored=True)


def _board_pixels(floor_of: Callable[[int], np.ndarray], second: int) -> np.ndarray:
    """The playfield of a board, bool `[HEIGHT, 160]`."""
    lines = [floor_of(i) & np.less(BLANK_LINES[i], FLOOR_LINES)[:, None] for i in FLOORS]
    rest = HEIGHT - FIRST_FLOOR - len(FLOORS) * len(FLOOR_LINES)
    below = np.pad(np.concatenate(lines), ((FIRST_FLOOR, rest), (0, 0)))
    girder = playfield(0, 0x0F, 0xFF, (0, 0x0F * second, 0xFF * second), mirrored=True)
    return below | girder & np.isin(SCREEN_LINE, (GIRDER_TOP, GIRDER_TOP + 1))


def _in_areas(areas: np.ndarray) -> np.ndarray:
    """The pixels in areas of left, top, right and bottom, bool `[HEIGHT, 160]`."""
    return np.logical_or.reduce([area_mask(area) for area in areas.tolist()])


LADDERS_OF = (LADDERS_AT[: len(LADDERS)], LADDERS_AT[len(LADDERS) :])
IS_LADDER = np.array([_in_areas(areas) for areas in LADDERS_OF])  # by board
IS_GROUND = area_mask((0, GIRDER_TOP, WIDTH, HEIGHT)) & ~area_mask(DRUM)
GROUND = IS_GROUND & [_board_pixels(_first_board, 0), _board_pixels(_second_board, 1)]
LAYOUTS = np.stack([GROUND & ~IS_LADDER, GROUND & IS_LADDER], axis=1)


def _layout(m: Ram) -> jax.Array:
    return jnp.where(m.board == 1, 1, 0)


def _seen(frame: jax.Array) -> dict[str, jax.Array]:
    """The colour is that of Donkey Kong's girder, which is longer on the second board."""
    color = frame[GIRDER_TOP, LONG_GIRDER[0] - 1]
    second = jnp.any(frame[GIRDER_TOP, slice(*LONG_GIRDER)] == color)
    lit = (frame == color) & IS_GROUND
    rungs = lit & jnp.where(second, IS_LADDER[1], IS_LADDER[0])
    return {"platform": lit & ~rungs, "ladder": rungs}


TERRAIN = TerrainMap(kinds=KINDS, layouts=LAYOUTS, layout=_layout, seen=_seen)
