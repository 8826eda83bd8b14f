"""Amidar: the player paints a maze of lines and ladders; up to six warriors or pigs walk in it.

Picture: docs/games/Amidar.png

Screen: in odd levels the player is a gorilla among warriors, in even levels a roller among pigs. A
jump turns the others into shadows. The last corner turns them into chickens. A caught figure
becomes a shadow. Shadows are black: their boxes are the missing pixels of the maze. A shadow on the
last line walks below it and is invisible.

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

Timeline between two frames, by byte 92:
    turn 5     the others take a third step, if the sum of their speeds says so
    turn 4, 2  the others step
    turn 3, 1  the player steps
A figure that has come to a crossing turns there. Jumps begin and end, and points are added.

Timeline of the drawing loop, which repeats every five rows of the maze: it clears the first sprite
on one of the five rows and the second sprite on another. A shadow, which is visible only on lines
and ladders, ends on that row (`FIRST_SPRITE_ENDS`, `SECOND_SPRITE_ENDS`).

Covered: eight levels at both difficulties (ended by editing the painted lines), jumps, chickens,
deaths, the game's end. The `value` of Life is the emulator's, the low half of byte 86: 11 for three
lives in the first level at difficulty 0, 3 at difficulty 3.

Not exact: the RAM does not show whether a player that stopped turned round or rested (every other
step). On the frame on which a life or level ends, all records are already set for the next frame,
so no figure is valid. After a reset two frames are blank. On the next frame, only the top-line
figure that has priority, of three, is valid.

Terrain: `path` is the lines and ladders, the same in all levels. `paint` is the lines that the
player has painted, and the boxes between them that are full. The drawing loop alternates rows of
the two. The game paints after it draws the frame, so new paint is a frame early.

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
    KindEntry,
    Kinds,
    NumberDisplay,
    Shape,
    Word,
    among,
    box,
    choose,
    display,
    div,
    edges,
    match,
    mod,
    pick,
    when,
)
from ocjax.extractors.amidar.ram import LONGEST_WAIT, ROM, Ram, is_beginning, is_blank
from ocjax.extractors.amidar.terrain import TERRAIN

FONT = ROM.font(0xA13, rows=7, stride=8, dots=7)
SPEEDS = ROM.bytes(0xA0B, 8).tolist()  # by level, how often of 256 the others take a third step


class Kind:  # of `Ram.kind`
    WARRIOR = 2
    PIG = 3
    SHADOW = 6
    CHICKEN = 7


SHADOW_DRAWN = 16 * Kind.SHADOW + 7  # `drawn` of a shadow, on both lines and ladders
NO_FIGURE = 255  # `y`
TWINS = 2  # `rank` of two figures other than the player and the tracer
SLOT_OF_RANK = (0, 1, 2, 4)  # the second twin has slot 3
TRACER_SLOT = 5
NO_SLOT = 6  # of the player and of unused records; always empty
RECORDS = np.arange(7)
STICK_AT_REST = 144  # `stick`


class Turn:  # of `Ram.turn`; the others also step on even turns, the player on odd ones
    PLAYER_BY_STICK = 1  # the game reads the joystick
    OTHERS_FIRST = 5  # a possible third step of the others


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
OUR_X = 9  # columns from `x` to the screen
OUR_Y = 7  # rows from `y` to the screen
SIZE = 7  # columns and rows of a figure
BAND_ROWS = 30  # rows from one line of the maze to the next
SHADOW_INSET = 3  # columns of a figure left of its shadow
CHICKEN_INSET = 1  # columns of a figure beside a chicken, on each side

# The assignment of figures to sprites.
TURN_RANK = 3  # of a figure with priority on this frame
PLAYER_RANK = 2
OTHER_RANK = 1
SPRITE_REACH = 18  # least rows between two figures that one sprite draws
FAR_BELOW = 999  # `y` of no figure

# Rows of a shadow by its top row modulo 5: the first sprite's last row + 1, the second sprite's,
# and the hidden rows at the top.
FIRST_SPRITE_ENDS = (1, 5, 4, 3, 2)
SECOND_SPRITE_ENDS = (4, 3, 2, 1, 5)
HIDDEN_TOP_ROWS = (0, 1, 0, 0, 1)
LINE_ROWS = 4  # of a line of the maze, also columns of a ladder
MAZE_END = 144  # the column right of the maze
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


# A figure as drawn, in one number: a single maximum finds the record of a slot.
FIGURE_WORD = Word(kind=4, width=4, height=4, left=8, top=8)


class Drawn(NamedTuple):
    """The frame as drawn; positions on the screen, one entry per record."""

    own: jax.Array  # the player's record
    unused: jax.Array
    x: jax.Array
    y: jax.Array
    begins: jax.Array  # a life or a level; the records are already set for the next frame
    blank: jax.Array  # the whole screen


def decode(m: Ram) -> dict[str, Box]:
    drawn = _as_drawn(m)
    figures, kind = _figures_by_slot(m, drawn)
    shown = m.score - m.gained
    up = when(shown >= SIX_DIGITS, 1)
    boxes = {
        "Player": _player_box(m, drawn),
        **OTHERS.split(figures.where(~drawn.begins), kind),
        "Score": _raised(SCORE.box(shown, value=m.score), up),
        "Life": _raised(_lives_box(m, m.icons + when(drawn.begins, 1)), up),
    }
    return {name: each.where(~drawn.blank) for name, each in boxes.items()}


def _raised(of: Box, up: jax.Array) -> Box:
    """Move the display's boxes up by some rows."""
    return of.trimmed(top=-up, bottom=up)


