"""Yars' Revenge: an insect nibbles at the Qotile's shield and shoots it with the Zorlon cannon.

Screen: the game draws the shield on one frame and the neutral zone, Barrier, on the next, with the
missiles and the cannon. An object that the game skips on a frame keeps its last box. Score and Life
are shown between two rounds; they stay valid and keep their values. The Qotile is an Enemy until it
becomes a Swirl. The explosion of the Qotile, which fills the screen, is scenery. The stripes of the
zone and the cannon have different colours; the first stripe gives the object's colour.

Slots: a shield block has the slot row * 8 + column, from the top left.

RAM: D. Debro's disassembly (meaning of bytes), ALE's source (score, lives), and the ROM's code.
f000 draws the shield, f06c the zone, f0d6 the explosion and f11c the score. f7a1-fcb0 moves all
objects before the frame is drawn. HMOVE comes after the drawing, so the drawn columns are those
before the last move.

Covered: all modes and difficulties, both shields, the cannon, rounds without the zone.

Not exact, up to 4 columns off: a Yar that has just reached the edge or that the shield threw back;
a moving Yar that a missile hit while a shot flew (the shot uses the byte of the Yar's last move,
too); the column of a shot fired on the frame on which the previous one left the screen (f8e8 keeps
the old column, 3 of 100 shots); a fast swirl in its first frames; shield blocks, missile and swirl
on the frame of a hit; the swirl as it leaves the screen, because the RAM already has it at home.

VEM: objects behind the zone, and missiles in front of it, are partly or fully hidden. It misses a
shot that touches the Yar. It finds the Qotile inside a rotating shield only on frames without the
shield.
"""

import functools
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Cells,
    Checks,
    Game,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Shape,
    among,
    bcd,
    bits,
    box,
    byte,
    display,
    high,
    lookup,
    low,
    match,
    pick,
    signed_nibble,
    when,
)

ROM = Rom("yars_revenge", "c5930d0e8cdae3e037349bfa08e871be")
FONT = ROM.font(0xE00, rows=7, stride=8)
SCORE = NumberDisplay(FONT, right=103, top=48, digits=6)
LIVES = NumberDisplay(FONT, right=103, top=74, digits=1)

HOME_X = 150  # of the Qotile
LAUNCH_X = 154  # of its missile
RIGHT_EDGE = 151  # of the Yar's columns
LEFT_EDGE = 5
NO_CANNON = 240  # least `cannon_y` without a cannon
LAST_PICTURE = 0x59  # `look` of a Yar that has dissolved
YAR_COLOR = 124
SWIRLS = (52, 134, 216)
SHIELDS = (50, 6, 116, 88)
CANNON_COLOR = 90  # between stripes
LIGHTS = tuple(hue | light for hue in range(0, 256, 16) for light in range(2, 16, 2))
DIM = tuple(hue | light for hue in range(0, 256, 16) for light in (0, 2, 4, 6) if hue | light)
STRIPE_BITS = 246  # of a colour, in the zone
ZONE = (52, 3, 80, 195)
SHIELD_ROWS = np.arange(128) // 8  # rows of the shield's blocks
COLUMNS = np.arange(128) % 8
CELLS_X = tuple((128 + 4 * COLUMNS).tolist())
CELLS_Y = tuple((8 * SHIELD_ROWS).tolist())

MOVES = ROM.bytes(0xF25, 16)
YAR_MOVES = ROM.bytes(0xF25, 8, 2).tolist()
STEPS_X = (8 - (MOVES >> 4 ^ 8)).tolist()  # columns per step, by heading
STEPS_Y = ((MOVES & 15 ^ 8) - 8).tolist()  # rows per step
FAST_DX = (8 - (np.roll(ROM.bytes(0xFEA, 16), 8) >> 4 ^ 8)).tolist()  # of a fast swirl
DELAYS = ROM.bytes(0xF08, 5).tolist()  # steps of a missile in 256 frames, by its speed


