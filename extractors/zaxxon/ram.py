"""The RAM of Zaxxon."""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte

ROM = Rom("zaxxon", "eea0da9b987d661264cce69a7c13c3bd")


class Kind:  # of `Ram.kind`
    FUEL_TANK = 0x11
    SATELLITE = 0x21
    TOWER = 0x31
    MISSILE = 0x41
    SENTRY = 0x51
    FIGHTER = 0x71
    ZAXXON = 0x91
    ZAXXON_HIT = 0xA1
    BRIGHT_MISSILE = 0xB1
    SPACE_FIGHTERS = (0x11, 0x21)  # in space, which has other kinds


class Picture:  # of `Ram.picture` and `Ram.picture_in_space`
    LEVEL = 0xB0
    LAST = 0xD0  # of the plane


class Place:  # of `Ram.place`
    FIRST_SPACE = 51
    LAST_SPACE = 54


class Time:  # of `Ram.explosion`
    BEGINS = 127


class Shot:  # of `Ram.shot_y`, `Ram.missile_y` and `Ram.flash_y`
    NONE = 100


class Color:  # of `Ram.row_color`; a wall's is odd, but the video chip ignores the lowest bit
    WALL = 37
    BARRIER = 163  # of the floor; the loop draws the posts in palette index 246, on one of 4 frames


class Ram(RamMap):
    clock = byte(0)
    runs = byte(7)  # 0 once the plane is lost
    fuel = byte(8)
    game = byte(9)  # 0: no game has begun
    step = bits(11, count=3)  # of the ground, which moves a row in four steps
    homing_y = byte(15)  # of Zaxxon's missile
    flash_y = byte(16)  # of a shot that has hit a wall
    shot_y = byte(17, 18)  # the first one is drawn; the two swap in each frame
    shot_x = byte(19, 20)
    shot_height = byte(21, 22)  # altitude at which it was fired
    altitude = byte(33)
    drawn_code = byte(35)  # register of the object above the plane; in space, of the plane
    shot_code = byte(37)
    missile_code = byte(38)
    missile_y = byte(39)  # of the enemy's shot
    barrier_shape = byte(41)  # added to the shapes of its rows
    pause = byte(46)  # frames until the next step
    picture_in_space = byte(48)
    explosion = byte(50)  # frames of the plane's
    row_color = byte(*range(54, 69))  # of the ground, nearest first
    kind = byte(*range(76, 69, -1))  # of the things on the ground, farthest first
    flash_time = byte(77)
    row_shape = byte(*range(78, 93))  # of the ground, nearest first
    plane_code = byte(93)
    code = byte(*range(101, 94, -1))  # register of its position, farthest first
    picture = byte(102)
    score = bcd((104, 105))  # hundreds
    lives = bits(106, count=3)
    level = bits(106, first=3, count=2)
    place = byte(107)  # in the table of the way
    rows_left = byte(108)  # of this entry of the table
