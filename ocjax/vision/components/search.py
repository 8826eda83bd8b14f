"""`Search`: which connected components of a mask are objects."""

from collections.abc import Sequence
from dataclasses import dataclass

from ocjax.console.boxes import WIDTH
from ocjax.vision.pictures import Picture
from ocjax.vision.shapes import ANY_SHAPE, Shape

MAX_PARTS = 4  # maximum number of objects in one component
UNLIMITED = 256  # pixels: more than any width or height


@dataclass(frozen=True)
class Search:
    """The search of one mask; sizes are (width, height) in pixels."""

    count: int  # maximum number of boxes; further objects are only counted
    shapes: tuple[Shape, ...] = (ANY_SHAPE,)  # the first one that fits a component applies
    connectivity: int = 8  # or 4, which needs gap (0, 0)
    gap: tuple[int, int] = (0, 0)  # pixels at most (dx, dy) blanks apart are one component
    # A larger component is split if one of these fits at its first pixel.
    pictures: tuple[Picture, ...] = ()
    top: int = 0  # row of the screen of the mask's first row
    # left and right edge of the columns that may have pixels
    columns: tuple[int, int] = (0, WIDTH)

    @property
    def splits(self) -> bool:
        """True if a component may be several objects."""
        return bool(self.pictures) or any(shape.split is not None for shape in self.shapes)

    @property
    def max_size(self) -> tuple[int, int]:
        """Width and height of the largest shape."""
        width, height = (max(side) for side in zip(*(s.max_size for s in self.shapes), strict=True))
        return min(width, WIDTH), min(height, UNLIMITED)

    @property
    def reach(self) -> tuple[int, int]:
        """Width and height of the window with bridged gaps."""
        return self.max_size[0] + self.gap[0], self.max_size[1] + self.gap[1]


def words_across(reach: int) -> int:
    """Words per row of windows for components of width `reach`.

    A component's first pixel may be at its left or its right edge.
    """
    return -(-2 * reach // 32)


def window_words(reaches: Sequence[tuple[int, int]]) -> int:
    """Words per window for components of several searches, including the row below."""
    widths, heights = zip(*reaches, strict=True) if reaches else ((0,), (0,))
    return words_across(max(widths)) * (max(heights) + 1)
