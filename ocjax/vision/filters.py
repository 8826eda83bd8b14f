"""Filters of vision rules: which of the pixels that have a rule's colours count.

A filter is a function of a bitmap `[words, rows, B]` (`ocjax.vision.bitmap`) and of the bits of all
colours, `[7, words, rows, B]`, that returns the pixels of the bitmap that count. A game may define
its own. The filters here are frozen dataclasses, so that rules can be compared and printed.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from ocjax._xla.kernels import materialize
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap

__all__ = [
    "SLOPES",
    "CutOff",
    "Filter",
    "Lines",
    "LoneRuns",
    "NoLines",
    "NoPairs",
    "Searched",
    "ShortRuns",
]

Filter = Callable[[Bitmap, jax.Array], Bitmap]
_Search = Callable[[jax.Array], Any]
_AT_ONCE = (
    8  # rows that lines are followed by within words, which then hold 16 columns of their own
)
SLOPES = 0, 1, -1  # of lines: columns to the right a row


@dataclass(frozen=True)
class Searched:
    """A filter that goes by what a search finds in the frames. The rules of a game that have the
    same search share what it finds.

    Args:
        search: a function of the bits of all colours.
        pixels: a function of a bitmap and of the search's result, that returns the pixels of the
            bitmap that count.
        whole: whether those pixels follow from the search's result alone, whatever the bitmap, so
            that the rule's colours need not be looked for. Rules that begin with the same such
            filter look at the same pixels, and are searched together.
    """

    search: _Search
    pixels: Callable[[Bitmap, Any], Bitmap]
    whole: bool = False

    def __call__(self, mask: Bitmap, planes: jax.Array) -> Bitmap:
        """The pixels that count."""
        return self.pixels(mask, self.search(planes))


@dataclass(frozen=True)
class ShortRuns:
    """The pixels of vertical runs of at most `most` pixels: low objects in the colour of walls.

    Args:
        most: pixels.
        across: whether horizontal runs count instead: upright objects in the colour of figures.
    """

    most: int
    across: bool = False

    def __post_init__(self) -> None:
        if self.most < 1 or (self.across and self.most > 30):
            raise ValueError(
                f"runs must be of at least 1 pixel, and of at most 30 across, got {self.most}"
            )

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """The pixels that count."""
        there, back = (
            (bm.shift_left, bm.shift_right) if self.across else (bm.shift_up, bm.shift_down)
        )
        long = bm.over(
            bm.over(mask, self.most + 1, there, jnp.bitwise_and),
            self.most + 1,
            back,
            jnp.bitwise_or,
        )
        return mask & ~long


@dataclass(frozen=True)
class LoneRuns:
    """The pixels of horizontal runs that touch nothing above or below, also not at their corners:
    flat objects in the colour of others.

    Args:
        least: pixels of a run at least.
    """

    least: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.least <= 31:
            raise ValueError(f"runs must be of 1 to 31 pixels at least, got {self.least}")

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """The pixels that count."""
        beside = bm.spread(bm.shift_up(mask, 1) | bm.shift_down(mask, 1))
        lone = mask & ~jnp.stack(bm.fill_rows(mask, mask & beside))
        return bm.over(
            bm.over(lone, self.least, bm.shift_left, jnp.bitwise_and),
            self.least,
            bm.shift_right,
            jnp.bitwise_or,
        )


@dataclass(frozen=True)
class CutOff:
    """The pixels from which others lead down to a row, at most a pixel aside in each row: objects
    that a lower edge cuts off.

    Args:
        row: the last one above the edge.
        most: rows of an object at most; those further up do not count.
    """

    row: int
    most: int

    def __post_init__(self) -> None:
        if self.row < 0 or self.most < 1:
            raise ValueError(
                "an edge is below a row of at least 0, and objects have at least 1 row, got "
                f"{self.row} and {self.most}"
            )

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """The pixels that count."""
        top = max(0, self.row + 1 - self.most)
        own = mask[:, top : self.row + 1]
        last = jnp.arange(own.shape[1])[None, :, None] == own.shape[1] - 1
        cut = jnp.where(last, own, 0)
        for _row in range(self.most - 1):
            cut = cut | (own & bm.spread(cut | bm.shift_up(cut, 1)))
        return jnp.pad(cut, ((0, 0), (top, mask.shape[1] - 1 - self.row), (0, 0)))


@dataclass(frozen=True)
class NoLines:
    """The pixels that are not in lines one pixel wide, upright or slanting, of more than `most`
    rows: what hangs on lines of its colour.

    Lines are followed within overlapping words, some rows at a time. Across those of a bitmap,
    Tennis takes 35 us a frame instead of 30.

    Args:
        most: rows of the longest line that counts.
    """

    most: int

    def __post_init__(self) -> None:
        if self.most < 1:
            raise ValueError(f"lines must be of at least 1 row, got {self.most}")

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """The pixels that count."""
        thin = materialize(lambda m: m & ~(bm.shift_left(m, 1) | bm.shift_right(m, 1)), mask)
        rounds = [min(_AT_ONCE, self.most - done) for done in range(0, self.most, _AT_ONCE)]
        lines = thin  # from here on their first pixels, then all of them
        for step in (_leading, _following):
            for rows in rounds:
                lines = _followed(step, rows, thin, lines)
        return mask & ~lines


def _followed(
    step: Callable[[int, jax.Array, jax.Array], jax.Array], rows: int, thin: Bitmap, lines: Bitmap
) -> Bitmap:
    """A step along lines, by so many rows."""

    def room(pixels: Bitmap) -> jax.Array:
        return jnp.pad(bm.windows(pixels, rows), ((0, 0), (rows, rows), (0, 0)))

    found = materialize(
        functools.partial(step, rows), materialize(room, thin), materialize(room, lines)
    )
    return materialize(lambda words: bm.from_windows(words, rows, len(thin)), found)


def _leading(rows: int, thin: jax.Array, lines: jax.Array) -> jax.Array:
    """The thin pixels from which others lead down to a line, so many rows below; windows with as many blank rows above and below."""
    height = thin.shape[1] - 2 * rows
    line = lines[:, 2 * rows :]
    for i in reversed(range(rows, 2 * rows)):
        line = thin[:, i : i + height] & _beside(line)
    return line


def _following(rows: int, thin: jax.Array, lines: jax.Array) -> jax.Array:
    """The lines, and the thin pixels to which others lead down from them, at most so many rows below; windows likewise."""
    height = thin.shape[1] - 2 * rows
    line = lines[:, :height]
    for i in range(1, rows + 1):
        line = lines[:, i : i + height] | (thin[:, i : i + height] & _beside(line))
    return line


def _beside(words: jax.Array) -> jax.Array:
    """Each pixel and its neighbours left and right in the same word."""
    return words | (words << 1) | (words >> 1)


@dataclass(frozen=True)
class NoPairs:
    """Drops pairs of pixels in a row that have exactly `gap` blank pixels between them and no third
    pixel at that distance.

    This finds a beam that touches one of two dots in a face.
    """

    gap: int

    def __post_init__(self) -> None:
        if not 1 <= self.gap <= 30:
            raise ValueError(f"pairs must be 1 to 30 pixels apart, got {self.gap}")

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """The pixels that count."""
        between = bm.over(bm.shift_left(mask, 1), self.gap, bm.shift_left, jnp.bitwise_or)
        left = mask & ~between & bm.shift_left(mask, self.gap + 1)
        left = left & ~bm.shift_right(left, self.gap + 1) & ~bm.shift_left(left, self.gap + 1)
        return mask & ~(left | bm.shift_right(left, self.gap + 1))


@dataclass(frozen=True)
class Lines:
    """The pixels in lines of one colour, upright or slanting by a column a row: thin shots before
    figures whose rows differ in colour.

    Each step is computed once and stored: 5 us a frame for 128 rows and 7 bits, and 30 in one
    kernel, which repeats all steps for each row.

    Args:
        least: rows of a line at least.
        rows: the first row that is looked at, and the one after the last; pixels of other rows do
            not count.
    """

    least: int
    rows: tuple[int, int]

    def __post_init__(self) -> None:
        if not 2 <= self.least <= 31:
            raise ValueError(f"lines must be of 2 to 31 rows at least, got {self.least}")
        if not 0 <= self.rows[0] < self.rows[1]:
            raise ValueError(f"rows must be (first, end), got {self.rows}")

    def __call__(self, mask: Bitmap, planes: jax.Array) -> Bitmap:
        """The pixels that count."""
        top, bottom = self.rows
        lines = materialize(
            self._whole, *materialize(self._heads, *materialize(self._as_below, mask, planes))
        )
        return jnp.pad(lines, ((0, 0), (top, mask.shape[1] - bottom), (0, 0)))

    def _as_below(self, mask: Bitmap, planes: jax.Array) -> list[Bitmap]:
        """For each slope the pixels that continue in the next row, in the same colour."""
        top, bottom = self.rows
        mask, *own = (b[:, top:bottom] for b in (mask, *planes))
        none = jnp.zeros_like(mask[:, 1:])
        differs = [
            functools.reduce(jnp.bitwise_or, (b[:, :-1] ^ _aside(b[:, 1:], s) for b in own), none)
            for s in SLOPES
        ]
        return [
            mask[:, :-1] & _aside(mask[:, 1:], s) & ~d for s, d in zip(SLOPES, differs, strict=True)
        ]

    def _heads(self, *same: Bitmap) -> list[Bitmap]:
        """For each slope the pixels from which a line of `least` rows leads down."""
        rows = self.rows[1] - self.rows[0] - self.least + 1
        room = (0, 0), (self.least - 1, self.least - 1), (0, 0)
        steps = [
            [_aside(b[:, i : i + rows], i * s) for i in range(self.least - 1)]
            for s, b in zip(SLOPES, same, strict=True)
        ]
        return [jnp.pad(functools.reduce(jnp.bitwise_and, of_slope), room) for of_slope in steps]

    def _whole(self, *heads: Bitmap) -> Bitmap:
        """The pixels of all lines, from their first ones."""
        height, least = self.rows[1] - self.rows[0], self.least
        pixels = (
            _aside(b[:, least - 1 - i :][:, :height], -i * s)
            for s, b in zip(SLOPES, heads, strict=True)
            for i in range(least)
        )
        return functools.reduce(jnp.bitwise_or, pixels)


def _aside(rows: Bitmap, columns: int) -> Bitmap:
    """Pixels moved to the left by some columns, or to the right by minus as many."""
    return bm.shift_left(rows, columns) if columns >= 0 else bm.shift_right(rows, -columns)
