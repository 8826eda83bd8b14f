"""Assault: a cannon below, a mother ship above that sets off enemies in three rows, shots of both sides, the cannon's heat.

Enemy slots are row * 2 + half, rows from the bottom: an enemy that is whole has the left half's slot, one that was split or is hit
whole both halves' box together. An enemy stays valid while it explodes and is not valid while its level hides it. While the mother
ship sets off an enemy, its bay is part of it.

RAM: ALE's source (score, lives), OCAtari 2.2 (positions, flags), and the ROM's code: positions are in the chip's coding; what moves in
the overscan (shots, cannon) lags behind the RAM on the screen; rows without enemies take a line less, explosions one more.

Covered: levels 1 to 24 (four kinds of enemies and of their shots), splits, explosions, deaths, overheating, game over. Not in the RAM:
which way the cannon has just moved (two pixels); a shot on the frame on which it ends; the heat on the frame on which it changes.
Scenery that no box covers: the ground's line.
"""

import jax
import jax.numpy as jnp
from ocjax.boxes import Box, box
from ocjax.digits import Digits, hex_font
from ocjax.game import Game
from ocjax.ram import RamMap, bcd, bits, byte
from ocjax.rules import Blobs, Bounds, Category, Cells, Gauge

WHITE, SCORE, LIFE, HEAT = 14, 40, 8, (198, 70)
SHIP = (198, 38, 24, 146, 114, 214, 150, 148, 82, 86, 194, 196, WHITE)
CANNON, ENEMY_SHOTS = (12, 22, 134), (24, 152, 200, 72)
ENEMIES = (38, 52, 66, 198, 214, 146, 24, 72, 70, 22, 20, 148, 150, 152, 18, 242, 244, 246, 248)
ROWS, BELOW, GROUND = (0, 45, 160, 120), (0, 120, 160, 186), (0, 178, 160, 186)
HIDDEN = 253  # page of the empty picture
GLYPHS = ("3c6666666666663c", "183878181818187e", "3c4646060c30607e", "3c46461c1e46463c", "0c1c2c4c4c7e0c0c",
          "7e40407c0606463c", "3c62607c6666663c", "7e46060c18183030", "3c66663c6666663c", "3c66663e0606663c")  # fmt: skip


class Ram(RamMap):
    score = bcd((0, 1, 2))
    x = byte(16)  # in the chip's coding, see _place; already moved on
    roll_x = byte(17)  # of the enemies' shot, of the third and fourth kind
    side_x = byte(18)  # of the cannon's shot to the side; already moved on
    shot_x = byte(19)
    rolls = bits(22, first=7)  # the enemies' shot rolls along the ground
    side = byte(24)  # 88: the cannon's shot to the side is drawn
    side_way = bits(26, first=6, count=2)  # 1 left, 2 right
    heat_low, heat_high = byte(28), byte(29)  # a bit for each unit
    picture, page = byte(30), byte(31)  # of the cannon
    enemy_x = byte(33, 36, 34, 37, 35, 38)  # left and right half, bottom row first
    missile_x = byte(39)
    hides = bits(42, first=7)
    bob = bits(43, count=4)
    enemies = byte(54, 55, 56)  # bit 7 left half, 6 right half, 5 split
    rises = bits(66, first=7)
    missile_y = byte(67)
    sound = byte(63)  # 29: something has just been hit
    ship_x = byte(68)
    ship_y = bits(71, count=4)
    shot_y = byte(73)  # of the third and fourth kind
    falls = bits(75, first=7)  # the enemies' shot
    lives = byte(101)
    frame = byte(103)  # of the next frame
    level = bits(104, count=2)
    opens = bits(105, first=7)
    open_time = byte(107)
    blast = byte(106)  # bits 7, 6 left, right half; 2-5 time; 0-1 row
    beam_y = byte(110)  # of the first and second kind