def _rows_of_zone(clock: int) -> int:
    """First row, height and first colour of the zone's visible stripes, packed in one integer."""
    seen = []
    colors = []
    for row in range(1, 193, 2):
        lit = (row ^ ROM.bytes(clock + row, 1).item()) & STRIPE_BITS
        if lit:
            lower = ~(row + 1) & 255
            second_lit = (lower ^ ROM.bytes(clock + lower, 1).item()) & 254
            colors.append(lit)
            seen.extend([row, row + 1] if second_lit else [row])
    return colors[0] << 16 | seen[0] + 2 << 8 | seen[-1] - seen[0] + 1


CODE = ROM.bytes(0, 512)  # the program's bytes; the game makes the stripes from them
ZONE_ROWS = [_rows_of_zone(clock) for clock in range(256)]


def _double(start: int, height: int) -> np.ndarray:
    """A picture with two lines per row."""
    return np.repeat(ROM.rows(0xF00 + start + 1, height), 2)


class EnemyLook:  # of `Ram.enemy_look`
    FIRST_SWIRL = 0xC4
    QOTILE = 0xDF


class Stack:  # of `Ram.stack`: the kernel that has run, or the program's position after it
    SHIELD_DRAWN = 0xFF
    ZONE_DRAWN = 0x6B
    EXPLOSION_DRAWN = 0xD5
    SCORE_DRAWN = 0x1B
    NEW_ROUND = 0x8A  # the fire button has ended the display of the score
    THROWN_BACK = (0xD9, 0xE6, 0xEC)  # the Yar has touched the shield
    LIFE_LOST = (0x9A, 0xA3)  # the Yar has dissolved
    SHOT_HIT = (0x1D, 0x37, 0x3F, 0x47, 0x50)  # the game compared a shot with the shield


class Status:  # of `Ram.status`
    WAITING = 6  # between two rounds


class Explosion:  # of `Ram.explosion`
    RUNS = 64  # a bit
    HIT = 192  # on the frame of a hit


YARS = Pictures.of([_double(look, 8) for look in range(256)])
ENEMIES = Pictures.of([_double(look, 9 if look == EnemyLook.QOTILE else 8) for look in range(256)])


class Ram(RamMap):
    saver_mask = byte(114)  # of the colour of the score: 247 in the screen saver
    variation = bits(0, count=3)  # of the game
    trenches = bits(0, first=5)  # later rounds: the swirl flies at any time
    shield = byte(*range(16, 0, -1))  # its rows from the top; the lowest bit is the left column
    zone = byte(17)  # its columns; 0: no zone
    speed = byte(18)  # of the missile
    enemy_heading = low(20)
    flies = bits(20, first=6)  # the swirl
    spins = bits(20, first=7)
    rotates = bits(20, first=4)  # the shield
    status = bits(21, count=3)
    cannon_fired = bits(22, first=5)
    cannon_armed = bits(22, first=6)
    shot_flies = bits(22, first=4)
    shot_heading = low(22)
    dies = bits(23, first=7)
    cannon_y = byte(24)
    cannon_x = byte(25)  # x - 1
    shield_y = byte(26)  # y - 2
    heading = low(30)  # of 16 directions, counterclockwise from south
    lives = high(30)
    y = byte(31)  # y - 3
    x = byte(32)
    moving = byte(34)
    look = byte(35)
    shot_y = byte(37)
    shot_x = byte(38)
    explosion = byte(40)
    enemy_y = byte(42)  # y - 3
    enemy_x = byte(43)
    enemy_look = byte(44)
    missile_y = byte(46)
    missile_x = byte(47)
    last_move = byte(51)  # of the Yar, for HMP1; x + 12 of one thrown back; or of a shot
    cannon_wide = bits(53, first=4)
    missile_flies = bits(53, first=7)
    missile_part = byte(54)  # 1 / 256 of a step
    score = bcd((96, 97, 98))
    enemy_color = byte(104)  # of the Qotile and its missile
    next_clock = byte(105)  # frames
    leftward = bits(107, first=7)  # the cannon's shot comes back
    stack = byte(126)


class Frame(NamedTuple):
    """The content of the frame."""

    score: jax.Array  # whether it shows the score, between two rounds
    play: jax.Array  # whether it shows play, without an explosion
    clock: jax.Array
    odd: jax.Array  # 1: the zone was drawn, 0: the shield was drawn
    zone_clock: jax.Array  # `clock` when the zone was drawn last


