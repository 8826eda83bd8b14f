"""Beam Rider: a ship on five beams, saucers and other enemies that come down them, the sentinel.

Screen: what a shot has hit becomes an Explosion, then Sparks. The beams' lines and dots and the
maker's name are scenery.

Slots: the console keeps eight records: three for saucers, four for other enemies, one for the
player's shot. Each category has a slot for every record that may hold one of its objects.

RAM: ALE's source (score, lives), OCAtari 2.2 (records), and the ROM's code. Every second frame the
game makes the list of what is drawn from the records and moves the records afterwards, so the
screen shows where they were one step before. That step follows from what the record is, from its
speed or the script that it follows, and from the frame counter. A table gives the screen line of a
record's depth, a product of line and lane gives the column, state and depth give the picture.

Covered: sectors 1 to 20, all enemies, deaths, game over, the sentinel.

Not exact: the step of a record that has just changed what it does; which of two near objects is
moved by a few lines or left out on a frame; an enemy but a saucer on the frame of the hit; the last
frame of a torpedo.
"""

from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box, choose
from ocjax.console.fonts import Digits
from ocjax.console.ops import among, lookup, match, pick, reached, when
from ocjax.console.registers import packed_position
from ocjax.extraction.game import Category, Game, display
from ocjax.extractors._beamrider import (
    OTHERS,
    ROM,
    SAUCERS,
    Flag,
    Ram,
    State,
    bursting,
    drawn_places,
    is_saucer,
    just_hit,
    list_is_new,
)
from ocjax.vision.displays import NumberDisplay
from ocjax.vision.filters import ShortRuns
from ocjax.vision.rules import Blobs, Bounds, Cells
from ocjax.vision.shapes import Shape

FONT = ROM.font(0x3, rows=8)
NARROW_FONT = ROM.font(0x3, rows=8, dots=6, shift=1, pitch=6)  # the same without margins

SCORE = NumberDisplay(FONT, right=108, top=10, digits=6, leading_zeros=True)
SECTOR = NumberDisplay(FONT, right=108, top=21, digits=2)
AMOUNT = NumberDisplay(NARROW_FONT, right=31, top=32, digits=2)


class Ship:  # of `Ram.ship`
    EXPLODES = 19


SEVEN = slice(0, 7)  # the records but that of the shot
SHOT = 7  # among the records
NO_SHIPS = 128  # from here on, `spare_ships` is none
SENTINEL = 128  # from here on, `enemies` says that the sentinel passes

HORIZON = 32  # depths where objects are on the beams
NEAREST = 210
NEAR = 94  # depth from which saucers are brighter
GROUND = 164  # row of line 0
LINES = ROM.bytes(0x1EEF, 256) + 2  # by depth
SAUCER_GROWS = (48, 80, 112, 144, 184)  # at these depths
ENEMY_GROWS = (104, 144, 176)
TORPEDO_GROWS = (78, 128)
DISK = 39  # picture of a saucer far away
PICTURE_COUNT = 45  # five larger ones follow
# Tables of pages and low bytes. The top row is 2 bytes before that, seven more rows before it.
PAGES = ROM.bytes(0x1CE8, PICTURE_COUNT) & 15
LOW_BYTES = ROM.bytes(0x11D8, PICTURE_COUNT)
PICTURES = ROM.pictures((PAGES << 8 | LOW_BYTES - 2 - 7).tolist(), 8)

COLORS = ROM.bytes(0x1D8E, State.CRAFT.stop)  # by picture
YELLOW = 26
LASER_COLOR = 54
FIELD = (0, 44, 160, 164)
WRECK = 70  # an exploding ship
DISK_COLORS = (8, 14)  # far and near saucers


class Enemy(NamedTuple):
    """A kind of enemies: its states, how VEM finds it, and what it is."""

    states: range
    rule: Blobs
    doc: str


def _blobs(color: int, w: int | tuple[int, int], h: int | tuple[int, int], gap: int = 0) -> Blobs:
    return Blobs(color, FIELD, Shape(w=w, h=h), gap=(gap, gap))


SHOTS = Blobs((104, 86), FIELD, Shape(w=(2, 4), h=(2, 6), pixels=(8, 12)))
ENEMIES = {
    "Rejuvenator": Enemy(State.REJUVENATOR, _blobs(24, (3, 5), (2, 7)), "a life"),
    "Debris": Enemy(State.DEBRIS, _blobs(52, (1, 7), (1, 7), gap=1), "of a rejuvenator shot"),
    "Rock": Enemy(State.ROCK, _blobs(20, (1, 8), (1, 6)), "brown"),
    "Chriper": Enemy(State.CHIRPER, _blobs(26, 8, 7), "yellow, crosses"),
    "Blocker": Enemy(State.BLOCKER, _blobs(216, (1, 8), (1, 7), gap=1), "green"),
    "Bouncecraft": Enemy(State.CRAFT, _blobs(218, (1, 8), (1, 7)), "green, withstands the laser"),
    "Charger": Enemy(State.CHARGER, _blobs(202, (1, 8), (1, 7)), "fast"),
    "Jumper": Enemy(State.JUMPER, _blobs(40, (1, 7), (1, 6)), "orange"),
    "Enemy_Projectile": Enemy(State.ENEMY_SHOT, SHOTS, "shots at the ship"),
}


