"""Kangaroo: a mother climbs floors and ladders to her child while monkeys throw coconuts.

Screen: the player's box has her fist in it. Of three or four monkeys one above the other, each is
drawn on every third or fourth frame. Nothing is valid on the title screen, which follows the last
life. The walls and the dashes on the left one are scenery.

Slots: Platform has the floors and steps of a level from the top, Ladder a slot for each ladder of
the three levels.

RAM: ALE's source (score, lives), OCAtari 2.2 (what the bytes are) and the ROM's code. The coconut
that falls moves before a frame is drawn; the player, the monkeys and the thrown coconuts move after
it, monkeys once in 16 frames. These steps are taken back as far as the counters tell them.

Covered: modes 0 and 1, deaths, the end of the game, and all three levels with the scenes that end
them. Random play shows the first one; the others were reached by writing RAM.

Not exact, because it is not in the RAM: whether the player has just stepped, turned or steered a
jump to the side, and whether a jump, a crouch or a climb has just ended, for the joystick is
nowhere noted. New points show a frame late.

VEM: it does not see the wood in the frames in which it flashes black.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.ops import lookup, match, when
from ocjax.extraction.game import Category, Game, display
from ocjax.extractors._kangaroo import EMPTY, ROM, Pose, Ram, Scene, player_drawn
from ocjax.vision.displays import IconRow, NumberDisplay
from ocjax.vision.rules import Blobs, Bounds, Run, Runs
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Packed

BANK = 0x1000  # offset of the second bank
FONT = ROM.font(0xB00, rows=7, stride=8)
CLOCK_FONT = ROM.font(0xD00, rows=5, stride=8, dots=4, pitch=4)

SCORE = NumberDisplay(FONT, right=145, top=183, digits=6)
HUNDREDS = NumberDisplay(FONT, right=129, top=183, digits=4)  # of the score
TIME = NumberDisplay(CLOCK_FONT, right=95, top=191, digits=4)
RESERVE = IconRow(left=16, top=183, width=4, height=7, pitch=8)

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
EAST = 4
WEST = 12
LEVELS = 3
ROWS = 22  # of the screen
ROW = 8  # lines
RUNG = 8  # columns
FIST = 2  # columns
MOST_PLATFORMS = 20  # of a level
START_LIVES = 2  # `lives` at the start
START_TENS = 2  # `tens` at the start of a life
GAME_OVER = 128  # from here on, `lives` are none
BLANK_DIGIT = 10


class MonkeyState:  # of `Ram.monkey_state`; the first two of its lower four bits
    DESCENDS = 1
    WALKS = 4
    SECOND = 16  # bit of a second picture
    BACK = 32  # bit


WALK_1 = 67  # pictures of monkeys that go left
WALK_2 = 100
WALKS_RIGHT = 16  # those to the right follow them
CHILD_X = ROM.bytes(BANK + 0xD8F, 8)
PRIZE_ROW = ROM.bytes(BANK + 0xFA3, 24).reshape(4, 6)[:, :3]  # by prize and level
PRIZE_X = ROM.bytes(BANK + 0xFA6, 24).reshape(4, 6)[:, :3]
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


def decode(m: Ram) -> dict[str, Box]:
    boxes = {
        "Player": _player(m),
        "Child": _child(m),
        "Monkey": _monkeys(m),
        "FallingCoconut": _falling(m),
        "ThrownCoconut": _thrown(m),
        "Bell": _prize(m, 0, 1, m.bell[None])[0],
        "Fruit": _prize(m, 1, 4, m.fruits),
        "Platform": _floors(m),
        "Ladder": _ladder_boxes(m),
        "Score": _score(m),
        "Lives": RESERVE.box(m.lives, value=m.lives + 1),
        "Time": _time(m),
    }
    return {name: b.where(m.lives < GAME_OVER) for name, b in boxes.items()}


def _floors(m: Ram) -> Box:
    packed = _level(m, PLATFORMS)
    return box(packed & 255, packed >> 16, packed >> 8 & 255, 4)


def _ladder_boxes(m: Ram) -> Box:
    x, y, w, h = LADDERS.T
    return box(x, y, w, h, m.level == LADDER_LEVEL)


def _level(m: Ram, table: np.ndarray) -> jax.Array:
    """What a table by level has for this one."""
    chosen = (np.arange(LEVELS) == m.level).reshape(LEVELS, *[1] * (table.ndim - 1))
    return jnp.sum(when(chosen, table), axis=0)


def _prize(m: Ram, first: int, last: int, state: jax.Array) -> Box:
    """The bell or the fruits, which are at fixed places of a level."""
    row, x = (_level(m, table[first:last].T) for table in (PRIZE_ROW, PRIZE_X))
    picture = lookup(PRIZE_PICTURES, (4 if first > 0 else 0) + (state & 3))
    return PRIZES.box(picture, x + 15, ROW * row + 4, valid=state < EMPTY)


def _life_begins(m: Ram) -> jax.Array:
    """Whether this is the first frame of a life."""
    return (m.clock == 0) & (m.tens == START_TENS)


def _next_life(m: Ram) -> jax.Array:
    """Whether this is the first frame of a life that is not the first one."""
    return _life_begins(m) & ((m.lives < START_LIVES) | (m.score > 0))


def _child(m: Ram) -> Box:
    """The child, which walks to and fro, and stands still when the player has come."""
    begins = _life_begins(m) & ~_next_life(m)
    clock = jnp.where(begins, 0, m.clock - 1)
    step = jnp.where((m.scene & Scene.FOUND) > 0, 6, clock >> 4 & 7)
    return box(lookup(CHILD_X, step) + 15, 12, 8, 15)


def _monkeys(m: Ram) -> Box:
    state, acts = m.monkey_state, m.scene < EMPTY
    kind, back = state & 15, (state & MonkeyState.BACK) > 0
    walks = kind == MonkeyState.WALKS
    moved = ((m.clock & 15) == 0) & acts
    step = when(walks, jnp.where(back, -3, 3))
    climb = when(kind == MonkeyState.DESCENDS, jnp.where(back, -1, 1))
    climbed = moved | (((m.clock & 15) == 8) & acts & back)
    x = m.monkey_x - when(moved, step)
    row = (m.monkey_row - when(climbed, climb)) & 255
    first = jnp.where((state & MonkeyState.SECOND) > 0, WALK_1, WALK_2)
    walked = first + jnp.where(back, 0, WALKS_RIGHT)
    picture = jnp.where(moved & walks, walked, m.monkey_picture)
    return MONKEYS.box(picture, x + 15, ROW * row + 4, valid=(state < EMPTY) & (row < ROWS))


def _thrown(m: Ram) -> Box:
    moved = ((m.clock & 1) == 1) & (m.scene < EMPTY)
    x = m.thrown_x + jnp.where(moved, 16, 14)
    there = (m.thrown_state < EMPTY) & (m.thrown_row < ROWS)
    return box(x, ROW * m.thrown_row + 1, 2, 3, there)


def _falling(m: Ram) -> Box:
    """The coconut that falls. Beside a sprite of the other kind the game switches it on late."""
    row, x = m.falling_row - ROWS * m.level, m.falling_x + 14
    there = (m.falling_row < EMPTY) & (row >= 0) & (row < ROWS)
    drawn = player_drawn(m)
    starts = jnp.concatenate([_level(m, PRIZE_ROW.T), jnp.stack([jnp.int32(1), drawn.row])])
    visible = jnp.concatenate([m.bell[None], m.fruits, jnp.zeros(2, jnp.int32)]) < EMPTY
    heights = jnp.where(np.arange(6) == 5, lookup(POSE_ROWS, drawn.pose & 7), 2)
    beside = jnp.any(visible & (starts <= row) & (row < starts + heights))
    late = when(beside & (x < 20), 1)
    return box(x, ROW * row + 9 + late, 2, 3 - late, there).clip(*FIELD)


def _player(m: Ram) -> Box:
    """The player. She is not valid below the screen and on the first frame of the next life."""
    drawn = player_drawn(m)
    right, punches = (drawn.pose & Pose.RIGHT) > 0, drawn.pose >= Pose.PUNCHES
    first, top, width, height = POSES.extent(drawn.pose & 15)
    left = first - when(punches & ~right, FIST)
    end = first + width + when(punches & right, FIST)
    x, y = drawn.x + 15 + left, ROW * drawn.row + 4 + top
    player = box(x, y, end - left, height, orientation=jnp.where(right, EAST, WEST))
    return player.where(~_next_life(m)).clip(0, 4, 160, 180)


def _score(m: Ram) -> Box:
    """The score. Its last two digits are always noughts."""
    zero = HUNDREDS.right + int(FONT.left[0])
    left = jnp.where(m.score == 0, zero, HUNDREDS.box(m.score).x)
    right = SCORE.right - FONT.width + int(FONT.right[0])
    return box(left, SCORE.top, right - left, FONT.height, value=100 * m.score)


def _time(m: Ram) -> Box:
    tens, ones = (jnp.where(d < BLANK_DIGIT, d, 0) for d in (m.tens, m.ones))
    left = match((m.tens < BLANK_DIGIT, 80), (m.ones < BLANK_DIGIT, 84), otherwise=88)
    return box(left, TIME.top, 95 - left, CLOCK_FONT.height, value=1000 * tens + 100 * ones)


# The wood flashes at the end of the third level. A climbing player hides rungs of long ladders.
WOODEN = tuple(c for c in range(1, 128) if c & 244 == c != SKY)
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
ICONS = RESERVE.rule(DIGITS, (16, 183, 80, 190), single=2)

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
        display("Score", SCORE.rule(DIGITS), doc="points"),
        display("Lives", ICONS, doc="lives left but the last one"),
        display("Time", TIME.rule(DIGITS), doc="time left"),
    ),
)
