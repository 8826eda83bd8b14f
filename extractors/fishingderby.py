"""Fishing Derby: two anglers on piers, their poles and lines, six fish, a shark, and two scores.

Picture: docs/games/FishingDerby.png

Screen: the line and the hook have one box, from the pole down. The hook is at its bottom. The
orientation (south-east, south or south-west) gives its side of the pole's end. Boxes exclude the
parts of fish, shark and lines behind the bars of the piers, but include parts that these objects
hide from each other. The anglers, the piers, the waves and the maker's name are scenery. A caught
or eaten fish is not valid until it comes back.

Slots: a fish keeps its slot, its row from the top, also while an angler pulls it up.

RAM: ALE's source (scores), OCAtari 2.2 and D. Debro's disassembly (meaning of the records), and the
ROM's code. The positions in the chip's coding (bytes 42, 43, 76-89) agree with the screen. Fish,
poles, hooks and scores change after the drawing. `as_drawn` undoes this: it takes the pictures from
the drawn positions, the poles' ends from the slopes' distances, and the hooks' depths from the
counters that ran down while the lines were drawn.

Covered: all four difficulties, fish that are pulled up, caught and eaten, the end of the game.

Not exact: the RAM lacks the button that makes the left angler pull faster, so a fish on his hook
may be a row lower on the screen unless the hook's depth shows it. A fish that takes a hook on this
very frame may be a row lower, too. The last point of a catch may already be on the screen.

VEM: it misses two fish that touch unless one is above the other, a hook behind fish and shark, and
the last rows of a line below a fish.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from ocjax.authoring import (
    EAST,
    NUSIZ_COPIES,
    NUSIZ_SPACING,
    NUSIZ_WIDTH,
    SOUTH,
    WEST,
    WIDTH,
    Blobs,
    Bounds,
    Box,
    BoxTable,
    Category,
    Checks,
    Game,
    NoLines,
    NumberDisplay,
    RamMap,
    Rom,
    Shape,
    bcd,
    bits,
    byte,
    display,
    div,
    edges,
    flag,
    match,
    mirrored,
    position,
    signed_nibble,
    when,
)

ROM = Rom("fishing_derby", "b8865f05676e64f3bec72b9defdacfa7")
FONT = ROM.font(0x700, rows=8)

BLACK = 0
YELLOW = 28
RED = 66
GREEN = 198
SURFACE = 128  # of a line that enters the water

# What never moves: left, top, right, bottom.
BARS = tuple((x, 61, x + 4, 190) for x in (16, 24, 132, 140))  # of the piers; fish are behind them
BAR_WIDTH = 4  # also of the gaps between bars
LEFT_PIER_END = 28  # column after its bars
RIGHT_PIER = 132  # first column of its bars
PIERS = ((8, 39, 28, 61), (132, 39, 152, 61))  # with the anglers
LINE_AREA = (12, 39, 148, 190)
POLES = ((16, 38, 80, 39), (80, 38, 144, 39))
SCORES = tuple(NumberDisplay(FONT, right, top=8, digits=2) for right in (56, 120))

COLUMN_0 = 46  # `position` of column 0
FISH_ROWS = np.arange(6)
FISH_NUMBERS = 6 - FISH_ROWS  # the game's numbers of the fish
FISH_Y = 96  # of the uppermost fish
ROWS_APART = 16  # from a fish to the next one
SHARK_Y = 80
PULLED_Y = 80  # y of a fish at `pulled_y` 0
PICTURE_ROWS = 14

LINE_TOP = 39
LINE_ROWS = np.array((81, 80))  # last row of each line at depth 0
STEPS = 49  # of the drawing loop, down to the lowest depth
STEPS_ABOVE = 17  # of a line above depth 0
FISH_STEPS = 7  # in a row of fish
STEP_ROWS = 2  # rows of a step
SLOPE_UNIT = 256  # `line_slope` of a line that moves a column in each step
LATE_END = 61  # columns left of this show a line for one row more

EMPTY_PICTURE = 80  # `picture`
SHARK_NEAR = 64  # the shark makes the right angler pull fast left of this column
FAST_PULL = 18  # `depth_before` minus `depth` while the left angler pulls fast
TURNS = 7  # bits of `clock`: the fish that may turn round on this frame
CHANCE = 7  # bits in which `random` and `clock` agree when it does
STRAYED = 2  # most columns of a fish from its start before the shark moves


class Side:  # of `Ram.line_side`, which is 1 on the left
    RIGHT = 15


class SharkShape:  # of `Ram.shark_shape`
    LEFT = 0xCE
    RIGHT = 0xDC


WATER = ~np.isin(np.arange(160), [x for left, _, right, _ in BARS for x in range(left, right)])


def _player_row(row: int, nusiz: int) -> np.ndarray:
    """The columns that a row of a player's picture fills, bool `[64]`."""
    zoom = NUSIZ_WIDTH[nusiz] // 8
    dots = np.repeat(np.unpackbits(np.uint8(row)).astype(bool), zoom)
    columns = np.flatnonzero(dots) + (zoom > 1)  # the chip draws wide players a column later
    copies = np.arange(NUSIZ_COPIES[nusiz]) * NUSIZ_SPACING[nusiz]
    return np.isin(np.arange(64), columns + copies[:, None])