def decode(m: Ram) -> dict[str, Box]:
    x, y = drawn_places(m)
    picture = _pictures(m, y)
    shot_y, shot_picture, laser = _shot(m)
    flying = shot_y < NEAREST - 3
    all_x, all_y = jnp.append(x, m.shot_x), jnp.append(y, shot_y)
    drawn = _drawn(all_x, all_y, jnp.append(picture, shot_picture))
    colored = replace(drawn[SEVEN], color=lookup(COLORS, picture))
    burst = colored.where(bursting(m))
    return {
        "Player": _ship(m),
        "Saucer": _saucers(m, drawn, x, y),
        **_enemies(m, drawn, colored),
        "Explosion": burst.where(among(picture, State.EXPLOSION)),
        "Sparks": burst.where(among(picture, State.SPARKS)),
        "Player_Projectile": drawn[SHOT].where(laser & flying),
        "Torpedos": drawn[SHOT].where(among(m.shot, State.TORPEDO) & flying),
        "Sentinel": _sentinel(m),
        "Torpedos_Available": _torpedoes(m),
        "Enemy_Amount": AMOUNT.box(m.enemies, valid=m.enemies < SENTINEL),
        "Score": SCORE.box(m.score),
        "Sector": box(60, 21, jnp.where(m.sector_ones == 1, 46, 47), 8, value=m.sector),
        "Life": _lives(m),
    }


def _ship(m: Ram) -> Box:
    wrecked = m.ship == Ship.EXPLODES
    sunk, color = when(wrecked, 4), jnp.where(wrecked, WRECK, YELLOW)
    return box(packed_position(m.ship_position) + 9, 164 + sunk, 15, 16 - sunk, color=color)


def _enemies(m: Ram, drawn: Box, colored: Box) -> dict[str, Box]:
    kind = m.state[OTHERS]
    boxes = {name: drawn[OTHERS].where(among(kind, e.states)) for name, e in ENEMIES.items()}
    shots = colored[OTHERS].where(among(kind, State.ENEMY_SHOT))
    return boxes | {"Enemy_Projectile": shots}


def _sentinel(m: Ram) -> Box:
    way = m.sentinel_x - 7
    x = 9 + ((way + (way >> 2) + (way >> 1 & 1)) >> 1)
    return box(x, 37, 16, 7, m.enemies >= SENTINEL)


def _torpedoes(m: Ram) -> Box:
    place = np.arange(3)
    return box(128 + 8 * place, 32, 4, 8, place >= 3 - m.torpedoes)


def _lives(m: Ram) -> Box:
    place = np.arange(13)
    spare = when(m.spare_ships < NO_SHIPS, m.spare_ships) + when(m.ship_lost == Flag.SET, 1)
    return box(32 + 9 * place, 183, 5, 7, spare > place)


def _pictures(m: Ram, y: jax.Array) -> jax.Array:
    """The pictures with which the seven records were drawn."""
    state, new = m.state, list_is_new(m)
    odd = when((np.arange(7) < 3) | new, m.clock & 1)
    return match(
        (is_saucer(m), DISK + reached(y, SAUCER_GROWS)),
        (bursting(m), jnp.maximum(state - odd, State.BURST.start)),
        (among(state, State.ENEMY_SHOT), state ^ odd),
        (among(state, State.SIZED), (state & ~3) + reached(y, ENEMY_GROWS)),
        (among(state, State.CHIRPER) & new, _chirpers(m)),
        otherwise=state,
    )


def _chirpers(m: Ram) -> jax.Array:
    """The picture before the one that a chirper has now."""
    state = m.state
    forth = jnp.where(state == State.CHIRPER.start, state + 1, state - 1)
    back = jnp.where(among(state, State.CHIRPER_TURNED), state ^ 1, state + 1)
    return jnp.where(m.back == 1, back, forth)


