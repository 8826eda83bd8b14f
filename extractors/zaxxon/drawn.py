"""The lines on which Zaxxon's drawing loop shows its rows.

Timeline of the loop, which makes 82 turns from line 26 on, counting down from 82:
    before the loop     positions far to the right take another line each (`_slow_places`)
    turns 0 to step+16  three far pictures: a turn shows two of their 16 rows
    then                near pictures: a turn shows a row; the loop has counted one extra turn
    `flash_turn`        changes the ground just after it has ended the object above the plane
    `place_turn`        sets the plane's position instead of showing a row of a thing
    `shadow_turn`       changes to the plane's shadow
A turn takes two lines, with too much work three. Then everything below it moves down by a line:
    after `flash_turn`, if there is one
    three turns before `shadow_turn`, if that one changes the ground
    after `shadow_turn`, if the shadow is drawn; otherwise after every later change of the ground
In space nothing is late; the loop begins a line earlier.
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
SPACE_ROWS = 7  # the last rows of `Place.LAST_SPACE`, which are a fortress again
GROUND_BITS = 3
GROUND_PERIOD = 1 << GROUND_BITS  # turns from a change of the near ground to the next


class Drawn(NamedTuple):
    """The drawn state, and the turns of the loop that take extra time."""

    space: jax.Array
    step: jax.Array
    colors: jax.Array  # of the ground's rows, nearest first
    shapes: jax.Array
    flash_turn: jax.Array  # see the timeline; `NO_TURN`: none
    place_turn: jax.Array  # in space `NO_TURN`
    shadow_turn: jax.Array
    shadow: jax.Array  # whether the shadow is drawn
    shifts: jax.Array  # of the things' records so far, modulo their number


class Ground(NamedTuple):
    """The ground before its last move."""

    step: jax.Array
    colors: jax.Array
    shapes: jax.Array
    came: jax.Array  # whether the move made all rows come nearer


def as_drawn(m: Ram) -> Drawn:
    """The frame before the move of the ground."""
    ground = _ground_as_drawn(m)
    space = _in_space(m)
    begins = COUNTS_ABOVE - _count_above(m)  # the turn below the object above the plane
    place_turn = jnp.where(space, NO_TURN, _turn_of_place(ground.step, begins))
    is_wall = ground.colors[1] == Color.WALL  # under the plane
    return Drawn(
        space=space,
        step=ground.step,
        colors=ground.colors,
        shapes=ground.shapes,
        flash_turn=_turn_after_flash(ground.step, begins, place_turn),
        place_turn=place_turn,
        shadow_turn=_turn_of_shadow(m, ground.step, place_turn),
        shadow=~is_wall & (m.altitude >= SHADOW_ALTITUDE) & ~space,
        shifts=_shift_count(m, ground.step, ground.came),
    )


def _ground_as_drawn(m: Ram) -> Ground:
    """Undo the move of the ground; all of its rows come nearer in two of 8 steps."""
    runs = (m.runs > 0) | (m.explosion == Time.BEGINS)
    moved = runs & (m.game > 0) & (m.pause == 0)
    came = moved & ((m.step & 3) == 0)
    return Ground(
        step=(m.step - when(moved, 1)) & 7,
        colors=jnp.where(came, jnp.roll(m.row_color, 1), m.row_color),
        shapes=jnp.where(came, jnp.roll(m.row_shape, 1) - 1, m.row_shape),
        came=came,
    )


def _in_space(m: Ram) -> jax.Array:
    last = (m.place == Place.LAST_SPACE) & (m.rows_left > SPACE_ROWS)
    return (m.place == Place.FIRST_SPACE) | last


def _count_above(m: Ram) -> jax.Array:
    """The loop's counter of the object above the plane: Zaxxon's missile, or a shot's flash."""
    flashes = (m.flash_time > 0) & (m.flash_time < FLASH_FRAMES)
    its_turn = ~flashes | ((m.clock & 1) == 0)  # they are drawn alternately
    homes = (m.homing_y != Shot.NONE) & its_turn
    return match((homes, m.homing_y), (flashes, m.flash_y), otherwise=NO_FLASH)


def _turn_of_place(step: jax.Array, begins: jax.Array) -> jax.Array:
    """The first near turn after the object above the plane that is 2 * step + 2 modulo 4."""
    earliest = jnp.maximum(begins, step + FAR_TURNS)
    return earliest + ((2 * step + 2 - earliest) & 3)


def _turn_of_shadow(m: Ram, step: jax.Array, place_turn: jax.Array) -> jax.Array:
    """The first turn after the plane that is 2 * step + 3 modulo 4."""
    earliest = jnp.maximum(COUNTS_ABOVE - m.altitude, place_turn + 1)
    return earliest + ((2 * step + 3 - earliest) & 3)


