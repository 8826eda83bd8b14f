"""The pictures of Solaris' records, and their visible parts.

A kernel of bank 2 draws space, a kernel of bank 3 draws planets. Both draw a picture from its first
row down to the panel. They shift some pictures row by row; a table holds the moves. Large pictures
have wide dots. This module follows both kernels row by row for every picture and every position at
an edge of the view. `shown_of` looks the results up.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import lookup
from ocjax.extractors.solaris.ram import ROM, Picture, Sky

VIEW_TOP = 23  # the kernel draws objects from this row
VIEW_BOTTOM = 168  # the row below the last one
MOST_ROWS = 28  # of the largest picture
ALL_ROWS = range(MOST_ROWS)
CUTS = 2 * MOST_ROWS + 1  # see `cut_at`
UNUSED = (0x11, 0x12, 0x13, 0x30, 0x31)  # numbers without a picture
BLUE_COLOR_ROW = 6  # row of blue planets with their colour, in their bright part

GROUND = 98  # colour
ALARM_COLOR = 66
SKIES = (Sky.SPACE, Sky.PLANET, Sky.ALARM)
BEHIND = {Sky.SPACE: 0, Sky.PLANET: GROUND, Sky.ALARM: ALARM_COLOR}
GROUND_TOP = 85  # row of a planet's ground; the rows above are black, as craters are

BANK_SIZE = 4096
BIT_7 = 0x80
MIDDLE = -4  # columns from a record's position to the left edge of a picture centered on it
WIDE_FROM = 0x1B  # least low byte of moves of pictures with wide dots
SIZE_COLUMNS = {5: 2, 7: 4}  # of a dot, by the chip's NUSIZ; 1 for all others


class Row(NamedTuple):
    """A row of a picture."""

    x: int  # column of its eight dots, relative to the record's position
    dot: int  # columns of a dot
    dots: int  # one bit each, the leftmost one highest
    color: int

    @property
    def left(self) -> int:
        """The first filled column."""
        return self.x + self.dot * (8 - self.dots.bit_length())

    @property
    def right(self) -> int:
        """The column right of the last filled one."""
        return self.x + self.dot * (9 - (self.dots & -self.dots).bit_length())


class Shown(NamedTuple):
    """The visible parts of pictures; a width of 0 means nothing is visible."""

    left: jax.Array  # relative to the record's position
    top: jax.Array  # relative to the picture's first row
    width: jax.Array
    height: jax.Array
    color: jax.Array


class Bits(NamedTuple):
    """Position of a number in a packed one: one look-up with shifts is faster than several."""

    first: int
    size: int

    def pack(self, number: int) -> int:
        """Return the number shifted to its bits."""
        return number << self.first

    def of(self, packed: jax.Array) -> jax.Array:
        """Extract the number from a packed one."""
        return packed >> self.first & (1 << self.size) - 1


LEFT_BITS = Bits(0, 7)  # plus `LEFTMOST`, which makes it positive
FIRST_ROW_BITS = Bits(7, 5)
WIDTH_BITS = Bits(12, 6)
HEIGHT_BITS = Bits(18, 5)
COLOR_BITS = Bits(23, 7)  # without its lowest bit, which the chip ignores
LEFTMOST = 32


def shown_of(picture: jax.Array, sky: jax.Array, cut: jax.Array) -> Shown:
    """Visible parts of pictures before a sky, by their cuts from `cut_at`."""
    known = jnp.minimum(picture, Picture.NONE - 1)
    packed = lookup(TABLE, (sky * Picture.NONE + known) * CUTS + cut)
    return Shown(
        left=LEFT_BITS.of(packed) - LEFTMOST,
        top=FIRST_ROW_BITS.of(packed),
        width=WIDTH_BITS.of(packed),
        height=HEIGHT_BITS.of(packed),
        color=COLOR_BITS.of(packed) << 1,
    )


def cut_at(y: jax.Array) -> jax.Array:
    """Cuts of pictures with their first rows at `y` on the screen.

    0 to MOST_ROWS: the number of rows above the panel. Larger: MOST_ROWS plus the number of rows
    above the view.
    """
    above = VIEW_TOP - y
    count = jnp.clip(VIEW_BOTTOM - y, 0, MOST_ROWS)
    return jnp.where(above > 0, MOST_ROWS + jnp.minimum(above, MOST_ROWS), count)


def _all_shown() -> np.ndarray:
    """The visible part of each picture, packed: `[sky, picture, cut]`, flat."""
    pictures = range(Picture.NONE)
    packed = [_all_cuts(picture, sky) for sky in SKIES for picture in pictures]
    return np.array(packed, np.int32).ravel()


def _all_cuts(picture: int, sky: int) -> list[int]:
    """The visible part of a picture for each cut."""
    rows = _rows_of(picture, sky == Sky.PLANET)
    seen = [i for i, row in enumerate(rows) if _differs(row, picture, sky)]
    is_blue = Picture.PLANET <= picture < Picture.RED_PLANET
    color_row = BLUE_COLOR_ROW if is_blue else 0
    whole = _tight_box(rows, seen, color_row)
    cut_below = [
        _tight_box(rows, [i for i in seen if i < count], color_row) for count in range(MOST_ROWS)
    ]
    cut_above = [
        _tight_box(_started(rows, above), [i for i in seen if i >= above], color_row)
        for above in range(1, MOST_ROWS + 1)
    ]
    return [*cut_below, whole, *cut_above]


def _rows_of(picture: int, planet: bool) -> list[Row]:
    """The rows of a picture; planets have none over a planet."""
    if picture in UNUSED or (planet and picture >= Picture.PLANET):
        return []
    return _rows_on_planet(picture) if planet else _rows_in_space(picture)


def _differs(row: Row, picture: int, sky: int) -> bool:
    """True if a row differs from the background. Craters are dark; other dark rows are gaps."""
    is_crater = sky == Sky.PLANET and picture >= Picture.RINGED_PLANET
    return row.dots > 0 and (is_crater or row.color > 1) and row.color & ~1 != BEHIND[sky]


def _started(rows: Sequence[Row], above: int) -> list[Row]:
    """The rows as the kernel draws them when `above` rows are above the view."""
    moved = rows[above].x - rows[0].x if above < len(rows) else 0
    return [row._replace(x=row.x - moved) for row in rows]


def _tight_box(rows: Sequence[Row], seen: Sequence[int], color_row: int) -> int:
    """The tight box around the visible rows, and their colour; 0 without rows."""
    if not seen:
        return 0
    left = min(rows[i].left for i in seen)
    right = max(rows[i].right for i in seen)
    color = rows[seen[min(color_row, len(seen) - 1)]].color
    return (
        LEFT_BITS.pack(left + LEFTMOST)
        | FIRST_ROW_BITS.pack(seen[0])
        | WIDTH_BITS.pack(right - left)
        | HEIGHT_BITS.pack(seen[-1] + 1 - seen[0])
        | COLOR_BITS.pack(color >> 1)
    )


def _rows_in_space(picture: int) -> list[Row]:
    """Rows in bank 2's kernel: every row may move the next one ($F1E0)."""
    page = _at(2, 0xFA3F + picture) << 8
    first = _at(2, 0xF918 + picture)
    color = _at(2, 0xF978 + picture)
    move = _at(2, 0xFA9F + picture)
    wide = move >= WIDE_FROM
    dots = list(itertools.takewhile(bool, (_at(2, page + first - 2 - row) for row in ALL_ROWS)))
    moves = [_columns(_at(2, 0xF300 + move - 2 - row - (not wide))) for row in range(len(dots))]
    lefts = itertools.accumulate(moves[:-1], initial=_space_offset(picture) + wide)
    return [
        Row(x, 1 + wide, ink, _at(2, page + color - 2 - row))
        for row, (x, ink) in enumerate(zip(lefts, dots, strict=False))  # a picture may be empty
    ]


