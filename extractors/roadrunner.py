"""Road Runner: a bird runs from a coyote along desert roads, picks up seed, and shuns trucks.

The screen begins with the last two rows of the score. Seed, steel shot and mines lie in four lanes,
one slot each from the bottom; on the cliff and below rocks, in one. Eight columns at each edge are
blanked. Mountains, dashes of the road, bridges and the sky's frame are scenery.

RAM: OCAtari (what some bytes are), ALE's source (score, lives), and the ROM's code. Bank 0 draws
the road at f114, bank 3 cannons at f01e, rocks at f310 and the cliff at f430. Bank 2 moves all at
f01e after the drawing, which `decode` takes back; in scenes 1, 3, 5 and 7 so are the pointers to
pictures. HMOVE within lines moves seed between lanes. A lost life has the RAM of the new start.

Covered: all eight scenes (beyond scene 0 by writing RAM), lost lives, the end of the game. Not
exact: the columns of a bird that a truck pushes or that stops where it keeps still while the road
moves; figures on the frame on which they stop, begin to run or land; a bonus's last frame; what an
edge cuts; boxes that touch or overlap. To VEM, a burnt coyote without a bird is Player too. VEM
reads no score with a 0, 3, 5, 6 or 8 before the last two digits: what shows of these is the same.
Seed has the bird's colour on its line; beyond the first scene, REM takes that of his body instead.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import among, lookup, pick, reached
from ocjax.console.ram import RamMap, bits, byte, high, low, signed
from ocjax.console.registers import modulo_screen, wrap
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Blobs, Bounds, Gauge
from ocjax.vision.shapes import Shape

ROM = Rom("road_runner", "ce5cc62608be2cd3ed8abd844efb8919")
FONT = ROM.font(0x1F80, rows=2, stride=7)  # the rows that are on the screen
BONUS_PICTURES = (0x1B00 + np.roll(ROM.bytes(0x1C02, 10), 1)).tolist()
BONUS_FONT = ROM.font(BONUS_PICTURES, rows=5, dots=3, shift=1, pitch=4)
VIEW = (8, 2, 152, 210)
LINES = 86  # of the road, where the pictures are
START_X = 0x64
COYOTE_START_X = 0x82
SEED_START_X = 16
STILL = 0x45  # the bird keeps still while the road moves
GONE = 0x91  # a figure beyond is hidden
FAR = 0x50
BACK_LIMIT = 0x90
TRUCK_LIMIT = 0x8E
KINDS = {"Seed": 1, "AcmeMine": 2, "SteelShot": 3}  # of what lies in the lanes
# `scenery`; the last: turret
ROAD = 0x80
NARROW = 3
CLIFFS = 9
GAP = 0xC1
LOOKS_BACK = 0x21
FIRST_LINES = (96, 99, 96, 81, 96, 123, 96, 81)  # of the road, in each scene
REPEATED = (255, 125, 255, 135, 255, 147, 255, 135)  # the first line that repeats a row
NOTHING = 0x1E73  # of `PICTURES`
EDGE = 134  # the road's first row in scenes 3 and 7
# the first two of `scene`, the last one of `scenery` & 15
CLIFF = 1
ROCKS = 5
BRIDGE = 1
# two of `sign`, first `jump`, `bonus_time`
EXIT = 16
BLANK = 0x80
JUMP = 29
JUST_WON = 30
EXITS = (1, 4)  # scenes
SIGN_LINES = (73, 75, 75, 74, 75, 75, 75, 74)  # the first, in each scene
YELLOW = 30
BLACK = 0
GREY = (4, 6)
BODIES = (136, 52)
HUE_ROW = 180
PLAYER_COLORS = (134, 136, 138, 142)
COYOTE_COLORS = (48, 50, 52, 54, 56, 58)
HUES = ROM.bytes(0xC00, 512) & 0xFE  # of the bird in scene 0, by row from the bottom
DRIFTS, MOVES = ((ROM.bytes(at, 9).astype(np.int8) >> 4).tolist() for at in (0x3FD0, 0xA00))
BANKS = np.pad(ROM.data.reshape(4, 4096)[[0, 3]], ((0, 0), (0, LINES - 1)))  # both, then nothing
DRAWN = np.lib.stride_tricks.sliding_window_view(BANKS, LINES, axis=1)[..., ::-1]
PICTURES = Pictures.of(DRAWN.reshape(-1, LINES))  # what each pointer into them draws
TABLES = ROM.bytes(0x3C00, 18).reshape(2, 9), ROM.bytes(0x3EEA, 22).reshape(2, 11)
POSES, COYOTE_POSES = ((4096 + low + (high % 16 << 8)).tolist() for low, high in TABLES)
"""Where `PICTURES` has those of scenes 1, 3, 5 and 7 for a figure at height 0."""


class Ram(RamMap):
    pointers = byte((8, 7), (2, 1))  # to the pictures of the bird and the coyote
    hues = byte(3)  # low byte of the address of the bird's colours
    direction = signed(9)
    y = byte(10)  # upwards
    coyote_y = byte(11)
    bonus = byte(12)  # 1 and hundreds of points
    scene = bits(22, count=3)
    cactus_x = byte(24, 83)
    entry = signed(34)  # of a bridge; less than 0: without a sign
    pose = byte(41, 35)  # of the bird and the coyote
    shown = bits(36, 37, 38, 39, first=1)
    kind = high(36, 37, 38, 39)
    truck_x = byte(42)
    truck = byte(43)  # 0: there is none
    two_cracks = byte(46)  # 0: there is one
    fallen = byte(48)  # rows that rocks have fallen; not 0: there is a turret
    fired = byte(49)  # 0: there is no ball of a turret
    bonus_time = byte(50)  # frames
    waits = signed(51)  # less than 0: the coyote is on his way
    stunned = byte(52)  # frames, of the coyote
    rocket = byte(53)  # 0: he has none
    truck_y = byte(55)  # a turret's column, the lane of what lies on the cliff
    drift = bits(56, first=1, count=3)
    struck = byte(58)  # the bird, not 0
    falls = byte(57)  # the bird, from the cliff
    mirrored = bits(59, 66)  # the bird and the coyote
    runs = byte(60)
    caught = signed(61)
    pace = byte(62)  # of the coyote
    icons = low(68)
    sign = byte(69)
    clock = low(77)
    digits = low(76, 75, 74, 73)  # 10: blank
    aim = byte(78, 79)  # where the coyote goes
    x = byte(80)
    coyote_x = byte(81)
    sign_x = byte(82)
    seed_x = byte(89)
    layout = byte(90)
    scenery = byte(91)
    jump = byte(92)  # frames left
    drawn_x = byte(104)  # the bird's in scenes 1 and 5, else the coyote's
    stick = byte(107)  # direction in which the bird has moved


def decode(m: Ram) -> dict[str, Box]:
    road, even, cannon = m.scenery == ROAD, m.scene & 1 == 0, m.scene & 3 == 3
    x, scrolled = _player_x(m)
    x = jnp.where(even | cannon, x, m.drawn_x)
    coyote_x = jnp.where(road | cannon, m.drawn_x, _coyote_x(m, scrolled))
    entry = (m.scenery & 15 == BRIDGE) & (m.entry >= 0)
    narrow, lower = jnp.where(m.scenery == NARROW, 1, 0), jnp.where(entry, 16, 0)
    digits = jnp.where(m.digits == 10, 0, m.digits)
    score = 100 * jnp.sum(digits * np.array((1000, 100, 10, 1)), dtype=jnp.int32)
    lanes = _lanes(m, scrolled, narrow).where(road | among(m.scenery, (NARROW, CLIFFS, GAP)))
    hue = lookup(HUES, m.hues + HUE_ROW - lanes.y & 511)  # that of the bird on the same line
    hue = jnp.where(m.scene == 0, hue, BODIES[0])
    start = jnp.where(cannon, COYOTE_START_X, START_X)
    lost = jnp.where(even, m.drawn_x > GONE, (m.waits == 0) & (m.drawn_x != start))
    lost = lost & (m.x == START_X) & (m.coyote_x == COYOTE_START_X)
    icons = m.icons + jnp.where(lost, 1, 0)
    truck_x = m.truck_x - 1 - jnp.where(m.truck_x <= TRUCK_LIMIT, scrolled, 0)
    figures = _figures(m, jnp.stack([x, coyote_x]), lower - narrow)
    burnt = jnp.stack([(m.struck > 0) & (m.pose[0] == 0), (m.stunned > 0) & (m.pose[1] == 0)])
    figures = replace(
        figures, color=jnp.where(burnt, jnp.where(even, GREY[1], GREY[0]), np.array(BODIES))
    )
    on_stage = among(coyote_x, range(8, GONE)) & ~lost & ((m.scene != CLIFF) | (m.two_cracks == 0))
    boxes = {
        "Player": figures[0].where((x < GONE) & ~lost | even & (x <= GONE)),
        "Enemy": figures[1].where(on_stage | even & (coyote_x <= GONE)),
        **{name: lanes.where(m.kind == kind) for name, kind in KINDS.items()},
        "Seed": replace(lanes.where(m.kind == KINDS["Seed"]), color=hue),
        **_dangers(m, scrolled, lower, lost),
        **_beside(m, scrolled, road | entry | (narrow > 0), lost),
        "Truck": box(truck_x, m.truck_y + 55, 16, 18, (m.truck > 0) & road).clip(*VIEW),
        "Score": score_box(FONT, jnp.maximum(score, 10), right=103, top=0, digits=6, value=score),
        "Lives": box(55, 16, 8 * icons - 2, 8, icons > 0, value=m.icons + 1),
        "Bonus": _bonus(m),
    }
    return {name: objects.where(m.sign < BLANK) for name, objects in boxes.items()}


def _bonus(m: Ram) -> Box:
    """The number below the road: 100 to 1000, and 100 also where the row of seed was broken."""
    hundreds = jnp.clip(m.bonus - 1, 1, 10)
    x = jnp.where(hundreds == 1, 80, jnp.where(hundreds == 10, 77, 79))
    shown = among(m.bonus_time, range(1, JUST_WON))
    return box(x, 182, 90 - x, 5, shown, value=100 * hundreds)


def _player_x(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The bird's column before it moved, and 1 where the road has moved on since, else 0."""
    free = (m.caught == 0) & (m.runs > 0) & (m.falls == 0)
    onward, backward = free & (m.direction > 0), free & (m.direction < 0)
    near = (m.x < FAR - 1) | (m.x == FAR - 1) & (m.clock & 3 > 0)
    slow = jnp.where(m.clock & 3 == 0, jnp.sign(STILL - m.x), 0)
    step = jnp.where(backward & (m.x != BACK_LIMIT), 1, 0)
    step = jnp.where(onward, jnp.where(near, slow, -1), step)
    carried = (m.caught == 1) & (m.truck > 0) & (m.x == m.truck_x + 8)
    step = jnp.where(carried | (m.caught < 0) & (m.stunned == 0), 1, step)
    return m.x - step, jnp.where(onward & near, 1, 0)


