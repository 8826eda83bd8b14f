"""Battlezone: a plain seen from inside a tank, with up to two enemies and one shot on it.

A radar stands above, score and spare tanks below. An enemy is a blue or yellow tank, a red flyer, a
boss, or an explosion; the slots of each of these categories are the game's two records. The
player's shot is drawn on odd frames, the enemy's on even ones. Radar_Content is the radar's hand
and two blips. Mountains and the lines of a crash are scenery. When the player is hit, only score
and tanks stay valid; at first the rest shows on every other frame.

RAM: ALE's source (score, lives), OCAtari 2.2 and AtariARI (what the records are), a public
disassembly by Manuel Polik, and the ROM's drawing loop, which keeps columns, sizes, edge masks and
pointers to pictures as drawn. A shot is projected before that: the enemy's has moved on by then and
is taken back, but not the player's own turn in that frame (a pixel or two). What the loop draws
left of the beam shows a row lower.

Covered: modes 1-3, all enemies, explosions, crashes, game over, attract mode. VEM cannot see an
enemy that stands behind another one.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from ocjax.boxes import Box, box
from ocjax.console import mirrored, wrap
from ocjax.digits import Digits
from ocjax.game import Game
from ocjax.ops import lookup, pick, shared
from ocjax.ram import RamMap, bits, byte, high, low
from ocjax.rom import Rom
from ocjax.rules import Blobs, Bounds, Category, Cells

ROM = Rom("battle_zone", "41f252a66c6301f1e8ab3612c19bc5d4")
FONT = ROM.font(0xD00, rows=8, dots=5)

BLUE, YELLOW, EXPLODES, FLYER, BOSS = range(1, 6)  # kinds of enemies; 0: none

# Pictures: 50 of tanks by angle and size, 3 of explosions, 10 of flyers and 10 of bosses by size.
EXPLOSIONS, FLYERS, BOSSES = 50, 53, 63
SIZES = 10
LAST_LINES = ROM.bytes(0x81B, SIZES).tolist()  # counted upwards
HEIGHTS = (ROM.bytes(0x811, SIZES) - LAST_LINES).tolist()


def _picture_rows() -> np.ndarray:
    """All rows of all pictures, the lowest first: `[picture, row]`."""
    pages = [0x9] * 39 + [0xA] * 11 + [0xC] * 3 + [0xD] * 10 + [0x8] * 10
    tables = ((0xCAF, 50), (0x902, 3), (0x8D4, 10), (0x839, 10))
    low_bytes = np.concatenate([ROM.bytes(at, count) for at, count in tables])
    offsets = (np.array(pages) << 8 | low_bytes) + 1
    return ROM.rows(offsets.tolist(), HEIGHTS[-1], top_first=True)


def _zooms() -> np.ndarray:
    """Of all pictures in all sizes, log2 of the pixels of a dot: `[picture, size]`."""
    nusiz = ROM.bytes(0xE8D, EXPLOSIONS)  # of tanks; 5 and 7 make dots wider
    tanks = np.where(nusiz == 7, 2, np.where(nusiz == 5, 1, 0))
    others = np.array((0, 0, 0, 0, 1, 1, 2, 2, 2, 2))
    return np.vstack([tanks[:, None].repeat(SIZES, 1), np.tile(others, (23, 1))])


ROWS = _picture_rows()
# By 10 * picture + size: dots used in any row; << 8 in the lowest row; << 16 the zoom.
USED = np.stack([np.bitwise_or.reduce(ROWS[:, :height], axis=1) for height in HEIGHTS], axis=1)
DOTS_USED = (USED | ROWS[:, :1] << 8 | _zooms() << 16).ravel()
# By 256 * picture + dots: rows in which any of these dots is set, the lowest in bit 0.
ROWS_WITH = ((ROWS[:, None] & np.arange(256)[:, None]) > 0).dot(1 << np.arange(17)).ravel()

# The hand of the radar by its angle from straight down.
HAND_WIDTH = (2, 4, 5, 7, 8, 10, 10, 11, 11, 11, 10, 10, 8, 7, 5, 4, 2)
HAND_TOP = (19, 19, 19, 19, 19, 19, 19, 19, 19, 17, 15, 12, 10, 7, 6, 5, 4)
HAND_HEIGHT = (16, 17, 14, 13, 10, 7, 5, 3, 1, 3, 5, 8, 10, 13, 14, 15, 16)

SINES = ROM.bytes(0x1EFA, 65)  # 256 a step, by 64ths of a right angle
# What a step of the enemy's shot takes from its position, by direction.
STEP_SIDE = np.concatenate((-SINES[:64], -SINES[63::-1], SINES[1:], SINES[:0:-1]))
STEP_AHEAD = np.concatenate((SINES[:0:-1], -SINES[1:], -SINES[63::-1], SINES[:64]))
DEPTHS = 128  # of shots in view


def _lines(limits: np.ndarray, middle: int, step: int) -> list[int]:
    """The line of each depth as the game's search finds it, as several lines share a limit."""
    out = []
    for depth in range(DEPTHS):
        line, jump = middle, step
        while jump and limits[line] != depth:
            line += jump if limits[line] < depth else -jump
            jump >>= 1
        out.append(line if limits[line] == depth else int(np.searchsorted(limits, depth)))
    return out


