"""Space Invaders: 36 aliens, three shields that wear away, the cannon, bombs and shots, the saucer.

Alien slots are row * 6 + column of the game's own bitmaps, rows from the bottom; the game moves its columns one to the left when the
leftmost is empty. An alien that was hit stays in its slot while its explosion is shown; invisible invaders are not valid until the
game shows them. Bullet slots: upper and lower bomb (a new bomb starts above the old one), first and second player's shot; bombs are
drawn on even frames, shots on odd ones. Shields are the tight box of what is left of them. Player2 is the
second cannon of games that ALE has no mode for. The players' `value` is the number of lives, as Lives shows it only before a life begins. While the saucer's row hides the scores, P1Score stays
valid at its place so that its value follows the rewards at every step (until the display wraps at 10000); P2Score does not.

RAM facts: facts/ram, and the game's display program: it draws from positions in the chip's coding (bytes 3-7), which it does not change
afterwards, while the positions themselves (27-30) move on at once; how many lines it takes between two decrements of the bullet counter
(byte 9) makes a bullet 6 to 12 lines high.

Covered: all waves, landing, deaths, game over, moving shields, zigzag bombs, fast bombs, invisible invaders, both players at once and in
turn. Not in RAM: the difficulty switches (a cannon is 14 pixels wide at difficulty 1, boxes say 7), the pixels that a hit takes
from a shield on the frame of the hit, and which alien's explosion ends on a frame.
Scenery that no box covers: the ground and its two coloured marks (one for each player).
"""

import jax
import jax.numpy as jnp

from ocjax.ram import RamMap, bcd, bits, byte
from ocjax.spec import Blobs, Bounds, Box, Category, Game, box

YELLOW, RED, PURPLE, GREEN, BROWN, GRAY = 20, 52, 82, 196, 246, 6
FIELD = (0, 22, 160, 195)
SCORES = (0, 8, 160, 22)
SHIELDS = tuple((left, 157, left + 28, 175) for left in (32, 64, 96))  # they move in some modes
CANNONS = (0, 185, 160, 195)
NO_SAUCER = 180
GONE = 0x70  # y of a bullet that does not exist, or more


class Ram(RamMap):
    saucer_code = byte(3)  # x + 1 in the chip's coding (see _place), if a saucer was drawn
    shield_code = byte(5)
    cannon_code = byte(6, 7)
    bullet_clock = byte(9)  # runs down while the screen is drawn
    bullet_step = byte(10)
    second_pose = bits(11, first=6)  # 0: 9, 1: 255
    drop = byte(16)  # y = 31 + 2 * drop
    rows = byte(*range(18, 24))  # bottom row first; bit = column
    cannons = bits(24, first=4, count=2)  # which players have one
    fallen = bits(24, first=7)  # the invaders have landed
    shields_up = bits(24, first=6)
    owners = bits(24, first=2, count=2)  # whose shots the two records are
    aliens_x = byte(26)  # x + 1
    saucer_x = byte(30)  # already moved on; 180: none
    starting = bits(42)  # before a life: lives are shown, the cannon blinks
    died = bits(42, first=1, count=2)
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
    gained = byte(116, 117, 118, 119)  # just hit: hundreds of both players (saucer), then tens (aliens)


