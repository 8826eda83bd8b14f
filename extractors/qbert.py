"""Q*bert: a figure hops on a pyramid of 21 cubes, which change colour; balls, Coily, Sam, disks.

Picture: docs/games/Qbert.png

Screen: the score, the lives and the first row's figures share the top of the screen. Score and
Lives are displayed only while the player is not on the highest cube; while hidden, Score stays
valid and Lives does not. Curse is the speech of a hit player. The sides of cubes are scenery.

Slots: Cube is the top face of a cube, row by row from the left. Its value is 1 in the target
colour. Each row below the first one has a record for the figure that hops there. RedBall has eight
slots: a ball goes down a row with each step of the game and keeps its slot.

RAM: ALE's source (score, lives), OCAtari 2.2 and AtariARI (meaning of the bytes), and the ROM's
code: the kernel at F0D0-F4B1, hops and falls at F4B3-F639, one of five steps of the game before a
frame at F6C9-FAAE. The player moves after a frame is drawn; the kernel's counters have his drawn
position. Coily and another object in his row are drawn on alternate frames.

Covered: levels and rounds (by writing RAM), both difficulties (the first has no RedBall), hops,
disks, falls, hits, the end of the game.

Not exact: while the player falls, the pyramid is in front of all figures, and REM's boxes are
complete; balls and Coily are in front of it at other times. In five lines of the two lowest rows of
cubes, the player looks as he did a frame before. Lines are a row apart on both sides of a
column. When a fall costs a life, the game clears all figures except the purple ball.

VEM: it misses black disks, and Coily at the top beside the score. It gets a cube's value from the
colour of the score; while the score is hidden, the value is unknown.
"""

import functools
import itertools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    UNKNOWN_VALUE,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    IconRow,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Shape,
    Variants,
    among,
    bcd,
    bits,
    box,
    byte,
    choose,
    display,
    flag,
    high,
    lookup,
    pick,
    position,
    reached,
    when,
)

ROM = Rom("qbert", "484b0076816a104875e00467d431c2d2")
FONT = ROM.font(0x004, rows=7, stride=8)
COLUMNS = ROM.bytes(0xCC6, 15)  # x + 3 of the positions of hops
TARGETS = ROM.bytes(0xE24, 21)  # target colour of all cubes, by round
CUBE_COLORS = tuple(sorted({int(c) & 0xFE for c in ROM.bytes(0xE24, 0x20)[:30]}))
FIGURE_PICTURES = ROM.pictures(range(0xF00, 0x1000), 22)


class Picture:  # of `Ram.picture` and `Ram.other_picture`
    SQUASHED = 0x00
    BALL = 0x11
    SAM = 0x26
    COILY = range(0x3B, 0xA6)
    COILY_LEAPS = 0x51
    CURSE = 0xA6


class Color:  # of `Ram.color` and on the screen
    ORANGE = 52
    RED = 68
    PURPLE = 102
    GREEN = 196
    CURSE = 254


class Cry:  # on the frame on which a fall costs a life
    SOUND = 18
    TUNE = 20
    PAUSE = 2


class Travel:  # of `Ram.travel`
    RIDES = 1  # on a disk
    FALLS = 128  # at least: it falls


GAME_OVER = 254  # `lives`
SHOWN_ICONS = 5  # at most
UPWARD_POSE = 22  # `pose`
SINKS = 6  # greatest `hop` with squashed balls
MIDDLE = 77  # `player_x` on the highest cube
START = 25  # `player_y` there
SCORE_Y = 55  # least `player_y` with the score on display
SUMMIT = (76, 10)  # Coily's position on the highest cube
# Sequence of `dice` from the generator of random numbers; a step of the game takes two values.
DICE = tuple(itertools.accumulate(range(15), lambda last, _: 5 * last + 1 & 15, initial=0))
DICE_STEPS = np.argsort(DICE) // 2  # of the game, modulo 8, by `dice`

SCORE = NumberDisplay(FONT, right=73, top=6, digits=5, leading_zeros=True)
LIVES = IconRow(left=33, top=17, width=8, height=11, pitch=8)
FIGURE_ROW = np.arange(5)
WINDOWS = np.array([39, 67, 96, 125, 155])  # first line of a row's figure
LATE_ROW = 3  # its sprites are a line lower
LATE_END = 82  # left of this column
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
DISKS = ((12, 138, 20, 140), (140, 138, 148, 140))
FIELD = (0, 10, 160, 206)

