"""The visible part of Adventure's player, a square of four columns and eight lines."""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Box, edges, extremes, when
from ocjax.extractors.adventure import rooms
from ocjax.extractors.adventure.drawn import Drawn, Sprite
from ocjax.extractors.adventure.pictures import ROW_DOTS, ROW_LINES, four_rows, ink_columns, united

COLUMNS = 4
ALL_COLUMNS = 15  # a bit each
ROWS = np.arange(4)  # of two lines each


def player_box(drawn: Drawn) -> Box:
    """The visible part of the player, in the colour of the walls."""
    line = drawn.y + ROW_LINES * ROWS
    walls = rooms.walls_at(drawn.room, rooms.row_of(line), drawn.x) >> ROW_DOTS - COLUMNS
    before = _over_player(drawn.first, drawn) | _over_player(drawn.second, drawn)
    seen = ~(walls | when(~drawn.dark, before)) & ALL_COLUMNS
    top, bottom = extremes(seen > 0, line, line + ROW_LINES)
    ink = united(seen)
    left, right = ink_columns(ink, COLUMNS)
    return edges(drawn.x + left, top, drawn.x + right, bottom, ink > 0).clip(*rooms.VIEW)


def _over_player(sprite: Sprite, drawn: Drawn) -> jax.Array:
    """The dots of a thing before the player: four bits for each of his four rows."""
    row = drawn.y - sprite.y >> 1
    dots = four_rows(sprite.picture, row) >> ROW_DOTS * ROWS & 0xFF
    there = (row + ROWS >= 0) & (row + ROWS < sprite.rows) & sprite.solid
    aside = jnp.clip(drawn.x - sprite.x, -COLUMNS, ROW_DOTS)
    return when(there, dots << COLUMNS >> ROW_DOTS - aside & ALL_COLUMNS)
