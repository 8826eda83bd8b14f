"""Objects of known pictures that touch: where a component is parted.

A component's first pixel in raster order is the first pixel of the picture that is drawn there. So
pictures are tried at this place only: one fits if its pixels are in the component, or beyond an
edge of the region, where they cannot be seen.

Windows are uint32 `[words, rows, n]`, one for each of `n` components, whose first pixel is in the
first row, in column `reach`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import U
from ocjax.vision.components.fill import extent
from ocjax.vision.detected import words
from ocjax.vision.pictures import PICTURE_WIDTH, Picture

PIVOT = (
    PICTURE_WIDTH - 1
)  # column of a component's first pixel in words that hold any picture there


class Edges(NamedTuple):
    """How far a region reaches from each component's first pixel, int32 `[n]` each."""

    left: jax.Array  # to the region's first column: 0 or less
    right: jax.Array  # to the column after its last one
    bottom: jax.Array  # to the row after its last one


class Extent(NamedTuple):
    """First and last column, first and last row of some pixels in their windows, int32; the last row is -1 where there are none."""

    left: jax.Array
    right: jax.Array
    top: jax.Array
    bottom: jax.Array


def part(filled: jax.Array, reach: int, edges: Edges, pictures: Sequence[Picture]) -> Extent:
    """The extents, `[2, n]`, of the picture that fits at each component's first pixel, and of what
    is left of the component.

    Args:
        filled: windows, at least as high as the pictures and as wide to both sides of column
            `reach`.
        reach: column of the components' first pixels.
        edges: of each component's region.
        pictures: they are tried in this order, and the first one that fits counts.
    """
    height, begin = max(map(len, pictures)), reach - PIVOT
    near = _columns(filled[:, :height], begin)
    ink = _first_picture(near, edges, pictures)
    first = _in_windows(ink, begin, filled.shape)
    return Extent(
        *extent(jnp.stack([first, filled & ~first], axis=2))
    )  # one call for both compiles in half the time


def in_two(
    n_parts: jax.Array,
    parts: jax.Array,
    eligible: jax.Array,
    left: jax.Array,
    top: jax.Array,
    *extents: jax.Array,
) -> tuple[jax.Array, jax.Array]:
    """Numbers of objects and their boxes, with the two boxes of `part` where these are wanted and there are pixels of both."""
    both = Extent(*extents)
    two = eligible & (both.bottom[0] >= 0) & (both.bottom[1] >= 0)
    boxes = words(
        left[None] + both.left,
        top[None] + both.top,
        both.right - both.left + 1,
        both.bottom - both.top + 1,
    )
    return jnp.where(two, 2, n_parts), jnp.where(
        two[None], jnp.concatenate([boxes, parts[2:]]), parts
    )


def _first_picture(near: jax.Array, edges: Edges, pictures: Sequence[Picture]) -> jax.Array:
    """The pixels of the picture that fits in words `[rows, n]` around the components' first pixels."""
    inside = bm.columns_between(PIVOT + edges.left[None], PIVOT + edges.right[None], 1)[0]
    above = np.arange(len(near), dtype=np.int32)[:, None] < edges.bottom[None]
    blank = ~near & jnp.where(above, inside, U(0))
    drawn = [_drawn(picture, len(near)) for picture in pictures]
    fits = lax.reduce(np.stack(drawn) & blank[None], U(0), lax.bitwise_or, (1,)) == 0
    ink = jnp.zeros_like(near)
    for picture, fit in zip(reversed(drawn), reversed(list(fits)), strict=True):
        ink = jnp.where(fit[None], picture, ink)
    return ink & near


def _drawn(picture: Picture, height: int) -> np.ndarray:
    """A picture whose first pixel is in column `PIVOT` of the first of some rows, uint32 `[height, 1]`."""
    shift = 32 - PIVOT - picture[0].bit_length()
    return np.array(
        [row << shift for row in (*picture, *[0] * (height - len(picture)))], np.uint32
    )[:, None]


def _columns(windows: jax.Array, begin: int) -> jax.Array:
    """32 columns of windows, uint32 `[rows, n]`."""
    word, shift = divmod(begin, 32)
    return (
        (windows[word] << shift) | (windows[word + 1] >> (32 - shift)) if shift else windows[word]
    )


def _in_windows(columns: jax.Array, begin: int, shape: tuple[int, ...]) -> jax.Array:
    """The windows of a shape that have these pixels in 32 columns of their first rows, see `_columns`, and no others."""
    words, rows, _ = shape
    word, shift = divmod(begin, 32)
    pieces = [columns >> shift, columns << (32 - shift)] if shift else [columns]
    return jnp.pad(
        jnp.stack(pieces), ((word, words - word - len(pieces)), (0, rows - len(columns)), (0, 0))
    )
