"""Split components of touching objects by their pictures.

A component's first pixel in raster order is a picture's first pixel, so pictures are tried only
there. A picture fits if its pixels are in the component, or beyond an edge of the region.

Windows are uint32 `[words, rows, n]` for `n` components. The first pixel of each component is in
the first row, in column `reach`.
"""

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

# Column of a component's first pixel in words that can hold any picture.
FIRST_PIXEL_COLUMN = PICTURE_WIDTH - 1


class Edges(NamedTuple):
    """Distances from each component's first pixel to a region's edges, int32 `[n]` each."""

    left: jax.Array  # to the region's first column: 0 or less
    right: jax.Array  # to the column after its last one
    bottom: jax.Array  # to the row after its last one


class Extent(NamedTuple):
    """First and last column and row of pixels in windows, int32; last row -1 without any."""

    left: jax.Array
    right: jax.Array
    top: jax.Array
    bottom: jax.Array


def split(filled: jax.Array, reach: int, edges: Edges, pictures: Sequence[Picture]) -> Extent:
    """Find the extents `[2, n]` of each component's first picture and of its remaining pixels.

    Args:
        filled: windows, at least as high as the pictures and as wide to both sides of column
            `reach`.
        pictures: the first one that fits applies.
    """
    height, begin = max(map(len, pictures)), reach - FIRST_PIXEL_COLUMN
    near = _columns(filled[:, :height], begin)
    ink = _first_picture(near, edges, pictures)
    first = _in_windows(ink, begin, filled.shape)
    # One call for both compiles in half the time.
    return Extent(*extent(jnp.stack([first, filled & ~first], axis=2)))


def replaced_by_two(
    n_parts: jax.Array,
    objects: jax.Array,
    eligible: jax.Array,
    left: jax.Array,
    top: jax.Array,
    *extents: jax.Array,
) -> tuple[jax.Array, jax.Array]:
    """Replace eligible objects by the two boxes of `split` if both have pixels.

    Returns:
        The numbers of objects, and their boxes.
    """
    both = Extent(*extents)
    two = eligible & (both.bottom[0] >= 0) & (both.bottom[1] >= 0)
    boxes = words(
        left[None] + both.left,
        top[None] + both.top,
        both.right - both.left + 1,
        both.bottom - both.top + 1,
    )
    return jnp.where(two, 2, n_parts), jnp.where(
        two[None], jnp.concatenate([boxes, objects[2:]]), objects
    )


def _first_picture(near: jax.Array, edges: Edges, pictures: Sequence[Picture]) -> jax.Array:
    """Select the pixels of the picture that fits in words `[rows, n]` around the first pixels."""
    inside = bm.columns_between(
        FIRST_PIXEL_COLUMN + edges.left[None], FIRST_PIXEL_COLUMN + edges.right[None], 1
    )[0]
    above = np.arange(len(near), dtype=np.int32)[:, None] < edges.bottom[None]
    blank = ~near & jnp.where(above, inside, U(0))
    drawn = [_drawn(picture, len(near)) for picture in pictures]
    fits = lax.reduce(np.stack(drawn) & blank[None], U(0), lax.bitwise_or, (1,)) == 0
    ink = jnp.zeros_like(near)
    for picture, fit in zip(reversed(drawn), reversed(list(fits)), strict=True):
        ink = jnp.where(fit[None], picture, ink)
    return ink & near


def _drawn(picture: Picture, height: int) -> np.ndarray:
    """Draw a picture, uint32 `[height, 1]`, with its first pixel in column `FIRST_PIXEL_COLUMN`."""
    shift = 32 - FIRST_PIXEL_COLUMN - picture[0].bit_length()
    return np.array(
        [row << shift for row in (*picture, *[0] * (height - len(picture)))], np.uint32
    )[:, None]


def _columns(windows: jax.Array, begin: int) -> jax.Array:
    """Return 32 columns of windows, uint32 `[rows, n]`."""
    word, shift = divmod(begin, 32)
    return (
        (windows[word] << shift) | (windows[word + 1] >> (32 - shift)) if shift else windows[word]
    )


def _in_windows(columns: jax.Array, begin: int, shape: tuple[int, ...]) -> jax.Array:
    """Expand 32 columns (see `_columns`) of the first rows to windows, with zeros elsewhere."""
    words, rows, _ = shape
    word, shift = divmod(begin, 32)
    pieces = [columns >> shift, columns << (32 - shift)] if shift else [columns]
    return jnp.pad(
        jnp.stack(pieces), ((word, words - word - len(pieces)), (0, rows - len(columns)), (0, 0))
    )
