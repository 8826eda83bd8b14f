"""Space Invaders: 36 aliens, three shields that wear away, cannons, bombs and shots, the saucer.

Picture: docs/games/SpaceInvaders.png

Screen: the saucer's row hides the scores. P1Score stays valid at its position, because its value
follows the rewards at every step (until the display wraps at 10000). The `value` of a player is the
number of lives, which only Lives shows, before a life begins. The ground and its two coloured marks
are scenery.

Slots: Alien slots are row * 6 + column of the game's own bitmaps, rows from the bottom. When the
leftmost column is empty, the game moves all columns one to the left. An alien that was hit stays in
its slot during its explosion. Invisible invaders are not valid while the game hides them. Bullet
has the upper and the lower bomb (a new bomb starts above the old one), then the first and the
second player's shot. Bombs are drawn on even frames, shots on odd ones.

RAM: ALE's source, OCAtari 2.2, AtariARI, and the game's display program. It draws from positions in
the chip's coding (bytes 3-7), which stay unchanged while the positions (27-30) move on. The number
of lines between two steps of byte 9 varies, so bullets are 4 to 12 rows high.

Covered: later waves, landing, deaths, game over, all of ALE's modes, both players at once and
alternately.

Not exact, because the RAM does not have it: the difficulty switches. A cannon is 14 pixels wide at
difficulty 1, but boxes have 7. The ROM reads the switches when it draws (F1EB) and when a shot
leaves the cannon (FBC8), 4 pixels further right. Until then, two games that differ only in the
switch have the same RAM. Also missing: the part that a hit takes from a shield, on the frame of the
hit; the alien whose explosion ends on a frame; an upper bomb on the frame of its hit.

VEM: it reads a player's value only while Lives shows it, and misses parts of a bullet behind an
alien, a shield or a cannon.
"""

import functools
from dataclasses import dataclass

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
    NumberDisplay,
    RamMap,
    Rom,
    Saver,
    Shape,
    Variants,
    bcd,
    bits,
    box,
    byte,
    choose,
    display,
    flag,
    match,
    meanings_of_bits,
    packed_position,
    pick,
    when,
)

ROM = Rom("space_invaders", "72ffbef6504b75e69ee1045af9075f66")
FONT = ROM.font(0xF54, rows=5, dots=3, dot=(4, 2), pitch=16)  # all digits are equally wide

YELLOW = 20
RED = 52
PURPLE = 82
GREEN = 196
BROWN = 246
GRAY = 6
FIELD = (0, 22, 160, 195)
SCORES = (0, 8, 160, 22)
CANNONS = (0, 185, 160, 195)

SCORE_1 = NumberDisplay(FONT, right=64, top=10, digits=4, leading_zeros=True)
SCORE_2 = NumberDisplay(FONT, right=144, top=10, digits=4, leading_zeros=True)

ALIEN_ROW = np.arange(36) // 6  # by slot
ALIEN_COLUMN = np.arange(36) % 6  # by slot
ALIEN_X = 16  # pixels from one to the next
ALIEN_Y = 18
ALIENS_TOP = 31
SHORT_ROWS = (ALIEN_ROW == 2) | (ALIEN_ROW == 3)  # a row less in the first pose
SHIELD_ROWS = 9
SHIELDS_TOP = 157
SHIELDS_BOTTOM = SHIELDS_TOP + 2 * SHIELD_ROWS
SHIELD_LEFTS = (30, 62, 94)  # of the 32 columns of each, which moves in some modes
SHIELDS = tuple((left, SHIELDS_TOP, left + 32, SHIELDS_BOTTOM) for left in SHIELD_LEFTS)

NO_SAUCER = 180  # `saucer_x`
SAUCER_EXPLODES = 57  # these bits of `explosion`: row 7
DEATH_BEGINS = 129  # `clock` on this frame and the next
SAVER_SHOWN = 128  # least `saver_clock` with the screen saver
BLINK = 8  # bit of `clock`
GONE = 112  # least `y` without a bullet
LOWEST = 108  # above every `y` of a flying bullet
TOUCHED = 124  # `bullet_step` after a bullet hit something
# Steps of the bullet counter at the top of the screen, at the shields, at the ground.
SKY = 8
SHIELD_TOP = 73
SHIELD_END = 83
GROUND = 86