def _coyote_x(m: Ram, scrolled: jax.Array) -> jax.Array:
    """The coyote's column before he moved towards where the bird was lately, or fell back."""
    ahead, level = jnp.sign(m.coyote_x - m.aim[0]), m.coyote_y == m.aim[1]
    falls_back = (m.runs > 0) & (m.clock & 3 == 0)
    step = jnp.where(m.runs == 0, ahead, jnp.where(falls_back, -1, 0))
    steps = jnp.where(level & (m.pace != 1), (m.pace > 1) & (m.clock & 7 == 0), m.clock & 1 == 0)
    steps = steps | level & ((m.runs == 0) | (m.pace == 1) & (m.x >= 0x80))
    chase = jnp.where(level & (m.pace == 0) & falls_back, -1, jnp.where(steps, ahead, 0))
    chase = jnp.where((m.waits >= 0) | (m.falls > 0) | (m.caught > 0), 0, chase)
    x = jnp.where(m.caught < 0, m.drawn_x - 5, m.coyote_x + chase)
    x = jnp.where(m.stunned > 0, m.coyote_x - scrolled, x)
    return jnp.where(m.scene & 1 == 0, m.coyote_x + step, x)


def _looks(m: Ram) -> tuple[jax.Array, jax.Array]:
    """What was drawn of the bird and the coyote, as indices of `PICTURES`; rows a bird falls."""
    paces = among(m.pose, (1, 2))
    moved = (m.stick < 8) & ((m.stick > 0) | paces[0])
    runs = (m.waits < 0) & (m.stunned + m.rocket + m.falls == 0) & (m.caught <= 0)
    changes = jnp.stack([moved & (m.clock & 1 == 0), runs & (m.clock & 3 == 0)])
    pose = jnp.where(paces & changes, 3 - m.pose, m.pose)
    bird = pick(jnp.where(m.jump == JUMP, 2, pose[0]), POSES)
    coyote = pick(jnp.where(m.rocket > 0, 9 + (m.clock & 1), pose[1]), COYOTE_POSES)
    top = jnp.where(m.scenery == CLIFFS, 20, jnp.where(m.y > 6, 36, 6))
    up = moved & among(m.stick, (2, 3, 4)) & ~among(m.y, (1, 28))
    down = moved & among(m.stick, (0, 6, 7)) & (m.y != top)
    step = jnp.where(up, 1, jnp.where(down, -1, 0))
    step = jnp.where(m.falls > 0, jnp.where((m.y < 52) | (m.clock == 0), -3, 0), step)
    y, fallen = m.y + step, jnp.maximum(m.y + step - 36, 0)
    bird = jnp.where(y < 0x3C, bird + y - fallen, NOTHING)
    step = jnp.where(runs & (m.caught == 0), jnp.sign(m.coyote_y - m.aim[1]), 0)
    looks = jnp.stack([bird, coyote + m.coyote_y + step])
    drawn = (m.pointers & 0xFFF) + jnp.where(m.pointers >> 12 == 9, 0, 4096)
    return jnp.where(m.scene & 1 == 0, drawn, looks), fallen


