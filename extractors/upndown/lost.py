"""Up'n Down's records on the frame of a lost life, from the remains of the display program.

The RAM already holds the new start (f224) while the screen shows the old one, but the data made for
drawing it are still there (f7f8-f8e2, and bank 0).

Sprites: four sprites from the top down are three records and the player. His sprite is hidden, but
its row is known (`GROUND`). The RAM has the picture of each sprite and the rows to the next one.
The display program loses one of these rows when it begins a piece of the road. This depends on a
sprite's phase, its row in such a piece. The RAM does not hold the phases, so this module tries all
four phases of the first sprite; the other sprites' phases follow.

Records: it also tries every assignment of records to sprites. The records' columns are still in the
RAM, and all have to be on the road.

Not exact: if no try fits, nothing is known. A record is also unknown if its sprite is not drawn
because another one is near. If several tries fit, the rows may be off by one or two, or two records
in the same column may be exchanged.
"""

import itertools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import among, lookup, match, mod, only, when
from ocjax.extractors.upndown.ram import GROUND, Kind, Ram
from ocjax.extractors.upndown.road import course_at, is_on_road, piece_places

VIEW_ROWS = 160  # from row 0 to the end of the rows below the last sprite
GAP_ROWS = 2  # that a gap does not count
PIECES_SHOWN = 42  # pieces of the road on the screen
PIECE_ROWS = 4

PICTURE_KINDS = {  # by the first low byte of a picture's address
    0: Kind.HIDDEN,
    16: 0,
    48: 1,
    80: 3,
    112: 2,
    144: Kind.FLAG,
    176: Kind.HIDDEN,
    191: Kind.COLLECTABLE,
    208: Kind.HIDDEN,
    223: Kind.COLLECTABLE + 1,
}
FIRST_BYTES = np.maximum.accumulate([i if i in PICTURE_KINDS else 0 for i in range(256)])
KINDS = [PICTURE_KINDS[i] for i in FIRST_BYTES.tolist()]
TWO_PAGED = (Kind.COLLECTABLE, Kind.COLLECTABLE + 1)  # two more kinds are two pages later
NEXT_PAGE_BUT_ONE = 2  # bit of `Ram.pages`, and its effect on the kind

SPRITE_NUMBERS = np.arange(4)
FULL = (16, 17)  # `gaps` after a sprite that loses its last rows: 16 if the road takes one, too
LOST_ROWS = range(18)  # lost by such a sprite
FAR = 512  # rows, more than any

PHASE_COUNT = 4
TRIED_PHASES = np.arange(PHASE_COUNT)  # of the first sprite
IMPOSSIBLE = 4  # invalid fine scroll; valid ones are 0-3
TRY_NUMBERS = np.arange(2 * PHASE_COUNT).reshape(2, PHASE_COUNT)  # by the piece's position, phase
NO_TRY = 2 * PHASE_COUNT

ORDERS = np.array(list(itertools.permutations(range(3))))  # the records from the top
ORDER_NUMBERS = np.arange(len(ORDERS))
RANKS = np.argsort(ORDERS, axis=1)  # of the records, by order


class Sprites(NamedTuple):
    """The four sprites, from the top."""

    kind: jax.Array  # `[4]`, hidden ones included
    is_hidden: jax.Array  # bool `[4]`
    cut: jax.Array  # rows that their pictures lose at the end, `[4]`
    apart: jax.Array  # rows from one to the next, without rows lost to the road, `[3]`
    twice_first: jax.Array  # twice the first one's row, plus all rows lost to the road, modulo 256
    player: jax.Array  # index of the player's sprite
    is_player: jax.Array  # the same as bool `[4]`
    player_loses: jax.Array  # whether his picture would have lost its last rows


class Tries(NamedTuple):
    """The sprites as drawn, for each phase of the first one."""

    rows: jax.Array  # of the sprites, `[4, tries]`
    fine: jax.Array  # of the road's scroll, or IMPOSSIBLE, `[tries]`


class Best(NamedTuple):
    """The first try in which all records are on the road."""

    is_known: jax.Array  # False if no try fits
    phase: jax.Array  # of the first sprite; the first phase if no try fits
    rank: jax.Array  # of the records from the top, `[3]`; 0 if no try fits


