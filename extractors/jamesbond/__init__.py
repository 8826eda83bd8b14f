"""James Bond 007: a vehicle in the desert, on the sea and under it, in missions of several stages.

Picture: docs/games/Jamesbond.png

Screen: smoke, stars, hills and names are scenery. Titles show a score. Oil_Rig is valid while a
flash lights it; otherwise it has the sky's colour. A Lab that was hit leaves a Capsule. A missile
above the sea leaves an Explosion, which is deadly, too. Life has one box around its icons. At an
edge, a hole's box has its larger part.

Slots: Missile and Bomb have the object in the air and its copy, then the same in the sea. Rocket
has the one in the air, then the one in the sea.

RAM: ALE's source (score, lives), OCAtari 2.2 (the first mission's bytes), and the ROM's code: the
drawing at $F000 of pages 4-7, and the steps at $F652, which come after the drawing and are undone.
Every other frame shows the beam in place of the objects in the air; both have their last drawn
positions.

Covered: both modes, lost vehicles, game over; all 30 stages by RAM writes (random play: the first
one).

Not exact: noise above the hole. Objects that are hit or leave are gone a frame early, except
explosions.

VEM: it misses black parts of the rig, most flashes of a lost vehicle, depth charges behind hills or
before their own colour, and shots in a hornet's box. It cannot read Life when the maximum of three
icons is shown.
"""

import functools
from dataclasses import dataclass, replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Game,
    Gauge,
    KindEntry,
    Kinds,
    NumberDisplay,
    Shades,
    Shape,
    among,
    box,
    choose,
    display,
    match,
    pick,
    when,
)
from ocjax.extractors.jamesbond.lanes import (
    AIR,
    GRAPHICS,
    JUST_DIED,
    NONE,
    SEA,
    SKY_SLOT,
    beamed,
    column,
    drawn_kinds,
    have_stepped,
    lane_boxes,
)
from ocjax.extractors.jamesbond.ram import ROM, Flags, Kind, MoreFlags, Ram, Status, Way

FONT = ROM.font(GRAPHICS | 0x800, rows=7)
SCORE = NumberDisplay(FONT, right=102, top=15, digits=6)
MOST_ICONS = 3  # most icons for lives in reserve

FIELD = (8, 57, 160, 179)
SKY_AREA = (8, 57, 160, 72)
LOW = (8, 99, 160, 121)
SHOT_AREA = (8, 74, 160, 156)
BOMBED = (8, 57, 160, 168)  # down to the bed of the first sea

NIGHTS = 4  # the first mission at night
FIRST_SLOW = 35  # `enemy_shot_y` of a slow shot before it is drawn
FIRST_FAST = (22, 23)  # of a fast one
SHOT_WIDTH = 1
LATE_X = 22  # left of this column, enemies' shots begin a row later
LIT = 119  # `rig_colors` while the rig is visible
ORANGE = 58  # of the vehicle
SURFACE_ROW = 123  # surface for falling objects
ENEMY_SURFACE = 122
# Lines of the kernel near which a shot is longer, shorter or late.
SHOT_ROWS = 4
LAST_IN_AIR = 116  # a shot from this row on ends at the surface
UNLIT_IN_AIR = 120  # from this row down to the surface, the kernel shows no shot
DIVE_ROWS = 3  # above the surface; a shot that begins there continues below it
BED = SEA[3]  # between two kernels

PIT = np.unpackbits(ROM.rows(GRAPHICS | 0xB8F, 17).astype(np.uint8)[:, None], axis=1)
DEPTHS = [6 + 3 * int(np.flatnonzero(dots)[-1]) for dots in PIT.T.repeat(2, 0)]
# Depth in lines, by visible columns, at the left and the right edge.
DEPTH_LEFT = np.maximum.accumulate([0, *DEPTHS]).tolist()
DEPTH_RIGHT = np.maximum.accumulate([0, *DEPTHS[::-1]]).tolist()
AIMS = range(77, 103)  # `object_x` of a helicopter with a beam, and two columns more


