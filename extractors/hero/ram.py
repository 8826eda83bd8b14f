"""The RAM of Hero."""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag

ROM = Rom("hero", "fca4a5be1251927027f2c24774a02160")


class Form:  # bits of `FORMS`
    REPEATS = 1  # the dots are not mirrored
    PLACE = 252  # of the wall


class Walks:  # of `Ram.walks`
    FLIES = 0
    GROUND = 128  # at least: on the ground


class Contact:  # bits of `Ram.contact`
    WALL = 64
    ROCK = 128


class Mode:  # of `Ram.mode`
    NO_LEVELS = 4


class Over:  # of the lower five bits of `Ram.over`
    SCORES = 20  # least value while the score is shown


class Ram(RamMap):
    mode = bits(0, count=7)
    clock = bits(1, count=2)
    stick = bits(4, first=6, count=2)  # left, right; 1: not pressed
    x = byte(27)
    room = byte(28)  # of the level
    y = byte(31)  # 135 - y
    wall = byte(32)  # x + 1
    being_y = byte(35, 34, 33)  # rows above the lowest position; top, middle, bottom
    being_x = byte(39, 38, 37)
    low_x = byte(40, 41, 42)  # bottom, middle, top
    hue = byte(36)  # of the level; 1 in the dark
    power = byte(43)
    walks = byte(44)
    dying = byte(45)  # counts down
    ready = byte(47)  # 0 while the power fills
    facing = byte(48)  # 0: to the right
    hits = byte(49)  # of the laser on the wall
    bombs = byte(50)
    lives = byte(51)  # including the current one
    over = byte(54)
    score = bcd((55, 56, 57))
    score_start = byte(55)
    waits = byte(58)
    side = byte(62)  # dots at the sides of the middle part
    outer = byte(65, 64, 63)  # playfield of each part: top, middle, bottom
    inner = byte(68, 67, 66)
    dots = byte(67)  # of the middle part, where lava closes a passage for some time
    color = byte(71, 70, 69)  # of the rocks: top, middle, bottom
    is_mirrored = flag(73, bit=0)  # the dots of the middle part
    being = byte(77, 76, 75)  # low byte of the picture's address
    low = byte(88, 89, 90)  # low byte of the picture's address
    flash = byte(97)
    contact = byte(98, 99, 100)  # of the player in each part
    flight = byte(103)  # picture of the rotor, counts down
    step = byte(104)  # of the legs, counts down
    saved = byte(114)
    laser = byte(115)  # columns that the beam has flown
    touched = byte(116)  # the object that the beam touched
    level = byte(117)
    points = byte(121, 120, 119)  # frames left of the points shown for a being
    wave = byte(123)  # of a river
    turns = byte(124)  # frames
