"""Pitfall II's RAM, and the meaning of its values.

A slot is a floor on the screen, the highest first; the fifth is below the screen.
"""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag

ROM = Rom("pitfall2", "6d842c96d5a01967be9680080dd5be54")
SLOTS = range(5)


class Kind:  # of `Ram.kind`: the creature or thing on a floor
    NONE = 0
    CROSS = 1
    LEFT_LEDGE = 2
    QUICKCLAW = 3
    SCORPION = 4
    BAT = 5
    CONDOR = 6
    GOLD_BAR = 7
    RAT = 8
    WATERFALL = 9
    RIGHT_LEDGE = 10
    RHONDA = 11
    RING = 12
    BALLOON = 13
    FROG = 14
    RIGHT_GOLD_BAR = 15
    EEL = 16  # a bat of `Water.COLOR`
    KINDS = 17
    DEADLY = (SCORPION, BAT, CONDOR, FROG)


class Dead:  # of `Ram.dead`; below `BITTEN`, Harry goes back to the last cross ($D0C2, bank 0)
    NO = 0
    BITTEN = 128  # or more: all stand still while it counts down


class Pose:  # of `Ram.pose`
    FLIES = 13  # below a balloon


class Loads:  # of `Ram.loads`, while the floors are still empty
    FIRST = 2
    LAST = 3


class Water:  # of `Ram.background`
    COLOR = 132


class Rail:  # low bytes of `Ram.rail`
    LADDER = 0xFA


class Wait:  # of `Ram.waits`
    FOR_STICK = 1


class Balloon:  # of `Ram.balloon`
    RIDDEN = 2


class Ram(RamMap):
    clock = byte(0)  # frames
    waits = byte(1)
    kind = bits(*range(23, 28), first=4, count=4)
    mirrored = flag(*range(23, 28), bit=3)
    start = byte(*range(18, 23))  # count at which the picture's fetcher begins, low byte
    top = byte(*range(33, 38))  # count at which the picture begins
    x = byte(*range(38, 43))
    rail = byte(*range(43, 48))  # low byte of the address of a floor's ladder or wall
    background = byte(*range(58, 63))
    touched = flag(*range(63, 68), bit=7)  # by Harry
    demo = flag(69, bit=7)
    intro = byte(70)  # remaining frames, in eighths
    score = bcd((71, 72, 73))
    scroll = byte(86)  # lines
    balloon = byte(92)
    loads = byte(93)
    dead = byte(96)  # frames
    harry_x = byte(103)
    column = byte(104)  # of the cavern
    harry_y = byte(105)
    floor = byte(106)  # of the first slot
    pose = byte(108)
    harry_mirrored = flag(110, bit=3)
