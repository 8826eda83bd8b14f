"""`Bounds` rules: tight boxes of the pixels of regions, and the values of digits and gauges."""

import itertools
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla.kernels import materialize
from ocjax.console.boxes import WIDTH, Area
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.detected import Detected, boxes
from ocjax.vision.numbers import Reading, read_numbers
from ocjax.vision.rules import Bounds, Gauge
from ocjax.vision.unknown import UNKNOWN_VALUE

# Rows per strip; at most 32, one bit each in `_marks`. Rows `strips` of benchmarks/tricks.py.
STRIP_ROWS = 8
# Rows. Higher regions are sliced one by one instead of gathered. Row `gathered regions` of
# benchmarks/tricks.py.
MAX_GATHERED_ROWS = 40
MIN_GATHERED_REGIONS = 3  # of one mask; fewer are sliced one by one


def detect_bounds(rules: Sequence[Bounds], masks: Sequence[Sequence[Bitmap]]) -> list[Detected]:
    """Find the boxes of several rules' regions together.

    Args:
        masks: for each rule its selected pixels, one bitmap `[5, H, B]` per region of its `parts`.
    """
    if not rules:
        return []
    parts = [part for rule in rules for part in rule.parts]
    slots = [region for part in parts for region, _ in part.slots]
    x, y, w, h, head = tight_boxes([mask for own in masks for mask in own], slots)
    box = boxes(x, y, w, h, _of_size(parts, w, h))
    ends = np.cumsum([0, *(len(part.slots) for part in parts)]).tolist()
    found = iter(
        [Detected(box[start:end], head=head[start:end]) for start, end in itertools.pairwise(ends)]
    )
    numbers = [
        (digits, mask)
        for rule, own in zip(rules, masks, strict=True)
        if rule.digits
        for digits, mask in zip(rule.digits, own, strict=True)
    ]
    readings = iter(read_numbers(*zip(*numbers, strict=True)) if numbers else ())
    return [
        _with_value(rule, [next(found) for _ in rule.parts], [next(readings) for _ in rule.digits])
        for rule in rules
    ]


def _of_size(parts: Sequence[Bounds], w: jax.Array, h: jax.Array) -> jax.Array:
    """Test boxes against their rules' size limits, bool `[n, B]`."""
    least = np.concatenate([np.broadcast_to(part.min_size, (len(part.slots), 2)) for part in parts])
    fits = (w >= least[:, :1]) & (h >= least[:, 1:])
    if all(part.max_size is None for part in parts):
        return fits
    most = np.concatenate(
        [np.broadcast_to(part.max_size or (255, 255), (len(part.slots), 2)) for part in parts]
    )
    return fits & (w <= most[:, :1]) & (h <= most[:, 1:])


def _with_value(rule: Bounds, found: Sequence[Detected], readings: Sequence[Reading]) -> Detected:
    objects = found[0]
    if isinstance(rule.value, Gauge):
        length = getattr(found[-1], rule.value.side)
        steps = jnp.floor_divide(length - rule.value.start, rule.value.unit)
        value = rule.value.base + rule.value.worth * steps
        if rule.value.full is not None:
            value = jnp.where(length >= rule.value.full, UNKNOWN_VALUE, value)
        return objects._replace(value=jnp.broadcast_to(value, objects.box.shape))
    if not rule.digits:
        return objects
    value, matched = (jnp.stack(v) for v in zip(*readings, strict=True))
    optional = np.array([[not digits.required] for digits in rule.digits])
    return objects.where(matched | optional)._replace(value=value)


def tight_boxes(masks: Sequence[Bitmap], regions: Sequence[Area]) -> tuple[jax.Array, ...]:
    """Find the tight boxes of the pixels of masks inside regions.

    The rows of all regions are stacked in strips; each region fills an integer number.

    Returns:
        x, y, w, h and the column of the first pixel in the top row, int32 `[n, B]`. Without pixels,
        w and h are not positive.
    """
    groups = _groups(masks, regions)
    order = [i for group in groups for i in group]
    strips = np.array([-(-(bottom - top) // STRIP_ROWS) for _, top, _, bottom in regions])
    begins = np.zeros_like(strips)
    # An empty strip precedes all regions.
    begins[order] = 1 + np.cumsum([0, *strips[order[:-1]]])
    stack = jnp.zeros((WIDTH // 32, STRIP_ROWS * (1 + int(strips.sum())), masks[0].shape[2]), U)
    for group in groups:
        rows = _rows(masks[group[0]], [regions[i] for i in group])
        stack = lax.dynamic_update_slice(stack, rows, (0, STRIP_ROWS * int(begins[group[0]]), 0))
    columns, used = materialize(_marks, stack)
    index = np.arange(strips.max())[:, None]
    index = np.where(index < strips, begins + index, 0)  # strips of each region, `[most, n]`
    first, last = bm.columns(lax.reduce(columns[:, index], U(0), lax.bitwise_or, (1,)))
    top, bottom = bm.columns(used[index], STRIP_ROWS)
    first_rows = jnp.asarray(STRIP_ROWS * begins[:, None], jnp.int32)
    head, _ = bm.columns(bm.rows_at(stack, first_rows + jnp.where(bottom < 0, 0, top)))
    tops = np.array([[region[1]] for region in regions], np.int32)
    return first, top + tops, last - first + 1, bottom - top + 1, head


def _marks(stack: Bitmap) -> tuple[jax.Array, jax.Array]:
    """Reduce strips to their used columns and rows.

    Returns:
        The words of each strip's rows or-ed together, uint32 `[5, strips, B]`, and a bit for each
        row that holds a pixel, `[strips, B]`. The top row is the most significant bit.
    """
    words, rows, lanes = stack.shape
    in_strips = stack.reshape(words, rows // STRIP_ROWS, STRIP_ROWS, lanes)
    bits = (U(1 << 31) >> np.arange(STRIP_ROWS, dtype=np.uint32))[None, :, None]
    used = jnp.sum(jnp.where(bm.any_of(in_strips) != 0, bits, U(0)), axis=1, dtype=U)
    return lax.reduce(in_strips, U(0), lax.bitwise_or, (2,)), used


def _groups(masks: Sequence[Bitmap], regions: Sequence[Area]) -> list[list[int]]:
    """Group regions that are gathered at once: three or more low regions of one mask."""
    of_mask: dict[int, list[int]] = {}
    for i, (mask, (_, top, _, bottom)) in enumerate(zip(masks, regions, strict=True)):
        of_mask.setdefault(id(mask) if bottom - top <= MAX_GATHERED_ROWS else -1 - i, []).append(i)
    return [
        part
        for group in of_mask.values()
        for part in ([group] if len(group) >= MIN_GATHERED_REGIONS else [[i] for i in group])
    ]


def _rows(mask: Bitmap, regions: Sequence[Area]) -> Bitmap:
    """Stack the rows of regions, with the pixels outside cleared: `[5, rows, B]`.

    Several regions are padded to full strips each.
    """
    if len(regions) == 1:
        return bm.cut(mask, regions[0])
    rows, inside = [], []
    for left, top, right, bottom in regions:
        height = -(-(bottom - top) // STRIP_ROWS) * STRIP_ROWS
        rows.append(np.minimum(top + np.arange(height), bottom - 1))
        inside.append(bm.areas(height, [(left, 0, right, bottom - top)]))
    return mask[:, np.concatenate(rows)] & jnp.asarray(np.concatenate(inside, axis=1))
