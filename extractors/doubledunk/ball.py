"""DoubleDunk's ball: its motion since the game placed its sprite."""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import among, lookup, match, reached, when
from ocjax.extractors.doubledunk.lines import Lines
from ocjax.extractors.doubledunk.ram import Push, Ram

DRIBBLE_SIDE = 3  # least columns right of the player at which he dribbles the ball
LEFT_SIDE = 0x3C  # a ball that rises moves right only below this `ball_x`
RIGHT_SIDE = 0x47  # a ball that rises moves left only above this one
BASKET = 0x42  # `ball_x` of a ball in the middle of the basket
HIGH_LEFT = 0x4F  # a ball is high if its line is above this plus `ball_x`,
HIGH_RIGHT = 0xD3  # or above this minus `ball_x`
NOT_LOOKED = 0x82  # in this line the drawing loop positions sprite 1, and ignores the ball

# First lines of the drawing loop's parts but the lowest, upwards.
PARTS = (14, 54, 106, 107, 108, 129, 130)
# The cycle of the line at which the loop begins to switch the ball (`STA ENAM0,X`, the first one at
# $D060 of bank 2): a row for each number of sprites that the line shows, a column for each part.
SWITCH_CYCLES = np.array(
    [  # lines 0-13, 14-53, 54-105, 106, 107, 108-128, 129, 130 and more
        (28, 32, 12, 27, 36, 20, 24, 25),  # no sprite
        (36, 40, 29, 43, 44, 28, 40, 54),  # one
        (44, 51, 44, 59, 55, 44, 44, 44),  # both
    ]
)
WRITE_CYCLES = 4  # of `STA ENAM0,X`
FIRST_COLUMN_DOT = 68  # dots of a line, three per cycle, before the screen's first column


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

    If the ball starts or ends in the line of a figure's end or in the next line below, the loop
    notices it in the end's line; two lines later if the sprite changes to its lower figure there.
    """
    at = line[:, None]  # for each figure
    is_near_end = among(lines.end[None] - at, range(2))
    seen = lines.end - when(lines.changes, 2)
    moved = line + jnp.sum(when(is_near_end, seen[None] - at), axis=1)
    noticed = moved - when(moved == NOT_LOOKED, 1)
    return noticed, _beam(m, lines, noticed)


def _beam(m: Ram, lines: Lines, line: jax.Array) -> jax.Array:
    """The column of the beam when the drawing loop switches the ball in some lines.

    For each sprite that the line shows, the loop reads a row of the picture and its colour. A read
    takes one more cycle if the row is on the page after line 0's.
    """
    at = line[:, None]  # for each figure
    is_shown = (lines.first[None] >= at) & (at > lines.end[None])
    further_pages = ((m.picture & 255)[None] + at >> 8) + (m.colors[None] + at >> 8)
    sprites = jnp.sum(when(is_shown, 1), axis=1)
    late = jnp.sum(when(is_shown, further_pages), axis=1)
    place = SWITCH_CYCLES.shape[1] * sprites + reached(line, PARTS)
    cycle = lookup(SWITCH_CYCLES.ravel(), place) + late
    return 3 * (cycle + WRITE_CYCLES) - FIRST_COLUMN_DOT
