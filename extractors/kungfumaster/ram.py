"""The RAM of Kung Fu Master."""

from ocjax.authoring import RamMap, bcd, bits, byte, flag, high


class Kind:  # of `Ram.kind`
    KNIFE_THROWER = 0
    SMALL = 1
    HENCHMEN = 2
    MASTERS = range(3, 8)
    DRAGON = 0x80
    RED_BALL = 0x81
    SNAKE = 0x82
    MOTH = 0x83


class Loop:  # of `Ram.loop`: the drawing loop for the lower part of figures
    WITH_THROWN = 0
    FLOATING = 2


class Thrower:  # of `Ram.thrower`, as `Kind`
    KNIFE_THROWER = 0
    BOOMERANGS = 4
    SPELLS = 6
    DRAGON = 0x80


class Ram(RamMap):
    clock = byte(0)
    lines = high(15, 14, 13, 12)  # moves to the left of a thrown object's lines, in order
    lines_shown = flag(15, 14, 13, 12, bit=1)
    thrown_width = bits(17, first=4, count=2)  # power of two
    score = bcd((24, 25, 26))
    time = bcd((27, 28))
    spare_lives = byte(29)
    floor = byte(31)
    ends = flag(34, bit=0)  # the player has died
    walks = flag(34, bit=6)  # into a new floor
    climbs = flag(34, bit=7)  # the stairs
    enemy_y = byte(35)  # `CEILING` - row of the lowest row
    picture_low = byte(36)  # of the player
    picture_page = byte(37)
    enemy_picture = byte((39, 38))
    shifts = byte(40)  # low byte of the address of the player's shifts
    kind = byte(54)
    thrown_y = byte(55)
    copies = bits(63, count=2)
    loop = byte(68)
    enemy_x = byte(72)
    thrown_x = byte(73)
    x = byte(74)
    energy = byte(75)
    enemy_energy = byte(76)
    looks_right = bits(90, first=3)
    enemy_looks_right = bits(92, first=3)
    thrower = byte(94)
