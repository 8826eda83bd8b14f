"""The display data of the cartridge's second chip.

A creature's picture has a byte of colour and a byte of dots per row; Harry's pictures have only
dots. Fetchers count down through the data, so the ROM has the byte for a count of 0 last.
"""

from typing import NamedTuple

import jax
import numpy as np
from ocjax.authoring import Pictures, Word, lookup
from ocjax.extractors.pitfall2.ram import ROM, Kind

DISPLAY = ROM.bytes(0x2000, 0x800)[::-1]  # by count
HARRY_LOWS = 0x1A16  # in the ROM: by pose, the count below Harry's rows, low byte
HARRY_HIGHS = 0x1A24  # and high byte
HARRY_POSES = 14
HARRY_ROWS = 21
CUTS = range(1, 32)  # rows of a picture above the view, or in it at its lower edge

STARTS = ROM.bytes(0xE03, Kind.KINDS)  # by kind: the count at which a fetcher begins, low byte
HIGHS = ROM.bytes(0xE14, Kind.KINDS) & 7  # and high byte
ENDS = ROM.bytes(0xE25, Kind.KINDS)  # low byte of the count at the end of the first picture
TOPS = ROM.bytes(0xE36, Kind.KINDS)  # low byte of the count at its beginning
STRIDES = ROM.bytes(0xE7A, Kind.KINDS)  # from one picture to the next
PHASES = ROM.bytes(0xEAD, Kind.KINDS)  # of the clock: a kind has its second picture while 0
STEP_MASKS = ROM.bytes(0xE8B, Kind.KINDS)  # of the clock: it moves while 0; `NEVER`: it stays
WAYS = ROM.bytes(0xE9C, Kind.KINDS)  # kind of motion
PACE = 3  # bits of `WAYS`: columns per step
LEAPS = 0xFF  # of `WAYS`: a frog
NEVER = 0xFF  # of `STEP_MASKS`
SWINGS = np.where((WAYS > 128) & (WAYS != LEAPS), (WAYS & 0x60) >> 1, 1)  # see `Habits`


class Habits(NamedTuple):
    """The habits of a kind."""

    phases: jax.Array  # of the clock: it has its second picture while 0
    steps: jax.Array  # of the clock: it moves while 0; `NEVER`: it stays
    pace: jax.Array  # columns per step
    swings: jax.Array  # up and down, half lines
    top: jax.Array  # low byte of the count at the first picture's beginning


# All habits of a kind in one number, because a look-up costs more than shifts.
HABIT_WORD = Word(phases=8, steps=8, pace=2, swings=6, top=8)
HABITS_BY_KIND = HABIT_WORD.pack(
    phases=PHASES, steps=STEP_MASKS, pace=WAYS & PACE, swings=SWINGS, top=TOPS
)


def habits_of(kind: jax.Array) -> Habits:
    """The habits of some kinds."""
    return Habits(**vars(HABIT_WORD.unpack(lookup(HABITS_BY_KIND, kind))))


def _creature(kind: int, picture: int) -> np.ndarray:
    """The dots of a creature's rows."""
    stride = STRIDES[kind] * picture
    first = 256 * HIGHS[kind] + STARTS[kind] - (STARTS[kind] - TOPS[kind] & 0xFF)
    counts = first + stride - 1 - np.arange(0, (TOPS[kind] - ENDS[kind] & 0xFF) - 1, 2)
    return DISPLAY[counts & 0x7FF]


def _count_below(pose: int) -> int:
    low = int(ROM.bytes(HARRY_LOWS, HARRY_POSES)[pose])
    return low + 256 * int(ROM.bytes(HARRY_HIGHS, HARRY_POSES)[pose])


def _harry(pose: int) -> np.ndarray:
    """The dots of Harry's rows."""
    return DISPLAY[_count_below(pose) + HARRY_ROWS - np.arange(HARRY_ROWS)]


def _cut(rows: np.ndarray) -> list[np.ndarray]:
    """A picture complete, without its first rows, and with only its first rows."""
    lower = [np.where(np.arange(len(rows)) < n, 0, rows) for n in CUTS]
    upper = [np.where(np.arange(len(rows)) < n, rows, 0) for n in CUTS]
    return [rows, *lower, *upper]


CREATURES = Pictures.of(
    (
        rows
        for kind in range(Kind.KINDS)
        for picture in range(2)
        for rows in _cut(_creature(kind, picture))
    ),
    kind=Kind.KINDS,
    picture=2,
    cut=1 + 2 * len(CUTS),
)
HARRYS = Pictures.of(_harry(pose) for pose in range(HARRY_POSES))
