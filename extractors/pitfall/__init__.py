"""Pitfall!: Harry runs through 255 scenes of a jungle with pits, tar, logs, beasts and treasures.

Picture: docs/games/Pitfall.png

Screen: a scene has up to three objects of one kind on the ground. Below the ground it has a
scorpion, or a brick wall and a ladder. StairPit is the hole above the ladder; some scenes have a
Pit on either side of it. Tarpit and Waterhole open and close in some scenes. Holes are background,
so the game does not draw them as objects. Rope is its brown part, below the leaves, without columns
that trunks of its colour hide. PlayerScore has the value of the points won, 2,000 less than shown.
Platform is the ground of the jungle, and the floor below it; holes do not divide its box. Trees and
the maker's name are scenery. The screen saver puts the objects below the ground behind the left
edge.

Terrain: the trees, the ground with its holes (`holes`), the earth, the ladder, the wall and the
floor. Water, tar and other holes are where the ground is not drawn. The forks of the trunks are
sprites and no terrain.

RAM: ALE's source (score, lives), OCAtari 2.2 (meaning of the bytes), and the ROM's code. Everything
moves at F66D-FA72, before a scene is drawn at F0CE-F58E, except the first step into a hole and
Harry's new start; the sprite's position then still has his column. Harry's row of line 117 is drawn
after column 34, so left of it the row above is repeated.

Covered: all scenes, objects and treasures (by writing RAM), falls, ladders, ropes, deaths, the end.

Not exact: a box that has lost columns to the edge, the ground or another object keeps its rows.

VEM: it misses ropes that are mostly behind trunks or beside trunks behind Harry, and tar of two
rows.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from ocjax.authoring import (
    NTSC,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Digits,
    Game,
    Gauge,
    NumberDisplay,
    Pictures,
    Saver,
    Shape,
    ShortRuns,
    among,
    box,
    display,
    div,
    edges,
    extremes,
    match,
    pick,
    registers,
    when,
)
from ocjax.extractors.pitfall.ram import ROM, Ram, Saved, Scene, sprite_x
from ocjax.extractors.pitfall.terrain import BLACK, BLUE, BROWN, EARTH, RED, SILVERY, TERRAIN

FONT = ROM.font(0xF00, rows=8)
LEFTS = FONT.left.tolist()
RIGHTS = FONT.right.tolist()
SCORE = NumberDisplay(FONT, right=69, top=9, digits=6)

POSES = 9  # Harry's pictures
TALL = 22  # and their rows
NO_ROW = 24  # no row is repeated


def _harry_pictures() -> Pictures:
    """Harry's pictures, each with one row repeated in place of the next, and unchanged."""
    out = []
    for pose in range(POSES):
        rows = np.append(ROM.rows(0xB00 + TALL * pose, TALL), (0, 0))
        with_row = (np.arange(NO_ROW) == row for row in range(NO_ROW))
        out.extend(np.where(twice, np.roll(rows, 1), rows) for twice in with_row)
        out.append(rows)
    return Pictures.of(out)


HARRYS = _harry_pictures()
OBJECTS = Pictures.of([ROM.rows(0xD00 + low, 15) for low in range(0xF1)])
SCORPIONS = Pictures.of([ROM.rows(0xD90 + 16 * i, 16) for i in range(2)])
ROPES = ROM.bytes(0xCA1, 8).tolist()  # nonzero for a scene with a rope
THINGS = {  # objects on the ground: low bytes of their pictures
    "Logs": range(0, 32),
    "Fire": range(32, 64),
    "Snake": range(64, 96),
    "Crocodile": range(96, 128),
    "MoneyBag": range(128, 192),
    "SilverBar": range(192, 224),
    "GoldenBar": range(192, 224),
    "DiamondRing": range(224, 240),
}
THREE = ("Logs", "Crocodile")  # up to three in a scene

VIEW = (8, 0, 160, 210)
BAND_TOP = 72  # first line of Harry's band
EARLY_X = 97  # right of it, Harry's first row is drawn a line earlier
EARLY_ROW = 20  # the last row drawn earlier
LATE_X = 30  # left of it, a row of Harry is repeated
LATE_ROW = 45  # the repeated row, counted from the top of his band
GROUND = 53  # row hidden by the ground
BELOW_GROUND = 75  # the first row below the ground
BELOW_HOLE = 60  # the first row below the ground in scenes with a ladder
ROPE_TOP = 65
THINGS_TOP = 118  # of objects on the ground
ROPE_BOTTOM = 118
ROPE_X = 78  # column of its top
TRUNKS = (48, 56, 64, 68)  # left columns of the left one of the two middle trunks, by `trees`
START = 2000  # points of a new game
START_X = 20  # of Harry
CLOSED_ROW = 255  # value of a closed row of a hole


