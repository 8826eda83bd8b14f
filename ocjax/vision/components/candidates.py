"""Second stage: candidates, the pixels where components may begin."""

import functools
import itertools
import operator
from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla.kernels import materialize
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.components.layout import BLOCK_ROWS, Layout

# Bits per count, and counts per word. A word of a row has at most 16 candidates, a row 80.
BITS_OF_WORD_COUNT = 5
BITS_OF_ROW_COUNT = 8
ROW_COUNTS_PER_WORD = 4


class Candidates(NamedTuple):
    """Candidates, int32 `[n]` each."""

    segment: jax.Array  # mask * frames + frame
    row: jax.Array  # row of the board
    column: jax.Array


def starts(
    here: Sequence[jax.Array], above: Sequence[jax.Array], corners: np.ndarray | jax.Array = bm.ALL
) -> list[jax.Array]:
    """Find the first pixels of runs that touch no pixel in the row above, word by word.

    Args:
        here: the words of rows from left to right, uint32 of any shape.
        corners: words with all bits set if pixels that touch at a corner connect, uint32.
    """
    found = []
    for word, over, left in zip(here, above, [None, *here], strict=False):
        free = word & ~(over | (((over << 1) | (over >> 1)) & corners))
        # The carry goes from the last pixel of a free run to the left of its first.
        total = free + (free & ~(word << 1))
        first = ((total & ~word) >> 1) | jnp.where(total < free, U(1 << 31), U(0))
        found.append(first if left is None else first & ~(left << 31))
    return found


