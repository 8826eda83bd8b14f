"""The rock, bricks, ladders and fire pits of Montezuma's Revenge's rooms.

The ROM holds drawing code for each room, so the rows of blocks were read off the screen. A row is
the left half of the playfield, 20 blocks of four pixels with the leftmost in the highest bit; the
right half mirrors it, except in bricks without a shaft.
"""

import functools
from collections.abc import Iterable

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import TerrainKind, TerrainMap, among, area_mask
from ocjax.extractors.montezumarevenge.ram import Picture, Ram
from ocjax.extractors.montezumarevenge.rooms import (
    BARRIERS,
    BELTS,
    FORCE_COLOR,
    LADDERS,
    LEDGES,
    POLES,
    ROCK_COLORS,
    ROOM_COUNT,
    ROPE_ROOMS,
    ROPES,
    RUNG_COLORS,
    WALLS,
    Part,
    bridged,
)

KINDS = (
    TerrainKind("ceiling", "the ceiling of a room", "blocks", drawn="background"),
    TerrainKind("rock", "walls and the sides of pits", "blocks", category="Wall"),
    TerrainKind("platform", "ledges", "carries", category="Platform"),
    TerrainKind("brick", "the bricks below the floor", "blocks", drawn="background"),
    TerrainKind("mortar", "the joints between bricks", "blocks"),
    TerrainKind("ladder", "rails and rungs", "carries", category="Ladder"),
    TerrainKind("shaft", "a ladder in the bricks", "carries"),
    TerrainKind("pole", "a pole", "carries", drawn="sprites", category="Pole"),
    TerrainKind("rope", "a rope", "carries", drawn="sprites", category="Rope"),
    TerrainKind("conveyor", "a belt, in two phases", "carries", category="Conveyer_Belt"),
    TerrainKind("door", "a door that a key opens", "blocks", category="Barrier"),
    TerrainKind("bridge", "bridges and steps that go", "carries", category="Disappearing_Platform"),
    TerrainKind("lava", "fire in a pit", "kills", drawn="background"),
)
SEARCHED = (  # categories whose boxes `_seen` gets
    "Platform",
    "Ladder",
    "Pole",
    "Rope",
    "Conveyer_Belt",
    "Barrier",
    "Disappearing_Platform",
)
HEIGHT = 210
BlockRows = tuple[tuple[int, int], ...]  # (number of lines, blocks of the left half)

FULL = 0xFFFFF
BRICKS: BlockRows = ((1, FULL), (3, 0x55555), (3, 0xAAAAA))
SHAFT: BlockRows = ((1, 0xFFFFD), (3, 0x55555), (2, 0xAAAAC), (1, 0xAAAAD))
CEILING = (0, 47, 160, 50)
BLANKS = {1: 150, 5: 102}  # rows whose first columns are black, by room
BLANK_WIDTH = 8
LOWER_TOP = 93  # of the lower part of a room
LOWER_HEIGHT = 102
PIT: BlockRows = (
    (7, 0xFF800),
    (34, 0xFC000),
    (6, 0xFE000),
    (6, 0xFF000),
    (6, 0xFFC00),
    (6, 0xFFF00),
    (6, 0xFFFE0),
    (6, 0xFFFFC),
    (25, FULL),
)
ROCK_ROOMS: dict[int, BlockRows] = {  # rooms with rock above their bricks
    1: ((3, 0xFFFC7), (40, 0xC0000), (3, 0xFF800), (41, 0xF0000)),
    5: ((3, 0xFFF00), (34, 0x80000), (3, 0x800FF), (38, 0x80000), (1, FULL)),
    8: ((3, 0xFFF01), (47, 0x80000), (4, 0xF0000), (26, 0x80000)),
    14: ((3, 0xFFC07), (72, 0xF0000), (1, FULL)),
    **dict.fromkeys((10, 18, 20, 22), PIT),
}
SHAFT_ROOMS = (0, 2, 3, 4, 5, 7, 11, 13, 14)
LOWER_ROOMS = (0, 7, 12, 17, 18)  # their lower parts begin a row later
LONGER_ROOMS = {1: 3, 5: 2, 8: 3, 14: -1}  # more lines at the bottom
BONUS_ROOM = 15  # without terrain

