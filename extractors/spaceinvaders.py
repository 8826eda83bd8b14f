"""Space Invaders: 36 aliens, three shields that wear away, the cannon, bombs and shots, the saucer.

Alien slots are row * 6 + column of the game's own bitmaps, rows from the bottom; the game moves its columns one to the left when the
leftmost is empty. An alien that was hit stays in its slot while its explosion is shown; invisible invaders are not valid while the game
hides them. Bullet slots: upper and lower bomb (a new bomb starts above the old one), first and second player's shot; bombs are drawn on
even frames, shots on odd ones. The players' `value` is the number of lives, as Lives shows it only before a life begins. While the
saucer's row hides the scores, P1Score stays valid at its place: its value follows the rewards at every step (until the display wraps at
10000).

RAM: ALE's source, OCAtari 2.2, AtariARI, and the game's display program: it draws from positions in the chip's coding (bytes 3-7), which
it does not change, while the positions (27-30) move on; the lines between two steps of byte 9 make bullets 4 to 12 high.

Covered: later waves, landing, deaths, game over, all of ALE's modes, both players at once and in turn. Not in RAM: the difficulty switches
(a cannon is 14 pixels wide at difficulty 1, boxes say 7), what a hit takes from a shield on the frame of the hit, which alien's explosion
ends on a frame, an upper bomb on the frame on which it hits. Scenery that no box covers: the ground and its two coloured marks.
"""

import functools

import jax
import jax.numpy as jnp
from ocjax.boxes import Box, box
from ocjax.digits import DIGITS_3X5, Digits, hex_font
from ocjax.game import Game
from ocjax.ram import RamMap, bcd, bits, byte
from ocjax.rules import Blobs, Bounds, Category

YELLOW, RED, PURPLE, GREEN, BROWN, GRAY = 20, 52, 82, 196, 246, 6
FIELD = (0, 22, 160, 195)
SCORES, CANNONS = (0, 8, 160, 22), (0, 185, 160, 195)
SHIELDS = tuple((left, 157, left + 32, 175) for left in (30, 62, 94))  # they move in some modes
NO_SAUCER, GONE = 180, 0x70  # x of no saucer; y, or more, of no bullet


class Ram(RamMap):
    saucer_code = byte(3)  # x + 1 in the chip's coding (see _place), if a saucer was drawn
    shield_code = byte(5)
    cannon_code = byte(6, 7)
    bullet_clock = byte(9)  # runs down while the screen is drawn
    bullet_step = byte(10)
    second_pose = bits(11, first=6)  # 0: 9, 1: 255
    drop = byte(16)  # y = 31 + 2 * drop
    rows = byte(*range(18, 24))  # bottom row first; bit = column
    cannon_1 = bits(24, first=4)  # which players have one
    cannon_2 = bits(24, first=5)
    fallen = bits(24, first=7)  # the invaders have landed
    shields_up = bits(24, first=6)
    first_owner = bits(24, first=2)  # whose shot the first record is
    aliens_x = byte(26)  # x + 1
    saucer_x = byte(30)  # already moved on; 180: none
    starting = bits(42)  # before a life: lives are shown, the cannon blinks
    died_1 = bits(42, first=2)
    died_2 = bits(42, first=1)
    demo = bits(42, first=7)
    shields = byte(*range(43, 70))  # 9 rows each, top first
    explosion = byte(72)  # stage * 64 + row * 8 + column; row 7: saucer
    lives = byte(73)
    clock = byte(74)  # counts frames down
    y = byte(81, 82, 85, 86)  # bombs, shots; the lesser first
    x = byte(83, 84, 87, 88)  # x + 2
    alien_color = byte(97)
    sky_color = byte(99)
    score = bcd((102, 104), (103, 105))
    gained = byte(
        116, 117, 118, 119
    )  # just hit: hundreds of both players (saucer), then tens (aliens)


