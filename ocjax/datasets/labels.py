"""The objects of states by both methods, and the agreement of the methods."""

import dataclasses
import reprlib
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ocjax.evaluation import matching, metrics
from ocjax.evaluation.metrics import Agreement
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.files.pipeline import extractor

MOST = 1e15  # upper limit of a count
COUNTS = tuple(field.name for field in dataclasses.fields(Agreement))

Counts = dict[str, list[float]]  # by category: the fields of `Agreement`


class Labels(NamedTuple):
    """Objects of `n` states."""

    rem: Objects
    vem: Objects
    counts: Agreement  # [n, categories]; flickering objects may be on the frame before


def label(game: Game, rams: np.ndarray, screens: np.ndarray, previous: np.ndarray) -> Labels:
    """Extract the objects of states with both methods.

    Args:
        rams: uint8 `[n, 128]`.
        screens: uint8 `[n, H, 160]`, palette indices of the last emulated frame.
        previous: uint8 `[n, H, 160]`, the emulated frame before.
    """
    vem = extractor(game, "vem")
    rem, seen, before = extractor(game, "rem")(rams), vem(screens), vem(previous)
    counts = metrics.agreement(
        matching.detections(rem), matching.detections(seen), matching.detections(before)
    )
    return Labels(rem, seen, counts)


def to_counts(parts: Iterable[Agreement], game: Game) -> Counts:
    """The sums of counts `[n, categories]` by category, ready for JSON."""
    table = np.zeros((len(game.categories), len(COUNTS)))
    for part in parts:
        table += np.stack([getattr(part, name).sum(axis=0) for name in COUNTS], axis=1)
    return {c.name: row for c, row in zip(game.categories, table.tolist(), strict=True)}


def check_counts(counts: Any, game: Game) -> None:
    """Check counts from a file that `to_counts` wrote."""
    for c in game.categories:
        row = counts.get(c.name)
        known = isinstance(row, list) and all(
            isinstance(n, int | float) and not isinstance(n, bool) and 0 <= n < MOST for n in row
        )
        if not known or len(row) != len(COUNTS):
            raise ValueError(
                f"the counts of {c.name} must be {len(COUNTS)} numbers of at least 0, got "
                f"{reprlib.repr(row)}"
            )


def from_counts(parts: Sequence[Counts], game: Game) -> Agreement:
    """The sum of results of `to_counts`, `[categories]`."""
    table = np.array([[part[c.name] for c in game.categories] for part in parts])
    return Agreement(*table.sum(axis=0).T)
