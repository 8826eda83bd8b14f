"""Bank Heist: a getaway car, banks, police cars and dynamite in a maze; fuel, lives and loot.

The game keeps four records: one of the getaway car, and three each of which is in turn a bank, the
points for its robbery, a police car, or that car's explosion. The slots of Bank, Police, Points and
Explosion are these three. An object that shares its lines with two others is drawn in turns with
them. After an explosion the streets flash: while they are as grey as the banks, what is grey does
not show and is not valid. Walls hide dynamite, which has their colour.

The maze, the empty part of the tank with the mark beside it (it shows how full the tank will be
after the city), and the spark where dynamite was are scenery.

RAM: ALE's source (score, lives), OCAtari 2.2 (positions, kinds), and the ROM's code. The game moves
cars after it has drawn them, but what it has prepared for drawing stays in the RAM from before: the
column as coded for the video chip, and the addresses of the pictures, from which the row follows.

Covered: all cities, robberies, explosions, wrecks, empty tanks, the end of the game, ALE's modes
and difficulties. Not in the RAM: the streets' brightness on the frame of an explosion. Not covered:
the changing colours after nine minutes without input, and the copyright line that takes turns with
the score after the game (Score is not valid then).
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box
from ocjax.console import packed_position
from ocjax.digits import Digits
from ocjax.game import Game
from ocjax.ops import among, lookup, reached
from ocjax.ram import RamMap, bcd, byte
from ocjax.rom import Rom
from ocjax.rules import Blobs, Bounds, Category, Cells, Gauge

ROM = Rom("bank_heist", "00ce0bdd43aed84a983bef38fe7f5ee3")
FONT = ROM.font((0xF00 + ROM.bytes(0xDB9, 10)).tolist(), rows=7)  # low bytes of the addresses
SCORE_DIGITS, SCORE_TOP = range(57, 98, 8), 179  # left columns

GREY, BLUE, BLACK, RED, BROWN_RGB = 6, 130, 0, 66, (162, 98, 33)
CAR = (36, 64)  # the second while there is little fuel
WALL = (22, 42, 46, 118, 182)
STREETS = (8, 38, 152, 176)
MAZE_TOP = 37

# Pictures have at most seven rows; they lie in three pages of the ROM.
BANK_PAGE, CAR_PAGE, POINTS_PAGE = 0xFD, 0xFE, 0xFF  # banks and a wreck; points and explosions
PICTURES = ROM.pictures(range(0xD00, 0x1000), 7, top_first=True)
CARS, EXPLOSION = 0xBC, 0x83  # low bytes of the pictures' addresses
FRONT, SECOND = 12, 24  # from a car's picture to that from the front, and to the next one
HIDDEN = 0x88  # `y` of who is not in the maze

CITIES, MAZE_ROWS = 4, 17
OPEN_ROWS = (5, 9)  # of the maze, where the streets lead over the border
DROPPED, BURNS = 84, range(63, 84)  # `fuse`
TANK = (42, 12, 50, 37)
TANK_HEIGHT = 25
NO_SCORE = 171  # `shown_high` while the copyright line takes the score's place
LIFE_LEFTS, LIFE_TOPS = (90, 106, 122) * 2, (27,) * 3 + (15,) * 3
LIFE_NUMBERS = np.arange(6, dtype=np.int32)


def _walls(city: int) -> np.ndarray:
    """The walls in the rows of a city's maze, int32 `[17]`.

    Bits 19 to 0 are the columns of the left half, from the border to the middle; the right half is
    its mirror image. A column is four pixels wide.
    """
    border = np.where(np.isin(np.arange(MAZE_ROWS), OPEN_ROWS), 0, 1)
    outer = ROM.bytes(0xE00 + city, MAZE_ROWS, step=8)
    inner = ROM.bytes(0xE04 + city, MAZE_ROWS, step=8)  # drawn from the lowest bit on
    inner = sum((inner >> bit & 1) << 7 - bit for bit in range(8))
    return border << 16 | outer << 8 | inner


WALLS = np.concatenate([_walls(city) for city in range(CITIES)])


class Ram(RamMap):
    city = byte(0)
    frame = byte(6)
    y = byte(8, 9, 10, 11)  # screen y - 37; already moved on
    dynamite_y = byte(12)  # screen y - 37
    picture = byte(19, 20, 21, 22)  # low byte of its address, minus y
    page = byte(23, 24, 25, 26)  # high byte of its address
    dynamite_x = byte(32)  # x + 1
    place = byte(33, 34, 35, 36)  # x + 1 in the chip's coding
    fuse = byte(63)  # explodes below 64
    waits = byte(64)  # dynamite is to be dropped at the next line
    flash = byte(69)  # brightness of the streets
    lives = byte(85)
    used = byte(86)  # fuel, in rows of the tank
    used_low = byte(87)  # in 256ths of that
    score = bcd((88, 89, 90))
    shown = bcd((91, 92, 93))  # the score as on the screen
    shown_high = byte(91)


def decode(m: Ram) -> dict[str, Box]:
    pictures = _pictures(m)
    player, others = pictures[0], pictures[1:]
    page, low = m.page[1:], _low_bytes(m)[1:]
    points = page == POINTS_PAGE
    explodes = points & (low == EXPLOSION)
    shows = ~_streets_are_grey(m)
    return {
        "Player": player,
        "Bank": others.where(shows & (page == BANK_PAGE)),
        "Police": others.where(page == CAR_PAGE),
        "Dynamite": _dynamite(m),
        "Points": others.where(shows & points & ~explodes),
        "Explosion": others.where(shows & explodes),
        "Life": box(np.array(LIFE_LEFTS), np.array(LIFE_TOPS), 8, 7, m.lives > LIFE_NUMBERS),
        "Gas_Tank": _tank(m),
        "Score": _score(m),
    }


def _pictures(m: Ram) -> Box:
    """The four records' pictures as drawn."""
    index = (m.page - BANK_PAGE) << 8 | _low_bytes(m)
    x = packed_position(m.place) - 1
    return PICTURES.box(index, x, _drawn_y(m) + MAZE_TOP, valid=m.y < HIDDEN)


