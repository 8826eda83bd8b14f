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

METHODS = {"rem": ("REM",), "vem": ("VEM",), "both": ("REM", "VEM")}
FRAME_TIME = 120  # milliseconds per frame of an animation


def extract(recording: Recording, methods: Sequence[str], samples: slice) -> dict[str, Objects]:
    """Objects of some samples of a recording with frames, for each of the methods "REM" and "VEM"."""
    assert recording.screens is not None
    sources = {"REM": (recording.game.rem, recording.rams), "VEM": (recording.game.vem, recording.screens)}
    return {name: jax.tree.map(np.asarray, sources[name][0](sources[name][1][samples])) for name in methods}


def pictures(recording: Recording, objects: Mapping[str, Objects], samples: slice, scale: int) -> Iterator[Image.Image]:
    """Draw samples of a recording, the methods side by side."""
    assert recording.screens is not None
    for i, frame in enumerate(recording.screens[samples]):
        titles = [f"{recording.game.name} {samples.start + i}: {method}" for method in objects]
        yield sheet([[overlay(recording.game, frame, o[i], scale=scale) for o in objects.values()]], titles)


def save(images: Sequence[Image.Image], path: Path, *, frame_time: int = FRAME_TIME) -> None:
    """Write one picture, or several as an animated .gif with so many milliseconds per frame."""
    if path.suffix == ".gif":
        animation = {"save_all": True, "append_images": images[1:], "duration": frame_time, "loop": 0}
        writing.write(path, lambda file: images[0].save(file, "GIF", **animation))
    else:
        writing.write_picture(path, images[0])
