"""Test and time REM and VEM on JAX's default device, such as a GPU.

    python benchmarks/accelerators.py [GAME ...] [--states 1048576] [--frames 16384] [--seconds 1]

Results for the frames in tests/data and for random bytes are compared exactly with the CPU's
results in the same process. Batches lie in the device's memory before a call, and results stay
there. The column "from and to numpy" includes both copies. The last column is the time relative to
a copy of the same amount of memory on the device. Rates are medians over repeated, synchronous
calls. The first call is timed separately, as compilation.
"""

import argparse
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from _page import freed_memory
from extraction import SOURCES, recorded, repeated, timed
from rich.console import Console
from rich.table import Table

import ocjax
from ocjax._xla import process

NOISE = 1000  # random states
HEADINGS = (
    "game",
    "method",
    "batch",
    "equal",
    "compilation s",
    "million a second",
    "10-90 %",
    "from and to numpy",
    "times a copy",
)


def noise(samples: np.ndarray) -> np.ndarray:
    """The samples and, for RAM, random bytes."""
    if samples.shape[1:] != (128,):
        return samples
    return np.concatenate(
        [samples, np.random.default_rng(0).integers(0, 256, (NOISE, 128), dtype=np.uint8)]
    )


def equal(extract: Callable[[Any], Any], samples: np.ndarray) -> bool:
    """True if the default device and the CPU extract equal objects from samples."""
    on_cpu = jax.device_put(samples, jax.devices("cpu")[0])
    pairs = zip(
        jax.tree.leaves(extract(jnp.asarray(samples))),
        jax.tree.leaves(extract(on_cpu)),
        strict=True,
    )
    return all(np.array_equal(np.asarray(a), np.asarray(b)) for a, b in pairs)


def copying_seconds(size: int, seconds: float) -> float:
    """Seconds that the device takes to read `size` / 2 bytes and write `size` / 2 bytes."""
    return timed(jax.jit(lambda x: x + np.uint8(1)), jnp.zeros(size // 2, jnp.uint8), seconds)[0]


def measure(name: str, method: str, batch: int, seconds: float) -> list[str]:
    """A row of the table."""
    extract = getattr(ocjax.load(name), method)
    samples = recorded(name)[SOURCES[method]]
    same = equal(extract, noise(samples))
    host = repeated(samples, batch)
    x = jax.block_until_ready(jnp.asarray(host))
    start = time.perf_counter()
    size = x.nbytes + sum(
        leaf.nbytes for leaf in jax.block_until_ready(jax.tree.leaves(extract(x)))
    )
    compilation = time.perf_counter() - start
    median, low, high = timed(extract, x, seconds)
    copies = timed(lambda h: jax.tree.map(np.asarray, extract(h)), host, seconds)[0]
    rates = [batch / t / 1e6 for t in (median, high, low)]
    row = [
        name,
        method.upper(),
        f"{batch:,}",
        "yes" if same else "NO",
        f"{compilation:.1f}",
        f"{rates[0]:.2f}",
    ]
    return [
        *row,
        f"{rates[1]:.2f}-{rates[2]:.2f}",
        f"{batch / copies / 1e6:.2f}",
        f"{median / copying_seconds(size, seconds):.1f}",
    ]


def main() -> None:
    """Print the table and the geometric means of the rates."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", help="default: all games")
    parser.add_argument("--states", type=int, default=2**20, help="batch size of REM")
    parser.add_argument("--frames", type=int, default=2**14, help="batch size of VEM")
    parser.add_argument("--seconds", type=float, default=1.0, help="duration of a measurement")
    arguments = parser.parse_args()
    process.use_compilation_cache()
    device = jax.devices()[0]
    table = Table(
        title=f"Extraction on {device.device_kind}, jax {jax.__version__}, {freed_memory()}",
        title_justify="left",
    )
    for heading in HEADINGS:
        table.add_column(heading, justify="left" if heading in ("game", "method") else "right")
    rates: dict[str, list[float]] = {}
    for name in arguments.games or ocjax.games():
        for method, batch in (("rem", arguments.states), ("vem", arguments.frames)):
            row = measure(name, method, batch, arguments.seconds)
            rates.setdefault(method, []).append(float(row[5]))
            print(*row, file=sys.stderr)
            table.add_row(*row)
    console = Console(width=140)
    console.print(table)
    for method, values in rates.items():
        console.print(
            f"{method.upper()}: {statistics.geometric_mean(values):.2f} million a second "
            "(geometric mean)"
        )


if __name__ == "__main__":
    main()
