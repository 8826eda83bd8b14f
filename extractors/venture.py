"""Venture: a hunter in two halls, from which he enters rooms with monsters and treasures.

Player: the dot in a hall. In a room he is Winky, and the dot is his Shot, which he carries until he
shoots. Six Hallmonsters roam a hall; one of them, larger, comes into a room in which he stays too
long. A room has three monsters, alive or dead, and a treasure, which is named by its colour; room 3
has four moving walls instead of monsters. Sprites take turns: 0-2 on a frame and 3-5 on the next.
Room: the rooms on the map of a hall, in the first four slots. Chamber: the upper wall of the room
that he is in. Other walls are scenery.

RAM: ALE's source (score, lives), OCAtari 2.2 (what the bytes are), and the ROM's code. Sprites move
at F4FE-F6DF, after every second frame, and a shot after each one; `_moves` takes that back. The
larger hall monster changes places with a monster at FB00, every other turn. The last frame of a
scene is older than the RAM, which has the next scene already: only Score, Life and Room are valid,
or for a room (the door that he came in by tells which) Chamber and the treasure, which never moves.
(On 20 such frames of a hall, no byte, shifted or doubled, gives a column of the dot or a monster.)

Covered: both halls and all rooms (by running the ROM's own F8F9), deaths, the end of the game.
Not exact: at a wall a sprite turns round, which its timer mostly tells. VEM does not see a dot that
touches a wall of its colour, or monsters that touch each other, and takes dead trolls for skeletons
and dead spiders for nothing.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box, choose
from ocjax.console.fonts import Digits
from ocjax.console.ops import among, pick, reached
from ocjax.console.ram import RamMap, bcd, byte
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.filters import ShortRuns
from ocjax.vision.rules import Blobs, Bounds, Gauge, Run, Runs
from ocjax.vision.shapes import Shape

ROM = Rom("venture", "3e899eba0ca8cd2972da1ae5479b4f0d")
FONT = ROM.font(0xF00, rows=8)
ROWS = (5, 7, 9, 13)  # rows of pictures, two lines each
PAGE = np.append(ROM.bytes(0xE00, 256), ROM.bytes(0xF00, 16))
PICTURES = Pictures.of(PAGE[low : low + rows] for rows in ROWS for low in range(256))
SPEEDS = ROM.bytes(0xE48, 8).tolist()  # by the lowest bits of `status`
SPRITE = np.arange(6)
FIRST_LINE = np.array((26, 27, 27, 26, 27, 27))
THIRDS = (7, 7, 7, 1, 1, 1, 1, 1, 7, 7)  # shift of the third sprite of a frame, by room
DOT = 6
PAUSED = 0x80
BEGINS = 0x40
START = (0x44, 0x4C)
FULL = 3
SPLITS = (0x28, 0x26)  # rows in which the halls have the third sprite from
WALLS_ROOM = 3
HALLS = (8, 9)
GONE = 0x51
NO_GUEST = 0x80
DEAD = 0xF2
COUNTER_TURN = 1
MONSTERS = {"Skeleton": 0, "Goblin": 1, "Serpant": 2, "TwoHeaded": 4, "Troll": 5, "Dragon": 6}
MONSTERS |= {"Spider": 7}
COLORS = ("Purple", "Yellow", "Pink", "Grey", "Green")  # of treasures, by rooms
OF_ROOMS = zip(COLORS, ((0,), (1, 5), (2, 6), (3, 4), (7,)), strict=True)
TREASURES = {f"{color}_Collectable": rooms for color, rooms in OF_ROOMS}
TREASURE_FIRST = (5, 6, 7)  # rooms whose treasure is sprite 1, not 2
VIEW = (0, 24, 160, 186)
# The top walls of the rooms: left, width. The treasures: left, top, width, height.
TOP_WALLS = (44, 16, 16, 28, 16, 16, 64, 64), (100, 100, 128, 104, 128, 128, 32, 32)
PLACES = (24, 24, 114, 77, 80, 120, 70, 80), (163, 163, 163, 102, 163, 33, 33, 67)
SIZES = (8, 8, 7, 7, 8, 8, 8, 8), (16, 12, 14, 12, 16, 14, 10, 6)
DOORS = (2, 4, 8)  # `door` of a hall's rooms but the first one
ROOMS = np.array([  # of the halls, on the map
    ((20, 36, 32, 48), (88, 32, 52, 56), (16, 96, 48, 68), (92, 100, 52, 68)),
    ((16, 32, 48, 56), (84, 32, 60, 48), (56, 64, 52, 48), (16, 120, 128, 52)),
])  # fmt: skip


class Ram(RamMap):
    picture = byte(0, 2, 4, 6, 8, 10)  # low byte of its address, less the row
    guest_picture = byte(14)
    door = byte(16)  # of the hall, that he used last: a bit
    taken = byte(18)  # 255: the treasure
    y = byte(20, 21, 22, 23, 24, 25)  # in two lines
    dot_y = byte(26)
    guest_y = byte(27)
    status = byte(28, 29, 30, 31, 32, 33, 34)  # the last one of the dot
    color = byte(36, 37, 38, 39, 40, 41)
    height = byte(42, 43, 44, 45, 46, 47)  # 256 less the rows
    guest_color = byte(48)
    timer = byte(50, 51, 52, 53, 54, 55, 56)
    turns = byte(58, 59, 60)  # bits go round: who moves
    next_turn = byte(61)  # first sprite of the next frame
    flags = byte(63)
    icons = byte(70)  # lives left
    score = bcd((71, 72))  # hundreds
    pause = byte(76)  # frames until a scene begins
    x = byte(79, 80, 81, 82, 83, 84)
    dot_x = byte(85)  # x + 1
    guest_x = byte(86)
    guest = byte(89)  # the sprite that the larger hall monster has a turn with
    room = byte(90)
    swapped = byte(91)
    split = byte(105)  # row from which the third sprite of the frame is drawn


def decode(m: Ram) -> dict[str, Box]:
    old, left, number, icons = _scene(m)
    second = _second(m, old, left, number)
    wall = jnp.where(second, WALL_COLORS[1], WALL_COLORS[0])
    hall, room = (~old & there for there in (among(m.room, HALLS), ~among(m.room, HALLS)))
    dx, dy = _moves(m)
    dot = box(m.dot_x - 1 - dx[DOT], 25 + 2 * (m.dot_y - dy[DOT]), 1, 2, color=wall)
    dx, dy = dx[:DOT], dy[:DOT]
    swap = (m.swapped > 0) & (m.guest == SPRITE)
    x = jnp.where(swap, m.guest_x, m.x) - dx
    y = jnp.where(swap, m.guest_y, m.y) - dy
    picture = jnp.where(swap, m.guest_picture - dy, m.picture + dy)
    color = jnp.where(swap, m.guest_color, m.color) & ~1
    sprites = _sprites(m, x, y, picture + y).where((y != GONE) & ~old)
    roamers = replace(sprites, color=color)
    three, four = sprites[1:4], sprites[2:5]
    first = among(m.room, TREASURE_FIRST)
    pairs = choose(np.arange(3) == 0, three, four)  # sprites 1, 3 and 4
    monsters = choose(first, four, pairs)
    kinds = {name: monsters.where(m.room == room) for name, room in MONSTERS.items()}
    treasure = choose(m.room == WALLS_ROOM, sprites[3], choose(first, sprites[1], sprites[2]))
    treasure = choose(left, _place(m, number), treasure)
    finds = {name: treasure.where(among(number, rooms)) for name, rooms in TREASURES.items()}
    x0 = pick(number, TOP_WALLS[0])
    walls = choose(np.arange(4) < 2, _spread(sprites[1:5]), _spread(sprites[2:6]))
    score = 100 * m.score
    return {
        "Player": dot.where(hall),
        "Winky": box(x[0] - 1, 26 + 2 * y[0], 8, 12, room),
        "Shot": dot.where(room),
        "Hallmonsters": choose(hall, roamers, _guest(m, dx, dy).where(~old)),
        **kinds,
        **finds,
        "Wall": walls.where(m.room == WALLS_ROOM),
        "Chamber": box(x0, 24, pick(number, TOP_WALLS[1]), 4, room | left, color=wall),
        "Room": _rooms(second, jnp.where(old, among(m.split, SPLITS), hall), wall),
        "Life": box(112, 9, 8 * icons - 4, 8, icons > 0, value=m.icons + 1, color=wall),
        "Score": box(1, 9, 46, 8, value=score),
    }


def _scene(m: Ram) -> tuple[jax.Array, ...]:
    """Whether the scene before is still on the screen, and a room; which room; the icons shown."""
    start = (m.dot_x == START[0]) & (m.dot_y == START[1])
    # Where the game itself begins, there is no scene before.
    old = (m.pause == BEGINS) & (m.flags >= PAUSED) & ~(start & (m.icons == FULL))
    left = old & among(m.room, HALLS) & ~among(m.split, SPLITS)
    number = jnp.where(m.room == HALLS[1], 4, 0) + reached(m.door, DOORS)
    icons = m.icons + jnp.where(old & start, 1, 0)
    return old, left, jnp.where(left, number, m.room), icons


def _place(m: Ram, number: jax.Array) -> Box:
    """Where the treasure of a room is."""
    return box(*(pick(number, sides) for sides in PLACES + SIZES), valid=m.taken == 0)


def _second(m: Ram, old: jax.Array, left: jax.Array, number: jax.Array) -> jax.Array:
    """Whether the scene is in the second hall, whose walls are blue, or in one of its rooms."""
    before = jnp.where(left, number >= 4, m.split == SPLITS[1])
    return jnp.where(old, before, (m.room == HALLS[1]) | among(m.room, range(4, 8)))


def _spread(boxes: Box) -> Box:
    """Pictures with four columns a dot."""
    return box(boxes.x + 1, boxes.y, 4 * boxes.w, boxes.h, boxes.valid)


def _rooms(second: jax.Array, hall: jax.Array, color: jax.Array) -> Box:
    x, y, w, h = jnp.moveaxis(jnp.where(second, ROOMS[1], ROOMS[0]), 1, 0)
    there = hall & (np.arange(MAPPED.slots) < len(ROOMS[0]))
    x, y, w, h = (jnp.pad(side, (0, MAPPED.slots - 4)) for side in (x, y, w, h))
    return box(x, y, w, h, there, color=color)


def _sprites(m: Ram, x: jax.Array, y: jax.Array, picture: jax.Array) -> Box:
    """The six sprites; `picture` has the low byte of the address before the first row."""
    size = jnp.where(m.height == 251, 0, jnp.where(m.height == 249, 1, 2))
    size = jnp.where(m.height == 243, 3, size)
    left, top, width, rows = PICTURES.extent(256 * size + (picture + 1 & 255))
    row = jnp.where(y >= 128, y - 256, y) + top
    shift = jnp.where(SPRITE % 3 == 2, pick(m.room, THIRDS), 1)
    spread = jnp.where((m.room == WALLS_ROOM) & (SPRITE % 3 > 0), 4, 1)
    sprites = box(x - shift + spread * left, FIRST_LINE + 2 * row, width, 2 * rows, rows > 0)
    return sprites.clip(*VIEW)


def _guest(m: Ram, dx: jax.Array, dy: jax.Array) -> Box:
    """The larger hall monster in a room, in the first slot."""
    swapped = m.swapped > 0
    own = [jnp.where(m.guest == 4, side[4], side[3]) for side in (m.x - dx, m.y - dy)]
    x, y = (jnp.where(swapped, a, b) for a, b in zip(own, (m.guest_x, m.guest_y), strict=True))
    color = jnp.where(swapped, jnp.where(m.guest == 4, m.color[4], m.color[3]), m.guest_color) & ~1
    line = jnp.where(m.guest == 4, FIRST_LINE[4], FIRST_LINE[3])
    there = (m.guest < NO_GUEST) & (np.arange(6) == 0) & (y != GONE)
    return box(x - 1, line + 2 * y, 8, 16, there, color=color).clip(*VIEW)


def _moves(m: Ram) -> tuple[jax.Array, jax.Array]:
    """How far the sprites and the dot have moved since they were drawn: `[7]`."""
    just, kind, dot = m.next_turn == 0, m.status & 7, np.arange(7) == DOT
    before = jnp.stack((m.turns[0] >> 1 | (m.turns[0] & 1) << 7, m.turns[1] >> 1, m.turns[2] >> 1))
    turns = jnp.where(just, m.turns, before)
    turn = jnp.where((kind == 1) | (kind == 5), turns[1], turns[2])
    turn = jnp.where(among(kind, (0, 2, 4)), turns[0], turn)
    since = just | ((np.arange(7) >= 3) & ~dot)
    moved = since & ((turn & pick(kind, SPEEDS)) > 0) & (m.status != DEAD)
    moved = (moved | (dot & ~just & ~among(m.room, HALLS))) & (m.flags < PAUSED)
    winky = (np.arange(7) == 0) & ~among(m.room, HALLS)
    back = (m.timer == COUNTER_TURN) & ~dot & ~winky
    way = jnp.where(moved, jnp.where(back, -1, 1), 0)
    right, left, down, up = (m.status >> bit & 1 == 0 for bit in (7, 6, 5, 4))
    dx = jnp.where(right, 1, jnp.where(left, -1, 0))
    return way * dx, way * jnp.where(down, 1, jnp.where(up, -1, 0))


WALL_COLORS = (0x54, 0x94)
PINK_FACE = 0x42
GREEN = 0xD4
BLUE = 0x74
GREY = 4
ORANGE = 0x34
GOLD = 0x14
RED = 0x44
PINKS = (0x52, 0x54)
EMERALD = 0xC4
BIG = Shape(w=(5, 8), h=(10, 16))
DEAD_SHAPE = replace(BIG, pixels=(78, 82))
field = functools.partial(Blobs, region=(0, 24, 160, 186))
SPOT = field(WALL_COLORS, filters=(ShortRuns(3),), shapes=Shape(w=1, h=2))
# A Hallmonster in a hall, and one in a room.
ROAMER_SHAPES = Shape(w=(4, 5), h=(6, 8)), Shape(w=8, h=16, pixels=(44, 52))
ROAMERS = field((GREEN, ORANGE), shapes=ROAMER_SHAPES)
SNAKES = field(GREEN, shapes=(Shape(w=(7, 8), h=(10, 14)), DEAD_SHAPE))
YELLOW = field(GOLD, shapes=(replace(BIG, pixels=(40, 49)), replace(BIG, pixels=(70, 76))))
GREYS = field(GREY, shapes=(replace(BIG, pixels=(20, 49)), replace(BIG, pixels=(70, 76))))
MOVING = field(ORANGE, shapes=(Shape(w=(16, 20), h=(6, 8)), Shape(w=4, h=(20, 26))))
room = functools.partial(Run, WALL_COLORS)
MAPPED = Runs(
    (
        room(32, left=88, width=52, height=56),
        room(32, left=84, width=60, height=48),
        room(36, left=20, width=32, height=48),
        room(84, left=32, width=16, height=4, before=16, above=52, after=16),
        room(108, left=84, width=20, height=4, before=28, above=44, after=4),
        room(160, left=16, width=48, height=4, above=64),
        room(164, left=92, width=52, height=4, above=64),
        room(168, left=68, width=24, height=4, before=52, above=48, after=52),
    ),
    most=3,
)
ICONS = Bounds(WALL_COLORS, (104, 9, 152, 17), value=Gauge(8, -4, 1))
SCORE = Digits(FONT, range(0, 48, 8), 9)


def _monster(name: str, color: int, pixels: tuple[int, int], doc: str) -> Category:
    shapes = replace(BIG, pixels=pixels), DEAD_SHAPE
    return Category(name, field(color, shapes=shapes), count=3, doc=doc)


GAME = Game(
    name="Venture",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", SPOT, needs=("Room",), doc="the hunter in a hall"),
        Category("Winky", field(PINK_FACE, shapes=BIG), doc="the hunter in a room"),
        Category("Shot", SPOT, needs=("Chamber",), doc="his arrow"),
        Category("Hallmonsters", ROAMERS, count=6, doc="in a hall, or one in a room"),
        _monster("Skeleton", GREY, (50, 62), "of room 0"),
        _monster("Goblin", BLUE, (50, 66), "of room 1"),
        Category("Serpant", SNAKES, count=3, doc="of room 2"),
        Category("TwoHeaded", field(RED, shapes=BIG), count=3, doc="of room 4"),
        Category(
            "Troll",
            field(GREY, shapes=replace(BIG, pixels=(64, 69))),
            count=3,
            doc="of room 5",
        ),
        _monster("Dragon", GOLD, (50, 62), "of room 6"),
        Category(
            "Spider", field(ORANGE, shapes=Shape(w=(7, 8), h=(12, 14))), count=3, doc="of room 7"
        ),
        Category(
            "Purple_Collectable",
            field(BLUE, shapes=replace(BIG, pixels=(67, 70))),
            doc="of room 0",
        ),
        Category("Yellow_Collectable", YELLOW, doc="of rooms 1 and 5"),
        Category(
            "Pink_Collectable",
            field(PINKS, shapes=Shape(w=(7, 8), h=(9, 14))),
            doc="of rooms 2 and 6",
        ),
        Category("Grey_Collectable", GREYS, doc="of rooms 3 and 4"),
        Category(
            "Green_Collectable", field(EMERALD, shapes=Shape(w=(1, 8), h=(1, 8))), doc="of room 7"
        ),
        Category("Wall", MOVING, count=4, needs=("Chamber",), doc="of room 3"),
        Category("Chamber", Bounds(WALL_COLORS, (8, 24, 152, 28)), doc="upper wall of a room"),
        Category("Room", MAPPED, count=MAPPED.slots, doc="on the map"),
        display("Life", ICONS, doc="one more than the icons"),
        display("Score", Bounds(8, (0, 9, 48, 17), value=SCORE), doc="points"),
    ),
)
