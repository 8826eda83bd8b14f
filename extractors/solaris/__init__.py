"""Solaris: a ship that jumps from sector to sector, in space, on planets and over a chart.
"""

import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, BoxTable, Number, box
from ocjax.console.ops import among, lookup, match, pick, when
from ocjax.extraction.game import Category, Game, display
from ocjax.extractors.solaris.panel import (
    BANK_1,
    COLORS,
    FONT,
    LEFT_CELL,
    RIGHT_CELL,
    WINDOW,
    scanned,
)
from ocjax.extractors.solaris.pictures import BOTTOM, CUTS, ROWS, TABLE, TOP
from ocjax.extractors.solaris.ram import RECORDS, ROM, Kind, Picture, Ram
from ocjax.extractors.solaris.vision import IN_SPACE, ON_CHART, ON_PLANET, DarkEdges
from ocjax.vision.displays import IconRow, NumberDisplay
from ocjax.vision.filters import ShortRuns
from ocjax.vision.rules import Blobs, Bounds, Cells, Gauge
from ocjax.vision.shapes import Shape
from ocjax.vision.steps import Raised
from ocjax.console.fonts import Digits

SCORE = NumberDisplay(FONT, right=105, top=5, digits=6)
JUMP = NumberDisplay(FONT, right=105, top=152, digits=2, leading_zeros=True)
LINE = 170  # line + height above the panel, of a picture's first row
VIEW = (8, TOP, 160, BOTTOM)
HIGHEST = 0x99  # from here on, a record is above the view

# Sizes of pictures by half the depth: of all but planets in the low nibble, of planets in the high.
SIZES = ROM.bytes(0xDA2, 20)

SHIPS = BoxTable(((0, 171, 11, 9), (0, 171, 9, 9), (1, 171, 9, 9)))


def decode(m: Ram) -> dict[str, Box]:
    things = _things(m)
    kind = m.picture >> 3
    space, planet = m.on_planet == 0, m.on_planet == 1
    planets = things.where(among(kind, Kind.PLANETS) & (np.arange(RECORDS) > 0))
    panel = m.is_over == 0
    return {
        "Player": _ship_box(m),
        "PlayerMissile": _shot_boxes(m),
        "Fighter": things.where(kind == Kind.FIGHTER),
        "Pirate": things.where(kind == Kind.PIRATE),
        "Warp": things.where(space & (m.picture == 0x10)),
        "Darter": things.where(space & among(m.picture, range(0x14, 0x18))),
        "HyperJumper": things.where(space & (kind == Kind.JUMPER)),
        "PlanetKiller": things.where(space & (kind == Kind.KILLER)),
        "Blockader": things.where(space & (kind == Kind.BLOCKADER)),
        "Raider": things.where(planet & (kind == Kind.WARP)),
        "Man": things.where(planet & (kind == Kind.JUMPER)),
        "LandingZone": things.where(planet & (kind == Kind.KILLER)),
        "Tower": things.where(planet & (kind == Kind.BLOCKADER)),
        "EnemyMissile": things.where(kind == Kind.ENEMY_MISSILE),
        "Explosion": things.where(kind == Kind.EXPLOSION),
        "RingedPlanet": _ringed(m, things).where(space & (kind == Kind.RINGED_PLANET)),
        "BluePlanet": planets.where(m.picture < Picture.RED_PLANET),
        "RedPlanet": planets.where(m.picture >= Picture.RED_PLANET),
        "Crater": things.where(planet & (kind == Kind.RINGED_PLANET)),
        "ChartSymbol": _symbol_boxes(m),
        "JumpTimer": JUMP.box(m.jump_timer, valid=_shows_chart(m)),
        "Score": SCORE.box(10 * m.score),
        "Lives": LIVES.box(m.lives - 1, panel, value=m.lives),
        "Fuel": box(120, 192, 5 + (m.fuel >> 3), 5, panel & (m.fuel > 0), value=m.fuel >> 3),
        **{name: b.where(panel) for name, b in scanned(m).items()},
    }


