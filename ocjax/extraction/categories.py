"""`Category`: a kind of object, the rule that finds it in frames, and its properties."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from ocjax.console import palette
from ocjax.extraction.html import table
from ocjax.vision.colors import Colors, color_set
from ocjax.vision.rules import Bounds, Cells, Rule

__all__ = ["ATTRIBUTES", "HEADER", "ROLES", "Category", "display", "names_by_alias", "with_role"]

ATTRIBUTES = ("orientation", "value")
ROLES = ("player", "score", "opponent_score", "lives", "time")
HEADER = "category", "slots", "attributes", "meaning"  # of tables of categories


def _has_colors(rule: Rule) -> bool:
    if not isinstance(rule, Bounds):
        return len(rule.palette) > 1
    return rule.inverse or any(len(colors) > 1 for _, colors in rule.slots)


@dataclass(frozen=True)
class Category:
    """A kind of object.

    Args:
        name: the name that OCAtari uses.
        rule: the rule with which VEM finds the objects.
        count: number of slots.
        hud: whether it belongs to the display (score, lives, ...) rather than to the game.
        role: the purpose of the objects, one of `ROLES`, or "". "player": the agent controls them.
            "score": the value is the sum of the rewards since the episode began, or exceeds it by
            the value of the category with the role "opponent_score"; of several slots, the first.
            "lives": the value is the emulator's number of lives, or each life has an icon. "time":
            a clock.
        attributes: the meaningful ones of "value" and "orientation". VEM does not read
            orientations; it reports -1.
        rgb: colour, (r, g, b) or one entry per slot; VEM then does not read it. By default, the
            rule's first colour.
        color_row: row of an object's box. VEM reads the colour of the row's first pixel with one of
            the rule's colours. A negative row counts from the bottom; a row beyond the box means
            the last one.
        value: how VEM reads the value from the colour: a `ByColor`, or a function of the objects'
            palette indices, int32 `[count, B]`, and of the frames, uint8 `[B, H, 160]`, that
            returns their values, int32 `[count, B]`. None: VEM does not.
        doc: a line that describes the objects.
        blinks: whether the objects are drawn only part of the time, with gaps longer than the
            single frame of ordinary flicker.
        aliases: other names for the category in `game.slices`, `Objects.of` and
            `evaluation.from_records`.
        needs: names of categories. VEM reports objects only on frames on which it also finds an
            object of one of these, for screens that replace the playfield.
        otherwise: the rule for frames on which `rule` finds nothing, for objects that briefly have
            a colour that other objects may have, too.
        colors: the palette indices of the objects' own pixels in their boxes (`ocjax.segment`), for
            all slots, or a tuple with one entry per slot; the rules' colours by default.
        ram_color: False if the RAM lacks the objects' colours. REM then reports black.
    """

    name: str
    rule: Rule
    count: int = 1
    hud: bool = False
    role: str = ""
    attributes: tuple[str, ...] = ()
    rgb: tuple[Any, ...] | None = None
    color_row: int = 0
    value: Callable[[jax.Array, jax.Array], jax.Array] | None = None
    doc: str = ""
    blinks: bool = False
    aliases: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    otherwise: Rule | None = None
    colors: Colors | tuple[Colors, ...] | None = None
    ram_color: bool = True

    def __repr__(self) -> str:
        return (
            f"Category({self.name!r}, count={self.count}, hud={self.hud}, role={self.role!r}, "
            f"attributes={self.attributes}, doc={self.doc!r})"
        )

    def row(self) -> tuple[str, int, str, str]:
        """The category's row in a table with the columns `HEADER`."""
        return self.name, self.count, ", ".join((*["hud"] * self.hud, *self.attributes)), self.doc

    def _repr_html_(self) -> str:
        return table(HEADER, [self.row()])

    @property
    def has_places(self) -> bool:
        """True if each slot has a place on the screen, so that VEM's objects keep their slots."""
        return self.on_grid or (isinstance(self.rule, Bounds) and self.rule.slot_count is not None)

    @property
    def on_grid(self) -> bool:
        """True if each slot is a cell of a fixed grid, so that its object never moves."""
        return isinstance(self.rule, Cells) and not self.rule.floats

    @property
    def reads_value(self) -> bool:
        """True if VEM reads the objects' value: from a number, a gauge or their colour."""
        return self.value is not None or any(
            isinstance(rule, Bounds) and rule.value is not None
            for rule in (self.rule, self.otherwise)
        )

    @property
    def reads_color(self) -> bool:
        """True if VEM reads an object's colour from the frame."""
        return self.rgb is None and any(
            _has_colors(rule) for rule in (self.rule, self.otherwise) if rule is not None
        )

    @property
    def has_background(self) -> bool:
        """True if `slot_colors` are the background's, and all other pixels are the objects'."""
        return isinstance(self.rule, Bounds) and self.rule.inverse and self.colors is None

    def slot_colors(self) -> tuple[tuple[int, ...], ...]:
        """The palette indices of each slot's pixels, or of the background in its box."""
        if self.colors is None:
            return self._rule_colors()
        if isinstance(self.colors, tuple) and any(isinstance(c, tuple) for c in self.colors):
            return tuple(color_set(own) for own in self.colors)
        return (color_set(self.colors),) * self.count  # pyright: ignore[reportArgumentType]

    def _rule_colors(self) -> tuple[tuple[int, ...], ...]:
        rule, other = self.rule, () if self.otherwise is None else self.otherwise.palette
        if isinstance(rule, Bounds) and rule.slot_count == self.count:
            return tuple(tuple(dict.fromkeys((*colors, *other))) for _, colors in rule.slots)
        return (tuple(dict.fromkeys((*rule.palette, *other))),) * self.count

    def slot_rgb(self, table: np.ndarray = palette.NTSC) -> np.ndarray:
        """Return the colour of each slot, uint8 `[count, 3]`.

        If VEM reads the colour from the frame, this is the rule's first colour.
        """
        if self.rgb is not None:
            colors = np.asarray(self.rgb)
        elif isinstance(self.rule, Bounds) and self.rule.slot_count is not None:
            colors = table[np.array([c[0] for _, c in self.rule.slots])]
        else:
            colors = table[self.rule.palette[0]]
        return np.broadcast_to(colors, (self.count, 3)).astype(np.uint8)


def display(name: str, rule: Rule, **options: Any) -> Category:
    """Make a category of the display that shows a value, such as score, lives or time.

    `options` are further arguments of `Category`, such as `attributes=()` without a value.
    """
    return Category(name, rule, **{"hud": True, "attributes": ("value",), **options})


def with_role(categories: Iterable[Category], role: str) -> tuple[str, ...]:
    """Return the names of the categories with a role."""
    return tuple(c.name for c in categories if c.role == role)


def names_by_alias(categories: Iterable[Category]) -> dict[str, str]:
    """Map each alias to the name of its category."""
    return {alias: c.name for c in categories for alias in c.aliases}
