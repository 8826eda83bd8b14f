"""Assault: a cannon below a mother ship that sends enemies down in three rows.

Picture: docs/games/Assault.png

Screen: the mother ship's box includes its open bay. The rows of an enemy have different colours;
its colour is the last row's. The gauge is not valid until a new game colours it. The ground's line
is scenery.

Slots: Enemy is row * 2 + half, rows from the bottom; an enemy that comes down changes its row. An
intact enemy, also on a hit, has the slot of its left half and a box around both halves. A split
enemy has a box for each half. An enemy stays valid while it explodes, but not while its level hides
it.

RAM: ALE's source (score, lives), OCAtari 2.2 (positions, flags), and the ROM's code. Positions are
in the chip's coding. The game moves shots and cannon in the overscan, so the screen lags behind the
RAM. The last return address on the stack shows which of them the program has just moved or fired. A
row without enemies takes a line less, an explosion one more.

Covered: levels 1 to 24 (four kinds of enemies and shots), splits, explosions, deaths, overheating,
game over.

Not exact: the RAM lacks these facts: a shot on the frame on which it hits; a vanished shot that was
fired before the heat changed (every 32nd frame); the mother ship's row as its bay opens.

VEM: the box of a side shot that touches the cannon spans both.
"""

import functools
import operator
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from ocjax.authoring import (
    COARSE,
    Bitmap,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    Gauge,
    Icons,
    LivesAsIcons,
    NumberDisplay,
    RamMap,
    Rom,
    Run,
    Runs,
    Shape,
    among,
    bcd,
    bits,
    box,
    byte,
    choose,
    display,
    div,
    edges,
    flag,
    lookup,
    match,
    mod,
    packed_position,
    pick,
    when,
)

ROM = Rom("assault", "de78b3a064d374390ac0710f95edde92")
FONT = ROM.font(0xE00, rows=8)

SCORE = NumberDisplay(FONT, right=103, top=2, digits=6, leading_zeros=True)
SPARE = Icons(left=15, top=192, size=(8, 8), pitch=16, count=3)  # cannons

NO_ENEMY = (0xFD, 0xFF)  # `drawn_last`: pages of the empty picture, of explosions
NO_CANNON = 0xFD  # page of `picture`: empty
SMALL_CANNON = 0xFFE2  # `picture`


class Level:  # of `Ram.level`, by the enemies' shots
    SHORT_BEAMS = 0
    TALL_BEAMS = 1
    FIREBALLS = 2
    LOW_FIREBALLS = 3


class SideWay:  # of `Ram.side_way`
    LEFT = 1
    RIGHT = 2


class Call:  # of `Ram.last_call`: the program's last action after it drew the frame
    FIRED_RIGHT = 0xF771
    FIRED_LEFT = 0xF786
    CANNON_RIGHT = 0xF7A8
    CANNON_LEFT = 0xF7BC


SIDE_SHOT = 88  # `side_shot` while it is drawn
# Steps of a shot to the side.
LEFT_END = 32
RIGHT_END = 181
SIDE_STEP = 3
HIT_SOUND = 29  # `sound` on the last frame that shows the enemy whole
BAY_SOUND_END = 23  # `sound` on the last frame that shows the bay open

# By slot of the enemies.
ROW_OF_ENEMY = np.arange(6) >> 1
RIGHT_HALF = (np.arange(6) & 1) == 1
HALF_BIT = np.where(RIGHT_HALF, 1, 2)

ROW_HEIGHT = 25  # lines
LOWEST_ROW = 94  # its first line

# Shots upwards and beams begin and end at counts of lines: 18 per row of enemies and all lines
# below. The chip gets them at a certain column; left of it, they begin and end a line later.
ROW_COUNTS = 18  # counts of a row of enemies
ROW_LINES = 8  # drawn lines
FIRST_COLUMN = 5  # of a row
ROW_COLUMN = 56  # of its next lines
CANNON_COLUMN = 26  # below
LAST_BLOCK = 13  # `BLOCK_LINES` counts each; the cannon's shot rises in them
BLOCK_LINES = 8
CANNON_COUNT = 106  # of the cannon's first line
GROUND_TOP = 186  # a row
SHOT_SOUND_END = 15  # least `shot_sound` without a shot's sound
COLD = 2  # the least heat, which is constant
HOT = 16  # the most heat
BEAM_STARTS = 60  # `beam_y` above this: the beam has left the enemy
HIGH_STARTS = 4  # `fireball_y` above this: the fireball has left the enemy
LOW_STARTS = 84  # the same in the last level

