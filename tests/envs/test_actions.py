"""Actions: continuous ones as in ale-py, and the keys of discrete ones."""

import os
import subprocess
import sys
import textwrap
from contextlib import closing

import ale_py
import gymnasium
import numpy as np
import pytest

import ocjax
from ocjax.envs import make
from tests.support.marks import slow_but

gymnasium.register_envs(ale_py)


def polar(rng, space, n):
    """Random actions, including the thresholds and the bounds."""
    actions = np.array([space.sample() for _ in range(n)])
    actions[::7, 0] = rng.choice(np.float32([0, 0.5, 1]), len(actions[::7]))
    actions[::5, 1] = rng.choice(
        space.high[1] * np.float32([-1, -0.5, 0, 0.5, 1]), len(actions[::5])
    )
    return actions


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("Pong", {}),  # paddles
        ("Alien", {"continuous_action_threshold": 0.3}),
        *slow_but(
            [],
            [
                ("Breakout", {"continuous_action_threshold": 0.1}),
                ("Seaquest", {"repeat_action_probability": 0.0}),
            ],
        ),
    ],
)
def test_continuous_actions_are_those_of_ale_py(name, options):
    """ale-py gives equal RAM, rewards and ends at each step, for single and vector environments."""
    reference = gymnasium.make(f"ALE/{name}-v5", obs_type="ram", continuous=True, **options)
    env = gymnasium.make(f"ocjax/{name}-v5", mode="raw", continuous=True, **options)
    envs = ocjax.make_vec(
        name, 2, mode="raw", continuous=True, autoreset_mode="Disabled", num_workers=1, **options
    )
    assert env.action_space == reference.action_space == envs.single_action_space
    assert envs.action_space.shape == (2, 3)
    env.action_space.seed(0)
    want, got, both = reference.reset(seed=3)[0], env.reset(seed=3)[0], envs.reset(seed=[1, 3])[0]
    assert np.array_equal(got, want)
    for action in polar(np.random.default_rng(0), env.action_space, 400):
        want, *result, _ = reference.step(action)
        got, *same, _ = env.step(action)
        both, *vector, _ = envs.step(np.stack([env.action_space.sample(), action]))
        assert np.array_equal(got, want)
        assert np.array_equal(both[1], want)
        assert result == same == [array[1].item() for array in vector]
        if any(result[1:]):
            break
    for one in (reference, env, envs):
        one.close()


def test_continuous_states_and_specs_continue():
    envs = ocjax.make_vec(
        "Breakout", 2, mode="raw", continuous=True, num_workers=0, repeat_action_probability=0.7
    )
    envs.reset(seed=0)
    envs.action_space.seed(0)
    actions = [envs.action_space.sample() for _ in range(40)]
    for some in actions[:20]:
        envs.step(some)
    state, want = envs.clone_state(), [envs.step(some)[0] for some in actions[20:]]
    with closing(gymnasium.make_vec(envs.spec)) as other:
        assert other.action_space == envs.action_space
        other.reset(seed=5)
        other.unwrapped.restore_state(state)
        assert all(
            np.array_equal(other.step(some)[0], expected)
            for some, expected in zip(actions[20:], want, strict=True)
        )
    envs.close()


def test_rewards_are_functions_of_continuous_actions():
    options = {"continuous": True, "num_workers": 0}
    with closing(
        ocjax.make_vec("Pong", 2, reward_fn=lambda before, after, action: action[0], **options)
    ) as envs:
        envs.reset(seed=0)
        assert np.allclose(envs.step(np.float32([[0.25, 0, 0], [1, 0, 0]]))[1], [0.25, 1])


def test_wrong_continuous_actions_are_refused():
    with closing(ocjax.make_vec("Pong", 2, mode="raw", continuous=True, num_workers=0)) as envs:
        ram = envs.reset(seed=0)[0]
        for wrong, message in (
            (
                np.zeros(2, int),
                r"actions must be floats of shape \(2, 3\), got int64 of shape \(2,\)",
            ),
            (np.zeros((2, 3), int), "actions must be floats"),
            (np.zeros((3, 3)), "actions must be floats"),
            (np.full((2, 3), np.nan), "actions must be from"),
            (np.full((2, 3), 1.5), "actions must be from"),
            (np.full((2, 3), -0.5), "actions must be from"),
        ):
            with pytest.raises(ValueError, match=message):
                envs.step(wrong)
        assert np.array_equal(envs.get_ram(), ram)
    with closing(make("Pong", mode="raw", continuous=True)) as env:
        env.reset(seed=0)
        with pytest.raises(ValueError, match="actions must be floats"):
            env.step(3)
    for options, message in (
        ({"continuous": 1}, "continuous must be True or False, got 1"),
        (
            {"continuous_action_threshold": 2},
            "continuous_action_threshold must be a number from 0 to 1, got 2",
        ),
        (
            {"continuous_action_threshold": "0.5"},
            "continuous_action_threshold must be a number from 0 to 1, got '0.5'",
        ),
    ):
        with pytest.raises(ValueError, match=message):
            ocjax.make_vec("Pong", 1, **options)


@pytest.mark.parametrize("options", [{}, {"full_action_space": True}])
@pytest.mark.parametrize("name", ["Pong", "Seaquest", "Freeway"])
def test_keys_are_those_of_ale_py(name, options):
    with (
        closing(make(name, mode="raw", **options)) as env,
        closing(gymnasium.make(f"ALE/{name}-v5", **options)) as reference,
    ):
        assert env.get_keys_to_action() == reference.unwrapped.get_keys_to_action()
        assert env.get_action_meanings() == reference.unwrapped.get_action_meanings()
    with (
        closing(make(name, mode="raw", continuous=True)) as env,
        pytest.raises(AttributeError, match="continuous actions have no keys"),
    ):
        env.get_keys_to_action()


def test_gymnasium_plays_environments():
    """`gymnasium.utils.play` finds the keys through all wrappers.

    The key d is pressed, then the window is closed.
    """
    pytest.importorskip("pygame", reason="pygame is not installed")
    program = """
        import gymnasium, pygame, ocjax
        from gymnasium.utils.play import play

        actions = []

        def press(before, after, action, *rest):
            actions.append(action)
            if len(actions) == 3:
                pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=ord("d")))
            if len(actions) == 6:
                pygame.event.post(pygame.event.Event(pygame.QUIT))

        env = gymnasium.make("ocjax/Pong-v5", mode="raw", render_mode="rgb_array")
        play(env, callback=press, fps=1000, seed=0)
        print("actions", actions)
    """
    command = [sys.executable, "-W", "ignore", "-c", textwrap.dedent(program)]
    environment = {**os.environ, "SDL_VIDEODRIVER": "dummy", "SDL_AUDIODRIVER": "dummy"}
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=300, env=environment, check=True
    )
    assert done.stdout.splitlines()[-1] == "actions [0, 0, 0, 2, 2, 2]"
