"""Private Eye: a detective in a car that jumps, in the streets and the woods of a city.

Player is the detective, whose lower part is in the car unless he jumps higher. A scene has three
records of objects, each drawn up to three times side by side: slots record * 3 + copy, of the
records that hold the kind. Slots of things that are looked for: in a scene, carried (at the top
right). Badguy and Badguy_Head look out of windows and doors, as Clue does. Passage leads to another
street or into the woods. Shop_Sign stands for all signs but those of Police, Bank and Guns.
Hydrants, curtains, branches, bricks of walls, jail windows, and the maker's name are scenery. A
game begins with 1,000 points; the value of Score is what was won since. Clock's is in seconds.

RAM: ALE's source (score), OCAtari 2.2 (kinds, what the bytes are), and the ROM's code: the steps at
F513 of the second bank are made before the drawing, and what collisions change at F1FF and the
clock's step at F8CE of the first bank after it. The kinds' pictures are listed at F6DF.

Covered: all scenes and signs of all five cases (written to RAM), the end of the game.
Not exact: what a collision has taken or broken is gone from the RAM a frame early. VEM does not see
things in a scene that can be carried, who is about to look out, the car while it flashes, or what
is behind others; its boxes of who lands in the car and of Badguy are of a part, or too wide.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box, choose
from ocjax.console import copies, player_width, spacing
from ocjax.digits import Digits, score_box
from ocjax.game import Game
from ocjax.ops import among, lookup
from ocjax.ram import RamMap, bcd, bits, byte, signed
from ocjax.rom import Pictures, Rom
from ocjax.rules import Blobs, Bounds, Category, display

ROM = Rom("private_eye", "ef3a4f64b6494ba770862768caf04b86")
SECOND = 0x1000  # offset of the second bank
FONT = ROM.font(SECOND | 0xE00, rows=8)

KINDS = 33
ALLEY_KIND, WOODS_KIND, FIRST_ITEM, BADGUY = 6, 5, 20, 28
HEIGHTS = ROM.bytes(0x6DF, KINDS).astype(int) - 1
PLACES = (ROM.bytes(0xCA7, KINDS).astype(int) & 15) << 8 | ROM.bytes(0xC86, KINDS)
MOST_CUT = 16  # rows that a window hides
KIND_ROWS = [
    ROM.rows(int(at), int(n)) if n > 0 else np.zeros(1, int)
    for at, n in zip(PLACES, HEIGHTS, strict=True)
]
# Of each kind, without its lowest 0 to 15 rows.
SIZES = Pictures.of(
    [np.where(np.arange(len(r)) < len(r) - c, r, 0) for r in KIND_ROWS for c in range(MOST_CUT)]
)
EXTENTS = [SIZES.packed >> shift & mask for shift, mask in ((0, 15), (8, 255), (4, 15), (16, 255))]
GROUPS = {
    "Barrier": (1, 18),
    "Mud": (10,),
    "Pottet_Plant": (3,),
    "Brick": (4,),
    "Shatterd_Object": (11, 12, 13),
    "Dove": (14, 15),
    "Lizard": (16, 17),
    "Badguy": (BADGUY,),
    "Badguy_Head": (29,),
    "Clue": (30, 31),
    "Knife": (32,),
}
FIRST, FIRST_TWO, EACH = slice(0, 3), slice(0, 6), slice(0, 9, 3)  # copies of records; one of each
SLOTS = dict.fromkeys(GROUPS, slice(1)) | {
    "Pottet_Plant": FIRST_TWO,
    "Brick": FIRST_TWO,
    "Shatterd_Object": FIRST,
    "Dove": slice(0, 6, 3),
    "Clue": EACH,
}
ITEMS = "Gun", "Button", "Comb", "Shoe_Sole", "Money_Bag", "Vase", "Necklace", "Stamp"
BASE = 182  # row of the counter's 0
FIELD = (8, 28, 160, 183)
SIGNS = {"Police_Sign": (24,), "Bank_Sign": (20,), "Gun_Sign": (16,)}
SHOPS = 17, 18, 19, 21, 22, 23  # kinds of scenes
FALLS = 5, 6  # scenes in which only the first two records are drawn
STARTS = 1000  # points at the beginning
CAR_BASE, EAST, WEST = 0x13, 4, 12
DRIVES, JUMPS, HURT = 0, 8, 12  # first of the detective's pictures that are used then


def _detective() -> Pictures:
    """The extents of the detective's pictures, from the row of the counter's 0x23 down."""
    low, high, colors = (ROM.bytes(SECOND | at, 14) for at in (0xD7F, 0xD8D, 0xD9B))
    out = []
    for a, page, c in zip(low, high, colors, strict=True):
        rows = ROM.bytes((int(page) & 15) << 8 | int(a), 0x24)[::-1].astype(int)
        shown = ROM.bytes(0xA00 | int(c), 0x24)[::-1] != 0
        out.append(np.where(np.cumprod(shown), rows, 0))
    return Pictures.of(out)


DETECTIVE = _detective()


class Ram(RamMap):
    held = byte(5)  # kind that the detective carries
    base = byte(38, 39, 40)  # 182 - bottom row
    kind = byte(41, 42, 43)
    size = bits(44, 45, 46, count=3)  # NUSIZ1
    mirrored = bits(44, 45, 46, first=3)
    x = byte(47, 48, 49)  # x - 15
    cut = byte(50, 51, 52)  # rows that a window hides
    scene = byte(62)
    player_x = byte(63)
    hundredths = bcd(64)
    clock = byte(65)
    idle = byte(70)
    score = bcd((72, 73, 74))
    fraction = byte(68)
    minutes = bcd(67)
    seconds = bcd(69)
    car_jump = byte(84)
    car_row = byte(86)  # 182 - its top row
    depth = byte(88)  # of the way into a passage
    speed = signed(90)
    fine_x = signed(91)  # quarters of a column; less than zero to the left
    hurt = byte(95)
    jump = byte(97)


def decode(m: Ram) -> dict[str, Box]:
    there = m.idle < 128
    boxes = {"Player": _player(m), "Car": _car(m)}
    objects, kinds = _objects(m), jnp.repeat(m.kind, 3)
    for name, group in GROUPS.items():
        slots = SLOTS[name]
        boxes[name] = objects[slots].where(among(kinds[slots], group))
    boxes["Badguy"] = _of_kind(m, objects, np.array([BADGUY]))
    way = objects[0]
    to = m.kind[0] == np.array((ALLEY_KIND, WOODS_KIND))
    boxes["Passage"] = box(way.x, way.y, way.w, way.h, way.valid & to)
    boxes |= _items(m, objects)
    for name, scenes in (*SIGNS.items(), ("Shop_Sign", SHOPS)):
        boxes[name] = box(64, 29, 32, 21, among(m.scene, scenes))
    points = m.score - STARTS
    boxes["Score"] = score_box(FONT, m.score, right=106, top=8, digits=6, value=points)
    boxes["Clock"] = _clock(m)
    return {name: b.where(there) for name, b in boxes.items()}


def _picture(kind: jax.Array, cut: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array, jax.Array]:
    return SIZES.extent(MOST_CUT * jnp.clip(kind, 0, KINDS - 1) + jnp.clip(cut, 0, MOST_CUT - 1))


def _objects(m: Ram) -> Box:
    """The records' objects and their copies: record * 3 + copy."""
    left, top, width, height = _picture(m.kind, m.cut)
    zoom = player_width(m.size) >> 3
    left = jnp.where(m.mirrored == 1, 8 - left - width, left)
    x = m.x + 15 + jnp.where(zoom > 1, 1, 0) + zoom * left
    rows = lookup(HEIGHTS, m.kind)
    y = BASE + 1 - m.base - rows + m.cut + top
    drawn = (m.cut < rows) & ~(among(m.scene, FALLS) & (np.arange(3) == 2))
    copy = np.arange(9) % 3
    x, y, w, h, drawn, n, gap = (
        jnp.repeat(v, 3)
        for v in (x, y, zoom * width, height, drawn, copies(m.size), spacing(m.size))
    )
    x = x + copy * gap
    x = jnp.where(x >= 160, x - 160, x)
    return box(x, y, w, h, drawn & (copy < n)).clip(*FIELD)