class Ram(RamMap):
    saucer_code = byte(3)  # x + 1 in the chip's coding, if a saucer was drawn
    shield_code = byte(5)  # x + 1 in the chip's coding
    cannon_code = byte(6, 7)  # x + 1 in the chip's coding
    bullet_clock = byte(9)  # counts down while the screen is drawn
    bullet_step = byte(10)
    second_pose = flag(11, bit=6)  # 0: 9 rows high, 1: 10
    drop = byte(16)  # y = 31 + 2 * drop
    rows = byte(*range(18, 24))  # bottom row first, one bit per column
    first_owner = flag(24, bit=2)  # owner of the shot in the first record
    cannon_1 = bits(24, first=4)  # the first player has one
    cannon_2 = bits(24, first=5)  # the second player has one
    shields_up = flag(24, bit=6)
    fallen = flag(24, bit=7)  # the invaders have landed
    aliens_x = byte(26)  # x + 1
    saucer_x = byte(30)  # already moved on
    starting = flag(42, bit=0)  # before a life: lives are shown, the cannon blinks
    died_2 = bits(42, first=1)
    died_1 = bits(42, first=2)
    demo = flag(42, bit=7)
    shields = byte(*range(43, 70))  # 9 rows each, top first
    saver_clock = byte(71)
    explosion = byte(72)  # stage * 64 + row * 8 + column; row 7: saucer
    lives = byte(73)
    clock = byte(74)  # counts frames down
    bomb_y = byte(81, 82)  # the lesser first
    bomb_x = byte(83, 84)  # x + 2
    shot_y = byte(85, 86)  # the lesser first
    shot_x = byte(87, 88)  # x + 2
    alien_color = byte(97)
    sky_color = byte(99)
    score = bcd((102, 104), (103, 105))
    saucer_points = byte(116, 117)  # hundreds just made by each player
    alien_points = byte(118, 119)  # tens just made by each player


def decode(m: Ram) -> dict[str, Box]:
    x_1, x_2 = packed_position(m.cannon_code) - 1
    saucer = _saucer_box(m)
    return {
        "Player": _cannon(m, x_1, m.cannon_1, m.died_1),
        "Player2": _cannon(m, x_2, m.cannon_2, m.died_2),
        "Alien": _alien_boxes(m),
        "Shield": _shield_boxes(m),
        "Satellite": saucer,
        "Bullet": _bullet_boxes(m, saucer.valid),
        "Lives": box(84, 185, 12, 10, m.starting & ~m.fallen, value=m.lives),
        "P1Score": SCORE_1.box(m.score[0]),
        "P2Score": SCORE_2.box(m.score[1], valid=~saucer.valid),
    }


def _odd(m: Ram) -> jax.Array:
    return (m.clock & 1) == 1


def _lowest_row(m: Ram) -> jax.Array:
    """The last drawn row of aliens."""
    return jnp.min(jnp.where(m.rows[:5] > 0, np.arange(5), 5))


def _cannon(m: Ram, x: jax.Array, there: jax.Array, died: jax.Array) -> Box:
    shows_death = (died == 1) & ((m.clock | 1) != DEATH_BEGINS)
    blank = m.starting & ((m.clock & BLINK) == 0)
    shown = (there == 1) & ~m.fallen & ~blank
    return box(x, 185, jnp.where(shows_death, 8, 7), 10, shown, value=m.lives)


def _alien_boxes(m: Ram) -> Box:
    # An alien that was hit on this frame is still drawn intact.
    just_hit = _odd(m) & ((m.alien_points[0] > 0) | (m.alien_points[1] > 0))
    was_hit = (m.explosion & 63) == 8 * ALIEN_ROW + ALIEN_COLUMN
    explodes = was_hit & (just_hit | (_lowest_row(m) <= ALIEN_ROW))
    alive = (jnp.repeat(m.rows, 6) >> ALIEN_COLUMN & 1) == 1
    x = m.aliens_x - 1 + ALIEN_X * ALIEN_COLUMN
    y = ALIENS_TOP + 2 * m.drop + ALIEN_Y * (5 - ALIEN_ROW)
    short = ~m.second_pose & SHORT_ROWS
    whole = box(x, y + when(short & (ALIEN_ROW == 3), 1), 8, jnp.where(short, 9, 10))
    visible = m.alien_color != m.sky_color
    aliens = choose(explodes & ~just_hit, _explosion(m, x, y), whole)
    return aliens.where((alive | explodes) & visible)


