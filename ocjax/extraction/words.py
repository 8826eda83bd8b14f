"""Boxes and colours packed in one 32-bit word per slot, as both methods return them.

A box is x, y, w and h, and a colour red, green and blue, one byte each, from the lowest byte.
Clipped boxes fit. The word of an invalid slot is 0; a valid box has a width.
"""

import jax
import jax.numpy as jnp
from jax import lax


def boxes(words: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Unpack boxes and their validity: 32 bits `[N]` -> bool `[N]`, int16 `[N, 4]`.

    `N` counts the slots of all states: XLA does not vectorise along the few slots of one state.
    """
    return words != 0, lax.bitcast_convert_type(words, jnp.uint8).astype(jnp.int16)


def colors(packed: jax.Array, valid: jax.Array) -> jax.Array:
    """Unpack colours, 0 for invalid slots.

    Args:
        packed: 32 bits `[B, N]` or `[1, N]`.
        valid: bool `[B, N]`.

    Returns:
        uint8 `[B, N, 3]`.
    """
    return lax.bitcast_convert_type(packed & -valid.astype(packed.dtype), jnp.uint8)[..., :3]
