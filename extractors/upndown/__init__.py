"""Up'n Down: a jumping car drives along two roads that cross, past other cars, and collects flags.

Screen: a row shows one sprite only: where two of them are near each other, the upper one loses its
last rows on one frame and the lower one its first rows on the next; where they are closer still,
they take turns. Life shows at most four of the five in reserve. Roads, trees and explosions are
scenery, and the number of the round is not an object.

Slots: the game's own records, three for what is on the roads besides the player, each of which
holds a car, a flag, a collectable or nothing.

RAM: OCAtari and stable-retro (what some bytes are), ALE's source (score, lives), and the ROM's
code. Bank 1 sorts the records and prepares the drawing at f6d2-f8e2, bank 0 draws the road at
f000-f3ff, and bank 1 moves all at f173-f5ef, after the frame was drawn but before the vertical
sync ends. That `_as_drawn` takes back: cars take a step where their speed reaches a limit that the
frame counter makes (f3a9), their columns follow from the road's table (f454), and the road scrolls
by the player's last step but one (f275).

Covered: round 1, lost lives, the end of the game, all modes and difficulties; the other rounds by
the ROM's tables alone. The first frame of a start shows none of the cars; that of a lost life, the
old records: `lost.py`.

Not exact: a few of the latter; frames on which a car is hit, a flag is collected or a record begins
anew, because the new state has overwritten the old one; all rows but the player's on some frames on
which he speeds up or slows down, because the joystick is not kept; the column of a car that
changes sides in a crossing.

VEM: it misses cars that touch, some parts of cars of a few rows, and flags in the road's colour.
"""

import functools
from collections.abc import Iterable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Area, Box, box
from ocjax.console.ops import among, match, when
from ocjax.console.registers import mirrored
from ocjax.console.rom import Pictures
from ocjax.extraction.game import Category, Game, display
from ocjax.extractors.upndown.lost import (
    BANK,
    GROUND,
    MIDDLE,
    ROADS_APART,
    ROM,
    SAME_WAY,
    Kind,
    column,
    drawn_records,
)
from ocjax.extractors.upndown.ram import Attract, Jump, Pause, Ram
from ocjax.vision.displays import NumberDisplay
from ocjax.vision.rules import Blobs, Bounds
from ocjax.vision.shapes import Shape

FONT = ROM.font(BANK + 0xF01, rows=7, stride=8)

SCORE = NumberDisplay(FONT, right=63, top=6, digits=6)

VIEW = (8, 27, 160, 194)
CLEARED_FROM = 142  # from this column on, the last row of a picture is cleared before it is drawn
LAST_ROW = 158  # beyond it a record begins anew
START_ROWS = ROM.bytes(BANK + 0xA84, 3)  # `y` of the other cars
MOST = 3  # columns that the player moves in a frame at most
PICTURE_ROWS = 16
NEAR_ROWS = 4  # rows between sprites
SPACE = 24  # free rows that a sprite needs that is put out of the way
BOTTOM = 152  # row where the free rows below the last sprite end
NOWHERE = 255  # rows to a sprite where there is none
BACKWARD = 128  # least speed that is not forward

BLACK = 0
GREY = 10
CAR_COLORS = (56, 72, 200, 168, 104, 120, 136, 152)
FLAG_COLORS = (118, 102, 86, 70, 54, 38, 134)  # but one, which the road has, too
HUD_COLORS = (116, 20, 100, 84, 68, 52, 36, 132)
HUD_LEFTS = (91, 19, 107, 127, 71, 55, 35, 143)  # by bit of `collected`
HUD_TOP = 15
HUD_SIZE = (5, 11)
ICON_COLOR = 54
ICON_LEFTS = range(16, 48, 8)
ICON_TOP = 196
ICON_SIZE = (4, 8)


class Look:  # in `PICTURE_EXTENTS`; those before are the other cars'
    PLAYER = 3  # that of a car
    FLAG = 4
    COLLECTABLE = 5  # the first of four


