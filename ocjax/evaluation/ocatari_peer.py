"""Run OCAtari 2.2.1 on recorded samples, in another environment: it requires numpy < 2."""

import dataclasses
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs

from ocjax.evaluation import matching, ocatari_peer_program
from ocjax.evaluation.matching import Detections
from ocjax.recordings import Recording

VERSION = "2.2.1"
REQUIREMENTS = (f"ocatari=={VERSION}", "ale-py", "numpy<2")
END_OF_LOG = 2000  # characters of a failed process's output that an error quotes


class OcatariError(OSError):
    """OCAtari could not be installed or run."""


@dataclasses.dataclass(frozen=True)
class OcatariMethod:
    """The result of one of OCAtari's two methods on a recording.

    Args:
        objects: the detected objects, or None if the method does not run.
        us: float `[frames]`, microseconds of each detection.
        error: the exception that stopped it; "" if it runs.
    """

    objects: Detections | None
    us: np.ndarray
    error: str


def interpreter(environment: Path | None = None) -> Path:
    """The Python interpreter of an environment with OCAtari.

    It is created if needed (about a gigabyte, some minutes).

    Args:
        environment: folder of a virtual environment; by default in the user's cache.
    """
    cache = platformdirs.user_cache_path("ocjax", appauthor=False)
    folder = environment or cache / f"ocatari-{VERSION}"
    python = folder / ("Scripts" if os.name == "nt" else "bin") / "python"
    if (
        python.exists()
        and subprocess.run([python, "-c", "import ocatari"], capture_output=True).returncode == 0
    ):
        return python
    for command in (
        [sys.executable, "-m", "venv", folder],
        [python, "-m", "pip", "install", "-q", *REQUIREMENTS],
    ):
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            raise OcatariError(
                f"OCAtari could not be installed in {folder}:\n{done.stderr[-END_OF_LOG:]}"
            )
    return python


def run(recording: Recording, python: Path) -> dict[str, OcatariMethod]:
    """Detect objects with OCAtari's methods, including the HUD, on the samples of a recording.

    Args:
        python: from `interpreter`.

    Returns:
        The results of "rem" and "vem". Their categories are the game's, then further ones of
        OCAtari.
    """
    if recording.screens is None:
        raise ValueError(
            "the recording has no frames, which OCAtari's VEM needs: record it with screens"
        )
    screens = (
        recording.screens
        if recording.screens.ndim == 4
        else recording.game.palette[recording.screens]
    )
    resets = np.zeros(len(recording), bool) if recording.resets is None else recording.resets
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "samples.npz"
        np.savez(path, rams=recording.rams, screens=screens, resets=resets)
        done = subprocess.run(
            [python, ocatari_peer_program.__file__, path, recording.game.name],
            capture_output=True,
            text=True,
        )
    if done.returncode:
        raise OcatariError(f"OCAtari failed on {recording.game.name}:\n{done.stderr[-END_OF_LOG:]}")
    out = {}
    for method, answer in json.loads(done.stdout.splitlines()[-1]).items():
        frames = answer.get("objects")
        objects = None if frames is None else matching.from_records(_sized(frames), recording.game)
        out[method] = OcatariMethod(
            objects, np.array(answer.get("us", ())), answer.get("error", "")
        )
    return out


def _sized(frames: list[list[list[Any]]]) -> list[list[list[Any]]]:
    """The records with sizes of at least 0; OCAtari's REM gives negative heights in some states."""
    return [[[name, x, y, max(w, 0), max(h, 0)] for name, x, y, w, h in frame] for frame in frames]
