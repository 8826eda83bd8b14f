"""Crazy Climber: a climber on a skyscraper, windows that shut, throwers, a bird, a helicopter.

Picture: docs/games/CrazyClimber.png

Screen: the walls and the open sky between them are scenery. The box of a partly shut window is its
open part. Projectile is any falling object: pots, bars, eggs, girders (OCAtari's VEM names them by
colour). The climber and a falling object on the same rows are drawn alternately.

Slots: Window is row * 6 + column; row 0 scrolls in at the top.

RAM: ALE's source (score, lives), OCAtari 2.2 (meaning of the records), and the ROM's code. The game
computes in the blank lines after a frame, so the RAM agrees with the screen.

Timeline of the drawing loop, which counts steps instead of lines. A falling object shows the row of
its picture that belongs to the step. A row of the building has 13 lines:
    line 4           the loop waits, so the previous row of the picture appears twice
    lines 5 to 11    the windows; the loop waits on the line after the last shut row
    lines 12 and 13  the loop waits
In each row the loop makes 11 steps. It makes one more in each row from the third down to a thrower
(at most the seventh row), and one more below his head. While it draws the bird, it makes two more
in the upper two rows. `_row_start` counts the steps before a row, `_steps` adds its lines.

Covered: all modes and difficulties, falls, the end of the game. The RAM was edited for the roof
with the helicopter, and for girders that fall from high floors and are four times as wide as their
pictures.

Not exact: Score and Bonus are not valid on the display of the ended game.

VEM: it misses girders, because their colours are random. A window is too small if sprites cover
complete rows of it.
"""

import functools
import itertools
from collections.abc import Sequence
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    WEST,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    Icons,
    LivesAsIcons,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Shape,
    Variants,
    among,
    bits,
    box,
    byte,
    display,
    edges,
    extremes,
    flag,
    high,
    lookup,
    low,
    position,
    reached,
    when,
)

ROM = Rom("crazy_climber", "55ef7b65066428367844342ed59f956c")
FONT = ROM.font([0xF0B + i for i in range(10)], rows=7, step=11)
GREEN = 202
DARK_GREEN = 104
LEGS = 76
RED = 70
WHITE = 12
YELLOW = 26
BLUE = 154
PURPLE = 106
BODY = 134
ROTOR = 10
BUILDING = (40, 43, 120, 198)
SCORE = NumberDisplay(FONT, right=96, top=31, digits=6, leading_zeros=True)
BONUS = NumberDisplay(FONT, right=96, top=21, digits=5, leading_zeros=True)

RESERVE = Icons(left=58, top=13, size=(5, 6), pitch=16, count=3)  # lives
OVER = 128  # least `started` of an ended game
NO_THROWER = 15  # `thrower`
ORDINARY = 15  # `wide`
HEADLESS = 5  # least `row` of a thrower with a hidden head

# Of the windows.
WINDOW_ROW, COLUMN = np.ogrid[:13, :6]
WINDOW_X = np.array((44, 56, 68, 84, 96, 108))
FIRST_WINDOW_Y = 34  # of row 0
WINDOW_SIZE = 8  # pixels, in both directions
SHUTS = 7  # least shut rows of an invisible window
SHUT_ROWS = range(3, 11)  # rows with shutters
CLIMBED = (WINDOW_ROW == 9) | (WINDOW_ROW == 10)  # beside the climber
ROOF_ROW = 10  # on the roof, only windows below this row are left
HEAD_BELOW = 2  # rows from `Ram.row` to the thrower's head
DISTANCE = np.array((0, 1, 2, 2, 1, 0))  # column -> window of the left half
OPEN = (0b111, 0b110, 0b011, 0b100, 0b100, 0)  # windows of the left half, bit 0 the outer one

# The drawing loop and falling objects.
ROW_LINES = 13  # of the building
ROW_STEPS = 11  # loop steps in such a row
LAST_ROW = 11
WINDOW_LINE = 4  # the line above the windows
LAST_WINDOW_LINE = 11
# Rows with one more step per row down to the thrower.
ZONE_START = 2
ZONE_END = 7
BIRD_STEPS = 2  # additional steps while the loop draws the bird
BIRD_ROWS = 2  # upper rows, beside the bird
BIRD_END = 8  # in the second of these rows, the first line after the waits
NO_STEP = -1  # on a line on which the loop waits
THING_ROWS = 16  # at most, in a falling object's picture
CLIMBER_STEP = 89  # least `end` of a falling object that may be on the climber's rows
CLIMBER_LINES = range(103, 140)


