"""Connected components of bitmaps, with exact bounding boxes, for a whole batch at once.

The method: a component's first pixel in raster order starts a run of a row that touches nothing in the row above. All such pixels of
a batch come out of a few word operations (an addition whose carry runs through a run and stops where the row above touches). Each
word is looked at alone, so that a few more are found. Each of them is a candidate, and the candidates of all frames and masks are
numbered: mask by mask, frame by frame, in raster order. So many at a time are looked up by their numbers, the mask around each
is cut out as a small window, and the component is filled there by a sweep down and a sweep up over the window's rows. A candidate
that is not the first pixel of what it filled is dropped (a component with two horns has two candidates). This goes on until there
are none left, so the result is exact for any mask.

A component that leaves its window is larger than the rule's `max_size` and no object. Without such a limit those that leave a
window of the default size are filled again on the whole frame, one of each frame at a time: exact for spirals too, only slower.

What was tried, in microseconds a frame on one core for the whole of a game's VEM (`benchmarks/vision.py` times what is here): 8
candidates of every frame at a time, as many times as the frame with the most of them needed, took 240 for Asteroids (now 33), 120 for
Beam Rider (29), 100 for Battle Zone (24) and 50 for Space Invaders (22), though a frame has 4 to 50 candidates: one bad frame kept all
others waiting, what fills the last round was wasted, and so was the carry from word to word over a board of 1,800 rows. What is looked
up must be kept in memory before the windows are cut out: fused, every word of every window looked its candidate up again (81 for
Asteroids instead of 41). One search for each category takes 5 before it has found anything, and its compilation 1 to 2 seconds:
hence one search over all masks of a game, one below the other. The words of a row are filled apart and carried apart: stacked, what
they share is computed once for each (46 for Asteroids instead of 33). Five arrays sorted at once took 17, one with the index in its
low bits takes 1. (`lax.optimization_barrier` keeps nothing: it is gone before the compiler fuses.)
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U

WINDOW = (31, 32)  # width and height of the first try where a rule sets no limit
BLOCK = 8  # rows that candidates are counted in
LEAST, PER_LANE = 32, 8  # candidates at a time, at least and for each frame
PARTS = 4  # objects at most that one component is split into


@dataclass(frozen=True)
class Search:
    """What to look for in one mask."""

    count: int  # boxes at most; the rest is only counted
    join: tuple[int, int] = (0, 0)  # parts at most (dx, dy) blank pixels apart are one component
    min_size: tuple[int, int] = (1, 1)  # limits (width, height): components outside them do not count
    max_size: tuple[int, int] | None = None
    split: tuple[int, int] | None = None  # a component larger than this is as many objects of this size as cover it, `PARTS` at most
    pixels: tuple[int, int] | None = None  # least and most pixels of a component, after joining; needs max_size


class Boxes(NamedTuple):
    """Boxes found in one mask, in raster order of the components' first pixels, batch innermost."""

    x: jax.Array  # int32 [count, B]
    y: jax.Array  # int32 [count, B]
    w: jax.Array  # int32 [count, B]
    h: jax.Array  # int32 [count, B]
    valid: jax.Array  # bool [count, B]
    total: jax.Array  # int32 [B]: objects found, those that did not fit included


def _joined(mask: Bitmap, dx: int, dy: int) -> Bitmap:
    """Every pixel spread dx to the right and dy down, so that parts at most (dx, dy) apart connect; `mask` has room for it."""
    for distance, move in ((dx, bm.right), (dy, bm.down)):
        n = 1
        while n <= distance:
            mask, n = mask | move(mask, min(n, distance - n + 1)), 2 * n
    return mask


def _starts(board: Bitmap, diagonal: bool) -> Bitmap:
    """First pixels of runs that nothing in the row above touches, as each word alone shows; a bitmap without the first row."""
    here, above = board[:, 1:], board[:, :-1]
    if diagonal:
        above = above | (above << 1) | (above >> 1)
    free = here & ~above
    total = free + (free & ~(here << 1))  # the carry goes from the last pixel of a free run to the left of its first
    first = ((total & ~here) >> 1) | jnp.where(total < free, U(1 << 31), U(0))
    goes_on = jnp.pad(here[:-1] << 31, ((1, 0), (0, 0), (0, 0)))
    return first & ~goes_on


