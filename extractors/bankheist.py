"""Bank Heist: a getaway car, three banks and the police cars that come out of them, dynamite; fuel, cars and loot outside the maze.

The game keeps four records: the getaway car, and three that are each a bank, the points for its robbery, a police car, or its explosion
in turn; the slots of Bank, Police, Points and Explosion are these three. What shares its lines with two others takes turns with them.
After an explosion the streets flash: where they are as grey as banks, those do not show and are not valid. Walls hide dynamite.

RAM: ALE's source (score, lives), OCAtari 2.2 (positions, kinds), and the ROM's code: it moves cars after they have been drawn, but leaves
their positions as it coded them for the video chip (x) and as addresses of the pictures (y, and which picture), before.

Covered: all cities, robberies, explosions, wrecks, empty tanks, game over, ALE's modes and difficulties. Scenery that no box covers: the
maze, the empty part of the tank and the mark beside it, which shows how full it will be after the city; the spark where dynamite was.
Not in the RAM: the streets' brightness on the frame of an explosion. Not covered: the changing colours after nine minutes without
input, the copyright line that takes turns with the score after the game (Score is not valid then).
"""

import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box
from ocjax.digits import Digits, hex_font
from ocjax.game import Game
from ocjax.ram import RamMap, bcd, byte
from ocjax.rules import Blobs, Bounds, Category, Cells, Gauge

GREY, BLUE, BLACK, RED = 6, 130, 0, 66
CAR = (36, 64)  # the second while there is little fuel
WALL = (22, 42, 46, 118, 182)
STREETS = (8, 38, 152, 176)
MAZES = (
    "1ffff100001393e101001cf27000201ccf910c0113cf80000113fe7120001067e1e6401064e13e4810001"
    "1ffff10001139f9109001c93e009001c03f10f0013833001f013803121901279e101801381913e7910000"
    "1ffff1008013c9f100011cf38008011c93f10100139cf02008127c912001104c81e4cf1040013cce100c0"
    "1ffff1000813fce101c01c80f00e401c07e10e0013873001c01f9ce1000e13e401004e1cfc81030113038"
)
WALLS = np.array(
    [int(MAZES[i : i + 5], 16) for i in range(0, len(MAZES), 5)], np.int32
)  # 17 rows each, bit 19: both outermost columns
HIDDEN = 0x88  # y of who is not in the maze
CARS, EXPLOSION, POINTS = 0xBC, 0x83, 0x8F  # low bytes of the pictures' addresses
GLYPHS = ("3c66666666663c", "3878181818187e", "7c46063c60607e", "3c46060c06463c", "0c1c2c4c7e0c0c",
          "7e60607c06467c", "3c62607c66663c", "7e460c18303030", "3c66663c66663c", "3c66663e06463c")  # fmt: skip


class Ram(RamMap):
    y = byte(8, 9, 10, 11)  # screen y - 37; already moved on
    dynamite_y = byte(12)  # screen y - 37
    picture = byte(19, 20, 21, 22)  # low byte of its address - y
    page = byte(
        23, 24, 25, 26
    )  # its high byte: 254 cars, 253 banks and a wreck, 255 points and explosions
    dynamite_x = byte(32)
    place = byte(33, 34, 35, 36)  # x + 1 = 15 * low nibble + (7 ^ high nibble)
    frame = byte(6)
    fuse = byte(63)  # 84: just dropped, explodes below 64
    waits = byte(64)  # dynamite is to be dropped at the next line
    flash = byte(69)  # brightness of the streets
    robbed = byte(83)
    lives = byte(85)
    used = byte(86)  # fuel
    used_low = byte(87)
    city = byte(0)
    score = bcd((88, 89, 90))
    shown = bcd((91, 92, 93))  # as on the screen
    shown_high = byte(91)  # 171: copyright


