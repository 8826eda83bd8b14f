"""Filters of vision rules: select some of the pixels that have a rule's colours.

A filter is a function of a bitmap `[words, rows, B]` (`ocjax.vision.bitmap`) and of the bits of all
colours, `[7, words, rows, B]`. It returns the selected pixels. A game may define its own filters. A
filter with an attribute `rows`, (first, end), selects no pixels of other rows.
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
from ocjax.vision.shapes import check_number

__all__ = [
    "MAX_ROWS",
    "Filter",
    "LoneRuns",
    "NoLines",
    "Searched",
    "ShortRuns",
]

Filter = Callable[[Bitmap, jax.Array], Bitmap]
_Search = Callable[[jax.Array], Any]
# Rows per step along lines, and columns of a word's margin, because lines move by one column per
# row. Row `steps along lines` of benchmarks/tricks.py.
_ROWS_PER_STEP = 8
MAX_ROWS = 255  # of a screen


@dataclass(frozen=True)
class Searched:
    """A filter that depends on the result of a search, which the rules of a game share.

    Args:
        search: a function of the bits of all colours.
        pixels: a function of a bitmap and of the search's result that returns the selected pixels.
        whole: whether the selected pixels do not depend on the bitmap. The rule's colours are then
            not searched, and rules that begin with the same such filter are searched together.
    """

    search: _Search
    pixels: Callable[[Bitmap, Any], Bitmap]
    whole: bool = False

    def __call__(self, mask: Bitmap, planes: jax.Array) -> Bitmap:
        """Select pixels."""
        return self.pixels(mask, self.search(planes))


@dataclass(frozen=True)
class ShortRuns:
    """Select vertical runs of at most `most` pixels: low objects in the colour of walls.

    Args:
        most: maximum number of pixels.
        across: whether to select horizontal runs instead.
    """

    most: int
    across: bool = False

    def __post_init__(self) -> None:
        check_number("most", self.most, 1, 30 if self.across else MAX_ROWS)

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """Select pixels."""
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
    """Select flat objects: horizontal runs that touch no pixel above or below, even at a corner.

    Args:
        least: minimum number of pixels in a run.
    """

    least: int = 1

    def __post_init__(self) -> None:
        check_number("least", self.least, 1, 31)

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """Select pixels."""
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

    This keeps objects that hang on lines of the same colour. Lines are followed within overlapping
    words, some rows at a time; steps across words take Tennis 35 us per frame instead of 30.
    """

    most: int

    def __post_init__(self) -> None:
        check_number("most", self.most, 1, MAX_ROWS)

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """Select pixels."""
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
    """Follow lines by some rows, in windows with `rows` blank rows above and below."""

    def room(pixels: Bitmap) -> jax.Array:
        return jnp.pad(bm.windows(pixels, rows), ((0, 0), (rows, rows), (0, 0)))

    found = materialize(
        functools.partial(step, rows), materialize(room, thin), materialize(room, lines)
    )
    return materialize(lambda words: bm.from_windows(words, rows, len(thin)), found)


def _leading(rows: int, thin: jax.Array, lines: jax.Array) -> jax.Array:
    """Select thin pixels that connect down to a line `rows` rows below."""
    height = thin.shape[1] - 2 * rows
    line = lines[:, 2 * rows :]
    for i in reversed(range(rows, 2 * rows)):
        line = thin[:, i : i + height] & _beside(line)
    return line


def _following(rows: int, thin: jax.Array, lines: jax.Array) -> jax.Array:
    """Extend lines down along thin pixels, by at most `rows` rows."""
    height = thin.shape[1] - 2 * rows
    line = lines[:, :height]
    for i in range(1, rows + 1):
        line = lines[:, i : i + height] | (thin[:, i : i + height] & _beside(line))
    return line


def _beside(words: jax.Array) -> jax.Array:
    return words | (words << 1) | (words >> 1)
