"""Private Eye: a detective in a car that jumps, in the streets and the woods of a city.

Picture: docs/games/PrivateEye.png

Screen: Badguy and Badguy_Head look out of windows and doors, as Clue does. Passage leads to another
street or into the woods. Shop_Sign is any sign except Police, Bank and Guns. Hydrants, curtains,
branches, bricks and jail windows are scenery. Player is the detective, whose lower part is in the
car unless he jumps higher. Score counts from 1,000 points.

Slots: a scene has three records of objects, each drawn up to three times side by side. The slots
are record * 3 + copy, for the records that may hold the kind. Items to be found have two slots: in
a scene, carried (at the top right).

RAM: ALE's source (score), OCAtari 2.2 (kinds, meaning of the bytes), and the ROM's code. The steps
at F513 of the second bank come before the drawing. Effects of collisions at F1FF, such as a
barrier's push at F38A, and the clock's step at F8CE of the first bank, come after it. F6DF lists
the kinds' pictures. The pointers that F693 sets up give the detective's drawn picture and height.

Covered: all scenes and signs of all five cases (written to RAM), the end of the game.

Not exact: an object that a collision has taken or broken is gone from the RAM a frame early.

VEM: it misses items in a scene, the car while it flashes, mud that the car touches, and objects
behind others. It misses bricks that touch the detective, and takes a curtain or a plant that
touches him for a part of him.
"""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    NUSIZ_WIDTH,
    WEST,
    Area,
    Bitmap,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Context,
    Detected,
    Digits,
    Game,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Shape,
    Step,
    Tight,
    Variants,
    among,
    bcd,
    bits,
    box,
    boxes,
    byte,
    choose,
    color_mask,
    copies,
    display,
    div,
    flag,
    lookup,
    mod,
    pick,
    shift_down,
    shift_up,
    signed,
    spacing,
    spread,
    when,
)

ROM = Rom("private_eye", "ef3a4f64b6494ba770862768caf04b86")
SECOND = 0x1000  # offset of the second bank
FONT = ROM.font(SECOND | 0xE00, rows=8)

SCORE = NumberDisplay(FONT, right=106, top=8, digits=6)
MINUTES = NumberDisplay(FONT, right=74, top=19, digits=2)
SECONDS = NumberDisplay(FONT, right=98, top=19, digits=2, leading_zeros=True)


class Kind:  # of `Ram.kind` and `Ram.held`
    BARRIERS = (1, 18)
    PLANT = 3
    BRICK = 4
    WOODS = 5  # the way there
    ALLEY = 6  # the way there
    MUD = 10
    BROKEN = (11, 12, 13)
    DOVES = (14, 15)
    LIZARDS = (16, 17)
    FIRST_ITEM = 20
    BADGUY = 28
    BADGUY_HEAD = 29
    CLUES = (30, 31)
    KNIFE = 32
    COUNT = 33


