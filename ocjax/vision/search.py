"""What to look for in a mask: which of its connected components are objects."""

from __future__ import annotations

from dataclasses import dataclass

from ocjax.console.boxes import WIDTH
from ocjax.vision.pictures import Picture

WINDOW = (31, 32)  # width and height of the first window where a rule sets no limit
MAX_PARTS = 4  # objects that one component is split into at most
UNLIMITED = 256  # pixels: more than any width or height
MAX_AREA = 2**30


@dataclass(frozen=True)
class Search:
    """What to look for in one mask; sizes are (width, height) in pixels."""

    count: int  # boxes at most; further objects are only counted
    connectivity: int = 8  # or 4, which needs gap (0, 0)
    gap: tuple[int, int] = (0, 0)  # parts at most (dx, dy) blank pixels apart are one component
    min_size: tuple[int, int] = (1, 1)  # components outside these limits do not count
    max_size: tuple[int, int] | None = None
    split: tuple[int, int] | None = None  # a larger component is as many objects of this size as cover it, `MAX_PARTS` at most
    area: tuple[int, int] | None = None  # least and most pixels of a component, after `gap` is bridged; needs max_size
    pictures: tuple[Picture, ...] = ()  # a larger component is split where one of these fits at its first pixel
    top: int = 0  # row of the screen that is the mask's first one
    columns: tuple[int, int] = (0, WIDTH)  # left and right edge of the part of the mask that may have pixels
    also: tuple[Search, ...] = ()  # further limits, of which only sizes, split and area count; the first that a component meets applies

    @property
    def alternatives(self) -> tuple[Search, ...]:
        """All limits, its own ones first."""
        return (self, *self.also)

    @property
    def splits(self) -> bool:
        """Whether a component may be several objects."""
        return bool(self.pictures) or any(s.split is not None for s in self.alternatives)

    @property
    def unlimited(self) -> bool:
        """Whether components of any size may be objects."""
        return any(s.max_size is None for s in self.alternatives)

    @property
    def window(self) -> tuple[int, int]:
        """Width and height of the first window."""
        sizes = [s.max_size for s in self.alternatives if s.max_size is not None]
        width, height = (max(side) for side in zip(*sizes, *([WINDOW] if self.unlimited else []), strict=True))
        return min(width, WIDTH), min(height, UNLIMITED)


NOTHING = Search(0, min_size=(UNLIMITED, UNLIMITED), max_size=(1, 1))  # limits that no component meets
