"""Assign the pixels of frames to objects."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla import batches
from ocjax.console import palette
from ocjax.console.boxes import WIDTH
from ocjax.extraction.arrays import as_array, require_uint8
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.objects import Objects, whose
from ocjax.extraction.saver import restored
from ocjax.vision.colors import EVEN
from ocjax.vision.shades import level_of

__all__ = ["NOBODY", "segment"]

NO_COLOR = 1  # an odd palette index, which `pixels` never have
NOBODY = -1  # instead of a slot: no object owns the pixel
# Rows and columns of a tile. Each pass paints one object in each tile, so the number of passes is
# the largest number of boxes that share a tile, three in most games.
TILE = (16, 32)
CHUNK = 32  # frames whose tiles and pixels fit in the cache


def segment(objects: Objects, frames: jax.Array | np.ndarray) -> jax.Array:
    """Find the object that owns each pixel; a pure function that works under `jit` and `vmap`.

    An object owns the pixels in its box that have a colour of its category. If boxes overlap, the
    object with the smallest box owns the pixel, or the first slot among equal sizes.

    Args:
        objects: of batch shape `[...]`, all slots, from `Game.rem` or `Game.vem`.
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
            f"{game.name}: segment needs all {game.num_slots} slots, got "
            f"{objects.valid.shape[-1]}: give the objects that game.rem or game.vem returned"
        )
    return _segment(game, objects.xywh, objects.valid, jnp.asarray(frames))


@functools.partial(jax.jit, static_argnums=0)
def _segment(game: Declaration, xywh: jax.Array, valid: jax.Array, frames: jax.Array) -> jax.Array:
    """`segment` for any batch shape."""
    if frames.shape[-1] == 3:
        frames = palette.to_index(frames, game.palette, game.colors)
    batch, n = valid.shape[:-1], valid.shape[-1]
    flat = (
        jnp.asarray(xywh).astype(jnp.int32).reshape(-1, n, 4),
        jnp.asarray(valid).reshape(-1, n),
        frames.reshape(-1, *game.screen),
    )
    owners = batches.in_chunks(lambda chunk: _of_chunk(game, *chunk), flat, CHUNK)
    return owners.reshape(*batch, *game.screen)


