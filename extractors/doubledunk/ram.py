"""DoubleDunk: the ROM and the RAM."""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag

ROM = Rom("double_dunk", "368d88a6c071caba60b4f778615aae94")


class Who:  # the order of `Ram.x`, `Ram.y` and `Ram.figure`
    GREEN_BIG = 0
    WHITE_BIG = 1
    GREEN_SMALL = 2
    WHITE_SMALL = 3


class Push:  # of `Ram.pushes`
    LEFT = 1
    RIGHT = 2


class Ram(RamMap):
    """The byte map; players are in the order green and white, tall, then short."""

    clock_runs = flag(0, bit=4)  # a shot clock runs
    white_holds = flag(1, bit=6)  # a white player has the ball, or had it last
    short_holds = flag(1, bit=7)  # a short player has it
    falls = flag(2, bit=4)  # the ball flies to a player or the ground
    descends = flag(2, bit=5)  # towards the basket
    flies_left = flag(2, bit=6)
    frame = byte(3)
    waits = flag(7, bit=7)  # the team with the ball has not begun
    loose = flag(11, bit=7)  # no player has the ball
    passed = flag(11, bit=6)  # it flies to a player of the team
    pushes_y = bits(12, first=4, count=2)  # vertical push of the player with the ball
    pushes = bits(12, first=6, count=2)  # horizontal push
    figure = bits(29, 30, 31, 32, count=4)  # a player's activity
    y = byte(33, 34, 35, 36)  # line of his feet
    x = byte(37, 38, 39, 40)  # column - 11
    mirrors_0 = flag(41, bit=3)  # sprite 0 shows mirror images
    mirrors_1 = flag(41, bit=4)  # sprite 1 does
    ball_top = byte(45)  # line above it
    ball_bottom = byte(46)  # its lowest line
    ball_x = byte(47)  # column - 12
    # The four drawn players, from the top; sprites 1, 0, 1, 0:
    fine = bits(48, 49, 50, 51, first=4, count=4)
    coarse = byte(53, 54, 55, 56)
    top = byte(58, 59, 60, 61)  # line above the head
    bottom = byte(62, 63, 64, 65)  # last drawn line
    colors = byte(66, 68, 70, 72)  # address of line 0, low byte
    picture = byte((75, 74), (77, 76), (79, 78), (81, 80))  # address of line 0
    limit = bcd(115)
    shot_clock = bcd(116)
    score = bcd(118, 119)  # player, opponent
