"""Centipede: a shooter, mushrooms, a centipede of at most nine segments, spider, flea and scorpion.

Picture: docs/games/Centipede.png

Screen: it has 20 zones of nine rows. A zone shows one object besides mushrooms: a chain of segments
(several chains alternate), or the spider, the flea or the scorpion, which have priority. Therefore
CentipedeSegment is sometimes hidden for a few frames. Eight colours are permuted from level to
level. Mushrooms in a row that the scorpion has crossed shine in the clock's colours. Scenery: the
shooter's explosion, the points for a spider, the sparkle of mushrooms during the count after a
death, and the figure in front of the easy game's score.

Slots: CentipedeSegment has the game's records; when a segment is shot, the segments behind it move
up. Mushroom has a slot for each place: row * 16 + place from the left. Places of even rows are four
columns further right. Ground has one slot.

RAM: ALE's source (score, lives), D. Debro's disassembly (meaning of the bytes), and the ROM's code:
the kernel at F003 in bank 0, movements at F136-F8C4, hits and the centipede's steps at F8C7-FE24 in
bank 1. Segments move after the frame is drawn; `decode` reverts their step. Shot and shooter are
one object of the chip, counted in steps of three rows. Therefore the shooter is partly or
completely missing just after a shot.

Covered: both modes, all eight sets of colours, all creatures, deaths, the count of mushrooms, new
centipedes, the end of the game. OCAtari also lists CCGameObject, the base class of its objects,
which is no object.

Not exact: the RAM lacks these facts: the shot on the frame on which it hits; its target then; a
turn of the last segment of a chain (assumed next to a mushroom in its last row).

VEM: it misses partly covered mushrooms, and makes the shooter too short in front of some places.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Cells,
    Checks,
    Digits,
    Game,
    LivesAsIcons,
    NumberDisplay,
    RamMap,
    Rom,
    Shades,
    Shape,
    SideBySide,
    Variants,
    bcd,
    bits,
    box,
    byte,
    display,
    flag,
    match,
    pick,
    signed,
    when,
)

ROM = Rom("centipede", "91c2098e88a6b13f977af8c003e0bca5")
FIGURE = tuple(ROM.rows(0xF69, 7).tolist())  # in front of the score of the easy game
FONT = replace(ROM.font(0xF1C, rows=7), signs=(FIGURE,))
# The colours of the first level. Each level starts one colour later than the level before.
COLORS = tuple(int(c) & 0xFE for c in ROM.bytes(0xFC9, 8))


class Color:  # index of `COLORS` in the first level
    SHOOTER = 0  # and mushrooms
    FLEA = 1
    CENTIPEDE = 3
    SPIDER = 5
    GROUND = 6
    SCORPION = 7


MUSHROOM_COLOR = COLORS[Color.SHOOTER]
FLEA_COLOR = COLORS[Color.FLEA]
CENTIPEDE_COLOR = COLORS[Color.CENTIPEDE]
SPIDER_COLOR = COLORS[Color.SPIDER]
SCORPION_COLOR = COLORS[Color.SCORPION]
KEYS = tuple(COLORS[i + Color.GROUND & 7] & 0xF0 | 6 for i in range(8))
LEVEL_SHADES = Shades((80, 183), KEYS, tuple(COLORS[i:] + COLORS[:i] for i in range(8)))
BLACK = 0
VIOLET_RGB = (188, 144, 252)
SHINING = tuple(range(14, 256, 16))  # of a row that the scorpion has crossed

FIELD_LEFT = 16
FIELD_TOP = 5
ZONE = 9  # rows
ZONES = 20  # counted from the bottom
FIELD = (16, 5, 144, 182)
MUSHROOM_ROWS = 19
PLACES = 16
ROWS, COLUMNS = np.divmod(np.arange(MUSHROOM_ROWS * PLACES), PLACES)
MUSHROOM_X = FIELD_LEFT + 8 * COLUMNS + np.where(ROWS % 2 == 0, 4, 0)
MUSHROOM_Y = FIELD_TOP + 2 + ZONE * ROWS
# Bits of mushrooms in their bytes: two bytes per row, eight places each.
EVEN_ROW = (6, 4, 2, 0, 1, 3, 5, 7)
ODD_ROW = (7, 5, 3, 1, 0, 2, 4, 6)
PLACE_BITS = np.where(ROWS % 2 == 0, np.tile(EVEN_ROW, 38), np.tile(ODD_ROW, 38))
NUMBERS = np.arange(9)  # of the segments
SCORE_Y = 187
SCORE = NumberDisplay(FONT, right=148, top=SCORE_Y, digits=6)

PICTURES = [0xE00 + int(low) for low in ROM.bytes(0xF70, 14)]
FLEAS = ROM.pictures(PICTURES[:2], 6)
SPIDERS = ROM.pictures(PICTURES[2:6], 6)
SCORPIONS = ROM.pictures(PICTURES[10:], 6)  # two pictures of each direction

NONE = 255  # `spider` or `scorpion_x` of an absent creature
NO_FLEA = 128  # least `flea_x` of an absent flea
TITLE = 224  # `score_high`
RESTS = 3  # lowest bits of `clock` while the centipede rests
SECOND_X = 68  # `segment_x` of the second segment of a new centipede
SECOND_STATE = 179  # and its `second_state`
JUST_HIT = 1  # `hit_sound`
EXPLOSION = 37  # `kernel_count` on a frame with the explosion instead of the shooter
IN_TIME = 3  # least `x` of a picture with its first row in time


class Ram(RamMap):
    fast = flag(*range(20, 29), bit=6)  # segments that move on every frame
    dying = bits(35, first=5, count=2)  # thirds of the explosion
    counting = flag(36, bit=6)  # the game counts mushrooms after a death
    easy = flag(39, bit=6)  # the other game
    extra_row = byte(40)  # zone of a chain with an odd number of segments, at least five
    clock = byte(41)
    mushrooms = byte(*range(45, 83))  # two bytes per row, uppermost row first, a bit per mushroom
    kernel_count = byte(89)  # as the drawing program left it
    second_state = byte(92)  # all its bits
    segment_row = bits(*range(91, 100), count=5)  # zone
    leftward = bits(*range(91, 100), first=5)
    upward = bits(*range(91, 100), first=6)  # it goes up at the next obstacle, or has gone up
    follows = bits(*range(91, 100), first=7)  # it follows the segment before it
    segment_x = byte(*range(100, 109))  # x - 16
    wave = bits(109, count=4)
    level = bits(109, count=3)  # of colours
    lives = bits(109, first=4, count=4)  # spare ones
    shot_x = byte(110)  # x - 16
    player_x = byte(111)  # x - 16
    shot_row = byte(112)  # zones from the top; 0: no shot
    player_y = byte(113)  # steps of three rows
    last_segment = signed(114)
    score = bcd((116, 117, 118))
    score_high = byte(116)
    flea_x = byte(119)  # x - 16
    flea_row = bits(120, count=5)  # zone
    scorpion_x = byte(121)  # x - 16
    scorpion_row = bits(122, count=5)  # zone
    scorpion_left = bits(122, first=7)
    spider_x = byte(123)  # x - 16; noise of the explosion
    spider = byte(124)
    spider_row = bits(124, count=5)  # zone
    hit_sound = bits(125, first=2, count=2)  # counts up from 1
    spider_points = bits(125, first=6, count=2)  # displayed in its place; 0: none


def decode(m: Ram) -> dict[str, Box]:
    boxes = {
        "Player": _player(m),
        "Projectile": _shot(m),
        "CentipedeSegment": _segments(m),
        "Spider": _spider(m),
        "Flea": _flea_box(m),
        "Scorpion": _scorpion(m),
        "Mushroom": _mushrooms(m),
        "Ground": box(FIELD_LEFT, 183, 128, 2, color=pick(m.level, KEYS)),
        "Life": box(LIFE_X, SCORE_Y, 4, 7, np.arange(7) < m.lives),
        "Score": _score_box(m),
    }
    return {name: shown.where(m.score_high != TITLE) for name, shown in boxes.items()}


def _color_of(m: Ram, kind: int) -> jax.Array:
    return pick(m.level + kind & 7, COLORS)


def _step_row(step: jax.Array) -> jax.Array:
    """The first row of a step of the count that switches the shot and the shooter."""
    return 3 * step + 6 + jnp.where(step % 3 == 1, 1, 0)


def _exploded(m: Ram) -> jax.Array:
    """True if the explosion was drawn; the frame of the collision still shows the shooter."""
    return (m.dying > 0) & (m.kernel_count == EXPLOSION)


def _player(m: Ram) -> Box:
    """The shooter: three steps of the count, or the steps that remain after the shot."""
    last = m.player_y + 2
    below_shot = jnp.maximum(m.player_y - 1, when(m.shot_row > 0, 3 * m.shot_row))
    first = jnp.where(below_shot < last, below_shot, last - 3)
    top = _step_row(first)
    return box(
        m.player_x + FIELD_LEFT,
        top,
        4,
        _step_row(last) - top,
        ~_exploded(m),
        color=_color_of(m, Color.SHOOTER),
    )


def _shot(m: Ram) -> Box:
    """The shot. It is at the shooter's column until the shooter's count is above zero."""
    top = jnp.maximum(9 * m.shot_row - 8, 6)
    near = m.player_y < 3 * m.shot_row - 2
    x = jnp.where(near, m.player_x, m.shot_x) + FIELD_LEFT
    there = (m.shot_row > 0) & ~_exploded(m)
    return box(x, top, 1, 9 * m.shot_row + 1 - top, there, color=_color_of(m, Color.SHOOTER))


def _zone_y(row: jax.Array) -> jax.Array:
    """First row of a zone's pictures."""
    return FIELD_TOP + ZONE * (ZONES - 1 - row)


