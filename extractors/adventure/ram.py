"""Adventure's RAM and the meaning of its values."""

from ocjax.authoring import RamMap, Rom, byte

ROM = Rom("adventure", "4b27f5397c442d25f0c418ccdacf1926")


class Thing:  # numbers of the things that are separate from the rooms, in the ROM's table at $FF44
    YELLOW_GATE = 0
    WHITE_GATE = 1
    BLACK_GATE = 2
    AUTHOR = 3
    LEVEL = 4
    RED_DRAGON = 5
    YELLOW_DRAGON = 6
    GREEN_DRAGON = 7
    SWORD = 8
    BRIDGE = 9
    YELLOW_KEY = 10
    WHITE_KEY = 11
    BLACK_KEY = 12
    BAT = 13
    DOT = 14
    CHALICE = 15
    MAGNET = 16


THINGS = 17
GATES = (Thing.YELLOW_GATE, Thing.WHITE_GATE, Thing.BLACK_GATE)
DRAGONS = (Thing.RED_DRAGON, Thing.YELLOW_DRAGON, Thing.GREEN_DRAGON)

ENTRY_BYTES = 9  # bytes per entry of the table; `Ram.first` and `Ram.second` count in them


class Shown:  # other values of `Ram.first` and `Ram.second`
    LIGHT = 0  # the sprite that lights a dark room round the player
    NOTHING = 162


class Wait:  # of `Ram.wait`: low byte of the return address while the game waits for a frame to end
    THIRD = 45  # it has drawn the third frame of a turn, and the player has moved since
    FIRST = 65  # the first frame; the player has moved if he had run into something


class Push:  # bits of `Ram.stick`; 0 while pushed
    UP = 16
    DOWN = 32
    LEFT = 64
    RIGHT = 128


class Mouth:  # of `Ram.dragon`
    ROAMS = 0
    OPEN = 1  # about to bite; later states look like a roaming dragon or a dead one
    FULL = 2


class Ram(RamMap):
    walls_address = byte((1, 0))  # of the room's picture
    first_address = byte((3, 2))  # of the picture of the first drawn thing
    first_picture = byte(2)  # its low byte
    second_address = byte((5, 4))
    second_picture = byte(4)
    first_x = byte(6)  # x + 1, as drawn
    first_y = byte(7)  # counts pairs of lines, from the bottom up
    second_x = byte(8)
    second_y = byte(9)
    room = byte(10)  # of the player
    x = byte(11)  # of the player, x + 2
    drawn_y = byte(13)  # of the player as drawn: counts pairs of lines, from the bottom up
    first = byte(21)  # entries of the drawn things in the ROM's table
    second = byte(22)
    stick = byte(25)  # as read; 255: nothing was in the player's way
    thing_room = byte(36, 41, 46, 54, 60, 63, 66, 69, 75, 33, 57, 51)  # from `Thing.RED_DRAGON`
    thing_x = byte(37, 42, 47, 55, 61, 64, 67, 70, 76, 34, 58, 52)
    thing_y = byte(38, 43, 48, 56, 62, 65, 68, 71, 77, 35, 59, 53)
    dragon = byte(40, 45, 50)  # of the red, the yellow and the green one
    gate = byte(72, 73, 74)  # counts turns while it opens and closes, four a step
    bat = byte(79)  # counts turns up to 8: it flaps
    light_x = byte(90)  # of the sprite that lights a dark room
    light_y = byte(91)  # as `first_y`
    level = byte(93)  # twice the game's number, less 2
    last_room = byte(98)  # the player's room on the last frame without an obstacle
    last_x = byte(99)
    flash = byte(101)  # counts turns: half the flashing colour
    saver = byte(102)  # at least 128: half of the key that is XORed with the colours
    wait = byte(126)
