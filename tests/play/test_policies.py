"""Saved policies and the games that they play."""

import csv
import json
from typing import Any

import numpy as np
import pytest
from PIL import Image
from typer.testing import CliRunner

import ocjax
from ocjax.cli.app import app
from ocjax.envs import Settings, Vector
from ocjax.play import policies
from ocjax.play.games import play
from ocjax.play.policies import PolicyError, SavedPolicy, Seen
from tests.support.states import DATA, damaged_archive

ACTIONS = 6  # of Pong


@pytest.fixture
def policy():
    """A policy of Pong with random weights that looks at movements."""
    game, rng = ocjax.load("Pong", hud=False), np.random.default_rng(0)
    kind = Vector(
        ("x", "y", "dx", "dy", "valid"), grid_features=("valid",), history=2, normalize=False
    )
    n = len(kind.features_of(game))
    layers = [
        (rng.normal(size=(n, 8)), rng.normal(size=8)),
        (rng.normal(size=(8, ACTIONS)), rng.normal(size=ACTIONS)),
    ]
    settings = Settings(
        frame_skip=4, repeat_action_probability=0.0, noop_max=30, episodic_life=True
    )
    return SavedPolicy(
        game,
        layers,
        kind,
        rng.normal(size=n),
        rng.uniform(1, 50, n),
        sampled=True,
        settings=settings,
        preset="dqn",
        frames=7,
    )


def test_a_policy_survives_its_file(policy, tmp_path):
    path = tmp_path / "policy.npz"
    policy.write(path)
    again = policies.read(path, ocjax.load("Pong"))
    features = np.random.default_rng(1).uniform(0, 160, (5, len(policy.mean)))
    assert np.allclose(
        policy.logits(features), again.logits(features), atol=0.02
    )  # weights are kept in half precision
    assert (again.game, again.observation, again.settings) == (
        policy.game,
        policy.observation,
        policy.settings,
    )
    assert (again.sampled, again.preset, again.frames) == (True, "dqn", 7)
    assert path.stat().st_size < 10_000


def test_a_policy_on_ram_sees_what_environments_show(policy):
    """A policy sees the environments' features, through the ends of games, and so takes the same
    actions."""
    envs = ocjax.make_vec(
        "Pong", 3, obs=policy.observation, hud=False, num_workers=0, max_episode_frames=120
    )
    act, rng = policy.playing(3, seed=4), np.random.default_rng(4)
    obs, _ = envs.reset(seed=0)
    for _ in range(80):
        actions = policy.choose(obs, rng)
        assert np.array_equal(actions, act(Seen(envs.get_ram(), envs.pool.started)))
        obs, *_ = envs.step(actions)
    envs.close()


def test_sampled_actions_have_the_probabilities_of_the_logits(policy):
    features = np.zeros((1, len(policy.mean)))
    expected = np.exp(policy.logits(features)[0].astype(float))
    actions = policy.choose(np.repeat(features, 20_000, axis=0), np.random.default_rng(0))
    assert (
        np.abs(np.bincount(actions, minlength=ACTIONS) / 20_000 - expected / expected.sum()).max()
        < 0.02
    )


def test_files_that_are_no_policies(policy, tmp_path):
    path = tmp_path / "policy.npz"
    policy.write(path)
    with pytest.raises(PolicyError, match="is for Pong, not for Boxing"):
        policies.read(path, ocjax.load("Boxing"))
    with np.load(path) as file:
        arrays: dict[str, Any] = dict(file)

    def described(drop=None, **changes):
        description = json.loads(str(arrays["description"])) | changes
        description.pop(drop, None)
        return np.array(json.dumps(description))

    for change, message in (
        (
            {"description": np.array(json.dumps({"md5": policy.game.md5}))},
            "description of the policy is damaged",
        ),
        ({"description": described(drop="hud")}, "description of the policy is damaged: KeyError"),
        (
            {"description": described(history=10**12)},
            "too few for a history of 1,000,000,000,000 states",
        ),
        ({"description": described(history=1e400)}, "description of the policy is damaged"),
        ({"description": np.array("{")}, "must be a JSON object"),
        ({"description": np.array("[1]")}, "must be a JSON object"),
        ({"description": np.array("[" * 100_000)}, "must be a JSON object"),
        ({"deviation": np.zeros_like(policy.mean)}, "deviation must be positive"),
        ({"mean": policy.mean[1:]}, "must have shape"),
        ({"mean": np.full_like(policy.mean, np.nan)}, "mean must hold finite numbers"),
        ({"w0": arrays["w0"].astype("U8")}, "w0 must hold finite numbers"),
        ({"w1": np.array([None])}, "not a readable policy.*claims object"),
    ):
        files: dict[str, Any] = arrays | change
        np.savez(path, **files)
        with pytest.raises(PolicyError, match=message):
            policies.read(path, ocjax.load("Pong"))
    np.savez(path, description=arrays["description"])
    with pytest.raises(PolicyError, match="no layer w0"):
        policies.read(path, ocjax.load("Pong"))


WRONG = {
    "missing": ...,
    "zero": 0,
    "negative": -3,
    "huge": 10**12,
    "enormous": 10**40,
    "text": "ten",
    "names": "xy",
    "fraction": 9.5,
    "nan": float("nan"),
    "infinite": float("inf"),
    "null": None,
    "true": True,
    "list": [[]],
    "numbers": [1, 2],
    "object": {"a": []},
}
RIGHT = {
    "grid_features": ("missing", "null"),
    "frames": ("zero", "huge"),
    "preset": ("text", "names", "null"),
    "settings": ("null",),
    **dict.fromkeys(("normalize", "sampled"), ("true",)),
    "frame_skip": ("missing", "numbers"),
    "noop_max": ("missing", "zero"),
}


