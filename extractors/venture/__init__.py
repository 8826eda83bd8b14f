"""Venture: a hunter in two halls, from which he enters rooms with monsters and treasures.

Screen: Player is the dot in a hall. In a room he is Winky, and the dot is his Shot, which he
carries until he shoots. Six Hallmonsters roam a hall; one of them, larger, comes into a room in
which he stays too long. A room has three monsters, alive or dead, and a treasure, which is named by
its colour; room 3 has four moving walls instead of monsters. Chamber is the upper wall of the room
that he is in. Other walls are scenery. Sprites take turns: 0-2 on a frame and 3-5 on the next.

Slots: the first four of Room are the rooms on the map of a hall.

RAM: ALE's source (score, lives), OCAtari 2.2 (what the bytes are), and the ROM's code. Sprites move
at F4FE-F6DF, after every second frame, and a shot after each one; `moves` takes that back. The
larger hall monster changes places with a monster at FB00, every other turn. The last frame of a
scene is older than the RAM, which has the next scene already: only Score, Life and Room are valid,
or for a room (the door that he came in by tells which) Chamber and the treasure, which never moves.
(On 20 such frames of a hall, no byte, shifted or doubled, gives a column of the dot or a monster.)

Covered: both halls and all rooms (by running the ROM's own F8F9), deaths, the end of the game.

Not exact: at a wall a sprite turns round, which its timer mostly tells.

VEM: it does not see a dot that touches a wall of its colour, or monsters that touch each other, and
takes dead trolls for skeletons and dead spiders for nothing.
"""

import functools
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box, choose
from ocjax.console.ops import among, pick, reached, when
from ocjax.extraction.game import Category, Game, display
from ocjax.extractors.venture.ram import ROM, Ram, Room
from ocjax.extractors.venture.sprites import DOT, PAUSED, VIEW, guest, moves, sprites, swaps, winky
from ocjax.vision.displays import IconRow, NumberDisplay
from ocjax.vision.filters import ShortRuns
from ocjax.vision.rules import Blobs, Bounds, Run, Runs
from ocjax.vision.shapes import Shape

FONT = ROM.font(0xF00, rows=8)
SCORE = NumberDisplay(FONT, right=48, top=9, digits=6, leading_zeros=True)
ICONS = IconRow(left=112, top=9, width=4, height=8, pitch=8)

START_X = 68  # `dot_x` at the start of a hall
START_Y = 76
ALL_ICONS = 3
BEGINS = 64  # `pause` on the last frame of the scene before
SPLITS = (40, 38)  # `split` in the halls
DOORS = (2, 4, 8)  # `door` of a hall's rooms but the first one


class Plan(NamedTuple):
    """What never moves in a room."""

    wall_x: int | jax.Array  # of the upper wall
    wall_width: int | jax.Array
    x: int | jax.Array  # of the treasure
    y: int | jax.Array
    width: int | jax.Array
    height: int | jax.Array


# fmt: off
PLANS = (  # of the rooms; upper wall: left width, treasure: left top width height
    Plan(44, 100,  24, 163, 8, 16),
    Plan(16, 100,  24, 163, 8, 12),
    Plan(16, 128, 114, 163, 7, 14),
    Plan(28, 104,  77, 102, 7, 12),
    Plan(16, 128,  80, 163, 8, 16),
    Plan(16, 128, 120,  33, 8, 14),
    Plan(64,  32,  70,  33, 8, 10),
    Plan(64,  32,  80,  67, 8,  6),
)
MAP = np.array([  # of the halls' rooms; left top width height
    ((20, 36, 32, 48), (88, 32, 52, 56), (16, 96, 48, 68), (92, 100, 52, 68)),
    ((16, 32, 48, 56), (84, 32, 60, 48), (56, 64, 52, 48), (16, 120, 128, 52)),
])
# fmt: on
MONSTERS = {  # and their rooms
    "Skeleton": 0,
    "Goblin": 1,
    "Serpant": 2,
    "TwoHeaded": 4,
    "Troll": 5,
    "Dragon": 6,
    "Spider": 7,
}
TREASURES = {  # and their rooms
    "Purple_Collectable": (0,),
    "Yellow_Collectable": (1, 5),
    "Pink_Collectable": (2, 6),
    "Grey_Collectable": (3, 4),
    "Green_Collectable": (7,),
}
TREASURE_FIRST = (5, 6, 7)  # rooms whose treasure is sprite 1, not 2