def _figures(m: Ram, x: jax.Array, lower: jax.Array) -> Box:
    """The bird and the coyote; some lines of the screen repeat the row above them."""
    looks, fallen = _looks(m)
    left, top, width, height = PICTURES.extent(looks)
    left = jnp.where(m.mirrored == 1, 8 - left - width, left)
    who, cannon, repeated = np.arange(2), m.scene & 3 == 3, pick(m.scene, REPEATED)
    zoom = jnp.where(cannon & (m.rocket > 0) & (who == 1), 2, 1)

    def line(y: jax.Array) -> jax.Array:
        more = reached(y, (139, 149)) + jnp.where(y >= 151 - who, 1, 0) + who
        return y + jnp.where(y >= repeated, 1, 0) + jnp.where(cannon, more, 0) + lower

    y = pick(m.scene, FIRST_LINES) + top + jnp.where(m.scene & 1 == 0, who, fallen * (1 - who))
    late = cannon & (y + height == EDGE) & (x < 70) & (who == 0)  # repeated by the road's first row
    bottom = line(y + height) + jnp.where(late, 1, 0)
    figures = box(x + zoom * (left + 1) - 1, line(y), zoom * width, bottom - line(y))
    return figures.clip(*VIEW[:3], jnp.where(m.scene == CLIFF, 157, VIEW[3]))


