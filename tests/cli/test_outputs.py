"""Outputs of commands never replace a file that the same command reads."""

import os

import numpy as np
import pytest
import typer
from PIL import Image

import ocjax
from ocjax import datasets
from ocjax.cli.app import COMMANDS, load
from ocjax.play import policies
from ocjax.recordings import Recording
from tests.support.command import run
from tests.support.states import excerpt

OUTPUTS = {
    "--out",
    "--markdown",
    "--csv",
    "--json",
    "--gif",
    "--latex",
    "--html",
    "--picture",
    "--plots",
    "--write",
}
HEADER = "frame_id,episode_id,score,duration(ms),unclipped_reward,action,gaze_positions"
# Each output with arguments that read files. IN is the input, and OUT names the same file.
CASES = {
    ("render", "--out"): ("render IN --out OUT.png", "render IN --out OUT.gif"),
    ("evaluate", "--markdown"): (
        "evaluate IN --markdown OUT",
        "evaluate Pong --samples 8 --policy POLICY --markdown OUT",
    ),
    ("evaluate", "--csv"): ("evaluate IN --csv OUT",),
    ("evaluate", "--latex"): ("evaluate IN --latex OUT",),
    ("evaluate", "--html"): ("evaluate IN --html OUT",),
    ("extract", "--out"): ("extract IN --out OUT.npz", "extract IN --out OUT.txt"),
    ("gaze", "--out"): (
        "gaze TRIAL --game Pong --out OUT.csv",
        "gaze TRIAL --game Pong --frames FRAMES --out OUT.csv",
    ),
    ("gaze", "--picture"): (
        "gaze TRIAL --game Pong --frames FRAMES --out NEW.csv --picture OUT.png",
    ),
    ("export", "--out"): ("export DATASET --out OUT.csv",),
    ("play", "--csv"): ("play Pong --episodes 1 --policy POLICY --csv OUT",),
    ("play", "--gif"): ("play Pong --episodes 1 --policy POLICY --gif OUT.gif",),
    ("play", "--markdown"): (
        "play Pong --episodes 1 --policy POLICY --variations all --markdown OUT",
    ),
    ("play", "--json"): ("play Pong --episodes 1 --policy POLICY --variations all --json OUT",),
    ("ram correlate", "--write"): (
        "ram correlate IN --write OUT.py",
        "ram correlate Pong --policy POLICY --write OUT.py",
    ),
}
READ_NOTHING = {  # or update their own file or folder
    *(("bench", option) for option in ("--json", "--plots")),
    *(("games", option) for option in ("--picture",)),
    ("parity", "--out"),
    ("ram causes", "--out"),
    ("ram disassemble", "--out"),
    ("dataset", "--out"),
    ("demo", "--out"),
    ("play", "--out"),
    ("ram control", "--json"),
    ("ram new", "--out"),
    ("train", "--out"),
}


def options(command, name):
    """The options of a command and of its subcommands that take a value and are named like an
    output."""
    if isinstance(command, typer.core.TyperGroup):
        return {
            pair for sub, own in command.commands.items() for pair in options(own, f"{name} {sub}")
        }
    taking = [p for p in command.params if not getattr(p, "is_flag", False)]
    return {(name, option) for p in taking for option in p.opts if option in OUTPUTS}


def test_every_output_is_in_the_table():
    found = {pair for name in COMMANDS for pair in options(load(name), name)}
    assert found == CASES.keys() | READ_NOTHING


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    """The inputs of the cases by their words, and the files that must stay as they are."""
    folder = tmp_path_factory.mktemp("inputs")
    data, game = excerpt("Pong"), ocjax.load("Pong")
    Recording(game, data["rams"], data["screens"]).write(folder / "IN.npz")
    (folder / "POLICY.npz").write_bytes((policies.SHIPPED / "Pong.npz").read_bytes())
    (folder / "TRIAL.txt").write_text(f"{HEADER}\n0,0,0,50,0,0,10.0,20.0\n")
    (folder / "FRAMES").mkdir()
    Image.fromarray(np.asarray(game.palette)[data["screens"][0]]).save(folder / "FRAMES" / "0.png")
    (folder / "TRIAL").symlink_to(folder / "FRAMES")
    words = {
        word: folder / f"{word}.{suffix}"
        for word, suffix in (("IN", "npz"), ("POLICY", "npz"), ("TRIAL", "txt"))
    }
    return words | {"FRAMES": folder / "FRAMES", "NEW": folder / "NEW"}


@pytest.mark.parametrize("link", [os.symlink, os.link])
@pytest.mark.parametrize(
    "case", [case for cases in CASES.values() for case in cases if "DATASET" not in case]
)
def test_commands(case, inputs, tmp_path, link):
    words = case.split()
    word = next(word for word in ("IN", "POLICY", "FRAMES", "TRIAL") if word in words)
    target = inputs[word] / "0.png" if word == "FRAMES" else inputs[word]
    before, arguments = target.read_bytes(), []
    for one in words:
        name, dot, suffix = one.partition(".")
        if name == "OUT":
            out = tmp_path / f"out{dot}{suffix}"
            link(target, out)
            arguments.append(out)
        else:
            arguments.append(f"{inputs[name]}{dot}{suffix}" if name in inputs else one)
    result = run(*arguments)
    assert "would replace the input" in " ".join(result.output.split()), result.output
    assert result.exit_code == 2
    assert target.read_bytes() == before


def test_the_name_of_the_input_itself(inputs):
    before = inputs["IN"].read_bytes()
    result = run("extract", inputs["IN"], "--out", inputs["IN"])
    assert "would replace the input" in " ".join(result.output.split()), result.output
    assert inputs["IN"].read_bytes() == before


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b"[" * 100_000, b"\xff", b" " * 2**25])
def test_a_damaged_file_of_controls(tmp_path, content):
    out = tmp_path / "controls.json"
    out.write_bytes(content)
    result = run("ram", "control", "Pong", "--json", out)
    assert result.exit_code == 2
    assert "controls.json is damaged" in "".join(result.output.split("\n")), result.output
    assert out.read_bytes() == content


def test_exports(tmp_path):
    pytest.importorskip("pyarrow")
    datasets.generate(datasets.plan("Pong", 20), tmp_path / "pong")
    for path in [tmp_path / "pong" / "dataset.json", *(tmp_path / "pong" / "data").iterdir()]:
        out, before = tmp_path / f"{path.stem}.csv", path.read_bytes()
        out.symlink_to(path)
        result = run("export", tmp_path / "pong", "--out", out)
        assert "would replace the input" in " ".join(result.output.split()), result.output
        assert path.read_bytes() == before
