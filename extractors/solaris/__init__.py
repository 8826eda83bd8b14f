"""Solaris: a ship that jumps from sector to sector, flies in space and over planets.

Screen: space, a planet, or the chart of a quadrant's 48 sectors. Flames of the ship, stars, hills,
lines of the ground, the planet in a planet's sky, the chart's grid, words, and the streaks that the
ship flies through while it jumps are scenery.

RAM: a kernel of bank 2 ($F000-$F2C9) draws space, one of bank 3 ($F000-$F283) planets, and another
part of bank 3 ($F484) the chart. Five records hold what flies about: a picture, x, y and depth
each. One sprite shows the four of them that do not overlap in height, from the top down; the other
sprite shows the fifth record, the two shots and the ship. The low three bits of a picture are its
size, from the depth ($FDA2 of bank 0). `pictures` follows both kernels row by row. Below the view
is the panel, with the scanner (`panel`).

The two shots are drawn with random dots: $F066 of bank 2 masks each row with bytes from a place
that depends on how long the last frame took ($F73D of bank 1 reads the timer). That is not in RAM
when the frame ends, so REM has the box of a shot's whole picture, and VEM that of its visible dots;
a far shot is a single dot, and hidden on most frames.

Covered: random play in space, over planets and on the chart, lost lives, the end of a game. Warp,
Blockader, Raider and Tower were not met in it: their pictures and colours are the ROM's.

Not exact: what is behind another picture. The state that a reset returns comes before the ROM has
derived anything from its records; `Ram` then has what the first frame shows. At the end of a game,
all records are those of the next one already, beside a frame of the last one.

VEM: it sees pictures that overlap as one, does not tell blockaders of one dot from stars, and
misses black rows of craters on the ground's black lines.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, BoxTable, box
from ocjax.console.fonts import Digits
from ocjax.console.ops import among, lookup, match, pick, when
from ocjax.extraction.game import Category, Game, display
from ocjax.extractors.solaris import sight
from ocjax.extractors.solaris.panel import (
    BANK_1,
    FONT,
    LEFT_CELL,
    RIGHT_CELL,
    scanned,
    sprite_column,
)
from ocjax.extractors.solaris.pictures import (
    BLUE_COLOR_ROW,
    CUTS,
    GROUND_TOP,
    MOST_ROWS,
    TABLE,
    TOP,
)
from ocjax.extractors.solaris.ram import RECORDS, ROM, Kind, Picture, Ram, ShipPicture
from ocjax.extractors.solaris.vision import ON_CHART
from ocjax.vision.displays import IconRow, NumberDisplay
from ocjax.vision.rules import Bounds, Cells, Gauge

SCORE = NumberDisplay(FONT, right=105, top=5, digits=6)
JUMP = NumberDisplay(FONT, right=105, top=152, digits=2, leading_zeros=True)
LINE = 170  # line + height above the panel, of a picture's first row
HIGHEST = 0x99  # from here on, a record is above the view
SHIP_COLOR_ROW = 6  # of the ship's box: its colour is there
DARTER_SHIFT = 4  # columns to the right, of darters that the ship's sprite shows
MADE_WITHOUT_SHIP = 0xD7  # `ship_picture` made while there was none: a new ship is not drawn yet

# Sizes of pictures by half the depth: of all but planets in the low nibble, of planets in the high.
SIZES_BY_DEPTH = ROM.bytes(0xDA2, 20)
BAR_LEFT = 120
EMPTY_BAR = 5  # columns

SHOT_PICTURES = (0x8E, 0x96, 0x9D, 0xA3, 0xA8, 0x99, 0xA6)  # low bytes of pictures
SHOT_PAGE = 0x2500  # in the ROM
SYMBOL_PICTURES = BANK_1 + 0x100

CELL_X = 36 + 16 * np.tile(np.arange(6), 8)  # of the chart's sectors
CELL_Y = 46 + 13 * np.repeat(np.arange(8), 6)
CHART_COLORS = ROM.bytes(0x37F0, 16) | 0x0E  # of the symbols, by quadrant
JUMP_COLORS = [int(color) - 14 + 200 & 254 for color in CHART_COLORS]  # likewise, of the time
CHART_OPENS = 64  # frame count while the chart is not drawn yet


def decode(m: Ram) -> dict[str, Box]:
    things = _records_shown(m)
    return {
        "Player": _ship_box(m),
        "PlayerMissile": _shot_boxes(m),
        **_flying(m, things),
        **_worlds(m, things),
        "ChartSymbol": _symbol_boxes(m),
        "JumpTimer": _jump_timer(m),
        **_displays(m),
    }


def _flying(m: Ram, things: Box) -> dict[str, Box]:
    """Enemies and what they leave, by kind of picture."""
    kind = m.picture >> 3
    space, planet = m.on_planet == 0, m.on_planet == 1
    darts = (m.picture >= Picture.DARTER) & (kind == Kind.WARP)
    return {
        "Fighter": things.where(kind == Kind.FIGHTER),
        "Pirate": things.where(kind == Kind.PIRATE),
        "Warp": things.where(space & (kind == Kind.WARP) & ~darts),
        "Darter": things.where(space & darts),
        "HyperJumper": things.where(space & (kind == Kind.JUMPER)),
        "PlanetKiller": things.where(space & (kind == Kind.KILLER)),
        "Blockader": things.where(space & (kind == Kind.BLOCKADER)),
        "Raider": things.where(planet & (kind == Kind.WARP)),
        "Man": things.where(planet & (kind == Kind.JUMPER)),
        "LandingZone": things.where(planet & (kind == Kind.KILLER)),
        "Tower": things.where(planet & (kind == Kind.BLOCKADER)),
        "EnemyMissile": things.where(kind == Kind.ENEMY_MISSILE),
        "Explosion": things.where(kind == Kind.EXPLOSION),
    }


def _worlds(m: Ram, things: Box) -> dict[str, Box]:
    """Planets and craters. A planet in the ship's sprite is a part of a ringed one."""
    kind = m.picture >> 3
    rings = kind == Kind.RINGED_PLANET
    planets = things.where(among(kind, Kind.PLANETS) & (np.arange(RECORDS) > 0))
    return {
        "RingedPlanet": _ringed(m, things).where((m.on_planet == 0) & rings),
        "BluePlanet": planets.where(m.picture < Picture.RED_PLANET),
        "RedPlanet": planets.where(m.picture >= Picture.RED_PLANET),
        "Crater": things.where((m.on_planet == 1) & rings & (things.y >= GROUND_TOP)),
    }


