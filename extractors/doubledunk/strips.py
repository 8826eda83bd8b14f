"""The likeliest strip and row of the court for a kind of DoubleDunk's figures.

A strip is two halves of 16 columns, and each half is in two strips. A word holds a bit for each
strip, so all strips are searched together.
"""

import functools
import operator
from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from ocjax.authoring import Bitmap, U, bitmaps, materialize
from ocjax.extractors.doubledunk.kinds import HALF_STRIP, SKIN_ROWS, Figure

STRIP_COUNT = 11
ALL_STRIPS = 2**STRIP_COUNT - 1
LEVELS = 6  # bits of a count of rows
LEVELS_OF_EIGHT = 4  # bits of a count in eight rows


def _strips_of(pixels: Bitmap, taken: Bitmap) -> jax.Array:
    """A bit for each strip with untaken pixels in a row, uint32 `[rows, B]`."""
    free = [pixels[word] & ~taken[word] for word in range(len(pixels))]
    halves = functools.reduce(operator.or_, map(_halves_of, range(len(free)), free))
    return halves | halves << 1


def _halves_of(word: int, free: jax.Array) -> jax.Array:
    """A bit for each half of a word with pixels, at its position among all halves."""
    left = jnp.where(free >> HALF_STRIP != 0, U(1 << 2 * word), U(0))
    right = jnp.where(free << HALF_STRIP != 0, U(1 << 2 * word + 1), U(0))
    return left | right


def row_counts(masks: jax.Array, shown: Bitmap, taken: Bitmap, kind: Figure) -> list[jax.Array]:
    """The bits of the counts of fitting rows after each row, the lowest first, `[rows, B]`.

    A row counts 2 if a strip has its colour, 1 if it has none, and 0 if it has others.
    """
    colors = sorted(set(kind.colors))

    def in_colors(masks: jax.Array, taken: Bitmap) -> list[jax.Array]:
        return [_strips_of(masks[color], taken) for color in colors]

    strips = dict(zip(colors, materialize(in_colors, masks, taken), strict=True))
    none = materialize(lambda s, t: ~_strips_of(s, t), shown, taken)
    empty = materialize(_count_of_eight, none)
    skin = materialize(_count_of_eight, strips[kind.colors[kind.skin]])

    def counts(none: jax.Array, *rest: jax.Array) -> list[jax.Array]:
        in_color = dict(zip(colors, rest[2 * LEVELS_OF_EIGHT :], strict=True))
        skin_counts = rest[LEVELS_OF_EIGHT : 2 * LEVELS_OF_EIGHT]
        return _sum(_to_sum(in_color, none, rest[:LEVELS_OF_EIGHT], skin_counts, kind))

    return materialize(counts, none, *empty, *skin, *strips.values())


def _to_sum(
    strips: Mapping[int, jax.Array],
    none: jax.Array,
    empty: Sequence[jax.Array],
    skin: Sequence[jax.Array],
    kind: Figure,
) -> list[list[jax.Array]]:
    """The summands for each possible first row of a figure: bits, by their value.

    Rows without a colour are counted in eights (`empty`), and so are the rows of skin (`skin`). The
    remaining rows are counted singly.
    """
    height = kind.height
    starts = len(none) - kind.height
    summands = [[] for _ in range(LEVELS)]
    others = [row for row in range(height) if not 0 <= row - kind.skin < SKIN_ROWS]
    summands[1].extend(strips[kind.colors[row]][row : row + starts] for row in others)
    in_eights = height // SKIN_ROWS * SKIN_ROWS
    summands[0].extend(none[row : row + starts] for row in range(in_eights, height))
    for level, (of_empty, of_skin) in enumerate(zip(empty, skin, strict=True)):
        eights = range(0, height - SKIN_ROWS + 1, SKIN_ROWS)
        summands[level].extend(of_empty[row : row + starts] for row in eights)
        summands[level + 1].append(of_skin[kind.skin : kind.skin + starts])
    return summands


def _count_of_eight(rows: jax.Array) -> list[jax.Array]:
    """The bits of the count in eight rows, starting at each row, the lowest first."""
    starts = len(rows) - SKIN_ROWS + 1
    ones = [rows[row : row + starts] for row in range(SKIN_ROWS)]
    return _sum([ones, *([] for _ in range(LEVELS_OF_EIGHT - 1))])


def _sum(
    summands: Sequence[Sequence[jax.Array]], carried: Sequence[jax.Array] = ()
) -> list[jax.Array]:
    """The bits of sums, the lowest first, from lists of bits of equal value.

    Three bits at a time are added to one bit of the same value and a carry.
    """
    if not summands:
        return []
    ones = [*summands[0], *carried]
    carries = []
    while len(ones) > 1:
        a = ones.pop(0)
        b = ones.pop(0)
        c = ones.pop(0) if ones else None
        odd = a ^ b
        ones.append(odd if c is None else odd ^ c)
        carries.append(a & b if c is None else a & b | odd & c)
    return [ones[0], *_sum(summands[1:], carries)]


def likeliest(counts: Sequence[jax.Array], kind: Figure) -> tuple[jax.Array, ...]:
    """The greatest count of fitting rows, and its row and strip, int32 `[B]` each.

    The search drops the strips without a set bit of the greatest count, from the highest bit down.
    The result is the middle one of the remaining strips in their first row.
    """
    start = jnp.full_like(counts[0], ALL_STRIPS), jnp.zeros_like(counts[0][0], jnp.int32)
    best, most = functools.reduce(_narrowed, reversed(list(enumerate(counts))), start)
    row, _ = bitmaps.rows(best)
    lanes = np.arange(best.shape[1])
    strips = best.ravel().at[row * len(lanes) + lanes].get(mode="clip")
    first = bitmaps.popcount(~strips & (strips - 1))
    last = 31 - lax.clz(strips).astype(jnp.int32)
    return most - kind.height, row, (first + last) >> 1


def _narrowed(
    before: tuple[jax.Array, jax.Array], bit: tuple[int, jax.Array]
) -> tuple[jax.Array, jax.Array]:
    """The strips that remain after a bit of the counts, and the count so far."""
    best, most = before
    place, counts = bit
    fewer, is_any = materialize(_with_bit, best, counts)
    return jnp.where(is_any[None], fewer, best), most + jnp.where(is_any, 1 << place, 0)


def _with_bit(best: jax.Array, bit: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The strips with a set bit in their counts, and True if such strips exist."""
    fewer = best & bit
    return fewer, bitmaps.or_rows(fewer[None])[0] != 0
