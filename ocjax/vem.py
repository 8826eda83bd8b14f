"""The Vision Extraction Method: compiles a game's vision rules to a function of a batch of frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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


def _colors(game: Game, found: Sequence[Detected], valid: jax.Array) -> jax.Array:
    """The colours of all slots, uint32 `[N, B]`: read from the frame, or the slot's own."""
    own = palette.packed(game.slot_rgb)
    if all(f.color is None for f in found):
        return jnp.broadcast_to(jnp.asarray(own)[:, None], valid.shape)
    table = np.concatenate([palette.packed(palette.NTSC), own])
    own_index = np.split(len(palette.NTSC) + np.arange(len(own), dtype=np.int32), [s.stop for s in game.slices.values()][:-1])
    index = [
        jnp.broadcast_to(jnp.asarray(entries)[:, None], f.x.shape) if f.color is None else f.color
        for entries, f in zip(own_index, found, strict=True)
    ]
    return jnp.asarray(table)[jnp.concatenate(index)]


def _extract(game: Game, frames: jax.Array) -> tuple[Objects, jax.Array]:
    """Objects of uint8 `[B, H, 160]`, and how many of each category had no slot, int32 `[B, categories]`."""
    found = detect(game.categories, frames)
    x, y, w, h, valid = (jnp.concatenate([getattr(f, name) for f in found]) for name in ("x", "y", "w", "h", "valid"))
    value = jnp.concatenate([jnp.zeros_like(f.x) if f.value is None else f.value for f in found])
    mask = -valid.astype(jnp.int32)
    color = lax.bitcast_convert_type(_colors(game, found, valid), jnp.int32)
    by_slot = jnp.concatenate([_pair(x, y) & mask, _pair(w, h) & mask, value & mask, color & mask])
    xy, wh, value, color = jnp.split(_xla.transpose(by_slot), 4, axis=1)
    valid = valid.T
    none = valid.astype(jnp.int8) >> 1  # zeros that follow the sharding of the frames, which a constant does not
    colors = lax.bitcast_convert_type(color, jnp.uint8)[..., :3]
    nothing = jnp.zeros(frames.shape[0], jnp.int32)
    overflow = jnp.stack([nothing if f.overflow is None else f.overflow for f in found], axis=-1)
    return Objects(_unpair(xy, wh), valid, none, value, colors, game), overflow


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
