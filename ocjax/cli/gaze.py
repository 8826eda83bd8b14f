"""The command `ocjax gaze`."""

from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from PIL import Image, ImageDraw

from ocjax.cli.messages import console, warn
from ocjax.cli.outputs import write_csv, write_picture
from ocjax.emulators.progress import progress_bar
from ocjax.evaluation import tables
from ocjax.extraction import registry
from ocjax.extraction.game import Game
from ocjax.files import writing
from ocjax.files.atari_head import Look, looks
from ocjax.files.pictures import PictureFolder
from ocjax.transforms.drawing import overlay

COLUMNS = (
    "frame_id",
    "episode",
    "action",
    "reward",
    "gaze_positions",
    "category",
    "slot",
    "x",
    "y",
    "w",
    "h",
    "share",
)
SCALE = 3  # picture pixels per screen pixel
DOT = 3  # half the size of a gaze position in the picture


def gaze(
    trial: Annotated[Path, typer.Argument(help="The text file of a trial of Atari-HEAD.")],
    game: Annotated[str, typer.Option(metavar="GAME", help="Name of the game.")],
    out: Annotated[
        Path,
        typer.Option(help="A .csv file with a line for each frame and the object at the gaze."),
    ],
    frames: Annotated[
        Path | None,
        typer.Option(help="Folder of the trial's pictures. Default: the file's name without .txt."),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            help=("A .png of the first frame with an object at the gaze, or of the first frame.")
        ),
    ] = None,
) -> None:
    """Find the objects that the players of the dataset Atari-HEAD look at."""
    folder = trial.with_suffix("") if frames is None else frames
    known = registry.load(game)
    if not trial.exists():
        raise FileNotFoundError(f"no trial {trial}")
    if not folder.exists():
        raise FileNotFoundError(f"no folder {folder} of the trial's pictures: give it (--frames)")
    reads = [trial, *PictureFolder(folder).reads]
    writing.check(out, suffixes=(".csv",), reads=reads)
    writing.check(picture, suffixes=(".png",), reads=reads)
    with progress_bar("extracting", "frames", console) as report:
        found = list(looks(known, trial, folder, report))
    tables.show(_to_table(known, found), console)
    write_csv(out, COLUMNS, map(_csv_row, found))
    if picture is not None:
        looked_at = (look for look in found if look.slot is not None)
        write_picture(picture, _drawn(known, folder, next(looked_at, found[0])))
    if not any(look.objects.valid.any() for look in found):
        warn(f"no object of {known.name} is in {folder}: are these pictures of another game?")


def _csv_row(look: Look) -> list[Any]:
    f = look.frame
    box = [""] * 4 if look.slot is None else np.asarray(look.objects.xywh)[look.slot].tolist()
    facts = [f.frame_id, f.episode, f.action, f.reward, len(f.gaze), look.category, look.index]
    return [*facts, *box, f"{look.share:.3f}"]


def _to_table(game: Game, found: list[Look]) -> tables.Table:
    """Count the frames with the gaze on each category."""
    counts = Counter(look.category for look in found if len(look.frame.gaze))
    rows: list[list[tables.Cell]] = [
        [name or "nothing", n, 100 * n / counts.total()] for name, n in counts.most_common()
    ]
    return tables.Table(
        f"{game.name}: objects at the gaze on {counts.total()} frames",
        ["Category", "Frames", "%"],
        rows,
    )


def _drawn(game: Game, folder: Path, look: Look) -> Image.Image:
    pictures = PictureFolder(folder)
    row = next(i for i in range(pictures.rows) if pictures.stem(i) == look.frame.frame_id)
    image = overlay(game, pictures.read(row, row + 1)[0], look.objects, scale=SCALE)
    draw = ImageDraw.Draw(image)
    for x, y in look.frame.gaze * (2 * SCALE, SCALE):
        draw.ellipse(
            (x - DOT, y - DOT, x + DOT, y + DOT), fill=(255, 0, 0), outline=(255, 255, 255)
        )
    return image
