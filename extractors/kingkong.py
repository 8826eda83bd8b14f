"""King Kong: a climber goes up eight floors to free a captive, past the bombs that Kong throws.

Screen: Girders and walls are scenery. The captive walks above the building. Before a life begins,
the climbers that are left stand on the ground (Life, not Player).

Slots: Bomb has the game's records, from the one that was thrown last: a new bomb moves the others
to the next slot.

RAM: ALE's source (score, lives), and the ROM's code: f002-f351 draws, two lines a row. Bombs move
before the frame is drawn. What moves after it goes by the counter of frames: Kong on even ones, the
captive on every fourth one, the climber on the next one, then the fourth one changes the digits.

Covered: all modes, the levels' both halves (by writing the RAM), jumps, ladders, falls, lost lives,
the end of the game, odd and even frame skips.

Not exact: what the climber looked like before a jump or a fall began on this frame. The RAM does
not tell whether the climber has just ended a jump, and the joystick that it has is the one of the
next step. When a life ends, the RAM is set up anew before its last frame is drawn, which shows the
fallen climber and the bombs.

VEM: it sees no bomb that the climber mostly covers.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box, edges
from ocjax.console.ops import among, match, pick, when
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.registers import copies, packed_position, spacing
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.displays import NumberDisplay
from ocjax.vision.rules import Blobs, Bounds
from ocjax.vision.shapes import Shape

ROM = Rom("king_kong", "0dd4c69b5f9a7ae96a7a08329496779a")
FONT = ROM.font(0xBDB, rows=7, stride=8, dots=3, shift=5, dot=(4, 2), pitch=16, top_first=True)
SCORE = NumberDisplay(FONT, right=76, top=21, digits=4, leading_zeros=True)
BONUS = NumberDisplay(FONT, right=156, top=21, digits=3, leading_zeros=True)

LIME = 0x38  # of the digits
BROWN = 0x22  # Kong
PINK = 0x68  # the building
BLUE = 0xD4  # trousers, and the captive's dress
PALE = 0x28  # hair, and a part of a fuse
SKIN = 0x48
SHIRT = 0x58
SHOES = 0x08
CLIMBER_COLORS = (SHIRT, SKIN, BLUE, SHOES, PALE)
SHIRT_RGB = (92, 197, 135)
DRESS_RGB = (50, 50, 176)
FUSE = 0x2A
VIOLET = 0x82  # the widest row of an ordinary bomb
GREEN = 0x52  # that of a bomb with a bonus
BOMB_COLORS = (VIOLET, GREEN, FUSE, PALE, 0x26, 0x36, 0x44, 0x74, 0x78, 0x94, 0xC4, 0xD8)
WIDEST_ROW = 8  # line of a bomb

TOP = 40  # line of the field's first row; a row has two lines
ROWS = 96
FIELD = (0, TOP, 160, TOP + 2 * ROWS)
CAPTIVE_TOP = 20
RESCUED_X = 93  # of the captive, on the screen
RESCUER_X = 84
LEFTMOST = 1 - 19  # place
RIGHTMOST = 155 - 19
TURNS_LEFT = 102  # place of the captive
TURNS_RIGHT = 58
FIRST_DOWN = 1  # `steps` after the first rung
FIRST_UP = 11
GONE = 128  # `bomb_y` from which on there is no bomb

GRAPHICS = 0xD8D  # in the ROM; pictures are a row above what points to them
POSES = (0x01, 0x0A, 0x13, 0x1C, 0x25, 0x2E, 0x37)  # what points to the climber's pictures
POSE_ROWS = (8, 8, 8, 8, 8, 8, 4)
CLIMBERS = Pictures.of(
    ROM.rows(GRAPHICS + 1 + pose, rows) for pose, rows in zip(POSES, POSE_ROWS, strict=True)
)
BOMBS = Pictures.of(ROM.rows(GRAPHICS + 1 + pointer, 7) for pointer in (0x3C, 0x44))
KONG_ROWS = 18
KONG = Pictures.of([ROM.rows(GRAPHICS + 1 + 0x5E, KONG_ROWS)])
CAPTIVES = Pictures.of(ROM.rows(GRAPHICS + last, 8) for last in (0x4D, 0x56))

FLOORS = (39, 59, 83, 107, 131, 155, 179, 203)  # lines of the girders above each floor
MIDDLE = (76,)  # columns of a floor's ladders
SIDES = (12, 140)
UPPER_SIDES = (20, 132)
LADDER_COLUMNS = (MIDDLE, UPPER_SIDES, MIDDLE, SIDES, MIDDLE, SIDES, MIDDLE, SIDES)
LADDERS = tuple(
    (x, line + 4, x + 8, line + (18 if line == FLOORS[0] else 22))
    for line, columns in zip(FLOORS, LADDER_COLUMNS, strict=True)
    for x in columns
)


class Pose:  # index into `POSES`
    STEP = 0
    STRIDE = 1
    STANDS = 2
    JUMPS = 3
    CLIMBS = 4  # two pictures
    LIES = 6


STEPS = (Pose.STEP, Pose.STRIDE, Pose.STANDS, Pose.STRIDE)


class State:  # of `Ram.state`
    KONG_CLIMBS = 3
    WAITS = 4  # the climbers that are left are shown
    LOWER_HALF = 5
    KONG_LEAVES = 6
    UPPER_HALF = 7
    KONG_RETURNS = 8
    HIT = 9
    FALLS = 10
    LIES = 11
    RESCUED = 12


class Turn:  # of `Ram.turn`: what the game does after it has drawn the frame
    CAPTIVE = 0  # and Kong
    CLIMBER = 1
    KONG = 2
    DIGITS = 3


class Bonus:  # of `Ram.bomb_picture`
    BOMB = 0x44


class Flight:  # of `Ram.kong_flight`
    LANDED = 255
    TOP = 16  # rises before, falls after


class Sound:  # of `Ram.sound`
    RUNG = 0x4C
    RUNG_BEGAN = 2  # `Ram.sound_time` on the frame on which it begins


class Ram(RamMap):
    clock = byte(0)
    score = bcd((2, 3))
    bonus = bcd(4)  # tens
    steps = byte(27)  # of the climber
    climber = byte(28)  # place of the climber among the two records
    kong = byte(29)  # that of Kong
    y = byte(32, 33)  # the row below
    x = byte(35, 36)
    picture = byte(38, 39)
    icons = bits(41, count=3)  # NUSIZ: copies of the climber
    faces_left = bits(40, 41, first=3)
    bomb_y = byte(*range(42, 50))
    bomb_x = byte(*range(51, 59))
    bomb_picture = byte(*range(60, 68))
    captive_x = byte(76)
    captive_left = bits(77, first=3)  # which way the captive walks
    kong_left = bits(78)
    kong_flight = byte(79)
    second = byte(84)  # 64 frames each
    captive = byte(87)  # random number that moves the captive
    stick = byte(88)
    released = bits(89, first=7)  # the button
    turn = bits(90, count=2)
    jumps = bits(100, first=7)
    climbs = bits(100, first=6)
    falls = bits(100, first=5)
    goes = bits(100, count=2)  # 3: straight up; 1: to the right
    jump = byte(101)  # steps left
    sound = byte(102)
    sound_time = byte(104)
    state = byte(109)
    lives = byte(110)


class Drawn(NamedTuple):
    """The state when the frame was drawn: rows are those below a figure, places those of columns."""

    x: jax.Array  # of the climber, place
    y: jax.Array  # row
    pose: jax.Array
    kong_x: jax.Array
    kong_y: jax.Array
    captive_x: jax.Array
    captive_look: jax.Array  # index into `CAPTIVES`
    bonus: jax.Array  # tens


def decode(m: Ram) -> dict[str, Box]:
    drawn = as_drawn(m)
    return {
        "Player": _climber(m, drawn),
        "Girlfriend": _captive(m, drawn),
        "Enemy": _kong(drawn),
        "Bomb": _bombs(m),
        "Ladder": edges(*np.array(LADDERS).T),
        "Life": _icons(m),
        "Score": SCORE.box(m.score, valid=m.state > State.KONG_CLIMBS - 2),
        "BonusPoints": BONUS.box(10 * drawn.bonus, valid=m.state > State.KONG_CLIMBS - 2),
    }


def as_drawn(m: Ram) -> Drawn:
    """Take back what the game has moved since it drew the frame."""
    climber = [jnp.where(m.climber == 0, *field) for field in (m.x, m.y, m.picture, m.faces_left)]
    kong_x, kong_y = (jnp.where(m.kong == 0, *field) for field in (m.x, m.y))
    x, y, pose = _climber_before(m, *climber)
    dx, dy = _kong_step(m)
    captive_x, look = _captive_before(m)
    counted = (m.turn == Turn.DIGITS) & ((m.clock & 0x3C) == 0) & _plays(m)
    return Drawn(
        x, y, pose, _place(kong_x) - dx, kong_y - dy, captive_x, look, m.bonus + when(counted, 1)
    )


def _place(code: jax.Array) -> jax.Array:
    """The first column of a figure, from what positions it."""
    return packed_position(code) - 19


def _plays(m: Ram) -> jax.Array:
    return (m.state >= State.LOWER_HALF) & (m.state < State.HIT)


def _climber_before(
    m: Ram, code: jax.Array, y: jax.Array, picture: jax.Array, left: jax.Array
) -> tuple[jax.Array, jax.Array, jax.Array]:
    x, pose = _place(code), match(*((picture == p, i) for i, p in enumerate(POSES)), otherwise=0)
    moves = (m.turn == Turn.CLIMBER) & (_plays(m) | (m.state == State.FALLS) | (m.state == State.LIES))
    up, down, to_left, to_right = ((m.stick >> i & 1) == 0 for i in range(4))
    jumps = (m.jumps == 1) & (m.jump > 0)
    began = (m.jumps == 1) & (m.jump == 14)
    rung = (m.sound == Sound.RUNG) & (m.sound_time == Sound.RUNG_BEGAN)
    falls = (m.falls == 1) & rung
    climbs = (m.falls == 0) & rung & ~jumps
    edge = jnp.where(left == 1, x == LEFTMOST, x == RIGHTMOST)
    walks = (
        ~jumps & (m.climbs == 0) & (m.falls == 0) & ~up & ~down & (to_left | to_right) & ~edge
    ) & (m.state != State.LIES)
    forward = jnp.where(left == 1, -1, 1)
    jumped = match((m.goes == 1, 1), (m.goes == 3, 0), (m.goes == 2, -1), otherwise=-1)
    dx = match((began, 0), (jumps, jumped), (walks, forward), otherwise=0)
    rises = match((began, 0), (m.jump > 7, -1), (m.jump < 7, 1), otherwise=0)
    dy = match((falls, 1), (jumps, rises), (climbs, jnp.where(up, -1, 1)), otherwise=0)
    stepped = pick(m.steps - 1 & 3, STEPS)
    before = match(
        (began & (m.steps == 0), Pose.STANDS),
        (began, pick(m.steps & 3, STEPS)),
        (falls & (m.state == State.LIES), Pose.JUMPS),
        ((m.jumps == 1) & (m.jump == 0) & (m.released == 1), Pose.JUMPS),
        (climbs & among(m.steps, (FIRST_DOWN, FIRST_UP)), Pose.STANDS),
        (climbs, Pose.CLIMBS + (y & 1)),
        (~jumps & walks & (m.steps == 1), Pose.STANDS),
        (~jumps & walks, stepped),
        otherwise=pose,
    )
    return x - when(moves, dx), y - when(moves, dy), jnp.where(moves, before, pose)


def _climber(m: Ram, drawn: Drawn) -> Box:
    left = jnp.where(m.climber == 0, *m.faces_left)
    row = drawn.y - pick(drawn.pose, POSE_ROWS)
    there = (m.state >= State.WAITS) & (m.climber != m.kong)
    at = CLIMBERS.extent(drawn.pose, mirrored=left == 1)
    return _figure(at, drawn.x, row, there)


def _figure(
    extent: tuple[jax.Array, ...], x: jax.Array, row: jax.Array, valid: jax.Array, **fields: jax.Array
) -> Box:
    """The box of a picture whose first column and row are at a place and a row."""
    left, top, width, height = extent
    shown = box(x + left, TOP + 2 * (row + top), width, 2 * height, valid, **fields)
    return shown.clip(*FIELD)


def _kong_step(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Columns and rows that Kong has moved."""
    flies = among(m.state, (State.KONG_CLIMBS, State.KONG_LEAVES, State.KONG_RETURNS))
    arrived = (m.state == State.WAITS) & (m.climber == m.kong) & (m.turn == Turn.CAPTIVE)
    moved = ((m.turn & 1) == 0) & (flies | arrived)
    landed = m.kong_flight == Flight.LANDED
    left = m.kong_left ^ when(landed, 1)
    rise = match((m.kong_flight < Flight.TOP, -1), (m.kong_flight == Flight.TOP, 0), otherwise=1)
    return when(moved, 1 - 2 * left), when(moved, rise)


