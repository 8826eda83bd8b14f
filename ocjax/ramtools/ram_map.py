"""`ocjax ram map`: the RAM map of a finished game, read from its file."""

import inspect
import re
from typing import Any, NamedTuple

from ocjax.console.ram import Field, RamMap
from ocjax.evaluation.tables import Cell, Table
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.game import Game
from ocjax.ramtools.causes import Causes

# the comment of a field in a class of RAM fields
_COMMENT = re.compile(r"^    (\w+) = .*?#\s*(.*)$", re.MULTILINE)


def comments(game: Declaration) -> dict[str, str]:
    """The comments behind the fields of a game's address map and of its base classes, by name."""
    classes = [base for base in game.ram.__mro__ if issubclass(base, RamMap) and base is not RamMap]
    return dict(
        pair for base in reversed(classes) for pair in _COMMENT.findall(inspect.getsource(base))
    )


def _range(field: Field) -> str:
    width = len(field.places[0])
    if found := re.fullmatch(r"bits (\d+)-(\d+)", field.meaning):
        return f"0-{(1 << (int(found[2]) - int(found[1]) + 1)) - 1}"
    if field.meaning == "BCD":
        return f"0-{100**width - 1}"
    return (
        f"-{1 << 8 * width - 1} to {(1 << 8 * width - 1) - 1}"
        if field.meaning == "signed"
        else f"0-{256**width - 1}"
    )


class Row(NamedTuple):
    """A number that a game's decoder reads from the RAM."""

    bytes: tuple[int, ...]  # addresses 0 to 127
    read_as: str
    range: str
    name: str  # name of the field in the game's file
    meaning: str


def read(game: Game) -> list[Row]:
    """All numbers that a game's decoder reads, by address."""
    notes, rows = comments(game), []
    for name, field in game.ram.fields().items():
        for label, place in field.labelled():
            rows.append(Row(place, field.meaning, _range(field), label, notes.get(name, "")))
    return sorted(rows, key=lambda row: row.bytes[0])


def ram_map(game: Game) -> Table:
    """A table of all numbers that a game's decoder reads."""
    rows: list[list[Cell]] = [[", ".join(map(str, row.bytes)), *row[1:]] for row in read(game)]
    return Table(f"{game.name}: RAM", ["Byte", "Read as", "Range", "Name", "Meaning"], rows)


def to_json(game: Game, found: Causes | None = None) -> list[dict[str, Any]]:
    """The RAM map as records, one for each number that the decoder reads.

    Args:
        found: the causal map of one of its states. With it, each record lists as `confirmed` the
            categories that changed on the screen after a write to one of the bytes.
    """
    records = [row._asdict() for row in read(game)]
    if found is not None:
        for record in records:
            effects = [
                effect.category for address in record["bytes"] for effect in found.effects[address]
            ]
            record["confirmed"] = list(dict.fromkeys(effects))
    return records
