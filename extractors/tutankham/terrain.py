"""The corridors and the rock of Tutankham's maps.

A row of a map has an entry of the playfield: PF0, PF1 and PF2; the lowest bit of PF0 mirrors the
right half ($DA90-$DABC). The playfield is the corridors. The background is the rock, striped in
four shades. The last row of the screen is a line short.
"""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import WIDTH, TerrainKind, TerrainMap, area_mask, lookup, playfield
from ocjax.extractors.tutankham.maps import INKS, MAP_ROW, ROM, SLICES, table_of
from ocjax.extractors.tutankham.ram import Ram

AREA = (0, 32, WIDTH, 175)
SCREEN_ROWS = (np.arange(210) - AREA[1]) // MAP_ROW  # of each line, from the map's first one
MAP_ROWS = 256
ENTRY_NUMBERS = 0x200  # offset in a slice: the entry of each row
ENTRIES = 0x300

GROUNDS = INKS[:, 7].tolist()  # the first shade of the rock in each map
HOLLOWS = INKS[:, 8]  # colours of corridors
FLASH = 14  # colour of all corridors during a flash
SHADES = 7  # bits of a colour that differ between shades
BLANK_COLUMNS = 8  # at the left, black on a line where the chip moves a sprite


def _corridors_of(part: int, numbers: np.ndarray) -> np.ndarray:
    """The corridors in all rows of a map, bool `[256, 160]`."""
    at = 1024 * part + ENTRIES + numbers
    pf0 = ROM.data[at]
    others = ROM.data[at + 1], ROM.data[at + 2]
    both = [playfield(pf0, *others, mirrored=mirrored) for mirrored in (False, True)]
    return np.where((pf0 & 1 == 1)[:, None], both[1], both[0])


MAPS = np.stack(
    [
        _corridors_of(part, numbers)
        for part, numbers in zip(SLICES, table_of(ENTRY_NUMBERS, MAP_ROWS), strict=True)
    ]
)


def changes(m: Ram, masks: Mapping[str, jax.Array]) -> dict[str, jax.Array]:
    """Corridors in the rock, in the part of the map that is on the screen."""
    rows = MAP_ROWS * m.map + jnp.clip(m.first_row + SCREEN_ROWS, 0, MAP_ROWS - 1)
    corridors = jnp.asarray(MAPS.reshape(-1, WIDTH))[rows] & masks["wall"]
    return {"wall": masks["wall"] & ~corridors, "corridor": corridors}


def seen(frame: jax.Array) -> dict[str, jax.Array]:
    """The shades of the rock and the colour of corridors, which differ between maps."""
    filled = _without_blanks(frame)
    # Two shades identify the map, as no corridor has their colours.
    votes = [jnp.sum((filled == ground + 2) | (filled == ground + 6)) for ground in GROUNDS]
    number = jnp.argmax(jnp.stack(votes))
    ground = lookup(GROUNDS, number)
    hollow = lookup(HOLLOWS, number)
    shown = filled.astype(jnp.int32)
    is_covered = (shown & 1) == 1
    walls = (shown & ~SHADES == ground) & ~is_covered
    corridors = (shown == hollow) | (shown == FLASH)
    return {"wall": walls & area_mask(AREA), "corridor": corridors & area_mask(AREA)}


def _without_blanks(frame: jax.Array) -> jax.Array:
    """The frame with the line above in place of single black lines at the left."""
    above = jnp.roll(frame, 1, axis=0)
    below = jnp.roll(frame, -1, axis=0)
    is_single = (frame == 0) & (above != 0) & (below != 0)
    return jnp.where(is_single & (np.arange(WIDTH) < BLANK_COLUMNS)[None, :], above, frame)


TERRAIN = TerrainMap(
    kinds=(
        TerrainKind("wall", "striped rock", effect="blocks", drawn="background"),
        TerrainKind("corridor", "where the man and the creatures walk"),
    ),
    layouts=np.stack([area_mask(AREA), np.zeros((210, WIDTH), bool)])[None],
    changes=changes,
    seen=seen,
)
