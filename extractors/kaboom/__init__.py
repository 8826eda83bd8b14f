"""Kaboom!: a bomber drops bombs, and the player catches them with up to three buckets.

Picture: docs/games/Kaboom.png

Screen: Player is a bucket, Bomber the Mad Bomber on the wall. The buckets are the player's tries.
If a bomb reaches the ground, all bombs explode from the lowest up, the sky, the ground and the
score flash, and a bucket is lost. Every thousand points bring one back. Exploding bombs, the splash
above a bucket and the maker's name are scenery.

Slots: Player has the buckets from the top. The Bomber drops a group of bombs one after the other,
and the n-th bomb of a group has slot n modulo 9 of Bomb.

RAM: ALE's source (score) and the ROM's code. F0C9-F121 draws the wall, F159-F254 the bombs and
F213-F298 the buckets, too. F374-F621 moves everything before the drawing, so the RAM matches the
screen. Only the buckets move after it, at F2EB-F31B, where their pictures are also made: `as_drawn`
takes back their step and their number. A bomb's record moves on by one when the bomb has fallen 18
rows; `dropped` counts the bombs of the group and gives the slots.

Covered: the first groups of bombs, caught and missed bombs, the bucket for a thousand points, the
end of the game. The game has one mode and one difficulty.

Not exact: the buckets' column, if they move. They go half of the way to the paddle, and the RAM
lacks the rounding, so that two columns lead to the same RAM. `paddle.py` finds the right one in
96 % of the frames of random play with 2 to 5 frames per action, and in 86 % with one frame. The
other one is a pixel away. The number of buckets on the single frame on which a thousand points may
bring one back.

VEM: it knows a bomb by its fuse, and the Bomber by his skin. In the screen saver, the fuse has
the colour of the body's upper end, and the bomb is a row too high.
"""

import functools
import operator
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    NTSC,
    Bitmap,
    Blobs,
    Bounds,
    Box,
    Category,
    Context,
    Detected,
    Game,
    NumberDisplay,
    RamMap,
    Rom,
    Saver,
    Shape,
    Step,
    Word,
    bcd,
    bits,
    box,
    boxes,
    byte,
    color_mask,
    display,
    high,
    lookup,
    match,
    mod,
    only,
    packed_position,
    position,
    shift_down,
    shift_up,
    signed,
    when,
)
from ocjax.extractors.kaboom.paddle import buckets_before

ROM = Rom("kaboom", "5428cdfada281c569c74c7308c7f2c26")
FONT = ROM.font(0x728, rows=8)
BOMB_PICTURES = ROM.pictures([0x778, 0x788, 0x798, 0x7A8], 16)
GROUP_SIZES = ROM.bytes(0x6F3, 8)  # bombs of a group, less one

FIELD = (8, 7, 160, 189)
SKIN = (58, 56)  # of the Bomber
FUSE = 8
SPARK = 78
IRON = 6  # most of a bomb
WOOD = (22, 20, 18)  # of a bucket, most of it first
WATER = 136  # in a bucket
STRIPES = 12  # of the Bomber's shirt
BOMBER_COLORS = (*SKIN, STRIPES, 2, 16, 18, 20)
BOMB_COLORS = (FUSE, SPARK, IRON, 0, 2, 4)
YELLOW = 26  # of the score
LOGO = 136
SCORE = NumberDisplay(FONT, right=99, top=8, digits=6)

LEFT = 17  # column of a sprite at position 0
BUCKETS_LEFT = 18  # column of the buckets at `x` 0
BOMBER_SIZE = (7, 30)
BOMBER_TOP = 19
BUCKET_SIZE = (14, 8)
BUCKET_TOPS = np.array((148, 164, 180))
LEAST_BUCKET = (9, 4)  # wider than an exploding bomb
BODY = (5, 8)  # of a bomb without its fuse
BOMBS_TOP = 36  # first row of record 0 with `rows` 0
ROWS_APART = 18  # of two records
RECORDS = np.arange(9)  # of bombs, the highest first
BOMB_WORD = Word(x=7, is_mirrored=1, kind=2, record=4, there=1)
SAVER_MASK = 0xF7  # the screen saver drops a bit of colours


