"""Zaxxon: a plane flies over fortresses, through the openings of their walls, and through space.

Picture: docs/games/Zaxxon.png

Screen: fortresses are drawn in perspective, with rows half as high in the distance. Space is black
and has only fighters. The floor, its edges and explosions are scenery. An enemy's own shadow is no
part of it. While the plane explodes, the picture flashes, and nothing is in play. Altitude is the
bar at the left, in the colors of the ground beside it; space has no bar.

Slots: a thing on the ground keeps its slot, although the game moves it from record to record as it
comes nearer.

RAM: ALE's source (score, lives), OCAtari (meaning of some bytes), and the ROM's code. The game
moves the ground after it draws it; everything else is drawn as the RAM has it. An iteration of the
drawing loop with too much work takes three lines instead of two, and everything below it moves
down.

Covered: all modes, fortresses, space, Zaxxon and barriers (by writing RAM), lost lives, the end.

Not exact: on the last frame of a shot's flash on a wall, everything below is off by a line or two.
A thing that a shot has just hit leaves the RAM a frame before it leaves the screen. REM takes the
last rows of space for a fortress.

VEM: it misses things of the same color that touch, the shadow if only a part of it falls on the
ground, the plane behind its shot's flash, and barriers in three of four frames. It reads Life on
two of its possible lines, and takes parts of Zaxxon behind its missile for other things. It takes
the last frame of the plane's explosion for the flash of a shot.
"""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Bitmap,
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
    Shape,
    ShortRuns,
    among,
    bitmaps,
    box,
    display,
    div,
    edges,
    extremes,
    materialize,
    packed_position,
    palette,
    when,
)
from ocjax.extractors.zaxxon.drawn import (
    COUNTS_ABOVE,
    FAR_TURNS,
    FIRST_COUNT,
    FLASH_FRAMES,
    SHADOW_BEGINS,
    Drawn,
    Late,
    as_drawn,
    end_line,
    first_line,
    ground_edges,
    ground_end,
    line,
    shot_lines,
)
from ocjax.extractors.zaxxon.ground import (
    EMPTY,
    GROUND_LEFT,
    barrier_box,
    lefts_of,
    wall_box,
)
from ocjax.extractors.zaxxon.ram import ROM, Kind, Picture, Ram, Shot
from ocjax.extractors.zaxxon.things import (
    SECOND_BANK,
    by_slot,
    fighters,
    is_any,
    missile_color,
    thing_boxes,
)

FONT = ROM.font(0xF08, rows=8)
POINTS = NumberDisplay(FONT, right=99, top=10, digits=6, leading_zeros=True)
LIVES_LEFT = 51
FUEL_LEFT = 59
FUEL_ROWS = 7
DISPLAY_GAP = 5  # lines from the loop's end to the display below it
PLANE_X = 9  # minus the position of a register
SHOT_X = 7
MISSILE_LATE = Late(55, 28, 1)
SHOT_LATE = Late(88, 61, 34)
SHOT_CENTER = 74
SHOT_HEIGHT = 138  # plus the shot's height, minus its y: the visible part of its x
SPACE_HEIGHT = 16  # of all shots in space
GROUNDED_TOP = 185  # top of the bar at the least altitude; it may be one line lower
GROUNDED = 10  # the least altitude
GROUND_RIGHT = 144
FIELD_END = 200  # below everything except the display

BLACK = 0
PLANE_COLOR = 56
SCORE_COLOR = 54
YELLOW = 22
WALL_COLOR = 36
BARRIER_COLOR = 246
GREEN = (214, 216)
RED = 68
TOWER_COLORS = (102, 86, 70, 54)
ORANGE = 52
MISSILE_COLORS = (42, *TOWER_COLORS, 22, 52, 214, 216)
FIGHTER_COLORS = (246, 230, 198, 182, 196, 178, 184, 214, YELLOW)  # the first seven are at its top
ZAXXON_COLOR = 230
HIT_COLOR = 54
ZAXXON_COLORS = (22, 228, ZAXXON_COLOR, 38, 52, HIT_COLOR)
GROUND_COLORS = (36, 82, 146, 162, 210, 246)

