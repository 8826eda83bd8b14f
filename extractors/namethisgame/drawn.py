"""Name This Game's state when the frame was drawn.

The game moves the boat, the shark and the tentacles before it draws a frame (F02A-F298), and the
diver, the shot, the bars and the ink after it (F61D-FA0F). The display of the score comes last in
the frame and leaves the pointers to its digits in the RAM.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import among, match, when
from ocjax.extractors.namethisgame.ram import TENTACLE_OF, Clock, Ram, State

# Layout of each tentacle in the chip's registers:
SHIFTS = np.array((4, 0, 0, 4, 4, 4, 0, 0))[TENTACLE_OF]  # lowest bit of its columns
TO_LEFT = np.array((1, 1, 0, 0, 0, 1, 1, 0))[TENTACLE_OF] == 1  # higher bits are further left

LEFT_END = 19  # leftmost `x` of the diver
RIGHT_END = 125
BOAT_LEFT = 11  # `boat_x` on the frame on which the boat has turned
BOAT_RIGHT = 134
NO_INK = 21  # `ink`
NO_TREASURE_INK = 7  # `treasure_ink`
SHOT_ROWS = 92  # turns of the drawing loop, which counts `shot_rows` down
LAUNCHED = 89  # `shot_y` on the frame of a shot's launch
DROPPED = 95  # `pipe_time` on the frame on which the pipe was dropped
FULL_BAR = 16  # steps


class Drawn(NamedTuple):
    """The changed values, as they were when the frame was drawn."""

    x: jax.Array  # of the diver
    pipe_x: jax.Array
    pipe: jax.Array  # whether it hangs
    shot_y: jax.Array
    shot_there: jax.Array
    score: jax.Array
    oxygen: jax.Array  # steps
    time: jax.Array
    ink: jax.Array  # covered rows
    treasure_ink: jax.Array
    lives: jax.Array


def as_drawn(m: Ram) -> Drawn:
    """The state when the frame was drawn."""
    plays = m.state == State.PLAYS
    score = _shown_score(m)
    x = m.x - _diver_step(m)
    boat_x = m.boat_x - _boat_step(m)
    shot_y = (m.shot_rows + SHOT_ROWS) & 255
    spreads = plays & m.stolen & ((m.clock & 7) == 0)
    ink_step = when(spreads & (m.ink < NO_INK), 1)
    return Drawn(
        x=x - 1,
        pipe_x=boat_x + 6,
        pipe=m.pipe & (m.pipe_time != DROPPED),
        shot_y=shot_y,
        shot_there=(shot_y > 0) & (shot_y <= SHOT_ROWS) & (m.shot_y != LAUNCHED),
        score=score,
        oxygen=_oxygen(m, x, score),
        time=_time(m),
        ink=jnp.clip(NO_INK - m.ink - ink_step, 0, 20),
        treasure_ink=NO_TREASURE_INK - m.treasure_ink,
        lives=m.lives + when(_just_lost(m), 1),
    )


def _shown_score(m: Ram) -> jax.Array:
    weights = np.array((100000, 10000, 1000, 100, 10, 1))
    return jnp.sum((m.pointer >> 3) * weights)


def _diver_step(m: Ram) -> jax.Array:
    """Columns to the right that the diver has probably moved: one ahead, unless he is at an end."""
    end = jnp.where(m.looks_right, RIGHT_END, LEFT_END)
    free = (m.state == State.PLAYS) & ~m.eaten & ~m.stolen & (m.x != end)
    return when(free & (m.idle == 0), jnp.where(m.looks_right, 1, -1))


def _boat_step(m: Ram) -> jax.Array:
    """Columns to the right that the boat has moved since the pipe was placed."""
    back = among(m.boat_x, (BOAT_LEFT, BOAT_RIGHT))
    leftward = m.boat_leftward ^ back
    return when((m.clock & 3) == 0, jnp.where(leftward, -1, 1))


def _just_lost(m: Ram) -> jax.Array:
    """True if a life was lost after the frame."""
    suffocates = (m.state == State.NO_OXYGEN) & (m.clock == Clock.JUST_FLASHED)
    return suffocates | ((m.state == State.INKED) & (m.treasure_ink == 0))


def _steps_of(bar: jax.Array) -> jax.Array:
    """Steps of a bar."""
    return jnp.bitwise_count(bar)


def _time(m: Ram) -> jax.Array:
    """Steps of the timer as drawn."""
    begins = (m.state == State.STARTS) & (m.clock == Clock.WAVE_BEGINS)
    used = (m.state == State.PLAYS) & (m.clock == 0)
    return when(~begins, _steps_of(m.time) + when(used, 1))


def _oxygen(m: Ram, x: jax.Array, score: jax.Array) -> jax.Array:
    """Steps of the oxygen meter as drawn."""
    plays = m.state == State.PLAYS
    steps = _steps_of(m.oxygen)
    away = m.boat_x + 8 - x - jnp.where(m.faces_right, 12, 4)
    breathes = plays & m.pipe & ((m.clock & 7) == 0) & (jnp.abs(away) < 5)
    filled = breathes & (m.score == score)
    used = plays & ((m.clock & m.oxygen_pace) == 0) & ~filled
    flashed = among(m.state, State.FLASHES) & (m.clock == Clock.JUST_FLASHED)
    return match(
        (flashed, FULL_BAR - steps),
        (filled, steps - 1),
        (used, jnp.minimum(steps + 1, FULL_BAR)),
        otherwise=steps,
    )