def _space_offset(picture: int) -> int:
    """Columns from a record's position to its picture's first row, in space ($F996, $F9D6)."""
    if Picture.EXPLOSION <= picture < Picture.RINGED_PLANET:
        return _signed(_at(0, 0xFFE1 + (picture & 7)))
    return MIDDLE if _at(0, 0xF080 + picture) & BIT_7 else 0


def _rows_on_planet(picture: int) -> list[Row]:
    """Rows in bank 3's kernel; every other row may have an odd colour: a move and a dot width."""
    page = _at(3, 0xF848 + picture) << 8
    first = _at(3, 0xF800 + picture)
    colors = _at(3, 0xF8D7 + picture)
    dots = [_at(3, page + first - 2 - row) for row in ALL_ROWS]
    height = next((row for row in ALL_ROWS[::2] if not dots[row]), MOST_ROWS)
    codes = ((row, _at(3, page + colors - 2 - row)) for row in range(height))
    size = _columns_a_dot(_at(3, 0xF91F + picture))
    begin = Place(_planet_offset(picture), move=0, dot=size, color=0)
    _, *places = itertools.accumulate(codes, _next_place, initial=begin)
    return [
        Row(place.x + (place.dot > 1), place.dot, ink, place.color)
        for place, ink in zip(places, dots[:height], strict=True)
    ]


class Place(NamedTuple):
    """Start of a row of a planet's picture, and the way it is drawn."""

    x: int
    move: int  # columns to the right for the next rows
    dot: int  # columns per dot
    color: int


def _next_place(above: Place, row_code: tuple[int, int]) -> Place:
    """The position of a row, from the row above and the code of its colour."""
    row, code = row_code
    if row % 2 == 0 and code & 1:
        move = _columns(code)
        return Place(above.x + move, move, _columns_a_dot(code), above.color)
    return above._replace(x=above.x + above.move * (row > 0), color=code)


def _planet_offset(picture: int) -> int:
    """Columns from a record's position to its picture's first row, over planets ($F9B2)."""
    if picture >= Picture.RINGED_PLANET:
        return _signed(_at(0, 0xF2E7 + picture))
    return MIDDLE if _at(0, 0xFC2F + picture) & BIT_7 else 0


def _columns_a_dot(size: int) -> int:
    return SIZE_COLUMNS.get(size & 7, 1)


def _columns(byte: int) -> int:
    """Columns to the right that the chip moves a sprite for a byte of motion."""
    return -(_signed(byte) >> 4)


def _signed(byte: int) -> int:
    return (byte ^ 0x80) - 0x80


def _at(bank: int, address: int) -> int:
    return int(ROM.data[BANK_SIZE * bank + (address & 0xFFF)])


TABLE = _all_shown()
