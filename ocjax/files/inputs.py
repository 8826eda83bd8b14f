"""Inputs: rows of RAM or frames in NumPy, HDF5, Zarr, Parquet, Arrow and Minari data, and in folders of PNG pictures or Arrow files.

All of them are read in blocks of rows, so that files may be larger than the memory. The libraries that read a format are imported when a
file of that format is opened (extra `data`).
"""

import contextlib
import io
import json
import math
import re
import zipfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from PIL import Image

from ocjax._extras import MissingExtraError, require
from ocjax.console.ram import RAM_SIZE

NAMES = ("rams", "ram", "screens", "frames", "observations", "obs")  # of arrays, in the order in which they are looked for
FACTS = ("game", "md5")
MINARI = "minari:"  # what the name of a Minari dataset begins with
WIDTH, LEAST_HEIGHT, MOST_HEIGHT = 160, 100, 256  # pixels of a frame
PNG = b"\x89PNG"
HUGGING_FACE = ("state.json", "dataset_dict.json")  # one is in every folder that `datasets.save_to_disk` has written


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


def _batch_axes(shape: Sequence[int]) -> int:
    """The number of an array's first axes that count rows of RAM or frames; 0 if there are no such rows."""
    return next((k for k in range(1, len(shape)) if is_row(shape[k:])), 0)


def _choose(name: str, shapes: Mapping[str, Sequence[int]], wanted: str | None) -> str:
    """The array that is wanted, or by default the first of `NAMES` whose rows are RAM or frames."""
    there = ", ".join(f"{key} {list(shape)}" for key, shape in shapes.items()) or "none"
    if wanted is not None:
        if wanted not in shapes:
            raise InputError(f"{name} has no array {wanted!r}: it has {there}")
        return wanted
    found = [key for own in NAMES for key in shapes if key.rpartition("/")[2] == own and _batch_axes(shapes[key])]
    if not found:
        raise InputError(f"{name} has no RAM or frames named {', '.join(NAMES)}: it has {there}; name one of them (array)")
    return found[0]


def minari_id(name: str) -> str:
    """The ID of a Minari dataset.

    Args:
        name: the ID after "minari:".

    Raises:
        InputError: the ID is malformed.
        MissingExtraError: minari is not installed.
    """
    identifier = name.removeprefix(MINARI)
    parse = require("minari.dataset.minari_dataset").parse_dataset_id
    try:
        parse(identifier)
    except (TypeError, ValueError) as error:  # TypeError: there is no version
        rule = "letters, digits, - and _; a namespace has at least two characters"
        raise InputError(f"a Minari ID has the form namespace/name-v0, got {identifier!r} ({rule})") from error
    return identifier


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
        _check(self.name, dtype, shape)
        axes = _batch_axes(shape)
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


def _check(name: str, dtype: Any, shape: Sequence[int]) -> None:
    if np.dtype(dtype).kind not in "iu" or not _batch_axes(shape):
        raise InputError(
            f"{name} must be uint8 [n, {RAM_SIZE}] (RAM), [n, H, {WIDTH}] (frames of palette indices) or [n, H, {WIDTH}, 3] (RGB), or "
            f"wider integers from 0 to 255, got {dtype} {list(shape)}"
        )


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


def _open_npy(path: Path, wanted: str | None) -> Input:
    return _Stored(str(path), path.open("rb"), {})


def _open_npz(path: Path, wanted: str | None) -> Input:
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
        key = _choose(str(path), shapes, wanted)
        return _Stored(f"{path}, {key}", archive.open(members[key]), facts)


def _open_hdf5(path: Path, wanted: str | None) -> Input:
    h5py = require("h5py")
    file, shapes = h5py.File(path, "r"), {}
    with _closed_on_error(file):
        file.visititems(lambda key, item: shapes.update({key: item.shape}) if isinstance(item, h5py.Dataset) else None)
        key = _choose(str(path), shapes, wanted)
        return _Array(f"{path}, {key}", file[key], _texts(file.attrs), file.close)


def _open_zarr(path: Path, wanted: str | None) -> Input:
    zarr = require("zarr")
    opened = zarr.open(path, mode="r")
    if isinstance(opened, zarr.Array):
        return _Array(str(path), opened, _texts(opened.attrs))
    arrays = dict(opened.arrays())
    key = _choose(str(path), {k: a.shape for k, a in arrays.items()}, wanted)
    return _Array(f"{path}, {key}", arrays[key], _texts(opened.attrs))


def _texts(attributes: Mapping[str, Any]) -> dict[str, str]:
    return {key: str(attributes[key]) for key in FACTS if key in attributes}


