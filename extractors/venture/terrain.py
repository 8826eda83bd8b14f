"""The walls of Venture's halls and rooms, from the tables that the drawing loop reads.

The loop ($F062-$F133) draws pairs of lines. An entry of the tables has the playfield of some pairs
and the number of the last one. The loop stops for two pairs to move a sprite, and repeats the left
half at the right there; the game chooses pairs in which this changes no picture.
"""

from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import WIDTH, TerrainKind, TerrainMap, area_mask, playfield, when
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
ROOMS = 8
FIRST_HALL = ROOMS  # layouts of the halls follow those of the rooms
LAYOUT_COUNT = ROOMS + len(Room.HALLS)

STARTS = ROM.bytes(0xFF0, LAYOUT_COUNT)  # the first entry of each room and hall
MIRRORED = 0x59  # entries from this one on have no right half
LAST_PAIRS = 0xF57
PF1, PF2 = 0xD16, 0xC16
RIGHT_PF1, RIGHT_PF2 = 0xDA7, 0xCA7


def _entries(place: int) -> Iterator[int]:
    """The entry of each pair of lines of a room or hall."""
    entry = int(STARTS[place])
    for pair in range(PAIRS):
        yield entry
        entry += pair == ROM.data[LAST_PAIRS + entry]


def _walls(place: int) -> np.ndarray:
    """All walls of a room or hall, bool `[210, 160]`."""
    entries = np.array(list(_entries(place)))
    outer, inner = (PF1, PF2) if STARTS[place] >= MIRRORED else (RIGHT_PF1, RIGHT_PF2)
    right = np.zeros_like(entries), ROM.data[outer + entries], ROM.data[inner + entries]
    left = np.zeros_like(entries), ROM.data[PF1 + entries], ROM.data[PF2 + entries]
    walls = np.zeros((HEIGHT, WIDTH), bool)
    walls[WALL_TOP : WALL_TOP + 2 * PAIRS] = np.repeat(
        playfield(*left, right=right, mirrored=True), 2, axis=0
    )
    return walls


# The pixels of both halls that are in the boxes of their rooms, bool `[210, 160]` each.
IN_ROOMS = tuple(
    np.logical_or.reduce([area_mask((r.x, r.y, r.x + r.width, r.y + r.height)) for r in rooms])
    for rooms in (FIRST_MAP, SECOND_MAP)
)


def _kinds(place: int) -> np.ndarray:
    """The walls, and the outlines of a hall's rooms, bool `[2, 210, 160]`."""
    walls = _walls(place)
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
    return jnp.where(in_room, jnp.minimum(scene.number, ROOMS - 1), hall)


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
