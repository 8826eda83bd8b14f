"""Connected components of bitmaps, with exact bounding boxes, for a whole batch at once.

The method: a component's first pixel in raster order starts a run of a row that touches nothing in the row above. All such
"top runs" of a frame come out of a few word operations (an addition whose carry runs through a row's runs and stops where the
row above touches). Each of them is a candidate: the mask around it is cut out as a small window, one lane a candidate, and the
component is filled there by a sweep down and a sweep up over the window's rows, every row filled along its runs by doubling
steps. A candidate that is not the first pixel of what it filled is dropped (a component with two horns has two candidates).
Candidates are taken a chunk at a time until there are none left, so the result is exact for any mask.

A component that leaves its window is larger than the rule's `max_size` and no object. Without such a limit those that leave a
window of the default size are filled again on the whole frame, one at a time: exact for spirals too, only slower.

What was tried, in microseconds a frame on one core, frames of Space Invaders with 36 aliens (`benchmarks/vision.py` times what is here):
one search for each category costs 5 before it has found anything, and its compilation 1 to 2 seconds: hence one search over all
masks of a game, one below the other. Filling rows by doubling steps across words took 25 times as long for windows of two words as
for one, because the compiler computes what the words share once for each; filling within words and passing runs on from word to
word takes twice as long (286 -> 64 for windows of 63 x 32). In the whole of the game's VEM, 8 candidates at a time take 51, 16 take 60,
32 take 71: what is left over in the last round is wasted. For this one mask OpenCV's findContours takes 52, scipy's label and
find_objects 146.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U

WINDOW = (31, 32)  # width and height of the first try where a rule sets no limit
CHUNK = 8  # candidates at a time
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
    """Every pixel spread dx to the left and dy up, so that parts at most (dx, dy) apart connect; `mask` has room for it."""
    n = 1
    while n <= dx:
        mask, n = bm.either(mask, bm.left(mask, min(n, dx - n + 1))), 2 * n
    n = 1
    while n <= dy:
        step = min(n, dy - n + 1)
        mask, n = bm.either(mask, tuple(jnp.pad(w[step:], ((0, step), (0, 0))) for w in mask)), 2 * n
    return mask


def _top_runs(mask: Bitmap, diagonal: bool) -> jax.Array:
    """First pixels of the runs that nothing in the row above touches; uint32 `[words, rows - 1, B]`, from the second row on."""
    above = bm.spread(mask) if diagonal else mask
    here = tuple(w[1:] for w in mask)
    free = bm.minus(here, tuple(w[:-1] for w in above))
    ends = bm.minus(free, bm.left(here, 1))  # rightmost pixels of runs

    def add(carry: jax.Array, words: tuple[jax.Array, ...]) -> tuple[jax.Array, jax.Array]:
        f, e, m = words
        total = f + e + carry
        return ((f & e) | ((f | e) & ~total)) >> 31, total & ~m

    # one word after the other from the right: the carry leaves a free run at the pixel left of its first
    _, out = lax.scan(add, jnp.zeros_like(here[0]), tuple(jnp.stack(w[::-1]) for w in (free, ends, here)))
    return jnp.stack(bm.right(tuple(out[::-1]), 1))


def _nth_set(starts: jax.Array, running: jax.Array, k: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Row and column of the k-th set pixel in raster order.

    Args:
        starts: uint32 `[words, rows, B]`.
        running: int32 `[rows + 1, B]`, number of set pixels above each row.
        k: int32 `[C, B]`, less than the number of set pixels (else the result is meaningless, but in range).
    """
    n_words, n_rows, _ = starts.shape
    lane = jnp.arange(k.shape[1])[None]
    row = jnp.minimum(jnp.sum(running[1:, None] <= k[None], axis=0, dtype=jnp.int32), n_rows - 1)
    rest = k - running[row, lane]
    word_index, found = jnp.zeros_like(k), jnp.zeros_like(k)
    word = jnp.zeros(k.shape, U)
    before = jnp.zeros_like(k)
    for i in range(n_words):
        w = starts[i, row, lane]
        inside = (before <= rest) & (rest < before + bm.popcount(w))
        word, word_index = jnp.where(inside, w, word), jnp.where(inside, i, word_index)
        found = jnp.where(inside, rest - before, found)
        before = before + bm.popcount(w)
    bit = jnp.zeros_like(k)
    for step in (16, 8, 4, 2, 1):
        head = bm.popcount(word >> (31 - bit - step + 1).astype(U))
        bit = jnp.where(head <= found, bit + step, bit)
    return row, 32 * word_index + bit


