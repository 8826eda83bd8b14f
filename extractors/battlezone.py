"""Battlezone: from inside a tank, up to two enemies and a shot on a plain; a radar above, score and tanks left below.

An enemy is a blue or yellow tank, a red flyer, a boss, or its explosion; the two slots of each category are the game's own two records.
Both players' shots share a sprite and take turns, the player's on odd frames. Radar_Content is the radar's hand and the two blips.
Scenery: mountains, the lines of the crash. When the player is hit only score and lives are shown, at first every other frame.

RAM: ALE's source (score, lives), OCAtari 2.2 and AtariARI (what the records are), a public disassembly by Manuel Polik, and the ROM's
drawing loop: places, sizes, masks at the edges and pointers to pictures are kept as drawn. A shot is put into perspective before that:
the enemy's has moved on by then and is taken back, but not the player's own turn in that frame (a pixel or two).
What the drawing loop does left of the beam sits a row lower. `_data`: the pictures' columns, rows by distance, steps by direction.

Covered: modes 1-3, all enemies, explosions, crashes, game over, attract mode. VEM: who is before another hides him.
"""

import functools
import pathlib

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from ocjax.boxes import Box, box
from ocjax.digits import Digits, hex_font
from ocjax.game import Game
from ocjax.ops import shared
from ocjax.ram import RamMap, bits, byte, high, low
from ocjax.rules import Blobs, Bounds, Category, Cells

GREEN, WHITE, TEXT = 202, 14, 180
PLAIN = (0, 86, 160, 140)
GLYPHS = ("7098989898989870", "e0606060606060f0", "70181870c0c0c070", "f0181870181818f0", "909090f830303030",
          "f08080f0181818f0", "708080f098989870", "f010103838101010", "7098987098989870", "f09898f8181818f0")  # fmt: skip
with np.load(pathlib.Path(__file__).parent / "_data" / "battlezone.npz") as data:
    PICTURES = data[
        "pictures"
    ]  # [73, 8]: rows of each column, the lowest first; from bit 20 on how wide a pixel is
    # [256] enemy's and player's shots, [66] of 256 steps a pixel
    DEPTH, SPEED = (data[name].astype(np.int32) for name in ("depth", "speed"))
TANKS, EXPLOSIONS, FLYERS, BOSSES = 0, 50, 53, 63  # first pictures
HEIGHT = np.array((2, 3, 4, 5, 7, 9, 10, 13, 15, 17), np.int32)
SIZES = (
    np.array((42, 41, 41, 41, 39, 38, 38, 35, 34, 34), np.int32) | HEIGHT << 8
)  # row below pictures of each size, counted from below
# By picture and size a bit for each column that has pixels << 8 has one in the lowest row; << 16 the same from right to left.
_INK = (
    np.stack(
        np.broadcast_arrays(PICTURES[:, None] & (1 << HEIGHT[:, None]) - 1, PICTURES[:, None] & 1)
    )
    > 0
)
FILLED = (
    np.packbits(
        np.stack([_INK[0, ..., ::-1], _INK[1, ..., ::-1], _INK[0], _INK[1]], axis=2), axis=-1
    )
    .reshape(-1, 4)
    .view("<i4")[:, 0]
)
# The hand's width, << 8 top and << 16 height by direction from straight down.
HAND = np.array((2, 4, 5, 7, 8, 10, 10, 11, 11, 11, 10, 10, 8, 7, 5, 4, 2), np.int32)
HAND |= np.array((19, 19, 19, 19, 19, 19, 19, 19, 19, 17, 15, 12, 10, 7, 6, 5, 4), np.int32) << 8
HAND |= np.array((16, 17, 14, 13, 10, 7, 5, 3, 1, 3, 5, 8, 10, 13, 14, 15, 16), np.int32) << 16


