"""Extents of Kung Fu Master's figures.

For outstretched arms and legs, the drawing loop moves a figure's sprite and doubles its dots row by
row. A table beside the picture gives each row's shift: the high nibble is a move to the left, and a
low nibble of 5 doubles the width. Black pixels on the floor's black line are invisible.
"""

import itertools
from collections.abc import Iterable
from typing import NamedTuple

import jax
import numpy as np
from ocjax.authoring import Box, Number, Rom, box, lookup

ROM = Rom("kung_fu_master", "5b92a93b23523ff16e2789b820e2a4c5")
LOGIC = 0x1000  # offset of the second bank, which has the rules of the game; the first one draws

FIGURE = 36  # rows of a picture
FEET_ROWS = 4  # lowest rows, in front of the floor
BLACK_LINE = 1  # row of the picture, from the bottom, in front of the floor's black line
WIDE = 5  # in a shift's low nibble
STILL = 0xDC3E  # shifts of zero
LEFTMOST = 32  # most columns from an extent's left edge to the sprite's position


class Pose:  # of the player
    KICK_LOW = 0
    CROUCH = 1
    KICK = 2
    PUNCH = 3
    PUNCH_LOW = 4
    STAND = 5
    JUMP = 6
    WALK = 7
    STEP = 8
    IN_AIR = 9  # a jump above the floor's black line


CROUCHED = (Pose.KICK_LOW, Pose.CROUCH, Pose.PUNCH_LOW)  # in colours without black shoes
STRETCHED = 5  # poses with shifts: the first ones


class Look(NamedTuple):
    """A picture of an enemy."""

    address: int
    height: int = FIGURE
    shifts: tuple[int, int] = (STILL, STILL)  # of a look to the left, and to the right


# Pictures of the enemies
THROWS = 0xDA00
DUCKS = 0xDA24
WALKS = 0xDA6C
STEPS = 0xDA90
DRAGON = 0xD82C
DRAGON_BALL = 0xD972
RED_BALL = 0xDE49
AIRBALL = 0xDE3F


def _words(low: int, high: int, count: int) -> list[int]:
    """Addresses from tables of low and high bytes in the rules' bank."""
    return (ROM.bytes(LOGIC + low, count) + 256 * ROM.bytes(LOGIC + high, count)).tolist()


POSE_ADDRESSES = _words(0xF3B, 0xEE2, 9)
FIRST_SHIFTS = _words(0xF6F, 0xF79, 10)  # of the first poses: to the left, to the right
PAIRS = tuple(zip(FIRST_SHIFTS[::2], FIRST_SHIFTS[1::2], strict=True))

STANDING = (  # at a fixed height; without the row above the last three
    Look(THROWS),
    Look(DUCKS),
    Look(WALKS),
    Look(STEPS),
    Look(DRAGON),
)
FIGHTING = tuple(
    Look(POSE_ADDRESSES[pose], shifts=PAIRS[pose])
    for pose in (Pose.KICK_LOW, Pose.KICK, Pose.PUNCH, Pose.PUNCH_LOW)
)
FLOATING = (  # at any height
    Look(0xDB00, 22),  # a small enemy
    Look(0xDB15, 22),
    Look(0xDB2A, 15),  # in a somersault
    Look(0xDB39, 15),
    Look(DRAGON_BALL, 13),
    Look(0xD95E, 20),  # smoke
    Look(0xD923, 31),
    Look(0xD806, 38),
    Look(0xDECE, 39),
    Look(0xD854, 39),
    Look(RED_BALL, 13),
    Look(0xDE6E, 12),  # a bursting one
    Look(0xDE7A, 13),
    Look(0xDE87, 12),
    Look(AIRBALL, 11),
    Look(0xDE93, 13),
    Look(0xDEA0, 12),
    Look(0xD994, 14),  # a snake's ball
    Look(0xD9A2, 11),
    Look(0xD9AD, 10),
    Look(0xD9B7, 8),
    Look(0xD9BF, 13),  # a snake
    Look(0xD9CB, 13),
    Look(0xDAE1, 4),  # a moth
    Look(0xDAE9, 7),
    Look(0xDAF0, 7),
    Look(0xDAF7, 7),
)
SIDES = (False, True)  # whether a figure looks to the right
PAGES = 8  # of pictures, from 0xD800


class Dots(NamedTuple):
    """A row of a sprite, eight dots."""

    column: int
    row: int
    dots: int
    zoom: int


