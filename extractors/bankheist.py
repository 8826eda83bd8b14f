"""Bank Heist: a getaway car, three banks, the police cars that come out of them, and dynamite.

Picture: docs/games/BankHeist.png

Screen: fuel, spare cars and the loot are outside the maze. If three objects share lines, the game
alternates them. After an explosion the streets flash. While they have the grey of banks, points and
explosions, these objects are invisible and not valid. Walls hide dynamite. Scenery: the empty part
of the tank, the mark beside it (the fuel level after this city), the spark that dynamite leaves.

Slots: the game keeps four records. One is the getaway car. Each of the other three is successively
a bank, the points for its robbery, a police car, and its explosion. The slots of Bank, Points,
Police and Explosion are these three.

RAM: ALE's source (score, lives), OCAtari 2.2 (positions, kinds), and the ROM's code. The game moves
cars after it draws them. Before that, it stores their x coded for the video chip, and their y and
picture in pointers to the pictures.

Covered: all cities, robberies, explosions, wrecks, empty tanks, game over, ALE's modes and
difficulties.

Not exact: the RAM lacks the brightness of the streets on the frame of an explosion. Not covered:
the changing colours after nine minutes without input, and the copyright line that alternates with
the score after the game (Score is not valid then).

Terrain: the walls of the city's maze, one of four. Dynamite that is hidden in them counts as wall.

VEM: it reports a third police car if two touch around a corner. It misses points if the car covers
more than about half of them.
"""

import functools
from dataclasses import replace

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
    Digits,
    Game,
    Gauge,
    LivesAsIcons,
    RamMap,
    Rom,
    Saver,
    Shape,
    ShortRuns,
    TerrainKind,
    TerrainMap,
    among,
    area_mask,
    bcd,
    box,
    byte,
    display,
    div,
    lookup,
    match,
    packed_position,
    pick,
    playfield,
    when,
)

ROM = Rom("bank_heist", "00ce0bdd43aed84a983bef38fe7f5ee3")
DIGIT_AT = (0xF46, 0xF20, 0xF33, 0xF3A, 0xF59, 0xF2D, 0xF52, 0xF1A, 0xF4C, 0xF40)
DOLLAR = tuple(ROM.rows(0xF26, 7).tolist())
FONT = replace(ROM.font(DIGIT_AT, rows=7), signs=(DOLLAR,))

PICTURE_BYTES = 12  # bytes per picture


class Page:  # of `Ram.page`
    BANK = 0xFD  # also the wreck
    CAR = 0xFE
    POINTS = 0xFF  # also the explosion


class Low:  # low bytes of the addresses of pictures
    EXPLOSION = 0x83
    FRONT_CARS = 0xC8  # the second one is two pictures further


AWAY = 136  # least `y` of a record outside the maze
ALONGSIDE = range(-6, 3)  # rows from dynamite to a record drawn beside it
OUTSIDE = 12  # columns beside the maze's outer wall
DROPPED = 84  # `fuse` on the frame of the drop
LIT = range(63, 84)  # `fuse` of visible dynamite
COPYRIGHT = 171  # `shown_high`

GRAY = 6  # banks, points, explosions
BLUE = 130  # police cars
BLACK = 0
RED = 66  # fuel
CAR_COLORS = (36, 64)  # the second colour means little fuel
WALL_SHADES = (22, 42, 46, 118, 182)
WALL_COLORS = ROM.bytes(0xDDC, 4).tolist()  # by maze, without the brightness
MAZE_TOP = 37
MAZE_ROWS = 17  # of eight rows of pixels each
MAZE_COLUMNS = 40  # of four columns of pixels each
MAZE_BOTTOM = 178  # below the lowest wall, which has 5 rows of pixels
SCREEN_ROWS = 210
STREETS = (8, 38, 152, 176)
ICON_X = 90 + 16 * (np.arange(6) % 3)
ICON_Y = np.where(np.arange(6) < 3, 27, 15)
TANK_ROWS = 25


def _read_mazes() -> np.ndarray:
    """The walls of the four mazes, bool `[mazes, MAZE_ROWS, 160]`."""
    table = ROM.data[0xE00 : 0xE00 + 8 * MAZE_ROWS].reshape(MAZE_ROWS, 2, 4)
    outer = ROM.data[0xF09 : 0xF09 + MAZE_ROWS]  # empty except a wall with two gates
    middle, inner = table.transpose(1, 2, 0)
    return playfield(np.broadcast_to(outer, middle.shape), middle, inner, mirrored=True)


MAZES = _read_mazes()
# The left half of each row, by MAZE_ROWS * maze + row; the leftmost of 20 columns is bit 19.
WALLS = MAZES[..., :80:4].dot(1 << np.arange(20)[::-1]).ravel()

SAVER_MASK = 0xF7  # the screen saver drops a bit of colours


