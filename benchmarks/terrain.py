"""Compare the terrain from RAM with the terrain from pixels, and time both.

    python benchmarks/terrain.py [GAME ...] [--samples 400] [--seed 0]

The states are of random play. Dice coefficients, 2 |A and B| / (|A| + |B|), count the pixels that
are outside of the boxes of objects that are no terrain; `mean` is the mean over kinds, and `least`
names the kind with the lowest one. Kinds with fewer than 400 pixels in all states do not count.
Times are medians of 5 calls with a batch of 256 states, with VEM beside them in the same process.
The rows are written to benchmarks/README.md.
"""

import argparse
import statistics
import time
from collections.abc import Callable, Iterator
from typing import Any

import jax
import numpy as np
from _page import PageTable

import ocjax
from ocjax.play.rollouts import rollout

BEGIN, END = "<!-- terrain -->", "<!-- /terrain -->"
HEADER = ("game", "mean, %", "least, %", "from RAM, us", "from pixels, us", "VEM, us")
FEW = 400  # pixels
CHUNK = 32
BATCH = 256
CALLS = 5


def free_pixels(game: Any, objects: Any) -> np.ndarray:
    """Pixels outside of the boxes of objects that are no terrain, bool `[B, H, 160]`."""
    same = {kind.category for kind in game.terrain}
    covers = np.array([c.name not in same for c in game.categories])[game.slot_category]
    free = np.ones((len(objects.valid), *game.screen), bool)
    for state, slot in np.argwhere(np.asarray(objects.valid) & covers):
        x, y, w, h = (int(v) for v in objects.xywh[state, slot])
        free[state, max(y - 1, 0) : y + h + 1, max(x - 1, 0) : x + w + 1] = False
    return free


def counts(game: Any, rams: np.ndarray, screens: np.ndarray) -> Iterator[np.ndarray]:
    """Common pixels and both methods' pixels of each kind, int `[3, kinds]`, by chunk."""
    for start in range(0, len(rams), CHUNK):
        part = slice(start, start + CHUNK)
        objects = jax.tree.map(np.asarray, game.rem(rams[part]))
        free = free_pixels(game, objects)[:, None]
        ours = np.asarray(game.terrain_of(rams[part]).masks) & free
        theirs = np.asarray(game.terrain_in(screens[part]).masks) & free
        yield np.stack([m.sum((0, 2, 3)) for m in (ours & theirs, ours, theirs)])


def seconds(f: Callable[[], Any]) -> float:
    """The median time of a call after a warm-up call."""
    jax.block_until_ready(f())
    times = []
    for _ in range(CALLS):
        start = time.perf_counter()
        jax.block_until_ready(f())
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def row(name: str, samples: int, seed: int) -> list[str]:
    """A row of the table."""
    game: Any = ocjax.load(name)
    tape = rollout(game, samples, seed=seed)
    assert tape.screens is not None
    both, ours, theirs = sum(counts(game, tape.rams, tape.screens), np.zeros((3, 1), int))
    shown = ours + theirs >= FEW
    dice = 200 * both / np.maximum(ours + theirs, 1)
    worst = int(np.argmin(np.where(shown, dice, np.inf)))
    rams = np.resize(tape.rams, (BATCH, 128))
    screens = np.resize(tape.screens, (BATCH, *game.screen))
    times = (
        seconds(lambda: game.terrain_of(rams).masks),
        seconds(lambda: game.terrain_in(screens).masks),
        seconds(lambda: game.vem(screens)),
    )
    least = f"{dice[worst]:.2f} ({game.terrain[worst].name})"
    return [name, f"{dice[shown].mean():.2f}", least, *(f"{1e6 * t / BATCH:.1f}" for t in times)]


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=str(__doc__).split("\n")[0])
    parser.add_argument("games", nargs="*", help="default: all games with terrain")
    parser.add_argument("--samples", type=int, default=400)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    games = args.games or [name for name in ocjax.games() if ocjax.load(name).terrain]
    PageTable(BEGIN, END, HEADER).measure(games, lambda name: row(name, args.samples, args.seed))


if __name__ == "__main__":
    main()
