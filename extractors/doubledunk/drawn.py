"""DoubleDunk's players as the game has drawn them."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.ops import among, lookup, match, when
from ocjax.console.registers import position
from ocjax.extractors.doubledunk.ram import ROM, Ram

LEFT = 4  # `position` of column 0
FIRST_COLUMN = 11  # of a player whose x is 0
MOST_MOVED = 8  # columns of a player since he was drawn
BIG_HEAD = 27  # lines from a big player's place to above his head
SMALL_HEAD = 24
FIRST_LINES = np.array((127, 151))  # of the sprites 1 and 0; the basket has sprite 1 above that
SPRITES = np.array((1, 0, 1, 0))  # that draw the four figures
OTHER_SPRITE = np.array(((1, 0, 1, 0), (3, 2, 3, 2)))  # upper and lower figure of the other sprite
COURT_MIDDLE = range(0x36, 0x6B)  # lines of the court's middle
UNSEEN_END = 105  # where the loop draws the court's horizon, it does not look at ends
SWITCH = 4  # lines after which a sprite's second player can begin

# The pictures of a figure: small and big by turns.
FIGURE_COUNT = 32
ADDRESSES = ROM.bytes(0x3E50, FIGURE_COUNT) + 256 * ROM.bytes(0x3E70, FIGURE_COUNT)
PLACES = (ADDRESSES & 0xFFF) + 0x2000  # in the ROM
HEADS = np.where(np.arange(FIGURE_COUNT) % 2, BIG_HEAD, SMALL_HEAD)
LINES = BIG_HEAD + 1  # of a picture at most, with the empty ones


def _figure_table() -> tuple[int, np.ndarray]:
    """The first address of line 27 below a head, and the figure of each from there on; -1: none."""
    below = ADDRESSES + HEADS - BIG_HEAD
    out = np.full(below.max() - below.min() + 1, -1)
    out[below - below.min()] = np.arange(FIGURE_COUNT)
    return int(below.min()), out


FIRST_ADDRESS, FIGURE_OF = _figure_table()


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Drawn:
    """The players as they are drawn, `[4]` each."""

    figure: jax.Array  # -1: none
    mirrored: jax.Array
    x: jax.Array
    y: jax.Array  # line of the feet
    low: jax.Array  # first drawn line above the feet
    more: jax.Array  # 1: his last line is drawn twice
    first: jax.Array  # his uppermost line
    end: jax.Array  # the line after his last one
    changes: jax.Array  # there the sprite changes to the lower figure


def as_drawn(m: Ram) -> Drawn:
    """The players in the order of drawing, from what the game has made of them for the frame."""
    below = m.picture + m.top - BIG_HEAD - FIRST_ADDRESS
    known = (below >= 0) & (below < len(FIGURE_OF))
    figure = jnp.where(known, lookup(FIGURE_OF, below), -1)
    y = m.top - jnp.where((figure & 1) == 1, BIG_HEAD, SMALL_HEAD)
    first, end = _drawn_lines(m)
    low, more = _disturbed(m, y, end)
    twice = (m.picture[2:] == m.picture[:2]) & (m.top[2:] == m.top[:2])
    figure = jnp.concatenate([figure[:2], jnp.where(twice, -1, figure[2:])])
    mirrored = jnp.stack([m.mirrored_right, m.mirrored] * 2)
    x = position(m.coarse, m.fine) - LEFT
    x = jnp.concatenate([x[:3], _last_column(m, x[3], y[3], figure[3])[None]])
    return Drawn(figure, mirrored, x, y, low, more, first, end, _sprite_changes(m, end))


def _last_column(m: Ram, x: jax.Array, y: jax.Array, figure: jax.Array) -> jax.Array:
    """The column of the last figure; at the beginning of a shot, the game has another use for it.

    Then it is that of the player of its size who is nearer in his line.
    """
    big = (figure & 1) == 1
    columns = jnp.where(big, m.x[:2], m.x[2:]) + FIRST_COLUMN
    off = jnp.abs(jnp.where(big, m.y[:2], m.y[2:]) - y)
    known = jnp.any(jnp.abs(columns - x) <= MOST_MOVED)
    return match((known, x), (off[0] <= off[1], columns[0]), otherwise=columns[1])


def _drawn_lines(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The first line of each figure, and the one after its last line."""
    start = jnp.minimum(m.top - 1, jnp.concatenate([FIRST_LINES, m.bottom[:2] - SWITCH]))
    upper = _delayed(m, _natural_end(m, start, 2))
    lower = jnp.minimum(m.top[2:] - 1, upper - SWITCH + 1)
    start = jnp.concatenate([start[:2], lower])
    return start, _delayed(m, _natural_end(m, start, 4))


