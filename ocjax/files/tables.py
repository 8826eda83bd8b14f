"""Rows in tables: Parquet and Arrow files, and folders of them."""

import functools
import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ocjax._extras import require
from ocjax.console.ram import RAM_SIZE
from ocjax.files import folders, jobs, pictures
from ocjax.files.rows import (
    FACTS,
    MOST_HEIGHT,
    NAMES,
    Input,
    InputError,
    check_claim,
    check_rows,
    is_row,
)

# every folder of `datasets.save_to_disk` has one of them
HUGGING_FACE = (
    "state.json",
    "dataset_dict.json",
)
BATCH_ROWS = 1024  # rows of a Parquet file that are decoded at a time
MOST_DIMENSIONS = 3  # dimensions of a row
SHARD = re.compile(r"(.+)-[0-9]+-of-([0-9]+)")  # the stem of a file of a hub

# the blocks of a column: rows, and a function that reads the block in parts
Blocks = list[tuple[int, Callable[[], Iterator[Any]]]]


class _Table(Input):
    """A column of Parquet or Arrow files: lists of bytes, or bytes of RAM or of pictures.

    Args:
        path: for errors.
        files: the files to read.
        blocks: the column's blocks in all files, in order. Their parts are Arrow arrays.
        schema: the first file's schema.
    """

    def __init__(
        self, path: Path, files: Sequence[Path], blocks: Blocks, schema: Any, column: str
    ) -> None:
        metadata = schema.metadata or {}
        self.facts = {
            key: metadata[key.encode()].decode() for key in FACTS if key.encode() in metadata
        }
        self.name, self._blocks, self.reads = f"{path}, {column}", blocks, files
        self._ends = np.cumsum([0, *(rows for rows, _ in blocks)])
        self.rows, self.pictures = int(self._ends[-1]), True
        self.batch = (self.rows,)
        check_claim(self.name, self.rows, sum(file.stat().st_size for file in files))
        # the next row, the parts from this row, and the rest of a part
        self._at, self._parts, self._left = 0, self._from(0), None
        self._shape: tuple[int, ...] | None = None  # shape of a row, once it is known
        first = self._read(0, 1) if self.rows else np.zeros((0, RAM_SIZE), np.uint8)
        check_rows(self.name, first.dtype, first.shape)
        if not is_row(first.shape[1:]):
            raise InputError(
                f"{self.name} must have rows of RAM or frames, got {list(first.shape[1:])}"
            )
        self.row_shape = self._shape = first.shape[1:]

    def _from(self, row: int) -> Iterator[Any]:
        """The parts of the column from a row onwards."""
        for k in range(
            max(0, int(np.searchsorted(self._ends, row, "right")) - 1), len(self._blocks)
        ):
            at, end = self._ends[k : k + 2].tolist()
            for part in self._blocks[k][1]():
                part.validate(full=True)  # before anything uses its offsets
                if at + len(part) > row:
                    yield part[max(0, row - at) :]
                at += len(part)
            if at != end:
                raise InputError(
                    f"{self.name} has {at - self._ends[k]:,} rows in a block that claims "
                    f"{self._blocks[k][0]:,}"
                )

    def _read(self, start: int, stop: int) -> np.ndarray:
        if start != self._at:
            self._at, self._parts, self._left = start, self._from(start), None
        found = []
        while self._at < stop:
            part = next(self._parts) if self._left is None else self._left
            own = part[: stop - self._at]
            self._left = part[len(own) :] if len(own) < len(part) else None
            found.append(_rows_of(own, self.name, self._at, self._shape))
            self._at += len(own)
        return found[0] if len(found) == 1 else np.concatenate(found)


def _column_of(path: Path, schema: Any, wanted: str | None) -> str:
    """The requested column, or by default the first with a usual name, in a supported form."""
    usual = (*NAMES, "image")
    found = [key for key in (usual if wanted is None else (wanted,)) if key in schema.names]
    if not found:
        raise InputError(
            f"{path} has no column named {wanted or ', '.join(usual)}: it has "
            f"{', '.join(schema.names)}"
        )
    if schema.names.count(found[0]) > 1:
        raise InputError(f"{path} has several columns named {found[0]}")
    _check_type(f"{path}, {found[0]}", schema.field(found[0]).type)
    return found[0]


