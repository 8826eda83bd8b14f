"""Gravitar: a ship visits planets of a solar system, destroys their bunkers and takes their fuel.

Picture: docs/games/Gravitar.png

Screen: the map of the system, planets with bunkers, a saucer's attack in empty space, and a reactor
with a core at its end. Terrain is scenery, and so are the black marks at the left edge, which the
chip makes when it moves sprites. Lives and fuel alternate on the second line.

Slots: planets, bunkers and tanks have the program's seven rows of the screen. Explosion has these
rows, and an eighth slot for the former saucer. Shots have the program's records; an enemy's shot is
valid once it has left its shooter's box.

RAM: ALE's source (score, lives) and the ROM's code. The game moves the ship and its shots after the
vertical sync (f316), before the drawing, so the RAM agrees with the screen. It moves all other
objects after the drawing (from f124). It draws the enemy's shots alternately, and also the ship's
shots, and a saucer and the reactor on the map. It sets up a new screen after the drawing, too: then
the RAM keeps only the ship of the old screen. The ship's flame, its shield and its beam replace its
picture on some frames; the RAM has them on those frames only.

Covered: the first system with its planets in play, attacks, lost lives, the end of the game, all
modes. RAM was edited for the two systems after reactors, with their planets and reactors.

Not exact: on the frame on which the ship is hit or a screen begins, the ship's picture may be
mirrored, and objects of the old screen are not valid. An enemy's shot that has just hit is not
valid either. Shots are a row off at the end of a row of the screen, and so is a saucer that begins
to fly.

VEM: it misses the ship's shots on frames with the flame, which is no object, and enemies' shots
that touch an object.
"""

import functools
import operator
from dataclasses import dataclass, replace

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
    Game,
    Gauge,
    NumberDisplay,
    Shape,
    Static,
    Variants,
    among,
    box,
    display,
    div,
    lookup,
    match,
    only,
    palette,
    position,
    when,
)
from ocjax.extractors.gravitar.drawn import (
    OBJECT_PICTURES,
    OBJECT_ROWS,
    SAUCER_COLOR,
    Drawn,
    as_drawn,
    enemy_shots_drawn,
    ship_shots_drawn,
)
from ocjax.extractors.gravitar.lone import Lone
from ocjax.extractors.gravitar.ram import ROM, Ground, Ram, Sky

FIRST_TURN = 2  # first loop iteration of the positioning with the beam on the screen
PLACE_X = 34  # positions of rows less columns
PLACING = 4  # lines of the loop that place the object of the next row
SHOT_BEAM = 68  # column of the beam when a shot of the ship is switched on
ENEMY_BEAM = 104  # the same for an enemy's shot

HEADING_PICTURES = ROM.bytes(0x1D51, 16).tolist()  # pictures of the ship by heading
FLAMES = range(0x5A, 0x67)
BEAM = 0x67
EXPLODES = 0x77  # also the following pictures before the shield
SHIELD = 0xBD
SHIP_HEIGHTS = [10] * BEAM + [17] * (EXPLODES - BEAM) + [15] * (256 - EXPLODES)
SHIP = ROM.pictures(range(0xD00, 0xE00), SHIP_HEIGHTS, top_first=True)
HEADINGS = 16
PICTURE_STEP = 10  # bytes per heading's picture

FONT = ROM.font(0x1F55, rows=7)
SCORE = NumberDisplay(FONT, right=103, top=5, digits=6)
FUEL = NumberDisplay(FONT, right=103, top=17, digits=6)
TIMER = NumberDisplay(FONT, right=103, top=30, digits=2)
LIVES_AREA = (55, 17, 103, 24)
MOST_ICONS = 6
ICON = 8  # columns
NO_DIGIT = (0x9B, 0xA2)  # of `last_digit`: a blank, and an icon of the lives
TIMER_STEP = 60  # frames
PLAY = (0, 25, 160, 200)
SUN_AREA = (40, 55, 130, 97)  # of all systems

LIGHT_BLUE = 170
PINK = 78
ORANGE = 60
LIME = 202
BROWN = 36
RED = 54
GREEN = 198
PURPLE = 118
WHITE = 254
GLOW = (RED, 38, 26, 198, 202, 204)  # of explosions on planets
RINGS = (156, 10)
PLANETS = (122, 216, 92, 188, 62, 172, 88, 70, 126, 152, 234)
ANY = tuple(range(2, 256, 2))
GROUNDS = (44, 134, 74, 168, 90, 124, 186, 232, 26, 56, 230)
CORE = Static(92, 123, 8, 4, tuple(c for c in ANY if c not in GROUNDS))  # of the reactor
SHOT_COLORS = tuple(c for c in ANY if c not in (LIGHT_BLUE, PINK))


