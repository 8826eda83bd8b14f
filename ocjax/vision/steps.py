"""Steps that change the objects found by a rule, before their colours are read.

A game may define its own steps as subclasses of `Step`.
"""

import functools
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import jax
import jax.numpy as jnp

from ocjax._xla import kernels
from ocjax.console.boxes import WIDTH
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.detected import Detected, boxes
from ocjax.vision.shapes import check_number

__all__ = ["Context", "Packed", "Raised", "SideBySide", "Step", "Tight"]


class Context(NamedTuple):
    """Inputs of a step besides the objects."""

    pixels: Callable[[], Bitmap]  # pixels that the rule selects, in its region's rows
    top: int  # row of the screen where `pixels` begin
    found: Mapping[str, Detected]  # objects of all categories of `Blobs`
    slots: int  # slots of the category


class Step(ABC):
    """A step after a rule has found its objects."""

    @property
    def other(self) -> str | None:
        """The other category of `Blobs` that the step reads; None: no other."""
        return None

    keeps_slots: ClassVar[bool] = True  # whether objects stay in the slots of their rule

    @abstractmethod
    def __call__(self, found: Detected, context: Context) -> Detected:
        """Return the objects after the step, `[count, B]`."""


@dataclass(frozen=True)
class Tight(Step):
    """Fit boxes tightly around their pixels, also after a split; drop boxes without pixels."""

    def __call__(self, found: Detected, context: Context) -> Detected:
        """Apply the step."""
        top = context.top
        rows, columns = kernels.materialize(
            functools.partial(_marks, top), context.pixels(), found.box
        )
        (first, last), (upper, lower) = bm.columns(columns), bm.rows(rows)
        around = boxes(
            first, top + upper, last - first + 1, lower - upper + 1, found.valid & (lower >= 0)
        )
        return found._replace(box=around, head=None)


@dataclass(frozen=True)
class Raised(Step):
    """Begin boxes `rows` rows further up, but not above the screen."""

    rows: int

    def __post_init__(self) -> None:
        check_number("rows", self.rows, 1, WIDTH)

    def __call__(self, found: Detected, _: Context) -> Detected:
        """Apply the step."""
        y = jnp.maximum(found.y - self.rows, 0)
        return found._replace(box=boxes(found.x, y, found.w, found.y + found.h - y, found.valid))


@dataclass(frozen=True)
class SideBySide(Step):
    """Cut each box into adjacent objects of one width, from the left, in the first slots."""

    width: int

    def __post_init__(self) -> None:
        check_number("width", self.width, 1, WIDTH)

    keeps_slots = False

    def __call__(self, found: Detected, context: Context) -> Detected:
        """Apply the step."""
        parts = jnp.where(found.valid, -(-found.w // self.width), 0)
        number, box, overflow = _in_slots(found, parts, context.slots)
        whole, left = Detected(box), self.width * number
        width = jnp.minimum(self.width, whole.w - left)
        cut = boxes(whole.x + left, whole.y, width, whole.h, whole.valid)
        return Detected(cut, overflow=overflow)


@dataclass(frozen=True)
class Packed(Step):
    """Move the objects to the first slots of the category."""

    keeps_slots = False

    def __call__(self, found: Detected, context: Context) -> Detected:
        """Apply the step."""
        one = found.valid.astype(jnp.int32)
        _, box, overflow = _in_slots(found, one, context.slots)
        return Detected(box, overflow=overflow)


def _in_slots(
    found: Detected, parts: jax.Array, slots: int
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Deal the parts of objects, int32 `[n, B]` each, to the first slots.

    Returns:
        For each slot the number of its part, int32 `[slots, B]`, and the object's box or 0; and the
        number of parts without a slot, int32 `[B]`.
    """
    end = jnp.cumsum(parts, axis=0)
    rank = jnp.arange(slots, dtype=jnp.int32)[:, None]
    here = ((end - parts)[None] <= rank[:, None]) & (rank[:, None] < end[None])
    first, box = (
        jnp.sum(jnp.where(here, field[None], 0), axis=1, dtype=field.dtype)
        for field in (end - parts, found.box)
    )
    return rank - first, box, jnp.maximum(end[-1] - slots, 0)


def _marks(top: int, pixels: Bitmap, box: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Or the pixels of each box together, by row and by column.

    Args:
        top: row of the screen where `pixels` begin.

    Returns:
        uint32 `[rows, n, B]` and uint32 `[5, n, B]`.
    """
    found, row = Detected(box), top + jnp.arange(pixels.shape[1], dtype=jnp.int32)[:, None, None]
    inside = (row >= found.y[None]) & (row < (found.y + found.h)[None])
    within = jnp.where(
        inside[None],
        pixels[:, :, None] & bm.columns_between(found.x, found.x + found.w)[:, None],
        U(0),
    )
    return bm.any_of(within), bm.or_rows(within)