def _check_type(name: str, kind: Any) -> None:
    """Check that a column holds lists of integers or bytes, each row in its own memory."""
    types, own, depth = require("pyarrow").types, kind, 0
    # pictures, as the library `datasets` stores them
    if types.is_struct(kind) and kind.get_field_index("bytes") >= 0:
        own = kind.field("bytes").type
    while types.is_list(own) or types.is_large_list(own) or types.is_fixed_size_list(own):
        own, depth = own.value_type, depth + 1
    is_bytes = types.is_binary(own) or types.is_large_binary(own) or types.is_fixed_size_binary(own)
    if not ((types.is_integer(own) and 1 <= depth <= MOST_DIMENSIONS) or (is_bytes and not depth)):
        raise InputError(f"{name} must hold lists of bytes, bytes or pictures, got {kind}")


def _rows_of(column: Any, name: str, first: int, shape: tuple[int, ...] | None) -> np.ndarray:
    """The rows of an Arrow column, integers `[n, ...]`.

    Args:
        name, first: the column's name and the number of the first row, for errors.
        shape: of each row, or None if it is not known yet.
    """
    pa = require("pyarrow")
    parts = [column]
    if pa.types.is_struct(column.type):
        parts.append(column.field("bytes"))
    for part in parts:
        if part.null_count:
            raise InputError(
                f"{name}, row {first + part.is_null().to_numpy(zero_copy_only=False).argmax()}, "
                "is null"
            )
    values = parts[-1]
    if not (
        pa.types.is_binary(values.type)
        or pa.types.is_large_binary(values.type)
        or pa.types.is_fixed_size_binary(values.type)
    ):
        return _numbers(values, name, first)
    lengths = require("pyarrow.compute").binary_length(values).to_numpy(zero_copy_only=False)
    if lengths.max(initial=0) > pictures.MOST_BYTES:
        row = int((lengths > pictures.MOST_BYTES).argmax())
        raise InputError(
            f"{name}, row {first + row}, must have at most {pictures.MOST_BYTES:,} bytes, got "
            f"{lengths[row]:,}"
        )
    every = values.to_pylist()
    if (lengths == RAM_SIZE).all() and not any(
        value.startswith(pictures.SIGNATURES[0]) for value in every
    ):
        return np.frombuffer(b"".join(every), np.uint8).reshape(-1, RAM_SIZE)
    return pictures.stacked(
        (_row(value, name, first + i) for i, value in enumerate(every)), name, first, shape
    )


def _numbers(column: Any, name: str, first: int) -> np.ndarray:
    """The rows of a column of lists of integers, which may be nested."""
    types = require("pyarrow").types
    if types.is_integer(column.type):
        return column.to_numpy(zero_copy_only=False)
    if types.is_fixed_size_list(column.type):
        lengths = np.full(1, column.type.list_size)
    else:
        lengths = (
            require("pyarrow.compute").list_value_length(column).to_numpy(zero_copy_only=False)
        )
    length = int(lengths[0]) if len(lengths) else 0
    if (lengths != length).any():
        row = int((lengths != length).argmax())
        raise InputError(
            f"{name}, row {first + row}, has the shape {[int(lengths[row])]}, others have "
            f"{[length]}"
        )
    if length > MOST_HEIGHT:
        raise InputError(f"{name}, row {first}, has {length:,} values")
    values = _numbers(column.flatten(), name, first)
    return values.reshape(len(column), length, *values.shape[1:])


def _row(value: bytes, name: str, number: int) -> np.ndarray:
    if not value.startswith(pictures.SIGNATURES) or (
        len(value) == RAM_SIZE and not value.startswith(pictures.SIGNATURES[0])
    ):
        return np.frombuffer(value, np.uint8)
    try:
        return pictures.read_picture(value)
    except Exception as error:
        raise InputError(f"{name}, row {number}, is not a readable picture: {error}") from error


def open_parquet(path: Path, wanted: str | None) -> Input:
    """Open a column of a Parquet file."""
    return _of_parquet(path, [path], wanted)


def _of_parquet(path: Path, files: Sequence[Path], wanted: str | None) -> Input:
    """Open a column of Parquet files. Its blocks are the files' row groups."""
    parquet, blocks = require("pyarrow.parquet"), []
    schema = parquet.read_schema(files[0])
    column = _column_of(path, schema, wanted)
    opened = functools.lru_cache(1)(parquet.ParquetFile)
    for file in files:
        metadata = parquet.read_metadata(file)
        for k in range(metadata.num_row_groups):
            blocks.append(
                (
                    metadata.row_group(k).num_rows,
                    functools.partial(_row_group, opened, file, k, column),
                )
            )
    return _Table(path, files, blocks, schema, column)


