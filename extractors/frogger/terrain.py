"""Frogger's banks, water, verges and road, which are the same in all levels.

At $F8D3 the playfield is 0x30, 0x3C, 0x3C for twelve rows, then 0x30 alone: green strips at both
edges. The lanes are background. Sprites move at the beginning of a lane, which blanks the first
eight columns of a row.
"""

import jax
import numpy as np
from ocjax.authoring import TerrainKind, TerrainMap, area_mask, playfield

STRIPS = playfield(0x30, 0, 0, mirrored=True)[None]
BANKS = playfield(0, 0x3C, 0x3C, mirrored=True)[None]
BANK_AREA = area_mask((8, 13, 152, 25))
STRIP_AREA = area_mask((0, 13, 160, 180))
WATER_AREA = area_mask((8, 25, 152, 92))
VERGE_AREA = area_mask((8, 92, 152, 103)) | area_mask((8, 170, 152, 180))
ROAD_AREA = area_mask((8, 103, 152, 170))
BLANK_ROWS = (13, *range(30, 95, 13), 94, *range(108, 170, 13), 170)  # in their first columns
BLANKS = area_mask((0, 0, 8, 210)) & np.isin(np.arange(210), BLANK_ROWS)[:, None]

BLACK = 0
YELLOW = 28
BLUE = 144
GREEN = 212


def _seen(frame: jax.Array) -> dict[str, jax.Array]:
    """Each kind by its colour, and by its rows and columns if two kinds have one colour."""
    return {
        "bank": (frame == GREEN) & BANK_AREA,
        "bay": (frame == BLUE) & BANK_AREA,
        "water": (frame == BLUE) & ~BANK_AREA,
        "verge": frame == YELLOW,
        "road": (frame == BLACK) & ROAD_AREA,
        "edge": (frame == GREEN) & STRIP_AREA & STRIPS,
    }


TERRAIN = TerrainMap(
    kinds=(
        TerrainKind("bank", "green banks between the bays", effect="kills"),
        TerrainKind("bay", "where frogs are home", drawn="background"),
        TerrainKind("water", "the river, under logs and turtles", "kills", drawn="background"),
        TerrainKind("verge", "strips on both sides of the road", "carries", drawn="background"),
        TerrainKind("road", "lanes of cars", "carries", drawn="background"),
        TerrainKind("edge", "green strips that hide the ends of lanes"),
    ),
    layouts=np.stack(
        [
            BANKS & BANK_AREA,
            ~BANKS & BANK_AREA,
            WATER_AREA,
            VERGE_AREA,
            ROAD_AREA,
            STRIPS & STRIP_AREA & ~BLANKS,
        ]
    )[None],
    seen=_seen,
)
