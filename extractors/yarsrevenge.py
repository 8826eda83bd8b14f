"""Yars' Revenge: an insect nibbles at the Qotile's shield and shoots it with the Zorlon cannon.

Picture: docs/games/YarsRevenge.png

Screen: the game draws the shield on one frame and the neutral zone, Barrier, on the next, with the
missiles and the cannon. An object that the game skips on a frame keeps its last box. Score and Life
are shown between two rounds; they stay valid and keep their values. The Qotile is an Enemy until it
becomes a Swirl. The explosion of the Qotile, which fills the screen, is scenery. The stripes of the
zone and the cannon have different colours; the first stripe gives the object's colour.

Slots: a shield block has the slot row * 8 + column, from the top left.

RAM: D. Debro's disassembly (meaning of bytes), ALE's source (score, lives), and the ROM's code.

Timeline of a frame:
    f7a1-fcb0    all objects move
    then         one kernel draws: f000 the shield on even frames, f06c the zone on odd frames, or
                 f0d6 the explosion, f11c the score
    after it     HMOVE takes effect, so the drawn columns are those before the last move
Timeline of a line: the program turns the missile or the ball on or off at a cycle (`Cycle`). Four
cycles later on lines below the picture in front of it, six later on lines of that picture, and one
more if its table crosses a page. Objects left of the beam then show a line later.

Covered: all modes and difficulties, both shields, the cannon, rounds without the zone.

Not exact, up to 4 columns off: a Yar that has just reached the edge, or that the shield threw back
(7 columns if a shot flew, because the ROM compares the shot with the shield next, f41b, and
overwrites the traces of the throw); a moving Yar that a missile hit while a shot flew (the shot
uses the byte of the Yar's last move, too); the column of a shot fired on the frame on which the
previous one left the screen (f8e8 keeps the old column, 3 of 100 shots); a fast swirl in its first
frames; shield blocks, missile and swirl on the frame of a hit; the swirl as it leaves the screen,
because the RAM already has it at home. The colour of the swirl, if the cannon shot down its missile
(f34d, at difficulty A), and of the Qotile in the first eight frames of a life.

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
    Word,
    among,
    bcd,
    bits,
    box,
    byte,
    display,
    flag,
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
MISSILE_WIDTH = 4
CANNON_LINES = 7  # of two rows
MUZZLE = 4  # columns from the Yar to its shot
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


ZONE_WORD = Word(height=8, top=8, color=8)  # visible rows, and the colour of the first stripe


def _rows_of_zone(clock: int) -> int:
    """The zone's visible stripes, as a `ZONE_WORD`."""
    seen = []
    colors = []
    for row in range(1, 193, 2):
        lit = (row ^ ROM.bytes(clock + row, 1).item()) & STRIPE_BITS
        if lit:
            lower = ~(row + 1) & 255
            second_lit = (lower ^ ROM.bytes(clock + lower, 1).item()) & 254
            colors.append(lit)
            seen.extend([row, row + 1] if second_lit else [row])
    height = seen[-1] - seen[0] + 1
    return int(ZONE_WORD.pack(height=height, top=seen[0] + 2, color=colors[0]))


CODE = ROM.bytes(0, 512)  # the program's bytes; the game makes the stripes from them
ZONE_ROWS = [_rows_of_zone(clock) for clock in range(256)]


def _double(start: int, height: int) -> np.ndarray:
    """A picture with two lines per row."""
    return np.repeat(ROM.rows(0xF00 + start + 1, height), 2)


FIRST_COLUMN_DOT = 68  # dots of a line, three per cycle, before the first column


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


class Cycle:  # of a line: the program turns these on or off
    SHOT = 39
    MISSILE = 45
    CANNON = 52
    BESIDE_PICTURE = 6  # later in the lines of the picture in front
    BELOW_PICTURE = 4  # later below it


class Explosion:  # of `Ram.explosion`
    RUNS = 64  # a bit
    HIT = 192  # on the frame of a hit


YARS = Pictures.of([_double(look, 8) for look in range(256)])
ENEMIES = Pictures.of([_double(look, 9 if look == EnemyLook.QOTILE else 8) for look in range(256)])


