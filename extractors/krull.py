"""Krull: the wedding that Slayers attack, the ride of the fire mares, the web, the beast's lair.

Slots of Line: record * 3 + place; of Weapon: what is found in the desert, the player's own in the
lair; of Star: where it flashes in the web while the player is at the window; of Life_HUD and
Weapon_HUD: icons. In the desert the player has a box around both mares. Hour_Glass's value is the
rows of sand that are still above. Lines carry the player ($FA77 and $FAC7 of the second half); each
of two is drawn at three places in turn, and those of two frames are valid. The web and the ground
are scenery.

RAM: ALE's source (score, lives), OCAtari 2.2 (scenes, records), and the ROM's code, which moves all
before the drawing ($F300 of the first half), save what is found in the desert.

Covered: four scenes, five rounds; the fortress, the star, the lair (cage whole or broken, weapon in
hand, thrown, in flames) and later rounds by writes to the RAM. From the sixth round on, figures may
push the bride off the screen; the game's frame then lasts for two of the emulator's, of which every
other one shows an older picture. When the web's lines jump back by a place, those of the frame
before are not valid. VEM cuts mares that touch in the middle; it takes the player's weapon for a
part of him; it misses him while he flashes, his sword, a spider that a line crosses, a line that he
hangs on, a shot behind figures, a weapon in the light that gives it flames or before the beast.
"""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box, choose
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import among, mod, pick
from ocjax.console.ram import RamMap, bcd, bits, byte, signed
from ocjax.console.registers import NUSIZ_COPIES, NUSIZ_SPACING, signed_nibble, wrap
from ocjax.console.rom import Pictures
from ocjax.extraction.game import Category, Game, display
from ocjax.extractors._krull import FIGURES, ROM, SECOND, off_at, on_at, turns
from ocjax.vision.filters import Lines
from ocjax.vision.rules import Blobs, Bounds, Cells, Gauge, Run, Runs
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Packed, Tight

FONT = ROM.font(0xB07, rows=7)
WEDDING, LAIR, WEB, DESERT = range(4)  # `scene`
STRIDES = 0x70  # least picture of the beast that is 12 columns wide
SANK = 7  # `y` of Lyssa in the lair after she has given the weapon its flames
RISEN = 0x40  # greatest `castle` of a castle
# `item`
WEAPON = 0xE2
LIFE = 0xE9
STAR = 0x29  # `foe_picture` while the star is in the web in place of the spider
TOP = 18  # least `shot_top` that is drawn
BOTTOM = 0x50  # least `y` and `shot_top` that are not
SLANTED_FROM = 45  # the row in which a slanted shot would be at `shot_x`
PEOPLE = Pictures.of(FIGURES)
STAR_X = np.array([20, 137] * 4)
STAR_Y = 2 * ROM.bytes(0x1F7A, 4).repeat(2) + 21
STAY = ("Score", "Life_HUD", "Weapon_HUD")  # on the title screen after a game
MARES, SPIDERS = (ROM.pictures(range(0x900, 0x9F8), height) for height in (9, 10))
FIELD = (8, 16, 160, 173)
ABOVE_GROUND = (8, 16, 160, 172)
# of the cage's pieces
ROW = np.repeat(np.arange(4), 16)
COLUMN = np.tile(np.arange(16), 4)
WALL_X = 48 + 4 * COLUMN
WALL_Y = 39 + 4 * ROW
WALL_BYTE = 2 * ROW + COLUMN // 8
WALL_BIT = np.minimum(COLUMN, 15 - COLUMN)


class Ram(RamMap):
    over = bits(0, first=7)  # the title is shown
    sun_y = byte(23)
    sun_x = byte(24)
    sand = bits(26, first=4, count=4)  # a bit for each row that is still above
    score = bcd((28, 29, 30))
    lives = byte(31)  # in reserve
    weapons = byte(32)
    taken = bits(33, first=6)  # the bride is taken: her record is the seventh then
    scene = byte(34)
    shot_page = byte(67)
    player_picture = byte(66)
    foe_picture = byte(68)
    item = byte(70)
    speed = signed(76)  # 1/32 of a column a frame
    shot_top = byte(76)  # (y - 13) / 2
    shot_bottom = byte(77)  # likewise; what is found in the desert: steps of 1/32 of a column
    shot_x = byte(78)  # x - 7; of what is found in the desert
    shot_slant = bits(79, first=4, count=4)
    castle = byte(80)  # rows that have risen
    cage = byte(*range(115, 123))  # a bit for each piece
    line_x = byte(116, 115)  # x + 33 and x - 7 of the first place
    next_place = byte(117)  # at which the lines are drawn on the next frame
    shot_color = byte(81)  # changes after the drawing
    slayers = byte(82)
    x = byte(*range(83, 91))  # of the eight records
    y = byte(*range(91, 99))
    flags = byte(*range(99, 107))
    picture = byte(*range(107, 115))


