"""Frostbite: Frostbite Bailey, a bear, four rows of floes, birds, fish, crabs and clams, an igloo.

Picture: docs/games/Frostbite.png

Screen: floes are white. A row turns blue when Bailey steps on it, and white again when all rows are
blue. Temperature and Lives blink together below 10 degrees. The beam's late blank hides the eight
columns at the left edge. The fish on the display from level 21, the sky and the maker's name are
scenery.

Slots: a row has three floes, which are broken in two in every second level. FloatingBlock has slot
row * 6 + floe * 2 + half, the lowest row first. An intact floe has the slot of its left half; the
other slot holds its part at the other edge of the screen. Animals have a slot for each of the three
places of a row: row * 3 + place.

RAM: ALE's source (score, lives), OCAtari 2.2 and D. Debro's disassembly (meaning of the records),
and the ROM's code. All objects move before the frame is drawn, so the RAM agrees with the screen.
`decode` reverts three exceptions: the game prepares the igloo and the distance of the halves of
floes a frame ahead, and adds the points of a fish after the drawing.

Covered: the first 12 levels and the 21st, both of ALE's modes, drowning, freezing, the bear, all
stages of the igloo, the end of the game. The value of Lives is ALE's, one more than the digit; at 1
the game shows none, and Lives is not valid.

Not exact: nothing known.

VEM: it takes halves of floes less than three columns apart for one floe, and finds two parts if
Bailey covers the middle of a floe. It misses the part of Bailey in front of the igloo and some of a
frozen Bailey.
"""

import functools
import itertools
import operator
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    EDGE_CUTS,
    WEST,
    Blobs,
    Bounds,
    Box,
    ByColor,
    Category,
    Checks,
    Game,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Shape,
    Variants,
    bcd,
    bits,
    box,
    byte,
    display,
    flag,
    lookup,
    match,
    mod,
    pick,
    reached,
    signed_nibble,
    when,
)

ROM = Rom("frostbite", "4ca73eb959299471788f0b685c3ba0b5")
FONT = ROM.font(0xF00, rows=8)
BAILEYS = ROM.pictures(range(0xC00, 0xD00), 19)
BEARS = ROM.pictures([0xD00 + low for low in ROM.bytes(0xEE7, 8)], 19)
# The part of an animal on the screen, by columns beyond the edge and low byte of its address.
ANIMAL_PICTURES = Pictures.of(
    [ROM.rows(0xD00 + low, 8) & seen for seen in EDGE_CUTS for low in range(256)]
)
POSES = ROM.bytes(0xCAA, 6)  # low bytes of the addresses of Bailey's pictures

WHITE = 12  # waiting floes
ICE = 152  # floes that Bailey has stepped on
BIRD = 142  # also of the display
FISH = 202
CRAB = 56
CLAM = 26
HAIR = 36
FACE = 54
BOOTS = 22
STONE = 6
DARK = 4
BLACK = 0
FIRE = 56
FROST = (146, 148, 150)  # of a frozen Bailey

WATER = (8, 78, 160, 186)
LAND_AND_WATER = (8, 47, 160, 186)
SHORE = (8, 55, 160, 77)
GROUND = (112, 35, 144, 55)  # of the igloo
DOOR = (120, 46, 136, 55)

ANIMAL_ROW = np.arange(12) // 3  # of the slots
ANIMAL_PLACE = np.arange(12) % 3
FLOE_ROW = np.arange(24) // 6
FLOE_PLACE = np.arange(24) // 2 % 3
FLOE_HALF = np.arange(24) % 2
FLOE_Y = 174  # of the lowest row
ROWS_APART = 26
# The rows of a floe are 0, 2, 3, 5, 4, 6 and 8 columns left of the first one. Columns of the first
# row at which another row, from the top, is beyond the right edge, or inside the left edge.
ROWS_BEYOND = (160, 162, 163, 165, 165, 166)
ROWS_INSIDE = (9, 11, 12, 13, 13, 15, 17)