def _beams() -> np.ndarray:
    """Left edge relative to `object_x`, and width, of the beam for each of `AIMS`."""
    dots = [f"{row:08b}" for row in ROM.bytes(GRAPHICS | 0x7A5, 8)[::-1]]
    slopes = [7 - ((x >> 4) + (x & 15)) % 15 for x in AIMS]  # columns to the left per line
    shift = -1 - np.outer(slopes, np.arange(1, 9))
    left = (shift + [row.index("1") for row in dots]).min(axis=1)
    right = (shift + [row.rindex("1") for row in dots]).max(axis=1)
    return np.stack([left, right + 1 - left])


BEAM_LEFT, BEAM_WIDTH = _beams().tolist()


def decode(m: Ram) -> dict[str, Box]:
    boxes = {
        "Player": box(column(m.x), m.y + 50, 8, 4, color=_vehicle_color(m)).clip(*FIELD),
        "Player_Shot": _player_shot(m),
        "Depth_Charge": _depth_charge(m),
        "Enemy_Shot": _enemy_shot(m),
        "Laser": _beam(m),
        "Fire_Hole": _hole_box(m),
        "Lab": _lab(m),
        "Score": SCORE.box(m.score),
        "Life": _lives(m),
        **_object_boxes(m),
    }
    hidden = {name: Status.TITLE | (Status.OVER if name == "Score" else 0) for name in boxes}
    return {name: b.where((m.status & hidden[name]) != Status.TITLE) for name, b in boxes.items()}


def _object_boxes(m: Ram) -> dict[str, Box]:
    kinds = drawn_kinds(m)
    drawn = lane_boxes(m, kinds)
    boxes = {
        thing.category.name: drawn[thing.slots].where(among(kinds[thing.slots], thing.values))
        for thing in THINGS.entries
    }
    return boxes | {"Oil_Rig": boxes["Oil_Rig"].where(m.rig_colors == LIT)}


def _dies(m: Ram) -> jax.Array:
    return (m.flags & Flags.DIES) != 0


def _vehicle_color(m: Ram) -> jax.Array:
    lost = _dies(m) & (m.pause != JUST_DIED)
    return jnp.where(lost, m.flash & ~1, ORANGE)


def _lives(m: Ram) -> Box:
    width = 16 * jnp.minimum(m.lives, MOST_ICONS) - 8
    y = 184 + jnp.minimum(m.mission, 1)
    return box(9, y, width, 4, m.lives > 0, value=m.lives + 1)


def _player_shot(m: Ram) -> Box:
    return replace(_shot_box(m, m.shot_x, m.shot_y, SURFACE_ROW), color=_vehicle_color(m))


def _depth_charge(m: Ram) -> Box:
    """The charge; at night, sky and sea bed have its colour."""
    falling = _shot_box(m, m.bomb_x - 3, m.bomb_y, SURFACE_ROW).clip(*BOMBED)
    shown = falling.clip(*SEA)
    return choose((m.mission >= NIGHTS) & shown.valid, shown, falling)


def _shot_box(m: Ram, x: jax.Array, y: jax.Array, surface: int) -> Box:
    """A shot, which begins on every other line; borders of the kernel make it longer or shorter."""
    sky_end = _end_of_sky(m)
    begins = y + 55
    usual_top = begins + _shot_lag(begins, sky_end, surface)
    at_sky_end = among(sky_end - usual_top, (1, 3))
    usual_bottom = match(
        (begins >= BED - 2, begins + SHOT_ROWS + 1),
        (begins == BED - 4, BED - 1),
        otherwise=usual_top + SHOT_ROWS,
    )
    dives = among(usual_top, range(surface - DIVE_ROWS, surface))
    bottom = match(
        (dives, surface + 2),
        (among(usual_top, range(LAST_IN_AIR, surface)), surface),
        otherwise=usual_bottom + when(at_sky_end, 1),
    )
    top = jnp.where(dives & (usual_top >= UNLIT_IN_AIR), surface, usual_top)
    return box(x - 11, top, SHOT_WIDTH, bottom - top, y < NONE).clip(*FIELD)


