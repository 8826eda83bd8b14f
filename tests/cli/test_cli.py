import importlib.metadata
import json
import os
import re
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import typer
from PIL import Image

import ocjax
from ocjax.cli import app as cli
from ocjax.cli import demo, description, evaluate, options, ram, render
from ocjax.cli.messages import console, warn
from ocjax.evaluation import tables
from ocjax.files import writing
from ocjax.play import policies
from tests.support.command import run
from tests.support.marks import some
from tests.support.states import DATA


def test_games():
    result = run("games")
    assert result.exit_code == 0
    for name in ocjax.games():
        assert name in result.output
    assert max(map(len, result.output.splitlines())) <= 80
    assert json.loads(run("games", "--json").output) == list(ocjax.games())


@pytest.mark.parametrize("name", some(8, ocjax.games()))  # each starts an emulator
def test_a_game_is_described(name):
    game = ocjax.load(name)
    about = description.describe(game)
    assert json.loads(json.dumps(about)) == about
    assert [c["name"] for c in about["categories"]] == list(game.slices)
    assert all(c["doc"] for c in about["categories"])
    assert [field["name"] for field in about["ram"]] == list(game.ram.fields())
    assert about["accuracy"]["f1"] > 97
    assert about["variants"]["modes"]


def test_a_page_of_a_game(tmp_path, monkeypatch):
    out = tmp_path / "pong.png"
    result = run("games", "pong", "--picture", out)
    assert result.exit_code == 0, result.output
    for text in (
        "modes 0, 1",
        "the opponent's paddle has 8 rows",
        "the ball, while it is in play",
        "ball_x",
        "x + 49",
        "identical boxes",
    ):
        assert text in result.output
    with Image.open(out) as picture:
        assert picture.size[0] > 2 * 640
    about = json.loads(run("games", "Pong", "--json").output)
    assert about["slots"] == 5
    assert about["agent"]
    assert about["variations"]["lazy_enemy"] == "The enemy stays in the middle of the court."
    assert "lazy_enemy" in run("games", "Pong").output
    assert "Terrain" not in run("games", "Pong").output
    kinds = json.loads(run("games", "Kangaroo", "--json").output)["terrain"]
    assert [kind["name"] for kind in kinds] == ["wall", "platform", "ladder"]
    assert "Terrain" in run("games", "Kangaroo").output
    for wrong, message in (
        (("games", "Pongg"), "Pong"),
        (("games", "--picture", out), "needs the name of a game"),
    ):
        result = run(*wrong)
        assert result.exit_code == 2
        assert message in result.output
    monkeypatch.setattr(policies, "SHIPPED", tmp_path)
    assert not json.loads(run("games", "Pong", "--json").output)["agent"]


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


def test_terrain_in_pictures(tmp_path):
    """The option changes the picture; games without terrain say so."""
    recording = DATA / "MsPacman.npz"
    plain, painted = tmp_path / "plain.png", tmp_path / "painted.png"
    assert run("render", recording, "--out", plain).exit_code == 0
    assert run("render", recording, "--out", painted, "--terrain").exit_code == 0
    with Image.open(plain) as one, Image.open(painted) as other:
        assert (np.asarray(one) != np.asarray(other)).mean() > 0.1
    picture = tmp_path / "demo.png"
    options = "--envs", 2, "--steps", 4, "--out", picture, "--terrain"
    assert run("demo", "MsPacman", *options).exit_code == 0
    assert picture.exists()
    for command in (("demo", "Pong"), ("render", DATA / "Pong.npz", "--out", plain)):
        assert "Pong has no terrain" in run(*command, "--terrain").output
    assert "needs --gif or --human" in run("play", "MsPacman", "--terrain").output


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


def test_version():
    for command in (("--version",), ()):
        code = [sys.executable, "-m", "ocjax", *command]
        result = subprocess.run(code, capture_output=True, text=True, check=False)
        assert (ocjax.__version__ if command else "Usage") in result.stdout


