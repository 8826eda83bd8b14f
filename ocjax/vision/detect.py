"""The vision rules of a game, applied to a batch of frames.

Masks are bitmaps (`ocjax.vision.bitmap`): uint32 `[5, H, B]`, the batch last.
"""

import dataclasses
import functools
from collections.abc import Iterable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax import _xla
from ocjax.boxes import WIDTH
from ocjax.ops import pick
from ocjax.rules import Blobs, Bounds, Category, Cells, Runs, Shades
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.bounds import detect_bounds, tight_boxes
from ocjax.vision.cells import cell_pixels, detect_cells
from ocjax.vision.components import Detected, components
from ocjax.vision.runs import detect_runs
from ocjax.vision.search import Search

_FILTERS = {  # by the name of the limit in `Blobs.limits`
    "max_run": bm.short_runs,
    "max_across": functools.partial(bm.short_runs, across=True),
    "max_line": bm.without_lines,
    "pairs": bm.without_pairs,
}


class _Frames:
    """A batch of frames, the colour masks computed from it so far, and what its categories' rules have detected so far."""

    def __init__(self, categories: tuple[Category, ...], frames: jax.Array, shades: Shades | None) -> None:
        self.frames = frames
        self.shades = shades
        self._shade_bits = None if shades is None else _xla.materialize(functools.partial(_shade_bits, shades), frames)
        self.rules = {c.name: c.rule for c in categories}
        self.found: dict[str, Detected] = {}
        self._planes = bm.planes(frames)
        self._masks: dict[tuple[int, ...], Bitmap] = {}
        self._counted: dict[tuple[int, tuple[int, ...]], Bitmap] = {}

    def mask(self, colors: tuple[int, ...], *, materialize: bool = True) -> Bitmap:
        """The pixels that have one of the colours."""
        if not materialize:
            return self._mask(self._planes, colors)
        if colors not in self._masks:
            self._masks[colors] = _xla.materialize(lambda planes: self._mask(planes, colors), self._planes)
        return self._masks[colors]

    def shifts(self, colors: tuple[int, ...]) -> bool:
        """Whether one of the colours changes from level to level."""
        return self.shades is not None and not set(self.shades.levels[0]).isdisjoint(colors)

    def _mask(self, planes: jax.Array, colors: tuple[int, ...]) -> Bitmap:
        if self.shades is None or self._shade_bits is None or not self.shifts(colors):
            return bm.color_mask(planes, colors)
        first = self.shades.levels[0]
        mask = bm.color_mask(planes, [c for c in colors if c not in first])
        for c in colors:
            if c in first:
                mask = mask | bm.shade_mask(planes, self._shade_bits[first.index(c)])
        return mask

    def cell_mask(self, rule: Cells) -> Bitmap:
        """The pixels of the colours that count for cells."""
        mask = self.mask(rule.palette)
        for name in rule.exclude:
            mask = mask & ~self._inside(name)
        return mask

    def _inside(self, name: str) -> Bitmap:
        """The pixels in the boxes of a category of `Blobs`."""
        found = self.found[name]
        return bm.boxes(found.x, found.y, found.w, found.h, found.valid, self.frames.shape[1])

    def counted(self, rule: Bounds | Blobs, colors: tuple[int, ...]) -> Bitmap:
        """The pixels of the colours that count for a rule."""
        key = id(rule), colors
        if key not in self._counted:
            self._counted[key] = self._count(rule, colors)
        return self._counted[key]

    def _count(self, rule: Bounds | Blobs, colors: tuple[int, ...]) -> Bitmap:
        limits = {name: limit for name, limit in rule.limits.items() if limit} if isinstance(rule, Blobs) else {}
        lines = isinstance(rule, Blobs) and rule.min_line > 0
        read_once = isinstance(rule, Blobs) and rule.gap == (0, 0) and not limits and not lines
        mask = self.mask(colors, materialize=not read_once)
        if isinstance(rule, Bounds) and rule.inverse:
            mask = ~mask
        if rule.ignore:
            mask = mask & jnp.asarray(~bm.areas(self.frames.shape[1], rule.ignore))
        for name in rule.exclude:
            other = self.rules[name]
            inside = cell_pixels(other, self.mask(other.palette)) if isinstance(other, Cells) else self._inside(name)
            mask = mask & ~inside
        for name, limit in limits.items():
            mask = _FILTERS[name](mask, limit)
        return self._in_lines(mask, rule, colors) if isinstance(rule, Blobs) and lines else mask

    def _in_lines(self, mask: Bitmap, rule: Blobs, colors: tuple[int, ...]) -> Bitmap:
        """The pixels in lines of a single colour, in the rows of the rule's region; only bits in which the colours differ are compared."""
        height = mask.shape[1]
        _, top, _, bottom = rule.region or (0, 0, WIDTH, height)
        differ = int(np.bitwise_or.reduce([c ^ colors[0] for c in colors]))
        planes = [self._planes[i, :, top:bottom] for i in range(8) if differ >> i & 1]
        lines = bm.in_lines(mask[:, top:bottom], planes, rule.min_line)
        return jnp.pad(lines, ((0, 0), (top, height - bottom), (0, 0)))


