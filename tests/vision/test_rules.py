"""Rules on drawn frames."""

import dataclasses
import functools
import itertools

import jax.numpy as jnp
import numpy as np
import pytest

from ocjax.console import palette
from ocjax.console.boxes import box
from ocjax.console.fonts import DIGITS_3X5, Digits, hex_font
from ocjax.console.rom import Rom
from ocjax.extraction.categories import Category, display
from ocjax.extraction.game import Game
from ocjax.extractors.krull.lines import Lines
from ocjax.vision.filters import LoneRuns, ShortRuns
from ocjax.vision.rules import Blobs, Bounds, ByColor, Cells, Gauge, Run, Runs
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Packed, Tight
from ocjax.vision.unknown import UNKNOWN_VALUE
from tests.support.small_game import CATEGORIES, GAME, Ram, decode, three

pytestmark = pytest.mark.usefixtures("quick_compilation")


def test_digits_that_are_required():
    glyphs = ("7", "5", *("2",) * 8)
    men = Digits(hex_font(glyphs, 3), (40, 44), 10, weights=(1, 1), base=1, required=True)
    h = display("H", Bounds(14, (40, 10, 48, 11), value=men))
    game = GAME.replaced(categories=(*CATEGORIES[:2], h))
    frames = np.zeros((3, 210, 160), np.uint8)
    frames[:2, 10, [44, 46]] = 14  # a 1 in the last cell
    frames[1, 10, [40, 42]] = 14
    frames[2, 10, 44:46] = 14  # something else
    found = game.vem(frames)
    assert found.valid[:, -1].tolist() == [True, True, False]
    assert found.value[:, -1].tolist() == [2, 3, 0]


def test_centered_digits():
    glyphs = ("7", "5", *("2",) * 8)
    number = Digits(hex_font(glyphs, 3), (40, 44, 48, 52), 10, centered=True)
    h = display("H", Bounds(14, (40, 10, 56, 11), value=number))
    game = GAME.replaced(categories=(*CATEGORIES[:2], h))
    frames = np.zeros((3, 210, 160), np.uint8)
    frames[:, 10, [44, 46]] = 14  # a 1 in the second cell
    frames[:2, 10, 48:51] = 14  # a 0 in the third
    frames[0, 10, [40, 42, 52, 54]] = 14  # ones in the first and the last
    assert game.vem(frames).value[:, -1].tolist() == [1101, 10, 1]


def test_thin_objects_in_front_of_walls():
    categories = (
        Category("A", Blobs(14, None, Shape(w=(2, 31)), filters=(ShortRuns(2),)), count=3),
        *CATEGORIES[1:],
    )
    game = GAME.replaced(categories=categories, decode=three)
    frame = np.zeros((210, 160), np.uint8)
    frame[20:28, 40:60] = 14  # a wall
    frame[23:25, 30:50] = 14  # half hidden by it
    frame[100:103, 10:20] = 14
    frame[150, 100:104] = 14  # beside another
    frame[140:180, 104:108] = 14
    assert game.vem(frame).xywh[:3].tolist() == [[30, 23, 10, 2], [100, 150, 4, 1], [0, 0, 0, 0]]


def test_upright_objects_in_front_of_figures():
    categories = (
        Category(
            "A", Blobs(14, None, Shape(h=(3, 32)), filters=(ShortRuns(1, across=True),)), count=3
        ),
        *CATEGORIES[1:],
    )
    game = GAME.replaced(categories=categories, decode=three)
    frame = np.zeros((210, 160), np.uint8)
    frame[20:28, 29:36] = 14  # a figure
    frame[23:31, 31] = 14  # half hidden by it, beside the next word of the bitmap
    frame[100:104, 10:12] = 14
    frame[150:156, 32] = 14  # below another
    frame[146:150, 30:34] = 14
    assert game.vem(frame).xywh[:3].tolist() == [[31, 28, 1, 3], [32, 150, 1, 6], [0, 0, 0, 0]]


