"""Pairwise relations of objects: offset, distance, direction, and contact."""

import dataclasses
import math

import jax
import jax.numpy as jnp

from ocjax.extraction.objects import Objects, check_objects
from ocjax.vision.unknown import UNKNOWN

__all__ = ["Relations", "relations"]

_POINTS = 16  # of the compass


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True, repr=False)
class Relations:
    """The relations of each of `N` objects to each of `M` objects. `...` is the batch shape.

    Entry `[..., i, j]` describes object j as seen from object i, or is zero unless both are valid.
    """

    # float32 [..., N, M, 2]: from the centre of i to the centre of j, right and down, in pixels
    offset: jax.Array
    distance: jax.Array  # float32 [..., N, M]: length of the offset in pixels
    # int8 [..., N, M]: compass point of the offset, 0-15 clockwise from north; -1 (UNKNOWN) if it
    # is zero
    direction: jax.Array
    contact: jax.Array  # bool [..., N, M]: the boxes overlap or share a border or a corner
    valid: jax.Array  # bool [..., N, M]: both slots hold an object

    def __repr__(self) -> str:
        *batch, slots, others = self.valid.shape
        return f"Relations of {slots} slots to {others} slots, batch shape {batch}"


def _overlaps(
    start: jax.Array, size: jax.Array, other_start: jax.Array, other_size: jax.Array
) -> jax.Array:
    """Mark intervals that overlap or touch along one axis of the screen, bool `[..., N, M]`."""
    a, length = start[..., :, None], size[..., :, None]
    b, other_length = other_start[..., None, :], other_size[..., None, :]
    return (a <= b + other_length) & (b <= a + length)


@jax.jit
def _relations(objects: Objects, others: Objects) -> Relations:
    valid = objects.valid[..., :, None] & others.valid[..., None, :]
    offset = jnp.where(
        valid[..., None],
        others.center[..., None, :, :] - objects.center[..., :, None, :],
        jnp.float32(0),
    )
    dx, dy = offset[..., 0], offset[..., 1]
    turns = jnp.arctan2(dx, -dy) / jnp.float32(2 * math.pi)
    point = jnp.round(turns * _POINTS).astype(jnp.int8) % jnp.int8(_POINTS)
    nowhere = (dx == 0) & (dy == 0)
    direction = jnp.where(nowhere, jnp.where(valid, jnp.int8(UNKNOWN), jnp.int8(0)), point)
    contact = (
        _overlaps(objects.x, objects.w, others.x, others.w)
        & _overlaps(objects.y, objects.h, others.y, others.h)
        & valid
    )
    return Relations(offset, jnp.sqrt(dx * dx + dy * dy), direction, contact, valid)


def relations(objects: Objects, others: Objects | None = None) -> Relations:
    """Compute the relations between all pairs of objects; a pure function.

        # bool [..., 1, N]
        near = ocjax.relations(objects.of("Player"), objects).distance < 20

    Args:
        objects: of any batch shape; all slots, or the slots of a category (`Objects.of`).
        others: of the same batch shape; by default `objects`.

    Raises:
        TypeError: an argument is not an `Objects`.
        ValueError: the batch shapes differ.
    """
    others = objects if others is None else others
    check_objects("objects", objects)
    check_objects("others", others)
    if objects.valid.shape[:-1] != others.valid.shape[:-1]:
        shapes = list(objects.valid.shape[:-1]), list(others.valid.shape[:-1])
        raise ValueError(
            f"objects and others must have the same batch shape, got {shapes[0]} and {shapes[1]}"
        )
    return _relations(objects, others)
