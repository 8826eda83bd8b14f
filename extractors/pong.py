"""Pong: two paddles, a ball and two scores.

Picture: docs/games/Pong.png

Screen: Player is the right paddle (green), Enemy the left one (orange). The white walls above and
below the court are scenery: paddles and the ball are drawn under them and end at the court's first
and last row.

RAM: ALE's source (scores), OCAtari 2.2 and AtariARI (positions), and the ROM's drawing loop for the
rest. Each iteration of the loop draws two rows and waits for the beam once. Therefore a paddle
starts at an even count, and the ball is switched on and off in the middle of a row: left of the
beam it is one row lower.

Covered: both modes, all four difficulties (A halves a side's paddle), points of both sides, the end
of the game, and the first two frames after a reset, which have the screen saver's colours. All of
31,000 boxes on unseen play are exact.

Not exact: nothing known.
"""

import jax
import jax.numpy as jnp
from ocjax.authoring import (
    DIGITS_3X5,
    Bounds,
    Box,
    Category,
    Digits,
    Game,
    RamMap,
    Rom,
    Variants,
    box,
    byte,
    choose,
    display,
    hex_font,
    score_box,
    wrap,
)

COURT = (0, 34, 160, 194)
# in play, in the screen saver
WHITE = (14, 210)
GREEN = (200, 138)
ORANGE = (56, 250)
WHITE_RGB = (236, 236, 236)
GREEN_RGB = (92, 186, 92)
ORANGE_RGB = (213, 130, 74)

FONT = hex_font(DIGITS_3X5, dots=3, dot=(4, 4), pitch=16)
# left columns
PLAYER_DIGITS = (100, 116)
ENEMY_DIGITS = (20, 36)
SCORE_TOP = 1

NEW_GAME = 60  # of `begin`: on this frame the ball still has its position from the console's start
NEW_GAME_BALL = (2, 45, 2, 4)
POINT_MADE = 63  # of `pause`: on this frame the digits still show the score before the point
# values of `scorer`
ENEMY = 0
PLAYER = 1


class Ram(RamMap):
    paddle_read = byte(4)  # turn of the drawing loop that read the paddle's position
    begin = byte(10)
    pause = byte(11)  # frames until the next serve
    enemy_score = byte(13)
    player_score = byte(14)
    scorer = byte(18)  # the side that made the last point
    enemy_mask = byte(37)  # 256 - height
    player_mask = byte(38)  # 256 - height
    ball_x = byte(49)  # x + 49
    enemy_y = byte(50)  # y + 15
    player_y = byte(51)  # y + 14
    ball_y = byte(54)  # y + 14 or 15; on the first frame of a game the same as `begin`


def decode(m: Ram) -> dict[str, Box]:
    return {
        "Player": _paddle(140, m.player_y, 14, m.player_mask),
        "Enemy": _paddle(16, m.enemy_y, 15, m.enemy_mask),
        "Ball": _ball(m),
        "PlayerScore": _score(m, PLAYER, m.player_score, PLAYER_DIGITS),
        "EnemyScore": _score(m, ENEMY, m.enemy_score, ENEMY_DIGITS),
    }


def _paddle(x: int, y: jax.Array, offset: int, mask: jax.Array) -> Box:
    even = (y + 1) & ~1  # the loop draws two rows per turn
    return box(x, even - offset, 4, 256 - mask).clip(*COURT)


def _ball(m: Ram) -> Box:
    x = wrap((m.ball_x - 49) & 255)
    top = _switched(m, m.ball_y, x + 1)
    bottom = _switched(m, m.ball_y + 4, x)
    begins = (m.begin == NEW_GAME) & (m.ball_y == NEW_GAME)
    return choose(begins, box(*NEW_GAME_BALL), box(x, top, 2, bottom - top)).clip(*COURT)


def _switched(m: Ram, count: jax.Array, x: jax.Array) -> jax.Array:
    """First row of column x after the loop switches the ball at a count.

    The beam is in the middle of a row at that time. Its column depends on the loop's branches,
    which differ by one cycle (three pixels) if a paddle is not drawn.
    """
    odd = m.ball_y & 1
    turn = count - odd
    no_player = ((turn - m.player_y) & m.player_mask) != 0
    no_enemy = ((turn + 2 - m.enemy_y) & m.enemy_mask) != 0
    even_beam = 149 + jnp.where(no_player, 3, 0) + jnp.where(turn <= m.paddle_read, 6, 0)
    beam = even_beam + odd * jnp.where(no_enemy, -19, -22)
    return count - jnp.where(x < beam, 14, 15)


def _score(m: Ram, side: int, value: jax.Array, lefts: tuple[int, int]) -> Box:
    old = (m.pause == POINT_MADE) & (m.scorer == side)
    shown = jnp.where(old, value - 1, value)
    right = lefts[-1] + FONT.width
    return score_box(FONT, shown, right=right, top=SCORE_TOP, digits=2, value=value)


def _number(lefts: tuple[int, int], colors: tuple[int, ...]) -> Bounds:
    """VEM's rule for finding and reading a score."""
    region = (lefts[0], SCORE_TOP, lefts[-1] + FONT.width, SCORE_TOP + FONT.height)
    return Bounds(colors, region, value=Digits(FONT, lefts, SCORE_TOP))


GAME = Game(
    name="Pong",
    rom=Rom("pong", "60e0ea3cbe0913d39803477945e9e5ec"),
    ram=Ram,
    decode=decode,
    variants=Variants(
        difficulties={
            0: "paddles of 16 rows",
            1: "the opponent's paddle has 8 rows",
            2: "the player's paddle has 8 rows",
            3: "both paddles have 8 rows",
        },
        source="ALE's source code, and play of all difficulties in the emulator",
    ),
    categories=(
        Category(
            "Player",
            Bounds(GREEN, (140, 34, 144, 194)),
            rgb=GREEN_RGB,
            role="player",
            doc="right paddle",
        ),
        Category("Enemy", Bounds(ORANGE, (16, 34, 20, 194)), rgb=ORANGE_RGB, doc="left paddle"),
        Category("Ball", Bounds(WHITE, COURT), rgb=WHITE_RGB, doc="the ball, while it is in play"),
        display(
            "PlayerScore",
            _number(PLAYER_DIGITS, GREEN),
            rgb=GREEN_RGB,
            role="score",
            doc="points of the right paddle",
        ),
        display(
            "EnemyScore",
            _number(ENEMY_DIGITS, ORANGE),
            rgb=ORANGE_RGB,
            role="opponent_score",
            doc="points of the left paddle",
        ),
    ),
)
