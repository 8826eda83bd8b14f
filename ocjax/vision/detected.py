"""What VEM detects: boxes of objects, a word each."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax.typing import ArrayLike

OWN_COLOR = -1  # in place of a palette index: the category's colour


class Detected(NamedTuple):
    """What VEM finds of one category or in one mask, one entry per slot, batch last; `Objects` are
    made of these.

    A box is one word because the time to compile a program grows with the number of its kernels, by
    about 14 ms each: with an array for each side of the boxes and one for their validity, Krull's
    VEM has 43 more.
    """

    # uint32 [count, B]: x, y, w and h in a byte each, x in the lowest; 0 where there is no object
    box: jax.Array
    value: jax.Array | None = None  # int32 [count, B]; None: 0
    head: jax.Array | None = (
        None  # int32 [count, B], column of the first pixel in the top row; None: not known
    )
    color: jax.Array | None = (
        None  # int32 [count, B], palette indices or `OWN_COLOR`; None: the latter
    )
    overflow: jax.Array | None = None  # int32 [B], objects for which there was no slot; None: 0

    @property
    def x(self) -> jax.Array:
        """First column, int32 `[count, B]`; the others likewise."""
        return self._byte(0)

    @property
    def y(self) -> jax.Array:
        """First row."""
        return self._byte(1)

    @property
    def w(self) -> jax.Array:
        """Width."""
        return self._byte(2)

    @property
    def h(self) -> jax.Array:
        """Height."""
        return self._byte(3)

    @property
    def valid(self) -> jax.Array:
        """Which slots hold an object, bool `[count, B]`."""
        return self.box != 0

    def _byte(self, i: int) -> jax.Array:
        return (self.box >> (8 * i) & 255).astype(jnp.int32)

    def where(self, valid: jax.Array) -> Detected:
        """Which of the objects are valid, bool `[count, B]`."""
        return self._replace(box=jnp.where(valid, self.box, jnp.uint32(0)))


def words(x: ArrayLike, y: ArrayLike, w: ArrayLike, h: ArrayLike) -> jax.Array:
    """Boxes packed into words, uint32.

    Each number must be 0 to 255, because larger ones overflow into the next byte.
    """
    x, y, w, h = (jnp.asarray(v).astype(jnp.uint32) for v in (x, y, w, h))
    return x | (y << 8) | (w << 16) | (h << 24)


def boxes(x: ArrayLike, y: ArrayLike, w: ArrayLike, h: ArrayLike, valid: jax.Array) -> jax.Array:
    """Boxes as words, 0 where there is no object; there, the numbers may be anything."""
    return jnp.where(valid, words(x, y, w, h), jnp.uint32(0))
