"""Seaquest: a submarine, divers to be rescued, sharks and enemy submarines in four lanes, oxygen.

A lane has three places for sharks or enemy submarines, which follow each other: slot lane * 3 +
place, the lowest lane first. It has one diver, or one torpedo of its submarines: slot lane. The
eight columns at the left edge are blanked by the beam. CollectedDiver has a slot for each diver on
board. The explosion of the submarine, the waves, the ground and the maker's name are scenery.

RAM: ALE's source (score, lives), OCAtari 2.2 and D. Debro's disassembly (what the bytes are), and
the ROM's code. Everything moves at F7A6-FB4F, before the frame is drawn at F080-F5AD, so that the
RAM has what is on the screen; only the submarine's propeller has moved on, every fourth frame.
A diver and a torpedo are drawn by the ball, which is moved and resized on each row.

Covered: levels up to 20 and all colours of sharks, the patrol at the surface, divers, surfacing
with some and with six of them, all ways to die, both difficulties, the end of the game.
Not exact: VEM does not see a torpedo of which less than three columns are outside the submarine,
and misses a diver, or takes it for a torpedo, of which only a few pixels are at an edge of the
screen. Six divers, and oxygen that is low, blink. OxygenBarDepleted is background that the bar has
left free. The value of Lives is ALE's, one more than the icons; without icons it is not valid.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import pick
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.registers import EDGE_CUTS
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.filters import ShortRuns
from ocjax.vision.rules import Blobs, Bounds, Gauge
from ocjax.vision.shades import Saver
from ocjax.vision.shapes import Shape

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
SHARK_COLORS = tuple(int(c) & 0xFE for c in ROM.bytes(0xF0F, 8))
"""Colour of the sharks by the lowest bits of the level."""
VIEW = (8, 0, 160, 210)
SEA = (8, 57, 160, 162)
LANES = tuple((8, 137 - 24 * lane, 160, 152 - 24 * lane) for lane in range(4))
LANE = np.arange(12) // 3
PLACE = np.arange(12) % 3
LANE_Y = 137 - 24 * np.arange(4)
LANE_ROWS = 15
ICONS_X = 58 + 8 * np.arange(6)
SCORE_LEFTS = range(58, 106, 8)
BAR = (49, 170, 112, 175)
SUBMARINE = 4  # `look`, or more; sharks have less
FLASHES = 15  # least `dying` at which the submarine is whole
SURFACE = 13  # `y` at the surface
FOOT = (53, 57)  # rows at the foot of the waves
EAST = 4
WEST = 12


def _rows(pointers: int, index: int, height: int) -> np.ndarray:
    """Rows of a picture from the top, whose address is in a table of pointers."""
    return ROM.rows(0xD00 + int(ROM.bytes(pointers + index, 1)[0]), height)


def _ball_rows(look: int) -> np.ndarray:
    """Rows of what the ball draws: on each row it moves, and is off or 1 to 8 pixels wide."""
    x, out = 2, []
    for move, shape in zip(
        _rows(0xF7E, look, LANE_ROWS), _rows(0xF92, look, LANE_ROWS), strict=True
    ):
        x -= ((int(move) >> 4) ^ 8) - 8
        dots = (1 << (1 << (int(shape) >> 4 & 3))) - 1
        width = dots.bit_length()
        out.append(dots << 8 - x - width if shape & 2 and 0 <= x <= 8 - width else 0)
    return np.array(out)


SUBS = ROM.pictures([0xD00 + int(low) for low in ROM.bytes(0xCFB, 3)], 12)
PATROLS = Pictures.of([_rows(0xCFB, look, 12)[:7] & cut for cut in EDGE_CUTS for look in range(3)])
ENEMIES = Pictures.of(
    [_rows(0xFA2, look, LANE_ROWS) & cut for cut in EDGE_CUTS for look in range(8)]
)
BALLS = Pictures.of([_ball_rows(look) & cut for cut in EDGE_CUTS for look in range(16)])

SAVER_MASK = 0xF7  # the screen saver drops a bit of colours


class Ram(RamMap):
    saver_key = byte(5)  # what colours are XORed with
    saver_mask = byte(6)  # what they are masked with: 0xFF in play
    clock = byte(1)
    enemy_x = byte(30, 31, 32, 33)  # of the first place, modulo 256; lowest lane first
    shown = bits(40, 41, 42, 43, count=3)  # places that are taken and on the screen, last one first
    score = bcd((56, 57, 58))
    icons = byte(59)  # lives, less the one in play
    level_color = bits(61, count=3)
    divers = byte(62)  # on board
    x = byte(70)
    ball_x = byte(71, 72, 73, 74)  # of the lanes' divers and torpedoes; 0: none
    looks_left = bits(86, first=3)
    look = bits(89, 90, 91, 92, count=3)  # picture of a lane's enemies
    ball_look = bits(89, 90, 91, 92, count=4)  # picture of its diver or torpedo
    leftward = bits(89, 90, 91, 92, first=3)
    bob = byte(93)  # rows by which sharks are lower
    propeller = byte(96)  # picture of the submarine, already the next one
    y = byte(97)  # y - 33
    oxygen = byte(102)
    torpedo_x = byte(103)
    dying = byte(105)  # steps until the next life
    patrol_x = byte(118)


def decode(m: Ram) -> dict[str, Box]:
    enemies, balls = _enemies(m), _balls(m)
    width = jnp.minimum(m.oxygen, 63)
    used = BAR[0] + jnp.where(m.oxygen > 0, width, -1)
    score_right = SCORE_LEFTS[-1] + FONT.width
    return {
        "Player": _player(m),
        "PlayerMissile": _torpedo(m),
        "Shark": enemies.where(jnp.repeat(m.look, 3) < SUBMARINE),
        "Submarine": enemies.where(jnp.repeat(m.look, 3) >= SUBMARINE),
        "Diver": balls.where(m.look < SUBMARINE),
        "EnemyMissile": balls.where(m.look >= SUBMARINE),
        "SurfaceSubmarine": _patrol(m),
        "CollectedDiver": box(ICONS_X, 178, 8, 9, np.arange(6) < m.divers),
        "OxygenBar": box(BAR[0], BAR[1], width, 5, m.oxygen > 0, value=m.oxygen),
        "OxygenBarDepleted": box(used, BAR[1], BAR[2] - used, 5, value=64 - m.oxygen),
        "Lives": box(58, 22, 8 * m.icons - 1, 8, m.icons > 0, value=m.icons + 1),
        "PlayerScore": score_box(FONT, m.score, right=score_right, top=9, digits=6, value=m.score),
    }


def _facing(left: jax.Array) -> jax.Array:
    """The compass point; 1 stands for something that looks to the left."""
    return jnp.where(left == 1, WEST, EAST)


def _beyond(x: jax.Array) -> jax.Array:
    """Columns of a picture beyond the right edge, or less than zero beyond the left one."""
    return jnp.clip(x - 152, 0, 8) - jnp.clip(8 - x, 0, 8)


def _propeller(m: Ram) -> jax.Array:
    """The submarine's picture before it changed, which is from 2 down to 0 and to 2 again."""
    return jnp.where((m.clock & 3) == 0, pick(m.propeller, (1, 2, 0)), m.propeller)


