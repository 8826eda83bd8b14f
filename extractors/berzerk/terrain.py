"""The walls of Berzerk's rooms.

A room's picture is one of four in the ROM: a row of the playfield for every four lines. The drawing
loop ($F03E-$F058) adds the side walls, and the code around it the walls at the top and the bottom.
"""

import itertools
from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import WIDTH, TerrainKind, TerrainMap, playfield, when
from ocjax.extractors.berzerk.ram import (
    ROM,
    Exit,
    Frame,
    Ram,
    Shut,
    State,
    on_last_frame,
    rows_of_robots,
)

WALL_COLOR = 136
LINES = np.arange(210)
TOP = 4  # first line of the upper wall
BOTTOM = 180
ROW_LINES = 4  # of a row of the picture, and of the walls at the top and the bottom
ROWS = np.arange(2, 44)  # of the picture inside these walls

MAZES = ROM.bytes(0xFDE, 4)  # offset of each picture in the ROM's three tables
TABLE_PF0 = 0xB00  # these tables
TABLE_PF1 = 0xD00
TABLE_PF2 = 0xE00
SIDE_WALLS = (0x00, 0x20)  # what the drawing loop adds to PF0: the side exits are open, or shut
ACROSS_PF0 = 0xE0  # of the walls at the top and the bottom
ACROSS_PF1 = 0xFF
EXIT_OPEN = 0x07  # their PF2 with an exit
EXIT_SHUT = 0xFF
DOORS = range(3)  # values of `door`: at the top, at the bottom, at a side

BLANK_COLUMNS = 8  # at the left, which the chip blanks on a line where it moves a sprite
BLANK_LINE = 3  # less two lines for each of `robot_y`


def _across(is_shut: bool) -> np.ndarray:
    """The lines of the wall at the top or the bottom, bool `[4, 160]`."""
    pf2 = EXIT_SHUT if is_shut else EXIT_OPEN
    line = playfield(ACROSS_PF0, ACROSS_PF1, pf2, mirrored=True)
    return np.tile(line, (ROW_LINES, 1))


def _room(maze: int, sides: int, door: int) -> np.ndarray:
    """A room's walls, bool `[1, 210, 160]`."""
    at = maze + ROWS
    pf0 = ROM.data[TABLE_PF0 + at] | sides
    picture = playfield(pf0, ROM.data[TABLE_PF1 + at], ROM.data[TABLE_PF2 + at], mirrored=True)
    middle = picture.repeat(ROW_LINES, axis=0)
    walls = np.concatenate([_across(door == Shut.TOP), middle, _across(door == Shut.BOTTOM)])
    return np.pad(walls, ((TOP, len(LINES) - BOTTOM), (0, 0)))[None]


LAYOUTS = np.stack(
    [_room(*looks) for looks in itertools.product(MAZES.tolist(), SIDE_WALLS, DOORS)]
)


def layout(m: Ram) -> jax.Array:
    """The room's picture, its side exits (open while it scrolls) and the shut exit."""
    shut = (m.sides != 0) & ((m.state == State.IN_ROOM) | (m.frame == Frame.LAST))
    door = jnp.minimum(m.door, DOORS[-1])
    maze = jnp.minimum(m.maze, len(MAZES) - 1)
    return (maze * len(SIDE_WALLS) + when(shut, 1)) * len(DOORS) + door


def changes(m: Ram, masks: Mapping[str, jax.Array]) -> dict[str, jax.Array]:
    """The walls without blank columns, and without the lines that scrolling has emptied."""
    blank = _has_blanks(m)[:, None] & (np.arange(WIDTH) < BLANK_COLUMNS)[None, :]
    return {"wall": masks["wall"] & ~blank & _is_drawn(m)[:, None]}


def _has_blanks(m: Ram) -> jax.Array:
    """The lines on which the chip moves a robot's sprite, bool `[210]`."""
    robots = rows_of_robots(m)
    there = robots.valid & ((m.state == State.IN_ROOM) | on_last_frame(m))
    moves = (LINES[:, None] == (2 * robots.y + BLANK_LINE)[None, :]) & there[None, :]
    return jnp.any(moves, axis=1)


def _is_drawn(m: Ram) -> jax.Array:
    """The lines that are not empty: all of them, or fewer while a room scrolls, bool `[210]`."""
    scrolls = (m.state == State.LEAVES) & (m.frame != Frame.LAST)
    # The RAM is a step ahead of the screen. Only one end moves if the exit is at the top or bottom.
    begin = m.scrolled - when(m.exit != Exit.BOTTOM, 1)
    end = m.scroll_end + when(m.exit != Exit.TOP, 1)
    pair = jnp.asarray((LINES - TOP) // 2)
    between_rooms = (m.state == State.IN_ROOM) & (m.appearing == 0) & ~m.is_over
    return (~scrolls | ((pair >= begin) & (pair < end))) & ~between_rooms


def seen(frame: jax.Array) -> dict[str, jax.Array]:
    """The walls by their colour."""
    return {"wall": frame == WALL_COLOR}


TERRAIN = TerrainMap(
    kinds=(TerrainKind("wall", "walls, deadly to humans and robots", effect="blocks"),),
    layouts=LAYOUTS,
    layout=layout,
    changes=changes,
    seen=seen,
)
