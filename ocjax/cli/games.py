"""The command `ocjax games`."""

from rich.table import Table

from ocjax.cli.messages import console, errors_in_one_line
from ocjax.evaluation import tables
from ocjax.extraction import names, registry


def games() -> None:
    """List the supported games and their objects."""
    with errors_in_one_line():
        specs = [registry.load(name) for name in names.games()]
    table = Table(title=f"{len(specs)} games", title_justify="left")
    for heading in ("Game", "Slots", "Categories (slots)", "HUD categories", "With value", "With orientation"):
        table.add_column(heading, justify="right" if heading == "Slots" else "left", no_wrap=heading == "Game")
    for game in specs:
        cells = [[f"{c.name} {c.count}" if c.count > 1 else c.name for c in game.categories if c.hud is hud] for hud in (False, True)]
        cells += [[c.name for c in game.categories if attribute in c.attributes] for attribute in ("value", "orientation")]
        table.add_row(game.name, str(game.num_slots), *(", ".join(cell) for cell in cells))
    tables.print_whole(table, console)
    console.print("Every game supports REM (from RAM) and VEM (from pixels).")
