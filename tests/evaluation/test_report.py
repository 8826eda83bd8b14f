import csv
import dataclasses
import io
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import ocjax
from ocjax import recordings
from ocjax.evaluation import formats, ocatari_peer, report, tables
from ocjax.play import policies, rollouts
from tests.support.command import run
from tests.support.states import excerpt


@pytest.fixture(scope="module")
def tape():
    return rollouts.rollout(ocjax.load("Pong"), 64, seed=5, num_envs=4)


def test_play(tape):
    assert tape.rams.shape == (64, 128)
    assert tape.screens.shape == tape.previous.shape == (64, 210, 160)
    assert np.flatnonzero(tape.resets).tolist() == [0, 16, 32, 48]
    assert np.unique(tape.episode).tolist() == [1, 2, 3, 4]
    assert not tape.rewards[tape.resets].any()
    assert (tape.rams[tape.resets] == tape.rams[0]).all(), "the state after a reset comes first"
    again = rollouts.rollout(tape.game, 64, seed=5, num_envs=4)
    assert np.array_equal(again.rams, tape.rams)
    assert not np.array_equal(rollouts.rollout(tape.game, 64, seed=6, num_envs=4).rams, tape.rams)
    other = rollouts.rollout(tape.game, 64, seed=5, num_envs=4, policy="random")
    assert not np.array_equal(other.rams, tape.rams)


def test_saved_policy(tape, tmp_path):
    path = tmp_path / "policy.npz"
    n = 5 * tape.game.num_slots
    rng = np.random.default_rng(0)
    net = {
        "w0": rng.normal(size=(n, 8)),
        "b0": np.zeros(8),
        "w1": rng.normal(size=(8, 6)),
        "b1": np.array([0, 0, 0, 99.0, 0, 0]),
    }
    np.savez(path, **net)
    act = policies.make_policy(str(path), tape.game, 6, 4, 0)
    assert act(policies.Seen(tape.rams[:4], np.ones(4, bool))).tolist() == [3] * 4
    assert len(rollouts.rollout(tape.game, 8, num_envs=4, policy=str(path))) == 8
    for change, message in (
        ({"w0": np.zeros((n + 1, 8))}, rf"w0 \[{n}, n\]"),
        ({"b1": np.zeros(5)}, r"w1 \[8, n\] and b1 \[n\]"),
        ({"w1": np.zeros((8, 5)), "b1": np.zeros(5)}, "must have 6 outputs"),
    ):
        np.savez(path, **(net | change))
        with pytest.raises(policies.PolicyError, match=message):
            policies.make_policy(str(path), tape.game, 6, 4, 0)
    path.write_bytes(b"no")
    with pytest.raises(policies.PolicyError, match="not a readable policy"):
        policies.make_policy(str(path), tape.game, 6, 4, 0)
    with pytest.raises(
        policies.PolicyError, match="it must be random, repeat, idle, seldom, trained, or the path"
    ):
        policies.make_policy("greedy", tape.game, 6, 4, 0)


def test_errors_show_in_all_formats():
    """The RAM of this recording is one sample late."""
    data = excerpt("Pong")
    late = recordings.Recording(
        ocjax.load("Pong"), np.roll(data["rams"], 1, axis=0), data["screens"], data["previous"]
    )
    e = report.evaluate(late, "late RAM")
    assert 0.3 < e.flicker_aware.sum().f1 < 0.9
    assert e.values == {}
    assert e.switches is None
    rows = list(csv.DictReader(io.StringIO(formats.to_csv([e]))))
    assert [r["Category"] for r in rows] == [*e.game.slices, "all"]
    assert float(rows[-1]["F1"]) == pytest.approx(100 * e.flicker_aware.sum().f1)
    page = formats.to_html([e])
    assert len(re.findall("<img ", page)) == len(e.worst_frames) > 0
    assert "false detections in yellow" in page
    headings = {
        heading
        for table in (report.overview([e]), report.by_category(e))
        for heading in table.without_empty_columns().header
    }
    explained = set(re.findall("<dt>(.*?)</dt>", page))
    assert explained == headings & set(report.COLUMNS)
    assert headings - explained <= {"Game", "Category", "Samples", "Episodes"}
    assert page.index("every other frame") < page.index("<table>")
    assert len(page) < 1_000_000
    latex = formats.to_latex([e])
    assert latex.count("\\cellcolor") == sum(
        v == v for row in report.by_category(e).rows for v in (row[2], row[3], row[4], row[6])
    )
    assert "| Ball |" in tables.to_markdown([report.by_category(e)])
    assert (formats.shade(0), formats.shade(50), formats.shade(100)) == (
        "D73027",
        "FFFFBF",
        "1A9850",
    )