def _of_kind(m: Ram, objects: Box, kind: np.ndarray) -> Box:
    """The objects of some kinds of which there is one at most."""
    first, second, third = (m.kind[i] == kind for i in range(3))
    here = choose(first, objects[0], choose(second, objects[3], objects[6]))
    return here.where(first | second | third)


def _items(m: Ram, objects: Box) -> dict[str, Box]:
    """What is looked for: in the scene, and carried."""
    kinds = FIRST_ITEM + np.arange(len(ITEMS))
    left, top, width, height = (v[MOST_CUT * kinds] for v in EXTENTS)
    carried = box(140 + left, 45 - HEIGHTS[kinds] + top, width, height, m.held == kinds)
    pairs = [
        jnp.stack([getattr(b, field) for b in (_of_kind(m, objects, kinds), carried)], axis=1)
        for field in ("x", "y", "w", "h", "valid")
    ]
    return {name: box(*(v[i] for v in pairs)) for i, name in enumerate(ITEMS)}


def _facing(m: Ram) -> jax.Array:
    return jnp.where(m.fine_x < 0, WEST, EAST)


def _car(m: Ram) -> Box:
    """The car, from the side, or from behind in a passage."""
    top, left = BASE - m.car_row, m.fine_x < 0
    aside = m.depth == 0
    x = m.player_x - jnp.where(aside, jnp.where(left, 9, 3), 0)
    w = jnp.where(aside, 20, 8)
    return box(x, top, w, jnp.where(aside, 14, 15), orientation=_facing(m)).clip(*FIELD)


