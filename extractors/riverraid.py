"""River Raid: a jet flies up a river past ships, helicopters, jets, fuel depots and bridges.

Picture: docs/games/Riverraid.png

Screen: the eight columns at the left edge are blank. Explosions, banks, roads and the gauge's frame
are scenery. Fuel is the needle of the gauge; its value is the needle's position, in steps of eight
units of fuel. Lives shows one less than the emulator counts. It shows nothing with the last life,
and at first.

Slots: the river comes down in six blocks of 32 rows. Each block has a record with at most one
object: a house with its tree on the bank, a fuel depot, a bridge, a tanker, a helicopter or a jet.
The records move on by one when a new block comes, so a slot is a record's index in a ring of eight.

RAM: OCAtari, AtariARI and T. Jentzsch's disassembly (meaning of the bytes), ALE's source (score,
lives), and the ROM's code: f027-f3ff draws. f85d-fa8c moves the river before the drawing. f489-f75b
moves everything else after it; `decode` undoes that. If an object was hit after the frame was
drawn, the stack still has its points, and the remaining time of its sound gives the missile's row.

Covered: levels 1 to 9, moving objects, both difficulties (the missile follows the jet, or flies
straight), deaths, the new start, game over.

Not exact: a missile that hits something 15 frames or more after it was fired; a carry in the points
of a hit (REM assumes a depot then); the display of the score on the frame of a hit; the rows of a
jet that the left edge cuts.

VEM: it misses one or two rows of a missile, roof or tree at an edge.
"""

import dataclasses
import functools
from collections import Counter

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    WEST,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    Gauge,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Saver,
    Shape,
    Variants,
    Word,
    among,
    bits,
    box,
    byte,
    display,
    div,
    flag,
    high,
    low,
    match,
    pick,
    position,
    when,
)

ROM = Rom("riverraid", "393948436d1f4cc3192410bb918f9724")
FONT = ROM.font(0xB00, rows=8)

VIEW = (8, 2, 160, 163)
MISSILE_VIEW = (8, 2, 160, 145)
MIDDLE = 80  # a row of the view


class Kind:  # of `Ram.kind`
    HIT = 1  # by the missile on this frame
    RAMMED = 2  # by the player on this frame
    JET = 4
    HELICOPTER = 5
    TURNED_ROTOR = 6
    TANKER = 7
    BRIDGE = 8
    HOUSE = 9
    DEPOT = 10


HELICOPTERS = (Kind.HELICOPTER, Kind.TURNED_ROTOR)
KIND_ZOOMS = (1, 1, 1, 2, 4, 2, 1)  # pixels of a dot by kind, starting at the jet


class Points:  # of `Ram.points`
    BRIDGE = 0x28
    HELICOPTER = 0x30  # others, except `NONE`: a depot
    NONE = 0xF3


class Mode:  # of `Ram.mode`
    FLIES = 0
    WAITS = 0x30  # before the first move of a life
    CRASH = 0xDF  # the frame of a crash


class Look:  # of `Ram.look`
    STRAIGHT = 0xBB
    TURNED = 0xCD


OFF = 180  # `missile_y` while no missile flies
FIRED = 13  # `missile_y` on the frame of the shot
SPEED = 6  # of a missile, rows per frame
SOUNDS = range(1, 14)  # values of `sound` that give the row of a missile
MOVES = 0x40  # bit of `block`: its object moves on alternate frames
FLIPPED = 0x10  # bit of `block`: its object looks the other way
STICK_RIGHT = 4  # bits of a joystick, 1 if not pressed
STICK_LEFT = 8
HORIZONTAL = STICK_LEFT | STICK_RIGHT
FULL = 255  # `fuel`
START_PART = 0xDF  # `fuel_part` when a life starts
USED_PART = 0xE0  # least `fuel_part` just after 1 / 8 was used
START_OFFSET = 30  # `offset` when a life starts
MOVING_LEVEL = 2  # first `level` with moving objects
NO_DIGIT = 80  # least `icon` of empty pictures
BLANK = 88  # least `digits` of empty pictures
WATER = 132
PLAYER = 28
NEEDLE = 30
BLACK = 0
WHITE = 12
TREE = 218
TRUNK = 16
RED = 72
KIND_COLORS = {  # of most of their dots
    Kind.JET: 156,
    Kind.HELICOPTER: 176,
    Kind.TANKER: 50,
    Kind.HOUSE: WHITE,
    Kind.DEPOT: WHITE,
}
HOUSE_ROW = -13  # row with a house's colour
SCORE = NumberDisplay(FONT, right=104, top=165, digits=6)
LIVES = NumberDisplay(FONT, right=64, top=192, digits=1)
NEEDLE_X = 68  # of the needle without fuel
FUEL_STEP = 8  # fuel per column
RING = 8
RECORDS = 6
PICTURE_ROWS = 24
HIDDEN = -21  # `y` of the highest block while it is not drawn yet


