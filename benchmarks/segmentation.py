"""Time `ocjax.segment` beside VEM on the same frames.

    python benchmarks/segmentation.py [GAME ...] [--batch 256]

The recordings in tests/data are repeated to fill the batch. VEM finds the objects, and `segment`
assigns the frames' pixels to them. The two take turns: a time is the median of 7 synchronous calls
after a warm-up call, and the ratio is the median of the ratios of neighbouring calls. The rows are
written to benchmarks/README.md, and the program prints the geometric mean of the ratios.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import jax
import numpy as np
from _page import PageTable, freed_memory
from extraction import recorded, repeated

import ocjax

GAMES = (
    *("Asteroids", "Breakout", "Centipede", "Enduro", "Freeway", "MontezumaRevenge"),
    *("MsPacman", "Pong", "Qbert", "Seaquest", "SpaceInvaders", "Tennis"),
)
BEGIN, END = "<!-- segmentation -->", "<!-- /segmentation -->"
HEADER = ("game", "segment, us", "VEM, us", "ratio")
CALLS = 7


def seconds(f: Callable[[], Any]) -> float:
    """The time of a synchronous call."""
    start = time.perf_counter()
    jax.block_until_ready(f())
    return time.perf_counter() - start


def row(name: str, batch: int) -> list[str]:
    """A row of the table."""
    game = ocjax.load(name)
    frames = jax.numpy.asarray(repeated(recorded(name)["screens"], batch))
    objects = game.vem(frames)
    jax.block_until_ready(ocjax.segment(objects, frames))
    times = np.array(
        [
            (seconds(lambda: ocjax.segment(objects, frames)), seconds(lambda: game.vem(frames)))
            for _ in range(CALLS)
        ]
    )
    segment, vem = np.median(times, axis=0) * 1e6 / batch
    return [name, f"{segment:.1f}", f"{vem:.1f}", f"{np.median(times[:, 0] / times[:, 1]):.2f}"]


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=str(__doc__).split("\n")[0])
    parser.add_argument("games", nargs="*", help="default: the games of the table")
    parser.add_argument("--batch", type=int, default=256)
    args = parser.parse_args()
    print(freed_memory())
    table = PageTable(BEGIN, END, HEADER)
    table.measure(args.games or GAMES, lambda name: row(name, args.batch))
    ratios = [float(cells[-1]) for cells in table.rows]
    print(f"geometric mean of the ratios: {statistics.geometric_mean(ratios):.2f}")


if __name__ == "__main__":
    main()
