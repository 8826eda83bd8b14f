"""The command `ocjax demo`: step emulators, extract with both methods, and time all of them."""

import contextlib
import dataclasses
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import jax
import numpy as np
import typer
from PIL import Image
from rich.progress import track

from ocjax.cli.gallery import richest
from ocjax.cli.messages import console
from ocjax.cli.options import Terrain
from ocjax.cli.outputs import write_picture
from ocjax.emulators.start import load_playable
from ocjax.envs import AlePool, Settings
from ocjax.evaluation import tables
from ocjax.evaluation.tables import Table
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.files import writing
from ocjax.transforms.drawing import HIDDEN, overlay, pixels, sheet

FRAME_SKIP = 4  # emulated frames per agent step
ROWS = 3  # instances in the picture


def demo(
    game: Annotated[str, typer.Argument(help="Name of the game.")] = "MsPacman",
    num_envs: Annotated[int, typer.Option("--envs", min=1, help="Number of instances.")] = 64,
    steps: Annotated[int, typer.Option(min=1, help="Agent steps of each instance.")] = 250,
    seed: Annotated[int, typer.Option(min=0, help="Seed of actions and emulators.")] = 0,
    out: Annotated[
        Path | None, typer.Option(help="Picture to write. Default: ocjax-<Game>.png.")
    ] = None,
    terrain: Terrain = False,
) -> None:
    """Play a game with random actions, time both extraction methods, and draw their objects."""
    spec = load_playable(game)
    if terrain:
        spec.require_terrain()
    out = out or writing.unnamed(Path(f"ocjax-{spec.name}.png"))
    writing.check(out, suffixes=(".png",))
    result = run(spec, num_envs, steps, seed)
    tables.show(to_table(result), console)
    console.print(
        "First call, compilation included: "
        + ", ".join(f"{name} {s:.2f} s" for name, s in result.first_call.items())
    )
    write_picture(
        out,
        picture(result, terrain),
        "Objects on the last frames, REM beside VEM, and their pixels",
    )


@dataclasses.dataclass(frozen=True)
class Demonstration:
    """The measurements and the last extracted objects of a demonstration.

    Args:
        seconds: float `[steps]` for "step" (all emulators), "REM" and "VEM" (whole batch).
        first_call: seconds of each method's first call.
        frames, rams: the last ones, uint8 `[instances, H, 160]` and `[instances, 128]`.
        objects: each method's last ones, batch shape `[instances]`.
    """

    game: Game
    seconds: dict[str, np.ndarray]
    first_call: dict[str, float]
    frames: np.ndarray
    rams: np.ndarray
    objects: dict[str, Objects]


def run(game: Game, num_envs: int, steps: int, seed: int) -> Demonstration:
    """Step instances with random actions and the seeds `seed + i`, and extract each step."""
    with contextlib.closing(
        AlePool(game, num_envs, Settings(frame_skip=FRAME_SKIP), screens=("screen",))
    ) as pool:
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
        for action in track(
            actions, description=f"playing {game.name}", console=console, transient=True
        ):
            seconds["step"].append(_timed(pool.step, action)[0])
            for name, (extract, source) in methods.items():
                spent, objects[name] = _timed(extract, source)
                seconds[name].append(spent)
        on_host = {name: jax.tree.map(np.asarray, o) for name, o in objects.items()}
        return Demonstration(
            game,
            {k: np.array(v) for k, v in seconds.items()},
            first_call,
            np.array(pool.screen[:, 1]),
            np.array(pool.ram),
            on_host,
        )


def _timed(f: Callable[..., Any], *arguments: Any) -> tuple[float, Any]:
    """Call a function, and return the seconds until its result is computed, and the result."""
    start = time.perf_counter()
    result = jax.block_until_ready(f(*arguments))
    return time.perf_counter() - start, result


def to_table(shown: Demonstration) -> Table:
    """Rates of emulation and extraction."""
    num_envs = len(shown.frames)
    steps = shown.seconds["step"]
    step = float(np.median(steps))
    title = (
        f"{shown.game.name}: {num_envs} instances, {len(steps)} steps of {FRAME_SKIP} emulated "
        "frames, random actions"
    )
    rate = f"{num_envs / step:,.0f} agent steps"
    rows = [
        ["step", f"{1e3 * step:.2f} ms", _spread(steps, 1e3), rate, "100 %"],
        ["", "", "", f"{num_envs * FRAME_SKIP / step:,.0f} emulated frames", ""],
    ]
    for name in ("REM", "VEM"):
        median = float(np.median(shown.seconds[name]))
        rows.append(
            [
                f"{name} per frame",
                f"{1e6 * median / num_envs:.2f} us",
                _spread(shown.seconds[name], 1e6 / num_envs),
                f"{num_envs / median:,.0f} frames",
                f"{100 * median / step:.2f} %",
            ]
        )
    return Table(title, ["", "median", "10-90 %", "per second", "of step"], rows)


def _spread(seconds: Sequence[float] | np.ndarray, unit: float) -> str:
    low, high = np.percentile(seconds, [10, 90]) * unit
    return f"{low:.2f}-{high:.2f}"


def picture(shown: Demonstration, with_terrain: bool = False) -> Image.Image:
    """Draw the objects of both methods, and REM's objects' pixels, in the richest last frames."""
    game, frames = shown.game, shown.frames
    chosen = richest(game, shown.objects["REM"], frames, min(ROWS, len(frames)))
    return sheet(
        [_row(shown, i, with_terrain) for i in chosen],
        [f"{game.name}: REM (from RAM; {HIDDEN})", "VEM (from pixels)", "Pixels of objects"],
    )


def _row(shown: Demonstration, i: int, with_terrain: bool) -> list[Image.Image]:
    """The pictures of an instance: objects by REM, by VEM, and their pixels."""
    game, frame = shown.game, shown.frames[i]
    rem, vem = shown.objects["REM"][i], shown.objects["VEM"][i]
    by_ram = game.terrain_of(shown.rams[i]) if with_terrain else None
    by_pixels = game.terrain_in(frame) if with_terrain else None
    return [
        overlay(game, frame, rem, terrain=by_ram),
        overlay(game, frame, vem, terrain=by_pixels),
        pixels(game, frame, rem),
    ]
