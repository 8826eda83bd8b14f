"""Saved emulators: rows of arrays with all values that determine an emulator's future."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from .interface import STATE_BYTES, CommandArrays

_WORD = 64  # bits; the two large numbers of PCG64's state take two words each


class EmulatorState(NamedTuple):
    """All values that determine the future of an emulator, besides the executed action."""

    phase: int
    strength: float  # of the action of the last emulated frame
    generator: Mapping[str, Any]  # state of NumPy's PCG64
    before: np.ndarray | None  # the RAM before the last frame, after the hooks' edits
    ale: bytes  # ALE's state


def write(state: EmulatorState, arrays: CommandArrays, i: int) -> None:
    """Write a state to row i of the arrays."""
    size = len(state.ale)
    if size > STATE_BYTES:
        raise RuntimeError(
            f"the emulator's state takes {size} bytes, which exceeds the {STATE_BYTES} reserved "
            "for it"
        )
    arrays.state[i, :size] = np.frombuffer(state.ale, np.uint8)
    arrays.state_bytes[i] = size
    arrays.phase[i] = state.phase
    arrays.held_strength[i] = state.strength
    arrays.generator[i] = _words(state.generator)
    arrays.has_before[i] = state.before is not None
    arrays.before[i] = 0 if state.before is None else state.before


def read(arrays: CommandArrays, i: int) -> EmulatorState:
    """The inverse of `write`, for rows that have passed the pool's checks."""
    return EmulatorState(
        int(arrays.phase[i]),
        float(arrays.held_strength[i]),
        _generator(arrays.generator[i].tolist()),
        arrays.before[i].copy() if arrays.has_before[i] else None,
        arrays.state[i, : arrays.state_bytes[i]].tobytes(),
    )


def _words(generator: Mapping[str, Any]) -> list[int]:
    """The state of a PCG64 generator as six unsigned numbers of 64 bits."""
    numbers = generator["state"]["state"], generator["state"]["inc"]
    words = [number >> shift & 2**_WORD - 1 for number in numbers for shift in (0, _WORD)]
    return [*words, generator["has_uint32"], generator["uinteger"]]


def _generator(words: list[int]) -> dict[str, Any]:
    """The inverse of `_words`."""
    return {
        "bit_generator": "PCG64",
        "state": {"state": words[0] | words[1] << _WORD, "inc": words[2] | words[3] << _WORD},
        "has_uint32": words[4],
        "uinteger": words[5],
    }
