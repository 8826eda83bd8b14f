"""CrazyClimber: a climber on a skyscraper, windows that shut, throwers, a bird, a helicopter.

Slots of Window are row * 6 + column; row 0 is the one that scrolls in at the top, and a window that
is partly shut is what is left of it. Projectile is whatever falls: pots, bars, eggs, girders, which
OCAtari's VEM names by colour. The walls and the open sky between them are scenery.

RAM: ALE's source (score, lives), OCAtari 2.2 (what the records are), and the ROM's code. The game
computes in the blank lines after a frame, so that the RAM has what is on the screen. The drawing
loop counts steps rather than lines, and skips some; `decode` counts them likewise.

Covered: all modes and difficulties, falls, the end of the game; the roof with the helicopter from
RAM that was set by hand. The climber and what falls take turns where they are on the same rows.
Girders that fall from high floors, four times as wide as their pictures, were set off by hand, too;
VEM does not see them, because their colours are random. Not exact: windows of which sprites cover
whole rows are seen too small; on the display of the ended game Score and Bonus are not valid.
"""

import functools
import itertools
from collections.abc import Sequence
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import lookup, reached
from ocjax.console.ram import RamMap, bits, byte, high, low
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Blobs, Bounds
from ocjax.vision.shapes import Shape

ROM = Rom("crazy_climber", "55ef7b65066428367844342ed59f956c")
FONT = ROM.font([0xF0B + i for i in range(10)], rows=7, step=11)
GREEN = 202
GREEN_2 = 104
LEGS = 76
RED = 70
WHITE = 12
YELLOW = 26
BLUE = 154
PURPLE = 106
BODY = 134
ROTOR = 10
BUILDING = (40, 43, 120, 198)
EAST = 4
WEST = 12
ROW, COLUMN = np.ogrid[:13, :6]  # of windows
WINDOW_X = np.array((44, 56, 68, 84, 96, 108))
DISTANCE = np.array((0, 1, 2, 2, 1, 0))  # column -> window of the left half
OPEN = (0b111, 0b110, 0b011, 0b100, 0b100, 0)  # windows of the left half, bit 0 the outer one
THING_ROWS = 16  # at most, of the picture of what falls
LAST_ROW = 11  # of the building
ROW_STEPS = 11  # of the drawing loop in a row of the building
# rows where it counts one more down to the thrower
ZONE_START = 2
ZONE_END = 7
BIRD_STEPS = 2  # that the drawing loop counts more where it draws the bird


def _halves(table: int, count: int) -> tuple[int, ...]:
    """Which windows of the left half are holes in pairs of playfield registers."""
    out = []
    for i in range(count):
        first, second = ROM.bytes(table + 2 * i, 2).tolist()
        holes = (first & 1 == 0, second >> 2 & 3 == 0, second >> 5 & 3 == 0)
        out.append(sum(1 << k for k, hole in enumerate(holes) if hole))
    return tuple(out)


SHUTTERS = _halves(0xC05, 10)


def _climber(base: int) -> np.ndarray:
    rows = ROM.rows(base, 31, top_first=True)  # the loop skips two
    return np.concatenate([rows[1:13], rows[14:]])


LIMBS = Pictures.of([_climber(0xD00 + i) for i in range(512)])
HEADS = ROM.pictures(range(0xD9B, 0xDA3), 6, top_first=True)
BIRDS = ROM.pictures(range(0xC00, 0xD00), 12, top_first=True)
INK = ROM.bytes(0xC00, 0x310)
# Which rows of the pictures of what falls are not empty, a bit a row.
FILLED = [sum(1 << k for k in range(THING_ROWS) if INK[i + k]) for i in range(512)]


