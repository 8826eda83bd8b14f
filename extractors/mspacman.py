"""Ms. Pac-Man: a maze of pills, four power pills, up to four ghosts, a fruit that wanders through; score, lives and fruit below.

RAM facts: OCAtari, AtariARI and ALE, the rest read from the ROM: the picture shows the positions from before the frame's last move, so
`decode` takes that move back (`_before` and the `_*_steps`). Which way somebody came to a corner or wall is not in RAM: a pixel or two are
off there in about one frame in twenty for the player and one in a hundred for a ghost. Pills: three bytes a row, a bit a place, the same in all
mazes; places under the walls of a maze (`_data/mspacman.npz`, with the exits of every crossing and the fruit's paths) never hold one.
Ghosts on the same rows, and fruit and player, share a sprite and take turns; of the power pills the left two and the right two do, eight frames each.

Covered: the four mazes, all fruits, modes 0-3 (four, one, two, three ghosts; below, 1-3 show that number of ghosts instead of the fruit),
start, deaths, tunnels, pen, game over. Scenery: the walls, that is all other pixels in the colour of the pills.
"""

import pathlib

import jax.numpy as jnp
import numpy as np

from ocjax.ram import RamMap, bcd, bits, byte, high
from ocjax.spec import Blobs, Bounds, Box, Category, Cells, Game, box

_DATA = np.load(pathlib.Path(__file__).parent / "_data" / "mspacman.npz")
PILLS, EXITS, PATHS = _DATA["pills"], _DATA["exits"].ravel().astype(np.int32), _DATA["fruit_paths"]

MAZES = (74, 138, 8, 214)  # walls and pills
PLAYER, LIFE, SCORE, WHITE, BLUE = 42, 24, 40, 12, 150
GHOSTS = (38, 184, 88, 70)
MAZE_RGB = ((228, 111, 111), (101, 111, 228), (170, 170, 170), (110, 156, 66))
GHOST_RGB = ((180, 122, 48), (84, 184, 153), (198, 89, 179), (200, 72, 72))
FRUITS = (68, 54, 22, 214, 40)
FIELD = (0, 2, 160, 171)
COLUMNS = (*range(8, 80, 8), *range(84, 156, 8))
PLACES = (6, 15, 13, 11, 9, 16, 18, 20, 22, 14, 12, 10, 8, 17, 19, 21, 23, 4)  # bit of each column in a row of pills
# Tight boxes of the pictures, left, top, width and height in a nibble each: three of the player by compass point, seven fruits.
PICTURES = np.array(
    (0x8820, 0x9810, 0xA800, 0xA600, 0xA700, 0xA800, 0x8800, 0x9800, 0xA800, 0xA602, 0xA701, 0xA800)
    + (0xA800, 0x8621, 0xA800, 0xA800, 0xA700, 0xA601, 0xA800)
)
LOOP = 0x556ABFF0  # the fruit's way around the pen, two bits a step


class Ram(RamMap):
    maze = bits(0, count=2)
    ghost_way = bits(1, 2, 3, 4, count=2)  # 0 up, 1 right, 2 down, 3 left; in the pen: rounds left
    ghost_leaves = bits(1, 2, 3, 4, first=3)  # the pen
    ghost_mode = bits(1, 2, 3, 4, first=4, count=3)  # 4 eyes, 6 eyes entering the pen, 7 in the pen
    ghost_blue = bits(1, 2, 3, 4, first=7)
    ghost_x = byte(6, 7, 8, 9)  # x + 12
    ghost_y = byte(12, 13, 14, 15)  # y - 1
    ghosts = byte(19)  # in play, minus 1
    waits = bits(18, 18, 18, 18, first=4, count=4)  # a bit a ghost in the tunnel: every other call moves it
    way = bits(5, count=2)
    chews = bits(5, first=6, count=2)  # 3 just ate a pill, 2 still slower
    fruit_path = bits(5, first=2, count=2)
    fruit_step = bits(31, count=5)
    fruit_enters = bits(31, first=6)
    fruit_loops = bits(31, first=7)
    fruit_phase = bits(118, first=3, count=3)
    x, y = byte(10), byte(16)
    fruit_x, fruit_y = byte(11), byte(17)
    demo = bits(20, first=7)
    frame = byte(30)
    event = byte(39)  # 255 while all move, counts through music and pauses otherwise
    pills = byte(*((i + 2, i + 1, i) for i in range(59, 101, 3)))
    scared = byte(116)  # time left
    power = bits(117, first=2, count=4)
    score = bcd((122, 121, 120))
    kind = high(123)
    spare = bits(123, count=2)


