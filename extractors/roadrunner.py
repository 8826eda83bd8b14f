"""Road Runner: a bird runs from a coyote along desert roads, picks up seed, and shuns trucks.

The screen begins in the middle of the score, whose last two rows show. Seed, steel shot and mines
lie in four lanes: slot lane, the lowest one first. Eight columns at each edge are blanked.
Mountains, the dashes of the road and the frame of the sky are scenery.

RAM: OCAtari (what some bytes are), ALE's source (score, lives), and the ROM's code. Bank 0 draws
the road at f114, bank 1 the score at f0ac and a bonus at f809. Bank 2 moves all at f01e, after the
frame was drawn, which `decode` takes back; the pointers to pictures are still those that were
drawn. HMOVE in the middle of lines moves seed from lane to lane, so that its columns are sums of
those motions. On the frame of a lost life the RAM is as at the new start.

Covered: the roads with seed, steel shot, mines, trucks and signs (scenes 0, 2, 4 and 6), lost
lives, the end of the game. Play that is not good at it does not leave scene 0.
Not exact: the columns of a bird that stops at the place where it keeps still while the road moves,
or that a truck pushes, and the coyote's where the road is narrow; the last of 30 frames of a bonus;
figures that an edge cuts; with boxes that cover each other, in scenes 2, 4 and 6, 70 to 94 %.
Missing: the other scenes (1, 3, 5 and 7: a cliff, cannons, falling rocks), with RoadCrack, Rock,
Turret and TurretBall. There, half of the birds and coyotes are within five pixels, and VEM takes
some details for seed.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box, choose
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
ROAD, NARROW = 0x80, 3  # `scenery`
FIRST_LINES = (96, 99, 96, 81, 96, 123, 96, 81)  # of the road, in each scene
REPEATED = (255, 125, 255, 135, 255, 147, 255, 135)  # the first line that repeats a row
NOTHING = 0xE73  # a picture that is empty
JUST_WON = 30  # `bonus_time` on the frame on which a bonus is won
CLIFF, ROCKS, BRIDGE = 1, 5, 1  # the first two of `scene`, the last one of `scenery` & 15
BLANK, JUMP, UNUSED_STICK = (
    0x80,
    29,
    8,
)  # least `sign` between scenes, least `stick` when none was pushed
CANNON_OFF, ROCKS_OFF = 0x96, 5  # `bridge` behind the turret, `fallen` of rocks that are whole
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
    tables = ROM.bytes(0x3000 + low, count), ROM.bytes(0x3000 + high, count)
    return [4096 + (int(h) << 8 & 0xFFF | int(b)) for b, h in zip(*tables, strict=True)]


POSES, COYOTE_POSES = _poses(0xC00, 0xC09, 9), _poses(0xEEA, 0xEF5, 11)
DRIFTS = [int(move) >> 4 for move in ROM.bytes(0x3FD0, 8)]  # of rocks, signed nibbles


class Ram(RamMap):
    coyote_look = byte((2, 1))  # pointer to its picture
    player_look = byte((8, 7))
    direction = signed(9)
    y = byte(10)
    coyote_y = byte(11)
    bonus = byte(12)  # 1 and hundreds of points
    scene = bits(22, count=3)
    cactus_x = byte(24, 83)
    entry = signed(34)  # of a bridge; less than 0: without a sign
    coyote_pose = byte(35)
    lane = byte(36, 37, 38, 39)
    bridge = byte(40)
    pose = byte(41)
    truck_x = byte(42)
    truck = byte(43)  # 0: there is none
    two_cracks = byte(46)
    fallen = byte(48)  # rows that rocks have fallen; not 0: there is a turret
    fired = byte(49)
    bonus_time = byte(50)  # frames
    waits = signed(51)  # less than 0: the coyote is on his way
    stunned = byte(52)
    rocket = byte(53)
    truck_y = byte(55)  # a turret's column, the lane of what lies on the cliff
    drift = bits(56, first=1, count=3)
    falls = byte(57)
    hurt = byte(58)
    player_right = bits(59)
    runs = byte(60)
    caught = signed(61)
    pace = byte(62)
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
    road, on_road = m.scenery == ROAD, m.scene & 1 == 0
    cannon = m.scene & 3 == 3
    x, scrolled = _player_x(m)
    x = jnp.where(cannon & (m.rocket > 0) & (m.caught > 0), m.x + m.drawn_x - m.coyote_x, x)
    x = jnp.where(on_road | cannon, x, m.drawn_x)
    coyote_x = jnp.where(on_road, _coyote_x(m), _chaser_x(m, scrolled))
    coyote_x = jnp.where(road | cannon, m.drawn_x, coyote_x)
    narrow = jnp.where(m.scenery == NARROW, 1, 0)
    signed_bridge = (m.scenery & 15 == BRIDGE) & (m.entry >= 0)
    lower = jnp.where(signed_bridge, 16, 0) - narrow
    digits = jnp.where(m.digits == 10, 0, m.digits)
    score = 100 * (1000 * digits[0] + 100 * digits[1] + 10 * digits[2] + digits[3])
    lanes = choose(on_road, _lanes(m, scrolled, narrow), _cliff_lanes(m, scrolled))
    lanes = lanes.where(road | (narrow == 1) | ~on_road)
    kind = m.lane >> 4
    start = jnp.where(cannon, COYOTE_START_X, START_X)
    lost = jnp.where(on_road, m.drawn_x > GONE, (m.waits == 0) & (m.drawn_x != start))
    lost = lost & (m.x == START_X) & (m.coyote_x == COYOTE_START_X)
    icons = m.icons + jnp.where(lost, 1, 0)
    sign_x = jnp.where(lost, m.seed_x - 1, wrap(m.sign_x - scrolled))
    has_sign = jnp.where(m.scene == 0, m.sign < 3, among(m.sign, (0, 5))) & (sign_x < 0x99)
    sign_y, sign_h = jnp.where(m.scene == 0, 73, 75), jnp.where(m.scene == 0, 15, 13)
    sign_y = sign_y - jnp.where(cannon, 1, 0)
    truck_x = m.truck_x - 1 - jnp.where(m.truck_x <= TRUCK_LIMIT, scrolled, 0)
    look, coyote_look = _looks(m)
    coyote = _figure(m, coyote_look, coyote_x, m.coyote_right, 1, lower)
    shown = on_road | ~lost
    last, first = jnp.where(on_road, GONE, GONE - 1), jnp.where(on_road, 0, 8)
    boxes = {
        "Player": _figure(m, look, x, m.player_right, 0, lower).where(shown & (x <= last)),
        "Enemy": coyote.where(shown & (coyote_x <= last) & (coyote_x >= first)),
        "Seed": lanes.where(kind == SEED),
        "AcmeMine": lanes.where(kind == MINE),
        "SteelShot": lanes.where(kind == SHOT),
        "RoadCrack": _cracks(m, scrolled).where(shown),
        "Rock": _rocks(m, scrolled),
        "Turret": _turret(m, scrolled),
        "TurretBall": _turret_ball(m),
        "Cactus": _cacti(m, scrolled, lost).clip(*VIEW),
        "Sign": box(sign_x, sign_y, 16, sign_h, has_sign & (road | signed_bridge)).clip(*VIEW),
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
    carried = (m.caught < 0) & (m.stunned == 0) | (m.caught == 1) & (m.truck > 0) & (
        m.x == m.truck_x + 8
    )
    return m.x - jnp.where(carried, 1, step), jnp.where(onward & near, 1, 0)


def _coyote_x(m: Ram) -> jax.Array:
    """The coyote's column before it moved towards the place where the bird was lately."""
    after = jnp.sign(m.coyote_x - m.aim_x)
    return m.coyote_x + jnp.where(m.runs == 0, after, jnp.where(m.clock & 3 == 0, -1, 0))