def _last_at_most(table: Callable[[jax.Array], jax.Array], n: int, k: jax.Array) -> jax.Array:
    """The largest i < n where `table(i) <= k`; the table does not fall and begins with nothing larger."""
    i = jnp.zeros_like(k)
    for step in (2**e for e in reversed(range((n - 1).bit_length()))):
        there = jnp.minimum(i + step, n - 1)
        i = jnp.where((i + step < n) & (table(there) <= k), there, i)
    return i


def _fill(mask: jax.Array, seed: jax.Array, diagonal: bool, reach: int = 31) -> jax.Array:
    """The components of `mask` that hold pixels of `seed`, a part of it; all uint32 `[rows, words, ...]`."""

    def touching(words: jax.Array) -> jax.Array:
        return bm.spread(words) if diagonal else words

    def sweep(filled: jax.Array, reverse: bool) -> jax.Array:
        def row(before: tuple[jax.Array, ...], here: tuple[jax.Array, jax.Array]) -> tuple[tuple[jax.Array, ...], jax.Array]:
            m, f = here
            now = bm.fill_rows(m, f | (m & touching(jnp.stack(before))), reach)
            return now, jnp.stack(now)  # the words apart: together, what they share would be computed once for each

        return lax.scan(row, tuple(jnp.zeros_like(seed[0])), (mask, filled), reverse=reverse)[1]

    def more(filled: jax.Array) -> jax.Array:
        """Whether another sweep down would find more; after a sweep up, nothing is missing upwards."""
        words = jnp.moveaxis(filled, 1, 0)
        return jnp.any(touching(words[:, :-1]) & jnp.moveaxis(mask[1:], 1, 0) & ~words[:, 1:] != 0)

    def both_ways(filled: jax.Array) -> jax.Array:
        return sweep(sweep(filled, reverse=False), reverse=True)

    return lax.while_loop(more, both_ways, both_ways(seed))


def _extent(filled: jax.Array) -> tuple[jax.Array, ...]:
    """First and last column, first and last row, and first column of the first row, of components as from `_fill`."""
    words = jnp.moveaxis(filled, 1, 0)
    used = bm.any_of(words) != 0
    rows = jnp.arange(filled.shape[0], dtype=jnp.int32).reshape(-1, *([1] * (used.ndim - 1)))
    bottom = jnp.max(jnp.where(used, rows, -1), axis=0)
    top = jnp.min(jnp.where(used, rows, filled.shape[0]), axis=0)
    first, last = bm.columns(lax.reduce(filled, U(0), lax.bitwise_or, (0,)))
    head, _ = bm.columns(jnp.sum(jnp.where((rows == top[None])[None], words, U(0)), axis=1, dtype=U))
    return first, last, top, bottom, head


