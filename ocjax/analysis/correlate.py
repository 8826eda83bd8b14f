"""`ocjax ram correlate`: which RAM explains what is seen. `ocjax ram residual`: which RAM explains what a decoder gets wrong."""

import dataclasses
from collections import Counter
from collections.abc import Iterator

import jax
import numpy as np

from ocjax import evaluation
from ocjax.analysis import fits
from ocjax.analysis.fits import Fit, Source
from ocjax.objects import Objects
from ocjax.recordings import Recording
from ocjax.report import Cell, Table
from ocjax.rules import Blobs, Category
from ocjax.vision import rules

FIELDS = ("x", "y", "w", "h")
CHIP = {1: "Player0", 2: "Missile0", 4: "Player1", 8: "Missile1", 16: "Ball"}  # the video chip's moving objects, as `shown` numbers them
MEMBERS = 16  # bytes named for a category whose slots are no identities
LEAST = 40  # samples that a search needs
GAIN = 0.02  # share of samples by which a formula must beat the most common value


@dataclasses.dataclass(frozen=True)
class Seen:
    """What a target sees in each sample, by category: boxes in slots, values where they are read, and what they look like."""

    name: str
    place: bool  # slots are identities: each is explained by itself; otherwise the category's boxes are a set
    xywh: np.ndarray  # int [n, slots, 4]
    valid: np.ndarray  # bool [n, slots]
    value: np.ndarray | None  # int [n, slots]
    look: np.ndarray  # int [n, slots]: number of the picture, the most frequent are 0, 1, ...


@dataclasses.dataclass(frozen=True)
class Finding:
    """What explains one field of one object."""

    object: str
    field: str
    samples: int
    constant: float  # share that the most common value gets right
    fits: tuple[Fit, ...]  # best first
    note: str = ""


