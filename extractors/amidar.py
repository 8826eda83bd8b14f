"""Amidar: the player paints a maze of lines and ladders; up to six warriors or pigs walk in it; score and lives below.

Slots are the game's records of its seven figures, which it keeps sorted from top to bottom: a figure changes its slot when it passes
another. In odd levels the player is a gorilla among warriors, in even ones a roller among pigs. A jump turns the others into shadows, the
last corner into chickens, and who is caught into a shadow. Shadows are black: their boxes are what is missing of the maze, and nothing
shows of one on the last line, below which it walks. Scenery: the maze, painted or not.

Two sprites draw all figures. Where more than two are within 18 rows, the player goes before the others and each of them first on one of
four frames. So 2 % of the figures that exist (4 to 6 % of shadows and chickens) are drawn neither on a frame nor on the one before: in play
whoever sees all that the ROM draws finds 98 % of REM's boxes, or 96 to 97 % with the shadows on the last line that cannot be seen.

RAM: ALE's source (score, lives), OCAtari 2.2 (records, kinds), and the ROM's code. Figures move after the frame is drawn, the player and
the others in turn as byte 92 counts, so `decode` takes that step back, and the turn at a crossing. Which sprite draws a shadow, and so
its height, follows from how the ROM shares them out. Not in RAM: whether a player that did not go on turned round or rested (every
other step), and the frame drawn before a new life or level, when all records are set anew.

Covered: eight levels at both difficulties (ended by editing what is painted), jumps, chickens, deaths, the game's end. Life's `value` is
what the emulator says, the low half of byte 86: 11 for three lives in the first level at difficulty 0, 3 at difficulty 3. VEM reads 9-11;
it sees figures of a kind that overlap slantwise as more than they are.
"""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from ocjax.boxes import Box, box
from ocjax.digits import Digits, hex_font
from ocjax.game import Game
from ocjax.ram import RamMap, bcd, bits, byte
from ocjax.rules import Blobs, Bounds, Category, Gauge

YELLOW, GREEN, RED, BLACK = 30, 216, 72, 0
MAZE = (12, 12, 150, 172)
LADDERS = ((16, 40, 56, 72, 84, 100, 116, 140), (16, 32, 52, 64, 92, 104, 124, 140), (16, 28, 60, 96, 128, 140),
           (16, 36, 72, 84, 120, 140), (16, 40, 64, 92, 116, 140))  # fmt: skip
GLYPHS = ("3844c6c6c64438", "081838181818fe", "7c06067cc0c0fe", "fc06067c0606fc", "040c1c2c4cfe0c",
          "fcc0c07c0606fc", "7cc0c0fcc6c67c", "fec2060c183060", "7cc6c67cc6c67c", "7cc6c67e06067c")  # fmt: skip
