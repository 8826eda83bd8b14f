"""Montezuma's Revenge: an explorer in the rooms of a pyramid, with keys, monsters and traps.

Picture: docs/games/MontezumaRevenge.png

Screen: Platform has ledges; Disappearing_Platform bridges, and the steps of room 8; Wall rock, and
bars that close rooms; Ladder also the ladders in the bricks; Pole a rope in the rocks' colour.
Ceilings, bricks with their floors and fire pits are scenery. In the dark (rooms 16 and up) only
bridges, skulls, spiders and the explorer are visible.

Slots: a room has things or monsters of one kind in up to three copies, which are its slots. The
last slot of Skull is the rolling one in rooms 1, 5 and 18.

RAM: ALE's source (score, lives), OCAtari 2.2 (meaning of the bytes), and the ROM's code. Things and
skulls move at F8C0-F9F0 of the first bank, before a room is drawn (second bank, table at F352). The
explorer moves after the drawing, at F159-F75D; `_explorer_box` undoes this. The game chooses his
picture in between, for the next frame.

Terrain: rock, bricks, ladders and the like, also in the dark, where the pixels do not show them.

Covered: all rooms of the three pyramids (by writing RAM), lit and dark, traps, the end.

Not exact, because the RAM does not have it: whether a wall stopped a step, where the explorer
caught a ladder or rope, his last picture but one, the room that he has just left.

VEM: it misses objects that he hides, spiders in front of ladders, and ropes in other colours.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Bitmap,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    IconRow,
    LoneRuns,
    NumberDisplay,
    Pictures,
    Shape,
    Variants,
    among,
    box,
    choose,
    display,
    lookup,
    match,
    pick,
    registers,
    when,
)
from ocjax.extractors.montezumarevenge.ram import (
    ROM,
    Dark,
    Leap,
    Picture,
    Pose,
    Ram,
    State,
    Thing,
    Tune,
)
from ocjax.extractors.montezumarevenge.rooms import (
    EXPLORER_COLORS,
    FORCE_COLOR,
    GOLD,
    PARTS_BY_CATEGORY,
    ROPE_ROOMS,
    ROPES,
    RULES,
    room_parts,
)
from ocjax.extractors.montezumarevenge.terrain import TERRAIN

FONT = ROM.font(0xC08, rows=8, top_first=True)
SCORE = NumberDisplay(FONT, right=104, top=6, digits=6)
RESERVE = IconRow(left=56, top=15, width=7, height=5, pitch=8)
D000 = 0x1000  # offset of the bank at this address
FC00 = 0x1C00

BONUS = 15  # room without a picture
HIDDEN = 19  # things are dark in this room and the following ones
LONG_BEAMS = 12  # room
TORCH_BIT = 128  # least `things` with a torch
LOWER_ROOMS = (0, 7, 12, 17, 18)  # rooms that begin a row later
SKULL_ROOMS = (1, 5, 18)
SKULL_BASES = (0, 406, 0, 0, 0, 358, 309)  # row of a skull with `skull_y` 0, by room; last: 18
FAR_ROOM = 18  # a rolling skull's columns are counted from the left here
BEAM_ROOMS = (0, 7)
BEAM_X = np.array((16, 36, 44, 60, 68, 88, 96, 112, 120, 140))
BEAM_TOPS = (56, 57, 54, 55)  # by phase
LONG_TOPS = (57, 54, 55, 56)
BEAM_ENDS = (93, 90, 91, 92)
SHORT = ~((BEAM_X > 44) & (BEAM_X < 112))
IS_LONG = (BEAM_X > 16) & (BEAM_X < 140)

SCREEN_BASE = 308  # row of the screen for `y` 0
LADDER_TOP = 254  # `y` at the top of all ladders
LADDER_FOOT = 134  # `y` at the foot of all ladders
TOP_FLOOR = 235  # least `y` on the floor of a room with doors
NO_JUMP = 128  # least `jump` without a jump
DOOR_ROOMS = (1, 17)
DOOR_SIDES = np.array((14, 24, 130, 140))  # `x` west and east of each door
BLOCKS_EAST = np.array((True, False, True, False))  # sides that stop him on his way east
WESTS = ROM.bytes(0x1F56, 12).tolist()  # the floors' limits
EASTS = ROM.bytes(0x1F62, 12).tolist()
ARC = [v - 256 if v > 127 else v for v in ROM.bytes(FC00 + 0x247, 20).tolist()]  # of a jump

NOTHING = np.zeros(1, np.int32)
OFFSETS = {  # of the things' pictures
    Thing.RUBY: D000 + 0x136,
    Thing.SWORD: FC00 + 0x13E,
    Thing.AMULET: FC00 + 0x14E,
    Thing.KEY: FC00 + 0x12E,
    Thing.SKULL: D000 + 0x217,
    0x68: FC00 + 0x168,
    Thing.FLAME: D000 + 0x20A,
    0xEE: D000 + 0x1EE,
    0xFC: D000 + 0x1FC,
    0x47: D000 + 0x147,
    0x57: D000 + 0x157,
}


def _rows_of(offset: int) -> np.ndarray:
    """Rows of a picture up to the first empty row."""
    rows = ROM.rows(offset, 20, top_first=True)
    return rows * (np.cumsum(rows == 0) == 0)


THINGS = Pictures.of(_rows_of(OFFSETS[p]) if p in OFFSETS else NOTHING for p in range(256))
ROLLS = ROM.bytes(FC00 + 0x1A3, 16, step=2)
ROLLING = Pictures.of(_rows_of(D000 + 0x200 + p) if p in ROLLS else NOTHING for p in range(256))
SINKS = ROM.bytes(D000 + 0x2F1, 16).tolist()  # rows down of a rolling skull
POSES = (  # the explorer's pictures
    *(0x03E, 0x075, 0x07B, 0x0A5, 0x000),
    *(0x03E, 0x052),  # pairs of alternating pictures
    *(0x07B, 0x090),
    *(0x000, 0x02A),
    *(0x0BA, 0x0C9),
    *(0x0E7, 0x0FD),
    *(0x2C8, 0x2DD),
)
UPRIGHT = 4  # the picture of a dead explorer, whatever `picture` is
FIRST_PAIR = 5
FIRSTS = {low & 255: i if i < FIRST_PAIR else (i - 1) // 2 * 2 + 1 for i, low in enumerate(POSES)}
PAIR = [FIRSTS.get(low, 0) for low in range(256)]  # the first picture, by low byte
SECOND = tuple(p & 255 for p in POSES[6::2])  # low bytes of the others
LIFTS = ROM.bytes(0xFEF, len(POSES)).tolist()  # rows down of each
EXPLORERS = Pictures.of(_rows_of(D000 + p) if p != Picture.GONE else NOTHING for p in POSES)


def decode(m: Ram) -> dict[str, Box]:
    drawn = m.dark != Dark.BLANK
    torch = m.things >= TORCH_BIT
    lit = drawn & ((m.room < BONUS) | (torch & (m.room != BONUS)))
    copies = _thing_boxes(m)
    carried = _carried_boxes(m)
    thing = copies.where(drawn & ((m.room < HIDDEN) | torch))
    return {
        "Player": _explorer_box(m).where(drawn),
        "Skull": _skulls(m, copies).where(drawn),
        "Snake": thing.where(among(m.thing, Thing.SNAKES)),
        "Spider": copies.where(drawn & among(m.thing, Thing.SPIDERS))[:1],
        "Ruby": thing.where(m.thing == Thing.RUBY),
        "Key": thing.where(m.thing == Thing.KEY)[:1],
        "Sword": thing.where(m.thing == Thing.SWORD)[:1],
        "Amulet": thing.where(m.thing == Thing.AMULET)[:1],
        "Torch": thing.where(among(m.thing, Thing.TORCHES))[:1],
        "Beam": _beams(m).where(drawn),
        "Rope": _rope_boxes(m).where(drawn),
        **room_parts(m, drawn, lit),
        "Torch_HUD": carried[:1],
        "Sword_HUD": carried[1:3],
        "Key_HUD": carried[3:7],
        "Amulet_HUD": carried[7:],
        "Life": RESERVE.box(m.lives, value=m.lives + 1),
        "Score": SCORE.box(m.score),
    }


def _thing_boxes(m: Ram) -> Box:
    """The thing or monster of the room, in up to three copies."""
    number = registers.copies(m.copies)
    copy = np.arange(3)
    x = registers.wrap(m.thing_x - 1 + copy * registers.spacing(m.copies))
    base = match(
        (m.room == 1, 353),
        ((m.room == 14) & (m.thing_y < 216), 312),
        (m.room == 0, 310),
        (among(m.room, LOWER_ROOMS), 309),
        otherwise=308,
    )
    top = base - m.thing_y + when(m.thing == Thing.FLAME, 5)
    return THINGS.box(m.thing, x, top, valid=copy < number).clip(0, 0, 160, 210)


def _skulls(m: Ram, copies: Box) -> Box:
    return choose(np.arange(3) == 2, _rolling_skull(m), copies.where(m.thing == Thing.SKULL))


def _rolling_skull(m: Ram) -> Box:
    """The rolling skull of some rooms."""
    x = m.skull_x + jnp.where(m.room == FAR_ROOM, -1, 32)
    y = pick(m.room, SKULL_BASES) - m.skull_y + pick(m.roll, SINKS)
    there = (m.rolling != Picture.GONE) & among(m.room, SKULL_ROOMS)
    return ROLLING.box(m.rolling, x, y, valid=there, mirrored=m.turned != 0)


def _rope_boxes(m: Ram) -> Box:
    left, top, _, bottom = np.array(ROPES).T
    return box(left, top, 1, bottom - top, m.room == np.array(ROPE_ROOMS))


def _beams(m: Ram) -> Box:
    """The beams, lit on every fourth row; by the columns of all rooms."""
    long = m.room == LONG_BEAMS
    phase = m.left_door - Picture.FIRST_BEAM
    columns = jnp.where(long, IS_LONG, among(m.room, BEAM_ROOMS) & SHORT)
    top = pick(phase + when(long, 4), (*BEAM_TOPS, *LONG_TOPS))
    bottom = pick(phase, BEAM_ENDS) + when(long, 1)
    return box(BEAM_X, top, 4, bottom - top, among(phase, range(4)) & columns)


def _carried_boxes(m: Ram) -> Box:
    """The objects that the explorer carries, from the left, by bit of `things`."""
    bit = (m.things >> np.arange(7, -1, -1)) & 1
    rank = jnp.cumsum(bit) - bit
    keys = (Thing.KEY,) * 4
    kinds = jnp.array((Thing.TORCHES[0], Thing.SWORD, Thing.SWORD, *keys, Thing.AMULET))
    return THINGS.box(kinds, 56 + 8 * rank, 28, valid=(bit == 1) & (rank < 6))


class Stick(NamedTuple):
    """The joystick's directions, bool each."""

    up: jax.Array
    down: jax.Array
    left: jax.Array
    right: jax.Array


