"""Gopher: a farmer guards three carrots from a gopher, which digs tunnels and holes to get them.

What is dug is drawn by the playfield, piece by piece, and the slots are its pieces: Floor has the
40 columns of the tunnel from the left, Hole the three pieces of each of six holes, the upper row
first. A duck may bring a seed, of a single pixel, which the farmer catches and plants as a carrot.
The grass, the dirt that is not dug and a dash at the left edge are scenery.

RAM: ALE's source (score, lives), OCAtari 2.2 and D. Debro's disassembly (what the bytes are), and
the ROM's code. The duck, the seed, the dirt and the farmer's arms change before a frame is drawn,
the farmer's and the gopher's places after it. `decode` undoes the gopher's last step.

Covered: modes 0 and 2, all difficulties, ducks and seeds, lost carrots, the end of the game. The
score is not valid on the one frame of a game's start that shows a text in its place.
Not in RAM: whether the farmer has just moved by a column, for the joystick is nowhere noted; which
of a few columns the gopher came from when it stops at a hole or leaves the tunnel, and which way it
faced before it turned at a hole; where it was when it has just been hit; the farmer and the holes
on the one frame after which a new round begins.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import among, lookup
from ocjax.console.ram import RamMap, bcd, bits, byte
from ocjax.console.rom import Pictures, Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Bounds, Cells

ROM = Rom("gopher", "c16c79aad6272baffb8aae9a7fff0864")
FONT = ROM.font(0xC01, rows=9, stride=10)

BLACK = 0
GOPHER = 240
DUG = 44
DIGITS = 40
DUG_RGB = (223, 183, 85)
CARROT_COLORS = (196, 36, 38, 52)
DUCK_COLORS = (14, 140, 252, 40)
SCORE_LEFTS = range(57, 105, 8)
SCORE_TOP = 10
CARROT_LEFTS = np.array((92, 76, 60))
UNDERGROUND = 148  # first row below the farmer
EAST = 4
WEST = 12
DARK = 128  # of `idle`: from here on the screen is black

# Values of `state`, and of `clock` when a game was just chosen or the gopher has just gone.
CHOSEN = 6
PLAY = 7
TAKEN = 8
GONE = 9
EMPTY = 10
RENEWED = 11
CHOSEN_AT = 0x10
GONE_AT = 0x88

# Values of `height`: in the tunnel, upright from 7 on, peeping out of a hole, running outside.
TUNNEL = 0
UPRIGHT = 7
HALF_WAY = 22
PEEPING = 34
OUTSIDE = 35
TAUNT = 28  # `taunt` when it begins
# values of `gopher_x`
START = 147
LEFT_END = 3
RIGHT_END = 148
GOALS = ROM.bytes(0xBEF, 16)  # `gopher_x` at the six holes, the first two again, the carrots
HOLES = 6
DIG = 0x71  # value of `sounds`

# What the gopher looks like at each height, and then: the other phase of its run in the tunnel
# and outside, two phases of its taunt.
RUN_2 = 36
OUTSIDE_2 = 37
TAUNT_1 = 38
TAUNT_2 = 39
NOTHING = 0xF87  # blank rows


def _gopher_rows(height: int) -> np.ndarray:
    """Rows of the gopher's picture from the grass to the bottom of the tunnel.

    The game draws it in three parts: the grass, the upper dirt and the tunnel.
    """
    upright = NOTHING - height
    upright_feet = upright - 12 if height < HALF_WAY else NOTHING
    parts = {
        OUTSIDE: (0xFA9, NOTHING, NOTHING),
        RUN_2: (NOTHING, NOTHING, 0xFBA),
        OUTSIDE_2: (0xFBA, NOTHING, NOTHING),
        TAUNT_1: (0xFCA, NOTHING - PEEPING, NOTHING),
        TAUNT_2: (0xFD9, NOTHING - PEEPING, NOTHING),
    }
    running = (NOTHING, NOTHING, 0xFAA)
    default = running if height < UPRIGHT else (upright + 22, upright, upright_feet)
    starts = parts.get(height, default)
    return np.concatenate([ROM.rows(s, n) for s, n in zip(starts, (13, 22, 12), strict=True)])


GOPHERS = Pictures.of(map(_gopher_rows, range(TAUNT_2 + 1)))

# The six registers of a row of dirt: the bits of each from left to right that hold the columns of
# the tunnel, and the first columns of the holes.
TUNNEL_BITS = (range(4, 8), range(7, -1, -1), range(8)) * 2
HOLE_BITS = ((7,), (4, 0), (), (), (4, 0), (3,))
HOLE_X = np.tile((12, 28, 44, 108, 124, 140), 3)
HOLE_Y = np.repeat((161, 169, 176), 6)
HOLE_H = np.repeat((8, 7, 7), 6)


class Ram(RamMap):
    dirt = byte(*range(24))  # three rows of holes, the tunnel; a bit for each column that is dug
    duck_wings = byte(24)  # low byte of their picture's address
    duck_x = byte(28)  # x + 12
    player_x = byte(31)  # x + 10
    carrots_drawn = byte(37)  # tells the first one
    carrot_copies = bits(38, count=2)  # NUSIZ
    gopher_x = byte(41)  # x + 3 in the tunnel and outside, x + 4 in a hole
    score = bcd((48, 49, 50))
    score_hundreds = bits(49, count=4)
    carrots = byte(52)  # a bit a carrot
    hundreds_shown = byte(64)  # picture of the digit, 10 for each
    random = byte(73, 74)
    clock = byte(75)
    idle = byte(76)  # 256 frames each since the joystick was moved
    sounds = byte(77, 78)  # next notes of both
    lengths = byte(79, 80)  # frames left of their notes
    channel = bits(81)  # which of the sounds began last
    state = byte(82)
    run_phase = byte(84)  # 0 or 255
    height = byte(85)  # of the gopher above the tunnel's bottom
    mirrored = bits(86, first=3)  # the gopher faces right
    goal = bits(87, count=4)  # where it goes
    goal_seen = byte(87)
    leftward = bits(87, first=7)  # it runs to the left
    plan = byte(88)  # how high it will climb: 0 back down; 128 or more: it does not turn on digging
    climb = bits(88, count=4)
    taunt = byte(90)  # frames
    duck_leftward = bits(91, first=7)
    seed_y = byte(92)  # steps; 128 or more: none
    duck_on = byte(94)
    seed_x = byte(95)  # x + 5


def decode(m: Ram) -> dict[str, Box]:
    boxes = {
        "Player": box(m.player_x - 10, 96, 13, 50),
        "Gopher": _gopher(m),
        "Carrot": _carrots(m),
        "Bird": _duck(m),
        "Seed": _seed(m),
        "Hole": box(HOLE_X, HOLE_Y, 8, HOLE_H, _dug(m, slice(3), HOLE_BITS)),
        "Floor": box(4 * np.arange(40), 183, 4, 12, _dug(m, slice(3, 4), TUNNEL_BITS)),
        "Score": _score(m),
    }
    lit = m.idle < DARK
    return {name: own.where(lit) for name, own in boxes.items()}


def _dug(m: Ram, rows: slice, columns: tuple[tuple[int, ...] | range, ...]) -> jax.Array:
    """Whether the dirt is dug at some bits of the registers in some rows."""
    registers = m.dirt.reshape(4, 6)[rows]
    dots = [registers[:, i : i + 1] >> np.array([b], int) & 1 for i, b in enumerate(columns)]
    return jnp.concatenate(dots, axis=1).ravel() == 1


def _hit(m: Ram) -> jax.Array:
    """Whether the gopher was hit after the frame was drawn: the score does not show it yet."""
    return (m.state == PLAY) & (m.hundreds_shown != 10 * m.score_hundreds)


def _gopher(m: Ram) -> Box:
    x, height, mirrored = _gopher_drawn(m)
    picture = _gopher_picture(m, height)
    first, top, width, rows = GOPHERS.extent(picture)
    double = among(height, range(UPRIGHT)) | (height == OUTSIDE)
    zoom = jnp.where(double, 2, 1)
    left = x - jnp.where(double, 3, 4) + zoom * jnp.where(mirrored, 8 - first - width, first)
    there = ~among(m.state, (GONE, EMPTY, RENEWED)) | ((m.state == GONE) & (m.clock == GONE_AT))
    facing = jnp.where(mirrored, EAST, WEST)
    return box(left, UNDERGROUND + top, zoom * width, rows, there, orientation=facing)


def _gopher_picture(m: Ram, height: jax.Array) -> jax.Array:
    running = (m.height == TUNNEL) | (m.height == OUTSIDE)
    changed = (m.state == PLAY) & running & ((m.clock & 3) == 0)
    second = (m.run_phase != 0) ^ changed
    picture = jnp.where(second & (height == TUNNEL), RUN_2, height)
    picture = jnp.where(second & (height == OUTSIDE), OUTSIDE_2, picture)
    left = m.taunt + 1
    taunts = (m.height == PEEPING) & (left <= TAUNT)
    taunt = jnp.where(among(left, (*range(7, 14), *range(21, 29))), TAUNT_1, TAUNT_2)
    return jnp.where(taunts, taunt, picture)


def _gopher_drawn(m: Ram) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Where the gopher was drawn, at what height and whether facing right."""
    x, height, mirrored = m.gopher_x, m.height, m.mirrored
    at_goal = x == lookup(GOALS, m.goal) + mirrored
    emerged = (height == OUTSIDE) & jnp.any(x == GOALS[:HOLES] + mirrored)
    planned = (height == TUNNEL) & _planned(m)
    waits = (height == PEEPING) & (m.taunt < TAUNT)
    climbs = at_goal & (height < OUTSIDE) & ~planned & ~waits
    starts = (x == START) & (mirrored == 0)
    runs = ~(climbs | emerged | planned | waits | starts)
    stopped = climbs & (m.climb > 0) & (height == TUNNEL + 1)

    drawn_x = jnp.where(runs, _run_back(m), x)
    drawn_x = jnp.where(stopped, jnp.where(mirrored == 1, x - 3, x + 1), drawn_x)
    down = jnp.where(height == HALF_WAY, height, height + 1)  # it waits for a frame there
    below = jnp.where(m.climb > 0, height - 1, down)
    drawn_height = jnp.where(climbs, below, jnp.where(emerged, PEEPING, height))
    sound = jnp.where(np.arange(2) == m.channel, m.sounds, 0)
    dug = jnp.any((sound == DIG) & (m.lengths == 0))
    turned = runs & (height == TUNNEL) & dug & (m.plan < 128)

    played, hit = m.state == PLAY, _hit(m)
    drawn_x = jnp.where(hit, _hole_of_farmer(m) + mirrored, jnp.where(played, drawn_x, x))
    drawn_height = jnp.where(hit, PEEPING, jnp.where(played, drawn_height, height))
    return drawn_x, drawn_height, (mirrored == 1) ^ (turned & played & ~hit)


