"""Atlantis: three cannons and six other buildings of a city, below ships that fly over in lanes.

With each pass a ship comes down by one of four lanes; its slot, the game's own record, stays the
same. The wreck of a Gorgon ship stays in the ship's slot. The wreck of a bandit bomber is the large
explosion that ends all ships. A building stays valid while it explodes. The outermost eight columns
of the sky are black masks. The ground, the water and the black dashes at the left edge are scenery.

RAM: ALE's source (score, lives), OCAtari 2.2 (what the tables are), and the ROM's code. Ships are
drawn from positions in the chip's coding, which do not change until the next frame. Everything else
moves after it was drawn, and `decode` takes that back. The digits and most buildings are known by
the pointers to their pictures. A shot counts display lines from the bottom; some of them are two
rows high. It has the colour that its sprite would have in that row.

Covered: modes 0-3, waves, the destruction of every building, the bandit's explosion, game over. Not
in RAM, each for a single frame: a shot that hits or leaves the sky, a ship that leaves the lowest
lane, the last frame of a wreck, the death ray when it hits. VEM takes a ship of which only a part
is in the picture for a Gorgon ship.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Area, Box, Number, box
from ocjax.console.fonts import Digits
from ocjax.console.ops import lookup, pick
from ocjax.console.palette import NTSC
from ocjax.console.ram import RamMap, bcd, bits, byte, high, signed
from ocjax.console.registers import position
from ocjax.console.rom import Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Blobs, Bounds
from ocjax.vision.shapes import Shape

ROM = Rom("atlantis", "9ad36e699ef6f45d9eb6c4cf90475c9f")
FONT = ROM.font(0xF00, rows=10, dots=7)

PLAY = 1  # `state`
OVER = 128  # 128 and more: the game is over
# stages of a building's damage
STANDS = 0
HIT = 1
CRUMBLES = 3
LAST_RUIN = 4
GONE = 5
RIGHT_ANGLED = 0x40  # pictures of ships
BANDIT = 0x50  # flat ones come before
BLAST = 0x80  # `blast`: this bit and the stage
BLAST_FLASH = 0x20  # `flash` on the frame on which a bandit is hit, which still shows everything
BUILDING_HIT = 0x3E  # `noise` on the frame on which a building is hit, which is still drawn whole
RECOILING = 0x88  # picture of the left cannon
NEW_SHOT = 0x64  # `shot_y` of a shot that has just been fired by the right cannon
# digits count rows of the font
DIGIT_ONE = 10
NO_DIGIT = 100
NO_LIVES = 255

SKY = (8, 8, 152, 124)
SHOWN = (8, 0, 152, 210)  # between the masks
LANES = tuple((8, 82 - 21 * i, 152, 90 - 21 * i) for i in range(4))  # lowest first
HIGH_LINES = (0x6F, 0x79, 0x8D, 0xA1, 0xB5)  # of a shot; they are two rows high
# The land: first columns and top rows. Columns 80 to 159 repeat it, without the left edge.
LEFTS = (0, 8, 12, 16, 32, 36, 56, 60, 68, 72, 80)
TOPS = (132, 156, 164, 178, 164, 156, 164, 145, 132, 120)
LAND_TOPS = np.tile(np.repeat(TOPS, np.diff(LEFTS)), 2)
RAY_ENDS = np.maximum(LAND_TOPS, np.append(LAND_TOPS[1:], LAND_TOPS[-1]))  # of two columns

SHIP = (24, 58, 86, 100, 120, 152, 164, 218)  # a colour a row
SHOT = (*SHIP, 26, 42, 62, 74, 104, 202, 254)
FIRE = (62, 60, 56, 54, 52, 50, 48)
CANNON = (24, 58, 86, 152, 202, 254)
POST = (26, 42, 58, 74, 104)
GENERATORS = ((74, 120, 138, 200, 202, 252), (188,), (126,))
PALACE = (60, 90, 204, 252)
BAZAAR = (12, 58, 74, 90, 106, 122, 138)
PLANE = (42, 58, 78, 90, 106, 138, 202)
GROUND = (186, 198)
GOLD = 62
STAGE_FLASHES = 4  # of the blast


def _shot_colors() -> np.ndarray:
    """By slot and row, from the top: shots have the colours of what their sprites draw there."""
    colors = np.full((2, 124), ROM.bytes(0xE18, 1)[0], np.int32)
    colors[:, :19] = GOLD
    for top in (19, 40, 61, 82):
        colors[:, top : top + 8] = ROM.rows(0xE18, 8)
    colors[:, 112:120] = ROM.rows([0xE27, 0xE20], 8)
    return colors.ravel()


SHOT_COLORS = _shot_colors()


class Ram(RamMap):
    digits = byte(0, 2, 4, 6, 8, 10)  # 10 * digit, the lowest first
    left_cannon = byte(21)  # picture
    generators = byte(22, 23, 24)  # pictures: 0x78 and 0x68 are narrow
    millions = bcd(33)  # of the score; something else when the game is over
    score = bcd((35, 34))  # hundreds
    ship_x = byte(36, 37, 38, 39)  # lowest lane first; 0: none
    coarse = byte(50, 52, 54, 56)  # x + 1 as drawn, in the chip's coding
    fine = high(51, 53, 55, 57)
    shot_y = byte(58, 59)
    shot_x = byte(60, 61)
    ray_x = byte(62)
    blast_x = byte(64)  # middle
    shot_speed = signed(65, 66)
    ship_lane = bits(71, 72, 73, 74, count=2)
    ship_waits = bits(71, 72, 73, 74, first=2)
    ship_stage = bits(71, 72, 73, 74, first=3, count=3)  # of a wreck
    ship_hit = bits(71, 72, 73, 74, first=6)
    ship_right = bits(71, 72, 73, 74, first=7)  # flies to the right
    ship_kind = byte(79, 80, 81, 82)  # picture
    state = byte(83)  # 0 demo, 1 play, 2 between waves, 255 over
    damage = byte(*range(84, 91))  # post, generators, palace, bazaar, plane
    blast = byte(91)
    blast_lane = bits(92, count=2)
    right_fires = byte(93)  # counts down
    flash = byte(96)  # counts down
    noise = byte(105)  # counts down
    lives = byte(113)
    clock = byte(122)  # frames


def decode(m: Ram) -> dict[str, Box]:
    just_hit = (m.damage == HIT) & (m.noise == BUILDING_HIT)
    damage = jnp.where(just_hit, STANDS, m.damage)
    ships, is_bandit = _ships(m)
    return {
        "Sentry": _cannons(m),
        "AcropolisCommandPost": _building(72, 112, 8, damage[0], ruin_width=7),
        "Generator": _generators(m, damage[1:4]),
        "DomedPalace": _building(38, 148, 16, damage[4], ruin_width=14),
        "BridgedBazaar": _building(96, 159, 16, damage[5], ruin_width=14),
        "AquaPlane": _plane(damage[6]),
        "GorgonShip": ships.where(~is_bandit),
        "BanditBomber": ships.where(is_bandit),
        "Explosion": _blast(m),
        "Projectile": _shots(m),
        "Deathray": _death_ray(m),
        "Score": _score(m),
    }


def _over(m: Ram) -> jax.Array:
    return m.state >= OVER


def _blasting(m: Ram) -> jax.Array:
    """Whether the explosion of a bandit takes the place of all ships."""
    just_begun = (m.blast == BLAST) & (m.flash == BLAST_FLASH)
    return (m.blast >= BLAST) & ~just_begun


def _cannons(m: Ram) -> Box:
    """The left and the right one, a row lower while they recoil."""
    new_shot = jnp.any((m.shot_speed < 0) & (m.shot_y == NEW_SHOT))
    right = (m.right_fires == 1) | (m.right_fires == 2) | new_shot
    recoil = jnp.where(jnp.stack([m.left_cannon == RECOILING, right]), 1, 0)
    return box(np.array((0, 152)), np.array((124, 112)) + recoil, 8, 8 - recoil, ~_over(m))


def _building(x: Number, y: Number, width: Number, damage: jax.Array, *, ruin_width: int) -> Box:
    """A building, its explosion or its ruins; `ruin_width` is the width while it crumbles."""
    crumbles = damage == CRUMBLES
    left = x + jnp.where(crumbles, 1, 0)
    top = y + jnp.where(damage == HIT, 1, 0)
    height = jnp.where((damage >= HIT) & (damage <= CRUMBLES), 7, 8)
    return box(left, top, jnp.where(crumbles, ruin_width, width), height, damage < GONE)


def _generators(m: Ram, damage: jax.Array) -> Box:
    """By the post, left, right: the first and the last widen, the one on the left turns."""
    widens = np.array((1, 0, 1))
    is_last = np.arange(3) == 2
    stands = damage == STANDS
    narrow = jnp.where((m.generators & 15) == 8, widens, 0)
    ruins = jnp.where(is_last & (damage == LAST_RUIN), 3, 8)
    width = jnp.where(stands, 4 - 2 * narrow, ruins)
    x = np.array((82, 60, 142)) + jnp.where(stands, narrow - 2 * widens + 2, 0)
    generators = _building(x, np.array((124, 137, 137)), width, damage, ruin_width=7)
    return generators.clip(0, 0, np.array((160, 160, 148)), 210)


def _plane(damage: jax.Array) -> Box:
    inset = pick(damage, (0, 4, 3, 2, 1))
    width = pick(damage, (16, 9, 11, 13, 15))
    top = pick(damage, (171, 172, 171, 170))
    return box(16 + inset, top, width, pick(damage, (7, 3, 6, 8)), damage < GONE)


def _ships_x(m: Ram) -> jax.Array:
    """Columns at which the ships of each lane were drawn; not positive where there is none."""
    return position(m.coarse, m.fine) - 1


def _ships(m: Ram) -> tuple[Box, jax.Array]:
    """The ships and wrecks, and which of them are bandits."""
    lane, x = _ship_places(m)
    stage = m.ship_stage - jnp.where((m.clock & 7) == 0, 1, 0)
    wreck = jnp.where(m.ship_hit == 1, jnp.maximum(stage, 0), 0)
    is_bandit = m.ship_kind == BANDIT
    width = jnp.where(is_bandit, 9, pick(wreck, (15, 11, 13, 15)))
    inset = jnp.where(is_bandit, 4, pick(wreck, (0, 3, 2, 1)))
    to_right = m.ship_right == 1
    left = x - 8 + jnp.where(to_right, 16 - inset - width, inset)
    columns = jnp.where(to_right, left + width - 8, 152 - left)  # in the picture, from the nose
    top, bottom = _ship_rows(m, wreck, columns)
    there = (x > 0) & ~_over(m) & ~_blasting(m)
    ships = box(left, 82 - 21 * lane + top, width, bottom - top, there)
    return ships.clip(*SHOWN), is_bandit


def _ship_places(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Lane and column of each ship; one that has just left a lane is still drawn there."""
    x = _ships_x(m)
    left_now = jnp.where(m.ship_x == 0, x, 0)
    here, above = jnp.zeros_like(x), jnp.zeros_like(x)
    for lane in range(4):
        here = jnp.where((m.ship_lane == lane) & (m.ship_waits == 0), x[lane], here)
    for lane in range(3):
        above = jnp.where(m.ship_lane == lane, left_now[lane + 1], above)
    lane = jnp.where(here > 0, m.ship_lane, m.ship_lane + 1)
    return lane, jnp.where(here > 0, here, above)


