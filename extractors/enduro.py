"""Enduro: a race by day, on snow, at night and in fog, past 200 cars on the first day, then 300.

Picture: docs/games/Enduro.png

Screen: the beam's late blank hides the eight columns at the left edge. The road, mountains, the
board with its car or flags, and the maker's name are scenery. At night, the game draws only the
cars' lights.

Slots: cars have numbers in the order of passing. A car keeps the slot of its number, modulo 8, also
when it comes nearer by a row.

RAM: ALE's source (cars left, day), OCAtari and AtariARI (meaning of some bytes), and the ROM's
code. A step of the game (f28d-f6fa) ends with the vertical sync, and the game draws its results
afterwards. Therefore the frame is a step older than the RAM, except the bytes that the drawing
leaves: the positions of the road and the cars, and their pictures. From these and the speed,
`as_drawn` computes the player's position and the scroll of the rows.

Covered: complete first days in play, with snow, night and fog, and the end of the game. RAM was
edited for other days, and for days on which all cars are passed. The game has one mode.
NumberOfCars is not valid after all cars are passed.

Not exact: the colour of a car on its last frame in the nearest row. Cars hidden by fog are not
reported. The numbers are the next frame's.

VEM: it does not read the odometer while its digits roll. If the player is in front of a car or
touches a line of the road, boxes may be too small or too large.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Bitmap,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Digits,
    Font,
    Game,
    NumberDisplay,
    RamMap,
    Rom,
    Shape,
    ShortRuns,
    bcd,
    box,
    byte,
    choose,
    display,
    div,
    flag,
    lookup,
    match,
    packed_position,
    signed,
    when,
)

ROM = Rom("enduro", "94b92a882f6dbaa6993a46e2dcc58402")
VIEW = (8, 52, 160, 155)
GROUND = 155  # row at height 0; heights count upwards
CAR_ROWS = 7  # nearest first
CAR_SLOTS = 8

CAR_X = 8  # column of a sprite less its position


class Look(NamedTuple):
    """A picture of a car."""

    address: int
    height: int
    zoom: int = 1  # columns of a dot


# Pictures by row. At night, only the lights are visible.
BY_DAY = (
    Look(0xE38, 11, 2),
    Look(0xE6A, 8, 2),
    Look(0xE9B, 6),
    Look(0xEA9, 4),
    Look(0xECF, 3),
    Look(0xED8, 2),
    Look(0xEDD, 1),
)
AT_NIGHT = (
    Look(0xE58, 3, 2),
    Look(0xE58, 3, 2),
    Look(0xEC6, 2),
    Look(0xEC6, 2),
    Look(0xEB5, 2),
    Look(0xEB5, 2),
    Look(0xEDD, 1),
)
# Low bytes of the addresses in each row's section. Sections begin at heights in a table, 8 bytes
# for each scroll.
STARTS_BY_DAY = ROM.bytes(0xDA9, CAR_ROWS)
STARTS_AT_NIGHT = ROM.bytes(0xDB1, CAR_ROWS)
ROAD_SECTIONS = ROM.bytes(0xD01, 128)


def _columns(look: Look) -> tuple[int, int]:
    """First column and width of a picture; wide dots begin a column later."""
    dots = int(np.bitwise_or.reduce(ROM.bytes(look.address, look.height)))
    left = 8 - dots.bit_length()
    right = 8 - (dots & -dots).bit_length() + 1
    return CAR_X + look.zoom * left + look.zoom - 1, look.zoom * (right - left)


def _extents(of_looks: Sequence[Look]) -> np.ndarray:
    """Low bytes of addresses, heights, first columns and widths of pictures."""
    return np.array([(look.address & 255, look.height, *_columns(look)) for look in of_looks]).T


LOOKS = np.stack([_extents(BY_DAY), _extents(AT_NIGHT)])
FIRST_FRAME = 0xFFFF  # `frames_left` after the first step; its frame has no numbers

ASLANT = 4  # rows of the nearest car if the last row has a wheel on one side only

PLAYER_LOW = 0x38
PLAYER_HEIGHT = 11
PLAYER_X = 113  # column without steering
ROAD_X = 104  # position of the road's code minus the sum of the steering and the road
NO_CAR = 4  # `car_x` of a row without a car

ROM_FONT = ROM.font(0xF02, rows=7, stride=8)
GLYPHS = Font(tuple(tuple(row ^ 0xFF for row in glyph) for glyph in ROM_FONT.glyphs))
CARS_LEFT = NumberDisplay(GLYPHS, right=104, top=180, digits=3)
ONE_DIGIT_DAY = NumberDisplay(GLYPHS, right=64, top=180, digits=1)
TWO_DIGIT_DAY = NumberDisplay(GLYPHS, right=72, top=180, digits=2)
WHOLE = NumberDisplay(GLYPHS, right=96, top=165, digits=4, leading_zeros=True)  # of the odometer
ODOMETER_AREA = (64, 164, 104, 173)

GRAY = 10
BLACK = 0
PLATE = 40  # around the black digits, which are gaps in it
CAR_COLORS = tuple(range(22, 256, 16))


class Ram(RamMap):
    car_x = byte(*range(3, 10))  # codes of positions, by row
    car_pictures = byte(*range(11, 18))  # low bytes of addresses, less the height of the section
    speed = byte(22)
    distance = byte(24)
    scroll = byte(25)  # of the rows, already the next frame's
    cars = byte(*range(27, 34))  # colours of the rows, 0: no car; already the next frame's
    road = byte(34)  # the road's position relative to the player
    odometer = bcd((42, 41, 40))
    cars_left = bcd((44, 43))
    day = bcd(45)
    faster = signed(50)  # than the other cars
    frames_left = byte((49, 48))  # of four days
    picture = byte(52)  # low byte of the player's address, less the height
    mirrored = flag(66, bit=2)  # the other cars
    road_x = byte(70)  # code of the sum of the player's and the road's position
    passed = byte(71)  # cars


def decode(m: Ram) -> dict[str, Box]:
    d = as_drawn(m)
    begun = m.frames_left < FIRST_FRAME
    return {
        "Player": _player_box(m, d),
        "Car": _car_boxes(m, d),
        "NumberOfCars": CARS_LEFT.box(m.cars_left, valid=begun & (m.cars_left > 0)),
        "Level": _level(m).where(begun),
        "Odometer": _odometer_box(m),
    }


class Drawn(NamedTuple):
    """The state at the drawing of the frame."""

    scroll: jax.Array  # of the rows
    steering: jax.Array
    colors: jax.Array  # of the rows' cars
    passed: jax.Array  # number of the nearest car


def as_drawn(m: Ram) -> Drawn:
    """Revert the last step, which may have moved cars to other rows."""
    moved = m.distance + m.speed < 256
    scroll = m.scroll + when(moved, m.faster) & 255
    nearer = moved & (m.faster >= 0) & (scroll < m.faster)
    farther = moved & (m.faster < 0) & (scroll >= m.faster + 256)
    first = m.cars[:1]
    last = m.cars[-1:]
    colors = match(
        (nearer, jnp.concatenate([first, m.cars[:-1]])),
        (farther, jnp.concatenate([m.cars[1:], last])),
        otherwise=m.cars,
    )
    has_passed = nearer & (m.car_x[0] != NO_CAR)
    passed = m.passed + when(has_passed, 1) - when(farther & (m.cars[0] > 0), 1)
    steering = packed_position(m.road_x) - ROAD_X - m.road & 255
    return Drawn(scroll, steering, colors & 0xFE, passed)


def _player_box(m: Ram, d: Drawn) -> Box:
    lean = (d.steering + 65 & 255) >> 4
    x = PLAYER_X - lean - (d.steering + 64 >> 1 & 127)
    y = GROUND - (PLAYER_LOW - m.picture) - PLAYER_HEIGHT + 1
    return box(x, y, 16, PLAYER_HEIGHT).clip(*VIEW)


def _level(m: Ram) -> Box:
    return choose(m.day < 10, ONE_DIGIT_DAY.box(m.day), TWO_DIGIT_DAY.box(m.day))


def _odometer_box(m: Ram) -> Box:
    """The four digits, and the black cell of the rolling fifth one on their right."""
    digits = WHOLE.box(div(m.odometer, 10))
    _, top, right, bottom = ODOMETER_AREA
    return box(digits.x, top, right - digits.x, bottom - top, value=digits.value)


def _car_boxes(m: Ram, d: Drawn) -> Box:
    """The cars by slot."""
    row = np.arange(CAR_ROWS)
    sections = lookup(ROAD_SECTIONS, 8 * (d.scroll >> 4) + row)
    starts = (m.car_pictures + sections) & 255
    night = starts == STARTS_AT_NIGHT
    there = night | (starts == STARTS_BY_DAY)
    low = jnp.where(night, LOOKS[1, 0], LOOKS[0, 0])
    height = jnp.where(night, LOOKS[1, 1], LOOKS[0, 1])
    left = jnp.where(night, LOOKS[1, 2], LOOKS[0, 2])
    width = jnp.where(night, LOOKS[1, 3], LOOKS[0, 3])
    lowest = (low - m.car_pictures + 64 & 255) - 64  # height of the lowest row
    end = jnp.where(row > 0, jnp.roll(sections, 1), lowest)
    cut = jnp.maximum(end - lowest, 0)
    y = GROUND - lowest - height + 1
    boxes = box(packed_position(m.car_x) + left, y, width, height - cut, there, color=d.colors)
    one = when(there, 1)
    number = d.passed - jnp.cumsum(one) + one & CAR_SLOTS - 1
    return _by_slot(_leaving(m, boxes, night), d.colors, number).clip(*VIEW)


def _leaving(m: Ram, boxes: Box, night: jax.Array) -> Box:
    """The cars; if the screen's edge cuts the nearest one, its first rows are narrower."""
    rows = GROUND - boxes.y
    is_whole = (rows > ASLANT) | night | (np.arange(CAR_ROWS) > 0)
    left = match((is_whole, 0), ((rows == ASLANT) & m.mirrored, 0), otherwise=2)
    lost = match((is_whole, 0), (rows == ASLANT, 2), otherwise=4)
    return replace(boxes, x=boxes.x + left, w=boxes.w - lost)