COLORS = ROM.bytes(0xF00, 256)  # of the last rows of enemies
SHIP_ROW = 4  # of the mother ship: a row of its main colour
SHIP_COLORS = (198, 86)  # alternating
WHITE = 14
GOLD = 40
GRAY = 8
HEAT_COLORS = (198, 70)
SHIP = (198, 38, 24, 146, 114, 214, 150, 148, 82, 86, 194, 196, WHITE)
CANNON_COLORS = (12, 22, 134)
ENEMY_SHOTS = (24, 152, 200, 72)
CANNON_RGB = (214, 214, 214)  # colour of most pixels of its usual picture
ENEMIES = (38, 52, 66, 198, 214, 146, 24, 72, 70, 22, 20, 148, 150, 152, 18, 242, 244, 246, 248)
SKY_ROW = 12  # between the score and the mother ship
ROWS = (0, 45, 160, 120)
BELOW = (0, 120, 160, 186)
GROUND = (0, 178, 160, 186)


class Ram(RamMap):
    score = bcd((0, 1, 2))
    x = byte(16)  # x + 22 in the chip's coding; already moved on
    roll_x = byte(17)  # x + 22 of fireballs, in the chip's coding
    side_x = byte(18)  # x + 23 of the shot to the side, in the chip's coding; already moved on
    beam_x = byte(19)  # x + 23 of beams, in the chip's coding
    heat_color = byte(21)
    rolls = flag(22, bit=7)  # a fireball rolls along the ground
    side_shot = byte(24)
    side_way = bits(26, first=6, count=2)
    heat = byte(28, 29)  # a bit per unit
    picture = byte((31, 30))  # of the cannon, a pointer
    enemy_x = byte(33, 36, 34, 37, 35, 38)  # x + 22 in the chip's coding, by slot
    missile_x = byte(39)  # x + 23 in the chip's coding
    enemy_colors = byte(40)  # index in `COLORS` for this level
    hides = flag(42, bit=7)
    bob = bits(43, count=4)  # rows
    drawn_last = byte(47)  # page of the picture of the lowest enemy's right half
    is_split = flag(54, 55, 56, bit=5)  # by row
    halves = bits(54, 55, 56, first=6, count=2)  # of the enemy in each row; 2 left, 1 right
    shot_sound = byte(62)  # its next note
    sound = byte(63)
    rises = flag(66, bit=7)  # the cannon's shot flies up
    missile_y = byte(67)  # lines
    ship_x = byte(68)  # x + 21 in the chip's coding
    ship_y = bits(71, count=4)  # y - 15
    shot_color = byte(72)  # of enemies
    fireball_y = byte(73)  # lines
    falls = flag(75, bit=7)  # an enemy's shot
    lives = byte(101)
    frame = byte(103)  # of the next frame
    level = bits(104, count=2)
    to_come = bits(105, count=4)  # enemies that the mother ship will still set off
    opens = flag(105, bit=7)  # the bay
    blast_row = bits(106, count=2)
    blast_time = bits(106, first=2, count=4)
    blast_halves = bits(106, first=6, count=2)  # 2 left, 1 right
    open_time = byte(107)
    beam_y = byte(110)  # lines
    demo = flag(112, bit=7)
    last_call = byte((127, 126))  # return address, below the end of the stack


def decode(m: Ram) -> dict[str, Box]:
    cannon = _cannon_box(m)
    return {
        "Player": cannon,
        "MotherShip": _mother_ship(m),
        "Enemy": _enemy_boxes(m),
        "PlayerMissileVertical": _missile(m, cannon),
        "PlayerMissileHorizontal": _side_shot_box(m),
        "EnemyMissile": _enemy_shot(m),
        "PlayerScore": SCORE.box(m.score),
        "Lives": _life_boxes(m),
        "Health": _heat_gauge(m),
    }