def _shot(m: Ram) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Depth and picture of the player's shot as drawn, and whether it is the laser's."""
    new, struck = list_is_new(m), m.shot == State.STRUCK
    target = jnp.max(when(just_hit(m), m.y + 1))
    ended = jnp.cumsum(m.list_line == 0) > 0  # the rest of the list is old
    listed = among(m.list_line, (101, 104)) & (m.list_color == LASER_COLOR) & ~ended
    gone = new & ((m.shot & 63) == 0) & jnp.any(listed)
    y = match((struck, (target & ~7) + 14), (gone, 102), otherwise=m.shot_y + when(new, 8))
    laser = (m.shot == State.LASER) | (struck & (target > 0)) | gone
    torpedo = State.TORPEDO.start + reached(y, TORPEDO_GROWS)
    return y, jnp.where(laser, State.LASER, torpedo), laser


def _drawn(x: jax.Array, y: jax.Array, picture: jax.Array) -> Box:
    """Pictures at a lane and a depth; not valid where they are not on the beams."""
    line = lookup(LINES, y)
    left = 80 + _scaled(x - 128, 198 - line + (line >> 4) + (line >> 3 & 1))
    on_beams = (y >= HORIZON) & (y < NEAREST) & (left < 158)
    return PICTURES.box(picture, left, GROUND - line + 1, valid=on_beams)


def _scaled(side: jax.Array, scale: jax.Array | int) -> jax.Array:
    """A distance from the middle times scale / 128, rounded towards the middle."""
    return jnp.where(side >= 0, side * scale >> 7, -(-side * scale >> 7))


def _saucers(m: Ram, drawn: Box, x: jax.Array, y: jax.Array) -> Box:
    """The saucers on the beams; beyond the horizon they are dots."""
    saucer, x, y = is_saucer(m)[SAUCERS], x[SAUCERS], y[SAUCERS]
    far = saucer & (y < HORIZON)
    i, other, own = np.arange(3), y[None], y[:, None]
    before = (other < own) | ((other == own) & (i[None] > i[:, None]))
    third = jnp.sum(when(before & far[None], 1), axis=1) == 2  # another sprite draws it
    dot_x = jnp.where(third, 84, 80) + _scaled(x - jnp.where(third, 128, 123), 84)
    near = when(y >= NEAR, 1)
    saucers = choose(far, box(dot_x, 43, 1, 1), drawn[SAUCERS].where(saucer))
    return replace(saucers, color=pick(near, DISK_COLORS))


SHIP_COLORS = (*range(64, 112, 2), YELLOW)
SHIP = Blobs(SHIP_COLORS, (0, 164, 160, 180), Shape(w=(9, 15), h=(9, 16)), gap=(4, 2))
SAUCER_SHAPES = (
    Shape(w=(1, 8), h=(2, 6)),
    Shape(w=(1, 3), h=1, split=(1, 1)),  # dots at the horizon
)
SAUCERS_SHOWN = Blobs(DISK_COLORS, (0, 43, 160, 164), SAUCER_SHAPES)
EXPLOSIONS = Blobs((26, 24, 22, 14), FIELD, Shape(w=(7, 8), h=(7, 8), pixels=(17, 25)))
ENDS = Blobs((38, 86), FIELD, Shape(w=(7, 8), h=5), gap=(2, 1))
PASSING = Blobs((140, 66, 68, 218, 58), (0, 37, 160, 44), Shape(w=(8, 16), h=(4, 7)))
SPARE_TORPEDOES = Cells(98, (128, 136, 144), (32,) * 3, 4, 8)
SPARE_SHIPS = Blobs(YELLOW, (0, 182, 160, 194), Shape(w=(1, 5), h=(1, 7)))
AMOUNT_CELLS = Digits(NARROW_FONT, (6, *AMOUNT.lefts), AMOUNT.top)

GAME = Game(
    name="BeamRider",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", SHIP, color_row=-1, doc="the ship"),
        Category("Saucer", SAUCERS_SHOWN, count=3, doc="white; dots at the horizon"),
        *(Category(name, e.rule, count=4, doc=e.doc) for name, e in ENEMIES.items()),
        Category("Explosion", EXPLOSIONS, count=7, doc="what was hit"),
        Category("Sparks", ENDS, count=7, doc="the end of an explosion"),
        Category(
            "Player_Projectile",
            Blobs(LASER_COLOR, FIELD, Shape(w=(1, 8), h=(1, 5))),
            doc="the laser",
        ),
        Category(
            "Torpedos",
            Blobs(104, FIELD, Shape(w=(1, 5), h=(1, 5)), filters=(ShortRuns(1),)),
            doc="flying",
        ),
        Category("Sentinel", PASSING, doc="passes above when no enemies are left"),
        display("Torpedos_Available", SPARE_TORPEDOES, count=3, attributes=(), doc="left"),
        display(
            "Enemy_Amount",
            Bounds(212, (15, 30, 40, 43), value=AMOUNT_CELLS),
            doc="enemies left in this sector",
        ),
        display("Score", SCORE.rule(42, (56, 8, 110, 19)), doc="the score", aliases=("HUD",)),
        display("Sector", SECTOR.rule(42, (56, 20, 110, 30)), doc="the sector's number"),
        display("Life", SPARE_SHIPS, count=13, attributes=(), doc="spare ships"),
    ),
)
