"""Amidar: the player paints a maze of lines and ladders; up to six warriors or pigs walk in it; score and lives below.

Slots are the game's records of its seven figures, which it keeps sorted from top to bottom: a figure changes its slot when it passes
another. In odd levels the player is a gorilla among warriors, in even ones a roller among pigs. A jump turns the others into shadows, black
four by four dots that show as gaps in the lines; the last corner turns them into chickens, and who is caught into a shadow.
Two sprites draw all figures: where more are at one height, each is drawn in one to three of four frames. Scenery: the maze, painted or not.

RAM: ALE's source (score, lives), OCAtari 2.2 (records, kinds), and the ROM's code: figures move after the frame is drawn, the player and
the others in turn as byte 92 counts, so `decode` takes that step back. Not in RAM: whether the player was stopped (then he is a
pixel off), and which way a figure came to the crossing at which it just turned.

Covered: the first level at both difficulties, jumps, deaths, the game's end; pigs and chickens by editing RAM. Not seen: a whole even
level, whose roller's size is read off the ROM. Life's `value` is what the emulator says,
three lives are 11 at difficulty 0 (where bit 3 of byte 86 is the game's difficulty) and 3 at difficulty 3; VEM reads the former.
"""

import itertools

import jax
import jax.numpy as jnp
import numpy as np

from ocjax.ram import RamMap, bcd, bits, byte
from ocjax.spec import Blobs, Bounds, Box, Category, Digits, Game, Gauge, box

YELLOW, GREEN, RED, BLACK = 30, 216, 72, 0
MAZE = (12, 12, 150, 172)
LADDERS = ((16, 40, 56, 72, 84, 100, 116, 140), (16, 32, 52, 64, 92, 104, 124, 140), (16, 28, 60, 96, 128, 140),
           (16, 36, 72, 84, 120, 140), (16, 40, 64, 92, 116, 140))  # fmt: skip
GLYPHS = ("3844c6c6c64438", "081838181818fe", "7c06067cc0c0fe", "fc06067c0606fc", "040c1c2c4cfe0c",
          "fcc0c07c0606fc", "7cc0c0fcc6c67c", "fec2060c183060", "7cc6c67cc6c67c", "7cc6c67e06067c")  # fmt: skip
SPEEDS = 0xFFFFC8C8 << 32 | 0x64643200  # by level, how often of 256 the others take a third step
PLAYER, WARRIOR, PIG, SHADOW, CHICKEN = 0, 2, 3, 6, 7


def gaps() -> tuple[tuple[int, int, int, int], ...]:
    """Where the maze has neither line nor rung."""
    rows = [(0, y, 160, y + 1) for y in range(12, 172) if y % 5 in (1, 4) or not 15 <= y < 168]
    sides = [(0, 12, 16, 172), (144, 12, 160, 172)]
    holes = [(x + 4, 19 + 30 * i, e, 45 + 30 * i) for i, xs in enumerate(LADDERS) for x, e in itertools.pairwise(xs)]
    return (*rows, *sides, *holes)


class Ram(RamMap):
    drawn = byte(50, 51)  # what the two sprites drew last, 16 * kind + 0 or 7
    y = byte(*range(59, 66))  # y - 7; 255: no figure
    x = byte(*range(66, 73))  # x - 9
    vertical = bits(*range(73, 80), first=2)
    back = bits(*range(73, 80), first=7)  # left or, on ladders, down
    kind = bits(*range(73, 80), first=4, count=3)
    lives = bits(86, count=4)
    icons = bits(86, count=2)
    level = bits(86, first=2, count=3)
    carry = bits(86, first=1)
    playing = bits(86, first=5)
    over = bits(86, first=7)
    player = byte(87)  # its record
    pace = byte(88)  # sum of the others' speeds
    turn = byte(92)  # counts 5 to 1: others, player, others, player, perhaps others
    score = bcd((91, 90, 89))
    stick = byte(112)  # the joystick, in the high nibble; after turn 3 constants take its place
    gained = bcd(115)  # after the frame was drawn


