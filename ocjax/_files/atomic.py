"""Atomic writing of files."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO


def write(path: Path, to_file: Callable[[BinaryIO], object], *, follow: bool = True) -> None:
    """Write a file, completely or not at all. If writing fails, an existing file stays unchanged.

    Args:
        follow: whether the user named the path: then the target of a link, or a special file such
            as /dev/null, is written. Otherwise the file replaces links, devices and pipes.
    """
    target = Path(os.path.realpath(path)) if follow else path
    if follow and not is_replaced(target):
        with target.open("wb") as file:
            to_file(file)
        return
    unfinished = target.with_name(f".{target.name}.{os.getpid()}.tmp")
    try:
        with unfinished.open("x+b") as file:
            to_file(file)
        unfinished.replace(target)
    except OSError as error:
        if error.errno is None or error.filename is not None:
            raise
        # a full disk does not name the file
        raise OSError(error.errno, error.strerror, str(path)) from error
    finally:
        unfinished.unlink(missing_ok=True)


def is_replaced(target: Path) -> bool:
    """True if writing replaces the file at the path. Devices and pipes are written to directly."""
    return target.is_file() or not target.exists()