def _run_back(m: Ram) -> jax.Array:
    """Where the gopher was before a step; it leaves at one end and comes back at the other."""
    left = m.leftward == 1
    back = jnp.where(left, m.gopher_x + 2, m.gopher_x - 2)
    back = jnp.where(left & (m.gopher_x == RIGHT_END), LEFT_END, back)
    return jnp.where(~left & (m.gopher_x == LEFT_END), RIGHT_END - 2, back)


def _hole_of_farmer(m: Ram) -> jax.Array:
    """The hole that is nearest to the farmer."""
    away = jnp.abs(GOALS[:HOLES] - (m.player_x - 3))
    return jnp.max(jnp.where(away == jnp.min(away), GOALS[:HOLES], 0))


def _planned(m: Ram) -> jax.Array:
    """Whether the gopher has just made a new plan: it is a copy of the random numbers."""
    return (((m.plan ^ m.random[0]) & 0x7F) == 0) & (((m.goal_seen ^ m.random[1]) & 0x83) == 0)


def _carrots(m: Ram) -> Box:
    """The carrots as they are drawn: the first one from the left, and copies of it."""
    first = jnp.where(m.carrots_drawn == 0, 0, jnp.where(m.carrots_drawn == 32, 1, 2))
    place = 2 - np.arange(3) - first
    second = (m.carrot_copies & 1) == 1
    copy = (place == 0) | ((place == 1) & second) | ((place == 2) & (m.carrot_copies > 1))
    there = (m.carrots > 0) | (m.state == TAKEN)
    return box(CARROT_LEFTS, 151, 8, 27, copy & there)


