"""How VEM tells dots of a creature from scenery of the same colour."""

from dataclasses import dataclass

import jax
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap


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
        beside = move(bm.color_mask(planes, (self.other,)), 1)
        return mask & (~bm.color_mask(planes, (self.color,)) | beside)
