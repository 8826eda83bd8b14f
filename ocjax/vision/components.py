"""Connected components of bitmaps, with exact bounding boxes, for a whole batch at once.

All masks of a game are stacked into one board, one below the other, and searched together. A mask in which several rules search is there
once, and each component is measured once for all of them:

1. `_starts`: a component's first pixel in raster order starts a run of a row that touches nothing in the row above. A few word operations
   find all such pixels of a batch: an addition whose carry runs through a run and stops where the row above touches. Words are judged
   one by one, which finds a few pixels too many. Each pixel found is a candidate.
2. `_Index`: candidates are numbered mask by mask, frame by frame, in raster order; `locate` finds the k-th one.
3. `_windows`, `fill`: the mask around each of a fixed number of candidates is cut out as a small window, and the component is filled
   there by sweeps down and up over the window's rows. `_measure` takes its extent. A candidate that is not the first pixel of what it
   filled is dropped: a component with two horns has two candidates.
4. `_accept`, `_parted`, `fill_slots`: components within the rule's limits go to their slots, larger ones in parts.
5. Steps 2-4 repeat until no candidate is left, so the result is exact for any mask.

A component that leaves its window is larger than the rule's `max_size`, hence no object. Without such a limit those that leave a window of
the default size are filled again on the whole frame, one of each frame at a time (`_measure_large`): exact for spirals too, but slower.

Alternatives that were measured, in microseconds a frame on one core for the whole of a game's VEM (`benchmarks/vision.py` times the
present kernels). Eight candidates of every frame at a time, for as many rounds as the frame with the most candidates needs: 240 for
Asteroids (now 29), 120 for Beam Rider (26), 100 for Battle Zone (24), 50 for Space Invaders (22), because one crowded frame keeps
all others waiting. Candidates located inside the kernel that cuts windows: 81 instead of 41 for Asteroids, because every word of every
window locates its candidate again. One search per category: 5 before it finds anything, and 1 to 2 seconds of compilation each. The words
of a row stacked while they are filled: 46 instead of 33 for Asteroids, because what they share is computed once for each.
"""

from __future__ import annotations

import functools
import itertools
import operator
from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla.kernels import materialize, running_sum, varying
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.detected import Detected, words
from ocjax.vision.fill import extent, fill, fill_large
from ocjax.vision.layout import BLOCK, Entries, Layout
from ocjax.vision.pictures import largest
from ocjax.vision.search import MAX_PARTS, UNLIMITED, Search
from ocjax.vision.slots import Found, fill_slots
from ocjax.vision.splitting import Edges, in_two, part

# ------------------------------------------------------------------------------------------------------------ the board


def _board(layout: Layout, masks: Sequence[Bitmap]) -> Bitmap:
    """All masks, one below the other, with an empty row above each, and the parts of each component connected."""
    board = jnp.zeros((layout.n_words, layout.n_rows, layout.lanes), U)
    for mask, begin in zip(masks, layout.begins.tolist(), strict=False):
        board = lax.dynamic_update_slice(board, mask, (0, begin + 1, 0))
    parts = zip(layout.gaps, itertools.pairwise(layout.begins.tolist()), strict=True)
    for gap, neighbours in itertools.groupby(parts, key=lambda part: part[0]):
        if gap != (0, 0):
            spans = [span for _, span in neighbours]
            first, end = spans[0][0], spans[-1][1]
            bridged = materialize(lambda b, first=first, end=end, gap=gap: bm.stretched(b[:, first:end], gap), board)
            board = lax.dynamic_update_slice(board, bridged, (0, first, 0))
    return board


