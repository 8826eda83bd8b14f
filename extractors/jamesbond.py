"""James Bond 007: a vehicle in the desert, on the sea and under it, in missions of several stages.

Three lanes have a record each: the air, the sea, the sky. Slots of Missile and Bomb: the object and
its copy, in the air, then in the sea; of Rocket: in the air, in the sea. Oil_Rig is valid while a
flash lights it; else it has the sky's colour. Capsule leaves a Lab that was hit. Explosion, deadly
too, is what a missile leaves above the sea. Life has one box around its icons. At an edge, a hole's
box has its larger part. Smoke, stars, hills and names are scenery. Titles show a score.

RAM: ALE's source (score, lives), OCAtari 2.2 (the first mission's bytes), and the ROM's code: the
drawing at $F000 of pages 4-7, the records of kinds at $FD00, to which $FB53 of pages 0-2 points,
and the steps at $F652, after the drawing, which `decode` takes back. The beam is drawn on every
other frame, in place of what is in the air; both are where they were drawn last.

Covered: both modes, lost vehicles, game over; all 30 stages by RAM writes (random play: the first
one). Not exact: noise above the hole; what is hit or leaves, but for explosions, is gone a frame
early. VEM misses black parts of the rig, most flashes of a lost vehicle, depth charges behind hills
or before their own colour, and shots in a hornet's box.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box, choose
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import among, pick
from ocjax.console.ram import RamMap, bcd, byte, high, low
from ocjax.console.registers import EDGE_CUTS
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Blobs, Bounds, Gauge
from ocjax.vision.shades import Shades
from ocjax.vision.shapes import Shape

ROM = Rom("jamesbond", "e51030251e440cffaab1ac63438b44ae")
GRAPHICS = 0x1000  # offset of the pages that are at $F000 while the frame is drawn
FONT = ROM.font(GRAPHICS | 0x800, rows=7)

MISSILE, _, ROCKET, *_, TORPEDO, SHIP, _, HELICOPTER, _, EXPLOSION, ERUPTION, _ = range(15)
# first mission at night; of the ship's pictures
KINDS = 15
NIGHTS = 4
SMOKE_ROWS = 15
RECORDS = GRAPHICS | (ROM.bytes(0xB62, KINDS) & 15) << 8 | ROM.bytes(0xB53, KINDS)
RECORD = np.array([ROM.bytes(at, 11) for at in RECORDS])  # of each kind; its pictures follow
TOGGLE, ANIMATION, PERIOD, STEP_X, STEP_Y, HEIGHT, _, START_Y = RECORD.T[:8].tolist()
STEP_X, STEP_Y = ([(s ^ 128) - 128 for s in steps] for steps in (STEP_X, STEP_Y))
STEP_X[TORPEDO], STEP_Y[TORPEDO] = -2, 0
ANIMATION = [frames & 15 for frames in ANIMATION]
PICTURE = [at + 11 & 0xFF for at in RECORDS]  # low byte of the first picture's address


def _picture(kind: int, toggle: int) -> np.ndarray:
    """The rows of a picture from the top, without the smoke of the ship."""
    rows = ROM.rows(int(RECORDS[kind]) & ~0xFF | PICTURE[kind] ^ toggle, HEIGHT[kind] + 1)
    return np.where((kind == SHIP) & (np.arange(len(rows)) < SMOKE_ROWS), 0, rows)


BOTH = [_picture(kind, toggle) for kind in range(KINDS) for toggle in (0, TOGGLE[kind])]
ROWS = range(1, max(HEIGHT) + 2)  # of a picture that the surface or the ground leaves
SIZES = Pictures.of([rows[:n] & seen for rows in BOTH for n in ROWS for seen in EDGE_CUTS])

PIT = np.unpackbits(ROM.rows(GRAPHICS | 0xB8F, 17).astype(np.uint8)[:, None], axis=1)
DEPTHS = [6 + 3 * int(np.flatnonzero(column)[-1]) for column in PIT.T.repeat(2, 0)]
DEPTH_LEFT = np.maximum.accumulate([0, *DEPTHS]).tolist()  # lines of so many columns on the left
DEPTH_RIGHT = np.maximum.accumulate([0, *DEPTHS[::-1]]).tolist()  # on the right
AIMS = range(0x4D, 0x67)  # `object_x` of a helicopter with a beam, and two columns more


def _beams() -> np.ndarray:
    """Left edge relative to `object_x`, and width, of the beam for each of `AIMS`."""
    dots = [f"{row:08b}" for row in ROM.bytes(GRAPHICS | 0x7A5, 8)[::-1]]
    slopes = [7 - ((x >> 4) + (x & 15)) % 15 for x in AIMS]  # columns to the left a line
    shift = -1 - np.outer(slopes, np.arange(1, 9))
    left = (shift + [row.index("1") for row in dots]).min(axis=1)
    right = (shift + [row.rindex("1") for row in dots]).max(axis=1)
    return np.stack([left, right + 1 - left])


BEAM_LEFT, BEAM_WIDTH = _beams().tolist()
FIELD = (8, 57, 160, 179)
AIR = (8, 57, 160, 121)
SEA = (8, 121, 160, 152)
SHOT = (8, 74, 160, 156)
IN_AIR, IN_SEA, COPY = np.array([[1, 1, 0, 0, 0], [0, 0, 1, 1, 0], [0, 1, 0, 1, 0]]) > 0
BOTTOM = np.where(IN_SEA, SEA[3], AIR[3])
# the first to the bed
BOMBED = (8, 57, 160, 168)
SKY = (8, 57, 160, 72)
LOW = (8, 99, 160, 121)
NAMES = ("Missile", "Ice", "Rocket", "Diver", "Satellite", "Submarine", "Bomb", "Torpedo", "Ship")
NAMES += ("Oil_Rig", "Helicopter", "Hornet", "Explosion", "Eruption", "Capsule")
SLOTS = (slice(4), 4, slice(0, 3, 2), 2, 4, 2, slice(2), 2, 0, 0, 4, 0, slice(2), 2, 2)

NOT_RUNNING = 0xFE  # bits of `status`: no motion
TITLE = 8  # a title
OVER = 32  # with the score
# bits of `flags` (odd: every other frame), `more_flags`
DIES = 0x80
ODD = 0x40
BEAM = 0x40
LAB = 4
# bit of `shot_way`; first `enemy_shot_y`
SLOW = 0x40
FIRST_SLOW = 35
FIRST_FAST = (22, 23)
LATE = 22  # least columns of enemies' shots in time
UNLIT = 105  # of missiles without their last row
NONE = 128  # least value that stands for nothing
SPARKS_Y = 64  # `object_y` of explosions
JUST_DIED = 0x3C  # `pause` then
LIT = 0x77  # `rig_colors` while the rig shows
ORANGE = 0x3A  # of the vehicle
# sizes: of twice and four times the width; of two copies
DOUBLE = 5
QUAD = 7
COPIES = (1, 2, 4)


class Ram(RamMap):
    lives = low(6)  # in reserve
    status = byte(12)
    mission = byte(13)
    clock = byte(15)
    flags = byte(20)
    more_flags = byte(21)
    shot_way = byte(22)  # bits: right, left, up, down, -, -, slow up or down, slow to the side
    y = byte(25)  # y - 50
    x = byte(27)
    bomb_y = byte(29)  # y - 55
    enemy_shot_y = byte(30)  # y - 55
    shot_y = byte(31)  # y - 55
    bomb_x = byte(37)  # x + 14
    shot_x = byte(38)  # x + 11
    enemy_shot_x = byte(39)  # x + 11
    lab_x = byte(42)
    ground_x = byte(43)  # of the hole, or of the lab's right half
    kind = byte(44, 44, 45, 45, 46)  # in the air and its copy, in the sea and its copy, in the sky
    height = byte(47, 47, 48, 48, 49)  # rows less 1
    object_y = byte(50, 50, 51, 51, 52)  # 179 - y
    animation = low(53, 53, 54, 54, 55)  # frames until the picture changes
    drawn = high(53, 53, 54, 54, 55)  # 0 until the first picture is drawn
    step_timer = byte(56, 56, 57, 57, 58)  # frames until the next step
    object_x = byte(59, 59, 60, 60, 61)
    picture = byte(62, 62, 63, 63, 64)  # low byte of its address
    size = byte(71, 71, 72, 72, 73)  # NUSIZ1
    rig_colors = byte(74)  # low byte of the address of the colours in the air
    score = bcd((94, 93, 92))
    last_y = byte(102)  # `object_y` of the last step of this frame, if any
    pause = byte(121)  # frames
    flash = byte(122)  # colour of a lost vehicle


def decode(m: Ram) -> dict[str, Box]:
    ended = IN_AIR & (m.kind >= NONE) & (m.last_y == SPARKS_Y)  # explosions, in these steps
    kinds = jnp.where(ended, EXPLOSION, m.kind)
    objects, charge = _objects(m, kinds), _shot(m, m.bomb_x - 3, m.bomb_y, 123).clip(*BOMBED)
    shown = charge.clip(*SEA)  # at night, when sky and sea bed have its colours
    icons, life_y = 16 * jnp.minimum(m.lives, 3) - 8, 184 + jnp.minimum(m.mission, 1)
    lost = ((m.flags & DIES) > 0) & (m.pause != JUST_DIED)
    color = jnp.where(lost, m.flash & ~1, ORANGE)
    boxes = {
        "Player": box(_column(m.x), m.y + 50, 8, 4, color=color).clip(*FIELD),
        "Player_Shot": replace(_shot(m, m.shot_x, m.shot_y, 123), color=color),
        "Depth_Charge": choose((m.mission >= NIGHTS) & shown.valid, shown, charge),
        "Enemy_Shot": _enemy_shot(m),
        "Laser": _beam(m),
        "Fire_Hole": _hole(m),
        "Lab": _lab(m),
        "Score": score_box(FONT, m.score, right=102, top=15, digits=6, value=m.score),
        "Life": box(9, life_y, icons, 4, m.lives > 0, value=m.lives + 1),
    }
    for kind, (name, slots) in enumerate(zip(NAMES, SLOTS, strict=True)):
        boxes[name] = objects[slots].where(kinds[slots] == kind)
    boxes["Oil_Rig"] = boxes["Oil_Rig"].where(m.rig_colors == LIT)
    hidden = {name: TITLE | (OVER if name == "Score" else 0) for name in boxes}
    return {name: b.where((m.status & hidden[name]) != TITLE) for name, b in boxes.items()}


def _column(x: jax.Array) -> jax.Array:
    """Left edge of a player that the game positions at x: those at 5 to 14 are further left."""
    return x - 1 - jnp.where((x >= 5) & (x < 15), 5, 0)


def _moved(m: Ram, kinds: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Whether the objects have been moved since they were drawn, and which have made a step."""
    stands = ((m.flags & DIES) > 0) & (m.pause != JUST_DIED)
    runs = ((m.status & NOT_RUNNING) == 0) & ~stands
    aims = ((m.more_flags & BEAM) > 0) & ((m.clock + 1 & 15) != 0) & (kinds == HELICOPTER)
    return runs, runs & (m.step_timer == pick(kinds, PERIOD)) & ~aims


