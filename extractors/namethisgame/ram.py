"""The RAM of Name This Game."""

import numpy as np
from ocjax.authoring import RamMap, bcd, bits, byte, flag

TENTACLE_COUNT = 8
TENTACLE_ROWS = 10
TENTACLE_OF = np.arange(TENTACLE_COUNT * TENTACLE_ROWS) // TENTACLE_ROWS  # of the slots
ROW_OF = np.arange(TENTACLE_COUNT * TENTACLE_ROWS) % TENTACLE_ROWS
COLUMNS = np.array((0, 0, 1, 1, 2, 3, 3, 4))[TENTACLE_OF]  # bytes of `playfield` by tentacle


class State:  # of `Ram.state`
    STARTS = 8
    PLAYS = 10
    INKED = 11
    LOST = 12  # one frame
    NO_OXYGEN = 18
    FLASHES = range(20, 27)  # the meter flashes


class Clock:  # of `Ram.clock`
    WAVE_BEGINS = 137  # in `State.STARTS`: the bars have just been filled
    JUST_FLASHED = 226


class Ram(RamMap):
    playfield = byte(*(10 * c + r for c, r in zip(COLUMNS.tolist(), ROW_OF.tolist(), strict=True)))
    shot_y = byte(50)  # turns of the drawing loop before it; 0: no shot
    shot_x = byte(51)  # x + 2
    shot_rows = byte(52)  # the rest of `shot_y` after the loop
    lane = byte(*range(53, 60))  # the shark's picture by lane, 0: no shark; the lowest lane first
    shark_x = byte(60)  # x + 1
    # One byte:
    stolen = flag(61, bit=1)  # the treasure is stolen: the ink spreads
    looks_right = flag(61, bit=2)
    eaten = flag(61, bit=3)  # the shark carries the diver away
    boat_leftward = flag(61, bit=4)
    pipe = flag(61, bit=5)
    shark_leftward = flag(61, bit=6)
    faces_right = flag(61, bit=7)
    clock = byte(63)
    idle = byte(64)  # 256 frames each since the joystick was moved; at least 128: dark screen
    state = byte(65)
    score = bcd((68, 69, 70))
    lives = bits(71, count=3)
    oxygen_pace = byte(75)  # mask of `clock`
    pointer = byte(84, 86, 88, 90, 92, 94)  # to the digits on the display, 8 bytes each
    text = bits(84, count=3)  # nonzero: letters replace them
    ink = byte(97)  # rows of the diver's zone without ink
    treasure_ink = byte(98)  # rows of the treasure's
    x = byte(99)  # x + 1
    boat_x = byte(100)  # x + 1
    shark_lane = byte(101)
    oxygen = byte((112, 113))  # one bit per step of a bar
    time = byte((114, 115))
    pipe_time = byte(117)  # counts down
