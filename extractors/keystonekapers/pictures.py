"""The pictures of Keystone Kapers: the Kop, the Krook and the things on the floors."""

from collections.abc import Iterable

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import EDGE_CUTS, Pictures
from ocjax.extractors.keystonekapers.ram import ROM, Pose, Thing

SCREEN_START = 8  # the picture's first column
SCREEN_END = 160
WIDTH = 8  # of all pictures

FIGURES = 0xE00  # in the ROM
KOP_POSES = 8
FIGURE_ROWS = 20
KOP_COLORS = 0xC34  # one byte per row; an odd one shows the row
DUCKED_COLORS = 0xC37
KOP_POINTERS = 0xECA
KROOK_POINTERS = 0xFCE  # by pose
KROOK_POSES = 5  # starting at 1
THING_POINTERS = KROOK_POINTERS  # by kind: the Krook's poses come first
PICTURE_PAGE = 0xB00  # page of these pointers
HEIGHTS = 0xE00  # of things, by kind
ALL_KINDS = range(Thing.RADIO, Thing.MONEYBAG + 1)


def _kop_rows(pose: int) -> np.ndarray:
    """The coloured rows of the Kop's picture, from the top."""
    first = DUCKED_COLORS if pose == Pose.DUCKS else KOP_COLORS
    begin = FIGURES + int(ROM.data[KOP_POINTERS + pose]) - 1
    colors = ROM.rows(first, FIGURE_ROWS)
    return np.where(colors & 1 == 1, ROM.rows(begin, FIGURE_ROWS), 0)


def _krook_rows(pose: int) -> np.ndarray:
    """The rows of the Krook's picture, from the top."""
    begin = PICTURE_PAGE + int(ROM.data[KROOK_POINTERS + pose]) + 1
    return ROM.rows(begin, FIGURE_ROWS)


def _thing_rows(thing: int) -> np.ndarray:
    """The rows of a thing's picture, from the top; the last one has the floor's colour."""
    begin = PICTURE_PAGE + int(ROM.data[THING_POINTERS + thing])
    rows = ROM.rows(begin, int(ROM.data[HEIGHTS + thing]))
    return np.append(rows[:-1], 0)


def _at_edges(pictures: Iterable[np.ndarray]) -> Pictures:
    """Pictures with columns hidden by an edge, as in `EDGE_CUTS`."""
    cut = [rows & mask for rows in pictures for mask in EDGE_CUTS]
    return Pictures.of(cut, picture=len(cut) // len(EDGE_CUTS), beyond=len(EDGE_CUTS))


KOP_PICTURES = _at_edges(_kop_rows(pose) for pose in range(KOP_POSES))
KROOK_PICTURES = _at_edges(_krook_rows(pose) for pose in range(1, KROOK_POSES + 1))
THING_PICTURES = Pictures.of(_thing_rows(thing) for thing in ALL_KINDS)
THING_HEIGHTS = tuple(ROM.bytes(HEIGHTS + ALL_KINDS.start, len(ALL_KINDS)).tolist())


def figure_extent(
    pictures: Pictures, picture: jax.Array, x: jax.Array, mirrored: jax.Array
) -> tuple[jax.Array, ...]:
    """First column and row, width and height of the visible part of a figure at column x."""
    beyond_right = jnp.clip(x + WIDTH - SCREEN_END, 0, WIDTH)
    beyond_left = jnp.clip(SCREEN_START - x, 0, WIDTH)
    beyond = beyond_right - beyond_left
    cut = jnp.where(mirrored, -beyond, beyond) + len(EDGE_CUTS) // 2
    return pictures.extent(pictures.index(picture=picture, beyond=cut), mirrored=mirrored)
