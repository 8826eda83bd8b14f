"""Surround: the player and the computer leave walls behind and try to make the other crash.

Picture: docs/games/Surround.png

Screen: the field has 40 columns and 20 rows; the outer ones are the border. The last rows of the
border's top and bottom are apart.

Slots: Trail has (row - 1) * 38 + column - 1. Border has top, bottom, left, right.

RAM: ALE's source (scores), a public disassembly by T. Jentzsch and D. Debro (meaning of bytes), and
the ROM's code. The trail is the playfield; F0B2-F107 draws it directly from the RAM. The game moves
before the drawing, so the RAM matches the screen. A crashed player takes its own and the trail's
colour alternately, 16 frames each (F65A-F6DE). After the last point all colours change every 256
frames.

Covered: both modes, all difficulties, crashes of either and of both, the end of the game.

Not exact: nothing known.

VEM: it finds a player in the trail's colour by the line between rows that the player covers, unless
both have crashed. It misses the piece of trail behind a player.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Bounds,
    Box,
    Category,
    Cells,
    Checks,
    Context,
    Detected,
    Font,
    Game,
    NumberDisplay,
    RamMap,
    Rom,
    Shades,
    Step,
    Variants,
    bcd,
    bits,
    box,
    boxes,
    byte,
    display,
    flag,
    lookup,
)

ROM = Rom("surround", "4d7517ae69f95cfbc053be01312b7dba")
DIGITS = ROM.rows([0x739 + 5 * digit for digit in range(10)], 5, top_first=True) >> 1 & 7


def _font_of(lines: tuple[int, ...]) -> Font:
    """The digits; each row has its own number of lines."""
    glyphs = (np.repeat(rows, lines) for rows in DIGITS)
    return Font(tuple(tuple(rows.tolist()) for rows in glyphs), dots=3, dot=(4, 1), pitch=16)


ENEMY_SCORE = NumberDisplay(_font_of((3, 3, 3, 3, 5)), right=44, top=5, digits=2)
PLAYER_SCORE = NumberDisplay(_font_of((3, 3, 3, 3, 4)), right=124, top=6, digits=2)

TRAIL_ROWS = range(1, 19)
COLUMNS = range(1, 39)
CELL_X = tuple(4 * column for _ in TRAIL_ROWS for column in COLUMNS)
CELL_Y = tuple(27 + 9 * row for row in TRAIL_ROWS for _ in COLUMNS)
HEAD = 9  # lines of a player
GROUND = (80, 2)  # a pixel with the field's colour
FIELD = (0, 26, 160, 206)
WALLS = ((0, 23, 160, 35), (0, 198, 160, 210), (0, 36, 4, 197), (156, 36, 160, 197))
# Order of the bits in a row's columns: the lowest bit on the left, or the highest one.
RISING = np.arange(8)
FALLING = RISING[::-1]

# Colours of the enemy, the player, the trail and the field, four of each game.
PALETTE = ROM.bytes(0x76B, 32)
ENEMY = int(PALETTE[4])
PLAYER = int(PALETTE[5])
TRAIL = int(PALETTE[6])
GAMES = (1, 3)  # `game` in the emulator's modes
KEYS = range(0, 64, 2)  # XORed with colours after the game
COLORS = [tuple(PALETTE[4 * game : 4 * game + 4].tolist()) for game in GAMES]
LEVELS = tuple(tuple(c ^ key for c in colors) for colors in COLORS for key in KEYS)


class Blinks:  # of `Ram.blinks`
    NOT_YET = 14  # a player that crashed alone still has its colour


class Ram(RamMap):
    outer = byte(*TRAIL_ROWS)  # columns 0-3 in the low nibble, 20-23 in the high one
    left = byte(*(20 + row for row in TRAIL_ROWS))  # columns 4-11
    middle = byte(*(40 + row for row in TRAIL_ROWS))  # 12-19
    right = byte(*(60 + row for row in TRAIL_ROWS))  # 24-31
    last = byte(*(80 + row for row in TRAIL_ROWS))  # 32-39
    enemy_row = byte(109)
    player_row = byte(110)
    enemy_column = byte(111)
    player_column = byte(112)
    open_field = flag(113, bit=3)  # no border
    color_clock = byte(116)  # 256 frames each
    enemy_score = bcd(118)
    player_score = bcd(119)
    playing = flag(120, bit=7)
    game = bits(121, count=3)
    blinks = bits(123, count=4)  # times 16 frames, until the next round
    enemy_bright = flag(123, bit=4)
    player_bright = flag(123, bit=5)
    enemy_hit = flag(123, bit=6)
    player_hit = flag(123, bit=7)


def decode(m: Ram) -> dict[str, Box]:
    enemy_dark = m.enemy_hit & ~m.enemy_bright & m.playing
    waits = (m.blinks == Blinks.NOT_YET) & ~m.enemy_hit
    player_dark = m.player_hit & ~m.player_bright & m.playing & ~waits
    trail_color = _color(m, 2)
    enemy_color = jnp.where(enemy_dark, trail_color, _color(m, 0))
    player_color = jnp.where(player_dark, trail_color, _color(m, 1))
    left, top, right, bottom = np.array(WALLS).T
    return {
        "Player": box(4 * m.player_column, 26 + 9 * m.player_row, 4, HEAD, color=player_color),
        "Enemy": box(4 * m.enemy_column, 26 + 9 * m.enemy_row, 4, HEAD, color=enemy_color),
        "Trail": box(np.array(CELL_X), np.array(CELL_Y), 4, 8, _trail_cells(m), color=trail_color),
        "Border": box(left, top, right - left, bottom - top, ~m.open_field, color=trail_color),
        "PlayerScore": PLAYER_SCORE.box(m.player_score, color=player_color),
        "EnemyScore": ENEMY_SCORE.box(m.enemy_score, color=enemy_color),
    }


def _color(m: Ram, index: int) -> jax.Array:
    key = jnp.where(m.playing, 0, m.color_clock)
    return lookup(PALETTE, 4 * m.game + index) ^ key


def _trail_cells(m: Ram) -> jax.Array:
    """True for each cell of the field with a piece of the trail."""
    parts = (
        (m.outer, RISING[1:4]),
        (m.left, FALLING),
        (m.middle, RISING),
        (m.outer, RISING[4:]),
        (m.right, FALLING),
        (m.last, RISING[:7]),
    )
    cells = [row[:, None] >> places[None] & 1 for row, places in parts]
    return jnp.concatenate(cells, axis=1).reshape(-1) == 1


class Whole(Step):
    """Extend the first line of a player to its full height."""

    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step."""
        whole = boxes(found.x, found.y, found.w, HEAD, found.valid)
        return found._replace(box=whole, head=None)


