"""`ocjax ram residual`: find the RAM that explains the remaining errors of a decoder."""

import dataclasses
from collections import Counter

import jax
import numpy as np

from ocjax.evaluation import matching
from ocjax.evaluation.matching import Detections
from ocjax.evaluation.tables import Table
from ocjax.ramtools import fits
from ocjax.ramtools.correlate import FIELDS, LEAST
from ocjax.ramtools.fits import Fit
from ocjax.recordings import Recording

MOST = 12  # tables reported


@dataclasses.dataclass(frozen=True)
class Residual:
    """The remaining errors of a decoder in one field, and the RAM that explains them.

    Args:
        samples: number of matched objects.
        exact: fraction of right boxes without a correction.
        errors: VEM minus REM, and how often it occurs.
        tables: corrections by the value of a bit or bit field, best first.
    """

    samples: int
    exact: float
    errors: dict[int, int]
    tables: tuple[Fit, ...]


def residual(recording: Recording, category: str, field: str) -> Residual:
    """Search all RAM for causes of REM's errors against VEM in one field of a category.

    Args:
        field: "x", "y", "w" or "h".
    """
    n, errors = _errors(recording, category, field)
    rams, half = recording.rams[n], fits.halves(recording.episode[n])
    exact = float(np.mean(errors[half[1]] == 0))
    tables = tuple(
        dataclasses.replace(t, table=tuple((value, c - 128) for value, c in t.table))
        for t in fits.tables(rams, np.clip(errors, -128, 127) + 128, half, MOST)
        if t.exact > exact
    )
    counts = dict(Counter(errors.tolist()).most_common())
    return Residual(len(errors), float(np.mean(errors == 0)), counts, tables)


def _errors(recording: Recording, category: str, field: str) -> tuple[np.ndarray, np.ndarray]:
    """The sample of each matched object, and VEM minus REM, both int `[objects]`."""
    game = recording.game
    if category not in game.slices:
        raise ValueError(
            f"{game.name} has no category {category!r}; it has {', '.join(game.slices)}"
        )
    if field not in FIELDS:
        raise ValueError(f"the field must be one of {', '.join(FIELDS)}, got {field!r}")
    if recording.screens is None:
        raise ValueError("the recording has no frames to compare with REM")
    sides = (game.rem, recording.rams), (game.vem, recording.screens)
    rem, vem = (matching.detections(jax.tree.map(np.asarray, extract(x))) for extract, x in sides)
    s, i = game.slices[category], FIELDS.index(field)
    pairs = matching.match(rem, vem)[:, s]
    n, k = np.nonzero(pairs >= 0)
    if len(n) < LEAST:
        raise ValueError(
            f"{category} is matched {len(n)} times on this recording, at least {LEAST} are needed"
            f"{_offsets(rem, vem, s)}"
        )
    return n, (vem.xywh[n, pairs[n, k], i] - rem.xywh[n, s.start + k, i]).astype(int)


def _offsets(rem: Detections, vem: Detections, slots: slice) -> str:
    """By how much REM's positions are off most often; a constant offset is a usual mistake."""
    rem_has, vem_has = rem.label[:, slots] >= 0, vem.label[:, slots] >= 0
    n, i, k = np.nonzero(rem_has[:, :, None] & vem_has[:, None])
    both = len(np.unique(n))
    if not both:
        counts = [int(has.any(axis=1).sum()) for has in (rem_has, vem_has)]
        return f". REM has it in {counts[0]:,} samples, VEM in {counts[1]:,}, never in the same one"
    off_by = rem.xywh[:, slots].astype(int)[n, i] - vem.xywh[:, slots].astype(int)[n, k]
    parts = []
    for axis, name in enumerate("xy"):
        off = off_by[:, axis]
        found = np.unique(np.stack([n, off]), axis=1)[1]  # each offset counts once per sample
        offsets, times = np.unique(found, return_counts=True)
        usual, count = int(offsets[times.argmax()]), int(times.max())
        size = f"{abs(usual)} too {'large' if usual > 0 else 'small'}" if usual else "right"
        parts.append(f"{name} is {size} in {count:,}")
    return f". Of {both:,} samples with both methods' boxes, REM's {' and '.join(parts)}"


def to_tables(r: Residual, title: str) -> list[Table]:
    """Tables of the errors and their explanations."""
    errors = Table(
        f"{title}: {r.samples:,} matched objects, {100 * r.exact:.2f} % exact",
        ["VEM minus REM", "Objects"],
        [[f"{error:+d}", count] for error, count in r.errors.items()],
    )
    corrections = [[str(t), 100 * t.exact] for t in r.tables]
    explained = Table("Fields that explain the errors", ["Corrections", "Exact then"], corrections)
    return [errors, explained] if corrections else [errors]
