"""Read arrays from `.npz` files that may be damaged or malicious.

Sizes are checked before memory is allocated, and nothing is unpickled.
"""

import contextlib
import json
import math
import os
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any, BinaryIO, NamedTuple

import numpy as np

DENSEST = 1100  # largest ratio of contents to compressed data; deflate's limit is 1032
MOST_TEXT = 2**20  # largest size of a text in bytes
PART = 2**20  # bytes decompressed at a time
END_RECORD = 22  # bytes of the record at the end of a zip archive
_HEADERS = {  # 3.0 has the layout of 2.0
    (1, 0): np.lib.format.read_array_header_1_0,
    (2, 0): np.lib.format.read_array_header_2_0,
    (3, 0): np.lib.format.read_array_header_2_0,
}


class NpzError(ValueError):
    """A file is not an intact `.npz` file. The message describes the damage."""


class Header(NamedTuple):
    """The shape, memory order and dtype of an array."""

    shape: tuple[int, ...]
    is_fortran: bool
    dtype: np.dtype

    @property
    def size(self) -> int:
        """Bytes of the data."""
        return math.prod(self.shape) * self.dtype.itemsize


def headers(path: Path, wanted: Callable[[str], bool]) -> dict[str, Header]:
    """Read the headers of the wanted arrays."""
    found = {}
    with _opened(path) as archive:
        for name, info in members(archive).items():
            if wanted(name):
                with archive.open(info) as file:
                    found[name] = _checked_header(archive, info, file)
    return found


def read(source: Path | BinaryIO, wanted: Callable[[str], bool]) -> dict[str, np.ndarray]:
    """Read the wanted arrays, and check the zip archive's own headers of the others."""
    with _opened(source) as archive:
        every = members(archive)
        for info in every.values():
            archive.open(info).close()
        return {name: _load(archive, info) for name, info in every.items() if wanted(name)}


@contextlib.contextmanager
def _opened(source: Path | BinaryIO) -> Iterator[zipfile.ZipFile]:
    if isinstance(source, Path):
        if not source.exists():
            raise FileNotFoundError(f"no file {source}")
        if not source.is_file():
            raise NpzError("it is not a regular file")
    try:
        with zipfile.ZipFile(source) as archive:
            _check_count(archive)
            yield archive
    # A damaged file can fail anywhere in zipfile, zlib, numpy and the parser of its headers.
    except Exception as error:
        raise NpzError(f"{type(error).__name__}: {error}") from error


def members(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """The files of an archive by the names of their arrays."""
    return {info.filename.removesuffix(".npy"): info for info in archive.infolist()}


def json_object(text: np.ndarray) -> dict[str, Any] | None:
    """The JSON object in a text array, or None."""
    try:
        found = json.loads(str(text))
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def _check_count(archive: zipfile.ZipFile) -> None:
    """Check that zipfile read the archive's directory to the end; zipfile does not check this."""
    assert archive.fp is not None
    archive.fp.seek(-END_RECORD - len(archive.comment), os.SEEK_END)
    count = int.from_bytes(archive.fp.read(END_RECORD)[10:12], "little")
    if count != len(archive.infolist()):
        raise ValueError(f"its directory has {len(archive.infolist())} entries instead of {count}")


def header(file: IO[bytes]) -> Header:
    """Read the header of an array in numpy's format."""
    version = np.lib.format.read_magic(file)
    if version not in _HEADERS:
        raise ValueError(f"version {version} of numpy's format is not known")
    found = Header(*_HEADERS[version](file))
    if min(found.shape, default=0) < 0:
        raise ValueError(f"negative dimension in {list(found.shape)}")
    return found


def check_member(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> None:
    """Check that the size of an array is possible."""
    assert archive.fp is not None
    size = archive.fp.seek(0, os.SEEK_END)
    if not (info.compress_size <= size and info.file_size <= DENSEST * info.compress_size):
        raise ValueError(
            f"{info.filename} claims {info.file_size:,} bytes out of {info.compress_size:,} in a "
            f"file of {size:,}"
        )


def _checked_header(archive: zipfile.ZipFile, info: zipfile.ZipInfo, file: IO[bytes]) -> Header:
    """Read the header of an array; its data must be plain, complete, and no giant text."""
    check_member(archive, info)
    found = header(file)
    stored = info.file_size - file.tell()
    if found.dtype.hasobject or found.size != stored:
        raise ValueError(
            f"{info.filename} claims {found.dtype} {list(found.shape)}, but has {stored:,} bytes"
        )
    if found.dtype.kind in "SU" and found.size > MOST_TEXT:
        raise ValueError(
            f"{info.filename} is a text of {found.size:,} bytes; at most {MOST_TEXT:,} are read"
        )
    return found


def _load(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    """Read one array of the file."""
    with archive.open(info) as file:
        claimed = _checked_header(archive, info, file)
        data, at = bytearray(claimed.size), 0
        while part := file.read(PART):  # read to the end, where zipfile compares the checksum
            data[at : at + len(part)] = part
            at += len(part)
    if at != claimed.size:
        raise ValueError(
            f"{info.filename} claims {claimed.dtype} {list(claimed.shape)}, but has {at:,} bytes"
        )
    return np.ndarray(claimed.shape, claimed.dtype, data, order="F" if claimed.is_fortran else "C")
