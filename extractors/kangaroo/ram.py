"""The RAM of Kangaroo."""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte

ROM = Rom("kangaroo", "4326edb70ff20d0ee5ba58fa5cb09d60")
BANK = 0x1000  # offset of the second bank

GAME_OVER = 128  # least `lives` after the end


class Ram(RamMap):
    monkey_picture = byte(0, 1, 2, 3)  # low byte of its address
    monkey_state = byte(4, 5, 6, 7)
    monkey_row = byte(8, 9, 10, 11)
    monkey_x = byte(12, 13, 14, 15)  # x + 15
    row = byte(16)  # of the player's top
    x = byte(17)  # x - 15
    pose = byte(18)
    timer = byte(19)  # of the pose
    thrown_state = byte(21, 22, 23)
    thrown_row = byte(25, 26, 27)
    thrown_x = byte(28, 29, 30)  # x - 14
    falling_row = byte(33)  # counts the rows of all levels
    falling_x = byte(34)  # x - 14
    level = byte(36)
    score = bcd((39, 40))  # hundreds
    bell = byte(41)
    fruits = byte(42, 43, 44)
    lives = byte(45)
    scene = byte(54)
    clock = byte(57)
    tens = bits(59, first=4, count=4)  # of the time in hundreds; 10 is a blank
    ones = bits(59, count=4)
    third = byte(60)  # 0-2; the player steps at 0
    fire = byte(124)  # at least 128: the button is not pressed