def _duck(m: Ram) -> Box:
    """The duck."""
    wide = m.duck_wings == 0xDC
    left = m.duck_x - 12 + jnp.where((m.duck_leftward == 1) | wide, 0, 1)
    facing = jnp.where(m.duck_leftward == 1, WEST, EAST)
    width = jnp.where(wide, 16, 15)
    return box(left, 31, width, 18, (m.duck_on > 0) & ~_duck_to_come(m), orientation=facing)


def _duck_to_come(m: Ram) -> jax.Array:
    """Whether the hit that is not drawn yet has made the duck come."""
    return _hit(m) & (m.duck_on == 32) & ((m.duck_x == 12) | (m.duck_x == 148))


def _seed(m: Ram) -> Box:
    """The seed. The game switches it on in the middle of a row, and off in that of the next."""
    y, x = m.seed_y, m.seed_x - 5
    in_duck, at_farmer = y <= 18, y >= 60
    late = jnp.where((in_duck & (x < 37)) | (at_farmer & (x < 25)), 1, 0)
    there = (y < 128) & ~_duck_to_come(m)
    top = y + jnp.where(in_duck, 30, 36) + late
    height = jnp.where(y == 18, 7 - late, jnp.where((y == 59) & (x < 25), 2, 1))
    return box(x, top, 1, height, there)


