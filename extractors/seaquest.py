"""Seaquest: a submarine, divers to be rescued, sharks and enemy submarines in four lanes, oxygen.

Picture: docs/games/Seaquest.png

Screen: the eight columns at the left edge are blank. The explosion of the submarine, the waves, the
ground and the maker's name are scenery. Six divers, and oxygen that is low, blink.
OxygenBarDepleted is the background right of the bar.

Slots: a lane has three positions for sharks or enemy submarines, which follow each other: slot lane
* 3 + position, the lowest lane first. It has one diver, or one torpedo of its submarines: slot
lane. CollectedDiver has a slot for each diver on board.

RAM: ALE's source (score, lives), OCAtari 2.2 and D. Debro's disassembly (meaning of the bytes), and
the ROM's code. Everything moves at F7A6-FB4F, before the frame is drawn at F080-F5AD, so the RAM
matches the screen. Only the submarine's propeller has moved on, every fourth frame. The ball draws
a diver or a torpedo; the program moves and resizes it on each row.

Covered: levels up to 20 and all colours of sharks, the patrol at the surface, divers, surfacing
with some and with six of them, all ways to die, both difficulties, the end of the game. The value
of Lives is ALE's, one more than the icons; without icons it is not valid.

Not exact: nothing known.

VEM: it misses a torpedo with less than three columns outside the submarine. If only a few pixels of
a diver are visible at an edge of the screen, it misses the diver or takes it for a torpedo.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    EDGE_CUTS,
    WEST,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    Gauge,
    IconRow,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Saver,
    Shape,
    ShortRuns,
    Variants,
    bcd,
    bits,
    box,
    byte,
    display,
    match,
    pick,
    when,
)

ROM = Rom("seaquest", "240bfbac5163af4df5ae713985386f92")
FONT = ROM.font(0xE00, rows=8)

YELLOW = 26
GOLD = 24
RED = 50
WHITE = 12
BLACK = 0
GRAY = 8
SEA_BLUE = 134
NAVY = 130
FLASH = 14
LANES = 4
LANE_TOPS = 137 - 24 * np.arange(LANES)  # the lowest lane first
LANE_ROWS = 15
LANE_OF = np.arange(12) // 3  # of the slots of sharks and enemy submarines
PLACE_OF = np.arange(12) % 3

VIEW = (8, 0, 160, 210)
SEA = (8, 57, 160, 162)
LANE_AREAS = tuple((8, y, 160, y + LANE_ROWS) for y in LANE_TOPS.tolist())
FOOT = (53, 57)  # rows at the foot of the waves
BOARD_LEFTS = 58 + 8 * np.arange(6)  # of the divers on board
BAR = (49, 170, 112, 175)
FULL_BAR = 63  # pixels
FULL_TANK = 64  # `oxygen`

SCORE = NumberDisplay(FONT, right=106, top=9, digits=6)
LIVES = IconRow(58, 22, width=7, height=8, pitch=8)

SHARK_COLORS = tuple(int(c) & 0xFE for c in ROM.bytes(0xF0F, 8))  # by the level's lowest bits
FLASHES = 15  # least `dying` with an intact submarine
SURFACE = 13  # `y` at the surface


class Look:  # of `Ram.look`
    SUBMARINE = 4  # at least; sharks have less


def _rows(pointers: int, index: int, height: int) -> np.ndarray:
    """Rows of a picture from the top; a table of pointers has its address."""
    return ROM.rows(0xD00 + int(ROM.bytes(pointers + index, 1)[0]), height)


def _ball_rows(look: int) -> np.ndarray:
    """Rows drawn by the ball: on each row it moves, and is off or 1 to 8 pixels wide."""
    out = []
    moves = _rows(0xF7E, look, LANE_ROWS)
    lefts = 2 - np.cumsum((moves >> 4 ^ 8) - 8)
    shapes = _rows(0xF92, look, LANE_ROWS)
    for left, shape in zip(lefts.tolist(), shapes.tolist(), strict=True):
        width = 1 << (shape >> 4 & 3)
        dots = (1 << width) - 1
        out.append(dots << 8 - left - width if shape & 2 and 0 <= left <= 8 - width else 0)
    return np.array(out)


SUBS = ROM.pictures([0xD00 + int(low) for low in ROM.bytes(0xCFB, 3)], 12)
# Parts of the pictures inside the screen, by columns beyond its edges and look.
PATROL_LOOKS = 3
PATROLS = Pictures.of(
    [_rows(0xCFB, look, 12)[:7] & cut for cut in EDGE_CUTS for look in range(PATROL_LOOKS)]
)
ENEMY_LOOKS = 8
ENEMY_PICTURES = Pictures.of(
    [_rows(0xFA2, look, LANE_ROWS) & cut for cut in EDGE_CUTS for look in range(ENEMY_LOOKS)]
)
BALL_LOOKS = 16
BALL_PICTURES = Pictures.of(
    [_ball_rows(look) & cut for cut in EDGE_CUTS for look in range(BALL_LOOKS)]
)

SAVER_MASK = 0xF7  # the screen saver drops a bit of colours


class Ram(RamMap):
    clock = byte(1)
    saver_key = byte(5)  # XORed with colours
    saver_mask = byte(6)  # mask of colours: 0xFF in play
    enemy_x = byte(30, 31, 32, 33)  # of the first position, modulo 256; lowest lane first
    shown = bits(40, 41, 42, 43, count=3)  # taken and visible positions, last one first
    score = bcd((56, 57, 58))
    icons = byte(59)  # lives, without the current one
    level_color = bits(61, count=3)
    divers = byte(62)  # on board
    x = byte(70)
    ball_x = byte(71, 72, 73, 74)  # of the lanes' divers and torpedoes; 0: none
    looks_left = bits(86, first=3)
    look = bits(89, 90, 91, 92, count=3)  # picture of a lane's enemies
    ball_look = bits(89, 90, 91, 92, count=4)  # picture of its diver or torpedo
    leftward = bits(89, 90, 91, 92, first=3)
    bob = byte(93)  # rows that sharks are lower
    propeller = byte(96)  # picture of the submarine, already the next one
    y = byte(97)  # y - 33
    oxygen = byte(102)
    torpedo_x = byte(103)
    dying = byte(105)  # steps until the next life
    patrol_x = byte(118)


def decode(m: Ram) -> dict[str, Box]:
    enemies = _enemy_boxes(m)
    balls = _ball_boxes(m)
    submarines = m.look >= Look.SUBMARINE
    return {
        "Player": _player(m),
        "PlayerMissile": _torpedo(m),
        "Shark": enemies.where(~jnp.repeat(submarines, 3)),
        "Submarine": enemies.where(jnp.repeat(submarines, 3)),
        "Diver": balls.where(~submarines),
        "EnemyMissile": balls.where(submarines),
        "SurfaceSubmarine": _patrol(m),
        "CollectedDiver": box(BOARD_LEFTS, 178, 8, 9, np.arange(6) < m.divers),
        "OxygenBar": _oxygen(m),
        "OxygenBarDepleted": _used_oxygen(m),
        "Lives": LIVES.box(m.icons, value=m.icons + 1),
        "PlayerScore": SCORE.box(m.score),
    }


def _compass(leftward: jax.Array) -> jax.Array:
    """The compass point; 1 is left."""
    return jnp.where(leftward == 1, WEST, EAST)


def _cut_off(x: jax.Array) -> jax.Array:
    """Columns of a picture beyond the right edge, or, if negative, beyond the left one."""
    return jnp.clip(x - 152, 0, 8) - jnp.clip(8 - x, 0, 8)


def _propeller(m: Ram) -> jax.Array:
    """The submarine's picture before it changed; pictures run from 2 down to 0 and back to 2."""
    return jnp.where((m.clock & 3) == 0, pick(m.propeller, (1, 2, 0)), m.propeller)