def _cannon_box(m: Ram) -> Box:
    small = m.picture == SMALL_CANNON
    back = match(
        (m.last_call == Call.CANNON_RIGHT, -2), (m.last_call == Call.CANNON_LEFT, 2), otherwise=0
    )
    x = packed_position(m.x) - 22 + back + when(small, 2)
    return box(x, 178, jnp.where(small, 4, 8), 8, m.picture >> 8 != NO_CANNON)


def _mother_ship(m: Ram) -> Box:
    has_closed = ~m.opens & (m.open_time == 0) & (m.sound == BAY_SOUND_END)
    has_bay = (m.opens & (m.open_time > 0)) | has_closed
    has_opened = m.opens & (m.open_time == 0)
    y = 15 + jnp.where(has_opened, 3, m.ship_y)
    height = jnp.where(has_bay, 21, 16)
    color = pick(m.level & 1, SHIP_COLORS)
    return box(packed_position(m.ship_x) - 21, y, 32, height, color=color)


def _has_been_hit(m: Ram) -> tuple[jax.Array, jax.Array]:
    """True if an enemy is hit; True if the hit is on this very frame."""
    hit = m.blast_halves > 0
    return hit, hit & (m.blast_time == 0) & (m.sound == HIT_SOUND)


def _new_enemy(m: Ram) -> jax.Array:
    """True if the mother ship has set off an enemy after the frame was drawn."""
    return (m.open_time == 0) & m.opens


def _enemy_boxes(m: Ram) -> Box:
    hit, just_hit = _has_been_hit(m)
    is_split = jnp.repeat(m.is_split, 2)
    struck_half = (m.blast_halves & HALF_BIT) != 0
    struck = hit & (m.blast_row == ROW_OF_ENEMY) & (~is_split | struck_half)
    bursts = struck & ~just_hit
    left, top, width, height = _enemy_pictures(m, is_split, bursts)
    tops = _row_tops(m)
    y = jnp.repeat(jnp.where(_has_come_down(m), jnp.roll(tops, -1), tops), 2) + top
    there = (jnp.repeat(m.halves, 2) & HALF_BIT) != 0
    visible = ~m.hides | bursts
    own_box = (is_split | ~RIGHT_HALF) & ~((ROW_OF_ENEMY == 2) & _new_enemy(m))
    valid = (there | struck) & visible & own_box
    color = lookup(COLORS, m.enemy_colors)
    return box(left, y, width, height, valid, color=color)


def _enemy_pictures(m: Ram, is_split: jax.Array, bursts: jax.Array) -> tuple[jax.Array, ...]:
    """Left, first row, width and height of the enemies' two pictures together."""
    clock = m.frame - 1
    second = (clock & 16) != 0
    narrow_burst = bursts & ((clock & 4) == 0)
    narrow = narrow_burst | (~is_split & ~bursts & second & (m.level >= Level.FIREBALLS))
    inset = when(narrow, 2)
    whole_kind = (m.level == Level.SHORT_BEAMS) | (m.level == Level.FIREBALLS)
    first_row_empty = is_split & ~bursts & ~second & ~whole_kind
    last_row_empty = is_split & ~bursts & second & (m.level == Level.LOW_FIREBALLS)
    height = jnp.where(first_row_empty | last_row_empty, 7, 8)
    x = packed_position(m.enemy_x) - 22
    last = jnp.where(RIGHT_HALF | is_split, x, jnp.roll(x, -1)) + 8
    return x + inset, when(first_row_empty, 1), last - x - 2 * inset, height


def _has_come_down(m: Ram) -> jax.Array:
    """True for rows that took over the enemy of the row above since the frame was drawn.

    The game drew the lowest row last, and without an enemy then. If another enemy is below the
    middle row, the last enemy of all enters that row undetected.
    """
    there = m.halves > 0
    left = m.enemy_x[0::2]
    right = m.enemy_x[1::2]
    same_place = (left[:2] == left[1:]) & (right[:2] == right[1:])
    rests = (m.open_time == 0) & ~m.opens
    was_empty = jnp.stack([among(m.drawn_last, NO_ENEMY), (m.to_come > 0) | ~there[0]])
    return jnp.append(rests & there[:2] & ~there[1:] & same_place & was_empty, False)