class Records(NamedTuple):
    """The records as drawn."""

    kind: jax.Array  # hidden if unknown
    y: jax.Array
    fine: jax.Array  # rows that the road had come down


def drawn_records(m: Ram) -> Records:
    """The records on the frame of a lost life."""
    sprites = _all_sprites(m)
    tries = _all_tries(m, sprites)
    sprite_kinds = _without_player(sprites, sprites.kind)
    rows = _without_player(sprites, tries.rows)
    best = _best_try(_possible_orders(m, sprite_kinds, rows, tries.fine))
    is_best = best.phase == TRIED_PHASES
    y = only(is_best[None], rows, axis=1)
    return Records(
        kind=jnp.where(best.is_known, _ranked(sprite_kinds, best.rank), Kind.HIDDEN),
        y=_ranked(y, best.rank),
        fine=only(is_best, tries.fine),
    )


def _without_player(sprites: Sprites, values: jax.Array) -> jax.Array:
    """Drop the player's entry from values of all four sprites."""
    is_below = (np.arange(3) >= sprites.player).reshape(3, *[1] * (values.ndim - 1))
    return jnp.where(is_below, values[1:], values[:-1])


def _ranked(values: jax.Array, rank: jax.Array) -> jax.Array:
    """Reorder sprites' values to the records, by each record's rank from the top."""
    return match((rank == 0, values[0]), (rank == 1, values[1]), otherwise=values[2])


def _all_sprites(m: Ram) -> Sprites:
    """The known properties of the sprites."""
    first_byte = lookup(FIRST_BYTES, m.pictures)
    base_kind = lookup(KINDS, m.pictures)
    kind = base_kind + when(among(base_kind, TWO_PAGED), m.pages & NEXT_PAGE_BUT_ONE)
    is_hidden = first_byte == 0
    cut = jnp.where(~is_hidden & (SPRITE_NUMBERS < 3), m.pictures - first_byte, 0)
    apart = m.gaps + GAP_ROWS + cut[1:] - cut[:-1]
    twice_first = VIEW_ROWS - 2 * m.ends - jnp.sum(apart)
    player = _player_sprite(is_hidden, apart, twice_first)
    is_player = player == SPRITE_NUMBERS
    is_followed = jnp.any(is_player[:3] & ~is_hidden[1:] & among(m.gaps, FULL))
    is_his_turn = ((m.counter - 1 + player) & 1) == 0
    loses = is_followed & is_his_turn
    return Sprites(kind, is_hidden, cut, apart, twice_first, player, is_player, loses)


def _player_sprite(is_hidden: jax.Array, apart: jax.Array, twice_first: jax.Array) -> jax.Array:
    """The player's sprite: the hidden sprite nearest to his row."""
    below_first = jnp.sum(jnp.where(np.tri(4, 3, -1, dtype=bool), apart[None], 0), axis=1)
    off = jnp.abs(below_first + _half(twice_first) - GROUND)
    away = jnp.where(is_hidden, off, FAR)
    return _lowest(away == jnp.min(away), SPRITE_NUMBERS, none=len(SPRITE_NUMBERS))


def _lowest(chosen: jax.Array, numbers: np.ndarray, none: int) -> jax.Array:
    """The lowest number of the chosen entries, otherwise `none`, which is higher than all."""
    return jnp.min(jnp.where(chosen, numbers, none))


def _half(twice: jax.Array) -> jax.Array:
    return (twice & 255) >> 1


def _all_tries(m: Ram, sprites: Sprites) -> Tries:
    """The sprites' rows by the phase of the first one, and whether they are possible.

    The player's picture is not drawn, so its address does not show the rows that it would have
    lost. His row, compared with the others' rows, does.
    """
    start = _first_phases(m, sprites)
    phases = _later_phases(sprites, start)
    first_row = _top_row(m, sprites, start, phases)
    rows = phases + (first_row - start)[None]
    fine = (start - first_row) & 3
    return Tries(rows, jnp.where(_is_possible(m, sprites, rows), fine, IMPOSSIBLE))