def _score(m: Ram) -> Box:
    """The score, which lags behind by a frame where the gopher was hit."""
    shown = m.score - jnp.where(_hit(m), 100, 0)
    text = (m.state < CHOSEN) | ((m.state == CHOSEN) & (m.clock == CHOSEN_AT))
    return score_box(
        FONT,
        jnp.maximum(shown, 0),
        right=SCORE_LEFTS[-1] + FONT.width,
        top=SCORE_TOP,
        digits=6,
        value=m.score,
        valid=~text,
    )


FARMER = Bounds((BLACK, DUG), (0, 96, 160, 146), inverse=True)
RODENT = Bounds(GOPHER, (0, UNDERGROUND, 160, 195))
DUCK = Bounds(DUCK_COLORS, (0, 31, 160, 49))
CARROTS = Bounds(CARROT_COLORS, tuple((int(x), 151, int(x) + 8, 178) for x in CARROT_LEFTS))
HOLES_SEEN = tuple(
    (int(x), int(y), int(x) + 8, int(y + h)) for x, y, h in zip(HOLE_X, HOLE_Y, HOLE_H, strict=True)
)
PIECES = Bounds((DUG, GOPHER), HOLES_SEEN, min_size=(8, 7))
TUNNELS = Cells((DUG, GOPHER), tuple(range(0, 160, 4)), (183,) * 40, 4, 12)
SCORE = Bounds(DIGITS, (57, 10, 105, 19), value=Digits(FONT, SCORE_LEFTS, SCORE_TOP, required=True))

GAME = Game(
    name="Gopher",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", FARMER, rgb=(84, 92, 214), doc="the farmer"),
        Category("Gopher", RODENT, attributes=("orientation",), doc="the gopher"),
        Category("Carrot", CARROTS, count=3, doc="carrots, from right to left; lives"),
        Category("Bird", DUCK, attributes=("orientation",), rgb=(236, 236, 236), doc="the duck"),
        Category("Seed", Bounds(DUG, (0, 31, 160, 146)), doc="a seed of a carrot"),
        Category("Hole", PIECES, count=18, rgb=DUG_RGB, doc="dug pieces of six, upper row first"),
        Category("Floor", TUNNELS, count=40, doc="dug columns of the tunnel"),
        display("Score", SCORE, doc="points"),
    ),
)