class Ram(RamMap):
    score = byte(5, 4, 3, 2)
    bonus = byte(8, 7, 6)
    bird_left, bird_right = byte(13), byte(15)  # pictures
    row = byte(15)  # of the thrower, less 2
    raised = byte(16)  # rows of the thrower's head
    pose = byte(19, 21)  # low bytes of the addresses of the left and the right half
    pose_page = bits(20, 22, first=0)  # 1: the first of two pages
    x = byte(24)  # x + 9
    flies_left = bits(33, first=3)  # bird, helicopter
    bird_x = byte(34)
    helicopter_y = byte(36)  # y - 48
    lives = byte(42)
    windows = byte(*range(45, 58))  # 4 * which windows a row has
    scroll = byte(58)  # rows: 0, 3, 6, 9
    on_roof = byte(65)
    bird = bits(76, first=7)  # 0: there is one
    coarse = byte(14)
    fine = high(13)
    thrower = low(92)  # 15: none
    wide = high(92)  # 15: what falls is of ordinary width
    turn = bits(38)  # 0: the climber's, 1: of what falls beside him
    shut = byte(*range(95, 103))  # rows
    shut_kind = byte(*range(108, 116))  # 2 * which windows of a row shut
    top = byte(81)  # first step of the drawing loop that shows what falls
    end = byte(82)  # and the step after the last one
    thing = byte(83)  # low byte of its picture's address
    thing_page = bits(84)
    thing_x = byte(85)
    thing_color = byte(86)
    started = byte(1)  # 128 or more: the game is over


def decode(m: Ram) -> dict[str, Box]:
    return {
        "Player": _player(m),
        "Window": _windows(m),
        "Enemy_Red": _head(m),
        "Enemy_Bird": _bird(m),
        "Helicopter": _helicopter(m),
        "Projectile": _thing(m),
        "Score": _score(m).where(m.started < 128),
        "Bonus": _bonus(m).where(m.started < 128),
        "Life": _lives(m),
    }


def _join(a: Box, b: Box) -> Box:
    left, top = jnp.minimum(a.x, b.x), jnp.minimum(a.y, b.y)
    right, bottom = jnp.maximum(a.x + a.w, b.x + b.w), jnp.maximum(a.y + a.h, b.y + b.h)
    return box(left, top, right - left, bottom - top)


def _player(m: Ram) -> Box:
    picture = m.pose + 256 * (1 - m.pose_page)
    y = 152 + m.scroll + _lower(m)
    left = LIMBS.box(picture[0], m.x - 10, y)
    right = LIMBS.box(picture[1], m.x - 2, y, mirrored=True)
    climber = _join(left, right)
    roof = m.on_roof > 0
    top, rows = jnp.where(roof, 158, climber.y), jnp.where(roof, 23, climber.h)
    return box(climber.x, top, climber.w, rows).clip(0, 43, 160, 210)


def _lower(m: Ram) -> jax.Array:
    return jnp.where(m.started >= 128, 1, 0)


def _windows(m: Ram) -> Box:
    none = jnp.zeros(3, jnp.int32)
    n = jnp.concatenate([none, m.shut, none[:2]])[:, None]
    kind = jnp.concatenate([none, m.shut_kind, none[:2]])[:, None]
    shown = _hole(OPEN, m.windows[:, None] >> 2)
    kept = _hole(SHUTTERS, kind >> 1)
    head = (m.thrower != 15) & (m.row < 5) & (m.row + 3 == ROW)
    n, climbed = jnp.where(head, 0, n), (ROW == 9) | (ROW == 10)
    rows = jnp.where(kept, 0, n + jnp.where(climbed & (n > 0) & ((ROW == 10) | (COLUMN < 3)), 1, 0))
    last = jnp.where((n >= 7) & ~climbed & (COLUMN >= 2) | head & (COLUMN >= 4), 7, 8)
    y = 34 + 13 * ROW + m.scroll + _lower(m)
    there = shown & (kept | (n < 7)) & ((m.on_roof == 0) | (ROW > 10))
    x = np.broadcast_to(WINDOW_X, (13, 6))
    return box(x.ravel(), (y + rows).ravel(), 8, (last - rows).ravel(), there.ravel()).clip(
        *BUILDING
    )


def _hole(patterns: Sequence[int], index: jax.Array) -> jax.Array:
    """Whether the windows of rows are holes, by the rows' patterns of the left half."""
    bits = sum(pattern << 3 * i for i, pattern in enumerate(patterns))  # all of them in one number
    first = 3 * jnp.minimum(index, len(patterns) - 1)
    return jnp.int32(bits) >> (first + DISTANCE[COLUMN]) & 1 == 1


