"""Battlezone: a plain seen from inside a tank, with at most two enemies and two shots on it.

Picture: docs/games/BattleZone.png

Screen: the radar is at the top, score and spare tanks are at the bottom. Radar_Content is the
radar's hand and two blips. Odd frames show the player's shot, even frames the enemy's. Mountains
and the lines of a crash are scenery. When the player is hit, the game draws the other objects on
every other frame only, and then only score and tanks stay valid.

Slots: an enemy is a blue or yellow tank, a red flyer, a boss, or an explosion. The slots of each of
these categories are the game's two records.

RAM: ALE's source (score, lives), OCAtari 2.2 and AtariARI (meaning of the records), a public
disassembly by Manuel Polik, and the ROM's drawing loop, which keeps the drawn columns, sizes, edge
masks and picture pointers. The game projects a shot before it draws the frame; `decode` reverts the
shot's step and the player's turn since then.

Timeline between two drawings of a shot (the player's on odd frames, the enemy's on even frames):
    1. the shot is projected: `side` and `ahead` become a column and a line
    2. the frame is drawn
    3. the player's move turns and shifts all positions
    4. the shot makes its step

Timeline of a line with an enemy: the loop writes a row of dots when the beam is at column 15, so
dots left of it appear a row lower. Only the last row of the lower enemy shows this, as an
additional row.

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
    WIDTH as SCREEN_WIDTH,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Digits,
    Game,
    Icons,
    KindEntry,
    Kinds,
    LivesAsIcons,
    RamMap,
    Rom,
    Shape,
    Static,
    Word,
    bits,
    box,
    byte,
    choose,
    display,
    flag,
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
TANKS = 50
EXPLOSION_PICTURES = 3
FIRST_EXPLOSION = TANKS
FIRST_FLYER = FIRST_EXPLOSION + EXPLOSION_PICTURES
SIZES = 10
FIRST_BOSS = FIRST_FLYER + SIZES
LAST_LINES = ROM.bytes(0x81B, SIZES).tolist()  # counted upwards
HEIGHTS = (ROM.bytes(0x811, SIZES) - LAST_LINES).tolist()


class Group(NamedTuple):
    """Consecutive pictures; a table has the low bytes of their addresses."""

    low_bytes: int  # offset of the table
    pages: tuple[int, ...]  # of each picture


GROUPS = (
    Group(0xCAF, (0x9,) * 39 + (0xA,) * 11),  # tanks
    Group(0x902, (0xC,) * EXPLOSION_PICTURES),
    Group(0x8D4, (0xD,) * SIZES),  # flyers
    Group(0x839, (0x8,) * SIZES),  # bosses
)


def _read_pictures() -> np.ndarray:
    """All rows of all pictures, the lowest first: `[picture, row]`."""
    offsets = [
        (page << 8 | int(low_byte)) + 1
        for group in GROUPS
        for page, low_byte in zip(
            group.pages, ROM.bytes(group.low_bytes, len(group.pages)), strict=True
        )
    ]
    return ROM.rows(offsets, HEIGHTS[-1], top_first=True)


ZOOM_OF_NUSIZ = {5: 1, 7: 2}  # log2 of the pixels of a dot; 0 for other values
OTHER_ZOOMS = (0, 0, 0, 0, 1, 1, 2, 2, 2, 2)  # of explosions, flyers and bosses, by size


def _zooms() -> np.ndarray:
    """log2 of the pixels of a dot: `[picture, size]`."""
    of_tanks = [ZOOM_OF_NUSIZ.get(nusiz, 0) for nusiz in ROM.bytes(0xE8D, TANKS).tolist()]
    others = EXPLOSION_PICTURES + 2 * SIZES
    return np.vstack([np.array(of_tanks)[:, None].repeat(SIZES, 1), [OTHER_ZOOMS] * others])


PICTURE_ROWS = _read_pictures()
# By SIZES * picture + size: the dots of all visible rows together, and the lowest row's.
DOTS_WORD = Word(used=8, lowest=8, zoom=2)
STORED_DOTS = DOTS_WORD.pack(
    used=np.stack(
        [np.bitwise_or.reduce(PICTURE_ROWS[:, :height], axis=1) for height in HEIGHTS], axis=1
    ),
    lowest=PICTURE_ROWS[:, :1],
    zoom=_zooms(),
).ravel()
# By 256 * picture + dots: rows that contain any of these dots, the lowest in bit 0.
BYTES = 256
MOST_ROWS = 17
HAS_DOT = (PICTURE_ROWS[:, None] & np.arange(BYTES)[:, None]) != 0
ROWS_WITH = HAS_DOT.dot(1 << np.arange(MOST_ROWS)).ravel()

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


class Search(NamedTuple):
    """The game's search for the line of a depth."""

    limits: np.ndarray  # the greatest depth of each line
    line: int  # where it begins
    step: int  # the first one; it halves


