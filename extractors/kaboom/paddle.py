"""Where the buckets were before their last step.

After drawing a frame, the game moves the buckets half of the way to the paddle and rounds to the
left, so two positions lead to the same position by the same paddle. The RAM does not say which of
the two it was. `buckets_before` takes the one that a simple motion of the paddle explains.

ALE's joystick moves the paddle by a fixed resistance per frame, from either stop or from the
middle. The game reads the paddle on most scan lines and counts the lines on which it is still
charging. The rows that the bombs have fallen decide which lines it skips.
"""

import itertools
from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import lookup

_Ints = TypeVar("_Ints", jax.Array, np.ndarray)

FIRST_LINE = 86  # of the frame on which the game can read the paddle
BOTTOM_LINE = 173  # where the loop at F213 begins, which draws the buckets, too
END_LINE = 221
ZONE = 18  # lines of a bomb's record
READ = (20, 43)  # cycle of the reading in a line: above BOTTOM_LINE, from there on
LINE_CYCLES = 76  # cycles
CHARGING = 3118  # cycle of the frame at which the paddle begins to charge
CYCLES_PER_OHM = 1.6 * 0.01e-6 * 1.19e6  # until it is charged

STOPS = (27450, 790196)  # ohm at the right and the left stop
MIDDLE = (STOPS[0] + STOPS[1]) // 2
STEP = 23000  # ohm that the joystick moves the paddle by in a frame
STEPS = 34  # more than from stop to stop

SCALE = range(-11, 115)  # numbers of the paddle, from the left to the right stop
UNUSED = 5  # left of the buckets' leftmost position
FRAMES = 9  # of a motion; then the buckets follow the paddle at its speed
FALLS = 5  # rows that bombs fall in a frame are below this number
LAGS = range(-7, 9)  # from the buckets to the paddle
ENDS = (LAGS[0], LAGS[-1])
# Lags at which rounding is more frequent without such a motion.
ROUNDED_LAGS = (-4, -3, -2, 1, 2, 3, 6, 7)


class Motion(NamedTuple):
    """A motion of the paddle after a rest."""

    way: int  # 1: to the right, -1: to the left, 0: none
    frames: int
    came: int  # position of the buckets during the rest, from the paddle's


# The last motion on the last path that explains a position counts: most often the paddle rests.
MOTIONS = (
    *(Motion(way, frames, way) for frames in (1, 2, 3, 4, FRAMES) for way in (1, -1)),
    Motion(0, FRAMES, -1),
    Motion(0, FRAMES, 1),
)


def buckets_before(x: jax.Array, paddle: jax.Array, rows: jax.Array, fall: jax.Array) -> jax.Array:
    """Return the buckets' position in the frame.

    Args:
        x: their position after the step.
        paddle: the paddle's number in the frame.
        rows: that the bombs have fallen since they came to their records.
        fall: rows that bombs fall in a frame.
    """
    target = jnp.maximum(paddle - UNUSED, 0)
    lag = jnp.clip(target - x, *ENDS)
    is_rounded = lookup(ROUNDED_BITS, _index(paddle, rows, fall)) >> lag - LAGS[0] & 1
    return 2 * x - target + is_rounded


def _index(paddle: _Ints, rows: _Ints, fall: _Ints) -> _Ints:
    """Index in `ROUNDED_BITS`."""
    return ((paddle - SCALE[0]) * ZONE + rows) * FALLS + fall


def _reads(rows: int) -> np.ndarray:
    """True for the lines on which the game reads the paddle."""
    line = np.arange(FIRST_LINE, END_LINE)
    first = FIRST_LINE + rows  # of record 1
    phase = (line - first) % ZONE
    between = (line >= first) & (phase == 0)
    in_bottom = (line > BOTTOM_LINE) & (phase == ZONE - 1)
    single = (line == first + 1) | (line == BOTTOM_LINE)
    is_late = (line == FIRST_LINE) & (rows == ZONE - 1)  # record 0 begins below this line
    return ~(between | in_bottom | single | is_late)


def _paddle_at(resistances: np.ndarray) -> np.ndarray:
    """The paddle's number at each resistance and for each number of rows."""
    line = np.arange(FIRST_LINE, END_LINE)
    cycle = LINE_CYCLES * line + np.where(line < BOTTOM_LINE, *READ) - CHARGING
    is_charging = cycle <= (CYCLES_PER_OHM * resistances)[:, None]
    is_read = np.array([_reads(rows) for rows in range(ZONE)])
    return SCALE[-1] - is_charging.astype(int) @ is_read.T


def _paths() -> list[np.ndarray]:
    """Resistances from left to right: on the ways from the middle and from each stop."""
    way = STEP * np.arange(STEPS)
    half = STEPS // 2
    from_middle = MIDDLE + STEP * half - way
    return [np.clip(path, *STOPS) for path in (from_middle, STOPS[0] + way[::-1], STOPS[1] - way)]


def _follow(rounded: np.ndarray, numbers: np.ndarray, motion: Motion) -> None:
    """Write how the last step of a motion was rounded, for all its ends on a path.

    Args:
        rounded: by `_index` and lag.
        numbers: the paddle's, on the path.
        motion: of the paddle.
    """
    end, rows, fall = np.ix_(np.arange(len(numbers)), np.arange(ZONE), np.arange(FALLS))

    def number(ago: int) -> np.ndarray:
        at = np.clip(end - motion.way * min(ago, motion.frames), 0, len(numbers) - 1)
        return numbers[at, (rows - fall * ago) % ZONE]

    targets = [np.maximum(number(ago) - UNUSED, 0) for ago in range(FRAMES, -1, -1)]
    first = targets[0] + motion.came
    *_, before, x = itertools.accumulate(targets, lambda x, target: x + target >> 1, initial=first)
    lag = targets[-1] - x
    place = _index(number(0), rows, fall) * len(LAGS) + np.clip(lag, *ENDS) - LAGS[0]
    np.put(rounded, place, before > x - lag)


def _table() -> np.ndarray:
    """A bit for each lag, by `_index`."""
    usual = np.isin(LAGS, ROUNDED_LAGS)
    rounded = np.tile(usual, (len(SCALE) * ZONE * FALLS, 1))
    for numbers, motion in itertools.product(map(_paddle_at, _paths()), MOTIONS):
        _follow(rounded, numbers, motion)
    return (rounded << np.arange(len(LAGS))).sum(axis=-1).astype(np.int32)


ROUNDED_BITS = _table()