def _segments(m: Ram) -> Box:
    """The segments before their move, which follows the drawing."""
    stands = (m.dying > 0) | ((m.clock & 7) == RESTS)
    moved = ~stands & (m.fast | ((m.clock & 1) == 0))
    turned = moved & _has_turned(m)
    x = m.segment_x - jnp.where(moved & ~turned, 1 - 2 * m.leftward, 0)
    row = m.segment_row + jnp.where(turned, 1 - 2 * m.upward, 0)
    follows = (m.follows == 1) & (_shifted(row, -1) == row)
    alone = ~follows & ~(_shifted(follows, 1) & (m.last_segment > NUMBERS))
    late = jnp.where(alone & (x < IN_TIME), 1, 0)
    there = (m.last_segment >= NUMBERS) & ~m.counting & ~_just_created(m)
    return box(
        FIELD_LEFT + x, _zone_y(row) + late, 4, 6 - late, there, color=_color_of(m, Color.CENTIPEDE)
    )


def _just_created(m: Ram) -> jax.Array:
    """True if a new centipede was made and has moved, but is not on the screen yet.

    Its second segment shows this. If that may have rested on the frame before, the row of the
    additional segment of an odd number shows whether the game drew it.
    """
    x = m.segment_x[1]
    clock = m.clock - 1
    moved_before = ((clock & 7) != RESTS) & (m.fast[1] | ((clock & 1) == 0))
    odd = m.easy | (((18 - m.wave) & 2) != 0)
    unmarked = odd & (m.extra_row != ZONES - 1)
    at_start = (x == SECOND_X) | ((x == SECOND_X - 1) & (moved_before | unmarked))
    return at_start & (m.second_state == SECOND_STATE)


