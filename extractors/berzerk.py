"""Berzerk: a human and up to eight robots in a room of a maze, a shot of his and one of theirs, and Evil Otto.

Robot slots are the game's own list, from the top; it closes the gaps. A robot stays valid while it explodes. While a room appears
nobody is drawn, and nobody is valid; the score is, while lives or a bonus are shown in its place. Otto and the human share a sprite
and take turns.

RAM: ALE's source (score, lives), AtariARI, OCAtari 2.2 (positions), a public disassembly by Dennis Debro (names), and the ROM's code:
it moves the human, his shot and Otto after the frame has been drawn, so the screen lags behind the RAM by their last step.

Covered: rooms of all colours, scrolling, deaths, bonus, lives, game over, ALE's modes (Otto, no shots of robots, extra lives). Scenery
that no box covers: the walls. Not in the RAM: a shot on the frame on which it hits; the pose on the frame before a shot, or of a
death; anything on the frame on which a room is left. VEM sees a shot that leaves the gun as part of who fires it.
"""

import functools

import jax
import jax.numpy as jnp
from ocjax.boxes import Box, box
from ocjax.digits import Digits, hex_font
from ocjax.game import Game
from ocjax.ram import RamMap, bcd, byte
from ocjax.rules import Blobs, Bounds, Category

HUMAN, TEXT = 60, 28
ROBOTS = (26, 54, 12, 202, 76, 168, 252, 88)
ROBOT_RGB = (
    (210, 210, 64),
    (198, 108, 58),
    (214, 214, 214),
    (111, 210, 111),
    (240, 128, 128),
    (84, 160, 197),
    (232, 204, 99),
    (198, 89, 179),
)
FIELD, LINE = (0, 5, 160, 179), (55, 183, 104, 190)
NOBODY = 127
CELLS = tuple(range(55, 96, 8))
ZERO, ONE, BLANK, MAN, COPYRIGHT = 0x16, 0x1D, 0x5C, 0x63, 0x6A  # low bytes of addresses of glyphs


class Ram(RamMap):
    state = byte(1)  # 2: in a room
    frame = byte(4)
    variation = byte(8)
    figure = byte(9)  # low byte of its address, less where it is on the screen
    figure_row = byte(12)
    y = byte(11)  # top - 5, already moved on
    way = byte(14)  # 1 up, 2 down, 4 left, 8 right
    pose = byte(17)  # 0-2 walking, more: hit, counts up
    pace = byte(18)  # + 112 a frame, an overflow is a step
    x = byte(19)  # of the sprite - 3, already moved on
    shot = byte(20)  # in flight
    shot_way = byte(21)
    shot_x, shot_y = byte(22), byte(23)  # x - 2, rows of two pixels; already moved on
    missile_way = byte(26)  # 0, 15: none
    missile_wait = byte(28)  # counts up before the first shot
    missile_x, missile_y = byte(29), byte(30)  # x - 2, rows of two pixels
    robot_y = byte(*range(56, 64))  # rows of two pixels
    robot_x = byte(*range(65, 73))  # x - 6
    robot_pose = byte(*range(82, 90))  # from 23 on: explodes
    otto_x, otto_y, otto_way, otto_low = byte(46), byte(89), byte(121), byte(72)
    otto = byte(118)  # 3: is there
    lives = byte(90)  # - 1
    killed = byte(91)
    level = byte(92)
    score = bcd((93, 94, 95))
    appearing = byte(101)  # 255: the room is there
    glyph = byte(106, 108, 110, 112, 114, 116)  # of the line below, low bytes of addresses


