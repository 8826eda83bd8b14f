"""Aliens and humans of Defender's world, on the screen and on the scanner."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Box, among, box, edges, extremes, match, only, pick, when
from ocjax.extractors.defender.drawn import (
    OFFSETS,
    ON_SCREEN,
    Drawn,
    alien_kinds,
    alive,
    own_shot,
    present,
    sprite_color,
    visible,
)
from ocjax.extractors.defender.ram import Capture, Kind, Planet, Ram, Turn

CITY_TOP = 156
CITY_BOTTOM = 173
CITY_ROWS = 16  # of the display program in the city
LAST_ROW = 171  # screen row of the display program's row 0; its rows count down

HIGHEST_SHIP = 133  # greatest `y` of the ship; above, it is drawn at the top
HIGHEST_ALIEN = 128
SHIP_ROWS = 16  # of the display program that draw the ship; most are empty
SHOT_ROWS = 10  # the same for its shot
FLAME_ROWS = 11  # the same for the flame of its engine
# Columns where a missile ends in a row: above, in and below the ship's rows, in the city.
ABOVE_SHIP = -9
BESIDE_SHIP = 43
BELOW_SHIP = 22
IN_CITY = 58
ON_LATER = 3  # it begins this many columns later

LEFT_PLACE = 88  # position in the world of the screen's first column
ALIENS_END = 165  # first position of an alien right of the screen
HELD_RIGHT = 5  # columns from the ship to the human that it carries, facing right
HELD_LEFT = 1
GROUND = 128  # `captive_y` of a human above the ground is below this

COLORS = (136, 142, 254, 28, 26, 54)  # of aliens, by kind
FRAME_COLORS = (254, 28, 26, 54)  # of the scanner and of all dots except the aliens', by wave
SCANNER = (48, 14, 112, 35)
MARK = (72, 87)  # columns of the scanner's upper mark, which hides the first row of a dot


def ship_row(m: Ram) -> jax.Array:
    """The display program's row above the ship."""
    return jnp.minimum(m.y, HIGHEST_SHIP)


class _Rows(NamedTuple):
    """Parts of the display program, as rows that count down."""

    above: jax.Array  # last row above the ship's
    below: jax.Array  # first row below them
    city: jax.Array


def _program_rows(m: Ram, d: Drawn) -> _Rows:
    flame = (d.frame & 7) == 0
    above = ship_row(m)
    count = match((own_shot(m, d)[1], SHOT_ROWS), (flame, FLAME_ROWS), otherwise=SHIP_ROWS)
    return _Rows(above, above - count - 1, jnp.where(m.lost == Planet.GONE, -1, CITY_ROWS - 1))


def missile_rows(
    m: Ram, d: Drawn, x: jax.Array, last: jax.Array, count: int
) -> tuple[jax.Array, jax.Array]:
    """First row of a missile on the screen, and the row below its last one.

    The chip shows a change only right of the beam's column. Left of it, a row repeats the row
    above.
    """
    rows = _program_rows(m, d)
    row = last + np.arange(-1, count + 1)
    on = _is_on(rows, row, last, count)
    on_above = _is_on(rows, row + 1, last, count)
    begins = when(on, ON_LATER) + match(
        (row <= rows.city, IN_CITY),
        (row >= rows.above, ABOVE_SHIP),
        (row > rows.below, BESIDE_SHIP),
        otherwise=BELOW_SHIP,
    )
    left = jnp.where(x >= begins, on, on_above)
    right = jnp.where(x + 1 >= begins, on, on_above)
    top, bottom = extremes((left | right) & (row >= 0), LAST_ROW - row, LAST_ROW - row)
    return top, bottom + 1


def _is_on(rows: _Rows, row: jax.Array, last: jax.Array, count: int) -> jax.Array:
    """True if a missile is on; in the ship's rows and half of the city's, it is a row late."""
    beside = (row < rows.above) & (row > rows.below)
    late = match((row <= rows.city, 1 - (row >> 1 & 1)), (beside, 1), otherwise=0)
    part = row - last - late
    return (part >= 0) & (part < count)


def _alien_places(m: Ram, d: Drawn) -> jax.Array:
    """Positions of the aliens. Additions of bytes pass their carry on; a missing group adds 1."""
    group = match(
        (m.kind == Kind.BOMBER, 1),
        (among(m.kind, (Kind.POD, Kind.LANDER)), d.wander),
        (m.kind == Kind.MUTANT, m.group_x[1]),
        otherwise=m.group_x[0],
    )
    return _sum(group, d.scroll)


def _alien_heights(m: Ram) -> jax.Array:
    """`drawn_y` of the aliens."""
    group = match(
        (m.kind == Kind.BOMBER, m.group_y[1]),
        (among(m.kind, (Kind.POD, Kind.LANDER)), 1),
        otherwise=m.group_y[0],
    )
    return (_sum(group, m.height) >> 1) + 24


def _sum(group: jax.Array, all_of_them: jax.Array) -> jax.Array:
    total = group + all_of_them
    return (total & 255) + (total >> 8) + OFFSETS & 255


