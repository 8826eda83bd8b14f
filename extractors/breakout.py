"""Breakout: a wall of 6 x 18 bricks, a ball and a paddle between three walls.

The grey walls and the coloured feet of the side walls are scenery. The paddle may reach over the
right foot, which has its colour: VEM takes both for one paddle then. Block slots run row by row
from the top left brick. The ball has the colour of the row that it is in: grey above the bricks,
the bricks' colours among them, the paddle's colour below.

RAM: ALE's source (score, lives), OCAtari 2.2 and AtariARI (positions, bricks), and the ROM's code
for what they leave open (the digits show the score of the frame before).

Covered: all twelve modes (balls that can be caught or steered or that break through, timed games,
invisible bricks), both difficulties (A: smaller paddles), all lives, the end of the game. Invisible
bricks are there but not drawn: REM has them, VEM only while they flash. Not in the RAM: one row of
the ball while a paddle holds it (it keeps the delay of the row in which it was caught), and the
width of the lives' digit in the frame in which a ball is lost.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box
from ocjax.digits import DIGITS_3X5, Digits, hex_font, score_box
from ocjax.game import Game
from ocjax.ops import pick
from ocjax.ram import RamMap, bcd, bits, byte
from ocjax.rules import Blobs, Bounds, Category, Cells
from ocjax.vision.palette import NTSC

FIELD = (8, 32, 152, 196)
LEFT, TOP, RIGHT, BOTTOM = FIELD
RED, GREY = 70, 6
FONT = hex_font(DIGITS_3X5, dots=3, dot=(4, 2), pitch=16)
DIGITS_TOP = 5
SCORE_DIGITS, LIVES_DIGIT, NUMBER_DIGIT = (36, 52, 68), (100,), (132,)  # left columns

ROWS, COLUMNS = 6, 18
ROW_COLORS = (70, 54, 38, 22, 198, 134)  # top row first
WALL_TOP, WALL_BOTTOM = 57, 93
BRICK_LEFTS = np.tile(8 + 8 * np.arange(COLUMNS), ROWS)
BRICK_TOPS = np.repeat(WALL_TOP + 6 * np.arange(ROWS), COLUMNS)
# Six registers draw a row of the wall from left to right. Two bits of a register are a brick; these
# are the lower ones, in the order of the columns.
BRICK_BITS = ((6,), (6, 4, 2, 0), (0, 2, 4, 6), (4, 6), (6, 4, 2, 0), (0, 2, 4))

PADDLE_TOP, PADDLE_WIDTHS = 189, (8, 12, 12, 16)  # widths by size
JUST_HIT = 5  # `sound` on the frame after a brick was hit
HIGH_ROWS, MIDDLE_ROWS = 16, 22  # pitches that end the rows of 7 and of 4 points; lower: 1 point


class Ram(RamMap):
    wall = byte(*range(35, -1, -1))  # registers from left to right, in each the rows from the top
    timed = bits(51, first=7)  # mode in which the score is the time
    player = byte(53)  # whose turn it is, 0 or 1
    paddle_size = bits(55, first=4, count=2)
    lives = byte(57)
    paddle_x = byte(72)  # x + 47
    score = bcd((76, 77))
    frame = bits(90, count=6)
    sound = byte(95)  # frames left
    pitch = byte(96)  # of that sound, by row of the brick
    ball_x = byte(99)  # x + 49
    ball_y = byte(101)  # y - 8 or y - 9; 0: no ball


def decode(m: Ram) -> dict[str, Box]:
    return {
        "Player": box(m.paddle_x - 47, PADDLE_TOP, pick(m.paddle_size, PADDLE_WIDTHS), 4),
        "Ball": _ball(m),
        "Block": _blocks(m),
        "PlayerScore": _digits(SCORE_DIGITS, m.score - _new_points(m), m.score),
        "Live": _digits(LIVES_DIGIT, m.lives, m.lives),
        "PlayerNumber": _digits(NUMBER_DIGIT, m.player + 1, m.player + 1),
    }


def _ball(m: Ram) -> Box:
    x = m.ball_x - 49
    top, bottom = _row(m.ball_y + 8), _row(m.ball_y + 12)
    # It is switched off in the middle of the last row.
    beam = jnp.where((m.ball_y & 1) == 1, 46, 56)
    return box(x, top, 2, bottom - top).clip(LEFT, TOP, RIGHT, jnp.where(x < beam, BOTTOM, 195))


def _row(line: jax.Array) -> jax.Array:
    """The row of a line of the game; the screen has one row more just below the bricks."""
    return jnp.where(line < WALL_BOTTOM, line, line + 1)


def _blocks(m: Ram) -> Box:
    registers = m.wall.reshape(6, ROWS)
    columns = [
        register >> bit & 1
        for register, bricks in zip(registers, BRICK_BITS, strict=True)
        for bit in bricks
    ]
    there = jnp.stack(columns, axis=1).ravel() == 1
    return box(BRICK_LEFTS, BRICK_TOPS, 8, 6, there)


def _new_points(m: Ram) -> jax.Array:
    """What the score has gained since the frame was drawn."""
    points = jnp.where(m.pitch < HIGH_ROWS, 7, jnp.where(m.pitch < MIDDLE_ROWS, 4, 1))
    points = jnp.where(m.sound == JUST_HIT, points, 0)
    second = jnp.where(m.frame == 0, 1, 0)
    return jnp.where(m.timed == 1, second, points)


def _digits(lefts: tuple[int, ...], shown: jax.Array, value: jax.Array) -> Box:
    right = lefts[-1] + FONT.width
    count = len(lefts)
    return score_box(
        FONT, shown, right=right, top=DIGITS_TOP, digits=count, leading_zeros=True, value=value
    )


def _number(lefts: tuple[int, ...]) -> Bounds:
    """How VEM finds and reads digits."""
    region = (lefts[0], DIGITS_TOP, lefts[-1] + FONT.width, DIGITS_TOP + FONT.height)
    return Bounds(GREY, region, value=Digits(FONT, lefts, DIGITS_TOP))


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
            Bounds((GREY, *ROW_COLORS), FIELD, exclude=("Block", "Player")),
            doc="in the colour of the row it is in",
        ),
        Category(
            "Block",
            Cells(ROW_COLORS, tuple(BRICK_LEFTS.tolist()), tuple(BRICK_TOPS.tolist()), 8, 6),
            count=ROWS * COLUMNS,
            rgb=tuple(np.repeat(NTSC[list(ROW_COLORS)], COLUMNS, axis=0)),
            doc="the bricks that are left",
        ),
        Category(
            "PlayerScore",
            _number(SCORE_DIGITS),
            attributes=("value",),
            hud=True,
            doc="points, or the time",
        ),
        Category(
            "Live",
            _number(LIVES_DIGIT),
            attributes=("value",),
            hud=True,
            doc="balls left",
        ),
        Category(
            "PlayerNumber",
            _number(NUMBER_DIGIT),
            attributes=("value",),
            hud=True,
            doc="whose turn it is",
        ),
    ),
)