def components(masks: Sequence[Bitmap], searches: Sequence[Search], *, connectivity: int = 8) -> list[Boxes]:
    """Bounding boxes of the connected components of several masks in one go.

    Args:
        masks: bitmaps, all of the same number of words and lanes; the numbers of rows may differ.
        searches: what to look for in each.
        connectivity: 8 or 4, for all.

    Returns:
        For each mask its boxes, relative to the mask's first row.
    """
    diagonal = connectivity == 8
    lanes, width = masks[0].shape[2], 32 * masks[0].shape[0]
    sizes = [(WINDOW if s.max_size is None else (min(s.max_size[0], width), min(s.max_size[1], 256))) for s in searches]
    reach_x = max(w + s.join[0] for (w, _), s in zip(sizes, searches, strict=True))
    reach_y = max(h + s.join[1] for (_, h), s in zip(sizes, searches, strict=True))

    # All masks, one below the other, with an empty row above each: one search serves all categories of a game. Spread to the right and
    # down, the parts of a component connect, its first pixel stays, and its box grows by what `join` says.
    n_words = masks[0].shape[0] + any(s.join[0] for s in searches)
    begins = [0]
    for mask, s in zip(masks, searches, strict=True):
        begins.append(begins[-1] + -(-(mask.shape[1] + s.join[1] + 1) // BLOCK) * BLOCK)
    n_rows = begins[-1] + reach_y + 1

    board = jnp.zeros((n_words, n_rows, lanes), U)
    for mask, s, begin in zip(masks, searches, begins, strict=False):
        wide = jnp.pad(mask, ((0, n_words - len(mask)), (0, s.join[1]), (0, 0)))
        board = lax.dynamic_update_slice(board, _joined(wide, *s.join), (0, begin + 1, 0))
    starts = bm.kept(lambda b: _starts(b[:, : begins[-1] + 1], diagonal), board)  # of the row below
    counts = jnp.sum(bm.popcount(starts), axis=0, dtype=jnp.int32)  # of each row
    blocks = jnp.sum(counts.reshape(-1, BLOCK, lanes), axis=1, dtype=jnp.int32)
    blocks = jnp.pad(jnp.cumsum(blocks, axis=0), ((1, 0), (0, 0)))  # above each block
    ends = blocks[np.array(begins) // BLOCK]
    segments = jnp.pad(jnp.cumsum((ends[1:] - ends[:-1]).ravel()), (1, 0))  # before each lane of each mask: the order of candidates
    found = segments[-1]

    flat_board, flat_starts, flat_counts, flat_blocks = (v.ravel() for v in (board, starts, counts, blocks))

    def candidate(k: jax.Array) -> tuple[jax.Array, ...]:
        """Segment, row and column of the k-th candidate, and where its window's words are; in range even where there are fewer."""
        segment = _last_at_most(lambda i: segments[i], len(masks) * lanes, k)
        lane = segment % lanes
        rest = k - segments[segment] + ends.ravel()[segment]
        block = _last_at_most(lambda i: flat_blocks[i * lanes + lane], blocks.shape[0] - 1, rest)
        rest = rest - flat_blocks[block * lanes + lane]

        def which(counts: list[jax.Array], rest: jax.Array) -> tuple[jax.Array, jax.Array]:
            """The index at which so many are counted, and how many are left there."""
            index, before, left = jnp.zeros_like(rest), jnp.zeros_like(rest), rest
            for i, count in enumerate(counts):
                inside = (before <= rest) & (rest < before + count)
                index, left = jnp.where(inside, i, index), jnp.where(inside, rest - before, left)
                before = before + count
            return index, left

        row, rest = which([flat_counts[(block * BLOCK + i) * lanes + lane] for i in range(BLOCK)], rest)
        row = block * BLOCK + row
        words = [flat_starts[(i * starts.shape[1] + row) * lanes + lane] for i in range(n_words)]
        index, rest = which([bm.popcount(w) for w in words], rest)
        word = words[0]
        for i in range(1, n_words):
            word = jnp.where(index == i, words[i], word)
        bit = jnp.zeros_like(k)
        for step in (16, 8, 4, 2, 1):
            head = bm.popcount(word >> (31 - bit - step + 1).astype(U))
            bit = jnp.where(head <= rest, bit + step, bit)
        row, column = row + 1, 32 * index + bit
        word = ((column - reach_x) >> 5)[None] + jnp.arange(window + 1)[:, None]
        offset = (jnp.clip(word, 0, n_words - 1) * n_rows + (row - 1)[None]) * lanes + lane[None]
        return segment, row, column, offset

    window = -(-(2 * reach_x + 1) // 32)  # words
    n_candidates = max(LEAST, PER_LANE * lanes)

    def windows(column: jax.Array, offset: jax.Array) -> jax.Array:
        """The board from the row above a first pixel down, `reach_x` columns to both sides: `[rows, words, candidates]`."""
        at = column - reach_x
        word, shift = (at >> 5)[None] + jnp.arange(window + 1)[:, None], (at & 31).astype(U)
        rows = jnp.arange(reach_y + 2)[:, None, None] * lanes
        cut = flat_board.at[offset[None] + rows].get(mode="promise_in_bounds")
        cut = jnp.where(((word >= 0) & (word < n_words))[None], cut, U(0))
        return (cut[:, :-1] << shift[None, None]) | ((cut[:, 1:] >> 1) >> (31 - shift)[None, None])

    def whole(row: jax.Array, column: jax.Array) -> tuple[jax.Array, ...]:
        """Column of the first row's first pixel, first and last column, what is above, and height, of components of any size; `[B]`."""
        bit = (U(1) << (31 - (column & 31)).astype(U))[None, None]
        words = jnp.arange(n_words)[None, :, None] == (column >> 5)[None, None]
        seed = jnp.where(words & (jnp.arange(n_rows)[:, None, None] == row[None, None]), bit, U(0))
        first, last, top, bottom, head = _extent(_fill(jnp.moveaxis(board, 1, 0), seed, diagonal))
        return head, first, last, top < row, bottom - row + 1

    def of(which: jax.Array, table: Sequence[int]) -> jax.Array:
        return jnp.asarray(table, jnp.int32)[which] if len(set(table)) > 1 else jnp.full_like(which, table[0])

    first_slot = np.cumsum([0, *(s.count for s in searches)]).tolist()
    limits = [(s.min_size, s.max_size or (256, 256), s.pixels or (0, 2**30), s.split or (256, 256), s.join) for s in searches]

    def step(state: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
        done, totals, packed = state
        k = done + jnp.arange(n_candidates, dtype=jnp.int32)
        segment, row, column, offset = bm.kept(candidate, k, little=0)
        which, lane = segment // lanes, segment % lanes
        cut = windows(column, offset)
        seed = jnp.zeros(cut[1:].shape, U).at[0, reach_x // 32].set(U(1 << (31 - reach_x % 32)))
        filled = _fill(cut[1:], seed & cut[1:], diagonal, reach_x)
        first, last, _, bottom, head = _extent(filled)
        above = bm.any_of((bm.spread(filled[0]) if diagonal else filled[0]) & cut[0]) != 0
        own = (k < found) & ~above & (head == reach_x)
        inside = (first > 0) & (last < 2 * reach_x) & (bottom < reach_y)
        left, right, height = column + first - reach_x, column + last - reach_x, bottom + 1
        if any(s.max_size is None for s in searches):
            large = own & ~inside & (of(which, [int(s.max_size is None) for s in searches]) > 0)

            def next_large(s: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
                """One candidate of each lane."""
                open_, own, left, right, height = s
                mine = open_[:, None] & (lane[:, None] == jnp.arange(lanes)[None])
                index = jnp.argmax(mine, axis=0)
                here = open_ & (index[lane] == jnp.arange(n_candidates))
                head, first, last, above, tall = whole(row[index], column[index])
                own = jnp.where(here, (~above & (head == column[index]))[lane], own)
                left, right, height = (jnp.where(here, n[lane], o) for n, o in ((first, left), (last, right), (tall, height)))
                return open_ & ~here, own, left, right, height

            _, own, left, right, height = lax.while_loop(lambda s: jnp.any(s[0]), next_large, (large, own, left, right, height))
            inside = inside | large
        (w0, h0), (w1, h1), (least, most), (part_w, part_h), (dx, dy) = (
            tuple(of(which, [limit[j][i] for limit in limits]) for i in (0, 1)) for j in range(5)
        )
        w, h = right - left + 1 - dx, height - dy
        x, y = left, row - 1 - of(which, begins[:-1])
        good = own & inside & (w >= w0) & (h >= h0) & (w <= w1) & (h <= h1)
        if any(s.pixels for s in searches):
            pixels = jnp.sum(bm.popcount(filled), axis=(0, 1), dtype=jnp.int32)
            good = good & (pixels >= least) & (pixels <= most)

        # Parts of equal size, evenly spaced from one edge to the other.
        across = jnp.clip(-(-w // part_w), 1, PARTS)
        down = jnp.clip(-(-h // part_h), 1, PARTS // across)
        parts = jnp.where(good, across * down, 0)
        before = jnp.cumsum(parts) - parts
        first_of = jnp.maximum(segments[segment] - done, 0)  # the segment's first candidate among these
        rank = totals[segment] + before - before[first_of]
        count, base = of(which, [s.count for s in searches]), of(which, first_slot[:-1])
        for p in range(PARTS if any(s.split for s in searches) else 1):
            column_of, row_of = p % across, p // across
            part = [
                x + column_of * (w - part_w) // jnp.maximum(across - 1, 1),
                y + row_of * (h - part_h) // jnp.maximum(down - 1, 1),
                jnp.where(across > 1, part_w, w),
                jnp.where(down > 1, part_h, h),
            ]
            entry = part[0].astype(U) | (part[1].astype(U) << 8) | (part[2].astype(U) << 16) | (part[3].astype(U) << 24)
            slot = jnp.where((p < parts) & (rank + p < count), (base + rank + p) * lanes + lane, packed.size)
            packed = packed.at[slot].set(entry, mode="drop")
        return done + n_candidates, totals.at[segment].add(parts), packed

    start = (jnp.int32(0), jnp.zeros(len(masks) * lanes, jnp.int32), jnp.zeros(first_slot[-1] * lanes, U))
    _, totals, packed = lax.while_loop(lambda s: s[0] < found, step, start)
    packed, totals = packed.reshape(-1, lanes), totals.reshape(-1, lanes)
    x, y, w, h = ((packed >> s & U(255)).astype(jnp.int32) for s in (0, 8, 16, 24))
    spans = [slice(a, b) for a, b in itertools.pairwise(first_slot)]
    return [Boxes(x[s], y[s], w[s], h[s], w[s] > 0, totals[i]) for i, s in enumerate(spans)]
