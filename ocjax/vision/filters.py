"""Filters of vision rules: select some of the pixels that have a rule's colours.

A filter is a function of a bitmap `[words, rows, B]` (`ocjax.vision.bitmap`) and of the bits of all
colours, `[7, words, rows, B]`. It returns the selected pixels of the bitmap. A game may define its
own filters. The filters here are frozen dataclasses, so that rules can be compared and printed.
"""

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
    "Filter",
    "Lines",
    "LoneRuns",
    "NoLines",
    "Searched",
    "ShortRuns",
]

Filter = Callable[[Bitmap, jax.Array], Bitmap]
_Search = Callable[[jax.Array], Any]
# Rows per step along lines. Lines move by one column per row, so a word has a margin of this many
# columns on both sides of its inner columns. Evidence: `NoLines`, and row `steps along lines` of
# benchmarks/tricks.py.
_ROWS_PER_STEP = 8
SLOPES = 0, 1, -1  # of lines: columns to the right per row


@dataclass(frozen=True)
class Searched:
    """A filter that depends on the result of a search in the frames.

    The rules of a game that have the same search share its result.

    Args:
        search: a function of the bits of all colours.
        pixels: a function of a bitmap and of the search's result that returns the selected pixels
            of the bitmap.
        whole: whether the selected pixels depend only on the search's result and not on the bitmap.
            The rule's colours are then not searched. Rules whose first filter is the same such
            filter select the same pixels, and are searched together.
    """

    search: _Search
    pixels: Callable[[Bitmap, Any], Bitmap]
    whole: bool = False

    def __call__(self, mask: Bitmap, planes: jax.Array) -> Bitmap:
        """Return the selected pixels."""
        return self.pixels(mask, self.search(planes))


@dataclass(frozen=True)
class ShortRuns:
    """Select vertical runs of at most `most` pixels: low objects in the colour of walls.

    Args:
        most: maximum number of pixels.
        across: whether to select horizontal runs instead: upright objects in the colour of wider
            sprites.
    """

    most: int
    across: bool = False

    def __post_init__(self) -> None:
        if self.most < 1 or (self.across and self.most > 30):
            raise ValueError(
                f"most must be at least 1, and at most 30 for horizontal runs, got {self.most}"
            )

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """Return the selected pixels."""
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
    """Select horizontal runs that touch no pixel above or below, not even at a corner.

    This finds flat objects in the colour of others.

    Args:
        least: minimum number of pixels in a run.
    """

    least: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.least <= 31:
            raise ValueError(f"least must be 1 to 31 pixels, got {self.least}")

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """Return the selected pixels."""
        beside = bm.spread(bm.shift_up(mask, 1) | bm.shift_down(mask, 1))
        lone = mask & ~jnp.stack(bm.fill_rows(mask, mask & beside))
        return bm.over(
            bm.over(lone, self.least, bm.shift_left, jnp.bitwise_and),
            self.least,
            bm.shift_right,
            jnp.bitwise_or,
        )


@dataclass(frozen=True)
class NoLines:
    """Drop lines one pixel wide, upright or diagonal, of more than `most` rows.

    This keeps objects that hang on lines of the same colour.

    Lines are followed within overlapping words, some rows at a time. Steps across the words of a
    bitmap take Tennis 35 us per frame instead of 30.

    Args:
        most: rows of the longest line that is kept.
    """

    most: int

    def __post_init__(self) -> None:
        if self.most < 1:
            raise ValueError(f"most must be at least 1 row, got {self.most}")

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """Return the selected pixels."""
        thin = materialize(lambda m: m & ~(bm.shift_left(m, 1) | bm.shift_right(m, 1)), mask)
        rounds = [
            min(_ROWS_PER_STEP, self.most - done) for done in range(0, self.most, _ROWS_PER_STEP)
        ]
        lines = thin  # at first the first pixels of lines, at the end all their pixels
        for step in (_leading, _following):
            for rows in rounds:
                lines = _followed(step, rows, thin, lines)
        return mask & ~lines


