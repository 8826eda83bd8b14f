"""Atlantis: three cannons and six other buildings of a city, below ships that fly over in lanes.

Screen: the outermost eight columns of the sky are black masks. The ground, the water and the black
dashes at the left edge are scenery.

Slots: a ship comes down one of four lanes with each pass. Its slot, the game's own record, stays
the same. The wreck of a Gorgon ship stays in the ship's slot. The wreck of a bandit bomber is the
large explosion that ends all ships. A building stays valid while it explodes.

RAM: ALE's source (score, lives), OCAtari 2.2 (meaning of the tables), and the ROM's code. The game
draws ships from positions in the chip's coding, which do not change until the next frame. All other
objects move after they are drawn; `decode` reverts this. The pointers to pictures identify the
digits and most buildings. A shot counts display lines from the bottom; some of them are two rows
high. The shot has the colour that its sprite would have in that row.

Covered: modes 0-3, waves, the destruction of every building, the bandit's explosion, game over.

Not exact: the RAM lacks these facts, each for a single frame: a shot that hits or leaves the sky, a
ship that leaves the lowest lane, the last frame of a wreck, the death ray when it hits.

VEM: it takes a partly visible ship for a Gorgon ship.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    NTSC,
    Area,
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Digits,
    Game,
    LivesAsIcons,
    Number,
    RamMap,
    Rom,
    Shape,
    among,
    bcd,
    bits,
    box,
    byte,
    display,
    high,
    lookup,
    low,
    match,
    pick,
    position,
    reached,
    signed,
    when,
)

ROM = Rom("atlantis", "9ad36e699ef6f45d9eb6c4cf90475c9f")
FONT = ROM.font(0xF00, rows=10, dots=7)


class State:  # of `Ram.state`
    PLAY = 1
    OVER = 128  # least `state` after the end of the game


class Damage:  # of `Ram.damage`
    STANDS = 0
    HIT = 1
    CRUMBLES = 3
    LAST_RUIN = 4
    GONE = 5


class Kind:  # of `Ram.ship_kind`; the pictures before `RIGHT_ANGLED`, and the bandit's, are flat
    RIGHT_ANGLED = 64
    BANDIT = 80


BLAST_BIT = 128  # `blast`: this bit and the stage
BLAST_FLASH = 32  # `flash` on the frame of a bandit's hit, which still shows all ships
FLASHING_STAGE = 4  # of the blast
BUILDING_HIT = 62  # `noise` on the frame of a building's hit, which still shows it intact
NARROW_GENERATOR = 8  # `generators`
RECOILING = 136  # `left_cannon`
RIGHT_RECOILS = (1, 2)  # `right_fires`
DIGIT_ONE = 10  # `digits` count rows of the font
NO_DIGIT = 100
NO_LIVES = 255

# Positions of shots, in display lines from the bottom.
NEW_SHOT = 100  # a shot that the right cannon has just fired
LEFT_MUZZLES = (87, 86)  # shots to the right, by slot
RIGHT_MUZZLE = 94  # shots to the left
HIGH_LINES = (111, 121, 141, 161, 181)  # two rows high
# Near the edges the beam reaches the shot before the program does, or after it.
LATE_TO_RIGHT = 93  # first slot: at most this line, a row lower
LATE_TO_LEFT = range(174, 181)  # first slot: a row lower
EARLY_TO_LEFT = 96  # a row higher, and two rows high
HIGH_TO_RIGHT = 94  # first slot: two rows high
LIFTED = 97  # least line of shots two rows higher

SKY = (8, 8, 152, 124)
SHOWN = (8, 0, 152, 210)  # between the masks
LANE_TOP = 82  # top of the lowest lane
LANE_PITCH = 21
LANES = tuple((8, top, 152, top + 8) for top in (LANE_TOP - LANE_PITCH * i for i in range(4)))
# The land: first columns and top rows. Columns 80 to 159 repeat it, without the left edge.
LEFTS = (0, 8, 12, 16, 32, 36, 56, 60, 68, 72, 80)
TOPS = (132, 156, 164, 178, 164, 156, 164, 145, 132, 120)
LAND_TOPS = np.tile(np.repeat(TOPS, np.diff(LEFTS)), 2)
RAY_ENDS = np.maximum(LAND_TOPS, np.append(LAND_TOPS[1:], LAND_TOPS[-1]))  # of two columns

SHIP = (24, 58, 86, 100, 120, 152, 164, 218)  # a colour per row
SHOT = (*SHIP, 26, 42, 62, 74, 104, 202, 254)
FIRE = (62, 60, 56, 54, 52, 50, 48)
CANNON = (24, 58, 86, 152, 202, 254)
POST = (26, 42, 58, 74, 104)
GENERATOR_COLORS = ((74, 120, 138, 200, 202, 252), (188,), (126,))
PALACE = (60, 90, 204, 252)
BAZAAR = (12, 58, 74, 90, 106, 122, 138)
PLANE_COLORS = (42, 58, 78, 90, 106, 138, 202)
GROUND = (186, 198)
GOLD = 62
# From the tip: columns after which a Gorgon ship has another row above, below.
ROWS_ABOVE = (8, 11, 13)
ROWS_BELOW = (6, 9, 10)
RAY_TOP = 92
SCORE_RIGHT = 103
SCORE_TOP = 188


def _colors_of_shots() -> np.ndarray:
    """Colours of shots by slot and row from the top; a shot has its sprite's colour in that row."""
    row = np.arange(124)
    in_lane = (row - 19) % 21  # a ship has 8 rows of its lane
    above = row < 19
    in_ship = (row >= 19) & (row < 90) & (in_lane < 8)
    in_gun = (row >= 112) & (row < 120)
    of_ship = ROM.rows(0xE18, 8)[in_lane % 8]
    of_guns = ROM.rows([0xE27, 0xE20], 8)[:, (row - 112) % 8]
    elsewhere = ROM.bytes(0xE18, 1)[0]
    colors = np.select([above, in_ship, in_gun], [GOLD, of_ship, of_guns], elsewhere)
    return colors.astype(np.int32).ravel()


