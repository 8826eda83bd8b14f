"""The vision rules of a game, applied to a batch of frames.

Masks are bitmaps (`ocjax.vision.bitmap`): uint32 `[5, H, B]`, the batch last.
"""

import functools
from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jax import lax

from ocjax import _xla
from ocjax.boxes import WIDTH
from ocjax.rules import Blobs, Bounds, Category, Cells
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.bounds import detect_bounds
from ocjax.vision.cells import cell_pixels, detect_cells
from ocjax.vision.components import Detected, Search, components


def _first_pixel_color(frames: jax.Array, mask: Bitmap, found: Detected) -> jax.Array:
    """Palette index of the first pixel in each box's top row, int32 `[count, B]`."""
    lane = jnp.arange(found.x.shape[1])[None]
    y = jnp.clip(found.y, 0, mask.shape[1] - 1)
    column = jnp.full_like(found.x, 0)
    for i, word in reversed(list(enumerate(mask))):
        start = jnp.clip(found.x - 32 * i, 0, 32)
        w = word[y, lane] & jnp.where(start < 32, U(0xFFFFFFFF) >> jnp.minimum(start, 31).astype(U), U(0))
        column = jnp.where(w != 0, 32 * i + lax.clz(w).astype(jnp.int32), column)
    return frames[lane, y, column].astype(jnp.int32)


class _Frames:
    """A batch of frames, the colour masks computed from it so far, and what its categories' rules have detected so far."""

    def __init__(self, categories: tuple[Category, ...], frames: jax.Array) -> None:
        self.frames = frames
        self.rules = {c.name: c.rule for c in categories}
        self.found: dict[str, Detected] = {}
        self._planes = bm.planes(frames)
        self._masks: dict[tuple[int, ...], Bitmap] = {}

    def mask(self, colors: tuple[int, ...], *, materialize: bool = True) -> Bitmap:
        """The pixels that have one of the colours."""
        if not materialize:
            return bm.color_mask(self._planes, colors)
        if colors not in self._masks:
            self._masks[colors] = _xla.materialize(lambda *planes: bm.color_mask(planes, colors), *self._planes)
        return self._masks[colors]

    def counted(self, rule: Bounds | Blobs, colors: tuple[int, ...]) -> Bitmap:
        """The pixels of the colours that count for a rule."""
        read_once = isinstance(rule, Blobs) and rule.gap == (0, 0) and not rule.max_run
        mask = self.mask(colors, materialize=not read_once)
        if isinstance(rule, Bounds) and rule.inverse:
            mask = ~mask
        if rule.ignore:
            mask = mask & jnp.asarray(~bm.areas(self.frames.shape[1], rule.ignore))
        for name in rule.exclude:
            other = self.rules[name]
            if isinstance(other, Cells):
                mask = mask & ~cell_pixels(other, self.mask(other.palette))
            else:
                found = self.found[name]
                mask = mask & ~bm.boxes(found.x, found.y, found.w, found.h, found.valid, mask.shape[1])
        return bm.short_runs(mask, rule.max_run) if isinstance(rule, Blobs) and rule.max_run else mask


def detect(categories: tuple[Category, ...], frames: jax.Array) -> list[Detected]:
    """Apply each category's rule.

    Args:
        categories: of a game.
        frames: uint8 `[B, H, 160]` of palette indices.

    Returns:
        For each category its boxes; with their colours where those are read from the frame.
    """
    batch = _Frames(categories, frames)
    for connectivity in (4, 8):
        batch.found |= _detect_blobs(batch, [c for c in categories if isinstance(c.rule, Blobs) and c.rule.connectivity == connectivity])
    for c in categories:
        if isinstance(c.rule, Bounds):
            batch.found[c.name] = detect_bounds(c.rule, [batch.counted(c.rule, colors) for _, colors in c.rule.slots])
        elif isinstance(c.rule, Cells):
            batch.found[c.name] = detect_cells(c.rule, batch.mask(c.rule.palette))
    return [_with_color(batch, c) for c in categories]


def _detect_blobs(batch: _Frames, categories: Sequence[Category]) -> dict[str, Detected]:
    """Blobs of one connectivity, all categories in one search."""
    if not categories:
        return {}
    height, width = batch.frames.shape[1:]
    owners, masks, searches, tops = [], [], [], []
    for c in categories:
        rule = c.rule
        assert isinstance(rule, Blobs)
        region = rule.region or (0, 0, width, height)
        for colors in [(color,) for color in rule.palette] if rule.split_by_color else [rule.palette]:
            owners.append(c.name)
            masks.append(bm.cut(batch.counted(rule, colors), region))
            count = -(-c.count // 2) if rule.split_by_color else c.count
            searches.append(Search(count, rule.gap, rule.min_size, rule.max_size, rule.split, rule.area))
            tops.append(region[1])
    connectivity = categories[0].rule.connectivity  # pyright: ignore[reportAttributeAccessIssue]
    lists: dict[str, list[Detected]] = {c.name: [] for c in categories}
    for name, top, found in zip(owners, tops, components(masks, searches, connectivity=connectivity), strict=True):
        lists[name].append(found._replace(y=found.y + top))
    return {c.name: _merge(lists[c.name], c.count) for c in categories}


def _merge(lists: Sequence[Detected], count: int) -> Detected:
    """The first `count` boxes of several searches, in raster order of their corners."""
    if len(lists) == 1:
        return lists[0]
    x, y, w, h, valid = (jnp.concatenate(v) for v in list(zip(*lists, strict=True))[:5])
    index = jnp.arange(len(x), dtype=jnp.int32)[:, None]
    order = jnp.where(valid, y * WIDTH + x, 2**16 - 1) * 2**15 + index  # one number each: sorting five arrays takes seven times as long
    index = lax.sort(order, dimension=0)[:count] % 2**15
    x, y, w, h = (jnp.take_along_axis(v, index, axis=0) for v in (x, y, w, h))
    total = sum(jnp.sum(b.valid, axis=0, dtype=jnp.int32) + b.overflow for b in lists)
    return Detected(x, y, w, h, w > 0, overflow=total - jnp.sum(w > 0, axis=0, dtype=jnp.int32))


def _with_color(batch: _Frames, category: Category) -> Detected:
    """What was detected of a category, with colours where they are read from the frame."""
    found, rule = batch.found[category.name], category.rule
    first = rule.first_colors if isinstance(rule, Blobs) else ()
    if not (category.reads_color or first):
        return found
    mask = batch.mask(rule.palette) if isinstance(rule, Cells) else batch.counted(rule, rule.palette)
    color = _first_pixel_color(batch.frames, mask, found)
    if first:
        matches = functools.reduce(jnp.logical_or, (color == own for own in first))
        found = found._replace(valid=found.valid & matches)
    return found._replace(color=color) if category.reads_color else found
