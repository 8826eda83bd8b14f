"""Berzerk: a human and up to eight robots in the rooms of a maze, a shot of each side, Evil Otto.

Robot slots are the game's own list, from top to bottom, which closes its gaps. A robot stays valid
while it explodes. Nobody is drawn or valid while a room appears; the score is, also while lives or
a bonus are shown in its place. Otto and the human share a sprite and are drawn in turn. The walls
are scenery.

RAM: ALE's source (score, lives), AtariARI, OCAtari 2.2 (positions), a public disassembly by Dennis
Debro (names), and the ROM's code. The human, his shot and Otto move after the frame was drawn, so
the screen lags behind the RAM by their last step.

Covered: rooms of all colours, scrolling, deaths, bonus, lives, game over, ALE's modes (Otto, robots
that do not shoot, extra lives). Not in RAM: a shot on the frame on which it hits (5 % of the frames
with the human's shot), the pose before a shot or a death, to which side the human looked before he
turned. On the frame on which a room is left, or a life lost, the room is still on the screen, but
the rows of the human and of the first robot are cleared, and the way of a robot's shot. The human
is not valid then, nor is the first robot, unless the second one is in the second row: then the
first one is where it began (99.7 % are right). A robot beside the shot and the human's column tell
its way (97 %). The next frame shows nobody. VEM takes a shot that touches a robot for a part of it,
too, and does not see one that flies up or down where a robot's body covers it, nor the true length
of one in line with an arm (5 % each of the frames with such a shot). Its box of the human reaches
to a shot of which a wall leaves less than six rows (1 of 13,000 frames).
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.fonts import Digits, Font, score_box
from ocjax.console.ops import among, pick
from ocjax.console.ram import RamMap, bcd, byte
from ocjax.console.rom import Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.filters import ShortRuns
from ocjax.vision.rules import Blobs, Bounds, Colors
from ocjax.vision.shapes import Shape

ROM = Rom("berzerk", "136f75c4dd02c29283752b7e5799f978")
# low bytes of glyphs' addresses
ZERO = 0x16
ONE = 0x1D
BLANK = 0x5C
MAN = 0x63
COPYRIGHT = 0x6A
GLYPH_PAGE = 0xC00
FONT = ROM.font(GLYPH_PAGE + ZERO, rows=7)
CELLS = tuple(range(55, 103, 8))
LINE_TOP = 183

# `state`
IN_ROOM = 2
LEAVES = 255
APPEARED = 255  # `appearing` once the room is there
LAST_FRAME = 1  # `frame` when the room has been left, but is still on the screen
ROOM_BEGINS = 53  # `frame` on the first frame of a room, which does not show anybody yet
NO_ROBOT = 127  # `robot_y`, of this and all later slots
TOP_ROW = 5  # `robot_y` where robots begin
SECOND_ROW = range(15, 22)  # with a few steps down
# `missile_way`
NO_MISSILE = 0
NO_MISSILE_YET = 15
GUN = 4  # `missile_x` less `robot_x` where a shot leaves a robot upright
OTTO_COMES = 3  # `otto`, or more
# bits of ways
UP = 1
DOWN = 2
LEFT = 4
RIGHT = 8
VERTICAL = UP | DOWN

FIRES = 254  # `shot_sound` on the frame after which the shot leaves the gun
WALL = 8  # right edge of the wall at the left
STEP_PACE = 112  # added to `pace` on each frame
HIT = 3  # least poses of the human
SHOCK = 6  # 0 to 2 walk
AIMS = range(0x31, 0x50)  # pictures of the human, as distances from the first one
FIRST_PICTURE = 0xA9
TALL_POSES = (15, 17, 20, 22)  # of robots
SPARK = 23  # a spark is the end of an explosion

HUMAN = 60
TEXT = 28
ROBOTS = (26, 54, 12, 202, 76, 168, 252, 88)  # by room
FIELD = (0, 5, 160, 179)
LINE = (55, 183, 104, 190)


class Ram(RamMap):
    state = byte(1)
    frame = byte(4)
    figure = byte(9)  # low byte of its address, less where it is on the screen
    y = byte(11)  # y - 5, already moved on
    figure_row = byte(12)
    way = byte(14)
    pose = byte(17)  # counts up once he is hit
    pace = byte(18)  # an overflow is a step
    x = byte(19)  # of the sprite - 3, already moved on
    shot = byte(20)  # in flight
    shot_way = byte(21)
    shot_x = byte(22)  # x - 2, already moved on
    shot_y = byte(23)  # (y - 1) / 2, already moved on
    missile_way = byte(26)
    missile_pause = byte(27)  # 0 or 255: none flies
    missile_wait = byte(28)  # counts up before the first shot
    missile_x = byte(29)  # x - 2
    missile_y = byte(30)  # y / 2
    otto_x = byte(46)  # x - 3
    robot_y = byte(*range(56, 64))  # (y - 4) / 2
    robot_x = byte(*range(65, 73))  # x - 6
    otto_low = byte(72)  # lowest position of his bounce
    robot_pose = byte(*range(82, 90))
    otto_y = byte(89)  # y - 3
    lives = byte(90)  # without the last one
    killed = byte(91)
    level = byte(92)
    score = bcd((93, 94, 95))
    appearing = byte(101)  # how much of the room is there
    glyph = byte(106, 108, 110, 112, 114, 116)  # in the line below, low bytes of addresses
    otto = byte(118)
    shot_sound = byte(119)
    otto_way = byte(121)  # 128 and more: falls


def decode(m: Ram) -> dict[str, Box]:
    present = _present(m)
    left = (m.state == LEAVES) & (m.frame == LAST_FRAME) & (m.appearing == APPEARED)
    color = pick(m.level - jnp.where(left, 1, 0) >> 1 & 7, ROBOTS)
    return {
        "Player": _human(m).where(present),
        "Enemy": _robots(m, left, color).where(present | left),
        "PlayerMissile": _shot(m).where(present),
        "EnemyMissile": _missile(m, color, left).where(present | left),
        "EvilOtto": _otto(m).where(present),
        "Copyright": box(63, LINE_TOP, 40, 7, m.glyph[1] == COPYRIGHT),
        "PlayerScore": _score(m),
        "BonusPoints": _bonus(m),
        "Lives": _lives(m),
    }


def _present(m: Ram) -> jax.Array:
    """Whether a room is there with everybody in it."""
    first_frame = (m.frame == ROOM_BEGINS) & (m.missile_way == NO_MISSILE_YET)
    first_frame = first_frame & (m.missile_wait == 0)
    return (m.state == IN_ROOM) & (m.appearing == APPEARED) & ~first_frame


def _step(way: jax.Array) -> tuple[jax.Array, jax.Array]:
    """One step that way, to the right and down."""
    dx = jnp.where((way & RIGHT) > 0, 1, jnp.where((way & LEFT) > 0, -1, 0))
    vertical = way & VERTICAL
    return dx, jnp.where(vertical == UP, -1, jnp.where(vertical == DOWN, 1, 0))


def _human(m: Ram) -> Box:
    walks = m.pose < HIT
    moved = (m.pace < STEP_PACE) & walks
    dx, dy = _step(m.way)
    x = m.x + 3 - jnp.where(moved, dx, 0)
    y = m.y + 5 - jnp.where(moved, dy, 0)
    shocked = (m.pose >= SHOCK) & ((m.pose & 2) == 0)
    first, last = _human_columns(m, moved, shocked)
    left = x + jnp.where((m.way & LEFT) > 0, 7 - last, first)
    top, height = jnp.where(shocked, y - 2, y), jnp.where(shocked, 24, 20)
    return box(left, top, last - first + 1, height).clip(0, 0, 160, 177)


def _human_columns(m: Ram, moved: jax.Array, shocked: jax.Array) -> tuple[jax.Array, jax.Array]:
    """First and last column of the human's picture."""
    picture = (m.figure + m.figure_row - FIRST_PICTURE) & 255  # of the next frame
    # The pace begins anew while the trigger is pressed: this is its second frame.
    just_aimed = (m.pace == 2 * STEP_PACE) & (m.shot > 0)
    aims = among(picture, AIMS) | just_aimed
    aims_down = (m.way & VERTICAL) == DOWN
    steps_next = ((m.pace - STEP_PACE) & 255) < STEP_PACE
    steps_next = steps_next & ((m.pace != STEP_PACE) | (m.pose > 0))
    turn = m.pose + jnp.where(moved, 1, 0) + jnp.where(steps_next, 1, 0)
    turn = jnp.where(turn >= 3, turn - 3, turn)
    first, last = pick(turn, (1, 1, 0)), pick(turn, (6, 5, 7))
    first = jnp.where(aims, jnp.where(aims_down, 2, 3), first)
    last = jnp.where(aims, 6, last)
    hit = m.pose >= HIT
    first, last = jnp.where(hit, 1, first), jnp.where(hit, 6, last)
    return jnp.where(shocked, 0, first), jnp.where(shocked, 7, last)


