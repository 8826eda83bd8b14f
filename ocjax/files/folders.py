"""Safe access to folders from others: readers use only regular files in the folder itself.

They follow no links, because a link could bring in a file from outside the folder. They read no
pipes, because a pipe could block for ever.
"""

import os
import stat
from collections.abc import Collection, Iterator
from pathlib import Path

from ocjax.files.rows import InputError, natural


def files(folder: Path, suffixes: Collection[str]) -> list[Path]:
    """The files of a folder with one of the suffixes, in natural order, without hidden files."""
    with os.scandir(folder) as entries:
        chosen = [entry for entry in entries if _is_chosen(entry.name, suffixes)]
    for entry in chosen:
        if not entry.is_file(follow_symlinks=False):  # without a system call on most systems
            _check_regular(folder / entry.name)
    return [folder / name for name in sorted((entry.name for entry in chosen), key=natural)]


def holds(folder: Path, suffixes: Collection[str]) -> bool:
    """True if a folder has an entry that `files` would return or reject."""
    with os.scandir(folder) as entries:
        return any(_is_chosen(entry.name, suffixes) for entry in entries)


def _is_chosen(name: str, suffixes: Collection[str]) -> bool:
    return not name.startswith(".") and name.lower().endswith(tuple(suffixes))


def inside(folder: Path, name: object) -> Path:
    """The path of a file or folder to which another file of the folder refers."""
    if not isinstance(name, str) or name in ("", ".", "..") or Path(name).name != name:
        raise InputError(
            f"{folder} refers to {name!r}: it may only refer to files and folders that it holds"
        )
    path = folder / name
    if not path.is_dir() or path.is_symlink():
        _check_regular(path)
    return path


def contents(folder: Path) -> dict[Path, int]:
    """All files in a folder and its subfolders, with their sizes in bytes."""
    return {path: _check_regular(path) for path in _walk(folder)}


def require_own(folder: Path) -> None:
    """Check that a folder, if it exists, is no link and contains only files and folders.

    With links, the creator of the folder could choose which of the user's files are read and
    overwritten.
    """
    if folder.is_symlink():
        _check_regular(folder)
    contents(folder)


def _walk(folder: Path) -> Iterator[Path]:
    """All files and links in a folder and its subfolders."""
    for parent, folders, names in os.walk(folder):
        yield from (Path(parent, name) for name in names)
        yield from (Path(parent, name) for name in folders if Path(parent, name).is_symlink())


def _check_regular(path: Path) -> int:
    """Check that a path leads to a regular file, and return its size."""
    status = path.lstat()
    if not stat.S_ISREG(status.st_mode):
        kinds = {stat.S_IFLNK: "a link", stat.S_IFDIR: "a folder"}
        kind = kinds.get(stat.S_IFMT(status.st_mode), "a special file")
        raise InputError(
            f"{path} is {kind}, and must be a regular file: copy the file into the folder, or "
            "remove the entry"
        )
    return status.st_size
