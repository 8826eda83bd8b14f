"""The scanner on the panel: its window, what it shows of the target, and its pointing.

Bank 1 draws it ($F335-$F493): a line a turn, sixteen turns.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, BoxTable, box
from ocjax.console.ops import lookup, match
from ocjax.extractors.solaris.ram import ROM, Ram, ShipPicture

BANK_1 = 0x1000
FONT = ROM.font(BANK_1 + 1, rows=7, stride=8)
ONES = ROM.bytes(BANK_1 + 0x575, 16) >> 3  # the last digit of the distance, by a nibble
DIGITS = np.stack([FONT.left, FONT.right])
LINES = 16
TOP = 173
WINDOW = (56, 173, 104, 188)  # its first and last columns belong to it in most rows
MIDDLE = 79  # column of the marks between its halves
LEFT_CELL = 43  # column of an arrow and a digit
RIGHT_CELL = 107
LEVELS = 16  # of the target's height
AHEAD = 8  # level
PLACES = 41  # of the target across the window
ON_COURSE = 19  # place
REACH = 40  # columns from the ship to the window's edge
WAY_OUT_Y = 0x56  # the way out has no `y` of its own


def _at(address: int) -> int:
    return int(ROM.data[BANK_1 + (address & 0xFFF)])


def _window_columns() -> np.ndarray:
    """Which columns of the window's lines have its colour, bool `[line, 160]`."""
    columns = np.arange(160)
    shown = np.zeros((LINES, 160), bool)
    for line in range(LINES):
        y = LINES - 1 - line
        half = np.where(columns < 80, columns, 159 - columns)  # the playfield is mirrored
        bars = _at(0xF548 + y) >> np.clip((half - 48) // 4, 0, 7) & 1
        mark = (columns >= MIDDLE) & (columns < MIDDLE + (4 if _at(0xF565 + y) & 0x20 else 1))
        shown[line] = (half >= 48) & (bars == 0) & ~mark
    shown[LINES - 1 - 8, 103] = True  # the kernel lowers the middle line's bar there
    return shown


def _target_rows(kind: int, level: int) -> list[int]:
    """Dots of the target's picture in the window's lines."""
    rows = []
    for y in range(LINES - 1, -1, -1):
        hidden = _at(0xF55A - level + y) & 1
        rows.append(0 if hidden else _at(0xF100 + (_at(0xF585 + kind) - level + y & 0xFF)))
    return rows


def _target_boxes() -> list[tuple[int, int, int, int]]:
    """The target's tight box by kind, level and place."""
    shown, out = _window_columns(), []
    for kind in range(16):
        for level in range(LEVELS):
            rows = np.array(_target_rows(kind, level))
            dots = (rows[:, None] >> np.arange(7, -1, -1) & 1).astype(bool)
            for place in range(PLACES):
                code = _at(0xF1A9 + place)
                x = 48 + 15 * (code & 15) - ((code >> 4 ^ 8) - 8)
                seen = dots & shown[:, x : x + 8]
                y, c = np.flatnonzero(seen.any(1)), np.flatnonzero(seen.any(0))
                inside = (
                    (x + c[0], TOP + y[0], np.ptp(c) + 1, np.ptp(y) + 1) if len(y) else (0,) * 4
                )
                out.append(tuple(int(v) for v in inside))
    return out


def _arrow_boxes() -> list[tuple[int, int, int, int]]:
    """Boxes of the pictures of pointing in a cell: left, right, a cross, up, down."""
    out = []
    for low in (0x4F, 0x5F, 0x67, 0x57, 0x47):
        rows = ROM.bytes(BANK_1 + low + 9, 7)[::-1]
        dots = (rows[:, None] >> np.arange(7, -1, -1) & 1).astype(bool)
        y, c = np.flatnonzero(dots.any(1)), np.flatnonzero(dots.any(0))
        out.append((int(c[0]), TOP + int(y[0]), int(np.ptp(c)) + 1, int(np.ptp(y)) + 1))
    return out


TARGETS = BoxTable(_target_boxes())
ARROWS = BoxTable(_arrow_boxes())
COLORS = [_at(0xF558 + kind) & 0xFE for kind in range(16)]  # of the window


def _of_target(m: Ram, records: jax.Array, way_out: jax.Array | int) -> jax.Array:
    """What the scanner's target has, of what `records` and the way out have."""
    out = jnp.asarray(way_out)
    for record in range(records.shape[0]):
        out = jnp.where(m.target == record, records[record], out)
    return out


def scanned(m: Ram, known: jax.Array) -> dict[str, Box]:
    """The objects of the scanner. At the end of a game, the target is not `known`."""
    kind = _of_target(m, m.picture, m.way_out_picture) >> 3 & 15
    side = (_of_target(m, m.x, m.way_out_x) - _ship_column(m) + REACH) & 255
    place = match((side < 80, side), (side < 168, 80), otherwise=0) >> 1
    level = (_of_target(m, m.y, WAY_OUT_Y) + 72 & 255) >> 4
    left = match((place == ON_COURSE, 2), (place > ON_COURSE, 1), otherwise=0)
    right = match((level == AHEAD, 2), (level > AHEAD, 3), otherwise=4)
    pointing = jnp.stack([left, right])
    x, y, end, bottom = WINDOW
    frame = box(x, y, end - x, bottom - y, color=lookup(COLORS, kind))
    return {
        "Scanner": frame,
        "ScannerTarget": TARGETS.at((kind * LEVELS + level) * PLACES + place, valid=known),
        "ScannerArrow": ARROWS.at(pointing, x=np.array((LEFT_CELL, RIGHT_CELL)), valid=known),
        "Distance": _distance_box(m).where(known),
    }


def _distance_box(m: Ram) -> Box:
    """The two digits beside the window."""
    depth = _of_target(m, m.depth, m.way_out_depth)
    shown = jnp.where(depth < 64, depth, depth + 64 >> 1)
    tens, last = shown >> 4, lookup(ONES, shown & 15)
    left = LEFT_CELL + lookup(FONT.left, tens)
    right = RIGHT_CELL + lookup(FONT.right, last)
    return box(left, 181, right - left, 7, value=10 * tens + last)


def sprite_column(code: jax.Array) -> jax.Array:
    """Column of the ship's sprite, by a code whose move counts twice."""
    fine = (code >> 4 ^ 8) - 8
    return 54 + 27 * (code >> 1 & 7) + 3 * (code & 1) - 2 * fine


def _ship_column(m: Ram) -> jax.Array:
    """The ship's place when the frame was drawn: it moves after that ($FBEC)."""
    step = m.ship_speed << 3 & 255
    moved = jnp.where(m.ship_part < step, 1, 0) - (m.ship_speed >> 7)
    limited = jnp.where(m.ship_speed < 128, m.ship_x >= 0x73, m.ship_x <= 0x2D)
    moved = jnp.where(limited, 0, moved)
    picture = m.ship_picture + m.ship_y & 255
    shown = sprite_column(m.ship_at) + match(
        (picture == ShipPicture.TILTED, 3), (picture == ShipPicture.WIDE, 1), otherwise=2
    )
    still = (m.jumps | m.on_chart | m.sleeps | m.waits | m.departs) == 1
    return match((still, m.ship_x), (m.heads_out == 1, m.ship_x - moved), otherwise=shown)
