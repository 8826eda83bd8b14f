"""Pictures and animations of the objects of recorded play."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import jax
import numpy as np
from PIL import Image

from ocjax.extraction.objects import Objects
from ocjax.files import writing
from ocjax.recordings import Recording
from ocjax.transforms.drawing import overlay, sheet

FRAME_TIME = 120  # milliseconds per frame
STEP_TIME = 66  # milliseconds per agent step of four emulated frames


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
