"""Road Runner: a bird runs from a coyote along desert roads, picks up seed, and shuns trucks.

The screen begins in the middle of the score, whose last two rows show. Seed, steel shot and mines
lie in four lanes: slot lane, the lowest one first. Eight columns at each edge are blanked.
Mountains, dashes of the road, bridges and the frame of the sky are scenery.

RAM: OCAtari (what some bytes are), ALE's source (score, lives), and the ROM's code. Bank 0 draws
the road at f114, bank 3 cannons at f01e, rocks at f310 and the cliff at f430. Bank 2 moves all at
f01e, after the frame was drawn, which `decode` takes back. In scenes 1, 3, 5 and 7 the pointers to
pictures are those of the next frame, too. HMOVE in the middle of lines moves seed from lane to
lane. On the frame of a lost life the RAM is as at the new start.

Covered: all eight scenes (beyond scene 0 by writing RAM), lost lives, the end of the game.
Not exact: the columns of a bird that stops where it keeps still while the road moves, or that a
truck pushes, and the coyote's where the road is narrow; figures on the frame on which they stop,
begin to run or land; the last of 30 frames of a bonus; figures and cracks that an edge cuts; boxes
that cover each other. In scenes 1, 3, 5 and 7, 93 to 97 % of REM's figures are exact. VEM does
not see burnt figures and turrets, which are grey; it takes details of the bird for seed, and words
between scenes for a sign.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box
from ocjax.console import modulo_screen, signed_nibble, wrap
from ocjax.digits import score_box
from ocjax.game import Game
from ocjax.ops import among, lookup, pick
from ocjax.ram import RamMap, bits, byte, low, signed
from ocjax.rom import Rom
from ocjax.rules import Blobs, Bounds, Category, Gauge, display

ROM = Rom("road_runner", "ce5cc62608be2cd3ed8abd844efb8919")
FONT = ROM.font(0x1F80, rows=2, stride=7)  # the rows that are on the screen

VIEW = (8, 2, 152, 210)
LINES = 86  # of the road, where the pictures are
STILL = 0x45  # the bird keeps this column while the road moves
START_X, COYOTE_START_X, SEED_START_X = 0x64, 0x82, 16
GONE = 0x91  # a figure beyond this column is hidden
FAR, BACK_LIMIT, TRUCK_LIMIT = 0x50, 0x90, 0x8E
SHOWN = 2  # bit of `lane`
SEED, MINE, SHOT = 1, 2, 3  # `kind`
ROAD, NARROW, CLIFFS = 0x80, 3, 9  # `scenery`
GAP, LOOKS_BACK = 0xC1, 0x21  # the same: seed below a bridge, a turret that looks to the right
FIRST_LINES = (96, 99, 96, 81, 96, 123, 96, 81)  # of the road, in each scene
REPEATED = (255, 125, 255, 135, 255, 147, 255, 135)  # the first line that repeats a row
NOTHING = 0x1E73  # of `EXTENTS`
JUST_WON = 30  # `bonus_time` on the frame on which a bonus is won
CLIFF, ROCKS, BRIDGE = 1, 5, 1  # the first two of `scene`, the last one of `scenery` & 15
BLANK, JUMP = 0x80, 29  # least `sign` between scenes, `jump` on its first frame
YELLOW, BLACK = 30, 0
PLAYER_COLORS = (134, 136, 138, 142)
COYOTE_COLORS = (48, 50, 52, 54, 56, 58)
"""The colours of the pictures; the ones of the mountains are among them."""


def _extents() -> np.ndarray:
    """First line, height, first column and width of what each pointer draws, of banks 0 and 3."""
    out = np.zeros(2 * 4096, np.int32)
    columns = 1 << np.arange(7, -1, -1)
    for i, bank in enumerate((0, 3)):
        data = np.pad(ROM.bytes(4096 * bank, 4096), (0, LINES))
        rows = np.lib.stride_tricks.sliding_window_view(data, LINES)[:4096, ::-1]
        used = rows > 0
        ink = np.bitwise_or.reduce(rows, axis=1)[:, None] & columns > 0
        top, height = used.argmax(1), LINES - used[:, ::-1].argmax(1) - used.argmax(1)
        left, right = ink.argmax(1), 8 - ink[:, ::-1].argmax(1)
        packed = top | height << 8 | left << 16 | (right - left) << 20
        out[4096 * i : 4096 * (i + 1)] = np.where(used.any(1), packed, 0)
    return out


EXTENTS = _extents()


def _poses(low: int, high: int, count: int) -> list[int]:
    """Where `EXTENTS` has the pictures of scenes 1, 3, 5 and 7 for a figure at height 0."""
    return (4096 + ROM.bytes(low, count) + (ROM.bytes(high, count) % 16 << 8)).tolist()


POSES, COYOTE_POSES = _poses(0x3C00, 0x3C09, 9), _poses(0x3EEA, 0x3EF5, 11)
DRIFTS = (ROM.bytes(0x3FD0, 8) >> 4).tolist()  # of rocks, signed nibbles


class Ram(RamMap):
    coyote_look = byte((2, 1))  # pointer to its picture
    player_look = byte((8, 7))
    direction = signed(9)
    y = byte(10)  # upwards
    coyote_y = byte(11)
    bonus = byte(12)  # 1 and hundreds of points
    scene = bits(22, count=3)
    cactus_x = byte(24, 83)
    entry = signed(34)  # of a bridge; less than 0: without a sign
    coyote_pose = byte(35)
    lane = byte(36, 37, 38, 39)
    pose = byte(41)
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
    falls = byte(57)  # the bird, from the cliff
    player_right = bits(59)
    runs = byte(60)
    caught = signed(61)
    pace = byte(62)  # of the coyote
    coyote_right = bits(66)
    icons = low(68)
    sign = byte(69)
    clock = low(77)
    digits = low(76, 75, 74, 73)  # 10: blank
    aim_x = byte(78)
    aim_y = byte(79)
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
    coyote_x = jnp.where(even, _coyote_x(m), _chaser_x(m, scrolled))
    coyote_x = jnp.where(road | cannon, m.drawn_x, coyote_x)
    narrow = jnp.where(m.scenery == NARROW, 1, 0)
    entry = (m.scenery & 15 == BRIDGE) & (m.entry >= 0)
    lower = jnp.where(entry, 16, 0) - narrow
    digits = jnp.where(m.digits == 10, 0, m.digits)
    score = 100 * (1000 * digits[0] + 100 * digits[1] + 10 * digits[2] + digits[3])
    lanes = _lanes(m, scrolled, narrow).where(road | among(m.scenery, (NARROW, CLIFFS, GAP)))
    kind = m.lane >> 4
    start = jnp.where(cannon, COYOTE_START_X, START_X)
    lost = jnp.where(even, m.drawn_x > GONE, (m.waits == 0) & (m.drawn_x != start))
    lost = lost & (m.x == START_X) & (m.coyote_x == COYOTE_START_X)
    icons = m.icons + jnp.where(lost, 1, 0)
    sign_x = jnp.where(lost, m.seed_x - 1, wrap(m.sign_x - scrolled))
    has_sign = jnp.where(m.scene == 0, m.sign < 3, among(m.sign, (0, 5))) & (sign_x < 0x99)
    sign_y, sign_h = pick(m.scene, (73, 75, 75, 74)), jnp.where(m.scene == 0, 15, 13)
    sign_y = jnp.where(m.scene == 7, 74, jnp.where(m.scene > 3, 75, sign_y))
    truck_x = m.truck_x - 1 - jnp.where(m.truck_x <= TRUCK_LIMIT, scrolled, 0)
    look, coyote_look = _looks(m)
    player = _figure(m, look, x, m.player_right, 0, lower)
    coyote = _figure(m, coyote_look, coyote_x, m.coyote_right, 1, lower)
    on_stage = (coyote_x < GONE) & (coyote_x >= 8) & ~lost
    boxes = {
        "Player": player.where((x < GONE) & ~lost | even & (x <= GONE)),
        "Enemy": coyote.where(on_stage | even & (coyote_x <= GONE)),
        "Seed": lanes.where(kind == SEED),
        "AcmeMine": lanes.where(kind == MINE),
        "SteelShot": lanes.where(kind == SHOT),
        **_dangers(m, scrolled, cannon, lost),
        "Cactus": _cacti(m, scrolled, lost).clip(*VIEW),
        "Sign": box(sign_x, sign_y, 16, sign_h, has_sign & (road | entry)).clip(*VIEW),
        "Truck": box(truck_x, m.truck_y + 55, 16, 18, (m.truck > 0) & road).clip(*VIEW),
        "Score": score_box(FONT, jnp.maximum(score, 10), right=103, top=0, digits=6, value=score),
        "Lives": box(55, 16, 8 * icons - 2, 8, icons > 0, value=m.icons + 1),
        "Bonus": _bonus(m),
    }
    return {name: objects.where(m.sign < BLANK) for name, objects in boxes.items()}


def _player_x(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The bird's column before it moved, and 1 where the road has moved on since, else 0."""
    free = (m.caught == 0) & (m.runs > 0) & (m.falls == 0)
    onward, backward = free & (m.direction > 0), free & (m.direction < 0)
    slow = jnp.where(m.x < STILL, 1, jnp.where(m.x == STILL, 0, -1))
    near = (m.x < FAR - 1) | (m.x == FAR - 1) & (m.clock & 3 > 0)
    slow = jnp.where(m.clock & 3 == 0, slow, 0)
    step = jnp.where(onward, jnp.where(near, slow, -1), 0)
    step = jnp.where(backward & (m.x != BACK_LIMIT), 1, step)
    carried = (m.caught == 1) & (m.truck > 0) & (m.x == m.truck_x + 8)
    step = jnp.where(carried | (m.caught < 0) & (m.stunned == 0), 1, step)
    return m.x - step, jnp.where(onward & near, 1, 0)


