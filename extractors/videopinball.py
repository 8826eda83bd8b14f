"""Video Pinball: a ball, two flippers, a plunger, and what the ball can hit.

Bumper: the boxes with a number, which is a hundredth of the value; at the top, and two below it.
DropTarget: the three diamonds at the top. Target: the diamond that is lit now and then. Rollover:
the number and the logo between bars. Logo: the logos that the ball has rolled over, of which the
middle one is a cross if they have given another ball. DifficultyLevel is the first digit, which is
the player's number; LifeUsed is the second one, the ball's number. The walls are scenery. After too
strong a shake, the score's background is red until the ball is lost. Other names that OCAtari 2.2
has for this game (Fish, Shark, the strings, ScoreP1, ScoreP2) are of another game.

RAM: ALE's source (score), OCAtari 2.2 (ball, flippers, what the numbers are), and the ROM's code:
the steps at F522 and F80E are made before the drawing at F1CE, those at F664 after it. Of the
latter, `decode` takes back what moves the ball along walls and changes the bumpers and targets. The
pictures that the drawing has pushed on the stack (F24E) or last pointed to are those on the screen.

Covered: all modes and difficulties, all targets and values, extra balls, the end of the game.
Not exact: the last frame of a ball. Gone from the RAM are its column, whether the second and the
third drop target stood, and whether the target was lit. The score on the screen is that of the
frame before. VEM does not see the part of the ball that is on a wall, and knows the colours of
flashes by the right wall's.
"""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.fonts import Digits, hex_font, score_box
from ocjax.console.ops import among, pick
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.rom import Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Bounds
from ocjax.vision.shades import Saver, Shades

ROM = Rom("video_pinball", "107cc025334211e6d29da0b6be46aec7")
GLYPHS = "75557", "62227", "71747", "71317", "55711", "74717", "74757", "71222", "75757", "75717"
FONT = hex_font(GLYPHS, dots=3, dot=(4, 2), pitch=16)
NUMBERS = ROM.font(0xC00, rows=7, stride=8, dots=7, shift=1, dot=(1, 2), top_first=True)

WHITE = 0x0E
GOLD = 0x2A
YELLOW = 0xF8
BLUE = 0x76
SAVER_MASK = 0xF7  # the saver drops a bit, which yellow has in play and blue has not
FLASHES = range(0, 0x4A, 2)  # what all colours are XORed with
COLORS = {
    "Ball": BLUE,
    "Flipper": WHITE,
    "Plunger": YELLOW,
    "Bumper": BLUE,
    "DropTarget": GOLD,
    "Target": GOLD,
    "Rollover": GOLD,
    "Spinner": WHITE,
    "Logo": GOLD,
    "DifficultyLevel": YELLOW,
    "LifeUsed": YELLOW,
    "Score": YELLOW,
}
# pictures
DIAMOND = 0x50
SPINS = (0x57, 0x5E, 0x65, 0x6C)
LOGO = 0x73
LIT = 0x7B
CROSS = 0x83
PICTURES = ROM.pictures(
    [0xC00 | at for at in (*range(0, 0x50, 8), DIAMOND, *SPINS, LOGO, LIT, CROSS)],
    7,
    top_first=True,
)
# in PICTURES
AT_DIAMOND = 10
AT_SPINS = 11
AT_LOGO = 15
AT_LIT = 16
AT_CROSS = 17
FRAMES_AT = np.array((72, 40, 104)), np.array((48, 112, 112))  # columns and rows of the bumpers
FIRST = 8  # of the numbers' pictures
# `sound` on the frame of these
HIT_TARGET = 0xC1
ALL_HIT = 0x8D
# columns that tell which target the ball has hit
TARGET_LEFT = 0x48
TARGET_RIGHT = 0x58
PLUNGED = 149, 132  # the ball in front of the plunger
UNCHECKED = 4  # rows, modulo 16, at which the drawing does not look at the plunger
# where the ball changes late
PICTURE_ROWS = range(24, 168)
LATE_COLUMN = 13
GONE = 96  # `ball_row` of a ball that was lost
DEEP = 97  # and of one below the screen


