"""Berzerk's RAM and the meaning of its values."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import RamMap, Rom, among, bcd, byte, flag, when

ROM = Rom("berzerk", "136f75c4dd02c29283752b7e5799f978")
APPEARED = 255  # `appearing` of a complete room
NO_ROBOT = 127  # `robot_y` of an absent robot; all later slots are empty, too
TOP_ROW = 5  # `robot_y` of robots at the start
SECOND_ROW = range(15, 22)  # with a few steps down


class State:  # of `Ram.state`
    IN_ROOM = 2
    LEAVES = 255


class Frame:  # of `Ram.frame`
    LAST = 1  # the human has left the room, but it is still on the screen
    ROOM_BEGINS = 53  # the first frame of a room, still without figures


class Shut:  # of `Ram.door`
    TOP = 0
    BOTTOM = 1


class Exit:  # of `Ram.exit`
    TOP = 0
    BOTTOM = 1


class Missile:  # other values of `Ram.missile_way` than bits of ways
    NONE = 0
    NONE_YET = 15


class Way:  # bits of `Ram.way`, `shot_way` and `missile_way`
    UP = 1
    DOWN = 2
    LEFT = 4
    RIGHT = 8
    VERTICAL = UP | DOWN


class Pose:  # of `Ram.pose`: 0 to 2 walk
    HIT = 3  # least pose of a hit human
    SHOCK = 6  # least pose that alternates with a shock


class RobotPose:  # of `Ram.robot_pose`
    TALL = (15, 17, 20, 22)  # of explosions
    SPARK = 23  # the end of an explosion


class Ram(RamMap):
    state = byte(1)
    maze = byte(2)
    frame = byte(4)
    figure = byte(9)  # low byte of its address, minus the row on the screen
    y = byte(11)  # y - 5, already moved on
    figure_row = byte(12)
    way = byte(14)
    pose = byte(17)  # counts up after a hit
    pace = byte(18)  # an overflow is a step
    x = byte(19)  # of the sprite - 3, already moved on
    shot = byte(20)  # in flight
    shot_way = byte(21)
    shot_x = byte(22)  # x - 2, already moved on
    shot_y = byte(23)  # (y - 1) / 2, already moved on
    missile_way = byte(26)
    missile_pause = byte(27)  # 0 or 255: no shot flies
    missile_wait = byte(28)  # counts up before the first shot
    missile_x = byte(29)  # x - 2
    missile_y = byte(30)  # y / 2
    otto_x = byte(46)  # x - 3
    scrolled = byte(38)  # pairs of lines that scrolling has emptied at the top, already moved on
    robot_y = byte(*range(56, 64))  # (y - 4) / 2
    robot_x = byte(*range(65, 73))  # x - 6
    otto_low = byte(72)  # lowest position of his bounce
    scroll_end = byte(80)  # first pair of lines that scrolling has emptied at the bottom
    robot_pose = byte(*range(82, 90))
    otto_y = byte(89)  # y - 3
    lives = byte(90)  # without the last life
    is_over = flag(90, bit=7)
    killed = byte(91)
    level = byte(92)
    score = bcd((93, 94, 95))
    sides = byte(97)  # 0: the side exits are open, else both are shut
    door = byte(98)  # the exit behind the human, which is shut, see `Shut`
    appearing = byte(101)  # visible part of the room
    exit = byte(102)  # while the room scrolls: by which the human has left
    glyph = byte(106, 108, 110, 112, 114, 116)  # in the line below, low bytes of addresses
    otto = byte(118)
    shot_sound = byte(119)
    otto_way = byte(121)


class RobotRows(NamedTuple):
    """The rows of the robots on the screen."""

    y: jax.Array  # as `Ram.robot_y`
    valid: jax.Array


def on_last_frame(m: Ram) -> jax.Array:
    """True if the human has left the room, but it is still on the screen."""
    return (m.state == State.LEAVES) & (m.frame == Frame.LAST) & (m.appearing == APPEARED)


def rows_of_robots(m: Ram) -> RobotRows:
    """The rows of all robots. After the human has left the room, the row of the first is cleared.

    It is known if the second one is in the second row: they start one per row, and are sorted.
    """
    left = on_last_frame(m)
    number = np.arange(8)
    first = when(left & ~among(m.robot_y[1], SECOND_ROW), 1)
    row = jnp.where(left & (number == 0), TOP_ROW, m.robot_y)
    count = jnp.min(jnp.where(row == NO_ROBOT, number, 8))
    return RobotRows(row, jnp.asarray(number >= first) & (number < count))
