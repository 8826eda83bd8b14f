"""Which states decide about the numbers of a decoder, and the excerpts that are made of them."""

import shutil

import numpy as np
import pytest

import ocjax
from ocjax import recordings
from ocjax.play import arbitrary, deciding, fixtures
from tests.support import synthetic
from tests.support.command import run
from tests.support.states import DATA, excerpt

NEW_GAME = {10: 60, 54: 60}  # bytes of Pong, on the first frame of a game


def test_a_rule_that_holds_in_few_states_is_decided_there():
    game, rams = ocjax.load("Pong"), excerpt("Pong")["rams"][:8].copy()
    for address, value in NEW_GAME.items():
        rams[5, address] = value
    rows = deciding.decisions(game, rams)
    only = rows[:, 5] & ~np.delete(rows, 5, axis=1).any(axis=1)
    assert only.sum() >= 4  # the two numbers of the condition, and the ball's place
    assert 0.2 < rows[:, 0].mean() < 0.8


def test_every_operation_of_decoders_is_evaluated():
    """The synthetic game's decoder uses all of them. Equal states decide equally."""
    rams = np.random.default_rng(0).integers(0, 256, (16, 128), np.uint8)
    rows = deciding.decisions(synthetic.GAME, np.concatenate([rams, rams]))
    assert np.array_equal(rows[:, :16], rows[:, 16:])
    assert rows.any(axis=1).mean() > 0.3


def test_cover_takes_what_adds_most():
    rows = np.array([[1, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]], bool)
    assert deciding.cover(rows, 4, np.ones(4, np.float32)) == [0, 1]
    assert deciding.cover(rows, 1, np.array([1, 1, 3, 1], np.float32)) == [1]


def test_arbitrary_states_are_the_same_everywhere():
    game, data = ocjax.load("Pong"), excerpt("Pong")
    rams, frames = arbitrary.rams(game, data["rams"]), arbitrary.frames(game, data["screens"])
    assert rams.shape == (arbitrary.STATES, 128)
    assert rams[4, :4].tolist() == [56, 176, 61, 120]
    usual = data["rams"][np.arange(arbitrary.STATES) // 4 % len(data["rams"])]
    equal = [(rams[kind::4] == usual[kind::4]).mean() for kind in range(4)]
    assert equal[0] < 0.1
    assert all(0.8 < share < 1 for share in equal[1:])
    assert frames.shape == (arbitrary.FRAMES, 210, 160)
    whole = data["screens"][np.arange(arbitrary.FRAMES) // 4 % len(data["screens"])]
    assert all(len(np.unique(frame)) <= 2 for frame in frames[::4])
    assert all(
        len(np.unique(frame)) < len(np.unique(before)) for frame, before in zip(frames[1::4], whole[1::4], strict=True) if frame[0, 0]
    )
    assert 0.8 < (frames[2::4] == whole[2::4]).mean() < 1


@pytest.mark.slow
def test_deciding_states_show_what_others_do_not(tmp_path, monkeypatch):
    monkeypatch.setattr(fixtures, "DECIDING_STEPS", 4800)
    data = tmp_path / "tests" / "data"
    data.mkdir(parents=True)
    shutil.copy(DATA / "Pong.npz", data)
    monkeypatch.chdir(tmp_path)
    args = ("record", "Pong", "--deciding", "--samples", 6, "--out", "Pong.npz")
    result = run(*args)
    assert result.exit_code == 0, result.output
    tape, known, game = recordings.read("Pong.npz"), recordings.read(data / "Pong.npz"), ocjax.load("Pong")
    assert 1 <= len(tape) <= 6
    rows, _ = deciding.shown(game, *(np.concatenate([known.arrays[name], tape.arrays[name]]) for name in ("rams", "screens")))
    assert rows[~rows[:, : len(known)].any(axis=1)].any(axis=0)[len(known) :].all()


def test_wrong_use(tmp_path):
    for args, message in (
        (("--deciding", "--mode", 0), "--deciding plays all modes"),
        (("--deciding", "--boundaries"), "--deciding plays all modes"),
    ):
        result = run("record", "Pong", *args, "--out", tmp_path / "Pong.npz")
        assert result.exit_code == 2
        assert message in " ".join(result.output.replace("│", " ").split())
