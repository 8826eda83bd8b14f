"""Krull: the wedding that Slayers attack, the ride of the fire mares, the web, the beast's lair.

Picture: docs/games/Krull.png

Screen: in the desert the player's box surrounds both mares. Hour_Glass's value is the number of
rows of sand that are still above. Lines carry the player ($FA77 and $FAC7 of the second half). The
game draws each of two lines at three positions in rotation; the positions of two frames are valid.
The web and the ground are scenery.

Slots: Line has record * 3 + position. Weapon has the one on the desert's ground, then the player's
own in the lair. Star has the positions in the web at which it flashes while the player is at the
window. Life_HUD and Weapon_HUD have icons.

RAM: ALE's source (score, lives), OCAtari (scenes, records), and the ROM's code, which moves all
objects before the drawing ($F300 of the first half), except items in the desert.

Covered: four scenes, five rounds; the fortress, the star, the lair (cage whole or broken, weapon in
hand, thrown, in flames) and later rounds by writes to the RAM.

Not exact: from the sixth round on, figures may push the bride off the screen. The game's frame then
takes two emulated frames, and every other one of these shows an older picture.

VEM: it cuts mares that touch in the middle. It takes the player's weapon for a part of the player.
It misses the flashing player, his sword, a spider that a line crosses, and a line with the player
on it. It also misses a shot behind figures, and a weapon in front of the beast or in the light that
gives it flames.
"""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    NUSIZ_COPIES,
    NUSIZ_SPACING,
    WIDTH as SCREEN_WIDTH,
    Blobs,
    Bounds,
    Box,
    Category,
    Cells,
    Checks,
    Context,
    Detected,
    Digits,
    Game,
    Gauge,
    Icons,
    LivesAsIcons,
    LivesAsNumber,
    Packed,
    Pictures,
    Run,
    Runs,
    Shape,
    Static,
    Step,
    Tight,
    Variants,
    among,
    box,
    boxes,
    choose,
    display,
    edges,
    match,
    mod,
    pick,
    score_box,
    signed_nibble,
    when,
    wrap,
)
from ocjax.extractors.krull.lines import Lines
from ocjax.extractors.krull.ram import ROM, Flags, Item, Ram, Scene
from ocjax.extractors.krull.wedding import (
    BRIDES,
    COLWYNS,
    FIGURE_ROWS,
    SECOND,
    Person,
    Turns,
    off_at,
    on_at,
    person_of,
    turns_of_figures,
)

FONT = ROM.font(0xB07, rows=7)
STAY = ("Score", "Life_HUD", "Weapon_HUD")  # on the title screen after a game

FIELD = (8, 16, 160, 173)
ABOVE_GROUND = (8, 16, 160, 172)
STRIDES = 112  # least picture of the beast that is 12 columns wide
SANK = 7  # `y` of Lyssa in the lair after she has given the weapon its flames
RISEN = 64  # least `castle` that encodes no castle
STAR_PICTURE = 41  # `foe_picture` while the star replaces the spider in the web
SHOT_PAGE = 188  # `shot_page` while the player in the web has a picture of the second page
PART_BITS = 5
COLUMN_PARTS = 1 << PART_BITS  # units of `speed` and `item_part` in a column
LEAST_TOP = 18  # least `shot_top` that is drawn
OFF_SCREEN = 80  # least `y` and `shot_top` below the screen
SLANTED_FROM = 45  # a slanted shot has column `shot_x` in this row
# The web's lines.
LINE_X = (-33, 7)  # of each byte's line at the first position
LEAST_LINE_X = np.array((33, 40))  # of each byte, which goes around in a pitch
LINE_STEP = np.array((-1, 1))  # of each byte in the first rounds
LINE_PITCH = 24  # columns from position to position
LINE_SPEEDS = ROM.bytes(0x1F6D, 8).tolist()  # added to `line_clock` on a frame, by round
FIRST_BOTH_WAYS = 3  # round in which the lines move both ways
LINE_TOP = 16
LINE_WIDTH = 41
LINE_ROWS = 156

