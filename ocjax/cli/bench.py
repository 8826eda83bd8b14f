"""The command `ocjax bench`: how fast both methods and the environments are on this machine."""

import contextlib
import dataclasses
import importlib.metadata
import importlib.util
import json
import os
import platform
import statistics
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any

import jax
import numpy as np
import typer

from ocjax.cli.gallery import states
from ocjax.cli.loading import load_playable
from ocjax.cli.messages import console, errors_in_one_line
from ocjax.envs import make_vec
from ocjax.evaluation import tables
from ocjax.extraction.game import Game
from ocjax.files import writing

BATCHES = {"REM": (1, 64, 4096), "VEM": (1, 64, 1024)}
LEAST_CALLS = 5  # of a measurement
PLAYED = 100  # agent steps from which states are taken
FRAME_SKIP = 4  # emulated frames per agent step


@dataclasses.dataclass(frozen=True)
class Measurement:
    """The time of a call that handles a batch.

    Args:
        game: its name.
        what: the method or the environment.
        batch: states, frames or environments.
        first_call: seconds of the first call, compilation included.
        median: microseconds of one state, frame or agent step; the median of repeated calls.
        low: the 10th percentile.
        high: the 90th percentile.
    """

    game: str
    what: str
    batch: int
    first_call: float
    median: float
    low: float
    high: float


def bench(
    game: Annotated[list[str] | None, typer.Argument(help="Games to measure.")] = None,
    num_envs: Annotated[int, typer.Option("--envs", min=1, help="Number of instances of the environments.")] = 64,
    seconds: Annotated[float, typer.Option(min=0.01, help="Duration of each measurement.")] = 1.0,
    out: Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write a line of JSON for each measurement.")] = None,
) -> None:
    """Time REM, VEM and the environments on this machine, beside envpool where it is installed.

    Times are of one state, frame or agent step, which emulates four frames. Each is the median of repeated calls after the first one.
    """
    with errors_in_one_line():
        writing.check(out)
        games = [load_playable(name) for name in game or ["Pong"]]
    found = []
    for known in games:
        for measurement in (*_methods(known, seconds), *_environments(known, num_envs, seconds)):
            console.print(f"{measurement.game}, {measurement.what}, {measurement.batch}: {measurement.median:.3f} us", markup=False)
            found.append(measurement)
    tables.show(_table(found), console)
    if out is not None:
        lines = [json.dumps(dataclasses.asdict(m) | _machine()) for m in found]
        with errors_in_one_line():
            writing.write_text(out, "\n".join(lines) + "\n")
        writing.announce(console, f"{len(lines)} measurements", out)


def _methods(game: Game, seconds: float) -> Iterator[Measurement]:
    rams, frames = states(game, PLAYED, seed=0)
    for what, extract, samples in (("REM", game.rem, rams), ("VEM", game.vem, frames)):
        for batch in BATCHES[what]:
            x = jax.device_put(np.resize(samples, (batch, *samples.shape[1:])))
            yield _measured(game, what, batch, lambda extract=extract, x=x: jax.block_until_ready(extract(x)), seconds)


def _environments(game: Game, num_envs: int, seconds: float) -> Iterator[Measurement]:
    made: dict[str, Callable[[], Any]] = {
        "environment without objects": lambda: make_vec(game, num_envs, mode="raw"),
        "environment with REM": lambda: make_vec(game, num_envs),
        "environment with VEM": lambda: make_vec(game, num_envs, mode="vem"),
    }
    if importlib.util.find_spec("envpool") is not None:
        made["envpool with REM"] = lambda: make_vec(game, num_envs, backend="envpool")
    for what, make in made.items():
        with contextlib.closing(make()) as envs:
            envs.reset(seed=0)
            yield _measured(game, what, num_envs, lambda envs=envs: envs.step(envs.action_space.sample()), seconds)


def _measured(game: Game, what: str, batch: int, call: Callable[[], Any], seconds: float) -> Measurement:
    """Time calls for so many seconds."""
    start = time.perf_counter()
    call()
    first_call = time.perf_counter() - start
    spent, start = [], time.perf_counter()
    while len(spent) < LEAST_CALLS or time.perf_counter() - start < seconds:
        t = time.perf_counter()
        call()
        spent.append(1e6 * (time.perf_counter() - t) / batch)
    deciles = statistics.quantiles(spent, n=10)
    return Measurement(game.name, what, batch, first_call, statistics.median(spent), deciles[0], deciles[-1])


def _table(found: list[Measurement]) -> tables.Table:
    machine = _machine()
    title = f"{machine['processor']}, {machine['cores']} cores, jax {machine['jax']}, ocjax {machine['ocjax']}"
    rows = [
        (m.game, m.what, m.batch, f"{m.first_call:.2f}", f"{m.median:.3f}", f"{m.low:.3f}-{m.high:.3f}", round(1e6 / m.median))
        for m in found
    ]
    return tables.Table(title, ("game", "what", "batch", "first call, s", "median, us", "10-90 %", "per second"), rows)


def _machine() -> dict[str, Any]:
    """What the times depend on."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    versions = {name: importlib.metadata.version(name) for name in ("ocjax", "jax", "ale-py", "numpy")}
    return {
        "processor": names[0] if names else platform.processor() or platform.machine(),
        "cores": os.cpu_count(),
        "device": jax.devices()[0].device_kind,
        "python": platform.python_version(),
        **versions,
    }
