"""Ms. Pac-Man: a maze of pills, four power pills, up to four ghosts, a fruit that wanders through.

Score, lives and the level's fruit stand below. The walls, all other pixels in the pills' colour,
are scenery. A slot of Pill is a place that has a pill in any of the four mazes. Ghosts on the same
rows, also in one place of the pen, share a sprite and are drawn in turn, as are fruit and player;
of the power pills the left and the right ones are drawn for eight frames each. The `value` of Score
is the emulator's: the extra life at 10,000 points is a 1 in the last digit, which shows as 0.

RAM: OCAtari, AtariARI and ALE; the rest was read from the ROM. The screen shows the positions from
before the frame's last move, so `decode` takes that move back. The RAM has a bit for every place of
every row, the same in all mazes; where the maze has a wall, the bit says nothing.

Covered: four mazes, seven fruits, modes 0 to 3 (four, one, two, three ghosts), start, deaths, pen,
tunnels (the larger part of whoever is cut in two), game over. Not in RAM: which way somebody came
around a corner or to a wall, when a slower stretch after a pill ends, where a life ended on the one
frame on which the next begins. The player is 1-2 pixels off in 4 % of frames, a ghost in 1-2 %.
"""

import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.console.boxes import Box, box
from ocjax.console.fonts import Digits, score_box
from ocjax.console.ops import among, div, lookup, mod, pick
from ocjax.console.ram import RamMap, bcd, bits, byte, high
from ocjax.console.registers import larger_part
from ocjax.console.rom import Rom
from ocjax.extraction.game import Category, Game, display
from ocjax.vision.rules import Blobs, Bounds, Cells, Gauge
from ocjax.vision.shapes import Shape

ROM = Rom("ms_pacman", "87e79cd41ce136fd4f72cc6e2c161bee")
FONT = ROM.font(0x92B, rows=7, stride=8)
# Three pictures of the player for each way, then the seven fruits, 12 empty rows below each.
PICTURES = ROM.pictures(range(0xE0C, 0xE0C + 19 * 22, 22), 10, top_first=True)
FIRST_FRUIT = 12
UP, RIGHT, DOWN, LEFT = range(4)  # ways
# modes of a ghost
EYES = 4
EYES_ENTER_PEN = 6
IN_PEN = 7
MOVES = 255  # `event` while everything moves
NEW_LIFE = 35  # `event` from the start of another life or level on
DYING = range(0x4E, 0x80)  # `event` while the player turns around
SLOWED = 2  # `chews` of the player after a pill
EATS = 3  # and on the frame on which it was eaten

# The ways out of every place, a bit each from UP in the highest: by maze, row and column. The two
# halves of a maze mirror each other, and only the left one is here, with two columns beyond it.
EXITS = ROM.bytes(0x1E27, 4 * 14 * 6)
PLACE_BITS = (6, 15, 13, 11, 9, 16, 18, 20, 22, 14, 12, 10, 8, 17, 19, 21, 23, 4)  # by column


def _places() -> np.ndarray:
    """Which places have a pill at first, bool `[maze, row, column]`: all that have a way out."""
    ways = np.stack([EXITS >> 4, EXITS & 15], axis=-1).reshape(4, 14, 12)
    half = ways[:, :, 2:11] != 0
    half[:, (1, 12), 0] = False  # the power pills'
    half[:, 5:8, 8] = False  # beside the pen's door
    return np.concatenate([half, half[:, :, ::-1]], axis=2)


PLACES = _places()
MASKS = (PLACES << np.array(PLACE_BITS)).sum(axis=2).astype(np.int32)  # bits by maze and row
USED = np.asarray(PLACES.any(axis=0))

# The fruit's paths, two bits a step: four of every maze, and last the way around the pen.
FRUIT_PATHS = ROM.data[0x1D6A:0x1DAE].view(">i4")
AROUND_PEN = len(FRUIT_PATHS) - 1
# How many rows the fruit bounces down in each of eight phases: to the side, down, up.
BOUNCES = ROM.data[0x1DB2:0x1DCA].view(np.int8)
BOUNCE_ASIDE, BOUNCE_DOWN, BOUNCE_UP = range(0, 24, 8)
# Of 16 frames, a bit for those on which each of the ghosts takes a second step.
SECOND_STEPS = np.array((0, 0x0040, 0x0404, 0x1101), np.int32)
PEN_LEFT = 0x52
PEN_MIDDLE = 0x58
PEN_RIGHT = 0x5E
PEN_TOP = 0x42
PEN_BOTTOM = 0x50

