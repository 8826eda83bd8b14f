"""Pooyan: a pig in a lift shoots at wolves that hang on balloons.

Picture: docs/games/Pooyan.png

Screen: in even rounds, wolves march in at the top and float down. In odd rounds, they float up and
push a rock over the edge; a frame then shows either the rock or the wolves at it. The pig at the
winch is scenery, as are ropes, remains of popped balloons, and the part of a bow beside a balloon.
At the left edge, the columns of a shot left of the beam appear one line later.

Slots: Balloon and Enemy 0-5 have the game's records, two in each column. Enemy 6 climbs at the
right, 7-9 march or stand, 10 has landed, 11-16 push the rock. Bait may still be in the pig's hand.

RAM: ALE's source (score, lives), OCAtari 2.2, and the ROM's code: f09d-f3d5 draws, from the score
down to the lives. One loop of 15 lines draws each of the lift's six rows. It has one sprite for the
pig, and one for a balloon, the climber or the rock: the first of these that the program finds.

Covered: all modes, five rounds by writing RAM, the fall of the rock, also in a round that should
not have it (wolves that have landed push it while the pig falls), lost lives, rounds that end.

Not exact: when a life is lost or a round ends, the program clears its records before the frame is
finished. The RAM then lacks the balloons, shots, stones and the climber of this frame, and the
position of wolves that march, unless they stand. A climber that has just drawn back is one step too
far right for a frame. Objects that fall through the row of a balloon hide it, for up to two dozen
frames.

VEM: it cannot distinguish the number of the fifth, tenth, ... round from a score. It misses stones
that touch balloons, wolves or the left part of a row, where the beam is a line late.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Box,
    Category,
    Checks,
    Game,
    IconRow,
    NumberDisplay,
    Pictures,
    among,
    box,
    choose,
    display,
    match,
    only,
    packed_position,
    pick,
    when,
    wrap,
)
from ocjax.extractors.pooyan.drawn import Drawn, as_drawn, column
from ocjax.extractors.pooyan.ram import LAST_ROW, ROM, Kind, Ram
from ocjax.extractors.pooyan.screen import (
    BALLOON_LINES,
    BOTTOM_LINE,
    CLIFFS,
    CLIMBER_LEFTS,
    COLUMNS,
    FIRST_LINE,
    GROUND_LINE,
    PIG_LEFT,
    PITCH,
    ROCK,
    ROCK_HEIGHT,
    ROCK_WIDTH,
    ROWS,
    TOP_LINE,
    WHITE,
    WOLF,
    WOLF_WIDTH,
)
from ocjax.extractors.pooyan.vision import ARROW, BAIT, BALLOON, PIG, ROCK_RULE, STONE, WOLVES_RULE

SCORE = NumberDisplay(ROM.font(0xF00, rows=9, stride=10), right=103, top=3, digits=6)
LIVES = IconRow(left=37, top=206, width=2, height=6, pitch=4)
MOST_LIVES = 4  # most icons

BALLOON_COLORS = ROM.bytes(0xFC0, 6) & 0xFE

LINES = 15  # of a row that show sprites
MISSILE_SHIFT = 47  # columns
SHOT_ON = 28  # column of the beam when shots are switched on and off
SHOT_CUT = 97  # column of the beam when they are switched off in the last line
STONE_ON = 52
STONE_CUT = 106
DELAY = 15  # columns of the beam, in the line below a balloon
SHOT_WIDTH = 8
ARROW_LINE = 6  # of a row
BAIT_LINES = 4
STONE_SIZE = 4
ROCK_LINE = 4  # of the top or of a row
BALLOON_LEFTS = np.repeat(COLUMNS, 2)
BALLOON_CUTS = np.repeat((0, 0, 1), 2)  # lines
PUSHER_LEFTS = 55 + 8 * np.arange(6)
MARCHERS = np.arange(3)
MARCH_PITCH = 32  # columns

FLIGHTS = ROM.bytes(0xFDB, 6)  # low bytes of addresses of pictures, by kind
CLIMBS = ROM.bytes(0xFE1, 3)
BALLOONS = Pictures.of(
    [ROM.rows(0xE00 + low, LINES)[:BALLOON_LINES] & 0xFC for low in FLIGHTS.tolist()],
)
# Each also without its last line: sprites are switched off in it before the right column.
WOLVES = Pictures.of(
    [
        np.where(np.arange(LINES) >= BALLOON_LINES, ROM.rows(0xE00 + low, LINES), 0)[:end]
        for low in FLIGHTS.tolist()
        for end in (LINES, LINES - 1)
    ],
    kind=6,
    cut=2,
)
CLIMBERS = Pictures.of([ROM.rows(0xE00 + low, LINES)[:-1] for low in CLIMBS.tolist()])
PIGS = Pictures.of([ROM.rows(0xE00 + low, LINES)[:-1] for low in range(256)])
WALKS = tuple(ROM.rows(0xF00 + low, 16) for low in (0x64, 0x74))


# Columns of a wolf outside the cliffs at its left or right, as bits.
SIGHTS = [0xFF >> n for n in range(WOLF_WIDTH)] + [0xFF << n & 0xFF for n in range(1, WOLF_WIDTH)]
TOP_WALKS = Pictures.of([rows[1:] for rows in WALKS])
BOTTOM_WALKS = Pictures.of(
    [rows[:-1] & sight for rows in WALKS for sight in SIGHTS], stride=2, hidden=len(SIGHTS)
)
PUSHES = Pictures.of([ROM.rows(0xE00 + low, LINES) for low in (0xE0, 0xEF)])
PUSH = 0xEE  # of `Ram.pushes`: the first picture


def decode(m: Ram) -> dict[str, Box]:
    d = as_drawn(m)
    floats = among(m.balloon_row, ROWS)
    shot = _shot_box(m, d)
    shown = jnp.where(d.shows_round, m.round + 1, m.score)
    icons = jnp.minimum(m.lives + when(d.is_lost, 1), MOST_LIVES)
    return {
        "Player": _pig_box(m, d),
        "Balloon": _balloon_boxes(m, d, floats),
        "Enemy": _wolf_boxes(m, d, floats),
        "Arrow": shot.where(~m.is_bait),
        "Bait": shot.where(m.is_bait),
        "Stone": _stone_box(m, d),
        "Rock": _rock_box(m, d),
        "PlayerScore": SCORE.box(shown, value=m.score),
        "Lives": LIVES.box(icons, value=m.lives + 1),
    }


def _line(row: jax.Array) -> jax.Array:
    """The first line of a row."""
    return FIRST_LINE + PITCH * row


def _pig_box(m: Ram, d: Drawn) -> Box:
    there = among(d.row, ROWS)
    return PIGS.box(m.picture, PIG_LEFT, _line(d.row), valid=there, color=d.player_color)


def _colors(m: Ram, d: Drawn) -> jax.Array:
    """Colours of balloons."""
    return jnp.where(m.boss == np.arange(1, 7), d.flash, BALLOON_COLORS)


def _balloon_boxes(m: Ram, d: Drawn, floats: jax.Array) -> Box:
    there = floats & (m.kind <= Kind.ARCHER)
    y = _line(m.balloon_row)
    return BALLOONS.box(m.kind, BALLOON_LEFTS, y, valid=there, color=_colors(m, d))


def _wolf_boxes(m: Ram, d: Drawn, floats: jax.Array) -> Box:
    """Wolves: six in the air, the climber, three that march, one that has landed, six pushers."""
    in_air = WOLVES.index(kind=jnp.minimum(m.kind, Kind.FALLS), cut=BALLOON_CUTS)
    return Box.stacked(
        WOLVES.box(in_air, BALLOON_LEFTS, _line(m.balloon_row), valid=floats),
        CLIMBERS.box(
            d.reach[None],
            pick(d.reach, CLIMBER_LEFTS),
            _line(d.climber_row),
            valid=among(d.climber_row, ROWS)[None],
        ),
        _walker_boxes(m, d),
        PUSHES.box(
            jnp.broadcast_to(when(m.pushes != PUSH, 1), (6,)),
            PUSHER_LEFTS,
            TOP_LINE,
            valid=(d.ascends == 1) & (d.pushers > np.arange(6)),
        ),
    )


def _walker_boxes(m: Ram, d: Drawn) -> Box:
    """Wolves that march, at the top or at the bottom, and one that has landed."""
    march_x = d.march_x + MARCH_PITCH * MARCHERS
    marches = d.marchers > MARCHERS
    # At the left edge, the beam shows the ear of the second picture a line later.
    late = when((march_x == 0) & (d.stride == 1), 1)
    top = TOP_WALKS.box(d.stride, march_x, TOP_LINE).trimmed(top=late)
    bottom = _bottom_boxes(d, jnp.append(march_x, d.landed_x))
    here = d.ascends == 1
    return Box.stacked(
        choose(here, bottom[:3], top).where(marches), bottom[3:].where(d.is_landed & ~here)
    )


def _bottom_boxes(d: Drawn, x: jax.Array) -> Box:
    """Wolves that walk between the cliffs."""
    left = CLIFFS[0] - x
    right = x + WOLF_WIDTH - CLIFFS[1]
    hidden = match((left > 0, left), (right > 0, right + WOLF_WIDTH - 1), otherwise=0)
    there = (left < WOLF_WIDTH) & (right < WOLF_WIDTH)
    index = BOTTOM_WALKS.index(stride=d.stride, hidden=hidden)
    return BOTTOM_WALKS.box(index, x, BOTTOM_LINE, valid=there)


def _beside(m: Ram, row: jax.Array) -> jax.Array:
    """True for the balloon or wolf that is drawn in a row."""
    drawn = (m.balloon_row == row) & (row != m.hides) & (row != m.rock_row)
    return drawn & (jnp.cumsum(drawn) == 1)


def _missile_box(
    x: jax.Array,
    width: int,
    row: jax.Array,
    first: jax.Array,
    height: jax.Array,
    on: int,
    off: int,
    late: jax.Array,
    **fields: Any,
) -> Box:
    """A missile; its columns left of the beam show a line later.

    Args:
        x, width, row: its position.
        first, height: its lines in the row.
        on: column of the beam when missiles are switched on and off.
        off: first column without missiles in the row's last line.
        late: whether a balloon in the row delays the beam in the line below it.
        fields: of the box.
    """
    end = first + height
    top = first + when(x + width <= on + when(late & (first == BALLOON_LINES), DELAY), 1)
    usual_bottom = end + when(x < on + when(late & (end == BALLOON_LINES), DELAY), 1)
    bottom = jnp.minimum(usual_bottom, LINES - when(x >= off, 1))
    return box(x, _line(row) + top, width, bottom - top, among(row, ROWS), **fields)


def _shot_box(m: Ram, d: Drawn) -> Box:
    x = wrap(packed_position(m.shot_at) - MISSILE_SHIFT)
    is_bait = m.is_bait
    first = jnp.where(is_bait, m.shot_down + 1, ARROW_LINE)
    late = jnp.any(_beside(m, m.shot_row))
    height = jnp.where(is_bait, BAIT_LINES, 1)
    beam = (SHOT_ON, SHOT_CUT)
    return _missile_box(x, SHOT_WIDTH, m.shot_row, first, height, *beam, late, color=d.player_color)


def _stone_box(m: Ram, d: Drawn) -> Box:
    x = wrap(packed_position(m.stone_at) - MISSILE_SHIFT)
    neighbors = _beside(m, m.stone_row)
    here = jnp.any(neighbors)
    first = m.stone_down + 1
    by_balloon = here & (first < BALLOON_LINES - 1)
    color = jnp.where(by_balloon, only(neighbors, _colors(m, d)), _last_color(m, d))
    height = jnp.full_like(x, STONE_SIZE)
    beam = (STONE_ON, STONE_CUT)
    return _missile_box(x, STONE_SIZE, m.stone_row, first, height, *beam, here, color=color)


def _last_color(m: Ram, d: Drawn) -> jax.Array:
    """Color of the last object drawn above a stone; a stone takes this color."""
    wolf_rows = jnp.append(m.balloon_row, d.climber_row)
    wolf_above = jnp.max(when(wolf_rows <= m.stone_row, wolf_rows))
    rock_above = when(m.rock_row <= m.stone_row, m.rock_row)
    at_top = (d.ascends == 1) & (((m.frame & 1) == 0) | (d.pushers == 0))
    is_rock = jnp.where(
        wolf_above + rock_above > 0, (rock_above > 0) & (rock_above >= wolf_above), at_top
    )
    return jnp.where(is_rock, ROCK, WOLF)


def _rock_box(m: Ram, d: Drawn) -> Box:
    falls = m.rock_row > 0
    y = match(
        (falls, _line(m.rock_row) + ROCK_LINE),
        ((m.rock_off & m.ascends) == 1, GROUND_LINE + 1),
        otherwise=TOP_LINE + ROCK_LINE,
    )
    there = jnp.where(falls, m.rock_row <= LAST_ROW, d.ascends == 1)
    return box(column(m.rock_at) + 1, y, ROCK_WIDTH, ROCK_HEIGHT - when(falls, 1), there)


GAME = Game(
    name="Pooyan",
    rom=ROM,
    ram=Ram,
    decode=decode,
    screen=(220, 160),
    checks=Checks(
        agreement={"lost": 0.64},  # the records of balloons, wolves and missiles are cleared
        rare=("Arrow", "Bait", "Balloon", "Enemy", "Rock", "Stone"),
        known={"PlayerScore": 0.77},  # the round's number is shown before a round
    ),
    categories=(
        Category("Player", PIG, role="player", doc="the pig in the lift"),
        Category("Balloon", BALLOON, count=6, doc="two of each column"),
        Category(
            "Enemy",
            WOLVES_RULE,
            count=17,
            doc="wolves: six in the air, the climber, three that march, one that has landed, six "
            "at the rock",
        ),
        Category("Arrow", ARROW, doc="the pig's"),
        Category("Bait", BAIT, doc="the pig's meat"),
        Category("Stone", STONE, doc="a wolf's"),
        Category("Rock", ROCK_RULE, doc="that wolves push"),
        display("PlayerScore", SCORE.rule(WHITE, step=5), role="score", doc="points"),
        display(
            "Lives",
            LIVES.rule(0, (37, 206, 53, 212), single=2),
            role="lives",
            doc="pigs in reserve",
        ),
    ),
)