# Of the enemy's shot by depth, then of the player's.
SHOT_LINES = _lines(ROM.bytes(0x1F52, 51), 25, 13) + _lines(ROM.bytes(0x1F85, 47), 23, 12)

CRASH_FLICKERS = 0x58  # from this count on the picture still shows on odd counts
NO_DIGIT = 10  # a blank instead of a leading zero
GREEN, WHITE, TEXT = 202, 14, 180
PLAIN = (0, 86, 160, 140)


class Ram(RamMap):
    frame = byte(0)
    thousands = high(29)
    ten_thousands = low(30)
    hundred_thousands = high(30)
    # What was drawn of the nearer and of the farther enemy.
    picture = byte(46, 52)
    size = byte(47, 53)
    x = byte(48, 54)
    mask = byte(49, 55)  # dots that show
    mirrored = bits(51, 57, first=3)
    near_kind = low(62)
    far_kind = high(62)
    lives = low(58)
    crash = byte(65)  # counts down
    distance = byte(69, 77)  # of the two records
    kind = byte(73, 81)  # of the two records
    blip_y = byte(82, 83)  # 34 - y; 255: none
    blip_x = byte(98, 99)  # x - 84
    hand = byte(84)  # 32 a turn
    direction = byte(85)  # of the enemy's shot, 256 a turn
    shot_side = byte((86, 87))  # 256 a step
    shot_ahead = byte((88, 89))  # 256 a step
    own_side = byte((92, 93))  # 256 a step
    own_ahead = byte((94, 95))  # 256 a step
    own_fires = bits(97, first=6)
    enemy_fires = bits(97, first=7)
    shot_size = bits(102, first=4, count=2)  # log2 of its width


def decode(m: Ram) -> dict[str, Box]:
    crash = m.crash + 1  # as the frame was drawn
    normal = (m.crash == 0) | ((crash >= CRASH_FLICKERS) & ((crash & 1) == 1))
    enemies, kind = _by_record(m, *_enemies(m))
    enemies = enemies.where(normal)
    return {
        "Player": box(19, 140, 122, 37, normal),
        "Crosshair": box(78, 79, 1, 6, normal),
        "Blue_Tank": enemies.where(kind <= BLUE),
        "Yellow_Blue_Tank": enemies.where(kind == YELLOW),
        "Red_Thing": enemies.where(kind == FLYER),
        "Boss": enemies.where(kind >= BOSS),
        "Explosion": enemies.where(kind == EXPLODES),
        "Shot": _shot(m).where(normal),
        "Radar": box(74, 3, 22, 33, normal),
        "Radar_Content": _radar(m).where(normal),
        "Score": _score(m),
        "Life": box(65 + 8 * np.arange(5), 190, 6, 5, np.arange(5) < m.lives),
    }


def _score(m: Ram) -> Box:
    """The last three digits are always 0."""
    digits = jnp.stack([m.thousands, m.ten_thousands, m.hundred_thousands])
    shown = jnp.sum(jnp.where(digits < NO_DIGIT, 1, 0))
    value = jnp.sum(jnp.where(digits < NO_DIGIT, digits, 0) * np.array((1000, 10000, 100000)))
    return box(90 - 8 * shown, 180, 21 + 8 * shown, 8, value=value)