class Ram(RamMap):
    saver_mask = byte(114)  # of the colour of the score: 247 in the screen saver
    variation = bits(0, count=3)  # of the game
    trenches = flag(0, bit=5)  # later rounds: the swirl flies at any time
    shield = byte(*range(16, 0, -1))  # its rows from the top; the lowest bit is the left column
    zone = byte(17)  # its columns; 0: no zone
    speed = byte(18)  # of the missile
    enemy_heading = low(20)
    flies = flag(20, bit=6)  # the swirl
    spins = flag(20, bit=7)
    rotates = flag(20, bit=4)  # the shield
    status = bits(21, count=3)
    cannon_fired = flag(22, bit=5)
    cannon_armed = flag(22, bit=6)
    shot_flies = flag(22, bit=4)
    shot_heading = low(22)
    dies = flag(23, bit=7)
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
    cannon_wide = flag(53, bit=4)
    missile_flies = flag(53, bit=7)
    missile_part = byte(54)  # 1 / 256 of a step
    score = bcd((96, 97, 98))
    enemy_color = byte(104)  # of the Qotile and its missile
    next_clock = byte(105)  # frames
    leftward = flag(107, bit=7)  # the cannon's shot comes back
    stack = byte(126)


class Frame(NamedTuple):
    """The content of the frame."""

    score: jax.Array  # whether it shows the score, between two rounds
    play: jax.Array  # whether it shows play, without an explosion
    clock: jax.Array
    odd: jax.Array  # True: the zone was drawn, False: the shield was drawn
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
    clock = (m.next_clock - 1) & 0xFF
    odd = match(
        (among(m.stack, (*Stack.LIFE_LOST, Stack.SHIELD_DRAWN)), False),
        (m.stack == Stack.ZONE_DRAWN, True),
        otherwise=(clock & 1) == 1,
    )
    return Frame(
        score=shows_score,
        play=~shows_score & ~explodes,
        clock=clock,
        odd=odd,
        zone_clock=((clock - 1) & 0xFF) | 1,
    )


def _before(m: Ram) -> jax.Array:
    """The Yar's column before its last move, also the column of a waiting shot."""
    step = when(m.moving > 0, pick(m.heading, STEPS_X))
    moved = (m.x + step >= LEFT_EDGE) & (m.x + step <= RIGHT_EDGE)
    at_shot = m.shot_x - MUZZLE
    near = jnp.abs(at_shot - m.x) <= MUZZLE
    shot_waits = ~m.shot_flies & ~among(m.stack, Stack.SHOT_HIT) & near
    return jnp.where(shot_waits, at_shot, m.x - when(moved, step))


def _player_box(m: Ram, frame: Frame) -> Box:
    """The Yar, one move back if a missile hit it, because f645 clears HMP1."""
    by_shot = m.dies & ~m.shot_flies & (m.last_move == m.x + 12)
    thrown = among(m.stack, Stack.THROWN_BACK) | by_shot
    gone = among(m.stack, Stack.LIFE_LOST)
    ends = m.dies | gone
    halted = ends & ~m.missile_flies & among(m.last_move, YAR_MOVES)
    before_halt = jnp.where(frame.odd, _before(m), m.x + when(thrown, 7))
    x = before_halt + when(halted, signed_nibble(m.last_move >> 4))
    look = jnp.where(gone, LAST_PICTURE, m.look)
    west = (m.heading & 8) == 0
    yar = YARS.box(look, x, m.y + 3, mirrored=west, orientation=_compass(m.heading))
    return yar.where(~frame.score)


def _compass(heading: jax.Array) -> jax.Array:
    return (8 - heading) & 15


def _beam_x(
    cycle: int, below: jax.Array, height: jax.Array | int, table_at: jax.Array
) -> jax.Array:
    """The beam's column when the program turns a missile or the ball on or off.

    Args:
        cycle: see `Cycle`.
        below: lines from the top of the picture in front of the object.
        height: of that picture.
        table_at: place in the zone's table; from 256 on it is in the next page.
    """
    late = match(
        (below < 0, 0), (below < height, Cycle.BESIDE_PICTURE), otherwise=Cycle.BELOW_PICTURE
    )
    return 3 * (cycle + late + when(table_at > 0xFF, 1)) - FIRST_COLUMN_DOT


