"""The walls of Adventure's rooms.

The beam shows walls from the last line before the view to the first columns of the line below it.
In dark rooms the walls are as grey as the ground. Only the sprite that lights them round the player
shows them, as gaps.
"""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import WIDTH, TerrainKind, TerrainMap, among, area_mask, when
from ocjax.extractors.adventure.drawn import as_drawn
from ocjax.extractors.adventure.ram import Ram, Shown
from ocjax.extractors.adventure.rooms import (
    ADDRESSES,
    BEFORE_ROWS,
    CELL_WIDTH,
    CONTROLS,
    IN_FRONT,
    ROOMS,
    ROW_HEIGHT,
    THIN_LEFT,
    THIN_LEFT_X,
    THIN_RIGHT,
    THIN_RIGHT_X,
    THIN_WIDTH,
    VIEW_BOTTOM,
    WALLS,
)
from ocjax.extractors.adventure.vision import CORNER_LINE, GRAY, LAMP, WALLS_TOP

HEIGHT = 250
LIGHT_WIDTH = 32  # of the sprite that lights a dark room
LIGHT_HEIGHT = 64
WIDER_LATER = 1  # column: the chip begins a wide sprite so much later
LAST_COLUMNS = 5  # of the line below the view, until the picture ends
LINES = np.arange(HEIGHT)
COLUMNS = np.arange(WIDTH)
VISIBLE = area_mask((0, WALLS_TOP, WIDTH, VIEW_BOTTOM), HEIGHT) | area_mask(
    (0, VIEW_BOTTOM, LAST_COLUMNS, VIEW_BOTTOM + 1), HEIGHT
)


def _thin_area(left: int) -> np.ndarray:
    """A thin wall from top to bottom, bool `[250, 160]`."""
    return area_mask((left, WALLS_TOP, left + THIN_WIDTH, VIEW_BOTTOM), HEIGHT)


THIN_AREAS = {THIN_LEFT: _thin_area(THIN_LEFT_X), THIN_RIGHT: _thin_area(THIN_RIGHT_X)}


def _kinds(room: int) -> list[np.ndarray]:
    """Walls, thin walls and the walls of a dark room, bool `[250, 160]` each."""
    row = np.clip((LINES - BEFORE_ROWS) // ROW_HEIGHT, 0, WALLS.shape[1] - 1)
    thick = np.repeat(WALLS[room][row], CELL_WIDTH, axis=1) & VISIBLE
    thin = [area for bit, area in THIN_AREAS.items() if CONTROLS[room] & bit]
    any_thin = np.logical_or.reduce([np.zeros_like(thick), *thin])
    is_dark = CONTROLS[room] & IN_FRONT > 0
    return [thick & ~any_thin & ~is_dark, any_thin, thick & is_dark]


LAYOUTS = np.stack([_kinds(room) for room in range(ROOMS)])


def layout(m: Ram) -> jax.Array:
    """The room on the screen.

    If the player was thrown back into the room before, only the picture is known: the last room
    that has it.
    """
    room = as_drawn(m).room
    number = np.arange(ROOMS)
    has_picture = (m.walls_address & 0xFFF) == (ADDRESSES & 0xFFF)
    fits = jnp.any(has_picture & (number == room)) | ~jnp.any(has_picture)
    return jnp.where(fits, room, jnp.max(when(has_picture, number)))


def changes(m: Ram, masks: Mapping[str, jax.Array]) -> dict[str, jax.Array]:
    """In dark rooms, only the walls in the light."""
    hidden = masks["dark_wall"]
    light = _lit(m) & jnp.any(hidden)
    return {**masks, "dark_wall": hidden & _around(light & ~hidden)}


def _lit(m: Ram) -> jax.Array:
    """The sprite that lights a room, one of the two that are drawn, bool `[250, 160]`."""
    drawn = as_drawn(m)
    is_first = m.first == Shown.LIGHT
    is_second = m.second == Shown.LIGHT
    left = jnp.where(is_first, drawn.first.x, drawn.second.x) + WIDER_LATER
    top = jnp.where(is_first, drawn.first.y, drawn.second.y)
    in_columns = among(jnp.asarray(COLUMNS) - left, range(LIGHT_WIDTH)) & (COLUMNS > 0)
    in_lines = among(jnp.asarray(LINES) - top, range(LIGHT_HEIGHT)) & (LINES < VIEW_BOTTOM)
    return in_lines[:, None] & in_columns[None, :] & (is_first | is_second)


def _around(pixels: jax.Array) -> jax.Array:
    """The box of some pixels, bool `[250, 160]`."""
    return _between(jnp.any(pixels, axis=1))[:, None] & _between(jnp.any(pixels, axis=0))[None, :]


def _between(there: jax.Array) -> jax.Array:
    """From the first to the last True."""
    count = jnp.cumsum(there.astype(jnp.int32))
    return (count > 0) & ((count < count[-1]) | there)


def seen(frame: jax.Array) -> dict[str, jax.Array]:
    """The walls in the colour of the corners; those of a dark room are gaps in the light."""
    ground = frame == GRAY
    at_left = _has_thin(ground, THIN_LEFT_X) & THIN_AREAS[THIN_LEFT]
    at_right = _has_thin(ground, THIN_RIGHT_X) & THIN_AREAS[THIN_RIGHT]
    thin = at_left | at_right
    corners = frame[CORNER_LINE, 0], frame[CORNER_LINE, WIDTH - 1]
    color = jnp.minimum(*corners)
    is_dark = color == GRAY
    thick = (frame == color) & VISIBLE & ~is_dark
    light = (frame == LAMP) & (COLUMNS > 0)[None, :]  # column 0 may be beyond the right edge
    gaps = ground & is_dark & _around(light)
    return {"wall": thick & ~thin, "thin_wall": thin & ~ground, "dark_wall": gaps}


def _has_thin(ground: jax.Array, left: int) -> jax.Array:
    """Whether there is a thin wall: nowhere ground, but ground on both sides."""
    own = ground[WALLS_TOP:VIEW_BOTTOM, left : left + THIN_WIDTH]
    beside = ground[:, left - 1] & ground[:, left + THIN_WIDTH]
    return ~jnp.any(own) & jnp.any(beside)


TERRAIN = TerrainMap(
    kinds=(
        TerrainKind("wall", "walls in the colour of their room", effect="blocks"),
        TerrainKind(
            "thin_wall",
            "at a side of four rooms, in the colour of a thing",
            effect="blocks",
            drawn="sprites",
        ),
        TerrainKind(
            "dark_wall",
            "walls of dark rooms in the light round the player",
            effect="blocks",
            drawn="background",
        ),
    ),
    layouts=LAYOUTS,
    layout=layout,
    changes=changes,
    seen=seen,
)
