"""Video Pinball: a ball, two flippers, a plunger, and targets of the ball.

Screen: the walls are scenery. After too strong a shake, the score's background is red until the
ball is lost. Other names that OCAtari 2.2 has for this game (Fish, Shark, the strings, ScoreP1,
ScoreP2) belong to another game.

Slots: Bumper has the boxes with a number, which is a hundredth of the value: one at the top, and
two below it. DropTarget has the three diamonds at the top, Target the diamond that is lit at times,
Rollover the number and the logo between bars. Logo has the logos that the ball has rolled over; the
middle one is a cross if they have given another ball. DifficultyLevel is the first digit, the
player's number. LifeUsed is the second digit, the ball's number.

RAM: ALE's source (score), OCAtari 2.2 (ball, flippers, meaning of the numbers), and the ROM's code:
the steps at F522 and F80E are made before the drawing at F1CE, the steps at F664 after it. `decode`
undoes the later steps that move the ball along walls and change the bumpers and targets. The
pictures that the drawing has pushed on the stack (F24E), or last pointed to, are on the screen.

Covered: all modes and difficulties, all targets and values, extra balls, the end of the game.

Not exact: the last frame of a ball. The RAM has lost the ball's column, and whether the second and
the third drop target were up and the target was lit. The score on the screen belongs to the frame
before.

VEM: it misses the part of the ball that is on a wall, and gets the colours of flashes from the
right wall's colour.
"""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Bounds,
    Box,
    Category,
    Checks,
    Digits,
    Game,
    LivesAsNumber,
    NumberDisplay,
    RamMap,
    Rom,
    Saver,
    Shades,
    among,
    bcd,
    bits,
    box,
    byte,
    display,
    hex_font,
    pick,
    reached,
    when,
)

ROM = Rom("video_pinball", "107cc025334211e6d29da0b6be46aec7")
GLYPHS = (
    *("75557", "62227", "71747", "71317", "55711"),
    *("74717", "74757", "71222", "75757", "75717"),
)
FONT = hex_font(GLYPHS, dots=3, dot=(4, 2), pitch=16)
NUMBERS = ROM.font(0xC00, rows=7, stride=8, dots=7, shift=1, dot=(1, 2), top_first=True)
PLAYER_NUMBER = NumberDisplay(FONT, right=16, top=3, digits=1)
BALL_NUMBER = NumberDisplay(FONT, right=48, top=3, digits=1)
SCORE = NumberDisplay(FONT, right=156, top=3, digits=6, leading_zeros=True)

WHITE = 14
GOLD = 42
BLUE = 118
YELLOW = 248
SAVER_MASK = 0xF7  # the saver drops a bit that yellow has in play and blue does not have
FLASHES = range(0, 0x4A, 2)  # XORed with all colours
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

# Low bytes of the pictures' addresses; the ten numbers come first.
DIAMOND = 0x50
SPINS = (0x57, 0x5E, 0x65, 0x6C)
LOGO = 0x73
LIT = 0x7B
CROSS_LOGO = 0x83
PICTURES = ROM.pictures(
    [0xC00 | at for at in (*range(0, 0x50, 8), DIAMOND, *SPINS, LOGO, LIT, CROSS_LOGO)],
    7,
    top_first=True,
)


class Place:  # in `PICTURES`
    DIAMOND = 10
    SPINS = 11
    LOGO = 15
    LIT = 16
    CROSS = 17


class Sound:  # of `Ram.sound`
    ALL_HIT = 0x8D
    HIT_TARGET = 0xC1


class Touch:  # of `Ram.flags`, when the ball touches a wall in one way only
    IN_ROW = 1
    IN_COLUMN = 2


class Way:  # bits of `Ram.way`
    BY_1 = 0x40  # the ball was moved by +1, otherwise by -1
    IN_ROW = 0x80  # in its row, otherwise in its column


