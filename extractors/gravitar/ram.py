"""Gravitar's RAM."""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag

ROM = Rom("gravitar", "8ac18076d01a6b63acf6e2cab4968940")


class Screen:  # of `Ram.screen`
    OVER = 1
    MAP = 2
    PLANET = 3
    REACTOR = 4
    ATTACK = 5


class Page:  # of `Ram.page`
    PLANET = 0xBB


class Ground:  # of `Ram.picture` on planets
    SAUCER = 0
    BUNKERS = (0x0E, 0x1C, 0x2A)
    TANKS = (0x38, 0x46, 0x54)
    EXPLOSIONS = (0x62, 0x70, 0x7E, 0x9A, 0xA8, 0xB6)


class Sky:  # of `Ram.picture` on the map and in an attack
    EXPLOSIONS = (0x10, 0x20, 0x30)
    SAUCER = 0x40
    REACTOR = 0x50
    SUN = 0x60
    RING = 0x70
    PLANETS = (0x7F, 0x8E, 0xC7, 0xAC, 0xB9, 0x9E, 0xD5, 0xE2, 0xF2)


class Ram(RamMap):
    screen = bits(1, count=4)
    mirrored = flag(2, bit=3)  # pictures of rows
    dies = flag(2, bit=7)  # the map restarts after a lost life
    spare_lives = byte(4)
    clock = byte(5)
    score = bcd((7, 8, 9))
    fuel = bcd((10, 11, 12))
    fuel_low = byte(12)
    last_digit = byte(23)  # low byte of the address of the display's last picture
    lives_time = byte(28)  # frames until the display shows the fuel
    drawn_picture = byte(29)  # of the ship
    drawn_x = byte(30)
    x = byte(31)
    y = byte(32)
    drawn_end = byte(33)  # 0 before the first game
    drawn_y = byte(34)
    heading = byte(35)  # at least 16: it explodes
    pace = byte(38)
    shot_row = byte(47)  # as drawn
    page = byte(50)  # of the pictures of rows
    picture = byte(*range(58, 65))  # of each row
    color = byte(*range(66, 73))
    place = byte(*range(73, 80))
    top = byte(*range(80, 87))
    zone_end = byte(*range(88, 95))  # line after which the next row begins
    shot_heading = byte(96, 97)  # 255: none
    enemy_heading = byte(98, 99)
    enemy_time = byte(102, 103)
    shot_y = byte(104, 105)
    enemy_y = byte(106, 107)
    shot_x = byte(108, 109)
    enemy_x = byte(110, 111)
    saucer_x = byte(112)
    saucer = byte(113)  # on the map: whether it exists; on planets, 1: it flies to the right
    saucer_pace = byte(114)
    saucer_picture = byte(115)  # on the map
    timer = bcd(115)  # in the reactor
    saucer_row = byte(116)  # on the map
    timer_frames = byte(116)  # in the reactor: until its next step
    reactor_place = byte(117)  # on the map
    ceiling = byte(121)  # of a planet's ground
    zones = byte(127)  # zones that the drawing loop has begun, unless overwritten since