def _beamed(m: Ram) -> jax.Array:
    """Whether the frame shows the beam, in place of what is in the air."""
    return ((m.more_flags & BEAM) > 0) & ((m.flags & (ODD | DIES)) == ODD)


def _objects(m: Ram, k: jax.Array) -> Box:
    """The objects as they were drawn; the larger part of what the edges and columns 0-7 cut."""
    ended, (runs, moved) = k != m.kind, _moved(m, k)
    step = jnp.where(moved, pick(k, STEP_X), 0)
    behind = _beamed(m) & IN_AIR  # last drawn on the frame before
    x = m.object_x - step - jnp.where(behind, step - jnp.where((m.clock & 3) == 0, 1, 0), 0)
    y = jnp.where(ended, SPARKS_Y, m.object_y) - jnp.where(moved, pick(k, STEP_Y), 0)
    rises = among(k, (MISSILE, ROCKET)) & IN_SEA
    y = 179 - jnp.where(rises, jnp.maximum(y, pick(k, START_Y)), y)
    toggled = runs & (m.animation == pick(k, ANIMATION))
    other = 2 * k + jnp.where((m.picture != pick(k, PICTURE)) ^ toggled, 1, 0)
    zoom = jnp.where(m.size == DOUBLE, 1, jnp.where(m.size == QUAD, 2, 0))
    width, left = 8 << zoom, _column(x) + jnp.where(zoom > 0, 1, 0)
    left = left + jnp.where(COPY, jnp.where(m.size == 1, 16, jnp.where(m.size == 2, 32, 64)), 0)
    left = jnp.where(left < 0, left + 160, jnp.where(2 * left + width > 328, left - 160, left))
    beyond = jnp.clip(left + width - 160 >> zoom, 0, 8) - jnp.clip(8 - left >> zoom, 0, 8)
    bottom = BOTTOM - jnp.where((k == MISSILE) & IN_SEA & (left >= UNLIT), 1, 0)
    other = len(ROWS) * other + jnp.clip(bottom - y, 1, len(ROWS)) - 1
    dx, dy, w, h = SIZES.extent(len(EDGE_CUTS) * other + 8 + beyond)
    there = (ended | (m.height < NONE) & (m.object_y < NONE)) & (~COPY | among(m.size, COPIES))
    there = there & ~(runs & (m.drawn == 0) & among(k, (TORPEDO, EXPLOSION, ERUPTION)))
    return box(left + (dx << zoom), y + dy, w << zoom, h, there).clip(8, 57, 160, bottom)