def _ship_rows(m: Ram, wreck: jax.Array, columns: jax.Array) -> tuple[jax.Array, jax.Array]:
    """First row and last row + 1 in the lane of a ship of which some columns are in the picture."""
    is_bandit = m.ship_kind == BANDIT
    is_flat = is_bandit | (m.ship_kind < RIGHT_ANGLED)
    small = wreck == 1
    pointed = is_flat & ~is_bandit & (wreck == 0)
    above = jnp.where(columns < 8, 3, jnp.where(columns < 11, 2, jnp.where(columns < 13, 1, 0)))
    below = jnp.where(columns < 6, 3, jnp.where(columns < 9, 2, jnp.where(columns < 10, 1, 0)))
    top = jnp.where(is_flat | small, 1, 0) + jnp.where(pointed, above, 0)
    bottom = jnp.where(small, 7, 8) - jnp.where(pointed, below, 0)
    tip = is_bandit & (columns < 6)
    return jnp.where(tip, 4, top), jnp.where(tip, 5, bottom)


def _blast(m: Ram) -> Box:
    stage = m.blast & 7
    half = pick(stage, (3, 6, 9, 11, 13))
    y = pick(m.blast_lane, (80, 60, 40, 28)) - pick(stage, (0, 1, 5, 10, 9))
    there = _blasting(m) & ~_over(m)
    height = pick(stage, (10, 14, 21, 30, 28))
    color = jnp.where(stage == STAGE_FLASHES, m.clock & 14 ^ GOLD, GOLD)
    blast = box(m.blast_x - half, y, 2 * half + 1, height, there, color=color)
    return blast.clip(8, 21, 152, 124)


