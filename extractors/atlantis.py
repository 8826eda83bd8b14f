"""Atlantis: a city with three cannons and six other buildings under ships that fly over in four lanes, each pass a lane lower.

Ship slots are the game's own records; a ship goes down through the lanes in its slot. Its wreck stays in the slot; that of a bandit
bomber is the large explosion that ends all ships. A building stays valid while it explodes. The outermost eight columns of the sky are
black masks. The ground, the water and the black dashes at the left edge are scenery.

RAM: ALE's source (score, lives), OCAtari 2.2 (what the tables are) and the ROM's code: ships are drawn from places in the chip's
coding, which are not changed until the next frame, while all else is moved on after drawing and taken back here; the digits and most
buildings are found by the pointers to their pictures. A shot counts display lines upwards, some of which are two rows high.

Covered: modes 0-3, waves, deaths of all buildings, the bandit's explosion, game over. Not in the RAM, each for a single frame: a shot
that hits or leaves, a ship that leaves the lowest lane, a wreck's last frame, the death ray when it hits. In the frames alone a ship that
is only partly in the picture is taken for a Gorgon.
"""

import itertools
from typing import Any

import jax
import jax.numpy as jnp
from ocjax.boxes import Box, box
from ocjax.digits import Digits, hex_font
from ocjax.game import Game
from ocjax.ops import shared
from ocjax.ram import RamMap, bcd, bits, byte, signed
from ocjax.rules import Blobs, Bounds, Category

SHIP = (24, 58, 86, 100, 120, 152, 164, 218)  # a colour a row
SHOT = (*SHIP, 26, 42, 62, 74, 104, 202, 254)
FIRE = (62, 60, 56, 54, 52, 50, 48)
GENERATORS = ((74, 120, 138, 200, 202, 252), (188,), (126,))
CANNON = (24, 58, 86, 152, 202, 254)
GROUND, GOLD, SKY = (186, 198), 62, (8, 8, 152, 124)
LANES = tuple((8, 82 - 21 * i, 152, 90 - 21 * i) for i in range(4))  # lowest first
# The land's height: columns 0-79, the same again 80 further, but for the eight columns of the left edge.
LAND = (
    (0, 132),
    (8, 156),
    (12, 164),
    (16, 178),
    (32, 164),
    (36, 156),
    (56, 164),
    (60, 145),
    (68, 132),
    (72, 120),
    (80, 210),
)
GLYPHS = ("1c36363677363636361c", "28381818183c1818187e", "5e73636303060c193f7f", "5e7363031e030363677e",
          "050e1e36667f06060609", "7f7e40407e0303637f3e", "1e332320207e2323331e",
          "7f3f060c183078303030", "3e7763773e366363773e", "3c6e46667f060666663c")  # fmt: skip
DIGITS = Digits(hex_font(GLYPHS, 7, (1, 1)), tuple(range(56, 104, 8)), 188)
BLANK = 100


class Ram(RamMap):
    digits = byte(0, 2, 4, 6, 8, 10)  # 10 * digit, the lowest first
    left_cannon, pictures = (
        byte(21),
        byte(22, 23, 24),
    )  # of the generators: 0x78 and 0x68 are narrow
    tail, score = bcd(33), bcd((35, 34))
    ship_x = byte(36, 37, 38, 39)  # lowest lane first; 0: none
    coarse, fine = byte(50, 52, 54, 56), signed(51, 53, 55, 57)  # the same as drawn
    shot_y, shot_x, shot_speed = byte(58, 59), byte(60, 61), signed(65, 66)
    ray_x = byte(62)
    bang_x, bang, bang_lane = byte(64), byte(91), bits(92, count=2)  # 0x80 and stage
    ship_lane, ship_waits = bits(71, 72, 73, 74, count=2), bits(71, 72, 73, 74, first=2)
    ship_stage, ship_hit, ship_right = (
        bits(71, 72, 73, 74, first=f, count=c) for f, c in ((3, 3), (6, 1), (7, 1))
    )
    ship_kind = byte(
        79, 80, 81, 82
    )  # picture: 0x20, 0x30 and 0x40 Gorgons, 0x50 bandit, 0xA0 and more wreck
    state = byte(83)  # 0 demo, 1 play, 2 between waves, 255 over
    damage = byte(
        *range(84, 91)
    )  # post, generators, palace, bazaar, plane: 0 stands, 1-4 explodes, 5 gone
    right_fires, flash, noise = byte(93), byte(96), byte(105)  # count down
    lives, clock = byte(113), byte(122)