def _shot(m: Ram, x: jax.Array, y: jax.Array, surface: int) -> Box:
    """A shot, which begins on every other line; borders of the kernel make it longer or shorter."""
    sky = jnp.where(m.height[4] < NONE, m.height[4] + 1, 0) + jnp.where(_beamed(m), 9, 0)
    odd = (top := y + 55) + surface + jnp.where(top < AIR[3], sky, 0) & 1
    odd = jnp.where(top < AIR[1] + 1 + sky, 0, jnp.where(top >= SEA[3] + 3, 1, odd))
    bed = top - SEA[3]
    top = top + jnp.where(bed == 0, -1, odd)
    bottom = jnp.where(bed == -4, SEA[3] - 1, top + 4)
    bottom = jnp.where(bed >= -2, bed + SEA[3] + 5, bottom)
    bottom = bottom + jnp.where(among(AIR[1] + sky - top, (1, 3)), 1, 0)
    sinks, dives = (among(top, range(*ends)) for ends in ((116, surface), (surface - 3, surface)))
    bottom = jnp.where(dives, surface + 2, jnp.where(sinks, surface, bottom))
    top = jnp.where(dives & (top >= 120), surface, top)
    return box(x - 11, top, 1, bottom - top, y < NONE).clip(*FIELD)


def _enemy_shot(m: Ram) -> Box:
    """The enemies' shot before its last step, from the frame on on which it is drawn."""
    way, y, dies = m.shot_way, m.enemy_shot_y, (m.flags & DIES) > 0
    across, down = jnp.where((way & 128) > 0, 1, 2), jnp.where((way & SLOW) > 0, 1, 2)
    dx, dy = across * ((way & 1) - (way >> 1 & 1)), down * ((way >> 3 & 1) - (way >> 2 & 1))
    shot = _shot(m, m.enemy_shot_x - jnp.where(dies, 0, dx), y - jnp.where(dies, 0, dy), 122)
    shot = box(shot.x, shot.y + jnp.where(shot.x < LATE, 1, 0), 1, shot.h, shot.valid)
    fresh = jnp.where((way & SLOW) > 0, y == FIRST_SLOW, among(y, FIRST_FAST)) & (way > 0) & ~dies
    bottom = jnp.where(m.mission > 0, SEA[3], AIR[3] - 1)  # it vanishes in the ground
    return shot.where((y < NONE) & ~fresh).clip(8, 57, 160, bottom)