def _shifted(values: jax.Array, by: int) -> jax.Array:
    """The value of the next segment (1) or the previous one (-1), for each segment."""
    return jnp.roll(values, -by)


def _has_turned(m: Ram) -> jax.Array:
    """True if a segment has just changed rows and has not moved along the new one.

    The segment behind it is still in the old row then. For the last segment of a chain, an obstacle
    shows the turn.
    """
    followed = (m.last_segment > NUMBERS) & (_shifted(m.follows, 1) == 1)
    behind = _shifted(m.segment_row, 1) != m.segment_row
    return ((m.segment_x & 3) == 0) & jnp.where(followed, behind, _obstacle(m))


def _obstacle(m: Ram) -> jax.Array:
    """True if an obstacle was in a segment's way in its previous row."""
    row = m.segment_row + 1 - 2 * m.upward
    column = (m.segment_x >> 2) - 1 + 2 * m.leftward  # it now goes the other way
    mushroom = _has_mushroom(m, row, column)
    return mushroom | (column < 0) | (column >= 2 * PLACES)


def _has_mushroom(m: Ram, row: jax.Array, column: jax.Array) -> jax.Array:
    """True if a mushroom is in some zones and columns; a row has one place for two columns."""
    words = m.mushrooms[0::2] | m.mushrooms[1::2] << 8  # a row each
    bottom_up = np.arange(MUSHROOM_ROWS, 0, -1)[:, None]
    word = jnp.sum(when(bottom_up == row[None], words[:, None]), axis=0)
    place = column & 15
    bit = jnp.where(place < 8, 7 - place, place - 8) + when(column > 15, 8)
    return ((word >> bit & 1) == 1) & ((column + row & 1) == 0)


def _spider(m: Ram) -> Box:
    shows_points = (m.spider_points > 0) & (m.hit_sound != JUST_HIT)
    there = (m.spider != NONE) & ~shows_points & (m.dying == 0)
    x = FIELD_LEFT + m.spider_x
    y = _zone_y(m.spider_row)
    picture = m.clock >> 3 & 3
    return SPIDERS.box(picture, x, y, valid=there, color=_color_of(m, Color.SPIDER))


def _flea_box(m: Ram) -> Box:
    """The flea; at the left edge its first row is written too late."""
    x = FIELD_LEFT + m.flea_x
    y = _zone_y(m.flea_row)
    picture = 1 - (m.clock >> 1 & 1)
    flea = FLEAS.box(picture, x, y, valid=m.flea_x < NO_FLEA, color=_color_of(m, Color.FLEA))
    return flea.trimmed(top=jnp.where(m.flea_x < IN_TIME, 1, 0))


