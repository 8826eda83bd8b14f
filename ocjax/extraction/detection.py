"""The vision rules of a game, applied to a batch of frames.

Masks are bitmaps (`ocjax.vision.bitmap`): uint32 `[5, H, B]`, the batch last.
"""

import dataclasses
import functools
import itertools
from collections import Counter
from collections.abc import Iterable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax._xla import kernels
from ocjax.console.boxes import WIDTH, Area
from ocjax.console.ops import pick
from ocjax.extraction.categories import Category
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.bounds import detect_bounds
from ocjax.vision.cells import cell_pixels, detect_cells
from ocjax.vision.components import components
from ocjax.vision.detected import OWN_COLOR, Detected, boxes
from ocjax.vision.rules import Blobs, Bounds, ByColor, Cells, Runs, Shades
from ocjax.vision.runs import detect_runs
from ocjax.vision.search import Search
from ocjax.vision.unknown import UNKNOWN_VALUE

EVEN = 0xFE  # an odd palette index shows as the even one below it
FEW = 2  # regions with the same colours up to which their mask is computed for each, in its rows only
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
        self._shade_bits = None if shades is None else kernels.materialize(functools.partial(_shade_bits, shades), frames)
        self.rules = {c.name: c.rule for c in categories}
        self.found: dict[str, Detected] = {}
        self._bounds = Counter(
            colors for c in categories if isinstance(c.rule, Bounds) for part in c.rule.parts for _, colors in part.slots
        )
        self._planes = bm.planes(frames)
        self._masks: dict[tuple[int, ...], Bitmap] = {}
        self._counted: dict[tuple[int, tuple[int, ...]], Bitmap] = {}

    def mask(self, colors: tuple[int, ...], *, materialize: bool = True) -> Bitmap:
        """The pixels that have one of the colours."""
        if not materialize and colors not in self._masks:
            return self._mask(self._planes, colors)
        if colors not in self._masks:
            self._masks[colors] = kernels.materialize(lambda planes: self._mask(planes, colors), self._planes)
        return self._masks[colors]

    def shifts(self, colors: tuple[int, ...]) -> bool:
        """Whether one of the colours changes from level to level."""
        return self.shades is not None and not set(self.shades.levels[0]).isdisjoint(colors)

    def shows_color(self, c: Category) -> bool:
        """Whether the colour of a category's objects is read from the frame."""
        return c.reads_color or (c.rgb is None and self.shifts(c.rule.palette))

    def needs_color(self, c: Category) -> bool:
        """Whether the colour of a category's objects is read: to show it, for their value, or because their rule asks for it."""
        return self.shows_color(c) or c.value is not None or (isinstance(c.rule, Blobs) and bool(c.rule.first_colors))

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
        if isinstance(rule, Blobs):
            read_once = rule.gap == (0, 0) and not limits and not lines
        else:
            read_once = self._bounds[colors] <= FEW and not rule.digits
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
        _, top, _, bottom = rule.region or (0, 0, WIDTH, mask.shape[1])
        differ = int(np.bitwise_or.reduce([c ^ colors[0] for c in colors]))
        return bm.in_lines(mask, self._planes, [i for i in range(7) if differ >> i + 1 & 1], (top, bottom), rule.min_line)


