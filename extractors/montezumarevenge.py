"""Montezuma's Revenge: an explorer in the rooms of a pyramid, with keys, monsters and traps.

A room has things or monsters of one kind in up to three copies, which are its slots; the last slot
of Skull is the one that rolls in rooms 1, 5 and 18. Platform: ledges. Disappearing_Platform:
bridges, and the steps of room 8. Wall: rock, and bars that close rooms. Ladder: also those in the
bricks. Pole: a rope in the rocks' colour. Scenery: ceilings, bricks with their floors, fire pits.
In the dark (rooms 16 and up) there are only bridges, skulls, spiders and the explorer.

RAM: ALE's source (score, lives), OCAtari 2.2 (what the bytes are), and the ROM's code: things and
skulls move at F8C0-F9F0 of the first bank, before a room is drawn (second bank, table at F352), the
explorer after it, at F159-F75D, which `_explorer` takes back. His picture is chosen in between, for
the next frame. Each room has code of its own: `LAYOUT` was read off the screen.

Covered: all rooms of the three pyramids (by writing RAM), lit and dark, traps, the end. Not in RAM:
whether a wall stopped a step, where he caught a ladder or rope, his last picture but one, the room
that he has just left. VEM misses what he hides, spiders before ladders, ropes in other colours.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console import registers
from ocjax.console.boxes import Box, box, choose
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import among, lookup, pick
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Blobs, Bounds, Gauge, Run, Runs
from ocjax.vision.shapes import Shape

ROM = Rom("montezuma_revenge", "3347a6dd59049b15a38394aa2dafa585")
# and offsets
FONT = ROM.font(0xC08, rows=8, top_first=True)
D000 = 0x1000
FC00 = 0x1C00
EXITS = 2
PLAYS = 4
FALLS = 7
BLANK = 1
STANDS = 8
CLIMBS = 10
SWINGS = 14
STRIDES = 18
SIDEWAYS = 2
ROOMS = 24
BONUS = 15
HIDDEN = 19
LONG_BEAMS = 12
BRIDGE_OFF = 36
TORCH = 0x80
JUST_DIED = 91
LOWER = (0, 7, 12, 17, 18)  # rooms that begin a row later
LADDER_TOP = 0xFE
TOP_FLOOR = 0xEB
LADDER_FOOT = 0x86
FIRST_BEAM = 0xA3
DOOR = 0x7C
WESTS, EASTS = (ROM.bytes(0x1F00 + low, 12).tolist() for low in (0x56, 0x62))  # limits, by floor
SKULL_ROOMS = (1, 5, 18)
SKULL_BASE = (0, 406, 0, 0, 0, 358, 309)
FAR_ROOM = 18
ROPES = (112, 96, 113, 135), (41, 97, 42, 122), (80, 96, 81, 147), (71, 96, 72, 144)
BEAM_X = np.array((16, 36, 44, 60, 68, 88, 96, 112, 120, 140))
# by phase
BEAM_TOPS = (56, 57, 54, 55, 57, 54, 55, 56)
BEAM_ENDS = (93, 90, 91, 92)
# room 12: LONG
SHORT = ~((BEAM_X > 44) & (BEAM_X < 112))
LONG = (BEAM_X > 16) & (BEAM_X < 140)
# Parts of the rooms: rooms, left, top, width, height; then runs of pixels by which VEM knows them:
# colours (rock, ladder, both, door, force), left, width, row.
STEP = ";8 4 {0} 12 4 S 8 4 {1} S 12 4 {1};8 144 {0} 12 4 S 148 4 {1} S 144 4 {1}"
LAYOUT = {
    "Platform": """1 0 93 56 3 R 0 56 95; 1 68 93 24 3 R 68 24 95; 1 104 93 56 3 R 104 56 95;
        1 0 136 36 3 R 0 36 137; 1 124 136 36 3 R 124 36 137; 5 48 130 64 3 R 48 64 131;
        5,8 0 93 48 3 R 0 48 95; 5,8 112 93 48 3 R 112 48 95; 8 76 93 8 3 R 76 8 93;
        14 0 93 40 3 R 0 40 95; 14 68 93 24 3 R 68 24 95; 14 120 93 40 3 R 120 40 95""",
    "Wall": """1 0 96 8 40 B 0 8 101; 1 152 96 8 40 B 152 8 101; 1 0 139 16 41 B 0 32 158;
        1 144 139 16 41 B 128 32 158; 5,8 0 96 4 75 B 0 4 101; 5,8 156 96 4 75 B 156 4 101;
        5 32 53 4 40 B 32 4 68; 5 124 53 4 40 B 124 4 68; 14 0 96 16 72 B 0 16 101;
        14 144 96 16 72 B 144 16 101; 3,8,10,21 0 53 4 41 B 0 4 68;
        2,9,20,23 156 52 4 41 B 156 4 68; 0 0 53 4 42 F 0 4 93; 7 156 53 4 41 F 156 4 93""",
    "Ladder": """4,6,9,10,11,13,19,21,22 72 53 16 40 L 72 16 71; 1 72 96 16 39 R 72 16 108;
        0,7 72 95 16 101 R 76 8 108; 2,3,4,11,13 72 94 16 101 R 76 8 107;
        5 72 173 16 24 R 76 8 179; 14 72 170 16 24 R 76 8 176;
        1 16 139 16 41 R 0 32 158; 1 128 139 16 41 R 128 32 158""",
    "Pole": "5 125 96 2 51 R 125 2 98; 14 87 96 2 32 R 87 2 98",
    "Conveyer_Belt": "1 60 136 40 5 R 60 40 138; 5 60 93 40 5 R 60 40 95",
    "Barrier": """1 20 54 4 37 D 20 4 60; 1 136 54 4 37 D 136 4 60; 17 20 55 4 37 D 20 4 61;
        17 136 55 4 37 D 136 4 61; 5 56 135 4 35 R 56 4 135; 5 100 135 4 35 R 100 4 135""",
    "Disappearing_Platform": "10,20,22 36 94 88 6 S 44 8 94 S 52 8 94 S 36 8 94"
    ";18 36 95 88 6 S 44 8 100 S 52 8 100 S 36 8 100"
    + "".join(STEP.format(y, y + 1) for y in (103, 113, 123, 133, 153, 163)),
}
SUIT = 0x46
SKIN = 0xFA
GREY = 0x08
FORCE = 0x8A
GOLD = 0xFC
MAN = (0x46, 0x4A, 0x4C, 0xFA)
ROCK, RUNGS = ROM.bytes(FC00 + 0x1FF, 12).reshape(2, 6).tolist()  # by depth and pyramid
PAINT = {"R": (*ROCK, *MAN), "L": (*RUNGS, *MAN), "B": (*ROCK, *RUNGS, *MAN)}
PAINT |= {"S": (*ROCK, *RUNGS), "D": (GOLD,), "F": (FORCE,)}


def _declare(text: str, most: int) -> tuple[Runs, np.ndarray]:
    """How VEM finds a category's parts, and their boxes in each room, packed: `[rooms, slots]`."""
    found, places = {}, [[] for _ in range(ROOMS)]
    for part in text.split(";"):
        rooms, *rest = part.split()
        x, y, w, h = map(int, rest[:4])
        for room in rooms.split(","):
            places[int(room)].append(x | y << 8 | w << 16 | h << 24)
        for paint, *run in zip(*(rest[i::4] for i in range(4, 8)), strict=True):
            at, wide, row = map(int, run)
            margins = {"before": at - x, "above": row - y, "after": x + w - at - wide}
            found[row, paint, at, wide] = Run(PAINT[paint], row, at, wide, y + h - row, **margins)
    runs = Runs(tuple(found[key] for key in sorted(found)), most)
    used = max(map(len, places))
    return runs, np.array([boxes + [0] * (used - len(boxes)) for boxes in places])


