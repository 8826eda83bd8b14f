import csv
import io
import re

import numpy as np
import pytest
from conftest import excerpt
from test_cli import run

import ocjax
from ocjax import recordings, report, rollout
from ocjax.envs import Settings


@pytest.fixture(scope="module")
def tape():
    return rollout.rollout(ocjax.load("Pong"), 64, seed=5, num_envs=4)


def test_play(tape):
    assert tape.rams.shape == (64, 128)
    assert tape.screens.shape == tape.previous.shape == (64, 210, 160)
    assert np.flatnonzero(tape.resets).tolist() == [0, 16, 32, 48]
    assert np.unique(tape.episode).tolist() == [1, 2, 3, 4]
    again = rollout.rollout(tape.game, 64, seed=5, num_envs=4)
    assert np.array_equal(again.rams, tape.rams)
    assert not np.array_equal(rollout.rollout(tape.game, 64, seed=6, num_envs=4).rams, tape.rams)
    other = rollout.rollout(tape.game, 64, seed=5, num_envs=4, policy="random")
    assert not np.array_equal(other.rams, tape.rams)


def test_recording_is_kept(tape, tmp_path):
    path = tmp_path / "tape.npz"
    tape.write(path)
    back = recordings.read(path)
    for name in (*recordings.ARRAYS, "frame_skip", "game"):
        assert np.array_equal(getattr(back, name), getattr(tape, name)), name
    assert [p.name for p in tmp_path.iterdir()] == ["tape.npz"]
    assert Settings(**back.protocol) == Settings(frame_skip=3, repeat_action_probability=0.0)
    both = recordings.join([tape, back])
    assert both.protocol == tape.protocol
    assert len(np.unique(both.episode)) == 8
    assert both.frame_skip == 3
    with pytest.raises(FileNotFoundError):
        tape.write(tmp_path / "nowhere" / "tape.npz")


def test_recording_of_wrong_kind(tape, tmp_path):
    path = tmp_path / "tape.npz"
    arrays = {"rams": tape.rams, "screens": tape.screens, "game": "Pong"}
    for change, message in (
        ({"lives": tape.lives[:-1]}, "lives must be numbers"),
        ({"protocol": "v5"}, "protocol must be JSON, is"),
        ({"resets": tape.lives}, "resets must be bool"),
        ({"previous": tape.previous[:, ::2]}, "previous must be uint8"),
        ({"previous_shown": tape.previous}, "previous_shown is kept as exclusive or with shown"),
    ):
        np.savez(path, **arrays, **change)
        with pytest.raises(recordings.RecordingError, match=message):
            recordings.read(path)


def test_saved_policy(tape, tmp_path):
    path = tmp_path / "policy.npz"
    n = 5 * tape.game.num_slots
    rng = np.random.default_rng(0)
    net = {"w0": rng.normal(size=(n, 8)), "b0": np.zeros(8), "w1": rng.normal(size=(8, 6)), "b1": np.array([0, 0, 0, 99.0, 0, 0])}
    np.savez(path, **net)
    act = rollout.make_policy(str(path), tape.game, 6, 4, 0)
    assert act(tape.rams[:4]).tolist() == [3] * 4
    assert len(rollout.rollout(tape.game, 8, num_envs=4, policy=str(path))) == 8
    for change, message in (
        ({"w0": np.zeros((n + 1, 8))}, rf"w0 \[{n}, n\]"),
        ({"b1": np.zeros(5)}, r"w1 \[8, n\] and b1 \[n\]"),
        ({"w1": np.zeros((8, 5)), "b1": np.zeros(5)}, "must have 6 outputs"),
    ):
        np.savez(path, **(net | change))
        with pytest.raises(rollout.PolicyError, match=message):
            rollout.make_policy(str(path), tape.game, 6, 4, 0)
    path.write_bytes(b"no")
    with pytest.raises(rollout.PolicyError, match="not a readable policy"):
        rollout.make_policy(str(path), tape.game, 6, 4, 0)
    with pytest.raises(rollout.PolicyError, match="it must be random, repeat, or the path"):
        rollout.make_policy("greedy", tape.game, 6, 4, 0)


def test_formats():
    """What is wrong in the decoder shows in all of them: here on a recording whose RAM is one sample late."""
    data = excerpt("Pong")
    late = recordings.Recording(ocjax.load("Pong"), np.roll(data["rams"], 1, axis=0), data["screens"], data["previous"])
    e = report.evaluate(late, "late RAM")
    assert 0.3 < e.aware.sum().f1 < 0.9
    assert e.values == {}
    assert e.switches is None
    rows = list(csv.DictReader(io.StringIO(report.to_csv([e]))))
    assert [r["Category"] for r in rows] == [*e.game.slices, "all"]
    assert float(rows[-1]["F1"]) == pytest.approx(100 * e.aware.sum().f1)
    page = report.to_html([e])
    assert len(re.findall("<img ", page)) == len(e.worst) > 0
    assert "invented" in page
    assert len(page) < 1_000_000
    latex = report.to_latex([e])
    assert latex.count("\\cellcolor") == sum(v == v for row in report.by_category(e).rows for v in (row[2], row[3], row[4], row[6]))
    assert "| Ball |" in report.to_markdown([report.by_category(e)])
    assert (report._shade(0), report._shade(50), report._shade(100)) == ("D73027", "FFFFBF", "1A9850")


def test_coverage_of_what_the_chip_drew():
    """Where the recording says what was drawn: here just the ball, and nothing else."""
    game, data = ocjax.load("Pong"), excerpt("Pong")
    ball = game.rem(data["rams"]).of(game, "Ball")
    shown = np.zeros(data["screens"].shape, np.uint8)
    for i, ((x, y, w, h),) in enumerate(np.asarray(ball.xywh).astype(int)):
        shown[i, y : y + h, x : x + w] = 16
    e = report.evaluate(recordings.Recording(game, data["rams"], data["screens"], shown=shown), "")
    assert e.cover == (1.0, pytest.approx(np.asarray(ball.valid).sum() / e.aware.sum().left))


def test_evaluate(tape, tmp_path):
    outs = {f: tmp_path / f"out.{f}" for f in ("markdown", "csv", "latex", "html")}
    tape.write(tmp_path / "tape.npz")
    args = [a for f, path in outs.items() for a in (f"--{f}", path)]
    result = run("evaluate", "pong", tmp_path / "tape.npz", "--samples", 64, "--seed", 5, "--seed", 6, "--difficulty", 1, *args)
    assert result.exit_code == 0, result.output
    assert all(path.stat().st_size > 300 for path in outs.values())
    for word in ("PlayerScore", "100.00", "seeds [5, 6], difficulties [1]", "128"):
        assert word in " ".join(result.output.split())


def test_wrong_use(tape, tmp_path):
    bare = tmp_path / "bare.npz"
    recordings.Recording(tape.game, tape.rams).write(bare)
    for args, message in (
        (("Pung",), "did you mean Pong"),
        ((tmp_path / "no.npz",), "no recording"),
        ((bare,), "has no frames"),
        (("Pong", "--policy", "greedy"), "no policy 'greedy'"),
        (("Pong", "--mode", 77), "Pong has no mode 77"),
        (("Pong", "--html", tmp_path / "nowhere" / "x.html"), "no folder"),
    ):
        result = run("evaluate", *args, "--csv", tmp_path / "x.csv")
        assert result.exit_code == 2, result.output
        assert message in " ".join(result.output.replace("│", " ").split()), result.output
        assert not (tmp_path / "x.csv").exists()
