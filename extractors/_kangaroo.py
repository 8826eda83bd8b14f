"""Kangaroo's RAM, and where the player was drawn.

The game moves the player after it has drawn the frame, so the RAM is a step ahead of the screen.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from ocjax.console.ops import among, match, when
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.rom import Rom

ROM = Rom("kangaroo", "4326edb70ff20d0ee5ba58fa5cb09d60")
LAST_X = 121  # of the player
EMPTY = 128  # from here on, bytes stand for no object
RELEASED = 128  # from here on, `fire` is not pressed


class Pose:  # of `Ram.pose`: a picture and bits
    STANDING = 0
    CROUCHED = 20
    PUNCHING = 134
    STRIDES = 1  # bit
    RIGHT = 8  # bit
    JUMPS = 64  # from here on
    PUNCHES = 128  # from here on


class Timer:  # of `Ram.timer`
    BEGINS = 1  # a jump or a crouch
    PUNCHES = 13  # a punch begins
    TURNS = 4  # a player who dies
    RISES = (8, 24)  # a jump
    FALLS = (32, 40)
    TUCKS = 16
    UNTUCKS = 24


class Scene:  # of `Ram.scene`
    DYING = 1
    PUNCHED = 2  # until the button is released
    FOUND = 64  # bit: the player has come to the child


class Ram(RamMap):
    monkey_picture = byte(0, 1, 2, 3)  # low byte of its address
    monkey_state = byte(4, 5, 6, 7)
    monkey_row = byte(8, 9, 10, 11)
    monkey_x = byte(12, 13, 14, 15)  # x + 15
    row = byte(16)  # of the player's top
    x = byte(17)  # x - 15
    pose = byte(18)
    timer = byte(19)  # of the pose
    thrown_state = byte(21, 22, 23)
    thrown_row = byte(25, 26, 27)
    thrown_x = byte(28, 29, 30)  # x - 14
    falling_row = byte(33)  # counts the rows of all levels
    falling_x = byte(34)  # x - 14
    level = byte(36)
    score = bcd((39, 40))  # hundreds
    bell = byte(41)
    fruits = byte(42, 43, 44)
    lives = byte(45)
    scene = byte(54)
    clock = byte(57)
    tens = bits(59, first=4, count=4)  # of the time in hundreds
    ones = bits(59, count=4)
    third = byte(60)  # 0-2; the player steps at 0
    fire = byte(124)


class Drawn(NamedTuple):
    """The player before her last step."""

    x: jax.Array
    row: jax.Array
    pose: jax.Array


def player_drawn(m: Ram) -> Drawn:
    pose = _pose_drawn(m)
    strides = _walks(m) & (((m.pose | pose) & Pose.STRIDES) > 0)
    stepped = strides & (m.third == 0) & (m.x != 1) & (m.x != LAST_X) & (m.scene != Scene.DYING)
    step = when(stepped, jnp.where((m.pose & Pose.RIGHT) > 0, 1, -1))
    acts = m.scene < EMPTY
    return Drawn(
        x=m.x - when(acts, step),
        row=m.row - when(acts, _rows_down(m)),
        pose=jnp.where(acts, pose, m.pose),
    )


def _jumps(m: Ram) -> jax.Array:
    return (m.pose >= Pose.JUMPS) & (m.pose < Pose.PUNCHES)


def _crouches(m: Ram) -> jax.Array:
    return (m.pose & ~Pose.RIGHT) == Pose.CROUCHED


def _walks(m: Ram) -> jax.Array:
    return (m.pose & ~(Pose.RIGHT | Pose.STRIDES)) == Pose.STANDING


def _turns(m: Ram) -> jax.Array:
    """Whether the player turns round as she dies."""
    return (m.scene == Scene.DYING) & (m.timer == Timer.TURNS)


def _rows_down(m: Ram) -> jax.Array:
    """Rows by which the step has moved the player down: a jump goes up and down by its timer."""
    rose = _jumps(m) & among(m.timer, Timer.RISES)
    fell = _jumps(m) & among(m.timer, Timer.FALLS)
    fell = fell | (_crouches(m) & (m.timer == Timer.BEGINS)) | _turns(m)
    return when(fell, 1) - when(rose, 1)


def _pose_drawn(m: Ram) -> jax.Array:
    """The pose before the step.

    A punch has just ended if the game has not yet noticed that the button is released.
    """
    still = m.pose & Pose.RIGHT
    starts = (_jumps(m) | _crouches(m)) & (m.timer == Timer.BEGINS)
    began = starts | ((m.pose >= Pose.PUNCHES) & (m.timer == Timer.PUNCHES))
    released = (m.scene == Scene.PUNCHED) & (m.fire >= RELEASED)
    return match(
        (_turns(m), m.pose ^ Pose.RIGHT),
        (began, still),
        ((m.pose == still) & released & ((m.clock & 1) == 1), still | Pose.PUNCHING),
        (_jumps(m) & (m.timer == Timer.TUCKS), m.pose - 1),
        (_jumps(m) & (m.timer == Timer.UNTUCKS), m.pose + 1),
        (_walks(m) & ((m.clock & 7) == 0), m.pose ^ Pose.STRIDES),
        otherwise=m.pose,
    )
