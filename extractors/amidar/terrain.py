"""Amidar's maze, as the playfield draws it.

The drawing loop at FD4F draws 32 strips of five rows. Its tables have the place of each strip's
registers. The ROM holds the registers of the maze, and the RAM those of the paint.
"""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import TerrainKind, TerrainMap, among, playfield
from ocjax.extractors.amidar.ram import ROM, Ram, is_blank

SCREEN = (210, 160)
STRIP_ROWS = 5
STRIPS = 31  # except an empty one at the top
GROUPS = 11  # lines, and bands between them
TOP = 14  # of the strips
BOTTOM = 168
PATH_ROWS = (1, 3, 4)  # of a strip
PAINT_ROWS = (0, 2)
PATH_COLORS = (36, 212)  # odd and even levels
PAINT_COLOR = 118

# By strip, from the top: the places of its registers in the tables.
PATH_PLACES = ROM.bytes(0x928, STRIPS)[::-1]
PAINT_PLACES = ROM.bytes(0x949, STRIPS)[::-1]

ROWS = np.arange(SCREEN[0])
STRIP_OF_ROW = np.clip((ROWS - TOP) // STRIP_ROWS, 0, STRIPS - 1)


def _are_rows(of_strip: tuple[int, ...]) -> np.ndarray:
    """True for some rows of each strip, bool `[H]`."""
    return (ROWS >= TOP) & (ROWS < BOTTOM) & np.isin((ROWS - TOP) % STRIP_ROWS, of_strip)


def _path_pixels() -> np.ndarray:
    """The lines and ladders, bool `[H, 160]`."""
    pf1 = ROM.data[0x9BA + PATH_PLACES]
    pf2 = ROM.data[0x9BB + PATH_PLACES]
    lines = playfield(np.zeros_like(pf1), pf1, pf2, mirrored=True)
    return lines[STRIP_OF_ROW] & _are_rows(PATH_ROWS)[:, None]


# The line or band of the maze whose paint a row shows; `GROUPS`: none.
GROUP_OF_ROW = np.where(_are_rows(PAINT_ROWS), PAINT_PLACES[STRIP_OF_ROW] // 4 - 1, GROUPS)


def _as_shown(m: Ram, masks: Mapping[str, jax.Array]) -> dict[str, jax.Array]:
    """Add the paint, and clear blank frames."""
    left_1, left_2, right_2, right_1 = m.painted.reshape(GROUPS, 4).T
    zero = jnp.zeros_like(left_1)
    right = (zero, right_1, right_2)
    painted = playfield(zero, left_1, left_2, right, mirrored=True)
    none = jnp.zeros((1, SCREEN[1]), bool)
    paint = jnp.concatenate([painted, none])[GROUP_OF_ROW]
    lit = ~is_blank(m)
    return {"path": masks["path"] & lit, "paint": paint & lit}


def _seen(frame: jax.Array) -> dict[str, jax.Array]:
    return {"path": among(frame, PATH_COLORS), "paint": frame == PAINT_COLOR}


TERRAIN = TerrainMap(
    kinds=(
        TerrainKind("path", "lines and ladders of the maze", effect="carries"),
        TerrainKind("paint", "painted lines and full boxes"),
    ),
    layouts=np.stack([_path_pixels(), np.zeros(SCREEN, bool)])[None],
    changes=_as_shown,
    seen=_seen,
)
