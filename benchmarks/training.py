"""Agent steps per second of complete training, beside Stable-Baselines3's PPO over OCAtari.

    python benchmarks/training.py [GAME ...] [--rounds 3] [--seconds 20] [--ocatari PYTHON]
        [--pixels]

Needs the extra `rl`. PYTHON is an interpreter that has OCAtari and Stable-Baselines3. Each round
measures both, after their first updates, which include compilation. Stable-Baselines3 has the
OCAtari paper's 8 environments and hyperparameters. Rates are medians over the rounds. Times per
agent step are processor times, each measured alone.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from _page import freed_memory
from rich.console import Console
from rich.table import Table

import ocjax
from ocjax.agents import networks, ppo
from ocjax.agents.ppo import Hyperparameters
from ocjax.agents.training import Config, Trainer

PEER_ENVS = 8
WARM_UP = 3  # updates


def training_rate(game: str, inputs: Any, seconds: float) -> float:
    """Agent steps per second of `ocjax train`."""
    with tempfile.TemporaryDirectory() as folder:
        trainer = Trainer(Config(game, inputs=inputs), Path(folder) / "run")
        steps = trainer.config.hyperparameters.num_envs * trainer.config.hyperparameters.horizon
        frames, quiet = trainer.frames_per_update, Console(quiet=True)
        trainer.run(WARM_UP * frames, quiet)
        updates = max(1, round(seconds * trainer.metrics.frames_per_second / frames))
        start = time.perf_counter()
        trainer.run(trainer.frames + updates * frames, quiet)  # with one checkpoint, at the end
        rate = updates * steps / (time.perf_counter() - start)
        trainer.close()
    return rate


def peer_rate(python: str, game: str, seconds: float) -> float | None:
    """Agent steps per second of Stable-Baselines3's PPO over OCAtari, or None on failure."""
    command = [
        python,
        str(Path(__file__).parent / "_sb3_ocatari.py"),
        game,
        str(PEER_ENVS),
        str(seconds),
    ]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    if run.returncode:
        print(f"{game}: OCAtari failed: {run.stderr.strip().splitlines()[-1]}", file=sys.stderr)
        return None
    return float(run.stdout.split()[-1])


def _processor_time() -> float:
    own = os.times()
    return own.user + own.system


def _stepping(game: str, steps: int, **options: Any) -> float:
    """Seconds of processor time per agent step of environments without worker processes."""
    h = Hyperparameters()
    envs = ocjax.make_vec(game, h.num_envs, preset="dqn", num_workers=0, **options)
    envs.reset(seed=0)
    rng, start = np.random.default_rng(0), 0.0
    for t in range(steps + 5):
        if t == 5:
            start = _processor_time()
        envs.step(rng.integers(len(envs.pool.actions), size=h.num_envs))
    spent = _processor_time() - start
    envs.close()
    return spent / steps / h.num_envs


def _timed(f: Callable[[], Any], repeats: int) -> float:
    """Seconds of processor time of a call, after the first one."""
    jax.block_until_ready(f())
    start = _processor_time()
    for _ in range(repeats):
        jax.block_until_ready(f())
    return (_processor_time() - start) / repeats


def shares(game: str) -> dict[str, float]:
    """Seconds of processor time per agent step of each part of a training from objects."""
    h, rng, config = Hyperparameters(), np.random.default_rng(0), Config(game)
    vector = config.vector
    emulator = _stepping(game, 60, mode="raw")
    extraction = _stepping(game, 60, obs=vector, hud=False) - emulator
    spec = ocjax.load(game, hud=False)
    (inputs,), n = vector.space(spec, "rem").shape, h.num_envs  # pyright: ignore[reportGeneralTypeIssues]
    num_actions = 6
    network = networks.deep_sets(config.groups, num_actions)
    learner = ppo.init(network, h, 1, 0)
    act, update = (
        ppo.make_act(network, standardize=False),
        ppo.make_update(network, h, standardize=False),
    )
    obs, key = (
        rng.normal(size=(h.horizon + 1, n, inputs)).astype(np.float32),
        jax.random.key_data(jax.random.key(0)),
    )
    no = np.zeros((h.horizon, n), bool)
    zeros = np.zeros((h.horizon, n), np.float32)
    rollout = ppo.Rollout(obs, no.astype(np.int32), zeros - 1.8, zeros, no, no, no)
    half = n // 2
    policy = (
        _timed(lambda: act(learner.params, learner.inputs, obs[0, :half], key, jnp.int32(0)), 200)
        / half
    )
    updating = _timed(lambda: update(learner, learner.inputs, rollout, jnp.float32(1)), 5) / (
        h.horizon * n
    )
    return {
        "emulator": emulator,
        "extraction": max(extraction, 0.0),
        "policy": policy,
        "update": updating,
    }


def main() -> None:
    """Measure and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", default=["Pong", "SpaceInvaders"])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=20.0, help="duration of each measurement")
    parser.add_argument(
        "--ocatari", metavar="PYTHON", help="an interpreter that has OCAtari and Stable-Baselines3"
    )
    parser.add_argument("--pixels", action="store_true", help="also train from pixels")
    arguments = parser.parse_args()
    memory = freed_memory()
    console = Console(width=140)
    rates = Table(
        title=f"Training, {os.cpu_count()} cores, {memory}: agent steps per second",
        title_justify="left",
    )
    for heading in (
        "game",
        "ocjax, objects",
        "ocjax, pixels",
        "Stable-Baselines3 over OCAtari",
        "ratio",
    ):
        rates.add_column(heading, justify="left" if heading == "game" else "right")
    parts = Table(title="Processor time per agent step, microseconds", title_justify="left")
    for heading in ("game", "emulator", "extraction", "policy", "update"):
        parts.add_column(heading, justify="left" if heading == "game" else "right")
    for game in arguments.games:
        ours, pixels, peers = [], [], []
        for _ in range(arguments.rounds):
            ours.append(training_rate(game, "objects", arguments.seconds))
            if arguments.pixels:
                pixels.append(training_rate(game, "pixels", arguments.seconds))
            measured = (
                peer_rate(arguments.ocatari, game, arguments.seconds) if arguments.ocatari else None
            )
            peers += [] if measured is None else [measured]
        ratio = (
            statistics.median(a / b for a, b in zip(ours, peers, strict=False)) if peers else None
        )
        shown = [f"{statistics.median(r):,.0f}" if r else "-" for r in (ours, pixels, peers)]
        rates.add_row(game, *shown, "-" if ratio is None else f"{ratio:.1f}")
        spent = shares(game)
        total = sum(spent.values())
        parts.add_row(
            game, *(f"{1e6 * seconds:.1f} ({seconds / total:.0%})" for seconds in spent.values())
        )
    console.print(rates)
    console.print(parts)


if __name__ == "__main__":
    main()
