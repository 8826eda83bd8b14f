"""The walls of Alien's maze and bonus screen.

The drawing loop at F088 writes the playfield in every other row, from tables that it reads from the
end. In the bonus screen, the loop at F363 adds walls at the sides and makes all but the bars above
and below black.
"""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import TerrainKind, TerrainMap, area_mask, playfield
from ocjax.extractors.alien.ram import ROM, Ram, is_bonus, is_next_frame, is_rolled

SCREEN = (210, 160)
TOP = 5
FLOOR_TOP = 173  # of the wall below the maze, which holds the display
BOTTOM = 193
ENTRIES = np.arange(0x5F, 0xA, -1)  # of the tables, from the top
ENTRY_ROWS = 2
BARS_END = 13  # row below the bars above the bonus screen
EDGE = 8  # columns at the left edge that are always black
ROLLED = 39  # rows

PURPLE = 96  # walls
BLUE = 132  # the maze's background; bars of the bonus screen
BETWEEN = (8, 85, 160, 101)  # rows of the maze with background only


def _layout(pf0: int) -> np.ndarray:
    """The walls with a PF0, bool `[H, 160]`."""
    pf1 = ROM.data[0x259 + ENTRIES]
    pf2 = ROM.data[0x2AE + ENTRIES]
    lines = playfield(np.full_like(pf1, pf0), pf1, pf2, mirrored=True)
    line_of_row = np.minimum((np.arange(SCREEN[0]) - TOP) // ENTRY_ROWS, len(ENTRIES) - 1)
    return lines[line_of_row] & area_mask((0, TOP, 160, BOTTOM))


MAZE = _layout(0)
BARS = area_mask((EDGE, TOP, 160, BARS_END)) | area_mask((EDGE, FLOOR_TOP, 160, BOTTOM))


def _index(m: Ram) -> jax.Array:
    return (is_bonus(m) & ~is_next_frame(m)).astype(jnp.int32)


def _as_shown(m: Ram, masks: Mapping[str, jax.Array]) -> dict[str, jax.Array]:
    """Roll up the first frame of a life."""
    walls = masks["wall"]
    higher = jnp.pad(walls[ROLLED:], ((0, ROLLED), (0, 0)))
    return {"wall": jnp.where(is_rolled(m), higher, walls)}


def _seen(frame: jax.Array) -> dict[str, jax.Array]:
    """The pixels in the colours of walls and, in the bonus screen, of bars."""
    in_maze = jnp.any((frame == BLUE) & area_mask(BETWEEN))
    return {"wall": (frame == PURPLE) | (frame == BLUE) & ~in_maze}


TERRAIN = TerrainMap(
    kinds=(TerrainKind("wall", "the maze's walls", effect="blocks"),),
    layouts=np.stack([MAZE, _layout(0xFF) & BARS])[:, None],
    layout=_index,
    changes=_as_shown,
    seen=_seen,
)
