"""The plan of `zoo.py`: the rows of finished runs, and the run that comes next."""

import csv
from collections.abc import Container, Sequence
from pathlib import Path
from typing import NamedTuple

import ocjax
from ocjax.extraction.suites import SUITES
from ocjax.files import writing
from ocjax.play.policies import SHIPPED

HERE = Path(__file__).parent
ROWS = HERE / "zoo.csv"
FIRST_FRAMES, SECOND_FRAMES = 10_000_000, 20_000_000
STILL_RISES = 0.05  # relative rise of the return over the last quarter of a run
PAPER_PPO = tuple("Asterix Boxing Breakout Freeway Pong Skiing SpaceInvaders Tennis".split())
PAPER_SEEDS = (0, 1, 2)


class Run(NamedTuple):
    """A training run."""

    game: str
    seed: int
    frames: int

    @property
    def name(self) -> str:
        """The name of its folder."""
        return f"{self.game}-{self.seed}-{self.frames // 1_000_000}M"


class Row(NamedTuple):
    """The result of a run.

    It has the mean and the standard deviation of the returns of complete games, of the policy and
    of random play. `rise` is the relative rise of the return over the last quarter of the run.
    """

    game: str
    seed: int
    frames: int
    hours: float
    mean: float
    deviation: float
    random_mean: float
    random_deviation: float
    rise: float


def read_rows(path: Path = ROWS) -> list[Row]:
    """The rows of all finished runs."""
    if not path.exists():
        return []
    with path.open() as file:
        kinds = Row.__annotations__
        return [
            Row(**{name: kinds[name](value) for name, value in row.items()})
            for row in csv.DictReader(file)
        ]


def add_row(row: Row, path: Path = ROWS) -> None:
    """Add a row; it replaces the one of the same game and seed."""
    kept = [old for old in read_rows(path) if (old.game, old.seed) != (row.game, row.seed)]
    lines = [",".join(Row._fields)] + [
        ",".join(str(value) for value in one) for one in sorted([*kept, row])
    ]
    writing.write_text(path, "\n".join(lines) + "\n")


def order() -> list[str]:
    """All games: the paper's, Atari-57, the others."""
    with (HERE / "paper.csv").open() as file:
        paper = [row["game"] for row in csv.DictReader(file)]
    supported = ocjax.games()
    return [
        game
        for game in dict.fromkeys([*paper, *SUITES["atari57"].games, *supported])
        if game in supported
    ]


def first_pass(games: Sequence[str], rows: Sequence[Row], shipped: Container[str]) -> list[Run]:
    """One run for each game without a row; games without a shipped policy come first.

    The paper's PPO games have a policy already, and the second pass trains them.
    """
    trained = {row.game for row in rows if row.seed == 0}
    left = [game for game in games if game not in trained and game not in PAPER_PPO]
    return [Run(game, 0, FIRST_FRAMES) for game in sorted(left, key=lambda game: game in shipped)]


def second_pass(games: Sequence[str], rows: Sequence[Row]) -> list[Run]:
    """Longer runs of games whose return still rose, and three seeds of the paper's PPO games."""
    longest = {(row.game, row.seed): row.frames for row in rows}
    rising = [
        Run(row.game, 0, SECOND_FRAMES)
        for row in rows
        if row.frames < SECOND_FRAMES and row.rise > STILL_RISES
    ]
    seeds = [Run(game, seed, SECOND_FRAMES) for game in PAPER_PPO for seed in PAPER_SEEDS]
    return [
        run
        for run in rising + seeds
        if run.game in games and longest.get((run.game, run.seed), 0) < run.frames
    ]


def next_run(games: Sequence[str]) -> Run | None:
    """The run to do next; None if all are finished."""
    rows, shipped = read_rows(), {path.stem for path in SHIPPED.glob("*.npz")}
    return next(iter(first_pass(games, rows, shipped) + second_pass(games, rows)), None)


def rise(metrics: Path) -> float:
    """The relative rise of the mean return over the last quarter of a run."""
    with metrics.open() as file:
        returns = [float(row["return"]) for row in csv.DictReader(file)]
    before, after = returns[3 * len(returns) // 4], returns[-1]
    return (after - before) / max(abs(before), 1.0)
