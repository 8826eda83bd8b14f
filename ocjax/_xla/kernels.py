"""Workarounds that make XLA's CPU code fast, each with the measurement that justifies it.

Times are microseconds for one state or frame on one core of a cloud machine, at batches of 4,096 states or 1,024 frames, jax 0.10.2.
On other platforms than CPUs every function here is the plain operation.

`B` is the batch size. To "materialize" a result means to compute it once and store it, instead of letting the compiler compute it again
in each place that uses it.
"""

import contextlib
import ctypes
import functools
import math
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.core import Tracer
from jax.experimental.xla_metadata import set_xla_metadata

try:
    from jax.extend.core import get_opaque_trace_state
except ImportError:  # before jax 0.10
    from jax.core import get_opaque_trace_state  # pyright: ignore

from ocjax._xla.sharding import by_device

RETAIN_MEMORY = "OCJAX_RETAIN_MEMORY"  # environment variable: 1 asks for `retain_freed_memory` on import
SMALL = 2**12  # elements below which materializing costs more than it saves
MIN_CACHED_SECONDS = 0.2  # compilations that take longer are kept on disk
GROUP = 16  # elements of a running sum that are added at once
MAX_SUMMED = 2**12  # elements of a running sum up to which it is computed in groups
_NO_TRACE = get_opaque_trace_state()  # outside of `jit`, `vmap` and the like
CACHE_LINES = 512  # rows whose length is a multiple of this map to the same cache lines


def on_cpu() -> bool:
    """Whether computations run on the CPU by default."""
    return jax.default_backend() == "cpu"


def _varying_axes(array: Any) -> frozenset[Any]:
    """The axes of a surrounding `shard_map` that an array varies over; JAX 0.10 renamed the attribute."""
    kind = jax.typeof(array)
    return getattr(getattr(kind, "manual_axis_type", kind), "varying", getattr(kind, "vma", frozenset()))


def varying(tree: Any, like: jax.Array) -> Any:
    """The arrays, marked as varying over the axes of `shard_map` that `like` varies over.

    Primitives and the states of loops require equal marks; constants have none.
    """

    def mark(array: Any) -> Any:
        missing = _varying_axes(like) - _varying_axes(array)
        return lax.pcast(array, tuple(missing), to="varying") if missing else array

    return jax.tree.map(mark, tree)


# ------------------------------------------------------------------------------------------------------------ materialize


def materialize(f: Callable[..., Any], *x: jax.Array, small: int = SMALL) -> Any:
    """`f(*x)`, computed once and stored.

    XLA fuses cheap operations into each of their consumers, so that masks, transposed frames and decoded fields are computed again by
    every kernel that reads them. It does not fuse across a call that it is told not to inline. (`lax.optimization_barrier` is removed
    before the CPU compiler fuses.) Without it, VEM takes 210 to 470 instead of 40 for Space Invaders and 210 to 540 instead of 29 to 40
    for Ms. Pac-Man, REM 0.33 instead of 0.12 for Space Invaders.
    Below `small` elements the call costs more than it saves, and `f` is called as it is.
    """
    if x[0].size < small or not on_cpu():
        return f(*x)
    return set_xla_metadata(jax.jit(f)(*x), inlineable="false")


# ------------------------------------------------------------------------------------------------------------ layout


def transpose(rows: jax.Array) -> jax.Array:
    """`[n, B]` -> `[B, n]`, in memory.

    XLA emits a blocked transpose only for a standalone operation with an extra axis; flat or fused it takes three to six times as long.
    """
    if not on_cpu():
        return rows.T
    n, lanes = rows.shape
    return lax.optimization_barrier(rows.T.reshape(lanes, 1, n))[:, 0]


def padded(lanes: int) -> int:
    """The row length with which to store a batch of this size.

    Rows of 4,096 bytes map to the same cache lines, and transposing 128 of them takes 22 ns a state; with 16 more bytes a row it takes 10.
    """
    return lanes + 16 if on_cpu() and lanes % CACHE_LINES == 0 else lanes


