"""The command `ocjax extract`."""

from pathlib import Path
from typing import Annotated

import typer

from ocjax.cli.messages import console
from ocjax.cli.options import RAY
from ocjax.emulators.progress import progress_bar
from ocjax.files import writing
from ocjax.files.pipeline import extract as extract_file


def extract(
    source: Annotated[
        str,
        typer.Argument(
            metavar="INPUT",
            help=".npy, .npz, .h5, .hdf5, .parquet, .arrow or .feather file, .zarr folder, folder "
            "of pictures (.png, .gif, .webp, .bmp, .tif), of .parquet files or of "
            "datasets.save_to_disk, or minari:ID.",
        ),
    ],
    out: Annotated[
        str,
        typer.Option(
            help=(
                "Objects: .npz, .h5, .hdf5, .parquet, .json (COCO), .txt (MOT), yolo:FOLDER, or "
                "minari:ID to copy a Minari dataset."
            )
        ),
    ],
    game: Annotated[
        str | None,
        typer.Option(
            metavar="GAME",
            help="Name of the game. Required if the input and its name do not name it.",
        ),
    ] = None,
    array: Annotated[
        str | None,
        typer.Option(
            help=(
                "Name of the array or column. Default: the first of rams, ram, screens, frames, "
                "observations, obs that fits."
            )
        ),
    ] = None,
    hud: Annotated[
        bool, typer.Option(help="Whether display objects (score, lives) are included.")
    ] = True,
    ray: RAY = None,
) -> None:
    """Extract objects from RAM or frames in files.

    To resume after an interruption, repeat the command. Until the output is
    complete, the work stays in the folder OUT.parts.
    """
    with progress_bar("extracting", "rows", console) as report:
        extract_file(source, out, game, array=array, hud=hud, ray=ray, report=report)
    writing.announce(console, "Written", Path(out))
