"""Workarounds that make XLA's CPU code fast, each with the measurement that justifies it.

Times are microseconds for one state or frame on one core of a cloud machine, at batches of 4,096
states or 1,024 frames, jax 0.10.2. On other platforms than CPUs every function here is the plain
operation.

`B` is the batch size. To "materialize" a result means to compute it once and store it, instead of
letting the compiler compute it again in each place that uses it.
"""

from collections.abc import Callable
from typing import Any

import jax
from jax import lax
from jax.experimental.xla_metadata import set_xla_metadata

SMALL = 2**12  # elements below which materializing costs more than it saves
CACHE_LINES = 512  # rows whose length is a multiple of this map to the same cache lines


def on_cpu() -> bool:
    """Whether computations run on the CPU by default."""
    return jax.default_backend() == "cpu"


def _varying_axes(array: Any) -> frozenset[Any]:
    """The axes of a surrounding `shard_map` that an array varies over; JAX 0.10 renamed the attribute."""
    kind = jax.typeof(array)
    return getattr(
        getattr(kind, "manual_axis_type", kind), "varying", getattr(kind, "vma", frozenset())
    )


def varying(tree: Any, like: jax.Array) -> Any:
    """The arrays, marked as varying over the axes of `shard_map` that `like` varies over.

    Primitives and the states of loops require equal marks; constants have none.
    """

    def mark(array: Any) -> Any:
        missing = _varying_axes(like) - _varying_axes(array)
        return lax.pcast(array, tuple(missing), to="varying") if missing else array

    return jax.tree.map(mark, tree)


def materialize(f: Callable[..., Any], *x: jax.Array, small: int = SMALL) -> Any:
    """`f(*x)`, computed once and stored.

    XLA fuses cheap operations into each of their consumers, so that masks, transposed frames and
    decoded fields are computed again by every kernel that reads them. It does not fuse across a
    call that it is told not to inline. (`lax.optimization_barrier` is removed before the CPU
    compiler fuses.) Without it, VEM takes 210 to 470 instead of 40 for Space Invaders and 210 to
    540 instead of 29 to 40 for Ms. Pac-Man, REM 0.33 instead of 0.12 for Space Invaders. Below
    `small` elements the call costs more than it saves, and `f` is called as it is.
    """
    if x[0].size < small or not on_cpu():
        return f(*x)
    return set_xla_metadata(jax.jit(f)(*x), inlineable="false")


def padded(lanes: int) -> int:
    """The row length with which to store a batch of this size.

    Rows of 4,096 bytes map to the same cache lines, and transposing 128 of them takes 22 ns a
    state; with 16 more bytes a row it takes 10.
    """
    return lanes + 16 if on_cpu() and lanes % CACHE_LINES == 0 else lanes