def _displays(m: Ram) -> dict[str, Box]:
    """The displays."""
    panel = m.is_over == 0
    columns = m.fuel >> 3
    fuel = panel & (m.fuel > 0)
    return {
        "Score": SCORE.box(10 * m.score, valid=m.announces == 0),
        "Lives": LIVES.box(m.lives - 1, panel, value=m.lives),
        "Fuel": box(BAR_LEFT, 192, EMPTY_BAR + columns, 5, fuel, value=columns),
        **scanned(m, panel),
    }


def _records_shown(m: Ram) -> Box:
    """What flies about, by record."""
    above = m.y - (LINE - TOP)
    cut = jnp.where(
        above > 0, MOST_ROWS + jnp.minimum(above, MOST_ROWS), jnp.clip(m.y - 2, 0, MOST_ROWS)
    )
    code = jnp.minimum(m.picture, Picture.END - 1)
    packed = lookup(TABLE, ((m.on_planet * Picture.END + code) * CUTS) + cut)
    darts = (m.picture >= Picture.DARTER) & (m.picture < Picture.DARTER + 4) & (m.on_planet == 0)
    x = m.x + (packed & 127) - 32 + when(darts & (np.arange(RECORDS) == 0), DARTER_SHIFT)
    y = LINE - m.y + (packed >> 7 & 31)
    there = (m.picture < Picture.END) & (m.y < HIGHEST) & _flies(m) & (m.is_over == 0)
    boxes = box(
        x,
        y,
        packed >> 12 & 63,
        packed >> 18 & 31,
        there & ~_is_new(m) & (packed > 0),
        color=packed >> 22 & 0xFE,
    )
    return boxes.clip(*sight.VIEW)


def _flies(m: Ram) -> jax.Array:
    """Whether the screen shows space or a planet."""
    return (m.jumps == 0) & (m.on_chart == 0)