def _shark_rows(picture: int, shape: int) -> np.ndarray:
    """A picture of the shark; each of its rows has another size and position."""
    stored, shapes = ROM.rows([picture, shape], PICTURE_ROWS)
    rows = mirrored(stored) if shape & 0xFF == SharkShape.LEFT else stored
    moves = -signed_nibble(shapes >> 4)  # columns from a row to the next one
    columns = SHARK_MARGIN + np.concatenate([[0], np.cumsum(moves)[:-1]])
    drawn = zip(rows.tolist(), shapes.tolist(), columns.tolist(), strict=True)
    return np.array([np.roll(_player_row(row, size & 7), column) for row, size, column in drawn])


def _bitmaps(rows: np.ndarray) -> list[np.ndarray]:
    """A picture of eight dots, from left to right and from right to left, bool `[rows, 8]` each."""
    right = np.unpackbits(rows.astype(np.uint8)[:, None], axis=1).astype(bool)
    return [right, right[:, ::-1]]


def _visible(pictures: list[np.ndarray], offset: int) -> BoxTable:
    """The tight boxes of the visible parts of pictures at each column, between the bars.

    Args:
        pictures: bool `[rows, columns]` each.
        offset: column of their first columns at position 0.
    """
    columns = range(WIDTH)
    return BoxTable([_visible_part(picture, x + offset) for picture in pictures for x in columns])


def _visible_part(picture: np.ndarray, x: int) -> tuple[int, int, int, int]:
    """Left, top, width and height of a picture's visible part between the bars at a column."""
    at = x + np.arange(picture.shape[1])
    on_screen = (at >= 0) & (at < WIDTH)
    seen = picture & WATER[np.clip(at, 0, WIDTH - 1)] & on_screen
    rows = np.flatnonzero(seen.any(axis=1))
    columns = at[seen.any(axis=0)]
    if not len(rows):
        return (0, 0, 0, 0)
    return (columns[0], rows[0], columns[-1] - columns[0] + 1, rows[-1] - rows[0] + 1)


START = ROM.bytes(0x6D2, 6)[::-1]  # columns of the fish
SPREAD_TAIL, CLOSED_TAIL = ROM.rows([0x760, 0x780], PICTURE_ROWS)
SHARK_PICTURES = (0x7C0, 0x7A0)
SHARK_SHAPES = (0x700 | SharkShape.RIGHT, 0x700 | SharkShape.LEFT)
SHARK_MARGIN = 16  # empty columns left of the shark in its pictures
# Each table has both pictures, each facing right, then left.
FISH_BOXES = _visible([*_bitmaps(CLOSED_TAIL), *_bitmaps(SPREAD_TAIL)], 0)
SHARK_BOXES = _visible(
    [_shark_rows(picture, shape) for picture in SHARK_PICTURES for shape in SHARK_SHAPES],
    -SHARK_MARGIN,
)


