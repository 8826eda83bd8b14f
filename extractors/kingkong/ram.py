"""The RAM of King Kong."""

from ocjax.authoring import RamMap, bcd, bits, byte, flag


class State:  # of `Ram.state`
    CHOSEN = 2  # a game; before that, its number is displayed
    KONG_CLIMBS = 3
    WAITS = 4  # the remaining climbers are shown
    LOWER_HALF = 5
    KONG_LEAVES = 6
    UPPER_HALF = 7
    KONG_RETURNS = 8
    HIT = 9
    FALLS = 10
    LIES = 11
    RESCUED = 12


class Turn:  # of `Ram.turn`: the figure that moves after the drawing
    CAPTIVE = 0  # and Kong
    CLIMBER = 1
    KONG = 2
    DIGITS = 3


class BombPicture:  # of `Ram.bomb_picture`
    BONUS = 0x44


class Jump:  # of `Ram.goes`
    RIGHT = 1
    UP = 3


class Leap:  # of `Ram.leap`
    TOP = 16  # Kong rises before this step and falls after it
    LANDED = 255


class Stick:  # bits of `Ram.stick`; 0: pushed
    UP = 1
    UP_DOWN = 3
    ASIDE = 12


class Sound:  # of `Ram.sound`
    RUNG = 0x4C
    RUNG_BEGAN = 2  # `Ram.sound_time` on the frame on which it begins


class Ram(RamMap):
    clock = byte(0)
    score = bcd((2, 3))
    bonus = bcd(4)  # tens
    steps = byte(27)  # of the climber's walk, climb or fall
    climber = byte(28)  # the climber's index in the two records
    kong = byte(29)  # Kong's index
    y = byte(32, 33)  # row below the figure
    x = byte(35, 36)
    picture = byte(38, 39)
    icons = bits(41, count=3)  # NUSIZ: copies of the climber
    faces_left = bits(40, 41, first=3)
    bomb_y = byte(*range(42, 50))
    bomb_x = byte(*range(51, 59))
    bomb_picture = byte(*range(60, 68))
    captive_x = byte(76)
    captive_left = bits(77, first=3)  # direction of the captive's walk
    kong_left = bits(78)
    leap = byte(79)  # steps of Kong's leap to the next floor
    second = byte(84)  # 64 frames each
    captive = byte(87)  # random number that moves the captive
    stick = byte(88)
    released = flag(89, bit=7)  # the button
    turn = bits(90, count=2)
    jumps = flag(100, bit=7)
    climbs = flag(100, bit=6)
    falls = flag(100, bit=5)
    goes = bits(100, count=2)  # direction of a jump
    jump = byte(101)  # remaining steps
    sound = byte(102)
    sound_time = byte(104)
    state = byte(109)
    lives = byte(110)
