"""The RAM of James Bond 007."""

from ocjax.authoring import RamMap, Rom, bcd, byte, high, low

ROM = Rom("jamesbond", "e51030251e440cffaab1ac63438b44ae")


class Kind:  # of `Ram.kind`
    MISSILE = 0
    ICE = 1
    ROCKET = 2
    DIVER = 3
    SATELLITE = 4
    SUBMARINE = 5
    BOMB = 6
    TORPEDO = 7
    SHIP = 8
    OIL_RIG = 9
    HELICOPTER = 10
    HORNET = 11
    EXPLOSION = 12
    ERUPTION = 13
    CAPSULE = 14


class Status:  # bits of `Ram.status`
    TITLE = 8
    OVER = 32  # a title with the score
    NOT_RUNNING = 254  # without motion


class Flags:  # bits of `Ram.flags`
    ODD = 64  # every other frame
    DIES = 128


class MoreFlags:  # bits of `Ram.more_flags`
    LAB = 4
    BEAM = 64


class Way:  # bits of `Ram.shot_way`
    RIGHT = 1
    LEFT = 2
    UP = 4
    DOWN = 8
    SLOW_Y = 64
    SLOW_X = 128


class Size:  # of `Ram.size`
    NEAR_COPY = 1
    MEDIUM_COPY = 2
    FAR_COPY = 4
    DOUBLE = 5  # of twice the width
    QUAD = 7
    COPIES = (NEAR_COPY, MEDIUM_COPY, FAR_COPY)


class Ram(RamMap):
    lives = low(6)  # in reserve
    status = byte(12)
    mission = byte(13)
    clock = byte(15)
    flags = byte(20)
    more_flags = byte(21)
    shot_way = byte(22)
    y = byte(25)  # y - 50
    x = byte(27)
    bomb_y = byte(29)  # y - 55
    enemy_shot_y = byte(30)  # y - 55
    shot_y = byte(31)  # y - 55
    bomb_x = byte(37)  # x + 14
    shot_x = byte(38)  # x + 11
    enemy_shot_x = byte(39)  # x + 11
    lab_x = byte(42)
    ground_x = byte(43)  # of the hole, or of the lab's right half
    kind = byte(44, 44, 45, 45, 46)  # in the air and its copy, in the sea and its copy, in the sky
    height = byte(47, 47, 48, 48, 49)  # rows less 1
    object_y = byte(50, 50, 51, 51, 52)  # 179 - y
    animation = low(53, 53, 54, 54, 55)  # frames until the picture changes
    drawn = high(53, 53, 54, 54, 55)  # 0 until the first picture is drawn
    step_timer = byte(56, 56, 57, 57, 58)  # frames until the next step
    object_x = byte(59, 59, 60, 60, 61)
    picture = byte(62, 62, 63, 63, 64)  # low byte of its address
    size = byte(71, 71, 72, 72, 73)  # NUSIZ1
    rig_colors = byte(74)  # low byte of the address of the colours in the air
    score = bcd((94, 93, 92))
    last_y = byte(102)  # `object_y` of the last step of this frame, if one was made
    pause = byte(121)  # frames
    flash = byte(122)  # colour of a lost vehicle
