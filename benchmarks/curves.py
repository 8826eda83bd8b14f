"""Draw learning curves from the folders of training runs, and keep their data.

    python benchmarks/curves.py [FOLDER ...]

The mean returns in each FOLDER (written by `ocjax train`) are thinned to about 200 points and saved
as benchmarks/curves/<Game>-<inputs>-<seed>.csv. All saved curves are drawn into docs/curves.png.
Needs matplotlib (extra `dev`).
"""

import argparse
import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

HERE = Path(__file__).parent
KEPT, PICTURE = HERE / "curves", HERE.parent / "docs" / "curves.png"
POINTS = 200  # of a saved curve
COLUMNS = 4  # of the picture


class Reference(NamedTuple):
    """Mean returns for comparison."""

    random: float
    human: float
    ocatari: float | None  # objects, 10 million steps; from training logs of the OCAtari project


# Random and human: Mnih et al. (2015), Skiing: Wang et al. (2016).
REFERENCES = {
    "Asterix": Reference(210.0, 8503.0, 3300.0),
    "Boxing": Reference(0.1, 4.3, 55.0),
    "Breakout": Reference(1.7, 31.8, None),
    "Freeway": Reference(0.0, 29.6, 32.5),
    "Pong": Reference(-20.7, 9.3, 7.2),
    "Skiing": Reference(-17098.0, -4337.0, None),
    "SpaceInvaders": Reference(148.0, 1652.0, None),
    "Tennis": Reference(-23.8, -8.9, -1.0),
}
COLORS = {
    "random": "tab:gray",
    "human": "tab:green",
    "ocatari": "tab:orange",
    "objects": "tab:blue",
    "pixels": "tab:red",
}


def keep(folder: Path) -> None:
    """Save the curve of a training run."""
    config = json.loads((folder / "config.json").read_text())
    with (folder / "metrics.csv").open() as file:
        rows = [
            (int(row["frames"]), float(row["return"]))
            for row in csv.DictReader(file)
            if row["return"] != "nan"
        ]
    step = max(1, len(rows) // POINTS)
    KEPT.mkdir(exist_ok=True)
    with (KEPT / f"{config['game']}-{config['inputs']}-{config['seed']}.csv").open(
        "w", newline=""
    ) as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(("frames", "return"))
        out.writerows([*rows[:-1:step], rows[-1]])


def draw_game(axis: Axes, game: str, paths: Sequence[Path]) -> None:
    """Draw the curves and the reference returns of a game."""
    for path in paths:
        inputs = path.stem.split("-")[1]
        with path.open() as file:
            points = [
                (float(row["frames"]) / 1e6, float(row["return"])) for row in csv.DictReader(file)
            ]
        axis.plot(
            *zip(*points, strict=True),
            color=COLORS[inputs],
            linewidth=1,
            label=inputs if path.stem.endswith("-0") else None,
        )
    for name, value in REFERENCES[game]._asdict().items() if game in REFERENCES else ():
        if value is not None:
            axis.axhline(
                value,
                color=COLORS[name],
                linestyle="--",
                linewidth=1,
                label=name.replace("ocatari", "OCAtari, 40 M frames"),
            )
    axis.set(title=game, xlabel="million emulated frames", ylabel="mean return of 100 games")
    axis.legend(fontsize="x-small", loc="lower right")


def draw() -> None:
    """Draw all saved curves."""
    curves: dict[str, list[Path]] = {}
    for path in sorted(KEPT.glob("*.csv")):
        curves.setdefault(path.stem.split("-")[0], []).append(path)
    columns = min(COLUMNS, len(curves))
    rows = -(-len(curves) // columns)
    figure, axes = plt.subplots(
        rows, columns, figsize=(4.2 * columns, 3.2 * rows), squeeze=False, layout="constrained"
    )
    for axis in axes.flat[len(curves) :]:
        axis.axis("off")
    for axis, (game, paths) in zip(axes.flat, curves.items(), strict=False):
        draw_game(axis, game, paths)
    figure.savefig(PICTURE, dpi=80)


def main() -> None:
    """Save and draw."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folders", nargs="*", type=Path, metavar="FOLDER", help="of training runs")
    for folder in parser.parse_args().folders:
        keep(folder)
    draw()
    print(f"written: {PICTURE}")


if __name__ == "__main__":
    main()
