"""The scanner on Solaris' panel: its window, the target in it, two arrows and the distance.

Bank 1 draws it ($F335-$F493) in sixteen loop iterations of one line. The target is visible in the
window's lines and columns that the playfield and a mark in the middle leave free.
"""

from itertools import product

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import COARSE, Bounds, Box, BoxTable, Digits, edges, lookup, match
from ocjax.extractors.solaris.ram import RECORDS, ROM, Ram
from ocjax.extractors.solaris.ship import ship_column

BANK_1 = 0x1000
FONT = ROM.font(BANK_1 + 1, rows=7, stride=8)
LAST_DIGITS = ROM.bytes(BANK_1 + 0x575, 16) >> 3  # of the distance, by the depth's low nibble
NEAR = 64  # least depth that the distance halves
LEFT_CELL = 43  # column of the left arrow, and of the first digit below it
RIGHT_CELL = 107
ARROW_COLUMNS = (LEFT_CELL, RIGHT_CELL)
CELL_WIDTH = 8
ARROW_TOP = 173
ARROW_HEIGHT = 7
DIGITS_TOP = 181
DIGITS_BOTTOM = 188

LINES = 16  # of the window
WINDOW = (56, 173, 104, 188)  # its first and last columns belong to it in most lines
WINDOW_TOP = 173
MIDDLE_LINE = 7
HALF_LEFT = 48  # column of the first dot of the playfield in each mirrored half
DOT_COLUMNS = 4  # columns of such a dot
MIDDLE = 79  # column of the mark between the halves
KINDS = 16  # of targets: the kinds of records, and further ones
COLORS = ROM.bytes(BANK_1 + 0x558, KINDS) & 0xFE  # of the window, by kind

LEVELS = 16  # of the target's height
AHEAD = 8  # the ship's level
LEVEL_0 = 72  # `y` plus this, in sixteens, is the level
PLACES = 41  # of the target across the window, two columns each
ON_COURSE = 19  # the ship's position
PLACE_CODES = ROM.bytes(BANK_1 + 0x1A9, PLACES)  # of the sprite's columns
REACH = 40  # columns from the ship beyond which the target stays at the window's edge
ROUND = 256  # columns until numbers wrap around
WAY_OUT_Y = 0x56  # the way out of a jump has no `y` in the RAM


class Arrow:  # numbers of the pictures in `ARROWS`
    LEFT = 0
    RIGHT = 1
    CROSS = 2
    UP = 3
    DOWN = 4


ARROW_PICTURES = (0x58, 0x68, 0x70, 0x60, 0x50)  # low bytes of their addresses
ARROWS = ROM.pictures([BANK_1 + low for low in ARROW_PICTURES], ARROW_HEIGHT)


def scanned(m: Ram, known: jax.Array) -> dict[str, Box]:
    """The objects of the scanner. At the end of a game, the target is not `known`."""
    kind = _of_target(m, m.picture, m.way_out_picture) >> 3 & KINDS - 1
    place = _target_place(m)
    level = _target_level(m)
    target = (kind * LEVELS + level) * PLACES + place
    return {
        "Scanner": edges(*WINDOW, color=lookup(COLORS, kind)),
        "ScannerTarget": TARGETS.at(target, valid=known),
        "ScannerArrow": _arrow_boxes(place, level).where(known),
        "Distance": _distance_box(m).where(known),
    }


def _of_target(m: Ram, of_records: jax.Array, of_way_out: jax.Array | int) -> jax.Array:
    """The target's value, from the values of the records and of the way out."""
    cases = [(m.target == record, of_records[record]) for record in range(RECORDS)]
    return match(*cases, otherwise=of_way_out)


def _target_place(m: Ram) -> jax.Array:
    """The target's position across the window ($F39D)."""
    from_edge = (_of_target(m, m.x, m.way_out_x) - ship_column(m) + REACH) & ROUND - 1
    is_inside = from_edge < 2 * REACH
    is_on_right = from_edge < REACH + ROUND // 2
    return match((is_inside, from_edge), (is_on_right, 2 * REACH), otherwise=0) >> 1


def _target_level(m: Ram) -> jax.Array:
    """The target's height in the window ($F3F7)."""
    return (_of_target(m, m.y, WAY_OUT_Y) + LEVEL_0 & 0xFF) >> 4


