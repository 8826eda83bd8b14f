"""Carnival: a gun below three rows of targets, a wheel of pipes, and a sign that offers a bonus.

Picture: docs/games/Carnival.png

Screen: the beam's late blank hides the leftmost eight columns of the rows. The lines, the foot of
the wheel and the stand of the sign are scenery. PlayerScore stays valid while a text replaces it
between levels. The bar with its last bullets and a hit sign stay valid while they blink.

Slots: targets of all four kinds have a slot for each place in the game's six groups of at most
three: group * 3 + copy, the lowest row first. Ducks that come down eat bullets: FlyingDuck has
first the duck that comes down, then the duck that eats on the bar.

RAM: ALE's source (score), OCAtari 2.2 (meaning of the tables), and the ROM's code. Groups and shots
move before they are drawn. Flying ducks and the wheel move after it, and only at the end of a
counter of three frames; `decode` reverts this. The loop that draws the shot covers rows of
different numbers of lines, so each of the shot's steps has its own top and height.

Covered: several levels, ducks that fly and eat, bonuses and penalties, the end of the game.

Not exact: the RAM lacks these facts, each for a single frame: a hit flying duck, its position when
it turns, the wheel while its last pipe is hit.

VEM: it takes a rabbit's last column for bullets and misses its first two columns alone.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from ocjax.authoring import (
    WIDTH as SCREEN_WIDTH,
    Blobs,
    Bounds,
    Box,
    Category,
    Game,
    Gauge,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Shape,
    bcd,
    bits,
    box,
    byte,
    copies,
    display,
    div,
    flag,
    lookup,
    match,
    mirrored,
    modulo_screen,
    pick,
    spacing,
    when,
)

ROM = Rom("carnival", "028024fb8e5e5f18ea586652f9799c96")
FONT = ROM.font(0xD00, rows=7, stride=8)

SCORE = NumberDisplay(FONT, right=104, top=2, digits=5, leading_zeros=True)


class Kind:  # of `Ram.group_kind` and `Ram.munch`: low bytes of the pictures' addresses
    DUCK = 0x00
    RABBIT = 0x10
    OWL = 0x20
    BULLETS = 0x30
    NONE = 0x5C


class Sign:  # of `Ram.sign`: low bytes of the pictures' addresses
    PLUS_BULLETS = 0x1E
    NONE = 0x4F
    MINUS_BULLETS = 0xA6
    MINUS = 0xB1


NO_WHEEL = 84  # `wheel`
WHEEL_PICTURES = 16  # pictures of 13 rows before the wheel's first one
SIGN_TUNE = 20  # `tune` while the sign has its other colour
NO_DUCK = 79  # `duck_y`
LAST_STEP = 1  # `tick` on the last frame before slow objects move
LAST_BITE = 3  # `eater_x` at the left end of the bullets
CHEWED = 10  # `chew` at which an eating duck has moved; also at 0

# Top and height of the shot, for every fifth of its steps.
SHOTS = np.array(
    (
        *((15, 3), (18, 3), (0, 0), (21, 5), (25, 5), (30, 5), (35, 5), (40, 7), (47, 2), (49, 5)),
        *(
            (54, 5),
            (59, 3),
            (62, 7),
            (69, 5),
            (74, 5),
            (79, 4),
            (83, 6),
            (89, 5),
            (94, 5),
            (99, 12),
        ),
        *((111, 5), (115, 5), (120, 5), (125, 5), (130, 6), (135, 5), (140, 5), (145, 5), (150, 6)),
        *((155, 5), (160, 5), (165, 5), (170, 6), (175, 5)),
    )
)

LEFT_EDGE = 8  # first column of the rows
TARGET = 8  # columns of a target
# Parts of targets: 1-7 are that many last columns, 9-15 are 1-7 first columns.
WHOLE = 0
FIRST = 8


def _part_rows(kind: int, is_mirrored: bool, part: int) -> np.ndarray:
    """Rows of a part of a target, from the top."""
    rows = mirrored(PICTURE_ROWS[kind]) if is_mirrored else PICTURE_ROWS[kind]
    if part == WHOLE:
        return rows
    return rows & (-256 >> part - FIRST if part > FIRST else (1 << part) - 1)


PICTURE_ROWS = ROM.rows((0xE00, 0xE10, 0xE20, 0xE30), 15)
PARTS = Pictures.of(
    (_part_rows(k, bool(m), p) for k in range(4) for m in range(2) for p in range(16)),
    kind=4,
    mirrored=2,
    part=16,
)

GROUP = np.arange(18) // 3  # by slot of the targets
COPY = np.arange(18) % 3  # by slot
RIGHTWARD = GROUP >> 1 != 1  # in the rows that go to the right
ROWS_AREA = (8, 47, 160, 104)
WHEEL_COLORS = (148, 194, 100, 36)
SIGN_COLORS = (72, 56)
BARS = (146, 192, 100, 34)
YELLOW = 24
GRAY = 10
RED = 72
GREEN = 182
BRIGHT = 234
WHITE = 232


class Ram(RamMap):
    duck_y = byte(1)  # y - 110
    player_x = byte(2)  # x + 4
    bullets = byte(3)
    shot_x = byte(4)  # x + 5
    sign = byte(7)  # picture
    amount = byte(9)  # picture
    munch = byte(11)  # picture of a duck that eats
    tune = byte(16)  # current tune
    clock = byte(17)
    group_x = byte(*range(18, 24))  # x + 4; lowest row first
    group_kind = byte(*range(24, 36, 2))  # picture
    group_copies = bits(*range(36, 42), count=3)  # NUSIZ
    duck_speed = bits(43, count=4)
    duck_right = bits(43, first=6)
    duck_left = flag(43, bit=7)
    score = bcd((45, 46))  # tens
    shot_y = byte(55)  # steps
    bar = byte(57, 58, 60, 61)  # a bit per unit
    bar_ends = bits(59, 62, first=4, count=4)  # a bit per unit
    chew = byte(79)  # counts to 20
    tick = byte(81)  # counts to 0; then slow objects have moved after the drawing
    sign_on = byte(102)
    eater_x = byte(109)  # x + 3
    duck_x = byte(111)  # x + 4
    wheel = byte(121)  # picture
    wheel_color = bits(125, count=2)


def decode(m: Ram) -> dict[str, Box]:
    kind = _kinds(m)
    targets = _target_boxes(m, kind)
    sign_box, amount_box = _sign_boxes(m)
    return {
        "Player": box(m.player_x - 4, 186, 6, 13),
        "PlayerMissile": _shot(m),
        "Wheel": _wheel(m),
        "Duck": targets.where(kind == Kind.DUCK),
        "Rabbit": targets.where(kind == Kind.RABBIT),
        "Owl": targets.where(kind == Kind.OWL),
        "ExtraBullets": targets.where(kind == Kind.BULLETS),
        "FlyingDuck": _ducks(m),
        "PlayerScore": SCORE.box(m.score, value=10 * m.score),
        "AmmoBar": _bar_box(m),
        "BonusSign": sign_box,
        "BonusValue": amount_box,
    }


def _moved(m: Ram) -> jax.Array:
    """True if slow objects have moved since the frame was drawn."""
    return m.tick == 0


def _shot(m: Ram) -> Box:
    step = div(m.shot_y, 5)
    top = lookup(SHOTS[:, 0], step)
    height = lookup(SHOTS[:, 1], step)
    return box(m.shot_x - 5, top, 1, height, m.shot_y > 0)


def _wheel(m: Ram) -> Box:
    shown = div(m.wheel + 12, 13) - WHEEL_PICTURES
    phase = jnp.where(_moved(m), (m.clock - 1) >> 2 & 3, shown)
    x = jnp.where(phase == 2, 72, 70)
    width = jnp.where((phase == 0) | (phase == 3), 28, 26)
    color = pick(jnp.where(_moved(m), (m.clock - 1) >> 4 & 3, m.wheel_color), WHEEL_COLORS)
    return box(x, 15, width, 12, m.wheel != NO_WHEEL, color=color)


def _kinds(m: Ram) -> jax.Array:
    """Pictures of the targets; a duck that has just left the lowest row is still drawn."""
    leaves = (m.duck_y == 0) & _moved(m) & (m.group_x == m.duck_x)
    left_row = leaves & (m.group_kind == Kind.NONE) & (np.arange(6) < 2)
    return jnp.repeat(jnp.where(left_row, Kind.DUCK, m.group_kind), 3)


def _target_boxes(m: Ram, kind: jax.Array) -> Box:
    """All copies of all groups; at the edges of the rows only their visible parts."""
    first_x = m.group_x + 156
    apart = spacing(m.group_copies)
    count = copies(m.group_copies)
    x = modulo_screen(jnp.repeat(first_x, 3) + jnp.repeat(apart, 3) * COPY)
    there = jnp.repeat(count, 3) > COPY
    at_right = jnp.where(x > SCREEN_WIDTH - TARGET, FIRST + SCREEN_WIDTH - x, WHOLE)
    part = jnp.where(x < LEFT_EDGE, x, at_right)
    index = PARTS.index(kind=kind >> 4, mirrored=np.where(RIGHTWARD, 1, 0), part=part)
    return PARTS.box(index, x, 89 - 21 * (GROUP >> 1), valid=there).clip(*ROWS_AREA)


def _ducks(m: Ram) -> Box:
    """The duck that comes down, then the duck that eats bullets."""
    is_last_step = m.tick == LAST_STEP
    y = 110 + m.duck_y - when(~is_last_step, m.duck_speed)
    x = m.duck_x - 4 - when(_moved(m), jnp.where(m.duck_left, -1, m.duck_right))
    flies = (m.duck_y != NO_DUCK) & ((m.duck_y > 0) | is_last_step)
    has_chewed = (m.chew == 0) | (m.chew == CHEWED)
    eater_x = m.eater_x - 3 + when(has_chewed, 2)
    eats_last = (m.bullets == 0) & (m.eater_x == LAST_BITE) & (m.chew == 0)  # it has just gone
    eats = (m.munch != Kind.NONE) | eats_last
    return Box.stacked(
        box(x, y, 16, 15, flies, color=YELLOW), box(eater_x, 203, 6, 6, eats, color=WHITE)
    )


def _bar_box(m: Ram) -> Box:
    units = lax.population_count(m.bar).sum() + lax.population_count(m.bar_ends).sum()
    return box(0, 203, 4 * units, 5, value=m.bullets)


def _sign_boxes(m: Ram) -> tuple[Box, Box]:
    """Plus or minus, and the points or bullets."""
    there = (m.sign_on > 0) & (m.sign != Sign.NONE)
    minus = m.sign == Sign.MINUS
    minus_bullets = m.sign == Sign.MINUS_BULLETS
    color = jnp.where(m.tune == SIGN_TUNE, SIGN_COLORS[1], SIGN_COLORS[0])
    y = match((minus, 32), (minus_bullets, 31), otherwise=29)
    height = match((minus, 3), (minus_bullets, 4), otherwise=9)
    bullets = minus_bullets | (m.sign == Sign.PLUS_BULLETS)
    left = jnp.where(bullets, 20, 22)
    top = jnp.where(bullets, 33, 29)
    width = jnp.where(bullets, 42 - 4 * div(m.amount + 2, 9), 22)  # pictures of 9 rows
    amount_box = box(left, top, width, jnp.where(bullets, 5, 9), there, color=color)
    return box(12, y, 6, height, there, color=color), amount_box


row_category = functools.partial(Category, count=18)
row_blobs = functools.partial(Blobs, region=ROWS_AREA, gap=(1, 5))

MISSILE = Bounds(BRIGHT, (7, 14, 160, 185), ignore=((72, 29, 96, 37),))
RABBITS = row_blobs(GRAY, shapes=Shape(w=(1, 8), h=(10, 15)))
CLIPS = row_blobs(GRAY, shapes=Shape(w=(1, 8), h=9))
FLYING = Bounds((YELLOW, WHITE), ((8, 105, 160, 180), (0, 203, 160, 210)))
PLUS_MINUS = Bounds(SIGN_COLORS, (12, 29, 18, 38))
AMOUNT = Bounds(SIGN_COLORS, (20, 29, 44, 38))
BAR = Bounds(BARS, (0, 203, 160, 208), value=Gauge(4))

GAME = Game(
    name="Carnival",
    rom=ROM,
    ram=Ram,
    decode=decode,
    screen=(214, 160),
    categories=(
        Category("Player", Bounds(GREEN, (8, 186, 160, 199)), role="player", doc="the gun"),
        Category("PlayerMissile", MISSILE, doc="the shot"),
        Category("Wheel", Bounds(WHEEL_COLORS, (66, 14, 104, 29)), doc="pipes, until all are hit"),
        row_category("Duck", row_blobs(YELLOW, shapes=Shape(w=(1, 8), h=(1, 15))), doc="in a row"),
        row_category("Rabbit", RABBITS, doc="in a row"),
        row_category("Owl", row_blobs(RED, shapes=Shape(w=(1, 8), h=(1, 15))), doc="in a row"),
        row_category("ExtraBullets", CLIPS, doc="a box with an 8 in a row"),
        Category("FlyingDuck", FLYING, count=2, doc="coming down; eating bullets"),
        display(
            "PlayerScore", SCORE.rule(WHITE), role="score", doc="points without the last digit"
        ),
        display("AmmoBar", BAR, blinks=True, doc="bullets left"),
        display("BonusSign", PLUS_MINUS, blinks=True, attributes=(), doc="plus or minus"),
        display("BonusValue", AMOUNT, blinks=True, attributes=(), doc="points or bullets"),
    ),
)
