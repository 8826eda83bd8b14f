"""Pictures of the frames on which two methods disagree most."""

import dataclasses
import io

import numpy as np
from PIL import Image, ImageDraw

from ocjax.evaluation.matching import Detections, match
from ocjax.evaluation.metrics import Agreement
from ocjax.recordings import Recording

COUNT = 6  # pictures
DISTANCE = 20  # minimum number of samples between two of them
# Picture pixels per screen pixel, vertically; twice as many horizontally.
SCALE = 2
MISSED, FALSE, AGREED = (255, 40, 40), (255, 220, 0), (150, 150, 150)
COLORS_IN_FILE = 64


@dataclasses.dataclass(frozen=True)
class WorstFrame:
    """A frame with its boxes: misses in red, false detections in yellow, agreed boxes in grey."""

    caption: str
    png: bytes


def worst_frames(
    recording: Recording,
    counts: Agreement,
    left: Detections,
    right: Detections,
    before: Detections | None,
) -> tuple[WorstFrame, ...]:
    """Draw the frames with the most disagreements, worst first, spread over the recording.

    Args:
        counts: agreement of `left` with `right`, `[frames, categories]`.
        left, right, before: as given to `evaluation.agreement`.
    """
    wrong = (counts.left - counts.confirmed + counts.right - counts.found).sum(axis=1)
    chosen: list[int] = []
    for i in np.argsort(-wrong, kind="stable").tolist():
        if wrong[i] == 0 or len(chosen) == COUNT:
            break
        if all(abs(i - other) >= DISTANCE for other in chosen):
            chosen.append(i)
    return tuple(_draw(recording, i, left, right, before) for i in chosen)


def _frame(d: Detections, i: int) -> Detections:
    return Detections(d.xywh[i : i + 1], d.label[i : i + 1], d.categories)


def _draw(
    recording: Recording, i: int, left: Detections, right: Detections, before: Detections | None
) -> WorstFrame:
    mine, theirs = _frame(left, i), _frame(right, i)
    pairs = match(mine, theirs)
    confirmed = pairs >= 0
    if before is not None:
        confirmed = confirmed | (match(mine.without(confirmed), _frame(before, i)) >= 0)
    present, confirmed = mine.label[0] >= 0, confirmed[0]
    agreed, false = np.flatnonzero(present & confirmed), np.flatnonzero(present & ~confirmed)
    missed = np.setdiff1d(np.flatnonzero(theirs.label[0] >= 0), pairs[0])

    assert recording.screens is not None
    frame = recording.screens[i]
    rgb = recording.game.palette[frame] if frame.ndim == 2 else frame
    image = Image.fromarray(rgb).resize(
        (rgb.shape[1] * 2 * SCALE, rgb.shape[0] * SCALE), Image.Resampling.NEAREST
    )
    draw = ImageDraw.Draw(image)
    for color, boxes, columns in (
        (AGREED, mine, agreed),
        (FALSE, mine, false),
        (MISSED, theirs, missed),
    ):
        for x, y, w, h in boxes.xywh[0, columns].astype(int).tolist():
            draw.rectangle(
                (2 * SCALE * x - 1, SCALE * y - 1, 2 * SCALE * (x + w), SCALE * (y + h)),
                outline=color,
            )
    file = io.BytesIO()
    image.quantize(COLORS_IN_FILE).save(file, "PNG", optimize=True)
    return WorstFrame(
        f"sample {i}: false {_names(mine, false)}; missed {_names(theirs, missed)}", file.getvalue()
    )


def _names(d: Detections, columns: np.ndarray) -> str:
    return ", ".join(sorted({d.categories[d.label[0, k]] for k in columns})) or "none"
