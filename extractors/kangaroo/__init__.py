"""Kangaroo: a mother climbs floors and ladders to her child while monkeys throw coconuts.

Picture: docs/games/Kangaroo.png

Screen: the walls and the dashes on the left one are scenery. The player's box includes her fist.
Nothing is valid on the title screen, which follows the last life. If three or four monkeys are in
one column, each is drawn on every third or fourth frame.

Slots: Platform has the floors and steps of a level from the top, Ladder a slot for each ladder of
the three levels.

Terrain: the walls, the floors and steps (the objects of Platform), and the rungs of the ladders, by
`level`. The ROM has a table of the rows of each level. The dashes are no part of the wall.
At the end of the third level, the wood has the colour of the background for moments, as it flashes.

RAM: ALE's source (score, lives), OCAtari 2.2 (meaning of the bytes) and the ROM's code. The falling
coconut moves before a frame is drawn. The player, the monkeys (once in 16 frames) and the thrown
coconuts move afterwards. `decode` undoes these steps as far as the counters show them.

Covered: modes 0 and 1, deaths, the end of the game, and all three levels with their final scenes.
Random play shows the first level; the others were reached by writing RAM.

Not exact: the RAM does not keep the joystick. It is therefore unknown whether the player has just
stepped, turned or steered a jump to the side, and whether a jump, a crouch or a climb has just
ended. New points appear a frame late.

VEM: it misses the wood while it flashes black.
"""

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
    IconRow,
    NumberDisplay,
    Packed,
    Run,
    Runs,
    Shape,
    Variants,
    among,
    box,
    display,
    edges,
    lookup,
    match,
    only,
    when,
)
from ocjax.extractors.kangaroo.ram import BANK, GAME_OVER, ROM, Ram
from ocjax.extractors.kangaroo.terrain import (
    FIRST_LINE,
    LADDER_LEVEL,
    LADDERS,
    LEVELS,
    MOST_PLATFORMS,
    PITCH,
    PLATFORMS,
    ROWS,
    RUNG,
    TERRAIN,
    WOODEN,
)

FONT = ROM.font(0xB00, rows=7, stride=8)
CLOCK_FONT = ROM.font(0xD00, rows=5, stride=8, dots=4, pitch=4)

WOOD_RGB = (162, 98, 33)
WOOD = 36
FUR = 44
BELL = 42
STRAWBERRY = 72
PINEAPPLE = 40
MONKEY = 58
DISPLAY_COLOR = 232
FIELD = (16, 4, 144, 180)
SCORE_TOP = 183
SCORE_RIGHT = 145
SCORE = NumberDisplay(FONT, right=SCORE_RIGHT, top=SCORE_TOP, digits=6)
HUNDREDS = NumberDisplay(FONT, right=SCORE_RIGHT - 16, top=SCORE_TOP, digits=4)
LIVES = IconRow(left=16, top=183, width=4, height=7, pitch=8)
CLOCK = NumberDisplay(CLOCK_FONT, right=95, top=191, digits=4)
FIST = 2  # columns
# `x` of a player at a wall, who does not step.
WEST_END = 1
EAST_END = 121

START_LIVES = 2  # `lives` at the start
EMPTY = 128  # least value of bytes without an object
START_TENS = 2  # of the time
BLANK = 10  # least digit of the time that is blank
NOT_PRESSED = 128  # least value of `fire`


class Pose:  # of `Ram.pose`; `RIGHT` and the last two are bits
    STANDING = 0
    CROUCHED = 20
    PUNCHING = 134
    RIGHT = 8
    JUMPS = 64
    PUNCHES = 128


class Timer:  # of `Ram.timer`, when a pose has just begun or moved the player
    BEGINS = 1
    PUNCH_BEGINS = 13
    TURNS_OVER = 4  # in a death
    ROSE = (8, 24)
    FELL = (32, 40)
    TUCKED = 16
    STRETCHED = 24


class Scene:  # of `Ram.scene`; at `EMPTY` or more, nothing moves
    DYING = 1
    PUNCHED = 2  # until the button is released
    SAVED = 64  # bit: the child stands still


class Gait:  # of `Ram.monkey_state`: values of the low nibble, and bits
    DESCENDS = 1
    WALKS = 4
    SECOND_STEP = 16
    BACK = 32


