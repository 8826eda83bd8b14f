"""The states of a shard: instances that play side by side, each with its own policy."""

import contextlib
import itertools
from collections.abc import Iterator

import numpy as np

from ocjax.datasets.plans import ENVS, Plan, Shard
from ocjax.emulators.ram_starts import variation
from ocjax.envs import AlePool, Settings
from ocjax.extraction.game import Game
from ocjax.play.policies import Policy, make_policy
from ocjax.play.stepping import steps

Stretch = dict[str, np.ndarray]  # successive states of one instance: arrays [n, ...]
NO_ACTION = -1  # of the first state of an episode


def play(game: Game, plan: Plan, shard: Shard) -> Iterator[list[Stretch]]:
    """Play the states of a shard.

    Args:
        game: the game.
        plan: of the dataset.
        shard: to play.

    Yields:
        One sequence of at most `plan.sequence_states` successive states for each instance, the next ones each time. A sequence has the
        arrays `index` (number of the state in the dataset), `instance`, `episode` (of the instance), `step` (of the episode), `ram` uint8
        `[n, 128]`, `screen` and `previous` uint8 `[n, H, 160]` (palette indices of the last two emulated frames), `action`, `reward`,
        `terminated` and `truncated` (of the step that led to the state), and `lives`.
    """
    # The first numbers are for the emulators, the others for the policies.
    seeds = np.random.SeedSequence([shard.seed, shard.part]).generate_state(ENVS + len(plan.policies)) & 0x7FFFFFFF
    own = np.array(shard.shares)
    index = shard.first + np.cumsum(own) - own  # of the first state of each instance
    starts = [variation(game, plan.starts[i % len(plan.starts)]) for i in range(ENVS)] if plan.starts else ()
    with contextlib.closing(AlePool(game, ENVS, Settings(**plan.settings), screens=("screen",), starts=starts)) as pool:
        act = _policies(game, plan, len(pool.actions), seeds[ENVS:].tolist())
        pool.reset(seeds[:ENVS].tolist())
        played = itertools.islice(_states(pool, act, index), int(own.max()))
        for first in range(0, int(own.max()), plan.sequence_states):
            states = list(itertools.islice(played, plan.sequence_states))
            stacked = {name: np.stack([state[name] for state in states], axis=1) for name in states[0]}
            yield [{name: a[i, : max(own[i] - first, 0)] for name, a in stacked.items()} for i in range(ENVS)]


def _states(pool: AlePool, act: Policy, index: np.ndarray) -> Iterator[dict[str, np.ndarray]]:
    """Successive states of all instances; `index` is that of the first one of each."""
    episode = np.full(ENVS, -1)
    for t, action in enumerate(steps(pool, act)):
        episode = episode + pool.started
        yield {"index": index + t} | _state(pool, NO_ACTION if action is None else action, episode)


def _policies(game: Game, plan: Plan, num_actions: int, seeds: list[int]) -> Policy:
    """The policies of all instances as one."""
    ends = np.cumsum([0, *(n for _, n in plan.policies)])
    parts = [
        (slice(start, stop), make_policy(name, game, num_actions, int(stop - start), seed))
        for (name, _), start, stop, seed in zip(plan.policies, ends[:-1], ends[1:], seeds, strict=True)
    ]
    return lambda ram, started: np.concatenate([policy(ram[s], started[s]) for s, policy in parts])


def _state(pool: AlePool, action: np.ndarray | int, episode: np.ndarray) -> dict[str, np.ndarray]:
    """The present state of all instances, arrays `[ENVS, ...]`."""
    return {
        "ram": pool.ram.copy(),
        "screen": pool.screen[:, 1].copy(),
        "previous": pool.screen[:, 0].copy(),
        "action": np.where(pool.started, NO_ACTION, action).astype(np.int32),
        "reward": pool.reward.copy(),
        "terminated": pool.terminated.copy(),
        "truncated": pool.truncated.copy(),
        "lives": pool.lives.copy(),
        "instance": np.arange(ENVS, dtype=np.int32),
        "episode": episode.astype(np.int32),
        "step": pool.episode_length.astype(np.int32),
    }
