"""Tetris: pieces of four blocks fall into a well of 22 rows and 10 columns.

Picture: docs/games/Tetris.png

Screen: the whole picture is one row lower on every other frame. The green bar, the dots in it and
the grey well are scenery. The colour of a block depends on its row.

Slots: Block has the places of the well row by row from the top left. The blocks of the falling
piece count, too.

RAM: the ROM's code. After drawing, the game takes the piece out of the well, moves it by the
joystick, lets it fall or removes full rows, and puts it back. `_as_drawn` reverts the moves. The
game keeps the previous row, column or rotation in two bytes. The two frames after a reset show the
last picture before it, which is always the same: the emulator plays 60 frames and then resets.

Covered: landed pieces, full rows and the words that name them, the end of the game. The game has
one mode and one difficulty.

Not exact: the RAM lacks these facts, each for a single frame: the places of full rows that have
just been removed; the piece that has just landed, which counts as blocks; whether the joystick
pulled the piece down or turned it, if both leave the same bytes; whether a piece in the highest row
is new. The third frame after a reset shows the score a row lower.

VEM: it misses a piece that touches other blocks, and mistakes four blocks that stand alone for a
piece.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import (
    NTSC,
    UNKNOWN_VALUE,
    Blobs,
    Bounds,
    Box,
    Category,
    Cells,
    Game,
    NumberDisplay,
    RamMap,
    Rom,
    Shape,
    bcd,
    bits,
    box,
    byte,
    display,
    match,
    pick,
    when,
)

ROM = Rom("tetris", "b0e1ee07fbc73493eac5651a52f90f00")
FONT = ROM.font(0x74B, rows=5, dots=3, shift=5, dot=(4, 8), pitch=16, top_first=True)

WELL_ROWS = 22
WELL_COLUMNS = 10
PITCH = (4, 8)  # from a block to the next
BLOCK = (3, 7)
WELL = (24, 28, 63, 204)  # its blocks on all frames
WITH_GAPS = (24, 28, 64, 205)  # the well and the gaps right of its blocks and below them
YELLOW = 30
ROW_COLORS = tuple((46 + 16 * row) % 256 for row in range(WELL_ROWS))  # of blocks, top row first
SCORE = NumberDisplay(FONT, right=156, top=27, digits=4, leading_zeros=True)
SCORE_AREA = (96, 27, 160, 68)  # on all frames
WORDS = (96, 99, 160, 204)  # area of all messages
# ONE, TWO, and the drawings for three and four rows, by `word`
WORD_WIDTHS = {0x07: 44, 0x0E: 48, 0x6B: 60, 0xC0: 64}

TOP_ROW = WELL_ROWS - 1  # `piece_row` of a new piece, which counts from the bottom
NEW_COLUMN = 6  # `piece_column` of a new piece
FALLS = 16  # `clock` on the frame after the piece has fallen
MOVES = 2  # lowest two bits of `clock` on the frame after the joystick has moved the piece
FIRST_MOVE = 14  # `clock` on the frame after the first move
GAME_OVER = 128  # least `message_clock` after the end of the game
ROWS_REMOVED = 30  # `message_clock` on the frame after whose drawing rows were removed
NEW_PIECE = 0x57  # `last_call` if the frame's last step was a new piece
NO_CALL = 0  # `last_call` after a reset
NEW_CLOCK = 16  # `clock` on the second frame after a reset
RESET_ROW = 18  # `piece_row` before a reset
# bits of the columns in `left` and `right`
LEFT_BITS = np.arange(5, -1, -1)[None]
RIGHT_BITS = np.arange(4)[None]

# Four blocks for each kind and turn: columns from the piece's column in the high nibble, and
# 15 - rows below the piece's row in the low one.
PIECES = ROM.bytes(0x65D, 112).reshape(28, 4)
PIECE_COLUMNS = PIECES >> 4
PIECE_DEPTHS = 15 - (PIECES & 15)
FIRST_COLUMN = PIECE_COLUMNS.min(axis=1)
FIRST_DEPTH = PIECE_DEPTHS.min(axis=1)
PIECE_WIDTHS = np.ptp(PIECE_COLUMNS, axis=1) + 1
PIECE_HEIGHTS = np.ptp(PIECE_DEPTHS, axis=1) + 1
SLOT_OFFSETS = (PIECE_DEPTHS * WELL_COLUMNS + PIECE_COLUMNS).T  # of each block, by kind and turn
BLOCK_SLOTS = np.arange(WELL_ROWS * WELL_COLUMNS)[None]


class Ram(RamMap):
    left = byte(*range(21, -1, -1))  # columns 0-5 of the well from bit 5 down, top row first
    right = byte(*range(43, 21, -1))  # columns 6-9 from bit 0 up
    word = byte(78)  # first row of the right half of a word
    block_row = byte(*range(92, 96))  # of the piece's blocks, from the bottom
    block_left = byte(*range(96, 100))  # their bits in `left`; all are 0 without a piece
    block_right = byte(*range(100, 104))  # in `right`
    piece_row = byte(105)  # from the bottom
    piece_column = byte(106)  # 3 for the first column
    piece = byte(107)  # offset in PIECES
    before = byte(108)  # `piece_row` before a fall, or `piece` before a move by the joystick
    column_before = byte(109)  # `piece_column` before a move by the joystick
    clock = byte(111)  # counts down from 16
    lower = bits(111, first=0, count=1)  # the picture is one row lower
    score = bcd((114, 113))
    message_clock = byte(115)  # frames until a word disappears
    last_call = byte(126)  # the stack: where the last subroutine returned to


class Drawn(NamedTuple):
    """The frame's falling piece and place."""

    row: jax.Array  # from the bottom
    column: jax.Array
    piece: jax.Array
    valid: jax.Array
    lower: jax.Array  # 1 if the picture is one row lower


