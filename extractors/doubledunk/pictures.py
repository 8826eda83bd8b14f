"""The pictures of DoubleDunk's figures in the ROM.

A figure has one of 32 pictures. Small and big players alternate, so the lowest bit of the number is
the size. A picture has 27 or 24 lines from the feet to above the head.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import BoxTable, lookup, mirrored, when
from ocjax.extractors.doubledunk.ram import ROM

FIGURE_COUNT = 32
NO_PICTURE = -1
SIZE_BIT = 1  # of a figure's number: set for big players
BIG_HEAD = 27  # lines from a big player's feet to above his head
SMALL_HEAD = 24
PICTURE_LINES = BIG_HEAD + 1  # greatest height of a picture, with the empty lines

ADDRESSES = ROM.bytes(0x3E50, FIGURE_COUNT) + 256 * ROM.bytes(0x3E70, FIGURE_COUNT)
PLACES = (ADDRESSES & 0xFFF) + 0x2000  # offsets in the ROM
HEADS = np.where(np.arange(FIGURE_COUNT) & SIZE_BIT, BIG_HEAD, SMALL_HEAD)


def _figure_table() -> tuple[int, np.ndarray]:
    """The first address of line 27 below a head, and the figure for each address after it."""
    below = (ADDRESSES + HEADS - BIG_HEAD).tolist()
    figures = dict(zip(below, range(FIGURE_COUNT), strict=True))
    every = range(min(below), max(below) + 1)
    return min(below), np.array([figures.get(address, NO_PICTURE) for address in every])


FIRST_ADDRESS, FIGURE_OF = _figure_table()


def figure_below(head: jax.Array) -> jax.Array:
    """The figure whose picture has the line above its head at an address; else `NO_PICTURE`."""
    place = head - BIG_HEAD - FIRST_ADDRESS
    known = (place >= 0) & (place < len(FIGURE_OF))
    return jnp.where(known, lookup(FIGURE_OF, place), NO_PICTURE)


def is_big(figure: jax.Array) -> jax.Array:
    """True for big players; `NO_PICTURE` counts as one."""
    return (figure & SIZE_BIT) == 1


def _all_extents() -> np.ndarray:
    """Left, top, width, height of each figure's drawn part, by mirroring, first and last line.

    The top counts lines from the line above the head. A figure without drawn lines has its full
    extent.
    """
    usual = np.unpackbits(
        ROM.rows(PLACES.tolist(), PICTURE_LINES).astype(np.uint8)[..., None], axis=-1
    )
    line = np.arange(PICTURE_LINES)[::-1]
    inside = line < HEADS[:, None]
    rows = np.stack([usual, usual[..., ::-1]], axis=1).astype(bool) & inside[:, None, :, None]
    low = np.arange(PICTURE_LINES)[:, None, None]
    high = np.arange(PICTURE_LINES)[:, None]
    shown = rows[:, :, None, None] & ((line >= low) & (line <= high))[..., None]
    whole = np.broadcast_to(rows[:, :, None, None], shown.shape)
    drawn = np.where(shown.any((-1, -2), keepdims=True), shown, whole)
    ys = np.any(drawn, -1)
    xs = np.any(drawn, -2)
    top = ys.argmax(-1)
    left = xs.argmax(-1)
    bottom = PICTURE_LINES - ys[..., ::-1].argmax(-1)
    right = 8 - xs[..., ::-1].argmax(-1)
    return np.stack([left, top, right - left, bottom - top], -1).reshape(-1, 4)


EXTENTS = BoxTable(_all_extents())


def extent_index(
    figure: jax.Array, is_mirrored: jax.Array, low: jax.Array, high: jax.Array
) -> jax.Array:
    """The index in `EXTENTS` of a figure with drawn lines from `low` to `high`.

    Lines count from its feet.
    """
    first = jnp.clip(low, 0, PICTURE_LINES - 1)
    last = jnp.clip(high, 0, PICTURE_LINES - 1)
    picture = 2 * figure + when(is_mirrored, 1)
    return (picture * PICTURE_LINES + first) * PICTURE_LINES + last


def _all_pictures(first: int, height: int) -> np.ndarray:
    """All different pictures of one size, and their mirror images."""
    rows = ROM.rows(PLACES[first::2].tolist(), height)
    return np.unique(np.concatenate([rows, mirrored(rows)]), axis=0)


SMALL_PICTURES = _all_pictures(0, SMALL_HEAD)
BIG_PICTURES = _all_pictures(1, BIG_HEAD)