def _robots(m: Ram, left: jax.Array, color: jax.Array) -> Box:
    """All robots. Where the room has been left, the row of the first one is cleared.

    It is known if the second one is in the second row: they begin one to a row, and are sorted.
    """
    number = np.arange(8)
    first = jnp.where(left & ~among(m.robot_y[1], SECOND_ROW), 1, 0)
    row = jnp.where(left & (number == 0), TOP_ROW, m.robot_y)
    count = jnp.min(jnp.where(row == NO_ROBOT, number, 8))
    is_spark = m.robot_pose == SPARK
    is_tall = functools.reduce(jnp.logical_or, (m.robot_pose == pose for pose in TALL_POSES))
    x = m.robot_x + jnp.where(is_spark, 8, 6)
    y = 2 * row + jnp.where(is_spark, 10, 4)
    height = jnp.where(is_spark, 4, jnp.where(is_tall, 18, 16))
    there = (number >= first) & (number < count)
    return box(x, y, jnp.where(is_spark, 4, 8), height, there, color=color)


def _shot(m: Ram) -> Box:
    """The human's shot before its last step.

    A gun that touches the wall at the left fires on every frame, and the new shot is where the last
    one was drawn. Any other new shot is not drawn yet.
    """
    fires, in_wall = m.shot_sound == FIRES, m.shot_x + 2 < WALL
    dx, dy = _step(m.shot_way)
    x, y = m.shot_x - jnp.where(fires, 0, 2 * dx), m.shot_y - jnp.where(fires, 0, dy)
    width, height = jnp.where(dx != 0, 4, 1), jnp.where(dx != 0, 2, 6)
    return box(x + 2, 2 * y + 1, width, height, (m.shot > 0) & (~fires | in_wall))


