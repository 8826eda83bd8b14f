"""Connected components of bitmaps, with exact bounding boxes, for a whole batch at once.

All masks of a game are stacked into one board, one below the other, and searched together:

1. `_starts`: a component's first pixel in raster order starts a run of a row that touches nothing in the row above. A few word operations
   find all such pixels of a batch: an addition whose carry runs through a run and stops where the row above touches. Words are judged
   one by one, which finds a few pixels too many. Each pixel found is a candidate.
2. `_Index`: candidates are numbered mask by mask, frame by frame, in raster order; `locate` finds the k-th one.
3. `_windows`, `fill`: the mask around each of a fixed number of candidates is cut out as a small window, and the component is filled
   there by sweeps down and up over the window's rows. `_measure` takes its extent. A candidate that is not the first pixel of what it
   filled is dropped: a component with two horns has two candidates.
4. `_accept`, `_write`: components within the rule's limits go to their slots.
5. Steps 2-4 repeat until no candidate is left, so the result is exact for any mask.

A component that leaves its window is larger than the rule's `max_size`, hence no object. Without such a limit those that leave a window of
the default size are filled again on the whole frame, one of each frame at a time (`_measure_large`): exact for spirals too, but slower.

Alternatives that were measured, in microseconds a frame on one core for the whole of a game's VEM (`benchmarks/vision.py` times the
present kernels). Eight candidates of every frame at a time, for as many rounds as the frame with the most candidates needs: 240 for
Asteroids (now 33), 120 for Beam Rider (29), 100 for Battle Zone (24), 50 for Space Invaders (22), because one crowded frame keeps
all others waiting. Candidates located inside the kernel that cuts windows: 81 instead of 41 for Asteroids, because every word of every
window locates its candidate again. One search per category: 5 before it finds anything, and 1 to 2 seconds of compilation each. The words
of a row stacked while they are filled: 46 instead of 33 for Asteroids, because what they share is computed once for each.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla import materialize, varying
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.fill import extent, fill, fill_large
from ocjax.vision.search import MAX_AREA, MAX_PARTS, NOTHING, UNLIMITED, Search

BLOCK = 8  # rows that candidates are counted in
MIN_CANDIDATES, CANDIDATES_PER_FRAME = 32, 8  # candidates of a round: at least, and for each frame


class Detected(NamedTuple):
    """What VEM finds of one category or in one mask, one entry per slot, batch last; `Objects` are made of these."""

    x: jax.Array  # int32 [count, B]
    y: jax.Array  # int32 [count, B]
    w: jax.Array  # int32 [count, B]
    h: jax.Array  # int32 [count, B]
    valid: jax.Array  # bool [count, B]
    value: jax.Array | None = None  # int32 [count, B]; None: 0
    color: jax.Array | None = None  # int32 [count, B], palette indices; None: the category's colour
    overflow: jax.Array | None = None  # int32 [B], objects for which there was no slot; None: 0


# ------------------------------------------------------------------------------------------------------------ the board


class _Layout:
    """Where masks lie on the board, and the sizes that follow from what is searched for; all static."""

    def __init__(self, masks: Sequence[Bitmap], searches: Sequence[Search]) -> None:
        self.searches = searches
        self.lanes = masks[0].shape[2]
        self.reach_x = max(s.window[0] + s.gap[0] for s in searches)
        self.reach_y = max(s.window[1] + s.gap[1] for s in searches)
        self.n_words = masks[0].shape[0] + any(s.gap[0] for s in searches)
        heights = [-(-(m.shape[1] + s.gap[1] + 1) // BLOCK) * BLOCK for m, s in zip(masks, searches, strict=True)]
        self.begins = np.cumsum([0, *heights])  # first row of each mask's part; an empty row separates parts
        self.n_rows = int(self.begins[-1]) + self.reach_y + 1
        self.window_words = -(-(2 * self.reach_x + 1) // 32)
        self.n_candidates = max(MIN_CANDIDATES, CANDIDATES_PER_FRAME * self.lanes)
        self.first_slot = np.cumsum([0, *(s.count for s in searches)])

        self.corners = [bm.ALL if s.connectivity == 8 else ~bm.ALL for s in searches]  # whether corners connect: all bits set, or none

    def of(self, mask: jax.Array, table: Sequence[int] | np.ndarray) -> jax.Array:
        """The entry of each candidate's mask in a table with one entry per mask."""
        values = np.asarray(table, np.int32)
        return jnp.asarray(values)[mask] if len(set(values.tolist())) > 1 else jnp.full_like(mask, values[0])

    def pairs_of(self, mask: jax.Array, table: Sequence[tuple[int, int]]) -> tuple[jax.Array, jax.Array]:
        """The same for pairs."""
        return self.of(mask, [a for a, _ in table]), self.of(mask, [b for _, b in table])

    def corners_of(self, mask: jax.Array) -> jax.Array:
        """Whether corners connect in each candidate's mask: words with all bits set, or none."""
        return self.of(mask, np.array(self.corners).view(np.int32)).astype(U)

    def corners_by_row(self) -> np.ndarray:
        """The same for each row of the board, uint32 `[1, rows, 1]`."""
        heights = np.diff([*self.begins[:-1], self.n_rows])
        return np.repeat(np.array(self.corners), heights)[None, :, None]


