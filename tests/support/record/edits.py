"""Played states with one or two other bytes, on which numbers of a decoder decide.

Play does not reach every state: the last level, a full display, the frame after a rare event. An
edited state does. Only those edits are kept that change objects when a number of the decoder
changes by one and no played state does. They are kept as text, one state a line:

    12 49=130 60=2

It is a played state, by its number in all recordings of the game, with other values of some bytes.
"""

from pathlib import Path

import numpy as np

from ocjax import recordings
from ocjax.extraction.game import Game
from tests.support.record import arbitrary, deciding, excerpts

CANDIDATES = 4_096
MOST = 48  # states of a game that are kept
FOLDER = "edits"


def path(game: Game, data: Path) -> Path:
    """The file of a game's edited states in `tests/data`."""
    return data / FOLDER / f"{game.name}.txt"


def describe(game: Game, data: Path) -> str:
    """Choose edited states of a game and write them as text.

    Args:
        game: the game.
        data: the folder `tests/data`.
    """
    played = recorded(game, data)
    candidates = arbitrary.swept(game.name, played, CANDIDATES)
    decisions = deciding.decisions(game, np.concatenate([played, candidates]))
    known, new = np.split(decisions, [len(played)], axis=1)
    unknown = new[~known.any(axis=1)]
    chosen = deciding.cover(unknown, MOST, np.ones(len(unknown), np.float32))
    lines = (_line(candidates[i], i % len(played), played) for i in sorted(chosen))
    return "".join(f"{line}\n" for line in lines)


def recorded(game: Game, data: Path) -> np.ndarray:
    """The states of all recordings of a game, uint8 `[n, 128]`."""
    return np.concatenate([recordings.read(p, game.name).rams for p in excerpts.paths(data, game)])


def _line(ram: np.ndarray, number: int, played: np.ndarray) -> str:
    changed = np.flatnonzero(ram != played[number])
    return " ".join([str(number), *(f"{address}={ram[address]}" for address in changed)])


def states(text: str, played: np.ndarray) -> np.ndarray:
    """The states that a text describes.

    Args:
        text: as `describe` returns it.
        played: uint8 `[n, 128]`, the states of all recordings.

    Returns:
        uint8 `[lines, 128]`.
    """
    out = []
    for line in text.splitlines():
        number, *changes = line.split(" ")
        ram = played[int(number)].copy()
        for change in changes:
            address, value = map(int, change.split("="))
            ram[address] = value
        out.append(ram)
    return np.array(out, np.uint8).reshape(-1, played.shape[1])
