"""The trees, the ground, its holes, the ladder and the wall of a scene of Pitfall!.

Timeline of the lines of a frame:

    6       the leaves; the lowest 8 lines show a pattern of `trees`, two lines a row (F166)
    65      the trunks (F198)
    117     the ground; from the next line on, `holes` are the PF2 of a line (F2A5, F2CE)
    133     the earth, with `earth` as PF2 (F405)
    148     the wall in two parts, the first with its upper line (F4BE, F4EE, F51B)
    180     the floor (F54A)

The ladder is the ball: FC95 has a bit for each line from 136 on. Every line begins with a strobe of
HMOVE, which blanks the first eight columns.
"""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import WIDTH, TerrainKind, TerrainMap, among, area_mask, playfield
from ocjax.extractors.pitfall.ram import ROM, Ram, Scene, sprite_x

BLACK = 0
SILVERY = 6
BROWN = 16
EARTH = 20
SOIL = 24
RED = 66
BLUE = 164
LEAVES = 210
COVERED = 1  # pixels of objects

KINDS = (
    TerrainKind("tree", "leaves and trunks, behind Harry"),
    TerrainKind("platform", "ground and the floor below", effect="carries", category="Platform"),
    TerrainKind("earth", "between the ground and the cave below", effect="blocks"),
    TerrainKind("ladder", "rungs", effect="carries", drawn="sprites", category="Stair"),
    TerrainKind("wall", "bricks below the ground", "blocks", drawn="sprites", category="Wall"),
    TerrainKind("water", "pond", effect="kills", drawn="background", category="Waterhole"),
    TerrainKind("tar", "tar or quicksand", effect="kills", drawn="background", category="Tarpit"),
    TerrainKind("hole", "above the ladder and beside it", drawn="background", category="Pit"),
)
HEIGHT = 210  # lines of the screen
SCREEN_COLUMN = np.arange(WIDTH, dtype=np.int32)[None]
VISIBLE_LEFT = 8
IS_VISIBLE = SCREEN_COLUMN >= VISIBLE_LEFT
TREE_KINDS = 4  # of `trees`
LEAVES_TOP = 6
PATTERN_TOP = 57
TRUNKS_TOP = 65
GROUND_TOP = 117
EARTH_TOP = 133
LADDER_TOP = 136
CAVE_TOP = 148
FLOOR_TOP = 180
FLOOR_BOTTOM = 186
MIDDLE = (76, 84)  # columns of the hole above the ladder
RUNGS_AT = (78, 82)  # columns
# The entry of `holes` for each line of the ground; the first line is whole.
HOLE_OF_LINE = np.array((*range(6, -1, -1), *range(7), 6))
# Lines of the ladder: they read FC95 from an entry downwards; line 148 is always lit.
LADDER_ENTRIES = (*range(11, -1, -1), 14, *range(14, -1, -1), *range(15, -1, -1))
ENABLED = 2  # bit of ENABL
WHOLE = np.array([255], np.int32)  # a register
BRICKS = np.tile(ROM.rows(0xDB0, 16), 2)  # dots of the wall's lines, from the top


def _in_lines(top: int, bottom: int) -> np.ndarray:
    """The visible pixels of some lines, bool `[HEIGHT, 160]`."""
    return area_mask((VISIBLE_LEFT, top, WIDTH, bottom))


def _on_lines(top: int, lines: np.ndarray) -> np.ndarray:
    """Lines from `top` on, on a screen that is otherwise empty."""
    return np.pad(lines, ((top, HEIGHT - top - len(lines)), (0, 0)))


def _tree_pixels(trees: int) -> np.ndarray:
    """The leaves and trunks, bool `[HEIGHT, 160]`."""
    pattern = np.repeat(ROM.bytes(0x3EF + 4 * trees, 4), 2)
    edge = _on_lines(PATTERN_TOP, playfield(pattern, pattern, pattern, mirrored=True))
    trunks = playfield(0, ROM.data[0xBCE + trees], ROM.data[0xBD2 + trees], mirrored=True)
    above = _in_lines(LEAVES_TOP, PATTERN_TOP)
    return (above | edge | _in_lines(TRUNKS_TOP, GROUND_TOP) & trunks) & IS_VISIBLE