def _rows_of(kind: int) -> np.ndarray:
    """Rows of a picture, alternately from two tables, without rows in the water's colour."""
    even = int(ROM.data[0xBBB + kind])
    odd = int(ROM.data[0xFC8 + kind])
    colors = int(ROM.data[0xF23 + kind])
    dots = np.stack([ROM.bytes(0xE00 + start, 13) for start in (even, odd)], axis=1)
    is_water = ROM.bytes(0xF00 + colors, 13) == WATER
    return np.where(is_water[:, None], 0, dots)[:0:-1].reshape(PICTURE_ROWS)


def _seen(kind: int, usual: int) -> list[int]:
    """Colours of a picture's visible part at the view's lower end, then at its upper end.

    By the number of visible rows: the usual colour if it is visible, otherwise the colour of most
    dots. For a house, only the row that VEM reads the colour from counts.
    """
    rows = _rows_of(kind)
    start = int(ROM.data[0xF23 + kind])
    colors = np.repeat(ROM.bytes(0xF00 + start, 13)[:0:-1], 2)
    first, last = np.flatnonzero(rows)[[0, -1]]
    dots = [
        Counter({color: row.bit_count()})
        for color, row in zip(colors.tolist(), rows.tolist(), strict=True)
    ]
    left = range(PICTURE_ROWS + 1)
    upper = [dots[first : first + h] for h in left]
    lower = [dots[max(last + 1 - h, 0) : last + 1] for h in left]
    counts = [sum(_rows_that_count(kind, part), Counter()) for part in (*upper, *lower)]
    return [usual if c[usual] or not c else max(c, key=c.__getitem__) for c in counts]


def _rows_that_count(kind: int, rows: list[Counter]) -> list[Counter]:
    """All rows of a part of a picture, or the single row of a house."""
    return rows[max(len(rows) + HOUSE_ROW, 0) :][:1] if kind == Kind.HOUSE else rows


def _cut(rows: np.ndarray, beyond: int) -> np.ndarray:
    """The rows on the screen, with `beyond` rows below the view, or above it if negative."""
    at = np.arange(PICTURE_ROWS)
    return np.where((at >= -beyond) & (at < PICTURE_ROWS - beyond), rows, 0)


CUTS = range(1 - PICTURE_ROWS, PICTURE_ROWS)
KINDS = range(Kind.JET, Kind.DEPOT + 1)
OBJECT_PICTURES = Pictures.of(
    [_cut(_rows_of(kind), cut) for kind in KINDS for cut in CUTS], kind=len(KINDS), cut=len(CUTS)
)
PLAYERS = ROM.pictures([0xC01 + look for look in (Look.STRAIGHT, Look.TURNED)], 18)

SAVER_MASK = 0xF7  # the screen saver drops a bit of colours


