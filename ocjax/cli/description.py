"""Everything known about a game, from its file and from the package's measurements."""

import dataclasses
import importlib.resources
import inspect
import json
import re
from collections.abc import Mapping
from typing import Any

from ocjax.console.ram import Field
from ocjax.emulators import variations
from ocjax.extraction.categories import Category
from ocjax.extraction.game import Game
from ocjax.play import policies
from ocjax.ramtools.ram_map import comments

PARAGRAPH = re.compile(r"\n\s*\n")
PICTURE = "Picture: "  # before the path of a picture in the repository


def describe(game: Game) -> dict[str, Any]:
    """Describe a game in JSON values."""
    notes_of = comments(game)
    title, *notes = PARAGRAPH.split(inspect.getdoc(inspect.getmodule(game.decode)) or game.name)
    return {
        "name": game.name,
        "title": " ".join(title.split()),
        "rom": game.rom,
        "md5": game.md5,
        "screen": list(game.screen),
        "slots": game.num_slots,
        "categories": [_category(game, c) for c in game.categories],
        "terrain": [dataclasses.asdict(kind) for kind in game.terrain or ()],
        "ram": [_field(field, notes_of.get(name, "")) for name, field in game.ram.fields().items()],
        "accuracy": accuracy().get(game.name, {}),
        "variants": variants(game),
        "meanings": {
            "modes": _by_text(game.variants.modes),
            "difficulties": _by_text(game.variants.difficulties),
            "source": game.variants.source,
        },
        "starts": dict(game.variants.starts),
        "variations": {name: variation.doc for name, variation in variations.of(game.name).items()},
        "agent": (policies.SHIPPED / f"{game.name}.npz").exists(),
        "notes": [" ".join(note.split()) for note in notes if not note.startswith(PICTURE)],
    }


def accuracy() -> dict[str, dict[str, float | None]]:
    """Percentages of each game as measured by `benchmarks/table.py`; None means not measured.

    `f1`, `iou` and `exact` compare REM with VEM on random play, `drawn_f1` with the objects that
    the video chip drew, `score` and `lives` with the emulator's values.
    """
    return json.loads(
        importlib.resources.files("ocjax.cli").joinpath("accuracy.json").read_text("utf-8")
    )


def variants(game: Game) -> dict[str, list[int]]:
    """The modes and difficulties of a game in ale-py's numbering.

    The lists are empty if the game's ROM is not installed.
    """
    from ocjax.console.rom_files import RomError
    from ocjax.emulators import start

    try:
        modes, difficulties = start.variants(game)
    except RomError:
        return {"modes": [], "difficulties": []}
    return {"modes": modes, "difficulties": difficulties}


def _by_text(meanings: Mapping[int, str]) -> dict[str, str]:
    """Numbers as JSON's keys, which are texts."""
    return {str(number): meaning for number, meaning in meanings.items()}


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


def _field(field: Field, comment: str) -> dict[str, Any]:
    return {
        "name": field.name,
        "bytes": ["-".join(map(str, place)) for place in field.places],
        "read": field.meaning,
        "comment": comment,
    }
