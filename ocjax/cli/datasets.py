"""The commands `ocjax dataset`, `ocjax relabel` and `ocjax export`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from ocjax.cli.messages import console
from ocjax.cli.options import RAY, START_HELP, count_option
from ocjax.datasets import collection, detection, exports, generation
from ocjax.datasets.plans import ENVS, LEAST_F1, RANDOM_PERCENT, SEEDS, DatasetError
from ocjax.datasets.plans import plan as plan_dataset
from ocjax.emulators import ram_starts
from ocjax.emulators.progress import progress_bar
from ocjax.extraction import names, registry
from ocjax.files import writing

ALL = "all"


def dataset(
    game: Annotated[str, typer.Argument(help="Name of the game, or all.")],
    out: Annotated[Path, typer.Option(help="Folder of the dataset, or of the datasets.")],
    states: Annotated[
        int,
        count_option(f"States to play, in equal parts by {ENVS} instances of each seed.", "10k"),
    ] = 10_000,
    seed: Annotated[
        list[int] | None, typer.Option(min=0, help="Seed; may be repeated. Default: 0 and 42.")
    ] = None,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME[=PERCENT]",
            help="Policy (random, repeat, trained, or a file of a saved policy) and the "
            f"percentage of the states that it plays, a multiple of {100 // ENVS}; may be "
            f"repeated. Default: random={RANDOM_PERCENT}, and trained={100 - RANDOM_PERCENT} or, "
            f"in games without a trained policy, repeat={100 - RANDOM_PERCENT}.",
        ),
    ] = None,
    least_f1: Annotated[
        float,
        typer.Option(min=0, max=1, help="Drop sequences with a lower F1 of REM against VEM."),
    ] = LEAST_F1,
    start: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME=VALUE[,...]", help=START_HELP),
    ] = None,
    ray: RAY = None,
) -> None:
    """Make a dataset of frames and RAM with the objects of both methods.

    The same command gives the same bytes. To resume after an interruption,
    repeat the command.

    With `all`, each game gets a subfolder with as many states, played by the
    default policies from all of the game's starts, and --out a table of them.
    """
    if game == ALL:
        if policy or start or least_f1 != LEAST_F1:
            raise ValueError("all takes no --policy, --start and --least-f1")
        _all(out, states, seed or SEEDS, ray)
        return
    spec = registry.load(game)
    begin = [ram_starts.parse(text) for text in start or ()]
    plan = plan_dataset(
        spec, states, seed or SEEDS, _percentages(policy) if policy else None, least_f1, begin
    )
    was_complete = (out / generation.SHEET).exists() and not generation.missing(plan, out)
    with progress_bar(f"playing {spec.name}", "states", console) as report:
        generation.generate(plan, out, ray=ray, report=report)
    writing.announce(
        console,
        "Complete already" if was_complete else "Written",
        out if was_complete else out / generation.SHEET,
    )


def _all(out: Path, states: int, seeds: Sequence[int], ray: str | None) -> None:
    plans = [collection.plan_of(name, states, seeds) for name in names.games()]
    with progress_bar("playing all games", "states", console) as report:
        collection.generate_all(plans, out, ray=ray, report=report)
    writing.announce(console, "Written", out / generation.SHEET)


def _percentages(policies: list[str]) -> dict[str, int]:
    out: dict[str, int] = {}
    for text in policies:
        name, sign, percent = text.rpartition("=")
        known = sign and percent.isdecimal()
        name = name if known else text
        if name in out:
            raise DatasetError(f"the policy {name!r} occurs twice")
        out[name] = int(percent) if known else 100
    return out


def relabel(
    folder: Annotated[Path, typer.Argument(metavar="DATASET", help="Folder of a dataset.")],
    ray: RAY = None,
) -> None:
    """Replace the objects and the datasheet of a dataset with the present decoders.

    To resume after an interruption, repeat the command.
    """
    with progress_bar("labelling", "states", console) as report:
        generation.relabel(folder, ray=ray, report=report)
    writing.announce(console, "Written", folder / generation.SHEET)


def export(
    folders: Annotated[
        list[Path], typer.Argument(metavar="DATASET...", help="Folders of datasets.")
    ],
    out: Annotated[
        str,
        typer.Option(
            help=(
                "A .csv file (replaced) in the layout of the OCAtari paper's dataset, a new "
                "minari:ID, or a new coco:FOLDER or yolo:FOLDER with pictures and boxes of one or "
                "several datasets."
            )
        ),
    ],
) -> None:
    """Export datasets to COCO, YOLO, CSV or Minari."""
    with progress_bar("exporting", "states", console) as report:
        if out.startswith((detection.COCO, detection.YOLO)):
            detection.export_boxes(folders, out, report=report)
        elif len(folders) > 1:
            raise ValueError(f"only coco:FOLDER and yolo:FOLDER take several datasets, got {out}")
        else:
            exports.export(folders[0], out, report=report)
    writing.announce(console, "Written", Path(out))
