"""How VEM tells Kung Fu Master's figures apart, which share colours and touch each other.

A figure's row has one colour. So a figure is found by the rows of its own colours; its hat, face,
belt and shoes, which others have as well, count only where they are above, below or beside these.
"""

import functools
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from ocjax.vision import bitmap as bm
from ocjax.vision.detected import Detected, boxes
from ocjax.vision.steps import Context, Step

ROOM = (8, 95, 160, 162)  # where figures are
WHITE = 12
SMOKE_COLOR = 14
JACKET_COLORS = (10, 2)  # colours of throwers, of masters
JACKET_ROWS = (134, 143)
SMOKE_ROWS = (153, 158)  # at its foot
WHITE_ROWS = (128, 143, 144, 145, 146, 147, 150)  # of throwers, masters
BRIM_ROWS = (128, 129)  # of hats
BRIM_SHIFT = 13  # rows, to where a player who stands or crouches has white


@dataclass(frozen=True)
class Body:
    """The pixels of a body's own colours, and in some rows others above, below or beside it.

    Args:
        colors: of the body.
        rows: where other colours of the rule count.
        chest: first and last row, exclusive, in which the body's columns are looked for.
        reach: columns beside the body where a pixel still begins a run that counts.
    """

    colors: tuple[int, ...]
    rows: tuple[int, ...]
    chest: tuple[int, int] = (134, 158)
    reach: int = 0

    def __call__(self, mask: bm.Bitmap, planes: jax.Array) -> bm.Bitmap:
        """The pixels that count."""
        own = bm.color_mask(planes, self.colors)
        others = mask & _row_words(self.rows, mask)
        inner = others & _columns_with(own, self.chest, self.reach)
        return mask & (own | (others & bm.spread(inner)))


@dataclass(frozen=True)
class Whites:
    """The player's white: not that of others, which is in rows between those of their colours.

    The brim of his hat counts too, which may be wider. It counts further down, because the white
    tells where he begins.
    """

    def __call__(self, mask: bm.Bitmap, planes: jax.Array) -> bm.Bitmap:
        """The pixels that count."""
        is_white = bm.color_mask(planes, (WHITE,))
        jackets = _columns_with(bm.color_mask(planes, JACKET_COLORS), JACKET_ROWS, reach=1)
        smoke = _columns_with(bm.color_mask(planes, (SMOKE_COLOR,)), SMOKE_ROWS, reach=1)
        own = mask & is_white & ~((jackets & _row_words(WHITE_ROWS, mask)) | smoke)
        below = _columns_with(own, (ROOM[1], ROOM[3]))
        hat = mask & ~is_white & _row_words(BRIM_ROWS, mask)
        brim = hat & bm.spread(hat & below) & ~below
        return own | bm.shift_down(brim, BRIM_SHIFT)


def _columns_with(mask: bm.Bitmap, rows: tuple[int, int], reach: int = 0) -> bm.Bitmap:
    """The columns that have pixels in some rows, and some beside them: one row."""
    used = bm.or_rows(mask[:, rows[0] : rows[1]])[:, None]
    return functools.reduce(lambda columns, _: bm.spread(columns), range(reach), used)


def _row_words(rows: tuple[int, ...], like: bm.Bitmap) -> jax.Array:
    """Whole rows, one column of words."""
    return jnp.asarray(bm.areas(like.shape[1], ((0, y, 160, y + 1) for y in rows)))


@dataclass(frozen=True)
class Grown(Step):
    """Boxes reach some rows further up and down than the colours of their rule.

    Args:
        above, below: rows.
        floor: row in which no box ends that does not end below it anyway.
    """

    above: int
    below: int
    floor: int = 160

    def __call__(self, found: Detected, _: Context) -> Detected:
        """The objects after the step."""
        y, end = found.y - self.above, found.y + found.h
        end = jnp.maximum(end, jnp.minimum(end + self.below, self.floor))
        return found._replace(box=boxes(found.x, y, found.w, end - y, found.valid))


@dataclass(frozen=True)
class Upright(Step):
    """Boxes of figures that stand: from the hat to the shoes."""

    def __call__(self, found: Detected, _: Context) -> Detected:
        """The objects after the step."""
        return found._replace(box=boxes(found.x, 126, found.w, 34, found.valid))
