"""The command `ocjax train`; runs of it are skipped unless the extra `rl` is installed."""

import dataclasses
import importlib.util
import json
import re

import pytest
from PIL import Image

import ocjax
from ocjax.agents.config import EXPERIMENTS, Config, Hyperparameters
from ocjax.cli import train
from ocjax.emulators.ram_starts import variation
from ocjax.play import policies
from tests.support.command import run

needs_rl = pytest.mark.skipif(
    not importlib.util.find_spec("optax"), reason="the extra `rl` is not installed"
)
TINY = ("--num-envs", 4, "--horizon", 8, "--minibatch", 32, "--epochs", 1)


@pytest.fixture
def configured(monkeypatch):
    """The configuration that a command trains with, without the training."""

    def configure(*args):
        found = []
        monkeypatch.setattr(train, "_train", lambda config, folder, frames: found.append(config))
        monkeypatch.setattr(train, "_show", lambda config, folder: None)
        result = run("train", *args)
        assert result.exit_code == 0, result.output
        return found[0]

    return configure


def test_every_hyperparameter_is_an_option(configured):
    """Each hyperparameter is an option with its name, under a separate heading of the help."""
    options = {}
    for field in dataclasses.fields(Hyperparameters):
        options[field.name] = 2 * field.default if field.type is int else field.default / 2
    arguments = [
        part for name, value in options.items() for part in (f"--{name.replace('_', '-')}", value)
    ]
    config = configured("Pong", *arguments)
    assert dataclasses.asdict(config.hyperparameters) == options
    assert configured("Pong").hyperparameters == Hyperparameters()
    shown = " ".join(run("train", "--help").output.replace("│", " ").split())
    panel = shown[shown.index("Hyperparameters of PPO") :]
    for field in dataclasses.fields(Hyperparameters):
        assert f"--{field.name.replace('_', '-')} " in panel
        assert f"{field.metadata['help']} Default: {field.default:g}." in panel


def test_options_of_environments(configured):
    options = (
        "--preset",
        "machado",
        "--variation",
        "lazy_enemy",
        "--variation",
        "Pong:up_drift",
        "--game-mode",
        1,
    )
    options += (
        "--game-difficulty",
        2,
        "--start",
        "none",
        "--start",
        "ball_x=0x20,4=7",
        "--seed",
        5,
        "--inputs",
        "pixels",
    )
    assert configured("pong", *options) == Config(
        "Pong",
        5,
        "pixels",
        "machado",
        variations=("lazy_enemy", "up_drift"),
        game_mode=1,
        game_difficulty=2,
        starts=({}, {"ball_x": 32, "4": 7}),
    )
    assert configured("Pong") == Config("Pong")


def test_experiments(configured):
    assert configured("Pong", "--experiment", "paper") == Config.of("paper", "Pong")
    changed = configured("Pong", "--experiment", "paper", "--clip", 0.3, "--preset", "v5")
    assert changed == Config.of("paper", "Pong", {"clip": 0.3}, preset="v5")
    shown = run("train", "--help").output
    assert all(
        name in re.search(r"--experiment +(\S+)", shown)[1].split("|") for name in EXPERIMENTS
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--preset", "v4"), "fixed frame skip"),
        (("--preset", "v9"), "no preset 'v9'"),
        (("--variation", "lazy"), "did you mean lazy_enemy"),
        (("--game-mode", 7), "has no game_mode 7; it has [0, 1]"),
        (("--game-difficulty", 9), "it has [0, 1, 2, 3]"),
        (("--start", "ball_x"), "NAME=VALUE"),
        (("--start", "ball=1"), "did you mean ball_"),
        (("--experiment", "ours"), "experiment must be default or paper, got 'ours'"),
        (("--num-envs", 5), "num_envs must be even"),
        (("--minibatch", 100), "minibatch must divide"),
        (("--gamma", "nan"), "gamma must be positive"),
        (("--seed", 2**40), "seed must be an integer"),
    ],
)
def test_wrong_options_are_one_line(options, message, tmp_path):
    result = run("train", "Pong", "--out", tmp_path / "run", *options)
    assert result.exit_code == 2
    assert result.output.startswith("Error: ")
    assert message in result.output
    assert result.output.count("\n") == 1
    assert not (tmp_path / "run").exists()


