"""`Shape`: size limits that decide whether a connected component is an object."""

from dataclasses import dataclass
from typing import TypeVar

__all__ = ["ANY_SHAPE", "Most", "Range", "Shape", "Span", "limits"]

Range = int | tuple[int, int | None]
Span = int | tuple[int, int]
Most = TypeVar("Most", bound=int | None)


def limits(of: int | tuple[int, Most]) -> tuple[int, int | Most]:
    """Return the minimum and the maximum of a range; a single number is both."""
    return (of, of) if isinstance(of, int) else of


@dataclass(frozen=True)
class Shape:
    """The shape of connected components that are objects.

    Each range is a number, or (minimum, maximum). The maximum width and height may be None: no
    limit, at some cost in time.

    Args:
        w, h: width and height in pixels.
        pixels: number of pixels; it separates pictures of the same size. With `Blobs.gap` of (dx,
            dy), the dx columns right of each pixel and the dy rows below it count, too, also at the
            object's edge. None: any number. Without a gap, a component has at most `w` times `h`
            pixels.
        split: (width, height) of one object, for objects that touch. A larger component is split
            into as many objects as cover it (4 at most), evenly spaced from edge to edge. `w` and
            `h` then limit the whole component.
    """

    w: Range = (1, None)
    h: Range = (1, None)
    pixels: Range | None = None
    split: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        for name in ("w", "h", "pixels"):
            _check_range(name, getattr(self, name))
        if (self.max_size is None) and (
            limits(self.w)[1] is not None or limits(self.h)[1] is not None
        ):
            raise ValueError(f"w and h need a limit both, or none, got {self.w} and {self.h}")
        if self.pixels is not None and (self.max_size is None or limits(self.pixels)[1] is None):
            raise ValueError("pixels must have a limit, and so must w and h")
        if self.split is not None and min(self.split) < 1:
            raise ValueError(f"split must be (width, height) of at least 1 pixel, got {self.split}")

    @property
    def min_size(self) -> tuple[int, int]:
        """Minimum width and height."""
        return limits(self.w)[0], limits(self.h)[0]

    @property
    def most_pixels(self) -> int | None:
        """Pixels of the largest box; None: any number."""
        return None if self.max_size is None else self.max_size[0] * self.max_size[1]

    @property
    def max_size(self) -> tuple[int, int] | None:
        """Maximum width and height; None: any size."""
        w, h = limits(self.w)[1], limits(self.h)[1]
        return None if w is None or h is None else (w, h)


def _check_range(name: str, value: Range | None) -> None:
    if value is None or (isinstance(value, int) and value >= 0):
        return
    numbers = (
        isinstance(value, tuple)
        and len(value) == 2
        and isinstance(value[0], int)
        and isinstance(value[1], int | None)
    )
    least, most = value if numbers else (-1, None)  # pyright: ignore
    if least < 0 or (most is not None and most < least):
        raise ValueError(f"{name} must be a number of pixels or (least, most), got {value!r}")


ANY_SHAPE = Shape()