SHOT_COLORS = _colors_of_shots()


class Ram(RamMap):
    digits = byte(0, 2, 4, 6, 8, 10)  # 10 * digit, the lowest first
    left_cannon = byte(21)  # picture
    generators = low(22, 23, 24)  # low nibbles of their pictures
    millions = bcd(33)  # of the score; unrelated after the game
    score = bcd((35, 34))  # hundreds
    ship_x = byte(36, 37, 38, 39)  # lowest lane first; 0: absent
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
    damage = _shown_damage(m)
    ships, is_bandit = _ship_boxes(m)
    return {
        "Sentry": _cannon_boxes(m),
        "AcropolisCommandPost": _building(72, 112, 8, damage[0], ruin_width=7),
        "Generator": _generator_boxes(m, damage[1:4]),
        "DomedPalace": _building(38, 148, 16, damage[4], ruin_width=14),
        "BridgedBazaar": _building(96, 159, 16, damage[5], ruin_width=14),
        "AquaPlane": _plane_box(damage[6]),
        "GorgonShip": ships.where(~is_bandit),
        "BanditBomber": ships.where(is_bandit),
        "Explosion": _blast_box(m),
        "Projectile": _shot_boxes(m),
        "Deathray": _death_ray(m),
        "Score": _score_box(m),
    }


def _shown_damage(m: Ram) -> jax.Array:
    """The damage in the frame, still none for a hit on this very frame."""
    just_hit = (m.damage == Damage.HIT) & (m.noise == BUILDING_HIT)
    return jnp.where(just_hit, Damage.STANDS, m.damage)


def _over(m: Ram) -> jax.Array:
    return m.state >= State.OVER


def _blasting(m: Ram) -> jax.Array:
    """True if the explosion of a bandit replaces all ships."""
    just_begun = (m.blast == BLAST_BIT) & (m.flash == BLAST_FLASH)
    return (m.blast >= BLAST_BIT) & ~just_begun


def _cannon_boxes(m: Ram) -> Box:
    """The left and the right cannon, a row lower while they recoil."""
    has_fired = jnp.any((m.shot_speed < 0) & (m.shot_y == NEW_SHOT))
    right = among(m.right_fires, RIGHT_RECOILS) | has_fired
    recoil = when(jnp.stack([m.left_cannon == RECOILING, right]), 1)
    return box(np.array((0, 152)), np.array((124, 112)) + recoil, 8, 8 - recoil, ~_over(m))


def _building(x: Number, y: Number, width: Number, damage: jax.Array, *, ruin_width: int) -> Box:
    """A building, its explosion or its ruins; `ruin_width` is the width while it crumbles."""
    crumbles = damage == Damage.CRUMBLES
    explodes = (damage >= Damage.HIT) & (damage <= Damage.CRUMBLES)
    left = x + when(crumbles, 1)
    top = y + when(damage == Damage.HIT, 1)
    width_left = jnp.where(crumbles, ruin_width, width)
    return box(left, top, width_left, jnp.where(explodes, 7, 8), damage < Damage.GONE)


