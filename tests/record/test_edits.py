"""Edited states."""

import shutil

import numpy as np
import pytest

import ocjax
from tests.support.command import run_app
from tests.support.record import __main__ as command
from tests.support.record import edits
from tests.support.states import DATA


def test_states_come_from_text():
    played = np.arange(3 * 128, dtype=np.uint8).reshape(3, 128)
    expected = played[[1, 2, 2]]
    expected[0, 5], expected[0, 127], expected[1, 0] = 7, 255, 1
    assert np.array_equal(edits.states("1 5=7 127=255\n2 0=1\n2\n", played), expected)
    assert edits.states("", played).shape == (0, 128)


@pytest.fixture
def data(tmp_path):
    """Pong's recordings, without its edited states."""
    for folder in ("", "ends", "modes"):
        (tmp_path / folder).mkdir(exist_ok=True)
        shutil.copy(DATA / folder / "Pong.npz", tmp_path / folder)
    (tmp_path / edits.FOLDER).mkdir()
    return tmp_path


def test_command(data):
    result = run_app(command.app, "Pong", "edits", "--data", data)
    assert result.exit_code == 0, result.output
    game = ocjax.load("Pong")
    text = edits.path(game, data).read_text()
    assert text == edits.path(game, DATA).read_text()
    changed = edits.states(text, edits.recorded(game, DATA))
    assert len(changed) == len(text.splitlines()) <= edits.MOST


def test_states_of_the_file_are_kept_if_they_decide(data, monkeypatch):
    monkeypatch.setattr(edits, "CANDIDATES", 1)
    game = ocjax.load("Pong")
    first, *_ = edits.path(game, DATA).read_text().splitlines()
    edits.path(game, data).write_text(f"0\n{first}\n")
    assert first in edits.describe(game, data).splitlines()
    assert "0" not in edits.describe(game, data).splitlines()