class _Blocks(Input):
    """Rows in blocks, of which one at a time is in memory.

    Args:
        name: what errors call it.
        sizes: number of rows of each block.
    """

    def __init__(self, name: str, sizes: Sequence[int]) -> None:
        self.name, self._ends = name, np.cumsum([0, *sizes])
        self.rows, self._loaded = int(self._ends[-1]), (-1, np.zeros((0, RAM_SIZE), np.uint8))
        first = self._block(0) if self.rows else self._loaded[1]
        _check(name, first.dtype, first.shape)
        if not is_row(first.shape[1:]):
            raise InputError(f"{name} must have rows of RAM or frames, got {list(first.shape[1:])}")
        self.row_shape = first.shape[1:]

    @abstractmethod
    def _load(self, k: int) -> np.ndarray:
        """The rows of a block."""

    def _block(self, k: int) -> np.ndarray:
        if self._loaded[0] != k:
            self._loaded = k, self._load(k)
        return self._loaded[1]

    def _read(self, start: int, stop: int) -> np.ndarray:
        k, parts = int(np.searchsorted(self._ends, start, "right")) - 1, []
        while start < stop:
            first, end = self._ends[k : k + 2].tolist()
            parts.append(self._block(k)[start - first : stop - first])
            start, k = min(stop, end), k + 1
        return parts[0] if len(parts) == 1 else np.concatenate(parts)


class _Table(_Blocks):
    """A column of a Parquet or Arrow file: lists of bytes, or bytes of RAM or of PNG pictures.

    Args:
        path: of the file.
        sizes: number of rows of each block.
        load: returns a block of a column, as an Arrow array or chunked array.
        schema: of the table.
        wanted: name of the column.
    """

    def __init__(self, path: Path, sizes: Sequence[int], load: Callable[[int, str], Any], schema: Any, wanted: str | None) -> None:
        metadata = schema.metadata or {}
        self.facts = {key: metadata[key.encode()].decode() for key in FACTS if key.encode() in metadata}
        columns = [key for key in ((wanted,) if wanted is not None else (*NAMES, "image")) if key in schema.names]
        if not columns:
            there, named = ", ".join(schema.names), wanted or ", ".join((*NAMES, "image"))
            raise InputError(f"{path} has no column named {named}: it has {there}")
        self._column, self._load_column = columns[0], load
        super().__init__(f"{path}, {self._column}", sizes)
        self.pictures = True

    def _load(self, k: int) -> np.ndarray:
        return _rows_of(self._load_column(k, self._column), self.name, int(self._ends[k]))


def _rows_of(column: Any, name: str, first: int) -> np.ndarray:
    """The rows of an Arrow column, uint8 `[n, ...]`; `first` is the number of the first one, for errors."""
    pa = require("pyarrow")
    column = column.combine_chunks() if isinstance(column, pa.ChunkedArray) else column
    if column.null_count:
        raise InputError(f"{name}, row {first + column.is_null().to_numpy(zero_copy_only=False).argmax()}, is null")
    if pa.types.is_struct(column.type):  # of pictures, as the library `datasets` stores them
        column = column.field("bytes")
    if pa.types.is_fixed_size_list(column.type):
        return np.asarray(column.flatten()).reshape(len(column), -1)
    values = column.to_pylist()
    if pa.types.is_list(column.type) or pa.types.is_large_list(column.type):
        return _stacked([np.array(v) for v in values], name, first)
    if values and not isinstance(values[0], bytes):
        raise InputError(f"{name} must hold lists of bytes, bytes or PNG pictures, got {column.type}")
    return _stacked([_picture(v) if v.startswith(PNG) else np.frombuffer(v, np.uint8) for v in values], name, first)


def _stacked(rows: Sequence[np.ndarray], name: str, first: int) -> np.ndarray:
    """Rows of equal shapes as one array."""
    for i, row in enumerate(rows):
        if row.shape != rows[0].shape:
            raise InputError(f"{name}, row {first + i}, has the shape {list(row.shape)}, others have {list(rows[0].shape)}")
    return np.stack(rows)


def _picture(source: bytes | Path) -> np.ndarray:
    """A picture: RGB, uint8 `[H, W, 3]`, or without colours, uint8 `[H, W]`, whose numbers are taken as palette indices."""
    with Image.open(io.BytesIO(source) if isinstance(source, bytes) else source) as image:
        if image.mode not in ("RGB", "P", "RGBA", "L"):
            raise ValueError(f"pictures must be RGB, or palette indices of 8 bits, got mode {image.mode}")
        return np.asarray(image if image.mode == "L" else image.convert("RGB"))


def _open_parquet(path: Path, wanted: str | None) -> Input:
    file = require("pyarrow.parquet").ParquetFile(path)
    blocks = [file.metadata.row_group(k).num_rows for k in range(file.num_row_groups)]
    return _Table(path, blocks, lambda k, column: file.read_row_group(k, columns=[column]).column(0), file.schema_arrow, wanted)


def _open_arrow(path: Path, wanted: str | None) -> Input:
    return _arrow_input(path, [path], wanted)


def _arrow_input(path: Path, files: Sequence[Path], wanted: str | None) -> Input:
    """The tables of Arrow files, one after the other; `path` is what errors name."""
    tables = [_arrow_table(file) for file in files]
    batches = [batch for table in tables for batch in table.to_batches()]
    return _Table(path, [b.num_rows for b in batches], lambda k, column: batches[k].column(column), tables[0].schema, wanted)


def _arrow_table(path: Path) -> Any:
    pa = require("pyarrow")
    mapped = pa.memory_map(str(path))
    try:
        return pa.ipc.open_file(mapped).read_all()
    except pa.ArrowInvalid:
        mapped.seek(0)
        return pa.ipc.open_stream(mapped).read_all()


