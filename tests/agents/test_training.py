"""Training code of other projects on the environments; skipped unless the extra `sb3` is
installed."""

import os
import subprocess
import sys

import gymnasium
import numpy as np
import pytest

import ocjax  # registers its environments with Gymnasium

torch = pytest.importorskip("torch", reason="the extra `sb3` is not installed")
sb3 = pytest.importorskip("stable_baselines3", reason="the extra `sb3` is not installed")


def check_learning(model, steps):
    """The training takes that many steps, changes the policy, and keeps finite numbers."""
    before = [p.detach().clone() for p in model.policy.parameters()]
    model.learn(steps)
    assert model.num_timesteps == steps
    after = list(model.policy.parameters())
    assert any(not torch.equal(a, b) for a, b in zip(before, after, strict=True))
    assert all(torch.isfinite(p).all() for p in after)


def test_stable_baselines3_on_vectors():
    from stable_baselines3.common.env_util import make_vec_env

    envs = make_vec_env(
        "ocjax/Pong-v5", n_envs=2, seed=0, env_kwargs={"obs": "vector", "hud": False}
    )
    model = sb3.PPO("MlpPolicy", envs, n_steps=256, batch_size=64, n_epochs=1, device="cpu")
    check_learning(model, 2_048)
    envs.close()


def test_stable_baselines3_on_objects():
    """The default observation, a Dict of object fields."""
    env = gymnasium.make("ocjax/Freeway-v5")
    model = sb3.PPO("MultiInputPolicy", env, n_steps=256, batch_size=64, n_epochs=1, device="cpu")
    check_learning(model, 512)
    env.close()


@pytest.mark.filterwarnings("default")  # warnings of other projects
def test_stable_baselines3_with_its_atari_wrapper():
    """Stable-Baselines3's wrappers use the emulator to add no-ops, frame skip, lives, FIRE and grey
    frames."""
    pytest.importorskip("cv2", reason="Stable-Baselines3's Atari wrapper needs OpenCV")
    from stable_baselines3.common.env_util import make_atari_env

    envs = make_atari_env(
        "ocjax/Breakout-v5", n_envs=2, seed=0, env_kwargs={"obs": "pixels", "preset": "noframeskip"}
    )
    model = sb3.PPO("CnnPolicy", envs, n_steps=64, batch_size=64, n_epochs=1, device="cpu")
    check_learning(model, 256)
    envs.close()


def test_torch_shares_the_tensors():
    envs = ocjax.make_vec("Pong", 3)
    envs.reset(seed=0)
    assert np.array_equal(torch.from_dlpack(envs.objects.xywh).numpy(), envs.objects.xywh)
    envs.close()


def test_cleanrl(request, tmp_path):
    """CleanRL's ppo.py runs with another call to make the environments, and no further change."""
    checkout = request.config.getoption("--cleanrl")
    if checkout is None:
        pytest.skip(
            "needs --cleanrl with the path of a checkout, as CleanRL's scripts are not in a package"
        )
    text = (checkout / "cleanrl" / "ppo.py").read_text()
    start = text.index("    envs = gym.vector.SyncVectorEnv(")
    end = text.index("    assert isinstance(envs.single_action_space")
    made = (
        "    import ocjax; envs = ocjax.make_vec('Pong', args.num_envs, obs='vector', hud=False)\n"
    )
    (tmp_path / "ppo.py").write_text(text[:start] + made + text[end:])
    command = [
        sys.executable,
        "ppo.py",
        "--total-timesteps",
        "4096",
        "--num-envs",
        "8",
        "--no-cuda",
    ]
    path = os.pathsep.join([os.getcwd(), os.environ.get("PYTHONPATH", "")])  # noqa: PTH109
    run = subprocess.run(
        command,
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": path},
    )
    assert run.returncode == 0, run.stderr
    assert "SPS:" in run.stdout