def _explorer_box(m: Ram) -> Box:
    """The explorer, before the step that he has taken after the room was drawn."""
    stick = Stick(*((m.stick >> bit & 1) == 0 for bit in range(4)))
    y = m.y - _rows_up(m, stick)
    walked_x = m.x - _columns_east(m, stick)
    x = walked_x + _carried_west(m, walked_x)
    pose = _drawn_pose(m)
    top = SCREEN_BASE + when(among(m.room, LOWER_ROOMS), 1) - y + pick(pose, LIFTS)
    return EXPLORERS.box(pose, x - 1, top, mirrored=m.mirrored)


def _rows_up(m: Ram, stick: Stick) -> jax.Array:
    """Rows that the step has lifted him."""
    falls = (m.state == State.FALLS) & (m.pose != Pose.STRIDES)
    return match(
        (_in_mid_air(m), pick(m.jump + 1, ARC)),
        (_has_landed(m), ARC[0]),
        (_climbs(m, stick), jnp.where(stick.up, 1, -1)),
        (falls, -2),
        otherwise=0,
    )


def _in_mid_air(m: Ram) -> jax.Array:
    return among(m.state, (State.PLAYS, State.EXITS)) & (m.jump < len(ARC) - 1)


def _has_landed(m: Ram) -> jax.Array:
    return (m.picture == Picture.JUMP) & (m.pose == Pose.STANDS)


