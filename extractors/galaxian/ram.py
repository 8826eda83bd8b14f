"""Galaxian's RAM, with the values of its fields."""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag

ROM = Rom("galaxian", "211774f4c5739042618be8ff67351177")
BANK = 0x1000  # of the display program, at f000; the game's program is at d000


class Turn:  # of `Ram.turn`: number of the frame, of eight
    FORMATION = 1
    RELEASE = 3
    DIVERS = 5  # and even frames
    BOMBS = (1, 3, 7)


class Hit:  # of `Ram.hit`
    DIVER = 64


class Kind:  # of `Ram.kind`, the row in the formation
    FLAGSHIP = 0
    ESCORT = 1
    PURPLE = 2


class State:  # of `Ram.state`
    MIRRORED = 64
    DIVES = 128  # at least


class Place:  # of `Ram.y`
    NONE = 0
    GONE = 0xF0  # at least


class Death:  # of `Ram.death` and `Ram.death_tune`
    BEGINS = 129
    FIRST_NOTE = 62


class NewLife:  # of `Ram.player_x` and `Ram.player_code`
    X = 69
    CODE = 187  # of that position


class NewFormation:  # of `Ram.offset`, after a step
    OFFSETS = (16, 18)


class Release:  # of `Ram.release` without a dropped bomb
    NONE = (5, 8, 10, 12)


class Ram(RamMap):
    above_new = byte(8)  # bombs above the dropped one
    hit = byte(10)
    missile_y = byte(11)  # y - 16
    masks = byte(*range(12, 18))  # drawn ships of each row, in the chip's order of copies
    bombs = bits(*range(20, 33), count=3)  # a bit per step; rows of steps, top first
    release = byte(34)
    offset = byte(36)  # of the formation, in half columns
    goes_left = flag(37, bit=7)
    set_up = byte(37)  # of a new formation: the clock
    rows = bits(*range(38, 44), count=7)  # the ships of the formation, a bit per column
    dead = flag(41, bit=7)  # the ship is dead
    score = bcd((44, 45, 46))
    round = bcd(47)
    clock = byte(48)
    turn = bits(48, count=3)
    death = byte(50)
    lowest = byte(53)  # row of the formation
    empty = bits(54, count=3)  # columns at the right
    escorts = byte(55)  # a bit each
    lives = byte(57)  # in reserve
    player_code = byte(59)  # the ship's position in the chip's coding
    missile_x = byte(60)  # x - 2
    blast_x = byte(61)  # of an explosion in the formation
    blast = byte(62)  # a timer in the high bits
    hit_row = bits(62, count=3)
    x = byte(*range(64, 69))  # of divers, x - 8
    y = byte(*range(69, 74))  # row of the formation and line in it
    state = byte(*range(74, 79))
    kind = bits(*range(79, 84), count=3)
    column = bits(*range(79, 84), first=3, count=3)  # the diver's column in the formation
    explodes = flag(*range(79, 84), bit=6)
    dives = flag(*range(79, 84), bit=7)
    escort_hit = bits(85, count=2)
    escort_record = bits(86, count=3)  # the shared record of a flagship's escorts
    escort_time = bits(86, first=3, count=4)  # since a hit on one of them
    fast = bits(94, first=6)
    player_x = byte(100)  # x - 8
    death_tune = byte(101)
    bomb_x = byte(*range(102, 110))  # x - 11
