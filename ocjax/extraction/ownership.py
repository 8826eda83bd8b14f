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
from ocjax._xla.kernels import materialize
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
_BITS = 32  # of a word
_HIGHEST = np.uint32(1 << _BITS - 1)
_UNROLLED = 8  # bits per iteration: fewer and longer kernels


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
    pixels = frames & EVEN
    owners = _paint(_in_order(xywh, valid, game.screen), looks, pixels)
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
    """Objects in the order of painting: the one behind has number 0."""

    slots: jax.Array  # int32 [B, N]
    # uint32 [B, N]: left, top, width and height on the screen, a byte each; 0: not painted
    edges: jax.Array


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


def _in_order(xywh: jax.Array, valid: jax.Array, screen: tuple[int, int]) -> _Boxes:
    """Order the boxes: larger ones are behind, and the later slots of equal ones."""
    x, y, w, h = jnp.moveaxis(xywh, -1, 0)
    height, width = screen
    left, right = (jnp.clip(edge, 0, width) for edge in (x, x + w))
    top, bottom = (jnp.clip(edge, 0, height) for edge in (y, y + h))
    size = (right - left) * (bottom - top)
    slot = np.arange(valid.shape[-1], dtype=np.uint32)
    keys = size.astype(jnp.uint32) << 16 | slot[None]
    keys = jnp.sort(jnp.where(valid & (size > 0), keys, jnp.uint32(0)), axis=1, descending=True)
    slots = (keys & _SLOT).astype(jnp.int32)
    edges = jnp.take_along_axis(_packed(left, top, right - left, bottom - top), slots, axis=1)
    return _Boxes(slots, jnp.where(keys > 0, edges, jnp.uint32(0)))


def _packed(*values: jax.Array) -> jax.Array:
    """Pack four values 0-255 into words, uint32, from the lowest byte."""
    shifted = (value.astype(jnp.uint32) << 8 * i for i, value in enumerate(values))
    return functools.reduce(jnp.bitwise_or, shifted)


def _bytes(words: jax.Array) -> Iterator[jax.Array]:
    """The four bytes of words, uint8, from the lowest one."""
    for i in range(4):
        yield (words >> 8 * i).astype(jnp.uint8)