def decode(m: Ram) -> dict[str, Box]:
    frame = _read_frame(m)
    enemy = _enemy_box(m, frame)
    color = YAR_COLOR & m.saver_mask
    return {
        "Player": _player_box(m, frame),
        "Player_Bullet": _shot_box(m, frame),
        "Enemy": enemy.where(m.enemy_look == EnemyLook.QOTILE),
        "Swirl": enemy.where(m.enemy_look != EnemyLook.QOTILE),
        "Enemy_Missile": _missile_box(m, frame),
        "Zorlon_Cannon": _cannon_box(m, frame),
        "Shield_Block": _shield_boxes(m, frame),
        "Barrier": _barrier(m, frame),
        "Score": SCORE.box(m.score, color=color),
        "Life": LIVES.box(m.lives, valid=m.lives > 0, color=color),
    }


def _read_frame(m: Ram) -> Frame:
    ends = among(m.stack, (*Stack.LIFE_LOST, Stack.EXPLOSION_DRAWN))
    waits = (m.status == Status.WAITING) & ~ends
    shows_score = waits | among(m.stack, (Stack.SCORE_DRAWN, Stack.NEW_ROUND))
    runs = ((m.explosion & Explosion.RUNS) != 0) & (m.explosion != Explosion.HIT)
    explodes = runs | (m.stack == Stack.EXPLOSION_DRAWN)
    clock = (m.next_clock - 1) & 255
    odd = match(
        (among(m.stack, (*Stack.LIFE_LOST, Stack.SHIELD_DRAWN)), 0),
        (m.stack == Stack.ZONE_DRAWN, 1),
        otherwise=clock & 1,
    )
    zone_clock = ((clock - 1) & 255) | 1
    return Frame(shows_score, ~shows_score & ~explodes, clock, odd, zone_clock)


def _before(m: Ram) -> jax.Array:
    """The Yar's column before its last move, also the column of a waiting shot."""
    step = when(m.moving > 0, pick(m.heading, STEPS_X))
    stays = (m.x + step < LEFT_EDGE) | (m.x + step > RIGHT_EDGE)
    near = jnp.abs(m.shot_x - 4 - m.x) <= 4
    waits = (m.shot_flies == 0) & ~among(m.stack, Stack.SHOT_HIT) & near
    return jnp.where(waits, m.shot_x - 4, m.x - jnp.where(stays, 0, step))


def _player_box(m: Ram, frame: Frame) -> Box:
    """The Yar, one move back if a missile hit it, because f645 clears HMP1."""
    by_shot = (m.dies == 1) & (m.shot_flies == 0) & (m.last_move == m.x + 12)
    thrown = among(m.stack, Stack.THROWN_BACK) | by_shot
    gone = among(m.stack, Stack.LIFE_LOST)
    halted = ((m.dies == 1) | gone) & (m.missile_flies == 0) & among(m.last_move, YAR_MOVES)
    moved_x = jnp.where(frame.odd == 1, _before(m), m.x + when(thrown, 7))
    x = moved_x + when(halted, signed_nibble(m.last_move >> 4))
    look = jnp.where(gone, LAST_PICTURE, m.look)
    west = (m.heading & 8) == 0
    orientation = (8 - m.heading) & 15
    yar = YARS.box(look, x, m.y + 3, mirrored=west, orientation=orientation)
    return yar.where(~frame.score)


def _beam_x(cycle: int, below: jax.Array, height: jax.Array | int, page: jax.Array) -> jax.Array:
    """The beam's column when the program turns a missile or the ball on or off.

    The program is later on lines of a picture and below it, and if a table crosses a page.
    """
    late = match((below < 0, 0), (below < height, 6), otherwise=4)
    return 3 * (cycle + late + when(page > 255, 1)) - 68


def _beam_on_even(m: Ram, frame: Frame, row: jax.Array, cycle: int) -> jax.Array:
    height = jnp.where(m.enemy_look == EnemyLook.QOTILE, 18, 16)
    return _beam_x(cycle, row - m.enemy_y, height, frame.zone_clock + (~row & 255))