def _explosion(m: Ram, x: jax.Array, y: jax.Array | int) -> Box:
    """The picture at its stage, which advances after the drawing on every eighth frame."""
    drawn = m.explosion - when((m.clock & 7) == 0, 64)
    stage = drawn >> 6 & 3
    inset = when(stage == 0, 1)
    return box(x + inset, y + 2 * inset, 8 - 2 * inset, pick(stage, (5, 9, 10)))


def _saucer_box(m: Ram) -> Box:
    x = packed_position(m.saucer_code)
    just_hit = _odd(m) & ((m.saucer_points[0] > 0) | (m.saucer_points[1] > 0))
    moving = m.saucer_x != NO_SAUCER
    # Without a saucer, its register has the position of the bullets.
    leaving = x != jnp.where(_odd(m), m.shot_x[0], m.bomb_x[0])
    exploding = (m.explosion & SAUCER_EXPLODES) == SAUCER_EXPLODES
    explodes = jnp.where(moving, exploding & ~just_hit, (x > 1) & (x < 151))
    saucer = choose(explodes, _explosion(m, x - 1, 11), box(x - 1, 12, 7, 8))
    return saucer.where(~m.demo & (moving | leaving))


def _shield_boxes(m: Ram) -> Box:
    """Tight boxes around the remains of the shields."""
    lines = [m.shields[row::SHIELD_ROWS] for row in range(SHIELD_ROWS)]
    seen = list(enumerate(line > 0 for line in lines))
    top = match(*((shown, row) for row, shown in seen), otherwise=SHIELD_ROWS)
    bottom = match(*((shown, row + 1) for row, shown in reversed(seen)), otherwise=0)
    ink = functools.reduce(jnp.bitwise_or, lines)
    # Empty columns on the left and on the right.
    left = sum(when(ink < 256 >> column, 1) for column in range(1, 8))
    right = sum(when((ink & (1 << column) - 1) == 0, 1) for column in range(1, 8))
    x = packed_position(m.shield_code) - 1 + 32 * np.arange(3)
    there = (ink > 0) & m.shields_up
    y = SHIELDS_TOP + 2 * top
    h = 2 * (bottom - top)
    return box(x + left, y, 8 - left - right, h, there)


def _bullet_boxes(m: Ram, saucer: jax.Array) -> Box:
    bombs = jnp.where(_odd(m), m.bomb_y, _drawn_y(m, m.bomb_y))
    shots = jnp.where(_odd(m), _drawn_y(m, m.shot_y), m.shot_y)
    swapped = m.first_owner  # shots go to their owners' slots
    y = jnp.concatenate([bombs, jnp.where(swapped, shots[::-1], shots)])
    x = jnp.concatenate([m.bomb_x, jnp.where(swapped, m.shot_x[::-1], m.shot_x)]) - 2
    top = _first_line(m, Switch(y - 3, x, ending=False), saucer)
    bottom = _first_line(m, Switch(y + 1, x, ending=True), saucer)
    return box(x, top, 1, bottom - top, y < GONE)


def _drawn_y(m: Ram, y: jax.Array) -> jax.Array:
    """Drawn positions of the two bullets of this frame.

    The counter that ran down from a bullet's position gives the position of a bullet that hit
    something.
    """
    upper, lower = y
    untouched = m.bullet_step != TOUCHED
    last = (m.bullet_clock + 91) & 255
    only_touched = jnp.where(last > 121, last - 114, (last + 10) & 255)
    only = jnp.where(untouched, last, only_touched)
    below_touched = jnp.where(last > 124, last - 124, last)
    below = jnp.where(untouched, last + m.bullet_step, below_touched) & 255
    none = (upper >= GONE) & (lower >= GONE)
    one = (upper < GONE) & (lower >= GONE)
    top = jnp.where(none & (only > 7) & (only < LOWEST), only, upper)
    bottom = jnp.where(one & (below >= upper) & (below < LOWEST), below, lower)
    return jnp.stack([top, bottom])


@dataclass(frozen=True)
class Switch:
    """A switch of a bullet, on or off.

    The display program counts at some column of a line; left of it, a step shows one line later.
    The column depends on the other objects that the program draws there.
    """

    step: jax.Array  # of the bullet counter
    x: jax.Array  # column of the bullet
    ending: bool  # whether it ends; between rows an ending waits for the next line

    def late(self, column: int) -> jax.Array:
        """1 for bullets up to a column."""
        return (self.x <= column).astype(jnp.int32)

    def waiting(self, column: int) -> jax.Array:
        """`late`, or 1 at the end of a bullet."""
        return jnp.ones_like(self.x) if self.ending else self.late(column)


