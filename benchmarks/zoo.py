"""Train an agent for every game.

    python benchmarks/zoo.py [GAME ...] [--folder zoo]
    python benchmarks/zoo.py --pause | --resume

Needs the extras `rl` and `dev`. The first pass trains each game without a policy for 10 million
emulated frames with seed 0: the games of the OCAtari paper, then Atari-57, then the others. The
second pass trains from scratch and for 20 million frames. It repeats the games whose return rose by
more than 5 % over the last quarter of the first pass, and adds two seeds of the paper's PPO games.

Each finished run adds its row to benchmarks/zoo.csv and its curve to benchmarks/curves. A run with
seed 0 also replaces the policy that ships (ocjax/play/trained). Unfinished runs stay in the folder,
and the same command continues them. All processes have the lowest priority. `--pause` stops the
processes of a running zoo until `--resume`, for example for other measurements.
"""

import argparse
import csv
import fcntl
import multiprocessing
import os
import shutil
import signal
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import curves
from rich.console import Console

import ocjax
from ocjax.agents.training import Config, Trainer
from ocjax.extraction.suites import SUITES
from ocjax.files import writing
from ocjax.play.games import Played, play
from ocjax.play.policies import SHIPPED

HERE = Path(__file__).parent
ROWS = HERE / "zoo.csv"
FIRST_FRAMES, SECOND_FRAMES = 10_000_000, 20_000_000
STILL_RISES = 0.05  # relative rise of the return over the last quarter of a run
PAPER_PPO = (
    "Asterix",
    "Boxing",
    "Breakout",
    "Freeway",
    "Pong",
    "Skiing",
    "SpaceInvaders",
    "Tennis",
)
PAPER_SEEDS = (1, 2)
GAMES_PLAYED, PLAYED_SEED = 20, 1000  # seeds of training are 0 to 65
LOWEST_PRIORITY = 19
POLL_SECONDS = 1.0


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

    It has the returns of complete games of the policy and of random play, and the rise over the
    last quarter.
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
    """Add a row; it replaces the row of the same game and seed."""
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


def first_pass(games: Sequence[str], rows: Sequence[Row]) -> list[Run]:
    """One run for each game without a policy."""
    trained = {row.game for row in rows if row.seed == 0} | {
        path.stem for path in SHIPPED.glob("*.npz")
    }
    return [Run(game, 0, FIRST_FRAMES) for game in games if game not in trained]


def second_pass(games: Sequence[str], rows: Sequence[Row]) -> list[Run]:
    """Longer runs of games with rising returns, and more seeds of the paper's PPO games."""
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
    """The next run, or None if all are finished."""
    rows = read_rows()
    return next(iter(first_pass(games, rows) + second_pass(games, rows)), None)


def rise(metrics: Path) -> float:
    """The relative rise of the mean return over the last quarter of a run."""
    with metrics.open() as file:
        returns = [float(row["return"]) for row in csv.DictReader(file)]
    before, after = returns[3 * len(returns) // 4], returns[-1]
    return (after - before) / max(abs(before), 1.0)


def train(run: Run, folder: Path) -> None:
    """Train, play, and keep the results."""
    os.setpgrp()  # a signal also reaches the workers of the environments
    ocjax.use_compilation_cache()
    trainer = Trainer(Config(run.game, seed=run.seed), folder)
    trainer.run(run.frames, Console())
    hours = trainer.metrics.seconds / 3600
    trainer.close()
    game, policy = ocjax.load(run.game), folder / "policy.npz"
    trained, random = (
        play(game, name, GAMES_PLAYED, seed=PLAYED_SEED) for name in (str(policy), "random")
    )
    curves.keep(folder)
    if run.seed == 0:
        writing.write(SHIPPED / f"{run.game}.npz", lambda file: file.write(policy.read_bytes()))
    results = (
        round(number, 4)
        for number in (hours, *_summary(trained), *_summary(random), rise(folder / "metrics.csv"))
    )
    add_row(Row(*run, *results))


def _summary(played: Played) -> tuple[float, float]:
    return float(played.returns.mean()), float(played.returns.std(ddof=1))


def supervise(run: Run, folder: Path, paused: Path) -> None:
    """Train in a separate process, which stops while the file `paused` exists.

    Raises:
        SystemExit: the training failed.
    """
    process = multiprocessing.get_context("spawn").Process(target=train, args=(run, folder))
    process.start()
    stopped = False
    try:
        while process.is_alive():
            process.join(POLL_SECONDS)
            if paused.exists() != stopped:
                stopped = not stopped
                _signal(process, signal.SIGSTOP if stopped else signal.SIGCONT)
    finally:
        _signal(process, signal.SIGKILL)  # also after an error; the checkpoint stays
    if process.exitcode:
        raise SystemExit(
            f"{run.name} failed with exit code {process.exitcode}; the same command continues it"
        )


def _signal(process: Any, number: signal.Signals) -> None:
    """Send a signal to a training process and its workers, if they still exist."""
    try:
        os.killpg(process.pid, number)
    except ProcessLookupError:
        return


def runs(games: Sequence[str]) -> Iterator[Run]:
    """All remaining runs, in order."""
    while (run := next_run(games)) is not None:
        yield run


def main() -> None:
    """Train all games, or pause or resume."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", default=order(), metavar="GAME")
    parser.add_argument(
        "--folder", type=Path, default=HERE.parent / "zoo", help="for unfinished runs"
    )
    parser.add_argument(
        "--pause", action="store_true", help="stop the processes of a running zoo until --resume"
    )
    parser.add_argument("--resume", action="store_true", help="continue a paused zoo")
    arguments = parser.parse_args()
    arguments.folder.mkdir(parents=True, exist_ok=True)
    paused = arguments.folder / "paused"
    if arguments.pause:
        paused.touch()
    elif arguments.resume:
        paused.unlink(missing_ok=True)
    else:
        _train_all(arguments.games, arguments.folder, paused)


def _train_all(games: Sequence[str], folder: Path, paused: Path) -> None:
    signal.signal(signal.SIGTERM, lambda *_: exit(1))
    with (folder / "lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise SystemExit(f"another process trains in {folder}") from error
        os.nice(LOWEST_PRIORITY)
        for run in runs(games):
            print(f"{time.strftime('%H:%M:%S')} {run.name}", flush=True)
            supervise(run, folder / run.name, paused)
            shutil.rmtree(folder / run.name)


if __name__ == "__main__":
    main()
