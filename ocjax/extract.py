"""From a game's declaration to batched, jitted functions."""

import functools
import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax.objects import Objects
from ocjax.ram import RAM_SIZE
from ocjax.spec import Box, Game
from ocjax.vision import palette
from ocjax.vision.rules import see

CHUNK = 64  # frames at a time in the vision method


def _any_batch(f: Callable[[jax.Array], Objects], rank: int) -> Callable[[jax.Array | np.ndarray], Objects]:
    """Make a function of `[B, ...]`, B > 0, one of any leading batch shape.

    All batch shapes of the same size share one compiled function, and `vmap` of it is the function on a larger batch.
    """
    one_axis = jax.jit(f)

    def folded(x: jax.Array) -> Objects:
        batch, tail = x.shape[: x.ndim - rank], x.shape[x.ndim - rank :]
        if len(batch) == 1 and batch[0] > 0:
            return one_axis(x)
        n = math.prod(batch)
        out = one_axis(x.reshape(n, *tail) if n else jnp.zeros((1, *tail), x.dtype))
        return jax.tree.map(lambda a: a[:n].reshape(*batch, *a.shape[1:]), out)

    traced = jax.custom_batching.custom_vmap(folded)

    @traced.def_vmap
    def _(axis_size: int, in_batched: list[bool], x: jax.Array) -> tuple[Objects, Objects]:
        out = call(x)
        return out, jax.tree.map(lambda _: True, out)

    def call(x: jax.Array | np.ndarray) -> Objects:
        x = jnp.asarray(x)
        return traced(x) if isinstance(x, jax.core.Tracer) else folded(x)

    return call


def _pack(low: jax.Array, high: jax.Array) -> jax.Array:
    """Two numbers of 16 bits as one of 32: halves the work of putting slots together."""
    return low | (high << 16)


def _unpack(*packed: jax.Array) -> jax.Array:
    """int32 `[B, N]` each of two 16-bit numbers -> int16 `[B, N, 2 * len(packed)]`."""
    pairs = lax.bitcast_convert_type(jnp.stack(packed, axis=-1), jnp.int16)
    return pairs.reshape(*packed[0].shape, 2 * len(packed))


def rem(game: Game) -> Callable[[jax.Array | np.ndarray], Objects]:
    """The RAM extraction method of a game: uint8 `[..., 128]` -> `Objects`."""
    height, width = game.screen
    colors = np.concatenate([c.slot_rgb() for c in game.categories])  # of numpy: it outlives the trace

    def one(ram: jax.Array) -> Objects:
        with jax.numpy_dtype_promotion("strict"), jax.numpy_rank_promotion("raise"):
            boxes = game.decode(game.ram(ram))
        parts = []
        for category in game.categories:
            b: Box = boxes[category.name].clip(0, 0, width, height)
            keep = -b.valid.astype(jnp.int32)  # all bits set where valid: masking by `&` vectorises, a select of a broadcast does not
            value = b.value if "value" in category.attributes else jnp.int32(0)
            point = (b.orientation & 15).astype(jnp.int8) if "orientation" in category.attributes else jnp.int8(0)
            shape = (category.count,)
            part = [jnp.broadcast_to(v, shape) for v in (_pack(b.x, b.y), _pack(b.w, b.h) & keep, value, point)]
            part.append(colors[game.slices[category.name]] if b.rgb is None else jnp.broadcast_to(b.rgb, (*shape, 3)))
            parts.append(part)
        xy, wh, value, point, rgb = (jnp.concatenate(p) for p in zip(*parts, strict=True))
        valid = wh != 0  # from the result: every use of a decoder's `valid` would decode once more
        keep = -valid.astype(jnp.int32)
        return Objects(_unpack(xy & keep, wh), valid, point & keep.astype(jnp.int8), value & keep, rgb * valid[:, None].astype(jnp.uint8))

    batched = _any_batch(jax.vmap(one), 1)

    @functools.wraps(Game.rem)
    def checked(ram: jax.Array | np.ndarray) -> Objects:
        if not hasattr(ram, "dtype") or ram.dtype != jnp.uint8:
            raise TypeError(f"{game.name}: ram must be a uint8 array, got {getattr(ram, 'dtype', type(ram).__name__)}")
        if ram.ndim == 0 or ram.shape[-1] != RAM_SIZE:
            raise ValueError(f"{game.name}: ram must have shape [..., {RAM_SIZE}], got {list(ram.shape)}")
        return batched(ram)

    return checked


def vem(game: Game) -> Callable[[jax.Array | np.ndarray], Objects]:
    """The vision extraction method of a game: uint8 `[..., H, 160]` or `[..., H, 160, 3]` -> `Objects`."""
    height, width = game.screen
    colors = np.concatenate([c.slot_rgb() for c in game.categories])

    def chunk(frames: jax.Array) -> Objects:
        lanes = frames.shape[0]
        fields, rgb = [], []
        for category, (seen, color) in zip(game.categories, see(game.categories, frames), strict=True):
            keep = -seen.valid.astype(jnp.int32)
            fields.append((_pack(seen.x, seen.y) & keep, _pack(seen.w, seen.h) & keep, seen.valid))
            fixed = palette.packed(colors[game.slices[category.name]])[:, None]
            rgb.append(
                jnp.broadcast_to(jnp.asarray(fixed), keep.shape) if color is None else jnp.asarray(palette.packed(palette.NTSC))[color]
            )
        xy, wh, valid = (jnp.concatenate(f).T for f in zip(*fields, strict=True))
        none = jnp.zeros((lanes, game.num_slots), jnp.int32)
        shown = lax.bitcast_convert_type(jnp.concatenate(rgb).T & -valid.astype(jnp.uint32), jnp.uint8)[..., :3]
        return Objects(_unpack(xy, wh), valid, none.astype(jnp.int8), none, shown)

    def batched(frames: jax.Array) -> Objects:
        """Large batches go through in chunks that stay in the processor's cache."""
        n = frames.shape[0]
        whole = n - n % CHUNK
        parts = []
        if whole:
            parts.append(lax.map(chunk, frames[:whole].reshape(-1, CHUNK, *frames.shape[1:])))
            parts[0] = jax.tree.map(lambda a: a.reshape(whole, *a.shape[2:]), parts[0])
        if n > whole:
            parts.append(chunk(frames[whole:]))
        return parts[0] if len(parts) == 1 else jax.tree.map(lambda *a: jnp.concatenate(a), *parts)

    by_index = _any_batch(batched, 2)
    by_rgb = _any_batch(lambda frames: batched(palette.to_index(frames)), 3)

    @functools.wraps(Game.vem)
    def checked(frames: jax.Array | np.ndarray) -> Objects:
        if not hasattr(frames, "dtype") or frames.dtype != jnp.uint8:
            raise TypeError(f"{game.name}: frames must be a uint8 array, got {getattr(frames, 'dtype', type(frames).__name__)}")
        if frames.shape[-2:] == (height, width):
            return by_index(frames)
        if frames.shape[-3:] == (height, width, 3):
            return by_rgb(frames)
        raise ValueError(
            f"{game.name}: frames must have shape [..., {height}, {width}] (palette indices) or [..., {height}, {width}, 3] (RGB), "
            f"got {list(frames.shape)}"
        )

    return checked
