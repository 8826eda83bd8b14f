"""The pictures of Adventure's things, which the ROM stores as rows of eight dots.

Each ends with an empty row. The game draws each row on two lines.
"""

import jax
import numpy as np
from jax.lax import clz
from ocjax.authoring import Pictures, lookup
from ocjax.extractors.adventure.ram import ROM

FIRST_ADDRESS = 0xFB15  # three bytes before the first picture
PICTURE_ROWS = ROM.bytes(0xB15, 0x307)
ROW_LINES = 2
ROW_DOTS = 8


def _until_empty(first: int) -> np.ndarray:
    """The rows of a picture before its final empty row."""
    rest = PICTURE_ROWS[first:]
    ends = np.flatnonzero(rest == 0)
    return rest[: ends[0]] if len(ends) else rest


def _each_four_rows() -> np.ndarray:
    """The four rows that start at each byte, packed, the first one lowest."""
    padded = np.append(PICTURE_ROWS, (0, 0, 0))
    fours = np.lib.stride_tricks.sliding_window_view(padded, 4)
    return fours @ (1 << ROW_DOTS * np.arange(4))


EXTENTS = Pictures.of(_until_empty(first) for first in range(len(PICTURE_ROWS)))
EACH_FOUR = _each_four_rows()


def row_count(picture: jax.Array) -> jax.Array:
    """The number of rows of pictures."""
    return EXTENTS.extent(picture)[3]


def four_rows(picture: jax.Array, row: jax.Array | np.ndarray) -> jax.Array:
    """Four rows of a picture, starting at `row`, packed, the first one lowest."""
    return lookup(EACH_FOUR, picture + row)


def ink_columns(ink: jax.Array, dots: int) -> tuple[jax.Array, jax.Array]:
    """The first column with a pixel, and the column after the last one, of `dots` columns."""
    return clz(ink) - (32 - dots), dots - (31 - clz(ink & -ink))


def united(rows: jax.Array) -> jax.Array:
    """The bitwise or of all rows."""
    return jax.lax.reduce(rows, np.int32(0), jax.lax.bitwise_or, (0,))
