"""OCAtari 2.2.1 on the same frames, for comparison, in an environment of its own: it needs numpy < 2."""

import dataclasses
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from ocjax import _peer, evaluation
from ocjax.evaluation import Detections
from ocjax.recordings import Recording
from ocjax.vision.palette import NTSC

REQUIREMENTS = ("ocatari==2.2.1", "ale-py", "numpy<2")


class PeerError(RuntimeError):
    """OCAtari could not be installed or run; the message says why."""


@dataclasses.dataclass(frozen=True)
class PeerMethod:
    """What one of OCAtari's methods did."""

    objects: Detections | None  # None where it does not run
    us: np.ndarray  # microseconds of each detection
    error: str  # what it ended with, "" where it ran


def default_environment() -> Path:
    """Where the environment is kept when none is given."""
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "ocjax" / "ocatari-2.2.1"


def interpreter(environment: Path | None = None) -> Path:
    """The Python of an environment with OCAtari, which is made where there is none (about a gigabyte, minutes).

    Args:
        environment: folder of a virtual environment; by default one in the user's cache.

    Raises:
        PeerError: it could not be made.
    """
    folder = environment or default_environment()
    python = folder / ("Scripts" if os.name == "nt" else "bin") / "python"
    if python.exists() and subprocess.run([python, "-c", "import ocatari"], capture_output=True).returncode == 0:
        return python
    for command in ([sys.executable, "-m", "venv", folder], [python, "-m", "pip", "install", "-q", *REQUIREMENTS]):
        run = subprocess.run(command, capture_output=True, text=True)
        if run.returncode:
            raise PeerError(f"OCAtari could not be installed in {folder}:\n{run.stderr[-2000:]}")
    return python


def run(recording: Recording, python: Path) -> dict[str, PeerMethod]:
    """OCAtari's objects, display included, on the samples of a recording.

    Args:
        recording: with frames.
        python: an interpreter that has OCAtari (`interpreter`).

    Returns:
        For "rem" and "vem" what it found; their categories are the game's, followed by those that only OCAtari has.

    Raises:
        PeerError: the process failed.
        ValueError: the recording has no frames.
    """
    if recording.screens is None:
        raise ValueError("the recording has no frames: OCAtari's VEM has nothing to see")
    screens = recording.screens if recording.screens.ndim == 4 else NTSC[recording.screens]
    resets = np.zeros(len(recording), bool) if recording.resets is None else recording.resets
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "samples.npz"
        np.savez(path, rams=recording.rams, screens=screens, resets=resets)
        done = subprocess.run([python, _peer.__file__, path, recording.game.name], capture_output=True, text=True)
    if done.returncode:
        raise PeerError(f"OCAtari failed on {recording.game.name}:\n{done.stderr[-2000:]}")
    out = {}
    for method, answer in json.loads(done.stdout.splitlines()[-1]).items():
        objects = evaluation.from_records(answer["objects"], recording.game) if "objects" in answer else None
        out[method] = PeerMethod(objects, np.array(answer.get("us", ())), answer.get("error", ""))
    return out
