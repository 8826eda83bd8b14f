"""The best fit of the pictures of a kind of DoubleDunk's figures around a strip.

A window is a strip in the rows of a figure, a word per row. Pictures are compared in packed form:
with eight columns of four rows in a word (`Figure.packed`).
"""

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from ocjax.authoring import Bitmap, U, bitmaps, match, materialize
from ocjax.extractors.doubledunk.kinds import (
    HALF_STRIP,
    PACKED_ROWS,
    PICTURE_WORDS,
    ROWS_A_WORD,
    WIDE,
    Figure,
)

STRIP_WIDTH = 2 * HALF_STRIP
COLUMN_COUNT = STRIP_WIDTH - WIDE + 1  # possible first columns of a figure in a strip
INNER = np.uint32(0x3FFFFFFC)  # the columns of a strip except two at each side
TRIED_AROUND = np.arange(-2, 3)  # columns around the likeliest one for the pictures
MOST_PIXELS = 512  # more than a window and a picture can have together
A_ROW_LOWER = np.array((0, 0, 0, 1))  # added to edges: left, top, right, bottom


def best_fit(
    masks: jax.Array, shown: Bitmap, taken: Bitmap, row: jax.Array, strip: jax.Array, kind: Figure
) -> tuple[jax.Array, ...]:
    """The best picture: its first column, the pixels of its rows, and its edges."""
    around = _windows_around(masks, shown, taken, row, strip, kind)
    own, seen, chosen = _fullest(*around, strip)
    which, column = _best_picture(kind, own)
    picture = jnp.take(jnp.asarray(kind.packed), which, axis=1, mode="clip")
    in_own_colors = materialize(_eight_columns_at, own, column)
    in_any = materialize(_eight_columns_at, seen, column)
    left = HALF_STRIP * (chosen - 1) + column
    own_ink = in_own_colors & picture
    edges = _seen_edges(own_ink, in_any & picture, left, row, kind)
    feet = _repeated_feet(in_own_colors, picture, kind)
    is_lower = (feet != 0) & (edges[3] == row + kind.height)
    again = jnp.where(is_lower, feet << U(WIDE * (kind.height % ROWS_A_WORD)), U(0))
    ink = jnp.concatenate([own_ink[:-1], (own_ink[-1] | again)[None]])
    return left, ink, edges + jnp.where(is_lower, 1, 0)[None] * A_ROW_LOWER[:, None]


def _repeated_feet(in_own_colors: jax.Array, picture: jax.Array, kind: Figure) -> jax.Array:
    """The last row of a picture if the row below repeats it, otherwise 0."""
    feet = _unpacked(picture, kind.height)[-1]
    below = _unpacked(in_own_colors, kind.height + 1)[-1]
    return jnp.where(feet & below == feet, feet, U(0))


def _windows_around(
    masks: jax.Array, shown: Bitmap, taken: Bitmap, row: jax.Array, strip: jax.Array, kind: Figure
) -> tuple[jax.Array, jax.Array]:
    """The pixels in the colours of the kind's rows outside taken pixels, and all colours' pixels.

    They are three words across, starting with the word before the strip: `[3, rows, B]`.
    """
    colors = np.array((*kind.colors, kind.colors[-1]))[:, None]  # the line below is like the last
    one = 0 * colors
    first = (strip >> 1) - 1
    own = materialize(lambda m, r, s: _words_at(m, colors, r, s), masks, row, first, small=0)
    seen = materialize(lambda m, r, s: _words_at(m, one, r, s), shown[None], row, first, small=0)
    others = materialize(lambda m, r, s: _words_at(m, one, r, s), taken[None], row, first, small=0)
    return own & ~others, seen