SHAFT_AREA = (72, 93, 88, 198)
LAVA_ROOMS = (10, 18, 20, 22)
LAVA_TOP = 122
LAVA_END = 170
LAVA_COLORS = (34, 36, 38, 40, 42)
RUNG_PERIOD = 7
RAIL = 4  # pixels
HIGH_LADDER = 53  # top of the ladders to the floor above
HIGH_HEIGHT = 38
BELT: BlockRows = ((1, 0x14), (1, 0x01), (1, 0x1F), (1, 0x01), (1, 0x0A))
PLANKS: BlockRows = tuple((1, half) for half in (0x666, 0x199) * 3)
STEP: BlockRows = ((1, 0x70000), (1, 0x50000), (1, 0x20000), (1, 0x70000))
STEP_TOPS = (103, 113, 123, 133, 153, 163)
SIDE = (4, 156)  # walls of the upper part are outside of these columns


def _drawn_rows(top: int, rows: Iterable[tuple[int, int]], *, mirrored: bool = True) -> np.ndarray:
    """The pixels of rows from a line on, bool `[H, 160]`."""
    halves = np.array([half for count, half in rows for _ in range(count)], np.int32)
    left = (halves[:, None] >> np.arange(19, -1, -1) & 1) != 0
    right = left[:, ::-1] if mirrored else left
    pixels = np.concatenate([left, right], axis=1).repeat(4, axis=1)
    return np.pad(pixels, ((top, HEIGHT - top - len(pixels)), (0, 0)))


def _start_of_lower_part(room: int) -> int:
    return LOWER_TOP + (room in LOWER_ROOMS)


def _lines_of_rock(room: int) -> int:
    return sum(count for count, _ in ROCK_ROOMS.get(room, ()))


def _rock_of(room: int) -> np.ndarray:
    """The rock below the floor of a room and the ledges on it, bool `[H, 160]`."""
    return _drawn_rows(_start_of_lower_part(room), ROCK_ROOMS.get(room, ()))


def _lines_of_bricks(room: int) -> int:
    return LOWER_HEIGHT + LONGER_ROOMS.get(room, 0) - _lines_of_rock(room)


def _bricks_of(room: int) -> np.ndarray:
    """The pixels of bricks, bool `[H, 160]`."""
    lines = np.concatenate(
        [np.full(count, half) for count, half in (SHAFT if room in SHAFT_ROOMS else BRICKS)]
    )
    used = np.resize(lines, _lines_of_bricks(room)).tolist()
    floor_first = [FULL, *used[1:]][: len(used)]
    rows = ((1, half) for half in floor_first)
    return _drawn_rows(
        _start_of_lower_part(room) + _lines_of_rock(room), rows, mirrored=room in SHAFT_ROOMS
    )


def _between_bricks(room: int) -> np.ndarray:
    """The lines of the bricks, bool `[H, 160]`."""
    top = _start_of_lower_part(room) + _lines_of_rock(room)
    return area_mask((0, top, 160, top + _lines_of_bricks(room)))


def _in(parts: Iterable[Part], room: int) -> np.ndarray:
    """The pixels in the boxes of a room's parts, bool `[H, 160]`."""
    areas = (
        area_mask((p.left, p.top, p.left + p.width, p.top + p.height))
        for p in parts
        if room in p.rooms
    )
    return np.logical_or.reduce([np.zeros((HEIGHT, 160), bool), *areas])


