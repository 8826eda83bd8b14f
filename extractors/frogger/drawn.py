"""Frogger's lanes, turtles and frog as they were drawn.

The frog jumps and lanes move after the frame is drawn ($FAB2, $FBF9), and turtles dive after that
($F07D). All other objects move before the frame is drawn.
"""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Number, lookup, match, packed_position, when, wrap
from ocjax.extractors.frogger.ram import ROM, Lane, Picture, Ram, Stick, Tune

LANES = Lane.LAST + 1
CAR_LANE = np.repeat(np.arange(Lane.TRUCKS), 2)
TURTLE_LANE = np.repeat((Lane.LOWER_TURTLES, Lane.UPPER_TURTLES), 2)
LOG_LANE = np.array((Lane.SHORT_LOGS, Lane.LONG_LOG, Lane.LAST, Lane.LAST))
STEPS = np.where(ROM.bytes(0xD47, LANES) >= 128, -1, 1)  # columns to the right
# A lane moves when these bits of the clock are 0. Number of the bits, by address and lane.
MASKS = ROM.data[0xE00 + np.arange(256)[:, None] + np.arange(LANES)] & 7
PACES = (np.bitwise_count(MASKS).astype(np.int32) << 2 * np.arange(LANES)).sum(1)  # two bits each


@dataclass(frozen=True)
class Drawn:
    """The state when the frame was drawn, with columns of sprites of eight columns."""

    car_x: jax.Array
    truck_x: jax.Array
    verge_snake_x: jax.Array
    turtle_x: jax.Array
    log_x: jax.Array
    lane: jax.Array  # of the frog
    frog_picture: jax.Array
    homes: jax.Array
    dive: jax.Array


def as_drawn(m: Ram) -> Drawn:
    """Revert the changes of lanes, turtles and the frog since the drawing."""
    jumps = (m.tune == Tune.JUMP) & (m.note == 0)
    comes_home = (m.tune == Tune.HOME) & (m.note == 0) & (m.lane == Lane.HOME)
    misses_bay = (m.tune == Tune.DEATH) & (m.note == 0)
    rise = match((m.stick == Stick.UP, 1), (m.stick == Stick.DOWN, -1), otherwise=0)
    bay = 1 << (m.x - 11 >> 5)
    return Drawn(
        car_x=_before(m, m.car_at, CAR_LANE),
        truck_x=_before(m, m.truck_at, np.repeat(Lane.TRUCKS, 2)),
        verge_snake_x=_before(m, m.verge_snake_at, Lane.VERGE),
        turtle_x=_before(m, m.turtle_at, TURTLE_LANE),
        log_x=_before(m, m.log_at, LOG_LANE),
        lane=match((jumps, m.lane - rise), (comes_home, Lane.LAST), otherwise=m.lane),
        frog_picture=jnp.where(misses_bay, Picture.FROG_UP, m.frog_picture),
        homes=jnp.where(comes_home, m.homes & ~bay, m.homes),
        dive=jnp.where(m.clock == 0, m.dive - 1 & 3, m.dive),
    )


def _before(m: Ram, code: jax.Array, lane: Number) -> jax.Array:
    """Columns of sprites before their lanes' last steps."""
    count = lookup(PACES, m.pace) >> 2 * lane & 3
    moved = (m.clock & (1 << count) - 1) == 0
    return column(code, when(moved, STEPS[lane]))


def column(code: jax.Array, step: Number = 0) -> jax.Array:
    """Column of a sprite before a step, -8 to 151."""
    return wrap(packed_position(code) - 38 - step) - 8
