"""Compare the speed of this checkout with another one, such as the last release.

    git worktree add ../last v0.2.0
    python benchmarks/guard.py ../last [--games GAME ...] [--rounds 5]

The checkouts take turns in fresh processes. To depend less on the machine, each process measures
ratios: REM to a copy of the bytes that it reads and writes, VEM to the emulation of its frames, and
steps of environments to the same frames in emulators without ocjax. First calls, which compile, are
measured in seconds. All times are processor times, so that other programs disturb them little.
For environments they include the worker process, which needs Linux.

A figure of the table is this checkout's value divided by the other's, as the median over the pairs
of processes, with the lowest and the highest. The last rows are geometric means over the games. The
program exits with 1 if a median is above 1.25. With the defaults, it takes about five minutes on
two idle cores.

The processes use this checkout's interpreter and recordings, and only functions that both checkouts
have: `ocjax.load`, `rem`, `vem` and `ocjax.make_vec`.
"""

import argparse
import itertools
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from extraction import HERE, SOURCES, recorded, repeated

GAMES = "Pong", "SpaceInvaders", "MsPacman"
LIMIT = 1.25  # this checkout's value divided by the other's
BATCHES = {"rem": 4096, "vem": 256}
COPIES = 20  # per call of REM
ENVIRONMENTS = 16
FRAMES = 4  # emulated per step
SECONDS = 1.0  # of a measurement
MIN_CALLS = 5

Values = dict[str, dict[str, float]]  # by game and measurement

# ------------------------------------------------------------------------------------------
# one process


def ratio(
    f: Callable[[], Any], g: Callable[[], Any], clock: Callable[[], float] = time.process_time
) -> float:
    """The median ratio of the times of two functions, called alternately after a warm-up call."""
    f()
    g()
    ratios: list[float] = []
    end = begin = clock()
    while len(ratios) < MIN_CALLS or end - begin < SECONDS:
        start = clock()
        f()
        middle = clock()
        g()
        end = clock()
        ratios.append((middle - start) / (end - middle))
    return statistics.median(ratios)


def clock_of_processes() -> Callable[[], float]:
    """A clock of the processor time of this process and its present children."""
    tasks = Path("/proc/self/task").glob("*/children")
    children = [int(pid) for task in tasks for pid in task.read_text().split()]
    clocks = [(~pid << 3) | 2 for pid in children]  # clock_getcpuclockid of the C library
    return lambda: time.process_time() + sum(map(time.clock_gettime, clocks))