def _climbs(m: Ram, stick: Stick) -> jax.Array:
    """True if he has climbed a row; at the ends of a ladder he stands still."""
    on_ladder = (m.state == State.PLAYS) & among(m.pose, (Pose.CLIMBS, Pose.SWINGS))
    aside = stick.left | stick.right | (m.jump < NO_JUMP)
    free = jnp.where(stick.up, m.y != LADDER_TOP, stick.down & (m.y != LADDER_FOOT))
    return on_ladder & ~aside & free


def _columns_east(m: Ram, stick: Stick) -> jax.Array:
    """Columns that he has walked, leapt or drifted to the east."""
    plays = m.state == State.PLAYS
    falls = m.state == State.FALLS
    strides = (m.pose == Pose.STRIDES) & (stick.left | stick.right)
    leaps = plays & _in_mid_air(m) & (m.leap == Leap.ASIDE)
    walks = (plays | falls) & strides & (m.jump >= NO_JUMP)
    drifts = falls & m.drifts & _even_frame(m) & ~_has_landed(m)
    stopped = _at_floor_end(m) | _at_door(m, leaps)
    return when((leaps | walks | drifts) & ~stopped, jnp.where(m.west, -1, 1))


def _at_floor_end(m: Ram) -> jax.Array:
    return jnp.where(m.west, m.x < pick(m.floor, WESTS), m.x >= pick(m.floor, EASTS))


