"""The envpool backend; skipped unless the extra is installed."""

import jax
import numpy as np
import pytest
from gymnasium.error import AlreadyPendingCallError, NoAsyncCallError

import ocjax
from ocjax.envs import WorkerError

pytest.importorskip("envpool", reason="the extra `envpool` is not installed")

PLAIN = {"noop_max": 1, "repeat_action_probability": 0.0}  # envpool plays at least one no-op


def rows(tree, i):
    return jax.tree.map(lambda a: a[i], tree)


@pytest.mark.parametrize(
    "name",
    [
        "Breakout",
        *(pytest.param(name, marks=pytest.mark.slow) for name in ("MsPacman", "SpaceInvaders")),
    ],
)
def test_envpool_equals_the_ale_backend(name):
    """RAM, observations, rewards, ends and info of every step agree, across the ends of episodes
    and inside `lax.scan`."""
    options = {"obs": ["ram", "vector", "objects"], **PLAIN}
    a, b = ocjax.make_vec(name, 3, **options), ocjax.make_vec(name, 3, backend="envpool", **options)
    first = a.reset(seed=1), b.reset(seed=1)
    assert jax.tree.all(jax.tree.map(np.array_equal, first[0][0], first[1][0]))
    actions, ends = (
        np.random.default_rng(0).integers(a.single_action_space.n, size=(1300, 3)).astype(np.int32),
        0,
    )
    for some in actions[:1200]:
        (*left, info), (*right, other) = a.step(some), b.step(some)
        assert jax.tree.all(jax.tree.map(np.array_equal, left, right))
        for key in ("lives", "episode_return", "episode_length", "game_over"):
            assert np.array_equal(info[key], other[key]), key
        ends += (left[2] | left[3]).sum()
    assert ends >= 3
    state, step = b.xla()
    _, (observed, reward, terminated, truncated, info) = jax.jit(
        lambda s, x: jax.lax.scan(step, s, x)
    )(state, actions[1200:])
    for t, some in enumerate(actions[1200:]):
        *left, other = a.step(some)
        right = rows((observed, reward, terminated, truncated), t)
        assert jax.tree.all(jax.tree.map(np.allclose, left, list(right)))
        assert np.array_equal(info["lives"][t], other["lives"])
        assert np.array_equal(info["game_over"][t], other["game_over"])
        assert np.array_equal(info["ram"][t], left[0]["ram"])
    a.close()
    b.close()


def test_asynchronous_environments_keep_their_identity():
    """Asynchronous results, sorted by env_id, equal synchronous results, including the movement of
    objects."""
    options = {"obs": ["ram", "vector"], **PLAIN}
    a, b = (
        ocjax.make_vec("Pong", 5, **options),
        ocjax.make_vec("Pong", 5, backend="envpool", batch_size=2, **options),
    )
    actions = np.random.default_rng(0).integers(6, size=(200, 5))
    want = [[a.reset(seed=4)[0]]]
    for some in actions:
        want.append(list(a.step(some)))
    b.async_reset(seed=4)
    at = np.zeros(5, int)
    for _ in range(200):
        observed, reward, terminated, truncated, info = b.recv()
        for k, i in enumerate(info["env_id"]):
            expected = want[at[i]]
            assert jax.tree.all(
                jax.tree.map(np.array_equal, rows(observed, k), rows(expected[0], i))
            )
            if at[i]:
                assert (reward[k], terminated[k], truncated[k]) == tuple(
                    e[i] for e in expected[1:4]
                )
        b.send(actions[at[info["env_id"]], info["env_id"]], info["env_id"])
        at[info["env_id"]] += 1
    assert at.min() > 10
    assert {o.category for o in b.views(0)} <= {c.name for c in b.game.categories}
    with pytest.raises(ValueError, match="use async_reset, recv and send"):
        b.reset()
    a.close()
    b.close()


def test_vision_without_frame_skip():
    envs = ocjax.make_vec("Pong", 2, backend="envpool", mode="both", preset="noframeskip")
    envs.reset(seed=0)
    for _ in range(120):
        observed, *_ = envs.step(np.full(2, 2))
    assert observed["rem"]["valid"].any()
    assert np.array_equal(observed["rem"]["xywh"], observed["vem"]["xywh"])
    envs.close()


