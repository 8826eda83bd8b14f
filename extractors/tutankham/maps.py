"""Tutankham's four maps, each a slice of the ROM: objects, pictures and colours."""

import numpy as np
from ocjax.authoring import Pictures, Rom, Shape

ROM = Rom("tutankham", "085322bae40d904f53bdcc56df0593fc")
SLICES = (3, 4, 0, 1)  # slice of the ROM for each map; 1,024 bytes each

MAP_ROW = 4  # lines of the screen per row of a map
PLACES = 8  # entries in the list of a map's things; in a list of seven, the last entry has row 255
ENTRY_BYTES = 5
THINGS = 0xD7  # offset of the list in a slice
DOOR_LOOK = 0x5C  # pictures of things; the others are treasures
KEY_LOOK = 0x94
LOOKS = 26  # figures' pictures: two for each kind, alive and dying, and for the player with the key
ROWS = 12  # most rows of a picture
PICTURE_LIST = 0x364  # offset in a slice
LAST_X = 150  # of things
SECOND = 4  # bytes from an entry of that program to the entry for the chip's second figure, a thing
ROUTINES = 0x2E3  # offset in a slice: entries of the program that positions figures


def table_of(offset: int, count: int, step: int = 1) -> np.ndarray:
    """A table of every map, int32 `[4, count]`."""
    return np.stack([ROM.bytes(1024 * part + offset, count, step) for part in SLICES])


def placing_at(x: int) -> tuple[int, int]:
    """Entry of the program that positions a figure at x, and the chip's fine movement."""
    columns = x + (x >> 4) + 1 >> 4
    begin = ROM.data[1024 * SLICES[0] + ROUTINES + columns]  # equal in all maps
    return int(begin), (~(columns + x) << 4) + 0x80 & 0xFF


def _columns_of_things() -> np.ndarray:
    """The columns of the things in each map, int32 `[4, 8]`."""
    columns = {placing_at(x): x - 1 for x in range(LAST_X + 1)}
    starts = table_of(THINGS + 3, PLACES, ENTRY_BYTES) - SECOND
    moves = table_of(THINGS + 4, PLACES, ENTRY_BYTES) & 0xF0
    lefts = [columns.get((int(a), int(b)), 0) for a, b in zip(starts.flat, moves.flat, strict=True)]
    return np.reshape(lefts, starts.shape)


def _until_empty(picture: np.ndarray) -> np.ndarray:
    """A picture up to its first empty row."""
    return np.where(np.logical_or.accumulate(picture == 0), 0, picture)


def _pictures_of(page: int, lows: np.ndarray) -> np.ndarray:
    """Pictures of each map, from the low bytes of their addresses: int32 `[4, n, 12]`."""
    offsets = 1024 * np.array(SLICES)[:, None] + 256 * page + lows
    found = ROM.rows(offsets.ravel().tolist(), ROWS, top_first=True)
    return np.apply_along_axis(_until_empty, -1, found).reshape(*lows.shape, ROWS)


THING_LOOKS = table_of(THINGS + 2, PLACES, ENTRY_BYTES)
# Treasures, the key, the door.
ORDER = np.lexsort((THING_LOOKS == KEY_LOOK, THING_LOOKS == DOOR_LOOK))


def _in_order(table: np.ndarray) -> np.ndarray:
    """A table of things, int32 `[4, 8, ...]`, sorted by kind."""
    return np.stack([row[by_kind] for row, by_kind in zip(table, ORDER, strict=True)])


INKS = table_of(0x309, 9)  # colours of each map
PLACINGS = table_of(THINGS + 4, PLACES, ENTRY_BYTES)  # of things; the low bits are their colours
THING_ROWS = _in_order(table_of(THINGS, PLACES, ENTRY_BYTES))  # of the map
THING_LEFTS = _in_order(_columns_of_things())
THING_COLORS = _in_order(np.take_along_axis(INKS, PLACINGS & 7, axis=1))
THING_PICTURES = _in_order(_pictures_of(1, THING_LOOKS))
FIGURE_PICTURES = _pictures_of(0, table_of(PICTURE_LIST, LOOKS))
THING_EXTENTS = Pictures.of(THING_PICTURES.reshape(-1, ROWS), map=4, place=PLACES)
FIGURE_EXTENTS = Pictures.of(FIGURE_PICTURES.reshape(-1, ROWS), map=4, look=LOOKS)


def shapes_of(extents: Pictures, pictures: np.ndarray, chosen: np.ndarray) -> tuple[Shape, ...]:
    """Sizes and numbers of pixels of some pictures, without duplicates."""
    width = extents.packed >> 4 & 15
    height = extents.packed >> 16
    pixels = np.bitwise_count(pictures.reshape(-1, ROWS)).sum(axis=1)
    sizes = {*zip(width[chosen], height[chosen], pixels[chosen], strict=True)}
    return tuple(Shape(int(w), int(h), int(n)) for w, h, n in sorted(sizes) if n > 0)
