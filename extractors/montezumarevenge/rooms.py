"""The fixed parts of the rooms of Montezuma's Revenge's pyramid.

Each room has its own drawing code in the ROM, so the table of parts was read off the screen. REM
looks up the boxes of the room's parts. VEM finds a part by a run of pixels in one of its rows.
"""

import itertools
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Box, BoxTable, Run, Runs
from ocjax.extractors.montezumarevenge.ram import ROM, Picture, Ram

ROOM_COUNT = 24
BRIDGES_GO = 0  # `clock` modulo 128: the bridges disappear after the drawing of this frame
BRIDGES_COME = 36  # the bridges come back after the drawing of this frame

# Colours, by depth and pyramid.
ROCK_COLORS, RUNG_COLORS = ROM.bytes(0x1DFF, 12).reshape(2, 6).tolist()
EXPLORER_COLORS = (70, 74, 76, 250)  # he may stand in front of rock and rungs
GOLD = 252
FORCE_COLOR = 138
ROPE_ROOMS = (1, 5, 8, 14)
ROPES = ((112, 96, 113, 135), (41, 97, 42, 122), (80, 96, 81, 147), (71, 96, 72, 144))


class Mark(NamedTuple):
    """A run of pixels in one row of a part; without a width, it spans the part."""

    colors: tuple[int, ...]
    row: int
    left: int = 0
    width: int = 0


class Part(NamedTuple):
    """A part of some rooms: its box, and its marks; VEM finds it by any of them."""

    rooms: tuple[int, ...]
    left: int
    top: int
    width: int
    height: int
    marks: tuple[Mark, ...]


def _in_rooms(
    rooms: tuple[int, ...], left: int, top: int, width: int, height: int, *marks: Mark
) -> Part:
    whole = (mark if mark.width else mark._replace(left=left, width=width) for mark in marks)
    return Part(rooms, left, top, width, height, tuple(whole))


_rock = partial(Mark, (*ROCK_COLORS, *EXPLORER_COLORS))
_rungs = partial(Mark, (*RUNG_COLORS, *EXPLORER_COLORS))
_either = partial(Mark, (*ROCK_COLORS, *RUNG_COLORS, *EXPLORER_COLORS))  # rock or rungs
_plank = partial(Mark, (*ROCK_COLORS, *RUNG_COLORS))  # without the explorer, who walks above it
_door = partial(Mark, (GOLD,))
_force = partial(Mark, (FORCE_COLOR,))


def _bridge(rooms: tuple[int, ...], top: int, row: int) -> Part:
    """The bridge over a pit, found by any of its first three planks."""
    planks = _plank(row, 36, 8), _plank(row, 44, 8), _plank(row, 52, 8)
    return _in_rooms(rooms, 36, top, 88, 6, *planks)


def _steps(top: int) -> tuple[Part, Part]:
    """The left and the right step of room 8 at a row, found by their inner two thirds."""
    row = top + 1
    left = _in_rooms((8,), 4, top, 12, 4, _plank(row, 8, 4), _plank(row, 12, 4))
    right = _in_rooms((8,), 144, top, 12, 4, _plank(row, 144, 4), _plank(row, 148, 4))
    return left, right


# fmt: off
LEDGES = (  #  rooms  left top width height  known by
    _in_rooms((1,),      0,  93,  56,  3, _rock(95)),
    _in_rooms((1,),     68,  93,  24,  3, _rock(95)),
    _in_rooms((1,),    104,  93,  56,  3, _rock(95)),
    _in_rooms((1,),      0, 136,  36,  3, _rock(137)),
    _in_rooms((1,),    124, 136,  36,  3, _rock(137)),
    _in_rooms((5,),     48, 130,  64,  3, _rock(131)),
    _in_rooms((5, 8),    0,  93,  48,  3, _rock(95)),
    _in_rooms((5, 8),  112,  93,  48,  3, _rock(95)),
    _in_rooms((8,),     76,  93,   8,  3, _rock(93)),
    _in_rooms((14,),     0,  93,  40,  3, _rock(95)),
    _in_rooms((14,),    68,  93,  24,  3, _rock(95)),
    _in_rooms((14,),   120,  93,  40,  3, _rock(95)),
)
WALLS = (
    _in_rooms((1,),             0,  96,  8, 40, _either(101)),
    _in_rooms((1,),           152,  96,  8, 40, _either(101)),
    _in_rooms((1,),             0, 139, 16, 41, _either(158, 0, 32)),  # with the ladder beside it
    _in_rooms((1,),           144, 139, 16, 41, _either(158, 128, 32)),
    _in_rooms((5, 8),           0,  96,  4, 75, _either(101)),
    _in_rooms((5, 8),         156,  96,  4, 75, _either(101)),
    _in_rooms((5,),            32,  53,  4, 40, _either(68)),
    _in_rooms((5,),           124,  53,  4, 40, _either(68)),
    _in_rooms((14,),            0,  96, 16, 72, _either(101)),
    _in_rooms((14,),          144,  96, 16, 72, _either(101)),
    _in_rooms((3, 8, 10, 21),   0,  53,  4, 41, _either(68)),
    _in_rooms((2, 9, 20, 23), 156,  52,  4, 41, _either(68)),
    _in_rooms((0,),             0,  53,  4, 42, _force(93)),
    _in_rooms((7,),           156,  53,  4, 41, _force(93)),
)
LADDERS = (
    _in_rooms((4, 6, 9, 10, 11, 13, 19, 21, 22), 72, 53, 16, 40, _rungs(71)),
    _in_rooms((1,),              72,  96, 16,  39, _rock(108)),
    _in_rooms((0, 7),            72,  95, 16, 101, _rock(108, 76, 8)),
    _in_rooms((2, 3, 4, 11, 13), 72,  94, 16, 101, _rock(107, 76, 8)),
    _in_rooms((5,),              72, 173, 16,  24, _rock(179, 76, 8)),
    _in_rooms((14,),             72, 170, 16,  24, _rock(176, 76, 8)),
    _in_rooms((1,),              16, 139, 16,  41, _rock(158, 0, 32)),  # with the wall beside it
    _in_rooms((1,),             128, 139, 16,  41, _rock(158, 128, 32)),
)
POLES = (
    _in_rooms((5,),  125, 96, 2, 51, _rock(98)),
    _in_rooms((14,),  87, 96, 2, 32, _rock(98)),
)
BELTS = (
    _in_rooms((1,), 60, 136, 40, 5, _rock(138)),
    _in_rooms((5,), 60,  93, 40, 5, _rock(95)),
)
BARRIERS = (  # the left one and the right one of a room
    _in_rooms((1,),   20,  54, 4, 37, _door(60)),
    _in_rooms((1,),  136,  54, 4, 37, _door(60)),
    _in_rooms((17,),  20,  55, 4, 37, _door(61)),
    _in_rooms((17,), 136,  55, 4, 37, _door(61)),
    _in_rooms((5,),   56, 135, 4, 35, _rock(135)),
    _in_rooms((5,),  100, 135, 4, 35, _rock(135)),
)
# fmt: on
BRIDGES = (
    _bridge((10, 20, 22), top=94, row=94),
    _bridge((18,), top=95, row=100),
    *(step for top in (103, 113, 123, 133, 153, 163) for step in _steps(top)),
)

