"""States and frames that no game shows, to pin down what a game's decoder and rules do with any input.

They come from a hash function, so that they are the same with every version of NumPy.
"""

import hashlib

import numpy as np

from ocjax.console.ram import RAM_SIZE
from ocjax.extraction.game import Game

STATES = 24_000
CHANGED = 24  # of a state that resembles play, one byte in so many is another
NEAR = 2  # by which half of these are larger or smaller
MIXED = (8, 2)  # of a mixture of two states, one byte in so many is from the other
FRAMES = 1024
CHANGES = 32  # of each frame
NEXT = ((-1, 0), (1, 0), (0, -1), (0, 1))
COLORS = 128  # of the console
SIZES = (8, 40)  # largest side of what is changed, by turns: as small objects, and as several that touch
FAR = 8  # pixels by which pieces of other frames are moved


def _noise(name: str, *shape: int) -> np.ndarray:
    """Numbers below 65,536, int64 of a shape, the same for the same name."""
    data = hashlib.shake_256(name.encode()).digest(2 * int(np.prod(shape)))
    return np.frombuffer(data, "<u2").astype(np.int64).reshape(shape)


def rams(game: Game, played: np.ndarray) -> np.ndarray:
    """Arbitrary RAM, by turns with played states in which a few bytes are others, or come from another played state, or half of them do.

    Args:
        game: the game.
        played: uint8 `[n, 128]`.

    Returns:
        uint8 `[STATES, 128]`.
    """
    anything = _noise(f"{game.name} bytes", STATES, RAM_SIZE)
    kind = _noise(f"{game.name} kinds", STATES, RAM_SIZE)
    usual = played[np.arange(STATES) // 4 % len(played)].astype(np.int64)
    near = usual + anything % (2 * NEAR + 1) - NEAR
    other = np.where(kind % 2 == 0, near, anything)
    changed = np.where(kind // 2 % CHANGED == 0, other, usual)
    others = played[_noise(f"{game.name} others", STATES) % len(played)]
    mixtures = (np.where(kind % share == 0, others, usual) for share in MIXED)
    out = np.choose(np.arange(STATES)[:, None] % 4, [anything, changed, *mixtures])
    return (out & 255).astype(np.uint8)


def frames(game: Game, played: np.ndarray) -> np.ndarray:
    """Played frames with rectangles, pieces of other played frames, and objects that are larger by a row or column or have another colour.

    Every fourth frame has one of its colours alone, and every fourth all others, so that each colour of a rule is needed somewhere.

    Args:
        game: the game.
        played: uint8 `[n, H, 160]`.

    Returns:
        uint8 `[FRAMES, H, 160]`.
    """
    height, width = game.screen
    colors = np.concatenate([np.resize(np.unique(played), COLORS), np.arange(0, 2 * COLORS, 2)])
    out = played[np.arange(FRAMES) // 4 % len(played)]
    noise = _noise(f"{game.name} frames", FRAMES, CHANGES, 7).tolist()
    for i, (frame, changes) in enumerate(zip(out, noise, strict=True)):
        own = np.unique(frame)
        chosen = frame == own[changes[0][0] % len(own)]
        if i % 4 < 2:
            frame[chosen if i % 4 else ~chosen] = 0
            continue
        for k, (x, y, w, h, *choices) in enumerate(changes):
            left, top, most = x % width, y % height, SIZES[k // 4 % 2]
            rows, columns = np.arange(top, min(top + 1 + h % most, height)), np.arange(left, min(left + 1 + w % most, width))
            frame[np.ix_(rows, columns)] = _changed(frame, rows, columns, k % 4, colors, played, choices)
    return out


def _changed(
    frame: np.ndarray, rows: np.ndarray, columns: np.ndarray, kind: int, colors: np.ndarray, played: np.ndarray, choices: list[int]
) -> np.ndarray:
    """The pixels that replace some rows and columns of a frame."""
    piece, color = frame[np.ix_(rows, columns)], colors[choices[0] % len(colors)]
    background = piece[0, 0]

    def moved(source: np.ndarray, down: int, right: int) -> np.ndarray:
        return source[np.ix_((rows + down) % source.shape[0], (columns + right) % source.shape[1])]

    match kind:
        case 0:
            return np.full_like(piece, color)
        case 1:
            return moved(played[choices[0] % len(played)], *(choice % (2 * FAR + 1) - FAR for choice in choices[1:]))
        case 2:
            return np.where(piece == background, moved(frame, *NEXT[choices[1] % len(NEXT)]), piece)
    objects = piece[piece != background]
    return np.where(piece == objects[choices[1] % len(objects)], color, piece) if len(objects) else piece
