"""The form in which both methods hand over boxes and colours: one 32-bit word a slot.

A box is x, y, w, h in a byte each from the lowest, all of which fit a byte because boxes are
clipped to the screen. The word is 0 where the slot is not valid: a valid box has a width. A colour
is red, green, blue in a byte each from the lowest.
"""

import jax
import jax.numpy as jnp
from jax import lax


def boxes(words: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Which slots are valid, and their boxes: 32 bits `[N]` -> bool `[N]`, int16 `[N, 4]`.

    Of a batch, `N` counts the slots of all states: XLA does not vectorise along the short rows of
    one state.
    """
    return words != 0, lax.bitcast_convert_type(words, jnp.uint8).astype(jnp.int16)


def colors(packed: jax.Array, valid: jax.Array) -> jax.Array:
    """Colours, 0 where the slot is not valid: 32 bits `[B, N]` or `[1, N]`, bool `[B, N]` -> uint8 `[B, N, 3]`."""
    return lax.bitcast_convert_type(packed & -valid.astype(packed.dtype), jnp.uint8)[..., :3]