def _words_at(masks: jax.Array, index: np.ndarray, row: jax.Array, first: jax.Array) -> jax.Array:
    """Three words of each of the rows from `row`, uint32 `[3, rows, B]`; 0 beside the screen.

    Args:
        masks: bitmaps, `[n, words, rows, B]`.
        index: of the bitmap of each row, `[rows, 1]`.
        row, first: int32 `[B]`, the first row and the first word.
    """
    _, words, height, lanes = masks.shape
    rows = row[None] + np.arange(len(index))[:, None]
    at = (first[None] + np.arange(3)[:, None])[:, None]
    flat = ((index[None] * words + jnp.clip(at, 0, words - 1)) * height + rows[None]) * lanes
    got = masks.ravel().at[flat + np.arange(lanes)[None, None]].get(mode="clip")
    return jnp.where((at >= 0) & (at < words), got, U(0))


def _windows(words: jax.Array, strip: jax.Array) -> tuple[jax.Array, ...]:
    """Three overlapping strips of three words, `[rows, B]` each: `strip` is the middle one."""
    one, two, three = words
    is_odd = ((strip & 1) == 1)[None]
    left = jnp.where(is_odd, one << HALF_STRIP | two >> HALF_STRIP, one)
    right = jnp.where(is_odd, two << HALF_STRIP | three >> HALF_STRIP, two)
    return left, left << HALF_STRIP | right >> HALF_STRIP, right