def _missile(m: Ram, color: jax.Array, left: jax.Array) -> Box:
    """A robot's shot. When the room is left, its way is cleared: most fly across."""
    flies = (m.missile_way != NO_MISSILE) & (m.missile_way != NO_MISSILE_YET)
    there = jnp.where(left, ~among(m.missile_pause, (0, 255)) & (m.missile_y > 0), flies)
    # It is upright if the human is in its columns, or near and a robot has its gun there.
    distance, gun = jnp.abs(m.x - m.missile_x), jnp.any(m.robot_x + GUN == m.missile_x)
    upright = left & ((distance <= 4) | (gun & (distance <= 12)))
    across = ((m.missile_way & VERTICAL) != 0) & ~upright
    width, height = jnp.where(across, 4, 1), jnp.where(across, 2, 6)
    return box(m.missile_x + 2, 2 * m.missile_y, width, height, there, color=color)


def _otto(m: Ram) -> Box:
    squashed = (m.otto_y == m.otto_low) & (m.otto_way < 128)
    y = m.otto_y + jnp.where(squashed, 9, 3)
    return box(m.otto_x + 3, y, 8, jnp.where(squashed, 10, 16), m.otto >= OTTO_COMES)


def _score(m: Ram) -> Box:
    shows = m.score > 0
    return score_box(FONT, m.score, right=103, top=LINE_TOP, digits=6, valid=shows, value=m.score)


