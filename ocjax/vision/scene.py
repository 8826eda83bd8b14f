"""`Scene`: a batch of frames, with the colour masks and objects found so far.

Masks are bitmaps (`ocjax.vision.bitmap`): uint32 `[5, rows, B]`.
"""

import functools
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from ocjax._xla import kernels
from ocjax.console.boxes import WIDTH, Area
from ocjax.console.ops import pick
from ocjax.vision import bitmap as bm
from ocjax.vision.bitmap import Bitmap, U
from ocjax.vision.cells import cell_pixels
from ocjax.vision.detected import Detected
from ocjax.vision.filters import Searched
from ocjax.vision.rules import Blobs, Bounds, Cells, Rule, Runs
from ocjax.vision.shades import Shades, level_of
from ocjax.vision.steps import Context, Step

# Regions. At most this many with the same colours compute their own rows of the mask. Row `unshared
# masks` of benchmarks/tricks.py.
MAX_UNSHARED_REGIONS = 2
# Colours for which the first mask is materialized, because XLA does not vectorise the loop that
# computes it and writes the board. Row `first mask` of benchmarks/tricks.py.
MIN_MATERIALIZED_COLORS = 10


class Scene:
    """A batch of frames, and the results of its categories' rules so far.

    Args:
        rules: of each category, by its name.
        frames: uint8 `[B, H, 160]` of palette indices.
        shades: the rules' colours that change from level to level.

    Attributes:
        found: the objects of searched categories.
        height: rows of the masks, down to the last that a rule reads.
    """

    def __init__(self, rules: Mapping[str, Rule], frames: jax.Array, shades: Shades | None) -> None:
        self.rules = rules
        self.frames = frames
        self.height = _rows_looked_at(rules.values(), frames.shape[1])
        self.shades = shades
        self.found: dict[str, Detected] = {}
        self._shade_bits = (
            None
            if shades is None
            else kernels.materialize(functools.partial(_shade_bits, shades), frames)
        )
        self._bounds = Counter(
            colors
            for rule in rules.values()
            if isinstance(rule, Bounds)
            for part in rule.parts
            for _, colors in part.slots
        )
        self._planes = bm.planes(frames[:, : self.height])
        self._masks: dict[tuple[int, ...], Bitmap] = {}
        self._searches: dict[Callable[[jax.Array], Any], Any] = {}
        self._counted: dict[Any, Bitmap] = {}
        self._cuts: dict[Any, Bitmap] = {}

    def mask(self, colors: tuple[int, ...], *, materialize: bool = True) -> Bitmap:
        """Return the pixels that have one of the colours."""
        if colors not in self._masks:
            if not materialize:
                return self._mask(self._planes, colors)
            self._masks[colors] = kernels.materialize(
                lambda planes: self._mask(planes, colors), self._planes
            )
        return self._masks[colors]

    def shifts(self, colors: tuple[int, ...]) -> bool:
        """Return whether one of the colours changes from level to level."""
        return self.shades is not None and not set(self.shades.levels[0]).isdisjoint(colors)

    def counted(self, rule: Bounds | Blobs, colors: tuple[int, ...]) -> Bitmap:
        """Return the pixels of the colours that a rule selects."""
        key = _counts_alike(rule, colors)
        if key not in self._counted:
            self._counted[key] = self._count(rule, colors)
        return self._counted[key]

    def cut(self, rule: Blobs) -> Bitmap:
        """Return the pixels that a rule selects, in the rows of its region."""
        key = _counts_alike(rule, rule.own_palette), self.region(rule)
        if key not in self._cuts:
            pixels = bm.cut(self.counted(rule, rule.own_palette), self.region(rule))
            is_slow = not self._cuts and len(rule.own_palette) >= MIN_MATERIALIZED_COLORS
            self._cuts[key] = (
                kernels.materialize(lambda pixels: pixels, pixels) if is_slow else pixels
            )
        return self._cuts[key]

    def cell_mask(self, rule: Cells, colors: tuple[int, ...]) -> Bitmap:
        """Return the pixels of some colours outside of the objects that cells exclude."""
        mask = self.mask(colors)
        return mask & ~self._inside(rule.exclude) if rule.exclude else mask

    def region(self, rule: Blobs) -> Area:
        """Return the region that a rule searches."""
        return rule.region or (0, 0, WIDTH, self.height)

    def after(self, steps: tuple[Step, ...], found: Detected, rule: Rule, count: int) -> Detected:
        """Apply steps to the objects of a rule, in `count` slots."""

        def pixels() -> Bitmap:
            return self.cut(rule) if isinstance(rule, Blobs) else self.mask(rule.palette)

        top = self.region(rule)[1] if isinstance(rule, Blobs) else 0
        context = Context(pixels, top, self.found, count)
        for step in steps:
            found = step(found, context)
        return found

    def _mask(self, planes: jax.Array, colors: tuple[int, ...]) -> Bitmap:
        first = () if self.shades is None else self.shades.levels[0]
        mask = bm.color_mask(planes, [c for c in colors if c not in first])
        for c in colors:
            if self._shade_bits is not None and c in first:
                mask = mask | bm.shade_mask(planes, self._shade_bits[first.index(c)])
        return mask

    def _inside(self, names: tuple[str, ...]) -> Bitmap:
        found = Detected(jnp.concatenate([self.found[name].box for name in names]))
        return bm.boxes(found.x, found.y, found.w, found.h, found.valid, self.height)

    def _count(self, rule: Bounds | Blobs, colors: tuple[int, ...]) -> Bitmap:
        read_once = _is_whole(rule) or self._read_once(rule, colors)
        mask = self.mask(colors, materialize=not read_once)
        if isinstance(rule, Bounds) and rule.inverse:
            mask = ~mask
        if rule.ignore:
            mask = mask & jnp.asarray(~bm.areas(self.height, rule.ignore))
        for cells in (self.rules[name] for name in rule.exclude):
            if isinstance(cells, Cells):
                mask = mask & ~cell_pixels(cells, self.mask(cells.palette))
        if blobs := tuple(name for name in rule.exclude if not isinstance(self.rules[name], Cells)):
            mask = mask & ~self._inside(blobs)
        for only in rule.filters:
            mask = (
                only.pixels(mask, self.search(only.search))
                if isinstance(only, Searched)
                else only(mask, self._planes)
            )
        return mask

    def search(self, search: Callable[[jax.Array], Any]) -> Any:
        """Return the result of a filter's search; each search is done once."""
        if search not in self._searches:
            self._searches[search] = search(self._planes)
        return self._searches[search]

    def _read_once(self, rule: Bounds | Blobs, colors: tuple[int, ...]) -> bool:
        if isinstance(rule, Blobs):
            return rule.gap == (0, 0) and not rule.filters
        # Colours are read at single pixels, which would compute an unmaterialized mask again.
        reads_color = len(colors) > 1
        return (
            self._bounds[colors] <= MAX_UNSHARED_REGIONS
            and not rule.filters
            and not (rule.digits and reads_color)
        )