def _beam(m: Ram) -> Box:
    """The beam as it was last drawn: on this frame, or on the one before the ground moved."""
    late, moved = ((m.flags & ODD) == 0) & ((m.clock & 3) == 0), _moved(m, m.kind)[1][4]
    x = m.object_x[4] + jnp.where(late, 1, 0) + jnp.where(moved, 1, 0)
    begins = moved & (m.object_x[4] == AIMS[-3])  # from the next frame on
    there = ((m.more_flags & BEAM) > 0) & ((m.flags & DIES) == 0) & (m.kind[4] == HELICOPTER)
    left, width = (pick(x - AIMS[0], table) for table in (BEAM_LEFT, BEAM_WIDTH))
    return box(x + left, 64, width, 8, there & ~begins).clip(*FIELD)


def _hole(m: Ram) -> Box:
    """The hole; at an edge, the larger part of what is in columns 8-159, for it goes round."""
    x = jnp.where((x := _column(m.ground_x) + 1) > 156, x - 160, x)
    first, last = jnp.clip(8 - x, 0, 16), jnp.clip(160 - x, 0, 16)
    depth = jnp.minimum(pick(last, DEPTH_LEFT), pick(16 - first, DEPTH_RIGHT))
    apart = (m.ground_x >= 9) & (m.ground_x < 15)  # the flames are two columns beside the hole
    return box(x, 122, jnp.where(apart, 18, 16), depth, m.mission == 0).clip(8, 122, 160, 170)


