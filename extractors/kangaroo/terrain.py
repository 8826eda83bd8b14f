"""The floors, ladders and walls of Kangaroo's three levels."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import WIDTH, BoxTable, TerrainKind, TerrainMap, area_mask, playfield
from ocjax.extractors.kangaroo.ram import GAME_OVER, ROM, Ram

LEVELS = 3
ROWS = 22  # of a level
PITCH = 8  # lines from row to row
FIRST_LINE = 4  # of the first row
BOTTOM = FIRST_LINE + PITCH * ROWS  # the line below the last row
HEIGHT = 210  # lines of the screen
WOOD_LINES = 4  # the first lines of a row show floors and rungs
HMOVE_LINES = (5, 7)  # of a row: the beam blanks the first 8 columns (0:D31C, 0:D369)
WEST_WALL = 16  # width of the west wall
EAST_WALL = 144  # first column of the east wall
RUNG = 8  # columns
MOST_PLATFORMS = 20  # of a level
SKY = 96
WOOD_BITS = 0x74  # of the colours in which the wood flashes, among them black
OTHER_BITS = 255 - WOOD_BITS
WOODEN = tuple(c for c in range(1, 128) if c & WOOD_BITS == c != SKY)
COVERED = 1  # pixels of objects
CELL = 4  # columns of a dot
SPRITE = 3  # dots that an object hides
KINDS = (
    TerrainKind("wall", "wood at both sides", effect="blocks"),
    TerrainKind("platform", "floors and steps", effect="carries", category="Platform"),
    TerrainKind("ladder", "rungs of the ladders", effect="carries", category="Ladder"),
)

# The registers by level and row, of the left half (PF1, PF2) and of the right half.
REGISTERS = [
    ROM.bytes(at, LEVELS * ROWS).reshape(LEVELS, ROWS) for at in (0xF00, 0xF42, 0xD52, 0xF84)
]
WALLS = np.full((LEVELS, ROWS), 0xF0)  # PF0
WOOD_ROWS = playfield(
    WALLS,
    REGISTERS[0],
    REGISTERS[1],
    right=(WALLS, REGISTERS[2], REGISTERS[3]),
    mirrored=True,
)


def _lit_runs(level: int, row: int) -> list[tuple[int, int]]:
    """Left edges and widths of the playfield's lit stretches in a row, between the walls."""
    line = np.diff(WOOD_ROWS[level, row, WEST_WALL:EAST_WALL].astype(int), prepend=0, append=0)
    starts = np.flatnonzero(line == 1)
    ends = np.flatnonzero(line == -1)
    return [(WEST_WALL + a, b - a) for a, b in zip(starts.tolist(), ends.tolist(), strict=True)]


def _level_platforms(level: int) -> list[tuple[int, int, int, int]]:
    """The boxes of a level's floors and steps, from the top; zeros for missing ones."""
    lit = ((FIRST_LINE + PITCH * row, run) for row in range(ROWS) for run in _lit_runs(level, row))
    wide = [(x, y, w, 4) for y, (x, w) in lit if w > RUNG]
    return wide + [(0, 0, 0, 0)] * (MOST_PLATFORMS - len(wide))


def _level_ladders(level: int) -> list[tuple[int, ...]]:
    """Boxes of a level's ladders; the rungs of a ladder lie in successive rows."""
    found = [(row, x) for row in range(ROWS) for x, w in _lit_runs(level, row) if w == RUNG]
    tops = [(row, x) for row, x in found if (row - 1, x) not in found]
    last = [next(r for r in range(row, ROWS) if (r + 1, x) not in found) for row, x in tops]
    ends = zip(tops, last, strict=True)
    return [(x, FIRST_LINE + PITCH * row, RUNG, PITCH * (end - row) + 4) for (row, x), end in ends]


