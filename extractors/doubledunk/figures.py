"""DoubleDunk's figures: players whose rows have known colours, told apart although they overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from ocjax._xla.kernels import materialize
from ocjax.console.ops import match
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U

WIDE = 8  # columns of a figure
HALF_STRIP = 16  # columns; a strip of the court has two halves, and shares each with another strip
STRIP_COUNT = 11
COLUMN_COUNT = 2 * HALF_STRIP - WIDE + 1  # columns of a strip in which a figure can begin
INNER = np.uint32(0x3FFFFFFC)  # the columns of a strip but for two at each side
TRIED_NEAR = 2  # columns around the likeliest one in which pictures are tried
ROWS_A_WORD = 4  # rows of a picture in a word
PICTURE_WORDS = 7  # of a picture, and of the line below it
SKIN_ROWS = 8
LEVELS = 6  # bits of a count of rows
NO_FIGURE = "rest"  # the pixels of no figure
ANY_COLOR = "shown"  # of all figures, and of what covers them
MOST_PIXELS = 512  # more than a window can have beside a picture's
LOWER = (0, 0, 0, 1)  # edges that are one row lower
STRIP_BITS = 2**STRIP_COUNT - 1


@dataclass(frozen=True)
class Figure:
    """A kind of figure.

    Args:
        name: the category.
        colors: of its rows, from the top, as indices into the colours of all figures.
        pictures: the pixels of its rows, from the top, `[pictures, rows]` bytes.
        least: rows that have to fit, less those that have other colours.
    """

    name: str
    colors: tuple[int, ...]
    pictures: np.ndarray
    least: int

    @property
    def skin(self) -> int:
        """The first of eight rows of one colour."""
        runs = (self.colors[j : j + SKIN_ROWS] for j in range(len(self.colors)))
        return next(j for j, run in enumerate(runs) if len(set(run)) == 1)

    @property
    def packed(self) -> np.ndarray:
        """The pictures with four rows in a word, `[words, pictures]`."""
        below = PICTURE_WORDS * ROWS_A_WORD - len(self.colors)
        rows = np.pad(self.pictures, ((0, 0), (0, below))).astype(np.uint32)
        words = rows.reshape(len(rows), -1, ROWS_A_WORD) << (
            8 * np.arange(ROWS_A_WORD, dtype=np.uint32)
        )
        return words.sum(-1, dtype=np.uint32).T


@dataclass(frozen=True, eq=False)
class Figures:
    """A search for one figure of each kind.

    A kind is looked for where most rows of a strip of the court hold its colours from top to
    bottom. Its picture is the one that covers most of its pixels there. They do not count for the
    kinds that follow.

    Args:
        kinds: in the order in which they are looked for.
        colors: of all of them, and first of what else may cover a figure.
        rows: the first row of the screen that is looked at, and the one after the last.
    """

    kinds: tuple[Figure, ...]
    colors: tuple[int, ...]
    rows: tuple[int, int]

    def __call__(self, planes: jax.Array) -> dict[str, jax.Array]:
        """The edges of each kind's figure, int32 `[4, B]`; 0: none. `NO_FIGURE`: other pixels."""
        top, bottom = self.rows
        court = planes[:, :, top:bottom]
        masks = materialize(
            lambda p: jnp.stack([bm.color_mask(p, [c]) for c in self.colors]), court
        )
        shown = materialize(lambda p: bm.color_mask(p, self.colors), court)
        taken, out = jnp.zeros_like(shown), {}
        for kind in self.kinds:
            taken, edges = _search(masks, shown, taken, kind)
            seen = edges[2:3] > 0
            out[kind.name] = jnp.where(seen, edges + np.array((0, top) * 2)[:, None], 0)
        out[ANY_COLOR] = shown
        out[NO_FIGURE] = materialize(
            lambda m, t: jnp.stack([m[0], bm.any_of(m)]) & ~t[None], masks, taken
        )
        return out