def decode(m: Ram) -> dict[str, Box]:
    drawn = _as_drawn(m)
    return {
        "Player": _piece_box(drawn),
        "Block": _block_boxes(m, drawn),
        "Score": _score_box(m, drawn),
        "Message": _message_box(m, drawn),
    }


def _as_drawn(m: Ram) -> Drawn:
    """The piece before its last move, or before a reset."""
    is_move = (m.clock & 3) == MOVES
    turned = (m.piece & 0xF0) | ((m.piece - 4) & 15)
    keeps_turn = (m.before == m.piece) | (m.before == turned)
    by_a_column = jnp.abs(m.column_before - m.piece_column) <= 1
    pulled = (m.before == m.piece_row + 1) & ~(keeps_turn & by_a_column)
    fell = (m.clock == FALLS) | is_move & pulled
    by_joystick = is_move & ~fell
    row = m.piece_row + when(fell, 1)
    # The last move ended in another column, so the joystick has not moved this piece yet.
    elsewhere = jnp.abs(m.column_before - NEW_COLUMN) > 1
    unmoved = fell & (m.piece_column == NEW_COLUMN) & elsewhere
    is_new = (row == TOP_ROW) & ((m.clock == FIRST_MOVE) | unmoved)
    was_reset = m.last_call == NO_CALL
    return Drawn(
        jnp.where(was_reset, RESET_ROW, row),
        match((was_reset, NEW_COLUMN), (by_joystick, m.column_before), otherwise=m.piece_column),
        match((was_reset, 0), (by_joystick, m.before), otherwise=m.piece),
        was_reset | _has_piece(m) & ~is_new,
        jnp.where(was_reset, (m.clock == NEW_CLOCK).astype(jnp.int32), m.lower),
    )


def _has_piece(m: Ram) -> jax.Array:
    return jnp.any((m.block_left | m.block_right) != 0) & (m.message_clock < GAME_OVER)


def _piece_box(drawn: Drawn) -> Box:
    kind = drawn.piece >> 2
    column = drawn.column - 3 + pick(kind, FIRST_COLUMN)
    row = TOP_ROW - drawn.row + pick(kind, FIRST_DEPTH)
    left = WELL[0] + PITCH[0] * column
    top = WELL[1] + PITCH[1] * row + drawn.lower
    width = PITCH[0] * pick(kind, PIECE_WIDTHS) - 1
    height = PITCH[1] * pick(kind, PIECE_HEIGHTS) - 1
    piece = box(left, top, width, height, drawn.valid, color=pick(row, ROW_COLORS))
    return piece.clip(*WELL)


def _block_boxes(m: Ram, drawn: Drawn) -> Box:
    """The blocks of the well, with the piece where it was drawn."""
    in_well = _has_piece(m)
    left = m.left ^ when(in_well, _piece_bits(m, m.block_left))
    right = m.right ^ when(in_well, _piece_bits(m, m.block_right))
    columns = [left[:, None] >> LEFT_BITS, right[:, None] >> RIGHT_BITS]
    settled = (jnp.concatenate(columns, axis=1).ravel() & 1) == 1
    return box(BLOCK_X, BLOCK_Y + drawn.lower, *BLOCK, settled | _falling(drawn))


def _falling(drawn: Drawn) -> jax.Array:
    """True for the slots of the piece's blocks."""
    kind = drawn.piece >> 2
    first = (TOP_ROW - drawn.row) * WELL_COLUMNS + drawn.column - 3
    slots = [first + pick(kind, offsets) for offsets in SLOT_OFFSETS]
    return jnp.any(jnp.stack(slots)[:, None] == BLOCK_SLOTS, axis=0) & drawn.valid