def decode(m: Ram) -> dict[str, Box]:
    over = m.state >= 128
    dark = (m.bang >= 128) & (
        (m.bang != 0x80) | (m.flash != 0x20)
    )  # when the bandit is hit all is still drawn
    ships, bandit = _ships(m, ~over & ~dark)
    stage = m.bang & 7
    half, y = (
        _pick(stage, 3, 6, 9, 11, 13),
        _pick(m.bang_lane, 80, 60, 40, 28) - _pick(stage, 0, 1, 5, 10, 9),
    )
    bang = box(m.bang_x - half, y, 2 * half + 1, _pick(stage, 10, 14, 21, 30, 28), dark & ~over)

    right = (
        (m.right_fires == 1)
        | (m.right_fires == 2)
        | jnp.any((m.shot_speed < 0) & (m.shot_y == 0x64))
    )
    low = jnp.where(jnp.stack([m.left_cannon == 0x88, right]), 1, 0)  # it recoils
    cannons = box(jnp.array((0, 152)), jnp.array((124, 112)) + low, 8, 8 - low, ~over)

    stood = jnp.where(
        (m.damage == 1) & (m.noise == 0x3E), 0, m.damage
    )  # what was just hit is drawn whole
    depth = jnp.maximum(_land(m.ray_x), _land(m.ray_x + 1))
    ray = (m.ray_x > 0) & (_drawn_x(m)[0] > 0) & (m.state == 1) & ~dark
    shown = jnp.where(m.digits == BLANK, 0, jnp.arange(1, 7))
    left = 104 - 8 * jnp.max(shown)
    return {
        "Sentry": cannons,
        "AcropolisCommandPost": _ruins(72, 112, jnp.where(stood[0] == 3, 7, 8), stood[0]),
        "Generator": _generators(m, stood[1:4]),
        "DomedPalace": _ruins(38, 148, jnp.where(stood[4] == 3, 14, 16), stood[4]),
        "BridgedBazaar": _ruins(96, 159, jnp.where(stood[5] == 3, 14, 16), stood[5]),
        "AquaPlane": _plane(stood[6]),
        "GorgonShip": ships.where(~bandit),
        "BanditBomber": ships.where(bandit),
        "Explosion": bang.clip(8, 21, 152, 124),
        "Projectile": _shots(m),
        "Deathray": box(m.ray_x, 92, 2, depth - 92, ray).clip(8, 0, 160, 210),
        "Score": box(left, 188, jnp.where(m.digits[0] == 10, 102, 103) - left, 10, left < 104,
                     value=100 * (m.score + jnp.where(m.lives == 255, 0, 10000 * m.tail))),
    }  # fmt: skip


def _pick(i: jax.Array, *values: int) -> jax.Array:
    out = jnp.full_like(i, values[-1])
    for k in reversed(range(len(values) - 1)):
        out = jnp.where(i == k, values[k], out)
    return out


def _drawn_x(m: Ram) -> jax.Array:
    return 15 * m.coarse + 6 - (m.fine >> 4)


