"""`ocjax ram correlate`: find the RAM that explains the visible objects."""

import dataclasses
from collections.abc import Iterator

import numpy as np

from ocjax.evaluation.tables import Cell, Table
from ocjax.ramtools import fits, rows, targets
from ocjax.ramtools.fits import Fit, Halves
from ocjax.ramtools.rows import Row
from ocjax.ramtools.targets import Target
from ocjax.recordings import Recording
from ocjax.vision.unknown import UNKNOWN_VALUE

FIELDS = ("x", "y", "w", "h")
MEMBERS = 16  # bytes reported for a category without identities
LEAST = 40  # samples that a search needs
GAIN = 0.02  # least gain of a formula over the most common value, as a fraction of samples
MEMBER_GAIN = 0.2  # least gain of a member byte over chance, as a fraction of samples
FORMULAS = 3  # reported per number
TABLE_ROWS = 8  # the longest table reported for a coordinate


@dataclasses.dataclass(frozen=True)
class Finding:
    """The formulas that explain one field of one object.

    Args:
        object: name of the object: its category, plus its slot if there are several.
        category: name of its category.
        field: "x", "y", "w", "h", "value", "present" or "look".
        constant: fraction of samples that the most common value gets right.
        digits: whether the formulas are digits of one number, lowest first.
        members: whether each formula is the coordinate of another object.
    """

    object: str
    category: str
    field: str
    samples: int
    constant: float
    fits: tuple[Fit | Row, ...]
    digits: bool = False
    members: bool = False


def correlate(recording: Recording, target: str = "vem") -> Iterator[Finding]:
    """Explain the visible objects of a recording by its RAM.

    Formulas are fitted on half of the episodes and scored on the others.

    Args:
        target: "vem" (detections of the game's vision rules) or "sprites" (drawn by the video
            chip).

    Yields:
        The formulas for each field of each object if slots are identities. For other categories,
        rows of objects at a regular pitch. If there are none, bytes that always equal the
        coordinate of one of their objects.
    """
    half = fits.halves(recording.episode)
    for t in targets.from_vem(recording) if target == "vem" else targets.from_chip(recording):
        if not t.place and t.valid[:, 1:].any():
            yield from _explain_set(recording, t, half)
        else:
            for k in range(t.valid.shape[1]):
                yield from _explain_slot(recording, t, k, half)


def _explain_slot(recording: Recording, target: Target, k: int, half: Halves) -> Iterator[Finding]:
    name = target.name if target.valid.shape[1] == 1 else f"{target.name} {k}"
    present = target.valid[:, k]
    if present.any() and not present.all():
        yield _table(name, target.name, "present", recording.rams, present.astype(int), half)
    if present.sum() < LEAST:
        return
    rams, part = recording.rams[present], (half[0][present], half[1][present])
    for i, field in enumerate(FIELDS):
        numbers = target.xywh[present, k, i]
        if len(np.unique(numbers)) > 1:
            yield Finding(
                name,
                target.name,
                field,
                len(numbers),
                fits.constant(numbers, part),
                tuple(_best(rams, numbers, part)),
            )
    if target.value is not None:
        yield from _explain_value(name, target.name, rams, target.value[present, k], part)
    if len(np.unique(target.look[present, k])) > 1:
        yield _table(name, target.name, "look", rams, target.look[present, k], part)


def _explain_value(
    name: str, category: str, rams: np.ndarray, numbers: np.ndarray, half: Halves
) -> Iterator[Finding]:
    """The formulas for a value, from the samples with a known value."""
    known = numbers != UNKNOWN_VALUE
    rams, numbers, half = rams[known], numbers[known], (half[0][known], half[1][known])
    if known.sum() < LEAST or len(np.unique(numbers)) < 2:
        return
    digits = fits.digits(rams, numbers, half)
    formulas = tuple(digits or _best(rams, numbers % 256, half))
    base = fits.constant(numbers, half)
    yield Finding(name, category, "value", len(numbers), base, formulas, digits=bool(digits))


def _best(rams: np.ndarray, numbers: np.ndarray, half: Halves) -> list[Fit]:
    """The best formulas and short tables that beat a constant; formulas win ties."""
    found = fits.affine(rams, numbers, half) + [
        t for t in fits.tables(rams, numbers, half, 1) if len(t.table) <= TABLE_ROWS
    ]
    found = [f for f in found if f.exact > fits.constant(numbers, half) + GAIN]
    return sorted(found, key=lambda f: (-round(f.exact, 3), bool(f.table)))[:FORMULAS]


def _table(
    name: str, category: str, field: str, rams: np.ndarray, numbers: np.ndarray, half: Halves
) -> Finding:
    base = fits.constant(numbers, half)
    return Finding(
        name,
        category,
        field,
        len(numbers),
        base,
        tuple(f for f in fits.tables(rams, numbers, half) if f.exact > base + GAIN),
    )


def _explain_set(recording: Recording, target: Target, half: Halves) -> Iterator[Finding]:
    some = target.valid.sum(axis=1) > 0
    if some.sum() < LEAST:
        return
    rams, part = recording.rams[some], (half[0][some], half[1][some])
    count = len(rams)
    for i, field in enumerate(FIELDS[:2]):
        present = np.zeros((len(recording), 256), bool)
        n, k = np.nonzero(target.valid)
        present[n, target.xywh[n, k, i]] = True
        regular = tuple(rows.rows(rams, present[some], part))
        if regular:
            base = 1 / regular[0].pitch
            yield Finding(f"{target.name}, all", target.name, field, count, base, regular)
            continue
        members = [
            (fit, chance)
            for fit, chance in fits.members(rams, present[some], MEMBERS)
            if fit.exact > chance + MEMBER_GAIN
        ]
        base = float(np.mean([chance for _, chance in members])) if members else 0.0
        formulas = tuple(fit for fit, _ in members)
        name = f"{target.name}, one of"
        yield Finding(name, target.name, field, count, base, formulas, members=True)


def to_table(findings: list[Finding], title: str) -> Table:
    """A table with one row per formula."""
    cells: list[list[Cell]] = []
    for f in findings:
        first: list[Cell] = [f.object, f.field, f.samples, 100 * f.constant]
        if not f.fits:
            cells.append([*first, "nothing found", None, None])
        for i, formula in enumerate(f.fits):
            text = (
                f"{formula.source} (digits {2 * formula.offset + 1}-{2 * formula.offset + 2})"
                if f.digits
                else str(formula)
            )
            cells.append(
                [
                    *(first if i == 0 else [""] * len(first)),
                    text,
                    100 * formula.exact,
                    100 * formula.near,
                ]
            )
    return Table(
        title, ["Object", "Field", "Samples", "Constant", "Formula", "Exact", "Within 1"], cells
    )
