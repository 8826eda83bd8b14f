"""Qbert: a figure hops on a pyramid of 21 cubes, which change colour; balls, Coily, Sam, disks.

Cube is the top face of a cube, row by row from the left; its value is 1 in the colour that all have
to get. The rows below the first one have a record each for what is hopping there. RedBall has eight
slots: as a ball goes down by a row with each step of the game, it stays in its slot. The score, the
lives and the first row's figures share the top of the screen: Score and Lives are on display only
while the player is not on the highest cube; then Score stays valid, Lives does not. Curse is what
a player who is hit says. The sides of cubes are scenery.

RAM: ALE's source (score, lives), OCAtari 2.2 and AtariARI (what the bytes are), and the ROM's code:
the kernel at F0D0-F4B1, hops and falls at F4B3-F639, one of five steps of the game before a frame
at F6C9-FAAE. The player moves after a frame is drawn; the kernel's counters have where he was.
Coily and another object in his row are drawn by turns.

Covered: levels and rounds (by writing RAM), both difficulties (the first has no RedBall), hops,
disks, falls, hits, the end of the game. Not exact: while the player falls, the pyramid is in front
of all figures, and REM's boxes are whole; balls and Coily are in front of it at other times. Five
lines of the two lowest rows of cubes show the player as he was a frame before, and lines are a row
apart on both sides of a column. As a fall costs a life, figures but the purple ball are cleared.
Black disks are not seen, nor Coily at the top beside the score. VEM tells a cube's value by the
colour of the score; while that is not on display, it is unknown.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box, choose
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import among, lookup, pick, reached
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Blobs, Bounds, ByColor, Gauge
from ocjax.vision.shapes import Shape

ROM = Rom("qbert", "484b0076816a104875e00467d431c2d2")
FONT = ROM.font(0x004, rows=7, stride=8)
COLUMNS = ROM.bytes(0xCC6, 15)  # x + 3 of the places that things hop to
TARGETS = ROM.bytes(0xE24, 21)  # colour that all cubes have to get, by the round
CUBE_COLORS = tuple(sorted({int(c) & 0xFE for c in ROM.bytes(0xE24, 0x20)[:30]}))
PICTURES = ROM.pictures(range(0xF00, 0x1000), 22)

BALL = 0x11
SQUASHED = 0x00
SAM = 0x26
COILY = range(0x3B, 0xA6)
NOTHING = 0x07
CURSE = 0xA6
RED = 0x44
PURPLE = 0x66
GREEN = 0xC4
CURSING = 0xFE
ORANGE = 0x34
GAME_OVER = 0xFE
MOST_ICONS = 5
CRY = 0x12, 0x14, 2  # `sound`, `tune`, `pause` on the frame on which a fall costs a life
RIDES = 1  # `travel`: on a disk
FALLS = 0x80  # this or more: down
UPWARD = 22  # `pose`
SINKS = 6  # greatest `hop` with squashed balls
# `player_x` and `player_y` on the highest cube
MIDDLE = 77
START = 0x19
SUMMIT = (76, 10)  # where Coily is on the highest cube
LEAP = 0x51  # and his picture there
STEPS = np.zeros(16, np.int32)  # of the game, modulo 8, by `dice`
for _i, _dice in enumerate((0, 1, 6, 15, 12, 13, 2, 11, 8, 9, 14, 7, 4, 5, 10, 3)):
    STEPS[_dice] = _i // 2

ROW = np.arange(5)
WINDOWS = np.array([39, 67, 96, 125, 155])  # first line of what hops in a row
# row whose sprites are a line lower on the left of a column
LATE = 3
LATE_END = 82
CUBES = tuple(
    (x, y, x + 20, y + 5)
    for y, lefts in {
        34: (68,),
        62: (56, 84),
        91: (44, 68, 96),
        120: (32, 56, 84, 108),
        149: (20, 44, 68, 96, 120),
        178: (8, 32, 56, 84, 108, 132),
    }.items()
    for x in lefts
)
DISKS = (12, 138, 20, 140), (140, 138, 148, 140)
TOP = 0x37  # least `y` at which the score is on display
FIELD = (0, 10, 160, 206)

# The kernel shows row `counter + 199 - line + lag` of the player's picture. The lag changes at some
# lines. Each line is drawn after and before the beam has reached the column of a threshold.
LINES = np.arange(10, 206)
RIGHT_LAG = ((10, 0), (32, 1), (61, 2), (89, 3), (96, 4), (147, 5), (148, 6), (177, 7))
LEFT_LAG = ((10, 0), (32, 1), (34, 2), (62, 3), (91, 4), (97, 5), (118, 4), (120, 5), (148, 6))
LEFT_LAG += ((155, 7), (178, 8), (183, 7), (185, 8))
THRESHOLDS = ((10, 0), (34, 100), (62, 112), (67, 124), (91, 127), (96, 115), (120, 124))
THRESHOLDS += ((125, 115), (150, 0), (154, 130), (183, 46))
SIDES = 46, 100, 112, 115, 124, 127, 130


def _by_line(steps: tuple[tuple[int, int], ...]) -> np.ndarray:
    """A number for each line, given by the lines from which on it changes."""
    return np.array([[value for first, value in steps if first <= line][-1] for line in LINES])


def _players() -> Pictures:
    """The player as the lines show him: by side, pose and counter."""
    right, left, limit = map(_by_line, (RIGHT_LAG, LEFT_LAG, THRESHOLDS))
    out = []
    for x in (0, *SIDES):
        lag = np.where(x >= limit, right, left)
        at = np.arange(256)[:, None] + 199 - LINES + lag & 255
        for pose in (0, UPWARD):
            out.extend(ROM.data[0xD00 + pose + at].astype(np.int32))
    return Pictures.of(out)


PLAYERS = _players()


class Ram(RamMap):
    lives = byte(8)  # less two
    dice = bits(10, count=4)  # low bits of the generator of random numbers, which steps twice
    shown = byte(11, 13, 15, 17, 19)  # low byte of the digits' pictures
    counter = byte(33)  # of the rows of the player's picture, at the end of the frame
    player_x = byte(43)  # x + 3, has moved
    column_x = byte(44, 45, 46, 47, 48)  # x + 3, row by row
    coily_row = byte(39)  # 255: not there
    other_picture, other_color = byte(41), byte(53)  # of what is not drawn in Coily's row
    sound, tune, pause = byte(113), byte(114), byte(116)
    swapped = byte(49)  # it is not Coily that is not drawn
    ready = byte(51)  # 0 while the RAM is cleared
    pose = byte(50)  # picture of the player
    travel = byte(59)
    hop = byte(56)  # counts down to the next hops
    position = byte((75, 60), (76, 61), (77, 62), (78, 63), (79, 64))  # coarse, fine
    beam = byte(65)  # low nibble of the player's position on the screen, + 41
    player_y = byte(67)  # counter at the beginning of the frame, has moved
    coily_column = byte(69)
    cube = byte(21, 52, 54, 83, 85, 87, 98, 100, 102, 104, 1, 3, 5, 7, 9, 32, 34, 36, 38, 40, 42)
    mirrored = bits(84, first=3)
    score = bcd((89, 90, 91))
    picture = byte(92, 93, 94, 96, 95)  # of what hops in each row
    round = byte(99)
    color = byte(107, 108, 109, 110, 111)
    disk = byte(112, 122)  # colour


def decode(m: Ram) -> dict[str, Box]:
    figures, kinds = _figures(m)
    digits = (m.shown - 3) >> 3 & 15
    number = jnp.sum(digits * np.array([10000, 1000, 100, 10, 1]))
    down = (_drawn_y(m) >= TOP) & _started(m)
    target = lookup(TARGETS, m.round)
    icons = (m.lives + 1 + jnp.where(_fell(m), 1, 0)) & 255
    x, y = np.array(CUBES).T[:2]
    return {
        "Player": _player(m),
        "Coily": _coily(m, figures, kinds),
        "Sam": _one(figures, kinds["Sam"]),
        "PurpleBall": _one(figures, kinds["PurpleBall"]),
        "RedBall": _red_balls(m, figures, kinds["RedBall"]),
        "GreenBall": _one(figures, kinds["GreenBall"]),
        "Curse": _one(figures, kinds["Curse"]),
        "Disk": _disks(m),
        "Cube": box(x, y, 20, 5, value=m.cube == target, color=m.cube),
        "Score": score_box(
            FONT,
            number,
            right=73,
            top=6,
            digits=5,
            leading_zeros=True,
            valid=_started(m),
            value=m.score,
            color=target,
        ),
        "Lives": box(
            33, 17, 8 * icons, 11, down & (icons <= MOST_ICONS), m.lives + 2 & 255, color=target
        ),
    }


def _drawn_y(m: Ram) -> jax.Array:
    """The counter at the beginning of the frame, as of a player who looks down."""
    y = m.counter + 189 + jnp.where(m.pose == UPWARD, 23, 0) & 255
    lower = (y >= TOP) | ((y == TOP - 1) & (m.player_y >= TOP))  # the display takes a count more
    return jnp.where(m.travel >= FALLS, m.player_y - 2, y + jnp.where(lower, 1, 0))


def _fell(m: Ram) -> jax.Array:
    """Whether a fall has just cost a life and cleared the RAM, after the frame was drawn."""
    cried = (m.sound == CRY[0]) & (m.tune == CRY[1]) & (m.pause == CRY[2])
    return cried & (m.travel >= FALLS)


def _started(m: Ram) -> jax.Array:
    """Whether the game has drawn a frame since a reset."""
    return (m.ready > 0) & ((m.counter > 0) | (m.player_y > START))


def _player(m: Ram) -> Box:
    """The player before he moved, by the rest of the counters of the kernel."""
    x = m.player_x + (m.beam + 15 - m.player_x & 15) - 11
    upward = m.pose == UPWARD
    index = 512 * reached(x + 4, SIDES) + jnp.where(upward, 256, 0) + m.counter
    facing = jnp.where(upward, 14, 10) + jnp.where(m.mirrored == 1, jnp.where(upward, 4, 12), 0)
    there, left = ((m.lives != GAME_OVER) | _fell(m)) & _started(m), m.mirrored == 1
    return PLAYERS.box(index, x, LINES[0], mirrored=left, valid=there, orientation=facing & 15)


def _figures(m: Ram) -> tuple[Box, dict[str, jax.Array]]:
    """What hops in the rows, and last what is not drawn in Coily's row; the kinds of all."""
    other_x = jnp.where(m.swapped == 0, lookup(COLUMNS, m.coily_column), 0)
    here = m.coily_row == ROW + 1
    other_x = jnp.where(m.swapped == 0, other_x, jnp.sum(jnp.where(here, m.column_x, 0))) - 3
    coarse, fine = m.position >> 8, m.position >> 4 & 15
    x = jnp.append(15 * coarse + (fine ^ 7) - 4, other_x)
    row = jnp.append(ROW, m.coily_row - 1)
    lost = _fell(m) & (m.color == PURPLE) & (m.swapped == 0)
    ball = jnp.where(m.hop <= SINKS, SQUASHED, BALL)
    picture = jnp.append(jnp.where(lost, ball, m.picture), m.other_picture)
    color = jnp.append(m.color, m.other_color)
    there = jnp.append(ROW >= 0, among(m.coily_row, range(1, 6)))
    y = pick(row, WINDOWS.tolist()) + jnp.where((row == LATE) & (x + 4 < LATE_END), 1, 0)
    balls = (picture == BALL) | (picture == SQUASHED)
    kinds = {
        "Coily": among(picture, COILY),
        "Sam": picture == SAM,
        "PurpleBall": balls & (color == PURPLE),
        "RedBall": balls & (color == RED),
        "GreenBall": balls & (color == GREEN),
        "Curse": picture == CURSE,
    }
    return PICTURES.box(picture, x, y, valid=there), kinds