def _scorpion(m: Ram) -> Box:
    x = FIELD_LEFT + m.scorpion_x
    y = _zone_y(m.scorpion_row)
    picture = m.scorpion_left + 2 * (m.clock >> 3 & 1)
    there = m.scorpion_x != NONE
    return SCORPIONS.box(picture, x, y, valid=there, color=_color_of(m, Color.SCORPION))


def _mushrooms(m: Ram) -> Box:
    there = (jnp.repeat(m.mushrooms, 8) >> PLACE_BITS & 1) == 1
    return box(MUSHROOM_X, MUSHROOM_Y, 4, 3, there, color=_color_of(m, Color.SHOOTER))


def _score_box(m: Ram) -> Box:
    """The score: at least two digits, in the easy game with a figure in the first digit's place."""
    digits = SCORE.box(m.score)
    lefts = SCORE.lefts
    left = match((m.easy, lefts[0]), (m.score < 10, lefts[-2]), otherwise=digits.x)
    return digits.trimmed(left=left - digits.x)


LIFE_X = FIELD_LEFT + 8 * np.arange(7)
LIFE_REGIONS = tuple((int(x), SCORE_Y, int(x) + 4, SCORE_Y + 7) for x in LIFE_X)
shooters = functools.partial(Blobs, MUSHROOM_COLOR, (16, 139, 144, 181))
TOUCHING = shooters(gap=(0, 3), exclude=("Mushroom",), shapes=Shape(w=4, h=(4, 9)))
SHOOTER_RULE = shooters(connectivity=4, shapes=Shape(w=4, h=9, pixels=36), also=(TOUCHING,))
PAINT = (MUSHROOM_COLOR, *SHINING)
SHOT_AREA = (16, 6, 144, 181)
SHOT_RULE = Blobs(PAINT, SHOT_AREA, Shape(w=1, h=(4, 9)), exclude=("Mushroom",))
ZONE_REGIONS = tuple((16, y, 144, y + 6) for y in range(FIELD_TOP, FIELD_TOP + ZONE * ZONES, ZONE))
CHAINS = Bounds(CENTIPEDE_COLOR, ZONE_REGIONS, min_size=(3, 4), then=(SideBySide(4),))
CELLS_X = tuple(MUSHROOM_X.tolist())
CELLS_Y = tuple(MUSHROOM_Y.tolist())
MUSHROOM_RULE = Cells(PAINT, CELLS_X, CELLS_Y, 4, 3, exclude=("Player",))
SPARE = Bounds(BLACK, LIFE_REGIONS, inverse=True)
LINE = Bounds(BLACK, (16, 183, 144, 185), inverse=True)
POINTS = Bounds(BLACK, SCORE.area, inverse=True, value=Digits(FONT, SCORE.lefts, SCORE.top))
SPIDER_SEEN = Bounds(SPIDER_COLOR, FIELD, min_size=(8, 5))
FLEA_SEEN = Blobs(FLEA_COLOR, FIELD, Shape(w=(4, 5), h=(5, 6)))
SCORPION_SEEN = Bounds(SCORPION_COLOR, FIELD, min_size=(8, 6))

GAME = Game(
    name="Centipede",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        rare=("Flea", "Scorpion"),
        lives=(LivesAsIcons(("Life",), hidden=1),),
    ),
    variants=Variants(
        modes={
            22: "the usual game",
            86: "the easy game, with a figure beside the score",
        },
        source="the program in the ROM",
        starts={
            "wave=3": "the colours of a later wave",
        },
    ),
    categories=(
        Category("Player", SHOOTER_RULE, role="player", doc="the shooter"),
        Category("Projectile", SHOT_RULE, doc="its shot"),
        Category("CentipedeSegment", CHAINS, count=9, blinks=True, doc="in the game's order"),
        Category("Spider", SPIDER_SEEN, doc="the spider"),
        Category("Flea", FLEA_SEEN, doc="the flea, which drops mushrooms"),
        Category("Scorpion", SCORPION_SEEN, doc="the scorpion, which poisons a row"),
        Category("Mushroom", MUSHROOM_RULE, count=304, doc="row from the top * 16 + place"),
        display("Ground", LINE, attributes=(), doc="the line under the field"),
        display(
            "Life", SPARE, count=7, attributes=(), rgb=VIOLET_RGB, role="lives", doc="spare lives"
        ),
        display("Score", POINTS, rgb=VIOLET_RGB, role="score", doc="points, below 1,000,000"),
    ),
    shades=LEVEL_SHADES,
)