SCORE = NumberDisplay(FONT, right=70, top=10, digits=6)
LIVES = NumberDisplay(FONT, right=70, top=22, digits=1)
DEGREES = NumberDisplay(FONT, right=38, top=22, digits=2)
DEGREE_SIGN = 41  # its right edge

OFF_LEFT = 200  # least `animals_x` of a row that begins left of the screen
IN_TIME = 20  # least `x` at which Bailey's rows are in time
DOORSTEP = 6  # least `y` outside the igloo
COMPLETE = 15  # `igloo`
GONE = 18  # least `sunk` of an invisible Bailey
FIRST_BEAR = 3  # `level`
FIRST_SLIDING = 5  # first `level` with sliding halves of floes
JUST_LANDED = 16  # `landed`
JUST_COUNTED = 6  # `delay`


class Kind:  # of `Ram.kind`
    BIRDS = 0
    FISH = 1
    CRABS = 2
    CLAMS = 3


class Status:  # bits of `Ram.status`
    COMPLETE = 64  # the level is complete, and the game counts its points


class Sound:  # of `Ram.sound`
    EATS = 64  # a bit
    BLOCK_TAKEN = 142


def _stages() -> np.ndarray:
    """Left, top and right edge of each stage of the igloo."""
    columns = list(itertools.accumulate(ROM.bytes(0xFE9, 16).tolist(), operator.or_))
    lefts = [112 + 4 * ((dots & -dots).bit_length() - 1) for dots in columns]
    tops = np.minimum(55, np.minimum.accumulate(51 - 4 * ROM.bytes(0xD4E, 16)))
    rights = [112 + 4 * dots.bit_length() for dots in columns]
    return np.array([lefts, tops, rights], np.int32).T


STAGE_LEFTS, STAGE_TOPS, STAGE_RIGHTS = _stages().T
# Distance of the halves of a floe, by step. High nibble: of the right half from 4 columns right of
# the row's position; low nibble: of the left half.
DISTANCES = ROM.bytes(0xDE0, 16)


class Ram(RamMap):
    clock = byte(1)
    kind = bits(17, 18, 19, 20, count=2)  # of a row's animals, lowest row first
    faces_left = flag(17, 18, 19, 20, bit=7)
    apart = byte(30)  # step of the halves of floes, counts down
    floe_x = byte(31, 32, 33, 34)
    picture = byte(35, 36, 37, 38)  # of a row's animals, low byte of its address
    floe_color = byte(43, 44, 45, 46)  # lowest row first
    bear_color = byte(61)  # by day or by night
    door_color = byte(62)  # black, or a flickering fire at night
    score = bcd((72, 73, 74))
    level = byte(75)  # 0: the first one
    lives = byte(76)
    igloo = byte(77)  # blocks less 1: 0-15, 255 for none
    animals = bits(92, 93, 94, 95, count=3)  # occupied places of a row, the last one first
    animals_x = byte(96, 97, 98, 99)  # of the first place, modulo 256
    y = byte(100)
    temperature = bcd(101)
    x = byte(102)
    delay = byte(103)  # frames left of a pause
    bear_x = byte(104)
    sunk = byte(107)  # rows
    looks_left = flag(108, bit=3)
    bear_right = flag(108, bit=4)
    pose = byte(110)
    bear_pose = byte(111)
    status = byte(113)
    sound = byte(116)  # counts down; 64-127: of eating a fish, at least 128: of floes
    landed = byte(117)  # counts down from 16 after a step on a floe


def decode(m: Ram) -> dict[str, Box]:
    animals = _animal_boxes(m)
    kind = jnp.repeat(m.kind, 3)
    return {
        "Player": _bailey(m),
        "Bear": _bear(m),
        "FloatingBlock": _floes(m),
        "Bird": animals.where(kind == Kind.BIRDS),
        "GreenFish": animals.where(kind == Kind.FISH),
        "Crab": animals.where(kind == Kind.CRABS),
        "Clam": animals.where(kind == Kind.CLAMS),
        "House": _igloo(m),
        "Door": box(123, 47, 8, 8, m.igloo == COMPLETE, color=m.door_color),
        "Score": SCORE.box(_shown_score(m), value=m.score),
        "Lives": LIVES.box(m.lives & 15, value=m.lives + 1, valid=m.lives > 0),
        "Temperature": _temperature(m),
    }


