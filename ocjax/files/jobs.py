"""Work folders of resumable jobs. A file in each folder identifies its job."""

import json
from pathlib import Path

from ocjax.files import writing


def claim(folder: Path, name: str, plan: str, kind: str, *, error: type[ValueError] = ValueError) -> None:
    """Create a job's work folder, or check that it belongs to the same job.

    Args:
        folder: of the job.
        name: of the file in it that says which job it is.
        plan: what the file says, a JSON object.
        kind: of jobs, such as "training".
        error: what is raised.

    Raises:
        ValueError: of the type `error`; the folder is a file, is of another job, or holds other things.
    """
    path = folder / name
    if folder.exists() and not folder.is_dir():
        raise error(f"{folder} is a file, and a {kind} is a folder: use another name")
    if path.exists():
        if keys := _differences(path, plan, error):
            raise error(
                f"{folder} holds another {kind}, or one of another version or input: its {name} differs in {', '.join(keys)}. "
                "Use another folder, or delete it"
            )
        return
    if folder.is_dir() and any(folder.iterdir()):
        raise error(f"{folder} is not empty and holds no {kind}: use another folder")
    folder.mkdir(parents=True, exist_ok=True)
    writing.write_text(path, plan)


def _differences(path: Path, plan: str, error: type[ValueError]) -> list[str]:
    """The keys of a file's JSON object whose values are not those of the plan."""
    try:
        old, new = dict(json.loads(path.read_text("utf-8"))), json.loads(plan)
    except (ValueError, TypeError) as damage:
        raise error(f"{path} is damaged: {damage}") from damage
    return [key for key in {**new, **old} if key not in old or key not in new or old[key] != new[key]]
