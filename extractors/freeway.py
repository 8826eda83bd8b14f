"""Freeway: two chickens cross a road of ten lanes.

The leftmost eight columns are always black (the beam's late blank); cars drive in and out under
them and over the right edge. The kerbs, the dashed lines and the copyright line are scenery.

RAM: ALE's source (scores), OCAtari 2.2 and a public disassembly by Bill Heineman (positions,
tables), and the ROM's code for the order of a frame: the upper five lanes move after they have been
drawn, and the digits are looked up every other frame, so the screen lags behind the RAM by what
has just moved.

Car slots: the lanes' first cars from top to bottom, then the second ones, then the third ones. A
truck that shows at both edges has its left piece in its lane's second slot.

Covered: all eight modes (lanes of two or three cars at fixed distances, trucks of twice the width,
random speeds), both difficulties, both chickens, collisions, the flashing scores before the end,
the end. Not in the RAM: whether a car of the upper lanes has moved in the one frame in 128 in which
it may have changed its speed (modes 4-7); where a chicken was hit, in the one frame in which it is
still drawn there but already sent back to the start (difficulty A).
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.registers import modulo_screen
from ocjax.console.rom import Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Blobs, Bounds
from ocjax.vision.shapes import Shape

ROM = Rom("freeway", "8e0ab801b1705a740b476b7f588c6d16")
FONT = ROM.font(0x700, rows=8)

ROAD = (8, 24, 160, 185)
BLACK = 0
YELLOW = 30
PINK = 74
GREY = 6
CARS = (66, 220, 18, 74, 130, 36, 136, 68, 216, 26)  # colour of each lane's cars, top lane first
CHICKENS = (44, 108)  # left columns
DASHES = tuple((x, y, x + 4, y + 1) for x in CHICKENS for y in (102, 104))
SCORE_RIGHTS = (56, 120)
SCORE_TOP = 5

LANES = range(9, -1, -1)  # of the RAM's tables, top lane first
UPPER = 5  # lanes that move after they have been drawn
TRUCK = 5  # NUSIZ of a player of twice the width
CLOCK_FLASHES = 30  # from here on the scores flash
# states of a chicken: the digits still lag behind
JUST_CROSSED = 143
SHOWN_NEXT = 142
HIT = 64  # bit of a chicken's state


class Ram(RamMap):
    frame = byte(1)
    chicken_y = byte(14, 15)  # 193 - y
    car_kind = bits(*(23 + i for i in LANES), first=0, count=3)  # NUSIZ: copies or double width
    car_pace = bits(*(23 + i for i in LANES), first=4, count=3)  # frames a pixel; 0: two pixels
    car_timer = byte(*(33 + i for i in LANES))  # frames until the next move
    over = byte(102)  # the game has ended, nothing moves
    score = bcd(103, 104)
    clock = byte(105)  # 256 frames each
    chicken_state = byte(106, 107)
    car_x = byte(*(108 + i for i in LANES))  # x + 3


def decode(m: Ram) -> dict[str, Box]:
    return {"Chicken": _chickens(m), "Car": _cars(m), "Score": _scores(m)}


def _chickens(m: Ram) -> Box:
    lifted = (m.chicken_y & 4) != 0  # its feet: the narrower of two pictures
    hit = (m.chicken_state & HIT) != 0
    return box(np.array(CHICKENS), 193 - m.chicken_y, jnp.where(lifted | hit, 6, 7), 8)


def _cars(m: Ram) -> Box:
    """The lanes' first cars, the second ones, the third ones."""
    lane, copy = np.arange(30) % 10, np.arange(30) // 10
    first, spacing, copies = (jnp.tile(v, 3) for v in _lanes(m))
    truck = spacing == 0
    x = modulo_screen(first + spacing * copy) - jnp.where(truck, 160 * copy, 0)
    # Where a single column of a car shows, it is its nose of 6 rows or its tail of 8.
    nose, tail = np.where(lane < UPPER, 159, 1), np.where(lane < UPPER, 1, 159)
    inset = jnp.where(truck, 0, jnp.where(x == nose, 2, jnp.where(x == tail, 1, 0)))
    width = jnp.where(truck, 16, 8)
    y, height, color = 27 + 16 * lane + inset, 10 - 2 * inset, np.array(CARS)[lane]
    return box(x, y, width, height, copy < copies, color=color).clip(*ROAD)


def _lanes(m: Ram) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Of each lane: x + 160 of its first car as drawn, pixels to the next one, number of cars.

    A truck counts as two cars, its pieces at both edges.
    """
    moved = (m.over == 0) & (m.car_timer == jnp.maximum(m.car_pace - 1, 0))
    step = jnp.where((np.arange(10) < UPPER) & moved, jnp.where(m.car_pace == 0, 2, 1), 0)
    kind = m.car_kind
    wide = jnp.where((kind & 3) == 2, 32, jnp.where(kind == TRUCK, 0, 16))
    spacing = jnp.where(kind == 4, 64, wide)
    copies = jnp.where(kind == 0, 1, jnp.where((kind == 3) | (kind == 6), 3, 2))
    return m.car_x + step + jnp.where(kind == TRUCK, 158, 157), spacing, copies


def _scores(m: Ram) -> Box:
    state = m.chicken_state
    old = (state == JUST_CROSSED) | ((state == SHOWN_NEXT) & ((m.frame & 1) == np.arange(2)))
    flash = (m.clock >= CLOCK_FLASHES) & (m.over == 0)
    return score_box(
        FONT,
        jnp.where(old, m.score - 1, m.score),
        right=np.array(SCORE_RIGHTS),
        top=SCORE_TOP,
        digits=2,
        value=m.score,
        color=jnp.where(flash, m.frame, PINK),
    )


def _number(right: int) -> Digits:
    return Digits(FONT, (right - 16, right - 8), SCORE_TOP)


GAME = Game(
    name="Freeway",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Chicken",
            Bounds(YELLOW, tuple((x, 15, x + 7, 195) for x in CHICKENS), ignore=DASHES),
            count=2,
            doc="first player's, second player's",
        ),
        Category(
            "Car",
            Blobs((BLACK, *CARS), ROAD, Shape(w=(1, 16), h=(1, 10))),
            count=30,
            color_row=1,  # under the black one
            doc="cars and trucks, up to three a lane",
        ),
        display(
            "Score",
            Bounds(
                GREY,
                tuple((right - 16, SCORE_TOP, right, SCORE_TOP + 8) for right in SCORE_RIGHTS),
                inverse=True,
                value=tuple(_number(right) for right in SCORE_RIGHTS),
            ),
            count=2,
            doc="roads crossed by each player",
        ),
    ),
)
