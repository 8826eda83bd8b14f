"""How VEM separates Kung Fu Master's figures, which share colours and touch each other.

A figure's row has one colour, so VEM finds a figure by the rows of its own colours. Hat, face, belt
and shoes have shared colours. They count only above, below or beside the figure's own colours.
"""

import functools
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from ocjax.authoring import Context, Detected, Step, bitmaps, boxes, materialize

TOP = 95  # rows with figures
BOTTOM = 162
ROOM = (8, TOP, 160, BOTTOM)
WHITE = 12
SMOKE_COLOR = 14
JACKET_COLORS = (10, 2)  # colours of throwers, of masters
JACKET_ROWS = (134, 143)
SMOKE_ROWS = (153, 158)  # at its foot
WHITE_ROWS = (128, 143, 144, 145, 146, 147, 150)  # of throwers, masters
BRIM_ROWS = (128, 129)  # of hats
BRIM_SHIFT = 13  # rows down to the white of a standing or crouching player


@dataclass(frozen=True)
class Body:
    """Pixels of a body's own colours, and, in some rows, other pixels above, below or beside it.

    Args:
        colors: of the body.
        rows: other colours of the rule count in these rows.
        chest: first and last row, exclusive, of the search for the body's columns.
        reach: columns beside the body where a pixel still begins a run that counts.
    """

    colors: tuple[int, ...]
    rows: tuple[int, ...]
    chest: tuple[int, int] = (134, 158)
    reach: int = 0

    def __call__(self, mask: bitmaps.Bitmap, planes: jax.Array) -> bitmaps.Bitmap:
        """The pixels that count, only in the room."""
        shown = _in_room(mask)
        own = bitmaps.color_mask(_in_room(planes), self.colors)
        others = shown & _row_words(self.rows)
        inner = others & _columns_with(own, self.chest, self.reach)
        return _on_screen(shown & (own | (others & bitmaps.spread(inner))), mask)


@dataclass(frozen=True)
class Whites:
    """The player's white. White between the rows of other figures' colours does not count.

    The brim of his hat counts too, and may be wider. It counts in lower rows, because the white
    marks his first row.
    """

    def __call__(self, mask: bitmaps.Bitmap, planes: jax.Array) -> bitmaps.Bitmap:
        """The pixels that count, only in the room."""
        shown = _in_room(mask)
        own = materialize(_own_white, planes)
        below = _columns_with(own, (TOP, BOTTOM))
        rows = slice(BRIM_ROWS[0] - TOP, BRIM_ROWS[-1] + 1 - TOP)
        hat = shown[:, rows] & ~bitmaps.color_mask(_in_room(planes)[:, :, rows], (WHITE,))
        brim = hat & bitmaps.spread(hat & below) & ~below
        begin = rows.start + BRIM_SHIFT
        lower = jnp.pad(brim, ((0, 0), (begin, BOTTOM - TOP - begin - len(BRIM_ROWS)), (0, 0)))
        return _on_screen(own | lower, mask)


def _own_white(planes: jax.Array) -> bitmaps.Bitmap:
    """White pixels of the room without those of throwers, masters and smoke."""
    own = _in_room(planes)
    jackets = _columns_with(bitmaps.color_mask(own, JACKET_COLORS), JACKET_ROWS, reach=1)
    smoke = _columns_with(bitmaps.color_mask(own, (SMOKE_COLOR,)), SMOKE_ROWS, reach=1)
    return bitmaps.color_mask(own, (WHITE,)) & ~((jackets & _row_words(WHITE_ROWS)) | smoke)


def _in_room(pixels: jax.Array) -> jax.Array:
    """The rows of the room."""
    return pixels[..., TOP:BOTTOM, :]


def _on_screen(pixels: bitmaps.Bitmap, like: bitmaps.Bitmap) -> bitmaps.Bitmap:
    """Pixels of the room's rows, in their rows of the screen."""
    return jnp.pad(pixels, ((0, 0), (TOP, like.shape[1] - BOTTOM), (0, 0)))


def _columns_with(mask: bitmaps.Bitmap, rows: tuple[int, int], reach: int = 0) -> bitmaps.Bitmap:
    """Columns with pixels in some rows of the screen, widened by `reach`: one row."""
    used = bitmaps.or_rows(mask[:, rows[0] - TOP : rows[1] - TOP])[:, None]
    return functools.reduce(lambda columns, _: bitmaps.spread(columns), range(reach), used)


def _row_words(rows: tuple[int, ...]) -> jax.Array:
    """Complete rows of the screen in the room, one column of words."""
    return jnp.asarray(bitmaps.areas(BOTTOM, ((0, y, 160, y + 1) for y in rows))[:, TOP:])


@dataclass(frozen=True)
class Grown(Step):
    """Boxes extended above and below the rows of their rule's colours.

    Args:
        above, below: rows.
        floor: the extension below stops at this row.
    """

    above: int
    below: int
    floor: int = 160

    def __call__(self, found: Detected, _: Context) -> Detected:
        """The objects after the step."""
        y = found.y - self.above
        found_end = found.y + found.h
        end = jnp.maximum(found_end, jnp.minimum(found_end + self.below, self.floor))
        return found._replace(box=boxes(found.x, y, found.w, end - y, found.valid))


@dataclass(frozen=True)
class Upright(Step):
    """Boxes of standing figures: from the hat to the shoes."""

    def __call__(self, found: Detected, _: Context) -> Detected:
        """The objects after the step."""
        return found._replace(box=boxes(found.x, 126, found.w, 34, found.valid))