# colours
MAZES = (74, 138, 8, 214)
GHOSTS = (38, 184, 88, 70)
SCARED = 150
ENDING = 12
FRUITS = (68, 68, 54, 22, 68, 214, 40)
PLAYER = 42
LIFE = 24
SCORE = 40
FIELD = (0, 2, 160, 171)
ICON_FIELD = (100, 172, 160, 184)
COLUMNS = (*range(8, 80, 8), *range(84, 156, 8))
PILL_X = tuple(COLUMNS[column] for _, column in np.argwhere(USED).tolist())
PILL_Y = tuple(7 + 12 * row for row, _ in np.argwhere(USED).tolist())
POWER_X = (148, 148, 8, 8)
POWER_Y = (146, 14, 147, 15)


class Ram(RamMap):
    maze = bits(0, count=2)
    ghost_way = bits(1, 2, 3, 4, count=2)  # in the pen: rounds to go
    ghost_leaves = bits(1, 2, 3, 4, first=3)  # the pen
    ghost_mode = bits(1, 2, 3, 4, first=4, count=3)
    ghost_scared = bits(1, 2, 3, 4, first=7)
    way = bits(5, count=2)
    fruit_path = bits(5, first=2, count=2)
    chews = bits(5, first=6, count=2)
    ghost_x = byte(6, 7, 8, 9)  # x + 12
    x = byte(10)  # x + 12
    fruit_x = byte(11)  # x + 12; 0: no fruit
    ghost_y = byte(12, 13, 14, 15)  # y - 1
    y = byte(16)  # y - 1
    fruit_y = byte(17)  # y - 1
    waits = high(18)  # a bit a ghost, the last first: on every other call it moves in a tunnel
    ghosts = byte(19)  # in play, minus 1
    demo = bits(20, first=7)
    frame = byte(30)
    fruit_step = bits(31, count=5)
    fruit_enters = bits(31, first=6)
    fruit_loops = bits(31, first=7)  # goes around the pen
    event = byte(39)  # counts through music, pauses and deaths
    pills = byte(*((i + 2, i + 1, i) for i in range(59, 101, 3)))  # by row
    scare = byte(116)  # time left
    power = bits(117, first=2, count=4)
    fruit_phase = bits(118, first=3, count=3)
    eaten = byte(119)  # pills, in this maze
    score = bcd((122, 121, 120))  # its last digit, shown as 0: the extra life was given
    lives = bits(123, count=3)  # without the last one
    icons = bits(123, count=2)
    fruit = high(123)  # of the level


def decode(m: Ram) -> dict[str, Box]:
    playing, i3 = m.demo == 0, np.arange(3)
    fruits, maze = _fruits(m), pick(m.maze, MAZES)
    icons = (m.ghosts >= i3) & (m.ghosts < 3)
    power = playing & ((m.power >> np.arange(4) & 1) == 1)
    return {
        "Player": _player(m),
        "Ghost": _ghosts(m),
        "PowerPill": box(np.array(POWER_X), np.array(POWER_Y), 4, 7, power, color=maze),
        "Pill": box(np.array(PILL_X), np.array(PILL_Y), 4, 2, _pills(m) & playing, color=maze),
        "Fruit": fruits[:1],
        "FruitIcon": fruits[1:],
        "GhostIcon": box(138 - 15 * m.ghosts + 16 * i3, 173, 8, 10, icons),
        "Score": score_box(FONT, m.score, right=103, top=187, digits=6, value=m.score),
        "Life": box(12, 173, 16 * m.icons - 9, 10, m.icons > 0, value=m.lives + 1),
    }


def _player(m: Ram) -> Box:
    last, dying = m.frame - 1, _dying(m)
    chew = pick(last >> 2 & 3, (0, 1, 2, 1))
    way = jnp.where(dying, last >> 3 & 3, m.way)  # she dies turning round and round
    (x, y), picture = _player_before(m), 3 * way + jnp.where(dying, 1, chew)
    return _picture(picture, larger_part(x - 12, 8), y + 1, orientation=4 * way)


def _ghosts(m: Ram) -> Box:
    number, (x, y) = np.arange(4), _ghosts_before(m)
    eyes = (m.ghost_scared == 0) & ((m.ghost_mode == EYES) | (m.ghost_mode == EYES_ENTER_PEN))
    # The first row of the eyes is empty; that of a ghost is not drawn on the places' own lines.
    late = jnp.where(eyes | (mod(y, 12) == 0), 1, 0)
    kind = jnp.where(m.ghost_scared == 1, jnp.where(m.scare & 0x32 == 0, 5, 4), number)
    color = pick(kind, (*GHOSTS, SCARED, ENDING))
    height = jnp.where(eyes, 5, 10 - late)
    there = (number <= m.ghosts) & ~_dying(m)
    return box(larger_part(x - 12, 8), y + 1 + late, 8, height, there, color=color)


