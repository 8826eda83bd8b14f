"""The boundary states of a decoder's numbers, and excerpts of them."""

import shutil

import numpy as np
import pytest

import ocjax
from ocjax import recordings
from tests.support import synthetic
from tests.support.command import run_app
from tests.support.record import __main__ as command
from tests.support.record import arbitrary, deciding, fixtures
from tests.support.states import DATA, excerpt

PARTS = np.cumsum(
    [arbitrary.ANYTHING, arbitrary.ALTERED, arbitrary.MIXED, arbitrary.MIXED]
)  # the ends of the types of arbitrary states
SUMS = [98000948, 122015012, 59502019, 59517842, 637821455]
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
    """The synthetic game's decoder uses all operations. Equal states give equal decisions."""
    rams = np.random.default_rng(0).integers(0, 256, (16, 128), np.uint8)
    rows = deciding.decisions(synthetic.GAME, np.concatenate([rams, rams]))
    assert np.array_equal(rows[:, :16], rows[:, 16:])
    assert rows.any(axis=1).mean() > 0.3


def test_known_changes_are_skipped():
    game, rams = ocjax.load("Pong"), excerpt("Pong")["rams"][:8]
    rows = deciding.decisions(game, rams)
    known = rows[:, 0]
    others = deciding.decisions(game, rams, known)
    assert np.array_equal(others, np.where(known[:, None], False, rows))
    assert not known.all()
    assert others.any()


def test_cover_takes_what_adds_most():
    rows = np.array([[1, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 0]], bool)
    assert deciding.cover(rows, 4, np.ones(4, np.float32)) == [0, 1]
    assert deciding.cover(rows, 1, np.array([1, 1, 3, 1], np.float32)) == [1]


def test_arbitrary_states_are_the_same_everywhere():
    game, played = ocjax.load("Pong"), excerpt("Pong")["rams"]
    rams = arbitrary.rams(game, played)
    assert [int(part.astype(int).sum()) for part in np.split(rams, PARTS)] == SUMS
    counts = [
        (part != played[np.arange(len(part)) % len(played)]).sum(axis=1)
        for part in np.split(rams, PARTS)
    ]
    assert counts[0].mean() > 120
    assert all(1 < count.mean() < 40 for count in counts[1:4])
    assert set(counts[4]) == {0, 1, 2}


def test_arbitrary_frames_resemble_play():
    game, played = ocjax.load("Pong"), excerpt("Pong")["screens"]
    frames = arbitrary.frames(game, played)
    assert frames.shape == (arbitrary.FRAMES, 210, 160)
    whole = played[np.arange(arbitrary.FRAMES) % len(played)]
    colors = [
        (set(np.unique(frame)), set(np.unique(before)))
        for frame, before in zip(frames, whole, strict=True)
    ]
    assert all(len(left | {0}) == len(own | {0}) - 1 or left == own for left, own in colors[::8])
    assert all(len(left | {0}) <= 2 for left, _ in colors[1::8])
    for turn in range(2, 8):
        assert 0.7 < (frames[turn::8] == whole[turn::8]).mean() < 1


@pytest.mark.slow
def test_deciding_states_show_what_others_do_not(tmp_path, monkeypatch):
    monkeypatch.setattr(fixtures, "DECIDING_STEPS", 4800)
    monkeypatch.setattr(fixtures, "DECIDING_SAMPLES", 6)
    (tmp_path / "modes").mkdir()
    shutil.copy(DATA / "Pong.npz", tmp_path)
    result = run_app(command.app, "Pong", "modes", "--data", tmp_path)
    assert result.exit_code == 0, result.output
    tape, known, game = (
        recordings.read(tmp_path / "modes" / "Pong.npz"),
        recordings.read(tmp_path / "Pong.npz"),
        ocjax.load("Pong"),
    )
    assert 1 <= len(tape) <= 6
    rows, _ = deciding.shown(
        game,
        *(np.concatenate([known.arrays[name], tape.arrays[name]]) for name in ("rams", "screens")),
    )
    assert rows[~rows[:, : len(known)].any(axis=1)].any(axis=0)[len(known) :].all()