def _shot_box(m: Ram, frame: Frame) -> Box:
    """The Yar's shot; on its first frame it is in front of the Yar. It moves on every frame."""
    dx = pick(m.shot_heading, STEPS_X)
    dy = pick(m.shot_heading, STEPS_Y)
    even = frame.odd == 0
    x = m.shot_x - when(even, dx)
    y = m.shot_y - when(even, dy)
    new = (x == _before(m) + 4) & (y == ((m.y + 6) & ~1))
    flies = (m.shot_flies == 1) | among(m.stack, Stack.SHOT_HIT)
    there = flies & ~new & (m.dies == 0) & frame.play
    late = jnp.where(x - dx < _beam_on_even(m, frame, y, 39), 3, 2)
    return box(x - dx, y + late, 1, 2, there, orientation=(8 - m.shot_heading) & 15)


def _enemy_box(m: Ram, frame: Frame) -> Box:
    """The Qotile or the swirl, which rests when its pictures begin again.

    It starts when the clock is at 0 or 128. A swirl farther away than its slow speed allows is
    fast.
    """
    begins = (m.enemy_look == EnemyLook.FIRST_SWIRL) & (frame.odd == 0)
    rests = (m.flies == 0) | (m.enemy_x == HOME_X) | (m.dies == 1) | begins
    slow = pick(m.enemy_heading, STEPS_X)
    far = HOME_X - m.enemy_x > (frame.clock & 127) * -slow
    fast = (m.variation > 1) & (m.trenches == 0) & far
    step = match((rests, 0), (fast, pick(m.enemy_heading, FAST_DX)), otherwise=slow)
    enemy = ENEMIES.box(m.enemy_look, m.enemy_x - step, m.enemy_y + 3)
    return replace(enemy.where(frame.play), color=m.enemy_color & ~1)


def _missile_box(m: Ram, frame: Frame) -> Box:
    """The missile that follows the Yar; it moves on frames on which it is not drawn."""
    moved = (m.missile_part < pick(m.speed, DELAYS)) & (frame.odd == 0)
    x = m.missile_x + when(moved, jnp.sign(m.missile_x - m.x - 2))
    y = m.missile_y + when(moved, 2 * jnp.sign(m.missile_y - m.y - 8))
    beam = _beam_on_even(m, frame, y, 45)
    late = jnp.where(x <= beam - 4, 3, 2)
    height = jnp.where((x > beam - 4) & (x < beam), 3, 2)
    there = (m.missile_flies == 1) & (m.missile_x != LAUNCH_X) & (m.dies == 0) & frame.play
    return box(x, y + late, 4, height, there, color=_missile_color(m, frame))


def _missile_color(m: Ram, frame: Frame) -> jax.Array:
    """The colour of the last drawing; it grows every 8 frames, but is never black."""
    grown = (frame.odd == 0) & ((frame.clock & 7) == 0) & (m.spins == 0)
    step = jnp.where((m.enemy_color & 14) == 2, 4, 2)
    return (m.enemy_color - when(grown, step)) & 254


def _barrier(m: Ram, frame: Frame) -> Box:
    word = lookup(ZONE_ROWS, frame.zone_clock)
    color = word >> 16
    top = word >> 8 & 255
    height = word & 255
    return box(52, top, 28, height, frame.play & (m.zone > 0), color=color)


def _cannon_box(m: Ram, frame: Frame) -> Box:
    """The cannon at the left edge, and its shot, in lines of two rows."""
    rows = (m.cannon_y | 1) + 2 * np.arange(5)
    line = rows - m.cannon_y - when(rows < m.y, 1)
    lit = (line >= 0) & (line <= 6)
    top = jnp.min(jnp.where(lit, rows, 255))
    step = jnp.where(m.leftward == 1, -6, 4)
    x = m.cannon_x + 1 - when(m.cannon_fired == 1, step)
    stripe = (top ^ lookup(CODE, frame.zone_clock + top)) & m.zone & STRIPE_BITS
    color = jnp.where(stripe > 0, stripe, CANNON_COLOR)
    beam = _beam_x(52, top - m.y, 16, frame.zone_clock + top)
    y = top + jnp.where(x < beam, 3, 2)
    height = 2 * jnp.sum(when(lit, 1))
    there = ((m.cannon_fired | m.cannon_armed) == 1) & (m.cannon_y < NO_CANNON) & frame.play
    return box(x, y, 4 << m.cannon_wide, height, there, color=color)