def _first_line(m: Ram, s: Switch, saucer: jax.Array) -> jax.Array:
    """The first screen line that shows a switch.

    Args:
        m: the RAM.
        s: the switch.
        saucer: whether a saucer replaces the scores.
    """
    since = s.step - m.drop - 11  # steps from the first row of aliens
    end = 51 - 9 * _lowest_row(m)
    beyond = match(
        (s.step > GROUND, 11 + s.late(111)),
        (s.step == GROUND, 10),
        (since < 0, _above_aliens(s, since)),
        (since < end, _among_aliens(s, since)),
        (m.shields_up & (s.step >= SHIELD_TOP), _at_shields(s)),
        (s.step == GROUND - 1, 9 + s.late(111)),
        (since == end, 9 + s.waiting(7)),
        otherwise=9 + s.waiting(66),
    )
    line = jnp.where((s.step <= SKY) & ~saucer, 23, 2 * s.step + beyond)
    return jnp.clip(line, jnp.where(saucer, 6, 23), 195)


def _above_aliens(s: Switch, since: jax.Array) -> jax.Array:
    """Lines beyond twice the step, as in the next functions."""
    return match(
        (since == -2, 9),
        (since == -1, 9 if s.ending else 8),
        (s.step == SKY, 7),
        (s.step < SKY, 6 + s.waiting(51)),
        otherwise=6 + s.waiting(69),
    )


def _among_aliens(s: Switch, since: jax.Array) -> jax.Array:
    phase = since % 9
    return match(
        (phase < 5, 11),
        (phase == 5, 10),
        (phase == 6, 9),
        (phase == 7, 9 + s.late(111)),
        otherwise=8 + s.waiting(117),
    )


def _at_shields(s: Switch) -> jax.Array:
    return match(
        (s.step == SHIELD_TOP, 10 + s.late(87 if s.ending else 84)),
        (s.step < SHIELD_END, 10),
        (s.step == SHIELD_END, 9 + s.late(57)),
        (s.step == SHIELD_END + 1, 9 + s.waiting(30)),
        otherwise=9 + s.late(87),
    )


player_category = functools.partial(Category, attributes=("value",))

CANNON_2 = Blobs(BROWN, CANNONS, Shape(w=(1, 8), h=(1, 10)), gap=(0, 1))
INVADERS = Blobs(YELLOW, FIELD, Shape(w=(1, 8), h=(1, 10)), gap=(0, 1))
BULLETS = Blobs(GRAY, (0, 8, 160, 195), Shape(w=1, h=(1, 14)), gap=(0, 4))
LIVES = Bounds(BROWN, (84, 185, 96, 195), min_size=(12, 10), value=Digits(FONT, (84,), 185))


def _saver_key(m: Ram) -> jax.Array:
    return jnp.where(m.saver_clock >= SAVER_SHOWN, m.saver_clock, -1)


GAME = Game(
    name="SpaceInvaders",
    rom=ROM,
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (10, 195), 226, mask=0xF7),
    checks=Checks(
        # The value of a cannon is on the screen before a life begins, in Lives.
        known={"Player": 0, "Player2": 0},
    ),
    variants=Variants(
        modes=meanings_of_bits(
            ("moving shields", "zigzagging bombs", "fast bombs", "invisible invaders"),
            otherwise="none of these variations",
        ),
        difficulties={
            0: "the usual cannon",
            1: "a cannon of twice the width",
        },
        source="PettingZoo's source code, and play of all modes in the emulator",
    ),
    categories=(
        player_category(
            "Player", Bounds(GREEN, CANNONS), role="player", doc="the cannon; value: lives"
        ),
        player_category("Player2", CANNON_2, doc="the second player's cannon"),
        Category("Alien", INVADERS, count=36, doc="bitmap row from the bottom * 6 + column"),
        Category("Shield", Bounds(RED, SHIELDS), count=3, doc="what is left of it"),
        Category("Satellite", Bounds(PURPLE, SCORES), doc="the saucer"),
        Category("Bullet", BULLETS, count=4, doc="two bombs, two shots"),
        display("Lives", LIVES, role="lives", doc="shown when a life begins"),
        display(
            "P1Score",
            SCORE_1.rule(GREEN, SCORES),
            blinks=True,
            role="score",
            doc="below 10,000; hidden by the saucer",
        ),
        display("P2Score", SCORE_2.rule(BROWN, SCORES), doc="below 10,000; hidden by the saucer"),
    ),
)
