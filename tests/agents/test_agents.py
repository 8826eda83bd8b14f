"""Training; skipped unless the extra `rl` is installed."""

import csv
import dataclasses
import os
import shutil
import subprocess
import sys
from collections import Counter

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

import ocjax
from ocjax.cli.app import app
from ocjax.play import policies
from ocjax.play.games import play

pytest.importorskip("optax", reason="the extra `rl` is not installed")
pytest.importorskip("orbax.checkpoint", reason="the extra `rl` is not installed")

from ocjax.agents import moments as statistics
from ocjax.agents import networks, ppo
from ocjax.agents.collector import Collector
from ocjax.agents.metrics import Metrics
from ocjax.agents.ppo import Hyperparameters, Rollout
from ocjax.agents.training import Config, Trainer, TrainingError
from ocjax.envs import make_vec
from tests.support.marks import slow_but
from tests.support.states import ROOT

pytestmark = pytest.mark.filterwarnings("default")  # warnings of other projects
TINY = Hyperparameters(num_envs=4, horizon=16, minibatch=32, epochs=2)
TINY_OPTIONS = ["--num-envs", "4", "--horizon", "16", "--minibatch", "32", "--epochs", "2"]
UPDATE = TINY.num_envs * TINY.horizon * 4  # emulated frames
QUIET = Console(quiet=True)


def test_advantages():
    """The advantages equal the sum over later steps in the definition, through terminated and
    truncated episodes."""
    rng, (t, b), gamma, decay = np.random.default_rng(0), (9, 40), 0.9, 0.8
    reward, value = rng.normal(size=(t, b)), rng.normal(size=(t + 1, b))
    terminated = rng.random((t, b)) < 0.15
    ended = terminated | (rng.random((t, b)) < 0.15)
    want = np.zeros((t, b))
    for j in range(b):
        for i in range(t):
            weight = 1.0
            for k in range(i, t):
                want[i, j] += weight * (
                    reward[k, j] + gamma * value[k + 1, j] * (not terminated[k, j]) - value[k, j]
                )
                if ended[k, j]:
                    break
                weight *= gamma * decay
    reward, value, terminated, ended = (
        jnp.asarray(a) for a in (np.float32(reward), np.float32(value), terminated, ended)
    )
    got = ppo.advantages(reward, value, terminated, ended, gamma, decay)
    assert np.allclose(got, want, atol=1e-5)


def test_moments():
    rng = np.random.default_rng(0)
    parts = [rng.normal(3, 2, (n, 5)).astype(np.float32) for n in (7, 1, 300)]
    moments = statistics.initial_moments((5,))
    for part in parts:
        moments = statistics.merge_moments(moments, part)
    everything = np.concatenate(parts)
    assert np.allclose(moments.mean, everything.mean(0), atol=1e-4)
    assert np.allclose(moments.variance, everything.var(0), rtol=1e-3)
    standard = np.asarray(statistics.standardized(moments, everything[None]))[0]
    assert np.allclose(standard.std(0), 1, atol=1e-3)


def bandit(rng, h, resets=None):
    """A rollout that rewards action 1."""
    shape = h.horizon, h.num_envs
    action = rng.integers(3, size=shape).astype(np.int32)
    no = np.zeros(shape, bool)
    reward = (action == 1).astype(np.float32)
    return Rollout(
        rng.normal(size=(h.horizon + 1, h.num_envs, 4)).astype(np.float32),
        action,
        np.full(shape, -np.log(3), np.float32),
        reward,
        ~no,
        no,
        no if resets is None else resets,
    )


@pytest.fixture(scope="module")
def learner():
    network, fast = networks.mlp(4, 3), dataclasses.replace(TINY, learning_rate=5e-3)
    update = ppo.make_update(network, fast, standardize=True)
    return network, update, ppo.init(network, fast, 4, 0)


def test_rewards_are_compressed():
    got = ppo.compressed(jnp.asarray([-10_000, -7, 0, 1, 7], jnp.float32))
    assert np.allclose(got, [-np.log(10_001), -np.log(8), 0, np.log(2), np.log(8)])


