"""Rows of RAM or frames: the interface of inputs, and tests whether arrays hold such rows."""

import itertools
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ocjax.console.ram import RAM_SIZE

# names of arrays, in search order
NAMES = (
    "rams",
    "ram",
    "screens",
    "frames",
    "observations",
    "obs",
)
FACTS = ("game", "md5")
WIDTH, LEAST_HEIGHT, MOST_HEIGHT = 160, 100, 256  # pixels of a frame
ROWS_PER_BYTE = 16  # at most; deflate stores at least an eighth of a byte per row of RAM
MOST_BLOCK = 2**30  # bytes of a chunk, or of an entry of the first dimension
MOST_LISTED = 20  # arrays listed in an error


class InputError(ValueError):
    """An input cannot be read. The message names the file, and the row if one row is wrong."""


class Input(ABC):
    """Rows of RAM or of frames.

    Attributes:
        name: for errors.
        rows: number of rows.
        batch: the dimensions of the rows: `(rows,)`, or several, such as steps and environments, in
            C order.
        row_shape: `(128,)` for RAM, `(H, 160)` for frames of palette indices, `(H, 160, 3)` for RGB
            frames.
        facts: metadata: optionally the "game" and the "md5" of its ROM.
        episodes: the number of rows of each episode, if the episodes are known.
        reads: the files and folders that the input reads. A folder includes every file in it.
        pictures: whether pictures may show palette indices as shades of grey.
    """

    name: str
    rows: int
    batch: tuple[int, ...]
    row_shape: tuple[int, ...]
    facts: Mapping[str, str]
    reads: Sequence[Path]
    episodes: Sequence[int] = ()
    pictures: bool = False

    def stem(self, i: int) -> str:
        """The name of a row's picture, without its suffix."""
        return f"{i:06}"

    @abstractmethod
    def _read(self, start: int, stop: int) -> np.ndarray:
        """Read rows as integers `[stop - start, *row_shape]`.

        Any exception means a damaged file.
        """

    def read(self, start: int, stop: int) -> np.ndarray:
        """Read a block of rows, uint8 `[stop - start, *row_shape]`.

        Raises:
            InputError: the rows cannot be read, have another shape or dtype, or hold a number
                outside 0 to 255.
        """
        try:
            block = self._read(start, stop)
        except InputError:
            raise
        except Exception as error:  # a damaged file can fail anywhere in the libraries
            raise InputError(
                f"{self.name}, rows {start} to {stop - 1}, cannot be read: "
                f"{type(error).__name__}: {error}"
            ) from error
        block, expected = _as_bytes(block, self.name, start), (stop - start, *self.row_shape)
        if block.dtype != np.uint8 or block.shape != expected:
            raise InputError(
                f"{self.name}, rows {start} to {stop - 1}, must be uint8 {list(expected)}, got "
                f"{block.dtype} {list(block.shape)}"
            )
        return block

    def close(self) -> None:  # noqa: B027 (most have nothing to close)
        """Close the file."""


def _as_bytes(rows: np.ndarray, name: str, first: int) -> np.ndarray:
    """Convert rows of integers to uint8; other arrays stay. `first` is for errors."""
    if rows.dtype == np.uint8 or rows.dtype.kind not in "iu" or not rows.size:
        return rows
    if rows.min() < 0 or rows.max() > 255:
        at = np.argwhere((rows < 0) | (rows > 255))[0]
        raise InputError(
            f"{name}, row {first + at[0]}, holds {rows[tuple(at)]}: bytes of RAM and of frames "
            "are from 0 to 255"
        )
    return rows.astype(np.uint8)


def is_row(shape: Sequence[int]) -> bool:
    """True if an array's rows of this shape are RAM or frames."""
    if tuple(shape) == (RAM_SIZE,):
        return True
    return (
        len(shape) in (2, 3)
        and LEAST_HEIGHT <= shape[0] <= MOST_HEIGHT
        and shape[1] == WIDTH
        and tuple(shape[2:]) in ((), (3,))
    )


