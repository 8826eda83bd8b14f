"""Fourth stage: select the components that are objects, and compute their boxes."""

from typing import NamedTuple

import jax
import jax.numpy as jnp

from ocjax._xla.kernels import materialize
from ocjax.vision.components.candidates import Candidates
from ocjax.vision.components.layout import Entries, Layout
from ocjax.vision.components.measuring import Measured
from ocjax.vision.components.search import MAX_PARTS, UNLIMITED
from ocjax.vision.components.splitting import Edges, replaced_by_two, split
from ocjax.vision.detected import words
from ocjax.vision.pictures import largest


class Accepted(NamedTuple):
    """The boxes of components and their numbers of objects, int32 `[n]` each."""

    x: jax.Array
    y: jax.Array
    w: jax.Array
    h: jax.Array
    part_w: jax.Array  # size of one object, if the component is split
    part_h: jax.Array
    across: jax.Array  # objects side by side
    down: jax.Array  # objects one below the other
    n_parts: jax.Array  # number of objects; 0: the component is rejected


def _quotient(a: jax.Array, b: jax.Array) -> jax.Array:
    """Compute `a // b` of int32 from 0 to 2**20.

    XLA vectorises the division of floats only: Berzerk takes 28 us per frame instead of 33. The
    added half keeps the quotient away from integers, so rounding is safe.
    """
    return ((a.astype(jnp.float32) + 0.5) / b.astype(jnp.float32)).astype(jnp.int32)


def _to_cover(size: jax.Array, part: jax.Array) -> jax.Array:
    return sum(
        ((size > part * i).astype(jnp.int32) for i in range(1, MAX_PARTS)),
        start=jnp.ones_like(size),
    )


def accept(
    layout: Layout, candidates: Candidates, measured: Measured, entries: Entries, exists: jax.Array
) -> Accepted:
    """Apply the limits of each candidate's search, given the table entries of its mask."""
    w, h = measured.right - measured.left + 1 - entries.gap_x, measured.height - entries.gap_y
    part_w = part_h = jnp.full_like(w, UNLIMITED)
    good = jnp.zeros_like(exists)
    for shape, reads_pixels in reversed(
        list(zip(entries.limits, layout.reads_pixels, strict=True))
    ):
        met = (w >= shape.min_w) & (h >= shape.min_h) & (w <= shape.max_w) & (h <= shape.max_h)
        if reads_pixels:
            met = met & (measured.area >= shape.min_pixels) & (measured.area <= shape.max_pixels)
        part_w, part_h = jnp.where(met, shape.part_w, part_w), jnp.where(met, shape.part_h, part_h)
        good = good | met
    good = good & exists & measured.is_first & measured.is_complete
    across = _to_cover(w, part_w)
    down = jnp.minimum(_to_cover(h, part_h), _quotient(jnp.full_like(w, MAX_PARTS), across))
    return Accepted(
        measured.left,
        candidates.row - entries.screen_top,
        w,
        h,
        part_w,
        part_h,
        across,
        down,
        jnp.where(good, across * down, 0),
    )


def boxes(layout: Layout, a: Accepted) -> jax.Array:
    """Compute the boxes of each component's objects as words, uint32 `[parts, n]`.

    The objects of a component that is split are spaced evenly from edge to edge.
    """
    if not layout.splits:
        return words(a.x, a.y, a.w, a.h)[None]
    part = jnp.broadcast_to(jnp.arange(MAX_PARTS, dtype=jnp.int32)[:, None], (MAX_PARTS, len(a.x)))
    a = Accepted(*(v[None] for v in a))
    row = _quotient(part, a.across)
    column = part - row * a.across
    x = a.x + _quotient(column * (a.w - a.part_w), jnp.maximum(a.across - 1, 1))
    y = a.y + _quotient(row * (a.h - a.part_h), jnp.maximum(a.down - 1, 1))
    return words(x, y, jnp.where(a.across > 1, a.part_w, a.w), jnp.where(a.down > 1, a.part_h, a.h))


def split_by_pictures(
    layout: Layout,
    candidates: Candidates,
    accepted: Accepted,
    objects: jax.Array,
    filled: jax.Array,
    entries: Entries,
) -> tuple[Accepted, jax.Array]:
    """Split components in two if they are larger than their search's pictures and one fits."""
    begin = candidates.column - layout.window.before
    edges = Edges(
        entries.left - candidates.column,
        entries.right - candidates.column,
        entries.bottom - candidates.row,
    )
    n_parts = accepted.n_parts
    for i, pictures in enumerate(layout.pictures):
        both = split(filled, layout.window.before, edges, pictures)
        width, height = largest(pictures)
        eligible = (
            ((accepted.w > width) | (accepted.h > height)) & (n_parts > 0) & (entries.pictures == i)
        )
        n_parts, objects = materialize(
            replaced_by_two, n_parts, objects, eligible, begin, accepted.y, *both, small=0
        )
    return accepted._replace(n_parts=n_parts), objects