BUMPER_X = np.array((72, 40, 104))
BUMPER_Y = np.array((48, 112, 112))
NEXT_NUMBER = 8  # pictures from a number to the next
BOTH_SIDES = 0xC0  # bits of `sides`
TARGET_RIGHT = 88  # right of this column the ball has hit the third target, not the second
PLUNGED_X = 149  # of the ball in front of the plunger
PLUNGED_Y = 132
UNCHECKED = 4  # the drawing ignores the plunger in these rows, modulo 16
# Rows and column of a late change of the ball.
PICTURE_ROWS = range(24, 168)
LATE_COLUMN = 13
GONE = 96  # least `ball_row` of a lost ball
DEEP = 97  # least `ball_row` of a ball below the screen
LOST_X = 79  # position of a lost ball on the screen
LOST_Y = 189
WALL_ROWS = 22  # of the playfield
LAST_ROWS = {20: (0xB0, 0xF0, 0x00), 21: (0xB0, 0xFF, 0x0F)}  # not listed in the ROM


def _flipper_extents(left: int, right: int) -> list[list[int]]:
    """Left edge, top, width and height of the four pictures of a flipper, each of two halves."""
    out = []
    for i in range(4):
        halves = (ROM.rows(at + 16 * i, 16, top_first=True) for at in (left, right))
        whole = np.stack([(half[:, None] >> np.arange(7, -1, -1)) & 1 for half in halves], axis=1)
        ys, xs = np.nonzero(whole.reshape(16, 16))
        out.append([int(v) for v in (xs.min(), ys.min(), np.ptp(xs) + 1, np.ptp(ys) + 1)])
    return np.array(out).T.tolist()


FLIPPERS = (_flipper_extents(0xD00, 0xD40), _flipper_extents(0xD80, 0xDC0))


def _walls() -> tuple[tuple[int, int, int, int], ...]:
    """The areas of the playfield's dots, which the screen's right half mirrors."""
    out = []
    for row in range(WALL_ROWS):
        listed = (int(part) for part in ROM.bytes(0xCB3 + 3 * row, 3))
        pf0, pf1, pf2 = LAST_ROWS.get(row) or listed
        first = [pf0 >> i & 1 for i in range(4, 8)] + [pf1 >> i & 1 for i in range(7, -1, -1)]
        half = [*first, *(pf2 >> i & 1 for i in range(8))]
        edges = np.flatnonzero(np.diff([0, *half, *half[::-1], 0])).reshape(-1, 2) * 4
        out.extend((int(a), 16 + 8 * row, int(b), 24 + 8 * row) for a, b in edges)
    return tuple(out)


class Ram(RamMap):
    flags = byte(3)  # bits: the ball touches a wall in a row, in a column
    collides = byte(20)  # 0: the ball touched no wall
    sides = byte(22)
    way = byte(23)  # the ball's last move, bits of `Way`
    ball = byte(25)  # number
    black = byte(32)  # as a flash or the saver shows it
    player = bits(46)
    score = bcd((52, 50, 48))
    launched = byte(59)
    saver_key = byte(65)  # XORed with colours; 0 in play
    ball_x = byte(67)
    ball_y = byte(68)  # y + 3
    ball_row = byte(69)  # half of the drawn `ball_y`
    plunger = byte(70)  # half of y + 1
    targets = byte(72, 73, 74)  # pictures, like all fields below
    bumper = byte(76, 81, 83)
    target = byte(82)
    sound = byte(88)  # low byte of the address of the next tone
    logo = byte(92, 94, 96)  # as drawn
    left_flipper = bits(98, first=4, count=2)
    right_flipper = bits(102, first=4, count=2)
    first_target = byte(113)  # as drawn, like the two below: the remains of the stack
    rollover = byte(116)
    spinner = byte(119)


def decode(m: Ram) -> dict[str, Box]:
    boxes = {
        "Ball": _ball_box(m),
        "Flipper": _flipper_boxes(m),
        "Plunger": _plunger(m),
        "Bumper": _bumper_boxes(m),
        "DropTarget": _picture(Place.DIAMOND, np.array((60, 76, 92)), 24).where(_up(m)),
        "Target": _picture(Place.LIT, 77, 120).where(m.target == LIT),
        "Rollover": _rollovers(m),
        "Spinner": _spinners(m),
        "Logo": _logo_boxes(m),
        "DifficultyLevel": PLAYER_NUMBER.box(m.player + 1),
        "LifeUsed": BALL_NUMBER.box(m.ball),
        "Score": SCORE.box(m.score),
    }
    flash = when(m.saver_key == 0, m.black & ~1)
    return {name: replace(b, color=COLORS[name] ^ flash) for name, b in boxes.items()}


