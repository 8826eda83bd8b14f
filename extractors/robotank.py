"""Robotank: the view from a tank that fights enemy tanks by day, by night and in fog.

Picture: docs/games/Robotank.png

Screen: enemies come one at a time. The whole view bobs as the tank drives. Player_Crosshair is the
sight with both lines and the visible part of a flying shell inside it. PlayerShot is the shell's
shadow on the ground. Sky, mountains, ground and explosions are scenery. While a message, noise or a
broken sensor blanks the view, no object in it is valid. Objects as black as the night ground are
invalid until a shot lights them, and so are objects in fog of their colour. The radar still shows
the enemy. Score counts this squadron's hit tanks, Squadrons the completely destroyed squadrons.
Both are black, and not valid before a black sky: while the vision sensor is broken and during
messages, which follow each lost tank, announce the weather and end the game.

RAM: ALE's source (score, lives), OCAtari (meaning of some bytes), and the ROM's code. Its two banks
alternate with each call. The game computes a frame completely before it draws it. Only the enemy's
next direction is chosen later; it affects the next frame.

Covered: day, night and fog, all broken sensors, lost tanks, the end of the game.

Not exact: in fog, shots in front of ground stripes of their colour.

VEM: in fog it misses shots that touch stripes of their colour. At night it sees a black shadow on a
bright stripe. It misses an enemy or its shot when they touch, and a radar dot that touches the
beam. It may take part of an enemy behind the sight for a shadow. It reads Score only in the first
squadron.
"""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Area,
    Blobs,
    Bounds,
    Box,
    ByColor,
    Category,
    Checks,
    Colors,
    Digits,
    Game,
    Gauge,
    Number,
    Pictures,
    RamMap,
    Rom,
    Shape,
    bcd,
    bits,
    box,
    byte,
    display,
    div,
    edges,
    extremes,
    match,
    mod,
    pick,
    when,
)

ROM = Rom("robotank", "4f618c2429138e0280969193ed6c107e")
FONT = ROM.font(0xF00, rows=8)
SECOND_BANK = 0x1000

VIEW_ROW = 99  # screen row of the drawing loop's row 0 in a level view
VIEW_BOTTOM = 129  # the row below it
BOBBING = (0, 1, 2, 2, 1, 0, -1, -2, -3, -4, -4, -3, -2, -1)  # rows, by half of `stride`
VIEW_LEFT = 8
FOG_ROWS = 7  # rows below `VIEW_ROW` with fog over the ground
FOG_COLOR = 8
TANK_ROWS = 12  # of the nearest enemy
DISTANCES = 16
ASPECTS = 16  # views of the enemy around its axis
HIDDEN = 12  # least distance of an invisible enemy
HALVED = 8  # least distance at which half a picture suffices
BLANK = 0xEC2  # offset in the second bank of a picture without dots
SHOT_LEFT = 75  # of the shell's shadow
SHOT_BEGINS = 40  # first column at which the chip shows the enemy's shot in its first row
RADAR_LEFT = 24  # x of a dot at 0
RADAR_BOTTOM = 172  # row of a dot at 0
BEAM_LEFT = 15  # x of a beam at 0
BEAM_BOTTOM = 173  # row of a beam at 0
NOWHERE = 48  # row of an absent dot or enemy shot
ICON_LEFT = 32
# Right edges of icon rows, by number of icons.
ICON_WIDTHS = (0, 6, 14, 23, 31, 39, 47, 56, 64, 72, 80, 88, 96)
SQUADRON = 12  # tanks
TENS_LEFT = 58  # of the day
DAY_LEFT = 66
CLOCK_RIGHT = 106
NOISE = 63  # `lost` below this: noise on all frames
WHITE = 14
GREY = 12  # of the clock beside a message
GREEN = 214
RED = 68
BLACK = 0
PINK = 102
PURPLE = 96
RADAR = (56, 141, 104, 172)


END_ROWS = ROM.bytes(0xD2F, DISTANCES)  # the drawing loop's row after an enemy, by distance


