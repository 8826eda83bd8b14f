"""Ms. Pac-Man: a maze of pills, four power pills, up to four ghosts, a fruit that wanders through.

Picture: docs/games/MsPacman.png

Screen: score, lives and the level's fruit are below the maze. The walls, all other pixels in the
pills' colour, are terrain. Ghosts on the same rows, also at one position in the pen, share a sprite
and alternate, and so do fruit and player. The left power pills and the right ones alternate, eight
frames each.

Slots: a slot of Pill is a position with a pill in any of the four mazes.

RAM: OCAtari, AtariARI and ALE; the rest was read from the ROM. The screen shows the positions
before the frame's last move, so `decode` undoes that move. The RAM has one bit per position of
every row, the same in all mazes; the bit has no meaning at a wall of the maze.

Covered: four mazes, seven fruits, modes 0 to 3 (four, one, two, three ghosts), start, deaths, pen,
tunnels (the larger part of a figure cut in two), game over. The `value` of Score is the emulator's:
the extra life at 10,000 points is a 1 in the last digit, which shows as 0.

Terrain: the walls, from the ROM's table of the four mazes; exact.

Not exact: the RAM does not record the direction a figure turned from at a corner or a wall, or when
a slow-down after a pill ends. On the one frame on which the next life begins, it does not record
where the last one ended. The player is 1-2 pixels off in 4 % of frames, a ghost in 1-2 %.
"""

import functools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Box,
    Category,
    Cells,
    Game,
    IconRow,
    NumberDisplay,
    RamMap,
    Rom,
    Shape,
    TerrainKind,
    TerrainMap,
    Variants,
    among,
    area_mask,
    bcd,
    bits,
    box,
    byte,
    display,
    div,
    flag,
    high,
    larger_part,
    lookup,
    match,
    mod,
    pick,
    playfield,
    when,
)

ROM = Rom("ms_pacman", "87e79cd41ce136fd4f72cc6e2c161bee")
FONT = ROM.font(0x92B, rows=7, stride=8)
# Three pictures of the player for each direction, then the seven fruits, 12 empty rows apart.
PICTURES = ROM.pictures(range(0xE0C, 0xE0C + 19 * 22, 22), 10, top_first=True)
FIRST_FRUIT = 12


class Way:  # of `Ram.way` and `ghost_way`: clockwise, from up; odd ones go sideways
    UP = 0
    DOWN = 2


class Mode:  # of `Ram.ghost_mode`
    EYES = 4
    EYES_ENTER_PEN = 6
    IN_PEN = 7


class Event:  # of `Ram.event`
    NEW_LIFE = 35  # at the start of another life or level
    DYING = range(78, 128)  # the player turns around
    MOVES = 255  # everything moves


class Chew:  # of `Ram.chews`
    SLOWED = 2  # after a pill
    EATS = 3  # on the frame on which it is eaten


# The exits of every position, one bit each, UP in the highest: by maze, row and column. The two
# halves of a maze mirror each other. The table has the left half, with two columns beyond it.
EXITS = ROM.bytes(0x1E27, 4 * 14 * 6)
PLACE_BITS = (6, 15, 13, 11, 9, 16, 18, 20, 22, 14, 12, 10, 8, 17, 19, 21, 23, 4)  # by column


def _places() -> np.ndarray:
    """Positions with a pill at first, bool `[maze, row, column]`: all positions with an exit."""
    ways = np.stack([EXITS >> 4, EXITS & 15], axis=-1).reshape(4, 14, 12)
    row = np.arange(14)[:, None]
    column = np.arange(9)
    is_power_pill = np.isin(row, (1, 12)) & (column == 0)
    is_at_door = np.isin(row, (5, 6, 7)) & (column == 8)  # of the pen
    half = (ways[:, :, 2:11] != 0) & ~is_power_pill & ~is_at_door
    return np.concatenate([half, half[:, :, ::-1]], axis=2)


PILL_PLACES = _places()
MASKS = (PILL_PLACES << np.array(PLACE_BITS)).sum(axis=2).astype(np.int32)  # bits by maze and row
USED = np.asarray(PILL_PLACES.any(axis=0))  # positions with a pill in any maze