def _bailey(m: Ram) -> Box:
    """Bailey; near the left edge his rows over the shore are late, a row lower."""
    picture = pick(m.pose, POSES.tolist()) + m.sunk
    there = (m.sunk < GONE) & (m.y >= DOORSTEP)
    whole = BAILEYS.box(
        picture,
        m.x,
        m.y + 28,
        mirrored=m.looks_left,
        valid=there,
        orientation=_compass(m.looks_left),
    )
    late = m.x < IN_TIME
    top = whole.y
    bottom = whole.y + whole.h
    lowered = whole.trimmed(
        top=when(late & (top < SHORE[1]), 1),
        bottom=-when(late & (bottom < SHORE[1]), 1),
    )
    return lowered.clip(*LAND_AND_WATER)


def _bear(m: Ram) -> Box:
    faces_right = m.bear_right
    whole = BEARS.box(
        m.bear_pose & 7,
        m.bear_x + 1,
        58,
        mirrored=faces_right,
        zoom=2,
        valid=m.level >= FIRST_BEAR,
        orientation=_compass(~faces_right),
        color=m.bear_color,
    )
    return whole.clip(*SHORE)


def _compass(faces_left: jax.Array) -> jax.Array:
    """The compass point of a figure."""
    return jnp.where(faces_left, WEST, EAST)


def _animal_boxes(m: Ram) -> Box:
    """The visible parts of the animals of all kinds."""
    first = jnp.where(m.animals_x >= OFF_LEFT, m.animals_x - 256, m.animals_x)
    x = jnp.repeat(first, 3) + 16 * ANIMAL_PLACE
    faces_left = jnp.repeat(m.faces_left, 3)
    beyond = jnp.clip(x - 152, 0, 8) - jnp.clip(8 - x, 0, 8)
    cut = 8 + jnp.where(faces_left, -beyond, beyond)
    whole = ANIMAL_PICTURES.box(
        256 * cut + jnp.repeat(m.picture, 3),
        x,
        FLOE_Y - ROWS_APART * ANIMAL_ROW - 14,
        mirrored=faces_left,
        valid=(jnp.repeat(m.animals, 3) >> (2 - ANIMAL_PLACE) & 1) == 1,
        orientation=_compass(faces_left),
    )
    return whole.clip(*WATER)


def _floes(m: Ram) -> Box:
    """The floes, or their halves: the visible part of their slanting shape."""
    x, width = _floe_columns(m)
    right = x + width
    top = reached(x, ROWS_BEYOND)
    bottom = reached(right, ROWS_INSIDE)
    left = jnp.maximum(x - 8, 8)
    there = (right > 8) & (x < 168)
    y = FLOE_Y - ROWS_APART * FLOE_ROW + top
    color = jnp.repeat(m.floe_color, 6)
    visited = jnp.where(color == WHITE, 0, 1)
    visible = jnp.minimum(right, 160) - left
    return box(left, y, visible, bottom - top, there, value=visited, color=color)


def _floe_columns(m: Ram) -> tuple[jax.Array, jax.Array]:
    """First column of the first row of each floe or half, and width of a row."""
    code = lookup(DISTANCES, _floe_step(m))
    first = -(code & 15)
    second = 4 - signed_nibble(code >> 4)
    whole = second - first == 8
    offset = jnp.where((FLOE_HALF == 0) | whole, first, second)
    inside = mod(jnp.repeat(m.floe_x, 6) + offset + 160 + 32 * FLOE_PLACE, 160)
    across = jnp.where(inside < 8, inside + 160, inside - 160)  # the part beyond the screen's edge
    x = jnp.where(jnp.where(whole, FLOE_HALF == 1, inside < 4), across, inside)
    return x, jnp.where(whole, 16, 8)


