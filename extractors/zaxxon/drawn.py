"""The lines on which Zaxxon's drawing loop shows its rows.

The 16 rows of a far picture take 16 lines. A near picture takes two lines per row. A turn, one
iteration of the loop, takes two lines, and the loop counts one extra turn between far and near. Two
things delay the turns after them: one turn sets the plane's position, and turns with too much work
take three lines.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import lookup, match, mod, when
from ocjax.extractors.zaxxon.ram import ROM, Color, Place, Ram, Shot, Time

TOP = 26  # line of the loop's first turn
TURNS = 82
FAR_TURNS = 17  # turns before the near part, not counting the step's
FIRST_COUNT = 82  # the loop's counter in its first turn
COUNTS_ABOVE = FIRST_COUNT + 8  # minus a thing's position: the turn after its last row
FLASH_FRAMES = 10
NO_FLASH = 56  # counter of the object above the plane if it is absent
NO_TURN = 999
SHADOW_BEGINS = 73  # of its first row
SHADOW_ALTITUDE = 18
SLOW_CODE = 8  # from this low digit, setting the position of a register takes another line
GROUND_ROWS = 15
RECORDS = 7  # of things
WAY = 0xA11  # offset of the table of the way
WAY_END = 159
ENOUGH = 20 * 2 * RECORDS  # keeps rows positive


class Drawn(NamedTuple):
    """The drawn state, and the turns of the loop that take extra time."""

    space: jax.Array
    step: jax.Array
    colors: jax.Array  # of the ground's rows, nearest first
    shapes: jax.Array
    flash_turn: jax.Array  # late because of the object above the plane
    place_turn: jax.Array  # sets the plane's position
    shadow_turn: jax.Array  # changes to the plane's shadow
    shadow: jax.Array  # whether the shadow is drawn
    shifts: jax.Array  # of the things' records so far, modulo their number


def as_drawn(m: Ram) -> Drawn:
    """Undo the move of the ground; all of its rows come nearer in two of 8 steps."""
    running = (m.runs > 0) | (m.explosion == Time.BEGINS)
    moved = running & (m.game > 0) & (m.pause == 0)
    step = (m.step - when(moved, 1)) & 7
    came = moved & ((m.step & 3) == 0)
    colors = jnp.where(came, jnp.roll(m.row_color, 1), m.row_color)
    shapes = jnp.where(came, jnp.roll(m.row_shape, 1) - 1, m.row_shape)
    space = (m.place == Place.FIRST_SPACE) | (m.place == Place.LAST_SPACE) & (m.rows_left > 7)
    flash = (m.flash_time > 0) & (m.flash_time < FLASH_FRAMES)
    homes = (m.homing_y != Shot.NONE) & (~flash | ((m.clock & 1) == 0))
    above = match((homes, m.homing_y), (flash, m.flash_y), otherwise=NO_FLASH)
    passed = jnp.maximum(COUNTS_ABOVE - above, step + FAR_TURNS)
    place_turn = jnp.where(space, NO_TURN, passed + ((2 * step + 2 - passed) & 3))
    after = jnp.maximum(COUNTS_ABOVE - m.altitude, place_turn + 1)
    shadow_turn = after + ((2 * step + 3 - after) & 3)
    shadow = (colors[1] != Color.WALL) & (m.altitude >= SHADOW_ALTITUDE) & ~space
    flash_turn = _turn_after_flash(step, COUNTS_ABOVE - above, place_turn)
    shifts = _shift_count(m, step, came)
    return Drawn(space, step, colors, shapes, flash_turn, place_turn, shadow_turn, shadow, shifts)


def _turn_after_flash(step: jax.Array, begins: jax.Array, place_turn: jax.Array) -> jax.Array:
    """The turn that changes the ground between the object above the plane and `place_turn`."""
    turn = place_turn - 3
    changes = ((turn - 2 * step) & 7) == 7
    near = turn >= 2 * (step & 3) + FAR_TURNS + 3
    return jnp.where(changes & near & (turn >= begins), turn, NO_TURN)


def _way_rows() -> np.ndarray:
    """Rows of the way before the end of each entry of its table, int32 `[159]`."""
    kinds = ROM.bytes(WAY, WAY_END)
    left = np.select(
        [kinds & 1 > 0, kinds & 2 > 0, kinds & 4 > 0], [kinds >> 1, kinds >> 2, kinds >> 3]
    )
    return np.cumsum(np.where(np.arange(WAY_END) % 3 == 0, left + 1, 0))


ROWS_BEFORE = _way_rows() % (2 * RECORDS)


def _shift_count(m: Ram, step: jax.Array, came: jax.Array) -> jax.Array:
    """How often things have moved to the next record, as they do with every second new row."""
    rows = lookup(ROWS_BEFORE, m.place) - m.rows_left - when(came, 1) - when(step >= 4, 1)
    return mod(rows + ENOUGH, 2 * RECORDS) >> 1


def line(m: Ram, d: Drawn, turn: jax.Array) -> jax.Array:
    """The first line of a turn."""
    early = d.shadow_turn - 3
    changes = ((early - 2 * d.step) & 7) == 0
    before = changes & (early >= COUNTS_ABOVE - m.altitude) & (early < turn)
    since = ((turn - 1 - 2 * d.step) >> 3) - ((d.shadow_turn - 2 * d.step) >> 3)
    after = jnp.where(d.shadow, when(turn > d.shadow_turn, 1), jnp.maximum(since, 0))
    later = when(turn > d.flash_turn, 1) + when(before, 1) + after
    return TOP + _slow_places(m) + 2 * turn + jnp.where(d.space, -1, later)


def _slow_places(m: Ram) -> jax.Array:
    """Extra lines for setting positions of objects that start far to the right."""
    others = (code & 15 for code in (m.shot_code, m.missile_code, m.code[0]))
    codes = jnp.stack([(m.drawn_code & 15) - 1, *others])
    return jnp.sum(when(codes >= SLOW_CODE, 1), dtype=jnp.int32)


def first_line(m: Ram, d: Drawn) -> jax.Array:
    """The first line of all turns."""
    return line(m, d, jnp.int32(0))


def end_line(m: Ram, d: Drawn) -> jax.Array:
    """The line below all turns."""
    return line(m, d, jnp.int32(TURNS))


def ground_end(m: Ram, d: Drawn) -> jax.Array:
    """The line below the ground, which ends a line later in one of 8 steps."""
    return end_line(m, d) + when(d.step == 0, 1)


def row_line(m: Ram, d: Drawn, row: jax.Array) -> jax.Array:
    """The first line of a row, counted in turns; `place_turn` does not count."""
    return line(m, d, row + when(row > d.place_turn, 1))


def ground_edges(m: Ram, d: Drawn) -> tuple[jax.Array, jax.Array]:
    """First line of each row of the ground and the line below its last, nearest first."""
    far = d.step & 3
    row = jnp.arange(-1, GROUND_ROWS)  # one extra row below
    turn = match(
        (row == GROUND_ROWS - 1, 0),
        (row >= 8, far + 4 * (GROUND_ROWS - 2 - row)),
        otherwise=2 * far + 24 + 8 * (7 - row),
    )
    shifted = turn - 1 + when(turn - 1 >= d.place_turn, 1)
    usual_edge = jnp.where(turn > 0, line(m, d, shifted) + 1, first_line(m, d) - 2)
    edge = jnp.minimum(usual_edge, ground_end(m, d))
    return edge[1:], edge[:-1]


def _slot_ends(d: Drawn, turn: jax.Array) -> jax.Array:
    """True if a turn ignores shots."""
    far = (turn == d.step) | (turn == d.step + 8) | (turn == d.step + 16)
    near = turn - 2 * d.step - when(turn > d.place_turn, 1)
    ends = (near >= 32) & ((near & 15) == 0)
    return far | ends | (turn == d.place_turn)


def _ground_changes(d: Drawn, turn: jax.Array) -> jax.Array:
    """True if a turn ends with a new row of the ground; such a turn checks shots late."""
    near = turn - when(turn > d.place_turn, 1) - 2 * d.step
    is_far = turn < 2 * (d.step & 3) + 20
    return jnp.where(is_far, ((turn - d.step) & 3) == 3, (near & 7) == 7)


class Late(NamedTuple):
    """A shot left of these columns starts a line late."""

    fortress: int  # if a turn changes the ground
    far_space: int
    near_space: int


def shot_lines(
    m: Ram, d: Drawn, y: jax.Array, x: jax.Array, late: Late
) -> tuple[jax.Array, jax.Array]:
    """First line of a shot, and the line below its last one."""
    last = y | 3
    return _switch_line(m, d, last, x, late), _switch_line(m, d, last - 4, x, late)


def _switch_line(m: Ram, d: Drawn, count: jax.Array, x: jax.Array, late: Late) -> jax.Array:
    """The line on which a shot begins or ends: the loop waits for a turn that can switch it."""
    far = FIRST_COUNT - count
    is_far = far <= d.step + FAR_TURNS - 1
    allowed = far - when(~is_far, 1)
    turn = allowed + when(_slot_ends(d, allowed), 1)
    limit = match(
        (d.space & is_far, late.far_space),
        (d.space & ~is_far, late.near_space),
        (_ground_changes(d, turn), late.fortress),
        otherwise=0,
    )
    return line(m, d, turn) + 1 + when(x < limit, 1)