PEOPLE = Pictures.of(FIGURE_ROWS)
MARE_PICTURES = ROM.pictures(range(0x900, 0x9F8), 9)
SPIDERS = ROM.pictures(range(0x900, 0x9F8), 10)
STAR_X = np.array([20, 137] * 4)
STAR_Y = 2 * ROM.bytes(0x1F7A, 4).repeat(2) + 21

ROW = np.repeat(np.arange(4), 16)  # of the cage's pieces
COLUMN = np.tile(np.arange(16), 4)
WALL_X = 48 + 4 * COLUMN
WALL_Y = 39 + 4 * ROW
WALL_BYTE = 2 * ROW + COLUMN // 8
WALL_BIT = np.minimum(COLUMN, 15 - COLUMN)
ICON = np.arange(3)
ARMS = Icons(left=79, top=188, size=(8, 7), pitch=8, count=3)  # weapons left
WINDOW = Static(76, 23, 8, 26, 6)  # of the web
BEAST_RECORD = 1
FOE = 6  # record of the spider or star in the web; of the player's weapon in the lair


def decode(m: Ram) -> dict[str, Box]:
    figures = turns_of_figures(m)
    y = jnp.where(m.scene == Scene.WEDDING, figures.start, m.y)
    mares = _mare_boxes(m)
    by_name = {
        "Player": _player_box(m, y, mares),
        "Lyssa": _lyssa_box(m, y),
        "Slayers": _slayer_boxes(m, y).where(m.scene == Scene.WEDDING),
        "Slayer_Shot": _shot_box(m, figures).where(m.scene == Scene.WEDDING),
        "Spider": _spider_box(m),
        "Star": _star_box(m),
        "Line": _line_boxes(m).where(m.scene == Scene.WEB),
        "Window": WINDOW.box(m.scene == Scene.WEB),
        "Fire_Mare": mares,
        "Weapon": _weapon_boxes(m),
        "Life": _item_box(m, Item.LIFE, inset=1, width=6),
        "Castle": _castle_boxes(m),
        "Beast": _beast_box(m).where(m.scene == Scene.LAIR),
        "Enemy_Weapon": _enemy_weapon(m).where(m.scene == Scene.LAIR),
        "Wall": _cage_boxes(m).where(m.scene == Scene.LAIR),
        **_display_boxes(m),
    }
    return {name: b.where((name in STAY) | ~m.over) for name, b in by_name.items()}


def _display_boxes(m: Ram) -> dict[str, Box]:
    return {
        "Sun": _sun(m),
        "Hour_Glass": box(121, 3, 5, 8, value=jax.lax.population_count(m.sand)),
        "Score": _shown_score(m),
        "Life_HUD": box(56 + 8 * ICON, 188, 6, 7, m.lives > ICON, value=m.lives + 1),
        "Weapon_HUD": ARMS.box(m.weapons),
    }


def _mare_boxes(m: Ram) -> Box:
    turned = (m.flags[6:] & Flags.MARE_TURNED) != 0
    x = m.x[6:] + 8
    there = m.scene == Scene.DESERT
    return MARE_PICTURES.box(m.mare_picture, x, 145, mirrored=turned, valid=there)


def _spider_box(m: Ram) -> Box:
    there = (m.scene == Scene.WEB) & (m.foe_picture != STAR_PICTURE)
    return SPIDERS.box(m.foe_picture, m.x[FOE] + 8, 2 * m.y[FOE] + 21, valid=there)


def _star_box(m: Ram) -> Box:
    there = (m.scene == Scene.WEB) & (m.foe_picture == STAR_PICTURE)
    here = (m.x[FOE] + 10 == STAR_X) & (2 * m.y[FOE] + 21 == STAR_Y)
    return box(STAR_X, STAR_Y, 3, 4, there & here)


