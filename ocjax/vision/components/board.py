"""First stage: the board, which holds all masks of a game."""

import itertools
from collections.abc import Sequence

import jax.numpy as jnp
from jax import lax

from ocjax._xla.kernels import materialize
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.components.layout import Layout


def stacked(layout: Layout, masks: Sequence[Bitmap]) -> Bitmap:
    """Stack all masks, with an empty row above each, and bridge the gaps within components.

    Returns:
        uint32 `[words, rows, frames]`.
    """
    size = layout.board
    begins = size.begins.tolist()
    board = jnp.zeros((size.words, size.rows, size.n_frames), U)
    for i, begin in zip(layout.order, begins, strict=False):
        board = lax.dynamic_update_slice(board, masks[i], (0, begin + 1, 0))
    spans = zip(layout.gaps, itertools.pairwise(begins), strict=True)
    for gap, neighbours in itertools.groupby(spans, key=lambda span: span[0]):
        if gap != (0, 0):
            rows = [span for _, span in neighbours]
            board = _bridged(board, rows[0][0], rows[-1][1], gap)
    return board


def _bridged(board: Bitmap, first: int, end: int, gap: tuple[int, int]) -> Bitmap:
    """Close gaps of at most (dx, dy) blank pixels in some rows of the board."""
    bridged = materialize(lambda board: bm.stretched(board[:, first:end], gap), board)
    return lax.dynamic_update_slice(board, bridged, (0, first, 0))