class Scene(NamedTuple):
    """The scene that is on the screen."""

    old: jax.Array  # whether the RAM has the next scene already
    left: jax.Array  # whether it is old and a room, which he has left
    hall: jax.Array  # whether it is a hall, and the RAM's
    room: jax.Array  # whether it is a room, and the RAM's
    number: jax.Array  # of the room
    second: jax.Array  # whether it is the second hall, whose walls are blue, or one of its rooms
    color: jax.Array  # of the walls


def decode(m: Ram) -> dict[str, Box]:
    scene = _shown_scene(m)
    dx, dy = moves(m)
    dot_box = box(m.dot_x - 1 - dx[DOT], 25 + 2 * (m.dot_y - dy[DOT]), 1, 2, color=scene.color)
    dx, dy = dx[:DOT], dy[:DOT]
    drawn = sprites(m, dx, dy).where(~scene.old)
    in_room = guest(m, dx, dy).where(~scene.old)
    return {
        "Player": dot_box.where(scene.hall),
        "Winky": winky(m, dx, dy).where(scene.room),
        "Shot": dot_box.where(scene.room),
        "Hallmonsters": choose(scene.hall, _roamer_boxes(m, drawn), in_room),
        **_monster_boxes(m, drawn),
        **_treasure_boxes(m, scene, drawn),
        "Wall": _walls(drawn).where(m.room == Room.WALLS),
        "Chamber": _chamber(scene),
        "Room": _map_boxes(m, scene),
        "Life": _lives(m, scene),
        "Score": SCORE.box(100 * m.score),
    }


def _at_start(m: Ram) -> jax.Array:
    return (m.dot_x == START_X) & (m.dot_y == START_Y)


def _shown_scene(m: Ram) -> Scene:
    # Where the game itself begins, there is no scene before.
    game_begins = _at_start(m) & (m.icons == ALL_ICONS)
    old = (m.pause == BEGINS) & (m.flags >= PAUSED) & ~game_begins
    in_hall = among(m.room, Room.HALLS)
    left = old & in_hall & ~among(m.split, SPLITS)
    by_door = when(m.room == Room.SECOND_HALL, 4) + reached(m.door, DOORS)
    before = jnp.where(left, among(by_door, Room.BEYOND_SECOND_HALL), m.split == SPLITS[1])
    now = (m.room == Room.SECOND_HALL) | among(m.room, Room.BEYOND_SECOND_HALL)
    second = jnp.where(old, before, now)
    return Scene(
        old=old,
        left=left,
        hall=~old & in_hall,
        room=~old & ~in_hall,
        number=jnp.where(left, by_door, m.room),
        second=second,
        color=jnp.where(second, WALL_COLORS[1], WALL_COLORS[0]),
    )


def _room_plan(scene: Scene) -> Plan:
    """What is in the room on the screen."""
    return Plan(*(pick(scene.number, column) for column in zip(*PLANS, strict=True)))


def _roamer_boxes(m: Ram, drawn: Box) -> Box:
    return replace(drawn, color=jnp.where(swaps(m), m.guest_color, m.color) & ~1)


def _monster_boxes(m: Ram, drawn: Box) -> dict[str, Box]:
    """Sprites 3 and 4, and that of 1 and 2 which is not the treasure."""
    later = drawn[2:5]
    usual = choose(np.arange(3) == 0, drawn[1:4], later)
    boxes = choose(among(m.room, TREASURE_FIRST), later, usual)
    return {name: boxes.where(m.room == room) for name, room in MONSTERS.items()}


