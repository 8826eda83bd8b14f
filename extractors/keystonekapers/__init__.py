"""Keystone Kapers: Kelly, the Kop, chases Harry through a department store of four floors.

Picture: docs/games/KeystoneKapers.png

Screen: 250 rows. Each floor is eight screens wide, called *sections* here, and the frame shows the
same section of all four. The picture begins in column 8; the blank left of it hides the fine moves
of the sprites. One drawing loop runs once per floor: player 0 is the thing on it, in up to three
copies, player 1 the Kop or the Krook. A table of the ROM gives each row its colour.

Slots: things take slots from the ground floor up, as many per floor as the levels' tables need. The
elevator has one slot per floor. The upper one of two escalators comes first.

RAM: all from the ROM's drawing loop and object tables. The frame shows the Kop before his last
step, so `as_drawn` undoes a step, a row of a jump and a second of the clock.

Covered: random play, and play to level 40 with the level, the lives and the clock set.

Not exact: on the frame of a lost life, the RAM has nothing of its scene, and REM reads only the
score and the Kops in reserve. When the Kop has just entered a section, the RAM no longer has the
things of the last section. It lacks his pose when he has just begun to duck, and after a collision
the second that he lost last.

VEM: it joins the Kop to black things that touch him, and misses objects that an edge cuts.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    WEST,
    Area,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    IconRow,
    NumberDisplay,
    Packed,
    Raised,
    Run,
    Runs,
    Shape,
    ShortRuns,
    among,
    box,
    copies,
    display,
    edges,
    mod,
    only,
    pick,
    spacing,
    when,
)
from ocjax.extractors.keystonekapers.drawn import Drawn, as_drawn, has_begun_anew
from ocjax.extractors.keystonekapers.pictures import (
    ALL_KINDS,
    KOP_PICTURES,
    KROOK_PICTURES,
    SCREEN_END,
    SCREEN_START,
    THING_HEIGHTS,
    THING_PICTURES,
    figure_extent,
)
from ocjax.extractors.keystonekapers.ram import ROM, Ram, Ride, Thing

FONT = ROM.font(0xF01, rows=7, stride=8)
SCORE = NumberDisplay(FONT, right=70, top=32, digits=6)
TIMER = NumberDisplay(FONT, right=70, top=43, digits=2, leading_zeros=True)
HATS = IconRow(left=24, top=44, width=6, height=6, pitch=8)
HATS_AREA = (20, 43, 48, 51)  # of three hats; the timer begins six columns further right

SKY = 184
WHITE = 12
BRIGHT = 14  # the score
BLACK = 0
SKIN = 74
NAVY = 178  # the Kop's clothes
CHARCOAL = 2  # the Krook's stripes
VIOLET = 192  # escalators, closed doors and radios
FLASHES = (252, 254)  # of a radio's sound
TEAL = 118  # an open elevator
LIGHT_TEAL = 126
RED = 98
BALL_COLORS = (RED, 100, 102)
YELLOW = 44
BROWN = 32
LOOT_COLORS = (BLACK, 36, BROWN, 38, 40, 42, YELLOW, 46)
GOLD = 40  # the upper edge of a floor
OLIVE = 36
RADAR_COLORS = (GOLD, 38, OLIVE)

SECTIONS = 8
FLOOR_COUNT = 4  # from the ground up
ROOF = 3
LOWEST = 156  # first line of the ground floor
FLOOR_LINES = 32
ABOVE_LINES = 6  # from the last line of the floor above to the first line of a floor
STANDS = 6  # line of a floor where the picture of a figure on it begins
FIELD = (SCREEN_START, 57, SCREEN_END, 182)
LOOT_BOTTOM = 26  # the line of a floor below its moneybag or suitcase
BLANKED = 128  # least `Ram.idle` with a black screen

ELEVATOR_SECTION = 4
DOORS = tuple((76, top, 84, top + 25) for top in (155, 123, 91))
OPEN = 7  # of `doors`
RIGHT_END = 0  # sections with escalators
LEFT_END = 7
RADAR = (40, 190, 120, 204)
UPPER_AT_RIGHT = (55, 110, 102, 150)
UPPER_AT_LEFT = (58, 78, 105, 118)
LOWER_AT_LEFT = (58, 142, 105, 182)
RIGHT_ESCALATORS = np.array((UPPER_AT_RIGHT, LOWER_AT_LEFT))  # the lower one is not there
LEFT_ESCALATORS = np.array((UPPER_AT_LEFT, LOWER_AT_LEFT))
RAIL_LEFT = 64  # of the level part of all handrails
RAIL_WIDTH = 32
RAIL_BELOW_TOP = 8  # lines from an escalator's first one down to it
LAST_SECONDS = 10  # of a round, while the display flashes


class Held:  # values of `Ram.thing`, by category
    BALL = (Thing.BALL,)
    BIPLANE = (Thing.BIPLANE, Thing.BIPLANE_TURNS)
    CART = (Thing.CART,)
    RADIO = (Thing.RADIO, Thing.RADIO_SOUNDS)
    MONEYBAG = (Thing.MONEYBAG,)
    SUITCASE = (Thing.SUITCASE,)


def _floor_groups(*groups: tuple[int, ...]) -> np.ndarray:
    """Groups of floors, bool `[group, floor]`; one floor of a group at most has a kind of thing."""
    return np.array([[floor in group for floor in range(FLOOR_COUNT)] for group in groups])


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
        "Ball": _boxes(things, Held.BALL, _floor_groups((0, 1, 2, 3)), most=2).where(known),
        "Biplane": _boxes(things, Held.BIPLANE, _floor_groups((0, 1, 2, 3)), most=1).where(known),
        "Cart": _boxes(things, Held.CART, _floor_groups((0, 1, 3), (2,)), most=2).where(known),
        "Radio": _boxes(things, Held.RADIO, _floor_groups((1, 3), (2,)), most=3).where(known),
        "Moneybag": _boxes(things, Held.MONEYBAG, _floor_groups((1,), (3,)), most=1).where(known),
        "Suitcase": _boxes(things, Held.SUITCASE, _floor_groups((0,), (2,)), most=1).where(known),
        "Elevator": _elevator_boxes(m, kop).where(here),
        "Escalator": _escalator_boxes(kop).where(here),
        "SecuritySystem": edges(*RADAR, shown),
        "BonusKops": HATS.box(lives, shown, value=lives, color=_display_color(m, kop)),
        "Score": SCORE.box(m.score, valid=shown),
        "Timer": TIMER.box(kop.time, valid=here, color=_display_color(m, kop)),
    }


class Things(NamedTuple):
    """The thing on each floor."""

    thing: jax.Array
    x: jax.Array
    y: jax.Array
    width: jax.Array
    height: jax.Array
    nusiz: jax.Array


def _on_floors(m: Ram) -> Things:
    """The things of all floors, at the positions of their first copies."""
    picture = m.thing - ALL_KINDS.start
    left, top, width, height = THING_PICTURES.extent(picture, mirrored=m.thing_left)
    first = m.thing_top - pick(picture, THING_HEIGHTS) + 1
    y = _first_line(np.arange(FLOOR_COUNT)) + first + top
    return Things(m.thing, m.thing_x - 1 + left, y, width, height, m.copies)


def _first_line(floor: jax.Array | np.ndarray) -> jax.Array:
    """The first line of a floor."""
    return LOWEST - FLOOR_LINES * jnp.asarray(floor)


def _boxes(things: Things, kinds: tuple[int, ...], floors: np.ndarray, most: int) -> Box:
    """The copies of a kind of thing, for each group of floors; one floor of a group may hold it."""
    here = among(things.thing, kinds)[None] & floors
    one = jax.tree.map(lambda part: only(here, part[None], axis=1)[:, None], things)
    copy = np.arange(most)[None]
    there = here.any(axis=1)[:, None] & (copy < copies(one.nusiz))
    column = mod(one.x + spacing(one.nusiz) * copy, SCREEN_END)
    parts = (column, one.y, one.width, one.height, there)
    fields = (jnp.broadcast_to(part, there.shape).ravel() for part in parts)
    return box(*fields).clip(*FIELD)


def _kop_box(m: Ram, kop: Drawn) -> Box:
    """The Kop, without the parts hidden by the floor above him."""
    x = kop.x - 1
    is_left = m.faces_left
    left, top, width, height = figure_extent(KOP_PICTURES, kop.pose, x, is_left)
    head = _first_line(kop.floor) + STANDS - kop.height + top
    first, last = _below_ceiling(kop, head, head + height)
    hidden = (m.ride == Ride.ELEVATOR) & ~_is_open(m).any()
    compass = jnp.where(is_left, WEST, EAST)
    whole = edges(x + left, first, x + left + width, last, ~hidden, orientation=compass)
    return whole.clip(*FIELD)


def _below_ceiling(kop: Drawn, head: jax.Array, feet: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The Kop's first line and the line below him, without lines that the floor above hides."""
    ground = _first_line(kop.floor)
    above = ground - ABOVE_LINES
    ceiling = ground - 1 - when(kop.floor == ROOF, 2)
    first = jnp.where((head >= above) & (head < ceiling), ceiling, head)
    last = jnp.where((feet > above) & (feet <= ceiling), above, feet)
    return first, last