def _open_hugging_face(path: Path, wanted: str | None) -> Input:
    """A folder that `datasets.save_to_disk` has written, of a dataset or of a dictionary with one dataset."""
    several = path / "dataset_dict.json"
    if several.exists():
        splits = json.loads(several.read_text(encoding="utf-8"))["splits"]
        if len(splits) != 1:
            raise InputError(f"{path} has the splits {', '.join(splits)}: give the folder of one of them, such as {path / splits[0]}")
        return _open_hugging_face(path / splits[0], wanted)
    files = json.loads((path / "state.json").read_text(encoding="utf-8"))["_data_files"]
    return _arrow_input(path, [path / file["filename"] for file in files], wanted)


class _Pictures(Input):
    """A folder of PNG pictures, in the natural order of their names."""

    pictures = True

    def __init__(self, path: Path, wanted: str | None) -> None:
        self.name, self.facts = str(path), {}
        files = [p for p in path.iterdir() if p.suffix.lower() == ".png"]
        self._files = sorted(files, key=lambda p: [int(t) if t.isdigit() else t for t in re.split(r"(\d+)", p.name)])
        if not self._files:
            raise InputError(f"{path} holds no PNG pictures")
        self.rows, first = len(self._files), self._picture(0)
        _check(str(self._files[0]), first.dtype, (1, *first.shape))
        self.row_shape = first.shape

    def stem(self, i: int) -> str:
        return self._files[i].stem

    def _picture(self, i: int) -> np.ndarray:
        try:
            return _picture(self._files[i])
        except Exception as error:
            raise InputError(f"row {i}, {self._files[i]}, is not a readable picture: {error}") from error

    def _read(self, start: int, stop: int) -> np.ndarray:
        return _stacked([self._picture(i) for i in range(start, stop)], self.name, start)


class _Minari(_Blocks):
    """The observations of a Minari dataset, of all episodes one after the other."""

    def __init__(self, name: str, wanted: str | None) -> None:
        identifier, self._wanted = minari_id(name), wanted
        try:
            self._dataset = require("minari").load_dataset(identifier)
        except FileNotFoundError as error:
            raise InputError(f"there is no Minari dataset {identifier} on this machine: `minari download {identifier}` gets it") from error
        spec = self._dataset.env_spec
        self.facts = _texts(self._dataset.storage.metadata.get("ocjax", {} if spec is None else {"game": spec.id}))
        episodes = self._dataset.storage.get_episode_metadata(self._dataset.episode_indices)
        super().__init__(name, [e["total_steps"] + 1 for e in episodes])

    def _load(self, k: int) -> np.ndarray:
        observations: Any = self._dataset[k].observations
        if isinstance(observations, Mapping):
            observations = observations[_choose(self.name, {key: np.shape(v) for key, v in observations.items()}, self._wanted)]
        return np.asarray(observations)


_OPENERS: Mapping[str, Callable[[Path, str | None], Input]] = {
    ".npy": _open_npy,
    ".npz": _open_npz,
    ".h5": _open_hdf5,
    ".hdf5": _open_hdf5,
    ".zarr": _open_zarr,
    ".parquet": _open_parquet,
    ".arrow": _open_arrow,
    ".feather": _open_arrow,
}


@contextlib.contextmanager
def open_input(path: str | Path, array: str | None = None) -> Iterator[Input]:
    """Open RAM or frames.

    Args:
        path: an .npy, .npz, .h5, .hdf5, .parquet, .arrow or .feather file, a .zarr folder, a folder of .png pictures or of
            `datasets.save_to_disk`, or the ID of a Minari dataset after "minari:".
        array: name of the array, dataset or column; by default the first of rams, ram, screens, frames, observations and obs that holds RAM
            or frames.

    Raises:
        FileNotFoundError: there is no such file.
        InputError: a ValueError; the format is not supported, or the file is damaged or holds neither RAM nor frames.
        MissingExtraError: a ModuleNotFoundError; the format's library is not installed.
    """
    opened = _open(str(path), array)
    try:
        yield opened
    finally:
        opened.close()


def _open(name: str, array: str | None) -> Input:
    path = Path(name)
    if not name.startswith(MINARI) and not path.exists():
        raise FileNotFoundError(f"no input {path}")
    try:
        if name.startswith(MINARI):
            return _Minari(name, array)
        if path.suffix.lower() in _OPENERS:
            return _OPENERS[path.suffix.lower()](path, array)
        if any((path / name).exists() for name in HUGGING_FACE):
            return _open_hugging_face(path, array)
        if path.is_dir():
            return _Pictures(path, array)
    except (InputError, MissingExtraError):
        raise
    except Exception as error:  # a damaged file can fail anywhere in the libraries
        raise InputError(f"{name} cannot be read: {type(error).__name__}: {error}") from error
    raise InputError(
        f"{name} is of no known format: give {', '.join(_OPENERS)}, a folder of .png pictures or of datasets.save_to_disk, or {MINARI}ID"
    )