def in_chunks(f: Callable[[jax.Array], Any], x: jax.Array, size: int) -> Any:
    """`f` of a batch, `size` elements at a time, so that intermediate results stay in the processor's cache.

    In one piece, VEM of 512 frames takes 130 instead of 72 for Space Invaders and 95 instead of 34 for Pong. Chunks are written in place:
    stacked by `lax.map`, results are copied once more, and REM of 65,536 states takes 1.8 instead of 1.5 for Ms. Pac-Man.
    """
    n = x.shape[0]
    if not on_cpu() or n <= size:
        return f(x)
    one = jax.jit(f)  # traced once
    shapes = jax.eval_shape(one, jax.ShapeDtypeStruct((size, *x.shape[1:]), x.dtype))
    whole = jax.tree.map(lambda a: lax.empty((n, *a.shape[1:]), a.dtype), shapes)

    def step(i: jax.Array, whole: Any) -> Any:
        # Where the batch is no multiple, the last chunk overlaps the one before: a smaller one would be compiled as a second program.
        start = jnp.minimum(i * size, n - size)
        part = one(lax.dynamic_slice_in_dim(x, start, size))
        return jax.tree.map(lambda a, b: lax.dynamic_update_slice_in_dim(a, b, start, 0), whole, part)

    return lax.fori_loop(0, -(-n // size), step, varying(whole, x))


# ------------------------------------------------------------------------------------------------------------ sums


def running_sum(x: jax.Array) -> jax.Array:
    """`jnp.cumsum` of `[n]` or `[n, B]` along its first axis.

    XLA turns JAX's into about eight kernels, which take 0.15 s to compile. Here, the sums within groups of elements and those over groups
    take four. Their work grows with the square of the length, so longer arrays are left to JAX.
    """
    if not on_cpu() or len(x) > MAX_SUMMED:
        return jnp.cumsum(x, axis=0)
    groups, tail = -(-len(x) // GROUP), x.shape[1:]
    filled = jnp.pad(x, ((0, groups * GROUP - len(x)), *((0, 0) for _ in tail)))
    within = _triangle(filled.reshape(groups, GROUP, *tail).swapaxes(0, 1), 0)
    before = _triangle(within[-1], -1)
    return (within + before[None]).swapaxes(0, 1).reshape(-1, *tail)[: len(x)]


def _triangle(x: jax.Array, diagonal: int) -> jax.Array:
    """For each i the sum of the elements j <= i + diagonal of the first axis."""
    summed = np.tri(len(x), k=diagonal, dtype=bool).reshape(len(x), len(x), *(1 for _ in x.shape[1:]))
    return jnp.sum(jnp.where(summed, x[None], 0), axis=1, dtype=x.dtype)


# ------------------------------------------------------------------------------------------------------------ batches


QUICK_COMPILATION = {"xla_cpu_use_fusion_emitters": False, "xla_cpu_parallel_codegen_split_count": 1}


@functools.cache
def compiler_options() -> dict[str, Any] | None:
    """Options for compilation on the CPU; None where this version of XLA does not know them."""
    if not on_cpu():
        return None
    try:
        jax.jit(lambda x: x, compiler_options=QUICK_COMPILATION).lower(jnp.int32(0)).compile()
    except (RuntimeError, ValueError):
        return None
    return QUICK_COMPILATION


def jit(f: Callable[..., Any]) -> Callable[..., Any]:
    """`jax.jit` for calls with concrete arrays, compiled by XLA's older emitters of fused loops, and in one piece.

    The newer emitters take about twice as long to compile and are no faster: Beam Rider's VEM 7.2 s instead of 5.2 of processor time, its
    REM 1.6 instead of 0.9. Code generation split over threads takes a tenth more. With LLVM's second optimization level instead of its
    third, compiling takes three quarters of the time, but VEM takes 13 % and REM 18 % longer. JAX accepts such options only
    for the outermost `jit`.
    """

    @functools.cache
    def compiled() -> Callable[..., Any]:
        return jax.jit(f, compiler_options=compiler_options())

    return lambda *args: compiled()(*args)


def any_batch(f: Callable[[jax.Array], Any], rank: int, chunk: int) -> Callable[[jax.Array | np.ndarray], Any]:
    """Extend a function of `[B, ...]`, B > 0, to any leading batch shape.

    A single state and the batch sizes of `shared_size` have compiled functions of their own. Batches of other sizes and shapes are filled
    up to the next such size, so that recordings of many lengths share a few programs; what fills up and cuts off takes some 20 ms to
    compile where a game's VEM takes seconds. `vmap` of the result is the function on a larger batch.

    Args:
        f: maps `[B, *tail]` to a pytree of arrays `[B, ...]`.
        rank: number of axes of `tail`.
        chunk: elements that `f` processes at a time (`in_chunks`).
    """
    inlined = jax.jit(f)

    def folded(x: jax.Array) -> Any:
        batch, tail = x.shape[: x.ndim - rank], x.shape[x.ndim - rank :]
        if len(batch) == 1 and batch[0] > 0:
            return inlined(x)
        n = math.prod(batch)
        out = inlined(x.reshape(n, *tail) if n else jnp.zeros((1, *tail), x.dtype))
        return jax.tree.map(lambda a: a[:n].reshape(*batch, *a.shape[1:]), out)

    divided = by_device(folded, rank)
    compiled, compiled_divided, traced = jit(folded), jit(divided), jax.custom_batching.custom_vmap(divided)

    @traced.def_vmap
    def _(axis_size: int, in_batched: list[bool], x: jax.Array) -> tuple[Any, Any]:
        out = call(x)
        return out, jax.tree.map(lambda _: True, out)

    def in_shared_size(x: jax.Array | np.ndarray) -> Any:
        batch = x.shape[: x.ndim - rank]
        size = shared_size(math.prod(batch), chunk)
        return compiled(x) if batch in ((), (size,)) else _cut_off(compiled(_filled_up(x, rank, size)), batch)

    def call(x: jax.Array | np.ndarray) -> Any:
        if isinstance(x, Tracer) or get_opaque_trace_state() != _NO_TRACE:
            with _with_32_bits():
                return traced(jnp.asarray(x))
        is_array = isinstance(x, jax.Array)
        with _with_32_bits():
            out = compiled_divided(x) if is_array and len(x.sharding.device_set) > 1 else in_shared_size(x)
        # JAX may read a numpy array in place while it computes: wait, so that the caller can overwrite it.
        return out if is_array else jax.block_until_ready(out)

    return call


def shared_size(n: int, chunk: int) -> int:
    """The batch size to which a batch of `n` is filled up: a power of two up to `chunk`, then a multiple of it.

    Above eight chunks there are eight such sizes between a power of two and the next one, so that at most an eighth is computed in vain.
    """
    if n <= chunk:
        return 1 << max(n - 1, 0).bit_length()
    chunks = -(-n // chunk)
    step = 1 << max(chunks.bit_length() - 4, 0)
    return -(-chunks // step) * step * chunk


def _with_32_bits() -> contextlib.AbstractContextManager[Any]:
    """Decoders and rules compute with 32 bits, whatever the caller's default is."""
    return jax.enable_x64(False) if jax.config.jax_enable_x64 else contextlib.nullcontext()  # pyright: ignore[reportAttributeAccessIssue]


def _filled_up(x: jax.Array | np.ndarray, rank: int, size: int) -> jax.Array | np.ndarray:
    """`[..., *tail]` as `[size, *tail]`, with zeros behind."""
    if isinstance(x, jax.Array):
        return _filled_up_on_device(x, rank, size)
    tail = x.shape[x.ndim - rank :]
    n = math.prod(x.shape[: x.ndim - rank])
    out = np.zeros((size, *tail), x.dtype)
    out[:n] = x.reshape(n, *tail)
    return out


@functools.partial(jax.jit, static_argnums=(1, 2))
def _filled_up_on_device(x: jax.Array, rank: int, size: int) -> jax.Array:
    tail = x.shape[x.ndim - rank :]
    n = math.prod(x.shape[: x.ndim - rank])
    return jnp.pad(x.reshape(n, *tail), ((0, size - n), *((0, 0) for _ in tail)))


@functools.partial(jax.jit, static_argnums=1)
def _cut_off(tree: Any, batch: tuple[int, ...]) -> Any:
    """The first elements of arrays `[size, ...]`, in a batch shape."""
    n = math.prod(batch)
    return jax.tree.map(lambda a: a[:n].reshape(*batch, *a.shape[1:]), tree)


# ------------------------------------------------------------------------------------------------------------ compilation cache


def use_compilation_cache() -> Path:
    """Keep compiled programs on disk, so that a game's first call is two to five times faster from the second process on.

    Call it before the first extraction. It sets JAX's persistent compilation cache for the whole process, and leaves alone a folder that
    `JAX_COMPILATION_CACHE_DIR` or the program has chosen. The `ocjax` command calls it. To empty the cache, delete the folder.

    Returns:
        The folder: `~/.cache/ocjax/xla`, or `ocjax/xla` in `$XDG_CACHE_HOME`, unless another one was chosen.
    """
    chosen: str | None = jax.config.jax_compilation_cache_dir  # pyright: ignore[reportAttributeAccessIssue]
    if chosen is not None:
        return Path(chosen)
    folder = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "ocjax" / "xla"
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", MIN_CACHED_SECONDS)
    return folder


# ------------------------------------------------------------------------------------------------------------ memory


# Parameters of glibc's mallopt by the environment variables that set them. Freed memory is not returned to the system, not even that of
# large blocks, which glibc maps one by one, or of threads, each of which has a heap of its own.
MALLOC = {
    "MALLOC_TRIM_THRESHOLD_": (-1, 2**31 - 1),
    "MALLOC_MMAP_MAX_": (-4, 0),
    "MALLOC_ARENA_MAX": (-8, 1),
}


@functools.cache
def retain_freed_memory() -> bool:
    """Ask the C library to keep freed memory for later allocations; it applies to the whole process.

    By default glibc returns large results to the system when they are dropped, and the next call's pages are mapped and cleared again. At
    65,536 states, that takes Ms. Pac-Man's REM from 1.5 to 2.9 microseconds of processor time a state; at 4,096 it takes 0.9. The `ocjax`
    command and the benchmarks call this function; other programs call it, or set the environment variable `OCJAX_RETAIN_MEMORY=1` before
    they import ocjax. `MALLOC_TRIM_THRESHOLD_`, `MALLOC_MMAP_THRESHOLD_`, `MALLOC_MMAP_MAX_` and `MALLOC_ARENA_MAX` take precedence.

    Returns:
        Whether it took effect: False without glibc or where one of those variables is set.
    """
    if sys.platform != "linux" or {"MALLOC_MMAP_THRESHOLD_", *MALLOC} & os.environ.keys():
        return False
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    return mallopt is not None and all(mallopt(*setting) for setting in MALLOC.values())


if os.environ.get(RETAIN_MEMORY) == "1":
    retain_freed_memory()