def _enemy_offsets() -> np.ndarray:
    """Start offsets of the halves of an enemy's picture, int32 `[2, distances, aspects]`."""
    distance = np.arange(DISTANCES)[:, None]
    aspect = np.arange(ASPECTS)
    seen_from = np.where(aspect < 8, aspect, 15 - aspect)
    base = ROM.bytes(0xD3F, 16, 2)[seen_from] + 256 * (ROM.bytes(0xD40, 16, 2)[seen_from] & 15)
    rows = END_ROWS[distance] + 1
    left_end = base + ROM.bytes(0xD4F, DISTANCES)[distance]
    right_end = left_end + ROM.bytes(0xD5C, DISTANCES)[distance]
    small = distance >= HALVED
    turned = aspect >= 8
    left = left_end - rows
    right = np.where(small, BLANK, right_end) - rows
    halves = np.where(turned ^ small, np.stack([right, left]), np.stack([left, right]))
    return np.where(distance >= HIDDEN, BLANK, halves)


def _enemy_pictures() -> Pictures:
    """The halves of the enemy, by distance and aspect."""
    rows = ROM.rows((SECOND_BANK + _enemy_offsets() + 1).ravel().tolist(), TANK_ROWS)
    last = np.broadcast_to(END_ROWS[:, None], (2, DISTANCES, ASPECTS)).ravel()
    shown = np.arange(TANK_ROWS) < TANK_ROWS - last[:, None]
    return Pictures.of(np.where(shown, rows, 0), half=2, distance=DISTANCES, aspect=ASPECTS)


ENEMIES = _enemy_pictures()
BEAMS = Pictures.of(ROM.rows([SECOND_BANK + 0x900 + 16 * i for i in range(16)], 16))
SHELLS = Pictures.of([np.array([row]) for row in range(256)])
DIGIT_EXTENTS = Pictures.of(np.array(FONT.glyphs))


class Broken:  # bits of `Ram.broken`
    TREADS = 1
    CANNON = 2
    RADAR = 4
    VISION = 8


class Ground:  # of `Ram.ground`
    NIGHT = 2
    FOG = 6


class Blinding:  # of `Ram.blank`
    BLACK = 64  # the vision sensor is broken; otherwise the view flashes


class Ram(RamMap):
    left_x = byte(34)  # of the enemy's halves; 0: out of view
    right_x = byte(35)
    nearness = byte(37)  # of the enemy
    missile_row = byte(38)  # the drawing loop's rows of the enemy's shot
    missile_end = byte(39)
    reserve = bits(40, count=4)  # tanks
    hour = bcd(49)
    hits = byte(53)  # hit tanks of this squadron
    squadrons = byte(54)
    day = bcd(55)
    stride = byte(60)  # of the view's bobbing, 0 to 27
    missile_x = byte(62)  # x + 1 of the left half of the enemy's shot
    missile_right = byte(63)  # x + 1 of the right half
    aspect = byte(69)  # side of the enemy that faces the player
    missile_size = bits(70, first=4, count=2)
    shell_row = byte(71)
    shell_end = byte(72)
    shell_dots = byte(73)
    lost = byte(75)  # frames of the pause after the player's tank is lost
    burst = byte(76)  # frames of the enemy's explosion
    gone = byte(77)  # frames until the next enemy comes
    turned = byte(78)  # above 0: pictures are mirrored
    clock = byte(1)
    blank = byte(88)  # not 0: the view is blank
    color = byte(93)  # of the enemy and of all shots
    ground = byte(95)  # set bits in the ground's colours
    beam_x = byte(97)  # of the radar's beam
    dot_x = byte(98)  # of the radar's dot
    beam_row = byte(99)
    dot_row = byte(100)
    beam_way = bits(101, first=4, count=4)  # number of its picture
    beam_turned = byte(103)  # above 0: its picture is mirrored
    message = byte(106)  # frames left of a message
    broken = byte(118)


