"""The RAM of Pooyan."""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag, high, low

LAST_ROW = 6  # of the lift; the first is 1
ROM = Rom("pooyan", "4799a40b6e889370b7ee55c17ba65141")


class State:  # of `Ram.state`
    INTRO = 1  # the number of the round is shown
    DEATH = 3
    END = 5
    PLAY = 130


class Kind:  # of `Ram.kind`; 0: a wolf under a balloon, 1: a balloon, 3 and 4: popped
    ARCHER = 2  # a wolf with a bow
    FALLS = 5  # a wolf


class Reach:  # of `Ram.reach`
    IN = 0
    OUT = 1  # or 2 while it bites


class March:  # of `Ram.march`
    COMES = 3
    STANDS = 4


class Copies:  # of `Ram.copies`: NUSIZ
    ONE = 0
    TWO = 2
    THREE = 6


class Ram(RamMap):
    tune = byte(0)  # low byte of the address of its next note
    tune_pause = byte(4)  # remaining frames of the note
    score = bcd((8, 9, 10))
    pushers = byte(14)  # wolves that have come up
    round = bits(18, count=5)  # from 0
    ascends = bits(18)  # wolves come from below in this round
    rock_off = bits(18, first=6)  # it is not at the top
    pushers_before = byte(21)  # when the round before ended
    lives = byte(22)  # in reserve
    state = byte(24)
    frame = byte(27)
    frames = byte(28)  # in eighths
    row = byte(31)  # the player's; 7: it has fallen
    balloon_row = byte(32, 33, 34, 35, 36, 37)  # 0: no balloon
    climber_row = byte(38)  # 0: no climber
    rock_row = byte(39)  # 0: it has not fallen
    shot_row = low(40)  # 0: no shot
    shot_down = high(40)  # lines
    stone_row = low(41)  # 0: no stone
    stone_down = high(41)  # lines
    rope = byte(42)  # row at the end of the lift's rope in the frame, minus 6
    picture = byte(43)  # the player's; low byte of its address
    kind = byte(44, 45, 46, 47, 48, 49)  # of the figure in `balloon_row`
    reach = byte(50)  # the climber's
    shot_at = byte(63)  # codes of positions
    stone_at = byte(64)
    is_bait = flag(66, bit=0)  # the shot
    hides = byte(68)  # row with a hidden balloon
    boss = byte(69)  # the balloon that changes colour, from 1; 0: none
    rock_at = byte(70)
    pushes = byte(72)  # low byte of a pusher's picture, indirectly
    player_color = byte(75)
    until_step = byte(82)  # frames until the climber moves
    until_reach = byte(83)  # remaining frames of the climber's reach
    until_walk = byte(84)  # frames until wolves walk
    walked = byte(85)  # columns that marching wolves have walked
    marchers_at = byte(86)
    landed_walked = byte(88)  # columns that a landed wolf has walked; 0: no such wolf
    seen_row = byte(90)  # the player's, when the climber began to wait
    march = byte(91)
    copies = byte(92)  # of a marching wolf
    stride = bits(97, first=4)  # picture of wolves that walk
    standing = byte(99)  # marching wolves that stand, one bit each
    landed_column = bits(100, count=2)