def test_flat_objects_in_the_colour_of_others():
    rule = Bounds(14, (0, 20, 160, 60), (4, 1), max_size=(150, 1), filters=(LoneRuns(2),))
    game = GAME.replaced(categories=(Category("A", rule), *CATEGORIES[1:]))
    frame = np.zeros((210, 160), np.uint8)
    frame[30, 28:40] = frame[30, 50:70] = 14  # across the edges of words
    frame[50, 20:28] = frame[51, 28] = frame[40, 100:140] = frame[41, 139] = (
        14  # touch others, the first at a corner
    )
    frame[56, 159] = 14  # too short
    assert game.vem(frame).xywh[0].tolist() == [28, 30, 42, 1]
    frame[31, 70] = 14
    assert game.vem(frame).xywh[0].tolist() == [28, 30, 12, 1]


def test_objects_of_two_shapes():
    across = Blobs((14, 16), None, Shape(w=(4, 6), h=2), filters=(ShortRuns(2),))
    upright = Blobs((14, 16), None, Shape(w=1, h=6), also=(across,))
    game = GAME.replaced(
        categories=(Category("A", upright, count=3), *CATEGORIES[1:]), decode=three
    )
    frame = np.zeros((210, 160), np.uint8)
    frame[20:40, 40:48] = 14  # a figure
    frame[30:32, 36:40] = 14  # touches it
    frame[20:26, 100] = 16
    seen = game.vem(frame)
    assert seen.xywh[:3].tolist() == [[100, 20, 1, 6], [36, 30, 4, 2], [0, 0, 0, 0]]
    assert (np.asarray(seen.rgb)[:2] == palette.NTSC[[16, 14]]).all()


def test_a_thin_shot_before_a_figure():
    rule = Blobs(
        (14, 16, 18),
        (0, 20, 160, 60),
        Shape(w=(1, 8), h=(1, 8)),
        filters=(Lines(5, rows=(20, 60)),),
    )
    categories = (Category("A", rule, count=3), *CATEGORIES[1:])
    game = GAME.replaced(categories=categories, decode=three)
    frame = np.zeros((210, 160), np.uint8)
    frame[30:34, 40:48], frame[34:38, 40:48] = 16, 18  # a figure
    frame[29 + np.arange(7), 42 + np.arange(7)] = 14
    frame[40:45, 60] = frame[62:70, 80] = 16
    frame[45:49, 60] = 14
    assert game.vem(frame).xywh[:3].tolist() == [[42, 29, 7, 7], [60, 40, 1, 5], [0, 0, 0, 0]]


def game_with_parts(shape):
    """The small game with three slots for the tight parts of components."""
    rule = Blobs(14, (0, 20, 160, 60), shape, then=(Tight(),))
    return GAME.replaced(categories=(Category("A", rule, count=3), *CATEGORIES[1:]), decode=three)


def test_figures_of_unequal_height_that_touch():
    game = game_with_parts(Shape(w=(1, 16), h=(1, 9), split=(8, 9)))
    frame = np.zeros((210, 160), np.uint8)
    frame[30:38, 26:34], frame[29:37, 34:41] = 14, 14
    frame[40:44, 100:103] = 14
    assert game.vem(frame).xywh[:3].tolist() == [[26, 30, 8, 8], [33, 29, 8, 9], [100, 40, 3, 4]]
    frame[29:37, 34:42] = 14
    assert game.vem(frame).xywh[:3].tolist() == [[26, 30, 8, 8], [34, 29, 8, 8], [100, 40, 3, 4]]


def test_parts_without_pixels_are_dropped():
    """An L in quarters: none at the top right."""
    game = game_with_parts(Shape(w=(1, 8), h=(1, 8), split=(4, 4)))
    frame = np.zeros((210, 160), np.uint8)
    frame[30:38, 26:30], frame[34:38, 30:34] = 14, 14
    found = game.vem(frame)
    assert found.xywh[:3].tolist() == [[26, 30, 4, 4], [0, 0, 0, 0], [26, 34, 4, 4]]
    assert found.valid[:3].tolist() == [True, False, True]