def _krook_box(m: Ram, kop: Drawn) -> Box:
    """The Krook, in his section."""
    x = m.krook_x - 1
    is_left = m.krook_left
    left, top, width, height = figure_extent(KROOK_PICTURES, m.krook_pose - 1, x, is_left)
    way = m.krook_place & 2 * SECTIONS - 1  # along two floors: forward on one, back on the other
    section = jnp.where(way < SECTIONS, way, way ^ 2 * SECTIONS - 1)
    y = _first_line(m.krook_place >> 3) + STANDS + top
    here = section == kop.section
    compass = jnp.where(is_left, WEST, EAST)
    return box(x + left, y, width, height, here, orientation=compass).clip(*FIELD)


def _is_open(m: Ram) -> jax.Array:
    """True for each floor with an open elevator."""
    return m.doors == OPEN


def _elevator_boxes(m: Ram, kop: Drawn) -> Box:
    """The elevator's doors on each floor except the roof, open or closed."""
    color = jnp.where(_is_open(m), TEAL, VIOLET)
    left, top, right, bottom = np.array(DOORS).T
    last = bottom - when(_is_open(m), 1)
    return edges(left, top, right, last, valid=kop.section == ELEVATOR_SECTION, color=color)


def _escalator_boxes(kop: Drawn) -> Box:
    """One escalator at the right end of the building, two at the left end."""
    at_right = kop.section == RIGHT_END
    at_left = kop.section == LEFT_END
    left, top, right, bottom = jnp.where(at_right, RIGHT_ESCALATORS, LEFT_ESCALATORS).T
    return edges(left, top, right, bottom, valid=jnp.stack([at_right | at_left, at_left]))


