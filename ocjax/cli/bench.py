"""The command `ocjax bench`: the speed of both methods and the environments on this machine."""

import dataclasses
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ocjax._extras import require
from ocjax.cli.gallery import states
from ocjax.cli.messages import console
from ocjax.cli.options import OCATARI_ENV
from ocjax.cli.outputs import write_text
from ocjax.emulators.start import load_playable
from ocjax.evaluation import ocatari_peer, tables, time_plots, timing
from ocjax.evaluation.timing import Measurement
from ocjax.extraction.game import Game
from ocjax.files import writing

PLAYED = 100  # agent steps of the play that provides states


def bench(
    game: Annotated[list[str] | None, typer.Argument(help="Games to measure.")] = None,
    num_envs: Annotated[
        int, typer.Option("--envs", min=1, help="Number of instances of the environments.")
    ] = 64,
    seconds: Annotated[float, typer.Option(min=0.01, help="Duration of each measurement.")] = 1.0,
    ocatari: Annotated[bool, typer.Option("--ocatari", help="Time OCAtari 2.2.1, too.")] = False,
    ocatari_env: OCATARI_ENV = None,
    out: Annotated[
        Path | None,
        typer.Option("--json", metavar="FILE", help="Write a line of JSON for each measurement."),
    ] = None,
    plots: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", help="Write figures: steps.png and batches.png. Needs matplotlib."
        ),
    ] = None,
) -> None:
    """Time REM, VEM, the environments and other programs on one core of this machine.

    The other programs are ale-py's vector environment, envpool and OpenCV, if
    they are installed, and OCAtari with --ocatari. Some systems, such as macOS,
    cannot bind a process to a core. They use all cores.

    A time is per state, frame or agent step of four emulated frames. It is the
    median of repeated calls after the first one. --json adds the 10th and the
    90th percentile.
    """
    with timing.one_core():  # before JAX starts its threads
        if plots is not None:
            require("matplotlib")
            plots.mkdir(parents=True, exist_ok=True)
        writing.check(out)
        games = [load_playable(name) for name in game or ["Pong"]]
        with console.status("looking for OCAtari"):
            python = ocatari_peer.interpreter(ocatari_env) if ocatari else None
        found = []
        for known in games:
            for measurement in _measurements(known, num_envs, seconds, python):
                console.print(
                    f"{measurement.game}, {measurement.what}, {measurement.batch}: "
                    f"{measurement.median:.3f} us",
                    markup=False,
                )
                found.append(measurement)
        for known in games:
            tables.show(_table(known, found), console)
        _write(found, out, plots)


def _measurements(
    game: Game, num_envs: int, seconds: float, python: Path | None
) -> Iterator[Measurement]:
    rams, frames = states(game, PLAYED, seed=0)
    yield from timing.methods(game, rams, frames, seconds)
    yield from timing.opencv(game, np.ascontiguousarray(frames), seconds)
    if python is not None:
        yield from timing.ocatari(game, rams, frames, python)
    yield from timing.environments(game, num_envs, seconds)


def _write(found: list[Measurement], out: Path | None, plots: Path | None) -> None:
    machine = timing.machine()
    lines = [json.dumps(dataclasses.asdict(m) | machine) for m in found]
    write_text(out, "\n".join(lines) + "\n", f"{len(lines)} measurements")
    if plots is not None:
        for name, draw in (
            ("steps.png", time_plots.steps_figure),
            ("batches.png", time_plots.batches_figure),
        ):
            picture = draw(found)
            writing.write(
                plots / name, lambda file, picture=picture: file.write(picture), follow=False
            )
            writing.announce(console, "A figure", plots / name)


def _digits(number: float) -> str:
    """A number with three significant digits or more."""
    return f"{number:.3g}" if number < 1000 else f"{number:,.0f}"


def _table(game: Game, found: list[Measurement]) -> tables.Table:
    machine = timing.machine()
    cores = "1 core" if machine["cores"] == 1 else f"{machine['cores']} cores"
    title = (
        f"{game.name}: {machine['processor']}, {cores}, jax {machine['jax']}, "
        f"ocjax {machine['ocjax']}"
    )
    rows = [
        (m.what, m.batch, f"{m.first_call:.2f}", _digits(m.median), round(1e6 / m.median))
        for m in found
        if m.game == game.name
    ]
    return tables.Table(title, ("what", "batch", "first, s", "median, us", "per second"), rows)
