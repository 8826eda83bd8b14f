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
    """Stack all masks, with an empty row above each, and connect the parts of components.

    Returns:
        uint32 `[words, rows, lanes]`.
    """
    size = layout.board
    begins = size.begins.tolist()
    board = jnp.zeros((size.words, size.rows, size.lanes), U)
    for i, begin in zip(layout.order, begins, strict=False):
        board = lax.dynamic_update_slice(board, masks[i], (0, begin + 1, 0))
    parts = zip(layout.gaps, itertools.pairwise(begins), strict=True)
    for gap, neighbours in itertools.groupby(parts, key=lambda part: part[0]):
        if gap != (0, 0):
            spans = [span for _, span in neighbours]
            board = _bridged(board, spans[0][0], spans[-1][1], gap)
    return board


def _bridged(board: Bitmap, first: int, end: int, gap: tuple[int, int]) -> Bitmap:
    """Close the gaps between the parts of components in some rows of the board."""
    bridged = materialize(lambda board: bm.stretched(board[:, first:end], gap), board)
    return lax.dynamic_update_slice(board, bridged, (0, first, 0))