def _rows_looked_at(rules: Iterable[Rule | None], height: int) -> int:
    """Rows down to the last one that a rule reads: nine tenths of the screen in most games."""
    return min(max((_end(rule, height) for rule in rules if rule is not None), default=1), height)


def _end(rule: Rule, height: int) -> int:
    if isinstance(rule, Cells):
        return height if rule.floats else rule.bottom + rule.margin[1]
    if isinstance(rule, Runs):
        return rule.bottom
    parts = rule.parts if isinstance(rule, Bounds) else rule.rules
    searches = isinstance(rule, Blobs) and any(
        own.region is None or own.frames is not None for own in rule.rules
    )
    filters = [only for part in parts for only in part.filters]
    ends = [getattr(only, "rows", (0, height))[1] for only in filters]
    return max(rule.bottom, *ends, height if searches else 0)


def _is_whole(rule: Bounds | Blobs) -> bool:
    """Return whether the first filter selects pixels regardless of colour."""
    first = rule.filters[0] if rule.filters else None
    return isinstance(first, Searched) and first.whole and not rule.ignore and not rule.exclude


def _counts_alike(rule: Bounds | Blobs, colors: tuple[int, ...]) -> tuple[Any, ...]:
    """A key that is equal for rules that select the same pixels."""
    inverse = isinstance(rule, Bounds) and rule.inverse
    return () if _is_whole(rule) else colors, inverse, rule.ignore, rule.exclude, rule.filters


def _shade_bits(shades: Shades, frames: jax.Array) -> jax.Array:
    """The bits of the colours at each frame's level, uint32 `[colours, 8, B]`, lowest first.

    A word is all ones or zero.
    """
    level = level_of(shades, frames)
    colors = jnp.stack([pick(level, of_levels) for of_levels in zip(*shades.levels, strict=True)])
    return (-(colors[:, None] >> np.arange(8)[None, :, None] & 1)).astype(U)