class Ram(RamMap):
    frame = byte(0)
    thousands = high(29)  # 10: not shown
    ten_thousands, hundred_thousands = low(30), high(30)
    picture, size = byte(46, 52), byte(47, 53)  # of the nearer and the farther enemy
    x = byte(48, 54)
    mask = byte(49, 55)  # columns that show
    mirrored = bits(51, 57, first=3)
    lives = low(58)
    near_kind, far_kind = low(62), high(62)
    crash = byte(65)  # counts down
    kind = byte(73, 81)  # of the two records: 0 none, 1 blue, 2 yellow, 3 explodes, 4 flyer, 5 boss
    distance = byte(69, 77)
    blip_y = byte(82, 83)  # 34 - y; 255: none
    blip_x = byte(98, 99)  # x - 84
    hand = byte(84)
    direction = byte(85)  # of the enemy's shot
    shot_side, shot_ahead = byte((86, 87)), byte((88, 89))  # 256 a step
    own_side, own_ahead = byte((92, 93)), byte((94, 95))
    enemy_fires, own_fires = bits(97, first=7), bits(97, first=6)
    shot_size = bits(102, first=4, count=2)


def decode(m: Ram) -> dict[str, Box]:
    drawn = jnp.where(m.crash > 0, m.crash + 1, 0)
    normal = (drawn == 0) | ((drawn >= 0x58) & (drawn & 1 == 1))
    enemies, kind = _enemies(m)
    enemies = enemies.where(normal)
    digits = jnp.stack([m.thousands, m.ten_thousands, m.hundred_thousands])
    shown = jnp.sum(jnp.where(digits < 10, 1, 0))
    score = jnp.sum(jnp.where(digits < 10, digits, 0) * np.array((1000, 10000, 100000)))
    return {
        "Player": box(19, 140, 122, 37, normal),
        "Crosshair": box(78, 79, 1, 6, normal),
        "Blue_Tank": enemies.where(kind <= 1),
        "Yellow_Blue_Tank": enemies.where(kind == 2),
        "Red_Thing": enemies.where(kind == 4),
        "Boss": enemies.where(kind >= 5),
        "Explosion": enemies.where(kind == 3),
        "Shot": _shot(m).where(normal),
        "Radar": box(74, 3, 22, 33, normal),
        "Radar_Content": _radar(m).where(normal),
        "Score": box(90 - 8 * shown, 180, 21 + 8 * shown, 8, value=score),
        "Life": box(65 + 8 * jnp.arange(5), 190, 6, 5, jnp.arange(5) < m.lives),
    }