@pytest.mark.parametrize("kind", WRONG)
@pytest.mark.parametrize(
    "name",
    (
        "md5 hud features grid_features history normalize sampled settings preset frames "
        "frame_skip noop_max"
    ).split(),
)
def test_fields_of_the_description(policy, tmp_path, name, kind):
    """A wrong field raises an error when the file is read, not when the policy plays."""
    path = tmp_path / "policy.npz"
    policy.write(path)
    with np.load(path) as file:
        arrays = dict(file)
    known = json.loads(str(arrays["description"]))
    place = known if name in known else known["settings"]
    place.pop(name)
    if WRONG[kind] is not ...:
        place[name] = WRONG[kind]
    np.savez(path, **arrays | {"description": np.array(json.dumps(known))})
    if kind in RIGHT.get(name, ()):
        policies.read(path, ocjax.load("Pong"))
    else:
        with pytest.raises(PolicyError, match=r"policy\.npz: ") as caught:
            policies.read(path, ocjax.load("Pong"))
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["w0", "b0", "w1", "b1", "mean", "deviation"])
@pytest.mark.parametrize(
    "change",
    [
        lambda a: a[:-1],
        lambda a: a[None],
        lambda a: a.astype(str),
        lambda a: a.astype(complex),
        lambda a: a * np.nan,
        lambda a: np.full(a.shape, np.inf),
        lambda a: np.full(a.shape, 1e300),
        lambda a: np.full(a.shape, -(2**63)),
        lambda a: np.zeros(()),
    ],
)
def test_arrays_of_a_policy(policy, tmp_path, name, change):
    path = tmp_path / "policy.npz"
    policy.write(path)
    with np.load(path) as file:
        arrays = dict(file)
    np.savez(path, **arrays | {name: change(arrays[name])})
    with pytest.raises(PolicyError, match=r"policy\.npz: "):
        policies.make_policy(str(path), ocjax.load("Pong"), ACTIONS, 1, 0)


def test_damaged_policies_are_refused(policy, tmp_path):
    path = tmp_path / "policy.npz"
    policy.write(path)
    good, refused = path.read_bytes(), 0
    for number in range(200):
        path.write_bytes(damaged_archive(good, number))
        try:
            loaded = policies.read(path, ocjax.load("Pong"))
        except PolicyError as error:
            assert str(path) in str(error)  # noqa: PT017
            refused += 1
        else:
            assert np.array_equal(loaded.layers[0][0], policy.layers[0][0].astype(np.float16))
    assert refused > 100


@pytest.mark.slow
def test_every_instance_plays_equally_many_games(policy, tmp_path, monkeypatch):
    """Games are complete although training ends episodes with lives, and equal seeds give equal
    games."""
    monkeypatch.setattr("ocjax.play.games.MOST_ENVS", 2)
    path = tmp_path / "policy.npz"
    policy.write(path)
    played, again = (play(ocjax.load("Pong"), str(path), 3, seed=0) for _ in range(2))
    other = play(ocjax.load("Pong"), str(path), 2, seed=1)
    assert len(played.returns) == len(played.frames) == 3
    assert (np.abs(played.returns) <= 21).all()
    assert (played.frames > 2_000).all()
    assert np.array_equal(played.frames, again.frames)
    assert not np.array_equal(other.frames, played.frames[:2])
    assert played.settings == policy.settings


def test_a_game_has_all_of_its_lives():
    played = play(ocjax.load("Breakout"), "random", 2, seed=3)
    assert played.settings.episodic_life
    assert (played.frames > 400).all()  # a life takes a random player about 150 frames


@pytest.mark.parametrize("path", sorted(policies.SHIPPED.glob("*.npz")), ids=lambda path: path.stem)
def test_trained_policies(path):
    game = ocjax.load(path.stem)
    policy = policies.read(policies.find("trained", game), game)
    assert path.stat().st_size < 200_000
    assert policy.settings is not None
    assert policy.frames > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["Boxing", "Pong"])
def test_trained_policies_win(name):
    assert (play(ocjax.load(name), "trained", 2, seed=7).returns > 0).all()


def test_games_without_trained_policy(tmp_path, monkeypatch):
    (tmp_path / "Pong.npz").touch()
    monkeypatch.setattr(policies, "SHIPPED", tmp_path)
    with pytest.raises(
        PolicyError, match=r"no trained policy of Alien .* there are those of .*Pong"
    ):
        play(ocjax.load("Alien"), "trained", 1)


@pytest.mark.slow
def test_play_command(policy, tmp_path):
    path, table, gif = tmp_path / "policy.npz", tmp_path / "returns.csv", tmp_path / "game.gif"
    policy.write(path)
    arguments = [
        "play",
        "pong",
        "--policy",
        str(path),
        "--episodes",
        "2",
        "--csv",
        str(table),
        "--gif",
        str(gif),
    ]
    result = CliRunner().invoke(app, arguments, terminal_width=200)
    assert result.exit_code == 0, result.output
    with table.open() as file:
        rows = list(csv.DictReader(file))
    assert [row["episode"] for row in rows] == ["0", "1"]
    assert all(-21 <= float(row["return"]) <= 21 for row in rows)
    with Image.open(gif) as picture:
        assert getattr(picture, "n_frames", 1) > 100
    for arguments, message in (
        (
            ["play", "Pong", "--policy", "greedy"],
            "it must be random, repeat, idle, seldom, trained, or the path",
        ),
        (["play", "Pong", "--policy", str(DATA / "Pong.npz")], "no layer w0"),
        (["play", "Pong", "--gif", "x.png"], "must end in .gif"),
    ):
        result = CliRunner().invoke(app, arguments, terminal_width=200)
        assert result.exit_code == 2
        assert message in result.output
