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
poles, hooks and scores change after the drawing. Therefore `decode` takes the pictures from the
drawn positions, the poles' ends from the slopes' distances, and the hooks' depths from the counters
that ran down while the lines were drawn.

Covered: all four difficulties, fish that are pulled up, caught and eaten, the end of the game.

Not exact: the RAM lacks the button that makes the left angler pull faster, so a fish on his hook
may be a row lower on the screen unless the hook's depth shows it. A fish that takes a hook on this
very frame may be a row lower, too. The last point of a catch may already be on the screen.

VEM: it misses two fish that touch, and a hook behind fish and shark.
"""

import functools
from dataclasses import replace

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
    Blobs,
    Bounds,
    Box,
    BoxTable,
    Category,
    Checks,
    Game,
    NoLines,
    Number,
    NumberDisplay,
    RamMap,
    Rom,
    Shape,
    bcd,
    bits,
    box,
    byte,
    display,
    div,
    flag,
    match,
    mirrored,
    position,
    when,
)

ROM = Rom("fishing_derby", "b8865f05676e64f3bec72b9defdacfa7")
FONT = ROM.font(0x700, rows=8)

BLACK = 0
YELLOW = 28
RED = 66
GREEN = 198
SURFACE = 128  # of a line that enters the water
LINE_TOP = 39
STEPS = 49  # of the drawing loop, down to the lowest depth
STEPS_ABOVE = 17  # of a line above depth 0
FISH_STEPS = 7  # in a row of fish
SHARK_NEAR = 64  # the shark makes the right angler pull fast left of this column
BARS = tuple((x, 61, x + 4, 190) for x in (16, 24, 132, 140))  # of the piers; fish are behind them
PIERS = ((8, 39, 28, 61), (132, 39, 152, 61))  # with the anglers
LINE_AREA = (12, 39, 148, 190)
POLES = ((16, 38, 80, 39), (80, 38, 144, 39))
SCORES = tuple(NumberDisplay(FONT, right, top=8, digits=2) for right in (56, 120))

FISH_ROWS = np.arange(6)
FISH_Y = 96  # of the uppermost fish
ROWS_APART = 16  # from a fish to the next one
SHARK_Y = 80
PULLED_Y = 80  # y of a fish at `pulled_y` 0
PICTURE_ROWS = 14
LATE_END = 61  # columns left of this show a line for one row more
EMPTY_PICTURE = 80  # `picture`
SHARK_LEFT = 0xCE  # `shark_shape` of a shark that faces left


class Side:  # of `Ram.line_side`, which is 1 on the left
    RIGHT = 15


WATER = ~np.isin(np.arange(160), [x for left, _, right, _ in BARS for x in range(left, right)])


def _player_row(row: int, nusiz: int) -> np.ndarray:
    """The columns that a row of a player's picture fills, bool `[64]`."""
    zoom = NUSIZ_WIDTH[nusiz] // 8
    dots = np.repeat(np.unpackbits(np.uint8(row)).astype(bool), zoom)
    columns = np.flatnonzero(dots) + (zoom > 1)
    copies = np.arange(NUSIZ_COPIES[nusiz]) * NUSIZ_SPACING[nusiz]
    return np.isin(np.arange(64), columns + copies[:, None])


def _shark_rows(picture: int, shape: int) -> np.ndarray:
    """A picture of the shark; each of its rows has another size and position."""
    stored, shapes = ROM.rows([picture, shape], PICTURE_ROWS)
    rows = mirrored(stored) if shape & 0xFF == SHARK_LEFT else stored
    moves = -((shapes >> 4 ^ 8) - 8)
    places = 16 + np.concatenate([[0], np.cumsum(moves)[:-1]])
    drawn = zip(rows.tolist(), shapes.tolist(), places.tolist(), strict=True)
    return np.array([np.roll(_player_row(row, shape & 7), place) for row, shape, place in drawn])


def _visible(pictures: list[np.ndarray], offset: int) -> BoxTable:
    """The tight boxes of the visible parts of pictures at each column, between the bars.

    Args:
        pictures: bool `[rows, columns]` each.
        offset: column of their first columns at position 0.
    """
    columns = range(160)
    return BoxTable([_visible_part(picture, x + offset) for picture in pictures for x in columns])


def _visible_part(picture: np.ndarray, x: int) -> tuple[int, int, int, int]:
    """Left, top, width and height of a picture's visible part between the bars at a column."""
    at = x + np.arange(picture.shape[1])
    seen = picture & (WATER[np.clip(at, 0, 159)] & (at >= 0) & (at < 160))
    rows = np.flatnonzero(seen.any(axis=1))
    columns = at[seen.any(axis=0)]
    if not len(rows):
        return (0, 0, 0, 0)
    return (columns[0], rows[0], columns[-1] - columns[0] + 1, rows[-1] - rows[0] + 1)


