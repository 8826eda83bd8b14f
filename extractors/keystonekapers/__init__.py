"""Keystone Kapers: Kelly, the Kop, chases Harry through a department store of four floors.

Screen: 250 rows. Each floor is eight screens wide, here *sections*, and the frame shows the same
section of all four. The picture begins in column 8; the blank left of it hides the fine moves of
the sprites. One drawing loop runs once a floor: player 0 is the thing on it, in up to three copies,
player 1 the Kop or the Krook. A table of the ROM gives each row its colour.

Slots: things take them from the ground floor up, each as many as the levels' tables need. The
elevator has one a floor. Of two escalators, the upper one comes first.

RAM: all found in the ROM's drawing loop and object tables. The frame shows the Kop before his last
step, so `as_drawn` takes back a step, a row of a jump and a second of the clock.

Covered: random play, and play to level 40 with the level, the lives and the clock set.

Not exact: on the frame on which a life is lost, the RAM has nothing of its scene, and REM tells the
score and the Kops in reserve alone. When the Kop has just come into a section, the RAM no longer
has the things of the one before. When he has just begun to duck, it does not have his pose, and
after a collision not the second that he lost last.

VEM: it joins the Kop to black things that touch him, and misses what an edge hides a part of.
"""

from collections.abc import Iterable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box, edges
from ocjax.console.compass import EAST, WEST
from ocjax.console.ops import among, mod, only, pick, when
from ocjax.console.registers import EDGE_CUTS, copies, spacing
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.extractors.keystonekapers.drawn import Drawn, as_drawn, has_begun_anew
from ocjax.extractors.keystonekapers.ram import Pose, Ram, Ride, Thing
from ocjax.vision.displays import IconRow, NumberDisplay
from ocjax.vision.filters import ShortRuns
from ocjax.vision.rules import Blobs, Bounds, Run, Runs
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Packed, Raised

ROM = Rom("keystone_kapers", "6c1f3f2e359dbf55df462ccbcdd2f6bf")
FONT = ROM.font(0xF01, rows=7, stride=8)
SCORE = NumberDisplay(FONT, right=70, top=32, digits=6)
TIMER = NumberDisplay(FONT, right=70, top=43, digits=2, leading_zeros=True)
HATS = IconRow(left=24, top=44, width=6, height=6, pitch=8)

SKY = 0xB8
WHITE = 0x0C
BRIGHT = 0x0E  # the score
BLACK = 0x00
SKIN = 0x4A
NAVY = 0xB2  # the Kop's clothes
CHARCOAL = 0x02  # the Krook's stripes
VIOLET = 0xC0  # escalators, closed doors and radios
FLASHES = (0xFC, 0xFE)  # of a radio's sound
TEAL = 0x76  # an open elevator
LIGHT_TEAL = 0x7E
RED = 0x62
BALL_COLORS = (RED, 0x64, 0x66)
YELLOW = 0x2C
BROWN = 0x20
LOOT_COLORS = (BLACK, 0x24, BROWN, 0x26, 0x28, 0x2A, YELLOW, 0x2E)
GOLD = 0x28  # the upper edge of a floor
OLIVE = 0x24
RADAR_COLORS = (GOLD, 0x26, OLIVE)

SCREEN_START = 8  # the picture's first column
SCREEN_END = 160
FROM_GROUND = np.arange(4)
ROOF = 3
LOWEST = 156  # first line of the ground floor
FLOOR_LINES = 32
STANDS = 6  # line of a floor where the picture begins of who stands on it
FIELD = (SCREEN_START, 57, SCREEN_END, 182)
BLANKED = 128  # `Ram.idle` from which on the screen is black

FIGURES = 0xE00  # in the ROM
KOP_POSES = 8
FIGURE_ROWS = 20
KOP_COLORS = 0xC34  # a byte a row; an odd one shows the row
DUCKED_COLORS = 0xC37
KOP_POINTERS = 0xECA
KROOK_POINTERS = 0xFCE  # by pose
THING_POINTERS = KROOK_POINTERS  # by kind: the Krook's poses come first
PICTURE_PAGE = 0xB00  # that they point into
HEIGHTS = 0xE00  # of things, by kind
ALL_KINDS = tuple(range(Thing.RADIO, Thing.MONEYBAG + 1))


