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

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
from _scores import published
from matplotlib.axes import Axes

HERE = Path(__file__).parent
KEPT, PICTURE = HERE / "curves", HERE.parent / "docs" / "curves.png"
POINTS = 200  # of a saved curve
COLUMNS = 4  # of the picture


OCATARI = {  # objects, 10 million steps; from training logs of the OCAtari project
    "Asterix": 3300.0,
    "Boxing": 55.0,
    "Freeway": 32.5,
    "Pong": 7.2,
    "Tennis": -1.0,
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


def references(game: str) -> dict[str, float | None]:
    """Mean returns for comparison, by their source: Wang et al. (2016), and OCAtari."""
    found = published().get(game)
    if found is None:
        return {}
    return {"random": found.random, "human": found.human, "ocatari": OCATARI.get(game)}


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
    for name, value in references(game).items():
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