def _extents(left: int, right: int) -> list[list[int]]:
    """Left edge, top, width and height of the four pictures of a flipper, each of two halves."""
    out = []
    for i in range(4):
        halves = (ROM.rows(at + 16 * i, 16, top_first=True) for at in (left, right))
        whole = np.stack([(half[:, None] >> np.arange(7, -1, -1)) & 1 for half in halves], axis=1)
        ys, xs = np.nonzero(whole.reshape(16, 16))
        out.append([int(v) for v in (xs.min(), ys.min(), np.ptp(xs) + 1, np.ptp(ys) + 1)])
    return np.array(out).T.tolist()


FLIPPERS = _extents(0xD00, 0xD40), _extents(0xD80, 0xDC0)


def _walls() -> tuple[tuple[int, int, int, int], ...]:
    """The areas of the playfield's dots, which the screen's right half shows mirrored."""
    out = []
    for zone in range(22):
        pf0, pf1, pf2 = (int(b) for b in ROM.bytes(0xCB3 + 3 * zone, 3))
        if zone == 20:
            pf0, pf1, pf2 = 0xB0, 0xF0, 0
        if zone == 21:
            pf0, pf1, pf2 = 0xB0, 0xFF, 0x0F
        dots = [pf0 >> i & 1 for i in range(4, 8)] + [pf1 >> i & 1 for i in range(7, -1, -1)]
        dots += [pf2 >> i & 1 for i in range(8)]
        dots += dots[::-1]
        edges = np.flatnonzero(np.diff([0, *dots, 0])).reshape(-1, 2) * 4
        out += [(int(a), 16 + 8 * zone, int(b), 24 + 8 * zone) for a, b in edges]
    return tuple(out)


class Ram(RamMap):
    saver_key = byte(65)  # what colours are XORed with; 0 in play
    flags = byte(3)  # bits: the ball touches a wall in a row, in a column
    collides = byte(20)  # 0: the ball touched no wall
    sides = byte(22)
    way = byte(23)  # bits: 7 the ball was moved in its row, else in its column; 6 by +1, else by -1
    ball = byte(25)  # number
    black = byte(32)  # as a flash or the saver shows it
    player = bits(46)
    score = bcd((52, 50, 48))
    launched = byte(59)
    ball_x = byte(67)
    ball_y = byte(68)  # y + 3
    ball_row = byte(69)  # half of `ball_y` as it was drawn
    plunger = byte(70)  # half of y + 1
    targets = byte(72, 73, 74)  # pictures, as all that follow
    bumper = byte(76, 81, 83)
    target = byte(82)
    sound = byte(88)  # low byte of the address of the next tone
    logo = byte(92, 94, 96)  # as drawn
    left_flipper = bits(98, first=4, count=2)
    right_flipper = bits(102, first=4, count=2)
    first_target = byte(113)  # as drawn, as the two below: what is left of the stack
    rollover = byte(116)
    spinner = byte(119)


def decode(m: Ram) -> dict[str, Box]:
    all_hit = m.sound == ALL_HIT
    bumper = m.bumper - jnp.where(all_hit & (m.bumper > FIRST), FIRST, 0)
    cross = m.logo == CROSS
    top = 2 * m.plunger - 1 + jnp.where((m.plunger & 15) == UNCHECKED, 2, 0)
    boxes = {
        "Ball": _ball(m),
        "Flipper": _flippers(m),
        "Plunger": box(148, top, 4, 192 - top),
        "Bumper": box(*FRAMES_AT, 16, 32, value=100 * (bumper >> 3)),
        "DropTarget": _picture(AT_DIAMOND, np.array((60, 76, 92)), 24).where(_up(m)),
        "Target": _picture(AT_LIT, 77, 120).where(m.target == LIT),
        "Rollover": _rollovers(m),
        "Spinner": _spinners(m),
        "Logo": _picture(jnp.where(cross, AT_CROSS, AT_LOGO), np.array((60, 76, 92)), 152).where(
            cross | (m.logo == LOGO)
        ),
        "DifficultyLevel": _digit(m.player + 1, 16),
        "LifeUsed": _digit(m.ball, 48),
        "Score": score_box(
            FONT, m.score, right=156, top=3, digits=6, leading_zeros=True, value=m.score
        ),
    }
    flash = jnp.where(m.saver_key > 0, 0, m.black & ~1)
    return {name: replace(b, color=COLORS[name] ^ flash) for name, b in boxes.items()}


