"""Ms. Pac-Man: a maze of pills, four power pills, up to four ghosts, a fruit that wanders through; score, lives and fruit below.

RAM facts: OCAtari, AtariARI, ALE; the rest was read from the ROM. The picture shows the positions from before the frame's last
move, so `decode` takes that move back. Which way somebody came around a corner or to a wall, and when a slower stretch after a
pill ends, is not in RAM: one frame in twenty is a pixel or two off for the player, one or two in a hundred for a ghost.
Pills: three bytes a row, a bit a place, the same in all mazes; places under the walls of a maze never hold one (`_data`, with the
exits of every crossing and the fruit's paths). A slot is a place that has a pill in any maze.
Ghosts on the same rows, and fruit and player, share a sprite and take turns; power pills too, left and right, eight frames each.

Covered: four mazes, seven fruits, modes 0-3 (four, one, two, three ghosts; the icons below say so in 1-3), start, deaths, pen,
tunnels (the larger part of who is cut in two there), game over. Scenery: the walls, all other pixels in the pills' colour.
"""

import functools
import pathlib
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box
from ocjax.digits import Digits, hex_font
from ocjax.game import Game
from ocjax.ram import RamMap, bcd, bits, byte, high
from ocjax.rules import Blobs, Bounds, Category, Cells, Gauge

MAZES, MAZE_RGB = (
    (74, 138, 8, 214),
    ((228, 111, 111), (101, 111, 228), (170, 170, 170), (110, 156, 66)),
)  # walls and pills
GHOSTS, GHOST_RGB = (
    (38, 184, 88, 70),
    ((180, 122, 48), (84, 184, 153), (198, 89, 179), (200, 72, 72)),
)
BLUE, WHITE = (150, (66, 114, 194)), (12, (214, 214, 214))  # scared ghosts
FRUITS = (68, 54, 22, 214, 40)
FRUIT_RGB = (
    (184, 50, 50),
    (184, 50, 50),
    (198, 108, 58),
    (162, 162, 42),
    (184, 50, 50),
    (110, 156, 66),
    (195, 144, 61),
)
PLAYER, LIFE, SCORE = 42, 24, 40
FIELD = (0, 2, 160, 171)
GLYPHS = ("386cc6c6c66c38", "1838181818187e", "7cc6063ce0c0fe", "fc06067c0606fc", "ccccccfe0c0c0c",
          "fcc0c0fc0606fc", "7cc0c0fcc6c67c", "fe060c18183030", "7cc6c67cc6c67c", "7cc6c67e06067c")  # fmt: skip
DIGITS = Digits(hex_font(GLYPHS, 8, (1, 1)), (55, 63, 71, 79, 87, 95), 187)
sprites = functools.partial(Blobs, min_size=(4, 5), max_size=(8, 10))

with np.load(pathlib.Path(__file__).parent / "_data" / "mspacman.npz") as data:
    PILLS, EXITS, PATHS = (
        data["pills"],
        data["exits"].ravel().astype(np.int32),
        data["fruit_paths"],
    )  # [4, 14], [336], [16]
PLACES = np.int32(1) << np.array(
    (6, 15, 13, 11, 9, 16, 18, 20, 22, 14, 12, 10, 8, 17, 19, 21, 23, 4), np.int32
)  # bit of each column
USED = (np.bitwise_or.reduce(PILLS)[:, None] & PLACES) != 0  # [14, 18], in any maze
COLUMNS = (*range(8, 80, 8), *range(84, 156, 8))
PILL_X, PILL_Y = zip(
    *((COLUMNS[c], 7 + 12 * r) for r, c in np.argwhere(USED).tolist()), strict=True
)
POWER_X, POWER_Y = (148, 148, 8, 8), (146, 14, 147, 15)
# Tight boxes of the pictures, height, width, top and left in a nibble each: three of the player by way, seven fruits.
PLAYERS = (
    0x8820,
    0x9810,
    0xA800,
    0xA600,
    0xA700,
    0xA800,
    0x8800,
    0x9800,
    0xA800,
    0xA602,
    0xA701,
    0xA800,
)
PICTURES = np.array((*PLAYERS, 0xA800, 0x8621, 0xA800, 0xA800, 0xA700, 0xA601, 0xA800), np.int32)
RHYTHM = np.array(
    (0, 1 << 6, 1 << 2 | 1 << 10, 1 << 0 | 1 << 8 | 1 << 12), np.int32
)  # of 16 frames, those with a ghost's second step
LOOP = 0x556ABFF0  # the fruit's way around the pen, two bits a step
BOUNCES = (
    0x0F014341,
    -0x1FDEF0,
    -0x3230FEF1,
)  # of the fruit on its way down, sideways, up: a nibble for each of eight phases


