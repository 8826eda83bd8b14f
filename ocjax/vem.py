"""The Vision Extraction Method: compiles a game's vision rules to a function of a batch of frames."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax import _xla
from ocjax.objects import UNKNOWN, Objects
from ocjax.vision import palette
from ocjax.vision.detect import Detected, detect

if TYPE_CHECKING:
    from ocjax.game import Game

CHUNK = 64  # frames at a time

# Bits beside a slot's colour. A bool or int8 array of its own would be transposed by a loop whose unrolled stores take up to a fifth of
# VEM's compilation.
_VALID, _ORIENTED = 1 << 24, 1 << 31


def _pair(low: jax.Array, high: jax.Array) -> jax.Array:
    """Two 16-bit numbers as one of 32 bits, which halves the work of assembling slots."""
    return low | (high << 16)


def _unpair(*pairs: jax.Array) -> jax.Array:
    """int32 `[B, N]` each of two 16-bit numbers -> int16 `[B, N, 2 * len(pairs)]`."""
    numbers = lax.bitcast_convert_type(jnp.stack(pairs, axis=-1), jnp.int16)
    return numbers.reshape(*pairs[0].shape, 2 * len(pairs))


def _by_slot(fields: Sequence[jax.Array | None], defaults: Sequence[np.ndarray], lanes: int) -> jax.Array:
    """Fields of each category as one array, int32 `[N, B]`; neighbours that have none take their defaults `[count]` in one piece."""
    pieces = []
    for absent, group in itertools.groupby(zip(fields, defaults, strict=True), key=lambda pair: pair[0] is None):
        own, default = zip(*group, strict=True)
        if absent:
            constant = jnp.asarray(np.concatenate(default), jnp.int32)
            own = [jnp.broadcast_to(constant[:, None], (len(constant), lanes))]
        pieces += own
    return jnp.concatenate(pieces)


def _colors(game: Game, found: Sequence[Detected], lanes: int) -> jax.Array:
    """The colours of all slots, uint32 `[N, B]`: read from the frame, or the slot's own."""
    own = palette.packed(game.slot_rgb)
    if all(f.color is None for f in found):
        return jnp.broadcast_to(jnp.asarray(own)[:, None], (len(own), lanes))
    table = np.concatenate([palette.packed(game.palette), own])
    own_index = len(game.palette) + np.arange(len(own))
    index = _by_slot([f.color for f in found], [own_index[s] for s in game.slices.values()], lanes)
    return jnp.asarray(table)[index]


def _flags(game: Game) -> np.ndarray:
    """Bits of valid slots, int32 `[N, 1]`: one that is always set, and the sign where the category has an orientation."""
    oriented = np.array(["orientation" in game.categories[i].attributes for i in game.slot_category])
    return np.where(oriented, _VALID | _ORIENTED, _VALID).astype(np.uint32).view(np.int32)[:, None]


def _extract(game: Game, frames: jax.Array) -> tuple[Objects, jax.Array]:
    """Objects of uint8 `[B, H, 160]`, and how many of each category had no slot, int32 `[B, categories]`."""
    found = detect(game.categories, frames, game.shades)
    x, y, w, h, valid = (jnp.concatenate([getattr(f, name) for f in found]) for name in ("x", "y", "w", "h", "valid"))
    lanes = len(frames)
    value = _by_slot([f.value for f in found], [np.zeros(len(f.x)) for f in found], lanes)
    mask = -valid.astype(jnp.int32)
    color = lax.bitcast_convert_type(_colors(game, found, lanes), jnp.int32) | jnp.asarray(_flags(game))
    by_slot = jnp.concatenate([_pair(x, y) & mask, _pair(w, h) & mask, value & mask, color & mask])
    xy, wh, value, color = jnp.split(_xla.transpose(by_slot), 4, axis=1)
    valid, orientation = (color & _VALID) > 0, jnp.where(color < 0, jnp.int8(UNKNOWN), jnp.int8(0))
    colors = lax.bitcast_convert_type(color, jnp.uint8)[..., :3]
    nothing = jnp.zeros(lanes, jnp.int32)
    overflow = jnp.stack([nothing if f.overflow is None else f.overflow for f in found], axis=-1)
    return Objects(_unpair(xy, wh), valid, orientation, value, colors, game), overflow


def extractor_with_overflow(game: Game) -> Callable[[jax.Array], tuple[Objects, jax.Array]]:
    """The game's VEM of uint8 `[B, H, 160]`, with the number of objects that had no slot, int32 `[B, categories]`."""
    return jax.jit(lambda frames: _xla.in_chunks(lambda chunk: _extract(game, chunk), frames, CHUNK))


def extractor(game: Game) -> Callable[[jax.Array | np.ndarray], Objects]:
    """The game's VEM: uint8 `[..., H, 160]` or `[..., H, 160, 3]` -> `Objects`."""
    by_index = _xla.any_batch(lambda frames: _xla.in_chunks(lambda chunk: _extract(game, chunk)[0], frames, CHUNK), 2)
    to_index = _xla.any_batch(lambda rgb: palette.to_index(rgb, game.palette), 3)

    def extract(frames: jax.Array | np.ndarray) -> Objects:
        return by_index(to_index(frames) if frames.shape[-3:] == (*game.screen, 3) else frames)

    return extract
