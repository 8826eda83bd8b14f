"""The RAM of Road Runner."""

from ocjax.authoring import RamMap, Rom, bits, byte, flag, high, low, signed

ROM = Rom("road_runner", "ce5cc62608be2cd3ed8abd844efb8919")


class Scene:  # of `Ram.scene`; even ones are open road, 3 and 7 have a cannon
    START = 0
    CLIFF = 1
    ROCKS = 5


class Scenery:  # of `Ram.scenery`
    BRIDGE = 1  # of the lower four bits
    NARROW = 3
    CLIFFS = 9
    LOOKS_BACK = 33  # the turret
    ROAD = 128
    GAP = 193
    LANED = (ROAD, NARROW)


class Pose:  # of `Ram.pose`
    BURNT = 0
    RUNS = (1, 2)  # alternating
    LEAPS = 2
    RIDES = 9  # on a rocket; the next pose, too


class Caught:  # of `Ram.caught`; negative: by the coyote
    FREE = 0
    PUSHED = 1  # by a truck


class Pace:  # of `Ram.pace`, on the bird's line
    LAGS = 0  # falls back while the road moves
    FAST = 1  # larger: slow


class Stick:  # of `Ram.stick`
    STILL = 0
    UP = (2, 3, 4)
    DOWN = (0, 6, 7)
    NONE = 8  # at least


class Ram(RamMap):
    pointers = byte((8, 7), (2, 1))  # to the pictures of the bird and the coyote
    hues = byte(3)  # low byte of the address of the bird's colours
    direction = signed(9)  # of the bird: positive to the left
    y = byte(10)  # downwards
    coyote_y = byte(11)
    bonus = byte(12)  # 1 plus hundreds of points
    scene = bits(22, count=3)
    cactus_x = byte(24, 83)
    entry = signed(34)  # of a bridge; negative: without a sign
    pose = byte(41, 35)  # of the bird and the coyote
    shown = flag(36, 37, 38, 39, bit=1)
    kind = high(36, 37, 38, 39)
    truck_x = byte(42)  # x + 1; or the column of a turret's ball
    truck = byte(43)  # 0: no truck; 1: in the lower lane; 2: in the upper one
    two_cracks = byte(46)  # 0: one crack
    fallen = byte(48)  # rows that rocks have fallen; nonzero: a turret is there
    fired = byte(49)  # 0: no ball of a turret
    bonus_time = byte(50)  # frames
    waits = signed(51)  # negative: the coyote is on his way
    stunned = byte(52)  # frames, of the coyote
    rocket = byte(53)  # 0: he has none
    truck_y = byte(55)  # y - 55; or a turret's column, or the lane of objects on the cliff
    drift = bits(56, first=1, count=3)
    struck = byte(58)  # nonzero: the bird was struck
    falls = byte(57)  # the bird, from the cliff
    mirrored = flag(59, 66, bit=0)  # the bird and the coyote
    runs = byte(60)
    caught = signed(61)
    pace = byte(62)  # of the coyote
    icons = low(68)
    sign = byte(69)
    clock = low(77)
    digits = low(76, 75, 74, 73)
    aim = byte(78, 79)  # the coyote's destination
    x = byte(80)
    coyote_x = byte(81)
    sign_x = byte(82)
    seed_x = byte(89)
    layout = byte(90)
    scenery = byte(91)
    jump = byte(92)  # remaining frames
    drawn_x = byte(104)  # the bird's in scenes 1 and 5, otherwise the coyote's
    stick = byte(107)  # direction of the bird's move