def _picture(kind: int) -> np.ndarray:
    """Rows of both players of a picture from its last row up to its first."""
    low, page = (int(ROM.data[BANK + table + kind]) for table in (0xA5F, 0xA8F))
    first = ((page & 15) << 8) + low
    return ROM.bytes(first, PICTURE_ROWS + 1) | ROM.bytes(first | 0x100, PICTURE_ROWS + 1)


def _extents() -> Pictures:
    """Extents of the pictures where only the rows from `low` + 1 to `high` show, last row first."""
    at = np.arange(PICTURE_ROWS + 1)
    kinds = (*range(4), Kind.FLAG, *range(Kind.COLLECTABLE, Kind.COLLECTABLE + 4))
    shown = [
        np.where((at > low) & (at <= high), _picture(kind), 0)[:0:-1]
        for kind in kinds
        for high in range(PICTURE_ROWS + 1)
        for low in range(PICTURE_ROWS + 1)
    ]
    return Pictures.of(shown, look=len(kinds), high=PICTURE_ROWS + 1, low=PICTURE_ROWS + 1)


PICTURE_EXTENTS = _extents()


class Drawn(NamedTuple):
    """The sprites as they were drawn, the player's first."""

    kind: jax.Array
    x: jax.Array
    y: jax.Array
    fine: jax.Array  # rows by which the road had come down


def decode(m: Ram) -> dict[str, Box]:
    d = _as_drawn(m)
    objects = _object_boxes(m, d).where(~_starts(m))
    others, kind = objects[1:], d.kind[1:]
    is_left = (m.collected >> np.arange(8) & 1) == 0
    lives = m.lives + when(_life_lost(m), 1)
    return {
        "Player": objects[0].where(m.kind == Kind.PLAYER),
        "Truck": others.where(kind < Kind.FLAG),
        "Flag": others.where(among(kind & ~Kind.GONE, range(Kind.FLAG, Kind.PLAYER))),
        "Collectable": others.where(_is_collectable(kind)),
        "HUD_Flag": box(np.array(HUD_LEFTS), HUD_TOP, *HUD_SIZE, is_left),
        "Score": _score_box(m),
        "Life": box(np.array(ICON_LEFTS), ICON_TOP, *ICON_SIZE, lives > np.arange(4)),
    }


def _is_collectable(kind: jax.Array) -> jax.Array:
    return among(kind, range(Kind.COLLECTABLE, Kind.COLLECTABLE + 8))


def _score_box(m: Ram) -> Box:
    """The score, of which points for the way are not yet on the screen."""
    ticks = ((m.counter & 63) == 0) & (m.pause == Pause.RUNNING)
    text = among(m.pause, Pause.STARTING) & (m.attract == Attract.IDLE) & (m.score == 0)
    return SCORE.box(jnp.maximum(m.score - when(ticks, 10), 0), valid=~text, value=m.score)


def _as_drawn(m: Ram) -> Drawn:
    limit = mirrored((m.counter - 1) & 255) & 255  # the bits of the count in reverse order
    scroll = when(m.pause == Pause.RUNNING, _steps(m.speed, limit))
    x, y = _before_move(m, scroll)
    lost = _life_lost(m)
    kind, rows, fine = drawn_records(m)
    return Drawn(
        kind=jnp.concatenate([m.kind[None], jnp.where(lost, kind, m.kinds)]),
        x=x,
        y=jnp.where(lost, jnp.concatenate([y[:1], rows]), y),
        fine=jnp.where(lost, fine, m.fine - scroll),
    )


def _life_lost(m: Ram) -> jax.Array:
    return (m.pause == Pause.DYING) & among(m.attract, Attract.LIFE_TAKEN)


def _starts(m: Ram) -> jax.Array:
    """Whether a new start is not on the screen yet: the player's column is still the last one's."""
    ready = jnp.all(jnp.abs(m.y - START_ROWS) <= 1)
    return ready & (jnp.abs(m.player_x - m.next_x) > MOST)


def _steps(speed: jax.Array, limit: jax.Array) -> jax.Array:
    """By how many rows a car moves on a frame: -1, 0 or 1."""
    back = speed >= BACKWARD
    amount = jnp.where(back, 2 * (speed & 127), 255 - 2 * (speed & 127))
    return when((amount > 0) & (amount >= limit), jnp.where(back, -1, 1))


