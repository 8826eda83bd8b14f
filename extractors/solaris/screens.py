"""The screen that a frame of Solaris shows, and the pixels that count on it."""

import functools
from dataclasses import dataclass
from typing import NamedTuple

import jax
import jax.numpy as jnp
from ocjax.authoring import (
    Bitmap,
    Searched,
    color_mask,
    match,
    materialize,
    shift_down,
    shift_left,
    shift_right,
    shift_up,
    spread,
)
from ocjax.extractors.solaris.pictures import ALARM_COLOR, GROUND, VIEW_BOTTOM, VIEW_TOP


class Screen:  # values of `_which_screen`
    SPACE = 0
    PLANET = 1
    CHART = 2
    JUMP = 3  # streaks
    ALARM = 4  # space in red


class Pixel(NamedTuple):
    """A pixel of the frame."""

    x: int
    y: int


BAR_LEFT = Pixel(30, 50)  # the bars at both sides of the chart have one colour
BAR_RIGHT = Pixel(130, 50)
BAR_BELOW = Pixel(30, 120)
BESIDE_BAR = Pixel(20, 50)
ON_GROUND = (Pixel(12, 140), Pixel(12, 160), Pixel(12, 120))  # lines may cover some of them
# Points in space; an object or a star covers one of them at most.
ALARM_POINTS = (Pixel(12, 30), Pixel(80, 60), Pixel(150, 90))
JUMP_STARS = (Pixel(69, 16), Pixel(125, 23), Pixel(157, 27), Pixel(21, 30))  # fixed during a jump
BESIDE_STAR = -9  # columns


def _which_screen(planes: jax.Array) -> jax.Array:
    """The screen that a frame shows: int32 `[B]`."""
    left = _bits_at(planes, BAR_LEFT)
    right = _bits_at(planes, BAR_RIGHT)
    below = _bits_at(planes, BAR_BELOW)
    bars_are_alike = jnp.all(left == right, axis=0) & jnp.all(left == below, axis=0)
    is_chart = bars_are_alike & _differ(left, _bits_at(planes, BESIDE_BAR))
    is_jump = functools.reduce(jnp.logical_and, [_is_star(planes, at) for at in JUMP_STARS])
    grounds = [_is(_bits_at(planes, at), GROUND) for at in ON_GROUND]
    is_planet = functools.reduce(jnp.logical_or, grounds)
    reds = [_is(_bits_at(planes, at), ALARM_COLOR).astype(jnp.int32) for at in ALARM_POINTS]
    is_alarm = sum(reds, jnp.int32(0)) >= len(ALARM_POINTS) - 1
    return match(
        (is_chart, Screen.CHART),
        (is_jump, Screen.JUMP),
        (is_planet, Screen.PLANET),
        (is_alarm, Screen.ALARM),
        otherwise=Screen.SPACE,
    )


def _is_star(planes: jax.Array, at: Pixel) -> jax.Array:
    beside = at._replace(x=at.x + BESIDE_STAR)
    return _differ(_bits_at(planes, at), _bits_at(planes, beside))


def _differ(one: jax.Array, other: jax.Array) -> jax.Array:
    return jnp.any(one != other, axis=0)


def _bits_at(planes: jax.Array, at: Pixel) -> jax.Array:
    """The bits of a pixel's colour: uint32 `[7, B]`, 0 or 1."""
    return planes[:, at.x // 32, at.y] >> (31 - at.x % 32) & 1


def _is(pixel: jax.Array, color: int) -> jax.Array:
    bits = [(color >> bit & 1) for bit in range(1, 8)]
    return functools.reduce(jnp.logical_and, [pixel[i] == bit for i, bit in enumerate(bits)])


def in_space(planes: jax.Array) -> jax.Array:
    """True for frames that show space: bool `[B]`."""
    screen = _which_screen(planes)
    return (screen == Screen.SPACE) | (screen == Screen.ALARM)


def on_planet(planes: jax.Array) -> jax.Array:
    """True for frames that show a planet: bool `[B]`."""
    return _which_screen(planes) == Screen.PLANET


@dataclass(frozen=True)
class _On:
    """The pixels of frames that show one screen."""

    screen: int

    def __call__(self, mask: Bitmap, screen: jax.Array) -> Bitmap:
        return jnp.where(screen == self.screen, mask, 0)


ON_CHART = Searched(_which_screen, _On(Screen.CHART))


class Look(NamedTuple):
    """The colours of one search, in space and over planets, or on all screens.

    No frame shows objects of both space and planets. Objects of the two share a search if their
    parts are joined by the same rule (`Blobs.gap`).
    """

    space: tuple[int, ...] = ()
    planet: tuple[int, ...] = ()
    all: tuple[int, ...] = ()


@dataclass(frozen=True)
class Looks:
    """A search for the pixels of several looks in the view, in one pass over the frames.

    One pass per look takes three times as long, because every pass reads all bits of all pixels.
    """

    looks: tuple[Look, ...]

    def __call__(self, planes: jax.Array) -> dict[Look, Bitmap]:
        """The pixels of each look."""
        around = ((0, 0), (VIEW_TOP, planes.shape[2] - VIEW_BOTTOM), (0, 0))
        masks = materialize(self._masks, planes, _which_screen(planes))
        return {look: jnp.pad(m, around) for look, m in zip(self.looks, masks, strict=True)}

    def _masks(self, planes: jax.Array, screen: jax.Array) -> tuple[Bitmap, ...]:
        view = planes[:, :, VIEW_TOP:VIEW_BOTTOM]
        return tuple(_looked_at(look, view, screen) for look in self.looks)

    def of(self, look: Look) -> Searched:
        """The filter that selects the pixels of one look."""
        return Searched(self, _Of(look), whole=True)

    def lone(self, look: Look, others: Look) -> Searched:
        """The filter that selects the pixels of one look that touch no pixel of another one."""
        return Searched(self, _Lone(look, others), whole=True)


def _looked_at(look: Look, view: jax.Array, screen: jax.Array) -> Bitmap:
    """The pixels of one look."""
    if look.all:
        return color_mask(view, look.all)
    by_screen = (
        (Screen.SPACE, look.space),
        (Screen.ALARM, tuple(c for c in look.space if c != ALARM_COLOR)),
        (Screen.PLANET, look.planet),
    )
    cases = [(screen == shown, color_mask(view, colors)) for shown, colors in by_screen if colors]
    return match(*cases, otherwise=0)


@dataclass(frozen=True)
class _Of:
    """Select the pixels of one look from the pixels of all looks."""

    look: Look

    def __call__(self, _: Bitmap, masks: dict[Look, Bitmap]) -> Bitmap:
        return masks[self.look]


@dataclass(frozen=True)
class _Lone:
    """Select the pixels of one look that touch no pixel of another look."""

    look: Look
    others: Look

    def __call__(self, _: Bitmap, masks: dict[Look, Bitmap]) -> Bitmap:
        other = masks[self.others]
        beside = shift_left(other, 1) | shift_right(other, 1)
        rows = shift_up(other, 1) | shift_down(other, 1)
        return masks[self.look] & ~(beside | spread(rows))
