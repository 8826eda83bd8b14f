"""Connected components of bitmaps, with exact bounding boxes, for a whole batch.

All masks of a game are stacked on one board and searched together. Each stage has a file:

1. `board` stacks the masks and bridges gaps within components.
2. `candidates` finds pixels where components may begin: a component's first pixel in raster order
starts a run that touches no pixel in the row above. Words are tested independently, so some
candidates are false positives (dropped in stage 3). Candidates are numbered by mask, by frame, and
in raster order; `Index.locate` finds the k-th one.
3. `measuring` cuts out a small window of the board around each of a fixed number of candidates.
Sweeps down and up fill the component, which is then measured. A candidate that is not the first
pixel of its component is dropped: a component with two horns has two candidates.
4. `boxes` accepts components within the limits of their search, each as one object, or as several
if the search splits components.
5. `slots` assigns objects to slots.

Stages 2 to 5 repeat until no candidate is left, so the result is exact for any mask.

A component that leaves its window is larger than the shapes of its search, and is dropped.

Terms that the stages share:

- mask: a bitmap of one search; word: 32 pixels of a row; lane: a batch entry (a frame).
- segment: one mask of one frame, numbered mask * lanes + lane.
- round: one loop iteration, over a fixed number of candidates.
- head: the column of a component's first pixel.
- part: one of the objects of a component that is split.

Rejected alternatives, in microseconds per frame for a game's complete VEM on one core:

- Eight candidates of every frame at a time: 240 for Asteroids (now 29), 50 for Space Invaders (22).
  One crowded frame keeps all others waiting.
- Candidates located inside the kernel that cuts windows: 81 instead of 41 for Asteroids.
- One search per category: 5 before it finds anything, and 1 to 2 seconds of compilation each.
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
from ocjax.vision.components.boxes import accept, boxes, parted
from ocjax.vision.components.candidates import Candidates, Index
from ocjax.vision.components.layout import Layout
from ocjax.vision.components.measuring import measure, offsets
from ocjax.vision.components.search import Search
from ocjax.vision.components.slots import Found, fill_slots
from ocjax.vision.detected import Detected


class _Progress(NamedTuple):
    done: jax.Array  # int32: candidates processed
    totals: jax.Array  # int32 [masks, lanes]: objects
    # uint32 [slots, lanes]: boxes as words, 0 for empty slots, and heads if requested
    slots: tuple[jax.Array, ...]


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
    """
    layout = Layout.of(masks, searches)
    board = boards.stacked(layout, masks)
    index = Index(layout, board)
    none = jnp.zeros((layout.board.masks, layout.board.lanes), jnp.int32)
    empty = (jnp.zeros((layout.counts.sum(), layout.board.lanes), U),) * (1 + heads)
    progress = varying(_Progress(jnp.int32(0), none, empty), board)
    progress = lax.while_loop(
        lambda p: p.done < index.total, lambda p: _one_round(layout, board, index, p), progress
    )
    return _detected(layout, searches, progress)


def _one_round(layout: Layout, board: Bitmap, index: Index, progress: _Progress) -> _Progress:

    def locate(k: jax.Array) -> tuple[Candidates, jax.Array]:
        found = index.locate(k)
        return found, offsets(layout, found)

    k = progress.done + jnp.arange(layout.n_candidates, dtype=jnp.int32)
    exists = k < index.total
    found, offset = materialize(locate, k, small=0)
    entries = layout.look_up(found.segment // layout.board.lanes)
    measured, filled = measure(layout, board, found, offset, entries.corners.astype(U))
    accepted = accept(layout, found, measured, entries, exists)
    parts = boxes(layout, accepted)
    if layout.pictures:
        accepted, parts = parted(layout, found, accepted, parts, filled, entries)
    # The first candidate of each segment in this round.
    begins = jnp.clip(index.segments - progress.done, 0, layout.n_candidates)
    objects = Found(begins, accepted.parts, parts, found.column)
    totals, slots = fill_slots(layout.counts, objects, progress.totals, progress.slots)
    return _Progress(progress.done + layout.n_candidates, totals, slots)


def _detected(layout: Layout, searches: Sequence[Search], progress: _Progress) -> list[Detected]:
    overflow = jnp.maximum(progress.totals - layout.counts[:, None], 0)
    ends = np.cumsum(layout.counts).tolist()
    found = {}
    for i, count, end, more in zip(
        layout.order, layout.counts.tolist(), ends, overflow, strict=True
    ):
        box, *columns = (field[end - count : end] for field in progress.slots)
        head = columns[0].astype(jnp.int32) if columns and not searches[i].splits else None
        found[i] = Detected(box, head=head, overflow=more)
    return [found[i] for i in range(len(searches))]
