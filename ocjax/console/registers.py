"""Features of the console that are the same in every game.

Registers of the video chip (TIA) set positions, copies and widths. Games often keep the values of
these registers in RAM. They give the position on the screen more exactly than the variables of the
game's computations. The meanings of the registers are from S. Wright, "Stella Programmer's Guide"
(1979), sections on HMP0, RESP0 and NUSIZ0.
"""

from typing import TypeVar

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.console.boxes import WIDTH
from ocjax.console.ops import mod, pick

__all__ = [
    "COARSE",
    "EDGE_CUTS",
    "NUSIZ_COPIES",
    "NUSIZ_SPACING",
    "NUSIZ_WIDTH",
    "copies",
    "larger_part",
    "mirrored",
    "modulo_screen",
    "packed_position",
    "position",
    "signed_nibble",
    "spacing",
    "wrap",
]

_Rows = TypeVar("_Rows", jax.Array, np.ndarray)

COARSE = 15  # pixels that the beam moves during one iteration of the positioning loop
NUSIZ_COPIES = (1, 2, 2, 3, 2, 1, 3, 1)
NUSIZ_SPACING = (0, 16, 32, 16, 64, 0, 32, 0)  # pixels from one copy to the next
NUSIZ_WIDTH = (8, 8, 8, 8, 8, 16, 8, 32)  # pixels of a player
EDGE_CUTS = tuple(0xFF << cut & 0xFF if cut > 0 else 0xFF >> -cut for cut in range(-8, 9))
"""Masks of a picture's visible columns, for 0 to 8 columns beyond the right edge.

Negative numbers, -8 to -1, are columns beyond the left edge.
"""


def position(coarse: jax.Array, fine: jax.Array) -> jax.Array:
    """Column of a horizontal position, up to a constant of each game.

    Args:
        coarse: iterations of the positioning loop, 15 pixels each.
        fine: the high nibble for HMP0-HMBL, 0-15: a signed number of pixels to the left.
    """
    return COARSE * coarse + (fine ^ 7)  # 7 minus the signed nibble


def packed_position(code: jax.Array) -> jax.Array:
    """Return the `position` of a byte with the coarse part in the low nibble, fine in the high."""
    return position(code & 15, code >> 4)


def wrap(x: jax.Array, width: int = WIDTH) -> jax.Array:
    """Wrap a column around to 0 to `width - 1`, if it is at most one screen width away."""
    return jnp.where(x >= width, x - width, jnp.where(x < 0, x + width, x))


def modulo_screen(x: jax.Array) -> jax.Array:
    """Wrap a column around at the screen's width, for any `x >= 0`."""
    return mod(x, WIDTH)


def larger_part(x: jax.Array, width: jax.Array | int) -> jax.Array:
    """Return the left edge of the larger part of an object that the screen's edge cuts in two.

    The object may be at most one screen width away.
    """
    return jnp.where(2 * (x - WIDTH) > -width, x - WIDTH, jnp.where(2 * x < -width, x + WIDTH, x))


def copies(nusiz: jax.Array) -> jax.Array:
    """Return the number of copies of a player for a NUSIZ value of 0-7."""
    return pick(nusiz, NUSIZ_COPIES)


def spacing(nusiz: jax.Array) -> jax.Array:
    """Return the pixels from one copy to the next for a NUSIZ value of 0-7; 0 for one copy."""
    return pick(nusiz, NUSIZ_SPACING)


def signed_nibble(nibble: jax.Array) -> jax.Array:
    """Convert a nibble 0-15 in two's complement to -8 to 7."""
    return (nibble ^ 8) - 8


def mirrored(rows: _Rows) -> _Rows:
    """Mirror rows of a player: reverse the bits of each of the two low bytes."""
    for mask, shift in ((0x5555, 1), (0x3333, 2), (0x0F0F, 4)):
        rows = (rows & mask) << shift | rows >> shift & mask
    return rows
