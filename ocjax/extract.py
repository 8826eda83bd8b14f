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

from ocjax.batch_last import Keep, batch_last
from ocjax.objects import Objects
from ocjax.ram import RAM_SIZE
from ocjax.spec import Box, Game
from ocjax.vision import palette
from ocjax.vision.rules import see

# So much at a time, which stays in the processor's cache.
REM_CHUNK = 4096  # states
VEM_CHUNK = 64  # frames
LITTLE = 32  # states for which steps cost more than what they save
MANY = 44  # bytes that a game reads: picking more of them out costs more than to turn all of the RAM round


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


def _turned(rows: jax.Array) -> jax.Array:
    """`[n, B]` -> `[B, n]`, in memory.

    Alone and with one axis more, the compiler does it block by block. Flat, or fused with anything, it takes three to six times as
    long; as it is, it only notes that the axes are exchanged, and every reader pays.
    """
    n, lanes = rows.shape
    return lax.optimization_barrier(rows.T.reshape(lanes, 1, n))[:, 0]


def _stretches(addresses: tuple[int, ...]) -> list[range]:
    """What to read of the RAM: the addresses and what lies between close ones, or one stretch of all in sixteens (turned round at once)."""
    out: list[range] = []
    for a in sorted(addresses):
        if out and a - out[-1].stop < 4:
            out[-1] = range(out[-1].start, a + 1)
        else:
            out.append(range(a, a + 1))
    return out if sum(map(len, out)) <= MANY else [range(out[0].start // 16 * 16, -(-out[-1].stop // 16) * 16)]


def rem(game: Game) -> Callable[[jax.Array | np.ndarray], Objects]:
    """The RAM extraction method of a game: uint8 `[..., 128]` -> `Objects`."""
    height, width = game.screen
    colors = palette.packed(np.concatenate([c.slot_rgb() for c in game.categories])).astype(np.int32)
    stretches = _stretches(game.ram.addresses())
    addresses = [a for stretch in stretches for a in stretch]

    def one(ram: jax.Array) -> dict[str, Box]:
        with jax.numpy_dtype_promotion("strict"), jax.numpy_rank_promotion("raise"):
            boxes = game.decode(game.ram(ram, addresses))
            return {c.name: boxes[c.name].clip(0, 0, width, height) for c in game.categories}

    decode = batch_last(one, jax.ShapeDtypeStruct((len(addresses),), jnp.uint8))

    def rows(rams: jax.Array, kept: Keep) -> tuple[jax.Array, dict[str, dict[str, jax.Array]]]:
        """What the slots hold, a row a number, the batch innermost: uint8 `[addresses, B]` -> int32 `[rows, B]`."""
        boxes, lanes = decode(rams, kept), rams.shape[1]
        places = jnp.zeros((game.num_slots, lanes), jnp.int32)  # filled in piece by piece: 3-15 % less than `concatenate` in most games
        more: dict[str, dict[str, jax.Array]] = {name: {} for name in ("value", "orientation", "rgb")}
        for c in game.categories:
            b = boxes[c.name]
            x, y, w, h, valid, value, point = (
                jnp.broadcast_to(v, (c.count, lanes)) for v in (b.x, b.y, b.w, b.h, b.valid, b.value, b.orientation)
            )
            keep = -valid.astype(jnp.int32)
            # A clipped box fits four bytes. One number a slot, so that the compiler computes what its parts share once.
            packed = (x | (y << 8) | (w << 16) | (h << 24)) & keep
            places = lax.dynamic_update_slice(places, packed, (game.slices[c.name].start, 0))
            if "value" in c.attributes:
                more["value"][c.name] = value & keep
            if "orientation" in c.attributes:
                more["orientation"][c.name] = point & 15 & keep
            if b.rgb is not None:
                red, green, blue = jnp.moveaxis(b.rgb.reshape(-1, 3, lanes).astype(jnp.int32), 1, 0)
                more["rgb"][c.name] = red | (green << 8) | (blue << 16)
        return places, more

    def flat(box: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Whether each slot is valid, and its x, y, w, h: along short rows, one a state, the compiler would not vectorise."""
        return box.ravel() != 0, lax.bitcast_convert_type(box.ravel(), jnp.uint8).astype(jnp.int16)

    def chunk(rams: jax.Array) -> Objects:
        lanes, n = rams.shape[0], game.num_slots
        # Rows of 4,096 would all fall on the same lines of the cache: turning 128 of bytes round takes 22 ns a state, with 16 more 10.
        wide = lanes + (16 if lanes % 512 == 0 else 0)
        always = rams[0, 0].astype(jnp.float32) >= 0

        def kept(f: Callable[[Any], Any], x: Any) -> Any:
            """`f(x)`, kept in memory (see `ocjax.vision.bitmap.kept`): fused, steps would lose one another's order of access."""
            if lanes < LITTLE:
                return f(x)
            result = jax.eval_shape(f, x)
            return lax.cond(always, f, lambda _: jax.tree.map(lambda a: jnp.zeros(a.shape, a.dtype), result), x)

        def spread(name: str, dtype: Any) -> jax.Array:
            out = jnp.zeros((lanes, n), dtype)
            for category, part in more[name].items():
                out = lax.dynamic_update_slice(out, part[:, :lanes].T.astype(dtype), (0, game.slices[category].start))
            return out

        def shown(words: jax.Array, where: jax.Array) -> jax.Array:
            return lax.bitcast_convert_type(words & where, jnp.uint8)[..., :3]

        def read(r: jax.Array) -> jax.Array:
            """What is to be turned round: uint8 `[wide, addresses]`."""
            out = jnp.zeros((wide, len(addresses)), jnp.uint8)
            for s in stretches:
                out = lax.dynamic_update_slice(out, r[:, s.start : s.stop], (0, addresses.index(s.start)))
            return out

        box, more = kept(lambda r: rows(r, kept), kept(read, rams).T)
        box = kept(lambda b: _turned(b)[:lanes], box)
        valid, xywh = kept(flat, box)
        keep = -(box != 0).astype(jnp.int32)
        rgb = shown(jnp.asarray(colors)[None], keep)
        for category, part in more["rgb"].items():
            s = game.slices[category]
            rgb = lax.dynamic_update_slice(rgb, shown(part[:, :lanes].T, keep[:, s]), (0, s.start, 0))
        return Objects(
            xywh.reshape(lanes, n, 4), valid.reshape(lanes, n), spread("orientation", jnp.int8), spread("value", jnp.int32), rgb, game
        )

    def batched(rams: jax.Array) -> Objects:
        return _in_chunks(chunk, rams, REM_CHUNK)

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