def _arrow_boxes(place: jax.Array, level: jax.Array) -> Box:
    """The arrow to the target's side, and the arrow up or down; a cross if the target is ahead."""
    left = match(
        (place == ON_COURSE, Arrow.CROSS), (place > ON_COURSE, Arrow.RIGHT), otherwise=Arrow.LEFT
    )
    right = match((level == AHEAD, Arrow.CROSS), (level > AHEAD, Arrow.UP), otherwise=Arrow.DOWN)
    return ARROWS.box(jnp.stack([left, right]), np.array(ARROW_COLUMNS), ARROW_TOP)


def _distance_box(m: Ram) -> Box:
    """The two digits beside the window ($F34B)."""
    depth = _of_target(m, m.depth, m.way_out_depth)
    shown = jnp.where(depth < NEAR, depth, depth + NEAR >> 1)
    tens = shown >> 4
    last = lookup(LAST_DIGITS, shown & 15)
    return edges(
        left=LEFT_CELL + lookup(FONT.left, tens),
        top=DIGITS_TOP,
        right=RIGHT_CELL + lookup(FONT.right, last),
        bottom=DIGITS_BOTTOM,
        value=10 * tens + last,
    )


def _target_boxes() -> list[tuple[int, ...]]:
    """The target's tight boxes by kind, level and position."""
    free = _window_dots()
    columns = _target_columns()
    pictures = [_target_dots(kind, level) for kind, level in product(range(KINDS), range(LEVELS))]
    return [_tight(dots & free[:, x : x + CELL_WIDTH], x) for dots in pictures for x in columns]


def _tight(dots: np.ndarray, x: int) -> tuple[int, ...]:
    """The box around dots of the window, from column x; zeros without dots."""
    rows = np.flatnonzero(dots.any(axis=1))
    columns = np.flatnonzero(dots.any(axis=0))
    if not len(rows):
        return 0, 0, 0, 0
    width = np.ptp(columns) + 1
    height = np.ptp(rows) + 1
    return int(x + columns[0]), int(WINDOW_TOP + rows[0]), int(width), int(height)


def _target_columns() -> list[int]:
    """Columns of the target's sprite by position."""
    turns = PLACE_CODES & 15
    to_left = (PLACE_CODES >> 4 ^ 8) - 8
    return (HALF_LEFT + COARSE * turns - to_left).tolist()


def _target_dots(kind: int, level: int) -> np.ndarray:
    """Dots of the target's picture in the window's lines, bool `[line, 8]`."""
    first = _at(0xF585 + kind) - level
    upwards = range(LINES - 1, -1, -1)
    rows = [0 if _at(0xF55A - level + y) & 1 else _at(0xF100 + (first + y & 0xFF)) for y in upwards]
    return (np.array(rows)[:, None] >> np.arange(7, -1, -1) & 1).astype(bool)


def _window_dots() -> np.ndarray:
    """True for columns of the window's lines with its colour, bool `[line, 160]`."""
    of_window = np.stack([_window_line(LINES - 1 - line) for line in range(LINES)])
    is_middle_line = np.arange(LINES)[:, None] == MIDDLE_LINE
    return of_window | is_middle_line & (np.arange(160) == WINDOW[2] - 1)  # one more column here


def _window_line(y: int) -> np.ndarray:
    """True for columns with the window's colour in a line, counted from the bottom."""
    columns = np.arange(160)
    in_half = np.minimum(columns, 159 - columns) - HALF_LEFT  # the playfield is mirrored
    dot = np.clip(in_half // DOT_COLUMNS, 0, 7)
    is_bar = _at(0xF548 + y) >> dot & 1
    mark_width = 4 if _at(0xF565 + y) & 0x20 else 1
    is_mark = (columns >= MIDDLE) & (columns < MIDDLE + mark_width)
    return (in_half >= 0) & (is_bar == 0) & ~is_mark


def _at(address: int) -> int:
    return int(ROM.data[BANK_1 + (address & 0xFFF)])


TARGETS = BoxTable(_target_boxes())
WINDOW_RULE = Bounds(tuple(sorted(set(COLORS.tolist()))), WINDOW, min_size=(40, 15))
TARGET_RULE = Bounds(14, WINDOW)
ARROW_RULE = Bounds(
    184,
    tuple((x, ARROW_TOP, x + CELL_WIDTH, ARROW_TOP + ARROW_HEIGHT) for x in ARROW_COLUMNS),
)
DISTANCE_RULE = Bounds(
    184,
    (LEFT_CELL, DIGITS_TOP, RIGHT_CELL + CELL_WIDTH, DIGITS_BOTTOM),
    value=Digits(FONT, (LEFT_CELL, RIGHT_CELL), DIGITS_TOP),
)