PLANE_ROWS = 8
SPACE_PLANE = 5  # index of the picture in space
PLANE_PICTURES = ROM.pictures(
    [
        *range(0xF00 + Picture.LEVEL, 0xF00 + Picture.LAST + 1, PLANE_ROWS),
        SECOND_BANK + 0xF00 + Picture.LEVEL,
    ],
    PLANE_ROWS,
    top_first=True,
)
HOMING_PICTURE = ROM.pictures([0xFE0], PLANE_ROWS, top_first=True)
DIGIT_EXTENTS = Pictures.of(np.array(FONT.glyphs))


def decode(m: Ram) -> dict[str, Box]:
    d = as_drawn(m)
    flies = _is_flying(m, d)
    objects = thing_boxes(m, d).where(flies)
    return {
        "Player": _plane_box(m, d).where(flies),
        "Player_Shot": _shot_boxes(m, d).where(flies),
        "Player_Shadow": _shadow_box(m, d).where(flies),
        "Hostile_Fighter": objects.where(fighters(m, d)),
        "Hostile_Orange": _orange_boxes(m, d, objects),
        "Tower": objects.where(is_any(m, d, Kind.TOWER)),
        "Fuel_Tank": objects.where(is_any(m, d, Kind.FUEL_TANK)),
        "Sentry": objects.where(is_any(m, d, Kind.SENTRY)),
        "Satellite": objects.where(is_any(m, d, Kind.SATELLITE)),
        "Zaxxon": _zaxxon_box(m, d, objects),
        "Zaxxon_Missile": _homing_box(m, d).where(flies),
        "Hostile_Shot": _missile_box(m, d).where(flies),
        "Wall": wall_box(m, d).where(flies),
        "Barrier": barrier_box(m, d).where(flies),
        "Score": POINTS.box(100 * m.score),
        "Life": _lives_box(m, d),
        "Fuel": box(FUEL_LEFT, _display_top(m, d), m.fuel, FUEL_ROWS, m.fuel > 0, value=m.fuel),
        "Altitude": _altitude_box(m, d).where(flies),
    }


def _is_flying(m: Ram, d: Drawn) -> jax.Array:
    in_fortress = among(m.picture, range(Picture.LEVEL, Picture.LAST + 1))
    return jnp.where(d.space, m.picture_in_space == Picture.LEVEL, in_fortress)


def _orange_boxes(m: Ram, d: Drawn, objects: Box) -> Box:
    color = jnp.where(by_slot(d, m.kind) == Kind.BRIGHT_MISSILE, PLANE_COLOR, ORANGE)
    missiles = objects.where(is_any(m, d, Kind.MISSILE, Kind.BRIGHT_MISSILE))
    return dataclasses.replace(missiles, color=color)


def _zaxxon_box(m: Ram, d: Drawn, objects: Box) -> Box:
    color = jnp.where(jnp.any(m.kind == Kind.ZAXXON_HIT), HIT_COLOR, ZAXXON_COLOR)
    chosen = is_any(m, d, Kind.ZAXXON, Kind.ZAXXON_HIT)
    return dataclasses.replace(objects.only(chosen), color=color)


def _homing_box(m: Ram, d: Drawn) -> Box:
    """Zaxxon's own missile."""
    counted = FIRST_COUNT - m.homing_y
    turn = counted - when(counted > d.step + FAR_TURNS - 1, 1)
    x = packed_position(m.drawn_code) + PLANE_X
    left, first, width, rows = HOMING_PICTURE.extent(jnp.int32(0))
    boxes = box(x + 2 * left, line(m, d, turn) + 1 + 2 * first, 2 * width, 2 * rows)
    launched = (m.homing_y != Shot.NONE) & ~d.space
    return boxes.where(launched).clip(0, first_line(m, d), 160, FIELD_END)