def _dangers(m: Ram, scrolled: jax.Array, lower: jax.Array, lost: jax.Array) -> dict[str, Box]:
    """What the bird meets off the road; rocks fall by twos, a column or more from each other."""
    two, x, cannon = np.arange(2), m.sign_x - scrolled, m.scene & 3 == 3
    crack = (m.scene == CLIFF) & ((two == 0) | (m.two_cracks > 0)) & ~lost
    drift = (2 + two) * pick(m.drift, DRIFTS) - jnp.where(m.fallen < 5, 2, 0)
    top, bottom = (m.fallen + np.array(rows) for rows in ((94, 107), (104, 118)))
    top, bottom = (y + jnp.where(y >= REPEATED[ROCKS], 1, 0) for y in (top, bottom))
    rock = box(modulo_screen(x + 172 - drift), top, 8, bottom - top, m.fallen > 0)
    turret_x = m.truck_y - jnp.where(m.scenery == LOOKS_BACK, 5, 1)
    ball_x = m.truck_x - 2 + jnp.where(m.fallen > 0, 0, 9)
    ball = cannon & (m.fired > 0) & (m.truck_x > 0) & (two == 0)
    return {
        "RoadCrack": box(wrap(x + 64 * two) - 6, 124, 13, 32, crack).clip(*VIEW),
        "Rock": rock.where(m.scene == ROCKS).clip(VIEW[0], 100, VIEW[2], 179),
        "Turret": box(turret_x, 128 + lower, 12, 8, cannon & (m.fallen > 0)).clip(*VIEW),
        "TurretBall": box(ball_x, 128 + lower, 4, 4, ball).clip(*VIEW),
    }