def _end_of_sky(m: Ram) -> jax.Array:
    """The last row of the kernel that draws the sky."""
    height = m.height[SKY_SLOT]
    object_rows = when(height < NONE, height + 1)
    return AIR[1] + object_rows + when(beamed(m), 9)


def _shot_lag(begins: jax.Array, sky_end: jax.Array, surface: int) -> jax.Array:
    """Rows that the drawing of a shot lags behind."""
    above_sea = when(begins < AIR[3], sky_end - AIR[1])
    every_other_line = (begins + surface + above_sea) & 1
    return match(
        (begins == BED, -1),
        (begins <= sky_end, 0),
        (begins >= BED + 3, 1),
        otherwise=every_other_line,
    )


def _enemy_shot(m: Ram) -> Box:
    """The enemies' shot before its last step; it is valid from its first drawn frame."""
    y = m.enemy_shot_y
    flies = ~_dies(m)
    dx, dy = _enemy_step(m.shot_way)
    before = _shot_box(m, m.enemy_shot_x - when(flies, dx), y - when(flies, dy), ENEMY_SURFACE)
    late = when(before.x < LATE_X, 1)
    is_slow = (m.shot_way & Way.SLOW_Y) != 0
    at_first = jnp.where(is_slow, y == FIRST_SLOW, among(y, FIRST_FAST))
    is_new = at_first & (m.shot_way > 0) & flies
    shot = box(before.x, before.y + late, SHOT_WIDTH, before.h, before.valid & (y < NONE) & ~is_new)
    bottom = jnp.where(m.mission > 0, SEA[3], AIR[3] - 1)  # it vanishes in the ground
    return shot.clip(8, 57, 160, bottom)


