"""Rewards computed from objects."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.extraction.objects import Objects

# (objects before a step, objects after it, action) -> reward, for one environment: fields [N, ...],
# int32 or float32 [3], a number.
RewardFunction = Callable[[Objects, Objects, jax.Array], Any]
BatchedReward = Callable[[Objects, Objects, np.ndarray], np.ndarray]


def batched(reward_fn: RewardFunction) -> BatchedReward:
    """Compile a reward function, which JAX can trace, for a batch of environments.

    Returns:
        A function of the objects before and after a step, of batch shape `[B]`, and of actions,
        int32 `[B]` or float32 `[B, 3]`. It returns the rewards, float64 `[B]`.
    """
    if not callable(reward_fn):
        raise TypeError(
            "reward_fn must be a function of the previous objects, the objects and the action, "
            f"got {reward_fn!r}"
        )
    compiled = jax.jit(jax.vmap(reward_fn))

    def rewards(previous: Objects, current: Objects, actions: np.ndarray) -> np.ndarray:
        out = compiled(previous, current, jnp.asarray(actions))
        if getattr(out, "shape", None) != actions.shape[:1]:
            raise ValueError(
                f"reward_fn must return one number for one environment, got {_shape(out)}"
            )
        return np.asarray(out, np.float64)

    return rewards


def _shape(out: Any) -> str:
    return f"shape {list(out.shape[1:])}" if hasattr(out, "shape") else f"a {type(out).__name__}"
