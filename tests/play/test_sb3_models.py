"""Models of Stable-Baselines3 that ocjax plays; skipped unless PyTorch is installed."""

import io
import zipfile

import gymnasium
import numpy as np
import pytest
from typer.testing import CliRunner

import ocjax
from ocjax.cli.app import app
from ocjax.play import policies, rollouts
from ocjax.play.policies import PolicyError

torch = pytest.importorskip("torch", reason="PyTorch is not installed")

pytestmark = pytest.mark.filterwarnings("default")  # warnings of other projects
PONG, ACTIONS, HIDDEN = ocjax.load("Pong"), 6, 8
INPUTS = len(ocjax.envs.Vector().features_of(PONG))


def linear(name, n, m):
    rng = np.random.default_rng(n + m)
    return {
        f"{name}.weight": torch.tensor(rng.normal(size=(m, n)), dtype=torch.float32),
        f"{name}.bias": torch.zeros(m),
    }


def perceptron(inputs=INPUTS):
    """The tensors of PPO with MlpPolicy."""
    hidden = linear("mlp_extractor.policy_net.0", inputs, HIDDEN) | linear(
        "mlp_extractor.value_net.0", inputs, HIDDEN
    )
    return hidden | linear("action_net", HIDDEN, ACTIONS) | linear("value_net", HIDDEN, 1)


def write(path, state, *, member="policy.pth", compression=zipfile.ZIP_STORED):
    data = io.BytesIO()
    torch.save(state, data)
    with zipfile.ZipFile(path, "w", compression) as archive:
        archive.writestr("data", "{}")
        archive.writestr(member, data.getvalue())
    return path


@pytest.mark.parametrize("hud", [True, False])
def test_a_perceptron(tmp_path, hud):
    game = ocjax.load("Pong", hud=hud)
    inputs = len(ocjax.envs.Vector().features_of(game))
    state = perceptron(inputs)
    policy = policies.read(write(tmp_path / "model.zip", state), PONG)
    x = np.random.default_rng(0).normal(size=(5, inputs)).astype(np.float32)
    hidden = np.tanh(x @ state["mlp_extractor.policy_net.0.weight"].numpy().T)
    assert np.allclose(policy.logits(x), hidden @ state["action_net.weight"].numpy().T, atol=1e-5)
    assert policy.sampled
    assert policy.preset == "dqn"


def test_everything_that_plays_saved_policies_plays_models(tmp_path):
    path = write(tmp_path / "model.zip", perceptron())
    assert len(rollouts.rollout(PONG, 8, policy=str(path), num_envs=2, whole_games=False)) == 8
    options = [
        "--episodes",
        "1",
        "--preset",
        "v5",
        "--frame-skip",
        "10",
        "--repeat-action-probability",
        "0",
    ]
    result = CliRunner().invoke(
        app, ["play", "pong", "--policy", str(path), *options], terminal_width=200
    )
    assert result.exit_code == 0, result.output
    for wrong, message in (
        (["--preset", "v9"], "no preset 'v9'"),
        (["--repeat-action-probability", "2"], "must be in [0, 1)"),
    ):
        result = CliRunner().invoke(
            app, ["play", "pong", "--policy", str(path), *wrong], terminal_width=200
        )
        assert result.exit_code == 2
        assert message in result.output