def _lanes(m: Ram, scrolled: jax.Array, lower: jax.Array) -> Box:
    """What lies in the lanes: seed and shot are rows that are shifted, and mines are not."""
    lane, cliff, gap = np.arange(4), m.scenery == CLIFFS, m.scenery == GAP
    move, start = pick(m.layout, MOVES), m.seed_x - scrolled
    late = jnp.where(move < 0, 4 * (4 - lane), 0)
    x = modulo_screen(start + 637 - 9 * move - (3 - lane) * (9 * move + 2) + late)
    x = jnp.where(gap, wrap(start) - np.array((1, 1, 15, 1)), jnp.where(cliff, wrap(start) - 3, x))
    x, width = x - jnp.where(m.kind == KINDS["Seed"], 3, 0), pick(m.kind, (0, 5, 4, 10))
    place = jnp.where(m.scene == ROCKS, 169, jnp.where(m.truck_y == 1, 130, 146))
    y, height = jnp.where(cliff, place, 165 + lower - 14 * lane), jnp.where(cliff, 4, 3)
    y = jnp.where(gap, np.array((138, 0, 117, 106)), y)
    there = (m.shown > 0) & (~cliff | (lane == 3)) & (~gap | (lane != 1))
    return box(x, y, width, height, there).clip(*VIEW)


def _beside(m: Ram, scrolled: jax.Array, road: jax.Array, lost: jax.Array) -> dict[str, Box]:
    """What stands beside the road; where a life is lost, cacti are back at their start."""
    slow = np.array((2, 1))  # cacti move on every fourth and on every other frame
    way = jnp.maximum(m.seed_x - SEED_START_X, 0) >> slow  # how far they had come
    x = m.cactus_x - jnp.where(m.clock & 2 * slow - 1 == 0, scrolled, 0) + jnp.where(lost, way, 0)
    inset = jnp.where((m.scene & 1 == 1) & (slow == 2), 1, 0)  # the upper one is small
    y = np.array((46, 55)) + jnp.where((m.scene == ROCKS) & (m.sign_x < 0x95), 1, 0)
    sign_x = jnp.where(lost, m.seed_x - 1, wrap(m.sign_x - scrolled))
    leaves = among(m.scene, EXITS) & (m.sign == EXIT)
    there = jnp.where(m.scene == 0, m.sign < 3, among(m.sign, (0, 5))) & road | leaves
    top = jnp.where(leaves, 73, pick(m.scene, SIGN_LINES) - jnp.where(m.scenery == NARROW, 1, 0))
    height = jnp.where(leaves | (m.scene == 0), jnp.where(m.scene == CLIFF, 14, 15), 13)
    sign = box(sign_x, top, 16, height)
    return {
        "Cactus": box(x + inset, y, 8 - 3 * inset, 8, m.cactus_x < 0x94).clip(*VIEW),
        "Sign": sign.where(there & (sign_x < 0x99)).clip(*VIEW),
    }


