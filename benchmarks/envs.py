"""Agent steps per second of the environments on all cores.

envpool and Gymnasium's AsyncVectorEnv over OCAtari are measured in the same run.

    python benchmarks/envs.py [GAME ...] [--envs 128] [--rounds 5] [--ocatari PYTHON] [--large 1024]

PYTHON is an interpreter that has OCAtari. Actions are random. Each round measures all environments.
Rates are medians over the rounds, with the lowest and the highest; ratios are medians of the ratios
within rounds. A step emulates four frames. Start-up time and memory are measured once, in a
separate process.
"""

import argparse
import importlib.util
import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from _page import freed_memory
from rich.console import Console
from rich.table import Table

import ocjax

SECONDS = 2.0  # duration of a measurement
PAUSE = 0.5  # seconds before it, for background work of the previous one to end
WARM_UP = 10  # steps
KINDS: dict[str, dict[str, Any]] = {
    "raw": {"mode": "raw"},
    "REM": {"mode": "rem"},
    "REM, vector": {"mode": "rem", "obs": "vector"},
    "REM, binary masks": {"mode": "rem", "obs": "binary_masks"},
    "REM, object masks": {"mode": "rem", "obs": "object_masks"},
    "DQN frames": {"mode": "raw", "obs": "dqn"},
    "VEM": {"mode": "vem"},
}

OCATARI = {mode: f"AsyncVectorEnv over OCAtari, {mode}" for mode in ("ram", "vision")}
# environments for ratios, and headings
REFERENCES = {
    "raw": "to raw",
    "envpool alone": "to envpool",
}
SUMMARY = (
    "REM to raw",
    "REM to envpool alone",
    "VEM to raw",
    *(f"{name} to raw" for name in OCATARI.values()),
)

# step, number of actions, close
Stepper = tuple[Callable[[np.ndarray], Any], int, Callable[[], None]]


def rate(step: Callable[[np.ndarray], Any], num_actions: int, num_envs: int) -> float:
    """Agent steps per second with random actions."""
    rng = np.random.default_rng(0)
    time.sleep(PAUSE)
    for _ in range(WARM_UP):
        step(rng.integers(num_actions, size=num_envs))
    start, steps = time.perf_counter(), 0
    while time.perf_counter() - start < SECONDS:
        step(rng.integers(num_actions, size=num_envs))
        steps += num_envs
    return steps / (time.perf_counter() - start)


def steppers(game: str, n: int) -> dict[str, Stepper]:
    """The environments to measure, by name."""
    from gymnasium.spaces import flatdim

    out: dict[str, Stepper] = {}
    if importlib.util.find_spec("envpool"):
        import envpool

        pool = envpool.make(
            f"{game}-v5", env_type="gymnasium", num_envs=n, num_threads=os.cpu_count() or 1
        )
        pool.reset()
        out["envpool alone"] = (lambda a: pool.step(a), int(pool.action_space.n), pool.close)
        made = ocjax.make_vec(game, n, backend="envpool")
        made.reset(seed=0)
        out["REM on envpool"] = (made.step, flatdim(made.single_action_space), made.close)
    for name, options in KINDS.items():
        envs = ocjax.make_vec(game, n, **options)
        envs.reset(seed=0)
        out[name] = (envs.step, flatdim(envs.single_action_space), envs.close)
    return out


MEMORY = """
import json, sys, time
from pathlib import Path
import ocjax
def pss(pids):
    return sum(int(line.split()[1]) for p in pids for line in open(f"/proc/{p}/smaps_rollup") \
if line.startswith("Pss:"))
n = int(sys.argv[2])
few = ocjax.make_vec(sys.argv[1], 2, num_workers=2)
few.reset(seed=0)
before = pss([w.process.pid for w in few.pool._workers])
few.close()
envs = ocjax.make_vec(sys.argv[1], n, num_workers=2)
start = time.perf_counter()
envs.reset(seed=0)
spent = time.perf_counter() - start
after = pss([w.process.pid for w in envs.pool._workers])
whole = pss([w.process.pid for w in envs.pool._workers] + ["self"])
envs.close()
print(json.dumps([spent, (after - before) / (n - 2) / 1024, whole / 1024]))
"""