def _picture(index: jax.Array | int, x: jax.Array | np.ndarray | int, y: int) -> Box:
    """Boxes of pictures whose rows are two pixels high."""
    x = jnp.asarray(x)
    left, top, width, height = PICTURES.extent(jnp.broadcast_to(jnp.asarray(index), x.shape))
    return box(x + left, y + 2 * top, width, 2 * height)


def _digit(value: jax.Array, right: int) -> Box:
    return score_box(FONT, value, right=right, top=3, digits=1, value=value)


def _ball(m: Ram) -> Box:
    """The ball before a wall has moved it, or where it was lost."""
    touches = m.flags & 3
    turned = (m.sides & 0xC0) == 0xC0
    moved = (m.collides > 0) & (m.launched > 0) & among(touches, (1, 2)) & ~turned
    step = jnp.where(moved, jnp.where((m.way & 0x40) > 0, 1, -1), 0)
    across = (m.way & 0x80) > 0
    x = m.ball_x - jnp.where(across, step, 0)
    y = m.ball_y - jnp.where(across, 0, step) - 3
    left = (y & 1 == 0) & (x <= LATE_COLUMN)
    top = y + jnp.where(left & (x < LATE_COLUMN) & _late(y), 1, 0)
    end = y + 4 + jnp.where(left & _late(y + 4), 1, 0)
    lost = (m.ball_x == PLUNGED[0]) & (m.ball_y == PLUNGED[1]) & (m.ball_row >= GONE)
    x, y = jnp.where(lost, 79, x), jnp.where(lost, 189, top)
    return box(x, y, 2, end - top, ~lost | (m.ball_row < DEEP)).clip(0, 16, 160, 192)


def _late(y: jax.Array) -> jax.Array:
    """Whether, at an even row, the ball changes only on the next row left of `LATE_COLUMN`.

    The store at F352, which shows a ball of the line before, comes in the middle of the picture's
    rows, but early at F3AD, on every fourth of the even ones.
    """
    row = y - PICTURE_ROWS.start & 31
    return (y >= PICTURE_ROWS.start) & (y < PICTURE_ROWS.stop) & (row < 16) & (row & 7 < 6)


def _flippers(m: Ram) -> Box:
    states = m.left_flipper, m.right_flipper
    extents = (
        [pick(state, table) for table in tables]
        for state, tables in zip(states, FLIPPERS, strict=True)
    )
    x, y, w, h = (jnp.stack(pair) for pair in zip(*extents, strict=True))
    return box(x + np.array((64, 80)), 176 + y, w, h)


def _up(m: Ram) -> jax.Array:
    """The drop targets, of which the RAM keeps only the first one as it was drawn.

    The other two stand again already if the last one has just been hit, or the ball was lost.
    """
    hit_slot = jnp.where(m.ball_x < TARGET_RIGHT, 1, 2)
    hit_now = (m.sound == HIT_TARGET) & (np.arange(3) == hit_slot)
    others = ((m.targets > 0) & (m.sound != ALL_HIT)) | hit_now
    return jnp.where(np.arange(3) == 0, m.first_target > 0, others)


