"""Yars' Revenge: an insect nibbles at the Qotile's shield and shoots it with the Zorlon cannon.

The shield and the neutral zone, Barrier, are drawn by turns, on every other frame; missiles and the
cannon are drawn with the zone. What is not drawn on a frame has the box that it had on the one
before. Score and Life are shown between two rounds, stay valid and keep their values. The Qotile is
an Enemy until it becomes a Swirl. A shield block has the slot row * 8 + column, from the top left.
The explosion of the Qotile, which fills the screen, is scenery. The zone and the cannon have the
colour of their first stripe, as each has another one.

RAM: D. Debro's disassembly (what bytes are), ALE's source (score, lives), and the ROM's code. f000
draws the shield, f06c the zone, f0d6 the explosion and f11c the score; ram[126] holds what the
stack had last: the kernel that was drawn, or where the program was after it. f7a1-fcb0 moves all
before the frame is drawn, but HMOVE comes after it, so that columns are those before the last move.

Covered: all modes and difficulties, both shields, the cannon, rounds without the zone.
Not exact, up to 4 columns off: a Yar that has just reached the edge, that the shield threw back or
that a missile hit in motion while a shot flew (its last move is in the byte that a shot uses, too);
the column of a shot fired on the frame on which the one before left the screen (f8e8 keeps the old
one's column for it, 3 of 100 shots); a fast swirl's in its first frames; shield blocks, missile and
swirl on the frame of a hit; the swirl as it leaves the screen, when it is home in the RAM. VEM sees
of what is behind the zone, and of missiles in front of it, only parts or nothing, a shot not while
it touches the Yar, and the Qotile inside a shield that rotates only while that is not drawn.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import among, lookup, pick
from ocjax.console.ram import RamMap, bcd, bits, byte, high, low
from ocjax.console.registers import signed_nibble
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Blobs, Bounds, Cells
from ocjax.vision.shapes import Shape

ROM = Rom("yars_revenge", "c5930d0e8cdae3e037349bfa08e871be")
FONT = ROM.font(0xE00, rows=7, stride=8)
number = functools.partial(score_box, FONT, right=103)

# `stack`
SHIELD_DRAWN = 0xFF
ZONE_DRAWN = 0x6B
EXPLOSION_DRAWN = 0xD5
SCORE_DRAWN = 0x1B
WAITING = 6  # `status` between two rounds
NEW_ROUND = 0x8A  # `stack` after the fire button has ended the display of the score
THROWN_BACK = (0xD9, 0xE6, 0xEC)  # `stack` after the Yar has touched the shield
LIFE_LOST = (0x9A, 0xA3)  # `stack` when the Yar has dissolved
LAST_PICTURE = 0x59  # its `look`
SHOT_HIT = (0x1D, 0x37, 0x3F, 0x47, 0x50)  # `stack` after a shot was compared with the shield
# `enemy_look`
FIRST_SWIRL = 0xC4
QOTILE = 0xDF
HIT = 0xC0  # `explosion` on the frame of a hit
EXPLODES = 0x40  # and a bit of it
# of the Qotile, its missile; `cannon_y`
HOME_X = 0x96
LAUNCH_X = 0x9A
NO_CANNON = 0xF0
YAR = 0x7C
SWIRLS = (0x34, 0x86, 0xD8)
SHIELDS = (0x32, 0x06, 0x74, 0x58)
CANNON_COLOR = 0x5A  # where no stripe is
LIGHTS = tuple(hue | light for hue in range(0, 256, 16) for light in range(2, 16, 2))
DIM = tuple(hue | light for hue in range(0, 256, 16) for light in (0, 2, 4, 6) if hue | light)
ZONE = (52, 3, 80, 195)
ROWS = np.arange(128) // 8
COLUMNS = np.arange(128) % 8
CELLS_X, CELLS_Y = (tuple(v.tolist()) for v in (128 + 4 * COLUMNS, 8 * ROWS))
SCORE_LEFTS = range(55, 103, 8)

MOVES = ROM.bytes(0xF25, 16)
YAR_MOVES = ROM.bytes(0xF25, 8, 2).tolist()
DX = (8 - (MOVES >> 4 ^ 8)).tolist()
DY = ((MOVES & 15 ^ 8) - 8).tolist()
"""Pixels a step in each of 16 directions, from the south on, counterclockwise."""
FAST_DX = (8 - (np.roll(ROM.bytes(0xFEA, 16), 8) >> 4 ^ 8)).tolist()
"""Those of a fast swirl, which flies in the directions from 8 on and in 0."""
DELAYS = ROM.bytes(0xF08, 5).tolist()
"""Steps of a missile in 256 frames, by its speed."""


def _zone_rows(clock: int) -> int:
    """First row, height and first colour of the stripes that are seen, from the program's bytes."""
    seen, colors = [], []
    for row in range(1, 193, 2):
        upper, lower = row, ~(row + 1) & 255
        a, b = (y ^ ROM.bytes(clock + y, 1).item() for y in (upper, lower))
        lit = a & 0xF6
        colors += [lit] * (lit > 0)
        seen += [row] * (lit > 0) + [row + 1] * (lit > 0 and b & 0xFE > 0)
    return colors[0] << 16 | seen[0] + 2 << 8 | seen[-1] - seen[0] + 1


