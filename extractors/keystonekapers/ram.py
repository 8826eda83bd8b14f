"""Keystone Kapers' RAM, and the meaning of its values.

Floors are the ground floor, the first, the second and the roof.
"""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag

ROM = Rom("keystone_kapers", "6c1f3f2e359dbf55df462ccbcdd2f6bf")


class Thing:  # of `Ram.thing`: the thing on a floor
    RADIO = 6
    RADIO_SOUNDS = 7
    BALL = 8
    CART = 9
    BIPLANE = 10
    BIPLANE_TURNS = 11  # its propeller
    SUITCASE = 15
    MONEYBAG = 16


class Pose:  # of `Ram.pose`
    JUMPS = 2  # and one of the steps 1-5
    STANDS = 6
    DUCKS = 7


class Ride:  # of `Ram.ride`
    NONE = 0
    ESCALATOR = 2
    ELEVATOR = 3


class Ram(RamMap):
    ride = bits(0, first=6, count=2)
    rides_left = flag(0, bit=5)  # the escalator goes up to the left
    faces_left = flag(0, bit=3)
    pause = byte(6)  # remaining frames of a sound
    over = flag(7, bit=7)  # the round is over
    plays = flag(8, bit=7)
    sound = byte(11)
    button = flag(12, bit=7)  # held
    jump = byte(13)  # remaining steps
    clock = byte(14)
    krook_x = byte(16)
    height = bits(17, count=5)  # of the Kop above the floor
    place = byte(18)  # of the Kop: eight sections per floor
    section = byte(19)  # on the screen
    krook_place = byte(20)  # of the Krook; on every other floor the sections are counted backwards
    pose = byte(21)
    lives = byte(22)
    idle = byte(25)  # at least 128: the screen is black
    score = bcd((26, 27, 28))
    time = bcd(29)
    kop_x = byte(*range(32, 36))  # on each floor
    thing_x = byte(*range(36, 40))
    thing_top = byte(*range(40, 44))  # row of its picture on the floor's first line
    thing = byte(*range(44, 48))
    copies = bits(*range(48, 52), count=3)
    thing_left = flag(*range(48, 52), bit=3)  # it looks to the left
    doors = byte(*range(56, 59))  # the playfield of each floor except the roof
    krook_left = flag(76, bit=3)
    stick_right = flag(97, bit=7)  # 0: pushed when the jump began
    stick_left = flag(97, bit=6)
    stick_down = flag(97, bit=5)
    krook_pose = byte(98)
    age = byte(114)  # frames of the game, not counting those of lost lives
