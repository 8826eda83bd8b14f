"""Batches of any shape and size, divided into chunks, in a few compiled programs."""

import contextlib
import functools
import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.core import Tracer

try:
    from jax.extend.core import get_opaque_trace_state
except ImportError:  # before jax 0.10
    from jax.core import get_opaque_trace_state  # pyright: ignore

from ocjax._xla.kernels import on_cpu, varying
from ocjax._xla.sharding import by_device

_NO_TRACE = get_opaque_trace_state()  # outside of `jit`, `vmap` and similar transformations
# Sizes of batches between a number of chunks that is a power of two and the next power. More sizes
# waste less computation, and fewer compile fewer programs. Row `shared sizes` of
# benchmarks/tricks.py.
SIZES_PER_DOUBLING = 8
# Evidence: `jit`, and rows `compiler options` and following of benchmarks/tricks.py.
COMPILER_OPTIONS = {
    "xla_cpu_use_fusion_emitters": False,
    "xla_cpu_parallel_codegen_split_count": 1,
    "xla_cpu_prefer_vector_width": 512,
}


@functools.cache
def compiler_options() -> dict[str, Any] | None:
    """Options for compilation on the CPU; None if this version of XLA does not know them."""
    if not on_cpu():
        return None
    try:
        jax.jit(lambda x: x, compiler_options=COMPILER_OPTIONS).lower(jnp.int32(0)).compile()
    except (RuntimeError, ValueError):
        return None
    return COMPILER_OPTIONS


def jit(f: Callable[..., Any]) -> Callable[..., Any]:
    """Apply `jax.jit` for concrete arrays, with XLA's older fusion emitters and in one piece.

    - The newer emitters take about twice as long to compile, and their code is no faster.
    - Code generation split over threads takes a tenth more.
    - Vectors of 512 bits make VEM take 5 % less on an Intel Xeon with AVX-512, and REM 2 % less.

    LLVM's second optimization level compiles in three quarters of the time, but VEM takes 13 % and
    REM 18 % longer. JAX accepts such options only for the outermost `jit`.
    """

    @functools.cache
    def compiled() -> Callable[..., Any]:
        return jax.jit(f, compiler_options=compiler_options())

    return lambda *args: compiled()(*args)


class AnyBatch:
    """A function of `[B, ...]`, B > 0, extended to any leading batch shape.

    A single state and each batch size of `shared_size` has a separate compiled function. Batches of
    other sizes and shapes are padded to the next such size, so that recordings of many lengths
    share a few programs. `vmap` of the result is the function on a larger batch.

    Args:
        f: maps `[B, *tail]` to a pytree of arrays `[B, ...]`.
        rank: number of axes of `tail`.
        chunk: elements that `f` processes at a time (`in_chunks`).
        compiler: `jit`, or `jax.jit` for functions that are faster with XLA's newer emitters.
    """

    def __init__(
        self,
        f: Callable[[jax.Array], Any],
        rank: int,
        chunk: int,
        compiler: Callable[[Any], Any] = jit,
    ) -> None:
        self._inlined, self._rank, self._chunk = jax.jit(f), rank, chunk
        divided = by_device(self._folded, rank)
        self._compiled, self._compiled_divided = compiler(self._folded), compiler(divided)
        self._traced = jax.custom_batching.custom_vmap(divided)
        self._traced.def_vmap(self._of_larger_batch)

    def __call__(self, x: jax.Array | np.ndarray) -> Any:
        if isinstance(x, Tracer) or get_opaque_trace_state() != _NO_TRACE:
            with _with_32_bits():
                return self._traced(jnp.asarray(x))
        if isinstance(x, jax.Array):
            with _with_32_bits():
                return (
                    self._compiled_divided(x)
                    if len(x.sharding.device_set) > 1
                    else self._in_shared_size(x)
                )
        with _with_32_bits():
            out = self._in_shared_size(x)
        # JAX may read a NumPy array in place while it computes: wait, so that the caller can
        # overwrite it.
        return jax.block_until_ready(out)

    def _batch(self, x: jax.Array | np.ndarray) -> tuple[int, ...]:
        return x.shape[: x.ndim - self._rank]

    def _folded(self, x: jax.Array) -> Any:
        """Compute a batch of any shape; for an empty batch, compute and drop a single element."""
        batch = self._batch(x)
        if len(batch) == 1 and batch[0] > 0:
            return self._inlined(x)
        n, tail = math.prod(batch), x.shape[x.ndim - self._rank :]
        out = self._inlined(x.reshape(n, *tail) if n else jnp.zeros((1, *tail), x.dtype))
        return jax.tree.map(lambda a: a[:n].reshape(*batch, *a.shape[1:]), out)

    def _of_larger_batch(
        self, axis_size: int, in_batched: list[bool], x: jax.Array
    ) -> tuple[Any, Any]:
        out = self(x)
        return out, jax.tree.map(lambda _: True, out)

    def _in_shared_size(self, x: jax.Array | np.ndarray) -> Any:
        batch = self._batch(x)
        size = shared_size(math.prod(batch), self._chunk)
        if batch in ((), (size,)):
            return self._compiled(x)
        return _cut_off(self._compiled(_filled_up(x, self._rank, size)), batch)