def decode(m: Ram) -> dict[str, Box]:
    lost = m.page == HIDDEN
    small = (m.page == 255) & (m.picture == 0xE2)
    icon = jnp.arange(3)
    heat = jnp.sum((m.heat_low >> jnp.arange(8) & 1) + (m.heat_high >> jnp.arange(8) & 1))
    bay = (m.opens == 1) & (m.open_time > 0)
    return {
        "Player": box(
            _place(m.x) - 22 + jnp.where(small, 2, 0), 178, jnp.where(small, 4, 8), 8, ~lost
        ),
        "MotherShip": box(
            _place(m.ship_x) - 21,
            15 + jnp.where((m.opens == 1) & (m.open_time == 0), 3, m.ship_y),
            32,
            jnp.where(bay, 21, 16),
        ),
        "Enemy": _enemies(m),
        "PlayerMissileVertical": _missile(m),
        "PlayerMissileHorizontal": box(
            _place(
                _moved(m.side_x, jnp.where(m.side_way == 2, -3, jnp.where(m.side_way == 1, 3, 0)))
            )
            - 23,
            181,
            4,
            2,
            m.side == 88,
        ),
        "EnemyMissile": _shot(m),
        "PlayerScore": box(56, 2, 46, 8, value=m.score),
        "Lives": box(15 + 16 * icon, 192, 8, 8, icon < m.lives - 1),
        "Health": box(96, 192, 4 * heat, 8, value=heat),
    }


def _place(code: jax.Array) -> jax.Array:
    """Pixels, from the chip's coding: columns of 15 and a fine motion to the left."""
    return 15 * (code & 15) + (code >> 4 ^ 7)


def _moved(code: jax.Array, step: jax.Array) -> jax.Array:
    """The code so many steps on, as the game counts: sixteen a column."""
    linear = 16 * (code & 15) + (code >> 4 ^ 7) + step
    return (linear >> 4 & 15) | ((linear & 15 ^ 7) << 4)


def _enemies(m: Ram) -> Box:
    present = m.enemies & 192 > 0
    step = (
        m.open_time == 0
    )  # the rows may have moved down, or an enemy been set off, after the frame was drawn
    left, right_x = m.enemy_x[0:6:2], m.enemy_x[1:6:2]
    same = (left[:2] == left[1:]) & (right_x[:2] == right_x[1:])
    moved = step & (m.opens == 0) & present[:2] & ~present[1:] & same
    new = step & (m.opens == 1)
    down = jnp.stack((moved[0], moved[1], jnp.array(False)))
    came = jnp.stack((jnp.array(False), moved[0], moved[1]))
    drawn = (present & ~down & (~new | (jnp.arange(3) < 2))) | came
    hit, hit_row = m.blast & 192 > 0, m.blast & 3
    fresh = (
        hit & (m.blast & 60 == 0) & (m.sound == 0x1D)
    )  # on this very frame: it is still drawn whole
    empty = jnp.where(drawn | (fresh & (hit_row == jnp.arange(3))), 0, 1)
    above = jnp.stack((empty[1] + empty[2], empty[2], jnp.int32(0)))
    lines = empty + above

    row, right = jnp.arange(6) >> 1, jnp.arange(6) & 1
    flags, bit = jnp.repeat(m.enemies, 2), jnp.where(right == 1, 64, 128)
    split = flags & 32 > 0
    struck = hit & (hit_row == row) & (~split | (m.blast & bit > 0))
    bursts = struck & ~fresh
    second, thin = (m.frame - 1) & 16 > 0, bursts & ((m.frame - 1) & 4 == 0)  # of two pictures
    inset = jnp.where(thin | (~split & ~bursts & second & (m.level >= 2)), 2, 0)
    low = split & ~bursts & ~second & (m.level & 1 == 1)  # a picture whose first row is empty
    short = low | (split & ~bursts & second & (m.level == 3))
    x = _place(m.enemy_x) - 22
    last = jnp.where((right == 0) & ~split, jnp.roll(x, -1), x) + 8
    after = (
        hit & ~jnp.any(split & (row == hit_row)) & (row <= jnp.where(fresh, hit_row - 1, hit_row))
    )
    y = (
        94
        + m.bob
        - 25 * row
        - jnp.repeat(jnp.where(down, above, lines), 2)
        + jnp.where(after, 1, 0)
        - jnp.where(jnp.repeat(down, 2), 25, 0)
    )
    shown = (
        ((flags & bit > 0) | struck)
        & ((m.hides == 0) | bursts)
        & (split | (right == 0))
        & ~((row == 2) & new)
    )
    return box(
        x + inset, y + jnp.where(low, 1, 0), last - x - 2 * inset, jnp.where(short, 7, 8), shown
    )


