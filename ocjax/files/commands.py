"""The command `ocjax extract`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from ocjax import output
from ocjax.files.extraction import extract as extract_file
from ocjax.messages import errors_in_one_line

console = Console()


def extract(
    source: Annotated[
        str,
        typer.Argument(
            metavar="INPUT",
            help=".npy, .npz, .h5, .hdf5, .parquet, .arrow or .feather file, .zarr folder, folder of .png pictures, or minari:ID.",
        ),
    ],
    out: Annotated[Path, typer.Option(help="Objects: .npz, .h5, .hdf5, .parquet, .json (COCO) or .txt (MOT).")],
    game: Annotated[str | None, typer.Option(help="Name of the game, if neither the input nor its name tells it.")] = None,
    array: Annotated[
        str | None,
        typer.Option(help="Name of the array or column. Default: the first of rams, ram, screens, frames, observations, obs that fits."),
    ] = None,
    hud: Annotated[bool, typer.Option(help="Whether display objects (score, lives) are included.")] = True,
) -> None:
    """Extract objects from RAM or frames in files.

    Interrupted, the same command goes on where it stopped: until the output is complete, the work is kept in the folder OUT.parts.
    """
    columns = TextColumn("extracting"), BarColumn(), TextColumn("{task.completed:,} of {task.total:,} rows"), TimeRemainingColumn()
    with errors_in_one_line(), Progress(*columns, console=console) as progress:
        task = progress.add_task("", total=0)
        extract_file(source, out, game, array=array, hud=hud, report=lambda done, total: progress.update(task, completed=done, total=total))
    output.announce(console, "Written", out)