def _kong(drawn: Drawn) -> Box:
    left, top, width, height = KONG.extent(jnp.int32(0))
    y = TOP + 2 * (drawn.kong_y - KONG_ROWS + top)
    return box(drawn.kong_x + 1 + 2 * left, y, 2 * width, 2 * height).clip(*FIELD)


def _captive_before(m: Ram) -> tuple[jax.Array, jax.Array]:
    x, now = _place(m.captive_x), m.turn == Turn.CAPTIVE
    moved = now & (m.captive & 3 >= 2)
    drew = now & ((m.clock & 0x0C) == 0)
    before = jnp.where(m.captive & 1 == 1, (m.captive ^ 0x4D) >> 1 | 0x80, m.captive >> 1)
    number = jnp.where(drew, before, m.captive)
    look = when((number & 0x0C) == 0, 1)
    return x - when(moved, 1 - 2 * m.captive_left), look


def _captive(m: Ram, drawn: Drawn) -> Box:
    left, top, width, height = CAPTIVES.extent(drawn.captive_look)
    rescued = m.state == State.RESCUED
    x = jnp.where(rescued, RESCUED_X, drawn.captive_x + left)
    return box(x, CAPTIVE_TOP + 2 * top, jnp.where(rescued, 8, width), 2 * height + 1, m.state >= State.WAITS)


