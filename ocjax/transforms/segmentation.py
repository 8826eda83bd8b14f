"""Assign the pixels of frames to objects."""

import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer

from ocjax.extraction.arrays import as_array, require_uint8
from ocjax.extraction.objects import Objects, whose
from ocjax.extraction.ownership import NOBODY, owners_of

__all__ = ["NOBODY", "masks", "segment"]


def segment(objects: Objects, frames: jax.Array | np.ndarray) -> jax.Array:
    """Find the object that owns each pixel; a pure function that works under `jit` and `vmap`.

    An object owns the pixels in its box that have a colour of its category. If boxes overlap, the
    object with the smallest box owns the pixel, or the first slot among equal sizes. In games that
    declare a `backdrop`, no object owns pixels in the background's present colour.

    Args:
        objects: of batch shape `[...]`, from `Game.rem` or `Game.vem`. The objects of a category,
            from `Objects.of`, own the pixels regardless of other categories.
        frames: the frames that show the objects, uint8 `[..., H, 160]` of ALE palette indices or
            `[..., H, 160, 3]` of RGB.

    Returns:
        int16 `[..., H, 160]`: the slot of the pixel's owner, or -1 (`NOBODY`).

    Raises:
        TypeError: `frames` is not uint8.
        ValueError: the objects have no game or lack slots, or the shapes do not fit.
    """
    game, frames = whose(objects), as_array(frames)
    require_uint8(f"{game.name}: frames", frames)
    is_rgb = frames.shape[-3:] == (*game.screen, 3)
    batch = frames.shape[: -3 if is_rgb else -2]
    if frames.shape[len(batch) :][:2] != game.screen or objects.batch_shape != batch:
        raise ValueError(
            f"{game.name}: frames must have shape {[*objects.batch_shape, *game.screen]} (palette "
            f"indices) or {[*objects.batch_shape, *game.screen, 3]} (RGB), one for each state of "
            f"the objects, got {list(frames.shape)}"
        )
    if objects.valid.shape[-1] != game.num_slots:
        raise ValueError(
            f"{game.name}: the objects must have {game.num_slots} slots, got "
            f"{objects.valid.shape[-1]}: use the objects of game.rem or game.vem"
        )
    inputs = objects.xywh, objects.valid, frames
    owners = owners_of(game, *map(jnp.asarray, inputs))
    if any(isinstance(a, np.ndarray) for a in inputs) and not isinstance(owners, Tracer):
        # JAX may read a NumPy array in place while it computes: wait, so that the caller can
        # overwrite it.
        owners.block_until_ready()
    return owners


def masks(objects: Objects, frames: jax.Array | np.ndarray) -> jax.Array:
    """Return a mask of each object's pixels, bool `[..., slots, H, 160]`; see `segment`."""
    owners = segment(objects, frames)
    slots = np.arange(objects.valid.shape[-1], dtype=np.int16)
    return owners[..., None, :, :] == slots.reshape(*(1,) * (owners.ndim - 2), -1, 1, 1)