def _plunger(m: Ram) -> Box:
    top = 2 * m.plunger - 1 + when((m.plunger & 15) == UNCHECKED, 2)
    return box(148, top, 4, 192 - top)


def _bumper_boxes(m: Ram) -> Box:
    """The bumpers before all targets were hit, which gives them the next number."""
    next_now = (m.sound == Sound.ALL_HIT) & (m.bumper > NEXT_NUMBER)
    bumper = m.bumper - when(next_now, NEXT_NUMBER)
    return box(BUMPER_X, BUMPER_Y, 16, 32, value=100 * (bumper >> 3))


def _logo_boxes(m: Ram) -> Box:
    cross = m.logo == CROSS_LOGO
    place = jnp.where(cross, Place.CROSS, Place.LOGO)
    return _picture(place, np.array((60, 76, 92)), 152).where(cross | (m.logo == LOGO))


def _picture(index: jax.Array | int, x: jax.Array | np.ndarray | int, y: int) -> Box:
    """Boxes of pictures with rows of two pixels."""
    indices = jnp.broadcast_to(jnp.asarray(index), jnp.shape(x))
    left, top, width, height = PICTURES.extent(indices)
    return box(x + left, y + 2 * top, width, 2 * height)


def _ball_box(m: Ram) -> Box:
    """The ball before a wall has moved it, or at its last position."""
    ball_x, ball_y = _ball_drawn(m)
    left = (ball_y & 1 == 0) & (ball_x <= LATE_COLUMN)
    top = ball_y + when(left & (ball_x < LATE_COLUMN) & _late(ball_y), 1)
    end = ball_y + 4 + when(left & _late(ball_y + 4), 1)
    lost = (m.ball_x == PLUNGED_X) & (m.ball_y == PLUNGED_Y) & (m.ball_row >= GONE)
    x = jnp.where(lost, LOST_X, ball_x)
    y = jnp.where(lost, LOST_Y, top)
    return box(x, y, 2, end - top, ~lost | (m.ball_row < DEEP)).clip(0, 16, 160, 192)