WALK_1 = 67  # pictures of monkeys that go left
WALK_2 = 100
WALK_RIGHT = 16  # added to these for monkeys that go right
SAVED_STEP = 6  # of the child
CHILD_X = ROM.bytes(BANK + 0xD8F, 8)
# By bell or fruit, and level.
PRIZE_ROW = ROM.bytes(BANK + 0xFA3, 24).reshape(4, 6)[:, :3]
PRIZE_X = ROM.bytes(BANK + 0xFA6, 24).reshape(4, 6)[:, :3]
PRIZE_PICTURES = ROM.bytes(BANK + 0xF97, 8)  # of the bell, of the fruits
POSE_ROWS = ROM.bytes(BANK + 0xF81, 8)
# Pictures of the player, by the low bits of `pose`; of the bell and the fruits; of monkeys.
POSE_AT = (ROM.bytes(BANK + 0xE01, 16) & 15) << 8 | ROM.bytes(BANK + 0xDF1, 16)
POSES = ROM.pictures(POSE_AT.tolist(), 2 * (PITCH * POSE_ROWS).tolist(), top_first=True)
PRIZES = ROM.pictures(range(0xB00, 0xC00), 16, top_first=True)
MONKEYS = ROM.pictures(range(0xE00, 0xF00), 16, top_first=True)


def decode(m: Ram) -> dict[str, Box]:
    boxes = {
        "Player": _player_box(m),
        "Child": _child_box(m),
        "Monkey": _monkey_boxes(m),
        "FallingCoconut": _falling(m),
        "ThrownCoconut": _thrown(m),
        "Bell": _prize(m, 0, 1, m.bell[None])[0],
        "Fruit": _prize(m, 1, 4, m.fruits),
        "Platform": _floor_boxes(m),
        "Ladder": _shown_ladders(m),
        "Score": _score_box(m),
        "Lives": LIVES.box(m.lives, value=m.lives + 1),
        "Time": _time(m),
    }
    return {name: b.where(m.lives < GAME_OVER) for name, b in boxes.items()}


def _of_level(m: Ram, table: np.ndarray) -> jax.Array:
    """This level's entry of a table by level."""
    chosen = (np.arange(LEVELS) == m.level).reshape(LEVELS, *[1] * (table.ndim - 1))
    return only(chosen, table, axis=0)


def _floor_boxes(m: Ram) -> Box:
    there = m.level < LEVELS
    return PLATFORMS.at(MOST_PLATFORMS * m.level + np.arange(MOST_PLATFORMS), valid=there)


def _shown_ladders(m: Ram) -> Box:
    x, y, w, h = LADDERS.T
    return box(x, y, w, h, m.level == LADDER_LEVEL)


def _prize(m: Ram, first: int, last: int, state: jax.Array) -> Box:
    """The bell or the fruits, at fixed positions of a level."""
    row = _of_level(m, PRIZE_ROW[first:last].T)
    x = _of_level(m, PRIZE_X[first:last].T)
    picture = lookup(PRIZE_PICTURES, (4 if first > 0 else 0) + (state & 3))
    return PRIZES.box(picture, x + 15, PITCH * row + FIRST_LINE, valid=state < EMPTY)


def _next_life(m: Ram) -> jax.Array:
    """True on the first frame of a life, except the first life."""
    return (m.clock == 0) & (m.tens == START_TENS) & ((m.lives < START_LIVES) | (m.score > 0))


def _child_box(m: Ram) -> Box:
    """The child, which walks to and fro, and stands still when the player has arrived."""
    begins = (m.clock == 0) & (m.tens == START_TENS) & ~_next_life(m)
    last_clock = jnp.where(begins, 0, m.clock - 1)
    step = jnp.where((m.scene & Scene.SAVED) != 0, SAVED_STEP, last_clock >> 4 & 7)
    return box(lookup(CHILD_X, step) + 15, 12, 8, 15)


def _monkey_boxes(m: Ram) -> Box:
    state = m.monkey_state
    acts = m.scene < EMPTY
    kind = state & 15
    back = (state & Gait.BACK) != 0
    moved = ((m.clock & 15) == 0) & acts
    climbed = moved | (((m.clock & 15) == 8) & acts & back)
    step = when(moved & (kind == Gait.WALKS), jnp.where(back, -3, 3))
    climb = when(climbed & (kind == Gait.DESCENDS), jnp.where(back, -1, 1))
    row = (m.monkey_row - climb) & 255
    walked = jnp.where((state & Gait.SECOND_STEP) != 0, WALK_1, WALK_2) + when(~back, WALK_RIGHT)
    picture = jnp.where(moved & (kind == Gait.WALKS), walked, m.monkey_picture)
    x = m.monkey_x - step + 15
    y = PITCH * row + FIRST_LINE
    return MONKEYS.box(picture, x, y, valid=(state < EMPTY) & (row < ROWS))


