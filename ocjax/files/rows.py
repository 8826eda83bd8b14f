"""Rows of RAM or of frames: the interface of inputs, and which arrays hold such rows."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ocjax.console.ram import RAM_SIZE

NAMES = ("rams", "ram", "screens", "frames", "observations", "obs")  # of arrays, in the order in which they are looked for
FACTS = ("game", "md5")
WIDTH, LEAST_HEIGHT, MOST_HEIGHT = 160, 100, 256  # pixels of a frame


class InputError(ValueError):
    """An input cannot be read; the message names the file and, where one row is wrong, the row."""


class Input(ABC):
    """Rows of RAM or of frames.

    Attributes:
        name: what errors call it.
        rows: number of rows.
        batch: the dimensions of the rows: `(rows,)`, or several, such as steps and environments. Rows are counted along the last one first.
        row_shape: `(128,)` for RAM, `(H, 160)` for frames of palette indices, `(H, 160, 3)` for RGB frames.
        facts: what it says about itself: perhaps the "game" and the "md5" of its ROM.
        pictures: whether it consists of pictures, which may show palette indices as shades of grey.
    """

    name: str
    rows: int
    row_shape: tuple[int, ...]
    facts: Mapping[str, str]
    pictures: bool = False

    @property
    def batch(self) -> tuple[int, ...]:
        """The dimensions of the rows."""
        return (self.rows,)

    def stem(self, i: int) -> str:
        """The name of a row's picture, without its suffix."""
        return f"{i:06}"

    @abstractmethod
    def _read(self, start: int, stop: int) -> np.ndarray:
        """Rows as integers `[stop - start, *row_shape]`. Any exception means that the file is damaged."""

    def read(self, start: int, stop: int) -> np.ndarray:
        """Read a block of rows, uint8 `[stop - start, *row_shape]`.

        Raises:
            InputError: they cannot be read, have another shape or dtype, or hold a number that is not from 0 to 255.
        """
        try:
            block = self._read(start, stop)
        except InputError:
            raise
        except Exception as error:  # a damaged file can fail anywhere in the libraries
            raise InputError(f"{self.name}, rows {start} to {stop - 1}, cannot be read: {type(error).__name__}: {error}") from error
        block, expected = _as_bytes(block, self.name, start), (stop - start, *self.row_shape)
        if block.dtype != np.uint8 or block.shape != expected:
            raise InputError(
                f"{self.name}, rows {start} to {stop - 1}, must be uint8 {list(expected)}, got {block.dtype} {list(block.shape)}"
            )
        return block

    def close(self) -> None:  # noqa: B027 (most have nothing to close)
        """Close the file."""


def _as_bytes(rows: np.ndarray, name: str, first: int) -> np.ndarray:
    """Rows of integers as uint8; `first` is the number of the first one, for errors. Other arrays are left as they are."""
    if rows.dtype == np.uint8 or rows.dtype.kind not in "iu" or not rows.size:
        return rows
    if rows.min() < 0 or rows.max() > 255:
        at = np.argwhere((rows < 0) | (rows > 255))[0]
        raise InputError(f"{name}, row {first + at[0]}, holds {rows[tuple(at)]}: bytes of RAM and of frames are from 0 to 255")
    return rows.astype(np.uint8)


def is_row(shape: Sequence[int]) -> bool:
    """Whether an array's rows of this shape are RAM or frames."""
    if tuple(shape) == (RAM_SIZE,):
        return True
    return len(shape) in (2, 3) and LEAST_HEIGHT <= shape[0] <= MOST_HEIGHT and shape[1] == WIDTH and tuple(shape[2:]) in ((), (3,))


def batch_axes(shape: Sequence[int]) -> int:
    """The number of an array's first axes that count rows of RAM or frames; 0 if there are no such rows."""
    return next((k for k in range(1, len(shape)) if is_row(shape[k:])), 0)


def choose(name: str, shapes: Mapping[str, Sequence[int]], wanted: str | None) -> str:
    """The array that is wanted, or by default the first of `NAMES` whose rows are RAM or frames."""
    there = ", ".join(f"{key} {list(shape)}" for key, shape in shapes.items()) or "none"
    if wanted is not None:
        if wanted not in shapes:
            raise InputError(f"{name} has no array {wanted!r}: it has {there}")
        return wanted
    found = [key for own in NAMES for key in shapes if key.rpartition("/")[2] == own and batch_axes(shapes[key])]
    if not found:
        raise InputError(f"{name} has no RAM or frames named {', '.join(NAMES)}: it has {there}; name one of them (array)")
    return found[0]


def check_rows(name: str, dtype: Any, shape: Sequence[int]) -> None:
    """Check that an array holds rows of RAM or frames.

    Raises:
        InputError: it does not.
    """
    if np.dtype(dtype).kind not in "iu" or not batch_axes(shape):
        raise InputError(
            f"{name} must be uint8 [n, {RAM_SIZE}] (RAM), [n, H, {WIDTH}] (frames of palette indices) or [n, H, {WIDTH}, 3] (RGB), or "
            f"wider integers from 0 to 255, got {dtype} {list(shape)}"
        )


def facts_in(attributes: Mapping[str, Any]) -> dict[str, str]:
    """What attributes of a file tell of `FACTS`."""
    return {key: str(attributes[key]) for key in FACTS if key in attributes}