PLAYER_SEARCH = Search(ROM.bytes(0x1F85, 47), 23, 12)
ENEMY_SEARCH = Search(ROM.bytes(0x1F52, 51), 25, 13)
# Lines of shots by depth: the player's, then the enemy's.
SHOT_LINES = [
    _line_of_depth(depth, search.limits, search.line, search.step)
    for search in (PLAYER_SEARCH, ENEMY_SEARCH)
    for depth in range(DEPTHS)
]
FIRST_LINE_OF = np.array((0, DEPTHS))  # in that table
LEAST_DEPTH = np.array((0, 8))  # of visible shots: the player's, the enemy's
FAR_LINE = 35  # from this line on, a shot is 1 pixel wide
NEAR_LINE = 10  # below this line it is 4 pixels wide, between them 2

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
TURN_SIDE = 6  # a turn of the player moves a shot aside by this part of its distance, in 256ths
MIDDLE = 79  # column
LAST_COLUMN = 159
BEHIND = 128  # least high byte of `side` of a shot on the left
GROUND_LINE = 140  # the row of line 0 of a shot; an enemy's is the row above
BEAM = 15  # column of the beam when the loop writes an enemy's dots
NO_BLIP = 31  # least `blip_y` of an absent blip
BLIP_BOTTOM = 34  # the row of a blip with `blip_y` 0
RADAR_MIDDLE = 84  # column of a blip with `blip_x` 0
NO_DIGIT = 10  # a blank instead of a leading zero
DIGIT_SHIFTS = np.array((0, 4, 8))  # of thousands, ten thousands, hundred thousands
LAST_ZEROS = 3  # last digits, which are always 0
DIGIT_WORTHS = 10**LAST_ZEROS * np.array((1, 10, 100))
DIGIT_PITCH = 8  # columns from digit to digit
DIGIT_GAP = 3  # empty columns between them
SCORE_RIGHT = 111  # the column right of the last digit
GREEN = 202
WHITE = 14
TEXT = 180
PLAIN = (0, 86, 160, 140)
HULL = Static(19, 140, 122, 37, (194, 2, 4))  # of the player's tank
RADAR_RIM = Static(74, 3, 22, 33, GREEN)  # its rim
SPARE = Icons(left=65, top=190, size=(6, 5), pitch=8, count=5)  # tanks
NEAR_AND_FAR = np.arange(2)


class Ram(RamMap):
    frame = byte(0)
    digits = bits((30, 29), first=4, count=12)  # of the thousands, a nibble each
    # As drawn: the nearer and the farther enemy.
    picture = byte(46, 52)
    size = byte(47, 53)
    x = byte(48, 54)
    mask = byte(49, 55)  # visible dots
    mirrored = flag(51, 57, bit=3)
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


class Enemy(NamedTuple):
    """An enemy as drawn: the nearer one, then the farther one."""

    kind: jax.Array
    picture: jax.Array
    size: jax.Array
    mirrored: jax.Array
    x: jax.Array  # the column of its first dot
    zoom: jax.Array  # log2 of the pixels of a dot
    dots: jax.Array  # its visible columns of dots; bit 0 is the leftmost
    lowest: jax.Array  # dots in its lowest row


def decode(m: Ram) -> dict[str, Box]:
    normal = (m.crash == 0) | (m.crash >= CRASH_FLICKERS)
    enemy = _enemies_as_drawn(m)
    boxes, kind = _by_record(m, _enemy_boxes(enemy), enemy.kind)
    return {
        "Player": HULL.box(normal),
        "Crosshair": box(78, 79, 1, 6, normal, color=m.crosshair_color),
        **FOES.split(boxes.where(normal), kind),
        "Shot": _shot_boxes(m).where(normal),
        "Radar": RADAR_RIM.box(normal),
        "Radar_Content": _radar(m).where(normal),
        "Score": _score_box(m),
        "Life": _lives_box(m),
    }


def _lives_box(m: Ram) -> Box:
    return SPARE.box(m.lives + when(m.crash == CRASH_BEGINS, 1))


def _score_box(m: Ram) -> Box:
    """The game keeps the digits above the `LAST_ZEROS`."""
    digits = m.digits >> DIGIT_SHIFTS & 15
    is_digit = digits < NO_DIGIT
    shown = jnp.sum(when(is_digit, 1))
    value = jnp.sum(when(is_digit, digits) * DIGIT_WORTHS)
    width = DIGIT_PITCH * (shown + LAST_ZEROS) - DIGIT_GAP
    return box(SCORE_RIGHT - width, 180, width, 8, value=value)


