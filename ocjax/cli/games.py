"""The command `ocjax games`."""

import json
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.padding import Padding
from rich.table import Table

from ocjax.cli.messages import console
from ocjax.extraction import names

STEPS = 150  # agent steps before a picture
COLUMNS = 4  # of names
FIGURES = {  # the numbers of `accuracy.json` and their meanings
    "f1": "F1 of REM against VEM",
    "iou": "intersection over union",
    "exact": "identical boxes",
    "drawn_f1": "F1 on recordings of the objects that the video chip drew",
    "score": "scores equal to the rewards",
    "lives": "lives equal to the emulator's",
}


def games(
    game: Annotated[
        str | None, typer.Argument(help="Name of a game; without one, all games are listed.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Draw the game's objects to this .png file.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
    suite: Annotated[
        str | None,
        typer.Option(
            metavar="SUITE",
            help="List the games of a suite: atari100k, atari5, atari10, atari57 or ocatari.",
        ),
    ] = None,
) -> None:
    """List the supported games, or show everything that is known about one."""
    if game is None:
        if picture is not None:
            raise ValueError("--picture needs the name of a game")
        _print_list(suite, as_json)
        return
    if suite is not None:
        raise ValueError("--suite lists games: give a suite or a game, not both")
    from ocjax.cli import description
    from ocjax.extraction import registry

    known = registry.load(game)
    about = description.describe(known)
    if as_json:
        typer.echo(json.dumps(about, indent=2))
    else:
        _print_page(about)
    if picture is not None:
        _draw(known, picture)


def _print_list(suite: str | None, as_json: bool) -> None:
    """Print the names of the games, or of a suite's, without importing their files."""
    supported = names.games(suite)
    if as_json:
        typer.echo(json.dumps(list(supported)))
        return
    missing: list[str] = []
    if suite is None:
        console.print(
            f"{len(supported)} games, each with both methods, REM (from RAM) and VEM (from "
            "pixels):\n"
        )
    else:
        source, every = names.suite_of(suite).source, names.suite_of(suite).games
        console.print(
            f"{suite}: {len(supported)} of {len(every)} games are supported. Source: {source}.\n",
            highlight=False,
        )
        missing = [name for name in every if name not in supported]
    _print_names(supported)
    if missing:
        console.print("\nMissing:\n")
        _print_names(missing)
    console.print("\n`ocjax games GAME` shows a game's objects, RAM and accuracy.", markup=False)


def _print_names(listed: Sequence[str]) -> None:
    grid = Table.grid(padding=(0, 2))
    rows = -(-len(listed) // COLUMNS)
    for i in range(rows):
        grid.add_row(*listed[i::rows])
    console.print(Padding(grid, (0, 2)))


def _print_page(about: dict[str, Any]) -> None:
    from ocjax.evaluation import tables

    screen, variants = about["screen"], about["variants"]
    figures = [
        f"{text} {about['accuracy'][key]:.2f} %"
        for key, text in FIGURES.items()
        if about["accuracy"].get(key) is not None
    ]
    paragraphs = (
        f"ROM {about['rom']}, MD5 {about['md5']}; screen {screen[1]} x {screen[0]}; "
        f"{about['slots']} slots; "
        f"modes {_listed(variants['modes'])}; difficulties {_listed(variants['difficulties'])}",
        *about["notes"],
        *(["Accuracy: " + ", ".join(figures)] if figures else []),
    )
    console.print(about["title"], style="bold", markup=False)
    for text in paragraphs:
        console.print(f"\n{text}", markup=False, highlight=False, soft_wrap=not console.is_terminal)
    if about["agent"]:
        console.print(
            f"\nAn agent ships with ocjax: `ocjax play {about['name']}`",
            markup=False,
            highlight=False,
        )
    fields = [[f["name"], ", ".join(f["bytes"]), f["read"], f["comment"]] for f in about["ram"]]
    for title, header, rows in (
        (
            "Objects",
            ["Category", "Slots", "Attributes", "Meaning"],
            [_category(c) for c in about["categories"]],
        ),
        (
            "Terrain",
            ["Kind", "Effect", "Category", "Meaning"],
            [
                [k["name"], k["effect"] or "", k["category"] or "", k["doc"]]
                for k in about["terrain"]
            ],
        ),
        ("Modes and difficulties", ["Option", "Number", "Meaning"], _meanings(about)),
        ("Starts", ["Start", "The first state shows"], list(about["starts"].items())),
        ("Variations", ["Variation", "Difference"], list(about["variations"].items())),
        ("RAM that REM reads", ["Field", "Bytes", "Read as", "Meaning"], fields),
    ):
        if rows:
            console.print()
            tables.show(tables.Table(title, header, rows), console)


def _meanings(about: dict[str, Any]) -> list[list[str]]:
    """The modes and difficulties with a known meaning."""
    options = {"modes": "game_mode", "difficulties": "game_difficulty"}
    return [
        [option, number, meaning]
        for kind, option in options.items()
        for number, meaning in about["meanings"][kind].items()
    ]


def _listed(numbers: Iterable[int]) -> str:
    return ", ".join(map(str, numbers)) or "not known without the ROM"


def _category(c: dict[str, Any]) -> list[str]:
    first, end = c["slots"]
    attributes = [name for name in ("hud", "value", "orientation", "blinks") if c[name]]
    if c["value"] and not c["vem_reads_value"]:
        attributes[attributes.index("value")] = "value (REM)"
    also = f" (also {', '.join(c['aliases'])})" if c["aliases"] else ""
    slots = str(first) if end - first == 1 else f"{first}-{end - 1}"
    return [c["name"] + also, slots, ", ".join(attributes), c["doc"]]


def _draw(game: Any, path: Path) -> None:
    """Draw REM's and VEM's objects after some random steps."""
    from ocjax.cli.gallery import picture
    from ocjax.cli.outputs import write_picture
    from ocjax.files import writing

    writing.check(path, suffixes=(".png",))
    write_picture(path, picture(game, STEPS), f"Objects of {game.name}, REM beside VEM")