def _pills(m: Ram) -> jax.Array:
    free = jnp.asarray(MASKS[3])
    for maze in range(3):
        free = jnp.where(m.maze == maze, MASKS[maze], free)
    rows = m.pills & free
    bit = np.int32(1) << np.array(PLACE_BITS, np.int32)
    return jnp.concatenate([rows[i] & bit[USED[i]] for i in range(len(USED))]) != 0


def _fruits(m: Ram) -> Box:
    """The one in the maze, and the level's below it."""
    x, y = _fruit_before(m)
    x = jnp.stack([larger_part(x - 12, 8), jnp.int32(126)])
    y = jnp.stack([y + 1, jnp.int32(173)])
    there = jnp.stack([(m.fruit_x > 0) & ~_dying(m), m.ghosts == 3])
    color = pick(m.fruit, FRUITS)
    return _picture(FIRST_FRUIT + m.fruit, x, y, valid=there, color=color)


def _picture(index: jax.Array, x: jax.Array, y: jax.Array, **fields: Any) -> Box:
    left, top, width, height = PICTURES.extent(index)
    lost = jnp.where((mod(y, 12) == 6) & (top + height == 10), 1, 0)  # the last row, on some lines
    return box(x + left, y + top, width, height - lost, **fields)


def _dying(m: Ram) -> jax.Array:
    """Whether the player turns around; as the next life begins, the frame still shows that."""
    phase = m.frame & 7
    reborn = (m.event == NEW_LIFE) & (phase == 1) & (m.eaten > 0)
    return among(m.event - jnp.where(phase == 0, 1, 0), DYING) | reborn


def _moving(m: Ram) -> jax.Array:
    return (m.event == MOVES) & (m.demo == 0)


def _step(way: jax.Array) -> tuple[jax.Array, jax.Array]:
    """One pixel that way."""
    sideways = (way & 1) == 1
    return jnp.where(sideways, 2 - way, 0), jnp.where(sideways, 0, way - 1)