class Phase:  # of `Ram.phase`
    ALL_DROPPED = 0x7F  # the group's last bombs fall
    WAITS = 0x80  # or more: for the button, with a bomb in the Bomber's hands


class Picture:  # of `Ram.picture`
    NONE = 0
    BOMB = 0x78  # the first one
    FIRE = 0xB8  # the first one of an exploding bomb


class Blast:  # of `Ram.blast`
    NONE = 0
    EXPLODES = 32  # or more: bombs explode; below it, the colours flash


class Fanfare:  # of `Ram.fanfare`
    NONE = 0
    BEGINS = 62


class Ram(RamMap):
    saver_key = byte(3)  # XORed with colours
    saver_mask = byte(4)  # mask of colours: 0xFF in play
    bomber_x = byte(25)  # packed
    caught_by = byte(28)  # the highest bucket that can have caught the last bomb, from the top
    x = byte(29)  # of the buckets
    buckets = byte(33)
    group = byte(34)
    score = bcd((35, 36, 37))
    dropped = byte(43)  # bombs of the group
    exploding = byte(44)  # record
    phase = byte(45)
    blast = byte(46)  # counts down during explosions, then during flashes
    fanfare = byte(48)  # counts down after a thousand points
    rows = byte(49)  # that the bombs have fallen since they came to their records
    coarse = bits(*range(50, 59), count=3)  # position of a bomb in 15 pixels
    is_mirrored = bits(*range(50, 59), first=3, count=1)
    fine = high(*range(50, 59))
    picture = byte(*range(59, 68))  # low byte of its address
    ground = byte(118)  # the lowest record on the screen
    paddle = signed(119)  # of the drawn frame


class Drawn(NamedTuple):
    """The buckets of the frame."""

    x: jax.Array
    buckets: jax.Array


def decode(m: Ram) -> dict[str, Box]:
    drawn = as_drawn(m)
    there = np.arange(len(BUCKET_TOPS)) < drawn.buckets
    return {
        "Player": box(BUCKETS_LEFT + drawn.x, BUCKET_TOPS, *BUCKET_SIZE, there),
        "Bomber": box(LEFT + packed_position(m.bomber_x), BOMBER_TOP, *BOMBER_SIZE),
        "Bomb": _bomb_boxes(m),
        "Score": SCORE.box(m.score, color=YELLOW ^ _flash(m)),
    }


def as_drawn(m: Ram) -> Drawn:
    """The buckets before their last step, and before one was lost or came back."""
    falls = (m.blast == Blast.NONE) & (m.phase < Phase.WAITS)
    x = buckets_before(m.x, m.paddle, m.rows, when(falls, _fall(m)))
    no_bomb = m.picture[0] == Picture.NONE
    flashed = (m.phase >= Phase.WAITS) & (m.blast == Blast.NONE) & no_bomb
    lost = flashed & (m.fanfare == Fanfare.NONE)
    was_full = (m.buckets == len(BUCKET_TOPS)) & (m.caught_by == 0)
    gained = (m.fanfare == Fanfare.BEGINS) & ~was_full
    buckets = m.buckets + match((lost, 1), (gained, -1), otherwise=0)
    return Drawn(x, buckets)


def _fall(m: Ram) -> jax.Array:
    """Rows that bombs fall in a frame."""
    return jnp.minimum(m.group >> 1, 3) + 1


def _flash(m: Ram) -> jax.Array:
    """The number that is XORed with the colours of the sky, the ground and the score."""
    return when(m.blast < Blast.EXPLODES, m.blast)


def _bomb_boxes(m: Ram) -> Box:
    # One word costs less time than five numbers.
    words = BOMB_WORD.pack(
        x=position(m.coarse, m.fine),
        is_mirrored=m.is_mirrored,
        kind=(m.picture - Picture.BOMB) >> 4,  # 16 bytes each
        record=RECORDS,
        there=1,
    )
    is_bomb = (m.picture >= Picture.BOMB) & (m.picture < Picture.FIRE)
    chosen = (_bomb_slots(m)[None] == RECORDS[:, None]) & is_bomb[None]
    bomb = BOMB_WORD.unpack(only(chosen, words[None], axis=1))
    bombs = BOMB_PICTURES.box(
        bomb.kind,
        LEFT + bomb.x,
        BOMBS_TOP + ROWS_APART * bomb.record + m.rows,
        mirrored=bomb.is_mirrored == 1,
        valid=bomb.there == 1,
    )
    return bombs.clip(*FIELD)


