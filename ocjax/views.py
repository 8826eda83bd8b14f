"""The objects of one state as Python objects with OCAtari's attribute names."""

import dataclasses

import jax
import numpy as np

from ocjax.objects import Objects, whose


@dataclasses.dataclass(frozen=True)
class GameObject:
    """One object of one state, with its position one step before, for code written for OCAtari.

    Its attributes are the keys of the dicts of `Objects.to_list`, and further attributes of OCAtari's objects.

    Args:
        category: name of the category.
        slot: number of the slot within the category.
        x, y, w, h: left, top, width and height in pixels.
        rgb: colour.
        hud: whether it belongs to the HUD (score, lives, ...).
        prev_xy: top left corner one step before; the current one if the slot was empty then.
        value: score, lives, time, ...; None where the category has no value.
        orientation: compass point 0-15, clockwise from north; None where the category has none or VEM cannot tell it.
        visible: always True, because only valid objects are listed.
    """

    category: str
    slot: int
    x: int
    y: int
    w: int
    h: int
    rgb: tuple[int, int, int]
    hud: bool
    prev_xy: tuple[int, int]
    value: int | None = None
    orientation: int | None = None
    visible: bool = True

    @property
    def xy(self) -> tuple[int, int]:
        """Top left corner."""
        return self.x, self.y

    @property
    def wh(self) -> tuple[int, int]:
        """Width and height."""
        return self.w, self.h

    @property
    def xywh(self) -> tuple[int, int, int, int]:
        """Left, top, width and height."""
        return self.x, self.y, self.w, self.h

    @property
    def center(self) -> tuple[float, float]:
        """Centre."""
        return self.x + self.w / 2, self.y + self.h / 2

    @property
    def dx(self) -> int:
        """Movement to the right since the step before, in pixels."""
        return self.x - self.prev_xy[0]

    @property
    def dy(self) -> int:
        """Downward movement since the step before, in pixels."""
        return self.y - self.prev_xy[1]

    @property
    def h_coords(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Top left corners now and one step before."""
        return self.xy, self.prev_xy


def views(objects: Objects, before: Objects | None = None) -> list[GameObject]:
    """The valid objects of one state in slot order.

    Args:
        objects: objects of one state.
        before: objects of the step before; None in the first state of an episode.

    Raises:
        ValueError: the objects do not know their game.
    """
    game = whose(objects)
    previous = jax.tree.map(np.asarray, objects if before is None else before)
    out = []
    for record in objects.to_list():
        slot = game.slices[record["category"]].start + record["slot"]
        x, y = previous.xywh[slot, :2].tolist() if previous.valid[slot] else (record["x"], record["y"])
        out.append(GameObject(**record, prev_xy=(x, y)))
    return out