def _display_color(m: Ram, kop: Drawn) -> jax.Array:
    """The colour of timer and hats: black, or flashing in the last seconds."""
    is_ending = (kop.time <= LAST_SECONDS) & ~m.over
    return when(is_ending, (m.clock - 1) & 0xFE)


def _handrail(escalator: Area) -> Run:
    """The level part of the handrail; VEM finds an escalator by it."""
    left, top, right, bottom = escalator
    row = top + RAIL_BELOW_TOP
    return Run(
        BLACK,
        row,
        left=RAIL_LEFT,
        width=RAIL_WIDTH,
        height=bottom - row,
        before=RAIL_LEFT - left,
        above=RAIL_BELOW_TOP,
        after=right - RAIL_LEFT - RAIL_WIDTH,
    )


HANDRAILS = tuple(_handrail(area) for area in (UPPER_AT_LEFT, UPPER_AT_RIGHT, LOWER_AT_LEFT))
HANDRAIL_ROWS = tuple((SCREEN_START, rail.row, SCREEN_END, rail.row + 1) for rail in HANDRAILS)
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
    """Loot in some columns of some floors, starting at line `first` of the floor."""
    tops = [LOWEST - FLOOR_LINES * floor for floor in floors]
    regions = tuple((left, top + first, right, top + LOOT_BOTTOM) for top in tops)
    return Bounds(LOOT_COLORS, regions, min_size=(6, 10))


GAME = Game(
    name="KeystoneKapers",
    rom=ROM,
    ram=Ram,
    decode=decode,
    screen=(250, 160),
    pal=True,
    checks=Checks(
        agreement={"lost": 0.6},  # the scene's records belong to the next life
    ),
    categories=(
        Category(
            "Kop",
            KOP_RULE,
            attributes=("orientation",),
            rgb=(0, 0, 0),
            role="player",
            doc="Keystone Kelly",
        ),
        Category(
            "Krook",
            KROOK_RULE,
            attributes=("orientation",),
            colors=(CHARCOAL, WHITE, SKIN),
            doc="Harry Hooligan",
        ),
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
        Category(
            "Escalator",
            ESCALATOR_RULE,
            count=2,
            rgb=(52, 0, 128),
            colors=(VIOLET, WHITE),
            doc="the upper one first",
        ),
        Category(
            "SecuritySystem",
            Bounds(RADAR_COLORS, (36, 188, 124, 206)),
            colors=(BLACK, 8, BRIGHT),  # the marks; the stripes are floors
            doc="map of the building",
        ),
        display(
            "BonusKops",
            HATS.rule(SKY, HATS_AREA, inverse=True),
            role="lives",
            doc="Kops in reserve",
        ),
        display("Score", SCORE.rule(BRIGHT), role="score", doc="points"),
        display(
            "Timer",
            Bounds(SKY, TIMER.area, inverse=True, value=TIMER.rule(SKY).value),
            role="time",
            doc="seconds left",
        ),
    ),
)
