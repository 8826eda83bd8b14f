"""`Category`: a kind of object, how it is found in frames and what is known of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ocjax.console import palette
from ocjax.extraction.html import table
from ocjax.vision.rules import Bounds, ByColor, Cells, Rule

__all__ = ["ATTRIBUTES", "HEADER", "Category", "display", "names_by_alias"]

ATTRIBUTES = ("orientation", "value")
HEADER = "category", "slots", "attributes", "what it is"  # of tables of categories


def _has_colors(rule: Rule) -> bool:
    """Whether an object that a rule finds may have one of several colours."""
    several = (
        [len(colors) for _, colors in rule.slots]
        if isinstance(rule, Bounds)
        else [len(rule.palette)]
    )
    return (isinstance(rule, Bounds) and rule.inverse) or max(several) > 1


@dataclass(frozen=True)
class Category:
    """A kind of object.

    Args:
        name: as OCAtari's users know it.
        rule: how VEM finds it.
        count: number of slots.
        hud: part of the display (score, lives, ...) rather than of the game.
        attributes: which of "value" and "orientation" are meaningful. VEM does not read
            orientations; it reports -1.
        rgb: colour, (r, g, b) or one entry per slot; the rule's first colour by default. With
            `rgb`, VEM does not read the colour.
        color_row: row of an object's box off which VEM reads the colour, at the row's first pixel
            of the rule's colours. A negative row counts from the bottom; one beyond the box is the
            last one.
        value: how VEM reads the value from the colour, if it does.
        doc: one line that says what the objects are.
        blinks: whether the objects are drawn only part of the time, with gaps longer than the
            single frame of ordinary flicker. REM reports them all the time.
        aliases: other names by which `game.slices`, `Objects.of` and `evaluation.from_records` know
            the category.
        needs: names of categories. VEM reports objects only on frames on which it finds an object
            of one of these, too. This is for screens that take the playfield's place and hold
            shapes in the objects' colours.
        otherwise: the rule that counts on frames on which `rule` finds nothing. This is for objects
            that for a moment have a colour that others may have, too.
    """

    name: str
    rule: Rule
    count: int = 1
    hud: bool = False
    attributes: tuple[str, ...] = ()
    rgb: tuple[Any, ...] | None = None
    color_row: int = 0
    value: ByColor | None = None
    doc: str = ""
    blinks: bool = False
    aliases: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    otherwise: Rule | None = None

    def __repr__(self) -> str:
        return (
            f"Category({self.name!r}, count={self.count}, hud={self.hud}, "
            f"attributes={self.attributes}, doc={self.doc!r})"
        )

    def row(self) -> tuple[str, int, str, str]:
        """What a table says of the category, by `HEADER`."""
        return self.name, self.count, ", ".join((*["hud"] * self.hud, *self.attributes)), self.doc

    def _repr_html_(self) -> str:
        """The category as a table for a notebook."""
        return table(HEADER, [self.row()])

    @property
    def has_places(self) -> bool:
        """Whether each slot stands for a place on the screen, so that VEM's objects never change their slots."""
        return self.on_grid or (isinstance(self.rule, Bounds) and self.rule.slot_count is not None)

    @property
    def on_grid(self) -> bool:
        """Whether each slot is a cell of a fixed grid, so that its object never moves."""
        return isinstance(self.rule, Cells) and not self.rule.floats

    @property
    def reads_value(self) -> bool:
        """Whether VEM reads a value of the objects: from a number, a gauge or their colour."""
        return self.value is not None or any(
            isinstance(rule, Bounds) and rule.value is not None
            for rule in (self.rule, self.otherwise)
        )

    @property
    def reads_color(self) -> bool:
        """Whether VEM reads an object's colour from the frame."""
        return self.rgb is None and any(
            _has_colors(rule) for rule in (self.rule, self.otherwise) if rule is not None
        )

    def slot_rgb(self, table: np.ndarray = palette.NTSC) -> np.ndarray:
        """The colour of each slot, uint8 `[count, 3]`; the rule's first colour where it is read from the frame."""
        if self.rgb is not None:
            colors = np.asarray(self.rgb)
        elif isinstance(self.rule, Bounds) and self.rule.slot_count is not None:
            colors = table[np.array([c[0] for _, c in self.rule.slots])]
        else:
            colors = table[self.rule.palette[0]]
        return np.broadcast_to(colors, (self.count, 3)).astype(np.uint8)


def display(name: str, rule: Rule, **options: Any) -> Category:
    """A category of the HUD that shows a value, such as the score, the lives or the time;
    `attributes=()` for one that shows none.

    Args:
        name: see `Category`.
        rule: likewise.
        options: further arguments of `Category`.
    """
    return Category(name, rule, **{"hud": True, "attributes": ("value",), **options})


def names_by_alias(categories: Iterable[Category]) -> dict[str, str]:
    """The name of the category that each alias stands for."""
    return {alias: c.name for c in categories for alias in c.aliases}
