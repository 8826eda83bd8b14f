"""Environments whose observations are objects."""

from ocjax.envs.ale import AlePool, WorkerError
from ocjax.envs.vector import ObjectVectorEnv, make_vec

__all__ = ["AlePool", "ObjectVectorEnv", "WorkerError", "make_vec"]
