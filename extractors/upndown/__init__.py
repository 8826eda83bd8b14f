"""Up'n Down: a jumping car drives along two roads that cross, past other cars, and collects flags.

Picture: docs/games/UpNDown.png

Screen: a row shows one sprite only (`sprites`). Life shows at most four of the five in reserve.
Roads, trees and explosions are scenery, and the number of the round is not an object.

Slots: the game's own records, three for objects on the roads besides the player. Each holds a car,
a flag, a collectable or nothing.

Files: `ram` has the RAM and the meaning of its values, `road` the tables of the roads. `drawn`
undoes the game's moves since it drew the frame, and `lost` has the frame of a lost life. `sprites`
makes boxes of the result.

RAM: OCAtari and stable-retro (meaning of some bytes), ALE's source (score, lives), and the ROM's
code. Bank 1 sorts the records and prepares the drawing at f6d2-f8e2, and bank 0 draws the road at
f000-f3ff.

Covered: round 1, lost lives, the end of the game, all modes and difficulties; the other rounds only
by the ROM's tables. The first frame of a start shows no cars; the frame of a lost life shows the
old records.

Not exact: a few of these old records; frames on which a car is hit, a flag is collected or a record
is reused, because the new state has overwritten the old one; all rows except the player's on some
frames on which he changes his speed, because the RAM does not keep the joystick; the column of a
car that changes sides in a crossing.

VEM: it misses cars that touch, some parts of cars with few rows, and flags in the road's colour.
"""

import functools
from collections.abc import Iterable

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Area,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    LivesAsIcons,
    NumberDisplay,
    Shape,
    Variants,
    among,
    box,
    display,
    when,
)
from ocjax.extractors.upndown.drawn import as_drawn, life_lost
from ocjax.extractors.upndown.ram import BANK, ROM, Attract, Kind, Pause, Ram
from ocjax.extractors.upndown.sprites import VIEW, is_collectable, object_boxes

FONT = ROM.font(BANK + 0xF01, rows=7, stride=8)

SCORE = NumberDisplay(FONT, right=63, top=6, digits=6)
WAY_POINTS = 10  # for the distance, every 64 frames
START_ROWS = ROM.bytes(BANK + 0xA84, 3)  # `y` of the other cars
FASTEST = 3  # most columns that the player moves in a frame

BLACK = 0
GRAY = 10
CAR_COLORS = (56, 72, 200, 168, 104, 120, 136, 152)
FLAG_COLORS = (118, 102, 86, 70, 54, 38, 134)  # except one colour that the road has, too
HUD_LEFTS = (91, 19, 107, 127, 71, 55, 35, 143)  # of the flags to collect, by bit of `collected`
HUD_COLORS = (116, 20, 100, 84, 68, 52, 36, 132)  # of the flags to collect
HUD_TOP = 15
HUD_SIZE = (5, 11)
ICON_COLOR = 54  # of the lives
MOST_ICONS = 4
ICON_LEFTS = range(16, 16 + 8 * MOST_ICONS, 8)
ICON_TOP = 196
ICON_SIZE = (4, 8)


def decode(m: Ram) -> dict[str, Box]:
    d = as_drawn(m)
    objects = object_boxes(m, d).where(~_starts(m))
    others = objects[1:]
    kind = d.kind[1:]
    is_flag = among(kind & ~Kind.GONE, range(Kind.FLAG, Kind.PLAYER))
    is_left = (m.collected >> np.arange(8) & 1) == 0
    lives = m.lives + when(life_lost(m), 1)
    return {
        "Player": objects[0].where(m.kind == Kind.PLAYER),
        "Truck": others.where(kind < Kind.FLAG),
        "Flag": others.where(is_flag),
        "Collectable": others.where(is_collectable(kind)),
        "HUD_Flag": box(np.array(HUD_LEFTS), HUD_TOP, *HUD_SIZE, is_left),
        "Score": _score_box(m),
        "Life": box(np.array(ICON_LEFTS), ICON_TOP, *ICON_SIZE, lives > np.arange(MOST_ICONS)),
    }


def _score_box(m: Ram) -> Box:
    """The score without points for the distance that are not yet on the screen."""
    is_new = ((m.counter & 63) == 0) & (m.pause == Pause.RUNNING)
    shown = jnp.maximum(m.score - when(is_new, WAY_POINTS), 0)
    is_text = among(m.pause, Pause.STARTING) & (m.attract == Attract.IDLE) & (m.score == 0)
    return SCORE.box(shown, valid=~is_text, value=m.score)


def _starts(m: Ram) -> jax.Array:
    """True if a new start is not on the screen yet: the player's column is still the old one."""
    ready = jnp.all(jnp.abs(m.y - START_ROWS) <= 1)
    return ready & (jnp.abs(m.player_x - m.next_x) > FASTEST)


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
PLAYER_RULE = in_view((BLACK, GRAY), shapes=PLAYER_SHAPES)
CAR_SHAPES = (  # higher shapes have more pixels
    Shape(w=(14, 16), h=(14, 16), pixels=(140, 256)),
    # The black pixels of the player have this width, and are fewer.
    Shape(w=16, h=(12, 13), pixels=(120, 208)),
    Shape(w=16, h=9, pixels=(90, 144)),
    Shape(w=16, h=(5, 6), pixels=(55, 96)),
    Shape(w=16, h=4, pixels=(45, 64)),
    Shape(w=(12, 14), h=(12, 13), pixels=(106, 182)),
    Shape(w=(12, 16), h=(10, 11), pixels=(106, 176)),
    Shape(w=(10, 14), h=9, pixels=(70, 126)),
    Shape(w=(10, 16), h=(7, 8), pixels=(70, 128)),
    Shape(w=(10, 14), h=(4, 6), pixels=(36, 84)),
    Shape(w=10, h=2, pixels=20),
    Shape(w=12, h=(2, 3), pixels=(24, 36)),
)
CARS = in_view((BLACK, *CAR_COLORS), shapes=CAR_SHAPES)
small = functools.partial(in_view, (BLACK, *FLAG_COLORS))
FLAG_SHAPES = (
    Shape(w=(4, 7), h=(7, 16), pixels=(14, 52)),
    Shape(w=2, h=(5, 6), pixels=(6, 7)),  # the pole and the cloth's corner of a cut flag
)
FLAGS = small(shapes=FLAG_SHAPES)
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
    checks=Checks(
        lives=(LivesAsIcons(("Life",), hidden=1),),
        rare=("Truck",),  # beside the player, whose black pixels resemble a truck
    ),
    variants=Variants(
        starts={
            "level=2": "other roads",
        },
    ),
    categories=(
        Category("Player", PLAYER_RULE, role="player", doc="its car"),
        Category("Truck", CARS, count=3, doc="the other cars, by record"),
        Category("Flag", FLAGS, count=3, doc="on the road, by record"),
        Category("Collectable", COLLECTABLES, count=3, doc="by record"),
        display("HUD_Flag", HUD, count=8, attributes=(), doc="the flags still to collect"),
        display("Score", SCORE.rule(84, required=True), role="score", doc="points"),
        display(
            "Life", ICONS, count=MOST_ICONS, attributes=(), role="lives", doc="lives in reserve"
        ),
    ),
)
