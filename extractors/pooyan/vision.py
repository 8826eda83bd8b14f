"""VEM's rules for Pooyan: missiles by their shape, other objects by their position."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from ocjax.authoring import (
    WIDTH,
    Bitmap,
    Blobs,
    Bounds,
    Packed,
    Searched,
    Shape,
    SideBySide,
    all_within,
    any_within,
    areas,
    color_mask,
    materialize,
    shift_down,
    shift_left,
    shift_right,
    shift_up,
)
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

SCENERY = (SKY, PINK, *CLIFF_COLORS)  # no stone has these colours
TOP = FIRST_LINE + PITCH * ROWS.start
BOTTOM = FIRST_LINE + PITCH * ROWS.stop
FIRST = TOP - 4  # rows of the search for shapes: a stone's rows extend beyond the lift's
END = BOTTOM + 4
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


def _in_lift(bitmap: Bitmap) -> Bitmap:
    """The lift's rows, and the rows around them that shapes depend on."""
    return bitmap[..., FIRST:END, :]


def _on_screen(pixels: Bitmap, like: Bitmap) -> Bitmap:
    """Pixels of the lift's rows, in their rows of the screen."""
    return jnp.pad(pixels, ((0, 0), (FIRST, like.shape[1] - END), (0, 0)))


def _balloon_pixels(mask: Bitmap, _: jax.Array) -> Bitmap:
    """Runs of three pixels, and the pixels above and below them."""
    own = _in_lift(mask)
    run = materialize(lambda m: any_within(all_within(m, 3, 1), 3, 1), own)
    return _on_screen(run | (own & (shift_up(run, 1) | shift_down(run, 1))), mask)


class Missiles(NamedTuple):
    """Pixels of missiles found by their shape, in the lift's rows."""

    stones: Bitmap
    arrows: Bitmap


def _by_shape(planes: jax.Array) -> Missiles:
    """Lone squares of four pixels, and the first eight pixels of lone white runs."""
    drawn = materialize(lambda p: ~color_mask(_in_lift(p), SCENERY), planes)
    shots = materialize(lambda p: color_mask(_in_lift(p), (WHITE,)), planes)
    corner = materialize(_lone_corners, *materialize(_fours, drawn))
    start = materialize(_lone_starts, shots, *materialize(_runs, shots))
    return Missiles(
        materialize(lambda c: any_within(c, 4, 4), corner),
        materialize(lambda s: any_within(s, 8, 1), start),
    )


def _fours(drawn: Bitmap) -> tuple[Bitmap, Bitmap]:
    """The first pixels of runs of four drawn pixels, and of four other pixels."""
    return all_within(drawn, 4, 1), all_within(~drawn, 4, 1)


def _lone_corners(drawn: Bitmap, free: Bitmap) -> Bitmap:
    """The corners of squares without neighbors above and below."""
    corner = all_within(drawn, 1, 4)
    beside = shift_left(corner, 1) | shift_right(corner, 1)
    return corner & shift_down(free, 1) & shift_up(free, 4) & ~beside


def _runs(mask: Bitmap) -> tuple[Bitmap, Bitmap]:
    """The first pixels of runs of eight pixels, and the pixels before runs of six."""
    return all_within(mask, 8, 1), shift_left(all_within(mask, 6, 1), 1)


def _lone_starts(mask: Bitmap, run: Bitmap, six: Bitmap) -> Bitmap:
    """The first pixels of runs of at least eight pixels, without runs above and below."""
    return run & ~shift_right(mask, 1) & ~shift_up(six, 1) & ~shift_down(run, 1)


def _meat_corners(mask: Bitmap) -> Bitmap:
    """The corners of 8 x 2 pixels in the lift's rows."""
    return all_within(_in_lift(mask), 8, 2)


def _pig_pixels(mask: Bitmap, missiles: Missiles) -> Bitmap:
    meat = any_within(materialize(_meat_corners, mask), 8, 2)
    return mask & ~_on_screen(meat | missiles.stones | missiles.arrows, mask)


def _arrow_pixels(mask: Bitmap, missiles: Missiles) -> Bitmap:
    """The arrow's pixels; left of the balloons, all pixels are the arrow's."""
    left = mask & jnp.asarray(areas(mask.shape[1], [LEFT_FIELD]))
    return _on_screen(missiles.arrows, mask) | left


def _bait_pixels(mask: Bitmap, _: jax.Array) -> Bitmap:
    """The first eight pixels of runs of at least eight pixels, in at least two rows."""
    start = materialize(lambda m: _meat_corners(m) & ~shift_right(_in_lift(m), 1), mask)
    return _on_screen(any_within(start, 8, 2), mask)


def _stone_pixels(mask: Bitmap, missiles: Missiles) -> Bitmap:
    return _on_screen(missiles.stones, mask)


def _wolf_pixels(mask: Bitmap, missiles: Missiles) -> Bitmap:
    """All pixels except stones in front of the climber."""
    here = jnp.asarray(areas(mask.shape[1], (CLIMBER_FIELD,)))
    return mask & ~(_on_screen(missiles.stones, mask) & here)


def _rock_pixels(mask: Bitmap, missiles: Missiles) -> Bitmap:
    """Pixels in the rock's possible areas, without stones of its colour."""
    here = jnp.asarray(areas(mask.shape[1], (ROCK_TOP_FIELD, ROCK_FALL_FIELD)))
    return mask & here & ~_on_screen(missiles.stones, mask)


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