def _player(m: Ram) -> Box:
    """The detective, down to the car."""
    jumps = (m.jump > 0) | (m.car_jump > 0)
    lift = jnp.where(jumps, jnp.maximum(m.jump, m.car_row - CAR_BASE), m.car_row - CAR_BASE)
    before = 4 * m.player_x + m.fine_x - jnp.where(m.depth > 0, 0, m.speed >> 1)
    x = jnp.where(m.fine_x < 0, before + 5 >> 2, before >> 2)
    driving = ((m.depth >> 2) ^ x) >> 1 & 7
    look = jnp.where(jumps, JUMPS + (m.clock >> 3 & 3), DRIVES + driving)
    look = jnp.where(m.hurt >= 128, HURT + (m.clock >> 4 & 1), look)
    left, top, width, height = DETECTIVE.extent(look)
    left = jnp.where(m.fine_x < 0, 8 - left - width, left)
    y = BASE - 0x23 - lift + top
    bottom = jnp.minimum(y + height, BASE - m.car_row)
    return box(m.player_x + left, y, width, bottom - y, orientation=_facing(m)).clip(*FIELD)


def _clock(m: Ram) -> Box:
    """The clock before its last step."""
    back = m.hundredths + jnp.where(m.fraction + 0xAB > 0xFF, 2, 1)
    time = 60 * m.minutes + m.seconds + jnp.where(back >= 100, 1, 0)
    minutes = time // 60
    seconds = time - 60 * minutes
    left = score_box(FONT, minutes, right=74, top=19, digits=2)
    right = score_box(FONT, seconds, right=98, top=19, digits=2, leading_zeros=True)
    return box(left.x, 19, right.x + right.w - left.x, 8, value=time)


