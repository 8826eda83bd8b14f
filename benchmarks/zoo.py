"""Train an agent for every game.

    python benchmarks/zoo.py [GAME ...] [--folder zoo]
    python benchmarks/zoo.py --pause | --resume

Needs the extras `rl` and `dev`. The first pass trains each game without a row in benchmarks/zoo.csv
for 10 million emulated frames with seed 0: first the games without a policy, in the order of the
OCAtari paper, Atari-57 and the others. The second pass trains from scratch for 20 million frames:
the games whose return rose by more than 5 % over the last quarter of the first pass, and the
paper's PPO games with three seeds.

Each finished run adds its row to benchmarks/zoo.csv and its curve to benchmarks/curves. A run with
seed 0 also replaces the policy that ships (ocjax/play/trained) and its row of the scoreboard.
Unfinished runs stay in the folder, and the same command continues them. All processes have the
lowest priority. `--pause` stops the processes of a running zoo until `--resume`, for example for
other measurements.
"""

import argparse
import fcntl
import multiprocessing
import os
import shutil
import signal
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import curves
import scoreboard
import zoo_plan
from rich.console import Console
from zoo_plan import Run

import ocjax
from ocjax.agents.training import Config, Trainer
from ocjax.files import writing
from ocjax.play.policies import SHIPPED

HERE = Path(__file__).parent
LOWEST_PRIORITY = 19
POLL_SECONDS = 1.0


def train(run: Run, folder: Path) -> None:
    """Train, play, and keep the results."""
    os.setpgrp()  # a signal also reaches the workers of the environments
    ocjax.use_compilation_cache()
    trainer = Trainer(Config(run.game, seed=run.seed), folder)
    trainer.run(run.frames, Console())
    hours = trainer.metrics.seconds / 3600
    trainer.close()
    policy = folder / "policy.npz"
    score = scoreboard.measure(run.game, str(policy), scoreboard.OWN, seeds=1)
    curves.keep(folder)
    if run.seed == 0:
        writing.write(SHIPPED / f"{run.game}.npz", lambda file: file.write(policy.read_bytes()))
        scoreboard.publish(score)
    zoo_plan.add_row(
        zoo_plan.Row(
            *run,
            hours=round(hours, 4),
            mean=score.mean,
            deviation=score.deviation,
            random_mean=score.random,
            random_deviation=score.random_deviation,
            rise=round(zoo_plan.rise(folder / "metrics.csv"), 4),
        )
    )


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
    """All runs that are left, one after the other."""
    while (run := zoo_plan.next_run(games)) is not None:
        yield run


def main() -> None:
    """Train all games, or pause or resume."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", default=zoo_plan.order(), metavar="GAME")
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
