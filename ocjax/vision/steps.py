"""Steps: what is done with the objects that a rule has found, before their colours are read.

A step is a function of the objects and of their `Context`. A game may define its own, as a subclass
of `Step`.
"""

from __future__ import annotations

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

__all__ = ["Context", "EndsAbove", "Packed", "Raised", "SideBySide", "Step", "Tight", "tight"]


class Context(NamedTuple):
    """What a step may look at."""

    pixels: Callable[[], Bitmap]  # those that count for the rule, in the rows of its region
    top: int  # row of the screen where these begin
    found: Mapping[str, Detected]  # the objects of all categories of `Blobs`
    slots: int  # of the category


class Step(ABC):
    """A step after a rule has found its objects."""

    @property
    def other(self) -> str | None:
        """The other category of `Blobs` whose objects the step looks at, if any."""
        return None

    @property
    def keeps_slots(self) -> bool:
        """Whether objects stay in the slots in which the rule finds them."""
        return True

    @abstractmethod
    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step, `[count, B]`."""


@dataclass(frozen=True)
class Tight(Step):
    """Boxes fit tightly around their pixels, also those of the objects of a component that is split. One without pixels is dropped."""

    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step."""
        return tight(found, context, found.valid)


@dataclass(frozen=True)
class EndsAbove(Step):
    """A box ends above the objects of another category that begin inside it, and fits tightly
    around the pixels that are left.

    This is for a driver above the car of which he has a colour. The limits of the rule's shapes
    count for the whole box.

    Args:
        name: the other category, of `Blobs`.
    """

    name: str

    @property
    def other(self) -> str:
        """The other category."""
        return self.name

    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step."""
        lower = context.found[self.name]
        x, y, w, h = (v[:, None] for v in (found.x, found.y, found.w, found.h))
        x2, y2, w2 = (v[None] for v in (lower.x, lower.y, lower.w))
        inside = lower.valid[None] & (x2 < x + w) & (x < x2 + w2) & (y2 > y) & (y2 < y + h)
        left = jnp.minimum(found.h, jnp.min(jnp.where(inside, y2 - y, h), axis=1))
        shorter = found._replace(box=boxes(found.x, found.y, found.w, left, found.valid))
        return tight(shorter, context, left < found.h)


@dataclass(frozen=True)
class Raised(Step):
    """Boxes begin some rows further up, but not above the screen, as for a head whose colour the other team's heads have, too."""

    rows: int

    def __post_init__(self) -> None:
        if self.rows < 1:
            raise ValueError(f"rows must be at least 1, got {self.rows}")

    def __call__(self, found: Detected, _: Context) -> Detected:
        """The objects after the step."""
        y = jnp.maximum(found.y - self.rows, 0)
        return found._replace(box=boxes(found.x, y, found.w, found.y + found.h - y, found.valid))


@dataclass(frozen=True)
class SideBySide(Step):
    """Each box is cut into objects of one width that stand side by side without gaps; they take the first slots, each box from the left."""

    width: int

    def __post_init__(self) -> None:
        if self.width < 1:
            raise ValueError(f"width must be at least 1 pixel, got {self.width}")

    @property
    def keeps_slots(self) -> bool:
        """No: objects take the first slots."""
        return False

    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step."""
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
    """The objects take the first slots of the category."""

    @property
    def keeps_slots(self) -> bool:
        """No: objects take the first slots."""
        return False

    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step."""
        one = found.valid.astype(jnp.int32)
        upto = jnp.cumsum(one, axis=0)
        (box,) = _pick(
            jnp.arange(context.slots, dtype=jnp.int32)[:, None], upto - one, upto, found.box
        )
        return Detected(box, overflow=jnp.maximum(upto[-1] - context.slots, 0))


def _pick(rank: jax.Array, first: jax.Array, end: jax.Array, *fields: jax.Array) -> list[jax.Array]:
    """For each rank `[count, 1]` the fields `[n, B]` of the element with `first <= rank < end`; zeros without one."""
    here = (first[None] <= rank[:, None]) & (rank[:, None] < end[None])
    return [jnp.sum(jnp.where(here, field[None], 0), axis=1, dtype=field.dtype) for field in fields]


def tight(found: Detected, context: Context, which: jax.Array) -> Detected:
    """The same objects, with tight boxes around the pixels in those of some of them, bool `[count, B]`; one without pixels is dropped."""
    top = context.top
    rows, columns = kernels.materialize(functools.partial(_marks, top), context.pixels(), found.box)
    (first, last), (upper, lower) = bm.columns(columns), bm.rows(rows)
    around = boxes(
        first, top + upper, last - first + 1, lower - upper + 1, found.valid & (lower >= 0)
    )
    return found._replace(box=jnp.where(which, around, found.box), head=None)


def _marks(top: int, pixels: Bitmap, box: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The words of each row of each box or-ed together, uint32 `[rows, n, B]`, and those of its
    rows, `[5, n, B]`.

    `top` is the row of the screen where `pixels` begin.
    """
    found, row = Detected(box), top + jnp.arange(pixels.shape[1], dtype=jnp.int32)[:, None, None]
    inside = (row >= found.y[None]) & (row < (found.y + found.h)[None])
    within = jnp.where(
        inside[None],
        pixels[:, :, None] & bm.columns_between(found.x, found.x + found.w)[:, None],
        U(0),
    )
    return bm.any_of(within), bm.or_rows(within)