def test_first_and_last_states_and_lost_lives(tape):
    """The recording's marks give separate rows; only these rows show errors at resets."""
    lives, ends, rams = np.zeros(64, np.int32), np.zeros(64, bool), tape.rams.copy()
    lives[:] = np.where(np.arange(64) % 16 < 8, 3, 2)
    ends[[15, 31]] = True
    rams[tape.resets] = 0
    changed = dataclasses.replace(tape, rams=rams, lives=lives, ends=ends)
    e = report.evaluate(changed, "changed")
    rows = {row[0]: row for row in report.by_situation(e).rows}
    assert {name: row[1] for name, row in rows.items()} == {
        "first states": 4,
        "last states": 2,
        "lost lives": 4,
    }
    f1 = report.by_situation(e).header.index("F1")
    assert rows["first states"][f1] < 90 < rows["lost lives"][f1]
    exported = list(csv.DictReader(io.StringIO(formats.to_csv([e]))))
    assert [float(r["F1"]) for r in exported[-3:]] == pytest.approx(
        [row[f1] for row in rows.values()]
    )
    assert [r["Category"] for r in exported[-3:]] == list(rows)
    assert "first states" in formats.to_html([e])
    without = dataclasses.replace(tape, lives=None, ends=None, resets=None)
    assert len(report.tables_of(report.evaluate(without, "no episodes"))) == 1


def test_coverage_of_what_the_chip_drew():
    """In this recording, the ball is the only drawn object."""
    game, data = ocjax.load("Pong"), excerpt("Pong")
    ball = game.rem(data["rams"]).of("Ball")
    shown = np.zeros(data["screens"].shape, np.uint8)
    for i, ((x, y, w, h),) in enumerate(np.asarray(ball.xywh).astype(int)):
        shown[i, y : y + h, x : x + w] = 16
    e = report.evaluate(recordings.Recording(game, data["rams"], data["screens"], shown=shown), "")
    assert e.coverage == (
        1.0,
        pytest.approx(np.asarray(ball.valid).sum() / e.flicker_aware.sum().left),
    )


OCATARI = """#!{python}
import json, sys
import numpy as np

program, samples, game = sys.argv[1:]
assert program.endswith("ocatari_peer_program.py")
with np.load(samples) as file:
    n = len(file["rams"])
    assert file["screens"].shape == (n, 210, 160, 3) and file["resets"].shape == (n,)
if game != "Pong":
    sys.exit("no module for " + game)
frame = [["Ball", 80, 100, 2, 4], ["Ghost", 1, 2, 3, -4]]  # OCAtari gives negative sizes, too
print("a warning")
print(json.dumps({{"rem": {{"objects": [frame] * n, "us": [7.0] * n}}, "vem": {vem}}}))
"""


@pytest.fixture
def fake_ocatari(tmp_path):
    """Make an interpreter that answers like one with OCAtari."""

    def make(vem):
        path = tmp_path / "python"
        path.write_text(OCATARI.format(python=sys.executable, vem=vem))
        path.chmod(0o755)
        return path

    return make


def test_ocatari_stands_beside(tape, fake_ocatari):
    python = fake_ocatari('{"objects": [frame[:1]] * n, "us": [9.0] * n}')
    e = report.evaluate(tape, "", ocatari_peer.run(tape, python))
    counts = e.ocatari_agreement.sum()
    assert (counts.left, counts.right, counts.found) == (128, 64, 64)
    rows = {row["Category"]: row for row in csv.DictReader(io.StringIO(formats.to_csv([e])))}
    assert [float(rows[name]["OCAtari F1"]) for name in ("Ball", "all")] == pytest.approx(
        [100, 200 / 3]
    )
    assert report.overview([e]).rows[0][-2:] == [pytest.approx(200 / 3), 100]
    assert report.notes(e) == [
        "Pong: OCAtari's REM takes 7.0 us per frame",
        "Pong: OCAtari's VEM takes 9.0 us per frame",
    ]
    assert "{OCAtari}" in formats.to_latex([e])
    assert "takes 9.0 us" in formats.to_html([e])


def test_ocatari_program_imports_ocatari(tape, tmp_path, monkeypatch):
    """The program does not import ocjax's package of the same name."""
    for name in (
        "ocatari/core",
        "ocatari/ram/extract_ram_info",
        "ocatari/vision/extract_vision_info",
    ):
        path = tmp_path / f"{name}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        (path.parent / "__init__.py").touch()
        path.write_text(
            "init_objects = lambda *args, **options: []\ndetect_objects_ram = "
            "detect_objects_vision = lambda *args: None\n"
        )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    for method in ocatari_peer.run(tape, Path(sys.executable)).values():
        assert method.error == ""
        assert len(method.us) == len(tape)


def test_ocatari_that_fails(tape, fake_ocatari):
    python = fake_ocatari('{"error": "KeyError: 3"}')
    e = report.evaluate(tape, "", ocatari_peer.run(tape, python))
    assert e.ocatari_agreement is None
    assert report.notes(e)[1] == "Pong: OCAtari's VEM does not run here (KeyError: 3)"
    assert "OCAtari F1" in report.by_category(e).header
    freeway = recordings.Recording(ocjax.load("Freeway"), tape.rams, tape.screens)
    with pytest.raises(ocatari_peer.OcatariError, match="no module for Freeway"):
        ocatari_peer.run(freeway, python)
    with pytest.raises(ValueError, match="no frames"):
        ocatari_peer.run(recordings.Recording(tape.game, tape.rams), python)


def test_evaluate(tape, tmp_path):
    outs = {f: tmp_path / f"out.{f}" for f in ("markdown", "csv", "latex", "html")}
    tape.write(tmp_path / "tape.npz")
    args = [a for f, path in outs.items() for a in (f"--{f}", path)]
    result = run(
        "evaluate",
        "pong",
        tmp_path / "tape.npz",
        "--samples",
        64,
        "--seed",
        5,
        "--seed",
        6,
        "--difficulty",
        1,
        *args,
    )
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
