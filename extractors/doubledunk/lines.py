"""Visible lines of DoubleDunk's figures, as the ROM's drawing loop produces them.

Lines: they count upwards, and the loop goes down. A figure is visible from its first line down to
its last one; its *end* is the line after that. The game requests both: `Ram.top` is the line above
the first one. `Ram.bottom` is the last one, which is even in all recordings.

Order: each of the two sprites has an upper figure, and then a lower one. Arrays have them in the
order of drawing: the upper figures of sprite 1 and sprite 0, then their lower ones.

The lines differ from the request in these cases, one function each:

1. A lower figure begins some lines below the end of the upper one (`drawn_lines`).
2. While both sprites show figures, the loop checks each one's end in every other line only, and
   may notice it a line late (`_noticed_ends`).
3. If the other sprite ends or changes to its lower figure, the loop checks this one's end a few
   lines later (`_delayed`).
4. There, lines of this sprite are also lost or repeated: at the feet (`_lowest_lines`,
   `_is_repeated`) and at the head (`top_seen`).

A wrong step moves the boxes of all figures, because each sprite waits for the other.
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

FIRST_LINES = np.array((127, 151))  # at most, of upper figures; above, sprite 1 is the basket
SWITCH = 4  # lines after which a sprite's lower figure can begin
COURT_MIDDLE = range(54, 107)  # lines in which the loop checks both ends,
UNSEEN_END = 105  # except the end here, where it draws the court's horizon


class Lines(NamedTuple):
    """The lines of the figures, `[4]` each."""

    first: jax.Array  # the uppermost one
    end: jax.Array  # the line after the last one
    changes: jax.Array  # the sprite changes to its lower figure there
    lowest: jax.Array  # lines from the feet up to the lowest visible one
    repeats: jax.Array  # bool: the last line is drawn twice


def drawn_lines(m: Ram, feet: jax.Array) -> Lines:
    """The lines of all figures, given the lines of their feet."""
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
    """The ends of the upper figures, if the lower ones begin as early as possible."""
    lower_first = jnp.minimum(m.top[2:] - 1, m.bottom[:2] - SWITCH)
    first = jnp.concatenate([_upper_first(m), lower_first])
    return _delayed(m, _noticed_ends(m, first, UPPER_COUNT))


def _noticed_ends(m: Ram, first: jax.Array, count: int) -> jax.Array:
    """The ends of the first `count` figures, far from ends or changes of the other sprite."""
    asked = m.bottom[:count] - 1
    both = _both_from(m, asked, first)
    is_passed_over = match(
        (among(asked, COURT_MIDDLE), asked == UNSEEN_END),
        otherwise=_is_others_turn(asked, both),
    )
    return asked - when((both > 0) & is_passed_over, 1)


def _both_from(m: Ram, line: jax.Array, first: jax.Array) -> jax.Array:
    """The first line at which both sprites show figures down to some line; 0 if they do not."""
    count = len(line)
    others = OTHER_SPRITES[:, :count]
    other_first = first[others]
    beside = (other_first > line[None]) & (m.bottom[others] <= line[None])
    return jnp.max(when(beside, jnp.minimum(other_first, first[None, :count])), axis=0)


def _is_others_turn(asked: jax.Array, both: jax.Array) -> jax.Array:
    """True if the loop checks the other sprite's end there, above or below the court's middle.

    The alternation begins when both sprites show figures, or again below the middle. All requested
    ends are odd, so the result depends only on the start of the alternation.
    """
    is_below = asked < COURT_MIDDLE.start
    begins_anew = is_below & (both >= COURT_MIDDLE.start)
    begins_odd = begins_anew | ((both & 1) == 1)
    is_sprite_1 = SPRITE[: len(asked)] == 1
    return begins_odd ^ is_sprite_1 ^ ~is_below


def _sprite_changes(m: Ram, end: jax.Array) -> jax.Array:
    """True if a sprite changes to its lower figure at the end of this one, bool `[4]`."""
    return jnp.concatenate([end[:2] >= m.bottom[2:], jnp.zeros(2, bool)])


def _delayed(m: Ram, end: jax.Array) -> jax.Array:
    """The ends, delayed by the other sprite's end or change.

    The loop checks a sprite's end again in the second line below the end of the other one, or later
    if that one changes.
    """
    count = len(end)
    # With two figures, ignore the lower ones: their ends are not known yet.
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
    """Lines from each figure's feet up to the lowest visible one.

    While the other sprite changes, two lines of this one show its content of the second of them. If
    that is empty, it is invisible from the other one's end down.
    """
    upper = end[OTHER_UPPER]
    second = m.bottom[OTHER_UPPER] - 2
    has_nothing = ((second < feet) | (second <= m.bottom)) & (second <= feet + 1)
    loses = other_changes & (upper > end) & has_nothing
    return jnp.maximum(end + 1, when(loses, upper + 1)) - feet


def _is_repeated(feet: jax.Array, end: jax.Array, other_changes: jax.Array) -> jax.Array:
    """True if the line of the feet is drawn twice, because the other sprite ends below it.

    At that end, this sprite keeps its content for one line.
    """
    upper = end[OTHER_UPPER]
    lower = end[OTHER_LOWER]
    return (feet == lower + 1) | (~other_changes & (feet == upper + 1))


def top_seen(m: Ram, lines: Lines, top: jax.Array) -> jax.Array:
    """The line of the top of each figure, given the line of its picture's top.

    In the line of the other sprite's end, the line above is repeated. In the two lines of the other
    sprite's change, a line is repeated that the game has looked up before.
    """
    other = lines.end[OTHER_SPRITES]
    changes = lines.changes[OTHER_SPRITES]
    repeated = changes & (top[None] >= m.bottom[OTHER_SPRITES] - 2)
    again = (other >= top[None]) & (other - top[None] <= when(changes, 1))
    seen = match((repeated, other), (changes, other - 2), otherwise=other - 1) - top[None]
    return top + jnp.sum(when(again, seen), axis=0)
