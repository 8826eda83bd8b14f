"""Up'n Down's records on the frame of a lost life, from what the display program leaves behind.

The RAM holds the new start already (f224) while the screen shows the old one, but what was made for
drawing it is still there (f7f8-f8e2, and bank 0): of the four sprites from the top, one of which is
the player's, hidden, in a known row, the pictures and the rows from one to the next. The display
program loses one of these rows where it begins a piece of the road, which depends on the sprites'
phase, their row in such a piece, so all phases are tried. The records' columns are still there,
too: they say which of them is in which row, because all have to be on the road.

Where nothing fits, nothing is told, and neither is the record of a sprite that is not drawn because
another one is near. Where several tries fit, the rows may be off by one or two, or two records in
the same column may be exchanged.
"""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.ops import among, lookup, match, only, when
from ocjax.console.ram import RamMap, byte
from ocjax.console.rom import Rom

ROM = Rom("up_n_down", "a499d720e7ee35c62424de882a3351b6")
BANK = 0x1000  # of the tables
GROUND = 88  # row of the player on the road


class Kind:  # of `Ram.kind` and `Ram.kinds`; cars are below `FLAG`
    FLAG = 8  # the first of eight
    PLAYER = 16
    HIDDEN = 23
    COLLECTABLE = 24  # the first of eight
    GONE = 32  # bit of a flag