def decode(m: Ram) -> dict[str, Box]:
    screen = ~_is_noise(m)
    view = screen & (m.message == 0) & (m.blank == 0)
    sky = screen & (m.message == 0) & (m.blank != Blinding.BLACK)
    sight = view & (m.gone == 0)
    lit = sight & ~_is_dark(m)
    lift = pick(mod(m.stride >> 1, len(BOBBING)), BOBBING)
    return {
        "Player_Crosshair": box(72, 82 + lift, 16, 23).where(sight),
        "PlayerShot": _shell_box(m, lift).where(lit),
        "EnemyTank": _enemy_box(m, lift).where(lit),
        "EnemyShot": _missile_box(m, lift).where(lit),
        "Radar": box(8, 139, 152, 33, screen),
        "RadarBeam": _beam_box(m).where(screen),
        "EnemyRadarPosition": _dot_box(m).where(screen),
        "VisionSensor": _sensor_box(m, 44, 142, Broken.VISION).where(screen),
        "RadarSensor": _sensor_box(m, 108, 142, Broken.RADAR).where(screen),
        "CanonSensor": _sensor_box(m, 44, 158, Broken.CANNON).where(screen),
        "TreadSensor": _sensor_box(m, 108, 158, Broken.TREADS).where(screen),
        "Score": _icons(m.hits, 22, SQUADRON * m.squadrons + m.hits).where(sky),
        "Squadrons": _icons(m.squadrons, 33, m.squadrons).where(sky),
        "Lives": _icons(m.reserve, 175, m.reserve + 1).where(screen),
        "Clock": _clock_box(m).where(screen),
    }


def _is_noise(m: Ram) -> jax.Array:
    """True if noise fills the screen: after a loss first on some frames, then on all."""
    return (m.lost > 0) & ((m.lost < NOISE) | ((m.clock & 3) == 0))


def _is_dark(m: Ram) -> jax.Array:
    """True if the enemy and its shot are as black as the ground."""
    return (m.ground == Ground.NIGHT) & (m.color < 2)


def _unhidden(m: Ram, lift: jax.Array) -> tuple[int, Number, int, int]:
    """Area of the view without fog in the colour of the enemy and all shots."""
    fog = (m.ground == Ground.FOG) & (m.color == FOG_COLOR)
    return VIEW_LEFT, when(fog, VIEW_ROW + FOG_ROWS + lift), 160, VIEW_BOTTOM


def _enemy_box(m: Ram, lift: jax.Array) -> Box:
    distance = 15 - (m.nearness >> 4)
    mirrored = m.turned > 0
    halves = jnp.arange(2)
    index = ENEMIES.index(half=halves, distance=distance, aspect=m.aspect & 15)
    first, first_row, width, rows = ENEMIES.extent(index, mirrored=mirrored)
    x = jnp.stack([m.left_x, m.right_x])
    seen = (x > 0) & (width > 0)
    left, right = extremes(seen, x + first, x + first + width)
    top, bottom = extremes(seen, first_row, first_row + rows)
    y = VIEW_ROW - TANK_ROWS + lift
    there = (m.burst == 0) & jnp.any(seen)
    return edges(left, y + top, right, y + bottom, there, color=m.color).clip(*_unhidden(m, lift))


def _missile_box(m: Ram, lift: jax.Array) -> Box:
    """Two halves, side by side or overlapping."""
    x = m.missile_x - 1
    size = 1 << m.missile_size
    right = jnp.maximum(x, m.missile_right - 1) + size
    end = m.missile_end - when(m.missile_end >= 128, 256)
    top = VIEW_ROW + lift - m.missile_row + when(x + size <= SHOT_BEGINS, 1)
    # The loop for this row turns the right half off after this column.
    ends = match((end >= 0, 52), (end == -1, 112), (end > -6, 43), otherwise=37)
    bottom = VIEW_ROW + lift - end + when(m.missile_right - 1 < ends, 1)
    shot = edges(x, top, right, bottom, m.missile_row != NOWHERE, color=m.color)
    return shot.clip(*_unhidden(m, lift))