# The kernel shows row `counter + 199 - line + lag` of the player's picture. The lag changes at some
# lines. Each line has two lags, for columns right and left of a threshold of the beam.
LINES = np.arange(10, 206)
RIGHT_LAG = {10: 0, 32: 1, 61: 2, 89: 3, 96: 4, 147: 5, 148: 6, 177: 7}
LEFT_LAG = {
    **{10: 0, 32: 1, 34: 2, 62: 3, 91: 4, 97: 5, 118: 4},
    **{120: 5, 148: 6, 155: 7, 178: 8, 183: 7, 185: 8},
}
THRESHOLDS = {
    **{10: 0, 34: 100, 62: 112, 67: 124, 91: 127, 96: 115},
    **{120: 124, 125: 115, 150: 0, 154: 130, 183: 46},
}
SIDES = (46, 100, 112, 115, 124, 127, 130)


def _by_line(steps: dict[int, int]) -> np.ndarray:
    """A number for each line, from the lines at which it changes."""
    changes = np.searchsorted(list(steps), LINES, side="right") - 1
    return np.array(list(steps.values()))[changes]


def _player_pictures() -> Pictures:
    """The player as the lines show him: by side, pose and counter."""
    right, left, limit = map(_by_line, (RIGHT_LAG, LEFT_LAG, THRESHOLDS))
    out = []
    for x in (0, *SIDES):
        lag = np.where(x >= limit, right, left)
        at = np.arange(256)[:, None] + 199 - LINES + lag & 255
        for pose in (0, UPWARD_POSE):
            out.extend(ROM.data[0xD00 + pose + at].astype(np.int32))
    return Pictures.of(out)


PLAYERS = _player_pictures()


class Ram(RamMap):
    lives = byte(8)  # minus two
    dice = bits(10, count=4)  # low bits of the generator of random numbers
    shown = byte(11, 13, 15, 17, 19)  # low byte of the digits' pictures
    counter = byte(33)  # of the rows of the player's picture, at the end of the frame
    coily_row = byte(39)  # 255: no Coily
    other_picture = byte(41)  # of the hidden figure in Coily's row
    other_color = byte(53)  # of the hidden figure in Coily's row
    player_x = byte(43)  # x + 3, has moved
    column_x = byte(44, 45, 46, 47, 48)  # x + 3, row by row
    swapped = byte(49)  # the hidden figure is not Coily
    pose = byte(50)  # picture of the player
    ready = byte(51)  # 0 while the RAM is cleared
    hop = byte(56)  # counts down to the next hops
    travel = byte(59)
    coarse = byte(75, 76, 77, 78, 79)  # x + 4 in the chip's coding, row by row
    fine = high(60, 61, 62, 63, 64)
    beam = byte(65)  # low nibble of the player's position on the screen, plus 41
    player_y = byte(67)  # counter at the beginning of the frame, has moved
    coily_column = byte(69)
    cube = byte(21, 52, 54, 83, 85, 87, 98, 100, 102, 104, 1, 3, 5, 7, 9, 32, 34, 36, 38, 40, 42)
    mirrored = flag(84, bit=3)
    score = bcd((89, 90, 91))
    picture = byte(92, 93, 94, 96, 95)  # of the figure in each row
    round = byte(99)
    color = byte(107, 108, 109, 110, 111)
    disk = byte(112, 122)  # colour
    sound = byte(113)
    tune = byte(114)
    pause = byte(116)


def decode(m: Ram) -> dict[str, Box]:
    figures, kinds = _figure_boxes(m)
    return {
        "Player": _player_box(m),
        "Coily": _coily_box(m, figures, kinds),
        "Sam": _one(figures, kinds["Sam"]),
        "PurpleBall": _one(figures, kinds["PurpleBall"]),
        "RedBall": _red_balls(m, figures, kinds["RedBall"]),
        "GreenBall": _one(figures, kinds["GreenBall"]),
        "Curse": _one(figures, kinds["Curse"]),
        "Disk": _disk_boxes(m),
        "Cube": _cube_boxes(m),
        "Score": _score_box(m),
        "Lives": _lives_box(m),
    }


def _target(m: Ram) -> jax.Array:
    """The target colour of all cubes, which is also the display's colour."""
    return lookup(TARGETS, m.round)