# The fruit's paths, two bits per step: four for every maze, and last the way around the pen.
FRUIT_PATHS = ROM.data[0x1D6A:0x1DAE].view(">i4")
AROUND_PEN = len(FRUIT_PATHS) - 1
# Rows that the fruit bounces down in each of eight phases: sideways, down, up.
BOUNCES = ROM.data[0x1DB2:0x1DCA].view(np.int8)
BOUNCE_ASIDE = 0
BOUNCE_DOWN = 8
BOUNCE_UP = 16
# In 16 frames, one bit for each frame with a second step, by ghost.
SECOND_STEPS = np.array((0, 0x0040, 0x0404, 0x1101), np.int32)
# The pen as `ghost_x` and `ghost_y` of ghosts in it.
PEN_LEFT = 82
PEN_MIDDLE = 88
PEN_RIGHT = 94
PEN_TOP = 66
PEN_BOTTOM = 80
TUNNEL_LEFT = 18  # least `ghost_x` outside of the tunnel at the left
TUNNEL_RIGHT = 171  # least `ghost_x` in the tunnel at the right
RIGHT_HALF = 96  # least `x`

MAZE_COLORS = (74, 138, 8, 214)
GHOST_COLORS = (38, 184, 88, 70)
SCARED_COLOR = 150
ENDING_COLOR = 12  # of a flashing scared ghost
FRUIT_COLORS = (68, 68, 54, 22, 68, 214, 40)
PLAYER_COLOR = 42
LIFE_COLOR = 24
SCORE_COLOR = 40
SCORE = NumberDisplay(FONT, right=103, top=187, digits=6)
LIVES = IconRow(12, 173, width=7, height=10, pitch=16)
FIELD = (0, 2, 160, 171)
MAZE_AREA = (0, 1, 160, 172)
ICON_FIELD = (100, 172, 160, 184)
COLUMNS = (*range(8, 80, 8), *range(84, 156, 8))
PILL_X = tuple(COLUMNS[column] for _, column in np.argwhere(USED).tolist())
PILL_Y = tuple(7 + 12 * row for row, _ in np.argwhere(USED).tolist())
POWER_X = (148, 148, 8, 8)
POWER_Y = (146, 14, 147, 15)


class Ram(RamMap):
    maze = bits(0, count=2)
    ghost_way = bits(1, 2, 3, 4, count=2)  # in the pen: remaining rounds
    ghost_leaves = flag(1, 2, 3, 4, bit=3)  # the pen
    ghost_mode = bits(1, 2, 3, 4, first=4, count=3)
    ghost_scared = flag(1, 2, 3, 4, bit=7)
    way = bits(5, count=2)
    fruit_path = bits(5, first=2, count=2)
    chews = bits(5, first=6, count=2)
    ghost_x = byte(6, 7, 8, 9)  # x + 12
    x = byte(10)  # x + 12
    fruit_x = byte(11)  # x + 12; 0: no fruit
    ghost_y = byte(12, 13, 14, 15)  # y - 1
    y = byte(16)  # y - 1
    fruit_y = byte(17)  # y - 1
    waits = high(18)  # one bit per ghost, the last first: on every other call it moves in a tunnel
    ghosts = byte(19)  # in play, minus 1
    demo = flag(20, bit=7)
    frame = byte(30)
    fruit_step = bits(31, count=5)
    fruit_enters = flag(31, bit=6)
    fruit_loops = flag(31, bit=7)  # circles the pen
    event = byte(39)  # counts through music, pauses and deaths
    pills = byte(*((i + 2, i + 1, i) for i in range(59, 101, 3)))  # by row
    scare = byte(116)  # remaining time
    power = bits(117, first=2, count=4)
    fruit_phase = bits(118, first=3, count=3)
    eaten = byte(119)  # pills, in this maze
    score = bcd((122, 121, 120))  # its last digit, shown as 0, is 1 after the extra life
    lives = bits(123, count=3)  # without the last one
    icons = bits(123, count=2)
    fruit = high(123)  # of the level


def decode(m: Ram) -> dict[str, Box]:
    playing = ~m.demo
    i3 = np.arange(3)
    fruits = _fruit_boxes(m)
    maze = pick(m.maze, MAZE_COLORS)
    counted = (m.ghosts >= i3) & (m.ghosts < 3)
    power = playing & ((m.power >> np.arange(4) & 1) == 1)
    return {
        "Player": _player(m),
        "Ghost": _ghosts(m),
        "PowerPill": box(np.array(POWER_X), np.array(POWER_Y), 4, 7, power, color=maze),
        "Pill": box(np.array(PILL_X), np.array(PILL_Y), 4, 2, _pills(m) & playing, color=maze),
        "Fruit": fruits[:1],
        "FruitIcon": fruits[1:],
        "GhostIcon": box(138 - 15 * m.ghosts + 16 * i3, 173, 8, 10, counted),
        "Score": SCORE.box(m.score),
        "Life": LIVES.box(m.icons, value=m.lives + 1),
    }


