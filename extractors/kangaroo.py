"""Kangaroo: a mother climbs floors and ladders to her child while monkeys throw coconuts.

Platform has the floors and steps of a level from the top, Ladder a slot for each ladder of the
three levels. The player's box has her fist in it. The walls and the dashes on the left one are
scenery. Nothing is valid on the title screen, which follows the last life.

RAM: ALE's source (score, lives), OCAtari 2.2 (what the bytes are) and the ROM's code. The coconut
that falls moves before a frame is drawn; the player, the monkeys and the thrown coconuts move after
it, monkeys once in 16 frames. `decode` undoes these steps as far as the counters tell them.

Covered: modes 0 and 1, deaths, the end of the game, and all three levels with the scenes that end
them. Random play shows the first one; the others were reached by writing RAM.
Not in RAM: whether the player has just stepped, turned or steered a jump to the side, and whether a
jump, a crouch or a climb has just ended, for the joystick is nowhere noted. New points show a frame
late.
Of three or four monkeys one above the other, each is drawn on every third or fourth frame. VEM does
not see the wood in the frames in which it flashes black.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import lookup
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.rom import Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Blobs, Bounds, Gauge, Run, Runs
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Packed

ROM = Rom("kangaroo", "4326edb70ff20d0ee5ba58fa5cb09d60")
BANK = 0x1000  # offset of the second bank
FONT = ROM.font(0xB00, rows=7, stride=8)
CLOCK_FONT = ROM.font(0xD00, rows=5, stride=8, dots=4, pitch=4)

WOOD_RGB = (162, 98, 33)
WOOD = 36
FUR = 44
BELL = 42
STRAWBERRY = 72
PINEAPPLE = 40
MONKEY = 58
DIGITS = 232
SKY = 96
FIELD = (16, 4, 144, 180)
SCORE_LEFTS = range(97, 145, 8)
SCORE_TOP = 183
SCORE_RIGHT = 145
CLOCK_LEFTS = range(79, 95, 4)
CLOCK_TOP = 191
EAST = 4
WEST = 12
# `ROW`: its lines
LEVELS = 3
ROWS = 22
ROW = 8
START_LIVES = 2  # `lives` at the start
GAME_OVER = 128  # its least value after the end
EMPTY = 128  # least value of bytes that stand for no object
# Bits of `pose`.
STANDING = 0
RIGHT = 8
JUMPS = 64
PUNCHES = 128
# `pose` but for `RIGHT`
CROUCHED = 20
PUNCHING = 134
FIST = 2  # columns
RUNG = 8  # columns
MOST_PLATFORMS = 20  # of a level
# low nibbles of `monkey_state`
DESCENDS = 1
WALKS = 4
WALK_1 = 0x43  # pictures of monkeys that go left
WALK_2 = 0x64  # those to the right follow them
DYING = 1  # values of `scene`
PUNCHED = 2  # the latter until the button is released
CHILD_X = ROM.bytes(BANK + 0xD8F, 8)
PRIZE_ROW, PRIZE_X = (ROM.bytes(BANK + at, 24).reshape(4, 6)[:, :3] for at in (0xFA3, 0xFA6))
PRIZE_PICTURES = ROM.bytes(BANK + 0xF97, 8)  # of the bell, of the fruits
POSE_ROWS = ROM.bytes(BANK + 0xF81, 8)
# The pictures of the player, by the low bits of `pose`, of the bell and the fruits, and of monkeys.
POSE_AT = (ROM.bytes(BANK + 0xE01, 16) & 15) << 8 | ROM.bytes(BANK + 0xDF1, 16)
POSES = ROM.pictures(POSE_AT.tolist(), 2 * (ROW * POSE_ROWS).tolist(), top_first=True)
PRIZES = ROM.pictures(range(0xB00, 0xC00), 16, top_first=True)
MONKEYS = ROM.pictures(range(0xE00, 0xF00), 16, top_first=True)


def _runs(level: int, row: int) -> list[tuple[int, int]]:
    """Left edges and widths of what the playfield shows in a row."""
    at = ROWS * level + row
    parts = [int(ROM.data[offset + at]) for offset in (0xF00, 0xF42, 0xF84, 0xD52)]
    dots = [f"{p:08b}"[::step] for p, step in zip(parts, (1, -1, 1, -1), strict=True)]
    line = np.array([0, *map(int, "".join(dots)), 0])
    starts, ends = np.flatnonzero(np.diff(line) == 1), np.flatnonzero(np.diff(line) == -1)
    return [(16 + 4 * a, 4 * (b - a)) for a, b in zip(starts.tolist(), ends.tolist(), strict=True)]


def _platforms(level: int) -> list[int]:
    """A level's floors and steps: left edges, widths and tops above them; 0 for those it lacks."""
    rows = ((4 + ROW * row, run) for row in range(ROWS) for run in _runs(level, row))
    wide = [x | w << 8 | y << 16 for y, (x, w) in rows if w > RUNG]
    return wide + [0] * (MOST_PLATFORMS - len(wide))


