"""Emulators in this process: check and load a ROM; read its actions, modes and difficulties."""

from pathlib import Path

import ale_py

from ocjax.console.rom_files import read_rom, rom_path
from ocjax.emulators.settings import Settings
from ocjax.extraction import registry
from ocjax.extraction.game import Game


def check_rom(game: Game) -> Path:
    """Check a game's ROM and return its path."""
    read_rom(game.rom, game.md5)
    return rom_path(game.rom)


def load_playable(name: str) -> Game:
    """Load a game whose ROM is installed."""
    game = registry.load(name)
    check_rom(game)
    return game


def log_errors_only() -> None:
    """Keep ale-py from printing a banner for each emulator."""
    ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)


def load_emulator(game: Game, **options: float) -> ale_py.ALEInterface:
    """An emulator with a game's ROM.

    Args:
        options: options of ALE, such as `random_seed` (int) and `repeat_action_probability`
            (float).
    """
    path = check_rom(game)
    log_errors_only()
    ale = ale_py.ALEInterface()
    for name, value in options.items():
        if isinstance(value, int):
            ale.setInt(name, value)
        else:
            ale.setFloat(name, value)
    ale.loadROM(path)
    return ale


def start_emulator(game: Game, seed: int = 0, game_mode: int | None = None) -> ale_py.ALEInterface:
    """An emulator at the beginning of a game, without sticky actions.

    Args:
        game_mode: ale-py's number of the mode; by default the game's own.
    """
    ale = load_emulator(game, random_seed=seed, repeat_action_probability=0.0)
    if game_mode is not None:
        if game_mode not in ale.getAvailableModes():
            raise ValueError(
                f"{game.name} has no mode {game_mode}; it has {list(ale.getAvailableModes())}"
            )
        ale.setMode(game_mode)
    ale.reset_game()
    return ale


def action_set(ale: ale_py.ALEInterface, settings: Settings) -> tuple[ale_py.Action, ...]:
    """The actions that the settings make available."""
    return tuple(
        ale.getLegalActionSet() if settings.full_action_space else ale.getMinimalActionSet()
    )


def variants(game: Game) -> tuple[list[int], list[int]]:
    """ale-py's numbers of a game's modes and difficulties."""
    ale = load_emulator(game)
    return list(ale.getAvailableModes()), list(ale.getAvailableDifficulties())