def _shots(m: Ram) -> Box:
    """The shots where they were before their last step."""
    y = m.shot_y - jnp.where(m.shot_speed == 0, 3, 2)
    top = 205 - y - jnp.where(y >= 0x61, 2, 0)
    is_high = y < 0
    for line in HIGH_LINES:
        top = top - jnp.where(y >= line, 1, 0)
        is_high = is_high | (y == line)
    # Near the edges the beam comes to the shot before the program does, or after it.
    is_first = np.arange(2) == 0
    from_left, from_right = m.shot_speed > 0, m.shot_speed < 0
    late_left = from_left & (y <= 0x5D)
    late_right = from_right & (y >= 0xAE) & (y <= 0xB4)
    late = is_first & (late_left | late_right)
    early = from_right & (y == 0x60)
    top = top + jnp.where(late, 1, jnp.where(early, -1, 0))
    is_high = is_high | early | (is_first & from_left & (y == 0x5E))
    muzzle = jnp.where(from_left, jnp.where(is_first, 0x57, 0x56), 0x5E)
    there = (m.shot_y > 0) & (y >= muzzle)
    height, x = jnp.where(is_high, 2, 1), m.shot_x - m.shot_speed
    color = lookup(SHOT_COLORS, jnp.clip(top, 0, 123) + np.arange(2) * 124)
    return box(x, top, 1, height, there, color=color).clip(8, 0, 152, 124)