def _ladders(level: int) -> list[tuple[int, ...]]:
    """Boxes of a level's ladders, whose rungs lie in successive rows."""
    rungs = [(row, x) for row in range(ROWS) for x, w in _runs(level, row) if w == RUNG]
    tops = [(row, x) for row, x in rungs if (row - 1, x) not in rungs]
    last = [next(r for r in range(row, ROWS) if (r + 1, x) not in rungs) for row, x in tops]
    ends = zip(tops, last, strict=True)
    return [(x, 4 + ROW * row, RUNG, ROW * (end - row) + 4) for (row, x), end in ends]


PLATFORMS = np.array([_platforms(level) for level in range(LEVELS)])
LADDERS = np.array([ladder for level in range(LEVELS) for ladder in _ladders(level)])
LADDER_LEVEL = np.repeat(np.arange(LEVELS), [len(_ladders(level)) for level in range(LEVELS)])


class Ram(RamMap):
    monkey_picture = byte(0, 1, 2, 3)  # low byte of its address
    monkey_state = byte(4, 5, 6, 7)
    monkey_row = byte(8, 9, 10, 11)
    monkey_x = byte(12, 13, 14, 15)  # x + 15
    row = byte(16)  # of the player's top
    x = byte(17)  # x - 15
    pose = byte(18)
    timer = byte(19)  # of the pose
    thrown_state = byte(21, 22, 23)
    thrown_row = byte(25, 26, 27)
    thrown_x = byte(28, 29, 30)  # x - 14
    falling_row = byte(33)  # counts the rows of all levels
    falling_x = byte(34)  # x - 14
    level = byte(36)
    score = bcd((39, 40))  # hundreds
    bell = byte(41)
    fruits = byte(42, 43, 44)
    lives = byte(45)
    scene = byte(54)
    clock = byte(57)
    tens = bits(59, first=4, count=4)  # of the time in hundreds; 10 stands for a blank
    ones = bits(59, count=4)
    third = byte(60)  # 0-2; the player steps at 0
    fire = byte(124)  # 128 or more: the button is not pressed


def decode(m: Ram) -> dict[str, Box]:
    platforms, (x, y, w, h) = _level(m, PLATFORMS), LADDERS.T
    boxes = {
        "Player": _player(m),
        "Child": _child(m),
        "Monkey": _monkeys(m),
        "FallingCoconut": _falling(m),
        "ThrownCoconut": _thrown(m),
        "Bell": _prize(m, 0, 1, m.bell[None])[0],
        "Fruit": _prize(m, 1, 4, m.fruits),
        "Platform": box(platforms & 255, platforms >> 16, platforms >> 8 & 255, 4),
        "Ladder": box(x, y, w, h, m.level == LADDER_LEVEL),
        "Score": _score(m),
        "Lives": box(16, 183, 8 * m.lives - 4, 7, m.lives > 0, value=m.lives + 1),
        "Time": _time(m),
    }
    return {name: b.where(m.lives < GAME_OVER) for name, b in boxes.items()}


def _level(m: Ram, table: np.ndarray) -> jax.Array:
    """What a table by level has for this one."""
    chosen = (np.arange(LEVELS) == m.level).reshape(LEVELS, *[1] * (table.ndim - 1))
    return jnp.sum(jnp.where(chosen, table, 0), axis=0)


def _prize(m: Ram, first: int, last: int, state: jax.Array) -> Box:
    """The bell or the fruits, which are at fixed places of a level."""
    row, x = (_level(m, table[first:last].T) for table in (PRIZE_ROW, PRIZE_X))
    picture = lookup(PRIZE_PICTURES, jnp.where(first > 0, 4, 0) + (state & 3))
    return PRIZES.box(picture, x + 15, ROW * row + 4, valid=state < EMPTY)


def _next_life(m: Ram) -> jax.Array:
    """Whether this is the first frame of a life that is not the first one."""
    return (m.clock == 0) & (m.tens == 2) & ((m.lives < START_LIVES) | (m.score > 0))


def _child(m: Ram) -> Box:
    """The child, which walks to and fro, and stands still when the player has come."""
    begins = (m.clock == 0) & (m.tens == 2) & ~_next_life(m)
    clock = jnp.where(begins, 0, m.clock - 1)
    step = jnp.where((m.scene & 64) > 0, 6, clock >> 4 & 7)
    return box(lookup(CHILD_X, step) + 15, 12, 8, 15)