def _bombs(m: Ram) -> Box:
    bonus = m.bomb_picture == Bonus.BOMB
    extent = BOMBS.extent(when(bonus, 1))
    color = jnp.where(bonus, GREEN, VIOLET)
    return _figure(extent, _place(m.bomb_x), m.bomb_y - 7, m.bomb_y < GONE, color=color)


def _icons(m: Ram) -> Box:
    """The climbers that wait beside the first one, and all stand in the same way."""
    place = np.arange(1, 3)
    x = jnp.where(m.climber == 0, *m.x)
    there = (m.state == State.WAITS) & (m.climber != m.kong) & (place < copies(m.icons))
    left, top, width, height = CLIMBERS.extent(jnp.int32(0))
    y = jnp.where(m.climber == 0, *m.y) - 8 + top
    return box(_place(x) + left + spacing(m.icons) * place, TOP + 2 * y, width, 2 * height, there)


CLIMBER = Blobs(CLIMBER_COLORS, FIELD, Shape(w=(1, 8), h=(7, 16)))
WAITING = Bounds(CLIMBER_COLORS, ((45, 212, 55, 228), (61, 212, 71, 228)), (8, 16), (8, 16), exclude=("Player",))
BOMB = Blobs(BOMB_COLORS, FIELD, Shape(w=(6, 8), h=(10, 14)))
CAPTIVE = Bounds((PALE, SKIN, SHIRT, BLUE), (56, 20, 112, 37), max_size=(8, 17))
RUNGS = Bounds(PINK, LADDERS)

GAME = Game(
    name="KingKong",
    rom=ROM,
    ram=Ram,
    decode=decode,
    screen=(250, 160),
    pal=True,
    categories=(
        Category("Player", CLIMBER, rgb=SHIRT_RGB, doc="the climber"),
        Category("Girlfriend", CAPTIVE, rgb=DRESS_RGB, doc="the captive"),
        Category("Enemy", Bounds(BROWN, FIELD), doc="Kong"),
        Category("Bomb", BOMB, count=8, color_row=WIDEST_ROW, doc="what Kong throws"),
        Category("Ladder", RUNGS, count=len(LADDERS), doc="upper first, left before right"),
        display("Life", WAITING, count=2, rgb=SHIRT_RGB, attributes=(), doc="climbers in reserve"),
        display("Score", SCORE.rule(LIME), doc="points"),
        display("BonusPoints", BONUS.rule(LIME), doc="points for a rescue, counted down"),
    ),
)
