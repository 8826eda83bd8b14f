"""Adventure's frames: which pixels are walls, and which are the player, who has their colour.

The walls' colour is that of the upper left corner. A wall is a cell of four columns and 32 lines
without a pixel of the background, which is grey; in dark rooms, where walls are grey themselves,
the light round the player is that background.
"""

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax._xla.kernels import materialize
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap
from ocjax.vision.filters import Searched

GREY = 0x08
LAMP = 0x48
CORNER_LINE = 29  # of a pixel that is a wall in all rooms, in column 0
STARTS = (27, 44, 76, 108, 140, 172, 204, 221)  # of the rows of walls, and the end
FIRST_THIN = bm.areas(1, ((11, 0, 12, 1), (148, 0, 149, 1)))  # first column of each thin wall
SECOND_THIN = bm.areas(1, ((12, 0, 13, 1), (149, 0, 150, 1)))
THIN_LINE = 27  # walls begin on it, and things on the next one
WHOLE = (4, 8)  # size of the player
UPRIGHT = (1, 4)  # of the least part that is taken before others
FIRST_OF_CELL = np.uint32(0x11111111)


class Found(NamedTuple):
    """Pixels of frames."""

    walls: Bitmap
    loose: Bitmap  # pixels of the walls' colour that are no walls
    square: Bitmap  # those of them that fill the player's square
    player: Bitmap  # those that are most likely his
    dot: Bitmap  # single dots of the walls' colour on the background, or the other way round
    thin: Bitmap  # the columns of a thin wall, which has the first thing's colour, or the second's


def _like_corner(planes: jax.Array) -> Bitmap:
    """The pixels that have the walls' colour."""
    corner = -(planes[:, :1, CORNER_LINE : CORNER_LINE + 1] >> 31)
    differs = planes ^ corner
    other = differs[0]
    for plane in differs[1:]:
        other = other | plane
    return ~other


def _spread_cells(line: jax.Array) -> jax.Array:
    """The columns of all cells that have a pixel in a line."""
    any_pixel = line | line >> 1 | line >> 2 | line >> 3
    return (any_pixel & FIRST_OF_CELL) * 15


def _open_cells(background: Bitmap) -> Bitmap:
    """The pixels of all cells that show the background."""
    words, height, lanes = background.shape
    blank = jnp.zeros((words, STARTS[0], lanes), background.dtype)
    parts = [blank]
    for start, stop in itertools.pairwise(STARTS):
        line = _spread_cells(bm.or_rows(background[:, start:stop]))
        parts.append(jnp.broadcast_to(line[:, None], (words, stop - start, lanes)))
    parts.append(jnp.zeros((words, height - STARTS[-1], lanes), background.dtype))
    return jnp.concatenate(parts, axis=1)


def look(planes: jax.Array) -> Found:
    """Find walls, the player and the dot."""
    same, ground = materialize(_masks, planes)
    is_open = materialize(_open_cells, ground)
    walls, loose, dot, thin = materialize(_sort_out, same, ground, is_open)
    square, tall = _squares(loose)
    return Found(walls, loose, square, materialize(_likeliest, loose, square, tall), dot, thin)


def _masks(planes: jax.Array) -> tuple[Bitmap, Bitmap]:
    """The pixels of the walls' colour and of the background."""
    same, usual = _like_corner(planes), bm.color_mask(planes, (GREY,))
    dark = (usual[:1, CORNER_LINE : CORNER_LINE + 1] >> 31) > 0
    light = bm.color_mask(planes, (LAMP,))
    return same, jnp.where(dark, light, usual)


def _within(pixels: Bitmap) -> Bitmap:
    """Where all pixels two columns and two lines away, and those next in the line, are these."""
    across = [bm.shift_left(pixels, n) & bm.shift_right(pixels, n) for n in (1, 2)]
    return across[0] & across[1] & bm.shift_up(pixels, 2) & bm.shift_down(pixels, 2)


def _sort_out(same: Bitmap, ground: Bitmap, is_open: Bitmap) -> tuple[Bitmap, ...]:
    """Walls, loose pixels, dots and the columns of thin walls, as of `Found`."""
    lines = jnp.any(ground > 0, axis=0, keepdims=True)
    columns = bm.or_rows(ground)[:, None]
    dot = (ground & _within(same)) | (same & _within(ground))
    loose = jnp.where(lines, same & is_open & columns & ~dot, 0)
    thin = ~same[:, THIN_LINE : THIN_LINE + 1] & (FIRST_THIN | SECOND_THIN)
    return same & ~is_open, loose, dot, thin


def _opened(pixels: Bitmap, size: tuple[int, int]) -> Bitmap:
    """The pixels in filled rectangles of a size."""
    corners = materialize(lambda b: bm.all_within(b, *size), pixels)
    return materialize(lambda b: bm.any_within(b, *size), corners)


def _squares(loose: Bitmap) -> tuple[Bitmap, Bitmap]:
    """The whole player, also where a thing of his colour touches him, and what is upright."""
    return _opened(loose, WHOLE), _opened(loose, UPRIGHT)


def _likeliest(loose: Bitmap, square: Bitmap, tall: Bitmap) -> Bitmap:
    """The whole player if he is there, or parts that are upright, or all that may be parts."""
    near = loose & bm.spread(bm.spread(tall))
    is_whole, is_upright = (jnp.any(b > 0, axis=(0, 1), keepdims=True) for b in (square, near))
    return jnp.where(is_whole, square, jnp.where(is_upright, near, loose))


def _no_walls(mask: Bitmap, found: Found) -> Bitmap:
    """Pixels that are no walls; those in a thin wall's columns only if one beside it is of them."""
    free = mask & ~found.walls
    beside = bm.shift_right(free, 1) & FIRST_THIN | bm.shift_left(free, 1) & SECOND_THIN
    wide = bm.shift_left(beside, 1) | bm.shift_right(beside, 1) | beside
    return free & (wide | ~found.thin)


def _player_pixels(_: Bitmap, found: Found) -> Bitmap:
    return found.player


def _beside_square(mask: Bitmap, found: Found) -> Bitmap:
    return mask & ~found.walls & ~found.square


def _dots_alone(mask: Bitmap, found: Found) -> Bitmap:
    return mask & found.dot


def _neither(mask: Bitmap, found: Found) -> Bitmap:
    return mask & ~found.walls & ~found.loose


# Filters.
NOT_WALLS = Searched(look, _no_walls)
IS_PLAYER = Searched(look, _player_pixels)
NOT_SQUARE = Searched(look, _beside_square)
IS_DOT = Searched(look, _dots_alone)
COLORED = Searched(look, _neither)