def _enemies(m: Ram) -> tuple[Box, jax.Array]:
    """Tight boxes of what shows of the nearer and the farther enemy, and their kinds."""
    kind = jnp.stack([m.near_kind, m.far_kind])
    size = jnp.minimum(m.size, SIZES - 1)
    picture = _pictures(m, kind, size)
    dots, lowest, x, zoom = shared(_dots(m, SIZES * picture + size))
    left = x + (31 - lax.clz(dots & -dots) << zoom)
    right = x + (32 - lax.clz(dots) << zoom)
    rows = lookup(ROWS_WITH, 256 * picture + jnp.where(m.mirrored > 0, dots, mirrored(dots)))
    rows = rows & ((1 << pick(size, HEIGHTS)) - 1)
    below = pick(size, LAST_LINES)
    first, last = 32 - lax.clz(rows & -rows), 32 - lax.clz(rows)
    # Left of the beam the last row of the lower enemy goes on for one more row.
    late = (dots & lowest & ((1 << _dots_within(15 - x, zoom)) - 1)) > 0
    late = late & (2 * below <= jnp.sum(below))
    height = last - first + 1 + jnp.where(late, 1, 0)
    return box(left, 139 - below - last, right - left, height, rows > 0), kind


def _pictures(m: Ram, kind: jax.Array, size: jax.Array) -> jax.Array:
    tank = jnp.minimum(m.picture, EXPLOSIONS - 1)
    explosion = EXPLOSIONS + jnp.minimum(m.picture, 2)
    sized = jnp.where(kind >= BOSS, BOSSES, FLYERS) + size
    other = jnp.where(kind == EXPLODES, explosion, sized)
    return jnp.where(kind <= YELLOW, tank, other)


def _dots(m: Ram, index: jax.Array) -> tuple[jax.Array, ...]:
    """Dots that show, dots in the lowest row (bit 0 is the leftmost one), its column, the zoom."""
    entry = lookup(DOTS_USED, index)
    zoom = entry >> 16
    drawn = entry & (m.mask << 8 | m.mask)
    drawn = jnp.where(m.mirrored > 0, drawn, mirrored(drawn))
    shows, lowest = drawn & 255, drawn >> 8
    column = jnp.where(m.x >= 17, m.x, jnp.where(m.x >= 5, m.x - 5, m.x + 160))
    x = wrap(column + jnp.where(zoom > 0, 1, 0))  # the chip draws wide dots a pixel later
    # A picture may show at both edges: the larger part counts.
    beyond = -1 << _dots_within(160 - x, zoom)
    wraps = lax.population_count(shows & beyond) > lax.population_count(shows & ~beyond)
    part = jnp.where(wraps, beyond, ~beyond)
    return shows & part, lowest, jnp.where(wraps, x - 160, x), zoom


def _dots_within(pixels: jax.Array, zoom: jax.Array) -> jax.Array:
    """How many dots of a picture begin within a number of pixels."""
    return jnp.clip((pixels + (1 << zoom) - 1) >> zoom, 0, 8)


def _by_record(m: Ram, enemies: Box, kind: jax.Array) -> tuple[Box, jax.Array]:
    """The nearer and the farther enemy in the order of their records."""
    closer = (m.near_kind != m.kind[1]) | (m.distance[0] < m.distance[1])
    none = (m.kind[0] == 0) & (m.kind[1] == 0)
    first_is_near = jnp.where(m.near_kind == m.kind[0], closer, none)
    is_near = first_is_near == (np.arange(2) == 0)
    fields = (enemies.x, enemies.y, enemies.w, enemies.h, enemies.valid, kind)
    x, y, w, h, valid, kind = shared([jnp.where(is_near, v[0], v[1]) for v in fields])
    return box(x, y, w, h, valid), kind


def _shot(m: Ram) -> Box:
    """The player's shot on odd frames, the enemy's on even ones, projected as the game does it."""
    own = (m.frame & 1) == 1
    side = jnp.where(own, m.own_side, m.shot_side + lookup(STEP_SIDE, m.direction)) & 0xFFFF
    ahead = jnp.where(own, m.own_ahead, m.shot_ahead + lookup(STEP_AHEAD, m.direction)) & 0xFFFF
    away, depth = side >> 8, ahead >> 8
    is_right = away < 128
    fires = jnp.where(own, m.own_fires > 0, (m.enemy_fires > 0) & (depth >= 8))
    in_view = depth + 2 >= jnp.where(is_right, away, 256 - away)
    distance = _projected(jnp.where(is_right, side, 0xFFFF - side), ahead)
    x = jnp.where(is_right, 79 + distance, 79 - distance)
    x = jnp.where((x <= 0) | (x >= 0x9F), 1, x) - 1
    late = jnp.where(x < 32, 1, 0)
    line = lookup(SHOT_LINES, jnp.where(own, DEPTHS, 0) + (depth & 127))
    there = (depth < DEPTHS) & in_view & fires
    return box(x, 140 - line + late, 1 << m.shot_size, 3 - late, there).clip(*PLAIN)