def _columns(line: Dots) -> tuple[int, int]:
    """First column of a row's dots, and the column after them; wide dots begin a column later."""
    used = [i for i in range(8) if line.dots >> (7 - i) & 1]
    start = line.column + line.zoom - 1
    return start + line.zoom * used[0], start + line.zoom * (used[-1] + 1)


def _packed_extent(lines: Iterable[Dots]) -> int:
    """Left, width, top and height of rows of dots, packed; 0 without a dot."""
    inked = [line for line in lines if line.dots]
    if not inked:
        return 0
    lefts, rights = zip(*(_columns(line) for line in inked), strict=True)
    rows = [line.row for line in inked]
    left = min(lefts)
    top = min(rows)
    width = max(rights) - left
    height = max(rows) - top + 1
    return left + LEFTMOST | width << 6 | top + FIGURE + 3 << 12 | height << 18


def _picture_lines(address: int, height: int, shifts: int, *, mirrored: bool) -> list[Dots]:
    """The rows of a picture from the top; the lowest is row 0, rows above it are negative."""
    rows = range(height - 1, -1, -1)
    codes = [int(ROM.data[(shifts & 0xFFF) + y]) for y in rows]
    lefts = itertools.accumulate(8 - (code >> 4 ^ 8) for code in codes)
    stored = (int(ROM.data[(address & 0xFFF) + y]) for y in rows)
    dots = (int(f"{byte:08b}"[::-1], 2) if mirrored else byte for byte in stored)
    return [
        Dots(left, -y, ink, 2 if code & 7 == WIDE else 1)
        for left, y, ink, code in zip(lefts, rows, dots, codes, strict=True)
    ]


def _pose_extent(pose: int, *, right: bool, shifted_right: bool) -> int:
    """The extent of a pose of the player."""
    picture = Pose.JUMP if pose == Pose.IN_AIR else pose
    shifts = PAIRS[pose][shifted_right] if pose < STRETCHED else STILL
    lines = _picture_lines(POSE_ADDRESSES[picture], FIGURE, shifts, mirrored=right)
    whole = pose in (*CROUCHED, Pose.IN_AIR)
    return _packed_extent(line for line in lines if whole or -line.row != BLACK_LINE)


def _standing_extent(look: Look, *, right: bool) -> int:
    """The extent of an enemy with its last three rows one row further up."""
    lines = _picture_lines(look.address, look.height, STILL, mirrored=right)
    upper = [line for line in lines if -line.row >= FEET_ROWS]
    feet = [line._replace(row=line.row - 1) for line in lines if -line.row < FEET_ROWS - 1]
    return _packed_extent(upper + feet)


def _fighting_extent(look: Look, *, right: bool) -> int:
    lines = _picture_lines(look.address, look.height, look.shifts[right], mirrored=right)
    return _packed_extent(line for line in lines if -line.row != BLACK_LINE)


def _floating_extent(look: Look, *, right: bool) -> int:
    return _packed_extent(_picture_lines(look.address, look.height, STILL, mirrored=right))


def _enemies() -> np.ndarray:
    """Extents of enemies by page and low byte of their picture, and by direction."""
    kinds = (_standing_extent, STANDING), (_fighting_extent, FIGHTING), (_floating_extent, FLOATING)
    by_address = {
        look.address & 256 * PAGES - 1: [extent(look, right=right) for right in SIDES]
        for extent, looks in kinds
        for look in looks
    }
    extents = [by_address.get(address, (0, 0)) for address in range(256 * PAGES)]
    return np.array(extents, np.int32).ravel()


POSE_EXTENTS = np.array(
    [
        _pose_extent(pose, right=right, shifted_right=shifted)
        for pose in range(Pose.IN_AIR + 1)
        for right in SIDES
        for shifted in SIDES
    ]
)
ENEMY_EXTENTS = _enemies()


def extent_box(
    extents: np.ndarray, index: jax.Array, x: Number, y: Number, **fields: Number
) -> Box:
    """Tight boxes of pictures; an unknown picture gives an invalid box.

    Args:
        extents: packed.
        index: of the pictures.
        x, y: the sprite's column, and the row of the pictures' lowest rows.
        fields: `valid` and others of the box.
    """
    packed = lookup(extents, index)
    left = x + (packed & 63) - LEFTMOST
    top = y + (packed >> 12 & 63) - FIGURE - 3
    return box(left, top, packed >> 6 & 63, packed >> 18 & 63, **fields)
