"""The state of Defender when the frame was drawn, before the game moved on."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import div, match, only, pick, when
from ocjax.extractors.defender.ram import (
    ROM,
    Capture,
    Countdown,
    Facing,
    Pause,
    Picture,
    Ram,
    Speed,
    Status,
    Timing,
    Turn,
)

FLAME_COLOR = 54
SHIP_COLOR = 142

START_X = 30  # of the ship in a new life
START_Y = 50
START_SCROLL = 160
FIRST_FRAMES = 63  # of a wave
VANISHED = 170  # the ship's y above the screen, before it appears elsewhere
GLIDE_MASKS = ROM.bytes(0xEB5, 5)  # frames on which the world scrolls, by tens of speed
SHOT_STEP = 7  # columns per frame of the ship's shot
AHEAD = 5  # columns from the ship's x to a shot's first position to the right
BEHIND = 32  # the same to the left
LEAST_Y = 15  # of a missile
RIGHT_END = 160

OFFSETS = ROM.bytes(0xEF2, 8)  # of aliens and humans, relative to the scroll
ON_SCREEN = 89  # first position in the world that is on the screen
HUMANS_END = 168  # first position of a human right of it
HUMAN_BITS = np.array((128, 64, 32, 16, 8))  # of `Ram.lost`


@dataclass(frozen=True)
class Drawn:
    """The state when the frame was drawn."""

    runs: jax.Array  # the game was not paused
    lately: jax.Array  # and the frame before is known, too: no life has just ended
    frame: jax.Array  # its number
    forward: jax.Array  # the ship looks right
    dies: jax.Array  # the ship flashes or explodes
    scroll: jax.Array
    wander: jax.Array  # position of the landers' group
    capture_x: jax.Array
    places: jax.Array  # of humans
    dot: jax.Array  # record of the scanner's dot
    human: jax.Array  # the drawn human
    human_before: jax.Array  # the human on the frame before


def as_drawn(m: Ram) -> Drawn:
    """Revert the game's changes after the drawing."""
    frame = m.frame - 1 & 255
    runs = _has_run(m)
    lately = m.pause != Pause.NEW_LIFE
    moves = runs & lately & (m.countdown == 0)
    glide = when(moves, _moved_by(m, frame))
    turn = moves & ((frame & 7) == 0)
    caught = m.capture < Capture.COMES
    capture_x = m.capture_x - when(caught, glide) & 255
    held = caught & (jnp.arange(5) == m.captive)
    human = _turn_before(m.next_human, m.frame)
    return Drawn(
        runs=runs,
        lately=lately,
        frame=frame,
        forward=m.facing == Facing.RIGHT,
        dies=runs & ((m.countdown > 0) | ~lately),
        scroll=(m.scroll - glide - when(turn, jnp.where(m.facing == Facing.RIGHT, -1, 1))) & 255,
        wander=(m.group_x[2] - when(turn, jnp.where(m.random < 128, 1, -1))) & 255,
        capture_x=capture_x,
        places=jnp.where(held, capture_x, m.ground - 2 * glide + OFFSETS[:5] & 255),
        dot=m.next_dot - 1 & 7,
        human=human,
        human_before=jnp.where(lately, _turn_before(human, frame), human),
    )


def _has_run(m: Ram) -> jax.Array:
    """True if the game was not paused. The frame that begins a life is still empty."""
    at_start = (m.x == START_X) & (m.y == START_Y) & (m.scroll == START_SCROLL)
    still = (m.group_x[2] == 0) & (m.way == 0) & (m.shot_x == 0)
    # Since the wave began, unless the world has scrolled; a life may also begin within a wave.
    age = m.group_y[1] - m.ground & 255
    within = (age > FIRST_FRAMES) & ((m.missile_dx == Speed.NONE) | _is_fired(m))
    begins = at_start & still & ((age == 0) | within)
    reset = (m.scroll == START_SCROLL) & (age == 0)
    ends = (m.wave_over == 0) & (m.y < VANISHED) & ~reset
    return match(
        (m.pause == Pause.RUNS, ~begins),
        (m.pause == Pause.NEW_LIFE, ends),
        otherwise=m.pause == Pause.NEXT_WAVE,
    )


