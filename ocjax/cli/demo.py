"""The demonstration `ocjax demo`: step emulators, extract with both methods, and measure how long each takes."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from typing import Any

import jax
import numpy as np
from PIL import Image
from rich.console import Console
from rich.progress import track
from rich.table import Table

from ocjax.envs import AlePool, Settings
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.transforms.drawing import overlay, sheet

FRAME_SKIP = 4  # emulated frames per agent step
ROWS = 3  # instances in the picture


@dataclasses.dataclass(frozen=True)
class Demo:
    """The measurements of a demonstration, and the last objects that it extracted.

    Args:
        game: the game.
        seconds: float `[steps]` for "step" (all emulators), "REM" and "VEM" (whole batch).
        first_call: seconds of the first call of each method, compilation included.
        frames: uint8 `[instances, H, 160]`, the last frames.
        objects: what each method extracted last, batch shape `[instances]`.
    """

    game: Game
    seconds: dict[str, np.ndarray]
    first_call: dict[str, float]
    frames: np.ndarray
    objects: dict[str, Objects]


def run(game: Game, num_envs: int, steps: int, seed: int, console: Console) -> Demo:
    """Step instances of a game with random actions, and extract from each step with both methods.

    Args:
        game: the game.
        num_envs: number of instances.
        steps: agent steps of each instance.
        seed: seed of the actions; the instances have seeds from here on.
        console: where progress is shown.
    """
    pool = AlePool(game, num_envs, Settings(frame_skip=FRAME_SKIP), screens=("screen",))
    try:
        with console.status(f"starting {num_envs} instances of {game.name}"):
            pool.reset([seed + i for i in range(num_envs)])
        methods = {"REM": (game.rem, pool.ram), "VEM": (game.vem, pool.screen[:, 1])}
        first_call = {}
        for name, (extract, source) in methods.items():
            with console.status(f"compiling {name}"):
                first_call[name] = _timed(extract, source)[0]
        actions = np.random.default_rng(seed).integers(len(pool.actions), size=(steps, num_envs))
        seconds: dict[str, list[float]] = {"step": [], "REM": [], "VEM": []}
        objects: dict[str, Objects] = {}
        for action in track(actions, description=f"playing {game.name}", console=console, transient=True):
            seconds["step"].append(_timed(_step, pool, action)[0])
            for name, (extract, source) in methods.items():
                spent, objects[name] = _timed(extract, source)
                seconds[name].append(spent)
        on_host = {name: jax.tree.map(np.asarray, o) for name, o in objects.items()}
        return Demo(game, {k: np.array(v) for k, v in seconds.items()}, first_call, np.array(pool.screen[:, 1]), on_host)
    finally:
        pool.close()


def _step(pool: AlePool, action: np.ndarray) -> None:
    pool.send(action)
    pool.wait()


def _timed(f: Callable[..., Any], *arguments: Any) -> tuple[float, Any]:
    """Seconds of a call, and its result once it is computed."""
    start = time.perf_counter()
    result = jax.block_until_ready(f(*arguments))
    return time.perf_counter() - start, result


def to_table(demo: Demo) -> Table:
    """Rates of emulation and extraction."""
    num_envs, step = len(demo.frames), float(np.median(demo.seconds["step"]))
    table = Table(
        title=f"{demo.game.name}: {num_envs} instances, {len(demo.seconds['step'])} steps of {FRAME_SKIP} emulated frames, random actions",
        title_justify="left",
    )
    for heading in ("", "median", "10-90 %", "per second", "of step"):
        table.add_column(heading, justify="right" if heading else "left")
    table.add_row("step", f"{1e3 * step:.2f} ms", _spread(demo.seconds["step"], 1e3), f"{num_envs / step:,.0f} agent steps", "100 %")
    table.add_row("", "", "", f"{num_envs * FRAME_SKIP / step:,.0f} emulated frames")
    for name in ("REM", "VEM"):
        median = float(np.median(demo.seconds[name]))
        table.add_row(
            f"{name} per frame",
            f"{1e6 * median / num_envs:.2f} us",
            _spread(demo.seconds[name], 1e6 / num_envs),
            f"{num_envs / median:,.0f} frames",
            f"{100 * median / step:.2f} %",
        )
    return table


def _spread(seconds: Sequence[float] | np.ndarray, unit: float) -> str:
    low, high = np.percentile(seconds, [10, 90]) * unit
    return f"{low:.2f}-{high:.2f}"


def picture(demo: Demo) -> Image.Image:
    """The last frames of some instances with the objects of both methods drawn over them, REM on the left."""
    instances = np.linspace(0, len(demo.frames) - 1, min(ROWS, len(demo.frames))).astype(int)
    rows = [[overlay(demo.game, demo.frames[i], demo.objects[name][i]) for name in ("REM", "VEM")] for i in instances]
    return sheet(rows, [f"{demo.game.name}: REM (from RAM)", "VEM (from pixels)"])