def test_updates_prefer_what_is_rewarded(learner):
    network, update, state = learner
    rng, fixed = np.random.default_rng(0), statistics.initial_moments((4,))
    losses = ppo.NO_LOSSES
    for _ in range(12):
        state, losses = update(state, fixed, bandit(rng, TINY), jnp.float32(1))
    probabilities = jax.nn.softmax(
        network.apply(state.params, jnp.asarray(rng.normal(size=(50, 4)), jnp.float32))[0]
    )
    assert np.asarray(probabilities).mean(0)[1] > 0.5
    assert all(np.isfinite(v) for v in losses)
    assert float(state.inputs.total) == 12 * TINY.num_envs * TINY.horizon


def test_nothing_is_learned_from_steps_that_only_begin_an_episode(learner):
    """The actions and rewards of these steps have no effect on the parameters. No step has an
    effect after the end of the training."""
    _, update, state = learner
    fixed = statistics.initial_moments((4,))
    resets = np.random.default_rng(1).random((TINY.horizon, TINY.num_envs)) < 0.3
    a = bandit(np.random.default_rng(2), TINY, resets)
    b = a._replace(action=np.where(resets, 2 - a.action, a.action))
    one, other = (update(state, fixed, r, jnp.float32(1))[0].params for r in (a, b))
    assert all(
        np.array_equal(p, q)
        for p, q in zip(jax.tree.leaves(one), jax.tree.leaves(other), strict=True)
    )
    still = update(state, fixed, a, jnp.float32(0))[0].params
    assert all(
        np.array_equal(p, q)
        for p, q in zip(jax.tree.leaves(still), jax.tree.leaves(state.params), strict=True)
    )


