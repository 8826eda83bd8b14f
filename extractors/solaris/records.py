"""Flying objects in Solaris: enemies, their shots, explosions, planets and craters.

Each of five records holds a picture, x, y and depth. The kind of the picture gives the record's
category. The low bits of the picture are its size, which the ROM computes from the depth.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Box, among, box, choose, edges, lookup, match, when
from ocjax.extractors.solaris.pictures import (
    GROUND_TOP,
    VIEW_BOTTOM,
    VIEW_TOP,
    cut_at,
    shown_of,
)
from ocjax.extractors.solaris.ram import RECORDS, ROM, GroundKind, Kind, Picture, Ram

VIEW = (8, VIEW_TOP, 160, VIEW_BOTTOM)  # the kernel leaves the first columns black
FIRST_Y = 170  # of a record on the screen, plus its `y`
ABOVE_VIEW = 0x99  # least `y` of a record above the view
IN_SHIP_SPRITE = np.arange(RECORDS) == 0  # the first record; the other sprite shows the others
DARTER_SHIFT = 4  # columns to the right, for darters in the ship's sprite

# Sizes of pictures by a step: half the depth, over planets a quarter of it ($FDA2 of bank 0). The
# high nibble has sizes of planets, the low nibble all other sizes that follow from depth alone.
SIZES_BY_STEP = ROM.bytes(0xDA2, 20)
SINGLE_LOOK = 9  # least step of sizes from 1; nearer, sizes 0 to 2 are alternating looks
SMALL_DARTER = 16  # least step of darters of sizes 6 and 7 instead of 4 and 5 ($F926)
LARGEST_SHOT = 2  # size ($FDB6)


def flying(m: Ram) -> dict[str, Box]:
    """The boxes of all categories that have records."""
    shown = _records_shown(m)
    return {**_enemies(m, shown), **_worlds(m, shown)}


def _enemies(m: Ram, shown: Box) -> dict[str, Box]:
    """Enemies, their remains, and objects on the ground."""
    space = shown.where(m.on_planet == 0)
    ground = shown.where(m.on_planet == 1)
    return {
        "Fighter": shown.where(m.kind == Kind.FIGHTER),
        "Pirate": shown.where(m.kind == Kind.PIRATE),
        "Warp": space.where((m.kind == Kind.WARP) & ~m.is_darter),
        "Darter": space.where(m.is_darter),
        "HyperJumper": space.where(m.kind == Kind.JUMPER),
        "PlanetKiller": space.where(m.kind == Kind.KILLER),
        "Blockader": space.where(m.kind == Kind.BLOCKADER),
        "Raider": ground.where(m.kind == GroundKind.RAIDER),
        "Man": ground.where(m.kind == GroundKind.MAN),
        "LandingZone": ground.where(m.kind == GroundKind.LANDING_ZONE),
        "Tower": ground.where(m.kind == GroundKind.TOWER),
        "EnemyMissile": shown.where(m.kind == Kind.ENEMY_MISSILE),
        "Explosion": shown.where(m.kind == Kind.EXPLOSION),
    }


def _worlds(m: Ram, shown: Box) -> dict[str, Box]:
    """Planets and craters. A planet in the ship's sprite is the middle of a ringed one."""
    space = m.on_planet == 0
    ground = m.on_planet == 1
    planets = shown.where(among(m.kind, Kind.PLANETS) & ~IN_SHIP_SPRITE)
    is_on_ground = shown.y >= GROUND_TOP
    return {
        "RingedPlanet": _ringed(m, shown).where(space & (m.kind == Kind.RINGED_PLANET)),
        "BluePlanet": planets.where(m.picture < Picture.RED_PLANET),
        "RedPlanet": planets.where(m.picture >= Picture.RED_PLANET),
        "Crater": shown.where(ground & (m.kind == GroundKind.CRATER) & is_on_ground),
    }


def _ringed(m: Ram, shown: Box) -> Box:
    """Rings, one of them with the planet that the ship's sprite shows in its middle.

    That planet counts as new (`_is_new`) unless it is tiny, because the ROM overwrites its depth
    ($F951). In all frames seen, larger planets stayed within their rings.
    """
    body = shown[0]
    is_its_ring = body.valid & (m.x == m.x[0]) & among(m.kind[0], Kind.PLANETS)
    with_body = edges(
        left=jnp.minimum(shown.x, body.x),
        top=jnp.minimum(shown.y, body.y),
        right=jnp.maximum(shown.x + shown.w, body.x + body.w),
        bottom=jnp.maximum(shown.y + shown.h, body.y + body.h),
        valid=shown.valid,
        color=shown.color,
    )
    return choose(is_its_ring, with_body, shown)


def _records_shown(m: Ram) -> Box:
    """The visible part of each record."""
    y = FIRST_Y - m.y
    look = shown_of(m.picture, m.sky, cut_at(y))
    x = m.x + look.left + when(m.is_darter & IN_SHIP_SPRITE, DARTER_SHIFT)
    there = (m.picture < Picture.NONE) & (m.y < ABOVE_VIEW) & m.flies & ~m.is_over
    valid = there & ~_is_new(m)
    return box(x, y + look.top, look.width, look.height, valid, color=look.color).clip(*VIEW)


def _is_new(m: Ram) -> jax.Array:
    """True for records filled since the frame was drawn; they still lack their size.

    The ROM gives each kind its size by a rule ($F801-$F9A4 of bank 0). A size that the rule cannot
    give is the initial one.
    """
    step = jnp.minimum(m.depth >> 1 + m.on_planet, len(SIZES_BY_STEP) - 1)
    sizes = lookup(SIZES_BY_STEP, step)
    size = m.picture & 7
    space = m.on_planet == 0
    is_red = m.picture >= Picture.RED_PLANET
    planet_size = m.picture - jnp.where(is_red, Picture.RED_PLANET, Picture.PLANET)
    return match(
        (among(m.kind, Kind.PLANETS), planet_size != sizes >> 4),
        (among(m.kind, (Kind.KILLER, Kind.RINGED_PLANET)), size != sizes & 7),
        ((m.kind == Kind.PIRATE) & space, size != sizes & 7),
        (m.kind == Kind.WARP, space & (size == Picture.DARTER & 7) & (step >= SMALL_DARTER)),
        (m.kind == Kind.ENEMY_MISSILE, size < LARGEST_SHOT),
        (m.kind == Kind.EXPLOSION, False),
        otherwise=(size == 0) & (step >= SINGLE_LOOK),
    )