def shared_size(n: int, chunk: int) -> int:
    """Round a batch size up: to a power of two up to `chunk`, then to a multiple of `chunk`.

    Above `SIZES_PER_DOUBLING` chunks, at most an eighth of the computation is wasted.
    """
    if n <= chunk:
        return 1 << max(n - 1, 0).bit_length()
    chunks = -(-n // chunk)
    step = max((1 << chunks.bit_length() - 1) // SIZES_PER_DOUBLING, 1)
    return -(-chunks // step) * step * chunk


def _with_32_bits() -> contextlib.AbstractContextManager[Any]:
    """Use 32 bits for decoders and rules, regardless of the caller's default."""
    enabled: bool = jax.config.jax_enable_x64  # pyright: ignore
    return jax.enable_x64(False) if enabled else contextlib.nullcontext()


def _filled_up(x: jax.Array | np.ndarray, rank: int, size: int) -> jax.Array | np.ndarray:
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
    n = math.prod(batch)
    return jax.tree.map(lambda a: a[:n].reshape(*batch, *a.shape[1:]), tree)


def by_chunks(f: Callable[[np.ndarray], Any], x: np.ndarray, size: int) -> Any:
    """Apply `f` to `[n, ...]`, n > 0, in chunks of one size; return NumPy arrays `[n, ...]`.

    The last chunk is padded with its first row, so `f` is compiled once.
    """
    parts = []
    for start in range(0, len(x), size):
        chunk = x[start : start + size]
        n = len(chunk)
        filling = np.repeat(chunk[:1], size - n, axis=0)
        found = f(np.concatenate([chunk, filling]))
        parts.append(jax.tree.map(lambda a, n=n: np.asarray(a)[:n], found))
    return jax.tree.map(lambda *arrays: np.concatenate(arrays), *parts)


def in_chunks(f: Callable[[Any], Any], x: Any, size: int, *, elsewhere: int | None = None) -> Any:
    """Apply `f` to `size` elements of a pytree at a time, to keep its results in the cache.

    Platforms other than the CPU apply it to `elsewhere` elements at a time, by default to all.

    In one piece, VEM of 512 frames takes 95 us per frame instead of 34 for Pong. Chunks are written
    in place: `lax.map` copies results once more, and REM of 65,536 states takes 1.8 us instead of
    1.5 for Ms. Pac-Man.
    """
    n = jax.tree.leaves(x)[0].shape[0]
    if not on_cpu():
        size = elsewhere or n
    if n <= size:
        return f(x)
    one = jax.jit(f)  # traced once
    chunk = jax.tree.map(lambda a: jax.ShapeDtypeStruct((size, *a.shape[1:]), a.dtype), x)
    shapes = jax.eval_shape(one, chunk)
    whole = jax.tree.map(lambda a: lax.empty((n, *a.shape[1:]), a.dtype), shapes)

    def step(i: jax.Array, whole: Any) -> Any:
        # If the batch is no multiple, the last chunk overlaps the one before: a smaller chunk would
        # need a second program.
        start = jnp.minimum(i * size, n - size)
        part = one(jax.tree.map(lambda a: lax.dynamic_slice_in_dim(a, start, size), x))
        return jax.tree.map(
            lambda a, b: lax.dynamic_update_slice_in_dim(a, b, start, 0), whole, part
        )

    return lax.fori_loop(0, -(-n // size), step, varying(whole, jax.tree.leaves(x)[0]))