def _plane_picture(m: Ram, d: Drawn) -> jax.Array:
    return jnp.where(d.space, SPACE_PLANE, div(m.picture - Picture.LEVEL, PLANE_ROWS))


def _plane_box(m: Ram, d: Drawn) -> Box:
    code = jnp.where(d.space, m.drawn_code, m.plane_code)
    top = line(m, d, FIRST_COUNT - 1 - m.altitude) + 1
    left, first, width, rows = PLANE_PICTURES.extent(_plane_picture(m, d))
    return box(packed_position(code) + PLANE_X + 2 * left, top + 2 * first, 2 * width, 2 * rows)


def _shadow_box(m: Ram, d: Drawn) -> Box:
    """The part of the shadow that falls on the ground."""
    left, first, width, rows = PLANE_PICTURES.extent(_plane_picture(m, d))
    begins = jnp.maximum(SHADOW_BEGINS + first, d.shadow_turn + 1)
    ends = SHADOW_BEGINS + first + rows
    top = line(m, d, begins) + 1
    bottom = line(m, d, ends) + 1
    tops, bottoms = ground_edges(m, d)
    under = (lefts_of(d.shapes) < EMPTY) & (tops < bottom) & (bottoms > top)
    highest, lowest = extremes(under, tops, bottoms)
    x = packed_position(m.plane_code) + PLANE_X + 2 * left
    shadow = edges(x, jnp.maximum(top, highest), x + 2 * width, jnp.minimum(bottom, lowest))
    seen = d.shadow & (highest < lowest) & (shadow.h > 0)
    return shadow.where(seen).clip(GROUND_LEFT, 0, GROUND_RIGHT, FIELD_END)


def _shot_boxes(m: Ram, d: Drawn) -> Box:
    """Two shots, drawn on alternate frames."""
    in_order = (m.clock & 1) == 1

    def by_shot(values: jax.Array) -> jax.Array:
        return jnp.where(in_order, values, values[::-1])

    just_hit = (jnp.arange(2) == 0) & (m.flash_time == FLASH_FRAMES)
    y = by_shot(jnp.where(just_hit, m.flash_y, m.shot_y))
    height = jnp.where(d.space, SPACE_HEIGHT, by_shot(m.shot_height))
    # A shot flies towards the middle of the horizon.
    aside = by_shot(m.shot_x) + 14 - 128
    visible_256ths = (SHOT_HEIGHT - y + height) & 0xFF
    part = (jnp.abs(aside) * visible_256ths) >> 8
    left = SHOT_CENTER + jnp.where(aside < 0, -part, part)
    tops, bottoms = shot_lines(m, d, y, left, SHOT_LATE)
    boxes = edges(left, tops, left + 1, bottoms, y != Shot.NONE)
    return boxes.clip(0, first_line(m, d) - 1, 160, end_line(m, d))


def _missile_box(m: Ram, d: Drawn) -> Box:
    x = packed_position(m.missile_code) + SHOT_X
    top, bottom = shot_lines(m, d, m.missile_y, x, MISSILE_LATE)
    end = end_line(m, d)
    shot = edges(x, top, x + 1, bottom, m.missile_y != Shot.NONE, color=missile_color(m, d))
    return shot.clip(0, first_line(m, d) - 1, 160, end)


def _display_top(m: Ram, d: Drawn) -> jax.Array:
    return end_line(m, d) + DISPLAY_GAP


def _lives_box(m: Ram, d: Drawn) -> Box:
    return DIGIT_EXTENTS.box(m.lives, LIVES_LEFT, _display_top(m, d), value=m.lives)


def _altitude_box(m: Ram, d: Drawn) -> Box:
    top = line(m, d, COUNTS_ABOVE - 1 - m.altitude) + 1
    bottom = ground_end(m, d)
    color = jnp.where((d.step & 3) == 0, d.colors[0], d.colors[1]) & 0xFE
    return edges(8, top, 12, bottom, ~d.space, value=m.altitude - GROUNDED, color=color)