def _one(figures: Box, wanted: jax.Array) -> Box:
    """The figure that is wanted, of which there is one at most."""
    place = (figures.x + 16 & 511) | figures.y << 9 | figures.w << 17 | figures.h << 21
    found = jnp.max(jnp.where(wanted & figures.valid, place, -1))
    x, y, w, h = (found & 511) - 16, found >> 9 & 255, found >> 17 & 15, found >> 21
    return box(x, y, w, h, found >= 0)


def _coily(m: Ram, figures: Box, kinds: dict[str, jax.Array]) -> Box:
    """Coily, who waits on the highest cube in a picture and a place of its own."""
    left, top, width, height = PICTURES.extent(jnp.asarray(LEAP))
    summit = box(SUMMIT[0] + left, SUMMIT[1] + top, width, height, (m.coily_row == 0) & _started(m))
    return choose(m.coily_row == 0, summit, _one(figures, kinds["Coily"]))


def _red_balls(m: Ram, figures: Box, red: jax.Array) -> Box:
    """Red balls, which go down a row with each step, by the row from which they began."""
    slot = (jnp.append(ROW, m.coily_row - 1) - lookup(STEPS, m.dice)) & 7
    return jax.vmap(lambda number: _one(figures, red & (slot == number)))(jnp.arange(8))