def _enemy_weapon(m: Ram) -> Box:
    height = 2 * (m.shot_bottom - m.shot_top) - 1
    return box(m.shot_x + 7, 2 * m.shot_top + 13, 4, height).clip(*FIELD)


def _cage_boxes(m: Ram) -> Box:
    return box(WALL_X, WALL_Y, 4, 4, (m.cage[WALL_BYTE] >> WALL_BIT & 1) == 1)


def _sun(m: Ram) -> Box:
    inset = 2 - jnp.clip(jnp.minimum(m.sun_y - 26, 41 - m.sun_y), 0, 2)  # of the rows that show
    return box(m.sun_x + 9 + inset, m.sun_y - 30, 7 - 2 * inset, 7).clip(0, 2, 160, 12)


def _shown_score(m: Ram) -> Box:
    right = match((m.score < 100, 87), (m.score < 10_000, 95), otherwise=103)  # centered
    return score_box(FONT, m.score, right=right, top=176, digits=6, value=m.score)


def _castle_boxes(m: Ram) -> Box:
    """The wall at the wedding, and the risen part of the fortress."""
    wall = box(32, 17, 96, 27, m.scene == Scene.WEDDING)
    rises = (m.scene == Scene.DESERT) & (m.castle < RISEN)
    fortress = box(48, 145 - m.castle, 64, m.castle, rises)
    return Box.stacked(wall, fortress)


def _beast_box(m: Ram) -> Box:
    """The beast; its dots are two columns wide."""
    turned = (m.flags[BEAST_RECORD] & Flags.TURNED) != 0
    wide = m.picture[BEAST_RECORD] >= STRIDES
    x = m.x[BEAST_RECORD] + _offset(m.x[BEAST_RECORD]) + match((turned, 5), (wide, 1), otherwise=3)
    return box(x, 2 * m.y[BEAST_RECORD] + 15, jnp.where(wide, 12, 10), 22)


def _player_box(m: Ram, y: jax.Array, mares: Box) -> Box:
    """Colwyn; in the desert, the box around both mares."""
    left = jnp.min(mares.x)
    top = jnp.min(mares.y)
    right = jnp.max(mares.x + mares.w)
    bottom = jnp.max(mares.y + mares.h)
    rides = edges(left, top, right, bottom)
    return choose(m.scene == Scene.DESERT, rides, _colwyn_box(m, y)).clip(*FIELD)


def _colwyn_box(m: Ram, y: jax.Array) -> Box:
    in_web = m.scene == Scene.WEB
    in_lair = m.scene == Scene.LAIR
    colwyn = person_of(m, y, COLWYNS)
    page = when(in_web & (m.shot_page == SHOT_PAGE), SECOND)
    picture = page + jnp.where(in_web, m.player_picture, colwyn.picture)
    x = colwyn.x + jnp.where(in_web, 8, _offset(colwyn.x))
    top = 2 * colwyn.y + match((in_web, 20), (in_lair, 15), otherwise=16)
    return PEOPLE.box(picture, x, top, mirrored=(colwyn.flags & Flags.TURNED) != 0)


def _offset(x: jax.Array) -> jax.Array:
    """Columns from a record's x to the screen's."""
    return jnp.where(x < 9, 6, 8)


def _lyssa_box(m: Ram, y: jax.Array) -> Box:
    at_wedding = m.scene == Scene.WEDDING
    in_lair = (m.scene == Scene.LAIR) & (m.y[BRIDES.elsewhere] < SANK)
    bride = person_of(m, y, BRIDES)
    top = 2 * bride.y + jnp.where(m.taken & at_wedding, 16, 15)
    turned = (bride.flags & Flags.TURNED) != 0
    whole = PEOPLE.box(bride.picture, bride.x + 8, top, mirrored=turned)
    return whole.clip(*FIELD).where(at_wedding | in_lair)


