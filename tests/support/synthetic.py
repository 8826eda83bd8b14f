"""A synthetic game for tests: it uses every rule, every way to read RAM, and every part of a
box."""

import jax.numpy as jnp
import numpy as np

from ocjax.console.boxes import box
from ocjax.console.fonts import DIGITS_3X5, Digits, hex_font, score_box
from ocjax.console.ops import div, lookup, pick
from ocjax.console.ram import RamMap, bcd, bits, byte, high, low, signed
from ocjax.console.registers import packed_position, wrap
from ocjax.console.rom import Rom
from ocjax.extraction.categories import Category, display
from ocjax.extraction.game import Game
from ocjax.vision.filters import NoLines, ShortRuns
from ocjax.vision.rules import Blobs, Bounds, Cells, Gauge, Run, Runs
from ocjax.vision.shades import Shades
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import SideBySide

H, W = 210, 160
GRID_X, GRID_Y = (20, 30, 40, 62), (150, 150, 150, 151)
FONT = hex_font(DIGITS_3X5, dots=3, dot=(4, 2), pitch=16)
TABLE = np.arange(100, 0, -3)
PAIRS = Shape(w=(1, 28), h=(1, 28), pixels=(3, 500), split=(7, 7))
FLOORS = Runs(
    (
        Run(24, 141, left=(0, 159), width=(4, 30), height=3),
        Run((24, 26), 145, left=(9, 98), width=(2, W), height=2),
    ),
    most=1,
)


class Ram(RamMap):
    x = byte(*range(10, 16))
    y = byte(*range(25, 19, -1))
    code = byte(30)
    kind = bits(31, 32, 33, 34, 35, 36, first=1, count=2)
    delta = signed(40, 41)
    nibbles = low(50, 51)
    tops = high(50)
    score = bcd((60, 61))
    word = byte((70, 71))
    flags = byte(80)


def decode(m):
    x, y = wrap(m.x + 20), lookup(TABLE, m.y)
    size = pick(m.kind, (2, 4, 8, 16))
    color = jnp.array([30, 72], jnp.int32)[m.kind & 1]
    present = m.flags >> jnp.arange(4) & 1 == 1
    return {
        "Walker": box(x, y, size, size, m.kind > 0, color=color),
        "Turner": box(
            packed_position(m.code), 40 + m.delta, 8, jnp.array([6, 12]), orientation=m.nibbles
        ).clip(8, 32, 152, 196),
        "Pair": box(jnp.stack([m.x[0], m.x[5]]), 100, 7, 7),
        "Thin": box(div(m.word, 500), 120, 3, 2, m.tops > 3),
        "Background": box(5, 60, 20, 20),
        "Pebble": box(np.array(GRID_X), np.array(GRID_Y), 4, 4, present),
        "Pill": box(np.array(GRID_X) + 40, 170, 3, 3, ~present),
        "Floor": box(m.x[:2] >> 1, np.array((141, 145)), 12, np.array((3, 2)), present[:2]),
        "Link": box(10 + 4 * np.arange(3), 200, 4, 5, present[:3]),
        "Score": score_box(FONT, m.score, right=80, top=4, digits=4, value=m.score),
        "Fuel": box(100, 4, m.tops, 5, value=m.tops),
        "Tank": box(120, 4, 5, m.tops, value=m.tops),
    }


GAME = Game(
    name="Synthetic",
    rom=Rom("pong", "60e0ea3cbe0913d39803477945e9e5ec"),
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Walker",
            Blobs((20, 22), (0, 30, W, 140), Shape(w=(2, 20), h=(2, 20)), gap=(2, 1)),
            count=6,
            doc="dynamic colours",
        ),
        Category(
            "Turner",
            Blobs(40, connectivity=4, filters=(NoLines(12),)),
            count=2,
            attributes=("orientation",),
            doc="any size, 4-connected",
        ),
        Category(
            "Pair", Blobs(60, None, PAIRS, also=(Blobs(62, None, PAIRS),)), count=2, doc="touching"
        ),
        Category(
            "Thin",
            Blobs(
                (80, 82),
                (0, 30, W, 200),
                filters=(ShortRuns(3),),
                first=80,
                exclude=("Pebble",),
                ignore=((0, 30, 9, 60),),
            ),
            doc="low",
        ),
        Category(
            "Background",
            Bounds(0, (5, 60, 40, 90), inverse=True, exclude=("Walker", "Pebble"), min_size=(2, 1)),
            doc="not black",
        ),
        Category(
            "Pebble", Cells(100, GRID_X, GRID_Y, 4, 4, margin=(1, 1)), count=4, doc="whole cells"
        ),
        Category(
            "Pill",
            Cells(
                (100, 102),
                tuple(x + 40 for x in GRID_X),
                (170,) * 4,
                3,
                3,
                whole=False,
                exclude=("Turner",),
            ),
            count=4,
            blinks=True,
            doc="parts of cells",
        ),
        Category("Floor", FLOORS, count=2, doc="runs"),
        Category(
            "Link",
            Bounds((28,), ((0, 199, 80, 205), (80, 199, W, 205)), then=(SideBySide(4),)),
            count=3,
            doc="side by side",
        ),
        display(
            "Score",
            Bounds(120, (24, 4, 80, 14), value=Digits(FONT, (20, 36, 52, 68), 4, required=True)),
            doc="digits",
        ),
        display("Fuel", Bounds((120, 122), (100, 2, 118, 12), value=Gauge(1)), doc="a bar"),
        display(
            "Tank",
            Bounds(122, (120, 2, 126, 22), value=Gauge(2, 1, 3, side="h")),
            doc="an upright bar",
        ),
    ),
    shades=Shades((159, 0), (0, 2), ((40, 28), (28, 42))),
)


def drawn():
    """A frame that shows an object of every category, uint8 `[H, 160]`."""
    frame = np.zeros((H, W), np.uint8)

    def fill(color, x, y, w, h):
        frame[y : y + h, x : x + w] = color

    fill(20, 50, 40, 4, 4)
    fill(22, 55, 40, 3, 5)  # within the gap
    fill(40, 100, 60, 9, 3)
    fill(60, 100, 100, 7, 7)
    fill(62, 107, 100, 7, 7)  # touches, in another colour
    fill(80, 30, 120, 6, 2)
    fill(14, 10, 70, 5, 5)
    fill(100, GRID_X[1], GRID_Y[1], 4, 4)
    fill(102, GRID_X[2] + 41, 171, 1, 2)
    for cell, digit in enumerate((1, 9, 8, 4)):
        for row, bits_ in enumerate(FONT.glyphs[digit]):
            for dot in range(3):
                if bits_ >> (2 - dot) & 1:
                    fill(120, 20 + 16 * cell + 4 * dot, 4 + 2 * row, 4, 2)
    fill(24, 20, 141, 10, 3)
    fill(26, 30, 145, 6, 2)
    fill(28, 12, 200, 8, 5)
    fill(122, 100, 4, 9, 5)
    fill(122, 120, 4, 5, 11)
    return frame
