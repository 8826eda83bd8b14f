"""Running means and variances, to scale inputs and rewards."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.play.policies import MAX_INPUT

LEAST_VARIANCE = 1e-4  # inputs with a smaller variance count as constant


class Moments(NamedTuple):
    """Mean and variance of the samples seen so far."""

    mean: jax.Array  # float32
    variance: jax.Array  # float32
    total: jax.Array  # float32 scalar, the number of samples


def initial_moments(shape: tuple[int, ...]) -> Moments:
    """The moments before the first sample, which leave inputs unchanged."""
    return Moments(jnp.zeros(shape, jnp.float32), jnp.ones(shape, jnp.float32), jnp.float32(0))


def merge_moments(moments: Moments, samples: jax.Array | np.ndarray) -> Moments:
    """Add samples `[n, ...]` to the moments, by the algorithm of Chan et al. (1979)."""
    samples = jnp.asarray(samples)
    mean, variance = jnp.mean(samples, axis=0), jnp.var(samples, axis=0)
    count = jnp.float32(samples.shape[0])
    total = moments.total + count
    difference = mean - moments.mean
    squares = (
        moments.variance * moments.total
        + variance * count
        + difference**2 * (moments.total * count / total)
    )
    return Moments(moments.mean + difference * (count / total), squares / total, total)


def deviation(moments: Moments) -> jax.Array:
    """The standard deviation of each input; 1 for nearly constant inputs."""
    return jnp.where(moments.variance > LEAST_VARIANCE, jnp.sqrt(moments.variance), jnp.float32(1))


def standardized(moments: Moments, x: jax.Array | np.ndarray) -> jax.Array:
    """Inputs with mean 0 and variance 1; nearly constant inputs are only centred."""
    lead = (1,) * (np.ndim(x) - moments.mean.ndim)
    centered = jnp.asarray(x) - moments.mean.reshape(*lead, *moments.mean.shape)
    return jnp.clip(
        centered / deviation(moments).reshape(*lead, *moments.mean.shape), -MAX_INPUT, MAX_INPUT
    )


def scaled(moments: Moments, x: jax.Array | np.ndarray) -> jax.Array:
    """Numbers in units of the standard deviation, not centred."""
    return jnp.asarray(x) / jnp.sqrt(moments.variance + 1e-8)
