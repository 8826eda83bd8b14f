"""The objects of James Bond 007 in the air, in the sea and in the sky.

Each of the three lanes has a record of its object. The ROM describes the kinds of objects: the
records of kinds at $FD00, each followed by the kind's pictures. The game draws the frame and then
moves the objects ($F652), so the RAM is a step ahead of the screen; `lane_boxes` undoes the step.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import EDGE_CUTS, WIDTH, Box, Pictures, among, box, match, pick, when
from ocjax.extractors.jamesbond.ram import ROM, Flags, Kind, MoreFlags, Ram, Size, Status

GRAPHICS = 0x1000  # offset of the pages that are at $F000 while the frame is drawn

FIELD_LEFT = 8  # columns 0-7 are black
FIELD_TOP = 57
FIELD_RIGHT = 160
AIR = (FIELD_LEFT, FIELD_TOP, FIELD_RIGHT, 121)
SEA = (FIELD_LEFT, 121, FIELD_RIGHT, 152)
PICTURE_WIDTH = 8  # dots
IN_AIR = np.array((True, True, False, False, False))  # slots: two in the air,
IN_SEA = np.array((False, False, True, True, False))  # two in the sea and one in the sky
IS_COPY = np.array((False, True, False, True, False))
SKY_SLOT = 4
LANE_BOTTOMS = np.where(IN_SEA, SEA[3], AIR[3])

NONE = 128  # least kind, height or row without meaning
JUST_DIED = 60  # `pause` on the frame of the loss
SPARKS_Y = 64  # `object_y` of explosions
SMOKE_ROWS = 15  # of the ship's pictures
UNLIT = 105  # least column of missiles in the sea without their last row

KIND_COUNT = 15
RECORDS = GRAPHICS | (ROM.bytes(0xB62, KIND_COUNT) & 15) << 8 | ROM.bytes(0xB53, KIND_COUNT)
RECORD = np.array([ROM.bytes(at, 11) for at in RECORDS])  # of each kind; its pictures follow


def _kind_steps(field: int, torpedo: int) -> list[int]:
    """Pixels that each kind moves in a step; a torpedo's are not in its record."""
    steps = (RECORD[:, field].astype(int) ^ 128) - 128
    return np.where(np.arange(KIND_COUNT) == Kind.TORPEDO, torpedo, steps).tolist()


TOGGLES = RECORD[:, 0].tolist()  # address bits that differ between the two pictures
ANIMATIONS = (RECORD[:, 1] & 15).tolist()  # frames that a picture lasts
PERIODS = RECORD[:, 2].tolist()  # frames from step to step
STEPS_X = _kind_steps(3, torpedo=-2)
STEPS_Y = _kind_steps(4, torpedo=0)
HEIGHTS = RECORD[:, 5].tolist()  # rows less 1
STARTS = RECORD[:, 7].tolist()  # the first `object_y`
FIRST_PICTURES = [at + 11 & 255 for at in RECORDS]  # low byte of the address


def _picture(kind: int, toggle: int) -> np.ndarray:
    """The rows of a picture from the top, without the smoke of the ship."""
    page = int(RECORDS[kind]) & ~255
    dots = ROM.rows(page | FIRST_PICTURES[kind] ^ toggle, HEIGHTS[kind] + 1)
    return np.where((kind == Kind.SHIP) & (np.arange(len(dots)) < SMOKE_ROWS), 0, dots)


BOTH = [_picture(kind, toggle) for kind in range(KIND_COUNT) for toggle in (0, TOGGLES[kind])]
ROWS = range(1, max(HEIGHTS) + 2)  # visible rows of a picture above the surface or the ground
LOOKS = Pictures.of([rows[:n] & seen for rows in BOTH for n in ROWS for seen in EDGE_CUTS])


def column(x: jax.Array) -> jax.Array:
    """Left edge of a player that the game positions at x; 5 to 14 give columns further left."""
    return x - 1 - when((x >= 5) & (x < 15), 5)


def runs(m: Ram) -> jax.Array:
    """True if the objects have moved since they were drawn."""
    stands = ((m.flags & Flags.DIES) != 0) & (m.pause != JUST_DIED)
    return ((m.status & Status.NOT_RUNNING) == 0) & ~stands


