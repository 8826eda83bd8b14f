"""`Shape`: size limits that decide whether a connected component is an object."""

from dataclasses import dataclass

__all__ = ["ANY_SHAPE", "Shape", "Span", "check_number", "limits"]

Span = int | tuple[int, int]  # a number, or the least and the greatest one


def limits(of: Span) -> tuple[int, int]:
    """Return the minimum and the maximum of a range; a single number is both."""
    return (of, of) if isinstance(of, int) else of


def check_number(name: str, value: int, least: int, most: int) -> None:
    """Check that an option is in range; raises ValueError."""
    if not least <= value <= most:
        raise ValueError(f"{name} must be {least} to {most}, got {value}")


@dataclass(frozen=True)
class Shape:
    """The shape of connected components that are objects; larger windows take more time.

    Each range is a number, or (minimum, maximum).

    Args:
        w, h: width and height in pixels.
        pixels: number of pixels, to separate pictures of the same size; None: any. With `Blobs.gap`
            of (dx, dy), the dx columns right of each pixel and the dy rows below it count, too.
        split: (width, height) of one object, for objects that touch. A larger component is split
            into as many objects as cover it (4 at most), evenly spaced from edge to edge. `w` and
            `h` then limit the whole component.
    """

    w: Span = (1, 31)
    h: Span = (1, 32)
    pixels: Span | None = None
    split: tuple[int, int] | None = None

    def __post_init__(self) -> None:
        for name, value in (("w", self.w), ("h", self.h), ("pixels", self.pixels or 0)):
            least, most = limits(value)
            if None in (least, most) or not 0 <= least <= most:
                raise ValueError(f"{name} must be a number of pixels or (least, most), got {value}")
        if self.split is not None and min(self.split) < 1:
            raise ValueError(f"split must be (width, height) of at least 1 pixel, got {self.split}")

    @property
    def min_size(self) -> tuple[int, int]:
        """Minimum width and height."""
        return limits(self.w)[0], limits(self.h)[0]

    @property
    def max_size(self) -> tuple[int, int]:
        """Maximum width and height."""
        return limits(self.w)[1], limits(self.h)[1]


ANY_SHAPE = Shape()