def _shade_bits(shades: Shades, frames: jax.Array) -> jax.Array:
    """The bits of the colours of each frame's level, the lowest bit first, as whole words: uint32 `[colours, 8, B]`."""
    x, y = shades.pixel
    key = frames[:, y, x].astype(jnp.int32)
    level = sum((jnp.where(key == k, i, 0) for i, k in enumerate(shades.keys)), jnp.zeros_like(key))
    colors = jnp.stack([pick(level, of_levels) for of_levels in zip(*shades.levels, strict=True)])
    return (-(colors[:, None] >> np.arange(8)[None, :, None] & 1)).astype(U)


def detect(categories: tuple[Category, ...], frames: jax.Array, shades: Shades | None = None) -> list[Detected]:
    """Apply each category's rule.

    Args:
        categories: of a game.
        frames: uint8 `[B, H, 160]` of palette indices.
        shades: which of the rules' colours change from level to level.

    Returns:
        For each category its boxes; with their colours where those are read from the frame.
    """
    asked, categories = categories, (*categories, *(_substitute(c) for c in categories if c.otherwise is not None))
    batch = _Frames(categories, frames, shades)
    batch.found |= _detect_blobs(batch, [c for c in categories if isinstance(c.rule, Blobs)])
    on_top = {c.name: c.rule for c in categories if isinstance(c.rule, Blobs) and c.rule.above is not None}
    batch.found |= {name: _cut_off(batch, name, rule) for name, rule in on_top.items()}
    loose = {c.name: c.rule for c in categories if isinstance(c.rule, Blobs) and c.rule.tight}
    batch.found |= {name: _tight(batch, rule, batch.found[name], batch.found[name].valid) for name, rule in loose.items()}
    bounds = {c.name: c.rule for c in categories if isinstance(c.rule, Bounds)}
    masks = [[batch.counted(rule, colors) for _, colors in rule.slots] for rule in bounds.values()]
    batch.found |= dict(zip(bounds, detect_bounds(tuple(bounds.values()), masks), strict=True))
    rows = [c for c in categories if isinstance(c.rule, Bounds) and c.rule.each]
    batch.found |= {c.name: _cut(batch.found[c.name], c.rule.each, c.count) for c in rows if isinstance(c.rule, Bounds)}
    batch.found |= {c.name: detect_cells(c.rule, batch.cell_mask(c.rule)) for c in categories if isinstance(c.rule, Cells)}
    runs = {c.name: c.rule for c in categories if isinstance(c.rule, Runs)}
    of_rows = [[batch.mask(colors) for _, colors in rule.rows] for rule in runs.values()]
    batch.found |= dict(zip(runs, detect_runs(tuple(runs.values()), of_rows), strict=True))
    packed = [c for c in categories if isinstance(c.rule, Runs) and c.rule.packed]
    batch.found |= {c.name: _packed(batch.found[c.name], c.count) for c in packed}
    _read_colors(batch, categories)
    batch.found |= {c.name: _either(batch.found[c.name], batch.found[_substitute(c).name]) for c in asked if c.otherwise is not None}
    return [_with_needed(batch.found, c) for c in asked]


def _substitute(c: Category) -> Category:
    """A category for what another one's rule `otherwise` finds."""
    assert c.otherwise is not None
    return dataclasses.replace(c, name=f"{c.name} otherwise", rule=c.otherwise, otherwise=c.rule)


def _either(first: Detected, second: Detected) -> Detected:
    """The first objects on frames that have any, else the second ones."""
    empty = ~jnp.any(first.valid, axis=0, keepdims=True)

    def part(name: str) -> jax.Array | None:
        own, other = getattr(first, name), getattr(second, name)
        if own is None and other is None:
            return None
        own, other = (jnp.zeros_like(first.x if name != "overflow" else first.x[0]) if v is None else v for v in (own, other))
        return jnp.where(empty if own.ndim > 1 else empty[0], other, own)

    return Detected(**{name: part(name) for name in Detected._fields})  # pyright: ignore[reportArgumentType]


