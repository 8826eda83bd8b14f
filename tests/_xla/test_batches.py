"""Batches of every shape give the results of single elements, in a few programs."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from ocjax._xla import batches


@pytest.mark.parametrize("n", [1, 4, 5, 8, 11])
def test_chunks(n):
    x = np.arange(3 * n, dtype=np.int32).reshape(n, 3)
    got = jax.jit(
        lambda v: batches.in_chunks(lambda c: {"sum": c.sum(axis=1), "twice": 2 * c}, v, 4)
    )(x)
    np.testing.assert_array_equal(got["sum"], x.sum(axis=1))
    np.testing.assert_array_equal(got["twice"], 2 * x)


@pytest.mark.parametrize(("most", "expected"), [(None, [11]), (4, [4, 4]), (11, [11])])
def test_chunks_on_other_platforms(monkeypatch, most, expected):
    monkeypatch.setattr(batches, "on_cpu", lambda: False)
    sizes = []

    def double(x):
        sizes.append(len(x))
        return 2 * x

    x = np.arange(11, dtype=np.int32)
    got = jax.jit(lambda v: batches.in_chunks(double, v, 2, elsewhere=most))(x)
    np.testing.assert_array_equal(got, 2 * x)
    assert set(sizes) == set(expected)


def test_any_batch_shape():
    f = batches.AnyBatch(lambda x: {"sum": x.sum(axis=-1)}, 1, 4)
    x = np.arange(24, dtype=np.int32).reshape(2, 3, 4)
    for got in (f(x), jax.vmap(f)(x), jax.jit(f)(x), jax.vmap(jax.vmap(f))(x)):
        np.testing.assert_array_equal(got["sum"], x.sum(axis=-1))
    assert f(x[0, 0])["sum"].shape == ()
    assert f(x[:, :0])["sum"].shape == (2, 0)


@pytest.mark.parametrize("device", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_batches_of_many_lengths_share_programs(device):
    compiled = []

    def total(x):
        compiled.append(x.shape)
        return {"sum": x.sum(axis=-1)}

    f = batches.AnyBatch(total, 1, 16)
    for n in (*range(1, 100), 300):
        x = np.arange(4 * n, dtype=np.int32).reshape(n, 4)
        np.testing.assert_array_equal(f(jnp.asarray(x) if device else x)["sum"], x.sum(axis=-1))
    assert sorted(set(compiled)) == [(n, 4) for n in (1, 2, 4, 8, 16, 32, 48, 64, 80, 96, 112, 320)]


def test_shared_sizes():
    for n in (*range(1, 3000), 12345):
        size = batches.shared_size(n, 64)
        assert n <= size < max(2 * n, n + 64 + n / 8)
        assert batches.shared_size(size, 64) == size
        assert size <= 64 or size % 64 == 0
