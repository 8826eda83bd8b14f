"""Battlezone: a plain seen from inside a tank, with at most two enemies and two shots on it.

Screen: the radar is at the top, score and spare tanks are at the bottom. Radar_Content is the
radar's hand and two blips. Odd frames show the player's shot, even frames the enemy's. Mountains
and the lines of a crash are scenery. When the player is hit, the game draws the other objects on
every other frame only, and then only score and tanks stay valid.

Slots: an enemy is a blue or yellow tank, a red flyer, a boss, or an explosion. The slots of each of
these categories are the game's two records.

RAM: ALE's source (score, lives), OCAtari 2.2 and AtariARI (meaning of the records), a public
disassembly by Manuel Polik, and the ROM's drawing loop, which keeps the drawn columns, sizes, edge
masks and picture pointers. The game projects a shot before it draws the frame; `decode` reverts the
shot's step and the player's turn since then. Pixels that the loop draws left of the beam appear a
row lower, except shots.

Covered: modes 1-3, all enemies, explosions, crashes, game over, attract mode.

Not exact: blips before an odd frame are a pixel off, because the RAM does not keep their position.

VEM: it misses an enemy behind another one, and finds an enemy twice if it continues from the right
edge at the left.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Cells,
    Checks,
    Digits,
    Game,
    LifeIcons,
    RamMap,
    Rom,
    Shape,
    bits,
    box,
    byte,
    display,
    high,
    lookup,
    low,
    match,
    mirrored,
    pick,
    when,
    wrap,
)

ROM = Rom("battle_zone", "41f252a66c6301f1e8ab3612c19bc5d4")
FONT = ROM.font(0xD00, rows=8, dots=5)


class Kind:  # of `Ram.kind` and `Ram.drawn_kinds`; 0: none
    BLUE = 1
    YELLOW = 2
    EXPLODES = 3
    FLYER = 4
    BOSS = 5


# Pictures: 50 of tanks by angle and size, 3 of explosions, 10 of flyers and 10 of bosses by size.
EXPLOSIONS = 50
FLYERS = 53
BOSSES = 63
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
    """log2 of the pixels of a dot: `[picture, size]`."""
    nusiz = ROM.bytes(0xE8D, EXPLOSIONS)[:, None]  # of tanks; 5 and 7 make dots wider
    tanks = np.where(nusiz == 7, 2, np.where(nusiz == 5, 1, 0)).repeat(SIZES, 1)
    return np.vstack([tanks, np.tile((0, 0, 0, 0, 1, 1, 2, 2, 2, 2), (23, 1))])


ROWS = _picture_rows()
# By 10 * picture + size: dots used in any row; << 8 in the lowest row; << 16 the zoom.
USED = np.stack([np.bitwise_or.reduce(ROWS[:, :height], axis=1) for height in HEIGHTS], axis=1)
DOTS_USED = (USED | ROWS[:, :1] << 8 | _zooms() << 16).ravel()
# By 256 * picture + dots: rows that contain any of these dots, the lowest in bit 0.
ROWS_WITH = ((ROWS[:, None] & np.arange(256)[:, None]) != 0).dot(1 << np.arange(17)).ravel()

# The hand of the radar by its angle from straight down.
HAND_WIDTH = (2, 4, 5, 7, 8, 10, 10, 11, 11, 11, 10, 10, 8, 7, 5, 4, 2)
HAND_TOP = (19, 19, 19, 19, 19, 19, 19, 19, 19, 17, 15, 12, 10, 7, 6, 5, 4)
HAND_HEIGHT = (16, 17, 14, 13, 10, 7, 5, 3, 1, 3, 5, 8, 10, 13, 14, 15, 16)

SINES = ROM.bytes(0x1EFA, 65)  # 256 per step, by 64ths of a right angle
# The enemy's shot subtracts this from its position in a step, by direction.
STEP_SIDE = np.concatenate((-SINES[:64], -SINES[63::-1], SINES[1:], SINES[:0:-1]))
STEP_AHEAD = np.concatenate((SINES[:0:-1], -SINES[1:], -SINES[63::-1], SINES[:64]))
DEPTHS = 128  # of shots in view


def _line_of_depth(depth: int, limits: np.ndarray, line: int, step: int) -> int:
    """The line that the game's search finds for a depth; several lines share a limit."""
    if limits[line] == depth:
        return line
    if step == 0:
        return int(np.searchsorted(limits, depth))
    next_line = line + step if limits[line] < depth else line - step
    return _line_of_depth(depth, limits, next_line, step >> 1)


