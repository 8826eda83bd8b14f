"""Declarations of a game's categories: names, slots, and the rules by which VEM finds their objects.

Colours are ALE palette indices (0-255), one or several. Where a rule has several regions, colours may be given for each region.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from ocjax.console.boxes import WIDTH, Area
from ocjax.console.fonts import Digits
from ocjax.vision.pictures import Picture, check_pictures

Colors = int | tuple[int, ...]


def _color_set(colors: Colors) -> tuple[int, ...]:
    out = (colors,) if isinstance(colors, int) else colors
    if not out or not all(isinstance(c, int) and 0 <= c < 256 for c in out):
        raise ValueError(f"colors must be one or several palette indices 0-255, got {colors!r}")
    return out


def _check_area(area: Area) -> None:
    left, top, right, bottom = area
    if not (0 <= left < right <= WIDTH and 0 <= top < bottom):
        raise ValueError(f"a region is (left, top, right, bottom) with 0 <= left < right <= {WIDTH} and 0 <= top < bottom, got {area}")


@dataclass(frozen=True)
class Gauge:
    """How VEM reads a value from the length of a bar or a row of icons, or from a needle's place.

    It is `base + worth * ((length - start) // unit)`.

    Args:
        unit: pixels of a step; negative where the value falls as the length grows.
        start: length in pixels that stands for `base`.
        base: value at that length.
        side: which number of the box is the length: "x", "y", "w" or "h".
        full: length at which the display is full, if that hides larger values. The value is then unknown.
        worth: what a step adds to the value.
        of: a rule for a single box that is measured instead of the object's own, such as that of what fills a bar, or of a row of icons
            each of which is an object. Where it finds nothing, the length is 0.
    """

    unit: int
    start: int = 0
    base: int = 0
    side: str = "w"
    full: int | None = None
    worth: int = 1
    of: Bounds | None = None

    def __post_init__(self) -> None:
        if self.unit == 0:
            raise ValueError("a gauge's unit must be a number of pixels, got 0")
        if self.side not in ("x", "y", "w", "h"):
            raise ValueError(f"a gauge's side must be x, y, w or h, got {self.side!r}")
        if self.of is not None and (len(self.of.slots) > 1 or self.of.value is not None):
            raise ValueError("a gauge measures a single box, without a value of its own")


@dataclass(frozen=True)
class ByColor:
    """How VEM reads a value from an object's colour. A value that no colour tells is unknown.

    Args:
        values: pairs of a palette index and the value that it stands for.
        like: instead of `values`, an area of the screen that shows one colour on black. The value is 1 where the object has that colour,
            and 0 where it has another one; where the area is black, it is unknown.
    """

    values: tuple[tuple[int, int], ...] = ()
    like: Area | None = None

    def __post_init__(self) -> None:
        if bool(self.values) == (self.like is not None):
            raise ValueError(f"a value is read by either values or like, got {self.values} and {self.like}")
        if self.like is not None:
            _check_area(self.like)


@dataclass(frozen=True)
class Bounds:
    """One object per region: the tight box of all pixels there that have the colours. Slot i belongs to region i.

    Args:
        colors: for all regions, or a tuple with one entry per region.
        regions: one region, or several.
        min_size: minimum (width, height) of an object, or one for each region; smaller boxes are not valid.
        max_size: maximum (width, height) of every object, if there is one; larger boxes are not valid.
        value: how the value is read: a `Gauge`, or `Digits` (one for each region where there are several). The value is 0 without it.
        inverse: the colours are the background's; pixels of all other colours count.
        ignore: areas of the screen whose pixels do not count.
        exclude: categories of `Blobs` or whole `Cells`; pixels inside their objects' boxes do not count.
        each: if not 0, the width of one object. The objects of a region stand side by side without gaps, and its box is cut into them. The
            slots are then in the order of the regions, and each region from the left.
    """

    colors: Colors | tuple[Colors, ...]
    regions: Area | tuple[Area, ...]
    min_size: tuple[int, int] | tuple[tuple[int, int], ...] = (1, 1)
    max_size: tuple[int, int] | None = None
    value: Gauge | Digits | tuple[Digits, ...] | None = None
    inverse: bool = False
    ignore: tuple[Area, ...] = ()
    exclude: tuple[str, ...] = ()
    each: int = 0

    def __post_init__(self) -> None:
        if self.each < 0 or (self.each and self.value is not None):
            raise ValueError(f"each must be a number of pixels, without a value to read, got {self.each}")
        for area in (*(region for region, _ in self.slots), *self.ignore):
            _check_area(area)
        if self.digits and len(self.digits) != len(self.slots):
            raise ValueError(f"digits for {len(self.digits)} regions, but {len(self.slots)} regions")
        if (sizes := len(np.atleast_2d(self.min_size))) not in (1, len(self.slots)):
            raise ValueError(f"min_size for {sizes} regions, but {len(self.slots)} regions")

    @property
    def digits(self) -> tuple[Digits, ...]:
        """The digits of each region, if any."""
        return self.value if isinstance(self.value, tuple) else (self.value,) if isinstance(self.value, Digits) else ()

    @property
    def parts(self) -> tuple[Bounds, ...]:
        """This rule and the one that its gauge measures."""
        return (self, self.value.of) if isinstance(self.value, Gauge) and self.value.of is not None else (self,)

    @property
    def slots(self) -> tuple[tuple[Area, tuple[int, ...]], ...]:
        """Region and colours of each slot."""
        regions: Any = self.regions if isinstance(self.regions[0], tuple) else (self.regions,)
        several = isinstance(self.colors, tuple) and any(isinstance(c, tuple) for c in self.colors)
        colors: Any = self.colors if several else (self.colors,) * len(regions)
        if len(colors) != len(regions):
            raise ValueError(f"colors for {len(colors)} regions, but {len(regions)} regions")
        return tuple((r, _color_set(c)) for r, c in zip(regions, colors, strict=True))

    @property
    def palette(self) -> tuple[int, ...]:
        """All colours."""
        return tuple(sorted({c for _, colors in self.slots for c in colors}))

    @property
    def bottom(self) -> int:
        """The row below everything that the rule looks at."""
        return max(*(region[3] for part in self.parts for region, _ in part.slots), *(d.bottom for d in self.digits), 0)


@dataclass(frozen=True)
class Blobs:
    """Connected components of the pixels that have the colours, in raster order of their first pixels.

    Args:
        colors: palette indices; pixels of different colours of the rule connect.
        region: where to look; pixels outside do not count.
        connectivity: 8 (pixels whose corners touch are connected) or 4.
        gap: parts that are at most (dx, dy) blank pixels apart are one object; needs connectivity 8.
        min_size, max_size: (width, height) limits; components outside them are not objects.
        split: (width, height) of one object, for objects that touch. A larger component is split into as many objects as cover it (4 at
            most), evenly spaced from edge to edge. `max_size` then limits the whole component.
        pictures: of the objects, for those that touch or overlap, larger ones first (`ocjax.vision.pictures`). A component larger than
            all of them is split where one fits at its first pixel: all its pixels are in the component or beyond the region. Its box and
            that of what is left are tight. Where none fits, `split` applies. Pictures also count for rules of `also` that look at the
            same pixels. They need a `max_size` of at least 16 columns and their height, and no `gap`.
        tight: whether boxes fit tightly around the pixels in them, also those of the objects of a component that is split.
        area: minimum and maximum number of pixels of a component, including those that `gap` bridges from the left and from above. This
            tells pictures of the same size apart. Needs `max_size`.
        first: colours that the object's first pixel (in raster order) must have. This tells apart objects that share some of their colours.
        split_by_color: components of different colours are different objects even where they touch; each colour fills at most half the
            slots.
        max_run: if not 0, pixels of vertical runs longer than this do not count. This finds low objects in the colour of walls.
        max_across: if not 0, pixels of horizontal runs longer than this do not count. This finds upright objects in the colour of figures.
        max_line: if not 0, pixels of lines that are one pixel wide and lead down over more rows than this, upright or slanting, do not
            count. This finds objects that hang on lines of their colour.
        min_line: if not 0, only pixels of lines of a single colour that lead down over at least so many rows, upright or by a column a
            row, count. This finds thin shots before figures whose rows have different colours.
        pairs: if not 0, two pixels of a row with so many blank pixels between them, and no third one as far from them, do not count. This
            finds a beam that touches one of two dots in a face.
        ignore: areas of the screen whose pixels do not count.
        exclude: categories of whole `Cells`; pixels of their objects do not count.
        also: another rule of the same colours, or of some of them; what it finds belongs to the category, too. This is for objects that
            have two shapes, such as a shot that flies upright or across, or that only some colours tell apart in a part of the screen.
        above: another category of `Blobs`. A box ends above the objects of that category that begin inside it, such as a driver's above
            the car of which he has a colour, and fits tightly around the pixels that are left. The limits of sizes count for the whole box.
        headroom: rows above the component that belong to its box, too, such as those of a head whose colour the other team's heads have.
    """

    colors: Colors
    region: Area | None = None
    connectivity: int = 8
    gap: tuple[int, int] = (0, 0)
    min_size: tuple[int, int] = (1, 1)
    max_size: tuple[int, int] | None = None
    split: tuple[int, int] | None = None
    pictures: tuple[Picture, ...] = ()
    tight: bool = False
    area: tuple[int, int] | None = None
    first: Colors | None = None
    split_by_color: bool = False
    max_run: int = 0
    max_across: int = 0
    max_line: int = 0
    min_line: int = 0
    pairs: int = 0
    ignore: tuple[Area, ...] = ()
    exclude: tuple[str, ...] = ()
    also: Blobs | None = None
    above: str | None = None
    headroom: int = 0

    @property
    def rules(self) -> tuple[Blobs, ...]:
        """This rule and the one that is `also` for the category."""
        return (self,) if self.also is None else (self, *self.also.rules)

    @property
    def palette(self) -> tuple[int, ...]:
        """All colours."""
        return _color_set(self.colors)

    @property
    def first_colors(self) -> tuple[int, ...]:
        """Colours that the first pixel must have; empty where any will do."""
        return () if self.first is None else _color_set(self.first)

    @property
    def limits(self) -> dict[str, int]:
        """The limits by which pixels count or do not, in the order in which they apply; 0 where there is none."""
        return {"max_run": self.max_run, "max_across": self.max_across, "max_line": self.max_line, "pairs": self.pairs}

    @property
    def bottom(self) -> int:
        """The row below everything that the rule looks at; 0 where it looks at the whole screen."""
        return max(rule.region[3] if rule.region else 0 for rule in self.rules)

    def __post_init__(self) -> None:
        _color_set(self.colors)
        for area in (*self.ignore, *((self.region,) if self.region else ())):
            _check_area(area)
        if self.connectivity not in (4, 8):
            raise ValueError(f"connectivity must be 4 or 8, got {self.connectivity}")
        if self.gap != (0, 0) and self.connectivity == 4:
            raise ValueError("gap needs connectivity 8")
        if self.area is not None and self.max_size is None:
            raise ValueError("area needs max_size")
        if not set(self.first_colors) <= set(self.palette):
            raise ValueError(f"first must be among the colors {self.palette}, got {self.first}")
        if self.headroom < 0:
            raise ValueError(f"headroom must be a number of rows, got {self.headroom}")
        if min(self.limits.values()) < 0 or max(self.max_across, self.pairs) > 30:
            raise ValueError(f"max_run and max_line must be numbers of pixels, and max_across and pairs up to 30, got {self.limits}")
        if self.min_line == 1 or not 0 <= self.min_line < 32:
            raise ValueError(f"min_line must be 0, or 2 to 31 rows, got {self.min_line}")
        check_pictures(self.pictures, self.max_size, self.gap)
        if self.split is not None and min(self.split) < 1:
            raise ValueError(f"split must be (width, height) of at least 1 pixel, got {self.split}")
        if self.also is not None and not set(self.also.palette) <= set(self.palette):
            raise ValueError("also must have no other colors")
        if not all(0 <= g < 32 for g in self.gap):
            raise ValueError(f"gap must be (dx, dy) of 0 to 31 pixels, got {self.gap}")


@dataclass(frozen=True)
class Cells:
    """Objects on a fixed grid, one slot per cell: present where all (or any) of the cell's pixels have the colours.

    Args:
        colors: palette indices.
        x, y: left and top of each cell, one entry per slot.
        w, h: size of every cell.
        whole: whether all pixels of the cell must have the colours. Otherwise any pixel is enough, and the box fits tightly around those
            that have them.
        margin: (columns, rows) beside, and above and below, the cell that must be free of the colours. This tells a pellet from a wall.
        exclude: categories of `Blobs`; pixels inside their objects' boxes do not count, except for rules that exclude these cells.
        floats: whether the grid moves up and down as a whole. The last row that has pixels of the colours in the cells' columns is then the
            last row of the grid. Slots stand for no places, because the last cells may be gone.
    """

    colors: Colors
    x: tuple[int, ...]
    y: tuple[int, ...]
    w: int
    h: int
    whole: bool = True
    margin: tuple[int, int] = (0, 0)
    exclude: tuple[str, ...] = ()
    floats: bool = False

    @property
    def palette(self) -> tuple[int, ...]:
        """All colours."""
        return _color_set(self.colors)

    @property
    def bottom(self) -> int:
        """The row below the last cell."""
        return max(self.y) + self.h

    def __post_init__(self) -> None:
        _color_set(self.colors)
        if len(self.x) != len(self.y) or not self.x:
            raise ValueError(f"x and y need one entry per slot each, got {len(self.x)} and {len(self.y)}")
        if not (min(self.x) >= 0 and max(self.x) + self.w <= WIDTH and min(self.y) >= 0 and self.w > 0 and self.h > 0):
            raise ValueError("every cell must lie on the screen")


@dataclass(frozen=True)
class Runs:
    """Walls and floors of known height, by the horizontal runs of pixels in one of their rows.

    A run belongs to the first region in whose top row it begins and whose widths allow it. Its box reaches down to the bottom of that
    region. Each row has `most` slots, from the left, unless the objects are `packed`.

    Args:
        colors: of each region. Pixels of different colours of a region make one run.
        regions: left, top and right edge of where the runs begin, and the bottom of their boxes; from the top row down.
        widths: least and largest width of a run, for each region.
        most: runs that are looked at in each row.
        margins: columns on the left, rows above, and columns on the right by which the boxes of each region are larger than the runs, for
            objects of known shape that the row crosses at their tip; none by default.
        gap: pieces of a run that are at most so many blank pixels apart are one run, such as a floor behind a figure.
        columns: left and right edge of what is looked at; pixels outside do not count.
        packed: whether the objects of all rows take the first slots of the category, whose number is free then.
    """

    colors: tuple[tuple[int, ...], ...]
    regions: tuple[Area, ...]
    widths: tuple[tuple[int, int], ...]
    most: int
    margins: tuple[tuple[int, int, int], ...] = ()
    gap: int = 0
    columns: tuple[int, int] = (0, WIDTH)
    packed: bool = False

    @property
    def palette(self) -> tuple[int, ...]:
        """All colours."""
        return tuple(sorted({c for colors in self.colors for c in colors}))

    @property
    def rows(self) -> tuple[tuple[int, tuple[int, ...]], ...]:
        """Each row that is looked at, with its colours."""
        return tuple(dict.fromkeys((region[1], colors) for region, colors in zip(self.regions, self.colors, strict=True)))

    @property
    def slots(self) -> int:
        """Slots of all rows."""
        return self.most * len(self.rows)

    @property
    def bottom(self) -> int:
        """The row below the last row of its boxes."""
        return max(bottom for _, _, _, bottom in self.regions)

    def __post_init__(self) -> None:
        if not len(self.colors) == len(self.regions) == len(self.widths):
            raise ValueError(f"{len(self.regions)} regions need as many colors and widths, got {len(self.colors)} and {len(self.widths)}")
        for area, colors in zip(self.regions, self.colors, strict=True):
            _check_area(area)
            _color_set(colors)
        if self.margins and len(self.margins) != len(self.regions):
            raise ValueError(f"{len(self.regions)} regions need as many margins, got {len(self.margins)}")
        for (_, top, _, _), (least, _), (before, above, after) in zip(self.regions, self.widths, self.margins, strict=False):
            if above > top or least + before + after < 1:
                raise ValueError(f"margins must leave boxes on the screen, got {(before, above, after)} for row {top}, width {least}")
        if self.most < 1:
            raise ValueError(f"most must be at least 1, got {self.most}")
        if not 0 <= self.gap < 32:
            raise ValueError(f"gap must be 0 to 31 pixels, got {self.gap}")
        _check_area((self.columns[0], 0, self.columns[1], 1))


Rule = Bounds | Blobs | Cells | Runs


@dataclass(frozen=True)
class Shades:
    """Colours that change together from level to level. Rules name those of the first level.

    Args:
        pixel: (x, y) of a pixel whose colour tells the level.
        keys: its colour at each level; at any other colour the first level's colours count.
        levels: the colours at each level, always in the same order. An odd index stands for a colour that the level does not have.
    """

    pixel: tuple[int, int]
    keys: tuple[int, ...]
    levels: tuple[tuple[int, ...], ...]

    def __post_init__(self) -> None:
        if not self.levels or len(self.keys) != len(self.levels) or len({len(colors) for colors in self.levels}) != 1:
            raise ValueError("each level needs a key and as many colors as the first one")
        for colors in (self.keys, *self.levels):
            _color_set(colors)


@dataclass(frozen=True)
class Saver:
    """The screen saver that a game shows after some 32,768 or 65,536 frames: each colour is shown as `(color ^ key) & mask`.

    The key changes every few seconds. REM knows it from the RAM, and VEM reads it off a pixel.

    Args:
        key: function of the address map: the key, int32; -1 while the colours are those of play.
        pixel: (x, y) of a pixel that has one colour in play, but for moments.
        color: that colour, or all that it has in play, the usual one first.
        mask: bits of a colour that the saver keeps. Colours that differ in the others alone are shown as one.
        taken: the colours for which VEM takes what is shown as one; without an entry, that is the first colour that a rule names.
        changed: the colours that the saver changes; all without it.
        beside: (x, y) of a second pixel, for games that change all colours in play, too. Then `color` is the pixel's usual colour, and the
            saver is on where neither pixel has a bit that `mask` drops: whatever the change, one of the two has it in play.
    """

    key: Callable[[Any], jax.Array]
    pixel: tuple[int, int]
    color: Colors
    mask: int = 0xFF
    taken: tuple[int, ...] = ()
    changed: tuple[int, ...] = ()
    beside: tuple[int, int] | None = None

    @property
    def colors_in_play(self) -> tuple[int, ...]:
        """The colours of the pixel."""
        return _color_set(self.color)

    def __post_init__(self) -> None:
        for x, y in (self.pixel, self.beside or self.pixel):
            _check_area((x, y, x + 1, y + 1))
        _color_set((*self.colors_in_play, *self.taken, *self.changed))
        if not 0 < self.mask < 256:
            raise ValueError(f"mask must be the bits of a palette index, got {self.mask}")
        if self.beside is not None and self.mask == 0xFF:
            raise ValueError("a second pixel tells something only if mask drops a bit")