def _ships(m: Ram, shown: jax.Array) -> tuple[Box, jax.Array]:
    """The ships as drawn, and which of them are bandits. A ship that left a lane in this frame is still drawn there."""
    x = _drawn_x(m)
    left_now = jnp.where(m.ship_x == 0, x, 0)
    here, above = jnp.zeros_like(x), jnp.zeros_like(x)
    for i in range(4):
        here = jnp.where((m.ship_lane == i) & (m.ship_waits == 0), x[i], here)
        above = jnp.where(m.ship_lane == i, left_now[i + 1], above) if i < 3 else above
    lane = jnp.where(here > 0, m.ship_lane, m.ship_lane + 1)
    x = at = shared(jnp.where(here > 0, here, above))  # computed once for both categories
    stage = m.ship_stage - jnp.where((m.clock & 7) == 0, 1, 0)
    wreck = jnp.where(m.ship_hit == 1, jnp.maximum(stage, 0), 0)
    bandit = m.ship_kind == 0x50
    flat = bandit | (m.ship_kind < 0x40)
    w = jnp.where(bandit, 9, _pick(wreck, 15, 11, 13, 15))
    inset = jnp.where(bandit, 4, _pick(wreck, 0, 3, 2, 1))
    inset = jnp.where(m.ship_right == 1, 16 - inset - w, inset)
    top, bottom, x = (
        jnp.where(flat | (wreck == 1), 1, 0),
        jnp.where(wreck == 1, 7, 8),
        x - 8 + inset,
    )
    nose = jnp.where(
        m.ship_right == 1, x + w - 8, 152 - x
    )  # columns of it in the picture, should its tail not be there yet
    long = flat & ~bandit & (wreck == 0)
    top = top + jnp.where(
        long, jnp.where(nose < 8, 3, jnp.where(nose < 11, 2, jnp.where(nose < 13, 1, 0))), 0
    )
    bottom = bottom - jnp.where(
        long, jnp.where(nose < 6, 3, jnp.where(nose < 9, 2, jnp.where(nose < 10, 1, 0))), 0
    )
    top, bottom = jnp.where(bandit & (nose < 6), 4, top), jnp.where(bandit & (nose < 6), 5, bottom)
    return box(x, 82 - 21 * lane + top, w, bottom - top, shown & (at > 0)).clip(
        8, 0, 152, 210
    ), bandit


def _shots(m: Ram) -> Box:
    y = m.shot_y - jnp.where(m.shot_speed == 0, 3, 2)  # as drawn
    top, high = 205 - y - jnp.where(y >= 0x61, 2, 0), y < 0
    for line in (0x6F, 0x79, 0x8D, 0xA1, 0xB5):
        top, high = top - jnp.where(y >= line, 1, 0), high | (y == line)
    # near the edges the beam comes to the shot before the program does, or after it
    first, from_left, from_right = jnp.arange(2) == 0, m.shot_speed > 0, m.shot_speed < 0
    out = y >= jnp.where(from_left, jnp.where(first, 0x57, 0x56), 0x5E)  # of the cannon
    late, early = (
        first & ((from_left & (y <= 0x5D)) | (from_right & (y >= 0xAE) & (y <= 0xB4))),
        from_right & (y == 0x60),
    )
    top, high = (
        top + jnp.where(late, 1, jnp.where(early, -1, 0)),
        high | early | (first & from_left & (y == 0x5E)),
    )
    return box(m.shot_x - m.shot_speed, top, 1, jnp.where(high, 2, 1), (m.shot_y > 0) & out).clip(
        8, 0, 152, 124
    )


def _land(x: jax.Array) -> jax.Array:
    x = jnp.where(x >= 80, x - 80, x)
    depth = jnp.full_like(x, LAND[0][1])
    for left, y in LAND[1:-1]:
        depth = jnp.where(x >= left, y, depth)
    return depth


def _ruins(x: Any, y: Any, w: Any, damage: jax.Array) -> Box:
    top = jnp.where(damage == 1, 1, 0)
    return box(
        x + jnp.where(damage == 3, 1, 0),
        y + top,
        w,
        jnp.where((damage > 0) & (damage < 4), 7, 8),
        damage < 5,
    )


