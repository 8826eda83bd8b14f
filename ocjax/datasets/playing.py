"""The states of a shard: instances that play side by side, each with a policy."""

import contextlib
import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ocjax.datasets.plans import ENVS, Plan, Shard
from ocjax.emulators.ram_starts import variation
from ocjax.envs import AlePool, Settings
from ocjax.extraction.game import Game
from ocjax.play.policies import Policy, make_policy, needs
from ocjax.play.stepping import steps

Stretch = dict[str, np.ndarray]  # successive states of one instance: arrays [n, ...]
NO_ACTION = -1  # for the first state of an episode


def play(game: Game, plan: Plan, shard: Shard) -> Iterator[list[Stretch]]:
    """Play the states of a shard.

    Yields:
        The next sequence of at most `plan.sequence_states` successive states for each instance:
        arrays `index` (number of the state in the dataset), `instance`, `episode` (of the
        instance), `step` (of the episode), `ram` uint8 `[n, 128]`, `screen` and `previous` uint8
        `[n, H, 160]` (palette indices of the last two emulated frames), `action`, `reward`,
        `terminated` and `truncated` (of the step that led to the state), and `lives`.
    """
    # The first numbers seed the emulators, the others the policies.
    seeds = (
        np.random.SeedSequence([shard.seed, shard.part]).generate_state(ENVS + len(plan.policies))
        & 0x7FFFFFFF
    )
    own = np.array(shard.shares)
    index = shard.first + np.cumsum(own) - own  # of the first state of each instance
    starts = (
        [variation(game, plan.starts[i % len(plan.starts)]) for i in range(ENVS)]
        if plan.starts
        else [None] * ENVS
    )
    with contextlib.ExitStack() as stack:
        played = []
        for team in _teams(plan, seeds[ENVS:].tolist()):
            screens = dict.fromkeys(
                (
                    "screen",
                    *(name for policy, *_ in team.policies for name in needs(policy, game).screens),
                )
            )
            pool = AlePool(
                game,
                team.size,
                team.settings,
                screens=tuple(screens),
                starts=starts[team.instances],
            )
            stack.callback(pool.close)
            pool.reset(seeds[team.instances].tolist())
            played.append(_states(pool, team, index[team.instances]))
        together = itertools.islice(zip(*played, strict=True), int(own.max()))
        for first in range(0, int(own.max()), plan.sequence_states):
            states = list(itertools.islice(together, plan.sequence_states))
            stacked = {name: _stacked(states, name) for name in states[0][0]}
            yield [
                {name: a[i, : max(own[i] - first, 0)] for name, a in stacked.items()}
                for i in range(ENVS)
            ]


def _stacked(states: list[tuple[dict[str, np.ndarray], ...]], name: str) -> np.ndarray:
    return np.stack([np.concatenate([team[name] for team in state]) for state in states], axis=1)


class _Team(NamedTuple):
    settings: Settings
    instances: slice
    policies: tuple[tuple[str, int, int], ...]  # name, instances, seed

    @property
    def size(self) -> int:
        return self.instances.stop - self.instances.start


def _teams(plan: Plan, seeds: list[int]) -> list[_Team]:
    seeded = [(name, count, seed) for (name, count), seed in zip(plan.policies, seeds, strict=True)]
    teams, start = [], 0
    for settings, members in itertools.groupby(seeded, lambda policy: plan.settings_of(policy[0])):
        policies = tuple(members)
        stop = start + sum(count for _, count, _ in policies)
        teams.append(_Team(settings, slice(start, stop), policies))
        start = stop
    return teams


def _states(pool: AlePool, team: _Team, index: np.ndarray) -> Iterator[dict[str, np.ndarray]]:
    act = _policies(pool, team)
    episode = np.full(team.size, -1)
    for t, action in enumerate(steps(pool, act)):
        episode = episode + pool.started
        numbers = {
            "index": index + t,
            "instance": np.arange(team.instances.start, team.instances.stop, dtype=np.int32),
        }
        yield numbers | _state(pool, NO_ACTION if action is None else action, episode)


def _policies(pool: AlePool, team: _Team) -> Policy:
    ends = np.cumsum([0, *(count for _, count, _ in team.policies)])
    parts = [
        (
            slice(start, stop),
            make_policy(name, pool.game, len(pool.actions), int(stop - start), seed),
        )
        for (name, _, seed), start, stop in zip(team.policies, ends[:-1], ends[1:], strict=True)
    ]
    return lambda seen: np.concatenate([policy(seen.rows(s)) for s, policy in parts])


def _state(pool: AlePool, action: np.ndarray | int, episode: np.ndarray) -> dict[str, np.ndarray]:
    return {
        "ram": pool.ram.copy(),
        "screen": pool.screen[:, 1].copy(),
        "previous": pool.screen[:, 0].copy(),
        "action": np.where(pool.started, NO_ACTION, action).astype(np.int32),
        "reward": pool.reward.copy(),
        "terminated": pool.terminated.copy(),
        "truncated": pool.truncated.copy(),
        "lives": pool.lives.copy(),
        "episode": episode.astype(np.int32),
        "step": pool.episode_length.astype(np.int32),
    }