MOST_SLAYERS = 5  # records
MOST_COPIES = 3
SLAYER_RECORD = np.repeat(np.arange(MOST_SLAYERS), MOST_COPIES)  # by slot
SLAYER_COPY = np.tile(np.arange(MOST_COPIES), MOST_SLAYERS)


def _slayer_boxes(m: Ram, y: jax.Array) -> Box:
    """Slayers; their records begin after the bride's while she is free."""
    fields = jnp.stack([m.x, y, m.flags, m.picture])
    after_bride = fields[:, SLAYER_RECORD + 1]
    of_slot = jnp.where(m.taken, fields[:, SLAYER_RECORD], after_bride)
    person = Person(*of_slot)
    size = person.flags & Flags.SIZE
    x = person.x + _offset(person.x) + SLAYER_COPY * pick(size, NUSIZ_SPACING)
    exists = (m.slayers > SLAYER_RECORD) & (pick(size, NUSIZ_COPIES) > SLAYER_COPY)
    turned = (person.flags & Flags.TURNED) != 0
    top = 2 * person.y + 15
    whole = PEOPLE.box(SECOND + person.picture, x, top, mirrored=turned, valid=exists)
    return whole.clip(8, 27, 160, 173)


def _shot_box(m: Ram, figures: Turns) -> Box:
    """The Slayers' shot; its ends move by a row if the beam has passed it at a switch."""
    top = 2 * m.shot_top + 13
    rows = 2 * (m.shot_bottom - m.shot_top)
    step = -signed_nibble(m.shot_slant)  # columns per row
    head = mod(m.shot_x + 167 + step * (top - SLANTED_FROM), SCREEN_WIDTH)
    tail = wrap(head + step * (rows - 1))
    late = when(head < on_at(m.shot_top, figures), 1)
    ends_sooner = when(tail >= off_at(m.shot_bottom, figures), 1)
    height = rows - late - ends_sooner
    width = jnp.where(step == 0, 1, height)
    left = wrap(head + late * step) - when(step < 0, height - 1)
    drawn_shot = box(left, top + late, width, height, color=(m.shot_color - 1) & ~1)
    return drawn_shot.where(among(m.shot_top, range(LEAST_TOP, OFF_SCREEN))).clip(*ABOVE_GROUND)


def _line_boxes(m: Ram) -> Box:
    """The lines of this frame, and those of the one before, before their step ($F907)."""
    moved = m.line_clock < pick(m.round, LINE_SPEEDS)
    is_forward = (m.round < FIRST_BOTH_WAYS) | m.lines_as_first
    step = when(moved, jnp.where(is_forward, LINE_STEP, -LINE_STEP))
    before = LEAST_LINE_X + mod(m.line_x - LEAST_LINE_X - step + LINE_PITCH, LINE_PITCH)
    place = np.tile(np.arange(3), 2)
    is_before = place == mod(m.next_place + 1, 3)
    first_x = jnp.where(is_before, jnp.repeat(before, 3), jnp.repeat(m.line_x, 3))
    x = first_x + np.repeat(LINE_X, 3) + LINE_PITCH * place
    return box(x, LINE_TOP, LINE_WIDTH, LINE_ROWS, place != m.next_place).clip(*ABOVE_GROUND)


def _weapon_boxes(m: Ram) -> Box:
    """The weapon on the desert's ground, and the player's in the lair, held or thrown."""
    found = _item_box(m, Item.WEAPON, inset=0, width=8)
    there = (m.scene == Scene.LAIR) & (m.y[FOE] < OFF_SCREEN)
    x = m.x[FOE] + _offset(m.x[FOE])
    y = 2 * m.y[FOE] + 16
    turned = (m.flags[FOE] & Flags.TURNED) != 0
    flying = PEOPLE.box(SECOND + m.picture[FOE], x, y, mirrored=turned, valid=there)
    return Box.stacked(found, flying)


