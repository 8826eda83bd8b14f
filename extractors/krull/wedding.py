"""Timing of the wedding in Krull: when figures are drawn, and where the beam switches the shot.

Timeline of the display program ($B300 and $B400 of the first half), in turns that draw two rows of
each sprite:
    first sprite      the bride, while she is free, and the Slayers; ready from turn 6
    second sprite     the player and the captured bride; ready from turn 22
    for each figure   one turn to begin, two rows per turn, and five turns to set up the next figure
    turn 72           the game changes the ground's color, or in the next turn in which the first
                      sprite draws nothing; no figure begins in that turn
    turn 80           the last one
Both sprites show their figures from the top down. Each figure waits until the one before is drawn
and the next one is set up. If the rows of two figures are too close, the lower one is drawn further
down; the last figure may disappear.

The shot is switched on in a turn of the second sprite and off in a turn of the first. The column of
a switch depends on the other work of the program in that turn (`State`). The columns below are
counted in cycles.
"""

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import lookup, match, pick, when
from ocjax.extractors.krull.ram import ROM, Ram, Scene

TALLEST = 24  # rows of a figure; bytes that are no figures may give more
SECOND = 256  # the first picture of the second page
RECORDS = np.arange(8)
FEW = 6  # records of the first sprite
SETUP = 5  # turns to set up the next figure
PAUSE_TURN = 72  # the game changes the ground's color in this turn, or in the next free one
LAST = 80  # turn
NEVER = 255  # no turn


class Sprite(NamedTuple):
    """A sprite of the display program."""

    records: tuple[int, ...]  # from the top down
    ready: int  # the first turn with a figure
    pause: int  # the turn in which no figure begins


FIRST_SPRITE = Sprite(tuple(range(FEW - 1, -1, -1)), 6, PAUSE_TURN)
SECOND_SPRITE = Sprite((7, 6), 22, NEVER)


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
    wedding = jnp.where(m.taken, fields[:, record.taken], fields[:, record.free])
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


class Turns(NamedTuple):
    """When the figures of the eight records are drawn, in turns of the display program."""

    start: jax.Array  # the turn before the figure's first rows, or `NEVER`
    end: jax.Array  # the turn after its last ones
    column: jax.Array  # of the beam while the figure is placed

    def of(self, some: slice) -> "Turns":
        """Those of some records."""
        return Turns(*(values[some] for values in self))


def turns_of_figures(m: Ram) -> Turns:
    """The turns of all records at the wedding."""
    of_first = RECORDS < FEW
    first_there = jnp.where(m.taken, m.slayers, m.slayers + 1) > RECORDS
    there = jnp.where(of_first, first_there, m.taken | (RECORDS == FEW))
    page = np.where(of_first, SECOND, 0)
    length = lookup(FIGURE_TURNS, m.picture + page) + 1
    starts = {
        **_starts_by_record(m.y, there, length, FIRST_SPRITE),
        **_starts_by_record(m.y, there, length, SECOND_SPRITE),
    }
    start = jnp.stack([starts[record] for record in RECORDS.tolist()])
    return Turns(start, start + length, lookup(PLACED_AT, m.x))


class Place(NamedTuple):
    """A figure's place in the queue of its sprite."""

    start: jax.Array  # see `Turns`
    ready: jax.Array  # the first turn that the next figure may have


def _starts_by_record(
    y: jax.Array, there: jax.Array, length: jax.Array, sprite: Sprite
) -> dict[int, jax.Array]:
    """The start of each figure of a sprite."""

    def after(before: Place, record: int) -> Place:
        soon = jnp.maximum(y[record], before.ready)
        late = jnp.maximum(y[record], jnp.maximum(before.ready, sprite.pause) + 1)
        begin = jnp.where(soon < sprite.pause, soon, late)
        is_drawn = there[record] & (begin < LAST)
        next_ready = begin + length[record] + SETUP
        return Place(
            start=jnp.where(is_drawn, begin, NEVER),
            ready=jnp.where(there[record], next_ready, before.ready),
        )

    at_first = Place(jnp.int32(NEVER), jnp.int32(sprite.ready))
    _, *places = itertools.accumulate(sprite.records, after, initial=at_first)
    return {record: place.start for record, place in zip(sprite.records, places, strict=True)}


def on_at(turn: jax.Array, figures: Turns) -> jax.Array:
    """The beam's column when the shot is switched on."""
    return _beam(turn, figures.of(slice(FEW, None)), ON_COLUMNS, SECOND_SPRITE.ready)


def off_at(turn: jax.Array, figures: Turns) -> jax.Array:
    """The beam's column when the shot is switched off."""
    return _beam(turn, figures.of(slice(FEW)), OFF_COLUMNS, FIRST_SPRITE.ready)


def _beam(turn: jax.Array, figures: Turns, columns: tuple[int, ...], ready: int) -> jax.Array:
    drawn = figures.start < NEVER
    ended = drawn & (figures.end < turn)
    since = turn - jnp.max(jnp.where(ended, figures.end, ready - SETUP))
    draws = (figures.start < turn) & (turn <= figures.end)
    last_end = jnp.max(when(drawn, figures.end))
    state = match(
        (draws.any(), State.DRAWS),
        ((turn == figures.start).any(), State.BEGINS),
        (turn > last_end, State.ENDED),
        (since < SETUP, State.ENDED + since),
        otherwise=State.WAITS,
    )
    next_start = jnp.min(jnp.where(figures.start > turn, figures.start, NEVER))
    next_column = jnp.max(when(figures.start == next_start, figures.column))
    return jnp.where(state == State.PLACES, next_column, pick(state, columns))