class Ram(RamMap):
    maze = bits(0, count=2)
    ghost_way = bits(1, 2, 3, 4, count=2)  # 0 up, 1 right, 2 down, 3 left; in the pen: rounds to go
    ghost_leaves = bits(1, 2, 3, 4, first=3)  # the pen
    ghost_mode = bits(1, 2, 3, 4, first=4, count=3)  # 4 eyes, 6 eyes entering the pen, 7 in the pen
    ghost_scared = bits(1, 2, 3, 4, first=7)
    ghost_x, ghost_y = byte(6, 7, 8, 9), byte(12, 13, 14, 15)  # x + 12, y - 1
    ghosts = byte(19)  # in play, minus 1
    waits = bits(18, first=4, count=4)  # ghost 3 first: in the tunnel every other call moves it
    way = bits(5, count=2)
    chews = bits(5, first=6, count=2)  # 3 just ate a pill, 2 is slower yet
    x, y = byte(10), byte(16)
    fruit_path = bits(5, first=2, count=2)
    fruit_step, fruit_enters, fruit_loops = bits(31, count=5), bits(31, first=6), bits(31, first=7)
    fruit_phase = bits(118, first=3, count=3)
    fruit_x, fruit_y = byte(11), byte(17)
    demo = bits(20, first=7)
    frame = byte(30)
    event = byte(39)  # 255 while all move; counts through music, pauses and deaths
    pills = byte(*((i + 2, i + 1, i) for i in range(59, 101, 3)))
    scare = byte(116)  # time left
    power = bits(117, first=2, count=4)
    score = bcd(
        (122, 121, 120)
    )  # its lowest digit, shown as 0, marks that the extra life was given
    kind = high(123)
    lives, spare = bits(123, count=3), bits(123, count=2)  # but the last one; icons shown


def decode(m: Ram) -> dict[str, Box]:
    number = jnp.arange(4)
    gx, gy = _ghosts_before(m)
    eyes = (m.ghost_scared == 0) & ((m.ghost_mode == 4) | (m.ghost_mode == 6))
    late = jnp.where(
        eyes | (gy % 12 == 0), 1, 0
    )  # the eyes' first row is empty; on some lines a ghost's is not drawn
    scared = jnp.where(
        m.scare & 0x32 == 0, *(jnp.array(rgb, jnp.uint8) for _, rgb in (WHITE, BLUE))
    )
    ghost_rgb = jnp.where(m.ghost_scared[:, None] > 0, scared, jnp.array(GHOST_RGB, jnp.uint8))

    before = m.frame - 1
    event = m.event - jnp.where(m.frame & 7 == 0, 1, 0)
    dying = (event >= 0x4E) & (event < 0x80)
    chew = jnp.where((before >> 2) & 3 == 3, 1, (before >> 2) & 3)
    picture = jnp.where(dying, ((before >> 3) & 3) * 3 + 1, m.way * 3 + chew)
    px, py = _player_before(m)
    fx, fy = _fruit_before(m)

    masks, maze_rgb = jnp.asarray(PILLS), jnp.array(MAZE_RGB, jnp.uint8)[m.maze]
    free = jnp.where(
        m.maze >= 2,
        jnp.where(m.maze == 3, masks[3], masks[2]),
        jnp.where(m.maze == 1, masks[1], masks[0]),
    )
    pills = m.pills & free
    pills = jnp.concatenate([pills[i] & PLACES[used] for i, used in enumerate(USED)]) != 0
    tens = jnp.array((10, 100, 1000, 10000, 100000))
    left = (
        95
        - 8 * jnp.sum(jnp.where(m.score >= tens, 1, 0))
        + jnp.where(jnp.any((m.score >= tens) & (m.score < 2 * tens)), 1, 0)
    )
    return {
        "Player": _picture(picture, _wrap(px - 12), py + 1, orientation=4 * m.way),
        "Ghost": box(_wrap(gx - 12), gy + 1 + late, 8, jnp.where(eyes, 5, 10 - late), (number <= m.ghosts) & ~dying, rgb=ghost_rgb),
        "PowerPill": box(jnp.array(POWER_X), jnp.array(POWER_Y), 4, 7, (m.power >> number) & 1 > 0, rgb=maze_rgb).where(m.demo == 0),
        "Pill": box(jnp.array(PILL_X), jnp.array(PILL_Y), 4, 2, pills & (m.demo == 0), rgb=maze_rgb),
        "Fruit": _picture(12 + m.kind, jnp.stack([_wrap(fx - 12), jnp.int32(126)]), jnp.stack([fy + 1, jnp.int32(173)]),
                          valid=jnp.stack([(m.fruit_x > 0) & ~dying, m.ghosts == 3]), rgb=jnp.array(FRUIT_RGB, jnp.uint8)[m.kind]),
        "GhostIcon": box(138 - 15 * m.ghosts + 16 * number[:3], 173, 8, 10, (number[:3] <= m.ghosts) & (m.ghosts < 3)),
        "Score": box(left, 187, 102 - left, 7, value=m.score),
        "Life": box(12, 173, 16 * m.spare - 9, 10, m.spare > 0, value=m.lives + 1),
    }  # fmt: skip


