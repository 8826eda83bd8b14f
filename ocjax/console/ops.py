"""Operations for decoders: look-ups and divisions that XLA compiles to vector code.

All except `only` and `extremes` are elementwise: they take scalars or vectors of int32 and keep the
shape.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

__all__ = [
    "BEYOND",
    "among",
    "div",
    "extremes",
    "lookup",
    "match",
    "mod",
    "only",
    "pick",
    "reached",
    "when",
]

_Value = jax.Array | np.ndarray | int

BEYOND = 999  # beyond every row and column


def pick(index: jax.Array, values: Sequence[int]) -> jax.Array:
    """Return `values[index]` of a short table; an index out of range takes the last entry."""
    out = jnp.full_like(index, values[-1])
    for i, value in enumerate(values[:-1]):
        if value != values[-1]:
            out = jnp.where(index == i, value, out)
    return out


def match(*cases: tuple[jax.Array, _Value], otherwise: _Value) -> jax.Array:
    """Return the value of the first condition that holds.

    Args:
        cases: pairs of a condition, bool, and its value.
        otherwise: the value if no condition holds.
    """
    out = jnp.asarray(otherwise)
    for condition, value in reversed(cases):
        out = jnp.where(condition, value, out)
    return out


def when(condition: jax.Array | np.ndarray, value: _Value) -> jax.Array:
    """Return the value where the condition holds, and 0 elsewhere."""
    return jnp.where(condition, value, 0)


def only(chosen: jax.Array, values: _Value, axis: int | None = None) -> jax.Array:
    """Return the value of the chosen entry, along an axis or of all entries; 0 without one.

    Args:
        chosen: bool, with at most one True.
        values: int32, one for each entry.
        axis: the axis along which an entry is chosen; None: all axes.
    """
    return jnp.sum(jnp.where(chosen, values, 0), axis=axis)


def extremes(seen: jax.Array, first: _Value, last: _Value) -> tuple[jax.Array, jax.Array]:
    """The minimum `first` and the maximum `last` of the seen entries, int32 scalars.

    Without a seen entry these are `BEYOND` and 0.
    """
    return jnp.min(jnp.where(seen, first, BEYOND)), jnp.max(jnp.where(seen, last, 0))


def lookup(table: np.ndarray | Sequence[int], index: jax.Array) -> jax.Array:
    """Return `table[index]` of a 1-D table; an index out of range takes the nearest entry."""
    # `table[index]` slices for a scalar index.
    return jnp.take(jnp.asarray(np.asarray(table, np.int32)), index, mode="clip")


def among(x: jax.Array, values: range | Sequence[int]) -> jax.Array:
    """True if `x` is one of some values, or in a range of consecutive values."""
    if isinstance(values, range):
        return (x >= values.start) & (x < values.stop)
    return sum((x == value for value in values), jnp.zeros_like(x, bool))


def reached(x: jax.Array, limits: Sequence[int]) -> jax.Array:
    """The number of limits that `x` has reached, such as depths at which pictures grow."""
    return sum((jnp.where(x >= limit, 1, 0) for limit in limits), jnp.zeros_like(x))


def div(x: jax.Array, by: int) -> jax.Array:
    """Return `x // by` for `x >= 0` and `by > 0`, without the code for negative numbers."""
    return lax.div(x, jnp.full_like(x, by))


def mod(x: jax.Array, by: int) -> jax.Array:
    """Return `x % by` for `x >= 0` and `by > 0`."""
    # With `x` twice (`x - by * div(x, by)`), XLA computes an expensive `x` twice.
    return lax.rem(x, jnp.full_like(x, by))
