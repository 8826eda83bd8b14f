"""Road Runner: a bird runs from a coyote along desert roads, picks up seed, and shuns trucks.

Picture: docs/games/RoadRunner.png

Screen: it begins with the last two rows of the score. Eight columns at each edge are blank.
Mountains, dashes of the road, bridges and the sky's frame are scenery.

Slots: seed, steel shot and mines have one slot for each of four lanes, from the bottom.

RAM: OCAtari (meaning of some bytes), ALE's source (score, lives), and the ROM's code. Bank 0 draws
the road at f114, bank 3 cannons at f01e, rocks at f310 and the cliff at f430. Bank 2 moves
everything at f01e after the drawing; in scenes 1, 3, 5 and 7 it also changes the pointers to
pictures. `as_drawn` undoes this. HMOVE within lines moves seed between lanes. After a lost life the
RAM has the new start.

Covered: all eight scenes (beyond scene 0 by writing RAM), lost lives, the end of the game.

Not exact: the columns of a bird that a truck pushes, or that stops at the column where it keeps
still while the road moves; figures on the frame on which they stop, begin to run or land; a bonus's
last frame; objects that an edge cuts; boxes that touch or overlap. Seed has the bird's colour on
its line; beyond the first scene, REM takes the colour of the bird's body instead.

VEM: a burnt coyote without a bird is Player too. A score with a 0, 3, 5, 6 or 8 before the last two
digits is unknown, because the visible rows of these digits are equal.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Digits,
    Game,
    IconRow,
    NumberDisplay,
    Shape,
    among,
    box,
    display,
    lookup,
    match,
    modulo_screen,
    pick,
    when,
    wrap,
)
from ocjax.extractors.roadrunner.drawn import (
    BODIES,
    BURNT_GRAYS,
    REPEATED_LINES,
    VIEW,
    Drawn,
    as_drawn,
    below_bridge,
    figure_boxes,
    has_cannon,
    open_road,
)
from ocjax.extractors.roadrunner.ram import ROM, Ram, Scene, Scenery


def _nibbles(address: int) -> list[int]:
    """A table of the ROM with nine entries, signed, in the upper four bits."""
    return (ROM.bytes(address, 9).astype(np.int8) >> 4).tolist()


FONT = ROM.font(0x1F80, rows=2, stride=7)  # the rows that are on the screen
BONUS_PICTURES = (0x1B00 + np.roll(ROM.bytes(0x1C02, 10), 1)).tolist()
BONUS_FONT = ROM.font(BONUS_PICTURES, rows=5, dots=3, shift=1, pitch=4)
SCORE = NumberDisplay(FONT, right=103, top=0, digits=6)
ICONS = IconRow(left=55, top=16, width=6, height=8, pitch=8)

SEED_START_X = 16
TRUCK_LIMIT = 142  # a truck to the right of it does not move with the road
JUST_WON = 30  # `bonus_time` before a bonus is shown
BLANK_DIGIT = 10

SIGN_LINES = (73, 75, 75, 74, 75, 75, 75, 74)  # the first line, by scene
EXITS = (1, 4)  # scenes that are left past a sign

YELLOW = 30
BLACK = 0
PLAYER_COLORS = (134, 136, 138, 142)
COYOTE_COLORS = (48, 50, 52, 54, 56, 58)
HUE_ROW = 180  # row that `hues` points at
HUES = ROM.bytes(0xC00, 512) & 0xFE  # of the bird in scene 0, by row from the bottom
DRIFTS = _nibbles(0x3FD0)  # columns of the rocks, by `drift`
MOVES = _nibbles(0xA00)  # columns from lane to lane, by `layout`
WIDTHS = (0, 5, 4, 10)  # of objects in the lanes, by `kind`


class Sign:  # of `Ram.sign`
    STANDS = (0, 5)
    LAST_AT_START = 2  # of scene 0: last value with a sign
    EXIT = 16
    BLANK = 128  # least `sign` with a blank screen


class Kind:  # of `Ram.kind`
    SEED = 1
    MINE = 2
    SHOT = 3


def decode(m: Ram) -> dict[str, Box]:
    d = as_drawn(m)
    pair = figure_boxes(m, d)
    lanes = _lane_boxes(m, d)
    boxes = {
        "Player": pair[0],
        "Enemy": pair[1],
        "Seed": _seed(m, lanes),
        "AcmeMine": lanes.where(m.kind == Kind.MINE),
        "SteelShot": lanes.where(m.kind == Kind.SHOT),
        "RoadCrack": _crack_boxes(m, d),
        "Rock": _rocks(m, d),
        "Turret": _turret_box(m, d),
        "TurretBall": _turret_ball(m, d),
        "Cactus": _cacti(m, d),
        "Sign": _sign_box(m, d),
        "Truck": _truck_box(m, d),
        "Score": _score_box(m),
        "Lives": ICONS.box(m.icons + when(d.lost, 1), value=m.icons + 1),
        "Bonus": _bonus(m),
    }
    return {name: objects.where(m.sign < Sign.BLANK) for name, objects in boxes.items()}


def _lane_boxes(m: Ram, d: Drawn) -> Box:
    """Objects in the lanes: seed and shot are shifted rows, mines are not."""
    lane = np.arange(4)
    cliff = m.scenery == Scenery.CLIFFS
    gap = m.scenery == Scenery.GAP
    start = wrap(m.seed_x - d.scrolled)
    lane_x = match(
        (gap, start - np.array((1, 1, 15, 1))),
        (cliff, start - 3),
        otherwise=_road_x(m, d),
    )
    on_cliff = match((m.scene == Scene.ROCKS, 169), (m.truck_y == 1, 130), otherwise=146)
    y = match(
        (gap, np.array((138, 0, 117, 106))),
        (cliff, on_cliff),
        otherwise=165 + d.narrow - 14 * lane,
    )
    shown = m.shown & (~cliff | (lane == 3)) & (~gap | (lane != 1))
    there = shown & among(m.scenery, (*Scenery.LANED, Scenery.CLIFFS, Scenery.GAP))
    x = lane_x - when(m.kind == Kind.SEED, 3)
    height = jnp.where(cliff, 4, 3)
    return box(x, y, pick(m.kind, WIDTHS), height, there).clip(*VIEW)


def _road_x(m: Ram, d: Drawn) -> jax.Array:
    """Columns on the road, from the bottom lane up."""
    lane = np.arange(4)
    move = pick(m.layout, MOVES)
    late = when(move < 0, 4 * (4 - lane))
    shifted = (3 - lane) * (9 * move + 2)
    return modulo_screen(m.seed_x - d.scrolled + 637 - 9 * move - shifted + late)


def _seed(m: Ram, lanes: Box) -> Box:
    """Seed has the colour of the bird on the same line."""
    hue = lookup(HUES, (m.hues + HUE_ROW - lanes.y) & 511)
    color = jnp.where(m.scene == Scene.START, hue, BODIES[0])
    return replace(lanes.where(m.kind == Kind.SEED), color=color)


def _crack_boxes(m: Ram, d: Drawn) -> Box:
    second = np.arange(2)
    there = (m.scene == Scene.CLIFF) & ((second == 0) | (m.two_cracks > 0)) & ~d.lost
    x = wrap(m.sign_x - d.scrolled + 64 * second)
    return box(x - 6, 124, 13, 32, there).clip(*VIEW)


def _rocks(m: Ram, d: Drawn) -> Box:
    """Rocks fall in pairs, a column or more from each other."""
    drift = np.array((2, 3)) * pick(m.drift, DRIFTS) - when(m.fallen < 5, 2)
    top = _below_repeated_line(m.fallen + np.array((94, 107)))
    bottom = _below_repeated_line(m.fallen + np.array((104, 118)))
    there = (m.fallen > 0) & (m.scene == Scene.ROCKS)
    x = modulo_screen(m.sign_x - d.scrolled + 172 - drift)
    return box(x, top, 8, bottom - top, there).clip(VIEW[0], 100, VIEW[2], 179)


def _below_repeated_line(y: jax.Array) -> jax.Array:
    """Lines of rows that the scene's repeated line pushes down."""
    return y + when(y >= REPEATED_LINES[Scene.ROCKS], 1)