HEIGHTS = ROM.bytes(0x6DF, Kind.COUNT).astype(int) - 1
PLACES = (ROM.bytes(0xCA7, Kind.COUNT).astype(int) & 15) << 8 | ROM.bytes(0xC86, Kind.COUNT)
MOST_CUT = 16  # most rows that a window hides
KIND_ROWS = [
    ROM.rows(int(at), int(n)) if n > 0 else np.zeros(1, int)
    for at, n in zip(PLACES, HEIGHTS, strict=True)
]
# Each kind's picture without its lowest 0 to 15 rows.
SIZES = Pictures.of(
    [np.where(np.arange(len(r)) < len(r) - c, r, 0) for r in KIND_ROWS for c in range(MOST_CUT)],
    kind=len(KIND_ROWS),
    cut=MOST_CUT,
)
EXTENTS = [SIZES.packed >> shift & mask for shift, mask in ((0, 15), (8, 255), (4, 15), (16, 255))]
GROUPS = {
    "Barrier": Kind.BARRIERS,
    "Mud": (Kind.MUD,),
    "Pottet_Plant": (Kind.PLANT,),
    "Brick": (Kind.BRICK,),
    "Shatterd_Object": Kind.BROKEN,
    "Dove": Kind.DOVES,
    "Lizard": Kind.LIZARDS,
    "Badguy": (Kind.BADGUY,),
    "Badguy_Head": (Kind.BADGUY_HEAD,),
    "Clue": Kind.CLUES,
    "Knife": (Kind.KNIFE,),
}
FIRST_RECORD = slice(0, 3)  # all copies of the first record
FIRST_TWO = slice(0, 6)  # all copies of two records
SINGLES = slice(0, 9, 3)  # the first copies of all records
SLOTS = dict.fromkeys(GROUPS, slice(1)) | {
    "Pottet_Plant": FIRST_TWO,
    "Brick": FIRST_TWO,
    "Shatterd_Object": FIRST_RECORD,
    "Dove": slice(0, 6, 3),
    "Clue": SINGLES,
}
ITEMS = ("Gun", "Button", "Comb", "Shoe_Sole", "Money_Bag", "Vase", "Necklace", "Stamp")
BASE = 182  # row of the counter's 0
FIELD = (8, 28, 160, 183)
SIGNS = {  # by `scene`
    "Police_Sign": (24,),
    "Bank_Sign": (20,),
    "Gun_Sign": (16,),
    "Shop_Sign": (17, 18, 19, 21, 22, 23),
}
FALLS = (5, 6)  # scenes that draw only the first two records
UNTOUCHED = 255  # `touched` without a collision; a loop counts it down at F1D9
PUSH = 2  # columns that a barrier pushes the player away in each frame
OVER = 128  # least `idle` with a blank screen
STARTS = 1000  # points at the beginning
CAR_BASE = 19  # least `car_row` of a car that is not down on its wheels
CAR_END = 177  # row below the lowest one of the car
TICK = 171  # added to `fraction` in each step; a carry makes the step two hundredths, not one
LOOKS = np.array((0, 3, 4, 8, 9, 12, 13))  # the other seven of 14 are parts of these
LOW_BYTES, PAGES, COLORS = ROM.bytes(SECOND | 0xD7F, 3 * 14).reshape(3, 14)[:, LOOKS].astype(int)
LOOK_KEYS = (LOW_BYTES - COLORS & 255).tolist()  # identify the looks
HIGHEST = 200  # most rows of lift; higher bytes are negative
ROWS = 36  # rows of the detective's picture


def _detective_pictures() -> Pictures:
    """The extents of each look's first 0 to 36 rows; the rows count down from 35."""
    out = []
    for low, page, color in zip(LOW_BYTES, PAGES, COLORS, strict=True):
        shown = np.cumprod(ROM.bytes(0xA00 | int(color), ROWS)[::-1] != 0)
        dots = shown * ROM.bytes(int(page & 15) << 8 | int(low), ROWS)[::-1]
        out.extend(dots * (np.arange(ROWS) < n) for n in range(ROWS + 1))
    return Pictures.of(out)


DETECTIVE = _detective_pictures()


class Ram(RamMap):
    pointers = byte(18, 20)  # to the detective's picture and colours, minus the rows of lift
    held = byte(5)  # kind that the detective carries
    touched = byte(36)  # 255, or a byte number of the case's facts after a collision at F1FF
    base = byte(38, 39, 40)  # 182 - bottom row
    kind = byte(41, 42, 43)
    size = bits(44, 45, 46, count=3)  # NUSIZ1
    mirrored = flag(44, 45, 46, bit=3)
    x = byte(47, 48, 49)  # x - 15
    cut = byte(50, 51, 52)  # rows that a window hides
    scene = byte(62)
    player_x = byte(63)
    hundredths = bcd(64)
    idle = byte(70)
    score = bcd((72, 73, 74))
    fraction = byte(68)
    minutes = bcd(67)
    seconds = bcd(69)
    car_row = byte(86)  # 182 - its top row
    depth = byte(88)  # of the way into a passage
    fine_x = signed(91)  # quarters of a column; negative to the left
    ahead = signed(119)  # columns from the player to the first record, when he was last down


