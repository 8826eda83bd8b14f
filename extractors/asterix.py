"""Asterix: the hero on a stage of eight lanes; through each lane runs a lyre, something to eat, or the points that it gave.

Slots of Enemy, Consumable and Reward are the lanes from the top. Asterix gives way to Obelix in the later stages, whose things are
helmets, shields, lamps, apples, fish, meat and mugs. Scenery: the stage itself. A picture of Obelix fills the screen between the two.

RAM: ALE's source (score, lives, death), OCAtari 2.2 (positions), and the ROM's display program: it runs down a pointer into the
pictures for every lane, so that these pointers tell after the frame which picture was drawn. VEM's Reward and Consumable
come in raster order; it sees helmets and lamps a column or a row too small, as one of their rows has another object's colour.

Covered: all stages and things, both heroes, deaths (the hero is twice as wide), up to eight lives (three icons at most), the picture
between, the game's end and its first frame, which is empty. There is one mode and one difficulty. Lives is not shown with the last one.
"""

import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box
from ocjax.digits import Digits, hex_font
from ocjax.game import Game
from ocjax.ram import RamMap, bcd, byte
from ocjax.rules import Blobs, Bounds, Category, Gauge

YELLOW, PINK = 24, 74
BORDERS = (88, 120, 216, 56, 40, 152, 136, 72, 50, 104)  # of the rewards, around digits in 8
THINGS = (
    68,
    66,
    12,
    14,
    76,
    214,
    88,
)  # without the few rows in the colours of the hero or of rewards
LANES = (0, 26, 160, 149)
TOPS = range(26, 150, 16)
FLOORS = tuple((0, y + 11, 160, y + 16) for y in TOPS)
GLYPHS = ("3c66666666663c", "3878181818187e", "7c46063c60607e", "3c46060c06463c", "0c1c2c4c7e0c0c",
          "7e60607c06467c", "3c62607c66663c", "7e620204081818", "3c66663c66663c", "3c66663e06463c")  # fmt: skip
# Tight boxes of the things, a nibble for each of eight: how much left, right, top and bottom of 8 x 11 pixels is empty.
LEFT, RIGHT, TOP, BOTTOM = 0x01000111, 0x12000200, 0x00400001, 0x00200000
LYRE = 204  # and 216, turned


class Ram(RamMap):
    icon = byte(9)  # pointer into the hero's pictures: 0, 12 Asterix, 36, 48 Obelix
    hero = byte(10)  # the same; 11 more: not drawn
    picture = byte(*range(18, 10, -1))  # pointers into the lanes' pictures, 12 each; 11: nothing
    screen = byte(6)  # 0: the stage
    y = byte(40)  # of the hero, 151 - y
    x = byte(41)
    lane_x = byte(*range(42, 50))
    death = byte(71)  # counts 126 to 0
    lives = byte(83)
    score = bcd((94, 95, 96))


def decode(m: Ram) -> dict[str, Box]:
    drawn = (m.screen == 0) & (m.picture[0] != 0) & (m.hero & 3 == 0)
    p, top = m.picture, np.array(TOPS)
    lyre = p >= LYRE
    thing = jnp.clip(p - 108, 0, 84) * 43 >> 9 << 2  # shift of the thing's nibble
    left, right, up, down = (t >> thing & 15 for t in (LEFT, RIGHT, TOP, BOTTOM))
    wide = (m.death >= 79) & (m.death <= 125)
    slim = jnp.where(m.hero >= 36, 1, 0)
    icons = jnp.clip(m.lives - 1, 0, 3)
    digits = 1 + sum(jnp.where(m.score >= 10**k, 1, 0) for k in range(1, 6))
    return {
        "Player": box(
            m.x + jnp.where(wide, 1 + 2 * slim, slim),
            151 - m.y,
            jnp.where(wide, 16 - 4 * slim, 8 - 2 * slim),
            11,
            drawn,
        ),
        "Enemy": box(m.lane_x + jnp.where(p == LYRE, 0, 1), top, 7, 11, lyre & drawn),
        "Consumable": box(
            m.lane_x + left, top + up, 8 - left - right, 11 - up - down, (p >= 108) & ~lyre & drawn
        ),
        "Reward": box(m.lane_x, top, jnp.where(p == 12, 6, 8), 11, (p >= 12) & (p <= 72) & drawn),
        "Score": box(102 - 8 * digits + 2, 184, 8 * digits - 2, 7, drawn, value=m.score),
        "Lives": box(
            60 + slim, 169, 16 * icons - 8 - 2 * slim, 11, (icons > 0) & drawn, value=m.lives
        ),
    }


GAME = Game(
    name="Asterix",
    rom="asterix",
    md5="89a68746eff7f266bbf08de2483abe55",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            Blobs(YELLOW, LANES, min_size=(5, 9), max_size=(16, 11)),
            doc="Asterix, later Obelix",
        ),
        Category(
            "Enemy",
            Bounds(PINK, tuple((0, y, 160, y + 11) for y in TOPS), min_size=(3, 9)),
            count=8,
            doc="lyres, by lane",
        ),
        Category(
            "Consumable",
            Blobs(THINGS, LANES, gap=(1, 1), min_size=(4, 5), max_size=(8, 11), ignore=FLOORS),
            count=8,
            doc="what to eat, by lane",
        ),
        Category(
            "Reward",
            Blobs(
                (8, *BORDERS), LANES, gap=(1, 1), min_size=(4, 9), max_size=(8, 11), ignore=FLOORS
            ),
            count=8,
            doc="points given, by lane",
        ),
        Category(
            "Score",
            Bounds(
                YELLOW,
                (54, 184, 104, 191),
                value=Digits(hex_font(GLYPHS, 8, (1, 1)), (55, 63, 71, 79, 87, 95), 184),
            ),
            hud=True,
            attributes=("value",),
            doc="points",
        ),
        Category(
            "Lives",
            Bounds(YELLOW, (60, 169, 100, 180), value=Gauge(16, 6, 2)),
            hud=True,
            attributes=("value",),
            doc="icons; value: lives",
        ),
    ),
)
