"""Berzerk: a human and at most eight robots in the rooms of a maze, a shot per side, Evil Otto.

Picture: docs/games/Berzerk.png

Screen: while a room appears, human and robots are absent and not valid. The score is valid, also
while lives or a bonus replace it on the screen. A robot stays valid while it explodes. Otto and the
human share a sprite, which shows them alternately.

Slots: Enemy has the game's own list, from top to bottom. When a robot is destroyed, the later ones
move up.

Terrain: the walls, from the room's picture in the ROM, its side exits and the exit that is shut
behind the human. On the line above each robot, the chip blanks eight columns while it moves
sprites; these columns are not wall. Where the first robot's row is unknown (see below), that line
is complete. On the one frame between two rooms, the RAM lacks four lines of the old walls. After a
game, the walls' colour changes, and the pixels do not show them.

RAM: ALE's source (score, lives), AtariARI, OCAtari 2.2 (positions), a public disassembly by Dennis
Debro (names), and the ROM's code. The human, his shot and Otto move after the frame is drawn, so
the screen lags behind the RAM by their last step.

Covered: rooms of all colours, scrolling, deaths, bonus, lives, game over, ALE's modes (Otto, robots
that do not shoot, extra lives).

Not exact: the RAM lacks a shot on the frame on which it hits (5 % of the frames with the human's
shot), the pose before a shot or a death, and the side that the human faced before he turned.

When the human leaves a room or loses a life, the last frame still shows the room. The rows of the
human and of the first robot are already cleared, and so is the direction of a robot's shot. The
human is not valid then. The first robot is valid only if the second one is in the second row: then
the first one is at its start (99.7 % are right). A robot beside the shot and the human's column
give the shot's direction (97 %). The next frame shows no figures.

VEM: a shot that touches a robot also counts as part of it. VEM misses a vertical shot behind a
robot's body, and the true length of a shot in line with an arm (5 % each of the frames with such a
shot). If a wall leaves less than six rows of a shot, the human's box reaches to it (1 of 13,000
frames).
"""

import jax
import jax.numpy as jnp
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Colors,
    Digits,
    Font,
    Game,
    IconRow,
    NumberDisplay,
    Shape,
    ShortRuns,
    Variants,
    among,
    box,
    display,
    match,
    pick,
    when,
)
from ocjax.extractors.berzerk.ram import (
    APPEARED,
    ROM,
    Frame,
    Missile,
    Pose,
    Ram,
    RobotPose,
    State,
    Way,
    on_last_frame,
    rows_of_robots,
)
from ocjax.extractors.berzerk.terrain import TERRAIN

HUMAN_COLOR = 60  # also of Otto and the human's shot
TEXT = 28
ROOM_COLORS = (26, 54, 12, 202, 76, 168, 252, 88)  # of robots and their shots, by room
FIELD = (0, 5, 160, 179)
FIELD_BOTTOM = 177  # bottom of the human's visible part
LEFT_WALL = 8  # its right edge


class Glyph:  # of `Ram.glyph`: low bytes of addresses
    ZERO = 0x16
    ONE = 0x1D
    BLANK = 0x5C
    MAN = 0x63
    COPYRIGHT = 0x6A


GLYPH_PAGE = 0xC00
DIGIT_FONT = ROM.font(GLYPH_PAGE + Glyph.ZERO, rows=7)
LINE_TOP = 183
SCORE = NumberDisplay(DIGIT_FONT, right=103, top=LINE_TOP, digits=6)
BONUS = NumberDisplay(DIGIT_FONT, right=71, top=LINE_TOP, digits=2)
RESERVE = IconRow(left=96, top=LINE_TOP, width=6, height=7, pitch=-8)  # in reserve
LINE = SCORE.area
COPYRIGHT_SIZE = (40, 7)

ABOVE_HEAD = 4  # `missile_x` less `robot_x` for a robot's vertical shot
OTTO_COMES = 3  # least `otto` with him in the room
OTTO_FALLS = 128  # least `otto_way` on his way down
JUST_FIRED = 254  # `shot_sound` on the frame after which the shot leaves the gun
STEP_PACE = 112  # added to `pace` on each frame
FIRST_PICTURE = 0xA9  # of the human, low byte of its address
AIMING = range(49, 80)  # bytes from the first picture to the aiming pictures


