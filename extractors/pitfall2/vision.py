"""Filters that separate objects from scenery of the same colour."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from ocjax.authoring import Bitmap, Context, Detected, Step, bitmaps, boxes


@dataclass(frozen=True)
class Above:
    """A filter that drops pixels of one colour unless other given colours are just below.

    Args:
        color: palette index.
        others: the colours of the pixel below.
    """

    color: int
    others: tuple[int, ...]

    def __call__(self, mask: Bitmap, planes: jax.Array) -> Bitmap:
        """The pixels that count."""
        near = bitmaps.shift_up(bitmaps.color_mask(planes, self.others), 1)
        return mask & (~bitmaps.color_mask(planes, (self.color,)) | near)


@dataclass(frozen=True)
class Between:
    """A filter that keeps only pixels with one colour just above and just below.

    Args:
        color: palette index.
    """

    color: int

    def __call__(self, mask: Bitmap, planes: jax.Array) -> Bitmap:
        """The pixels that count."""
        around = bitmaps.color_mask(planes, (self.color,))
        return mask & bitmaps.shift_up(around, 1) & bitmaps.shift_down(around, 1)


@dataclass(frozen=True)
class Rungs:
    """A filter that drops pixels above a face, and runs wider than a rung.

    Args:
        width: columns of a rung.
        faces: the colours below hair.
    """

    width: int
    faces: tuple[int, ...]

    def __call__(self, mask: Bitmap, planes: jax.Array) -> Bitmap:
        """The pixels that count."""
        beside = bitmaps.shift_left(mask, self.width) | bitmaps.shift_right(mask, self.width)
        return mask & ~beside & ~bitmaps.shift_up(bitmaps.color_mask(planes, self.faces), 1)


@dataclass(frozen=True)
class Completed(Step):
    """Extend boxes of one height by a row, which has the colour of scenery or other objects.

    Args:
        height: without the row.
        above: whether it is the first row; otherwise it is the last one.
        edge: of the view; boxes that touch it stay as they are.
    """

    height: int
    above: bool
    edge: int

    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step."""
        touches = (found.y if self.above else found.y + found.h) == self.edge
        rows = jnp.where((found.h == self.height) & ~touches, 1, 0)
        y = found.y - rows if self.above else found.y
        return found._replace(box=boxes(found.x, y, found.w, found.h + rows, found.valid))