def _bridged(mask: Bitmap, dx: int, dy: int) -> Bitmap:
    """Every pixel spread dx to the right and dy down, so that parts at most (dx, dy) apart connect; `mask` has room for it."""
    for distance, shift in ((dx, bm.shift_right), (dy, bm.shift_down)):
        n = 1
        while n <= distance:
            mask, n = mask | shift(mask, min(n, distance - n + 1)), 2 * n
    return mask


def _board(layout: _Layout, masks: Sequence[Bitmap]) -> Bitmap:
    """All masks, one below the other, with an empty row above each.

    Spread to the right and down, the parts of a component connect, its first pixel stays, and its box grows by its rule's `gap`.
    """
    board = jnp.zeros((layout.n_words, layout.n_rows, layout.lanes), U)
    for mask, search, begin in zip(masks, layout.searches, layout.begins.tolist(), strict=False):
        if search.gap != (0, 0):
            room = jnp.pad(mask, ((0, layout.n_words - len(mask)), (0, search.gap[1]), (0, 0)))
            mask = _bridged(room, *search.gap)
        board = lax.dynamic_update_slice(board, mask, (0, begin + 1, 0))
    return board


def _starts(board: Bitmap, corners: np.ndarray = bm.ALL) -> Bitmap:
    """First pixels of runs that nothing in the row above touches, judged word by word; a bitmap without the first row.

    Args:
        board: bitmap `[words, rows, lanes]`.
        corners: words with all bits set where pixels touch at their corners, too, uint32 that broadcasts to `[words, rows - 1, lanes]`.
    """
    here, above = board[:, 1:], board[:, :-1]
    above = above | (((above << 1) | (above >> 1)) & corners)
    free = here & ~above
    total = free + (free & ~(here << 1))  # the carry goes from the last pixel of a free run to the left of its first
    first = ((total & ~here) >> 1) | jnp.where(total < free, U(1 << 31), U(0))
    continues = jnp.pad(here[:-1] << 31, ((1, 0), (0, 0), (0, 0)))
    return first & ~continues


# ------------------------------------------------------------------------------------------------------------ candidates


class _Candidates(NamedTuple):
    """Some candidates, int32 `[n]` each."""

    segment: jax.Array  # mask * lanes + lane
    row: jax.Array  # of the board
    column: jax.Array