class Ram(RamMap):
    city = byte(0)
    saver_mask = byte(3)  # the game masks colours with it: 0xFF in play
    saver_key = byte(4)  # the game XORs colours with it
    frame = byte(6)
    # The car's record, then the three others.
    y = byte(8, 9, 10, 11)  # y - 37; already moved on
    picture = byte(19, 20, 21, 22)  # low byte of its address, less y - 37
    page = byte(23, 24, 25, 26)  # high byte of its address
    x = byte(28, 29, 30, 31)  # already moved on
    place = byte(33, 34, 35, 36)  # x + 1 in the chip's coding; 0 on the first frame of a game
    dynamite_y = byte(12)  # y - 37
    dynamite_x = byte(32)  # x + 1
    fuse = byte(63)  # counts down from 84
    waits = byte(64)  # the game will drop dynamite at the next line
    flash = byte(69)  # brightness of the streets and walls
    car_color = byte(74)  # as shown, also in the screen saver
    lives = byte(85)
    used = byte(86)  # fuel, in rows of the tank
    used_low = byte(87)  # fuel, in 256ths of a row
    score = bcd((88, 89, 90))
    shown = bcd((91, 92, 93))  # the score on the screen
    shown_high = byte(91)


def decode(m: Ram) -> dict[str, Box]:
    records = _record_boxes(m)
    color = m.car_color ^ jnp.maximum(_saver_key(m), 0)
    player = replace(records[0], color=color)
    others = records[1:]
    page = m.page[1:]
    is_points = (page == Page.POINTS) & (_low_byte(m)[1:] != Low.EXPLOSION)
    is_burst = (page != Page.CAR) & (page != Page.BANK) & ~is_points
    visible = ~_streets_are_grey(m)
    return {
        "Player": player,
        "Bank": others.where(visible & (page == Page.BANK)),
        "Police": others.where(page == Page.CAR),
        "Dynamite": _dynamite(m, records),
        "Points": others.where(visible & is_points),
        "Explosion": others.where(visible & is_burst),
        "Life": box(ICON_X, ICON_Y, 8, 7, np.arange(6) < m.lives),
        "Gas_Tank": _tank(m),
        "Score": _score(m),
    }


def _low_byte(m: Ram) -> jax.Array:
    """Low bytes of the addresses of the records' pictures."""
    return (m.picture + m.y) & 255


def _record_boxes(m: Ram) -> Box:
    """Boxes of the four records as drawn."""
    starts = m.place == 0  # before the first move, the car shows its side
    is_car = (m.page == Page.CAR) & ~starts
    second = (m.frame & 4) == 0  # of two pictures
    front_picture = Low.FRONT_CARS + when(second, 2 * PICTURE_BYTES)
    side_y = ((front_picture - m.picture) & 255) - PICTURE_BYTES
    is_front = is_car & (m.y - side_y > 6)
    y = match((is_front, side_y + PICTURE_BYTES), (is_car, side_y), otherwise=m.y)
    x = jnp.where(starts, m.x, packed_position(m.place) - 1 + when(is_front, 1))
    width = match((is_front, 6), (_has_narrow_points(m), 7), otherwise=8)
    is_wreck = (m.page == Page.BANK) & (np.arange(4) == 0)
    height = jnp.where((is_front & second) | is_wreck, 6, 7)
    return box(x, y + MAZE_TOP, width, height, m.y < AWAY)


def _has_narrow_points(m: Ram) -> jax.Array:
    """True for points a column narrower than 10, 40 and 60."""
    low = _low_byte(m)
    tens = div(low + 1, PICTURE_BYTES) - 11
    is_points = (m.page == Page.POINTS) & (low != Low.EXPLOSION)
    return is_points & ~among(tens, (1, 4, 6))


def _streets_are_grey(m: Ram) -> jax.Array:
    """True if the flash had made the streets as grey as banks on this frame."""
    counting = (m.fuse >= LIT.start) | (m.waits > 0)
    flash = jnp.where(counting, m.flash, (m.fuse + 1) >> 1)
    return (flash & 6) == 6


def _dynamite(m: Ram, records: Box) -> Box:
    left, right = _dynamite_columns(m)
    # Beside two drawn records, its end ($F7FE) comes too late for the first columns.
    beside = records.valid & among(records.y - m.dynamite_y - MAZE_TOP, ALONGSIDE)
    longer = (m.dynamite_x - 1 < OUTSIDE) & (jnp.sum(when(beside, 1)) > 1)
    height = jnp.where(longer, 3, 2)
    color = pick(m.city & 3, WALL_COLORS) | m.flash
    there = among(m.fuse, LIT)
    return box(left, m.dynamite_y + MAZE_TOP, right - left, height, there, color=color)


def _dynamite_columns(m: Ram) -> tuple[jax.Array, jax.Array]:
    """Left and right edge of dynamite outside the walls, which share its colour."""
    x = m.dynamite_x - 1
    width = jnp.where(((m.fuse + 1) & 2) != 0, 4, 8)
    row = jnp.minimum(m.dynamite_y >> 3, MAZE_ROWS - 1)
    column = (x >> 2) + np.arange(3)  # the columns of the maze that it may touch
    half = MAZE_COLUMNS // 2
    bit = jnp.maximum(half - 1 - column, column - half)  # the right half mirrors the left one
    maze_row = lookup(WALLS, MAZE_ROWS * (m.city & 3) + row)
    free = (maze_row >> jnp.clip(bit, 0, 31) & 1) == 0
    edges = 4 * column
    left = match((free[0], x), (free[1], edges[1]), otherwise=edges[2])
    in_second = free[1] & (edges[1] < x + width)
    in_third = free[2] & (edges[2] < x + width)
    end = match((in_third, edges[2] + 4), (in_second, edges[2]), otherwise=edges[1])
    return left, jnp.minimum(x + width, end)