@pytest.mark.parametrize("drawn", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_convolutional_network(drawn):
    network = networks.nature_cnn(4, 6)
    if drawn:
        params = network.init(jax.random.key(0))
    else:  # drawing orthogonal matrices takes seconds
        params = jax.tree.map(
            lambda p: jnp.zeros(p.shape, p.dtype), jax.eval_shape(network.init, jax.random.key(0))
        )
    logits, value = network.apply(params, jnp.zeros((2, 4, 84, 84), jnp.uint8))
    assert logits.shape == (2, 6)
    assert value.shape == (2,)
    assert (
        sum(p.size for p in jax.tree.leaves(params)) == 1_687_719
    )  # 1,684,128 up to the dense layer, 7 * 513 in the heads


@pytest.mark.parametrize("change", [{"num_envs": 5}, {"minibatch": 100}, {"clip": 0.0}])
def test_hyperparameters(change):
    with pytest.raises(ValueError, match=next(iter(change))):
        Hyperparameters(**change)


def metrics(folder):
    """The rows of the file without the columns of time."""
    with (folder / "metrics.csv").open() as file:
        return [
            {k: v for k, v in row.items() if k != "seconds" and not k.endswith("_share")}
            for row in csv.DictReader(file)
        ]


def test_games_do_not_stay_in_step():
    """Each of the first rollouts restarts one environment, in either half, and the log omits games
    that were cut short."""
    halves = [
        make_vec("Pong", 2, mode="rem", obs="vector", preset="dqn", num_workers=0) for _ in range(2)
    ]
    collector = Collector(*halves, horizon=16, seed=0)
    for _ in range(6):
        rollout = collector.collect(
            lambda obs, step: (np.zeros(len(obs), np.int32), np.zeros(len(obs), np.float32))
        )
        assert collector.games == []
        assert not rollout.resets.any()
    lengths = np.concatenate([envs.pool.arrays.episode_length for envs in halves])
    assert lengths.tolist() == [96, 80, 64, 48]
    collector.close()


def games_by_their_successors(monkeypatch, envs):
    """A list of the last return of each game. A game is complete when the number of its steps
    returns to 0."""
    found, last, step_wait = [], np.zeros(envs.num_envs), envs.step_wait

    def wait():
        nonlocal last
        result = step_wait()
        info = result[-1]
        found.extend(last[envs.pool.started & (info["episode_length"] == 0)].tolist())
        last = info["episode_return"]
        return result

    monkeypatch.setattr(envs, "step_wait", wait)
    return found


@pytest.mark.parametrize(
    "options", slow_but([{}], [{}, {"max_episode_steps": 40}, {"max_episode_frames": 300}]), ids=str
)
def test_returns_of_complete_games(monkeypatch, options):
    """With an episode per life and next-step autoreset, the log reports each game once, with its
    complete return, and no single life."""
    halves = [
        make_vec(
            "Breakout", 3, mode="raw", preset="dqn", num_workers=0, clip_rewards=False, **options
        )
        for _ in range(2)
    ]
    found = [games_by_their_successors(monkeypatch, envs) for envs in halves]
    rng, reported, lives = np.random.default_rng(0), [], 0
    collector = Collector(*halves, horizon=20, seed=0)
    for _ in range(30):
        rollout = collector.collect(
            lambda obs, step: (rng.integers(4, size=len(obs)), np.zeros(len(obs), np.float32))
        )
        reported += collector.games
        lives += int((rollout.terminated | rollout.truncated).sum())
    over = sum(int(envs.pool.game_over.sum()) for envs in halves)  # the next game has not begun
    collector.close()
    want = [*found[0], *found[1]]
    assert len(reported) == len(want) + over
    assert not (Counter(want) - Counter(reported))
    assert len(reported) > 10
    assert any(reported)
    assert options or lives > 2 * len(reported)


def parameters(trainer):
    return [np.asarray(p) for p in jax.tree.leaves(trainer._pending.result().learner)]


CHILD = """
import os, sys
from pathlib import Path
from rich.console import Console
from ocjax.agents import training
from tests.agents.test_agents import TINY, UPDATE
training.CHECKPOINT_SECONDS = 0
save = training.Trainer._save
def save_then_die(self):
    save(self)
    if self.updates == 3:
        os._exit(9)  # as if killed
training.Trainer._save = save_then_die
trainer = training.Trainer(training.Config("Pong", 3, hyperparameters=TINY), Path(sys.argv[1]))
trainer.run(6 * UPDATE, Console(quiet=True))
"""


@pytest.mark.slow
def test_a_killed_training_goes_on_to_the_same_numbers(tmp_path):
    config = Config("Pong", 3, hyperparameters=TINY)
    whole = Trainer(config, tmp_path / "whole")
    whole.run(6 * UPDATE, QUIET)
    run = subprocess.run(
        [sys.executable, "-c", CHILD, str(tmp_path / "killed")],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        check=False,
        capture_output=True,
    )
    assert run.returncode == 9, run.stderr[-2000:]
    resumed = Trainer(config, tmp_path / "killed")
    assert resumed.updates == 3
    resumed.run(6 * UPDATE, QUIET)
    assert all(
        np.array_equal(a, b) for a, b in zip(parameters(whole), parameters(resumed), strict=True)
    )
    assert metrics(tmp_path / "whole") == metrics(tmp_path / "killed")
    assert len(metrics(tmp_path / "whole")) == 6
    for trainer in (whole, resumed):
        trainer.close()


@pytest.mark.slow
def test_more_frames_continue_a_training(tmp_path):
    config = Config("Pong", 0, hyperparameters=TINY)
    first = Trainer(config, tmp_path / "run")
    first.run(2 * UPDATE, QUIET)
    first.close()
    second = Trainer(config, tmp_path / "run")
    second.run(3 * UPDATE, QUIET)
    assert second.frames == 3 * UPDATE
    assert [int(row["frames"]) for row in metrics(tmp_path / "run")] == [
        UPDATE,
        2 * UPDATE,
        3 * UPDATE,
    ]
    saved = policies.read(tmp_path / "run" / "policy.npz", ocjax.load("Pong"))
    assert saved.frames == 3 * UPDATE
    assert saved.settings == second.policy().settings
    inputs = len(config.vector.features_of(second.game))
    features = np.random.default_rng(0).uniform(0, 1, (3, inputs)).astype(np.float32)
    assert np.allclose(saved.logits(features), second.policy().logits(features), atol=0.01)
    second.close()
    with pytest.raises(TrainingError, match="holds another training"):
        Trainer(Config("Pong", 1, hyperparameters=TINY), tmp_path / "run")
    path = tmp_path / "run" / "metrics.csv"
    text = path.read_text()
    path.write_text(text[: text.index("\n") + 1])
    with pytest.raises(TrainingError, match=r"metrics.csv has 0 rows, but the checkpoint needs \d"):
        Trainer(config, tmp_path / "run")
    path.write_text(text)
    for damaged in (tmp_path / "run" / "checkpoints").rglob("*METADATA"):
        damaged.write_text("{")
    with pytest.raises(
        TrainingError,
        match=r"the checkpoint checkpoints/\d+ .* is damaged.*Restore the folder from a copy",
    ):
        Trainer(config, tmp_path / "run")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "file").touch()
    with pytest.raises(TrainingError, match="is not empty"):
        Trainer(config, tmp_path / "other")


