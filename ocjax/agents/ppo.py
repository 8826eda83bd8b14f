"""Proximal Policy Optimization (Schulman et al., 2017) as pure, jit-compiled functions.

`T` is the number of steps of a rollout, `B` the number of environments, and `D` the shape of an
observation.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jax import lax

from ocjax._xla.kernels import on_cpu
from ocjax.agents.config import Hyperparameters
from ocjax.agents.moments import Moments, initial_moments, merge_moments, scaled, standardized
from ocjax.agents.networks import Network, Params

MAX_REWARD = 10.0  # limit of scaled rewards
# The matrices are small, and threads compete with the emulators: training in Seaquest takes 12 %
# longer (`benchmarks/training.py`).
CPU_OPTIONS = {"xla_cpu_multi_thread_eigen": False}


class Rollout(NamedTuple):
    """T steps of B environments."""

    obs: np.ndarray  # [T + 1, B, *D]
    action: np.ndarray  # int32 [T, B]
    log_prob: np.ndarray  # float32 [T, B], of the action at its choice
    reward: np.ndarray  # float32 [T, B]
    terminated: np.ndarray  # bool [T, B]
    truncated: np.ndarray  # bool [T, B]
    resets: np.ndarray  # bool [T, B]: the step only began a new episode, whatever its action


class Learner(NamedTuple):
    """The state that an update changes."""

    params: Params
    optimizer: optax.OptState
    inputs: Moments  # of observations; not used for frames
    returns: Moments  # of discounted sums of rewards
    discounted: jax.Array  # float32 [B], the current sums
    key: jax.Array  # uint32, key data


class Losses(NamedTuple):
    """Averages over an update, float32 scalars."""

    policy: jax.Array
    value: jax.Array
    entropy: jax.Array
    kl: jax.Array  # approximate divergence from the policy that acted
    clipped: jax.Array  # fraction of samples with a clipped probability ratio
    explained_variance: jax.Array  # of the returns, by the values before the update


NO_LOSSES = Losses(*[jnp.float32(float("nan"))] * len(Losses._fields))  # before the first update


def _compiler_options() -> dict[str, bool] | None:
    return CPU_OPTIONS if on_cpu() else None


def _optimizer(h: Hyperparameters) -> optax.GradientTransformation:
    adam = optax.inject_hyperparams(optax.adam)(learning_rate=h.learning_rate, eps=1e-5)
    return optax.chain(optax.clip_by_global_norm(h.max_grad_norm), adam)


def init(network: Network, h: Hyperparameters, num_inputs: int, seed: int) -> Learner:
    """The learner before training."""
    key, own = jax.random.split(jax.random.key(seed))
    params = network.init(own)
    moments = initial_moments((num_inputs,)), initial_moments(())
    return Learner(
        params,
        _optimizer(h).init(params),
        *moments,
        jnp.zeros(h.num_envs, jnp.float32),
        jax.random.key_data(key),
    )


def advantages(
    reward: jax.Array,
    value: jax.Array,
    terminated: jax.Array,
    ended: jax.Array,
    gamma: float,
    decay: float,
) -> jax.Array:
    """Generalised advantage estimation (Schulman et al., 2016), float32 `[T, B]`.

    The end of a truncated episode is worth the value of its last observation, the end of a
    terminated one 0.

    Args:
        reward: float32 `[T, B]`.
        value: float32 `[T + 1, B]`, of the observations before each step and after the last one.
        terminated: bool `[T, B]`.
        ended: bool `[T, B]`, terminated or truncated.
        gamma: discount factor.
        decay: lambda.
    """
    following = jnp.where(terminated, jnp.float32(0), value[1:])
    delta = reward + gamma * following - value[:-1]

    def back(later: jax.Array, step: tuple[jax.Array, jax.Array]) -> tuple[jax.Array, jax.Array]:
        difference, over = step
        advantage = difference + gamma * decay * jnp.where(over, jnp.float32(0), later)
        return advantage, advantage

    return lax.scan(back, jnp.zeros_like(delta[0]), (delta, ended), reverse=True)[1]


def compressed(reward: jax.Array) -> jax.Array:
    """sign(r) log(1 + |r|) (Hester et al., 2018), float32.

    Rewards of one game can differ by orders of magnitude: in Skiing, each step gives -7 points, and
    the last one down to -10,000. An agent would learn to delay the end of the game.
    """
    return jnp.sign(reward) * jnp.log1p(jnp.abs(reward))


def _scaled_rewards(
    learner: Learner, rollout: Rollout, gamma: float
) -> tuple[jax.Array, Moments, jax.Array]:
    """Compressed rewards in units of the standard deviation of their discounted sums.

    Also returns the moments and the current values of these sums.
    """

    def add(total: jax.Array, step: tuple[jax.Array, ...]) -> tuple[jax.Array, jax.Array]:
        reward, over = step
        total = gamma * total + reward
        return jnp.where(over, jnp.float32(0), total), total

    over = jnp.asarray(rollout.terminated | rollout.truncated)
    reward = compressed(jnp.asarray(rollout.reward))
    discounted, totals = lax.scan(add, learner.discounted, (reward, over))
    moments = merge_moments(learner.returns, totals.reshape(-1))
    return jnp.clip(scaled(moments, reward), -MAX_REWARD, MAX_REWARD), moments, discounted


class _Samples(NamedTuple):
    obs: jax.Array
    action: jax.Array
    log_prob: jax.Array
    advantage: jax.Array
    target: jax.Array  # of the value
    weight: jax.Array  # float32: 0 for steps that only began an episode, else 1


def _mean(x: jax.Array, weight: jax.Array) -> jax.Array:
    return jnp.sum(x * weight) / jnp.maximum(jnp.sum(weight), 1)


def _loss(
    params: Params, network: Network, h: Hyperparameters, left: jax.Array, s: _Samples
) -> tuple[jax.Array, Losses]:
    """The clipped surrogate objective with value loss and entropy bonus.

    `left` is the remaining fraction of the training.
    """
    clip, bonus = h.clip * left, h.entropy_coefficient * left
    logits, value = network.apply(params, s.obs)
    log_probs = jax.nn.log_softmax(logits)
    log_ratio = jnp.take_along_axis(log_probs, s.action[:, None], axis=1)[:, 0] - s.log_prob
    ratio = jnp.exp(log_ratio)
    center = _mean(s.advantage, s.weight)
    spread = jnp.sqrt(_mean((s.advantage - center) ** 2, s.weight)) + 1e-8
    advantage = (s.advantage - center) / spread
    gain = jnp.minimum(ratio * advantage, jnp.clip(ratio, 1 - clip, 1 + clip) * advantage)
    policy = -_mean(gain, s.weight)
    error = _mean((value - s.target) ** 2, s.weight) / 2
    entropy = _mean(-jnp.sum(jnp.exp(log_probs) * log_probs, axis=1), s.weight)
    kl = _mean(ratio - 1 - log_ratio, s.weight)
    clipped = _mean((jnp.abs(ratio - 1) > clip).astype(jnp.float32), s.weight)
    total = policy + h.value_coefficient * error - bonus * entropy
    return total, Losses(policy, error, entropy, kl, clipped, jnp.float32(0))


def make_act(network: Network, *, standardize: bool) -> Callable[..., tuple[jax.Array, jax.Array]]:
    """The compiled function that chooses actions.

    Returns:
        A function of parameters, moments of inputs, observations `[B, *D]`, the data of a key and
        the number of the step. It returns actions, int32 `[B]`, and log probabilities, float32
        `[B]`.
    """

    def act(
        params: Params, inputs: Moments, obs: jax.Array, key: jax.Array, step: jax.Array
    ) -> tuple[jax.Array, jax.Array]:
        logits, _ = network.apply(params, standardized(inputs, obs) if standardize else obs)
        own = jax.random.fold_in(jax.random.wrap_key_data(key), step)
        action = jax.random.categorical(own, logits)
        log_prob = jnp.take_along_axis(jax.nn.log_softmax(logits), action[:, None], axis=1)[:, 0]
        return action, log_prob

    return jax.jit(act, compiler_options=_compiler_options())


def make_update(
    network: Network, h: Hyperparameters, *, standardize: bool
) -> Callable[..., tuple[Learner, Losses]]:
    """The compiled update.

    Returns:
        A function of the learner, the moments of inputs at the choice of the actions, the rollout
        and the remaining fraction of the training. It returns the new learner and the losses.
    """
    optimizer = _optimizer(h)

    def samples(
        learner: Learner, inputs: Moments, rollout: Rollout
    ) -> tuple[_Samples, Learner, jax.Array]:
        obs = standardized(inputs, rollout.obs) if standardize else jnp.asarray(rollout.obs)
        value = lax.map(lambda x: network.apply(learner.params, x)[1], obs)
        reward, returns, discounted = _scaled_rewards(learner, rollout, h.gamma)
        ended = jnp.asarray(rollout.terminated | rollout.truncated)
        advantage = advantages(
            reward, value, jnp.asarray(rollout.terminated), ended, h.gamma, h.gae_lambda
        )
        target = advantage + value[:-1]
        weight = 1 - jnp.asarray(rollout.resets).astype(jnp.float32)
        residual = _mean((target - value[:-1]) ** 2, weight)
        spread = _mean((target - _mean(target, weight)) ** 2, weight)
        fields = (
            obs[:-1],
            jnp.asarray(rollout.action),
            jnp.asarray(rollout.log_prob),
            advantage,
            target,
            weight,
        )
        flat = _Samples(*(f.reshape(-1, *f.shape[2:]) for f in fields))
        seen = (
            merge_moments(learner.inputs, rollout.obs[:-1].reshape(-1, *rollout.obs.shape[2:]))
            if standardize
            else learner.inputs
        )
        return (
            flat,
            learner._replace(inputs=seen, returns=returns, discounted=discounted),
            1 - residual / jnp.maximum(spread, 1e-8),
        )

    def update(
        learner: Learner, inputs: Moments, rollout: Rollout, left: jax.Array
    ) -> tuple[Learner, Losses]:
        all_samples, learner, explained = samples(learner, inputs, rollout)
        n = h.num_envs * h.horizon
        key, own = jax.random.split(jax.random.wrap_key_data(learner.key))

        def step(state: tuple[Params, Any], index: jax.Array) -> tuple[tuple[Params, Any], Losses]:
            params, opt = state
            batch = jax.tree.map(lambda a: a[index], all_samples)
            gradient, losses = jax.grad(_loss, has_aux=True)(params, network, h, left, batch)
            opt[1].hyperparams["learning_rate"] = h.learning_rate * left
            with jax.numpy_dtype_promotion("standard"):  # optax mixes dtypes
                change, opt = optimizer.update(gradient, opt, params)
                params = optax.apply_updates(params, change)
            return (params, opt), losses  # pyright: ignore[reportReturnType]

        orders = jax.vmap(lambda k: jax.random.permutation(k, n))(jax.random.split(own, h.epochs))
        (params, opt), losses = lax.scan(
            step, (learner.params, learner.optimizer), orders.reshape(-1, h.minibatch)
        )
        learner = learner._replace(params=params, optimizer=opt, key=jax.random.key_data(key))
        return learner, jax.tree.map(jnp.mean, losses)._replace(explained_variance=explained)

    return jax.jit(update, compiler_options=_compiler_options())