def decode(m: Ram) -> dict[str, Box]:
    present = _is_present(m)
    left = on_last_frame(m)
    color = pick(m.level - when(left, 1) >> 1 & 7, ROOM_COLORS)
    return {
        "Player": _human(m).where(present),
        "Enemy": _robots(m, color).where(present | left),
        "PlayerMissile": _shot(m).where(present),
        "EnemyMissile": _missile_box(m, color, left).where(present | left),
        "EvilOtto": _otto(m).where(present),
        "Copyright": box(63, LINE_TOP, *COPYRIGHT_SIZE, m.glyph[1] == Glyph.COPYRIGHT),
        "PlayerScore": SCORE.box(m.score, valid=m.score > 0),
        "BonusPoints": _bonus_box(m),
        "Lives": _lives(m),
    }


def _is_present(m: Ram) -> jax.Array:
    """True if a complete room with its figures is on the screen."""
    begins = (m.frame == Frame.ROOM_BEGINS) & (m.missile_way == Missile.NONE_YET)
    first_frame = begins & (m.missile_wait == 0)
    return (m.state == State.IN_ROOM) & (m.appearing == APPEARED) & ~first_frame


def _step(way: jax.Array) -> tuple[jax.Array, jax.Array]:
    """One step in a direction, to the right and down."""
    dx = match(((way & Way.RIGHT) != 0, 1), ((way & Way.LEFT) != 0, -1), otherwise=0)
    up_or_down = way & Way.VERTICAL
    return dx, match((up_or_down == Way.UP, -1), (up_or_down == Way.DOWN, 1), otherwise=0)


def _human(m: Ram) -> Box:
    moved = (m.pace < STEP_PACE) & (m.pose < Pose.HIT)
    dx, dy = _step(m.way)
    x = m.x + 3 - when(moved, dx)
    y = m.y + 5 - when(moved, dy)
    shocked = (m.pose >= Pose.SHOCK) & ((m.pose & 2) == 0)
    first, last = _human_columns(m, moved, shocked)
    left = x + jnp.where((m.way & Way.LEFT) != 0, 7 - last, first)
    top = jnp.where(shocked, y - 2, y)
    height = jnp.where(shocked, 24, 20)
    return box(left, top, last - first + 1, height).clip(0, 0, 160, FIELD_BOTTOM)


def _human_columns(m: Ram, moved: jax.Array, shocked: jax.Array) -> tuple[jax.Array, jax.Array]:
    """First and last column of the human's picture."""
    hit = m.pose >= Pose.HIT
    aims = _is_aiming(m)
    aims_down = aims & ((m.way & Way.VERTICAL) == Way.DOWN)
    turn = _walking_pose(m, moved)
    walk = pick(turn, (1, 1, 0)), pick(turn, (6, 5, 7))
    first = match((shocked, 0), (hit, 1), (aims_down, 2), (aims, 3), otherwise=walk[0])
    last = match((shocked, 7), (hit | aims, 6), otherwise=walk[1])
    return first, last


def _is_aiming(m: Ram) -> jax.Array:
    """True if the human stands and aims."""
    picture = (m.figure + m.figure_row - FIRST_PICTURE) & 255  # of the next frame
    # The pace restarts while the trigger is pressed: this is its second frame.
    just_aimed = (m.pace == 2 * STEP_PACE) & (m.shot > 0)
    return among(picture, AIMING) | just_aimed


def _walking_pose(m: Ram, moved: jax.Array) -> jax.Array:
    """The pose of a walking human, 0 to 2, before the pace's last change."""
    pace_ends = ((m.pace - STEP_PACE) & 255) < STEP_PACE
    steps_next = pace_ends & ((m.pace != STEP_PACE) | (m.pose > 0))
    turn = m.pose + when(moved, 1) + when(steps_next, 1)
    return jnp.where(turn >= 3, turn - 3, turn)