# Lines by depth: the player's shot, then the enemy's.
SEARCHES = ((ROM.bytes(0x1F85, 47), 23, 12), (ROM.bytes(0x1F52, 51), 25, 13))
SHOT_LINES = [_line_of_depth(depth, *search) for search in SEARCHES for depth in range(DEPTHS)]

NEW_SHOT = np.array((53, 117))  # `shot_time` of a new shot: the player's, the enemy's
CRASH_BEGINS = 128  # `crash` on its first frame
CRASH_FLICKERS = 88  # least `crash` at which every frame shows the picture


class Stick:  # bits of `Ram.stick`
    UP = 1
    DOWN = 2
    LEFT = 4
    RIGHT = 8


# A move of the player reduces a shot's distance by this, without and with a turn.
STRAIGHT_MOVE = 127
TURNING_MOVE = 31
MIDDLE = 79  # column
NO_BLIP = 31  # least `blip_y` of an absent blip
NO_DIGIT = 10  # a blank instead of a leading zero
GREEN = 202
WHITE = 14
TEXT = 180
PLAIN = (0, 86, 160, 140)


class Ram(RamMap):
    frame = byte(0)
    digits = bits((30, 29), first=4, count=12)  # of the thousands, a nibble each
    # As drawn: the nearer and the farther enemy.
    picture = byte(46, 52)
    size = byte(47, 53)
    x = byte(48, 54)
    mask = byte(49, 55)  # visible dots
    mirrored = bits(51, 57, first=3)
    drawn_kinds = byte(62)  # a nibble per enemy
    lives = low(58)
    crash = byte(65)  # counts down
    distance = byte(69, 77)  # of the two records
    kind = byte(73, 81)  # of the two records
    blip_y = byte(82, 83)  # 34 - y; 255: none
    blip_x = byte(98, 99)  # x - 84
    hand = byte(84)  # 32 per turn
    # The player's shot and the enemy's; directions are 256 a turn, positions 256 a step.
    shot_direction = byte(91, 85)
    shot_time = byte(96, 90)  # counts down
    shot_side = byte((92, 93), (86, 87))
    shot_ahead = byte((94, 95), (88, 89))
    stick = high(104)  # a pressed direction has bit 0
    crosshair_color = byte(108)
    shots = bits(97, first=6, count=2)  # a bit for each shot in flight


def decode(m: Ram) -> dict[str, Box]:
    normal = (m.crash == 0) | (m.crash >= CRASH_FLICKERS)
    boxes, kind = _by_record(m, *_enemy_boxes(m))
    enemies = boxes.where(normal)
    return {
        "Player": box(19, 140, 122, 37, normal),
        "Crosshair": box(78, 79, 1, 6, normal, color=m.crosshair_color),
        "Blue_Tank": enemies.where(kind <= Kind.BLUE),
        "Yellow_Blue_Tank": enemies.where(kind == Kind.YELLOW),
        "Red_Thing": enemies.where(kind == Kind.FLYER),
        "Boss": enemies.where(kind >= Kind.BOSS),
        "Explosion": enemies.where(kind == Kind.EXPLODES),
        "Shot": _shots(m).where(normal),
        "Radar": box(74, 3, 22, 33, normal),
        "Radar_Content": _radar(m).where(normal),
        "Score": _score_box(m),
        "Life": _lives_box(m),
    }


def _lives_box(m: Ram) -> Box:
    place = np.arange(5)
    drawn = m.lives + when(m.crash == CRASH_BEGINS, 1)
    return box(65 + 8 * place, 190, 6, 5, place < drawn)