def _fullest(
    own: jax.Array, seen: jax.Array, strip: jax.Array
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """The windows of the strip with the most inner pixels of three; ties go to the middle one."""
    counts = (jnp.sum(bitmaps.popcount(w & INNER), axis=0) for w in _windows(own, strip))
    left, middle, right = counts
    is_middle = (middle >= left) & (middle >= right)
    is_left = left >= right

    def chosen(words: jax.Array) -> jax.Array:
        before, here, after = _windows(words, strip)
        return jnp.where(is_middle[None], here, jnp.where(is_left[None], before, after))

    moved = match((is_middle, 0), (is_left, -1), otherwise=1)
    return *(materialize(chosen, words, small=0) for words in (own, seen)), strip + moved


def _best_picture(kind: Figure, own: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The picture that fits best, and its first column in the window, int32 `[B]` each.

    The pictures are tried near the eight columns with the most pixels. A pixel of a picture counts
    1 if the window has it, otherwise -1; each other pixel of the window counts -1.
    """
    near = _fullest_column(own)
    tried = jnp.clip(near[None] + TRIED_AROUND[:, None], 0, COLUMN_COUNT - 1)
    there = materialize(_eight_columns, own, tried)
    pixels = materialize(_pixel_count, there)
    scored = materialize(lambda t, p: _scores(kind, t, p), there, pixels, small=0)
    best = jnp.max(jnp.max(scored, axis=0), axis=0) % (scored.shape[0] * len(TRIED_AROUND))
    column = near + best % len(TRIED_AROUND) + TRIED_AROUND[0]
    return best // len(TRIED_AROUND), jnp.clip(column, 0, COLUMN_COUNT - 1)


def _scores(kind: Figure, there: jax.Array, pixels: jax.Array) -> jax.Array:
    """Scores of each picture in each of the columns, with its number: `[picture, tried, B]`."""
    pictures = [jnp.asarray(word)[:, None, None] for word in kind.packed]
    hits = sum(bitmaps.popcount(p & t[None]) for p, t in zip(pictures, there, strict=True))
    size = np.bitwise_count(kind.packed).sum(0, dtype=np.int32)[:, None, None]
    score = 2 * hits - pixels[None] - size + MOST_PIXELS
    numbers = np.arange(len(size) * len(TRIED_AROUND)).reshape(len(size), len(TRIED_AROUND))
    return score * numbers.size + numbers[..., None]


def _fullest_column(own: jax.Array) -> jax.Array:
    """The leftmost column at which eight columns have the most pixels, int32 `[B]`."""
    columns = np.arange(COLUMN_COUNT)[:, None]
    packed = materialize(lambda o: _eight_columns(o, columns), own)
    counts = materialize(_pixel_count, packed)
    from_right = COLUMN_COUNT - 1 - columns
    best = jnp.max(counts * COLUMN_COUNT + from_right, axis=0) % COLUMN_COUNT
    return COLUMN_COUNT - 1 - best


def _pixel_count(packed: jax.Array) -> jax.Array:
    """Pixels of all words."""
    return sum((bitmaps.popcount(word) for word in packed[1:]), bitmaps.popcount(packed[0]))


def _eight_columns_at(window: jax.Array, column: jax.Array) -> jax.Array:
    """Eight columns of a window, starting at `column`, four rows in a word, uint32 `[words, B]`."""
    return _eight_columns(window, column[None])[:, 0]


def _eight_columns(window: jax.Array, column: jax.Array | np.ndarray) -> jax.Array:
    """Eight columns from each of the columns, four rows per word, uint32 `[words, columns, B]`."""
    shift = jnp.asarray(STRIP_WIDTH - WIDE - column, U)
    padded = jnp.pad(window, ((0, PACKED_ROWS - len(window)), (0, 0)))
    shifted = padded[:, None] >> shift[None] & U(255)
    rows = shifted.reshape(PICTURE_WORDS, ROWS_A_WORD, len(shift), -1)
    return bitmaps.any_of(rows[:, i] << U(WIDE * i) for i in range(ROWS_A_WORD))


def _unpacked(words: jax.Array, count: int) -> jax.Array:
    """The first rows of packed rows, uint32 `[rows, B]`."""
    shift = WIDE * (np.arange(count, dtype=np.uint32) % ROWS_A_WORD)[:, None]
    rows = jnp.repeat(words, ROWS_A_WORD, axis=0)[:count]
    return rows >> shift & U(255)


def _seen_edges(
    ink: jax.Array, parts: jax.Array, left: jax.Array, top: jax.Array, kind: Figure
) -> jax.Array:
    """The edges of the visible parts of a picture, between its first and last row of ink."""
    first, last = bitmaps.rows(_unpacked(ink, kind.height))
    row = np.arange(kind.height)[:, None]
    inside = (first[None] <= row) & (row <= last[None])
    columns = bitmaps.or_rows(jnp.where(inside, _unpacked(parts, kind.height), U(0))[None])[0]
    begin = lax.clz(columns).astype(jnp.int32) - (32 - WIDE)
    end = WIDE - bitmaps.popcount(~columns & (columns - 1))
    is_seen = (last >= 0) & (columns != 0)
    edges = jnp.stack([left + begin, top + first, left + end, top + last + 1])
    return jnp.where(is_seen[None], edges, 0)


def with_figure(taken: Bitmap, ink: jax.Array, row: jax.Array, left: jax.Array) -> Bitmap:
    """The taken pixels together with a figure's pixels."""
    words, height, _ = taken.shape
    pixels = materialize(lambda i, r: _rows_of(i, r, height), ink, row, small=0)
    first = left[None] - 32 * np.arange(words)[:, None]  # of the leftmost pixel in each word
    to_left = jnp.clip(32 - WIDE - first, -31, 31)[:, None]
    shifted = jnp.where(
        to_left >= 0,
        pixels[None] << jnp.maximum(to_left, 0).astype(U),
        pixels[None] >> jnp.maximum(-to_left, 0).astype(U),
    )
    here = (first > -WIDE) & (first < 32)
    return taken | jnp.where(here[:, None], shifted, U(0))


def _rows_of(ink: jax.Array, row: jax.Array, height: int) -> jax.Array:
    """The rows of the court with a figure that begins at a row, uint32 `[height, B]`."""
    at = np.arange(height)[:, None] - row[None]
    which = at // ROWS_A_WORD
    shift = (WIDE * (at % ROWS_A_WORD)).astype(U)
    word = bitmaps.any_of(jnp.where(which == i, w[None], U(0)) for i, w in enumerate(ink))
    return word >> shift & U(255)
