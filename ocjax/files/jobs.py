"""Work folders of resumable jobs. A file in each folder identifies its job."""

import json
import os
import reprlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ocjax.files import folders, writing
from ocjax.files.rows import InputError

MOST_BYTES = 2**24  # limit for a JSON file

Report = Callable[[int, int], object]  # called with the numbers of finished and of all units


def silent(done: int, total: int) -> None:
    """Report nothing."""


def claim(
    folder: Path, name: str, plan: str, kind: str, *, error: type[ValueError] = ValueError
) -> None:
    """Create a job's work folder, or check that it belongs to the same job.

    Args:
        name: of the file in it that identifies the job.
        plan: the contents of this file, JSON.
        kind: such as "training".
        error: type of the exception.
    """
    path = folder / name
    if folder.exists() and not folder.is_dir():
        raise error(f"{folder} is a file, and a {kind} is a folder: use another name")
    if os.path.lexists(path):
        if keys := _differences(path, plan, error):
            raise error(
                f"{folder} holds another {kind}, or one of another version or input: its {name} "
                f"differs in {', '.join(keys)}. "
                "Use another folder, or delete it"
            )
        return
    if folder.is_dir() and any(folder.iterdir()):
        raise error(f"{folder} is not empty and holds no {kind}: use another folder")
    folder.mkdir(parents=True, exist_ok=True)
    writing.write_text(path, plan, follow=False)


def check_contents(folder: Path, kind: str, *, error: type[ValueError] = ValueError) -> None:
    """Check that a folder, if it exists, contains only files and folders.

    See `folders.require_own`.
    """
    try:
        folders.require_own(folder)
    except InputError as found:
        raise error(f"a {kind} must consist of files and folders, but {found}") from found


def read(path: Path, *, error: type[ValueError] = ValueError) -> dict[str, Any]:
    """Read the JSON object in a file."""
    if not path.is_file():
        raise error(f"{path} is not a regular file")
    with path.open("rb") as file:
        data = file.read(MOST_BYTES + 1)
    try:
        if len(data) > MOST_BYTES:
            raise ValueError(f"it has more than {MOST_BYTES:,} bytes")
        found = json.loads(data.decode("utf-8"))
        if not isinstance(found, dict):
            raise ValueError(f"it must hold a JSON object, got {reprlib.repr(found)}")
    except (ValueError, RecursionError) as damage:
        raise error(f"{path} is damaged: {damage}") from damage
    return found


def _differences(path: Path, plan: str, error: type[ValueError]) -> list[str]:
    """The keys that have different values in a file's JSON object and in the plan."""
    old, new = read(path, error=error), json.loads(plan)
    return [
        key for key in {**new, **old} if key not in old or key not in new or old[key] != new[key]
    ]
