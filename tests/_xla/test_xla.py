"""The compiler tricks give what the plain operations give, on all inputs and under JAX's transformations."""

import os
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from ocjax._xla import kernels

LARGE = 2 * kernels.SMALL + 3


@pytest.mark.parametrize(
    "values",
    [
        np.full(LARGE, -7, np.int32),
        np.zeros(LARGE, np.int32),
        np.arange(LARGE, dtype=np.uint8),
        np.zeros(LARGE, bool),
        np.full(LARGE, np.nan, np.float32),
        np.full(3, -1, np.int32),
    ],
)
def test_materialize(values):
    def f(x):
        return x, x[::-1]

    got = jax.jit(lambda x: kernels.materialize(f, x))(values)
    for a, b in zip(got, f(values), strict=True):
        np.testing.assert_array_equal(a, b)


def test_materialize_stores():
    """The call survives the compiler: without it, the computation would be fused into its consumers again."""
    f = jax.jit(lambda x: kernels.materialize(lambda y: y * 3, x) + 1)
    assert " call(" in f.lower(jnp.zeros(LARGE, jnp.int32)).compile().as_text()


@pytest.mark.parametrize("lanes", [1, 31, 512, 513])
def test_transpose_and_padding(lanes):
    rows = np.arange(6 * lanes, dtype=np.int32).reshape(6, lanes)
    np.testing.assert_array_equal(jax.jit(kernels.transpose)(rows), rows.T)
    assert lanes <= kernels.padded(lanes) <= lanes + 16


@pytest.mark.parametrize("shape", [(1,), (15,), (16,), (17,), (700,), (3, 5), (50, 5)])
def test_running_sum(shape):
    x = np.random.default_rng(0).integers(-9, 9, shape).astype(np.int32)
    assert np.array_equal(kernels.running_sum(jnp.asarray(x)), np.cumsum(x, axis=0))


@pytest.mark.parametrize("n", [1, 4, 5, 8, 11])
def test_chunks(n):
    x = np.arange(3 * n, dtype=np.int32).reshape(n, 3)
    got = jax.jit(lambda v: kernels.in_chunks(lambda c: {"sum": c.sum(axis=1), "twice": 2 * c}, v, 4))(x)
    np.testing.assert_array_equal(got["sum"], x.sum(axis=1))
    np.testing.assert_array_equal(got["twice"], 2 * x)


def test_any_batch():
    f = kernels.any_batch(lambda x: {"sum": x.sum(axis=-1)}, 1, 4)
    x = np.arange(24, dtype=np.int32).reshape(2, 3, 4)
    for got in (f(x), jax.vmap(f)(x), jax.jit(f)(x), jax.vmap(jax.vmap(f))(x)):
        np.testing.assert_array_equal(got["sum"], x.sum(axis=-1))
    assert f(x[0, 0])["sum"].shape == ()
    assert f(x[:, :0])["sum"].shape == (2, 0)


@pytest.mark.parametrize("device", [False, True])
def test_batches_of_many_lengths_share_programs(device):
    compiled = []

    def total(x):
        compiled.append(x.shape)
        return {"sum": x.sum(axis=-1)}

    f = kernels.any_batch(total, 1, 16)
    for n in (*range(1, 100), 300):
        x = np.arange(4 * n, dtype=np.int32).reshape(n, 4)
        np.testing.assert_array_equal(f(jnp.asarray(x) if device else x)["sum"], x.sum(axis=-1))
    assert sorted(set(compiled)) == [(n, 4) for n in (1, 2, 4, 8, 16, 32, 48, 64, 80, 96, 112, 320)]


def test_shared_sizes():
    for n in (*range(1, 3000), 12345):
        size = kernels.shared_size(n, 64)
        assert n <= size < max(2 * n, n + 64 + n / 8)
        assert kernels.shared_size(size, 64) == size
        assert size <= 64 or size % 64 == 0


def test_compilation_cache():
    program = "import jax, ocjax; print(ocjax.use_compilation_cache(), jax.config.jax_compilation_cache_dir)"
    for variables, folder in (({"XDG_CACHE_HOME": "A"}, "A/ocjax/xla"), ({"JAX_COMPILATION_CACHE_DIR": "B"}, "B")):
        run = subprocess.run([sys.executable, "-c", program], env=_without_cache(os.environ) | variables, capture_output=True, text=True)
        assert run.stdout.split() == [folder, folder], run.stderr


def _without_cache(variables):
    return {k: v for k, v in variables.items() if k not in ("XDG_CACHE_HOME", "JAX_COMPILATION_CACHE_DIR")}


def test_retained_memory_is_asked_for(monkeypatch):
    monkeypatch.setenv("MALLOC_TRIM_THRESHOLD_", "1000000")
    kernels.retain_freed_memory.cache_clear()
    assert kernels.retain_freed_memory() is False  # the user's own setting takes precedence
    kernels.retain_freed_memory.cache_clear()
