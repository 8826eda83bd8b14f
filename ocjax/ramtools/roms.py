"""The ROMs of ale-py, also those of games without a decoder."""

import difflib
import re
from typing import NamedTuple

from ocjax.console.rom_files import game_name, rom_names, rom_path
from ocjax.extraction import registry
from ocjax.extraction.game import Game
from ocjax.extraction.registry import UnknownGameError


class Named(NamedTuple):
    """A game of ale-py.

    Args:
        name: as in Gymnasium's "ALE/<Name>-v5".
        rom: ale-py's name of the ROM.
        game: its declaration, if it has a decoder.
    """

    name: str
    rom: str
    path: str
    game: Game | None


def find(name: str) -> Named:
    """Find a game by its name, with or without a decoder.

    Args:
        name: as in `ocjax.load`; games without a decoder also have the names of their ROMs.
    """
    roms = {rom.replace("_", ""): rom for rom in rom_names()}
    letters = re.sub(r"^ALE/|-v\d+$|[\W_]", "", name).lower()
    try:
        game = registry.load(name)
    except UnknownGameError:
        if letters not in roms:
            close = difflib.get_close_matches(letters, roms, n=3, cutoff=0.5)
            hint = f": did you mean {' or '.join(roms[c] for c in close)}?" if close else ""
            raise UnknownGameError(f"ale-py has no game {name!r}{hint}") from None
        rom = roms[letters]
        return Named(game_name(rom), rom, str(rom_path(rom)), None)
    return Named(game.name, game.rom, str(rom_path(game.rom)), game)
