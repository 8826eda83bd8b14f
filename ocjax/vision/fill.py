"""Flood fill: the components of bitmaps that hold given pixels, and their extents."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla import varying
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U


def fill(mask: jax.Array, seed: jax.Array, corners: jax.Array | np.ndarray = bm.ALL, reach: int = 31) -> jax.Array:
    """The components of `mask` that hold pixels of `seed`, a part of it; all uint32 `[rows, words, ...]`.

    `corners` has all bits set where pixels touch at their corners, too; runs are filled to both sides at least as far as `reach`.
    """

    def sweep(filled: jax.Array, reverse: bool) -> jax.Array:
        def row(before: tuple[jax.Array, ...], here: tuple[jax.Array, jax.Array]) -> tuple[tuple[jax.Array, ...], jax.Array]:
            m, f = here
            now = bm.fill_rows(m, f | (m & bm.spread(jnp.stack(before), corners)), reach)
            return now, jnp.stack(now)

        return lax.scan(row, tuple(jnp.zeros_like(seed[0])), (mask, filled), reverse=reverse)[1]

    def down_and_up(state: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        filled = sweep(sweep(state[0], reverse=False), reverse=True)
        words, rows = jnp.moveaxis(filled, 1, 0), jnp.moveaxis(mask, 1, 0)
        missing = bm.spread(words[:, :-1], corners) & rows[:, 1:] & ~words[:, 1:]  # after a sweep up, nothing is missing upwards
        return filled, jnp.any(missing != 0)

    return lax.while_loop(lambda state: state[1], down_and_up, (seed, varying(jnp.bool_(True), seed)))[0]


def fill_large(board: Bitmap, seed: Bitmap, corners: np.ndarray = bm.ALL) -> Bitmap:
    """`fill` on the whole board, one row further in each step: less to compile, and slower."""

    def grow(state: tuple[Bitmap, jax.Array]) -> tuple[Bitmap, jax.Array]:
        filled = state[0]
        above_and_below = bm.shift_up(filled, 1) | bm.shift_down(filled, 1)
        grown = bm.fill_words(board, board & (bm.spread(filled) | bm.spread(above_and_below, corners)))
        return grown, jnp.any(grown != filled)

    return lax.while_loop(lambda state: state[1], grow, (seed, varying(jnp.bool_(True), seed)))[0]


def extent(filled: jax.Array) -> tuple[jax.Array, ...]:
    """First and last column, first and last row, and first column of the first row, of components, uint32 `[words, rows, ...]`."""
    used = bm.any_of(filled) != 0
    rows = jnp.arange(len(used), dtype=jnp.int32).reshape(-1, *([1] * (used.ndim - 1)))
    bottom = jnp.max(jnp.where(used, rows, -1), axis=0)
    top = jnp.min(jnp.where(used, rows, len(used)), axis=0)
    first, last = bm.columns(lax.reduce(filled, U(0), lax.bitwise_or, (1,)))
    head, _ = bm.columns(jnp.sum(jnp.where((rows == top[None])[None], filled, U(0)), axis=1, dtype=U))
    return first, last, top, bottom, head