ROAD_VIEW = (8, 90, 152, 182)
PLAYER = Bounds(PLAYER_COLORS, ROAD_VIEW, min_size=(6, 16), exclude=(*KINDS, "Turret"))
BURNT = Blobs(GREY, ROAD_VIEW, Shape(w=(6, 14), h=(16, 37)), gap=(1, 2))
BROWN = functools.partial(Blobs, COYOTE_COLORS, region=ROAD_VIEW, gap=(2, 2))
COYOTE_SHAPES = (
    Shape(w=(5, 9), h=(13, 36)),
    Shape(w=(5, 9), h=(6, 12), pixels=(1, 70)),  # flat
    Shape(w=(10, 16), h=(20, 26)),  # riding
)
COYOTE = BROWN(shapes=COYOTE_SHAPES)
FALLING = BROWN(shapes=(Shape(w=(4, 8), h=(6, 12), pixels=(71, 240)), Shape(w=8, h=(1, 5))))
CRACK_SHAPES = Shape(w=(9, 13), h=32), Shape(w=(1, 6), h=32)  # whole, cut by the edge
CRACKS = BROWN(region=(8, 124, 152, 156), shapes=CRACK_SHAPES)
SEED_SHAPES = (
    Shape(w=(4, 5), h=3, pixels=(14, 18)),
    Shape(w=5, h=4, pixels=24),
    Shape(w=2, h=3, pixels=12),  # cut by the edge
    Shape(w=1, h=3, pixels=8),
)
on_lanes = functools.partial(Blobs, (*PLAYER_COLORS, *GREY), (8, 106, 152, 174), gap=(1, 1))
SEEDS = on_lanes(shapes=SEED_SHAPES)
SHINE = (134, 136, 138, *GREY)
TURRET = Blobs(SHINE, (8, 128, 152, 152), Shape(w=(9, 12), h=8), gap=(1, 1))
TRUCK = Blobs((254, 54), ROAD_VIEW, Shape(w=(4, 16), h=(8, 18)), gap=(1, 3), first=254)
SIGN = Blobs((BLACK, 72, 136), (8, 73, 152, 88), Shape(w=(1, 16), h=(8, 15)), gap=(1, 1))
ICONS = Bounds((142, 62), (55, 16, 103, 24), value=Gauge(8, -2, 1))
SCORE_DIGITS = Digits(FONT, (55, 63, 71, 79), 0, (100_000, 10_000, 1000, 100))  # then two zeros
POINTS = Bounds(YELLOW, (55, 0, 103, 2), value=SCORE_DIGITS)
SEED_POINTS = Bounds(BLACK, (70, 182, 95, 187), value=Digits(BONUS_FONT, (76, 79, 83, 87), 182))
GAME = Game(
    name="RoadRunner",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", PLAYER, otherwise=BURNT, doc="the bird"),
        Category("Enemy", COYOTE, color_row=2, otherwise=BURNT, doc="the coyote"),
        Category("Seed", SEEDS, count=4, color_row=-1, doc="lane"),
        Category("AcmeMine", on_lanes(shapes=Shape(w=4, h=(3, 4), pixels=(19, 99))), 4, doc="lane"),
        Category("SteelShot", on_lanes(shapes=Shape(w=(6, 10), h=3)), count=4, doc="lane"),
        Category("RoadCrack", CRACKS, count=2, doc="in the cliff"),
        Category("Rock", FALLING, count=2, doc="upper, lower"),
        Category("Turret", TURRET, doc="below a bridge"),
        Category("TurretBall", BROWN(shapes=Shape(w=4, h=4)), 2, doc="of the turret"),
        Category("Cactus", Bounds(24, ((8, 46, 152, 55), (8, 55, 152, 64))), 2, doc="by height"),
        Category("Sign", SIGN, doc="beside the road"),
        Category("Truck", TRUCK, rgb=(198, 108, 58), doc="on the road"),
        display("Score", POINTS, doc="points"),
        display("Lives", ICONS, aliases=("Bird",), doc="one more than the icons"),
        display("Bonus", SEED_POINTS, needs=("Score",), doc="for a seed"),
    ),
)