def _death_ray(m: Ram) -> Box:
    """From the ship in the lowest lane to the deeper land below its two columns."""
    there = (m.ray_x > 0) & (_ships_x(m)[0] > 0) & (m.state == PLAY) & ~_blasting(m)
    ray = box(m.ray_x, 92, 2, lookup(RAY_ENDS, m.ray_x) - 92, there)
    return ray.clip(8, 0, 160, 210)


def _score(m: Ram) -> Box:
    count = jnp.max(jnp.where(m.digits == NO_DIGIT, 0, np.arange(1, 7)))
    left = 104 - 8 * count
    right = jnp.where(m.digits[0] == DIGIT_ONE, 102, 103)
    millions = jnp.where(m.lives == NO_LIVES, 0, m.millions)
    return box(left, 188, right - left, 10, count > 0, value=1000000 * millions + 100 * m.score)


def _ground() -> tuple[Area, ...]:
    pieces = list(zip(LEFTS, TOPS, LEFTS[1:], strict=False))
    halves = [(at + x, top, at + end, 210) for at in (0, 80) for x, top, end in pieces]
    return tuple(halves[1:])


def _colored(name: str, rule: Bounds | Blobs, *colors: int, **options: Any) -> Category:
    """A category whose objects always have the same colours: the main one, or that of each slot."""
    rgb = tuple(NTSC[c] for c in colors)
    return Category(name, rule, rgb=rgb, **options)


GORGON = Bounds(SHIP, LANES, exclude=("BanditBomber", "Projectile"))
BOMBER = Blobs(SHIP, SKY, Shape(w=9, h=7, pixels=(18, 28)))
CANNONS = Bounds(CANNON, ((0, 124, 8, 132), (152, 112, 160, 120)))
COMMAND = Bounds(POST, (72, 112, 80, 120))
DOME = Bounds(PALACE, (38, 148, 54, 156))
BRIDGE = Bounds(BAZAAR, (96, 159, 112, 167))
SEA_BED = Bounds(PLANE, (16, 170, 32, 178))
POWER = Bounds(GENERATORS, ((82, 124, 90, 132), (60, 137, 68, 145), (142, 137, 148, 145)))
SHOTS = Blobs(SHOT, SKY, Shape(w=1, h=(1, 2)), gap=(3, 2))
RAY = Bounds(GROUND, (8, 92, 160, 210), ignore=_ground())
SCORE = Bounds(GOLD, (55, 188, 103, 198), value=Digits(FONT, range(56, 104, 8), 188))

GAME = Game(
    name="Atlantis",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        _colored("Sentry", CANNONS, 202, count=2, doc="left and right cannon"),
        _colored("AcropolisCommandPost", COMMAND, 58, doc="middle cannon"),
        _colored("Generator", POWER, 202, 188, 126, count=3, doc="by the post, left, right"),
        _colored("DomedPalace", DOME, 60, doc="under the dome"),
        _colored("BridgedBazaar", BRIDGE, 138, doc="on the bridge"),
        _colored("AquaPlane", SEA_BED, 202, doc="on the sea bed"),
        _colored("GorgonShip", GORGON, 218, count=4, doc="or a wreck"),
        _colored("BanditBomber", BOMBER, 218, count=4, doc="small and fast"),
        Category("Explosion", Bounds(FIRE, SKY, min_size=(7, 10)), doc="of a bandit bomber"),
        Category("Projectile", SHOTS, count=2, doc="the city's shots"),
        Category("Deathray", RAY, blinks=True, doc="of a ship in the lowest lane"),
        display("Score", SCORE, doc="points"),
    ),
)
