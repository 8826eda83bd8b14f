"""Skiing: a skier on a hill of gates, moguls and trees, the gates that remain, and the clock.

The hill scrolls up under the skier. The game keeps eight records of what is on it. They take turns:
at every shift the list in RAM moves up by one, and byte 16 counts the shifts. Slots are records:
two are gates (Flag: the left and the right flag of each), two are moguls, and four are trees. After
the last gate, one gate's record holds a mogul (the third slot); in downhill games, the gates'
records hold trees (the last two slots). The black frame and the maker's name are scenery.

Player's `orientation` is the direction of the skis, from 12 (west) over 8 (straight down) to 4
(east), derived from the game's 16 headings; its `value` is the number of gates that remain, which
the digits of Score show. Score's `value` is the sum of the emulator's rewards: minus the hundredths
of a second so far. The emulator ends a run with five seconds for every missed gate, as the game's
clock does. Clock's `value` is the hundredths.

RAM: ALE's source, OCAtari 2.2, AtariARI, and the game's display program. Pictures, digits and
colours are the ROM's. RAM already holds the latest step of the scroll and of the clock, which the
frame does not show yet; bytes 115 and 116 are that step. A crash shows one frame late. Boxes are
tight around what the borders leave: a tree that the left border or the top of the playfield cuts is
as narrow as its remaining rows.

Covered: the slalom that ALE starts (its only mode), downhill by editing RAM, crashes, both borders,
the end of the run. Not in the RAM: to which side the latest turn went, so that the skier's picture
is one frame early when it changes.
"""

import functools
from dataclasses import replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.boxes import WIDTH, Box, box
from ocjax.console import wrap
from ocjax.digits import Digits, Font, score_box
from ocjax.game import Game
from ocjax.ops import div, lookup, shared
from ocjax.ram import RamMap, bcd, bits, byte, signed
from ocjax.rom import Rom
from ocjax.rules import Blobs, Bounds, Category
from ocjax.vision.palette import NTSC

ROM = Rom("skiing", "b76fbadc8ffb1f83e2ca08b6fb4d6c9f")

# Digits: the bottom rows of all of them, then the rows above, 16 bytes apart.
GLYPHS = [ROM.bytes(0x700 + digit, 7, step=16)[::-1] for digit in range(10)]
FONT = Font(tuple(tuple(glyph.tolist()) for glyph in GLYPHS), dots=6)
CLOCK_DIGITS, CLOCK_TOP = (59, 68, 75, 84, 91), 16  # left columns: minute, seconds, hundredths
SCORE_RIGHT, SCORE_TOP = 81, 6

# Pictures of the skier: heading west, ..., almost down, down; lying.
SKIER = ROM.pictures((0x6D6, 0x6B0, 0x6C3, 0x6EA, 0x6A0), 20)
LYING = 4
JUST_NOW = 224  # `event` on the frame of a crash or of a passed gate
RUNNING, ENDED = 0, 255  # states of the run

PINK, BLUE, RED, BLACK = 72, 134, 68, 0
GRAYS, GREENS = (10, 12), (198, 212, 214, 218)
FIELD = (8, 32, 152, 178)
LEFT, TOP, RIGHT, BOTTOM = FIELD

GATES, MOGULS, TREES = (0, 4), (1, 5), (2, 3, 6, 7)  # kinds of objects
LAST_GATE = 4
FIRST_MIRRORED = 4  # kinds from here on are drawn from right to left
KIND_COLORS = ROM.bytes(0x7BB, 8)
UNUSED = 32  # `height` of a record that shows nothing, or more

# Slots: numbers of the records; kinds whose colours the slots have.
FLAG_RECORDS = (0, 0, 4, 4)
MOGUL_RECORDS, MOGUL_KINDS = (1, 5, 0), (1, 5, 5)
TREE_RECORDS, TREE_KINDS = (2, 3, 6, 7, 0, 4), (2, 3, 6, 7, 7, 7)
FLAG_LEFTS = np.array((1, 33, 1, 33), np.int32)  # from the record's x