@pytest.mark.slow
def test_training_from_pixels(tmp_path, monkeypatch):
    """The written policy plays, and sees the observations of environments."""
    h = Hyperparameters(num_envs=2, horizon=8, minibatch=16, epochs=1)
    trainer = Trainer(Config("Pong", 0, "pixels", hyperparameters=h), tmp_path / "run")
    trainer.run(2 * 2 * 8 * 4, QUIET)
    assert trainer.updates == 2
    assert len(metrics(tmp_path / "run")) == 2
    params = jax.tree.map(
        lambda p: jnp.asarray(np.float16(p), jnp.float32), trainer._pending.result().learner.params
    )
    trainer.close()
    path, seen = tmp_path / "run" / "policy.npz", []
    assert path.stat().st_size < 4_000_000
    choose = policies.SavedPolicy.choose

    def noted(self, observed, rng):
        actions = choose(self, observed, rng)
        seen.append((observed, self.logits(observed), actions))
        return actions

    monkeypatch.setattr(policies.SavedPolicy, "choose", noted)
    played = play(ocjax.load("Pong"), str(path), 1, seed=5)
    assert len(played.returns) == 1
    envs = make_vec("Pong", 1, mode="raw", obs="dqn", preset="dqn", num_workers=0)
    network = networks.nature_cnn(4, envs.single_action_space.n)
    obs, _ = envs.reset(seed=5)
    for observed, logits, actions in seen[:200]:
        assert np.array_equal(obs, observed)
        assert np.allclose(network.apply(params, jnp.asarray(obs))[0], logits, rtol=1e-5, atol=1e-6)
        obs, *_ = envs.step(actions)
    envs.close()


@pytest.mark.slow
def test_train_command(tmp_path, monkeypatch):
    folder = tmp_path / "run"
    arguments = ["train", "pong", "--frames", "1", "--seed", "2", "--out", str(folder)]
    monkeypatch.setattr("ocjax.cli.train.EPISODES", 1)
    result = CliRunner().invoke(app, arguments, terminal_width=200)
    assert result.exit_code == 0, result.output
    assert {"config.json", "metrics.csv", "policy.npz", "agent.gif"} <= {
        p.name for p in folder.iterdir()
    }
    assert list((folder / "tensorboard").iterdir())
    again = CliRunner().invoke(app, arguments, terminal_width=200)
    assert again.exit_code == 0, again.output
    assert "has been trained for" in again.output
    wrong = CliRunner().invoke(app, ["train", "Pong", "--inputs", "ram"], terminal_width=200)
    assert wrong.exit_code == 2
    assert "objects or pixels" in wrong.output


@pytest.mark.parametrize(
    "entry",
    [
        "config.json",
        "metrics.csv",
        "policy.npz",
        "agent.gif",
        "tensorboard",
        "checkpoints",
        "checkpoints/5",
    ],
)
def test_links_in_a_training(tmp_path, entry):
    outside, run = tmp_path / "outside", tmp_path / "run"
    outside.mkdir()
    (outside / "file").write_text("own")
    config = Config("Pong", 0, hyperparameters=TINY)
    (run / entry).parent.mkdir(parents=True)
    (run / "config.json").write_text(config.to_json())
    (run / entry).unlink(missing_ok=True)
    (run / entry).symlink_to(outside if "." not in entry else outside / "file")
    with pytest.raises(
        TrainingError,
        match=rf"a training must consist of files and folders, but .*{entry} is a link",
    ):
        Trainer(config, run)
    assert {path.name: path.read_text() for path in outside.iterdir()} == {"file": "own"}


