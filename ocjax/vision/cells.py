"""`Cells` rules: objects on a fixed grid."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla import kernels
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.detected import Detected, boxes
from ocjax.vision.rules import Cells


def cell_pixels(rule: Cells, mask: Bitmap) -> Bitmap:
    """Select the pixels of the complete cells in a mask."""
    full = bm.all_within(mask, rule.w, rule.h)
    corners = bm.areas(
        mask.shape[1], ((x, y, x + 1, y + 1) for x, y in zip(rule.x, rule.y, strict=True))
    )
    return bm.any_within(full & jnp.asarray(corners), rule.w, rule.h)


def detect_cells(rule: Cells, mask: Bitmap, moving: Bitmap) -> Detected:
    """Find the objects of a rule in a mask `[5, H, B]`.

    `moving` are the pixels that give the position of a floating grid.
    """
    if rule.floats is None:
        return _detect(rule, mask)
    place = functools.partial(_to_own_place, rule, rule.floats[1])
    moved, down = kernels.materialize(place, mask, moving)
    found = _detect(rule, moved)
    return Detected(boxes(found.x, found.y + down[None], found.w, found.h, found.valid))


def _to_own_place(
    rule: Cells, usual: int, mask: Bitmap, moving: Bitmap
) -> tuple[Bitmap, jax.Array]:
    """Move the pixels of a floating grid up to the grid's usual rows.

    Rows are gathered: shifting bitmaps takes Phoenix 3 us per frame more.

    Returns:
        The moved pixels in the cells' rows and columns, and the distance in rows, int32 `[B]`.
    """
    height = mask.shape[1]
    columns = jnp.asarray(bm.areas(1, ((x, 0, x + rule.w, 1) for x in rule.x)))
    row = jnp.arange(1, height + 1, dtype=jnp.int32)[:, None]
    down = jnp.max(jnp.where(bm.any_of(moving & columns) != 0, row, 0), axis=0) - usual
    top = max(min(rule.y) - rule.margin[1], 0)
    shown = jnp.arange(top, rule.bottom, dtype=jnp.int32)[:, None] + down[None]
    there = (shown >= 0) & (shown < height)
    inside = jnp.where(
        there[None], bm.rows_at(mask, jnp.clip(shown, 0, height - 1)) & columns, U(0)
    )
    return jnp.pad(inside, ((0, 0), (top, 0), (0, 0))), down


def _detect(rule: Cells, mask: Bitmap) -> Detected:
    beside, above = rule.margin
    cells = _with_margin(rule, mask)
    inner = _columns(cells.shape[1], beside, beside + rule.w)
    around = _columns(cells.shape[1], 0, rule.w + 2 * beside) & ~inner
    margin_rows = (*cells[:above], *cells[above + rule.h :])
    cells = cells[above : above + rule.h]
    clear = jnp.all((lax.reduce(cells, U(0), lax.bitwise_or, (0,)) & around) == 0, axis=0)
    for row in margin_rows:
        clear = clear & jnp.all((row & inner) == 0, axis=0)
    return (
        _whole(rule, cells, inner, clear)
        if rule.whole
        else _tight(rule, cells & inner[None], clear)
    )


def _with_margin(rule: Cells, mask: Bitmap) -> jax.Array:
    """Cut out the rows of every cell with its margin, left-aligned in the first word.

    Returns:
        uint32 `[h + 2 * margin, words, cells, B]`.
    """
    beside, above = rule.margin
    board = jnp.pad(mask, ((1, 0), (above, above), (0, 0)))
    left = np.array(rule.x) + 32 - beside
    rows = np.array(rule.y)[None, :] + np.arange(rule.h + 2 * above)[:, None]
    return bm.gather_rows(board, left, rows, (rule.w + 2 * beside + 31) // 32)


def _columns(words: int, start: int, stop: int) -> jax.Array:
    """Set the columns from `start` to `stop`, uint32 `[words, 1, 1]`."""
    inside = np.zeros(32 * words, np.uint8)
    inside[start:stop] = 1
    return jnp.asarray(np.packbits(inside).view(">u4").astype(np.uint32))[:, None, None]


def _whole(rule: Cells, cells: jax.Array, inner: jax.Array, clear: jax.Array) -> Detected:
    every = lax.reduce(cells, U(0xFFFFFFFF), lax.bitwise_and, (0,))
    valid = clear & jnp.all((every & inner) == inner, axis=0)
    x, y = (np.array(v)[:, None] for v in (rule.x, rule.y))
    return Detected(boxes(x, y, rule.w, rule.h, valid))


def _tight(rule: Cells, cells: jax.Array, clear: jax.Array) -> Detected:
    used = bm.any_of(jnp.moveaxis(cells, 1, 0)) != 0  # [h, cells, B]
    index = jnp.arange(rule.h, dtype=jnp.int32)[:, None, None]
    top = jnp.min(jnp.where(used, index, rule.h), axis=0)
    bottom = jnp.max(jnp.where(used, index, -1), axis=0)
    first, last = bm.columns(lax.reduce(cells, U(0), lax.bitwise_or, (0,)))
    base_x, base_y = (
        jnp.asarray(v, jnp.int32)[:, None]
        for v in (np.array(rule.x) - rule.margin[0], np.array(rule.y))
    )
    return Detected(
        boxes(
            first + base_x, top + base_y, last - first + 1, bottom - top + 1, clear & (bottom >= 0)
        )
    )