class Harm:
    """An object with a pickle that runs code."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


def huge(name):
    """A tensor of a few bytes that claims to have many numbers."""
    return {name: torch.zeros(1).expand(2**40)}


PPO = perceptron()
BAD = {
    "harm": (lambda tmp: {"action_net.weight": Harm(tmp / "written")}, "not a readable model"),
    "list": (lambda tmp: [1, 2], "not a readable model"),
    "empty": (
        lambda tmp: {},
        "this kind of model is not supported; supported are PPO, A2C and DQN",
    ),
    "numbers": (lambda tmp: PPO | {"action_net.bias": 3}, "must hold named tensors"),
    "integers": (
        lambda tmp: PPO | {"action_net.bias": torch.zeros(ACTIONS, dtype=torch.int32)},
        "must hold named tensors",
    ),
    "sparse": (
        lambda tmp: PPO | {"action_net.bias": torch.zeros(ACTIONS).to_sparse()},
        "must hold named tensors",
    ),
    "huge": (lambda tmp: PPO | huge("action_net.bias"), "at most"),
    "nan": (
        lambda tmp: PPO | {"action_net.bias": torch.full((ACTIONS,), float("nan"))},
        "finite numbers",
    ),
    "recurrent": (
        lambda tmp: PPO | linear("lstm_actor.weight_ih_l0", 3, 3),
        "this kind of model is not supported",
    ),
    "continuous": (
        lambda tmp: PPO | {"log_std": torch.zeros(3)},
        "this kind of model is not supported",
    ),
    "no head": (
        lambda tmp: {k: v for k, v in PPO.items() if "action_net" not in k},
        "this kind of model is not supported",
    ),
    "other inputs": (
        lambda tmp: perceptron(7),
        rf'inputs of obs="vector" of Pong, {INPUTS} or, with hud=False, \d+, got 7',
    ),
    "other layer": (
        lambda tmp: PPO | linear("action_net", HIDDEN + 1, ACTIONS),
        rf"w1 \[{HIDDEN}, n\].*got \[{HIDDEN + 1}, {ACTIONS}\]",
    ),
    "other bias": (lambda tmp: PPO | {"action_net.bias": torch.zeros(5)}, r"b1 \[n\]"),
    "no bias": (lambda tmp: {k: v for k, v in PPO.items() if k != "action_net.bias"}, r"b1 \[n\]"),
    "vectors": (lambda tmp: PPO | {"mlp_extractor.policy_net.0.weight": torch.zeros(INPUTS)}, "w0"),
    "scalars": (lambda tmp: PPO | {"mlp_extractor.policy_net.0.weight": torch.zeros(())}, "inputs"),
    "other actions": (lambda tmp: PPO | linear("action_net", HIDDEN, 4), "must have 6 outputs"),
    "half a network": (
        lambda tmp: PPO | linear("features_extractor.cnn.0", 4, 4),
        "this kind of model is not supported",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_files_that_are_no_models(tmp_path, name):
    make, message = BAD[name]
    path = write(tmp_path / "model.zip", make(tmp_path))
    with pytest.raises(PolicyError, match=message) as caught:
        policies.make_policy(str(path), PONG, ACTIONS, 1, 0)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
    assert {p.name for p in tmp_path.iterdir()} == {"model.zip"}


def test_archives_that_are_no_models(tmp_path):
    path = tmp_path / "model.zip"
    zeros = b"\0" * 300_000_000
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("policy.pth", zeros)
    with pytest.raises(PolicyError, match="and at most"):
        policies.read(path, PONG)
    inner = io.BytesIO()
    with zipfile.ZipFile(inner, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("archive/data/0", zeros)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("policy.pth", inner.getvalue())
    with pytest.raises(PolicyError, match="is compressed"):
        policies.read(path, PONG)
    write(path, PPO, member="policy.optimizer.pth")
    with pytest.raises(PolicyError, match=r"it has no policy\.pth"):
        policies.read(path, PONG)
    for data in (b"", b"PK", b"no"):
        path.write_bytes(data)
        with pytest.raises(PolicyError, match="not a readable model"):
            policies.read(path, PONG)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("policy.pth", b"no")
    with pytest.raises(PolicyError, match="not a readable model"):
        policies.read(path, PONG)
    with pytest.raises(PolicyError, match="no regular file"):
        policies.read(tmp_path / "none.zip", PONG)


CNN = {"policy": "CnnPolicy", "mode": "raw", "obs": "dqn"}
MLP = {"policy": "MlpPolicy", "mode": "rem", "obs": "vector"}


@pytest.mark.parametrize(
    ("algorithm", "kind", "options"),
    [
        ("PPO", CNN, {"n_steps": 64, "n_epochs": 1}),
        ("PPO", MLP, {"n_steps": 64, "n_epochs": 1}),
        ("A2C", MLP, {}),
        ("DQN", CNN, {"buffer_size": 100, "learning_starts": 8}),
        ("DQN", MLP, {"buffer_size": 100, "learning_starts": 8}),
    ],
)
def test_models_of_stable_baselines3(tmp_path, algorithm, kind, options):
    """ocjax and Stable-Baselines3's own policy give the same numbers on the same observations."""
    sb3 = pytest.importorskip("stable_baselines3", reason="the extra `sb3` is not installed")
    env = gymnasium.make("ocjax/Pong-v5", mode=kind["mode"], obs=kind["obs"], preset="dqn")
    model = getattr(sb3, algorithm)(kind["policy"], env, device="cpu", seed=0, **options)
    model.learn(64)
    model.save(tmp_path / "model")
    policy = policies.read(tmp_path / "model.zip", PONG)
    obs, _ = env.reset(seed=1)
    observed = np.stack([obs, *(env.step(i % ACTIONS)[0] for i in range(20))])
    env.close()
    batch = model.policy.obs_to_tensor(observed)[0]
    with torch.no_grad():
        own = (
            model.q_net(batch)
            if algorithm == "DQN"
            else model.policy.get_distribution(batch).distribution.logits
        )
    expected, got = own.numpy(), policy.logits(observed)
    if algorithm != "DQN":  # logits are equal up to a constant
        expected, got = (a - a.mean(axis=1, keepdims=True) for a in (expected, got))
    assert np.allclose(got, expected, atol=1e-4)
    assert policy.sampled == (algorithm != "DQN")
    if algorithm == "DQN":
        actions, _ = model.predict(observed, deterministic=True)
        assert np.array_equal(policy.choose(observed, np.random.default_rng(0)), actions)
