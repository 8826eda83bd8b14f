"""The RAM of Donkey Kong."""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag, high

ROM = Rom("donkey_kong", "36b20c427975760cb9cf4a47e41369e4")


class Ram(RamMap):
    obstacle_y = byte(0, 1, 2, 3)  # y - 40, 0: none
    walk = byte(4)  # counts columns, for Mario's picture
    air = byte(5)  # frames left of a jump
    hammer_time = byte(6)  # in 256 frames, 0: not held
    score = bcd((7, 8))  # hundreds
    wait = byte(9)  # frames until Mario may move
    idle = byte(10)  # 128 frames without any input
    sound_left = byte(11)  # counts down
    state = byte(12)
    dying = flag(13, bit=7)
    sound = byte(15)
    board = byte(16)
    girders = byte(26)  # their colour; others in the screen saver
    x = byte(19)  # x + 4
    heading = byte(20)
    hammer = byte(21)  # its picture, low byte of an address
    y = byte(27)  # of Mario, y - 22
    hammer_x = byte(28)  # x + 6
    rivets = byte(31, 32, 33, 34)  # lowest row first; at least 6 or 12 if rivets are gone
    lives = byte(35)
    bonus = bcd(36)  # hundreds
    obstacle_x = byte(65, 66, 67, 68)  # x + 4
    on_ladder = flag(69, 70, 71, 72, bit=7)
    goes_right = bits(69, 70, 71, 72)
    ladder = byte(73, 74, 75, 76)  # number of the ladder that a barrel takes or took
    coarse_x = byte(*range(82, 76, -1))  # coarse column of each floor's last obstacle, top first
    fine_x = high(*range(88, 82, -1))
    lowest_row = byte(97)  # of the obstacle on the lowest floor, y - 77
    clock = byte(104)
    at_ladder = byte(106)  # number of Mario's ladder
    control = byte(107)  # the joystick at the start of the jump; a pushed direction has bit 0
