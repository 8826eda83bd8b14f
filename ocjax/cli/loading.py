"""Games that commands play."""

from ocjax.cli.messages import errors_in_one_line
from ocjax.emulators.start import check_rom
from ocjax.extraction import registry
from ocjax.extraction.game import Game


def load_playable(name: str) -> Game:
    """Load a game whose ROM is installed; reports errors in one line."""
    with errors_in_one_line():
        game = registry.load(name)
        check_rom(game)
        return game