def _piece_bits(m: Ram, mask: jax.Array) -> jax.Array:
    """The piece's bits in one half of the well, by row."""
    rows = np.arange(TOP_ROW, -1, -1)
    blocks = [when(m.block_row[i] == rows, mask[i]) for i in range(4)]
    return functools.reduce(jnp.bitwise_or, blocks)


def _score_box(m: Ram, drawn: Drawn) -> Box:
    return box(SCORE.lefts[0], SCORE.top + drawn.lower, 60, FONT.height, value=m.score)


def _message_box(m: Ram, drawn: Drawn) -> Box:
    over = m.message_clock >= GAME_OVER
    shown = (m.message_clock > 0) & (m.message_clock != ROWS_REMOVED) & ~_just_ended(m)
    widths = [(m.word == word, width) for word, width in WORD_WIDTHS.items()]
    width = match((over, 64), *widths, otherwise=0)
    top = jnp.where(over, WORDS[1], 123) + drawn.lower
    return box(WORDS[0], top, width, jnp.where(over, 88, 40), shown)


def _just_ended(m: Ram) -> jax.Array:
    return (m.message_clock >= GAME_OVER) & (m.last_call == NEW_PIECE)


BLOCK_X = np.tile(WELL[0] + PITCH[0] * np.arange(WELL_COLUMNS), WELL_ROWS)
BLOCK_Y = np.repeat(WELL[1] + PITCH[1] * np.arange(WELL_ROWS), WELL_COLUMNS)
BLOCK_RGB = tuple(np.repeat(NTSC[list(ROW_COLORS)], WELL_COLUMNS, axis=0))


DOT_BITS = np.array([4, 2, 1], np.int32)[None, None, None]
GLYPHS = np.array(FONT.glyphs, np.int32).T[None, :, None]
WEIGHTS = np.array([1000, 100, 10, 1], np.int32)[None, :, None]


def _read_score(colors: jax.Array, frames: jax.Array) -> jax.Array:
    """The score from a pixel of each dot that is its own on all frames."""
    middles = SCORE.top + 4 + FONT.dot[1] * np.arange(5)
    dots = np.array(SCORE.lefts)[:, None] + FONT.dot[0] * np.arange(FONT.dots)[None]
    is_lit = frames[:, middles[:, None, None], dots[None]] == YELLOW  # frame, row, digit, dot
    pictures = jnp.sum(jnp.where(is_lit, DOT_BITS, 0), axis=-1)
    same = jnp.all(pictures[..., None] == GLYPHS, axis=1)  # frame, digit of the score, 0 to 9
    number = jnp.sum(jnp.where(same, np.arange(10)[None, None] * WEIGHTS, 0), axis=(-2, -1))
    is_known = jnp.all(jnp.any(same, axis=-1), axis=-1)
    return jnp.where(is_known, number, UNKNOWN_VALUE)[None].astype(jnp.int32)


BLOCK_COLORS = tuple(dict.fromkeys(ROW_COLORS))
# Sizes of pieces: columns and rows of blocks.
PIECE_SIZES = sorted(set(zip(PIECE_WIDTHS.tolist(), PIECE_HEIGHTS.tolist(), strict=True)))
FOUR_BLOCKS = 4 * PITCH[0] * PITCH[1]  # pixels, with the gaps right of the blocks and below them
PIECE_SHAPES = tuple(
    Shape(w=PITCH[0] * columns - 1, h=PITCH[1] * rows - 1, pixels=FOUR_BLOCKS)
    for columns, rows in PIECE_SIZES
)

GAME = Game(
    name="Tetris",
    rom=ROM,
    ram=Ram,
    decode=decode,
    categories=(
        Category(
            "Player",
            Blobs(BLOCK_COLORS, WITH_GAPS, PIECE_SHAPES, gap=(1, 1)),
            role="player",
            doc="the falling piece",
        ),
        Category(
            "Block",
            Cells(
                BLOCK_COLORS,
                tuple(BLOCK_X.tolist()),
                tuple(BLOCK_Y.tolist()),
                *PITCH,
                whole=False,
            ),
            count=WELL_ROWS * WELL_COLUMNS,
            rgb=BLOCK_RGB,
            doc="filled places of the well",
        ),
        display(
            "Score",
            Bounds(YELLOW, SCORE_AREA),
            value=_read_score,
            role="score",
            doc="points",
        ),
        display("Message", Bounds(YELLOW, WORDS), attributes=(), doc="number of rows, game over"),
    ),
)
