"""Static layout of the masks on the board, and each mask's table entries for the stages."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.vision.bitmap import Bitmap
from ocjax.vision.components.search import UNLIMITED, Search, words_across
from ocjax.vision.pictures import Picture
from ocjax.vision.shapes import Shape, limits

# Rows per sum of candidates; a multiple of `candidates.ROW_COUNTS_PER_WORD`.
# Row `blocks of rows` of benchmarks/tricks.py.
BLOCK_ROWS = 8
# Candidates per frame and round, on average. Rows `candidates` of benchmarks/tricks.py.
CANDIDATES_PER_FRAME = 8
# Words of a window. For larger ones a round has half as many candidates. Row `large windows` of
# benchmarks/tricks.py.
MAX_WORDS_OF_FULL_ROUND = 120
# Candidates. The number per round is a multiple of this, because `slots` has one bit for each.
CANDIDATES_MULTIPLE = 32
ANY_SIZE = UNLIMITED, UNLIMITED
ANY_PIXELS = 0, 2**30
WITHOUT_CORNERS, WITH_CORNERS = 0, -1  # words with no bits set, or all


class Limits(NamedTuple):
    """The limits of a shape: integers, or arrays of them."""

    min_w: Any
    min_h: Any
    max_w: Any
    max_h: Any
    min_pixels: Any
    max_pixels: Any
    part_w: Any  # size of one object, if a component is split
    part_h: Any


class Entries(NamedTuple):
    """Table entries of a mask: integers, or arrays of them."""

    corners: Any  # a word with all bits set if corners connect, or none
    gap_x: Any
    gap_y: Any
    screen_top: Any  # row of the board for row 0 of the screen
    limits: tuple[Limits, ...]  # of each shape in order
    # Index into the layout's pictures, or -1. If no mask has pictures, this and the fields below
    # are None.
    pictures: Any
    left: Any  # edges of the region on the board
    right: Any
    bottom: Any


NO_SHAPE = Limits(  # fits no component
    min_w=UNLIMITED,
    min_h=UNLIMITED,
    max_w=0,
    max_h=0,
    min_pixels=0,
    max_pixels=0,
    part_w=UNLIMITED,
    part_h=UNLIMITED,
)


class BoardSize(NamedTuple):
    """The board: all masks, one below the other, with an empty row above each."""

    words: int
    rows: int
    n_frames: int
    begins: np.ndarray  # int [masks + 1]: first row of each mask, and the end of the last one
    mask_words: int  # words of a mask; gaps are bridged to the right of them

    @property
    def masks(self) -> int:
        """The number of masks."""
        return len(self.begins) - 1


class WindowSize(NamedTuple):
    """Windows for filling components."""

    words: int
    reach_x: int  # width and height of the largest component
    reach_y: int
    before: int  # columns to the left of the candidate
    has_margin: bool  # whether the first column is blank if the component fits


@dataclass(frozen=True, eq=False)
class Layout:
    """Sizes and tables that follow from the searches. Masks are in the board's order.

    Args:
        order: the number of the search of each mask.
        counts: slots of each mask, int32 `[masks]`.
        gaps: the gap of each mask's search, (dx, dy).
        n_candidates: number of candidates of a round.
        table: the entries of each mask, int32 `[masks]` each.
        pictures: the different sets of pictures of the searches.
        reads_pixels: for each shape of the tables, whether a search limits its pixels.
        splits: whether a search splits components.
    """

    order: tuple[int, ...]
    counts: np.ndarray
    gaps: tuple[tuple[int, int], ...]
    board: BoardSize
    window: WindowSize
    n_candidates: int
    table: Entries
    pictures: tuple[tuple[Picture, ...], ...]
    reads_pixels: tuple[bool, ...]
    splits: bool

    @classmethod
    def of(cls, masks: Sequence[Bitmap], searches: Sequence[Search]) -> Self:
        """Lay out masks and their searches."""
        # Masks with equal gaps are bridged together, so they must be adjacent.
        order = sorted(range(len(searches)), key=lambda i: searches[i].gap)
        ordered = [searches[i] for i in order]
        heights = [masks[i].shape[1] for i in order]
        mask_words, _, n_frames = masks[0].shape
        window = _window_size(ordered)
        board = _board_size(mask_words, n_frames, heights, window, ordered)
        pictures = tuple(dict.fromkeys(s.pictures for s in ordered if s.pictures))
        n_shapes = max(len(s.shapes) for s in ordered)
        rows = [
            _entries(*row, n_shapes, pictures)
            for row in zip(ordered, heights, board.begins.tolist(), strict=False)
        ]
        return cls(
            order=tuple(order),
            counts=np.array([search.count for search in ordered], np.int32),
            gaps=tuple(search.gap for search in ordered),
            board=board,
            window=window,
            n_candidates=_candidates_of_a_round(window, n_frames),
            table=jax.tree.map(lambda *values: np.array(values, np.int32), *rows),
            pictures=pictures,
            reads_pixels=tuple(_reads_pixels(ordered, i) for i in range(n_shapes)),
            splits=any(search.splits for search in ordered),
        )

    def look_up(self, mask: jax.Array) -> Entries:
        """Look up the entries of each candidate's mask, int32 `[n]` each, in one gather."""
        tables, structure = jax.tree.flatten(self.table)
        varying = [table for table in tables if (table != table[0]).any()]
        gathered = iter(jnp.asarray(np.stack(varying))[:, mask] if varying else ())
        entries = [
            next(gathered) if (table != table[0]).any() else jnp.full_like(mask, table[0])
            for table in tables
        ]
        return structure.unflatten(entries)

    def corners_by_row(self) -> np.ndarray:
        """The rows of the board in which corners connect, uint32 `[rows]`: all bits or none."""
        heights = np.diff([*self.board.begins[:-1], self.board.rows])
        return np.repeat(self.table.corners.view(np.uint32), heights)