def _halves(table: int, count: int) -> tuple[int, ...]:
    """Bits of the left half's open windows, for pairs of playfield registers."""
    out = []
    for i in range(count):
        first, second = ROM.bytes(table + 2 * i, 2).tolist()
        holes = (first & 1 == 0, second >> 2 & 3 == 0, second >> 5 & 3 == 0)
        out.append(sum(1 << k for k, hole in enumerate(holes) if hole))
    return tuple(out)


SHUTTERS = _halves(0xC05, 10)


def _climber_rows(base: int) -> np.ndarray:
    rows = ROM.rows(base, 31, top_first=True)  # the loop skips two
    return np.concatenate([rows[1:13], rows[14:]])


LIMBS = Pictures.of([_climber_rows(0xD00 + i) for i in range(512)])
HEADS = ROM.pictures(range(0xD9B, 0xDA3), 6, top_first=True)
BIRDS = ROM.pictures(range(0xC00, 0xD00), 12, top_first=True)
INK = ROM.bytes(0xC00, 0x310)
# Nonempty rows of the pictures of falling objects, a bit per row.
FILLED = [sum(1 << k for k in range(THING_ROWS) if INK[i + k]) for i in range(512)]


class Ram(RamMap):
    score = byte(5, 4, 3, 2)  # a digit each
    bonus = byte(8, 7, 6)  # a digit each
    started = byte(1)  # 128 or more: the game is over
    bird_left = byte(13)  # picture of the left half
    fine = high(13)  # of the thrower's position
    coarse = byte(14)  # x + 10 of the thrower in the chip's coding
    bird_right = byte(15)  # picture
    row = byte(15)  # of the thrower, less 2
    raised = byte(16)  # rows of the thrower's head
    pose = byte(19, 21)  # low bytes of the addresses of the left and the right half
    first_page = flag(20, 22, bit=0)  # of two
    x = byte(24)  # x + 9
    flies_left = flag(33, bit=3)  # bird, helicopter
    bird_x = byte(34)
    helicopter_y = byte(36)  # y - 48
    lives = byte(42)
    windows = byte(*range(45, 58))  # 4 * index of the row's windows in `OPEN`
    scroll = byte(58)  # rows: 0, 3, 6, 9
    on_roof = byte(65)
    no_bird = flag(76, bit=7)
    thrower = low(92)  # 15: none
    wide = high(92)  # 15: the falling object has ordinary width
    things_turn = flag(38, bit=0)  # the falling object is drawn, not the climber beside it
    shut = byte(*range(95, 103))  # rows
    shut_kind = byte(*range(108, 116))  # 2 * index in `SHUTTERS`
    top = byte(81)  # first step of the drawing loop that shows the falling object
    end = byte(82)  # the step after the last one
    thing = byte(83)  # low byte of its picture's address
    thing_page = bits(84)
    thing_x = byte(85)
    thing_color = byte(86)


def decode(m: Ram) -> dict[str, Box]:
    return {
        "Player": _player(m),
        "Window": _window_boxes(m),
        "Enemy_Red": _head_box(m),
        "Enemy_Bird": _bird_box(m),
        "Helicopter": _helicopter_box(m),
        "Projectile": _thing(m),
        "Score": _score_box(m).where(m.started < OVER),
        "Bonus": _bonus_box(m).where(m.started < OVER),
        "Life": _lives(m),
    }


def _joined(a: Box, b: Box) -> Box:
    left = jnp.minimum(a.x, b.x)
    top = jnp.minimum(a.y, b.y)
    right = jnp.maximum(a.x + a.w, b.x + b.w)
    bottom = jnp.maximum(a.y + a.h, b.y + b.h)
    return edges(left, top, right, bottom)