def _monkeys(m: Ram) -> Box:
    state, acts = m.monkey_state, m.scene < EMPTY
    kind, back = state & 15, (state & 32) > 0
    moved = ((m.clock & 15) == 0) & acts
    step = jnp.where(kind == WALKS, jnp.where(back, -3, 3), 0)
    climb = jnp.where(kind == DESCENDS, jnp.where(back, -1, 1), 0)
    climbed = moved | (((m.clock & 15) == 8) & acts & back)
    x = m.monkey_x - jnp.where(moved, step, 0)
    row = (m.monkey_row - jnp.where(climbed, climb, 0)) & 255
    there = (state < EMPTY) & (row < ROWS)
    walked = jnp.where((state & 16) > 0, WALK_1, WALK_2) + jnp.where(back, 0, 16)
    picture = jnp.where(moved & (kind == WALKS), walked, m.monkey_picture)
    return MONKEYS.box(picture, x + 15, ROW * row + 4, valid=there)


def _thrown(m: Ram) -> Box:
    moved = ((m.clock & 1) == 1) & (m.scene < EMPTY)
    x = m.thrown_x + jnp.where(moved, 16, 14)
    there = (m.thrown_state < EMPTY) & (m.thrown_row < ROWS)
    return box(x, ROW * m.thrown_row + 1, 2, 3, there)


def _falling(m: Ram) -> Box:
    """The coconut that falls. Beside a sprite of the other kind the game switches it on late."""
    row, x = m.falling_row - ROWS * m.level, m.falling_x + 14
    there = (m.falling_row < EMPTY) & (row >= 0) & (row < ROWS)
    _, player_row, pose = _player_drawn(m)
    starts = jnp.concatenate([_level(m, PRIZE_ROW.T), jnp.stack([jnp.int32(1), player_row])])
    visible = jnp.concatenate([m.bell[None], m.fruits, jnp.zeros(2, jnp.int32)]) < EMPTY
    heights = jnp.where(np.arange(6) == 5, lookup(POSE_ROWS, pose & 7), 2)
    beside = jnp.any(visible & (starts <= row) & (row < starts + heights))
    late = jnp.where(beside & (x < 20), 1, 0)
    return box(x, ROW * row + 9 + late, 2, 3 - late, there).clip(*FIELD)


def _player(m: Ram) -> Box:
    """The player. She is not valid below the screen and on the first frame of the next life."""
    x, row, pose = _player_drawn(m)
    right = (pose & RIGHT) > 0
    first, top, width, height = POSES.extent(pose & 15)
    punches = pose >= PUNCHES
    left = first - jnp.where(punches & ~right, FIST, 0)
    end = first + width + jnp.where(punches & right, FIST, 0)
    facing = jnp.where(right, EAST, WEST)
    player = box(x + 15 + left, ROW * row + 4 + top, end - left, height, orientation=facing)
    return player.where(~_next_life(m)).clip(0, 4, 160, 180)


