"""Venture's scene on the screen: a hall, or a room, and its fixed parts.

The last frame of a scene is older than the RAM, which already has the next scene.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from ocjax.authoring import among, pick, reached, when
from ocjax.extractors.venture.ram import PAUSED, Ram, Room

START_X = 68  # `dot_x` at the start of a hall
START_Y = 76
ALL_ICONS = 3
BEGINS = 64  # `pause` on the last frame of the scene before
FIRST_SPLIT = 40  # `split` in the first hall
SECOND_SPLIT = 38
SPLITS = (FIRST_SPLIT, SECOND_SPLIT)
DOORS = (2, 4, 8)  # `door` of a hall's rooms except the first one
ROOMS_BEFORE = 4  # first number of the second hall's rooms
FIRST_COLOR = 84  # of the walls in the first hall and its rooms
SECOND_COLOR = 148
WALL_COLORS = (FIRST_COLOR, SECOND_COLOR)
WALL_TOP = 24  # of a room's upper wall
WALL_BOTTOM = 28


class Scene(NamedTuple):
    """The scene that is on the screen."""

    is_old: jax.Array  # whether the RAM already has the next scene
    is_left: jax.Array  # whether it is an old room, which he has left
    is_hall: jax.Array  # whether it is a hall, and current
    is_room: jax.Array  # whether it is a room, and current
    number: jax.Array  # of the room
    is_second: jax.Array  # whether it is the second hall (with blue walls) or one of its rooms
    color: jax.Array  # of the walls


def shown_scene(m: Ram) -> Scene:
    """The RAM's scene, or the one before."""
    game_begins = is_at_start(m) & (m.icons == ALL_ICONS)  # without a scene before
    is_old = (m.pause == BEGINS) & (m.flags >= PAUSED) & ~game_begins
    in_hall = among(m.room, Room.HALLS)
    is_left = is_old & in_hall & ~among(m.split, SPLITS)
    by_door = when(m.room == Room.SECOND_HALL, ROOMS_BEFORE) + reached(m.door, DOORS)
    was_second = jnp.where(is_left, _is_beyond(by_door), m.split == SECOND_SPLIT)
    is_second = jnp.where(is_old, was_second, (m.room == Room.SECOND_HALL) | _is_beyond(m.room))
    return Scene(
        is_old=is_old,
        is_left=is_left,
        is_hall=~is_old & in_hall,
        is_room=~is_old & ~in_hall,
        number=jnp.where(is_left, by_door, m.room),
        is_second=is_second,
        color=jnp.where(is_second, SECOND_COLOR, FIRST_COLOR),
    )


def is_at_start(m: Ram) -> jax.Array:
    """True if he is at his start in a hall."""
    return (m.dot_x == START_X) & (m.dot_y == START_Y)


def _is_beyond(room: jax.Array) -> jax.Array:
    return among(room, Room.BEYOND_SECOND_HALL)


class Plan(NamedTuple):
    """The fixed parts of a room."""

    wall_x: int | jax.Array  # of the upper wall
    wall_width: int | jax.Array
    x: int | jax.Array  # of the treasure
    y: int | jax.Array
    width: int | jax.Array
    height: int | jax.Array


# fmt: off
PLANS = (
    #  wall:      treasure:
    #  x  width     x    y width height
    Plan(44, 100,  24, 163, 8, 16),  # room 0
    Plan(16, 100,  24, 163, 8, 12),
    Plan(16, 128, 114, 163, 7, 14),
    Plan(28, 104,  77, 102, 7, 12),
    Plan(16, 128,  80, 163, 8, 16),
    Plan(16, 128, 120,  33, 8, 14),
    Plan(64,  32,  70,  33, 8, 10),
    Plan(64,  32,  80,  67, 8,  6),  # room 7
)


class Mapped(NamedTuple):
    """A room on the map of a hall."""

    x: int
    y: int
    width: int
    height: int


FIRST_MAP = (
    Mapped(20,  36, 32, 48),  # room 0
    Mapped(88,  32, 52, 56),
    Mapped(16,  96, 48, 68),
    Mapped(92, 100, 52, 68),
)
SECOND_MAP = (
    Mapped(16,  32,  48, 56),  # room 4
    Mapped(84,  32,  60, 48),
    Mapped(56,  64,  52, 48),
    Mapped(16, 120, 128, 52),
)
# fmt: on


def room_plan(scene: Scene) -> Plan:
    """The fixed parts of the room on the screen."""
    return Plan(*(pick(scene.number, column) for column in zip(*PLANS, strict=True)))
