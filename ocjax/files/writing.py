"""Output files.

Paths are checked before the work starts, and files are written completely or not.
"""

import contextlib
import os
import shutil
import stat
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from PIL import Image
from rich.console import Console
from rich.text import Text

from ocjax._files.atomic import is_replaced, write


def check(
    *paths: Path | None, suffixes: Sequence[str] = (), reads: Iterable[str | Path | None] = ()
) -> None:
    """Check that files can be written at the paths that are not None.

    Args:
        suffixes: the allowed suffixes of their names; by default all.
        reads: the inputs; see `check_apart`.
    """
    inputs = list(reads)
    for path in paths:
        if path is None:
            continue
        if suffixes:
            check_suffix(path, suffixes)
        target = Path(os.path.realpath(path))
        if not target.parent.is_dir():
            raise NotADirectoryError(f"no folder {target.parent} for {path.name}")
        if target.is_dir():
            raise IsADirectoryError(f"{path} is a folder: give the name of a file")
        if not os.access(target.parent if is_replaced(target) else target, os.W_OK):
            raise PermissionError(f"no permission to write {path}")
        check_apart(path, inputs)


def check_apart(out: Path, reads: Iterable[str | Path | None]) -> None:
    """Check that an output replaces no input.

    Links are followed, and files are compared by device and inode.

    Args:
        reads: input files, and folders with every file in them. None and missing paths are ignored.
    """
    target = Path(os.path.realpath(out))
    places = [place.stat() if place.exists() else None for place in (target, *target.parents)]
    for source in reads:
        if source is not None and _is_in(places, Path(source)):
            raise shutil.SameFileError(
                f"the output {out} would replace the input {source}: give another output"
            )


def _is_in(places: Sequence[os.stat_result | None], read: Path) -> bool:
    """True if an input is one of the places, a path and its parent folders."""
    try:
        status = read.stat()
    except OSError:
        return False
    candidates = places if stat.S_ISDIR(status.st_mode) else places[:1]
    return any(place is not None and os.path.samestat(place, status) for place in candidates)


def check_suffix(path: Path | None, suffixes: Iterable[str]) -> None:
    """Check the suffix of a file's name, which selects its format."""
    if path is not None and path.suffix not in suffixes:
        raise ValueError(f"the output must end in {' or '.join(suffixes)}, got {path}")


def unnamed(path: Path) -> Path:
    """The path of an output that the user did not name."""
    if path.is_symlink():
        raise FileExistsError(f"{path} is a link: delete it, or name the output")
    return path


def new_folder(path: Path) -> None:
    """Create an empty folder, in place of a link or a folder of that name."""
    if path.is_symlink():
        path.unlink()
    shutil.rmtree(path, ignore_errors=True)
    path.mkdir(parents=True)


@contextlib.contextmanager
def complete_folder(path: Path) -> Iterator[Path]:
    """Yield a folder to fill, which gets the path at the end if no error occurs."""
    unfinished = path.with_name(f".{path.name}.tmp")
    new_folder(unfinished)
    try:
        yield unfinished
        unfinished.replace(path)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def write_text(path: Path, text: str, *, follow: bool = True) -> None:
    """Write a text file in UTF-8; see `write`."""
    write(path, lambda file: file.write(text.encode()), follow=follow)


def write_picture(path: Path, image: Image.Image) -> None:
    """Write a .png picture; see `write`."""
    write(path, lambda file: image.save(file, "PNG"))


def announce(console: Console, text: str, path: Path) -> None:
    """Print the path of a file in one line, without markup or line breaks."""
    console.print(Text.assemble(text, ": ", (str(path), "bold")), soft_wrap=True)