def _robots(m: Ram, color: jax.Array) -> Box:
    """All robots."""
    row = rows_of_robots(m)
    is_spark = m.robot_pose == RobotPose.SPARK
    x = m.robot_x + jnp.where(is_spark, 8, 6)
    y = 2 * row.y + jnp.where(is_spark, 10, 4)
    height = match((is_spark, 4), (among(m.robot_pose, RobotPose.TALL), 18), otherwise=16)
    return box(x, y, jnp.where(is_spark, 4, 8), height, row.valid, color=color)


def _shot(m: Ram) -> Box:
    """The human's shot before its last step.

    A gun that touches the wall at the left fires on every frame, and the new shot is at the old
    one's drawn position. Any other new shot is not drawn yet.
    """
    fired = m.shot_sound == JUST_FIRED
    in_wall = m.shot_x + 2 < LEFT_WALL
    dx, dy = _step(m.shot_way)
    x = m.shot_x - when(~fired, 2 * dx)
    y = m.shot_y - when(~fired, dy)
    width = jnp.where(dx != 0, 4, 1)
    height = jnp.where(dx != 0, 2, 6)
    return box(x + 2, 2 * y + 1, width, height, (m.shot > 0) & (~fired | in_wall))


def _missile_box(m: Ram, color: jax.Array, left: jax.Array) -> Box:
    """A robot's shot. Its direction is cleared when the human leaves: most fly sideways."""
    flies = ~among(m.missile_way, (Missile.NONE, Missile.NONE_YET))
    there = jnp.where(left, ~among(m.missile_pause, (0, 255)) & (m.missile_y > 0), flies)
    # It is vertical if the human is in its columns, or near a robot with its gun there.
    distance = jnp.abs(m.x - m.missile_x)
    from_robot = jnp.any(m.robot_x + ABOVE_HEAD == m.missile_x)
    is_upright = left & ((distance <= 4) | (from_robot & (distance <= 12)))
    sideways = ((m.missile_way & Way.VERTICAL) != 0) & ~is_upright
    width = jnp.where(sideways, 4, 1)
    height = jnp.where(sideways, 2, 6)
    return box(m.missile_x + 2, 2 * m.missile_y, width, height, there, color=color)


def _otto(m: Ram) -> Box:
    squashed = (m.otto_y == m.otto_low) & (m.otto_way < OTTO_FALLS)
    y = m.otto_y + jnp.where(squashed, 9, 3)
    return box(m.otto_x + 3, y, 8, jnp.where(squashed, 10, 16), m.otto >= OTTO_COMES)


def _bonus_box(m: Ram) -> Box:
    """The bonus of two digits; a leading 1 is a column narrower."""
    there = (m.glyph[1] == Glyph.ZERO) & (m.glyph[5] == Glyph.BLANK)
    narrow = when(m.glyph[0] == Glyph.ONE, 1)
    return box(56 + narrow, LINE_TOP, 14 - narrow, 7, there, value=10 * m.killed)


def _lives(m: Ram) -> Box:
    """The men in the line; one more is in play."""
    men = jnp.sum(when(m.glyph == Glyph.MAN, 1))
    return RESERVE.box(men, value=m.lives + 1)


def _count_men() -> Digits:
    """How VEM counts the men of the line: each picture counts 1, and one man is not shown."""
    pictures = ROM.rows([GLYPH_PAGE + Glyph.MAN, GLYPH_PAGE + Glyph.COPYRIGHT], DIGIT_FONT.height)
    man, other = map(tuple, pictures.tolist())  # the copyright is never beside a man
    glyphs = Font((other, man, *(other,) * 8))
    return Digits(glyphs, SCORE.lefts, LINE_TOP, weights=(1,) * 6, base=1, required=True)


def _across(colors: Colors, shape: Shape, connectivity: int = 8) -> Blobs:
    """How VEM finds a horizontal shot, even if it touches its shooter.

    Except for a stretched arm, figures have no part of two rows as wide as the rest of a shot.
    """
    return Blobs(colors, FIELD, shape, connectivity, filters=(ShortRuns(2),))


