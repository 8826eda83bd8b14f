"""Numbers on the screen: fonts, boxes around displayed numbers, and rules for reading digits."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.console.boxes import WIDTH, Box, Number, box
from ocjax.console.ops import div

__all__ = ["BASE", "DIGITS_3X5", "Digits", "Font", "hex_font", "score_box"]

BASE = 10


@dataclass(frozen=True)
class Font:
    """Pictures of the digits 0 to 9 as a game draws them.

    Args:
        glyphs: ten pictures, each as rows from the top. A row is a number; its lowest bit is the
            rightmost dot.
        dots: width of a picture in dots.
        dot: (width, height) of a dot in pixels.
        pitch: pixels from the left edge of a digit to the left edge of the next digit.
        signs: pictures that may stand before a number, such as a $. VEM reads them as empty cells.
    """

    glyphs: tuple[tuple[int, ...], ...]
    dots: int = 8
    dot: tuple[int, int] = (1, 1)
    pitch: int = 8
    signs: tuple[tuple[int, ...], ...] = ()

    def __post_init__(self) -> None:
        heights = {len(glyph) for glyph in (*self.glyphs, *self.signs)}
        if len(self.glyphs) != BASE or len(heights) != 1:
            raise ValueError(
                f"a font needs ten pictures of equal height, got {len(self.glyphs)} with "
                f"{sorted(heights)} rows"
            )
        if (
            not 0 < self.width <= 32
            or max(row for glyph in (*self.glyphs, *self.signs) for row in glyph) >> self.dots
        ):
            raise ValueError(
                f"the pictures must fit {self.dots} dots and 32 pixels, got dots of "
                f"{self.dot[0]} pixels"
            )

    @property
    def width(self) -> int:
        """Width of a picture in pixels."""
        return self.dots * self.dot[0]

    @property
    def height(self) -> int:
        """Height of a picture in pixels."""
        return len(self.glyphs[0]) * self.dot[1]

    @property
    def left(self) -> np.ndarray:
        """First column with a pixel in each digit, int `[10]`; 0 for an empty picture."""
        ink = [int(np.bitwise_or.reduce(glyph)) for glyph in self.glyphs]
        return np.array(
            [self.dot[0] * (self.dots - bits.bit_length()) if bits else 0 for bits in ink]
        )

    @property
    def right(self) -> np.ndarray:
        """Column after the last one with a pixel in each digit, int `[10]`."""
        ink = [int(np.bitwise_or.reduce(glyph)) for glyph in self.glyphs]
        return np.array(
            [
                self.dot[0] * (self.dots - ((bits & -bits).bit_length() - 1 if bits else 0))
                for bits in ink
            ]
        )


def hex_font(
    words: Iterable[str], dots: int = 8, dot: tuple[int, int] = (1, 1), pitch: int = 8
) -> Font:
    """Make a font from ten words of hexadecimal digits.

    Rows, from the top, take the digits that their dots need.
    """
    n = -(-dots // 4)
    glyphs = tuple(
        tuple(int(word[i : i + n], 16) for i in range(0, len(word), n)) for word in words
    )
    return Font(glyphs, dots, dot, pitch)


DIGITS_3X5 = (
    "75557",
    "22222",
    "71747",
    "71317",
    "55711",
    "74717",
    "44757",
    "71111",
    "75757",
    "75711",
)
"""The digits of 3 x 5 dots that several games of 1977-1980 share, one hexadecimal digit a row."""


@dataclass(frozen=True)
class Digits:
    """The rule with which VEM reads a number: digits in fixed cells.

    Each cell is compared with the font's ten pictures. An empty cell counts as 0, because many
    games do not show leading zeros. The value is unknown if a cell holds any other picture, or one
    that several digits share.

    Args:
        font: the pictures.
        lefts: left column of each digit's cell, most significant digit first.
        top: first row of the cells, the same on every frame. If a number moves between a few rows,
            declare a rule for each row, the second one as `Category.otherwise`.
        weights: value of a 1 in each cell; powers of ten by default.
        base: value of a display of zeros.
        required: whether the object is valid only if the last cell matches a picture, and the cells
            of `free` are empty. Use this if the game shows other things in the number's place.
        free: left columns of cells that are empty while the number is shown, or else the value is
            unknown.
        centered: whether shorter numbers leave cells on the right empty, too.
        step: a divisor of every number, or else the value is unknown.
    """

    font: Font
    lefts: Sequence[int]
    top: int
    weights: tuple[int, ...] | None = None
    base: int = 0
    required: bool = False
    centered: bool = False
    free: tuple[int, ...] = ()
    step: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "lefts", tuple(self.lefts))
        if self.weights is not None and len(self.weights) != len(self.lefts):
            raise ValueError(
                f"each of the {len(self.lefts)} digits needs one weight, got {len(self.weights)} "
                "weights"
            )
        if self.free and not all(any(glyph) for glyph in self.font.glyphs):
            raise ValueError("free cells need a font without an empty picture")
        if min(self.cells) < 0 or max(self.cells) + self.font.width > WIDTH:
            raise ValueError(
                f"every cell must lie on the screen of {WIDTH} columns, got left columns "
                f"{self.cells}"
            )

    @property
    def cells(self) -> tuple[int, ...]:
        """Left columns of all cells, including free cells."""
        return (*self.lefts, *self.free)

    @property
    def worth(self) -> tuple[int, ...]:
        """Value of a 1 in each cell."""
        return self.weights or tuple(BASE**i for i in reversed(range(len(self.lefts))))

    @property
    def bottom(self) -> int:
        """Row below the cells."""
        return self.top + self.font.height


def score_box(
    font: Font,
    shown: jax.Array,
    *,
    right: Number,
    top: Number,
    digits: int,
    leading_zeros: bool = False,
    **fields: Any,
) -> Box:
    """Return the tight box around a right-aligned number.

    Args:
        font: the pictures of its digits.
        shown: the number on the screen, int32, not negative.
        right: right edge of the last digit's cell in pixels, exclusive.
        top: first row of the digits.
        digits: number of cells.
        leading_zeros: whether all cells show a digit; otherwise leading zeros are blank.
        fields: `valid`, `value` and `color` of the box.
    """
    first = right - font.width - font.pitch * (digits - 1)
    left = first + _steps(shown, _left_edges(font, digits, leading_zeros))
    end = right - font.width + _last_edge(font, shown)
    return box(left, top, end - left, font.height, **fields)


def _left_edges(font: Font, digits: int, leading_zeros: bool) -> Iterable[tuple[int, int]]:
    """Yield (minimum value, left edge relative to the first cell), ascending by value."""
    smallest = digits - 1 if leading_zeros else 0
    yield 0, font.pitch * (digits - 1 - smallest) + int(font.left[0])
    for place in range(smallest, digits):
        for digit in range(1, BASE):
            yield digit * BASE**place, font.pitch * (digits - 1 - place) + int(font.left[digit])


def _steps(value: jax.Array, edges: Iterable[tuple[int, int]]) -> jax.Array | int:
    """Evaluate the step function with these edges, each a minimum value and its result."""
    out: jax.Array | int = 0
    before = 0
    for least, now in edges:
        if least == 0:
            out = before = now
        elif now != before:
            out = out + jnp.where(value >= least, now - before, 0)
            before = now
    return out


def _last_edge(font: Font, value: jax.Array) -> jax.Array | int:
    """Return the right edge of the last digit, relative to its cell."""
    edges = font.right
    if len(set(edges.tolist())) == 1:
        return int(edges[0])
    ones = value - BASE * div(value, BASE)
    usual = int(np.bincount(edges).argmax())
    return usual + sum(
        jnp.where(ones == d, int(edges[d]) - usual, 0) for d in range(BASE) if edges[d] != usual
    )