def _by_slot(rows: Box, colors: jax.Array, number: jax.Array) -> Box:
    """The cars in the slots of their numbers."""
    slots = np.arange(CAR_SLOTS)
    here = [rows.valid[i] & (number[i] == slots) for i in range(CAR_ROWS)]

    def of(values: jax.Array) -> jax.Array:
        return match(*((here[i], values[i]) for i in range(CAR_ROWS)), otherwise=0)

    valid = functools.reduce(jnp.logical_or, here)
    return box(of(rows.x), of(rows.y), of(rows.w), of(rows.h), valid, color=of(colors))


@dataclass(frozen=True)
class Wide:
    """The pixels of horizontal runs of at least two pixels: not the lines of the road."""

    def __call__(self, mask: Bitmap, planes: jax.Array) -> Bitmap:
        """The pixels that the filter keeps."""
        return mask & ~ShortRuns(1, across=True)(mask, planes)


PLAYER_VIEW = (8, 130, 160, 155)
PLAYER = Blobs(GRAY, PLAYER_VIEW, Shape(w=(12, 18), h=(8, 11)), gap=(1, 1), filters=(Wide(),))
CAR_SHAPES = (
    Shape(w=(12, 17), h=(1, 11)),
    Shape(w=8, h=6),
    Shape(w=6, h=4),
    Shape(w=4, h=(2, 3)),
    Shape(w=(1, 8), h=(1, 3)),
)
NUMBER_OF_CARS = Bounds(
    BLACK,
    CARS_LEFT.area,
    max_size=(23, 7),  # flags replace it
    value=Digits(GLYPHS, CARS_LEFT.lefts, CARS_LEFT.top),
)
DISTANCE = Bounds(BLACK, ODOMETER_AREA, value=Digits(GLYPHS, WHOLE.lefts, WHOLE.top))
DAY_NUMBER = Bounds(
    BLACK,
    TWO_DIGIT_DAY.area,
    value=Digits(GLYPHS, TWO_DIGIT_DAY.lefts, TWO_DIGIT_DAY.top, centered=True),
)
CARS = Blobs(CAR_COLORS, VIEW, CAR_SHAPES, gap=(4, 0))


