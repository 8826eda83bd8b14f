"""The filter that finds Krull's shots in front of its many-coloured figures."""

import functools
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from ocjax.authoring import Bitmap, materialize, shift_left, shift_right

SLOPES = 0, 1, -1  # columns to the right per row


@dataclass(frozen=True)
class Lines:
    """Select lines of one colour, upright or diagonal (one column per row).

    This finds thin shots in front of sprites with rows of different colours. Each step is
    materialized: one kernel would repeat all steps for each row and take 30 us per frame instead of
    5.

    Args:
        least: minimum number of rows in a line, 2 to 31.
        rows: the first row, and the row after the last one; pixels of other rows are dropped.
    """

    least: int
    rows: tuple[int, int]

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
        cut = mask[:, top:bottom]
        colors = [b[:, top:bottom] for b in planes]
        none = jnp.zeros_like(cut[:, 1:])
        differs = [
            functools.reduce(
                jnp.bitwise_or, (b[:, :-1] ^ _aside(b[:, 1:], s) for b in colors), none
            )
            for s in SLOPES
        ]
        return [
            cut[:, :-1] & _aside(cut[:, 1:], s) & ~d for s, d in zip(SLOPES, differs, strict=True)
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
        height = self.rows[1] - self.rows[0]
        pixels = (
            _aside(b[:, self.least - 1 - i :][:, :height], -i * s)
            for s, b in zip(SLOPES, heads, strict=True)
            for i in range(self.least)
        )
        return functools.reduce(jnp.bitwise_or, pixels)


def _aside(rows: Bitmap, columns: int) -> Bitmap:
    """Shift rows left by `columns`; a negative number shifts right."""
    return shift_left(rows, columns) if columns >= 0 else shift_right(rows, -columns)
