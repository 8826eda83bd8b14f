"""Asterix: the hero runs about on a stage of eight lanes, and things pass through the lanes.

Picture: docs/games/Asterix.png

Screen: each lane has one thing at a time: a lyre (an enemy), something to eat, or the points for
it. In later stages Obelix replaces Asterix, after a picture of him has filled the screen. The food
is helmets, shields, lamps, apples, fish, meat and mugs. The last life has no icon, so Lives is not
valid then. The stage is scenery.

Slots: Enemy, Consumable and Reward have the lanes from the top.

RAM: ALE's source (score, lives, death), OCAtari 2.2 (positions), and the ROM's display program. For
each lane the program moves a pointer through the picture, one step per row. After the frame the
pointers therefore identify the drawn pictures. The sizes of the pictures are read from the ROM.

Covered: all stages and things, both heroes, deaths (the hero is twice as wide), at most eight lives
(three icons), the picture of Obelix, the end of the game and its first two frames: one is empty,
the other lacks hero and icons. The game has one mode and one difficulty.

Not exact: nothing known.

VEM: Reward and Consumable are in raster order. Lamps are a row too small, because their last row
has the hero's colour.
"""

import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Digits,
    Game,
    Gauge,
    Pictures,
    RamMap,
    Rom,
    Shape,
    among,
    bcd,
    box,
    byte,
    display,
    div,
    pick,
    score_box,
)

ROM = Rom("asterix", "89a68746eff7f266bbf08de2483abe55")
FONT = ROM.font(0xB01, rows=7, stride=8)
PICTURE_TABLE = 0xC3D  # offset of the pictures in the lanes
COLOR_TABLE = 0xD82  # offset of the colours of their rows

ROWS = 11  # of every picture
PITCH = 12  # bytes per picture; a zero byte ends each
# Kinds of pictures in the lanes, by their order in the ROM.
REWARDS = range(1, 7)
FOODS = range(9, 17)
LYRES = range(17, 19)
OBELIX = 36  # least `hero` of Obelix
STAGE = 0  # `screen`
FIRST_FRAME = 1  # `frame`
ENTRANCES = np.array((4, 145) * 4)  # `lane_x` of a game's first things
WIDE_DEATHS = range(79, 126)  # `death` while the hero is drawn twice as wide

YELLOW = 24
PINK = 74
RED = 68
REWARD = 8
BORDERS = (88, 120, 216, 56, 40, 152, 136, 72, 50, 104)  # around the digits of rewards
EDIBLE = (68, 66, 12, 14, 214, 88)  # except the lamps' rows in the hero's colour
HELMET = (76, 8, 10, 12, 14)
COLOR_ROW = 5  # of a picture of food, with the colour of its largest part
FIRST_COLOR = COLOR_TABLE + PITCH * FOODS.start + COLOR_ROW
FOOD_COLORS = (ROM.bytes(FIRST_COLOR, len(FOODS), PITCH) & 0xFE).tolist()
TOPS = range(26, 150, 16)  # of the lanes
STAGE_AREA = (0, 26, 160, 149)
FLOORS = tuple((0, y + ROWS, 160, y + 16) for y in TOPS)
DIGIT_LEFTS = range(55, 103, 8)
SCORE_TOP = 184
SCORE_RIGHT = 103
# Width, distance and largest number of the lives' icons.
ICON = 8
ICON_PITCH = 16
MOST_ICONS = 3


def _lane_pictures(kinds: range) -> Pictures:
    """Tight extents of some kinds of pictures in the lanes, without their black rows."""
    offsets = range(PITCH * kinds.start, PITCH * kinds.stop, PITCH)
    dots = ROM.rows([PICTURE_TABLE + o for o in offsets], ROWS)
    colors = ROM.rows([COLOR_TABLE + o for o in offsets], ROWS)
    return Pictures.of(np.where(colors == 0, 0, dots))


class Ram(RamMap):
    screen = byte(6)  # the stage, or the picture of Obelix
    frame = byte(7)  # 1 to 128
    # Pointers into pictures: multiples of 12 for a drawn picture, 11 more for none.
    icon = byte(9)  # of a life; from the same pictures as the hero's
    hero = byte(10)  # 0 and 12: Asterix; 36 and 48: Obelix
    picture = byte(*range(18, 10, -1))  # of the lanes, top lane first; 11: empty
    y = byte(40)  # of the hero, 151 - y
    x = byte(41)  # of the hero
    lane_x = byte(*range(42, 50))
    death = byte(71)  # frames left, 126 to 0
    lives = byte(83)
    score = bcd((94, 95, 96))