def _enemies_as_drawn(m: Ram) -> Enemy:
    """The pictures of the nearer and the farther enemy, with the visible part of each."""
    kind = m.drawn_kinds >> 4 * NEAR_AND_FAR & 15
    size = jnp.minimum(m.size, SIZES - 1)
    picture = match(
        (kind <= Kind.YELLOW, jnp.minimum(m.picture, TANKS - 1)),
        (kind == Kind.EXPLODES, FIRST_EXPLOSION + jnp.minimum(m.picture, EXPLOSION_PICTURES - 1)),
        (kind >= Kind.BOSS, FIRST_BOSS + size),
        otherwise=FIRST_FLYER + size,
    )
    stored = DOTS_WORD.unpack(lookup(np.asarray(STORED_DOTS), SIZES * picture + size))
    zoom = stored.zoom
    lowest = _from_left(m, stored.lowest & m.mask)
    shows = _from_left(m, stored.used & m.mask)
    x = wrap(_column(m.x) + when(zoom > 0, 1))  # the chip draws wide dots a pixel later
    # A picture may appear at both edges: the larger part counts.
    beyond = -1 << _dots_within(SCREEN_WIDTH - x, zoom)
    wraps = lax.population_count(shows & beyond) > lax.population_count(shows & ~beyond)
    part = jnp.where(wraps, beyond, ~beyond)
    left = jnp.where(wraps, x - SCREEN_WIDTH, x)
    return Enemy(kind, picture, size, m.mirrored, left, zoom, shows & part, lowest)


def _from_left(m: Ram, dots: jax.Array) -> jax.Array:
    """A row of dots as drawn, with the leftmost dot in bit 0; stored pictures have it in bit 7."""
    return jnp.where(m.mirrored, dots, mirrored(dots) & 0xFF)


def _lowest_bit(bits_set: jax.Array) -> jax.Array:
    """The number of the lowest set bit; -1 for 0."""
    return 31 - lax.clz(bits_set & -bits_set)


def _bit_length(bits_set: jax.Array) -> jax.Array:
    return 32 - lax.clz(bits_set)


def _enemy_boxes(enemy: Enemy) -> Box:
    """Tight boxes of the visible parts of the enemies."""
    rows = _visible_rows(enemy)
    first_row = _lowest_bit(rows)
    end_row = _bit_length(rows)
    left = enemy.x + (_lowest_bit(enemy.dots) << enemy.zoom)
    right = enemy.x + (_bit_length(enemy.dots) << enemy.zoom)
    below = pick(enemy.size, LAST_LINES)
    # Left of the beam, the last row of the lower enemy lasts one more row.
    left_dots = (1 << _dots_within(BEAM - enemy.x, enemy.zoom)) - 1
    left_of_beam = (enemy.dots & enemy.lowest & left_dots) != 0
    is_lower = 2 * below <= jnp.sum(below)
    late = when(left_of_beam & is_lower, 1)
    top = GROUND_LINE - 1 - below - end_row
    return box(left, top, right - left, end_row - first_row + late, rows > 0)


def _visible_rows(enemy: Enemy) -> jax.Array:
    """The rows of each picture that have visible dots; bit 0 is the lowest."""
    as_stored = jnp.where(enemy.mirrored, enemy.dots, mirrored(enemy.dots))
    used = lookup(ROWS_WITH, BYTES * enemy.picture + as_stored)
    return used & ((1 << pick(enemy.size, HEIGHTS)) - 1)


def _column(x: jax.Array) -> jax.Array:
    """Column at which the game's loop positions a sprite: it is late for the leftmost columns."""
    return match((x >= 17, x), (x >= 5, x - 5), otherwise=x + SCREEN_WIDTH)


def _dots_within(pixels: jax.Array, zoom: jax.Array) -> jax.Array:
    """Number of a picture's dots that begin within a number of pixels."""
    return jnp.clip((pixels + (1 << zoom) - 1) >> zoom, 0, 8)


def _by_record(m: Ram, enemies: Box, kind: jax.Array) -> tuple[Box, jax.Array]:
    """The nearer and the farther enemy in the order of their records, and their kinds."""
    closer = (kind[0] != m.kind[1]) | (m.distance[0] < m.distance[1])
    first_is_near = jnp.where(kind[0] == m.kind[0], closer, jnp.max(m.kind) == 0)
    is_near = first_is_near == (NEAR_AND_FAR == 0)
    return choose(is_near, enemies[:1], enemies[1:]), jnp.where(is_near, kind[0], kind[1])