def _player_before(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The player moves on even frames unless a wall has been ahead."""
    (dx, dy), sideways = _step(m.way), m.way & 1
    moves = _moving(m) & ((m.frame & 1) == 0) & (~_stands(m) | (m.chews == EATS))
    steps = jnp.where((m.frame & 2) > 0, 2 - sideways, jnp.where(m.chews == SLOWED, 1, 2))
    steps = jnp.where(moves, steps, 0)
    return m.x - steps * dx, m.y - steps * dy


def _stands(m: Ram) -> jax.Array:
    """Whether the player is in the middle of a place that has no exit ahead."""
    sideways, right = (m.way & 1) == 1, m.x >= 0x60
    column = jnp.where(right, 21 - (m.x >> 3), m.x >> 3)
    pair = lookup(EXITS, 84 * m.maze + 6 * div(m.y, 12) + (column >> 1))
    exits = jnp.where((column & 1) == 1, pair, pair >> 4)
    ahead = jnp.where(right & sideways, m.way ^ 2, m.way)  # mirrored
    in_half = jnp.where(right, (m.x & 7) == 6, m.x == PEN_MIDDLE)
    in_middle = jnp.where(m.x < PEN_MIDDLE, (m.x & 7) == 2, in_half)
    in_middle = jnp.where(sideways, in_middle, mod(m.y, 12) == 2)
    return in_middle & ((exits >> (3 - ahead) & 1) == 0)


def _ghosts_before(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Ghosts move on odd frames, one or two pixels."""
    steps = _ghost_steps(m)
    (way_x, way_y), x, y = _step(m.ghost_way), m.ghost_x, m.ghost_y
    in_pen, enters = m.ghost_mode == IN_PEN, m.ghost_mode == EYES_ENTER_PEN
    for n in (1, 2):
        pen_x, pen_y = _pen_step(x, y, m.ghost_leaves == 1)
        dx = jnp.where(in_pen, pen_x, jnp.where(enters, 0, way_x))
        dy = jnp.where(in_pen, pen_y, jnp.where(enters, 1, way_y))
        x = jnp.where(steps >= n, x - dx, x)
        y = jnp.where(steps >= n, y - dy, y)
    return x, y


def _ghost_steps(m: Ram) -> jax.Array:
    number, sideways, scared = np.arange(4), (m.ghost_way & 1) == 1, m.ghost_scared == 1
    second = (SECOND_STEPS >> (m.frame & 14) & 1) > 0
    second = second | (~sideways & (((m.frame + number) & 2) > 0)) | (m.ghost_mode == EYES)
    steps = jnp.where(second & ~scared, 2, 1)
    in_tunnel = (m.ghost_x < 0x12) | (m.ghost_x >= 0xAB)
    waits = m.waits >> (3 - number) & 1
    steps = jnp.where(in_tunnel, jnp.where(steps == 2, 1, 1 - waits), steps)
    rests = (m.fruit == 0) & ((m.frame & 30) == 30)
    rests = rests | (scared & sideways & ((m.frame & 6) == 0))
    return jnp.where(_moving(m) & ((m.frame & 1) == 1) & ~rests, steps, 0)


def _pen_step(x: jax.Array, y: jax.Array, leaves: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The last step of a ghost in the pen: round against the clock, or out by the middle."""
    left, bottom = (x == PEN_LEFT) & (y > PEN_TOP), (y == PEN_BOTTOM) & (x > PEN_LEFT)
    right = (x == PEN_RIGHT) & (y < PEN_BOTTOM)
    up = jnp.where(leaves, y < PEN_TOP, right)
    around_x = jnp.where(left, 0, jnp.where(bottom, 1, -1))
    dx = jnp.where(up, 0, jnp.where(leaves, -1, around_x))
    dy = jnp.where(up, -1, jnp.where(left & ~leaves, 1, 0))
    return dx, dy


def _fruit_before(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The fruit moves on every fourth frame: its path says the way, and it bounces."""
    loops = m.fruit_loops == 1
    leaves = ~loops & (m.fruit_enters == 0)
    path = lookup(FRUIT_PATHS, jnp.where(loops, AROUND_PEN, 4 * m.maze + m.fruit_path))
    way = jnp.where(m.fruit_step < 16, path >> (30 - 2 * (m.fruit_step & 15)) & 3, UP)
    way = jnp.where(leaves, way ^ 2, way)  # the same path backwards
    phase = jnp.where(leaves, 7 - m.fruit_phase, m.fruit_phase)
    bounces = jnp.where(way == DOWN, BOUNCE_DOWN, BOUNCE_UP)
    bounces = jnp.where((way & 1) == 1, BOUNCE_ASIDE, bounces)
    moved = _moving(m) & ((m.frame & 3) == 0)
    dx, dy = _step(way)[0], lookup(BOUNCES, bounces + phase)
    bounced = moved & (loops | (m.fruit_step > 0))
    return m.fruit_x - jnp.where(moved, dx, 0), m.fruit_y - jnp.where(bounced, dy, 0)


sprites = functools.partial(Blobs, shapes=Shape(w=(4, 8), h=(5, 10)))
GHOST_RULE = sprites((*GHOSTS, SCARED, ENDING), FIELD, gap=(2, 0))
POWER_RULE = Cells(MAZES, POWER_X, POWER_Y, 4, 7, margin=(2, 0))
PILL_RULE = Cells(MAZES, PILL_X, PILL_Y, 4, 2, whole=False, margin=(2, 1))
fruit_in = functools.partial(Blobs, (68, 54, 22, 214, 40), shapes=Shape(w=(5, 8), h=(8, 10)))
ICONS = sprites(GHOSTS[0], ICON_FIELD)
POINTS = Bounds(SCORE, (48, 186, 104, 195), value=Digits(FONT, range(55, 103, 8), 187))
LIVES = Bounds(LIFE, (0, 172, 100, 184), value=Gauge(16, 7, 2))

GAME = Game(
    name="MsPacman",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", sprites(PLAYER, FIELD), attributes=("orientation",), doc="Ms. Pac-Man"),
        Category("Ghost", GHOST_RULE, count=4, blinks=True, doc="orange, cyan, pink, red"),
        Category("PowerPill", POWER_RULE, count=4, blinks=True, doc="two right, two left"),
        Category("Pill", PILL_RULE, count=len(PILL_X), doc="places of all mazes"),
        Category("Fruit", fruit_in(FIELD), doc="in the maze"),
        display("FruitIcon", fruit_in(ICON_FIELD), attributes=(), doc="the level's, below"),
        display("GhostIcon", ICONS, count=3, attributes=(), doc="as many as ghosts in modes 1-3"),
        display("Score", POINTS, doc="points"),
        display("Life", LIVES, doc="all icons; value: lives"),
    ),
)