def _shield_boxes(m: Ram, frame: Frame) -> Box:
    """The last drawn blocks, before the shield rotated."""
    turned = (m.rotates == 1) & ((frame.clock & 3) < 2)
    row = jnp.where(turned, _turned_back(m.shield), m.shield)
    lit = (jnp.repeat(row, 8) >> COLUMNS & 1) == 1
    round_begins = ((m.missile_flies | m.dies | m.spins) == 0) & (frame.odd == 1)
    y = m.shield_y + np.where(SHIELD_ROWS == 0, 2, 1 + 8 * SHIELD_ROWS)
    there = lit & frame.play & ~round_begins
    return box(128 + 4 * COLUMNS, y, 4, np.where(SHIELD_ROWS == 0, 7, 8), there)


def _turned_back(shield: jax.Array) -> jax.Array:
    """The shield one rotation back: odd rows, from the top, move left, the others right."""
    odd = np.arange(16) % 2 == 1
    carry = jnp.roll(jnp.where(odd, shield >> 7, shield & 1), -1)
    return jnp.where(odd, (shield << 1 & 255) | carry, (shield >> 1) | (carry << 7))


facing = functools.partial(Category, attributes=("orientation",))
between = functools.partial(display, blinks=True)  # shown between two rounds

# The Qotile is 18 rows high and at times has the Yar's colour.
PLAYER_SHAPES = Shape(w=2, h=6), Shape(w=(4, 10), h=(8, 17))  # the first one while it dissolves
PLAYER = Blobs(YAR_COLOR, gap=(2, 3), shapes=PLAYER_SHAPES)
SHOT = Blobs(YAR_COLOR, gap=(2, 3), shapes=Shape(w=1, h=(1, 2)))
ENEMY_FIGURE = Blobs(LIGHTS, (150, 0, 158, 195), Shape(w=8, h=(17, 18)))
SWIRL = Blobs(SWIRLS, gap=(1, 1), shapes=Shape(w=(6, 8), h=(10, 16)))
IN_ZONE = Blobs(
    tuple(c for c in LIGHTS if c & 8 and c not in (YAR_COLOR, CANNON_COLOR)),
    ZONE,
    Shape(w=(1, 4), h=(1, 3)),
)
OTHERS = tuple(c for c in LIGHTS if c != YAR_COLOR)
MISSILE = Blobs(OTHERS, shapes=Shape(w=(3, 4), h=(1, 3)), ignore=(ZONE,), also=(IN_ZONE,))
cannon_rule = functools.partial(Blobs, gap=(0, 4), shapes=Shape(w=(3, 8), h=(4, 8)), ignore=(ZONE,))
CANNON = cannon_rule((*DIM, CANNON_COLOR), (0, 0, 128, 195))
tiles = functools.partial(Cells, whole=False, exclude=("Enemy", "Enemy_Missile"), floats=True)
BLOCKS = tiles(SHIELDS, CELLS_X, CELLS_Y, 4, 8)
STRIPES = Bounds(DIM, ZONE, min_size=(28, 150))
TEXT = (YAR_COLOR, YAR_COLOR & 247)  # the second one in the screen saver

GAME = Game(
    name="YarsRevenge",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        mirrored={"Player_Bullet": None},
    ),
    categories=(
        facing("Player", PLAYER, role="player", doc="the Yar"),
        facing("Player_Bullet", SHOT, doc="its shot"),
        Category("Enemy", ENEMY_FIGURE, doc="the Qotile at rest"),
        Category("Swirl", SWIRL, doc="the Qotile as it spins and flies"),
        Category("Enemy_Missile", MISSILE, doc="it follows the Yar"),
        Category(
            "Zorlon_Cannon",
            CANNON,
            needs=("Player", "Barrier"),
            doc="at the left edge, and its shot",
        ),
        Category("Shield_Block", BLOCKS, count=128, doc="by row and column"),
        Category("Barrier", STRIPES, doc="the neutral zone"),
        between("Score", SCORE.rule(TEXT, required=True), role="score", doc="points"),
        between("Life", LIVES.rule(TEXT, required=True), role="lives", doc="lives"),
    ),
)
