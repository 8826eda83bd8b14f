"""Adventure's frames: the pixels of the walls, and the player's pixels in the same colour.

The upper left corner has the walls' colour. A wall is a cell of four columns and 32 lines without a
pixel of the background, which is grey. In dark rooms the walls are grey, and the light round the
player is the background.

XLA fuses slices of a bitmap into their readers, but hardly fuses padded bitmaps. Therefore pixels
move up and down within the lines above and below the view. For motion to the sides, `_with_edges`
adds an empty word on both sides.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from operator import and_, or_
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Bitmap, Searched, bitmaps, materialize
from ocjax.extractors.adventure.rooms import BEFORE_ROWS, ROW_COUNT, ROW_HEIGHT, VIEW

RED = 102
YELLOW = 42
GREEN = 88
PURPLE = 134
WHITE = 14
BLACK = 0
GRAY = 8
LAMP = 72
# These colours do not count as flashes: the ground, and dragons. Cut by the lower edge, a dragon
# may have the chalice's shape.
OTHERS = (RED, YELLOW, GREEN, GRAY)
FLASHES = tuple(color for color in range(0, 256, 2) if color not in OTHERS)
# Numbers of three bits; flashes have the highest bit. All other flashing colours have number 7.
NUMBERS = {RED: 1, YELLOW: 2, GREEN: 3, PURPLE: 4, WHITE: 5, BLACK: 6}
OTHER_FLASH = 7

CORNER_LINE = 29  # of a pixel in column 0 that is a wall in all rooms
WALLS_TOP = 27
WALLS_END = 221
CELLS_TOP = BEFORE_ROWS  # of seven rows of cells of full height
CELLS_END = CELLS_TOP + ROW_COUNT * ROW_HEIGHT
FIRST_THIN = bitmaps.areas(1, ((11, 0, 12, 1), (148, 0, 149, 1)))  # first column of each thin wall
SECOND_THIN = bitmaps.areas(1, ((12, 0, 13, 1), (149, 0, 150, 1)))
SQUARE_WIDTH = 4  # of the player
SQUARE_HEIGHT = 8
UPRIGHT_LINES = 4  # lines of his smallest part that has priority
AROUND = 2  # lines above and below a dot, and columns beside it
DOTS_TOP = CELLS_TOP + AROUND  # first line of the search for dots
FIRST_OF_CELL = np.uint32(0x11111111)


class Found(NamedTuple):
    """Pixels of the view."""

    bits: tuple[Bitmap, ...]  # of the colours' numbers, the lowest first; 0 for walls, too
    loose: Bitmap  # in the walls' colour outside walls
    thin: Bitmap  # columns of a thin wall, in the colour of the first or the second thing
    square: Bitmap  # pixels that fill the player's square
    player: Bitmap  # the player's most likely pixels
    dot: Bitmap  # single dots of the walls' colour on the background, or vice versa


class _Room(NamedTuple):
    """A frame's walls and other pixels of their colour, from line `DOTS_TOP`."""

    walls: Bitmap
    loose: Bitmap  # pixels of the walls' colour outside walls
    thin: Bitmap  # the columns of a thin wall, in the colour of the first or the second thing


def look(planes: jax.Array) -> Found:
    """Find the things before the walls, the player and the dot."""
    same, ground = materialize(_masks, planes)
    dot = materialize(_dots, same, ground)
    room = materialize(_sort_out, same, ground, dot, *materialize(_openings, ground))
    square, player = _find_player(room.loose)
    bits = materialize(_numbered, planes, room.walls)
    loose = _in_view(room.loose, DOTS_TOP)
    return Found(bits, loose, room.thin, square, player, _in_view(dot, DOTS_TOP))


def _with_edges(pixels: Bitmap) -> Bitmap:
    return jnp.pad(pixels, ((1, 1), (0, 0), (0, 0)))


def _left(edged: Bitmap, n: int) -> Bitmap:
    """Shift pixels to the left and drop the edges."""
    return edged[1:-1] << n | edged[2:] >> 32 - n


def _right(edged: Bitmap, n: int) -> Bitmap:
    """Shift pixels to the right and drop the edges."""
    return edged[1:-1] >> n | edged[:-2] << 32 - n


def _in_view(pixels: jax.Array, top: int) -> jax.Array:
    """The lines of the view in a bitmap that begins at line `top`."""
    _, first, _, end = VIEW
    return pixels[..., first - top : end - top, :]


