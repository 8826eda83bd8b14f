"""When Krull draws the figures of the wedding, and where the beam is when it switches the shot.

The display program ($B300 and $B400 of the first half) draws two rows of each sprite a turn. One
sprite shows the bride, while she is free, and the Slayers; the other one the player and the bride
that is taken. Both show their figures from the top down, and each figure waits until the one before
it is drawn and the next one is set up. So figures whose rows are too close are drawn further down,
the last one perhaps not at all.

The shot is switched on in a turn of the second sprite and off in one of the first, in a column that
depends on what else the program does in that turn. These columns are counted in its cycles.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.ops import lookup, pick
from ocjax.console.rom import Rom

ROM = Rom("krull", "4baada22435320d185c95b7dd2bcdb24")
TALLEST = 24  # rows of a figure; the bytes that are no figures may say more
SECOND = 256  # the first picture of the second page
RECORDS = np.arange(8)
FEW = 6  # records of the first sprite
SETUP = 5  # turns before a figure, after the one before it
PAUSE = 0x48  # the turn, or the next free one, in which the game changes the ground's color
# turns
LAST = 0x50
NEVER = 0xFF
# Records from the top down, the first turn with a figure, and that with a pause.
SPRITES = ((range(FEW - 1, -1, -1), 6, PAUSE), ((7, 6), 22, NEVER))
# States of a sprite: it waits for a row, begins, draws, has no more to draw, or is in one of four
# turns after a figure. In the second of these the game places the next one.
WAITS = 0
BEGINS = 1
DRAWS = 2
ENDED = 3
PLACES = 5
OFF_AT = (61, 94, 4, 82, 95, 0, 115, 136)  # columns, by the first sprite's state
ON_AT = (73, 106, 4, 94, 116, 0, 115, 115)  # likewise, the second one's
# The column while a figure is placed, by its x: the loop before it takes 15 columns a step.
CODES = ROM.bytes(0x81E, 160)
PLACED_AT = np.where(CODES & 1, 22, 52 + 15 * (CODES >> 1 & 7))


def _figure(page: int, code: int) -> np.ndarray:
    """The rows of a figure, after their number; the game draws two a turn, the upper one last."""
    height = min(int(ROM.bytes(page | code, 1)[0]) & ~1, TALLEST)
    return ROM.rows(page | code + 1, height).reshape(-1, 2)[:, ::-1].ravel()


FIGURES = [_figure(page, code) for page in (0xA00, 0xC00) for code in range(256)]
TURNS = np.array([len(rows) // 2 for rows in FIGURES])


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
    length = lookup(TURNS, picture + np.where(first, SECOND, 0)) + 1
    starts = {}
    for records, ready, pause in SPRITES:
        ready = jnp.int32(ready)
        for i in records:
            start = jnp.maximum(y[i], ready)
            late = jnp.maximum(y[i], jnp.maximum(ready, pause) + 1)
            start = jnp.where(start < pause, start, late)
            starts[i] = jnp.where(there[i] & (start < LAST), start, NEVER)
            ready = jnp.where(there[i], start + length[i] + SETUP, ready)
    start = jnp.stack([starts[i] for i in RECORDS.tolist()])
    return jnp.stack([start, start + length, lookup(PLACED_AT, x)])


def on_at(turn: jax.Array, figures: jax.Array) -> jax.Array:
    """The column that the beam has passed when the shot is switched on; figures are `turns`."""
    return _beam(turn, figures[:, FEW:], ON_AT, SPRITES[1][1])


def off_at(turn: jax.Array, figures: jax.Array) -> jax.Array:
    """The same when it is switched off."""
    return _beam(turn, figures[:, :FEW], OFF_AT, SPRITES[0][1])


def _beam(turn: jax.Array, figures: jax.Array, columns: tuple[int, ...], ready: int) -> jax.Array:
    start, end, placed = figures
    drawn = start < NEVER
    since = turn - jnp.max(jnp.where(drawn & (end < turn), end, ready - SETUP))
    state = jnp.where(since < SETUP, ENDED + since, WAITS)
    state = jnp.where(turn > jnp.max(jnp.where(drawn, end, 0)), ENDED, state)
    state = jnp.where((turn == start).any(), BEGINS, state)
    state = jnp.where(((start < turn) & (turn <= end)).any(), DRAWS, state)
    next_start = jnp.min(jnp.where(start > turn, start, NEVER))
    next_placed = jnp.max(jnp.where(start == next_start, placed, 0))
    return jnp.where(state == PLACES, next_placed, pick(state, columns))
