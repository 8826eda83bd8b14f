"""Numbers, icons and objects that never move, declared once for REM's boxes and VEM's rules."""

from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from ocjax.console.boxes import Area, Box, Number, box
from ocjax.console.fonts import Digits, Font, score_box
from ocjax.vision.colors import Colors
from ocjax.vision.filters import Filter
from ocjax.vision.rules import Bounds, Cells, Gauge

__all__ = ["IconRow", "Icons", "NumberDisplay", "Static"]


@dataclass(frozen=True)
class NumberDisplay:
    """A right-aligned number.

    Args:
        font: the pictures of its digits.
        right: right edge of the last digit's cell in pixels, exclusive.
        top: first row of the digits.
        digits: number of cells.
        leading_zeros: whether all cells show a digit; otherwise leading zeros are blank.
    """

    font: Font
    right: int
    top: int
    digits: int
    leading_zeros: bool = False

    @property
    def lefts(self) -> range:
        """The first column of each cell."""
        last = self.right - self.font.width
        return range(last - self.font.pitch * (self.digits - 1), last + 1, self.font.pitch)

    @property
    def area(self) -> Area:
        """The area of all cells."""
        return self.lefts[0], self.top, self.right, self.top + self.font.height

    def box(self, shown: jax.Array, **fields: Any) -> Box:
        """Return the tight box around a number.

        Args:
            shown: the number on the screen, int32, not negative; also the value, unless `fields`
                sets one.
            fields: `valid`, `value` and `color` of the box.
        """
        return score_box(
            self.font,
            shown,
            right=self.right,
            top=self.top,
            digits=self.digits,
            leading_zeros=self.leading_zeros,
            **{"value": shown, **fields},
        )

    def rule(
        self,
        colors: Colors,
        region: Area | None = None,
        *,
        filters: tuple[Filter, ...] = (),
        **options: Any,
    ) -> Bounds:
        """Return the rule with which VEM finds and reads the number.

        Args:
            colors: of the digits.
            region: area to search; by default the cells.
            filters: applied to the pixels before the digits are read.
            options: of `Digits`.
        """
        digits = Digits(self.font, self.lefts, self.top, **options)
        return Bounds(colors, region or self.area, value=digits, filters=filters)


@dataclass(frozen=True)
class IconRow:
    """A value shown as a row of equal icons.

    Args:
        left: first column of the first icon, which is the last one to disappear.
        top: first row.
        width: of an icon, in pixels.
        height: of an icon.
        pitch: columns from an icon to the next; negative if the row grows to the left.
    """

    left: int
    top: int
    width: int
    height: int
    pitch: int

    def box(self, icons: jax.Array, valid: Number = True, **fields: Any) -> Box:
        """Return the box around some icons; invalid without icons.

        Args:
            icons: number of icons, int32.
            valid: a further condition.
            fields: `value` and `color` of the box.
        """
        left = self.left + min(self.pitch, 0) * (icons - 1)
        width = self.width + abs(self.pitch) * (icons - 1)
        return box(left, self.top, width, self.height, (icons > 0) & valid, **fields)

    def rule(self, colors: Colors, region: Area, *, single: int = 1, **options: Any) -> Bounds:
        """Return the rule with which VEM finds and counts the icons.

        Args:
            colors: of the icons.
            region: area to search.
            single: value of a single icon; each further icon adds 1.
            options: of `Bounds`.
        """
        return Bounds(colors, region, value=Gauge(abs(self.pitch), self.width, single), **options)


@dataclass(frozen=True)
class Icons:
    """A row of equal icons that are separate objects, one slot each.

    Args:
        left: first column of the first icon.
        top: first row.
        size: (width, height) of an icon.
        pitch: columns from an icon to the next.
        count: number of icons.
    """

    left: int
    top: int
    size: tuple[int, int]
    pitch: int
    count: int

    @property
    def lefts(self) -> tuple[int, ...]:
        """The first column of each icon."""
        return tuple(self.left + self.pitch * i for i in range(self.count))

    def box(self, shown: Number, **fields: Any) -> Box:
        """Return the boxes of the first `shown` icons; `fields` are `value` and `color`."""
        return self.boxes(np.arange(self.count) < shown, **fields)

    def boxes(self, there: Number, **fields: Any) -> Box:
        """Return the boxes of the icons that are there; `fields` are `value` and `color`."""
        return box(np.array(self.lefts), self.top, *self.size, there, **fields)

    def rule(self, colors: Colors, **options: Any) -> Cells:
        """Return the rule with which VEM finds the icons.

        `options` are those of `Cells`; by default any pixel of an icon with the colours is enough.
        """
        tops = (self.top,) * self.count
        return Cells(colors, self.lefts, tops, *self.size, **{"whole": False, **options})


@dataclass(frozen=True)
class Static:
    """An object that never moves.

    Args:
        x: first column.
        y: first row.
        w: width in pixels.
        h: height.
        colors: VEM finds the object if pixels of these colours reach all its edges.
    """

    x: int
    y: int
    w: int
    h: int
    colors: Colors

    @property
    def area(self) -> Area:
        """The area of the object."""
        return self.x, self.y, self.x + self.w, self.y + self.h

    def box(self, valid: Number = True, **fields: Any) -> Box:
        """Return the object's box; `fields` are further ones of `box`."""
        return box(self.x, self.y, self.w, self.h, valid, **fields)

    def rule(self, **options: Any) -> Bounds:
        """Return the rule with which VEM finds the object; `options` are those of `Bounds`."""
        return Bounds(self.colors, self.area, min_size=(self.w, self.h), **options)
