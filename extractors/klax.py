"""Klax: tiles tumble down a belt onto a paddle, which drops them into a well of five columns.

Picture: docs/games/Klax.png

Screen: the belt is above the paddle, and the well below it. Selector is the white light below the
paddle's column. Goal is the number of klaxes, tiles or points that the wave still demands. Bonus is
the points of a klax or of a finished wave. Countdown is the time to continue a lost game. The belt,
the frame of the well and all words are scenery. The screens between the waves show only words and
numbers, which are no objects.

Slots: BeltTile has the places of the belt row by row from the top left, WellTile those of the well.
PaddleTile is the stack on the paddle, the top tile first.

RAM: the ROM's code. The cartridge contains another 128 bytes of RAM, which the emulator does not
return. The console's RAM has the tiles, and the pictures of the last drawn number. Return addresses
on the stack show which screen was drawn, and whether the frame was even or odd. Tiles in the well
fall after the drawing of even frames.

Covered: all modes, klaxes, finished and lost waves, continued games.

Not exact: the following facts are only in the cartridge's RAM. The score, the number of dropped
tiles below it, and the tiles that fall past the paddle are therefore no categories. REM reports
black for the tiles on the belt, because it does not know their colours. While the paddle moves, REM
reports the column that it leaves. For a single frame each, REM also lacks the fall of a tile that
lands, and the tiles of a klax when they disappear. Flashing tiles may have another shade.

VEM: it misses flashing tiles while they are black, or grey outside the well. It also misses tiles
on the paddle that touch a falling tile.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    Blobs,
    Bounds,
    Box,
    Category,
    Checks,
    Digits,
    Game,
    NumberDisplay,
    RamMap,
    Rom,
    Shape,
    among,
    box,
    byte,
    choose,
    display,
    match,
    only,
    score_box,
    when,
)

ROM = Rom("klax", "eed9eaf1a0b6a2b9bc4c8032cb43e3fb")
SMALL = ROM.font(0x3E08, rows=5, stride=8)
LARGE = ROM.font(0x3F18, rows=8, stride=8)

HUE_AND_SHADE = 0xFE  # bits of a colour; bit 0 marks tiles of any colour
BLACK = 0
GREY = 4
WHITE = 12
YELLOW = 76
VIOLET = 216
TILE_COLORS = tuple(color for color in range(2, 256, 2) if color != GREY)

LANES = 5  # of the belt, above the columns of the well
FIRST_LEFT = 60  # of the first lane
PITCH = 8  # columns from a lane to the next
LANE_LEFTS = FIRST_LEFT + PITCH * np.arange(LANES, dtype=np.int32)
STEP = 5  # rows from a tile to the next, on the paddle and in the well
TILE = (7, 4)

BELT = (60, 40, 100, 114)
BELT_TOPS = (40, 43, 47, 51, 55, 59, 64, 69, 74, 79, 85, 91, 98, 106)
BELT_LINES = (2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 6, 7, 8)  # of each row's pictures
BELT_ROWS = len(BELT_TOPS)
PHASES = 4  # of a tile that tumbles through a row
TILE_PICTURES = 0x1F02  # offset of the low bytes of the tiles' pictures, 16 for each phase
TILE_PAGE = 0x3E00  # offset of the pictures


def _extent(phase: int, row: int) -> tuple[int, int, int]:
    """The first row and the height of a tile on the belt, and its dots in a row."""
    picture = int(ROM.bytes(TILE_PICTURES + 16 * phase + row, 1)[0])
    lines = ROM.rows(TILE_PAGE + picture, BELT_LINES[row])
    drawn = np.flatnonzero(lines)
    return BELT_TOPS[row] + int(drawn[0]), len(drawn), int(lines[drawn[0]])


# by place of the belt
EXTENTS = np.array([[_extent(p, r) for r in range(BELT_ROWS)] for p in range(PHASES)], np.int32)
TILE_TOPS = np.repeat(EXTENTS[..., 0], LANES, axis=1)  # and by phase
TILE_HEIGHTS = np.repeat(EXTENTS[..., 1], LANES, axis=1)
TILE_DOTS = np.unpackbits(EXTENTS[0, :, 2:].astype(np.uint8), axis=1).repeat(LANES, axis=0)
TILE_WIDTHS = TILE_DOTS.sum(axis=1, dtype=np.int32)
TILE_LEFTS = np.tile(LANE_LEFTS, BELT_ROWS) + TILE_DOTS.argmax(axis=1).astype(np.int32)
PLACE_ROWS = np.repeat(np.arange(BELT_ROWS, dtype=np.int32), LANES)
LANE_BITS = np.tile(16 >> np.arange(LANES, dtype=np.int32), BELT_ROWS)

PADDLE_AREA = (60, 118, 100, 150)
PILE_TOP = 119
MOST_CARRIED = 5  # tiles on the paddle
PILE_AREA = (60, 118, 100, 144)
FULL = 136  # the paddle's colour on half of the frames, if it carries most tiles
FULL_AREA = (60, 144, 100, 148)

WELL = (60, 150, 100, 175)
WELL_ROWS = 5
WELL_TOPS = np.repeat(151 + STEP * np.arange(WELL_ROWS, dtype=np.int32), LANES)
WELL_LEFTS = np.tile(LANE_LEFTS, WELL_ROWS)
LIGHTS = (60, 177, 100, 180)
PLAY = ("Selector", "Player")  # the words before a wave lack both

GOAL_RIGHT = 102
GOAL_TOP = 197
CELLS = 6  # of the longest goal
TENS = 10 ** np.arange(CELLS - 1, -1, -1, dtype=np.int32)
WAVE_BONUS = NumberDisplay(SMALL, right=102, top=197, digits=6)
KLAX_BONUS = NumberDisplay(LARGE, right=102, top=194, digits=4)
SECONDS = NumberDisplay(LARGE, right=94, top=190, digits=2)


class Call:  # of `Ram.call`, after which part of the game the last call returned
    EVEN = 0xE0  # tiles in the well fall
    ODD = 0xF9
    ODD_KLAX = 0xF3
    SOUND = 0xBF  # on an even frame
    OTHER_SOUND = 0xCE
    BONUS = 0xAC
    CONTINUE = 0xC4


class Page:  # of `Ram.page` and `Ram.font`
    WORDS = 0x99  # of the code that draws the words before a wave
    SMALL = 0xFE
    LARGE = 0xFF


LIT = 12  # `lights`
FIRST_PICTURE = 0xC8  # `picture` of the first phase
PICTURE_BYTES = 8  # of each phase
SMALL_ZERO = 0x08  # `digits`
LARGE_ZERO = 0x18
BLANK = 0
PLUS = 0x68  # `digits` before the points of a klax
TIMES = 0x70  # `digits` if they count several times
KLAX_SOUND = 0xD3  # `sound`


class Ram(RamMap):
    belt = byte(*range(10, 37, 2))  # lanes with a tile, the left one in bit 4; top row first
    picture = byte(37)  # low byte of the picture in the belt's last row
    paddle_page = byte(39)  # high byte of the paddle's picture; 0 on a wave's first frame
    stack = byte(*range(40, 46))  # colours of the tiles on the paddle, and of the paddle below them
    well = byte(*range(51, 76))  # colours of tiles row by row, top row first
    lights = byte(*range(76, 81))
    digits = byte(*range(107, 118, 2))  # low bytes of the pictures of the last drawn number
    font = byte(108)  # their high byte
    page = byte(125)  # high byte of the last inner call's return address
    call = byte(126)  # low byte of the last call's return address
    sound = byte(127)  # the last byte of a sound


def decode(m: Ram) -> dict[str, Box]:
    shown = _has_belt(m)
    return {
        "Player": _paddle(m).where(shown),
        "BeltTile": _belt_tiles(m).where(shown),
        "PaddleTile": _paddle_tiles(m).where(shown),
        "WellTile": _well_tiles(m).where(shown),
        "Selector": _selector(m).where(shown),
        "Goal": _goal(m).where(shown),
        "Bonus": _bonus(m).where(shown),
        "Countdown": _countdown(m).where(shown),
    }


def _has_belt(m: Ram) -> jax.Array:
    """Whether the frame shows belt and well."""
    plays = among(m.call, (Call.EVEN, Call.ODD, Call.ODD_KLAX, Call.CONTINUE, Call.BONUS))
    sounds = among(m.call, (Call.SOUND, Call.OTHER_SOUND))
    return plays | sounds & (m.page != Page.WORDS)


def _column(m: Ram) -> jax.Array:
    """The last column over which the paddle stood."""
    return only(m.lights == LIT, np.arange(LANES))


def _selector(m: Ram) -> Box:
    return box(FIRST_LEFT + PITCH * _column(m) + 1, 177, 5, 3, jnp.any(m.lights == LIT))


def _tiles_on_paddle(m: Ram) -> jax.Array:
    return (m.stack != 0).sum() - 1


def _paddle(m: Ram) -> Box:
    carried = _tiles_on_paddle(m)
    color = only(np.arange(MOST_CARRIED + 1) == carried, m.stack) & HUE_AND_SHADE
    left = FIRST_LEFT + PITCH * _column(m)
    there = (carried >= 0) & (m.paddle_page != 0)
    return box(left, PILE_TOP + STEP * carried, *TILE, there, color=color)


def _paddle_tiles(m: Ram) -> Box:
    places = np.arange(MOST_CARRIED)
    colors = m.stack[:MOST_CARRIED] & HUE_AND_SHADE
    left = FIRST_LEFT + PITCH * _column(m)
    there = places < _tiles_on_paddle(m)
    return box(left, PILE_TOP + STEP * places, *TILE, there, color=colors)


def _belt_tiles(m: Ram) -> Box:
    phase = (m.picture - FIRST_PICTURE) // PICTURE_BYTES
    top = _of_phase(phase, TILE_TOPS)
    height = _of_phase(phase, TILE_HEIGHTS)
    there = (m.belt[PLACE_ROWS] & LANE_BITS) != 0
    return box(TILE_LEFTS, top, TILE_WIDTHS, height, there, color=BLACK)


def _of_phase(phase: jax.Array, rows: np.ndarray) -> jax.Array:
    return match(*((phase == i, rows[i]) for i in range(PHASES - 1)), otherwise=rows[-1])


def _well_tiles(m: Ram) -> Box:
    color = m.well & HUE_AND_SHADE
    return box(WELL_LEFTS, _tops_as_drawn(m), *TILE, m.well != 0, color=color)


def _tops_as_drawn(m: Ram) -> jax.Array:
    """The rows of the well's tiles before those in the air fell on an even frame."""
    even_sound = (m.call == Call.OTHER_SOUND) & (m.sound != KLAX_SOUND)
    falls = among(m.call, (Call.EVEN, Call.SOUND)) | even_sound
    return jnp.asarray(WELL_TOPS) - when(falls & _is_in_the_air(m), STEP)