def _coyote_x(m: Ram) -> jax.Array:
    """The coyote's column before it moved towards the place where the bird was lately."""
    after = jnp.sign(m.coyote_x - m.aim_x)
    return m.coyote_x + jnp.where(m.runs == 0, after, jnp.where(m.clock & 3 == 0, -1, 0))


def _chaser_x(m: Ram, scrolled: jax.Array) -> jax.Array:
    """The same in scenes 1 and 5, where he falls back while the bird runs on."""
    climbs = m.coyote_y != m.aim_y
    steps = jnp.where(climbs | (m.pace == 1), m.clock & 1 == 0, (m.pace > 1) & (m.clock & 7 == 0))
    steps = steps | ~climbs & ((m.runs == 0) | (m.pace == 1) & (m.x >= 0x80))
    ahead = jnp.where(steps, jnp.sign(m.coyote_x - m.aim_x), 0)
    falls_back = ~climbs & (m.runs > 0) & (m.pace == 0) & (m.clock & 3 == 0)
    x = m.coyote_x + jnp.where(falls_back, -1, ahead)
    x = jnp.where((m.waits >= 0) | (m.falls > 0) | (m.caught > 0), m.coyote_x, x)
    x = jnp.where(m.caught < 0, m.drawn_x - 5, x)
    return jnp.where(m.stunned > 0, m.coyote_x - scrolled, x)