def _before_move(m: Ram, scroll: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Columns and rows before the last move, the player's first."""
    step = when(m.pause == Pause.RUNNING, _steps(m.speeds, m.limit))
    x = jnp.where(step == 0, m.x, _drawn_column(m, step))
    y = m.y - step + scroll
    return jnp.concatenate([m.player_x[None], x]), jnp.concatenate([_player_y(m)[None], y])


def _drawn_column(m: Ram, step: jax.Array) -> jax.Array:
    """The cars' columns on the road before their last step."""
    there = column(m, m.y + 4 * m.coarse + m.fine - step)
    right = jnp.where(m.x >= MIDDLE, MIDDLE + there, MIDDLE - there)
    double = there - SAME_WAY + when(m.x >= MIDDLE + 4, ROADS_APART)
    return jnp.where(there >= SAME_WAY, double, right)


def _height(jump: jax.Array) -> jax.Array:
    """Rows of the player below the road, less than 0 in a jump."""
    up = jnp.where(jump >= Jump.RISES, jump - 256, Jump.LOW - 1 - jump)
    return when(jump >= Jump.LOW, up + (up >> 1))


def _player_y(m: Ram) -> jax.Array:
    landing = (m.jump == Jump.LANDED) & (m.player_y == GROUND)
    jump = jnp.where((m.jump == Jump.LANDED) & ~landing, Jump.SINKS - 2, m.jump)
    quick = among(jump, range(Jump.LOW, Jump.SINKS)) & (m.flight == 0)
    before = match(
        (landing, Jump.LANDS),
        (quick, jnp.minimum(jump + 3, Jump.SINKS)),
        otherwise=jump + 1,
    )
    in_air = among(jump, range(Jump.LOW, Jump.TAKEOFF)) | landing
    y = GROUND + when(in_air, _height(before))
    return jnp.where(m.pause == Pause.RUNNING, y, m.player_y)


def _ranks(y: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Rows by which each sprite is below each other one, and the sprites' order from the top."""
    apart = y[:, None] - y[None, :]
    tie = np.arange(4)[:, None] > np.arange(4)[None, :]
    return apart, jnp.sum(when((apart > 0) | ((apart == 0) & tie), 1), axis=1)


def _least(condition: jax.Array, values: jax.Array) -> jax.Array:
    return jnp.min(jnp.where(condition, values, NOWHERE), axis=-1)


def _sprites(m: Ram, y: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Which sprites take a turn in not being drawn, and the rows with those out of the way."""
    apart, rank = _ranks(y)
    other = ~np.eye(4, dtype=bool)
    near = jnp.any((jnp.abs(apart) < NEAR_ROWS) & other, axis=1)
    skipped = near & (((rank + m.counter) & 1) == 0)
    below = jnp.minimum(_least((apart < 0) & other, -apart), BOTTOM - y)
    place = jnp.where(jnp.min(y) >= SPACE, 2, _least(below >= SPACE, y)) + NEAR_ROWS
    return skipped, jnp.where(skipped, place, y)


def _rows_shown(m: Ram, d: Drawn) -> tuple[jax.Array, jax.Array]:
    """The rows of the pictures that show, `low` + 1 to `high`, the last row first."""
    skipped, y = _sprites(m, d.y)
    apart, rank = _ranks(y)
    above = _least(apart >= NEAR_ROWS, apart)
    below = _least(apart <= -NEAR_ROWS, -apart)
    drawn = ~skipped & (d.kind != Kind.HIDDEN)
    drawn_below = jnp.any((apart == -below[:, None]) & drawn[None, :], axis=1)
    late = when(((y - above + d.fine + 1) & 2) == 0, 1)
    room = jnp.where(above == NOWHERE, y + 1 - ((d.fine & 2) >> 1), above - 2 - late)
    turn = ((m.counter - 1 + rank) & 1) == 0  # to lose its last rows, else its first
    lost = jnp.minimum(PICTURE_ROWS + 3 - below, room - 2)
    low = when(turn & (rank < 3) & drawn_below, lost)
    cut = turn | (rank == 0) | ((rank == 3) & ((m.counter & 1) == 0))
    high = jnp.where(cut, room, PICTURE_ROWS)
    low, high = (jnp.clip(row, 0, PICTURE_ROWS) for row in (low, high))
    return jnp.where(skipped, 0, low), jnp.where(skipped, PICTURE_ROWS, high)


def _object_boxes(m: Ram, d: Drawn) -> Box:
    """The boxes of all four sprites, with the rows that the others leave them."""
    low, high = _rows_shown(m, d)
    low = jnp.where(d.x >= CLEARED_FROM, jnp.maximum(low, 1), low)
    look = match(
        (d.kind == Kind.PLAYER, Look.PLAYER),
        (_is_collectable(d.kind), Look.COLLECTABLE + (d.kind & 3)),
        (d.kind < Kind.FLAG, d.kind & 3),
        otherwise=Look.FLAG,
    )
    index = PICTURE_EXTENTS.index(look=look, high=high, low=low)
    left, top, w, h = PICTURE_EXTENTS.extent(index, mirrored=m.mirrored == 1)
    wide = look < Look.FLAG
    x, width = d.x + jnp.where(wide, 2 * left, left - 1), jnp.where(wide, 2 * w, w)
    return box(x, d.y + PICTURE_ROWS + top, width, h, (d.y <= LAST_ROW) & (h > 0)).clip(*VIEW)


in_view = functools.partial(Blobs, region=VIEW)
PLAYER_SHAPES = (  # of parts of the car that no other car has
    Shape(w=16, h=(14, 16), pixels=(165, 256)),
    Shape(w=16, h=13, pixels=(150, 180)),
    Shape(w=16, h=12, pixels=(132, 160)),
    Shape(w=16, h=(10, 11), pixels=(130, 150)),
    Shape(w=16, h=10, pixels=(104, 109)),
    Shape(w=16, h=9, pixels=(91, 93)),
    Shape(w=16, h=(8, 9), pixels=(100, 126)),
    Shape(w=16, h=(5, 7), pixels=(70, 112)),
    Shape(w=14, h=6, pixels=(58, 64)),
    Shape(w=14, h=5, pixels=(52, 60)),
    Shape(w=14, h=4, pixels=(38, 40)),
)
PLAYER_RULE = in_view((BLACK, GREY), shapes=PLAYER_SHAPES)
CAR_SHAPES = (  # the higher, the more pixels
    Shape(w=(14, 16), h=(14, 16), pixels=(140, 256)),
    Shape(w=(12, 16), h=(10, 13), pixels=(106, 208)),
    Shape(w=(10, 16), h=(7, 9), pixels=(70, 144)),
    Shape(w=(10, 16), h=(4, 6), pixels=(36, 96)),
)
CARS = in_view((BLACK, *CAR_COLORS), shapes=CAR_SHAPES)
small = functools.partial(in_view, (BLACK, *FLAG_COLORS))
FLAGS = small(shapes=Shape(w=(4, 7), h=(7, 16), pixels=(14, 52)))
COLLECTABLES = small(shapes=Shape(w=(6, 8), h=(14, 16), pixels=(53, 90)))


def _cells(lefts: Iterable[int], top: int, size: tuple[int, int]) -> tuple[Area, ...]:
    return tuple((x, top, x + size[0], top + size[1]) for x in lefts)


HUD = Bounds(tuple((c,) for c in HUD_COLORS), _cells(HUD_LEFTS, HUD_TOP, HUD_SIZE))
ICONS = Bounds(ICON_COLOR, _cells(ICON_LEFTS, ICON_TOP, ICON_SIZE))

GAME = Game(
    name="UpNDown",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", PLAYER_RULE, doc="its car"),
        Category("Truck", CARS, count=3, doc="the other cars, by record"),
        Category("Flag", FLAGS, count=3, doc="on the road, by record"),
        Category("Collectable", COLLECTABLES, count=3, doc="by record"),
        display("HUD_Flag", HUD, count=8, attributes=(), doc="the flags still to collect"),
        display("Score", SCORE.rule(84, required=True), doc="points"),
        display("Life", ICONS, count=4, attributes=(), doc="lives in reserve"),
    ),
)
