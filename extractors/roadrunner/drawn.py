"""Road Runner's bird and coyote as drawn.

The game draws the frame and then moves everything ($F01E of bank 2), so the RAM is a step ahead of
the screen. `as_drawn` undoes the step.
"""

from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Box, Pictures, among, box, match, pick, reached, when
from ocjax.extractors.roadrunner.ram import ROM, Caught, Pace, Pose, Ram, Scene, Scenery, Stick

VIEW = (8, 2, 152, 210)

START_X = 100  # of the bird
COYOTE_START_X = 130
STILL = 69  # column of the bird that keeps still while the road moves
NEAR_X = 80  # up to this column, the road moves instead of a running bird
BACK_LIMIT = 144  # the bird gets no further back
GONE = 145  # a figure right of it is hidden
FAST_X = 128  # from here, a fast coyote steps on each frame
HIGHEST = (1, 28)  # `y` at which the bird goes no further up
OUT_OF_SIGHT = 60  # least `y` of a falling bird that is out of sight
FALL_START = 36  # least `y` at which a fall moves the complete picture
FIRST_JUMP = 29  # `jump` on the first frame of a jump

FIRST_LINES = (96, 99, 96, 81, 96, 123, 96, 81)  # of the road, in each scene
REPEATED_LINES = (255, 125, 255, 135, 255, 147, 255, 135)  # the first line that repeats a row
EDGE = 134  # the road's first row in scenes 3 and 7
BURNT_GRAYS = (4, 6)  # of burnt figures, in odd and in even scenes
BODIES = (136, 52)  # of the bird and the coyote


def _pointers(address: int, poses: int) -> list[int]:
    """A table of pointers to pictures in the last bank, as indices of `FIGURE_PICTURES`."""
    lower, upper = ROM.bytes(address, 2 * poses).reshape(2, poses)
    return (4096 + lower + (upper % 16 << 8)).tolist()


LINES = 86  # of the road that show pictures
BANKS = np.pad(ROM.data.reshape(4, 4096)[[0, 3]], ((0, 0), (0, LINES - 1)))  # both, then zeros
DRAWN_LINES = np.lib.stride_tricks.sliding_window_view(BANKS, LINES, axis=1)[..., ::-1]
FIGURE_PICTURES = Pictures.of(DRAWN_LINES.reshape(-1, LINES))  # picture at each pointer into them
NOTHING = 0x1E73  # of `FIGURE_PICTURES`
BIRD_POSES = _pointers(0x3C00, 9)  # of the bird at height 0 in scenes 1, 3, 5 and 7
COYOTE_POSES = _pointers(0x3EEA, 11)


class Drawn(NamedTuple):
    """The state changed by the step, as it was when the frame was drawn."""

    x: jax.Array  # of the bird and the coyote
    scrolled: jax.Array  # columns that the road has moved on, 0 or 1
    lost: jax.Array  # a life has been lost: the RAM has the new start
    narrow: jax.Array  # rows that a narrow road begins earlier, 0 or 1
    lower: jax.Array  # rows that the road is lower below a bridge


def open_road(m: Ram) -> jax.Array:
    return (m.scene & 1) == 0


def has_cannon(m: Ram) -> jax.Array:
    return (m.scene & 3) == 3


def as_drawn(m: Ram) -> Drawn:
    bird_x, scrolled = _player_x(m)
    x = jnp.where(open_road(m) | has_cannon(m), bird_x, m.drawn_x)
    kept = (m.scenery == Scenery.ROAD) | has_cannon(m)
    coyote_x = jnp.where(kept, m.drawn_x, _coyote_x_before(m, scrolled))
    return Drawn(
        x=jnp.stack([x, coyote_x]),
        scrolled=scrolled,
        lost=_lost(m),
        narrow=when(m.scenery == Scenery.NARROW, 1),
        lower=when(below_bridge(m), 16),
    )