def _player(m: Ram) -> Box:
    """The submarine; the four rows at the foot of the waves hide it."""
    whole = SUBS.box(
        _propeller(m),
        m.x,
        m.y + 33,
        mirrored=m.looks_left == 1,
        zoom=2,
        valid=((m.dying == 0) | (m.dying >= FLASHES)) & (m.y >= SURFACE),
        orientation=_compass(m.looks_left),
    )
    color = match((m.dying == 0, GOLD), ((m.dying & 1) == 1, FLASH), otherwise=BLACK)
    top = whole.y
    end = whole.y + whole.h
    hidden_above = when(top >= FOOT[0], jnp.maximum(FOOT[1] - top, 0))
    hidden_below = when(end <= FOOT[1], jnp.maximum(end - FOOT[0], 0))
    return replace(whole.trimmed(top=hidden_above, bottom=hidden_below), color=color)


def _torpedo(m: Ram) -> Box:
    """The submarine's torpedo, without its part behind the submarine."""
    left = m.torpedo_x
    right = m.torpedo_x + 8
    hull_x = m.x + 16
    inside = (left < hull_x) & (right > m.x)
    first = jnp.where(inside & (left >= m.x), hull_x, left)
    last = jnp.where(inside & (left < m.x), m.x, right)
    there = (m.torpedo_x > 0) & (first < last)
    return box(first, m.y + 40, last - first, 1, there).clip(*VIEW)


def _enemy_boxes(m: Ram) -> Box:
    """Sharks or enemy submarines."""
    x = (jnp.repeat(m.enemy_x, 3) + 16 * PLACE_OF) & 255
    look = jnp.repeat(m.look, 3)
    leftward = jnp.repeat(m.leftward, 3)
    beyond = _cut_off(x)
    cut = 8 + jnp.where(leftward == 1, -beyond, beyond)
    return ENEMY_PICTURES.box(
        ENEMY_LOOKS * cut + look,
        x,
        LANE_TOPS[LANE_OF] + when(look < Look.SUBMARINE, m.bob),
        mirrored=leftward == 1,
        valid=(jnp.repeat(m.shown, 3) >> (2 - PLACE_OF) & 1) == 1,
        orientation=_compass(leftward),
        color=_enemy_color(m, look),
    )


