"""Time REM and VEM for each game and batch size on one core, beside OCAtari in the same run.

    python benchmarks/extraction.py [GAME ...] [--ocatari PYTHON] [--core 0] [--largest 65536]

PYTHON is the interpreter of an environment with OCAtari; `ocjax evaluate Pong --ocatari
--ocatari-env FOLDER` creates one in FOLDER. This process and OCAtari's are bound to one core. A
time is the median of repeated, synchronous calls after a warm-up call; the spread is the 10th to
90th percentile. Compilation is timed separately. The frames in tests/data are repeated to fill the
batch.
"""

import argparse
import os
import statistics
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from _page import freed_memory

HERE = Path(__file__).parent
BATCHES = {"rem": (1, 64, 4096, 65536), "vem": (1, 64, 1024, 4096)}
SOURCES = {"rem": "rams", "vem": "screens"}
LEAST_CALLS, MOST_CALLS = 5, 500  # of a measurement
OCATARI_SAMPLES = 400

# (method, batch size) -> OCAtari's time divided by ocjax's, one per game
Ratios = dict[tuple[str, int], list[float]]


def timed(f: Callable[[Any], Any], x: Any, seconds: float = 1.0) -> tuple[float, float, float]:
    """Seconds per call: median, 10th and 90th percentile."""
    import jax

    jax.block_until_ready(f(x))
    spent, start = [], time.perf_counter()
    while len(spent) < LEAST_CALLS or (
        time.perf_counter() - start < seconds and len(spent) < MOST_CALLS
    ):
        t = time.perf_counter()
        jax.block_until_ready(f(x))
        spent.append(time.perf_counter() - t)
    deciles = statistics.quantiles(spent, n=10)
    return statistics.median(spent), deciles[0], deciles[-1]


def bind(core: int) -> None:
    """Bind this process and its children to one core. Call it before JAX starts its threads."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {core})


def ocatari_times(python: str | None, game: str) -> dict[str, list[float] | None]:
    """Microseconds per frame of OCAtari's methods on the same samples, or None.

    The three numbers are the median, 10th and 90th percentile.
    """
    from ocjax import load
    from ocjax.evaluation import ocatari_peer
    from ocjax.recordings import Recording

    times: dict[str, list[float] | None] = {"rem": None, "vem": None}
    if python:
        rams, screens = (
            repeated(recorded(game)[name], OCATARI_SAMPLES) for name in ("rams", "screens")
        )
        for method, result in ocatari_peer.run(
            Recording(load(game), rams, screens), Path(python)
        ).items():
            if not result.error:
                times[method] = np.percentile(result.us, [50, 10, 90]).tolist()
    return times


def recorded(game: str) -> dict[str, np.ndarray]:
    """The arrays of the game's recording in tests/data."""
    from ocjax import recordings

    return recordings.read(HERE.parent / "tests" / "data" / f"{game}.npz", game).arrays


def repeated(samples: np.ndarray, batch: int) -> np.ndarray:
    """Repeat the samples to a batch of a given size."""
    return np.resize(samples, (batch, *samples.shape[1:]))


def game_rows(name: str, python: str | None, largest: int, ratios: Ratios) -> list[list[str]]:
    """Table rows of one game; adds to `ratios`."""
    import jax
    import jax.numpy as jnp

    import ocjax

    game, rows = ocjax.load(name), []
    theirs, samples = ocatari_times(python, game.name), recorded(game.name)
    for method, batches in BATCHES.items():
        extract = jax.jit(getattr(game, method))
        for batch in (b for b in batches if b <= largest):
            x = jnp.asarray(repeated(samples[SOURCES[method]], batch))
            start = time.perf_counter()
            jax.block_until_ready(extract(x))
            compilation = time.perf_counter() - start
            median, low, high = (1e6 * t / batch for t in timed(extract, x))
            row = [
                game.name,
                method.upper(),
                f"{compilation:.2f}",
                f"{batch:,}",
                f"{median:.3f}",
                f"{low:.3f}-{high:.3f}",
                "",
                "",
            ]
            if times := theirs[method]:
                ratios.setdefault((method, batch), []).append(times[0] / median)
                row[-2:] = f"{times[0]:.1f}", f"{times[0] / median:,.0f}"
            rows.append(row)
            print(f"{game.name} {method} {batch}: {median:.3f} us", file=sys.stderr)
    return rows


def main() -> None:
    """Print the table and the geometric means of the ratios."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", help="default: all games")
    parser.add_argument("--ocatari", metavar="PYTHON", help="Python interpreter that has OCAtari")
    parser.add_argument("--core", type=int, default=0, help="core to run on")
    parser.add_argument("--largest", type=int, default=65536, help="skip larger batches")
    arguments = parser.parse_args()
    bind(arguments.core)

    import jax
    from rich.console import Console
    from rich.table import Table

    import ocjax

    memory = freed_memory()
    console = Console(width=140)
    table = Table(
        title=(
            f"Microseconds per frame on one core, jax {jax.__version__} on "
            f"{jax.devices()[0].platform}, {memory}"
        ),
        title_justify="left",
    )
    for heading in (
        "game",
        "method",
        "compilation s",
        "batch",
        "median",
        "10-90 %",
        "OCAtari",
        "ratio",
    ):
        table.add_column(heading, justify="left" if heading in ("game", "method") else "right")
    ratios: Ratios = {}
    for name in arguments.games or ocjax.games():
        for row in game_rows(name, arguments.ocatari, arguments.largest, ratios):
            table.add_row(*row)
    console.print(table)
    for (method, batch), values in ratios.items():
        console.print(
            f"{method.upper()} at {batch:,}: {statistics.geometric_mean(values):,.0f} times "
            "OCAtari's rate (geometric mean)"
        )


if __name__ == "__main__":
    main()
