"""Carnival: a gun under three rows of targets, a wheel of pipes and a sign with a bonus; ducks that fly down eat bullets.

Targets of all four kinds have a slot for each place in the game's six groups of up to three: group * 3 + copy, lowest row first. The last
slot of FlyingDuck is a duck that eats bullets, on the bar. The leftmost eight columns of the rows are blanked by the beam. The lines,
the wheel's foot and the sign's stand are scenery.

RAM: ALE's source (score), OCAtari 2.2 (what the tables are) and the ROM's code: groups and shots are moved before they are drawn, flying
ducks and the wheel after it, and only when a counter of three frames is at its end; `decode` takes that back. The shot is
drawn by a loop over the rows whose lines differ: a place for each of the shot's steps.

Covered: several levels, ducks that fly and eat, bonuses and penalties, the end of the game. PlayerScore stays valid while a text is shown
in its place, between levels, and so do the bar with its last bullets and a sign that was hit while they blink. Not in the RAM, each for a
single frame: a flying duck that is hit, the wheel as its last pipe is hit.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box
from ocjax.digits import Digits, hex_font
from ocjax.game import Game
from ocjax.ops import shared
from ocjax.ram import RamMap, bcd, bits, byte
from ocjax.rules import Blobs, Bounds, Category, Gauge
from ocjax.vision.palette import NTSC

WHEEL, SIGN, BARS = (148, 194, 100, 36), (72, 56), (146, 192, 100, 34)
YELLOW, GREY, RED, GREEN, SHOT, WHITE = 24, 10, 72, 182, 234, 232
ROWS = (8, 47, 160, 104)
DUCK, RABBIT, OWL, BULLETS, NONE = 0x00, 0x10, 0x20, 0x30, 0x5C
BLANK_WHEEL, NO_SIGN, MINUS, MINUS_BULLETS, PLUS_BULLETS = 0x54, 0x4F, 0xB1, 0xA6, 0x1E
AWAY = 0x4F  # no duck flies
GLYPHS = ("3c66666666663c", "0818381818187e", "3c46063c60627e", "3c46061c06463c", "0c1c2c4c7e0c0c",
          "7e60607c06463c", "3c62607c66663c", "7e42060c183030", "3c66663c66663c", "3c66663e06463c")  # fmt: skip
# Top and height of the shot at every fifth count.
SHOTS = np.array(((15, 3), (18, 3), (0, 0), (21, 5), (25, 5), (30, 5), (35, 5), (40, 7), (47, 2), (49, 5), (54, 5), (59, 3),
                  (62, 7), (69, 5), (74, 5), (79, 4), (83, 6), (89, 5), (94, 5), (99, 12), (111, 5), (115, 5), (120, 5), (125, 5),
                  (130, 6), (135, 5), (140, 5), (145, 5), (150, 6),
                  (155, 5), (160, 5), (165, 5), (170, 6), (175, 5)), np.int32)  # fmt: skip


class Ram(RamMap):
    duck_y = byte(1)  # y - 110
    player_x = byte(2)  # x + 4
    bullets = byte(3)
    shot_x, shot_y = byte(4), byte(55)
    sign, amount = byte(7), byte(9)  # pictures
    sign_on = byte(102)
    munch = byte(11)  # picture of a duck that eats
    clock = byte(17)
    group_x = byte(*range(18, 24))  # x + 4; lowest row first
    group_kind = byte(*range(24, 36, 2))  # picture
    group_copies = bits(*range(36, 42), count=3)  # as the chip knows them
    duck_speed = bits(43, count=4)
    duck_right, duck_left = bits(43, first=6), bits(43, first=7)
    score = bcd((45, 46))
    bar = byte(57, 58, 60, 61)
    bar_ends = bits(59, 62, first=4, count=4)
    chew = byte(79)  # counts to 20; at 10 and 20 a duck that eats has moved after drawing
    tick = byte(81)  # 0: what moves slowly has moved after drawing
    eater_x, duck_x = byte(109), byte(111)  # x + 4
    wheel = byte(121)
    wheel_color = bits(125, count=2)


def decode(m: Ram) -> dict[str, Box]:
    late = m.tick == 0
    y = m.duck_y - jnp.where(m.tick == 1, 0, m.duck_speed)
    flies = (m.duck_y != AWAY) & ((m.duck_y > 0) | (m.tick == 1))
    x = m.duck_x - jnp.where(late, jnp.where(m.duck_left == 1, -1, m.duck_right), 0)
    starts = (
        (m.duck_y == 0)
        & late
        & (m.group_x == m.duck_x)
        & (m.group_kind == NONE)
        & (jnp.arange(6) < 2)
    )
    eater_x = m.eater_x - 3 + jnp.where((m.chew == 0) | (m.chew == 10), 2, 0)
    where = jnp.stack([x - 4, eater_x]), jnp.stack([110 + y, jnp.int32(203)])
    ducks = box(*where, jnp.array((16, 6)), jnp.array((15, 6)), jnp.stack([flies, m.munch != NONE]))
    kind = jnp.repeat(jnp.where(starts, DUCK, m.group_kind), 3)
    targets = _targets(m)
    full = box(targets.x, targets.y, 8, 15, targets.valid).clip(*ROWS)

    phase = jnp.where(late, (m.clock - 1) >> 2 & 3, (m.wheel - 0xC4) // 13)
    wheel_x = jnp.where(phase == 2, 72, 70)
    rgb = jnp.asarray(NTSC[list(WHEEL)])[m.wheel_color]

    sign_on = (m.sign_on > 0) & (m.sign != NO_SIGN)
    sign_y = jnp.where(m.sign == MINUS, 32, jnp.where(m.sign == MINUS_BULLETS, 31, 29))
    sign_h = jnp.where(m.sign == MINUS, 3, jnp.where(m.sign == MINUS_BULLETS, 4, 9))
    clip = (m.sign == MINUS_BULLETS) | (m.sign == PLUS_BULLETS)  # the value is as many bullets
    value_w = jnp.where(clip, 22 - 4 * ((m.amount - 0x2B) // 9), 22)
    shot = jnp.asarray(SHOTS)[jnp.minimum(m.shot_y // 5, 33)]
    bar = 4 * (
        jnp.sum(jax.lax.population_count(m.bar)) + jnp.sum(jax.lax.population_count(m.bar_ends))
    )
    return {
        "Player": box(m.player_x - 4, 186, 6, 13),
        "PlayerMissile": box(m.shot_x - 5, shot[0], 1, shot[1], m.shot_y > 0),
        "Wheel": box(wheel_x, 15, jnp.where((phase == 0) | (phase == 3), 28, 26), 12, m.wheel != BLANK_WHEEL, rgb=rgb),
        "Duck": full.where(kind == DUCK),
        "Rabbit": full.where(kind == RABBIT),
        "Owl": full.where(kind == OWL),
        "ExtraBullets": box(targets.x, targets.y + 6, 8, 9, targets.valid & (kind == BULLETS)).clip(*ROWS),
        "FlyingDuck": ducks,
        "PlayerScore": box(65, 2, 38, 7, value=10 * m.score),
        "AmmoBar": box(0, 203, bar, 5, value=m.bullets),
        "BonusSign": box(12, sign_y, 6, sign_h, sign_on),
        "BonusValue": box(jnp.where(clip, 20, 22), jnp.where(clip, 33, 29), value_w, jnp.where(clip, 5, 9), sign_on),
    }  # fmt: skip


def _targets(m: Ram) -> Box:
    """Places of the groups' copies."""
    copies, copy, group = jnp.repeat(m.group_copies, 3), np.arange(18) % 3, np.arange(18) // 3
    near, far = (copies & 5) == 1, copies == 4
    first = jnp.where(near, 16, jnp.where(far, 64, 32))
    apart = jnp.where(copy == 0, 0, jnp.where(copy == 1, first, 2 * first))
    many = jnp.where(
        (copies & 3) == 3,
        3,
        jnp.where(copies == 6, 3, jnp.where((copies == 0) | (copies == 5), 1, 2)),
    )
    x = jnp.repeat(m.group_x, 3) + 156 + apart
    x = x - 160 * ((x >> 5) * 205 >> 10)  # x % 160, at a fraction of its cost
    x, many = shared((x, many))  # computed once for all kinds
    return box(x, 89 - 21 * (group >> 1), 8, 15, copy < many)