def _bitmaps(rows: np.ndarray) -> list[np.ndarray]:
    """A picture of eight dots, from left to right and from right to left, bool `[rows, 8]` each."""
    right = np.unpackbits(rows.astype(np.uint8)[:, None], axis=1).astype(bool)
    return [right, right[:, ::-1]]


START = ROM.bytes(0x6D2, 6)[::-1]  # columns of the fish
SPREAD_TAIL, CLOSED_TAIL = ROM.rows([0x760, 0x780], PICTURE_ROWS)  # the tail
FISH_BOXES = _visible(_bitmaps(CLOSED_TAIL) + _bitmaps(SPREAD_TAIL), 0)
SHARK_BOXES = _visible([_shark_rows(p, s) for p in (0x7C0, 0x7A0) for s in (0x7DC, 0x7CE)], -16)


class Ram(RamMap):
    clock = byte(1)
    random = byte(2)
    line_slope = byte(28, 29)  # columns in 256 steps
    line_side = bits(30, 31, first=4, count=4)  # direction of the line
    pole_x = byte(23, 24)  # x + 1 of its end; already moved on
    hook_x = byte(32, 33)
    line_reach = byte(34, 35)  # columns from the pole's end to the hook; 1 more to the right
    depth_before = byte(36)  # 17 more than the left hook's depth on this frame or the last one
    puller = flag(39, bit=0)  # angler who pulls a fish up
    pulled_coarse = byte(42)
    pulled_fine = bits(43, first=4, count=4)
    shark_shape = byte(58)  # low byte of the address of its rows' sizes
    score = bcd(61, 62)
    pulled_y = byte(63)  # y - 80; 0: no fish is pulled up
    over = byte(64)  # 0: the game is in play
    depth = byte(65)  # of the left hook
    count_down = byte(67, 68)  # the hook's depth less the 49 steps of the drawing loop
    # The fish from the top; `coarse`, `fine` and `picture` also have the shark:
    x = byte(*range(74, 68, -1))  # already moved on
    coarse = byte(*range(81, 75, -1), 82)
    fine = bits(*range(88, 82, -1), 89, first=4, count=4)
    faces_left = bits(*range(95, 89, -1), first=3)
    picture = byte(*range(102, 96, -1), 103)
    hooked = byte(112, 113)  # 6 - slot of the fish on each hook, 0: none
    caught = byte(114, 115)  # points still to be added


def decode(m: Ram) -> dict[str, Box]:
    x = position(m.coarse, m.fine) - 46
    top_x = _line_tops(m)
    lines = _line_boxes(m, top_x)
    return {
        "Fish": _fish_in_rows(m, x[:6], x[6]),
        "Shark": _shark_box(m, x),
        "PlayerOneHook": lines[0],
        "PlayerTwoHook": lines[1],
        "PlayerOnePole": box(16, 38, top_x[0] - 15, 1),
        "PlayerTwoPole": box(top_x[1], 38, 144 - top_x[1], 1),
        "ScorePlayerOne": _score(m, 0),
        "ScorePlayerTwo": _score(m, 1),
    }


def _boxes(table: BoxTable, picture: jax.Array, x: jax.Array, y: Number) -> Box:
    """The visible parts of pictures of a table at a column and a row."""
    return table.at(160 * picture + jnp.clip(x, 0, 159), y=y)


def _fish_face_left(m: Ram, x: jax.Array) -> jax.Array:
    """Direction of the fish as drawn; 1: to the left.

    They move after that, and the motion shows their direction. A fish that has not moved may have
    turned round by chance since then.
    """
    moved = m.x - x
    turned = ((m.clock & 7) == 6 - FISH_ROWS) & (((m.random ^ m.clock) & 7) == 0)
    faces_left = jnp.where(turned & (m.over == 0), 1 - m.faces_left, m.faces_left)
    return match((moved == -1, 1), (moved == 1, 0), otherwise=faces_left)


def _fish_in_rows(m: Ram, x: jax.Array, shark_x: jax.Array) -> Box:
    """The fish in their rows, and the fish that an angler pulls up."""
    faces_left = _fish_face_left(m, x)
    fresh = jnp.all(x == START)  # no fish has moved yet
    pulled = (m.pulled_y > 0) & (jnp.where(m.puller, m.hooked[1], m.hooked[0]) == 6 - FISH_ROWS)
    shown_x = jnp.where(pulled, position(m.pulled_coarse, m.pulled_fine) - 46, x)
    fast = jnp.where(m.puller, shark_x < SHARK_NEAR, m.depth_before - m.depth == 18)
    step = jnp.where(fast | ((m.clock & 3) == 0), 1, 0)  # since it was drawn
    y = jnp.where(pulled, PULLED_Y + m.pulled_y + step, FISH_Y + ROWS_APART * FISH_ROWS)
    spread = jnp.where(fresh, 1, shown_x >> 1 & 1)
    fish = _boxes(FISH_BOXES, 2 * spread + faces_left, shown_x, y)
    there = (pulled | (m.picture[:6] != EMPTY_PICTURE)) & (m.coarse[:6] > 0)
    return replace(fish, orientation=jnp.where(faces_left == 1, WEST, EAST)).where(there)


