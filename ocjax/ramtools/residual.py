"""`ocjax ram residual`: find the RAM that explains the remaining errors of a decoder."""

import dataclasses

import jax
import numpy as np

from ocjax.evaluation import matching
from ocjax.evaluation.matching import Detections
from ocjax.evaluation.tables import Table
from ocjax.ramtools import fits
from ocjax.ramtools.correlate import FIELDS, LEAST
from ocjax.ramtools.fits import Fit, Halves, Source
from ocjax.recordings import Recording

MOST = 8  # bits and tables reported


@dataclasses.dataclass(frozen=True)
class Bit:
    """A correction that depends on one bit of RAM."""

    source: Source
    clear: int  # correction if the bit is clear
    set: int  # correction if it is set
    exact: float  # fraction of right boxes with the correction, on samples that were not fitted on


@dataclasses.dataclass(frozen=True)
class Residual:
    """The remaining errors of a decoder in one field, and the RAM that explains them.

    Args:
        samples: number of matched objects.
        exact: fraction of right boxes without a correction.
        errors: VEM minus REM, and how often it occurs.
        bits: bits that explain errors, best first.
        tables: corrections by the value of a bit field, best first.
    """

    samples: int
    exact: float
    errors: dict[int, int]
    bits: tuple[Bit, ...]
    tables: tuple[Fit, ...]


def residual(recording: Recording, category: str, field: str) -> Residual:
    """Search all RAM for causes of REM's errors against VEM in one field of a category.

    Args:
        field: "x", "y", "w" or "h".
    """
    n, errors = _errors(recording, category, field)
    rams, half = recording.rams[n], fits.halves(recording.episode[n])
    exact = float(np.mean(errors[half[1]] == 0))
    bits = _explaining_bits(rams, errors, half, exact)
    corrections = [
        t
        for t in fits.tables(rams, np.clip(errors, -128, 127) + 128, half, MOST)
        if t.exact > exact
    ]
    tables = tuple(
        dataclasses.replace(t, table=tuple((v, c - 128) for v, c in t.table)) for t in corrections
    )
    counts = dict(zip(*(a.tolist() for a in np.unique(errors, return_counts=True)), strict=True))
    return Residual(len(errors), float(np.mean(errors == 0)), counts, bits, tables)


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
    """Say by how much REM's positions are off most often. A constant offset is a usual mistake."""
    rem_boxes, vem_boxes = rem.xywh[:, slots].astype(int), vem.xywh[:, slots].astype(int)
    rem_has, vem_has = rem.label[:, slots] >= 0, vem.label[:, slots] >= 0
    n, i, k = np.nonzero(rem_has[:, :, None] & vem_has[:, None])
    both = len(np.unique(n))
    if not both:
        counts = [int(has.any(axis=1).sum()) for has in (rem_has, vem_has)]
        return f". REM has it in {counts[0]:,} samples, VEM in {counts[1]:,}, never in the same one"
    parts = []
    for axis, name in enumerate("xy"):
        off = rem_boxes[n, i, axis] - vem_boxes[n, k, axis]
        found = np.unique(np.stack([n, off]), axis=1)[1]  # each offset counts once per sample
        offsets, times = np.unique(found, return_counts=True)
        usual, count = int(offsets[times.argmax()]), int(times.max())
        size = f"{abs(usual)} too {'large' if usual > 0 else 'small'}" if usual else "right"
        parts.append(f"{name} is {size} in {count:,}")
    return f". Of {both:,} samples with both methods' boxes, REM's {' and '.join(parts)}"


def _explaining_bits(
    rams: np.ndarray, errors: np.ndarray, half: Halves, exact: float
) -> tuple[Bit, ...]:
    """Bits with corrections, for clear and set, that are right more often than no correction."""
    fit, test = half
    shifted = np.clip(errors, -128, 127) + 128
    bits = np.unpackbits(rams, axis=1, bitorder="little").astype(bool)
    # [1024, 256]: errors where the bit is set
    ones = bits[fit].T.astype(np.float32) @ np.eye(256, dtype=np.float32)[shifted[fit]]
    zeros = np.bincount(shifted[fit], minlength=256) - ones
    clear, set_ = zeros.argmax(axis=1) - 128, ones.argmax(axis=1) - 128
    share = (np.where(bits[test], set_, clear) == errors[test, None]).mean(axis=0)
    explains = ones.any(axis=1) & zeros.any(axis=1) & (clear != set_) & (share > exact)
    order = [b for b in np.argsort(-share, kind="stable").tolist() if explains[b]][:MOST]
    return tuple(
        Bit(Source(b // 8, b % 8, 1), int(clear[b]), int(set_[b]), float(share[b])) for b in order
    )


def to_tables(r: Residual, title: str) -> list[Table]:
    """Tables of the errors and their explanations."""
    errors = [
        [f"{error:+d}", count] for error, count in sorted(r.errors.items(), key=lambda e: -e[1])
    ]
    bits = [[str(b.source), f"{b.clear:+d}", f"{b.set:+d}", 100 * b.exact] for b in r.bits]
    corrections = [[str(t), 100 * t.exact] for t in r.tables]
    out = [
        Table(
            f"{title}: {r.samples:,} matched objects, {100 * r.exact:.2f} % exact",
            ["VEM minus REM", "Objects"],
            errors,
        ),
        Table(
            "Bits that explain the errors",
            ["Bit", "Correction if clear", "Correction if set", "Exact then"],
            bits,
        ),
        Table("Fields that explain the errors", ["Corrections", "Exact then"], corrections),
    ]
    return [out[0], *(t for t in out[1:] if t.rows)]
