"""Games that a person plays."""

import os
import subprocess
import sys
import textwrap

import ale_py
import numpy as np
import pytest
from PIL import Image

import ocjax
from ocjax import recordings
from ocjax.play import human
from tests.support.command import run

A = ale_py.Action


def test_recording_is_what_was_played():
    playing = human.HumanGame(ocjax.load("Pong"), seed=3)
    for _ in range(100):
        playing.step(A.NOOP.value)
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
    over, rewards = False, 0.0
    playing.reset()
    while not over:
        _, reward, over, _, _ = playing.step(A.NOOP.value)
        rewards += reward
    playing.reset()
    playing.step(A.NOOP.value)
    playing.reset()  # changes nothing before the end of a game
    tape = playing.recording()
    second = int(np.flatnonzero(tape.resets)[1])
    assert tape.resets.sum() == 2
    assert tape.ends[second - 1]
    assert tape.ends.sum() == 1
    assert tape.rewards[second] == 0
    assert tape.rewards[second - 1] == rewards < 0


def test_objects_are_drawn_over_the_screen():
    playing = human.HumanGame(ocjax.load("Pong"))
    for _ in range(60):
        playing.step(A.NOOP.value)
    shown = playing.render()
    plain = np.asarray(
        Image.fromarray(playing.game.palette[playing.screen]).resize(
            shown.shape[1::-1], Image.Resampling.NEAREST
        )
    )
    assert shown.shape == (630, 960, 3)
    assert 0 < (shown != plain).any(axis=2).mean() < 0.1


def _play_in_a_window(*arguments, driver="dummy"):
    """Run `ocjax play` in another process, hold d, Up and space, and then press Escape.

    The output's first line names the actions. Gymnasium sets Matplotlib's backend.
    """
    pytest.importorskip("pygame", reason="pygame is not installed")
    program = """
        import sys

        import ale_py, pygame

        from ocjax.cli.app import app
        from ocjax.play.human import HumanGame

        actions, step = [], HumanGame.step

        def press(*keys):
            for key in keys:
                pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=key))

        def observed(self, action):
            actions.append(ale_py.Action(action).name)
            if len(actions) == 5:
                press(ord("d"), pygame.K_UP, ord(" "))
            if len(actions) == 40:
                press(pygame.K_ESCAPE)
                print(*dict.fromkeys(actions))
            return step(self, action)

        HumanGame.step = observed
        app(sys.argv[1:])
    """
    command = [sys.executable, "-c", textwrap.dedent(program), *map(str, arguments)]
    environment = {**os.environ, "SDL_VIDEODRIVER": driver, "SDL_AUDIODRIVER": "dummy"}
    return subprocess.run(command, capture_output=True, text=True, timeout=300, env=environment)


def test_command(tmp_path):
    out, gif = tmp_path / "a.npz", tmp_path / "a.gif"
    done = _play_in_a_window("play", "Boxing", "--human", "--out", out, "--gif", gif)
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[0] == "NOOP UPRIGHTFIRE"
    assert done.stderr == ""
    assert len(recordings.read(out)) == 21  # the first state, and every second of 40 steps
    with Image.open(gif) as animation:
        assert animation.n_frames >= 2


def test_without_a_display(tmp_path):
    done = _play_in_a_window(
        "play", "Pong", "--human", "--out", tmp_path / "a.npz", driver="missing"
    )
    assert done.returncode == 2
    assert "no window can be opened (missing not available)" in " ".join(done.stderr.split())


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