def _generator_boxes(m: Ram, damage: jax.Array) -> Box:
    """By the post, left, right: the first and the last widen, the left one turns."""
    widens = np.array((1, 0, 1))
    is_last = np.arange(3) == 2
    stands = damage == Damage.STANDS
    narrow = jnp.where(m.generators == NARROW_GENERATOR, widens, 0)
    ruins = jnp.where(is_last & (damage == Damage.LAST_RUIN), 3, 8)
    width = jnp.where(stands, 4 - 2 * narrow, ruins)
    x = np.array((82, 60, 142)) + when(stands, narrow - 2 * widens + 2)
    generators = _building(x, np.array((124, 137, 137)), width, damage, ruin_width=7)
    return generators.clip(0, 0, np.array((160, 160, 148)), 210)


def _plane_box(damage: jax.Array) -> Box:
    inset = pick(damage, (0, 4, 3, 2, 1))
    width = pick(damage, (16, 9, 11, 13, 15))
    top = pick(damage, (171, 172, 171, 170))
    return box(16 + inset, top, width, pick(damage, (7, 3, 6, 8)), damage < Damage.GONE)


def _ships_x(m: Ram) -> jax.Array:
    """Columns of the drawn ships, by lane; not positive without a ship."""
    return position(m.coarse, m.fine) - 1


def _ship_boxes(m: Ram) -> tuple[Box, jax.Array]:
    """The ships and wrecks, and True for bandits."""
    lane, x = _ship_places(m)
    stage = m.ship_stage - when((m.clock & 7) == 0, 1)
    wreck = when(m.ship_hit == 1, jnp.maximum(stage, 0))
    is_bandit = m.ship_kind == Kind.BANDIT
    width = jnp.where(is_bandit, 9, pick(wreck, (15, 11, 13, 15)))
    inset = jnp.where(is_bandit, 4, pick(wreck, (0, 3, 2, 1)))
    to_right = m.ship_right == 1
    left = x - 8 + jnp.where(to_right, 16 - inset - width, inset)
    columns = jnp.where(to_right, left + width - 8, 152 - left)  # in the picture, from the nose
    top, bottom = _ship_rows(m, wreck, columns)
    there = (x > 0) & ~_over(m) & ~_blasting(m)
    ships = box(left, LANE_TOP - LANE_PITCH * lane + top, width, bottom - top, there)
    return ships.clip(*SHOWN), is_bandit


