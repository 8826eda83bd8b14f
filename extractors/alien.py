"""Alien: a crewman in a ship's maze of eggs, three aliens, a pulsar that makes them weak, a flame-thrower, a rocket; score and lives.

Slots: Alien by the game's records (cyan, yellow, pink), in the bonus screen after the last egg by rows, left ones first; Egg by rows of
the left half, then of the right half, in each row by column. The flame takes the pulsar's record, so the pulsar is not there while the
flame-thrower fires. Eggs of the left and right half are drawn in turn, as missiles, so in whatever colours the sprites of their rows
have. The bonus screen's prize is a Rocket. Scenery: walls.

RAM: ALE's source (score, lives), OCAtari 2.2 (positions, eggs), and the ROM's code. A frame moves the aliens, works out the chip's
positions, draws, and then moves the crewman and chooses the pictures: so his column is read from the chip's position, his row from
the copy that the collision test keeps, and pictures follow the frame counter's previous value.

Covered: all four modes and difficulties, deaths, weak aliens, tunnels, flame, rocket, bonus screens, the game's end. Not in RAM: the row of
an alien that is removed on this very frame; in the bonus screen whether the crewman stood still, and its first and last frame. Half of
its aliens have the crewman's colours: VEM, which tells figures by colour, takes one of those for the crewman, and bits of them for eggs.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box
from ocjax.digits import Digits, hex_font
from ocjax.game import Game
from ocjax.ops import shared
from ocjax.ram import RamMap, bits, byte
from ocjax.rules import Blobs, Bounds, Category, Cells, Gauge

CYAN, YELLOW, PINK, ORANGE, BLUE, WEAK, WHITE = 190, 30, 94, 78, 142, 138, 14
MAZE = (8, 8, 160, 172)
EGG_X = ((26, 34, 42, 56, 64, 72), (89, 97, 105, 118, 126, 134))
EGG_BITS = np.array((2, 4, 6, 3, 5, 7))
EGGS_X, EGGS_Y = zip(
    *(
        (x, 19 + 12 * row + 2 * (i % 3))
        for half in EGG_X
        for row in range(13)
        for i, x in enumerate(half)
    ),
    strict=True,
)
GLYPHS = ("3c66666666663c", "3878181818187e", "7c46063c60607e", "3c46060c06463c", "0c1c2c4c7e0c0c",
          "7e60607c06467c", "3c62607c66663c", "7e42060c181818", "3c66663c66663c", "3c66663e06463c")  # fmt: skip
BLANK = 0x80


class Ram(RamMap):
    scene = byte(0)  # 0: maze; 32: bonus screen, 48: its figures move; from 128 on the game is over
    digits = byte(3, 5, 7, 9, 11, 13)  # 8 * digit, 128: not shown
    old_y = byte(10)  # of the player, 2 more, in most frames
    ways = bits(33, 34, count=2)  # of the pink alien and the player: 1 up, 3 down
    speeds = bits(33, 34, first=2, count=6)
    pictures = byte(35, 36, 37)  # of the aliens
    picture = byte(38)
    alien_y = byte(42, 43, 44)  # y = 196 - 2 * these; 0: none
    y, pulsar_y, rocket_y = byte(45), byte(46), byte(47)
    places = bits(55, 56, 57, 58, 59, 60, first=0, count=3)  # x = 17 + 15 * this, and fine steps
    turned = bits(55, 56, 57, 58, 59, first=3)
    steps = bits(55, 56, 57, 58, 59, 60, first=4, count=4)
    frame = byte(62)
    lives = byte(64)
    eggs = byte(*range(65, 91))
    rows = byte(*range(66, 72))  # bonus screen: where its six pairs of aliens are
    prize = byte(73)  # there: its picture, 0 where it was taken
    state = byte(96)  # 64 when the pairs took a step
    carried = byte(100, 101)  # sums of the speeds
    pause = byte(106)
    flame = byte(108)  # set to 159 while it burns, halved every frame


def decode(m: Ram) -> dict[str, Box]:
    maze = m.scene == 0
    x = 17 + 15 * m.places + (m.steps ^ 7)
    then = m.frame - 2
    egg = m.eggs[:, None] >> EGG_BITS[None] & 1
    shown = m.digits != BLANK
    count = jnp.sum(jnp.where(shown, 1, 0))
    score = jnp.sum(
        jnp.where(shown, m.digits >> 3, 0) * np.array([100000, 10000, 1000, 100, 10, 1])
    )
    y = jnp.where((m.old_y > m.y) & (m.old_y < m.y + 4), m.old_y - 2, m.y)
    flame = ((m.flame == 0x4F) | (m.flame == 0x9F)) & (m.pulsar_y == y - 2)
    large = (m.frame - 1) & 8 == 0
    left = jnp.where(large, 1 - m.turned[4], jnp.where(m.turned[4] == 1, 1, 2))
    bonus = (m.scene | 16) == 48
    stepped = (m.carried >> 2 < m.speeds) & (m.scene == 48) & (m.pause == 0)
    up = jnp.where(m.ways[1] == 1, 1, jnp.where((m.ways[1] == 3) & (m.y > 19), -1, 0))
    top = jnp.where(bonus, 196 - 2 * (m.y - jnp.where(stepped[1], up, 0)), 197 - 2 * y)
    return {
        "Player": _player(m, x[3], top, then).where(maze | bonus),
        "Alien": _aliens(m, x[:3], then, bonus, stepped[0] & (m.state == 64)),
        "Pulsar": box(
            x[4] + left,
            197 - 2 * m.pulsar_y,
            jnp.where(large, 7, 5),
            5,
            (m.pulsar_y > 0) & ~flame & maze,
        ),
        "Flame": box(x[4], 197 - 2 * m.pulsar_y, 8, 5, flame & maze),
        "Rocket": box(
            jnp.where(bonus, 77, x[5]),
            jnp.where(bonus, 19, 197 - 2 * m.rocket_y),
            8,
            5,
            jnp.where(bonus, m.prize > 0, (m.rocket_y > 0) & maze),
        ),
        "Egg": box(np.array(EGGS_X), np.array(EGGS_Y), 1, 2, (egg.ravel() == 1) & maze),
        "Score": box(69 - 8 * count + 2, 176, 8 * count - 2, 7, value=score),
        "Life": box(21, 187, 8 * m.lives - 11, 5, m.lives > 1, value=m.lives),
    }


def _player(m: Ram, x: jax.Array, top: jax.Array, then: jax.Array) -> Box:
    phase = then >> 2 & 3
    walks = (m.picture == 95) | (m.picture == 103) | (m.picture == 139)
    inset = jnp.where(phase == 0, 0, jnp.where(phase == 2, 3, 2))
    p = m.picture
    other = jnp.where(
        (p == 51) | (p == 1), 0, jnp.where((p == 58) | (p == 8), 1, jnp.where(p == 72, 3, 2))
    )
    height = jnp.where(p == 8, 9, jnp.where(p == 14, 7, jnp.where(p == 19, 5, 11)))
    inset = jnp.where(walks, inset, other)
    return box(x + inset, top, 8 - 2 * inset, jnp.where(walks, 13, height))


def _aliens(m: Ram, x: jax.Array, then: jax.Array, bonus: jax.Array, stepped: jax.Array) -> Box:
    p, turned = m.pictures, m.turned[:3]
    walks = (p == 79) | (p == 87) | (p == 151)
    narrow = walks & ((then >> 3 & 3) == 2)
    inset = jnp.where((p == 30) | (p == 8), 1, jnp.where((p == 37) | (p == 14) | (p == 19), 2, 0))
    height = jnp.where(
        inset == 1, 9, jnp.where(p == 19, 5, jnp.where(inset == 2, 7, jnp.where(walks, 13, 11)))
    )
    left = jnp.where(narrow, 1 - turned, inset)
    single = (
        x + left,
        196 - 2 * m.alien_y,
        jnp.where(narrow, 7, 8 - 2 * inset),
        height,
        jnp.where((m.alien_y > 0) & (m.scene == 0), 1, 0),
    )
    single, pairs = shared((single, _pairs(m, then, stepped)))  # 0.30 -> 0.22 us a state
    return box(
        *(jnp.where(bonus, b, jnp.pad(a, (0, 9))) for a, b in zip(single, pairs, strict=True))
    ).clip(8, 0, 160, 210)


def _pairs(m: Ram, then: jax.Array, stepped: jax.Array) -> tuple[Any, ...]:
    """Six rows of two aliens, which go left and right in turn and come back at the other side."""
    row = np.arange(6)
    x = 2 + 15 * (m.rows & 15) + (m.rows >> 4 ^ 7)
    before = jnp.where(row % 2 == 0, jnp.where(x == 129, 13, x + 1), jnp.where(x == 12, 128, x - 1))
    narrow = jnp.where((then >> 3 & 3) == 2, 1, 0)
    x = jnp.where(stepped, before, x) + narrow * (row % 2)
    x = jnp.concatenate([x, jnp.where(x < 128, x + 32, x - 128)])
    return x, 37 + 20 * np.tile(row, 2), jnp.full(12, 8 - narrow), np.full(12, 13), np.full(12, 1)


GAME = Game(
    name="Alien",
    rom="alien",
    md5="f1a0a23e6464d954e3a9579c4ccd01c8",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            Blobs(
                (BLUE, ORANGE),
                MAZE,
                exclude=("Egg",),
                gap=(2, 2),
                min_size=(2, 7),
                max_size=(10, 15),
            ),
            doc="crewman",
        ),
        Category(
            "Alien",
            Blobs(
                (CYAN, YELLOW, PINK, WEAK, WHITE),
                MAZE,
                exclude=("Egg",),
                gap=(1, 1),
                min_size=(4, 7),
                max_size=(12, 16),
            ),
            count=12,
            doc="cyan, yellow, pink; all are blue while weak",
        ),
        Category(
            "Pulsar",
            Blobs(ORANGE, MAZE, exclude=("Egg",), gap=(2, 2), min_size=(5, 4), max_size=(7, 5)),
            doc="makes aliens weak",
        ),
        Category(
            "Flame",
            Blobs(ORANGE, MAZE, exclude=("Egg",), gap=(2, 2), min_size=(8, 4), max_size=(8, 5)),
            doc="of the flame-thrower",
        ),
        Category(
            "Rocket",
            Blobs(
                (YELLOW, CYAN), MAZE, exclude=("Egg",), gap=(2, 2), min_size=(8, 4), max_size=(8, 5)
            ),
            doc="bonus",
        ),
        Category(
            "Egg",
            Cells(
                (CYAN, YELLOW, PINK, ORANGE, BLUE, WEAK, WHITE), EGGS_X, EGGS_Y, 1, 2, margin=(0, 1)
            ),
            count=len(EGGS_X),
            doc="what is left of them",
        ),
        Category(
            "Score",
            Bounds(
                (BLUE, WEAK),
                (22, 176, 70, 183),
                value=Digits(hex_font(GLYPHS, 8, (1, 1)), (22, 30, 38, 46, 54, 62), 176),
            ),
            attributes=("value",),
            hud=True,
            doc="points",
        ),
        Category(
            "Life",
            Bounds((BLUE, WEAK), (20, 187, 76, 192), value=Gauge(8, 5, 2)),
            attributes=("value",),
            hud=True,
            doc="lives",
        ),
    ),
)