def _floe_step(m: Ram) -> jax.Array:
    """The step of the halves of floes when the frame was drawn."""
    slide = ((m.level & 1) == 1) & (m.level >= FIRST_SLIDING)
    moved = slide & ((m.clock & 15) == 0) & (m.delay == 0) & (m.status == 0)
    return jnp.where(moved, m.apart + 1 & 15, m.apart)


def _igloo(m: Ram) -> Box:
    """The igloo without this frame's change."""
    added = m.landed == JUST_LANDED
    kept = m.igloo == COMPLETE - 1  # the complete igloo does not shrink
    block_taken = (m.sound == Sound.BLOCK_TAKEN) & ~kept
    taken = block_taken | (((m.status & Status.COMPLETE) != 0) & (m.delay == JUST_COUNTED))
    stage = m.igloo + match((added, -1), (taken, 1), otherwise=0) & 255
    left = lookup(STAGE_LEFTS, stage)
    top = lookup(STAGE_TOPS, stage)
    return box(left, top, lookup(STAGE_RIGHTS, stage) - left, 55 - top, stage <= COMPLETE)


def _shown_score(m: Ram) -> jax.Array:
    """The score without the points of a fish, which the game counts after the frame is drawn."""
    counts = ((m.sound & Sound.EATS) != 0) & ((m.sound & 3) != 0)
    return jnp.maximum(m.score - when(counts, 10), 0)


def _temperature(m: Ram) -> Box:
    digits = DEGREES.box(m.temperature)
    return replace(digits, w=DEGREE_SIGN - digits.x)


facing = functools.partial(Category, attributes=("orientation",))
animals_of = functools.partial(facing, count=12)
animal = functools.partial(Blobs, region=WATER, gap=(2, 3), shapes=Shape(w=(1, 8), h=(1, 8)))

FLOE_PARTS = Blobs((WHITE, ICE), WATER, Shape(w=(3, 26), h=(2, 7)))
FIGURE = Bounds((HAIR, FACE, BOOTS, STONE, *FROST), LAND_AND_WATER, ignore=(GROUND,))

GAME = Game(
    name="Frostbite",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        mirrored={"Bear": None, "GreenFish": None, "Crab": None, "Clam": None},
    ),
    variants=Variants(
        modes={
            0: "starts at level 1",
            2: "starts at level 5",
        },
        source="play of all modes in the emulator",
        starts={
            "level=9": "level 10, with floes in small pieces",
        },
    ),
    categories=(
        facing("Player", FIGURE, role="player", doc="Frostbite Bailey"),
        facing(
            "Bear",
            Bounds((DARK, WHITE), SHORE, min_size=(3, 3)),
            doc="on the shore, from level 4 on",
        ),
        Category(
            "FloatingBlock",
            FLOE_PARTS,
            count=24,
            attributes=("value",),
            value=ByColor(((WHITE, 0), (ICE, 1))),
            doc="row * 6 + floe * 2 + half; value: 1 if it was stepped on since all were white",
        ),
        animals_of("Bird", animal(BIRD), doc="snow geese: row * 3 + place"),
        animals_of("GreenFish", animal(FISH), doc="row * 3 + place"),
        animals_of("Crab", animal(CRAB), doc="row * 3 + place"),
        animals_of("Clam", animal(CLAM), doc="row * 3 + place"),
        Category("House", Bounds(STONE, GROUND), doc="what is built of the igloo"),
        Category("Door", Bounds((BLACK, FIRE), DOOR), doc="of the complete igloo"),
        display("Score", SCORE.rule(BIRD), role="score", doc="points"),
        display(
            "Lives",
            LIVES.rule(BIRD, base=1),
            blinks=True,
            role="lives",
            doc="one more than the digit",
        ),
        display(
            "Temperature",
            DEGREES.rule(BIRD, (22, 22, 46, 30)),
            blinks=True,
            doc="degrees left",
        ),
    ),
)