FULL = """
import resource, sys
from pathlib import Path
from ocjax.agents import checkpoints, training
from ocjax.cli.app import app
folder, stage = Path(sys.argv[1]), sys.argv[2]
training.CHECKPOINT_SECONDS = 0
LIMITS = {"metrics": 100, "policy": 2_000, "space": 100_000, "Orbax": 20_000}
def on_a_full_disk(work):
    def method(self, *args):
        if self.updates == 3:
            resource.setrlimit(resource.RLIMIT_FSIZE, (LIMITS[stage], resource.RLIM_INFINITY))
        work(self, *args)
    return method
name = "_note" if stage == "metrics" else "_save"
setattr(training.Trainer, name, on_a_full_disk(getattr(training.Trainer, name)))
if stage == "Orbax":
    checkpoints.Checkpoints._try_space = lambda self, size: None
app(["train", "Pong", "--frames", "2048", "--out", str(folder), *sys.argv[3:]])
"""


@pytest.mark.parametrize("stage", slow_but(["space"], ["metrics", "policy", "space", "Orbax"]))
def test_a_full_disk(tmp_path, stage):
    """A limit on the size of files simulates the full disk: a write beyond it raises an OSError,
    too."""
    folder = tmp_path / "run"
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(folder), stage, *TINY_OPTIONS],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        check=False,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 2, done.stderr[-2000:]
    errors = [line for line in done.stderr.splitlines() if line.startswith("Error: ")]
    assert len(errors) == 1
    assert f"{folder}: the training cannot be saved after {3 * UPDATE} frames: " in errors[0]
    assert f"run the same command again: it continues after {2 * UPDATE} frames" in errors[0]
    if stage != "Orbax":
        ours = [line for line in done.stderr.splitlines() if "cpu_aot_loader" not in line]  # XLA's
        assert ours == errors
        assert "File too large" in errors[0]
        assert [path.name for path in (folder / "checkpoints").iterdir()] == ["2"]
    resumed = Trainer(Config("Pong", 0, hyperparameters=TINY), folder)
    assert resumed.updates == 2
    assert [path.name for path in (folder / "checkpoints").iterdir()] == ["2"]
    resumed.run(4 * UPDATE, QUIET)
    resumed.close()
    assert [path.name for path in (folder / "checkpoints").iterdir()] == ["4"]
    assert len(metrics(folder)) == 4
    assert policies.read(folder / "policy.npz", ocjax.load("Pong")).frames == 4 * UPDATE


def test_a_file_instead_of_checkpoints(tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "config.json").write_text(Config("Pong", 0, hyperparameters=TINY).to_json())
    (tmp_path / "run" / "checkpoints").write_text("a file")
    with pytest.raises(
        TrainingError, match=r"run: the folder checkpoints is damaged, .*FileExistsError"
    ):
        Trainer(Config("Pong", 0, hyperparameters=TINY), tmp_path / "run")


WRONG = [
    ...,
    0,
    -3,
    10**12,
    10**40,
    "two",
    "2",
    2.5,
    float("nan"),
    float("inf"),
    None,
    True,
    [[]],
    {"a": []},
]


@pytest.mark.parametrize("value", WRONG, ids=str)
@pytest.mark.parametrize("name", ["rows", "seconds", "recent", "one of recent"])
def test_progress_of_a_training(tmp_path, name, value):
    """Impossible counts, times and returns raise errors, and the file of metrics stays the same."""
    text = "frames,return\n256,nan\n512,-20.0\n"
    (tmp_path / "metrics.csv").write_text(text)
    progress = {"rows": 2, "seconds": 1.5, "recent": [-20.0, 3]}
    if name == "one of recent":
        progress["recent"] = [1.0, None if value is ... else value]
    else:
        progress = {k: v for k, v in progress.items() if k != name} | (
            {} if value is ... else {name: value}
        )
    kept = Metrics(tmp_path)
    right = (
        name in ("seconds", "one of recent") and value in (0, 2.5, 10**12) and value is not True
    ) or (name == "one of recent" and value == -3)
    if right and not isinstance(value, bool):
        kept.restore(progress, 2)
        assert kept.save() == progress
    else:
        with pytest.raises((ValueError, KeyError)):
            kept.restore(progress, 2)
    assert (tmp_path / "metrics.csv").read_text() == text