def decode(m: Ram) -> dict[str, Box]:
    objects = _object_boxes(m)
    player_x = as_drawn(m, objects[0])
    by_name = {
        "Player": _player(m, player_x),
        "Car": _car(m, player_x),
        **_grouped(m, objects),
        "Badguy": _of_kind(m, objects, np.array([Kind.BADGUY])),
        "Passage": _passage_boxes(m, objects[0]),
        **_item_boxes(m, objects),
        **{name: box(64, 29, 32, 21, among(m.scene, at)) for name, at in SIGNS.items()},
        "Score": SCORE.box(m.score, value=m.score - STARTS),
        "Clock": _clock_box(m),
    }
    return {name: b.where(m.idle < OVER) for name, b in by_name.items()}


def as_drawn(m: Ram, first: Box) -> jax.Array:
    """The player's column before a barrier, the first record, pushed him."""
    back = m.player_x - jnp.where(m.ahead < 0, PUSH, -PUSH)
    meets = (m.touched != UNTOUCHED) & among(m.kind[0], Kind.BARRIERS)
    return jnp.where(meets & _overlap(_car(m, back), first), back, m.player_x)


def _overlap(a: Box, b: Box) -> jax.Array:
    across = (a.x < b.x + b.w) & (b.x < a.x + a.w)
    return across & (a.y < b.y + b.h) & (b.y < a.y + a.h)


def _grouped(m: Ram, objects: Box) -> dict[str, Box]:
    kinds = jnp.repeat(m.kind, 3)
    chosen = {name: SLOTS[name] for name in GROUPS}
    return {name: objects[at].where(among(kinds[at], GROUPS[name])) for name, at in chosen.items()}


def _passage_boxes(m: Ram, first: Box) -> Box:
    """The ways to an alley and into the woods, from the first record."""
    leads = m.kind[0] == np.array((Kind.ALLEY, Kind.WOODS))
    return box(first.x, first.y, first.w, first.h, first.valid & leads)


def _object_boxes(m: Ram) -> Box:
    """The records' objects and their copies: record * 3 + copy."""
    kind = jnp.clip(m.kind, 0, Kind.COUNT - 1)
    cut = jnp.clip(m.cut, 0, MOST_CUT - 1)
    picture = SIZES.index(kind=kind, cut=cut)
    left, top, width, height = SIZES.extent(picture, mirrored=m.mirrored)
    zoom = pick(m.size, NUSIZ_WIDTH) >> 3
    x = m.x + 15 + when(zoom > 1, 1) + zoom * left
    full_height = lookup(HEIGHTS, m.kind)
    y = BASE + 1 - m.base - full_height + m.cut + top
    drawn = (m.cut < full_height) & ~(among(m.scene, FALLS) & (np.arange(3) == 2))
    return _copied(m, box(x, y, zoom * width, height, drawn)).clip(*FIELD)


def _copied(m: Ram, records: Box) -> Box:
    """The copies of the records' objects."""
    whole = jax.tree.map(lambda v: jnp.repeat(v, 3) if v.ndim else v, records)
    number = jnp.repeat(copies(m.size), 3)
    gap = jnp.repeat(spacing(m.size), 3)
    copy = np.arange(9) % 3
    unwrapped = whole.x + copy * gap
    x = jnp.where(unwrapped >= 160, unwrapped - 160, unwrapped)
    return dataclasses.replace(whole, x=x).where(copy < number)