def decode(m: Ram) -> dict[str, Box]:
    second = m.frame & 4 == 0  # of two pictures
    car, bank = m.page == 254, m.page == 253
    seen = (
        (CARS + 12 + jnp.where(second, 24, 0) - m.picture) & 255
    ) - 12  # y, less 12 if seen from the front
    front = car & (m.y - seen > 6)
    y = jnp.where(car, jnp.where(front, seen + 12, seen), m.y)
    x = 15 * (m.place & 15) + (7 ^ (m.place >> 4)) - 1
    picture = (m.picture + m.y) & 255
    wreck = bank & (jnp.arange(4) == 0)
    points = (m.page == 255) & (picture != EXPLOSION)
    narrow = points & (
        0b101001 >> jnp.minimum((picture - POINTS) * 43 >> 9, 31) & 1 == 0
    )  # all but 10, 40, 60
    width = jnp.where(front, 6, jnp.where(narrow, 7, 8))
    x, y = x + jnp.where(front, 1, 0), y + 37
    height = jnp.where((front & second) | wreck, 6, 7)
    here = m.y < HIDDEN
    others = box(x[1:], y[1:], width[1:], height[1:], here[1:])
    old_flash = jnp.where((m.fuse >= 63) | (m.waits > 0), m.flash, (m.fuse + 1) >> 1)
    grey = (m.page[1:] != 254) & (old_flash & 6 != 6)

    digits = jnp.sum(jnp.where(m.shown >= jnp.array((1, 10, 100, 1000, 10000, 100000)), 1, 0))
    icon = jnp.arange(6)
    # dropping dynamite takes half a unit of fuel, which does not show yet
    used = jnp.where((m.fuse == 84) & (m.waits == 0) & (m.used_low < 128), m.used - 1, m.used)
    inset = jnp.clip(used - 16, 0, 2)
    return {
        "Player": box(x[0], y[0], width[0], height[0], here[0]),
        "Bank": others.where(grey & bank[1:]),
        "Police": others.where(car[1:]),
        "Dynamite": _dynamite(m),
        "Points": others.where(grey & points[1:]),
        "Explosion": others.where(grey & ~points[1:] & ~bank[1:]),
        "Life": box(90 + 16 * (icon % 3), jnp.where(icon < 3, 27, 15), 8, 7, icon < m.lives),
        "Gas_Tank": box(42 + inset, 12 + used, 8 - inset, 25 - used, value=25 - used),
        "Score": box(
            98 - 8 * jnp.minimum(digits, 5),
            179,
            jnp.where(digits == 0, 5, 6 + 8 * jnp.minimum(digits, 5)),
            7,
            m.shown_high != 171,
            value=m.score,
        ),
    }


def _dynamite(m: Ram) -> Box:
    """What walls leave of it: they have the same colour."""
    x, width = m.dynamite_x - 1, jnp.where((m.fuse + 1) & 2 > 0, 4, 8)
    row = jnp.minimum(m.dynamite_y >> 3, 16)
    walls = jnp.asarray(WALLS)[17 * (m.city & 3) + row]
    column = (x >> 2) + jnp.arange(3)
    free = walls >> jnp.clip(jnp.maximum(19 - column, column - 20), 0, 31) & 1 == 0
    edges = 4 * column
    left = jnp.where(free[0], x, jnp.where(free[1], edges[1], edges[2]))
    second, third = free[1] & (edges[1] < x + width), free[2] & (edges[2] < x + width)
    right = jnp.minimum(
        x + width, jnp.where(third, edges[2] + 4, jnp.where(second, edges[2], edges[1]))
    )
    return box(
        left,
        m.dynamite_y + 37,
        right - left,
        jnp.where(x < 8, 3, 2),
        (m.fuse >= 63) & (m.fuse < 84),
    )


def icons() -> Cells:
    return Cells(
        CAR[0],
        tuple(90 + 16 * (i % 3) for i in range(6)),
        tuple(27 if i < 3 else 15 for i in range(6)),
        8,
        7,
        whole=False,
    )


GAME = Game(
    name="BankHeist",
    rom="bank_heist",
    md5="00ce0bdd43aed84a983bef38fe7f5ee3",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            Blobs(CAR, STREETS, max_size=(8, 7)),
            rgb=(162, 98, 33),
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
        Category(
            "Points",
            Blobs(GREY, STREETS, gap=(1, 0), min_size=(7, 7), max_size=(8, 7), area=(38, 48)),
            count=3,
            doc="for what was robbed or blown up",
        ),
        Category(
            "Explosion",
            Blobs(GREY, STREETS, gap=(1, 0), min_size=(8, 7), max_size=(8, 7), area=(25, 36)),
            count=3,
            doc="of a police car",
        ),
        Category("Life", icons(), count=6, hud=True, doc="a car each"),
        Category(
            "Gas_Tank",
            Bounds(RED, (42, 12, 50, 37), value=Gauge(1, vertical=True)),
            hud=True,
            attributes=("value",),
            doc="fuel; value: 0-25",
        ),
        Category(
            "Score",
            Bounds(
                BLACK,
                (50, 179, 112, 186),
                value=Digits(hex_font(GLYPHS, 8, (1, 1)), tuple(range(57, 98, 8)), 179),
            ),
            hud=True,
            attributes=("value",),
            doc="with its $",
        ),
    ),
)
