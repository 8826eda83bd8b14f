"""Pixels of the screen: of the playfield, 40 blocks per line, and of areas."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.console.boxes import WIDTH, Area

__all__ = ["area_mask", "playfield"]

_BLOCK = 4  # pixels
# The bits of a half, from the left: bits 4 to 7 of PF0, 7 to 0 of PF1, 0 to 7 of PF2.
_PF0 = np.arange(4, 8)
_PF1 = np.arange(7, -1, -1)
_PF2 = np.arange(8)


def playfield(
    pf0: Any, pf1: Any, pf2: Any, right: tuple[Any, Any, Any] | None = None, *, mirrored: bool
) -> Any:
    """Return the pixels that the playfield registers draw, bool `[..., 160]`.

    Args:
        pf0, pf1, pf2: the registers, integers `[...]`, all of NumPy or of JAX.
        right: the registers in the right half, if the game writes them again there.
        mirrored: whether the right half is mirrored (bit 0 of CTRLPF).
    """
    left_half = _half(pf0, pf1, pf2)
    right_half = left_half if right is None else _half(*right)
    if mirrored:
        right_half = right_half[..., ::-1]
    array = jnp if isinstance(left_half, jax.Array) else np
    return array.repeat(array.concatenate([left_half, right_half], axis=-1), _BLOCK, axis=-1)


def area_mask(area: Area, height: int = 210) -> np.ndarray:
    """Return the pixels of an area of the screen, bool `[height, 160]`."""
    left, top, right, bottom = area
    rows = np.arange(height)
    columns = np.arange(WIDTH)
    return ((rows >= top) & (rows < bottom))[:, None] & ((columns >= left) & (columns < right))[
        None
    ]


def _half(pf0: Any, pf1: Any, pf2: Any) -> Any:
    """The blocks of one half from the left, bool `[..., 20]`."""
    array = jnp if any(isinstance(r, jax.Array) for r in (pf0, pf1, pf2)) else np
    parts = [_bits(pf0, _PF0), _bits(pf1, _PF1), _bits(pf2, _PF2)]
    return array.concatenate(parts, axis=-1)


def _bits(register: Any, order: np.ndarray) -> Any:
    """The bits of a register in an order, bool `[..., len(order)]`."""
    array = jnp if isinstance(register, jax.Array) else np
    wide = array.asarray(register).astype(np.int32)[..., None]
    return (wide >> order.reshape((1,) * (wide.ndim - 1) + (-1,)).astype(np.int32) & 1) != 0
