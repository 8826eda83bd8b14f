"""How VEM tells dots of an object from scenery of the same colour."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap
from ocjax.vision.detected import Detected, boxes
from ocjax.vision.steps import Context, Step


@dataclass(frozen=True)
class NextTo:
    """A filter: of the pixels of one colour, only those count that have another below or above.

    Args:
        color: palette index.
        other: the colour that is next to it.
        above: whether that is above; otherwise it is below.
    """

    color: int
    other: int
    above: bool = False

    def __call__(self, mask: Bitmap, planes: jax.Array) -> Bitmap:
        """The pixels that count."""
        move = bm.shift_down if self.above else bm.shift_up
        near = move(bm.color_mask(planes, (self.other,)), 1)
        return mask & (~bm.color_mask(planes, (self.color,)) | near)


@dataclass(frozen=True)
class Clawed(Step):
    """Boxes of one height are one row higher, for a row of claws in the colour of the ground."""

    height: int

    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step."""
        h = found.h + jnp.where(found.h == self.height, 1, 0)
        return found._replace(box=boxes(found.x, found.y, found.w, h, found.valid))