def _player(m: Ram) -> Box:
    picture = m.pose + jnp.where(m.first_page, 0, 256)
    y = 152 + m.scroll + _lower(m)
    left = LIMBS.box(picture[0], m.x - 10, y)
    right = LIMBS.box(picture[1], m.x - 2, y, mirrored=True)
    figure = _joined(left, right)
    on_roof = m.on_roof > 0
    top = jnp.where(on_roof, 158, figure.y)
    height = jnp.where(on_roof, 23, figure.h)
    return box(figure.x, top, figure.w, height).clip(0, 43, 160, 210)


def _lower(m: Ram) -> jax.Array:
    """Downward shift of the display of the ended game, in rows."""
    return when(m.started >= OVER, 1)


def _window_boxes(m: Ram) -> Box:
    """The open part of each window, by row and column."""
    behind_head = _has_head(m) & (m.row + HEAD_BELOW + 1 == WINDOW_ROW)
    shut = jnp.where(behind_head, 0, _by_row(m.shut))  # rows
    without_shutter = _is_hole(SHUTTERS, _by_row(m.shut_kind) >> 1)
    later = CLIMBED & (shut > 0) & ((WINDOW_ROW == 10) | (COLUMN < 3))
    closed = jnp.where(without_shutter, 0, shut + when(later, 1))
    nearly_shut = (shut >= SHUTS) & ~CLIMBED & (COLUMN >= 2)
    cut = nearly_shut | (behind_head & (COLUMN >= 4))  # the last row is not drawn
    top = FIRST_WINDOW_Y + ROW_LINES * WINDOW_ROW + m.scroll + _lower(m)
    height = WINDOW_SIZE - when(cut, 1) - closed
    is_window = _is_hole(OPEN, m.windows[:, None] >> 2)
    is_open = without_shutter | (shut < SHUTS)
    on_screen = (m.on_roof == 0) | (WINDOW_ROW > ROOF_ROW)
    x = np.broadcast_to(WINDOW_X, (13, 6))
    there = is_window & is_open & on_screen
    fields = (x.ravel(), (top + closed).ravel(), WINDOW_SIZE, height.ravel(), there.ravel())
    return box(*fields).clip(*BUILDING)


def _by_row(of_shutters: jax.Array) -> jax.Array:
    """Expand the RAM's values for the rows with shutters to a column of all rows; 0 elsewhere."""
    below = WINDOW_ROW.size - SHUT_ROWS.stop
    return jnp.pad(of_shutters, (SHUT_ROWS.start, below))[:, None]


def _has_thrower(m: Ram) -> jax.Array:
    return m.thrower != NO_THROWER


def _has_head(m: Ram) -> jax.Array:
    """True if the thrower's head is visible."""
    return _has_thrower(m) & (m.row < HEADLESS)


def _is_hole(patterns: Sequence[int], index: jax.Array) -> jax.Array:
    """True for holes; each row has one of the patterns for the left half."""
    holes = sum(pattern << 3 * i for i, pattern in enumerate(patterns))  # all in one number
    first = 3 * jnp.minimum(index, len(patterns) - 1)
    return jnp.int32(holes) >> (first + DISTANCE[COLUMN]) & 1 == 1


def _head_box(m: Ram) -> Box:
    x = position(m.coarse, m.fine) - 10
    y = 48 + ROW_LINES * (m.row + HEAD_BELOW) + m.scroll
    return HEADS.box(m.raised, x, y, valid=_has_head(m) & (m.on_roof == 0))


def _facing(m: Ram) -> jax.Array:
    """Of the bird and the helicopter."""
    return jnp.where(m.flies_left, WEST, EAST)


def _bird_box(m: Ram) -> Box:
    to_right_half = jnp.where(m.flies_left, -8, 8)
    x = m.bird_x - 10
    y = 47 + m.scroll
    left = BIRDS.box(m.bird_left, x, y, mirrored=m.flies_left)
    right = BIRDS.box(m.bird_right, x + to_right_half, y, mirrored=m.flies_left)
    whole = replace(_joined(left, right), orientation=_facing(m))
    return whole.where(_has_bird(m) & (m.on_roof == 0))


def _has_bird(m: Ram) -> jax.Array:
    return ~m.no_bird


def _helicopter_box(m: Ram) -> Box:
    x = m.bird_x - jnp.where(m.flies_left, 23, 9)
    y = m.helicopter_y + 48
    return box(x, y, 30, 26, m.on_roof > 0, orientation=_facing(m))


