"""The colours of Alien's eggs.

Two sprites draw the figures. The first draws the three aliens; the second draws the crewman, the
pulsar or his flame, and the rocket. Each sprite takes one figure after another from the top down,
with its colour. Figures outside the maze follow, and finally the colour of the display. Eggs are
missiles in the colours of their sprites: in each half, the left three of six columns belong to the
first sprite, the others to the second one. The second sprite takes figures above a row of eggs, not
within it. If two figures of a sprite are too close below each other, the game alternately skips
one. Odd frames draw the eggs of the right half, even frames the eggs of the left half.
"""

import functools
from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np

SPRITES = (0, 1, 2), (3, 4, 5)  # figures
PLAYER = 3  # the tallest figure
DISPLAY_FIGURE = 6  # substitute for an absent figure
# By sprite, and for the player: a figure's least distance from the next one, and the row where the
# sprite takes the next figure after a figure at 0.
SPRITE_SPACINGS = (12, 11)
PLAYER_SPACING = 15
SPRITE_TAKEN = (210, 211)
PLAYER_TAKEN = 219
NOT_THERE = 511  # that row of an absent figure
STAGGER = 2  # rows from an egg to its right neighbour, of three


def colors_of_eggs(
    y: Sequence[jax.Array], colors: jax.Array, frame: jax.Array, tops: np.ndarray
) -> jax.Array:
    """Palette indices of eggs, the left half first, by column in each row.

    Args:
        y: of the six figures, in steps of two rows from the bottom; 0: not in the maze.
        colors: of the six figures and the display.
        frame: the number of the last drawn frame.
        tops: the first rows of the eggs in the first column.
    """
    # The last frames that drew each half.
    left = frame - (frame & 1)
    right = frame - 1 | 1
    return jnp.concatenate([_of_half(y, colors, n, tops).ravel() for n in (left, right)])


def _of_half(
    y: Sequence[jax.Array], colors: jax.Array, frame: jax.Array, tops: np.ndarray
) -> jax.Array:
    """The colours of a half's eggs, by row and column."""
    first = _words_of_turns(y, colors, 0, frame)
    second = _words_of_turns(y, colors, 1, frame)
    last = NOT_THERE << 11 | DISPLAY_FIGURE << 8 | colors[DISPLAY_FIGURE]
    by_first = [_color(first, last, tops + STAGGER * column) for column in range(3)]
    by_second = _color(second, last, tops)
    return jnp.stack([*by_first, by_second, by_second, by_second], axis=1)


def _color(turns: Sequence[jax.Array], last: jax.Array, row: np.ndarray) -> jax.Array:
    """The colour of a sprite in some rows, from its figures' words."""
    later = (jnp.where(turn >= row + 1 << 11, turn, NOT_THERE << 12) for turn in turns)
    return functools.reduce(jnp.minimum, later, last) & 255


def _words_of_turns(
    y: Sequence[jax.Array], colors: jax.Array, sprite: int, frame: jax.Array
) -> tuple[jax.Array, ...]:
    """Words of a sprite's figures: the end row of its colour, figure and colour.

    The word of a figure that the game skips on a frame is 0.
    """
    figures = (y[i] << 11 | (DISPLAY_FIGURE - i) << 8 | colors[i] for i in SPRITES[sprite])
    top, middle, bottom = _from_the_top(*figures)
    odd = (frame & 1) == 1
    first_close = _is_close(top, middle, sprite)
    first_later = odd == _comes_later(top, middle)
    middle_waits = first_close & ~first_later
    upper = jnp.where(middle_waits, top, middle)
    is_later = jnp.where(first_close, (frame & 2) != 0, odd) == _comes_later(upper, bottom)
    close = _is_close(upper, bottom, sprite)
    top_out = first_close & first_later | close & is_later & middle_waits
    middle_out = middle_waits | (close & is_later)
    bottom_out = close & ~is_later
    words = (top, top_out), (middle, middle_out), (bottom, bottom_out)
    return tuple(jnp.where(out, 0, _word_of_turn(word, sprite)) for word, out in words)


def _from_the_top(a: jax.Array, b: jax.Array, c: jax.Array) -> tuple[jax.Array, ...]:
    """Three words, the greatest first."""
    larger = jnp.maximum(a, b)
    smaller = jnp.minimum(a, b)
    rest = jnp.minimum(larger, c)
    return jnp.maximum(larger, c), jnp.maximum(smaller, rest), jnp.minimum(smaller, rest)


def _of_player(word: jax.Array) -> jax.Array:
    return (word >> 8 & 7) == DISPLAY_FIGURE - PLAYER


def _is_close(upper: jax.Array, lower: jax.Array, sprite: int) -> jax.Array:
    spacing = jnp.where(_of_player(upper), PLAYER_SPACING, SPRITE_SPACINGS[sprite])
    return ((upper >> 11) - (lower >> 11) < spacing) & (lower >= 1 << 11)


def _comes_later(upper: jax.Array, lower: jax.Array) -> jax.Array:
    """True if the upper figure has the larger number."""
    return (upper >> 8 & 7) < (lower >> 8 & 7)


def _word_of_turn(word: jax.Array, sprite: int) -> jax.Array:
    taken = jnp.where(_of_player(word), PLAYER_TAKEN, SPRITE_TAKEN[sprite])
    row = jnp.where(word >= 1 << 11, taken - 2 * (word >> 11), NOT_THERE)
    return row << 11 | DISPLAY_FIGURE - (word >> 8 & 7) << 8 | word & 255
