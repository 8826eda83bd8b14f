"""Find the pictures of the ten digits in a ROM by their holes.

A 0 has one hole, an 8 has two, a 6 has one below the hole of the 9, and so on.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

HOLES = ({1}, {0}, {0}, {0}, {0, 1}, {0}, {1}, {0}, {2}, {1})  # of the digits 0-9
STRIDES = range(5, 11)  # bytes from a digit to the next one
UNUSED = 2  # most bytes between two digits
MASKS = (0xFF, 0xF0, 0x0F)  # dots of a byte: other pictures may be in the other half
FINE = 35  # columns and rows for the comparison of pictures of different sizes
LEAST = 0.2  # correlation with usual digits
NARROW = 4  # dots; the cells of wider digits are a byte wide
MIRRORED_BY = 0.1  # how much more a font's mirror image must resemble usual digits
MARGIN = 1  # empty dots and rows around a picture, from which its surroundings are flooded


# Usual pictures of the digits, 5 dots wide and 7 high, with the top row in the highest bits.
USUAL = (
    (0b01110, 0b10001, 0b10001, 0b10001, 0b10001, 0b10001, 0b01110),
    (0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110),
    (0b01110, 0b10001, 0b00001, 0b01110, 0b10000, 0b10000, 0b11111),
    (0b01110, 0b10001, 0b00001, 0b00110, 0b00001, 0b10001, 0b01110),
    (0b00010, 0b00110, 0b01010, 0b10010, 0b11111, 0b00010, 0b00010),
    (0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110),
    (0b01110, 0b10000, 0b10000, 0b11110, 0b10001, 0b10001, 0b01110),
    (0b11111, 0b00001, 0b00010, 0b00010, 0b00100, 0b00100, 0b00100),
    (0b01110, 0b10001, 0b10001, 0b01110, 0b10001, 0b10001, 0b01110),
    (0b01110, 0b10001, 0b10001, 0b01111, 0b00001, 0b00001, 0b01110),
)
USUAL_WIDTH, USUAL_HEIGHT = 5, 7


@dataclass(frozen=True)
class FoundFont:
    """Ten pictures in a ROM that look like digits, with the arguments of `Rom.font`.

    Args:
        offset: of the first byte of the 0.
        stride: bytes from a digit to the next one.
        dots: width of the widest picture.
        shift: dots to the right of the pictures.
        likeness: correlation with usual digits.
        mirrored: whether the pictures are mirror images of digits.
    """

    offset: int
    rows: int
    stride: int
    dots: int
    shift: int
    top_first: bool
    likeness: float
    mirrored: bool

    @property
    def end(self) -> int:
        """Offset behind the 9."""
        return self.offset + 9 * self.stride + self.rows

    def __str__(self) -> str:
        options = [f"rows={self.rows}"]
        if self.stride != self.rows:
            options.append(f"stride={self.stride}")
        if self.dots < 8:
            options.append(f"dots={self.dots}, shift={self.shift}")
        if self.top_first:
            options.append("top_first=True")
        return f"ROM.font(0x{self.offset:X}, {', '.join(options)})"


def find(rom: np.ndarray) -> list[FoundFont]:
    """Find fonts in a ROM, uint8 `[size]`, the most usual ones first."""
    found: list[FoundFont] = []
    for font in sorted(_all(rom), key=lambda font: -font.likeness):
        if not any(font.offset < other.end and other.offset < font.end for other in found):
            found.append(font)
    return found


def _all(rom: np.ndarray) -> Iterator[FoundFont]:
    """All matches, also of parts of the same pictures."""
    for mask in MASKS:
        for rows in range(STRIDES[0], STRIDES[-1] + 1):
            count = len(rom) - rows + 1
            pictures = rom[np.arange(count)[:, None] + np.arange(rows)].astype(np.int32) & mask
            holes, middle = _holes(pictures)
            for stride in range(rows, min(rows + UNUSED, STRIDES[-1]) + 1):
                at = np.arange(count - 9 * stride)[:, None] + stride * np.arange(10)
                fits = [np.isin(holes[at[:, d]], list(HOLES[d])) for d in range(10)]
                turned = middle[at[:, 6]] != middle[at[:, 9]]
                for offset in np.flatnonzero(np.all(fits, axis=0) & turned).tolist():
                    top_first = bool(middle[at[offset, 6]] > middle[at[offset, 9]])
                    digits = pictures[at[offset]]
                    font = _font(digits, offset, stride, top_first)
                    if font.likeness >= LEAST:
                        yield font


def _dots(digits: np.ndarray, top_first: bool) -> np.ndarray:
    """The dots of ten pictures from the top left, `[10, rows, 8]`."""
    rows = digits if top_first else digits[:, ::-1]
    return rows[..., None] >> np.arange(7, -1, -1) & 1


def _likeness(dots: np.ndarray) -> float:
    """The correlation of ten pictures with `USUAL`, -1 to 1, all scaled by the same factors."""
    used = [np.flatnonzero(dots.any(axis=(0, axis))) for axis in (2, 1)]
    cut = dots[:, used[0][0] : used[0][-1] + 1, used[1][0] : used[1][-1] + 1]
    y, x = (
        np.minimum((np.arange(FINE) + 0.5) * size / FINE, size - 1).astype(int)
        for size in cut.shape[1:]
    )
    usual = np.array(USUAL)[..., None] >> np.arange(USUAL_WIDTH - 1, -1, -1) & 1
    wide, high = ((np.arange(FINE) * n // FINE) for n in (USUAL_WIDTH, USUAL_HEIGHT))
    return float(np.corrcoef(cut[:, y][:, :, x].ravel(), usual[:, high][:, :, wide].ravel())[0, 1])


def _font(digits: np.ndarray, offset: int, stride: int, top_first: bool) -> FoundFont:
    """The font without rows that are empty in all digits, and of narrow ones without columns."""
    used = np.flatnonzero(digits.any(axis=0))
    ink = int(np.bitwise_or.reduce(digits, axis=None))
    shift = (ink & -ink).bit_length() - 1
    dots = ink.bit_length() - shift
    if dots > NARROW:
        dots, shift = 8, 0
    first, rows = offset + int(used[0]), int(np.ptp(used)) + 1
    pictures = _dots(digits, top_first)
    likeness = _likeness(pictures)
    mirrored = _likeness(pictures[..., ::-1]) > likeness + MIRRORED_BY
    return FoundFont(first, rows, stride, dots, shift, top_first, likeness, mirrored)


def _holes(pictures: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The number of holes of pictures `[n, rows]`, and their rows' total distance from the middle.

    A hole is a connected area without dots that does not reach the border.
    """
    n, rows = pictures.shape
    empty = np.full((n, rows + 2 * MARGIN), (1 << 8 + 2 * MARGIN) - 1, np.int32)
    empty[:, MARGIN:-MARGIN] &= ~(pictures << MARGIN)
    outside = np.zeros_like(empty)
    outside[:, 0] = empty[:, 0]
    rest = empty & ~_flood(outside, empty)
    distance = 2 * np.arange(rows + 2 * MARGIN) - (rows + 2 * MARGIN - 1)
    middle = (np.bitwise_count(rest) * distance).sum(axis=1)
    holes = np.zeros(n, int)
    for _ in range(3):  # more holes than the 8's need not be counted
        left = np.flatnonzero(rest.any(axis=1))
        if not len(left):
            break
        holes[left] += 1
        part = rest[left]
        seed = np.zeros_like(part)
        row = (part != 0).argmax(axis=1)
        dots = part[np.arange(len(part)), row]
        seed[np.arange(len(part)), row] = dots & -dots
        rest[left] = part & ~_flood(seed, part)
    return holes, middle


def _flood(seed: np.ndarray, area: np.ndarray) -> np.ndarray:
    """The part of an area that is connected to a seed, both `[n, rows]`."""
    while True:
        grown = seed | seed << 1 | seed >> 1
        grown[:, 1:] |= seed[:, :-1]
        grown[:, :-1] |= seed[:, 1:]
        grown &= area
        if np.array_equal(grown, seed):
            return seed
        seed = grown