def decode(m: Ram) -> dict[str, Box]:
    drawn = as_drawn(m)
    objects = _object_boxes(m, drawn)
    rows = objects[:OBJECT_ROWS]
    saucer = jnp.where(drawn.shown.planet, Ground.SAUCER, Sky.SAUCER)
    return {
        "Player": _player(m, drawn),
        "Player_Shot": _ship_shot_boxes(m, drawn),
        "Shield": _around(m, drawn, SHIELD),
        "Tractor_Beam": _around(m, drawn, BEAM),
        "Enemy_Shot": _enemy_shot_boxes(m, drawn, objects),
        "Saucer": objects[OBJECT_ROWS].where(drawn.saucer.picture == saucer),
        **_map_boxes(m, drawn, rows),
        **_planet_boxes(m, drawn, rows),
        "Explosion": _explosion_boxes(m, drawn, objects),
        "Core": CORE.box(drawn.shown.reactor),
        "Score": SCORE.box(m.score, valid=drawn.shown.on, color=m.clock & 0xFE),
        "Fuel": FUEL.box(m.fuel, valid=drawn.shown.on & ~_lives_shown(m, drawn)),
        "Lives": _lives(m, drawn),
        "Timer": _timer_box(m, drawn),
    }


def _map_boxes(m: Ram, drawn: Drawn, rows: Box) -> dict[str, Box]:
    """The objects of the rows on the map."""
    pictures = drawn.pictures
    sky = drawn.shown.is_map
    ring = sky & (pictures == Sky.RING)
    return {
        "Planet": rows.where(sky & among(pictures, Sky.PLANETS)),
        "Sun": _one(rows, sky & (pictures == Sky.SUN), (m.clock - 1) & 0xFE),
        "Reactor": _one(rows, sky & (pictures == Sky.REACTOR), BROWN),
        "Ring": _one(rows, ring, only(ring, m.color) & 0xFE),
    }


def _planet_boxes(m: Ram, drawn: Drawn, rows: Box) -> dict[str, Box]:
    """The objects of the rows on a planet; a saucer replaces the first one."""
    ground = drawn.shown.planet & ((np.arange(OBJECT_ROWS) > 0) | (m.saucer == 0))
    return {
        "Bunker": rows.where(ground & among(drawn.pictures, Ground.BUNKERS)),
        "Fuel_Tank": rows.where(ground & among(drawn.pictures, Ground.TANKS)),
    }


def _is_hidden(m: Ram) -> jax.Array:
    """True if a flame, the beam or the shield replaces the ship."""
    picture = m.drawn_picture
    return among(picture, range(FLAMES.start, EXPLODES)) | (picture >= SHIELD)


