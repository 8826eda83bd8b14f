"""Things on Zaxxon's ground or above it: pictures and boxes.

Three pictures are far away. Their rows take one line each, and a turn of the drawing loop shows two
rows: it writes the second one in the middle of the first one's line. The other pictures are near,
twice as wide and twice as high.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Box, Pictures, among, box, edges, lookup, only, packed_position, when
from ocjax.extractors.zaxxon.drawn import (
    FAR_TURNS,
    FIRST_COUNT,
    RECORDS,
    TURNS,
    Drawn,
    end_line,
    first_line,
    row_line,
)
from ocjax.extractors.zaxxon.ram import ROM, Kind, Ram

SECOND_BANK = 0x1000
KINDS = 12  # by their high digit
STEPS = 8
FAR_SLOTS = 3
KIND_ROWS = 16
SHOWN_ROWS = 15  # of a far picture; the last one is drawn at the next picture's position
FAR_LATE = 103  # from this column, the first row of each pair is not visible
LATE_COLUMNS = 9  # 0 to 8 columns of a picture are right of it
FAR_X = 11  # minus the position of a register
NEAR_X = 12


def _kind_starts() -> list[int]:
    return [bank + 16 * kind + 1 for bank in (0, SECOND_BANK) for kind in range(KINDS)]


def _colored_rows() -> np.ndarray:
    """The colored rows of all kinds' pictures, int32 `[banks * kinds, rows]`."""
    starts = _kind_starts()
    rows = ROM.rows([0xE00 + s for s in starts], KIND_ROWS, top_first=True)
    colors = ROM.rows([0xD00 + s for s in starts], KIND_ROWS, top_first=True)
    return np.where(colors > 1, rows, 0)


def _late_rows(rows: np.ndarray, late: int) -> np.ndarray:
    """The rows of a far picture; its right columns show only the second row of each pair."""
    right = (1 << late) - 1
    return rows & ~right | np.repeat(rows[1::2], 2) & right


def _shown_far(skipped: int) -> np.ndarray:
    """Visible rows of a far picture if `skipped` turns of it are above the ground."""
    row = np.arange(KIND_ROWS)
    return (row >= 2 * skipped) & (row < SHOWN_ROWS)


KIND_COLORS = np.concatenate([ROM.bytes(0xD00 + s, KIND_ROWS) & 0xFE for s in _kind_starts()])
NEAR_PICTURES = Pictures.of(
    [rows[:shown] for rows in _colored_rows() for shown in range(KIND_ROWS + 1)],
    bank=2,
    kind=KINDS,
    shown=KIND_ROWS + 1,
)
FAR_PICTURES = Pictures.of(
    [
        _late_rows(rows, late) * _shown_far(skipped)
        for rows in _colored_rows()
        for skipped in range(STEPS)
        for late in range(LATE_COLUMNS)
    ],
    bank=2,
    kind=KINDS,
    skipped=STEPS,
    late=LATE_COLUMNS,
)


def by_slot(d: Drawn, values: jax.Array) -> jax.Array:
    """Reorder values of all records by the slots that things keep when they change records."""

    def rolled(slots: jax.Array, bit: int) -> jax.Array:
        return jnp.where((d.shifts >> bit & 1) == 1, jnp.roll(slots, 1 << bit), slots)

    return functools.reduce(rolled, range(3), jnp.concatenate([values[:1], values[:0:-1]]))


def thing_boxes(m: Ram, d: Drawn) -> Box:
    """Boxes of the things on the ground or in flight."""
    slot = by_slot(d, jnp.arange(RECORDS))
    far = slot < FAR_SLOTS
    bank = when(d.space, 1)
    kind = jnp.minimum(by_slot(d, m.kind) >> 4, KINDS - 1)
    x = packed_position(by_slot(d, m.code)) + jnp.where(far, FAR_X, NEAR_X)
    late = when(~d.space, jnp.clip(x + 8 - FAR_LATE, 0, 8))
    skipped = jnp.where(slot == 0, STEPS - 1 - d.step, 0)
    far_index = FAR_PICTURES.index(bank=bank, kind=kind, skipped=skipped, late=late)
    far_left, far_first, far_width, far_rows = FAR_PICTURES.extent(far_index)
    begins = 17 + 2 * d.step + KIND_ROWS * (slot - FAR_SLOTS)
    shown = jnp.clip(TURNS - begins - when(begins > d.place_turn, 1), 0, KIND_ROWS)
    left, first, width, rows = NEAR_PICTURES.extent(
        NEAR_PICTURES.index(bank=bank, kind=kind, shown=shown)
    )
    highest = first_line(m, d)
    y = highest + 2 * d.step + 16 * (slot - 1) + 2
    top = row_line(m, d, begins + first)
    bottom = row_line(m, d, begins + first + rows)
    return edges(
        x + jnp.where(far, far_left, 2 * left),
        jnp.where(far, y + far_first, top),
        x + jnp.where(far, far_left + far_width, 2 * (left + width)),
        jnp.where(far, y + far_first + far_rows, bottom - when(first + rows == KIND_ROWS, 1)),
    ).clip(0, highest, 160, end_line(m, d))


def missile_color(m: Ram, d: Drawn) -> jax.Array:
    """The color of the picture beside the missile, at its middle, even if none is drawn there."""
    from_count = FIRST_COUNT + 2 - (m.missile_y | 3)
    past_far = from_count - when(from_count > d.step + FAR_TURNS - 1, 1)
    turn = past_far - when(past_far > d.place_turn, 1)
    far = turn - d.step + 7
    near = turn - 2 * d.step - FAR_TURNS
    is_far = turn < d.step + FAR_TURNS
    slot = jnp.where(is_far, far >> 3, FAR_SLOTS + (near >> 4))
    row = jnp.where(is_far, 2 * (far & 7), near & 15)
    kind = only((jnp.arange(RECORDS) == slot) & (is_far | (near >= 0)), m.kind >> 4)
    return lookup(KIND_COLORS, (when(d.space, KINDS) + jnp.minimum(kind, KINDS - 1)) * 16 + row)


def is_any(m: Ram, d: Drawn, *wanted: int) -> jax.Array:
    return among(by_slot(d, m.kind), wanted) & ~d.space


def fighters(m: Ram, d: Drawn) -> jax.Array:
    kind = by_slot(d, m.kind)
    return jnp.where(d.space, among(kind, Kind.SPACE_FIGHTERS), kind == Kind.FIGHTER)


def the_one(boxes: Box, chosen: jax.Array, color: jax.Array) -> Box:
    """The single chosen box, if it is valid."""
    found = chosen & boxes.valid
    x = only(found, boxes.x)
    y = only(found, boxes.y)
    w = only(found, boxes.w)
    h = only(found, boxes.h)
    return box(x, y, w, h, jnp.any(found), color=color)
