"""The walls of Adventure's rooms.

The beam shows walls from the last line before the view to the first columns of the line below it.
In dark rooms the walls are as grey as the ground. Only the sprite that lights them round the player
shows them, as gaps.
"""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import WIDTH, TerrainKind, TerrainMap, area_mask, when
from ocjax.extractors.adventure.drawn import as_drawn
from ocjax.extractors.adventure.ram import Ram
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
    """True for a thin wall: no ground in its columns, but ground on both sides."""
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
            "walls of dark rooms; only the light round the player shows them",
            effect="blocks",
            drawn="background",
        ),
    ),
    layouts=LAYOUTS,
    layout=layout,
    seen=seen,
)