def _turret_box(m: Ram, d: Drawn) -> Box:
    x = m.truck_y - jnp.where(m.scenery == Scenery.LOOKS_BACK, 5, 1)
    return box(x, 128 + d.lower, 12, 8, has_cannon(m) & (m.fallen > 0)).clip(*VIEW)


def _turret_ball(m: Ram, d: Drawn) -> Box:
    x = m.truck_x - 2 + jnp.where(m.fallen > 0, 0, 9)
    flies = has_cannon(m) & (m.fired > 0) & (m.truck_x > 0)
    return box(x, 128 + d.lower, 4, 4, flies & np.array((True, False))).clip(*VIEW)


def _cacti(m: Ram, d: Drawn) -> Box:
    """The upper and the lower cactus; after a lost life, they are back at their start."""
    slow = np.array((2, 1))  # cacti move on every fourth and on every other frame
    way = jnp.maximum(m.seed_x - SEED_START_X, 0) >> slow  # columns that they had come
    moved = (m.clock & (2 * slow - 1)) == 0
    x = m.cactus_x - when(moved, d.scrolled) + when(d.lost, way)
    inset = when(~open_road(m) & (slow == 2), 1)  # the upper one is small
    y = np.array((46, 55)) + when((m.scene == Scene.ROCKS) & (m.sign_x < 149), 1)
    there = (m.cactus_x < 148) | (slow == 1)
    top, bottom = _cactus_rows(x, inset == 0)
    return box(x + inset, y + top, 8 - 3 * inset, bottom - top, there).clip(*VIEW)