def _cube_boxes(m: Ram) -> Box:
    x, y = np.array(CUBES).T[:2]
    return box(x, y, 20, 5, value=m.cube == _target(m), color=m.cube)


def _score_box(m: Ram) -> Box:
    digits = (m.shown - 3) >> 3 & 15
    shown = jnp.sum(digits * np.array([10000, 1000, 100, 10, 1]))
    return SCORE.box(shown, valid=_started(m), value=m.score, color=_target(m))


def _lives_box(m: Ram) -> Box:
    icon_count = (m.lives + 1 + when(_fell(m), 1)) & 255
    down = (_drawn_y(m) >= SCORE_Y) & _started(m)
    there = down & (icon_count <= SHOWN_ICONS)
    return LIVES.box(icon_count, there, value=m.lives + 2 & 255, color=_target(m))


def _drawn_y(m: Ram) -> jax.Array:
    """The counter at the beginning of the frame, converted to a player who looks down."""
    y = m.counter + 189 + when(m.pose == UPWARD_POSE, 23) & 255
    # The display takes another count.
    lower = (y >= SCORE_Y) | ((y == SCORE_Y - 1) & (m.player_y >= SCORE_Y))
    return jnp.where(m.travel >= Travel.FALLS, m.player_y - 2, y + when(lower, 1))


def _fell(m: Ram) -> jax.Array:
    """True if a fall has just cost a life and cleared the RAM, after the frame was drawn."""
    cried = (m.sound == Cry.SOUND) & (m.tune == Cry.TUNE) & (m.pause == Cry.PAUSE)
    return cried & (m.travel >= Travel.FALLS)


def _started(m: Ram) -> jax.Array:
    """True if the game has drawn a frame since a reset."""
    return (m.ready > 0) & ((m.counter > 0) | (m.player_y > START))


def _player_box(m: Ram) -> Box:
    """The player before he moved, from the kernel's remaining counters."""
    x = m.player_x + (m.beam + 15 - m.player_x & 15) - 11
    upward = m.pose == UPWARD_POSE
    left = m.mirrored
    index = 512 * reached(x + 4, SIDES) + when(upward, 256) + m.counter
    facing = jnp.where(upward, jnp.where(left, 2, 14), jnp.where(left, 6, 10))
    there = ((m.lives != GAME_OVER) | _fell(m)) & _started(m)
    return PLAYERS.box(index, x, LINES[0], mirrored=left, valid=there, orientation=facing)


def _figure_boxes(m: Ram) -> tuple[Box, dict[str, jax.Array]]:
    """The figures in the rows, then the hidden one in Coily's row; the kinds of all."""
    x = jnp.append(position(m.coarse, m.fine) - 4, _other_x(m))
    row = _rows(m)
    y = pick(row, WINDOWS.tolist()) + when((row == LATE_ROW) & (x + 4 < LATE_END), 1)
    picture = jnp.append(_drawn_pictures(m), m.other_picture)
    there = jnp.append(FIGURE_ROW >= 0, among(m.coily_row, range(1, 6)))
    kinds = _kinds_of(picture, jnp.append(m.color, m.other_color))
    return FIGURE_PICTURES.box(picture, x, y, valid=there), kinds


def _rows(m: Ram) -> jax.Array:
    return jnp.append(FIGURE_ROW, m.coily_row - 1)


def _other_x(m: Ram) -> jax.Array:
    """The column of the hidden figure in Coily's row: Coily, or his partner."""
    coily = lookup(COLUMNS, m.coily_column)
    other = jnp.sum(when(m.coily_row == FIGURE_ROW + 1, m.column_x))
    return jnp.where(m.swapped == 0, coily, other) - 3


def _drawn_pictures(m: Ram) -> jax.Array:
    """The drawn pictures of the rows. A fall that costs a life clears all but the purple colour."""
    lost = _fell(m) & (m.color == Color.PURPLE) & (m.swapped == 0)
    ball = jnp.where(m.hop <= SINKS, Picture.SQUASHED, Picture.BALL)
    return jnp.where(lost, ball, m.picture)


def _kinds_of(picture: jax.Array, color: jax.Array) -> dict[str, jax.Array]:
    ball = (picture == Picture.BALL) | (picture == Picture.SQUASHED)
    return {
        "Coily": among(picture, Picture.COILY),
        "Sam": picture == Picture.SAM,
        "PurpleBall": ball & (color == Color.PURPLE),
        "RedBall": ball & (color == Color.RED),
        "GreenBall": ball & (color == Color.GREEN),
        "Curse": picture == Picture.CURSE,
    }