def _player(m: Ram) -> Box:
    last = m.frame - 1
    dies = _dying(m)
    chew = pick(last >> 2 & 3, (0, 1, 2, 1))
    way = jnp.where(dies, last >> 3 & 3, m.way)  # a dying player spins
    (x, y) = _player_before(m)
    shape = 3 * way + jnp.where(dies, 1, chew)
    return _picture(shape, larger_part(x - 12, 8), y + 1, orientation=4 * way)


def _ghosts(m: Ram) -> Box:
    number = np.arange(4)
    (x, y) = _ghosts_before(m)
    scared = m.ghost_scared
    only_eyes = ~scared & among(m.ghost_mode, (Mode.EYES, Mode.EYES_ENTER_PEN))
    # The first row of the eyes is empty; the first row of a ghost is missing at the positions' own
    # lines.
    late = when(only_eyes | (mod(y, 12) == 0), 1)
    color = match(
        (scared & ((m.scare & 0x32) == 0), ENDING_COLOR),
        (scared, SCARED_COLOR),
        otherwise=jnp.array(GHOST_COLORS),
    )
    height = jnp.where(only_eyes, 5, 10 - late)
    there = (number <= m.ghosts) & ~_dying(m)
    return box(larger_part(x - 12, 8), y + 1 + late, 8, height, there, color=color)


def _pills(m: Ram) -> jax.Array:
    """True for each position of the mazes with a pill."""
    free = match(*((m.maze == maze, MASKS[maze]) for maze in range(3)), otherwise=MASKS[3])
    rows = m.pills & free
    bit = np.int32(1) << np.array(PLACE_BITS, np.int32)
    return jnp.concatenate([rows[i] & bit[USED[i]] for i in range(len(USED))]) != 0


def _fruit_boxes(m: Ram) -> Box:
    """The fruit in the maze, and the level's fruit below it."""
    fruit_x, fruit_y = _fruit_before(m)
    # Two boxes side by side: with `Box.stacked`, the game takes 1.5 times as long.
    x = jnp.stack([larger_part(fruit_x - 12, 8), jnp.int32(126)])
    y = jnp.stack([fruit_y + 1, jnp.int32(173)])
    there = jnp.stack([(m.fruit_x > 0) & ~_dying(m), m.ghosts == 3])
    color = pick(m.fruit, FRUIT_COLORS)
    return _picture(FIRST_FRUIT + m.fruit, x, y, valid=there, color=color)


def _picture(index: jax.Array, x: jax.Array, y: jax.Array, **fields: Any) -> Box:
    """The box of a picture, which loses its last row on some lines."""
    left, top, width, height = PICTURES.extent(index)
    lost = when((mod(y, 12) == 6) & (top + height == 10), 1)
    return box(x + left, y + top, width, height - lost, **fields)


def _dying(m: Ram) -> jax.Array:
    """True while the player spins; the frame on which the next life begins still shows that."""
    phase = m.frame & 7
    reborn = (m.event == Event.NEW_LIFE) & (phase == 1) & (m.eaten > 0)
    return among(m.event - when(phase == 0, 1), Event.DYING) | reborn


def _moving(m: Ram) -> jax.Array:
    """True if everything moves."""
    return (m.event == Event.MOVES) & ~m.demo


def _step(way: jax.Array) -> tuple[jax.Array, jax.Array]:
    """One pixel in a direction."""
    sideways = (way & 1) == 1
    return when(sideways, 2 - way), when(~sideways, way - 1)