class Ram(RamMap):
    clock = byte(1)
    random = byte(2)
    line_slope = byte(28, 29)  # columns in 256 steps
    line_side = bits(30, 31, first=4, count=4)  # direction of the line
    pole_x = byte(23, 24)  # x + 1 of its end; already moved on
    hook_x = byte(32, 33)
    line_reach = byte(34, 35)  # columns from the pole's end to the hook; 1 more to the right
    depth_before = byte(36)  # 17 more than the left hook's depth on this frame or the last one
    right_pulls = flag(39, bit=0)  # the right angler pulls a fish up, otherwise the left one
    pulled_coarse = byte(42)
    pulled_fine = bits(43, first=4, count=4)
    shark_shape = byte(58)  # low byte of the address of its rows' sizes
    score = bcd(61, 62)
    pulled_y = byte(63)  # y - 80; 0: no fish is pulled up
    over = byte(64)  # 0: the game is in play
    depth = byte(65)  # of the left hook
    count_down = byte(67, 68)  # the hook's depth less the 49 steps of the drawing loop
    # The fish from the top; `shark_` for the shark's own:
    x = byte(*range(74, 68, -1))  # already moved on
    coarse = byte(*range(81, 75, -1))
    shark_coarse = byte(82)
    fine = bits(*range(88, 82, -1), first=4, count=4)
    shark_fine = bits(89, first=4, count=4)
    faces_left = flag(*range(95, 89, -1), bit=3)
    picture = byte(*range(102, 96, -1))
    shark_picture = byte(103)
    hooked = byte(112, 113)  # number of the fish on each hook, 0: none
    caught = byte(114, 115)  # points still to be added


class Drawn(NamedTuple):
    """The state when the frame was drawn.

    The fish, `[6]` each, are in the order of their rows, the lines, `[2]` each, left, then right.
    """

    fish_x: jax.Array
    fish_y: jax.Array
    fish_face_left: jax.Array  # bool
    tails_spread: jax.Array  # bool
    shark_x: jax.Array
    has_shark: jax.Array  # bool
    line_x: jax.Array  # columns of the poles' ends
    line_step: jax.Array  # 1: the line leads to the right, -1: to the left
    line_depth: jax.Array  # steps of the drawing loop below depth 0


def decode(m: Ram) -> dict[str, Box]:
    drawn = as_drawn(m)
    lines = _line_boxes(m, drawn)
    left_x = drawn.line_x[0]
    right_x = drawn.line_x[1]
    return {
        "Fish": _all_fish(m, drawn),
        "Shark": _shark_box(m, drawn),
        "PlayerOneHook": lines[0],
        "PlayerTwoHook": lines[1],
        "PlayerOnePole": edges(16, 38, left_x + 1, 39),
        "PlayerTwoPole": edges(right_x, 38, 144, 39),
        "ScorePlayerOne": _score(m, 0),
        "ScorePlayerTwo": _score(m, 1),
    }


def as_drawn(m: Ram) -> Drawn:
    """Undo the game's step after the drawing."""
    row_x = position(m.coarse, m.fine) - COLUMN_0
    shark_x = position(m.shark_coarse, m.shark_fine) - COLUMN_0
    pulled = _is_pulled(m)
    fish_x = jnp.where(pulled, position(m.pulled_coarse, m.pulled_fine) - COLUMN_0, row_x)
    is_fresh = jnp.all(row_x == START)  # no fish has moved yet
    is_early = jnp.all(jnp.abs(row_x - START) <= STRAYED)
    return Drawn(
        fish_x=fish_x,
        fish_y=jnp.where(pulled, _row_of_pulled(m, shark_x), FISH_Y + ROWS_APART * FISH_ROWS),
        fish_face_left=_fish_face_left(m, row_x),
        tails_spread=is_fresh | _is_second(fish_x),
        shark_x=shark_x,
        has_shark=~((shark_x == START[0]) & is_early),  # it is not drawn before its first move
        line_x=_line_tops(m),
        line_step=jnp.where(m.line_side == Side.RIGHT, 1, -1),
        line_depth=jnp.minimum(m.count_down + STEPS & 0xFF, STEPS - 1),
    )


def _is_pulled(m: Ram) -> jax.Array:
    """True for the fish that an angler pulls up, bool `[6]`."""
    number = jnp.where(m.right_pulls, m.hooked[1], m.hooked[0])
    return (m.pulled_y > 0) & (number == FISH_NUMBERS)


