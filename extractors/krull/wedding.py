"""When Krull's figures of the wedding are drawn, and the beam as it switches the shot.

The display program ($B300 and $B400 of the first half) draws two rows of each sprite a turn. One
sprite shows the bride, while she is free, and the Slayers; the other one the player and the bride
that is taken. Both show their figures from the top down, and each figure waits until the one before
it is drawn and the next one is set up. So figures whose rows are too close are drawn further down,
the last one perhaps not at all.

The shot is switched on in a turn of the second sprite and off in one of the first, in a column that
depends on what else the program does in that turn. These columns are counted in its cycles.
"""

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import lookup, match, pick
from ocjax.extractors.krull.ram import ROM, Ram, Scene

TALLEST = 24  # rows of a figure; the bytes that are no figures may say more
SECOND = 256  # the first picture of the second page
RECORDS = np.arange(8)
FEW = 6  # records of the first sprite
SETUP = 5  # turns before a figure, after the one before it
PAUSE_TURN = 72  # the turn, or the next free one, in which the game changes the ground's color
LAST = 80  # turn
NEVER = 255  # instead of a turn
# Records from the top down, the first turn with a figure, and that with a pause.
SPRITES = ((range(FEW - 1, -1, -1), 6, PAUSE_TURN), ((7, 6), 22, NEVER))


class Record(NamedTuple):
    """Which record is a person's."""

    elsewhere: int  # in other scenes than the wedding
    taken: int  # at the wedding when the bride is taken
    free: int  # before that


COLWYNS = Record(elsewhere=0, taken=7, free=6)
BRIDES = Record(elsewhere=2, taken=6, free=0)


class Person(NamedTuple):
    """The fields of a person's record."""

    x: jax.Array
    y: jax.Array
    flags: jax.Array
    picture: jax.Array


def person_of(m: Ram, y: jax.Array, record: Record) -> Person:
    """A person's fields."""
    fields = jnp.stack([m.x, y, m.flags, m.picture])
    wedding = jnp.where(m.taken == 1, fields[:, record.taken], fields[:, record.free])
    here = jnp.where(m.scene == Scene.WEDDING, wedding, fields[:, record.elsewhere])
    return Person(*here)


class State:  # of a sprite; from `ENDED` on, four turns after a figure
    WAITS = 0  # for a row
    BEGINS = 1
    DRAWS = 2
    ENDED = 3  # or has no more to draw
    PLACES = 5  # the next figure


OFF_COLUMNS = (61, 94, 4, 82, 95, 0, 115, 136)  # by the first sprite's state
ON_COLUMNS = (73, 106, 4, 94, 116, 0, 115, 115)  # likewise, the second one's
# The column while a figure is placed, by its x: the loop before it takes 15 columns a step.
CODES = ROM.bytes(0x81E, 160)
PLACED_AT = np.where(CODES & 1, 22, 52 + 15 * (CODES >> 1 & 7))


def _figure(page: int, code: int) -> np.ndarray:
    """The rows of a figure, after their number; the game draws two a turn, the upper one last."""
    height = min(int(ROM.bytes(page | code, 1)[0]) & ~1, TALLEST)
    return ROM.rows(page | code + 1, height).reshape(-1, 2)[:, ::-1].ravel()


FIGURE_ROWS = [_figure(page, code) for page in (0xA00, 0xC00) for code in range(256)]
FIGURE_TURNS = np.array([len(rows) // 2 for rows in FIGURE_ROWS])


def turns(
    x: jax.Array, y: jax.Array, picture: jax.Array, slayers: jax.Array, taken: jax.Array
) -> jax.Array:
    """When the figures of the eight records are drawn.

    Args:
        x, y, picture: of the records, int32 `[8]`.
        slayers: their number.
        taken: whether the bride is taken, 0 or 1.

    Returns:
        int32 `[3, 8]`: the turn before each figure's first rows, or `NEVER`; the turn after its
        last ones; and the beam's column while it is placed.
    """
    first = RECORDS < FEW
    there = jnp.where(first, slayers + 1 - taken > RECORDS, (RECORDS == FEW) | (taken == 1))
    length = lookup(FIGURE_TURNS, picture + np.where(first, SECOND, 0)) + 1

    def after(before: tuple[jax.Array, jax.Array, int], i: int) -> tuple[jax.Array, jax.Array, int]:
        _, ready, pause = before
        soon = jnp.maximum(y[i], ready)
        late = jnp.maximum(y[i], jnp.maximum(ready, pause) + 1)
        begin = jnp.where(soon < pause, soon, late)
        shown = jnp.where(there[i] & (begin < LAST), begin, NEVER)
        return shown, jnp.where(there[i], begin + length[i] + SETUP, ready), pause

    starts = {}
    for group, ready, pause in SPRITES:
        at_first = jnp.int32(NEVER), jnp.int32(ready), pause
        _, *figures = itertools.accumulate(group, after, initial=at_first)
        starts.update(zip(group, (shown for shown, _, _ in figures), strict=True))
    start = jnp.stack([starts[i] for i in RECORDS.tolist()])
    return jnp.stack([start, start + length, lookup(PLACED_AT, x)])


def on_at(turn: jax.Array, figures: jax.Array) -> jax.Array:
    """The column that the beam has passed when the shot is switched on; figures are `turns`."""
    return _beam(turn, figures[:, FEW:], ON_COLUMNS, SPRITES[1][1])


def off_at(turn: jax.Array, figures: jax.Array) -> jax.Array:
    """The same when it is switched off."""
    return _beam(turn, figures[:, :FEW], OFF_COLUMNS, SPRITES[0][1])


def _beam(turn: jax.Array, figures: jax.Array, columns: tuple[int, ...], ready: int) -> jax.Array:
    start, end, placed = figures
    drawn = start < NEVER
    since = turn - jnp.max(jnp.where(drawn & (end < turn), end, ready - SETUP))
    state = match(
        (((start < turn) & (turn <= end)).any(), State.DRAWS),
        ((turn == start).any(), State.BEGINS),
        (turn > jnp.max(jnp.where(drawn, end, 0)), State.ENDED),
        (since < SETUP, State.ENDED + since),
        otherwise=State.WAITS,
    )
    next_start = jnp.min(jnp.where(start > turn, start, NEVER))
    next_placed = jnp.max(jnp.where(start == next_start, placed, 0))
    return jnp.where(state == State.PLACES, next_placed, pick(state, columns))
