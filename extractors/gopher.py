"""Gopher: a farmer guards three carrots from a gopher, which digs tunnels and holes to get them.

Screen: a duck may bring a seed of a single pixel. The farmer catches it and plants it as a carrot.
The grass, the solid dirt and a dash at the left edge are scenery.

Slots: the playfield draws the tunnel and the holes piece by piece, and the slots are these pieces:
Floor has the 40 columns of the tunnel from the left, Hole the three pieces of each of six holes,
the upper row first.

RAM: ALE's source (score, lives), OCAtari 2.2 and D. Debro's disassembly (meaning of the bytes), and
the ROM's code. The duck, the seed, the dirt and the farmer's arms change before a frame is drawn;
the farmer and the gopher move after it. `decode` reverts the gopher's last step.

Covered: modes 0 and 2, all difficulties, ducks and seeds, lost carrots, the end of the game. The
score is not valid on one frame at a game's start, which shows a text instead.

Not exact: the RAM lacks these facts: the farmer's last step by a column, because it does not record
the joystick; the gopher's last column (of a few) when it stops at a hole or leaves the tunnel, and
its direction before it turned at a hole; its position on the frame of a hit; the farmer and the
holes on the last frame before a new round.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    EAST,
    WEST,
    Bounds,
    Box,
    Category,
    Cells,
    Checks,
    Game,
    LivesAsIcons,
    NumberDisplay,
    Pictures,
    RamMap,
    Rom,
    among,
    bcd,
    bits,
    box,
    byte,
    display,
    lookup,
    match,
    when,
)

ROM = Rom("gopher", "c16c79aad6272baffb8aae9a7fff0864")
FONT = ROM.font(0xC01, rows=9, stride=10)

BLACK = 0
BROWN = 240
SAND = 44
YELLOW = 40
SAND_RGB = (223, 183, 85)
CARROT_COLORS = (196, 36, 38, 52)
DUCK_COLORS = (14, 140, 252, 40)

SCORE = NumberDisplay(FONT, right=105, top=10, digits=6)
CARROT_LEFTS = np.array((92, 76, 60))
UNDERGROUND = 148  # first row below the farmer

GOALS = ROM.bytes(0xBEF, 16)  # `gopher_x` at the six holes, the first two again, the carrots
HOLES = 6
DARK = 128  # least `idle` of a black screen
TAUNT_BEGINS = 28  # `taunt`
DIG_NOTE = 113  # of `sounds`
SET_ON_ITS_WAY = 128  # least `plan` of a gopher that does not turn when it digs
WINGS_SPREAD = 0xDC  # `duck_wings`
DUCK_COMES = 32  # `duck_on`


class State:  # of `Ram.state`
    CHOSEN = 6
    PLAY = 7
    TAKEN = 8  # a carrot
    GONE = 9  # the gopher
    EMPTY = 10
    RENEWED = 11


class Clock:  # of `Ram.clock`
    CHOSEN = 16  # a game has just been chosen
    GONE = 136  # the gopher has just gone


class Height:  # of `Ram.height`
    TUNNEL = 0
    UPRIGHT = 7  # least height of an upright gopher
    HALF_WAY = 22
    PEEPING = 34  # out of a hole
    OUTSIDE = 35


class GopherX:  # of `Ram.gopher_x`
    LEFT_END = 3
    START = 147
    RIGHT_END = 148


class SeedY:  # of `Ram.seed_y`
    DUCK = 18  # greatest y of a seed in the rows of the duck
    ABOVE_FARMER = 59
    NONE = 128  # least y of an absent seed


class Phase:  # pictures of the gopher after the pictures for each height
    RUN_2 = 36  # the second phase of its run in the tunnel
    OUTSIDE_2 = 37  # the second phase outside


BLANK = 0xF87  # address of blank rows


def _gopher_rows(height: int) -> np.ndarray:
    """Rows of the gopher's picture from the grass to the bottom of the tunnel.

    The game draws it in three parts: the grass, the upper dirt and the tunnel.
    """
    body = BLANK - height
    feet = body - 12 if height < Height.HALF_WAY else BLANK
    parts = {
        Height.OUTSIDE: (0xFA9, BLANK, BLANK),
        Phase.RUN_2: (BLANK, BLANK, 0xFBA),
        Phase.OUTSIDE_2: (0xFBA, BLANK, BLANK),
    }
    running = (BLANK, BLANK, 0xFAA)
    default = running if height < Height.UPRIGHT else (body + 22, body, feet)
    starts = parts.get(height, default)
    return np.concatenate([ROM.rows(s, n) for s, n in zip(starts, (13, 22, 12), strict=True)])


GOPHERS = Pictures.of(map(_gopher_rows, range(Phase.OUTSIDE_2 + 1)))

# The six registers of a row of dirt. For each register, the bits of the tunnel's columns from left
# to right, and the bits of the holes' first columns.
TUNNEL_BITS = (range(4, 8), range(7, -1, -1), range(8)) * 2
HOLE_BITS = ((7,), (4, 0), (), (), (4, 0), (3,))
HOLE_X = np.tile((12, 28, 44, 108, 124, 140), 3)
HOLE_Y = np.repeat((161, 169, 176), 6)
HOLE_H = np.repeat((8, 7, 7), 6)


class Ram(RamMap):
    dirt = byte(*range(24))  # three rows of holes, the tunnel; a bit per dug column
    duck_wings = byte(24)  # low byte of their picture's address
    duck_x = byte(28)  # x + 12
    player_x = byte(31)  # x + 10
    carrots_drawn = byte(37)  # selects the first carrot
    carrot_copies = bits(38, count=2)  # NUSIZ
    gopher_x = byte(41)  # x + 3 in the tunnel and outside, x + 4 in a hole
    score = bcd((48, 49, 50))
    score_hundreds = bits(49, count=4)
    carrots = byte(52)  # a bit per carrot
    hundreds_shown = byte(64)  # picture of the digit, 10 each
    random = byte(73, 74)
    clock = byte(75)
    idle = byte(76)  # since the last input, 256 frames each
    sounds = byte(77, 78)  # next note of each
    lengths = byte(79, 80)  # frames left of their notes
    channel = bits(81)  # number of the sound that began last
    state = byte(82)
    run_phase = byte(84)  # 0 or 255
    height = byte(85)  # of the gopher above the tunnel's bottom
    mirrored = bits(86, first=3)  # the gopher faces right
    goal = bits(87, count=4)  # index in `GOALS`
    goal_seen = byte(87)
    leftward = bits(87, first=7)  # it runs to the left
    plan = byte(88)  # height of its climb; 0: back down; from 128: it does not turn when it digs
    climb = bits(88, count=4)
    taunt = byte(90)  # frames
    duck_leftward = bits(91, first=7)
    seed_y = byte(92)  # steps; at least 128: no seed
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
        "Score": _score_box(m),
    }
    lit = m.idle < DARK
    return {name: own.where(lit) for name, own in boxes.items()}


def _dug(m: Ram, rows: slice, columns: tuple[tuple[int, ...] | range, ...]) -> jax.Array:
    """True for dirt that is dug, at some bits of the registers in some rows."""
    registers = m.dirt.reshape(4, 6)[rows]
    dots = [registers[:, i : i + 1] >> np.array([b], int) & 1 for i, b in enumerate(columns)]
    return jnp.concatenate(dots, axis=1).ravel() == 1


def _was_hit(m: Ram) -> jax.Array:
    """True if the gopher was hit after the drawing: the score does not show the hit yet."""
    return (m.state == State.PLAY) & (m.hundreds_shown != 10 * m.score_hundreds)


def _gopher(m: Ram) -> Box:
    x, height, faces_right = _as_drawn(m)
    first, top, width, rows = GOPHERS.extent(_gopher_picture(m, height))
    double = among(height, range(Height.UPRIGHT)) | (height == Height.OUTSIDE)
    zoom = jnp.where(double, 2, 1)
    left = x - jnp.where(double, 3, 4) + zoom * jnp.where(faces_right, 8 - first - width, first)
    away = among(m.state, (State.GONE, State.EMPTY, State.RENEWED))
    just_gone = (m.state == State.GONE) & (m.clock == Clock.GONE)
    there = ~away | just_gone
    compass = jnp.where(faces_right, EAST, WEST)
    return box(left, UNDERGROUND + top, zoom * width, rows, there, orientation=compass)


def _gopher_picture(m: Ram, height: jax.Array) -> jax.Array:
    """The picture; the pictures of taunts have the size of the peeping gopher's."""
    running = among(m.height, (Height.TUNNEL, Height.OUTSIDE))
    changed = (m.state == State.PLAY) & running & ((m.clock & 3) == 0)
    second = (m.run_phase != 0) ^ changed
    return match(
        (second & (height == Height.OUTSIDE), Phase.OUTSIDE_2),
        (second & (height == Height.TUNNEL), Phase.RUN_2),
        otherwise=height,
    )


