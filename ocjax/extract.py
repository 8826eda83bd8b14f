"""From a game's declaration to batched, jitted functions."""

import ctypes
import functools
import math
import os
import sys
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jax.core import Tracer

from ocjax.batch_last import batch_last
from ocjax.objects import Objects
from ocjax.ram import RAM_SIZE
from ocjax.spec import Box, Game
from ocjax.vision import palette
from ocjax.vision.bitmap import kept
from ocjax.vision.rules import see

# So much at a time, which stays in the processor's cache.
REM_CHUNK_BYTES = 2**18  # of objects
VEM_CHUNK = 64  # frames
SLOT_BYTES = 17  # of `Objects`


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
        return traced(x) if isinstance(x, Tracer) else folded(x)

    return call


def _keep_freed_memory() -> None:
    """Ask glibc to keep memory that is freed for what comes next.

    By default it hands large results back to the system when they are dropped, and the next call's pages must be mapped and zeroed
    again: for batches of thousands that takes twice as long as the extraction itself. Where MALLOC_TRIM_THRESHOLD_ or
    MALLOC_MMAP_THRESHOLD_ is set, it stays as it is; without glibc nothing happens.
    """
    if sys.platform != "linux" or {"MALLOC_TRIM_THRESHOLD_", "MALLOC_MMAP_THRESHOLD_"} & os.environ.keys():
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        m_trim_threshold, m_mmap_threshold = -1, -3
        mallopt(m_trim_threshold, 2**29)
        mallopt(m_mmap_threshold, 2**25)  # the largest that it takes


_keep_freed_memory()


def _in_chunks(f: Callable[[jax.Array], Any], x: jax.Array, size: int) -> Any:
    """`f` of a batch, so many at a time."""
    n = x.shape[0]
    whole = n - n % size
    parts = []
    if whole:
        mapped = lax.map(f, x[:whole].reshape(-1, size, *x.shape[1:]))
        parts.append(jax.tree.map(lambda a: a.reshape(whole, *a.shape[2:]), mapped))
    if n > whole:
        parts.append(f(x[whole:]))
    return parts[0] if len(parts) == 1 else jax.tree.map(lambda *a: jnp.concatenate(a), *parts)


def _pack(low: Any, high: Any) -> Any:
    """Two numbers of 16 bits as one of 32: halves the work of putting slots together."""
    return low | (high << 16)


def _unpack(*packed: jax.Array) -> jax.Array:
    """int32 `[B, N]` each of two 16-bit numbers -> int16 `[B, N, 2 * len(packed)]`."""
    pairs = lax.bitcast_convert_type(jnp.stack(packed, axis=-1), jnp.int16)
    return pairs.reshape(*packed[0].shape, 2 * len(packed))