@pytest.mark.parametrize(
    "text",
    [
        "",
        "frames,return\n",
        "frames,return\n1,2\n",
        "frames\n1\n2\n",
        "frames,frames\n1,2\n3,4\n",
        "frames,return,frames\n1,2,3\n3,4,5\n",
        "frames,return\n1,2,3\n4,5\n",
        "frames,return\n1\n4,5\n",
        "frames,return\n1,two\n4,5\n",
        "frames,return\n,\n4,5\n",
        "\0\0\n1,2\n1,2\n",
        "frames,return\n" + "9" * 200_000 + ",2\n1,2\n",
    ],
)
def test_metrics_of_a_training(tmp_path, text):
    (tmp_path / "metrics.csv").write_text(text)
    with pytest.raises((ValueError, csv.Error)):
        Metrics(tmp_path).restore({"rows": 2, "seconds": 1.5, "recent": []}, 2)


def test_environments_of_a_training():
    halves = [
        make_vec("Pong", 2, mode="rem", obs="vector", preset="dqn", num_workers=0) for _ in range(2)
    ]
    collector = Collector(*halves, horizon=4, seed=0)
    collector.collect(
        lambda obs, step: (np.zeros(len(obs), np.int32), np.zeros(len(obs), np.float32))
    )
    saved = collector.save()
    wrong = [
        (name, value)
        for name, values in {
            "steps": (-8, 7, "8", 8.0, float("nan"), None, [8], 2**40),
            "halves": ([], saved["halves"][:1], saved["halves"] * 2),
            "states": (np.zeros(0, np.uint8), np.zeros(1000, np.uint8), "text", None),
            "ended": (np.zeros(2), np.zeros(3, bool), np.zeros((), bool), "no", None),
        }.items()
        for value in values
    ]
    for name, value in wrong:
        change = (
            {name: value}
            if name in saved
            else {"halves": [saved["halves"][0], saved["halves"][1] | {name: value}]}
        )
        with pytest.raises((ValueError, TypeError)):
            collector.restore(saved | change, 1)
    collector.restore(saved, 1)
    assert collector.steps == 8
    collector.close()


def test_strange_entries_among_checkpoints(tmp_path):
    """Unfinished checkpoints are deleted, a damaged one raises an error, and other entries raise an
    error or stay."""
    config, run = Config("Pong", 0, hyperparameters=TINY), tmp_path / "run"
    first = Trainer(config, run)
    first.run(UPDATE, QUIET)
    first.close()
    folder = run / "checkpoints"
    shutil.copytree(folder / "1", folder / "2.orbax-checkpoint-tmp")
    (folder / "2.orbax-checkpoint-tmp-123").mkdir()
    (folder / "3.orbax-checkpoint-tmp").write_text("a file")
    (folder / ".DS_Store").write_text("a file")
    (folder / "notes").mkdir()
    again = Trainer(config, run)
    assert again.updates == 1
    again.close()
    assert {path.name for path in folder.iterdir()} == {"1", ".DS_Store", "notes"}
    (folder / "7").mkdir()
    with pytest.raises(
        TrainingError, match=r"the checkpoint checkpoints/7 or metrics.csv is damaged"
    ):
        Trainer(config, run)
    (folder / "7").rmdir()
    (folder / "1").rename(folder / ("9" * 12))
    with pytest.raises(
        TrainingError, match=r"the number of updates must be an integer of at least 999,999,999,999"
    ):
        Trainer(config, run)


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{", "[" * 100_000, "\udcff"],
    ids=["empty", "list", "brace", "deep", "bytes"],
)
def test_configurations_of_a_training(tmp_path, text):
    (tmp_path / "config.json").write_text(text, errors="surrogateescape")
    with pytest.raises(TrainingError, match=r"config\.json is damaged: "):
        Trainer(Config("Pong", 0, hyperparameters=TINY), tmp_path)
