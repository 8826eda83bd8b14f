"""Flood fill: the components of bitmaps that hold given pixels, and their extents."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla.kernels import materialize, varying
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import U


def fill(
    mask: jax.Array, seed: jax.Array, corners: jax.Array | np.ndarray = bm.ALL, reach: int = 31
) -> jax.Array:
    """Fill the components of `mask` that hold pixels of `seed`, a part of the mask.

    Args:
        mask: uint32 `[rows, words, ...]`.
        corners: all bits set if pixels that touch at a corner connect.
        reach: minimum distance that a sweep fills runs to both sides, in pixels.
    """
    rows = _depth(mask)
    has_one_word = mask.shape[1] == 1
    touched = functools.partial(_touched, corners)

    def row_at(step: jax.Array) -> jax.Array:
        return jnp.minimum(step, 2 * rows - 1 - step)  # down and up again

    def row_of(bitmap: jax.Array, step: jax.Array) -> jax.Array:
        return lax.dynamic_index_in_dim(bitmap, row_at(step), keepdims=False)

    def fill_row(
        step: jax.Array, state: tuple[jax.Array, tuple[jax.Array, ...]]
    ) -> tuple[jax.Array, tuple[jax.Array, ...]]:
        """Fill a row of the state: the filled rows, and the words of the previous row."""
        filled, previous = state
        own_mask, own_filled = row_of(mask, step), row_of(filled, step)
        if has_one_word:
            # A single word is read again instead: XLA would replace it in the state in place,
            # without vectorising. At the first step and at the turn this is the row itself.
            above = row_of(filled, jnp.maximum(step - 1, 0))
            seeds = touched(own_filled, own_mask, *above)
        else:
            # Materialized: XLA would compute a word again for each word filled from it (James Bond:
            # 109 us per frame instead of 62).
            seeds = materialize(touched, own_filled, own_mask, *previous, small=0)
        now = bm.fill_rows(own_mask, seeds, reach)
        filled = lax.dynamic_update_index_in_dim(filled, jnp.stack(now), row_at(step), 0)
        return filled, () if has_one_word else now

    def down_and_up(state: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        none = () if has_one_word else tuple(jnp.zeros_like(seed[0]))
        filled, _ = lax.fori_loop(0, 2 * rows, fill_row, (state[0], none))
        return filled, _is_incomplete(filled, mask, corners)

    return lax.while_loop(
        lambda state: state[1], down_and_up, (seed, varying(jnp.bool_(True), seed))
    )[0]


def _touched(
    corners: jax.Array | np.ndarray, filled: jax.Array, mask: jax.Array, *above: jax.Array
) -> list[jax.Array]:
    """Select a row's pixels that are filled or touch the row before, one array per word."""
    return [
        f | (m & near)
        for f, m, near in zip(filled, mask, bm.spread_words(above, corners), strict=True)
    ]


def _is_incomplete(
    filled: jax.Array, mask: jax.Array, corners: jax.Array | np.ndarray
) -> jax.Array:
    """Whether a filled pixel touches a blank one below; after a sweep up, none is above."""
    own, inside = ([a[:, i] for i in range(mask.shape[1])] for a in (filled, mask))
    near = bm.spread_words([f[:-1] for f in own], corners)
    missing = bm.any_of(a & m[1:] & ~f[1:] for a, m, f in zip(near, inside, own, strict=True))
    return jnp.any(missing != 0)


def _depth(mask: jax.Array) -> jax.Array:
    """Maximum number of rows of a component: those above the first empty row, int32."""
    empty = bm.any_of(jnp.moveaxis(mask, 1, 0)) == 0
    rows = jnp.arange(len(mask), dtype=jnp.int32).reshape(-1, *([1] * (empty.ndim - 1)))
    return jnp.max(jnp.min(jnp.where(empty, rows, len(mask)), axis=0))


def extent(filled: jax.Array) -> tuple[jax.Array, ...]:
    """Find first and last column, first and last row of components, uint32 `[words, rows, ...]`."""
    used = bm.any_of(filled) != 0
    rows = jnp.arange(len(used), dtype=jnp.int32).reshape(-1, *([1] * (used.ndim - 1)))
    bottom = jnp.max(jnp.where(used, rows, -1), axis=0)
    top = jnp.min(jnp.where(used, rows, len(used)), axis=0)
    return *bm.columns(lax.reduce(filled, U(0), lax.bitwise_or, (1,))), top, bottom
