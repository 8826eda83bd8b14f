"""Time of REM and VEM for each game and batch size, on one core, beside OCAtari's in the same run.

    python benchmarks/extraction.py [GAME ...] [--peer PYTHON] [--core 0]

PYTHON is the interpreter of an environment that has OCAtari; `ocjax evaluate Pong --peer --peer-env DIR` makes one in a folder. The process
and the peer's are bound to one core. A figure is the median over repeated calls, each waited for, after a warm-up call; the spread is
10-90 %; compilation is timed apart. Frames are those in tests/data, repeated to the batch size.
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

HERE = Path(__file__).parent
BATCHES = {"rem": (1, 64, 4096, 65536), "vem": (1, 64, 1024, 4096)}


def timed(f: Callable[[Any], Any], x: Any, seconds: float = 1.0) -> tuple[float, float, float]:
    """Seconds of a call: median, 10 % and 90 %."""
    import jax

    jax.block_until_ready(f(x))
    spent, start = [], time.perf_counter()
    while len(spent) < 5 or (time.perf_counter() - start < seconds and len(spent) < 500):
        t = time.perf_counter()
        jax.block_until_ready(f(x))
        spent.append(time.perf_counter() - t)
    deciles = statistics.quantiles(spent, n=10)
    return statistics.median(spent), deciles[0], deciles[-1]


def bind(core: int) -> None:
    """Keep the process, and those that it starts, on one core; to be called before jax starts its threads."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {core})


def peer_times(python: str | None, game: str) -> dict[str, list[float] | None]:
    """Microseconds a frame of OCAtari's methods on the same samples (median, 10 %, 90 %), None where there is no figure."""
    from ocjax import load, peer
    from ocjax.recordings import Recording

    times: dict[str, list[float] | None] = {"rem": None, "vem": None}
    if python:
        rams, screens = (repeated(recorded(game)[k], 400) for k in ("rams", "screens"))
        for name, method in peer.run(Recording(load(game), rams, screens), Path(python)).items():
            if not method.error:
                times[name] = np.percentile(method.us, [50, 10, 90]).tolist()
    return times


def recorded(game: str) -> dict[str, np.ndarray]:
    """Arrays of the game's file in tests/data."""
    with np.load(HERE.parent / "tests" / "data" / f"{game}.npz") as file:
        return dict(file)


def repeated(samples: np.ndarray, batch: int) -> np.ndarray:
    """As many samples as the batch needs, over and over."""
    return np.resize(samples, (batch, *samples.shape[1:]))


def main() -> None:
    """Print the table, and the geometric means of the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("games", nargs="*")
    parser.add_argument("--peer", help="Python interpreter that has OCAtari")
    parser.add_argument("--core", type=int, default=0)
    parser.add_argument("--largest", type=int, default=65536, help="leave out larger batches")
    arguments = parser.parse_args()
    bind(arguments.core)

    import jax
    import jax.numpy as jnp
    from rich.console import Console
    from rich.table import Table

    import ocjax

    console = Console(width=140)
    table = Table(title=f"microseconds a frame, one core, jax {jax.__version__} on {jax.devices()[0].platform}", title_justify="left")
    for heading in ("game", "method", "compile s", "batch", "median", "10-90 %", "OCAtari", "ratio"):
        table.add_column(heading, justify="left" if heading in ("game", "method") else "right")
    ratios: dict[tuple[str, int], list[float]] = {}
    for name in arguments.games or ocjax.games():
        game = ocjax.load(name)
        peer, data = peer_times(arguments.peer, game.name), recorded(game.name)
        samples = {"rem": data["rams"], "vem": data["screens"]}
        for method, batches in BATCHES.items():
            f = jax.jit(getattr(game, method))
            for batch in (b for b in batches if b <= arguments.largest):
                x = jnp.asarray(repeated(samples[method], batch))
                start = time.perf_counter()
                jax.block_until_ready(f(x))
                compiled = time.perf_counter() - start
                median, low, high = (1e6 * t / batch for t in timed(f, x))
                theirs = peer[method]
                row = [game.name, method.upper(), f"{compiled:.2f}", f"{batch:,}", f"{median:.3f}", f"{low:.3f}-{high:.3f}"]
                if theirs:
                    ratios.setdefault((method, batch), []).append(theirs[0] / median)
                    row += [f"{theirs[0]:.1f}", f"{theirs[0] / median:,.0f}"]
                table.add_row(*row, *[""] * (8 - len(row)))
                print(f"{game.name} {method} {batch}: {median:.3f} us", file=sys.stderr)
    console.print(table)
    for (method, batch), values in ratios.items():
        console.print(f"{method.upper()} at {batch:,}: {statistics.geometric_mean(values):,.0f} times OCAtari's rate (geometric mean)")


if __name__ == "__main__":
    main()
