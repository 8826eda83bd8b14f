"""`.npz` files of objects; see `Objects.save`."""

import importlib
import reprlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ocjax._files import atomic, npz
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.records import FIELDS, Fields

_FACTS = ("game", "md5", "hud", "category")


def save(path: Path, fields: Fields, game: Declaration) -> None:
    """Write an .npz file, completely or not at all."""
    facts = {"game": game.name, "md5": game.md5, "hud": game.hud}
    if len(game.categories) == 1:
        facts["category"] = game.categories[0].name
    atomic.write(path, lambda file: np.savez_compressed(file, **fields._asdict(), **facts))


def load(path: Path) -> tuple[Fields, Declaration]:
    """Read a file that `save` wrote."""
    try:
        _check_facts(npz.headers(path, _FACTS.__contains__))
        game = _game(npz.read(path, _FACTS.__contains__))
        _check_fields(npz.headers(path, FIELDS.__contains__), game)
        return Fields(**npz.read(path, FIELDS.__contains__)), game
    except ValueError as error:
        raise ValueError(f"{path} is not a readable file of objects: {error}") from error


def _check_facts(found: Mapping[str, npz.Header]) -> None:
    missing = {"game", "md5", "hud"} - found.keys()
    if missing:
        raise ValueError(f"it has no {', '.join(sorted(missing))}")
    for name, header in found.items():
        if header.shape != ():
            raise ValueError(
                f"{name} must be a single value, got {header.dtype} {list(header.shape)}"
            )


def _game(facts: Mapping[str, np.ndarray]) -> Declaration:
    # The registry imports this module.
    registry = importlib.import_module("ocjax.extraction.registry")
    game = registry.load(str(facts["game"]), hud=bool(facts["hud"]))
    if str(facts["md5"]) != game.md5:
        raise ValueError(
            f"its ROM has md5 {reprlib.repr(str(facts['md5']))}, but the decoder of {game.name} is "
            f"for {game.md5}"
        )
    if "category" not in facts:
        return game
    category = str(facts["category"])
    if category not in game.slices:
        raise ValueError(f"{game.name} has no category {reprlib.repr(category)}")
    return game.part(category)


def _check_fields(found: Mapping[str, npz.Header], game: Declaration) -> None:
    batch = found["valid"].shape[:-1] if "valid" in found else ()
    for name, (dtype, tail) in FIELDS.items():
        expected = [*batch, game.num_slots, *tail]
        own = found.get(name)
        if own is None:
            raise ValueError(f"it has no array {name} ({np.dtype(dtype)} {expected})")
        if own.dtype != dtype or list(own.shape) != expected:
            raise ValueError(
                f"{name} must be {np.dtype(dtype)} {expected}, got {own.dtype} {list(own.shape)}"
            )
