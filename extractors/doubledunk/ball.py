"""DoubleDunk's ball: its motion since the game placed its sprite."""

import jax
import jax.numpy as jnp
from ocjax.authoring import among, div, lookup, match, reached, when
from ocjax.extractors.doubledunk.lines import Lines
from ocjax.extractors.doubledunk.ram import Push, Ram

DRIBBLE_SIDE = 3  # least columns right of the player at which he dribbles the ball
LEFT_SIDE = 0x3C  # a ball that rises moves right only below this `ball_x`
RIGHT_SIDE = 0x47  # a ball that rises moves left only above this one
BASKET = 0x42  # `ball_x` of a ball in the middle of the basket
HIGH_LEFT = 0x4F  # a ball is high if its line is above this plus `ball_x`,
HIGH_RIGHT = 0xD3  # or above this minus `ball_x`
NOT_LOOKED = 0x82  # a line in which the drawing loop ignores the ball

PARTS = (14, 54, 107, 130)  # first lines of the drawing loop's parts, upwards
# Columns of the beam when the drawing loop checks the ball, by part of the loop.
BEAM_COLUMNS = (
    *(28, 40, 0, 4, 19),  # no drawn sprite
    *(52, 64, 31, 28, 106),  # one
    *(76, 97, 76, 76, 76),  # both
)
CROSSING = 3  # columns later for each address on the next page
PLAYER = 8  # in a sum of players and of such addresses


def ball_step(m: Ram) -> jax.Array:
    """The columns that the ball has moved to the right since its sprite was placed.

    The game places the sprite, then moves the ball and draws it.
    """
    moves = (m.frame & 3) == 2  # a ball that falls
    return match(
        (~m.loose | m.waits, _carried(m)),
        (m.passed, _passed(m)),
        (m.falls, when(moves, jnp.where(m.flies_left, -1, 1))),
        otherwise=_step_of_shot(m),
    )


def _carried(m: Ram) -> jax.Array:
    """The step of a dribbled ball with its player, who presumably continues as before.

    The RAM holds the push on this frame, not the push on the last one.
    """
    dribbled = m.ball_x - _of_player(m, m.short_holds) >= DRIBBLE_SIDE
    moves = dribbled & (((m.frame & 3) != 1) | (m.pushes_y == 0))
    side = match((m.pushes == Push.LEFT, -1), (m.pushes == Push.RIGHT, 1), otherwise=0)
    return when(moves, side)


def _passed(m: Ram) -> jax.Array:
    """The step of a passed ball from one column to another, on every other frame."""
    to = _of_player(m, ~m.short_holds)
    moves = ((m.frame & 1) == 1) & (m.ball_x != to)
    return when(moves, jnp.sign(to - _of_player(m, m.short_holds)))


def _of_player(m: Ram, is_short: jax.Array) -> jax.Array:
    """The column of the short or the tall player of the team with the ball."""
    column = jnp.where(is_short, m.x[2:], m.x[:2])
    return jnp.where(m.white_holds, column[1], column[0])


def _step_of_shot(m: Ram) -> jax.Array:
    """The step of a ball that was shot at the basket.

    It moves a column to the basket on every fourth frame, and on every other frame while it is
    high, until it is between the sides. On the frames between, a descending ball moves to the
    middle.
    """
    phase = m.frame & 3
    is_high = (m.ball_bottom > m.ball_x + HIGH_LEFT) | (m.ball_bottom > HIGH_RIGHT - m.ball_x)
    to_sides = match((m.ball_x < LEFT_SIDE, 1), (m.ball_x > RIGHT_SIDE, -1), otherwise=0)
    return match(
        ((phase == 2) | ((phase == 0) & is_high), to_sides),
        (((phase & 1) == 1) & m.descends, jnp.sign(BASKET - m.ball_x)),
        otherwise=0,
    )


def looks_at_ball(m: Ram, lines: Lines, line: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Line and column of the beam when the drawing loop notices the ball's start or end.

    The loop checks a line late at a sprite's end, and not at all while it changes to the next
    player.
    """
    skipped = when(lines.changes, 2)[None]
    below = lines.end[None] - line[:, None]
    is_at_end = among(below, range(2))
    before_skip = line - jnp.sum(when(is_at_end, skipped - below), axis=1)
    noticed = before_skip - when(before_skip == NOT_LOOKED, 1)
    return noticed, _beam(m, lines, noticed)


def _beam(m: Ram, lines: Lines, line: jax.Array) -> jax.Array:
    """The column of the beam when the drawing loop checks the ball in some lines.

    Each drawn sprite takes time, and more if an address of its picture or colours is on the page
    after line 0's page.
    """
    rows = line[:, None]
    pages = (((m.picture & 255)[None] + rows) >> 8) + ((m.colors[None] + rows) >> 8)
    shown = (lines.first[None] >= rows) & (rows > lines.end[None])
    count = jnp.sum(when(shown, PLAYER + pages), axis=1)
    sprites = div(count, PLAYER)
    crossings = count & PLAYER - 1
    column = lookup(BEAM_COLUMNS, (len(PARTS) + 1) * sprites + reached(line, PARTS))
    return column + CROSSING * crossings