def _score_box(m: Ram) -> Box:
    """The last three digits are always 0."""
    digits = m.digits >> np.array((0, 4, 8)) & 15
    shown = jnp.sum(when(digits < NO_DIGIT, 1))
    value = jnp.sum(when(digits < NO_DIGIT, digits) * np.array((1000, 10000, 100000)))
    return box(90 - 8 * shown, 180, 21 + 8 * shown, 8, value=value)


def _enemy_boxes(m: Ram) -> tuple[Box, jax.Array]:
    """Tight boxes of the visible parts of the nearer and the farther enemy, and their kinds."""
    kind = m.drawn_kinds >> np.array((0, 4)) & 15
    size = jnp.minimum(m.size, SIZES - 1)
    picture = match(
        (kind <= Kind.YELLOW, jnp.minimum(m.picture, EXPLOSIONS - 1)),
        (kind == Kind.EXPLODES, EXPLOSIONS + jnp.minimum(m.picture, 2)),
        (kind >= Kind.BOSS, BOSSES + size),
        otherwise=FLYERS + size,
    )
    dots, lowest, x, zoom = _shown_dots(m, SIZES * picture + size)
    left = x + (31 - lax.clz(dots & -dots) << zoom)
    right = x + (32 - lax.clz(dots) << zoom)
    used_rows = lookup(ROWS_WITH, 256 * picture + jnp.where(m.mirrored > 0, dots, mirrored(dots)))
    seen_rows = used_rows & ((1 << pick(size, HEIGHTS)) - 1)
    below = pick(size, LAST_LINES)
    first = 32 - lax.clz(seen_rows & -seen_rows)
    last = 32 - lax.clz(seen_rows)
    # Left of the beam, the last row of the lower enemy lasts one more row.
    left_of_beam = (dots & lowest & ((1 << _dots_within(15 - x, zoom)) - 1)) != 0
    late = left_of_beam & (2 * below <= jnp.sum(below))
    height = last - first + 1 + when(late, 1)
    return box(left, 139 - below - last, right - left, height, seen_rows > 0), kind


def _shown_dots(m: Ram, index: jax.Array) -> tuple[jax.Array, ...]:
    """Visible dots, dots in the lowest row (bit 0 is leftmost), its column, the zoom."""
    entry = lookup(DOTS_USED, index)
    zoom = entry >> 16
    masked = entry & (m.mask << 8 | m.mask)
    drawn = jnp.where(m.mirrored > 0, masked, mirrored(masked))
    shows = drawn & 255
    lowest = drawn >> 8
    x = wrap(_column(m.x) + when(zoom > 0, 1))  # the chip draws wide dots a pixel later
    # A picture may appear at both edges: the larger part counts.
    beyond = -1 << _dots_within(160 - x, zoom)
    wraps = lax.population_count(shows & beyond) > lax.population_count(shows & ~beyond)
    part = jnp.where(wraps, beyond, ~beyond)
    return shows & part, lowest, jnp.where(wraps, x - 160, x), zoom


def _column(x: jax.Array) -> jax.Array:
    """Column at which the game's loop positions a sprite: it is late for the leftmost columns."""
    return match((x >= 17, x), (x >= 5, x - 5), otherwise=x + 160)


def _dots_within(pixels: jax.Array, zoom: jax.Array) -> jax.Array:
    """Number of a picture's dots that begin within a number of pixels."""
    return jnp.clip((pixels + (1 << zoom) - 1) >> zoom, 0, 8)


def _by_record(m: Ram, enemies: Box, kind: jax.Array) -> tuple[Box, jax.Array]:
    """The nearer and the farther enemy in the order of their records."""
    closer = (kind[0] != m.kind[1]) | (m.distance[0] < m.distance[1])
    first_is_near = jnp.where(kind[0] == m.kind[0], closer, jnp.max(m.kind) == 0)
    is_near = first_is_near == (np.arange(2) == 0)
    fields = (enemies.x, enemies.y, enemies.w, enemies.h, enemies.valid, kind)
    in_order = [jnp.where(is_near, near, far) for near, far in fields]
    return box(*in_order[:5]), in_order[5]