UPRIGHT = Shape(w=1, h=6)  # a vertical shot
# A vertical shot across a robot. Legs and arms have four or six rows; a shot makes them longer, or
# a robot's other parts cut it to five.
ACROSS_ROBOT = Shape(w=1, h=(7, 10)), Shape(w=1, h=5)

# The human and Otto never appear together. They share a colour, but Otto has fewer rows.
PLAYER = Bounds(HUMAN_COLOR, FIELD, min_size=(3, 17), exclude=("PlayerMissile",))
ENEMY = Blobs(ROOM_COLORS, FIELD, Shape(w=(4, 12), h=(4, 24)))
# An arm and the shot beside it: the left part counts, as most of these shots are at the left wall.
LEFT_PART = _across(HUMAN_COLOR, Shape(w=(4, 6), h=(2, 3), split=(4, 2)), connectivity=4)
PLAYER_MISSILE = Blobs(HUMAN_COLOR, FIELD, UPRIGHT, also=(LEFT_PART,))
ENEMY_MISSILE = Blobs(
    ROOM_COLORS,
    FIELD,
    ACROSS_ROBOT,
    filters=(ShortRuns(1, across=True),),
    also=(Blobs(ROOM_COLORS, FIELD, UPRIGHT), _across(ROOM_COLORS, Shape(w=(3, 6), h=(2, 3)))),
)
EVIL_OTTO = Blobs(HUMAN_COLOR, FIELD, Shape(w=8, h=(10, 16), pixels=(60, 90)))
NOTICE = Bounds(TEXT, LINE, min_size=COPYRIGHT_SIZE, max_size=COPYRIGHT_SIZE)
BONUS_POINTS = BONUS.rule(TEXT, free=tuple(SCORE.lefts[BONUS.digits :]), required=True)

GAME = Game(
    name="Berzerk",
    rom=ROM,
    ram=Ram,
    decode=decode,
    terrain=TERRAIN,
    checks=Checks(
        # The RAM lacks a shot on the frame on which it hits, and the pose before a death.
        agreement={"last": 0.91, "lost": 0.87, "modes": 0.92},
        rare=("PlayerMissile", "EnemyMissile"),
        # The game also shows other things in place of the score.
        at_limits={"PlayerScore": (100_000, 123_450, 999_990)},
    ),
    variants=Variants(
        modes={
            1: "no Otto; an extra life every 1,000 points",
            2: "a shot drives Otto away for a while; an extra life every 1,000 points",
            3: "Otto withstands shots; an extra life every 1,000 points",
            4: "no Otto; an extra life every 2,000 points",
            5: "a shot drives Otto away for a while; an extra life every 2,000 points",
            6: "Otto withstands shots; an extra life every 2,000 points",
            7: "no Otto; no extra lives",
            8: "a shot drives Otto away for a while; no extra lives",
            9: "Otto withstands shots; no extra lives",
            16: "as 3, and robots do not shoot",
            17: "as 2, and robots do not shoot",
            18: "as 1, and robots do not shoot",
        },
        source="the program in the ROM, and play of all modes in the emulator",
        starts={
            "level=3": "the colours of a later level",
        },
    ),
    categories=(
        Category("Player", PLAYER, role="player", doc="the human"),
        Category("Enemy", ENEMY, count=8, doc="robots, from the top"),
        Category("PlayerMissile", PLAYER_MISSILE, doc="the human's shot"),
        Category("EnemyMissile", ENEMY_MISSILE, doc="a robot's shot"),
        Category("EvilOtto", EVIL_OTTO, doc="comes when the human is slow"),
        display("Copyright", NOTICE, attributes=(), doc="before the first points"),
        display(
            "PlayerScore",
            SCORE.rule(TEXT, required=True),
            blinks=True,
            role="score",
            doc="hidden between rooms",
        ),
        display("BonusPoints", BONUS_POINTS, doc="for all robots"),
        display("Lives", Bounds(TEXT, LINE, value=_count_men()), role="lives", doc="between rooms"),
    ),
)