def emulator(game: Any) -> Callable[[int], None]:
    """A function that emulates a number of frames with random actions."""
    import ale_py
    from ale_py.roms import get_rom_path

    ale_py.ALEInterface.setLoggerMode(ale_py.LoggerMode.Error)
    ale = ale_py.ALEInterface()
    ale.setInt("random_seed", 0)
    ale.loadROM(str(get_rom_path(game.rom)))
    actions, rng = ale.getMinimalActionSet(), np.random.default_rng(0)

    def emulate(frames: int) -> None:
        for i in rng.integers(len(actions), size=frames // FRAMES):
            for _ in range(FRAMES):
                ale.act(actions[i])
            if ale.game_over():
                ale.reset_game()

    return emulate


def copying(x: Any, objects: Any) -> Callable[[], None]:
    """A function that copies a method's amount of input and output, `COPIES` times."""
    import jax

    size = (x.nbytes + sum(leaf.nbytes for leaf in jax.tree.leaves(objects))) // 2
    source, target = np.zeros(size, np.uint8), np.ones(size, np.uint8)

    def copy() -> None:
        for _ in range(COPIES):
            np.copyto(target, source)

    return copy


def extraction(
    extract: Callable[[Any], Any], x: Any, reference: Callable[[Any], Callable[[], None]]
) -> tuple[float, float]:
    """Seconds of the first call, and the ratio of the time of later ones to a reference's.

    The reference may depend on the extracted objects.
    """
    import jax

    def call() -> Any:
        return jax.block_until_ready(extract(x))

    start = time.process_time()
    objects = call()
    return time.process_time() - start, ratio(call, reference(objects))


def stepping(name: str, emulate: Callable[[int], None]) -> float:
    """The ratio of a step of environments to its frames in a single emulator."""
    import ocjax

    envs = ocjax.make_vec(name, ENVIRONMENTS, num_workers=1)
    envs.reset(seed=0)
    envs.action_space.seed(0)
    actions = itertools.cycle([envs.action_space.sample() for _ in range(100)])
    frames = FRAMES * ENVIRONMENTS
    clock = clock_of_processes()
    out = ratio(lambda: envs.step(next(actions)), lambda: emulate(frames), clock)
    envs.close()
    return out


def measure(name: str, folder: Path) -> dict[str, float]:
    """The values of a game, whose recorded arrays are in a folder."""
    import jax.numpy as jnp

    import ocjax

    game = ocjax.load(name)
    emulate = emulator(game)
    rams, frames = (
        jnp.asarray(repeated(np.load(folder / f"{name}-{SOURCES[method]}.npy"), batch))
        for method, batch in BATCHES.items()
    )
    first_rem, rem = extraction(game.rem, rams, partial(copying, rams))
    first_vem, vem = extraction(game.vem, frames, lambda _: partial(emulate, len(frames)))
    return {
        "REM to a copy": COPIES * rem,
        "VEM to emulation": vem,
        "steps to emulation": stepping(name, emulate),
        "first call of REM": first_rem,
        "first call of VEM": first_vem,
    }


def worker(checkout: str, folder: str, games: Sequence[str]) -> None:
    """Measure one checkout, and print the values as JSON."""
    import ocjax

    if not Path(ocjax.__file__).is_relative_to(checkout):
        raise SystemExit(f"{ocjax.__file__} is not in {checkout}")
    for name in games:
        ocjax.load(name)  # reports an unknown game before the long measurements
    ocjax.retain_freed_memory()
    print(json.dumps({name: measure(name, Path(folder)) for name in games}))


# ------------------------------------------------------------------------------------------
# pairs of processes


def in_process(checkout: Path, folder: str, games: Sequence[str]) -> Values:
    """Measure a checkout in a fresh process, without the compilation cache."""
    run = subprocess.run(
        [sys.executable, __file__, "--worker", json.dumps([str(checkout), folder, games])],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(checkout), "JAX_ENABLE_COMPILATION_CACHE": "false"},
        capture_output=True,
        text=True,
        check=False,
    )
    if run.returncode:
        raise SystemExit(f"{checkout}: the measurement failed\n{run.stderr}")
    return json.loads(run.stdout.splitlines()[-1])


def compared(other: Path, games: Sequence[str], rounds: int) -> dict[tuple[str, str], list[float]]:
    """This checkout's values divided by the other's, by game and measurement."""
    this = HERE.parent
    ratios: dict[tuple[str, str], list[float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in games:
            for source in SOURCES.values():
                np.save(Path(folder) / f"{name}-{source}.npy", recorded(name)[source])
        for i in range(rounds):
            order = (other, this) if i % 2 == 0 else (this, other)
            values = {checkout: in_process(checkout, folder, games) for checkout in order}
            for name in games:
                for what, value in values[this][name].items():
                    ratios.setdefault((name, what), []).append(value / values[other][name][what])
            print(f"round {i + 1} of {rounds}", file=sys.stderr)
    return ratios


def main() -> None:
    """Print the table; exit with 1 if a median is above the limit."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("checkout", type=Path, nargs="?", help="the other checkout's folder")
    parser.add_argument("--games", nargs="+", default=list(GAMES))
    parser.add_argument("--rounds", type=int, default=5, help="pairs of processes")
    parser.add_argument("--worker", type=json.loads, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.worker:
        worker(*arguments.worker)
        return
    if arguments.checkout is None or not (arguments.checkout / "ocjax").is_dir():
        parser.error("give the folder of another checkout, which contains the package ocjax")

    from rich.console import Console
    from rich.table import Table

    other = arguments.checkout.resolve()
    table = Table(title="Time divided by the other checkout's", title_justify="left")
    for heading in ("game", "measurement", "median", "lowest-highest", ""):
        table.add_column(heading, justify="right" if heading[:3] in ("med", "low") else "left")
    worse = False
    medians: dict[str, list[float]] = {}
    for (name, what), ratios in compared(other, arguments.games, arguments.rounds).items():
        median = statistics.median(ratios)
        medians.setdefault(what, []).append(median)
        is_worse = median > LIMIT
        worse |= is_worse
        spread = f"{min(ratios):.2f}-{max(ratios):.2f}"
        table.add_row(name, what, f"{median:.2f}", spread, "WORSE" if is_worse else "")
    for what, each in medians.items():
        spread = f"{min(each):.2f}-{max(each):.2f}"
        table.add_row("geometric mean", what, f"{statistics.geometric_mean(each):.2f}", spread)
    Console(width=140).print(table)
    sys.exit(worse)


if __name__ == "__main__":
    main()