def _starts(here: Sequence[jax.Array], above: Sequence[jax.Array], corners: np.ndarray | jax.Array = bm.ALL) -> list[jax.Array]:
    """First pixels of runs that nothing in the row above touches, judged word by word.

    Args:
        here: the words of rows from left to right, uint32 of any shape.
        above: those of the rows above them.
        corners: words with all bits set where pixels touch at their corners, too, uint32 that broadcasts to each of them.
    """
    starts = []
    for word, over, left in zip(here, above, [None, *here], strict=False):
        free = word & ~(over | (((over << 1) | (over >> 1)) & corners))
        total = free + (free & ~(word << 1))  # the carry goes from the last pixel of a free run to the left of its first
        first = ((total & ~word) >> 1) | jnp.where(total < free, U(1 << 31), U(0))
        starts.append(first if left is None else first & ~(left << 31))
    return starts


# ------------------------------------------------------------------------------------------------------------ candidates

STARTS_BITS = 5  # for up to 16 candidates in a word
ROWS = 4  # whose counts share a word


class _Candidates(NamedTuple):
    """Some candidates, int32 `[n]` each."""

    segment: jax.Array  # mask * lanes + lane
    row: jax.Array  # of the board
    column: jax.Array


class _Index:
    """Candidates in order: counts by word of a row, by row, by block of rows, and by segment (one mask of one frame).

    Candidates are counted without being stored, and computed again around each one that is located: Gravitar takes 37 us a frame instead of
    40. Counts of words and rows are packed, so that half as many are looked up: Private Eye takes 38 us instead of 43, Berzerk 26 instead
    of 32.
    """

    def __init__(self, layout: Layout, board: Bitmap) -> None:
        self.layout = layout
        searched = int(layout.begins[-1]) + 1
        words = layout.mask_words  # a component begins in the words of its mask
        self._corners = layout.corners_by_row()[:searched]

        def in_rows(board: Bitmap) -> jax.Array:
            """The candidates in each word of a row, in a word."""
            starts = _starts(list(board[:words, 1:searched]), list(board[:words, : searched - 1]), self._corners[1:, None])
            return functools.reduce(operator.or_, (lax.population_count(word) << STARTS_BITS * i for i, word in enumerate(starts)))

        in_words = materialize(in_rows, board)
        counts = materialize(lambda in_words: _packed(_total(_fields(in_words, STARTS_BITS, words))), in_words)
        blocks = jnp.sum(_total(_fields(counts, 8, ROWS)).reshape(-1, BLOCK // ROWS, layout.lanes), axis=1, dtype=jnp.int32)
        above = jnp.pad(running_sum(blocks), ((1, 0), (0, 0)))  # candidates above each block
        ends = above[layout.begins // BLOCK]
        self.segments = jnp.pad(running_sum((ends[1:] - ends[:-1]).ravel()), (1, 0))  # candidates before each segment
        self.total = self.segments[-1]
        self.n_blocks = len(blocks)
        self._board, self._words, self._counts, self._above, self._ends = (v.ravel() for v in (board, in_words, counts, above, ends))

    def locate(self, k: jax.Array) -> _Candidates:
        """The k-th candidates; in range even where there are fewer."""
        lanes = self.layout.lanes
        mask = jnp.sum(self.segments[lanes:-1:lanes, None] <= k[None], axis=0, dtype=jnp.int32)
        first = mask * lanes
        lane = _last_at_most(lambda i: bm.at(self.segments, first + i), lanes, k)
        rest = k - bm.at(self.segments, first + lane) + bm.at(self._ends, first + lane)
        row, rest = self._row(mask, lane, rest)
        return _Candidates(first + lane, row, self._column(lane, row, rest))

    def _row(self, mask: jax.Array, lane: jax.Array, rest: jax.Array) -> tuple[jax.Array, jax.Array]:
        """The row of the board with the candidate before which there are `rest` in its lane, and how many of those are in that row."""
        lanes = self.layout.lanes
        begin = bm.at(jnp.asarray(self.layout.begins // BLOCK, jnp.int32), mask)
        most = int(np.diff(self.layout.begins).max()) // BLOCK  # of a mask
        block = begin + _last_at_most(lambda i: bm.at(self._above, jnp.minimum(begin + i, self.n_blocks) * lanes + lane), most, rest)
        block = jnp.minimum(block, self.n_blocks - 1)
        rest = rest - bm.at(self._above, block * lanes + lane)
        quads = (block * (BLOCK // ROWS))[None] + np.arange(BLOCK // ROWS, dtype=np.int32)[:, None]
        counts = bm.at(self._counts, quads * lanes + lane[None])
        row, rest = _which([count for quad in counts for count in _fields(quad, 8, ROWS)], rest)
        return block * BLOCK + row + 1, rest

    def _column(self, lane: jax.Array, row: jax.Array, rest: jax.Array) -> jax.Array:
        """The column of the candidate before which there are `rest` in its row. What is looked at are the words around it alone."""
        lanes, n_rows = self.layout.lanes, self.layout.n_rows
        word, rest = _which(_fields(bm.at(self._words, (row - 1) * lanes + lane), STARTS_BITS, self.layout.mask_words), rest)
        place = (word * n_rows + row) * lanes + lane
        here, above = bm.at(self._board, place), bm.at(self._board, place - lanes)
        left = jnp.where(word > 0, bm.at(self._board, jnp.maximum(place - n_rows * lanes, 0)), U(0))
        corners = self._corners[0] if len(set(self._corners)) == 1 else bm.at(jnp.asarray(self._corners), row)
        _, starts = _starts([left, here], [left, above], corners)
        return 32 * word + bm.nth_bit(starts, rest)


def _fields(words: jax.Array, bits: int, n: int) -> list[jax.Array]:
    """The first n numbers of so many bits in words, the lowest first, int32."""
    return [(words >> bits * i & (1 << bits) - 1).astype(jnp.int32) for i in range(n)]


def _total(numbers: Sequence[jax.Array]) -> jax.Array:
    return functools.reduce(operator.add, numbers)


def _packed(counts: jax.Array) -> jax.Array:
    """The counts of four rows in a word, uint32 `[rows / 4, lanes]`."""
    rows = counts.astype(U).reshape(-1, ROWS, counts.shape[1])
    return functools.reduce(operator.or_, (rows[:, i] << 8 * i for i in range(ROWS)))


def _last_at_most(table: Callable[[jax.Array], jax.Array], n: int, k: jax.Array) -> jax.Array:
    """The largest i < n where `table(i) <= k`; the table is ascending and begins with nothing larger."""
    i = jnp.zeros_like(k)
    for bit in reversed(range((n - 1).bit_length())):
        ahead = i + (1 << bit)
        i = jnp.where((ahead < n) & (table(jnp.minimum(ahead, n - 1)) <= k), ahead, i)
    return i


def _which(counts: Sequence[jax.Array], rest: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The index at which counts `[n]` add up to more than `rest` `[n]`, and what is left of it there."""
    index, beyond = jnp.zeros_like(rest), jnp.ones_like(rest, bool)
    for count in counts[:-1]:
        beyond = beyond & (rest >= count)
        index, rest = index + beyond.astype(jnp.int32), rest - jnp.where(beyond, count, 0)
    return index, rest


# ------------------------------------------------------------------------------------------------------------ filling


def _windows(layout: Layout, board: Bitmap, offset: jax.Array, column: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The board from the row above each candidate down, `before` columns to the left of it and as wide as the layout's windows.

    Returns:
        uint32 `[rows, words, candidates]`; and for each row, in the highest bit of uint32 `[rows, candidates]`, the column left of those.
    """
    left = column - layout.before - 1
    word, shift = (left >> 5)[None] + jnp.arange(layout.window_words + 1)[:, None], (left & 31).astype(U)
    rows = jnp.arange(layout.reach_y + 2)[:, None, None] * layout.lanes
    cut = board.ravel().at[offset[None] + rows].get(mode="promise_in_bounds")
    cut = jnp.where(((word >= 0) & (word < layout.n_words))[None], cut, U(0))
    windows = (cut[:, :-1] << shift[None, None] << 1) | (cut[:, 1:] >> (31 - shift)[None, None])
    return windows, cut[:, 0] << shift[None]


def _offsets(layout: Layout, found: _Candidates) -> jax.Array:
    """Where on the flat board the words of each window's first row are, int32 `[words, candidates]`."""
    word = ((found.column - layout.before - 1) >> 5)[None] + jnp.arange(layout.window_words + 1)[:, None]
    row = jnp.clip(word, 0, layout.n_words - 1) * layout.n_rows + (found.row - 1)[None]
    return row * layout.lanes + (found.segment % layout.lanes)[None]


def _leaves_left(filled: jax.Array, outside: jax.Array, corners: jax.Array) -> jax.Array:
    """Whether a component goes on in the column to the left of its window, given the highest bits of both, uint32 `[rows, n]`."""
    beside = jnp.pad(filled, ((1, 1), (0, 0)))
    touched = filled | ((beside[:-2] | beside[2:]) & corners[None])
    return bm.or_rows((touched & outside)[None])[0] >> 31 != 0


class _Measured(NamedTuple):
    """The components of some candidates, `[n]` each."""

    own: jax.Array  # bool: the candidate is the component's first pixel
    inside: jax.Array  # bool: the component has been filled completely
    left: jax.Array  # int32: first and last column, and height
    right: jax.Array
    height: jax.Array
    area: jax.Array  # int32: pixels


def _measure(layout: Layout, board: Bitmap, found: _Candidates, offset: jax.Array, corners: jax.Array) -> tuple[_Measured, jax.Array]:
    """Fill each candidate's component in its window, which is returned, too, uint32 `[words, rows, n]`.

    `corners` are words with all bits set where corners connect, or none.
    """
    reach, before = layout.reach_x, layout.before
    cut, outside = _windows(layout, board, offset, found.column)
    seed = jnp.zeros(cut[1:].shape, U).at[0, before // 32].set(U(1 << (31 - before % 32)))
    filled = fill(cut[1:], seed & cut[1:], corners, reach)
    by_word = jnp.moveaxis(filled, 1, 0)
    first, last, _, bottom = extent(by_word)
    head, _ = bm.columns(filled[0])
    near = bm.spread_words(list(filled[0]), corners)
    above = bm.any_of(a & b for a, b in zip(near, cut[0], strict=True)) != 0
    leaves = first == 0 if layout.has_margin else _leaves_left(filled[:, 0], outside[1:], corners)
    inside = ~leaves & (last < before + reach) & (bottom < layout.reach_y)
    area = jnp.sum(bm.popcount(filled), axis=(0, 1), dtype=jnp.int32)
    left, right = found.column + first - before, found.column + last - before
    return _Measured(~above & (head == before), inside, left, right, bottom + 1, area), by_word


def _measure_large(layout: Layout, board: Bitmap, found: _Candidates, measured: _Measured, wanted: jax.Array) -> _Measured:
    """Fill the wanted candidates' components on the whole board, one candidate of each frame at a time."""
    large = wanted & ~measured.inside
    lane, rows = found.segment % layout.lanes, jnp.arange(layout.n_rows)[None, :, None]

    def next_of_each_lane(state: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
        open_, own, left, right, height = state
        mine = open_[:, None] & (lane[:, None] == jnp.arange(layout.lanes)[None])
        index = jnp.argmax(mine, axis=0)
        row, column = found.row[index], found.column[index]
        bit = (U(1) << (31 - (column & 31)).astype(U))[None, None]
        words = jnp.arange(layout.n_words)[:, None, None] == (column >> 5)[None, None]
        seed = jnp.where(words & (rows == row[None, None]), bit, U(0))
        filled = fill_large(board, seed & board, layout.corners_by_row()[None, :, None])
        first, last, top, bottom = extent(filled)
        head, _ = bm.columns(bm.rows_at(filled, jnp.minimum(top, layout.n_rows - 1)[None])[:, 0])
        here = open_ & (index[lane] == jnp.arange(layout.n_candidates))
        own = jnp.where(here, ((top >= row) & (head == column))[lane], own)
        sides = ((first, left), (last, right), (bottom - row + 1, height))
        left, right, height = (jnp.where(here, new[lane], old) for new, old in sides)
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
    down: jax.Array  # objects one below the other
    parts: jax.Array  # objects in all; 0: the component is none


def _quotient(a: jax.Array, b: jax.Array) -> jax.Array:
    """`a // b` of int32 from 0 to 2**20.

    XLA divides integers one at a time, and floats eight at a time: Berzerk takes 28 us a frame instead of 33. Half more than a number is
    never so near to a multiple that rounding could matter.
    """
    return ((a.astype(jnp.float32) + 0.5) / b.astype(jnp.float32)).astype(jnp.int32)


def _to_cover(size: jax.Array, part: jax.Array) -> jax.Array:
    """Parts that cover a size, 1 to `MAX_PARTS`."""
    return sum(((size > part * i).astype(jnp.int32) for i in range(1, MAX_PARTS)), start=jnp.ones_like(size))


def _accept(layout: Layout, found: _Candidates, measured: _Measured, entries: Entries, exists: jax.Array) -> _Accepted:
    """Apply the limits of each candidate's search, whose entries in the tables are given."""
    w, h = measured.right - measured.left + 1 - entries.gap_x, measured.height - entries.gap_y
    part_w = part_h = jnp.full_like(w, UNLIMITED)
    good = jnp.zeros_like(exists)
    for shape, reads_pixels in reversed(list(zip(entries.limits, layout.reads_pixels, strict=True))):
        met = (w >= shape.min_w) & (h >= shape.min_h) & (w <= shape.max_w) & (h <= shape.max_h)
        if reads_pixels:
            met = met & (measured.area >= shape.min_pixels) & (measured.area <= shape.max_pixels)
        part_w, part_h = jnp.where(met, shape.part_w, part_w), jnp.where(met, shape.part_h, part_h)
        good = good | met
    good = good & exists & measured.own & measured.inside
    across = _to_cover(w, part_w)
    down = jnp.minimum(_to_cover(h, part_h), _quotient(jnp.full_like(w, MAX_PARTS), across))
    return _Accepted(measured.left, found.row - entries.up, w, h, part_w, part_h, across, down, jnp.where(good, across * down, 0))


def _parts(layout: Layout, a: _Accepted) -> jax.Array:
    """The boxes of each component's objects, evenly spaced from edge to edge: words `[parts, n]`."""
    if not layout.splits:
        return words(a.x, a.y, a.w, a.h)[None]
    part = jnp.broadcast_to(jnp.arange(MAX_PARTS, dtype=jnp.int32)[:, None], (MAX_PARTS, len(a.x)))
    a = _Accepted(*(v[None] for v in a))
    row = _quotient(part, a.across)
    column = part - row * a.across
    x = a.x + _quotient(column * (a.w - a.part_w), jnp.maximum(a.across - 1, 1))
    y = a.y + _quotient(row * (a.h - a.part_h), jnp.maximum(a.down - 1, 1))
    return words(x, y, jnp.where(a.across > 1, a.part_w, a.w), jnp.where(a.down > 1, a.part_h, a.h))


def _parted(
    layout: Layout, found: _Candidates, accepted: _Accepted, parts: jax.Array, filled: jax.Array, entries: Entries
) -> tuple[_Accepted, jax.Array]:
    """The same, with two boxes for each component that is larger than its search's pictures and in which one of them fits."""
    begin = found.column - layout.before
    edges = Edges(entries.left - found.column, entries.right - found.column, entries.bottom - found.row)
    n_parts = accepted.parts
    for i, pictures in enumerate(layout.pictures):
        both = part(filled, layout.before, edges, pictures)
        width, height = largest(pictures)
        eligible = ((accepted.w > width) | (accepted.h > height)) & (n_parts > 0) & (entries.pictures == i)
        n_parts, parts = materialize(in_two, n_parts, parts, eligible, begin, accepted.y, *both, small=0)
    return accepted._replace(parts=n_parts), parts


class _Progress(NamedTuple):
    """What the rounds have found so far, of the first search of each mask, of the second one, and so on."""

    done: jax.Array  # int32: candidates looked at
    totals: tuple[jax.Array, ...]  # int32 [masks, lanes]: objects
    slots: tuple[tuple[jax.Array, ...], ...]  # uint32 [slots, lanes]: boxes as words, 0 where there is none, and heads if asked for


def components(
    masks: Sequence[Bitmap], searches: Sequence[Search], lists: Sequence[int] | None = None, *, heads: bool = False
) -> list[Detected]:
    """Bounding boxes of the connected components of several masks, found together.

    Args:
        masks: bitmaps of equal numbers of words and frames; the numbers of rows may differ.
        searches: what to look for in each mask.
        lists: which list of objects each search adds to; None: each has its own. Searches of one list have as many slots, and share them.
        heads: whether to return the column of each object's first pixel (`Detected.head`), too; searches that split components have none.

    Returns:
        The boxes of each list, in the order of the first searches that add to them. Those of one search are in raster order of the
        components' first pixels.
    """
    layout = Layout(masks, searches, lists)
    board = _board(layout, [masks[i] for i, *_ in layout.order])
    index = _Index(layout, board)

    def locate(k: jax.Array) -> tuple[_Candidates, jax.Array]:
        found = index.locate(k)
        return found, _offsets(layout, found)

    def one_round(so_far: _Progress) -> _Progress:
        k = so_far.done + jnp.arange(layout.n_candidates, dtype=jnp.int32)
        found, offset = materialize(locate, k, small=0)
        exists = k < index.total
        entries = layout.look_up(found.segment // layout.lanes, 0)
        measured, filled = _measure(layout, board, found, offset, entries.corners.astype(U))
        if any(s.unlimited for s in searches):
            measured = _measure_large(layout, board, found, measured, exists & measured.own & (entries.unlimited > 0))
        begins = jnp.clip(index.segments - so_far.done, 0, layout.n_candidates)  # the first candidate of each segment, in this round
        totals, slots = [], []
        for rank in range(len(layout.tables)):
            entries = layout.look_up(found.segment // layout.lanes, rank) if rank else entries
            accepted = _accept(layout, found, measured, entries, exists)
            parts = _parts(layout, accepted)
            if layout.pictures and rank == 0:  # searches with pictures share no mask
                accepted, parts = _parted(layout, found, accepted, parts, filled, entries)
            objects = Found(begins, accepted.parts, parts, found.column)
            total, filled_slots = fill_slots(layout, rank, objects, so_far.totals[rank], so_far.slots[rank])
            totals.append(total)
            slots.append(filled_slots)
        return _Progress(so_far.done + layout.n_candidates, tuple(totals), tuple(slots))

    ranks = range(len(layout.tables))
    none = tuple(jnp.zeros((layout.n_masks, layout.lanes), jnp.int32) for _ in ranks)
    empty = tuple((jnp.zeros((layout.lists_of_rank(rank)[1].sum(), layout.lanes), U),) * (1 + heads) for rank in ranks)
    start = _Progress(jnp.int32(0), none, empty)
    _, totals, slots = lax.while_loop(lambda s: s.done < index.total, one_round, varying(start, board))
    most = np.array([[layout.counts[own]] for own in layout.slots], np.int32)
    overflow = jnp.maximum(layout.by_list(jnp.concatenate(totals)) - most, 0)
    splits = {own for own, search in zip(layout.lists, searches, strict=True) if search.splits}
    found = []
    for (own, places), more in zip(layout.slots.items(), overflow, strict=True):
        pieces = [[field[first:end] for field in slots[rank]] for rank, first, end in places]
        box, *columns = pieces[0] if len(pieces) == 1 else (jnp.concatenate(field) for field in zip(*pieces, strict=True))
        head = columns[0].astype(jnp.int32) if columns and own not in splits else None
        found.append(Detected(box, head=head, overflow=more))
    return found
