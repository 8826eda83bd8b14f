"""Rows in arrays: NumPy, HDF5 and Zarr files."""

import contextlib
import math
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np

from ocjax._extras import require
from ocjax._files import npz
from ocjax.console.ram import RAM_SIZE
from ocjax.files import folders
from ocjax.files.rows import (
    FACTS,
    Input,
    InputError,
    batch_axes,
    check_block,
    check_claim,
    check_rows,
    choose,
    facts_in,
)


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
        self.batch, self.row_shape = tuple(map(int, shape[:axes])), tuple(map(int, shape[axes:]))
        self.rows = math.prod(self.batch)
        check_block(f"{self.name} {list(shape)}", math.prod(shape[1:]) * np.dtype(dtype).itemsize)


class Array(_Batch):
    """An array that can be sliced without reading all of it.

    Args:
        name: for errors.
        array: has `dtype` and `shape`.
        stored: the number of bytes in the file that hold the array.
    """

    def __init__(self, name: str, array: Any, stored: int) -> None:
        self.name, self._array = name, array
        self._set_shape(array.dtype, array.shape)
        check_claim(name, self.rows, stored)

    def _read(self, start: int, stop: int) -> np.ndarray:
        inner = math.prod(self.batch[1:])  # rows of one entry of the first axis
        first = start // inner
        entries = np.asarray(self._array[first : -(-stop // inner)])
        return entries.reshape(-1, *self.row_shape)[start - first * inner : stop - first * inner]


class _Stored(_Batch):
    """An array in NumPy's format that is read row by row from an open file of `size` bytes."""

    def __init__(self, name: str, file: IO[bytes], size: int) -> None:
        self.name, self._file = name, file
        with _closed_on_error(file):
            shape, is_fortran, self._dtype = npz.header(file)
            self._set_shape(self._dtype, shape)
            if is_fortran:
                raise InputError(
                    f"{name} is stored in Fortran order: store it in C order, row by row"
                )
            self._begin = file.tell()
            self._row_bytes = math.prod(self.row_shape) * self._dtype.itemsize
            if self._begin + self.rows * self._row_bytes > size:
                raise self._ended((size - self._begin) // self._row_bytes)

    def _ended(self, row: int) -> InputError:
        return InputError(f"{self.name} ends in row {row:,} of {self.rows:,}")

    def _read(self, start: int, stop: int) -> np.ndarray:
        self._file.seek(self._begin + start * self._row_bytes)
        size = (stop - start) * self._row_bytes
        data = self._file.read(size)
        if len(data) < size:
            raise self._ended(start + len(data) // self._row_bytes)
        return np.frombuffer(data, self._dtype).reshape(stop - start, *self.row_shape)

    def close(self) -> None:
        self._file.close()


class Episodes(_Batch):
    """The arrays of one or more episodes, joined along the first axis.

    Args:
        keys: names of the arrays.
        shapes: the shapes of all arrays of the file.
        facts: see `Input`.
    """

    def __init__(
        self,
        path: Path,
        keys: Sequence[str],
        shapes: Mapping[str, Sequence[int]],
        opened: Callable[[str], _Batch],
        facts: Mapping[str, str],
        close: Callable[[], object] = lambda: None,
    ) -> None:
        self.name = f"{path}, {keys[0]}" + f" and {len(keys) - 1:,} more" * (len(keys) > 1)
        self.facts, self.reads, self._opened, self._close = facts, [path], opened, close
        self._keys, self._part = keys, (0, opened(keys[0]))
        first = self._part[1]
        self.row_shape, self._inner = first.row_shape, first.batch[1:]
        for key in keys:
            if tuple(shapes[key][1:]) != (*self._inner, *self.row_shape):
                raise InputError(
                    f"{path}, {key}, has the shape {list(shapes[key])}, but {keys[0]} has "
                    f"{list(shapes[keys[0]])}"
                )
        lengths = [int(shapes[key][0]) for key in keys]
        self.batch = (sum(lengths), *self._inner)
        self.rows = math.prod(self.batch)
        self._ends = np.cumsum([0, *lengths]) * math.prod(self._inner)
        self.episodes = np.diff(self._ends).tolist() if len(keys) > 1 else ()

    def _read(self, start: int, stop: int) -> np.ndarray:
        k, parts = int(np.searchsorted(self._ends, start, "right")) - 1, []
        while start < stop:
            first, end = self._ends[k : k + 2].tolist()
            if k != self._part[0]:
                self._part[1].close()
                self._part = k, self._opened(self._keys[k])
            parts.append(self._part[1].read(start - first, min(stop, end) - first))
            start, k = min(stop, end), k + 1
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def close(self) -> None:
        """Close the file."""
        self._part[1].close()
        self._close()


def open_npy(path: Path, wanted: str | None) -> Input:
    """Open the array of a `.npy` file."""
    opened = _Stored(str(path), path.open("rb"), path.stat().st_size)
    opened.facts, opened.reads = {}, [path]
    return opened


def open_npz(path: Path, wanted: str | None) -> Input:
    """Open the arrays of an archive, decompressed as a stream. Going back restarts the stream."""
    archive = zipfile.ZipFile(path)
    with _closed_on_error(archive):
        members = npz.members(archive)
        shapes = {key: _shape_in(archive, member) for key, member in members.items()}
        keys = choose(str(path), shapes, wanted)
        single = [key for key in FACTS if shapes.get(key) == ()]
        facts = {key: str(value) for key, value in npz.read(path, single.__contains__).items()}

        def opened(key: str) -> _Batch:
            npz.check_member(archive, members[key])
            found = _Stored(f"{path}, {key}", archive.open(members[key]), members[key].file_size)
            check_claim(found.name, found.rows, members[key].compress_size)
            return found

        return Episodes(path, keys, shapes, opened, facts, archive.close)


def _shape_in(archive: zipfile.ZipFile, member: zipfile.ZipInfo) -> tuple[int, ...]:
    with archive.open(member) as file:
        return npz.header(file).shape


def open_hdf5(path: Path, wanted: str | None, group: str = "") -> Input:
    """Open the datasets of an HDF5 file, or only datasets in groups of one name at any depth."""
    file = require("h5py").File(path, "r")
    with _closed_on_error(file):
        shapes = {
            key: item.shape
            for key, item in _datasets(file, path)
            if not group or group in key.split("/")
        }
        keys = choose(str(path), shapes, wanted)
        return Episodes(
            path,
            keys,
            shapes,
            lambda key: _of_hdf5(f"{path}, {key}", file[key]),
            facts_in(file.attrs),
            file.close,
        )


def check_hdf5(path: Path) -> None:
    """Check that an HDF5 file contains all its data."""
    with require("h5py").File(path, "r") as file:
        for key, dataset in _datasets(file, path):
            check_own(f"{path}, {key}", dataset)
            check_claim(f"{path}, {key}", dataset.nbytes // RAM_SIZE, dataset.id.get_storage_size())


def _datasets(file: Any, path: Path) -> list[tuple[str, Any]]:
    h5py = require("h5py")
    links: list[tuple[str, Any]] = []
    # the visiting function must not raise
    file.visititems_links(lambda key, link: links.append((key, link)))
    outside = [key for key, link in links if isinstance(link, h5py.ExternalLink)]
    if outside:
        raise InputError(
            f"{path}, {outside[0]}, is a link to another file: copy the data into one file"
        )
    items = [(key, file[key]) for key, link in links if isinstance(link, h5py.HardLink)]
    return [
        (key, item)
        for key, item in items
        if isinstance(item, h5py.Dataset) and item.shape is not None
    ]


def _of_hdf5(name: str, dataset: Any) -> _Batch:
    check_own(name, dataset)
    return Array(name, dataset, dataset.id.get_storage_size())


def check_own(name: str, dataset: Any) -> None:
    """Check that an HDF5 dataset stores its data in its own file."""
    if dataset.is_virtual or dataset.external:
        kind = "a virtual dataset" if dataset.is_virtual else "stored externally"
        raise InputError(
            f"{name} is {kind}, so its data are in other files: copy them into one file"
        )
    properties = dataset.id.get_create_plist()
    filters = [properties.get_filter(k)[0] for k in range(properties.get_nfilters())]
    if len(set(filters)) < len(filters):
        raise InputError(
            f"{name} is compressed several times with one filter: store it with each filter once"
        )
    check_block(name, math.prod(dataset.chunks or ()) * dataset.dtype.itemsize)


def open_zarr(path: Path, wanted: str | None) -> Input:
    """Open a Zarr array, or arrays of a group and its subgroups."""
    zarr = require("zarr")
    contents = folders.contents(path)
    opened = zarr.open(path, mode="r")
    if isinstance(opened, zarr.Array):
        arrays, keys = {path.name: opened}, [path.name]
    else:
        arrays = {
            key: item
            for key, item in opened.members(max_depth=None)
            if isinstance(item, zarr.Array)
        }
        keys = choose(str(path), {key: array.shape for key, array in arrays.items()}, wanted)

    def part(key: str) -> _Batch:
        for chunks in (arrays[key].chunks, arrays[key].shards or ()):
            check_block(f"{path}, {key}", math.prod(chunks) * arrays[key].dtype.itemsize)
        return Array(f"{path}, {key}", arrays[key], sum(contents.values()))

    found = Episodes(
        path, keys, {key: arrays[key].shape for key in keys}, part, facts_in(opened.attrs)
    )
    found.reads = [path, *contents]
    return found
