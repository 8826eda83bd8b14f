"""Display of objects and games in an interpreter and in a notebook."""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any

from ocjax.console.compass import POINTS
from ocjax.extraction import records
from ocjax.extraction.categories import HEADER
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.html import table

MOST_LISTED = 2  # objects of a category in a crowded state, if each one has a line
MOST_LINES = 19  # lines of a state in an interpreter
MOST_ROWS = 30  # rows of a state's table in a notebook
SCALE = 2  # of the drawing in a notebook; the console's pixels are twice as wide as high
BACKGROUND = "#222"
BESIDE = "display: flex; gap: 1em; flex-wrap: wrap; align-items: flex-start; overflow-x: auto"


def summary(game: Declaration | None, batch: Sequence[int], slots: int) -> str:
    """Describe the game, slots and batch shape of objects."""
    of = "no game" if game is None else game.name
    if game is not None and len(game.categories) == 1:
        of += f", category {game.categories[0].name}"
    plural = "" if slots == 1 else "s"
    return f"Objects of {of}, {slots} slot{plural}, batch shape {list(batch)}"


def text(game: Declaration, fields: records.Fields) -> str:
    """List the objects of one state in at most `MOST_LINES` indented lines."""
    state = records.of_state(fields, game)
    lines = records.text(state).splitlines() or ["no objects"]
    if len(lines) > MOST_LINES:
        lines = _counted(game, records.by_category(state))
    if len(lines) > MOST_LINES:
        lines = [*lines[: MOST_LINES - 1], f"and {len(lines) - MOST_LINES + 1} more lines"]
    return "\n".join(f"  {line}" for line in lines)


def _counted(game: Declaration, groups: Mapping[str, Sequence[Mapping[str, Any]]]) -> list[str]:
    lines = []
    for name, group in groups.items():
        if len(group) > MOST_LISTED:
            slots = game.slices[name]
            lines.append(f"{name}: {len(group)} of {slots.stop - slots.start}")
        else:
            lines += records.text([{"category": name, **record} for record in group]).splitlines()
    return lines


def picture(game: Declaration, state: Iterable[Mapping[str, Any]]) -> str:
    """Draw the boxes of one state's records on an empty screen, as SVG."""
    height, width = game.screen
    boxes = (
        f'<rect x="{2 * r["x"]}" y="{r["y"]}" width="{2 * r["w"]}" height="{r["h"]}" '
        f'fill="rgb{tuple(r["rgb"])}" stroke="#888" '
        f'stroke-width="0.5"><title>{escape(records.text([dict(r)]))}</title></rect>'
        for r in state
    )
    size = (
        f'width="{2 * SCALE * width}" height="{SCALE * height}" viewBox="0 0 {2 * width} {height}"'
    )
    return (
        f'<svg style="flex: none; background: {BACKGROUND}" xmlns="http://www.w3.org/2000/svg" '
        f"{size}>{''.join(boxes)}</svg>"
    )


def state_html(game: Declaration, fields: records.Fields) -> str:
    """Show the objects of one state as a picture with a table beside it."""
    state = records.of_state(fields, game)
    rows = [
        (
            r["category"],
            r["slot"],
            f"({r['x']}, {r['y']})",
            f"{r['w']} x {r['h']}",
            r.get("value", ""),
            POINTS[r["orientation"]] if "orientation" in r else "",
        )
        for r in state
    ]
    objects = table(("category", "slot", "left, top", "size", "value", "facing"), rows[:MOST_ROWS])
    if len(rows) > MOST_ROWS:
        objects = f"<div>{objects}<p>and {len(rows) - MOST_ROWS} more</p></div>"
    return f'<div style="{BESIDE}">{picture(game, state)}{objects}</div>'


def game_html(game: Declaration) -> str:
    """Show a game's categories as a table."""
    rows = [c.row() for c in game.categories]
    return f"<p>{escape(game.name)}: {game.num_slots} slots</p>{table(HEADER, rows)}"