class _Index:
    """Candidates in order: counts by row, by block of rows, and by segment (one mask of one frame)."""

    def __init__(self, layout: _Layout, board: Bitmap) -> None:
        self.layout = layout
        searched = int(layout.begins[-1]) + 1
        starts = materialize(lambda b: _starts(b[:, :searched], layout.corners_by_row()[:, 1:searched]), board)
        counts = jnp.sum(bm.popcount(starts), axis=0, dtype=jnp.int32)
        blocks = jnp.sum(counts.reshape(-1, BLOCK, layout.lanes), axis=1, dtype=jnp.int32)
        above = jnp.pad(jnp.cumsum(blocks, axis=0), ((1, 0), (0, 0)))  # candidates above each block
        ends = above[layout.begins // BLOCK]
        self.segments = jnp.pad(jnp.cumsum((ends[1:] - ends[:-1]).ravel()), (1, 0))  # candidates before each segment
        self.total = self.segments[-1]
        self.n_blocks, self.n_rows = len(blocks), starts.shape[1]
        self._starts, self._counts, self._above, self._ends = (v.ravel() for v in (starts, counts, above, ends))

    def locate(self, k: jax.Array) -> _Candidates:
        """The k-th candidates; in range even where there are fewer."""
        lanes = self.layout.lanes
        segment = _last_at_most(lambda i: _at(self.segments, i), len(self.layout.searches) * lanes, k)
        lane = segment % lanes
        rest = k - _at(self.segments, segment) + _at(self._ends, segment)
        block = _last_at_most(lambda i: _at(self._above, i * lanes + lane[None]), self.n_blocks, rest)
        rest = rest - _at(self._above, block * lanes + lane)
        rows = (block * BLOCK)[None] + np.arange(BLOCK, dtype=np.int32)[:, None]
        row, rest = _which(_at(self._counts, rows * lanes + lane[None]), rest)
        row = block * BLOCK + row
        first = np.arange(self.layout.n_words, dtype=np.int32)[:, None] * self.n_rows
        words = _at(self._starts, (first + row[None]) * lanes + lane[None])
        index, rest = _which(bm.popcount(words), rest)
        word = jnp.sum(jnp.where(np.arange(len(words), dtype=np.int32)[:, None] == index[None], words, U(0)), axis=0, dtype=U)
        return _Candidates(segment, row + 1, 32 * index + _nth_bit(word, rest))


def _at(array: jax.Array, index: jax.Array) -> jax.Array:
    """`array[index]` for indices that are known to be in range."""
    return array.at[index].get(mode="promise_in_bounds", wrap_negative_indices=False)


def _last_at_most(table: Callable[[jax.Array], jax.Array], n: int, k: jax.Array) -> jax.Array:
    """The largest i < n where `table(i) <= k`; the table is ascending and begins with nothing larger.

    Each step looks at three entries, which takes half the steps of a binary search. A loop is compiled once for all steps.
    """
    exponents = -(-(n - 1).bit_length() // 2)

    def narrow(e: jax.Array, i: jax.Array) -> jax.Array:
        step = jnp.left_shift(1, 2 * (exponents - 1 - e))
        ahead = i[None] + step * np.arange(1, 4, dtype=np.int32)[:, None]
        reached = (ahead < n) & (table(jnp.minimum(ahead, n - 1)) <= k[None])
        return i + step * jnp.sum(reached, axis=0, dtype=jnp.int32)

    return lax.fori_loop(0, exponents, narrow, jnp.zeros_like(k))


def _which(counts: jax.Array, rest: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The index at which counts `[m, n]` add up to more than `rest` `[n]`, and what is left of it there."""
    index, beyond = jnp.zeros_like(rest), jnp.ones_like(rest, bool)
    for count in counts[:-1]:
        beyond = beyond & (rest >= count)
        index, rest = index + beyond.astype(jnp.int32), rest - jnp.where(beyond, count, 0)
    return index, rest


def _nth_bit(word: jax.Array, n: jax.Array) -> jax.Array:
    """Position of the n-th set bit, counted from the most significant one."""
    bit = jnp.zeros_like(n)
    for step in (16, 8, 4, 2, 1):
        head = bm.popcount(word >> (31 - bit - step + 1).astype(U))
        bit = jnp.where(head <= n, bit + step, bit)
    return bit


# ------------------------------------------------------------------------------------------------------------ filling


def _windows(layout: _Layout, board: Bitmap, offset: jax.Array, column: jax.Array) -> jax.Array:
    """The board from the row above each candidate down, `reach_x` columns to both sides: uint32 `[rows, words, candidates]`."""
    left = column - layout.reach_x
    word, shift = (left >> 5)[None] + jnp.arange(layout.window_words + 1)[:, None], (left & 31).astype(U)
    rows = jnp.arange(layout.reach_y + 2)[:, None, None] * layout.lanes
    cut = board.ravel().at[offset[None] + rows].get(mode="promise_in_bounds")
    cut = jnp.where(((word >= 0) & (word < layout.n_words))[None], cut, U(0))
    return (cut[:, :-1] << shift[None, None]) | ((cut[:, 1:] >> 1) >> (31 - shift)[None, None])


def _offsets(layout: _Layout, found: _Candidates) -> jax.Array:
    """Where on the flat board the words of each window's first row are, int32 `[words, candidates]`."""
    word = ((found.column - layout.reach_x) >> 5)[None] + jnp.arange(layout.window_words + 1)[:, None]
    row = jnp.clip(word, 0, layout.n_words - 1) * layout.n_rows + (found.row - 1)[None]
    return row * layout.lanes + (found.segment % layout.lanes)[None]


class _Measured(NamedTuple):
    """The components of some candidates, `[n]` each."""

    own: jax.Array  # bool: the candidate is the component's first pixel
    inside: jax.Array  # bool: the component has been filled completely
    left: jax.Array  # int32: first and last column, and height
    right: jax.Array
    height: jax.Array
    area: jax.Array  # int32: pixels


def _measure(layout: _Layout, board: Bitmap, found: _Candidates, offset: jax.Array) -> _Measured:
    """Fill each candidate's component in its window."""
    reach = layout.reach_x
    cut = _windows(layout, board, offset, found.column)
    seed = jnp.zeros(cut[1:].shape, U).at[0, reach // 32].set(U(1 << (31 - reach % 32)))
    corners = layout.corners_of(found.segment // layout.lanes)
    filled = fill(cut[1:], seed & cut[1:], corners, reach)
    first, last, _, bottom, head = extent(jnp.moveaxis(filled, 1, 0))
    above = bm.any_of(bm.spread(filled[0], corners) & cut[0]) != 0
    inside = (first > 0) & (last < 2 * reach) & (bottom < layout.reach_y)
    area = jnp.sum(bm.popcount(filled), axis=(0, 1), dtype=jnp.int32)
    left, right = found.column + first - reach, found.column + last - reach
    return _Measured(~above & (head == reach), inside, left, right, bottom + 1, area)


def _measure_large(layout: _Layout, board: Bitmap, found: _Candidates, measured: _Measured, wanted: jax.Array) -> _Measured:
    """Fill the wanted candidates' components on the whole board, one candidate of each frame at a time."""
    large = wanted & ~measured.inside & (layout.of(found.segment // layout.lanes, [int(s.unlimited) for s in layout.searches]) > 0)
    lane, rows = found.segment % layout.lanes, jnp.arange(layout.n_rows)[None, :, None]

    def next_of_each_lane(state: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
        open_, own, left, right, height = state
        mine = open_[:, None] & (lane[:, None] == jnp.arange(layout.lanes)[None])
        index = jnp.argmax(mine, axis=0)
        row, column = found.row[index], found.column[index]
        bit = (U(1) << (31 - (column & 31)).astype(U))[None, None]
        words = jnp.arange(layout.n_words)[:, None, None] == (column >> 5)[None, None]
        seed = jnp.where(words & (rows == row[None, None]), bit, U(0))
        first, last, top, bottom, head = extent(fill_large(board, seed & board, layout.corners_by_row()))
        here = open_ & (index[lane] == jnp.arange(layout.n_candidates))
        own = jnp.where(here, ((top >= row) & (head == column))[lane], own)
        filled = ((first, left), (last, right), (bottom - row + 1, height))
        left, right, height = (jnp.where(here, new[lane], old) for new, old in filled)
        return open_ & ~here, own, left, right, height

    state = (large, measured.own, measured.left, measured.right, measured.height)
    _, own, left, right, height = lax.while_loop(lambda s: jnp.any(s[0]), next_of_each_lane, state)
    return _Measured(own, measured.inside | large, left, right, height, measured.area)


# ------------------------------------------------------------------------------------------------------------ results


class _Accepted(NamedTuple):
    """The boxes of some candidates' components and how many objects each of them is, int32 `[n]` each."""

    x: jax.Array
    y: jax.Array
    w: jax.Array
    h: jax.Array
    part_w: jax.Array  # size of one object of a component that is split
    part_h: jax.Array
    across: jax.Array  # objects side by side
    parts: jax.Array  # objects in all; 0: the component is none


def _accept(layout: _Layout, found: _Candidates, measured: _Measured, exists: jax.Array) -> _Accepted:
    """Apply the limits of each candidate's search."""
    mask, searches = found.segment // layout.lanes, layout.searches
    dx, dy = layout.pairs_of(mask, [s.gap for s in searches])
    w, h = measured.right - measured.left + 1 - dx, measured.height - dy
    part_w = part_h = jnp.full_like(w, UNLIMITED)
    good = jnp.zeros_like(exists)
    for limits in reversed(list(itertools.zip_longest(*(s.alternatives for s in searches), fillvalue=NOTHING))):
        met = _meets(layout, mask, limits, w, h, measured.area)
        size = layout.pairs_of(mask, [s.split or (UNLIMITED, UNLIMITED) for s in limits])
        part_w, part_h = (jnp.where(met, new, old) for new, old in zip(size, (part_w, part_h), strict=True))
        good = good | met
    good = good & exists & measured.own & measured.inside
    across = jnp.clip(-(-w // part_w), 1, MAX_PARTS)
    down = jnp.clip(-(-h // part_h), 1, MAX_PARTS // across)
    y = found.row - 1 - layout.of(mask, [begin - s.top for begin, s in zip(layout.begins[:-1].tolist(), searches, strict=True)])
    return _Accepted(measured.left, y, w, h, part_w, part_h, across, jnp.where(good, across * down, 0))


def _meets(layout: _Layout, mask: jax.Array, limits: Sequence[Search], w: jax.Array, h: jax.Array, area: jax.Array) -> jax.Array:
    """Whether components are within the limits of their masks."""
    least_w, least_h = layout.pairs_of(mask, [s.min_size for s in limits])
    most_w, most_h = layout.pairs_of(mask, [s.max_size or (UNLIMITED, UNLIMITED) for s in limits])
    met = (w >= least_w) & (h >= least_h) & (w <= most_w) & (h <= most_h)
    if not any(s.area for s in limits):
        return met
    least, most = layout.pairs_of(mask, [s.area or (0, MAX_AREA) for s in limits])
    return met & (area >= least) & (area <= most)


def _parts(layout: _Layout, a: _Accepted) -> list[jax.Array]:
    """The boxes of each component's objects, evenly spaced from edge to edge: x, y, w, h in a byte each, uint32 `[n]`."""
    out = []
    down = jnp.maximum(a.parts // a.across, 1)
    for p in range(MAX_PARTS if any(a.split for s in layout.searches for a in s.alternatives) else 1):
        column, row = p % a.across, p // a.across
        x = a.x + column * (a.w - a.part_w) // jnp.maximum(a.across - 1, 1)
        y = a.y + row * (a.h - a.part_h) // jnp.maximum(down - 1, 1)
        w, h = jnp.where(a.across > 1, a.part_w, a.w), jnp.where(down > 1, a.part_h, a.h)
        out.append(x.astype(U) | (y.astype(U) << 8) | (w.astype(U) << 16) | (h.astype(U) << 24))
    return out


class _Progress(NamedTuple):
    """What the rounds have found so far."""

    done: jax.Array  # int32: candidates looked at
    totals: jax.Array  # int32 [segments]: objects of each mask and frame
    packed: jax.Array  # uint32 [slots * lanes]: boxes, 0 where there is none


def _write(layout: _Layout, index: _Index, found: _Candidates, accepted: _Accepted, so_far: _Progress) -> _Progress:
    """Put accepted objects into their slots, in the candidates' order."""
    lanes = layout.lanes
    mask, lane = found.segment // lanes, found.segment % lanes
    before = jnp.cumsum(accepted.parts) - accepted.parts
    first_of_segment = jnp.maximum(index.segments[found.segment] - so_far.done, 0)
    rank = so_far.totals[found.segment] + before - before[first_of_segment]
    count, base = layout.of(mask, [s.count for s in layout.searches]), layout.of(mask, layout.first_slot[:-1])
    packed = so_far.packed
    for p, entry in enumerate(_parts(layout, accepted)):
        has_slot = (p < accepted.parts) & (rank + p < count)
        slot = jnp.where(has_slot, (base + rank + p) * lanes + lane, packed.size)
        packed = packed.at[slot].set(entry, mode="drop")
    totals = so_far.totals.at[found.segment].add(accepted.parts)
    return _Progress(so_far.done + layout.n_candidates, totals, packed)


def components(masks: Sequence[Bitmap], searches: Sequence[Search]) -> list[Detected]:
    """Bounding boxes of the connected components of several masks, found together.

    Args:
        masks: bitmaps of equal numbers of words and frames; the numbers of rows may differ.
        searches: what to look for in each mask.

    Returns:
        The boxes in each mask, in raster order of the components' first pixels.
    """
    layout = _Layout(masks, searches)
    board = _board(layout, masks)
    index = _Index(layout, board)

    def locate(k: jax.Array) -> tuple[_Candidates, jax.Array]:
        found = index.locate(k)
        return found, _offsets(layout, found)

    def one_round(so_far: _Progress) -> _Progress:
        k = so_far.done + jnp.arange(layout.n_candidates, dtype=jnp.int32)
        found, offset = materialize(locate, k, small=0)
        exists = k < index.total
        measured = _measure(layout, board, found, offset)
        if any(s.unlimited for s in searches):
            measured = _measure_large(layout, board, found, measured, exists & measured.own)
        return _write(layout, index, found, _accept(layout, found, measured, exists), so_far)

    n_segments, n_slots = len(masks) * layout.lanes, int(layout.first_slot[-1])
    start = _Progress(jnp.int32(0), jnp.zeros(n_segments, jnp.int32), jnp.zeros(n_slots * layout.lanes, U))
    _, totals, packed = lax.while_loop(lambda s: s.done < index.total, one_round, varying(start, board))
    packed, totals = packed.reshape(-1, layout.lanes), totals.reshape(-1, layout.lanes)
    fields = [(packed >> shift & U(255)).astype(jnp.int32) for shift in (0, 8, 16, 24)]
    fields.append(packed > 0)
    out = []
    for total, (a, b) in zip(totals, itertools.pairwise(layout.first_slot.tolist()), strict=True):
        x, y, w, h, valid = (v[a:b] for v in fields)
        out.append(Detected(x, y, w, h, valid, overflow=total - jnp.sum(valid, axis=0, dtype=jnp.int32)))
    return out
