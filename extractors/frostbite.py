"""Frostbite: Frostbite Bailey, a bear, four rows of floes, birds, fish, crabs and clams, an igloo.

A row has three floes, which are broken in two in every second level. Slots of FloatingBlock are row
* 6 + floe * 2 + half, the lowest row first. A whole floe is in the slot of its left half; the other
slot holds what of it is at the other edge of the screen. Animals have a slot for each of the three
places of a row: row * 3 + place. The eight columns at the left edge are blanked by the beam. Floes
are white; those of a row turn blue when it is stepped on, and white again when all rows are blue.

RAM: ALE's source (score, lives), OCAtari 2.2 and D. Debro's disassembly (what the records are), and
the ROM's code. Everything moves before the frame is drawn, so that the RAM has what is on the
screen, with three exceptions, which `decode` takes back: the igloo and the distance of the halves
of floes are prepared a frame ahead, and the points of a fish are added after drawing.

Covered: the first 12 levels and the 21st, both of ALE's modes, drowning, freezing, the bear, all
stages of the igloo, the end of the game. Temperature and Lives blink together below 10 degrees. The
value of Lives is ALE's, one more than the digit; at 1 the game shows none, and Lives is not valid.
The fish on the display from level 21 on, the sky and the maker's name are scenery. VEM takes halves
of floes less than three columns apart for one floe, sees two parts of a floe that Bailey covers in
the middle, and sees neither the part of Bailey in front of the igloo nor all of a frozen one.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import lookup, mod, pick, reached
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.registers import EDGE_CUTS, signed_nibble
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Blobs, Bounds, ByColor
from ocjax.vision.shapes import Shape

ROM = Rom("frostbite", "4ca73eb959299471788f0b685c3ba0b5")
FONT = ROM.font(0xF00, rows=8)
BAILEYS = ROM.pictures(range(0xC00, 0xD00), 19)
BEARS = ROM.pictures([0xD00 + low for low in ROM.bytes(0xEE7, 8)], 19)
ANIMALS = Pictures.of([ROM.rows(0xD00 + low, 8) & seen for seen in EDGE_CUTS for low in range(256)])
POSES = ROM.bytes(0xCAA, 6)  # low bytes of the addresses of Bailey's pictures

WHITE = 12
ICE = 152
BIRD = 142
FISH = 202
CRAB = 56
CLAM = 26
"""Colours of floes that wait and that were stepped on, and of animals."""
HAIR = 36
FACE = 54
BOOTS = 22
STONE = 6
DARK = 4
BLACK = 0
FIRE = 56
FROST = (146, 148, 150)

WATER = (8, 78, 160, 186)
LAND_AND_WATER = (8, 47, 160, 186)
SHORE = (8, 55, 160, 77)
IGLOO = (112, 35, 144, 55)
DOOR = (120, 46, 136, 55)

# of the animals' slots
ROW = np.arange(12) // 3
PLACE = np.arange(12) % 3
FLOE_ROW = np.arange(24) // 6
FLOE = np.arange(24) // 2 % 3
HALF = np.arange(24) % 2
FLOE_Y = 174
ROWS_APART = 26
# The rows of a floe are 0, 2, 3, 5, 4, 6 and 8 columns left of the first one. Columns of that one
# at which one more row, from the top, is beyond the right edge, or inside the left edge.
ROWS_BEYOND = (160, 162, 163, 165, 165, 166)
ROWS_INSIDE = (9, 11, 12, 13, 13, 15, 17)

BIRDS, FISHES, CRABS, CLAMS = range(4)  # `kind`
OFF_LEFT = 200  # least `animals_x` of a row that begins left of the screen
LATE = 20  # least `x` at which Bailey's rows are written in time
INSIDE = 6  # below this `y` Bailey is in the igloo
COUNTING = 0x40  # bit of `status`: the level is complete
JUST_LANDED = 16  # `landed`
JUST_TAKEN = 0x8E  # `sound`
JUST_COUNTED = 6  # `delay`
COMPLETE = 15  # `igloo`
SUNK = 18  # `sunk` when Bailey is gone
FIRST_BEAR = 3  # level
EAST = 4
WEST = 12


def _igloos() -> np.ndarray:
    """The box of each stage of the igloo: left, top and right edge, 8 bits each."""
    out, columns, top = [], 0, 55
    for row, dots in zip(ROM.bytes(0xD4E, 16), ROM.bytes(0xFE9, 16), strict=True):
        columns |= int(dots)
        top = min(top, 51 - 4 * int(row))
        first = (columns & -columns).bit_length() - 1
        out.append(112 + 4 * first | top << 8 | 112 + 4 * columns.bit_length() << 16)
    return np.array(out, np.int32)


IGLOOS = _igloos()
CODES = ROM.bytes(0xDE0, 16)  # distance of the halves of a floe
"""High nibble: of the right half from 4 columns right of the row's position; low: of the left."""