PARTS_BY_CATEGORY = {  # and the most marks in one row of the screen
    "Platform": (LEDGES, 4),
    "Wall": (WALLS, 4),
    "Ladder": (LADDERS, 3),
    "Pole": (POLES, 3),
    "Conveyer_Belt": (BELTS, 3),
    "Barrier": (BARRIERS, 3),
    "Disappearing_Platform": (BRIDGES, 4),
}


def _run_of(part: Part, mark: Mark) -> Run:
    return Run(
        mark.colors,
        mark.row,
        mark.left,
        mark.width,
        height=part.top + part.height - mark.row,
        before=mark.left - part.left,
        above=mark.row - part.top,
        after=part.left + part.width - mark.left - mark.width,
    )


def _rule(parts: tuple[Part, ...], most: int) -> Runs:
    """VEM's rule for parts: their marks, from the top row down."""
    runs = {mark[1:]: _run_of(part, mark) for part in parts for mark in part.marks}
    return Runs(tuple(runs[place] for place in sorted(runs)), most)


def _by_room(parts: tuple[Part, ...]) -> np.ndarray:
    """The boxes of each room's parts, `[rooms, slots, 4]`; zeros in unused slots."""
    rooms = [
        [(p.left, p.top, p.width, p.height) for p in parts if room in p.rooms]
        for room in range(ROOM_COUNT)
    ]
    slots = max(map(len, rooms))
    return np.array([boxes + [(0, 0, 0, 0)] * (slots - len(boxes)) for boxes in rooms])


RULES = {name: _rule(parts, most) for name, (parts, most) in PARTS_BY_CATEGORY.items()}
PLACES_BY_CATEGORY = {name: _by_room(parts) for name, (parts, _) in PARTS_BY_CATEGORY.items()}
SLOT_COUNT = sum(places.shape[1] for places in PLACES_BY_CATEGORY.values())
ALL_PLACES = BoxTable(np.hstack(list(PLACES_BY_CATEGORY.values())).reshape(-1, 4))


def _ranges_of_slots() -> dict[str, slice]:
    """Each category's range in a room's slots."""
    counts = [places.shape[1] for places in PLACES_BY_CATEGORY.values()]
    ends = itertools.accumulate(counts)
    slots = (slice(end - count, end) for end, count in zip(ends, counts, strict=True))
    return dict(zip(PLACES_BY_CATEGORY, slots, strict=True))


SLOTS_BY_CATEGORY = _ranges_of_slots()


def room_parts(m: Ram, drawn: jax.Array, lit: jax.Array) -> dict[str, Box]:
    """The parts of the room by category; most of them are valid only while it is lit."""
    every = ALL_PLACES.at(SLOT_COUNT * m.room + np.arange(SLOT_COUNT), valid=m.room < ROOM_COUNT)
    shut = jnp.stack([m.left_door, m.right_door]) == Picture.DOOR
    # Bridges are lit in the dark, too.
    there = {"Barrier": lit & shut, "Disappearing_Platform": drawn & bridged(m)}
    return {
        name: _in_slots(every[slots].where(there.get(name, lit)), RULES[name].slots)
        for name, slots in SLOTS_BY_CATEGORY.items()
    }


def _in_slots(some: Box, slots: int) -> Box:
    """Boxes padded with invalid ones to `slots`."""
    missing = slots - len(some.x)
    return jax.tree.map(lambda v: jnp.pad(v, (0, missing)) if v.ndim else v, some)


def bridged(m: Ram) -> jax.Array:
    """True while bridges are there."""
    turn = m.clock & 127
    return (turn == BRIDGES_GO) | ((m.off == 0) & (turn != BRIDGES_COME))