class Kind:  # of `Ram.kind`: bits with a meaning in some scenes
    METAL = 3  # bits: of a bar
    ROPE = 2  # a bit: over crocodiles


class Metal:  # of `Kind.METAL`
    SILVER = 1
    GOLD = 2


class Height:  # of `Ram.y`
    RUNS = 32
    STEPS_DOWN = 33
    SUNK = 54
    BELOW_AGAIN = 64  # at a new start
    FLOOR = 86
    ABOVE = 223  # at a new start; at least this: above his band


class Jump:  # of `Ram.jump`
    FALLS = 32


class Stick:  # of `Ram.stick`
    INTO_HOLE = 31  # `stick` during a fall into a hole


class Tally:  # of `Ram.tally`, and a bit of it
    ONE = 128
    TWO = 160


def decode(m: Ram) -> dict[str, Box]:
    hole = _hole_box(m)
    return {
        "Player": _harry_box(m),
        **_thing_boxes(m),
        "Scorpion": _scorpion(m),
        "Wall": box(sprite_x(m, 2) + when(m.turned, 1), 148, 7, 32, m.ladder != 0).clip(*VIEW),
        "Stair": box(78, 136, 4, 42, m.ladder != 0),
        "StairPit": box(76, 122, 8, 6, among(m.scene, (Scene.HOLE, Scene.HOLES))),
        "Pit": box(np.array((48, 100)), 122, 12, 6, m.scene == Scene.HOLES),
        "Tarpit": hole.where(among(m.scene, Scene.TAR)),
        "Waterhole": hole.where(among(m.scene, Scene.WATER)),
        "Rope": _rope_box(m),
        "Platform": box(8, np.array((117, 180)), 152, np.array((16, 6))),
        "LifeCount": _tally_box(m),
        "Timer": _timer(m),
        "PlayerScore": SCORE.box(m.score, value=m.score - START),
    }


def _hole_box(m: Ram) -> Box:
    """The open part of the tar or water."""
    rows = jnp.sum(m.holes != CLOSED_ROW)
    closed = 4 * lax.population_count(m.holes[0])
    return box(48 + closed, 125 - rows, 64 - 2 * closed, 2 * rows, rows > 0)


def _again(m: Ram) -> jax.Array:
    """True if Harry has just been moved to his new start, after the frame was drawn."""
    placed = among(m.y, (Height.ABOVE, Height.BELOW_AGAIN))
    return placed & (m.jump == Jump.FALLS) & (m.x == START_X)


def _tally_box(m: Ram) -> Box:
    """The marks for lives; the frame still shows the mark that a new start has just removed."""
    marks = jnp.where(_again(m), m.tally >> 2 | Tally.ONE, m.tally)
    lives = 1 + lax.population_count(m.tally)
    return box(21, 22, jnp.where(marks == Tally.TWO, 3, 1), 8, marks > 0, value=lives)


def _line_of_row(row: jax.Array) -> jax.Array:
    """The line of a row of Harry's band; the ground hides seven rows, and lines repeat below it."""
    return BAND_TOP + row + match((row > 62, 1), (row >= 60, 2), otherwise=0)


def _harry_box(m: Ram) -> Box:
    """Harry, without the rows that the ground hides."""
    x = sprite_x(m, 0)
    whole = _whole_harry(m, x)
    top_row = whole.y
    bottom_row = whole.y + whole.h - 1
    below = jnp.where(m.ladder == 0, BELOW_GROUND, BELOW_HOLE)
    first = jnp.maximum(jnp.where((top_row >= GROUND) & (top_row < below), below, top_row), 0)
    last = jnp.where((bottom_row >= GROUND) & (bottom_row < below), GROUND - 1, bottom_row)
    top = _line_of_row(first) - when((first <= EARLY_ROW) & (x > EARLY_X), 1)
    there = whole.valid & (last >= first)
    return box(whole.x, top, whole.w, _line_of_row(last) + 1 - top, there).clip(*VIEW)


