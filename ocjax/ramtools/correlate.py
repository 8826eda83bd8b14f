"""`ocjax ram correlate`: find the RAM that explains the visible objects."""

import dataclasses
from collections import Counter
from collections.abc import Iterator

import jax
import numpy as np

from ocjax.evaluation.tables import Cell, Table
from ocjax.ramtools import fits, rows
from ocjax.ramtools.fits import Fit, Halves
from ocjax.ramtools.new.colors import components
from ocjax.ramtools.rows import Row
from ocjax.recordings import Recording
from ocjax.vision.rules import Blobs
from ocjax.vision.unknown import UNKNOWN_VALUE

FIELDS = ("x", "y", "w", "h")
MEMBERS = 16  # bytes reported for a category without identities
LEAST = 40  # samples that a search needs
GAIN = 0.02  # least gain of a formula over the most common value, as a fraction of samples
MEMBER_GAIN = 0.2  # least gain of a member byte over chance, as a fraction of samples
FORMULAS = 3  # reported per number
TABLE_ROWS = 8  # the longest table reported for a coordinate
# moving graphics objects, by their bit in `Recording.shown`
CHIP = {1: "Player0", 2: "Missile0", 4: "Player1", 8: "Missile1", 16: "Ball"}
CHIP_SLOTS = 8  # pieces of each
LOOKS = 255  # distinguished pictures; rarer ones share the last number


@dataclasses.dataclass(frozen=True)
class Target:
    """The numbers of a category's objects in `n` samples, for RAM to explain.

    Args:
        name: name of the category.
        place: whether slots are identities, or the boxes a set.
        xywh: int `[n, slots, 4]`.
        valid: bool `[n, slots]`.
        value: int `[n, slots]`, `UNKNOWN_VALUE` if VEM cannot read it; None if VEM reads no value.
        look: int `[n, slots]`, number of the picture in the box by frequency; -1 for empty slots.
    """

    name: str
    place: bool
    xywh: np.ndarray
    valid: np.ndarray
    value: np.ndarray | None
    look: np.ndarray


@dataclasses.dataclass(frozen=True)
class Finding:
    """The formulas that explain one field of one object.

    Args:
        object: its category, plus its slot if there are several.
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

    Args:
        target: "vem" (detections of the game's vision rules) or "sprites" (drawn by the video
            chip).

    Yields:
        The formulas for each field of each object if slots are identities; otherwise rows of
        objects at a regular pitch, or else bytes that equal an object's coordinate.
    """
    half = fits.halves(recording.episode)
    for t in from_vem(recording) if target == "vem" else from_chip(recording):
        if not t.place and t.valid[:, 1:].any():
            yield from _explain_set(recording, t, half)
        else:
            for k in range(t.valid.shape[1]):
                yield from _explain_slot(recording, t, k, half)


def from_vem(recording: Recording) -> Iterator[Target]:
    """The objects that the game's vision rules detect."""
    screens, game = recording.screens, recording.game
    assert screens is not None
    vem = jax.tree.map(np.asarray, game.vem(screens))
    for c in game.categories:
        s = game.slices[c.name]
        xywh, valid = vem.xywh[:, s].astype(int), vem.valid[:, s]
        look = _looks(screens, xywh, valid) if screens.ndim == 3 else np.zeros(valid.shape, int)
        place = c.count == 1 or not isinstance(c.rule, Blobs)
        reads_value = getattr(c.rule, "value", None) is not None
        yield Target(c.name, place, xywh, valid, vem.value[:, s] if reads_value else None, look)


def from_chip(recording: Recording) -> Iterator[Target]:
    """The connected pixels of the video chip's sprites. This needs no vision rules."""
    if recording.shown is None:
        raise ValueError("the recording lacks the video chip's sprites (an array 'shown')")
    found = components(recording.shown, [(bit,) for bit in CHIP], CHIP_SLOTS)
    for name, (xywh, valid) in zip(CHIP.values(), found, strict=True):
        boxes = xywh * valid[..., None]
        yield Target(name, False, boxes, valid, None, np.zeros(valid.shape, int))


def _looks(screens: np.ndarray, xywh: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Number the pictures in boxes: the masks of pixels with the box's most common colour."""
    out, pictures = np.full(valid.shape, -1), {}
    for i, k in zip(*np.nonzero(valid), strict=True):
        x, y, w, h = xywh[i, k]
        crop = screens[i, y : y + h, x : x + w]
        background = np.bincount(crop.ravel(), minlength=256).argmax()
        pictures[i, k] = bytes((w, h)) + (crop == background).tobytes()
    ranked = [picture for picture, _ in Counter(pictures.values()).most_common()]
    numbers = {picture: min(n, LOOKS) for n, picture in enumerate(ranked)}
    for at, picture in pictures.items():
        out[at] = numbers[picture]
    return out


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
            formulas = tuple(_best(rams, numbers, part))
            base = fits.constant(numbers, part)
            yield Finding(name, target.name, field, len(numbers), base, formulas)
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
    tables = fits.tables(rams, numbers, half, 1)
    found = fits.affine(rams, numbers, half) + [t for t in tables if len(t.table) <= TABLE_ROWS]
    found = [f for f in found if f.exact > fits.constant(numbers, half) + GAIN]
    return sorted(found, key=lambda f: (-round(f.exact, 3), bool(f.table)))[:FORMULAS]


def _table(
    name: str, category: str, field: str, rams: np.ndarray, numbers: np.ndarray, half: Halves
) -> Finding:
    base = fits.constant(numbers, half)
    tables = tuple(f for f in fits.tables(rams, numbers, half) if f.exact > base + GAIN)
    return Finding(name, category, field, len(numbers), base, tables)


def _explain_set(recording: Recording, target: Target, half: Halves) -> Iterator[Finding]:
    some = target.valid.any(axis=1)
    if some.sum() < LEAST:
        return
    rams, part = recording.rams[some], (half[0][some], half[1][some])
    n, k = np.nonzero(target.valid)
    for i, field in enumerate(FIELDS[:2]):
        present = np.zeros((len(recording), 256), bool)
        present[n, target.xywh[n, k, i]] = True
        regular = tuple(rows.rows(rams, present[some], part))
        if regular:
            name, base = f"{target.name}, all", 1 / regular[0].pitch
            yield Finding(name, target.name, field, len(rams), base, regular)
            continue
        members = [
            (fit, chance)
            for fit, chance in fits.members(rams, present[some], MEMBERS)
            if fit.exact > chance + MEMBER_GAIN
        ]
        base = float(np.mean([chance for _, chance in members])) if members else 0.0
        formulas = tuple(fit for fit, _ in members)
        name = f"{target.name}, one of"
        yield Finding(name, target.name, field, len(rams), base, formulas, members=True)


def to_table(findings: list[Finding], title: str) -> Table:
    """A table with one row per formula."""
    cells: list[list[Cell]] = []
    for f in findings:
        first: list[Cell] = [f.object, f.field, f.samples, 100 * f.constant]
        if not f.fits:
            cells.append([*first, "nothing found", None, None])
        for i, formula in enumerate(f.fits):
            text = str(formula)
            if f.digits:
                last = 2 * formula.offset + 2
                text = f"{formula.source} (digits {last - 1}-{last})"
            before = first if i == 0 else [""] * len(first)
            cells.append([*before, text, 100 * formula.exact, 100 * formula.near])
    header = ["Object", "Field", "Samples", "Constant", "Formula", "Exact", "Within 1"]
    return Table(title, header, cells)
