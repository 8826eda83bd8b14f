"""Which bytes, nibbles or bit fields of RAM explain a number that was seen: searched over all of them at once.

Every search fits on one half of the samples (the even episodes, or the first half where there is one) and scores on the other.
Numbers are compared modulo 256, as the console computes.
"""

import dataclasses
from collections.abc import Iterator

import numpy as np

SCALES = (1, -1, 2, -2, 4, -4, 8, -8, 16, -16)
WIDTHS = tuple((first, count) for count in (8, 7, 6, 5, 4, 3, 2) for first in range(9 - count))  # bit fields of a byte, bits apart
LONG_LIST = 12  # bytes that are looked at closely
TABLE_VALUES = 16  # a table of more values than this explains nothing
SHOWN_VALUES = 6  # of a table in its text


@dataclasses.dataclass(frozen=True)
class Source:
    """A number in RAM, as `ocjax.ram` writes it."""

    address: int
    first: int = 0
    count: int = 8
    decimal: bool = False

    def read(self, rams: np.ndarray) -> np.ndarray:
        """Its values, int `[n]`, in RAM uint8 `[n, 128]`."""
        b = rams[:, self.address].astype(int)
        return (b >> 4) * 10 + (b & 15) if self.decimal else b >> self.first & ((1 << self.count) - 1)

    def __str__(self) -> str:
        if self.decimal:
            return f"bcd({self.address})"
        named = {(0, 8): "byte({})", (0, 4): "low({})", (4, 4): "high({})"}
        return named.get((self.first, self.count), f"bits({{}}, first={self.first}, count={self.count})").format(self.address)


@dataclasses.dataclass(frozen=True)
class Fit:
    """A formula for a number, and how often it is right on samples that it was not fitted on."""

    source: Source
    exact: float  # share of samples
    near: float  # share of samples in which it is at most one off
    scale: int = 1
    offset: int = 0
    table: tuple[tuple[int, int], ...] = ()  # pairs of a value and what it means, instead of scale and offset
    bit: Source | None = None  # where this bit is set, `step` is added
    step: int = 0

    def __str__(self) -> str:
        if self.table:
            more = len(self.table) - SHOWN_VALUES
            text = ", ".join(f"{k} -> {v}" for k, v in self.table[:SHOWN_VALUES])
            return f"{self.source}: {text}" + (f" and {more} more" if more > 0 else "")
        text = {1: "", -1: "-"}.get(self.scale, f"{self.scale} * ") + str(self.source)
        if self.offset:
            text += f" {'-' if self.offset < 0 else '+'} {abs(self.offset)}"
        return text + (f", {self.step:+d} where {self.bit}" if self.bit else "")

    def predict(self, rams: np.ndarray) -> np.ndarray:
        """What the formula gives, int `[n]`."""
        value = self.source.read(rams)
        if self.table:
            lookup = np.full(256, -1)
            for k, v in self.table:
                lookup[k] = v
            return lookup[value]
        out = self.scale * value + self.offset
        return out + self.step * self.bit.read(rams) if self.bit else out


