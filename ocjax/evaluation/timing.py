"""Time extraction and environments on this machine, and other installed programs."""

import contextlib
import dataclasses
import importlib.metadata
import importlib.util
import os
import platform
import statistics
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import jax
import numpy as np
from ale_py.vector_env import AtariVectorEnv

from ocjax import _extras
from ocjax.envs import make_vec
from ocjax.evaluation import ocatari_peer
from ocjax.extraction.game import Game
from ocjax.recordings import Recording

BATCHES = {"REM": (1, 64, 4096), "VEM": (1, 64, 1024)}
LEAST_CALLS = 5  # minimum number of calls in a measurement
FRAME_SKIP = 4  # emulated frames per agent step
WITHOUT_OBJECTS = "environment without objects"


@dataclasses.dataclass(frozen=True)
class Measurement:
    """The time of a call that handles a batch.

    Args:
        what: the method or the environment.
        batch: number of states, frames or environments.
        first_call: seconds of the first call, including compilation.
        median: microseconds per state, frame or agent step; the median of repeated calls.
        low, high: the 10th and 90th percentile.
    """

    game: str
    what: str
    batch: int
    first_call: float
    median: float
    low: float
    high: float


@contextlib.contextmanager
def one_core() -> Iterator[None]:
    """Bind this process and its later threads to one core, if the system can do it."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def methods(
    game: Game, rams: np.ndarray, frames: np.ndarray, seconds: float
) -> Iterator[Measurement]:
    """Time REM and VEM on batches of several sizes, filled with the given samples."""
    for what, extract, samples in (("REM", game.rem, rams), ("VEM", game.vem, frames)):
        for batch in BATCHES[what]:
            x = jax.device_put(np.resize(samples, (batch, *samples.shape[1:])))
            yield _measured(
                game,
                what,
                batch,
                lambda extract=extract, x=x: jax.block_until_ready(extract(x)),
                seconds,
            )


def environments(game: Game, num_envs: int, seconds: float) -> Iterator[Measurement]:
    """Time agent steps (four emulated frames) of ocjax, ale-py and, if installed, envpool."""
    made: dict[str, Callable[[], Any]] = {
        WITHOUT_OBJECTS: lambda: make_vec(game, num_envs, mode="raw"),
        "environment with REM": lambda: make_vec(game, num_envs),
        "environment with VEM": lambda: make_vec(game, num_envs, mode="vem"),
        "ale-py's vector environment": lambda: AtariVectorEnv(
            game.rom, num_envs=num_envs, frameskip=FRAME_SKIP
        ),
    }
    if _installed("envpool"):
        made["envpool with REM"] = lambda: make_vec(game, num_envs, backend="envpool")
        made["envpool without objects"] = lambda: _extras.require("envpool").make(
            f"{game.name}-v5", env_type="gymnasium", num_envs=num_envs, frame_skip=FRAME_SKIP
        )
    for what, make in made.items():
        with contextlib.closing(make()) as envs:
            envs.reset()
            space = getattr(envs, "single_action_space", envs.action_space)
            actions = np.random.default_rng(0).integers(space.n, size=(64, num_envs))
            turns = iter(range(1 << 62))
            yield _measured(
                game,
                what,
                num_envs,
                lambda envs=envs, a=actions, t=turns: envs.step(a[next(t) % len(a)]),
                seconds,
            )


def opencv(game: Game, frames: np.ndarray, seconds: float) -> Iterator[Measurement]:
    """Time box detection with OpenCV.

    A mask of each category's colours, and the boxes of its contours.
    """
    if not _installed("cv2"):
        return
    cv2 = _extras.require("cv2")
    cv2.setNumThreads(1)
    tables = [np.isin(np.arange(256), c.rule.palette).astype(np.uint8) for c in game.categories]

    def find() -> None:
        for frame in frames:
            for table in tables:
                outlines, _ = cv2.findContours(
                    cv2.LUT(frame, table), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE
                )
                for outline in outlines:
                    cv2.boundingRect(outline)

    yield _measured(game, "OpenCV's contours", len(frames), find, seconds)


def ocatari(
    game: Game, rams: np.ndarray, frames: np.ndarray, python: Path
) -> Iterator[Measurement]:
    """Time both methods of OCAtari, one state at a time."""
    for method, found in ocatari_peer.run(Recording(game, rams, frames), python).items():
        if not found.error:
            first, spent = found.us[0] / 1e6, found.us[1:].tolist()
            yield _summary(game, f"OCAtari's {method.upper()}", 1, first, spent)


def machine() -> dict[str, Any]:
    """Describe the machine: processor, cores of the process, device, and versions."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    versions = {
        name: importlib.metadata.version(name) for name in ("ocjax", "jax", "ale-py", "numpy")
    }
    return {
        "processor": names[0] if names else platform.processor() or platform.machine(),
        "cores": len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else os.cpu_count(),
        "device": jax.devices()[0].device_kind,
        "python": platform.python_version(),
        **versions,
    }


def _installed(module: str) -> bool:
    return importlib.util.find_spec(module) is not None


def _measured(
    game: Game, what: str, batch: int, call: Callable[[], Any], seconds: float
) -> Measurement:
    start = time.perf_counter()
    call()
    first_call = time.perf_counter() - start
    spent, start = [], time.perf_counter()
    while len(spent) < LEAST_CALLS or time.perf_counter() - start < seconds:
        t = time.perf_counter()
        call()
        spent.append(1e6 * (time.perf_counter() - t) / batch)
    return _summary(game, what, batch, first_call, spent)


def _summary(
    game: Game, what: str, batch: int, first_call: float, spent: list[float]
) -> Measurement:
    deciles = statistics.quantiles(spent, n=10, method="inclusive")
    return Measurement(
        game.name, what, batch, first_call, statistics.median(spent), deciles[0], deciles[-1]
    )