def _chaser_x(m: Ram, scrolled: jax.Array) -> jax.Array:
    """The same in scenes 1, 3, 5 and 7, where he falls back while the road moves."""
    ahead = m.coyote_x + jnp.sign(m.coyote_x - m.aim_x)
    steps = (m.runs == 0) | (m.pace == 1) & (m.x >= 0x80)
    steps = steps & (m.coyote_y == m.aim_y) | jnp.where(
        (m.coyote_y != m.aim_y) | (m.pace == 1), m.clock & 1 == 0, (m.pace > 1) & (m.clock & 7 == 0)
    )
    fallen_back = (m.coyote_y == m.aim_y) & (m.runs > 0) & (m.pace == 0) & (m.clock & 3 == 0)
    x = jnp.where(fallen_back, m.coyote_x - 1, jnp.where(steps, ahead, m.coyote_x))
    x = jnp.where((m.waits >= 0) | (m.falls > 0), m.coyote_x, x)
    x = jnp.where(m.caught == 0, x, jnp.where(m.caught < 0, m.drawn_x - 5, m.coyote_x))
    return jnp.where(m.stunned > 0, m.coyote_x - scrolled, x)


def _looks(m: Ram) -> tuple[jax.Array, jax.Array]:
    """What was drawn of the bird and the coyote, as indices of `EXTENTS`.

    In scenes 1, 3, 5 and 7 the pointers are already those of the next frame.
    """
    moved = (m.stick < UNUSED_STICK) & ((m.stick > 0) | among(m.pose, (1, 2)))
    walked = moved & (m.clock & 1 == 0) & among(m.pose, (1, 2))
    pose = jnp.where(walked, 3 - m.pose, m.pose)
    pose = jnp.where((m.hurt > 0) & among(m.pose, (4, 5)) & (m.clock & 3 == 0), pose - 1, pose)
    burnt = jnp.where((m.clock - 1) & 8 > 0, 7, 8)
    pose = jnp.where(m.pose >= 7, burnt, jnp.where(m.jump == JUMP, 2, pose))
    top, bottom = _limits(m)
    up, down = among(m.stick, (2, 3, 4)), among(m.stick, (0, 6, 7))
    step = jnp.where(up & (m.y > bottom), 1, jnp.where(down & (m.y < top), -1, 0))
    step = jnp.where(m.y > top, 1, jnp.where(m.y < bottom, -1, step))
    y = m.y + jnp.where(moved, step, 0)
    fallen = jnp.where((m.y < 52) | (m.clock == 0), 3, 0)
    y = jnp.where(m.falls > 0, m.y - fallen, y)
    ours = jnp.where(y < 0x3C, pick(pose, POSES) + y, 4096 + NOTHING)
    running = (m.waits < 0) & (m.stunned + m.rocket + m.falls == 0) & (m.caught <= 0)
    paced = running & (m.clock & 3 == 0) & among(m.coyote_pose, (1, 2))
    his_pose = jnp.where(paced, 3 - m.coyote_pose, m.coyote_pose)
    burning = (m.stunned > 0) & (m.clock & 3 == 0) & among(m.coyote_pose, (6, 7))
    his_pose = his_pose - jnp.where(burning, 1, 0)
    his_pose = jnp.where(m.rocket > 0, jnp.where(m.clock & 1 == 0, 9, 10), his_pose)
    back = jnp.where(running & (m.caught == 0), jnp.sign(m.coyote_y - m.aim_y), 0)
    his = pick(his_pose, COYOTE_POSES) + m.coyote_y + back
    road = m.scene & 1 == 0
    old, his_old = (
        (p & 0xFFF) + jnp.where(p >> 12 == 9, 0, 4096) for p in (m.player_look, m.coyote_look)
    )
    return jnp.where(road, old, ours), jnp.where(road, his_old, his)