def _is_new(m: Ram) -> jax.Array:
    """Whether a record has been filled since the frame was drawn, and has no size yet."""
    step = m.depth >> 1 + m.on_planet
    sizes = lookup(SIZES_BY_DEPTH, jnp.minimum(step, len(SIZES_BY_DEPTH) - 1))
    size, kind = m.picture & 7, m.picture >> 3
    red = m.picture >= Picture.RED_PLANET
    planet_size = m.picture - jnp.where(red, Picture.RED_PLANET, Picture.PLANET)
    in_space = m.on_planet == 0
    sized = among(kind, (Kind.KILLER, Kind.RINGED_PLANET)) | ((kind == Kind.PIRATE) & in_space)
    return match(
        (among(kind, Kind.PLANETS), planet_size != sizes >> 4),
        (sized, size != (sizes & 7)),
        (kind == Kind.WARP, (size == 4) & (step >= 16) & in_space),
        (kind == Kind.ENEMY_MISSILE, size < 2),
        otherwise=(size == 0) & (kind != Kind.EXPLOSION) & (step >= 9),
    )


def _ringed(m: Ram, things: Box) -> Box:
    """Rings, with the planet that the ship's sprite shows inside one of them."""
    body = things[0]
    same = body.valid & (m.x == m.x[0]) & among(m.picture[0] >> 3, Kind.PLANETS)
    x, y = jnp.minimum(things.x, body.x), jnp.minimum(things.y, body.y)
    right = jnp.maximum(things.x + things.w, body.x + body.w)
    bottom = jnp.maximum(things.y + things.h, body.y + body.h)
    whole = box(x, y, right - x, bottom - y, things.valid, color=things.color)
    return jax.tree.map(lambda a, b: jnp.where(same, a, b), whole, things)


def _ship_box(m: Ram) -> Box:
    """The ship, which the sprite of shots shows, too, on other lines."""
    picture = m.ship_picture + m.ship_y & 255
    look = match((picture == ShipPicture.TILTED, 0), (picture == ShipPicture.WIDE, 1), otherwise=2)
    there = (m.ship_y > 0) & (m.ship_picture != MADE_WITHOUT_SHIP) & (m.departs == 0) & _flies(m)
    x = sprite_column(m.ship_at) - when(look == 1, 1)
    color = jnp.where(m.on_planet == 1, 0x28, 0x78)
    return box(x, LINE + 1 - m.ship_y, pick(look, (11, 9, 9)), 9, there, color=color)


def _shot_boxes(m: Ram) -> Box:
    """The whole pictures of the shots; of the random dots, RAM has lost the seed."""
    picture = m.shot_picture + m.shot_y & 255
    shape = lookup(SHOT_SHAPES, picture)
    there = (m.shot_depth < 128) & (shape > 0) & _flies(m)
    x = sprite_column(m.shot_at) + (shape & 7)
    return box(x, LINE - m.shot_y, shape >> 3 & 15, shape >> 7, there)


def _packed_shots() -> np.ndarray:
    """First column, width and height of pictures, by the low byte of their address."""
    out = np.zeros(256, np.int64)
    for low in SHOT_PICTURES:
        rows = []
        while ROM.data[SHOT_PAGE + low - 2 - len(rows)]:
            rows.append(int(ROM.data[SHOT_PAGE + low - 2 - len(rows)]))
        ink = int(np.bitwise_or.reduce(rows))
        left, end = 8 - ink.bit_length(), 8 - ((ink & -ink).bit_length() - 1)
        out[low] = left | end - left << 3 | len(rows) << 7
    return out


SHOT_SHAPES = _packed_shots()


def _symbol_sizes() -> list[tuple[int, ...]]:
    """Boxes of the chart's symbols in their cells."""
    out = []
    for symbol in range(16):
        rows = ROM.bytes(SYMBOL_PICTURES + 8 * symbol, 8)[::-1]
        dots = (rows[:, None] >> np.arange(7, -1, -1) & 1).astype(bool)
        y, c = np.flatnonzero(dots.any(1)), np.flatnonzero(dots.any(0))
        inside = (c[0], y[0], np.ptp(c) + 1, np.ptp(y) + 1) if len(y) else (0,) * 4
        out.append(tuple(int(v) for v in inside))
    return out


SYMBOL_INK = BoxTable(_symbol_sizes())


def _symbol_boxes(m: Ram) -> Box:
    """The symbols of six sectors a row."""
    bytes_down = m.sectors[::-1]
    symbols = jnp.stack([bytes_down >> 4, bytes_down & 15], axis=-1).reshape(-1)
    return SYMBOL_INK.at(
        symbols,
        x=CELL_X,
        y=CELL_Y,
        valid=(symbols > 0) & _shows_chart(m),
        value=symbols,
        color=lookup(CHART_COLORS, m.quadrant),
    )