CROWDED = ("Platform", "Wall", "Disappearing_Platform")  # up to four runs in a row
PARTS = {name: _declare(text, 3 + (name in CROWDED)) for name, text in LAYOUT.items()}
PLACES = np.hstack([places for _, places in PARTS.values()]).astype(np.uint32).view(np.int32)


def _picture(offset: int) -> np.ndarray:
    """Rows of a picture, which a row without dots ends."""
    rows = ROM.rows(offset, 20, top_first=True)
    return rows * (np.cumsum(rows == 0) == 0)


# low bytes of pictures
NOTHING = np.zeros(1, np.int32)
JUMP = 0xA5
GONE = 0x75
RUBY = 0x36
SWORD = 0x3E
AMULET = 0x4E
KEY = 0x2E
SKULL = 0x17
TORCHES = (0x68, 0x0A)
SNAKES = (0xEE, 0xFC)
SPIDERS = (0x47, 0x57)
FLAME = 0x0A
OFFSETS = {RUBY: D000 + 0x136, SWORD: FC00 + 0x13E, AMULET: FC00 + 0x14E, KEY: FC00 + 0x12E}
OFFSETS |= {SKULL: D000 + 0x217, 0x68: FC00 + 0x168, FLAME: D000 + 0x20A, 0xEE: D000 + 0x1EE}
OFFSETS |= {0xFC: D000 + 0x1FC, 0x47: D000 + 0x147, 0x57: D000 + 0x157}
THINGS = Pictures.of(_picture(OFFSETS[p]) if p in OFFSETS else NOTHING for p in range(256))
ROLLS = ROM.bytes(FC00 + 0x1A3, 16, step=2)
ROLLING = Pictures.of(_picture(D000 + 0x200 + p) if p in ROLLS else NOTHING for p in range(256))
SINKS = ROM.bytes(D000 + 0x2F1, 16).tolist()  # rows by which a rolling skull is lower
# The explorer's pictures, from 5 on two by turns; how much lower they are, by low byte the first.
POSES = (0x03E, 0x075, 0x07B, 0x0A5, 0x000, 0x03E, 0x052, 0x07B, 0x090, 0x000, 0x02A)
POSES += (0x0BA, 0x0C9, 0x0E7, 0x0FD, 0x2C8, 0x2DD)
EXPLORERS = Pictures.of(_picture(D000 + p) if p != GONE else NOTHING for p in POSES)
LIFTS = ROM.bytes(0xFEF, len(POSES)).tolist()
PAIR = np.zeros(256, np.int32)
PAIR[[p & 255 for p in POSES]] = [0, 1, 2, 3, 4, 5, 5, 7, 7, 9, 9, 11, 11, 13, 13, 15, 15]
UPRIGHT = 4
PAIRED = 5
SECOND = tuple(p & 255 for p in POSES[6::2])
ARC = [v - 256 if v > 127 else v for v in ROM.bytes(FC00 + 0x247, 20).tolist()]  # of a jump