def _enemies(m: Ram) -> tuple[Box, jax.Array]:
    """Tight boxes of what the masks leave of the two records' pictures, and their kinds."""
    kind, size = jnp.stack([m.near_kind, m.far_kind]), jnp.minimum(m.size, 9)
    other = jnp.where(
        kind == 3,
        EXPLOSIONS + jnp.minimum(m.picture, 2),
        jnp.where(kind >= 5, BOSSES, FLYERS) + size,
    )
    picture = jnp.where(kind < 3, jnp.minimum(m.picture, EXPLOSIONS - 1), other)
    columns, filled = jnp.asarray(PICTURES)[picture], jnp.asarray(FILLED)[10 * picture + size]
    zoom = jnp.where(
        kind < 3, columns[:, 0] >> 20, jnp.where(size < 4, 0, jnp.where(size < 6, 1, 2))
    )
    filled = filled >> jnp.where(
        m.mirrored > 0, 16, 0
    )  # columns from the screen's left, as all bits from here on
    shows = filled & jnp.where(m.mirrored > 0, m.mask, _reversed(m.mask)) & 255
    x = jnp.where(m.x >= 17, m.x, jnp.where(m.x >= 5, m.x - 5, m.x + 160)) + jnp.where(
        zoom > 0, 1, 0
    )
    x = jnp.where(x >= 160, x - 160, x)
    over = -1 << _columns(
        160 - x, zoom
    )  # at the edge a picture may show on both sides: the larger part counts
    wraps = lax.population_count(shows & over) > lax.population_count(shows & ~over)
    shows = shows & jnp.where(wraps, over, ~over)
    shows, x = shared((shows, jnp.where(wraps, x - 160, x)))
    left, right = x + (31 - lax.clz(shows & -shows) << zoom), x + (32 - lax.clz(shows) << zoom)
    ink = jnp.where(m.mirrored > 0, _reversed(shows), shows)  # the picture's columns
    every = functools.reduce(
        jnp.bitwise_or, (columns[:, i] & (ink << (31 - i) >> 31) for i in range(8))
    )
    sizes = jnp.asarray(SIZES)[size]
    every, below = shared(every & ((1 << (sizes >> 8)) - 1)), sizes & 255
    first, last = 32 - lax.clz(every & -every), 32 - lax.clz(every)
    # the last row goes on left of the beam
    twice = (shows & filled >> 8 & ((1 << _columns(15 - x, zoom)) - 1) > 0) & (
        2 * below <= jnp.sum(below)
    )
    near, far = m.kind[0] > 0, m.kind[1] > 0
    first_near = jnp.where(
        m.near_kind == m.kind[0],
        (m.near_kind != m.kind[1]) | (m.distance[0] < m.distance[1]),
        ~(near | far),
    )
    order = jnp.where(
        first_near, jnp.arange(2), 1 - jnp.arange(2)
    )  # the nearer is the first record or the second one
    pairs = (
        left,
        139 - below - last,
        right - left,
        last - first + 1 + jnp.where(twice, 1, 0),
        jnp.where(every > 0, 1, 0),
        kind,
    )
    pairs = [jnp.where(order == 0, p[0], p[1]) for p in pairs]
    left, top, width, height, seen, kind = shared(pairs)  # computed once for five categories
    return box(left, top, width, height, seen > 0), kind


def _columns(pixels: jax.Array, zoom: jax.Array) -> jax.Array:
    """How many of a picture's columns begin in so many pixels."""
    return jnp.clip((pixels + (1 << zoom) - 1) >> zoom, 0, 8)


def _reversed(byte: jax.Array) -> jax.Array:
    for mask, n in ((0x55, 1), (0x33, 2), (0x0F, 4)):
        byte = (byte & mask) << n | byte >> n & mask
    return byte


def _shot(m: Ram) -> Box:
    """The player's shot on odd frames, the enemy's on even ones, put into perspective as the game does it."""
    own = m.frame & 1 == 1
    quarter = m.direction >> 6
    step = (m.direction & 63) + jnp.where((quarter == 1) | (quarter == 2), 1, 0)
    sine, cosine = jnp.asarray(SPEED)[step], jnp.asarray(SPEED)[64 - step]
    back_side = jnp.where(
        quarter == 0, -sine, jnp.where(quarter == 1, -cosine, jnp.where(quarter == 2, sine, cosine))
    )
    back_ahead = jnp.where(
        quarter == 0, cosine, jnp.where(quarter == 1, -sine, jnp.where(quarter == 2, -cosine, sine))
    )
    side = jnp.where(own, m.own_side, (m.shot_side + back_side) & 0xFFFF)
    ahead = jnp.where(own, m.own_ahead, (m.shot_ahead + back_ahead) & 0xFFFF)
    away, depth = side >> 8, ahead >> 8
    fires = jnp.where(own, m.own_fires > 0, (m.enemy_fires > 0) & (depth >= 8))
    seen = (depth < 128) & (depth + 2 >= jnp.where(away < 128, away, 256 - away)) & fires
    offset = jnp.where(away < 128, side, 0xFFFF - side)
    shift = jnp.where(
        depth == 0, 0, jnp.maximum(jnp.minimum(lax.clz(offset), lax.clz(ahead)) - 16, 1)
    )
    rest, divisor, share = (offset << shift) >> 8 & 255, (ahead << shift) >> 8 & 255, jnp.int32(0)
    for bit in range(7, -1, -1):
        fits = rest >= divisor
        rest, share = (
            jnp.where(fits, rest - divisor, rest),
            jnp.where(fits, share | 1 << bit, share),
        )
        large = rest >= 128
        rest, divisor = jnp.where(large, rest, rest << 1), jnp.where(large, divisor >> 1, divisor)
    share = ((share >> 2) + share + 1 & 255) >> 1
    x = jnp.where(away < 128, 79 + share, 79 - share)
    x = jnp.where((x <= 0) | (x >= 0x9F), 1, x) - 1
    late = jnp.where(x < 32, 1, 0)
    top = 140 - jnp.asarray(DEPTH)[jnp.where(own, 128, 0) + (depth & 127)]
    return box(x, top + late, 1 << m.shot_size, 3 - late, seen).clip(*PLAIN)


