"""gymnax's own wrappers, and a training loop in the style of PureJaxRL, on the real ROM."""

import functools
import importlib.util

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from ocjax import jaxatari

if importlib.util.find_spec("gymnax") is None:
    pytest.skip("gymnax is not installed", allow_module_level=True)

import gymnax
from flax import linen
from gymnax.environments import spaces
from gymnax.wrappers import compat, dm_env, gym, purerl

pytestmark = pytest.mark.filterwarnings("default")  # warnings of other projects
KEY = jax.random.key(0)
ENVS, STEPS, UPDATES = 4, 8, 2


@pytest.fixture(autouse=True)
def their_promotion():
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield


@pytest.fixture
def env():
    return jaxatari.GymnaxEnvironment("Pong", frame_skip=4)


def public(kind):
    return {name for name in vars(kind) if not name.startswith("_")}


def test_interface(env):
    """Every public name of gymnax's base class that its wrappers and users call."""
    hooks = {
        "step_env",
        "reset_env",
        "observe",
        "get_obs",
        "is_truncated",
        "is_terminal",
        "is_terminated",
        "discount",
    }
    gradients = {
        "supports_transition_gradients",
        "transition_gradients_enabled",
        "with_transition_gradients",
    }
    assert not {
        name
        for name in public(gymnax.environments.environment.Environment) - hooks - gradients
        if not hasattr(env, name)
    }
    own, _ = gymnax.make("Catch-bsuite")
    _, state = own.reset(KEY)
    theirs = own.step(KEY, state, 0)
    _, state = env.reset(KEY)
    ours = env.step(KEY, state, 0)
    assert len(ours) == len(theirs)
    assert [a.dtype for a in ours[3:5]] == [a.dtype for a in theirs[3:5]]
    assert {"terminated", "truncated", "final_observation"} <= ours[5].keys() & theirs[5].keys()


def test_spaces(env):
    observation, state = env.reset(KEY, env.default_params)
    space = env.observation_space(env.default_params)
    assert isinstance(space, spaces.Box)
    assert (space.shape, space.dtype) == (observation.shape, observation.dtype)
    assert space.contains(observation)
    assert env.action_space(env.default_params).n == 6
    assert env.state_space(env.default_params).contains(state)


def test_wrappers(env):
    """The wrappers work in a scan over a batch, as in gymnax's examples."""
    wrapped = purerl.LogWrapper(
        purerl.FlattenObservationWrapper(purerl.StickyActionWrapper(env, 0.25))
    )
    params = env.default_params.replace(max_steps_in_episode=5)
    _, state = jax.vmap(wrapped.reset, in_axes=(0, None))(jax.random.split(KEY, ENVS), params)

    def step(state, key):
        actions = jax.random.randint(key, (ENVS,), 0, 6)
        _, state, _, _, truncated, info = jax.vmap(wrapped.step, in_axes=(0, 0, 0, None))(
            jax.random.split(key, ENVS), state, actions, params
        )
        return state, (truncated, info["returned_episode"], info["returned_episode_lengths"])

    _, (truncated, ended, lengths) = jax.lax.scan(step, state, jax.random.split(KEY, 12))
    assert np.array_equal(np.flatnonzero(truncated.all(axis=1)), [4, 9])
    assert np.array_equal(truncated, ended)
    assert (lengths[4:] == 5).all()


def test_gymnasium(env):
    single = gym.GymnaxToGymWrapper(env)
    observation, _ = single.reset(seed=1)
    assert single.observation_space.contains(np.asarray(observation))
    assert len(single.step(single.action_space.sample())) == 5
    batch = gym.GymnaxToVectorGymWrapper(env, num_envs=ENVS)
    observations, _ = batch.reset(seed=1)
    assert batch.observation_space.contains(np.asarray(observations))
    observations, *_ = batch.step(batch.action_space.sample())
    assert batch.observation_space.contains(np.asarray(observations))


def test_dm_env(env):
    wrapped = dm_env.GymnaxToDmEnvWrapper(env)
    first = wrapped.reset(KEY, env.default_params)
    second = wrapped.step(KEY, first, 0, env.default_params)
    assert jax.tree.map(jnp.shape, second) == jax.tree.map(jnp.shape, first)
    assert second.discount == 1


class ActorCritic(linen.Module):
    """The network of PureJaxRL."""

    actions: int

    @linen.compact
    def __call__(self, x):
        x = linen.tanh(linen.Dense(16)(x / 160))
        return linen.Dense(self.actions)(x), linen.Dense(1)(x)[..., 0]


def train(env, params, key):
    """Advantage actor-critic in one compiled program, with the structure of PureJaxRL's
    `make_train`.

    Returns the weights before and after, and the infos of all steps.
    """
    env = compat.LegacyStepAPIWrapper(purerl.LogWrapper(purerl.FlattenObservationWrapper(env)))
    network = ActorCritic(env.action_space(params).n)
    weights = network.init(key, jnp.zeros(env.observation_space(params).shape))
    observation, state = jax.vmap(env.reset, in_axes=(0, None))(jax.random.split(key, ENVS), params)

    def env_step(runner, key):
        weights, state, observation = runner
        logits, value = network.apply(weights, observation)
        action = jax.random.categorical(key, logits)
        step = jax.vmap(env.step, in_axes=(0, 0, 0, None))
        following, state, reward, done, info = step(
            jax.random.split(key, ENVS), state, action, params
        )
        return (weights, state, following), (observation, action, reward, done, value, info)

    def loss(weights, batch):
        observation, action, reward, *_ = batch
        logits, value = network.apply(weights, observation)
        chosen = jnp.take_along_axis(jax.nn.log_softmax(logits), action[..., None], -1)[..., 0]
        return jnp.mean((value - reward) ** 2 - chosen * (reward - jax.lax.stop_gradient(value)))

    def update(runner, key):
        runner, batch = jax.lax.scan(env_step, runner, jax.random.split(key, STEPS))
        gradient = jax.grad(loss)(runner[0], batch)
        weights = jax.tree.map(lambda w, g: w - 1e-3 * g, runner[0], gradient)
        return (weights, *runner[1:]), batch[-1]

    (trained, *_), info = jax.lax.scan(
        update, (weights, state, observation), jax.random.split(key, UPDATES)
    )
    return weights, trained, info


def test_purejaxrl(env):
    before, after, info = jax.jit(functools.partial(train, env, env.default_params))(KEY)
    assert any(
        (a != b).any() for a, b in zip(jax.tree.leaves(before), jax.tree.leaves(after), strict=True)
    )
    assert info["returned_episode"].shape == (UPDATES, STEPS, ENVS)
