"""The vision rules of a game, evaluated on a batch of frames at once."""

import functools
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax.spec import WIDTH, Blobs, Bounds, Category, Cells, Digits, Gauge, Region, Rule
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.components import Boxes, Search, components


class Seen(NamedTuple):
    """What a rule sees, one entry a slot, batch innermost."""

    x: jax.Array  # int32 [count, B]
    y: jax.Array
    w: jax.Array
    h: jax.Array
    valid: jax.Array  # bool [count, B]
    value: jax.Array | None = None  # int32 [count, B]; None: 0
    unfit: jax.Array | None = None  # int32 [B]: objects that did not fit; None: there are none


def _cut(mask: Bitmap, region: Region) -> Bitmap:
    """The rows of a region, with pixels outside its columns cleared."""
    left, top, right, bottom = region
    return mask[:, top:bottom] & jnp.asarray(_static(1, [(left, 0, right, 1)]))


def _static(height: int, areas: Iterable[Region]) -> np.ndarray:
    """A bitmap `[words, height, 1]` of areas that is the same for all frames."""
    inside = np.zeros((height, WIDTH), np.uint8)
    for left, top, right, bottom in areas:
        inside[top:bottom, left:right] = 1
    words = np.packbits(inside, axis=1).reshape(height, -1, 4).view(">u4")[..., 0].astype(np.uint32)
    return words.T[..., None]


def _over(bitmap: Bitmap, size: int, move: Callable[[Bitmap, int], Bitmap], join: Callable[[Bitmap, Bitmap], Bitmap]) -> Bitmap:
    """Every pixel joined with the `size - 1` next to it on one side."""
    n = 1
    while n < size:
        step = min(n, size - n)
        bitmap, n = join(bitmap, move(bitmap, step)), n + step
    return bitmap


def _thin(mask: Bitmap, most: int) -> Bitmap:
    """The pixels of vertical runs of at most so many."""
    return mask & ~_over(_over(mask, most + 1, bm.up, jnp.bitwise_and), most + 1, bm.down, jnp.bitwise_or)


def _whole_cells(rule: Cells, mask: Bitmap) -> Bitmap:
    """The pixels of the cells that are present, by the neighbours of every pixel at once."""
    full = _over(_over(mask, rule.w, bm.left, jnp.bitwise_and), rule.h, bm.up, jnp.bitwise_and)
    corners = _static(mask.shape[1], ((x, y, x + 1, y + 1) for x, y in zip(rule.x, rule.y, strict=True)))
    return _over(_over(full & jnp.asarray(corners), rule.w, bm.right, jnp.bitwise_or), rule.h, bm.down, jnp.bitwise_or)


def _painted(seen: Seen, like: Bitmap) -> Bitmap:
    """All pixels of the boxes."""
    rows = jnp.arange(like.shape[1], dtype=jnp.int32)[:, None]
    out = []
    for i in range(len(like)):
        first, last = (jnp.clip(v - 32 * i, 0, 32) for v in (seen.x, seen.x + seen.w))
        columns = (U(0xFFFFFFFF) >> jnp.minimum(first, 31).astype(U)) & ~(U(0x7FFFFFFF) >> jnp.maximum(last - 1, 0).astype(U))
        columns = jnp.where(seen.valid & (first < last), columns, U(0))
        word = jnp.zeros_like(like[i])
        for k in range(seen.x.shape[0]):
            inside = (rows >= seen.y[k][None]) & (rows < (seen.y[k] + seen.h[k])[None])
            word = word | jnp.where(inside, columns[k][None], U(0))
        out.append(word)
    return jnp.stack(out)


def _bounds(mask: Bitmap) -> tuple[jax.Array, ...]:
    """Tight box of a whole mask: x, y, w, h, int32 `[B]`; w and h are not positive where it is empty."""
    rows = jnp.arange(mask.shape[1], dtype=jnp.int32)[:, None]
    used = bm.any_of(mask) != 0
    top = jnp.min(jnp.where(used, rows, len(rows)), axis=0)
    bottom = jnp.max(jnp.where(used, rows, -1), axis=0)
    first, last = bm.columns(lax.reduce(mask, U(0), lax.bitwise_or, (1,)))
    return first, top, last - first + 1, bottom - top + 1


def _see_bounds(rule: Bounds, masks: Sequence[Bitmap]) -> Seen:
    boxes = []
    for mask, (region, _) in zip(masks, rule.parts, strict=True):
        x, y, w, h = _bounds(_cut(mask, region))
        boxes.append((x, y + region[1], w, h))
    x, y, w, h = (jnp.stack(v) for v in zip(*boxes, strict=True))
    value, valid = None, (w >= rule.min_size[0]) & (h >= rule.min_size[1])
    if isinstance(rule.value, Gauge):
        value = rule.value.base + jnp.floor_divide((h if rule.value.vertical else w) - rule.value.start, rule.value.unit)
    elif rule.digits:
        numbers, held = zip(*(_read(digits, mask) for digits, mask in zip(rule.digits, masks, strict=True)), strict=True)
        value = jnp.stack(numbers)
        if any(digits.required for digits in rule.digits):
            valid = valid & jnp.stack([h | (not digits.required) for h, digits in zip(held, rule.digits, strict=True)])
    return Seen(x, y, w, h, valid, value)


