"""Workarounds that make XLA's CPU code fast, each with the measurement that justifies it.

Times are microseconds per state or frame on one core of a cloud machine, at batches of 4,096 states
or 1,024 frames, jax 0.10.2. On platforms other than CPUs every function here is the plain
operation.

`B` is the batch size. To "materialize" a result means to compute it once and store it. Otherwise
the compiler computes it again at each use.
"""

from collections.abc import Callable
from typing import Any

import jax
from jax import lax
from jax.experimental.xla_metadata import set_xla_metadata

# Elements. A smaller array is computed again at each use: its call costs more than it saves.
# Row `small arrays` of benchmarks/tricks.py.
MIN_MATERIALIZED_ELEMENTS = 2**12
# Elements per row. Rows of a multiple of this length map to the same cache lines. The padding is
# in elements, too. Evidence: `padded`, and row `padded rows` of benchmarks/tricks.py.
ALIASED_ROW_LENGTH = 512
ROW_PADDING = 16


def on_cpu() -> bool:
    """Return whether computations run on the CPU by default."""
    return jax.default_backend() == "cpu"


def _varying_axes(array: Any) -> frozenset[Any]:
    """Return the axes of a surrounding `shard_map` over which an array varies.

    JAX 0.10 renamed the attribute.
    """
    kind = jax.typeof(array)
    return getattr(
        getattr(kind, "manual_axis_type", kind), "varying", getattr(kind, "vma", frozenset())
    )


def varying(tree: Any, like: jax.Array) -> Any:
    """Mark arrays as varying over the same axes of `shard_map` as `like`.

    Primitives and the states of loops require equal marks; constants have none.
    """

    def mark(array: Any) -> Any:
        missing = _varying_axes(like) - _varying_axes(array)
        return lax.pcast(array, tuple(missing), to="varying") if missing else array

    return jax.tree.map(mark, tree)


def materialize(f: Callable[..., Any], *x: jax.Array, small: int | None = None) -> Any:
    """Compute `f(*x)` once and store it.

    XLA fuses cheap operations into each of their consumers, so every kernel that reads masks,
    transposed frames and decoded fields computes them again. XLA does not fuse across a call that
    must not be inlined. (It removes `lax.optimization_barrier` before it fuses.) Without such
    calls, VEM takes 210 to 470 instead of 40 for Space Invaders and 210 to 540 instead of 29 to 40
    for Ms. Pac-Man, and REM 0.33 instead of 0.12 for Space Invaders. Below `small` elements the
    call costs more than it saves, and `f` is called directly. The default is
    `MIN_MATERIALIZED_ELEMENTS`.
    """
    if x[0].size < (MIN_MATERIALIZED_ELEMENTS if small is None else small) or not on_cpu():
        return f(*x)
    return set_xla_metadata(jax.jit(f)(*x), inlineable="false")


def padded(lanes: int) -> int:
    """Return the row length for storing a batch of this size.

    Rows of 4,096 bytes map to the same cache lines, and transposing 128 of them takes 22 ns per
    state. With 16 more bytes per row it takes 10.
    """
    return lanes + ROW_PADDING if on_cpu() and lanes % ALIASED_ROW_LENGTH == 0 else lanes