def test_help_is_that_of_the_commands():
    """`ocjax --help` reads the lines from the files, because an import takes seconds."""
    shown = " ".join(run("--help").output.replace("│", " ").split())
    for name in cli.COMMANDS:
        summary = cli.summary(name)
        assert cli.load(name).help.splitlines()[0] == summary
        assert f" {name} " in shown
        assert summary in shown


def test_help_is_quick():
    code = (
        "import sys; from ocjax.cli.app import app; app(['--help'], standalone_mode=False); "
        "print('jax' in sys.modules)"
    )
    assert subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.endswith("False\n")


@pytest.mark.parametrize(
    "command",
    [
        ("demo", "Pong", "--out"),
        ("render", DATA / "Pong.npz", "--out"),
        ("evaluate", "Pong", "--csv"),
        ("ram", "correlate", "Pong", "--write"),
        ("ram", "causes", "Pong", "--out"),
    ],
)
def test_bad_outputs_are_refused_before_the_work(command, tmp_path, monkeypatch):
    def work(*args, **kwargs):
        raise AssertionError("the work has started")

    works = (demo, "run"), (render.recordings, "read"), (evaluate, "rollout"), (ram, "rollout")
    for module, name in (*works, (ram.causal, "causes")):
        monkeypatch.setattr(module, name, work)
    (tmp_path / "folder.png").mkdir()
    for out, message in (
        (tmp_path / "nowhere" / "x.png", "no folder"),
        (tmp_path / "folder.png", "is a folder"),
    ):
        result = run(*command, out)
        assert result.exit_code == 2, result.output
        assert message in result.output
        assert result.output.count("\n") == 1