def decode(m: Ram) -> dict[str, Box]:
    first = (
        (m.frame == 53) & (m.missile_way == 15) & (m.missile_wait == 0)
    )  # frame on which the room is there
    here = (m.state == 2) & (m.appearing == 255) & ~first
    up_to = jnp.min(jnp.where(m.robot_y == NOBODY, jnp.arange(8), 8))
    robot = here & (jnp.arange(8) < up_to)
    spark = m.robot_pose == 23
    tall = (m.robot_pose == 15) | (m.robot_pose == 17) | (m.robot_pose == 20) | (m.robot_pose == 22)
    height = jnp.where(spark, 4, jnp.where(tall, 18, 16))
    rgb = jnp.array(ROBOT_RGB, jnp.uint8)[m.level >> 1 & 7]
    robots = box(
        m.robot_x + jnp.where(spark, 8, 6),
        2 * m.robot_y + jnp.where(spark, 10, 4),
        jnp.where(spark, 4, 8),
        height,
        robot,
        rgb=rgb,
    )
    missile = here & (m.missile_way != 0) & (m.missile_way != 15)
    across = m.missile_way & 3 != 0
    squashed = (m.otto_y == m.otto_low) & (m.otto_way < 128)
    return {
        "Player": _human(m, here),
        "Enemy": robots,
        "PlayerMissile": _shot(m, here),
        "EnemyMissile": box(
            m.missile_x + 2,
            2 * m.missile_y,
            jnp.where(across, 4, 1),
            jnp.where(across, 2, 6),
            missile,
            rgb=rgb,
        ),
        "EvilOtto": box(
            m.otto_x + 3,
            m.otto_y + jnp.where(squashed, 9, 3),
            8,
            jnp.where(squashed, 10, 16),
            here & (m.otto >= 3),
        ),
    } | _line(m)


