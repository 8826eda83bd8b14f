"""Measure games and update the table of games in benchmarks/README.md.

It shows agreement, values, coverage and speed, beside OCAtari. The percentages also go to
ocjax/cli/accuracy.json, which `ocjax games GAME` and the site show.

    python benchmarks/table.py [GAME ...] [--ocatari PYTHON] [--truth FOLDER ...] [--samples 2000]
        [--seed 20261121] [--core 0]

The rows of the named games (default: all) are measured and replaced; the others stay. F1 and IoU
come from `ocjax evaluate` on fresh play. PYTHON is an interpreter that has OCAtari. --truth names
folders of recordings with the video chip's sprites (FOLDER/<Game>.npz). On them, `drawn: F1` is
measured, `sprites` is the fraction of sprite pixels inside REM's boxes, and `boxes` is the fraction
of REM's boxes that hold drawn pixels. Times are median microseconds per frame on one core, at
batches of 4,096 (REM) and 1,024 (VEM), with the ratio to OCAtari's in parentheses. The paper's F1
(paper.csv) is from the OCAtari paper's appendix, for its DQN agent.
"""

import argparse
import csv
import json
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from _page import HERE, PageTable, evaluated, freed_memory
from extraction import SOURCES, bind, recorded, repeated, timed

if TYPE_CHECKING:
    from ocjax import Game
    from ocjax.evaluation.report import Evaluation

BEGIN, END = "<!-- games: python benchmarks/table.py -->", "<!-- end of games -->"
HEADER = [
    "game",
    "F1",
    "IoU",
    "exact",
    "score",
    "lives",
    "OCAtari's F1",
    "paper's F1",
    "drawn: F1",
    "sprites",
    "boxes",
    "REM us",
    "VEM us",
]
ACCURACY = HERE.parent / "ocjax" / "cli" / "accuracy.json"  # shown by `ocjax games GAME`
SHIPPED = {
    "F1": "f1",
    "IoU": "iou",
    "exact": "exact",
    "drawn: F1": "drawn_f1",
    "score": "score",
    "lives": "lives",
}
BATCHES = {"rem": 4096, "vem": 1024}
DECIMALS = {"rem": 3, "vem": 1}


def percent(share: float | np.ndarray | None) -> str:
    """A fraction in percent; "-" for None."""
    from ocjax.evaluation import tables

    return tables.text(None if share is None else 100 * float(share))


def agreement_cells(e: "Evaluation") -> list[str]:
    """F1, IoU, exact, score, lives and OCAtari's F1."""
    from ocjax.evaluation import report, tables
    from ocjax.extraction.categories import with_role

    counts = e.flicker_aware.sum()
    cells = [percent(counts.f1), percent(counts.mean_iou), percent(counts.exact_rate)]
    cells += [
        tables.text(report.value_accuracy(e, with_role(e.game.categories, role)))
        for role in ("score", "lives")
    ]
    return [*cells, percent(None if e.ocatari_agreement is None else e.ocatari_agreement.sum().f1)]


def paper_cell(name: str) -> str:
    """The OCAtari paper's F1 for its DQN agent, "-" for games that it lacks."""
    with (HERE / "paper.csv").open() as file:
        return next(
            (
                row["f1"]
                for row in csv.DictReader(file)
                if (row["game"], row["agent"]) == (name, "dqn")
            ),
            "-",
        )


def truth_cells(name: str, folders: Iterable[str]) -> list[str]:
    """F1, sprites and boxes on recordings with the video chip's sprites."""
    from ocjax import recordings
    from ocjax.evaluation import report

    paths = [path for folder in folders if (path := Path(folder) / f"{name}.npz").exists()]
    if not paths:
        return ["-"] * 3
    e = report.evaluate(recordings.join([recordings.read(path) for path in paths]), "")
    return [percent(e.flicker_aware.sum().f1), *map(percent, e.coverage or (None, None))]


def speed_cells(game: "Game", e: "Evaluation") -> list[str]:
    """Microseconds per frame of REM and VEM, and the ratios of OCAtari's times to them."""
    import jax
    import jax.numpy as jnp

    samples, cells = recorded(game.name), []
    for method, source in SOURCES.items():
        x = jnp.asarray(repeated(samples[source], BATCHES[method]))
        us = 1e6 * timed(jax.jit(getattr(game, method)), x)[0] / len(x)
        theirs = e.ocatari.get(method)
        ratio = (
            f" ({np.median(theirs.us) / us:,.0f})" if theirs is not None and len(theirs.us) else ""
        )
        cells.append(f"{us:.{DECIMALS[method]}f}{ratio}")
    return cells


def measure(name: str, arguments: argparse.Namespace) -> list[str]:
    """Measure one row of the table."""
    e = evaluated(name, arguments.samples, arguments.seed, arguments.ocatari)
    game = e.game.name
    return [
        game,
        *agreement_cells(e),
        paper_cell(game),
        *truth_cells(game, arguments.truth),
        *speed_cells(e.game, e),
    ]


def accuracy(rows: Iterable[Sequence[str]]) -> str:
    """The percentages of the table's rows as JSON, one line per game; missing ones are null."""
    columns = [HEADER.index(heading) for heading in SHIPPED]
    lines = []
    for row in rows:
        figures = {
            name: None if row[i] == "-" else float(row[i])
            for name, i in zip(SHIPPED.values(), columns, strict=True)
        }
        lines.append(f'  "{row[0]}": {json.dumps(figures)}')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def main() -> None:
    """Measure, update the page after each game, and finally the results that ship with ocjax."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", help="default: all games")
    parser.add_argument("--ocatari", metavar="PYTHON", help="Python interpreter that has OCAtari")
    parser.add_argument(
        "--truth",
        nargs="*",
        default=[],
        metavar="FOLDER",
        help="recordings with the video chip's sprites",
    )
    parser.add_argument("--samples", type=int, default=2000, help="samples to play per game")
    parser.add_argument("--seed", type=int, default=20261121, help="seed of the play")
    parser.add_argument("--core", type=int, default=0, help="core to run on")
    arguments = parser.parse_args()
    bind(arguments.core)

    import ocjax

    print(freed_memory(), file=sys.stderr)
    table = PageTable(BEGIN, END, HEADER)
    table.measure(arguments.games or ocjax.games(), lambda name: measure(name, arguments))
    ACCURACY.write_text(accuracy(table.rows))


if __name__ == "__main__":
    main()