def _lab(m: Ram) -> Box:
    """The two halves of the lab, of which the right one may be at the other edge."""
    left, right = _column(m.lab_x) + 3, _column(m.ground_x) + 17
    left = jnp.where(left > 148, left - 160, left)
    right = jnp.where(right < left, 160, right)
    there = ((m.more_flags & LAB) > 0) & (m.mission > 0)
    return box(left, 156, right - left, 23, there).clip(*FIELD)


TAKEN = bytes.fromhex("0002040608 0a101214 182434 828488 9498 c0c2c4 f0f4f6fe")  # by others
PLAYER = tuple(c for c in range(0, 256, 2) if c not in TAKEN)  # a lost vehicle flashes in all
VEHICLE = Blobs(PLAYER, FIELD, Shape(w=(4, 8), h=4, pixels=(9, 17)))
UPWARD = Blobs(PLAYER, FIELD, Shape(w=1, h=(3, 6)))
charge = functools.partial(Blobs, (0, 0xC4))
LOW_CHARGE = charge((8, 121, 160, 168), shapes=Shape(w=1, h=(2, 7)))
CHARGE = charge(BOMBED, shapes=Shape(w=1, h=(4, 7)), also=(LOW_CHARGE,))
DIM = Bounds((8, 0x94), (8, 75, 160, 91), (1, 3), exclude=("Hornet",))  # beside one
NIGHT = Shades((130, 121), (0x84, 0xC4, 0x92), ((0xC4,), (1,), (1,)))  # the sea has its colour
blob = functools.partial(Blobs, gap=(1, 1))
HOLE = blob((0xF0, 0x34), (8, 122, 160, 170), gap=(2, 6), shapes=Shape(w=(4, 20), h=(8, 48)))
FLYER = blob(
    (0x08, 0x94, 0x34), (8, 75, 160, 89), gap=(3, 4), first=0x08, shapes=Shape(w=(1, 8), h=(5, 16))
)
ROCKET_COLORS = (0x0A, 6, 0x98, 0x9C, 0x18, 0x44)
ROCKET_SHAPES = Shape(w=(7, 8), h=(9, 16)), Shape(w=(2, 8), h=(4, 8))  # in the air, in the sea
ROCKETS = blob(ROCKET_COLORS, FIELD, shapes=ROCKET_SHAPES, first=0x0A)
SPARKS = Blobs((0x44, 0x6A), (8, 115, 160, 121), Shape(w=(5, 8), h=(3, 6)), gap=(5, 2))
BURST = Blobs((0xC2, 0x18), SEA, Shape(w=(10, 32), h=(5, 16)), gap=(7, 4))
MISSILES = blob((6, 0x34, 0x1A), FIELD, shapes=Shape(w=(3, 8), h=(5, 16)), first=6)
HELI = Bounds((0x0E, 0x46, 0x42, 0x14), SKY)
ICONS = Bounds((0x26, 0x14, 0x0A), (9, 184, 49, 189), value=Gauge(16, -8, 1, full=40))
POINTS = Bounds(0x18, (54, 15, 102, 22), value=Digits(FONT, range(54, 102, 8), 15))