def _player(m: Ram) -> Box:
    """The submarine; the four rows at the foot of the waves hide it."""
    there = ((m.dying == 0) | (m.dying >= FLASHES)) & (m.y >= SURFACE)
    left, facing = m.looks_left == 1, _facing(m.looks_left)
    color = jnp.where(m.dying == 0, GOLD, jnp.where(m.dying & 1 == 1, FLASH, BLACK))
    whole = SUBS.box(
        _propeller(m), m.x, m.y + 33, mirrored=left, zoom=2, valid=there, orientation=facing
    )
    top, bottom = whole.y, whole.y + whole.h
    top = jnp.where(top >= FOOT[0], jnp.maximum(top, FOOT[1]), top)
    bottom = jnp.where(bottom <= FOOT[1], jnp.minimum(bottom, FOOT[0]), bottom)
    return replace(whole, y=top, h=bottom - top, color=color)


def _torpedo(m: Ram) -> Box:
    """The submarine's torpedo: what has come out of the submarine, which is in front of it."""
    left, right, hull = m.torpedo_x, m.torpedo_x + 8, m.x + 16
    inside = (left < hull) & (right > m.x)
    first = jnp.where(inside & (left >= m.x), hull, left)
    last = jnp.where(inside & (left < m.x), m.x, right)
    there = (m.torpedo_x > 0) & (first < last)
    return box(first, m.y + 40, last - first, 1, there).clip(*VIEW)