def _whole_harry(m: Ram, x: jax.Array) -> Box:
    """Harry in rows of his band, ignoring the ground."""
    died = match(
        (m.y == Height.BELOW_AGAIN, Height.FLOOR),
        (m.scene <= Scene.HOLES, Height.RUNS),
        otherwise=Height.SUNK,
    )
    falls = (m.jump == Jump.FALLS) & (m.stick == Stick.INTO_HOLE)
    steps = (m.y == Height.STEPS_DOWN) & falls
    height = jnp.where(_again(m), died, m.y - when(steps, 1))
    y = jnp.where(height >= Height.ABOVE, height - 256, height) + m.sunk - 1
    repeats = (x < LATE_X) & (y < LATE_ROW) & (y > LATE_ROW - NO_ROW)
    repeated = jnp.where(repeats, LATE_ROW - y, NO_ROW)
    look = (NO_ROW + 1) * div(m.pose, TALL) + repeated
    return HARRYS.box(look, x, y, mirrored=m.mirrored)


def _thing_boxes(m: Ram) -> dict[str, Box]:
    """The objects on the ground."""
    copy = np.arange(3)
    x = registers.wrap(sprite_x(m, 1) + copy * registers.spacing(m.copies))
    there = copy < registers.copies(m.copies)
    shapes = OBJECTS.box(m.picture, x, THINGS_TOP, valid=there).clip(*VIEW)
    metal = m.kind & Kind.METAL
    of_metal = {"SilverBar": metal == Metal.SILVER, "GoldenBar": metal == Metal.GOLD}
    return {
        name: shapes[: 3 if name in THREE else 1].where(
            among(m.picture, pictures) & of_metal.get(name, True)
        )
        for name, pictures in THINGS.items()
    }


def _scorpion(m: Ram) -> Box:
    look = m.scorpion >> 4 & 1
    west = m.turned
    there = m.ladder == 0
    return SCORPIONS.box(1 - look, sprite_x(m, 2), 164, mirrored=west, valid=there).clip(*VIEW)


def _rope_box(m: Ram) -> Box:
    """The lines of the rope outside of trunks."""
    line = np.arange(ROPE_TOP, ROPE_BOTTOM)
    way = (line - 33) * m.slope >> 8
    x = ROPE_X + jnp.where(m.swing, way, -way)
    trunk = pick(m.trees, TRUNKS)
    free = ((x < trunk) | (x >= trunk + 4)) & ((x < 156 - trunk) | (x >= 160 - trunk))
    seen = free & (line <= 116 - m.rope)
    top, bottom = extremes(seen, line, line + 1)
    left, right = extremes(seen, x, x + 1)
    may_hang = (m.scene != Scene.CROCODILES) | ((m.kind & Kind.ROPE) != 0)
    there = (pick(m.scene, ROPES) > 0) & may_hang
    return edges(left, top, right, bottom, there & (bottom > top))


def _timer(m: Ram) -> Box:
    """The remaining time in seconds; tens of minutes are blank when they are 0."""
    tens = m.minutes // 10
    ones = m.minutes % 10
    left = jnp.where(tens > 0, 29 + pick(tens, LEFTS), 37 + pick(ones, LEFTS))
    right = 61 + pick(m.seconds % 10, RIGHTS)
    return box(left, 22, right - left, 8, value=60 * m.minutes + m.seconds)


