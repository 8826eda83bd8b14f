"""The command `ocjax render`: pictures and animations of the objects of recorded play."""

from pathlib import Path
from typing import Annotated

import typer
from rich.progress import track

from ocjax import recordings
from ocjax.cli.animations import extract, pictures, save
from ocjax.cli.messages import console
from ocjax.cli.options import Terrain
from ocjax.files import writing

METHODS = {"rem": ("REM",), "vem": ("VEM",), "both": ("REM", "VEM")}


def render(
    recording: Annotated[Path, typer.Argument(help="Recording (.npz) with rams and screens.")],
    out: Annotated[Path, typer.Option(help="A .png of one sample, or a .gif of several.")],
    game: Annotated[
        str | None,
        typer.Option(
            metavar="GAME",
            help="Name of the game. Required if the file and its name do not name it.",
        ),
    ] = None,
    method: Annotated[
        str,
        typer.Option(metavar="rem|vem|both", help="The method; both are drawn side by side."),
    ] = "both",
    first: Annotated[int, typer.Option(min=0, help="First sample to draw.")] = 0,
    count: Annotated[int, typer.Option(min=1, help="Number of samples in a .gif.")] = 50,
    scale: Annotated[int, typer.Option(min=1, max=8, help="Picture pixels per screen pixel.")] = 2,
    terrain: Terrain = False,
) -> None:
    """Draw objects over the frames of a recording."""
    if method not in METHODS:
        raise ValueError(f"method must be rem, vem or both, got {method!r}")
    writing.check(out, suffixes=(".png", ".gif"), reads=[recording])
    tape = recordings.read(recording, game)
    if tape.screens is None:
        raise recordings.RecordingError(
            f"{recording} has no frames (an array 'screens') to draw on"
        )
    if first >= len(tape):
        raise ValueError(
            f"{recording} has {len(tape)} samples, so the first to draw cannot be {first}"
        )
    if terrain:
        tape.game.require_terrain()
    samples = slice(first, min(len(tape), first + (count if out.suffix == ".gif" else 1)))
    with console.status("extracting"):
        objects = extract(tape, METHODS[method], samples)
    drawn = pictures(tape, objects, samples, scale, with_terrain=terrain)
    total = samples.stop - samples.start
    images = list(track(drawn, description="drawing", total=total, console=console, transient=True))
    save(images, out)
    writing.announce(console, f"{len(images)} samples of {recording}", out)