def _natural_end(m: Ram, start: jax.Array, count: int) -> jax.Array:
    """The line after the last one of so many figures, unless the other sprite's end is near.

    Where both sprites show figures above or below the middle of the court, the drawing loop looks
    at each sprite's end in every other line only.
    """
    line = m.bottom[:count] - 1
    both = _both_from(m, line, start, count)
    is_below = line < COURT_MIDDLE.start
    is_from_middle = is_below & (both >= COURT_MIDDLE.start)
    turn = jnp.where(is_from_middle, 1, both & 1) ^ SPRITES[:count] ^ when(~is_below, 1)
    is_passed_over = match(
        (among(line, COURT_MIDDLE), line == UNSEEN_END),
        otherwise=turn == 1,
    )
    return line - when((both > 0) & is_passed_over, 1)


def _both_from(m: Ram, line: jax.Array, start: jax.Array, count: int) -> jax.Array:
    """The line from which on both sprites show figures down to some line; 0 if they do not."""
    others = OTHER_SPRITE[:, :count]
    begins = start[others]
    beside = (begins > line[None]) & (m.bottom[others] <= line[None])
    return jnp.max(when(beside, jnp.minimum(begins, start[None, :count])), axis=0)


def _sprite_changes(m: Ram, end: jax.Array) -> jax.Array:
    """Whether a sprite changes to its lower figure where this one ends, bool `[4]`."""
    return jnp.concatenate([end[:2] >= m.bottom[2:], jnp.zeros(2, bool)])


def _delayed(m: Ram, end: jax.Array) -> jax.Array:
    """The line after each figure's last one, where the other sprite's end or change keeps the loop.

    It looks at a sprite's end again in the second line below the end of the other one, or in the
    third below its change, and a line later if it has taken this sprite for ended.
    """
    count = len(end)
    others = OTHER_SPRITE[: count // 2, :count]
    other, looked_up = end[others], m.bottom[others] - 3
    next_top = jnp.concatenate([m.top[2:], jnp.zeros(2, m.top.dtype)])[None, :count]
    taken_for_ended = (looked_up < m.bottom[None, :count]) & (looked_up >= next_top)
    late = when(_sprite_changes(m, end)[others], 1 + when(taken_for_ended, 1))
    above = other - end[None]  # lines from this end up to the other one
    waits = (above >= SPRITES[None, :count]) & (above <= 1 + late)
    return jnp.min(jnp.where(waits, other - 2 - late, end[None]), axis=0)


def _disturbed(m: Ram, y: jax.Array, end: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Each figure's lowest line above its feet, and whether its last line is drawn twice.

    While one sprite changes from a figure to the next, two lines of the other sprite show what it
    has in the second one. At the last figure's end, it keeps what it has for one line.
    """
    upper, lower = end[OTHER_SPRITE[0]], end[OTHER_SPRITE[1]]
    shown_twice = m.bottom[OTHER_SPRITE[0]] - 2
    changes = upper >= m.bottom[OTHER_SPRITE[1]]
    is_beyond = (shown_twice < y) | (shown_twice <= m.bottom)
    loses = changes & (upper > end) & is_beyond & (shown_twice <= y + 1)
    low = jnp.maximum(end + 1, when(loses, upper + 1)) - y
    is_twice = (y == lower + 1) | (~changes & (y == upper + 1))
    return low, when(is_twice, 1)


def top_seen(m: Ram, drawn: Drawn, top: jax.Array) -> jax.Array:
    """The line of the top of each figure, from that of its picture.

    In the line of the other sprite's end, the line above is drawn again. In the two lines in which
    it changes, a line is drawn again that the game has looked up before.
    """
    other, changes = drawn.end[OTHER_SPRITE], drawn.changes[OTHER_SPRITE]
    repeated = changes & (top[None] >= m.bottom[OTHER_SPRITE] - 2)
    again = (other >= top[None]) & (other - top[None] <= when(changes, 1))
    seen = match((repeated, other), (changes, other - 2), otherwise=other - 1) - top[None]
    return top + jnp.sum(when(again, seen), axis=0)
