"""Amidar: the player paints a maze of lines and ladders; up to six warriors or pigs walk in it.

Screen: in odd levels the player is a gorilla among warriors, in even levels a roller among pigs. A
jump turns the others into shadows. The last corner turns them into chickens. A caught figure
becomes a shadow. Shadows are black: their boxes are the missing pixels of the maze. A shadow on the
last line walks below it and is invisible. The maze, painted or not, is scenery.

Two sprites draw all figures. If more than two figures are within 18 rows, the player has priority,
and each of the others has it on one of four frames. Therefore 2 % of the figures (4 to 6 % of
shadows and chickens) are missing on two successive frames. In play, a perfect reader of the screen
finds 98 % of REM's boxes, or 96 to 97 % including the invisible shadows on the last line.

Slots: the game sorts its records of seven figures from top to bottom. Slots follow a figure's rank,
which it keeps when it passes another. Two figures of rank 2 have no other distinction, so they swap
slots when they pass each other.

RAM: ALE's source (score, lives), OCAtari 2.2 (records, kinds), and the ROM's code. Figures move
after the frame is drawn; byte 92 schedules the player and the others alternately. `decode` reverts
that step and the turn at a crossing. The ROM's assignment of figures to sprites gives the sprite of
a shadow, and thus its height.

Covered: eight levels at both difficulties (ended by editing the painted lines), jumps, chickens,
deaths, the game's end. The `value` of Life is the emulator's, the low half of byte 86: 11 for three
lives in the first level at difficulty 0, 3 at difficulty 3.

Not exact: the RAM does not show whether a player that stopped turned round or rested (every other
step). On the frame on which a life or level ends, all records are already set for the next frame,
so no figure is valid. After a reset two frames are blank. On the next frame, only the top-line
figure that has priority, of three, is valid.

VEM: it reads 9 to 11 lives. It reports too many figures when figures of a kind overlap diagonally.
"""

import functools
import itertools
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Box,
    Category,
    Checks,
    Game,
    IconRow,
    NumberDisplay,
    RamMap,
    Rom,
    Shape,
    among,
    bcd,
    bits,
    box,
    byte,
    display,
    div,
    edges,
    match,
    mod,
    only,
    pick,
    when,
)

ROM = Rom("amidar", "acb7750b4d0c4bd34969802a7deb2990")
FONT = ROM.font(0xA13, rows=7, stride=8, dots=7)
SPEEDS = ROM.bytes(0xA0B, 8).tolist()  # by level, how often of 256 the others take a third step


class Kind:  # of `Ram.kind`
    WARRIOR = 2
    PIG = 3
    SHADOW = 6
    CHICKEN = 7


SHADOW_DRAWN = 16 * Kind.SHADOW + 7  # `drawn` of a shadow, on both lines and ladders
NO_FIGURE = 255  # `y`
UNSORTED = 2  # `player` on the frame on which all records have been reset
LONGEST_WAIT = 255
TWINS = 2  # `rank` of two figures other than the player and the tracer
OTHERS_FIRST = 5  # `turn` of a possible third step of the others; they also move on even turns
STICK_AT_REST = 144  # `stick`


class Called:  # of `Ram.called`
    WALK_BY_STICK = 9
    WALK_BETWEEN = 33  # crossings
    WALK_ON = 41


SCORE = NumberDisplay(FONT, right=104, top=176, digits=6)
RESERVE = IconRow(left=148, top=175, width=1, height=8, pitch=-16)
SIX_DIGITS = 100_000  # from this score the display begins a row earlier
SCORE_AREA = (56, 175, 105, 183)  # with that row
LIVES_AREA = (116, 174, 149, 183)  # with that row; of three icons
LIVES_OF_ICON = 9  # VEM's value of a single icon