def _rails_and_rungs(part: Part) -> np.ndarray:
    """The rails and rungs of a ladder, bool `[H, 160]`."""
    is_high = part.top == HIGH_LADDER
    end = part.top + (HIGH_HEIGHT if is_high else part.height)
    box = area_mask((part.left, part.top, part.left + part.width, end))
    between = area_mask((part.left + RAIL, 0, part.left + part.width - RAIL, HEIGHT))
    line = (np.arange(HEIGHT) - part.top + is_high) % RUNG_PERIOD
    is_rung = (line >= RUNG_PERIOD - 2) & (np.arange(HEIGHT) < end - 1)
    return box & (~between | is_rung[:, None])


def _ladders_of(room: int) -> np.ndarray:
    """The ladders of a room that are not in bricks, bool `[H, 160]`."""
    nothing = np.zeros((HEIGHT, 160), bool)
    own = (_rails_and_rungs(p) for p in LADDERS if room in p.rooms)
    return np.logical_or.reduce([nothing, *own]) & ~_between_bricks(room)


def _belt_of(room: int, phase: int) -> np.ndarray:
    """A conveyor belt in one of two phases, bool `[H, 160]`."""
    rows = BELT[:: 1 - 2 * phase]
    own = (_drawn_rows(p.top, rows) for p in BELTS if room in p.rooms)
    return np.logical_or.reduce([np.zeros((HEIGHT, 160), bool), *own])


def _bridge_of(room: int) -> np.ndarray:
    """What comes and goes: a bridge, or the steps of room 8; bool `[H, 160]`."""
    if room in LAVA_ROOMS:
        return _drawn_rows(_start_of_lower_part(room) + 1, PLANKS)
    if room != 8:
        return np.zeros((HEIGHT, 160), bool)
    return np.logical_or.reduce([_drawn_rows(top, STEP) for top in STEP_TOPS])


def _lava_of(room: int) -> np.ndarray:
    """The fire in a pit, bool `[H, 160]`."""
    low = room in LOWER_ROOMS
    fire = area_mask((0, LAVA_TOP + low, 160, LAVA_END + low))
    return fire & ~_rock_of(room) if room in LAVA_ROOMS else np.zeros_like(fire)


def _blank(room: int) -> np.ndarray:
    """The black pixels at the left edge, where a sprite moves, bool `[H, 160]`."""
    row = BLANKS.get(room, HEIGHT)
    return area_mask((0, row, BLANK_WIDTH, row + 1))


def _rope_of(room: int) -> np.ndarray:
    """The rope of a room, bool `[H, 160]`."""
    if room not in ROPE_ROOMS:
        return np.zeros((HEIGHT, 160), bool)
    return area_mask(ROPES[ROPE_ROOMS.index(room)])


def _doors_of(room: int) -> np.ndarray:
    """The doors of a room, every second line, bool `[H, 160]`."""
    line = np.arange(HEIGHT)[:, None]
    doors = (_in((p,), room) & ((line - p.top) % 2 == 0) for p in BARRIERS)
    return np.logical_or.reduce(list(doors))


def _fixed_parts(room: int) -> dict[str, np.ndarray]:
    """The kinds that play does not change, bool `[H, 160]` each."""
    stone = _rock_of(room) | _in(WALLS, room)
    platform = stone & _in(LEDGES, room)
    joints = _between_bricks(room) & ~_bricks_of(room)
    shaft = joints & area_mask(SHAFT_AREA) & (room in SHAFT_ROOMS)
    return {
        "ceiling": area_mask(CEILING),
        "rock": stone & ~(platform | _in(LADDERS, room) | _blank(room) | _between_bricks(room)),
        "platform": platform,
        "brick": _bricks_of(room),
        "mortar": joints & ~shaft,
        "ladder": _ladders_of(room),
        "shaft": shaft,
        "pole": _in(POLES, room),
        "rope": _rope_of(room),
        "lava": _lava_of(room),
    }


def _layout_of(room: int) -> np.ndarray:
    """All kinds in a room, bool `[kinds, H, 160]`."""
    moving = {"conveyor": _belt_of(room, 0), "door": _doors_of(room), "bridge": _bridge_of(room)}
    masks = {**_fixed_parts(room), **moving}
    return np.stack([masks[kind.name] for kind in KINDS]) & (room != BONUS_ROOM)