def _row_tops(m: Ram) -> jax.Array:
    """The drawn top lines of the three rows: empty rows are shorter, an explosion is longer."""
    row = np.arange(3)
    hit, just_hit = _has_been_hit(m)
    came_down = _has_come_down(m)
    in_row = (m.halves > 0) & ~came_down & (~_new_enemy(m) | (row < 2)) | jnp.roll(came_down, 1)
    drawn = in_row | (just_hit & (m.blast_row == row))
    empty = jnp.where(drawn, 0, 1)
    fewer = jnp.stack([jnp.sum(empty), empty[1] + empty[2], empty[2]])
    # The explosion of an intact enemy takes a line more, from its own row down.
    whole_hit = hit & ~jnp.any(m.is_split & (m.blast_row == row))
    longer = whole_hit & (jnp.where(just_hit, m.blast_row - 1, m.blast_row) >= row)
    return LOWEST_ROW + m.bob - ROW_HEIGHT * row - fewer + when(longer, 1)


def _first_line(m: Ram, count: jax.Array, x: jax.Array, tops: jax.Array) -> jax.Array:
    """The first screen line that shows, at column x, a change at a count of lines."""
    turns = [count - (2 - row) * ROW_COUNTS - m.bob for row in range(3)]
    in_rows = [_line_in_row(turn, x) + top for turn, top in zip(turns, tops, strict=True)]
    cases = [(turn < ROW_LINES, line) for turn, line in zip(turns, in_rows, strict=True)]
    return match(*reversed(cases), otherwise=_line_below(count, x))


def _line_in_row(turn: jax.Array, x: jax.Array) -> jax.Array:
    """The same relative to the first line of a row of enemies, at a count from there."""
    column = jnp.where(turn > 0, ROW_COLUMN, FIRST_COLUMN)
    return jnp.maximum(turn, 0) - 1 + when(x < column, 1)


def _line_below(count: jax.Array, x: jax.Array) -> jax.Array:
    """The same below the enemies. One line above the cannon does not count."""
    at_cannon = 1 + when(x < CANNON_COLUMN, 1)
    return count + 71 + when(count >= CANNON_COUNT, at_cannon)


def _missile(m: Ram, cannon: Box) -> Box:
    """The cannon's shot upwards."""
    block = div(m.missile_y, BLOCK_LINES)
    x = packed_position(m.missile_x) - 23
    tops = _row_tops(m)
    top = _first_line(m, BLOCK_LINES * block, x, tops)
    next_top = _first_line(m, BLOCK_LINES * (block + 1), x, tops)
    covered = (x > cannon.x) & (x < cannon.x + 7)  # the cannon covers the last line
    bottom = jnp.where(block == LAST_BLOCK, GROUND_TOP - when(covered, 1), next_top)
    there = m.rises & (block > 0) & (block <= LAST_BLOCK)
    return edges(x, top, x + 1, bottom, there)


def _side_shot_box(m: Ram) -> Box:
    """The cannon's shot to the side, before its last step; steps are 16 for 15 pixels.

    If the screen shows a shot while another was just fired, the shown one had reached its end, on
    the new one's side.
    """
    steps = 16 * (m.side_x & 15) + (m.side_x >> 4 ^ 7)
    rightmost = RIGHT_END - mod(RIGHT_END - steps, SIDE_STEP)
    leftmost = LEFT_END + mod(steps - LEFT_END, SIDE_STEP)
    before_right = jnp.where(m.last_call == Call.FIRED_RIGHT, rightmost, steps - SIDE_STEP)
    before_left = jnp.where(m.last_call == Call.FIRED_LEFT, leftmost, steps + SIDE_STEP)
    drawn_steps = match(
        (m.side_way == SideWay.LEFT, before_left),
        (m.side_way == SideWay.RIGHT, before_right),
        otherwise=steps,
    )
    x = COARSE * (drawn_steps >> 4 & 15) + (drawn_steps & 15)
    return box(x - 23, 181, 4, 2, m.side_shot == SIDE_SHOT)


def _enemy_shot(m: Ram) -> Box:
    is_beam = m.level <= Level.TALL_BEAMS
    either = choose(is_beam, _beam(m), _fireball(m))
    rolls = m.rolls
    shot = replace(either, valid=rolls | m.falls & either.valid, color=m.shot_color)
    return shot.clip(0, 125, 160, GROUND_TOP)


