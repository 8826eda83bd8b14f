"""The rocks, lava, walls and rivers of Hero's rooms.

Before each frame, the program unpacks a room's tables to the playfield's registers in RAM. Timeline
of the lines of a frame; PF0 has the sides, and `outer` and `inner` are PF1 and PF2 of a part:

    16      the ceiling's edge, in four colours (D12C)
    20      the upper part; lines 59 and 60 are a seam in the level's hue (D19E, D302)
    60      the middle part, with `side` as PF0, mirrored or repeated
    99      the lower part, also below a seam
    137     the background below has the river's colour (D329)
    138     the lower edge, in waves where a river flows (D351)

The ball is a wall in the rocks' colour, on all lines from 20 to 137.
"""

import functools
from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    WIDTH,
    TerrainKind,
    TerrainMap,
    among,
    area_mask,
    lookup,
    pick,
    playfield,
    when,
)
from ocjax.extractors.hero.ram import ROM, Ram
from ocjax.extractors.hero.rocks import EDGES, HALF_WALL, LASTS, is_lava

KINDS = (
    TerrainKind("rock", "ceilings, floors and pillars", effect="blocks", category="Wall"),
    TerrainKind("wall", "can be destroyed", "blocks", drawn="sprites", category="Wall"),
    TerrainKind("lava", "rocks that glow", effect="kills", category="LavaWall"),
    TerrainKind("water", "river below the rocks", effect="kills", drawn="background"),
)
HEIGHT = 210  # lines of the screen
SCREEN_COLUMN = np.arange(WIDTH, dtype=np.int32)[None]
CEILING_TOP = 16
FLOOR_BOTTOM = 142
UPPER_LINES = slice(20, 59)  # lines of the upper part
MIDDLE_LINES = slice(61, 98)  # lines of the middle part
RIVER_TOP = 137
RIVER_ROOM = 10  # the first room with a river
BLACK = 0
LAVA_COLORS = (66, 68)
HALF_WIDTH = 4  # columns of half a wall
WALL_WIDTH = 8  # columns of a wall


def _in_lines(top: int, bottom: int) -> np.ndarray:
    """The visible pixels of some lines, bool `[HEIGHT, 160]`."""
    return area_mask((EDGES[0], top, WIDTH, bottom))


IS_VISIBLE = _in_lines(0, HEIGHT)  # the beam blanks the first columns
IS_UPPER = _in_lines(UPPER_LINES.start, MIDDLE_LINES.start - 1)
IS_MIDDLE = _in_lines(MIDDLE_LINES.start - 1, MIDDLE_LINES.stop + 1)
IS_LAVA_LINE = _in_lines(MIDDLE_LINES.start, MIDDLE_LINES.stop)
IS_BALL_LINE = _in_lines(UPPER_LINES.start, RIVER_TOP + 1)
IS_RIVER_LINE = _in_lines(RIVER_TOP, FLOOR_BOTTOM)
IS_FLOOR_EDGE = _in_lines(RIVER_TOP + 1, FLOOR_BOTTOM)
IS_INNER = area_mask((EDGES[0] + WALL_WIDTH, 0, EDGES[1], 1), height=1)
# Masks and PF0 of the ceiling's edge, and masks of the lower edge by `wave`, from the top.
CEILING_MASKS = ROM.bytes(0xC61, 4)[::-1]
CEILING_SIDES = ROM.bytes(0xC66, 4)[::-1]
WAVES = ROM.bytes(0xC36, 32)
WAVE_LINES = np.arange(4, dtype=np.int32)
SIDES = np.array(
    (255, 0, 255), np.int32
)  # PF0 of each part, together with `side` of the middle part
SIDE_PARTS = np.array((0, 255, 0), np.int32)
HUES = ROM.bytes(0x1F6A, 4).tolist()  # of every fourth level
RIVERS = ROM.bytes(0xD01, 4).tolist()  # colours
CEILING_SHADES = ROM.bytes(0xD09, 4)[::-1]
FLOOR_SHADES = ROM.bytes(0xD0A, 4)
PART_SHADES = ROM.bytes(0x1FAE, 3)[::-1]
DIM = 2  # colour of the parts in the dark beside an explosion
# For each line, the index of its colour among the edges' shades, the hue and the parts' colours.
SEAM = 8
COLOR_OF_LINE = np.array(
    [*range(4), *[9] * 39, *[SEAM] * 2, *[10] * 37, *[SEAM] * 2, *[11] * 38, *range(4, 8)]
)
NO_COLOR = 255


def _colors_of_line() -> np.ndarray:
    """The colours that rock may have on each line, uint8 `[HEIGHT, 5]`."""
    by_hue = [
        [*(hue | CEILING_SHADES), *(hue | FLOOR_SHADES), hue or NO_COLOR, *(hue | PART_SHADES)]
        for hue in HUES
    ]
    all_levels = np.array([*by_hue, [*[NO_COLOR] * 9, *[DIM] * 3]], np.uint8).T
    margins = ((CEILING_TOP, HEIGHT - FLOOR_BOTTOM), (0, 0))
    return np.pad(all_levels[COLOR_OF_LINE], margins, constant_values=NO_COLOR)