def _lives_box(m: Ram, icons: jax.Array) -> Box:
    return RESERVE.box(icons, ~m.over, value=m.lives)


def _player_box(m: Ram, drawn: Drawn) -> Box:
    """At the end of the game the player's record is gone, but this frame shows it at the start."""
    gone = m.over & (m.wait == 0)
    here = box(drawn.x, drawn.y, SIZE, SIZE, drawn.own).only()
    return choose(gone, box(*START, SIZE, SIZE), here).where(~drawn.begins)


def _figures_by_slot(m: Ram, drawn: Drawn) -> tuple[Box, jax.Array]:
    """The figures in an order that they keep when they pass each other, and their kinds."""
    words = _figure_words(m, drawn)
    slot = _slots(m, drawn)
    of_slots = [when(slot == i, words) for i in range(NO_SLOT)]
    nothing = jnp.zeros_like(slot)
    found = FIGURE_WORD.unpack(jnp.stack([jnp.max(each) for each in (*of_slots, nothing)]))
    return box(found.left, found.top, found.width, found.height), found.kind


def _slots(m: Ram, drawn: Drawn) -> jax.Array:
    """The slot of each record."""
    is_twin = when(m.rank == TWINS, 1)
    is_second_twin = when(jnp.cumsum(is_twin) > 1, is_twin)
    return match(
        (drawn.unused | drawn.own, NO_SLOT),
        (m.tracer == RECORDS, TRACER_SLOT),
        otherwise=pick(m.rank, SLOT_OF_RANK) + is_second_twin,
    )


def _figure_words(m: Ram, drawn: Drawn) -> jax.Array:
    """Each record's figure as a `FIGURE_WORD`."""
    kind = _seen_kinds(m, drawn)
    shadow = _shadow_boxes(drawn.x + SHADOW_INSET, drawn.y, _by_first_sprite(m, drawn))
    is_shadow = kind == Kind.SHADOW
    inset = when(kind == Kind.CHICKEN, CHICKEN_INSET)
    return FIGURE_WORD.pack(
        kind=kind,
        width=jnp.where(is_shadow, jnp.maximum(shadow.w, 0), SIZE - 2 * inset),
        height=jnp.where(is_shadow, shadow.h, SIZE),
        left=jnp.where(is_shadow, shadow.x, drawn.x + inset),
        top=jnp.where(is_shadow, shadow.y, drawn.y),
    )


def _seen_kinds(m: Ram, drawn: Drawn) -> jax.Array:
    """Kinds of the figures on the screen; 0 for the player and for unused records."""
    second_frame = (m.frames == 1) & (m.wait == LONGEST_WAIT - 1)
    without_priority = (m.y == TOP_LINE) & (m.rank != m.frame)
    is_late = second_frame & without_priority
    return jnp.where(drawn.own | drawn.unused | is_late, 0, _drawn_kinds(m))


def _as_drawn(m: Ram) -> Drawn:
    """Revert the figures' last step and its final turn."""
    unused = m.y == NO_FIGURE
    own = (m.player == RECORDS) & ~unused
    crossing, above = _crossings(m)
    turned = crossing & ~own & ((m.tracer != RECORDS) | _at_corner(m))
    back = jnp.where(turned, _back_before_turn(m, above), m.back)
    upright = m.vertical ^ turned
    player_crosses = jnp.any(own & crossing)
    stepped = jnp.where(own, _player_stepped(m, player_crosses), _others_stepped(m))
    step = when(stepped, jnp.where(back, 1, -1))
    return Drawn(
        own=own,
        unused=unused,
        x=m.x + OUR_X + when(~upright, step),
        y=m.y + OUR_Y - when(upright, step),
        begins=is_beginning(m),
        blank=is_blank(m),
    )


