"""Breakout: a ball, a paddle, and a wall of six rows of 18 bricks between three grey walls.

Picture: docs/games/Breakout.png

Screen: the ball has the colour of its row: grey above the bricks, the bricks' colours among them,
the paddle's colour below. The grey walls and the coloured feet of the side walls are scenery. The
paddle may cover the right foot, which has its colour.

Slots: Block has the bricks row by row from the top left.

RAM: ALE's source (score, lives), OCAtari 2.2 and AtariARI (positions, bricks), and the ROM's code
for the rest. The digits show the score of the frame before.

Covered: all twelve modes (balls that are caught, steered or break through, timed ones, invisible
bricks), both difficulties (A: smaller paddles), all lives, the end of the game. Invisible bricks
are valid while they flash.

Not exact: the RAM lacks these facts: the last of the five frames of a flash, and the frames of a
flash on which another brick is hit, because that resets the counter; one row of the ball while a
paddle holds it (it keeps the delay of its row at the catch); the width of the lives' digit on the
frame on which a ball is lost.

VEM: it takes the paddle and the right foot for one object when they touch.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    DIGITS_3X5,
    NTSC,
    Blobs,
    Bounds,
    Box,
    Category,
    Cells,
    Checks,
    Digits,
    Game,
    RamMap,
    Rom,
    Saver,
    Shape,
    Variants,
    bcd,
    bits,
    box,
    byte,
    display,
    flag,
    hex_font,
    pick,
    reached,
    score_box,
)

FONT = hex_font(DIGITS_3X5, dots=3, dot=(4, 2), pitch=16)
# left columns
SCORE_DIGITS = (36, 52, 68)
LIVES_DIGIT = 100
PLAYER_DIGIT = 132
DIGITS_TOP = 5

FIELD = (8, 32, 152, 196)
ROWS = (70, 54, 38, 22, 198, 134)  # colours of the bricks, top row first
RED = 70
GRAY = 6
COLOR_TOPS = tuple(range(57, 94, 6))  # of the bricks, and of the row under them
BLOCK_X = np.tile(8 + 8 * np.arange(18), 6)
BLOCK_Y = np.repeat(57 + 6 * np.arange(6), 18)
# The six registers of the playfield, from left to right: the bits for their columns' bricks. Each
# brick has two bits.
BRICKS = ((6,), (6, 4, 2, 0), (0, 2, 4, 6), (4, 6), (6, 4, 2, 0), (0, 2, 4))
BRICK_HIT = 5  # `sound` on the frame after a brick was hit
LOWER_PITCHES = (16, 22)  # least pitches of the middle and the lower two rows
ROW_POINTS = (7, 4, 1)  # points of the upper, middle and lower two rows


class Ram(RamMap):
    saver_key = byte(61)  # the game XORs colours with it; 0 in play
    wall = byte(*range(35, -1, -1))  # registers from left to right, in each the rows from the top
    invisible = flag(51, bit=6)  # mode with bricks that flash on a hit
    timed = flag(51, bit=7)  # mode with the time as score
    player = byte(53)  # the current player, from 0
    paddle_size = bits(55, first=4, count=2)
    lives = byte(57)
    paddle_x = byte(72)  # x + 47
    score = bcd((76, 77))
    frame = bits(90, first=0, count=6)
    sound = byte(95)  # frames left
    pitch = byte(96)  # pitch of that sound, by row
    ball_x = byte(99)  # x + 49
    ball_y = byte(101)  # y - 8 or 9; 0: no ball


def decode(m: Ram) -> dict[str, Box]:
    return {
        "Player": box(m.paddle_x - 47, 189, 8 + 4 * ((m.paddle_size + 1) >> 1), 4),
        "Ball": _ball_box(m),
        "Block": box(BLOCK_X, BLOCK_Y, 8, 6, _bricks_left(m)),
        "PlayerScore": _score(m),
        "Live": _digit(LIVES_DIGIT, m.lives),
        "PlayerNumber": _digit(PLAYER_DIGIT, m.player + 1),
    }


def _ball_box(m: Ram) -> Box:
    x = m.ball_x - 49
    y = m.ball_y
    # The screen has an additional row just below the bricks.
    top = y + jnp.where(y < 85, 8, 9)
    bottom = y + jnp.where(y < 81, 12, 13)
    # The game switches the ball off in the middle of the last row.
    off = jnp.where((y & 1) == 1, 46, 56)
    color = pick(reached(top, COLOR_TOPS), (GRAY, *ROWS, RED))  # of its first row
    return box(x, top, 2, bottom - top, color=color).clip(8, 32, 152, jnp.where(x < off, 196, 195))


def _bricks_left(m: Ram) -> jax.Array:
    """True for bricks that exist and are visible, by slot."""
    registers = m.wall.reshape(6, 6).T  # rows, registers
    columns = [registers[:, i : i + 1] >> np.array([bit]) & 1 for i, bit in enumerate(BRICKS)]
    flash = (m.sound > 0) & (m.sound < BRICK_HIT)
    return (jnp.concatenate(columns, axis=1).ravel() == 1) & (~m.invisible | flash)


def _score(m: Ram) -> Box:
    points = pick(reached(m.pitch, LOWER_PITCHES), ROW_POINTS)
    second = jnp.where(m.frame == 0, 1, 0)
    scored = jnp.where(m.sound == BRICK_HIT, points, 0)
    shown = m.score - jnp.where(m.timed, second, scored)
    right = SCORE_DIGITS[-1] + FONT.width
    return score_box(
        FONT, shown, right=right, top=DIGITS_TOP, digits=3, leading_zeros=True, value=m.score
    )


def _digit(left: int, value: jax.Array) -> Box:
    """A single digit; a 1 is one dot wide."""
    is_one = value == 1
    x = jnp.where(is_one, left + 4, left)
    width = jnp.where(is_one, 4, 12)
    return box(x, DIGITS_TOP, width, FONT.height, value=value)


def _number(*lefts: int) -> Bounds:
    """How VEM finds and reads a number."""
    region = (lefts[0], DIGITS_TOP, lefts[-1] + FONT.width, DIGITS_TOP + FONT.height)
    return Bounds(GRAY, region, value=Digits(FONT, lefts, DIGITS_TOP))


# A paddle that touches the foot of the right wall, which has its colour, ends after 16 columns.
PADDLE = Blobs(RED, (8, 189, 160, 193), Shape(w=(8, 26), h=4, split=(16, 4)))
BALL = Bounds((GRAY, *ROWS), FIELD, exclude=("Block", "Player"))
BLOCKS = Cells(ROWS, tuple(BLOCK_X.tolist()), tuple(BLOCK_Y.tolist()), 8, 6)
BLOCK_RGB = tuple(np.repeat(NTSC[list(ROWS)], 18, axis=0))


def _saver_key(m: Ram) -> jax.Array:
    return jnp.where(m.saver_key > 0, m.saver_key, -1)


GAME = Game(
    name="Breakout",
    rom=Rom("breakout", "f34f08e5eb96e500e851a80be3277a56"),
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (8, 0), 0),
    checks=Checks(
        agreement={"modes": 0.92},  # modes with invisible bricks
    ),
    variants=Variants(
        modes={
            0: "the usual game",
            4: "the paddle's movement steers the ball",
            8: "the paddle catches the ball while the button is held",
            12: "bricks are invisible, and flash on a hit",
            16: "against the clock",
            20: "against the clock, the paddle's movement steers the ball",
            24: "against the clock, the paddle catches the ball",
            28: "against the clock, invisible bricks",
            32: "the ball breaks through bricks",
            36: "the ball breaks through bricks, the paddle's movement steers it",
            40: "the ball breaks through bricks, the paddle catches it",
            44: "the ball breaks through bricks, which are invisible",
        },
        difficulties={
            0: "the usual paddle",
            1: "a smaller paddle",
        },
        source="play of all modes in the emulator",
    ),
    categories=(
        Category("Player", PADDLE, role="player", doc="the paddle"),
        Category("Ball", BALL, doc="in the colour of the row it is in"),
        Category("Block", BLOCKS, count=108, rgb=BLOCK_RGB, doc="the bricks that are left"),
        display("PlayerScore", _number(*SCORE_DIGITS), role="score", doc="points, or the time"),
        display("Live", _number(LIVES_DIGIT), role="lives", doc="balls left"),
        display("PlayerNumber", _number(PLAYER_DIGIT), doc="whose turn it is"),
    ),
)