def _turn_after_flash(step: jax.Array, begins: jax.Array, place_turn: jax.Array) -> jax.Array:
    """The turn that changes the ground between the object above the plane and `place_turn`."""
    turn = place_turn - 3
    changes = _is_ground_change(turn - 2 * step)
    is_near = turn >= 2 * (step & 3) + FAR_TURNS + 3
    return jnp.where(changes & is_near & (turn >= begins), turn, NO_TURN)


def _is_ground_change(near_turn: jax.Array) -> jax.Array:
    """True for turns of the near part that end with a new row of the ground."""
    return (near_turn & GROUND_PERIOD - 1) == GROUND_PERIOD - 1


def _way_rows() -> np.ndarray:
    """Rows of the way before the end of each entry of its table, int32 `[159]`."""
    kinds = ROM.bytes(WAY, WAY_END)
    left = np.select(
        [kinds & 1 > 0, kinds & 2 > 0, kinds & 4 > 0], [kinds >> 1, kinds >> 2, kinds >> 3]
    )
    is_entry = np.arange(WAY_END) % 3 == 0
    return np.cumsum(np.where(is_entry, left + 1, 0))


ROWS_BEFORE = _way_rows() % (2 * RECORDS)


def _shift_count(m: Ram, step: jax.Array, came: jax.Array) -> jax.Array:
    """How often things have moved to the next record, as they do with every second new row."""
    rows = lookup(ROWS_BEFORE, m.place) - m.rows_left - when(came, 1) - when(step >= 4, 1)
    return mod(rows + ENOUGH, 2 * RECORDS) >> 1


def line(m: Ram, d: Drawn, turn: jax.Array) -> jax.Array:
    """The first line of a turn."""
    early = d.shadow_turn - 3
    changes = ((early - 2 * d.step) & GROUND_PERIOD - 1) == 0
    is_late = changes & (early >= COUNTS_ABOVE - m.altitude) & (early < turn)
    changes_since = _ground_changes_before(d, turn - 1) - _ground_changes_before(d, d.shadow_turn)
    for_shadow = jnp.where(d.shadow, when(turn > d.shadow_turn, 1), jnp.maximum(changes_since, 0))
    later = when(turn > d.flash_turn, 1) + when(is_late, 1) + for_shadow
    return TOP + _slow_places(m) + 2 * turn + jnp.where(d.space, -1, later)


def _ground_changes_before(d: Drawn, turn: jax.Array) -> jax.Array:
    """The number of changes of the near ground, from a fixed start."""
    return (turn - 2 * d.step) >> GROUND_BITS


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


FAR_ROWS = range(8, GROUND_ROWS)  # of the ground; a row takes four turns, a near one eight


def ground_edges(m: Ram, d: Drawn) -> tuple[jax.Array, jax.Array]:
    """First line of each row of the ground and the line below its last, nearest first."""
    row = jnp.arange(-1, GROUND_ROWS)  # one extra row below
    progress = d.step & 3
    turn = match(
        (row == GROUND_ROWS - 1, 0),
        (row >= FAR_ROWS.start, progress + 4 * (GROUND_ROWS - 2 - row)),
        otherwise=2 * progress + 24 + 8 * (7 - row),
    )
    last_before = turn - 1 + when(turn - 1 >= d.place_turn, 1)
    usual_edge = jnp.where(turn > 0, line(m, d, last_before) + 1, first_line(m, d) - 2)
    edge = jnp.minimum(usual_edge, ground_end(m, d))
    return edge[1:], edge[:-1]


def _slot_ends(d: Drawn, turn: jax.Array) -> jax.Array:
    """True if a turn ignores shots."""
    far = (turn == d.step) | (turn == d.step + 8) | (turn == d.step + 16)
    near_turn = turn - 2 * d.step - when(turn > d.place_turn, 1)
    near = (near_turn >= 32) & ((near_turn & 15) == 0)
    return far | near | (turn == d.place_turn)


def _ground_changes(d: Drawn, turn: jax.Array) -> jax.Array:
    """True if a turn ends with a new row of the ground; such a turn checks shots late."""
    is_far = turn < 2 * (d.step & 3) + 20
    far_change = ((turn - d.step) & 3) == 3
    near_turn = turn - when(turn > d.place_turn, 1) - 2 * d.step
    return jnp.where(is_far, far_change, _is_ground_change(near_turn))


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
    counted = FIRST_COUNT - count
    is_far = counted < d.step + FAR_TURNS
    wanted = counted - when(~is_far, 1)
    turn = wanted + when(_slot_ends(d, wanted), 1)
    limit = match(
        (d.space & is_far, late.far_space),
        (d.space & ~is_far, late.near_space),
        (_ground_changes(d, turn), late.fortress),
        otherwise=0,
    )
    return line(m, d, turn) + 1 + when(x < limit, 1)