def _search(
    masks: jax.Array, shown: Bitmap, taken: Bitmap, kind: Figure
) -> tuple[Bitmap, jax.Array]:
    """The pixels that are taken when this kind has been looked for, too, and its edges."""
    strips = materialize(_strips_of, masks, taken)
    counts = _row_counts(strips, kind)
    score, row, strip = materialize(lambda *c: _likeliest(c, kind), *counts)
    column, ink, edges = materialize(
        lambda *a: _fit(*a, kind=kind), masks, shown, taken, row, strip
    )
    found = (score >= kind.least)[None]
    taken = materialize(_with, taken, jnp.where(found, ink, U(0)), row, column)
    return taken, jnp.where(found, edges, 0)


def _likeliest(counts: Sequence[jax.Array], kind: Figure) -> tuple[jax.Array, ...]:
    """How many rows fit best, and the row and the strip in which they begin, int32 `[B]` each.

    A row counts 2 where a strip has its colour, and 0 where it has others only.
    """
    best = jnp.full_like(counts[0], STRIP_BITS)
    most = jnp.zeros_like(counts[0][0], jnp.int32)
    for place, bit in reversed(list(enumerate(counts))):
        better, some = materialize(_narrowed, best, bit)
        best = jnp.where(some[None], better, best)
        most = most + jnp.where(some, 1 << place, 0)
    row, _ = bm.rows(best)
    lanes = np.arange(best.shape[1])
    bits = best.ravel().at[row * len(lanes) + lanes].get(mode="clip")
    first, last = bm.popcount(~bits & (bits - 1)), 31 - lax.clz(bits).astype(jnp.int32)
    return most - len(kind.colors), row, (first + last) >> 1


def _colorless(strips: jax.Array) -> jax.Array:
    """A bit for each strip that has no colour in a row, uint32 `[rows, B]`."""
    return ~bm.any_of(strips)


def _narrowed(best: jax.Array, bit: jax.Array) -> tuple[jax.Array, jax.Array]:
    better = best & bit
    return better, bm.or_rows(better[None])[0] != 0


def _strips_of(masks: jax.Array, taken: Bitmap) -> jax.Array:
    """A bit for each strip that has a colour in a row, uint32 `[colours, rows, B]`."""
    halves = jnp.zeros_like(masks[:, 0])
    for word in range(masks.shape[1]):
        pixels = masks[:, word] & ~taken[word][None]
        for half, own in enumerate((pixels >> HALF_STRIP, pixels << HALF_STRIP)):
            halves = halves | jnp.where(own != 0, U(1 << (2 * word + half)), U(0))
    return halves | halves << 1