def _step(way: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Of a way: to the right, down."""
    return jnp.where(way & 8 > 0, 1, jnp.where(way & 4 > 0, -1, 0)), jnp.where(
        way & 3 == 1, -1, jnp.where(way & 3 == 2, 1, 0)
    )


def _launched(m: Ram, dx: jax.Array, dy: jax.Array) -> jax.Array:
    """Whether the shot was fired after the frame was drawn: it is a step from where it starts."""
    down = m.shot_way & 3 == 2
    start_x = jnp.where(dx > 0, 6, jnp.where(dx < 0, 0, jnp.where(down, 8, 7)))
    start_y = jnp.where(down, 7, jnp.where(dx == 0, 2, 5))
    return (m.shot_x - 2 * dx == m.x + start_x) & (m.shot_y - dy == (m.y >> 1) + start_y)


def _shot(m: Ram, here: jax.Array) -> Box:
    dx, dy = _step(m.shot_way)
    across = dx != 0
    there = here & (m.shot > 0) & ~_launched(m, dx, dy)
    return box(
        m.shot_x - 2 * dx + 2,
        2 * (m.shot_y - dy) + 1,
        jnp.where(across, 4, 1),
        jnp.where(across, 2, 6),
        there,
    )


def _human(m: Ram, here: jax.Array) -> Box:
    moved = (m.pace < 112) & (m.pose < 3)
    dx, dy = _step(m.way)
    x = m.x + 3 - jnp.where(moved, dx, 0)
    y = m.y + 5 - jnp.where(moved, dy, 0)
    picture = (m.figure + m.figure_row - 0xA9) & 255  # of the next frame
    aims = (picture >= 0x31) & (picture < 0x50)
    turn = (
        m.pose
        + jnp.where(moved, 1, 0)
        + jnp.where(((m.pace - 112) & 255 < 112) & ((m.pace != 112) | (m.pose > 0)), 1, 0)
    )
    turn = jnp.where(turn >= 3, turn - 3, turn)
    hit = m.pose >= 3
    shock = (m.pose > 5) & (m.pose & 2 == 0)
    # first and last column of the picture
    walk = jnp.where(turn == 0, 0x16, jnp.where(turn == 1, 0x15, 0x07))
    aim = jnp.where(picture == 0x3D, 0x26, 0x36)
    columns = jnp.where(shock, 0x07, jnp.where(hit, 0x16, jnp.where(aims, aim, walk)))
    first, last = columns >> 4, columns & 15
    left = jnp.where(m.way & 4 > 0, 7 - last, first)
    return box(
        x + left, jnp.where(shock, y - 2, y), last - first + 1, jnp.where(shock, 24, 20), here
    ).clip(0, 0, 160, 177)


def _line(m: Ram) -> dict[str, Box]:
    """What is shown below the room."""
    bonus = (m.glyph[1] == ZERO) & (m.glyph[5] == BLANK)
    notice = m.glyph[1] == COPYRIGHT
    lives = jnp.sum(jnp.where(m.glyph == MAN, 1, 0))
    leading = jnp.array((10, 100, 1000, 10000, 100000))
    digits = jnp.sum(jnp.where(m.score >= leading, 1, 0)) + 1
    one = jnp.any((m.score >= leading) & (m.score < 2 * leading))
    left = 104 - 8 * digits + jnp.where(one, 1, 0)
    narrow = jnp.where(m.glyph[0] == ONE, 1, 0)
    return {
        "Copyright": box(63, 183, 40, 7, notice),
        "PlayerScore": box(left, 183, 102 - left, 7, m.score > 0, value=m.score),
        "BonusPoints": box(56 + narrow, 183, 14 - narrow, 7, bonus, value=10 * m.killed),
        "Lives": box(104 - 8 * lives, 183, 8 * lives - 2, 7, lives > 0, value=m.lives + 1),
    }


GLYPHS = ("7e72727272727e", "3c1c1c1c1c1c1c", "7e4e0e0e7e407e", "7e4e0e1c0e4e7e", "7c5c5c5c7e1c1c",
          "7e4e407e0e4e7e", "7e4e407e4e4e7e", "7e4e0e0e0e0e0e", "7e72727e4e4e7e", "7e72727e02727e")  # fmt: skip


def digits(*lefts: int) -> Digits:
    return Digits(hex_font(GLYPHS, 8, (1, 1)), lefts, 183, required=True)


# each picture of a man counts 1
men = Digits(
    hex_font(("00000000000001", "18003c5a181818", *("00000000000001",) * 8)),
    CELLS,
    183,
    (1,) * 6,
    base=1,
    required=True,
)
hud = functools.partial(Category, hud=True, attributes=("value",))
GAME = Game(
    name="Berzerk",
    rom="berzerk",
    md5="136f75c4dd02c29283752b7e5799f978",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            Blobs(HUMAN, FIELD, gap=(0, 2), min_size=(3, 17), max_size=(9, 26)),
            doc="the human",
        ),
        Category(
            "Enemy",
            Blobs(ROBOTS, FIELD, min_size=(4, 4), max_size=(12, 20)),
            count=8,
            doc="robots, from the top",
        ),
        Category(
            "PlayerMissile",
            Bounds(HUMAN, FIELD, exclude=("Player", "EvilOtto")),
            doc="the human's shot",
        ),
        Category("EnemyMissile", Bounds(ROBOTS, FIELD, exclude=("Enemy",)), doc="a robot's shot"),
        Category(
            "EvilOtto",
            Blobs(HUMAN, FIELD, min_size=(8, 10), max_size=(8, 16), area=(60, 90)),
            doc="comes when the human is slow",
        ),
        Category(
            "Copyright",
            Bounds(TEXT, LINE, min_size=(40, 7)),
            hud=True,
            doc="before the first points",
        ),
        hud(
            "PlayerScore",
            Bounds(TEXT, LINE, value=digits(*CELLS)),
            blinks=True,
            doc="hidden between rooms",
        ),
        hud(
            "BonusPoints",
            Bounds(TEXT, (55, 183, 71, 190), value=digits(*CELLS[:2])),
            doc="for all robots",
        ),
        hud("Lives", Bounds(TEXT, LINE, value=men), doc="between rooms"),
    ),
)