def _player(m: Ram, drawn: Drawn) -> Box:
    """The ship; while another picture replaces it, the box is the ship's usual one."""
    picture = m.drawn_picture
    hidden = _is_hidden(m)
    turned = lookup(HEADING_PICTURES, m.heading & (HEADINGS - 1))
    hit = (m.heading >= HEADINGS) & (picture < FLAMES.start)
    heading = jnp.where(hit, div(picture, PICTURE_STEP), when(m.heading < HEADINGS, m.heading))
    return SHIP.box(
        jnp.where(hidden, turned, picture),
        jnp.where(hidden, m.x, m.drawn_x),
        jnp.where(hidden, m.y, m.drawn_y) + drawn.shown.top,
        mirrored=(m.heading > HEADINGS // 2) & ~hit,
        orientation=heading,
        valid=drawn.shown.on,
    )


def _around(m: Ram, drawn: Drawn, picture: int) -> Box:
    """The shield or the beam, which replaces the ship's picture."""
    mirrored = m.heading > HEADINGS // 2
    shown = SHIP.box(m.drawn_picture, m.drawn_x, m.drawn_y + drawn.shown.top, mirrored=mirrored)
    return shown.where(m.drawn_picture == picture)


def _ship_shot_boxes(m: Ram, drawn: Drawn) -> Box:
    """The ship's shots, which have the colour of the picture in its place."""
    shots = ship_shots_drawn(m, drawn.shown)
    y = shots.row + drawn.shown.top + when(shots.x < SHOT_BEAM, 1)
    color = jnp.where(shots.now & _is_hidden(m), PINK, LIGHT_BLUE)
    return box(shots.x, y, 1, 2, shots.there & ~drawn.shown.fresh, color=color)


def _enemy_shot_boxes(m: Ram, drawn: Drawn, objects: Box) -> Box:
    shots = enemy_shots_drawn(m, drawn.shown)
    y = shots.row + drawn.shown.top + when(shots.x < ENEMY_BEAM, 1)
    inside = (_is_in_object(objects, i, shots.x, y) for i in range(OBJECT_ROWS + 1))
    there = shots.there & ~functools.reduce(operator.or_, inside)
    return box(shots.x, y, 1, 2, there, color=_zone_color(m, shots.row))


def _is_in_object(objects: Box, i: int, x: jax.Array, y: jax.Array) -> jax.Array:
    """True if shots at x and y touch an object."""
    across = (x >= objects.x[i]) & (x < objects.x[i] + objects.w[i])
    down = (y >= objects.y[i] - 1) & (y < objects.y[i] + objects.h[i])
    return across & down & objects.valid[i]


def _zone_color(m: Ram, line: jax.Array) -> jax.Array:
    """The colour on a line: the colour of the last row with a begun zone."""
    zones = zip(m.zone_end, m.color[1:], strict=False)
    begun = [(line > end + PLACING, color) for end, color in zones]
    return match(*reversed(begun), otherwise=m.color[0]) & 0xFE


def _object_boxes(m: Ram, drawn: Drawn) -> Box:
    """The objects of the rows, then the saucer; pictures on planets have two rows per line."""
    on_map = jnp.where(drawn.pictures == Sky.REACTOR, m.reactor_place, m.place)
    place = jnp.where(drawn.shown.is_map, on_map, m.place)
    coarse = jnp.maximum(place & 15, FIRST_TURN)
    x = jnp.append(position(coarse, place >> 4) - PLACE_X, drawn.saucer.x)
    line = jnp.append(drawn.lines, drawn.saucer.line)
    color = jnp.append(m.color, drawn.saucer.color)
    picture = jnp.append(drawn.pictures, drawn.saucer.picture)
    index = OBJECT_PICTURES.index(planet=when(drawn.shown.planet, 1), picture=picture)
    there = drawn.shown.is_map | drawn.shown.attack | (drawn.shown.planet & (color > 0))
    return OBJECT_PICTURES.box(
        index,
        x,
        line + drawn.shown.top,
        mirrored=m.mirrored,
        valid=there,
        color=color & 0xFE,
    )


def _one(rows: Box, chosen: jax.Array, color: jax.Array | int) -> Box:
    """The chosen row."""
    return replace(rows.only(chosen), color=jnp.asarray(color))


def _explosion_boxes(m: Ram, drawn: Drawn, objects: Box) -> Box:
    """Exploding rows except the saucer's row, then the saucer."""
    picture = jnp.append(drawn.pictures, drawn.saucer.picture)
    ground = drawn.shown.planet & among(picture, Ground.EXPLOSIONS)
    sky = ~drawn.shown.planet & among(picture, Sky.EXPLOSIONS)
    slot = np.arange(OBJECT_ROWS + 1)
    rows = drawn.shown.is_map | (drawn.shown.planet & ((slot > 0) | (m.saucer == 0)))
    return objects.where((ground | sky) & ((slot == OBJECT_ROWS) | rows))


def _lives_shown(m: Ram, drawn: Drawn) -> jax.Array:
    """True if the second line shows the lives; the reactor's timer hides its content."""
    return jnp.where(drawn.shown.reactor, m.lives_time > 0, among(m.last_digit, NO_DIGIT))


def _lives(m: Ram, drawn: Drawn) -> Box:
    icons = jnp.minimum(m.spare_lives + when(drawn.shown.lost, 1), MOST_ICONS)
    _, top, right, bottom = LIVES_AREA
    width = ICON * icons
    there = drawn.shown.on & _lives_shown(m, drawn) & (icons > 0)
    return box(right - width, top, width, bottom - top, there, value=m.spare_lives + 1)


def _timer_box(m: Ram, drawn: Drawn) -> Box:
    shown = m.timer + when(m.timer_frames == TIMER_STEP, 1)
    return TIMER.box(shown, valid=drawn.shown.reactor, value=m.timer)


def _rgb(color: int) -> tuple[int, ...]:
    return tuple(palette.NTSC[color].tolist())


@dataclass(frozen=True)
class Crowded:
    """All pixels of a screen with more than `few` pixels; no pixels of other screens.

    Args:
        few: pixels.
    """

    few: int

    def __call__(self, mask: Bitmap, _: jax.Array) -> Bitmap:
        """The pixels that the filter keeps."""
        pixels = jnp.sum(jnp.bitwise_count(mask).astype(jnp.int32), axis=(0, 1))
        return jnp.where(pixels > self.few, mask, 0)


FLAME_AND_SHOT = 4  # pixels
SHOT = Shape(w=1, h=2)
SHORT = Shape(w=1, h=(1, 2))
PINK_SHOTS = Blobs(PINK, PLAY, SHOT, filters=(Crowded(FLAME_AND_SHOT),))
SHIP_SHOTS = Blobs(LIGHT_BLUE, PLAY, SHORT, gap=(2, 1), also=(PINK_SHOTS,))
SHIPS = Bounds(LIGHT_BLUE, PLAY, max_size=(10, 16), exclude=("Player_Shot",))
SHIELDS = Bounds(PINK, PLAY, (6, 7), (7, 9), exclude=("Player_Shot",))
BEAMS = Bounds(PINK, PLAY, (5, 10), (7, 10), exclude=("Player_Shot",))
# A single row is a shot in colours of no other object as small.
CUT_SHOTS = Blobs((RED, GREEN, PURPLE, WHITE), PLAY, Shape(w=1, h=1))
ALONE = Lone(heights=(2, 3), aside=3, rows=(PLAY[1], PLAY[3]))
ENEMY_SHOTS = Blobs(SHOT_COLORS, PLAY, Shape(w=1, h=(2, 3)), filters=(ALONE,), also=(CUT_SHOTS,))
SAUCERS = Blobs(BROWN, PLAY, Shape(w=8, h=7), also=(Blobs(SAUCER_COLOR, PLAY, Shape(w=7, h=6)),))
# A planet as large as the sun.
TALL = Blobs(172, PLAY, Shape(w=8, h=13), gap=(3, 3))
WORLDS = Blobs(PLANETS, PLAY, Shape(w=(6, 8), h=(6, 11)), gap=(2, 2), also=(TALL,))
SUNS = Blobs(ANY, SUN_AREA, Shape(w=8, h=13, pixels=50))
BASES = Blobs(BROWN, PLAY, Shape(w=7, h=13))
CIRCLES = Blobs(RINGS, PLAY, Shape(w=7, h=9), gap=(3, 3))
BUNKERS = Blobs((RED, GREEN), PLAY, Shape(w=8, h=6, pixels=32))
TANKS = Blobs(PURPLE, PLAY, Shape(w=4, h=(2, 6)))
BURSTS = Shape(w=5, h=7), Shape(w=8, h=12), Shape(w=8, h=14)
SKY_EXPLOSIONS = Blobs((BROWN, *PLANETS), PLAY, BURSTS, gap=(1, 1))
GLOWS = Shape(w=(2, 8), h=(2, 6), pixels=(4, 28))
EXPLOSIONS = Blobs(GLOW, PLAY, GLOWS, gap=(5, 2), also=(SKY_EXPLOSIONS,))
COUNTED = Gauge(ICON, ICON, base=2, full=MOST_ICONS * ICON)

GAME = Game(
    name="Gravitar",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        # On the frame on which the ship is hit, objects of the old screen are not valid.
        agreement={"last": 0.95, "lost": 0.96},
    ),
    variants=Variants(
        modes={
            0: "6 lives",
            1: "15 lives",
            2: "6 lives",
            3: "100 lives",
            4: "25 lives",
        },
        source="play of all modes in the emulator",
    ),
    categories=(
        Category(
            "Player",
            SHIPS,
            attributes=("orientation",),
            role="player",
            doc="the ship, or how it explodes",
        ),
        Category("Player_Shot", SHIP_SHOTS, count=2, doc="the ship's"),
        Category("Shield", SHIELDS, doc="around the ship"),
        Category("Tractor_Beam", BEAMS, doc="takes fuel"),
        Category("Enemy_Shot", ENEMY_SHOTS, count=2, doc="a saucer's or a bunker's"),
        Category("Saucer", SAUCERS, doc="attacks the ship"),
        Category("Planet", WORLDS, count=OBJECT_ROWS, doc="where a planet can be entered"),
        Category("Sun", SUNS, doc="destroys the ship"),
        Category("Reactor", BASES, rgb=_rgb(BROWN), doc="on the map, where it can be entered"),
        Category("Ring", CIRCLES, doc="where the ship starts"),
        Category("Bunker", BUNKERS, count=OBJECT_ROWS, doc="on a planet"),
        Category(
            "Fuel_Tank", TANKS, count=OBJECT_ROWS, rgb=_rgb(PURPLE), doc="also while it is taken"
        ),
        Category("Explosion", EXPLOSIONS, count=OBJECT_ROWS + 1, doc="of another object"),
        Category("Core", CORE.rule(), doc="of the reactor"),
        display("Score", SCORE.rule(ANY, required=True), role="score", doc="points"),
        display("Fuel", FUEL.rule(ORANGE, required=True), doc="that is left"),
        display(
            "Lives",
            Bounds(LIGHT_BLUE, LIVES_AREA, value=COUNTED),
            role="lives",
            doc="in turn with the fuel",
        ),
        display("Timer", TIMER.rule(LIME), role="time", doc="seconds in the reactor"),
    ),
)