class Ram(RamMap):
    saver_key = byte(5)  # XORed with colours
    saver_mask = byte(6)  # mask of colours: 0xFF in play
    clock = flag(2, bit=0)  # helicopters and tankers move when it is 0
    sticks = high(4)  # joystick of the drawn frame
    stick = low(4)
    thrust = byte(7)  # steps of 1 / 256 pixel per frame
    offset = byte(11)  # rows that the lowest block has come down
    block = byte(14, 15, 16, 17, 18, 19)  # lowest block first
    coarse = byte(20, 21, 22, 23, 24, 25)  # 15 pixels
    fine = high(26, 27, 28, 29, 30, 31)
    leftward = bits(26, 27, 28, 29, 30, 31, first=3)
    wide = flag(26, 27, 28, 29, 30, 31, bit=0)
    kind = byte(32, 33, 34, 35, 36, 37)
    missile_y = byte(50)
    x = byte(51)
    x_part = byte(52)  # 1 / 256 pixel
    part = byte(54)  # block of a section, counted down from 2
    fuel = byte(55)
    fuel_part = byte(56)
    section = byte(57)  # of a level, counted down from 16
    look = byte(58)
    level = byte(61)
    icon = byte(64)  # lives: 8 times the visible digit, or an empty picture
    mode = byte(70)
    digits = byte(77, 79, 81, 83, 85)  # 8 times a digit, or an empty picture
    ones = byte(87)
    shot = byte(98)  # record that the missile hit
    shot_bank = flag(102, bit=7)  # 0: the missile hit a bank
    touched = byte(104)  # record that the player touches
    missile_x = byte(117)  # x + 1
    sound = byte(123)  # remaining frames of the missile's sound
    points = byte(127)  # of a hit on this frame: 8 times a digit, 8 after a carry


def decode(m: Ram) -> dict[str, Box]:
    kind, objects = _object_boxes(m)
    player_x = _player_x_before(m)
    return {
        "Player": _player_box(m, player_x),
        "PlayerMissile": _missile_box(m, player_x),
        "Bridge": objects.only(kind == Kind.BRIDGE),
        "FuelDepot": _colored(objects.where(kind == Kind.DEPOT), Kind.DEPOT),
        "Helicopter": _colored(objects.where(among(kind, HELICOPTERS)), Kind.HELICOPTER),
        "House": _colored(objects.where(kind == Kind.HOUSE), Kind.HOUSE),
        "Jet": _colored(objects.where(kind == Kind.JET), Kind.JET),
        "Tanker": _colored(objects.where(kind == Kind.TANKER), Kind.TANKER),
        "Fuel": _needle_box(m),
        "PlayerScore": _score_box(m),
        "Lives": _lives_box(m),
    }


def _drawn_kinds(m: Ram) -> jax.Array:
    """The kinds of the records' objects when the frame was drawn."""
    record = np.arange(RECORDS)
    shot = (m.kind == Kind.HIT) & (m.shot == record)
    rammed = (m.kind == Kind.RAMMED) & (m.touched == record) & (m.mode == Mode.CRASH)
    gone = (shot | rammed) & (m.points != Points.NONE)
    rotor = among(m.kind, HELICOPTERS) & ~m.clock
    return match(
        (gone & m.wide, Kind.TANKER),
        (gone & (m.points == Points.BRIDGE), Kind.BRIDGE),
        (gone & (m.points == Points.HELICOPTER), Kind.HELICOPTER),
        (gone, Kind.DEPOT),
        (rotor, sum(HELICOPTERS) - m.kind),
        otherwise=m.kind,
    )


# An object in one number: separate values cost 1.2 times as much time.
OBJECT_WORD = Word(x=8, y=8, w=6, h=5, left=1, kind=4)