def _looks(screens: np.ndarray, xywh: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """Numbers of the pictures inside boxes: which pixels differ from the box's most common colour."""
    out, names = np.full(valid.shape, -1), {}
    keys: dict[tuple[int, int], bytes] = {}
    for i, k in zip(*np.nonzero(valid), strict=True):
        x, y, w, h = xywh[i, k]
        crop = screens[i, y : y + h, x : x + w]
        corner = np.bincount(crop.ravel(), minlength=256).argmax()
        keys[i, k] = bytes((w, h)) + (crop == corner).tobytes()
    for key, _ in Counter(keys.values()).most_common():
        names[key] = min(len(names), 255)
    for at, key in keys.items():
        out[at] = names[key]
    return out


def seen_by_vem(recording: Recording) -> list[Seen]:
    """The objects that the game's vision rules see."""
    assert recording.screens is not None
    game = recording.game
    vem: Objects = jax.tree.map(np.asarray, game.vem(recording.screens))
    out = []
    for c in game.categories:
        s = game.slices[c.name]
        xywh, valid = np.asarray(vem.xywh)[:, s].astype(int), np.asarray(vem.valid)[:, s]
        reads = getattr(c.rule, "value", None) is not None
        place = c.count == 1 or not isinstance(c.rule, Blobs)
        look = _looks(recording.screens, xywh, valid) if recording.screens.ndim == 3 else np.zeros(valid.shape, int)
        out.append(Seen(c.name, place, xywh, valid, np.asarray(vem.value[:, s]) if reads else None, look))
    return out


def seen_by_chip(recording: Recording) -> list[Seen]:
    """The pixels of the video chip's moving objects, each piece that hangs together an object: needs no vision rules."""
    if recording.shown is None:
        raise ValueError("the recording does not say what the video chip drew (an array 'shown')")
    categories = tuple(Category(name, Blobs((bit,), connectivity=8), count=8) for bit, name in CHIP.items())
    see = jax.jit(lambda frames: [s for s, _ in rules.see(categories, frames)])
    out = []
    for c, s in zip(categories, see(recording.shown), strict=True):
        xywh, valid = np.stack([s.x, s.y, s.w, s.h], axis=-1).swapaxes(0, 1), np.asarray(s.valid).T
        out.append(Seen(c.name, False, xywh * valid[..., None], valid, None, np.zeros(valid.shape, int)))
    return out


def correlate(recording: Recording, target: str = "vem") -> Iterator[Finding]:
    """Explain everything that is seen on a recording.

    Args:
        recording: with frames.
        target: "vem" (the game's vision rules) or "sprites" (what the video chip drew).

    Yields:
        What explains each field of each object whose slot is an identity, and, for the others, bytes that always are the number of one
        of them.
    """
    half = fits.halves(recording.episode)
    for seen in seen_by_vem(recording) if target == "vem" else seen_by_chip(recording):
        if not seen.place and seen.valid[:, 1:].any():
            yield from _set(recording, seen, half)
            continue
        for k in range(seen.valid.shape[1]):
            name = seen.name if seen.valid.shape[1] == 1 else f"{seen.name} {k}"
            there = seen.valid[:, k]
            if there.any() and not there.all():
                yield _table(name, "present", recording.rams, there.astype(int), half)
            if there.sum() < LEAST:
                continue
            rams, part = recording.rams[there], (half[0][there], half[1][there])
            for i, field in enumerate(FIELDS):
                t = seen.xywh[there, k, i]
                if len(np.unique(t)) > 1:
                    yield Finding(name, field, len(t), fits.constant(t, part), tuple(_best(rams, t, part)))
            if seen.value is not None and len(np.unique(seen.value[there, k])) > 1:
                t = seen.value[there, k]
                parts = fits.digits(rams, t, part)
                note = "digits, lowest first" if parts else ""
                yield Finding(name, "value", len(t), fits.constant(t, part), tuple(parts or _best(rams, t % 256, part)), note)
            if len(np.unique(seen.look[there, k])) > 1:
                yield _table(name, "look", rams, seen.look[there, k], part)


def _best(rams: np.ndarray, target: np.ndarray, half: tuple[np.ndarray, np.ndarray]) -> list[Fit]:
    """Formulas that explain more than a constant does, and a table where it explains more yet."""
    found = fits.affine(rams, target, half) + [t for t in fits.tables(rams, target, half, 1) if len(t.table) < 9]
    found = [f for f in found if f.exact > fits.constant(target, half) + GAIN]
    return sorted(found, key=lambda f: (-round(f.exact, 3), bool(f.table)))[:3]


def _table(name: str, field: str, rams: np.ndarray, target: np.ndarray, half: tuple[np.ndarray, np.ndarray]) -> Finding:
    base = fits.constant(target, half)
    return Finding(name, field, len(target), base, tuple(f for f in fits.tables(rams, target, half) if f.exact > base + GAIN))


def _set(recording: Recording, seen: Seen, half: tuple[np.ndarray, np.ndarray]) -> Iterator[Finding]:
    some = seen.valid.sum(axis=1) > 0
    if some.sum() < LEAST:
        return
    for i, field in enumerate(FIELDS[:2]):
        present = np.zeros((len(recording), 256), bool)
        n, k = np.nonzero(seen.valid)
        present[n, seen.xywh[n, k, i]] = True
        found = fits.members(recording.rams[some], present[some], MEMBERS)
        good = [f for f in found if f[3] > f[4] + 0.2]
        formulas = tuple(Fit(source, share, share, scale, offset) for source, scale, offset, share, _ in good)
        yield Finding(f"{seen.name}, one of", field, int(some.sum()), float(np.mean([f[4] for f in good])) if good else 0.0, formulas)


def to_table(findings: list[Finding], title: str) -> Table:
    """Findings for people: a row a formula."""
    rows: list[list[Cell]] = []
    for f in findings:
        first: list[Cell] = [f.object, f.field, f.samples, 100 * f.constant]
        for i, formula in enumerate(f.fits or (None,)):
            head = first if i == 0 else ["", "", "", ""]
            if formula is None:
                rows.append([*head, "nothing found", None, None])
                continue
            text = str(formula)
            if f.note:
                text = f"{formula.source} (digits {2 * formula.offset + 1}-{2 * formula.offset + 2})"
            rows.append([*head, text, 100 * formula.exact, 100 * formula.near])
    return Table(title, ["Object", "Field", "Samples", "Constant", "Formula", "Exact", "Within 1"], rows)


@dataclasses.dataclass(frozen=True)
class Residual:
    """What is left of a decoder's errors in one field, and what explains it."""

    samples: int
    exact: float  # share of right boxes as they are
    errors: dict[int, int]  # VEM minus REM: how often
    bits: tuple[tuple[Source, int, int, float], ...]  # bit, correction where it is clear, where it is set, share right then
    tables: tuple[Fit, ...]  # corrections by the value of a bit field


def residual(recording: Recording, category: str, field: str, most: int = 8) -> Residual:
    """Search all RAM for what explains the errors of REM in a field, against VEM, over matched objects of a category.

    Raises:
        ValueError: there is no such category or field, or nothing to compare.
    """
    game = recording.game
    if category not in game.slices:
        raise ValueError(f"{game.name} has no category {category!r}; it has {', '.join(game.slices)}")
    if field not in FIELDS:
        raise ValueError(f"the field must be one of {', '.join(FIELDS)}, got {field!r}")
    if recording.screens is None:
        raise ValueError("the recording has no frames: there is nothing to compare REM with")
    rem, vem = (
        evaluation.detections(jax.tree.map(np.asarray, f(x))) for f, x in ((game.rem, recording.rams), (game.vem, recording.screens))
    )
    s = game.slices[category]
    pairs = evaluation.match(rem, vem)[:, s]
    n, k = np.nonzero(pairs >= 0)
    if len(n) < LEAST:
        raise ValueError(f"{category} is matched {len(n)} times on this recording, at least {LEAST} are needed")
    i = FIELDS.index(field)
    rest = (vem.xywh[n, pairs[n, k], i] - rem.xywh[n, s.start + k, i]).astype(int)
    rams = recording.rams[n]
    half = fits.halves(recording.episode[n])
    fit, test = half
    shifted = np.clip(rest, -128, 127) + 128
    set_ = np.unpackbits(rams, axis=1, bitorder="little").astype(bool)
    ones = set_[fit].T.astype(np.float32) @ np.eye(256, dtype=np.float32)[shifted[fit]]
    zeros = np.bincount(shifted[fit], minlength=256) - ones
    clear, high = zeros.argmax(axis=1) - 128, ones.argmax(axis=1) - 128
    right = np.where(set_[test], high, clear) == rest[test, None]
    share = right.mean(axis=0)
    base = float(np.mean(rest[test] == 0))
    varies = ones.any(axis=1) & zeros.any(axis=1) & (clear != high) & (share > base)
    order = [b for b in np.argsort(-share, kind="stable") if varies[b]][:most]
    found = tuple((Source(int(b) // 8, int(b) % 8, 1), int(clear[b]), int(high[b]), float(share[b])) for b in order)
    better = [t for t in fits.tables(rams, shifted, half, most) if t.exact > base]
    corrections = tuple(dataclasses.replace(t, table=tuple((v, c - 128) for v, c in t.table)) for t in better)
    errors = dict(zip(*(a.tolist() for a in np.unique(rest, return_counts=True)), strict=True))
    return Residual(len(rest), float(np.mean(rest == 0)), errors, found, corrections)


def residual_tables(r: Residual, title: str) -> list[Table]:
    """A residual for people."""
    counts = Table(
        f"{title}: {r.samples:,} matched objects, {100 * r.exact:.2f} % exact",
        ["VEM minus REM", "Objects"],
        [[f"{k:+d}", v] for k, v in sorted(r.errors.items(), key=lambda e: -e[1])],
    )
    bits = Table(
        "bits that explain it", ["Bit", "Clear", "Set", "Exact then"], [[str(b), f"{c:+d}", f"{s:+d}", 100 * x] for b, c, s, x in r.bits]
    )
    tables = Table("fields that explain it", ["Corrections", "Exact then"], [[str(t), 100 * t.exact] for t in r.tables])
    return [counts, *(t for t in (bits, tables) if t.rows)]