ROCK_COLORS = _colors_of_line()


def _changes(m: Ram, _: Mapping[str, jax.Array]) -> dict[str, jax.Array]:
    """All of a room's masks: the registers and colours are in RAM."""
    dots = jnp.pad(_playfield_lines(m), ((CEILING_TOP, HEIGHT - FLOOR_BOTTOM), (0, 0)))
    is_shown = _rock_differs(m)
    column = 1 - m.wall + SCREEN_COLUMN
    in_wall = (column >= 0) & (column < jnp.where(m.hits >= HALF_WALL, HALF_WIDTH, WALL_WIDTH))
    at_edge = among(m.wall - 1, EDGES)
    solid = (dots | in_wall & IS_MIDDLE & at_edge) & is_shown
    ball = in_wall & IS_BALL_LINE & ~dots & is_shown
    lava = solid & IS_LAVA_LINE & is_lava(m)
    return {
        "rock": solid & ~lava & IS_VISIBLE,
        "wall": ball & (m.wall > EDGES[0] + 1) & (m.wall <= EDGES[1]),
        "lava": lava,
        "water": ~dots & IS_RIVER_LINE & _has_river(m),
    }


def _playfield_lines(m: Ram) -> jax.Array:
    """The playfield on the lines from the ceiling's edge to the lower edge."""
    side = SIDES | SIDE_PARTS & m.side
    mirrored = playfield(side, m.outer, m.inner, mirrored=True)
    middle = jnp.where(
        m.is_mirrored, mirrored[1], playfield(side, m.outer, m.inner, mirrored=False)[1]
    )
    ceiling = playfield(
        CEILING_SIDES, CEILING_MASKS & m.outer[0], CEILING_MASKS & m.inner[0], mirrored=True
    )
    wave = lookup(WAVES, len(WAVE_LINES) * m.wave + WAVE_LINES)
    floor = playfield(wave, wave & m.outer[2], wave & m.inner[2], mirrored=True)
    return jnp.concatenate(
        [
            ceiling,
            jnp.broadcast_to(mirrored[0], (40, WIDTH)),
            jnp.broadcast_to(middle, (39, WIDTH)),
            jnp.broadcast_to(mirrored[2], (39, WIDTH)),
            floor,
        ]
    )


def _has_river(m: Ram) -> jax.Array:
    return (m.room >= RIVER_ROOM) | (m.room == pick(m.level, LASTS.tolist()))


def _rock_differs(m: Ram) -> jax.Array:
    """Lines where rock differs from the background, `[HEIGHT, 1]`; in the dark both are black."""
    shades = np.concatenate([CEILING_SHADES, FLOOR_SHADES]) | m.hue
    colors = jnp.concatenate([shades, m.hue[None], m.color])[COLOR_OF_LINE]
    river = when(_has_river(m), pick(m.level & 3, RIVERS))
    below = np.arange(CEILING_TOP, FLOOR_BOTTOM) >= RIVER_TOP
    background = jnp.where(below & _has_river(m), river, m.flash)
    return jnp.pad((colors | 1) != (background | 1), (CEILING_TOP, HEIGHT - FLOOR_BOTTOM))[:, None]


def _seen(frame: jax.Array) -> dict[str, jax.Array]:
    """Walls are the only narrow stretches of rock in the middle part that touch no edge."""
    river = among(frame, RIVERS) & IS_RIVER_LINE
    dark = (frame == BLACK) & IS_RIVER_LINE & ~IS_FLOOR_EDGE & jnp.any(river)
    stone = (_has_rock_color(frame) | dark) & IS_VISIBLE
    glow = among(frame, LAVA_COLORS) & IS_LAVA_LINE
    solid = stone | glow
    narrow = _narrow_columns(solid[MIDDLE_LINES])
    upper = narrow & _narrow_columns(solid[UPPER_LINES])
    wall = solid & (narrow & IS_MIDDLE | upper & IS_UPPER)
    return {
        "rock": stone & ~wall,
        "wall": wall,
        "lava": glow & ~wall,
        "water": river,
    }


def _has_rock_color(frame: jax.Array) -> jax.Array:
    each = (frame == ROCK_COLORS[:, i : i + 1] for i in range(ROCK_COLORS.shape[1]))
    return functools.reduce(jnp.logical_or, each)


def _narrow_columns(solid: jax.Array) -> jax.Array:
    """Columns that are solid on most lines, in stretches no wider than a wall, `[1, 160]`."""
    most = jnp.sum(solid, axis=0) > len(solid) // 2
    filled = jnp.pad((most | ~IS_VISIBLE[0]), 16, constant_values=True)
    steps = range(WALL_WIDTH + 1)
    starts = functools.reduce(jnp.logical_and, (jnp.roll(filled, -i) for i in steps))
    wide = functools.reduce(jnp.logical_or, (jnp.roll(starts, i) for i in steps))
    return (filled & ~wide)[None, 16:-16] & IS_INNER


LAYOUTS = np.zeros((1, len(KINDS), HEIGHT, WIDTH), bool)
TERRAIN = TerrainMap(kinds=KINDS, layouts=LAYOUTS, changes=_changes, seen=_seen)