def _window_size(searches: Sequence[Search]) -> WindowSize:
    """Size windows to hold the largest component of every search.

    Windows have a blank column at their left, which saves a ninth of the time, unless it needs
    another word.
    """
    reach_x, reach_y = (
        max(side) for side in zip(*(search.reach for search in searches), strict=True)
    )
    words = words_across(reach_x)
    has_margin = 2 * reach_x < 32 * words
    return WindowSize(words, reach_x, reach_y, reach_x - (not has_margin), has_margin)


def _board_size(
    mask_words: int,
    n_frames: int,
    heights: Sequence[int],
    window: WindowSize,
    searches: Sequence[Search],
) -> BoardSize:
    rows = [
        -(-(height + s.gap[1] + 1) // BLOCK_ROWS) * BLOCK_ROWS
        for height, s in zip(heights, searches, strict=True)
    ]
    begins = np.cumsum([0, *rows])
    words = mask_words + any(search.gap[0] for search in searches)
    return BoardSize(words, int(begins[-1]) + window.reach_y + 1, n_frames, begins, mask_words)


def _candidates_of_a_round(window: WindowSize, n_frames: int) -> int:
    is_large = window.words * window.reach_y > MAX_WORDS_OF_FULL_ROUND
    per_frame = CANDIDATES_PER_FRAME // (2 if is_large else 1)
    return -(-per_frame * n_frames // CANDIDATES_MULTIPLE) * CANDIDATES_MULTIPLE


def _reads_pixels(searches: Sequence[Search], i: int) -> bool:
    return any(
        len(search.shapes) > i and search.shapes[i].pixels is not None for search in searches
    )


def _entries(
    search: Search, height: int, begin: int, n_shapes: int, pictures: Sequence[tuple[Picture, ...]]
) -> Entries:
    shapes = [_limits(shape) for shape in search.shapes]
    region: tuple[int | None, ...] = (None,) * 4
    if pictures:
        number = pictures.index(search.pictures) if search.pictures else -1
        region = (number, *search.columns, begin + 1 + height)
    return Entries(
        WITH_CORNERS if search.connectivity == 8 else WITHOUT_CORNERS,
        *search.gap,
        begin + 1 - search.top,
        (*shapes, *[NO_SHAPE] * (n_shapes - len(shapes))),
        *region,
    )


def _limits(shape: Shape) -> Limits:
    pixels = ANY_PIXELS if shape.pixels is None else limits(shape.pixels)
    return Limits(*shape.min_size, *shape.max_size, *pixels, *(shape.split or ANY_SIZE))
