"""Pac-Man: a maze of wafers, four power pills, four ghosts and the vitamin.

Picture: docs/games/Pacman.png

Screen: score and lives are below the maze. The ghosts alternate: each is drawn on every fourth
frame. The left power pills and the right ones alternate, eight frames each. A figure in the tunnel
between top and bottom is not valid while it is completely hidden. On the frame on which a life
begins, the screen still shows the end of the last one; no figure is valid.

RAM: the ROM is made for PAL consoles. Sources are OCAtari and ALE's source (score, lives), J.
Mathes' disassembly of a hack (names of bytes), and the ROM's code. f0f4-f37a draws; before that,
f930-f983 moves one of the ghosts; afterwards, f621-f7bd moves Pac-Man. The RAM keeps remainders of
his position in the maze's grid from before the move; `decode` undoes the move with them. The ROM's
own tables give the position of each wafer's bit.

Covered: modes 0 to 7, both difficulties, scared ghosts, eyes, tunnel, deaths, cleared mazes, game
over.

Not exact: Pac-Man's width while only some of his rows are in the tunnel, and on the frame on which
he turns around; objects that were eaten on this very frame.

Terrain: the walls have the wafers' colour. All mazes are the same.

VEM: it is wrong about a ghost that touches a power pill, and about figures behind a ghost.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Cells,
    Checks,
    Game,
    IconRow,
    NumberDisplay,
    RamMap,
    Rom,
    Shape,
    Static,
    TerrainKind,
    TerrainMap,
    bcd,
    box,
    byte,
    display,
    flag,
    match,
    mod,
    pick,
    playfield,
    when,
)

ROM = Rom("pacman", "fc2233fc116faef0d3c31541717ca2db")
FONT = ROM.font([0xE00 + int(low) for low in ROM.bytes(0xEF9, 10)], rows=7)
BIT_MASKS = tuple(int(mask) for mask in ROM.bytes(0xE6D, 8))


def _wafer_places() -> dict[tuple[int, int], tuple[int, int]]:
    """Left and top of every wafer, by its byte and the mask of its bit."""
    places = []
    for row in range(8):
        nodes = ROM.bytes(0xE16 + 40 * (row & 1), 40).tolist()
        for column, node in enumerate(nodes):
            if node & 0x81 == 1:  # a path, with a wafer
                at = int(ROM.data[0xE7C + 2 * row + (node >> 1 & 1)])
                x = 4 * column + (4 if column == 26 else 0)  # drawn one node further right
                places.append(((at, BIT_MASKS[node >> 2 & 7]), (x, 32 + 22 * row)))
    return dict(places)


NEVER_SET = ((2, 1), (6, 128))  # their positions belong to the pen
WAFERS = {bit: xy for bit, xy in sorted(_wafer_places().items()) if bit not in NEVER_SET}
WAFER_BYTE = tuple(number for number, _ in WAFERS)
WAFER_MASK = tuple(mask for _, mask in WAFERS)
WAFER_X = tuple(x for x, _ in WAFERS.values())
WAFER_Y = tuple(y for _, y in WAFERS.values())

# The mouth's four phases, then the pictures of his death, the last one first.
LOOK_LOWS = (*ROM.bytes(0xDC5, 4), *ROM.bytes(0xDFD, 16))
LOOKS = ROM.pictures([0xD00 + int(low) for low in LOOK_LOWS], 7)
FIRST_DYING = 4  # index of the first picture of his death


class State:  # bits of `Ram.state`
    MOVES = 16  # in the tunnel
    TUNNEL = 32  # between top and bottom


WAY_UP = 3  # direction in the highest bits of `Ram.state`
WAY_COMPASS = (4, 12, 8, 0)  # of the directions right, left, down and up

PATH_ROWS = 11  # steps from one row of the maze to the next
TUNNEL_END = 98  # `y` below the maze
ENTRY = 11  # `y` above the maze
ALL_ROWS = 6  # least `y` in the tunnel with all rows visible
MAZE_TOP = 9  # steps to the first visible row
START_TIME = 60  # `time` at a new start
EATEN = 186  # `ate` on the frame on which a ghost is eaten
STANDS = 128  # least `ate` while all stand still after a ghost was eaten
POWER_X = (6, 6, 150, 150)
POWER_Y = (39, 171, 39, 171)
POWER_BITS = (32, 16, 8, 4)
GHOST = 110
SCARED = 222
CALMING = 218  # scared for a moment only
YELLOW = 46
WAFER = 42
VITAMIN = Static(76, 115, 8, 11, WAFER)  # below the pen
GREEN = 86
BLACK = 0
SCREEN = (250, 160)
FIELD = (0, 19, 160, 199)
SCORE = NumberDisplay(FONT, right=103, top=207, digits=5)
LIVES = IconRow(8, 217, width=4, height=6, pitch=8)


class Ram(RamMap):
    frame = byte(0)  # 2 more than when Pac-Man's picture was chosen
    game_over = byte(2)
    row_part = byte(5)  # Pac-Man's `y` before the move, minus the next row of the maze
    column_part = byte(6)  # lowest bits of his `x` before the move
    wafers = byte(*range(8, 24))  # one bit each
    icons = byte(24)  # lives, without the current one
    power = byte(26)  # bits of the power pills
    fright = flag(26, bit=6)  # 0: the ghosts will be scared for a moment only
    scared = flag(26, bit=7)  # the ghosts
    x = byte(49)
    ghost_x = byte(50, 51, 52, 53)
    y = byte(54)  # two rows
    ghost_y = byte(55, 56, 57, 58)  # two rows
    state = byte(59)  # direction in the highest bits
    ghost_state = byte(60, 61, 62, 63)
    mirrored = flag(59, bit=0)
    eyes = flag(60, 61, 62, 63, bit=3)
    score = bcd((80, 78, 76))
    time = byte(100)  # until a start, a death or the ghosts' fright is over
    ate = byte(101)  # counts down to 127 while all stand still after a ghost was eaten
    vitamin = flag(103, bit=1)
    dying = flag(103, bit=6)
    ready = flag(103, bit=7)  # all wait, at a start or a death


def decode(m: Ram) -> dict[str, Box]:
    there = (m.wafers[np.array(WAFER_BYTE)] & np.array(WAFER_MASK)) != 0
    color = match((~m.scared, GHOST), (m.fright, SCARED), otherwise=CALMING)
    power = (m.power & np.array(POWER_BITS)) != 0
    shown = mod(m.score, 100_000)  # the display has five digits, the counter six
    return {
        "Player": _player(m),
        "Ghost": _ghosts(m, color),
        "PowerPill": box(np.array(POWER_X), np.array(POWER_Y), 4, 10, power, color=color),
        "Pill": box(np.array(WAFER_X), np.array(WAFER_Y), 4, 2, there),
        "Vitamin": VITAMIN.box(m.vitamin),
        "Score": SCORE.box(shown, value=m.score),
        "Life": LIVES.box(m.icons, value=m.icons + 1),
    }


def _starts(m: Ram) -> jax.Array:
    """True if all have just been put at the start of a life, which is not visible yet."""
    return (m.time == START_TIME) & m.ready & ~m.dying & ((m.frame & 1) == 0)


def _rows_shown(y: jax.Array, state: jax.Array) -> tuple[jax.Array, jax.Array, jax.Array]:
    """First step of a picture, number of hidden rows of its seven, and whether any are visible."""
    in_tunnel = (state & State.TUNNEL) != 0
    up = (state >> 6) == WAY_UP
    shows = ~in_tunnel | ((state & State.MOVES) != 0) & ((y > 0) | up) & (y != TUNNEL_END)
    inside = jnp.where(up & (y == ENTRY), ENTRY + 1, jnp.maximum(y, MAZE_TOP))
    cut = in_tunnel & (y < ALL_ROWS)
    return jnp.where(in_tunnel, inside, y + 12), jnp.where(cut, ALL_ROWS - y, 0), shows


def _player(m: Ram) -> Box:
    at_x, half_y = _player_before(m)
    first, cut, shows = _rows_shown(half_y, m.state)
    dies = FIRST_DYING + ((m.time + (m.frame - 1 & 1)) >> 2 & 15)
    look = jnp.where(m.dying, dies, (m.frame - 2) >> 3 & 3)
    turned = m.mirrored & (m.ate < STANDS) & ~m.dying
    left, top, width, height = LOOKS.extent(look, mirrored=turned)
    x = at_x + left
    rows = jnp.minimum(height, 7 - cut - top)
    compass = pick(m.state >> 6, WAY_COMPASS)
    y = 2 * (first + top) + 2
    there = shows & ~_starts(m)
    return box(x, y, width, 2 * rows, there, orientation=compass).clip(*FIELD)


def _player_before(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Pac-Man's `x` and `y` before the move that follows the drawing."""
    dx = ((m.x - m.column_part + 1) & 3) - 1
    before = jnp.where(m.row_part > 127, m.row_part - 245, m.row_part)  # modulo a row
    dy = mod(m.y - before + 5 + PATH_ROWS, PATH_ROWS) - 5
    still = (m.game_over > 0) | ((m.state & State.TUNNEL) != 0)
    x = jnp.where(still | (dx > 1), m.x, m.x - dx)
    y = jnp.where(still | (jnp.abs(dy) > 1), m.y, m.y - dy)
    return x, y