def _is_odd(m: Ram, sprites: Sprites) -> jax.Array:
    """True for tries where `ends`, a halved number, comes from the odd one of two numbers.

    This happens only if the player is first and would have lost rows. The phase of his sprite then
    has to explain the gap below him.
    """
    fits = _rows_lost(TRIED_PHASES) == FULL[1] - m.gaps[0]
    return sprites.is_player[0] & sprites.player_loses & ~fits


def _first_phases(m: Ram, sprites: Sprites) -> jax.Array:
    """The first sprite's phases, `[tries]`."""
    return jnp.where(_is_odd(m, sprites), TRIED_PHASES ^ 1, TRIED_PHASES)


def _later_phases(sprites: Sprites, start: jax.Array) -> jax.Array:
    """The phases of all four sprites, from the first one's, `[4, tries]`."""
    phases = [start]
    for i in range(3):
        lost = _rows_lost(phases[i] - sprites.cut[i])
        phases.append(phases[i] + sprites.apart[i] + lost)
    return jnp.stack(phases)


def _rows_lost(phase: jax.Array | np.ndarray) -> jax.Array:
    """Rows that are lost at the beginning of the road's next piece."""
    return when(((phase + 1) & 2) == 0, 1)


def _top_row(m: Ram, sprites: Sprites, start: jax.Array, phases: jax.Array) -> jax.Array:
    """The first sprite's row, `[tries]`, from twice its value or from the player's own row."""
    lost_to_road = phases[3] - start - jnp.sum(sprites.apart)
    twice = sprites.twice_first - lost_to_road
    is_first = sprites.is_player[0]
    of_odd = (twice & 255) - GROUND - when(_is_odd(m, sprites), 1)
    return match(
        (is_first & sprites.player_loses, of_odd), (is_first, GROUND), otherwise=_half(twice)
    )


def _is_possible(m: Ram, sprites: Sprites, rows: jax.Array) -> jax.Array:
    """True for tries that agree with `ends` and with the player's row, bool `[tries]`."""
    lost = GROUND - only(sprites.is_player[:, None], rows, axis=0)
    first = jnp.where(sprites.is_player[0], GROUND, rows[0])
    last = jnp.where(sprites.is_player[3], GROUND, rows[3])
    agrees = _half(VIEW_ROWS - first - last) == m.ends
    return agrees & ((lost == 0) | (sprites.player_loses & among(lost, LOST_ROWS)))


def _possible_orders(m: Ram, kind: jax.Array, rows: jax.Array, fine: jax.Array) -> jax.Array:
    """True for orders that put all records on the road: bool `[order, position, phase]`."""
    fits = _pairs(m, kind, rows, fine)
    by_order = [fits[0, top] & fits[1, middle] & fits[2, last] for top, middle, last in ORDERS]
    return jnp.stack(by_order) & (fine < IMPOSSIBLE)[None, None]


def _pairs(m: Ram, kind: jax.Array, rows: jax.Array, fine: jax.Array) -> jax.Array:
    """True for records on the road in a sprite's row: bool `[sprite, record, position, phase]`.

    A hidden sprite fits any record.
    """
    map_rows = PIECE_ROWS * (piece_places(m) - PIECES_SHOWN)  # of row 0, by the piece's position
    way = (rows + fine[None])[:, None, :] + map_rows[None, :, None]  # [sprite, position, phase]
    course = course_at(m, way)[:, None]
    x = m.x[None, :, None, None]
    is_hidden = (kind == Kind.HIDDEN)[:, None, None, None]
    return is_on_road(course, x) | is_hidden


def _best_try(possible: jax.Array) -> Best:
    """The first try with a possible order, and the first of its orders."""
    number = _lowest(jnp.any(possible, axis=0), TRY_NUMBERS, NO_TRY)
    in_best = jnp.any(possible & (number == TRY_NUMBERS)[None], axis=(1, 2))
    order = _lowest(in_best, ORDER_NUMBERS, len(ORDERS))
    return Best(
        is_known=number < NO_TRY,
        phase=mod(number, PHASE_COUNT),
        rank=only((order == ORDER_NUMBERS)[:, None], RANKS, axis=0),
    )