def _shark_box(m: Ram, x: jax.Array) -> Box:
    """The shark, which is not drawn before its first move."""
    first = (x[6] == START[0]) & jnp.all(jnp.abs(x[:6] - START) <= 2)
    faces_left = jnp.where(m.shark_shape == SHARK_LEFT, 1, 0)
    shark = _boxes(SHARK_BOXES, 2 * (x[6] >> 1 & 1) + faces_left, x[6], SHARK_Y)
    facing = jnp.where(faces_left == 1, WEST, EAST)
    return replace(shark, orientation=facing).where((m.picture[6] != EMPTY_PICTURE) & ~first)


def _line_tops(m: Ram) -> jax.Array:
    """Columns of the poles' ends."""
    drawn = m.hook_x + jnp.where(m.line_side == Side.RIGHT, 1 - m.line_reach, m.line_reach)
    return jnp.where(m.over == 0, drawn, m.pole_x) - 1


def _line_boxes(m: Ram, top_x: jax.Array) -> Box:
    """The lines, which the drawing loop moves sideways when a sum of slopes overflows.

    It draws a step of the depth in two rows, and seven steps in a row of fish. If a line ends
    behind a bar of a pier, the last step beside the bar is its end.
    """
    depth = jnp.minimum(m.count_down + STEPS & 0xFF, STEPS - 1)
    side = jnp.where(m.line_side == Side.RIGHT, 1, -1)
    end = _visible_depth(m, depth, top_x, side)
    hook_x = top_x + side * _aside(m, end)
    band = div(end, FISH_STEPS)
    end_row = np.array((81, 80)) + ROWS_APART * band + 2 * (end - FISH_STEPS * band)
    bottom = end_row + when((hook_x < LATE_END) | (end < depth), 1)
    left = jnp.minimum(top_x, hook_x)
    width = jnp.abs(hook_x - top_x) + 1
    towards = SOUTH - 2 * jnp.sign(hook_x - top_x)
    return box(left, LINE_TOP, width, bottom - LINE_TOP, orientation=towards)


def _visible_depth(m: Ram, depth: jax.Array, top_x: jax.Array, side: jax.Array) -> jax.Array:
    """The visible depth of the lines."""
    x = top_x + side * _aside(m, depth)
    bar = jnp.where(side > 0, (x & ~3) - top_x, top_x - (x | 3))  # columns to its near edge
    beside = lax.div(256 * bar - 1, jnp.maximum(m.line_slope, 1)) - STEPS_ABOVE
    return jnp.where(_behind_bar(x), jnp.clip(beside, 0, depth), depth)


def _aside(m: Ram, depth: jax.Array) -> jax.Array:
    """Columns from the upper ends of the lines to their points at some depths."""
    return (STEPS_ABOVE + depth) * m.line_slope >> 8


def _behind_bar(x: jax.Array) -> jax.Array:
    return ((x < 28) & ((x & 4) == 0)) | ((x >= 132) & ((x & 4) != 0))


def _score(m: Ram, player: int) -> Box:
    """A score, which may count up after it is drawn."""
    counts = (m.clock & 3) == player
    shown = m.score[player] - jnp.where(counts & (m.caught[player] > 0) & (m.over == 0), 1, 0)
    return SCORES[player].box(jnp.maximum(shown, 0), value=m.score[player])


facing_category = functools.partial(Category, attributes=("orientation",))
SEA = Blobs(
    YELLOW, (12, 80, 148, 190), Shape(w=(3, 9), h=(4, 10)), gap=(4, 1), filters=(NoLines(6),)
)
SHALLOWS = (20, 80, 140, 93)
SHARKS = Blobs(
    BLACK, SHALLOWS, Shape(w=(4, 40), h=(5, 13)), gap=(4, 2), filters=(NoLines(2),), ignore=BARS
)
LEFT_LINE = Bounds((GREEN, YELLOW), LINE_AREA, ignore=(*PIERS, *BARS), exclude=("Fish",))
RIGHT_LINE = Bounds(BLACK, LINE_AREA, ignore=(*PIERS, *BARS), exclude=("Shark",))

GAME = Game(
    name="FishingDerby",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        agreement={"modes": 0.96},  # VEM misses hooks behind fish, and fish that touch
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
