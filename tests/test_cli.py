import numpy as np
import pytest
from conftest import DATA
from PIL import Image
from typer.testing import CliRunner

import ocjax
from ocjax.cli import app

runner = CliRunner()


def run(*args):
    return runner.invoke(app, [str(a) for a in args], terminal_width=200)


def test_games():
    result = run("games")
    assert result.exit_code == 0
    for name in ocjax.games():
        assert name in result.output


def test_demo(tmp_path):
    out = tmp_path / "picture.png"
    result = run("demo", "pong", "--envs", 4, "--steps", 20, "--out", out)
    assert result.exit_code == 0, result.output
    for word in ("agent steps", "emulated frames", "REM per frame", "VEM per frame", "of step"):
        assert word in result.output
    with Image.open(out) as picture:
        image = np.asarray(picture)
    assert image.shape[0] > 3 * 600
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 8


@pytest.mark.parametrize("suffix", [".png", ".gif"])
def test_render(tmp_path, suffix):
    out = tmp_path / f"tape{suffix}"
    result = run("render", DATA / "Pong.npz", "--out", out, "--first", 5, "--count", 3)
    assert result.exit_code == 0, result.output
    with Image.open(out) as picture:
        assert getattr(picture, "n_frames", 1) == (3 if suffix == ".gif" else 1)


def test_wrong_use(tmp_path):
    bad = tmp_path / "Pong.npz"
    bad.write_bytes(b"no")
    for args, message in (
        (("demo", "Pung"), "did you mean Pong"),
        (("render", tmp_path / "no.npz", "--out", "x.png"), "no recording"),
        (("render", bad, "--out", "x.png"), "not a readable"),
        (("render", DATA / "Pong.npz", "--out", "x.jpg"), "must end in .png or .gif"),
        (("render", DATA / "Pong.npz", "--out", "x.png", "--method", "ram"), "method must be"),
        (("render", DATA / "Pong.npz", "--out", "x.png", "--first", 9999), "samples"),
    ):
        result = run(*args)
        assert result.exit_code == 2, args
        assert message in " ".join(result.output.replace("│", " ").split()), result.output
    assert not (tmp_path / "x.png").exists()