def _shade_bits(shades: Shades, frames: jax.Array) -> jax.Array:
    """The bits of the colours of each frame's level, the lowest bit first, as whole words: uint32 `[colours, 8, B]`."""
    x, y = shades.pixel
    key = frames[:, y, x].astype(jnp.int32) & EVEN
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
        For each category its boxes, whether or not the category that it needs is there; with colours where those are read from the frame.
    """
    asked, categories = categories, (*categories, *(_substitute(c) for c in categories if c.otherwise is not None))
    batch = _Frames(categories, frames, shades)
    batch.found |= _detect_blobs(batch, [c for c in categories if isinstance(c.rule, Blobs)])
    on_top = {c.name: c.rule for c in categories if isinstance(c.rule, Blobs) and c.rule.above is not None}
    batch.found |= {name: _cut_off(batch, name, rule) for name, rule in on_top.items()}
    loose = {c.name: c.rule for c in categories if isinstance(c.rule, Blobs) and c.rule.tight}
    batch.found |= {name: _tight(batch, rule, batch.found[name], batch.found[name].valid) for name, rule in loose.items()}
    bounds = {c.name: c.rule for c in categories if isinstance(c.rule, Bounds)}
    masks = [[batch.counted(part, colors) for part in rule.parts for _, colors in part.slots] for rule in bounds.values()]
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
    tall = {c.name: c.rule.headroom for c in categories if isinstance(c.rule, Blobs) and c.rule.headroom}
    batch.found |= {name: _raised(batch.found[name], rows) for name, rows in tall.items()}
    batch.found |= {c.name: _either(batch.found[c.name], batch.found[_substitute(c).name]) for c in asked if c.otherwise is not None}
    return [batch.found[c.name] for c in asked]


def _substitute(c: Category) -> Category:
    """A category for what another one's rule `otherwise` finds."""
    assert c.otherwise is not None
    return dataclasses.replace(c, name=f"{c.name} otherwise", rule=c.otherwise, otherwise=c.rule)


def _either(first: Detected, second: Detected) -> Detected:
    """The first objects on frames that have any, else the second ones; without heads, as colours have been read."""
    empty = ~jnp.any(first.valid, axis=0)

    def choose(own: jax.Array | None, other: jax.Array | None, default: int) -> jax.Array | None:
        if own is None or other is None:
            known = other if own is None else own
            if known is None:
                return None
            own, other = (jnp.full_like(known, default) if v is None else v for v in (own, other))
        return jnp.where(empty.reshape((1,) * (own.ndim - 1) + empty.shape), other, own)

    return Detected(
        jnp.where(empty[None], second.box, first.box),
        value=choose(first.value, second.value, UNKNOWN_VALUE),
        color=choose(first.color, second.color, OWN_COLOR),
        overflow=choose(first.overflow, second.overflow, 0),
    )


