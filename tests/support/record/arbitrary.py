"""Arbitrary states and frames, to pin down the results of a game's decoder and rules on any input.

They come from a hash function, so they are the same with every version of NumPy.
"""

import hashlib
from dataclasses import dataclass

import numpy as np

from ocjax.console.ram import RAM_SIZE
from ocjax.extraction.game import Game

ANYTHING = 6_000  # states with arbitrary bytes
ALTERED = 12_000  # played states with other bytes
CHANGED = 24  # on average one byte among this number changes
NEAR = 2  # largest change of half of these bytes
MIXED = 6_000  # mixtures of two played states, of each kind
SHARES = (8, 2)  # one byte among this number is from the other state
# played states with one or two other bytes; fewer for games with many slots, which take longer
SWEPT = 64_000
MANY = 64  # slots
FRAMES = 2048
CHANGES = (4, 8, 16, 32)  # of a frame, in rotation
NEXT = ((-1, 0), (1, 0), (0, -1), (0, 1))
COLORS = 128  # of the console
SIZES = (
    8,
    40,
)  # largest side of a change, in rotation: like small objects, and like several that touch
FAR = 8  # shifts of pieces of frames in pixels
STRETCHED = (
    (1, 2),
    (2, 3),
    (3, 4),
    (5, 6),
    (7, 6),
    (5, 4),
    (4, 3),
    (2, 1),
)  # (rows or columns after a change, rows or columns before it)
THINNED = 64  # a change removes 0 to 63 of 64 pixels of an object


def _noise(name: str, *shape: int) -> np.ndarray:
    """Numbers below 65,536, uint16 of a shape, the same for the same name."""
    data = hashlib.shake_256(name.encode()).digest(2 * int(np.prod(shape)))
    return np.frombuffer(data, "<u2").reshape(shape)


