"""`Detected`: the objects that VEM finds, one word per box."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax.typing import ArrayLike

OWN_COLOR = -1  # instead of a palette index: the category's colour


class Detected(NamedTuple):
    """Objects of one category or one mask, one entry per slot, batch last.

    A box is one word: separate arrays would add 43 kernels to Krull's VEM.
    """

    # uint32 [count, B]: x, y, w and h, one byte each, x lowest; 0 without an object
    box: jax.Array
    value: jax.Array | None = None  # int32 [count, B]; None: 0
    # int32 [count, B], column of the first pixel in the top row, for steps of `Bounds` and `Blobs`;
    # None if the rule splits components or an earlier step drops it
    head: jax.Array | None = None
    # int32 [count, B], palette indices or `OWN_COLOR`; None: all `OWN_COLOR`
    color: jax.Array | None = None
    overflow: jax.Array | None = None  # int32 [B], objects without a slot; None: 0

    @property
    def x(self) -> jax.Array:
        """First column, int32 `[count, B]`."""
        return self._byte(0)

    @property
    def y(self) -> jax.Array:
        """First row, int32 `[count, B]`."""
        return self._byte(1)

    @property
    def w(self) -> jax.Array:
        """Width, int32 `[count, B]`."""
        return self._byte(2)

    @property
    def h(self) -> jax.Array:
        """Height, int32 `[count, B]`."""
        return self._byte(3)

    @property
    def valid(self) -> jax.Array:
        """True for slots that hold an object, bool `[count, B]`."""
        return self.box != 0

    def _byte(self, i: int) -> jax.Array:
        return (self.box >> (8 * i) & 255).astype(jnp.int32)

    def where(self, valid: jax.Array) -> "Detected":
        """Keep the objects where `valid`, bool `[count, B]`, is True."""
        return self._replace(box=jnp.where(valid, self.box, jnp.uint32(0)))


def words(x: ArrayLike, y: ArrayLike, w: ArrayLike, h: ArrayLike) -> jax.Array:
    """Pack boxes into words, uint32.

    Each number must be 0 to 255, because larger ones overflow into the next byte.
    """
    x, y, w, h = (jnp.asarray(v).astype(jnp.uint32) for v in (x, y, w, h))
    return x | (y << 8) | (w << 16) | (h << 24)


def boxes(x: ArrayLike, y: ArrayLike, w: ArrayLike, h: ArrayLike, valid: jax.Array) -> jax.Array:
    """Pack boxes into words, 0 where `valid` is False; the numbers there may be anything."""
    return jnp.where(valid, words(x, y, w, h), jnp.uint32(0))
