"""What a game file may declare, and how it is told when it may not."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

import ocjax
from ocjax.ram import RamMap, byte
from ocjax.spec import Blobs, Bounds, Category, Cells, Game, GameError, box


class Ram(RamMap):
    x = byte(1)
    ys = byte(2, 3)


def decode(m):
    return {"A": box(m.x, 10, 4, 4), "B": box(30, m.ys, 200, 5, value=m.ys, orientation=jnp.int32(20)), "H": box(-3, -3, 5, 5, value=7)}


CATEGORIES = (
    Category("A", Blobs(14)),
    Category("B", Blobs((20, 22)), count=2, attributes=("value", "orientation")),
    Category("H", Bounds(14, (0, 0, 20, 20)), hud=True),
)
GAME = Game(name="Test", rom="pong", md5="0" * 32, ram=Ram, decode=decode, categories=CATEGORIES)


def test_boxes_are_clipped_and_zeroed():
    ram = np.zeros(128, np.uint8)
    ram[[1, 2, 3]] = 158, 208, 250
    o = GAME.rem(ram)
    assert o.xywh.tolist() == [[158, 10, 2, 4], [30, 208, 130, 2], [0, 0, 0, 0], [0, 0, 2, 2]]
    assert o.valid.tolist() == [True, True, False, True]
    assert o.value.tolist() == [0, 208, 0, 0]  # H declares no value
    assert o.orientation.tolist() == [0, 20 & 15, 0, 0]
    assert not np.asarray(o.rgb)[2].any()


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


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"md5": "xyz"}, "md5"),
        ({"name": "no name"}, "name"),
        ({"ram": dict}, "ram"),
        ({"screen": (210, 200)}, "screen"),
        ({"categories": ()}, "categories"),
        ({"categories": CATEGORIES[::-1]}, "come last"),
        ({"categories": (*CATEGORIES, CATEGORIES[0])}, "repeat|last"),
        ({"categories": CATEGORIES[1:]}, "must give a box for each"),
        ({"categories": (Category("A", Blobs(14), attributes=("speed",)), *CATEGORIES[1:])}, "attributes"),
        ({"categories": (Category("A", Bounds(14, ((0, 0, 9, 9), (9, 0, 20, 9)))), *CATEGORIES[1:])}, "its rule has 2 slots"),
        ({"categories": (Category("A", Blobs(14, (0, 0, 9, 250))), *CATEGORIES[1:])}, "reaches down to row 250"),
        ({"categories": (Category("A", Blobs(14), rgb=(1, 2)), *CATEGORIES[1:])}, "rgb"),
        ({"decode": lambda m: decode(m) | {"A": box(jnp.arange(3), 0, 1, 1)}}, r"decode, A\.x: must have shape"),
        ({"decode": lambda m: decode(m) | {"A": 3}}, "must be a box"),
        ({"decode": lambda m: decode(m) | {"A": box(m.x + 0.5, 0, 1, 1)}}, "decode"),
        ({"decode": lambda m: decode(m) | {"A": box(m.x + (m.x > 3), 0, 1, 1)}}, "promotion"),
        ({"decode": lambda m: decode(m) | {"A": box(m.address, 0, 1, 1)}}, "address"),
        ({"decode": lambda m: decode(m) if m.x > 3 else {}}, "decode"),
    ],
)
def test_wrong_games(change, message):
    with pytest.raises(GameError, match=message) as caught:
        dataclasses.replace(GAME, **change)
    if change.get("name") is None:
        assert "Test" in str(caught.value)


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        (lambda: Blobs(256), "palette indices"),
        (lambda: Blobs(()), "palette indices"),
        (lambda: Blobs(14, (10, 0, 5, 20)), "region"),
        (lambda: Blobs(14, (0, 0, 161, 20)), "region"),
        (lambda: Blobs(14, connectivity=6), "connectivity"),
        (lambda: Blobs(14, connectivity=4, join=(1, 0)), "join needs"),
        (lambda: Blobs(14, join=(40, 0)), "join must"),
        (lambda: Bounds(((14,), (15,)), (0, 0, 9, 9)), "colors for 2 regions"),
        (lambda: Cells(14, (1, 2), (1,), 2, 2), "one entry a slot"),
        (lambda: Cells(14, (159,), (1,), 2, 2), "on the screen"),
    ],
)
def test_wrong_rules(rule, message):
    with pytest.raises(ValueError, match=message):
        rule()


def test_objects_views():
    ram = np.zeros((3, 128), np.uint8)
    ram[:, 1] = 10, 20, 30
    o = GAME.rem(ram)
    assert o.of(GAME, "A").x.tolist() == [[10], [20], [30]]
    assert o[1].of(GAME, "A").center.tolist() == [[22.0, 12.0]]
    assert o.to_list()[2][0] == {"category": "A", "slot": 0, "x": 30, "y": 10, "w": 4, "h": 4, "rgb": (236, 236, 236), "hud": False}
    assert [r["category"] for r in o[0].to_list()] == ["A", "B", "B", "H"]
    with pytest.raises(ValueError, match="no category 'C'; it has A, B, H"):
        o.of(GAME, "C")
    v = ocjax.velocity(o[0], o[1])
    assert v.tolist() == [[10.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]]
