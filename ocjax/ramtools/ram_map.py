"""`ocjax ram map`: the RAM map of a finished game, read from its file."""

import inspect
import re

from ocjax.console.ram import Field
from ocjax.evaluation.tables import Cell, Table
from ocjax.extraction.game import Game


def comments(game: Game) -> dict[str, str]:
    """The comment behind each field of a game's `Ram`, by name. Fields on one line share its comment."""
    out = {}
    for line in inspect.getsource(game.ram).splitlines():
        code, mark, comment = line.partition("#")
        names = re.match(r"\s*([\w, ]+?)\s*=", code)
        if mark and names:
            out |= dict.fromkeys((n.strip() for n in names[1].split(",")), comment.strip())
    return out


def _range(field: Field) -> str:
    width = len(field.places[0]) if isinstance(field.places[0], tuple) else 1
    if found := re.fullmatch(r"bits (\d+)-(\d+)", field.meaning):
        return f"0-{(1 << (int(found[2]) - int(found[1]) + 1)) - 1}"
    if field.meaning == "BCD":
        return f"0-{100**width - 1}"
    return f"-{1 << 8 * width - 1} to {(1 << 8 * width - 1) - 1}" if field.meaning == "signed" else f"0-{256**width - 1}"


def ram_map(game: Game) -> Table:
    """A table of everything that a game's decoder reads, by address: bytes, how they are read, range, name and meaning."""
    notes = comments(game)
    rows: list[tuple[int, list[Cell]]] = []
    for name, field in game.ram.fields().items():
        for i, place in enumerate(field.places):
            where = place if isinstance(place, tuple) else (place,)
            label = f"{name}[{i}]" if len(field.places) > 1 else name
            rows.append((where[0], [", ".join(map(str, where)), field.meaning, _range(field), label, notes.get(name, "")]))
    rows.sort(key=lambda r: r[0])
    return Table(f"{game.name}: RAM", ["Byte", "Read as", "Range", "Name", "Meaning"], [r for _, r in rows])