BETWEEN = tuple(
    (0, 27 + 9 * row, 160, 35 + 9 * row) for row in range(20)
)  # everything except the lines between rows
CRASHED = Bounds(TRAIL, FIELD, max_size=(4, 1), ignore=BETWEEN, then=(Whole(),))
crashing = functools.partial(Category, otherwise=CRASHED)

GAME = Game(
    name="Surround",
    rom=ROM,
    ram=Ram,
    decode=decode,
    shades=Shades(GROUND, tuple(level[3] for level in LEVELS), LEVELS),
    checks=Checks(
        moved=0.15,  # many walls
    ),
    variants=Variants(
        difficulties={
            0: "a turn straight back is ignored",
            1: "a turn straight back is ignored",
            2: "a turn straight back crashes into the trail",
            3: "a turn straight back crashes into the trail",
        },
        source="play of all difficulties in the emulator",
    ),
    categories=(
        crashing("Player", Bounds(PLAYER, FIELD), role="player", doc="the player's head"),
        crashing("Enemy", Bounds(ENEMY, FIELD), doc="the computer's head"),
        Category("Trail", Cells(TRAIL, CELL_X, CELL_Y, 4, 8), count=684, doc="pieces of trail"),
        Category("Border", Bounds(TRAIL, WALLS), count=4, doc="top, bottom, left, right"),
        display("PlayerScore", PLAYER_SCORE.rule((PLAYER, TRAIL)), role="score", doc="rounds won"),
        display(
            "EnemyScore", ENEMY_SCORE.rule((ENEMY, TRAIL)), role="opponent_score", doc="rounds lost"
        ),
    ),
)
