"""Gymnasium environments with objects as observations."""

from ocjax.console.rom_files import RomError
from ocjax.emulators import variations
from ocjax.emulators.ale import AlePool
from ocjax.emulators.pool import EmulatorPool
from ocjax.emulators.process import WorkerError
from ocjax.emulators.settings import PRESETS, Settings, settings
from ocjax.emulators.states import States
from ocjax.envs.features import Vector
from ocjax.envs.make import ObjectEnv, make, make_vec
from ocjax.envs.observations import (
    Computed,
    Copied,
    Dqn,
    Masks,
    ObjectFields,
    Observation,
    Pixels,
    Ram,
    Snapshot,
    TerrainCells,
)
from ocjax.envs.perturbed import PerturbObjects
from ocjax.envs.vector import ObjectVectorEnv

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
    "TerrainCells",
    "Vector",
    "WorkerError",
    "make",
    "make_vec",
    "settings",
    "variations",
]
