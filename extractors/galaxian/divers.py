"""Galaxian's divers as they were drawn: before their last step."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Pictures, among, lookup, match, when
from ocjax.extractors.galaxian.ram import BANK, ROM, Hit, Kind, Place, Ram, State, Turn

ROW_LINES = 12  # of the formation
DIVER_RISE = 9  # lines from the first line of a diver's picture down to its `y`
RECORDS = np.arange(5)
ESCORT_BITS = np.array((4, 2, 1))
PICTURE_ROWS = 10
PICTURE_PAGE = BANK + 0xE00
PLACES = (0x50, 0x66, 0x7C, 0x92, 0xA8, 0xBE, 0xD4, 0xEA)  # of the divers' pictures in the page
DIVER_ROWS = ROM.rows([PICTURE_PAGE + at for at in PLACES], PICTURE_ROWS, top_first=True)
LINE = np.arange(PICTURE_ROWS)
# The pictures' lines within the field, by number of lines below its bottom (-: above its top).
DIVER_PICTURES = Pictures.of(
    (
        np.where((cut + LINE >= 0) & (cut + LINE < PICTURE_ROWS), rows, 0)
        for rows in DIVER_ROWS
        for cut in range(-PICTURE_ROWS, PICTURE_ROWS + 1)
    ),
    picture=len(PLACES),
    cut=2 * PICTURE_ROWS + 1,
)


def _picture_numbers() -> np.ndarray:
    """Numbers of pictures: by state, then for returning divers by remaining lines / 4."""
    start = ROM.bytes(0xEBA, 8)
    dive = ROM.bytes(0xEB2, 8)
    back = ROM.bytes(0xEC6, 5)
    state = np.arange(128)
    turn = np.minimum((state & 63) >> 2, 7)
    low = start[np.where(state & 64, turn, 7 - turn)]
    return np.searchsorted(PLACES, np.concatenate([low, dive.repeat(16), back])).astype(np.int32)


NUMBERS_BY_STATE = _picture_numbers()
RETURNING = 256  # number of the first picture of a returning diver
UPRIGHT = 4  # the last picture


def _steps() -> np.ndarray:
    """The step of each plan: 2 * (columns to the right + 16), + 1 if it goes up.

    The first four plans are dives, flat to wide; the last plan is the loop before a dive.
    """
    paths = ROM.bytes(0xECB, 64)
    turns = ROM.bytes(0xF0B, 64)
    stored = ROM.bytes(0xF4B, 16)
    amounts = (stored ^ 128) - 128
    weave = paths & 3
    columns = np.stack(
        [
            amounts[np.where(weave == 3, 7, weave)],
            amounts[paths >> 2 & 7],
            amounts[paths >> 5],
            amounts[turns >> 4],
            -np.roll(amounts[turns & 15], 1),
        ]
    )
    loop_up = np.roll(ROM.bytes(0xF2B, 64) >> 2 & 1, 1)
    up = np.pad(loop_up[None], ((4, 0), (0, 0)))
    return (2 * (columns + 16) + up).ravel().astype(np.int32)


MOVES = _steps()


class Plan:  # of `MOVES`
    FLAT = 0
    STEEP = 1
    WIDE = 2
    LOOP = 4


@dataclass(frozen=True)
class Divers:
    """The divers when the frame was drawn."""

    x: jax.Array
    y: jax.Array  # line of the field
    picture: jax.Array
    there: jax.Array
    launched: jax.Array  # after this frame
    escorting: jax.Array  # the shared record of a flagship's escorts
    escorts: jax.Array  # a bit each


def divers_as_drawn(m: Ram) -> Divers:
    moved = ((m.turn & 1) == 0) | (m.turn == Turn.DIVERS)
    escorting = m.escort_record == RECORDS
    launched = moved & ((m.state & ~State.MIRRORED) == 0) & ~m.explodes & (m.y > Place.NONE)
    returns = ~m.dives & (m.state >= State.DIVES)
    bursts = m.explodes & ~escorting
    hit_now = _struck(m, escorting, moved)
    still = ~moved | bursts
    columns, lines = _moved_by(m, returns)
    y = ROW_LINES * (m.y >> 4) + (m.y & 15) - DIVER_RISE - when(~still, lines)
    back = (m.state - 1 & State.DIVES - 1) | (m.state & State.DIVES)
    state = jnp.where(still | returns, m.state, back)
    arrives = returns & moved & (m.y == 1)
    seen = (m.y > Place.NONE) & (m.y < Place.GONE) & ~launched & ~arrives & (~bursts | hit_now)
    return Divers(
        x=m.x - when(~still, columns),
        y=y,
        picture=lookup(NUMBERS_BY_STATE, jnp.where(returns, _of_return(m, y), state)),
        there=seen,
        launched=launched,
        escorting=escorting,
        escorts=m.escorts | when(jnp.any(hit_now & escorting), ESCORT_BITS[0] >> m.escort_hit),
    )


def _struck(m: Ram, escorting: jax.Array, moved: jax.Array) -> jax.Array:
    """True for divers, or groups of escorts, that were hit after this frame."""
    since = jnp.where(escorting, m.escort_time, m.state)
    return (m.hit == Hit.DIVER) & m.explodes & (since == when(moved, 1))


def _moved_by(m: Ram, returns: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Columns and lines that each diver moves in a step."""
    loops = m.state < State.DIVES
    dive = match(
        (among(m.kind, (Kind.FLAGSHIP, Kind.ESCORT)), Plan.STEEP),
        (m.kind == Kind.PURPLE, Plan.WIDE),
        otherwise=Plan.FLAT,
    )
    plan = jnp.where(loops, Plan.LOOP, dive + m.fast)  # if `fast`, the next plan
    step = lookup(MOVES, 64 * plan + (m.state & 63))
    columns = ((step >> 1) - 16) * jnp.where((m.state & State.MIRRORED) > 0, -1, 1)
    with_formation = when((m.clock & 15) == 0, jnp.where(m.goes_left, -1, 1))
    return jnp.where(returns, with_formation, columns), jnp.where(loops & ((step & 1) == 1), -1, 1)


def _of_return(m: Ram, y: jax.Array) -> jax.Array:
    """Index of the picture of a returning diver: it turns over on its last lines."""
    left = (m.state & 63) - y
    return RETURNING + jnp.where(among(left, range(4 * UPRIGHT)), left >> 2, UPRIGHT)