def test_walls_of_known_height():
    walls = Runs(
        (
            Run((14, 16), 20, left=(0, 159), width=(8, 160), height=40),
            Run((14, 16), 20, left=(100, 103), width=4, height=60),
            Run(18, 60, left=(0, 159), width=(1, 160), height=20),
        ),
        most=3,
    )
    categories = (Category("A", walls, count=6), *CATEGORIES[1:])
    game = GAME.replaced(
        categories=categories, decode=lambda m: decode(m) | {"A": box(jnp.arange(6), 10, 4, 4)}
    )
    frame = np.zeros((210, 160), np.uint8)
    frame[20:60, 0:8], frame[20:60, 8:40] = 14, 16  # one wall of two colours
    frame[20:60, 50:54] = 14  # too narrow
    frame[20:80, 100:104] = 14  # narrow walls there are high
    frame[60:80, 31:33], frame[60:80, 120:160] = 18, 18  # the first one crosses the edge of a word
    frame[30:32, 40:44] = 14  # beside a wall, below its first row
    seen = game.vem(frame)
    assert seen.xywh[:6].tolist() == [
        [0, 20, 40, 40],
        [0] * 4,
        [100, 20, 4, 60],
        [31, 60, 2, 20],
        [120, 60, 40, 20],
        [0] * 4,
    ]
    assert not game.vem(np.zeros_like(frame)).valid.any()


def test_floors_behind_figures_and_between_walls():
    runs = tuple(Run(14, row, left=(0, 159), width=(12, 160), height=4) for row in (20, 30))
    floors = Runs(runs, most=3, gap=3, columns=(8, 152), then=(Packed(),))
    game = GAME.replaced(
        categories=(Category("A", floors, count=3), *CATEGORIES[1:]),
        decode=lambda m: decode(m) | {"A": box(jnp.arange(3), 10, 4, 4)},
    )
    frame = np.zeros((210, 160), np.uint8)
    frame[20:24] = frame[30:34, 20:40] = frame[30:34, 50:70] = 14
    frame[20:24, 30:33] = 20  # a figure in front of a floor, across the edge of a word
    frame[20:24, 60:64] = frame[20:24, 140:150] = (
        0  # gaps between floors; what follows the second one is too short
    )
    seen, overflow = game.vem_overflow(frame[None])
    assert seen.xywh[0, :3].tolist() == [[8, 20, 52, 4], [64, 20, 76, 4], [20, 30, 20, 4]]
    assert overflow[0].tolist() == [1, 0, 0]
    frame[20:24] = 0
    assert game.vem(frame).xywh[:3].tolist() == [[20, 30, 20, 4], [50, 30, 20, 4], [0] * 4]


def test_each_region_has_its_least_size():
    regions = ((0, 20, 20, 60), (20, 20, 40, 60))
    game = GAME.replaced(
        categories=(Category("A", Bounds(14, regions, ((4, 8), (4, 4))), count=2), *CATEGORIES[1:]),
        decode=lambda m: decode(m) | {"A": box(jnp.arange(2), 10, 4, 4)},
    )
    frame = np.zeros((210, 160), np.uint8)
    frame[30:34, 10:30] = 14
    assert game.vem(frame).valid[:2].tolist() == [False, True]


def test_runs_have_their_least_and_greatest_width_and_place():
    runs = (Run(14, 20, left=(10, 40), width=(4, 8), height=2), Run(14, 30, 0, (1, 160), 1))
    category = Category("A", Runs(runs, most=2), count=4)
    game = GAME.replaced(
        categories=(category, *CATEGORIES[1:]),
        decode=lambda m: decode(m) | {"A": box(jnp.arange(4), 10, 4, 4)},
    )
    for left, width in itertools.product((9, 10, 40, 41), (3, 4, 8, 9)):
        frame = np.zeros((210, 160), np.uint8)
        frame[20, left : left + width] = frame[30, :2] = 14
        fits = 10 <= left <= 40 and 4 <= width <= 8
        expected = [left, 20, width, 2] if fits else [0] * 4
        assert game.vem(frame).xywh[:3].tolist() == [expected, [0] * 4, [0, 30, 2, 1]]


CELLS_X, CELLS_Y = (20, 61, 100, 20, 61, 100), (30, 30, 30, 70, 70, 70)


