"""Name This Game's RAM, and what it was when the frame was drawn.

The game moves the boat, the shark and the tentacles before it draws a frame (F02A-F298), and the
diver, the shot, the bars and the ink after it (F61D-FA0F). The display of the score comes last in
the frame and leaves the pointers to its digits in the RAM.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.ops import among, match, when
from ocjax.console.ram import RamMap, bcd, bits, byte

TENTACLES = 8
ROWS = 10
TENTACLE_OF = np.arange(TENTACLES * ROWS) // ROWS  # of the slots
ROW_OF = np.arange(TENTACLES * ROWS) % ROWS
# Of each tentacle, as the chip's registers have it:
COLUMNS = np.array((0, 0, 1, 1, 2, 3, 3, 4))[TENTACLE_OF]  # table of bytes
SHIFTS = np.array((4, 0, 0, 4, 4, 4, 0, 0))[TENTACLE_OF]  # lowest bit of its columns
TO_LEFT = np.array((1, 1, 0, 0, 0, 1, 1, 0))[TENTACLE_OF] == 1  # higher bits are further left

LEFT_END = 19  # `x` of the diver where he stops
RIGHT_END = 125
BOAT_LEFT = 11  # `boat_x` on the frame on which the boat has turned
BOAT_RIGHT = 134
NO_INK = 21  # `ink`
NO_TREASURE_INK = 7  # `treasure_ink`
SHOT_ROWS = 92  # turns of the drawing loop, which counts `shot_rows` down
LAUNCHED = 89  # `shot_y` on the frame on which a shot was launched
DROPPED = 95  # `pipe_time` on the frame on which the pipe was dropped
FULL_BAR = 16  # steps


class State:  # of `Ram.state`
    STARTS = 8
    PLAYS = 10
    INKED = 11
    LOST = 12  # one frame
    NO_OXYGEN = 18
    FLASHES = range(20, 27)  # the meter, by turns


class Clock:  # of `Ram.clock`
    WAVE_BEGINS = 137  # in `State.STARTS`: the bars have just been filled
    JUST_FLASHED = 226


class Ram(RamMap):
    playfield = byte(*(10 * c + r for c, r in zip(COLUMNS.tolist(), ROW_OF.tolist(), strict=True)))
    shot_y = byte(50)  # turns of the drawing loop before it; 0: none
    shot_x = byte(51)  # x + 2
    shot_rows = byte(52)  # what the loop has left of `shot_y`
    lane = byte(*range(53, 60))  # of the shark: its picture, 0: none; the lowest lane first
    shark_x = byte(60)  # x + 1
    # One byte:
    stolen = bits(61, first=1)  # the treasure: the ink spreads
    looks_right = bits(61, first=2)
    eaten = bits(61, first=3)  # the diver: the shark carries him away
    boat_leftward = bits(61, first=4)
    pipe = bits(61, first=5)
    shark_leftward = bits(61, first=6)
    faces_right = bits(61, first=7)
    clock = byte(63)
    idle = byte(64)  # 256 frames each since the joystick was moved; from 128 on nothing is drawn
    state = byte(65)
    score = bcd((68, 69, 70))
    lives = bits(71, count=3)
    oxygen_pace = byte(75)  # mask of `clock`
    pointer = byte(84, 86, 88, 90, 92, 94)  # to the digits on the display, 8 bytes each
    text = bits(84, count=3)  # not 0: letters stand in their place
    ink = byte(97)  # rows of the diver's zone that are free
    treasure_ink = byte(98)  # rows of the treasure's
    x = byte(99)  # x + 1
    boat_x = byte(100)  # x + 1
    shark_lane = byte(101)
    oxygen = byte((112, 113))  # a bit for each step of a bar
    time = byte((114, 115))
    pipe_time = byte(117)  # counts down


class Drawn(NamedTuple):
    """What has changed since the frame was drawn, as it was then."""

    x: jax.Array  # of the diver
    pipe_x: jax.Array
    pipe: jax.Array  # whether it hangs
    shot_y: jax.Array
    shot_there: jax.Array
    score: jax.Array
    oxygen: jax.Array  # steps
    time: jax.Array
    ink: jax.Array  # rows that are covered
    treasure_ink: jax.Array
    lives: jax.Array


def as_drawn(m: Ram) -> Drawn:
    """The state when the frame was drawn."""
    plays = m.state == State.PLAYS
    score = _shown_score(m)
    x = m.x - _diver_step(m)
    boat_x = m.boat_x - _boat_step(m)
    shot_y = (m.shot_rows + SHOT_ROWS) & 255
    spreads = plays & (m.stolen == 1) & ((m.clock & 7) == 0)
    ink_step = when(spreads & (m.ink < NO_INK), 1)
    return Drawn(
        x=x - 1,
        pipe_x=boat_x + 6,
        pipe=(m.pipe == 1) & (m.pipe_time != DROPPED),
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
    """Columns to the right that the diver has probably moved: on, unless he has come to an end."""
    end = jnp.where(m.looks_right == 1, RIGHT_END, LEFT_END)
    free = (m.state == State.PLAYS) & (m.eaten == 0) & (m.stolen == 0) & (m.x != end)
    return when(free & (m.idle == 0), jnp.where(m.looks_right == 1, 1, -1))


def _boat_step(m: Ram) -> jax.Array:
    """Columns to the right that the boat has moved since the pipe was placed."""
    back = among(m.boat_x, (BOAT_LEFT, BOAT_RIGHT))
    leftward = (m.boat_leftward == 1) ^ back
    return when((m.clock & 3) == 0, jnp.where(leftward, -1, 1))


def _just_lost(m: Ram) -> jax.Array:
    """Whether a life was lost after the frame."""
    suffocates = (m.state == State.NO_OXYGEN) & (m.clock == Clock.JUST_FLASHED)
    return suffocates | ((m.state == State.INKED) & (m.treasure_ink == 0))


def _steps(bar: jax.Array) -> jax.Array:
    """Steps of a bar."""
    return jnp.bitwise_count(bar)


def _time(m: Ram) -> jax.Array:
    """Steps of the timer as drawn."""
    begins = (m.state == State.STARTS) & (m.clock == Clock.WAVE_BEGINS)
    used = (m.state == State.PLAYS) & (m.clock == 0)
    return when(~begins, _steps(m.time) + when(used, 1))


def _oxygen(m: Ram, x: jax.Array, score: jax.Array) -> jax.Array:
    """Steps of the oxygen meter as drawn."""
    plays = m.state == State.PLAYS
    steps = _steps(m.oxygen)
    away = m.boat_x + 8 - x - jnp.where(m.faces_right == 1, 12, 4)
    breathes = plays & (m.pipe == 1) & ((m.clock & 7) == 0) & (jnp.abs(away) < 5)
    filled = breathes & (m.score == score)
    used = plays & ((m.clock & m.oxygen_pace) == 0) & ~filled
    flashed = among(m.state, State.FLASHES) & (m.clock == Clock.JUST_FLASHED)
    return match(
        (flashed, FULL_BAR - steps),
        (filled, steps - 1),
        (used, jnp.minimum(steps + 1, FULL_BAR)),
        otherwise=steps,
    )
