"""King Kong's figures as drawn: undoes their moves after the drawing, which alternate."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from ocjax.authoring import among, match, packed_position, pick, when
from ocjax.extractors.kingkong.ram import Jump, Leap, Ram, Sound, State, Stick, Turn

LEFTMOST = 0xB1  # `x` of a climber at the left end
RIGHTMOST = 0xAA
FEEDBACK = 0x4D  # of the shift register for the captive
LIVES = 3
SET_UP = 7  # `second` when a life begins
JUST_SET_UP = (3, 4, 5, 6)  # low six bits of `clock`
COUNTS = 0x3C  # bits of `clock`; when they are 0, the bonus counts down
JUMP_STEPS = 14
FIRST_DOWN = 1  # `steps` after the first rung
FIRST_UP = 11
POSES = (0x01, 0x0A, 0x13, 0x1C, 0x25, 0x2E, 0x37)  # pointers to the climber's pictures


class Pose:  # index into `POSES`
    STEP = 0
    STRIDE = 1
    STANDS = 2
    JUMPS = 3
    CLIMBS = 4  # two pictures
    LIES = 6


STEPS = (Pose.STEP, Pose.STRIDE, Pose.STANDS, Pose.STRIDE)


class Drawn(NamedTuple):
    """The state when the frame was drawn. `y` is the row below a figure."""

    x: jax.Array  # of the climber
    y: jax.Array
    pose: jax.Array
    kong_x: jax.Array
    kong_y: jax.Array
    captive_x: jax.Array
    captive_look: jax.Array  # index into `CAPTIVES`
    bonus: jax.Array  # tens


def as_drawn(m: Ram) -> Drawn:
    """Undo the game's moves since it drew the frame."""
    dx, dy = when(_climber_moved(m), jnp.stack(_climber_step(m)))
    kong_dx, kong_dy = when(_kong_moved(m), jnp.stack(_kong_step(m)))
    counted = (m.turn == Turn.DIGITS) & ((m.clock & COUNTS) == 0) & _plays(m)
    return Drawn(
        x=column(of_climber(m, m.x)) - dx,
        y=of_climber(m, m.y) - dy,
        pose=_pose_before(m),
        kong_x=column(jnp.where(m.kong == 0, *m.x)) - kong_dx,
        kong_y=jnp.where(m.kong == 0, *m.y) - kong_dy,
        captive_x=_captive_x_before(m),
        captive_look=_captive_look_before(m),
        bonus=m.bonus + when(counted, 1),
    )


def column(code: jax.Array) -> jax.Array:
    """The column of a figure's picture, from its position byte."""
    return packed_position(code) - 19


def of_climber(m: Ram, field: jax.Array) -> jax.Array:
    """The climber's value from the values of the two records."""
    return jnp.where(m.climber == 0, *field)


def there(m: Ram) -> jax.Array:
    """True if a climber is on the ground or on the way."""
    return (m.state >= State.WAITS) & (m.climber != m.kong) & ~_life_lost(m)


def _life_lost(m: Ram) -> jax.Array:
    """True if the frame is the last one of a life; the RAM is already set up for the next."""
    waits = (m.state == State.WAITS) & (m.second == SET_UP) & (m.lives < LIVES)
    return waits & (m.turn == Turn.KONG) & among(m.clock & 63, JUST_SET_UP)


def _plays(m: Ram) -> jax.Array:
    return (m.state >= State.LOWER_HALF) & (m.state < State.HIT)


# The climber's moves since the frame was drawn.


def _climber_moved(m: Ram) -> jax.Array:
    """True on the climber's turn."""
    return (m.turn == Turn.CLIMBER) & (_plays(m) | among(m.state, (State.FALLS, State.LIES)))


def _in_air(m: Ram) -> jax.Array:
    return m.jumps & (m.jump > 0)


def _landed(m: Ram) -> jax.Array:
    """True if a jump has just ended; this is unknown until the button is released."""
    return m.jumps & (m.jump == 0) & m.released


