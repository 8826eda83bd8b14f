"""Steps that change the objects found by a rule, before their colours are read.

A step is a function of the objects and of their `Context`. A game may define its own steps as
subclasses of `Step`.
"""

import functools
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp

from ocjax._xla import kernels
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.detected import Detected, boxes

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

    @property
    def keeps_slots(self) -> bool:
        """True if objects stay in the slots of their rule."""
        return True

    @abstractmethod
    def __call__(self, found: Detected, context: Context) -> Detected:
        """Return the objects after the step, `[count, B]`."""


@dataclass(frozen=True)
class Tight(Step):
    """Fit boxes tightly around their pixels, also after a component is split.

    Boxes without pixels are dropped.
    """

    def __call__(self, found: Detected, context: Context) -> Detected:
        """Return the objects after the step."""
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
    """Begin boxes `rows` rows further up, but not above the screen.

    This is for a player whose head has the colour of the other team's heads.
    """

    rows: int

    def __post_init__(self) -> None:
        if self.rows < 1:
            raise ValueError(f"rows must be at least 1, got {self.rows}")

    def __call__(self, found: Detected, _: Context) -> Detected:
        """Return the objects after the step."""
        y = jnp.maximum(found.y - self.rows, 0)
        return found._replace(box=boxes(found.x, y, found.w, found.y + found.h - y, found.valid))


@dataclass(frozen=True)
class SideBySide(Step):
    """Cut each box into adjacent objects of one width.

    The objects take the first slots, each box from the left.
    """

    width: int

    def __post_init__(self) -> None:
        if self.width < 1:
            raise ValueError(f"width must be at least 1 pixel, got {self.width}")

    @property
    def keeps_slots(self) -> bool:
        """False: objects take the first slots."""
        return False

    def __call__(self, found: Detected, context: Context) -> Detected:
        """Return the objects after the step."""
        parts = jnp.where(found.valid, -(-found.w // self.width), 0)
        upto = jnp.cumsum(parts, axis=0)
        rank = jnp.arange(context.slots, dtype=jnp.int32)[:, None]
        before, box = _pick(rank, upto - parts, upto, upto - parts, found.box)
        row = Detected(box)
        left = self.width * (rank - before)
        cut = boxes(
            row.x + left, row.y, jnp.minimum(self.width, row.w - left), row.h, rank < upto[-1:]
        )
        return Detected(cut, overflow=jnp.maximum(upto[-1] - context.slots, 0))


@dataclass(frozen=True)
class Packed(Step):
    """Move the objects to the first slots of the category."""

    @property
    def keeps_slots(self) -> bool:
        """False: objects take the first slots."""
        return False

    def __call__(self, found: Detected, context: Context) -> Detected:
        """Return the objects after the step."""
        one = found.valid.astype(jnp.int32)
        upto = jnp.cumsum(one, axis=0)
        (box,) = _pick(
            jnp.arange(context.slots, dtype=jnp.int32)[:, None], upto - one, upto, found.box
        )
        return Detected(box, overflow=jnp.maximum(upto[-1] - context.slots, 0))


def _pick(rank: jax.Array, first: jax.Array, end: jax.Array, *fields: jax.Array) -> list[jax.Array]:
    """Select, for each rank, the fields of the element with `first <= rank < end`, or zeros.

    Ranks are `[count, 1]`, fields `[n, B]`.
    """
    here = (first[None] <= rank[:, None]) & (rank[:, None] < end[None])
    return [jnp.sum(jnp.where(here, field[None], 0), axis=1, dtype=field.dtype) for field in fields]


def _marks(top: int, pixels: Bitmap, box: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Or the pixels of each box together, by row and by column.

    `top` is the row of the screen where `pixels` begin.

    Returns:
        The words of each row or-ed together, uint32 `[rows, n, B]`, and all rows or-ed together,
        uint32 `[5, n, B]`.
    """
    found, row = Detected(box), top + jnp.arange(pixels.shape[1], dtype=jnp.int32)[:, None, None]
    inside = (row >= found.y[None]) & (row < (found.y + found.h)[None])
    within = jnp.where(
        inside[None],
        pixels[:, :, None] & bm.columns_between(found.x, found.x + found.w)[:, None],
        U(0),
    )
    return bm.any_of(within), bm.or_rows(within)
