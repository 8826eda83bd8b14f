"""Hero: a man with a rotor and a laser flies down mines to miners who are trapped at the bottom.

A room has three parts, one below the other. Wall and LavaWall have the rocks of the parts, without
the dark lines between them, and the wall that can be destroyed. Enemy: the tentacle in a river, the
beings of the middle and the lower part. Bomb and Explosion: middle, top. Score has Level's box
while that is in its place. Scenery: seams and edges, rivers, points for beings, maker's name.

RAM: ALE's source (score, lives), OCAtari 2.2 and AtariARI (what the bytes are), and the ROM's code;
the rooms are tables of the second bank. Everything moves before a frame is drawn but the laser and
the player's legs and rotor, which `decode` takes back. Boxes are without what rocks cover.

Covered: all levels and most rooms (by writing RAM), all modes, the dark, in which walls are not
valid, deaths, the end. Not in RAM: whether a beam that begins has just hit something (near a wall
it is taken for that), where it was when the button was released or the player turned, at times if
he has just stepped, which moves it by a column. A beam of one column is not valid. VEM misses
snakes in green rooms and the dark, enemies that touch rock of their colour, what is behind
dynamite, the values of a PowerBar that is full (78 or more), and of Score while Level is in its
place.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box, choose
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import among, div, lookup, pick
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.registers import EDGE_CUTS
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.filters import NoPairs
from ocjax.vision.rules import Blobs, Bounds, Gauge, Run, Runs
from ocjax.vision.shapes import Shape

ROM = Rom("hero", "fca4a5be1251927027f2c24774a02160")
# offset of the second bank
FONT = ROM.font(0xF00, rows=8)
BANK = 0x1000
# Of the levels: the first room, the last room's number. Of the rooms: dots of the middle part and,
# 256 bytes after them, of the bottom; bits of `FORMS`: the dots are not mirrored, the wall's place.
STARTS = ROM.bytes(BANK + 0xF00, 20)
LASTS = ROM.bytes(BANK + 0xF28, 20)
DOTS = np.stack([ROM.bytes(BANK + 0xA00, 512), ROM.bytes(BANK + 0xC00, 512)], axis=1)
FORMS = ROM.bytes(BANK + 0xE00, 256)
REPEATS = 1
PLACE = 0xFC
EDGES = (8, 152)
FIRST_RIVER = 11  # least room of a river
FIRST_PULSE = 13  # level with lava that moves
# The parts of a room: first lit row, lit rows, most rocks; where figures are seen, in each part.
TOPS = (20, 61, 100)
HEIGHTS = (39, 37, 39)
MOST = 6
VISIBLE = (8, 20, 160, 137)
FIRST_ROWS = np.array((20, 60, 99))
END_ROWS = np.array((60, 99, 137))
PART = np.repeat((0, 1, 2), MOST)
SLOT = np.arange(3 * MOST)
NOTHING = np.zeros(13, np.int32)
# the latter: of the wall
LAVA_SLOT = MOST
UPPER_SLOT = MOST - 1
WALL_SLOT = 2 * MOST - 1
GAP = (76, 84)  # closed by lava
WHOLE_WALL = 78  # rows of the first room's wall, not below rock


def _runs(side: int, dots: np.ndarray, mirrored: bool, edge: int = 0) -> list[int]:
    """What the playfield shows: left edges, widths above them; `edge`: of 8 columns more."""
    inner = [dots[0] >> (7 - i) & 1 for i in range(8)], [dots[1] >> i & 1 for i in range(8)]
    half = np.concatenate([[side] * 4, *inner])
    line = np.repeat(np.concatenate([half, half[::-1] if mirrored else half]), 4)
    line[edge : edge + 8] = 1
    line[:8] = 0  # blanked by the beam
    ends = np.flatnonzero(np.diff(line, prepend=0, append=0)).reshape(-1, 2).tolist()
    return [a | b - a << 8 for a, b in ends]


def _room(room: int, side: int) -> list[int]:
    """The rocks of a room, with or without those at the sides of its middle part."""
    number = room - max(start for start in STARTS.tolist() if start <= room)
    above = DOTS[room + 255] if number else np.array((0xC0, 0))
    above = np.array((0xFF, 0xFF)) if number >= FIRST_RIVER else above
    edge = place if not side and (place := int(FORMS[room]) & PLACE) in EDGES else 0
    middle = _runs(side, DOTS[room], not FORMS[room] & REPEATS, edge)
    parts = _runs(1, above, True), middle, _runs(1, DOTS[room + 256], True)
    return [rock for rocks in parts for rock in [*rocks, *[0] * MOST][:MOST]]


ROOMS = np.array([_room(room, side) for side in (1, 0) for room in range(256)]).ravel()

# Low bytes of pictures and colours (black ones do not show): spider, bat, moth, snake, lamp.
BEINGS = ((0x1A, 0x4D), (0x27, 0x4D), (0x02, 0x5A), (0x0E, 0x5A), (0x34, 0x33), (0x40, 0x33))
BEINGS += ((0x4C, 0x33), (0x58, 0x33), (0x7F, 0x17), (0x92, 0x17), (0x64, 0x8E))
SNAKES = (0x7F, 0x92)
LAMP = 0x64
TENTACLES = (0xA6, 0xB2, 0xBE, 0xCA, 0xD6)
KINDS = [{p: i for i, (p, _) in enumerate(BEINGS)}.get(low, len(BEINGS)) for low in range(256)]
BEING_ROWS = [ROM.rows(0xB00 + p, 13) * (ROM.rows(0xD00 + c, 13) > 1) for p, c in BEINGS]
BEING_PICTURES = Pictures.of([b & cut for cut in EDGE_CUTS[::-1] for b in (*BEING_ROWS, NOTHING)])
BOMBS = (0x26, 0x33, 0x40)
FIRES = (0x4D, 0x58, 0x65)
MINERS = (0x71, 0x7E)
RAFT = 0x97
LOW = dict.fromkeys(BOMBS, 0x68) | dict.fromkeys(FIRES, 0x40) | dict.fromkeys(MINERS, 0x26)
LOW |= dict.fromkeys(TENTACLES, 0xC4) | {RAFT: 0x05}
LOW_ROWS = {p: ROM.rows(0xA00 + p, 13) * (ROM.rows(0xD00 + c, 13) > 1) for p, c in LOW.items()}
LOW_PICTURES = Pictures.of(LOW_ROWS.get(low, NOTHING) for low in range(256))
# Hurt, in a flash, in flight (3), falling, on his way (5); without rows at the bottom or top.
POSES = (0xAE3, 0xEE7, 0xE82, 0xE9B, 0xEB4, 0xECD, 0xCE6, 0xCCD, 0xCB4, 0xC9B, 0xC82)
HURT = 0
FLASHED = 1
FLIES = 2
FALLS = 5
WALKS = 6
TALL = 24
WEST = 12
EAST = 4
ROWS = [(np.arange(TALL) - cut) // TALL == 0 for cut in range(-TALL, TALL + 1)]
PLAYERS = Pictures.of([pose * rows for pose in ROM.rows(POSES, TALL) for rows in ROWS])
# least x and the `being_y` of no object
NOWHERE = 147
GONE = 50
DEAD = 0x96  # least `dying` of a hit
HALF = 0x80  # `hits` of half a wall
GROUND = 0x80  # `walks`
# `y` of parts; `stick`
LOWEST = ROM.bytes(0x9E9, 3)
HIGHEST = ROM.bytes(0x9EC, 3)
NEITHER = 3
REACH = 16  # columns that a beam flies
MIRRORED = 0x18  # x of the miner in a mirrored room
NO_LEVELS = 4  # `mode`
BLANK = 0xAA  # first byte of `score`
SCORES = 0x14  # from this `over` on


class Ram(RamMap):
    mode = bits(0, count=7)
    clock = bits(1, count=2)
    stick = bits(4, first=6, count=2)  # left, right; 1: not pressed
    x = byte(27)
    room = byte(28)  # of the level
    y = byte(31)  # 135 - y
    wall = byte(32)  # x + 1
    being_y = byte(35, 34, 33)  # rows above the lowest place; top, middle, bottom
    being_x = byte(39, 38, 37)
    low_x = byte(40, 41, 42)  # bottom, middle, top
    power = byte(43)
    walks = byte(44)
    dying = byte(45)  # counts down
    ready = byte(47)  # 0 while the power fills
    facing = byte(48)  # 0: to the right
    hits = byte(49)  # of the laser on the wall
    bombs = byte(50)
    lives = byte(51)
    over = byte(54)
    score = bcd((55, 56, 57))
    score_start = byte(55)
    waits = byte(58)
    side = byte(62)  # dots at the sides of the middle part
    dots = byte(67)  # of the middle part, where lava closes a passage for some time
    color = byte(71, 70, 69)  # of the rocks: top, middle, bottom
    being = byte(77, 76, 75)  # low byte of the picture's address
    low = byte(88, 89, 90)  # likewise
    flash = byte(97)
    contact = byte(98, 99, 100)  # of the player in each part; bits: with rock, the wall
    flight, step = byte(103), byte(104)  # pictures of the rotor and the legs, count down
    saved = byte(114)
    laser = byte(115)  # columns that the beam has flown
    touched = byte(116)  # what the beam touched
    level = byte(117)
    points = byte(121, 120, 119)  # frames that points are shown for a being
    turns = byte(124)  # frames


def decode(m: Ram) -> dict[str, Box]:
    rocks, lava, snake = _rocks(m), (m.color[1] & 0xF0) == 0x40, among(m.being, SNAKES)
    (beings, low), level = _figures(m, rocks), m.level + 1
    after = (m.lives == 0) & (m.score_start != BLANK) & ((m.over & 0x1F) >= SCORES)
    levels = (m.mode != NO_LEVELS) & jnp.where(m.waits == 0, m.ready == 0, after)
    score = score_box(FONT, m.score, right=104, top=179, digits=6, value=m.score)
    number = score_box(FONT, level, right=104, top=179, digits=2)
    text = box(59, 179, number.x + number.w - 59, 8, levels, value=level)
    whole = (m.room == 0) & (SLOT == WALL_SLOT)
    top, height = jnp.where(whole, TOPS[0], rocks.y), jnp.where(whole, WHOLE_WALL, rocks.h)
    assert rocks.color is not None
    rock = jnp.where(whole, m.color[0] & ~1, rocks.color)
    shown = box(59, 179, text.w, 8, value=m.score)
    bar = jnp.where(m.power == 0, RED, YELLOW)
    text_color = jnp.where(levels, YELLOW, WHITE)
    stone = ((PART != 1) | ~lava | whole) & ((SLOT != UPPER_SLOT) | (m.room != 0))
    return {
        "Player": _player(m, rocks),
        "Enemy": choose(SLOT[:3] == 0, low.where(among(m.low, TENTACLES)), beings.where(~snake)),
        "Snake": beings.where(snake)[1:],
        "Lamp": beings.where(m.being == LAMP)[:1],
        "Bomb": low.where(among(m.low, BOMBS))[1:],
        "Explosion": low.where(among(m.low, FIRES))[1:],
        "LaserBeam": _laser(m, rocks),
        "EndNPC": low.where(among(m.low, MINERS))[1:2],
        "Platform": low.where(m.low == RAFT)[:1],
        "Wall": box(rocks.x, top, rocks.w, height, rocks.valid & stone, color=rock),
        "LavaWall": rocks.where(lava)[MOST : 2 * MOST],
        "PowerBar": box(49, 145, jnp.where(m.power < 79, 79, 78), 5, value=m.power, color=bar),
        "Life": box(113 - 8 * m.lives, 152, 8 * m.lives - 11, 13, m.lives > 1, value=m.lives),
        "BombStock": box(107 - 8 * m.bombs, 166, 8 * m.bombs - 5, 11, m.bombs > 0, value=m.bombs),
        "Score": replace(choose(levels, shown, score), color=text_color),
        "Level": text,
    }


def _rocks(m: Ram) -> Box:
    """The rocks of each part, and the wall that can be destroyed, which has two parts in room 0."""
    room = (pick(m.level, STARTS.tolist()) + m.room & 255) + jnp.where(m.side == 0, 256, 0)
    packed = lookup(ROOMS, len(PART) * room + SLOT)
    x, end = packed & 255, (packed & 255) + (packed >> 8)
    moves = (end[LAVA_SLOT] == GAP[0]) & (x[LAVA_SLOT + 1] == GAP[1]) & (m.level >= FIRST_PULSE)
    reach = 48 + 4 * jax.lax.population_count(m.dots)
    end = jnp.where(moves & (SLOT == LAVA_SLOT), jnp.where(reach == 80, 160, reach), end)
    x = jnp.where(moves & (SLOT == LAVA_SLOT + 1), jnp.where(reach == 80, end, 160 - reach), x)
    wall = (SLOT == WALL_SLOT) | ((SLOT == UPPER_SLOT) & (m.room == 0))
    wall = wall & (m.wall > EDGES[0] + 1) & (m.wall <= EDGES[1])
    x = jnp.where(wall, m.wall - 1, x)
    end = jnp.where(wall, x + jnp.where(m.hits >= HALF, 4, 8), end)
    color = jnp.repeat(m.color, MOST, total_repeat_length=len(PART))
    there = (end > x) & (color > 1)
    return box(x, np.array(TOPS)[PART], end - x, np.array(HEIGHTS)[PART], there, color=color & ~1)


def _free(rocks: Box, begin: jax.Array, end: jax.Array) -> tuple[jax.Array, jax.Array]:
    """What rocks leave of a stretch of columns in each part; `begin` and `end` are `[3]`."""
    x, w = rocks.x.reshape(3, MOST), rocks.w.reshape(3, MOST)
    a, b = begin[:, None], end[:, None]
    left = jnp.max(jnp.where((x <= a) & (x + w > a), x + w, a), axis=1)
    return left, jnp.min(jnp.where((x < b) & (x + w >= b), x, b), axis=1)


def _figures(m: Ram, rocks: Box) -> tuple[Box, Box]:
    """What is in the upper halves of the parts, without what rocks cover, and in the lower ones."""
    mirrored = (m.room == pick(m.level, LASTS.tolist())) & (m.low_x[1] == MIRRORED)
    left, right = (edge - m.being_x for edge in _free(rocks, m.being_x, m.being_x + 8))
    cut = jnp.where(mirrored, -1, 1) * jnp.where(left > 0, left, right - 8)
    picture = (len(BEINGS) + 1) * (8 + jnp.clip(cut, -8, 8)) + lookup(KINDS, m.being)
    there = (m.being_x < NOWHERE) & (m.being_y != GONE) & (m.points == 0)
    y, low_y = np.array([31, 70, 109]) - m.being_y, np.array([125, 86, 47])
    beings = BEING_PICTURES.box(picture, m.being_x, y, valid=there, mirrored=mirrored)
    low = LOW_PICTURES.box(m.low, m.low_x, low_y, valid=m.low_x < NOWHERE, mirrored=mirrored)
    return beings.clip(*VISIBLE), low


def _player(m: Ram, rocks: Box) -> Box:
    """The player before the next step of his legs or his rotor, without what rocks cover."""
    flight = m.flight + jnp.where((m.clock >= 2) & (m.saved == 0), 1, 0)
    step = m.step + jnp.where((m.clock == 0) & (m.saved == 0), 1, 0)
    picture = jnp.where(m.walks >= GROUND, WALKS + jnp.where(step == 5, 0, step), FALLS)
    picture = jnp.where(m.walks == 0, FLIES + jnp.where(flight == 3, 0, flight), picture)
    picture = jnp.where(m.dying >= DEAD, HURT, jnp.where(m.flash > 0, FLASHED, picture))
    left, y, facing = m.facing != 0, 135 - m.y, jnp.where(m.facing != 0, WEST, EAST)
    whole = PLAYERS.box(len(ROWS) * picture + TALL, m.x, y, mirrored=left)
    top, bottom = jnp.maximum(y, VISIBLE[1]), jnp.minimum(y + TALL, VISIBLE[3])
    begin, end = _free(rocks, jnp.repeat(whole.x, 3), jnp.repeat(whole.x + whole.w, 3))
    seen = (top < END_ROWS) & (bottom > FIRST_ROWS) & (begin < end)
    top = jnp.maximum(top, jnp.min(jnp.where(seen, FIRST_ROWS, 255)))
    bottom = jnp.minimum(bottom, jnp.max(jnp.where(seen, END_ROWS, 0)))
    cut = jnp.where(top > y, top - y, bottom - y - TALL)
    cut = len(ROWS) * picture + TALL + jnp.clip(cut, -TALL, TALL)
    player = PLAYERS.box(cut, m.x, y, mirrored=left, orientation=facing)
    begin, end = jnp.min(jnp.where(seen, begin, 255)), jnp.max(jnp.where(seen, end, 0))
    return player.clip(begin, 20, end, 137).clip(*VISIBLE).where((m.over == 0) & (bottom > top))


def _laser(m: Ram, rocks: Box) -> Box:
    """The beam before it flew on, from where the player was; after it has hit, it begins anew."""
    left, half = m.facing != 0, m.hits >= HALF
    row, width = 139 - m.y, jnp.where(half, 4, 8)
    ours = ((row >= FIRST_ROWS) & (row < END_ROWS))[PART] & (rocks.w > 0)
    ends = rocks.x + rocks.w
    begin = jnp.max(jnp.where(ours & (ends <= m.x + 4), ends, VISIBLE[0]))
    end = jnp.min(jnp.where(ours & (rocks.x >= m.x + 4), rocks.x, VISIBLE[2]))
    level = among(m.y - LOWEST, (0, -1)) | among(m.y - HIGHEST, (0, 1))
    pushed = jnp.any(jnp.where(m.contact >= 128, ~level, (m.contact >= 64) & (m.wall > 0)))
    moves = (m.stick != NEITHER) | (m.walks == GROUND) | ((m.x & 3) > 0)
    moves = moves & ~pushed & (m.turns == 0) & (m.dying == 0) & (m.saved == 0) & (m.flash == 0)
    x = m.x - jnp.where(moves, jnp.where(left, -1, 1), 0)
    start = jnp.where(left, x - 6 + jnp.where(half, 4, 0), x + 6)
    space = jnp.where(left, start - begin, end - start - width)
    reach = 3 * div(jnp.maximum(space + 3, 0), 3)
    begun = (m.laser == 0) & (m.touched == 0)
    flown = jnp.where(begun, reach, (m.laser - 3) & (REACH - 1))
    there = (m.laser < REACH) & (~begun | (reach < REACH))
    x = start + jnp.where(left, -flown, flown)
    beam = box(x, row, width, 1, there).clip(begin, VISIBLE[1], end, VISIBLE[3])
    return beam.where(beam.w > 1)


HIGH_ROCK = (0x22, 0x92, 0xC2, 2)
MIDDLE_ROCK = (0x24, 0x94, 0xC4, 2, 4)
LOW_ROCK = (0x26, 0x96, 0xC6, 2, 6)
GREY = 4
YELLOW = 0x1C
WHITE = 0x0C
RED = 0x42
# The destructible wall of the first room, and the rocks of the three parts.
ROCKS = Runs(
    (
        Run(HIGH_ROCK, 20, left=(60, 64), width=(4, 8), height=78),
        Run(HIGH_ROCK, 20, left=8, width=8, height=39),
        Run(HIGH_ROCK, 20, left=(8, 159), width=(9, 152), height=39),
        Run(MIDDLE_ROCK, 61, left=(8, 59), width=(4, 152), height=37),
        Run(MIDDLE_ROCK, 61, left=(60, 67), width=(9, 152), height=37),
        Run(MIDDLE_ROCK, 61, left=(68, 159), width=(4, 152), height=37),
        Run(LOW_ROCK, 100, left=(8, 159), width=(8, 152), height=39),
    ),
    MOST,
)
LAVA = Runs((Run((0x42, 0x44), 61, left=(8, 159), width=(4, 152), height=37),), MOST)
figures = functools.partial(Blobs, gap=(1, 1))
player = functools.partial(Blobs, (0x98, WHITE, YELLOW), gap=(2, 5))  # but his face
FEET = player((8, 20, 160, 31), shapes=Shape(w=(1, 3), h=(1, 10)))
PLAYER = player(VISIBLE, shapes=Shape(w=(4, 12), h=(2, 26)), also=(FEET,))
MINERS_AT = ((24, 85, 34, 98), (127, 85, 138, 98))
below = functools.partial(figures, region=(8, 61, 160, 139), ignore=MINERS_AT)
MONSTER = below((*range(0x24, 0x2E, 2), 4, 6, 8, 0xAA), shapes=Shape(w=(4, 8), h=(3, 13)))
SNAKE = below((0xC4, 0xC6, 0xC8, 0xCA), shapes=Shape(w=(1, 8), h=(2, 8)))
LANTERN = figures((0x1E, 4, 6), (8, 20, 160, 59), shapes=Shape(w=(4, 7), h=(5, 9)))
STICK = figures((0x44, YELLOW), VISIBLE, shapes=Shape(w=3, h=(10, 12)))
BLAST = Blobs(0x1E, VISIBLE, Shape(w=(5, 8), h=(10, 13)), gap=(3, 3))
MINER = figures((8, 0xC8, 0x4A, 0x1E), (8, 85, 160, 98), shapes=Shape(w=(6, 7), h=(10, 13)))
BEAM = Blobs(0x46, VISIBLE, Shape(w=(2, 12), h=1), filters=(NoPairs(1),))  # but dots of the face
LIVES = Bounds(GREY, (40, 152, 104, 166), value=Gauge(8, 5, 2), inverse=True)
STOCK = Bounds(GREY, (40, 166, 104, 178), value=Gauge(8, 3, 1), inverse=True)
POINTS = Bounds((WHITE, YELLOW), (56, 179, 104, 187), value=Digits(FONT, range(56, 104, 8), 179))
LEVEL = Bounds(YELLOW, (56, 179, 104, 187), value=Digits(FONT, (88, 96), 179))
POWER = Bounds(YELLOW, (49, 145, 128, 150))  # what is left, before the red rest
POWER_BAR = Bounds((YELLOW, RED), (49, 145, 128, 150), value=Gauge(1, full=78, of=POWER))
GAME = Game(
    name="Hero",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", PLAYER, attributes=("orientation",), rgb=(84, 138, 210), doc="the man"),
        Category("Enemy", MONSTER, count=3, rgb=(180, 122, 48), doc="tentacle, middle, low"),
        Category("Snake", SNAKE, count=2, rgb=(111, 210, 111), doc="middle, low"),
        Category("Lamp", LANTERN, rgb=(252, 252, 84), doc="out when it is touched"),
        Category("Bomb", STICK, count=2, rgb=(184, 50, 50), doc="dynamite: middle, top"),
        Category("Explosion", BLAST, count=2, doc="of dynamite: middle, top"),
        Category("LaserBeam", BEAM, doc="beam"),
        Category("EndNPC", MINER, rgb=(170, 170, 170), doc="the miner to be saved"),
        Category("Platform", Bounds(YELLOW, (8, 136, 160, 137), min_size=(8, 1)), doc="a raft"),
        Category("Wall", ROCKS, count=18, doc="rock"),
        Category("LavaWall", LAVA, count=6, doc="lava"),
        display("PowerBar", POWER_BAR, doc="power left"),
        display("Life", LIVES, rgb=(45, 87, 176), doc="one more than the men"),
        display("BombStock", STOCK, rgb=(184, 50, 50), doc="dynamite left"),
        display("Score", POINTS, doc="points, or the level in their place"),
        display("Level", LEVEL, doc="shown before a life"),
    ),
)
