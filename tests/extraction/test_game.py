"""Declarations of game files, and the errors of wrong declarations."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from numpy.lib.stride_tricks import as_strided

import ocjax
from ocjax.console import palette
from ocjax.console.boxes import box
from ocjax.console.fonts import Digits, hex_font
from ocjax.console.ram import RamMap, byte
from ocjax.console.rom import Rom
from ocjax.evaluation import matching
from ocjax.extraction.categories import Category, display
from ocjax.extraction.checks import Checks, LivesAsNumber
from ocjax.extraction.game import Game, GameError
from ocjax.extraction.saver import key_of
from ocjax.extractors.krull.lines import Lines
from ocjax.transforms.game_objects import views
from ocjax.vision.filters import LoneRuns, ShortRuns
from ocjax.vision.rules import Blobs, Bounds, ByColor, Gauge, Run, Runs
from ocjax.vision.shades import Saver
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Packed, Tight
from ocjax.vision.unknown import UNKNOWN, UNKNOWN_VALUE

pytestmark = pytest.mark.usefixtures("quick_compilation")


class Ram(RamMap):
    x = byte(1)
    ys = byte(2, 3)


def decode(m):
    return {
        "A": box(m.x, 10, 4, 4),
        "B": box(30, m.ys, 200, 5, value=m.ys, orientation=jnp.int32(20)),
        "H": box(-3, -3, 5, 5, value=7),
    }


CATEGORIES = (
    Category("A", Blobs(14)),
    Category("B", Blobs((20, 22)), count=2, attributes=("value", "orientation")),
    display("H", Bounds(14, (0, 0, 20, 20)), attributes=()),
)
GAME = Game(name="Test", rom=Rom("pong", "0" * 32), ram=Ram, decode=decode, categories=CATEGORIES)


def test_boxes_are_clipped_and_zeroed():
    ram = np.zeros(128, np.uint8)
    ram[[1, 2, 3]] = 158, 208, 250
    o = GAME.rem(ram)
    assert o.xywh.tolist() == [[158, 10, 2, 4], [30, 208, 130, 2], [0, 0, 0, 0], [0, 0, 2, 2]]
    assert o.valid.tolist() == [True, True, False, True]
    assert o.value.tolist() == [0, 208, 0, 0]  # H declares no value
    assert o.orientation.tolist() == [0, 20 & 15, 0, 0]
    assert not np.asarray(o.rgb)[2].any()


class Tensor:
    """The common interface of PyTorch's tensors and similar arrays."""

    def __init__(self, array):
        self.array, self.dtype, self.shape, self.ndim = (
            array,
            f"torch.{array.dtype}",
            array.shape,
            array.ndim,
        )

    def __dlpack__(self, **options):
        return self.array.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.array.__dlpack_device__()


def test_tensors_of_pytorch_are_accepted():
    pong, rng = ocjax.load("Pong"), np.random.default_rng(0)
    inputs = [
        (pong.rem, (2, 3, 128)),
        (pong.rem, (128,)),
        (pong.vem, (2, 210, 160)),
        (pong.vem, (1, 210, 160, 3)),
    ]
    for extract, shape in inputs:
        data = rng.integers(256, size=shape, dtype=np.uint8)
        repeated = as_strided(data, data.shape, (0, *data.strides[1:]))
        for array in (data, data[::-1], repeated):
            got, want = extract(Tensor(array)), extract(array)
            assert all(
                np.array_equal(getattr(got, name), getattr(want, name))
                for name in ("xywh", "valid", "value", "rgb")
            )
    with pytest.raises(TypeError, match=r"ram must be a uint8 array, got torch\.int64"):
        pong.rem(Tensor(np.zeros(128, np.int64)))
    with pytest.raises(TypeError, match=r"frames must be a uint8 array, got torch\.float32"):
        pong.vem(Tensor(np.zeros((210, 160), np.float32)))


def test_clip_and_where():
    b = box(jnp.array([0, 10, 50]), 5, 8, 8).clip(4, 0, 30, 9)
    assert b.x.tolist() == [4, 10, 50]
    assert b.w.tolist()[:2] == [4, 8]
    assert int(b.h) == 4
    assert b.valid.tolist() == [True, True, False]
    assert b.where(jnp.array([False, True, True])).valid.tolist() == [False, True, False]


def test_layout():
    assert GAME.num_slots == 4
    assert GAME.slices["B"] == slice(1, 3)
    assert GAME.slot_category.tolist() == [0, 1, 1, 2]
    assert GAME.slot_hud.tolist() == [False, False, False, True]
    assert GAME.without_hud().num_slots == 3