def decode(m: Ram) -> dict[str, Box]:
    odd = (m.clock & 1) == 1
    just = odd & (m.gained > 0)  # what was hit on this very frame is still drawn whole
    # the stage moves on after drawing on every eighth frame
    stage = jnp.where((m.clock & 7) == 0, m.explosion - 64, m.explosion) >> 6 & 3
    bang_row, bang_column = m.explosion >> 3 & 7, m.explosion & 7

    rows, columns = jnp.arange(36) // 6, jnp.arange(36) % 6
    bang = (rows == bang_row) & (columns == bang_column)
    alive = (jnp.repeat(m.rows, 6) >> columns & 1) == 1
    alien = _alien(m, rows, columns)
    burst = _explosion(m.aliens_x - 1 + 16 * columns, 31 + 2 * m.drop + 18 * (5 - rows), stage)
    aliens = _choose(bang & ~just[2:].any(), burst, alien).where((alive | bang) & (m.alien_color != m.sky_color))

    saucer_x = _place(m.saucer_code)
    first = jnp.where(odd, m.x[2], m.x[0])
    leaving = (m.saucer_x == NO_SAUCER) & (saucer_x != first)  # on the screen for the last time
    saucer_on = (m.demo == 0) & (leaving | (m.saucer_x != NO_SAUCER))
    saucer_bang = jnp.where(m.saucer_x == NO_SAUCER, (saucer_x > 1) & (saucer_x < 151), ((m.explosion & 0x39) == 0x39) & ~just[:2].any())
    saucer = _choose(saucer_bang, _explosion(saucer_x - 1, 11, stage), box(saucer_x - 1, 12, 7, 8)).where(saucer_on)

    struck = (m.clock | 1) == 0x81  # the counter of a death starts after drawing
    exploding = (jnp.stack([m.died >> 1, m.died & 1]) == 1) & ~struck
    blinking = (m.starting == 1) & ((m.clock & 8) == 0)
    has_cannon = ((m.cannons >> jnp.arange(2) & 1) == 1) & (m.fallen == 0) & ~blinking
    cannons = box(_place(m.cannon_code) - 1, jnp.full(2, 185), jnp.where(exploding, 8, 7), jnp.full(2, 10), has_cannon, jnp.full(2, m.lives), jnp.zeros(2))

    return {
        "Player": jax.tree.map(lambda v: v[0], cannons),
        "Player2": jax.tree.map(lambda v: v[1], cannons),
        "Alien": aliens,
        "Shield": _shields(m),
        "Satellite": saucer,
        "Bullet": _bullets(m, odd, saucer_on),
        "Lives": box(84, 185, 12, 10, (m.starting == 1) & (m.fallen == 0), value=m.lives),
        "P1Score": box(4, 10, 60, 10, value=m.score[0]),
        "P2Score": box(84, 10, 60, 10, ~saucer_on, value=m.score[1]),
    }


def _place(code: jax.Array) -> jax.Array:
    """A position from the chip's coding: low nibble steps of 15, high nibble how much of 7 to take back."""
    return 15 * (code & 15) + ((7 - (code >> 4)) & 15)


def _choose(condition: jax.Array, yes: Box, no: Box) -> Box:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)


def _alien(m: Ram, rows: jax.Array, columns: jax.Array) -> Box:
    second = (m.second_pose == 0) & ((rows == 2) | (rows == 3))  # two poses are a row of pixels lower
    later = second & (rows == 3)
    return box(m.aliens_x - 1 + 16 * columns, 31 + 2 * m.drop + 18 * (5 - rows) + later, 8, 10 - second)


def _explosion(x: jax.Array, y: jax.Array | int, stage: jax.Array) -> Box:
    small = stage == 0
    return box(x + small, y + 2 * small, 8 - 2 * small, jnp.where(small, 5, 9 + (stage > 1)))


def _shields(m: Ram) -> Box:
    lines = m.shields.reshape(3, 9)
    any_line = lines > 0
    top = jnp.argmax(any_line, axis=1)
    bottom = 9 - jnp.argmax(any_line[:, ::-1], axis=1)
    found = jax.lax.reduce_or(lines, (1,))
    limits = 1 << jnp.arange(1, 8)
    left = (found[:, None] < limits).sum(1)
    right = ((found & -found)[:, None] >= limits).sum(1)
    x = _place(m.shield_code) - 1 + 32 * jnp.arange(3)
    return box(x + left, 157 + 2 * top, 8 - left - right, 2 * (bottom - top), (found > 0) & (m.shields_up == 1))


