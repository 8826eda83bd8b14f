"""Skiing: a skier, gates of two flags, moguls and trees that scroll up, the gates to go and the clock.

Slots are the game's records: eight of them go round while the list in RAM moves up by one at every shift, counted by byte 16. Two
are gates (Flag: left and right flag of each), two moguls, four trees. After the last gate one gate's record is a mogul (the third
slot); in downhill games the gates' records are trees (the last two slots). `orientation` of the player: where the skis point,
compass point 12 (west) over 8 (straight down) to 4 (east), from the game's 16 headings. `value`: of Score the sum of the emulator's
rewards, minus the hundredths of a second so far (the emulator ends a run with five seconds for every missed gate, as the game's
clock does); of Clock the hundredths themselves; of Player the gates to go, the number that Score's digits show.

RAM: ALE's source, OCAtari 2.2, AtariARI, and the game's display program. The frame shows the state before the latest step of the
scroll and the clock, which RAM holds already; bytes 115 and 116 are that step. A crash shows one frame late. Not in RAM: which way
the latest turn went, so the skier's picture is one frame early when it changes. Boxes are tight around what the borders leave: a
tree cut by the left border or the playfield's top is as narrow as the rows that remain.

Covered: the slalom that ALE starts (there is one mode), downhill by editing RAM, crashes, both borders, the end of the run. Scenery
that no box covers: the black frame, the maker's name.
"""

from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.boxes import Box, box
from ocjax.digits import Digits, hex_font
from ocjax.game import Game
from ocjax.ram import RamMap, bcd, bits, byte, signed
from ocjax.rules import Blobs, Bounds, Category

PINK, BLUE, RED, BLACK = 72, 134, 68, 0
GRAYS, GREENS = (10, 12), (198, 212, 214, 218)
FIELD = (8, 32, 152, 178)
GLYPHS = ("1e33333333331e", "1c3c0c0c0c0c3f", "3e23031e30303f", "1e23030603231e", "060e16263f0606",
          "3f30303e03233e", "1e31303e33331e", "3f2103060c0c0c", "1e33331e33331e", "1e33331f03231e")  # fmt: skip
TIME = Digits(
    hex_font(GLYPHS, 6, (1, 1)), (59, 68, 75, 84, 91), 16, weights=(6000, 1000, 100, 10, 1)
)
RGB = np.array(
    [
        (66, 72, 200),
        (214,) * 3,
        (110, 156, 66),
        (82, 126, 45),
        (184, 50, 50),
        (192,) * 3,
        (158, 208, 101),
        (72, 160, 72),
    ],
    np.uint8,
)


class Picture(NamedTuple):
    width: int
    rows: tuple[tuple[int, int, int], ...]  # from the top: how many, first and last column


FLAG = Picture(
    8, ((1, 3, 4), (1, 2, 4), (1, 1, 4), (1, 0, 4), (1, 1, 4), (1, 2, 4), (1, 3, 4), (7, 4, 4))
)
MOGUL = Picture(16, ((1, 8, 11), (1, 6, 13), (1, 2, 13), (2, 0, 15), (1, 2, 11)))
THIN = (
    (2, 7, 7),
    (1, 6, 7),
    (2, 6, 8),
    (2, 5, 8),
    (3, 5, 9),
    (2, 4, 9),
    (1, 4, 10),
    (1, 4, 8),
    (1, 4, 11),
)
THICK = (
    (1, 6, 11),
    (2, 4, 11),
    (2, 2, 11),
    (1, 2, 9),
    (1, 2, 13),
    (2, 0, 13),
    (2, 0, 15),
    (1, 2, 15),
    (1, 6, 15),
    (1, 2, 13),
    (1, 4, 11),
)
TREE = Picture(16, THIN + THICK)


