"""Krull: the wedding that Slayers attack, the ride of the fire mares, the web, the beast's lair.

The byte `scene` says which it is. Slots of Slayers: record * 3 + copy. Fire_Mare has a box around
the two mares, which touch; so has the player then, who rides. Castle: the wall at the wedding, the
Black Fortress that rises in the desert. Wall: the 4 x 16 pieces of the cage in the lair, row by
row. Life and Weapon are found in the desert; those that the player has are Life_HUD and Weapon_HUD,
a slot an icon. Sun is the time of day, the value of Hour_Glass the rows of its sand. The strands of
the web and its moving lines (OCAtari's Line), the horizon and the ground are scenery; particles are
none of the objects. The title screen has the score and the icons.

RAM: ALE's source (score, lives), OCAtari 2.2 (scenes, records), and the ROM's code: all of it moves
between the vertical sync and the drawing, so that the RAM has what is on the screen; what is found
in the desert moves after it. The lair's and the wedding's bride and player share a sprite, which is
drawn in pairs of rows, the second one first.

Covered: both first rounds of all four scenes (the fortress and the lair reached by writing the
state of the ride). Not in this file: Star, Slayer_Shot (a line in changing colours) and
the weapon that is thrown. Broken pieces of the cage are read as OCAtari does and are not tested.
VEM misses the player while he flashes, his sword, and a spider that a line crosses.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box, choose
from ocjax.console import NUSIZ_COPIES, NUSIZ_SPACING
from ocjax.digits import score_box
from ocjax.game import Game
from ocjax.ops import pick
from ocjax.ram import RamMap, bcd, bits, byte, signed
from ocjax.rom import Pictures, Rom
from ocjax.rules import Blobs, Bounds, Category, Cells, display

ROM = Rom("krull", "4baada22435320d185c95b7dd2bcdb24")
FONT = ROM.font((0xB08, 0xB0E, *range(0xB15, 0xB4D, 7)), rows=7)

WEDDING, LAIR, WEB, DESERT = range(4)  # `scene`
STRIDES = 0x70  # least picture of the beast that is 12 columns wide
RISEN = 0x40  # greatest `castle` of a castle
LONG = 0x16  # least picture of a figure of 16 rows; others have 20


def _figure(page: int, code: int) -> np.ndarray:
    """The rows of a figure. The game draws two rows a turn, the upper one last."""
    height = 16 if code >= LONG else 20
    return ROM.rows(page | code + 1, height).reshape(-1, 2)[:, ::-1].ravel()


def _page(page: int, height: int) -> Pictures:
    return Pictures.of([ROM.rows(page | code, height) for code in range(0xF8)])


PEOPLE = Pictures.of([_figure(page, code) for page in (0xA00, 0xC00) for code in range(256)])
STAY = ("Score", "Life_HUD", "Weapon_HUD")  # on the title screen after a game
MARES = _page(0x900, 9)
SPIDERS = _page(0x900, 10)

FIELD = (8, 16, 160, 173)
WALL_X = np.tile(48 + 4 * np.arange(16), 4)
WALL_Y = np.repeat(39 + 4 * np.arange(4), 16)
WALL_BYTE = np.repeat(np.arange(4), 16) + np.tile(np.repeat([0, 4], 8), 4)
WALL_BIT = np.tile([*range(7, -1, -1), *range(8)], 4)


class Ram(RamMap):
    over = bits(0, first=7)  # the title is shown
    sun_y = byte(23)
    sun_x = byte(24)
    glass = byte(26)  # a bit for each row of sand
    score = bcd((28, 29, 30))
    lives = byte(31)  # in reserve
    weapons = byte(32)
    taken = bits(33, first=6)  # the bride is taken: her record is the seventh then
    scene = byte(34)
    shot_page = byte(67)
    player_picture = byte(66)
    foe_picture = byte(68)
    item = byte(70)
    item_picture = byte(72)
    speed = signed(76)
    shot_y = byte(77)
    item_x = byte(78)
    castle = byte(80)  # rows that have risen
    weapon_top = byte(76)
    cage = byte(*range(115, 123))  # a bit for each piece
    slayers = byte(82)
    x = byte(*range(83, 91))
    y = byte(*range(91, 99))
    flags = byte(*range(99, 107))
    picture = byte(*range(107, 115))


def decode(m: Ram) -> dict[str, Box]:
    wedding, lair, web, desert = (m.scene == scene for scene in range(4))
    mares = MARES.box(
        jnp.stack([m.player_picture, m.foe_picture]),
        jnp.stack([m.x[7], m.x[6]]) + 8,
        jnp.full(2, 145),
        mirrored=jnp.stack([m.flags[7], m.flags[6]]) >> 3 & 1 == 1,
        valid=desert,
    )
    i = np.arange(3)
    sun = jnp.minimum(m.sun_y - 25, 42 - m.sun_y)  # rows that show
    inset = jnp.where(sun == 1, 2, jnp.where(sun == 2, 1, 0))
    right = jnp.where(m.score < 100, 87, jnp.where(m.score < 10_000, 95, 103))
    boxes = {
        "Player": _player(m, mares),
        "Lyssa": _lyssa(m).where(wedding | lair),
        "Slayers": _slayers(m).where(wedding),
        "Spider": SPIDERS.box(m.foe_picture, m.x[6] + 8, 2 * m.y[6] + 21, valid=web),
        "Window": box(76, 23, 8, 26, web),
        "Fire_Mare": _both(mares),
        "Weapon": _item(m, 0xE2, 0, 8).where(desert),
        "Life": _item(m, 0xE9, 1, 6).where(desert),
        "Castle": _castles(m),
        "Beast": _beast(m).where(lair),
        "Enemy_Weapon": box(
            m.item_x + 7, 2 * m.weapon_top + 13, 4, 2 * (m.shot_y - m.weapon_top) - 1
        )
        .clip(*FIELD)
        .where(lair),
        "Wall": box(WALL_X, WALL_Y, 4, 4, lair & (m.cage[WALL_BYTE] >> WALL_BIT & 1 == 1)),
        "Sun": box(m.sun_x + 9 + inset, m.sun_y - 30, 7 - 2 * inset, 7).clip(0, 2, 160, 12),
        "Hour_Glass": box(121, 3, 5, 8, value=_count(m.glass)),
        "Score": score_box(FONT, m.score, right=right, top=176, digits=6, value=m.score),
        "Life_HUD": box(56 + 8 * i, 188, 6, 7, i < m.lives, value=m.lives + 1),
        "Weapon_HUD": box(79 + 8 * i, 188, 8, 7, i < m.weapons),
    }
    return {name: b.where((name in STAY) | (m.over == 0)) for name, b in boxes.items()}


def _castles(m: Ram) -> Box:
    """The wall at the wedding, and what has risen of the fortress."""
    there = (m.scene == np.array([WEDDING, DESERT])) & (m.castle < np.array([256, RISEN]))
    x, w = np.array([32, 48]), np.array([96, 64])
    top, height = jnp.stack([jnp.int32(17), 145 - m.castle]), jnp.stack([jnp.int32(27), m.castle])
    return box(x, top, w, height, there)


def _beast(m: Ram) -> Box:
    """The beast, whose dots are two columns wide."""
    turned, wide = (m.flags[1] & 16) > 0, m.picture[1] >= STRIDES
    left = jnp.where(turned, 5, jnp.where(wide, 1, 3)) + _left(m.x[1])
    return box(m.x[1] + left, 2 * m.y[1] + 15, jnp.where(wide, 12, 10), 22)


def _count(b: jax.Array) -> jax.Array:
    return sum((b >> i & 1 for i in range(8)), jnp.zeros_like(b))


def _player(m: Ram, mares: Box) -> Box:
    wedding, lair, web = (m.scene == scene for scene in (WEDDING, LAIR, WEB))
    taken = m.taken == 1

    def k(v: jax.Array) -> jax.Array:
        return jnp.where(web | lair, v[0], jnp.where(taken, v[7], v[6]))

    x = k(m.x) + jnp.where(web, 8, _left(k(m.x)))
    y = 2 * k(m.y) + jnp.where(web, 20, jnp.where(lair, 15, 16))
    page = jnp.where(web & (m.shot_page == 0xBC), 256, 0)
    code = jnp.where(web, m.player_picture, k(m.picture))
    walks = PEOPLE.box(
        page + code, x, y, mirrored=(k(m.flags) & 16) > 0, valid=wedding | web | lair
    )
    return choose(m.scene == DESERT, _both(mares), walks).clip(*FIELD)


def _both(mares: Box) -> Box:
    """The box around the two mares, which run side by side."""
    left, top = jnp.min(mares.x), jnp.min(mares.y)
    right, bottom = jnp.max(mares.x + mares.w), jnp.max(mares.y + mares.h)
    return box(left, top, right - left, bottom - top, jnp.all(mares.valid))


def _left(x: jax.Array) -> jax.Array:
    """Columns from a record's x to the screen's."""
    return jnp.where(x < 9, 6, 8)


def _lyssa(m: Ram) -> Box:
    taken = m.taken == 1
    lair = m.scene == LAIR

    def k(v: jax.Array) -> jax.Array:
        return jnp.where(lair, v[2], jnp.where(taken, v[6], v[0]))

    # Taken, she shares a sprite with the player, who is drawn first.
    y = jnp.where(taken & ~lair, jnp.maximum(2 * m.y[6] + 16, 2 * m.y[7] + 44), 2 * k(m.y) + 15)
    return PEOPLE.box(k(m.picture), k(m.x) + 8, y, mirrored=(k(m.flags) & 16) > 0).clip(*FIELD)


def _slayers(m: Ram) -> Box:

    def at(v: jax.Array) -> jax.Array:
        return jnp.repeat(jnp.where(m.taken == 1, v[:5], v[1:6]), 3)

    copy, record = np.tile(np.arange(3), 5), np.repeat(np.arange(5), 3)
    size = at(m.flags) & 7
    x = at(m.x) + _left(at(m.x)) + copy * pick(size, NUSIZ_SPACING)
    there = (record < m.slayers) & (copy < pick(size, NUSIZ_COPIES))
    return PEOPLE.box(
        256 + at(m.picture),
        x,
        jnp.maximum(2 * at(m.y) + 15, 27),
        mirrored=(at(m.flags) & 16) > 0,
        valid=there,
    ).clip(8, 27, 160, 173)


def _item(m: Ram, kind: int, left: int, width: int) -> Box:
    x = ((m.item_x << 8 | m.picture[7]) - (m.speed << 3)) >> 8
    return box(x + 8 + left, 157, width, 7, m.item == kind)


COLORS = (0x34, 0x36, 0x38, 0x3A)
SLAYER = (0x44, 0x54, 0x64, 0x74, 0x84, 0x94, 0xA4, 0xB4)
BRIDE = (0x98, 0xA8, 0x88, 0xB8, 0x58, 0x68, 0x78, 0x48)

OTHERS = (0, 6, 0x0E, 0x22, 0x42, 0xEE, 0xA0, *COLORS, *SLAYER, *BRIDE)
STONES = tuple(c for c in range(0, 256, 2) if c not in OTHERS)
CASTLES = Bounds(((0xD8,), STONES), ((32, 16, 128, 44), (48, 97, 112, 145)), min_size=(64, 3))
MAGENTA = tuple(range(0x50, 0x60, 2))
ITEMS = (8, 157, 160, 164)
figure = functools.partial(Blobs, gap=(1, 1))
PLAYER = figure((*COLORS, 0xEE), FIELD, min_size=(4, 7), max_size=(16, 16))
SLAYERS = figure(SLAYER, FIELD, min_size=(3, 4), max_size=(8, 17))
SPIDER = figure(0x0E, FIELD, min_size=(7, 7), max_size=(8, 12))
MARES_AT = (8, 145, 160, 154)
RIDE = figure((0x38, 0xEE), MARES_AT, min_size=(12, 8), max_size=(16, 9))
THROWN = Bounds(MAGENTA, (8, 60, 160, 173), min_size=(4, 2))
CAGE = Cells(0x24, tuple(WALL_X.tolist()), tuple(WALL_Y.tolist()), 4, 4)
GLASS = Blobs((0, 0x48), (120, 3, 127, 11), min_size=(5, 8), max_size=(5, 8))
LIVES = tuple((56 + 8 * i, 188, 62 + 8 * i, 195) for i in range(3))
ARMS = tuple((79 + 8 * i, 188, 87 + 8 * i, 195) for i in range(3))

GAME = Game(
    name="Krull",
    rom=ROM.name,
    md5=ROM.md5,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", PLAYER, needs="Hour_Glass", doc="Colwyn; in the desert both mares"),
        Category("Lyssa", figure(BRIDE, FIELD, min_size=(5, 8), max_size=(8, 17)), doc="the bride"),
        Category("Slayers", SLAYERS, count=15, doc="record * 3 + copy"),
        Category("Beast", Bounds((0x22, 0x42), (8, 60, 160, 95), (5, 15)), doc="in the lair"),
        Category("Spider", SPIDER, doc="in the web"),
        Category("Fire_Mare", RIDE, needs="Hour_Glass", doc="two mares that run side by side"),
        Category("Enemy_Weapon", THROWN, needs="Beast", doc="what the beast throws"),
        Category("Weapon", Bounds(0xC8, ITEMS, min_size=(7, 5)), doc="in the desert"),
        Category("Life", Blobs(0xC8, ITEMS, min_size=(5, 7), max_size=(6, 7)), doc="likewise"),
        Category("Window", Bounds(6, (76, 23, 84, 49), min_size=(8, 26)), doc="of the web"),
        Category("Castle", CASTLES, count=2, doc="the wall at the wedding, the Black Fortress"),
        Category("Wall", CAGE, count=64, doc="pieces of the cage, row by row"),
        Category("Hour_Glass", GLASS, attributes=("value",), doc="only while a game is played"),
        display("Sun", Bounds(0x0E, (8, 2, 120, 12)), attributes=(), doc="the time of day"),
        display("Score", Bounds(0xEE, (55, 176, 103, 183)), doc="points"),
        display("Life_HUD", Bounds(0xC8, LIVES), count=3, doc="in reserve; value: one more"),
        display("Weapon_HUD", Bounds(0xC8, ARMS), count=3, attributes=(), doc="weapons left"),
    ),
)