class Ram(RamMap):
    clock = byte(1)
    kind = bits(17, 18, 19, 20, count=2)  # of a row's animals, lowest row first
    faces_left = bits(17, 18, 19, 20, first=7)
    apart = byte(30)  # step of the halves of floes, counts down
    floe_x = byte(31, 32, 33, 34)
    picture = byte(35, 36, 37, 38)  # of a row's animals, low byte of its address
    floe_color = byte(43, 44, 45, 46)  # lowest row first
    bear_color = byte(61)  # by day or by night
    door_color = byte(62)  # black, or a flickering fire by night
    score = bcd((72, 73, 74))
    level = byte(75)  # 0: the first one
    lives = byte(76)
    igloo = byte(77)  # blocks less 1: 0-15, 255 for none
    animals = bits(92, 93, 94, 95, count=3)  # places of a row that are taken, the last one first
    animals_x = byte(96, 97, 98, 99)  # of the first place, modulo 256
    y = byte(100)
    temperature = bcd(101)
    x = byte(102)
    delay = byte(103)  # frames until the game goes on
    bear_x = byte(104)
    sunk = byte(107)  # rows
    looks_left = bits(108, first=3)
    bear_right = bits(108, first=4)
    pose = byte(110)
    bear_pose = byte(111)
    status = byte(113)
    sound = byte(116)  # counts down; 64-127: of eating a fish, 128 and more: of floes
    landed = byte(117)  # counts down from 16 after a floe was stepped on


def decode(m: Ram) -> dict[str, Box]:
    animals = _animals(m)
    kind = jnp.repeat(m.kind, 3)
    lives = score_box(FONT, m.lives & 15, right=70, top=22, digits=1, value=m.lives + 1)
    return {
        "Player": _bailey(m),
        "Bear": _bear(m),
        "FloatingBlock": _floes(m),
        "Bird": animals.where(kind == BIRDS),
        "GreenFish": animals.where(kind == FISHES),
        "Crab": animals.where(kind == CRABS),
        "Clam": animals.where(kind == CLAMS),
        "House": _igloo(m),
        "Door": box(123, 47, 8, 8, m.igloo == COMPLETE, color=m.door_color),
        "Score": score_box(FONT, _shown_score(m), right=70, top=10, digits=6, value=m.score),
        "Lives": lives.where(m.lives > 0),
        "Temperature": _temperature(m),
    }


def _bailey(m: Ram) -> Box:
    """Bailey; near the left edge his rows over the shore are written too late: a row lower."""
    picture = pick(m.pose, POSES.tolist()) + m.sunk
    left, facing = m.looks_left == 1, _facing(m.looks_left)
    bailey = BAILEYS.box(picture, m.x, m.y + 28, mirrored=left, orientation=facing)
    top, bottom = bailey.y, bailey.y + bailey.h
    late = m.x < LATE
    top = top + jnp.where(late & (top < SHORE[1]), 1, 0)
    bottom = bottom + jnp.where(late & (bottom < SHORE[1]), 1, 0)
    there = (m.sunk < SUNK) & (m.y >= INSIDE)
    return replace(bailey, y=top, h=bottom - top).clip(*LAND_AND_WATER).where(there)


def _bear(m: Ram) -> Box:
    facing, pose = _facing(1 - m.bear_right), m.bear_pose & 7
    right = m.bear_right == 1
    look = {"orientation": facing, "color": m.bear_color}
    bear = BEARS.box(pose, m.bear_x + 1, 58, mirrored=right, zoom=2, **look)
    return bear.clip(*SHORE).where(m.level >= FIRST_BEAR)


def _facing(left: jax.Array) -> jax.Array:
    """The compass point of a figure; 1 stands for one that looks to the left."""
    return jnp.where(left == 1, WEST, EAST)


def _animals(m: Ram) -> Box:
    first = jnp.where(m.animals_x >= OFF_LEFT, m.animals_x - 256, m.animals_x)
    x = jnp.repeat(first, 3) + 16 * PLACE
    there = (jnp.repeat(m.animals, 3) >> (2 - PLACE) & 1) == 1
    facing, left = _facing(jnp.repeat(m.faces_left, 3)), jnp.repeat(m.faces_left, 3) == 1
    beyond = jnp.clip(x - 152, 0, 8) - jnp.clip(8 - x, 0, 8)
    picture = 256 * (8 + jnp.where(left, -beyond, beyond)) + jnp.repeat(m.picture, 3)
    y = FLOE_Y - ROWS_APART * ROW - 14
    animals = ANIMALS.box(picture, x, y, mirrored=left, orientation=facing)
    return animals.clip(*WATER).where(there)