def _as_drawn(m: Ram) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Column, height and direction (True: right) of the gopher as drawn."""
    played = m.state == State.PLAY
    hit = _was_hit(m)
    back_x, back_height, turned = _step_back(m)
    x = match((hit, _hole_of_farmer(m) + m.mirrored), (played, back_x), otherwise=m.gopher_x)
    height = match((hit, Height.PEEPING), (played, back_height), otherwise=m.height)
    return x, height, (m.mirrored == 1) ^ (turned & played & ~hit)


def _step_back(m: Ram) -> tuple[jax.Array, jax.Array, jax.Array]:
    """Column and height of the gopher before its step, and True if it has turned since."""
    x = m.gopher_x
    height = m.height
    at_goal = x == lookup(GOALS, m.goal) + m.mirrored
    emerged = (height == Height.OUTSIDE) & jnp.any(x == GOALS[:HOLES] + m.mirrored)
    planned = (height == Height.TUNNEL) & _has_new_plan(m)
    waits = (height == Height.PEEPING) & (m.taunt < TAUNT_BEGINS)
    climbs = at_goal & (height < Height.OUTSIDE) & ~planned & ~waits
    starts = (x == GopherX.START) & (m.mirrored == 0)
    runs = ~(climbs | emerged | planned | waits | starts)
    stopped = climbs & (m.climb > 0) & (height == Height.TUNNEL + 1)
    before_stop = jnp.where(m.mirrored == 1, x - 3, x + 1)
    old_x = match((stopped, before_stop), (runs, _run_back(m)), otherwise=x)
    old_height = match(
        (climbs, _climb_back(m)),
        (emerged, Height.PEEPING),
        otherwise=height,
    )
    turned = runs & (height == Height.TUNNEL) & _digs(m) & (m.plan < SET_ON_ITS_WAY)
    return old_x, old_height, turned


def _climb_back(m: Ram) -> jax.Array:
    """The height before a step up or down; half-way down it waits for a frame."""
    down = jnp.where(m.height == Height.HALF_WAY, m.height, m.height + 1)
    return jnp.where(m.climb > 0, m.height - 1, down)


def _digs(m: Ram) -> jax.Array:
    """True if the sound of digging has just begun."""
    last = when(np.arange(2) == m.channel, m.sounds)
    return jnp.any((last == DIG_NOTE) & (m.lengths == 0))


def _run_back(m: Ram) -> jax.Array:
    """Column before a step; the gopher leaves at one end and comes back at the other."""
    leftward = m.leftward == 1
    return match(
        (leftward & (m.gopher_x == GopherX.RIGHT_END), GopherX.LEFT_END),
        (leftward, m.gopher_x + 2),
        (m.gopher_x == GopherX.LEFT_END, GopherX.RIGHT_END - 2),
        otherwise=m.gopher_x - 2,
    )


def _hole_of_farmer(m: Ram) -> jax.Array:
    """The hole nearest to the farmer."""
    away = jnp.abs(GOALS[:HOLES] - (m.player_x - 3))
    return jnp.max(jnp.where(away == jnp.min(away), GOALS[:HOLES], 0))


def _has_new_plan(m: Ram) -> jax.Array:
    """True if the gopher has just made a new plan: it is a copy of the random numbers."""
    same_plan = ((m.plan ^ m.random[0]) & 0x7F) == 0
    return same_plan & (((m.goal_seen ^ m.random[1]) & 0x83) == 0)


def _carrots(m: Ram) -> Box:
    """The drawn carrots: the first one from the left, and its copies."""
    first = match((m.carrots_drawn == 0, 0), (m.carrots_drawn == 32, 1), otherwise=2)
    place = 2 - np.arange(3) - first
    second = (m.carrot_copies & 1) == 1
    copy = (place == 0) | ((place == 1) & second) | ((place == 2) & (m.carrot_copies > 1))
    there = (m.carrots > 0) | (m.state == State.TAKEN)
    return box(CARROT_LEFTS, 151, 8, 27, copy & there)


def _duck(m: Ram) -> Box:
    """The duck; spread wings are a column wider than folded ones."""
    wide = m.duck_wings == WINGS_SPREAD
    left = m.duck_x - 12 + jnp.where((m.duck_leftward == 1) | wide, 0, 1)
    compass = jnp.where(m.duck_leftward == 1, WEST, EAST)
    width = jnp.where(wide, 16, 15)
    return box(left, 31, width, 18, (m.duck_on > 0) & ~_duck_to_come(m), orientation=compass)


def _duck_to_come(m: Ram) -> jax.Array:
    """True if a hit that is not drawn yet has made the duck come."""
    return _was_hit(m) & (m.duck_on == DUCK_COMES) & among(m.duck_x, (12, 148))


def _seed(m: Ram) -> Box:
    """The seed. The game switches it on in the middle of a row, and off in the next step's row."""
    y = m.seed_y
    x = m.seed_x - 5
    in_duck = y <= SeedY.DUCK
    at_farmer = y > SeedY.ABOVE_FARMER
    late = when((in_duck & (x < 37)) | (at_farmer & (x < 25)), 1)
    there = (y < SeedY.NONE) & ~_duck_to_come(m)
    top = y + jnp.where(in_duck, 30, 36) + late
    height = match(
        (y == SeedY.DUCK, 7 - late),
        ((y == SeedY.ABOVE_FARMER) & (x < 25), 2),
        otherwise=1,
    )
    return box(x, top, 1, height, there)