def _moved_by(m: Ram, frame: jax.Array) -> jax.Array:
    """Places that the world has moved for this frame."""
    tens = div(10 * (m.speed >> 4) + (m.speed & 15) + 13, 10)
    due = (m.speed > 0) & ((frame & pick(tens, GLIDE_MASKS.tolist())) == 0)
    backwards = (m.thrust > 0) & (m.way != 0) & (m.turned > 0)
    return when(due, jnp.where((m.facing == Facing.RIGHT) ^ backwards, -1, 1))


def _turn_before(number: jax.Array, frame: jax.Array) -> jax.Array:
    """The human drawn before a human or the ship; after the ship, the first human comes twice."""
    again = (number == 0) & ((frame - 1 & 15) == 0)
    return match((again, 0), ((number > 0) & (number != Turn.SHIP), number - 1), otherwise=4)


def explodes(m: Ram, d: Drawn) -> jax.Array:
    """True if the ship no longer flashes. The countdown steps on every fourth frame."""
    left = m.countdown + when((m.frame & 3) == 0, 1) + when((d.frame & 3) == 0, 1)
    return d.dies & ((left < Countdown.EXPLODES) | ~d.lately)


def own_shot(m: Ram, d: Drawn) -> tuple[jax.Array, jax.Array]:
    """Position of the ship's shot, and True if it was drawn. It may just have been fired."""
    fired = m.shot_x == m.x + jnp.where(d.forward, AHEAD, -BEHIND)
    x = m.shot_x - jnp.where(d.forward, SHOT_STEP, -SHOT_STEP)
    flew = (m.shot_x > 0) & ~fired & (x > 0)
    return x, d.runs & ~d.dies & flew & ((d.frame & 31) != 0)


def sprite_color(m: Ram, d: Drawn) -> jax.Array:
    """The colour of the ship's sprite and of all missiles."""
    cycled = only(jnp.arange(8) == d.dot, m.colors) & 254
    cycles = d.dies | own_shot(m, d)[1]
    flame = (d.frame & 7) == 0
    return match((cycles, cycled), (flame, FLAME_COLOR), otherwise=SHIP_COLOR)


def missile(m: Ram, d: Drawn) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Column and display row of an alien's shot, and True if it exists."""
    dx, dy = _missile_step(m)
    ended = (m.timing == Timing.SHOT) & (m.countdown == 0)
    there = d.runs & ((m.missile_dx != Speed.NONE) | ended) & ~_is_fired(m)
    # A shot that has left the screen was at its edge.
    beyond_left = m.missile_x >= RIGHT_END + 80
    x = jnp.where(beyond_left, 0, jnp.minimum(m.missile_x - dx, RIGHT_END - 2))
    return x, m.missile_y - dy, there


def _missile_step(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Motion of an alien's shot since the drawing; mines and ended shots do not move."""
    left_field = (m.missile_y < LEAST_Y) | (m.missile_x >= RIGHT_END)
    flies = jnp.where(m.missile_dx == Speed.NONE, left_field, m.missile_dx != Speed.MINE)
    moved = (m.timing == Timing.SHOT) & flies
    return when(moved, m.missile_dx), when(moved, m.missile_dy)


def _is_fired(m: Ram) -> jax.Array:
    """True if the next alien has just fired."""
    dx, dy = _missile_step(m)
    at_alien = (m.missile_x - dx == m.next_x) & (m.missile_y - dy == m.next_y)
    return (m.timing == Timing.SHOT) & at_alien


def _has_burst(m: Ram) -> jax.Array:
    """True for the record that explodes next."""
    return (jnp.arange(8) == m.next_alien) & (m.next_picture == Picture.EXPLOSION)


def alien_kinds(m: Ram) -> jax.Array:
    """The kinds of all records, including one that has burst since."""
    return jnp.where(_has_burst(m), m.next_kind, m.kind)


def alive(m: Ram) -> jax.Array:
    """True for living aliens, including the drawn one if it has been hit or has burst since."""
    shown = jnp.arange(8) == m.drawn
    hit = m.status >> 4 == Status.HIT
    return (m.status >> 4 == Status.ALIVE) | (shown & (hit | _has_burst(m)))


def present(m: Ram) -> jax.Array:
    """True for humans that are not lost."""
    return (m.lost & HUMAN_BITS) == 0


def visible(m: Ram, d: Drawn) -> jax.Array:
    """True for humans on the screen."""
    return present(m) & (d.places >= ON_SCREEN) & (d.places < HUMANS_END)
