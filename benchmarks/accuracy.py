"""Agreement of REM and VEM, and REM's values against the emulator's, on fresh random play.

    python benchmarks/accuracy.py [GAME ...] [--samples 2000] [--seed 12345]

Eight instances a game play random actions, each held for 1 to 8 steps of 3 emulated frames (so that both phases of a flicker occur); every
step is a sample. F1 and IoU as in the OCAtari paper (ocjax.evaluation), flicker-aware; `exact` is the share of matched boxes that are
identical. `score` and `lives` are the shares of samples in which the value is the sum of rewards since the episode began, and
the emulator's lives wherever the object is shown.
"""

import argparse

import jax
import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

import ocjax
from ocjax import evaluation
from ocjax.envs import AlePool

NUM_ENVS = 8


def play(game: ocjax.Game, samples: int, seed: int) -> dict[str, np.ndarray]:
    """RAM, the last two frames, rewards since the episode began and lives of successive steps; samples of the instances interleaved."""
    rng = np.random.default_rng(seed)
    pool = AlePool(game, NUM_ENVS, screens=True, frame_skip=3, repeat_action_probability=0)
    pool.reset([seed + i for i in range(NUM_ENVS)])
    out: dict[str, list[np.ndarray]] = {"ram": [], "screen": [], "reward": [], "lives": []}
    total, action, left = np.zeros(NUM_ENVS), np.zeros(NUM_ENVS, int), np.zeros(NUM_ENVS, int)
    over = np.zeros(NUM_ENVS, bool)
    for _ in track(range(samples // NUM_ENVS), description=game.name, transient=True):
        action = np.where(left == 0, rng.integers(len(pool.actions), size=NUM_ENVS), action)
        left = np.where(left == 0, rng.integers(1, 9, size=NUM_ENVS), left) - 1
        pool.send(action)
        pool.wait()
        total = np.where(over, 0, total) + pool.reward
        over = pool.terminated | pool.truncated
        for key, value in (("ram", pool.ram), ("screen", pool.screen), ("reward", total), ("lives", pool.lives)):
            out[key].append(value.copy())
    pool.close()
    return {k: np.concatenate(v) for k, v in out.items()}


def value_share(objects: ocjax.Objects, game: ocjax.Game, names: tuple[str, ...], want: np.ndarray) -> str:
    """Share of samples in which the value of the one category of these names is right, where it is valid."""
    for name in names:
        if name in game.slices and game.slices[name].stop - game.slices[name].start == 1:
            value, valid = (np.asarray(a)[:, game.slices[name].start] for a in (objects.value, objects.valid))
            if "EnemyScore" in game.slices:
                value = value - np.asarray(objects.value)[:, game.slices["EnemyScore"].start]
            return f"{100 * float(np.mean(value[valid] == want[valid])):.2f}"
    return ""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("games", nargs="*")
    parser.add_argument("--samples", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=12345)
    arguments = parser.parse_args()
    console = Console(width=120)
    table = Table(title=f"{arguments.samples} samples a game, seed {arguments.seed}; percent", title_justify="left")
    for heading in ("game", "objects", "precision", "recall", "F1", "IoU", "exact", "score", "lives"):
        table.add_column(heading, justify="left" if heading == "game" else "right")
    for name in arguments.games or ocjax.games():
        game = ocjax.load(name)
        tape = play(game, arguments.samples, arguments.seed)
        rem = jax.tree.map(np.asarray, game.rem(tape["ram"]))
        before, now = (jax.tree.map(np.asarray, game.vem(tape["screen"][:, i])) for i in (0, 1))
        a = evaluation.total(evaluation.agreement(game, rem, now, before))
        scores = value_share(rem, game, ("Score", "PlayerScore", "P1Score"), tape["reward"])
        lives = value_share(rem, game, ("Lives", "Life", "Live"), tape["lives"])
        numbers = [f"{100 * v:.2f}" for v in (a.precision, a.recall, a.f1, a.mean_iou, a.exact_rate)]
        table.add_row(game.name, f"{a.left:,}", *numbers, scores, lives)
    console.print(table)


if __name__ == "__main__":
    main()