CODE = ROM.bytes(0, 512)  # what stripes are made of
ZONE_ROWS = [_zone_rows(clock) for clock in range(256)]


def _double(start: int, height: int) -> np.ndarray:
    """A picture of rows of two lines."""
    return np.repeat(ROM.rows(0xF00 + start + 1, height), 2)


YARS = Pictures.of([_double(look, 8) for look in range(256)])
ENEMIES = Pictures.of([_double(look, 9 if look == QOTILE else 8) for look in range(256)])


class Ram(RamMap):
    saver_mask = byte(114)  # of the colour of the score: 0xF7 in the screen saver
    variation = bits(0, count=3)  # of the game
    trenches = bits(0, first=5)  # later rounds, in which the swirl flies at any time
    shield = byte(*range(16, 0, -1))  # its rows from the top; the lowest bit is the left column
    zone = byte(17)  # its columns; 0: there is none
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
    heading = low(30)  # counterclockwise from south
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


def decode(m: Ram) -> dict[str, Box]:
    waits = (m.status == WAITING) & ~among(m.stack, (*LIFE_LOST, EXPLOSION_DRAWN))
    shows_score = waits | among(m.stack, (SCORE_DRAWN, NEW_ROUND))
    explodes = (m.explosion & EXPLODES > 0) & (m.explosion != HIT) | (m.stack == EXPLOSION_DRAWN)
    plays = ~shows_score & ~explodes
    clock = (m.next_clock - 1) & 255
    odd = jnp.where(m.stack == SHIELD_DRAWN, 0, jnp.where(m.stack == ZONE_DRAWN, 1, clock & 1))
    odd = jnp.where(among(m.stack, LIFE_LOST), 0, odd)
    before = _before(m)
    enemy = replace(_enemy(m, odd, clock).where(plays), color=m.enemy_color & ~1)
    begins = (m.missile_flies | m.dies | m.spins) == 0  # a round
    zone_clock = (clock - 1) & 255 | 1
    zone = lookup(ZONE_ROWS, zone_clock)
    color = YAR & m.saver_mask
    return {
        "Player": _player(m, odd, before).where(~shows_score),
        "Player_Bullet": _shot(m, odd, zone_clock, before).where(plays),
        "Enemy": enemy.where(m.enemy_look == QOTILE),
        "Swirl": enemy.where(m.enemy_look != QOTILE),
        "Enemy_Missile": replace(
            _missile(m, odd, zone_clock).where(plays), color=_missile_color(m, odd, clock)
        ),
        "Zorlon_Cannon": _cannon(m, zone_clock).where(plays),
        "Shield_Block": _shield(m, clock).where(plays & ~(begins & (odd == 1))),
        "Barrier": box(52, zone >> 8 & 255, 28, zone & 255, plays & (m.zone > 0), color=zone >> 16),
        "Score": number(m.score, top=48, digits=6, value=m.score, color=color),
        "Life": number(m.lives, top=74, digits=1, valid=m.lives > 0, value=m.lives, color=color),
    }


def _before(m: Ram) -> jax.Array:
    """The Yar's column before its last move: that of a waiting shot; at an edge it did not move."""
    step = jnp.where(m.moving > 0, pick(m.heading, DX), 0)
    stays = (m.x + step < 5) | (m.x + step > 0x97)
    waits = (m.shot_flies == 0) & ~among(m.stack, SHOT_HIT) & (jnp.abs(m.shot_x - 4 - m.x) <= 4)
    return jnp.where(waits, m.shot_x - 4, m.x - jnp.where(stays, 0, step))


