"""Pong: two paddles, a ball and two scores.

Player is the right paddle (green), Enemy the left one (orange). The white walls above and below the court are scenery: paddles and
the ball are drawn under them and end at the court's first and last row.

RAM: ALE's source (scores), OCAtari 2.2 and AtariARI (positions), and the ROM's drawing loop for what they leave open. The loop
draws two rows a turn with one wait for the beam: a paddle starts at an even count, and the ball is switched on and off in the
middle of a row, so that left of the beam it sits a row lower. Every box of 31,000 on unseen play is exact.

Covered: both modes, all four difficulties (A halves a side's paddle), points of both sides, the end of the game, and the first two
frames after a reset, which have the screen saver's colours.
"""

import jax
import jax.numpy as jnp

from ocjax.ram import RamMap, byte
from ocjax.spec import DIGITS_3X5, Bounds, Box, Category, Digits, Game, box

COURT = (0, 34, 160, 194)
WHITE, GREEN, ORANGE = (14, 210), (200, 138), (56, 250)  # in play, in the screen saver


class Ram(RamMap):
    paddle_read = byte(4)  # turn of the drawing loop in which the paddle's position was read from its port
    pause = byte(11)  # frames until the next serve, 63 when a point is made
    enemy_score = byte(13)
    player_score = byte(14)
    scorer = byte(18)  # who made the last point: 0 enemy, 1 player
    enemy_mask = byte(37)  # 256 - height
    player_mask = byte(38)
    ball_x = byte(49)  # x + 49
    enemy_y = byte(50)  # y + 15
    player_y = byte(51)  # y + 14
    ball_y = byte(54)  # y + 14 or 15


def decode(m: Ram) -> dict[str, Box]:
    old = m.pause == 63  # the digits on the screen are still those before the point
    return {
        "Player": box(140, _even(m.player_y) - 14, 4, 256 - m.player_mask).clip(*COURT),
        "Enemy": box(16, _even(m.enemy_y) - 15, 4, 256 - m.enemy_mask).clip(*COURT),
        "Ball": _ball(m),
        "PlayerScore": _score(100, m.player_score, old & (m.scorer == 1)),
        "EnemyScore": _score(20, m.enemy_score, old & (m.scorer == 0)),
    }


def _even(y: jax.Array) -> jax.Array:
    return (y + 1) & ~1


def _ball(m: Ram) -> Box:
    x = (m.ball_x - 49) & 255
    x = jnp.where(x < 160, x, x - 160)
    odd = m.ball_y & 1

    def row(y: jax.Array, x: jax.Array) -> jax.Array:
        """Where the ball's column x changes when the loop switches it at the count y."""
        turn = y - odd
        no_player = ((turn - m.player_y) & m.player_mask) != 0  # the loop's branches differ by one cycle, three pixels
        no_enemy = ((turn + 2 - m.enemy_y) & m.enemy_mask) != 0
        beam = 149 + jnp.where(no_player, 3, 0) + jnp.where(turn <= m.paddle_read, 6, 0) + odd * jnp.where(no_enemy, -19, -22)
        return y - jnp.where(x < beam, 14, 15)

    top, bottom = row(m.ball_y, x + 1), row(m.ball_y + 4, x)
    return box(x, top, 2, bottom - top).clip(*COURT)


def _score(left: int, value: jax.Array, old: jax.Array) -> Box:
    """Tight around two digits of three columns, 4 pixels each; a 1 is the middle column."""
    shown = jnp.where(old, value - 1, value)
    tens = shown * 13 >> 7  # shown // 10 for all scores there are
    ones = shown - 10 * tens
    first = jnp.where(tens == 0, jnp.where(ones == 1, 20, 16), jnp.where(tens == 1, 4, 0))
    last = jnp.where(ones == 1, 24, 28)
    return box(left + first, 1, last - first, 20, value=value)


GAME = Game(
    name="Pong",
    rom="pong",
    md5="60e0ea3cbe0913d39803477945e9e5ec",
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", Bounds(GREEN, (140, 34, 144, 194)), rgb=(92, 186, 92), doc="right paddle"),
        Category("Enemy", Bounds(ORANGE, (16, 34, 20, 194)), rgb=(213, 130, 74), doc="left paddle"),
        Category("Ball", Bounds(WHITE, COURT), rgb=(236, 236, 236), doc="the ball, while it is in play"),
        Category(
            "PlayerScore",
            Bounds(GREEN, (100, 1, 128, 21), value=Digits((100, 116), 1, (3, 5), (4, 4), DIGITS_3X5)),
            hud=True,
            attributes=("value",),
            rgb=(92, 186, 92),
            doc="points of the right paddle",
        ),
        Category(
            "EnemyScore",
            Bounds(ORANGE, (20, 1, 48, 21), value=Digits((20, 36), 1, (3, 5), (4, 4), DIGITS_3X5)),
            hud=True,
            attributes=("value",),
            rgb=(213, 130, 74),
            doc="points of the left paddle",
        ),
    ),
)
