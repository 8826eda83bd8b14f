"""Repeat the OCAtari paper's tables: the agreement of REM and VEM beside other results.

    python benchmarks/paper.py [GAME ...] [--trained] [--ocatari PYTHON] [--samples 500]
        [--seed 20261122]

The other results are the paper's, and OCAtari's on the same frames. The rows of the named games
(default: all) are measured on random play, and updated in benchmarks/README.md. With --trained, the
agents that ship with ocjax play complete games under the settings of their training, and the second
table is updated. PYTHON is an interpreter that has OCAtari. Results are percentages by the paper's
rule: a match has the same category and centres within 5 pixels, on one frame, and HUD objects
count. paper.csv and detectors.csv hold the paper's results (Delfosse et al., RLJ 2024: the detailed
table, and the table with SPACE and SPOC).
"""

import argparse
import csv
from typing import TYPE_CHECKING

from _page import HERE, PageTable, evaluated

if TYPE_CHECKING:
    from ocjax.evaluation.metrics import Agreement
    from ocjax.evaluation.report import Evaluation

BEGIN, END = "<!-- paper: python benchmarks/paper.py -->", "<!-- end of paper -->"
TRAINED_BEGIN, TRAINED_END = (
    "<!-- trained: python benchmarks/paper.py --trained -->",
    "<!-- end of trained -->",
)
TRAINED_HEADER = ["game", "ocjax", "flicker-aware F1", "OCAtari 2.2.1", "paper: DQN", "paper: C51"]
AGENTS = ("random", "dqn", "c51")
DETECTORS = ("SPACE", "SPOC")
HEADER = [
    "game",
    "ocjax",
    "flicker-aware F1",
    "OCAtari 2.2.1",
    *(f"paper: {name}" for name in ("random", "DQN", "C51")),
    *DETECTORS,
]
FIGURES = ("precision", "recall", "f1", "iou")


def joined(figures: list[str]) -> str:
    """Precision, recall, F1 and IoU in one cell."""
    return " / ".join(figures)


def cell(agreement: "Agreement | None") -> str:
    """The cell of a measured agreement."""
    if agreement is None:
        return "-"
    a = agreement.sum()
    return joined([f"{100 * float(x):.1f}" for x in (a.precision, a.recall, a.f1, a.mean_iou)])


def published(game: str) -> list[str]:
    """The paper's cells: each agent, then the F1 of each detector."""
    with (HERE / "paper.csv").open() as file:
        agents = {
            row["agent"]: joined([row[name] for name in FIGURES])
            for row in csv.DictReader(file)
            if row["game"] == game
        }
    with (HERE / "detectors.csv").open() as file:
        detectors = next((row for row in csv.DictReader(file) if row["game"] == game), {})
    return [
        *(agents.get(name, "-") for name in AGENTS),
        *(detectors.get(name, "-") for name in DETECTORS),
    ]


def measure(name: str, arguments: argparse.Namespace) -> list[str]:
    """One row of the table."""
    e = evaluated(name, arguments.samples, arguments.seed, arguments.ocatari)
    return [*measured(e), *published(e.game.name)]


def measure_trained(name: str, arguments: argparse.Namespace) -> list[str]:
    """One row of the table with trained agents."""
    e = evaluated(name, arguments.samples, arguments.seed, arguments.ocatari, policy="trained")
    return [*measured(e), *published(e.game.name)[1 : len(AGENTS)]]


def measured(e: "Evaluation") -> list[str]:
    """The cells of an evaluation."""
    aware = f"{100 * float(e.flicker_aware.sum().f1):.1f}"
    return [e.game.name, cell(e.single_frame), aware, cell(e.ocatari_agreement)]


def main() -> None:
    """Measure, and update the page after each game."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", help="default: all games")
    parser.add_argument("--trained", action="store_true", help="trained agents play")
    parser.add_argument("--ocatari", metavar="PYTHON", help="Python interpreter that has OCAtari")
    parser.add_argument("--samples", type=int, default=500, help="samples to play per game")
    parser.add_argument("--seed", type=int, default=20261122, help="seed of the play")
    arguments = parser.parse_args()

    import ocjax
    from ocjax.play import policies

    if arguments.trained:
        games = arguments.games or sorted(path.stem for path in policies.SHIPPED.glob("*.npz"))
        PageTable(TRAINED_BEGIN, TRAINED_END, TRAINED_HEADER).measure(
            games, lambda name: measure_trained(name, arguments)
        )
        return
    PageTable(BEGIN, END, HEADER).measure(
        arguments.games or ocjax.games(), lambda name: measure(name, arguments)
    )


if __name__ == "__main__":
    main()
