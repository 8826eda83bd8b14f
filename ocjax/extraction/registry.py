"""Games by their names."""

import copyreg
import functools
import importlib
import re
from typing import overload

from ocjax.console.rom_files import rom_names
from ocjax.extraction import names
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.game import Game, GameError

__all__ = ["UnknownGameError", "as_game", "load"]


class UnknownGameError(ValueError):
    """No game has this name; the message suggests similar names."""


@functools.cache
def _load_module(module: str) -> Game:
    game = getattr(importlib.import_module(f"ocjax.extractors.{module}"), "GAME", None)
    if not isinstance(game, Game):
        raise GameError(f"ocjax.extractors.{module}: GAME: must be a Game(...), got {game!r}")
    if game.name.lower() != module:
        raise GameError(
            f"ocjax.extractors.{module}: name: the module of {game.name} must be called "
            f"{game.name.lower()}"
        )
    return game


@functools.cache
def _without_hud(name: str) -> Game:
    return _load_module(name).without_hud()


def load(name: str, *, hud: bool = True) -> Game:
    """Load a game by name.

    Args:
        name: as in `ocjax.games()`; case, spaces, underscores and punctuation are ignored
            ("space_invaders", "Ms. Pac-Man"). The name of ALE's ROM and an environment's id
            ("ALE/Pong-v5", "ale_py:ALE/Pong-v5", "ocjax/Pong-v5", "PongNoFrameskip-v4") also work.
        hud: whether to include the display categories (score, lives, ...).

    Raises:
        UnknownGameError: a ValueError; no game has this name.
        TypeError: `name` is not a string.
    """
    if not isinstance(name, str):
        raise TypeError(f"a game's name must be a string such as 'Pong', got {name!r}")
    short = re.sub(r"^((ale_py|ocjax):)?((ALE|ocjax)/)?", "", name)
    short = re.sub(r"(-ram)?(Deterministic|NoFrameskip)?(-ram)?-v\d+$", "", short)
    letters = re.sub(r"[\W_]", "", short).lower()
    key = names.TITLES.get(letters, letters)
    if key not in names.modules():
        raise UnknownGameError(f"no game {name!r}{_hint(key)}")
    return _load_module(key) if hud else _without_hud(key)


def _hint(key: str) -> str:
    if key in {rom.replace("_", "") for rom in rom_names()}:
        return (
            ": ALE has this game, but ocjax does not support it; `ocjax.games()` lists the games "
            "that it supports"
        )
    known = names.games()
    return names.did_you_mean(key, known) or f": there are {', '.join(known)}"


@overload
def as_game(game: Game | str) -> Game: ...
@overload
def as_game(game: Declaration | str) -> Declaration: ...
def as_game(game: Declaration | str) -> Declaration:
    """Return the game itself, or load the game with this name; see `load`."""
    return game if isinstance(game, Declaration) else load(game)


# A game pickles as its name.
copyreg.pickle(Game, lambda game: (functools.partial(load, hud=game.hud), (game.name,)))
