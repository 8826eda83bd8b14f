"""Agent steps a second of the environments, on all cores, beside envpool's and gymnasium's AsyncVectorEnv over OCAtari in the same run.

    python benchmarks/envs.py [GAME ...] [--envs 128] [--rounds 5] [--peer PYTHON] [--large 1024]

PYTHON is the interpreter of an environment that has OCAtari. Actions are random. All kinds of environments take turns, round by round;
a figure is the median over the rounds, the spread their least and most, a ratio the median of the ratios within a round. Emulated
frames are four times the agent steps. What is started, and what memory it takes, is measured once, in processes of its own.
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

SECONDS = 2.0  # of a measurement
PAUSE = 0.5  # before it, for whatever ended just now
KINDS: dict[str, dict[str, Any]] = {
    "raw": {"mode": "raw"},
    "REM": {"mode": "rem"},
    "REM, vector": {"mode": "rem", "obs": "vector"},
    "REM, binary masks": {"mode": "rem", "obs": "binary_masks"},
    "REM, object masks": {"mode": "rem", "obs": "object_masks"},
    "DQN frames": {"mode": "raw", "obs": "dqn"},
    "VEM": {"mode": "vem"},
}

PEER = {mode: f"AsyncVectorEnv over OCAtari, {mode}" for mode in ("ram", "vision")}


def rate(step: Callable[[np.ndarray], Any], num_actions: int, num_envs: int) -> float:
    """Agent steps a second."""
    rng = np.random.default_rng(0)
    time.sleep(PAUSE)
    for _ in range(10):
        step(rng.integers(num_actions, size=num_envs))
    start, steps = time.perf_counter(), 0
    while time.perf_counter() - start < SECONDS:
        step(rng.integers(num_actions, size=num_envs))
        steps += num_envs
    return steps / (time.perf_counter() - start)


def steppers(game: str, n: int) -> dict[str, tuple[Callable[[np.ndarray], Any], int, Callable[[], None]]]:
    """How each kind of environment steps, its number of actions, and how it is closed."""
    from gymnasium.spaces import flatdim

    import ocjax

    out: dict[str, Any] = {}
    if importlib.util.find_spec("envpool"):
        import envpool

        pool = envpool.make(f"{game}-v5", env_type="gymnasium", num_envs=n, num_threads=os.cpu_count() or 1)
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
    return sum(int(line.split()[1]) for p in pids for line in open(f"/proc/{p}/smaps_rollup") if line.startswith("Pss:"))
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


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("games", nargs="*", default=["Pong", "SpaceInvaders", "MsPacman"])
    parser.add_argument("--envs", type=int, default=128)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--peer", help="Python interpreter that has OCAtari")
    parser.add_argument("--large", type=int, default=1024, help="environments whose start and memory are measured; 0: none")
    arguments = parser.parse_args()

    from rich.console import Console
    from rich.table import Table

    console, n = Console(width=140), arguments.envs
    ratios: dict[str, list[float]] = {}
    for game in arguments.games:
        rates: dict[str, list[float]] = {}
        kinds = steppers(game, n)
        for i in range(arguments.rounds):
            for name, (step, num_actions, _) in kinds.items():
                rates.setdefault(name, []).append(rate(step, num_actions, n))
            for mode in ("ram", "vision") if arguments.peer else ():
                command = [arguments.peer, str(Path(__file__).parent / "_async_ocatari.py"), game, mode, str(n), str(SECONDS)]
                run = subprocess.run(command, capture_output=True, text=True, check=False)
                if run.returncode:
                    print(f"{game}: OCAtari failed: {run.stderr.strip().splitlines()[-1]}", file=sys.stderr)
                else:
                    rates.setdefault(PEER[mode], []).append(float(run.stdout.split()[-1]))
            print(f"{game}: round {i + 1} of {arguments.rounds}", file=sys.stderr)
        for _, _, close in kinds.values():
            close()
        table = Table(title=f"{game}, {n} environments, {os.cpu_count()} cores: agent steps a second", title_justify="left")
        for heading in ("environments", "median", "spread", "to raw", "to envpool"):
            table.add_column(heading, justify="left" if heading == "environments" else "right")
        for name, values in rates.items():
            against = {}
            for other in ("raw", "envpool alone"):
                if other in rates:
                    against[other] = statistics.median(a / b for a, b in zip(values, rates[other], strict=False))
                    ratios.setdefault(f"{name} to {other}", []).append(against[other])
            row = [f"{statistics.median(values):,.0f}", f"{min(values):,.0f}-{max(values):,.0f}"]
            table.add_row(name, *row, *(f"{against[o]:.3f}" if o in against else "" for o in ("raw", "envpool alone")))
        console.print(table)
    for name in ("REM to raw", "REM to envpool alone", "VEM to raw", *(f"{name} to raw" for name in PEER.values())):
        if name in ratios:
            console.print(f"{name}: {statistics.geometric_mean(ratios[name]):.3f} (geometric mean)")
    if arguments.large:
        command = [sys.executable, "-c", MEMORY, arguments.games[0], str(arguments.large)]
        run = subprocess.run(command, capture_output=True, text=True, check=True)
        spent, each, whole = json.loads(run.stdout.splitlines()[-1])
        console.print(
            f"{arguments.large} environments of {arguments.games[0]}: started in {spent:.1f} s with 2 workers "
            f"({1e3 * spent / arguments.large:.0f} ms each), {each:.2f} MiB each, {whole:,.0f} MiB in all (proportional set size)"
        )


if __name__ == "__main__":
    main()