def _of_kind(m: Ram, objects: Box, kind: np.ndarray) -> Box:
    """The objects of kinds that appear at most once."""
    in_first = m.kind[0] == kind
    in_second = m.kind[1] == kind
    in_third = m.kind[2] == kind
    here = choose(in_first, objects[0], choose(in_second, objects[3], objects[6]))
    return here.where(in_first | in_second | in_third)


def _item_boxes(m: Ram, objects: Box) -> dict[str, Box]:
    """Items: in the scene, and carried."""
    kinds = Kind.FIRST_ITEM + np.arange(len(ITEMS))
    left, top, width, height = np.array(EXTENTS)[:, MOST_CUT * kinds]
    carried = box(140 + left, 45 - HEIGHTS[kinds] + top, width, height, m.held == kinds)
    both = zip(_box_fields(_of_kind(m, objects, kinds)), _box_fields(carried), strict=True)
    pairs = [jnp.stack(values, axis=1) for values in both]
    return {name: box(*(values[i] for values in pairs)) for i, name in enumerate(ITEMS)}


def _box_fields(b: Box) -> tuple[jax.Array, ...]:
    return b.x, b.y, b.w, b.h, b.valid


def _facing(m: Ram) -> jax.Array:
    return jnp.where(m.fine_x < 0, WEST, EAST)


def _car(m: Ram, player_x: jax.Array) -> Box:
    """The car, from the side, or from behind in a passage; it goes down on its wheels when hit."""
    top = BASE - m.car_row
    left = m.fine_x < 0
    aside = m.depth == 0
    down = when(m.car_row < CAR_BASE, 1)
    x = player_x - when(aside, jnp.where(left, 9, 3) + down)
    width = jnp.where(aside, 20 + 2 * down, 8)
    bottom = jnp.minimum(top + jnp.where(aside, 14, 15), CAR_END)
    return box(x, top, width, bottom - top, orientation=_facing(m)).clip(*FIELD)


def _player(m: Ram, player_x: jax.Array) -> Box:
    """The detective, down to the car."""
    apart = m.pointers[0] - m.pointers[1] & 255
    look = sum((when(apart == a, i) for i, a in enumerate(LOOK_KEYS)), jnp.zeros_like(apart))
    lift_byte = pick(look, LOW_BYTES.tolist()) - m.pointers[0] & 255
    lift = jnp.where(lift_byte > HIGHEST, lift_byte - 256, lift_byte)
    above = jnp.clip(ROWS - 1 + lift - m.car_row, 0, ROWS)  # rows that the car does not cover
    y = BASE + 1 - ROWS - lift
    at = (ROWS + 1) * look + above
    drawn = DETECTIVE.box(at, player_x, y, mirrored=m.fine_x < 0, orientation=_facing(m))
    return drawn.clip(*FIELD)


def _clock_box(m: Ram) -> Box:
    """The clock before its last step."""
    back = m.hundredths + jnp.where(m.fraction + TICK > 255, 2, 1)
    time = 60 * m.minutes + m.seconds + when(back >= 100, 1)
    minute_box = MINUTES.box(div(time, 60))
    second_box = SECONDS.box(mod(time, 60))
    right = second_box.x + second_box.w
    return box(minute_box.x, minute_box.y, right - minute_box.x, FONT.height, value=time)


facing_category = functools.partial(Category, attributes=("orientation",))
WHITE = 14
LOW_AREA = (8, 140, 160, 183)
UPPER = (8, 50, 160, 70)
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