PLATFORMS = BoxTable([place for level in range(LEVELS) for place in _level_platforms(level)])
LADDERS = np.array([ladder for level in range(LEVELS) for ladder in _level_ladders(level)])
LADDER_LEVEL = np.repeat(np.arange(LEVELS), [len(_level_ladders(level)) for level in range(LEVELS)])


SCREEN_LINE = np.arange(HEIGHT)[:, None]
IS_INSIDE = area_mask((WEST_WALL, FIRST_LINE - 1, EAST_WALL, BOTTOM))
IS_BLANKED = area_mask((0, FIRST_LINE, 8, BOTTOM)) & np.isin(
    (SCREEN_LINE - FIRST_LINE) % PITCH, HMOVE_LINES
)
# The walls begin a line above the first row.
IS_WALL = area_mask((0, FIRST_LINE - 1, WIDTH, BOTTOM)) & ~IS_INSIDE & ~IS_BLANKED
NOTHING = len(KINDS) * [np.zeros((HEIGHT, WIDTH), bool)]


def _is_ladder(level: int) -> np.ndarray:
    """The pixels in the boxes of a level's ladders, bool `[HEIGHT, 160]`."""
    boxes = _level_ladders(level)
    return np.logical_or.reduce([area_mask((x, y, x + w, y + h)) for x, y, w, h in boxes])


def _level_masks(level: int) -> list[np.ndarray]:
    """The wall, the floors and steps, and the rungs."""
    lines = np.repeat(WOOD_ROWS[level], PITCH, axis=0)
    field = np.pad(lines, ((FIRST_LINE, HEIGHT - BOTTOM), (0, 0)))
    wood = field & IS_INSIDE & ((SCREEN_LINE - FIRST_LINE) % PITCH < WOOD_LINES)
    rungs = wood & _is_ladder(level)
    return [IS_WALL, wood & ~rungs, rungs]


LAYOUTS = np.array([*map(_level_masks, range(LEVELS)), NOTHING])


def _layout(m: Ram) -> jax.Array:
    return jnp.where((m.lives < GAME_OVER) & (m.level < LEVELS), m.level, LEVELS)


def _seen(frame: jax.Array) -> dict[str, jax.Array]:
    """Floors are wider than rungs. A floor behind an object has wood on both sides of it."""
    in_play = jnp.any(frame == SKY)
    wood = ((frame & OTHER_BITS) == 0) & (frame != SKY) & in_play
    is_wood = _in_cells(wood)
    is_hidden = _in_cells(frame == COVERED) & ~is_wood
    is_open = _in_cells(wood & IS_INSIDE)
    hidden = _beside(is_open, is_hidden, 1) & _beside(is_open, is_hidden, -1) & is_hidden
    floors = jnp.repeat(_in_wide_runs(is_wood | hidden), CELL, axis=1) & wood & IS_INSIDE
    return {"wall": wood & IS_WALL, "platform": floors, "ladder": wood & IS_INSIDE & ~floors}


def _in_cells(pixels: jax.Array) -> jax.Array:
    """The dots of the playfield with such a pixel, bool `[HEIGHT, 40]`."""
    return jnp.any(pixels.reshape(HEIGHT, -1, CELL), axis=-1)


def _beside(wood: jax.Array, hidden: jax.Array, step: int) -> jax.Array:
    """Wood, and hidden dots that only hidden dots separate from wood on one side."""
    return functools.reduce(
        lambda found, _: found | hidden & jnp.roll(found, step, axis=1), range(SPRITE), wood
    )


def _in_wide_runs(wood: jax.Array) -> jax.Array:
    """The dots in stretches of a line that are wider than a rung."""
    steps = range(RUNG // CELL + 1)
    starts = functools.reduce(jnp.logical_and, (jnp.roll(wood, -i, axis=1) for i in steps))
    return functools.reduce(jnp.logical_or, (jnp.roll(starts, i, axis=1) for i in steps))


TERRAIN = TerrainMap(kinds=KINDS, layouts=LAYOUTS, layout=_layout, seen=_seen)
