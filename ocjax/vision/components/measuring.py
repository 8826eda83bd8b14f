"""Third stage: fill and measure the component of each candidate."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.components.candidates import Candidates
from ocjax.vision.components.fill import extent, fill
from ocjax.vision.components.layout import Layout


def _window_words(layout: Layout, column: jax.Array) -> jax.Array:
    """Word columns of the board that hold each candidate's window, int32 `[words, candidates]`.

    They may be outside of the board.
    """
    first = (column - layout.window.before - 1) >> 5
    return first[None] + jnp.arange(layout.window.words + 1)[:, None]


def _windows(
    layout: Layout, board: Bitmap, offset: jax.Array, column: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Cut out windows that begin `before` columns left of each candidate and one row above it.

    Returns:
        The windows, uint32 `[rows, words, candidates]`, and the column left of each window, in the
        highest bit of uint32 `[rows, candidates]`.
    """
    word = _window_words(layout, column)
    shift = (column - layout.window.before - 1 & 31).astype(U)
    rows = jnp.arange(layout.window.reach_y + 2)[:, None, None] * layout.board.n_frames
    cut = board.ravel().at[offset[None] + rows].get(mode="promise_in_bounds")
    cut = jnp.where(((word >= 0) & (word < layout.board.words))[None], cut, U(0))
    windows = (cut[:, :-1] << shift[None, None] << 1) | (cut[:, 1:] >> (31 - shift)[None, None])
    return windows, cut[:, 0] << shift[None]


def offsets(layout: Layout, candidates: Candidates) -> jax.Array:
    """Offsets of each window's first row on the flat board, int32 `[words, candidates]`.

    They are materialized together with the candidates' places.
    """
    word = _window_words(layout, candidates.column)
    row = jnp.clip(word, 0, layout.board.words - 1) * layout.board.rows + (candidates.row - 1)[None]
    return row * layout.board.n_frames + (candidates.segment % layout.board.n_frames)[None]


def _leaves_left(filled: jax.Array, outside: jax.Array, corners: jax.Array) -> jax.Array:
    """Return whether components continue in the column left of their window.

    Both columns are the highest bits of uint32 `[rows, n]`.
    """
    beside = jnp.pad(filled, ((1, 1), (0, 0)))
    touched = filled | ((beside[:-2] | beside[2:]) & corners[None])
    return bm.or_rows((touched & outside)[None])[0] >> 31 != 0


class Measured(NamedTuple):
    """The components of candidates, `[n]` each."""

    is_first: jax.Array  # bool: the candidate is the component's first pixel
    is_complete: jax.Array  # bool: the window holds the whole component
    left: jax.Array  # int32: first and last column, and height
    right: jax.Array
    height: jax.Array
    area: jax.Array  # int32: pixels


def measure(
    layout: Layout, board: Bitmap, candidates: Candidates, offset: jax.Array, corners: jax.Array
) -> tuple[Measured, jax.Array]:
    """Fill each candidate's component in its window.

    Args:
        board: uint32 `[words, rows, frames]`.
        offset: see `offsets`.
        corners: words with all bits set if corners connect, or none.

    Returns:
        The measured components, and the filled windows, uint32 `[words, rows, n]`.
    """
    reach, before = layout.window.reach_x, layout.window.before
    with_row_above, outside = _windows(layout, board, offset, candidates.column)
    windows = with_row_above[1:]
    seed = jnp.zeros(windows.shape, U).at[0, before // 32].set(U(1 << (31 - before % 32)))
    filled = fill(windows, seed & windows, corners, reach)
    by_word = jnp.moveaxis(filled, 1, 0)
    first, last, _, bottom = extent(by_word)
    head, _ = bm.columns(filled[0])
    near = bm.spread_words(list(filled[0]), corners)
    above = bm.any_of(a & b for a, b in zip(near, with_row_above[0], strict=True)) != 0
    is_first = ~above & (head == before)
    leaves = (
        first == 0 if layout.window.has_margin else _leaves_left(filled[:, 0], outside[1:], corners)
    )
    is_complete = ~leaves & (last < before + reach) & (bottom < layout.window.reach_y)
    left = candidates.column + first - before
    right = candidates.column + last - before
    area = jnp.sum(bm.popcount(filled), axis=(0, 1), dtype=jnp.int32)
    return Measured(is_first, is_complete, left, right, bottom + 1, area), by_word