def batch_axes(shape: Sequence[int]) -> int:
    """The number of leading axes that count rows of RAM or frames; 0 for other arrays."""
    return next((k for k in range(1, len(shape)) if is_row(shape[k:])), 0)


def choose(name: str, shapes: Mapping[str, Sequence[int]], wanted: str | None) -> list[str]:
    """Choose the array to read, or the arrays of all episodes in natural order.

    Names may be paths through groups. Arrays whose paths differ only in numbers, such as
    `episode_0/observations` and `episode_1/observations`, are episodes.

    Args:
        wanted: a path, or the end of several. By default, the first of `NAMES` whose rows are RAM
            or frames. The default skips groups whose names begin with `next_`: they repeat
            observations.
    """
    if wanted is not None and wanted in shapes:
        return [wanted]
    if wanted is not None:
        found = [key for key in shapes if key.endswith(f"/{wanted}")]
    else:
        usual = [
            key for key in shapes if batch_axes(shapes[key]) and not re.search("(^|/)next_", key)
        ]
        found = next(
            (
                keys
                for own in NAMES
                if (keys := [key for key in usual if key.rpartition("/")[2] == own])
            ),
            [],
        )
    if not found:
        looked_for = (
            f"RAM or frames named {', '.join(NAMES)}" if wanted is None else f"array {wanted!r}"
        )
        advice = "; name one of them (array)" if wanted is None else ""
        raise InputError(f"{name} has no {looked_for}: it has {_listed(shapes)}{advice}")
    depth = min(key.count("/") for key in found)
    found = [key for key in found if key.count("/") == depth]
    if len({_without_numbers(key) for key in found}) > 1:
        listed = _listed({key: shapes[key] for key in sorted(found, key=natural)})
        raise InputError(
            f"{name} has several arrays that match: {listed}; name one of them (array)"
        )
    return sorted(
        (key for key in shapes if _without_numbers(key) == _without_numbers(found[0])), key=natural
    )


def _without_numbers(key: str) -> str:
    return re.sub("[0-9]+", "0", key)


def _listed(shapes: Mapping[str, Sequence[int]]) -> str:
    shown = [f"{key} {list(shape)}" for key, shape in itertools.islice(shapes.items(), MOST_LISTED)]
    more = len(shapes) - len(shown)
    return ", ".join(shown) + f" and {more:,} more" * (more > 0) or "none"


def natural(name: str) -> tuple[list[int | str], str]:
    """A key that sorts names in natural order, "9" before "10"."""
    parts = re.split("([0-9]+)", name)
    return [int(part) if k % 2 else part for k, part in enumerate(parts)], name


def check_rows(name: str, dtype: Any, shape: Sequence[int]) -> None:
    """Check that an array holds rows of RAM or frames."""
    if np.dtype(dtype).kind not in "iu" or not batch_axes(shape):
        raise InputError(
            f"{name} must be uint8 [n, {RAM_SIZE}] (RAM), [n, H, {WIDTH}] (frames of palette "
            f"indices) or [n, H, {WIDTH}, 3] (RGB), or "
            f"wider integers from 0 to 255, got {dtype} {list(shape)}"
        )


def check_claim(name: str, rows: int, stored: int) -> None:
    """Check that a number of rows fits in the stored bytes; formats can claim rows without any."""
    if not 0 <= rows <= ROWS_PER_BYTE * stored:
        raise InputError(
            f"{name} claims {rows:,} rows, but only {stored:,} bytes are stored for them: the "
            "file is damaged or incomplete"
        )


def check_block(name: str, size: int) -> None:
    """Check the size in bytes of a part of a file that must be in memory at once."""
    if size > MOST_BLOCK:
        raise InputError(
            f"{name} is stored in parts of {size:,} bytes, and at most {MOST_BLOCK:,} fit: store "
            "it in smaller chunks"
        )


def facts_in(attributes: Mapping[str, Any]) -> dict[str, str]:
    """Read the known metadata keys, `FACTS`, from a file's attributes."""
    return {key: str(attributes[key]) for key in FACTS if key in attributes}
