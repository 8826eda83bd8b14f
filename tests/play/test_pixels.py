"""Policies on pixels."""

import numpy as np
import pytest
from typer.testing import CliRunner

import ocjax
from ocjax.cli.app import app
from ocjax.datasets import plans, playing
from ocjax.envs import AlePool, Dqn, settings
from ocjax.play import policies, rollouts, stepping
from ocjax.play.policies import PolicyError, SavedPolicy
from ocjax.ramtools.watch import Session
from tests.support.policies import changed

ACTIONS = 6  # of Pong
SHAPES = ((32, 4, 8, 8), (64, 32, 4, 4), (64, 64, 3, 3), (3136, 512), (512, ACTIONS))


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """The file of a policy with random weights."""
    rng = np.random.default_rng(0)
    layers = [
        (0.05 * rng.normal(size=shape), rng.normal(size=shape[0] if len(shape) == 4 else shape[1]))
        for shape in SHAPES
    ]
    path = tmp_path_factory.mktemp("pixels") / "policy.npz"
    known = {
        "settings": settings("dqn", clip_rewards=False),
        "preset": "dqn",
        "frames": 3,
        "sampled": True,
    }
    SavedPolicy(ocjax.load("Pong"), layers, Dqn(), network="nature_cnn", **known).write(path)
    return path


def test_a_policy_on_pixels_sees_what_environments_show(path):
    """A policy sees the environments' frames, through the ends of games, and so takes the same
    actions."""
    game, changes = (
        ocjax.load("Pong"),
        {"preset": "dqn", "max_episode_frames": 120, "num_workers": 0},
    )
    policy = policies.read(path, game)
    envs = ocjax.make_vec("Pong", 3, mode="raw", obs="dqn", **changes)
    pool = AlePool(
        game, 3, settings("dqn", max_episode_frames=120), screens=policy.screens, num_workers=0
    )
    act, rng = policy.playing(3, seed=4), np.random.default_rng(4)
    obs, _ = envs.reset(seed=0)
    pool.reset([0, 1, 2])
    distinct = set()
    for _ in range(80):
        actions = policy.choose(obs, rng)
        distinct |= set(actions.tolist())
        assert np.array_equal(actions, act(stepping.seen(pool)))
        obs, *_ = envs.step(actions)
        pool.step(actions)
    assert len(distinct) > 1
    envs.close()
    pool.close()


def test_everything_that_plays_saved_policies_plays_those_on_pixels(path):
    game = ocjax.load("Pong")
    tape = rollouts.rollout(game, 8, policy=str(path), num_envs=2, whole_games=False)
    assert tape.settings == settings("dqn", clip_rewards=False).to_dict()
    session = Session(game, str(path), seed=1)
    for _ in range(5):
        session.frame()


def test_datasets_of_a_policy_on_pixels(path):
    pytest.importorskip("pyarrow", reason="the extra `data` is not installed")
    game = ocjax.load("Pong")
    plan = plans.plan(game, 20, seeds=(0,), policies={"random": 50, str(path): 50})
    sequences = [part for parts in playing.play(game, plan, plan.shards[0]) for part in parts]
    assert sum(len(part["index"]) for part in sequences) == 20


@pytest.mark.slow
def test_play_command(path):
    result = CliRunner().invoke(
        app, ["play", "pong", "--policy", str(path), "--episodes", "1"], terminal_width=200
    )
    assert result.exit_code == 0, result.output


def test_other_policies_need_no_screens():
    assert (
        policies.needs("random", ocjax.load("Pong")).screens
        == policies.needs("trained", ocjax.load("Pong")).screens
        == ()
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"w0": np.zeros((32, 1, 8, 8))}, r"w0 \[32, 4, 8, 8\]"),
        ({"w1": np.zeros((64, 32, 4))}, r"w1 \[64, 32, 4, 4\]"),
        ({"b2": np.zeros(1)}, r"b2 \[64\]"),
        ({"w3": np.zeros((3137, 512))}, r"w3 \[3136, n\]"),
        ({"w3": np.zeros((3136, 0)), "b3": np.zeros(0)}, r"w3 \[3136, n\]"),
        ({"w3": np.zeros(())}, r"w3 \[3136, n\]"),
        ({"w4": np.zeros((512, 5)), "b4": np.zeros(5)}, "must have 6 outputs"),
        ({"w0": None}, "no layer w0"),
        ({"w1": None}, "w1"),
        ({"w3": None}, "w3"),
        ({"mean": np.zeros(3)}, "mean must be absent"),
        (
            {"network": "resnet"},
            "network must be one of mlp, relu_mlp, deep_sets, shared, nature_cnn, got 'resnet'",
        ),
        ({"network": ["mlp"]}, "network must be one of"),
        ({"network": "mlp"}, "KeyError"),
        ({"settings": 3}, "description of the policy is damaged"),
    ],
)
def test_files_that_are_no_policies(path, tmp_path, change, message):
    changed(path, tmp_path / "p.npz", change)
    with pytest.raises(PolicyError, match=message):
        policies.make_policy(str(tmp_path / "p.npz"), ocjax.load("Pong"), ACTIONS, 1, 0)