@needs_rl
def test_a_run_with_other_options_is_another_one(tmp_path, monkeypatch):
    """The options are in config.json, and each of them distinguishes runs.

    A file of an older version without some of the fields belongs to another run.
    """
    monkeypatch.setattr(train, "_show", lambda config, folder: None)
    folder = tmp_path / "run"
    own = (
        "--variation",
        "lazy_enemy",
        "--game-mode",
        1,
        "--game-difficulty",
        1,
        "--start",
        "4=7",
        "--preset",
        "v5",
        "--gamma",
        0.9,
        *TINY,
    )
    command = ("train", "Pong", "--frames", 1, "--out", folder)
    assert run(*command, *own).exit_code == 0
    saved = json.loads((folder / "config.json").read_text())
    assert saved["variations"] == ["lazy_enemy"]
    assert (saved["game_mode"], saved["game_difficulty"], saved["starts"], saved["preset"]) == (
        1,
        1,
        [{"4": 7}],
        "v5",
    )
    assert saved["hyperparameters"]["gamma"] == 0.9
    policy = policies.read(folder / "policy.npz", ocjax.load("Pong"))
    assert (policy.preset, policy.settings) == ("v5", Config("Pong", preset="v5").settings)
    again = run(*command, *own)
    assert again.exit_code == 0, again.output
    assert "has been trained for 128 frames already" in again.output
    for i in range(0, 12, 2):
        other = run(*command, *own[:i], *own[i + 2 :])
        assert other.exit_code == 2
        assert re.search(
            r"holds another training.* config\.json differs in \w+", " ".join(other.stderr.split())
        )
    (folder / "config.json").write_text(
        json.dumps({name: saved[name] for name in saved if name not in ("history", "starts")})
    )
    older = run(*command, *own)
    assert older.exit_code == 2
    assert (
        "config.json differs in history, starts. Use another folder, or delete it" in older.stderr
    )


@needs_rl
def test_environments_of_a_run(tmp_path):
    """The environments of both halves cycle through the starts; variations, mode and difficulty
    apply to all of them."""
    from ocjax.agents.training import Trainer

    game = ocjax.load("Breakout")
    starts = ({}, {"lives": 3}, {"lives": 2})
    h = Hyperparameters(num_envs=10, horizon=8, minibatch=16)
    config = Config(
        "Breakout",
        hyperparameters=h,
        variations=("right_drift",),
        game_mode=4,
        game_difficulty=1,
        starts=starts,
    )
    trainer = Trainer(config, tmp_path / "run")
    pools = [half.envs.pool for half in trainer._collector._halves]
    lives = [n for pool in pools for n in pool.lives.tolist()]
    assert variation(game, starts[1]).writes
    assert lives == [(5, 3, 2)[i % 3] for i in range(10)]
    trainer.close()


@needs_rl
@pytest.mark.parametrize("experiment", ["default", "paper"])
def test_train_and_show(tmp_path, monkeypatch, experiment):
    monkeypatch.setattr("ocjax.play.games.PICTURE_STEPS", 5)
    monkeypatch.setattr(train, "EPISODES", 1)
    folder = tmp_path / "run"
    options = (
        "--experiment",
        experiment,
        "--preset",
        "v5",
        "--variation",
        "lazy_enemy",
        "--game-mode",
        1,
        *TINY,
    )
    result = run("train", "Pong", "--frames", 1, "--out", folder, *options)
    assert result.exit_code == 0, result.output
    text = " ".join(result.output.split())
    assert (
        "Playing 1 games of Pong with lazy_enemy, of at most 108,000 emulated frames each, in "
        "the default mode" in text
    )
    assert f"The first 5 steps of a game: {folder / 'agent.gif'}" in text
    with Image.open(folder / "agent.gif") as animation:
        assert animation.format == "GIF"
    policy = policies.read(folder / "policy.npz", ocjax.load("Pong"))
    assert policy.observation == Config.of(experiment, "Pong").vector