def _floes(m: Ram) -> Box:
    """The floes, or their halves: what is visible of their slanting shape."""
    moves = (m.level & 1 == 1) & (m.level >= 5) & ((m.clock & 15) == 0)
    moves = moves & (m.delay == 0) & (m.status == 0)
    code = lookup(CODES, jnp.where(moves, m.apart + 1 & 15, m.apart))
    first, second = -(code & 15), 4 - signed_nibble(code >> 4)
    whole = second - first == 8
    offset = jnp.where((HALF == 0) | whole, first, second)
    x = mod(jnp.repeat(m.floe_x, 6) + offset + 160 + 32 * FLOE, 160)
    across = jnp.where(x < 8, x + 160, x - 160)  # the part beyond the screen's edge
    x = jnp.where(jnp.where(whole, HALF == 1, x < 4), across, x)
    right = x + jnp.where(whole, 16, 8)
    top, bottom = reached(x, ROWS_BEYOND), reached(right, ROWS_INSIDE)
    y, left = FLOE_Y - ROWS_APART * FLOE_ROW, jnp.maximum(x - 8, 8)
    width, there = jnp.minimum(right, 160) - left, (right > 8) & (x < 168)
    color = jnp.repeat(m.floe_color, 6)
    visited = jnp.where(color == WHITE, 0, 1)
    return box(left, y + top, width, bottom - top, there, value=visited, color=color)


def _igloo(m: Ram) -> Box:
    """The igloo before what was added or taken on this frame."""
    added = m.landed == JUST_LANDED
    kept = added | (m.igloo == COMPLETE - 1)  # the complete igloo is not taken from
    taken = (m.sound == JUST_TAKEN) & ~kept
    taken = taken | (((m.status & COUNTING) > 0) & (m.delay == JUST_COUNTED))
    stage = m.igloo + jnp.where(added, -1, jnp.where(taken, 1, 0)) & 0xFF
    packed = lookup(IGLOOS, stage)
    left, top, right = packed & 255, packed >> 8 & 255, packed >> 16
    return box(left, top, right - left, 55 - top, stage <= COMPLETE)


def _shown_score(m: Ram) -> jax.Array:
    """A fish's points are counted after the frame is drawn."""
    counts = ((m.sound & 0x40) > 0) & ((m.sound & 3) > 0)
    return jnp.maximum(m.score - jnp.where(counts, 10, 0), 0)


def _temperature(m: Ram) -> Box:
    digits = score_box(FONT, m.temperature, right=38, top=22, digits=2, value=m.temperature)
    return replace(digits, w=41 - digits.x)  # with the degree sign


facing = functools.partial(Category, attributes=("orientation",))
animals = functools.partial(facing, count=12)
animal = functools.partial(Blobs, region=WATER, gap=(2, 3), shapes=Shape(w=(1, 8), h=(1, 8)))

FLOES = Blobs((WHITE, ICE), WATER, Shape(w=(3, 26), h=(2, 7)))
BAILEY = Bounds((HAIR, FACE, BOOTS, STONE, *FROST), LAND_AND_WATER, ignore=(IGLOO,))
BEAR = Bounds((DARK, WHITE), SHORE, min_size=(3, 3))
POINTS = Bounds(BIRD, (22, 10, 70, 18), value=Digits(FONT, range(22, 70, 8), 10))
LIVES = Bounds(BIRD, (62, 22, 70, 30), value=Digits(FONT, (62,), 22, base=1))
DEGREES = Bounds(BIRD, (22, 22, 46, 30), value=Digits(FONT, (22, 30), 22))

GAME = Game(
    name="Frostbite",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        facing("Player", BAILEY, doc="Frostbite Bailey"),
        facing("Bear", BEAR, doc="on the shore, from level 4 on"),
        Category(
            "FloatingBlock",
            FLOES,
            count=24,
            attributes=("value",),
            value=ByColor(((WHITE, 0), (ICE, 1))),
            doc="row * 6 + floe * 2 + half; value: 1 if it was stepped on since all were white",
        ),
        animals("Bird", animal(BIRD), doc="snow geese: row * 3 + place"),
        animals("GreenFish", animal(FISH), doc="row * 3 + place"),
        animals("Crab", animal(CRAB), doc="row * 3 + place"),
        animals("Clam", animal(CLAM), doc="row * 3 + place"),
        Category("House", Bounds(STONE, IGLOO), doc="what is built of the igloo"),
        Category("Door", Bounds((BLACK, FIRE), DOOR), doc="of the complete igloo"),
        display("Score", POINTS, doc="points"),
        display("Lives", LIVES, blinks=True, doc="one more than the digit"),
        display("Temperature", DEGREES, blinks=True, doc="degrees left"),
    ),
)
