"""DoubleDunk's ball: how far it has moved since the game placed its sprite."""

import jax
import jax.numpy as jnp
from ocjax.console.ops import div, lookup, match, reached, when
from ocjax.extractors.doubledunk.drawn import Drawn
from ocjax.extractors.doubledunk.ram import Push, Ram

DRIBBLE_SIDE = 3  # columns right of who has the ball from which on he dribbles
SIDES = (0x3C, 0x47)  # `ball_x` between which a shot ball only rises
BASKET = 0x42  # `ball_x` of a ball in the middle of the basket
LOW_LEFT = 0x4F  # line less column from which on a ball at the left moves on every other frame
LOW_RIGHT = 0xD3  # line and column, at the right
NOT_LOOKED = 0x82  # a line in which the drawing loop does not look at the ball
# Columns of the beam when the drawing loop looks at the ball, by the number of sprites drawn and by
# the part of the loop from the bottom of the court upwards; lines where the next part begins.
BEAM_COLUMNS = (28, 40, 0, 4, 19, 52, 64, 31, 28, 106, 76, 97, 76, 76, 76)
PARTS = (14, 54, 107, 130)
CROSSING = 3  # columns later for each address that is on the next page
PLAYER = 8  # in a sum of players and of such addresses


def ball_step(m: Ram) -> jax.Array:
    """The columns that the ball has moved to the right since its sprite was placed.

    The game places the sprite, then moves the ball and draws it.
    """
    moves = (m.frame & 3) == 2
    return match(
        ((m.loose == 0) | (m.waits == 1), _carried(m)),
        (m.passed == 1, _passed(m)),
        (m.falls == 1, when(moves, 1 - 2 * m.flies_left)),
        otherwise=_shot(m),
    )


def _carried(m: Ram) -> jax.Array:
    """The step of a dribbled ball, with the player: he is taken to go on as on the frame before."""
    dribbled = m.ball_x - _of_player(m, m.short_holds) >= DRIBBLE_SIDE
    moves = dribbled & (((m.frame & 3) != 1) | (m.pushes_y == 0))
    side = match((m.pushes == Push.LEFT, -1), (m.pushes == Push.RIGHT, 1), otherwise=0)
    return when(moves, side)


def _passed(m: Ram) -> jax.Array:
    """On its way from one column to another, on every other frame."""
    to = _of_player(m, 1 - m.short_holds)
    moves = ((m.frame & 1) == 1) & (m.ball_x != to)
    return when(moves, jnp.sign(to - _of_player(m, m.short_holds)))


def _of_player(m: Ram, short: jax.Array) -> jax.Array:
    """The column of a player of the team with the ball."""
    column = jnp.where(short == 1, m.x[2:], m.x[:2])
    return jnp.where(m.white_holds == 1, column[1], column[0])


def _shot(m: Ram) -> jax.Array:
    """Towards the basket, first up to lines above the sides, then to its middle."""
    phase = m.frame & 3
    high = jnp.minimum(m.ball_x + LOW_LEFT, LOW_RIGHT - m.ball_x) < m.ball_bottom
    rises = (phase == 2) | ((phase == 0) & high)
    side = match((m.ball_x < SIDES[0], 1), (m.ball_x > SIDES[1], -1), otherwise=0)
    return match(
        (rises, side),
        (((phase & 1) == 1) & (m.descends == 1), jnp.sign(BASKET - m.ball_x)),
        otherwise=0,
    )


def looks_at_ball(m: Ram, drawn: Drawn, line: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Where the drawing loop notices that the ball begins or ends: line and column of the beam.

    It looks a line late at a sprite's end, and not at all while it changes to the next player.
    """
    skipped = when(drawn.changes, 2)[None]
    below = drawn.end[None] - line[:, None]
    line = line - jnp.sum(when((below & ~1) == 0, skipped - below), axis=1)
    line = line - when(line == NOT_LOOKED, 1)
    rows = line[:, None]
    pages = (((m.picture & 255)[None] + rows) >> 8) + ((m.colors[None] + rows) >> 8)
    shown = (drawn.first[None] >= rows) & (rows > drawn.end[None])
    count = jnp.sum(when(shown, PLAYER + pages), axis=1)
    beam = lookup(BEAM_COLUMNS, (len(PARTS) + 1) * (div(count, PLAYER)) + reached(line, PARTS))
    return line, beam + CROSSING * (count & PLAYER - 1)