class Ram(RamMap):
    clock = byte(0)
    state = byte(2)
    room = byte(3)
    dark = byte(4)  # frames without a picture
    score = bcd((19, 20, 21))
    thing = byte(22)  # low byte of its picture's address
    rolling = byte(24)  # likewise, of the rolling skull
    left_door, right_door = byte(26), byte(28)  # likewise; of the beams
    picture = byte(30)  # low byte of the explorer's next one
    x = byte(42)  # x + 1
    y = byte(43)
    thing_x = byte(44)  # x + 1
    thing_y = byte(45)
    skull_x = byte(47)  # x + 1
    skull_y = byte(46)
    west = bits(52, first=6)
    mirrored = bits(52, first=3)
    drifts = bits(52, first=2)  # on in a fall
    pose = byte(53)
    lives = byte(58)  # less the one in play
    turned = byte(61)  # of the rolling skull
    roll = bits(62, count=4)
    things = byte(65)  # carried; the highest bit: a torch
    off = byte(83)  # frames until bridges are there again
    copies = bits(84, count=3)  # of the thing, as in NUSIZ1
    jump = byte(86)  # rest of a jump
    leap = byte(87)  # kind of a jump
    floor = byte(96)
    stick = bits(102, first=4, count=4)  # up, down, left, right; 1: not pressed
    tune = byte(108)  # counts the steps of one


def decode(m: Ram) -> dict[str, Box]:
    room, drawn, torch = m.room, m.dark != BLANK, m.things >= TORCH
    lit = drawn & ((room < BONUS) | (torch & (room != BONUS)))
    things, rolling, carried = _things(m, room), _rolling(m, room), _carried(m)
    thing = things.where(drawn & ((room < HIDDEN) | torch))
    skulls, spiders = (things.where(drawn & among(m.thing, kinds)) for kinds in ((SKULL,), SPIDERS))
    roped, (rope_x, rope_top, _, rope_end) = room == np.array((1, 5, 8, 14)), np.array(ROPES).T
    return {
        "Player": _explorer(m, room).where(drawn),
        "Skull": choose(np.arange(3) == 2, rolling.where(drawn), skulls),
        "Snake": thing.where(among(m.thing, SNAKES)),
        "Spider": spiders[:1],
        "Ruby": thing.where(m.thing == RUBY),
        "Key": thing.where(m.thing == KEY)[:1],
        "Sword": thing.where(m.thing == SWORD)[:1],
        "Amulet": thing.where(m.thing == AMULET)[:1],
        "Torch": thing.where(among(m.thing, TORCHES))[:1],
        "Beam": _beams(m, room).where(drawn),
        "Rope": box(rope_x, rope_top, 1, rope_end - rope_top, roped & drawn),
        **_parts(m, room, drawn, lit),
        "Torch_HUD": carried[:1],
        "Sword_HUD": carried[1:3],
        "Key_HUD": carried[3:7],
        "Amulet_HUD": carried[7:],
        "Life": box(56, 15, 8 * m.lives - 1, 5, m.lives > 0, value=m.lives + 1),
        "Score": score_box(FONT, m.score, right=104, top=6, digits=6, value=m.score),
    }