@pytest.mark.parametrize(
    ("command", "package", "install"),
    [
        (("dataset", "Pong", "--out"), "pyarrow", "'ocjax[data]'"),
        (("train", "Pong", "--out"), "optax", "'ocjax[rl]'"),
        (("extract", DATA / "Pong.npz", "--ray", "local", "--out", "x.npz"), "ray", "'ocjax[ray]'"),
        (("play", "Pong", "--human"), "pygame", "'ocjax[play]'"),
        (("extract", DATA / "Pong.npz", "--out", "x.h5"), "h5py", "'ocjax[data]'"),
        (("extract", DATA / "Pong.npz", "--out", "x.parquet"), "pyarrow", "'ocjax[data]'"),
        (
            ("extract", "minari:a/b-v0", "--game", "Pong", "--out", "x.npz"),
            "minari",
            "'ocjax[data]'",
        ),
    ],
)
def test_a_missing_extra_is_one_line(command, package, install, tmp_path, monkeypatch):
    def version(name):
        if name == package:
            raise importlib.metadata.PackageNotFoundError(name)
        return "1"

    monkeypatch.chdir(tmp_path)
    for name in [name for name in sys.modules if name.startswith((f"{package}.", "ocjax.agents."))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setattr(importlib.metadata, "version", version)
    result = run(*command, *["folder"] * (command[-1] == "--out"))
    assert result.exit_code == 2
    errors = [line for line in result.output.splitlines() if "extracting" not in line]
    assert len(errors) == 1
    assert re.fullmatch(
        rf"Error: \w+ is not installed: pip install {re.escape(install)}", errors[0]
    )
    assert not [path for path in tmp_path.glob("x.*") if path.is_file()]


def test_a_missing_rom_is_one_line(tmp_path, monkeypatch):
    monkeypatch.setenv("ALE_ROMS_DIR", str(tmp_path))
    result = run("demo", "Pong")
    assert result.exit_code == 2
    assert re.fullmatch(r"Error: expected the ROM 'pong' at .*\n", result.output)


def test_names_of_files_are_no_markup(tmp_path, capsys):
    out = (
        tmp_path
        / "a [bold]picture with a name that is longer than the eighty columns of a pipe [x].png"
    )
    result = run("render", DATA / "Pong.npz", "--out", out, "--method", "rem")
    assert result.exit_code == 0, result.output
    assert f": {out}\n" in result.output
    table = tables.Table(
        "of [bold]a.npz[/x]", ("[red]x",), [("[/y] in a cell that is wider than the title",)]
    )
    tables.show(table, console)
    printed = " ".join(capsys.readouterr().out.split())
    assert all(part in printed for part in ("of [bold]a.npz[/x]", "[red]x", "[/y]"))


def test_redirected_tables_are_whole(tmp_path):
    """Cells of a table in a pipe stay on one line, with any width of a terminal."""
    lines = run("games", "FishingDerby").output.splitlines()
    for c in ocjax.load("FishingDerby").categories:
        assert any(c.name in line and c.doc in line for line in lines), c.name


def test_outputs_are_replaced_whole(tmp_path):
    old = tmp_path / "old.txt"
    writing.write_text(old, "old")
    link = tmp_path / "link.txt"
    link.symlink_to(old)

    def fail(file):
        file.write(b"half")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        writing.write(old, fail)
    assert old.read_text() == "old"
    writing.write_text(link, "new")
    assert link.is_symlink()
    assert old.read_text() == "new"
    assert {p.name for p in tmp_path.iterdir()} == {"old.txt", "link.txt"}
    writing.write_text(Path(os.devnull), "nothing")
    assert not Path(os.devnull).is_file()


INTERRUPTED = """
import threading, time
import jax, jax.numpy as jnp
from ocjax.cli import app as cli, demo

def run(*args):
    def compile():
        x = jnp.ones((64, 64))
        jax.jit(lambda x: [x := jnp.sin(x @ x) for _ in range(300)][-1])(x)
    threading.Thread(target=compile, daemon=True).start()
    time.sleep(0.5)
    raise KeyboardInterrupt

demo.run = run
cli.app(["demo", "Pong"])
"""


def test_interruption(tmp_path):
    """An interruption prints one line and exits with status 130, while a thread of XLA still
    compiles."""
    result = subprocess.run(
        [sys.executable, "-c", INTERRUPTED],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (result.returncode, result.stderr.splitlines()) == (130, ["Interrupted."])


def test_help_groups_the_commands():
    output = run("--help").output
    places = [output.index(f"─ {panel} ─") for panel in cli.PANELS]
    assert places == sorted(places)
    assert sorted(name for names in cli.PANELS.values() for name in names) == sorted(cli.COMMANDS)
    assert "--install-completion" in output
    assert "<bool>" not in output


@pytest.mark.parametrize("name", cli.COMMANDS)
def test_help_of_a_command(name):
    output = run(name, "--help").output
    assert "completion" not in output
    assert "<bool>" not in output
    assert max(map(len, output.splitlines())) <= 80


@pytest.mark.parametrize(
    ("text", "number"),
    [
        ("20000000", 20_000_000),
        ("20_000_000", 20_000_000),
        ("2e7", 20_000_000),
        ("20M", 20_000_000),
        ("1.5M", 1_500_000),
        ("10k", 10_000),
        ("1", 1),
    ],
)
def test_counts(text, number):
    assert options.count(text) == number


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("many", "'many' is not a whole number such as 20000000, 2e7 or 20M"),
        ("1.5", "'1.5' is not a whole number"),
        ("10kM", "'10kM' is not a whole number"),
        ("inf", "'inf' is not a whole number"),
        ("", "'' is not a whole number"),
        ("0", "0 is not at least 1"),
        ("-1M", "-1M is not at least 1"),
    ],
)
def test_wrong_counts(text, message):
    with pytest.raises(typer.BadParameter, match=re.escape(message)):
        options.count(text)


def test_a_warning_is_one_line(capsys):
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.showwarning = warn
        warnings.warn("[bold] text that is longer than one line of a terminal " * 3, stacklevel=1)
    assert capsys.readouterr().err.splitlines() == [
        "Warning: " + "[bold] text that is longer than one line of a terminal " * 3
    ]