class Shots(NamedTuple):
    """The player's shot and the enemy's; positions are 256 a step, from 0 to 65,535."""

    side: jax.Array
    ahead: jax.Array


def _shot_boxes(m: Ram) -> Box:
    """The player's shot as on the last odd frame, the enemy's as on the last even frame."""
    drawn = _shots_drawn(m)
    depth = drawn.ahead >> 8
    is_right = (drawn.side >> 8) < BEHIND
    distance = _projected(jnp.where(is_right, drawn.side, 0xFFFF - drawn.side), drawn.ahead)
    place = jnp.where(is_right, MIDDLE + distance, MIDDLE - distance)
    beyond = (place <= 0) | (place >= LAST_COLUMN)
    x = wrap(_column(jnp.where(beyond, 1, place)) - 1)
    line = lookup(SHOT_LINES, (depth & DEPTHS - 1) + FIRST_LINE_OF)
    width = match((line < NEAR_LINE, 4), (line < FAR_LINE, 2), otherwise=1)
    return box(x, GROUND_LINE - line, width, 3, _seen(m, drawn)).clip(*PLAIN)


def _seen(m: Ram, drawn: Shots) -> jax.Array:
    """True for shots that fly in the player's view."""
    away = drawn.side >> 8
    depth = drawn.ahead >> 8
    aside = jnp.where(away < BEHIND, away, 256 - away)
    in_view = (depth < DEPTHS) & (depth + 2 >= aside) & (depth >= LEAST_DEPTH)
    not_new = m.shot_time < NEW_SHOT + jnp.stack([m.frame & 1, 0])
    flies = m.shots >> NEAR_AND_FAR & 1 > 0
    return in_view & not_new & flies


def _shots_drawn(m: Ram) -> Shots:
    """Positions of the shots before their last step and the player's last move."""
    side = m.shot_side + lookup(STEP_SIDE, m.shot_direction)
    ahead = m.shot_ahead + lookup(STEP_AHEAD, m.shot_direction)
    before = _before_move(m, _signed_word(side), _signed_word(ahead))
    moved = jnp.stack([m.frame & 1 == 0, jnp.bool_(True)])  # since the drawing
    return Shots(
        side=jnp.where(moved, before.side, m.shot_side) & 0xFFFF,
        ahead=jnp.where(moved, before.ahead, m.shot_ahead) & 0xFFFF,
    )


def _before_move(m: Ram, side: jax.Array, from_ahead: jax.Array) -> Shots:
    """Positions before the player's last move: the game's arithmetic for the opposite turn."""
    turn = _pressed(m, Stick.RIGHT, Stick.LEFT)
    back = _pressed(m, Stick.DOWN, Stick.UP)
    ahead = from_ahead - back * jnp.where(turn == 0, STRAIGHT_MOVE, TURNING_MOVE)
    # A turn adds a part of the other coordinate and takes 1/4096 of the own one.
    side_change = turn * TURN_SIDE * (ahead >> 8) - abs(turn) * (side >> 12)
    ahead_change = turn * TURN_SIDE * (side >> 8) + abs(turn) * (ahead >> 12)
    return Shots(side + side_change, ahead - ahead_change)


def _signed_word(word: jax.Array) -> jax.Array:
    """A 16-bit number with the sign in the highest bit."""
    return (word & 0xFFFF ^ 0x8000) - 0x8000


def _pressed(m: Ram, forth: int, back: int) -> jax.Array:
    """1 if the first direction is pressed, otherwise -1 if the second is, otherwise 0."""
    return match((m.stick & forth == 0, 1), (m.stick & back == 0, -1), otherwise=0)


def _projected(side: jax.Array, ahead: jax.Array) -> jax.Array:
    """Pixels from the middle of the screen: the game's division of two 16-bit numbers."""
    zeros = jnp.minimum(lax.clz(side), lax.clz(ahead)) - 16  # above both numbers
    shift = when(ahead >> 8 > 0, jnp.maximum(zeros, 1))
    begin = Division(
        rest=_high_byte(side << shift),
        divisor=_high_byte(ahead << shift),
        quotient=jnp.zeros_like(side),
    )
    quotient = functools.reduce(_after_bit, range(7, -1, -1), begin).quotient
    return ((quotient >> 2) + quotient + 1 & 0xFF) >> 1


def _high_byte(word: jax.Array) -> jax.Array:
    return word >> 8 & 0xFF


class Division(NamedTuple):
    """The game's division, which finds one bit of the quotient per step."""

    rest: jax.Array
    divisor: jax.Array
    quotient: jax.Array