class Ram(RamMap):
    heading = bits(15, count=4)  # 0: west ... 15: east
    crashed = bits(15, first=6)
    speed = byte(14)
    turn = byte(16)  # the record at the end of the list, modulo 8
    state = byte(17)  # 0: skiing, 255: the run has ended
    x = byte(25)  # already moved
    y = byte(26)  # 120; 124 in a jump
    heights = byte(*range(54, 62))  # last row of the picture that shows; 255: none
    object_x = byte(*range(62, 70))
    kinds = byte(*range(78, 86))
    object_y = byte(*range(86, 94))  # row above the playfield's end
    scroll_x = byte(95)  # what the skier could not move at a border
    event = byte(97)  # 224 on the frame of a crash or a passed gate
    patience = byte(98)  # frames till the next turn
    step = signed(115, 116)  # latest movement: skier or hill, right; hill, up
    time = bcd((104, 105, 106))  # minutes, seconds, hundredths
    gates = bcd(107)


def decode(m: Ram) -> dict[str, Box]:
    skiing = m.state == 0
    # the list in the order of the records: record k is at (turn + 7 - k) modulo 8
    turn = jnp.where(m.state == 255, m.turn + 1, m.turn)  # the run ended before the list moved
    packed = m.heights | m.object_x << 8 | m.object_y << 16 | m.kinds << 24
    records = packed.at[(turn + 7 - RECORD) & 7].get(mode="promise_in_bounds")
    boxes = _tight(records, jnp.where(skiing, m.step[1], 0))
    # colours of the eight kinds: the last gate is red; a mogul or trees in a gate's place are of kinds 5 and 7
    ends = jnp.where(
        (records[:4, None] >> 24 & 7) == 4, jnp.asarray(RGB[4:5]), jnp.asarray(RGB[:1])
    )
    rgb = ends, jnp.asarray(RGB[[1, 5, 5]]), jnp.asarray(RGB[[2, 3, 6, 7, 7, 7]])
    flags, moguls, trees = (
        replace(box(*(v[a:b] for v in boxes)), rgb=c)
        for a, b, c in zip((0, 4, 7), (4, 7, 13), rgb, strict=True)
    )
    minutes = m.time // 10000
    hundredths = m.time - 4000 * minutes
    return {
        "Player": _player(m, skiing),
        "Flag": flags,
        "Mogul": moguls,
        "Tree": trees,
        "Score": _score(m, -hundredths),
        "Clock": box(59, 16, 38, 7, value=hundredths),
    }


def _cuts(picture: Picture) -> np.ndarray:
    """What remains of a picture that is cut: x, y, w, h, five bits each, by rows cut (above < 0 < below) and columns cut."""
    rows = [(first, last) for n, first, last in picture.rows for _ in range(n)]
    ink = np.array([[first <= c <= last for c in range(picture.width)] for first, last in rows])
    height, width = ink.shape
    table = np.zeros((2 * height + 1, 2 * width + 1), np.int32)
    for i, j in np.ndindex(table.shape):
        y, x = max(height - i, 0), max(width - j, 0)
        ys, xs = np.nonzero(ink[y : 2 * height - i, x : 2 * width - j])
        if len(ys):
            table[i, j] = (
                (x + xs.min())
                | (y + ys.min()) << 5
                | (np.ptp(xs) + 1) << 10
                | (np.ptp(ys) + 1) << 15
            )
    return table


def _tight(record: jax.Array, moved: jax.Array) -> tuple[jax.Array, ...]:
    """Tight boxes of what the playfield leaves of four flags, three moguls and six trees: x, y, w, h, whether they exist."""
    height, x, y, kind = record & 255, record >> 8 & 255, record >> 16 & 255, record >> 24 & 7
    shows = jnp.where(kind & 2 == 2, 2, kind & 1)  # 0: gate, 1: mogul, 2: tree
    exists = (height < 32) & (shows == SHOWS)
    left, above, right, below = FIELD  # the same distance from both sides of the screen
    x = x + jnp.where(
        (SHOWS == 2) & (height > 15), -3, SHIFT
    )  # without its thin part a tree is five to the left
    x = jnp.where(x >= 160, x - 160, x)  # the screen is a ring of 160 columns:
    x = jnp.where(
        x >= right, x - 160, x
    )  # what begins in the right border may show at the left one
    mirrored = kind > 3
    x = jnp.where(mirrored, 160 - WIDTH - x, x)
    end = 180 + height - y + moved
    y = end - HEIGHT
    row = (
        jnp.clip(jnp.minimum(y - above, 0) + jnp.maximum(end - below, 0), -HEIGHT, HEIGHT) + HEIGHT
    )
    column = (
        jnp.clip(jnp.minimum(x - left, 0) + jnp.maximum(x + WIDTH - right, 0), -WIDTH, WIDTH)
        + WIDTH
    )
    rest = (
        jnp.asarray(CUTS).at[TABLE + row * (2 * WIDTH + 1) + column].get(mode="promise_in_bounds")
    )
    w = rest >> 10 & 31
    x = x + (rest & 31)
    return jnp.where(mirrored, 160 - w - x, x), y + (rest >> 5 & 31), w, rest >> 15, exists


