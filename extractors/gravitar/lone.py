"""A filter that finds the enemies' shots in Gravitar: thin, low and alone.

The terrain has the colours of shots. Without the filter, its parts take 2 us a frame, because VEM
searches each of them like a shot.
"""

import functools
from dataclasses import dataclass
from operator import and_, or_

import jax
import jax.numpy as jnp
from ocjax.authoring import Bitmap, materialize

ROOM = 3  # empty rows above and below


@dataclass(frozen=True)
class Lone:
    """Columns of pixels without other pixels near them, also diagonally.

    Args:
        heights: in rows.
        aside: empty columns on both sides of a pixel, and of its neighbours in the column.
        rows: the first row of the search, and the row after the last.
    """

    heights: tuple[int, ...]
    aside: int
    rows: tuple[int, int]

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """The pixels that the filter keeps."""
        top, bottom = self.rows
        pixels = materialize(lambda b: _padded(b[:, top:bottom]), mask)
        heads = materialize(self._heads, pixels, materialize(self._beside, pixels))
        found = materialize(self._whole, *heads)
        return jnp.pad(found, ((0, 0), (top, mask.shape[1] - bottom), (0, 0)))

    def _beside(self, pixels: Bitmap) -> Bitmap:
        """The columns near pixels in the same rows."""
        here = pixels[1:-1]
        left = pixels[:-2]
        right = pixels[2:]
        aside = range(1, self.aside + 1)
        to_left = (here << n | right >> 32 - n for n in aside)
        to_right = (here >> n | left << 32 - n for n in aside)
        return functools.reduce(or_, (*to_left, *to_right))

    def _heads(self, pixels: Bitmap, beside: Bitmap) -> list[Bitmap]:
        """The first pixels of columns of each height, with room above."""
        heads = (_heads_of(height, pixels[1:-1], beside) for height in self.heights)
        return [jnp.pad(b, ((0, 0), (ROOM, 0), (0, 0))) for b in heads]

    def _whole(self, *heads: Bitmap) -> Bitmap:
        """Columns, from their first pixels."""
        moved = (
            b[:, ROOM - n : b.shape[1] - n]
            for height, b in zip(self.heights, heads, strict=True)
            for n in range(height)
        )
        return functools.reduce(or_, moved)


def _padded(rows: Bitmap) -> Bitmap:
    """Rows with room above and below, and an empty word on both sides."""
    return jnp.pad(rows, ((1, 1), (ROOM, ROOM), (0, 0)))


def _heads_of(height: int, pixels: Bitmap, beside: Bitmap) -> Bitmap:
    """The first pixels of columns of a height; the bitmaps have room above and below."""

    def below(rows: Bitmap, n: int) -> Bitmap:
        return rows[:, ROOM + n : rows.shape[1] - ROOM + n]

    column = functools.reduce(and_, (below(pixels, n) for n in range(height)))
    ends = below(pixels, -1) | below(pixels, height)
    near = functools.reduce(or_, (below(beside, n) for n in range(-1, height + 1)))
    return column & ~(ends | near)
