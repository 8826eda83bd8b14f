"""Arbitrary states whose objects changed since the expected objects were written.

The expected objects of arbitrary states and frames are checksums, which show no box. The commit
that wrote them has the code that found the objects, so that code runs again on the same input.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects, whose
from tests.support.record import expected
from tests.support.record.deciding import in_batches

FIELDS = ("xywh", "valid", "orientation", "value", "rgb")
EXTRACT = f"""
import sys
import numpy as np
import ocjax
name, method, inputs, out = sys.argv[1:]
objects = getattr(ocjax.load(name), method)(np.load(inputs))
np.savez(out, **{{field: getattr(objects, field) for field in {FIELDS}}})
"""


def changed_states(game: Game, data: Path) -> list[str]:
    """For each category and method, the first arbitrary state or frame with other objects.

    Args:
        game: the game.
        data: the folder `tests/data` of a checkout.

    Returns:
        Lines such as "arbitrary state 7 rem Ball 0: expected 1,2,3,4, got 1,3,3,4"; none without
        git's history or with other slots.
    """
    commit = last_commit(expected.path(game, data))
    if not commit:
        return []
    lines: list[str] = []
    for method, inputs in expected.arbitrary_inputs(game, data).items():
        then = objects_then(game, method, inputs, data, commit)
        now = in_batches(getattr(game, method), inputs)
        if then is not None and then.valid.shape == now.valid.shape:
            lines += differences(game, method, then, now)
    return lines


def last_commit(path: Path) -> str:
    """The last commit that changed a file, or an empty text."""
    command = ["git", "log", "-1", "--format=%H", "--", path.name]
    done = subprocess.run(command, cwd=path.parent, capture_output=True, text=True, check=False)
    return done.stdout.strip()


def objects_then(
    game: Game, method: str, inputs: np.ndarray, data: Path, commit: str
) -> Objects | None:
    """The objects that the code of a commit finds, or None if it fails.

    Args:
        game: the game.
        method: "rem" or "vem".
        inputs: RAM or frames.
        data: a folder of the checkout.
        commit: the commit.
    """
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        names = [str(folder / name) for name in ("inputs.npy", "objects.npz")]
        np.save(names[0], inputs)
        _check_out(commit, data, folder)
        command = [sys.executable, "-c", EXTRACT, game.name, method, *names]
        env = os.environ | {"PYTHONPATH": temporary}
        done = subprocess.run(command, cwd=folder, env=env, capture_output=True, check=False)
        if done.returncode:
            return None
        with np.load(names[1]) as arrays:
            return Objects(**{field: arrays[field] for field in FIELDS}, game=game)


def _check_out(commit: str, data: Path, folder: Path) -> None:
    """Write all files of a commit into a folder."""
    top = subprocess.check_output(["git", "rev-parse", "--show-toplevel"], cwd=data, text=True)
    archive = subprocess.check_output(["git", "archive", commit], cwd=top.strip())
    subprocess.run(["tar", "-x", "-C", str(folder)], input=archive, check=True)


def differences(game: Game, method: str, then: Objects, now: Objects) -> Iterator[str]:
    """The slots of the first state that differs in each category."""
    for c in game.categories:
        s = game.slices[c.name]
        differs = np.zeros(len(now.valid), bool)
        for field in FIELDS:
            old, new = (np.asarray(getattr(objects, field))[:, s] for objects in (then, now))
            differs |= (old != new).reshape(len(new), -1).any(axis=1)
        if differs.any():
            i = int(differs.argmax())
            old, new = (_line(i, method, objects[i].of(c)) for objects in (then, now))
            yield from expected.differences(old, new)


def _line(number: int, method: str, state: Objects) -> str:
    """One category of a state as a section of expected objects."""
    ((category, texts),) = expected.slots_of(whose(state), state, {}).items()
    return f"{expected.ARBITRARY}\n{number} {method}: {category} {' '.join(texts)}\n"
