"""Rows in arrays: NumPy, HDF5 and Zarr files."""

import contextlib
import math
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np

from ocjax._extras import require
from ocjax.files.rows import FACTS, Input, InputError, batch_axes, check_rows, choose, facts_in


@contextlib.contextmanager
def _closed_on_error(file: Any) -> Iterator[None]:
    try:
        yield
    except BaseException:
        file.close()
        raise


class _Batch(Input):
    """Rows in an array `[*batch, *row_shape]`."""

    def _set_shape(self, dtype: Any, shape: Sequence[int]) -> None:
        check_rows(self.name, dtype, shape)
        axes = batch_axes(shape)
        self._batch, self.row_shape = tuple(map(int, shape[:axes])), tuple(map(int, shape[axes:]))
        self.rows = math.prod(self._batch)

    @property
    def batch(self) -> tuple[int, ...]:
        return self._batch


class _Array(_Batch):
    """An array that can be sliced without reading all of it."""

    def __init__(self, name: str, array: Any, facts: Mapping[str, str], close: Callable[[], object] = lambda: None) -> None:
        self.name, self._array, self.facts, self._close = name, array, facts, close
        self._set_shape(array.dtype, array.shape)

    def _read(self, start: int, stop: int) -> np.ndarray:
        inner = math.prod(self._batch[1:])  # rows of one entry of the first axis
        first = start // inner
        entries = np.asarray(self._array[first : -(-stop // inner)])
        return entries.reshape(-1, *self.row_shape)[start - first * inner : stop - first * inner]

    def close(self) -> None:
        self._close()


class _Stored(_Batch):
    """An array in NumPy's format, of which a file is read row by row.

    Args:
        name: what errors call it.
        file: open at its beginning.
        facts: see `Input`.
    """

    def __init__(self, name: str, file: IO[bytes], facts: Mapping[str, str]) -> None:
        self.name, self._file, self.facts = name, file, facts
        with _closed_on_error(file):
            shape, is_fortran, dtype = _header(file)
            self._set_shape(dtype, shape)
            if is_fortran:
                raise InputError(f"{name} is stored in Fortran order: store it in C order, row by row")
            self._dtype, self._begin, self._row_bytes = dtype, file.tell(), math.prod(self.row_shape) * dtype.itemsize

    def _read(self, start: int, stop: int) -> np.ndarray:
        self._file.seek(self._begin + start * self._row_bytes)
        size = (stop - start) * self._row_bytes
        data = self._file.read(size)
        if len(data) < size:
            raise InputError(f"{self.name} ends in row {start + len(data) // self._row_bytes} of {self.rows}")
        return np.frombuffer(data, self._dtype).reshape(stop - start, *self.row_shape)

    def close(self) -> None:
        self._file.close()


def _header(file: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype]:
    """Shape, whether it is in Fortran order, and dtype of an array in NumPy's format."""
    read = np.lib.format.read_array_header_1_0 if np.lib.format.read_magic(file) == (1, 0) else np.lib.format.read_array_header_2_0
    return read(file)


def open_npy(path: Path, wanted: str | None) -> Input:
    """An array in a file of its own."""
    return _Stored(str(path), path.open("rb"), {})


def open_npz(path: Path, wanted: str | None) -> Input:
    """An array of an archive, which is decompressed as a stream; only going back starts from its beginning."""
    with zipfile.ZipFile(path) as archive:  # open files of its members keep it open
        members = {m.filename.removesuffix(".npy"): m for m in archive.infolist()}
        shapes, facts = {}, {}
        for key, member in members.items():
            with archive.open(member) as file:
                shapes[key] = _header(file)[0]
            if key in FACTS and shapes[key] == ():
                with archive.open(member) as file:
                    facts[key] = str(np.lib.format.read_array(file, allow_pickle=False))
        key = choose(str(path), shapes, wanted)
        return _Stored(f"{path}, {key}", archive.open(members[key]), facts)


def open_hdf5(path: Path, wanted: str | None) -> Input:
    """A dataset of an HDF5 file."""
    h5py = require("h5py")
    file, shapes = h5py.File(path, "r"), {}
    with _closed_on_error(file):
        file.visititems(lambda key, item: shapes.update({key: item.shape}) if isinstance(item, h5py.Dataset) else None)
        key = choose(str(path), shapes, wanted)
        return _Array(f"{path}, {key}", file[key], facts_in(file.attrs), file.close)


def open_zarr(path: Path, wanted: str | None) -> Input:
    """A Zarr array, or an array of a group."""
    zarr = require("zarr")
    opened = zarr.open(path, mode="r")
    if isinstance(opened, zarr.Array):
        return _Array(str(path), opened, facts_in(opened.attrs))
    arrays = dict(opened.arrays())
    key = choose(str(path), {k: a.shape for k, a in arrays.items()}, wanted)
    return _Array(f"{path}, {key}", arrays[key], facts_in(opened.attrs))
