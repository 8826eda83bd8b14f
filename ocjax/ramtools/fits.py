"""Searches over all RAM for the bytes, nibbles or bit fields that explain a number.

A search fits on one half of the samples and scores on the other. Numbers are compared modulo 256.
`rams` are uint8 `[n, 128]`, targets int `[n]`, and results are sorted, best first.
"""

import dataclasses
import itertools

import numpy as np

SCALES = (1, -1, 2, -2, 4, -4, 8, -8, 16, -16)
# bit fields of a byte, without single bits
WIDTHS = tuple((first, count) for count in (8, 7, 6, 5, 4, 3, 2) for first in range(9 - count))
TABLE_FIELDS = (
    (0, 8),
    (0, 4),
    (4, 4),
    *((b, 1) for b in range(8)),
    *((b, 2) for b in range(7)),
    *((b, 3) for b in range(6)),
)
BEST = 3  # formulas returned
SAMPLE = 400  # samples of the first, coarse search
CLOSER_LOOK = 12  # bytes that are fitted on all samples
TABLE_VALUES = 16  # a table with more values explains nothing
SHOWN_VALUES = 6  # values of a table in its text
BIT_GAIN = 0.02  # least gain of a formula by a bit, as a fraction of samples
DIGIT_SHARE = 0.9  # fraction of samples that a digit byte must get right
DIGIT_BYTES = 3  # bytes of a number at most
MEMBER_VALUES = 8  # a byte with fewer values is not a coordinate
# Least gain of a mirrored reading over the plain one: paired objects also look mirrored.
MIRROR_GAIN = 0.1

Halves = tuple[np.ndarray, np.ndarray]  # bool [n] each: samples to fit on, samples to score on


@dataclasses.dataclass(frozen=True)
class Source:
    """A number in RAM, written as in `ocjax.console.ram`."""

    address: int
    first: int = 0
    count: int = 8
    decimal: bool = False

    def read(self, rams: np.ndarray) -> np.ndarray:
        """Its values in RAM: uint8 `[n, 128]` -> int `[n]`."""
        b = rams[:, self.address].astype(int)
        return (
            (b >> 4) * 10 + (b & 15) if self.decimal else b >> self.first & ((1 << self.count) - 1)
        )

    @property
    def reading(self) -> str:
        """The field's declaration, with {} for its places."""
        if self.decimal:
            return "bcd({})"
        named = {(0, 8): "byte({})", (0, 4): "low({})", (4, 4): "high({})"}
        other = f"bits({{}}, first={self.first}, count={self.count})"
        return named.get((self.first, self.count), other)

    def __str__(self) -> str:
        return self.reading.format(self.address)


@dataclasses.dataclass(frozen=True)
class Fit:
    """A formula for a number, and its accuracy on other samples.

    Args:
        exact, near: fractions of samples with an error of 0, and of at most 1.
        scale, offset: the formula `scale * source + offset`.
        table: pairs of a value and its meaning, instead of scale and offset.
        bit, step: if the bit is set, `step` is added.
    """

    source: Source
    exact: float
    near: float
    scale: int = 1
    offset: int = 0
    table: tuple[tuple[int, int], ...] = ()
    bit: Source | None = None
    step: int = 0

    def __str__(self) -> str:
        if self.table:
            return f"{self.source}: {self.table_text(SHOWN_VALUES)}"
        return affine_text(str(self.source), self.scale, self.offset) + (
            f", {self.step:+d} where {self.bit}" if self.bit else ""
        )

    def table_text(self, shown: int) -> str:
        """The first pairs of the table, and the number of the others."""
        more = len(self.table) - shown
        text = ", ".join(f"{k} -> {v}" for k, v in self.table[:shown])
        return text + (f" and {more} more" if more > 0 else "")

    def predict(self, rams: np.ndarray) -> np.ndarray:
        """The formula's results, int `[n]`."""
        value = self.source.read(rams)
        if self.table:
            lookup = np.full(256, -1)
            for k, v in self.table:
                lookup[k] = v
            return lookup[value]
        out = self.scale * value + self.offset
        return out + self.step * self.bit.read(rams) if self.bit else out