def _object_boxes(m: Ram) -> tuple[jax.Array, Box]:
    """Kinds and boxes of the objects of all blocks, in the ring."""
    kind = _drawn_kinds(m)
    moving = among(m.mode, (Mode.FLIES, Mode.CRASH)) & (m.level >= MOVING_LEVEL)
    alternating = among(kind, range(Kind.HELICOPTER, Kind.BRIDGE)) & ~m.clock
    by_turns = alternating & (m.block & MOVES > 0)
    steps = when(moving & (by_turns | (kind == Kind.JET)), 1)
    at = position(m.coarse, m.fine) + jnp.where(m.leftward == 1, steps, -steps)
    turns = moving & by_turns & (m.block & FLIPPED > 0)
    left = jnp.where(turns, 1 - m.leftward, m.leftward)
    zoom = pick(kind - Kind.JET, KIND_ZOOMS)
    y = 32 * (5 - np.arange(RECORDS)) + m.offset - 23
    there = (kind >= Kind.JET) & (y > HIDDEN)
    rows_off = jnp.clip(y + PICTURE_ROWS - VIEW[3], 0, 23) - jnp.clip(VIEW[1] - y, 0, 23)
    picture = OBJECT_PICTURES.index(kind=kind - Kind.JET, cut=rows_off - CUTS.start)
    x0, y0, w, h = OBJECT_PICTURES.extent(picture, mirrored=left == 1)
    x = at - when(zoom == 1, 1) + zoom * x0
    shown = box(x, y + y0, zoom * w, h, there).clip(*VIEW)
    words = OBJECT_WORD.pack(x=shown.x, y=shown.y, w=shown.w, h=shown.h, left=left, kind=kind)
    found = OBJECT_WORD.unpack(_in_ring(m, when(shown.valid, words)))
    facing = jnp.where(found.left == 1, WEST, EAST)
    return found.kind, box(found.x, found.y, found.w, found.h, orientation=facing)


def _in_ring(m: Ram, of_records: jax.Array) -> jax.Array:
    """The records' numbers in the ring; 0 in unused slots."""
    record = (np.arange(RING) + 2 * m.section + m.part) & (RING - 1)
    return sum((when(record == i, of_records[i]) for i in range(RECORDS)), jnp.int32(0))


def _colored(b: Box, kind: int) -> Box:
    """Objects of a kind with the colours of their visible parts at the ends of the view."""
    index = b.h + when(b.y < MIDDLE, PICTURE_ROWS + 1)
    return dataclasses.replace(b, color=pick(index, _seen(kind, KIND_COLORS[kind])))


def _player_x_before(m: Ram) -> jax.Array:
    """The player's position before the last move."""
    pressed = ((m.stick & HORIZONTAL) != HORIZONTAL) & (m.mode == Mode.FLIES)
    left = (m.stick & STICK_LEFT) != 0
    moved = jnp.where(left, m.x_part + m.thrust > 255, m.x_part < m.thrust) & pressed
    return m.x + when(moved, jnp.where(left, 1, -1))


def _player_box(m: Ram, x: jax.Array) -> Box:
    starts = (m.offset == START_OFFSET) & (m.fuel == FULL) & (m.fuel_part == START_PART)
    turned = ((m.sticks & HORIZONTAL) != HORIZONTAL) & (m.mode != Mode.WAITS) & ~starts
    mirrored = turned & (m.sticks & STICK_LEFT > 0)
    there = among(m.look, (Look.STRAIGHT, Look.TURNED)) | (m.mode == Mode.CRASH)
    drawn_x = x + when(mirrored, 1)
    return PLAYERS.box(when(turned, 1), drawn_x, 145, mirrored=mirrored, valid=there)


def _missile_box(m: Ram, player_x: jax.Array) -> Box:
    """The missile; after a hit, the time since the shot gives its row."""
    flies = among(m.missile_y, range(FIRED + 1, OFF))
    shot = jnp.any((m.kind == Kind.HIT) & (m.shot == np.arange(RECORDS))) | ~m.shot_bank
    struck = shot & (m.missile_y == OFF) & among(m.sound, SOUNDS) & (m.mode == Mode.FLIES)
    y = jnp.where(flies, m.missile_y - SPEED, FIRED + SPEED * (FIRED - m.sound))
    follows = flies & (m.missile_x == m.x + 5)
    x = jnp.where(follows, player_x + 5, m.missile_x)
    top = 156 - y + (y + m.offset & 1)  # it is turned on and off on every second row
    first = 4 - (top & 1)
    return box(x - 1, top, 1, 8, flies | struck).clip(8, first, *MISSILE_VIEW[2:])


def _needle_box(m: Ram) -> Box:
    """The gauge before fuel was used (1 / 8 on every frame) or taken in."""
    used = (m.fuel_part >= USED_PART) & (m.mode == Mode.FLIES)
    steps = div(jnp.minimum(m.fuel + when(used, 1), FULL), FUEL_STEP)
    return box(NEEDLE_X + steps, 179, 2, 10, value=FUEL_STEP * steps)


