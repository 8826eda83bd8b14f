"""The command `ocjax parity`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.progress import track

from ocjax.cli.animations import save
from ocjax.cli.messages import console
from ocjax.evaluation import parity as referee
from ocjax.evaluation import tables
from ocjax.evaluation.jaxtari import Jaxtari
from ocjax.extraction import registry
from ocjax.files import writing
from ocjax.jaxatari import FIELDS

FRAME_TIME = 50  # milliseconds per frame of an animation


def parity(
    name: Annotated[
        str,
        typer.Argument(
            metavar="GAME", help="Name of the game, or all: a line for each common game."
        ),
    ],
    seeds: Annotated[
        int, typer.Option(min=1, help="Number of runs; their seeds are 0, 1, 2, ...")
    ] = 3,
    frames: Annotated[int, typer.Option(min=1, help="Emulated frames of each run.")] = 300,
    align: Annotated[
        bool,
        typer.Option(help="Begin with the simulator's positions if the real game allows it."),
    ] = True,
    out: Annotated[
        Path | None,
        typer.Option(
            help=(
                "A .png of the first frame that differs (or else the last one), or a .gif "
                "of the first run."
            )
        ),
    ] = None,
) -> None:
    """Compare a game of JAXtari with the real ROM, frame by frame.

    Both play the same actions.
    """
    writing.check(out, suffixes=(".png", ".gif"))
    games = list(FIELDS) if name == "all" else [name]
    found = [_runs(game, seeds, frames, align=align) for game in games]
    table = referee.to_summary(found) if name == "all" else referee.to_table(found[0])
    tables.show(table, console)
    if out is not None:
        run = found[0][0]
        save(referee.pictures(run, _frames(run, out)), out, frame_time=FRAME_TIME)
        writing.announce(console, "Written", out)


def _runs(name: str, seeds: int, frames: int, *, align: bool) -> list[referee.Parity]:
    game = registry.load(name)
    simulator = Jaxtari(game)
    numbers = track(
        range(seeds), description=f"{game.name}, {simulator.name}", console=console, transient=True
    )
    return [
        referee.compare(game, simulator, seed=seed, frames=frames, align=align) for seed in numbers
    ]


def _frames(run: referee.Parity, out: Path) -> list[int]:
    """The frames to draw: all for an animation, else the first one that differs."""
    if out.suffix == ".gif":
        return list(range(len(run.real)))
    first = referee.errors(run).first
    differing = first[first >= 0]
    return [int(differing.min()) if differing.size else len(run.real) - 1]