def _things(m: Ram) -> Box:
    """What flies about, by record."""
    above = m.y - (LINE - TOP)
    cut = jnp.where(above > 0, ROWS + jnp.minimum(above, ROWS), jnp.clip(m.y - 2, 0, ROWS))
    code = jnp.minimum(m.picture, Picture.END - 1)
    packed = lookup(TABLE, ((m.on_planet * Picture.END + code) * CUTS) + cut)
    near = (m.picture >= Picture.DARTER) & (m.picture < Picture.DARTER + 4) & (m.on_planet == 0)
    x = m.x + (packed & 127) - 32 + when(near & (np.arange(RECORDS) == 0), 4)
    y = LINE - m.y + (packed >> 7 & 31)
    there = (m.picture < Picture.END) & (m.y < HIGHEST) & (m.jumps == 0) & (m.on_chart == 0)
    boxes = box(
        x,
        y,
        packed >> 12 & 63,
        packed >> 18 & 31,
        there & ~_is_new(m) & (packed > 0),
        color=packed >> 22 & 0xFE,
    )
    return boxes.clip(*VIEW)


def _is_new(m: Ram) -> jax.Array:
    """Whether a record has been filled since the frame was drawn, and has no size yet."""
    step = m.depth >> 1 + m.on_planet
    sizes = lookup(SIZES, jnp.minimum(step, len(SIZES) - 1))
    size, kind = m.picture & 7, m.picture >> 3
    planet_size = m.picture - jnp.where(m.picture < Picture.RED_PLANET, Picture.PLANET, Picture.RED_PLANET)
    sized = among(kind, (Kind.KILLER, Kind.RINGED_PLANET)) | ((kind == Kind.PIRATE) & (m.on_planet == 0))
    return match(
        (among(kind, Kind.PLANETS), planet_size != sizes >> 4),
        (sized, size != (sizes & 7)),
        (kind == Kind.WARP, (size == 4) & (step >= 16) & (m.on_planet == 0)),
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


def _column(code: jax.Array) -> jax.Array:
    """Column of the ship's sprite, by a code whose move counts twice."""
    fine = (code >> 4 ^ 8) - 8
    return 54 + 27 * (code >> 1 & 7) + 3 * (code & 1) - 2 * fine


def _ship_box(m: Ram) -> Box:
    picture = m.ship_picture + m.ship_y & 255
    look = match((picture == 0xD7, 0), (picture == 0xEB, 1), otherwise=2)
    there = (m.ship_y > 0) & (m.departs == 0) & (m.jumps == 0) & (m.on_chart == 0)
    x = _column(m.ship_at) - when(look == 1, 1)
    return box(x, LINE + 1 - m.ship_y, pick(look, (11, 9, 9)), 9, there)


SHOTS = (0x8E, 0x96, 0x9D, 0xA3, 0xA8, 0x99, 0xA6)  # low bytes of pictures
SHOT_BOXES = [
    (2, 7, 5),
    (2, 6, 5),
]


def _shot_boxes(m: Ram) -> Box:
    picture = m.shot_picture + m.shot_y & 255
    width = match((picture >= 0xA6, jnp.where(picture == 0xA6, 1, 3)), otherwise=0)
    shape = lookup(SHOT_SHAPES, picture)
    there = (m.shot_depth < 128) & (shape > 0) & (m.jumps == 0) & (m.on_chart == 0)
    x = _column(m.shot_at) + (shape & 7)
    return box(x, LINE - m.shot_y, shape >> 3 & 15, shape >> 7, there)


def _shot_shapes() -> np.ndarray:
    """First column, width and height of pictures, by the low byte of their address."""
    out = np.zeros(256, np.int64)
    for low in SHOTS:
        rows = []
        while ROM.data[0x2500 + low - 2 - len(rows)]:
            rows.append(int(ROM.data[0x2500 + low - 2 - len(rows)]))
        ink = int(np.bitwise_or.reduce(rows))
        left, end = 8 - ink.bit_length(), 8 - ((ink & -ink).bit_length() - 1)
        out[low] = left | end - left << 3 | len(rows) << 7
    return out


SHOT_SHAPES = _shot_shapes()

CELL_X = 36 + 16 * np.tile(np.arange(6), 8)
CELL_Y = 46 + 13 * np.repeat(np.arange(8), 6)


def _symbols() -> list[tuple[int, ...]]:
    out = []
    for symbol in range(16):
        rows = ROM.bytes(BANK_1 + 0x100 + 8 * symbol, 8)[::-1]
        dots = (rows[:, None] >> np.arange(7, -1, -1) & 1).astype(bool)
        y, c = np.flatnonzero(dots.any(1)), np.flatnonzero(dots.any(0))
        inside = (c[0], y[0], np.ptp(c) + 1, np.ptp(y) + 1) if len(y) else (0,) * 4
        out.append(tuple(int(v) for v in inside))
    return out


SYMBOLS = BoxTable(_symbols())
CHART_COLORS = ROM.bytes(0x37F0, 16) | 0x0E


def _symbol_boxes(m: Ram) -> Box:
    """The symbols of six sectors a row."""
    bytes_down = m.sectors[::-1]
    symbols = jnp.stack([bytes_down >> 4, bytes_down & 15], axis=-1).reshape(-1)
    color = lookup(CHART_COLORS, m.quadrant)
    return SYMBOLS.at(symbols, x=CELL_X, y=CELL_Y, valid=(symbols > 0) & _shows_chart(m), value=symbols, color=color)


def _shows_chart(m: Ram) -> jax.Array:
    return (m.on_chart == 1) & (m.frame != 64)


LIVES = IconRow(left=24, top=192, width=3, height=5, pitch=-4)

BLUES = (0x86, 0x88, 0x8A, 0x8C, 0x8E)
REDS = (0x40, 0x42, 0x44, 0x46, 0x48)
SHIP_COLORS = (0x92, 0x76, 0x78, 0x6A, 0x6C)
GROUND_SHIP_COLORS = (0x42, 0x34, 0x26, 0x28, 0x1A, 0x1C)
SHIP_ROWS = (8, 144, 160, 151)
SHIP = Bounds(SHIP_COLORS, SHIP_ROWS, (9, 7), (11, 7), then=(Raised(2),))
GROUND_SHIP = Bounds(GROUND_SHIP_COLORS, SHIP_ROWS, (9, 7), (11, 7), then=(Raised(2),))
space = functools.partial(Blobs, region=VIEW, filters=(IN_SPACE,))
ground = functools.partial(Blobs, region=VIEW, filters=(ON_PLANET,))
RED_SHAPES = (
    Shape(1, 1),
    Shape(2, 2),
    Shape(3, (2, 4), pixels=(6, 12)),
    Shape(4, (2, 5)),
    Shape(5, (2, 6), pixels=(8, 12)),
    Shape(5, (2, 6), pixels=(14, 30)),
    Shape((6, 16), (1, 24)),
)
RED_PLANETS = space(REDS, shapes=RED_SHAPES)
DOTS = space(0x8A, shapes=Shape(1, 1))
BLUE_SHAPES = (
    Shape(2, 2, pixels=4),
    Shape((3, 4), (2, 5), pixels=(6, 20)),
    Shape((5, 16), (2, 24), pixels=(10, 304)),
)
BLUE_PLANETS = space(BLUES, shapes=BLUE_SHAPES, also=(DOTS,), then=(DarkEdges(),))
DARTERS = space(REDS, shapes=(Shape(2, 1), Shape(5, 5, pixels=13), Shape(3, 3, pixels=5)))
KILLER_COLORS = (0xA4, 0xA6, 0xA8, 0xAA, 0xAC, 0xAE)
KILLER_SHAPES = (Shape(2, 1), Shape((4, 16), (2, 12)))
FIVE_ROWS = space(KILLER_COLORS, shapes=Shape(6, 5, pixels=18), first=0xAA)
KILLERS = space(
    KILLER_COLORS,
    shapes=KILLER_SHAPES,
    first=(0xA4, 0xA6, 0xA8, 0xAC, 0xAE),
    also=(FIVE_ROWS,),
)
PIRATES = space((0x14, 0x16, 0x18, 0x1A, 0x1E), shapes=Shape((1, 8), (1, 9)), gap=(2, 2))
RINGS = space((0x66, 0x68, 0xA2), shapes=Shape((2, 16), (2, 14)), gap=(1, 1))
SHOTS_RULE = Blobs((0x08, 0x0E), VIEW, Shape((1, 8), (1, 8)), gap=(3, 3))
ENEMY_SHOTS = Blobs((0x9E, 0x7E, 0x6E), VIEW, Shape((1, 5), (1, 7)), gap=(1, 1))
FLASHES = space(0x1E, shapes=tuple(Shape(w, h, p) for w, h, p in ((8, 10, 61), (5, 6, 24), (3, 4, 8))))
EXPLOSIONS = space((0x8E, 0xAA), shapes=Shape((6, 28), (9, 28)), gap=(7, 4), also=(FLASHES,))
FIGHTERS = space((0x56, 0x58, 0x5A, 0x5C, 0x5E), shapes=Shape((1, 8), (1, 12)))
CRATERS = Blobs((0x60, 0x00), (8, 82, 160, BOTTOM), Shape((6, 28), (1, 9)), filters=(ON_PLANET, ShortRuns(30, across=True)))
PANEL_COLORS = tuple(sorted(set(COLORS)))

five = functools.partial(Category, count=RECORDS)
GAME = Game(
    name="Solaris",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", SHIP, otherwise=GROUND_SHIP, rgb=(0,0,0), doc="the ship"),
        Category("PlayerMissile", SHOTS_RULE, count=2, doc="nearer, farther"),
        five("Fighter", FIGHTERS, doc="enemy"),
        five("Pirate", PIRATES, doc="enemy"),
        five("Warp", Blobs(0x10, VIEW), doc="enemy"),
        five("Darter", DARTERS, doc="enemy"),
        five("HyperJumper", Blobs(0x10, VIEW), doc="enemy"),
        five("PlanetKiller", KILLERS, doc="enemy"),
        five("Blockader", Blobs(0xCE, VIEW), doc="enemy"),
        five("Raider", Blobs(0x10, VIEW), doc="enemy"),
        five("Man", Blobs(0x10, VIEW), doc="enemy"),
        five("LandingZone", Blobs(0x10, VIEW), doc="enemy"),
        five("Tower", Blobs(0x10, VIEW), doc="enemy"),
        five("EnemyMissile", ENEMY_SHOTS, doc="enemy"),
        five("Explosion", EXPLOSIONS, doc="enemy"),
        five("RingedPlanet", RINGS, doc="enemy"),
        five("BluePlanet", BLUE_PLANETS, doc="b"),
        five("RedPlanet", RED_PLANETS, doc="b"),
        five("Crater", CRATERS, doc="enemy"),
        Category("ChartSymbol", Cells(tuple(sorted(set(CHART_COLORS.tolist()))), tuple(CELL_X.tolist()), tuple(CELL_Y.tolist()), 8, 8, whole=False), count=48, attributes=("value",), doc="s", needs=("JumpTimer",)),
        Category("JumpTimer", replace(JUMP.rule(tuple(sorted({int(c - 14 + 200) & 254 for c in CHART_COLORS}))), filters=(ON_CHART,)), attributes=("value",), doc="s"),
        display("Score", SCORE.rule(0x1E), doc="points"),
        display("Lives", LIVES.rule(0x8E, (12, 192, 28, 197), single=2), doc="ships"),
        display("Fuel", Bounds(0x1A, (120, 192, 156, 197), value=Gauge(1, 5, 0)), doc="fuel"),
        display("Scanner", Bounds(PANEL_COLORS, WINDOW, min_size=(40, 15)), attributes=(), doc="its window"),
        display("ScannerTarget", Bounds(0x0E, WINDOW), attributes=(), doc="what the scanner shows"),
        display("ScannerArrow", Bounds(0xB8, ((LEFT_CELL, 173, LEFT_CELL + 8, 180), (RIGHT_CELL, 173, RIGHT_CELL + 8, 180))), count=2, attributes=(), doc="a"),
        display("Distance", Bounds(0xB8, (LEFT_CELL, 181, RIGHT_CELL + 8, 188), value=Digits(FONT, (LEFT_CELL, RIGHT_CELL), 181)), doc="digits"),
    ),
)