def _row_of_pulled(m: Ram, shark_x: jax.Array) -> jax.Array:
    """The row of the fish that is pulled up, before its last step."""
    right_is_fast = shark_x < SHARK_NEAR
    left_is_fast = m.depth_before - m.depth == FAST_PULL
    is_fast = jnp.where(m.right_pulls, right_is_fast, left_is_fast)
    every_fourth = (m.clock & 3) == 0  # the frames of a slow pull
    return PULLED_Y + m.pulled_y + when(is_fast | every_fourth, 1)


def _fish_face_left(m: Ram, x: jax.Array) -> jax.Array:
    """True for fish that faced left when they were drawn in their columns, bool `[6]`.

    They move after that, and the motion shows their direction. A fish that has not moved may have
    turned round by chance since then.
    """
    moved = m.x - x
    may_turn = (m.clock & TURNS) == FISH_NUMBERS
    agrees = ((m.random ^ m.clock) & CHANCE) == 0
    has_turned = may_turn & agrees & (m.over == 0)
    return match((moved == -1, True), (moved == 1, False), otherwise=m.faces_left ^ has_turned)


def _is_second(x: jax.Array) -> jax.Array:
    """True for the second of two pictures, which alternate every two columns."""
    return (x & 2) != 0


def _line_tops(m: Ram) -> jax.Array:
    """Columns of the poles' ends."""
    of_hook = m.hook_x + jnp.where(m.line_side == Side.RIGHT, 1 - m.line_reach, m.line_reach)
    return jnp.where(m.over == 0, of_hook, m.pole_x) - 1


def _all_fish(m: Ram, drawn: Drawn) -> Box:
    """The fish in their rows, and the fish that an angler pulls up."""
    is_in_row = m.picture != EMPTY_PICTURE
    there = (_is_pulled(m) | is_in_row) & (m.coarse > 0)
    index = _table_index(drawn.tails_spread, drawn.fish_face_left, drawn.fish_x)
    towards = _direction(drawn.fish_face_left)
    return FISH_BOXES.at(index, y=drawn.fish_y, valid=there, orientation=towards)


def _shark_box(m: Ram, drawn: Drawn) -> Box:
    faces_left = m.shark_shape == SharkShape.LEFT
    there = (m.shark_picture != EMPTY_PICTURE) & drawn.has_shark
    index = _table_index(_is_second(drawn.shark_x), faces_left, drawn.shark_x)
    return SHARK_BOXES.at(index, y=SHARK_Y, valid=there, orientation=_direction(faces_left))


def _table_index(second: jax.Array, faces_left: jax.Array, x: jax.Array) -> jax.Array:
    """The index in `FISH_BOXES` or `SHARK_BOXES` of a picture in a column."""
    picture = when(second, 2) + when(faces_left, 1)
    return WIDTH * picture + jnp.clip(x, 0, WIDTH - 1)


def _direction(faces_left: jax.Array) -> jax.Array:
    return jnp.where(faces_left, WEST, EAST)


def _line_boxes(m: Ram, drawn: Drawn) -> Box:
    """The lines, from the poles' ends to the hooks."""
    end = _visible_depth(m, drawn)
    hook_x = _column_at(m, drawn, end)
    left = jnp.minimum(drawn.line_x, hook_x)
    right = jnp.maximum(drawn.line_x, hook_x) + 1
    bottom = _line_bottom(hook_x, drawn.line_depth, end)
    towards = SOUTH - 2 * jnp.sign(hook_x - drawn.line_x)  # south-east, south, south-west
    return edges(left, LINE_TOP, right, bottom, orientation=towards)


def _line_bottom(hook_x: jax.Array, depth: jax.Array, end: jax.Array) -> jax.Array:
    """The row below the lines, which are visible down to the depth `end`."""
    band = div(end, FISH_STEPS)  # the row of fish
    below_fish = STEP_ROWS * (end - FISH_STEPS * band)
    is_late = (hook_x < LATE_END) | (end < depth)
    return ROWS_APART * band + below_fish + LINE_ROWS + when(is_late, 1)


def _visible_depth(m: Ram, drawn: Drawn) -> jax.Array:
    """The depth of the lines' last visible step: beside a bar, if they end behind it."""
    x = _column_at(m, drawn, drawn.line_depth)
    to_bar_right = (x & -BAR_WIDTH) - drawn.line_x  # columns to the near edge of the bar
    to_bar_left = drawn.line_x - (x | BAR_WIDTH - 1)
    to_bar = jnp.where(drawn.line_step > 0, to_bar_right, to_bar_left)
    reached = lax.div(SLOPE_UNIT * to_bar - 1, jnp.maximum(m.line_slope, 1))
    beside = jnp.clip(reached - STEPS_ABOVE, 0, drawn.line_depth)
    return jnp.where(_is_behind_bar(x), beside, drawn.line_depth)