hud = functools.partial(Category, hud=True)
target = functools.partial(Category, count=18)
DIGITS = Digits(hex_font(GLYPHS, 8, (1, 1)), (64, 72, 80, 88, 96), 2)
GAME = Game(
    name="Carnival",
    rom="carnival",
    md5="028024fb8e5e5f18ea586652f9799c96",
    ram=Ram,
    decode=decode,
    screen=(214, 160),
    categories=(
        Category("Player", Bounds(GREEN, (8, 186, 160, 199)), doc="the gun"),
        Category(
            "PlayerMissile",
            Bounds(SHOT, (7, 14, 160, 185), ignore=((72, 29, 96, 37),)),
            doc="the shot",
        ),
        Category(
            "Wheel",
            Bounds(WHEEL, (66, 14, 104, 29)),
            doc="pipes around a hub; gone when all are hit",
        ),
        target("Duck", Blobs(YELLOW, ROWS, gap=(1, 5), max_size=(8, 15)), doc="in a row"),
        target(
            "Rabbit",
            Blobs(GREY, ROWS, gap=(1, 5), min_size=(1, 10), max_size=(8, 15)),
            doc="in a row",
        ),
        target("Owl", Blobs(RED, ROWS, gap=(1, 5), max_size=(8, 15)), doc="in a row"),
        target(
            "ExtraBullets",
            Blobs(GREY, ROWS, gap=(1, 5), min_size=(1, 9), max_size=(8, 9)),
            doc="a box with an 8 in a row",
        ),
        Category(
            "FlyingDuck",
            Bounds((YELLOW, WHITE), ((8, 105, 160, 180), (0, 203, 160, 210))),
            count=2,
            doc="coming down; eating bullets",
        ),
        hud(
            "PlayerScore",
            Bounds(WHITE, (64, 2, 104, 9), value=DIGITS),
            attributes=("value",),
            doc="points without the last digit",
        ),
        hud(
            "AmmoBar",
            Bounds(BARS, (0, 203, 160, 208), value=Gauge(4)),
            attributes=("value",),
            blinks=True,
            doc="bullets left",
        ),
        hud("BonusSign", Bounds(SIGN, (12, 29, 18, 38)), blinks=True, doc="plus or minus"),
        hud("BonusValue", Bounds(SIGN, (20, 29, 44, 38)), blinks=True, doc="points or bullets"),
    ),
)