def _enemy_step(way: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Columns and rows that the enemies' shot moves in a step."""
    across = jnp.where((way & Way.SLOW_X) != 0, 1, 2)
    down = jnp.where((way & Way.SLOW_Y) != 0, 1, 2)
    to_right = when((way & Way.RIGHT) != 0, 1) - when((way & Way.LEFT) != 0, 1)
    to_bottom = when((way & Way.DOWN) != 0, 1) - when((way & Way.UP) != 0, 1)
    return across * to_right, down * to_bottom


def _beam(m: Ram) -> Box:
    """The last drawn beam: on this frame, or on the one before the ground moved."""
    helicopter_x = m.object_x[SKY_SLOT]
    is_helicopter = m.kind[SKY_SLOT] == Kind.HELICOPTER
    ground_moves = ((m.flags & Flags.ODD) == 0) & ((m.clock & 3) == 0)
    moved = have_stepped(m, m.kind)[SKY_SLOT]
    x = helicopter_x + when(ground_moves, 1) + when(moved, 1)
    begins = moved & (helicopter_x == AIMS[-3])  # on the next frame
    shines = ((m.more_flags & MoreFlags.BEAM) != 0) & ~_dies(m) & is_helicopter
    left = x + pick(x - AIMS[0], BEAM_LEFT)
    width = pick(x - AIMS[0], BEAM_WIDTH)
    return box(left, 64, width, 8, shines & ~begins).clip(*FIELD)


def _hole_box(m: Ram) -> Box:
    """The hole. It wraps around; at an edge, the box has the larger part of it in columns 8-159."""
    left = column(m.ground_x) + 1
    x = jnp.where(left > 156, left - 160, left)
    first = jnp.clip(8 - x, 0, 16)
    last = jnp.clip(160 - x, 0, 16)
    depth = jnp.minimum(pick(last, DEPTH_LEFT), pick(16 - first, DEPTH_RIGHT))
    apart = (m.ground_x >= 9) & (m.ground_x < 15)  # the flames are two columns beside the hole
    return box(x, 122, jnp.where(apart, 18, 16), depth, m.mission == 0).clip(8, 122, 160, 170)


def _lab(m: Ram) -> Box:
    """The two halves of the lab; the right one may be at the other edge."""
    first = column(m.lab_x) + 3
    last = column(m.ground_x) + 17
    left = jnp.where(first > 148, first - 160, first)
    right = jnp.where(last < left, 160, last)
    there = ((m.more_flags & MoreFlags.LAB) != 0) & (m.mission > 0)
    return box(left, 156, right - left, 23, there).clip(*FIELD)


TAKEN = (  # colours of other objects
    *(0, 2, 4, 6, 8, 10, 16, 18, 20, 24, 36, 52, 130, 132, 136, 148, 152),
    *(192, 194, 196, 240, 244, 246, 254),
)
PLAYER = tuple(c for c in range(0, 256, 2) if c not in TAKEN)  # a lost vehicle flashes in all
VEHICLE = Blobs(PLAYER, FIELD, Shape(w=(4, 8), h=4, pixels=(9, 17)))
UPWARD = Blobs(PLAYER, FIELD, Shape(w=1, h=(3, 6)))
charge_in = functools.partial(Blobs, (0, 196))
LOW_CHARGE = charge_in((8, 121, 160, 168), shapes=Shape(w=1, h=(2, 7)))
CHARGE = charge_in(BOMBED, shapes=Shape(w=1, h=(4, 7)), also=(LOW_CHARGE,))
DIM = Bounds((8, 148), (8, 75, 160, 91), (1, 3), exclude=("Hornet",))  # next to a hornet
NIGHT = Shades((130, 121), (132, 196, 146), ((196,), (1,), (1,)))  # the sea has the charge's colour
blob = functools.partial(Blobs, gap=(1, 1))
HOLE = blob((240, 52), (8, 122, 160, 170), gap=(2, 6), shapes=Shape(w=(4, 20), h=(8, 48)))
FLYER = blob((8, 148, 52), (8, 75, 160, 89), gap=(3, 4), first=8, shapes=Shape(w=(1, 8), h=(5, 16)))
ROCKET_COLORS = (10, 6, 152, 156, 24, 68)
ROCKET_SHAPES = Shape(w=(7, 8), h=(9, 16)), Shape(w=(2, 8), h=(4, 8))  # in the air, in the sea
ROCKETS = blob(ROCKET_COLORS, FIELD, shapes=ROCKET_SHAPES, first=10)
SPARKS = Blobs((68, 106), (8, 115, 160, 121), Shape(w=(5, 8), h=(3, 6)), gap=(5, 2))
BURST = Blobs((194, 24), SEA, Shape(w=(10, 32), h=(5, 16)), gap=(7, 4))
MISSILES = blob((6, 52, 26), FIELD, shapes=Shape(w=(3, 8), h=(5, 16)), first=6)
HELI = Bounds((14, 70, 66, 20), SKY_AREA)


@dataclass(frozen=True)
class Thing(KindEntry):
    """A kind of object in the lanes, with the slots of the lanes that may hold it."""

    slots: slice | int = SKY_SLOT


def _of_lanes(
    kind: int, slots: slice | int, name: str, rule: Blobs | Bounds, doc: str, **options: Any
) -> Thing:
    count = len(range(5)[slots]) if isinstance(slots, slice) else 1
    return Thing(Category(name, rule, count=count, doc=doc, **options), (kind,), slots)


# Slots: two in the air, two in the sea, one in the sky.
AIR_SLOT = 0
SEA_SLOT = 2
AIR_SLOTS = slice(2)
LOWER_SLOTS = slice(4)
BOTH_FIRST = slice(0, 3, 2)
THINGS = Kinds(
    _of_lanes(Kind.ICE, SKY_SLOT, "Ice", Bounds((148, 8, 152), SKY_AREA, (1, 10)), "a diamond"),
    _of_lanes(
        Kind.SATELLITE, SKY_SLOT, "Satellite", Bounds((90, 86, 82), SKY_AREA, (1, 8)), "in the sky"
    ),
    _of_lanes(Kind.HELICOPTER, SKY_SLOT, "Helicopter", HELI, "in the sky", rgb=(167, 26, 26)),
    _of_lanes(Kind.HORNET, AIR_SLOT, "Hornet", FLYER, "in the air"),
    _of_lanes(
        Kind.OIL_RIG, AIR_SLOT, "Oil_Rig", Bounds((34, 202), LOW, (1, 8)), "a goal: to be landed on"
    ),
    _of_lanes(Kind.SHIP, AIR_SLOT, "Ship", Bounds((10, 24, 66), LOW, (9, 8)), "without its smoke"),
    _of_lanes(
        Kind.DIVER, SEA_SLOT, "Diver", Bounds((194, 24, 148), (8, 131, 160, 152), (1, 18)), "swims"
    ),
    _of_lanes(
        Kind.SUBMARINE,
        SEA_SLOT,
        "Submarine",
        Bounds((8, 114, 24), (8, 136, 160, 149), (9, 8)),
        "dives",
    ),
    _of_lanes(
        Kind.TORPEDO,
        SEA_SLOT,
        "Torpedo",
        Bounds((24,), (8, 121, 160, 131), (1, 5)),
        "at the surface",
    ),
    _of_lanes(Kind.ERUPTION, SEA_SLOT, "Eruption", BURST, "of a bomb in the sea"),
    _of_lanes(
        Kind.CAPSULE,
        SEA_SLOT,
        "Capsule",
        Bounds((202, 200, 198), SEA, (1, 8)),
        "a goal: to be touched",
    ),
    _of_lanes(Kind.EXPLOSION, AIR_SLOTS, "Explosion", SPARKS, "above the sea; slots as Bomb's"),
    _of_lanes(Kind.BOMB, AIR_SLOTS, "Bomb", blob(68, AIR, shapes=Shape(w=(2, 4), h=5)), "falls"),
    _of_lanes(Kind.ROCKET, BOTH_FIRST, "Rocket", ROCKETS, "rises: in the air, in the sea"),
    _of_lanes(Kind.MISSILE, LOWER_SLOTS, "Missile", MISSILES, "rises: lane * 2 + copy"),
)

ALL_ICONS = 16 * MOST_ICONS - 8  # columns
ICONS = Bounds((38, 20, 10), (9, 184, 9 + ALL_ICONS, 189), value=Gauge(16, -8, 1, full=ALL_ICONS))

GAME = Game(
    name="Jamesbond",
    rom=ROM,
    ram=Ram,
    decode=decode,
    shades=NIGHT,
    checks=Checks(
        # Objects that are hit or leave are gone a frame early; VEM misses covered objects.
        agreement={"modes": 0.95},
        rare=("Depth_Charge", "Explosion", "Rocket", "Submarine", "Torpedo"),
        miscounted={"Score": 1},  # hidden
        known={"Life": 0.3},  # full
    ),
    backdrop=(100, 150),
    categories=(
        Category("Player", VEHICLE, role="player", doc="the vehicle"),
        Category("Player_Shot", UPWARD, doc="the shot that flies up"),
        Category("Depth_Charge", CHARGE, doc="falls; from the second mission on"),
        Category("Enemy_Shot", Bounds(254, SHOT_AREA, (1, 2)), otherwise=DIM, doc="of all enemies"),
        Category("Laser", Bounds(254, (8, 63, 160, 74), (2, 6)), doc="a helicopter's beam"),
        Category("Fire_Hole", HOLE, colors=(240, 52, 36, 24, 0), doc="in the ground"),
        Category("Lab", Bounds((24, 34, 54), (8, 156, 160, 179)), doc="on the sea bed"),
        *THINGS.categories,
        display("Score", SCORE.rule(24), role="score", doc="points"),
        display("Life", ICONS, rgb=(180, 122, 48), role="lives", doc="value: one more"),
    ),
)