def _score_box(m: Ram) -> Box:
    """The score; all points are tens."""
    digits = [when(d < BLANK, d >> 3) for d in m.digits]
    tens = functools.reduce(lambda total, digit: total * 10 + digit, digits)
    return SCORE.box(tens * 10 + (m.ones >> 3), value=tens * 10)


def _lives_box(m: Ram) -> Box:
    digit = m.icon >> 3
    return LIVES.box(digit, valid=m.icon < NO_DIGIT, value=digit + 1)


facing_category = functools.partial(Category, count=RING, attributes=("orientation",))
view_blobs = functools.partial(Blobs, region=VIEW)

CRAFT = Blobs(PLAYER, (8, 145, 160, 160), Shape(w=(5, 7), h=(13, 14)))
MISSILE = Blobs(PLAYER, MISSILE_VIEW, Shape(w=(1, 6), h=(2, 8)))
DEPOTS = view_blobs((RED, WHITE), shapes=Shape(w=(5, 7), h=(1, 24)))
ROTORS = view_blobs((176, 128, 42), shapes=Shape(w=(3, 8), h=(1, 10)))
JETS = view_blobs((140, 156, 172), shapes=Shape(w=(1, 8), h=(1, 6)))
TANKER_SHAPES = (  # complete, and the parts that the edge leaves
    Shape(w=16, h=(4, 8)),
    Shape(w=14, h=3, pixels=(33, 42)),
    Shape(w=12, h=2),
    Shape(w=10, h=1),
)
TANKERS = Blobs((50, 168, BLACK), VIEW, TANKER_SHAPES)
HOUSE_COLORS = (WHITE, BLACK, TREE, TRUNK)
TREE_SHAPES = Shape(w=10, h=(4, 10)), Shape(w=6, h=3)
TREES = Blobs(HOUSE_COLORS, (8, 2, 160, 15), TREE_SHAPES, gap=(0, 2))
HOUSES = Blobs(HOUSE_COLORS, VIEW, Shape(w=(14, 16), h=(3, 19)), gap=(0, 2), also=(TREES,))
BRIDGES = Bounds((32, 18, 20, 24), VIEW)
NEEDLE_PLACE = Gauge(1, NEEDLE_X, side="x", worth=FUEL_STEP)
FUEL = Bounds(NEEDLE, (66, 176, 104, 189), value=NEEDLE_PLACE)
RESERVE = LIVES.rule(PLAYER, base=1, required=True)


def _saver_key(m: Ram) -> jax.Array:
    return jnp.where(m.saver_mask == SAVER_MASK, m.saver_key, -1)


GAME = Game(
    name="Riverraid",
    rom=ROM,
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (98, 165), 28, mask=SAVER_MASK, taken=(132, 28, 12, 0, 16)),
    checks=Checks(
        rare=("Bridge", "Jet"),
        mirrored={"Jet": None},
    ),
    variants=Variants(
        difficulties={
            0: "the missile follows the jet",
            1: "the missile flies straight",
        },
        source="play of all difficulties in the emulator",
    ),
    categories=(
        Category("Player", CRAFT, role="player", doc="the jet"),
        Category("PlayerMissile", MISSILE, doc="its missile"),
        Category("Bridge", BRIDGES, rgb=(105, 105, 15), doc="at the end of a level"),
        Category("FuelDepot", DEPOTS, count=RING, rgb=(214, 214, 214), doc="by record"),
        facing_category("Helicopter", ROTORS, rgb=(0, 64, 48), doc="by record"),
        Category("House", HOUSES, count=RING, color_row=HOUSE_ROW, doc="house and tree, by record"),
        facing_category("Jet", JETS, rgb=(117, 181, 239), doc="that crosses, by record"),
        facing_category("Tanker", TANKERS, rgb=(163, 57, 21), doc="by record"),
        display("Fuel", FUEL, doc="needle of the gauge; 0-248 by eights"),
        display("PlayerScore", SCORE.rule(PLAYER), role="score", doc="points"),
        display("Lives", RESERVE, role="lives", doc="one more than the digit that shows"),
    ),
)