facing = functools.partial(Category, attributes=("orientation",))
LOW, UPPER = (8, 140, 160, 183), (8, 50, 160, 70)  # the street, the upper windows
HOUSE = (8, 50, 160, 183)
BRICKS_AT = {  # columns of the bricks of walls, by row
    71: (36, 56, 100, 120),
    77: (32, 52, 68, 88, 104, 124),
    83: (20, 56, 72, 84, 100, 136),
    107: (24, 60, 68, 88, 96, 132),
    113: (28, 56, 64, 92, 100, 128),
    119: (24, 60, 96, 132),
}
WALL = tuple((x, y, x + 4, y + 4) for y, columns in BRICKS_AT.items() for x in columns)
SKIN = (0x46, 0x4A, 0x16, 0x1A, 0x1E, 0x82)
figure = functools.partial(Blobs, first=(0, 0x82), above="Car")
DETECTIVES = figure((0, *SKIN), (8, 48, 160, 163), gap=(0, 1), min_size=(7, 9), max_size=(22, 40))
CARS = Blobs(0, (8, 110, 160, 183), gap=(1, 1), min_size=(8, 8), max_size=(28, 17))
ALLEY, WOODS = (0x06, 0x0A, 0x86), (0x14,)
PASSAGES = Bounds((ALLEY, WOODS), ((64, 140, 96, 172), (64, 167, 96, 172)), (30, 5))
BARRIERS = Blobs((0, 0x1E), LOW, min_size=(5, 17), max_size=(8, 18))
MUDS = Bounds(0, (8, 174, 160, 181), min_size=(8, 4), exclude=("Car", "Shatterd_Object"))
PLANTS = Blobs((0x32, 0xD6, 0x1A), HOUSE, gap=(1, 1), min_size=(5, 2), max_size=(6, 16))
BRICKS = Blobs(0x44, (14, 50, 156, 183), min_size=(4, 4), max_size=(4, 4), ignore=WALL)
PIECES = Blobs(0, (8, 174, 160, 181), min_size=(6, 3), max_size=(8, 4), area=(6, 11))
DOVES = Blobs(0x0E, (8, 56, 160, 150), min_size=(8, 5), max_size=(8, 6))
LIZARDS = Bounds(0x1A, (8, 173, 160, 183), min_size=(7, 4))
JAIL = tuple((x, 50, x + 8, 70) for x in (44, 76, 108))
GUYS = Bounds(0x80, HOUSE, (4, 2), ignore=JAIL)
HEADS = Blobs((0, 0x82), (8, 150, 160, 168), min_size=(6, 5), max_size=(8, 14), first=0x82)
CLUES = Blobs((0x0E, 0x82, 0), UPPER, gap=(0, 2), min_size=(3, 6), max_size=(8, 14), first=0x0E)
KNIVES = Blobs(0, (8, 155, 160, 169), min_size=(8, 4), max_size=(8, 4))
RULES = BARRIERS, MUDS, PLANTS, BRICKS, PIECES, DOVES, LIZARDS, GUYS, HEADS, CLUES, KNIVES
sign = functools.partial(Bounds, regions=(64, 29, 96, 50), min_size=(30, 20))
DIGITS = Digits(FONT, range(58, 106, 8), 8, base=-STARTS)
POINTS = Bounds(0x0E, (58, 8, 106, 16), value=DIGITS)
CARRIED, NOWHERE = (138, 28, 150, 46), (0, 0, 1, 1)
LARGER = {"Gun": ("Comb", "Shoe_Sole"), "Button": ("Necklace",)}  # things of the same colours


def _carried(name: str) -> Blobs | Bounds:
    """A whole picture; in a scene, it is not looked for."""
    kind = FIRST_ITEM + ITEMS.index(name)
    rows = KIND_ROWS[kind]
    at = int(PLACES[kind]) + int(ROM.bytes(0xCC8 + kind, 1)[0])
    shades = tuple(sorted({int(c) & 0xFE for c in ROM.bytes(at, len(rows))[::-1][rows > 0]}))
    size = int(EXTENTS[2][MOST_CUT * kind]), int(EXTENTS[3][MOST_CUT * kind])
    if any(name in larger for larger in LARGER.values()):
        return Blobs(shades, CARRIED, gap=(2, 2), min_size=size, max_size=size)
    return Bounds(shades, (NOWHERE, CARRIED), size, exclude=LARGER.get(name, ()))


GAME = Game(
    name="PrivateEye",
    rom=ROM.name,
    md5=ROM.md5,
    ram=Ram,
    decode=decode,
    categories=(
        facing("Player", DETECTIVES, doc="the detective"),
        facing("Car", CARS, doc="the detective's car"),
        Category("Passage", PASSAGES, count=2, doc="to an alley, into the woods"),
        *(
            Category(name, rule, count=len(range(9)[SLOTS[name]]), doc="record * 3 + copy")
            for name, rule in zip(GROUPS, RULES, strict=True)
        ),
        *(Category(name, _carried(name), count=2, doc="in a scene, carried") for name in ITEMS),
        Category("Police_Sign", sign(0), doc="at the police station"),
        Category("Bank_Sign", sign(0xD4), doc="at the bank"),
        Category("Gun_Sign", sign(0x8E), doc="at the gun shop"),
        Category("Shop_Sign", sign((0x30, 0x48, 0x5E, 0x4E, 0x56, 0x0E)), doc="at other shops"),
        display("Score", POINTS, doc="points that were won"),
        display("Clock", Bounds(0x0E, (58, 19, 98, 27)), doc="seconds that are left"),
    ),
)