def decode(m: Ram) -> dict[str, Box]:
    wedding, lair, web, desert = (m.scene == scene for scene in range(4))
    figures = turns(m.x, m.y, m.picture, m.slayers, m.taken)
    y = jnp.where(wedding, figures[0], m.y)
    pictures, turned = jnp.stack([m.foe_picture, m.player_picture]), (m.flags[6:] & 8) > 0
    mares = MARES.box(pictures, m.x[6:] + 8, np.full(2, 145), mirrored=turned, valid=desert)
    i = np.arange(3)
    top, height = 2 * m.shot_top + 13, 2 * (m.shot_bottom - m.shot_top)
    star, in_web = web & (m.foe_picture == STAR), 2 * m.y[6] + 21
    inset = 2 - jnp.clip(jnp.minimum(m.sun_y - 26, 41 - m.sun_y), 0, 2)  # of the rows that show
    right = jnp.where(m.score < 100, 87, jnp.where(m.score < 10_000, 95, 103))
    boxes = {
        "Player": _player(m, y, mares),
        "Lyssa": _lyssa(m, y).where(wedding | (lair & (m.y[2] < SANK))),
        "Slayers": _slayers(m, y).where(wedding),
        "Slayer_Shot": replace(_shot(m, figures).where(wedding), color=m.shot_color - 1 & 0xFE),
        "Spider": SPIDERS.box(m.foe_picture, m.x[6] + 8, in_web, valid=web & ~star),
        "Star": box(STAR_X, STAR_Y, 3, 4, star & (m.x[6] + 10 == STAR_X) & (in_web == STAR_Y)),
        "Line": _lines(m).where(web),
        "Window": box(76, 23, 8, 26, web),
        "Fire_Mare": mares,
        "Weapon": _weapons(m),
        "Life": _item(m, 1, 6).where(desert & (m.item == LIFE)),
        "Castle": _castles(m),
        "Beast": _beast(m).where(lair),
        "Enemy_Weapon": box(m.shot_x + 7, top, 4, height - 1).clip(*FIELD).where(lair),
        "Wall": box(WALL_X, WALL_Y, 4, 4, lair & (m.cage[WALL_BYTE] >> WALL_BIT & 1 == 1)),
        "Sun": box(m.sun_x + 9 + inset, m.sun_y - 30, 7 - 2 * inset, 7).clip(0, 2, 160, 12),
        "Hour_Glass": box(121, 3, 5, 8, value=jax.lax.population_count(m.sand)),
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


def _record(m: Ram, y: jax.Array, elsewhere: int, taken: int, free: int) -> jax.Array:
    """x, y, flags and picture of a record, by whether the bride is taken at the wedding."""
    fields = jnp.stack([m.x, y, m.flags, m.picture])
    wedding = jnp.where(m.taken == 1, fields[:, taken], fields[:, free])
    return jnp.where(m.scene == WEDDING, wedding, fields[:, elsewhere])


def _player(m: Ram, y: jax.Array, mares: Box) -> Box:
    """The player; in the desert, the box around the mares."""
    web, lair = m.scene == WEB, m.scene == LAIR
    x, y, flags, picture = _record(m, y, 0, 7, 6)
    page = jnp.where(web & (m.shot_page == 0xBC), SECOND, 0)
    walks = PEOPLE.box(
        page + jnp.where(web, m.player_picture, picture),
        x + jnp.where(web, 8, _left(x)),
        2 * y + jnp.where(web, 20, jnp.where(lair, 15, 16)),
        mirrored=(flags & 16) > 0,
    )
    left, top = jnp.min(mares.x), jnp.min(mares.y)
    right, bottom = jnp.max(mares.x + mares.w), jnp.max(mares.y + mares.h)
    rides = box(left, top, right - left, bottom - top)
    return choose(m.scene == DESERT, rides, walks).clip(*FIELD)


def _left(x: jax.Array) -> jax.Array:
    """Columns from a record's x to the screen's."""
    return jnp.where(x < 9, 6, 8)


def _lyssa(m: Ram, y: jax.Array) -> Box:
    x, y, flags, picture = _record(m, y, 2, 6, 0)
    top = 2 * y + jnp.where((m.taken == 1) & (m.scene == WEDDING), 16, 15)
    return PEOPLE.box(picture, x + 8, top, mirrored=(flags & 16) > 0).clip(*FIELD)


def _slayers(m: Ram, y: jax.Array) -> Box:
    """Slayers, whose records begin after the bride's while she is free."""
    copy, record = np.tile(np.arange(3), 5), np.repeat(np.arange(5), 3)
    fields = jnp.stack([m.x, y, m.flags, m.picture])
    x, y, flags, picture = jnp.where(m.taken == 1, fields[:, record], fields[:, record + 1])
    size = flags & 7
    return PEOPLE.box(
        SECOND + picture,
        x + _left(x) + copy * pick(size, NUSIZ_SPACING),
        2 * y + 15,
        mirrored=(flags & 16) > 0,
        valid=(record < m.slayers) & (copy < pick(size, NUSIZ_COPIES)),
    ).clip(8, 27, 160, 173)


def _shot(m: Ram, figures: jax.Array) -> Box:
    """The Slayers' shot, of a row more or less where the beam has passed it when it is switched."""
    top, rows = 2 * m.shot_top + 13, 2 * (m.shot_bottom - m.shot_top)
    step = -signed_nibble(m.shot_slant)  # columns a row
    head = mod(m.shot_x + 167 + step * (top - SLANTED_FROM), 160)
    late = jnp.where(head < on_at(m.shot_top, figures), 1, 0)
    longer = wrap(head + step * (rows - 1)) < off_at(m.shot_bottom, figures)
    top, left, height = top + late, wrap(head + late * step), rows - late - jnp.where(longer, 0, 1)
    left = left - jnp.where(step < 0, height - 1, 0)
    shot = box(left, top, jnp.where(step == 0, 1, height), height)
    return shot.where(among(m.shot_top, range(TOP, BOTTOM))).clip(*ABOVE_GROUND)


def _lines(m: Ram) -> Box:
    """The lines: those of this frame and of the one before."""
    place = np.tile(np.arange(3), 2)
    x = jnp.repeat(m.line_x + np.array([-33, 7]), 3) + 24 * place
    return box(x, 16, 41, 156, place != m.next_place).clip(*ABOVE_GROUND)


def _weapons(m: Ram) -> Box:
    """What is found in the desert, and the player's in the lair, held or thrown."""
    found = _item(m, 0, 8).where((m.scene == DESERT) & (m.item == WEAPON))
    there = (m.scene == LAIR) & (m.y[6] < BOTTOM)
    x, y, turned = m.x[6] + _left(m.x[6]), 2 * m.y[6] + 16, (m.flags[6] & 16) > 0
    thrown = PEOPLE.box(SECOND + m.picture[6], x, y, mirrored=turned, valid=there)
    return jax.tree.map(lambda *parts: jnp.stack(parts), found, thrown)


def _item(m: Ram, left: int, width: int) -> Box:
    """What is found in the desert, which has been moved since it was drawn."""
    moved = jnp.abs(m.speed) - m.shot_bottom + 31 >> 5
    return box(m.shot_x - jnp.sign(m.speed) * moved + 8 + left, 157, width, 7)


COLORS = (0x34, 0x36, 0x38, 0x3A)
SLAYER = (0x44, 0x54, 0x64, 0x74, 0x84, 0x94, 0xA4, 0xB4)
BRIDE = (0x98, 0xA8, 0x88, 0xB8, 0x58, 0x68, 0x78, 0x48)
OTHERS = {0, 6, 0x0E, 0x22, 0x42, 0xEE, 0xA0, *COLORS, *SLAYER, *BRIDE}
STONES = tuple(sorted({*range(0, 256, 2)} - OTHERS))
CASTLES = Bounds(((0xD8,), STONES), ((32, 16, 128, 44), (48, 97, 112, 145)), min_size=(64, 3))
# the second colour while it can be taken
ITEM = (0xC8, 0xCE)
ITEMS = (8, 157, 160, 164)
figure = partial(Blobs, gap=(1, 1))
PLAYER = figure((*COLORS, 0xEE), FIELD, shapes=Shape(w=(4, 16), h=(7, 16)))
SLAYERS = figure(SLAYER, FIELD, shapes=Shape(w=(3, 8), h=(4, 17)))
SPIDER = figure(0x0E, FIELD, shapes=Shape(w=(7, 8), h=(7, 12)))
STARS = Cells(0x0E, (20, 137) * 4, tuple(STAR_Y.tolist()), 3, 4, whole=False, margin=(1, 2))
ride = partial(
    Blobs, shapes=Shape(w=(4, 16), h=(5, 9), pixels=(20, 80), split=(8, 9)), then=(Tight(),)
)
THROWN = Bounds(tuple(range(0x50, 0x60, 2)), (8, 60, 160, 173), min_size=(4, 1))
WEAPONS = Bounds((ITEM, (0xEE,)), (ITEMS, (8, 56, 160, 173)), min_size=(2, 2), exclude=("Life",))
IN_FLAMES = Bounds((ITEM, (0x42,)), (ITEMS, (8, 95, 160, 173)), min_size=(2, 2), exclude=("Life",))
HIT = range(0x6E, 0xEE, 16)  # the player's other colours when he flashes
ANY = tuple(c for c in range(0, 256, 2) if c != 0xA0)
SHOT = Blobs(
    ANY,
    (8, 44, 160, 172),
    Shape(w=(1, 8), h=(5, 8), pixels=(5, 9)),
    filters=(Lines(5, rows=(44, 172)),),
)
# The row in which left and right lines are apart. The first one shows two rows further down.
CROSSED = 111
line = partial(Run, (6, 14), width=1)
LINES = Runs(
    (
        *(line(CROSSED, left=x, height=61, before=x - 8, above=95, after=33) for x in range(8, 15)),
        line(CROSSED + 2, left=8, height=59, above=97, after=32),
        line(CROSSED, left=(15, 78), height=61, before=7, above=95, after=33),
        Run((6, *COLORS, *HIT), CROSSED, (80, 159), 1, height=61, before=33, above=95, after=7),
    ),
    most=3,
    then=(Packed(),),
)
SCORE = Digits(FONT, range(55, 103, 8), 176, centered=True)
CAGE = Cells(0x24, tuple(WALL_X.tolist()), tuple(WALL_Y.tolist()), 4, 4)
SAND = Gauge(1, side="h", of=Bounds(0x48, (121, 3, 126, 7)))
GLASS = Bounds((0, 0x48), (120, 3, 127, 11), min_size=(5, 1), max_size=(5, 8), value=SAND)
LIVES = tuple((56 + 8 * i, 188, 62 + 8 * i, 195) for i in range(3))
ICONS = Bounds(0xC8, (56, 188, 78, 195))
RESERVE = Bounds(0xC8, LIVES, value=Gauge(8, 6, 2, of=ICONS))
ARMS = tuple((79 + 8 * i, 188, 87 + 8 * i, 195) for i in range(3))

LYSSA = figure(BRIDE, FIELD, shapes=Shape(w=(5, 8), h=(8, 17)))
GREY = 142, 142, 142
GAME = Game(
    name="Krull",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player", PLAYER, rgb=(213, 130, 74), needs=("Hour_Glass",), doc="Colwyn; or both mares"
        ),
        Category("Lyssa", LYSSA, rgb=(84, 138, 210), doc="the bride"),
        Category(
            "Slayers",
            SLAYERS,
            count=15,
            rgb=(45, 50, 184),
            needs=("Castle",),
            doc="record * 3 + copy",
        ),
        Category("Slayer_Shot", SHOT, needs=("Slayers",), doc="held by a Slayer or thrown"),
        Category("Beast", Bounds((0x22, 0x42), (8, 60, 160, 95), (5, 15)), doc="in the lair"),
        Category("Spider", SPIDER, doc="in the web"),
        Category(
            "Star",
            STARS,
            count=8,
            blinks=True,
            needs=("Window",),
            doc="in the spider's place",
        ),
        Category("Line", LINES, count=6, rgb=GREY, needs=("Window",), doc="of the web, move"),
        Category(
            "Fire_Mare",
            ride((0x38, 0xEE), (8, 145, 160, 154)),
            count=2,
            needs=("Hour_Glass",),
            doc="run side by side",
        ),
        Category("Enemy_Weapon", THROWN, needs=("Beast",), doc="what the beast throws"),
        Category(
            "Weapon",
            WEAPONS,
            count=2,
            needs=("Fire_Mare", "Beast"),
            otherwise=IN_FLAMES,
            doc="in the desert; the player's in the lair",
        ),
        Category("Life", Blobs(ITEM, ITEMS, Shape(w=(5, 6), h=7)), doc="likewise"),
        Category("Window", Bounds(6, (76, 23, 84, 49), min_size=(8, 26)), doc="of the web"),
        Category("Castle", CASTLES, count=2, doc="the wall at the wedding, the Black Fortress"),
        Category("Wall", CAGE, count=64, doc="pieces of the cage, row by row"),
        Category(
            "Hour_Glass",
            GLASS,
            attributes=("value",),
            rgb=(0, 0, 0),
            doc="only while a game is played",
        ),
        display("Sun", Bounds(0x0E, (8, 2, 120, 12)), attributes=(), doc="the time of day"),
        display("Score", Bounds(0xEE, (55, 176, 103, 183), value=SCORE), doc="points"),
        display("Life_HUD", RESERVE, count=3, doc="in reserve; value: one more"),
        display("Weapon_HUD", Bounds(0xC8, ARMS), count=3, attributes=(), doc="weapons left"),
    ),
)