def game_with_cells(**options):
    cells = Cells(14, CELLS_X, CELLS_Y, 4, 3, margin=(2, 1), **options)
    return GAME.replaced(
        categories=(Category("A", cells, count=6), *CATEGORIES[1:]),
        decode=lambda m: decode(m) | {"A": box(jnp.arange(6), 10, 4, 4)},
    )


@pytest.mark.parametrize("whole", [False, True])
def test_cells_with_a_margin(whole):
    """Objects that reach a cell's margin are not the cell's. Corners are no margin."""
    frame = np.zeros((210, 160), np.uint8)
    for x, y in zip(CELLS_X, CELLS_Y, strict=True):
        frame[y : y + 3, x : x + 4] = 14
    frame[31, 18] = frame[32, 66] = frame[69, 20] = frame[73, 64] = 14
    frame[29, 99] = frame[27, 101] = frame[71, 97] = 14  # at a corner, and beyond the margin
    found = game_with_cells(whole=whole).vem(frame)
    assert found.valid[:6].tolist() == [False, False, True, False, False, True]
    assert found.xywh[jnp.array([2, 5])].tolist() == [[100, 30, 4, 3], [100, 70, 4, 3]]


def test_cells_of_which_a_part_is_drawn():
    frame = np.zeros((210, 160), np.uint8)
    frame[30, 21:23] = frame[72, 64] = frame[31:33, 100] = 14
    assert not game_with_cells().vem(frame).valid[:6].any()
    found = game_with_cells(whole=False).vem(frame).xywh[:6].tolist()
    assert found == [[21, 30, 2, 1], [0] * 4, [100, 31, 1, 2], [0] * 4, [64, 72, 1, 1], [0] * 4]


def test_objects_of_known_shape_by_their_tips():
    runs = (
        Run(14, 50, left=(0, 79), width=1, height=10, above=20, after=10),
        Run(14, 50, left=(80, 159), width=1, height=10, before=10, above=20),
    )
    angles = Runs(runs, most=2)
    categories = (Category("A", angles, count=2), *CATEGORIES[1:])
    game = GAME.replaced(
        categories=categories, decode=lambda m: decode(m) | {"A": box(jnp.arange(2), 10, 4, 4)}
    )
    frame = np.zeros((210, 160), np.uint8)
    frame[50, 30] = frame[50, 120] = 14
    assert game.vem(frame).xywh[:2].tolist() == [[30, 30, 11, 30], [110, 30, 11, 30]]


def test_objects_that_are_not_on_other_screens():
    categories = (CATEGORIES[0], dataclasses.replace(CATEGORIES[1], needs=("A",)), CATEGORIES[2])
    game = GAME.replaced(categories=categories)
    frames = np.zeros((2, 210, 160), np.uint8)
    frames[:, 20:24, [20, 40, 60]] = 22
    frames[0, 50:54, 20:24] = 14
    seen, overflow = game.vem_overflow(frames)
    assert seen.valid[:, :3].tolist() == [[True, True, True], [False, False, False]]
    assert overflow[:, 1].tolist() == [1, 0]


def test_objects_that_are_on_several_screens():
    either = display("H", Bounds(30, (0, 0, 20, 20)), attributes=(), needs=("A", "B"))
    game = GAME.replaced(categories=(*CATEGORIES[:2], either))
    frames = np.zeros((3, 210, 160), np.uint8)
    frames[:, 4:8, 4:8] = 30
    frames[0, 50:54, 20:24], frames[1, 50:54, 20:24] = 14, 22
    assert game.vem(frames).valid[:, -1].tolist() == [True, True, False]


def test_objects_that_share_colours():
    categories = (Category("A", Blobs((14, 16), first=14), count=3), *CATEGORIES[1:])
    game = GAME.replaced(categories=categories, decode=three)
    frame = np.zeros((210, 160), np.uint8)
    frame[20:24, 40:50], frame[24:28, 40:50] = 14, 16
    frame[50:58, 20:30] = 16
    frame[80:84, 60:70], frame[84:88, 60:70] = 16, 14
    seen = game.vem(frame)
    assert seen.xywh[:3][seen.valid[:3]].tolist() == [[40, 20, 10, 8]]