def _step(way: jax.Array) -> tuple[jax.Array, jax.Array]:
    sideways = way & 1 > 0
    return jnp.where(sideways, 2 - way, 0), jnp.where(sideways, 0, way - 1)


def _wrap(x: jax.Array) -> jax.Array:
    """Left edge of the larger part of a sprite that the tunnel may cut in two."""
    return jnp.where(x > 156, x - 160, jnp.where(x < -4, x + 160, x))


def _picture(index: jax.Array, x: jax.Array, y: jax.Array, **more: Any) -> Box:
    p = jnp.asarray(PICTURES)[jnp.minimum(index, len(PICTURES) - 1)]
    top, height = p >> 4 & 15, p >> 12
    late = jnp.where(
        (y % 12 == 6) & (top + height == 10), 1, 0
    )  # on some lines the tenth row is not drawn
    return box(x + (p & 15), y + top, p >> 8 & 15, height - late, **more)


def _player_before(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The player moves on even frames unless a wall is ahead."""
    dx, dy = _step(m.way)
    sideways, right = m.way & 1, m.x >= 0x60  # the right half's exits are the left half's mirrored
    column = jnp.where(right, 21 - (m.x >> 3), m.x >> 3)
    exits = jnp.asarray(EXITS)[
        jnp.minimum(84 * m.maze + 6 * (m.y // 12) + (column >> 1), len(EXITS) - 1)
    ] >> (4 - 4 * (column & 1))
    ahead = jnp.where(right & (sideways > 0), m.way ^ 2, m.way)
    middle = jnp.where(m.x < 0x58, m.x & 7 == 2, jnp.where(right, m.x & 7 == 6, m.x == 0x58))
    stands = jnp.where(sideways > 0, middle, m.y % 12 == 2) & (exits >> (3 - ahead) & 1 == 0)
    steps = jnp.where(m.frame & 2 > 0, 2 - sideways, jnp.where(m.chews == 2, 1, 2))
    steps = jnp.where((m.event == 255) & (m.demo == 0) & (m.frame & 1 == 0) & ~stands, steps, 0)
    return m.x - steps * dx, m.y - steps * dy


def _ghosts_before(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Ghosts move on odd frames, one or two pixels: their way; around the pen against the clock, in and out by its middle."""
    i, sideways, scared = jnp.arange(4), m.ghost_way & 1 > 0, m.ghost_scared > 0
    pen, enters, leaves = m.ghost_mode == 7, m.ghost_mode == 6, m.ghost_leaves > 0
    second = (
        (RHYTHM >> (m.frame & 14) & 1 > 0)
        | (~sideways & ((m.frame + i) & 2 > 0))
        | (m.ghost_mode == 4)
    )
    steps = jnp.where(second & ~scared, 2, 1)
    tunnel = (m.ghost_x < 0x12) | (m.ghost_x >= 0xAB)
    steps = jnp.where(tunnel, jnp.where(steps == 2, 1, 1 - (m.waits >> (3 - i) & 1)), steps)
    rests = ((m.kind == 0) & (m.frame & 30 == 30)) | (scared & sideways & (m.frame & 6 == 0))
    steps = jnp.where((m.event == 255) & (m.demo == 0) & (m.frame & 1 == 1) & ~rests, steps, 0)
    way_x, way_y = _step(m.ghost_way)
    x, y = m.ghost_x, m.ghost_y
    for n in (1, 2):
        left, bottom, right = (
            (x == 0x52) & (y > 0x42),
            (y == 0x50) & (x > 0x52),
            (x == 0x5E) & (y < 0x50),
        )
        up = jnp.where(leaves, y < 0x42, right)
        pen_x = jnp.where(
            up, 0, jnp.where(leaves, -1, jnp.where(left, 0, jnp.where(bottom, 1, -1)))
        )
        pen_y = jnp.where(up, -1, jnp.where(left & ~leaves, 1, 0))
        x = x - jnp.where(steps >= n, jnp.where(pen, pen_x, jnp.where(enters, 0, way_x)), 0)
        y = y - jnp.where(steps >= n, jnp.where(pen, pen_y, jnp.where(enters, 1, way_y)), 0)
    return x, y


def _fruit_before(m: Ram) -> tuple[jax.Array, jax.Array]:
    """The fruit moves every fourth frame: its path says the way, and it bounces."""
    loops = m.fruit_loops > 0
    leaves = ~loops & (m.fruit_enters == 0)
    path = jnp.where(loops, LOOP, jnp.asarray(PATHS)[4 * m.maze + m.fruit_path])
    way = jnp.where(m.fruit_step < 16, path >> (30 - 2 * (m.fruit_step & 15)) & 3, 0) ^ jnp.where(
        leaves, 2, 0
    )
    phase = jnp.where(leaves, 7 - m.fruit_phase, m.fruit_phase)
    down, sideways, up = BOUNCES
    bounce = jnp.where(way & 1 > 0, sideways, jnp.where(way == 2, down, up)) >> 4 * phase & 15
    moved = (m.event == 255) & (m.demo == 0) & (m.frame & 3 == 0)
    return m.fruit_x - jnp.where(moved, _step(way)[0], 0), m.fruit_y - jnp.where(
        moved & (loops | (m.fruit_step > 0)), (bounce ^ 8) - 8, 0
    )


GAME = Game(
    name="MsPacman",
    rom="ms_pacman",
    md5="87e79cd41ce136fd4f72cc6e2c161bee",
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", sprites(PLAYER, FIELD), attributes=("orientation",), doc="Ms. Pac-Man"),
        Category(
            "Ghost",
            sprites((*GHOSTS, BLUE[0], WHITE[0]), FIELD, gap=(2, 0)),
            count=4,
            doc="orange, cyan, pink, red",
        ),
        Category(
            "PowerPill",
            Cells(MAZES, POWER_X, POWER_Y, 4, 7, margin=(2, 0)),
            count=4,
            blinks=True,
            doc="two right, two left",
        ),
        Category(
            "Pill",
            Cells(MAZES, PILL_X, PILL_Y, 4, 2, whole=False, margin=(2, 1)),
            count=len(PILL_X),
            doc="places of all mazes",
        ),
        Category(
            "Fruit",
            Blobs(FRUITS, (0, 2, 160, 184), min_size=(5, 8), max_size=(8, 10)),
            count=2,
            doc="in the maze; level's, below",
        ),
        Category(
            "GhostIcon",
            sprites(GHOSTS[0], (100, 172, 160, 184)),
            count=3,
            hud=True,
            doc="as many as ghosts, modes 1-3",
        ),
        Category(
            "Score",
            Bounds(SCORE, (48, 186, 104, 195), value=DIGITS),
            hud=True,
            attributes=("value",),
            doc="all digits",
        ),
        Category(
            "Life",
            Bounds(LIFE, (0, 172, 100, 184), value=Gauge(16, 7, 2)),
            hud=True,
            attributes=("value",),
            doc="all icons; value: lives",
        ),
    ),
)
