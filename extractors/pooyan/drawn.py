"""Pooyan's moving things as they were drawn.

After the frame is drawn, wolves walk ($F9C6), the climber moves ($F950), and the clock counts on
($FCDF). When a life is lost, the records are cleared ($F52D).
"""

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.ops import lookup, match, when
from ocjax.console.registers import packed_position
from ocjax.extractors.pooyan.ram import LAST_ROW, Copies, March, Ram, Reach, State

INTRO_TUNE = 0x8B  # low byte of the address, after the first note
FIRST_NOTE = 8  # frames that it lasts
LAST_TUNE = 0xA7  # after the last note
LAST_NOTE = 23  # frames of it that are left, when play begins
RESET_FRAME = 2  # the clock's first one
LOSS = 0xD2  # what `Ram.frames` is set to when a life is lost
NO_ROPE = 251  # `Ram.rope` when a life is lost
FIRST_END = 0x20  # walked, when another wolf joins those that march
LAST_END = 0x2C  # walked, when all stand
STAND_X = LAST_END - 1
SPAWN_ROWS = (1, 6)  # of wolves that take off; in rounds where they ascend, the second
LANDINGS = (0x2C, 0x4C, 0x6C)  # columns, by place
WALK_END = 0x9F  # walked, when a wolf climbs
CLIMB_START = 6  # row
REACHES = 0x1F  # frames left, on the first one
BITES = 0x4F
GAME_OVER_TINT = 0x62  # what is added to the player's colour
PALETTE = 0xFE  # colour's bits


@dataclass(frozen=True)
class Drawn:
    """The state when the frame was drawn. Columns are those of sprites of eight columns."""

    shows_round: jax.Array  # instead of the score
    is_lost: jax.Array  # the life
    ascends: jax.Array
    row: jax.Array  # the player's, 0 if it is not shown
    pushers: jax.Array
    climber_row: jax.Array
    reach: jax.Array
    march_x: jax.Array
    marchers: jax.Array
    stride: jax.Array  # picture of wolves that walk, 0 or 1
    landed_x: jax.Array
    is_landed: jax.Array
    flash: jax.Array  # colour
    player_color: jax.Array


class Begin(NamedTuple):
    """Frames of a round's introduction before which its records are cleared."""

    first: jax.Array
    second: jax.Array


def as_drawn(m: Ram) -> Drawn:
    """Takes back what has been done since."""
    walks = m.until_walk == 1
    intro = (m.state == State.INTRO) & (m.tune == INTRO_TUNE)
    begins = intro & (m.tune_pause == FIRST_NOTE) & (m.frame != RESET_FRAME)
    clock = m.frames - when((m.frame & 7) == 0, 1)
    is_lost = begins & (clock == LOSS) & (m.rope == NO_ROPE)
    ends = begins & ~is_lost  # the round before
    starts = (m.state == State.PLAY) & (m.tune == LAST_TUNE) & (m.tune_pause == LAST_NOTE)
    is_reset = intro & (m.tune_pause >= FIRST_NOTE - 1) & (m.frame <= RESET_FRAME + 1)
    joins = walks & (m.walked == 1) & (m.march == March.COMES) & (m.copies > Copies.ONE)
    second = intro & (m.tune_pause == FIRST_NOTE - 1)
    march_x, marchers = _march(m, walks, Begin(begins, second), joins)
    strides = walks & (((m.walked & 3) == 0) | joins)
    climber_row, reach = _climber(m, walks)
    landing = lookup(np.array(LANDINGS), m.landed_column)
    before = when(walks, 1)
    return Drawn(
        shows_round=((m.state == State.INTRO) & ~begins) | starts,
        is_lost=is_lost,
        ascends=m.ascends ^ when(ends, 1),
        row=match((is_lost | is_reset, 0), (ends, m.rope + LAST_ROW & 255), otherwise=m.row),
        pushers=jnp.where(ends, m.pushers_before, m.pushers),
        climber_row=climber_row,
        reach=reach,
        march_x=march_x,
        marchers=marchers,
        stride=m.stride ^ when(strides, 1),
        landed_x=m.landed_walked - 2 - before,
        is_landed=m.landed_walked > landing + before,
        flash=clock << 1 & PALETTE,
        player_color=(m.player_color - when(m.state == State.END, GAME_OVER_TINT)) & PALETTE,
    )


def column(code: jax.Array) -> jax.Array:
    """Column of a sprite."""
    return packed_position(code) - 46


def _march(m: Ram, walks: jax.Array, begin: Begin, joins: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Column and number of wolves that march; one more `joins` them after the frame."""
    stand = m.standing > 0
    alone = (m.copies == Copies.ONE) & (m.march == March.COMES) & (m.state != State.INTRO)
    left = alone & ~stand  # those that stood have all taken balloons
    now = match((m.copies == Copies.THREE, 3), (m.copies == Copies.TWO, 2), otherwise=1)
    marchers = match(
        (joins, now - 1),
        (begin.first & stand, 3),
        (begin.first & walks, 0),  # where they were is not known
        (left & (m.walked == 1) & _takes_off(m), 3),
        otherwise=now,
    )
    at = column(m.marchers_at)
    moved = (m.march != March.STANDS) | (m.walked == LAST_END)
    stood = begin.first | (begin.second & stand)
    x = match(
        (joins, FIRST_END - 2),
        (walks & (stood | (left & (m.walked == 2))), STAND_X),
        (walks & moved & (at == m.walked - 1) & (at > 0), at - 1),
        otherwise=at,
    )
    return x, marchers


def _takes_off(m: Ram) -> jax.Array:
    """Whether a wolf has taken a balloon in this frame."""
    slot = (m.frame - 1) & 7
    row = jnp.where(m.ascends == 1, SPAWN_ROWS[1], SPAWN_ROWS[0])
    return jnp.any((np.arange(6) == slot) & (m.balloon_row == row))


def _climber(m: Ram, walks: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The climber's row, 0 if there is none, and its reach."""
    still = (m.until_reach == 0) & (m.until_step == 0) & (m.reach == Reach.IN)
    moved = still & (m.seen_row == m.row)
    march_ends = (m.walked == WALK_END) & (m.march != March.STANDS)
    starts = walks & (march_ends | (m.landed_walked == WALK_END))
    row = match(
        ((m.climber_row == 0) | (m.state == State.INTRO), 0),
        (starts & (m.climber_row == CLIMB_START), 0),
        (moved, m.climber_row + jnp.where(m.climber_row < m.row, -1, 1)),
        otherwise=m.climber_row,
    )
    bites = (m.until_reach == BITES) & (m.state != State.DEATH)
    reaches = (m.until_reach == REACHES) & (m.reach == Reach.OUT)
    return row, match((bites, Reach.OUT), (reaches, Reach.IN), otherwise=m.reach)
