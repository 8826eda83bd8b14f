"""Solaris' ship and its two shots. One sprite draws them on separate lines."""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Box, Pictures, box, match, signed_nibble, when
from ocjax.extractors.solaris.ram import ROM, Ram, ShipPicture

FIRST_Y = 171  # of the ship on the screen, plus its `ship_y`
SHIP_HEIGHT = 9  # without the flames
LEVEL_WIDTH = 11
BANKED_WIDTH = 9
COLOR_IN_SPACE = 120
COLOR_OVER_PLANET = 40
COLOR_ROW = 6  # row of the ship's box with its colour
MADE_WITHOUT_SHIP = 0xD7  # `ship_pointer` derived without a ship: a new ship is not drawn yet

SHOT_FIRST_Y = 170  # of a shot on the screen, plus its `shot_y`
SHOT_ADDRESSES = (0x8E, 0x96, 0x9D, 0xA3, 0xA8, 0x99, 0xA6)  # low bytes, of pictures
SHOT_PAGE = 0x2500  # in the ROM
SPENT = 128  # least `shot_depth` without a shot

MOST_LEFT = 0x2D  # `ship_x` at which the ship flies no further
MOST_RIGHT = 0x73
LEFTWARDS = 128  # least `ship_speed` to the left
A_COLUMN = 256  # of `ship_part`


def ship_box(m: Ram) -> Box:
    """The ship without its flames."""
    is_level = m.ship_picture == ShipPicture.LEVEL
    x = sprite_column(m.ship_at) - when(m.ship_picture == ShipPicture.BANKED_RIGHT, 1)
    width = jnp.where(is_level, LEVEL_WIDTH, BANKED_WIDTH)
    color = jnp.where(m.on_planet == 1, COLOR_OVER_PLANET, COLOR_IN_SPACE)
    is_drawn = m.ship_pointer != MADE_WITHOUT_SHIP
    there = (m.ship_y > 0) & is_drawn & (m.departs == 0) & m.flies
    return box(x, FIRST_Y - m.ship_y, width, SHIP_HEIGHT, there, color=color)


def shot_boxes(m: Ram) -> Box:
    """The complete pictures of the shots; the RAM does not record their drawn dots."""
    x = sprite_column(m.shot_at)
    y = SHOT_FIRST_Y - m.shot_y
    return SHOTS.box(m.shot_picture, x, y, valid=(m.shot_depth < SPENT) & m.flies)


def _shot_pictures() -> Pictures:
    """The shots by the low byte of their address; the game draws from there up to an empty row."""
    return Pictures.of([_shot_rows(low) for low in range(256)])


def _shot_rows(low: int) -> np.ndarray:
    """The rows of a shot, or an empty one."""
    if low not in SHOT_ADDRESSES:
        return np.zeros(1, int)
    first = SHOT_PAGE + low - 2
    height = next(row for row in range(256) if not ROM.data[first - row])
    return ROM.rows(first - height + 1, height)


def sprite_column(code: jax.Array) -> jax.Array:
    """Column of the ship's sprite from its code; the move in the code counts twice."""
    return 54 + 27 * (code >> 1 & 7) + 3 * (code & 1) - 2 * signed_nibble(code >> 4)


def ship_column(m: Ram) -> jax.Array:
    """The `ship_x` of the frame, before the ship has moved on."""
    to_middle = match(
        (m.ship_picture == ShipPicture.LEVEL, 3),
        (m.ship_picture == ShipPicture.BANKED_RIGHT, 1),
        otherwise=2,
    )
    stands = (m.jumps | m.on_chart | m.sleeps | m.waits | m.departs) == 1
    return match(
        (stands, m.ship_x),
        (m.heads_out, m.ship_x - _columns_moved(m)),
        otherwise=sprite_column(m.ship_at) + to_middle,
    )


def _columns_moved(m: Ram) -> jax.Array:
    """Columns that the ship has moved to the right since the frame was drawn ($FBEC of bank 2)."""
    step = m.ship_speed << 3 & A_COLUMN - 1
    is_leftwards = m.ship_speed >= LEFTWARDS
    stopped = jnp.where(is_leftwards, m.ship_x <= MOST_LEFT, m.ship_x >= MOST_RIGHT)
    moved = when(m.ship_part < step, 1) - when(is_leftwards, 1)
    return jnp.where(stopped, 0, moved)


SHOTS = _shot_pictures()