def _thrown(m: Ram) -> Box:
    moved = ((m.clock & 1) == 1) & (m.scene < EMPTY)
    x = m.thrown_x + jnp.where(moved, 16, 14)
    there = (m.thrown_state < EMPTY) & (m.thrown_row < ROWS)
    return box(x, PITCH * m.thrown_row + 1, 2, 3, there)


def _falling(m: Ram) -> Box:
    """The falling coconut. The game switches it on a line later beside a sprite of another kind."""
    row = m.falling_row - ROWS * m.level
    x = m.falling_x + 14
    there = (m.falling_row < EMPTY) & (row >= 0) & (row < ROWS)
    _, player_row, pose = _player_drawn(m)
    starts = jnp.concatenate([_of_level(m, PRIZE_ROW.T), jnp.stack([jnp.int32(1), player_row])])
    visible = jnp.concatenate([m.bell[None], m.fruits, jnp.zeros(2, jnp.int32)]) < EMPTY
    heights = jnp.where(np.arange(6) == 5, lookup(POSE_ROWS, pose & 7), 2)
    beside = jnp.any(visible & (starts <= row) & (row < starts + heights))
    late = when(beside & (x < 20), 1)
    return box(x, PITCH * row + 9 + late, 2, 3 - late, there).clip(*FIELD)


def _player_box(m: Ram) -> Box:
    """The player; not valid below the screen and on the first frame of the next life."""
    x, row, pose = _player_drawn(m)
    right = (pose & Pose.RIGHT) != 0
    first, top, width, height = POSES.extent(pose & 15)
    punches = pose >= Pose.PUNCHES
    left = first - when(punches & ~right, FIST)
    end = first + width + when(punches & right, FIST)
    facing = jnp.where(right, EAST, WEST)
    y = PITCH * row + FIRST_LINE + top
    player = box(x + 15 + left, y, end - left, height, orientation=facing)
    return player.where(~_next_life(m)).clip(0, 4, 160, 180)


def _player_drawn(m: Ram) -> tuple[jax.Array, jax.Array, jax.Array]:
    """The player's drawn column, row and pose."""
    acts = m.scene < EMPTY
    dies = m.scene == Scene.DYING
    drawn = _pose_drawn(m)
    walks = _is_walking(m)
    right = (m.pose & Pose.RIGHT) != 0
    free = (m.x != WEST_END) & (m.x != EAST_END)
    steps = walks & ((m.pose | drawn) & 1 == 1) & (m.third == 0) & free
    x = m.x - when(acts & steps & ~dies, jnp.where(right, 1, -1))
    return x, m.row - when(acts, _rows_down(m)), jnp.where(acts, drawn, m.pose)


def _jumps(m: Ram) -> jax.Array:
    return (m.pose >= Pose.JUMPS) & (m.pose < Pose.PUNCHES)


def _crouches(m: Ram) -> jax.Array:
    return (m.pose & ~Pose.RIGHT) == Pose.CROUCHED


def _is_walking(m: Ram) -> jax.Array:
    return (m.pose & ~(Pose.RIGHT | 1)) == Pose.STANDING


def _rows_down(m: Ram) -> jax.Array:
    """Rows that the player has moved down since she was drawn."""
    rose = _jumps(m) & among(m.timer, Timer.ROSE)
    fell = _jumps(m) & among(m.timer, Timer.FELL) | _crouches(m) & (m.timer == Timer.BEGINS)
    turned_over = (m.scene == Scene.DYING) & (m.timer == Timer.TURNS_OVER)
    return when(fell | turned_over, 1) - when(rose, 1)


def _pose_drawn(m: Ram) -> jax.Array:
    """The pose before the last step.

    A jump goes up and down by its timer. Jumps and crouches begin with the timer at 1, punches at
    13. A punch has just ended if the game has not yet noticed that the button is released.
    """
    pose = m.pose
    timer = m.timer
    still = m.pose & Pose.RIGHT
    jump_or_crouch = (_jumps(m) | _crouches(m)) & (timer == Timer.BEGINS)
    began = jump_or_crouch | (pose >= Pose.PUNCHES) & (timer == Timer.PUNCH_BEGINS)
    released = (m.scene == Scene.PUNCHED) & (m.fire >= NOT_PRESSED)
    return match(
        ((m.scene == Scene.DYING) & (timer == Timer.TURNS_OVER), pose ^ Pose.RIGHT),
        (began, still),
        ((pose == still) & released & ((m.clock & 1) == 1), still | Pose.PUNCHING),
        (_jumps(m) & (timer == Timer.TUCKED), pose - 1),
        (_jumps(m) & (timer == Timer.STRETCHED), pose + 1),
        (_is_walking(m) & ((m.clock & 7) == 0), pose ^ 1),
        otherwise=pose,
    )


