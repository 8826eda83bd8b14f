"""Features of the console that are the same in every game.

Registers of the video chip (TIA) set positions, copies and widths. Games often keep the values of
these registers in RAM. They tell the position on the screen more exactly than the variables that
the game computes with. The meanings of the registers are from S. Wright, "Stella Programmer's
Guide" (1979), sections on HMP0, RESP0 and NUSIZ0.
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
    "player_width",
    "position",
    "signed_nibble",
    "spacing",
    "wrap",
]

_Rows = TypeVar("_Rows", jax.Array, np.ndarray)

COARSE = 15  # pixels that the beam moves during one turn of the positioning loop
NUSIZ_COPIES = (1, 2, 2, 3, 2, 1, 3, 1)
NUSIZ_SPACING = (0, 16, 32, 16, 64, 0, 32, 0)  # pixels from one copy to the next
NUSIZ_WIDTH = (8, 8, 8, 8, 8, 16, 8, 32)  # pixels of a player
EDGE_CUTS = tuple(0xFF << cut & 0xFF if cut > 0 else 0xFF >> -cut for cut in range(-8, 9))
"""Masks of the columns of a picture that are on the screen, for -8 to 8 columns beyond the right edge (less than 0: the left edge)."""


def position(coarse: jax.Array, fine: jax.Array) -> jax.Array:
    """Column of a horizontal position, up to a constant of each game.

    Args:
        coarse: turns of the positioning loop, 15 pixels each.
        fine: the high nibble for HMP0-HMBL, 0-15: a signed number of pixels to the left.
    """
    return COARSE * coarse + (fine ^ 7)  # 7 minus the signed nibble


def packed_position(code: jax.Array) -> jax.Array:
    """The `position` of a byte whose low nibble is the coarse part and whose high nibble is the fine part."""
    return position(code & 15, code >> 4)


def wrap(x: jax.Array, width: int = WIDTH) -> jax.Array:
    """The column wrapped around to 0 to `width - 1`, for columns at most one screen width away."""
    return jnp.where(x >= width, x - width, jnp.where(x < 0, x + width, x))


def modulo_screen(x: jax.Array) -> jax.Array:
    """The column wrapped around at the screen's width, for any `x >= 0`."""
    return mod(x, WIDTH)


def larger_part(x: jax.Array, width: jax.Array | int) -> jax.Array:
    """Left edge of the larger part of an object that the screen's edge cuts in two, for columns at most one screen width away."""
    return jnp.where(2 * (x - WIDTH) > -width, x - WIDTH, jnp.where(2 * x < -width, x + WIDTH, x))


def copies(nusiz: jax.Array) -> jax.Array:
    """How many copies of a player a NUSIZ value of 0-7 shows."""
    return pick(nusiz, NUSIZ_COPIES)


def spacing(nusiz: jax.Array) -> jax.Array:
    """Pixels from one copy to the next for a NUSIZ value of 0-7; 0 where there is one copy."""
    return pick(nusiz, NUSIZ_SPACING)


def player_width(nusiz: jax.Array) -> jax.Array:
    """Width in pixels of a player for a NUSIZ value of 0-7."""
    return pick(nusiz, NUSIZ_WIDTH)


def signed_nibble(nibble: jax.Array) -> jax.Array:
    """A nibble 0-15 in two's complement, -8 to 7."""
    return (nibble ^ 8) - 8


def mirrored(rows: _Rows) -> _Rows:
    """Rows of a player from right to left: the bits of each of the two low bytes in reverse order."""
    for mask, shift in ((0x5555, 1), (0x3333, 2), (0x0F0F, 4)):
        rows = (rows & mask) << shift | rows >> shift & mask
    return rows