def _disks(m: Ram) -> Box:
    """The disks; the one that the player has just reached was drawn before."""
    left = (m.player_x < MIDDLE) == np.array((True, False))
    taken = (m.travel == RIDES) & (_drawn_y(m) == m.player_y) & left
    x, y = np.array(DISKS).T[:2]
    color = jnp.where(m.disk > 0, m.disk, jnp.max(m.disk)) + 1 & ~1  # both shimmer alike
    return box(x, y, 8, 2, (m.disk > 0) | ~_started(m) | taken, color=color)


CELLS = tuple((33 + 8 * i, 6, 41 + 8 * i, 13) for i in range(5))
PLAYER = Bounds(ORANGE, FIELD, ignore=DISKS)
monster = functools.partial(Blobs, region=FIELD)
SNAKE = monster(PURPLE, shapes=Shape(w=(6, 8), h=(12, 22)))
PURPLES = monster(PURPLE, shapes=Shape(w=(4, 7), h=(5, 9)))
GREENS = monster(GREEN, shapes=Shape(w=(4, 7), h=(5, 9)))
REDS = monster(RED, shapes=Shape(w=(4, 7), h=(5, 9)))
SAMS = monster(GREEN, shapes=Shape(w=(6, 8), h=(12, 18)))
SPOKEN = Bounds(CURSING, FIELD, min_size=(6, 12), ignore=DISKS)
POINTS = Bounds(CUBE_COLORS, (33, 6, 73, 13), value=Digits(FONT, range(33, 73, 8), 6))
ABOVE_FIGURES = (33, 6, 73, 10)  # rows of the score, in the colour that cubes have to get
ICONS = Bounds(CUBE_COLORS, (33, 17, 73, 28), value=Gauge(8, 8, 2))

GAME = Game(
    name="Qbert",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", PLAYER, attributes=("orientation",), doc="the figure"),
        Category("Coily", SNAKE, doc="the snake"),
        Category("Sam", SAMS, doc="changes cubes back"),
        Category("PurpleBall", PURPLES, doc="Coily's egg"),
        Category("RedBall", REDS, count=8, doc="by the row from which it began"),
        Category("GreenBall", GREENS, doc="stops all others when it is caught"),
        Category("Curse", SPOKEN, doc="said by the player who was hit"),
        Category(
            "Disk", Bounds(0, DISKS, inverse=True, min_size=(8, 2)), count=2, doc="left, right"
        ),
        Category(
            "Cube",
            Bounds(0, CUBES, inverse=True),
            count=21,
            attributes=("value",),
            color_row=2,
            value=ByColor(like=ABOVE_FIGURES),
            doc="row by row; 1: done",
        ),
        display("Score", POINTS, blinks=True, doc="points"),
        display("Lives", ICONS, doc="one more than the icons"),
    ),
)