def _item_box(m: Ram, item: int, inset: int, width: int) -> Box:
    """An item in the desert, one move back, because the game moves it after drawing."""
    parts = jnp.abs(m.speed) - m.item_part
    moved = (parts + COLUMN_PARTS - 1) >> PART_BITS  # columns, rounded up
    x = m.item_x - jnp.sign(m.speed) * moved + 8 + inset
    return box(x, 157, width, 7, (m.scene == Scene.DESERT) & (m.item == item))


COLORS = (52, 54, 56, 58)
SLAYER = (68, 84, 100, 116, 132, 148, 164, 180)
BRIDE_COLORS = (152, 168, 136, 184, 88, 104, 120, 72)
OTHERS = {0, 6, 14, 34, 66, 238, 160, *COLORS, *SLAYER, *BRIDE_COLORS}
STONES = tuple(sorted({*range(0, 256, 2)} - OTHERS))
CASTLES = Bounds(((216,), STONES), ((32, 16, 128, 44), (48, 97, 112, 145)), min_size=(64, 3))
LOOT = (200, 206)  # the second one while it can be taken
ITEMS = (8, 157, 160, 164)
figure = partial(Blobs, gap=(1, 1))
PLAYER = figure((*COLORS, 238), FIELD, shapes=Shape(w=(4, 16), h=(7, 16)))
SLAYERS = figure(SLAYER, FIELD, shapes=Shape(w=(3, 8), h=(4, 17)))
SPIDER = figure(14, FIELD, shapes=Shape(w=(7, 8), h=(7, 12)))


class WithPoints(Step):
    """Add the rows above and below that hold a star's upper and lower point."""

    def __call__(self, found: Detected, _: Context) -> Detected:
        """The objects after the step."""
        return found._replace(box=boxes(found.x, found.y - 1, found.w, found.h + 2, found.valid))


# In the two middle rows, a star has three columns, and a line two at most.
STAR_MIDDLES = tuple(
    (x, y + 1, x + 3, y + 3) for x, y in zip(STAR_X.tolist(), STAR_Y.tolist(), strict=True)
)
STARS = Bounds(14, STAR_MIDDLES, min_size=(3, 2), then=(WithPoints(),))
ride = partial(
    Blobs, shapes=Shape(w=(4, 16), h=(5, 9), pixels=(20, 80), split=(8, 9)), then=(Tight(),)
)
THROWN = Bounds(tuple(range(80, 96, 2)), (8, 60, 160, 173), min_size=(4, 1))
WEAPONS = Bounds((LOOT, (238,)), (ITEMS, (8, 56, 160, 173)), min_size=(2, 2), exclude=("Life",))
IN_FLAMES = Bounds((LOOT, (66,)), (ITEMS, (8, 95, 160, 173)), min_size=(2, 2), exclude=("Life",))
HIT = range(110, 238, 16)  # the player's other colours when he flashes
ANY = tuple(c for c in range(0, 256, 2) if c != 160)
SHOT = Blobs(
    ANY,
    (8, 44, 160, 172),
    Shape(w=(1, 8), h=(5, 8), pixels=(5, 9)),
    filters=(Lines(5, rows=(44, 172)),),
)
# Left and right lines are apart in this row. The first position shows two rows lower.
CROSSED = 111
LEAST_X = 8  # of lines
MIDDLE = 80  # left lines end before it in that row
LEFT_OF_LINE = 7  # columns of a line's box left of its pixel in that row