def rams(game: Game, played: np.ndarray) -> np.ndarray:
    """Arbitrary RAM: random bytes, and played states with a few changed bytes, with bytes of
    another state, or with single bytes of any value.

    Args:
        game: the game.
        played: uint8 `[n, 128]`.

    Returns:
        uint8 `[states, 128]`.
    """
    mixtures = (_mixed(f"{game.name} mixtures {share}", played, share) for share in SHARES)
    anything = _noise(f"{game.name} anything", ANYTHING, RAM_SIZE).astype(np.uint8)
    return np.concatenate(
        [
            anything,
            _altered(game.name, played),
            *mixtures,
            swept(game.name, played, SWEPT * MANY // max(MANY, game.num_slots)),
        ]
    )


def _usual(played: np.ndarray, count: int) -> np.ndarray:
    return played[np.arange(count) % len(played)]


def _altered(name: str, played: np.ndarray) -> np.ndarray:
    """Played states with a few bytes that are a little larger or smaller, or random."""
    kind, anything = (_noise(f"{name} {what}", ALTERED, RAM_SIZE) for what in ("kinds", "bytes"))
    usual = _usual(played, ALTERED)
    near = usual + (anything % (2 * NEAR + 1) - NEAR).astype(np.uint8)
    other = np.where(kind % 2 == 0, near, anything.astype(np.uint8))
    return np.where(kind // 2 % CHANGED == 0, other, usual)


def _mixed(name: str, played: np.ndarray, share: int) -> np.ndarray:
    """Played states with a share of bytes from another state."""
    others = played[_noise(f"{name} others", MIXED) % len(played)]
    return np.where(_noise(name, MIXED, RAM_SIZE) % share == 0, others, _usual(played, MIXED))


def swept(name: str, played: np.ndarray, count: int) -> np.ndarray:
    """Played states with any value in one of the changing bytes, and in every other state in a
    second byte."""
    used = np.flatnonzero((played != played[0]).any(axis=0))
    out, state = _usual(played, count), np.arange(count)
    place, value = (
        _noise(f"{name} places", 2, count) % len(used),
        _noise(f"{name} values", 2, count).astype(np.uint8),
    )
    for number, step in enumerate((1, 2)):
        out[state[::step], used[place[number, ::step]]] = value[number, ::step]
    return out


@dataclass(frozen=True)
class _Source:
    """A played frame, and the positions of each of its colours."""

    frame: np.ndarray
    places: tuple[np.ndarray, ...]  # in the frame as a row of pixels

    @classmethod
    def of(cls, frame: np.ndarray) -> "_Source":
        order = np.argsort(frame, axis=None, kind="stable")
        return cls(frame, tuple(np.split(order, np.flatnonzero(np.diff(frame.ravel()[order])) + 1)))

    def color(self, number: int) -> int:
        """One of the colours."""
        return int(self.frame.flat[self.places[number % len(self.places)][0]])

    def pixel(self, color: int, number: int) -> tuple[int, int]:
        """Row and column of one of the pixels of one of the colours.

        Small objects are as frequent as large ones.
        """
        own = self.places[color % len(self.places)]
        return divmod(int(own[number % len(own)]), self.frame.shape[1])


def frames(game: Game, played: np.ndarray) -> np.ndarray:
    """Played frames with rectangles that are changed in eight ways.

    Every eighth frame has only one of its colours, and every eighth all others, so that each colour
    of a rule matters on some frame.

    Args:
        game: the game.
        played: uint8 `[n, H, 160]`.

    Returns:
        uint8 `[FRAMES, H, 160]`.
    """
    height, width = game.screen
    colors = np.concatenate([np.resize(np.unique(played), COLORS), np.arange(0, 2 * COLORS, 2)])
    changes = _Changes(
        played, colors, _noise(f"{game.name} holes", 2 * height, 2 * width) % THINNED
    )
    sources = [_Source.of(frame) for frame in played]
    out = played[np.arange(FRAMES) % len(played)]
    noise = _noise(f"{game.name} frames", FRAMES, max(CHANGES), 8).tolist()
    for i, (frame, numbers) in enumerate(zip(out, noise, strict=True)):
        source = sources[i % len(sources)]
        if i % 8 < 2:
            frame[(frame == source.color(numbers[0][0])) == (i % 8 == 0)] = 0
            continue
        for k, (color, number, *sizes, a, b, c, d) in enumerate(
            numbers[: CHANGES[i // 8 % len(CHANGES)]]
        ):
            most = SIZES[k % 2]
            begin = [
                max(0, at - before % most)
                for at, before in zip(source.pixel(color, number), (c, d), strict=True)
            ]
            rows, columns = (
                slice(at, min(at + 1 + n % most, end))
                for at, n, end in zip(begin, sizes, frame.shape, strict=True)
            )
            frame[rows, columns] = changes.of(frame, rows, columns, k // 2 + i // 8, (a, b, c))
    return out


@dataclass(frozen=True)
class _Changes:
    """Replacements for a rectangle of a frame."""

    played: np.ndarray
    colors: np.ndarray
    holes: np.ndarray  # numbers below `THINNED`, larger than a frame

    def of(
        self,
        frame: np.ndarray,
        rows: slice,
        columns: slice,
        kind: int,
        choices: tuple[int, int, int],
    ) -> np.ndarray:
        """The pixels that replace some rows and columns of a frame."""
        piece, color = frame[rows, columns], self.colors[choices[0] % len(self.colors)]
        background = piece[0, 0]
        down, right = (choice % (2 * FAR + 1) - FAR for choice in choices[1:])
        next_to_it = NEXT[choices[1] % len(NEXT)]

        def moved(source: np.ndarray, down: int, right: int) -> np.ndarray:
            return _around(_around(source, rows, down, 0), columns, right, 1)

        match kind % 8:
            case 0:
                return np.full_like(piece, color)
            case 1:
                return moved(self.played[choices[0] % len(self.played)], down, right)
            case 2:
                return moved(frame, down, right)
            case 3:
                return np.where(piece == background, moved(frame, *next_to_it), piece)
            case 4:
                return np.where(moved(frame, *next_to_it) == background, background, piece)
            case 5:
                return _stretched(piece, choices[1] % 2, *STRETCHED[choices[0] % len(STRETCHED)])
            case 6:
                return np.where(
                    moved(self.holes, down, right) < choices[0] % THINNED, background, piece
                )
        objects = piece[piece != background]
        return (
            np.where(piece == objects[choices[1] % len(objects)], color, piece)
            if len(objects)
            else piece
        )


def _around(source: np.ndarray, where: slice, by: int, axis: int) -> np.ndarray:
    """Some rows or columns, shifted by `by` and wrapped around."""
    start, stop, size = where.start + by, where.stop + by, source.shape[axis]
    if start >= 0 and stop <= size:
        return source[start:stop] if axis == 0 else source[:, start:stop]
    return source.take(np.arange(start, stop) % size, axis)


def _stretched(piece: np.ndarray, axis: int, n: int, of: int) -> np.ndarray:
    """A piece with `of` rows or columns stretched to `n`, cut off or filled up to its size."""
    size = piece.shape[axis]
    return piece.take(np.minimum(np.arange(size) * of // n, size - 1), axis)