def decode(m: Ram) -> dict[str, Box]:
    odd = (m.clock & 1) == 1
    just = odd & (m.gained > 0)  # what was hit on this very frame is still drawn whole
    saucer_hit, alien_hit = just[0] | just[1], just[2] | just[3]
    stage = (
        jnp.where((m.clock & 7) == 0, m.explosion - 64, m.explosion) >> 6 & 3
    )  # moves on after drawing on every eighth frame
    lowest = jnp.min(jnp.where(m.rows[:5] > 0, jnp.arange(5), 5))  # the last row that is drawn

    rows, columns = jnp.arange(36) // 6, jnp.arange(36) % 6
    bang = ((m.explosion & 63) == 8 * rows + columns) & ((rows >= lowest) | alien_hit)
    alive = (jnp.repeat(m.rows, 6) >> columns & 1) == 1
    x, y = m.aliens_x - 1 + 16 * columns, 31 + 2 * m.drop + 18 * (5 - rows)
    short = (m.second_pose == 0) & (
        (rows == 2) | (rows == 3)
    )  # two poses are a row of pixels lower
    alien = box(
        jnp.broadcast_to(x, 36),
        jnp.where(short & (rows == 3), y + 1, y),
        jnp.full(36, 8),
        jnp.where(short, 9, 10),
    )
    aliens = _choose(bang & ~alien_hit, _explosion(x, y, stage), alien).where(
        (alive | bang) & (m.alien_color != m.sky_color)
    )

    saucer_x = _place(m.saucer_code)
    moving, leaving = (
        m.saucer_x != NO_SAUCER,
        saucer_x != jnp.where(odd, m.x[2], m.x[0]),
    )  # leaving: shown for the last time
    saucer_on = (m.demo == 0) & (leaving | moving)
    saucer_bang = jnp.where(
        moving, ((m.explosion & 0x39) == 0x39) & ~saucer_hit, (saucer_x > 1) & (saucer_x < 151)
    )
    saucer = _choose(
        saucer_bang, _explosion(saucer_x - 1, jnp.int32(11), stage), box(saucer_x - 1, 12, 7, 8)
    ).where(saucer_on)

    struck = (m.clock | 1) == 0x81  # the counter of a death starts after drawing
    blinking = (m.starting == 1) & ((m.clock & 8) == 0)
    cannon_x = _place(m.cannon_code) - 1

    def cannon(x: jax.Array, there: jax.Array, died: jax.Array) -> Box:
        width = jnp.where((died == 1) & ~struck, 8, 7)
        return box(x, 185, width, 10, (there == 1) & (m.fallen == 0) & ~blinking, value=m.lives)

    return {
        "Player": cannon(cannon_x[0], m.cannon_1, m.died_1),
        "Player2": cannon(cannon_x[1], m.cannon_2, m.died_2),
        "Alien": aliens,
        "Shield": _shields(m),
        "Satellite": saucer,
        "Bullet": _bullets(m, odd, saucer_on, lowest),
        "Lives": box(84, 185, 12, 10, (m.starting == 1) & (m.fallen == 0), value=m.lives),
        "P1Score": box(4, 10, 60, 10, value=m.score[0]),
        "P2Score": box(84, 10, 60, 10, ~saucer_on, value=m.score[1]),
    }


def _place(code: jax.Array) -> jax.Array:
    """A position from the chip's coding: low nibble steps of 15, high nibble how much of 7 to take back."""
    return 15 * (code & 15) + ((7 - (code >> 4)) & 15)


def _choose(condition: jax.Array, yes: Box, no: Box) -> Box:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)


def _explosion(x: jax.Array, y: jax.Array, stage: jax.Array) -> Box:
    small = stage == 0
    return box(
        jnp.where(small, x + 1, x),
        jnp.where(small, y + 2, y),
        jnp.where(small, 6, 8),
        jnp.where(small, 5, jnp.where(stage == 1, 9, 10)),
    )


def _shields(m: Ram) -> Box:
    lines = [m.shields[k::9] for k in range(9)]  # [3] each
    found, top, bottom = lines[0], jnp.full(3, 9), jnp.full(3, 0)
    for k, line in enumerate(lines):
        found = found | line
        top, bottom = jnp.where((line > 0) & (top == 9), k, top), jnp.where(line > 0, k + 1, bottom)
    left, right = jnp.full(3, 0), jnp.full(3, 0)
    for k in range(1, 8):
        left = jnp.where(found < 256 >> k, k, left)
        right = jnp.where((found & ((1 << k) - 1)) == 0, k, right)
    x = _place(m.shield_code) - 1 + 32 * jnp.arange(3)
    return box(
        x + left,
        157 + 2 * top,
        8 - left - right,
        2 * (bottom - top),
        (found > 0) & (m.shields_up == 1),
    )