def _generators(m: Ram, damage: jax.Array) -> Box:
    side, i = jnp.array((1, 0, 1)), jnp.arange(3)
    narrow = jnp.where(
        (m.pictures & 15) == 8, side, 0
    )  # the one on the left turns, the others widen
    w = jnp.where(damage == 3, 7, jnp.where((i == 2) & (damage == 4), 3, 8))
    x = jnp.where(damage == 0, narrow - 2 * side + 2, 0) + jnp.array((82, 60, 142))
    ruins = _ruins(x, jnp.array((124, 137, 137)), jnp.where(damage == 0, 4 - 2 * narrow, w), damage)
    return ruins.clip(0, 0, jnp.array((160, 160, 148)), 210)


def _plane(damage: jax.Array) -> Box:
    inset = _pick(damage, 0, 4, 3, 2, 1)
    w, top = _pick(damage, 16, 9, 11, 13, 15), _pick(damage, 171, 172, 171, 170)
    return box(16 + inset, top, w, _pick(damage, 7, 3, 6, 8), damage < 5)


def _ground() -> tuple[tuple[int, int, int, int], ...]:
    return tuple(
        (x + at, y, end + at, 210)
        for at in (0, 80)
        for (x, y), (end, _) in itertools.pairwise(LAND)
        if x + at > 0
    )


def _city(name: str, colors: Any, *regions: tuple[int, int, int, int], doc: str) -> Category:
    return Category(name, Bounds(colors, regions), count=len(regions), doc=doc)


GAME = Game(
    name="Atlantis",
    rom="atlantis",
    md5="9ad36e699ef6f45d9eb6c4cf90475c9f",
    ram=Ram,
    decode=decode,
    categories=(
        _city(
            "Sentry", CANNON, (0, 124, 8, 132), (152, 112, 160, 120), doc="left and right cannon"
        ),
        _city(
            "AcropolisCommandPost",
            (26, 42, 58, 74, 104),
            (72, 112, 80, 120),
            doc="the cannon in the middle",
        ),
        _city(
            "Generator",
            GENERATORS,
            (82, 124, 90, 132),
            (60, 137, 68, 145),
            (142, 137, 148, 145),
            doc="by the post, left, right",
        ),
        _city("DomedPalace", (60, 90, 204, 252), (38, 148, 54, 156), doc="under the dome"),
        _city(
            "BridgedBazaar",
            (12, 58, 74, 90, 106, 122, 138),
            (96, 159, 112, 167),
            doc="on the bridge",
        ),
        _city(
            "AquaPlane", (42, 58, 78, 90, 106, 138, 202), (16, 170, 32, 178), doc="on the sea bed"
        ),
        Category(
            "GorgonShip",
            Bounds(SHIP, LANES, exclude=("BanditBomber", "Projectile")),
            count=4,
            rgb=(187, 187, 53),
            doc="or a wreck",
        ),
        Category(
            "BanditBomber",
            Blobs(SHIP, SKY, min_size=(9, 7), max_size=(9, 7)),
            count=4,
            rgb=(125, 48, 173),
            doc="small and fast",
        ),
        Category("Explosion", Bounds(FIRE, SKY, min_size=(7, 10)), doc="of a bandit bomber"),
        Category(
            "Projectile", Blobs(SHOT, SKY, gap=(3, 2), max_size=(1, 2)), count=2, doc="the shots"
        ),
        Category(
            "Deathray",
            Bounds(GROUND, (8, 92, 160, 210), ignore=_ground()),
            blinks=True,
            doc="of a ship in the lowest lane",
        ),
        Category(
            "Score",
            Bounds(GOLD, (55, 188, 103, 198), value=DIGITS),
            attributes=("value",),
            hud=True,
            doc="points",
        ),
    ),
)
