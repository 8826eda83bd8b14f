"""Masks as bitmaps: 32 pixels per word, batch innermost.

A bitmap is uint32 `[words, rows, B]`. Each word holds 32 columns; the leftmost pixel is the most
significant bit.
"""

import functools
import operator
from collections.abc import Callable, Iterable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla.kernels import materialize
from ocjax.console.boxes import WIDTH, Area

U = jnp.uint32
ALL = np.array(0xFFFFFFFF, np.uint32)
# Rows per reduction. XLA splits a longer one into three kernels and a copy of its operand. Row
# `short reductions` of benchmarks/tricks.py.
MAX_REDUCED_ROWS = 32
Bitmap = jax.Array


def planes(frames: jax.Array) -> jax.Array:
    """Split palette indices into bitmaps, lowest bit first.

    The lowest bit of an index, which has no effect, is dropped.

    Args:
        frames: uint8 `[B, H, 160]`.

    Returns:
        uint32 `[7, 5, H, B]`.
    """
    b, h, w = frames.shape
    # Fused with the operation that slices the chunk out of the batch.
    words = lax.bitcast_convert_type(frames.reshape(b, h, w // 4, 4), U)
    pixels = materialize(lambda f: jnp.transpose(f, (2, 1, 0)), words)

    def bits(p: jax.Array) -> jax.Array:
        parts = p.reshape(1, w // 32, 8, h, b) >> np.arange(1, 8, dtype=np.uint32)[
            :, None, None, None, None
        ] & U(0x01010101)
        word = jnp.zeros_like(parts[:, :, 0])
        # A multiplication gathers the bits of eight pixels in the top byte.
        for i in range(0, 8, 2):
            word = word | (
                (((parts[:, :, i] << 4) | parts[:, :, i + 1]) * U(0x08040201)) >> 24
            ) << (24 - 4 * i)
        return word

    return materialize(bits, pixels)


def color_mask(planes: jax.Array, colors: Iterable[int]) -> Bitmap:
    """Select the pixels that have one of the colours, as a bitmap `[5, H, B]`.

    The mask follows the decision diagram of the colours over the bits of `planes`.
    """

    @functools.cache
    def plane(bit: int) -> jax.Array:
        return lax.index_in_dim(planes, bit, keepdims=False)

    @functools.cache
    def node(bit: int, members: frozenset[int]) -> jax.Array | bool:
        if len(members) in (0, 2 ** (bit + 1)):
            return len(members) > 0
        high = node(bit - 1, frozenset(m - 2**bit for m in members if m >= 2**bit))
        low = node(bit - 1, frozenset(m for m in members if m < 2**bit))
        if high is low:
            return high
        is_set = plane(bit)
        if isinstance(high, bool) and isinstance(low, bool):
            return is_set if high else ~is_set
        if isinstance(high, bool):
            return is_set | low if high else ~is_set & low
        if isinstance(low, bool):
            return ~is_set | high if low else is_set & high
        return (is_set & high) | (~is_set & low)

    mask = node(6, frozenset(color >> 1 for color in colors))
    return jnp.full(planes.shape[1:], ALL if mask else ~ALL, U) if isinstance(mask, bool) else mask


def shade_mask(planes: jax.Array, bits: jax.Array) -> Bitmap:
    """Select the pixels of a colour that differs between frames, as a bitmap `[5, H, B]`.

    Args:
        planes: see `planes`.
        bits: the bits of each frame's colour, lowest first, uint32 `[8, B]`; a word is all ones or
            zero. An odd index means a colour that no pixel has.
    """
    mask = jnp.broadcast_to(~bits[0], planes.shape[1:])
    for plane, bit in zip(planes, bits[1:, None, None], strict=True):
        mask = mask & ~(plane ^ bit)
    return mask


def shift_left(bitmap: Bitmap, n: int) -> Bitmap:
    """Shift every pixel n columns to the left (n < 32)."""
    return (bitmap << n) | _pad(bitmap[1:] >> (32 - n), (0, 1)) if n else bitmap


def shift_right(bitmap: Bitmap, n: int) -> Bitmap:
    """Shift every pixel n columns to the right (n < 32)."""
    return (bitmap >> n) | _pad(bitmap[:-1] << (32 - n), (1, 0)) if n else bitmap


def _pad(words: jax.Array, by: tuple[int, int]) -> jax.Array:
    return jnp.pad(words, (by, *((0, 0),) * (words.ndim - 1)))


def shift_down(bitmap: Bitmap, n: int) -> Bitmap:
    """Shift every pixel n rows down."""
    return jnp.pad(bitmap[:, :-n], ((0, 0), (n, 0), (0, 0)))


def shift_up(bitmap: Bitmap, n: int) -> Bitmap:
    """Shift every pixel n rows up."""
    return jnp.pad(bitmap[:, n:], ((0, 0), (0, n), (0, 0)))


def cut(bitmap: Bitmap, region: Area) -> Bitmap:
    """Return the rows of a region, with the pixels outside its columns cleared."""
    left, top, right, bottom = region
    return bitmap[:, top:bottom] & jnp.asarray(areas(1, [(left, 0, right, 1)]))


def areas(height: int, filled: Iterable[Area]) -> np.ndarray:
    """Build a constant bitmap of filled areas, uint32 `[5, height, 1]`."""
    inside = np.zeros((height, WIDTH), np.uint8)
    for left, top, right, bottom in filled:
        inside[top:bottom, left:right] = 1
    words = np.packbits(inside, axis=1).reshape(height, -1, 4).view(">u4")[..., 0].astype(np.uint32)
    return words.T[..., None]


def boxes(
    x: jax.Array, y: jax.Array, w: jax.Array, h: jax.Array, valid: jax.Array, height: int
) -> Bitmap:
    """Fill boxes, each int32 `[count, B]`, in a bitmap `[5, height, B]`.

    The columns of each box are materialized (Road Runner: 27 us per frame instead of 38).
    """

    def spans(x: jax.Array, w: jax.Array, valid: jax.Array) -> jax.Array:
        return jnp.where(valid[None], columns_between(x, x + w), U(0))

    ink = materialize(spans, x, w, valid, small=0)
    rows = jnp.arange(height, dtype=jnp.int32)[:, None]
    out = jnp.zeros((WIDTH // 32, height, x.shape[1]), U)
    for k in range(len(x)):
        inside = (rows >= y[k][None]) & (rows < (y[k] + h[k])[None])
        out = out | jnp.where(inside[None], ink[:, k : k + 1], U(0))
    return out


def columns_between(left: jax.Array, right: jax.Array, words: int = WIDTH // 32) -> jax.Array:
    """Set the columns from `left` to `right - 1`, int32 `[n, B]`; uint32 `[words, n, B]`."""
    word = 32 * np.arange(words, dtype=np.int32)[:, None, None]
    first, last = (jnp.clip(edge[None] - word, 0, 32) for edge in (left, right))
    ink = (ALL >> jnp.minimum(first, 31).astype(U)) & ~(
        U(0x7FFFFFFF) >> jnp.maximum(last - 1, 0).astype(U)
    )
    return jnp.where(first < last, ink, U(0))


def from_column(words: jax.Array, column: jax.Array) -> jax.Array:
    """Clear the pixels left of each row's column: rows `[words, n, B]`, columns int32 `[n, B]`."""
    start = jnp.clip(
        column[None] - 32 * jnp.arange(len(words), dtype=jnp.int32)[:, None, None], 0, 32
    )
    return words & jnp.where(start < 32, ALL >> jnp.minimum(start, 31).astype(U), U(0))


def rows_at(bitmap: Bitmap, row: jax.Array) -> jax.Array:
    """Gather rows of each frame, uint32 `[words, n, B]`; indices int32 `[n, B]` in range."""
    words, height, lanes = bitmap.shape
    first = np.arange(words, dtype=np.int32)[:, None, None] * height
    index = (first + row[None]) * lanes + np.arange(lanes, dtype=np.int32)[None, None]
    return bitmap.ravel().at[index].get(mode="promise_in_bounds", wrap_negative_indices=False)


def gather_rows(bitmap: Bitmap, left: np.ndarray, rows: np.ndarray, n_words: int) -> jax.Array:
    """Gather pieces of a bitmap at constant positions, uint32 `[k, n_words, n, B]`.

    Args:
        bitmap: `[words, height, B]`.
        left: first column of each of `n` pieces, int `[n]`; it becomes the first bit of their
            words.
        rows: rows of each piece, int `[k, n]` or `[k, 1]`.
    """
    word = (left >> 5)[None, :] + np.arange(n_words + 1)[:, None]
    padding = max(int(word.max()) + 1 - len(bitmap), 0)
    board = jnp.pad(bitmap, ((0, padding), (0, 0), (0, 0)))
    pieces = board[word[None], np.broadcast_to(rows, (len(rows), len(left)))[:, None]]
    shift = jnp.asarray(left & 31, U)[None, None, :, None]
    return (pieces[:, :-1] << shift) | ((pieces[:, 1:] >> 1) >> (31 - shift))


def windows(bitmap: Bitmap, margin: int) -> jax.Array:
    """Split a bitmap into overlapping words, uint32 `[n, rows, B]`.

    A word has `32 - 2 * margin` inner columns between `margin` columns of its neighbours (margin <
    16).
    """
    padded = _pad(bitmap, (1, 1))
    first, end = 32 - margin, 32 * (len(bitmap) + 1) - margin
    places = (divmod(left, 32) for left in range(first, end, 32 - 2 * margin))
    return jnp.stack(
        [
            (padded[word] << shift) | (padded[word + 1] >> 1 >> (31 - shift))
            for word, shift in places
        ]
    )


def from_windows(words: jax.Array, margin: int, n_words: int) -> Bitmap:
    """Rebuild a bitmap of `n_words` words from the inner columns of `windows`."""
    own = 32 - 2 * margin

    def word(left: int) -> jax.Array:
        shifts = (
            (k, left - (own * k - margin)) for k in range(left // own, -(-(left + 32) // own))
        )
        return any_of(kept[k] << shift if shift > 0 else kept[k] >> -shift for k, shift in shifts)

    kept = words & U((1 << own) - 1 << margin)
    return jnp.stack([word(32 * i) for i in range(n_words)])


def over(
    bitmap: Bitmap,
    size: int,
    move: Callable[[Bitmap, int], Bitmap],
    combine: Callable[[Bitmap, Bitmap], Bitmap],
) -> Bitmap:
    """Combine every pixel with the `size - 1` pixels next to it on one side."""
    if move in (shift_left, shift_right) and size <= 32:
        return _over_columns(bitmap, size, move is shift_left, combine)
    n = 1
    while n < size:
        step = min(n, size - n)
        bitmap, n = combine(bitmap, move(bitmap, step)), n + step
    return bitmap


def _over_columns(
    bitmap: Bitmap, size: int, to_left: bool, combine: Callable[[Bitmap, Bitmap], Bitmap]
) -> Bitmap:
    """Apply `over` along columns, with each word and its neighbour.

    The neighbour is shifted along: XLA stores a bitmap for each step that reads it again.
    """
    beside = _pad(bitmap[1:], (0, 1)) if to_left else _pad(bitmap[:-1], (1, 0))
    toward, away = (
        (jnp.left_shift, jnp.right_shift) if to_left else (jnp.right_shift, jnp.left_shift)
    )
    n = 1
    while n < size:
        step = min(n, size - n)
        bitmap = combine(bitmap, toward(bitmap, U(step)) | away(beside, U(32 - step)))
        beside, n = combine(beside, toward(beside, U(step))), n + step
    return bitmap


def all_within(bitmap: Bitmap, width: int, height: int) -> Bitmap:
    """Select the pixels that are the top left corner of a filled rectangle of this size."""
    return over(over(bitmap, width, shift_left, jnp.bitwise_and), height, shift_up, jnp.bitwise_and)


def any_within(bitmap: Bitmap, width: int, height: int) -> Bitmap:
    """Extend every pixel to a rectangle of this size to its right and below."""
    return over(
        over(bitmap, width, shift_right, jnp.bitwise_or), height, shift_down, jnp.bitwise_or
    )


def bridged(bitmap: Bitmap, gap: int) -> Bitmap:
    """Fill gaps of at most `gap` blank pixels between the pixels of a row."""
    wide = over(_pad(bitmap, (0, 1)), gap + 1, shift_right, jnp.bitwise_or)
    return bitmap | over(wide, gap + 1, shift_left, jnp.bitwise_and)[:-1]


def stretched(masks: Bitmap, gap: tuple[int, int]) -> Bitmap:
    """Spread pixels dx to the right and dy down, to bridge gaps.

    A component keeps its first pixel, and its box grows by (dx, dy). Masks have room for this on
    their right and below.
    """
    dx, dy = gap
    # The word to the left. Pixels move less than 32 columns, so no other word matters.
    before = jnp.pad(masks[:-1], ((1, 0), (0, 0), (0, 0)))
    n = 1
    while n <= dx:
        step = min(n, dx - n + 1)
        masks = masks | (masks >> step) | (before << (32 - step))
        before, n = before | (before >> step), 2 * n
    masks = jnp.pad(masks, ((0, 0), (dy, 0), (0, 0)))
    n = 1
    while n <= dy:
        step = min(n, dy - n + 1)
        masks, n = masks[:, step:] | masks[:, :-step], 2 * n
    return masks


def spread(bitmap: Bitmap, where: jax.Array | np.ndarray = ALL) -> Bitmap:
    """Add to pixels their left and right neighbours in `where`, which broadcasts to the bitmap."""
    where = where.reshape((1,) * (bitmap.ndim - where.ndim) + where.shape)
    return bitmap | ((shift_left(bitmap, 1) | shift_right(bitmap, 1)) & where)


def spread_words(
    words: Sequence[jax.Array], where: jax.Array | np.ndarray = ALL
) -> list[jax.Array]:
    """Apply `spread` to separate words, which XLA fuses with the operations that read them."""
    none = jnp.zeros_like(words[0])
    where = where.reshape((1,) * (none.ndim - where.ndim) + where.shape)
    sides = zip((none, *words[:-1]), words, (*words[1:], none), strict=True)
    return [
        w | (((w << 1) | (right >> 31) | (w >> 1) | (left << 31)) & where)
        for left, w, right in sides
    ]


def fill_rows(
    mask: Bitmap, touched: Sequence[jax.Array] | Bitmap, reach: int = 31
) -> tuple[jax.Array, ...]:
    """Fill the horizontal runs of `mask` that hold a pixel of `touched`, a part of the mask.

    Runs are filled at least `reach` pixels to both sides: within a word, an addition carries to the
    left and doubling steps fill to the right; filled runs then continue from word to word.
    """
    filled = [fill_words(m, t, reach) for m, t in zip(mask, touched, strict=True)]
    # To the right: a run at the top of the word, all ones down to its first zero.
    for i in range(1, len(mask)):
        entering = (filled[i - 1] & 1) != 0
        head = ~(U(0xFFFFFFFF) >> lax.clz(~mask[i]))
        head = jnp.where(mask[i] == U(0xFFFFFFFF), mask[i], head)
        filled[i] = filled[i] | jnp.where(entering, head, U(0))
    for i in reversed(range(len(mask) - 1)):  # to the left: a run at the bottom of the word
        entering = (filled[i + 1] >> 31) != 0
        filled[i] = filled[i] | jnp.where(entering, mask[i] & ~(mask[i] + 1), U(0))
    return tuple(filled)


def fill_words(mask: jax.Array, touched: jax.Array, reach: int = 31) -> jax.Array:
    """Fill runs as in `fill_rows`, but not beyond the words of their touched pixels."""
    filled = mask & (~(mask + touched) | touched)
    n = 1
    while n <= min(reach, 31):
        filled = filled | (mask & (filled >> n))
        if 2 * n <= min(reach, 31):
            mask = mask & (mask >> n)
        n *= 2
    return filled


def popcount(word: jax.Array) -> jax.Array:
    """Count set bits, int32."""
    return lax.population_count(word).astype(jnp.int32)


def nth_bit(word: jax.Array, n: jax.Array) -> jax.Array:
    """Find the position of the n-th set bit, counted from the most significant bit."""
    bit = jnp.zeros_like(n)
    for step in (16, 8, 4, 2, 1):
        head = popcount(word >> (31 - bit - step + 1).astype(U))
        bit = jnp.where(head <= n, bit + step, bit)
    return bit


def at(array: jax.Array, index: jax.Array) -> jax.Array:
    """Return `array[index]` for indices in range, without a bounds check."""
    return array.at[index].get(mode="promise_in_bounds", wrap_negative_indices=False)


def any_of(bitmap: Iterable[jax.Array]) -> jax.Array:
    """Or words together; the result is nonzero in rows that hold a pixel."""
    return functools.reduce(operator.or_, bitmap)


def columns(words: jax.Array, width: int = 32) -> tuple[jax.Array, jax.Array]:
    """Find the first and last set column of rows `[words, ...]`, int32.

    The result of an empty row is (width * words, -1). The top `width` bits of each word count.
    """
    start = width * np.arange(len(words), dtype=np.int32).reshape(-1, *([1] * (words.ndim - 1)))
    first = jnp.where(words != 0, start + lax.clz(words).astype(jnp.int32), width * len(words))
    zeros_below = popcount(~words & (words - 1))
    last = jnp.where(words != 0, start + 31 - zeros_below, -1)
    return jnp.min(first, axis=0), jnp.max(last, axis=0)


def rows(used: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Find the first and last nonzero row of uint32 `[rows, ...]`, int32 `[...]`.

    The last row is -1 if all rows are zero.
    """
    blocks = _blocks(used, 0)
    size = blocks.shape[1]
    bits = np.array(1 << 31 >> np.arange(size), np.uint32).reshape(
        1, -1, *(1 for _ in used.shape[1:])
    )
    return columns(jnp.sum(jnp.where(blocks != 0, bits, U(0)), axis=1, dtype=U), size)


def or_rows(bitmap: jax.Array) -> jax.Array:
    """Or the words of all rows together: uint32 `[words, rows, ...]` -> `[words, ...]`."""
    blocks = _blocks(bitmap, 1)
    return any_of(jnp.moveaxis(lax.reduce(blocks, U(0), lax.bitwise_or, (2,)), 1, 0))


def _blocks(x: jax.Array, axis: int) -> jax.Array:
    """Split an axis into equal, zero-padded blocks of at most `MAX_REDUCED_ROWS` rows."""
    n = x.shape[axis]
    count = -(-n // MAX_REDUCED_ROWS)
    size = -(-n // count)
    padded = jnp.pad(x, [(0, (count * size - n) * (i == axis)) for i in range(x.ndim)])
    return padded.reshape(*x.shape[:axis], count, size, *x.shape[axis + 1 :])