def _shell_box(m: Ram, lift: jax.Array) -> Box:
    """The shadow of the player's shell."""
    first, _, width, _ = SHELLS.extent(m.shell_dots, mirrored=m.turned > 0)
    top = VIEW_ROW + 256 + lift - m.shell_row
    bottom = VIEW_ROW + 256 + lift - m.shell_end
    left = SHOT_LEFT + first
    shadow = edges(left, top, left + width, bottom, width > 0, color=m.color)
    return shadow.clip(*_unhidden(m, lift))


def _dot_box(m: Ram) -> Box:
    """The enemy on the radar."""
    works = ((m.broken & Broken.RADAR) == 0) & (m.gone == 0)
    shown = (m.dot_row != NOWHERE) & (m.dot_x > 0)
    return box(m.dot_x + RADAR_LEFT, RADAR_BOTTOM - m.dot_row, 1, 1, works & shown)


def _beam_box(m: Ram) -> Box:
    x = m.beam_x + BEAM_LEFT
    y = BEAM_BOTTOM - m.beam_row
    return BEAMS.box(m.beam_way, x, y, mirrored=m.beam_turned > 0).clip(*RADAR)


def _sensor_box(m: Ram, x: int, y: int, bit: int) -> Box:
    """Green while the sensor works; otherwise red and black alternate."""
    broken = (m.broken & bit) != 0
    blink = jnp.where((m.clock & 8) != 0, RED, BLACK)
    return box(x, y, 8, 10, value=when(~broken, 1), color=jnp.where(broken, blink, GREEN))


def _icons(count: jax.Array, y: int, value: jax.Array) -> Box:
    width = pick(jnp.minimum(count, SQUADRON), ICON_WIDTHS)
    return box(ICON_LEFT, y, width, 8, count > 0, value=value)


def _clock_box(m: Ram) -> Box:
    tens = div(m.day, 10)
    first, _, _, _ = DIGIT_EXTENTS.extent(jnp.where(tens > 0, tens, m.day))
    left = jnp.where(tens > 0, TENS_LEFT, DAY_LEFT) + first
    color = jnp.where(m.message > 0, GREY, WHITE)
    return edges(left, 10, CLOCK_RIGHT, 18, value=24 * m.day + m.hour, color=color)


FIELD = (VIEW_LEFT, 80, 160, VIEW_BOTTOM)
NEAR_SIGHT = (66, 80, 92, VIEW_BOTTOM)
# VEM searches each of these colours of the enemy and the shots separately, because the ground has
# some of them at night and in fog. No view shows both black and 4.
TINTS = ((BLACK, 4), 6, 20)
SHADOW_TINTS = (*TINTS, FOG_COLOR)  # below the fog, which hides other parts
SIGHT_RULE = Bounds(WHITE, (72, 76, 88, 110), min_size=(16, 23), max_size=(16, 23))


def _in_each(
    groups: tuple[Colors, ...],
    region: Area,
    shapes: tuple[Shape, ...],
    ignore: tuple[Area, ...] = (),
) -> Blobs:
    rules = tuple(Blobs(colors, region, shapes, ignore=ignore) for colors in groups)
    return dataclasses.replace(rules[0], also=rules[1:])


def _solid(w: int, heights: tuple[int, int]) -> Shape:
    """A filled rectangle, except part of a row."""
    return Shape(w=w, h=heights, pixels=(w * heights[0], w * heights[1]))