def cars_passed(objects: Any) -> np.ndarray:
    """The sum of the rewards: the cars passed on all days.

    ALE reads the day's two decimal digits as a hexadecimal number, so the sum jumps on day 10.
    """
    day = objects.of("Level").value[:, 0]
    number = day + 6 * (day // 10)
    left = jnp.where(objects.of("NumberOfCars").valid, objects.of("NumberOfCars").value, 0)[:, 0]
    on_this_day = jnp.where(number > 1, 300, 200)
    before = jnp.where(number > 1, 200 + 300 * (number - 2), 0)
    return np.array(before + on_this_day - left)


GAME = Game(
    name="Enduro",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        rare=("Car", "Level", "NumberOfCars"),
        returns=cars_passed,
        known={"Odometer": 0.75},  # its digits roll
    ),
    categories=(
        Category("Player", PLAYER, rgb=(192, 192, 192), role="player", doc="the player's car"),
        Category("Car", CARS, count=CAR_SLOTS, doc="number of cars passed before it, modulo 8"),
        display(
            "NumberOfCars",
            NUMBER_OF_CARS,
            colors=PLATE,
            doc="cars that are left to pass on this day",
        ),
        display("Level", DAY_NUMBER, colors=PLATE, doc="day"),
        display(
            "Odometer",
            DISTANCE,
            colors=PLATE,
            aliases=("PlayerScore",),
            doc="distance, without the last digit, which rolls",
        ),
    ),
)