def _crossings(m: Ram) -> tuple[jax.Array, jax.Array]:
    """True for figures at a crossing; True for figures below a ladder."""
    above, below = _at_ladders(m)
    on_line = (mod(m.y, BAND_ROWS) == TOP_LINE) | (m.y == BOTTOM_LINE)
    return jnp.where(m.vertical, on_line, above | below), above


def _at_side(m: Ram) -> jax.Array:
    return among(m.x, (LEFT_SIDE, RIGHT_SIDE))


def _at_corner(m: Ram) -> jax.Array:
    """True for figures at an end of their line or ladder that is a corner of the border."""
    return jnp.where(m.vertical, among(m.y, (TOP_LINE, BOTTOM_LINE)), _at_side(m))


def _back_before_turn(m: Ram, above: jax.Array) -> jax.Array:
    """True if a figure went left or, on a ladder, down before it turned."""
    left = jnp.where(_at_side(m), m.x == LEFT_SIDE, m.mark)
    return jnp.where(m.vertical, left, above)


def _at_ladders(m: Ram) -> tuple[jax.Array, jax.Array]:
    """True if a ladder begins above each figure; the same for below."""
    column = m.x - LEFT_SIDE
    rung = column >> 2 & 31  # number of the ladder's place
    # Bit i: the band i from the top has a ladder here.
    bands = sum((of_band >> rung & 1) << band for band, of_band in enumerate(RUNGS))
    here = when((column & 3) == 0, bands)
    line = div(m.y + 5, BAND_ROWS)  # the line from the top; band i is below line i
    above = (here << 1) >> line & 1
    below = here >> line & 1
    return above == 1, below == 1


def _player_stepped(m: Ram, crossing: jax.Array) -> jax.Array:
    """True if the player has taken a step since the frame was drawn."""
    reads_stick = (m.turn == Turn.PLAYER_BY_STICK) & ((m.stick & 15) == 0)
    pressed = reads_stick & (m.stick != STICK_AT_REST)
    walked_on = m.called == Called.WALK_ON
    walked_between = (m.called == Called.WALK_BETWEEN) & ~crossing
    walked_by_stick = (m.called == Called.WALK_BY_STICK) & pressed
    walked = walked_on | walked_between | walked_by_stick
    is_odd = (m.turn & 1) == 1
    own_turn = is_odd & (m.turn != Turn.OTHERS_FIRST)
    return walked & own_turn & m.playing


def _others_stepped(m: Ram) -> jax.Array:
    """True if the others have stepped; after the game they step on every other frame."""
    third_step = m.pace < pick(m.level, SPEEDS) + m.carry
    is_even = (m.turn & 1) == 0
    in_turn = jnp.where(m.turn == Turn.OTHERS_FIRST, third_step, is_even)
    in_play = in_turn & m.playing
    after_game = m.over & ((m.frame & 1) == 1)
    return in_play | after_game


def _drawn_kinds(m: Ram) -> jax.Array:
    """Kinds of the figures on the screen: jumps begin and end after the drawing."""
    jumping = ~jnp.any((m.kind == Kind.CHICKEN) & (m.y != NO_FIGURE))
    usual = jnp.where((m.level & 1) == 1, Kind.PIG, Kind.WARRIOR)
    dark = jnp.any(m.drawn == SHADOW_DRAWN)
    light = jnp.any(m.drawn == 16 * usual)
    begins = jumping & light & ~dark & (m.kind == Kind.SHADOW)
    ends = jumping & dark & (m.kind == usual)
    return match((begins, usual), (ends, Kind.SHADOW), otherwise=m.kind)