def _limits(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The highest and the lowest place of the bird in scenes 1, 3, 5 and 7."""
    off = (m.x < m.bridge + 8) | (m.x > m.bridge + 16)
    high = m.y <= 6
    bridge_top, bridge_bottom = jnp.where(off & high, 6, 36), jnp.where(off & ~high, 28, 1)
    on = m.scenery & 15 == BRIDGE
    return jnp.where(on, bridge_top, 20), jnp.where(on, bridge_bottom, 1)


def _figure(
    m: Ram, look: jax.Array, x: jax.Array, flipped: jax.Array, who: int, lower: jax.Array
) -> Box:
    """The box of a picture; some lines of the screen show the same row of it as those above."""
    packed = lookup(EXTENTS, look)
    left, width = packed >> 16 & 15, packed >> 20
    left = jnp.where(flipped == 1, 8 - left - width, left)
    cannon = m.scene & 3 == 3
    y = pick(m.scene, FIRST_LINES) + (packed & 255) + jnp.where(m.scene & 1 == 0, who, 0)
    top, bottom = _line(m, y, who), _line(m, y + (packed >> 8 & 255), who)
    late = lower + jnp.where(cannon, who, 0)
    cut = jnp.where(m.scene == CLIFF, 157, VIEW[3])
    figure = box(x + left, top + late, width, bottom - top)
    return figure.clip(VIEW[0], VIEW[1], VIEW[2], cut)


def _line(m: Ram, y: jax.Array, who: int) -> jax.Array:
    """Where a row is drawn, after the lines that repeat a row."""
    line = y + jnp.where(y >= pick(m.scene, REPEATED), 1, 0)
    more = sum(jnp.where(y >= limit, 1, 0) for limit in (139, 149, 151 - who))
    return line + jnp.where(m.scene & 3 == 3, more, 0)


def _cracks(m: Ram, scrolled: jax.Array) -> Box:
    x = wrap(m.sign_x - scrolled + np.array((0, 64))) - 6
    there = (m.scene == CLIFF) & ((np.arange(2) == 0) | (m.two_cracks > 0))
    return box(x, 124, 13, 32, there).clip(*VIEW)


def _rocks(m: Ram, scrolled: jax.Array) -> Box:
    """Two rocks that fall, one above the other, to the left or to the right of it."""
    k = np.arange(2)
    drift = signed_nibble(pick(m.drift, DRIFTS))
    late = jnp.where(m.fallen < ROCKS_OFF, 2, 0)
    x = modulo_screen(m.sign_x - scrolled + 172 - (2 + k) * drift + late)
    top, bottom = (m.fallen + np.array(rows) for rows in ((94, 107), (104, 118)))
    top, bottom = (y + jnp.where(y >= REPEATED[ROCKS], 1, 0) for y in (top, bottom))
    there = (m.scene == ROCKS) & (m.fallen > 0)
    return box(x, top, 8, bottom - top, there).clip(VIEW[0], 100, VIEW[2], 179)


def _turret(m: Ram, scrolled: jax.Array) -> Box:
    x = m.truck_y - 1 - jnp.where(m.bridge == CANNON_OFF, scrolled, 0)
    return box(x, 128, 12, 8, (m.scene & 3 == 3) & (m.fallen > 0)).clip(*VIEW)


def _turret_ball(m: Ram) -> Box:
    there = (m.scene & 3 == 3) & (m.fired > 0) & (m.truck_x > 0)
    x = m.truck_x - 2 + jnp.where(m.fallen > 0, 0, 9)
    return box(x, 128, 4, 4, there & (np.arange(2) == 0)).clip(*VIEW)


def _lanes(m: Ram, scrolled: jax.Array, lower: jax.Array) -> Box:
    """What lies in the lanes: seed and shot are rows that are shifted, and mines are not."""
    lane = np.arange(4)
    move = signed_nibble(pick(m.layout, (ROM.bytes(0xA00, 9) >> 4).tolist()))
    late = jnp.where(move < 0, 4 * (4 - lane), 0)
    x = m.seed_x - scrolled - 9 * move - 3 - (3 - lane) * (9 * move + 2) + late
    x = modulo_screen(x + 640)
    kind = m.lane >> 4
    width = pick(kind, (0, 5, 4, 10))
    x = x - jnp.where(kind == SEED, 3, 0)
    return box(x, 165 + lower - 14 * lane, width, 3, m.lane & SHOWN > 0).clip(*VIEW)


def _cliff_lanes(m: Ram, scrolled: jax.Array) -> Box:
    """What lies on the cliff, in one of two places, or below the rocks."""
    y = jnp.where(m.scene == ROCKS, 169, jnp.where(m.truck_y == 1, 130, 146))
    seed = m.lane >> 4 == SEED
    x = wrap(m.seed_x - scrolled) - jnp.where(seed, 6, 3)
    there = (m.scenery == 9) & (np.arange(4) == 3) & (m.lane & SHOWN > 0)
    return box(x, y, jnp.where(seed, 5, 4), 4, there).clip(*VIEW)


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
    there = m.cactus_x < 0x94
    return box(x + jnp.where(small, 1, 0), y, jnp.where(small, 5, 8), 8, there)


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
CRACKS = Blobs(COYOTE_COLORS, (8, 124, 152, 156), gap=(1, 1), min_size=(6, 32), max_size=(13, 32))
LANES = functools.partial(Blobs, PLAYER_COLORS, (8, 118, 152, 174), gap=(1, 1))
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
