"""Amidar's RAM."""

import jax
from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag

ROM = Rom("amidar", "acb7750b4d0c4bd34969802a7deb2990")

UNSORTED = 2  # `player` on the frame on which all records have been reset
LONGEST_WAIT = 255


class Ram(RamMap):
    frames = byte(0)  # since the reset
    frame = bits(0, count=2)
    painted = byte(*range(6, 50))  # 4 bytes for each of 11 lines and bands, from the top
    drawn = byte(50, 51)  # last picture of the two sprites, 16 * kind + 0 or 7
    y = byte(*range(59, 66))  # y - 7
    x = byte(*range(66, 73))  # x - 9
    rank = bits(*range(73, 80), count=2)  # frame of four on which the figure has priority
    vertical = flag(*range(73, 80), bit=2)  # walks on a ladder
    mark = flag(*range(73, 80), bit=3)  # goes left along lines
    kind = bits(*range(73, 80), first=4, count=3)
    back = flag(*range(73, 80), bit=7)  # left or, on ladders, down
    tracer = byte(80)  # record of the figure that walks along the border, clockwise
    icons = bits(86, count=2)
    lives = bits(86, count=4)
    carry = bits(86, first=1)
    level = bits(86, first=2, count=3)
    playing = flag(86, bit=5)
    over = flag(86, bit=7)
    player = byte(87)  # its record
    pace = byte(88)  # sum of the others' speeds
    score = bcd((91, 90, 89))
    turn = byte(92)  # counts 5 to 1: others, player, others, player, perhaps others
    wait = byte(94)  # frames before play, or of a jump
    stick = byte(112)  # the joystick, in the high nibble; after turn 3 constants take its place
    gained = bcd(115)  # after the frame was drawn
    called = byte(124)  # return address of the last call of the player's step: still on the stack


def is_beginning(m: Ram) -> jax.Array:
    """True if a life or a level begins; the records are already set for the next frame."""
    return ~m.playing & ~m.over & (m.player == UNSORTED)


def is_blank(m: Ram) -> jax.Array:
    """True for the frames after a reset on which the whole screen is black."""
    return is_beginning(m) & (m.wait == LONGEST_WAIT) | (m.y[0] == 0)
