"""Saved states of emulators."""

import dataclasses
from collections.abc import Mapping
from typing import Any, Self

import numpy as np

from ocjax.envs._worker.interface import CommandArrays, EmulatorArrays

# The arrays of a pool that a saved state holds, as far as the pool records them.
_SHOWN = tuple(f.name for f in dataclasses.fields(EmulatorArrays) if f.name != "final")
_COMMAND = ("state", "state_bytes")


@dataclasses.dataclass(frozen=True)
class States:
    """Saved states of n emulators, from `clone_state`. They can be indexed, pickled, and restored into any pool of the game.

    Attributes:
        md5: MD5 hash of the game's ROM.
        rows: arrays `[n, ...]`: the states of the emulators, and what was observed of them.
    """

    md5: str
    rows: Mapping[str, np.ndarray]

    def __len__(self) -> int:
        return len(self.rows["state"])

    def __getitem__(self, index: Any) -> Self:
        """The states at an index, slice or mask; a single index gives a batch of one."""
        if isinstance(index, int | np.integer):
            index = [index]
        return type(self)(self.md5, {name: array[index] for name, array in self.rows.items()})


def collect(md5: str, shown: EmulatorArrays, commands: CommandArrays) -> States:
    """Copy the states that the workers have just left in the shared memory."""
    rows = {name: array.copy() for name, array in _saved(shown, commands).items() if name != "state"}
    rows["state"] = commands.state[:, : commands.state_bytes.max()].copy()
    return States(md5, rows)


def distribute(states: States, md5: str, shown: EmulatorArrays, commands: CommandArrays, chosen: np.ndarray) -> None:
    """Write states to the rows of the shared memory that are chosen, bool `[N]`, for the workers to restore.

    Raises:
        ValueError: the states are of another game or number, or were saved without frames that the pool records.
    """
    num_envs = len(chosen)
    if states.md5 != md5:
        raise ValueError(f"the states are of the ROM with md5 {states.md5}, but the pool runs the ROM with md5 {md5}")
    if len(states) not in (1, num_envs):
        raise ValueError(f"there must be 1 or {num_envs} states, got {len(states)}")
    targets = _saved(shown, commands)
    missing = sorted(set(targets) - set(states.rows))
    if missing:
        raise ValueError(f"the states were saved without {', '.join(missing)}, which this pool records")
    for name, target in targets.items():
        rows = np.broadcast_to(states.rows[name], (num_envs, *states.rows[name].shape[1:]))[chosen]
        if name == "state":
            target = target[:, : rows.shape[1]]
        target[chosen] = rows


def _saved(shown: EmulatorArrays, commands: CommandArrays) -> dict[str, np.ndarray]:
    """The arrays that a saved state holds, by name."""
    arrays = {name: getattr(shown, name) for name in _SHOWN}
    arrays |= {name: getattr(commands, name) for name in _COMMAND}
    return {name: array for name, array in arrays.items() if array is not None}
