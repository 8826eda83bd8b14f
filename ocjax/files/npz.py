"""Arrays of `.npz` files that may be damaged or made to do harm: sizes are checked before memory is allocated, and nothing is unpickled."""

import json
import math
import os
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

DENSEST = 1100  # bytes that one byte of compressed data holds at most; deflate's limit is 1032
END_RECORD = 22  # bytes of the record at the end of a zip archive
_HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


class NpzError(ValueError):
    """A file is no intact `.npz` file; the message says what is wrong with it."""


def read(path: Path, wanted: Callable[[str], bool]) -> dict[str, np.ndarray]:
    """Read arrays from a file.

    Args:
        path: the file.
        wanted: whether an array of this name is to be read. Of the others, only the zip archive's own header is checked.

    Raises:
        FileNotFoundError: there is no such file.
        NpzError: the file is damaged.
    """
    if not path.exists():
        raise FileNotFoundError(f"no file {path}")
    try:
        with zipfile.ZipFile(path) as archive:
            _check_count(archive)
            members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            for info in members.values():
                archive.open(info).close()
            return {name: _load(archive, info) for name, info in members.items() if wanted(name)}
    except Exception as error:  # a damaged file can fail anywhere in zipfile, zlib, numpy and the parser of its headers
        raise NpzError(f"{type(error).__name__}: {error}") from error


def json_object(text: np.ndarray) -> dict[str, Any] | None:
    """The JSON object in an array that holds a text; None if it holds none."""
    try:
        found = json.loads(str(text))
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def _check_count(archive: zipfile.ZipFile) -> None:
    """Check that the directory at the end of the file was read to its last entry; zipfile does not check this."""
    assert archive.fp is not None
    archive.fp.seek(-END_RECORD - len(archive.comment), os.SEEK_END)
    count = int.from_bytes(archive.fp.read(END_RECORD)[10:12], "little")
    if count != len(archive.infolist()):
        raise ValueError(f"its directory has {len(archive.infolist())} entries instead of {count}")


def _load(archive: zipfile.ZipFile, info: zipfile.ZipInfo) -> np.ndarray:
    """One array of the file.

    The size that the header gives is compared with the size of the file before memory is allocated: one byte of compressed data holds at
    most `DENSEST` bytes.
    """
    assert archive.fp is not None
    with archive.open(info) as file:
        size = archive.fp.seek(0, os.SEEK_END)
        if not (info.compress_size <= size and info.file_size <= DENSEST * info.compress_size):
            raise ValueError(f"{info.filename} claims {info.file_size:,} bytes out of {info.compress_size:,} in a file of {size:,}")
        version = np.lib.format.read_magic(file)
        if version not in _HEADERS:
            raise ValueError(f"{info.filename} is of version {version} of numpy's format, which stores plain arrays as 1.0 or 2.0")
        shape, is_fortran, dtype = _HEADERS[version](file)
        data = file.read()  # to the end, where the checksum is compared
    if dtype.hasobject or len(data) != math.prod(shape) * dtype.itemsize:
        raise ValueError(f"{info.filename} claims {dtype} {list(shape)}, but has {len(data):,} bytes")
    return np.ndarray(shape, dtype, bytearray(data), order="F" if is_fortran else "C")
