"""Things on Zaxxon's ground or above it: pictures and boxes.

Three pictures are far away. Their rows take one line each, and a turn of the drawing loop shows two
rows: it writes the second one in the middle of the first one's line. The other pictures are near,
twice as wide and twice as high.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    WIDTH as SCREEN_WIDTH,
    Box,
    Pictures,
    among,
    choose,
    edges,
    lookup,
    only,
    packed_position,
    when,
)
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
FAR_LATE = 103  # from this column, both lines of a pair show its second row
LATE_COLUMNS = 9  # 0 to 8 columns of a picture are right of it
FAR_X = 11  # minus the position of a register
NEAR_X = 12
FIRST_SLOT_TURN = FAR_TURNS  # of the first near picture at step 0


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
    record = by_slot(d, jnp.arange(RECORDS))
    is_far = record < FAR_SLOTS
    picture = {"bank": when(d.space, 1), "kind": jnp.minimum(by_slot(d, m.kind) >> 4, KINDS - 1)}
    x = packed_position(by_slot(d, m.code))
    far = _far_boxes(m, d, record, x + FAR_X, picture)
    near = _near_boxes(m, d, record, x + NEAR_X, picture)
    return choose(is_far, far, near).clip(0, first_line(m, d), SCREEN_WIDTH, end_line(m, d))


def _far_boxes(
    m: Ram, d: Drawn, record: jax.Array, x: jax.Array, picture: dict[str, jax.Array]
) -> Box:
    """Boxes of things as if they were far away."""
    late = when(~d.space, jnp.clip(x + 8 - FAR_LATE, 0, LATE_COLUMNS - 1))
    skipped = when(record == 0, STEPS - 1 - d.step)
    y = first_line(m, d) + 2 * d.step + KIND_ROWS * (record - 1) + 2
    return FAR_PICTURES.box(FAR_PICTURES.index(**picture, skipped=skipped, late=late), x, y)


def _near_boxes(
    m: Ram, d: Drawn, record: jax.Array, x: jax.Array, picture: dict[str, jax.Array]
) -> Box:
    """Boxes of things as if they were near."""
    begins = FIRST_SLOT_TURN + 2 * d.step + KIND_ROWS * (record - FAR_SLOTS)
    waits = when(begins > d.place_turn, 1)
    shown = jnp.clip(TURNS - begins - waits, 0, KIND_ROWS)
    left, first, width, rows = NEAR_PICTURES.extent(NEAR_PICTURES.index(**picture, shown=shown))
    top = row_line(m, d, begins + first)
    bottom = row_line(m, d, begins + first + rows)
    last_row_cut = when(first + rows == KIND_ROWS, 1)
    return edges(x + 2 * left, top, x + 2 * (left + width), bottom - last_row_cut)


def missile_color(m: Ram, d: Drawn) -> jax.Array:
    """The color of the picture beside the missile, at its middle, even if none is drawn there."""
    counted = FIRST_COUNT + 2 - (m.missile_y | 3)
    past_far = counted - when(counted > d.step + FAR_TURNS - 1, 1)
    turn = past_far - when(past_far > d.place_turn, 1)
    far_turn = turn - d.step + 7
    near_turn = turn - 2 * d.step - FAR_TURNS
    is_far = turn < d.step + FAR_TURNS
    record = jnp.where(is_far, far_turn >> 3, FAR_SLOTS + (near_turn >> 4))
    row = jnp.where(is_far, 2 * (far_turn & 7), near_turn & 15)
    beside = (jnp.arange(RECORDS) == record) & (is_far | (near_turn >= 0))
    kind = jnp.minimum(only(beside, m.kind >> 4), KINDS - 1)
    bank = when(d.space, KINDS)
    return lookup(KIND_COLORS, (bank + kind) * KIND_ROWS + row)


def is_any(m: Ram, d: Drawn, *wanted: int) -> jax.Array:
    return among(by_slot(d, m.kind), wanted) & ~d.space


def fighters(m: Ram, d: Drawn) -> jax.Array:
    kind = by_slot(d, m.kind)
    return jnp.where(d.space, among(kind, Kind.SPACE_FIGHTERS), kind == Kind.FIGHTER)