def _one(figures: Box, wanted: jax.Array) -> Box:
    """The wanted figure; a game has one at most."""
    place = (figures.x + 16 & 511) | figures.y << 9 | figures.w << 17 | figures.h << 21
    found = jnp.max(jnp.where(wanted & figures.valid, place, -1))
    x = (found & 511) - 16
    y = found >> 9 & 255
    w = found >> 17 & 15
    h = found >> 21
    return box(x, y, w, h, found >= 0)


def _coily_box(m: Ram, figures: Box, kinds: dict[str, jax.Array]) -> Box:
    """Coily; on the highest cube he waits in a special picture and position."""
    left, top, width, height = FIGURE_PICTURES.extent(jnp.asarray(Picture.COILY_LEAPS))
    waiting = box(
        SUMMIT[0] + left, SUMMIT[1] + top, width, height, (m.coily_row == 0) & _started(m)
    )
    return choose(m.coily_row == 0, waiting, _one(figures, kinds["Coily"]))


def _red_balls(m: Ram, figures: Box, red: jax.Array) -> Box:
    """Red balls, which go down a row with each step; their slots follow from their first step."""
    slot = (_rows(m) - lookup(DICE_STEPS, m.dice)) & 7
    return jax.vmap(lambda number: _one(figures, red & (slot == number)))(jnp.arange(8))


def _disk_boxes(m: Ram) -> Box:
    """The disks, including one that the player has just reached: it was drawn before."""
    left = (m.player_x < MIDDLE) == np.array((True, False))
    taken = (m.travel == Travel.RIDES) & (_drawn_y(m) == m.player_y) & left
    x, y = np.array(DISKS).T[:2]
    color = jnp.where(m.disk > 0, m.disk, jnp.max(m.disk)) + 1 & ~1  # both shimmer alike
    return box(x, y, 8, 2, (m.disk > 0) | ~_started(m) | taken, color=color)


PLAYER = Bounds(Color.ORANGE, FIELD, ignore=DISKS)
monster = functools.partial(Blobs, region=FIELD)
SNAKE = monster(Color.PURPLE, shapes=Shape(w=(6, 8), h=(12, 22)))
PURPLES = monster(Color.PURPLE, shapes=Shape(w=(4, 7), h=(5, 9)))
GREENS = monster(Color.GREEN, shapes=Shape(w=(4, 7), h=(5, 9)))
REDS = monster(Color.RED, shapes=Shape(w=(4, 7), h=(5, 9)))
SAMS = monster(Color.GREEN, shapes=Shape(w=(6, 8), h=(12, 18)))
SPOKEN = Bounds(Color.CURSE, FIELD, min_size=(6, 12), ignore=DISKS)
ABOVE_FIGURES = np.s_[:, 6:10, 33:73]  # of frames: the score, in the target colour of the cubes


def done_by_color(color: jax.Array, frames: jax.Array) -> jax.Array:
    """True if cubes have the score's colour, which is their target; unknown without the score."""
    # The background is black, 0.
    shown = jnp.max(frames[ABOVE_FIGURES], axis=(1, 2)).astype(jnp.int32)[None]
    return jnp.where(shown > 0, (color == shown).astype(jnp.int32), UNKNOWN_VALUE)


ICONS = LIVES.rule(CUBE_COLORS, (33, 17, 73, 28), single=2)

GAME = Game(
    name="Qbert",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        agreement={"last": 0.96},  # the score is hidden, and a fall clears figures
        # While the score is not shown, VEM lacks the colour that cubes have to get.
        known={"Cube": 0.55},
    ),
    variants=Variants(
        difficulties={
            0: "no red balls",
            1: "red balls",
        },
        source="play of all difficulties in the emulator",
        starts={
            "round=6": "the colours of a later round",
        },
    ),
    categories=(
        Category("Player", PLAYER, attributes=("orientation",), role="player", doc="the figure"),
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
            value=done_by_color,
            doc="row by row; 1: done",
        ),
        display("Score", SCORE.rule(CUBE_COLORS), blinks=True, role="score", doc="points"),
        display("Lives", ICONS, role="lives", doc="one more than the icons"),
    ),
)