def _beam_on_even(m: Ram, frame: Frame, row: jax.Array, cycle: int) -> jax.Array:
    """The same on an even row; the Qotile or the swirl is in front."""
    height = jnp.where(m.enemy_look == EnemyLook.QOTILE, 18, 16)
    return _beam_x(cycle, row - m.enemy_y, height, frame.zone_clock + (~row & 0xFF))


def _shot_box(m: Ram, frame: Frame) -> Box:
    """The Yar's shot; on its first frame it is in front of the Yar. It moves on every frame."""
    dx = pick(m.shot_heading, STEPS_X)
    dy = pick(m.shot_heading, STEPS_Y)
    moved_x = m.shot_x - when(~frame.odd, dx)
    y = m.shot_y - when(~frame.odd, dy)
    at_muzzle = (moved_x == _before(m) + MUZZLE) & (y == ((m.y + 6) & ~1))
    flies = m.shot_flies | among(m.stack, Stack.SHOT_HIT)
    there = flies & ~at_muzzle & ~m.dies & frame.play
    x = moved_x - dx
    late = jnp.where(x < _beam_on_even(m, frame, y, Cycle.SHOT), 3, 2)
    return box(x, y + late, 1, 2, there, orientation=_compass(m.shot_heading))


def _enemy_box(m: Ram, frame: Frame) -> Box:
    """The Qotile or the swirl, which rests when its pictures begin again.

    It starts when the clock is at 0 or 128. A swirl farther away than its slow speed allows is
    fast. If it spins from the start of a life on, no missile flies (fb07), and it keeps the Yar's
    colour, in which the score was drawn: only a Qotile at rest gets its own colour (fbb3).
    """
    begins = (m.enemy_look == EnemyLook.FIRST_SWIRL) & ~frame.odd
    rests = ~m.flies | (m.enemy_x == HOME_X) | m.dies | begins
    slow = pick(m.enemy_heading, STEPS_X)
    slow_way = (frame.clock & 127) * -slow
    too_far = HOME_X - m.enemy_x > slow_way
    fast = (m.variation > 1) & ~m.trenches & too_far
    step = match((rests, 0), (fast, pick(m.enemy_heading, FAST_DX)), otherwise=slow)
    enemy = ENEMIES.box(m.enemy_look, m.enemy_x - step, m.enemy_y + 3)
    keeps_yar_color = m.spins & ~m.missile_flies & ~m.dies
    color = jnp.where(keeps_yar_color, YAR_COLOR, m.enemy_color & ~1)
    return replace(enemy.where(frame.play), color=color)


def _missile_box(m: Ram, frame: Frame) -> Box:
    """The missile that follows the Yar; it moves on frames on which it is not drawn."""
    moved = (m.missile_part < pick(m.speed, DELAYS)) & ~frame.odd
    x = m.missile_x + when(moved, jnp.sign(m.missile_x - m.x - 2))
    y = m.missile_y + when(moved, 2 * jnp.sign(m.missile_y - m.y - 8))
    beam = _beam_on_even(m, frame, y, Cycle.MISSILE)
    is_left = x <= beam - MISSILE_WIDTH
    is_cut = ~is_left & (x < beam)  # the beam is inside
    late = jnp.where(is_left, 3, 2)
    height = jnp.where(is_cut, 3, 2)
    there = m.missile_flies & (m.missile_x != LAUNCH_X) & ~m.dies & frame.play
    return box(x, y + late, MISSILE_WIDTH, height, there, color=_missile_color(m, frame))


def _missile_color(m: Ram, frame: Frame) -> jax.Array:
    """The colour of the last drawing; it grows every 8 frames, but is never black."""
    has_grown = ~frame.odd & ((frame.clock & 7) == 0) & ~m.spins
    would_be_black = (m.enemy_color & 14) == 2
    growth = jnp.where(would_be_black, 4, 2)
    return (m.enemy_color - when(has_grown, growth)) & 0xFE


def _barrier(m: Ram, frame: Frame) -> Box:
    seen = ZONE_WORD.unpack(lookup(ZONE_ROWS, frame.zone_clock))
    there = frame.play & (m.zone > 0)
    return box(52, seen.top, 28, seen.height, there, color=seen.color)


