"""What to look for in a mask: which of its connected components are objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ocjax.console.boxes import WIDTH
from ocjax.vision.pictures import Picture
from ocjax.vision.shapes import ANY_SHAPE, Shape

WINDOW = (31, 32)  # width and height of the first window where a rule sets no limit
MAX_PARTS = 4  # objects that one component is split into at most
UNLIMITED = 256  # pixels: more than any width or height


@dataclass(frozen=True)
class Search:
    """What to look for in one mask; sizes are (width, height) in pixels."""

    count: int  # boxes at most; further objects are only counted
    shapes: tuple[Shape, ...] = (ANY_SHAPE,)  # the first that a component has applies
    connectivity: int = 8  # or 4, which needs gap (0, 0)
    gap: tuple[int, int] = (0, 0)  # parts at most (dx, dy) blank pixels apart are one component
    pictures: tuple[
        Picture, ...
    ] = ()  # a larger component is split where one of these fits at its first pixel
    top: int = 0  # row of the screen that is the mask's first one
    columns: tuple[int, int] = (
        0,
        WIDTH,
    )  # left and right edge of the part of the mask that may have pixels

    @property
    def splits(self) -> bool:
        """Whether a component may be several objects."""
        return bool(self.pictures) or any(shape.split is not None for shape in self.shapes)

    @property
    def unlimited(self) -> bool:
        """Whether components of any size may be objects."""
        return any(shape.max_size is None for shape in self.shapes)

    @property
    def window(self) -> tuple[int, int]:
        """Width and height of the first window."""
        sizes = [shape.max_size for shape in self.shapes if shape.max_size is not None]
        width, height = (
            max(side) for side in zip(*sizes, *([WINDOW] if self.unlimited else []), strict=True)
        )
        return min(width, WIDTH), min(height, UNLIMITED)

    @property
    def reach(self) -> tuple[int, int]:
        """Width and height of the first window where parts are joined."""
        return self.window[0] + self.gap[0], self.window[1] + self.gap[1]


def words_across(reach: int) -> int:
    """Words of a row of windows that hold components up to so wide; the first pixel of a component may be at its left or its right."""
    return -(-2 * reach // 32)


def window_words(reaches: Sequence[tuple[int, int]]) -> int:
    """Words of a window for components of several searches, with the row below, given the reach of each search."""
    widths, heights = zip(*reaches, strict=True) if reaches else ((0,), (0,))
    return words_across(max(widths)) * (max(heights) + 1)
