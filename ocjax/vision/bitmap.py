"""Masks as bitmaps: 32 pixels a word, the batch innermost.

A bitmap is a tuple of uint32 arrays `[rows, B]`, one for each 32 columns from left to right; the leftmost pixel is the most
significant bit. So the addition carry runs to the left along a row, a shift by a pixel is a shift of words, and every operation
vectorises over the batch.
"""

from collections.abc import Callable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jax import lax

U = jnp.uint32
Bitmap = tuple[jax.Array, ...]


LITTLE = 2**12  # elements


def kept(f: Callable[[jax.Array], Any], x: jax.Array) -> Any:
    """`f(x)`, kept in memory.

    The compiler fuses what is cheap into each of its uses, so that masks would be computed again, and frames transposed again, by every
    kernel that reads them: several times the work. What comes out of a condition is not fused; this one is always true. Where there is
    little to compute, the condition would cost more than it saves.
    """
    if x.size < LITTLE:
        return f(x)
    result = jax.eval_shape(f, x)
    return lax.cond(x.ravel()[0].astype(jnp.float32) >= 0, f, lambda _: jax.tree.map(jnp.zeros_like, result), x)


def words_of_pixels(frames: jax.Array) -> jax.Array:
    """uint8 `[B, H, 160]` -> uint32 `[40, H, B]`, four pixels a word."""
    b, h, w = frames.shape
    return kept(lambda f: jnp.transpose(lax.bitcast_convert_type(f.reshape(b, h, w // 4, 4), U), (2, 1, 0)), frames)


def color_masks(pixels: jax.Array, color_sets: Sequence[tuple[int, ...]]) -> jax.Array:
    """Which pixels have one of the colours of each set.

    Args:
        pixels: uint32 `[40, H, B]` of `words_of_pixels`.
        color_sets: palette indices.

    Returns:
        uint32 `[len(color_sets), 5, H, B]`: a bitmap for each set.

    Bytes equal to a colour are found by exclusive-or and a carry that does not cross bytes, their four flags gathered by one
    multiplication: 1 us a frame for the first colour of a set, 0.3 us for each further one.
    """
    low = U(0x7F7F7F7F)

    def mask(p: jax.Array, colors: tuple[int, ...]) -> jax.Array:
        different = U(0xFFFFFFFF)
        for c in colors:
            t = p ^ U(c * 0x01010101)
            different = different & (((t & low) + low) | t | low)  # the top bit of each byte that is not zero
        nibbles = (((~different >> 7) * U(0x08040201)) >> 24) & U(15)
        parts = nibbles.reshape(-1, 8, *p.shape[1:])
        word = parts[:, 0] << 28
        for i in range(1, 8):
            word = word | (parts[:, i] << (28 - 4 * i))
        return word

    return kept(lambda p: jnp.stack([mask(p, colors) for colors in color_sets]), pixels)


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
    """All horizontal runs of `mask` that hold a pixel of `touched` (a part of the mask).

    Within a word by doubling steps in both directions, then from word to word where a filled run goes on. (Doubling steps across words
    took 25 times as long for two words: the compiler computes what two words share once for each of its uses.)
    """
    filled = [_fill_word(m, t) for m, t in zip(mask, touched, strict=True)]
    for i in range(1, len(mask)):  # to the right: a run at the top of the word, all ones down to its first zero
        entering = (filled[i - 1] & 1) != 0
        head = ~(U(0xFFFFFFFF) >> lax.clz(~mask[i]))
        head = jnp.where(mask[i] == U(0xFFFFFFFF), mask[i], head)
        filled[i] = filled[i] | jnp.where(entering, head, U(0))
    for i in reversed(range(len(mask) - 1)):  # to the left: a run at the bottom of the word
        entering = (filled[i + 1] >> 31) != 0
        filled[i] = filled[i] | jnp.where(entering, mask[i] & ~(mask[i] + 1), U(0))
    return tuple(filled)


def _fill_word(mask: jax.Array, touched: jax.Array) -> jax.Array:
    a, pa, b, pb = touched, mask, touched, mask
    for n in (1, 2, 4, 8, 16):
        a, b = a | (pa & (a << n)), b | (pb & (b >> n))
        if n < 16:
            pa, pb = pa & (pa << n), pb & (pb >> n)
    return a | b


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
