"""The object that owns each pixel of a frame."""

import functools
import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla import batches
from ocjax.console import palette
from ocjax.console.boxes import WIDTH
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.saver import restored
from ocjax.vision.colors import EVEN
from ocjax.vision.shades import level_of

__all__ = ["NOBODY", "owners_of"]

_NO_COLOR = 1  # an odd palette index, which `pixels` never have
NOBODY = -1  # instead of a slot: no object owns the pixel
# Each pass paints one object in each tile; wider tiles need more passes.
_MOST_ROWS = 16
_TILE_WIDTH = 32
_CHUNK = 16  # frames whose tiles and pixels fit in the cache
_SLOT = np.uint32(0xFFFF)  # bits of a key


@functools.partial(jax.jit, static_argnums=0)
def owners_of(game: Declaration, xywh: jax.Array, valid: jax.Array, frames: jax.Array) -> jax.Array:
    """Find the slot that owns each pixel, int16 `[..., H, 160]`, or `NOBODY`.

    Args:
        game: of the objects.
        xywh: their boxes, int16 `[..., N, 4]`.
        valid: bool `[..., N]`.
        frames: uint8 `[..., H, 160]` of palette indices or `[..., H, 160, 3]` of RGB.
    """
    if frames.shape[-1] == 3:
        frames = palette.to_index(frames, game.palette, game.pixel_colors)
    batch, n = valid.shape[:-1], math.prod(valid.shape[:-1])
    if n == 0:
        return jnp.full((*batch, *game.screen), jnp.int16(NOBODY))
    flat = (
        xywh.astype(jnp.int32).reshape(n, -1, 4),
        valid.reshape(n, -1),
        frames.reshape(n, *game.screen),
    )
    owners = batches.in_chunks(lambda chunk: _of_chunk(game, *chunk), flat, _CHUNK)
    return owners.reshape(*batch, *game.screen)


def _of_chunk(game: Declaration, xywh: jax.Array, valid: jax.Array, frames: jax.Array) -> jax.Array:
    if game.saver is not None:
        frames = restored(frames, game.saver, game.categories)
    colors, others = _colors(game)
    level = None if game.shades is None else level_of(game.shades, frames)
    own = jnp.asarray(colors[0])[None] if level is None else jnp.asarray(colors)[level]
    looks = _Looks(jnp.broadcast_to(own, (len(frames), *own.shape[1:])), others)
    boxes = _Boxes(*_edges(xywh, game.screen))
    pixels = frames & EVEN
    owners = _paint(boxes, _keys(boxes, valid), looks, pixels)
    free = owners == _nobody(owners.dtype)
    if game.backdrop:
        free |= _in_backdrop(pixels, game.backdrop)
    return jnp.where(free, jnp.int16(NOBODY), owners.astype(jnp.int16))


def _in_backdrop(pixels: jax.Array, columns: tuple[int, ...]) -> jax.Array:
    """Whether pixels have the colour that all columns show in their row, bool `[B, H, 160]`."""
    shown = pixels[:, :, np.array(columns)]
    first = shown[:, :, :1]
    agree = jnp.all(shown == first, axis=-1, keepdims=True)
    return agree & (pixels == first)


class _Boxes(NamedTuple):
    """The boxes on the screen, int32 `[B, N]` each."""

    left: jax.Array
    top: jax.Array
    right: jax.Array  # one past the last column
    bottom: jax.Array  # one past the last row


class _Looks(NamedTuple):
    colors: jax.Array  # uint8 [B, N, most]
    others: np.ndarray  # bool [N]


@functools.cache
def _colors(game: Declaration) -> tuple[np.ndarray, np.ndarray]:
    """The colours of each slot at each level, and which slots have the background's instead.

    Returns:
        uint8 `[levels, N, most]`, filled up with `_NO_COLOR`, and bool `[N]`.
    """
    slots = [colors for category in game.categories for colors in category.slot_colors()]
    others = np.array([category.has_background for category in game.categories])
    levels = [{}]
    if game.shades is not None:
        first, *_ = game.shades.levels
        levels = [dict(zip(first, level, strict=True)) for level in game.shades.levels]
    table = np.full((len(levels), len(slots), max(map(len, slots))), _NO_COLOR, np.uint8)
    for level, own in zip(levels, table, strict=True):
        for colors, row in zip(slots, own, strict=True):
            row[: len(colors)] = [level.get(color, color) for color in colors]
    return table, others[game.slot_category]


def _edges(xywh: jax.Array, screen: tuple[int, int]) -> Iterator[jax.Array]:
    """Left, top, right and bottom of boxes on the screen, int32 `[B, N]`, from `[B, N, 4]`."""
    x, y, w, h = jnp.moveaxis(xywh, -1, 0)
    height, width = screen
    for edge, most in ((x, width), (y, height), (x + w, width), (y + h, height)):
        yield jnp.clip(edge, 0, most)


def _keys(boxes: _Boxes, valid: jax.Array) -> jax.Array:
    """The order in which objects are painted, uint32 `[B, N]`; 0: not at all.

    Objects behind have larger keys: those with larger boxes, or later slots.
    """
    size = (boxes.right - boxes.left) * (boxes.bottom - boxes.top)
    slot = np.arange(valid.shape[-1], dtype=np.uint32)
    return jnp.where(valid & (size > 0), size.astype(jnp.uint32) << 16 | slot[None], jnp.uint32(0))