def _player(m: Ram, skiing: jax.Array) -> Box:
    slope = jnp.minimum(m.heading, 15 - m.heading)  # 7: straight down
    fell = m.crashed == 1
    rose = (
        ~fell & (m.speed == 1) & (slope > 0) & (m.patience != slope + 1)
    )  # the crash shows once more
    lying = (fell & (m.event != 224)) | rose
    pose = jnp.where(lying, 4, slope >> 1)
    top = jnp.where(pose == 0, 0, jnp.where(pose < 3, 1, jnp.where(pose == 3, 2, 5)))
    height = jnp.where(pose == 0, 16, jnp.where((pose == 1) | (pose == 4), 15, 18))
    width = jnp.where((pose == 2) | (pose == 3), 7, 8)
    mirrored = m.heading < 8
    start = jnp.where((pose == 3) ^ (mirrored & (width == 7)), 1, 0)
    ahead = m.x + m.step[0]  # whoever would leave the hill with the next step stands still
    moved = jnp.where(skiing & (m.scroll_x == 0) & (ahead >= 8) & (ahead < 144), m.step[0], 0)
    compass = 12 - ((m.heading + 1) >> 1)
    return box(
        m.x - moved + 1 + start, 159 - m.y + top, width, height, value=m.gates, orientation=compass
    )


def _score(m: Ram, value: jax.Array) -> Box:
    gates = jnp.where(
        (m.event == 224) & (m.crashed == 0), m.gates + 1, m.gates
    )  # shown one frame late
    two = gates > 9
    return box(jnp.where(two, 67, 75), 6, jnp.where(two, 14, 6), 7, value=value)


_TABLES = [_cuts(p) for p in (FLAG, MOGUL, TREE)]
SHOWS = np.repeat(np.arange(3, dtype=np.int32), [4, 3, 6])
RECORD = np.array([0, 0, 4, 4, 1, 5, 0, 2, 3, 6, 7, 0, 4], np.int32)
SHIFT = np.array([1, 33, 1, 33, *[2] * 9], np.int32)  # from the record's x
CUTS = np.concatenate([t.ravel() for t in _TABLES])
TABLE = np.array([0, _TABLES[0].size, _TABLES[0].size + _TABLES[1].size], np.int32)[SHOWS]
HEIGHT, WIDTH = (np.array([t.shape[i] // 2 for t in _TABLES], np.int32)[SHOWS] for i in (0, 1))

GAME = Game(
    name="Skiing",
    rom="skiing",
    md5="b76fbadc8ffb1f83e2ca08b6fb4d6c9f",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            Bounds(PINK, FIELD),
            attributes=("orientation", "value"),
            doc="12 west, 8 down, 4 east; value: gates to go",
        ),
        Category(
            "Flag",
            Blobs((BLUE, RED), FIELD, gap=(4, 8), max_size=(5, 14)),
            count=4,
            doc="left and right one of two gates",
        ),
        Category(
            "Mogul",
            Blobs(GRAYS, FIELD, gap=(8, 4), max_size=(16, 6)),
            count=3,
            doc="bump in the snow",
        ),
        Category(
            "Tree",
            Blobs(GREENS, FIELD, gap=(8, 4), max_size=(16, 30)),
            count=6,
            doc="two more in downhill games",
        ),
        Category(
            "Score",
            Bounds(BLACK, (20, 4, 140, 14)),
            hud=True,
            attributes=("value",),
            doc="gates to go; value: minus the hundredths",
        ),
        Category(
            "Clock",
            Bounds(BLACK, (20, 14, 140, 26), value=TIME),
            hud=True,
            attributes=("value",),
            doc="hundredths of a second",
        ),
    ),
)