def _after_bit(before: Division, bit: int) -> Division:
    """The division after the step that finds a bit."""
    fits = before.rest >= before.divisor
    rest = before.rest - when(fits, before.divisor)
    large = when(rest >= 128, 1)  # the game halves the divisor instead of doubling the rest
    quotient = before.quotient | when(fits, 1 << bit)
    return Division(rest << 1 - large, before.divisor >> large, quotient)


def _radar(m: Ram) -> Box:
    """The hand and the two blips."""
    direction = (m.hand - when((m.frame & 3) == 1, 1)) & 31
    angle = jnp.minimum(direction, 32 - direction)
    width = pick(angle, HAND_WIDTH)
    x = jnp.where(direction < 16, RADAR_MIDDLE + 2 - width, RADAR_MIDDLE)
    hand = box(x, pick(angle, HAND_TOP), width, pick(angle, HAND_HEIGHT))
    blip_x = (m.blip_x + RADAR_MIDDLE) & 0xFF
    blips = box(blip_x, BLIP_BOTTOM - m.blip_y, 1, 1, m.blip_y < NO_BLIP)
    return Box.stacked(hand, blips)


# The lines of a crash may have any object's colours; the crosshair is not on that screen.
on_plain = functools.partial(Category, needs=("Crosshair",))
enemy_blobs = functools.partial(Blobs, region=PLAIN, gap=(1, 1), shapes=Shape(w=(2, 32), h=(2, 18)))
flyer_blobs = functools.partial(enemy_blobs, gap=(2, 4), shapes=Shape(w=(1, 32), h=(2, 18)))
RED = (2, 64, 66, 70, 72, 74)
FLYER_RGB = (74, 74, 74)
BLUE_RGB = (24, 80, 128)
FLAME_RGB = (184, 50, 50)


def _enemy_kind(
    name: str, values: range, rule: Blobs, doc: str, rgb: tuple[int, ...] | None = None
) -> KindEntry:
    return KindEntry(on_plain(name, rule, count=2, rgb=rgb, doc=doc), values)


FOES = Kinds(
    _enemy_kind(
        "Blue_Tank",
        range(Kind.BLUE + 1),
        enemy_blobs((6, 162, 166), first=(6, 166)),
        "enemy",
        BLUE_RGB,
    ),
    _enemy_kind(
        "Yellow_Blue_Tank",
        range(Kind.YELLOW, Kind.YELLOW + 1),
        enemy_blobs((40, 8, 162), first=40),
        "enemy",
        BLUE_RGB,
    ),
    _enemy_kind(
        "Red_Thing",
        range(Kind.FLYER, Kind.FLYER + 1),
        flyer_blobs(RED, first=(70, 72, 74)),
        "flyer, with its shadow",
        FLYER_RGB,
    ),
    _enemy_kind("Boss", range(Kind.BOSS, 16), flyer_blobs((44, 0, 2), first=44), "with its shadow"),
    _enemy_kind(
        "Explosion",
        range(Kind.EXPLODES, Kind.EXPLODES + 1),
        enemy_blobs((24, 82, 68), gap=(5, 4)),
        "of an enemy",
        FLAME_RGB,
    ),
)
CROSSHAIR = Blobs((0, 46), (70, 74, 88, 90), Shape(w=1, h=6))
CONTENT = Blobs(WHITE, (75, 4, 95, 36), Shape(w=(1, 12), h=(1, 18)), gap=(0, 1))
SCORE = Bounds(TEXT, (66, 180, 112, 188), value=Digits(FONT, range(66, 114, 8), 180))

GAME = Game(
    name="BattleZone",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        rare=("Red_Thing",),
        lives=(LivesAsIcons(("Life",)),),
    ),
    categories=(
        on_plain(
            "Player",
            HULL.rule(),
            rgb=(26, 102, 26),
            role="player",
            colors=(2, 4, 192, 194),
            doc="the player's tank",
        ),
        Category("Crosshair", CROSSHAIR, doc="yellow when an enemy is in it"),
        *FOES.categories,
        on_plain(
            "Shot",
            Blobs(WHITE, PLAIN, Shape(w=(1, 8), h=(1, 4))),
            count=2,
            doc="player's, enemy's",
        ),
        on_plain("Radar", RADAR_RIM.rule(), doc="its rim"),
        on_plain("Radar_Content", CONTENT, count=3, doc="hand and blips"),
        display("Score", SCORE, role="score", doc="points"),
        display(
            "Life",
            SPARE.rule(TEXT),
            count=SPARE.count,
            attributes=(),
            role="lives",
            doc="tanks left",
        ),
    ),
)
