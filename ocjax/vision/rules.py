"""Rules with which VEM finds the objects of a category and reads their values.

Colours are ALE palette indices, one or several.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.console.boxes import WIDTH, Area, check_area
from ocjax.console.fonts import Digits
from ocjax.vision.colors import Colors, color_set
from ocjax.vision.filters import Filter
from ocjax.vision.pictures import Picture, check_pictures
from ocjax.vision.shapes import ANY_SHAPE, Shape, Span, check_number, limits
from ocjax.vision.steps import Step
from ocjax.vision.unknown import UNKNOWN_VALUE

__all__ = ["Blobs", "Bounds", "ByColor", "Cells", "Gauge", "Rule", "Run", "Runs"]


@dataclass(frozen=True)
class Gauge:
    """A value from the length of a bar or a row of icons, or from the position of a needle.

    The value is `base + worth * ((length - start) // unit)`.

    Args:
        unit: pixels per step; negative if the value falls as the length grows.
        start: length in pixels at the value `base`.
        base: value at that length.
        side: the number of the box that is the length: "x", "y", "w" or "h".
        full: length of a full display that may hide larger values: the value is then unknown.
        worth: value of one step.
        of: a rule for a single box that is measured instead of the object's own, such as the
            filling of a bar. The length is 0 if this rule finds nothing.
    """

    unit: int
    start: int = 0
    base: int = 0
    side: str = "w"
    full: int | None = None
    worth: int = 1
    of: "Bounds | None" = None

    def __post_init__(self) -> None:
        if self.unit == 0:
            raise ValueError("a gauge's unit must be a number of pixels, got 0")
        if self.side not in ("x", "y", "w", "h"):
            raise ValueError(f"a gauge's side must be x, y, w or h, got {self.side!r}")
        if self.of is not None and (len(self.of.slots) > 1 or self.of.value is not None):
            raise ValueError("the rule that a gauge measures must have a single box and no value")


@dataclass(frozen=True)
class ByColor:
    """A value from an object's colour; unknown for other colours.

    Args:
        values: pairs of a palette index and its value.
    """

    values: tuple[tuple[int, int], ...]

    def __call__(self, color: jax.Array, _: jax.Array) -> jax.Array:
        """Return values, int32 `[count, B]`."""
        out = jnp.full_like(color, UNKNOWN_VALUE)
        for own, value in self.values:
            out = jnp.where(color == own, value, out)
        return out


@dataclass(frozen=True)
class Bounds:
    """One object per region: the tight box of all its pixels that have the colours.

    Slot i belongs to region i.

    Args:
        colors: for all regions, or a tuple with one entry per region.
        regions: one region, or several.
        min_size: minimum (width, height) of a valid object, or one for each region.
        max_size: maximum (width, height); None: no maximum.
        value: how to read the value: a `Gauge`, or `Digits` (one for each region if the rule has
            several). None: the value is 0.
        inverse: whether `colors` are the background's, and all other pixels are selected.
        filters: applied in order to the pixels (`ocjax.vision.filters`).
        ignore: areas of the screen to ignore.
        exclude: categories of `Blobs` or whole `Cells`; pixels inside their objects' boxes are
            ignored.
        then: steps after the boxes are found (`ocjax.vision.steps`).
    """

    colors: Colors | tuple[Colors, ...]
    regions: Area | tuple[Area, ...]
    min_size: tuple[int, int] | tuple[tuple[int, int], ...] = (1, 1)
    max_size: tuple[int, int] | None = None
    value: Gauge | Digits | tuple[Digits, ...] | None = None
    inverse: bool = False
    filters: tuple[Filter, ...] = ()
    ignore: tuple[Area, ...] = ()
    exclude: tuple[str, ...] = ()
    then: tuple[Step, ...] = ()

    def __post_init__(self) -> None:
        if self.value is not None and not _keep_slots(self.then):
            raise ValueError(
                f"a value needs one object per region, but objects leave their slots in {self.then}"
            )
        for area in (*(region for region, _ in self.slots), *self.ignore):
            check_area(area)
        if self.digits and len(self.digits) != len(self.slots):
            raise ValueError(
                f"digits for {len(self.digits)} regions, but {len(self.slots)} regions"
            )
        if (sizes := len(np.atleast_2d(self.min_size))) not in (1, len(self.slots)):
            raise ValueError(f"min_size for {sizes} regions, but {len(self.slots)} regions")

    @property
    def slot_count(self) -> int | None:
        """The number of slots, one for each region; None: any."""
        return len(self.slots) if _keep_slots(self.then) else None

    @property
    def digits(self) -> tuple[Digits, ...]:
        """The digits of each region; empty without digits."""
        if isinstance(self.value, tuple):
            return self.value
        return (self.value,) if isinstance(self.value, Digits) else ()

    @property
    def parts(self) -> "tuple[Bounds, ...]":
        """This rule, and the rule that its gauge measures."""
        measured = self.value.of if isinstance(self.value, Gauge) else None
        return (self,) if measured is None else (self, measured)

    @property
    def slots(self) -> tuple[tuple[Area, tuple[int, ...]], ...]:
        """Region and colours of each slot."""
        regions: Any = self.regions if isinstance(self.regions[0], tuple) else (self.regions,)
        several = isinstance(self.colors, tuple) and any(isinstance(c, tuple) for c in self.colors)
        colors: Any = self.colors if several else (self.colors,) * len(regions)
        if len(colors) != len(regions):
            raise ValueError(f"colors for {len(colors)} regions, but {len(regions)} regions")
        return tuple((r, color_set(c)) for r, c in zip(regions, colors, strict=True))

    @property
    def palette(self) -> tuple[int, ...]:
        """All colours."""
        return tuple(sorted({c for _, colors in self.slots for c in colors}))

    @property
    def bottom(self) -> int:
        """The row below all pixels that the rule reads."""
        return max(
            *(region[3] for part in self.parts for region, _ in part.slots),
            *(d.bottom for d in self.digits),
            0,
        )

    def check(self, rules: "Mapping[str, Rule]") -> None:
        """Check the names of other categories, given all rules; raises ValueError."""
        for name in self.exclude:
            if not isinstance(rules.get(name), Blobs) and not _is_whole_cells(rules.get(name)):
                raise ValueError(f"exclude: {name!r} is not a category of Blobs or whole Cells")


@dataclass(frozen=True)
class Blobs:
    """Connected components of the pixels with the colours, in raster order of their first pixels.

    Args:
        colors: palette indices; pixels of different colours of the rule connect.
        region: area of the screen to search; pixels outside are ignored.
        shapes: possible shapes of objects. The first shape that fits a component applies; a
            component that fits none is dropped.
        connectivity: 8 (pixels that touch at a corner connect) or 4.
        gap: parts at most (dx, dy) blank pixels apart are one object; needs connectivity 8.
        pictures: pictures of objects that touch or overlap, larger ones first
            (`ocjax.vision.pictures`). A component larger than all of them is split if one fits at
            its first pixel: all pixels of the picture are in the component or beyond the region.
            The picture and the remaining pixels get tight boxes. If no picture fits, `Shape.split`
            applies. Pictures need a shape that is limited to 16 columns and their height, or more,
            and no `gap`.
        first: colours that the object's first pixel must have, to separate objects that share
            colours.
        filters: applied in order to the pixels (`ocjax.vision.filters`).
        ignore: areas of the screen to ignore.
        exclude: categories of whole `Cells`; pixels of their objects are ignored.
        then: steps after the boxes are found (`ocjax.vision.steps`).
        also: further rules, without steps, whose objects also belong to the category. Their
            colours, region or filters must select other pixels.
        frames: a search, as in filters, for the frames in which the rule applies, bool `[B]`. Rules
            of different screens that read the same pixels are searched together.
    """

    colors: Colors
    region: Area | None = None
    shapes: Shape | tuple[Shape, ...] = ANY_SHAPE
    connectivity: int = 8
    gap: tuple[int, int] = (0, 0)
    pictures: tuple[Picture, ...] = ()
    first: Colors | None = None
    filters: tuple[Filter, ...] = ()
    ignore: tuple[Area, ...] = ()
    exclude: tuple[str, ...] = ()
    then: tuple[Step, ...] = ()
    also: "tuple[Blobs, ...]" = ()
    frames: Callable[[jax.Array], jax.Array] | None = None

    @property
    def rules(self) -> "tuple[Blobs, ...]":
        """This rule and the rules of `also`."""
        return (self, *self.also)

    @property
    def all_shapes(self) -> tuple[Shape, ...]:
        """The possible shapes of an object."""
        return (self.shapes,) if isinstance(self.shapes, Shape) else self.shapes

    @property
    def palette(self) -> tuple[int, ...]:
        """All colours of `rules`."""
        return tuple(dict.fromkeys(color for rule in self.rules for color in rule.own_palette))

    @property
    def own_palette(self) -> tuple[int, ...]:
        """The colours of this rule alone."""
        return color_set(self.colors)

    @property
    def first_colors(self) -> tuple[int, ...]:
        """Colours that the first pixel must have; empty: any."""
        return () if self.first is None else color_set(self.first)

    slot_count: ClassVar[None] = None  # any number of slots

    @property
    def bottom(self) -> int:
        """The row below all pixels that the rule reads; 0 if it reads the whole screen."""
        return max(rule.region[3] if rule.region else 0 for rule in self.rules)

    def __post_init__(self) -> None:
        color_set(self.colors)
        for area in (*self.ignore, *((self.region,) if self.region else ())):
            check_area(area)
        if self.connectivity not in (4, 8):
            raise ValueError(f"connectivity must be 4 or 8, got {self.connectivity}")
        if self.gap != (0, 0) and self.connectivity == 4:
            raise ValueError("gap needs connectivity 8")
        for side in self.gap:
            check_number("gap", side, 0, 31)
        if not set(self.first_colors) <= set(self.palette):
            raise ValueError(f"first must be among the colors {self.palette}, got {self.first}")
        if not self.all_shapes:
            raise ValueError("shapes must hold at least one shape")
        check_pictures(self.pictures, [shape.max_size for shape in self.all_shapes], self.gap)
        if any(rule.also or rule.then for rule in self.also):
            raise ValueError("a rule in also must have no also and no steps")

    def check(self, rules: "Mapping[str, Rule]") -> None:
        """Check the names of other categories, given all rules; raises ValueError."""
        for name in (name for rule in self.rules for name in rule.exclude):
            if not _is_whole_cells(rules.get(name)):
                raise ValueError(f"exclude: {name!r} is not a category of whole Cells")
        for step in self.then:
            other = None if step.other is None else rules.get(step.other)
            if step.other is not None and (not isinstance(other, Blobs) or other is self):
                raise ValueError(f"{step}: {step.other!r} is not another category of Blobs")


@dataclass(frozen=True)
class Cells:
    """Objects on a fixed grid, one slot per cell.

    Args:
        colors: palette indices.
        x, y: left and top of each cell, one entry per slot.
        w, h: size of every cell.
        whole: whether every pixel of the cell must have the colours. Otherwise any pixel is enough,
            and the box fits tightly around the matching pixels.
        margin: (columns, rows) beside, and above and below, the cell that must be free of the
            colours. This separates a pellet from a wall.
        exclude: categories of `Blobs`; pixels inside their objects' boxes are ignored, except by
            rules that exclude these cells.
        floats: for a grid that moves up and down as a whole: the colours of the grid or of an
            object that moves with it, and the row below their last pixel in the cells' columns
            while the grid is at its own position. Slots have no fixed positions, because the last
            cells may be gone.
    """

    colors: Colors
    x: tuple[int, ...]
    y: tuple[int, ...]
    w: int
    h: int
    whole: bool = True
    margin: tuple[int, int] = (0, 0)
    exclude: tuple[str, ...] = ()
    floats: tuple[Colors, int] | None = None

    @property
    def palette(self) -> tuple[int, ...]:
        """All colours."""
        return color_set(self.colors)

    @property
    def slot_count(self) -> int:
        """The number of slots, one for each cell."""
        return len(self.x)

    @property
    def bottom(self) -> int:
        """The row below the last cell."""
        return max(self.y) + self.h

    def __post_init__(self) -> None:
        color_set(self.colors)
        if len(self.x) != len(self.y) or not self.x:
            raise ValueError(
                f"x and y need one entry per slot, got {len(self.x)} and {len(self.y)}"
            )
        if not (
            min(self.x) >= 0
            and max(self.x) + self.w <= WIDTH
            and min(self.y) >= 0
            and self.w > 0
            and self.h > 0
        ):
            raise ValueError("every cell must lie on the screen")
        if self.floats is not None:
            color_set(self.floats[0])

    def check(self, rules: "Mapping[str, Rule]") -> None:
        """Check the names of other categories, given all rules; raises ValueError."""
        for name in self.exclude:
            if not isinstance(rules.get(name), Blobs):
                raise ValueError(f"exclude: {name!r} is not a category of Blobs")


@dataclass(frozen=True)
class Run:
    """A wall or floor of known height, found by a run of pixels in one row of the screen.

    Args:
        colors: palette indices; pixels of different colours form one run.
        row: row of the screen.
        left: first column of the run: a number, or (minimum, maximum).
        width: width of the run in pixels, given in the same way.
        height: rows of the object's box from `row` down.
        before, above, after: columns on the left, rows above and columns on the right that the box
            has in addition, for objects of known shape that the row crosses at their tip.
    """

    colors: Colors
    row: int
    left: Span
    width: Span
    height: int
    before: int = 0
    above: int = 0
    after: int = 0

    @property
    def palette(self) -> tuple[int, ...]:
        """All colours."""
        return color_set(self.colors)

    @property
    def bottom(self) -> int:
        """The row below its box."""
        return self.row + self.height

    def __post_init__(self) -> None:
        color_set(self.colors)
        for name in ("left", "width"):
            least, most = limits(getattr(self, name))
            if not 0 <= least <= most:
                raise ValueError(
                    f"{name} must be a number of pixels or (least, most), got {getattr(self, name)}"
                )
        check_area((limits(self.left)[0], self.row, limits(self.left)[0] + 1, self.bottom))
        if self.above > self.row or limits(self.width)[0] + self.before + self.after < 1:
            margins = f"before={self.before}, above={self.above}, after={self.after}"
            raise ValueError(
                f"{margins} must leave boxes on the screen, for row {self.row} and width "
                f"{self.width}"
            )


@dataclass(frozen=True)
class Runs:
    """Walls and floors of known height, found by horizontal runs of pixels in one row each.

    A run of pixels belongs to the first `Run` with its row and colours that allows its position and
    width. Each row has `most` slots, from the left, unless a step moves the objects.

    Args:
        runs: from the top row down.
        most: maximum number of runs of pixels in each row.
        gap: pieces at most this many blank pixels apart are one run, such as a floor behind a
            sprite.
        columns: left and right edge of the searched columns.
        then: steps after the boxes are found (`ocjax.vision.steps`).
    """

    runs: tuple[Run, ...]
    most: int
    gap: int = 0
    columns: tuple[int, int] = (0, WIDTH)
    then: tuple[Step, ...] = ()

    @property
    def palette(self) -> tuple[int, ...]:
        """All colours."""
        return tuple(sorted({c for run in self.runs for c in run.palette}))

    @property
    def rows(self) -> tuple[tuple[int, tuple[int, ...]], ...]:
        """Each searched row, with its colours."""
        return tuple(dict.fromkeys((run.row, run.palette) for run in self.runs))

    @property
    def slots(self) -> int:
        """Slots of all rows."""
        return self.most * len(self.rows)

    @property
    def slot_count(self) -> int | None:
        """The number of slots; None: any."""
        return self.slots if _keep_slots(self.then) else None

    @property
    def bottom(self) -> int:
        """The row below the last row of its boxes."""
        return max(run.bottom for run in self.runs)

    def __post_init__(self) -> None:
        if not self.runs or self.most < 1:
            raise ValueError(
                f"at least one run is needed, and most must be at least 1, got {len(self.runs)} "
                f"and {self.most}"
            )
        check_number("gap", self.gap, 0, 31)
        check_area((self.columns[0], 0, self.columns[1], 1))

    def check(self, rules: "Mapping[str, Rule]") -> None:
        """Nothing to check: the rule names no other category."""


Rule = Bounds | Blobs | Cells | Runs


def _keep_slots(steps: tuple[Step, ...]) -> bool:
    return all(step.keeps_slots for step in steps)


def _is_whole_cells(rule: Rule | None) -> bool:
    return isinstance(rule, Cells) and rule.whole and not rule.floats
