"""Where the masks of a game lie on the board that is searched, and what is looked up for each of them; all static."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.vision.bitmap import Bitmap
from ocjax.vision.search import UNLIMITED, Search, words_across
from ocjax.vision.shapes import Shape, limits

BLOCK = 8  # rows that candidates are counted in
CANDIDATES_PER_FRAME = 8  # of a round
LARGE = 120  # words of a window from which a round has half as many: Pitfall takes 32 us a frame instead of 38, James Bond 34 instead of 38
WORD = 32  # candidates of a round are a multiple of it
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
    part_w: Any  # size of one object of a component that is split
    part_h: Any


class Entries(NamedTuple):
    """What the stages look up for a mask: integers, or arrays of them."""

    corners: Any  # a word with all bits set where corners connect, or none
    unlimited: Any  # whether components of any size may be objects
    gap_x: Any
    gap_y: Any
    up: Any  # rows from the board to the screen
    limits: tuple[Limits, ...]  # of each shape, the first one first
    pictures: Any  # index into the layout's pictures, or -1; None, as those below: no mask has pictures
    left: Any  # edges of the region on the board
    right: Any
    bottom: Any


NO_SHAPE = Limits(UNLIMITED, UNLIMITED, 0, 0, 0, 0, UNLIMITED, UNLIMITED)  # no component has it
NO_SEARCH = Search(0, ())  # in place of a further search of a mask that has none


class Layout:
    """Where masks lie on the board, and the sizes and tables that follow from what is searched for."""

    def __init__(self, masks: Sequence[Bitmap], searches: Sequence[Search], lists: Sequence[int] | None = None) -> None:
        self.order = _sharing(masks, searches)
        self.lists = range(len(searches)) if lists is None else lists  # the list that each search adds to
        self.counts = {own: search.count for own, search in zip(self.lists, searches, strict=True)}
        masks = [masks[own[0]] for own in self.order]  # all that follows has this order
        searched, searches = searches, [searches[own[0]] for own in self.order]  # gaps and corners are those of all searches of a mask
        self.n_masks = len(masks)
        self.splits = any(search.splits for search in searched)
        self.gaps = [search.gap for search in searches]
        self.lanes = masks[0].shape[2]
        self.reach_x, self.reach_y = (max(side) for side in zip(*(s.reach for s in searched), strict=True))
        self.mask_words = masks[0].shape[0]
        self.n_words = self.mask_words + any(s.gap[0] for s in searches)  # pixels are spread to the right
        heights = [-(-(m.shape[1] + s.gap[1] + 1) // BLOCK) * BLOCK for m, s in zip(masks, searches, strict=True)]
        self.begins = np.cumsum([0, *heights])  # first row of each mask's part; an empty row separates parts
        self.n_rows = int(self.begins[-1]) + self.reach_y + 1
        # To see that a component goes on to the left of its window takes an eighth more time than a blank column there. So a window does
        # without the column only where it would need another word.
        self.window_words = words_across(self.reach_x)
        self.has_margin = 2 * self.reach_x < 32 * self.window_words
        self.before = self.reach_x - (not self.has_margin)
        per_frame = CANDIDATES_PER_FRAME // (2 if self.window_words * self.reach_y > LARGE else 1)
        self.n_candidates = -(-per_frame * self.lanes // WORD) * WORD
        self.pictures = tuple(dict.fromkeys(s.pictures for s in searches if s.pictures))
        self.n_shapes = max(len(s.shapes) for s in searched)
        self.reads_pixels = [any(len(s.shapes) > i and s.shapes[i].pixels is not None for s in searched) for i in range(self.n_shapes)]
        self.tables: list[Entries] = []  # of the first search of each mask, of the second one, and so on
        for own in itertools.zip_longest(*self.order):
            rows = [
                self._entries(NO_SEARCH if i is None else searched[i], mask, begin)
                for i, mask, begin in zip(own, masks, self.begins.tolist(), strict=False)
            ]
            self.tables.append(jax.tree.map(lambda *v: np.array(v, np.int32), *rows))

    def _entries(self, search: Search, mask: Bitmap, begin: int) -> Entries:
        """The entries of one search of a mask, integers."""
        shapes = [_limits(shape) for shape in search.shapes]
        left, right = search.columns
        return Entries(
            corners=WITH_CORNERS if search.connectivity == 8 else WITHOUT_CORNERS,
            unlimited=search.unlimited,
            gap_x=search.gap[0],
            gap_y=search.gap[1],
            up=begin + 1 - search.top,
            limits=(*shapes, *[NO_SHAPE] * (self.n_shapes - len(shapes))),
            pictures=(self.pictures.index(search.pictures) if search.pictures else -1) if self.pictures else None,
            left=left if self.pictures else None,
            right=right if self.pictures else None,
            bottom=begin + 1 + mask.shape[1] if self.pictures else None,
        )

    def look_up(self, mask: jax.Array, rank: int) -> Entries:
        """The entries of one of the searches of each candidate's mask, int32 `[n]` each, in one gather."""
        tables, structure = jax.tree.flatten(self.tables[rank])
        differ = [i for i, table in enumerate(tables) if (table != table[0]).any()]
        rows = dict(zip(differ, jnp.asarray(np.stack([tables[i] for i in differ]))[:, mask], strict=True)) if differ else {}
        return structure.unflatten([rows[i] if i in rows else jnp.full_like(mask, table[0]) for i, table in enumerate(tables)])

    def masks_of_lists(self, rank: int) -> dict[int, list[int]]:
        """The masks whose first search (rank 0) adds to each list, or whose second one, and so on."""
        masks: dict[int, list[int]] = {}
        for mask, own in enumerate(self.order):
            if rank < len(own):
                masks.setdefault(self.lists[own[rank]], []).append(mask)
        return masks

    def lists_of_rank(self, rank: int) -> tuple[np.ndarray, np.ndarray]:
        """Which masks the lists of a rank take objects of, int32 `[masks, lists]`, and how many slots they have, int32 `[lists]`.

        Lists of fewer masks name their last one repeatedly.
        """
        of_lists = self.masks_of_lists(rank)
        most = max(map(len, of_lists.values()))
        masks = [[*own, *own[-1:] * (most - len(own))] for own in of_lists.values()]
        return np.array(masks, np.int32).T, np.array([self.counts[own] for own in of_lists], np.int32)

    @functools.cached_property
    def slots(self) -> dict[int, list[tuple[int, int, int]]]:
        """Where the slots of each list are: a rank, and the first and the end among the slots of that rank."""
        places: dict[int, list[tuple[int, int, int]]] = {own: [] for own in dict.fromkeys(self.lists)}
        for rank in range(len(self.tables)):
            first = 0
            for own in self.masks_of_lists(rank):
                places[own].append((rank, first, first + self.counts[own]))
                first += self.counts[own]
        return places

    def by_list(self, of_masks: jax.Array) -> jax.Array:
        """Sums of what is known of the first search of all masks, then of the second ones, and so on, int32 `[lists, lanes]`."""
        belongs = np.zeros((len(self.slots), len(of_masks), 1), bool)
        for i, own in enumerate(self.slots):
            for rank in range(len(self.tables)):
                belongs[i, [rank * self.n_masks + mask for mask in self.masks_of_lists(rank).get(own, [])]] = True
        return jnp.sum(jnp.where(belongs, of_masks[None], 0), axis=1)

    def corners_by_row(self) -> np.ndarray:
        """Whether corners connect in each row of the board: words with all bits set, or none, uint32 `[rows]`."""
        heights = np.diff([*self.begins[:-1], self.n_rows])
        return np.repeat(self.tables[0].corners.view(np.uint32), heights)


def _limits(shape: Shape) -> Limits:
    """The limits of a shape as integers."""
    pixels = ANY_PIXELS if shape.pixels is None else limits(shape.pixels)
    return Limits(*shape.min_size, *(shape.max_size or ANY_SIZE), *pixels, *(shape.split or ANY_SIZE))


def _sharing(masks: Sequence[Bitmap], searches: Sequence[Search]) -> list[tuple[int, ...]]:
    """The searches that share a mask and connect its pixels alike, by their indices.

    Masks of equal gaps, which are bridged together, come one after the other.
    """
    groups: dict[Any, list[int]] = {}
    for i, (mask, search) in enumerate(zip(masks, searches, strict=True)):
        shares = not search.pictures and not search.unlimited
        groups.setdefault((id(mask), search.gap, search.connectivity) if shares else i, []).append(i)
    return sorted((tuple(own) for own in groups.values()), key=lambda own: searches[own[0]].gap)
