"""The RAM of Phoenix."""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag

ROM = Rom("phoenix", "7e52a95074a66640fcfde124fffd491a")


class Stage:  # of `Ram.stage`
    BIRDS = 0
    BATS = 2
    RED_BATS = 3
    SHIP = 4


class Wing:  # of `Ram.left` and `Ram.right`
    CLOSED = 3  # below: an egg that grows
    OPEN = 6
    LOST = 7  # above: it explodes


class Look:  # of `Ram.look`
    GONE = 5  # the player's explosion is over


class Boss:  # of `Ram.boss`
    EXPLODES = 4  # at least: it explodes


class Shot:  # of `Ram.shot_y`
    LAUNCH = 0x19
    NONE = 0xC0  # at least: no shot


class Ram(RamMap):
    drawn_look = byte(7)  # low byte of the player's picture as drawn; 0 on the first frame
    drawn_shot = byte(9)  # 198 - `shot_y` as drawn; 0: none
    clock = byte(13)
    time = byte(14)  # 64 frames each, starting at 1
    gone_rows = byte(16)  # of bats, starting at the lowest one
    alive = byte(17)  # one bit per bird or bat; clear while a low bat is not drawn
    blocks = byte(*range(27, 47))
    left = bits(*range(27, 34), count=5)  # picture of the left bird, or of the bat's left wing
    right = bits(*range(34, 41), count=5)
    row_y = byte(*range(41, 48))
    shield = flag(49, bit=6)
    missile_top = byte(53, 54, 55, 56)
    missile_end = byte(58, 59, 60, 61)
    missiles = bits(62, first=4, count=4)  # one bit per missile in flight
    heading = bits(63, count=7)  # one bit per bat that flies to the right
    rises = flag(64, bit=7)  # whether the formation of bats rises
    most_right = byte(66)  # x, where bats turn
    most_left = byte(67)
    closes = bits(69, count=7)  # one bit per bat that closes its wings
    pause = byte(70)  # 64 frames each, until the shield is ready
    score = bcd((73, 72, 71))
    stage = byte(74)
    lives = bits(75, count=7)
    begins = flag(77, bit=7)  # a wave or a life, on the next frame
    enemies = bits(78, count=7)  # remaining in the wave
    missile_code = byte(80, 81, 82, 83)
    shot_y = byte(89)
    look = byte(90)  # picture of the player
    shot_x = byte(93)  # x + 71
    x = byte(94)  # x + 70
    ship_y = byte(95)
    idle = byte(98)  # 256 frames each, since the player last moved
    bird_x = byte(*range(99, 107))  # x + 70
    bat_x = byte(*range(99, 106))  # x + 70
    boss = byte(121)  # picture
    rounds = byte(124)  # ships that were destroyed
