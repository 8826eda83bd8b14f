"""Frogger's RAM."""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte, signed

ROM = Rom("frogger", "081e2c114c9c20b61acf25fc95c71bf4")


class Stick:  # of `Ram.stick`
    UP = 0x10
    DOWN = 0x20


class Picture:  # of `Ram.frog_picture` and `Ram.log_snake_picture`: low byte of its address
    FROG_UP = 0x73
    FROGS = (FROG_UP, 0x79, 0x80, 0x87, 0x8E)
    SNAKES = (0x95, 0x9C, 0x5C, 0x62)


class Tune:  # of `Ram.tune`: low byte of the address of the sound's next note
    JUMP = 0x61
    HOME = 0x81
    DEATH = 0x88


class River:  # of `Ram.river`: low byte of the address of a table of pictures
    LOGS = 0x9D  # without an alligator
    MOUTH_OPEN = 0xA8


class Verge:  # of `Ram.verge`: low byte of the address of a table of pictures
    SNAKE = 0xBE
    SNAKE_RISES = 0xC9


class Lane:  # of `Ram.lane`, `Ram.lady_lane` and `Ram.log_snake_lane`: lowest first
    START = -1
    TRUCKS = 4
    VERGE = 5
    LOWER_TURTLES = 6
    SHORT_LOGS = 7
    LONG_LOG = 8
    UPPER_TURTLES = 9
    LAST = 10  # logs or an alligator
    HOME = 0x49


class Guest:  # of `Ram.guest`, bits
    FLY = 1
    RISING_HEAD = 2  # of an alligator
    HEAD = 4


class FrogColor:  # of `Ram.frog_color`: index in the table of colours
    WITH_LADY = 8


class Ram(RamMap):
    car_at = byte(22, 33, 23, 34, 24, 35, 25, 36)  # codes of positions: both sprites of each lane
    truck_at = byte(26, 37)
    verge_snake_at = byte(38)
    turtle_at = byte(28, 39, 31, 42)
    log_at = byte(29, 30, 32, 43)  # left ones of the first lanes, both of the last lane
    lane = signed(44)  # of the frog
    lady_lane = byte(45)
    log_snake_lane = byte(46)
    x = byte(48)  # of the frog; `frog_at` follows it before the next frame
    frog_at = byte(52)
    lady_at = byte(53)
    log_snake_at = byte(54)
    layout = byte(56)  # low byte of the address of a table of copies
    river = byte(64)
    verge = byte(66)
    pace = byte(68)  # low byte of the address of a table of speeds
    dive = bits(70, first=0, count=2)  # stage of the turtles
    frog_picture = byte(72)
    log_snake_picture = byte(74)
    stick = byte(75)
    score = bcd((76, 78))
    lives = byte(80)  # 255: the game has ended
    tune = byte(84)
    note = byte(88)  # remaining frames of the note
    clock = byte(91)  # frames
    time = byte(96)
    homes = bits(99, first=0, count=5)  # bays with a frog
    guest = bits(99, first=5, count=3)
    guest_bay = byte(101)  # 1-5; 0: no guest
    frog_color = byte(120)