def _fill(mask: jax.Array, seed: jax.Array, diagonal: bool) -> jax.Array:
    """The components of `mask` that hold pixels of `seed`, a part of it; all uint32 `[rows, words, ...]`."""

    def reach(words: Bitmap) -> Bitmap:
        return bm.spread(words) if diagonal else words

    def sweep(filled: jax.Array, reverse: bool) -> jax.Array:
        def row(before: Bitmap, here: tuple[jax.Array, jax.Array]) -> tuple[Bitmap, jax.Array]:
            m, f = tuple(here[0]), tuple(here[1])
            now = bm.fill_rows(m, bm.either(f, bm.both(m, reach(before))))
            return now, jnp.stack(now)

        return lax.scan(row, bm.zeros_like(tuple(seed[0])), (mask, filled), reverse=reverse)[1]

    def more(filled: jax.Array) -> jax.Array:
        """Whether another sweep down would find more; after a sweep up, nothing is missing upwards."""
        words = tuple(jnp.moveaxis(filled, 1, 0))
        reached = bm.both(reach(tuple(w[:-1] for w in words)), tuple(jnp.moveaxis(mask[1:], 1, 0)))
        return jnp.any(bm.any_of(bm.minus(reached, tuple(w[1:] for w in words))) != 0)

    def both_ways(filled: jax.Array) -> jax.Array:
        return sweep(sweep(filled, reverse=False), reverse=True)

    return lax.while_loop(more, both_ways, both_ways(seed))


def _extent(filled: jax.Array) -> tuple[jax.Array, ...]:
    """First and last column, first and last row, and first column of the first row, of components as from `_fill`."""
    words = tuple(jnp.moveaxis(filled, 1, 0))
    used = bm.any_of(words) != 0
    rows = jnp.arange(filled.shape[0], dtype=jnp.int32).reshape(-1, *([1] * (used.ndim - 1)))
    bottom = jnp.max(jnp.where(used, rows, -1), axis=0)
    top = jnp.min(jnp.where(used, rows, filled.shape[0]), axis=0)
    first, last = bm.columns(tuple(lax.reduce(filled, U(0), lax.bitwise_or, (0,))))
    head, _ = bm.columns(tuple(jnp.sum(jnp.where(rows == top[None], w, U(0)), axis=0, dtype=U) for w in words))
    return first, last, top, bottom, head