def _player_drawn(m: Ram) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Where the player was drawn, and in what pose.

    A jump goes up and down by its timer; it, a crouch and a punch begin with the timer at 1 or 13.
    A punch has just ended if the game has not yet noticed that the button is released.
    """
    pose, timer = m.pose, m.timer
    acts, dies, still = m.scene < EMPTY, m.scene == DYING, pose & RIGHT
    jumps = (pose >= JUMPS) & (pose < PUNCHES)
    crouches, walks = (pose & ~RIGHT) == CROUCHED, (pose & ~(RIGHT | 1)) == STANDING
    rose = jumps & ((timer == 8) | (timer == 24))
    fell = (jumps & ((timer == 32) | (timer == 40))) | (crouches & (timer == 1))
    row = m.row + jnp.where(rose, 1, 0) - jnp.where(fell | (dies & (timer == 4)), 1, 0)
    tucks = jnp.where(timer == 16, pose - 1, jnp.where(timer == 24, pose + 1, pose))
    began = ((jumps | crouches) & (timer == 1)) | ((pose >= PUNCHES) & (timer == 13))
    released = (m.scene == PUNCHED) & (m.fire >= 128)
    punched = (pose == still) & released & ((m.clock & 1) == 1)
    changed = walks & ((m.clock & 7) == 0)
    drawn = jnp.where(jumps, tucks, jnp.where(changed, pose ^ 1, pose))
    drawn = jnp.where(began, still, jnp.where(punched, still | PUNCHING, drawn))
    drawn = jnp.where(dies & (timer == 4), pose ^ RIGHT, drawn)
    stepped = walks & ((pose | drawn) & 1 == 1) & (m.third == 0) & (m.x != 1) & (m.x != 0x79)
    x = m.x - jnp.where(stepped & ~dies, jnp.where(still > 0, 1, -1), 0)
    return jnp.where(acts, x, m.x), jnp.where(acts, row, m.row), jnp.where(acts, drawn, pose)


def _score(m: Ram) -> Box:
    """The score. Its last two digits are always noughts."""
    number = score_box(FONT, m.score, right=SCORE_RIGHT - 16, top=SCORE_TOP, digits=4)
    left = jnp.where(m.score == 0, SCORE_RIGHT - 16 + int(FONT.left[0]), number.x)
    right = SCORE_RIGHT - 8 + int(FONT.right[0])
    return box(left, SCORE_TOP, right - left, FONT.height, value=100 * m.score)


def _time(m: Ram) -> Box:
    tens, ones = (jnp.where(d < 10, d, 0) for d in (m.tens, m.ones))
    left = jnp.where(m.tens < 10, 80, jnp.where(m.ones < 10, 84, 88))
    return box(left, CLOCK_TOP, 95 - left, CLOCK_FONT.height, value=1000 * tens + 100 * ones)


# The wood flashes at the end of the third level. A climbing player hides rungs of long ladders.
WOODEN = tuple(c for c in range(1, 128) if c & 0xF4 == c != SKY)
RUNG_COLORS = tuple((*WOODEN, FUR) if level == 0 else WOODEN for level in LADDER_LEVEL)
WOODEN_ROWS = tuple((16, y, 144, y + 4) for y in range(4, 180, ROW))  # never hold the coconut
CROUCHING = Blobs(FUR, (0, 28, 160, 180), Shape(w=(4, 12), h=(5, 16)), gap=(1, 1))
BODY = Blobs(FUR, (0, 4, 160, 180), Shape(w=(4, 12), h=(17, 24)), gap=(1, 1), also=(CROUCHING,))
CHILD = Blobs(FUR, (16, 4, 144, 28), Shape(w=(5, 8), h=(12, 16)), gap=(1, 1))
APES = Blobs(MONKEY, (16, 4, 160, 180), Shape(w=(4, 8), h=(8, 16)), gap=(1, 2))
NUTS = Blobs(MONKEY, (16, 4, 160, 180), Shape(w=2, h=(2, 3)))
BALL = Bounds(WOOD, FIELD, ignore=WOODEN_ROWS)
FRUITS = Blobs((STRAWBERRY, PINEAPPLE), FIELD, Shape(w=(3, 8), h=(5, 12)), gap=(1, 1))
FLOORS = Runs(
    tuple(Run(WOODEN, y, left=(16, 143), width=(12, 128), height=4) for y in range(28, 176, ROW)),
    most=2,
    gap=7,
    columns=(16, 144),
    then=(Packed(),),
)
PLACES = tuple((x, y, x + w, y + h) for x, y, w, h in LADDERS.tolist())
# Less than the ladders, which figures cover, and more than what is there in other levels.
HEIGHTS = tuple((RUNG, max(4, h - 4)) for h in LADDERS[:, 3].tolist())
RUNGS = Bounds(RUNG_COLORS, PLACES, HEIGHTS)
ICONS = Bounds(DIGITS, (16, 183, 80, 190), value=Gauge(8, -4, 1))
POINTS = Bounds(DIGITS, (97, 183, 145, 190), value=Digits(FONT, SCORE_LEFTS, SCORE_TOP))
SECONDS = Bounds(DIGITS, (79, 191, 95, 196), value=Digits(CLOCK_FONT, CLOCK_LEFTS, CLOCK_TOP))

GAME = Game(
    name="Kangaroo",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", BODY, attributes=("orientation",), doc="the mother"),
        Category("Child", CHILD, doc="the child"),
        Category("Monkey", APES, count=4, doc="monkeys"),
        Category("FallingCoconut", BALL, doc="a coconut that falls"),
        Category("ThrownCoconut", NUTS, count=3, doc="coconuts that monkeys throw"),
        Category("Bell", Bounds(BELL, (16, 36, 144, 52)), doc="the bell"),
        Category("Fruit", FRUITS, count=3, doc="fruits"),
        Category("Platform", FLOORS, count=MOST_PLATFORMS, rgb=WOOD_RGB, doc="floors and steps"),
        Category("Ladder", RUNGS, count=12, rgb=WOOD_RGB, doc="ladders of the three levels"),
        display("Score", POINTS, doc="points"),
        display("Lives", ICONS, doc="lives left but the last one"),
        display("Time", SECONDS, doc="time left"),
    ),
)
