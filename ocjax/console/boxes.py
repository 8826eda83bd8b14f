"""`Box`: a decoder's result for a category, before batching and packing into `Objects`."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from ocjax.console.ops import lookup, only

__all__ = ["WIDTH", "Area", "Box", "BoxTable", "Number", "box", "check_area", "choose", "edges"]

WIDTH = 160  # columns of the ALE screen
_MOST = 255  # maximum of a number in a `BoxTable`
_SHIFTS = np.array((0, 8, 16, 24))  # bit positions of its four numbers in a word

Number = jax.Array | np.ndarray | int | bool
# left, top, right, bottom in pixels; right and bottom are exclusive
Area = tuple[int, int, int, int]


def check_area(area: Area) -> None:
    """Check that an area is on the screen; the screen's height is not checked."""
    left, top, right, bottom = area
    if not (0 <= left < right <= WIDTH and 0 <= top < bottom):
        raise ValueError(
            f"a region is (left, top, right, bottom) with 0 <= left < right <= {WIDTH} and 0 <= "
            f"top < bottom, got {area}"
        )


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Box:
    """The objects of one category in one state, made by `box`.

    Each field is a scalar or has one entry per slot.
    """

    x: jax.Array  # int32: left edge
    y: jax.Array  # int32: top edge
    w: jax.Array  # int32: width
    h: jax.Array  # int32: height
    valid: jax.Array  # bool
    value: jax.Array  # int32
    orientation: jax.Array  # int32
    color: jax.Array | None  # int32: palette index; None: the category's colour

    def clip(self, left: Number, top: Number, right: Number, bottom: Number) -> Box:
        """Clip the boxes to an area; `right` and `bottom` are exclusive.

        Boxes outside become invalid.

        Raises:
            ValueError: an edge is a number beyond the screen, where every box is clipped anyway.
        """
        if isinstance(left, int) and isinstance(right, int) and not 0 <= left < right <= WIDTH:
            raise ValueError(
                f"boxes are clipped to columns from 0 to {WIDTH}, got {left} to {right}"
            )
        x0, y0 = jnp.maximum(self.x, left), jnp.maximum(self.y, top)
        w = jnp.minimum(self.x + self.w, right) - x0
        h = jnp.minimum(self.y + self.h, bottom) - y0
        return replace(self, x=x0, y=y0, w=w, h=h, valid=self.valid & (w > 0) & (h > 0))

    def trimmed(
        self, left: Number = 0, top: Number = 0, right: Number = 0, bottom: Number = 0
    ) -> Box:
        """Remove this many pixels at each edge; a negative number adds pixels."""
        return replace(
            self, x=self.x + left, y=self.y + top, w=self.w - left - right, h=self.h - top - bottom
        )

    def __getitem__(self, slots: int | slice) -> Box:
        """Index the slots; scalar fields, which all slots share, stay the same."""

        def part(values: jax.Array | None) -> jax.Array | None:
            return values if values is None or values.ndim == 0 else values[slots]

        return Box(*(part(getattr(self, f.name)) for f in fields(self)))  # pyright: ignore

    def where(self, condition: Number) -> Box:
        """Keep the boxes valid only where the condition also holds."""
        return replace(self, valid=self.valid & condition)

    def only(self, chosen: Number = True) -> Box:
        """Return the single valid box among the chosen ones, as a scalar; invalid without one."""
        found = self.valid & chosen
        one = jax.tree.map(lambda values: only(found, values.astype(jnp.int32)), self)
        return replace(one, valid=jnp.any(found))

    @property
    def slots(self) -> int:
        """The number of slots; 1 if all fields are scalars."""
        return max(v.size for f in fields(self) if (v := getattr(self, f.name)) is not None)

    @staticmethod
    def stacked(*parts: Box) -> Box:
        """Return the slots of several boxes, one after the other.

        Raises:
            ValueError: some boxes have a colour, and others do not.
        """
        if len({part.color is None for part in parts}) > 1:
            raise ValueError("stacked boxes need a colour each, or none of them has one")
        every = [[getattr(part, f.name) for part in parts] for f in fields(Box)]
        sizes = [part.slots for part in parts]
        return Box(*(_end_to_end(values, sizes) for values in every))  # pyright: ignore