def ocatari_rate(python: str, game: str, mode: str, n: int) -> float | None:
    """Agent steps per second of AsyncVectorEnv over OCAtari, or None if OCAtari fails."""
    command = [
        python,
        str(Path(__file__).parent / "_async_ocatari.py"),
        game,
        mode,
        str(n),
        str(SECONDS),
    ]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    if run.returncode:
        print(f"{game}: OCAtari failed: {run.stderr.strip().splitlines()[-1]}", file=sys.stderr)
        return None
    return float(run.stdout.split()[-1])


def measure(game: str, n: int, rounds: int, ocatari: str | None) -> dict[str, list[float]]:
    """Agent steps per second in each round, by environment."""
    rates: dict[str, list[float]] = {}
    environments = steppers(game, n)
    for i in range(rounds):
        for name, (step, num_actions, _) in environments.items():
            rates.setdefault(name, []).append(rate(step, num_actions, n))
        for mode, name in OCATARI.items() if ocatari else ():
            measured = ocatari_rate(str(ocatari), game, mode, n)
            if measured is not None:
                rates.setdefault(name, []).append(measured)
        print(f"{game}: round {i + 1} of {rounds}", file=sys.stderr)
    for _, _, close in environments.values():
        close()
    return rates


def ratios(rates: dict[str, list[float]]) -> dict[str, dict[str, float]]:
    """The median ratios of the rates, by reference and environment."""
    present = [reference for reference in REFERENCES if reference in rates]
    return {
        reference: {
            name: statistics.median(a / b for a, b in zip(values, rates[reference], strict=False))
            for name, values in rates.items()
        }
        for reference in present
    }


def table(
    title: str, rates: dict[str, list[float]], relative: dict[str, dict[str, float]]
) -> Table:
    """The rates and ratios of one game."""
    out = Table(title=title, title_justify="left")
    for heading in ("environments", "median", "lowest-highest", *REFERENCES.values()):
        out.add_column(heading, justify="left" if heading == "environments" else "right")
    for name, values in rates.items():
        compared = (
            f"{relative[reference][name]:.3f}" if reference in relative else ""
            for reference in REFERENCES
        )
        out.add_row(
            name,
            f"{statistics.median(values):,.0f}",
            f"{min(values):,.0f}-{max(values):,.0f}",
            *compared,
        )
    return out


def start_and_memory(game: str, n: int) -> str:
    """Start-up time and memory of many environments, as a sentence."""
    run = subprocess.run(
        [sys.executable, "-c", MEMORY, game, str(n)], capture_output=True, text=True, check=True
    )
    spent, each, whole = json.loads(run.stdout.splitlines()[-1])
    return (
        f"{n} environments of {game}: started in {spent:.1f} s with 2 workers "
        f"({1e3 * spent / n:.0f} ms each), "
        f"{each:.2f} MiB each, {whole:,.0f} MiB in total (proportional set size)"
    )


def main() -> None:
    """Measure and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", default=["Pong", "SpaceInvaders", "MsPacman"])
    parser.add_argument("--envs", type=int, default=128, help="number of environments")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--ocatari", metavar="PYTHON", help="an interpreter that has OCAtari")
    parser.add_argument(
        "--large",
        type=int,
        default=1024,
        help="number of environments whose start and memory are measured; 0 for none",
    )
    arguments = parser.parse_args()
    memory = freed_memory()

    console, n = Console(width=140), arguments.envs
    summary: dict[str, list[float]] = {}
    for game in arguments.games:
        rates = measure(game, n, arguments.rounds, arguments.ocatari)
        relative = ratios(rates)
        for reference, by_name in relative.items():
            for name, ratio in by_name.items():
                summary.setdefault(f"{name} to {reference}", []).append(ratio)
        console.print(
            table(
                f"{game}, {n} environments, {os.cpu_count()} cores, {memory}: "
                "agent steps per second",
                rates,
                relative,
            )
        )
    for name in SUMMARY:
        if name in summary:
            console.print(
                f"{name}: {statistics.geometric_mean(summary[name]):.3f} (geometric mean)"
            )
    if arguments.large:
        console.print(start_and_memory(arguments.games[0], arguments.large))


if __name__ == "__main__":
    main()
