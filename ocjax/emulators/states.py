"""Saved states of emulators."""

import dataclasses
import io
from collections.abc import Iterable, Mapping
from typing import Any, Self

import numpy as np

from ocjax._files import npz
from ocjax.emulators.worker import console
from ocjax.emulators.worker.emulator import Phase
from ocjax.emulators.worker.interface import STATE_BYTES, CommandArrays, EmulatorArrays
from ocjax.extraction.edits import edit
from ocjax.extraction.game import Game
from ocjax.extraction.registry import as_game

# The arrays of a pool that a saved state contains, if the pool records them.
_SHOWN = tuple(f.name for f in dataclasses.fields(EmulatorArrays) if f.name != "final")
_COMMAND = (
    "state",
    "state_bytes",
    "phase",
    "held_strength",
    "generator",
    "before",
    "has_before",
)


@dataclasses.dataclass(frozen=True, repr=False)
class States:
    """Saved states of n emulators, from `clone_state`.

    They can be indexed, written to files, and restored in any pool of the game.

    Attributes:
        md5: MD5 hash of the game's ROM.
        rows: arrays `[n, ...]`: the states of the emulators, and the observed values.
    """

    md5: str
    rows: Mapping[str, np.ndarray]

    def __repr__(self) -> str:
        return f"States of {len(self)} emulators with the ROM of md5 {self.md5}"

    def __len__(self) -> int:
        return len(self.rows["state"])

    def __getitem__(self, index: Any) -> Self:
        """The states at an index, slice or mask; a single index gives a batch of one."""
        if isinstance(index, int | np.integer):
            index = [index]
        return type(self)(self.md5, {name: array[index] for name, array in self.rows.items()})

    def set(self, game: Game | str, category: str, slot: int | None = None, **wanted: int) -> Self:
        """Move an object, or change its value, in all states.

            envs.restore_state(envs.clone_state().set("Pong", "Ball", x=80))

        REM's objects change when the states are restored; frames and observations change with the
        next step.

        Args:
            game: the game, or its name.
            category: name of the object's category.
            slot: the object's slot in its category; by default the first valid one of each state.
            wanted: the new numbers; see `ocjax.edit`.

        Raises:
            TypeError, ValueError: see `ocjax.edit`; or the states belong to another game.
        """
        game = as_game(game)
        if game.md5 != self.md5:
            raise ValueError(
                f"the states are of the ROM with md5 {self.md5}, but the ROM of {game.name} "
                f"has md5 {game.md5}"
            )
        return dataclasses.replace(
            self, rows={**self.rows, "ram": edit(game, self.rows["ram"], category, slot, **wanted)}
        )

    def to_bytes(self) -> bytes:
        """The states as an `.npz` file, which has checksums and, unlike a pickle, no code."""
        file = io.BytesIO()
        arrays: dict[str, Any] = {"md5": self.md5, **self.rows}
        np.savez(file, **arrays)
        return file.getvalue()

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """The inverse of `to_bytes`.

        Raises:
            ValueError: the bytes are not saved states, are damaged, or have an older format.
        """
        try:
            rows = npz.read(io.BytesIO(data), lambda _: True)
        except npz.NpzError as error:
            raise ValueError(
                f"expected undamaged bytes from States.to_bytes of this version, got {len(data):,} "
                f"bytes ({error}): save or copy the states again"
            ) from error
        md5 = str(rows.pop("md5", ""))
        numbers = all(a.dtype.kind in "biuf" and a.ndim > 0 for a in rows.values())
        if (
            not numbers
            or len({len(a) for a in rows.values()}) != 1
            or not {"state", "ram"} <= rows.keys()
        ):
            raise ValueError(
                "the states are damaged: expected arrays of numbers with one row per state, among "
                f"them state and ram, got {', '.join(rows) or 'none'}; save them again"
            )
        return cls(md5, rows)

    @classmethod
    def concatenate(cls, parts: Iterable[Self]) -> Self:
        """Join states of the same environments, for example from different times.

            envs.restore_state(States.concatenate([early[0], late[1]]))

        Raises:
            TypeError: a part is not of type `States`.
            ValueError: `parts` is empty, or the parts have different games or observations.
        """
        parts = list(parts)
        for part in parts:
            _check_type(part)
        if not parts:
            raise ValueError("expected at least one States to join, got none")
        first = parts[0]
        for part in parts[1:]:
            _check_alike(first, part)
        rows = {
            name: np.concatenate([part.rows[name] for part in parts])
            for name in first.rows
            if name != "state"
        }
        width = max(part.rows["state"].shape[1] for part in parts)
        rows["state"] = np.concatenate(
            [
                np.pad(part.rows["state"], ((0, 0), (0, width - part.rows["state"].shape[1])))
                for part in parts
            ]
        )
        return cls(first.md5, rows)


def _check_alike(first: States, other: States) -> None:
    if first.md5 != other.md5:
        raise ValueError(
            f"expected states of one game, got the MD5 hashes {first.md5} and {other.md5} of ROMs"
        )
    first_arrays, other_arrays = (
        {
            name: (array.dtype, array.shape[1:] if name != "state" else ())
            for name, array in states.rows.items()
        }
        for states in (first, other)
    )
    if first_arrays != other_arrays:
        differing = sorted(dict(first_arrays.items() ^ other_arrays.items()))
        raise ValueError(
            "expected states of environments with the same mode and obs, got different arrays "
            f"{', '.join(differing)}"
        )


