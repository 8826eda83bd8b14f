"""Agent steps per second of Stable-Baselines3's PPO on ocjax's environments and over OCAtari.

    python benchmarks/sb3.py PYTHON [GAME ...] [--envs 8] [--rounds 3] [--seconds 20]

Needs the extra `sb3`. PYTHON is an interpreter that has OCAtari and Stable-Baselines3. Each round
trains both with the same hyperparameters, from the positions of the objects outside the display.
ocjax gives the present positions and the movement since the step before, and OCAtari the positions
of the last four steps. Rates start with the second rollout and include updates. A third rate
measures the workers alone, with random actions. Rates are medians over the rounds.
"""

import argparse
import os
import statistics
import subprocess
import time
from pathlib import Path

import numpy as np
from _page import freed_memory
from _sb3_clock import training_rate
from rich.console import Console
from rich.table import Table

import ocjax
from ocjax import sb3

OPTIONS = {"hud": False, "obs": "vector"}
BLOCK = 25  # steps


def peer_rate(python: str, game: str, num_envs: int, seconds: float) -> float:
    """Agent steps per second over OCAtari."""
    command = [
        python,
        str(Path(__file__).parent / "_sb3_ocatari.py"),
        game,
        str(num_envs),
        str(seconds),
    ]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    return float(run.stdout.split()[-1])


def stepping_rates(game: str, num_envs: int, seconds: float) -> tuple[float, float]:
    """Agent steps per second without training, directly and through Stable-Baselines3.

    Blocks of steps of ocjax's vector environment alternate between the two interfaces.
    """
    rng, times = np.random.default_rng(0), ([], [])
    both = (
        ocjax.make_vec(game, num_envs, autoreset_mode="SameStep", **OPTIONS),
        sb3.make_vec_env(game, num_envs, **OPTIONS),
    )
    for envs in both:
        envs.reset()
    actions = rng.integers(2, size=(BLOCK, num_envs))
    while sum(map(sum, times)) < seconds:
        for envs, spent in zip(both, times, strict=True):
            begin = time.perf_counter()
            for action in actions:
                envs.step(action)
            spent.append(time.perf_counter() - begin)
    for envs in both:
        envs.close()
    rates = [BLOCK * num_envs / statistics.median(spent[1:]) for spent in times]
    return rates[0], rates[1]


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("python", metavar="PYTHON")
    parser.add_argument("games", nargs="*", default=["Pong", "SpaceInvaders"])
    parser.add_argument("--envs", type=int, default=8)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=20.0, help="duration of each measurement")
    arguments = parser.parse_args()
    memory = freed_memory()
    n, seconds = arguments.envs, arguments.seconds
    headings = (
        "game",
        "PPO on ocjax",
        "PPO over OCAtari",
        "ratio",
        "workers alone",
        "through VecEnv",
    )
    table = Table(
        title=(
            f"Stable-Baselines3, {n} environments, {os.cpu_count()} cores, {memory}: "
            "agent steps per second"
        ),
        title_justify="left",
    )
    for heading in headings:
        table.add_column(heading, justify="left" if heading == "game" else "right")
    for game in arguments.games:
        ours, peers, alone, through = [], [], [], []
        for _ in range(arguments.rounds):
            ours.append(training_rate(sb3.make_vec_env(game, n, **OPTIONS), seconds))
            peers.append(peer_rate(arguments.python, game, n, seconds))
            rates = stepping_rates(game, n, seconds / 2)
            alone.append(rates[0])
            through.append(rates[1])
        ratio = statistics.median(a / b for a, b in zip(ours, peers, strict=True))
        numbers = [f"{statistics.median(r):,.0f}" for r in (ours, peers, alone, through)]
        table.add_row(game, *numbers[:2], f"{ratio:.2f}", *numbers[2:])
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