YELLOW = 30
GREEN = 216
RED = 72
BLACK = 0
MAZE = (12, 12, 150, 172)
START = (139, 89)  # where lives begin
LEFT_SIDE = 6  # `x`
RIGHT_SIDE = 130
TOP_LINE = 7  # `y`
BOTTOM_LINE = 153
LAST_LINE_Y = 160  # `y` on the screen
HIGHEST_RANK = 3  # of a figure with priority on this frame
SPRITE_REACH = 18  # least rows between two figures that one sprite draws
LADDERS = (  # left columns of the ladders between two lines, by band from the top
    (16, 40, 56, 72, 84, 100, 116, 140),
    (16, 32, 52, 64, 92, 104, 124, 140),
    (16, 28, 60, 96, 128, 140),
    (16, 36, 72, 84, 120, 140),
    (16, 40, 64, 92, 116, 140),
)


def _ladder_bits(band: int) -> int:
    """The ladders of a band, a bit for every fourth column.

    Ladders at the sides count only if figures other than the tracer use them.
    """
    used = [x for x in LADDERS[band] if band % 2 == 0 or 16 < x < 140]
    return sum(1 << (x - 16) // 4 for x in used)


RUNGS = np.array([_ladder_bits(band) for band in range(5)], np.uint32).astype(np.int32).tolist()


def _gaps() -> tuple[tuple[int, int, int, int], ...]:
    """Areas of the maze without lines and rungs."""
    rows = [(0, y, 160, y + 1) for y in range(12, 172) if y % 5 in (1, 4) or not 15 <= y < 168]
    sides = [(0, 12, 16, 172), (144, 12, 160, 172)]
    holes = [
        (left + 4, 19 + 30 * band, right, 45 + 30 * band)
        for band, lefts in enumerate(LADDERS)
        for left, right in itertools.pairwise(lefts)
    ]
    return (*rows, *sides, *holes)


class Ram(RamMap):
    frames = byte(0)  # since the reset
    frame = bits(0, count=2)
    drawn = byte(50, 51)  # last picture of the two sprites, 16 * kind + 0 or 7
    y = byte(*range(59, 66))  # y - 7
    x = byte(*range(66, 73))  # x - 9
    rank = bits(*range(73, 80), count=2)  # frame of four on which the figure has priority
    vertical = bits(*range(73, 80), first=2)
    mark = bits(*range(73, 80), first=3)  # goes left along lines
    kind = bits(*range(73, 80), first=4, count=3)
    back = bits(*range(73, 80), first=7)  # left or, on ladders, down
    tracer = byte(80)  # record of the figure that walks along the border, clockwise
    icons = bits(86, count=2)
    lives = bits(86, count=4)
    carry = bits(86, first=1)
    level = bits(86, first=2, count=3)
    playing = bits(86, first=5)
    over = bits(86, first=7)
    player = byte(87)  # its record
    pace = byte(88)  # sum of the others' speeds
    score = bcd((91, 90, 89))
    turn = byte(92)  # counts 5 to 1: others, player, others, player, perhaps others
    wait = byte(94)  # frames before play, or of a jump
    stick = byte(112)  # the joystick, in the high nibble; after turn 3 constants take its place
    gained = bcd(115)  # after the frame was drawn
    called = byte(124)  # return address of the last call of the player's step: still on the stack


def decode(m: Ram) -> dict[str, Box]:
    begins = (m.playing == 0) & (m.over == 0) & (m.player == UNSORTED)  # a life or a level
    blank = begins & (m.wait == LONGEST_WAIT) | (m.y[0] == 0)
    own = (np.arange(7) == m.player) & (m.y != NO_FIGURE)
    x, y = _drawn_places(m, own)
    drawn, kind = _by_figure(m, own, _others(m, x, y, own))
    figures = drawn.where(~begins)
    shown = m.score - m.gained
    up = when(shown >= SIX_DIGITS, 1)
    boxes = {
        "Player": _player(m, x, y, own).where(~begins),
        "Warrior": figures.where(kind == Kind.WARRIOR),
        "Pig": figures.where(kind == Kind.PIG),
        "Shadow": figures.where(kind == Kind.SHADOW),
        "Chicken": figures.where(kind == Kind.CHICKEN),
        "Score": _raised(SCORE.box(shown, value=m.score), up),
        "Life": _raised(_lives_box(m, m.icons + when(begins, 1)), up),
    }
    return {name: each.where(~blank) for name, each in boxes.items()}


def _raised(of: Box, up: jax.Array) -> Box:
    """Move the display's boxes up by some rows."""
    return of.trimmed(top=-up, bottom=up)


def _lives_box(m: Ram, icons: jax.Array) -> Box:
    return RESERVE.box(icons, m.over == 0, value=m.lives)


def _others(m: Ram, x: jax.Array, y: jax.Array, own: jax.Array) -> jax.Array:
    """Kind, width, height, left and top of each figure in one word."""
    late = (m.frames == 1) & (m.wait == LONGEST_WAIT - 1) & (m.y == TOP_LINE) & (m.rank != m.frame)
    kind = jnp.where(own | (m.y == NO_FIGURE) | late, 0, _drawn_kinds(m))
    shadow = _shadows(x + 3, y, _by_first_sprite(m, y, own))
    is_shadow = kind == Kind.SHADOW
    inset = jnp.where(kind == Kind.CHICKEN, 1, 0)
    left = jnp.where(is_shadow, shadow.x, x + inset)
    top = jnp.where(is_shadow, shadow.y, y)
    width = jnp.where(is_shadow, jnp.maximum(shadow.w, 0), 7 - 2 * inset)
    height = jnp.where(is_shadow, shadow.h, 7)
    return kind | width << 4 | height << 8 | (left & 255) << 12 | (top & 255) << 20


def _by_figure(m: Ram, own: jax.Array, packed: jax.Array) -> tuple[Box, jax.Array]:
    """The figures in an order that they keep when they pass each other, and their kinds."""
    twin = jnp.where(m.rank == TWINS, 1, 0)
    by_rank = pick(m.rank, (0, 1, 2, 4)) + jnp.where(jnp.cumsum(twin) > 1, twin, 0)
    nobody = own | (m.y == NO_FIGURE)
    slot = match((nobody, 6), (np.arange(7) == m.tracer, 5), otherwise=by_rank)
    here = [jnp.where(slot == i, packed, 0) for i in range(6)]
    by_slot = jnp.stack([jnp.max(records) for records in (*here, jnp.zeros_like(slot))])
    x = by_slot >> 12 & 255
    y = by_slot >> 20 & 255
    return box(x, y, by_slot >> 4 & 15, by_slot >> 8 & 15), by_slot & 15


def _player(m: Ram, x: jax.Array, y: jax.Array, own: jax.Array) -> Box:
    """At the end of the game the player's record is gone, but this frame shows it at the start."""
    gone = (m.over == 1) & (m.wait == 0)
    left = jnp.where(gone, START[0], only(own, x))
    top = jnp.where(gone, START[1], only(own, y))
    return box(left, top, 7, 7, gone | jnp.any(own))


def _drawn_places(m: Ram, own: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Positions of the figures before their last step and its final turn."""
    above, below = _at_ladders(m)
    vertical = m.vertical == 1
    on_line = (mod(m.y, 30) == TOP_LINE) | (m.y == BOTTOM_LINE)
    crossing = jnp.where(vertical, on_line, above | below)
    at_side = among(m.x, (LEFT_SIDE, RIGHT_SIDE))
    corner = jnp.where(vertical, among(m.y, (TOP_LINE, BOTTOM_LINE)), at_side)
    turned = crossing & ~own & ((np.arange(7) != m.tracer) | corner)
    left = jnp.where(at_side, m.x == LEFT_SIDE, m.mark == 1)
    back = jnp.where(turned, jnp.where(vertical, left, above), m.back == 1)
    upright = vertical ^ turned
    player_crosses = jnp.any(own & crossing)
    stepped = jnp.where(own, _player_stepped(m, player_crosses), _others_stepped(m))
    step = when(stepped, jnp.where(back, 1, -1))
    return m.x + 9 + when(~upright, step), m.y + 7 - when(upright, step)


def _at_ladders(m: Ram) -> tuple[jax.Array, jax.Array]:
    """True if a ladder begins above each figure; the same for below."""
    line = div(m.y + 5, 30)
    column = m.x - LEFT_SIDE
    at_rungs = sum((word >> (column >> 2 & 31) & 1) << band for band, word in enumerate(RUNGS))
    bands = when((column & 3) == 0, at_rungs)
    return ((bands << 1) >> line & 1) == 1, (bands >> line & 1) == 1


def _player_stepped(m: Ram, crossing: jax.Array) -> jax.Array:
    """True if the player has taken a step since the frame was drawn."""
    pressed = (m.turn == 1) & ((m.stick & 15) == 0) & (m.stick != STICK_AT_REST)
    walked_on = m.called == Called.WALK_ON
    walked_between = (m.called == Called.WALK_BETWEEN) & ~crossing
    walked_by_stick = (m.called == Called.WALK_BY_STICK) & pressed
    walked = walked_on | walked_between | walked_by_stick
    own_turn = ((m.turn & 1) == 1) & (m.turn != OTHERS_FIRST)
    return walked & own_turn & (m.playing == 1)


def _others_stepped(m: Ram) -> jax.Array:
    """True if the others have stepped; after the game they step on every other frame."""
    third_step = m.pace < pick(m.level, SPEEDS) + m.carry
    in_turn = jnp.where(m.turn == OTHERS_FIRST, third_step, (m.turn & 1) == 0)
    after_game = (m.over == 1) & ((m.frame & 1) == 1)
    return (in_turn & (m.playing == 1)) | after_game


def _drawn_kinds(m: Ram) -> jax.Array:
    """Kinds of the figures on the screen: jumps begin and end after the drawing."""
    jumping = ~jnp.any((m.kind == Kind.CHICKEN) & (m.y != NO_FIGURE))
    usual = jnp.where((m.level & 1) == 1, Kind.PIG, Kind.WARRIOR)
    dark = jnp.any(m.drawn == SHADOW_DRAWN)
    light = jnp.any(m.drawn == 16 * usual)
    begins = jumping & light & ~dark & (m.kind == Kind.SHADOW)
    ends = jumping & dark & (m.kind == usual)
    return match((begins, usual), (ends, Kind.SHADOW), otherwise=m.kind)


def _by_first_sprite(m: Ram, y: jax.Array, own: jax.Array) -> jax.Array:
    """True if the first sprite draws a figure; the ROM assigns figures from the bottom up.

    A sprite is free for a figure far enough above its last figure. A figure of higher rank takes a
    sprite from a figure of lower rank.
    """
    rank = match((m.rank == m.frame, HIGHEST_RANK), (own, 2), otherwise=1)

    def given(before: Sprites, i: int) -> Sprites:
        return _after_figure(before, Held(y[i], rank[i], 1 << i), m.y[i] != NO_FIGURE)

    nothing = Held(jnp.int32(999), jnp.int32(0), jnp.int32(0))
    at_first = Sprites(nothing, nothing, drawn=jnp.int32(0), second_next=jnp.bool_(True))
    last = functools.reduce(given, reversed(range(7)), at_first)
    return ((last.drawn | last.first.bit) >> np.arange(7) & 1) == 1


class Held(NamedTuple):
    """The figure that a sprite has taken."""

    y: jax.Array
    rank: jax.Array
    bit: jax.Array | int


class Sprites(NamedTuple):
    """The two sprites during the assignment of figures."""

    first: Held
    second: Held
    drawn: jax.Array  # bits of figures that the first sprite has finished
    second_next: jax.Array  # the second sprite has the first choice


def _after_figure(before: Sprites, figure: Held, there: jax.Array) -> Sprites:
    """The sprites after a figure, which one of them takes if possible."""
    is_free = before.first.y - figure.y >= SPRITE_REACH
    second_is_free = before.second.y - figure.y >= SPRITE_REACH
    can = (is_free | (before.first.rank < figure.rank)) & there
    second_can = (second_is_free | (before.second.rank < figure.rank)) & there
    is_highest = figure.rank == HIGHEST_RANK
    takes = can & (~before.second_next | (~second_can & is_highest))
    second_takes = second_can & (before.second_next | (~can & is_highest))
    return Sprites(
        first=jax.tree.map(lambda new, old: jnp.where(takes, new, old), figure, before.first),
        second=jax.tree.map(
            lambda new, old: jnp.where(second_takes, new, old), figure, before.second
        ),
        drawn=before.drawn | when(takes & is_free, before.first.bit),
        second_next=~second_takes & (before.second_next | takes),
    )


def _shadows(x: jax.Array, y: jax.Array, first: jax.Array) -> Box:
    """Visible rows of shadows on the maze and on a ladder; the whole shadow if none is visible.

    The game clears a sprite on one row of every five, and the shadow ends there.
    """
    phase = mod(y, 5)
    bottom = y + jnp.where(first, pick(phase, (1, 5, 4, 3, 2)), pick(phase, (4, 3, 2, 1, 5)))
    top = y + pick(phase, (0, 1, 0, 0, 1))
    on_line = (mod(y + 15, 30) < 4) | (mod(bottom + 14, 30) < 4)
    ladder = sum(jnp.where(abs(x - at) < 4, at, 0) for at in LADDERS[4])
    on_last_line = y == LAST_LINE_Y
    beside = on_last_line & (ladder > 0)
    left = jnp.where(beside, jnp.maximum(x, ladder), x)
    right = match(
        (beside, jnp.minimum(x, ladder) + 4),
        (on_line | on_last_line, x + 4),
        otherwise=x + 2,
    )
    return edges(left, top, jnp.minimum(right, 144), bottom)


others_of = functools.partial(Category, count=7, blinks=True)
walkers = functools.partial(Blobs, region=MAZE, shapes=Shape(w=(5, 21), h=(5, 21), split=(7, 7)))

PLAYER_RULE = Blobs(YELLOW, MAZE, Shape(w=(6, 14), h=(6, 14)))
SHADOWS_RULE = Blobs(BLACK, MAZE, Shape(w=(1, 4), h=(1, 7)), gap=(0, 1), ignore=_gaps())
CHICKENS = Blobs(YELLOW, MAZE, Shape(w=(4, 5), h=(6, 14), split=(5, 7)))
SCORE_RULE = SCORE.rule(YELLOW, SCORE_AREA, required=True)
RULE_OF_SIX = replace(SCORE, top=SCORE.top - 1).rule(YELLOW, SCORE_AREA, required=True)
LIVES_RULE = RESERVE.rule(YELLOW, LIVES_AREA, single=LIVES_OF_ICON)

GAME = Game(
    name="Amidar",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        # The frame on which a life ends is older than the RAM, which has no figures then. VEM
        # reports too many overlapping figures.
        agreement={"lost": 0.39, "modes": 0.95},
        at_limits={"Score": (99_999, 100_000, 123_456)},  # six digits begin a row earlier
    ),
    categories=(
        Category("Player", PLAYER_RULE, role="player", doc="gorilla or roller"),
        others_of("Warrior", walkers(GREEN), doc="odd levels"),
        others_of("Pig", walkers(RED), doc="even levels"),
        others_of("Shadow", SHADOWS_RULE, doc="black on the maze"),
        others_of("Chicken", CHICKENS, doc="to be caught"),
        display("Score", SCORE_RULE, otherwise=RULE_OF_SIX, role="score", doc="points"),
        display("Life", LIVES_RULE, role="lives", doc="lives left"),
    ),
)