def _end_to_end(values: list[jax.Array | None], sizes: list[int]) -> jax.Array | None:
    """Concatenate values after repeating each to its size; None without values."""
    some = [
        jnp.broadcast_to(value, size)
        for value, size in zip(values, sizes, strict=True)
        if value is not None
    ]
    return jnp.concatenate(some) if some else None


def box(
    x: Number,
    y: Number,
    w: Number,
    h: Number,
    valid: Number = True,
    value: Number = 0,
    orientation: Number = 0,
    color: Number | None = None,
) -> Box:
    """Make boxes from left, top, width and height in pixels of the ALE screen.

    Boxes are clipped to the screen later, and empty boxes become invalid. Fields may have any value
    where `valid` is False.

    Args:
        x, y, w, h: scalars, or vectors with one entry per slot of the category.
        valid: whether the game has the object in play.
        value: score, lives, time, ... of categories that declare it.
        orientation: compass point 0-15, clockwise from north, of categories that declare it.
        color: palette index of the drawn colour, if it changes; None: the category's colour.
    """
    x, y, w, h, value, orientation = (
        jnp.asarray(v, jnp.int32) for v in (x, y, w, h, value, orientation)
    )
    return Box(
        x,
        y,
        w,
        h,
        jnp.asarray(valid, jnp.bool_),
        value,
        orientation,
        None if color is None else jnp.asarray(color, jnp.int32),
    )


def edges(
    left: Number, top: Number, right: Number, bottom: Number, valid: Number = True, **fields: Any
) -> Box:
    """Make boxes from their edges in pixels of the ALE screen; `right` and `bottom` are exclusive.

    Args:
        left, top, right, bottom: scalars, or vectors with one entry per slot of the category.
        valid: see `box`.
        fields: `value`, `orientation` and `color` of `box`.
    """
    left, top, right, bottom = (jnp.asarray(v, jnp.int32) for v in (left, top, right, bottom))
    return box(left, top, right - left, bottom - top, valid, **fields)


class BoxTable:
    """A table of known boxes, selected by an index.

    Args:
        rows: left, top, width and height of each box, 0 to 255, `[n, 4]`. Rows of zeros have no
            box.

    Raises:
        ValueError: the rows have another shape, or a number is out of range.
    """

    def __init__(self, rows: ArrayLike) -> None:
        table = np.asarray(rows, np.int64)
        if table.ndim != 2 or table.shape[1] != 4 or table.min() < 0 or table.max() > _MOST:
            raise ValueError(
                f"rows must be [n, 4] numbers from 0 to {_MOST}, got an array of shape "
                f"{table.shape}"
            )
        # A box is one number, because a look-up costs more than shifts.
        self._packed = (table << _SHIFTS).sum(axis=1).astype(np.uint32).view(np.int32)

    def at(
        self, index: jax.Array, *, x: Number = 0, y: Number = 0, valid: Number = True, **fields: Any
    ) -> Box:
        """Return the boxes at an index; an index out of range takes the nearest box.

        Args:
            index: int32, a scalar or one entry per slot.
            x, y: columns and rows to add to the boxes' positions.
            valid: see `box`.
            fields: `value`, `orientation` and `color` of `box`.
        """
        packed = lookup(self._packed, index)
        left, top, width, height = (packed >> int(shift) & _MOST for shift in _SHIFTS)
        return box(x + left, y + top, width, height, valid, **fields)


def choose(condition: Number, yes: Box, no: Box) -> Box:
    """Select between boxes of equal shapes, slot by slot."""
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)
