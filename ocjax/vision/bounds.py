"""`Bounds` rules: the tight box of a region's pixels, and the values that digits and gauges show."""

import itertools
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla import materialize
from ocjax.boxes import Area
from ocjax.digits import Digits
from ocjax.rules import Bounds, Gauge
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.detected import Detected, boxes

LOW = 40  # rows of a region up to which looking at several together takes no more time than one by one


def detect_bounds(rules: Sequence[Bounds], masks: Sequence[Sequence[Bitmap]]) -> list[Detected]:
    """The boxes of several rules' regions, found together.

    Args:
        rules: each with its regions.
        masks: for each rule the pixels that count, one bitmap `[5, H, B]` per region.
    """
    if not rules:
        return []
    slots = [(mask, region) for rule, own in zip(rules, masks, strict=True) for mask, (region, _) in zip(own, rule.slots, strict=True)]
    x, y, w, h = tight_boxes(*zip(*slots, strict=True))
    least = np.concatenate([np.broadcast_to(rule.min_size, (len(rule.slots), 2)) for rule in rules])
    box = boxes(x, y, w, h, (w >= least[:, :1]) & (h >= least[:, 1:]))
    ends = np.cumsum([0, *(len(rule.slots) for rule in rules)]).tolist()
    found = [Detected(box[start:end]) for start, end in itertools.pairwise(ends)]
    return [_with_value(rule, own, f) for rule, own, f in zip(rules, masks, found, strict=True)]


def _with_value(rule: Bounds, masks: Sequence[Bitmap], found: Detected) -> Detected:
    """The objects of one rule, with the values that they show."""
    if isinstance(rule.value, Gauge):
        length = found.h if rule.value.vertical else found.w
        return found._replace(value=rule.value.base + jnp.floor_divide(length - rule.value.start, rule.value.unit))
    if not rule.digits:
        return found
    readings = [read_digits(digits, mask) for digits, mask in zip(rule.digits, masks, strict=True)]
    value, matched = (jnp.stack(v) for v in zip(*readings, strict=True))
    optional = np.array([[not digits.required] for digits in rule.digits])
    return found.where(matched | optional)._replace(value=value)


def tight_boxes(masks: Sequence[Bitmap], regions: Sequence[Area]) -> tuple[jax.Array, ...]:
    """Tight boxes of the pixels of masks inside regions: x, y, w, h, int32 `[n, B]`; w and h are not positive where there are none."""
    groups = _groups(masks, regions)
    height = max(bottom - top for _, top, _, bottom in regions)

    def marks(*masks: Bitmap) -> tuple[jax.Array, jax.Array]:
        """The words of each row of each region or-ed together, uint32 `[height, n, B]`, and those of its rows, `[5, n, B]`."""
        inside = [_rows(masks[group[0]], [regions[i] for i in group]) for group in groups]
        rows = [jnp.pad(bm.any_of(part), ((0, height - part.shape[1]), (0, 0), (0, 0))) for part in inside]
        columns = [bm.or_blocks(part, bm.blocks_of(height)) for part in inside]  # as many blocks for each, to be or-ed at once
        return jnp.concatenate(rows, axis=1), bm.any_of(jnp.moveaxis(jnp.concatenate(columns, axis=2), 1, 0))

    rows, columns = materialize(marks, *masks)
    order = np.argsort([i for group in groups for i in group])
    (first, last), (top, bottom) = (tuple(side[order] for side in sides) for sides in (bm.columns(columns), bm.rows(rows)))
    tops = np.array([[region[1]] for region in regions], np.int32)
    return first, top + tops, last - first + 1, bottom - top + 1


def _groups(masks: Sequence[Bitmap], regions: Sequence[Area]) -> list[list[int]]:
    """Indices of regions that are looked at together: three or more low ones of one mask, whose rows are copied; any other alone."""
    of_mask: dict[int, list[int]] = {}
    for i, (mask, (_, top, _, bottom)) in enumerate(zip(masks, regions, strict=True)):
        of_mask.setdefault(id(mask) if bottom - top <= LOW else -1 - i, []).append(i)
    return [part for group in of_mask.values() for part in ([group] if len(group) > 2 else [[i] for i in group])]


def _rows(mask: Bitmap, regions: Sequence[Area]) -> jax.Array:
    """The rows of each region, side by side, with pixels outside the region cleared: uint32 `[5, rows, n, B]`."""
    if len(regions) == 1:
        return bm.cut(mask, regions[0])[:, :, None]
    height = max(bottom - top for _, top, _, bottom in regions)
    rows = [np.minimum(top + np.arange(height), bottom - 1) for _, top, _, bottom in regions]
    inside = [bm.areas(height, [(left, 0, right, bottom - top)]) for left, top, right, bottom in regions]
    return mask[:, np.stack(rows, axis=1)] & jnp.asarray(np.stack(inside, axis=2))


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
