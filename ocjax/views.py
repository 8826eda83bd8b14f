"""Objects one by one, with the names that OCAtari's users know."""

import dataclasses

import jax
import numpy as np

from ocjax.objects import Objects, whose


@dataclasses.dataclass(frozen=True)
class GameObject:
    """One object on the screen, as code written for OCAtari reads it."""

    category: str
    slot: int  # within its category
    x: int
    y: int
    w: int
    h: int
    rgb: tuple[int, int, int]
    hud: bool
    prev_xy: tuple[int, int]  # its top left corner one step before; where it was not there, the present one
    value: int | None = None  # where its category has one
    orientation: int | None = None  # compass point 0-15, clockwise from north, where its category has one
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
        """Top left corner, width and height."""
        return self.x, self.y, self.w, self.h

    @property
    def center(self) -> tuple[float, float]:
        """Centre."""
        return self.x + self.w / 2, self.y + self.h / 2

    @property
    def dx(self) -> int:
        """Movement to the right since the step before."""
        return self.x - self.prev_xy[0]

    @property
    def dy(self) -> int:
        """Movement downwards since the step before."""
        return self.y - self.prev_xy[1]

    @property
    def h_coords(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Top left corners now and one step before."""
        return self.xy, self.prev_xy


def views(objects: Objects, before: Objects | None = None) -> list[GameObject]:
    """The valid objects of one state, in the order of their slots.

    Args:
        objects: of one state.
        before: of the step before, where the episode was running.

    Raises:
        ValueError: the objects do not know their game.
    """
    game = whose(objects)
    now = jax.tree.map(np.asarray, objects)
    then = jax.tree.map(np.asarray, objects if before is None else before)
    out = []
    for slot in np.flatnonzero(now.valid):
        category = game.categories[game.slot_category[slot]]
        x, y, w, h = now.xywh[slot].tolist()
        prev_x, prev_y = then.xywh[slot, :2].tolist() if then.valid[slot] else (x, y)
        value, orientation = (int(getattr(now, name)[slot]) if name in category.attributes else None for name in ("value", "orientation"))
        number = int(slot) - game.slices[category.name].start
        rgb = tuple(now.rgb[slot].tolist())
        out.append(GameObject(category.name, number, x, y, w, h, rgb, category.hud, (prev_x, prev_y), value, orientation))
    return out
