"""Masks as bitmaps: 32 pixels a word, the batch innermost.

A bitmap is a tuple of uint32 arrays `[rows, B]`, one for each 32 columns from left to right; the leftmost pixel is the most
significant bit. So the addition carry runs to the left along a row, a shift by a pixel is a shift of words, and every operation
vectorises over the batch.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jax import lax

U = jnp.uint32
Bitmap = tuple[jax.Array, ...]


def words_of_pixels(frames: jax.Array) -> jax.Array:
    """uint8 `[B, H, 160]` -> uint32 `[40, H, B]`, four pixels a word."""
    b, h, w = frames.shape
    return jnp.transpose(lax.bitcast_convert_type(frames.reshape(b, h, w // 4, 4), U), (2, 1, 0))


def color_masks(pixels: jax.Array, sets: Sequence[tuple[int, ...]]) -> list[Bitmap]:
    """For each set of palette indices, which pixels have one of them.

    Args:
        pixels: uint32 `[40, H, B]` of `words_of_pixels`.
        sets: of palette indices.

    Bytes equal to a colour are found by exclusive-or and a carry that does not cross bytes; the flags of a set's colours are put
    together first and then gathered, four at a time, by one multiplication. The barrier keeps the transposed pixels in memory
    instead of transposing them again for each set.
    """
    low = U(0x7F7F7F7F)
    pixels = lax.optimization_barrier(pixels)

    def one(colors: tuple[int, ...]) -> Bitmap:
        other = jnp.full_like(pixels, 0x80808080)
        for color in colors:
            t = pixels ^ U(0x01010101 * color)
            other &= ((t & low) + low) | t  # 0x80 in each byte that is not zero
        nibbles = (((~(other | low) >> 7) * U(0x08040201)) >> 24) & U(15)
        parts = nibbles.reshape(-1, 8, *nibbles.shape[1:])
        word = parts[:, 0] << 28
        for i in range(1, 8):
            word = word | (parts[:, i] << (28 - 4 * i))
        return tuple(word)

    return [one(colors) for colors in sets]


def zeros_like(bitmap: Bitmap) -> Bitmap:
    """An empty bitmap of the same shape."""
    return tuple(jnp.zeros_like(w) for w in bitmap)


def left(bitmap: Bitmap, n: int) -> Bitmap:
    """Every pixel moved n to the left (n < 32)."""
    if n == 0:
        return bitmap
    following = (*bitmap[1:], None)
    return tuple(w << n if f is None else (w << n) | (f >> (32 - n)) for w, f in zip(bitmap, following, strict=True))


def right(bitmap: Bitmap, n: int) -> Bitmap:
    """Every pixel moved n to the right (n < 32)."""
    if n == 0:
        return bitmap
    before = (None, *bitmap[:-1])
    return tuple(w >> n if f is None else (w >> n) | (f << (32 - n)) for w, f in zip(bitmap, before, strict=True))


def both(a: Bitmap, b: Bitmap) -> Bitmap:
    """Intersection."""
    return tuple(x & y for x, y in zip(a, b, strict=True))


def either(a: Bitmap, b: Bitmap) -> Bitmap:
    """Union."""
    return tuple(x | y for x, y in zip(a, b, strict=True))


def minus(a: Bitmap, b: Bitmap) -> Bitmap:
    """Pixels of a that are not in b."""
    return tuple(x & ~y for x, y in zip(a, b, strict=True))


def spread(bitmap: Bitmap) -> Bitmap:
    """Each pixel and its neighbours left and right."""
    return either(bitmap, either(left(bitmap, 1), right(bitmap, 1)))


def fill_rows(mask: Bitmap, touched: Bitmap) -> Bitmap:
    """All horizontal runs of `mask` that hold a pixel of `touched` (a part of the mask), by doubling steps in both directions."""
    a, pa, b, pb, n = touched, mask, touched, mask, 1
    while n < 32 * len(mask):
        if n < 32:
            a, b = either(a, both(pa, left(a, n))), either(b, both(pb, right(b, n)))
            if 2 * n < 32 * len(mask):
                pa, pb = both(pa, left(pa, n)), both(pb, right(pb, n))
        else:  # whole words
            k, empty = n // 32, (jnp.zeros_like(mask[0]),)
            a = either(a, both(pa, (*a[k:], *empty * k)))
            b = either(b, both(pb, (*empty * k, *b[:-k])))
            if 2 * n < 32 * len(mask):
                pa, pb = both(pa, (*pa[k:], *empty * k)), both(pb, (*empty * k, *pb[:-k]))
        n *= 2
    return either(a, b)


def popcount(word: jax.Array) -> jax.Array:
    """Number of set bits, int32."""
    return lax.population_count(word).astype(jnp.int32)


def any_of(bitmap: Bitmap) -> jax.Array:
    """Words or-ed together: not zero where a row holds a pixel."""
    out = bitmap[0]
    for w in bitmap[1:]:
        out = out | w
    return out


def columns(words: Bitmap) -> tuple[jax.Array, jax.Array]:
    """First and last set column of bitmaps of a single row, int32; (32 * words, -1) where none is set."""
    n = 32 * len(words)
    first, last = jnp.full(words[0].shape, n, jnp.int32), jnp.full(words[0].shape, -1, jnp.int32)
    for i, w in reversed(list(enumerate(words))):
        first = jnp.where(w != 0, 32 * i + lax.clz(w).astype(jnp.int32), first)
    for i, w in enumerate(words):
        last = jnp.where(w != 0, 32 * i + 31 - _trailing(w), last)
    return first, last


def _trailing(w: jax.Array) -> jax.Array:
    """Number of zero bits below the lowest set bit, int32."""
    return popcount(~w & (w - 1))
