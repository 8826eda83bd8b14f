"""The walls of Venture's halls and rooms, from the tables that the drawing loop reads.

The loop ($F062-$F133) draws pairs of lines. An entry of the tables has the playfield of some pairs
and the number of the last one. The loop stops for two pairs to move a sprite, and repeats the left
half at the right there; the game chooses pairs in which this changes no picture.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import TerrainKind, TerrainMap, area_mask, playfield, when
from ocjax.extractors.venture.ram import ROM, Ram, Room
from ocjax.extractors.venture.scene import (
    FIRST_MAP,
    SECOND_MAP,
    WALL_BOTTOM,
    WALL_COLORS,
    WALL_TOP,
    shown_scene,
)

HEIGHT = 210
PAIRS = 80  # of lines
ROOM_COUNT = 8
FIRST_HALL = ROOM_COUNT  # layouts of the halls follow those of the rooms
LAYOUT_COUNT = ROOM_COUNT + len(Room.HALLS)

STARTS = ROM.bytes(0xFF0, LAYOUT_COUNT)  # the first entry of each room and hall
MIRRORED = 0x59  # entries from this one on have no right half
TABLE_LAST_PAIR = 0xF57
TABLE_PF1 = 0xD16
TABLE_PF2 = 0xC16
TABLE_RIGHT_PF1 = 0xDA7
TABLE_RIGHT_PF2 = 0xCA7


def _entries_of(place: int) -> np.ndarray:
    """The entry of each pair of lines of a room or hall, int `[80]`."""
    ends = ROM.data[TABLE_LAST_PAIR + STARTS[place] :]  # of its entries, and of those that follow
    count = np.argmax(ends[1:] <= ends[:-1]) + 1
    return STARTS[place] + np.searchsorted(ends[:count], np.arange(PAIRS))


def _half(entries: np.ndarray, pf1: int, pf2: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The registers of one half in each pair of lines."""
    return np.zeros_like(entries), ROM.data[pf1 + entries], ROM.data[pf2 + entries]


def _walls_of(place: int) -> np.ndarray:
    """All walls of a room or hall, bool `[210, 160]`."""
    entries = _entries_of(place)
    left = _half(entries, TABLE_PF1, TABLE_PF2)
    has_right = STARTS[place] < MIRRORED
    right = _half(entries, TABLE_RIGHT_PF1, TABLE_RIGHT_PF2) if has_right else None
    lines = playfield(*left, right=right, mirrored=True).repeat(2, axis=0)
    return np.pad(lines, ((WALL_TOP, HEIGHT - WALL_TOP - len(lines)), (0, 0)))


# The pixels of both halls that are in the boxes of their rooms, bool `[210, 160]` each.
IN_ROOMS = tuple(
    np.logical_or.reduce([area_mask((r.x, r.y, r.x + r.width, r.y + r.height)) for r in rooms])
    for rooms in (FIRST_MAP, SECOND_MAP)
)


def _kinds(place: int) -> np.ndarray:
    """The walls, and the outlines of a hall's rooms, bool `[2, 210, 160]`."""
    walls = _walls_of(place)
    if place < FIRST_HALL:
        return np.stack([walls, np.zeros_like(walls)])
    mapped = IN_ROOMS[place - FIRST_HALL]
    return np.stack([walls & ~mapped, walls & mapped])


LAYOUTS = np.stack([_kinds(place) for place in range(LAYOUT_COUNT)])


def layout(m: Ram) -> jax.Array:
    """The room or hall on the screen."""
    scene = shown_scene(m)
    in_room = scene.is_room | scene.is_left
    hall = FIRST_HALL + when(scene.is_second, 1)
    return jnp.where(in_room, jnp.minimum(scene.number, ROOM_COUNT - 1), hall)


def seen(frame: jax.Array) -> dict[str, jax.Array]:
    """The walls by the colour of their hall. Only a hall has no upper wall."""
    below_score = (np.arange(HEIGHT) >= WALL_TOP)[:, None]
    by_hall = [(frame == color) & below_score for color in WALL_COLORS]
    walls = by_hall[0] | by_hall[1]
    outlines = by_hall[0] & IN_ROOMS[0] | by_hall[1] & IN_ROOMS[1]
    is_hall = ~jnp.any(walls[WALL_TOP:WALL_BOTTOM])
    rooms = outlines & is_hall
    return {"wall": walls & ~rooms, "room": rooms}


TERRAIN = TerrainMap(
    kinds=(
        TerrainKind(
            "wall", "walls of a room, and the bars of a hall", effect="blocks", category="Chamber"
        ),
        TerrainKind("room", "outlines of rooms on a hall's map", effect="blocks", category="Room"),
    ),
    layouts=LAYOUTS,
    layout=layout,
    seen=seen,
)