def _each(pixels: Bitmap, count: int) -> list[Bitmap]:
    """The bitmap without its last `count - 1` lines, then the same shifted by one line each."""
    height = pixels.shape[1] - count + 1
    return [pixels[:, i : i + height] for i in range(count)]


def _masks(planes: jax.Array) -> tuple[Bitmap, Bitmap]:
    """The pixels of the walls' colour and of the background, edged."""
    corner = -(planes[:, :1, CORNER_LINE : CORNER_LINE + 1] >> 31)
    differs = functools.reduce(or_, planes ^ corner)
    usual = bitmaps.color_mask(planes, (GRAY,))
    light = bitmaps.color_mask(planes, (LAMP,))
    dark = (usual[:1, CORNER_LINE : CORNER_LINE + 1] >> 31) > 0
    return _with_edges(~differs), _with_edges(jnp.where(dark, light, usual))


def _openings(ground: Bitmap) -> tuple[Bitmap, Bitmap]:
    """The cell columns of each row that show the background, and the columns of all lines."""
    inner = ground[1:-1]
    words, _, lanes = inner.shape
    line_number = np.arange(CELLS_TOP, CELLS_END)[None, :, None]
    has_walls = (line_number >= WALLS_TOP) & (line_number < WALLS_END)
    cells = inner[:, CELLS_TOP:CELLS_END] & np.where(has_walls, bitmaps.ALL, np.uint32(0))
    rows = cells.reshape(words, ROW_COUNT, ROW_HEIGHT, lanes)
    line = jax.lax.reduce(rows, np.uint32(0), jax.lax.bitwise_or, (2,))
    outside = bitmaps.or_rows(inner[:, :WALLS_TOP]) | bitmaps.or_rows(inner[:, WALLS_END:])
    columns = bitmaps.any_of(jnp.moveaxis(line, 1, 0)) | outside
    any_pixel = line | line >> 1 | line >> 2 | line >> 3
    return (any_pixel & FIRST_OF_CELL) * 15, columns[:, None]


def _within(pixels: Bitmap) -> Bitmap:
    """Pixels with set neighbours one and two columns away, and two lines away, on both sides."""
    middle = pixels[:, AROUND:-AROUND]
    across = functools.reduce(and_, (_left(middle, n) & _right(middle, n) for n in (1, AROUND)))
    return across & pixels[1:-1, 2 * AROUND :] & pixels[1:-1, : -2 * AROUND]


def _dots(same: Bitmap, ground: Bitmap) -> Bitmap:
    """Single dots, from line `DOTS_TOP`."""
    own = same[:, CELLS_TOP:CELLS_END]
    free = ground[:, CELLS_TOP:CELLS_END]
    own_middle = own[1:-1, AROUND:-AROUND]
    free_middle = free[1:-1, AROUND:-AROUND]
    return (free_middle & _within(own)) | (own_middle & _within(free))


def _sort_out(same: Bitmap, ground: Bitmap, dot: Bitmap, is_open: Bitmap, columns: Bitmap) -> _Room:
    """Separate a frame's walls from other pixels of their colour."""
    thin = ~same[1:-1, WALLS_TOP : WALLS_TOP + 1] & (FIRST_THIN | SECOND_THIN)
    end = CELLS_END - AROUND
    own = same[1:-1, DOTS_TOP:end]
    free = ground[1:-1, DOTS_TOP:end]
    words, rows, lanes = own.shape
    whole = jnp.broadcast_to(is_open[:, :, None], (words, ROW_COUNT, ROW_HEIGHT, lanes))
    open_lines = whole.reshape(words, -1, lanes)[:, AROUND : AROUND + rows]
    line = np.arange(DOTS_TOP, end)[:, None]
    inside = (bitmaps.any_of(free) != 0) & ((line >= WALLS_TOP) & (line < WALLS_END))
    loose = jnp.where(inside, own & open_lines & columns & ~dot, 0)
    return _Room(own & ~open_lines, loose, thin)


