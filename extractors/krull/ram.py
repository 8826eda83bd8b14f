"""The RAM of Krull."""

from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag, signed

ROM = Rom("krull", "4baada22435320d185c95b7dd2bcdb24")


class Scene:  # of `Ram.scene`
    WEDDING = 0
    LAIR = 1
    WEB = 2
    DESERT = 3


class Item:  # of `Ram.item`
    WEAPON = 226
    LIFE = 233


class Flags:  # bits of `Ram.flags`
    SIZE = 7  # NUSIZ
    MARE_TURNED = 8
    TURNED = 16


class Ram(RamMap):
    """Each scene uses many bytes in its own way, so a byte has a name for each use."""

    # In all scenes.
    round = byte(4)
    over = flag(0, bit=7)  # the title is shown
    sun_y = byte(23)
    sun_x = byte(24)
    sand = bits(26, first=4, count=4)  # one bit per row that is still above
    score = bcd((28, 29, 30))
    lives = byte(31)  # in reserve
    weapons = byte(32)
    scene = byte(34)
    x = byte(*range(83, 91))  # of the eight records
    y = byte(*range(91, 99))  # half rows, from a start that depends on scene and figure
    flags = byte(*range(99, 107))
    picture = byte(*range(107, 115))

    # At the wedding.
    taken = flag(33, bit=6)  # the bride is taken; the seventh record is then hers
    slayers = byte(82)
    shot_color = byte(81)  # changes after the drawing
    shot_slant = bits(79, first=4, count=4)

    # At the wedding, of the Slayers' shot; in the lair, of the beast's weapon.
    shot_top = byte(76)  # (y - 13) / 2
    shot_bottom = byte(77)  # (y - 13) / 2
    shot_x = byte(78)  # x - 7

    # In the lair.
    cage = byte(*range(115, 123))  # one bit per piece

    # In the web.
    shot_page = byte(67)
    player_picture = byte(66)
    foe_picture = byte(68)  # of the spider or the star
    line_x = byte(116, 115)  # x + 33 and x - 7 of the first position
    next_place = byte(117)  # position of the lines on the next frame
    lines_as_first = flag(3, bit=7)  # from the third round on, they also move the other way
    line_clock = byte(121)  # the lines move when it overflows

    # In the desert.
    mare_picture = byte(68, 66)
    item = byte(70)
    speed = signed(76)  # 1/32 of a column per frame
    item_part = byte(77)  # 1/32 of a column
    item_x = byte(78)  # x - 7
    castle = byte(80)  # rows of the fortress that have risen
