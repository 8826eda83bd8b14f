"""Connected components of bitmaps, with exact bounding boxes, for a whole batch at once.

All masks of a game are stacked into one board, one below the other, and searched together. Each
stage has a file:

1. `board`: the masks are stacked, and gaps within components are bridged.
2. `candidates`: a component's first pixel in raster order starts a run of a row that touches
   nothing in the row above. A few word operations find all such pixels of a batch. They judge words
   one by one, which finds a few pixels too many. Each pixel found is a candidate. Candidates are
   numbered mask by mask, frame by frame, in raster order; `Index.locate` finds the k-th one.
3. `measuring`: the board around each of a fixed number of candidates is cut out as a small window.
   The component is filled there by sweeps down and up over the rows of the window, and measured. A
   candidate that is not the first pixel of its component is dropped: a component with two horns has
   two candidates.
4. `boxes`: a component within the limits of its search is an object, or several objects if the
    search splits components.
5. `slots`: objects go to their slots.

Stages 2 to 5 repeat until no candidate is left, so the result is exact for any mask.

A component that leaves its window is larger than the `max_size` of its search, so it is no object.
If a search has no such limit, these components are filled again on the whole board, one of each
frame at a time (`measuring.measure_large`). This is exact for spirals too, but slower.

Words that the stages share:

- mask: a bitmap of one search; word: 32 pixels of a row; lane: a frame of the batch.
- segment: one mask of one frame, numbered mask * lanes + lane.
- round: the search of so many candidates as fit in one call.
- head: the column of a component's first pixel.
- part: one of the objects that a component is split into.

Alternatives that were measured, in microseconds a frame on one core for the whole of a game's VEM
(`benchmarks/vision.py` times the present kernels). Eight candidates of every frame at a time, for
as many rounds as the frame with the most candidates needs: 240 for Asteroids (now 29), 120 for Beam
Rider (26), 100 for Battle Zone (24), 50 for Space Invaders (22), because one crowded frame keeps
all others waiting. Candidates located inside the kernel that cuts windows: 81 instead of 41 for
Asteroids, because every word of every window locates its candidate again. One search per category:
5 before it finds anything, and 1 to 2 seconds of compilation each. The words of a row stacked while
they are filled: 46 instead of 33 for Asteroids, because what they share is computed once for each.
"""

from __future__ import annotations

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
from ocjax.vision.components.measuring import measure, measure_large, offsets
from ocjax.vision.components.search import Search
from ocjax.vision.components.slots import Found, fill_slots
from ocjax.vision.detected import Detected


class _Progress(NamedTuple):
    """What the rounds have found so far."""

    done: jax.Array  # int32: candidates looked at
    totals: jax.Array  # int32 [masks, lanes]: objects
    slots: tuple[
        jax.Array, ...
    ]  # uint32 [slots, lanes]: boxes as words, 0 where there is none, and heads if asked for


def components(
    masks: Sequence[Bitmap], searches: Sequence[Search], *, heads: bool = False
) -> list[Detected]:
    """Bounding boxes of the connected components of several masks, found together.

    Args:
        masks: bitmaps of equal numbers of words and frames; the numbers of rows may differ.
        searches: what to look for in each mask.
        heads: whether to return the column of each object's first pixel (`Detected.head`), too;
            searches that split components have none.

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
    """The stages from the candidates to the slots, for the next candidates."""

    def locate(k: jax.Array) -> tuple[Candidates, jax.Array]:
        found = index.locate(k)
        return found, offsets(layout, found)

    k = progress.done + jnp.arange(layout.n_candidates, dtype=jnp.int32)
    exists = k < index.total
    found, offset = materialize(locate, k, small=0)
    entries = layout.look_up(found.segment // layout.board.lanes)
    measured, filled = measure(layout, board, found, offset, entries.corners.astype(U))
    if layout.unlimited:
        measured = measure_large(
            layout, board, found, measured, exists & measured.own & (entries.unlimited > 0)
        )
    accepted = accept(layout, found, measured, entries, exists)
    parts = boxes(layout, accepted)
    if layout.pictures:
        accepted, parts = parted(layout, found, accepted, parts, filled, entries)
    begins = jnp.clip(
        index.segments - progress.done, 0, layout.n_candidates
    )  # the first candidate of each segment, in this round
    objects = Found(begins, accepted.parts, parts, found.column)
    totals, slots = fill_slots(layout.counts, objects, progress.totals, progress.slots)
    return _Progress(progress.done + layout.n_candidates, totals, slots)


def _detected(layout: Layout, searches: Sequence[Search], progress: _Progress) -> list[Detected]:
    """The objects of each search, in the order of the searches."""
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
