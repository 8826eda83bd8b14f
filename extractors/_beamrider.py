"""Beam Rider's RAM, and where its records were before their last step.

The game makes the list of what is drawn from the records and moves the records afterwards. The
steps follow from what a record is, from its speed or the script that it follows, and from the frame
counter.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.ops import among, lookup, match, when
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.registers import signed_nibble
from ocjax.console.rom import Rom

ROM = Rom("beam_rider", "79ab4123a83dc11d468fb2108ea09e2e")


class State:  # of `Ram.state` and `Ram.shot`; also the numbers of a record's pictures
    DEBRIS = range(1, 2)
    ENEMY_SHOT = range(2, 4)
    BLOCKER = range(4, 6)
    BLOCKER_ASIDE = 4
    BLOCKER_FALLING = 5
    BURST = range(6, 12)
    EXPLOSION = range(6, 10)
    SPARKS = range(10, 12)
    CHARGER = range(12, 16)
    CHARGER_WAITING = 15
    REJUVENATOR = range(16, 20)
    JUMPER = range(20, 24)
    ROCK = range(24, 28)
    SIZED = range(12, 28)  # four pictures each, larger the nearer
    CHIRPER = range(28, 32)
    CHIRPER_TURNED = range(30, 32)
    CRAFT = range(32, 35)
    CRAFT_ASIDE = 32
    CRAFT_FALLING = 33
    CRAFT_RISING = 34
    LASER = 35
    TORPEDO = range(36, 39)
    STRUCK = 192  # the player's shot on the frame of the hit


class Saucer:  # of `Ram.state` in the records of the saucers
    ANY = range(1, 6)
    LEAVING = 1
    LEFT = 2
    RIGHT = 3
    SCRIPTED = range(4, 6)


class Op:  # of the saucers' script; those before are the ways to the side
    RISE = 2
    FALL = 3


class Flag:  # of `Ram.half` and `Ram.ship_lost`
    CLEAR = 0
    SET = 255


SAUCERS = slice(0, 3)  # among the records
OTHERS = slice(3, 7)
JUST_HIT = 8  # timer of a burst on the frame of the hit, which still shows what was hit
SCRIPT_OPS = ROM.bytes(0xD96, 216) & 7  # what saucers do,
SCRIPT_PACES = ROM.bytes(0xE6E, 216)  # and how fast


class Ram(RamMap):
    sector = bcd(0)
    sector_ones = bits(0, count=4)  # its last digit
    clock = bits(1, count=4)  # steps
    drift = byte(4)  # speed of the saucers
    speed = byte(7)  # of the other enemies
    spare_ships = byte(5)
    score = bcd((11, 10, 9))
    ship = bits(14, first=3, count=5)  # picture
    ship_position = byte(15)  # as HMP0 and the positioning loop take it
    script_at = byte(17, 18, 19)  # the saucers' places in the script
    y = byte(*range(25, 32))  # depth: 0 horizon, 255 none
    shot_y = byte(32)  # depth
    x = byte(*range(33, 40))  # lane, 128 in the middle
    shot_x = byte(40)  # lane
    state = bits(*range(42, 49), count=6)
    follows = bits(*range(42, 49), first=6)  # drifts as the saucers do
    back = bits(*range(42, 49), first=7)  # on its way back
    shot = byte(49)  # state of the player's shot
    timer = byte(*range(50, 57))  # frames, or speed to the side
    sentinel_x = byte(52)
    torpedoes = byte(83)
    enemies = byte(84)  # left in this sector
    list_color = byte(*range(85, 92))
    list_line = byte(*range(93, 100))
    half = byte(101)  # clear or set: the list is new, and not drawn yet
    ship_lost = byte(103)  # set on the frame on which the next ship is taken from the spare ones


def just_hit(m: Ram) -> jax.Array:
    return (m.state == State.BURST.start) & (m.timer == JUST_HIT)


def bursting(m: Ram) -> jax.Array:
    return among(m.state, State.BURST) & ~just_hit(m)


def is_saucer(m: Ram) -> jax.Array:
    return (among(m.state, Saucer.ANY) | just_hit(m)) & (np.arange(7) < 3)


def list_is_new(m: Ram) -> jax.Array:
    """Whether the records other than the saucers have moved since the list was made."""
    return among(m.half, (Flag.CLEAR, Flag.SET))


def _step(m: Ram, speed: jax.Array | int) -> jax.Array:
    """How far a speed moves a record in this step: a signed nibble, and a nibble of sixteenths."""
    bit = np.arange(4)
    tick = jnp.sum((m.clock >> bit & 1) << (3 - bit)) + 1
    sixteenths = jnp.asarray(speed, jnp.int32) & 255
    return signed_nibble(sixteenths >> 4) + when((sixteenths & 15) >= tick, 1)


def drawn_places(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Lane and depth of the seven records before their last step."""
    saucer_dx, saucer_dy = _saucer_steps(m)
    other_dx, other_dy = _other_steps(m)
    x = m.x - jnp.concatenate((saucer_dx, other_dx))
    y = m.y - jnp.concatenate((saucer_dy, other_dy))
    return x, jnp.where(m.y == 0, 0, y)