def components(masks: Sequence[Bitmap], searches: Sequence[Search], *, connectivity: int = 8) -> list[Boxes]:
    """Bounding boxes of the connected components of several masks in one go.

    Args:
        masks: bitmaps of uint32 `[rows, B]` words, all of the same number of words; the numbers of rows may differ.
        searches: what to look for in each.
        connectivity: 8 or 4, for all.

    Returns:
        For each mask its boxes, relative to the mask's first row.
    """
    diagonal = connectivity == 8
    n_masks, lanes, width = len(masks), masks[0][0].shape[1], 32 * len(masks[0])
    # Spreading by join = (dx, dy) moves every first pixel, and so the raster order, by the same amount, and grows every box by it.
    sizes = [(WINDOW if s.max_size is None else (min(s.max_size[0], width), min(s.max_size[1], 256))) for s in searches]
    reach_x = max(w + s.join[0] for (w, _), s in zip(sizes, searches, strict=True))
    reach_y = max(h + s.join[1] for (_, h), s in zip(sizes, searches, strict=True))
    unbounded = [s.max_size is None for s in searches]

    # All masks, one below the other, with an empty row between them: one search serves all categories of a game.
    pad = reach_x // 32 + 1
    stacked: list[Bitmap] = []
    starts_at, row = [], 0
    for mask, s in zip(masks, searches, strict=True):
        blank = (jnp.zeros_like(mask[0]),)
        wide = tuple(jnp.pad(w, ((s.join[1] + 1, 0), (0, 0))) for w in (*blank * pad, *mask, *blank * (pad + 1)))
        stacked.append(_joined(wide, *s.join))
        starts_at.append(row)
        row += stacked[-1][0].shape[0]
    board = jnp.stack([jnp.pad(jnp.concatenate(words), ((0, reach_y + 1), (0, 0))) for words in zip(*stacked, strict=True)])
    starts = _top_runs(tuple(board), diagonal)[pad - 1 : pad + len(masks[0])]
    counts = sum(bm.popcount(w) for w in starts[1:]) + bm.popcount(starts[0])
    running = jnp.pad(jnp.cumsum(counts, axis=0), ((1, 0), (0, 0)))
    found = running[-1]
    n_words = -(-(2 * reach_x + 1) // 32)
    lane = jnp.arange(lanes)
    first_slot = np.cumsum([0, *(s.count for s in searches)]).tolist()

    def of_mask(which: jax.Array, table: Sequence[int]) -> jax.Array:
        """`table[which]` without a gather."""
        table = [int(v) for v in table]
        out = jnp.full(which.shape, table[0], jnp.int32)
        for i in range(1, len(table)):
            out = out if table[i] == table[i - 1] else jnp.where(which >= i, table[i], out)
        return out

    def windows(row: jax.Array, column: jax.Array) -> jax.Array:
        """The board from the row above a first pixel down, `reach_x` columns to both sides: `[rows, n_words, C, B]`."""
        at = column + 32 * (pad - 1) - reach_x
        word, shift = at >> 5, (at & 31).astype(U)[None, None]
        rows = row[None, None] + jnp.arange(reach_y + 2)[:, None, None, None]
        words = word[None, None] + jnp.arange(n_words + 1)[None, :, None, None]
        cut = board.at[jnp.minimum(words, board.shape[0] - 1), rows, lane[None, None, None]].get(mode="promise_in_bounds")
        return (cut[:, :-1] << shift) | ((cut[:, 1:] >> 1) >> (31 - shift))

    def whole(row: jax.Array, column: jax.Array) -> tuple[jax.Array, ...]:
        """Column of the first pixel's row's first, first and last column, height and what is above, of components of any size; `[B]`."""
        at = column + 32 * (pad - 1)
        rows = jnp.arange(board.shape[1])[:, None]
        words = jnp.arange(board.shape[0])[:, None]
        bit = (U(1) << (31 - (at & 31)).astype(U))[None]
        seed = jnp.where(words == (at >> 5)[None], bit, U(0))
        mask = jnp.moveaxis(board, 1, 0)
        first_row = row[None] + 1
        filled = _fill(mask, jnp.where((rows == first_row)[:, None], seed[None], U(0)), diagonal)
        first, last, top, bottom, head = _extent(filled)
        return head - 32 * (pad - 1), first - 32 * (pad - 1), last - 32 * (pad - 1), top < first_row[0], bottom - first_row[0] + 1

    def step(state: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
        done, totals, packed = state
        k = jnp.broadcast_to(done + jnp.arange(CHUNK, dtype=jnp.int32)[:, None], (CHUNK, lanes))
        row, column = _nth_set(starts, running, k)
        which = sum(((row >= at).astype(jnp.int32) for at in starts_at[1:]), jnp.zeros_like(row))
        cut = windows(row, column)
        seed = jnp.zeros(cut[1:].shape, U).at[0, reach_x // 32].set(U(1 << (31 - reach_x % 32)))
        filled = _fill(cut[1:], seed & cut[1:], diagonal)
        first, last, _, bottom, head = _extent(filled)
        top = tuple(filled[0])
        above = bm.any_of(bm.both(bm.spread(top) if diagonal else top, tuple(cut[0]))) != 0
        own = (k < found[None]) & ~above & (head == reach_x)
        inside = (first > 0) & (last < 2 * reach_x) & (bottom < reach_y)
        left, right, height = column + first - reach_x, column + last - reach_x, bottom + 1
        if any(unbounded):
            free = of_mask(which, unbounded) > 0
            slot = jnp.arange(CHUNK)[:, None]

            def next_large(s: tuple[jax.Array, ...]) -> tuple[jax.Array, ...]:
                open_, own, left, right, height = s
                index = jnp.argmax(open_, axis=0)
                here = (slot == index[None]) & open_
                at_row, at_column = (jnp.take_along_axis(v, index[None], axis=0)[0] for v in (row, column))
                head, first, last, above, tall = whole(at_row, at_column)
                own = jnp.where(here, (~above & (head == at_column))[None], own)
                left, right, height = (jnp.where(here, n[None], o) for n, o in ((first, left), (last, right), (tall, height)))
                return open_ & ~here, own, left, right, height

            large = own & ~inside & free
            _, own, left, right, height = lax.while_loop(lambda s: jnp.any(s[0]), next_large, (large, own, left, right, height))
            inside = inside | large
        dx, dy = (of_mask(which, [s.join[i] for s in searches]) for i in (0, 1))
        w, h = right - left + 1 - dx, height - dy
        x, y = left - 32 + dx, row - of_mask(which, starts_at)
        limits = [(1, 1, 256, 256) if s.max_size is None else (1, 1, *s.max_size) for s in searches]
        limits = [(*s.min_size, *m[2:]) for s, m in zip(searches, limits, strict=True)]
        w0, h0, w1, h1 = (of_mask(which, column) for column in zip(*limits, strict=True))
        good = own & inside & (w >= w0) & (h >= h0) & (w <= w1) & (h <= h1)
        if any(s.pixels for s in searches):
            least, most = (of_mask(which, [(s.pixels or (0, 2**30))[i] for s in searches]) for i in (0, 1))
            pixels = jnp.sum(bm.popcount(filled), axis=(0, 1), dtype=jnp.int32)
            good = good & (pixels >= least) & (pixels <= most)

        # Parts of equal size, evenly spaced from one edge to the other.
        part_w, part_h = (of_mask(which, [(s.split or (256, 256))[i] for s in searches]) for i in (0, 1))
        across = jnp.clip(-(-w // part_w), 1, PARTS)
        down = jnp.clip(-(-h // part_h), 1, PARTS // across)
        parts = jnp.where(good, across * down, 0)
        new = jnp.stack([jnp.sum(jnp.where(which == i, parts, 0), axis=0, dtype=jnp.int32) for i in range(n_masks)])
        rank = jnp.cumsum(parts, axis=0) - parts  # among the chunk's; masks come one after the other
        for i in range(n_masks):
            rank = jnp.where(which == i, rank + (totals[i] - jnp.sum(new[:i], axis=0, dtype=jnp.int32))[None], rank)
        count, base = of_mask(which, [s.count for s in searches]), of_mask(which, first_slot)
        slots = jnp.arange(first_slot[-1], dtype=jnp.int32)[:, None, None]
        for p in range(PARTS if any(s.split for s in searches) else 1):
            column_of, row_of = p % across, p // across
            part = [
                x + column_of * (w - part_w) // jnp.maximum(across - 1, 1),
                y + row_of * (h - part_h) // jnp.maximum(down - 1, 1),
                jnp.where(across > 1, part_w, w),
                jnp.where(down > 1, part_h, h),
            ]
            entry = part[0].astype(U) | (part[1].astype(U) << 8) | (part[2].astype(U) << 16) | (part[3].astype(U) << 24)
            slot = jnp.where((p < parts) & (rank + p < count), base + rank + p, -1)
            packed = packed | jnp.sum(jnp.where(slot[None] == slots, entry[None], U(0)), axis=1, dtype=U)
        return done + CHUNK, totals + new, packed

    start = (jnp.int32(0), jnp.zeros((n_masks, lanes), jnp.int32), jnp.zeros((first_slot[-1], lanes), U))
    _, totals, packed = lax.while_loop(lambda s: jnp.any(s[0] < found), step, start)
    x, y, w, h = ((packed >> s & U(255)).astype(jnp.int32) for s in (0, 8, 16, 24))
    spans = [slice(a, b) for a, b in itertools.pairwise(first_slot)]
    return [Boxes(x[s], y[s], w[s], h[s], w[s] > 0, totals[i]) for i, s in enumerate(spans)]