def _paint(boxes: _Boxes, keys: jax.Array, looks: _Looks, frames: jax.Array) -> jax.Array:
    """Paint the objects of each tile, the one behind first.

    Returns:
        The slots of the owners, uint8 or uint16 `[B, H, 160]`; the largest number: nobody.
    """
    tiles = _tiles(frames.shape[1])
    in_tiles = _keys_in_tiles(boxes, keys, tiles)
    kind = jnp.uint8 if keys.shape[1] < np.iinfo(np.uint8).max else jnp.uint16
    pixels = frames.reshape(-1, *tiles)
    everything = jnp.full(in_tiles.shape[1:], np.uint32(2**32 - 1))

    def paint(state: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        key, owners = state
        slot = (key & _SLOT).astype(jnp.int32)
        own = _Boxes(*(jnp.take_along_axis(edge, slot, axis=1) for edge in boxes))
        takes = _inside(own, key > 0, tiles) & _looks_like(pixels, slot, looks)
        number = slot.astype(kind).reshape(-1, *tiles.each)
        return _next(in_tiles, key), jnp.where(takes, number, owners)

    start = _next(in_tiles, everything), jnp.full(pixels.shape, _nobody(kind))
    _, owners = lax.while_loop(lambda state: jnp.any(state[0] > 0), paint, start)
    return owners.reshape(frames.shape)


class _Tiles(NamedTuple):
    down: int
    rows: int
    across: int
    columns: int

    @property
    def each(self) -> tuple[int, int, int, int]:
        """The shape of a value for each tile, beside pixels."""
        return self.down, 1, self.across, 1


def _tiles(height: int) -> _Tiles:
    rows = max(rows for rows in range(1, _MOST_ROWS + 1) if height % rows == 0)
    return _Tiles(height // rows, rows, WIDTH // _TILE_WIDTH, _TILE_WIDTH)


def _keys_in_tiles(boxes: _Boxes, keys: jax.Array, tiles: _Tiles) -> jax.Array:
    """The keys of the boxes that reach each tile, uint32 `[N, B, tiles]`; 0: not in the tile."""
    down = _reached(boxes.top.T, boxes.bottom.T, tiles.down, tiles.rows)
    across = _reached(boxes.left.T, boxes.right.T, tiles.across, tiles.columns)
    reached = (down[..., None] & across[:, :, None]).reshape(*keys.T.shape, -1)
    return jnp.where(reached, keys.T[..., None], jnp.uint32(0))


def _reached(start: jax.Array, end: jax.Array, count: int, size: int) -> jax.Array:
    """Whether spans, `[N, B]`, reach each of `count` tiles, bool `[N, B, count]`."""
    first = np.arange(count, dtype=np.int32)[None, None] * size
    return (start[..., None] < first + size) & (end[..., None] > first)


def _next(in_tiles: jax.Array, last: jax.Array) -> jax.Array:
    """The largest key of each tile below its last key, uint32 `[B, tiles]`; 0 without one."""

    def larger(slot: jax.Array, largest: jax.Array) -> jax.Array:
        key = lax.dynamic_index_in_dim(in_tiles, slot, keepdims=False)
        return jnp.maximum(largest, jnp.where(key < last, key, jnp.uint32(0)))

    return lax.fori_loop(0, len(in_tiles), larger, jnp.zeros_like(last))


def _inside(boxes: _Boxes, used: jax.Array, tiles: _Tiles) -> jax.Array:
    """Whether pixels lie in the box of their tile's object, bool `[B, *tiles]`."""
    left, top, right, bottom = (edge.reshape(-1, *tiles.each) for edge in boxes)
    y = np.arange(tiles.down * tiles.rows, dtype=np.int32).reshape(1, tiles.down, tiles.rows, 1, 1)
    x = np.arange(WIDTH, dtype=np.uint8).reshape(1, 1, 1, tiles.across, tiles.columns)
    in_row = used.reshape(-1, *tiles.each) & (y >= top) & (y < bottom)
    width = jnp.where(in_row, right - left, 0).astype(jnp.uint8)
    return jnp.asarray(x) - left.astype(jnp.uint8) < width


def _looks_like(pixels: jax.Array, slot: jax.Array, looks: _Looks) -> jax.Array:
    """Whether pixels, uint8, have a colour of their tile's object, bool `[B, *tiles]`.

    Args:
        slot: of the tile's object, int32 `[B, tiles]`.
    """
    each = pixels.shape[1], 1, pixels.shape[3], 1
    colors = jnp.take_along_axis(looks.colors, slot[..., None], axis=1)
    has = functools.reduce(
        jnp.logical_or,
        (pixels == color.reshape(-1, *each) for color in jnp.moveaxis(colors, -1, 0)),
    )
    if not looks.others.any():
        return has
    inverts = jnp.asarray(looks.others)[slot]
    return jnp.logical_xor(has, inverts.reshape(-1, *each))


def _nobody(kind: Any) -> jax.Array:
    return jnp.asarray(np.iinfo(kind).max, kind)