def _of_chunk(
    game: Declaration, xywh: jax.Array, valid: jax.Array, frames: jax.Array
) -> jax.Array:
    """The owners in `[B]` states, int16 `[B, H, 160]`."""
    if game.saver is not None:
        frames = restored(frames, game.saver, game.categories)
    height, rows, columns = game.screen[0], *TILE
    below = -height % rows
    colors, others = _colors(game)
    level = 0 if game.shades is None else level_of(game.shades, frames)
    drawn = jnp.broadcast_to(jnp.asarray(colors)[level], (len(frames), *colors.shape[1:]))
    pixels = jnp.pad(frames & EVEN, ((0, 0), (0, below), (0, 0)))
    pixels = pixels.reshape(len(frames), -1, rows, WIDTH // columns, columns)
    edges = _edges(xywh, game.screen)
    keys = _keys(edges, valid, (height + below, WIDTH))
    owners = _paint(keys, edges, drawn, others, pixels)
    return owners.reshape(len(frames), -1, WIDTH)[:, :height]


@functools.cache
def _colors(game: Declaration) -> tuple[np.ndarray, np.ndarray]:
    """The colours of each slot's pixels at each level, and the slots with background colours.

    Returns:
        uint8 `[levels, N, most]`, filled up with `NO_COLOR`, and bool `[N]`: the colours are those
        of the background, and all others are the object's.
    """
    slots = [colors for category in game.categories for colors in category.slot_colors()]
    others = [c.has_background for c in game.categories]
    shades = game.shades
    levels = [{}] if shades is None else [
        dict(zip(shades.levels[0], level, strict=True)) for level in shades.levels
    ]
    most = max(len(colors) for colors in slots)
    table = np.full((len(levels), len(slots), most), NO_COLOR, np.uint8)
    for i, level in enumerate(levels):
        for k, colors in enumerate(slots):
            table[i, k, : len(colors)] = [level.get(color, color) for color in colors]
    return table, np.array(others)[game.slot_category]


def _edges(xywh: jax.Array, screen: tuple[int, int]) -> jax.Array:
    """Left, top, right and bottom of boxes on the screen, int32 `[B, N, 4]`, from `[B, N, 4]`."""
    height, width = screen
    most = np.array([width, height, width, height], np.int32)
    return jnp.clip(jnp.concatenate([xywh[..., :2], xywh[..., :2] + xywh[..., 2:]], -1), 0, most)


def _keys(edges: jax.Array, valid: jax.Array, screen: tuple[int, int]) -> jax.Array:
    """A key for each tile and slot, uint32 `[B, N, tiles down, tiles across]`; 0: not in the tile.

    The larger of two keys belongs to the object behind: with the larger box, or the later slot.
    """
    left, top, right, bottom = jnp.moveaxis(edges, -1, 0)
    size = (right - left) * (bottom - top)
    slot = np.arange(valid.shape[-1], dtype=np.uint32)
    key = size.astype(jnp.uint32) << 16 | slot[None]
    down = _reached(top, bottom, screen[0], TILE[0])
    across = _reached(left, right, screen[1], TILE[1])
    reached = down[..., None] & across[:, :, None]
    key = jnp.where(valid & (size > 0), key, jnp.uint32(0))
    return jnp.where(reached, key[..., None, None], jnp.uint32(0))


def _reached(start: jax.Array, end: jax.Array, length: int, tile: int) -> jax.Array:
    """Whether the spans from `start` to `end`, `[B, N]`, reach each tile, bool `[B, N, tiles]`."""
    first = np.arange(0, length, tile, dtype=np.int32)[None, None]
    return (start[..., None] < first + tile) & (end[..., None] > first)


def _paint(
    keys: jax.Array, edges: jax.Array, colors: jax.Array, others: np.ndarray, pixels: jax.Array
) -> jax.Array:
    """Paint the objects of each tile, the one behind first.

    Args:
        keys: see `_keys`.
        edges: see `_edges`.
        colors: see `_colors`, of each state: uint8 `[B, N, most]`.
        others: see `_colors`.
        pixels: palette indices, uint8 `[B, tiles down, rows, tiles across, columns]`.

    Returns:
        The owners of the pixels, in the shape of `pixels`.
    """
    n = edges.shape[1]
    kind = jnp.uint8 if n < 255 else jnp.uint16
    nobody = jnp.asarray(np.iinfo(kind).max, kind)
    boxes = edges.astype(jnp.uint8)
    y = np.arange(pixels.shape[1] * TILE[0], dtype=np.uint8).reshape(1, -1, TILE[0], 1, 1)
    x = np.arange(WIDTH, dtype=np.uint8).reshape(1, 1, 1, -1, TILE[1])

    def spread(of_tile):
        return of_tile[:, :, None, :, None]

    def paint(state):
        key, owners = state
        slot = (key & jnp.uint32(0xFFFF)).astype(jnp.int32)
        flat = slot.reshape(len(slot), -1, 1)
        box = jnp.take_along_axis(boxes, flat, axis=1).reshape(*slot.shape, 4)
        own = jnp.take_along_axis(colors, flat, axis=1).reshape(*slot.shape, -1)
        left, top, right, bottom = (spread(box[..., i]) for i in range(4))
        inside = (x >= left) & (x < right) & (y >= top) & (y < bottom) & spread(key > 0)
        has = functools.reduce(
            jnp.logical_or, (pixels == spread(own[..., i]) for i in range(own.shape[-1]))
        )
        takes = inside & (has ^ spread(jnp.asarray(others)[slot])) if others.any() else inside & has
        owners = jnp.where(takes, spread(slot).astype(kind), owners)
        return _behind(keys, key), owners

    first = _behind(keys, jnp.full((len(keys), *keys.shape[2:]), np.uint32(2**32 - 1)))
    _, owners = lax.while_loop(
        lambda state: jnp.any(state[0] > 0), paint, (first, jnp.full(pixels.shape, nobody))
    )
    return jnp.where(owners == nobody, jnp.int16(NOBODY), owners.astype(jnp.int16))


def _behind(keys: jax.Array, last: jax.Array) -> jax.Array:
    """The largest key of each tile below its last key; 0 without one."""
    return jnp.max(jnp.where(keys < last[:, None], keys, jnp.uint32(0)), axis=1)
