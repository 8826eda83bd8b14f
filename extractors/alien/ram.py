"""Alien's RAM."""

import jax
from ocjax.authoring import RamMap, Rom, bits, byte

ROM = Rom("alien", "f1a0a23e6464d954e3a9579c4ccd01c8")
NOT_DRAWN = 96  # `line` while the game prepares a frame
DRAWN = 255  # `line` after the drawing
LONGEST_PAUSE = 30


class Scene:  # of `Ram.scene`
    MAZE = 0
    BONUS = 2
    BONUS_MOVES = 3  # the bonus screen in motion


class Way:  # of `Ram.ways`
    UP = 1
    DOWN = 3


class Figure:  # a record of `Ram.colors` and `Ram.dying`; aliens come first
    PLAYER = 3
    PULSAR = 4
    ROCKET = 5


class Ram(RamMap):
    scene = bits(0, first=4, count=2)
    digits = byte(3, 5, 7, 9, 11, 13)  # 8 * digit
    old_y = byte(10)  # the player's y + 2 in most frames
    line = byte(15)  # counts down in the drawing of the maze
    ways = bits(33, 34, count=2)  # of the pink alien and the player
    speeds = bits(33, 34, first=2, count=6)
    pictures = byte(35, 36, 37)  # of the aliens
    alien_y = byte(42, 43, 44)  # y = 196 - 2 * these; 0: absent
    y = byte(45)  # of the player, y = 197 - 2 * this
    pulsar_y = byte(46)  # of pulsar or flame, y = 197 - 2 * this; 0: absent
    rocket_y = byte(47)  # y = 197 - 2 * this; 0: absent
    pulsar_x = byte(53)  # of pulsar or flame
    # The chip's columns of the three aliens, the player, pulsar or flame, and the rocket.
    coarse = bits(55, 56, 57, 58, 59, 60, first=0, count=3)
    turned = bits(55, 56, 57, 58, 59, first=3)  # drawn mirrored
    fine = bits(55, 56, 57, 58, 59, 60, first=4, count=4)
    frame = byte(62)
    lives = byte(64)
    eggs = byte(*range(65, 91))  # left half, right half
    rows = byte(*range(66, 72))  # bonus screen: positions of its six pairs of aliens
    prize = byte(73)  # bonus screen: its picture; 0 after the player took it
    eaten = byte(91)  # eggs taken in this maze
    state = byte(96)
    carried = byte(100, 101)  # sums of the speeds
    dying = byte(102)  # record that dies during a pause
    pulsars = byte(103)  # left
    pause = byte(106)
    colors = byte(*range(117, 124))  # of the figures, aliens first, and of the display


def is_bonus(m: Ram) -> jax.Array:
    return (m.scene == Scene.BONUS) | (m.scene == Scene.BONUS_MOVES)


def is_next_frame(m: Ram) -> jax.Array:
    """True if the RAM belongs to the next frame, which is not on the screen yet."""
    return m.line == NOT_DRAWN


def is_rolled(m: Ram) -> jax.Array:
    """True for the first frame of a life, which the emulator shows 39 rows too high."""
    starts = (m.pause == LONGEST_PAUSE) & (m.dying == Figure.PULSAR)
    return starts & (m.line == DRAWN) & (m.scene == Scene.MAZE)
