"""The command `ocjax render`: pictures and animations of the objects of recorded play."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated

import jax
import numpy as np
import typer
from PIL import Image
from rich.progress import track

from ocjax import recordings
from ocjax.cli.messages import console
from ocjax.cli.options import Terrain
from ocjax.extraction.objects import Objects
from ocjax.files import writing
from ocjax.recordings import Recording
from ocjax.transforms.drawing import overlay, sheet

METHODS = {"rem": ("REM",), "vem": ("VEM",), "both": ("REM", "VEM")}
FRAME_TIME = 120  # milliseconds per frame of an animation


def render(
    recording: Annotated[Path, typer.Argument(help="Recording (.npz) with rams and screens.")],
    out: Annotated[Path, typer.Option(help="A .png of one sample, or a .gif of several.")],
    game: Annotated[
        str | None,
        typer.Option(
            metavar="GAME",
            help="Name of the game. Required if the file and its name do not name it.",
        ),
    ] = None,
    method: Annotated[
        str,
        typer.Option(metavar="rem|vem|both", help="The method; both are drawn side by side."),
    ] = "both",
    first: Annotated[int, typer.Option(min=0, help="First sample to draw.")] = 0,
    count: Annotated[int, typer.Option(min=1, help="Number of samples in a .gif.")] = 50,
    scale: Annotated[int, typer.Option(min=1, max=8, help="Picture pixels per screen pixel.")] = 2,
    terrain: Terrain = False,
) -> None:
    """Draw objects over the frames of a recording."""
    if method not in METHODS:
        raise typer.BadParameter(f"method must be rem, vem or both, got {method!r}")
    writing.check(out, suffixes=(".png", ".gif"), reads=[recording])
    tape = recordings.read(recording, game)
    if tape.screens is None:
        raise typer.BadParameter(f"{recording} has no frames (an array 'screens') to draw on")
    if first >= len(tape):
        raise typer.BadParameter(
            f"{recording} has {len(tape)} samples, so the first to draw cannot be {first}"
        )
    if terrain:
        tape.game.require_terrain()
    samples = slice(first, min(len(tape), first + (count if out.suffix == ".gif" else 1)))
    with console.status("extracting"):
        objects = extract(tape, METHODS[method], samples)
    drawn = pictures(tape, objects, samples, scale, with_terrain=terrain)
    total = samples.stop - samples.start
    images = list(track(drawn, description="drawing", total=total, console=console, transient=True))
    save(images, out)
    writing.announce(console, f"{len(images)} samples of {recording}", out)


def extract(recording: Recording, methods: Sequence[str], samples: slice) -> dict[str, Objects]:
    """Objects of some samples of a recording with frames, by the methods "REM" and "VEM"."""
    assert recording.screens is not None
    sources = {
        "REM": (recording.game.rem, recording.rams),
        "VEM": (recording.game.vem, recording.screens),
    }
    return {
        name: jax.tree.map(np.asarray, sources[name][0](sources[name][1][samples]))
        for name in methods
    }


def pictures(
    recording: Recording,
    objects: Mapping[str, Objects],
    samples: slice,
    scale: int,
    *,
    with_terrain: bool = False,
) -> Iterator[Image.Image]:
    """Draw samples of a recording, the methods side by side."""
    assert recording.screens is not None
    game = recording.game
    for i, (ram, frame) in enumerate(
        zip(recording.rams[samples], recording.screens[samples], strict=True)
    ):
        terrain = game.terrain_of(ram) if with_terrain else None
        titles = [f"{game.name} {samples.start + i}: {method}" for method in objects]
        row = [overlay(game, frame, o[i], scale=scale, terrain=terrain) for o in objects.values()]
        yield sheet([row], titles)


def save(images: Sequence[Image.Image], path: Path, *, frame_time: int = FRAME_TIME) -> None:
    """Write one picture, or several as an animated .gif with `frame_time` ms per frame."""
    if path.suffix == ".gif":
        # Pillow's own choice of colours takes five times as long, and is less accurate.
        first, *others = (
            image.quantize(method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
            for image in images
        )
        animation = {"save_all": True, "append_images": others, "duration": frame_time, "loop": 0}
        writing.write(path, lambda file: first.save(file, "GIF", **animation))
    else:
        writing.write_picture(path, images[0])