def _beam(m: Ram) -> Box:
    x = packed_position(m.beam_x) - 23
    lines = jnp.where(m.level == Level.TALL_BEAMS, 32, 8)
    first = (m.beam_y - 6) & -lines
    top = _line_below(first, x)
    bottom = _line_below(first + lines, x)
    return edges(x, top, x + 1, bottom, m.beam_y > BEAM_STARTS)


def _fireball(m: Ram) -> Box:
    """A fireball that falls, or rolls along the ground."""
    high = m.level == Level.FIREBALLS
    y = jnp.where(m.rolls, 178, m.fireball_y + jnp.where(high, 101, 29))
    started = m.fireball_y > jnp.where(high, HIGH_STARTS, LOW_STARTS)
    return box(packed_position(m.roll_x) - 22, y, 8, jnp.where(high, 16, 8), started)


def _life_boxes(m: Ram) -> Box:
    return SPARE.box(m.lives - 1)


def _heat_gauge(m: Ram) -> Box:
    heat = _shown_heat(m)
    return box(96, 192, 4 * heat, 8, m.heat_color > 0, value=heat, color=m.heat_color)


def _shown_heat(m: Ram) -> jax.Array:
    """Units of heat on the screen; every 32nd frame changes them after the drawing.

    They rise if a shot was fired since the last change. That shot often still flies or sounds.
    """
    heat = jnp.sum(lax.population_count(m.heat))
    fired = m.rises | (m.side_way > 0) | (m.shot_sound < SHOT_SOUND_END) | (heat == HOT)
    changed = ((m.frame & 31) == 1) & (heat > COLD) & ~m.demo
    return heat + when(changed, jnp.where(fired, -1, 1))


def _not_sky(mask: Bitmap, planes: jax.Array) -> Bitmap:
    """The pixels of the mask that differ from the sky, which flashes when a cannon is lost."""
    sky = -(planes[:, :1, SKY_ROW : SKY_ROW + 1] & 1)  # column 31
    return mask & functools.reduce(operator.or_, planes ^ sky)


PLAYER = Blobs(CANNON_COLORS, GROUND, Shape(w=(4, 8), h=(7, 8)))
# Finds the cannon by its wheels if a shot hides its top.
WHEELS = Run(CANNON_COLORS, 185, left=(0, 159), width=6, height=1, before=1, above=7, after=1)
BESIDE_SHOT = Runs((WHEELS,), most=1)
CARRIER = Bounds(SHIP, (0, 12, 160, 45), filters=(_not_sky,))
ENEMY = Blobs(ENEMIES, ROWS, Shape(w=(4, 16), h=(6, 8)), gap=(4, 0), filters=(_not_sky,))
SIDE = Bounds(CANNON_COLORS, (0, 181, 160, 183), exclude=("Player",), filters=(_not_sky,))
UPWARD = Bounds(WHITE, (0, 45, 160, 186), filters=(_not_sky,))
DROPPED = Bounds(ENEMY_SHOTS, BELOW, filters=(_not_sky,))
POINTS = SCORE.rule(GOLD, (50, 0, 110, 12))
HEALTH = Bounds(HEAT_COLORS, (90, 190, 160, 204), value=Gauge(4))

GAME = Game(
    name="Assault",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(lives=(LivesAsIcons(("Lives",), hidden=1),)),
    backdrop=(8, 158),
    categories=(
        Category(
            "Player", PLAYER, otherwise=BESIDE_SHOT, rgb=CANNON_RGB, role="player", doc="the cannon"
        ),
        Category("MotherShip", CARRIER, color_row=SHIP_ROW, doc="above, with its open bay"),
        Category("Enemy", ENEMY, count=6, color_row=-1, doc="row from the bottom * 2 + half"),
        Category("PlayerMissileVertical", UPWARD, doc="its shot up"),
        Category("PlayerMissileHorizontal", SIDE, doc="its shot to the side"),
        Category("EnemyMissile", DROPPED, doc="beams, fireballs, rolling ones"),
        display("PlayerScore", POINTS, role="score", doc="six digits"),
        display(
            "Lives",
            SPARE.rule(GRAY),
            count=SPARE.count,
            attributes=(),
            role="lives",
            doc="spare cannons",
        ),
        display("Health", HEALTH, doc="heat; value: of 16"),
    ),
)
