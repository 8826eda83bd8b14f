"""The Kop as drawn: undoes the game's moves after the drawing."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from ocjax.authoring import among, match, when
from ocjax.extractors.keystonekapers.ram import Pose, Ram, Ride

FREEZE = 8  # `pause` on the first frame of a freeze by a collision
FREEZES = 5  # least `sound` of a freeze
PENALTY = 5  # `sound` while time runs fast
ROUND = 50  # seconds
KILLED = 6  # `sound`
TICK = 127  # bits of `clock`
FAST_TICK = 3
STEPS = 5  # poses of a step, starting at 1
JUMP_STARTS = 18  # steps of a jump
RISES = 9  # least remaining steps of the rise
HANGS = (6, 7, 8, 9, 10, 11)  # steps that take four frames
LAST_FAST = 11  # `jump` after the last step before these
LAST_FAST_PAUSE = 9  # of the jump's sound on the frame of that step
LANDS = 1  # low bits of `clock`: the last slow step happens when they are 0
FLOOR_HEIGHT = 32
RIGHT_EDGE = 0x9A  # `kop_x` after coming from the right
LEFT_EDGE = 8
LAST_SECTION = 0  # at the right end of the building
FIRST_SECTION = 7  # at its left end
RIGHT_WALL = 0x99  # the game puts him back to this column at the edge
LEFT_WALL = 9


class Drawn(NamedTuple):
    """The Kop on the frame."""

    x: jax.Array
    height: jax.Array
    floor: jax.Array
    pose: jax.Array
    section: jax.Array
    time: jax.Array


def as_drawn(m: Ram) -> Drawn:
    """Undo the Kop's moves since the frame was drawn."""
    dx, dy = _step(m)
    height = m.height - dy
    below = height < 0  # the frame shows the end of an escalator, from the floor below
    x, section = _across(m, kop_column(m) - dx)
    return Drawn(
        x=x,
        height=jnp.where(below, height + FLOOR_HEIGHT, height),
        floor=(m.place >> 3) - when(below, 1),
        pose=_pose_before(m),
        section=section,
        time=m.time + when(_ticked(m) & (section == m.section), 1),
    )


def has_begun_anew(m: Ram) -> jax.Array:
    """True if a life has just been lost: the RAM is the next life's, the frame is the old one's."""
    return (m.clock == 0) & (m.time == ROUND) & (m.age != 0)


def _ticked(m: Ram) -> jax.Array:
    """True if a second has just passed."""
    second = jnp.where(m.sound == PENALTY, FAST_TICK, TICK)
    return m.plays & (m.sound != KILLED) & (m.time < ROUND) & ((m.clock & second) == 0)


def kop_column(m: Ram) -> jax.Array:
    """The Kop's column on his own floor."""
    floor = m.place >> 3
    return sum((when(floor == i, m.kop_x[i]) for i in range(4)), jnp.int32(0))


def _across(m: Ram, x: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The Kop's column and section before he entered a section or was put back at a wall."""
    to_left = _moves_aside(m) & m.faces_left
    to_right = _moves_aside(m) & ~m.faces_left
    came_left = to_left & (x > RIGHT_EDGE)
    came_right = to_right & (x < LEFT_EDGE)
    at_right_wall = to_right & (m.section == LAST_SECTION) & (x == RIGHT_WALL - 1)
    at_left_wall = to_left & (m.section == FIRST_SECTION) & (x == LEFT_WALL + 1)
    before = match(
        (came_left | at_left_wall, LEFT_EDGE),
        (came_right | at_right_wall, RIGHT_EDGE),
        otherwise=x,
    )
    return before, m.section - when(came_left, 1) + when(came_right, 1)


def _step(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Columns and rows that the Kop has moved."""
    rides = (m.ride == Ride.ESCALATOR) & ((m.clock & 3) == 0)
    up = jnp.where(m.rides_left, -1, 1)
    ahead = jnp.where(m.faces_left, -1, 1)
    dx = match((rides, up), (_moves_aside(m), ahead), otherwise=0)
    dy = match((rides, 1), (_in_air(m), _jump_step(m)), otherwise=0)
    return when(~_is_frozen(m), dx), when(~_is_frozen(m), dy)


def _is_frozen(m: Ram) -> jax.Array:
    """True while a collision keeps everybody from moving, except on its own frame."""
    begins = (m.pause == FREEZE) & ((m.clock & 3) == 1)
    return (m.sound >= FREEZES) & ~begins


def _moves_aside(m: Ram) -> jax.Array:
    """True if the Kop has walked or flown a column sideways."""
    pushed = m.stick_down & (~m.stick_left | ~m.stick_right)
    walked = among(m.pose, range(1, STEPS + 1))
    return (m.ride == Ride.NONE) & ~_is_frozen(m) & jnp.where(_in_air(m), pushed, walked)


def _in_air(m: Ram) -> jax.Array:
    """True if the frame shows a jump, or its beginning."""
    return (m.ride == Ride.NONE) & ((m.jump > 0) | _landed(m))


def _landed(m: Ram) -> jax.Array:
    """True if a jump has just ended."""
    down = (m.jump == 0) & (m.pose == Pose.JUMPS) & (m.height == 0)
    return down & m.button & ((m.clock & 3) == LANDS)


def _jump_step(m: Ram) -> jax.Array:
    """Rows that the Kop has risen."""
    waits = among(m.jump, HANGS) & ((m.clock & 3) != 0)
    arrived = (m.jump == LAST_FAST) & (m.pause == LAST_FAST_PAUSE)
    still = (m.jump == JUMP_STARTS) | (waits & ~arrived)
    return match((still, 0), (m.jump >= RISES, 1), otherwise=-1)


def _pose_before(m: Ram) -> jax.Array:
    """The pose before a step; it changes on odd columns."""
    walked = among(m.pose, range(1, STEPS + 1)) & ~_in_air(m) & (m.ride == Ride.NONE)
    stepped = walked & ((kop_column(m) & 1) == 1) & ~_is_frozen(m)
    return jnp.where(stepped, jnp.where(m.pose == 1, STEPS, m.pose - 1), m.pose)