def _saucer_steps(m: Ram) -> tuple[jax.Array, jax.Array]:
    state, burst = m.state[SAUCERS], bursting(m)[SAUCERS]
    op, speed = lookup(SCRIPT_OPS, m.script_at), lookup(SCRIPT_PACES, m.script_at)
    forth, back = _step(m, speed), _step(m, -speed)
    scripted = among(state, Saucer.SCRIPTED) | just_hit(m)[SAUCERS]
    aside = jnp.where(((op ^ state) & 1) == 1, forth, back)
    dx = match(
        (burst, 0),
        (scripted, when(op < Op.RISE, aside)),
        (state == Saucer.LEFT, -1),
        (state == Saucer.RIGHT, 1),
        otherwise=0,
    )
    dy = match(
        (burst, -2),
        (scripted & (op == Op.FALL), forth),
        (scripted & (op == Op.RISE), back),
        (scripted, _step(m, m.drift)),
        (state == Saucer.LEAVING, _step(m, 179)),
        otherwise=0,
    )
    return dx, dy


def _other_steps(m: Ram) -> tuple[jax.Array, jax.Array]:
    kind, new = m.state[OTHERS], list_is_new(m)
    jumps_back = among(kind, State.JUMPER) & (m.back[OTHERS] == 1)
    aside = (kind == State.BLOCKER_ASIDE) | (kind == State.CRAFT_ASIDE)
    aside = aside | among(kind, State.CHIRPER) | jumps_back
    ahead = jnp.where(among(kind, State.BURST), -2, _step(m, _other_speeds(m)))
    dx = when(new & aside, _step(m, m.timer[OTHERS]))
    dy = when(new & ~aside, ahead)
    return dx, dy + when(m.follows[OTHERS] == 1, _step(m, m.drift))


def _other_speeds(m: Ram) -> jax.Array:
    """Speed along the beams of the records other than the saucers."""
    kind, timer, back = m.state[OTHERS], m.timer[OTHERS], m.back[OTHERS] == 1
    waits = (kind == State.CHARGER_WAITING) & (timer < 128)
    return match(
        (kind == State.CRAFT_RISING, 224 - m.speed),
        (kind == State.CRAFT_FALLING, m.speed - 5),
        (among(kind, State.ROCK), m.speed + 12),
        (among(kind, State.REJUVENATOR), (m.speed >> 1) + 19),
        (among(kind, State.CHARGER) & back, 141),
        (waits, jnp.where(timer > 0, 0, 8)),
        (among(kind, State.DEBRIS), m.speed + 45),
        (kind < State.BLOCKER.start, m.speed),
        (kind == State.BLOCKER_FALLING, m.speed + 14),
        otherwise=m.speed + 19,
    )