def _bonus(m: Ram) -> Box:
    there = (m.glyph[1] == ZERO) & (m.glyph[5] == BLANK)
    narrow = jnp.where(m.glyph[0] == ONE, 1, 0)
    return box(56 + narrow, LINE_TOP, 14 - narrow, 7, there, value=10 * m.killed)


def _lives(m: Ram) -> Box:
    men = jnp.sum(jnp.where(m.glyph == MAN, 1, 0))
    return box(104 - 8 * men, LINE_TOP, 8 * men - 2, 7, men > 0, value=m.lives + 1)


def _men() -> Digits:
    """How VEM counts the men of the line: each of their pictures counts 1, and one is not shown."""
    man = tuple(ROM.rows(GLYPH_PAGE + MAN, 7).tolist())
    no_picture = (0,) * 6 + (1,)
    font = Font((no_picture, man, *(no_picture,) * 8))
    return Digits(font, CELLS, LINE_TOP, weights=(1,) * 6, base=1, required=True)


def _across(colors: Colors, shape: Shape, connectivity: int = 8) -> Blobs:
    """How VEM finds a shot that flies across, even if it touches whoever fires it.

    But for an arm held out, nobody has a part of two rows as wide as what is left of a shot.
    """
    return Blobs(colors, FIELD, shape, connectivity, filters=(ShortRuns(2),))


UPRIGHT = Shape(w=1, h=6)  # a shot that flies up or down
# One that flies upright across a robot, told from its legs and arms. Those have four or six rows; a
# shot makes them longer, or a robot's other parts cut it to five.
ACROSS_ROBOT = Shape(w=1, h=(7, 10)), Shape(w=1, h=5)

number = functools.partial(Digits, FONT, top=LINE_TOP, required=True)

# The human is never drawn together with Otto, who has his colour and fewer rows.
PLAYER = Bounds(HUMAN, FIELD, min_size=(3, 17), exclude=("PlayerMissile",))
ENEMY = Blobs(ROBOTS, FIELD, Shape(w=(4, 12), h=(4, 24)))
# Of an arm and the shot beside it, the left part counts: most of these shots are at the left wall.
LEFT_PART = _across(HUMAN, Shape(w=(4, 6), h=(2, 3), split=(4, 2)), connectivity=4)
SHOT = Blobs(HUMAN, FIELD, UPRIGHT, also=(LEFT_PART,))
MISSILE = Blobs(
    ROBOTS,
    FIELD,
    ACROSS_ROBOT,
    filters=(ShortRuns(1, across=True),),
    also=(Blobs(ROBOTS, FIELD, UPRIGHT), _across(ROBOTS, Shape(w=(3, 6), h=(2, 3)))),
)
OTTO = Blobs(HUMAN, FIELD, Shape(w=8, h=(10, 16), pixels=(60, 90)))
NOTICE = Bounds(TEXT, LINE, min_size=(40, 7), max_size=(40, 7))
POINTS = Bounds(TEXT, LINE, value=number(lefts=CELLS))
BONUS = Bounds(
    TEXT, (55, 183, 71, 190), min_size=(13, 7), value=number(lefts=CELLS[:2], free=CELLS[2:])
)

GAME = Game(
    name="Berzerk",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", PLAYER, doc="the human"),
        Category("Enemy", ENEMY, count=8, doc="robots, from the top"),
        Category("PlayerMissile", SHOT, doc="the human's shot"),
        Category("EnemyMissile", MISSILE, doc="a robot's shot"),
        Category("EvilOtto", OTTO, doc="comes when the human is slow"),
        display("Copyright", NOTICE, attributes=(), doc="before the first points"),
        display("PlayerScore", POINTS, blinks=True, doc="hidden between rooms"),
        display("BonusPoints", BONUS, doc="for all robots"),
        display("Lives", Bounds(TEXT, LINE, value=_men()), doc="between rooms"),
    ),
)
