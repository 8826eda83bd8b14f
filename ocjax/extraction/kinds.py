"""`Kinds`: a table of the kinds of object that a game's records hold, one entry per kind."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

import jax

from ocjax.console.boxes import Box
from ocjax.console.ops import among
from ocjax.extraction.categories import Category

__all__ = ["KindEntry", "Kinds"]


@dataclass(frozen=True)
class KindEntry:
    """A kind of object. A game may add its own facts in a subclass.

    Args:
        category: its category, with the rule with which VEM finds it.
        values: the values of a record's kind or state that mean it.
    """

    category: Category
    values: Sequence[int]


_Entry = TypeVar("_Entry", bound=KindEntry)


class Kinds(Generic[_Entry]):
    """All kinds that a record can be.

    Args:
        entries: the kinds, in the order of their categories.
    """

    def __init__(self, *entries: _Entry) -> None:
        self.entries = entries

    @property
    def categories(self) -> tuple[Category, ...]:
        """The categories of all kinds."""
        return tuple(entry.category for entry in self.entries)

    def split(self, boxes: Box, kind: jax.Array) -> dict[str, Box]:
        """Return each category's boxes: those of the records of its kind.

        Args:
            boxes: of all records.
            kind: the kind or state of each record.
        """
        return {
            entry.category.name: boxes.where(among(kind, entry.values)) for entry in self.entries
        }