def test_objects_of_different_colours_stay_apart():
    categories = (Category("A", Blobs(14, also=(Blobs(16),)), count=3), *CATEGORIES[1:])
    game = GAME.replaced(categories=categories, decode=three)
    frame = np.zeros((210, 160), np.uint8)
    frame[20:24, 40:50], frame[24:28, 44:54] = 16, 14
    frame[10:12, 90:93] = frame[100:103, 0:5] = frame[110:113, 0:5] = 14
    seen, overflow = game.vem_overflow(frame[None])
    assert seen.xywh[0, :3].tolist() == [[90, 10, 3, 2], [40, 20, 10, 4], [44, 24, 10, 4]]
    assert overflow[0].tolist() == [2, 0, 0]


def test_digits_and_gauges_are_read():
    """Numbers drawn into a frame, against VEM's values; empty and foreign cells count as 0."""
    digits = [
        Digits(hex_font(DIGITS_3X5, 3, (4, 2)), (left, left + 16, left + 32), top)
        for left, top in ((3, 4), (90, 100))
    ]
    clock = Digits(hex_font(DIGITS_3X5, 3, (2, 1)), (20, 31), 60, weights=(60, 1))
    game = Game(
        name="Test",
        rom=Rom("pong", "0" * 32),
        ram=Ram,
        decode=lambda m: {"Two": box(0, 0, 1, 1), "Clock": box(0, 0, 1, 1), "Bar": box(0, 0, 1, 1)},
        categories=(
            Category(
                "Two",
                Bounds(14, ((0, 0, 60, 20), (80, 90, 160, 120)), value=tuple(digits)),
                count=2,
                attributes=("value",),
            ),
            Category("Clock", Bounds(20, (0, 50, 160, 80), value=clock), attributes=("value",)),
            Category(
                "Bar",
                Bounds(30, (0, 150, 160, 160), value=Gauge(8, 4, 1, full=44)),
                attributes=("value",),
            ),
        ),
    )
    rng = np.random.default_rng(0)
    frames, want = np.zeros((40, 210, 160), np.uint8), np.zeros((40, 4), int)

    def draw(frame, d, cell, digit, color):
        for j, row in enumerate(DIGITS_3X5[digit]):
            for i in range(3):
                if int(row, 16) >> (2 - i) & 1:
                    y, x = d.top + j * d.font.dot[1], d.lefts[cell] + i * d.font.dot[0]
                    frame[y : y + d.font.dot[1], x : x + d.font.dot[0]] = color

    for frame, values in zip(frames, want, strict=True):
        for slot, (d, color) in enumerate(((digits[0], 14), (digits[1], 14), (clock, 20))):
            shown = [c for c in range(len(d.lefts)) if c == len(d.lefts) - 1 or rng.random() < 0.8]
            for cell in shown:
                digit = int(rng.integers(10))
                draw(frame, d, cell, digit, color)
                values[slot] += digit * d.worth[cell]
        length = int(rng.integers(4, 100))
        frame[152:155, 10 : 10 + length] = 30
        values[3] = 1 + (length - 4) // 8 if length < 44 else UNKNOWN_VALUE  # the bar is full
    frames[0, 4:14, 3:15] = 14  # a full block is no digit
    want[0, 0] = UNKNOWN_VALUE
    assert np.array_equal(game.vem(frames).value, want)


