"""Defender's RAM and the meaning of its values."""

from ocjax.authoring import RamMap, Rom, byte, low, signed

ROM = Rom("defender", "0f643c34e40e3f1daafd9c524d3ffe64")


class Kind:  # of Ram.kind
    BOMBER = 0
    BAITER = 1
    POD = 2
    SWARM = 3
    LANDER = 4
    MUTANT = 5


class Status:  # of Ram.status
    ALIVE = 0
    HIT = 1


class Capture:  # of Ram.capture: a lander's capture of a human
    NONE = 0
    CARRIED = 3  # by the ship, after it has caught the human
    COMES = 128  # at least this: the lander comes down


class Pause:  # of Ram.pause
    RUNS = 0
    NEW_LIFE = 50
    RESET = 149  # the first frame after a reset
    NEXT_WAVE = 150


class Countdown:  # of Ram.countdown, while the ship flashes
    EXPLODES = 5  # below this


class Timing:  # of Ram.timing
    SHOT = 254


class Facing:  # of Ram.facing
    RIGHT = 5


class Picture:  # of Ram.next_picture, low bytes of addresses
    EXPLOSION = 56


class Turn:  # of Ram.next_human
    SHIP = 255  # its dot on the scanner


class Planet:  # of Ram.lost
    GONE = 255


class Speed:  # of Ram.missile_dx
    NONE = 0
    MINE = -16


class Ram(RamMap):
    kind = low(*range(8))  # of the aliens' records
    status = byte(*range(8))  # the high nibble; gone if at least 8
    thrust = byte(9)  # 0: the ship stays in its column
    facing = byte(11)
    timing = byte(18)  # last use of the missile's sprite
    drawn_x = byte(21)  # of the drawn alien
    drawn = byte(22)  # its record; 255: none
    drawn_y = byte(23)  # 172 - y
    random = byte(24)
    digits = low(28, 29, 30, 31, 32, 33)  # of the score, the last one first; 10: blank
    frame = byte(35)
    human_x = byte(36)  # of the next human; 0: none
    x = byte(37)
    next_x = byte(38)  # of the next alien
    y = byte(45)  # 177 - y
    height = byte(46)  # added to the height of all aliens
    captive_y = byte(47)  # 170 - y; 255: on the ground
    next_y = byte(48)  # 172 - y
    next_picture = byte(50)
    countdown = byte(52)  # quarters of the frames until the life is over; 0: none
    turned = byte(53)  # the ship has turned and still flies backwards
    speed = byte(54)
    next_alien = byte(55)  # its record; 255: none
    next_kind = byte(56)
    captor = byte(57)  # record of the lander that has a human
    next_dot = byte(59)  # record of the scanner's next dot
    missile_y = byte(60)  # 170 - y
    missile_x = byte(61)
    missile_dy = signed(62)
    missile_dx = signed(63)
    icons = byte(64)  # of lives
    bombs = byte(65)
    lives = byte(66)
    capture_x = byte(70)  # position of captor and captive
    capture_y = byte(71)  # of the captor: 172 - y
    scroll = byte(72)  # position of the aliens
    ground = byte(73)  # position of the humans
    captive = byte(74)  # number of the human
    pause = byte(75)  # frames left of a pause
    way = signed(76)  # of the joystick, sideways
    capture = byte(77)
    next_human = byte(78)
    lost = byte(79)  # a bit per human, the first in the highest bit
    wave_over = byte(81)
    wave = byte(82)  # two digits
    group_x = byte(96, 97, 98)  # positions of aliens that move together
    group_y = byte(99, 100)  # their heights; the second is the bombers'
    shot_x = byte(102)  # of the next frame; 0: none
    colors = byte(*range(104, 112))