def _ghosts(m: Ram, color: jax.Array) -> Box:
    first, cut, shows = _rows_shown(m.ghost_y, m.ghost_state)
    eaten_now = (m.ate == EATEN) & ((m.frame - 1 & 3) == np.arange(4))
    eyes = m.eyes & ~eaten_now
    y = 2 * first + 1 + when(eyes, 2)
    height = match((eyes, 6), (cut > 0, 14 - 2 * cut), otherwise=16)
    return box(m.ghost_x, y, 8, height, shows & ~_starts(m), color=color).clip(*FIELD)


PLAYER_RULE = Bounds(YELLOW, FIELD, ignore=((78, 118, 82, 123),))
GHOST_COLORS = (GHOST, SCARED, CALMING)
GHOST_RULE = Blobs(GHOST_COLORS, FIELD, Shape(w=8, h=(5, 16)), gap=(2, 0))
POWER_RULE = Cells(GHOST_COLORS, POWER_X, POWER_Y, 4, 10, margin=(1, 1))
PILL_RULE = Cells(WAFER, WAFER_X, WAFER_Y, 4, 2, whole=False)

facing = functools.partial(Category, attributes=("orientation",))

EDGE = (0xFF, 0xFF, 0x7F)  # PF0, PF1 and PF2 above and below the maze
PEN_ROW = 3
PEN_SIDES = 0x40