def _score_box(m: Ram) -> Box:
    """The score, which lags a frame behind a hit."""
    shown = m.score - when(_was_hit(m), 100)
    just_chosen = (m.state == State.CHOSEN) & (m.clock == Clock.CHOSEN)
    text = (m.state < State.CHOSEN) | just_chosen
    return SCORE.box(jnp.maximum(shown, 0), value=m.score, valid=~text)


FARMER = Bounds((BLACK, SAND), (0, 96, 160, 146), inverse=True)
RODENT = Bounds(BROWN, (0, UNDERGROUND, 160, 195))
BIRD = Bounds(DUCK_COLORS, (0, 31, 160, 49))
PLANTS = Bounds(CARROT_COLORS, tuple((x, 151, x + 8, 178) for x in CARROT_LEFTS.tolist()))
HOLE_AREAS = tuple(
    (int(x), int(y), int(x) + 8, int(y + h)) for x, y, h in zip(HOLE_X, HOLE_Y, HOLE_H, strict=True)
)
PIECES = Bounds((SAND, BROWN), HOLE_AREAS, min_size=(8, 7))
TUNNELS = Cells((SAND, BROWN), tuple(range(0, 160, 4)), (183,) * 40, 4, 12)

GAME = Game(
    name="Gopher",
    rom=ROM,
    ram=Ram,
    decode=decode,
    checks=Checks(
        lives=(LivesAsIcons(("Carrot",)),),
        mirrored={"Bird": None},
    ),
    categories=(
        Category("Player", FARMER, rgb=(84, 92, 214), role="player", doc="the farmer"),
        Category("Gopher", RODENT, attributes=("orientation",), doc="the gopher"),
        Category("Carrot", PLANTS, count=3, doc="carrots, from right to left; lives"),
        Category("Bird", BIRD, attributes=("orientation",), rgb=(236, 236, 236), doc="the duck"),
        Category("Seed", Bounds(SAND, (0, 31, 160, 146)), doc="a seed of a carrot"),
        Category("Hole", PIECES, count=18, rgb=SAND_RGB, doc="dug pieces of six, upper row first"),
        Category("Floor", TUNNELS, count=40, doc="dug columns of the tunnel"),
        display("Score", SCORE.rule(YELLOW, required=True), role="score", doc="points"),
    ),
)