TOWER_RGB = tuple(palette.NTSC[102].tolist())
FIGHTER_RGB = tuple(palette.NTSC[230].tolist())
TANK_RGB = tuple(palette.NTSC[214].tolist())


def _wide(mask: Bitmap, _: jax.Array) -> Bitmap:
    """The pixels with a neighbor in their row; pixels of shots have none."""
    return mask & (bitmaps.shift_left(mask, 1) | bitmaps.shift_right(mask, 1))


def _tall(mask: Bitmap, planes: jax.Array) -> Bitmap:
    """The pixels of posts; a fighter has at most two rows of their color."""
    return mask & ~ShortRuns(2)(mask, planes)


def _short_black(mask: Bitmap, planes: jax.Array) -> Bitmap:
    """Black runs of at most the shadow's width, only in the rows of the shadow."""
    _, top, _, bottom = SHADOW_FIELD
    rows = materialize(lambda p: bitmaps.color_mask(p[:, :, top:bottom], (BLACK,)), planes)
    runs = ShortRuns(14, across=True)(rows, planes)
    return jnp.pad(runs, ((0, 0), (top, mask.shape[1] - bottom), (0, 0)))


def _in_flight(mask: Bitmap, planes: jax.Array) -> Bitmap:
    """The pixels of frames with the plane, or the flash of its shot, which hides it for a moment.

    Both have one color. The background, otherwise black, flashes while the plane explodes.
    """
    x, y = BACKGROUND
    behind = planes[:, x // 32, y] >> (31 - x % 32) & 1
    _, top, _, bottom = FIELD
    bright = materialize(lambda p: bitmaps.color_mask(p[:, :, top:bottom], (PLANE_COLOR,)), planes)
    there = bitmaps.any_of(bitmaps.or_rows(bright)) != 0
    return jnp.where(there & ~behind.any(axis=0), mask, 0)


BACKGROUND = (13, 150)  # a pixel of it, beside the bar of the altitude
FIELD = (16, 24, 160, 194)
SHADOW_FIELD = (16, 172, 144, 194)
SHORT = ShortRuns(1, across=True)  # pixels without a neighbor in their row
THING = Shape(w=(2, 16), h=(1, 34))
FIGHTER_SHAPES = (Shape(w=(4, 8), h=(1, 5)), Shape(w=16, h=(8, 12)))
# Edges cut tanks and guns off; fighters and Zaxxon have their colors, too.
TANK_SHAPES = (
    Shape(w=6, h=1),
    Shape(w=(6, 8), h=(3, 12)),
    Shape(w=12, h=(1, 2)),
    Shape(w=16, h=(3, 26)),
)
SENTRY_SHAPES = (
    Shape(w=8, h=(1, 11)),
    Shape(w=4, h=2),
    Shape(w=6, h=1),
    Shape(w=12, h=(9, 11)),
    Shape(w=(14, 16), h=(12, 24)),
)
ZAXXON_SHAPES = (Shape(w=8, h=(13, 14)), Shape(w=16, h=(28, 30)))
FAR_BRIGHT = Shape(w=5, h=(1, 10))
NEAR_BRIGHT = Shape(w=10, h=(1, 20))
SHOT_SHAPE = Shape(w=1, h=(3, 12))
in_field = functools.partial(Blobs, region=FIELD, shapes=THING)
# The plane and near things of its color share a mask; the plane is one component of it.
in_plane_color = functools.partial(
    Blobs, PLANE_COLOR, (8, 24, 160, 194), gap=(0, 2), filters=(_wide,)
)
PLANE_RULE = in_plane_color(shapes=Shape(w=14, h=(8, 16)))
SHADOW_RULE = Blobs(
    BLACK, SHADOW_FIELD, Shape(w=14, h=(2, 16)), gap=(0, 2), filters=(_short_black,)
)
SHOT_RULE = Blobs(PLANE_COLOR, (0, 24, 160, 194), SHOT_SHAPE, filters=(SHORT,))
HOMING_RULE = in_plane_color(shapes=Shape(w=8, h=(6, 16)))
FAR_RULE = Blobs(PLANE_COLOR, (16, 24, 160, 82), FAR_BRIGHT)
ORANGE_RULE = in_field(ORANGE, also=(FAR_RULE, in_plane_color(shapes=NEAR_BRIGHT)))
BARRIER_RULE = Bounds(BARRIER_COLOR, (16, 24, 144, 194), min_size=(16, 4), filters=(_tall,))
LIVES_AREA = (LIVES_LEFT, 194, FUEL_LEFT, 208)
LIVES_RULE = Bounds(YELLOW, LIVES_AREA, value=Digits(FONT, (LIVES_LEFT,), 196, required=True))
LIVES_RAISED = Bounds(YELLOW, LIVES_AREA, value=Digits(FONT, (LIVES_LEFT,), 195))
FUEL_RULE = Bounds(YELLOW, (FUEL_LEFT, 194, 99, 208), value=Gauge(1))
BAR = Gauge(-2, start=GROUNDED_TOP + 1, side="y")
ALTITUDE_RULE = Bounds(GROUND_COLORS, (8, 110, 12, 196), value=BAR)
WALL_RULE = Bounds(WALL_COLOR, (16, 24, 144, 196), filters=(_in_flight,))

# A shot's flash on a wall hides the plane.
in_play = functools.partial(Category, needs=("Player", "Wall"))

GAME = Game(
    name="Zaxxon",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        known={"Life": 0.85},  # on one of five lines; VEM reads two
        rare=("Wall",),  # behind the flash of a shot
    ),
    categories=(
        Category("Player", PLANE_RULE, role="player", doc="the plane"),
        in_play("Player_Shot", SHOT_RULE, 2, doc="the plane's shots, drawn by turns"),
        in_play("Player_Shadow", SHADOW_RULE, doc="the plane's shadow on the ground"),
        in_play(
            "Hostile_Fighter",
            in_field(FIGHTER_COLORS, first=FIGHTER_COLORS[:7], shapes=FIGHTER_SHAPES),
            7,
            rgb=FIGHTER_RGB,
            doc="planes, standing in fortresses and flying in space",
        ),
        in_play("Hostile_Orange", ORANGE_RULE, 7, doc="missiles that follow the plane"),
        in_play("Tower", in_field(TOWER_COLORS), 7, rgb=TOWER_RGB, doc="towers"),
        in_play(
            "Fuel_Tank",
            in_field(GREEN, shapes=TANK_SHAPES),
            7,
            rgb=TANK_RGB,
            doc="tanks that give fuel when they are shot",
        ),
        in_play("Sentry", in_field(YELLOW, shapes=SENTRY_SHAPES), 7, doc="guns"),
        in_play("Satellite", in_field(RED), 7, doc="radar dishes"),
        in_play(
            "Zaxxon",
            in_field(ZAXXON_COLORS, shapes=ZAXXON_SHAPES),
            color_row=12,
            doc="the robot behind the fortresses",
        ),
        in_play("Zaxxon_Missile", HOMING_RULE, doc="the robot's missile"),
        in_play(
            "Hostile_Shot",
            in_field(MISSILE_COLORS, shapes=SHOT_SHAPE, filters=(SHORT,)),
            color_row=4,
            doc="an enemy's shot",
        ),
        Category("Wall", WALL_RULE, doc="a wall, with its openings"),
        in_play("Barrier", BARRIER_RULE, blinks=True, doc="electric posts, which change places"),
        display("Score", POINTS.rule(SCORE_COLOR), role="score", doc="points"),
        display(
            "Life",
            LIVES_RULE,
            otherwise=LIVES_RAISED,
            role="lives",
            doc="planes left, with this one",
        ),
        display("Fuel", FUEL_RULE, doc="fuel, 40 when it is full"),
        display(
            "Altitude",
            ALTITUDE_RULE,
            needs=("Player", "Wall"),
            color_row=-1,
            doc="the plane's height above the lowest that it can fly",
        ),
    ),
)
