"""The registry of games. Every file in `ocjax/extractors` is a game; there is no other list."""

import copyreg
import difflib
import functools
import importlib
import pkgutil
import re
from pathlib import Path
from typing import overload

from ocjax.extraction.declaration import Declaration
from ocjax.extraction.game import Game, GameError


class UnknownGameError(ValueError):
    """There is no game of that name; the message suggests similar names."""


@functools.cache
def _load_module(module: str) -> Game:
    game = getattr(importlib.import_module(f"ocjax.extractors.{module}"), "GAME", None)
    if not isinstance(game, Game):
        raise GameError(f"extractors/{module}.py: GAME: must be a Game(...), got {game!r}")
    if game.name.lower() != module:
        raise GameError(f"extractors/{module}.py: name: the file of {game.name} must be called {game.name.lower()}.py")
    return game


@functools.cache
def _modules() -> tuple[str, ...]:
    extractors = importlib.import_module("ocjax.extractors")
    return tuple(sorted(m.name for m in pkgutil.iter_modules(extractors.__path__) if not m.name.startswith("_")))


@functools.cache
def games() -> tuple[str, ...]:
    """The sorted names of all games, as in Gymnasium's "ALE/<Name>-v5"."""
    return tuple(_load_module(m).name for m in _modules())


@functools.cache
def names() -> tuple[str, ...]:
    """The names that `games` returns, read from the files without importing them."""
    extractors = importlib.import_module("ocjax.extractors")
    files = sorted(p for folder in extractors.__path__ for p in Path(folder).glob("[!_]*.py"))
    return tuple(m[1] for p in files if (m := re.search(r'^    name="(\w+)",$', p.read_text(encoding="utf-8"), re.MULTILINE)))


def env_id(name: str) -> str:
    """The Gymnasium id of a game's environments."""
    return f"ocjax/{name}-v5"


@functools.cache
def _without_hud(name: str) -> Game:
    return _load_module(name).without_hud()


def load(name: str, *, hud: bool = True) -> Game:
    """Load a game by name, such as "Pong", "pong", "ALE/Pong-v5", "PongNoFrameskip-v4", "space_invaders" or "ocjax/Pong-v5".

    Args:
        name: the name in any of these spellings.
        hud: whether the display categories (score, lives, ...) are included; without them, the other slots stay the same.

    Raises:
        UnknownGameError: a ValueError; there is no such game.
        TypeError: `name` is not a string.
    """
    if not isinstance(name, str):
        raise TypeError(f"a game's name must be a string such as 'Pong', got {name!r}")
    short = re.sub(r"^(ALE|ocjax)/", "", name)
    short = re.sub(r"(-ram)?(Deterministic|NoFrameskip)?(-ram)?-v\d+$", "", short)
    key = short.replace("_", "").replace(" ", "").lower()
    if key not in _modules():
        known = {n.lower(): n for n in names()}  # loading all games would take long
        close = difflib.get_close_matches(key, known, n=3, cutoff=0.5)
        hint = f"did you mean {' or '.join(known[m] for m in close)}?" if close else f"there are {', '.join(known.values())}"
        raise UnknownGameError(f"no game {name!r}: {hint}")
    return _load_module(key) if hud else _without_hud(key)


@overload
def as_game(game: Game | str) -> Game: ...
@overload
def as_game(game: Declaration | str) -> Declaration: ...
def as_game(game: Declaration | str) -> Declaration:
    """The game itself, or the one of that name; see `load`."""
    return game if isinstance(game, Declaration) else load(game)


copyreg.pickle(Game, lambda game: (functools.partial(load, hud=game.hud), (game.name,)))  # a game pickles as its name
