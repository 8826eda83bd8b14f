"""Displays: REM's box of a number or of icons is where VEM's rule finds and reads them."""

import jax.numpy as jnp
import numpy as np
import pytest

from ocjax.console.fonts import DIGITS_3X5, hex_font
from ocjax.extraction.categories import Category
from ocjax.extraction.detection import detect
from ocjax.vision.displays import IconRow, Icons, NumberDisplay, Static
from ocjax.vision.filters import ShortRuns
from ocjax.vision.unknown import UNKNOWN_VALUE

FONT = hex_font(DIGITS_3X5, dots=3, dot=(1, 1), pitch=4)
COLOR = 20


def seen(rule, frame):
    (found,) = detect((Category("A", rule, attributes=("value",)),), jnp.asarray(frame[None]))
    return [int(v[0, 0]) for v in (found.x, found.y, found.w, found.h, found.value)]


def drawn(display, text):
    """A frame with a character in each cell of a display."""
    frame = np.zeros((210, 160), np.uint8)
    for left, digit in zip(display.lefts, text, strict=True):
        for row, dots in enumerate(FONT.glyphs[int(digit)] if digit != " " else ()):
            for dot in range(FONT.dots):
                frame[display.top + row, left + dot] = COLOR * (dots >> (FONT.dots - 1 - dot) & 1)
    return frame


@pytest.mark.parametrize(
    ("number", "leading_zeros"), [(0, False), (7, False), (1230, False), (45, True)]
)
def test_a_number_is_read_where_its_box_is(number, leading_zeros):
    display = NumberDisplay(FONT, right=100, top=30, digits=4, leading_zeros=leading_zeros)
    frame = drawn(display, f"{number:04d}" if leading_zeros else f"{number:4d}")
    b = display.box(jnp.int32(number))
    assert [int(v) for v in (b.x, b.y, b.w, b.h, b.value)] == seen(display.rule(COLOR), frame)
    assert int(display.box(jnp.int32(number), value=jnp.int32(3)).value) == 3


def test_a_number_is_read_without_filtered_pixels():
    display = NumberDisplay(FONT, right=100, top=30, digits=4)
    frame = drawn(display, "  42")
    frame[20:60, display.lefts[0]] = COLOR  # a wall in an empty cell
    low = display.rule(COLOR, filters=(ShortRuns(FONT.height),))
    b = display.box(jnp.int32(42))
    assert seen(low, frame) == [int(v) for v in (b.x, b.y, b.w, b.h, b.value)]
    assert seen(display.rule(COLOR), frame)[-1] == UNKNOWN_VALUE


@pytest.mark.parametrize("icons", [1, 2, 5])
@pytest.mark.parametrize(
    ("left", "pitch"), [(40, 8), (80, -8)], ids=["to the right", "to the left"]
)
def test_icons_are_counted_where_their_box_is(icons, left, pitch):
    row = IconRow(left=left, top=180, width=5, height=7, pitch=pitch)
    frame = np.zeros((210, 160), np.uint8)
    for i in range(icons):
        frame[180:187, left + pitch * i : left + pitch * i + 5] = COLOR
    b = row.box(jnp.int32(icons), value=jnp.int32(icons + 1))
    assert [int(v) for v in (b.x, b.y, b.w, b.h, b.value)] == seen(
        row.rule(COLOR, (30, 170, 120, 190), single=2), frame
    )
    assert b.valid
    assert not row.box(jnp.int32(0)).valid
    assert not row.box(jnp.int32(3), valid=False).valid


@pytest.mark.parametrize("shown", [0, 2, 3])
def test_icons_are_found_where_their_boxes_are(shown):
    icons = Icons(left=40, top=180, size=(5, 7), pitch=8, count=3)
    frame = np.zeros((210, 160), np.uint8)
    for left in icons.lefts[:shown]:
        frame[180:187, left : left + 5] = COLOR
    (found,) = detect((Category("A", icons.rule(COLOR), 3),), jnp.asarray(frame[None]))
    b = icons.box(jnp.int32(shown))
    assert b.valid.tolist() == found.valid[:, 0].tolist() == [i < shown for i in range(3)]
    assert b.x[b.valid].tolist() == found.x[:, 0][b.valid].tolist()
    assert icons.boxes(np.array([False, False, True])).valid.tolist() == [False, False, True]


def test_a_static_object_is_found_where_its_box_is():
    static = Static(x=40, y=180, w=5, h=7, colors=(COLOR, 34))
    frame = np.zeros((210, 160), np.uint8)
    frame[180, 40] = COLOR
    frame[186, 44] = 34
    two = np.stack([frame, frame])
    two[1, 180, 40] = 0
    (found,) = detect((Category("A", static.rule()),), jnp.asarray(two))
    b = static.box()
    place = [int(v) for v in (b.x, b.y, b.w, b.h)]
    assert place == [int(v[0, 0]) for v in (found.x, found.y, found.w, found.h)]
    assert found.valid[0].tolist() == [True, False]
    assert not static.box(False).valid