def _treasure_boxes(m: Ram, scene: Scene, drawn: Box) -> dict[str, Box]:
    usual = choose(among(m.room, TREASURE_FIRST), drawn[1], drawn[2])
    treasure = choose(m.room == Room.WALLS, drawn[3], usual)
    plan = _room_plan(scene)
    kept = box(plan.x, plan.y, plan.width, plan.height, m.taken == 0)
    treasure = choose(scene.left, kept, treasure)
    return {name: treasure.where(among(scene.number, rooms)) for name, rooms in TREASURES.items()}


def _walls(drawn: Box) -> Box:
    """The moving walls: drawn 1, 2, 4 and 5."""
    return choose(np.arange(4) < 2, _spread(drawn[1:5]), _spread(drawn[2:6]))


def _spread(boxes: Box) -> Box:
    """Pictures with four columns a dot."""
    return box(boxes.x + 1, boxes.y, 4 * boxes.w, boxes.h, boxes.valid)


def _chamber(scene: Scene) -> Box:
    plan = _room_plan(scene)
    there = scene.room | scene.left
    return box(plan.wall_x, 24, plan.wall_width, 4, there, color=scene.color)


def _map_boxes(m: Ram, scene: Scene) -> Box:
    """The rooms of the hall that is on the screen."""
    sides = jnp.moveaxis(jnp.where(scene.second, MAP[1], MAP[0]), 1, 0)
    rooms = MAP.shape[1]
    x, y, w, h = (jnp.pad(side, (0, MAPPED.slots - rooms)) for side in sides)
    shown = jnp.where(scene.old, among(m.split, SPLITS), scene.hall)
    return box(x, y, w, h, shown & (np.arange(MAPPED.slots) < rooms), color=scene.color)


def _lives(m: Ram, scene: Scene) -> Box:
    """The icons; on the last frame of a life, its icon is still there."""
    icon_count = m.icons + when(scene.old & _at_start(m), 1)
    return ICONS.box(icon_count, value=m.icons + 1, color=scene.color)


WALL_COLORS = (84, 148)
PINK_FACE = 66
GREEN = 212
BLUE = 116
GREY = 4
ORANGE = 52
GOLD = 20
RED = 68
PINKS = (82, 84)  # the latter is also the colour of the first hall's walls
EMERALD = 196
BIG = Shape(w=(5, 8), h=(10, 16))
DEAD_SHAPE = replace(BIG, pixels=(78, 82))
field = functools.partial(Blobs, region=VIEW)
SPOT = field(WALL_COLORS, filters=(ShortRuns(3),), shapes=Shape(w=1, h=2))
ROAMER_SHAPES = (
    Shape(w=(4, 5), h=(6, 8)),  # in a hall
    Shape(w=8, h=16, pixels=(44, 52)),  # in a room
)
ROAMERS = field((GREEN, ORANGE), shapes=ROAMER_SHAPES)
SNAKES = field(GREEN, shapes=(Shape(w=(7, 8), h=(10, 14)), DEAD_SHAPE))
YELLOW = field(GOLD, shapes=(replace(BIG, pixels=(40, 49)), replace(BIG, pixels=(70, 76))))
GREYS = field(GREY, shapes=(replace(BIG, pixels=(20, 49)), replace(BIG, pixels=(70, 76))))
MOVING = field(ORANGE, shapes=(Shape(w=(16, 20), h=(6, 8)), Shape(w=4, h=(20, 26))))
wall_run = functools.partial(Run, WALL_COLORS)
MAPPED = Runs(
    (
        wall_run(32, left=88, width=52, height=56),
        wall_run(32, left=84, width=60, height=48),
        wall_run(36, left=20, width=32, height=48),
        wall_run(84, left=32, width=16, height=4, before=16, above=52, after=16),
        wall_run(108, left=84, width=20, height=4, before=28, above=44, after=4),
        wall_run(160, left=16, width=48, height=4, above=64),
        wall_run(164, left=92, width=52, height=4, above=64),
        wall_run(168, left=68, width=24, height=4, before=52, above=48, after=52),
    ),
    most=3,
)


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
        display(
            "Life",
            ICONS.rule(WALL_COLORS, (104, 9, 152, 17), single=2),
            doc="one more than the icons",
        ),
        display("Score", SCORE.rule(8), doc="points"),
    ),
)
