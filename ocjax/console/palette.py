"""The palettes of the console: conversion of RGB to the emulator's palette index and back.

The emulator draws in palette indices (`ale.getScreen()`): hue in the high nibble, luminance in the
upper three bits of the low nibble. The lowest bit is not used, except on PAL consoles: there the
emulator sets it in frames after a frame with an odd number of lines, and shows each colour as a
grey of the same brightness, like a television.

Extraction works on indices, a quarter of RGB's memory traffic. The RGB values of NTSC consoles are
read from the screens of ale-py 0.12.1. Those of PAL consoles are from the emulator (Stella),
checked against ale-py's screens of Pac-Man and Air Raid.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

__all__ = ["NTSC", "PAL", "PaletteError", "check_rgb", "is_color", "packed", "to_index", "to_rgb"]

_NTSC_EVEN = """
    000000 4a4a4a 6f6f6f 8e8e8e aaaaaa c0c0c0 d6d6d6 ececec
    484800 69690f 86861d a2a22a bbbb35 d2d240 e8e84a fcfc54
    7c2c00 904811 a26221 b47a30 c3903d d2a44a dfb755 ecc860
    901c00 a33915 b55328 c66c3a d5824a e39759 f0aa67 fcbc74
    940000 a71a1a b83232 c84848 d65c5c e46f6f f08080 fc9090
    840064 97197a a8308f b846a2 c659b3 d46cc3 e07cd2 ec8ce0
    500084 68199a 7d30ad 9246c0 a459d0 b56ce0 c57cee d48cfc
    140090 331aa3 4e32b5 6848c6 7f5cd5 956fe3 a980f0 bc90fc
    000094 181aa7 2d32b8 4248c8 545cd6 656fe4 7580f0 8490fc
    001c88 183b9d 2d57b0 4272c2 548ad2 65a0e1 75b5ef 84c8fc
    003064 185080 2d6d98 4288b0 54a0c5 65b7d9 75cceb 84e0fc
    004030 18624e 2d8169 429e82 54b899 65d1ae 75e7c2 84fcd4
    004400 1a661a 328432 48a048 5cba5c 6fd26f 80e880 90fc90
    143c00 355f18 527e2d 6e9c42 87b754 9ed065 b4e775 c8fc84
    303800 505916 6d762b 88923e a0ab4f b7c25f ccd86e e0ec7c
    482c00 694d14 866a26 a28638 bb9f47 d2b656 e8cc63 fce070
"""

_PAL_EVEN = """
    000000 2b2b2b 525252 767676 979797 b6b6b6 d2d2d2 ececec
    000000 2b2b2b 525252 767676 979797 b6b6b6 d2d2d2 ececec
    805800 96711a ab8732 be9c48 cfaf5c dfc06f eed180 fce090
    445c00 5e791a 769332 8cac48 a0c25c b3d76f c4ea80 d4fc90
    703400 89511a a06b32 b68448 c99a5c dcaf6f ecc280 fcd490
    006414 1a8035 329852 48b06e 5cc587 6fd99e 80ebb4 90fcc8
    700014 891a35 a03252 b6486e c95c87 dc6f9e ec80b4 fc90c8
    005c5c 1a7676 328e8e 48a4a4 5cb8b8 6fcbcb 80dcdc 90ecec
    70005c 841a74 963289 a8489e b75cb0 c66fc1 d380d1 e090e0
    003c70 195a89 2f75a0 448eb6 57a5c9 68badc 79ceec 88e0fc
    580070 6e1a89 8332a0 9648b6 a75cc9 b76fdc c680ec d490fc
    002070 193f89 2f5aa0 4474b6 578bc9 68a1dc 79b5ec 88c8fc
    340080 4a1a96 5f32ab 7248be 835ccf 936fdf a280ee b090fc
    000088 1a1a9d 3232b0 4848c2 5c5cd2 6f6fe1 8080ef 9090fc
    000000 2b2b2b 525252 767676 979797 b6b6b6 d2d2d2 ececec
    000000 2b2b2b 525252 767676 979797 b6b6b6 d2d2d2 ececec
"""


def _table(even: str) -> np.ndarray:
    return np.repeat(
        np.array(
            [[int(c[i : i + 2], 16) for i in (0, 2, 4)] for c in even.split()], dtype=np.uint8
        ),
        2,
        axis=0,
    )


NTSC = _table(_NTSC_EVEN)
"""uint8 `[256, 3]`: RGB of each palette index; an odd index has the even one's colour."""
PAL = _table(_PAL_EVEN)
"""The same for ROMs made for PAL consoles; the greys of odd indices count as the even colours."""

