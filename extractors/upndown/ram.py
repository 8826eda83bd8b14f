"""Up'n Down's RAM, and the meaning of its values."""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag

ROM = Rom("up_n_down", "a499d720e7ee35c62424de882a3351b6")
BANK = 0x1000  # of the tables


class Kind:  # of `Ram.kind` and `Ram.kinds`; cars are below `FLAG`
    FLAG = 8  # the first of eight
    PLAYER = 16
    HIDDEN = 23
    COLLECTABLE = 24  # the first of eight
    GONE = 32  # bit of a flag


class Jump:  # of `Ram.jump`
    LANDED = 24
    LOW = 216  # at least: in the air; this one falls
    LANDS = 217
    SINKS = 224  # at least: falls row by row
    RISES = 236
    TAKEOFF = 255


class Pause:  # of `Ram.pause`
    RUNNING = 0
    DYING = 64  # on the frame of a lost life
    STARTING = (63, 64)  # while a text replaces the score


class Attract:  # of `Ram.attract`
    LIFE_TAKEN = (32, 33)  # on the frame of a lost life
    IDLE = 34  # while a text replaces the score


BACKWARD = 128  # least `Ram.speed` and `Ram.speeds` backwards
GROUND = 88  # `Ram.player_y` on the road; the records' `y` has the same origin


class Ram(RamMap):
    """The records are three objects on the roads besides the player."""

    score = bcd((0, 1, 2))
    level = byte(3)  # the round, starting at 1
    collected = byte(4)  # one bit per flag
    lives = bits(6, count=4)
    counter = byte(16)  # of frames
    pause = byte(20)  # frames
    fine = byte(21)  # rows that the road has come down, 0-3
    coarse = byte(22)  # 4 rows
    flight = byte(23)  # of a jump to the other road
    jump = byte(24)
    mirrored = flag(28, 29, 30, 31, bit=7)  # the player's picture, then the records'
    speed = byte(32)  # of the player
    speeds = byte(33, 34, 35)  # of the records
    kind = byte(36)  # of the player
    kinds = byte(37, 38, 39)  # of the records
    next_x = byte(40)  # of the player
    x = byte(41, 42, 43)  # of the records
    y = byte(49, 50, 51)  # of the records
    player_y = byte(56)
    attract = byte(61)
    limit = byte(65, 66, 67)  # least speed of a record that makes a step
    player_x = byte(84)  # before the last move

    # Data for drawing the frame: of the four sprites, from the top.
    ends = byte(76)  # half of the rows above the first one or below the last one
    gaps = byte(77, 78, 79)  # rows from one to the next, without lost rows
    pictures = byte(88, 90, 92, 94)  # low bytes of addresses, plus the rows that each loses
    pages = byte(89, 91, 93, 95)  # of the pictures
    piece = byte(123, 124, 125)  # of the road, the last one drawn