def _bullets(m: Ram, odd: jax.Array, saucer_on: jax.Array) -> Box:
    y, x = m.y, m.x
    # a bullet that hit something on this frame was drawn: the counter that ran down from its y tells where
    drawn = jnp.where(odd, y[2:], y[:2])
    gone = drawn >= GONE
    untouched = m.bullet_step != 0x7C
    last = (m.bullet_clock + 91) & 255
    spare = jnp.where(untouched, last, jnp.where(last - 114 > 7, last - 114, (last + 10) & 255))
    second = jnp.where(untouched, last + m.bullet_step, jnp.where(last > 124, last - 124, last))
    found = jnp.stack([jnp.where(gone[0] & gone[1], spare, 255), jnp.where(gone[1] & ~gone[0] & ((second & 255) >= drawn[0]), second & 255, 255)])
    drawn = jnp.where(gone & (found > 7) & (found < 0x6C), found, drawn)
    y = jnp.concatenate([jnp.where(odd, y[:2], drawn), jnp.where(odd, drawn, y[2:])])
    # shots go to their owners' slots
    swap = (m.owners & 1) == 1
    order = lambda v: jnp.concatenate([v[:2], jnp.where(swap, v[3:1:-1], v[2:])])
    y, x = order(y), order(x) - 2
    top = _line(m, y - 3, x, saucer_on, ending=False)
    return box(x, top, 1, _line(m, y + 1, x, saucer_on, ending=True) - top, y < GONE)


def _line(m: Ram, k: jax.Array, x: jax.Array, saucer_on: jax.Array, ending: bool) -> jax.Array:
    """The first screen line that shows, at x, the k-th decrement of the bullet counter."""
    late = jnp.zeros_like(x) if ending else x  # what ends a bullet between rows waits for the next line
    j = k - m.drop - 11  # from the first row of aliens
    end = 51 - 9 * jnp.where(m.rows[:5] > 0, jnp.arange(5), 5).min()  # of the lowest row
    p = j % 9
    in_rows = 11 - (p >= 5) - (p >= 6) - (p >= 8) + ((p == 7) & (x <= 112)) + ((p == 8) & (late <= 118))
    up = m.shields_up == 1
    at_shields = jnp.where(k < 83, 10 + ((k == 73) & (x <= 88)), 9 + jnp.where(k == 83, x <= 58, jnp.where(k == 84, late <= 34, x <= 88)))
    below = jnp.where(up & (k > 72), at_shields, 9 + jnp.where(k == 85, x <= 112, late <= jnp.where(j == end, 7, 70)))
    above = jnp.where(j == -2, 9, jnp.where(j == -1, 8 + ending, 6 + jnp.where(k == 8, 1, late <= jnp.where(k < 8, 52, 73))))
    near = jnp.where(k > 85, jnp.where(k == 86, 10, 11 + (x <= 112)), jnp.where(j < 0, above, jnp.where(j < end, in_rows, below)))
    least = jnp.where(saucer_on, 6, 23)
    return jnp.clip(jnp.where((k < 9) & ~saucer_on, 23, 2 * k + near), least, 195)


GAME = Game(
    name="SpaceInvaders",
    rom="space_invaders",
    md5="72ffbef6504b75e69ee1045af9075f66",
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", Bounds(GREEN, CANNONS), attributes=("value",)),
        Category("Player2", Blobs(BROWN, CANNONS, join=(0, 1), max_size=(8, 10)), attributes=("value",)),
        Category("Alien", Blobs(YELLOW, FIELD, join=(0, 1), max_size=(8, 10)), count=36),
        Category("Shield", Bounds(RED, SHIELDS), count=3),
        Category("Satellite", Bounds(PURPLE, SCORES)),
        Category("Bullet", Blobs(GRAY, (0, 8, 160, 195), join=(0, 4), max_size=(1, 14)), count=4),
        Category("Lives", Bounds(BROWN, (84, 185, 96, 195), min_size=(12, 10)), hud=True, attributes=("value",)),
        Category("P1Score", Bounds(GREEN, SCORES), hud=True, attributes=("value",)),
        Category("P2Score", Bounds(BROWN, SCORES), hud=True, attributes=("value",)),
    ),
)
