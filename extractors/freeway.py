"""Freeway: two chickens cross a road of ten lanes.

Picture: docs/games/Freeway.png

Screen: the beam's late blank keeps the leftmost eight columns black. Cars drive in and out under
them and over the right edge. The kerbs, the dashed lines and the copyright line are scenery.

Slots: Car has the lanes' first cars from top to bottom, then the second ones, then the third ones.
A truck at both edges has its left piece in its lane's second slot.

RAM: ALE's source (scores), OCAtari 2.2 and a public disassembly by Bill Heineman (positions,
tables), and the ROM's code for the order of a frame. The upper five lanes move after the drawing,
and the game looks up the digits on every other frame. The screen lags behind the RAM by these
moves.

Covered: all eight modes (lanes of two or three cars at fixed distances, trucks of twice the width,
random speeds), both difficulties, both chickens, collisions, the flashing scores before the end,
the end.

Not exact: in modes 4-7 a car's speed may change on one frame in 128. The RAM does not show if a car
of the upper lanes has moved on that frame. A chicken that was hit (difficulty A) is still drawn
there for one frame, but the RAM already has it at the start.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Digits,
    Game,
    NumberDisplay,
    RamMap,
    Rom,
    Shape,
    Variants,
    bcd,
    bits,
    box,
    byte,
    display,
    match,
    modulo_screen,
    pick,
    score_box,
    when,
)

ROM = Rom("freeway", "8e0ab801b1705a740b476b7f588c6d16")
FONT = ROM.font(0x700, rows=8)

ROAD = (8, 24, 160, 185)
BLACK = 0
YELLOW = 30
PINK = 74
GRAY = 6
CAR_COLORS = (66, 220, 18, 74, 130, 36, 136, 68, 216, 26)  # of each lane, top lane first
CHICKEN_LEFTS = (44, 108)
DASHES = tuple((x, y, x + 4, y + 1) for x in CHICKEN_LEFTS for y in (102, 104))
SCORES = tuple(NumberDisplay(FONT, right, top=5, digits=2) for right in (56, 120))

TABLE_ORDER = range(9, -1, -1)  # of the lanes in the RAM's tables, top lane first
UPPER = 5  # lanes that move after the drawing
CLOCK_FLASHES = 30  # least `clock` while the scores flash


class Chicken:  # of `Ram.chicken_state`
    JUST_CROSSED = 143  # the digits still show the score before
    SHOWN_NEXT = 142  # one side's digits still show it, alternately
    HIT = 64  # a bit


class Kind:  # of `Ram.car_kind`: NUSIZ
    TRUCK = 5  # a single player of twice the width


# By kind. A lane has no players of four times the width, which would be the last kind.
LANE_COPIES = (1, 2, 2, 3, 2, 2, 3, 2)  # a truck counts as two cars, its pieces at both edges
LANE_SPACING = (16, 16, 32, 16, 64, 0, 32, 16)  # pixels from a car to the next one; 0: a truck


class Ram(RamMap):
    frame = byte(1)
    chicken_y = byte(14, 15)  # 193 - y
    car_kind = bits(*(23 + i for i in TABLE_ORDER), first=0, count=3)  # copies or double width
    car_pace = bits(*(23 + i for i in TABLE_ORDER), first=4, count=3)  # frames per pixel; 0: two
    car_timer = byte(*(33 + i for i in TABLE_ORDER))  # frames until the next move
    over = byte(102)  # the game has ended, nothing moves
    score = bcd(103, 104)
    clock = byte(105)  # 256 frames each
    chicken_state = byte(106, 107)
    car_x = byte(*(108 + i for i in TABLE_ORDER))  # x + 3


def decode(m: Ram) -> dict[str, Box]:
    return {"Chicken": _chickens(m), "Car": _cars(m), "Score": _score_boxes(m)}


def _chickens(m: Ram) -> Box:
    lifted = (m.chicken_y & 4) != 0  # with its feet up: the narrower of two pictures
    hit = (m.chicken_state & Chicken.HIT) != 0
    return box(np.array(CHICKEN_LEFTS), 193 - m.chicken_y, jnp.where(lifted | hit, 6, 7), 8)


def _cars(m: Ram) -> Box:
    """The lanes' first cars, the second ones, the third ones."""
    lane = np.arange(30) % 10
    copy = np.arange(30) // 10
    first, spacing, copies = _lanes(m)
    truck = jnp.tile(spacing == 0, 3)
    at = jnp.tile(first, 3) + jnp.tile(spacing, 3) * copy
    x = modulo_screen(at) - jnp.where(truck, 160 * copy, 0)
    # A single visible column of a car is its nose of 6 rows or its tail of 8.
    nose = np.where(lane < UPPER, 159, 1)
    tail = np.where(lane < UPPER, 1, 159)
    inset = match((truck, 0), (x == nose, 2), (x == tail, 1), otherwise=0)
    width = jnp.where(truck, 16, 8)
    y = 27 + 16 * lane + inset
    height = 10 - 2 * inset
    color = np.array(CAR_COLORS)[lane]
    return box(x, y, width, height, copy < jnp.tile(copies, 3), color=color).clip(*ROAD)


