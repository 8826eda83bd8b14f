"""Arbitrary states with other objects than before."""

import subprocess

import numpy as np
import pytest

import ocjax
from tests.support.record import history
from tests.support.states import excerpt

# An older version that finds Pong's enemy a pixel further right in the state 1.
OLDER = """
import types
import numpy as np

class Pong:
    def rem(self, rams):
        arrays = np.load("then.npz")
        return types.SimpleNamespace(**arrays)

def load(name):
    return Pong()
"""


@pytest.fixture
def pong():
    game = ocjax.load("Pong")
    return game, game.rem(excerpt("Pong")["rams"][8:12])


@pytest.fixture
def checkout(tmp_path, pong):
    """A repository with the older version, and the folder of its data."""
    game, now = pong
    arrays = {field: np.array(getattr(now, field)) for field in history.FIELDS}
    arrays["xywh"][1, game.slices["Enemy"], 0] += arrays["valid"][1, game.slices["Enemy"]]
    np.savez(tmp_path / "then.npz", **arrays)
    (tmp_path / "ocjax.py").write_text(OLDER)
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "Pong.txt").touch()
    identity = ("-c", "user.name=A", "-c", "user.email=a@example.org")
    for command in (("init", "-q"), ("add", "."), (*identity, "commit", "-q", "-m", "Older")):
        subprocess.run(["git", *command], cwd=tmp_path, check=True)
    return tmp_path / "data"


def test_objects_of_an_older_version(checkout, pong):
    game, now = pong
    commit = history.last_commit(checkout / "Pong.txt")
    then = history.objects_then(game, "rem", excerpt("Pong")["rams"][8:12], checkout, commit)
    x, y, w, h = np.asarray(now.of("Enemy").xywh)[1, 0].tolist()
    (line,) = history.differences(game, "rem", then, now)
    assert line.startswith(f"arbitrary state 1 rem Enemy 0: expected {x + 1},{y},{w},{h}#")
    assert f", got {x},{y},{w},{h}#" in line
    assert history.objects_then(game, "vem", np.zeros(1), checkout, commit) is None


def test_files_without_history(tmp_path):
    (tmp_path / "Pong.txt").touch()
    assert history.last_commit(tmp_path / "Pong.txt") == ""