def have_stepped(m: Ram, kinds: jax.Array) -> jax.Array:
    """True for objects that have made a step since they were drawn."""
    beam = (m.more_flags & MoreFlags.BEAM) != 0
    aims = beam & (((m.clock + 1) & 15) != 0) & (kinds == Kind.HELICOPTER)
    return runs(m) & (m.step_timer == pick(kinds, PERIODS)) & ~aims


def beamed(m: Ram) -> jax.Array:
    """True if the frame shows the beam in place of the objects in the air."""
    beam = (m.more_flags & MoreFlags.BEAM) != 0
    return beam & ((m.flags & (Flags.ODD | Flags.DIES)) == Flags.ODD)


def drawn_kinds(m: Ram) -> jax.Array:
    """The kind in each slot, with an explosion that ended in this step."""
    ended = IN_AIR & (m.kind >= NONE) & (m.last_y == SPARKS_Y)
    return jnp.where(ended, Kind.EXPLOSION, m.kind)


def lane_boxes(m: Ram, kinds: jax.Array) -> Box:
    """The objects as drawn; if an edge or columns 0-7 cut an object, its larger part."""
    zoom = match((m.size == Size.DOUBLE, 1), (m.size == Size.QUAD, 2), otherwise=0)
    left = _left_columns(m, kinds, zoom)
    y = _row(m, kinds)
    beyond_right = jnp.clip(
        (left + (PICTURE_WIDTH << zoom) - FIELD_RIGHT) >> zoom, 0, PICTURE_WIDTH
    )
    beyond_left = jnp.clip((FIELD_LEFT - left) >> zoom, 0, PICTURE_WIDTH)
    bottom = LANE_BOTTOMS - when((kinds == Kind.MISSILE) & IN_SEA & (left >= UNLIT), 1)
    shown_rows = len(ROWS) * _look(m, kinds) + jnp.clip(bottom - y, 1, len(ROWS)) - 1
    cut = len(EDGE_CUTS) * shown_rows + PICTURE_WIDTH + beyond_right - beyond_left
    dx, dy, w, h = LOOKS.extent(cut)
    shapes = box(left + (dx << zoom), y + dy, w << zoom, h, _there(m, kinds))
    return shapes.clip(FIELD_LEFT, FIELD_TOP, FIELD_RIGHT, bottom)


def _left_columns(m: Ram, kinds: jax.Array, zoom: jax.Array) -> jax.Array:
    """The first column of each picture."""
    step = when(have_stepped(m, kinds), pick(kinds, STEPS_X))
    ground = when((m.clock & 3) == 0, 1)
    behind = beamed(m) & IN_AIR  # last drawn on the frame before
    x = m.object_x - step - when(behind, step - ground)
    copy = match((m.size == Size.NEAR_COPY, 16), (m.size == Size.MEDIUM_COPY, 32), otherwise=64)
    left = column(x) + when(zoom > 0, 1) + when(IS_COPY, copy)
    # More of it is in the field at the left edge than at the right one.
    beyond = 2 * left + (PICTURE_WIDTH << zoom) > 2 * FIELD_RIGHT + FIELD_LEFT
    return match((left < 0, left + WIDTH), (beyond, left - WIDTH), otherwise=left)


def _row(m: Ram, kinds: jax.Array) -> jax.Array:
    """The first row of each picture."""
    now_y = jnp.where(kinds != m.kind, SPARKS_Y, m.object_y)
    y = now_y - when(have_stepped(m, kinds), pick(kinds, STEPS_Y))
    rises = among(kinds, (Kind.MISSILE, Kind.ROCKET)) & IN_SEA
    return 179 - jnp.where(rises, jnp.maximum(y, pick(kinds, STARTS)), y)


def _look(m: Ram, kinds: jax.Array) -> jax.Array:
    """Index of each object in `BOTH`."""
    toggled = runs(m) & (m.animation == pick(kinds, ANIMATIONS))
    second = (m.picture != pick(kinds, FIRST_PICTURES)) ^ toggled
    return 2 * kinds + when(second, 1)


def _there(m: Ram, kinds: jax.Array) -> jax.Array:
    exists = (m.height < NONE) & (m.object_y < NONE)
    late = among(kinds, (Kind.TORPEDO, Kind.EXPLOSION, Kind.ERUPTION))
    begins = runs(m) & (m.drawn == 0) & late
    return ((kinds != m.kind) | exists) & (~IS_COPY | among(m.size, Size.COPIES)) & ~begins
