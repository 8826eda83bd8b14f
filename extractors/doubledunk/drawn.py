"""DoubleDunk's players as drawn: pictures, positions and visible lines."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from ocjax.authoring import match, position
from ocjax.extractors.doubledunk.lines import Lines, drawn_lines
from ocjax.extractors.doubledunk.pictures import (
    BIG_HEAD,
    NO_PICTURE,
    SMALL_HEAD,
    figure_below,
    is_big,
)
from ocjax.extractors.doubledunk.ram import Ram

LEFT = 4  # `position` of column 0
FIRST_COLUMN = 11  # of a player at x 0
MOST_MOVED = 8  # columns of a player since the drawing


class Drawn(NamedTuple):
    """The players as drawn, `[4]` each, in the order of `lines`."""

    figure: jax.Array  # number of the picture; NO_PICTURE: none
    mirrored: jax.Array  # bool
    x: jax.Array  # column of the screen
    feet: jax.Array  # line
    lines: Lines


def as_drawn(m: Ram) -> Drawn:
    """The players in the order of drawing, from the game's values for the frame."""
    known = figure_below(m.picture + m.top)
    feet = m.top - jnp.where(is_big(known), BIG_HEAD, SMALL_HEAD)
    figure = _without_doubles(m, known)
    x = position(m.coarse, m.fine) - LEFT
    last = _last_column(m, x[3], feet[3], figure[3])
    return Drawn(
        figure=figure,
        mirrored=jnp.stack([m.mirrors_1, m.mirrors_0] * 2),
        x=jnp.concatenate([x[:3], last[None]]),
        feet=feet,
        lines=drawn_lines(m, feet),
    )


def _without_doubles(m: Ram, figure: jax.Array) -> jax.Array:
    """The figures; a sprite with one player has him as its lower figure, too."""
    twice = (m.picture[2:] == m.picture[:2]) & (m.top[2:] == m.top[:2])
    return jnp.concatenate([figure[:2], jnp.where(twice, NO_PICTURE, figure[2:])])


def _last_column(m: Ram, x: jax.Array, feet: jax.Array, figure: jax.Array) -> jax.Array:
    """The column of the last figure; the game overwrites it at the beginning of a shot.

    Then use the player of its size in the nearer line.
    """
    big = is_big(figure)
    columns = jnp.where(big, m.x[:2], m.x[2:]) + FIRST_COLUMN
    off = jnp.abs(jnp.where(big, m.y[:2], m.y[2:]) - feet)
    known = jnp.any(jnp.abs(columns - x) <= MOST_MOVED)
    return match((known, x), (off[0] <= off[1], columns[0]), otherwise=columns[1])
