"""The RAM of Pitfall!."""

import jax
from ocjax.authoring import RamMap, Rom, bcd, bits, byte, flag, high, registers

ROM = Rom("pitfall", "3e90cf23106f2e08b2781e41299de556")


class Scene:  # of `Ram.scene`
    HOLE = 0
    HOLES = 1  # three holes
    CROCODILES = 4
    TAR = (2, 5, 6)
    WATER = (3, 4, 7)


class Saved:  # of `Ram.saver_mask`
    MASK = 247  # the screen saver drops a bit of colours


class Ram(RamMap):
    saver_key = byte(7)  # XORed with colours
    saver_mask = byte(8)  # mask of colours: 255 in play
    tally = byte(0)  # marks for lives
    rope = byte(18)  # 117 minus its lowest line
    kind = byte(19)  # of the objects
    scene = byte(20)
    ladder = byte(29)
    earth = byte(31)  # playfield of the earth, from its middle; a bit is clear above a ladder
    holes = byte(*range(32, 39))  # playfield of the rows of a hole, from its middle; 0: open
    pose = byte(53)  # low byte of Harry's picture
    picture = byte(55)  # low byte, of the objects
    scorpion = byte(65)  # low byte, of the scorpion
    copies = bits(84, count=3)
    score = bcd((85, 86, 87))
    minutes = bcd(88)
    seconds = bcd(89)
    slope = byte(92)  # 1/256 columns per line
    swing = flag(93, bit=7)  # to the right
    fine = high(21, 22, 23)  # with `coarse`, x + 1: Harry, object, below the ground
    coarse = byte(24, 25, 26)
    x = byte(97)
    mirrored = flag(101, bit=3)
    turned = flag(102, bit=3)  # scorpion
    jump = byte(103)  # step of a jump
    stick = byte(104)  # at the start of a jump
    y = byte(105)
    trees = byte(107)
    sunk = byte(114)  # rows that a log has pushed Harry down


def sprite_x(m: Ram, sprite: int) -> jax.Array:
    """First column of a sprite: 0 Harry, 1 the object on the ground, 2 scorpion or wall."""
    return registers.position(m.coarse[sprite], m.fine[sprite]) - 1