# A multiplicative hash of 24-bit colours without collisions among the colours of a palette;
# `_hashed` proves it.
_MULTIPLIER, _SHIFT = 0xC8C42CD1, 20
_BRIGHTNESS = 0.2989, 0.5870, 0.1140  # of red, green and blue in the emulator's greys


class PaletteError(ValueError):
    """An RGB frame contains colours that the console cannot draw.

    The frame was max-pooled, resized or lossily compressed.
    """


def _hash(red, green, blue):  # noqa: ANN001, ANN202  # uint32 scalars or arrays of numpy or jax
    return (((red << 16) | (green << 8) | blue) * np.uint32(_MULTIPLIER)) >> _SHIFT


class _Hashed(NamedTuple):
    """A palette's colours by their hashes."""

    even: np.ndarray  # uint8: a colour's even palette index; 0 for hashes without a colour
    rgb: np.ndarray  # uint8 `[..., 3]`: the colour


def _hashed(palette: np.ndarray, own: tuple[int, ...] = ()) -> _Hashed:
    return _hashed_of(palette.tobytes(), own)


@functools.cache
def _hashed_of(palette: bytes, own: tuple[int, ...]) -> _Hashed:
    shown = np.frombuffer(palette, np.uint8).reshape(-1, 3).copy()
    if palette == PAL.tobytes():
        shown[1::2] = np.rint(shown[1::2] @ _BRIGHTNESS)[:, None]
    order = np.array([*own, *range(0, 256, 2), *(c + 1 for c in own), *range(1, 256, 2)])
    colors, first = np.unique(shown[order], axis=0, return_index=True)
    slots = _hash(*colors.astype(np.uint32).T)
    assert len(np.unique(slots)) == len(slots), "the hash of the palette has collisions"
    even, rgb = np.zeros(1 << (32 - _SHIFT), np.uint8), np.zeros((1 << (32 - _SHIFT), 3), np.uint8)
    even[slots], rgb[slots] = order[first] & 0xFE, colors
    return _Hashed(even, rgb)


def to_index(rgb: jax.Array, palette: np.ndarray = NTSC, own: tuple[int, ...] = ()) -> jax.Array:
    """Convert colours uint8 `[..., 3]` to palette indices uint8 `[...]`.

    All colours must be in the palette; `check_rgb` checks this.

    Args:
        rgb: the colours.
        palette: of the game.
        own: the palette indices of the game's rules, in ascending order. PAL consoles show several
            indices as the same grey. Such a grey gives the lowest of the rules' indices, or else
            the lowest of all.
    """
    r, g, b = (rgb[..., i].astype(jnp.uint32) for i in range(3))
    return jnp.asarray(_hashed(palette, own).even)[_hash(r, g, b)]


def to_rgb(index: jax.Array, palette: np.ndarray = NTSC) -> jax.Array:
    """Convert palette indices uint8 `[...]` to colours uint8 `[..., 3]`."""
    return jnp.asarray(palette)[index]


def packed(rgb: np.ndarray) -> np.ndarray:
    """Pack colours uint8 `[..., 3]` into uint32 `[...]`, red in the lowest byte."""
    r, g, b = (rgb[..., i].astype(np.uint32) for i in range(3))
    return r | (g << 8) | (b << 16)


def is_color(rgb: np.ndarray | jax.Array, palette: np.ndarray = NTSC) -> np.ndarray | jax.Array:
    """True if the console can draw the colours uint8 `[..., 3]`, bool `[...]`."""
    array = jnp if isinstance(rgb, jax.Array) else np
    r, g, b = (rgb[..., i].astype(np.uint32) for i in range(3))
    return (array.asarray(_hashed(palette).rgb)[_hash(r, g, b)] == rgb).all(-1)


def check_rgb(rgb: np.ndarray | jax.Array, palette: np.ndarray = NTSC) -> None:
    """Check that every pixel has a colour that the console can draw.

    Args:
        rgb: uint8 `[..., 3]`.
        palette: of the game (`game.palette`).

    Raises:
        TypeError: `rgb` is not uint8.
        ValueError: the last dimension is not 3.
        PaletteError: some colours are not in the palette; the message gives their number of pixels
            and examples.
    """
    host = np.asarray(rgb)
    if host.dtype != np.uint8:
        raise TypeError(f"RGB frames must be uint8, got {host.dtype}")
    if host.ndim == 0 or host.shape[-1] != 3:
        raise ValueError(f"RGB frames must have shape [..., 3], got {host.shape}")
    wrong = ~is_color(host, palette)
    if wrong.any():
        examples = np.unique(host[wrong], axis=0)[:3].tolist()
        raise PaletteError(
            f"{int(wrong.sum())} of {wrong.size} pixels have colours that are not in the "
            f"console's palette, such as {examples}: "
            "give the emulator's own screen, not one that was max-pooled, resized or compressed"
        )