KINDS = {  # by low byte of the pictures' addresses
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
COLLECTABLES = (24, 25)  # two more are on the pictures' next page but one

MAPS = 3  # each of the two roads of some rounds
ROAD_ROWS = 1024
PLACES = 1024  # of the pieces, by their hash
HASH = np.array((125, 153, 27))  # of a piece's bytes: few pieces share one
PIECES_SHOWN = 42  # pieces of the road on the screen
ROUND_MAPS = ((ROM.bytes(BANK + 0xBE3, 10) & 15) - 12).tolist()  # the map, by round from 1 on
MIDDLE = 72  # in `COLUMNS`, which are counted from it, but at least as `CROSSING`
CROSSING = 1
SAME_WAY = 128  # added to those counted from the left, where both roads lead the same way
ROADS_APART = 80  # columns from one such road to the other

FULL = (16, 17)  # rows left between a sprite that loses its last rows and the next one
LOST_ROWS = range(18)  # rows that it loses
FAR = 512  # rows, more than any
PHASE_NUMBERS = np.arange(4)  # of the first sprite
TRIES = np.arange(8).reshape(2, 4)  # by the piece's place and the phase
RECORD_BITS = 1 << np.arange(9).reshape(3, 3, 1, 1)  # by row and record
NONE = 512 * 8  # instead of a try
IMPOSSIBLE = 4  # instead of a fine scroll
ORDERS = tuple(itertools.permutations(range(3)))  # the records from the top
RANKS = np.argsort(ORDERS, axis=1).ravel()  # of the records
WANTED = [sum(1 << 3 * row + record for row, record in enumerate(order)) for order in ORDERS]
ORDER = [next((i for i, w in enumerate(WANTED) if bits & w == w), 6) for bits in range(512)]


def _road_columns() -> np.ndarray:
    """Where the roads are, by their rows."""
    row = np.arange(ROAD_ROWS)
    road = ROM.bytes(BANK + 0xC00, MAPS * 256).astype(int).reshape(MAPS, 256)
    here, there = (road[:, (2 * (row >> 3) + i) & 255] for i in (0, 2))
    bend = ((there & 0x3E) - (here & 0x3E)) * (row & 7) >> 3
    left = (here & 0x3E) + 16 + bend + (bend < 0)
    double = (here >= 0x80) & (left < MIDDLE)
    return np.where(double, left + SAME_WAY, np.maximum(MIDDLE - left, CROSSING)).ravel()


def _hashed_pieces() -> np.ndarray:
    """The first and the last place on the roads of the pieces that have a hash."""
    out = np.zeros((2, MAPS, PLACES), int)
    for road in range(MAPS):
        pages = ROM.bytes(0x500 + MAPS * 256 * road, MAPS * 256).astype(int).reshape(3, 256)
        at = HASH @ pages[[1, 2, 0]] % PLACES
        for place in range(256):
            out[0, road, at[255 - place]] = 255 - place
            out[1, road, at[place]] = place
    return out.ravel()


COLUMNS = _road_columns()
PIECES = _hashed_pieces()
PICTURES = np.maximum.accumulate([i if i in KINDS else 0 for i in range(256)])
LOOKS = [KINDS[i] for i in PICTURES.tolist()]


class DrawnRam(RamMap):
    """What remains, and what it takes to understand it."""

    level = byte(3)  # the round, from 1 on
    counter = byte(16)
    x = byte(41, 42, 43)
    ends = byte(76)  # half of the rows that are above the first sprite or below the last one
    gaps = byte(77, 78, 79)  # rows from a sprite to the next one, less those that were lost
    pictures = byte(88, 90, 92, 94)  # addresses; higher by the rows that a picture loses
    pages = byte(89, 91, 93, 95)  # of the pictures
    piece = byte(123, 124, 125)  # of the road, the last one drawn


def column(m: DrawnRam, row: jax.Array) -> jax.Array:
    """The entries of `COLUMNS` for rows of the road."""
    return lookup(COLUMNS, ROAD_ROWS * lookup(ROUND_MAPS, m.level) + (row & (ROAD_ROWS - 1)))


def drawn_records(m: DrawnRam) -> tuple[jax.Array, jax.Array, jax.Array]:
    """The records' kinds, which may be hidden, and rows, and the road's fine scroll."""
    picture, look = lookup(PICTURES, m.pictures), lookup(LOOKS, m.pictures)
    usual = look + when(among(look, COLLECTABLES), m.pages & 2)
    cut = jnp.where((picture > 0) & (np.arange(4) < 3), m.pictures - picture, 0)
    player, rows, fine = _sprite_rows(m, picture == 0, cut)
    below = np.arange(3) >= player
    kind = jnp.where(below, usual[1:], usual[:-1])
    rows = jnp.where(below[:, None], rows[1:], rows[:-1])
    best = _best_try(m, kind, rows, fine)
    one = ((best >> 9) & 3) == PHASE_NUMBERS
    y = only(one[None], rows, axis=1)
    rank = lookup(RANKS, 3 * lookup(ORDER, best & 511) + np.arange(3))
    y, kind = (match((rank == 0, v[0]), (rank == 1, v[1]), otherwise=v[2]) for v in (y, kind))
    return jnp.where(best < NONE, kind, Kind.HIDDEN), y, only(one, fine)


def _sprite_rows(
    m: DrawnRam, hidden: jax.Array, cut: jax.Array
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Which sprite is the player; by phase, the sprites' rows, and the fine scroll or IMPOSSIBLE.

    His picture's address does not say how many rows it would have lost, because it is not drawn.
    His row against those of the others does. If he is the first one, two numbers fit `ends`, which
    is halved: the tries whose phase the gap of `FULL` rows below rules out take the `odd` one.
    """
    apart = m.gaps + 2 + cut[1:] - cut[:-1]
    ends = 160 - 2 * m.ends - jnp.sum(apart)  # twice the first row, plus the rows lost to the road
    player = _player_sprite(hidden, apart, ends)
    is_player = player == np.arange(4)
    is_full = jnp.any(is_player[:3] & ~hidden[1:] & among(m.gaps, FULL))
    loses = is_full & (((m.counter - 1 + player) & 1) == 0)
    first = is_player[0] & loses
    odd = first & (_late(PHASE_NUMBERS) != FULL[1] - m.gaps[0])
    start = jnp.where(odd, PHASE_NUMBERS ^ 1, PHASE_NUMBERS)
    phases = [start]
    for i in range(3):
        phases.append(phases[i] + apart[i] + _late(phases[i] - cut[i]))
    ends = ends + jnp.sum(apart) - (phases[3] - start)
    top = jnp.where(is_player[0], GROUND, (ends & 255) >> 1)
    top = jnp.where(first, (ends & 255) - GROUND - jnp.where(odd, 1, 0), top)
    rows = jnp.stack(phases) + (top - start)[None]
    lost = GROUND - only(is_player[:, None], rows, axis=0)
    ends = 160 - sum(jnp.where(is_player[i], GROUND, rows[i]) for i in (0, 3))
    possible = ((ends & 255) >> 1 == m.ends) & ((lost == 0) | (loses & among(lost, LOST_ROWS)))
    return player, rows, jnp.where(possible, (start - top) & 3, IMPOSSIBLE)


def _player_sprite(hidden: jax.Array, apart: jax.Array, ends: jax.Array) -> jax.Array:
    """Which sprite is the player: of those that are hidden, the one that is about where he is."""
    below = jnp.sum(jnp.where(np.tri(4, 3, -1, dtype=bool), apart[None], 0), axis=1)
    away = jnp.abs(below + ((ends & 255) >> 1) - GROUND)
    return jnp.min(jnp.where(hidden, 4 * away, 4 * FAR) + np.arange(4)) & 3


def _late(phase: jax.Array | np.ndarray) -> jax.Array:
    """Rows that are lost where the road's next piece begins."""
    return when(((phase + 1) & 2) == 0, 1)


def _best_try(m: DrawnRam, kind: jax.Array, rows: jax.Array, fine: jax.Array) -> jax.Array:
    """The first try in which all records are on the road, and `RECORD_BITS` of who can be where."""
    at = PLACES * lookup(ROUND_MAPS, m.level) + (jnp.sum(m.piece * HASH) & (PLACES - 1))
    coarse = lookup(PIECES, at + MAPS * PLACES * np.arange(2)) - PIECES_SHOWN
    way = (rows + fine[None])[:, None, :] + 4 * coarse[None, :, None]
    there = column(m, way)[:, None]
    side = jnp.minimum(jnp.abs(m.x - MIDDLE), MIDDLE)
    double = jnp.where(m.x >= MIDDLE + 4, m.x - ROADS_APART, m.x) + SAME_WAY
    fits = (there == side[None, :, None, None]) | (there == double[None, :, None, None])
    fits = fits | (kind == Kind.HIDDEN)[:, None, None, None]
    bits = jnp.sum(jnp.where(fits, RECORD_BITS, 0), axis=(0, 1))
    good = (lookup(ORDER, bits) < len(ORDERS)) & (fine < IMPOSSIBLE)[None]
    return jnp.min(jnp.where(good, 512 * TRIES + bits, NONE))