def _player_before(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The player's position before her last move, on even frames unless a wall was ahead."""
    (dx, dy) = _step(m.way)
    sideways = m.way & 1
    moved = _moving(m) & ((m.frame & 1) == 0) & (~_stands(m) | (m.chews == Chew.EATS))
    steps = match(
        (~moved, 0),
        ((m.frame & 2) != 0, 2 - sideways),
        (m.chews == Chew.SLOWED, 1),
        otherwise=2,
    )
    return m.x - steps * dx, m.y - steps * dy


def _stands(m: Ram) -> jax.Array:
    """True if the player is in the middle of a position without an exit ahead."""
    sideways = (m.way & 1) == 1
    in_right_half = m.x >= RIGHT_HALF
    ahead = jnp.where(in_right_half & sideways, m.way ^ 2, m.way)  # mirrored
    in_middle = match(
        (~sideways, mod(m.y, 12) == 2),
        (m.x < PEN_MIDDLE, (m.x & 7) == 2),
        (in_right_half, (m.x & 7) == 6),
        otherwise=m.x == PEN_MIDDLE,
    )
    return in_middle & ((_exits_of_place(m, in_right_half) >> (3 - ahead) & 1) == 0)


def _exits_of_place(m: Ram, in_right_half: jax.Array) -> jax.Array:
    """The exits of the player's position, mirrored into the left half."""
    place = jnp.where(in_right_half, 21 - (m.x >> 3), m.x >> 3)
    pair = lookup(EXITS, 84 * m.maze + 6 * div(m.y, 12) + (place >> 1))
    return jnp.where((place & 1) == 1, pair, pair >> 4)


def _ghosts_before(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The ghosts' positions before their last move, on odd frames by one or two pixels."""
    steps = _ghost_steps(m)
    x, y = _pixel_back(m, m.ghost_x, m.ghost_y, steps >= 1)
    return _pixel_back(m, x, y, steps >= 2)


def _pixel_back(
    m: Ram, x: jax.Array, y: jax.Array, moved: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Positions of ghosts one pixel back, if they moved."""
    way_x, way_y = _step(m.ghost_way)
    inside = m.ghost_mode == Mode.IN_PEN
    enters = m.ghost_mode == Mode.EYES_ENTER_PEN
    pen_x, pen_y = _pen_step(x, y, m.ghost_leaves)
    dx = match((inside, pen_x), (enters, 0), otherwise=way_x)
    dy = match((inside, pen_y), (enters, 1), otherwise=way_y)
    return x - when(moved, dx), y - when(moved, dy)


def _ghost_steps(m: Ram) -> jax.Array:
    """Pixels that each ghost has moved."""
    number = np.arange(4)
    sideways = (m.ghost_way & 1) == 1
    scared = m.ghost_scared
    by_table = (SECOND_STEPS >> (m.frame & 14) & 1) != 0
    second = by_table | (~sideways & (((m.frame + number) & 2) != 0)) | (m.ghost_mode == Mode.EYES)
    twice = ~scared & second
    in_tunnel = (m.ghost_x < TUNNEL_LEFT) | (m.ghost_x >= TUNNEL_RIGHT)
    waits = m.waits >> (3 - number) & 1
    all_rest = (m.fruit == 0) & ((m.frame & 30) == 30)
    rests = all_rest | (scared & sideways & ((m.frame & 6) == 0))
    return match(
        (~_moving(m) | ((m.frame & 1) == 0) | rests, 0),
        (in_tunnel & ~twice, 1 - waits),
        (in_tunnel, 1),
        (twice, 2),
        otherwise=1,
    )


def _pen_step(x: jax.Array, y: jax.Array, leaves: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The last step of a ghost in the pen: counterclockwise, or out through the middle."""
    left = (x == PEN_LEFT) & (y > PEN_TOP)
    bottom = (y == PEN_BOTTOM) & (x > PEN_LEFT)
    right = (x == PEN_RIGHT) & (y < PEN_BOTTOM)
    up = jnp.where(leaves, y < PEN_TOP, right)
    dx = match((up, 0), (leaves, -1), (left, 0), (bottom, 1), otherwise=-1)
    dy = match((up, -1), (left & ~leaves, 1), otherwise=0)
    return dx, dy


def _fruit_before(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The fruit's position before its last move, on every fourth frame along its path, bouncing."""
    loops = m.fruit_loops
    leaves = ~loops & ~m.fruit_enters
    path = lookup(FRUIT_PATHS, jnp.where(loops, AROUND_PEN, 4 * m.maze + m.fruit_path))
    path_way = jnp.where(m.fruit_step < 16, path >> (30 - 2 * (m.fruit_step & 15)) & 3, Way.UP)
    way = jnp.where(leaves, path_way ^ 2, path_way)  # the same path backwards
    phase = jnp.where(leaves, 7 - m.fruit_phase, m.fruit_phase)
    bounce = match(
        ((way & 1) == 1, BOUNCE_ASIDE), (way == Way.DOWN, BOUNCE_DOWN), otherwise=BOUNCE_UP
    )
    moved = _moving(m) & ((m.frame & 3) == 0)
    dx = _step(way)[0]
    dy = lookup(BOUNCES, bounce + phase)
    bounced = moved & (loops | (m.fruit_step > 0))
    return m.fruit_x - when(moved, dx), m.fruit_y - when(bounced, dy)


sprites = functools.partial(Blobs, shapes=Shape(w=(4, 8), h=(5, 10)))
fruit_in = functools.partial(Blobs, (68, 54, 22, 214, 40), shapes=Shape(w=(5, 8), h=(8, 10)))
GHOST_RULE = sprites((*GHOST_COLORS, SCARED_COLOR, ENDING_COLOR), FIELD, gap=(2, 0))
POWER_RULE = Cells(MAZE_COLORS, POWER_X, POWER_Y, 4, 7, margin=(2, 0))
PILL_RULE = Cells(MAZE_COLORS, PILL_X, PILL_Y, 4, 2, whole=False, margin=(2, 1))
GHOST_ICONS = sprites(GHOST_COLORS[0], ICON_FIELD)
POINTS = SCORE.rule(SCORE_COLOR, (48, 186, 104, 195))
LIFE_ICONS = LIVES.rule(LIFE_COLOR, (0, 172, 100, 184), single=2)

# The left half of each maze: PF0, PF1 and PF2 of each row of positions.
WALL_BLOCKS = ROM.bytes(0xC00, 4 * 14 * 3).reshape(4, 14, 3)
ROW_HEIGHT = 12
PILL_LINES = slice(5, 7)  # of a row
PEN_TOP_ROW = 5
PEN_BOTTOM_ROW = 7
PEN_BARS = 0xE0  # of PF2, above the pills' lines of its first row and below those of its last


def _closed_lines() -> np.ndarray:
    """Lines on which bars close the pen, bool `[1, lines]`."""
    row = np.arange(14)[:, None]
    line = np.arange(ROW_HEIGHT)[None]
    above = (row == PEN_TOP_ROW) & (line < PILL_LINES.start)
    below = (row == PEN_BOTTOM_ROW) & (line >= PILL_LINES.stop)
    return (above | below).reshape(1, -1)


def _mazes() -> np.ndarray:
    """The walls of the four mazes, bool `[maze, 1, H, 160]`."""
    lines = WALL_BLOCKS.repeat(ROW_HEIGHT, axis=1)
    pf0, pf1, pf2 = np.moveaxis(lines, -1, 0)
    rows = playfield(pf0, pf1, pf2 | PEN_BARS * _closed_lines(), mirrored=True)
    bordered = np.pad(rows, ((0, 0), (1, 2), (0, 0)), constant_values=True)
    _, top, _, bottom = MAZE_AREA
    return np.pad(bordered, ((0, 0), (top, 210 - bottom), (0, 0)))[:, None]


def _walls_seen(frame: jax.Array) -> dict[str, jax.Array]:
    """The pixels in the colour of the maze's border."""
    left, top, _, _ = MAZE_AREA
    return {"wall": (frame == frame[top, left]) & area_mask(MAZE_AREA)}


TERRAIN = TerrainMap(
    kinds=(TerrainKind("wall", "the maze's lines and blocks", effect="blocks"),),
    layouts=_mazes(),
    layout=lambda m: m.maze,
    seen=_walls_seen,
)

GAME = Game(
    name="MsPacman",
    rom=ROM,
    ram=Ram,
    decode=decode,
    variants=Variants(
        modes={
            0: "four ghosts",
            1: "one ghost",
            2: "two ghosts",
            3: "three ghosts",
        },
        source="play of all modes in the emulator",
    ),
    terrain=TERRAIN,
    categories=(
        Category(
            "Player",
            sprites(PLAYER_COLOR, FIELD),
            attributes=("orientation",),
            role="player",
            doc="Ms. Pac-Man",
        ),
        Category("Ghost", GHOST_RULE, count=4, blinks=True, doc="orange, cyan, pink, red"),
        Category("PowerPill", POWER_RULE, count=4, blinks=True, doc="two right, two left"),
        Category("Pill", PILL_RULE, count=len(PILL_X), doc="places of all mazes"),
        Category("Fruit", fruit_in(FIELD), doc="in the maze"),
        display("FruitIcon", fruit_in(ICON_FIELD), attributes=(), doc="the level's, below"),
        display(
            "GhostIcon", GHOST_ICONS, count=3, attributes=(), doc="as many as ghosts in modes 1-3"
        ),
        display("Score", POINTS, role="score", doc="points"),
        display("Life", LIFE_ICONS, role="lives", doc="all icons; value: lives"),
    ),
)