def _lanes(m: Ram) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Each lane's x + 160 of its first car as drawn, pixels to the next one, number of cars."""
    moved = (m.over == 0) & (m.car_timer == jnp.maximum(m.car_pace - 1, 0))
    step = when(moved & (np.arange(10) < UPPER), jnp.where(m.car_pace == 0, 2, 1))
    truck = m.car_kind == Kind.TRUCK
    first = m.car_x + step + jnp.where(truck, 158, 157)
    return first, pick(m.car_kind, LANE_SPACING), pick(m.car_kind, LANE_COPIES)


def _score_boxes(m: Ram) -> Box:
    crossed = m.chicken_state == Chicken.JUST_CROSSED
    waits = (m.frame & 1) == np.arange(2)
    old = crossed | ((m.chicken_state == Chicken.SHOWN_NEXT) & waits)
    flash = (m.clock >= CLOCK_FLASHES) & (m.over == 0)
    return score_box(
        FONT,
        jnp.where(old, m.score - 1, m.score),
        right=np.array([score.right for score in SCORES]),
        top=SCORES[0].top,
        digits=SCORES[0].digits,
        value=m.score,
        color=jnp.where(flash, m.frame, PINK),
    )


GAME = Game(
    name="Freeway",
    rom=ROM,
    ram=Ram,
    decode=decode,
    variants=Variants(
        modes={
            0: "one car in each lane",
            1: "two cars in each lane, and a few trucks",
            2: "two or three cars in each lane, and a few trucks",
            3: "one truck in each lane",
            4: "as 0, with speeds that change at random",
            5: "as 1, with speeds that change at random",
            6: "as 2, with speeds that change at random",
            7: "as 3, with speeds that change at random",
        },
        difficulties={
            0: "a hit knocks the chicken back by a lane",
            1: "a hit sends the chicken back to the start",
        },
        source="Activision's manual, and play of all modes in the emulator",
    ),
    categories=(
        Category(
            "Chicken",
            Bounds(YELLOW, tuple((x, 15, x + 7, 195) for x in CHICKEN_LEFTS), ignore=DASHES),
            count=2,
            role="player",
            doc="first player's, second player's",
        ),
        Category(
            "Car",
            Blobs((BLACK, *CAR_COLORS), ROAD, Shape(w=(1, 16), h=(1, 10))),
            count=30,
            color_row=1,  # under the black row
            doc="cars and trucks, up to three a lane",
        ),
        display(
            "Score",
            Bounds(
                GRAY,
                tuple(score.area for score in SCORES),
                inverse=True,
                value=tuple(Digits(FONT, score.lefts, score.top) for score in SCORES),
            ),
            count=2,
            role="score",
            doc="roads crossed by each player",
        ),
    ),
)