def _walls_of_maze() -> np.ndarray:
    """The walls without wafers, bool `[H, 160]`."""
    rows = [line for row in range(8) for line in _lines_of_row(row)]
    maze = playfield(*np.array([*[EDGE] * 6, *rows, *[EDGE] * 4]).T, mirrored=True)
    return np.pad(maze, ((FIELD[1], SCREEN[0] - FIELD[3]), (0, 0)))


def _lines_of_row(row: int) -> list[tuple[int, ...]]:
    """PF0, PF1 and PF2 of the lines of a row of the maze: bars, except at the top, and a path."""
    parity = row & 1 ^ 1  # the drawing loop counts rows from the bottom
    bars = _registers(0xF44 + parity, 0xE12 + parity, 0xE14 + parity)
    pf0, pf1, pf2 = _registers(0xE0D + parity, 0xE0F + parity, 0xE10 + parity)
    path = (pf0, pf1, PEN_SIDES if row == PEN_ROW else pf2)
    return [*([bars] * 6 if row > 0 else []), *[path] * 16]


def _registers(*offsets: int) -> tuple[int, ...]:
    """PF0, PF1 and PF2 from tables in the ROM."""
    return tuple(int(ROM.data[offset]) for offset in offsets)


TERRAIN = TerrainMap(
    kinds=(TerrainKind("wall", "the maze's walls", effect="blocks"),),
    layouts=_walls_of_maze()[None, None],
    seen=lambda frame: {"wall": frame == WAFER},
)

GAME = Game(
    name="Pacman",
    rom=ROM,
    ram=Ram,
    decode=decode,
    screen=SCREEN,
    pal=True,
    checks=Checks(
        rare=("Vitamin",),
        # The display shows five of the digits.
        at_limits={"Score": (99_999, (100_000, 0), (123_456, 23_456))},
    ),
    terrain=TERRAIN,
    categories=(
        facing("Player", PLAYER_RULE, role="player", doc="Pac-Man"),
        Category("Ghost", GHOST_RULE, count=4, blinks=True, doc="they are drawn in turn"),
        Category("PowerPill", POWER_RULE, count=4, blinks=True, doc="two left, two right"),
        Category("Pill", PILL_RULE, count=len(WAFER_X), doc="the maze's wafers"),
        Category("Vitamin", VITAMIN.rule(), doc="below the pen"),
        display("Score", SCORE.rule(BLACK), role="score", doc="points; the last five digits show"),
        display(
            "Life",
            LIVES.rule(GREEN, (0, 217, 80, 223), single=2),
            role="lives",
            doc="all icons; value: lives",
        ),
    ),
)
