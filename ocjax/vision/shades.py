"""Colours that change: from level to level (`Shades`), and in the screen saver (`Saver`)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax

from ocjax.console.boxes import check_area
from ocjax.vision.colors import Colors, color_set

__all__ = ["Saver", "Shades"]


@dataclass(frozen=True)
class Shades:
    """Colours that change together from level to level. Rules name those of the first level.

    Args:
        pixel: (x, y) of a pixel whose colour tells the level.
        keys: its colour at each level; at any other colour the first level's colours count.
        levels: the colours at each level, always in the same order. An odd index stands for a
            colour that the level does not have.
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
            raise ValueError("each level needs a key and as many colors as the first one")
        for colors in (self.keys, *self.levels):
            color_set(colors)


@dataclass(frozen=True)
class Saver:
    """The screen saver that a game shows after some 32,768 or 65,536 frames: each colour is shown
    as `(color ^ key) & mask`.

    The key changes every few seconds. REM knows it from the RAM, and VEM reads it off a pixel.

    Args:
        key: function of the address map: the key, int32; -1 while the colours are those of play.
        pixel: (x, y) of a pixel that has one colour in play, but for moments.
        color: that colour, or all that it has in play, the usual one first.
        mask: bits of a colour that the saver keeps. Colours that differ in the others alone are
            shown as one.
        taken: the colours for which VEM takes what is shown as one; without an entry, that is the
            first colour that a rule names.
        changed: the colours that the saver changes; all without it.
        beside: (x, y) of a second pixel, for games that change all colours in play, too. Then
            `color` is the pixel's usual colour, and the saver is on where neither pixel has a bit
            that `mask` drops: whatever the change, one of the two has it in play.
    """

    key: Callable[[Any], jax.Array]
    pixel: tuple[int, int]
    color: Colors
    mask: int = 0xFF
    taken: tuple[int, ...] = ()
    changed: tuple[int, ...] = ()
    beside: tuple[int, int] | None = None

    @property
    def colors_in_play(self) -> tuple[int, ...]:
        """The colours of the pixel."""
        return color_set(self.color)

    def __post_init__(self) -> None:
        for x, y in (self.pixel, self.beside or self.pixel):
            check_area((x, y, x + 1, y + 1))
        color_set((*self.colors_in_play, *self.taken, *self.changed))
        if not 0 < self.mask < 256:
            raise ValueError(f"mask must be the bits of a palette index, got {self.mask}")
        if self.beside is not None and self.mask == 0xFF:
            raise ValueError("a second pixel tells something only if mask drops a bit")