def test_aliases():
    game = GAME.replaced(
        categories=(*CATEGORIES[:2], dataclasses.replace(CATEGORIES[2], aliases=("Old", "Older")))
    )
    assert game.slices["Old"] == game.slices["Older"] == game.slices["H"] == slice(3, 4)
    assert "Old" in game.slices
    assert "None" not in game.slices
    assert dict(game.slices) == dict(GAME.slices)
    o = game.rem(np.zeros(128, np.uint8))
    assert o.of("Old").xywh.tolist() == o.of("H").xywh.tolist()
    assert o.to_list()[-1]["category"] == "H"
    assert "Old" not in game.without_hud().slices
    found = matching.from_records([[("Old", 0, 0, 2, 2), ("X", 1, 1, 2, 2)]], game)
    assert found.categories == ("A", "B", "H", "X")
    assert found.label.tolist() == [[2, 3]]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rom": Rom("pong", "xyz")}, "md5"),
        ({"rom": "pong"}, r"must be a Rom\(name, md5\)"),
        ({"name": "no name"}, "name"),
        ({"ram": dict}, "ram"),
        ({"screen": (210, 200)}, "screen"),
        ({"categories": ()}, "categories"),
        ({"categories": CATEGORIES[::-1]}, "come last"),
        ({"categories": (*CATEGORIES, CATEGORIES[0])}, "repeat|last"),
        (
            {"categories": (dataclasses.replace(CATEGORIES[0], aliases=("H",)), *CATEGORIES[1:])},
            "repeat",
        ),
        (
            {
                "categories": (
                    *(dataclasses.replace(c, aliases=("Z",)) for c in CATEGORIES[:2]),
                    CATEGORIES[2],
                )
            },
            "repeat",
        ),
        (
            {"categories": (dataclasses.replace(CATEGORIES[0], aliases=("a b",)), *CATEGORIES[1:])},
            "identifiers",
        ),
        ({"categories": CATEGORIES[1:]}, "must give a box for each"),
        (
            {"categories": (Category("A", Blobs(14), attributes=("speed",)), *CATEGORIES[1:])},
            "attributes",
        ),
        (
            {
                "categories": (
                    Category("A", Bounds(14, ((0, 0, 9, 9), (9, 0, 20, 9)))),
                    *CATEGORIES[1:],
                )
            },
            "its rule has 2 slots",
        ),
        (
            {"categories": (Category("A", Blobs(14, (0, 0, 9, 250))), *CATEGORIES[1:])},
            "reaches down to row 250",
        ),
        (
            {"categories": (Category("A", Blobs((14, 15))), *CATEGORIES[1:])},
            r"colors must be even, .* got \[15\]",
        ),
        (
            {
                "categories": (
                    Category("A", Runs((Run(14, 9, left=(0, 8), width=(1, 9), height=241),), 1)),
                    *CATEGORIES[1:],
                )
            },
            "reaches down to row 250",
        ),
        ({"screen": (256, 160)}, "height below 256"),
        ({"backdrop": (8, 160)}, "backdrop: must be a tuple of columns"),
        ({"categories": (Category("A", Blobs(14), rgb=(1, 2)), *CATEGORIES[1:])}, "rgb must be"),
        (
            {"categories": (Category("A", Blobs(14), needs=("H",)), *CATEGORIES[1:])},
            "needs: 'H' is not a category outside the display",
        ),
        (
            {"categories": (Category("A", Blobs(14), needs="B"), *CATEGORIES[1:])},
            "needs must be a tuple of names, got 'B'",
        ),
        ({"checks": Checks(rare=("Z",))}, r"checks: no categories are named \['Z'\]"),
        ({"checks": Checks(lives=(LivesAsNumber("Z"),))}, r"checks: no categories are named"),
        ({"checks": Checks(agreement={"first": 0.9})}, r"agreement must be of .* got \['first'\]"),
        (
            {"decode": lambda m: decode(m) | {"A": box(jnp.arange(3), 0, 1, 1)}},
            r"decode, A\.x: must have shape",
        ),
        ({"decode": lambda m: decode(m) | {"A": 3}}, "must be a box"),
        ({"decode": lambda m: decode(m) | {"A": box(m.x + 0.5, 0, 1, 1)}}, "decode"),
        ({"decode": lambda m: decode(m) | {"A": box(m.x + (m.x > 3), 0, 1, 1)}}, "promotion"),
        ({"decode": lambda m: decode(m) | {"A": box(m.address, 0, 1, 1)}}, "decode: .*address"),
        ({"decode": lambda m: decode(m) if m.x > 3 else {}}, "decode"),
    ],
)
def test_wrong_games(change, message):
    """A decoder is checked before its first use, everything else on construction."""
    with pytest.raises(GameError, match=message) as caught:
        GAME.replaced(**change).rem(np.zeros(128, np.uint8))
    if change.get("name") is None:
        assert "Test" in str(caught.value)


