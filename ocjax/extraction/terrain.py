"""The declaration of a game's terrain: its walls, ladders, water and scenery."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from ocjax.console.boxes import WIDTH

__all__ = ["COVERED", "DRAWN", "EFFECTS", "Masks", "TerrainKind", "TerrainMap"]

EFFECTS = ("blocks", "carries", "kills")
DRAWN = ("playfield", "background", "sprites")
COVERED = 1  # an odd palette index, instead of the pixels of objects in `TerrainMap.seen`

Masks = dict[str, jax.Array]  # bool [H, 160] of each kind


@dataclass(frozen=True)
class TerrainKind:
    """A kind of terrain.

    Args:
        name: the field's word in lower case: "wall", "ladder", "water", ...
        doc: a description in one line.
        effect: "blocks", "carries" or "kills" the player; None for scenery.
        drawn: "playfield", "background" (the colour of the background register) or "sprites".
        category: the category whose objects are the same thing, or None.
    """

    name: str
    doc: str
    effect: str | None = None
    drawn: str = "playfield"
    category: str | None = None


@dataclass(frozen=True, eq=False)
class TerrainMap:
    """The terrain of a game, from RAM and from pixels.

    Args:
        kinds: all kinds.
        layouts: the layouts that the ROM holds, bool `[layouts, kinds, H, 160]`.
        seen: finds each kind in a frame, uint8 `[H, 160]` of even palette indices. The pixels of
            objects are `COVERED`, except objects of the kinds' categories. For each name in `boxes`
            it also gets the pixels in the boxes of this category, bool `[H, 160]`.
        layout: index of a state's layout, from its wrapped RAM; None if there is one layout.
        changes: the masks of a state, from its wrapped RAM and the masks of its layout, if play
            changes the terrain.
        boxes: categories whose boxes `seen` gets.
    """

    kinds: Sequence[TerrainKind]
    layouts: np.ndarray
    seen: Callable[..., Masks]
    layout: Callable[[Any], jax.Array] | None = None
    changes: Callable[[Any, Masks], Masks] | None = None
    boxes: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the kinds."""
        return tuple(kind.name for kind in self.kinds)

    def problem(self, height: int, categories: set[str]) -> str:
        """Describe what is wrong with the declaration; empty if nothing is."""
        if len(set(self.names)) != len(self.names) or not self.names:
            return f"the kinds must have different names, got {self.names}"
        for kind in self.kinds:
            if kind.effect not in (None, *EFFECTS) or kind.drawn not in DRAWN:
                return f"{kind.name}: effect must be of {EFFECTS} and drawn of {DRAWN}, got {kind}"
            if kind.category is not None and kind.category not in categories:
                return f"{kind.name}: {kind.category!r} is not a category"
        unknown = set(self.boxes) - categories
        if unknown:
            return f"boxes: no categories are named {sorted(unknown)}"
        expected = (len(self.kinds), height, WIDTH)
        if self.layouts.dtype != np.bool_ or self.layouts.shape[1:] != expected:
            return (
                f"layouts must be bool [layouts, {', '.join(map(str, expected))}], got "
                f"{self.layouts.dtype} {list(self.layouts.shape)}"
            )
        return ""