def _radar(m: Ram) -> Box:
    direction = (m.hand - jnp.where(m.frame & 3 == 1, 1, 0)) & 31
    hand = jnp.asarray(HAND)[jnp.minimum(direction, 32 - direction)]
    w, top, h = hand & 255, hand >> 8 & 255, hand >> 16
    x = jnp.append(jnp.where(direction < 16, 86 - w, 84), (m.blip_x + 84) & 255)
    one = jnp.ones(2, jnp.int32)
    return box(
        x,
        jnp.append(top, 34 - m.blip_y),
        jnp.append(w, one),
        jnp.append(h, one),
        jnp.append(True, m.blip_y < 31),
    )


POINTS = Digits(hex_font(GLYPHS, 8, (1, 1)), (66, 74, 82, 90, 98, 106), 180)
enemy = functools.partial(Blobs, region=PLAIN, min_size=(2, 2), max_size=(32, 18))
GAME = Game(
    name="BattleZone",
    rom="battle_zone",
    md5="41f252a66c6301f1e8ab3612c19bc5d4",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            Bounds((194, 2, 4), (19, 140, 141, 177), min_size=(122, 37)),
            rgb=(26, 102, 26),
            doc="the player's tank",
        ),
        Category(
            "Crosshair",
            Blobs((0, 46), (70, 74, 88, 90), min_size=(1, 6), max_size=(1, 6)),
            doc="yellow when an enemy is in it",
        ),
        Category(
            "Blue_Tank", enemy((6, 162, 166), gap=(1, 1), first=(6, 166)), count=2, doc="enemy"
        ),
        Category(
            "Yellow_Blue_Tank", enemy((40, 8, 162), gap=(1, 1), first=40), count=2, doc="enemy"
        ),
        Category(
            "Red_Thing",
            enemy((2, 64, 66, 70, 72, 74), gap=(2, 4), first=(70, 72, 74)),
            count=2,
            doc="flyer, with its shadow",
        ),
        Category("Boss", enemy((44, 0, 2), gap=(2, 4), first=44), count=2, doc="with its shadow"),
        Category(
            "Explosion",
            enemy((24, 82, 68), gap=(5, 4), max_size=(32, 18), first=(24, 82)),
            count=2,
            doc="of an enemy",
        ),
        Category("Shot", Blobs(WHITE, PLAIN, max_size=(8, 4)), doc="of the player or an enemy"),
        Category("Radar", Bounds(GREEN, (74, 3, 96, 36), min_size=(22, 33)), doc="its rim"),
        Category(
            "Radar_Content",
            Blobs(WHITE, (75, 4, 95, 35), gap=(1, 1), max_size=(12, 18)),
            count=3,
            doc="hand and blips",
        ),
        Category(
            "Score",
            Bounds(TEXT, (66, 180, 112, 188), value=POINTS),
            attributes=("value",),
            hud=True,
            doc="points",
        ),
        Category(
            "Life",
            Cells(TEXT, tuple(range(65, 105, 8)), (190,) * 5, 6, 5, whole=False),
            count=5,
            hud=True,
            doc="tanks left",
        ),
    ),
)
