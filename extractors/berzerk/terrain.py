"""The walls of Berzerk's rooms.

A room's picture is one of four in the ROM: a row of the playfield for every four lines. The drawing
loop ($F03E-$F058) adds the side exits, and the code around it the walls at the top and the bottom.
"""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import TerrainKind, TerrainMap, playfield, when
from ocjax.extractors.berzerk.ram import (
    ROM,
    Exit,
    Frame,
    Ram,
    Shut,
    State,
    on_last_frame,
    robot_rows,
)

WALL_COLOR = 136
LINES = np.arange(210)
TOP = 4  # first line of the upper wall
INSIDE = 8  # first line of the room's picture
LOWER_WALL = 176
BOTTOM = 180
ROW_LINES = 4  # of a row of the picture

MAZES = ROM.bytes(0xFDE, 4)  # offset of each picture in the ROM's three tables
PF0, PF1, PF2 = 0xB00, 0xD00, 0xE00  # these tables
SIDE_WALLS = (0x00, 0x20)  # what the drawing loop adds to PF0: nothing, or the side exits' doors
ACROSS = (0xE0, 0xFF)  # PF0 and PF1 of the walls at the top and the bottom
EXIT_OPEN = 0x07  # their PF2 with an exit
EXIT_SHUT = 0xFF
DOORS = 3  # values of `door`: the exit at the top is shut, the one at the bottom, none of them

BLANKED = 8  # columns at the left that the chip blanks where it moves sprites
BLANKED_LINE = 3  # less `robot_y` in pairs of lines


def _across(is_shut: bool) -> np.ndarray:
    """A line of the wall at the top or the bottom, bool `[160]`."""
    bits = (*ACROSS, EXIT_SHUT if is_shut else EXIT_OPEN)
    return playfield(*map(np.array, bits), mirrored=True)


def _walls(maze: int, side_walls: int, door: int) -> np.ndarray:
    """A room's walls, bool `[210, 160]`."""
    rows = MAZES[maze] + LINES[INSIDE:LOWER_WALL] // ROW_LINES
    bits = ROM.data[PF0 + rows] | side_walls, ROM.data[PF1 + rows], ROM.data[PF2 + rows]
    inside = playfield(*bits, mirrored=True)
    walls = np.zeros((len(LINES), inside.shape[1]), bool)
    walls[TOP:INSIDE] = _across(door == Shut.TOP)
    walls[INSIDE:LOWER_WALL] = inside
    walls[LOWER_WALL:BOTTOM] = _across(door == Shut.BOTTOM)
    return walls


LAYOUTS = np.stack(
    [
        _walls(maze, side_walls, door)[None]
        for maze, side_walls, door in itertools.product(range(len(MAZES)), SIDE_WALLS, range(DOORS))
    ]
)


def layout(m: Ram) -> jax.Array:
    """The room's picture, its side exits (open while it scrolls) and the shut exit."""
    has_sides = (m.sides != 0) & ((m.state == State.IN_ROOM) | (m.frame == Frame.LAST))
    door = jnp.minimum(m.door, DOORS - 1)
    maze = jnp.minimum(m.maze, len(MAZES) - 1)
    return (maze * len(SIDE_WALLS) + when(has_sides, 1)) * DOORS + door


def changes(m: Ram, masks: dict[str, jax.Array]) -> dict[str, jax.Array]:
    """The walls without blanked columns, and without the lines that scrolling has emptied."""
    free = _is_blanked(m)[:, None] & (np.arange(masks["wall"].shape[1]) < BLANKED)[None, :]
    return {"wall": masks["wall"] & ~free & _is_drawn(m)[:, None]}


def _is_blanked(m: Ram) -> jax.Array:
    """The lines on which the chip moves a robot's sprite, bool `[210]`."""
    row = robot_rows(m)
    there = row.valid & ((m.state == State.IN_ROOM) | on_last_frame(m))
    blanked = (LINES[:, None] == (2 * row.y + BLANKED_LINE)[None, :]) & there[None, :]
    return jnp.any(blanked, axis=1)


def _is_drawn(m: Ram) -> jax.Array:
    """The lines that are not empty: all of them, or fewer while a room scrolls, bool `[210]`."""
    scrolls = (m.state == State.LEAVES) & (m.frame != Frame.LAST)
    # The RAM is a step ahead of the screen. Only one end moves if the exit is at the top or bottom.
    begin = m.scrolled - when(m.exit != Exit.BOTTOM, 1)
    end = m.scroll_end + when(m.exit != Exit.TOP, 1)
    pair = jnp.asarray((LINES - TOP) // 2)
    in_view = (pair >= begin) & (pair < end)
    between_rooms = (m.state == State.IN_ROOM) & (m.appearing == 0) & ~m.is_over
    return jnp.where(scrolls, in_view, True) & ~between_rooms


def seen(frame: jax.Array) -> dict[str, jax.Array]:
    """The walls by their colour."""
    return {"wall": frame == WALL_COLOR}


TERRAIN = TerrainMap(
    kinds=(TerrainKind("wall", "blue walls, deadly to humans and robots", effect="kills"),),
    layouts=LAYOUTS,
    layout=layout,
    changes=changes,
    seen=seen,
)