def below_bridge(m: Ram) -> jax.Array:
    return ((m.scenery & 15) == Scenery.BRIDGE) & (m.entry >= 0)


def _lost(m: Ram) -> jax.Array:
    """True if a life has been lost: both are at their start, but were drawn elsewhere."""
    start = jnp.where(has_cannon(m), COYOTE_START_X, START_X)
    elsewhere = (m.waits == 0) & (m.drawn_x != start)
    at_start = (m.x == START_X) & (m.coyote_x == COYOTE_START_X)
    return jnp.where(open_road(m), m.drawn_x > GONE, elsewhere) & at_start


def _player_x(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The bird's column before it moved, and 1 if the road has moved on since, otherwise 0."""
    fourth = (m.clock & 3) == 0
    free = (m.caught == Caught.FREE) & (m.runs > 0) & (m.falls == 0)
    onward = free & (m.direction > 0)
    backward = free & (m.direction < 0)
    near = (m.x < NEAR_X - 1) | ((m.x == NEAR_X - 1) & ~fourth)
    pushed = (m.caught == Caught.PUSHED) & (m.truck > 0) & (m.x == m.truck_x + 8)
    dragged = (m.caught < Caught.FREE) & (m.stunned == 0)
    step = match(
        (pushed | dragged, 1),
        (onward & near, when(fourth, jnp.sign(STILL - m.x))),
        (onward, -1),
        (backward & (m.x != BACK_LIMIT), 1),
        otherwise=0,
    )
    return m.x - step, when(onward & near, 1)


def _coyote_x_before(m: Ram, scrolled: jax.Array) -> jax.Array:
    """The coyote's column before he moved towards the bird's recent position, or fell back."""
    ahead = jnp.sign(m.coyote_x - m.aim[0])
    stands = m.runs == 0  # the bird
    falls_back = ~stands & ((m.clock & 3) == 0)
    step = match((stands, ahead), (falls_back, -1), otherwise=0)
    return match(
        (open_road(m), m.coyote_x + step),
        (m.stunned > 0, m.coyote_x - scrolled),
        (m.caught < Caught.FREE, m.drawn_x - 5),
        otherwise=m.coyote_x + _chase(m, ahead, falls_back),
    )


def _chase(m: Ram, ahead: jax.Array, falls_back: jax.Array) -> jax.Array:
    """The coyote's step in the scenes with a cliff."""
    level = m.coyote_y == m.aim[1]
    other = (m.clock & 1) == 0
    slow = (m.pace > Pace.FAST) & ((m.clock & 7) == 0)
    every = level & ((m.runs == 0) | ((m.pace == Pace.FAST) & (m.x >= FAST_X)))
    steps = jnp.where(level & (m.pace != Pace.FAST), slow, other) | every
    return match(
        ((m.waits >= 0) | (m.falls > 0) | (m.caught > Caught.FREE), 0),
        (level & (m.pace == Pace.LAGS) & falls_back, -1),
        (steps, ahead),
        otherwise=0,
    )


def figure_boxes(m: Ram, d: Drawn) -> Box:
    """The bird and the coyote; some lines of the screen repeat the row above them."""
    looks, fallen = _drawn_looks(m)
    left, top, width, height = FIGURE_PICTURES.extent(looks, mirrored=m.mirrored)
    bird = np.array((1, 0))
    coyote = np.array((0, 1))
    zoom = jnp.where(has_cannon(m) & (m.rocket > 0) & (coyote == 1), 2, 1)
    y = pick(m.scene, FIRST_LINES) + top + jnp.where(open_road(m), coyote, fallen * bird)
    # The road's first row repeats the bird's last one.
    late = has_cannon(m) & (y + height == EDGE) & (d.x < 70) & (bird == 1)
    upper = _line(m, d, y)
    bottom = _line(m, d, y + height) + when(late, 1)
    whole = box(d.x + zoom * (left + 1) - 1, upper, zoom * width, bottom - upper)
    figures = replace(whole.where(_seen(m, d)), color=_body_colors(m))
    return figures.clip(*VIEW[:3], jnp.where(m.scene == Scene.CLIFF, 157, VIEW[3]))


def _line(m: Ram, d: Drawn, y: jax.Array) -> jax.Array:
    """The line of the screen for a row of the bird and a row of the coyote."""
    who = np.arange(2)
    more = reached(y, (139, 149)) + when(y >= 151 - who, 1) + who
    repeated = when(y >= pick(m.scene, REPEATED_LINES), 1)
    return y + repeated + when(has_cannon(m), more) + d.lower - d.narrow


def _seen(m: Ram, d: Drawn) -> jax.Array:
    """True for the figures that are on the screen."""
    x, coyote_x = d.x
    lone = (m.scene != Scene.CLIFF) | (m.two_cracks == 0)
    bird = (x < GONE) & ~d.lost
    coyote = among(coyote_x, range(8, GONE)) & ~d.lost & lone
    return jnp.stack([bird, coyote]) | (open_road(m) & (d.x <= GONE))


def _body_colors(m: Ram) -> jax.Array:
    hit = jnp.stack([m.struck > 0, m.stunned > 0])
    gray = jnp.where(open_road(m), BURNT_GRAYS[1], BURNT_GRAYS[0])
    return jnp.where(hit & (m.pose == Pose.BURNT), gray, np.array(BODIES))


def _drawn_looks(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Drawn pictures of both, as indices of `FIGURE_PICTURES`, and rows that a bird falls."""
    runs = (m.waits < 0) & (m.stunned + m.rocket + m.falls == 0) & (m.caught <= Caught.FREE)
    bird_pose, coyote = _drawn_poses(m, runs)
    y = m.y + _bird_rows(m)
    fallen = jnp.maximum(y - FALL_START, 0)
    bird = jnp.where(y < OUT_OF_SIGHT, bird_pose + y - fallen, NOTHING)
    climb = when(runs & (m.caught == Caught.FREE), jnp.sign(m.coyote_y - m.aim[1]))
    looks = jnp.stack([bird, coyote + m.coyote_y + climb])
    drawn = (m.pointers & 0xFFF) + jnp.where((m.pointers >> 12) == 9, 0, 4096)
    return jnp.where(open_road(m), drawn, looks), fallen


def _bird_moved(m: Ram) -> jax.Array:
    return (m.stick < Stick.NONE) & ((m.stick > Stick.STILL) | among(m.pose[0], Pose.RUNS))


def _drawn_poses(m: Ram, runs: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The pictures at height 0 of the bird and of the coyote, running or not."""
    bird = _bird_moved(m) & ((m.clock & 1) == 0)
    coyote = runs & ((m.clock & 3) == 0)
    changes = among(m.pose, Pose.RUNS) & jnp.stack([bird, coyote])
    pose = jnp.where(changes, sum(Pose.RUNS) - m.pose, m.pose)
    rides = Pose.RIDES + (m.clock & 1)
    return (
        pick(jnp.where(m.jump == FIRST_JUMP, Pose.LEAPS, pose[0]), BIRD_POSES),
        pick(jnp.where(m.rocket > 0, rides, pose[1]), COYOTE_POSES),
    )


def _bird_rows(m: Ram) -> jax.Array:
    """Rows that the step has lifted the bird."""
    moved = _bird_moved(m)
    lowest = match((m.scenery == Scenery.CLIFFS, 20), (m.y > 6, FALL_START), otherwise=6)
    return match(
        (m.falls > 0, when((m.y < 52) | (m.clock == 0), -3)),
        (moved & among(m.stick, Stick.UP) & ~among(m.y, HIGHEST), 1),
        (moved & among(m.stick, Stick.DOWN) & (m.y != lowest), -1),
        otherwise=0,
    )