def aliens(m: Ram, d: Drawn) -> Box:
    """The records on the screen that were drawn on the last two frames."""
    slot = jnp.arange(8)
    drawn = slot == m.drawn
    captor = slot == m.captor
    place = jnp.where(captor, m.capture_x, _alien_places(m, d))
    height = jnp.where(captor, m.capture_y, _alien_heights(m))
    x = jnp.where(drawn, m.drawn_x, 2 * (place - LEFT_PLACE))
    y = jnp.where(drawn, m.drawn_y, jnp.minimum(height, HIGHEST_ALIEN))
    seen = alive(m) & ((place >= ON_SCREEN) & (place < ALIENS_END))
    turns = m.drawn - slot & 7  # frames since its last one
    latest = jnp.min(jnp.where(seen & ~drawn, turns, 8))
    before = seen & (turns == latest) & (m.drawn < 8) & d.lately
    there = d.runs & ((drawn & alive(m)) | before)
    return box(x, LAST_ROW + 1 - y, 8, 7, there)


def of_kind(m: Ram, records: Box, kind: int, width: int, height: int) -> Box:
    """The records of one kind, with its size."""
    there = records.valid & (alien_kinds(m) == kind)
    return box(records.x, records.y, width, height, there)


def landers(m: Ram, records: Box) -> Box:
    """The landers. At the ground, a lander's last visible row extends down through the city."""
    low_rows = 7 - (CITY_TOP - records.y)  # in the city
    inside = when(low_rows > 0, 1)  # columns that the second last row is narrower
    bottom = jnp.where(low_rows >= 0, CITY_BOTTOM, records.y + 7)
    left = records.x + inside
    right = records.x + 8 - inside
    there = records.valid & (alien_kinds(m) == Kind.LANDER)
    return edges(left, records.y, right, bottom, there)


def humans(m: Ram, d: Drawn) -> Box:
    """The humans on the screen that were drawn on the last two frames.

    During a pause, the next human stays.
    """
    number = jnp.arange(5)
    captive = number == m.captive
    carried = captive & (m.capture == Capture.CARRIED)
    held = m.x + jnp.where(d.forward, HELD_RIGHT, HELD_LEFT)
    place = 2 * (d.places - LEFT_PLACE) + 2
    column = match((~d.runs, m.human_x), (carried, held), otherwise=place)
    x = jnp.where(column >= 160, column - 160, column)
    raised = captive & (m.captive_y < GROUND)
    raised_top, bottom = missile_rows(m, d, only(captive, x), m.captive_y, 4)
    top = jnp.where(raised, raised_top, LAST_ROW - 2 + when(x + 1 < IN_CITY + ON_LATER, 1))
    turn = (number == d.human) | (number == d.human_before)
    last = number == jnp.where(m.next_human == Turn.SHIP, 0, m.next_human)
    stays = last & (m.pause > 0) & (m.wave_over == 0) & (m.human_x > 0)
    there = jnp.where(d.runs, visible(m, d) & turn, present(m) & stays)
    return edges(
        x, top, x + 2, jnp.where(raised, bottom, CITY_BOTTOM), there, color=sprite_color(m, d)
    )


def alien_dots(m: Ram, d: Drawn) -> Box:
    """The scanner's dots of aliens on the last two frames."""
    slot = jnp.arange(8)
    captor = (slot == m.captor) & (m.capture != Capture.NONE)
    place = jnp.where(captor, d.capture_x, _alien_places(m, d))
    height = jnp.where(captor, m.capture_y, _alien_heights(m))
    x = (place >> 2) + 47
    y = 32 - 2 * (height >> 4)
    hidden = when((y == SCANNER[1]) & among(x, range(*MARK)), 1)
    there = d.runs & alive(m) & ((d.dot - slot & 7) <= when(d.lately, 1))
    color = pick(m.kind, COLORS)
    return edges(x, y + hidden, x + 2, y + 2, there, color=color).clip(*SCANNER)


def human_dots(m: Ram, d: Drawn) -> Box:
    """The scanner's dots of humans on the last two frames."""
    number = jnp.arange(5)
    captive = (number == m.captive) & among(m.capture, range(1, Capture.COMES))
    row = jnp.where(captive, m.capture_y >> 4, 1)
    now = (number == d.human) & ((d.frame & 15) != 0)
    before = (number == d.human_before) & ((d.frame & 15) != 1)
    there = d.runs & present(m) & (now | before)
    return box((d.places >> 2) + 48, 35 - 2 * row, 1, 2, there, color=frame_color(m))


def ship_dot(m: Ram, d: Drawn) -> Box:
    """The ship's dot, on every sixteenth frame and the frame after it."""
    place = (m.x >> 1) + LEFT_PLACE
    shown = d.runs & ((d.frame & 15) < 2)
    return box((place >> 2) + 47, 35 - 2 * (m.y >> 4), 4, 2, shown, color=frame_color(m))


def frame_color(m: Ram) -> jax.Array:
    """The colour of the scanner's frame."""
    return pick(m.wave & 3, FRAME_COLORS)