def _low_bytes(m: Ram) -> jax.Array:
    """The low bytes of the addresses of the four records' pictures."""
    return (m.picture + _drawn_y(m)) & 255


def _drawn_y(m: Ram) -> jax.Array:
    """Where the four records were drawn, minus 37; only cars have moved since.

    A car's pointer allows two rows: one if it is seen from the side, one if from the front. The
    right one is near the row where the car is now.
    """
    second = (m.frame & 4) == 0
    front_y = (CARS + FRONT + jnp.where(second, SECOND, 0) - m.picture) & 255
    side_y = front_y - FRONT
    car_y = jnp.where(m.y - side_y > FRONT // 2, front_y, side_y)
    return jnp.where(m.page == CAR_PAGE, car_y, m.y)


def _streets_are_grey(m: Ram) -> jax.Array:
    """Whether the streets flash in the colour of banks, points and explosions."""
    is_set = (m.fuse >= BURNS.start) | (m.waits > 0)
    drawn_flash = jnp.where(is_set, m.flash, (m.fuse + 1) >> 1)
    return (drawn_flash & GREY) == GREY


def _dynamite(m: Ram) -> Box:
    """The part of it that walls leave: it covers at most three of their columns."""
    x, width = m.dynamite_x - 1, jnp.where((m.fuse + 1) & 2 > 0, 4, 8)
    column = (x >> 2) + np.arange(3, dtype=np.int32)
    from_middle = jnp.maximum(19 - column, column - 20)
    row = jnp.minimum(m.dynamite_y >> 3, MAZE_ROWS - 1)
    walls = lookup(WALLS, MAZE_ROWS * (m.city & 3) + row)
    free = walls >> jnp.clip(from_middle, 0, 31) & 1 == 0
    edges = 4 * column
    left = jnp.where(free[0], x, jnp.where(free[1], edges[1], edges[2]))
    second = free[1] & (edges[1] < x + width)
    third = free[2] & (edges[2] < x + width)
    end = jnp.where(third, edges[2] + 4, jnp.where(second, edges[2], edges[1]))
    right = jnp.minimum(x + width, end)
    height = jnp.where(x < 8, 3, 2)
    return box(left, m.dynamite_y + MAZE_TOP, right - left, height, among(m.fuse, BURNS))


def _tank(m: Ram) -> Box:
    """The fuel that is left; the tank gets narrower at its bottom."""
    left, top, right, _ = TANK
    # Dropping dynamite takes half a unit of fuel, which does not show yet.
    dropped = (m.fuse == DROPPED) & (m.waits == 0)
    used = jnp.where(dropped & (m.used_low < 128), m.used - 1, m.used)
    inset, fuel = jnp.clip(used - 16, 0, 2), TANK_HEIGHT - used
    return box(left + inset, top + used, right - left - inset, fuel, value=fuel)


def _score(m: Ram) -> Box:
    """The digits with the $ before them, of which six fit; a score of 0 is the $ alone."""
    digits = reached(m.shown, (1, 10, 100, 1000, 10000, 100000))
    more = FONT.pitch * jnp.minimum(digits, 5)
    width = jnp.where(digits == 0, 5, 6 + more)
    shows = m.shown_high != NO_SCORE
    return box(98 - more, SCORE_TOP, width, FONT.height, shows, value=m.score)


LIVES = Cells(CAR[0], LIFE_LEFTS, LIFE_TOPS, 8, 7, whole=False)
POINTS = Blobs(GREY, STREETS, gap=(1, 0), min_size=(7, 7), max_size=(8, 7), area=(38, 48))
EXPLOSIONS = Blobs(GREY, STREETS, gap=(1, 0), min_size=(8, 7), max_size=(8, 7), area=(25, 36))
LOOT = Bounds(BLACK, (50, 179, 112, 186), value=Digits(FONT, SCORE_DIGITS, SCORE_TOP))

GAME = Game(
    name="BankHeist",
    rom=ROM.name,
    md5=ROM.md5,
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            Blobs(CAR, STREETS, max_size=(8, 7)),
            rgb=BROWN_RGB,
            doc="the getaway car, or its wreck",
        ),
        Category(
            "Bank",
            Blobs(GREY, STREETS, max_size=(8, 7), area=(34, 34)),
            count=3,
            doc="to be robbed",
        ),
        Category(
            "Police",
            Blobs(BLUE, STREETS, min_size=(3, 3), max_size=(8, 7)),
            count=3,
            doc="police cars",
        ),
        Category(
            "Dynamite",
            Blobs(WALL, (0, 38, 160, 176), min_size=(2, 1), max_size=(8, 3), max_run=3),
            doc="dropped behind the car; a spark while it explodes",
        ),
        Category("Points", POINTS, count=3, doc="for what was robbed or blown up"),
        Category("Explosion", EXPLOSIONS, count=3, doc="of a police car"),
        Category("Life", LIVES, count=6, hud=True, doc="a car each"),
        Category(
            "Gas_Tank",
            Bounds(RED, TANK, value=Gauge(1, vertical=True)),
            hud=True,
            attributes=("value",),
            doc="fuel; value: 0-25",
        ),
        Category("Score", LOOT, hud=True, attributes=("value",), doc="with its $"),
    ),
)