def _tank(m: Ram) -> Box:
    """The fuel; half a unit that a dynamite drop has just used is still visible."""
    just_dropped = (m.fuse == DROPPED) & (m.waits == 0) & (m.used_low < 128)
    used = m.used - when(just_dropped, 1)
    inset = jnp.clip(used - 16, 0, 2)
    rows = TANK_ROWS - used
    return box(42 + inset, 12 + used, 8 - inset, rows, value=rows)


def _score(m: Ram) -> Box:
    """The number with its $; at first the $ alone."""
    digits = jnp.sum(jnp.where(m.shown >= np.array((1, 10, 100, 1000, 10000, 100000)), 1, 0))
    before_last = 8 * jnp.minimum(digits, 5)
    width = jnp.where(digits == 0, 5, 6 + before_last)
    return box(98 - before_last, 179, width, 7, m.shown_high != COPYRIGHT, value=m.score)


three = functools.partial(Category, count=3)
sprites = functools.partial(Blobs, shapes=Shape(w=(1, 8), h=(1, 7)))

POLICE = Blobs(BLUE, STREETS, Shape(w=(3, 16), h=(3, 14), split=(8, 7)))  # two may touch
STICKS = Blobs(
    WALL_SHADES, (0, 38, 160, 176), Shape(w=(2, 8), h=(2, 3)), gap=(4, 0), filters=(ShortRuns(3),)
)
COVERED = sprites(GRAY, STREETS, gap=(2, 0), shapes=Shape(w=(7, 8), h=7, pixels=(10, 40)))
LOOT = sprites(
    GRAY,
    STREETS,
    gap=(1, 0),
    shapes=Shape(w=(7, 8), h=7, pixels=(38, 48)),
    also=(COVERED,),  # by the car
)
BURST = sprites(GRAY, STREETS, gap=(1, 0), shapes=Shape(w=8, h=7, pixels=(25, 36)))
ICONS = Cells(CAR_COLORS[0], tuple(ICON_X.tolist()), tuple(ICON_Y.tolist()), 8, 7, whole=False)
FUEL = Bounds(RED, (42, 12, 50, 37), value=Gauge(1, side="h"))
AMOUNT = Bounds(BLACK, (50, 179, 112, 186), value=Digits(FONT, range(57, 105, 8), 179))


def _saver_key(m: Ram) -> jax.Array:
    """The key that colours are XORed with, or -1 in play."""
    return jnp.where(m.saver_mask == SAVER_MASK, m.saver_key, -1)


def _layouts() -> np.ndarray:
    """The walls of each maze on the screen, bool `[mazes, 1, H, 160]`."""
    rows = np.repeat(MAZES, 8, axis=1)
    lowest = np.repeat(MAZES[:, :1], MAZE_BOTTOM - MAZE_TOP - rows.shape[1], axis=1)
    pixels = np.concatenate([rows, lowest], axis=1)
    return np.pad(pixels, ((0, 0), (MAZE_TOP, SCREEN_ROWS - MAZE_BOTTOM), (0, 0)))[:, None]


def _seen(frame: jax.Array) -> dict[str, jax.Array]:
    """The pixels in the walls' colours, in the maze's rows."""
    return {"wall": among(frame, WALL_SHADES) & area_mask((0, MAZE_TOP, 160, MAZE_BOTTOM))}


TERRAIN = TerrainMap(
    kinds=(TerrainKind("wall", "the maze's walls", effect="blocks"),),
    layouts=_layouts(),
    layout=lambda m: m.city & 3,
    seen=_seen,
)

GAME = Game(
    name="BankHeist",
    rom=ROM,
    ram=Ram,
    decode=decode,
    saver=Saver(_saver_key, (12, 11), 128, mask=SAVER_MASK),
    checks=Checks(
        rare=("Points", "Police"),
        lives=(LivesAsIcons(("Life",)),),
    ),
    terrain=TERRAIN,
    categories=(
        Category(
            "Player", sprites(CAR_COLORS, STREETS), role="player", doc="the car, or its wreck"
        ),
        three(
            "Bank",
            sprites(GRAY, STREETS, shapes=Shape(w=(1, 8), h=(1, 7), pixels=34)),
            doc="to be robbed",
        ),
        three("Police", POLICE, doc="police cars"),
        Category("Dynamite", STICKS, doc="dropped behind the car"),
        three("Points", LOOT, doc="for what was robbed or blown up"),
        three("Explosion", BURST, doc="of a police car"),
        display("Life", ICONS, count=6, attributes=(), role="lives", doc="a car each"),
        display("Gas_Tank", FUEL, doc="fuel; value: 0-25"),
        display("Score", AMOUNT, role="score", doc="with its $"),
    ),
)