def _shots(m: Ram) -> Box:
    """The player's shot as on the last odd frame, the enemy's as on the last even frame."""
    side, ahead = _shots_drawn(m)
    away = side >> 8
    depth = ahead >> 8
    is_right = away < 128
    in_view = (depth < DEPTHS) & (depth + 2 >= jnp.where(is_right, away, 256 - away))
    not_new = m.shot_time < NEW_SHOT + jnp.stack([m.frame & 1, 0])
    seen = not_new & (depth >= np.array((0, 8)))
    distance = _projected(jnp.where(is_right, side, 0xFFFF - side), ahead)
    place = jnp.where(is_right, MIDDLE + distance, MIDDLE - distance)
    x = wrap(_column(jnp.where((place <= 0) | (place >= 159), 1, place)) - 1)
    line = lookup(SHOT_LINES, (depth & 127) + np.array((0, DEPTHS)))
    width = match((line < 10, 4), (line < 35, 2), otherwise=1)
    there = in_view & seen & (m.shots >> np.arange(2) & 1 > 0)
    return box(x, 140 - line, width, 3, there).clip(*PLAIN)


def _shots_drawn(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Positions of the shots before their last step and the player's last move."""
    side_before_step = m.shot_side + lookup(STEP_SIDE, m.shot_direction)
    ahead_before_step = m.shot_ahead + lookup(STEP_AHEAD, m.shot_direction)
    side, ahead = _before_move(m, side_before_step, ahead_before_step)
    moved = jnp.stack([m.frame & 1 == 0, jnp.bool_(True)])
    drawn_side = jnp.where(moved, side, m.shot_side) & 0xFFFF
    return drawn_side, jnp.where(moved, ahead, m.shot_ahead) & 0xFFFF


def _before_move(m: Ram, side: jax.Array, ahead: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Positions before the player's last move: the game's arithmetic for the opposite turn."""
    from_side = _signed_word(side)
    turn = _pressed(m, Stick.RIGHT, Stick.LEFT)
    back = _pressed(m, Stick.DOWN, Stick.UP)
    move = back * jnp.where(turn == 0, STRAIGHT_MOVE, TURNING_MOVE)
    from_ahead = _signed_word(ahead) - move
    turned_side = from_side + turn * 6 * (from_ahead >> 8) - abs(turn) * (from_side >> 12)
    turned_ahead = from_ahead - turn * 6 * (from_side >> 8) - abs(turn) * (from_ahead >> 12)
    return turned_side, turned_ahead


def _signed_word(word: jax.Array) -> jax.Array:
    """A 16-bit number with the sign in the highest bit."""
    return (word & 0xFFFF ^ 0x8000) - 0x8000


def _pressed(m: Ram, forth: int, back: int) -> jax.Array:
    """1 if the first direction is pressed, otherwise -1 if the second is, otherwise 0."""
    return match((m.stick & forth == 0, 1), (m.stick & back == 0, -1), otherwise=0)


def _projected(side: jax.Array, ahead: jax.Array) -> jax.Array:
    """Pixels from the middle of the screen: the game's division of two 16-bit numbers."""
    zeros = jnp.maximum(jnp.minimum(lax.clz(side), lax.clz(ahead)) - 16, 1)
    shift = jnp.where(ahead >> 8 == 0, 0, zeros)
    rest = (side << shift) >> 8 & 255
    divisor = (ahead << shift) >> 8 & 255
    begin = Division(rest, divisor, share=jnp.zeros_like(side))
    share = functools.reduce(_next_bit, range(7, -1, -1), begin).share
    return ((share >> 2) + share + 1 & 255) >> 1


class Division(NamedTuple):
    """The game's division, which finds one bit of the result per step."""

    rest: jax.Array
    divisor: jax.Array
    share: jax.Array


def _next_bit(before: Division, bit: int) -> Division:
    fits = before.rest >= before.divisor
    rest = before.rest - when(fits, before.divisor)
    large = when(rest >= 128, 1)  # the game halves the divisor instead of doubling the rest
    share = before.share | when(fits, 1 << bit)
    return Division(rest << 1 - large, before.divisor >> large, share)


def _radar(m: Ram) -> Box:
    """The hand and the two blips."""
    direction = (m.hand - when((m.frame & 3) == 1, 1)) & 31
    angle = jnp.minimum(direction, 32 - direction)
    width = pick(angle, HAND_WIDTH)
    hand_x = jnp.where(direction < 16, 86 - width, 84)
    x = jnp.append(hand_x, (m.blip_x + 84) & 255)
    y = jnp.append(pick(angle, HAND_TOP), 34 - m.blip_y)
    w = jnp.append(width, jnp.ones(2, jnp.int32))
    h = jnp.append(pick(angle, HAND_HEIGHT), jnp.ones(2, jnp.int32))
    return box(x, y, w, h, jnp.append(True, m.blip_y < NO_BLIP))


# The lines of a crash may have any object's colours; the crosshair is not on that screen.
on_plain = functools.partial(Category, needs=("Crosshair",))
enemy_category = functools.partial(on_plain, count=2)
enemy_blobs = functools.partial(Blobs, region=PLAIN, gap=(1, 1), shapes=Shape(w=(2, 32), h=(2, 18)))
flyer_blobs = functools.partial(enemy_blobs, gap=(2, 4), shapes=Shape(w=(1, 32), h=(2, 18)))
RED = (2, 64, 66, 70, 72, 74)
FLYER_RGB = (74, 74, 74)
BLUE_RGB = (24, 80, 128)
CROSSHAIR = Blobs((0, 46), (70, 74, 88, 90), Shape(w=1, h=6))
CONTENT = Blobs(WHITE, (75, 4, 95, 36), Shape(w=(1, 12), h=(1, 18)), gap=(0, 1))
PLAYER = Bounds((194, 2, 4), (19, 140, 141, 177), min_size=(122, 37))
SCORE = Bounds(TEXT, (66, 180, 112, 188), value=Digits(FONT, range(66, 114, 8), 180))
LIVES = Cells(TEXT, tuple(range(65, 105, 8)), (190,) * 5, 6, 5, whole=False)

GAME = Game(
    name="BattleZone",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        rare=("Red_Thing",),
        lives=(LifeIcons(("Life",)),),
    ),
    categories=(
        on_plain("Player", PLAYER, rgb=(26, 102, 26), role="player", doc="the player's tank"),
        Category("Crosshair", CROSSHAIR, doc="yellow when an enemy is in it"),
        enemy_category(
            "Blue_Tank", enemy_blobs((6, 162, 166), first=(6, 166)), rgb=BLUE_RGB, doc="enemy"
        ),
        enemy_category(
            "Yellow_Blue_Tank", enemy_blobs((40, 8, 162), first=40), rgb=BLUE_RGB, doc="enemy"
        ),
        enemy_category(
            "Red_Thing",
            flyer_blobs(RED, first=(70, 72, 74)),
            rgb=FLYER_RGB,
            doc="flyer, with its shadow",
        ),
        enemy_category("Boss", flyer_blobs((44, 0, 2), first=44), doc="with its shadow"),
        enemy_category(
            "Explosion", enemy_blobs((24, 82, 68), gap=(5, 4)), rgb=(184, 50, 50), doc="of an enemy"
        ),
        on_plain(
            "Shot",
            Blobs(WHITE, PLAIN, Shape(w=(1, 8), h=(1, 4))),
            count=2,
            doc="player's, enemy's",
        ),
        on_plain("Radar", Bounds(GREEN, (74, 3, 96, 36), min_size=(22, 33)), doc="its rim"),
        on_plain("Radar_Content", CONTENT, count=3, doc="hand and blips"),
        display("Score", SCORE, role="score", doc="points"),
        display("Life", LIVES, count=5, attributes=(), role="lives", doc="tanks left"),
    ),
)
