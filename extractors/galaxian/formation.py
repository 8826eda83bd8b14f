"""Galaxian's formation as it was drawn."""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Box, among, box, div, lookup, when
from ocjax.extractors.galaxian.divers import ROW_LINES, Divers
from ocjax.extractors.galaxian.ram import ROM, NewFormation, Ram, Turn

ROW_COLORS = np.array((14, 68, 86, 10, 10, 10))  # of the ships' upper parts
LOWER_COLORS = np.array((14, 56, 136, 214, 214, 214))  # of their lower parts
YELLOW = 252  # of the line between them
RANKS = np.arange(6)
SHIP_ROW = np.arange(42) // 7  # by slot
SHIP_COLUMN = np.arange(42) % 7  # by slot
SHIP_COLORS = tuple((int(ROW_COLORS[row]), int(LOWER_COLORS[row]), YELLOW) for row in SHIP_ROW)
COLUMN_BIT = 6 - SHIP_COLUMN
LEFTMOST = 64  # the bit of the first column
FORMATION_TOP = 19
FORMATION_LEFT = 19
APART = 33  # half columns from one ship to the next
APART_OFFSET = 32  # `Ram.offset` of a formation that begins with its second column
LEFT_OUT_LATER = 3  # the program drops a column this many offsets later ($FDE6)
SHIP_WIDTH = 6
SHIP_LINES = 9
FLAP_TURN = np.array((5, 0, 3, 1, 4, 2))[SHIP_ROW]  # the rows move their wings successively
FLAP = 15  # bits of the offset
FLAP_START = 3  # the first of 16 offsets at which the first row to move is a line shorter
FLAPS = 4  # number of these offsets
LIMITS = ROM.bytes(0xF71, 8)  # of the offset, by empty columns at the right
SWEEP_LEFT = 11  # `Ram.blast_x` of the first column


def _offset_drawn(m: Ram) -> jax.Array:
    """The formation's offset before its step; at either end, it only turns round."""
    right = ~m.goes_left
    turned = jnp.where(right, m.offset == 0, m.offset == lookup(LIMITS, m.empty))
    moved = (m.turn == Turn.FORMATION) & ~turned
    return m.offset - when(moved, jnp.where(m.goes_left, -1, 1))


def _columns_left_out(offset: jax.Array) -> jax.Array:
    """Number of empty columns at the left that the program skips."""
    return div(jnp.maximum(offset - LEFT_OUT_LATER, 0), APART_OFFSET)


def _rows_drawn(m: Ram, divers: Divers, offset: jax.Array) -> jax.Array:
    """The ships of each row, a bit per column."""
    bit = jnp.where(divers.escorting, m.escorts << 5, LEFTMOST) >> m.column
    left = (m.kind[None] == RANKS[:, None]) & divers.launched[None]
    launched = jnp.sum(jnp.where(left, bit[None], 0), axis=1)
    column = jnp.clip((m.blast_x - SWEEP_LEFT - (offset >> 1)) * 2 // APART, 0, 7)
    shot = when((m.blast < 64) & (m.hit_row == RANKS), LEFTMOST >> column)
    as_before = _in_order(m.masks) << _columns_left_out(offset) & 127
    rows = jnp.where(m.turn == Turn.FORMATION, m.rows | shot, as_before) | launched
    new = (m.set_up == m.clock) & among(m.offset, NewFormation.OFFSETS) & (m.missile_y > 0)
    return when((m.lowest >= RANKS) & ~new, rows)


def _in_order(mask: jax.Array) -> jax.Array:
    """The bits of a mask in the columns' order (from the left: bits 2, 3, 0, 1, 5, 6, 4)."""
    first = (mask & 4) << 4 | (mask & 8) << 2 | (mask & 1) << 4 | (mask & 2) << 2
    return first | (mask & 32) >> 3 | (mask & 64) >> 5 | (mask & 16) >> 4


def formation_boxes(m: Ram, divers: Divers) -> Box:
    offset = _offset_drawn(m)
    left_out = _columns_left_out(offset)
    inside = offset - APART_OFFSET * left_out >> 1
    x = FORMATION_LEFT + (APART * (SHIP_COLUMN + left_out) + 1 >> 1) + inside
    short = when((offset + 2 * FLAP_TURN - FLAP_START & FLAP) < FLAPS, 1)
    y = FORMATION_TOP + ROW_LINES * SHIP_ROW + short
    rows = _rows_drawn(m, divers, offset)
    there = jnp.repeat(rows, 7) >> COLUMN_BIT & 1 == 1
    return box(x, y, SHIP_WIDTH, SHIP_LINES - short, there, color=ROW_COLORS[SHIP_ROW])