GAME = Game(
    name="Jamesbond",
    rom=ROM,
    ram=Ram,
    decode=decode,
    shades=NIGHT,
    categories=(
        Category("Player", VEHICLE, doc="the vehicle"),
        Category("Player_Shot", UPWARD, doc="the shot that flies up"),
        Category("Depth_Charge", CHARGE, doc="falls; from the second mission on"),
        Category("Enemy_Shot", Bounds(0xFE, SHOT, (1, 2)), otherwise=DIM, doc="of all enemies"),
        Category("Laser", Bounds(0xFE, (8, 63, 160, 74), (2, 6)), doc="a helicopter's beam"),
        Category("Fire_Hole", HOLE, doc="in the ground"),
        Category("Lab", Bounds((0x18, 0x22, 0x36), (8, 156, 160, 179)), doc="on the sea bed"),
        Category("Ice", Bounds((0x94, 0x08, 0x98), SKY, (1, 10)), doc="a diamond"),
        Category("Satellite", Bounds((0x5A, 0x56, 0x52), SKY, (1, 8)), doc="in the sky"),
        Category("Helicopter", HELI, rgb=(167, 26, 26), doc="in the sky"),
        Category("Hornet", FLYER, doc="in the air"),
        Category("Oil_Rig", Bounds((0x22, 0xCA), LOW, (1, 8)), doc="a goal: to be landed on"),
        Category("Ship", Bounds((0x0A, 0x18, 0x42), LOW, (9, 8)), doc="without its smoke"),
        Category("Diver", Bounds((0xC2, 0x18, 0x94), (8, 131, 160, 152), (1, 18)), doc="swims"),
        Category("Submarine", Bounds((8, 0x72, 0x18), (8, 136, 160, 149), (9, 8)), doc="dives"),
        Category("Torpedo", Bounds((0x18,), (8, 121, 160, 131), (1, 5)), doc="at the surface"),
        Category("Eruption", BURST, doc="of a bomb in the sea"),
        Category("Capsule", Bounds((0xCA, 0xC8, 0xC6), SEA, (1, 8)), doc="a goal: to be touched"),
        Category("Explosion", SPARKS, count=2, doc="above the sea; slots as Bomb's"),
        Category("Bomb", blob(0x44, AIR, shapes=Shape(w=(2, 4), h=5)), count=2, doc="falls"),
        Category("Rocket", ROCKETS, count=2, doc="rises: in the air, in the sea"),
        Category("Missile", MISSILES, count=4, doc="rises: lane * 2 + copy"),
        display("Score", POINTS, doc="points"),
        display("Life", ICONS, rgb=(180, 122, 48), doc="value: one more"),
    ),
)