def decode(m: Ram) -> dict[str, Box]:
    drawn = _is_drawn(m)
    hero_drawn = drawn & ~_begins(m)
    return {
        "Player": _hero_box(m).where(hero_drawn),
        "Enemy": _things(m, LYRES).where(drawn),
        "Consumable": _eatables(m).where(drawn),
        "Reward": _things(m, REWARDS).where(drawn),
        "Score": _shown_score(m).where(drawn),
        "Lives": _lives_box(m).where(hero_drawn),
    }


def _things(m: Ram, kinds: range, **fields: Any) -> Box:
    """The things of some kinds, by lane."""
    kind = _kind_by_lane(m)
    there = among(kind, kinds)
    index = kind - kinds.start
    return _lane_pictures(kinds).box(index, m.lane_x, np.array(TOPS), valid=there, **fields)


def _kind_by_lane(m: Ram) -> jax.Array:
    """Kinds of the things, by lane; a pointer into a picture counts as that picture."""
    return div(m.picture, PITCH)


def _eatables(m: Ram) -> Box:
    """What to eat, by lane."""
    return _things(m, FOODS, color=pick(_kind_by_lane(m) - FOODS.start, FOOD_COLORS))


def _is_drawn(m: Ram) -> jax.Array:
    """True if stage and hero are on the screen; the pointers of the empty first frame are 0."""
    return (m.screen == STAGE) & (m.picture[0] != 0) & (m.hero & 3 == 0)


def _begins(m: Ram) -> jax.Array:
    """True on the first frame with the stage, which still lacks hero and icons."""
    return (m.frame == FIRST_FRAME) & jnp.all(m.lane_x == ENTRANCES)


def _margin_of(picture: jax.Array) -> jax.Array:
    """Empty columns on both sides of a hero's picture."""
    return jnp.where(picture >= OBELIX, 1, 0)


def _hero_box(m: Ram) -> Box:
    wide = among(m.death, WIDE_DEATHS)
    margin = _margin_of(m.hero)
    left = jnp.where(wide, 2 * margin + 1, margin)  # the chip draws wide players a pixel later
    width = 8 - 2 * margin
    return box(m.x + left, 151 - m.y, jnp.where(wide, 2 * width, width), ROWS)


def _shown_score(m: Ram) -> Box:
    return score_box(FONT, m.score, right=SCORE_RIGHT, top=SCORE_TOP, digits=6, value=m.score)


def _lives_box(m: Ram) -> Box:
    """The hero's icons; the life in play has none."""
    icons = jnp.clip(m.lives - 1, 0, MOST_ICONS)
    margin = _margin_of(m.icon)
    width = ICON_PITCH * (icons - 1) + ICON - 2 * margin
    return box(60 + margin, 169, width, ROWS, icons > 0, value=m.lives)


thing = functools.partial(Category, count=8)

HERO = Blobs(YELLOW, STAGE_AREA, Shape(w=(5, 16), h=(9, ROWS)))
LYRE = Bounds(PINK, tuple((0, y, 160, y + ROWS) for y in TOPS), min_size=(3, 9))
sprites = functools.partial(Blobs, gap=(1, 1), ignore=FLOORS)
WHOLE_HELMET = sprites(HELMET, STAGE_AREA, shapes=Shape(w=(6, 7), h=ROWS))
FOOD = sprites(EDIBLE, STAGE_AREA, shapes=Shape(w=(4, 8), h=(5, ROWS)), also=(WHOLE_HELMET,))
POINTS = sprites((REWARD, *BORDERS), STAGE_AREA, shapes=Shape(w=(4, 8), h=(9, ROWS)))
SCORE = Bounds(YELLOW, (54, 184, 104, 191), value=Digits(FONT, DIGIT_LEFTS, SCORE_TOP))
LIVES = Bounds(YELLOW, (60, 169, 100, 180), value=Gauge(ICON_PITCH, start=6, base=2))

GAME = Game(
    name="Asterix",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(rare=("Consumable",)),  # helmets
    categories=(
        Category("Player", HERO, role="player", doc="Asterix, later Obelix"),
        thing("Enemy", LYRE, colors=(PINK, RED), doc="lyres, by lane"),
        thing("Consumable", FOOD, color_row=COLOR_ROW, doc="what to eat, by lane"),
        thing("Reward", POINTS, rgb=(170, 170, 170), doc="points given, by lane"),
        display("Score", SCORE, role="score", doc="points"),
        display("Lives", LIVES, role="lives", doc="icons; value: lives"),
    ),
)
