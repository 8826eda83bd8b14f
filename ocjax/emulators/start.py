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


def load_path(path: str | Path, **options: float) -> ale_py.ALEInterface:
    """An emulator with a ROM.

    Args:
        options: of ALE, such as `random_seed` (int) and `repeat_action_probability` (float).
    """
    log_errors_only()
    ale = ale_py.ALEInterface()
    for name, value in options.items():
        if isinstance(value, int):
            ale.setInt(name, value)
        else:
            ale.setFloat(name, value)
    ale.loadROM(path)
    return ale


def load_emulator(game: Game, **options: float) -> ale_py.ALEInterface:
    """An emulator with a game's checked ROM; see `load_path`."""
    return load_path(check_rom(game), **options)


def begin_game(ale: ale_py.ALEInterface, name: str, mode: int | None) -> None:
    """Begin a game in a mode of ale-py's numbering; None for the game's own."""
    if mode is not None:
        if mode not in ale.getAvailableModes():
            raise ValueError(f"{name} has no mode {mode}; it has {list(ale.getAvailableModes())}")
        ale.setMode(mode)
    ale.reset_game()


def start_emulator(game: Game, seed: int = 0, game_mode: int | None = None) -> ale_py.ALEInterface:
    """An emulator at the beginning of a game, without sticky actions; see `begin_game`."""
    ale = load_emulator(game, random_seed=seed, repeat_action_probability=0.0)
    begin_game(ale, game.name, game_mode)
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