def _looks(m: Ram) -> tuple[jax.Array, jax.Array]:
    """What was drawn of the bird and the coyote, as indices of `EXTENTS`."""
    paces = among(m.pose, (1, 2))
    moved = (m.stick < 8) & ((m.stick > 0) | paces)
    pose = jnp.where(moved & paces & (m.clock & 1 == 0), 3 - m.pose, m.pose)
    pose = jnp.where(m.jump == JUMP, 2, pose)
    top = jnp.where(m.scenery == CLIFFS, 20, jnp.where(m.y > 6, 36, 6))
    up, down = among(m.stick, (2, 3, 4)), among(m.stick, (0, 6, 7))
    step = jnp.where(up & ~among(m.y, (1, 28)), 1, jnp.where(down & (m.y != top), -1, 0))
    step = jnp.where(moved, step, 0)
    step = jnp.where(m.falls > 0, jnp.where((m.y < 52) | (m.clock == 0), -3, 0), step)
    look = jnp.where(m.y + step < 0x3C, pick(pose, POSES) + m.y + step, NOTHING)
    runs = (m.waits < 0) & (m.stunned + m.rocket + m.falls == 0) & (m.caught <= 0)
    paces = runs & (m.clock & 3 == 0) & among(m.coyote_pose, (1, 2))
    pose = jnp.where(paces, 3 - m.coyote_pose, m.coyote_pose)
    pose = jnp.where(m.rocket > 0, jnp.where(m.clock & 1 == 0, 9, 10), pose)
    step = jnp.where(runs & (m.caught == 0), jnp.sign(m.coyote_y - m.aim_y), 0)
    looks = look, pick(pose, COYOTE_POSES) + m.coyote_y + step
    even, pointers = m.scene & 1 == 0, (m.player_look, m.coyote_look)
    drawn = ((p & 0xFFF) + jnp.where(p >> 12 == 9, 0, 4096) for p in pointers)
    first, second = (jnp.where(even, *both) for both in zip(drawn, looks, strict=True))
    return first, second