def _enemies(m: Ram) -> Box:
    x = (jnp.repeat(m.enemy_x, 3) + 16 * PLACE) & 255
    there = (jnp.repeat(m.shown, 3) >> (2 - PLACE) & 1) == 1
    look, left = jnp.repeat(m.look, 3), jnp.repeat(m.leftward, 3)
    y = LANE_Y[LANE] + jnp.where(look < SUBMARINE, m.bob, 0)
    beyond = _beyond(x)
    picture = 8 * (8 + jnp.where(left == 1, -beyond, beyond)) + look
    facing, color = _facing(left), _enemy_color(m)
    return ENEMIES.box(
        picture, x, y, mirrored=left == 1, valid=there, orientation=facing, color=color
    )


def _enemy_color(m: Ram) -> jax.Array:
    """The colours of the lanes' enemies."""
    submarine = jnp.repeat(m.look, 3) >= SUBMARINE
    return pick(jnp.where(submarine, 8, m.level_color), (*SHARK_COLORS, GRAY))


def _balls(m: Ram) -> Box:
    """Divers, or torpedoes of enemy submarines."""
    picture = 16 * (8 + _beyond(m.ball_x)) + m.ball_look
    return BALLS.box(picture, m.ball_x, LANE_Y, valid=(m.ball_x > 0) & (m.ball_x < 160))


def _patrol(m: Ram) -> Box:
    """The enemy submarine at the surface, which goes to the left."""
    picture = 3 * (8 - _beyond(m.patrol_x)) + _propeller(m)
    there = (m.patrol_x > 0) & (m.patrol_x < 160)
    return PATROLS.box(picture, m.patrol_x, 46, mirrored=True, valid=there)


facing = functools.partial(Category, attributes=("orientation",))

PLAYER = Bounds(
    (GOLD, FLASH, BLACK),
    (20, 44, 151, 162),
    ignore=((8, 55, 160, 56),),
    exclude=("PlayerMissile",),
    min_size=(3, 3),
)
TORPEDO = Blobs(GOLD, SEA, Shape(w=(3, 8), h=1), filters=(ShortRuns(1),))
SHARKS = Blobs(tuple(sorted(set(SHARK_COLORS))), SEA, Shape(w=(1, 8), h=(1, 7)), gap=(0, 1))
ENEMY_SUBS = Blobs(GRAY, SEA, Shape(w=(1, 8), h=(1, 11)))
DIVERS = Bounds(SEA_BLUE, LANES, exclude=("EnemyMissile",))
TORPEDOES = Blobs(SEA_BLUE, SEA, Shape(w=(4, 6), h=4), gap=(2, 2))
BOARD = Bounds(NAVY, tuple((int(x), 178, int(x) + 8, 187) for x in ICONS_X))
USED = Bounds(RED, (48, 170, 112, 175), value=Gauge(1, 0, 1, full=64))
OXYGEN = Bounds((WHITE, FLASH), BAR, value=Gauge(1, full=63))
LIVES = Bounds(YELLOW, (50, 20, 110, 31), value=Gauge(8, -1, 1))
SCORE = Bounds(YELLOW, (58, 9, 106, 17), value=Digits(FONT, SCORE_LEFTS, 9))


def _saver_key(m: Ram) -> jax.Array:
    return jnp.where(m.saver_mask == SAVER_MASK, m.saver_key, -1)


GAME = Game(
    name="Seaquest",
    rom=ROM,
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (100, 9), 26, mask=SAVER_MASK, taken=(6, 8)),
    categories=(
        facing("Player", PLAYER, doc="the submarine"),
        Category("PlayerMissile", TORPEDO, doc="its torpedo"),
        facing("Shark", SHARKS, count=12, doc="lane * 3 + place, the lowest lane first"),
        facing("Submarine", ENEMY_SUBS, count=12, doc="lane * 3 + place, the lowest lane first"),
        Category("Diver", DIVERS, count=4, doc="divers to be rescued: lane"),
        Category("EnemyMissile", TORPEDOES, count=4, doc="torpedoes of submarines: lane"),
        Category("SurfaceSubmarine", Bounds(GRAY, (8, 44, 160, FOOT[0])), doc="the patrol"),
        display("CollectedDiver", BOARD, count=6, attributes=(), blinks=True, doc="on board"),
        display("OxygenBar", OXYGEN, blinks=True, doc="oxygen that is left, 0-64"),
        # No graphics object draws it, but the background's colour does; so it blinks for good.
        display("OxygenBarDepleted", USED, blinks=True, doc="oxygen that was used"),
        display("Lives", LIVES, doc="one more than the icons"),
        display("PlayerScore", SCORE, doc="points"),
    ),
)
