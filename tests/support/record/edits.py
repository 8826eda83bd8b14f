"""Edited states: played states with one or two changed bytes.

Play does not reach every state, such as the last level, a full display, or the frame after a rare
event. The edited states are boundary states (`deciding`) of the integers that have no boundary
state among the played ones. They are kept as text, one state a line:

    12 49=130 60=2

The line gives the number of a played state, counted over all recordings of the game, and the new
values of some of its bytes. The search changes one or two bytes. Lines with more changes can be
added by hand: a new search keeps the states of the file that are still needed.
"""

from pathlib import Path

import numpy as np

from ocjax import recordings
from ocjax.extraction.game import Game
from tests.support.record import arbitrary, deciding, excerpts

CANDIDATES = 4_096  # fewer for decoders with many numbers, which take longer
WORK = 4_194_304  # pairs of a changed number and a candidate
MOST = 200  # states of a game
FOLDER = "edits"


def path(game: Game, data: Path) -> Path:
    """The file of a game's edited states in `tests/data`."""
    return data / FOLDER / f"{game.name}.txt"


def describe(game: Game, data: Path) -> str:
    """Choose edited states of a game and write them as text.

    States of its file come first, as far as they decide.

    Args:
        game: the game.
        data: the folder `tests/data`.
    """
    played, own = recorded(game, data), path(game, data)
    text = own.read_text(encoding="utf-8") if own.exists() else ""
    known = np.logical_or.reduce(deciding.decisions(game, played), axis=1)
    swept = arbitrary.swept(game.name, played, min(CANDIDATES, WORK // len(known)))
    new = [_line(ram, i % len(played), played) for i, ram in enumerate(swept)]
    lines: list[str] = []
    for candidates in filter(None, (text.splitlines(), new)):
        decisions = deciding.decisions(game, states("\n".join(candidates), played), known)
        chosen = deciding.cover(decisions, MOST - len(lines), np.ones(len(known), np.float32))
        lines += [candidates[i] for i in sorted(chosen)]
        known |= decisions[:, chosen].any(axis=1)
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
