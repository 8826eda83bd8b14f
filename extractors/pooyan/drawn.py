"""Pooyan's moving things as drawn.

After the frame is drawn, wolves walk ($F9C6), the climber moves ($F950), and the clock counts on
($FCDF). When a life is lost, the records are cleared ($F52D).
"""

from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import lookup, match, packed_position, when
from ocjax.extractors.pooyan.ram import LAST_ROW, Copies, March, Ram, Reach, State

INTRO_TUNE = 0x8B  # low byte of the address, after the first note
FIRST_NOTE = 8  # frames of this note
LAST_TUNE = 0xA7  # after the last note
LAST_NOTE = 23  # remaining frames of this note when play begins
RESET_FRAME = 2  # the clock's first one
LOSS = 0xD2  # value of `Ram.frames` when a life is lost
NO_ROPE = 251  # `Ram.rope` when a life is lost
FIRST_END = 0x20  # `Ram.walked` when another wolf joins the marching ones
LAST_END = 0x2C  # and when all stand
STAND_X = LAST_END - 1
SPAWN_ROWS = (1, 6)  # of wolves that take off; the second one in rounds with wolves from below
LANDINGS = (0x2C, 0x4C, 0x6C)  # columns, by `landed_column`
WALK_END = 0x9F  # columns that a wolf has walked when it begins to climb
CLIMB_START = 6  # row
REACHES = 0x1F  # `Ram.until_reach` on the first frame
BITES = 0x4F  # `Ram.until_reach` when the climber begins to bite
GAME_OVER_TINT = 0x62  # added to the player's colour
PALETTE = 0xFE  # bits of a colour


@dataclass(frozen=True)
class Drawn:
    """The state when the frame was drawn. Columns belong to sprites of eight columns."""

    shows_round: jax.Array  # instead of the score
    is_lost: jax.Array  # a life
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


class Moment(NamedTuple):
    """The program's actions after the frame."""

    begins: jax.Array  # a round's introduction: records are cleared
    continues: jax.Array  # the frame after that
    is_lost: jax.Array  # a life, and its round begins again
    ends: jax.Array  # the round before
    is_reset: jax.Array
    plays: jax.Array  # the introduction is over
    walks: jax.Array  # wolves move
    joins: jax.Array  # another wolf marches


def _done_since(m: Ram) -> Moment:
    intro = (m.state == State.INTRO) & (m.tune == INTRO_TUNE)
    begins = intro & (m.tune_pause == FIRST_NOTE) & (m.frame != RESET_FRAME)
    continues = intro & (m.tune_pause == FIRST_NOTE - 1)
    is_lost = begins & (_clock(m) == LOSS) & (m.rope == NO_ROPE)
    walks = m.until_walk == 1
    return Moment(
        begins=begins,
        continues=continues,
        is_lost=is_lost,
        ends=begins & ~is_lost,
        is_reset=(intro & (m.frame == RESET_FRAME)) | (continues & (m.frame == RESET_FRAME + 1)),
        plays=(m.state == State.PLAY) & (m.tune == LAST_TUNE) & (m.tune_pause == LAST_NOTE),
        walks=walks,
        joins=walks & (m.walked == 1) & (m.march == March.COMES) & (m.copies > Copies.ONE),
    )


def _clock(m: Ram) -> jax.Array:
    """Eighths of the frame count when the frame was drawn."""
    return m.frames - when((m.frame & 7) == 0, 1)


def as_drawn(m: Ram) -> Drawn:
    """Undo the program's actions since the frame was drawn."""
    now = _done_since(m)
    march_x, marchers = _parade(m, now)
    strides = now.walks & (((m.walked & 3) == 0) | now.joins)
    climber_row, reach = _climber(m, now.walks)
    before = when(now.walks, 1)
    row = match(
        (now.is_lost | now.is_reset, 0), (now.ends, m.rope + LAST_ROW & 255), otherwise=m.row
    )
    return Drawn(
        shows_round=((m.state == State.INTRO) & ~now.begins) | now.plays,
        is_lost=now.is_lost,
        ascends=m.ascends ^ when(now.ends, 1),
        row=row,
        pushers=jnp.where(now.ends, m.pushers_before, m.pushers),
        climber_row=climber_row,
        reach=reach,
        march_x=march_x,
        marchers=marchers,
        stride=m.stride ^ when(strides, 1),
        landed_x=m.landed_walked - 2 - before,
        is_landed=m.landed_walked > lookup(np.array(LANDINGS), m.landed_column) + before,
        flash=_clock(m) << 1 & PALETTE,
        player_color=(m.player_color - when(m.state == State.END, GAME_OVER_TINT)) & PALETTE,
    )


def column(code: jax.Array) -> jax.Array:
    """Column of a sprite."""
    return packed_position(code) - 46


def _parade(m: Ram, now: Moment) -> tuple[jax.Array, jax.Array]:
    """Column and number of wolves that march."""
    stand = m.standing > 0
    alone = (m.copies == Copies.ONE) & (m.march == March.COMES) & (m.state != State.INTRO)
    left = alone & ~stand  # the standing wolves have all taken balloons
    march = match((m.copies == Copies.THREE, 3), (m.copies == Copies.TWO, 2), otherwise=1)
    marchers = match(
        (now.joins, march - 1),
        (now.begins & stand, 3),
        (now.begins & now.walks, 0),  # their position is unknown
        (left & (m.walked == 1) & _takes_off(m), 3),
        otherwise=march,
    )
    at = column(m.marchers_at)
    moved = (m.march != March.STANDS) | (m.walked == LAST_END)
    stood = now.begins | (now.continues & stand) | (left & (m.walked == 2))
    x = match(
        (now.joins, FIRST_END - 2),
        (now.walks & stood, STAND_X),
        (now.walks & moved & (at == m.walked - 1) & (at > 0), at - 1),
        otherwise=at,
    )
    return x, marchers


def _takes_off(m: Ram) -> jax.Array:
    """True if a wolf has taken a balloon in this frame."""
    slot = (m.frame - 1) & 7
    row = jnp.where(m.ascends == 1, SPAWN_ROWS[1], SPAWN_ROWS[0])
    return jnp.any((np.arange(6) == slot) & (m.balloon_row == row))


def _climber(m: Ram, walks: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The climber's row, 0 without a climber, and its reach."""
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
    is_biting = (m.until_reach == BITES) & (m.state != State.DEATH)
    is_reaching = (m.until_reach == REACHES) & (m.reach == Reach.OUT)
    return row, match((is_biting, Reach.OUT), (is_reaching, Reach.IN), otherwise=m.reach)