def _head(m: Ram) -> Box:
    x = 15 * m.coarse + (m.fine ^ 7) - 10
    y = 48 + 13 * (m.row + 2) + m.scroll
    there = (m.thrower != 15) & (m.on_roof == 0) & (m.row < 5)
    return HEADS.box(m.raised, x, y).where(there)


def _bird(m: Ram) -> Box:
    left = m.flies_left == 1
    offset = jnp.where(left, -8, 8)
    y = 47 + m.scroll
    a = BIRDS.box(m.bird_right, m.bird_x + offset - 10, y, mirrored=left)
    b = BIRDS.box(m.bird_left, m.bird_x - 10, y, mirrored=left)
    facing = jnp.where(left, WEST, EAST)
    return replace(_join(a, b), orientation=facing).where((m.bird == 0) & (m.on_roof == 0))


def _helicopter(m: Ram) -> Box:
    left = m.flies_left == 1
    facing = jnp.where(left, WEST, EAST)
    return box(
        m.bird_x - jnp.where(left, 23, 9),
        m.helicopter_y + 48,
        30,
        26,
        m.on_roof > 0,
        orientation=facing,
    )


def _zone_end(m: Ram) -> jax.Array:
    """The row after those that the drawing loop draws in more steps because of the thrower."""
    return jnp.where(m.thrower != 15, jnp.minimum(m.row + 3, ZONE_END), ZONE_START)


def _start(m: Ram, row: jax.Array | np.ndarray) -> jax.Array:
    """The drawing loop's step at which it begins rows of the building."""
    in_zone = jnp.maximum(jnp.minimum(row, _zone_end(m)) - ZONE_START, 0)
    head = (m.thrower != 15) & (m.row + 2 < ZONE_END) & (row > m.row + 2)
    bird = jnp.where((m.bird == 0) & (row > 1), BIRD_STEPS, 0)
    return in_zone + ROW_STEPS * row + jnp.where(head, 1, 0) + bird


def _counters(m: Ram, row: jax.Array) -> jax.Array:
    """The drawing loop's step that each line of some rows of the building shows, int32 [3 * 13].

    The first lines of all rows come first, then the second lines, and so on.
    """
    shut = (jnp.where(row == 2 + i, m.shut[i], 0) for i in range(8))
    n = sum(shut, start=jnp.int32(0))[:, None]
    start, row, line = _start(m, row)[:, None], row[:, None], np.arange(1, 14)[None, :]
    zone = (row >= ZONE_START) & (row < _zone_end(m))
    waits = (line == 4) | (line > 11) | ((n > 0) & (line == 4 + n))
    waits = waits | (zone & ((line < 5) | (row == m.row + 2)))
    late = ((n == 0) | (line >= 4 + n)) & (zone | (line >= 4))
    flies = (m.bird == 0) & (row < 2)
    offset = line + jnp.where(zone, 1, 0) + jnp.where(flies, BIRD_STEPS, 0)
    offset = offset - jnp.where(late, 1, 0) - jnp.where(row == LAST_ROW, 1, 0)
    waits = waits | (flies & ((row == 0) | (line < 8)))
    counter = jnp.where(waits, -1, start + offset)
    last = _running_max(list(jnp.max(counter, axis=1)))  # of each row, where it does not wait
    before = jnp.stack([jnp.int32(-1), *last[:-1]])
    return jnp.concatenate(_running_max([before, *counter.T])[1:])


def _running_max(values: list[jax.Array]) -> list[jax.Array]:
    """The largest of the values so far; `lax.cummax` of all lines doubles the decoder's time."""
    return list(itertools.accumulate(values, jnp.maximum))