def test_gauges_of_other_boxes_and_coarse_ones():
    filled = Bounds(20, (0, 50, 60, 60))
    game = GAME.replaced(
        categories=(
            Category(
                "Bar",
                Bounds((14, 20), (0, 50, 60, 60), value=Gauge(2, 0, 5, of=filled)),
                attributes=("value",),
            ),
            Category(
                "Icon",
                Bounds(
                    30, ((0, 0, 8, 8), (8, 0, 16, 8)), value=Gauge(8, of=Bounds(30, (0, 0, 16, 8)))
                ),
                2,
                attributes=("value",),
            ),
            Category(
                "Needle",
                Bounds(
                    40, (0, 100, 160, 110), max_size=(2, 9), value=Gauge(1, 7, side="x", worth=8)
                ),
                attributes=("value",),
            ),
        ),
        decode=lambda m: {name: box(0, 0, 1, 1) for name in ("Bar", "Icon", "Needle")},
    )
    frames = np.zeros((3, 210, 160), np.uint8)
    frames[:, 52:54, 10:50] = 14
    frames[0, 52:54, 10:31], frames[1, 52:54, 10:12] = 20, 20
    frames[:, :8, :8] = 30
    frames[1, :8, 8:16] = 30
    frames[:2, 101, 10:12], frames[2, 101, 10:13] = 40, 40  # the third one is too wide for a needle
    seen = game.vem(frames)
    assert seen.value.tolist() == [[15, 1, 0, 24], [6, 2, 2, 24], [5, 1, 0, 0]]
    assert seen.valid.tolist() == [
        [True, True, False, True],
        [True] * 4,
        [True, True, False, False],
    ]
    assert seen.w[:, 0].tolist() == [40] * 3


def test_numbers_beside_signs_and_other_texts():
    """A sign before a number is an empty cell, a picture of several digits is not read, and cells
    that are free hold nothing."""
    pictures = (*DIGITS_3X5[:8], DIGITS_3X5[7], DIGITS_3X5[9])
    sign = (2, 5, 5, 5, 2)
    font = dataclasses.replace(hex_font(pictures, 3, pitch=4), signs=(sign,))
    number = functools.partial(Digits, font, (4, 8), 10)
    game = GAME.replaced(
        categories=(
            Category("Plain", Bounds(14, (0, 10, 30, 15), value=number()), attributes=("value",)),
            Category(
                "Alone",
                Bounds(14, (0, 10, 30, 15), value=number(free=(12, 20), required=True)),
                attributes=("value",),
            ),
            Category(
                "Shown",
                Bounds(14, (0, 10, 30, 15), value=number(free=(20,))),
                attributes=("value",),
            ),
        ),
        decode=lambda m: {name: box(0, 0, 1, 1) for name in ("Plain", "Alone", "Shown")},
    )
    texts = (
        {(4, 2), (8, 1)},
        {(4, sign), (8, 3)},
        {(4, 7), (8, 1)},
        {(8, 4), (20, 1)},
        {(8, 5), (12, 6)},
    )
    frames = np.zeros((len(texts), 210, 160), np.uint8)
    for frame, text in zip(frames, texts, strict=True):
        for left, shown in text:
            for j, row in enumerate(shown if isinstance(shown, tuple) else font.glyphs[shown]):
                frame[10 + j, left : left + 3] = [14 * (row >> 2 - i & 1) for i in range(3)]
    seen, unknown = game.vem(frames), UNKNOWN_VALUE
    assert seen.value[:, 0].tolist() == [21, 3, unknown, 4, 5]
    assert seen.valid[:, 1].tolist() == [True, True, True, False, False]
    assert seen.value[:3, 1].tolist() == [21, 3, unknown]
    assert seen.value[:, 2].tolist() == [21, 3, unknown, unknown, 5]


def test_values_by_color():
    def is_corner(color, frames):
        return (color == frames[:, 0, 0].astype(jnp.int32)[None]).astype(jnp.int32)

    blobs = Blobs((14, 20, 30), (0, 60, 160, 200))
    of_values = ByColor(((14, 1), (20, 7)))
    categories = tuple(
        Category(name, blobs, count=3, attributes=("value",), value=value)
        for name, value in (("P", of_values), ("Q", is_corner))
    )
    game = GAME.replaced(
        categories=categories, decode=lambda m: {"P": box(0, 0, 1, 1), "Q": box(0, 0, 1, 1)}
    )
    frames = np.zeros((3, 210, 160), np.uint8)
    for i, color in enumerate((14, 20, 30)):
        frames[:, 80, 40 * i + 10] = color
    frames[:, 0, 0] = 14, 20, 2
    value = np.asarray(game.vem(frames).value)
    assert value[:, :3].tolist() == [[1, 7, UNKNOWN_VALUE]] * 3
    assert value[:, 3:].tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, 0]]