def _row_group(opened: Callable[[Path], Any], path: Path, k: int, column: str) -> Iterator[Any]:
    for batch in opened(path).iter_batches(BATCH_ROWS, row_groups=[k], columns=[column]):
        yield batch.column(0)


def open_parquet_folder(path: Path, wanted: str | None) -> Input:
    """Open a column of the Parquet files of a folder, or of its folder `data`."""
    files = parquet_files(path)
    shards = [SHARD.fullmatch(file.stem) for file in files]
    splits = [*dict.fromkeys(found[1] for found in shards if found)]
    if len(splits) > 1:
        raise InputError(
            f"{path} has the splits {', '.join(splits)}: give the files of one of them, or a "
            "folder with one"
        )
    counts = {int(found[2]) for found in shards if found}
    if counts and counts != {len(files)}:
        raise InputError(
            f"{path} has {len(files)} Parquet files, but the name of {files[0].name} is one of "
            f"{max(counts):,}"
        )
    return _of_parquet(path, files, wanted)


def parquet_files(path: Path) -> list[Path]:
    """The Parquet files of a folder, or else of its folder `data`; may be empty."""
    places = [path, folders.inside(path, "data")] if (path / "data").is_dir() else [path]
    return next((files for place in places if (files := folders.files(place, (".parquet",)))), [])


def open_arrow(path: Path, wanted: str | None) -> Input:
    """Open a column of an Arrow file."""
    return _of_arrow(path, [path], wanted)


def _of_arrow(path: Path, files: Sequence[Path], wanted: str | None) -> Input:
    """Open a column of Arrow files; `path` is the path in errors."""
    schema = _reader(files[0], None)[0].schema
    column = _column_of(path, schema, wanted)
    blocks = [block for file in files for block in _blocks_of_arrow(file, column)]
    return _Table(path, files, blocks, schema, column)


def _blocks_of_arrow(path: Path, column: str) -> Blocks:
    """The blocks of a column of an Arrow file: its batches. A stream is a single block."""
    reader, is_stream = _reader(path, column)
    if is_stream:
        return [
            (
                sum(batch.num_rows for batch in reader),
                lambda: (batch.column(0) for batch in _reader(path, column)[0]),
            )
        ]
    return [
        (reader.get_batch(k).num_rows, functools.partial(_batch, reader, k))
        for k in range(reader.num_record_batches)
    ]


def _batch(reader: Any, k: int) -> Iterator[Any]:
    yield reader.get_batch(k).column(0)


def _reader(path: Path, column: str | None) -> tuple[Any, bool]:
    """A reader for one or all columns of an Arrow file, and whether the file is a stream."""
    pa = require("pyarrow")
    mapped = pa.memory_map(str(path))
    opener, is_stream = pa.ipc.open_file, False
    try:
        schema = opener(mapped).schema
    except pa.ArrowInvalid:
        opener, is_stream = pa.ipc.open_stream, True
        mapped.seek(0)
        schema = opener(mapped).schema
    mapped.seek(0)
    fields = None if column is None else [schema.get_field_index(column)]
    return opener(mapped, options=pa.ipc.IpcReadOptions(included_fields=fields)), is_stream


def check_arrow(path: Path) -> None:
    """Check the structure of all data of an Arrow file."""
    reader, is_stream = _reader(path, None)
    for batch in reader if is_stream else map(reader.get_batch, range(reader.num_record_batches)):
        batch.validate(full=True)


def open_hugging_face(path: Path, wanted: str | None) -> Input:
    """Open a folder of `datasets.save_to_disk`, with one dataset or a dictionary of one."""
    if (path / "dataset_dict.json").exists():
        splits = _json(path, "dataset_dict.json")["splits"]
        if len(splits) != 1:
            raise InputError(
                f"{path} has the splits {', '.join(splits)}: give the folder of one of them, "
                f"such as {path / splits[0]}"
            )
        split = open_hugging_face(folders.inside(path, splits[0]), wanted)
        split.reads = [*split.reads, path / "dataset_dict.json"]
        return split
    files = [
        folders.inside(path, file["filename"]) for file in _json(path, "state.json")["_data_files"]
    ]
    if len(set(files)) < len(files):
        raise InputError(f"{path / 'state.json'} lists a file twice")
    opened = _of_arrow(path, files, wanted)
    opened.reads = [*files, path / "state.json"]
    return opened


def _json(folder: Path, name: str) -> Any:
    return jobs.read(folders.inside(folder, name), error=InputError)
