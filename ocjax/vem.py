"""The vision extraction method: from a game's vision rules to a compiled function of a batch of frames."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax import _xla
from ocjax.objects import Objects
from ocjax.vision import palette
from ocjax.vision.detect import Detected, detect

if TYPE_CHECKING:
    from ocjax.game import Game

CHUNK = 64  # frames at a time


def _pair(low: jax.Array, high: jax.Array) -> jax.Array:
    """Two 16-bit numbers as one of 32 bits, which halves the work of assembling slots."""
    return low | (high << 16)


def _unpair(*pairs: jax.Array) -> jax.Array:
    """int32 `[B, N]` each of two 16-bit numbers -> int16 `[B, N, 2 * len(pairs)]`."""
    numbers = lax.bitcast_convert_type(jnp.stack(pairs, axis=-1), jnp.int16)
    return numbers.reshape(*pairs[0].shape, 2 * len(pairs))


def _color(game: Game, name: str, found: Detected, shape: tuple[int, ...]) -> jax.Array:
    """The colours of a category's slots, uint32 `[count, B]`."""
    if found.color is not None:
        return jnp.asarray(palette.packed(palette.NTSC))[found.color]
    fixed = palette.packed(game.slot_rgb[game.slices[name]])
    return jnp.broadcast_to(jnp.asarray(fixed[:, None]), shape)


def _extract(game: Game, frames: jax.Array) -> tuple[Objects, jax.Array]:
    """Objects of uint8 `[B, H, 160]`, and how many of each category had no slot, int32 `[B, categories]`."""
    lanes = frames.shape[0]
    fields, rgb, overflow = [], [], []
    for category, found in zip(game.categories, detect(game.categories, frames), strict=True):
        mask = -found.valid.astype(jnp.int32)
        value = jnp.zeros_like(mask) if found.value is None else found.value & mask
        fields.append((_pair(found.x, found.y) & mask, _pair(found.w, found.h) & mask, found.valid, value))
        rgb.append(_color(game, category.name, found, mask.shape))
        overflow.append(jnp.zeros(lanes, jnp.int32) if found.overflow is None else found.overflow)
    xy, wh, valid, value = (jnp.concatenate(f).T for f in zip(*fields, strict=True))
    none = valid.astype(jnp.int8) >> 1  # zeros that follow the sharding of the frames, which a constant does not
    colors = lax.bitcast_convert_type(jnp.concatenate(rgb).T & -valid.astype(jnp.uint32), jnp.uint8)[..., :3]
    return Objects(_unpair(xy, wh), valid, none, value, colors, game), jnp.stack(overflow, axis=-1)


def extractor_with_overflow(game: Game) -> Callable[[jax.Array], tuple[Objects, jax.Array]]:
    """The game's VEM of uint8 `[B, H, 160]`, with the number of objects that had no slot, int32 `[B, categories]`."""
    return jax.jit(lambda frames: _xla.in_chunks(lambda chunk: _extract(game, chunk), frames, CHUNK))


def extractor(game: Game) -> Callable[[jax.Array | np.ndarray], Objects]:
    """The game's VEM: uint8 `[..., H, 160]` or `[..., H, 160, 3]` -> `Objects`."""
    by_index = _xla.any_batch(lambda frames: _xla.in_chunks(lambda chunk: _extract(game, chunk)[0], frames, CHUNK), 2)
    to_index = _xla.any_batch(palette.to_index, 3)

    def extract(frames: jax.Array | np.ndarray) -> Objects:
        return by_index(to_index(frames) if frames.shape[-3:] == (*game.screen, 3) else frames)

    return extract
