"""Rows in tables and in pictures: Parquet and Arrow files, folders of `datasets.save_to_disk`, and folders of PNG pictures."""

import io
import json
import re
from abc import abstractmethod
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ocjax._extras import require
from ocjax.console.ram import RAM_SIZE
from ocjax.files.rows import FACTS, NAMES, Input, InputError, check_rows, is_row

PNG = b"\x89PNG"
HUGGING_FACE = ("state.json", "dataset_dict.json")  # one is in every folder that `datasets.save_to_disk` has written


class RowBlocks(Input):
    """Rows in blocks, of which one at a time is in memory.

    Args:
        name: what errors call it.
        sizes: number of rows of each block.
    """

    def __init__(self, name: str, sizes: Sequence[int]) -> None:
        self.name, self._ends = name, np.cumsum([0, *sizes])
        self.rows, self._loaded = int(self._ends[-1]), (-1, np.zeros((0, RAM_SIZE), np.uint8))
        first = self._block(0) if self.rows else self._loaded[1]
        check_rows(name, first.dtype, first.shape)
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


class _Table(RowBlocks):
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


def open_parquet(path: Path, wanted: str | None) -> Input:
    """A column of a Parquet file, in blocks of its row groups."""
    file = require("pyarrow.parquet").ParquetFile(path)
    blocks = [file.metadata.row_group(k).num_rows for k in range(file.num_row_groups)]
    return _Table(path, blocks, lambda k, column: file.read_row_group(k, columns=[column]).column(0), file.schema_arrow, wanted)


def open_arrow(path: Path, wanted: str | None) -> Input:
    """A column of an Arrow file."""
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


def open_hugging_face(path: Path, wanted: str | None) -> Input:
    """A folder that `datasets.save_to_disk` has written, of a dataset or of a dictionary with one dataset."""
    several = path / "dataset_dict.json"
    if several.exists():
        splits = json.loads(several.read_text(encoding="utf-8"))["splits"]
        if len(splits) != 1:
            raise InputError(f"{path} has the splits {', '.join(splits)}: give the folder of one of them, such as {path / splits[0]}")
        return open_hugging_face(path / splits[0], wanted)
    files = json.loads((path / "state.json").read_text(encoding="utf-8"))["_data_files"]
    return _arrow_input(path, [path / file["filename"] for file in files], wanted)


class PictureFolder(Input):
    """A folder of PNG pictures, in the natural order of their names."""

    pictures = True

    def __init__(self, path: Path, wanted: str | None) -> None:
        self.name, self.facts = str(path), {}
        files = [p for p in path.iterdir() if p.suffix.lower() == ".png"]
        self._files = sorted(files, key=lambda p: [int(t) if t.isdigit() else t for t in re.split(r"(\d+)", p.name)])
        if not self._files:
            raise InputError(f"{path} holds no PNG pictures")
        self.rows, first = len(self._files), self._picture(0)
        check_rows(str(self._files[0]), first.dtype, (1, *first.shape))
        self.row_shape = first.shape

    def stem(self, i: int) -> str:
        """The name of a picture, without its suffix."""
        return self._files[i].stem

    def _picture(self, i: int) -> np.ndarray:
        try:
            return _picture(self._files[i])
        except Exception as error:
            raise InputError(f"row {i}, {self._files[i]}, is not a readable picture: {error}") from error

    def _read(self, start: int, stop: int) -> np.ndarray:
        return _stacked([self._picture(i) for i in range(start, stop)], self.name, start)
