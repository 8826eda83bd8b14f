"""Breakout: a wall of 6 x 18 bricks, a ball and a paddle between three walls.

The grey walls and the coloured feet of the side walls are scenery. The paddle may reach over the right foot, which has its colour:
VEM takes both for one then. Block slots run row by row from the top left brick. The ball has the colour of the row it is in: grey
above the bricks, the bricks' colours among them, the paddle's below.

RAM: ALE's source (score, lives), OCAtari 2.2 and AtariARI (positions, bricks), and the ROM's code for what they leave open (the
digits show the score of the frame before).

Covered: all twelve modes (catching, steerable and breaking-through balls, timed ones, invisible bricks), both difficulties (A:
smaller paddles), all lives, the end of the game. Invisible bricks are there but not drawn: REM has them, VEM only while they flash.
Not in the RAM: one row of the ball while a paddle holds it (it keeps the delay of the row it was caught in), and the width of the
lives' digit in the frame in which a ball is lost.
"""

import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box
from ocjax.digits import DIGITS_3X5, Digits, hex_font
from ocjax.game import Game
from ocjax.ram import RamMap, bcd, bits, byte
from ocjax.rules import Blobs, Bounds, Category, Cells
from ocjax.vision.palette import NTSC

FIELD = (8, 32, 152, 196)
ROWS = (70, 54, 38, 22, 198, 134)  # colours of the bricks, top row first
RED, GREY = 70, 6
LEFT, TOP = np.tile(8 + 8 * np.arange(18), 6), np.repeat(57 + 6 * np.arange(6), 18)
# The wall is drawn by six registers of six rows; these are the bits of each that hold its columns' bricks (each brick has two).
BRICKS = ((6,), (6, 4, 2, 0), (0, 2, 4, 6), (4, 6), (6, 4, 2, 0), (0, 2, 4))


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
    ball_y = byte(101)  # y - 8 or 9; 0: no ball


def decode(m: Ram) -> dict[str, Box]:
    registers = m.wall.reshape(6, 6).T
    bricks = jnp.concatenate(
        [registers[:, i : i + 1] >> np.array([at]) & 1 for i, at in enumerate(BRICKS)], axis=1
    )  # [row, column]
    width = 8 + 4 * ((m.paddle_size + 1) >> 1)
    return {
        "Player": box(m.paddle_x - 47, 189, width, 4),
        "Ball": _ball(m),
        "Block": box(LEFT, TOP, 8, 6, bricks.ravel() == 1),
        "PlayerScore": _score(m),
        "Live": box(
            jnp.where(m.lives == 1, 104, 100), 5, jnp.where(m.lives == 1, 4, 12), 10, value=m.lives
        ),
        "PlayerNumber": box(136 - 4 * m.player, 5, 4 + 8 * m.player, 10, value=m.player + 1),
    }


def _ball(m: Ram) -> Box:
    x, y = m.ball_x - 49, m.ball_y
    top, bottom = (
        y + jnp.where(y < 85, 8, 9),
        y + jnp.where(y < 81, 12, 13),
    )  # the screen has a row more just below the bricks
    last = jnp.where(
        x < jnp.where(y & 1 == 1, 46, 56), 196, 195
    )  # it is switched off in the middle of the last row
    return box(x, top, 2, bottom - top).clip(8, 32, 152, last)


def _score(m: Ram) -> Box:
    """Tight around three digits of 12 pixels, 16 apart; a 1 is their middle third."""
    points = jnp.where(m.pitch < 16, 7, jnp.where(m.pitch < 22, 4, 1))
    new = jnp.where(m.timed == 1, jnp.where(m.frame == 0, 1, 0), jnp.where(m.sound == 5, points, 0))
    shown = m.score - new
    first = jnp.where((shown >= 100) & (shown < 200), 4, 0)
    last = jnp.where(shown % 10 == 1, 40, 44)
    return box(36 + first, 5, last - first, 10, value=m.score)


def digits(*lefts: int) -> Digits:
    return Digits(hex_font(DIGITS_3X5, 3, (4, 2)), lefts, 5)


GAME = Game(
    name="Breakout",
    rom="breakout",
    md5="f34f08e5eb96e500e851a80be3277a56",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            Blobs(RED, (8, 189, 160, 193), min_size=(8, 4), max_size=(26, 4)),
            doc="the paddle",
        ),
        Category(
            "Ball",
            Bounds((GREY, *ROWS), FIELD, exclude=("Block", "Player")),
            doc="in the colour of the row it is in",
        ),
        Category(
            "Block",
            Cells(ROWS, tuple(LEFT.tolist()), tuple(TOP.tolist()), 8, 6),
            count=108,
            rgb=tuple(np.repeat(NTSC[list(ROWS)], 18, axis=0)),
            doc="the bricks that are left",
        ),
        Category(
            "PlayerScore",
            Bounds(GREY, (36, 5, 80, 15), value=digits(36, 52, 68)),
            attributes=("value",),
            hud=True,
            doc="points, or the time",
        ),
        Category(
            "Live",
            Bounds(GREY, (100, 5, 112, 15), value=digits(100)),
            attributes=("value",),
            hud=True,
            doc="balls left",
        ),
        Category(
            "PlayerNumber",
            Bounds(GREY, (132, 5, 144, 15), value=digits(132)),
            attributes=("value",),
            hud=True,
            doc="whose turn it is",
        ),
    ),
)
