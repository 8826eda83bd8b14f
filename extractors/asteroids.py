"""Asteroids: a ship among large, medium and small asteroids that drift up and down the screen, and a saucer.

Asteroids are drawn on odd frames, ship, saucer and shots on even ones. Asteroid slots: the game's two lists, nine that go up and nine
that go down; an asteroid that leaves at the top or bottom has a second entry where it comes in; 18 slots further is the left part of one
that the right edge cuts. A ship or a saucer that an edge cuts is its larger part. OCAtari's NoObjectPlayer, a placeholder for no ship,
is left out: Player is not valid then.

RAM: ALE's source (score, lives), OCAtari 2.2 and AtariARI (lists), a public disassembly by Dennis Debro (names), and the ROM's code. Places
across are in the chip's coding: low nibble the step of 15 pixels (odd and even from different lines), high nibble what to take back.

Covered: modes with slow and fast asteroids and with each of the stick's features (hyperspace, shields, turning about), both difficulties
(the saucer flies at A), explosions, later waves. Not in the RAM: the digits of the frame on which a point is made; on odd frames, whether
a ship that is there again has already been drawn. In a frame asteroids of one colour that touch are one object.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box
from ocjax.digits import DIGITS_3X5, Digits, hex_font
from ocjax.game import Game
from ocjax.ram import RamMap, bcd, bits, byte, high, low, signed
from ocjax.rules import Blobs, Bounds, Category

ROCKS = (12, 68, 156, 24, 38, 86, 118, 230)
SHIP, SAUCER, TEXT = (76, 220), (156, 236), 68
FIELD = (0, 18, 160, 195)
NONE = 0xE0  # y of what is not there
# Pictures of the ship by heading, then of its explosion, then its shield: left + 1, top, width and height in a nibble each.
SHIPS = (
    0x105A,
    0x204A,
    0x105A,
    0x1268,
    0x006A,
    0x1068,
    0x105A,
    0x204A,
    0x205A,
    0x204A,
    0x205A,
    0x1068,
    0x206A,
    0x1268,
    0x205A,
    0x204A,
)
OTHERS = (0x205A, 0x007A, 0x008A, 0x105A)


# Rows that are left of each kind when 1 to 10 columns are: of its left side, then of its right side; top and bottom in steps of two rows.
CUTS = [np.frombuffer(bytes.fromhex(c + "0000"), "<i4").tolist() for c in (
    "695a5a3a3c1c0d0d0e0e", "585a1a1b0d0d0e0e0e0e", "35261606070707070707", "13030404040404040404",
    "694a4c2c2e1e1e1e0e0e", "262b1d1d0e0e0e0e0e0e", "35261707070707070707", "13040404040404040404")]  # fmt: skip


class Ram(RamMap):
    rock_y = byte(*range(3, 21))  # in steps of two rows
    rock_x = signed(*range(21, 39))
    rock_color = bits(*range(39, 57), count=3)
    rock_kind = bits(*range(39, 57), first=4, count=2)  # 0 and 1 large, 2 medium, 3 small
    mode = byte(0)
    clock = byte(59)  # two nibbles count down, 7 to 1 and 3 to 1
    rock_speed, rock_left = bits(39, first=4, count=4), bits(39, first=3)  # of the first
    heading, lives = low(60), high(60)
    score = bcd((61, 62))
    small, bang, bang_step = bits(71, first=5), bits(71, first=3), byte(70)  # saucer
    shield = bits(72, first=6)
    ship_x, ship_y = signed(73), byte(74)
    drawn_y = byte(111)  # of the ship, on even frames
    ship_half = bits(76, first=7)  # of a step
    saucer_x, saucer_y = signed(81), byte(82)
    shot_x, shot_y = signed(83, 84, 85), byte(86, 87, 88)  # two of the ship, the saucer's
    frame = bits(57)
    last = byte(92, 93)  # of the lists
    timer = byte(94)  # 128 and more: the ship explodes


def decode(m: Ram) -> dict[str, Box]:
    up = np.arange(18) < 9
    there = (m.rock_y != NONE) & (jnp.arange(18) <= jnp.where(up, m.last[0], m.last[1]))
    y = 24 + 2 * _signed(m.rock_y) + jnp.where(up, 0, 1) - jnp.where(m.rock_kind > 1, 2, 0)
    w = jnp.where(m.rock_kind < 2, 16, jnp.where(m.rock_kind == 2, 8, 4))
    x = _place(m.rock_x) - jnp.where(m.rock_kind > 1, 1, 0) - _late(m)
    x = jnp.where(x < 0, x + 160, x)
    right = x + w - 160  # columns beyond the edge
    cut = jnp.concatenate(
        [_cut(CUTS[:4], m.rock_kind, w - right), _cut(CUTS[4:], m.rock_kind, right)]
    )
    top = jnp.tile(y, 2) + 2 * (cut >> 4)
    rocks = box(
        jnp.concatenate([x, x - 160]),
        top,
        jnp.tile(w, 2),
        2 * ((cut & 15) - (cut >> 4)),
        jnp.tile(there, 2),
    )
    rocks = rocks.clip(0, jnp.tile(jnp.where(up, 18, 19), 2), 160, 195)

    stage = m.timer >> 1 & 3
    other = jnp.where(
        m.timer >= 128, 16 + jnp.minimum(stage, 2), jnp.where(m.shield == 1, 19, m.heading)
    )
    picture = jnp.array(SHIPS + OTHERS)[other]
    ship_w = picture >> 4 & 15
    ship_y = _signed(m.ship_y)
    ship_y = jnp.where(ship_y < -2, ship_y + 89, ship_y)
    ship_y = 18 + 2 * ship_y + m.ship_half + (picture >> 8 & 15)

    ship = (m.ship_y != NONE) & ((m.frame == 1) | (m.drawn_y != NONE))
    bang = jnp.where(m.bang == 1, m.bang_step, 0)
    narrow = (bang == 6) | ((bang == 0) & (m.small == 1))
    saucer_w, saucer_h = jnp.where(narrow, 5, 7), jnp.where((bang == 0) & (m.small == 1), 6, 10)
    saucer_x = _place(m.saucer_x) + jnp.where(narrow, jnp.where(bang == 6, 1, 0), -1)
    digits = 1 + sum(jnp.where(m.score >= limit, 1, 0) for limit in (1, 10, 100, 1000))
    return {
        "Player": box(_edge(_place(m.ship_x) - 1 + (picture >> 12), ship_w), ship_y, ship_w, picture & 15, ship,
                      orientation=(16 - m.heading) & 15).clip(*FIELD),
        "Asteroid": rocks,
        "PlayerMissile": box(_edge(_place(m.shot_x) + 1, 1), 17 + 2 * m.shot_y, 1, 2, m.shot_y < 128).clip(*FIELD),
        "Saucer": box(_edge(saucer_x, saucer_w), 20 + 2 * m.saucer_y, saucer_w, saucer_h, m.saucer_y != NONE).clip(*FIELD),
        "PlayerScore": box(84 - 16 * digits, 5, 16 * digits - 4, 10, value=10 * m.score),
        "Lives": box(132, 5, 12, 10, value=m.lives),
    }  # fmt: skip


def _cut(table: list[list[int]], kind: jax.Array, columns: jax.Array) -> jax.Array:
    """Looked up by choices, which vectorise: a gather takes five times as long."""
    i = jnp.clip(columns, 1, 10) - 1
    words = [
        jnp.where(kind == 0, a, jnp.where(kind == 1, b, jnp.where(kind == 2, c, d)))
        for a, b, c, d in zip(*table, strict=True)
    ]
    word = jnp.where(i < 4, words[0], jnp.where(i < 8, words[1], words[2]))
    return word >> 8 * (i & 3) & 255


def _signed(y: jax.Array) -> jax.Array:
    return jnp.where(y >= 128, y - 256, y)


def _place(code: jax.Array) -> jax.Array:
    step = 15 * (code >> 1 & 7)
    return (jnp.where((code & 1) == 1, step - 5, step + 82) - (code >> 4)) % 160


def _late(m: Ram) -> jax.Array:
    """The step to the right that the first asteroid of the upward list has made too late to be drawn."""
    speed = jnp.where((m.mode & 1) == 1, m.rock_speed, m.rock_speed & 7)
    half, full = (speed == 7) | (speed == 10) | (speed == 14), (speed == 11) | (speed == 15)
    steps = (m.frame == 1) & (full | jnp.where(half, m.clock & 15 == 3, m.clock >> 4 == 7))
    return jnp.where(steps & (jnp.arange(18) == 0), 1 - 2 * m.rock_left, 0)


def _edge(x: jax.Array, w: jax.Array | int) -> jax.Array:
    """Left of the larger part of what the right edge may cut in two."""
    return jnp.where(x < 0, x + 160, jnp.where(2 * (x - 160) > -w, x - 160, x))


FONT = hex_font((DIGITS_3X5[0], "26227", *DIGITS_3X5[2:]), 3, (4, 2))
DIGITS = functools.partial(Digits, FONT, top=5)
GAME = Game(
    name="Asteroids",
    rom="asteroids",
    md5="ccbd36746ed4525821a8083b0d6d2c2c",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            Bounds(SHIP, FIELD, min_size=(3, 2), exclude=("PlayerMissile",)),
            attributes=("orientation",),
            doc="the ship",
        ),
        Category(
            "Asteroid",
            Blobs(
                ROCKS, FIELD, area=(3, 900), max_size=(24, 56), split=(20, 34), split_by_color=True
            ),
            count=36,
            doc="two lists of nine; their left parts where the right edge cuts them",
        ),
        Category(
            "PlayerMissile",
            Blobs((*SHIP, *SAUCER), FIELD, gap=(3, 4), max_size=(1, 2)),
            count=3,
            doc="the ship's shots, the saucer's",
        ),
        Category(
            "Saucer", Blobs(SAUCER, FIELD, min_size=(5, 6), max_size=(7, 10)), doc="at difficulty A"
        ),
        Category(
            "PlayerScore",
            Bounds(TEXT, (4, 5, 80, 15), value=DIGITS((4, 20, 36, 52, 68))),
            attributes=("value",),
            hud=True,
            doc="points",
        ),
        Category(
            "Lives",
            Bounds(TEXT, (116, 5, 144, 15), value=DIGITS((132,))),
            attributes=("value",),
            hud=True,
            doc="ships left",
        ),
    ),
)