def _end_of_zone(m: Ram) -> jax.Array:
    """The row after the rows that the thrower makes longer by a step."""
    below_head = m.row + HEAD_BELOW + 1
    return jnp.where(_has_thrower(m), jnp.minimum(below_head, ZONE_END), ZONE_START)


def _row_start(m: Ram, row: jax.Array | np.ndarray) -> jax.Array:
    """The drawing loop's step at which it begins rows of the building."""
    head_row = m.row + HEAD_BELOW
    zone_rows = jnp.maximum(jnp.minimum(row, _end_of_zone(m)) - ZONE_START, 0)
    below_head = _has_thrower(m) & (head_row < ZONE_END) & (row > head_row)
    for_bird = when(_has_bird(m) & (row > 1), BIRD_STEPS)
    return zone_rows + ROW_STEPS * row + when(below_head, 1) + for_bird


def _counters(m: Ram, row: jax.Array) -> jax.Array:
    """The drawing loop's step on each line of some rows of the building, int32 [3 * 13].

    The first lines of all rows come first, then the second lines, and so on.
    """
    counter = _steps(m, row[:, None])
    last = _running_max(list(jnp.max(counter, axis=1)))  # of each row, outside waits
    before = jnp.stack([jnp.int32(NO_STEP), *last[:-1]])
    return jnp.concatenate(_running_max([before, *counter.T])[1:])


def _steps(m: Ram, row: jax.Array) -> jax.Array:
    """The steps of all lines of some rows; `NO_STEP` while the loop waits for the line's end."""
    line = np.arange(1, ROW_LINES + 1)[None, :]
    shut = sum((when(row == 2 + i, m.shut[i]) for i in range(8)), start=jnp.int32(0))
    shut_end = WINDOW_LINE + shut
    in_zone = (row >= ZONE_START) & (row < _end_of_zone(m))
    beside_bird = _has_bird(m) & (row < BIRD_ROWS)
    # Each wait above a line delays its step by one.
    waited_on_shutter = (shut == 0) | (line >= shut_end)
    waited = waited_on_shutter & (in_zone | (line >= WINDOW_LINE))
    before_line = line - when(waited, 1) - when(row == LAST_ROW, 1)
    more = when(in_zone, 1) + when(beside_bird, BIRD_STEPS)
    waits = (line == WINDOW_LINE) | (line > LAST_WINDOW_LINE) | ((shut > 0) & (line == shut_end))
    waits_in_zone = in_zone & ((line <= WINDOW_LINE) | (row == m.row + HEAD_BELOW))
    waits_for_bird = beside_bird & ((row == 0) | (line < BIRD_END))
    step = _row_start(m, row) + before_line + more
    return jnp.where(waits | waits_in_zone | waits_for_bird, NO_STEP, step)


def _running_max(values: list[jax.Array]) -> list[jax.Array]:
    """The running maximum; `lax.cummax` of all lines doubles the decoder's time."""
    return list(itertools.accumulate(values, jnp.maximum))


def _thing(m: Ram) -> Box:
    """The falling object: the rows of its picture that the drawing loop does not skip.

    A picture has fewer rows than the loop has steps in two rows of the building. Therefore it is in
    the row in progress at its start and in the next two.
    """
    begun = _row_start(m, np.arange(1, LAST_ROW + 1)) < m.top
    building_row = jnp.sum(when(begun, 1)) + np.arange(3)
    picture = m.thing + 256 * m.thing_page
    line = (ROW_LINES * building_row[None, :] + np.arange(ROW_LINES)[:, None]).ravel()
    row = _thing_lines(m, picture, building_row, line)
    y = 44 + line + m.scroll + _lower(m)
    top, bottom = extremes(row > 0, y, y + 1)
    first, end = _thing_columns(picture, row)
    is_wide = m.wide != ORDINARY
    zoom = jnp.where(is_wide, 4, 1)
    x = m.thing_x - 10 + zoom * first + when(is_wide, 1)  # the chip starts wide objects later
    there = (m.top > 0) & (bottom > top) & (m.on_roof == 0)
    thing_box = box(x, top, zoom * (end - first), bottom - top, there, color=m.thing_color)
    return thing_box.clip(0, 43, 160, 199)


