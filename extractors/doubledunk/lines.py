"""Which lines of DoubleDunk's figures show: what the ROM's drawing loop makes of them.

Lines: they count upwards, and the loop goes down. A figure shows from its first line down to its
last one; its *end* is the line after that. The game asks for both: `Ram.top` is the line above the
first one, and `Ram.bottom` the last one, which is even in all recordings.

Order: each of the two sprites has an upper figure, and then a lower one. Arrays have them in the
order of drawing: the upper figures of sprite 1 and sprite 0, then their lower ones.

Where the lines differ from what the game asks for, one step a function:

1. A lower figure begins some lines below the end of the upper one (`drawn_lines`).
2. While both sprites show figures, the loop looks at each one's end in every other line only, and
   so may notice it a line late (`_noticed_ends`).
3. Where the other sprite ends or changes to its lower figure, the loop looks at this one's end a
   few lines later (`_delayed`).
4. There, lines of this sprite are also lost or drawn again: at the feet (`_lowest_lines`,
   `_is_repeated`) and at the head (`top_seen`).

A step that is wrong moves the boxes of all figures, because each sprite waits for the other.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import among, match, when
from ocjax.extractors.doubledunk.ram import Ram

SPRITE = np.array((1, 0, 1, 0))  # of each figure
OTHER_UPPER = np.array((1, 0, 1, 0))  # for each figure, the upper one of the other sprite
OTHER_LOWER = np.array((3, 2, 3, 2))
OTHER_SPRITES = np.stack([OTHER_UPPER, OTHER_LOWER])
UPPER_COUNT = 2  # figures
ALL_COUNT = 4

FIRST_LINES = np.array((127, 151))  # of the upper figures at most; above, sprite 1 is the basket
SWITCH = 4  # lines after which a sprite's lower figure can begin
COURT_MIDDLE = range(54, 107)  # lines in which the loop looks at both ends,
UNSEEN_END = 105  # but for the end here, where it draws the court's horizon


class Lines(NamedTuple):
    """The lines of the figures, `[4]` each."""

    first: jax.Array  # the uppermost one
    end: jax.Array  # the line after the last one
    changes: jax.Array  # whether the sprite changes to its lower figure there
    lowest: jax.Array  # lines from the feet up to the lowest one that shows
    repeats: jax.Array  # 1: the last line is drawn again


def drawn_lines(m: Ram, feet: jax.Array) -> Lines:
    """The lines of all figures, whose feet are in some lines."""
    lower_first = jnp.minimum(m.top[2:] - 1, _upper_ends(m) - SWITCH + 1)
    first = jnp.concatenate([_upper_first(m), lower_first])
    end = _delayed(m, _noticed_ends(m, first, ALL_COUNT))
    changes = _sprite_changes(m, end)
    return Lines(
        first=first,
        end=end,
        changes=changes,
        lowest=_lowest_lines(m, feet, end, changes[OTHER_UPPER]),
        repeats=_is_repeated(feet, end, changes[OTHER_UPPER]),
    )


def _upper_first(m: Ram) -> jax.Array:
    return jnp.minimum(m.top[:2] - 1, FIRST_LINES)


def _upper_ends(m: Ram) -> jax.Array:
    """The ends of the upper figures, for which lower ones begin as early as they can."""
    lower_first = jnp.minimum(m.top[2:] - 1, m.bottom[:2] - SWITCH)
    first = jnp.concatenate([_upper_first(m), lower_first])
    return _delayed(m, _noticed_ends(m, first, UPPER_COUNT))


def _noticed_ends(m: Ram, first: jax.Array, count: int) -> jax.Array:
    """The ends of so many figures, if no end or change of the other sprite is near."""
    asked = m.bottom[:count] - 1
    both = _both_from(m, asked, first)
    is_passed_over = match(
        (among(asked, COURT_MIDDLE), asked == UNSEEN_END),
        otherwise=_is_others_turn(asked, both),
    )
    return asked - when((both > 0) & is_passed_over, 1)


def _both_from(m: Ram, line: jax.Array, first: jax.Array) -> jax.Array:
    """The line from which on both sprites show figures down to some line; 0 if they do not."""
    count = len(line)
    others = OTHER_SPRITES[:, :count]
    other_first = first[others]
    beside = (other_first > line[None]) & (m.bottom[others] <= line[None])
    return jnp.max(when(beside, jnp.minimum(other_first, first[None, :count])), axis=0)


def _is_others_turn(asked: jax.Array, both: jax.Array) -> jax.Array:
    """Whether the loop looks at the other sprite's end there, above or below the court's middle.

    Turns begin where both sprites show figures, or anew below the middle. All ends that are asked
    for are odd, so that whose turn it is depends on where turns begin alone.
    """
    is_below = asked < COURT_MIDDLE.start
    begins_anew = is_below & (both >= COURT_MIDDLE.start)
    first_turn = jnp.where(begins_anew, 1, both & 1)
    return (first_turn ^ SPRITE[: len(asked)] ^ when(~is_below, 1)) == 1


def _sprite_changes(m: Ram, end: jax.Array) -> jax.Array:
    """Whether a sprite changes to its lower figure where this one ends, bool `[4]`."""
    return jnp.concatenate([end[:2] >= m.bottom[2:], jnp.zeros(2, bool)])


def _delayed(m: Ram, end: jax.Array) -> jax.Array:
    """The ends where the other sprite's end or change keeps the loop from noticing them.

    It looks at a sprite's end again in the second line below the end of the other one, or later if
    that one changes.
    """
    count = len(end)
    # Of two figures, the lower ones are left out: where they end is not known yet.
    others = OTHER_SPRITES[: count // 2, :count]
    other = end[others]
    late = when(_sprite_changes(m, end)[others], _lines_of_change(m, others))
    above = other - end[None]  # lines from this end up to the other one
    waits = (above >= SPRITE[None, :count]) & (above <= 1 + late)
    return jnp.min(jnp.where(waits, other - 2 - late, end[None]), axis=0)


def _lines_of_change(m: Ram, others: np.ndarray) -> jax.Array:
    """Lines that a change of the other sprite takes: one more if it takes this one for ended."""
    count = others.shape[1]
    looked_up = m.bottom[others] - 3
    next_top = jnp.concatenate([m.top[2:], jnp.zeros(2, m.top.dtype)])[None, :count]
    taken_for_ended = (looked_up < m.bottom[None, :count]) & (looked_up >= next_top)
    return 1 + when(taken_for_ended, 1)


def _lowest_lines(m: Ram, feet: jax.Array, end: jax.Array, other_changes: jax.Array) -> jax.Array:
    """Lines from each figure's feet up to the lowest one that shows.

    While the other sprite changes, two lines of this one show what it has in the second of them. If
    that is nothing, it shows nothing from the other one's end down.
    """
    upper = end[OTHER_UPPER]
    second = m.bottom[OTHER_UPPER] - 2
    has_nothing = ((second < feet) | (second <= m.bottom)) & (second <= feet + 1)
    loses = other_changes & (upper > end) & has_nothing
    return jnp.maximum(end + 1, when(loses, upper + 1)) - feet


def _is_repeated(feet: jax.Array, end: jax.Array, other_changes: jax.Array) -> jax.Array:
    """1 where the line of the feet is drawn again, because the other sprite ends below it.

    At that end, this sprite keeps what it has for one line.
    """
    upper = end[OTHER_UPPER]
    lower = end[OTHER_LOWER]
    return when((feet == lower + 1) | (~other_changes & (feet == upper + 1)), 1)


def top_seen(m: Ram, lines: Lines, top: jax.Array) -> jax.Array:
    """The line of the top of each figure, from that of its picture.

    In the line of the other sprite's end, the line above is drawn again. In the two lines in which
    it changes, a line is drawn again that the game has looked up before.
    """
    other = lines.end[OTHER_SPRITES]
    changes = lines.changes[OTHER_SPRITES]
    repeated = changes & (top[None] >= m.bottom[OTHER_SPRITES] - 2)
    again = (other >= top[None]) & (other - top[None] <= when(changes, 1))
    seen = match((repeated, other), (changes, other - 2), otherwise=other - 1) - top[None]
    return top + jnp.sum(when(again, seen), axis=0)
