"""Breakout: a wall of 6 x 18 bricks, a ball and a paddle between three walls.

The grey walls and the coloured feet of the side walls are scenery; the paddle may reach under the right one and is cut off there.
Block slots run row by row from the top left brick. The ball has the colour of the row it is in: grey above the bricks, the bricks'
colours among them, the paddle's below.

RAM: `facts/ram/Breakout.md`, and the ROM's code for what it leaves open (the digits show the score of the frame before).

Covered: all twelve modes (catching, steerable and breaking-through balls, timed ones, invisible bricks), both difficulties (A:
smaller paddles), all lives, the end of the game. Invisible bricks are there but not drawn: REM has them, VEM only while they
flash. Not in the RAM: one row of the ball while a paddle holds it (it keeps the delay of the row it was caught in), and the width
of the lives' digit in the frame in which a ball is lost.
"""

import jax.numpy as jnp
import numpy as np

from ocjax.ram import RamMap, bcd, bits, byte
from ocjax.spec import Bounds, Box, Category, Cells, Game, box

FIELD = (8, 32, 152, 196)
ROWS = (70, 54, 38, 22, 198, 134)  # colours of the bricks, top row first
RED, GREY = 70, 6
LEFT, TOP = np.tile(8 + 8 * np.arange(18), 6), np.repeat(57 + 6 * np.arange(6), 18)
# The wall is drawn by six registers of six rows; this is where each column's bricks are in them.
REGISTER = np.repeat(np.arange(6), (1, 4, 4, 2, 4, 3))
SHIFT = np.array([6, 6, 4, 2, 0, 0, 2, 4, 6, 4, 6, 6, 4, 2, 0, 0, 2, 4])


class Ram(RamMap):
    wall = byte(*range(35, -1, -1))  # registers from left to right, in each the rows from the top
    timed = bits(51, first=7)  # mode in which the score is the time
    player = byte(53)
    paddle_size = bits(55, first=4, count=2)
    lives = byte(57)
    paddle_x = byte(72)  # x + 47
    score = bcd((76, 77))
    frame = bits(90, first=0, count=6)
    sound = byte(95)  # frames left; 6 - 1 when a brick has just been hit
    pitch = byte(96)  # of that sound, by row
    ball_x = byte(99)  # x + 49
    ball_y = byte(101)  # y - 9; 0: no ball


def decode(m: Ram) -> dict[str, Box]:
    bricks = (m.wall.reshape(6, 6)[REGISTER] >> SHIFT[:, None]) & 1  # [column, row]
    width = 8 + 4 * ((m.paddle_size + 1) >> 1)
    lone = m.lives == 1
    return {
        "Player": box(m.paddle_x - 47, 189, width, 4).clip(*FIELD),
        "Ball": _ball(m),
        "Block": box(LEFT, TOP, 8, 6, bricks.T.ravel() == 1),
        "PlayerScore": _score(m),
        "Live": box(100 + 4 * lone, 5, 12 - 8 * lone, 10, value=m.lives),
        "PlayerNumber": box(136 - 4 * m.player, 5, 4 + 8 * m.player, 10, value=m.player + 1),
    }


def _ball(m: Ram) -> Box:
    x, left, top, right = m.ball_x - 49, *FIELD[:3]
    bottom = jnp.where(x < 56 - 10 * (m.ball_y & 1), 196, 195)  # it is switched off in the middle of the last row
    return box(x, m.ball_y + 9, 2, 4).clip(left, top, right, bottom)


def _score(m: Ram) -> Box:
    """Tight around three digits of 12 pixels, 16 apart; a 1 is their middle third."""
    points = jnp.where(m.pitch < 16, 7, jnp.where(m.pitch < 22, 4, 1))
    shown = m.score - jnp.where(m.timed == 1, m.frame == 0, points * (m.sound == 5))
    first = 4 * (shown // 100 == 1)
    last = 44 - 4 * (shown % 10 == 1)
    return box(36 + first, 5, last - first, 10, value=m.score)


GAME = Game(
    name="Breakout",
    rom="breakout",
    md5="f34f08e5eb96e500e851a80be3277a56",
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", Bounds(RED, (8, 189, 152, 193))),
        Category("Ball", Bounds((RED, GREY), (8, 32, 152, 189))),
        Category("Block", Cells(ROWS, tuple(LEFT), tuple(TOP), 8, 6), count=108),
        Category("PlayerScore", Bounds(GREY, (36, 5, 80, 15)), attributes=("value",), hud=True),
        Category("Live", Bounds(GREY, (100, 5, 112, 15)), attributes=("value",), hud=True),
        Category("PlayerNumber", Bounds(GREY, (132, 5, 144, 15)), attributes=("value",), hud=True),
    ),
)
