"""Rows of objects at a regular pitch, such as a formation: position = pitch * slot + byte."""

import dataclasses
from collections.abc import Iterator

import numpy as np

from ocjax.ramtools.fits import Halves, Source, affine_text

PITCHES = range(64, 3, -1)  # pixels between neighbours, the widest first
REGULAR = 0.95  # fraction of the distances within a sample that are multiples of the pitch
LEAST = 0.8  # fraction of objects that a row must explain, up to one pixel
GAIN = 0.1  # least gain of a byte over a row that does not move, as a fraction of objects
MOST = 3  # rows reported
READINGS = ((0, 8), (0, 4), (4, 4))  # bits of a byte: first, count


@dataclasses.dataclass(frozen=True)
class Row:
    """Positions of objects at a regular pitch, and the accuracy on other samples.

    Args:
        pitch: pixels from one slot to the next.
        slots: number of slots that had objects.
        source: the number in RAM that moves the row; None if it does not move.
        scale, offset: the position of slot 0 is `scale * source + offset`.
        exact, near: fractions of objects at a slot's position, and within one pixel of it.
    """

    pitch: int
    slots: int
    source: Source | None
    scale: int
    offset: int
    exact: float = 0
    near: float = 0

    def __str__(self) -> str:
        start = (
            affine_text(str(self.source), self.scale, self.offset)
            if self.source
            else str(self.offset)
        )
        return f"{self.pitch} * slot + {start}, slots 0-{self.slots - 1}"

    def places(self, rams: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Positions relative to slot 0. Both arguments have one entry per object."""
        moved = self.scale * self.source.read(rams) if self.source else 0
        return position - moved - self.offset


def rows(rams: np.ndarray, present: np.ndarray, half: Halves) -> list[Row]:
    """Explain the coordinates of a category's objects by rows at a regular pitch, best first.

    Args:
        rams: uint8 `[n, 128]`.
        present: bool `[n, 256]`, the objects' coordinates in each sample.
        half: samples to fit and to score on, from `fits.halves`.

    Returns:
        Empty if the distances have no common divisor, or no byte moves the row.
    """
    several = present.sum(axis=1) > 1
    fit, test = (part & several for part in half)
    pitch = _pitch(present[fit])
    if pitch is None or not test.any():
        return []
    sides = [np.nonzero(present & part[:, None]) for part in (fit, test)]
    (fit_rams, fit_at), (test_rams, test_at) = ((rams[n], at) for n, at in sides)
    slots = int(_extent(present[several]).max()) // pitch + 1
    still = Row(pitch, slots, None, 1, 0)
    found = []
    for row in (still, *_moving(rams[several], still)):
        fitted = _fitted(row, fit_rams, fit_at)
        if fitted.slots <= slots + 1:
            found.append(_scored(fitted, test_rams, test_at))
    base = max((row.near for row in found if row.source is None), default=3 / pitch)
    good = [
        row for row in found if row.near >= LEAST and (row.source is None or row.near > base + GAIN)
    ]
    return sorted(good, key=_order)[:MOST]


def _order(row: Row) -> tuple[float, int, int]:
    """Accurate rows come first, then rows of few slots, then bytes before nibbles."""
    return -round(row.exact, 2), row.slots, -row.source.count if row.source else 0


def _pitch(present: np.ndarray) -> int | None:
    """The widest pitch that divides most distances between neighbours.

    If no pitch divides the distances exactly, one pixel of remainder is allowed.
    """
    n, at = np.nonzero(present)
    distances = np.diff(at)[n[1:] == n[:-1]]
    if not len(distances):
        return None
    for tolerance in (0, 1):
        for pitch in PITCHES:
            rest = distances % pitch
            off = np.minimum(rest, pitch - rest)
            if pitch > 8 * tolerance and (off <= tolerance).mean() >= REGULAR:
                return pitch
    return None


def _extent(present: np.ndarray) -> np.ndarray:
    """Distance from the first to the last coordinate of each sample, int `[n]`."""
    last = present.shape[1] - 1 - present[:, ::-1].argmax(axis=1)
    return last - present.argmax(axis=1)


def _moving(rams: np.ndarray, still: Row) -> Iterator[Row]:
    """The row with each varying number in RAM that may move it."""
    for address in np.flatnonzero(rams.min(axis=0) != rams.max(axis=0)).tolist():
        for first, count in READINGS:
            for scale in (1, -1):
                yield dataclasses.replace(still, source=Source(address, first, count), scale=scale)


def _fitted(row: Row, rams: np.ndarray, position: np.ndarray) -> Row:
    """The row with the best offset and the number of its slots."""
    places = row.places(rams, position)
    rest = int(np.bincount(places % row.pitch, minlength=row.pitch).argmax())
    used = (places[places % row.pitch == rest] - rest) // row.pitch
    first, last = int(used.min()), int(used.max())
    return dataclasses.replace(row, offset=rest + row.pitch * first, slots=last - first + 1)


def _scored(row: Row, rams: np.ndarray, position: np.ndarray) -> Row:
    rest = row.places(rams, position) % row.pitch
    near = np.minimum(rest, row.pitch - rest) <= 1
    return dataclasses.replace(row, exact=float((rest == 0).mean()), near=float(near.mean()))
