"""Star Gunner: a ship shoots at flying enemies, below a creature that throws bombs.

Screen: one enemy is drawn per frame; two or three enemies, in later waves, alternate. A bomb has
the colour of the drawn enemy, or the ship's colour while an enemy explodes. Explosions, new enemies
that come together from four lines, mountains and the title are scenery. While the ship explodes and
appears again, the game draws nothing else, and nothing is in play.

Slots: FlyingEnemy has the game's records.

RAM: OCAtari and stable-retro (meaning of some bytes), ALE's source (score, lives), and the ROM's
code. The game moves everything before it draws, so nothing has to be undone. The display program
compares a row counter with the positions. This takes so long that its writes into the chip are
visible only right of some column; left of it, a row shows one row lower.

Covered: all modes, waves of one to three enemies with their three kinds of pictures (by writing
RAM), deaths, the end of the game, the title.

Not exact: nothing known.

VEM: it misses enemies that touch a bomb or the ship, and bombs within them. It reads the value of
Lives only up to two.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    WEST,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Digits,
    Game,
    Gauge,
    IconRow,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    Shape,
    among,
    box,
    byte,
    display,
    div,
    edges,
    match,
    only,
    pick,
    when,
)

ROM = Rom("star_gunner", "a3c1c70024d7aabb41381adbfb6d3b25")
FONT = ROM.font(range(0xF0B, 0xF15), rows=7, step=11)

POINTS = NumberDisplay(FONT, right=96, top=14, digits=6)
SHIPS = IconRow(left=56, top=23, width=8, height=4, pitch=16)

BLACK = 0
SHIP_COLOR = 72
SCORE_COLOR = 154
END_COLOR = 206  # of the icon in the last frame
ANY = tuple(range(2, 256, 2))
SHOT_COLORS = range(176, 208, 2)  # from bright to dark as it flies

ROW_0 = 32  # line of the display program's row 0
SHIP_ROWS = 5  # rows reserved for the ship; the last one is empty
# First columns that show a write into the chip in its row: above, in and below the ship's rows.
SHOT_BESIDE = 13
ENEMY_ABOVE = 101
ENEMY_BESIDE = 74
ENEMY_BELOW = 83
ENEMY_AT_ENDS = 80  # in the first of the ship's rows and in the row below the last
FIRST_ROW = 20  # the display program's first row; three later in an explosion
FIRST_ROW_BOMB = 85  # a bomb is visible there from this column


class Shows(NamedTuple):
    """A bomb is in its row from column `here`, and a row lower left of column `lower`."""

    here: int
    lower: int


BOMBS = (
    Shows(28, 22),  # above the ship
    Shows(19, 13),  # below it
    Shows(94, 88),  # above it, while an enemy explodes
    Shows(79, 73),  # below it, while an enemy explodes
)

FIRST_PICTURE = 88  # low byte of the address of the first of twelve pictures
KINDS = 12  # pictures
ENEMY_ROWS = 11  # of a picture
LEFT_LATE = 9  # 0 to 8 columns of a picture are a row late
THROWER_SIZE = (7, 10)
FIRST_X = 20  # an enemy's least x
LAST_X = 148


def _shifted(rows: np.ndarray, columns: int) -> np.ndarray:
    """The rows of a picture with its left columns a row lower."""
    left = 0xFF & ~(0xFF >> columns)
    return np.append(rows & ~left, 0) | np.append(0, rows & left)


ENEMY_PICTURES = ROM.rows([0xF59 + ENEMY_ROWS * i for i in range(KINDS)], ENEMY_ROWS)
EXTENTS = Pictures.of(
    [_shifted(rows, columns) for rows in ENEMY_PICTURES for columns in range(LEFT_LATE)],
    picture=KINDS,
    late=LEFT_LATE,
)


class Phase:  # of Ram.phase
    BOTH = 2  # ship and enemies are drawn
    EXPLODES = 9
    APPEARS = 10


class Wait:  # of Ram.wait
    TITLE = 112
    ENDED = 128  # at least


class State:  # of Ram.state, 0 while an enemy flies
    GONE = 128  # at least: it explodes, or a new one appears


class Facing:  # of Ram.facing
    LEFT = 246


class Ram(RamMap):
    wait = byte(2)  # frames until the game continues
    digits = byte(6, 5, 4, 3)  # of the score, 10: blank
    lives = byte(7)
    phase = byte(12)
    y = byte(14)  # y - 33
    last_enemy = byte(15)  # enemies of this wave, minus one
    facing = byte(19)
    x = byte(21)  # x + 10
    picture = byte(23)  # low byte of the address
    thrower_x = byte(31)  # x + 9; also its colour
    bomb_x = byte(33)  # x + 11; 0, left of the screen: no bomb
    bomb_y = byte(34)  # y - 32
    shot_color = byte(39)
    shot_x = byte(40)  # x + 11
    shot_y = byte(41)  # y - 32; 0: no shot
    enemy_y = byte(71, 72, 73)  # the display program's row
    enemy_x = byte(74, 75, 76)  # x + 10
    enemy_color = byte(86, 87, 88)
    state = byte(89, 90, 91)  # of the enemies
    drawn_y = byte(93)  # of the enemy that is drawn
    drawn_enemy = byte(107)  # the number of its record


def decode(m: Ram) -> dict[str, Box]:
    in_play = (m.wait < Wait.ENDED) & (m.wait != Wait.TITLE)
    ship = in_play & ~among(m.phase, (Phase.EXPLODES, Phase.APPEARS))
    all_drawn = in_play & (m.phase == Phase.BOTH)
    return {
        "Player": _ship_box(m).where(ship),
        "PlayerMissile": _shot_box(m).where(ship),
        "FlyingEnemy": _enemy_boxes(m).where(all_drawn),
        "BombThrower": box(m.thrower_x - 9, 37, *THROWER_SIZE, color=m.thrower_x).where(all_drawn),
        "Bomb": _bomb_box(m).where(all_drawn),
        "PlayerScore": _score_box(m),
        "Lives": _icons(m),
    }


def _ship_box(m: Ram) -> Box:
    orientation = jnp.where(m.facing == Facing.LEFT, WEST, EAST)
    return box(m.x - 10, m.y + 33, 8, 4, orientation=orientation)


def _shot_box(m: Ram) -> Box:
    x = m.shot_x - 11
    beside = (m.shot_y > m.y) & (m.shot_y <= m.y + SHIP_ROWS)
    left = jnp.where(beside, jnp.maximum(x, SHOT_BESIDE), x)
    return edges(
        left, m.shot_y + ROW_0, x + 8, m.shot_y + ROW_0 + 1, m.shot_y > 0, color=m.shot_color
    )


def _explodes(m: Ram) -> jax.Array:
    """True if the drawn record is an explosion."""
    drawn = jnp.arange(3) == m.drawn_enemy
    return jnp.any(drawn & (m.state >= State.GONE))


def _enemy_boxes(m: Ram) -> Box:
    slot = jnp.arange(3)
    # While the game waits, it draws all enemies in the row of the last one.
    top = jnp.where((slot == m.drawn_enemy) | (m.wait > 0), m.drawn_y, m.enemy_y)
    x = m.enemy_x - 10
    picture = div(jnp.maximum(m.picture - FIRST_PICTURE, 0), ENEMY_ROWS)
    whole = EXTENTS.index(picture=picture, late=0)
    _, whole_first, _, whole_rows = EXTENTS.extent(whole)
    # The late columns may differ between its first row and its last one.
    upper = EXTENTS.index(picture=picture, late=_late_columns(m, x, top + whole_first))
    lower = EXTENTS.index(
        picture=picture, late=_late_columns(m, x, top + whole_first + whole_rows - 1)
    )
    left, first, width, _ = EXTENTS.extent(upper)
    _, lower_first, _, rows = EXTENTS.extent(lower)
    y = top + ROW_0
    flies = (slot <= m.last_enemy) & (m.state < State.GONE)
    there = flies & (m.enemy_x >= FIRST_X) & (m.enemy_x <= LAST_X)
    bottom = y + lower_first + rows
    return edges(x + left, y + first, x + left + width, bottom, there, color=m.enemy_color)


def _late_columns(m: Ram, x: jax.Array, row: jax.Array) -> jax.Array:
    """Columns of an enemy that show a row late."""
    shows_from = match(
        (row <= m.y, ENEMY_ABOVE),
        ((row == m.y + 1) | (row == m.y + SHIP_ROWS + 1), ENEMY_AT_ENDS),
        (row <= m.y + SHIP_ROWS, ENEMY_BESIDE),
        otherwise=ENEMY_BELOW,
    )
    return jnp.clip(shows_from - x, 0, 8)


def _bomb_box(m: Ram) -> Box:
    """The bomb, in its row right of a column, and in the next row left of another.

    The ship's rows do not switch a bomb: a bomb just above them is visible in all of them.
    """
    x = m.bomb_x - 11
    y = m.bomb_y + ROW_0
    burst = _explodes(m)
    below = m.bomb_y > m.y
    long = m.bomb_y == m.y
    place = when(below, 1) + when(burst, 2)
    starts = pick(place, [shows.here for shows in BOMBS])
    ends = pick(place, [shows.lower for shows in BOMBS])
    here = starts < x + 4
    lower = jnp.where(here, 0, 1)
    left = jnp.where(here & ~long, jnp.maximum(x, starts), x)
    right = jnp.where(here | long, x + 4, jnp.minimum(x + 4, ends))
    bottom = y + 1 + jnp.where(long, SHIP_ROWS, lower)
    color = jnp.where(burst, SHIP_COLOR, only(jnp.arange(3) == m.drawn_enemy, m.enemy_color))
    first = (m.bomb_y == FIRST_ROW) & ~burst & (x >= FIRST_ROW_BOMB)
    falls = first | (m.bomb_y > FIRST_ROW + when(burst, 3))
    return edges(left, y + lower, right, bottom, falls, color=color)


def _score_box(m: Ram) -> Box:
    digits = jnp.where(m.digits > 9, 0, m.digits)
    score = 100 * jnp.sum(digits * np.array((1000, 100, 10, 1)), dtype=jnp.int32)
    # The last two zeros are always visible; without further digits, they are as wide as an 80.
    return POINTS.box(jnp.maximum(score, 80), value=score)


def _icons(m: Ram) -> Box:
    """The icons; 0 lives also show one. Before the first life, one too many is counted."""
    first = jnp.all((m.digits == 0) | (m.digits > 9))
    return SHIPS.box(
        jnp.clip(m.lives, 1, 3), value=jnp.where(first, jnp.minimum(m.lives, 5), m.lives)
    )


FIELD = (8, 49, 160, 188)
BELOW_TOP = (8, 37, 160, 47)  # area of the thrower
ENEMY_SHAPES = (Shape(w=(5, 8), h=(5, 11)), Shape(w=3, h=(2, 3)))
enemies = functools.partial(Blobs, region=FIELD, shapes=ENEMY_SHAPES)
OTHERS = tuple(c for c in ANY if c != SHIP_COLOR)
SHIP_RULE = Blobs(SHIP_COLOR, FIELD, Shape(w=8, h=4))
SHOT = Blobs(tuple(SHOT_COLORS), FIELD, Shape(w=(5, 8), h=1))
BRIGHT = ANY[16:]  # without the colours of the lines of an explosion
CUT_BOMB = Blobs(BRIGHT, FIELD, Shape(w=(1, 3), h=1))
BOMB = Blobs(ANY, FIELD, Shape(w=4, h=(1, 6)), also=(CUT_BOMB,))
THROWER = Bounds(BLACK, BELOW_TOP, THROWER_SIZE, max_size=THROWER_SIZE, inverse=True)
WEIGHTS = (100_000, 10_000, 1000, 100)  # the last two zeros are no digits
SCORE_RULE = Bounds(
    SCORE_COLOR, POINTS.area, value=Digits(FONT, POINTS.lefts[:4], POINTS.top, WEIGHTS)
)
ICONS_LEFT = Gauge(16, start=8, base=1, full=40)
ICON_RULE = Bounds((SHIP_COLOR, END_COLOR), (56, 23, 96, 27), value=ICONS_LEFT)

in_field = functools.partial(Category, needs=("Player",))

GAME = Game(
    name="StarGunner",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        known={"Lives": 0.2},  # full
    ),
    categories=(
        Category("Player", SHIP_RULE, attributes=("orientation",), role="player", doc="the ship"),
        in_field("PlayerMissile", SHOT, doc="the ship's shot"),
        in_field(
            "FlyingEnemy",
            enemies(OTHERS, also=(enemies(SHIP_COLOR),)),
            3,
            blinks=True,
            doc="enemies",
        ),
        in_field("BombThrower", THROWER, doc="the creature at the top"),
        in_field("Bomb", BOMB, blinks=True, doc="the thrower's bomb"),
        display("PlayerScore", SCORE_RULE, role="score", doc="points"),
        display("Lives", ICON_RULE, role="lives", doc="icons, at most three; value: lives"),
    ),
)