class Index:
    """Counts of candidates by word, row, block of rows and segment, to locate the k-th one.

    Candidates are counted but not stored; `locate` computes them again around each position
    (Gravitar: 37 us per frame instead of 40). Packed counts halve the look-ups.
    """

    def __init__(self, layout: Layout, board: Bitmap) -> None:
        self.layout = layout
        searched = int(layout.board.begins[-1]) + 1
        words = layout.board.mask_words  # a component begins in the words of its mask
        self._corners = layout.corners_by_row()[:searched]

        def count_in_words(board: Bitmap) -> jax.Array:
            here, above = board[:words, 1:searched], board[:words, : searched - 1]
            found = starts(list(here), list(above), self._corners[1:, None])
            return _packed([lax.population_count(word) for word in found], BITS_OF_WORD_COUNT)

        def count_in_rows(in_words: jax.Array) -> jax.Array:
            in_rows = _total(_fields(in_words, BITS_OF_WORD_COUNT, words)).astype(U)
            rows = in_rows.reshape(-1, ROW_COUNTS_PER_WORD, in_rows.shape[1])
            return _packed([rows[:, i] for i in range(ROW_COUNTS_PER_WORD)], BITS_OF_ROW_COUNT)

        # Counts by word (packed for each row), by row (packed for four rows) and by block.
        in_words = materialize(count_in_words, board)
        counts = materialize(count_in_rows, in_words)
        blocks = _of_blocks(counts)
        in_blocks_above = jnp.pad(jnp.cumsum(blocks, axis=0), ((1, 0), (0, 0)))
        ends = in_blocks_above[layout.board.begins // BLOCK_ROWS]
        # int32 [segments + 1]: the number of each segment's first candidate, and the total
        self.begins = jnp.pad(jnp.cumsum((ends[1:] - ends[:-1]).ravel()), (1, 0))
        self.total = self.begins[-1]
        self.n_blocks = len(blocks)
        self._board, self._words, self._counts, self._in_blocks_above, self._ends = (
            v.ravel() for v in (board, in_words, counts, in_blocks_above, ends)
        )

    def locate(self, k: jax.Array) -> Candidates:
        """Locate the k-th candidates; beyond the last one, the result is any position in range."""
        n_frames = self.layout.board.n_frames
        mask = jnp.sum(self.begins[n_frames:-1:n_frames, None] <= k[None], axis=0, dtype=jnp.int32)
        first = mask * n_frames
        frame = _last_at_most(lambda i: bm.at(self.begins, first + i), n_frames, k)
        number_in_mask = k - bm.at(self.begins, first + frame)
        number_in_frame = number_in_mask + bm.at(self._ends, first + frame)
        row, number_in_row = self._row(mask, frame, number_in_frame)
        return Candidates(first + frame, row, self._column(frame, row, number_in_row))

    def _row(
        self, mask: jax.Array, frame: jax.Array, number: jax.Array
    ) -> tuple[jax.Array, jax.Array]:
        """Find the row of the candidate that follows `number` others in its frame.

        Returns:
            The row of the board, and the number of those others that are in this row.
        """
        n_frames = self.layout.board.n_frames
        begin = bm.at(jnp.asarray(self.layout.board.begins // BLOCK_ROWS, jnp.int32), mask)
        most = int(np.diff(self.layout.board.begins).max()) // BLOCK_ROWS  # of a mask
        block = begin + _last_at_most(
            lambda i: bm.at(
                self._in_blocks_above, jnp.minimum(begin + i, self.n_blocks) * n_frames + frame
            ),
            most,
            number,
        )
        block = jnp.minimum(block, self.n_blocks - 1)
        number_in_block = number - bm.at(self._in_blocks_above, block * n_frames + frame)
        n_words = BLOCK_ROWS // ROW_COUNTS_PER_WORD  # packed counts of a block
        word = (block * n_words)[None] + np.arange(n_words, dtype=np.int32)[:, None]
        packed = bm.at(self._counts, word * n_frames + frame[None])
        in_rows = [_fields(counts, BITS_OF_ROW_COUNT, ROW_COUNTS_PER_WORD) for counts in packed]
        row, number_in_row = _locate(list(itertools.chain.from_iterable(in_rows)), number_in_block)
        return block * BLOCK_ROWS + row + 1, number_in_row

    def _column(self, frame: jax.Array, row: jax.Array, number: jax.Array) -> jax.Array:
        """Find the column of the candidate that follows `number` others in its row."""
        board = self.layout.board
        packed = bm.at(self._words, (row - 1) * board.n_frames + frame)
        in_words = _fields(packed, BITS_OF_WORD_COUNT, board.mask_words)
        word, number_in_word = _locate(in_words, number)
        place = (word * board.rows + row) * board.n_frames + frame
        here, above = bm.at(self._board, place), bm.at(self._board, place - board.n_frames)
        beside = bm.at(self._board, jnp.maximum(place - board.rows * board.n_frames, 0))
        left = jnp.where(word > 0, beside, U(0))
        corners = (
            self._corners[0]
            if len(set(self._corners)) == 1
            else bm.at(jnp.asarray(self._corners), row)
        )
        _, first_pixels = starts([left, here], [left, above], corners)
        return 32 * word + bm.nth_bit(first_pixels, number_in_word)


def _fields(words: jax.Array, bits: int, n: int) -> list[jax.Array]:
    """Unpack the first n numbers of `bits` bits from words, lowest first, int32."""
    return [(words >> bits * i & (1 << bits) - 1).astype(jnp.int32) for i in range(n)]


def _total(numbers: Sequence[jax.Array]) -> jax.Array:
    return functools.reduce(operator.add, numbers)


def _of_blocks(counts: jax.Array) -> jax.Array:
    """Add up the packed counts of rows, int32 `[blocks, frames]`."""
    of_four_rows = _total(_fields(counts, BITS_OF_ROW_COUNT, ROW_COUNTS_PER_WORD))
    n_words = BLOCK_ROWS // ROW_COUNTS_PER_WORD
    return jnp.sum(of_four_rows.reshape(-1, n_words, counts.shape[1]), axis=1, dtype=jnp.int32)


def _packed(numbers: Sequence[jax.Array], bits: int) -> jax.Array:
    """Pack numbers of `bits` bits in words, lowest first, uint32."""
    return functools.reduce(operator.or_, (word << bits * i for i, word in enumerate(numbers)))


def _last_at_most(table: Callable[[jax.Array], jax.Array], n: int, k: jax.Array) -> jax.Array:
    """Find the largest i < n with `table(i) <= k`, in an ascending table."""
    i = jnp.zeros_like(k)
    for bit in reversed(range((n - 1).bit_length())):
        ahead = i + (1 << bit)
        i = jnp.where((ahead < n) & (table(jnp.minimum(ahead, n - 1)) <= k), ahead, i)
    return i


def _locate(counts: Sequence[jax.Array], number: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Find which of the counts `[n]` includes item `number` `[n]`, and the item's number there."""
    index, beyond = jnp.zeros_like(number), jnp.ones_like(number, bool)
    for count in counts[:-1]:
        beyond = beyond & (number >= count)
        index = index + beyond.astype(jnp.int32)
        number = number - jnp.where(beyond, count, 0)
    return index, number