def _on_rung(m: Ram) -> jax.Array:
    """True if the climber has just moved a rung or fallen a row, which makes a sound."""
    return (m.sound == Sound.RUNG) & (m.sound_time == Sound.RUNG_BEGAN)


def _walks(m: Ram) -> jax.Array:
    code = of_climber(m, m.x)
    blocked = jnp.where(of_climber(m, m.faces_left) == 1, code == LEFTMOST, code == RIGHTMOST)
    pushed = (m.stick & Stick.UP_DOWN == Stick.UP_DOWN) & (m.stick & Stick.ASIDE != Stick.ASIDE)
    free = ~_in_air(m) & ~_landed(m) & ~m.climbs & ~m.falls & (m.state != State.LIES)
    return free & pushed & ~blocked


def _climber_step(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Columns and rows that the climber moves on its turn."""
    jumps = _in_air(m) & (m.jump < JUMP_STEPS)
    aside = match((m.goes == Jump.UP, 0), (m.goes == Jump.RIGHT, 1), otherwise=-1)
    ahead = jnp.where(of_climber(m, m.faces_left) == 1, -1, 1)
    rise = match((m.jump > JUMP_STEPS // 2, -1), (m.jump < JUMP_STEPS // 2, 1), otherwise=0)
    fall = jnp.where(m.falls | (m.stick & Stick.UP != 0), 1, -1)
    dx = match((jumps, aside), (_walks(m), ahead), otherwise=0)
    return dx, match((jumps, rise), (_on_rung(m) & ~_in_air(m), fall), otherwise=0)


def _pose_before(m: Ram) -> jax.Array:
    """The climber's pose before its turn; if several are possible, the usual one."""
    picture = of_climber(m, m.picture)
    pose = match(*((picture == pointer, i) for i, pointer in enumerate(POSES)), otherwise=0)
    stepped = m.steps - when(~_in_air(m), 1)  # in the air, a jump has begun
    walked = jnp.where(stepped == 0, Pose.STANDS, pick(stepped & 3, STEPS))
    first_rung = among(m.steps, (FIRST_DOWN, FIRST_UP))
    climbed = jnp.where(first_rung, Pose.STANDS, Pose.CLIMBS + (of_climber(m, m.y) & 1))
    before = match(
        (_in_air(m) & (m.jump == JUMP_STEPS), walked),
        (_landed(m) | ((m.state == State.LIES) & _on_rung(m)), Pose.JUMPS),
        (_on_rung(m) & ~_in_air(m) & ~m.falls, climbed),
        (_walks(m), walked),
        otherwise=pose,
    )
    return jnp.where(_climber_moved(m), before, pose)


# Kong and the captive.


def _kong_moved(m: Ram) -> jax.Array:
    flies = among(m.state, (State.KONG_CLIMBS, State.KONG_LEAVES, State.KONG_RETURNS))
    arrived = (m.state == State.WAITS) & (m.climber == m.kong) & (m.turn == Turn.CAPTIVE)
    return (flies & ((m.turn & 1) == 0)) | arrived


def _kong_step(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Columns and rows that Kong leaps on his turn; on landing he turns around."""
    left = m.kong_left ^ when(m.leap == Leap.LANDED, 1)
    return 1 - 2 * left, match((m.leap < Leap.TOP, -1), (m.leap == Leap.TOP, 0), otherwise=1)


def _captive_x_before(m: Ram) -> jax.Array:
    moved = (m.turn == Turn.CAPTIVE) & (m.captive & 3 >= 2)
    return column(m.captive_x) - when(moved, 1 - 2 * m.captive_left)


def _captive_look_before(m: Ram) -> jax.Array:
    """Arms up or down, from the previous state of a shift register."""
    shifted = (m.turn == Turn.CAPTIVE) & ((m.clock & 0x0C) == 0)
    wrapped = m.captive & 1 == 1
    before = jnp.where(wrapped, (m.captive ^ FEEDBACK) >> 1 | 128, m.captive >> 1)
    return when(jnp.where(shifted, before, m.captive) & 0x0C == 0, 1)
