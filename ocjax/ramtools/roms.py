"""The ROMs of ale-py, also of games without a decoder, and their random play."""

import re
from collections.abc import Iterator
from typing import NamedTuple

import ale_py
import numpy as np

from ocjax.console.rom_files import game_name, rom_names, rom_path
from ocjax.emulators.start import begin_game, load_path
from ocjax.extraction import registry
from ocjax.extraction.game import Game
from ocjax.extraction.names import did_you_mean
from ocjax.extraction.registry import UnknownGameError

HOLD = 8  # frames that play repeats an action


class Named(NamedTuple):
    """A game of ale-py."""

    name: str  # as in Gymnasium's "ALE/<Name>-v5"
    rom: str  # ale-py's name of the ROM
    path: str
    game: Game | None  # its declaration, if it has a decoder


def find(name: str) -> Named:
    """Find a game by a name as in `ocjax.load`, or by the name of its ROM if it has no decoder."""
    roms = {rom.replace("_", ""): rom for rom in rom_names()}
    letters = re.sub(r"^ALE/|-v\d+$|[\W_]", "", name).lower()
    try:
        game = registry.load(name)
    except UnknownGameError:
        if letters not in roms:
            hint = did_you_mean(letters, roms.values())
            raise UnknownGameError(f"ale-py has no game {name!r}{hint}") from None
        rom = roms[letters]
        return Named(game_name(rom), rom, str(rom_path(rom)), None)
    return Named(game.name, game.rom, str(rom_path(game.rom)), game)


def moments(
    found: Named, count: int, apart: int, seed: int, game_mode: int | None = None
) -> Iterator[ale_py.ALEInterface]:
    """Yield the emulator every `apart` frames of random play. Finished games restart."""
    ale = load_path(found.path, random_seed=seed, repeat_action_probability=0.0)
    begin_game(ale, found.name, game_mode)
    rng = np.random.default_rng(seed)
    actions = ale.getMinimalActionSet()
    action = actions[0]
    for i in range(count * apart):
        if i % HOLD == 0:
            action = actions[rng.integers(len(actions))]
        if ale.game_over():
            ale.reset_game()
        ale.act(action)
        if i % apart == apart - 1:
            yield ale