def _find_player(loose: Bitmap) -> tuple[Bitmap, Bitmap]:
    """The pixels that fill the player's square, even if a thing touches it, and the player."""
    uprights = materialize(
        lambda b: _with_edges(functools.reduce(and_, _each(b, UPRIGHT_LINES))), loose
    )
    wide = materialize(_to_width, materialize(_square_corners, uprights))
    square = materialize(
        lambda b: _in_view(_down(b, SQUARE_HEIGHT), DOTS_TOP + SQUARE_HEIGHT - 1), wide
    )
    parts = materialize(
        lambda b: _in_view(_down(b, UPRIGHT_LINES), DOTS_TOP + UPRIGHT_LINES - 1), uprights
    )
    return square, materialize(_likeliest, _in_view(loose, DOTS_TOP), square, parts)


def _square_corners(uprights: Bitmap) -> Bitmap:
    """The upper left corners of all squares, edged."""
    whole = uprights[:, :-UPRIGHT_LINES] & uprights[:, UPRIGHT_LINES:]
    moved = (_left(whole, n) for n in range(1, SQUARE_WIDTH))
    return _with_edges(functools.reduce(and_, moved, whole[1:-1]))


def _to_width(corners: Bitmap) -> Bitmap:
    """The first lines of all squares."""
    moved = (_right(corners, n) for n in range(1, SQUARE_WIDTH))
    return functools.reduce(or_, moved, corners[1:-1])


def _down(pixels: Bitmap, count: int) -> Bitmap:
    """Extend pixels down to `count` lines, and drop the first `count - 1` lines."""
    return functools.reduce(or_, _each(pixels, count))


def _likeliest(loose: Bitmap, square: Bitmap, upright: Bitmap) -> Bitmap:
    """All squares if squares exist, else the upright parts, else all candidates."""
    moved = (move(upright, n) for move in (_left, _right) for n in (1, 2))
    near = loose & functools.reduce(or_, moved, upright[1:-1])
    is_whole = bitmaps.any_of(bitmaps.or_rows(square)) != 0
    is_upright = bitmaps.any_of(bitmaps.or_rows(upright)) != 0
    return jnp.where(is_whole, square, jnp.where(is_upright, near, loose))


def _numbered(planes: jax.Array, walls: Bitmap) -> tuple[Bitmap, ...]:
    """The bits of the colours' numbers."""
    by_color = dict.fromkeys(FLASHES, OTHER_FLASH) | NUMBERS
    shown = _in_view(planes, 0)
    free = ~_in_view(walls, DOTS_TOP)
    colors = [
        [color for color, number in by_color.items() if number >> bit & 1] for bit in range(3)
    ]
    return tuple(bitmaps.color_mask(shown, own) & free for own in colors)


def _things(found: Found, color: int) -> Bitmap:
    """The pixels of a colour outside walls."""
    bits = (b if NUMBERS[color] >> i & 1 else ~b for i, b in enumerate(found.bits))
    return functools.reduce(and_, bits)


def _before_walls(found: Found, color: int) -> Bitmap:
    """The same, but a thin wall's columns only beside another such pixel."""
    free = _things(found, color)
    beside = (free >> 1 & FIRST_THIN) | (free << 1 & SECOND_THIN)  # never in another word
    return free & (beside | beside << 1 | beside >> 1 | ~found.thin)


def _beside_square(found: Found, color: int) -> Bitmap:
    return _things(found, color) & ~found.square


def _flashing(found: Found) -> Bitmap:
    return found.bits[-1] & ~found.loose


def _players_pixels(found: Found) -> Bitmap:
    return found.player


def _grey_dots(found: Found) -> Bitmap:
    """Dots with number 0: grey ones outside walls."""
    return found.dot & ~functools.reduce(or_, found.bits)


@dataclass(frozen=True)
class _Pixels:
    """The pixels of frames that a function finds in the view."""

    of: Callable[..., Bitmap]
    color: int | None = None  # for functions with a colour argument

    def __call__(self, mask: Bitmap, found: Found) -> Bitmap:
        pixels = self.of(found) if self.color is None else self.of(found, self.color)
        _, top, _, bottom = VIEW
        return jnp.pad(pixels, ((0, 0), (top, mask.shape[1] - bottom), (0, 0)))


def _filter(of: Callable[..., Bitmap], color: int | None = None) -> Searched:
    return Searched(look, _Pixels(of, color), whole=True)


NOT_WALLS = {color: _filter(_before_walls, color) for color in NUMBERS}
NOT_SQUARE = {color: _filter(_beside_square, color) for color in (YELLOW, BLACK)}
IS_FLASH = _filter(_flashing)
IS_PLAYER = _filter(_players_pixels)
IS_DOT = _filter(_grey_dots)