def _projected(side: jax.Array, ahead: jax.Array) -> jax.Array:
    """Pixels from the middle of the screen: the game's division of two numbers of 16 bits."""
    shift = jnp.maximum(jnp.minimum(lax.clz(side), lax.clz(ahead)) - 16, 1)
    shift = jnp.where(ahead >> 8 == 0, 0, shift)
    rest = (side << shift) >> 8 & 255
    divisor = (ahead << shift) >> 8 & 255
    share = jnp.int32(0)
    for bit in range(7, -1, -1):
        fits = rest >= divisor
        rest = jnp.where(fits, rest - divisor, rest)
        share = jnp.where(fits, share | 1 << bit, share)
        is_large = rest >= 128
        rest = jnp.where(is_large, rest, rest << 1)
        divisor = jnp.where(is_large, divisor >> 1, divisor)
    return ((share >> 2) + share + 1 & 255) >> 1


def _radar(m: Ram) -> Box:
    """The hand and the two blips."""
    direction = (m.hand - jnp.where((m.frame & 3) == 1, 1, 0)) & 31
    angle = jnp.minimum(direction, 32 - direction)
    width = pick(angle, HAND_WIDTH)
    hand_x = jnp.where(direction < 16, 86 - width, 84)
    x = jnp.append(hand_x, (m.blip_x + 84) & 255)
    y = jnp.append(pick(angle, HAND_TOP), 34 - m.blip_y)
    w = jnp.append(width, jnp.ones(2, jnp.int32))
    h = jnp.append(pick(angle, HAND_HEIGHT), jnp.ones(2, jnp.int32))
    return box(x, y, w, h, jnp.append(True, m.blip_y < 31))


enemies = functools.partial(Category, count=2)
enemy = functools.partial(Blobs, region=PLAIN, min_size=(2, 2), max_size=(32, 18))
tank, flyer = functools.partial(enemy, gap=(1, 1)), functools.partial(enemy, gap=(2, 4))
RED = (2, 64, 66, 70, 72, 74)
EXPLOSION = enemy((24, 82, 68), gap=(5, 4), first=(24, 82))
CROSSHAIR = Blobs((0, 46), (70, 74, 88, 90), min_size=(1, 6), max_size=(1, 6))
CONTENT = Blobs(WHITE, (75, 4, 95, 35), gap=(1, 1), max_size=(12, 18))
PLAYER = Bounds((194, 2, 4), (19, 140, 141, 177), min_size=(122, 37))
SCORE = Bounds(TEXT, (66, 180, 112, 188), value=Digits(FONT, range(66, 114, 8), 180))
LIVES = Cells(TEXT, tuple(range(65, 105, 8)), (190,) * 5, 6, 5, whole=False)

GAME = Game(
    name="BattleZone",
    rom=ROM.name,
    md5=ROM.md5,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", PLAYER, rgb=(26, 102, 26), doc="the player's tank"),
        Category("Crosshair", CROSSHAIR, doc="yellow when an enemy is in it"),
        enemies("Blue_Tank", tank((6, 162, 166), first=(6, 166)), doc="enemy"),
        enemies("Yellow_Blue_Tank", tank((40, 8, 162), first=40), doc="enemy"),
        enemies("Red_Thing", flyer(RED, first=(70, 72, 74)), doc="flyer, with its shadow"),
        enemies("Boss", flyer((44, 0, 2), first=44), doc="with its shadow"),
        enemies("Explosion", EXPLOSION, doc="of an enemy"),
        Category("Shot", Blobs(WHITE, PLAIN, max_size=(8, 4)), doc="of the player or an enemy"),
        Category("Radar", Bounds(GREEN, (74, 3, 96, 36), min_size=(22, 33)), doc="its rim"),
        Category("Radar_Content", CONTENT, count=3, doc="hand and blips"),
        Category("Score", SCORE, attributes=("value",), hud=True, doc="points"),
        Category("Life", LIVES, count=5, hud=True, doc="tanks left"),
    ),
)
