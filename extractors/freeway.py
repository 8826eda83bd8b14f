"""Freeway: two chickens cross a road of ten lanes.

The leftmost eight columns are always black (the beam's late blank); cars drive in and out under them and over the right edge. The
kerbs, the dashed lines and the copyright line are scenery.

RAM: ALE's source (scores), OCAtari 2.2 and a public disassembly by Bill Heineman (positions, tables), and the ROM's code for the
order of a frame: the upper five lanes move after they have been drawn, the digits are looked up every other frame, so the screen
lags behind the RAM by what just moved.

Covered: all eight modes (lanes of two or three cars at fixed distances, trucks of twice the width, random speeds), both
difficulties, both chickens, collisions, the flashing scores before the end, the end. Car slots: the lanes' first cars from top to
bottom, then the second ones, then the third ones. A truck that shows at both edges has its left piece in its lane's second slot.
Not in the RAM: whether a car of the upper lanes has moved in the one frame in 128 in which it may have changed its speed (modes
4-7); where a chicken was hit, in the one frame in which it is still drawn there but already sent back to the start (difficulty A).
"""

import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax.ram import RamMap, bcd, bits, byte
from ocjax.spec import Blobs, Bounds, Box, Category, Digits, Game, box
from ocjax.vision.palette import NTSC

ROAD = (8, 24, 160, 185)
BLACK, YELLOW, PINK, GREY = 0, 30, 74, 6
CARS = (26, 216, 68, 136, 36, 130, 74, 18, 220, 66)[::-1]  # top lane first
CHICKENS = (44, 108)
LANES = range(9, -1, -1)  # of the RAM's tables, top lane first

GLYPHS = ("3c6666666666663c", "183818181818183c", "3c4606063c60607e", "3c46060c0c06463c", "0c1c2c4c7e0c0c0c",
          "7e60607c0606467c", "3c62607c6666663c", "7e42060c18181818", "3c66663c3c66663c", "3c6666663e06463c")  # fmt: skip


class Ram(RamMap):
    frame = byte(1)
    chicken_y = byte(14, 15)  # 193 - y
    car_kind = bits(*(23 + i for i in LANES), first=0, count=3)  # as the chip knows them: copies and their distance, or double width
    car_pace = bits(*(23 + i for i in LANES), first=4, count=3)  # frames a pixel; 0: two pixels a frame
    car_timer = byte(*(33 + i for i in LANES))  # frames until the next move
    over = byte(102)  # the game has ended, nothing moves
    score = bcd(103, 104)
    clock = byte(105)  # 256 frames each
    chicken_state = byte(106, 107)  # bit 6: hit by a car; 143 and counting when it has just crossed
    car_x = byte(*(108 + i for i in LANES))  # x + 3


def decode(m: Ram) -> dict[str, Box]:
    lifted = (m.chicken_y & 4) != 0
    hit = (m.chicken_state & 64) != 0
    return {
        "Chicken": box(np.array(CHICKENS), 193 - m.chicken_y, jnp.where(lifted | hit, 6, 7), 8),
        "Car": _cars(m),
        "Score": _scores(m),
    }


def _cars(m: Ram) -> Box:
    """The lanes' first cars, the second ones, the third ones."""
    lane, copy = np.arange(30) % 10, np.arange(30) // 10
    moved = (m.over == 0) & (m.car_timer == jnp.maximum(m.car_pace - 1, 0))
    now = m.car_x + jnp.where((lane[:10] < 5) & moved, jnp.where(m.car_pace == 0, 2, 1), 0)
    kind = m.car_kind
    apart = jnp.where(kind == 4, 64, jnp.where((kind & 3) == 2, 32, jnp.where(kind == 5, 0, 16)))
    copies = jnp.where(kind == 0, 1, jnp.where((kind == 3) | (kind == 6), 3, 2))
    first = now + jnp.where(kind == 5, 158, 157)
    # a lane's numbers are computed once for its three cars
    first, apart, copies = (jnp.tile(v, 3) for v in lax.optimization_barrier((first, apart, copies)))
    truck = apart == 0
    x = first + apart * copy
    x = x - 160 * (((x >> 5) * 205 >> 10) + jnp.where(truck, copy, 0))  # that is x // 160 here, at a fraction of its cost
    # where only a column of a car shows, it is its nose of 6 rows or its tail of 8
    nose, tail = np.where(lane < 5, 159, 1), np.where(lane < 5, 1, 159)
    inset = jnp.where(truck, 0, jnp.where(x == nose, 2, jnp.where(x == tail, 1, 0)))
    return box(x, 27 + 16 * lane + inset, jnp.where(truck, 16, 8), 10 - 2 * inset, copy < copies).clip(*ROAD)


def _scores(m: Ram) -> Box:
    """Tight around two digits of 6 pixels, 8 apart; a 1 has 4, a leading zero is not shown."""
    side = jnp.arange(2)
    since = m.chicken_state
    old = (since == 143) | ((since == 142) & ((m.frame & 1) == side))  # the digits are those before the point
    shown = jnp.where(old, m.score - 1, m.score)
    tens = shown * 205 >> 11  # shown // 10
    first = jnp.where(tens == 0, jnp.where(shown == 1, 10, 9), jnp.where(tens == 1, 2, 1))
    last = jnp.where(shown - 10 * tens == 1, 14, 15)
    flash = (m.clock >= 30) & (m.over == 0)
    rgb = jnp.where(flash, jnp.asarray(NTSC)[m.frame], jnp.asarray(NTSC[PINK]))
    return box(40 + 64 * side + first, 5, last - first, 8, value=m.score, rgb=rgb)


def digits(*lefts: int) -> Digits:
    return Digits(lefts, 5, (8, 8), (1, 1), GLYPHS)


GAME = Game(
    name="Freeway",
    rom="freeway",
    md5="8e0ab801b1705a740b476b7f588c6d16",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Chicken",
            Bounds(
                YELLOW,
                tuple((x, 15, x + 7, 195) for x in CHICKENS),
                scenery=tuple((x, y, x + 4, y + 1) for x in CHICKENS for y in (102, 104)),
            ),
            count=2,
            doc="first player's, second player's",
        ),
        Category(
            "Car",
            Blobs((BLACK, *CARS), ROAD, max_size=(16, 10)),
            count=30,
            rgb=tuple(NTSC[c] for c in CARS * 3),
            doc="cars and trucks, up to three a lane",
        ),
        Category(
            "Score",
            Bounds(GREY, ((40, 5, 56, 13), (104, 5, 120, 13)), inverse=True, value=(digits(40, 48), digits(104, 112))),
            count=2,
            attributes=("value",),
            hud=True,
            doc="roads crossed by each player",
        ),
    ),
)
