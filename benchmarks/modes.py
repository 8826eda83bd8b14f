"""Compare REM with VEM in every mode and difficulty, and print the worst combinations.

    python benchmarks/modes.py [GAME ...] [--worst N] [--frame-skip 3] [--seed 20261122]
        [--markdown FILE]

The modes and difficulties are ale-py's. Each combination is played by 4 instances with random
actions, each held for 1 to 8 steps. After a warm-up of 50 steps, every ninth step is a sample. The
200 samples are spread over 22 seconds of play. With an odd frame skip, such as the default, they
cover both phases of flickering objects. F1 is flicker-aware and counts the HUD, `exact` is the
fraction of matched boxes that are identical, and `score` is the fraction of samples with a REM
score equal to the sum of rewards. All are in percent. The last column names the categories with the
lowest agreement.
"""

import argparse
import itertools
from pathlib import Path
from typing import TYPE_CHECKING

import jax
import numpy as np
from rich.console import Console

import ocjax
from ocjax.emulators.start import variants
from ocjax.evaluation import matching, metrics, tables
from ocjax.evaluation.report import percent
from ocjax.extraction.categories import with_role
from ocjax.play.rollouts import rollout

if TYPE_CHECKING:
    from ocjax import Game, Objects

# instances; steps before the first sample and between samples; samples per instance
INSTANCES, WARM_UP, EVERY, SAMPLES = (
    4,
    50,
    9,
    50,
)
HEADER = ("game", "mode", "difficulty", "objects", "F1", "exact", "score", "least agreement")
F1, EXACT = HEADER.index("F1"), HEADER.index("exact")
LEAST = 20  # objects that a category needs to be named


def measure(
    game: "Game", mode: int, difficulty: int, frame_skip: int, seed: int
) -> list[tables.Cell]:
    """Measure one row of the table."""
    steps = WARM_UP + EVERY * SAMPLES
    tape = rollout(
        game,
        INSTANCES * steps,
        num_envs=INSTANCES,
        frame_skip=frame_skip,
        seed=seed,
        game_mode=mode,
        game_difficulty=difficulty,
    )
    kept = np.flatnonzero(np.arange(len(tape)) % steps >= WARM_UP)[::EVERY]
    rams, screens, previous, rewards, lives = (
        tape.arrays[k][kept] for k in ("rams", "screens", "previous", "rewards", "lives")
    )
    rem, vem, before = (to_host(o) for o in (game.rem(rams), game.vem(screens), game.vem(previous)))
    left, right, earlier = map(matching.detections, (rem, vem, before))
    by_category = metrics.agreement(left, right, earlier).sum(axis=0)
    whole = by_category.sum()
    shares = metrics.value_shares(rem, rewards, lives)
    names = with_role(game.categories, "score")
    score = next((percent(share) for name, share in shares.items() if name in names), None)
    scores = [percent(whole.f1), percent(whole.exact_rate), score]
    return [
        game.name,
        str(mode),
        str(difficulty),
        int(whole.left),
        *scores,
        least(game, by_category),
    ]


def to_host(objects: "Objects") -> "Objects":
    """The objects as NumPy arrays."""
    return jax.tree.map(np.asarray, objects)


def least(game: "Game", counts: metrics.Agreement) -> str:
    """The three frequent categories with the lowest F1 below 99 %."""
    often = np.minimum(counts.left, counts.right) >= LEAST
    low = sorted(
        (percent(f1), c.name)
        for c, f1, enough in zip(game.categories, counts.f1, often, strict=True)
        if enough and f1 < 0.99
    )
    return ", ".join(f"{name} {f1:.1f}" for f1, name in low[:3])


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", help="default: all games")
    parser.add_argument(
        "--worst", type=int, metavar="N", help="print only the N combinations that agree least"
    )
    parser.add_argument("--frame-skip", type=int, default=3, help="emulated frames per step")
    parser.add_argument("--seed", type=int, default=20261122, help="seed of the play")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write the table as Markdown")
    arguments = parser.parse_args()

    rows: list[list[tables.Cell]] = []
    progress = Console(stderr=True)
    for name in arguments.games or ocjax.games():
        game = ocjax.load(name)
        for mode, difficulty in itertools.product(*variants(game)):
            rows.append(measure(game, mode, difficulty, arguments.frame_skip, arguments.seed))
            progress.print(*map(tables.text, rows[-1]), highlight=False, soft_wrap=True)
        jax.clear_caches()
    rows.sort(key=lambda row: (row[F1], row[EXACT]))
    title = f"REM against VEM in {len(rows)} modes and difficulties, worst first, in percent"
    table = tables.Table(title, HEADER, rows[: arguments.worst])
    tables.show(table, Console())
    if arguments.markdown:
        arguments.markdown.write_text(tables.to_markdown([table]))


if __name__ == "__main__":
    main()