def decode(m: Ram) -> dict[str, Box]:
    one = jnp.arange(4)
    dying = _dying(m)
    steps = _ghost_steps(m)
    gx, gy = m.ghost_x, m.ghost_y
    for step in (1, 2):
        dx, dy = _ghost_came(m, gx, gy)
        gx, gy = gx - jnp.where(steps >= step, dx, 0), gy - jnp.where(steps >= step, dy, 0)
    eyes = (m.ghost_blue == 0) & ((m.ghost_mode == 4) | (m.ghost_mode == 6))
    cut = gy % 12 == 0  # the first row is not drawn there
    flash = (m.scared & 0x32) == 0
    scared_rgb = jnp.where(flash, jnp.array((236, 236, 236)), jnp.array((66, 114, 194)))
    ghost_rgb = jnp.where(m.ghost_blue[:, None] > 0, scared_rgb, jnp.array(GHOST_RGB)).astype(jnp.uint8)

    before = m.frame - 1
    turn = (before >> 2) & 3
    picture = jnp.where(dying, ((before >> 3) & 3) * 3 + 1, m.way * 3 + jnp.where(turn == 3, 1, turn))
    steps = _player_steps(m)
    px, py = m.x - steps * _dx(m.way), m.y - steps * _dy(m.way)
    fx, fy = _fruit_before(m)
    fruits = _picture(jnp.stack([12 + m.kind] * 2), jnp.stack([_wrap(fx - 12), 126]), jnp.stack([fy + 1, 173]))

    masks = jnp.asarray(PILLS)
    free = jnp.where(m.maze >= 2, jnp.where(m.maze == 3, masks[3], masks[2]), jnp.where(m.maze == 1, masks[1], masks[0]))
    pills = (((m.pills & free)[:, None] >> jnp.array(PLACES)) & 1) > 0
    rows, columns = np.repeat(7 + 12 * np.arange(14), 18), np.tile(COLUMNS, 14)
    figures = 1 + sum((m.score >= 10**i).astype(jnp.int32) for i in range(1, 6))
    first = m.score // jnp.array([1, 10, 100, 1000, 10000, 100000])
    one_first = jnp.any((first == 1) & (jnp.arange(6) > 0)).astype(jnp.int32)
    left = 103 - 8 * figures + one_first
    maze_rgb = jnp.array(MAZE_RGB, jnp.uint8)[m.maze]
    return {
        "Player": _picture(picture, _wrap(px - 12), py + 1, orientation=4 * m.way),
        "Ghost": box(_wrap(gx - 12), gy + 1 + (eyes | cut), 8, jnp.where(eyes, 5, 10 - cut), (one <= m.ghosts) & ~dying, rgb=ghost_rgb),
        "PowerPill": box(jnp.array([148, 148, 8, 8]), jnp.array([146, 14, 147, 15]), 4, 7, (m.power >> one) & 1 > 0, rgb=maze_rgb),
        "Pill": box(columns, rows, 4, 2, pills.reshape(252) & (m.demo == 0), rgb=maze_rgb),
        "Fruit": fruits.where(jnp.stack([(m.fruit_x > 0) & ~dying, m.ghosts == 3])),
        "GhostIcon": box(138 - 15 * m.ghosts + 16 * jnp.arange(3), 173, 8, 10, (jnp.arange(3) <= m.ghosts) & (m.ghosts < 3)),
        "Score": box(left, 187, 102 - left, 7, value=m.score),
        "Life": box(12, 173, 16 * m.spare - 9, 10, m.spare > 0, value=m.spare),
    }


def _dx(way):
    return jnp.where(way & 1 > 0, 2 - way, 0)


def _dy(way):
    return jnp.where(way & 1 > 0, 0, way - 1)


def _wrap(x):
    """Left edge of a sprite that the tunnel may cut in two: the larger part's."""
    return jnp.where(x > 156, x - 160, jnp.where(x < -4, x + 160, x))


def _picture(index, x, y, **more) -> Box:
    p = jnp.asarray(PICTURES)[jnp.minimum(index, len(PICTURES) - 1)]
    top, height = y + (p >> 4 & 15), p >> 12
    cut = (top + height - 1) % 12 == 3  # a last row is not drawn there
    return box(x + (p & 15), top, p >> 8 & 15, height - cut, **more)


def _dying(m: Ram):
    event = m.event - (m.frame & 7 == 0)
    return (event >= 0x4E) & (event < 0x80)


def _moved(m: Ram, odd: int):
    return (m.event == 255) & (m.demo == 0) & (m.frame & 1 == odd)


