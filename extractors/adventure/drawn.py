"""Adventure's screen as it was drawn.

A turn of the game takes three frames, which show the same two things. If the room has more things,
other things have the next turn. The game copies the shown things first, so only the player's motion
must be reverted. He moves before the first frame. If he ran into something, he goes back and tries
to move up or down before the second frame, and to the side before the third.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from ocjax.authoring import lookup, match, when
from ocjax.extractors.adventure import rooms
from ocjax.extractors.adventure.pictures import FIRST_ADDRESS, ROW_LINES, row_count
from ocjax.extractors.adventure.ram import ENTRY_BYTES, Mouth, Push, Ram, Shown, Thing, Wait

THING_LINE = 238  # line of a thing's first row at `y` 0; `y` counts pairs of lines upwards
PLAYER_LINE = 230  # the same for the player; his collisions use it, too
TOP_Y = 0x69  # things further up are moved down to it
SECOND_TOP_Y = 0x68  # the same for the second thing

STRIDE = 4
LEAST_X = 3  # the player's `x` in a room
MOST_X = 0x9E
WRAPPED = 0xF0  # least `x` that is negative
TO_X = 2  # columns from the player's left edge to his `x`
PLAYER_LINES = 8
PLAYER_WALLS = 0xF0  # the first four of eight columns of `walls_at`
REACH = 6  # columns between the middles of the player and a thing that he runs into


class Sprite(NamedTuple):
    """One of the two drawn things."""

    x: jax.Array
    y: jax.Array
    picture: jax.Array  # index in PICTURE_ROWS
    rows: jax.Array
    solid: jax.Array  # a thing of usual width


class Drawn(NamedTuple):
    """The state that the game drew."""

    room: jax.Array
    dark: jax.Array
    color: jax.Array  # of walls and player
    x: jax.Array  # of the player
    y: jax.Array
    first: Sprite
    second: Sprite


def as_drawn(m: Ram) -> Drawn:
    """The room on the screen, and the positions of the player and two things in it."""
    room = _room_shown(m)
    y = PLAYER_LINE - 2 * m.drawn_y
    first = _sprite_of(m.first, m.first_x, jnp.minimum(m.first_y, TOP_Y), m.first_address)
    second_y = jnp.minimum(m.second_y, SECOND_TOP_Y)
    second = _sprite_of(m.second, m.second_x, second_y, m.second_address)
    return Drawn(
        room=room,
        dark=rooms.hides_things(room),
        color=lookup(rooms.COLORS, room),
        x=_player_x(m, room, y, (first, second)) - TO_X,
        y=y,
        first=first,
        second=second,
    )


def _room_shown(m: Ram) -> jax.Array:
    """The room on the screen: the last one if the player has left it since."""
    is_drawn = lookup(rooms.ADDRESSES & 0xFFF, m.room) == m.walls_address & 0xFFF
    room = jnp.where((m.wait == Wait.THIRD) | ~is_drawn, m.last_room, m.room)
    return jnp.minimum(room, rooms.ROOMS - 1)


def _sprite_of(entry: jax.Array, x: jax.Array, y: jax.Array, address: jax.Array) -> Sprite:
    picture = address - FIRST_ADDRESS
    is_light = entry == Shown.LIGHT
    is_bridge = entry == ENTRY_BYTES * (Thing.BRIDGE + 1)
    top = THING_LINE - ROW_LINES * y
    return Sprite(x - 1, top, picture, row_count(picture), ~(is_light | is_bridge))


def _player_x(m: Ram, room: jax.Array, y: jax.Array, sprites: tuple[Sprite, Sprite]) -> jax.Array:
    """The `x` at which the game drew the player."""
    is_eaten = (m.dragon[1] == Mouth.FULL) | (m.dragon[2] == Mouth.FULL)  # by yellow, by green
    tried_x, tried_y = _tried(m, y)
    blocked_aside = _is_blocked(room, tried_x, y, sprites)
    in_corner = blocked_aside & _is_blocked(room, m.last_x, tried_y, sprites)
    is_third = m.wait == Wait.THIRD
    return match(
        ((m.wait == Wait.FIRST) | (is_third & (is_eaten | in_corner)), _in_next_room(tried_x)),
        (is_third, m.last_x),
        otherwise=m.x,
    )


def _tried(m: Ram, y: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The player's `x` and the line of his first row after a push of the stick."""
    right = (m.stick & Push.RIGHT) == 0
    left = (m.stick & Push.LEFT) == 0
    up = (m.stick & Push.UP) == 0
    down = (m.stick & Push.DOWN) == 0
    x = m.last_x + when(right, STRIDE) - when(left, STRIDE)
    return x, y - when(up, 2 * STRIDE) + when(down, 2 * STRIDE)


def _in_next_room(x: jax.Array) -> jax.Array:
    """The player's `x` in the next room, if he left this one at a side."""
    return match(((x < LEAST_X) | (x >= WRAPPED), MOST_X), (x > MOST_X, LEAST_X), otherwise=x)


def _is_blocked(
    room: jax.Array, x: jax.Array, y: jax.Array, sprites: tuple[Sprite, Sprite]
) -> jax.Array:
    """True if the player runs into a wall or a thing there."""
    upper = rooms.walls_at(room, rooms.row_of(y), x - TO_X)
    lower = rooms.walls_at(room, rooms.row_of(y + PLAYER_LINES - 1), x - TO_X)
    in_wall = ((upper | lower) & PLAYER_WALLS) > 0
    return in_wall | _touches(x, y, sprites[0]) | _touches(x, y, sprites[1])


def _touches(x: jax.Array, y: jax.Array, sprite: Sprite) -> jax.Array:
    """True if the player would touch a thing with his left edge at `x` - TO_X."""
    is_near = abs(x - sprite.x - 4) < REACH
    is_below = y < sprite.y + ROW_LINES * sprite.rows
    return sprite.solid & is_near & (y + PLAYER_LINES > sprite.y) & is_below
