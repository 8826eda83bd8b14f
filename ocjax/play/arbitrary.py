"""States and frames that no game shows, to pin down what a game's decoder and rules do with any input.

They come from a hash function, so that they are the same with every version of NumPy.
"""

import hashlib

import numpy as np

from ocjax.console.ram import RAM_SIZE
from ocjax.extraction.game import Game

STATES = 1024
CHANGED = 32  # of the states that resemble play, one byte in so many is arbitrary
FRAMES = 64
RECTANGLES = 24  # on each frame
SIZES = (8, 40)  # largest side of a rectangle, by turns: as small objects, and as several that touch


def _noise(name: str, count: int) -> np.ndarray:
    """Numbers below 65,536, int64 `[count]`, the same for the same name."""
    return np.frombuffer(hashlib.shake_256(name.encode()).digest(2 * count), "<u2").astype(np.int64)


def rams(game: Game, played: np.ndarray) -> np.ndarray:
    """Arbitrary RAM and, by turns, played states with some arbitrary bytes: uint8 `[n, 128]` -> uint8 `[STATES, 128]`."""
    out = (_noise(f"{game.name} RAM", STATES * RAM_SIZE) & 255).astype(np.uint8).reshape(STATES, RAM_SIZE)
    kept = (_noise(f"{game.name} kept", STATES * RAM_SIZE) % CHANGED != 0).reshape(STATES, RAM_SIZE)
    kept[1::2] = False
    return np.where(kept, np.resize(played, out.shape), out)


def frames(game: Game, played: np.ndarray) -> np.ndarray:
    """Played frames on which rectangles of the game's colours are drawn: uint8 `[n, H, 160]` -> uint8 `[FRAMES, H, 160]`."""
    height, width = game.screen
    colors = np.array([0, *sorted({color for c in game.categories for color in c.rule.palette})], np.uint8)
    out = np.resize(played, (FRAMES, height, width))
    noise = _noise(f"{game.name} frames", FRAMES * RECTANGLES * 5).reshape(FRAMES, RECTANGLES, 5).tolist()
    for frame, rectangles in zip(out, noise, strict=True):
        for k, (x, y, w, h, color) in enumerate(rectangles):
            left, top, most = x % width, y % height, SIZES[k % 2]
            frame[top : top + 1 + h % most, left : left + 1 + w % most] = colors[color % len(colors)]
    return out
