"""Up'n Down's RAM."""

from ocjax.console.ram import bcd, bits, byte
from ocjax.extractors.upndown.lost import DrawnRam


class Jump:  # of `Ram.jump`
    LANDED = 24
    LOW = 216  # from here on, in the air; falls
    LANDS = 217
    SINKS = 224  # from here on, falls row by row
    RISES = 236
    TAKEOFF = 255


class Pause:  # of `Ram.pause`
    RUNNING = 0
    DYING = 64  # on the frame of a lost life
    STARTING = (63, 64)  # while a text replaces the score


class Attract:  # of `Ram.attract`
    LIFE_TAKEN = (32, 33)  # on the frame of a lost life
    IDLE = 34  # while a text replaces the score


class Ram(DrawnRam):
    score = bcd((0, 1, 2))
    collected = byte(4)  # a bit for each flag
    lives = bits(6, count=4)
    pause = byte(20)  # frames
    fine = byte(21)  # rows by which the road has come down, 0-3
    coarse = byte(22)  # 4 rows
    flight = byte(23)  # of a jump to the other road
    jump = byte(24)
    mirrored = bits(28, 29, 30, 31, first=7)
    speed = byte(32)
    speeds = byte(33, 34, 35)
    kind = byte(36)
    kinds = byte(37, 38, 39)
    next_x = byte(40)  # of the player
    y = byte(49, 50, 51)
    player_y = byte(56)
    attract = byte(61)
    limit = byte(65, 66, 67)  # that a speed has to reach for a step
    player_x = byte(84)  # before the last move
