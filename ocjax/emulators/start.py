"""The emulator of the `ocjax ram` commands that step single frames."""

from typing import TYPE_CHECKING

from ocjax.emulators.pool import check_rom
from ocjax.extraction.game import Game

if TYPE_CHECKING:
    import ale_py


def start_emulator(game: Game, seed: int = 0, game_mode: int | None = None) -> "ale_py.ALEInterface":
    """An emulator at the beginning of a game, without sticky actions.

    Args:
        game: the game.
        seed: of the emulator.
        game_mode: as ale-py numbers it; None for the game's default.

    Raises:
        RomError: the ROM is missing or the wrong one.
        ValueError: the game has no such mode.
    """
    import ale_py

    ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)
    ale = ale_py.ALEInterface()
    ale.setInt("random_seed", seed)
    ale.setFloat("repeat_action_probability", 0.0)
    ale.loadROM(check_rom(game))
    if game_mode is not None:
        if game_mode not in ale.getAvailableModes():
            raise ValueError(f"{game.name} has no mode {game_mode}; it has {list(ale.getAvailableModes())}")
        ale.setMode(game_mode)
    ale.reset_game()
    return ale