def _cannon_box(m: Ram, frame: Frame) -> Box:
    """The cannon at the left edge, and its shot, in lines of two rows."""
    rows = (m.cannon_y | 1) + 2 * np.arange(5)
    line = rows - m.cannon_y - when(rows < m.y, 1)
    lit = (line >= 0) & (line < CANNON_LINES)
    top = jnp.min(jnp.where(lit, rows, 255))
    height = 2 * jnp.sum(when(lit, 1))
    moved = when(m.cannon_fired, jnp.where(m.leftward, -6, 4))
    x = m.cannon_x + 1 - moved
    table_at = frame.zone_clock + top
    stripe = (top ^ lookup(CODE, table_at)) & m.zone & STRIPE_BITS
    color = jnp.where(stripe > 0, stripe, CANNON_COLOR)
    late = jnp.where(x < _beam_x(Cycle.CANNON, top - m.y, 16, table_at), 3, 2)
    width = jnp.where(m.cannon_wide, 8, 4)
    exists = (m.cannon_fired | m.cannon_armed) & (m.cannon_y < NO_CANNON)
    return box(x, top + late, width, height, exists & frame.play, color=color)


def _shield_boxes(m: Ram, frame: Frame) -> Box:
    """The last drawn blocks, before the shield rotated."""
    turned = m.rotates & ((frame.clock & 3) < 2)
    row = jnp.where(turned, _turned_back(m.shield), m.shield)
    lit = (jnp.repeat(row, 8) >> COLUMNS & 1) == 1
    round_begins = ~m.missile_flies & ~m.dies & ~m.spins & frame.odd
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

# The Qotile and the swirl at times have the Yar's colour. The Qotile is 18 rows high. With the gaps
# filled, the swirl's pictures have 138 and 140 pixels, and the Yar's at least 141.
SWIRL_SHAPES = Shape(w=8, h=16, pixels=138), Shape(w=8, h=16, pixels=140)
PLAYER_SHAPES = (
    Shape(w=2, h=6),  # while it dissolves
    Shape(w=(4, 7), h=(8, 17)),
    Shape(w=8, h=(8, 15)),
    Shape(w=8, h=16, pixels=(1, 137)),
    Shape(w=8, h=16, pixels=139),  # covered
    Shape(w=8, h=16, pixels=(141, 256)),
    Shape(w=8, h=17),
    Shape(w=(9, 10), h=(8, 17)),
)
yar_colored = functools.partial(Blobs, YAR_COLOR, gap=(2, 3))
PLAYER = yar_colored(shapes=PLAYER_SHAPES)
SHOT = yar_colored(shapes=Shape(w=1, h=(1, 2)))
ENEMY_FIGURE = Blobs(LIGHTS, (150, 0, 158, 195), Shape(w=8, h=(17, 18)))
YAR_COLORED_SWIRL = yar_colored(shapes=SWIRL_SHAPES)
SWIRL = Blobs(SWIRLS, gap=(1, 1), shapes=Shape(w=(6, 8), h=(10, 16)), also=(YAR_COLORED_SWIRL,))
IN_ZONE = Blobs(
    tuple(c for c in LIGHTS if c & 8 and c not in (YAR_COLOR, CANNON_COLOR)),
    ZONE,
    Shape(w=(1, 4), h=(1, 3)),
)
OTHERS = tuple(c for c in LIGHTS if c != YAR_COLOR)
MISSILE = Blobs(OTHERS, shapes=Shape(w=(3, 4), h=(1, 3)), ignore=(ZONE,), also=(IN_ZONE,))
cannon_rule = functools.partial(Blobs, gap=(0, 4), shapes=Shape(w=(3, 8), h=(4, 8)), ignore=(ZONE,))
CANNON = cannon_rule((*DIM, CANNON_COLOR), (0, 0, 128, 195))
BLOCKS = Cells(
    SHIELDS,
    CELLS_X,
    CELLS_Y,
    4,
    8,
    whole=False,
    exclude=("Enemy", "Enemy_Missile"),
    floats=(SHIELDS, max(CELLS_Y) + 8),
)
STRIPES = Bounds(DIM, ZONE, min_size=(28, 150))
TEXT = (YAR_COLOR, YAR_COLOR & 247)  # the second one in the screen saver

GAME = Game(
    name="YarsRevenge",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        mirrored={"Player_Bullet": None},
        rare=("Player", "Swirl"),  # in the same colour
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
