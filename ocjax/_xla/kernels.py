"""Workarounds that make XLA's CPU code fast, each with the measurement that justifies it.

Times are microseconds per state or frame on one core, at batches of 4,096 states or 1,024 frames,
jax 0.10.2. On other platforms every function here is the plain operation. To "materialize" a result
means to compute it once and store it, instead of again at each use.
"""

from collections.abc import Callable
from typing import Any

import jax
from jax import lax
from jax.experimental.xla_metadata import set_xla_metadata

# Elements. Smaller arrays are computed again at each use. Row `small arrays` of
# benchmarks/tricks.py.
MIN_MATERIALIZED_ELEMENTS = 2**12
# Elements per row. Rows of a multiple of this length map to the same cache lines. The padding is in
# elements, too. Row `padded rows` of benchmarks/tricks.py.
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
    """Mark arrays, such as constants, as varying over the axes of `shard_map` of `like`."""

    def mark(array: Any) -> Any:
        missing = _varying_axes(like) - _varying_axes(array)
        return lax.pcast(array, tuple(missing), to="varying") if missing else array

    return jax.tree.map(mark, tree)


def materialize(f: Callable[..., Any], *x: jax.Array, small: int | None = None) -> Any:
    """Compute `f(*x)` once and store it.

    XLA fuses cheap operations into each of their consumers, but not across a call that must not be
    inlined. (It removes `lax.optimization_barrier` before it fuses.) Without such calls, VEM takes
    210 to 470 instead of 40 for Space Invaders, and REM 0.33 instead of 0.12. Below `small`
    elements, by default `MIN_MATERIALIZED_ELEMENTS`, `f` is called directly.
    """
    if x[0].size < (MIN_MATERIALIZED_ELEMENTS if small is None else small) or not on_cpu():
        return f(*x)
    return set_xla_metadata(jax.jit(f)(*x), inlineable="false")


def padded(lanes: int) -> int:
    """Return the row length for storing a batch of this size.

    Transposing 128 rows of 4,096 bytes takes 22 ns per state, with 16 more bytes per row 10.
    """
    return lanes + ROW_PADDING if on_cpu() and lanes % ALIASED_ROW_LENGTH == 0 else lanes