def _player(m: Ram, odd: jax.Array, before: jax.Array) -> Box:
    """The Yar; where it was before its last move if a missile hit it, as f645 clears HMP1."""
    thrown = among(m.stack, THROWN_BACK)
    thrown = thrown | (m.dies == 1) & (m.shot_flies == 0) & (m.last_move == m.x + 12)
    x = jnp.where(odd == 1, before, m.x + jnp.where(thrown, 7, 0))
    gone = among(m.stack, LIFE_LOST)
    halted = ((m.dies == 1) | gone) & (m.missile_flies == 0) & among(m.last_move, YAR_MOVES)
    x = x + jnp.where(halted, signed_nibble(m.last_move >> 4), 0)
    look = jnp.where(gone, LAST_PICTURE, m.look)
    mirrored = m.heading & 8 == 0
    return YARS.box(look, x, m.y + 3, mirrored=mirrored, orientation=8 - m.heading & 15)


def _beam(cycle: int, below: jax.Array, height: jax.Array | int, page: jax.Array) -> jax.Array:
    """The column at which the beam is when the program turns a missile or the ball on or off.

    The program is later on lines of a picture and below it, and where a table crosses a page.
    """
    late = jnp.where(below < 0, 0, jnp.where(below < height, 6, 4))
    return 3 * (cycle + late + jnp.where(page > 255, 1, 0)) - 68


def _beam_on_even(m: Ram, zone_clock: jax.Array, row: jax.Array, cycle: int) -> jax.Array:
    height = jnp.where(m.enemy_look == QOTILE, 18, 16)
    return _beam(cycle, row - m.enemy_y, height, zone_clock + (~row & 255))


def _shot(m: Ram, odd: jax.Array, zone_clock: jax.Array, before: jax.Array) -> Box:
    """The Yar's shot, which moves on every frame; on its first one it is in front of the Yar."""
    dx, dy = pick(m.shot_heading, DX), pick(m.shot_heading, DY)
    x, y = m.shot_x - jnp.where(odd == 1, 0, dx), m.shot_y - jnp.where(odd == 1, 0, dy)
    new = (x == before + 4) & (y == (m.y + 6 & ~1))
    there = (m.shot_flies == 1) | among(m.stack, SHOT_HIT)
    x = x - dx
    late = jnp.where(x < _beam_on_even(m, zone_clock, y, 39), 3, 2)
    return box(x, y + late, 1, 2, there & ~new & (m.dies == 0), orientation=8 - m.shot_heading & 15)


def _enemy(m: Ram, odd: jax.Array, clock: jax.Array) -> Box:
    """The Qotile or the swirl, which rests when its pictures begin again.

    It starts when the clock is at 0 or 128. A swirl that is further than it could be is fast.
    """
    rests = (m.flies == 0) | (m.enemy_x == HOME_X) | (m.dies == 1)
    rests = rests | (m.enemy_look == FIRST_SWIRL) & (odd == 0)
    slow = pick(m.enemy_heading, DX)
    fast = (m.variation > 1) & (m.trenches == 0) & (HOME_X - m.enemy_x > (clock & 127) * -slow)
    step = jnp.where(fast, pick(m.enemy_heading, FAST_DX), slow)
    step = jnp.where(rests, 0, step)
    return ENEMIES.box(m.enemy_look, m.enemy_x - step, m.enemy_y + 3)


def _missile(m: Ram, odd: jax.Array, zone_clock: jax.Array) -> Box:
    """The missile that follows the Yar; it moves on frames on which it is not drawn."""
    moved = (m.missile_part < pick(m.speed, DELAYS)) & (odd == 0)
    x = m.missile_x + jnp.where(moved, jnp.sign(m.missile_x - m.x - 2), 0)
    y = m.missile_y + jnp.where(moved, 2 * jnp.sign(m.missile_y - m.y - 8), 0)
    beam = _beam_on_even(m, zone_clock, y, 45)
    late = jnp.where(x <= beam - 4, 3, 2)
    height = jnp.where((x > beam - 4) & (x < beam), 3, 2)
    there = (m.missile_flies == 1) & (m.missile_x != LAUNCH_X) & (m.dies == 0)
    return box(x, y + late, 4, height, there)


def _missile_color(m: Ram, odd: jax.Array, clock: jax.Array) -> jax.Array:
    """The colour when the missile was drawn last; it grows every 8 frames, but is never black."""
    grown = (odd == 0) & (clock & 7 == 0) & (m.spins == 0)
    step = jnp.where(m.enemy_color & 0xE == 2, 4, 2)
    return m.enemy_color - jnp.where(grown, step, 0) & 0xFE


