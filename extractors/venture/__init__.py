"""Venture: a hunter in two halls enters rooms with monsters and treasures.

Picture: docs/games/Venture.png

Screen: Player is the dot in a hall. In a room he is Winky, and the dot is his Shot, which he
carries until he shoots. Six Hallmonsters roam a hall; one of them, larger, enters a room if he
stays too long. A room has three monsters, alive or dead, and a treasure, which is named by its
colour. Room 3 has four moving walls instead of monsters. Chamber is the upper wall of the current
room. Sprites alternate: 0-2 on a frame and 3-5 on the next.

Slots: the first four of Room are the rooms on the map of a hall.

Terrain: the walls of rooms; in a hall, the outlines of its rooms and the bars between them. The
moving walls of room 3 are no terrain.

Files: `ram` has the RAM and the meaning of its values. `scene` identifies the hall or room on the
screen and has its fixed parts. `sprites` has all moving objects. `terrain` has the walls.

RAM: ALE's source (score, lives), OCAtari 2.2 (meaning of the bytes), and the ROM's code.

Last frames: the last frame of a scene is older than the RAM, which already has the next scene. Then
only Score, Life and Room are valid; for a room (identified by the door that he used), Chamber and
the treasure, which never moves. On 20 such frames of a hall, no byte of the RAM, shifted or
doubled, was the old column of the dot or of a monster.

Covered: both halls and all rooms (by running the ROM's own F8F9), deaths, the end of the game.

Not exact: the turns of a sprite at a wall; the sprite's timer mostly shows them.

VEM: it misses a dot that touches a wall of its colour, monsters that touch each other, and dead
spiders. It takes dead trolls for skeletons.
"""

import functools
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    IconRow,
    NumberDisplay,
    Run,
    Runs,
    Shape,
    ShortRuns,
    among,
    box,
    choose,
    display,
    when,
)
from ocjax.extractors.venture.ram import ROM, Ram, Room
from ocjax.extractors.venture.scene import (
    FIRST_MAP,
    SECOND_MAP,
    SPLITS,
    WALL_BOTTOM,
    WALL_COLORS,
    WALL_TOP,
    Scene,
    is_at_start,
    room_plan,
    shown_scene,
)
from ocjax.extractors.venture.sprites import (
    VIEW,
    WALL_SPREAD,
    as_drawn,
    dot_box,
    guest_box,
    sprite_boxes,
    swaps,
    winky_box,
)
from ocjax.extractors.venture.terrain import TERRAIN

FONT = ROM.font(0xF00, rows=8)
SCORE = NumberDisplay(FONT, right=48, top=9, digits=6, leading_zeros=True)
ICONS = IconRow(left=112, top=9, width=4, height=8, pitch=8)