def _bullets(m: Ram, odd: jax.Array, saucer_on: jax.Array, lowest: jax.Array) -> Box:
    # a bullet that hit something on this frame was drawn: the counter that ran down from its y tells where
    upper, lower = jnp.where(odd, m.y[2], m.y[0]), jnp.where(odd, m.y[3], m.y[1])
    untouched = m.bullet_step != 0x7C
    last = (m.bullet_clock + 91) & 255
    only = jnp.where(untouched, last, jnp.where(last > 121, last - 114, (last + 10) & 255))
    below = (
        jnp.where(untouched, last + m.bullet_step, jnp.where(last > 124, last - 124, last)) & 255
    )
    drawn_upper = jnp.where(
        (upper >= GONE) & (lower >= GONE) & (only > 7) & (only < 0x6C), only, upper
    )
    drawn_lower = jnp.where(
        (upper < GONE) & (lower >= GONE) & (below >= upper) & (below < 0x6C), below, lower
    )
    drawn = jnp.stack([drawn_upper, drawn_lower])
    bombs, shots = jnp.where(odd, m.y[:2], drawn), jnp.where(odd, drawn, m.y[2:])
    turned = m.first_owner == 1  # shots go to their owners' slots
    y = jnp.concatenate([bombs, jnp.where(turned, shots[::-1], shots)])
    x = jnp.concatenate([m.x[:2], jnp.where(turned, m.x[:1:-1], m.x[2:])]) - 2
    top, bottom = (
        _line(m, y - 3, x, saucer_on, lowest, ending=False),
        _line(m, y + 1, x, saucer_on, lowest, ending=True),
    )
    return box(x, top, 1, bottom - top, y < GONE)


def _line(
    m: Ram, k: jax.Array, x: jax.Array, saucer_on: jax.Array, lowest: jax.Array, ending: bool
) -> jax.Array:
    """The first screen line that shows, at x, the k-th decrement of the bullet counter: about 2 * k + 9."""

    def passed(column: int) -> jax.Array:  # the beam has not reached x yet
        return (x <= column).astype(jnp.int32)

    def waiting(
        column: int,
    ) -> jax.Array:  # the same; but what ends a bullet between rows waits for the next line
        return jnp.ones_like(x) if ending else passed(column)

    j = k - m.drop - 11  # from the first row of aliens
    end = 51 - 9 * lowest
    p = j % 9
    bend = jnp.where(
        p == 5, 10, jnp.where(p == 6, 9, jnp.where(p == 7, 9 + passed(112), 8 + waiting(118)))
    )
    in_rows = jnp.where(p < 5, 11, bend)
    at_shields = jnp.where(
        k == 73,
        10 + passed(88),
        9 + jnp.where(k == 83, passed(58), jnp.where(k == 84, waiting(34), passed(88))),
    )
    at_shields = jnp.where((k > 73) & (k < 83), 10, at_shields)
    gap = 9 + jnp.where(k == 85, passed(112), jnp.where(j == end, waiting(7), waiting(70)))
    under = jnp.where((m.shields_up == 1) & (k > 72), at_shields, gap)
    sky = jnp.where(k == 8, 7, 6 + jnp.where(k < 8, waiting(52), waiting(73)))
    over = jnp.where(j == -2, 9, jnp.where(j == -1, 9 if ending else 8, sky))
    field = jnp.where(j < 0, over, jnp.where(j < end, in_rows, under))
    near = jnp.where(k > 86, 11 + passed(112), jnp.where(k == 86, 10, field))
    line = jnp.where((k < 9) & ~saucer_on, 23, 2 * k + near)
    return jnp.clip(line, jnp.where(saucer_on, 6, 23), 195)


FONT = hex_font((DIGITS_3X5[0], "26227", DIGITS_3X5[2], "71717", *DIGITS_3X5[4:]), 3, (4, 2))
digits = functools.partial(Digits, FONT)
display = functools.partial(Category, hud=True, attributes=("value",))
GAME = Game(
    name="SpaceInvaders",
    rom="space_invaders",
    md5="72ffbef6504b75e69ee1045af9075f66",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player", Bounds(GREEN, CANNONS), attributes=("value",), doc="the cannon; value: lives"
        ),
        Category(
            "Player2",
            Blobs(BROWN, CANNONS, gap=(0, 1), max_size=(8, 10)),
            attributes=("value",),
            doc="the second player's cannon",
        ),
        Category(
            "Alien",
            Blobs(YELLOW, FIELD, gap=(0, 1), max_size=(8, 10)),
            count=36,
            doc="bitmap row from the bottom * 6 + column",
        ),
        Category("Shield", Bounds(RED, SHIELDS), count=3, doc="what is left of it"),
        Category("Satellite", Bounds(PURPLE, SCORES), doc="the saucer"),
        Category(
            "Bullet",
            Blobs(GRAY, (0, 8, 160, 195), gap=(0, 4), max_size=(1, 14)),
            count=4,
            doc="two bombs, two shots",
        ),
        display(
            "Lives",
            Bounds(BROWN, (84, 185, 96, 195), min_size=(12, 10), value=digits((84,), 185)),
            doc="when a life begins",
        ),
        display(
            "P1Score",
            Bounds(GREEN, SCORES, value=digits((4, 20, 36, 52), 10)),
            doc="hidden by the saucer",
        ),
        display(
            "P2Score",
            Bounds(BROWN, SCORES, value=digits((84, 100, 116, 132), 10)),
            doc="hidden by the saucer",
        ),
    ),
)
