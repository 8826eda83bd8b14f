"""The targets of the searches: the objects that VEM detects or that the video chip draws."""

import dataclasses
from collections import Counter

import jax
import numpy as np

from ocjax.extraction.categories import Category
from ocjax.extraction.detection import detect
from ocjax.extraction.objects import Objects
from ocjax.recordings import Recording
from ocjax.vision.rules import Blobs

# moving graphics objects, by their bit in `Recording.shown`
CHIP = {
    1: "Player0",
    2: "Missile0",
    4: "Player1",
    8: "Missile1",
    16: "Ball",
}
CHIP_SLOTS = 8  # pieces of each
LOOKS = 255  # distinguished pictures; rarer ones share the last number


@dataclasses.dataclass(frozen=True)
class Target:
    """The numbers of one category's objects in `n` samples, to be explained by RAM.

    Unlike `Detections`, a target has slots, values and looks, and records whether its slots are
    identities.

    Args:
        name: name of the category.
        place: whether slots are identities. If so, each slot is explained separately. Otherwise the
            category's boxes are a set.
        xywh: int `[n, slots, 4]`.
        valid: bool `[n, slots]`.
        value: int `[n, slots]`, or None if the category has no readable value. `UNKNOWN_VALUE` if
            VEM cannot read it.
        look: int `[n, slots]`, number of the picture in the box, counted from the most frequent
            one; -1 for empty slots.
    """

    name: str
    place: bool
    xywh: np.ndarray
    valid: np.ndarray
    value: np.ndarray | None
    look: np.ndarray


def from_vem(recording: Recording) -> list[Target]:
    """The objects that the game's vision rules detect."""
    assert recording.screens is not None
    game = recording.game
    vem: Objects = jax.tree.map(np.asarray, game.vem(recording.screens))
    out = []
    for c in game.categories:
        s = game.slices[c.name]
        xywh, valid = np.asarray(vem.xywh)[:, s].astype(int), np.asarray(vem.valid)[:, s]
        reads_value = getattr(c.rule, "value", None) is not None
        place = c.count == 1 or not isinstance(c.rule, Blobs)
        look = (
            _looks(recording.screens, xywh, valid)
            if recording.screens.ndim == 3
            else np.zeros(valid.shape, int)
        )
        out.append(
            Target(
                c.name,
                place,
                xywh,
                valid,
                np.asarray(vem.value[:, s]) if reads_value else None,
                look,
            )
        )
    return out


def from_chip(recording: Recording) -> list[Target]:
    """The connected pixels of the video chip's sprites. This needs no vision rules."""
    if recording.shown is None:
        raise ValueError("the recording lacks the video chip's sprites (an array 'shown')")
    categories = tuple(
        Category(name, Blobs((bit,)), count=CHIP_SLOTS) for bit, name in CHIP.items()
    )
    found_on = jax.jit(lambda frames: detect(categories, frames))
    out = []
    for c, found in zip(categories, found_on(recording.shown), strict=True):
        xywh = np.stack([found.x, found.y, found.w, found.h], axis=-1).swapaxes(0, 1)
        valid = np.asarray(found.valid).T
        out.append(
            Target(c.name, False, xywh * valid[..., None], valid, None, np.zeros(valid.shape, int))
        )
    return out


def _looks(screens: np.ndarray, xywh: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Number the pictures in boxes.

    A picture is the mask of pixels with the box's most common colour.
    """
    out, pictures = np.full(valid.shape, -1), {}
    for i, k in zip(*np.nonzero(valid), strict=True):
        x, y, w, h = xywh[i, k]
        crop = screens[i, y : y + h, x : x + w]
        background = np.bincount(crop.ravel(), minlength=256).argmax()
        pictures[i, k] = bytes((w, h)) + (crop == background).tobytes()
    numbers = {
        picture: min(n, LOOKS)
        for n, (picture, _) in enumerate(Counter(pictures.values()).most_common())
    }
    for place, picture in pictures.items():
        out[place] = numbers[picture]
    return out