MONSTERS = {  # the room of each
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
TREASURE_FIRST = (5, 6, 7)  # the treasure is sprite 1 in these rooms, otherwise sprite 2


def decode(m: Ram) -> dict[str, Box]:
    scene = shown_scene(m)
    drawn = as_drawn(m)
    dot = dot_box(drawn, scene.color)
    shown = sprite_boxes(m, drawn).where(~scene.is_old)
    in_room = guest_box(m, drawn).where(~scene.is_old)
    return {
        "Player": dot.where(scene.is_hall),
        "Winky": winky_box(drawn).where(scene.is_room),
        "Shot": dot.where(scene.is_room),
        "Hallmonsters": choose(scene.is_hall, _roamer_boxes(m, shown), in_room),
        **_monster_boxes(m, shown),
        **_treasure_boxes(m, scene, shown),
        "Wall": _wall_boxes(shown).where(m.room == Room.WALLS),
        "Chamber": _chamber_box(scene),
        "Room": _map_boxes(m, scene),
        "Life": _life_box(m, scene),
        "Score": SCORE.box(100 * m.score),
    }


def _roamer_boxes(m: Ram, shown: Box) -> Box:
    """The monsters of a hall, in the colours that the sprites show."""
    return replace(shown, color=jnp.where(swaps(m), m.guest_color, m.color) & ~1)


def _monster_boxes(m: Ram, shown: Box) -> dict[str, Box]:
    """Sprites 3 and 4, and 1 or 2, whichever is not the treasure."""
    after_treasure = shown[2:5]
    around_treasure = choose(np.arange(3) == 0, shown[1:4], after_treasure)
    boxes = choose(among(m.room, TREASURE_FIRST), after_treasure, around_treasure)
    return {name: boxes.where(m.room == room) for name, room in MONSTERS.items()}


def _treasure_boxes(m: Ram, scene: Scene, shown: Box) -> dict[str, Box]:
    """The treasure of the room, or of the room that he has left, where it never moved."""
    usual = choose(among(m.room, TREASURE_FIRST), shown[1], shown[2])
    in_room = choose(m.room == Room.WALLS, shown[3], usual)
    plan = room_plan(scene)
    kept = box(plan.x, plan.y, plan.width, plan.height, m.taken == 0)
    treasure = choose(scene.is_left, kept, in_room)
    return {name: treasure.where(among(scene.number, rooms)) for name, rooms in TREASURES.items()}


def _wall_boxes(shown: Box) -> Box:
    """The moving walls: sprites 1, 2, 4 and 5."""
    first_two = shown[1:5]
    last_two = shown[2:6]
    return choose(np.arange(4) < 2, _widened(first_two), _widened(last_two))


def _widened(boxes: Box) -> Box:
    """Walls with all columns of each dot."""
    return box(boxes.x + 1, boxes.y, WALL_SPREAD * boxes.w, boxes.h, boxes.valid)


def _chamber_box(scene: Scene) -> Box:
    """The upper wall of a room."""
    plan = room_plan(scene)
    there = scene.is_room | scene.is_left
    return box(
        plan.wall_x, WALL_TOP, plan.wall_width, WALL_BOTTOM - WALL_TOP, there, color=scene.color
    )


def _map_boxes(m: Ram, scene: Scene) -> Box:
    """The rooms of the hall on the screen."""
    sides = jnp.where(scene.is_second, np.array(SECOND_MAP), np.array(FIRST_MAP)).T
    rooms = len(FIRST_MAP)
    x, y, w, h = jnp.pad(sides, ((0, 0), (0, MAPPED.slots - rooms)))
    in_hall = jnp.where(scene.is_old, among(m.split, SPLITS), scene.is_hall)
    return box(x, y, w, h, in_hall & (np.arange(MAPPED.slots) < rooms), color=scene.color)


def _life_box(m: Ram, scene: Scene) -> Box:
    """The icons; on the last frame of a life, its icon is still there."""
    icon_count = m.icons + when(scene.is_old & is_at_start(m), 1)
    return ICONS.box(icon_count, value=m.icons + 1, color=scene.color)


PINK_FACE = 66  # of Winky
GREEN = 212
BLUE = 116
GRAY = 4
ORANGE = 52
GOLD = 20
RED = 68
PINKS = (82, 84)  # the second one is also the colour of the first hall's walls
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
GRAYS = field(GRAY, shapes=(replace(BIG, pixels=(20, 49)), replace(BIG, pixels=(70, 76))))
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

UPPER_WALL = Bounds(WALL_COLORS, (8, WALL_TOP, 152, WALL_BOTTOM))


def _monster(name: str, color: int, pixels: tuple[int, int], doc: str) -> Category:
    shapes = replace(BIG, pixels=pixels), DEAD_SHAPE
    return Category(name, field(color, shapes=shapes), count=3, doc=doc)


GAME = Game(
    name="Venture",
    rom=ROM,
    ram=Ram,
    decode=decode,
    terrain=TERRAIN,
    checks=Checks(
        # A lost life clears the records of the player and the hall monsters. VEM misses monsters
        # that touch.
        agreement={"lost": 0.75, "modes": 0.93},
        rare=("Dragon", "Serpant", "Skeleton", "Spider", "Troll", "TwoHeaded", "Wall"),
        moved=0.15,  # many walls
    ),
    categories=(
        Category("Player", SPOT, needs=("Room",), role="player", doc="the hunter in a hall"),
        Category("Winky", field(PINK_FACE, shapes=BIG), doc="the hunter in a room"),
        Category("Shot", SPOT, needs=("Chamber",), doc="his arrow"),
        Category("Hallmonsters", ROAMERS, count=6, doc="in a hall, or one in a room"),
        _monster("Skeleton", GRAY, (50, 62), "of room 0"),
        _monster("Goblin", BLUE, (50, 66), "of room 1"),
        Category("Serpant", SNAKES, count=3, doc="of room 2"),
        Category("TwoHeaded", field(RED, shapes=BIG), count=3, doc="of room 4"),
        Category(
            "Troll",
            field(GRAY, shapes=replace(BIG, pixels=(64, 69))),
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
        Category("Grey_Collectable", GRAYS, doc="of rooms 3 and 4"),
        Category(
            "Green_Collectable", field(EMERALD, shapes=Shape(w=(1, 8), h=(1, 8))), doc="of room 7"
        ),
        Category("Wall", MOVING, count=4, needs=("Chamber",), doc="of room 3"),
        Category("Chamber", UPPER_WALL, doc="upper wall of a room"),
        Category("Room", MAPPED, count=MAPPED.slots, doc="on the map"),
        display(
            "Life",
            ICONS.rule(WALL_COLORS, (104, 9, 152, 17), single=2),
            role="lives",
            doc="one more than the icons",
        ),
        display("Score", SCORE.rule(8), role="score", doc="points"),
    ),
)