def halves(episode: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Samples to fit on and samples to score on, bool `[n]`: every other episode, or the halves of the only one."""
    index = np.unique(episode, return_inverse=True)[1]
    fit = index % 2 == 0 if index.max(initial=0) > 0 else np.arange(len(index)) < len(index) // 2
    return fit, ~fit


def wrapped(difference: np.ndarray) -> np.ndarray:
    """Differences modulo 256 as -128 to 127."""
    return (difference + 128) % 256 - 128


def _mode(rows: np.ndarray) -> np.ndarray:
    """Most common value of each row of numbers 0-255."""
    index = np.arange(len(rows))[:, None] * 256 + rows
    return np.bincount(index.ravel(), minlength=256 * len(rows)).reshape(len(rows), 256).argmax(axis=1)


def _score(fit: Fit, rams: np.ndarray, target: np.ndarray) -> Fit:
    off = np.abs(wrapped(fit.predict(rams) - target))
    return dataclasses.replace(fit, exact=float(np.mean(off == 0)), near=float(np.mean(off <= 1)))


def constant(target: np.ndarray, half: tuple[np.ndarray, np.ndarray]) -> float:
    """Share of samples that the most common value gets right: what a fit must beat."""
    fit, test = half
    return float(np.mean(target[test] == np.bincount(target[fit] - target.min()).argmax() + target.min())) if fit.any() else 0.0


def affine(rams: np.ndarray, target: np.ndarray, half: tuple[np.ndarray, np.ndarray], most: int = 3) -> list[Fit]:
    """The best formulas `scale * field + offset`, each with the bit that explains most of what is left over.

    Args:
        rams: uint8 `[n, 128]`.
        target: int `[n]`.
        half: samples to fit and to score on (`halves`).
        most: formulas returned, best first, of different bytes.
    """
    fit, test = half
    if not (fit.any() and test.any()):
        return []
    sample = np.flatnonzero(fit)[:: max(1, int(fit.sum()) // 400)]
    some = rams[sample].T.astype(int)
    found = []
    for first, count in WIDTHS:
        values = some >> first & ((1 << count) - 1)
        for scale in SCALES:
            rest = (target[sample] - scale * values) % 256
            offset = _mode(rest)
            right = (rest == offset[:, None]).mean(axis=1)
            varies = values.min(axis=1) != values.max(axis=1)
            found += [
                (r, -count, Source(a, first, count), scale, o) for a, (r, o) in enumerate(zip(right, offset, strict=True)) if varies[a]
            ]
    found.sort(key=lambda f: (-f[0], f[1], abs(f[3])))
    fits: list[Fit] = []
    closest = {f[2].address: f for f in reversed(found)}  # the best of each byte
    for _, _, source, scale, offset in sorted(closest.values(), key=found.index)[:LONG_LIST]:
        raw = source.read(rams[fit]) * scale
        exact_offset = int(target[fit][0] - raw[0] - wrapped(target[fit][0] - raw[0] - offset))  # the offset without the modulus
        best = _score(Fit(source, 0, 0, scale, exact_offset), rams[test], target[test])
        fits.append(_with_bit(best, rams, target, half))
    return sorted(fits, key=lambda f: (-f.exact, -f.source.count))[:most]


def _with_bit(base: Fit, rams: np.ndarray, target: np.ndarray, half: tuple[np.ndarray, np.ndarray]) -> Fit:
    """The formula with the bit and step that explain most of its errors, where one does."""
    fit, test = half
    rest = wrapped(target - base.predict(rams)) + 128
    bits = np.unpackbits(rams[fit], axis=1, bitorder="little")
    counts = [bits.T.astype(np.float32) @ np.eye(256, dtype=np.float32)[rest[fit]]]  # [1024, 256]: errors where the bit is set
    counts.append(np.bincount(rest[fit], minlength=256) - counts[0])
    right = counts[0].max(axis=1) + counts[1].max(axis=1)
    i = int(right.argmax())
    zero, one = (int(counts[k][i].argmax()) - 128 for k in (1, 0))
    better = dataclasses.replace(base, offset=base.offset + zero, bit=Source(i // 8, i % 8, 1), step=one - zero)
    better = _score(better, rams[test], target[test])
    return better if one != zero and better.exact > base.exact + 0.02 else base


def tables(rams: np.ndarray, target: np.ndarray, half: tuple[np.ndarray, np.ndarray], most: int = 3) -> list[Fit]:
    """The best tables: what each value of a bit field means, for fields of few values.

    Arguments as of `affine`; `target` 0-255.
    """
    fit, test = half
    if not (fit.any() and test.any()):
        return []
    out = []
    for source in _fields():
        value = source.read(rams)
        seen = np.unique(value[fit])
        if 1 < len(seen) <= TABLE_VALUES:
            joint = np.bincount(value[fit] * 256 + target[fit], minlength=1 << 16).reshape(256, 256)
            table = tuple((int(v), int(joint[v].argmax())) for v in seen)
            if len({t for _, t in table}) > 1:
                out.append(_score(Fit(source, 0, 0, table=table), rams[test], target[test]))
    out.sort(key=lambda f: (-f.exact, len(f.table)))
    return out[:most]


def _fields() -> Iterator[Source]:
    for address in range(128):
        for first, count in ((0, 8), (0, 4), (4, 4), *((b, 1) for b in range(8)), *((b, 2) for b in range(7)), *((b, 3) for b in range(6))):
            yield Source(address, first, count)


def digits(rams: np.ndarray, target: np.ndarray, half: tuple[np.ndarray, np.ndarray]) -> list[Fit]:
    """Bytes that hold two decimal digits of a number each (or its bytes), the lowest first: `offset` is the power of 100 (or 256).

    Empty where the lowest is not found.
    """
    test = half[1]
    out: list[Fit] = []
    for decimal, base in ((True, 100), (False, 256)):
        parts: list[Fit] = []
        for power in range(3):
            part = target // base**power % base
            if power and not part.any():
                break
            options = [Source(a, decimal=decimal) for a in range(128)]
            shares = [float(np.mean(s.read(rams[test]) == part[test])) for s in options]
            best = int(np.argmax(shares))
            if shares[best] < 0.9 or len(np.unique(part[test])) < 2:
                break
            parts.append(Fit(options[best], shares[best], shares[best], offset=power))
        if len(parts) > len(out):
            out = parts
    return out


def members(rams: np.ndarray, present: np.ndarray, most: int) -> list[tuple[Source, int, int, float, float]]:
    """Bytes that, plus an offset, are always the number of some object of a category.

    Args:
        rams: uint8 `[n, 128]`.
        present: bool `[n, 256]`: the numbers that objects have in each sample.
        most: bytes returned.

    Returns:
        `(byte, scale, offset, share of samples in which an object is there, the same by chance)`, best first.
    """
    out = []
    n = np.arange(len(rams))[:, None]
    chance = present.mean(axis=0)
    for address in range(128):
        value = rams[:, address].astype(int)
        if len(np.unique(value)) < 8:
            continue
        options = []
        for scale in (1, -1):
            at = (scale * value[:, None] + np.arange(256)) % 256
            hits = present[n, at].mean(axis=0)
            expected = chance[at].mean(axis=0)
            best = int((hits - expected).argmax())
            options.append((Source(address), scale, (best + 128) % 256 - 128, float(hits[best]), float(expected[best])))
        up, down = options
        out.append(down if down[3] > up[3] + 0.1 else up)  # what moves in pairs may be mirrored: the plain reading comes first
    out.sort(key=lambda o: o[4] - o[3])
    return out[:most]