def _enemy_color(m: Ram, look: jax.Array) -> jax.Array:
    gray_index = len(SHARK_COLORS)
    index = jnp.where(look >= Look.SUBMARINE, gray_index, m.level_color)
    return pick(index, (*SHARK_COLORS, GRAY))


def _ball_boxes(m: Ram) -> Box:
    """Divers, or torpedoes of enemy submarines."""
    picture = BALL_LOOKS * (8 + _cut_off(m.ball_x)) + m.ball_look
    there = (m.ball_x > 0) & (m.ball_x < 160)
    return BALL_PICTURES.box(picture, m.ball_x, LANE_TOPS, valid=there)


def _patrol(m: Ram) -> Box:
    """The enemy submarine at the surface, which goes to the left."""
    picture = PATROL_LOOKS * (8 - _cut_off(m.patrol_x)) + _propeller(m)
    there = (m.patrol_x > 0) & (m.patrol_x < 160)
    return PATROLS.box(picture, m.patrol_x, 46, mirrored=True, valid=there)


def _oxygen(m: Ram) -> Box:
    width = jnp.minimum(m.oxygen, FULL_BAR)
    return box(BAR[0], BAR[1], width, 5, m.oxygen > 0, value=m.oxygen)


def _used_oxygen(m: Ram) -> Box:
    """The area right of the bar; without oxygen it begins a column further left."""
    left = BAR[0] + jnp.where(m.oxygen > 0, jnp.minimum(m.oxygen, FULL_BAR), -1)
    return box(left, BAR[1], BAR[2] - left, 5, value=FULL_TANK - m.oxygen)


facing = functools.partial(Category, attributes=("orientation",))

HULL = Bounds(
    (GOLD, FLASH, BLACK),
    (20, 44, 151, 162),
    ignore=((8, 55, 160, 56),),
    exclude=("PlayerMissile",),
    min_size=(3, 3),
)
SHOT = Blobs(GOLD, SEA, Shape(w=(3, 8), h=1), filters=(ShortRuns(1),))
SHARKS = Blobs(tuple(sorted(set(SHARK_COLORS))), SEA, Shape(w=(1, 8), h=(1, 7)), gap=(0, 1))
ENEMY_SUBS = Blobs(GRAY, SEA, Shape(w=(1, 8), h=(1, 11)))
DIVERS = Bounds(SEA_BLUE, LANE_AREAS, exclude=("EnemyMissile",))
TORPEDOES = Blobs(SEA_BLUE, SEA, Shape(w=(4, 6), h=4), gap=(2, 2))
BOARD = Bounds(NAVY, tuple((x, 178, x + 8, 187) for x in BOARD_LEFTS.tolist()))
BAR_LEFT = Bounds((WHITE, FLASH), BAR, value=Gauge(1, full=FULL_BAR))
BAR_USED = Bounds(RED, (48, 170, 112, 175), value=Gauge(1, 0, 1, full=FULL_TANK))
ICONS = LIVES.rule(YELLOW, (50, 20, 110, 31), single=2)


def _saver_key(m: Ram) -> jax.Array:
    """The number XORed with colours, or -1 in play."""
    return jnp.where(m.saver_mask == SAVER_MASK, m.saver_key, -1)


GAME = Game(
    name="Seaquest",
    rom=ROM,
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (100, 9), 26, mask=SAVER_MASK, taken=(6, 8)),
    checks=Checks(
        rare=("SurfaceSubmarine",),
        known={"OxygenBar": 0.7},  # full
    ),
    variants=Variants(
        difficulties={
            0: "torpedoes move by 5 pixels a frame",
            1: "torpedoes move by 3 pixels a frame",
        },
        source="play of all difficulties in the emulator",
    ),
    categories=(
        facing("Player", HULL, role="player", doc="the submarine"),
        Category("PlayerMissile", SHOT, doc="its torpedo"),
        facing("Shark", SHARKS, count=12, doc="lane * 3 + place, the lowest lane first"),
        facing("Submarine", ENEMY_SUBS, count=12, doc="lane * 3 + place, the lowest lane first"),
        Category("Diver", DIVERS, count=4, doc="divers to be rescued: lane"),
        Category("EnemyMissile", TORPEDOES, count=4, doc="torpedoes of submarines: lane"),
        Category("SurfaceSubmarine", Bounds(GRAY, (8, 44, 160, FOOT[0])), doc="the patrol"),
        display("CollectedDiver", BOARD, count=6, attributes=(), blinks=True, doc="on board"),
        display("OxygenBar", BAR_LEFT, blinks=True, doc="oxygen that is left, 0-64"),
        # It is background, which no graphics object draws, so it always counts as blinking.
        display("OxygenBarDepleted", BAR_USED, blinks=True, doc="oxygen that was used"),
        display("Lives", ICONS, role="lives", doc="one more than the icons"),
        display("PlayerScore", SCORE.rule(YELLOW), role="score", doc="points"),
    ),
)