def _cannon(m: Ram, zone_clock: jax.Array) -> Box:
    """The cannon at the left edge, and its shot, in lines of two rows."""
    rows = (m.cannon_y | 1) + 2 * np.arange(5)
    height = rows - m.cannon_y - jnp.where(rows < m.y, 1, 0)
    lit = (height >= 0) & (height <= 6)
    top = jnp.min(jnp.where(lit, rows, 255))
    step = jnp.where(m.leftward == 1, -6, 4)
    x = m.cannon_x + 1 - jnp.where(m.cannon_fired == 1, step, 0)
    stripe = (top ^ lookup(CODE, zone_clock + top)) & m.zone & 0xF6
    color = jnp.where(stripe > 0, stripe, CANNON_COLOR)
    late = jnp.where(x < _beam(52, top - m.y, 16, zone_clock + top), 3, 2)
    there = ((m.cannon_fired | m.cannon_armed) == 1) & (m.cannon_y < NO_CANNON)
    return box(
        x, top + late, 4 << m.cannon_wide, 2 * jnp.sum(jnp.where(lit, 1, 0)), there, color=color
    )


def _shield(m: Ram, clock: jax.Array) -> Box:
    """The blocks as they were drawn last, before the shield rotated."""
    turned = (m.rotates == 1) & ((clock & 3) < 2)
    row = jnp.where(turned, _turned_back(m.shield), m.shield)
    there = jnp.repeat(row, 8) >> COLUMNS & 1 == 1
    y = m.shield_y + jnp.where(ROWS == 0, 2, 1 + 8 * ROWS)
    return box(128 + 4 * COLUMNS, y, 4, np.where(ROWS == 0, 7, 8), there)


def _turned_back(shield: jax.Array) -> jax.Array:
    """The shield before its bits moved on: in odd rows from the top to the left, in others back."""
    odd = np.arange(16) % 2 == 1
    carry = jnp.roll(jnp.where(odd, shield >> 7, shield & 1), -1)
    return jnp.where(odd, shield << 1 & 255 | carry, shield >> 1 | carry << 7)


facing = functools.partial(Category, attributes=("orientation",))
between = functools.partial(display, blinks=True)  # shown between two rounds

# The Qotile is 18 rows high and has the Yar's colour now and then.
PLAYER_SHAPES = Shape(w=2, h=6), Shape(w=(4, 10), h=(8, 17))  # the former as it dissolves
PLAYER = Blobs(YAR, gap=(2, 3), shapes=PLAYER_SHAPES)
SHOT = Blobs(YAR, gap=(2, 3), shapes=Shape(w=1, h=(1, 2)))
ENEMY = Blobs(LIGHTS, (150, 0, 158, 195), Shape(w=8, h=(17, 18)))
SWIRL = Blobs(SWIRLS, gap=(1, 1), shapes=Shape(w=(6, 8), h=(10, 16)))
IN_ZONE = Blobs(
    tuple(c for c in LIGHTS if c & 8 and c not in (YAR, CANNON_COLOR)),
    ZONE,
    Shape(w=(1, 4), h=(1, 3)),
)
OTHERS = tuple(c for c in LIGHTS if c != YAR)
MISSILE = Blobs(OTHERS, shapes=Shape(w=(3, 4), h=(1, 3)), ignore=(ZONE,), also=(IN_ZONE,))
cannon = functools.partial(Blobs, gap=(0, 4), shapes=Shape(w=(3, 8), h=(4, 8)), ignore=(ZONE,))
CANNON = cannon((*DIM, CANNON_COLOR), (0, 0, 128, 195))
cells = functools.partial(Cells, whole=False, exclude=("Enemy", "Enemy_Missile"), floats=True)
BLOCKS = cells(SHIELDS, CELLS_X, CELLS_Y, 4, 8)
STRIPES = Bounds(DIM, ZONE, min_size=(28, 150))
TEXT = (YAR, YAR & 0xF7)  # in the screen saver the latter
POINTS = Bounds(TEXT, (55, 48, 103, 55), value=Digits(FONT, SCORE_LEFTS, 48, required=True))
LIVES = Bounds(TEXT, (95, 74, 103, 81), value=Digits(FONT, (95,), 74, required=True))

GAME = Game(
    name="YarsRevenge",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        facing("Player", PLAYER, doc="the Yar"),
        facing("Player_Bullet", SHOT, doc="its shot"),
        Category("Enemy", ENEMY, doc="the Qotile at rest"),
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
        between("Score", POINTS, doc="points"),
        between("Life", LIVES, doc="lives"),
    ),
)