def affine_text(source: str, scale: int, offset: int) -> str:
    """The formula `scale * source + offset` in usual notation."""
    text = {1: "", -1: "-"}.get(scale, f"{scale} * ") + source
    return text + (f" {'-' if offset < 0 else '+'} {abs(offset)}" if offset else "")


def halves(episode: np.ndarray) -> Halves:
    """Split samples: every other episode, or the first half of a single episode, to fit on."""
    index = np.unique(episode, return_inverse=True)[1]
    fit = index % 2 == 0 if index.max(initial=0) > 0 else np.arange(len(index)) < len(index) // 2
    return fit, ~fit


def wrapped(difference: np.ndarray) -> np.ndarray:
    """Differences modulo 256, from -128 to 127."""
    return (difference + 128) % 256 - 128


def _mode(rows: np.ndarray) -> np.ndarray:
    """The most common value of each row of numbers 0-255."""
    index = np.arange(len(rows))[:, None] * 256 + rows
    return (
        np.bincount(index.ravel(), minlength=256 * len(rows)).reshape(len(rows), 256).argmax(axis=1)
    )


def _scored(fit: Fit, rams: np.ndarray, target: np.ndarray) -> Fit:
    off = np.abs(wrapped(fit.predict(rams) - target))
    return dataclasses.replace(fit, exact=float(np.mean(off == 0)), near=float(np.mean(off <= 1)))


def constant(target: np.ndarray, half: Halves) -> float:
    """Fraction of samples that the most common value gets right, which a formula must beat."""
    fit, test = half
    if not (fit.any() and test.any()):
        return 0.0
    values, counts = np.unique(target[fit], return_counts=True)
    return float(np.mean(target[test] == values[counts.argmax()]))


def affine(rams: np.ndarray, target: np.ndarray, half: Halves) -> list[Fit]:
    """The best formulas `scale * field + offset`, each with the most useful correction bit."""
    fit, test = half
    if not (fit.any() and test.any()):
        return []
    fits: list[Fit] = []
    for source, scale, offset in _affine_candidates(rams, target, fit):
        first = source.read(rams[fit])[0] * scale
        # the offset without the modulus
        exact_offset = int(target[fit][0] - first - wrapped(target[fit][0] - first - offset))
        base = _scored(Fit(source, 0, 0, scale, exact_offset), rams[test], target[test])
        fits.append(_with_bit(base, rams, target, half))
    return sorted(fits, key=lambda f: (-f.exact, -f.source.count))[:BEST]


