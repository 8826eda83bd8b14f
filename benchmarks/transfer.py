"""Train a policy on JAXtari's own game, and test it there and on the real ROM.

    python benchmarks/transfer.py [GAME] [--frames 10000000] [--games 10] [--seed 0]

The real ROM runs through `ocjax.jaxatari`. The script needs `pip install jaxtari` and the extra
`rl`. GAME is Freeway (the default) or another game whose observations `ocjax.jaxatari` has in
JAXtari's layout. The policy sees the latest object observation and its change since the previous
step, through JAXtari's wrappers with their default settings, except that rewards are not clipped.
Training uses PPO with the default hyperparameters of `ocjax train`.
"""

import argparse
import importlib
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from rich.console import Console
from rich.progress import track
from rich.table import Table

import ocjax
from ocjax.agents import networks, ppo
from ocjax.agents.moments import standardized
from ocjax.evaluation.jaxtari import Jaxtari

FRAME_SKIP = 4  # of JAXtari's AtariWrapper
H = ppo.Hyperparameters()


def imitation(game: str) -> Any:
    """JAXtari's own environment."""
    return Jaxtari(ocjax.load(game)).environment


def wrapped(env: Any) -> Any:
    """The environment with frame skip, sticky actions, no-op starts and stacked observations.

    The observations are flat.
    """
    wrappers = importlib.import_module("jaxtari.wrappers")
    return wrappers.ObjectCentricWrapper(wrappers.AtariWrapper(env), clip_reward=False)


def features(stack: jax.Array) -> jax.Array:
    """The last of the stacked observations `[..., 4, n]` and its change, float32 `[..., 2n]`."""
    stack = stack.astype(jnp.float32)
    return jnp.concatenate([stack[..., -1, :], stack[..., -1, :] - stack[..., -2, :]], axis=-1)


def make_collect(env: Any, network: networks.Network) -> Callable[..., Any]:
    """The compiled function that plays a rollout in all environments."""

    def step(carry: Any, key: jax.Array) -> Any:
        learner, obs, state = carry
        x = features(obs)
        logits, _ = network.apply(learner.params, standardized(learner.inputs, x))
        action = jax.random.categorical(key, logits)
        log_prob = jnp.take_along_axis(jax.nn.log_softmax(logits), action[:, None], 1)[:, 0]
        obs, state, reward, terminated, truncated, _ = jax.vmap(env.step)(state, action)
        return (learner, obs, state), (
            x,
            action.astype(jnp.int32),
            log_prob,
            reward.astype(jnp.float32),
            terminated,
            truncated,
        )

    def collect(learner: ppo.Learner, obs: jax.Array, state: Any, key: jax.Array) -> Any:
        (_, obs, state), (x, *rest) = lax.scan(
            step, (learner, obs, state), jax.random.split(key, H.horizon)
        )
        observed = jnp.concatenate([x, features(obs)[None]])
        rollout = ppo.Rollout(observed, *rest, jnp.zeros_like(rest[-1]))  # pyright: ignore
        return obs, state, rollout

    return jax.jit(collect)


def train(game: str, frames: int, seed: int) -> tuple[networks.Network, ppo.Learner]:
    """PPO on JAXtari's game."""
    env = wrapped(imitation(game))
    obs, state = jax.jit(jax.vmap(env.reset))(jax.random.split(jax.random.key(seed), H.num_envs))
    num_inputs = features(obs).shape[-1]
    network = networks.mlp(num_inputs, int(env.action_space().n))
    learner, update = (
        ppo.init(network, H, num_inputs, seed),
        ppo.make_update(network, H, standardize=True),
    )
    collect = make_collect(env, network)
    key, total = jax.random.key(seed + 1), -(-frames // (H.num_envs * H.horizon * FRAME_SKIP))
    for i in track(range(total), f"Training on JAXtari's {game}"):
        obs, state, rollout = collect(learner, obs, state, jax.random.fold_in(key, i))
        learner, _ = update(learner, learner.inputs, rollout, jnp.float32(1 - i / total))
    return network, learner


def returns(
    env: Any, network: networks.Network, learner: ppo.Learner, games: int, seed: int
) -> list[float]:
    """The returns of some games with different initial states."""

    @jax.jit
    def act(key: jax.Array, obs: jax.Array) -> jax.Array:
        logits, _ = network.apply(learner.params, standardized(learner.inputs, features(obs)[None]))
        return jax.random.categorical(key, logits)[0]

    step, reset, out = jax.jit(env.step), jax.jit(env.reset), []
    for number in track(range(games), "Games"):
        key = jax.random.key(seed + 1000 + number)
        (obs, state), total, t, over = reset(key), 0.0, 0, False
        while not over:
            obs, state, reward, terminated, truncated, _ = step(
                state, act(jax.random.fold_in(key, t), obs)
            )
            total, t, over = total + float(reward), t + 1, bool(terminated | truncated)
        out.append(total)
    return out


def main() -> None:
    """Train, test, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("game", nargs="?", choices=ocjax.jaxatari.FIELDS, default="Freeway")
    parser.add_argument("--frames", type=int, default=10_000_000)
    parser.add_argument("--games", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    network, learner = train(args.game, args.frames, args.seed)
    table = Table(
        "game", "mean return", "standard deviation", title=f"{args.game}, {args.games} games each"
    )
    for name, env in (
        ("JAXtari", imitation(args.game)),
        ("real ROM", ocjax.jaxatari.Environment(args.game, noop_max=0)),
    ):
        got = returns(wrapped(env), network, learner, args.games, args.seed)
        table.add_row(name, f"{np.mean(got):.1f}", f"{np.std(got):.1f}")
    Console().print(table)


if __name__ == "__main__":
    main()
