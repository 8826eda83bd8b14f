"""What is known of a game, from its file and from the measurements that ship with the package."""

import importlib.resources
import inspect
import json
import re
from typing import Any

from ocjax.console.ram import Field, Place
from ocjax.extraction.categories import Category
from ocjax.extraction.game import Game

COMMENT = re.compile(r"^    (\w+) = .*?#\s*(.*)$", re.MULTILINE)  # of a field in a class of RAM fields
PARAGRAPH = re.compile(r"\n\s*\n")


def describe(game: Game) -> dict[str, Any]:
    """A game as JSON values: its ROM, categories, address map, accuracy, modes and notes.

    Args:
        game: the game; its ROM need not be installed.
    """
    title, *notes = PARAGRAPH.split(inspect.getdoc(inspect.getmodule(game.decode)) or game.name)
    return {
        "name": game.name,
        "title": " ".join(title.split()),
        "rom": game.rom,
        "md5": game.md5,
        "screen": list(game.screen),
        "slots": game.num_slots,
        "categories": [_category(game, c) for c in game.categories],
        "ram": [_field(field, comment) for field, comment in _fields(game)],
        "accuracy": accuracy().get(game.name, {}),
        "variants": variants(game),
        "notes": [" ".join(note.split()) for note in notes],
    }


def accuracy() -> dict[str, dict[str, float | None]]:
    """Percentages of each game as measured by `benchmarks/table.py`.

    `f1`, `iou` and `exact` compare REM with VEM on random play, `drawn_f1` on recordings of what the video chip drew. `score` and `lives`
    are the shares of samples in which REM's equal the emulator's. None: there is no such figure.
    """
    return json.loads(importlib.resources.files("ocjax.cli").joinpath("accuracy.json").read_text("utf-8"))


def variants(game: Game) -> dict[str, list[int]]:
    """The modes and difficulties of a game as ale-py numbers them; empty lists where its ROM is not installed."""
    from ocjax.console.rom import RomError
    from ocjax.emulators import start

    try:
        modes, difficulties = start.variants(game)
    except RomError:
        return {"modes": [], "difficulties": []}
    return {"modes": modes, "difficulties": difficulties}


def _category(game: Game, c: Category) -> dict[str, Any]:
    slots = game.slices[c.name]
    return {
        "name": c.name,
        "doc": c.doc,
        "slots": [slots.start, slots.stop],
        "hud": c.hud,
        "value": "value" in c.attributes,
        "orientation": "orientation" in c.attributes,
        "vem_reads_value": c.reads_value,
        "blinks": c.blinks,
        "rgb": game.slot_rgb[slots.start].tolist(),
        "aliases": list(c.aliases),
    }


def _fields(game: Game) -> list[tuple[Field, str]]:
    """The fields of the address map, each with the comment on its line."""
    classes = [base for base in game.ram.__mro__ if base.__module__.startswith("ocjax.extractors")]
    comments = dict(pair for base in classes for pair in COMMENT.findall(inspect.getsource(base)))
    return [(field, comments.get(name, "")) for name, field in game.ram.fields().items()]


def _field(field: Field, comment: str) -> dict[str, Any]:
    return {"name": field.name, "bytes": [_address(place) for place in field.places], "read": field.meaning, "comment": comment}


def _address(place: Place) -> str:
    """One byte's address, or those of a number of several bytes."""
    return str(place) if isinstance(place, int) else "-".join(map(str, place))