def _ship_places(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Lane and column of each ship; a ship that has just left a lane is still drawn there."""
    x = _ships_x(m)
    left_now = when(m.ship_x == 0, x)
    begun = m.ship_waits == 0
    here = sum(when(begun & (m.ship_lane == i), x[i]) for i in range(4))
    above = sum(when(m.ship_lane == i, left_now[i + 1]) for i in range(3))
    lane = jnp.where(here > 0, m.ship_lane, m.ship_lane + 1)
    return lane, jnp.where(here > 0, here, above)


def _ship_rows(m: Ram, wreck: jax.Array, columns: jax.Array) -> tuple[jax.Array, jax.Array]:
    """First row and last row + 1, in the lane, of a ship with some columns in the picture."""
    is_bandit = m.ship_kind == Kind.BANDIT
    is_flat = is_bandit | (m.ship_kind < Kind.RIGHT_ANGLED)
    small = wreck == 1
    pointed = is_flat & ~is_bandit & (wreck == 0)
    top = when(is_flat | small, 1) + when(pointed, 3 - reached(columns, ROWS_ABOVE))
    bottom = jnp.where(small, 7, 8) - when(pointed, 3 - reached(columns, ROWS_BELOW))
    tip = is_bandit & (columns < 6)
    return jnp.where(tip, 4, top), jnp.where(tip, 5, bottom)


def _blast_box(m: Ram) -> Box:
    stage = m.blast & 7
    half = pick(stage, (3, 6, 9, 11, 13))
    y = pick(m.blast_lane, (80, 60, 40, 28)) - pick(stage, (0, 1, 5, 10, 9))
    there = _blasting(m) & ~_over(m)
    height = pick(stage, (10, 14, 21, 30, 28))
    color = jnp.where(stage == FLASHING_STAGE, m.clock & 14 ^ GOLD, GOLD)
    blast = box(m.blast_x - half, y, 2 * half + 1, height, there, color=color)
    return blast.clip(8, 21, 152, 124)


def _shot_boxes(m: Ram) -> Box:
    """The shots before their last step."""
    y = m.shot_y - jnp.where(m.shot_speed == 0, 3, 2)
    top, is_high = _shot_rows(m, y)
    muzzle = jnp.where(m.shot_speed > 0, np.array(LEFT_MUZZLES), RIGHT_MUZZLE)
    there = (m.shot_y > 0) & (y >= muzzle)
    color = lookup(SHOT_COLORS, jnp.clip(top, 0, 123) + np.arange(2) * 124)
    boxes = box(m.shot_x - m.shot_speed, top, 1, jnp.where(is_high, 2, 1), there, color=color)
    return boxes.clip(8, 0, 152, 124)


def _shot_rows(m: Ram, y: jax.Array) -> tuple[jax.Array, jax.Array]:
    """First rows of the shots at some display lines, and True for those two rows high."""
    is_first = np.arange(2) == 0
    to_right = m.shot_speed > 0
    to_left = m.shot_speed < 0
    is_late = to_right & (y <= LATE_TO_RIGHT)
    late = is_first & (is_late | to_left & among(y, LATE_TO_LEFT))
    early = to_left & (y == EARLY_TO_LEFT)
    usual_top = 205 - y - when(y >= LIFTED, 2) - reached(y, HIGH_LINES)
    top = usual_top + match((late, 1), (early, -1), otherwise=0)
    is_higher = early | is_first & to_right & (y == HIGH_TO_RIGHT)
    return top, (y < 0) | among(y, HIGH_LINES) | is_higher


def _death_ray(m: Ram) -> Box:
    """From the ship in the lowest lane to the deeper land below its two columns."""
    there = (m.ray_x > 0) & (_ships_x(m)[0] > 0) & (m.state == State.PLAY) & ~_blasting(m)
    beam = box(m.ray_x, RAY_TOP, 2, lookup(RAY_ENDS, m.ray_x) - RAY_TOP, there)
    return beam.clip(8, 0, 160, 210)


def _score_box(m: Ram) -> Box:
    count = jnp.max(jnp.where(m.digits == NO_DIGIT, 0, np.arange(1, 7)))
    left = 104 - 8 * count
    right = SCORE_RIGHT - when(m.digits[0] == DIGIT_ONE, 1)
    points = 1000000 * when(m.lives != NO_LIVES, m.millions) + 100 * m.score
    return box(left, SCORE_TOP, right - left, FONT.height, count > 0, value=points)


def _ground_areas() -> tuple[Area, ...]:
    pieces = list(zip(LEFTS, TOPS, LEFTS[1:], strict=False))
    halves = [(at + x, top, at + end, 210) for at in (0, 80) for x, top, end in pieces]
    return tuple(halves[1:])


def _colored(name: str, rule: Bounds | Blobs, *colors: int, **options: Any) -> Category:
    """A category with constant colours: the main one, or one per slot."""
    rgb = tuple(NTSC[c] for c in colors)
    return Category(name, rule, rgb=rgb, **options)


GORGON = Bounds(SHIP, LANES, exclude=("BanditBomber", "Projectile"))
BOMBER = Blobs(SHIP, SKY, Shape(w=9, h=7, pixels=(18, 28)))
CANNONS = Bounds(CANNON, ((0, 124, 8, 132), (152, 112, 160, 120)))
COMMAND = Bounds(POST, (72, 112, 80, 120))
DOME = Bounds(PALACE, (38, 148, 54, 156))
BRIDGE = Bounds(BAZAAR, (96, 159, 112, 167))
SEA_BED = Bounds(PLANE_COLORS, (16, 170, 32, 178))
POWER = Bounds(GENERATOR_COLORS, ((82, 124, 90, 132), (60, 137, 68, 145), (142, 137, 148, 145)))
SHOTS = Blobs(SHOT, SKY, Shape(w=1, h=(1, 2)), gap=(3, 2))
RAY = Bounds(GROUND, (8, 92, 160, 210), ignore=_ground_areas())
SCORE_AREA = (55, SCORE_TOP, SCORE_RIGHT, SCORE_TOP + FONT.height)
SCORE = Bounds(GOLD, SCORE_AREA, value=Digits(FONT, range(56, 104, 8), SCORE_TOP))

GAME = Game(
    name="Atlantis",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        # Each building is a life. The loss of the last one ends the game.
        lives=(
            LivesAsIcons(
                ("AcropolisCommandPost", "Generator", "DomedPalace", "BridgedBazaar", "AquaPlane"),
                hidden=-1,
            ),
        ),
    ),
    categories=(
        _colored("Sentry", CANNONS, 202, count=2, role="player", doc="left and right cannon"),
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
        display("Score", SCORE, role="score", doc="points"),
    ),
)
