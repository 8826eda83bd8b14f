"""Timing of the wedding in Krull: when figures are drawn, and where the beam switches the shot.

The display program ($B300 and $B400 of the first half) draws two rows of each sprite per turn. One
sprite shows the bride, while she is free, and the Slayers. The other one shows the player and the
captured bride. Both sprites show their figures from the top down. Each figure waits until the one
before is drawn and the next one is set up. If the rows of two figures are too close, the lower one
is drawn further down; the last figure may disappear.

The shot is switched on in a turn of the second sprite and off in a turn of the first. The column of
a switch depends on the other work of the program in that turn. The columns below are counted in
cycles.
"""

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import lookup, match, pick
from ocjax.extractors.krull.ram import ROM, Ram, Scene

TALLEST = 24  # rows of a figure; bytes that are no figures may give more
SECOND = 256  # the first picture of the second page
RECORDS = np.arange(8)
FEW = 6  # records of the first sprite
SETUP = 5  # turns to set up the next figure
PAUSE_TURN = 72  # the game changes the ground's color in this turn, or in the next free one
LAST = 80  # turn
NEVER = 255  # no turn
# Records from the top down, the first turn with a figure, and the turn with a pause.
SPRITES = ((range(FEW - 1, -1, -1), 6, PAUSE_TURN), ((7, 6), 22, NEVER))


class Record(NamedTuple):
    """The record of a person."""

    elsewhere: int  # in scenes other than the wedding
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


class State:  # of a sprite; `ENDED` and above: four turns after a figure
    WAITS = 0  # for a row
    BEGINS = 1
    DRAWS = 2
    ENDED = 3  # or nothing is left to draw
    PLACES = 5  # the next figure


OFF_COLUMNS = (61, 94, 4, 82, 95, 0, 115, 136)  # by the first sprite's state
ON_COLUMNS = (73, 106, 4, 94, 116, 0, 115, 115)  # by the second sprite's state
# The column while a figure is placed, by its x: the loop before it takes 15 columns per step.
CODES = ROM.bytes(0x81E, 160)
PLACED_AT = np.where(CODES & 1, 22, 52 + 15 * (CODES >> 1 & 7))


def _figure(page: int, code: int) -> np.ndarray:
    """The rows of a figure, stored after their number; a turn draws the lower of two rows first."""
    height = min(int(ROM.bytes(page | code, 1)[0]) & ~1, TALLEST)
    return ROM.rows(page | code + 1, height).reshape(-1, 2)[:, ::-1].ravel()


FIGURE_ROWS = [_figure(page, code) for page in (0xA00, 0xC00) for code in range(256)]
FIGURE_TURNS = np.array([len(rows) // 2 for rows in FIGURE_ROWS])


def turns(
    x: jax.Array, y: jax.Array, picture: jax.Array, slayers: jax.Array, taken: jax.Array
) -> jax.Array:
    """When the figures of the eight records are drawn, in turns of the display program.

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
    """The beam's column when the shot is switched on; `figures` is the result of `turns`."""
    return _beam(turn, figures[:, FEW:], ON_COLUMNS, SPRITES[1][1])


def off_at(turn: jax.Array, figures: jax.Array) -> jax.Array:
    """The beam's column when the shot is switched off."""
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