def _missile(m: Ram) -> Box:
    """Among the enemies' rows it is drawn while a counter of lines is in its block of eight; some lines do not count."""
    block = m.missile_y >> 3
    y = jnp.where(
        block == 1,
        52,
        jnp.where(
            block == 2,
            59,
            jnp.where(block == 3, 77, jnp.where(block == 4, 83, jnp.where(block == 5, 102, 105))),
        ),
    )
    h = jnp.where(
        block == 1,
        8,
        jnp.where(
            block == 2,
            18,
            jnp.where(block == 3, 6, jnp.where(block == 4, 19, jnp.where(block == 5, 3, 22))),
        ),
    )
    below = block >= 7
    y = jnp.where(below, m.missile_y + 64, y)
    h = jnp.where(below, jnp.where(block == 13, 10, 8), h)
    return box(_place(m.missile_x) - 23, y, 1, h, (m.rises == 1) & (block > 0) & (block < 14))


def _shot(m: Ram) -> Box:
    beam = m.level < 2
    tall = m.level == 1
    line = jnp.where(tall, (m.beam_y - 6) & ~31, (m.beam_y - 6) & ~7)
    top = jnp.where(m.level == 2, 101, 29) + m.shot_y
    roll = m.rolls == 1
    y = jnp.where(beam, line + 71, jnp.where(roll, 178, top))
    h = jnp.where(beam, jnp.where(tall, 32, 8), jnp.where(m.level == 2, 16, 8))
    x = jnp.where(beam, _place(m.shot_x) - 23, _place(m.roll_x) - 22)
    started = jnp.where(beam, m.beam_y > 60, m.shot_y > jnp.where(m.level == 2, 4, 84))
    return box(x, y, jnp.where(beam, 1, 8), h, roll | ((m.falls == 1) & started)).clip(
        0, 125, 160, 186
    )


GAME = Game(
    name="Assault",
    rom="assault",
    md5="de78b3a064d374390ac0710f95edde92",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player", Blobs(CANNON, GROUND, min_size=(4, 7), max_size=(8, 8)), doc="the cannon"
        ),
        Category(
            "MotherShip",
            Bounds(SHIP, (0, 12, 160, 45)),
            doc="above, with its open bay",
            rgb=(72, 160, 72),
        ),
        Category(
            "Enemy",
            Blobs(ENEMIES, ROWS, gap=(4, 0), min_size=(4, 6), max_size=(16, 8)),
            count=6,
            doc="row from the bottom * 2 + half",
        ),
        Category(
            "PlayerMissileVertical", Bounds(WHITE, (0, 45, 160, 186)), doc="the cannon's shot up"
        ),
        Category(
            "PlayerMissileHorizontal",
            Bounds(CANNON, (0, 181, 160, 183), exclude=("Player",)),
            doc="the cannon's shot to the side",
        ),
        Category("EnemyMissile", Bounds(ENEMY_SHOTS, BELOW), doc="beams, fireballs, rolling ones"),
        Category(
            "PlayerScore",
            Bounds(
                SCORE,
                (50, 0, 110, 12),
                value=Digits(hex_font(GLYPHS, 8, (1, 1)), tuple(range(55, 96, 8)), 2),
            ),
            hud=True,
            attributes=("value",),
            doc="six digits",
        ),
        Category(
            "Lives",
            Cells(LIFE, (15, 31, 47), (192,) * 3, 8, 8, whole=False),
            count=3,
            hud=True,
            doc="spare cannons",
        ),
        Category(
            "Health",
            Bounds(HEAT, (90, 190, 160, 204), value=Gauge(4)),
            hud=True,
            attributes=("value",),
            doc="heat; value: of 16",
        ),
    ),
)
