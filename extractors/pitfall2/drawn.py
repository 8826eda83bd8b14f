"""The creatures as the frame shows them: those of every second floor move after it ($D9D2)."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.ops import among, div, lookup, match, when
from ocjax.extractors.pitfall2.pictures import NEVER, PACKED_TRAITS
from ocjax.extractors.pitfall2.ram import SLOTS, Kind, Loads, Ram, Wait, Water

FLOOR_LINES = 45
FIRST_LINE = 36  # line of the first floor's beginning
FIRST_SCROLL = 14  # `scroll` while the first floor's beginning is there
WRAPS = 160  # column from which on a creature begins anew at the left edge
RAT_STAYS = 0x94  # column where the rat stays
HARRY_LINES = 29  # from `harry_y` to the line that tells his floor
FROG_LEFT = 68  # column
FROG_TURNS = 0x60  # of the clock
EEL_STRIDE = 8  # from one picture to the next of the same colour
EEL_BRIGHT = 16  # from black pictures to white ones
IN_VIEW = slice(1, 4)  # slots that are in view for sure
SLOT = np.array(SLOTS)


class Drawn(NamedTuple):
    """What lives on each floor."""

    kind: jax.Array
    x: jax.Array
    y: jax.Array  # first line of its picture
    picture: jax.Array
    mirrored: jax.Array
    bright: jax.Array  # whether it is an eel of the other colour
    valid: jax.Array


class Habits(NamedTuple):
    """What a kind does."""

    phases: jax.Array  # of the clock: it has its second picture where 0
    steps: jax.Array  # of the clock: it moves where 0
    pace: jax.Array  # columns a step
    swings: jax.Array  # up and down, over half as many lines
    top: jax.Array  # low byte of where the first picture begins


def as_drawn(m: Ram) -> Drawn:
    """Take back what creatures have done since the frame was drawn."""
    kind = jnp.where((m.kind == Kind.BAT) & (m.background == Water.COLOR), Kind.EEL, m.kind)
    habits = _habits_of(kind)
    moved = _moves(m) & ((m.clock + SLOT) & 1 == 1)
    then = m.clock - 2
    frog = kind == Kind.FROG
    lines = (m.start - m.top & 0xFF) >> 1
    lines_before = lines + _lift(m, then, habits, frog) - _lift(m, m.clock, habits, frog)
    blank = ~moved & (m.start == 0) & (m.top == 1)
    ahead = m.top - habits.top
    changed = jnp.where(kind == Kind.EEL, ahead & EEL_STRIDE, ahead) != 0
    comes = _moves(m) & blank[IN_VIEW].any()  # Harry has just come in: the frame has nobody yet
    return Drawn(
        kind=kind,
        x=jnp.where(moved, _column_before(m, kind, habits), m.x),
        y=floor_line(m) + jnp.where(moved, lines_before, lines),
        picture=jnp.where(moved, _changes(m, then, habits, kind), changed).astype(jnp.int32),
        mirrored=jnp.where(moved & frog, then - FROG_TURNS & 128, m.mirrored) > 0,
        bright=ahead & EEL_BRIGHT > 0,
        valid=~(blank | comes | among(m.loads, (Loads.FIRST, Loads.LAST))),
    )


def floor_line(m: Ram) -> jax.Array:
    """The line where each floor begins."""
    gone = m.scroll - FIRST_SCROLL + when(m.scroll < FIRST_SCROLL, FLOOR_LINES)
    return FIRST_LINE - gone + FLOOR_LINES * SLOT


def _habits_of(kind: jax.Array) -> Habits:
    packed = lookup(PACKED_TRAITS, kind)
    return Habits(
        packed & 0xFF, packed >> 8 & 0xFF, packed >> 16 & 3, packed >> 18 & 63, packed >> 24 & 0xFF
    )


def _moves(m: Ram) -> jax.Array:
    """Whether the creatures of some floors have moved after the frame."""
    bitten = (m.touched == 1) & among(m.kind, Kind.DEADLY)
    plays = (m.intro == 0) & (m.waits != Wait.FOR_STICK) & ~bitten.any()
    return (m.dead < 128) & ((m.dead > 0) | (m.demo == 1) | plays)


def _roams(m: Ram, kind: jax.Array) -> jax.Array:
    """Whether a creature moves: all but a rat that Harry is far from, or that stays at last."""
    line = m.harry_y + m.scroll + HARRY_LINES
    here = div(line, FLOOR_LINES) - when(m.scroll >= FIRST_SCROLL, 1)
    return (kind != Kind.RAT) | ((here == SLOT) & (m.x < RAT_STAYS))


def _changes(m: Ram, then: jax.Array, habits: Habits, kind: jax.Array) -> jax.Array:
    """Whether a creature had its second picture."""
    return (then & habits.phases == 0) & _roams(m, kind)


def _column_before(m: Ram, kind: jax.Array, habits: Habits) -> jax.Array:
    """The column before a step."""
    steps = (m.clock & habits.steps == 0) & (habits.steps != NEVER) & _roams(m, kind)
    ahead = jnp.where(m.mirrored == 1, -habits.pace, habits.pace)
    before = jnp.where((m.x == 0) & (ahead > 0), WRAPS, m.x) - ahead
    return match(
        (kind == Kind.FROG, FROG_LEFT + (_leap(m.clock - 2) >> 2)),
        (steps, before),
        otherwise=m.x,
    )


def _leap(clock: jax.Array) -> jax.Array:
    """How far a frog has leaped to the right, in quarters of a column."""
    way = jnp.minimum(clock & 0x7F, 0x3F)
    return jnp.where(clock & 128 > 0, way, way ^ 0x3F)


def _lift(m: Ram, clock: jax.Array, habits: Habits, frog: jax.Array) -> jax.Array:
    """Lines by which a creature's picture is lower."""
    way = (clock >> 1) & 2 * habits.swings - 2
    swung = jnp.where(way >= habits.swings, way ^ 2 * habits.swings - 2, way)
    jump = jnp.where(clock & 0x40 > 0, 0, clock & 0x3F)
    jump = jnp.where(jump >= 0x20, jump ^ 0x3F, jump) ^ 0x1F
    return jnp.where(frog, jump, swung) >> 1
