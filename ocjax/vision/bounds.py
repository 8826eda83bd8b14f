"""`Bounds` rules: the tight box of a region's pixels, and the values that digits and gauges show."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax.digits import Digits
from ocjax.rules import Bounds, Gauge
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.components import Detected


def detect_bounds(rule: Bounds, masks: Sequence[Bitmap]) -> Detected:
    """The boxes of a rule's regions.

    Args:
        rule: with `count` regions.
        masks: the pixels that count, one bitmap `[5, H, B]` per region.
    """
    boxes = []
    for mask, (region, _) in zip(masks, rule.slots, strict=True):
        x, y, w, h = tight_box(bm.cut(mask, region))
        boxes.append((x, y + region[1], w, h))
    x, y, w, h = (jnp.stack(v) for v in zip(*boxes, strict=True))
    valid = (w >= rule.min_size[0]) & (h >= rule.min_size[1])
    if isinstance(rule.value, Gauge):
        length = h if rule.value.vertical else w
        value = rule.value.base + jnp.floor_divide(length - rule.value.start, rule.value.unit)
        return Detected(x, y, w, h, valid, value)
    if not rule.digits:
        return Detected(x, y, w, h, valid)
    readings = [read_digits(digits, mask) for digits, mask in zip(rule.digits, masks, strict=True)]
    value, matched = (jnp.stack(v) for v in zip(*readings, strict=True))
    optional = np.array([[not digits.required] for digits in rule.digits])
    return Detected(x, y, w, h, valid & (matched | optional), value)


def tight_box(mask: Bitmap) -> tuple[jax.Array, ...]:
    """Tight box of a whole mask: x, y, w, h, int32 `[B]`; w and h are not positive where the mask is empty."""
    rows = jnp.arange(mask.shape[1], dtype=jnp.int32)[:, None]
    used = bm.any_of(mask) != 0
    top = jnp.min(jnp.where(used, rows, len(rows)), axis=0)
    bottom = jnp.max(jnp.where(used, rows, -1), axis=0)
    first, last = bm.columns(lax.reduce(mask, U(0), lax.bitwise_or, (1,)))
    return first, top, last - first + 1, bottom - top + 1


def read_digits(digits: Digits, mask: Bitmap) -> tuple[jax.Array, jax.Array]:
    """The number that digits show, int32 `[B]`, and whether the last cell matches one of the font's pictures, bool `[B]`."""
    pictures = _pictures(digits, mask)
    glyphs = jnp.asarray(np.array(digits.font.glyphs), U)
    same = jnp.all(pictures[None] == glyphs[:, :, None, None], axis=1)  # [10, digits, B]
    worth = np.arange(len(glyphs))[:, None, None] * np.array(digits.worth)[None, :, None]
    number = digits.base + jnp.sum(jnp.where(same, jnp.asarray(worth, jnp.int32), 0), axis=(0, 1), dtype=jnp.int32)
    return number, jnp.any(same[:, -1], axis=0)


def _pictures(digits: Digits, mask: Bitmap) -> jax.Array:
    """The dots in each cell, uint32 `[rows, digits, B]` with the rightmost dot in the lowest bit.

    A dot is set where its first column has a pixel in any of its rows.
    """
    dot_width, dot_height = digits.font.dot
    rows = digits.font.height // dot_height
    cells = bm.gather_rows(mask, np.array(digits.lefts), digits.top + np.arange(digits.font.height)[:, None], 1)[:, 0]
    cells = lax.reduce(cells.reshape(rows, dot_height, *cells.shape[1:]), U(0), lax.bitwise_or, (1,))
    pictures = jnp.zeros_like(cells)
    for i in range(digits.font.dots):
        pictures = (pictures << 1) | (cells >> (31 - i * dot_width) & 1)
    return pictures
