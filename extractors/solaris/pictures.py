"""The pictures of what flies about, and how they are drawn, row by row.

A kernel of bank 2 draws space, one of bank 3 draws planets. Both shift some pictures by the moves
that a table holds for each row. Large pictures have wide dots.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from ocjax.extractors.solaris.ram import ROM, Picture

TOP = 23  # the first row in which the kernel can draw an object
BOTTOM = 168  # the row below the last one
MOST_ROWS = 28  # of the largest picture
BLUE_COLOR_ROW = 6  # of blue planets: their colour is there, where they are bright
CUTS = 2 * MOST_ROWS + 1  # how many rows are above the panel, then how many are above the view
BANK_SIZE = 4096

GROUND = 0x62  # colour
GROUND_TOP = 85  # row of a planet's ground; the rows above are black, as craters are
BIT_7 = 0x80
KINDS_AROUND_MIDDLE = -4  # columns from an object's place to the left edge of large pictures


@dataclass(frozen=True)
class Row:
    """A row of a picture."""

    x: int  # first column
    dot: int  # columns of a dot
    dots: int
    color: int


def _signed(byte: int) -> int:
    return (byte ^ 128) - 128


def _columns(byte: int) -> int:
    """Columns to the right by which the chip moves a sprite that has a byte as its move."""
    return -(_signed(byte) >> 4)


def _at(bank: int, address: int) -> int:
    return int(ROM.data[BANK_SIZE * bank + (address & 0xFFF)])


def _in_space(picture: int) -> list[Row]:
    """Rows in bank 2's kernel: every one may move the next one ($F1E0)."""
    page = _at(2, 0xFA3F + picture) << 8
    first, color, move = (_at(2, start + picture) for start in (0xF918, 0xF978, 0xFA9F))
    wide = move >= 0x1B
    rows, x = [], _space_offset(picture) + wide
    for row in range(MOST_ROWS):
        dots = _at(2, page + first - 2 - row)
        if not dots:
            break
        rows.append(Row(x, 1 + wide, dots, _at(2, page + color - 2 - row)))
        x += _columns(_at(2, 0xF300 + move - 2 - row - (not wide)))
    return rows


def _space_offset(picture: int) -> int:
    if Picture.ENEMY_MISSILE + 8 <= picture < Picture.RINGED_PLANET:
        return _signed(_at(0, 0xFFE1 + (picture & 7)))
    return KINDS_AROUND_MIDDLE if _at(0, 0xF080 + picture) & BIT_7 else 0


def _on_planet(picture: int) -> list[Row]:
    """Rows in bank 3's kernel: every other one may have odd colours, which move and widen it."""
    page = _at(3, 0xF848 + picture) << 8
    first, colors, size = (_at(3, start + picture) for start in (0xF800, 0xF8D7, 0xF91F))
    rows, move, color, x = [], 0, 0, _planet_offset(picture)
    dot = _columns_a_dot(size)
    for row in range(MOST_ROWS):
        dots, code = _at(3, page + first - 2 - row), _at(3, page + colors - 2 - row)
        second = row % 2 == 0
        if second and not dots:
            break
        if second and code & 1:
            move, dot = _columns(code), _columns_a_dot(code)
            x += move
        else:
            x += move * (row > 0)
            color = code
        rows.append(Row(x + (dot > 1), dot, dots, color))
    return rows


def _columns_a_dot(size: int) -> int:
    return {5: 2, 7: 4}.get(size & 7, 1)


def _planet_offset(picture: int) -> int:
    if picture >= Picture.RINGED_PLANET:
        return _signed(_at(0, 0xF2E7 + picture))
    return KINDS_AROUND_MIDDLE if _at(0, 0xFC2F + picture) & BIT_7 else 0


def _visible(picture: int, rows: Sequence[Row], planet: bool) -> list[bool]:
    """Which rows differ from what is behind them; craters are dark, other dark rows are shadows."""
    crater = planet and picture >= Picture.RINGED_PLANET
    unseen = GROUND if planet else -1
    return [r.dots > 0 and (crater or r.color > 1) and r.color & ~1 != unseen for r in rows]


def _packed(rows: Sequence[Row], shown: Sequence[bool], color_row: int) -> int:
    """First column + 32, first row, width, height and colour of what is shown of a picture."""
    used = [i for i, seen in enumerate(shown) if seen]
    if not used:
        return 0
    left = min(rows[i].x + rows[i].dot * (8 - rows[i].dots.bit_length()) for i in used)
    last = [(rows[i].dots & -rows[i].dots).bit_length() - 1 for i in used]
    right = max(rows[i].x + rows[i].dot * (8 - bit) for i, bit in zip(used, last, strict=True))
    height = used[-1] + 1 - used[0]
    color = rows[used[min(color_row, len(used) - 1)]].color >> 1
    return left + 32 | used[0] << 7 | right - left << 12 | height << 18 | color << 23


def _cut(rows: list[Row], shown: list[bool], color_row: int, above: int, count: int) -> int:
    """A picture of which `above` rows are above the view, and rows from `count` on below it."""
    if above >= len(rows):
        return 0
    first = rows[above].x - rows[0].x  # the kernel starts with the first row that it draws
    moved = [Row(r.x - first, r.dot, r.dots, r.color) for r in rows]
    inside = [seen and above <= i < count for i, seen in enumerate(shown)]
    return _packed(moved, inside, color_row)


def _all_packed() -> np.ndarray:
    """What is shown of each picture: `[screen, picture, cut]`, flat."""
    out = []
    for planet in (False, True):
        for picture in range(Picture.END):
            unused = picture in (0x11, 0x12, 0x13, 0x30, 0x31)
            beyond = planet and picture >= Picture.PLANET
            rows = [] if unused or beyond else (_on_planet if planet else _in_space)(picture)
            blue = Picture.PLANET <= picture < Picture.RED_PLANET
            look = rows, _visible(picture, rows, planet), BLUE_COLOR_ROW if blue else 0
            out += [_cut(*look, 0, count) for count in range(MOST_ROWS + 1)]
            out += [_cut(*look, above, MOST_ROWS) for above in range(1, MOST_ROWS + 1)]
    return np.array(out, np.int64).astype(np.int32)


TABLE = _all_packed()