def _read(digits: Digits, mask: Bitmap) -> tuple[jax.Array, jax.Array]:
    """The number that digits show, int32 `[B]`, and whether the last cell holds one of the pictures."""
    (columns, rows), (dot_w, dot_h) = digits.dots, digits.size
    board = jnp.pad(mask, ((0, 1), (0, 0), (0, 0)))
    at = np.array(digits.lefts)
    word = (at >> 5)[None, None, :] + np.arange(2)[None, :, None]
    row = digits.top + np.arange(rows * dot_h)[:, None, None]
    cells = board[word, row]  # [rows * dot_h, 2, digits, B]
    shift = jnp.asarray(at & 31, U)[None, :, None]
    cells = (cells[:, 0] << shift) | ((cells[:, 1] >> 1) >> (31 - shift))
    cells = lax.reduce(cells.reshape(rows, dot_h, *cells.shape[1:]), U(0), lax.bitwise_or, (1,))
    picture = jnp.zeros_like(cells)
    for i in range(columns):
        picture = (picture << 1) | (cells >> (31 - i * dot_w) & 1)
    table = jnp.asarray(digits.table, U)
    same = jnp.all(picture[None] == table[:, :, None, None], axis=1)  # [10, digits, B]
    worth = np.arange(10)[:, None, None] * np.array(digits.worth)[None, :, None]
    number = digits.base + jnp.sum(jnp.where(same, jnp.asarray(worth, jnp.int32), 0), axis=(0, 1), dtype=jnp.int32)
    return number, jnp.any(same[:, -1], axis=0)


