"""Solaris' frames: which screen they show, and the dark edges of blue planets."""

import functools
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
from ocjax._xla.kernels import materialize
from ocjax.console.ops import match
from ocjax.extractors.solaris.pictures import BOTTOM, GROUND, GROUND_TOP, TOP
from ocjax.vision.bitmap import Bitmap, color_mask
from ocjax.vision.detected import Detected, boxes
from ocjax.vision.filters import Searched, ShortRuns
from ocjax.vision.steps import Context, Step

# The screens.
SPACE = 0
PLANET = 1
CHART = 2
JUMP = 3  # streaks
BAR_LEFT = (30, 50)  # column and row in the bar at the chart's left side
BAR_RIGHT = (130, 50)
BESIDE_BAR = (20, 50)
BELOW_BAR = (30, 120)
JUMP_STARS = ((69, 16), (125, 23), (157, 27), (21, 30))  # that stand still during a jump
WITHOUT_LINES = ShortRuns(30, across=True)  # no crater is wider than that
ON_GROUND = ((12, 140), (12, 160), (12, 120))


def _bits_at(planes: jax.Array, place: tuple[int, int]) -> jax.Array:
    """The bits of a pixel's colour: uint32 `[7, B]`, 0 or 1."""
    x, y = place
    return planes[:, x // 32, y] >> (31 - x % 32) & 1


def _is(pixel: jax.Array, color: int) -> jax.Array:
    bits = [(color >> bit & 1) for bit in range(1, 8)]
    return functools.reduce(jnp.logical_and, [pixel[i] == bit for i, bit in enumerate(bits)])


def _which_screen(planes: jax.Array) -> jax.Array:
    """Which screen a frame shows: int32 `[B]`."""
    left, right, below = (_bits_at(planes, at) for at in (BAR_LEFT, BAR_RIGHT, BELOW_BAR))
    differs = jnp.any(left != _bits_at(planes, BESIDE_BAR), axis=0)
    is_chart = jnp.all(left == right, axis=0) & jnp.all(left == below, axis=0) & differs
    grounds = [_is(_bits_at(planes, at), GROUND) for at in ON_GROUND]
    is_planet = functools.reduce(jnp.logical_or, grounds)
    stars = [
        jnp.any(_bits_at(planes, (x, y)) != _bits_at(planes, (x - 9, y)), axis=0)
        for x, y in JUMP_STARS
    ]
    is_jump = functools.reduce(jnp.logical_and, stars)
    flies = jnp.where(is_planet, PLANET, SPACE)
    return jnp.where(is_chart, CHART, jnp.where(is_jump, JUMP, flies))


@dataclass(frozen=True)
class _On:
    """The pixels of frames that show one screen."""

    screen: int

    def __call__(self, mask: Bitmap, screen: jax.Array) -> Bitmap:
        return jnp.where(screen == self.screen, mask, 0)


ON_CHART = Searched(_which_screen, _On(CHART))


def in_space(planes: jax.Array) -> jax.Array:
    """Which frames show space: bool `[B]`."""
    return _which_screen(planes) == SPACE


def on_planet(planes: jax.Array) -> jax.Array:
    """Which frames show a planet: bool `[B]`."""
    return _which_screen(planes) == PLANET


class Look(NamedTuple):
    """Colours that count in space, on planets, and on all screens."""

    space: tuple[int, ...] = ()
    planet: tuple[int, ...] = ()
    all: tuple[int, ...] = ()


@dataclass(frozen=True)
class Looks:
    """A search for the pixels of several looks in the view, in one pass over the frames.

    A pass for each takes three times as long, because every one reads all bits of all pixels.
    """

    looks: tuple[Look, ...]

    def __call__(self, planes: jax.Array) -> dict[Look, Bitmap]:
        """The pixels of each look."""
        around = ((0, 0), (TOP, planes.shape[2] - BOTTOM), (0, 0))
        masks = materialize(self._masks, planes, _which_screen(planes))
        return {look: jnp.pad(m, around) for look, m in zip(self.looks, masks, strict=True)}

    def _masks(self, planes: jax.Array, screen: jax.Array) -> tuple[Bitmap, ...]:
        view = planes[:, :, TOP:BOTTOM]
        return tuple(_looked_at(look, view, screen) for look in self.looks)

    def of(self, look: Look) -> Searched:
        """The filter that lets the pixels of one look count."""
        return Searched(self, _Of(look), whole=True)


def _looked_at(look: Look, view: jax.Array, screen: jax.Array) -> Bitmap:
    """The pixels of one look."""
    cases = [
        (shown, color_mask(view, colors))
        for shown, colors in zip((screen == SPACE, screen == PLANET), look, strict=False)
        if colors
    ]
    return match(*cases, otherwise=0) if cases else color_mask(view, look.all)


@dataclass(frozen=True)
class _Of:
    """The pixels of one look, of those of all looks."""

    look: Look

    def __call__(self, _: Bitmap, masks: dict[Look, Bitmap]) -> Bitmap:
        return masks[self.look]


def no_lines(mask: Bitmap, planes: jax.Array) -> Bitmap:
    """The pixels of craters that are not in the black lines of the ground."""
    found = mask[:, GROUND_TOP:BOTTOM]
    lines = found & ~WITHOUT_LINES(found, planes)
    black = color_mask(planes[:, :, GROUND_TOP:BOTTOM], (0,))
    around = ((0, 0), (GROUND_TOP, mask.shape[1] - BOTTOM), (0, 0))
    return jnp.pad(found & ~(lines & black), around)


# Rows above and below the bright part of a blue planet, by its width: colours that space has, too.
EDGE_ROWS = {16: (3, 6), 14: (2, 5), 12: (0, 3), 10: (0, 1)}


@dataclass(frozen=True)
class DarkEdges(Step):
    """Boxes of blue planets with their dark edges."""

    def __call__(self, found: Detected, context: Context) -> Detected:
        """The objects after the step."""
        above = sum(jnp.where(found.w == w, up, 0) for w, (up, _) in EDGE_ROWS.items())
        below = sum(jnp.where(found.w == w, down, 0) for w, (_, down) in EDGE_ROWS.items())
        first_row = jnp.maximum(found.y - above, TOP)
        end_row = jnp.minimum(found.y + found.h + below, BOTTOM)
        return found._replace(
            box=boxes(found.x, first_row, found.w, end_row - first_row, found.valid)
        )