def _cut(rows: Detected, width: int, count: int) -> Detected:
    """The objects of a width that stand side by side in some boxes, the first `count` of them."""
    parts = jnp.where(rows.valid, -(-rows.w // width), 0)
    upto = kernels.running_sum(parts)
    rank = jnp.arange(count, dtype=jnp.int32)[:, None]
    before, box = _pick(rank, upto - parts, upto, upto - parts, rows.box)
    row = Detected(box)
    left = width * (rank - before)
    valid = rank < upto[-1:]
    cut = boxes(row.x + left, row.y, jnp.minimum(width, row.w - left), row.h, valid)
    return Detected(cut, overflow=jnp.maximum(upto[-1] - count, 0))


def _packed(found: Detected, count: int) -> Detected:
    """The first `count` of some objects, in the first slots."""
    one = found.valid.astype(jnp.int32)
    upto = kernels.running_sum(one)
    (box,) = _pick(jnp.arange(count, dtype=jnp.int32)[:, None], upto - one, upto, found.box)
    return Detected(box, overflow=jnp.maximum(upto[-1] - count, 0))


def _pick(rank: jax.Array, first: jax.Array, end: jax.Array, *fields: jax.Array) -> list[jax.Array]:
    """For each rank `[count, 1]` the fields `[n, B]` of the element with `first <= rank < end`; zeros without one."""
    here = (first[None] <= rank[:, None]) & (rank[:, None] < end[None])
    return [jnp.sum(jnp.where(here, field[None], 0), axis=1, dtype=field.dtype) for field in fields]


def _cut_off(batch: _Frames, name: str, rule: Blobs) -> Detected:
    """A category's boxes down to where the ones begin that reach into them from below, tight around the pixels that are left."""
    upper, lower = batch.found[name], batch.found[rule.above or ""]
    x, y, w, h = (v[:, None] for v in (upper.x, upper.y, upper.w, upper.h))
    x2, y2, w2 = (v[None] for v in (lower.x, lower.y, lower.w))
    inside = lower.valid[None] & (x2 < x + w) & (x < x2 + w2) & (y2 > y) & (y2 < y + h)
    left = jnp.minimum(upper.h, jnp.min(jnp.where(inside, y2 - y, h), axis=1))
    shorter = upper._replace(box=boxes(upper.x, upper.y, upper.w, left, upper.valid))
    return _tight(batch, rule, shorter, left < upper.h)


def _raised(found: Detected, rows: int) -> Detected:
    """The same objects with boxes that begin some rows further up, but not above the screen."""
    y = jnp.maximum(found.y - rows, 0)
    return found._replace(box=boxes(found.x, y, found.w, found.y + found.h - y, found.valid))


def _tight(batch: _Frames, rule: Blobs, found: Detected, which: jax.Array) -> Detected:
    """The same objects, with tight boxes around the pixels in those of some of them, bool `[count, B]`; one without pixels is dropped."""
    left, top, right, bottom = rule.region or (0, 0, WIDTH, batch.frames.shape[1])
    pixels = bm.cut(batch.counted(rule, rule.palette), (left, top, right, bottom))
    rows, columns = kernels.materialize(functools.partial(_marks, top), pixels, found.box)
    (first, last), (upper, lower) = bm.columns(columns), bm.rows(rows)
    tight = boxes(first, top + upper, last - first + 1, lower - upper + 1, found.valid & (lower >= 0))
    return found._replace(box=jnp.where(which, tight, found.box), head=None)


def _marks(top: int, pixels: Bitmap, box: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The words of each row of each box or-ed together, uint32 `[rows, n, B]`, and those of its rows, `[5, n, B]`.

    `top` is the row of the screen where `pixels` begin.
    """
    found, row = Detected(box), top + jnp.arange(pixels.shape[1], dtype=jnp.int32)[:, None, None]
    inside = (row >= found.y[None]) & (row < (found.y + found.h)[None])
    within = jnp.where(inside[None], pixels[:, :, None] & bm.columns_between(found.x, found.x + found.w)[:, None], U(0))
    return bm.any_of(within), bm.or_rows(within)


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
                searches.append(_search(rule, count, region, tuple(_search(other, count, region) for other in others)))
    heads = any(batch.needs_color(c) for c in categories)
    lists: dict[str, list[Detected]] = {c.name: [] for c in categories}
    for name, found in zip(owners, components(masks, searches, heads=heads), strict=True):
        lists[name].append(found)
    return {c.name: _merge(lists[c.name], c.count) for c in categories}


def _search(rule: Blobs, count: int, region: Area, also: tuple[Search, ...] = ()) -> Search:
    left, top, right, _ = region
    sizes = rule.min_size, rule.max_size, rule.split, rule.area
    return Search(count, rule.connectivity, rule.gap, *sizes, rule.pictures, top, (left, right), also)


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
    box = jnp.concatenate([found.box for found in lists])
    both, index = Detected(box), jnp.arange(len(box), dtype=jnp.int32)[:, None]
    order = jnp.where(both.valid, both.y * WIDTH + both.x, 2**16 - 1) * 2**15 + index  # one number each: sorting two arrays takes longer
    index = lax.sort(order, dimension=0)[:count] % 2**15
    heads = [found.head for found in lists if found.head is not None]
    head = jnp.take_along_axis(jnp.concatenate(heads), index, axis=0) if len(heads) == len(lists) else None
    merged = Detected(jnp.take_along_axis(box, index, axis=0), head=head)
    more = functools.reduce(jnp.add, (found.overflow for found in lists if found.overflow is not None))
    without_slot = jnp.sum(both.valid, axis=0, dtype=jnp.int32) - jnp.sum(merged.valid, axis=0, dtype=jnp.int32)
    return merged._replace(overflow=more + without_slot)


def _read_colors(batch: _Frames, categories: Sequence[Category]) -> None:
    """Read the colours of objects and the values that they tell, and drop objects that begin in another colour than their rule says."""
    wanted = [c for c in categories if batch.needs_color(c)]
    wanted.sort(key=lambda c: type(c.rule).__name__)  # slices of one array side by side: XLA joins them in one copy
    if not wanted:
        return
    colors = dict(zip((c.name for c in wanted), _read_off(batch, wanted), strict=True))
    for c in wanted:
        found, color, firsts = batch.found[c.name], colors[c.name], c.rule.first_colors if isinstance(c.rule, Blobs) else ()
        if firsts:
            found = found.where(functools.reduce(jnp.logical_or, (color == own for own in firsts)))
        if c.value is not None:
            found = found._replace(value=_told(c.value, color, batch.frames))
        batch.found[c.name] = found._replace(color=color) if batch.shows_color(c) else found


def _told(rule: ByColor, color: jax.Array, frames: jax.Array) -> jax.Array:
    """The values that colours tell, int32 `[count, B]`."""
    if rule.like is not None:
        left, top, right, bottom = rule.like
        shown = jnp.max(frames[:, top:bottom, left:right], axis=(1, 2)).astype(jnp.int32)  # black is 0
        return jnp.where(shown[None] > 0, (color == shown[None]).astype(jnp.int32), UNKNOWN_VALUE)
    out = jnp.full_like(color, UNKNOWN_VALUE)
    for own, value in rule.values:
        out = jnp.where(color == own, value, out)
    return out


def _row(found: Detected, offset: np.ndarray | np.int32) -> jax.Array:
    """A row of each box; a negative offset counts from the bottom, and one beyond the box is the last row."""
    inside = jnp.where(offset < 0, jnp.maximum(found.h + offset, 0), jnp.minimum(offset, jnp.maximum(found.h - 1, 0)))
    return found.y + inside


def _reads_all(c: Category) -> bool:
    """Whether all pixels of the category's colours are looked at for the colour: no limit applies to them, or different ones."""
    return isinstance(c.rule, Cells | Runs) or (isinstance(c.rule, Blobs) and c.rule.also is not None)


def _read_off(batch: _Frames, categories: Sequence[Category]) -> list[jax.Array]:
    """Palette index of the first pixel in one row of each box, `Category.color_row`; int32 `[count, B]` for each category."""
    found = [batch.found[c.name] for c in categories]
    lane, last_row = jnp.arange(batch.frames.shape[0])[None], batch.frames.shape[1] - 1
    rows = np.concatenate([np.full((c.count, 1), c.color_row, np.int32) for c in categories])
    y = jnp.minimum(_row(Detected(jnp.concatenate([f.box for f in found])), rows), last_row)
    heads = [_head(batch, c, f) if f.head is None or c.color_row else f.head for c, f in zip(categories, found, strict=True)]
    column = jnp.minimum(jnp.concatenate(heads), WIDTH - 1)
    color = batch.frames[lane, y, column].astype(jnp.int32) & EVEN
    ends = np.cumsum([0, *(len(f.box) for f in found)]).tolist()
    return [color[start:end] for start, end in itertools.pairwise(ends)]


def _head(batch: _Frames, c: Category, found: Detected) -> jax.Array:
    """Column of the first pixel in a row of each of a category's boxes, `Category.color_row`; int32 `[count, B]`."""
    mask = batch.mask(c.rule.palette) if _reads_all(c) else batch.counted(c.rule, c.rule.palette)  # pyright: ignore
    words = bm.rows_at(mask, jnp.minimum(_row(found, np.int32(c.color_row)), mask.shape[1] - 1))
    return bm.columns(bm.from_column(words, found.x))[0]