def _see_cells(rule: Cells, mask: Bitmap) -> Seen:
    x, y = np.array(rule.x), np.array(rule.y)
    lanes = mask.shape[2]
    beside, above = rule.margin
    # The rows of every cell with a margin around it, moved so that the first column is the top bit of the first word.
    board = jnp.pad(mask, ((1, rule.w // 32 + 2), (above, above), (0, 0)))
    at = x + 32 - beside
    n_words = (rule.w + 2 * beside + 31) // 32
    word = (at >> 5)[None, :] + np.arange(n_words + 1)[:, None]
    rows = y[None, :] + np.arange(rule.h + 2 * above)[:, None]
    cells = board[word[None], rows[:, None]]  # [h, words, cells, B]
    shift = jnp.asarray(at & 31, U)[None, None, :, None]
    cells = (cells[:, :-1] << shift) | ((cells[:, 1:] >> 1) >> (31 - shift))

    def columns(start: int, stop: int) -> jax.Array:
        inside = np.zeros(32 * n_words, np.uint8)
        inside[start:stop] = 1
        return jnp.asarray(np.packbits(inside).view(">u4").astype(np.uint32))[:, None, None]

    inner = columns(beside, beside + rule.w)
    around = columns(0, rule.w + 2 * beside) & ~inner
    ends = (*cells[:above], *cells[above + rule.h :])
    cells = cells[above : above + rule.h]
    any_row = lax.reduce(cells, U(0), lax.bitwise_or, (0,))
    clear = jnp.all((any_row & around) == 0, axis=0)
    for row in ends:
        clear = clear & jnp.all((row & inner) == 0, axis=0)
    if rule.whole:
        every = lax.reduce(cells, U(0xFFFFFFFF), lax.bitwise_and, (0,))
        valid = clear & jnp.all((every & inner) == inner, axis=0)
        boxes = np.stack([x, y, np.full_like(x, rule.w), np.full_like(x, rule.h)])
        full = jnp.broadcast_to(jnp.asarray(boxes, jnp.int32)[..., None], (*boxes.shape, lanes))
        return Seen(full[0], full[1], full[2], full[3], valid)
    own = cells & inner[None]
    used = bm.any_of(jnp.moveaxis(own, 1, 0)) != 0  # [h, cells, B]
    index = jnp.arange(rule.h, dtype=jnp.int32)[:, None, None]
    top = jnp.min(jnp.where(used, index, rule.h), axis=0)
    bottom = jnp.max(jnp.where(used, index, -1), axis=0)
    first, last = bm.columns(any_row & inner)
    base_x, base_y = (jnp.asarray(v, jnp.int32)[:, None] for v in (x - beside, y))
    return Seen(first + base_x, top + base_y, last - first + 1, bottom - top + 1, clear & (bottom >= 0))


def _first_color(frames: jax.Array, mask: Bitmap, seen: Seen) -> jax.Array:
    """Palette index of the first pixel in each box's top row, int32 `[count, B]`."""
    lane = jnp.arange(seen.x.shape[1])[None]
    y = jnp.clip(seen.y, 0, mask.shape[1] - 1)
    column = jnp.full_like(seen.x, 0)
    for i, word in reversed(list(enumerate(mask))):
        start = jnp.clip(seen.x - 32 * i, 0, 32)
        w = word[y, lane] & jnp.where(start < 32, U(0xFFFFFFFF) >> jnp.minimum(start, 31).astype(U), U(0))
        column = jnp.where(w != 0, 32 * i + lax.clz(w).astype(jnp.int32), column)
    return frames[lane, y, column].astype(jnp.int32)


def see(categories: tuple[Category, ...], frames: jax.Array) -> list[tuple[Seen, jax.Array | None]]:
    """What each category's rule sees.

    Args:
        categories: of a game.
        frames: uint8 `[B, H, 160]` of palette indices.

    Returns:
        For each category its boxes, and their palette indices int32 `[count, B]` where the rule has several colours (else None).
    """
    planes = bm.planes(frames)

    @functools.cache
    def mask_of(colors: tuple[int, ...], keep: bool = True) -> Bitmap:
        def mask(*planes: jax.Array) -> jax.Array:
            return bm.color_mask(planes, colors)

        return bm.kept(mask, *planes) if keep else mask(*planes)

    out: dict[str, Seen] = {}

    def counted(rule: Rule, colors: tuple[int, ...]) -> Bitmap:
        """The pixels of the colours that count for a rule."""
        mask = mask_of(colors, not isinstance(rule, Blobs) or rule.join != (0, 0) or rule.thin > 0)
        if isinstance(rule, Cells):
            return mask
        if isinstance(rule, Bounds) and rule.inverse:
            mask = ~mask
        if rule.scenery:
            mask = mask & jnp.asarray(~_static(frames.shape[1], rule.scenery))
        for other in categories:
            if other.name in rule.besides:
                whole = (
                    _whole_cells(other.rule, mask_of(other.rule.palette))
                    if isinstance(other.rule, Cells)
                    else _painted(out[other.name], mask)
                )
                mask = mask & ~whole
        return _thin(mask, rule.thin) if isinstance(rule, Blobs) and rule.thin else mask

    blobs = [(c, c.rule) for c in categories if isinstance(c.rule, Blobs)]
    for connectivity in (4, 8):
        group = [(c, r) for c, r in blobs if r.connectivity == connectivity]
        if group:
            parts = [(c, r, colors) for c, r in group for colors in (_color_sets(c)[:-1] if r.apart else [r.palette])]
            regions = [r.region or (0, 0, frames.shape[2], frames.shape[1]) for _, r, _ in parts]
            cuts = [_cut(counted(r, colors), region) for (_, r, colors), region in zip(parts, regions, strict=True)]
            searches = [
                Search(-(-c.count // 2) if r.apart else c.count, r.join, r.min_size, r.max_size, r.split, r.pixels) for c, r, _ in parts
            ]
            lists: dict[str, list[Boxes]] = {}
            for (c, _, _), region, b in zip(parts, regions, components(cuts, searches, connectivity=connectivity), strict=True):
                lists.setdefault(c.name, []).append(b._replace(y=b.y + region[1]))
            for c, _ in group:
                b = _one_list(lists[c.name], c.count)
                unfit = b.total - jnp.sum(b.valid, axis=0, dtype=jnp.int32)
                out[c.name] = Seen(b.x, b.y, b.w, b.h, b.valid, unfit=unfit)
    for c in categories:
        if isinstance(c.rule, Bounds):
            out[c.name] = _see_bounds(c.rule, [counted(c.rule, colors) for _, colors in c.rule.parts])
        elif isinstance(c.rule, Cells):
            out[c.name] = _see_cells(c.rule, mask_of(c.rule.palette))
    found = []
    for c in categories:
        seen, first = out[c.name], c.rule.first if isinstance(c.rule, Blobs) else None
        color = _first_color(frames, counted(c.rule, c.rule.palette), seen) if c.mixed or first is not None else None
        if first is not None and color is not None:
            begins = jnp.zeros_like(seen.valid)
            for own in (first,) if isinstance(first, int) else first:
                begins = begins | (color == own)
            seen = seen._replace(valid=seen.valid & begins)
        found.append((seen, color if c.mixed else None))
    return found


def _one_list(lists: list[Boxes], count: int) -> Boxes:
    """Boxes of several searches in raster order of their corners, so many of them."""
    if len(lists) == 1:
        return lists[0]
    x, y, w, h, valid = (jnp.concatenate(v) for v in list(zip(*lists, strict=True))[:5])
    index = jnp.arange(len(x), dtype=jnp.int32)[:, None]
    place = jnp.where(valid, y * WIDTH + x, 2**16 - 1) * 2**15 + index  # one number each: sorting five took seven times as long
    index = lax.sort(place, dimension=0)[:count] % 2**15
    x, y, w, h = (jnp.take_along_axis(v, index, axis=0) for v in (x, y, w, h))
    return Boxes(x, y, w, h, w > 0, functools.reduce(jnp.add, (b.total for b in lists)))


def _color_sets(category: Category) -> list[tuple[int, ...]]:
    """The sets of colours whose masks a category needs."""
    if isinstance(category.rule, Blobs) and category.rule.apart:
        return [*((c,) for c in category.rule.palette), category.rule.palette]
    parts = [colors for _, colors in category.rule.parts] if isinstance(category.rule, Bounds) else []
    return parts if parts and not category.mixed else [*parts, category.rule.palette]