def _ink(offset: int, rows: int, dot: int) -> np.ndarray:
    """Which pixels of a picture are set, bool `[rows, 8 * dot]`; `dot` is the width of a dot."""
    dots = ROM.rows(offset, rows)[:, None] >> np.arange(7, -1, -1) & 1
    return (dots == 1).repeat(dot, axis=1)


def _cuts(ink: np.ndarray) -> np.ndarray:
    """The tight box of what remains of a picture that the playfield cuts.

    Args:
        ink: bool `[height, width]`.

    Returns:
        int32 `[2 * height + 1, 2 * width + 1]`: x, y, width and height, five bits each, by the
        rows and by the columns that are cut. Negative numbers, cut above or on the left, come
        first.
    """
    height, width = ink.shape
    table = np.zeros((2 * height + 1, 2 * width + 1), np.int32)
    for i, j in np.ndindex(table.shape):
        y, x = max(height - i, 0), max(width - j, 0)
        ys, xs = np.nonzero(ink[y : 2 * height - i, x : 2 * width - j])
        if len(ys):
            corner = (x + xs.min()) | (y + ys.min()) << 5
            table[i, j] = corner | (np.ptp(xs) + 1) << 10 | (np.ptp(ys) + 1) << 15
    return table


THIN_ROWS, THICK_ROWS = 14, 16  # of a tree: its top, its lower part
THIN = np.pad(_ink(0x78F, THIN_ROWS, dot=1), ((0, 0), (4, 4)))
FLAG = _cuts(_ink(0x770, 14, dot=1))
MOGUL = _cuts(_ink(0x79E, 6, dot=2))
TREE = _cuts(np.concatenate([THIN, _ink(0x77F, THICK_ROWS, dot=2)]))


class Ram(RamMap):
    speed = byte(14)
    heading = bits(15, count=4)  # 0: west, ..., 15: east
    crashed = bits(15, first=6)
    turn = byte(16)  # number of the record at the end of the list, modulo 8
    state = byte(17)  # of the run
    x = byte(25)  # of the skier, x - 1; already moved
    y = byte(26)  # 120; 124 in a jump
    heights = byte(*range(54, 62))  # last row of the picture that shows; 255: none
    object_x = byte(*range(62, 70))
    kinds = bits(*range(78, 86), count=3)
    object_y = byte(*range(86, 94))  # its picture ends above row 180 + height - y
    scroll_x = byte(95)  # what the skier could not move at a border
    event = byte(97)
    patience = byte(98)  # frames till the next turn
    step = signed(115, 116)  # latest movement in pixels: skier or hill to the right; hill up
    time = bcd((104, 105, 106))  # minutes, seconds, hundredths
    gates = bcd(107)  # that remain


class Records(NamedTuple):
    """Some of the records in RAM, or all of them."""

    height: jax.Array
    x: jax.Array
    y: jax.Array
    kind: jax.Array

    def of(self, numbers: tuple[int, ...]) -> "Records":
        """The records of slots."""
        return Records(*(jnp.stack([field[i] for i in numbers]) for field in self))


def decode(m: Ram) -> dict[str, Box]:
    records = shared(_records(m))  # without `shared` REM takes a fifth longer
    hundredths = m.time - 4000 * div(m.time, 10000)  # a minute is 6,000 of them
    return {
        "Player": _player(m),
        "Flag": _flags(records.of(FLAG_RECORDS)),
        "Mogul": _moguls(records.of(MOGUL_RECORDS)),
        "Tree": _trees(records.of(TREE_RECORDS)),
        "Score": _score(m, -hundredths),
        "Clock": box(CLOCK_DIGITS[0], CLOCK_TOP, 38, FONT.height, value=hundredths),
    }


def _records(m: Ram) -> Records:
    """The records by number, as the frame shows them; number k is at (turn + 7 - k) modulo 8."""
    turn = jnp.where(m.state == ENDED, m.turn + 1, m.turn)  # it ended before the list moved
    y = m.object_y - jnp.where(m.state == RUNNING, m.step[1], 0)

    def in_order(field: jax.Array) -> jax.Array:
        field = jnp.flip(field)
        for shift in (1, 2, 4):
            field = jnp.where((turn & shift) > 0, jnp.roll(field, shift), field)
        return field

    return Records(in_order(m.heights), in_order(m.object_x), in_order(y), in_order(m.kinds))