def _cut(rows: Detected, width: int, count: int) -> Detected:
    """The objects of a width that stand side by side in some boxes, the first `count` of them."""
    parts = jnp.where(rows.valid, -(-rows.w // width), 0)
    before = jnp.cumsum(parts, axis=0) - parts
    rank = jnp.arange(count, dtype=jnp.int32)[:, None, None]
    here = (before[None] <= rank) & (rank < (before + parts)[None])

    def of_row(field: jax.Array) -> jax.Array:
        return jnp.sum(jnp.where(here, field[None], 0), axis=1)

    x = of_row(rows.x - width * before) + width * rank[:, 0]
    w = jnp.minimum(width, of_row(rows.x + rows.w) - x)
    total = jnp.sum(parts, axis=0)
    valid = rank[:, 0] < total[None]
    return Detected(x, of_row(rows.y), w, of_row(rows.h), valid, overflow=jnp.maximum(total - count, 0))


def _packed(found: Detected, count: int) -> Detected:
    """The first `count` of some objects, in the first slots."""
    one = found.valid.astype(jnp.int32)
    before = jnp.cumsum(one, axis=0) - one
    here = found.valid[None] & (before[None] == jnp.arange(count, dtype=jnp.int32)[:, None, None])
    x, y, w, h = (jnp.sum(jnp.where(here, field[None], 0), axis=1) for field in found[:4])
    return Detected(x, y, w, h, w > 0, overflow=jnp.maximum(jnp.sum(one, axis=0) - count, 0))


def _cut_off(batch: _Frames, name: str, rule: Blobs) -> Detected:
    """A category's boxes down to where the ones begin that reach into them from below, tight around the pixels that are left."""
    upper, lower = batch.found[name], batch.found[rule.above or ""]
    (x, y, w, h), (x2, y2, w2) = ([v[:, None] for v in upper[:4]], [v[None] for v in lower[:3]])
    inside = lower.valid[None] & (x2 < x + w) & (x < x2 + w2) & (y2 > y) & (y2 < y + h)
    left = jnp.minimum(upper.h, jnp.min(jnp.where(inside, y2 - y, h), axis=1))
    return _tight(batch, rule, upper._replace(h=left), left < upper.h)


def _tight(batch: _Frames, rule: Blobs, found: Detected, which: jax.Array) -> Detected:
    """The same objects, with tight boxes around the pixels in those of some of them, bool `[count, B]`."""
    pixels, height = batch.counted(rule, rule.palette), batch.frames.shape[1]
    slots = [slice(i, i + 1) for i in range(len(found.x))]
    parts = [pixels & bm.boxes(found.x[s], found.y[s], found.w[s], found.h[s], found.valid[s], height) for s in slots]
    tight = tight_boxes(parts, [rule.region or (0, 0, WIDTH, height)] * len(parts))
    x, y, w, h = (jnp.where(which, new, old) for new, old in zip(tight, found[:4], strict=True))
    return found._replace(x=x, y=y, w=w, h=h)


def _with_needed(found: dict[str, Detected], c: Category) -> Detected:
    """What was found of a category, without the frames that lack the category that it needs."""
    own = found[c.name]
    if c.needs is None:
        return own
    shown = jnp.any(found[c.needs].valid, axis=0, keepdims=True)
    overflow = None if own.overflow is None else jnp.where(shown[0], own.overflow, 0)
    return own._replace(valid=own.valid & shown, overflow=overflow)


def _detect_blobs(batch: _Frames, categories: Sequence[Category]) -> dict[str, Detected]:
    """The blobs of all categories, in one search."""
    if not categories:
        return {}
    height, width = batch.frames.shape[1:]
    owners, masks, searches = [], [], []
    for c in categories:
        assert isinstance(c.rule, Blobs)
        for rule, *others in _of_equal_pixels(c.rule.rules):
            region = rule.region or (0, 0, width, height)
            for colors in [(color,) for color in rule.palette] if rule.split_by_color else [rule.palette]:
                owners.append(c.name)
                masks.append(bm.cut(batch.counted(rule, colors), region))
                count = -(-c.count // 2) if rule.split_by_color else c.count
                searches.append(_search(rule, count, region[1], tuple(_search(other, count, region[1]) for other in others)))
    lists: dict[str, list[Detected]] = {c.name: [] for c in categories}
    for name, found in zip(owners, components(masks, searches), strict=True):
        lists[name].append(found)
    return {c.name: _merge(lists[c.name], c.count) for c in categories}


def _search(rule: Blobs, count: int, top: int, also: tuple[Search, ...] = ()) -> Search:
    return Search(count, rule.connectivity, rule.gap, rule.min_size, rule.max_size, rule.split, rule.area, top, also)


def _of_equal_pixels(rules: Sequence[Blobs]) -> Iterable[list[Blobs]]:
    """Rules that differ only in what sizes they accept, together."""
    groups: dict[tuple[object, ...], list[Blobs]] = {}
    for r in rules:
        limits = tuple(r.limits.items())
        pixels = r.palette, r.region, r.connectivity, r.gap, r.split_by_color, limits, r.min_line, tuple(r.ignore), tuple(r.exclude)
        groups.setdefault(pixels, []).append(r)
    return groups.values()


def _merge(lists: Sequence[Detected], count: int) -> Detected:
    """The first `count` boxes of several searches, in raster order of their corners."""
    if len(lists) == 1:
        return lists[0]
    x, y, w, h, valid = (jnp.concatenate(v) for v in list(zip(*lists, strict=True))[:5])
    index = jnp.arange(len(x), dtype=jnp.int32)[:, None]
    order = jnp.where(valid, y * WIDTH + x, 2**16 - 1) * 2**15 + index  # one number each: sorting five arrays takes seven times as long
    index = lax.sort(order, dimension=0)[:count] % 2**15
    x, y, w, h = (jnp.take_along_axis(v, index, axis=0) for v in (x, y, w, h))
    found = sum(jnp.sum(b.valid, axis=0, dtype=jnp.int32) for b in lists)
    overflow = functools.reduce(jnp.add, (b.overflow for b in lists if b.overflow is not None))
    return Detected(x, y, w, h, w > 0, overflow=overflow + found - jnp.sum(w > 0, axis=0, dtype=jnp.int32))


def _read_colors(batch: _Frames, categories: Sequence[Category]) -> None:
    """Read the colours of objects where they are wanted, and drop those that begin in another colour than their rule says."""
    firsts = {c.name: c.rule.first_colors for c in categories if isinstance(c.rule, Blobs)}
    reads = {c.name: c.reads_color or (c.rgb is None and batch.shifts(c.rule.palette)) for c in categories}
    wanted = [c for c in categories if reads[c.name] or firsts.get(c.name)]
    if not wanted:
        return
    masks = [batch.mask(c.rule.palette) if _reads_all(c) else batch.counted(c.rule, c.rule.palette) for c in wanted]  # pyright: ignore
    colors = _first_pixel_colors(batch.frames, masks, [batch.found[c.name] for c in wanted])
    for c, color in zip(wanted, colors, strict=True):
        found = batch.found[c.name]
        if firsts.get(c.name):
            matches = functools.reduce(jnp.logical_or, (color == own for own in firsts[c.name]))
            found = found._replace(valid=found.valid & matches)
        batch.found[c.name] = found._replace(color=color) if reads[c.name] else found


def _reads_all(c: Category) -> bool:
    """Whether all pixels of the category's colours are looked at for the colour, as each of its objects has others that count."""
    return isinstance(c.rule, Cells) or (isinstance(c.rule, Blobs) and c.rule.also is not None)


def _first_pixel_colors(frames: jax.Array, masks: Sequence[Bitmap], found: Sequence[Detected]) -> list[jax.Array]:
    """Palette index of the first pixel in the top row of each box, int32 `[count, B]` for each category."""
    lane = jnp.arange(frames.shape[0])[None]
    x, y = (jnp.concatenate([getattr(f, name) for f in found]) for name in ("x", "y"))
    y = jnp.clip(y, 0, frames.shape[1] - 1)
    ends = np.cumsum([len(f.x) for f in found]).tolist()
    rows = [y[end - len(f.x) : end] for f, end in zip(found, ends, strict=True)]
    words = jnp.concatenate([bm.rows_at(mask, row) for mask, row in zip(masks, rows, strict=True)], axis=1)
    start = jnp.clip(x[None] - 32 * jnp.arange(len(words), dtype=jnp.int32)[:, None, None], 0, 32)
    words = words & jnp.where(start < 32, U(0xFFFFFFFF) >> jnp.minimum(start, 31).astype(U), U(0))
    column = jnp.minimum(bm.columns(words)[0], WIDTH - 1)
    color = frames[lane, y, column].astype(jnp.int32)
    return [color[end - len(f.x) : end] for f, end in zip(found, ends, strict=True)]