def _parts(m: Ram, room: jax.Array, drawn: jax.Array, lit: jax.Array) -> dict[str, Box]:
    """The parts of the room."""
    slots, turn, end = PLACES.shape[1], m.clock & 127, 0
    packed = lookup(PLACES.ravel(), slots * room + np.arange(slots))
    bridged = (turn == 0) | ((m.off == 0) & (turn != BRIDGE_OFF))
    right, parts = np.arange(PARTS["Barrier"][1].shape[1]) == 1, {}
    there = dict.fromkeys(PARTS, lit) | {"Disappearing_Platform": drawn & bridged}
    there["Barrier"] = lit & (jnp.where(right, m.right_door, m.left_door) == DOOR)
    for name, (runs, places) in PARTS.items():
        start, end = end, end + places.shape[1]
        own = jnp.where(there[name] & (room < ROOMS), packed[start:end], 0)
        own = jnp.pad(own, (0, runs.slots - places.shape[1]))
        parts[name] = box(*(own >> shift & 255 for shift in (0, 8, 16, 24)), valid=own != 0)
    return parts


def _things(m: Ram, room: jax.Array) -> Box:
    """The thing or monster of the room, in up to three copies."""
    number, copy = registers.copies(m.copies), np.arange(3)
    x = registers.wrap(m.thing_x - 1 + copy * registers.spacing(m.copies))
    base = jnp.where(room == 0, 310, jnp.where(among(room, LOWER), 309, 308))
    base = jnp.where(room == 1, 353, jnp.where((room == 14) & (m.thing_y < 216), 312, base))
    top = base - m.thing_y + jnp.where(m.thing == FLAME, 5, 0)
    return THINGS.box(m.thing, x, top, valid=copy < number).clip(0, 0, 160, 210)


def _rolling(m: Ram, room: jax.Array) -> Box:
    """The skull that rolls in some rooms."""
    x = m.skull_x + jnp.where(room == FAR_ROOM, -1, 32)
    y = pick(room, SKULL_BASE) - m.skull_y + pick(m.roll, SINKS)
    there = (m.rolling != GONE) & among(room, SKULL_ROOMS)
    return ROLLING.box(m.rolling, x, y, valid=there, mirrored=m.turned != 0)


def _beams(m: Ram, room: jax.Array) -> Box:
    """The beams, which are lit on every fourth row; by the columns of all rooms."""
    long, phase = room == LONG_BEAMS, m.left_door - FIRST_BEAM
    there = among(phase, range(4)) & jnp.where(long, LONG, among(room, (0, 7)) & SHORT)
    top = pick(phase + jnp.where(long, 4, 0), BEAM_TOPS)
    bottom = pick(phase, BEAM_ENDS) + jnp.where(long, 1, 0)
    return box(BEAM_X, top, 4, bottom - top, there)


def _carried(m: Ram) -> Box:
    """What the explorer carries, from the left, by bit of `things`."""
    bit = (m.things >> np.arange(7, -1, -1)) & 1
    rank = jnp.cumsum(bit) - bit
    kinds = jnp.array((TORCHES[0], SWORD, SWORD, KEY, KEY, KEY, KEY, AMULET))
    return THINGS.box(kinds, 56 + 8 * rank, 28, valid=(bit == 1) & (rank < 6))