def _figure(
    m: Ram, look: jax.Array, x: jax.Array, flipped: jax.Array, who: int, lower: jax.Array
) -> Box:
    """The box of a picture; some lines of the screen repeat the row above them."""
    packed = lookup(EXTENTS, look)
    left, width = packed >> 16 & 15, packed >> 20
    left = jnp.where(flipped == 1, 8 - left - width, left)
    cannon, repeated = m.scene & 3 == 3, pick(m.scene, REPEATED)

    def line(y: jax.Array) -> jax.Array:
        more = sum(jnp.where(y >= limit, 1, 0) for limit in (139, 149, 151 - who))
        return y + jnp.where(y >= repeated, 1, 0) + jnp.where(cannon, more + who, 0) + lower

    y = pick(m.scene, FIRST_LINES) + (packed & 255) + jnp.where(m.scene & 1 == 0, who, 0)
    top, bottom = line(y), line(y + (packed >> 8 & 255))
    cut = jnp.where(m.scene == CLIFF, 157, VIEW[3])
    return box(x + left, top, width, bottom - top).clip(*VIEW[:3], cut)


def _dangers(m: Ram, scrolled: jax.Array, cannon: jax.Array, lost: jax.Array) -> dict[str, Box]:
    """What the bird meets off the road; rocks fall by twos, a column or more from each other."""
    two, x = np.arange(2), m.sign_x - scrolled
    crack = (m.scene == CLIFF) & ((two == 0) | (m.two_cracks > 0)) & ~lost
    drift = (2 + two) * signed_nibble(pick(m.drift, DRIFTS)) - jnp.where(m.fallen < 5, 2, 0)
    top, bottom = (m.fallen + np.array(rows) for rows in ((94, 107), (104, 118)))
    top, bottom = (y + jnp.where(y >= REPEATED[ROCKS], 1, 0) for y in (top, bottom))
    rock = box(modulo_screen(x + 172 - drift), top, 8, bottom - top, m.fallen > 0)
    turret_x = m.truck_y - jnp.where(m.scenery == LOOKS_BACK, 5, 1)
    ball_x = m.truck_x - 2 + jnp.where(m.fallen > 0, 0, 9)
    ball = cannon & (m.fired > 0) & (m.truck_x > 0) & (two == 0)
    return {
        "RoadCrack": box(wrap(x + 64 * two) - 6, 124, 13, 32, crack).clip(*VIEW),
        "Rock": rock.where(m.scene == ROCKS).clip(VIEW[0], 100, VIEW[2], 179),
        "Turret": box(turret_x, 128, 12, 8, cannon & (m.fallen > 0)).clip(*VIEW),
        "TurretBall": box(ball_x, 128, 4, 4, ball).clip(*VIEW),
    }


def _lanes(m: Ram, scrolled: jax.Array, lower: jax.Array) -> Box:
    """What lies in the lanes: seed and shot are rows that are shifted, and mines are not.

    On the cliff and below rocks there is one lane, which has two places on the cliff.
    """
    lane, cliff, gap = np.arange(4), m.scenery == CLIFFS, m.scenery == GAP
    move = signed_nibble(pick(m.layout, (ROM.bytes(0xA00, 9) >> 4).tolist()))
    late = jnp.where(move < 0, 4 * (4 - lane), 0)
    x = m.seed_x - scrolled - 9 * move - 3 - (3 - lane) * (9 * move + 2) + late
    x = jnp.where(cliff, wrap(m.seed_x - scrolled) - 3, modulo_screen(x + 640))
    x = jnp.where(gap, wrap(m.seed_x - scrolled) - np.array((1, 1, 15, 1)), x)
    kind = m.lane >> 4
    width = pick(kind, (0, 5, 4, 10))
    x = x - jnp.where(kind == SEED, 3, 0)
    place = jnp.where(m.scene == ROCKS, 169, jnp.where(m.truck_y == 1, 130, 146))
    y, height = jnp.where(cliff, place, 165 + lower - 14 * lane), jnp.where(cliff, 4, 3)
    y = jnp.where(gap, np.array((138, 0, 117, 106)), y)
    there = (m.lane & SHOWN > 0) & (~cliff | (lane == 3)) & (~gap | (lane != 1))
    return box(x, y, width, height, there).clip(*VIEW)


