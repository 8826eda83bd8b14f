"""Flood fill: the components of bitmaps that hold given pixels, and their extents."""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla.kernels import materialize, varying
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U


def fill(
    mask: jax.Array, seed: jax.Array, corners: jax.Array | np.ndarray = bm.ALL, reach: int = 31
) -> jax.Array:
    """The components of `mask` that hold pixels of `seed`, a part of it; all uint32 `[rows, words,
    ...]`.

    `corners` has all bits set where pixels touch at their corners, too; runs are filled to both
    sides at least as far as `reach`.
    """
    words = mask.shape[1]
    rows = _depth(mask)

    def touched(filled: jax.Array, mask: jax.Array, *above: jax.Array) -> list[jax.Array]:
        """The pixels of a row that are filled or touch those of the row before, an array for each word."""
        return [
            f | (m & near)
            for f, m, near in zip(filled, mask, bm.spread_words(above, corners), strict=True)
        ]

    def row(
        step: jax.Array, state: tuple[jax.Array, tuple[jax.Array, ...]]
    ) -> tuple[jax.Array, tuple[jax.Array, ...]]:
        filled, before = state

        def at(step: jax.Array) -> jax.Array:
            return jnp.minimum(step, 2 * rows - 1 - step)  # down and up again

        m, f = (lax.dynamic_index_in_dim(a, at(step), keepdims=False) for a in (mask, filled))
        # The row before is handed on in the loop's state. A single word would be replaced there in
        # place, which XLA does not vectorise, so it is read again; at the first step and at the
        # turn that is the row itself, whose neighbours are filled anyway.
        if words == 1:
            seeds = touched(
                f,
                m,
                *lax.dynamic_index_in_dim(filled, at(jnp.maximum(step - 1, 0)), keepdims=False),
            )
        # stored, as each word would be computed again for all that are filled from it: 109 instead
        # of 62 us a frame for James Bond
        else:
            seeds = materialize(touched, f, m, *before, small=0)
        now = bm.fill_rows(m, seeds, reach)
        return lax.dynamic_update_index_in_dim(
            filled, jnp.stack(now), at(step), 0
        ), now if words > 1 else ()

    def down_and_up(state: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        filled, _ = lax.fori_loop(
            0, 2 * rows, row, (state[0], tuple(jnp.zeros_like(seed[0])) if words > 1 else ())
        )
        own, inside = ([a[:, i] for i in range(words)] for a in (filled, mask))
        near = bm.spread_words([f[:-1] for f in own], corners)
        missing = bm.any_of(a & m[1:] & ~f[1:] for a, m, f in zip(near, inside, own, strict=True))
        return filled, jnp.any(missing != 0)  # after a sweep up, nothing is missing upwards

    return lax.while_loop(
        lambda state: state[1], down_and_up, (seed, varying(jnp.bool_(True), seed))
    )[0]


def _depth(mask: jax.Array) -> jax.Array:
    """How many rows from the first one on a component may have: those above an empty row; the most of all masks, int32."""
    empty = bm.any_of(jnp.moveaxis(mask, 1, 0)) == 0
    rows = jnp.arange(len(mask), dtype=jnp.int32).reshape(-1, *([1] * (empty.ndim - 1)))
    return jnp.max(jnp.min(jnp.where(empty, rows, len(mask)), axis=0))


def fill_large(board: Bitmap, seed: Bitmap, corners: np.ndarray = bm.ALL) -> Bitmap:
    """`fill` on the whole board, with one array for all words of a row: a fifth of the code to
    compile, and slower.

    A sweep fills a run no further than into the next word.
    """
    shape = 1, board.shape[1], 1
    rows = (
        jnp.moveaxis(board, 1, 0),
        jnp.moveaxis(jnp.asarray(np.broadcast_to(corners, shape)), 1, 0),
    )

    def sweep(filled: jax.Array, reverse: bool) -> jax.Array:
        def row(before: jax.Array, here: tuple[jax.Array, ...]) -> tuple[jax.Array, jax.Array]:
            mask, own, diagonal = here
            now = bm.fill_words(mask, mask & (bm.spread(own) | bm.spread(before, diagonal)))
            return now, now

        return lax.scan(
            row, jnp.zeros_like(filled[0]), (rows[0], filled, rows[1]), reverse=reverse
        )[1]

    def down_and_up(state: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        filled = sweep(sweep(state[0], reverse=False), reverse=True)
        return filled, jnp.any(filled != state[0])

    start = jnp.moveaxis(seed, 1, 0), varying(jnp.bool_(True), seed)
    return jnp.moveaxis(lax.while_loop(lambda state: state[1], down_and_up, start)[0], 0, 1)


def extent(filled: jax.Array) -> tuple[jax.Array, ...]:
    """First and last column, first and last row of components, uint32 `[words, rows, ...]`."""
    used = bm.any_of(filled) != 0
    rows = jnp.arange(len(used), dtype=jnp.int32).reshape(-1, *([1] * (used.ndim - 1)))
    bottom = jnp.max(jnp.where(used, rows, -1), axis=0)
    top = jnp.min(jnp.where(used, rows, len(used)), axis=0)
    return *bm.columns(lax.reduce(filled, U(0), lax.bitwise_or, (1,))), top, bottom