def _paint(boxes: _Boxes, looks: _Looks, frames: jax.Array) -> jax.Array:
    """Paint the objects of each tile, the one behind first.

    Returns:
        The slots of the owners, uint8 or uint16 `[B, H, 160]`; the largest number: nobody.
    """
    tiles = _tiles(frames.shape[1])
    kind = jnp.uint8 if boxes.slots.shape[1] < np.iinfo(np.uint8).max else jnp.uint16
    pixels = frames.reshape(-1, *tiles)

    def paint(state: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        words, owners = state
        number, is_used = _first(words)
        slot, edges, colors = materialize(_look_up, number, is_used, *boxes, looks.colors, small=0)
        takes = _inside(edges, tiles) & _looks_like(pixels, slot, colors, looks.others)
        slot = slot.astype(kind).reshape(-1, *tiles.each)
        return _without(words, number), jnp.where(takes, slot, owners)

    start = _in_tiles(boxes.edges, tiles), jnp.full(pixels.shape, _nobody(kind))
    _, owners = lax.while_loop(lambda state: jnp.any(state[0] > 0), paint, start)
    return owners.reshape(frames.shape)


def _look_up(
    number: jax.Array, is_used: jax.Array, slots: jax.Array, edges: jax.Array, colors: jax.Array
) -> tuple[jax.Array, ...]:
    """The slot, the edges and the colours of each tile's object; without one, edges 0.

    Args:
        number: of the object, int32 `[B, tiles]`.
        is_used: whether the tile has one, bool `[B, tiles]`.
        slots: see `_Boxes`.
        edges: see `_Boxes`.
        colors: of all slots, uint8 `[B, N, most]`.
    """
    slot, edge = (jnp.take_along_axis(a, number, axis=1) for a in (slots, edges))
    own = jnp.take_along_axis(colors, slot[..., None], axis=1)
    return slot, jnp.where(is_used, edge, jnp.uint32(0)), own


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


def _in_tiles(edges: jax.Array, tiles: _Tiles) -> jax.Array:
    """The numbers of the boxes that reach each tile, as bits of words, uint32 `[words, B, tiles]`.

    The highest bit of the first word stands for number 0.
    """
    batch, count = edges.shape
    words = -(-count // _BITS)
    padded = jnp.pad(edges, ((0, 0), (0, words * _BITS - count)))
    by_bit = padded.reshape(batch, words, _BITS).transpose(2, 1, 0)

    def add(bit: jax.Array, found: jax.Array) -> jax.Array:
        own = lax.dynamic_index_in_dim(by_bit, bit, keepdims=False)
        x, y, w, h = (edge.astype(jnp.int32)[..., None] for edge in _bytes(own))
        down = _reached(y, y + h, tiles.down, tiles.rows)
        across = _reached(x, x + w, tiles.across, tiles.columns)
        reached = (down[..., None] & across[:, :, None]).reshape(found.shape)
        return found | jnp.where(reached, _HIGHEST >> jnp.uint32(bit), jnp.uint32(0))

    none = jnp.zeros((words, batch, tiles.down * tiles.across), jnp.uint32)
    return lax.fori_loop(0, min(_BITS, count), add, none, unroll=_UNROLLED)


def _reached(start: jax.Array, end: jax.Array, count: int, size: int) -> jax.Array:
    """Whether spans, `[words, B, 1]`, reach each of `count` tiles, bool `[words, B, count]`."""
    first = np.arange(count, dtype=np.int32)[None, None] * size
    return (start < first + size) & (end > first)


def _first(words: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The lowest number in each tile, int32 `[B, tiles]`, and whether there is one."""
    number = jnp.zeros(words.shape[1:], jnp.int32)
    for i in reversed(range(len(words))):
        own = _BITS * i + lax.clz(words[i]).astype(jnp.int32)
        number = jnp.where(words[i] > 0, own, number)
    return number, jnp.any(words > 0, axis=0)


def _without(words: jax.Array, number: jax.Array) -> jax.Array:
    """Remove a number, int32 `[B, tiles]`, from the words of each tile."""
    bit = _HIGHEST >> (number % _BITS).astype(jnp.uint32)
    word = np.arange(len(words), dtype=np.int32)[:, None, None]
    return jnp.where(word == number[None] // _BITS, words & ~bit[None], words)


def _inside(edges: jax.Array, tiles: _Tiles) -> jax.Array:
    """Whether pixels lie in the box of their tile's object, bool `[B, *tiles]`.

    A row of a tile has a first column and a width, which keeps the comparison of each pixel short.
    Left of the box and above it, the differences of unsigned bytes exceed its size.
    """
    left, top, width, height = (edge.reshape(-1, *tiles.each) for edge in _bytes(edges))
    y = np.arange(tiles.down * tiles.rows, dtype=np.uint8).reshape(1, tiles.down, tiles.rows, 1, 1)
    x = np.arange(WIDTH, dtype=np.uint8).reshape(1, 1, 1, tiles.across, tiles.columns)
    width = jnp.where(jnp.asarray(y) - top < height, width, jnp.uint8(0))
    return jnp.asarray(x) - left < width


def _looks_like(
    pixels: jax.Array, slot: jax.Array, colors: jax.Array, others: np.ndarray
) -> jax.Array:
    """Whether pixels, uint8, have a colour of their tile's object, bool `[B, *tiles]`.

    Args:
        slot: of the tile's object, int32 `[B, tiles]`.
        colors: of the tile's object, uint8 `[B, tiles, most]`.
        others: the slots that have all other colours instead, bool `[N]`.
    """
    each = pixels.shape[1], 1, pixels.shape[3], 1
    has = functools.reduce(
        jnp.logical_or,
        (pixels == color.reshape(-1, *each) for color in jnp.moveaxis(colors, -1, 0)),
    )
    if not others.any():
        return has
    inverts = jnp.asarray(others)[slot]
    return jnp.logical_xor(has, inverts.reshape(-1, *each))


def _nobody(kind: Any) -> jax.Array:
    return jnp.asarray(np.iinfo(kind).max, kind)