def _rollovers(m: Ram) -> Box:
    """The number and the logo at the top."""
    number = m.rollover >> 3
    index = jnp.stack([number, jnp.full_like(number, AT_LOGO)])
    boxes = _picture(index, np.array((45, 109)), 56)
    return box(
        boxes.x, boxes.y, boxes.w, boxes.h, value=jnp.stack([number, jnp.zeros_like(number)])
    )


def _spinners(m: Ram) -> Box:
    index = AT_SPINS + sum(jnp.where(m.spinner >= s, 1, 0) for s in SPINS[1:])
    return _picture(jnp.stack([index, index]), np.array((30, 126)), 88)


TOKENS = WHITE, GOLD, YELLOW, BLUE
FLASHING = tuple(0x76 ^ flash for flash in FLASHES)
BY_FLASH = Shades(
    (156, 100),
    FLASHING,
    tuple(tuple(c ^ flash for c in TOKENS) for flash in FLASHES),
)
FIELD = (8, 16, 152, 192)
FRAMES = (72, 48, 88, 80), (40, 112, 56, 144), (104, 112, 120, 144)
TARGETS = tuple((x, 24, x + 8, 40) for x in (60, 76, 92))
LOGOS = tuple((x, 152, x + 8, 168) for x in (60, 76, 92))
BALL = Bounds(BLUE, FIELD, (1, 2), ignore=_walls())
LOGO_ROWS = tuple((ROM.rows(0xC00 | LOGO, 7, top_first=True) >> 1).tolist())
NUMBER_OR_LOGO = replace(NUMBERS, signs=(LOGO_ROWS,))  # the logo counts 0
NUMBER = Digits(NUMBER_OR_LOGO, (45,), 56), Digits(NUMBER_OR_LOGO, (109,), 56)
BONUS = tuple(Digits(NUMBERS, (x + 5,), y + 8, weights=(100,)) for x, y, _, _ in FRAMES)
BUMPERS = Bounds((BLUE, GOLD), FRAMES, value=BONUS)
POINTS = Bounds(YELLOW, (64, 3, 156, 13), value=Digits(FONT, range(64, 160, 16), 3))


def _shown(left: int) -> Bounds:
    return Bounds(YELLOW, (left, 3, left + 12, 13), value=Digits(FONT, (left,), 3))


def _saver_key(m: Ram) -> jax.Array:
    return jnp.where(m.saver_key > 0, m.saver_key, -1)


GAME = Game(
    name="VideoPinball",
    rom=ROM,
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (158, 190), BLUE, mask=SAVER_MASK, beside=(5, 3)),
    shades=BY_FLASH,
    categories=(
        Category("Ball", BALL, doc="the ball"),
        Category(
            "Flipper",
            Bounds(WHITE, ((64, 176, 80, 192), (80, 176, 96, 192))),
            count=2,
            doc="left, right",
        ),
        Category("Plunger", Bounds((YELLOW, WHITE), (148, 120, 152, 192)), doc="at the right"),
        Category("Bumper", BUMPERS, count=3, attributes=("value",), doc="points"),
        Category("DropTarget", Bounds(GOLD, TARGETS), count=3, doc="diamonds at the top"),
        Category("Target", Bounds(GOLD, (76, 120, 86, 136)), doc="lit now and then"),
        Category(
            "Rollover",
            Bounds(GOLD, ((44, 56, 52, 72), (108, 56, 116, 72)), value=NUMBER),
            count=2,
            attributes=("value",),
            doc="the number and the logo",
        ),
        Category(
            "Spinner",
            Bounds(WHITE, ((29, 88, 37, 102), (125, 88, 133, 102))),
            count=2,
            doc="left, right",
        ),
        Category("Logo", Bounds(GOLD, LOGOS), count=3, doc="rolled over"),
        display("DifficultyLevel", _shown(4), doc="the player's number"),
        display("LifeUsed", _shown(36), doc="the ball's number"),
        display("Score", POINTS, doc="points"),
    ),
)