def _by_first_sprite(m: Ram, drawn: Drawn) -> jax.Array:
    """True if the first sprite draws a figure; the ROM assigns figures from the bottom up.

    A sprite is free for a figure far enough above its last figure. A figure of higher rank takes a
    sprite from a figure of lower rank.
    """
    rank = match((m.rank == m.frame, TURN_RANK), (drawn.own, PLAYER_RANK), otherwise=OTHER_RANK)

    def after(before: Sprites, record: int) -> Sprites:
        figure = Held(drawn.y[record], rank[record], jnp.int32(1 << record))
        return _after_figure(before, figure, ~drawn.unused[record])

    nothing = Held(jnp.int32(FAR_BELOW), jnp.int32(0), jnp.int32(0))
    at_first = Sprites(nothing, nothing, drawn=jnp.int32(0), second_next=jnp.bool_(True))
    last = functools.reduce(after, reversed(RECORDS.tolist()), at_first)
    by_first = last.drawn | last.first.bit
    return (by_first >> RECORDS & 1) == 1


class Held(NamedTuple):
    """The figure that a sprite has taken."""

    y: jax.Array
    rank: jax.Array
    bit: jax.Array  # the bit of its record


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
    outranks = before.first.rank < figure.rank
    outranks_second = before.second.rank < figure.rank
    can = (is_free | outranks) & there
    second_can = (second_is_free | outranks_second) & there
    has_turn = figure.rank == TURN_RANK  # takes the sprite that it can get
    takes = can & (~before.second_next | (~second_can & has_turn))
    second_takes = second_can & (before.second_next | (~can & has_turn))
    return Sprites(
        first=_held_after(takes, figure, before.first),
        second=_held_after(second_takes, figure, before.second),
        drawn=before.drawn | when(takes & is_free, before.first.bit),
        second_next=~second_takes & (before.second_next | takes),
    )


def _held_after(takes: jax.Array, figure: Held, before: Held) -> Held:
    return jax.tree.map(lambda new, old: jnp.where(takes, new, old), figure, before)


def _shadow_boxes(x: jax.Array, y: jax.Array, by_first: jax.Array) -> Box:
    """Visible rows of shadows on the maze and on a ladder; the whole shadow if none is visible."""
    phase = mod(y, 5)
    first_ends = pick(phase, FIRST_SPRITE_ENDS)
    second_ends = pick(phase, SECOND_SPRITE_ENDS)
    top = y + pick(phase, HIDDEN_TOP_ROWS)
    bottom = y + jnp.where(by_first, first_ends, second_ends)
    begins_on_line = mod(y + 15, BAND_ROWS) < LINE_ROWS
    ends_on_line = mod(bottom + 14, BAND_ROWS) < LINE_ROWS
    on_last_line = y == LAST_LINE_Y  # only a ladder of the last band shows a part
    on_line = begins_on_line | ends_on_line | on_last_line
    ladder = sum(when(abs(x - left) < LINE_ROWS, left) for left in LADDERS[4])
    beside = on_last_line & (ladder > 0)
    left = jnp.where(beside, jnp.maximum(x, ladder), x)
    right = match(
        (beside, jnp.minimum(x, ladder) + LINE_ROWS),
        (on_line, x + LINE_ROWS),
        otherwise=x + 2,
    )
    return edges(left, top, jnp.minimum(right, MAZE_END), bottom)


walkers = functools.partial(Blobs, region=MAZE, shapes=Shape(w=(5, 21), h=(5, 21), split=(7, 7)))
PLAYER_RULE = Blobs(YELLOW, MAZE, Shape(w=(6, 14), h=(6, 14)))
SHADOWS_RULE = Blobs(BLACK, MAZE, Shape(w=(1, 4), h=(1, 7)), gap=(0, 1), ignore=_gaps())
CHICKENS = Blobs(YELLOW, MAZE, Shape(w=(4, 5), h=(6, 14), split=(5, 7)))


def _figure_kind(kind: int, name: str, rule: Blobs, doc: str) -> KindEntry:
    return KindEntry(Category(name, rule, count=7, blinks=True, doc=doc), (kind,))


OTHERS = Kinds(  # of the figures other than the player
    _figure_kind(Kind.WARRIOR, "Warrior", walkers(GREEN), "odd levels"),
    _figure_kind(Kind.PIG, "Pig", walkers(RED), "even levels"),
    _figure_kind(Kind.SHADOW, "Shadow", SHADOWS_RULE, "black on the maze"),
    _figure_kind(Kind.CHICKEN, "Chicken", CHICKENS, "to be caught"),
)
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
    terrain=TERRAIN,
    categories=(
        Category("Player", PLAYER_RULE, role="player", doc="gorilla or roller"),
        *OTHERS.categories,
        display("Score", SCORE_RULE, otherwise=RULE_OF_SIX, role="score", doc="points"),
        display("Life", LIVES_RULE, role="lives", doc="lives left"),
    ),
)