def test_objects_views():
    ram = np.zeros((3, 128), np.uint8)
    ram[:, 1] = 10, 20, 30
    o = GAME.rem(ram)
    assert o.of("A").x.tolist() == [[10], [20], [30]]
    assert o[1].of("A").center.tolist() == [[22.0, 12.0]]
    assert o.to_list()[2][0] == {
        "category": "A",
        "slot": 0,
        "x": 30,
        "y": 10,
        "w": 4,
        "h": 4,
        "rgb": (236, 236, 236),
        "hud": False,
    }
    assert [r["category"] for r in o[0].to_list()] == ["A", "B", "B", "H"]
    with pytest.raises(ValueError, match="no category 'C'; they have A, B, H"):
        o.of("C")
    v = ocjax.velocity(o[0], o[1])
    assert v.tolist() == [[10.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]


def test_what_vem_does_not_read_is_unknown():
    frame = np.zeros((210, 160), np.uint8)
    frame[100:104, 40:44] = 14  # an A
    frame[50:54, 20:24] = 20  # a B; its second slot stays empty
    seen = GAME.vem(np.stack([frame, np.zeros_like(frame)]))
    assert seen.orientation.tolist() == [[0, UNKNOWN, 0, 0], [0, 0, 0, 0]]
    assert seen.orientation.dtype == np.int8
    record = seen[0].to_list()[1]
    assert record["category"] == "B"
    assert not {"value", "orientation"} & record.keys()
    assert seen.value.tolist() == [[0, UNKNOWN_VALUE, 0, 0], [0, 0, 0, 0]]
    assert views(seen[0])[1].orientation is None
    assert views(seen[0])[1].value is None
    assert GAME.rem(np.zeros(128, np.uint8)).to_list()[1]["orientation"] == 20 & 15


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


def test_figures_of_unequal_height_that_touch():
    rule = Blobs(14, (0, 20, 160, 60), Shape(w=(1, 16), h=(1, 9), split=(8, 9)), then=(Tight(),))
    game = GAME.replaced(categories=(Category("A", rule, count=3), *CATEGORIES[1:]), decode=three)
    frame = np.zeros((210, 160), np.uint8)
    frame[30:38, 26:34], frame[29:37, 34:41] = 14, 14
    frame[40:44, 100:103] = 14
    assert game.vem(frame).xywh[:3].tolist() == [[26, 30, 8, 8], [33, 29, 8, 9], [100, 40, 3, 4]]
    frame[29:37, 34:42] = 14
    assert game.vem(frame).xywh[:3].tolist() == [[26, 30, 8, 8], [34, 29, 8, 8], [100, 40, 3, 4]]


def test_parts_without_pixels_are_dropped():
    """An L in quarters: none at the top right."""
    rule = Blobs(14, (0, 20, 160, 60), Shape(w=(1, 8), h=(1, 8), split=(4, 4)), then=(Tight(),))
    game = GAME.replaced(categories=(Category("A", rule, count=3), *CATEGORIES[1:]), decode=three)
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
    assert game.vem(frame).xywh[:3].tolist() == [[90, 10, 3, 2], [40, 20, 10, 4], [44, 24, 10, 4]]


def three(m):
    return decode(m) | {"A": box(jnp.arange(3), 10, 4, 4)}


def test_digits_and_gauges_are_read():
    """Numbers drawn into a frame, against VEM's values; empty and foreign cells count as 0."""
    font = (
        "75557",
        "22222",
        "71747",
        "71317",
        "55711",
        "74717",
        "44757",
        "71111",
        "75757",
        "75711",
    )
    digits = [
        Digits(hex_font(font, 3, (4, 2)), (left, left + 16, left + 32), top)
        for left, top in ((3, 4), (90, 100))
    ]
    clock = Digits(hex_font(font, 3, (2, 1)), (20, 31), 60, weights=(60, 1))
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
        for j, row in enumerate(font[digit]):
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
    pictures = (
        "75557",
        "22222",
        "71747",
        "71317",
        "55711",
        "74717",
        "44757",
        "71111",
        "71111",
        "75711",
    )
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


def test_screen_saver():
    class Saved(RamMap):
        key = byte(5)

    def decode(m):
        return {"A": box(20, 50, 4, 4), "B": box(60, 50, 4, 4, color=20)}

    saver = Saver(lambda m: jnp.where(m.key > 0, m.key, -1), (0, 0), 4, mask=0xF7, taken=(14,))
    categories = tuple(
        Category(n, Blobs((14, 20, 30), (x, 40, x + 40, 60))) for n, x in (("A", 10), ("B", 50))
    )
    game = GAME.replaced(ram=Saved, categories=categories, decode=decode, saver=saver)
    frames = np.full((4, 210, 160), 4, np.uint8)
    frames[:, 50:54, 20:24] = 14
    frames[:, 50:54, 60:64] = 20
    frames[:, 100:104, 20:24] = 30
    keys = np.array([0, 0x40, 0xA2, 0])
    on = (keys > 0)[:, None, None]
    shown = np.where(on, (frames ^ keys[:, None, None]) & saver.mask, frames).astype(np.uint8)
    rams = np.zeros((4, 128), np.uint8)
    rams[:, 5] = keys
    for objects in (
        game.rem(rams),
        game.vem(shown),
        jax.vmap(game.rem)(rams),
        jax.jit(game.vem)(palette.NTSC[shown]),
    ):
        assert objects.xywh.tolist() == [[[20, 50, 4, 4], [60, 50, 4, 4]]] * 4
        assert np.array_equal(objects.rgb, palette.NTSC[shown[:, 50, [20, 60]]])
    assert np.array_equal(game.vem(shown[:1]).rgb, palette.NTSC[[[14, 20]]])


def test_a_second_pixel_tells_a_saver_from_flashes():
    """While all colours flash in play, either blue or yellow has the bit that the saver drops."""
    blue, yellow, dropped = 0x76, 0xF8, 0x08
    saver = Saver(lambda m: jnp.full((), -1), (0, 0), blue, mask=0xFF ^ dropped, beside=(1, 0))
    frames = np.zeros((256, 210, 160), np.uint8)
    frames[:, 0, :2] = blue, yellow
    keys = np.arange(256).astype(np.uint8)
    flashes = frames ^ keys[:, None, None]
    assert (key_of(jnp.asarray(flashes), saver) == -1).all()
    assert np.array_equal(
        key_of(jnp.asarray(flashes & saver.mask), saver), keys & saver.mask & 0xFE
    )


def test_the_row_off_which_a_color_is_read():
    game = GAME.replaced(
        categories=tuple(
            Category(n, Blobs((14, 20, 30)), color_row=row)
            for n, row in (("A", 0), ("B", 1), ("C", -1), ("D", 9), ("E", -9))
        ),
        decode=lambda m: {n: box(0, 0, 1, 1) for n in "ABCDE"},
    )
    frame = np.zeros((210, 160), np.uint8)
    frame[50:53, 20:24] = np.array([[14], [20], [30]])
    assert np.array_equal(game.vem(frame).rgb, palette.NTSC[[14, 20, 30, 30, 14]])


@pytest.mark.parametrize(
    ("font", "message"),
    [
        (lambda: hex_font(("75557",) * 9, 3), "ten pictures"),
        (lambda: hex_font((*("75557",) * 9, "7555"), 3), "equal height"),
        (lambda: hex_font(("f5557",) * 10, 3), "must fit 3 dots"),
        (lambda: Digits(hex_font(("75557",) * 10, 3), (0,), 0, weights=(1, 2)), "needs one weight"),
        (lambda: Digits(hex_font(("75557",) * 10, 3, (4, 4)), (149,), 0), "on the screen"),
        (
            lambda: Digits(hex_font((*("75557",) * 9, "00000"), 3), (0,), 0, free=(8,)),
            "without an empty picture",
        ),
    ],
)
def test_wrong_fonts(font, message):
    with pytest.raises(ValueError, match=message):
        font()


def test_display():
    rule = Bounds(14, (0, 0, 20, 20))
    assert display("H", rule, doc="d") == Category(
        "H", rule, hud=True, attributes=("value",), doc="d"
    )
    assert display("H", rule, attributes=()) == Category("H", rule, hud=True)
