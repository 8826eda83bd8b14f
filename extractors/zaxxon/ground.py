"""The ground of Zaxxon in rows of playfield that come nearer: floor, walls and barriers."""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import WIDTH as SCREEN_WIDTH, Box, edges, extremes, lookup, pick
from ocjax.extractors.zaxxon.drawn import Drawn, ground_edges
from ocjax.extractors.zaxxon.ram import ROM, Color, Ram

GROUND_LEFT = 16
EMPTY = 80  # first column of a row without dots


def _first_columns() -> np.ndarray:
    """The first column of each row shape, int32 `[256]`; `EMPTY` if it has no dots."""
    outer = ROM.bytes(0xB00, 256)
    inner = ROM.bytes(0xC00, 256)
    dots = np.concatenate(
        [outer[:, None] >> np.arange(7, -1, -1), inner[:, None] >> np.arange(8)], 1
    )
    shown = (dots & 1) == 1
    return np.where(shown.any(1), GROUND_LEFT + 4 * shown.argmax(1), EMPTY)


SHAPE_LEFTS = _first_columns()
BARRIER_SHAPES = ROM.bytes(0xBD1, 4, 4).tolist()  # of the four alternating barriers


def lefts_of(shapes: jax.Array) -> jax.Array:
    """The first columns of rows of the ground."""
    return lookup(SHAPE_LEFTS, shapes & 255)


def _box_of_rows(m: Ram, d: Drawn, shapes: jax.Array, color: int) -> Box:
    """The box of the ground's rows of a color, which are symmetric; invalid without a dot."""
    tops, bottoms = ground_edges(m, d)
    lefts = lefts_of(shapes)
    shown = (d.colors == color) & (lefts < EMPTY) & (tops < bottoms) & ~d.space
    left, _ = extremes(shown, lefts, 0)
    top, bottom = extremes(shown, tops, bottoms)
    return edges(left, top, SCREEN_WIDTH - left, bottom, jnp.any(shown))


def wall_box(m: Ram, d: Drawn) -> Box:
    return _box_of_rows(m, d, d.shapes, Color.WALL)


def barrier_box(m: Ram, d: Drawn) -> Box:
    """Posts that change their positions; each is drawn on one of four frames."""
    turn = (m.clock >> 2) & 3
    shapes = d.shapes + m.barrier_shape + 1 + pick(turn, BARRIER_SHAPES)
    return _box_of_rows(m, d, shapes, Color.BARRIER).where(m.level > 0)