def _ball_drawn(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Column and row of the ball before a wall has moved it."""
    touches = among(m.flags & 3, (Touch.IN_ROW, Touch.IN_COLUMN))
    turned = (m.sides & BOTH_SIDES) == BOTH_SIDES
    moved = (m.collides > 0) & (m.launched > 0) & touches & ~turned
    step = when(moved, jnp.where((m.way & Way.BY_1) != 0, 1, -1))
    across = (m.way & Way.IN_ROW) != 0
    return m.ball_x - when(across, step), m.ball_y - when(~across, step) - 3


def _late(y: jax.Array) -> jax.Array:
    """True if a ball that changes at an even row changes a row later left of `LATE_COLUMN`.

    The store at F352 shows a ball of the line before. It comes in the middle of the picture's rows,
    but early at F3AD, on every fourth even row.
    """
    row = y - PICTURE_ROWS.start & 31
    return (y >= PICTURE_ROWS.start) & (y < PICTURE_ROWS.stop) & (row < 16) & (row & 7 < 6)


def _flipper_boxes(m: Ram) -> Box:
    states = m.left_flipper, m.right_flipper
    extents = (
        [pick(state, table) for table in tables]
        for state, tables in zip(states, FLIPPERS, strict=True)
    )
    both = box(*(jnp.stack(pair) for pair in zip(*extents, strict=True)))
    return replace(both, x=both.x + np.array((64, 80)), y=176 + both.y)


def _up(m: Ram) -> jax.Array:
    """The drop targets; the RAM keeps only the first one as drawn.

    The other two are already up again if the last one has just been hit, or the ball was lost.
    """
    hit_slot = jnp.where(m.ball_x < TARGET_RIGHT, 1, 2)
    hit_now = (m.sound == Sound.HIT_TARGET) & (np.arange(3) == hit_slot)
    others = ((m.targets > 0) & (m.sound != Sound.ALL_HIT)) | hit_now
    return jnp.where(np.arange(3) == 0, m.first_target > 0, others)


def _rollovers(m: Ram) -> Box:
    """The number and the logo at the top."""
    number = m.rollover >> 3
    index = jnp.stack([number, jnp.full_like(number, Place.LOGO)])
    boxes = _picture(index, np.array((45, 109)), 56)
    return box(
        boxes.x, boxes.y, boxes.w, boxes.h, value=jnp.stack([number, jnp.zeros_like(number)])
    )


def _spinners(m: Ram) -> Box:
    index = Place.SPINS + reached(m.spinner, SPINS[1:])
    return _picture(jnp.stack([index, index]), np.array((30, 126)), 88)


TOKENS = (WHITE, GOLD, YELLOW, BLUE)
FLASHING = tuple(BLUE ^ flash for flash in FLASHES)
BY_FLASH = Shades(
    (156, 100),
    FLASHING,
    tuple(tuple(c ^ flash for c in TOKENS) for flash in FLASHES),
)
FIELD = (8, 16, 152, 192)
CORNERS = tuple(zip(BUMPER_X.tolist(), BUMPER_Y.tolist(), strict=True))
FRAMES = tuple((x, y, x + 16, y + 32) for x, y in CORNERS)
TARGETS = tuple((x, 24, x + 8, 40) for x in (60, 76, 92))
LOGOS = tuple((x, 152, x + 8, 168) for x in (60, 76, 92))
BALL = Bounds(BLUE, FIELD, (1, 2), ignore=_walls())
LOGO_ROWS = tuple((ROM.rows(0xC00 | LOGO, 7, top_first=True) >> 1).tolist())
NUMBER_OR_LOGO = replace(NUMBERS, signs=(LOGO_ROWS,))  # the logo counts 0
ROLLOVER_NUMBERS = tuple(Digits(NUMBER_OR_LOGO, (left,), 56) for left in (45, 109))
BONUS = tuple(Digits(NUMBERS, (x + 5,), y + 8, weights=(100,)) for x, y in CORNERS)
BUMPERS = Bounds((BLUE, GOLD), FRAMES, value=BONUS)


def _saver_key(m: Ram) -> jax.Array:
    return jnp.where(m.saver_key > 0, m.saver_key, -1)


GAME = Game(
    name="VideoPinball",
    rom=ROM,
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (158, 190), BLUE, mask=SAVER_MASK, beside=(5, 3)),
    shades=BY_FLASH,
    checks=Checks(
        rare=("Logo", "Rollover", "Spinner"),
        # The number of the ball.
        lives=(LivesAsNumber("LifeUsed", sign=-1, offset=4, early=1),),
    ),
    categories=(
        Category("Ball", BALL, doc="the ball"),
        Category(
            "Flipper",
            Bounds(WHITE, ((64, 176, 80, 192), (80, 176, 96, 192))),
            count=2,
            role="player",
            doc="left, right",
        ),
        Category("Plunger", Bounds((YELLOW, WHITE), (148, 120, 152, 192)), doc="at the right"),
        Category("Bumper", BUMPERS, count=3, attributes=("value",), doc="points"),
        Category("DropTarget", Bounds(GOLD, TARGETS), count=3, doc="diamonds at the top"),
        Category("Target", Bounds(GOLD, (76, 120, 86, 136)), doc="lit now and then"),
        Category(
            "Rollover",
            Bounds(GOLD, ((44, 56, 52, 72), (108, 56, 116, 72)), value=ROLLOVER_NUMBERS),
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
        display("DifficultyLevel", PLAYER_NUMBER.rule(YELLOW), doc="the player's number"),
        display("LifeUsed", BALL_NUMBER.rule(YELLOW), doc="the ball's number"),
        display("Score", SCORE.rule(YELLOW), role="score", doc="points"),
    ),
)
