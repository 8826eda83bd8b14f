"""The compiler tricks give the results of the plain operations, on all inputs and under JAX's
transformations."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from ocjax._xla import kernels

LARGE = 2 * kernels.MIN_MATERIALIZED_ELEMENTS + 3


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
    """The call survives the compiler: without it, the computation would be fused into its consumers
    again."""
    f = jax.jit(lambda x: kernels.materialize(lambda y: y * 3, x) + 1)
    assert " call(" in f.lower(jnp.zeros(LARGE, jnp.int32)).compile().as_text()


@pytest.mark.parametrize("lanes", [1, 31, 512, 513])
def test_padding(lanes):
    assert lanes <= kernels.padded(lanes) <= lanes + kernels.ROW_PADDING
