"""Errors of wrong vision rules: one case, just beyond the limit, for each kind of error."""

import pytest

from ocjax.console.fonts import Digits, hex_font
from ocjax.vision.filters import LoneRuns, NoLines, ShortRuns
from ocjax.vision.rules import Blobs, Bounds, Cells, Gauge, Run, Runs
from ocjax.vision.shades import Saver
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Raised, SideBySide, Tight

AREA = (0, 0, 9, 9)
BESIDE = (9, 0, 20, 9)
DIGITS = Digits(hex_font(("75557",) * 10, 3), (0,), 0)
FLOOR = Run(14, 0, 0, 1, 9)


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        (lambda: Blobs(256), "palette indices"),
        (lambda: Blobs(14, (0, 0, 161, 20)), "region"),
        (lambda: Blobs(14, connectivity=5), "connectivity"),
        (lambda: Blobs(14, connectivity=4, gap=(1, 0)), "gap needs"),
        (lambda: Blobs(14, gap=(32, 0)), "gap must be 0 to 31, got 32"),
        (lambda: Blobs(14, shapes=()), "at least one shape"),
        (lambda: Blobs((14, 16), first=18), "first must"),
        (lambda: Blobs(14, also=(Blobs(16, then=(Tight(),)),)), "must have no also and no steps"),
        (lambda: Shape(w=(5, 4), h=4), "w must be a number of pixels or"),
        (lambda: Shape(w=4, h=4, pixels=(3, 2)), "pixels must be a number of pixels or"),
        (lambda: Shape(w=4, h=4, split=(4, 0)), "split must be"),
        (lambda: ShortRuns(0), "most must be 1 to 255, got 0"),
        (lambda: ShortRuns(31, across=True), "most must be 1 to 30, got 31"),
        (lambda: LoneRuns(32), "least must be 1 to 31, got 32"),
        (lambda: NoLines(0), "most must be 1 to 255"),
        (lambda: Raised(0), "rows must be 1"),
        (lambda: SideBySide(0), "width must be"),
        (lambda: Bounds(20, AREA, value=Gauge(1), then=(SideBySide(4),)), "leave their slots"),
        (lambda: Bounds(((14,), (15,)), AREA), "colors for 2 regions"),
        (lambda: Bounds(14, (AREA,) * 3, ((1, 1),) * 2), "min_size for 2 regions"),
        (lambda: Bounds(14, (AREA, BESIDE), value=DIGITS), "digits for 1 regions"),
        (lambda: Cells(14, (1, 2), (1,), 2, 2), "one entry per slot"),
        (lambda: Cells(14, (159,), (1,), 2, 2), "on the screen"),
        (lambda: Cells(14, (1,), (1,), 2, 0), "on the screen"),
        (lambda: Runs((), 2), "at least one run"),
        (lambda: Runs((FLOOR,), 0), "most must"),
        (lambda: Runs((FLOOR,), 1, gap=32), "gap must be 0 to 31, got 32"),
        (lambda: Runs((FLOOR,), 1, columns=(9, 161)), "a region is"),
        (lambda: Run(14, 0, (9, 8), 1, 9), "left must be"),
        (lambda: Run(14, 5, 0, (1, 9), 4, above=6), "boxes on the screen"),
        (lambda: Run(14, 5, 0, (3, 9), 4, before=-2, after=-1), "boxes on the screen"),
        (lambda: Gauge(0), "unit"),
        (lambda: Gauge(1, side="d"), "side must be"),
        (lambda: Gauge(1, of=Bounds(14, (AREA, BESIDE))), "single box"),
        (lambda: Saver(lambda m: m, (0, 0), 4, beside=(1, 0)), "only if mask drops a bit"),
    ],
)
def test_wrong_rules(rule, message):
    with pytest.raises(ValueError, match=message):
        rule()


@pytest.mark.parametrize(
    "rule",
    [
        lambda: Blobs((0, 255), (159, 0, 160, 210), gap=(31, 31)),
        lambda: Blobs(14, shapes=Shape(w=(0, 0), h=(0, 4), split=(1, 1))),
        lambda: ShortRuns(1),
        lambda: ShortRuns(30, across=True),
        lambda: LoneRuns(1),
        lambda: LoneRuns(31),
        lambda: NoLines(1),
        lambda: Raised(1),
        lambda: SideBySide(1),
        lambda: Cells(14, (158,), (0,), 2, 2),
        lambda: Cells(14, (158,), (0,), 2, 1),
        lambda: Run(14, 5, (0, 159), 4, 4),
        lambda: Runs((FLOOR,), 1, gap=31, columns=(9, 160)),
        lambda: Run(14, 5, 0, (3, 9), 4, before=-2, above=5),
    ],
)
def test_rules_at_their_limits(rule):
    rule()
