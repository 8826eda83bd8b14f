"""The chart of a quadrant in Solaris: the symbols of its sectors, and the time left on it."""

import jax
import jax.numpy as jnp
import numpy as np
from ocjax.authoring import Box, Cells, NumberDisplay, lookup
from ocjax.extractors.solaris.ram import ROM, Ram
from ocjax.extractors.solaris.scanner import FONT
from ocjax.extractors.solaris.screens import ON_CHART

SECTORS_ACROSS = 6
SECTORS_DOWN = 8
SECTORS = SECTORS_ACROSS * SECTORS_DOWN
SECTOR_X = 36 + 16 * np.tile(np.arange(SECTORS_ACROSS), SECTORS_DOWN)  # of each sector's symbol
SECTOR_Y = 46 + 13 * np.repeat(np.arange(SECTORS_DOWN), SECTORS_ACROSS)
SYMBOL_SIZE = 8  # pixels each way
EMPTY = 0  # symbol of an empty sector
SYMBOL_PICTURES = ROM.pictures([0x1100 + SYMBOL_SIZE * symbol for symbol in range(16)], SYMBOL_SIZE)

BRIGHTEST = 14  # of a hue
SYMBOL_COLORS = ROM.bytes(0x37F0, 16) | BRIGHTEST  # by quadrant
TIMER_COLORS = SYMBOL_COLORS - BRIGHTEST + 0xC8 & 0xFE  # by quadrant
TIMER = NumberDisplay(FONT, right=105, top=152, digits=2, leading_zeros=True)
JUST_OPENED = 64  # `frame` before the chart is drawn


def symbol_boxes(m: Ram) -> Box:
    """The symbols of the sectors, row by row from the upper left one."""
    from_upper_left = m.sectors[::-1]
    symbols = jnp.stack([from_upper_left >> 4, from_upper_left & 15], axis=-1).reshape(-1)
    return SYMBOL_PICTURES.box(
        symbols,
        SECTOR_X,
        SECTOR_Y,
        valid=(symbols != EMPTY) & _is_shown(m),
        value=symbols,
        color=lookup(SYMBOL_COLORS, m.quadrant),
    )


def timer_box(m: Ram) -> Box:
    """The time left to choose a sector."""
    color = lookup(TIMER_COLORS, m.quadrant)
    return TIMER.box(m.jump_timer, valid=_is_shown(m), color=color)


def _is_shown(m: Ram) -> jax.Array:
    return (m.on_chart == 1) & (m.frame != JUST_OPENED)


def _distinct(colors: np.ndarray) -> tuple[int, ...]:
    return tuple(sorted(set(colors.tolist())))


TIMER_RULE = TIMER.rule(_distinct(TIMER_COLORS), filters=(ON_CHART,))
SYMBOL_RULE = Cells(
    _distinct(SYMBOL_COLORS),
    tuple(SECTOR_X.tolist()),
    tuple(SECTOR_Y.tolist()),
    w=SYMBOL_SIZE,
    h=SYMBOL_SIZE,
    whole=False,
)