def _bomb_slots(m: Ram) -> jax.Array:
    """The slot of each record: its bomb's number in the group, modulo the number of slots."""
    # Even groups drop a bomb at every second move of the records.
    halves = 1 - (m.group & 1)
    is_all = m.phase == Phase.ALL_DROPPED
    moves_since = when(is_all, jnp.argmax(m.picture != Picture.NONE).astype(jnp.int32))
    exploded = when(m.blast >= Blast.EXPLODES, (m.ground - m.exploding >> halves) + 1)
    last = jnp.where(is_all, lookup(GROUP_SIZES, m.group), m.dropped + exploded)
    number = last - (RECORDS - moves_since >> halves)
    return mod(number + len(RECORDS), len(RECORDS))


class WithBody(Step):
    """A bomb from the top of its fuse and spark to the end of its body."""

    def __call__(self, found: Detected, _: Context) -> Detected:
        """The objects after the step."""
        h = jnp.minimum(found.h + BODY[1], FIELD[3] - found.y)
        return found._replace(box=boxes(found.x - 1, found.y, BODY[0], h, found.valid))


class WholeBomber(Step):
    """The Bomber from his hat to his feet."""

    def __call__(self, found: Detected, _: Context) -> Detected:
        """The objects after the step."""
        whole = boxes(found.x, BOMBER_TOP, found.w, BOMBER_SIZE[1], found.valid)
        return found._replace(box=whole)


def _narrow(mask: Bitmap, planes: jax.Array) -> Bitmap:
    """The pixels of fuses and sparks without the side of a wide spark."""
    return mask & (color_mask(planes, (FUSE,)) | shift_up(mask, 1) | shift_down(mask, 1))


def _not_sky(mask: Bitmap, planes: jax.Array) -> Bitmap:
    """The pixels of the mask that differ from the sky, whose colour flashes."""
    sky = -(planes[:, :1, FIELD[1] : FIELD[1] + 1] & 1)  # column 31
    return mask & functools.reduce(operator.or_, planes ^ sky)


BOMBER_FIELD = (FIELD[0], BOMBER_TOP, FIELD[2], BOMBER_TOP + BOMBER_SIZE[1])
FUSES = (Shape(w=3, h=(4, 5), pixels=(4, 5)), Shape(w=3, h=7, pixels=(7, 8)))
BUCKET_REGIONS = tuple(
    (FIELD[0], top, FIELD[2], top + BUCKET_SIZE[1]) for top in BUCKET_TOPS.tolist()
)
FLASHES = tuple(YELLOW ^ flash for flash in range(0, Blast.EXPLODES, 2))


def _saver_key(m: Ram) -> jax.Array:
    """The number XORed with colours, or -1 in play."""
    return jnp.where(m.saver_mask == SAVER_MASK, m.saver_key, -1)


GAME = Game(
    name="Kaboom",
    rom=ROM,
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (51, 195), LOGO, mask=SAVER_MASK),
    backdrop=(8,),
    categories=(
        Category(
            "Player",
            Bounds(WOOD, BUCKET_REGIONS, LEAST_BUCKET, BUCKET_SIZE),
            count=3,
            role="player",
            rgb=tuple(NTSC[WOOD[0]].tolist()),
            colors=(*WOOD, WATER),
            doc="buckets, which the player moves together",
        ),
        Category(
            "Bomber",
            Bounds(SKIN, BOMBER_FIELD, then=(WholeBomber(),)),
            rgb=tuple(NTSC[STRIPES].tolist()),
            colors=BOMBER_COLORS,
            doc="the Mad Bomber on the wall",
        ),
        Category(
            "Bomb",
            Blobs((FUSE, SPARK), FIELD, FUSES, filters=(_narrow,), then=(WithBody(),)),
            count=len(RECORDS),
            rgb=tuple(NTSC[IRON].tolist()),
            colors=BOMB_COLORS,
            doc="falling bombs, and the one in the Bomber's hands",
        ),
        display(
            "Score",
            SCORE.rule(FLASHES, filters=(_not_sky,)),
            role="score",
            doc="points",
        ),
    ),
)