def decode(m: Ram) -> dict[str, Box]:
    here = (np.arange(7) == m.player) & (m.y != 255)
    low, high = SPEEDS & 0xFFFFFFFF, SPEEDS >> 32
    speed = (jnp.where(m.level < 4, np.uint32(low), np.uint32(high)) >> (8 * (m.level & 3)).astype(jnp.uint32)).astype(jnp.int32) & 255
    others = jnp.where(m.turn == 5, m.pace < speed + m.carry, m.turn & 1 == 0)
    moved = (m.playing == 1) & jnp.where(here, (m.turn & 1 == 1) & (m.turn != 5), others)
    moved = moved & ~(here & (m.turn == 1) & ((m.stick & 15 != 0) | (m.stick == 0x90)))  # the joystick rested
    step = jnp.where(moved, 1, 0)
    x = m.x + 9 + jnp.where(m.vertical == 1, 0, jnp.where(m.back == 1, step, -step))
    y = m.y + 7 + jnp.where(m.vertical == 0, 0, jnp.where(m.back == 1, -step, step))
    kind = jnp.where(m.y == 255, -1, _kind(m))
    shown = m.score - m.gained
    digits = 1 + sum(jnp.where(shown >= 10**k, 1, 0) for k in range(1, 6))
    first = jnp.argmax(here)
    return {
        "Player": box(x[first], y[first], 7, 7, jnp.any(here)),
        "Warrior": box(x, y, 7, 7, (kind == WARRIOR) & ~here),
        "Pig": box(x, y, 7, 7, (kind == PIG) & ~here),
        "Shadow": _shadow(x + 3, y + 1, m.vertical).where((kind == SHADOW) & ~here),
        "Chicken": box(x + 1, y, 5, 7, (kind == CHICKEN) & ~here),
        "Score": box(105 - 8 * digits, 176, 8 * digits - 1, 7, value=m.score),
        "Life": box(164 - 16 * m.icons, 175, 16 * m.icons - 15, 8, (m.icons > 0) & (m.over == 0), value=m.lives),
    }


def _kind(m: Ram) -> jax.Array:
    """Kinds of the figures on the screen: jumps begin and end after the frame was drawn."""
    jumps = ~jnp.any((m.kind == CHICKEN) & (m.y != 255))
    usual = jnp.where(m.level & 1 == 1, PIG, WARRIOR)
    dark, light = jnp.any(m.drawn == 103), jnp.any(m.drawn == 16 * usual)
    begins, ends = jumps & light & ~dark & (m.kind == SHADOW), jumps & dark & (m.kind == usual)
    return jnp.where(begins, usual, jnp.where(ends, SHADOW, m.kind))


def _shadow(x: jax.Array, y: jax.Array, vertical: jax.Array) -> Box:
    """What shows of it: rows of the maze, and the half of it that is on a ladder."""
    top = jnp.where((y % 5 == 1) | (y % 5 == 4), 1, 0)
    bottom = jnp.where((y % 5 == 1) | (y % 5 == 3), 3, 4)
    return box(x, y + top, jnp.where(vertical == 1, 2, 4), bottom - top)


GAME = Game(
    name="Amidar",
    rom="amidar",
    md5="acb7750b4d0c4bd34969802a7deb2990",
    ram=Ram,
    decode=decode,
    categories=(
        Category("Player", Blobs(YELLOW, MAZE, join=(1, 1), min_size=(6, 6), max_size=(14, 14)), doc="gorilla or roller"),
        Category(
            "Warrior",
            Blobs(GREEN, MAZE, join=(1, 1), min_size=(5, 5), max_size=(14, 14), split=(7, 7)),
            count=7,
            doc="odd levels",
            blinks=True,
        ),
        Category(
            "Pig", Blobs(RED, MAZE, join=(1, 1), min_size=(5, 5), max_size=(14, 14), split=(7, 7)), count=7, doc="even levels", blinks=True
        ),
        Category(
            "Shadow",
            Blobs(BLACK, MAZE, join=(0, 1), min_size=(2, 1), max_size=(4, 7), scenery=gaps()),
            count=7,
            doc="black on the maze",
            blinks=True,
        ),
        Category("Chicken", Blobs(YELLOW, MAZE, join=(1, 1), min_size=(4, 6), max_size=(5, 7)), count=7, doc="to be caught", blinks=True),
        Category(
            "Score",
            Bounds(YELLOW, (56, 176, 105, 183), value=Digits((57, 65, 73, 81, 89, 97), 176, (8, 7), (1, 1), GLYPHS)),
            attributes=("value",),
            hud=True,
            doc="points",
        ),
        Category("Life", Bounds(YELLOW, (116, 175, 149, 183), value=Gauge(16, 1, 9)), attributes=("value",), hud=True, doc="lives left"),
    ),
)
