"""Objects on the screen of Atari 2600 games, for thousands of states at once.

    import ocjax

    game = ocjax.load("Pong")
    objects = game.rem(ram)        # uint8 [..., 128] -> Objects, from the console's RAM
    objects = game.vem(frames)     # uint8 [..., 210, 160] palette indices or [..., 210, 160, 3] RGB -> Objects, from the pixels
"""

from ocjax.objects import Objects, velocity
from ocjax.registry import UnknownGameError, games, load
from ocjax.spec import Box, Category, Game, GameError

__version__ = "0.1.0"

__all__ = [
    "Box",
    "Category",
    "Game",
    "GameError",
    "Objects",
    "UnknownGameError",
    "games",
    "load",
    "velocity",
]
