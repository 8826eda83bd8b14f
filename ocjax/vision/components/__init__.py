"""Connected components of bitmaps, with exact bounding boxes, for a whole batch.

All masks of a game lie on one board and are searched together. `layout` computes the sizes and the
tables that depend only on the searches. Each stage is a function from one table to the next, in a
file with the stage's name:

1. `board`: masks -> board. Stack the masks, and bridge gaps within components.
2. `candidates`: board -> `Index`, `Candidates`. Find pixels where components may begin: the first
   pixel of a run that touches no pixel in the row above. Words are tested independently, so stage 3
   drops some candidates. `Index.locate` finds the k-th candidate by mask, by frame, and in raster
   order.
3. `measuring`: `Candidates` -> `Measured`. Fill the component of each candidate in a small window
   by sweeps down and up, and measure it. Drop candidates that are not its first pixel.
4. `boxes`: `Measured` -> `Accepted`, boxes. Select the components within the limits of their
   search. `splitting` divides a component of touching objects by the objects' pictures.
5. `slots`: boxes -> slots. Give each object the next free slot of its mask.

Rounds of stages 2 to 5 take a fixed number of candidates, until none is left. A component that
leaves its window exceeds its search's shapes, and is dropped.

Terms:

- mask: a bitmap of one search. Word: 32 pixels of a row.
- segment: one mask of one frame, numbered mask * frames + frame.
- candidate: a pixel that may be the first pixel of a component in raster order.
- head: the column of a component's first pixel.
- object: a component, or one part of a component that is split.
- window: the pixels of the board around a candidate.

Rejected alternatives, in microseconds per frame of VEM on one core:

- Eight candidates of every frame at a time, so that a crowded frame keeps others waiting: 240 for
  Asteroids (now 29), 50 for Space Invaders (22).
- One search per category: 5 each before it finds anything.
- The words of a row stacked during filling: 46 instead of 33 for Asteroids.
"""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla.kernels import materialize, varying
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.components import board as boards
from ocjax.vision.components.boxes import accept, boxes, split_by_pictures
from ocjax.vision.components.candidates import Candidates, Index
from ocjax.vision.components.layout import CANDIDATES_PER_FRAME, Layout
from ocjax.vision.components.measuring import measure, offsets
from ocjax.vision.components.search import MAX_PARTS, Search
from ocjax.vision.components.slots import MAX_OBJECTS, NewObjects, Slots, fill_slots
from ocjax.vision.detected import Detected

MAX_FRAMES = MAX_OBJECTS // (CANDIDATES_PER_FRAME * MAX_PARTS)  # of a call


class _Progress(NamedTuple):
    done: jax.Array  # int32: candidates processed
    totals: jax.Array  # int32 [masks, frames]: objects
    slots: Slots


def components(
    masks: Sequence[Bitmap], searches: Sequence[Search], *, heads: bool = False
) -> list[Detected]:
    """Find the bounding boxes of the connected components of several masks together.

    Args:
        masks: bitmaps with equal numbers of words and frames.
        heads: whether to return the column of each object's first pixel (`Detected.head`), too.
            Searches that split components return none.

    Returns:
        The boxes of each search, in raster order of the components' first pixels.

    Raises:
        ValueError: there are more than `MAX_FRAMES` frames.
    """
    layout = Layout.of(masks, searches)
    if layout.board.n_frames > MAX_FRAMES:
        raise ValueError(f"expected at most {MAX_FRAMES} frames, got {layout.board.n_frames}")
    board = boards.stacked(layout, masks)
    index = Index(layout, board)
    none = jnp.zeros((layout.board.masks, layout.board.n_frames), jnp.int32)
    empty = jnp.zeros((layout.counts.sum(), layout.board.n_frames), U)
    slots = Slots(empty, empty if heads else None)
    progress = varying(_Progress(jnp.int32(0), none, slots), board)
    progress = lax.while_loop(
        lambda p: p.done < index.total, lambda p: _one_round(layout, board, index, p), progress
    )
    return _detected(layout, searches, progress)


def _one_round(layout: Layout, board: Bitmap, index: Index, progress: _Progress) -> _Progress:

    def locate(k: jax.Array) -> tuple[Candidates, jax.Array]:
        candidates = index.locate(k)
        return candidates, offsets(layout, candidates)

    k = progress.done + jnp.arange(layout.n_candidates, dtype=jnp.int32)
    exists = k < index.total
    candidates, offset = materialize(locate, k, small=0)
    entries = layout.look_up(candidates.segment // layout.board.n_frames)
    measured, filled = measure(layout, board, candidates, offset, entries.corners.astype(U))
    accepted = accept(layout, candidates, measured, entries, exists)
    objects = boxes(layout, accepted)
    if layout.pictures:
        accepted, objects = split_by_pictures(
            layout, candidates, accepted, objects, filled, entries
        )
    # The first candidate of each segment in this round.
    begins = jnp.clip(index.begins - progress.done, 0, layout.n_candidates)
    new = NewObjects(begins, accepted.n_parts, objects, candidates.column)
    totals, slots = fill_slots(layout.counts, new, progress.totals, progress.slots)
    return _Progress(progress.done + layout.n_candidates, totals, slots)


def _detected(layout: Layout, searches: Sequence[Search], progress: _Progress) -> list[Detected]:
    overflow = jnp.maximum(progress.totals - layout.counts[:, None], 0)
    ends = np.cumsum(layout.counts).tolist()
    found = {}
    for i, count, end, more in zip(
        layout.order, layout.counts.tolist(), ends, overflow, strict=True
    ):
        box, head = progress.slots
        own = slice(end - count, end)
        column = None
        if head is not None and not searches[i].splits:
            column = head[own].astype(jnp.int32)
        found[i] = Detected(box[own], head=column, overflow=more)
    return [found[i] for i in range(len(searches))]
