"""Gymnasium environments whose observations are objects."""

from ocjax.envs.ale import AlePool
from ocjax.envs.make import ObjectEnv, make, make_vec
from ocjax.envs.observations import Computed, Copied, Dqn, Masks, ObjectFields, Observation, Pixels, Ram, Snapshot, Vector
from ocjax.envs.perturbed import PerturbObjects
from ocjax.envs.pool import EmulatorPool
from ocjax.envs.process import WorkerError
from ocjax.envs.settings import PRESETS, Settings, settings
from ocjax.envs.states import States
from ocjax.envs.vector import ObjectVectorEnv
from ocjax.rom import RomError

__all__ = [
    "PRESETS",
    "AlePool",
    "Computed",
    "Copied",
    "Dqn",
    "EmulatorPool",
    "Masks",
    "ObjectEnv",
    "ObjectFields",
    "ObjectVectorEnv",
    "Observation",
    "PerturbObjects",
    "Pixels",
    "Ram",
    "RomError",
    "Settings",
    "Snapshot",
    "States",
    "Vector",
    "WorkerError",
    "make",
    "make_vec",
    "settings",
]