def _is_in_the_air(m: Ram) -> jax.Array:
    """Whether a place of the well is above an empty one, except in the top row."""
    empty = m.well == 0
    fifth = empty[4 * LANES :]
    fourth = fifth | empty[3 * LANES : 4 * LANES]
    third = fourth | empty[2 * LANES : 3 * LANES]
    never = jnp.zeros_like(fifth)
    return jnp.concatenate([never, third, fourth, fifth, never])


def _number(pictures: jax.Array, zero: int) -> jax.Array:
    """A number from the low bytes of its pictures, and of the zero's."""
    return jnp.sum(jnp.maximum((pictures - zero) >> 3, 0) * TENS[-len(pictures) :])


def _goal(m: Ram) -> Box:
    """Numbers of at most two digits are a cell further left."""
    is_short = m.digits[5] == BLANK
    total = _number(m.digits, SMALL_ZERO)
    shown = jnp.where(is_short, total // 10, total)
    there = (m.font == Page.SMALL) & ~_counts_bonus(m)
    right = GOAL_RIGHT - when(is_short, PITCH)
    return score_box(
        SMALL, shown, right=right, top=GOAL_TOP, digits=CELLS, value=shown, valid=there
    )


def _counts_bonus(m: Ram) -> jax.Array:
    """Whether a small number is the bonus of a wave, which begins as a 0 in the last cell."""
    is_new = (m.digits[5] == SMALL_ZERO) & (m.digits[4] == BLANK)
    return (m.call == Call.BONUS) | is_new


def _bonus(m: Ram) -> Box:
    wave = _number(m.digits, SMALL_ZERO)
    klax = _number(m.digits[-KLAX_BONUS.digits :], LARGE_ZERO)
    counts = among(m.digits[1], (PLUS, TIMES))
    return choose(
        m.font == Page.LARGE,
        KLAX_BONUS.box(klax, valid=counts),
        WAVE_BONUS.box(wave, valid=_counts_bonus(m)),
    )


def _countdown(m: Ram) -> Box:
    total = _number(m.digits[3:5], LARGE_ZERO)
    return SECONDS.box(total, valid=(m.font == Page.LARGE) & (m.digits[5] == BLANK))


CATEGORIES = (
    Category(
        "Player",
        Bounds(GREY, PADDLE_AREA, min_size=TILE, max_size=TILE),
        role="player",
        otherwise=Bounds(FULL, FULL_AREA, min_size=TILE, max_size=TILE),
        doc="the paddle",
    ),
    Category(
        "BeltTile",
        Blobs(TILE_COLORS, BELT, Shape(w=(2, 7), h=(1, 8))),
        count=BELT_ROWS * LANES,
        needs=PLAY,
        ram_color=False,
        doc="tiles on the belt",
    ),
    Category(
        "PaddleTile",
        Blobs(TILE_COLORS, PILE_AREA, Shape(w=7, h=4)),
        count=MOST_CARRIED,
        needs=PLAY,
        doc="tiles on the paddle",
    ),
    Category(
        "WellTile",
        Blobs((GREY, *TILE_COLORS), WELL, Shape(w=7, h=4)),
        count=WELL_ROWS * LANES,
        needs=PLAY,
        doc="tiles in the well",
    ),
    Category(
        "Selector",
        Bounds(WHITE, LIGHTS, min_size=(5, 3), max_size=(5, 3)),
        doc="the light below the paddle's column",
    ),
    display(
        "Goal",
        Bounds(
            WHITE,
            (54, GOAL_TOP, GOAL_RIGHT, GOAL_TOP + SMALL.height),
            value=Digits(SMALL, range(54, GOAL_RIGHT, PITCH), GOAL_TOP, centered=True),
        ),
        needs=PLAY,
        doc="the klaxes, tiles or points to go in the wave",
    ),
    display(
        "Bonus",
        KLAX_BONUS.rule(YELLOW, required=True),
        otherwise=WAVE_BONUS.rule(YELLOW, required=True),
        doc="the points of a klax or a finished wave",
    ),
    display(
        "Countdown",
        SECONDS.rule(VIOLET),
        role="time",
        needs=PLAY,
        doc="seconds left to continue a lost game",
    ),
)

GAME = Game(
    name="Klax",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=CATEGORIES,
    screen=(250, 160),
    pal=True,
    checks=Checks(
        agreement={"samples": 0.97, "modes": 0.96},  # the paddle's position between two columns
        rare=("Bonus", "Countdown", "PaddleTile"),
        returns="unknown",  # the RAM lacks the score
    ),
)
