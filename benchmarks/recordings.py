"""RAM states per second of `ocjax extract` from file to file, and its peak memory, beside a loop over OCAtari.

    python benchmarks/recordings.py [GAME ...] [--states 10000000] [--out npz] [--ocatari PYTHON]

The input is an .npy file in a temporary folder: the recorded states of the game's tests, again and again. Each extraction is a process of
its own, so times include start-up and compilation. Peak memory is measured for a tenth of the states, too. PYTHON is an interpreter that
has OCAtari, which extracts 2,000 of the states from memory.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import ocjax
from ocjax import ocatari_runner, recordings

DATA = Path(__file__).parent.parent / "tests" / "data"
PEER_STATES = 2000
CHUNK = 100_000  # states that are written at a time


def write_states(path: Path, game: str, n: int) -> None:
    """Write n states of a game to an .npy file."""
    rams = np.resize(recordings.read(DATA / f"{game}.npz", game).rams, (CHUNK, 128))
    with path.open("wb") as file:
        np.lib.format.write_array_header_1_0(file, {"descr": "|u1", "fortran_order": False, "shape": (n, 128)})
        for start in range(0, n, CHUNK):
            file.write(rams[: n - start].data)


def extract(folder: Path, game: str, n: int, suffix: str) -> tuple[float, float, float]:
    """Seconds, peak memory in MB and size of the output in MB of an extraction of n states."""
    source, out = folder / f"{game}.npy", folder / f"objects.{suffix}"
    write_states(source, game, n)
    start = time.perf_counter()
    process = subprocess.Popen([sys.executable, "-m", "ocjax", "extract", source, "--out", out], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - start
    if status:
        raise SystemExit(f"{game}: the extraction failed with status {status}")
    size = out.stat().st_size / 1e6
    out.unlink()
    return seconds, usage.ru_maxrss / 1000, size


def peer_time(game: str, python: Path) -> float:
    """Microseconds per state of OCAtari's REM."""
    recording = recordings.read(DATA / f"{game}.npz", game)
    picks = np.arange(PEER_STATES) % len(recording)
    assert recording.screens is not None
    tape = recordings.Recording(recording.game, recording.rams[picks], recording.screens[picks])
    return float(np.mean(ocatari_runner.run(tape, python)["rem"].us))


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("games", nargs="*", default=["Pong", "SpaceInvaders"])
    parser.add_argument("--states", type=int, default=10_000_000)
    parser.add_argument("--out", default="npz", help="suffix of the output")
    parser.add_argument("--ocatari", metavar="PYTHON", type=Path, help="an interpreter that has OCAtari")
    arguments = parser.parse_args()
    table = Table(title=f"{arguments.states:,} states to .{arguments.out}", title_justify="left")
    for heading in (
        "game",
        "slots",
        "seconds",
        "states a second",
        "peak MB",
        "of a tenth",
        "output MB",
        "OCAtari, states a second",
        "ratio",
    ):
        table.add_column(heading, justify="left" if heading == "game" else "right")
    for game in arguments.games:
        with tempfile.TemporaryDirectory() as folder:
            _, small, _ = extract(Path(folder), game, arguments.states // 10, arguments.out)
            seconds, peak, size = extract(Path(folder), game, arguments.states, arguments.out)
        rate = arguments.states / seconds
        theirs = 1e6 / peer_time(game, arguments.ocatari) if arguments.ocatari else None
        cells = [f"{seconds:.1f}", f"{rate:,.0f}", f"{peak:,.0f}", f"{small:,.0f}", f"{size:,.0f}"]
        cells += ["-", "-"] if theirs is None else [f"{theirs:,.0f}", f"{rate / theirs:.1f}"]
        table.add_row(game, str(ocjax.load(game).num_slots), *cells)
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