def test_wrong_calls_are_refused_and_change_nothing():
    """Without the check, envpool would crash or wait for ever."""
    envs = ocjax.make_vec(
        "Pong", 3, backend="envpool", obs=["ram", "vector"], batch_size=2, **PLAIN
    )
    with pytest.raises(ValueError, match=r"call reset\(\) before the first step"):
        envs.send(np.zeros(1, int), np.zeros(1, int))
    with pytest.raises(
        NoAsyncCallError, match="0 environments are stepping, and results come for 2 together"
    ):
        envs.recv()
    with pytest.raises(ValueError, match=r"a seed below 2\*\*31 for every environment"):
        envs.async_reset(seed=2**31)
    envs.async_reset(seed=4)
    with pytest.raises(AlreadyPendingCallError, match="a step or a reset is pending"):
        envs.async_reset()
    *_, info = envs.recv()
    ids = info["env_id"]
    (busy,) = set(range(3)) - set(ids.tolist())
    for env_id in (
        ids + 3,
        -1 - ids,
        ids[[0, 0]],
        ids.astype(float),
        ids[:, None],
        ids[:0],
        ids.astype(int) + 10**12,
        "all",
    ):
        with pytest.raises(ValueError, match="env_id must be distinct integers from 0 to 2"):
            envs.send(np.zeros(2, int), env_id)
    for actions in (
        np.zeros(3, int),
        np.zeros(2),
        np.full(2, 6),
        np.full(2, -1),
        np.zeros((2, 1), int),
        0,
    ):
        with pytest.raises(ValueError, match="actions must be"):
            envs.send(actions, ids)
    with pytest.raises(
        AlreadyPendingCallError, match=rf"a step of environments \[{busy}\] is pending"
    ):
        envs.send(np.zeros(1, int), np.array([busy]))
    with pytest.raises(NoAsyncCallError, match="1 environments are stepping"):
        envs.recv()
    envs.send(np.zeros(2, np.int64), ids)
    assert len(envs.recv()[-1]["env_id"]) == 2
    envs.close()
    for refused in (lambda: envs.send(np.zeros(2, int), ids), envs.recv, envs.async_reset):
        with pytest.raises(WorkerError, match="the environments are closed"):
            refused()


def test_the_order_of_calls_is_checked():
    envs = ocjax.make_vec("Pong", 2, backend="envpool", obs=["ram", "vector"], **PLAIN)
    envs.reset(seed=1)
    with pytest.raises(NoAsyncCallError, match=r"call step_async\(\)"):
        envs.step_wait()
    envs.step_async(np.zeros(2, int))
    for refused in (
        lambda: envs.step_async(np.zeros(2, int)),
        envs.reset,
        lambda: envs.step(np.zeros(2, int)),
    ):
        with pytest.raises(AlreadyPendingCallError, match="a step is pending"):
            refused()
    assert (envs.step_wait()[-1]["episode_length"] == 1).all()
    for wrong in (np.zeros(3, int), np.full(2, 6)):
        with pytest.raises(ValueError, match="actions must be"):
            envs.step(wrong)
    assert (envs.step(np.zeros(2, int))[-1]["episode_length"] == 2).all()
    envs.close()
    with pytest.raises(WorkerError, match="the environments are closed"):
        envs.step(np.zeros(2, int))


@pytest.mark.parametrize("name", ["recv", "send"])
def test_an_interrupted_step_asks_for_a_reset(name, monkeypatch):
    envs = ocjax.make_vec("Pong", 2, backend="envpool", obs=["ram", "vector"], **PLAIN)
    first, _ = envs.reset(seed=1)

    def interrupt(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr(envs.pool.env, name, interrupt)
    with pytest.raises(KeyboardInterrupt):
        envs.step(np.zeros(2, int))
    with pytest.raises(
        ValueError,
        match=r"call reset\(\) before the first step, and after a call that was interrupted",
    ):
        envs.step(np.zeros(2, int))
    again, _ = envs.reset(seed=1)
    assert jax.tree.all(jax.tree.map(np.array_equal, first, again))
    assert (envs.step(np.zeros(2, int))[-1]["episode_length"] == 1).all()
    envs.close()


def test_unsupported_options_are_refused():
    for kwargs, reason in (
        ({"mode": "vem"}, "the brighter of two frames"),
        ({"obs": "dqn"}, "no grey frames"),
        ({"hook": print}, "cannot write RAM"),
        ({"autoreset_mode": "SameStep"}, "next-step autoreset only"),
        ({"preset": "v4"}, "no random frame skip"),
        ({"game_mode": [0, 1]}, "one game_mode for all"),
        ({"render_mode": "rgb_array"}, "cannot be rendered"),
    ):
        with pytest.raises(ValueError, match=reason):
            ocjax.make_vec("Pong", 2, backend="envpool", **kwargs)
    with pytest.raises(ValueError, match="crops screens to 210 rows, Carnival has 214"):
        ocjax.make_vec("Carnival", 2, backend="envpool", mode="vem", frame_skip=1)
    with pytest.raises(ValueError, match="batch_size must be 1 to num_envs 2"):
        ocjax.make_vec("Pong", 2, backend="envpool", batch_size=3)
    envs = ocjax.make_vec("Pong", 2, backend="envpool")
    with pytest.raises(ValueError, match="have not been reset"):
        envs.xla()
    envs.reset(seed=0)
    for call, reason in (
        (lambda: envs.reset(seed=1), "takes seeds when it starts"),
        (
            lambda: envs.reset(options={"reset_mask": np.array([True, False])}),
            "all environments or none",
        ),
        (lambda: envs.clone_state(), "no access to states"),
        (lambda: envs.set_ram(np.zeros(128, np.uint8)), "no access to RAM"),
    ):
        with pytest.raises(ValueError, match=reason):
            call()
    envs.close()
