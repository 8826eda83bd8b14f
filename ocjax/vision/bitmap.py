"""Masks as bitmaps: 32 pixels a word, the batch innermost.

A bitmap is uint32 `[words, rows, B]`, a word for each 32 columns from left to right; the leftmost pixel is the most significant bit.
So the addition carry runs to the left along a row, a shift by a pixel is a shift of words, and every operation vectorises over the
batch.
"""

import functools
import operator
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import jax
import jax.numpy as jnp
from jax import lax

U = jnp.uint32
Bitmap = jax.Array


LITTLE = 2**12  # elements


def kept(f: Callable[..., Any], *x: jax.Array, little: int = LITTLE) -> Any:
    """`f(*x)`, kept in memory.

    The compiler fuses what is cheap into each of its uses, so that masks would be computed again, and frames transposed again, by every
    kernel that reads them: several times the work. What comes out of a condition is not fused; this one is always true. Where there is
    little to compute, the condition would cost more than it saves.
    """
    if x[0].size < little:
        return f(*x)
    result = jax.eval_shape(f, *x)
    return lax.cond(x[0].ravel()[0].astype(jnp.float32) >= 0, f, lambda *_: jax.tree.map(jnp.zeros_like, result), *x)


def planes(frames: jax.Array) -> tuple[jax.Array, ...]:
    """The eight bits of every pixel, the lowest first: uint8 `[B, H, 160]` -> bitmaps of uint32 `[5, H, B]`."""
    b, h, w = frames.shape
    pixels = kept(lambda f: jnp.transpose(lax.bitcast_convert_type(f.reshape(b, h, w // 4, 4), U), (2, 1, 0)), frames)

    def plane(p: jax.Array, bit: int) -> jax.Array:
        parts = (p.reshape(w // 32, 8, h, b) >> bit) & U(0x01010101)
        word = jnp.zeros_like(parts[:, 0])
        for i in range(0, 8, 2):  # a multiplication gathers the bits of eight pixels in the top byte
            word = word | ((((parts[:, i] << 4) | parts[:, i + 1]) * U(0x08040201)) >> 24) << (24 - 4 * i)
        return word

    return kept(lambda p: tuple(plane(p, bit) for bit in range(8)), pixels)


def color_mask(planes: Sequence[jax.Array], colors: Iterable[int]) -> jax.Array:
    """Which pixels have one of the colours: a bitmap `[5, H, B]` from those of `planes`.

    The set's decision diagram over the bits of a colour: 0.1 to 0.5 us a frame. (Comparing four pixels at a time with every
    colour took 0.3 for each, and 24 instead of 2 for the 18 colours of Berzerk's sets.)
    """

    @functools.cache
    def node(bit: int, members: frozenset[int]) -> jax.Array | bool:
        if len(members) in (0, 2 ** (bit + 1)):
            return len(members) > 0
        high = node(bit - 1, frozenset(m - 2**bit for m in members if m >= 2**bit))
        low = node(bit - 1, frozenset(m for m in members if m < 2**bit))
        plane = planes[bit]
        if isinstance(high, bool):
            return (
                (plane | low if high else ~plane & low) if not isinstance(low, bool) else high if high == low else plane if high else ~plane
            )
        if isinstance(low, bool):
            return ~plane | high if low else plane & high
        return high if high is low else (plane & high) | (~plane & low)

    return jnp.broadcast_to(jnp.asarray(node(7, frozenset(colors)), U), planes[0].shape)


def left(bitmap: Bitmap, n: int) -> Bitmap:
    """Every pixel moved n to the left (n < 32)."""
    if n == 0:
        return bitmap
    return (bitmap << n) | _pad(bitmap[1:] >> (32 - n), (0, 1))


def right(bitmap: Bitmap, n: int) -> Bitmap:
    """Every pixel moved n to the right (n < 32)."""
    if n == 0:
        return bitmap
    return (bitmap >> n) | _pad(bitmap[:-1] << (32 - n), (1, 0))


def _pad(words: jax.Array, by: tuple[int, int]) -> jax.Array:
    return jnp.pad(words, (by, *((0, 0),) * (words.ndim - 1)))


def down(bitmap: Bitmap, n: int) -> Bitmap:
    """Every pixel moved n down."""
    return jnp.pad(bitmap[:, :-n], ((0, 0), (n, 0), (0, 0)))


def up(bitmap: Bitmap, n: int) -> Bitmap:
    """Every pixel moved n up."""
    return jnp.pad(bitmap[:, n:], ((0, 0), (0, n), (0, 0)))


def spread(bitmap: Bitmap) -> Bitmap:
    """Each pixel and its neighbours left and right."""
    return bitmap | left(bitmap, 1) | right(bitmap, 1)


def fill_rows(mask: Bitmap, touched: Bitmap, reach: int = 31) -> tuple[jax.Array, ...]:
    """All horizontal runs of `mask` that hold a pixel of `touched` (a part of the mask), at least so far to both sides.

    Within a word to the left by a carry, to the right by doubling steps, then from word to word where a filled run goes on. (Doubling
    steps across words took 25 times as long for two words: the compiler computes what two words share once for each of its uses.)
    """
    filled = [_fill_word(m, t, reach) for m, t in zip(mask, touched, strict=True)]
    for i in range(1, len(mask)):  # to the right: a run at the top of the word, all ones down to its first zero
        entering = (filled[i - 1] & 1) != 0
        head = ~(U(0xFFFFFFFF) >> lax.clz(~mask[i]))
        head = jnp.where(mask[i] == U(0xFFFFFFFF), mask[i], head)
        filled[i] = filled[i] | jnp.where(entering, head, U(0))
    for i in reversed(range(len(mask) - 1)):  # to the left: a run at the bottom of the word
        entering = (filled[i + 1] >> 31) != 0
        filled[i] = filled[i] | jnp.where(entering, mask[i] & ~(mask[i] + 1), U(0))
    return tuple(filled)


def _fill_word(mask: jax.Array, touched: jax.Array, reach: int) -> jax.Array:
    filled = mask & (~(mask + touched) | touched)
    n = 1
    while n <= min(reach, 31):
        filled = filled | (mask & (filled >> n))
        if 2 * n <= min(reach, 31):
            mask = mask & (mask >> n)
        n *= 2
    return filled


def popcount(word: jax.Array) -> jax.Array:
    """Number of set bits, int32."""
    return lax.population_count(word).astype(jnp.int32)


def any_of(bitmap: Bitmap) -> jax.Array:
    """Words or-ed together: not zero where a row holds a pixel."""
    return functools.reduce(operator.or_, bitmap)


def columns(words: jax.Array) -> tuple[jax.Array, jax.Array]:
    """First and last set column of single rows `[words, ...]`, int32; (32 * words, -1) where none is set."""
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
