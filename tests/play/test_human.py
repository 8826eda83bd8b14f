"""Games that a person plays."""

import sys
from types import SimpleNamespace

import ale_py
import numpy as np
import pytest
from PIL import Image

import ocjax
from ocjax import recordings
from ocjax.play import human, window
from tests.support.command import run

A = ale_py.Action


@pytest.mark.parametrize(
    ("held", "action"),
    [
        ("", A.NOOP),
        ("w", A.UP),
        ("a ", A.LEFTFIRE),
        ("dw", A.UPRIGHT),
        (" as", A.DOWNLEFTFIRE),
        ("ws", A.NOOP),
    ],
)
def test_held_keys_make_an_action(held, action):
    assert human.held_action(set(held)) == action


def test_keys():
    playing = human.HumanGame(ocjax.load("Pong"))
    playing.key("Up", pressed=True)
    playing.key("space", pressed=True)
    assert playing.held == {"w", " "}
    playing.key("Up", pressed=False)
    playing.key("Up", pressed=True)  # as a repeating key reports itself
    playing.key("space", pressed=False)
    playing.step()
    assert playing.held == {"w"}
    playing.key("p", pressed=True)
    frame = playing.ale.getEpisodeFrameNumber()
    playing.step()
    assert playing.ale.getEpisodeFrameNumber() == frame
    assert "paused" in playing.text()
    playing.key("Escape", pressed=True)
    assert playing.done


def test_recording_is_what_was_played():
    playing = human.HumanGame(ocjax.load("Pong"), seed=3)
    for _ in range(100):
        playing.step()
    tape = playing.recording()
    assert len(tape) == 51  # the first state, and every fourth of 200 frames
    assert tape.resets.sum() == 1
    assert tape.resets[0]
    assert not tape.ends.any()
    np.testing.assert_array_equal(tape.rams[-1], playing.ale.getRAM())
    np.testing.assert_array_equal(tape.screens[-1], playing.ale.getScreen())
    assert (tape.screens[-1] != tape.previous[-1]).any()


def test_next_game_begins_after_the_end():
    playing = human.HumanGame(ocjax.load("Skiing"))
    while playing.recording().resets.sum() < 2:
        for _ in range(500):
            playing.step()
    tape = playing.recording()
    second = int(np.flatnonzero(tape.resets)[1])
    assert tape.ends[second - 1]
    assert tape.ends.sum() == 1
    assert tape.rewards[second] == 0
    assert tape.rewards[second - 1] < 0


def test_boxes_can_be_hidden():
    playing = human.HumanGame(ocjax.load("Pong"))
    for _ in range(60):
        playing.step()
    shown = np.asarray(playing.picture())
    playing.key("b", pressed=True)
    game = playing.game
    plain = np.asarray(
        Image.fromarray(game.palette[playing.screen]).resize(
            shown.shape[1::-1], Image.Resampling.NEAREST
        )
    )
    np.testing.assert_array_equal(np.asarray(playing.picture()), plain)
    assert (shown != plain).any()


def test_command(tmp_path, monkeypatch):
    def show(title, step, on_key):
        assert title == "ocjax: Pong"
        for _ in range(40):
            image, text = step()
        assert image.size == (960, 630)
        assert "reward 0" in text
        on_key("Escape", True)
        assert step() is None

    monkeypatch.setattr(window, "show", show)
    out, gif = tmp_path / "a.npz", tmp_path / "a.gif"
    result = run("play", "Pong", "--human", "--out", out, "--gif", gif)
    assert result.exit_code == 0, result.output
    assert len(recordings.read(out)) >= 20
    with Image.open(gif) as animation:
        assert animation.n_frames >= 2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--human", "--episodes", 3), "do not apply with --human"),
        (("--out", "x.npz"), "--out needs --human"),
        (("--human", "--out", "x.png"), ".npz"),
    ],
)
def test_wrong_use(tmp_path, monkeypatch, options, message):
    monkeypatch.chdir(tmp_path)
    result = run("play", "Pong", *options)
    assert result.exit_code == 2
    assert message in " ".join(result.output.replace("│", " ").split())


def test_without_a_display(tmp_path, monkeypatch):
    def failing():
        raise RuntimeError("no display")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "tkinter", SimpleNamespace(Tk=failing))
    result = run("play", "Pong", "--human")
    assert result.exit_code == 2
    assert "no window can be opened (no display)" in " ".join(
        result.output.replace("│", " ").split()
    )