RUNGS = np.pad(ROM.data[[0xC95 + entry for entry in LADDER_ENTRIES]] & ENABLED, LADDER_TOP)[:HEIGHT]
IS_LADDER = area_mask((RUNGS_AT[0], LADDER_TOP, RUNGS_AT[1], FLOOR_TOP))
IS_RUNG = (RUNGS != 0)[:, None] & IS_LADDER
IS_FLOOR = _in_lines(FLOOR_TOP, FLOOR_BOTTOM)
IS_GROUND = _in_lines(GROUND_TOP, EARTH_TOP)
IS_EARTH = _in_lines(EARTH_TOP, CAVE_TOP)
EMPTY = np.zeros((HEIGHT, WIDTH), bool)
LAYOUTS = np.array(
    [
        [_tree_pixels(trees), IS_FLOOR, EMPTY, IS_RUNG, EMPTY, EMPTY, EMPTY, EMPTY]
        for trees in range(TREE_KINDS)
    ]
)


def _layout(m: Ram) -> jax.Array:
    return m.trees & TREE_KINDS - 1


def _changes(m: Ram, masks: Mapping[str, jax.Array]) -> dict[str, jax.Array]:
    """The masks of a state: the ground with its holes, and things below the ground."""
    ground = _placed(GROUND_TOP, _ground_lines(m))
    holes = ~ground & IS_GROUND
    below = playfield(WHOLE, WHOLE, m.earth[None], mirrored=True)
    has_ladder = m.ladder != 0
    return {
        **masks,
        "platform": masks["platform"] | ground & IS_GROUND,
        "earth": below & IS_EARTH,
        "ladder": masks["ladder"] & has_ladder,
        "wall": _wall(m) & has_ladder,
        "water": holes & among(m.scene, Scene.WATER),
        "tar": holes & among(m.scene, Scene.TAR),
        "hole": holes & among(m.scene, (Scene.HOLE, Scene.HOLES)),
    }


def _ground_lines(m: Ram) -> jax.Array:
    """The playfield of the ground, bool `[lines, 160]`."""
    inner = jnp.concatenate([jnp.full(1, 255), m.holes[HOLE_OF_LINE]])
    outer = jnp.full_like(inner, 255)
    return playfield(outer, outer, inner, mirrored=True)


def _placed(top: int, lines: jax.Array) -> jax.Array:
    """The same with lines that depend on the state."""
    return jnp.pad(lines, ((top, HEIGHT - top - len(lines)), (0, 0)))


def _wall(m: Ram) -> jax.Array:
    column = SCREEN_COLUMN - sprite_x(m, 2)
    dot = jnp.where(m.turned, column, 7 - column)
    lit = (BRICKS[:, None] >> jnp.clip(dot, 0, 7) & 1) != 0
    return _placed(CAVE_TOP, lit & (dot >= 0) & (dot < 8) & IS_VISIBLE)


def _seen(frame: jax.Array) -> dict[str, jax.Array]:
    earthen = (frame == EARTH) & IS_VISIBLE
    solid = _fills_blocks(frame, EARTH) & IS_EARTH
    holes = (frame == BLACK) & IS_GROUND
    has_hole = ~jnp.any(solid[EARTH_TOP:CAVE_TOP, slice(*MIDDLE)])
    return {
        "tree": _fills_blocks(frame, BROWN) & _in_lines(TRUNKS_TOP, GROUND_TOP)
        | (frame == LEAVES) & _in_lines(LEAVES_TOP, TRUNKS_TOP),
        "platform": (frame == SOIL) & IS_GROUND | earthen & IS_FLOOR,
        "earth": solid,
        "ladder": earthen & ~solid & IS_LADDER,
        "wall": among(frame, (SILVERY, RED)) & _in_lines(CAVE_TOP, FLOOR_TOP),
        "water": (frame == BLUE) & IS_GROUND,
        "tar": holes & ~has_hole,
        "hole": holes & has_hole,
    }


def _fills_blocks(frame: jax.Array, color: int) -> jax.Array:
    """The pixels of a colour in blocks of the playfield that have this colour or are covered."""
    is_color = frame == color
    blocks = (is_color | (frame == COVERED)).reshape(HEIGHT, -1, 4).all(axis=-1)
    return is_color & jnp.repeat(blocks, 4, axis=1)


TERRAIN = TerrainMap(kinds=KINDS, layouts=LAYOUTS, layout=_layout, changes=_changes, seen=_seen)