class AboveCar(Step):
    """End boxes above a car that begins inside them: drivers share a colour with their car."""

    @property
    def other(self) -> str:
        """The category that the step reads."""
        return "Car"

    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step."""
        lower = context.found["Car"]
        across = (lower.x < found.x + found.w) & (found.x < lower.x + lower.w)
        above = lower.y - found.y
        inside = lower.valid & across & (above > 0) & (above < found.h)
        height = jnp.where(inside, above, found.h)
        return found._replace(box=boxes(found.x, found.y, found.w, height, found.valid))


class OffDetective(Step):
    """Drop bricks at the detective: a part of a house's brick looks like a thrown one."""

    @property
    def other(self) -> str:
        """The category that the step reads."""
        return "Player"

    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step."""
        figures = context.found["Player"]
        across = (figures.x <= found.x + found.w) & (found.x <= figures.x + figures.w)
        beside = (figures.y <= found.y + found.h) & (found.y <= figures.y + figures.h)
        return found.where(~(figures.valid & across & beside))


FIGURE_COLORS = (0, 70, 74, 22, 26, 30, 130)
figure = functools.partial(Blobs, FIGURE_COLORS, gap=(0, 1), then=(AboveCar(), Tight()))
DETECTIVES = figure((8, 50, 160, 165), shapes=Shape(w=(7, 22), h=(7, 40)), first=(0, 30, 130))
BARRIER_COLOR = 30


def _outside_barriers(mask: Bitmap, planes: jax.Array) -> Bitmap:
    """Drop the black rows of barriers, which lie between rows of another colour."""
    row = color_mask(planes, (BARRIER_COLOR,))
    return mask & ~spread(shift_up(row, 1) | shift_down(row, 1))


CARS = Blobs(
    0,
    (8, 110, 160, 183),
    Shape(w=(8, 28), h=(8, 17)),
    gap=(1, 1),
    filters=(_outside_barriers,),
)
ALLEY = (6, 10, 134)
WOODS = (20,)
PASSAGES = Bounds((ALLEY, WOODS), ((64, 140, 96, 172), (64, 167, 96, 172)), (30, 5))
ON_GROUND = (8, 172, 160, 181)
BARRIERS = Blobs(BARRIER_COLOR, LOW_AREA, Shape(w=(5, 8), h=(17, 18)), gap=(0, 2))
MUDS = Blobs(0, ON_GROUND, Shape(w=8, h=4, pixels=22))
PLANTS = Blobs((26, 50, 214), HOUSE, Shape(w=(5, 6), h=(2, 16)), gap=(1, 1))
BRICKS = Blobs(68, (14, 50, 160, 183), Shape(w=4, h=4), ignore=WALL, then=(OffDetective(),))
PIECE_SHAPES = (
    Shape(w=8, h=4, pixels=36),
    Shape(w=8, h=4, pixels=33),
    Shape(w=6, h=3, pixels=23),
)
PIECES = Blobs(0, ON_GROUND, PIECE_SHAPES, gap=(3, 0))
DOVES = Blobs(14, (8, 56, 160, 150), Shape(w=8, h=(5, 6)))
LIZARDS = Bounds(26, (8, 173, 160, 183), min_size=(7, 4))


def _who(hues: tuple[int, ...], regions: tuple[Area, Area], most: int) -> Blobs:
    """A figure that looks out: at least four rows in the first region, its hat in the second."""
    tip = Blobs(hues[0], regions[1], (Shape(w=4, h=(2, 3)), Shape(w=3, h=1)), gap=(1, 0))
    whole = Shape(w=8, h=(4, most))
    return Blobs(hues, regions[0], whole, first=hues[0], ignore=JAIL, also=(tip,))


JAIL = tuple((x, 50, x + 8, 70) for x in (44, 76, 108))
GUYS = _who((30, 0, 14, 128), ((8, 50, 160, 160), (8, 50, 160, 68)), 14)
HEADS = _who((130, 0), ((8, 158, 160, 167), (8, 158, 160, 167)), 6)
CLUES = Blobs((14, 130, 0), UPPER, Shape(w=(3, 8), h=(6, 14)), gap=(0, 2), first=14)
KNIVES = Blobs(0, (8, 155, 160, 183), Shape(w=8, h=4, pixels=16))
RULES = {
    "Barrier": BARRIERS,
    "Mud": MUDS,
    "Pottet_Plant": PLANTS,
    "Brick": BRICKS,
    "Shatterd_Object": PIECES,
    "Dove": DOVES,
    "Lizard": LIZARDS,
    "Badguy": GUYS,
    "Badguy_Head": HEADS,
    "Clue": CLUES,
    "Knife": KNIVES,
}
DRAWN_COLORS = {"Barrier": (BARRIER_COLOR, 0)}
sign = functools.partial(Bounds, regions=(64, 29, 96, 50), min_size=(30, 20))
CLOCK_LEFTS = (*MINUTES.lefts, *SECONDS.lefts)
CLOCK = Bounds(WHITE, (58, 19, 98, 27), value=Digits(FONT, CLOCK_LEFTS, 19, (600, 60, 10, 1)))
CARRIED_AREA = (138, 28, 150, 46)
NOWHERE = (0, 0, 1, 1)
LARGER = {"Gun": ("Comb", "Shoe_Sole"), "Button": ("Necklace",)}  # items with the same colours


def _item_rule(name: str) -> Blobs | Bounds:
    """A complete picture; VEM does not search for it in a scene."""
    kind = Kind.FIRST_ITEM + ITEMS.index(name)
    dots = KIND_ROWS[kind]
    at = int(PLACES[kind]) + int(ROM.bytes(0xCC8 + kind, 1)[0])
    shades = tuple(sorted({int(c) & 0xFE for c in ROM.bytes(at, len(dots))[::-1][dots > 0]}))
    size = int(EXTENTS[2][MOST_CUT * kind]), int(EXTENTS[3][MOST_CUT * kind])
    if any(name in names for names in LARGER.values()):
        return Blobs(shades, CARRIED_AREA, Shape(w=size[0], h=size[1]), gap=(2, 2))
    return Bounds(shades, (NOWHERE, CARRIED_AREA), size, exclude=LARGER.get(name, ()))


GAME = Game(
    name="PrivateEye",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        agreement={"modes": 0.95},  # VEM misses mud and covered objects
        rare=(
            "Badguy",
            "Badguy_Head",
            "Barrier",
            "Brick",
            "Dove",
            "Gun",
            "Knife",
            "Lizard",
            "Money_Bag",
            "Necklace",
            "Pottet_Plant",
            "Shatterd_Object",
            "Shoe_Sole",
            "Stamp",
        ),
    ),
    variants=Variants(
        modes={
            0: "a case of 3 minutes",
            1: "a case of 2 minutes",
            2: "a case of 4 minutes",
            3: "a case of 10 minutes",
            4: "a case of 20 minutes",
        },
        source="play of all modes in the emulator",
    ),
    categories=(
        facing_category(
            "Player", DETECTIVES, rgb=(228, 111, 111), role="player", doc="the detective"
        ),
        facing_category("Car", CARS, doc="the detective's car"),
        Category(
            "Passage",
            PASSAGES,
            count=2,
            rgb=((66, 72, 200), (134, 134, 29)),
            colors=((*ALLEY, 98, 116), WOODS),
            doc="to an alley, into the woods",
        ),
        *(
            Category(
                name,
                rule,
                count=len(range(9)[SLOTS[name]]),
                colors=DRAWN_COLORS.get(name),
                doc="record * 3 + copy",
            )
            for name, rule in RULES.items()
        ),
        *(Category(name, _item_rule(name), count=2, doc="in a scene, carried") for name in ITEMS),
        Category("Police_Sign", sign(0), colors=(0, WHITE), doc="at the police station"),
        Category("Bank_Sign", sign(212), doc="at the bank"),
        Category("Gun_Sign", sign(142), doc="at the gun shop"),
        Category("Shop_Sign", sign((48, 72, 94, 78, 86, 14)), doc="at other shops"),
        display("Score", SCORE.rule(WHITE, base=-STARTS), role="score", doc="points that were won"),
        display("Clock", CLOCK, role="time", doc="seconds that are left"),
    ),
)