def _thing(m: Ram) -> Box:
    """What falls: the rows of its picture that the drawing loop does not skip.

    A picture has fewer rows than the loop has steps in two rows of the building, so it is in the
    row that is under way when it begins and in the next two.
    """
    begun = _start(m, np.arange(1, LAST_ROW + 1)) < m.top
    building_row = jnp.sum(jnp.where(begun, 1, 0)) + np.arange(3)
    shown = _counters(m, building_row)
    k = shown - m.top
    numbers = np.arange(THING_ROWS)
    picture = m.thing + 256 * m.thing_page
    rows, filled = lookup(INK, picture + numbers), lookup(FILLED, picture)
    row = jnp.where((k >= 0) & (k < THING_ROWS), jnp.int32(1) << (k & 15), 0) & filled
    line = (13 * building_row[None, :] + np.arange(13)[:, None]).ravel()
    on = (shown < m.end) & (row > 0) & (line < 13 * (LAST_ROW + 1))
    hidden = (m.end >= 0x59) & (m.turn == 0) & (line >= 103) & (line < 140)
    on = jnp.where(jnp.any(on & ~hidden), on & ~hidden, on)
    y = 44 + line + m.scroll + _lower(m)
    top = jnp.min(jnp.where(on, y, 999))
    bottom = jnp.max(jnp.where(on, y + 1, 0))
    drawn = jax.lax.reduce_or(jnp.where(on, row, 0), (0,))
    columns = jax.lax.reduce_or(jnp.where(drawn >> numbers & 1 == 1, rows, 0), (0,))
    first = 8 - _length(columns)
    last = 9 - _length(columns & -columns)
    zoom = jnp.where(m.wide != 15, 4, 1)
    there = (m.top > 0) & (bottom > top) & (m.on_roof == 0)
    x = m.thing_x - 10 + zoom * first + jnp.where(zoom > 1, 1, 0)  # the chip begins wide ones later
    things = box(x, top, zoom * (last - first), bottom - top, there, color=m.thing_color)
    return things.clip(0, 43, 160, 199)


def _length(x: jax.Array) -> jax.Array:
    return reached(x, [1 << i for i in range(8)])


def _number(digits: jax.Array) -> jax.Array:
    out = digits[0]
    for i in range(1, digits.shape[0]):
        out = 10 * out + digits[i]
    return out


def _score(m: Ram) -> Box:
    value = 100 * _number(m.score)
    return score_box(FONT, value, right=96, top=31, digits=6, leading_zeros=True, value=value)


def _bonus(m: Ram) -> Box:
    value = 100 * _number(m.bonus)
    return score_box(FONT, value, right=96, top=21, digits=5, leading_zeros=True, value=value)


def _lives(m: Ram) -> Box:
    i = np.arange(3)
    return box(58 + 16 * i, 13, 5, 6, i < jnp.maximum(m.lives, 1))


CLIMBER = Bounds((GREEN, LEGS, GREEN_2), (40, 43, 130, 200))
WINDOWS = Blobs(0, BUILDING, Shape(w=(3, 8), h=(1, 8)), gap=(3, 0))
BIRD = Bounds(WHITE, (0, 43, 160, 80))
HELICOPTER = Bounds((BODY, ROTOR), (0, 43, 160, 160))
THINGS = Bounds((YELLOW, BLUE, PURPLE, *range(48, 64, 2)), (0, 43, 160, 199))
SCORE = Bounds(GREEN, (40, 31, 110, 39), value=Digits(FONT, range(48, 96, 8), 31))
BONUS = Bounds(GREEN, (40, 21, 110, 28), value=Digits(FONT, range(56, 96, 8), 21))
ICONS = Bounds((198, LEGS), tuple((56 + 16 * i, 12, 70 + 16 * i, 20) for i in range(3)))
facing = functools.partial(Category, attributes=("orientation",))

GAME = Game(
    name="CrazyClimber",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", CLIMBER, doc="the climber"),
        Category("Window", WINDOWS, count=78, doc="row * 6 + column"),
        Category("Enemy_Red", Bounds(RED, BUILDING), doc="a thrower"),
        facing("Enemy_Bird", BIRD, doc="a bird"),
        facing("Helicopter", HELICOPTER, doc="above the roof"),
        Category("Projectile", THINGS, doc="what falls"),
        display("Score", SCORE, doc="points, below 1,000,000"),
        display("Bonus", BONUS, doc="bonus"),
        display("Life", ICONS, count=3, attributes=(), doc="lives in reserve, three at most"),
    ),
)