def _score_box(m: Ram) -> Box:
    """The score; its last two digits are always zeros."""
    left = jnp.where(m.score == 0, HUNDREDS.area[2] + int(FONT.left[0]), HUNDREDS.box(m.score).x)
    right = SCORE_RIGHT - 8 + int(FONT.right[0])
    return edges(left, SCORE_TOP, right, SCORE_TOP + FONT.height, value=100 * m.score)


def _time(m: Ram) -> Box:
    tens = when(m.tens < BLANK, m.tens)
    ones = when(m.ones < BLANK, m.ones)
    left = match((m.tens < BLANK, 80), (m.ones < BLANK, 84), otherwise=88)
    _, top, right, bottom = CLOCK.area
    return edges(left, top, right, bottom, value=1000 * tens + 100 * ones)


# The wood flashes at the end of the third level. A climbing player hides rungs of long ladders.
RUNG_COLORS = tuple((*WOODEN, FUR) if level == 0 else WOODEN for level in LADDER_LEVEL)
# Rows of wood, to be ignored for the coconut.
WOODEN_ROWS = tuple((16, y, 144, y + 4) for y in range(FIRST_LINE, 180, PITCH))
CROUCHING = Blobs(FUR, (0, 28, 160, 180), Shape(w=(4, 12), h=(5, 16)), gap=(1, 1))
BODY = Blobs(FUR, (0, 4, 160, 180), Shape(w=(4, 12), h=(17, 24)), gap=(1, 1), also=(CROUCHING,))
CHILD = Blobs(FUR, (16, 4, 144, 28), Shape(w=(5, 8), h=(12, 16)), gap=(1, 1))
APES = Blobs(MONKEY, (16, 4, 160, 180), Shape(w=(4, 8), h=(8, 16)), gap=(1, 2))
NUTS = Blobs(MONKEY, (16, 4, 160, 180), Shape(w=2, h=(2, 3)))
BALL = Bounds(WOOD, FIELD, ignore=WOODEN_ROWS)
FRUITS = Blobs((STRAWBERRY, PINEAPPLE), FIELD, Shape(w=(3, 8), h=(5, 12)), gap=(1, 1))
FLOORS = Runs(
    tuple(Run(WOODEN, y, left=(16, 143), width=(12, 128), height=4) for y in range(28, 176, PITCH)),
    most=2,
    gap=7,
    columns=(16, 144),
    then=(Packed(),),
)
PLACES = tuple((x, y, x + w, y + h) for x, y, w, h in LADDERS.tolist())
# Lower than the ladders, which figures cover, and higher than other objects of other levels.
RUNG_HEIGHTS = tuple((RUNG, max(4, h - 4)) for h in LADDERS[:, 3].tolist())
RUNGS = Bounds(RUNG_COLORS, PLACES, RUNG_HEIGHTS)
SPARE_LIVES = LIVES.rule(DISPLAY_COLOR, (16, 183, 80, 190), single=2)

GAME = Game(
    name="Kangaroo",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        rare=("FallingCoconut", "Fruit", "Ladder", "Platform", "ThrownCoconut"),
        mirrored={"Player": 0.07},  # the RAM does not record whether the player has just turned
    ),
    variants=Variants(
        modes={
            0: "starts with the first round of three levels",
            1: "starts as hard as the second round of three levels",
        },
        source="the program in the ROM",
        starts={
            "level=1": "the second screen",
            "level=2": "the third screen",
        },
    ),
    terrain=TERRAIN,
    categories=(
        Category("Player", BODY, attributes=("orientation",), role="player", doc="the mother"),
        Category("Child", CHILD, doc="the child"),
        Category("Monkey", APES, count=4, doc="monkeys"),
        Category("FallingCoconut", BALL, doc="a coconut that falls"),
        Category("ThrownCoconut", NUTS, count=3, doc="coconuts that monkeys throw"),
        Category("Bell", Bounds(BELL, (16, 36, 144, 52)), doc="the bell"),
        Category("Fruit", FRUITS, count=3, doc="fruits"),
        Category("Platform", FLOORS, count=MOST_PLATFORMS, rgb=WOOD_RGB, doc="floors and steps"),
        Category("Ladder", RUNGS, count=12, rgb=WOOD_RGB, doc="ladders of the three levels"),
        display("Score", SCORE.rule(DISPLAY_COLOR), role="score", doc="points"),
        display("Lives", SPARE_LIVES, role="lives", doc="lives left but the last one"),
        display("Time", CLOCK.rule(DISPLAY_COLOR), role="time", doc="time left"),
    ),
)