def _explorer(m: Ram, room: jax.Array) -> Box:
    """The explorer, before the step that he has taken after the room was drawn."""
    up, down, left, right = (m.stick >> i & 1 == 0 for i in range(4))
    falls, west = m.state == FALLS, m.west == 1
    mid_air = among(m.state, (PLAYS, EXITS)) & (m.jump < len(ARC) - 1)
    plays, landed = m.state == PLAYS, (m.picture == JUMP) & (m.pose == STANDS)
    climbs = plays & (m.jump >= 128) & among(m.pose, (CLIMBS, SWINGS)) & ~left & ~right
    climbs = climbs & jnp.where(up, m.y != LADDER_TOP, down & (m.y != LADDER_FOOT))
    rise = jnp.where(falls & (m.pose != STRIDES), -2, 0)
    rise = jnp.where(climbs, jnp.where(up, 1, -1), rise)
    y = m.y - jnp.where(mid_air, pick(m.jump + 1, ARC), jnp.where(landed, ARC[0], rise))
    leaps = plays & mid_air & (m.leap == SIDEWAYS)
    walks = (plays | falls) & (m.pose == STRIDES) & (left | right) & (m.jump >= 128)
    drifts = falls & (m.drifts == 1) & ((m.clock & 1) == 0) & ~landed
    stop = jnp.where(west, m.x < pick(m.floor, WESTS), m.x >= pick(m.floor, EASTS))
    ways = jnp.stack((~west, west, ~west, west)) | leaps
    shut = among(room, (1, 17)) & (m.left_door == DOOR) & (m.y >= TOP_FLOOR)
    stop = stop | (shut & jnp.any((m.x == np.array((14, 24, 130, 140))) & ways))
    x = m.x - jnp.where((leaps | walks | drifts) & ~stop, jnp.where(west, -1, 1), 0)
    belt = (room == 1) & (x >= 0x37) & (x < 0x63) & (m.y >= 0xBB) & (m.y < 0xC5)
    belt = belt | ((room == 5) & (x >= 0x38) & (x < 0x64) & (m.y == 0xEB))
    x = x + jnp.where(belt & plays & ((m.clock & 1) == 0), 1, 0)
    pose = jnp.where(m.tune == JUST_DIED, UPRIGHT, lookup(PAIR, m.picture))
    turns = (pose >= PAIRED) & ((m.pose >= CLIMBS) | among(m.picture, SECOND))
    pose = pose + jnp.where(turns, (m.clock - 1) >> 2 & 1, 0)
    top = 308 + jnp.where(among(room, LOWER), 1, 0) - y + pick(pose, LIFTS)
    return EXPLORERS.box(pose, x - 1, top, mirrored=m.mirrored == 1)


EXPLORER = Bounds((*MAN, GREY), (0, 53, 160, 197), exclude=("Amulet",))
thing = functools.partial(Blobs, region=(0, 53, 160, 181), shapes=Shape(w=(5, 8), h=(7, 15)))
carried = functools.partial(Blobs, GOLD, (56, 28, 104, 43))
RAYS = Bounds(FORCE, tuple((x, 54, x + 4, 94) for x in BEAM_X.tolist()), min_size=(4, 5))
item = functools.partial(display, attributes=(), doc="carried")
LIVES = Bounds((SKIN, SUIT), (56, 15, 104, 20), value=Gauge(8, -1, 1))
POINTS = Bounds(0x0E, (56, 6, 104, 14), value=Digits(FONT, range(56, 104, 8), 6))
PART_RGB = dict.fromkeys(PARTS, (66, 158, 130)) | {"Barrier": (232, 204, 99)}
GAME = Game(
    name="MontezumaRevenge",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", EXPLORER, rgb=(200, 72, 72), doc="the explorer"),
        Category("Skull", thing(0x0E), count=3, doc="hopping, or rolling (the last slot)"),
        Category("Snake", thing(0x0A), count=3, doc="snakes"),
        Category("Spider", thing(0xC8), doc="a spider"),
        Category("Ruby", thing(0x38), count=3, doc="rubies"),
        Category("Key", thing(GOLD), doc="a key"),
        Category("Sword", thing(0x0C), doc="a sword"),
        Category("Amulet", thing(SKIN), doc="an amulet"),
        Category("Torch", thing(0xEC), doc="a torch"),
        Category("Beam", RAYS, count=10, doc="beams, by columns"),
        Category("Rope", Bounds((GOLD, 0x0E), ROPES, min_size=(1, 15)), count=4, doc="by room"),
        *(Category(n, r, r.slots, rgb=PART_RGB[n], doc=n) for n, (r, _) in PARTS.items()),
        item("Torch_HUD", carried(shapes=Shape(w=(1, 6), h=(1, 13)))),
        item("Sword_HUD", carried(shapes=Shape(w=6, h=(14, 15), pixels=(30, 44))), count=2),
        item("Key_HUD", carried(shapes=Shape(w=7, h=15)), count=4),
        item("Amulet_HUD", carried(shapes=Shape(w=6, h=(14, 15), pixels=(45, 60)))),
        display("Life", LIVES, doc="one more than the icons"),
        display("Score", POINTS, doc="points"),
    ),
)