def _row_counts(strips: jax.Array, kind: Figure) -> list[jax.Array]:
    """The bits of the counts of rows that fit from each row on, the lowest first, `[rows, B]`."""
    none, n = materialize(_colorless, strips), len(kind.colors)
    empty, skin = (
        materialize(_count_of_eight, rows) for rows in (none, strips[kind.colors[kind.skin]])
    )

    def summed(strips: jax.Array, none: jax.Array, *eights: jax.Array) -> list[jax.Array]:
        last = len(none) - n
        columns = [[] for _ in range(LEVELS)]
        rows = [j for j in range(n) if not 0 <= j - kind.skin < SKIN_ROWS]
        columns[1] += [strips[kind.colors[j], j : j + last] for j in rows]
        columns[0] += [none[j : j + last] for j in range(n // SKIN_ROWS * SKIN_ROWS, n)]
        for level, (of_empty, of_skin) in enumerate(zip(eights[:4], eights[4:], strict=True)):
            columns[level] += [
                of_empty[j : j + last] for j in range(0, n - SKIN_ROWS + 1, SKIN_ROWS)
            ]
            columns[level + 1].append(of_skin[kind.skin : kind.skin + last])
        return _sum(columns)

    return materialize(summed, strips, none, *empty, *skin)


def _count_of_eight(rows: jax.Array) -> list[jax.Array]:
    """The bits of the count in eight rows from each one on, the lowest first."""
    last = len(rows) - SKIN_ROWS + 1
    return _sum([[rows[j : j + last] for j in range(SKIN_ROWS)], [], [], []])


def _sum(columns: list[list[jax.Array]]) -> list[jax.Array]:
    """The bits of sums, the lowest first, from bits of the same worth in each column."""
    out, carries = [], []
    for column in columns:
        ones, carries = column + carries, []
        while len(ones) > 1:
            a, b = ones.pop(0), ones.pop(0)
            c = ones.pop(0) if ones else None
            odd = a ^ b
            ones.append(odd if c is None else odd ^ c)
            carries.append(a & b if c is None else a & b | odd & c)
        out.append(ones[0])
    return out


def _windows(bitmaps: jax.Array, index: np.ndarray, row: jax.Array, strip: jax.Array) -> jax.Array:
    """Three overlapping strips in rows from one on, uint32 `[3, rows, B]`: the middle one is given.

    Args:
        bitmaps: `[n, words, rows, B]`.
        index: of the bitmap of each row, `[rows, 1]`.
        row, strip: int32 `[B]`.
    """
    _, words, height, lanes = bitmaps.shape
    rows = row[None] + np.arange(len(index))[:, None]

    def word(at: jax.Array) -> jax.Array:
        flat = ((index * words + jnp.clip(at, 0, words - 1)[None]) * height + rows) * lanes
        got = bitmaps.ravel().at[flat + np.arange(lanes)[None]].get(mode="clip")
        return jnp.where(((at >= 0) & (at < words))[None], got, U(0))

    first = (strip >> 1) - 1
    one, two, three = word(first), word(first + 1), word(first + 2)
    odd = (strip & 1) == 1
    left = jnp.where(odd[None], one << HALF_STRIP | two >> HALF_STRIP, one)
    right = jnp.where(odd[None], two << HALF_STRIP | three >> HALF_STRIP, two)
    return jnp.stack([left, left << HALF_STRIP | right >> HALF_STRIP, right])


def _eight_columns(window: jax.Array, column: jax.Array | np.ndarray) -> jax.Array:
    """Eight columns from each of some on, four rows in a word, uint32 `[words, columns, B]`."""
    shift = jnp.asarray(2 * HALF_STRIP - WIDE - column, U)
    window = jnp.pad(window, ((0, PICTURE_WORDS * ROWS_A_WORD - len(window)), (0, 0)))
    rows = (window[:, None] >> shift[None] & U(255)).reshape(
        PICTURE_WORDS, ROWS_A_WORD, len(shift), -1
    )
    return bm.any_of(rows[:, i] << U(8 * i) for i in range(ROWS_A_WORD))


def _fit(
    masks: jax.Array, shown: Bitmap, taken: Bitmap, row: jax.Array, strip: jax.Array, kind: Figure
) -> tuple[jax.Array, ...]:
    """The picture that fits best: its first column, the pixels of its rows, and its edges."""
    colors = np.array((*kind.colors, kind.colors[-1]))[:, None]
    own = materialize(lambda m, r, s: _windows(m, colors, r, s), masks, row, strip)
    seen = materialize(lambda m, r, s: _windows(m, 0 * colors, r, s), shown[None], row, strip)
    others = materialize(lambda m, r, s: _windows(m, 0 * colors, r, s), taken[None], row, strip)
    own, seen, strip = _fullest(own & ~others, seen, strip)
    which, column = _best_picture(kind, own)
    picture = jnp.take(jnp.asarray(kind.packed), which, axis=1, mode="clip")
    mine, every = (
        materialize(lambda w, c: _eight_columns(w, c[None])[:, 0], w, column) for w in (own, seen)
    )
    left, n = HALF_STRIP * strip - HALF_STRIP + column, len(kind.colors)
    ink = mine & picture
    edges = _seen_edges(_unpacked(ink, n), _unpacked(every & picture, n), left, row)
    feet, below = _unpacked(picture, n)[-1], _unpacked(mine, n + 1)[-1]
    twice = (feet != 0) & (feet & below == feet) & (edges[3] == row + n)
    again = jnp.where(twice, feet << U(8 * (n % ROWS_A_WORD)), U(0))
    ink = jnp.concatenate([ink[:-1], (ink[-1] | again)[None]])
    return left, ink, edges + jnp.where(twice, 1, 0)[None] * np.array(LOWER)[:, None]


def _fullest(
    own: jax.Array, seen: jax.Array, strip: jax.Array
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """The windows of the strip that has the most inner pixels of three, the middle one first."""
    left, middle, right = (jnp.sum(bm.popcount(own[i] & INNER), axis=0) for i in range(3))
    is_middle, is_left = (middle >= left) & (middle >= right), left >= right

    def chosen(of: jax.Array) -> jax.Array:
        return jnp.where(is_middle[None], of[1], jnp.where(is_left[None], of[0], of[2]))

    moved = match((is_middle, 0), (is_left, -1), otherwise=1)
    return materialize(chosen, own), materialize(chosen, seen), strip + moved


def _best_picture(kind: Figure, own: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The picture that fits best, and its first column in the window, int32 `[B]` each.

    The pictures are tried near the eight columns with the most pixels. A pixel of a picture that
    is there counts 1 and one that is not -1, and so does each other pixel.
    """
    offsets = np.arange(COLUMN_COUNT)[:, None]
    counts = sum(
        bm.popcount(word) for word in materialize(lambda o: _eight_columns(o, offsets), own)
    )
    near = (
        COLUMN_COUNT
        - 1
        - jnp.max(counts * COLUMN_COUNT + COLUMN_COUNT - 1 - offsets, axis=0) % COLUMN_COUNT
    )
    tried = jnp.clip(
        near[None] + np.arange(-TRIED_NEAR, TRIED_NEAR + 1)[:, None], 0, COLUMN_COUNT - 1
    )
    mine = materialize(_eight_columns, own, tried)
    pixels = materialize(lambda m: sum(bm.popcount(word) for word in m), mine)
    pictures = [jnp.asarray(word)[:, None, None] for word in kind.packed]
    hits = sum(bm.popcount(p & m[None]) for p, m in zip(pictures, mine, strict=True))
    size = np.bitwise_count(kind.packed).sum(0, dtype=np.int32)[:, None, None]
    score = 2 * hits - pixels[None] - size + MOST_PIXELS
    n = len(tried)
    places = n * np.arange(len(size))[:, None] + np.arange(n)
    best = jnp.max(jnp.max(score * places.size + places[..., None], axis=0), axis=0) % places.size
    return best // n, jnp.clip(near + best % n - TRIED_NEAR, 0, COLUMN_COUNT - 1)


def _unpacked(words: jax.Array, count: int) -> jax.Array:
    """The first rows of packed ones, uint32 `[rows, B]`."""
    shift = 8 * (np.arange(count, dtype=np.uint32) % ROWS_A_WORD)[:, None]
    rows = jnp.repeat(words, ROWS_A_WORD, axis=0, total_repeat_length=ROWS_A_WORD * PICTURE_WORDS)[
        :count
    ]
    return rows >> shift & U(255)


def _seen_edges(ink: jax.Array, parts: jax.Array, left: jax.Array, top: jax.Array) -> jax.Array:
    """Left, top, right, bottom of what is seen from the first to the last row with own pixels."""
    first, last = bm.rows(ink)
    row = np.arange(len(parts))[:, None]
    inside = (first[None] <= row) & (row <= last[None])
    columns = bm.or_rows(jnp.where(inside, parts, U(0))[None])[0]
    begin = lax.clz(columns).astype(jnp.int32) - 24
    end = 8 - bm.popcount(~columns & (columns - 1))
    found = (last >= 0) & (columns != 0)
    edges = jnp.stack([left + begin, top + first, left + end, top + last + 1])
    return jnp.where(found[None], edges, 0)


def _with(taken: Bitmap, ink: jax.Array, row: jax.Array, left: jax.Array) -> jax.Array:
    """The pixels that are taken, with those of a figure."""
    words, height, lanes = taken.shape
    at = np.arange(height)[:, None] - row[None]
    n = ROWS_A_WORD * len(ink)
    inside = (at >= 0) & (at < n)
    at = jnp.clip(at, 0, n - 1)
    word = ink.ravel().at[at // ROWS_A_WORD * lanes + np.arange(lanes)[None]].get(mode="clip")
    pixels = jnp.where(inside, word >> (8 * (at % ROWS_A_WORD)).astype(U) & U(255), U(0))
    shift = left[None] - 32 * np.arange(words)[:, None]  # of the leftmost pixel in each word
    to_right = jnp.clip(24 - shift, -31, 31)
    shifted = jnp.where(
        to_right[:, None] >= 0,
        pixels[None] << jnp.maximum(to_right, 0).astype(U)[:, None],
        pixels[None] >> jnp.maximum(-to_right, 0).astype(U)[:, None],
    )
    here = (shift > -8) & (shift < 32)
    return taken | jnp.where(here[:, None], shifted, U(0))
