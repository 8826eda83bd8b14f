"""Environments for Stable-Baselines3; skipped unless the extra `sb3` is installed."""

import re

import numpy as np
import pytest

pytest.importorskip("stable_baselines3", reason="the extra `sb3` is not installed")

import torch
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecCheckNan, VecFrameStack, VecMonitor, VecNormalize

import ocjax
from ocjax import sb3
from tests.support.states import ROOT

SHORT = {
    "num_workers": 1,
    "repeat_action_probability": 0.0,
    "max_episode_frames": 120,
    "noop_max": 0,
}


@pytest.fixture
def envs():
    envs = sb3.make_vec_env("Pong", 3, seed=5, **SHORT)
    yield envs
    envs.close()


def test_steps_are_those_of_the_vector_environment(envs):
    """Observations, rewards, ends, terminal observations and infos are the same as in ocjax's
    environments with disabled autoreset."""
    plain = ocjax.make_vec("Pong", 3, obs="vector", autoreset_mode="Disabled", **SHORT)
    got, (want, _) = envs.reset(), plain.reset(seed=5)
    rng, episodes = np.random.default_rng(0), 0
    for _ in range(70):
        assert np.array_equal(got, want)
        actions = rng.integers(6, size=3)
        got, reward, done, infos = envs.step(actions)
        want, want_reward, terminated, truncated, info = plain.step(actions)
        assert reward.dtype == np.float32
        assert np.array_equal(reward, want_reward)
        assert np.array_equal(done, terminated | truncated)
        for i in range(3):
            assert all(
                infos[i][name] == info[name][i]
                for name in ("lives", "frame_number", "episode_return", "episode_length")
            )
            assert infos[i]["TimeLimit.truncated"] == (truncated[i] and not terminated[i])
            assert ("terminal_observation" in infos[i]) == done[i] == ("episode" in infos[i])
            if done[i]:
                episodes += 1
                assert np.array_equal(infos[i]["terminal_observation"], want[i])
                assert (infos[i]["episode"]["r"], infos[i]["episode"]["l"]) == (
                    info["episode_return"][i],
                    info["episode_length"][i],
                )
        if done.any():
            want, _ = plain.reset(options={"reset_mask": done})
    assert episodes == 6
    plain.close()


def test_lives_end_episodes_but_not_games():
    envs = sb3.make_vec_env("Breakout", 2, seed=0, preset="dqn", num_workers=1)
    envs.reset()
    lives, games = [], []
    for t in range(400):
        _, _, done, infos = envs.step(np.full(2, 2 + t % 2))
        lives += [info["lives"] for info, d in zip(infos, done, strict=True) if d]
        games += [info["lives"] for info in infos if "episode" in info]
    assert len(lives) > len(games) > 0
    assert set(games) == {0}
    envs.close()


def test_seeds_and_attributes(envs):
    first = envs.reset()
    second = envs.reset()
    envs.seed(5)
    assert envs.seed(5) == [5, 6, 7]
    assert np.array_equal(envs.reset(), first)
    assert second.shape == first.shape
    envs.step_async(np.zeros(3, int))
    envs.reset()  # takes the place of the pending step
    assert envs.get_attr("render_mode") == [None] * 3
    assert envs.get_attr("action_space", 1) == [envs.action_space]
    assert [o.category for o in envs.env_method("views", indices=2)[0]][:2] == ["Player", "Ball"]
    (found,) = envs.get_attr("objects", [2])
    assert found.to_list() == envs.envs.objects[2].to_list()
    assert envs.env_method("get_action_meanings", indices=0)[0][0] == "NOOP"
    assert np.array_equal(envs.env_method("get_ram")[1], envs.envs.get_ram()[1])
    assert envs.has_attr("features")
    assert not envs.has_attr("nothing")
    with pytest.raises(AttributeError, match="cannot set 'frame_skip'"):
        envs.set_attr("frame_skip", 2)


def test_misuse():
    with pytest.raises(TypeError, match="no option autoreset_mode"):
        sb3.make_vec_env("Pong", autoreset_mode="NextStep")
    envs = ocjax.make_vec("Pong", 1, num_workers=0)
    with pytest.raises(ValueError, match="requires same-step autoreset, got NextStep"):
        sb3.ObjectVecEnv(envs)
    envs.close()
    envs = sb3.make_vec_env("Pong", num_workers=0)
    envs.set_options({"mode": 1})
    with pytest.raises(ValueError, match="resets have none"):
        envs.reset()
    envs.close()


def test_rendering():
    envs = sb3.make_vec_env("Pong", 2, num_workers=0, render_mode="rgb_array")
    envs.reset()
    assert envs.render().shape == (420, 160, 3)
    envs.close()


def test_ppo_learns_and_is_evaluated(envs):
    model = PPO("MlpPolicy", envs, n_steps=64, batch_size=64, n_epochs=1, device="cpu", seed=1)
    before = [p.detach().clone() for p in model.policy.parameters()]
    model.learn(192 * 2)
    assert model.num_timesteps == 384
    assert any(
        not torch.equal(a, b) for a, b in zip(before, model.policy.parameters(), strict=True)
    )
    assert len(model.ep_info_buffer) > 0
    returns, lengths = evaluate_policy(model, envs, 3, return_episode_rewards=True)
    assert lengths == [30] * 3
    assert all(r == round(r) for r in returns)


def test_dqn_on_truncated_episodes(envs):
    model = DQN("MlpPolicy", envs, buffer_size=300, learning_starts=60, train_freq=8, device="cpu")
    model.learn(300)
    assert model.replay_buffer.timeouts.any()


@pytest.mark.filterwarnings("ignore:The environment is already wrapped")
def test_wrappers(envs):
    wrapped = VecCheckNan(VecFrameStack(VecNormalize(VecMonitor(envs)), 2), raise_exception=True)
    assert wrapped.reset().shape == (3, 2 * envs.observation_space.shape[0])
    ends = []
    for _ in range(35):
        _, _, _, infos = wrapped.step(np.zeros(3, int))
        ends += [info["episode"]["l"] for info in infos if "episode" in info]
    assert ends == [30] * 3


def test_dict_and_image_observations():
    envs = sb3.make_vec_env("Pong", 2, num_workers=0, obs="objects", hud=False)
    PPO("MultiInputPolicy", envs, n_steps=16, batch_size=16, n_epochs=1, device="cpu").learn(32)
    envs.close()
    envs = sb3.make_vec_env("Pong", 2, num_workers=0, obs="dqn", mode="raw")
    model = PPO("CnnPolicy", envs, n_steps=16, batch_size=16, n_epochs=1, device="cpu")
    assert model.get_env() is envs  # channels come first, so nothing is transposed
    model.learn(32)
    envs.close()


@pytest.mark.parametrize("page", ["README.md", "docs/neighbours.md"])
def test_code_of_pages(page):
    """The code that needs Stable-Baselines3, with fewer steps."""
    text = (ROOT / page).read_text()
    (block,) = re.findall(r"^```py\n(.*?)^```$", text, re.DOTALL | re.MULTILINE)
    names = {"ocjax": ocjax}
    exec(
        block.replace('device="cpu"', 'device="cpu", n_steps=32')
        .replace("1_000_000", "64")
        .replace("16", "2"),
        names,
    )
    if "envs" in names:
        names["envs"].close()