def rem(game: Game) -> Callable[[jax.Array | np.ndarray], Objects]:
    """The RAM extraction method of a game: uint8 `[..., 128]` -> `Objects`."""
    height, width = game.screen
    colors = np.concatenate([c.slot_rgb() for c in game.categories])

    def one(ram: jax.Array) -> dict[str, Box]:
        with jax.numpy_dtype_promotion("strict"), jax.numpy_rank_promotion("raise"):
            boxes = game.decode(game.ram(ram))
            return {c.name: boxes[c.name].clip(0, 0, width, height) for c in game.categories}

    decode = batch_last(one, jax.ShapeDtypeStruct((RAM_SIZE,), jnp.uint8))

    def rows(rams: jax.Array) -> dict[str, dict[str, jax.Array]]:
        """What the slots hold, a row a number, the batch innermost: uint8 `[128, B]` -> int32 or uint8 `[rows, B]`."""
        boxes, lanes = decode(rams), rams.shape[1]
        out: dict[str, dict[str, jax.Array]] = {name: {} for name in ("box", "value", "orientation", "rgb")}
        for c in game.categories:
            b = boxes[c.name]
            x, y, w, h, valid, value, point = (
                jnp.broadcast_to(v, (c.count, lanes)) for v in (b.x, b.y, b.w, b.h, b.valid, b.value, b.orientation)
            )
            keep = -valid.astype(jnp.int32)
            # A clipped box fits four bytes. One number a slot, so that the compiler computes what its parts share once.
            out["box"][c.name] = (x | (y << 8) | (w << 16) | (h << 24)) & keep
            if "value" in c.attributes:
                out["value"][c.name] = value & keep
            if "orientation" in c.attributes:
                out["orientation"][c.name] = point & 15 & keep
            if b.rgb is not None:
                out["rgb"][c.name] = b.rgb.reshape(-1, lanes)
        return out

    def turned(rams: jax.Array) -> dict[str, Any]:
        found = kept(rows, kept(jnp.transpose, rams))
        box = jnp.concatenate([found["box"][c.name] for c in game.categories])
        return jax.tree.map(lambda a: a.T.ravel(), found | {"box": box})

    def chunk(rams: jax.Array) -> Objects:
        lanes, n = rams.shape[0], game.num_slots
        # Computed, turned round and spread out in separate steps that stay in memory: fused, one would lose the others' order of
        # access. (What is turned round is made flat, else the compiler would only note that its axes are exchanged.)
        found = kept(turned, rams)
        box = found["box"].reshape(lanes, n)
        valid = box != 0
        # A product vectorises, a choice by a broadcast condition does not.
        rgb = valid[..., None].astype(jnp.uint8) * jnp.asarray(colors)[None]
        value, orientation = jnp.zeros((lanes, n), jnp.int32), jnp.zeros((lanes, n), jnp.int8)
        for name, s in game.slices.items():
            if name in found["rgb"]:
                part = found["rgb"][name].reshape(lanes, -1, 3) * valid[:, s, None].astype(jnp.uint8)
                rgb = lax.dynamic_update_slice(rgb, part, (0, s.start, 0))
            if name in found["value"]:
                value = lax.dynamic_update_slice(value, found["value"][name].reshape(lanes, -1), (0, s.start))
            if name in found["orientation"]:
                orientation = lax.dynamic_update_slice(
                    orientation, found["orientation"][name].reshape(lanes, -1).astype(jnp.int8), (0, s.start)
                )
        return Objects(lax.bitcast_convert_type(box, jnp.uint8).astype(jnp.int16), valid, orientation, value, rgb, game)

    def batched(rams: jax.Array) -> Objects:
        return _in_chunks(chunk, rams, 2 ** int(np.log2(REM_CHUNK_BYTES / (SLOT_BYTES * game.num_slots))))

    extract = _any_batch(batched, 1)

    @functools.wraps(Game.rem)
    def checked(ram: jax.Array | np.ndarray) -> Objects:
        if not hasattr(ram, "dtype") or ram.dtype != jnp.uint8:
            raise TypeError(f"{game.name}: ram must be a uint8 array, got {getattr(ram, 'dtype', type(ram).__name__)}")
        if ram.ndim == 0 or ram.shape[-1] != RAM_SIZE:
            raise ValueError(f"{game.name}: ram must have shape [..., {RAM_SIZE}], got {list(ram.shape)}")
        return extract(ram)

    return checked


def _seen(game: Game) -> Callable[[jax.Array], tuple[Objects, jax.Array]]:
    """What a game's rules see on uint8 `[B, H, 160]`, and how many objects of each category did not fit, int32 `[B, categories]`."""
    colors = np.concatenate([c.slot_rgb() for c in game.categories])

    def seen_on(frames: jax.Array) -> tuple[Objects, jax.Array]:
        lanes = frames.shape[0]
        fields, rgb, unfit = [], [], []
        for category, (seen, color) in zip(game.categories, see(game.categories, frames), strict=True):
            keep = -seen.valid.astype(jnp.int32)
            value = jnp.zeros_like(keep) if seen.value is None else seen.value & keep
            fields.append((_pack(seen.x, seen.y) & keep, _pack(seen.w, seen.h) & keep, seen.valid, value))
            fixed = palette.packed(colors[game.slices[category.name]])[:, None]
            rgb.append(
                jnp.broadcast_to(jnp.asarray(fixed), keep.shape) if color is None else jnp.asarray(palette.packed(palette.NTSC))[color]
            )
            unfit.append(jnp.zeros(lanes, jnp.int32) if seen.unfit is None else seen.unfit)
        xy, wh, valid, value = (jnp.concatenate(f).T for f in zip(*fields, strict=True))
        none = jnp.zeros((lanes, game.num_slots), jnp.int8)
        shown = lax.bitcast_convert_type(jnp.concatenate(rgb).T & -valid.astype(jnp.uint32), jnp.uint8)[..., :3]
        return Objects(_unpack(xy, wh), valid, none, value, shown, game), jnp.stack(unfit, axis=-1)

    return seen_on


def vem_counted(game: Game) -> Callable[[jax.Array], tuple[Objects, jax.Array]]:
    """`vem` of uint8 `[B, H, 160]`, with the numbers of objects that did not fit, int32 `[B, categories]`."""
    return jax.jit(lambda frames: _in_chunks(_seen(game), frames, VEM_CHUNK))


def vem(game: Game) -> Callable[[jax.Array | np.ndarray], Objects]:
    """The vision extraction method of a game: uint8 `[..., H, 160]` or `[..., H, 160, 3]` -> `Objects`."""
    height, width = game.screen
    seen = _seen(game)

    def batched(frames: jax.Array) -> Objects:
        return _in_chunks(lambda chunk: seen(chunk)[0], frames, VEM_CHUNK)

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