def _affine_candidates(
    rams: np.ndarray, target: np.ndarray, fit: np.ndarray
) -> list[tuple[Source, int, int]]:
    """Source, scale and offset (mod 256) of the best formulas of promising bytes, by sampling."""
    sample = np.flatnonzero(fit)[:: max(1, int(fit.sum()) // SAMPLE)]
    some = rams[sample].T.astype(int)
    found = []
    for first, count in WIDTHS:
        values = some >> first & ((1 << count) - 1)
        varies = np.flatnonzero(values.min(axis=1) != values.max(axis=1))
        for scale in SCALES:
            rest = (target[sample] - scale * values) % 256
            offset = _mode(rest)
            right = (rest == offset[:, None]).mean(axis=1)
            found += [
                (right[a], count, Source(int(a), first, count), scale, offset[a]) for a in varies
            ]
    found.sort(key=lambda f: (-f[0], -f[1], abs(f[3])))
    best_of_byte = {}
    for _, _, source, scale, offset in found:
        best_of_byte.setdefault(source.address, (source, scale, offset))
    return list(best_of_byte.values())[:CLOSER_LOOK]


def _with_bit(base: Fit, rams: np.ndarray, target: np.ndarray, half: Halves) -> Fit:
    """Add the bit and step that explain most of the formula's errors, if they improve it."""
    fit, test = half
    rest = wrapped(target - base.predict(rams)) + 128
    bits = np.unpackbits(rams[fit], axis=1, bitorder="little")
    # [1024, 256]: errors where the bit is set
    set_ = bits.T.astype(np.float32) @ np.eye(256, dtype=np.float32)[rest[fit]]
    clear = np.bincount(rest[fit], minlength=256) - set_
    i = int((set_.max(axis=1) + clear.max(axis=1)).argmax())
    zero, one = (int(counts[i].argmax()) - 128 for counts in (clear, set_))
    better = dataclasses.replace(
        base, offset=base.offset + zero, bit=Source(i // 8, i % 8, 1), step=one - zero
    )
    better = _scored(better, rams[test], target[test])
    return better if one != zero and better.exact > base.exact + BIT_GAIN else base


def tables(rams: np.ndarray, target: np.ndarray, half: Halves, most: int = 3) -> list[Fit]:
    """The best tables, which map the values of a bit field to meanings from 0 to 255."""
    fit, test = half
    if not (fit.any() and test.any()):
        return []
    out = []
    for address, (first, count) in itertools.product(range(128), TABLE_FIELDS):
        source = Source(address, first, count)
        value = source.read(rams)
        occurring = np.unique(value[fit])
        if 1 < len(occurring) <= TABLE_VALUES:
            joint = np.bincount(value[fit] * 256 + target[fit], minlength=1 << 16).reshape(256, 256)
            table = tuple((int(v), int(joint[v].argmax())) for v in occurring)
            if len({t for _, t in table}) > 1:
                out.append(_scored(Fit(source, 0, 0, table=table), rams[test], target[test]))
    out.sort(key=lambda f: (-f.exact, len(f.table)))
    return out[:most]


def digits(rams: np.ndarray, target: np.ndarray, half: Halves) -> list[Fit]:
    """Bytes that each hold two decimal digits of a number, or its binary bytes.

    Returns:
        Bytes, lowest first, with the power of 100 or 256 as `offset`. Empty if the lowest is not
        found.
    """
    out: list[Fit] = []
    for decimal, base in ((True, 100), (False, 256)):
        found = _digits_of_base(rams, target, half[1], decimal, base)
        if len(found) > len(out):
            out = found
    return out


def _digits_of_base(
    rams: np.ndarray, target: np.ndarray, test: np.ndarray, decimal: bool, base: int
) -> list[Fit]:
    found: list[Fit] = []
    for power in range(DIGIT_BYTES):
        part = target // base**power % base
        if power and not part.any():
            break
        options = [Source(a, decimal=decimal) for a in range(128)]
        shares = [float(np.mean(s.read(rams[test]) == part[test])) for s in options]
        best = int(np.argmax(shares))
        if shares[best] < DIGIT_SHARE or len(np.unique(part[test])) < 2:
            break
        found.append(Fit(options[best], shares[best], shares[best], offset=power))
    return found


def members(rams: np.ndarray, present: np.ndarray, most: int) -> list[tuple[Fit, float]]:
    """Bytes that, shifted and perhaps mirrored, are the coordinate of some object.

    Args:
        present: bool `[n, 256]`, the objects' coordinates in each sample.

    Returns:
        Formulas, each with its accuracy by chance.
    """
    n, chance = np.arange(len(rams))[:, None], present.mean(axis=0)
    out = []
    for address in range(128):
        value = rams[:, address].astype(int)
        if len(np.unique(value)) < MEMBER_VALUES:
            continue
        options = []
        for scale in (1, -1):
            at = (scale * value[:, None] + np.arange(256)) % 256
            hits, expected = present[n, at].mean(axis=0), chance[at].mean(axis=0)
            best = int((hits - expected).argmax())
            share = float(hits[best])
            fit = Fit(Source(address), share, share, scale, (best + 128) % 256 - 128)
            options.append((fit, float(expected[best])))
        plain, mirrored = options
        out.append(mirrored if mirrored[0].exact > plain[0].exact + MIRROR_GAIN else plain)
    out.sort(key=lambda member: member[1] - member[0].exact)
    return out[:most]
