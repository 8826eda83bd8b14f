"""DoubleDunk: the pixels of the ball and of the players, from the figures found."""

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import WIDTH, Bitmap, U, bitmaps, materialize
from ocjax.extractors.doubledunk.figures import ANY_COLOR, NO_FIGURE


@dataclass(frozen=True)
class BallPixels:
    """The ball, in its own colour or in the colour of a player whom it touches.

    Args:
        rows: of the screen, as in the search for figures.
        part: width and height of the smallest part of the ball in the search.
        whole: size of a part that has priority over a smaller one elsewhere.
        near: columns and rows around that, or around pixels in its own colour, that belong to it.
        widths: of a ball of at most `low` rows, and of a taller one.
    """

    rows: tuple[int, int]
    part: tuple[int, int]
    whole: tuple[int, int]
    near: tuple[int, int]
    low: int
    widths: tuple[int, int]

    def __call__(self, mask: Bitmap, found: dict[str, jax.Array]) -> Bitmap:
        """The pixels of the ball."""
        own, rest = found[NO_FIGURE]
        parts = materialize(lambda r: _opened(r, self.part), rest)
        whole = materialize(lambda r: _opened(r, self.whole), rest)
        seed = materialize(lambda o, w: jnp.where(_has_any(o), o, w), own, whole)
        near = materialize(lambda s: _near_edges(s, *self.near), seed)
        around = _box(near, seed.shape[1])
        pixels = materialize(lambda s, p, a: s | (p & a), seed, parts, around)
        edges = _whole_ball(pixels, found[ANY_COLOR], self.low, self.widths)
        return _box(edges, mask.shape[1], first=self.rows[0])


def _used_edges(pixels: Bitmap) -> tuple[jax.Array, ...]:
    """The columns of pixels, and the first and last column and row."""
    columns = bitmaps.or_rows(pixels)
    return columns, *bitmaps.columns(columns), *bitmaps.rows(bitmaps.any_of(pixels))


def _whole_ball(
    pixels: Bitmap, shown: Bitmap, low: int, widths: tuple[int, int]
) -> tuple[jax.Array, ...]:
    """The box of pixels, extended at the sides over filled columns, at most to the ball's width."""
    used, left, right, top, bottom = materialize(_used_edges, pixels)
    whole_width = jnp.where(bottom - top < low, *widths)
    row = np.arange(pixels.shape[1])[:, None]
    inside = (row >= top[None]) & (row <= bottom[None])
    filled = materialize(lambda s, i: ~bitmaps.or_rows(jnp.where(i[None], ~s, U(0))), shown, inside)
    reach_left = right + 1 - whole_width
    reach_right = left + whole_width
    near = bitmaps.columns_between(reach_left[None], reach_right[None])[:, 0]
    first, last = bitmaps.columns((filled & near) | used)
    fits = last - first < whole_width
    return jnp.where(fits, first, left), top, jnp.where(fits, last, right) + 1, bottom + 1


def _near_edges(seed: Bitmap, across: int, down: int) -> tuple[jax.Array, ...]:
    """The edges of the box of pixels and their surroundings; without pixels, of all."""
    _, first, last, upper, lower = _used_edges(seed)
    none = last < 0
    left = jnp.where(none, 0, first - across)
    top = jnp.where(none, 0, upper - down)
    right = jnp.where(none, WIDTH, last + across + 1)
    return left, top, right, jnp.where(none, seed.shape[1], lower + down + 1)


def _box(edges: Sequence[jax.Array] | jax.Array, height: int, first: int = 0) -> Bitmap:
    """All pixels of a box; its rows count from `first`."""
    left, top, right, bottom = edges
    row = np.arange(-first, height - first)[:, None]
    inside = (row >= top[None]) & (row < bottom[None])
    ink = materialize(bitmaps.columns_between, left[None], right[None], small=0)
    return jnp.where(inside[None], ink, U(0))


def _opened(pixels: Bitmap, size: tuple[int, int]) -> Bitmap:
    """The pixels of filled rectangles of a size."""
    corners = materialize(lambda p: bitmaps.all_within(p, *size), pixels)
    return bitmaps.any_within(corners, *size)


def _has_any(pixels: Bitmap) -> jax.Array:
    """True if any pixel is set, bool `[1, 1, B]`."""
    return (bitmaps.any_of(bitmaps.or_rows(pixels)) != 0)[None, None]


@dataclass(frozen=True)
class InBox:
    """The box of one of the figures."""

    name: str

    def __call__(self, mask: Bitmap, found: dict[str, jax.Array]) -> Bitmap:
        """All pixels of the box."""
        return _box(found[self.name], mask.shape[1])
