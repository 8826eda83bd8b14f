"""Environments whose observations are objects."""

from ocjax.envs.ale import AlePool, RomError, States, WorkerError
from ocjax.envs.make import ObjectEnv, make, make_vec, ocatari
from ocjax.envs.observations import Computed, Copied, Dqn, Masks, ObjectFields, Observation, Pixels, Ram, Vector
from ocjax.envs.protocol import PRESETS, Protocol, protocol
from ocjax.envs.vector import ObjectVectorEnv

__all__ = [
    "PRESETS",
    "AlePool",
    "Computed",
    "Copied",
    "Dqn",
    "Masks",
    "ObjectEnv",
    "ObjectFields",
    "ObjectVectorEnv",
    "Observation",
    "Pixels",
    "Protocol",
    "Ram",
    "RomError",
    "States",
    "Vector",
    "WorkerError",
    "make",
    "make_vec",
    "ocatari",
    "protocol",
]
