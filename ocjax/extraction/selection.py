"""`Selection`: slots of some categories in a fixed order, even if the game gains objects."""

import reprlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.extraction.categories import ATTRIBUTES, Category, names_by_alias
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects

__all__ = ["Selection", "Slots"]


@dataclass(frozen=True)
class Slots:
    """The first slots of a category, with everything that determines their reading.

    Args:
        hud: whether they belong to the display.
        on_grid: whether each is a cell of a fixed grid.
        attributes: attributes to read, of "orientation" and "value"; the others are 0.
    """

    category: str
    count: int
    hud: bool = False
    on_grid: bool = False
    attributes: tuple[str, ...] = ()


@dataclass(frozen=True, repr=False)
class _Selected(Category):
    grid: bool = False

    @property
    def on_grid(self) -> bool:
        """True if each slot is a cell of a fixed grid."""
        return self.grid


class Selection:
    """Slots of a game.

    Args:
        slots: of each category, in the selection's order.

    Attributes:
        slots: see the arguments.
        game: describes the selected slots: categories, counts and places. It cannot extract
            objects.
    """

    def __init__(self, game: Game, slots: Sequence[Slots]) -> None:
        names = names_by_alias(game.categories)
        by_name = {c.name: c for c in game.categories}
        found = [
            _find(game, own, by_name.get(names.get(own.category, own.category))) for own in slots
        ]
        if not found or len({c.name for c in found}) < len(found):
            raise ValueError(
                "select at least one category, and none twice, got "
                f"{reprlib.repr([s.category for s in slots])}"
            )
        self.slots = tuple(slots)
        self.game = _described(
            game, tuple(_selected(c, own) for c, own in zip(found, slots, strict=True))
        )
        firsts = [
            (game.slices[c.name].start, own.count) for c, own in zip(found, slots, strict=True)
        ]
        self._index = np.concatenate([np.arange(first, first + count) for first, count in firsts])

    def of(self, objects: Objects) -> Objects:
        """Select the slots from the game's objects of batch shape `[B]`."""
        picked = jax.tree.map(lambda field: field[:, self._index], objects)
        read = {
            name: np.repeat(
                [name in s.attributes for s in self.slots], [s.count for s in self.slots]
            )
            for name in ATTRIBUTES
        }
        kept = {
            name: jnp.where(mask, getattr(picked, name), getattr(picked, name).dtype.type(0))
            for name, mask in read.items()
        }
        return replace(picked, **kept, game=self.game)


def _find(game: Game, slots: Slots, category: Category | None) -> Category:
    name = reprlib.repr(slots.category)
    if category is None:
        known = ", ".join(c.name for c in game.categories)
        raise ValueError(
            f"expected {slots.count} slots of the category {name}, but {game.name} has only the "
            f"categories {known}"
        )
    if category.count < slots.count:
        raise ValueError(
            f"expected {slots.count} slots of the category {name}, but {game.name} has "
            f"{category.count}"
        )
    lacking = set(slots.attributes) - set(category.attributes)
    if lacking:
        raise ValueError(
            f"expected the category {name} with {', '.join(sorted(lacking))}, but {game.name} "
            "has it without"
        )
    return category


def _selected(category: Category, slots: Slots) -> Category:
    same = {field.name: getattr(category, field.name) for field in fields(Category)}
    described = {
        "name": slots.category,
        "count": slots.count,
        "hud": slots.hud,
        "attributes": slots.attributes,
        "aliases": (),
    }
    return _Selected(**{**same, **described}, grid=slots.on_grid)


def _described(game: Game, categories: Iterable[Category]) -> Game:
    """Return the game with other categories in any order; its decoder need not return them."""
    described = object.__new__(Game)
    vars(described).update(
        {field.name: getattr(game, field.name) for field in fields(game)}, categories=categories
    )
    return described
