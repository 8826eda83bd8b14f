"""Venture's RAM, and the meaning of its values."""

from ocjax.authoring import RamMap, Rom, bcd, byte

ROM = Rom("venture", "3e899eba0ca8cd2972da1ae5479b4f0d")


class Room:  # of `Ram.room`
    WALLS = 3
    SECOND_HALL = 9
    HALLS = (8, SECOND_HALL)
    BEYOND_SECOND_HALL = range(4, 8)


PAUSED = 128  # least `Ram.flags` while the game stands still


class Status:  # bits of `Ram.status`; the bit of a sprite's direction is 0
    SPEED = 7
    UP = 16
    DOWN = 32
    LEFT = 64
    RIGHT = 128
    DEAD = 242  # the complete byte


class Ram(RamMap):
    picture = byte(0, 2, 4, 6, 8, 10)  # low byte of its address, minus the row
    guest_picture = byte(14)
    door = byte(16)  # last used door of the hall, one bit
    taken = byte(18)  # 255: the treasure is taken
    y = byte(20, 21, 22, 23, 24, 25)  # counts pairs of lines
    dot_y = byte(26)  # counts pairs of lines
    guest_y = byte(27)  # counts pairs of lines
    status = byte(28, 29, 30, 31, 32, 33, 34)  # the dot's is the last one
    color = byte(36, 37, 38, 39, 40, 41)
    height = byte(42, 43, 44, 45, 46, 47)  # 256 minus the rows
    guest_color = byte(48)
    timer = byte(50, 51, 52, 53, 54, 55, 56)
    turns = byte(58, 59, 60)  # rotating bits select the sprites that move
    next_turn = byte(61)  # first sprite of the next frame
    flags = byte(63)
    icons = byte(70)  # lives left
    score = bcd((71, 72))  # hundreds
    pause = byte(76)  # frames until a scene begins
    x = byte(79, 80, 81, 82, 83, 84)
    dot_x = byte(85)  # x + 1
    guest_x = byte(86)
    guest = byte(89)  # the sprite that alternates with the larger hall monster
    room = byte(90)
    swapped = byte(91)
    split = byte(105)  # first row of the third sprite of the frame
