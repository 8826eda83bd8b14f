"""Measure `ocjax extract` from file to file, and the time of `ocjax dataset`.

    python benchmarks/recordings.py [GAME ...] [--states 10000000] [--out npz] [--ocatari PYTHON]
        [--dataset-states 10000]

The measurements are RAM states per second, peak memory and interruptions. The input is an .npy file
in a temporary folder with the repeated states of the game's tests. Each extraction runs in a
separate process, so times include start-up and compilation. Peak memory is also measured for a
tenth of the states. Another extraction is killed half-way and resumed, and its output is compared
with the uninterrupted one byte by byte. PYTHON is an interpreter that has OCAtari, which extracts
2,000 of the states from memory. The OCAtari paper gives 3 minutes for the dataset of a game.
"""

import argparse
import filecmp
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

import ocjax
from ocjax import recordings
from ocjax.evaluation import ocatari_peer
from ocjax.files.pipeline import BLOCK_ROWS

DATA = Path(__file__).parent.parent / "tests" / "data"
PEER_STATES = 2000
CHUNK = 100_000  # states written at a time
HEADINGS = (
    "game",
    "slots",
    "seconds",
    "states/s",
    "peak MB",
    "of a tenth",
    "output MB",
    "OCAtari",
    "ratio",
    "killed, resumed",
    "dataset, s",
)


class Run(NamedTuple):
    """The time and memory of a command."""

    seconds: float
    peak: float  # MB


def write_states(path: Path, game: str, n: int) -> None:
    """Write n states of a game to an .npy file."""
    rams = np.resize(recordings.read(DATA / f"{game}.npz", game).rams, (CHUNK, 128))
    with path.open("wb") as file:
        np.lib.format.write_array_header_1_0(
            file, {"descr": "|u1", "fortran_order": False, "shape": (n, 128)}
        )
        for start in range(0, n, CHUNK):
            file.write(rams[: n - start].data)


def start(*arguments: str | Path) -> subprocess.Popen[bytes]:
    """Start an `ocjax` command."""
    return subprocess.Popen(
        [sys.executable, "-m", "ocjax", *map(str, arguments)], stdout=subprocess.DEVNULL
    )


def run(*arguments: str | Path) -> Run:
    """Run an `ocjax` command."""
    begin = time.perf_counter()
    _, status, usage = os.wait4(start(*arguments).pid, 0)
    if status:
        raise SystemExit(f"{' '.join(map(str, arguments))} failed with status {status}")
    return Run(time.perf_counter() - begin, usage.ru_maxrss / 1000)


def kill_and_resume(source: Path, out: Path, n: int) -> None:
    """Extract, kill the process after half of the blocks, and extract the missing blocks."""
    process, parts = start("extract", source, "--out", out), out.with_name(f"{out.name}.parts")
    while len(list(parts.glob("0*.npz"))) < n // BLOCK_ROWS["rem"] // 2:
        if process.poll() is not None:
            raise SystemExit(f"{source}: the extraction ended before it could be killed")
        time.sleep(0.01)
    process.kill()
    if process.wait() == 0:
        raise SystemExit(f"{source}: the extraction ended before it could be killed")
    run("extract", source, "--out", out)


def peer_rate(game: str, python: Path) -> float:
    """States per second of OCAtari's REM."""
    recording = recordings.read(DATA / f"{game}.npz", game)
    picks = np.arange(PEER_STATES) % len(recording)
    assert recording.screens is not None
    tape = recordings.Recording(recording.game, recording.rams[picks], recording.screens[picks])
    return 1e6 / float(np.mean(ocatari_peer.run(tape, python)["rem"].us))


def measure(game: str, arguments: argparse.Namespace) -> Sequence[str]:
    """The row of a game."""
    n = arguments.states
    with tempfile.TemporaryDirectory() as name:
        source, out, resumed = (
            Path(name, file) for file in (f"{game}.npy", f"a.{arguments.out}", f"b.{arguments.out}")
        )
        write_states(source, game, n // 10)
        small = run("extract", source, "--out", out)
        write_states(source, game, n)
        whole = run("extract", source, "--out", out)
        kill_and_resume(source, resumed, n)
        size, same = (
            out.stat().st_size / 1e6,
            "equal" if filecmp.cmp(out, resumed, shallow=False) else "DIFFERENT",
        )
        dataset = run(
            "dataset",
            game,
            "--states",
            str(arguments.dataset_states),
            "--out",
            Path(name, "dataset"),
        )
    rate = n / whole.seconds
    theirs = peer_rate(game, arguments.ocatari) if arguments.ocatari else None
    cells = [
        game,
        str(ocjax.load(game).num_slots),
        f"{whole.seconds:.1f}",
        f"{rate:,.0f}",
        f"{whole.peak:,.0f}",
        f"{small.peak:,.0f}",
    ]
    peer = ["-", "-"] if theirs is None else [f"{theirs:,.0f}", f"{rate / theirs:.1f}"]
    return [*cells, f"{size:,.0f}", *peer, same, f"{dataset.seconds:.0f}"]


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("games", nargs="*", default=["Pong", "SpaceInvaders"])
    parser.add_argument("--states", type=int, default=10_000_000)
    parser.add_argument("--out", default="npz", help="suffix of the output")
    parser.add_argument(
        "--ocatari", metavar="PYTHON", type=Path, help="an interpreter that has OCAtari"
    )
    parser.add_argument("--dataset-states", type=int, default=10_000)
    arguments = parser.parse_args()
    table = Table(
        title=(
            f"{arguments.states:,} states to .{arguments.out}; a dataset of "
            f"{arguments.dataset_states:,}"
        ),
        title_justify="left",
    )
    for heading in HEADINGS:
        table.add_column(heading, justify="left" if heading == "game" else "right")
    for game in arguments.games:
        table.add_row(*measure(game, arguments))
    Console(width=160).print(table)


if __name__ == "__main__":
    main()