# A shadow is at most as high as wide. The lower edge of the view cuts the widest shadows.
SHADOWS = (
    _solid(3, (1, 2)),
    _solid(4, (2, 3)),
    _solid(5, (3, 4)),
    _solid(6, (4, 6)),
    _solid(7, (5, 7)),
    _solid(8, (1, 3)),
    _solid(8, (4, 5)),
    _solid(8, (6, 8)),
)
# The enemy's shot is almost twice as high as wide. A large shot hides most of the enemy.
SHOTS = (
    Shape(w=1, h=3),
    *(_solid(w, (2 * w - 3, 2 * w)) for w in range(3, 8)),
    Shape(w=(8, 10), h=(13, 20)),
    Shape(w=(11, 18), h=(18, 31)),
)
# An enemy is lower than a shot of equal width.
TANKS = (
    Shape(w=(1, 2), h=(1, 2)),
    *(Shape(w=w, h=(1, 2 * w - 4)) for w in range(3, 8)),
    Shape(w=(8, 22), h=(2, 13)),
)
BELOW_TANK = (75, 97, 83, VIEW_BOTTOM)  # region of shadows
SHADOW_RULE = _in_each(SHADOW_TINTS, NEAR_SIGHT, SHADOWS)
TANK = _in_each(TINTS, FIELD, TANKS, ignore=(BELOW_TANK,))
MISSILE = _in_each(TINTS, FIELD, SHOTS)
BEAM_RULE = Blobs(PINK, RADAR, (Shape(w=(1, 3), h=(13, 16)), Shape(w=(4, 9), h=(1, 16))))
DOT = Blobs(PINK, RADAR, Shape(w=1, h=1))


PANEL = Bounds(PURPLE, (8, 130, 160, 172), min_size=(152, 33), max_size=(152, 33))
_on_panel = functools.partial(Category, needs=("Radar",))  # noise hides the panel


def _sensor(name: str, x: int, y: int, doc: str) -> Category:
    """A sensor's letter on the panel."""
    rule = Bounds((GREEN, RED, BLACK), (x, y, x + 8, y + 10), min_size=(8, 10))
    works = ByColor(((GREEN, 1), (RED, 0), (BLACK, 0)))
    return _on_panel(name, rule, attributes=("value",), value=works, doc=doc)


def _icon_rule(color: int, y: int, base: int) -> Bounds:
    """A row of at most twelve icons."""
    length = Gauge(8, start=6, base=base)
    return Bounds(color, (31, y, 129, y + 8), max_size=(96, 8), value=length)


CLOCK_DIGITS = Digits(FONT, (DAY_LEFT, 82, 90), 10, weights=(24, 10, 1), required=True)
CLOCK_RULE = Bounds((WHITE, GREY), (TENS_LEFT, 10, CLOCK_RIGHT, 18), value=CLOCK_DIGITS)
_in_view = functools.partial(Category, needs=("Player_Crosshair",))

GAME = Game(
    name="Robotank",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        rare=("Score", "Squadrons"),  # flashes, and announcements of the weather
        unscored=4,  # messages, and a broken sensor
        miscounted={"Score": 1},  # likewise
    ),
    categories=(
        Category(
            "Player_Crosshair", SIGHT_RULE, role="player", colors=(WHITE, 136), doc="the sight"
        ),
        _in_view("PlayerShot", SHADOW_RULE, doc="the shadow of the player's shell"),
        _in_view("EnemyTank", TANK, doc="the enemy"),
        _in_view("EnemyShot", MISSILE, doc="the enemy's shot"),
        Category("Radar", PANEL, doc="the panel below the view"),
        _on_panel("RadarBeam", BEAM_RULE, doc="the radar's beam"),
        _on_panel("EnemyRadarPosition", DOT, doc="the enemy on the radar"),
        _sensor("VisionSensor", 44, 142, "V; value: 1 while it works"),
        _sensor("RadarSensor", 108, 142, "R; value: 1 while it works"),
        _sensor("CanonSensor", 44, 158, "C; value: 1 while it works"),
        _sensor("TreadSensor", 108, 158, "T; value: 1 while it works"),
        display(
            "Score",
            _icon_rule(BLACK, 22, 1),
            needs=("Radar",),
            role="score",
            doc="tanks hit of this squadron; value: of all",
        ),
        display(
            "Squadrons",
            _icon_rule(BLACK, 33, 1),
            needs=("Radar",),
            doc="squadrons that were hit",
        ),
        display(
            "Lives",
            _icon_rule(RED, 175, 2),
            needs=("Radar",),
            role="lives",
            doc="tanks in reserve; value: one more",
        ),
        display(
            "Clock",
            CLOCK_RULE,
            needs=("Radar",),
            role="time",
            doc="day and hour; value: hours since the first day began",
        ),
    ),
)