class OffSpider(Step):
    """Drop lines on the left that are the legs of a spider in the row."""

    @property
    def other(self) -> str:
        """The category that the step reads."""
        return "Spider"

    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step."""
        legs = context.found["Spider"]
        in_row = legs.valid & (legs.y <= CROSSED) & (legs.y + legs.h > CROSSED)
        last = found.x + LEFT_OF_LINE
        first = jnp.where(found.x == LEAST_X, LEAST_X, last)  # columns that the box may belong to
        within = (legs.x <= last) & (first < legs.x + legs.w)
        return found.where(~(in_row & within & (last < MIDDLE)))


line = partial(Run, (6, 14), width=1)
LINE_RUNS = Runs(
    (
        *(line(CROSSED, left=x, height=61, before=x - 8, above=95, after=33) for x in range(8, 15)),
        line(CROSSED + 2, left=8, height=59, above=97, after=32),
        line(CROSSED, left=(15, 78), height=61, before=LEFT_OF_LINE, above=95, after=33),
        Run((6, *COLORS, *HIT), CROSSED, (80, 159), 1, height=61, before=33, above=95, after=7),
    ),
    most=3,
    then=(OffSpider(), Packed()),
)
SCORE = Digits(FONT, range(55, 103, 8), 176, centered=True)
CAGE = Cells(36, tuple(WALL_X.tolist()), tuple(WALL_Y.tolist()), 4, 4)
SAND = Gauge(1, side="h", of=Bounds(72, (121, 3, 126, 7)))
GLASS = Bounds((0, 72), (120, 3, 127, 11), min_size=(5, 1), max_size=(5, 8), value=SAND)
LIVES = tuple((56 + 8 * i, 188, 62 + 8 * i, 195) for i in range(3))
LIFE_ICONS = Bounds(200, (56, 188, 78, 195))
RESERVE = Bounds(200, LIVES, value=Gauge(8, 6, 2, of=LIFE_ICONS))

LYSSA = figure(BRIDE_COLORS, FIELD, shapes=Shape(w=(5, 8), h=(8, 17)))
GRAY = 142, 142, 142
GAME = Game(
    name="Krull",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        rare=("Beast", "Line", "Lyssa", "Slayer_Shot", "Star", "Wall", "Weapon"),
        lives=(LivesAsIcons(("Life_HUD",), hidden=1), LivesAsNumber("Life_HUD")),
        moved=0.15,  # many walls
    ),
    variants=Variants(
        starts={
            "scene=1": "the lair",
            "scene=2": "the web",
        },
    ),
    categories=(
        Category(
            "Player",
            PLAYER,
            rgb=(213, 130, 74),
            needs=("Hour_Glass",),
            role="player",
            doc="Colwyn; or both mares",
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
        Category("Beast", Bounds((34, 66), (8, 60, 160, 95), (5, 15)), doc="in the lair"),
        Category("Spider", SPIDER, doc="in the web"),
        Category(
            "Star",
            STARS,
            count=8,
            blinks=True,
            needs=("Window",),
            doc="in the spider's place",
        ),
        Category("Line", LINE_RUNS, count=6, rgb=GRAY, needs=("Window",), doc="of the web, move"),
        Category(
            "Fire_Mare",
            ride((56, 238), (8, 145, 160, 154)),
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
        Category("Life", Blobs(LOOT, ITEMS, Shape(w=(5, 6), h=7)), doc="likewise"),
        Category("Window", WINDOW.rule(), doc="of the web"),
        Category("Castle", CASTLES, count=2, doc="the wall at the wedding, the Black Fortress"),
        Category("Wall", CAGE, count=64, doc="pieces of the cage, row by row"),
        Category(
            "Hour_Glass",
            GLASS,
            attributes=("value",),
            rgb=(0, 0, 0),
            doc="only while a game is played",
        ),
        display("Sun", Bounds(14, (8, 2, 120, 12)), attributes=(), doc="the time of day"),
        display("Score", Bounds(238, (55, 176, 103, 183), value=SCORE), role="score", doc="points"),
        display("Life_HUD", RESERVE, count=3, role="lives", doc="in reserve; value: one more"),
        display(
            "Weapon_HUD", ARMS.rule(LOOT[0]), count=ARMS.count, attributes=(), doc="weapons left"
        ),
    ),
)