def _column_at(m: Ram, drawn: Drawn, depth: jax.Array) -> jax.Array:
    """The columns of the lines at some depths.

    The drawing loop moves a line sideways when the sum of its slopes overflows.
    """
    aside = div((STEPS_ABOVE + depth) * m.line_slope, SLOPE_UNIT)
    return drawn.line_x + drawn.line_step * aside


def _is_behind_bar(x: jax.Array) -> jax.Array:
    """True for columns behind the bars of the piers."""
    is_odd = (x & BAR_WIDTH) != 0  # bars and gaps alternate
    is_left = (x < LEFT_PIER_END) & ~is_odd
    is_right = (x >= RIGHT_PIER) & is_odd
    return is_left | is_right


def _score(m: Ram, player: int) -> Box:
    """A score, which may count up after it is drawn."""
    is_its_turn = (m.clock & 3) == player
    has_counted = is_its_turn & (m.caught[player] > 0) & (m.over == 0)
    shown = jnp.maximum(m.score[player] - when(has_counted, 1), 0)
    return SCORES[player].box(shown, value=m.score[player])


facing_category = functools.partial(Category, attributes=("orientation",))
TWO_FISH = 130  # least pixels of two fish, one above the other, with their gaps
SEA = Blobs(
    YELLOW,
    (12, 80, 148, 190),
    (
        Shape(w=(3, 9), h=(4, 10)),
        Shape(w=(6, 10), h=(11, 14), pixels=(TWO_FISH, 999), split=(10, 7)),
    ),
    gap=(4, 1),
    filters=(NoLines(6),),
)
SHALLOWS = (20, 80, 140, 93)
SHARKS = Blobs(
    BLACK, SHALLOWS, Shape(w=(4, 40), h=(5, 13)), gap=(4, 2), filters=(NoLines(2),), ignore=BARS
)
FISH_TOP = 88  # row; no fish that touch are above it
SHORTEST_LINE = 6  # rows of a line's yellow part; shorter ones may be parts of fish


def _thin_lines(mask: jax.Array, planes: jax.Array) -> jax.Array:
    """Select lines one pixel wide, and all pixels above the fish."""
    above_fish = np.arange(mask.shape[1])[:, None] < FISH_TOP
    return jnp.where(above_fish, mask, mask & ~NoLines(SHORTEST_LINE - 1)(mask, planes))


LEFT_LINE = Bounds(
    (GREEN, YELLOW), LINE_AREA, filters=(_thin_lines,), ignore=(*PIERS, *BARS), exclude=("Fish",)
)
RIGHT_LINE = Bounds(BLACK, LINE_AREA, ignore=(*PIERS, *BARS), exclude=("Shark",))

GAME = Game(
    name="FishingDerby",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        agreement={"modes": 0.96},  # VEM misses hooks behind fish, and fish that touch
        rare=("Fish",),  # two that touch
        mirrored={"PlayerOneHook": None, "PlayerTwoHook": None},
    ),
    categories=(
        facing_category("Fish", SEA, count=6, doc="one a row, from the top"),
        facing_category("Shark", SHARKS, doc="between the surface and the fish"),
        facing_category(
            "PlayerOneHook",
            LEFT_LINE,
            colors=(GREEN, YELLOW, SURFACE),
            role="player",
            doc="the left line, from pole to hook",
        ),
        facing_category(
            "PlayerTwoHook",
            RIGHT_LINE,
            colors=(BLACK, SURFACE),
            doc="the right line, from pole to hook",
        ),
        Category("PlayerOnePole", Bounds(BLACK, POLES[0]), doc="the left pole"),
        Category("PlayerTwoPole", Bounds(BLACK, POLES[1]), doc="the right pole"),
        display(
            "ScorePlayerOne", SCORES[0].rule(RED), role="score", doc="points of the left angler"
        ),
        display(
            "ScorePlayerTwo",
            SCORES[1].rule(RED),
            role="opponent_score",
            doc="points of the right angler",
        ),
    ),
)
