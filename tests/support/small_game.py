"""A small game with three categories, which tests change."""

import jax.numpy as jnp

from ocjax.console.boxes import box
from ocjax.console.ram import RamMap, byte
from ocjax.console.rom import Rom
from ocjax.extraction.categories import Category, display
from ocjax.extraction.game import Game
from ocjax.vision.rules import Blobs, Bounds


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


def three(m):
    return decode(m) | {"A": box(jnp.arange(3), 10, 4, 4)}