def _cacti(m: Ram, scrolled: jax.Array, lost: jax.Array) -> Box:
    """The upper cactus moves on every fourth frame, and the lower one on every other.

    Where a life is lost, they are back at their start, and seed tells how far they had come.
    """
    upper = jnp.where(m.clock & 3 == 0, scrolled, 0)
    lower = jnp.where(m.clock & 1 == 0, scrolled, 0)
    way = jnp.maximum(m.seed_x - SEED_START_X, 0)
    x = m.cactus_x - jnp.stack([upper, lower])
    x = x + jnp.where(lost, jnp.stack([way >> 2, way >> 1]), 0)
    small = (m.scene & 1 == 1) & (np.arange(2) == 0)
    y = np.array((46, 55)) + jnp.where((m.scene == ROCKS) & (m.sign_x < 0x95), 1, 0)
    return box(x + jnp.where(small, 1, 0), y, jnp.where(small, 5, 8), 8, m.cactus_x < 0x94)


def _bonus(m: Ram) -> Box:
    shown = (m.bonus_time > 0) & (m.bonus_time < JUST_WON)
    left = jnp.where(m.bonus == 2, 80, 79)
    return box(left, 182, 90 - left, 5, shown, value=100 * (m.bonus - 1))


ROAD_VIEW = (8, 90, 152, 182)
PLAYER = Bounds(
    PLAYER_COLORS, ROAD_VIEW, min_size=(6, 16), exclude=("Seed", "AcmeMine", "SteelShot", "Turret")
)
BROWN = functools.partial(Blobs, COYOTE_COLORS, ROAD_VIEW, gap=(1, 2))
FLAT = BROWN(min_size=(5, 6), max_size=(9, 12), area=(1, 60))
CUT = BROWN(min_size=(8, 1), max_size=(8, 5))
COYOTE = BROWN(min_size=(5, 13), max_size=(9, 38), also=FLAT)
FALLING = BROWN(min_size=(4, 6), max_size=(8, 12), area=(61, 199), also=CUT)
BALL = BROWN(min_size=(4, 4), max_size=(4, 4))
CRACKS = Blobs(COYOTE_COLORS, (8, 124, 152, 156), gap=(1, 1), min_size=(9, 32), max_size=(13, 32))
LANES = functools.partial(Blobs, PLAYER_COLORS, (8, 106, 152, 174), gap=(1, 1))
HIGH_SEEDS = LANES(min_size=(5, 4), max_size=(5, 4), area=(19, 24))
SEEDS = LANES(min_size=(1, 3), max_size=(5, 3), area=(1, 18), also=HIGH_SEEDS)
MINES = LANES(min_size=(4, 3), max_size=(4, 4), area=(19, 99))
SHOTS = LANES(min_size=(6, 3), max_size=(10, 3))
TURRET = LANES(min_size=(12, 8), max_size=(12, 8))
CACTI = Bounds(24, ((8, 46, 152, 55), (8, 55, 152, 64)))
SIGN = Bounds((BLACK, 72, 136), (8, 73, 152, 88))
TRUCK = Blobs((254, 54), ROAD_VIEW, gap=(0, 3), first=254, min_size=(4, 8), max_size=(16, 18))
POINTS = Bounds(YELLOW, (55, 0, 103, 2))
ICONS = Bounds((142, 62), (55, 16, 80, 24), value=Gauge(8, -2, 1))
BONUS = Bounds(BLACK, (70, 182, 95, 187))

GAME = Game(
    name="RoadRunner",
    rom=ROM.name,
    md5=ROM.md5,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", PLAYER, doc="the bird"),
        Category("Enemy", COYOTE, doc="the coyote"),
        Category("Seed", SEEDS, count=4, doc="lane"),
        Category("AcmeMine", MINES, count=4, doc="mines: lane"),
        Category("SteelShot", SHOTS, count=4, doc="lane"),
        Category("RoadCrack", CRACKS, count=2, doc="in the cliff"),
        Category("Rock", FALLING, count=2, doc="upper, lower"),
        Category("Turret", TURRET, doc="below a bridge"),
        Category("TurretBall", BALL, count=2, doc="of the turret"),
        Category("Cactus", CACTI, count=2, doc="by height"),
        Category("Sign", SIGN, doc="beside the road"),
        Category("Truck", TRUCK, doc="on the road"),
        display("Score", POINTS, doc="points"),
        display("Lives", ICONS, aliases=("Bird",), doc="one more than the icons"),
        display("Bonus", BONUS, needs="Score", doc="points for the last seed"),
    ),
)