def _followed(
    step: Callable[[int, jax.Array, jax.Array], jax.Array], rows: int, thin: Bitmap, lines: Bitmap
) -> Bitmap:
    def room(pixels: Bitmap) -> jax.Array:
        return jnp.pad(bm.windows(pixels, rows), ((0, 0), (rows, rows), (0, 0)))

    found = materialize(
        functools.partial(step, rows), materialize(room, thin), materialize(room, lines)
    )
    return materialize(lambda words: bm.from_windows(words, rows, len(thin)), found)


def _leading(rows: int, thin: jax.Array, lines: jax.Array) -> jax.Array:
    """Select thin pixels that connect down to a line `rows` rows below.

    The windows have `rows` blank rows above and below.
    """
    height = thin.shape[1] - 2 * rows
    line = lines[:, 2 * rows :]
    for i in reversed(range(rows, 2 * rows)):
        line = thin[:, i : i + height] & _beside(line)
    return line


def _following(rows: int, thin: jax.Array, lines: jax.Array) -> jax.Array:
    """Extend lines down along thin pixels, by at most `rows` rows.

    The windows have `rows` blank rows above and below.
    """
    height = thin.shape[1] - 2 * rows
    line = lines[:, :height]
    for i in range(1, rows + 1):
        line = lines[:, i : i + height] | (thin[:, i : i + height] & _beside(line))
    return line


def _beside(words: jax.Array) -> jax.Array:
    """Add to each pixel its left and right neighbours in the same word."""
    return words | (words << 1) | (words >> 1)


@dataclass(frozen=True)
class Lines:
    """Select lines of one colour, upright or diagonal (one column per row).

    This finds thin shots in front of sprites with rows of different colours.

    Each step is materialized: 5 us per frame for 128 rows and 7 bits, and 30 us in one kernel,
    which repeats all steps for each row.

    Args:
        least: minimum number of rows in a line.
        rows: the first row, and the row after the last one; pixels of other rows are dropped.
    """

    least: int
    rows: tuple[int, int]

    def __post_init__(self) -> None:
        if not 2 <= self.least <= 31:
            raise ValueError(f"least must be 2 to 31 rows, got {self.least}")
        if not 0 <= self.rows[0] < self.rows[1]:
            raise ValueError(f"rows must be (first, end), got {self.rows}")

    def __call__(self, mask: Bitmap, planes: jax.Array) -> Bitmap:
        """Return the selected pixels."""
        top, bottom = self.rows
        lines = materialize(
            self._whole, *materialize(self._heads, *materialize(self._as_below, mask, planes))
        )
        return jnp.pad(lines, ((0, 0), (top, mask.shape[1] - bottom), (0, 0)))

    def _as_below(self, mask: Bitmap, planes: jax.Array) -> list[Bitmap]:
        """Select, for each slope, the pixels that continue in the same colour in the next row."""
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
        """Select, for each slope, the first pixels of lines of `least` rows."""
        rows = self.rows[1] - self.rows[0] - self.least + 1
        room = (0, 0), (self.least - 1, self.least - 1), (0, 0)
        steps = [
            [_aside(b[:, i : i + rows], i * s) for i in range(self.least - 1)]
            for s, b in zip(SLOPES, same, strict=True)
        ]
        return [jnp.pad(functools.reduce(jnp.bitwise_and, of_slope), room) for of_slope in steps]

    def _whole(self, *heads: Bitmap) -> Bitmap:
        """Expand the first pixels of lines to all their pixels."""
        height, least = self.rows[1] - self.rows[0], self.least
        pixels = (
            _aside(b[:, least - 1 - i :][:, :height], -i * s)
            for s, b in zip(SLOPES, heads, strict=True)
            for i in range(least)
        )
        return functools.reduce(jnp.bitwise_or, pixels)


def _aside(rows: Bitmap, columns: int) -> Bitmap:
    """Shift rows left by `columns`; a negative number shifts right."""
    return bm.shift_left(rows, columns) if columns >= 0 else bm.shift_right(rows, -columns)