def _jump_timer(m: Ram) -> Box:
    """The time left, in the colour of the quadrant."""
    color = lookup(JUMP_COLORS, m.quadrant)
    return JUMP.box(m.jump_timer, valid=_shows_chart(m), color=color)


def _shows_chart(m: Ram) -> jax.Array:
    return (m.on_chart == 1) & (m.frame != CHART_OPENS)


LIVES = IconRow(left=24, top=192, width=3, height=5, pitch=-4)
FUEL_RULE = Bounds(0x1A, (BAR_LEFT, 192, 156, 197), value=Gauge(1, EMPTY_BAR, 0))
DISTANCE = Bounds(
    0xB8,
    (LEFT_CELL, 181, RIGHT_CELL + 8, 188),
    value=Digits(FONT, (LEFT_CELL, RIGHT_CELL), 181),
)
JUMP_RULE = replace(JUMP.rule(tuple(sorted(set(JUMP_COLORS)))), filters=(ON_CHART,))
SYMBOL_COLORS = tuple(sorted(set(CHART_COLORS.tolist())))
SYMBOL_CELLS = Cells(
    SYMBOL_COLORS, tuple(CELL_X.tolist()), tuple(CELL_Y.tolist()), 8, 8, whole=False
)
CHART_SYMBOL = Category(
    "ChartSymbol",
    SYMBOL_CELLS,
    count=48,
    attributes=("value",),
    doc="what is in the chart's sectors, by symbol",
    needs=("JumpTimer",),
)
SHOT_DOC = "two shots, nearer and farther; random dots of them are left out"

five = functools.partial(Category, count=RECORDS)
hud = functools.partial(display, attributes=())
GAME = Game(
    name="Solaris",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            sight.SHIP,
            otherwise=sight.GROUND_SHIP,
            color_row=SHIP_COLOR_ROW,
            doc="the ship, without its flames",
        ),
        Category("PlayerMissile", sight.SHOTS, count=2, blinks=True, doc=SHOT_DOC),
        five("Fighter", sight.FIGHTERS, doc="Zylon fighters, in space and on planets"),
        five("Pirate", sight.PIRATES, doc="pirate ships, in space and on planets"),
        five("Warp", sight.WARPS, doc="what a picture of its own shows in space"),
        five("Darter", sight.DARTERS, doc="small red things that come at the ship"),
        five("HyperJumper", sight.JUMPERS, doc="saucers in three colours"),
        five("PlanetKiller", sight.KILLERS, doc="the largest enemies in space, pale blue"),
        five("Blockader", sight.BLOCKADERS, doc="upright enemies that turn, green and blue"),
        five("Raider", sight.RAIDERS, doc="what flies over planets"),
        five("Man", sight.MEN, doc="what moves over the ground, with arms and legs"),
        five("LandingZone", sight.ZONES, doc="the pink field on planets"),
        five("Tower", sight.TOWERS, doc="violet things on planets"),
        five("EnemyMissile", sight.ENEMY_SHOTS, doc="shots of the enemies"),
        five("Explosion", sight.EXPLOSIONS, doc="what is left of what the ship hit"),
        five("RingedPlanet", sight.RINGS, doc="rings, with the planet inside"),
        five(
            "BluePlanet",
            sight.BLUE_PLANETS,
            color_row=BLUE_COLOR_ROW,
            doc="blue planets, from afar and near",
        ),
        five("RedPlanet", sight.RED_PLANETS, doc="red planets, from afar and near"),
        five("Crater", sight.CRATERS, doc="craters of planets"),
        CHART_SYMBOL,
        Category("JumpTimer", JUMP_RULE, attributes=("value",), doc="time left to choose a sector"),
        display("Score", SCORE.rule(0x1E), doc="points"),
        display(
            "Lives", LIVES.rule(0x8E, (12, 192, 28, 197), single=2), doc="ships, this one included"
        ),
        display("Fuel", FUEL_RULE, doc="fuel, in columns of its bar"),
        hud("Scanner", sight.SCANNER, doc="its window; the colour tells the target's kind"),
        hud("ScannerTarget", sight.TARGET, doc="what the scanner shows"),
        hud(
            "ScannerArrow",
            sight.ARROWS,
            count=2,
            doc="left: to a side or a cross; right: up or down",
        ),
        display("Distance", DISTANCE, doc="of the scanner's target"),
    ),
)
