"""Tutankham's RAM and the meaning of its values."""

from ocjax.authoring import RamMap, bcd, bits, byte, flag


class Scene:  # of Ram.scene
    PLAY = 0
    TITLE = 1
    LOST = 2
    OVER = 4


class Event:  # of Ram.event
    DIES = 2


class Ram(RamMap):
    y = byte(6, 9, 12, 15)  # of the player and of creatures, y - 35; 255: none
    x = byte(7, 10, 13, 16)  # x + 1
    direction = bits(8, 11, 14, 17, count=2)
    mirrored = flag(8, 11, 14, 17, bit=1)
    kind = bits(8, 11, 14, 17, first=2, count=2)  # 0: the player
    look = bits(8, 11, 14, 17, first=2, count=3)
    dying = flag(8, 11, 14, 17, bit=4)  # of the player: stands
    hidden = bits(8, 11, 14, 17, first=5, count=2)  # on even frames, on odd frames
    shot_y = byte(18)  # y - 35; 255: none
    shot_x = byte(19)  # x + 2
    score = bcd((26, 28))
    lives = bits(30, count=2)
    flashes = bits(30, first=2, count=2)
    has_key = flag(32, bit=7)
    things = byte(34)  # one bit per entry, starting at the highest
    timer = bits(36, first=3, count=5)
    event = byte(38)
    clock = byte(39)  # of frames
    turns = byte(40)  # of the clock
    scene = byte(44)
    comes = byte(51)  # address of the next creature to appear; it is not shown
    level = byte(59)
    map = bits(59, count=2)
    first_row = byte(65)  # of the map, on the screen
    last_row = byte(66)  # the row after it
