"""Read numbers on the screen: compare cells of a bitmap with the pictures of a font."""

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla.kernels import materialize
from ocjax.console.fonts import BASE, Digits, Font
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.unknown import UNKNOWN_VALUE

# instead of a digit: an empty cell, and a cell with another picture
EMPTY, UNREADABLE = -1, -2


class Reading(NamedTuple):
    """The reading of a number's cells."""

    # int32 [B]; `UNKNOWN_VALUE` if a cell holds no digit, or one that should be free is not
    value: jax.Array
    # bool [B], whether the last cell matches a digit and the cells that should be free are free
    matched: jax.Array


def read_numbers(digits: Sequence[Digits], masks: Sequence[Bitmap]) -> list[Reading]:
    """Read numbers; numbers with the same font and mask are read together.

    Args:
        masks: the bitmap of each number, `[5, H, B]`.
    """
    groups: dict[tuple[int, Font], list[int]] = {}
    for i, (own, mask) in enumerate(zip(digits, masks, strict=True)):
        groups.setdefault((id(mask), own.font), []).append(i)
    out: dict[int, Reading] = {}
    for group in groups.values():
        out |= zip(group, _read([digits[i] for i in group], masks[group[0]]), strict=True)
    return [out[i] for i in range(len(digits))]


def _read(digits: Sequence[Digits], mask: Bitmap) -> list[Reading]:
    starts = np.cumsum([0, *(len(own.cells) for own in digits)]).tolist()
    worth = np.zeros((len(digits), starts[-1]), np.int32)
    for row, own, start in zip(worth, digits, starts, strict=False):
        row[start : start + len(own.lefts)] = own.worth
    first = min(own.top for own in digits)
    # A mask that is not materialized is computed only in these rows.
    rows = mask[:, first : max(own.bottom for own in digits)]
    shown = materialize(lambda m: _shown(digits, m, first), rows, small=0)
    number = jnp.sum(
        worth[:, :, None] * jnp.maximum(shown, 0)[None], axis=1, dtype=jnp.int32
    )  # [numbers, B]
    readings = []
    for i, (own, start) in enumerate(zip(digits, starts, strict=False)):
        end = start + len(own.lefts)
        cells = shown[start:end]
        value = own.base + (_centered(number[i], cells) if own.centered else number[i])
        unread, matched = jnp.any(cells == UNREADABLE, axis=0), cells[-1] >= 0
        if own.free:
            taken = jnp.any(shown[end : end + len(own.free)] != EMPTY, axis=0)
            unread, matched = unread | taken, matched & ~taken
        if own.step > 1:
            unread = unread | (value % own.step != 0)
        readings.append(Reading(jnp.where(unread, UNKNOWN_VALUE, value), matched))
    return readings


def _centered(number: jax.Array, shown: jax.Array) -> jax.Array:
    """Divide a number by the powers of ten that its empty cells on the right added."""
    cells = np.arange(len(shown), dtype=np.int32)[:, None]
    last = jnp.max(jnp.where(shown >= 0, cells, 0), axis=0)  # last cell with a digit
    powers = BASE ** cells[::-1]
    return number // jnp.sum(jnp.where(last[None] == cells, powers, 0), axis=0, dtype=jnp.int32)


def _shown(digits: Sequence[Digits], rows: Bitmap, first: int) -> jax.Array:
    """Read the digit in each cell, or `EMPTY` or `UNREADABLE`, int32 `[cells, B]`.

    The rows of the mask begin at row `first` of the screen.
    """
    pictures = _pictures(digits, rows, first)
    font = digits[0].font
    # A picture that several digits share is unreadable.
    read = [d for d in range(BASE) if font.glyphs.count(font.glyphs[d]) == 1]
    blank = (0,) * len(font.glyphs[0])
    # Some fonts have an empty picture.
    empty = font.signs if blank in font.glyphs else (*font.signs, blank)
    known, shapes = [*read, *[EMPTY] * len(empty)], [*(font.glyphs[d] for d in read), *empty]
    same = jnp.all(
        pictures[None] == jnp.asarray(shapes, U)[:, :, None, None], axis=1
    )  # [known, cells, B]
    return UNREADABLE + jnp.sum(
        jnp.where(same, np.array(known)[:, None, None] - UNREADABLE, 0), axis=0, dtype=jnp.int32
    )


def _pictures(digits: Sequence[Digits], rows: Bitmap, first: int) -> jax.Array:
    """Extract the dots in each cell, uint32 `[rows, cells, B]`, rightmost dot lowest.

    A dot is set if its first column has a pixel in any of its rows.
    """
    font = digits[0].font
    dot_width, dot_height = font.dot
    tops = np.concatenate([np.full(len(own.cells), own.top - first) for own in digits])
    lefts = np.concatenate([own.cells for own in digits])
    cells = bm.gather_rows(rows, lefts, tops + np.arange(font.height)[:, None], 1)[:, 0]
    cells = lax.reduce(
        cells.reshape(font.height // dot_height, dot_height, *cells.shape[1:]),
        U(0),
        lax.bitwise_or,
        (1,),
    )
    pictures = jnp.zeros_like(cells)
    for i in range(font.dots):
        pictures = (pictures << 1) | (cells >> (31 - i * dot_width) & 1)
    return pictures