LAYOUTS = np.stack([_layout_of(room) for room in range(ROOM_COUNT)])
OTHER_BELTS = np.stack([_belt_of(room, 1) for room in range(ROOM_COUNT)])


def _known_room(m: Ram) -> jax.Array:
    return jnp.minimum(m.room, ROOM_COUNT - 1)


def _changes(m: Ram, masks: dict[str, jax.Array]) -> dict[str, jax.Array]:
    """Doors open, bridges go, and belts have two phases."""
    left_half = area_mask((0, 0, 80, HEIGHT))
    left_shut = m.left_door == Picture.DOOR
    right_shut = m.right_door == Picture.DOOR
    shut = (left_half & left_shut) | (~left_half & right_shut)
    other_phase = (m.clock - 1 >> 3 & 1) == 0
    other_belt = jnp.asarray(OTHER_BELTS)[_known_room(m)]
    return {
        **masks,
        "door": masks["door"] & shut,
        "bridge": masks["bridge"] & bridged(m),
        "conveyor": jnp.where(other_phase, other_belt, masks["conveyor"]),
    }


def _seen(frame: jax.Array, *boxes: jax.Array) -> dict[str, jax.Array]:
    """The kinds by colour, in the boxes of their categories."""
    within: dict[str, jax.Array] = dict(zip(SEARCHED, boxes, strict=True))
    rock = among(frame, ROCK_COLORS)
    rung = among(frame, RUNG_COLORS)
    rows = _rows_of_bricks(rung)
    parts = _parts_seen(frame, rock & ~rows, rung & ~rows, within)
    on_rows = {
        "brick": rock & rows,
        "mortar": rung & rows & ~within["Ladder"],
        "shaft": rung & rows & within["Ladder"],
    }
    side_wall = ((rung & _above_floor()) | (frame == FORCE_COLOR)) & _at_side()
    others = functools.reduce(jnp.logical_or, parts.values())
    stone = (rock & ~rows & ~others & _below_score()) | side_wall
    fire = among(frame, LAVA_COLORS) & area_mask((0, LAVA_TOP, 160, LAVA_END + 1))
    top = rock & area_mask(CEILING)
    return {"ceiling": top, "rock": stone & ~top, "lava": fire, **on_rows, **parts}


def _parts_seen(
    frame: jax.Array, rock: jax.Array, rung: jax.Array, within: dict[str, jax.Array]
) -> dict[str, jax.Array]:
    """The kinds that have a category, by colour in its boxes."""
    return {
        "platform": rock & within["Platform"],
        "ladder": (rock | rung) & within["Ladder"],
        "pole": rock & within["Pole"],
        "rope": (frame != 0) & within["Rope"],
        "conveyor": rock & within["Conveyer_Belt"],
        "door": (frame != 0) & within["Barrier"],
        "bridge": rock & within["Disappearing_Platform"],
    }


def _rows_of_bricks(rung: jax.Array) -> jax.Array:
    """BlockRows with joints at the left edge of the lower part, and those beside them, `[H, 1]`."""
    joints = (rung[:, 1] | rung[:, 5]) & (np.arange(HEIGHT) >= LOWER_TOP)
    above = jnp.roll(joints, -1)
    below = jnp.roll(joints, 1)
    return (joints | above | below)[:, None]


def _below_score() -> np.ndarray:
    return area_mask((0, CEILING[1], 160, HEIGHT))


def _above_floor() -> np.ndarray:
    return area_mask((0, 0, 160, LOWER_TOP))


def _at_side() -> np.ndarray:
    left, right = SIDE
    return ~area_mask((left, 0, right, HEIGHT))


TERRAIN = TerrainMap(
    kinds=KINDS,
    layouts=LAYOUTS,
    layout=_known_room,
    changes=_changes,
    seen=_seen,
    boxes=SEARCHED,
)
