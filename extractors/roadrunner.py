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
ROAD, NARROW = 0x80, 3  # `scenery`
FIRST_LINES = (96, 99, 96, 81, 96, 123, 96, 81)  # of the road, in each scene
JUST_WON = 30  # `bonus_time` on the frame on which a bonus is won
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


class Ram(RamMap):
    coyote_look = byte((2, 1))  # pointer to its picture
    player_look = byte((8, 7))
    direction = signed(9)
    bonus = byte(12)  # 1 and hundreds of points
    scene = bits(22, count=3)
    cactus_x = byte(24, 83)
    lane = byte(36, 37, 38, 39)
    truck_x = byte(42)
    truck = byte(43)  # 0: there is none
    bonus_time = byte(50)  # frames
    truck_y = byte(55)
    runs = byte(60)
    caught = signed(61)
    coyote_right = bits(66)
    icons = low(68)
    sign = byte(69)
    clock = bits(77, count=2)
    digits = low(76, 75, 74, 73)  # 10: blank
    aim_x = byte(78)
    x = byte(80)
    coyote_x = byte(81)
    sign_x = byte(82)
    seed_x = byte(89)
    layout = byte(90)
    scenery = byte(91)
    drawn_coyote_x = byte(104)
    player_right = bits(59)


def decode(m: Ram) -> dict[str, Box]:
    road = m.scenery == ROAD
    x, scrolled = _player_x(m)
    coyote_x = jnp.where(road, m.drawn_coyote_x, _coyote_x(m))
    narrow = jnp.where(m.scenery == NARROW, 1, 0)
    first = pick(m.scene, FIRST_LINES) - narrow
    digits = jnp.where(m.digits == 10, 0, m.digits)
    score = 100 * (1000 * digits[0] + 100 * digits[1] + 10 * digits[2] + digits[3])
    lanes = _lanes(m, scrolled, narrow).where(road | (narrow == 1))
    kind = m.lane >> 4
    lost = (m.x == START_X) & (m.coyote_x == COYOTE_START_X) & (m.drawn_coyote_x > GONE)
    icons = m.icons + jnp.where(lost, 1, 0)
    sign_x = jnp.where(lost, m.seed_x - 1, wrap(m.sign_x - scrolled))
    has_sign = jnp.where(m.scene == 0, m.sign < 3, among(m.sign, (0, 5))) & (sign_x < 0x99)
    sign_y = jnp.where(m.scene == 0, 73, 75)
    truck_x = m.truck_x - 1 - jnp.where(m.truck_x <= TRUCK_LIMIT, scrolled, 0)
    return {
        "Player": _figure(m.player_look, x, m.player_right, first).where(m.x <= GONE),
        "Enemy": _figure(m.coyote_look, coyote_x, m.coyote_right, first + 1).where(
            coyote_x <= GONE
        ),
        "Seed": lanes.where(kind == SEED),
        "AcmeMine": lanes.where(kind == MINE),
        "SteelShot": lanes.where(kind == SHOT),
        "Cactus": _cacti(m, scrolled, lost).clip(*VIEW),
        "Sign": box(sign_x, sign_y, 16, 88 - sign_y, has_sign & road).clip(*VIEW),
        "Truck": box(truck_x, m.truck_y + 55, 16, 18, (m.truck > 0) & road).clip(*VIEW),
        "Score": score_box(FONT, jnp.maximum(score, 10), right=103, top=0, digits=6, value=score),
        "Lives": box(55, 16, 8 * icons - 2, 8, icons > 0, value=m.icons + 1),
        "Bonus": _bonus(m),
    }


def _player_x(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The bird's column before it moved, and 1 where the road has moved on since, else 0."""
    free = (m.caught == 0) & (m.runs > 0)
    onward, backward = free & (m.direction > 0), free & (m.direction < 0)
    slow = jnp.where(m.x < STILL, 1, jnp.where(m.x == STILL, 0, -1))
    near = (m.x < FAR - 1) | (m.x == FAR - 1) & (m.clock > 0)
    slow = jnp.where(m.clock == 0, slow, 0)
    step = jnp.where(onward, jnp.where(near, slow, -1), 0)
    step = jnp.where(backward & (m.x != BACK_LIMIT), 1, step)
    carried = (m.caught < 0) | (m.caught == 1) & (m.truck > 0) & (m.x == m.truck_x + 8)
    return m.x - jnp.where(carried, 1, step), jnp.where(onward & near, 1, 0)


def _coyote_x(m: Ram) -> jax.Array:
    """The coyote's column before it moved towards the place where the bird was lately."""
    after = jnp.sign(m.coyote_x - m.aim_x)
    return m.coyote_x + jnp.where(m.runs == 0, after, jnp.where(m.clock == 0, -1, 0))


def _figure(look: jax.Array, x: jax.Array, flipped: jax.Array, first: jax.Array) -> Box:
    """The box of the picture at a pointer."""
    index = (look & 0xFFF) + jnp.where(look >> 12 == 9, 0, 4096)
    packed = lookup(EXTENTS, index)
    left, width = packed >> 16 & 15, packed >> 20
    left = jnp.where(flipped == 1, 8 - left - width, left)
    y = first + (packed & 255)
    return box(x + left, y, width, packed >> 8 & 255).clip(*VIEW)


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


def _cacti(m: Ram, scrolled: jax.Array, lost: jax.Array) -> Box:
    """The upper cactus moves on every fourth frame, and the lower one on every other.

    Where a life is lost, they are back at their start, and seed tells how far they had come.
    """
    upper = jnp.where(m.clock == 0, scrolled, 0)
    lower = jnp.where(m.clock & 1 == 0, scrolled, 0)
    way = jnp.maximum(m.seed_x - SEED_START_X, 0)
    x = m.cactus_x - jnp.stack([upper, lower])
    x = x + jnp.where(lost, jnp.stack([way >> 2, way >> 1]), 0)
    return box(x, np.array((46, 55)), 8, 8, m.cactus_x < 0x94)


def _bonus(m: Ram) -> Box:
    shown = (m.bonus_time > 0) & (m.bonus_time < JUST_WON)
    left = jnp.where(m.bonus == 2, 80, 79)
    return box(left, 182, 90 - left, 5, shown, value=100 * (m.bonus - 1))


ROAD_VIEW = (8, 90, 152, 182)
PLAYER = Bounds(
    PLAYER_COLORS, ROAD_VIEW, min_size=(6, 16), exclude=("Seed", "AcmeMine", "SteelShot")
)
COYOTE = Blobs(COYOTE_COLORS, ROAD_VIEW, gap=(1, 1), min_size=(5, 6), max_size=(9, 31))
LANES = functools.partial(Blobs, PLAYER_COLORS, (8, 118, 152, 172), gap=(1, 1))
SEEDS = LANES(min_size=(1, 3), max_size=(5, 3), area=(1, 18))
MINES = LANES(min_size=(4, 3), max_size=(4, 3), area=(19, 99))
SHOTS = LANES(min_size=(6, 3), max_size=(10, 3))
CACTI = Bounds(24, ((8, 46, 152, 54), (8, 55, 152, 63)))
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
        Category("Cactus", CACTI, count=2, doc="by height"),
        Category("Sign", SIGN, doc="beside the road"),
        Category("Truck", TRUCK, doc="on the road"),
        display("Score", POINTS, doc="points"),
        display("Lives", ICONS, aliases=("Bird",), doc="one more than the icons"),
        display("Bonus", BONUS, doc="points for the last seed"),
    ),
)