def _at_door(m: Ram, leaps: jax.Array) -> jax.Array:
    """True if a shut door stops him; the left door's state counts for both."""
    shut = among(m.room, DOOR_ROOMS) & (m.left_door == Picture.DOOR) & (m.y >= TOP_FLOOR)
    towards = jnp.where(BLOCKS_EAST, ~m.west, m.west) | leaps
    return shut & jnp.any((m.x == DOOR_SIDES) & towards)


def _carried_west(m: Ram, x: jax.Array) -> jax.Array:
    """The column that a conveyor belt carries him on every second frame."""
    in_room_1 = (m.room == 1) & among(x, range(55, 99)) & among(m.y, range(187, 197))
    in_room_5 = (m.room == 5) & among(x, range(56, 100)) & (m.y == TOP_FLOOR)
    return when((in_room_1 | in_room_5) & (m.state == State.PLAYS) & _even_frame(m), 1)


def _even_frame(m: Ram) -> jax.Array:
    return (m.clock & 1) == 0


def _drawn_pose(m: Ram) -> jax.Array:
    """The drawn picture. Two pictures alternate in most poses; then it is the previous one."""
    first = jnp.where(m.tune == Tune.JUST_DIED, UPRIGHT, lookup(PAIR, m.picture))
    alternate = (first >= FIRST_PAIR) & ((m.pose >= Pose.CLIMBS) | among(m.picture, SECOND))
    return first + when(alternate, (m.clock - 1) >> 2 & 1)


def _no_lone_runs(mask: Bitmap, planes: jax.Array) -> Bitmap:
    """The pixels without single rows: doors consist of such rows, in the key's colour.

    Without this filter, VEM searches each row for a key, and a frame takes 43 us instead of 31.
    """
    return mask & ~LoneRuns()(mask, planes)


SUIT = 70
SKIN = 250
GRAY = 8
EXPLORER = Bounds((*EXPLORER_COLORS, GRAY), (0, 53, 160, 197), exclude=("Amulet",))
on_ground = functools.partial(Blobs, region=(0, 53, 160, 181), shapes=Shape(w=(5, 8), h=(7, 15)))
treasure = functools.partial(Blobs, GOLD, (56, 28, 104, 43))
RAYS = Bounds(FORCE_COLOR, tuple((x, 54, x + 4, 94) for x in BEAM_X.tolist()), min_size=(4, 5))
item = functools.partial(display, attributes=(), doc="carried")
PART_RGB = dict.fromkeys(PARTS_BY_CATEGORY, (66, 158, 130)) | {"Barrier": (232, 204, 99)}
GAME = Game(
    name="MontezumaRevenge",
    rom=ROM,
    ram=Ram,
    decode=decode,
    terrain=TERRAIN,
    checks=Checks(
        rare=("Amulet", "Beam", "Disappearing_Platform", "Ruby", "Snake", "Spider"),
        terrain_differs=60,  # pictures of edited states show parts of the room before
    ),
    variants=Variants(
        starts={
            "room=5": "room 5",
            "room=10": "room 10",
        },
    ),
    categories=(
        Category("Player", EXPLORER, rgb=(200, 72, 72), role="player", doc="the explorer"),
        Category("Skull", on_ground(14), count=3, doc="hopping, or rolling (the last slot)"),
        Category("Snake", on_ground(10), count=3, doc="snakes"),
        Category("Spider", on_ground(200), doc="a spider"),
        Category("Ruby", on_ground(56), count=3, doc="rubies"),
        Category("Key", on_ground(GOLD, filters=(_no_lone_runs,)), doc="a key"),
        Category("Sword", on_ground(12), doc="a sword"),
        Category("Amulet", on_ground(SKIN), doc="an amulet"),
        Category("Torch", on_ground(236), doc="a torch"),
        Category("Beam", RAYS, count=10, doc="beams, by columns"),
        Category("Rope", Bounds((GOLD, 14), ROPES, min_size=(1, 15)), count=4, doc="by room"),
        *(Category(n, r, r.slots, rgb=PART_RGB[n], doc=n) for n, r in RULES.items()),
        item("Torch_HUD", treasure(shapes=Shape(w=(1, 6), h=(1, 13)))),
        item("Sword_HUD", treasure(shapes=Shape(w=6, h=(14, 15), pixels=(30, 44))), count=2),
        item("Key_HUD", treasure(shapes=Shape(w=7, h=15)), count=4),
        item("Amulet_HUD", treasure(shapes=Shape(w=6, h=(14, 15), pixels=(45, 60)))),
        display(
            "Life",
            RESERVE.rule((SKIN, SUIT), (56, 15, 104, 20), single=2),
            role="lives",
            doc="one more than the icons",
        ),
        display("Score", SCORE.rule(14), role="score", doc="points"),
    ),
)
