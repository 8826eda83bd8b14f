"""Declarations of game files, and the errors of wrong declarations."""

import dataclasses

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
from ocjax.extraction.game import GameError
from ocjax.extraction.saver import key_of
from ocjax.transforms.game_objects import views
from ocjax.vision.rules import Blobs, Bounds, Run, Runs
from ocjax.vision.shades import Saver
from ocjax.vision.unknown import UNKNOWN, UNKNOWN_VALUE
from tests.support.small_game import CATEGORIES, GAME, decode

pytestmark = pytest.mark.usefixtures("quick_compilation")


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
