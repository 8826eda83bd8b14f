"""DoubleDunk's players in frames: figures that colours distinguish while they overlap.

The search handles the kinds of figures in order, in two steps each:

`strips`: divide the court into overlapping strips. A figure of the kind begins at a row if the next
rows of a strip have the kind's colours in order.

`fitting`: try the kind's pictures there in several columns. The figure has the picture that covers
most pixels in the kind's colours.

The figure's pixels are then taken: they do not count for later kinds.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Bitmap, U, bitmaps, materialize
from ocjax.extractors.doubledunk.fitting import best_fit, with_figure
from ocjax.extractors.doubledunk.kinds import Figure
from ocjax.extractors.doubledunk.strips import likeliest, row_counts

# Other keys of the result of `Figures` than the names of the kinds.
NO_FIGURE = "rest"  # pixels outside figures: in the first colour, and in any
ANY_COLOR = "shown"  # the pixels in any of the colours


@dataclass(frozen=True, eq=False)
class Figures:
    """A search for one figure of each kind.

    Args:
        kinds: in the order of the search.
        colors: of all kinds; the first is the colour of objects that may cover a figure.
        rows: the first row of the search on the screen, and the row after the last.
    """

    kinds: tuple[Figure, ...]
    colors: tuple[int, ...]
    rows: tuple[int, int]

    def __call__(self, planes: jax.Array) -> dict[str, Any]:
        """The edges of each kind's figure, int32 `[4, B]`, 0 without a figure; other pixels."""
        top = self.rows[0]
        masks = materialize(self._masks, planes)
        shown = materialize(lambda p: bitmaps.color_mask(self._court(p), self.colors), planes)
        none = jnp.zeros_like(shown)

        def next_search(before: tuple[Bitmap, jax.Array], kind: Figure) -> tuple[Bitmap, jax.Array]:
            return _search(masks, shown, before[0], kind)

        _, *searches = itertools.accumulate(self.kinds, next_search, initial=(none, none))
        from_top = np.array((0, top, 0, top))[:, None]
        figures = {
            kind.name: jnp.where(edges[2:3] > 0, edges + from_top, 0)
            for kind, (_, edges) in zip(self.kinds, searches, strict=True)
        }
        left = materialize(_others, masks, shown, searches[-1][0])
        return figures | {ANY_COLOR: shown, NO_FIGURE: left}

    def _court(self, planes: jax.Array) -> jax.Array:
        """The rows of the search."""
        return planes[:, :, self.rows[0] : self.rows[1]]

    def _masks(self, planes: jax.Array) -> jax.Array:
        """The pixels in each of the colours."""
        court = self._court(planes)
        return jnp.stack([bitmaps.color_mask(court, [color]) for color in self.colors])


def _others(masks: jax.Array, shown: Bitmap, taken: Bitmap) -> tuple[Bitmap, Bitmap]:
    """The pixels outside figures, in the first colour and in any."""
    return masks[0] & ~taken, shown & ~taken


def _search(
    masks: jax.Array, shown: Bitmap, taken: Bitmap, kind: Figure
) -> tuple[Bitmap, jax.Array]:
    """The taken pixels after the search for this kind, and its edges."""
    counts = row_counts(masks, shown, taken, kind)
    score, row, strip = materialize(lambda *c: likeliest(c, kind), *counts)
    column, ink, edges = materialize(
        lambda *a: best_fit(*a, kind=kind), masks, shown, taken, row, strip
    )
    is_found = (score >= kind.least)[None]
    taken_now = materialize(with_figure, taken, jnp.where(is_found, ink, U(0)), row, column)
    return taken_now, jnp.where(is_found, edges, 0)