def _cactus_rows(x: jax.Array, large: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The rows of the visible part of cacti: beside the edges of the view, only of an arm.

    Returns the first one, and the row after the last one.
    """
    columns_out = when(large, VIEW[0] - x)
    columns_in = jnp.where(large, VIEW[2] - x, 8)
    top = match((columns_out > 4, 2), (columns_in < 4, 5), otherwise=0)
    bottom = match((columns_out > 6, 5), (columns_out > 4, 6), (columns_in < 4, 7), otherwise=8)
    return top, bottom


def _sign_box(m: Ram, d: Drawn) -> Box:
    x = jnp.where(d.lost, m.seed_x - 1, wrap(m.sign_x - d.scrolled))
    at_start = m.scene == Scene.START
    leaves = among(m.scene, EXITS) & (m.sign == Sign.EXIT)
    stands = jnp.where(at_start, m.sign <= Sign.LAST_AT_START, among(m.sign, Sign.STANDS))
    beside = among(m.scenery, Scenery.LANED) | below_bridge(m)
    top = jnp.where(leaves, 73, pick(m.scene, SIGN_LINES) - d.narrow)
    full = jnp.where(m.scene == Scene.CLIFF, 14, 15)
    height = jnp.where(leaves | at_start, full, 13)
    return box(x, top, 16, height, ((stands & beside) | leaves) & (x < 153)).clip(*VIEW)


def _truck_box(m: Ram, d: Drawn) -> Box:
    x = m.truck_x - 1 - when(m.truck_x <= TRUCK_LIMIT, d.scrolled)
    there = (m.truck > 0) & (m.scenery == Scenery.ROAD)
    return box(x, m.truck_y + 55, 16, 18, there).clip(*VIEW)


def _score_box(m: Ram) -> Box:
    digits = jnp.where(m.digits == BLANK_DIGIT, 0, m.digits)
    value = 100 * jnp.sum(digits * np.array((1000, 100, 10, 1)), dtype=jnp.int32)
    return SCORE.box(jnp.maximum(value, 10), value=value)  # the last two zeros are always visible


def _bonus(m: Ram) -> Box:
    """The number below the road: 100 to 1000, and 100 also if the row of seed was broken."""
    hundreds = jnp.clip(m.bonus - 1, 1, 10)
    x = match((hundreds == 1, 80), (hundreds == 10, 77), otherwise=79)
    shown = among(m.bonus_time, range(1, JUST_WON))
    return box(x, 182, 90 - x, 5, shown, value=100 * hundreds)


ROAD_VIEW = (8, 90, 152, 182)
PLAYER = Bounds(
    PLAYER_COLORS, ROAD_VIEW, min_size=(6, 16), exclude=("Seed", "AcmeMine", "SteelShot", "Turret")
)
BURNT = Blobs(BURNT_GRAYS, ROAD_VIEW, Shape(w=(6, 14), h=(16, 37)), gap=(1, 2))
BROWN = functools.partial(Blobs, COYOTE_COLORS, region=ROAD_VIEW, gap=(2, 2))
COYOTE_SHAPES = (
    Shape(w=(5, 9), h=(13, 36)),
    Shape(w=(5, 9), h=(6, 12), pixels=(1, 70)),  # flat
    Shape(w=(10, 16), h=(20, 26)),  # riding
)
COYOTE = BROWN(shapes=COYOTE_SHAPES)
FALLING = BROWN(shapes=(Shape(w=(4, 8), h=(6, 12), pixels=(71, 240)), Shape(w=8, h=(1, 5))))
CRACK_SHAPES = Shape(w=(9, 13), h=32), Shape(w=(1, 6), h=32)  # complete, cut by the edge
CRACKS = BROWN(region=(8, 124, 152, 156), shapes=CRACK_SHAPES)
SEED_SHAPES = (
    Shape(w=(4, 5), h=3, pixels=(14, 18)),
    Shape(w=5, h=4, pixels=24),
    Shape(w=2, h=3, pixels=12),  # cut by the edge
    Shape(w=1, h=3, pixels=8),
)
on_lanes = functools.partial(Blobs, (*PLAYER_COLORS, *BURNT_GRAYS), (8, 106, 152, 174), gap=(1, 1))
SEEDS = on_lanes(shapes=SEED_SHAPES)
SHINE = (134, 136, 138, *BURNT_GRAYS)
TURRET = Blobs(SHINE, (8, 128, 152, 152), Shape(w=(9, 12), h=8), gap=(1, 1))
TRUCK = Blobs((254, 54), ROAD_VIEW, Shape(w=(4, 16), h=(8, 18)), gap=(1, 3), first=254)
SIGN_FIGURE = Blobs((BLACK, 72, 136), (8, 73, 152, 88), Shape(w=(1, 16), h=(8, 15)), gap=(1, 1))
SCORE_DIGITS = Digits(FONT, SCORE.lefts[:4], SCORE.top, (100_000, 10_000, 1000, 100))  # 2 zeros
POINTS = Bounds(YELLOW, SCORE.area, value=SCORE_DIGITS)
SEED_POINTS = Bounds(BLACK, (70, 182, 95, 187), value=Digits(BONUS_FONT, (76, 79, 83, 87), 182))
GAME = Game(
    name="RoadRunner",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        rare=(
            "Cactus",
            "AcmeMine",
            "Enemy",
            "Player",
            "RoadCrack",
            "Rock",
            "Sign",
            "Truck",
            "Turret",
            "TurretBall",
        ),
        # The ROM gives no more lives.
        at_limits={"Lives": (4, 5, 6, 7, 3), "Bonus": (0, 0, 0, 0, 1000)},
        known={"Score": 0.85},  # two rows of its digits; five of ten digits look alike there
    ),
    categories=(
        Category("Player", PLAYER, otherwise=BURNT, role="player", doc="the bird"),
        Category("Enemy", COYOTE, color_row=2, otherwise=BURNT, doc="the coyote"),
        Category("Seed", SEEDS, count=4, color_row=-1, doc="lane"),
        Category("AcmeMine", on_lanes(shapes=Shape(w=4, h=(3, 4), pixels=(19, 99))), 4, doc="lane"),
        Category("SteelShot", on_lanes(shapes=Shape(w=(6, 10), h=3)), count=4, doc="lane"),
        Category("RoadCrack", CRACKS, count=2, doc="in the cliff"),
        Category("Rock", FALLING, count=2, doc="upper, lower"),
        Category("Turret", TURRET, doc="below a bridge"),
        Category("TurretBall", BROWN(shapes=Shape(w=4, h=4)), 2, doc="of the turret"),
        Category("Cactus", Bounds(24, ((8, 46, 152, 55), (8, 55, 152, 64))), 2, doc="by height"),
        Category("Sign", SIGN_FIGURE, doc="beside the road"),
        Category("Truck", TRUCK, rgb=(198, 108, 58), colors=(254, 54, 14, 52), doc="on the road"),
        display("Score", POINTS, role="score", doc="points"),
        display(
            "Lives",
            ICONS.rule((142, 62), (55, 16, 103, 24), single=2),
            aliases=("Bird",),
            role="lives",
            doc="one more than the icons",
        ),
        display("Bonus", SEED_POINTS, needs=("Score",), doc="for a seed"),
    ),
)
