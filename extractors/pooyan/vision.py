"""How VEM finds what Pooyan draws: missiles by their shape, the rest by its place."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from ocjax._xla.kernels import materialize
from ocjax.console.boxes import WIDTH
from ocjax.extractors.pooyan.screen import (
    BALLOON_LINES,
    CLIFF_COLORS,
    CLIMBER_LEFTS,
    COLUMNS,
    FIRST_LINE,
    PIG_LEFT,
    PINK,
    PITCH,
    ROCK,
    ROCK_HEIGHT,
    ROCK_LEFTS,
    ROCK_WIDTH,
    ROWS,
    SKY,
    TOP_LINE,
    WHITE,
    WOLF,
    WOLF_WIDTH,
)
from ocjax.vision.bitmap import (
    Bitmap,
    all_within,
    any_within,
    areas,
    color_mask,
    shift_down,
    shift_left,
    shift_right,
    shift_up,
)
from ocjax.vision.filters import Searched
from ocjax.vision.rules import Blobs, Bounds
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Packed, SideBySide

SCENERY = (SKY, PINK, *CLIFF_COLORS)  # no stone has these colours
TOP = FIRST_LINE + PITCH * ROWS.start
BOTTOM = FIRST_LINE + PITCH * ROWS.stop
LEFT_FIELD = (0, TOP, 44, BOTTOM)  # left of balloons
SHOT_FIELD = (0, TOP, 138, BOTTOM)
STONE_FIELD = (44, TOP, WIDTH, BOTTOM)
PIG_FIELD = (PIG_LEFT, TOP, PIG_LEFT + 8, BOTTOM)
CLIMBER_FIELD = (CLIMBER_LEFTS[-1], TOP, CLIMBER_LEFTS[0] + WOLF_WIDTH, BOTTOM)
WOLF_FIELD = (0, TOP_LINE, WIDTH, 202)
NO_WOLVES = tuple(
    (left, TOP, right, BOTTOM)
    for left, right in ((0, 44), (52, 76), (84, 108), (116, 137), (153, WIDTH))
)
ROCK_TOP_FIELD = (0, TOP_LINE, WIDTH, TOP)
ROCK_FALL_FIELD = (ROCK_LEFTS[0], TOP, ROCK_LEFTS[1] + ROCK_WIDTH, BOTTOM)
CELLS = tuple(
    (x, FIRST_LINE + PITCH * row, x + 6, FIRST_LINE + PITCH * row + BALLOON_LINES)
    for row in ROWS
    for x in COLUMNS
)


def _balloon_pixels(mask: Bitmap, _: jax.Array) -> Bitmap:
    """Runs of three pixels and what is above and below them."""
    run = materialize(lambda m: any_within(all_within(m, 3, 1), 3, 1), mask)
    return run | (mask & (shift_up(run, 1) | shift_down(run, 1)))


class Missiles(NamedTuple):
    """Pixels that are found by their shape."""

    stones: Bitmap
    arrows: Bitmap


def _by_shape(planes: jax.Array) -> Missiles:
    """Lone squares of four pixels, and the first eight pixels of lone white runs."""
    drawn = ~color_mask(planes, SCENERY)
    corner = materialize(lambda m: all_within(m, 4, 4), drawn)
    start = materialize(_lone_starts, color_mask(planes, (WHITE,)))
    return Missiles(
        any_within(materialize(_lone_corners, corner, drawn), 4, 4), any_within(start, 8, 1)
    )


def _lone_corners(corner: Bitmap, drawn: Bitmap) -> Bitmap:
    """Those of squares that nothing is above or below."""
    free = all_within(~drawn, 4, 1)
    beside = shift_left(corner, 1) | shift_right(corner, 1)
    return corner & shift_down(free, 1) & shift_up(free, 4) & ~beside


def _lone_starts(mask: Bitmap) -> Bitmap:
    """The first pixels of runs of eight pixels and more that nothing is above or below."""
    run = all_within(mask, 8, 1)
    below = shift_up(shift_left(all_within(mask, 6, 1), 1), 1)
    return run & ~shift_right(mask, 1) & ~below & ~shift_down(run, 1)


def _pig_pixels(mask: Bitmap, missiles: Missiles) -> Bitmap:
    meat = any_within(materialize(lambda m: all_within(m, 8, 2), mask), 8, 2)
    return mask & ~(meat | missiles.stones | missiles.arrows)


def _arrow_pixels(mask: Bitmap, missiles: Missiles) -> Bitmap:
    """Left of balloons, all pixels are the arrow's."""
    return missiles.arrows | (mask & jnp.asarray(areas(mask.shape[1], [LEFT_FIELD])))


def _bait_pixels(mask: Bitmap, _: jax.Array) -> Bitmap:
    """The first eight pixels of runs of at least as many, in two rows or more."""
    start = materialize(lambda m: all_within(m, 8, 2) & ~shift_right(m, 1), mask)
    return any_within(start, 8, 2)


def _stone_pixels(_: Bitmap, missiles: Missiles) -> Bitmap:
    return missiles.stones


def _wolf_pixels(mask: Bitmap, missiles: Missiles) -> Bitmap:
    """All but stones in front of the climber."""
    return mask & ~(missiles.stones & jnp.asarray(areas(mask.shape[1], (CLIMBER_FIELD,))))


def _rock_pixels(mask: Bitmap, missiles: Missiles) -> Bitmap:
    """What is where the rock may be, without stones that have its colour."""
    here = jnp.asarray(areas(mask.shape[1], (ROCK_TOP_FIELD, ROCK_FALL_FIELD)))
    return mask & here & ~missiles.stones


PIG = Bounds((WHITE, PINK), PIG_FIELD, filters=(Searched(_by_shape, _pig_pixels),))
BALLOON = Bounds(
    (SKY, WOLF), CELLS, (6, 7), inverse=True, filters=(_balloon_pixels,), then=(Packed(),)
)
WOLVES_RULE = Blobs(
    WOLF,
    WOLF_FIELD,
    Shape(w=(3, 6 * WOLF_WIDTH), h=(6, 15)),
    gap=(1, 1),
    filters=(Searched(_by_shape, _wolf_pixels),),
    ignore=NO_WOLVES,
    then=(SideBySide(WOLF_WIDTH),),
)
ARROW = Bounds(WHITE, SHOT_FIELD, max_size=(8, 2), filters=(Searched(_by_shape, _arrow_pixels),))
BAIT = Bounds((WHITE, PINK), SHOT_FIELD, filters=(_bait_pixels,))
STONE = Bounds(SCENERY, STONE_FIELD, inverse=True, filters=(Searched(_by_shape, _stone_pixels),))
ROCK_RULE = Bounds(
    ROCK,
    (0, TOP_LINE, WIDTH, BOTTOM),
    (8, 4),  # the pig covers a part
    (ROCK_WIDTH, ROCK_HEIGHT),
    filters=(Searched(_by_shape, _rock_pixels),),
)
