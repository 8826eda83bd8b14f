"""Tables, fonts and the tight extents of pictures, read from the ROM that ale-py installs.

Offsets count bytes from the beginning of the ROM file. In a ROM of 2 or 4 KiB, console address `a`
is at offset `a & (size - 1)`. A ROM of 8 KiB has two banks of 4 KiB, and the address is at offset
`4096 * bank + (a & 0xFFF)`.
"""

import functools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.console.boxes import Box, Number, box
from ocjax.console.fonts import Font
from ocjax.console.ops import lookup, pick
from ocjax.console.rom_files import read_rom

__all__ = ["Pictures", "Rom"]

_PLAYER = 8  # dots in a row of a player's picture
# Maximum number of pictures for which selects are faster than a gather: Asterix' REM takes 0.049 us
# per state instead of 0.052.
_FEW = 8


@dataclass(frozen=True)
class Rom:
    """A game's ROM, by ALE's name; its checksum is checked when it is read for the first time."""

    name: str
    md5: str

    @functools.cached_property
    def data(self) -> np.ndarray:
        """All bytes, uint8 `[size]`."""
        return np.frombuffer(read_rom(self.name, self.md5), np.uint8)

    def bytes(self, offset: int, count: int, step: int = 1) -> np.ndarray:
        """Read a table, int32 `[count]`: every `step`-th byte from an offset on."""
        return self.data[offset : offset + count * step : step].astype(np.int32)

    def rows(
        self, offsets: int | Sequence[int], height: int, *, step: int = 1, top_first: bool = False
    ) -> np.ndarray:
        """Read the rows of pictures from the top, int32 `[pictures, height]`.

        `[height]` of one picture.

        Args:
            offsets: offset of each picture.
            step: bytes from one row of a picture to the next, if the ROM holds the first rows of
                all pictures, then all second rows.
            top_first: whether the first byte is the top row. Most games store the bottom row first,
                because their drawing loops count down.
        """
        at = np.asarray(offsets)[..., None] + step * np.arange(height)
        rows = self.data[np.minimum(at, len(self.data) - 1)].astype(np.int32)
        return rows if top_first else rows[..., ::-1]

    def font(
        self,
        offsets: int | Sequence[int],
        rows: int,
        *,
        stride: int | None = None,
        step: int = 1,
        dots: int = 8,
        shift: int = 0,
        dot: tuple[int, int] = (1, 1),
        pitch: int = 8,
        top_first: bool = False,
    ) -> Font:
        """Read the ten digits.

        Args:
            offsets: offset of the 0, or of each of the ten pictures.
            rows: rows of a picture.
            stride: bytes from one picture to the next; by default pictures are adjacent.
            step: bytes from one row to the next, see `rows`.
            dots, shift: width of a picture, and its distance from the lowest bit of a row's byte.
            dot, pitch: see `Font`.
            top_first: see `rows`.
        """
        if isinstance(offsets, int):
            offsets = [offsets + i * (rows if stride is None else stride) for i in range(10)]
        pictures = (
            self.rows(offsets, rows, step=step, top_first=top_first) >> shift & (1 << dots) - 1
        )
        return Font(tuple(tuple(p) for p in pictures.tolist()), dots, dot, pitch)

    def pictures(
        self, offsets: Sequence[int], height: int | Sequence[int], *, top_first: bool = False
    ) -> "Pictures":
        """Read the tight extents of players' pictures, eight dots wide.

        Args:
            offsets: offset of each picture. For a pointer in RAM, all offsets in the page of the
                pointer: `range(0xF00, 0x1000)`.
            height: number of rows of all pictures, or of each.
            top_first: see `rows`.
        """
        heights = np.broadcast_to(height, len(offsets))
        return Pictures.of(
            [
                self.rows(o, h, top_first=top_first)
                for o, h in zip(offsets, heights.tolist(), strict=True)
            ]
        )


def _extent(rows: np.ndarray) -> int:
    """Pack the extent of a picture's set dots as in `Pictures`; 0 for an empty picture."""
    ink = int(np.bitwise_or.reduce(rows))
    if not ink:
        return 0
    left, right = _PLAYER - ink.bit_length(), _PLAYER - ((ink & -ink).bit_length() - 1)
    used = np.flatnonzero(rows)
    return left | (right - left) << 4 | int(used[0]) << 8 | int(np.ptp(used) + 1) << 16


@dataclass(frozen=True, eq=False)
class Pictures:
    """Tight extents of pictures of eight dots.

    Args:
        packed: int32 `[n]`; from the lowest bit the first column (4 bits), the width (4), the first
            row (8) and the height (8).
        axes: for pictures of all combinations of some properties, each property with its number of
            values. The last property varies fastest.

    Raises:
        ValueError: the number of pictures differs from the number of combinations.
    """

    packed: np.ndarray
    axes: Mapping[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.axes and math.prod(self.axes.values()) != len(self.packed):
            raise ValueError(
                f"{len(self.packed)} pictures are not one for each combination of {dict(self.axes)}"
            )

    @classmethod
    def of(cls, pictures: Iterable[np.ndarray], **axes: int) -> "Pictures":
        """Pack pictures given as rows from the top, as returned by `Rom.rows`.

        `axes` are documented in the class.
        """
        return cls(np.array([_extent(rows) for rows in pictures], np.int32), axes)

    def index(self, **places: Number) -> jax.Array:
        """The index of the pictures with these values of all axes.

        Raises:
            TypeError: the names differ from the names of the axes.
        """
        if places.keys() != self.axes.keys():
            raise TypeError(
                f"the axes of these pictures are {', '.join(self.axes) or 'none'}, got "
                f"{', '.join(places)}"
            )
        index = jnp.int32(0)
        for name, count in self.axes.items():
            index = count * index + places[name]
        return index

    def extent(
        self, index: jax.Array, *, mirrored: Number = False
    ) -> tuple[jax.Array, jax.Array, jax.Array, jax.Array]:
        """First column, first row, width and height of the pictures at an index, int32 each.

        An index out of range takes the nearest picture.

        Args:
            index: of the pictures, such as the low byte of a pointer.
            mirrored: whether they are drawn from right to left.
        """
        few = len(self.packed) <= _FEW
        p = pick(jnp.maximum(index, 0), self.packed.tolist()) if few else lookup(self.packed, index)
        left, width = p & 15, p >> 4 & 15
        if mirrored is not False:
            left = jnp.where(mirrored, _PLAYER - left - width, left)
        return left, p >> 8 & 255, width, p >> 16

    def box(
        self,
        index: jax.Array,
        x: Number,
        y: Number,
        *,
        mirrored: Number = False,
        zoom: int = 1,
        **fields: Any,
    ) -> Box:
        """Return tight boxes of pictures on the screen; an empty picture makes an invalid box.

        Args:
            index: of the pictures, such as the low byte of a pointer.
            x, y: column and row of the pictures' top left dot.
            mirrored: whether they are drawn from right to left.
            zoom: pixels per dot, horizontally.
            fields: `valid`, `value`, `orientation` and `color` of the box.
        """
        left, top, width, height = self.extent(index, mirrored=mirrored)
        return box(x + zoom * left, y + top, zoom * width, height, **fields)
