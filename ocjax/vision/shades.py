"""Colours that change: from level to level (`Shades`), and in the screen saver (`Saver`)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp

from ocjax.console.boxes import check_area
from ocjax.vision.colors import EVEN, Colors, color_set
from ocjax.vision.shapes import check_number

__all__ = ["Saver", "Shades", "level_of"]


@dataclass(frozen=True)
class Shades:
    """Colours that change together from level to level. Rules name the first level's colours.

    Args:
        pixel: (x, y) of a pixel whose colour identifies the level.
        keys: the pixel's colour at each level; any other colour means the first level.
        levels: the colours at each level, in the same order. An odd index means a colour that the
            level does not have.
    """

    pixel: tuple[int, int]
    keys: tuple[int, ...]
    levels: tuple[tuple[int, ...], ...]

    def __post_init__(self) -> None:
        if (
            not self.levels
            or len(self.keys) != len(self.levels)
            or len({len(colors) for colors in self.levels}) != 1
        ):
            raise ValueError("each level needs a key, and all levels need equally many colors")
        for colors in (self.keys, *self.levels):
            color_set(colors)


@dataclass(frozen=True)
class Saver:
    """The screen saver that a game shows after about 32,768 or 65,536 frames.

    It shows each colour as `(color ^ key) & mask`. The key changes every few seconds. REM decodes
    it from the RAM, and VEM reads it from a pixel.

    Args:
        key: function of the address map that returns the key, int32; -1 while the colours are
            unchanged.
        pixel: (x, y) of a pixel that has one colour in play, with brief exceptions.
        color: that colour, or all its colours in play, the usual one first.
        mask: bits of a colour that the saver keeps.
        taken: the colours that VEM chooses among colours that differ only in the other bits; by
            default the first that a rule names.
        beside: (x, y) of a second pixel, for games that change all colours in play, too. The saver
            is on if both pixels lack the bits that `mask` drops: in play one of the two always has
            such a bit.
    """

    key: Callable[[Any], jax.Array]
    pixel: tuple[int, int]
    color: Colors
    mask: int = 0xFF
    taken: tuple[int, ...] = ()
    beside: tuple[int, int] | None = None

    @property
    def colors_in_play(self) -> tuple[int, ...]:
        """The colours of the pixel in play."""
        return color_set(self.color)

    def __post_init__(self) -> None:
        for x, y in (self.pixel, self.beside or self.pixel):
            check_area((x, y, x + 1, y + 1))
        color_set((*self.colors_in_play, *self.taken))
        check_number("mask", self.mask, 1, 255)
        if self.beside is not None and self.mask == 0xFF:
            raise ValueError("beside is useful only if mask drops a bit")


def level_of(shades: Shades, frames: jax.Array) -> jax.Array:
    """The index of each frame's level, int32 `[B]`, from uint8 `[B, H, 160]`."""
    x, y = shades.pixel
    key = frames[:, y, x].astype(jnp.int32) & EVEN
    return sum((jnp.where(key == k, i, 0) for i, k in enumerate(shades.keys)), jnp.zeros_like(key))