def _kop_rows(pose: int) -> np.ndarray:
    """The rows of the Kop's picture that have a colour, from the top."""
    first = DUCKED_COLORS if pose == Pose.DUCKS else KOP_COLORS
    begin = FIGURES + int(ROM.bytes(KOP_POINTERS + pose, 1)[0]) - 1
    colors = ROM.rows(first, FIGURE_ROWS)
    return np.where(colors & 1 == 1, ROM.rows(begin, FIGURE_ROWS), 0)


def _thing_rows(thing: int) -> np.ndarray:
    """The rows of a thing's picture, from the top; the last one is in the colour of the floor."""
    begin = PICTURE_PAGE + int(ROM.bytes(THING_POINTERS + thing, 1)[0])
    rows = ROM.rows(begin, int(ROM.bytes(HEIGHTS + thing, 1)[0]))
    rows[-1] = 0
    return rows


def _at_edges(pictures: Iterable[np.ndarray]) -> Pictures:
    """Pictures of which an edge hides some columns, as in `EDGE_CUTS`."""
    cut = [rows & mask for rows in pictures for mask in EDGE_CUTS]
    return Pictures.of(cut, picture=len(cut) // len(EDGE_CUTS), beyond=len(EDGE_CUTS))


KOP_PICTURES = _at_edges(_kop_rows(pose) for pose in range(KOP_POSES))
KROOK_PICTURES = _at_edges(
    ROM.rows(PICTURE_PAGE + 1 + int(p), FIGURE_ROWS) for p in ROM.bytes(KROOK_POINTERS + 1, 5)
)
THING_PICTURES = Pictures.of(_thing_rows(thing) for thing in ALL_KINDS)
KIND_HEIGHTS = tuple(ROM.bytes(HEIGHTS + ALL_KINDS[0], len(ALL_KINDS)).tolist())

ELEVATOR_SECTION = 4
DOORS = tuple((76, top, 84, top + 25) for top in (155, 123, 91))
OPEN = 7  # of `doors`
RIGHT_END = 0  # sections with escalators
LEFT_END = 7
RADAR = (40, 190, 120, 204)
RIGHT_ESCALATOR = (55, 110, 102, 150)
LEFT_ESCALATORS = ((58, 78, 105, 118), (58, 142, 105, 182))
# Floors from the ground up, in groups: one floor at most of each group has a thing of a kind.
ALL = np.array([[True, True, True, True]])
ALL_BUT_SECOND = np.array([[True, True, False, True], [False, False, True, False]])
BY_RADIOS = np.array([[False, True, False, True], [False, False, True, False]])
EVEN = np.array([[True, False, False, False], [False, False, True, False]])
ODD = np.array([[False, True, False, False], [False, False, False, True]])


def decode(m: Ram) -> dict[str, Box]:
    kop = as_drawn(m)
    shown = m.idle < BLANKED
    here = shown & ~has_begun_anew(m)
    known = here & (kop.section == m.section)
    lives = m.lives + when(has_begun_anew(m), 1)
    things = _on_floors(m)
    return {
        "Kop": _kop_box(m, kop).where(here),
        "Krook": _krook_box(m, kop).where(here),
        "Ball": _boxes(things, (Thing.BALL,), ALL, 2).where(known),
        "Biplane": _boxes(things, (Thing.BIPLANE, Thing.BIPLANE_TURNS), ALL, 1).where(known),
        "Cart": _boxes(things, (Thing.CART,), ALL_BUT_SECOND, 2).where(known),
        "Radio": _boxes(things, (Thing.RADIO, Thing.RADIO_SOUNDS), BY_RADIOS, 3).where(known),
        "Moneybag": _boxes(things, (Thing.MONEYBAG,), ODD, 1).where(known),
        "Suitcase": _boxes(things, (Thing.SUITCASE,), EVEN, 1).where(known),
        "Elevator": _elevator_boxes(m, kop).where(here),
        "Escalator": _escalator_boxes(kop).where(here),
        "SecuritySystem": edges(*RADAR, shown),
        "BonusKops": HATS.box(lives, shown, value=lives, color=_display_color(m, kop)),
        "Score": SCORE.box(m.score, valid=shown),
        "Timer": TIMER.box(kop.time, valid=here, color=_display_color(m, kop)),
    }


class Things(NamedTuple):
    """What each floor holds."""

    thing: jax.Array
    x: jax.Array
    y: jax.Array
    width: jax.Array
    height: jax.Array
    nusiz: jax.Array


def _on_floors(m: Ram) -> Things:
    left, top, width, height = THING_PICTURES.extent(
        m.thing - ALL_KINDS[0], mirrored=m.thing_left == 1
    )
    first = m.thing_top - pick(m.thing - ALL_KINDS[0], KIND_HEIGHTS) + 1
    y = _first_line(FROM_GROUND) + first + top
    return Things(m.thing, m.thing_x - 1 + left, y, width, height, m.copies)


def _first_line(floor: jax.Array | np.ndarray) -> jax.Array:
    """The first line of a floor."""
    return LOWEST - FLOOR_LINES * jnp.asarray(floor)


def _boxes(things: Things, kinds: tuple[int, ...], floors: np.ndarray, most: int) -> Box:
    """The copies of a kind of thing, of each group of floors one of which may hold it."""
    here = among(things.thing, kinds)[None] & floors
    x, y, w, h, nusiz = (only(here, part[None], axis=1)[:, None] for part in things[1:])
    copy = np.arange(most)[None]
    there = here.any(axis=1)[:, None] & (copy < copies(nusiz))
    column = mod(x + spacing(nusiz) * copy, SCREEN_END)
    shape = there.shape
    fields = (jnp.broadcast_to(part, shape).ravel() for part in (column, y, w, h, there))
    return box(*fields).clip(*FIELD)


def _kop_box(m: Ram, kop: Drawn) -> Box:
    """The Kop; what is behind the floor above him does not show."""
    left, top, width, height = _figure(KOP_PICTURES, kop.pose, kop.x - 1, m.faces_left == 1)
    ground = _first_line(kop.floor)
    above = ground - 6  # last line of the floor above
    ceiling = ground - 1 - when(kop.floor == ROOF, 2)
    head = ground + STANDS - kop.height + top
    first = jnp.where((head >= above) & (head < ceiling), ceiling, head)
    feet = head + height
    last = jnp.where((feet > above) & (feet <= ceiling), above, feet)
    hidden = (m.ride == Ride.ELEVATOR) & ~_is_open(m).any()
    x = kop.x - 1 + left
    compass = jnp.where(m.faces_left == 1, WEST, EAST)
    return edges(x, first, x + width, last, ~hidden, orientation=compass).clip(*FIELD)


def _figure(
    pictures: Pictures, picture: jax.Array, x: jax.Array, mirrored: jax.Array
) -> tuple[jax.Array, ...]:
    """The extent of what shows of a figure's picture at a column."""
    beyond = jnp.clip(x + 8 - SCREEN_END, 0, 8) - jnp.clip(SCREEN_START - x, 0, 8)
    beyond = jnp.where(mirrored, -beyond, beyond) + len(EDGE_CUTS) // 2
    return pictures.extent(pictures.index(picture=picture, beyond=beyond), mirrored=mirrored)


def _krook_box(m: Ram, kop: Drawn) -> Box:
    left, top, width, height = _figure(
        KROOK_PICTURES, m.krook_pose - 1, m.krook_x - 1, m.krook_left == 1
    )
    along = m.krook_place & 15
    section = jnp.where(along < 8, along, along ^ 15)
    y = _first_line(m.krook_place >> 3) + STANDS + top
    here = section == kop.section
    compass = jnp.where(m.krook_left == 1, WEST, EAST)
    return box(m.krook_x - 1 + left, y, width, height, here, orientation=compass).clip(*FIELD)


def _is_open(m: Ram) -> jax.Array:
    """Whether the elevator is open, on each floor."""
    return m.doors == OPEN


def _elevator_boxes(m: Ram, kop: Drawn) -> Box:
    color = jnp.where(_is_open(m), TEAL, VIOLET)
    left, top, right, bottom = np.array(DOORS).T
    last = bottom - when(_is_open(m), 1)
    return edges(left, top, right, last, valid=kop.section == ELEVATOR_SECTION, color=color)


def _escalator_boxes(kop: Drawn) -> Box:
    at_right = kop.section == RIGHT_END
    upper, lower = LEFT_ESCALATORS
    at_left = kop.section == LEFT_END
    first = (jnp.where(at_right, *edge) for edge in zip(RIGHT_ESCALATOR, upper, strict=True))
    both = map(jnp.stack, zip(first, jnp.asarray(lower, jnp.int32), strict=True))
    return edges(*both, valid=jnp.stack([at_right | at_left, at_left]))


def _display_color(m: Ram, kop: Drawn) -> jax.Array:
    """The colour of timer and hats: black, or in the last ten seconds flashing."""
    return when((kop.time <= 10) & (m.over == 0), (m.clock - 1) & 0xFE)


HANDRAILS = (
    Run(BLACK, 86, 64, 32, 32, before=6, above=8, after=9),
    Run(BLACK, 118, 64, 32, 32, before=9, above=8, after=6),
    Run(BLACK, 150, 64, 32, 32, before=6, above=8, after=9),
)
HANDRAIL_ROWS = tuple((SCREEN_START, row, SCREEN_END, row + 1) for row in (86, 118, 150))
KOP_RULE = Blobs(
    (NAVY, SKIN, BLACK),
    FIELD,
    Shape(w=(5, 8), h=(12, 20)),
    gap=(0, 2),
    ignore=HANDRAIL_ROWS,
)
KROOK_RULE = Blobs(CHARCOAL, FIELD, Shape(w=(1, 8), h=(1, 19)), gap=(7, 8), then=(Raised(1),))
BALL_RULE = Blobs(BALL_COLORS, FIELD, Shape(w=(1, 6), h=(4, 6)))
BIPLANE_RULE = Blobs((YELLOW, BLACK), FIELD, Shape(w=(7, 8), h=(8, 9)), gap=(0, 1), first=BLACK)
CART_RULE = Blobs((WHITE, BLACK), FIELD, Shape(w=(7, 8), h=10), filters=(ShortRuns(12),))
RADIO_RULE = Blobs((VIOLET, *FLASHES, WHITE), FIELD, Shape(w=8, h=(12, 14)), gap=(1, 3))

ESCALATOR_RULE = Runs(HANDRAILS, most=1, columns=(SCREEN_START, SCREEN_END), then=(Packed(),))


def _loot_rule(floors: tuple[int, ...], left: int, right: int, first: int) -> Bounds:
    """What is in some columns of some floors, from a line of the floor on."""
    tops = [LOWEST - FLOOR_LINES * floor for floor in floors]
    regions = tuple((left, top + first, right, top + 26) for top in tops)
    return Bounds(LOOT_COLORS, regions, min_size=(6, 10))


GAME = Game(
    name="KeystoneKapers",
    rom=ROM,
    ram=Ram,
    decode=decode,
    screen=(250, 160),
    pal=True,
    categories=(
        Category("Kop", KOP_RULE, attributes=("orientation",), rgb=(0, 0, 0), doc="Keystone Kelly"),
        Category("Krook", KROOK_RULE, attributes=("orientation",), doc="Harry Hooligan"),
        Category("Ball", BALL_RULE, count=2, doc="beach balls"),
        Category("Biplane", BIPLANE_RULE, rgb=(238, 209, 128), doc="toy plane"),
        Category("Cart", CART_RULE, count=4, rgb=(214, 214, 214), doc="shopping carts"),
        Category("Radio", RADIO_RULE, count=6, rgb=(52, 0, 128), doc="radios"),
        Category(
            "Moneybag", _loot_rule((1, 3), 77, 84, 15), count=2, rgb=(207, 175, 92), doc="moneybags"
        ),
        Category(
            "Suitcase", _loot_rule((0, 2), 76, 84, 16), count=2, rgb=(207, 175, 92), doc="suitcases"
        ),
        Category(
            "Elevator",
            Bounds((VIOLET, TEAL, LIGHT_TEAL), DOORS, min_size=(5, 18)),
            count=3,
            color_row=3,
            doc="doors, from the ground floor up",
        ),
        Category("Escalator", ESCALATOR_RULE, count=2, rgb=(52, 0, 128), doc="the upper one first"),
        Category(
            "SecuritySystem", Bounds(RADAR_COLORS, (36, 188, 124, 206)), doc="map of the building"
        ),
        display("BonusKops", HATS.rule(SKY, (20, 43, 48, 51), inverse=True), doc="Kops in reserve"),
        display("Score", SCORE.rule(BRIGHT), doc="points"),
        display(
            "Timer",
            Bounds(SKY, TIMER.area, inverse=True, value=TIMER.rule(SKY).value),
            doc="seconds left",
        ),
    ),
)
