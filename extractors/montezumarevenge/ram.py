"""The RAM of Montezuma's Revenge."""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag

ROM = Rom("montezuma_revenge", "3347a6dd59049b15a38394aa2dafa585")


class State:  # of `Ram.state`
    EXITS = 2  # the explorer leaves the room
    PLAYS = 4
    FALLS = 7


class Pose:  # of `Ram.pose`
    STANDS = 8
    CLIMBS = 10  # at least: on a ladder or a rope
    SWINGS = 14
    STRIDES = 18


class Picture:  # low byte of the picture of the explorer, the rolling skull or a door
    GONE = 0x75
    DOOR = 0x7C
    FIRST_BEAM = 0xA3  # the first of four, in place of a door
    JUMP = 0xA5


class Thing:  # of `Ram.thing`
    FLAME = 0x0A
    SKULL = 0x17
    KEY = 0x2E
    RUBY = 0x36
    SWORD = 0x3E
    AMULET = 0x4E
    TORCHES = (0x68, FLAME)
    SNAKES = (0xEE, 0xFC)
    SPIDERS = (0x47, 0x57)


class Dark:  # of `Ram.dark`
    BLANK = 1  # the room is not drawn


class Leap:  # of `Ram.leap`
    ASIDE = 2


class Tune:  # of `Ram.tune`
    JUST_DIED = 91


class Ram(RamMap):
    clock = byte(0)
    state = byte(2)
    room = byte(3)
    dark = byte(4)  # frames without a picture
    score = bcd((19, 20, 21))
    thing = byte(22)  # low byte of its picture's address
    rolling = byte(24)  # low byte, of the rolling skull
    left_door = byte(26)  # low byte, of the left door or the beams
    right_door = byte(28)  # low byte, of the right door
    picture = byte(30)  # low byte of the explorer's next one
    x = byte(42)  # x + 1
    y = byte(43)
    thing_x = byte(44)  # x + 1
    thing_y = byte(45)
    skull_x = byte(47)  # x - 32; in room 18, x + 1
    skull_y = byte(46)
    west = flag(52, bit=6)
    mirrored = flag(52, bit=3)
    drifts = flag(52, bit=2)  # he still moves on in a fall
    pose = byte(53)
    lives = byte(58)  # without the current one
    turned = byte(61)  # of the rolling skull
    roll = bits(62, count=4)
    things = byte(65)  # carried; the highest bit: a torch
    off = byte(83)  # frames until the bridges return
    copies = bits(84, count=3)  # of the thing, as in NUSIZ1
    jump = byte(86)  # remaining steps
    leap = byte(87)  # kind of a jump
    floor = byte(96)
    stick = bits(102, first=4, count=4)  # up, down, left, right; 1: not pressed
    tune = byte(108)  # steps of a tune