# Ladders by band, a bit for every fourth column; at the sides only those that others than the tracer use.
RUNGS = [
    sum(1 << (x - 16) // 4 for x in xs if i % 2 == 0 or 16 < x < 140)
    for i, xs in enumerate(LADDERS)
]
RUNGS = [b - (b >> 31 << 32) for b in RUNGS]
SPEEDS = 0xFFFFC8C8 << 32 | 0x64643200  # by level, how often of 256 the others take a third step
WARRIOR, PIG, SHADOW, CHICKEN = 2, 3, 6, 7


def gaps() -> tuple[tuple[int, int, int, int], ...]:
    """Where the maze has neither line nor rung."""
    rows = [(0, y, 160, y + 1) for y in range(12, 172) if y % 5 in (1, 4) or not 15 <= y < 168]
    sides = [(0, 12, 16, 172), (144, 12, 160, 172)]
    holes = [
        (x + 4, 19 + 30 * i, e, 45 + 30 * i)
        for i, xs in enumerate(LADDERS)
        for x, e in itertools.pairwise(xs)
    ]
    return (*rows, *sides, *holes)


class Ram(RamMap):
    frame = bits(0, count=2)
    drawn = byte(50, 51)  # what the two sprites drew last, 16 * kind + 0 or 7
    y = byte(*range(59, 66))  # y - 7; 255: no figure
    x = byte(*range(66, 73))  # x - 9
    rank = bits(*range(73, 80), count=2)  # on which of four frames it is drawn before the others
    vertical = bits(*range(73, 80), first=2)
    mark = bits(*range(73, 80), first=3)  # goes left along lines
    back = bits(*range(73, 80), first=7)  # left or, on ladders, down
    kind = bits(*range(73, 80), first=4, count=3)
    tracer = byte(80)  # the record of the figure that walks along the border, clockwise
    lives = bits(86, count=4)
    icons = bits(86, count=2)
    level = bits(86, first=2, count=3)
    carry = bits(86, first=1)
    playing = bits(86, first=5)
    over = bits(86, first=7)
    player = byte(87)  # its record
    pace = byte(88)  # sum of the others' speeds
    turn = byte(92)  # counts 5 to 1: others, player, others, player, perhaps others
    wait = byte(94)  # frames before play, or of a jump
    score = bcd((91, 90, 89))
    stick = byte(112)  # the joystick, in the high nibble; after turn 3 constants take its place
    gained = bcd(115)  # after the frame was drawn
    called = byte(124)  # from where the player's step was called last: left on the stack


def decode(m: Ram) -> dict[str, Box]:
    here = (np.arange(7) == m.player) & (m.y != 255)
    x, y = _places(m, here)
    kind = jnp.where(m.y == 255, -1, _kind(m))
    shown = m.score - m.gained
    digits = 1 + sum(jnp.where(shown >= 10**k, 1, 0) for k in range(1, 6))
    own = [jnp.where(here, v, 0) for v in (x, y)]
    gone = (m.over == 1) & (m.wait == 0)  # since the frame was drawn, from where lives begin
    return {
        "Player": box(
            jnp.where(gone, 139, jnp.sum(own[0])),
            jnp.where(gone, 89, jnp.sum(own[1])),
            7,
            7,
            gone | jnp.any(here),
        ),
        "Warrior": box(x, y, 7, 7, (kind == WARRIOR) & ~here),
        "Pig": box(x, y, 7, 7, (kind == PIG) & ~here),
        "Shadow": _shadow(x + 3, y, _first_sprite(m, y, here)).where((kind == SHADOW) & ~here),
        "Chicken": box(x + 1, y, 5, 7, (kind == CHICKEN) & ~here),
        "Score": box(105 - 8 * digits, 176, 8 * digits - 1, 7, value=m.score),
        "Life": box(
            164 - 16 * m.icons,
            175,
            16 * m.icons - 15,
            8,
            (m.icons > 0) & (m.over == 0),
            value=m.lives,
        ),
    }


def _places(m: Ram, here: jax.Array) -> tuple[jax.Array, jax.Array]:
    """Where the figures were drawn: before their last step, if they took one, and before the turn at the crossing where it ended."""
    low, high = SPEEDS & 0xFFFFFFFF, SPEEDS >> 32
    speed = (
        jnp.where(m.level < 4, np.uint32(low), np.uint32(high))
        >> (8 * (m.level & 3)).astype(jnp.uint32)
    ).astype(jnp.int32) & 255
    vertical = m.vertical == 1
    on_line = (lax.rem(m.y, 30) == 7) | (m.y == 153)
    line, at = lax.div(m.y + 5, 30), m.x - 6
    ends = jnp.where(
        at & 3 == 0, sum((b >> (at >> 2 & 31) & 1) << i for i, b in enumerate(RUNGS)), 0
    )
    above, below = (ends << 1) >> line & 1 == 1, ends >> line & 1 == 1
    crossing = jnp.where(vertical, on_line, above | below)
    pressed = (m.turn == 1) & (m.stick & 15 == 0) & (m.stick != 0x90)
    walked = (m.called == 0x29) | (m.called == 0x21) & ~crossing | (m.called == 0x09) & pressed
    walked = walked & (m.turn & 1 == 1) & (m.turn != 5)
    others = jnp.where(m.turn == 5, m.pace < speed + m.carry, m.turn & 1 == 0) & (
        m.playing == 1
    ) | (m.over == 1) & (m.frame & 1 == 1)
    step = jnp.where(jnp.where(here, walked & (m.playing == 1), others), 1, 0)
    side = (m.x == 6) | (m.x == 130)
    border = jnp.where(vertical, (m.y == 7) | (m.y == 153), side)
    turned = crossing & ~here & ((np.arange(7) != m.tracer) | border)
    left = jnp.where(side, m.x == 6, m.mark == 1)
    back = jnp.where(turned, jnp.where(vertical, left, above), m.back == 1)
    move = jnp.where(back, step, -step)
    upright = vertical ^ turned
    return m.x + 9 + jnp.where(upright, 0, move), m.y + 7 - jnp.where(upright, move, 0)


def _first_sprite(m: Ram, y: jax.Array, here: jax.Array) -> jax.Array:
    """Which figures the first of the two sprites draws; from the lowest up, as the ROM shares them out."""
    rank = jnp.where(m.rank == m.frame, 3, jnp.where(here, 2, 1))
    low = [jnp.int32(999)] * 2  # what the sprites hold: its height, its rank, its bit
    held, bit = [jnp.int32(0)] * 2, [jnp.int32(0)] * 2
    done, last = jnp.int32(0), jnp.bool_(False)
    for i in reversed(range(7)):
        free = [low[k] - y[i] >= 18 for k in (0, 1)]
        can = [(free[k] | (held[k] < rank[i])) & (m.y[i] != 255) for k in (0, 1)]
        top = rank[i] == 3
        use = [can[0] & (last | ~can[1] & top), can[1] & (~last | ~can[0] & top)]
        done = done | jnp.where(use[0] & free[0], bit[0], 0)
        for k in (0, 1):
            low[k], held[k], bit[k] = (
                jnp.where(use[k], new, old)
                for new, old in ((y[i], low[k]), (rank[i], held[k]), (1 << i, bit[k]))
            )
        last = use[1] | last & ~use[0]
    return (done | bit[0]) >> np.arange(7) & 1 == 1


def _kind(m: Ram) -> jax.Array:
    """Kinds of the figures on the screen: jumps begin and end after the frame was drawn."""
    jumps = ~jnp.any((m.kind == CHICKEN) & (m.y != 255))
    usual = jnp.where(m.level & 1 == 1, PIG, WARRIOR)
    dark, light = jnp.any(m.drawn == 103), jnp.any(m.drawn == 16 * usual)
    begins, ends = jumps & light & ~dark & (m.kind == SHADOW), jumps & dark & (m.kind == usual)
    return jnp.where(begins, usual, jnp.where(ends, SHADOW, m.kind))


def _shadow(x: jax.Array, y: jax.Array, first: jax.Array) -> Box:
    """What shows of it: rows of the maze, and the part that is on a ladder; all of it where nothing shows.

    It lasts until the row in five in which the sprite is cleared.
    """
    r = lax.rem(y, 5)
    bottom = y + (jnp.where(first, 0x23451, 0x51234) >> (4 * r) & 15)
    top = y + (0b10010 >> r & 1)
    on_line = (lax.rem(y + 15, 30) < 4) | (lax.rem(bottom + 14, 30) < 4)
    ladder = sum(jnp.where(abs(x - at) < 4, at, 0) for at in LADDERS[4])
    lowest = (y == 160) & (ladder > 0)
    left = jnp.where(lowest, jnp.maximum(x, ladder), x)
    right = jnp.where(
        lowest, jnp.minimum(x, ladder) + 4, jnp.where(on_line | (y == 160), x + 4, x + 2)
    )
    return box(left, top, jnp.minimum(right, 144) - left, bottom - top)


def _walkers(color: int) -> Blobs:
    return Blobs(color, MAZE, min_size=(5, 5), max_size=(21, 21), split=(7, 7))


GAME = Game(
    name="Amidar",
    rom="amidar",
    md5="acb7750b4d0c4bd34969802a7deb2990",
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            Blobs(YELLOW, MAZE, min_size=(6, 6), max_size=(14, 14)),
            doc="gorilla or roller",
        ),
        Category("Warrior", _walkers(GREEN), count=7, doc="odd levels", blinks=True),
        Category("Pig", _walkers(RED), count=7, doc="even levels", blinks=True),
        Category(
            "Shadow",
            Blobs(BLACK, MAZE, gap=(0, 1), min_size=(1, 1), max_size=(4, 7), ignore=gaps()),
            count=7,
            doc="black on the maze",
            blinks=True,
        ),
        Category(
            "Chicken",
            Blobs(YELLOW, MAZE, min_size=(4, 6), max_size=(5, 14), split=(5, 7)),
            count=7,
            doc="to be caught",
            blinks=True,
        ),
        Category(
            "Score",
            Bounds(
                YELLOW,
                (56, 176, 105, 183),
                value=Digits(hex_font(GLYPHS, 8, (1, 1)), (57, 65, 73, 81, 89, 97), 176),
            ),
            attributes=("value",),
            hud=True,
            doc="points",
        ),
        Category(
            "Life",
            Bounds(YELLOW, (116, 175, 149, 183), value=Gauge(16, 1, 9)),
            attributes=("value",),
            hud=True,
            doc="lives left",
        ),
    ),
)