def collect(md5: str, shown: EmulatorArrays, commands: CommandArrays) -> States:
    """Copy the states that the workers have written to the shared memory."""
    rows = {
        name: array.copy() for name, array in _saved(shown, commands).items() if name != "state"
    }
    rows["state"] = commands.state[:, : commands.state_bytes.max()].copy()
    return States(md5, rows)


def check(
    states: Any,
    game: Game,
    shown: EmulatorArrays,
    commands: CommandArrays,
    num_envs: int,
    good: bytes,
) -> None:
    """Check that a pool can restore states. `good` is ALE's state of one of its emulators."""
    _check_type(states)
    if states.md5 != game.md5:
        raise ValueError(
            f"the states are of the ROM with md5 {states.md5}, but the pool runs the ROM with "
            f"md5 {game.md5}"
        )
    targets = _saved(shown, commands)
    missing = sorted(set(targets) - set(states.rows))
    if missing:
        raise ValueError(
            f"the states were saved without {', '.join(missing)}, which this pool records"
        )
    if len(states) not in (1, num_envs):
        raise ValueError(f"there must be 1 or {num_envs} states, got {len(states)}")
    for name, target in targets.items():
        _check_array(name, states.rows[name], target, len(states))
    ended = states.rows["terminated"] | states.rows["truncated"]
    if ((states.rows["phase"] != Phase.RUNNING) & ~ended).any():
        raise ValueError(
            "the states are damaged: expected 'terminated' or 'truncated' where an episode has "
            "ended; save them again"
        )
    sizes = states.rows["state_bytes"].tolist()
    for row, size in zip(states.rows["state"], sizes, strict=True):
        try:
            console.check(row[: max(0, size)].tobytes(), good)
        except ValueError as error:
            raise ValueError(
                f"the states are damaged: in an emulator's state, {error}; save them again"
            ) from error


_RANGES = {
    "phase": (Phase.RUNNING, Phase.GAME_OVER),
    "held_strength": (0, 1),
    "generator": (0, np.array([*[2**64 - 1] * 4, 1, 2**32 - 1], np.uint64)),
    "executed": (0, 17),
    "frame_number": (0, np.inf),
    "episode_length": (0, np.inf),
    "episode_return": (-1e300, 1e300),
}


def _check_array(name: str, array: np.ndarray, target: np.ndarray, count: int) -> None:
    """Check the dtype, shape and range of an array of `count` states."""
    shape = (count, *target.shape[1:])
    fits = (
        array.ndim == 2 and array.shape[1] <= STATE_BYTES
        if name == "state"
        else array.shape == shape
    )
    if not fits or array.dtype != target.dtype:
        expected, got = (
            f"{a.dtype} of shape {s}" for a, s in ((target, shape), (array, array.shape))
        )
        raise ValueError(
            f"the states are damaged: expected {name!r} to be {expected}, got {got}; save them "
            "again"
        )
    _check_bools(name, array)
    least, most = _RANGES.get(name, (-np.inf, np.inf))
    if not ((array >= least) & (array <= most)).all():
        raise ValueError(
            f"the states are damaged: {name!r} has numbers out of range; save them again"
        )


def _check_bools(name: str, array: np.ndarray) -> None:
    """Check that the bytes of bools are 0 or 1; a file may contain other bytes."""
    if array.dtype == bool and (array.view(np.uint8) > 1).any():
        raise ValueError(
            f"the states are damaged: {name!r} has bools that are not 0 or 1; save them again"
        )


def check_carries(states: Any, carries: Mapping[str, Any]) -> None:
    """Check that states contain the arrays that an environment carries, `[N, ...]` by name."""
    _check_type(states)
    for name, carried in carries.items():
        array = states.rows.get(name)
        if array is None or (array.dtype, array.shape) != (
            carried.dtype,
            (len(states), *carried.shape[1:]),
        ):
            raise ValueError(
                "the states are of environments with other observations: make these environments "
                "with the same mode and obs"
            )
        _check_bools(name, array)


def _check_type(states: Any) -> None:
    if not isinstance(states, States):
        raise TypeError(
            "states must be States, from clone_state or States.from_bytes, got "
            f"{type(states).__name__}"
        )
    arrays = isinstance(states.rows, Mapping) and all(
        isinstance(array, np.ndarray) for array in states.rows.values()
    )
    if (
        not arrays
        or "state" not in states.rows
        or any(array.ndim == 0 for array in states.rows.values())
    ):
        raise ValueError(
            "the states are damaged: expected rows with arrays, one of them called 'state'; save "
            "them again"
        )


def distribute(
    states: States, shown: EmulatorArrays, commands: CommandArrays, chosen: np.ndarray
) -> None:
    """Write checked states to the chosen rows, bool `[N]`, of the shared memory."""
    for name, target in _saved(shown, commands).items():
        rows = np.broadcast_to(states.rows[name], (len(chosen), *states.rows[name].shape[1:]))[
            chosen
        ]
        if name == "state":
            target = target[:, : rows.shape[1]]
        target[chosen] = rows


def _saved(shown: EmulatorArrays, commands: CommandArrays) -> dict[str, np.ndarray]:
    arrays = {name: getattr(shown, name) for name in _SHOWN}
    arrays |= {name: getattr(commands, name) for name in _COMMAND}
    return {name: array for name, array in arrays.items() if array is not None}