def _thing_lines(m: Ram, picture: jax.Array, building_row: jax.Array, line: jax.Array) -> jax.Array:
    """The row of the picture on each line, as a bit; 0 for no row."""
    step = _counters(m, building_row)
    number = step - m.top  # of the picture's row
    in_picture = (number >= 0) & (number < THING_ROWS)
    row_bit = jnp.int32(1) << (number & THING_ROWS - 1)
    row = when(in_picture, row_bit) & lookup(FILLED, picture)
    drawn = (step < m.end) & (row > 0) & (line < ROW_LINES * (LAST_ROW + 1))
    climbers_turn = (m.end >= CLIMBER_STEP) & ~m.things_turn & among(line, CLIMBER_LINES)
    visible = drawn & ~climbers_turn
    # An object that the climber hides keeps its complete box.
    return when(jnp.where(jnp.any(visible), visible, drawn), row)


def _thing_columns(picture: jax.Array, row: jax.Array) -> tuple[jax.Array, jax.Array]:
    """First column and last column + 1 of a picture's rows, given as bits."""
    number = np.arange(THING_ROWS)
    drawn = jax.lax.reduce_or(row, (0,))
    dots = when(drawn >> number & 1 == 1, lookup(INK, picture + number))
    columns = jax.lax.reduce_or(dots, (0,))
    lowest = columns & -columns
    return 8 - _bit_length(columns), 9 - _bit_length(lowest)


def _bit_length(byte_of_dots: jax.Array) -> jax.Array:
    return reached(byte_of_dots, [1 << i for i in range(8)])


def _from_digits(digits: jax.Array) -> jax.Array:
    return functools.reduce(lambda number, digit: 10 * number + digit, digits)


def _score_box(m: Ram) -> Box:
    return SCORE.box(100 * _from_digits(m.score))


def _bonus_box(m: Ram) -> Box:
    return BONUS.box(100 * _from_digits(m.bonus))


def _lives(m: Ram) -> Box:
    return RESERVE.box(jnp.maximum(m.lives, 1))


CLIMBER = Bounds((GREEN, LEGS, DARK_GREEN), (40, 43, 130, 200))
WINDOWS = Blobs(0, BUILDING, Shape(w=(3, 8), h=(1, 8)), gap=(3, 0))
BIRD = Bounds(WHITE, (0, 43, 160, 80))
HELICOPTER = Bounds((BODY, ROTOR), (0, 43, 160, 160))
THINGS = Bounds((YELLOW, BLUE, PURPLE, *range(48, 64, 2)), (0, 43, 160, 199))
POINTS = SCORE.rule(GREEN, (40, 31, 110, 39))
EXTRA = BONUS.rule(GREEN, (40, 21, 110, 28))
LIFE_RULE = Bounds((198, LEGS), tuple((56 + 16 * i, 12, 70 + 16 * i, 20) for i in range(3)))
facing_category = functools.partial(Category, attributes=("orientation",))

GAME = Game(
    name="CrazyClimber",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        lives=(LivesAsIcons(("Life",)),),
        mirrored={"Enemy_Bird": None, "Helicopter": None},
    ),
    variants=Variants(
        modes={
            0: "starts with a bonus of 10,000",
            1: "starts with a bonus of 20,000",
            2: "starts with a bonus of 30,000",
            3: "starts with a bonus of 40,000",
        },
        source="play of all modes in the emulator",
    ),
    categories=(
        Category("Player", CLIMBER, role="player", doc="the climber"),
        Category("Window", WINDOWS, count=78, doc="row * 6 + column"),
        Category("Enemy_Red", Bounds(RED, BUILDING), doc="a thrower"),
        facing_category("Enemy_Bird", BIRD, doc="a bird"),
        facing_category("Helicopter", HELICOPTER, doc="above the roof"),
        Category("Projectile", THINGS, doc="what falls"),
        display("Score", POINTS, role="score", doc="points, below 1,000,000"),
        display("Bonus", EXTRA, doc="bonus"),
        display(
            "Life",
            LIFE_RULE,
            count=3,
            attributes=(),
            role="lives",
            doc="lives in reserve, three at most",
        ),
    ),
)
