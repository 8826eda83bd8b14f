"""The creatures as drawn. On every second floor they move after the frame ($D9D2)."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import among, div, match, when
from ocjax.extractors.pitfall2.pictures import NEVER, Habits, habits_of
from ocjax.extractors.pitfall2.ram import SLOTS, Dead, Kind, Loads, Ram, Wait, Water

FLOOR_LINES = 45
FIRST_LINE = 36  # first line of the first floor
FIRST_SCROLL = 14  # `scroll` while the first line of the first floor is there
WRAPS = 160  # least column at which a creature restarts at the left edge
RAT_STAYS = 0x94  # column where the rat stays
HARRY_LINES = 29  # from `harry_y` to the line that determines his floor
FROG_LEFT = 68  # column
FROG_TURNS = 0x60  # of the clock: halfway between two leaps, it turns round
LEAP_FRAMES = 64  # of a frog's leap, and of the pause before it leaps back
SINCE_LAST = 2  # frames from a creature's last move to this one
EEL_STRIDE = 8  # from one picture to the next of the same colour
EEL_BRIGHT = 16  # from black pictures to white ones
IN_VIEW = slice(1, 4)  # slots that are certainly in view
SLOT = np.array(SLOTS)


class Drawn(NamedTuple):
    """The creature or treasure of each floor."""

    kind: jax.Array
    x: jax.Array
    y: jax.Array  # first line of its picture
    picture: jax.Array
    mirrored: jax.Array
    bright: jax.Array  # whether it is an eel of the other colour
    valid: jax.Array


def as_drawn(m: Ram) -> Drawn:
    """Undo the creatures' moves since the frame was drawn."""
    kind = jnp.where((m.kind == Kind.BAT) & (m.background == Water.COLOR), Kind.EEL, m.kind)
    habits = habits_of(kind)
    moved = _moves(m) & ((m.clock + SLOT) & 1 == 1)
    ahead = m.top - habits.top
    is_second = jnp.where(kind == Kind.EEL, ahead & EEL_STRIDE, ahead) != 0
    was_second = _had_second_picture(m, habits, kind)
    was_mirrored = (kind == Kind.FROG) & (m.clock - SINCE_LAST - FROG_TURNS & 128 > 0)
    return Drawn(
        kind=kind,
        x=jnp.where(moved, _column_before(m, kind, habits), m.x),
        y=floor_line(m) + _lines_below(m, kind, habits, moved),
        picture=jnp.where(moved, was_second, is_second).astype(jnp.int32),
        mirrored=jnp.where(moved & (kind == Kind.FROG), was_mirrored, m.mirrored),
        bright=ahead & EEL_BRIGHT > 0,
        valid=~(_is_blank(m, moved) | among(m.loads, (Loads.FIRST, Loads.LAST))),
    )


def _lines_below(m: Ram, kind: jax.Array, habits: Habits, moved: jax.Array) -> jax.Array:
    """Lines from a floor's first line down to its creature's picture."""
    lines = (m.start - m.top & 0xFF) >> 1
    before = m.clock - SINCE_LAST
    lifted = _lift(before, habits, kind) - _lift(m.clock, habits, kind)
    return lines + when(moved, lifted)


def _is_blank(m: Ram, moved: jax.Array) -> jax.Array:
    """True for floors that are still empty: a blank one, or all in view if Harry has just come."""
    blank = ~moved & (m.start == 0) & (m.top == 1)
    return blank | (_moves(m) & blank[IN_VIEW].any())


def floor_line(m: Ram) -> jax.Array:
    """The first line of each floor."""
    gone = m.scroll - FIRST_SCROLL + when(m.scroll < FIRST_SCROLL, FLOOR_LINES)
    return FIRST_LINE - gone + FLOOR_LINES * SLOT


def _moves(m: Ram) -> jax.Array:
    """True if the creatures of some floors have moved after the frame."""
    is_bitten = (m.touched & among(m.kind, Kind.DEADLY)).any()
    plays = (m.intro == 0) & (m.waits != Wait.FOR_STICK) & ~is_bitten
    goes_back = (m.dead > Dead.NO) & (m.dead < Dead.BITTEN)
    return goes_back | ((m.dead == Dead.NO) & (m.demo | plays))


def _roams(m: Ram, kind: jax.Array) -> jax.Array:
    """True if a creature moves; a rat rests if Harry is far away, and in its last column."""
    line = m.harry_y + m.scroll + HARRY_LINES
    here = div(line, FLOOR_LINES) - when(m.scroll >= FIRST_SCROLL, 1)
    return (kind != Kind.RAT) | ((here == SLOT) & (m.x < RAT_STAYS))


def _had_second_picture(m: Ram, habits: Habits, kind: jax.Array) -> jax.Array:
    """True if a creature had its second picture before a move."""
    return (m.clock - SINCE_LAST & habits.phases == 0) & _roams(m, kind)


def _column_before(m: Ram, kind: jax.Array, habits: Habits) -> jax.Array:
    """The column before a step."""
    steps = (m.clock & habits.steps == 0) & (habits.steps != NEVER) & _roams(m, kind)
    ahead = jnp.where(m.mirrored, -habits.pace, habits.pace)
    before = jnp.where((m.x == 0) & (ahead > 0), WRAPS, m.x) - ahead
    return match(
        (kind == Kind.FROG, FROG_LEFT + (_leap(m.clock - SINCE_LAST) >> 2)),
        (steps, before),
        otherwise=m.x,
    )


def _leap(clock: jax.Array) -> jax.Array:
    """Quarters of a column that a frog has leaped to the right.

    It leaps for 64 frames, waits for another 64, and then leaps back.
    """
    way = jnp.minimum(clock & 2 * LEAP_FRAMES - 1, LEAP_FRAMES - 1)
    is_to_right = clock & 2 * LEAP_FRAMES > 0
    return jnp.where(is_to_right, way, way ^ LEAP_FRAMES - 1)


def _lift(clock: jax.Array, habits: Habits, kind: jax.Array) -> jax.Array:
    """Lines that a creature's picture is lower."""
    way = (clock >> 1) & 2 * habits.swings - 2
    swung = jnp.where(way >= habits.swings, way ^ 2 * habits.swings - 2, way)
    return jnp.where(kind == Kind.FROG, _jump(clock), swung) >> 1


def _jump(clock: jax.Array) -> jax.Array:
    """Half lines from the top of a frog's leap down to the frog."""
    way = when(clock & LEAP_FRAMES == 0, clock & LEAP_FRAMES - 1)
    half = LEAP_FRAMES // 2
    up = jnp.where(way >= half, way ^ LEAP_FRAMES - 1, way)
    return up ^ half - 1