HAIR = 18
FACE = 74
SHIRT = 200
LEGS = 210
WHITE = 12
SHINE = 14
GRAY = 4
GOLDEN = 30
GREEN = 208
HARRY = Bounds((HAIR, FACE, SHIRT, LEGS), (8, 66, 160, 181), exclude=("Logs", "MoneyBag"))
on_ground = functools.partial(Blobs, region=(8, 117, 160, 134), shapes=Shape(w=(5, 8), h=(8, 15)))
still = functools.partial(Bounds, regions=(113, 117, 142, 134), min_size=(5, 10))
LOG = on_ground(HAIR, gap=(1, 1), shapes=Shape(w=(1, 8), h=(6, 14)))
FIRE = Bounds((BROWN, 62, 46), (8, 117, 160, 134), min_size=(5, 8))
BAG = on_ground((HAIR, GRAY), gap=(2, 1), first=GRAY)
JAWS = Bounds(GREEN, tuple((x, 117, x + 8, 134) for x in (60, 76, 92)))
GOLDS = Bounds((SHINE, GOLDEN), (113, 117, 142, 134), min_size=(7, 10))
RING = on_ground((SHINE, GOLDEN), gap=(1, 1), shapes=Shape(w=(4, 6), h=(8, 15)))
BRICKS = Bounds((SILVERY, RED), (8, 148, 160, 180), min_size=(4, 8))
STAIR = Bounds(EARTH, (78, 136, 82, 178), min_size=(4, 20))
STAIR_PIT = Bounds(BLACK, (76, 122, 84, 128))
PITS = Bounds(BLACK, ((48, 122, 60, 128), (100, 122, 112, 128)))
SLIME = Blobs(BLACK, (48, 118, 112, 132), Shape(w=(30, 64), h=(3, 10)), gap=(8, 0))
cord = functools.partial(Blobs, BROWN, (44, 65, 116, 117), filters=(ShortRuns(44),), gap=(4, 25))
BESIDE = cord(gap=(0, 0), shapes=Shape(w=(3, 8), h=(16, 40), pixels=(16, 44)))  # a trunk: its lines
ROPE_SHAPES = Shape(w=(6, 33), h=(20, 41)), Shape(w=(1, 10), h=(41, 42))  # slanting, hanging down
ROPE = cord(shapes=ROPE_SHAPES, also=(BESIDE,))
FLOOR_COLORS = (24, EARTH)
FLOORS = Bounds(FLOOR_COLORS, ((8, 117, 160, 133), (8, 180, 160, 186)), min_size=(100, 6))
FLOOR_RGB = tuple(tuple(NTSC[color].tolist()) for color in FLOOR_COLORS)
CLOCK = Digits(FONT, (29, 37, 53, 61), 22, weights=(600, 60, 10, 1))
background = functools.partial(Category, rgb=(0, 0, 0), blinks=True)  # background, so never drawn
dark = functools.partial(Category, rgb=(74, 74, 74))


def _saver_key(m: Ram) -> jax.Array:
    return jnp.where(m.saver_mask == Saved.MASK, m.saver_key, -1)


GAME = Game(
    name="Pitfall",
    rom=ROM,
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (29, 193), 12, mask=Saved.MASK, taken=(12, 14, 24, 66)),
    terrain=TERRAIN,
    checks=Checks(
        rare=("DiamondRing", "Fire", "GoldenBar", "MoneyBag", "Pit", "SilverBar", "Snake"),
    ),
    categories=(
        Category("Player", HARRY, rgb=(92, 186, 92), role="player", doc="Harry"),
        Category("Logs", LOG, count=3, doc="rolling or lying"),
        Category("Fire", FIRE, rgb=(236, 200, 96), doc="a fire"),
        dark("Snake", still((BLACK, RED)), doc="a cobra"),
        Category("Crocodile", JAWS, count=3, doc="in the water"),
        dark("MoneyBag", BAG, doc="2,000 points"),
        Category("SilverBar", still((SHINE, SILVERY)), rgb=(111, 111, 111), doc="3,000 points"),
        Category("GoldenBar", GOLDS, rgb=(252, 252, 84), doc="4,000 points"),
        Category("DiamondRing", RING, rgb=(236, 236, 236), doc="5,000 points"),
        Category("Scorpion", Bounds(SHINE, (8, 164, 160, 181)), doc="below the ground"),
        Category("Wall", BRICKS, rgb=(167, 26, 26), doc="bricks below the ground"),
        Category("Stair", STAIR, doc="the ladder"),
        background("StairPit", STAIR_PIT, needs=("Stair",), doc="above the ladder"),
        background("Pit", PITS, count=2, needs=("Stair",), doc="left and right of it"),
        background("Tarpit", SLIME, doc="tar or quicksand"),
        Category("Waterhole", Bounds(BLUE, (48, 118, 112, 132)), doc="a pond"),
        Category("Rope", ROPE, doc="a liana"),
        background("Platform", FLOORS, count=2, rgb=FLOOR_RGB, doc="the ground, the floor below"),
        display(
            "LifeCount",
            Bounds(WHITE, (21, 22, 29, 30), value=Gauge(2, -1, 1)),
            role="lives",
            doc="lives",
        ),
        display(
            "Timer", Bounds(WHITE, (29, 22, 69, 30), value=CLOCK), role="time", doc="seconds left"
        ),
        display("PlayerScore", SCORE.rule(WHITE, base=-START), role="score", doc="points won"),
    ),
)