def _player_steps(m: Ram):
    """Pixels that the player moved in this frame: on even frames, none where a wall is ahead."""
    sideways = m.way & 1
    steps = jnp.where(m.frame & 2 > 0, 2 - sideways, jnp.where(m.chews == 2, 1, 2))
    column = m.x >> 3
    right = column >= 12
    column = jnp.where(right, 21 - column, column)
    exits = jnp.asarray(EXITS)[jnp.clip(84 * m.maze + (m.y // 12) * 6 + (column >> 1), 0, 335)]
    exits = jnp.where(column & 1 > 0, exits, exits >> 4)
    ahead = jnp.where(right & (sideways > 0), m.way ^ 2, m.way)  # the right half is the left one mirrored
    middle_x = jnp.where(m.x < 0x58, m.x & 7 == 2, jnp.where(m.x < 0x60, m.x == 0x58, m.x & 7 == 6))
    middle = jnp.where(sideways > 0, middle_x, m.y % 12 == 2)
    stands = middle & ((exits >> (3 - ahead)) & 1 == 0)
    return jnp.where(_moved(m, 0) & ~stands, steps, 0)


def _ghost_steps(m: Ram):
    """Pixels that each ghost moved in this frame: on odd frames, one or two."""
    i, t = jnp.arange(4), m.frame & 14
    sideways = m.ghost_way & 1
    rhythm = jnp.array([0, 1 << 6, 1 << 2 | 1 << 10, 1 << 0 | 1 << 8 | 1 << 12]) >> t & 1  # frames of 16 with a second step
    second = (rhythm > 0) | ((sideways == 0) & ((m.frame + i) & 2 > 0)) | (m.ghost_mode == 4)
    steps = 1 + (second & (m.ghost_blue == 0))
    rests = ((m.kind == 0) & (m.frame & 30 == 30)) | ((m.ghost_blue & sideways > 0) & (m.frame & 6 == 0))
    tunnel = (m.ghost_x < 0x12) | (m.ghost_x >= 0xAB)
    steps = jnp.where(tunnel, jnp.where(steps == 2, 1, 1 - (m.waits >> (3 - i) & 1)), steps)
    return jnp.where(_moved(m, 1) & ~rests, steps, 0)


def _ghost_came(m: Ram, x, y):
    """The step that took each ghost to (x, y): its way, or around in the pen against the clock, out and in by the middle."""
    pen, enters, leaves = m.ghost_mode == 7, m.ghost_mode == 6, m.ghost_leaves > 0
    left, bottom, right = (x == 0x52) & (y > 0x42), (y == 0x50) & (x > 0x52), (x == 0x5E) & (y < 0x50)
    up = (leaves & (y < 0x42)) | (~leaves & right)
    dx = jnp.where(up, 0, jnp.where(leaves, -1, jnp.where(left, 0, jnp.where(bottom, 1, -1))))
    dy = jnp.where(up, -1, jnp.where(leaves, 0, jnp.where(left, 1, 0)))
    dx = jnp.where(pen, dx, jnp.where(enters, 0, _dx(m.ghost_way)))
    return dx, jnp.where(pen, dy, jnp.where(enters, 1, _dy(m.ghost_way)))


def _fruit_before(m: Ram):
    """Where the fruit was before its step of this frame (one frame in four): its path says the way, a bounce is added."""
    word = jnp.asarray(PATHS)[4 * m.maze + m.fruit_path]
    loops = m.fruit_loops > 0
    field = jnp.where(m.fruit_step < 16, jnp.where(loops, LOOP, word) >> (30 - 2 * (m.fruit_step & 15)) & 3, 0)
    leaves = ~loops & (m.fruit_enters == 0)
    way = jnp.where(leaves, field ^ 2, field)
    phase = jnp.where(leaves, 7 - m.fruit_phase, m.fruit_phase)
    bounce = jnp.where(way & 1 > 0, -0x1FDEF0, jnp.where(way == 2, 0x0F014341, -0x3230FEF1))  # a nibble a phase, signed
    bounce = bounce >> 4 * phase & 15
    bounce = jnp.where(loops | (m.fruit_step > 0), (bounce ^ 8) - 8, 0)
    moved = _moved(m, 0) & (m.frame & 2 == 0)
    return m.fruit_x - jnp.where(moved, _dx(way), 0), m.fruit_y - jnp.where(moved, bounce, 0)


GAME = Game(
    name="MsPacman",
    rom="ms_pacman",
    md5="87e79cd41ce136fd4f72cc6e2c161bee",
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", Blobs(PLAYER, FIELD, min_size=(4, 4), max_size=(8, 10)), attributes=("orientation",)),
        Category("Ghost", Blobs((*GHOSTS, BLUE, WHITE), FIELD, join=(2, 0), min_size=(4, 5), max_size=(8, 10)), count=4),
        Category("PowerPill", Cells(MAZES, (148, 148, 8, 8), (146, 14, 147, 15), 4, 7, margin=2), count=4),
        Category("Pill", Cells(MAZES, COLUMNS * 14, tuple(7 + 12 * (i // 18) for i in range(252)), 4, 2, whole=False, margin=(2, 1)), count=252),
        Category("Fruit", Blobs(FRUITS, (0, 2, 160, 184), min_size=(4, 4), max_size=(8, 10)), count=2, doc="0 in the maze, 1 the level's below it"),
        Category("GhostIcon", Blobs(GHOSTS[0], (100, 172, 160, 184), max_size=(8, 10)), count=3, hud=True, doc="number of ghosts, modes 1-3"),
        Category("Score", Bounds(SCORE, (48, 186, 104, 195)), hud=True, attributes=("value",)),
        Category("Life", Bounds(LIFE, (0, 172, 100, 184)), hud=True, attributes=("value",), doc="all icons; value: spare lives shown"),
    ),
)