def _flags(gates: Records) -> Box:
    color = jnp.where(
        (gates.kind == LAST_GATE)[:, None],
        jnp.asarray(NTSC[KIND_COLORS[LAST_GATE]]),
        jnp.asarray(NTSC[KIND_COLORS[GATES[0]]]),
    )
    return _shown(FLAG, GATES, gates, gates.x + FLAG_LEFTS, color)


def _moguls(moguls: Records) -> Box:
    return _shown(MOGUL, MOGULS, moguls, moguls.x + 2, _colors(MOGUL_KINDS))


def _trees(trees: Records) -> Box:
    whole_or_top = trees.height >= THICK_ROWS
    x = trees.x + jnp.where(whole_or_top, -3, 2)
    return _shown(TREE, TREES, trees, x, _colors(TREE_KINDS))


def _colors(kinds: tuple[int, ...]) -> jax.Array:
    return jnp.asarray(NTSC[KIND_COLORS[np.array(kinds)]])


def _shown(
    cuts: np.ndarray, kinds: tuple[int, ...], records: Records, x: jax.Array, color: jax.Array
) -> Box:
    """Tight boxes of what the playfield leaves of pictures that begin at columns x.

    A box is valid where its record holds an object of one of the kinds.
    """
    height, width = (size // 2 for size in cuts.shape)
    x = wrap(x)
    x = jnp.where(x >= RIGHT, x - WIDTH, x)  # the left border hides what begins in the right one
    mirrored = records.kind >= FIRST_MIRRORED
    x = jnp.where(mirrored, WIDTH - width - x, x)  # the borders are equally wide
    end = 180 + records.height - records.y
    y = end - height
    row = jnp.minimum(y - TOP, 0) + jnp.maximum(end - BOTTOM, 0)
    column = jnp.minimum(x - LEFT, 0) + jnp.maximum(x + width - RIGHT, 0)
    row = jnp.clip(row, -height, height) + height
    column = jnp.clip(column, -width, width) + width
    rest = lookup(cuts.ravel(), row * (2 * width + 1) + column)
    w = rest >> 10 & 31
    x = x + (rest & 31)
    x = jnp.where(mirrored, WIDTH - w - x, x)
    fits = functools.reduce(jnp.logical_or, [records.kind == kind for kind in kinds])
    there = fits & (records.height < UNUSED)
    return replace(box(x, y + (rest >> 5 & 31), w, rest >> 15, there), rgb=color)


def _player(m: Ram) -> Box:
    slope = jnp.minimum(m.heading, 15 - m.heading)  # 0 across the hill, ..., 7 straight down
    fell = m.crashed == 1
    # The skier has just risen, and the crash shows once more.
    rose = ~fell & (m.speed == 1) & (slope > 0) & (m.patience != slope + 1)
    lying = (fell & (m.event != JUST_NOW)) | rose
    # Whoever would leave the hill with the next step stands still.
    ahead = m.x + m.step[0]
    moves = (m.state == RUNNING) & (m.scroll_x == 0) & (ahead >= LEFT) & (ahead < RIGHT - 8)
    return SKIER.box(
        jnp.where(lying, LYING, slope >> 1),
        m.x - jnp.where(moves, m.step[0], 0) + 1,
        159 - m.y,
        mirrored=m.heading < 8,
        value=m.gates,
        orientation=12 - ((m.heading + 1) >> 1),
    )


def _score(m: Ram, value: jax.Array) -> Box:
    passed = (m.event == JUST_NOW) & (m.crashed == 0)  # shown one frame late
    shown = jnp.where(passed, m.gates + 1, m.gates)
    return score_box(FONT, shown, right=SCORE_RIGHT, top=SCORE_TOP, digits=2, value=value)


TIME = Digits(FONT, CLOCK_DIGITS, CLOCK_TOP, weights=(6000, 1000, 100, 10, 1))
GAME = Game(
    name="Skiing",
    rom=ROM.name,
    md5=ROM.md5,
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
