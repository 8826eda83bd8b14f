"""Recordings of random actions, held random actions or a saved policy."""

import contextlib
import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from ocjax.emulators.progress import progress, progress_bar, start_bar
from ocjax.envs import AlePool, Settings
from ocjax.extraction.game import Game
from ocjax.play.policies import BUILT_IN, Policy, make_policy, needs
from ocjax.play.stepping import steps
from ocjax.recordings import Recording

# An odd frame skip covers both phases of flickering objects.
DEFAULT = Settings(frame_skip=3, repeat_action_probability=0.0)

State = dict[str, Any]  # of one instance, by the names of a recording's arrays


def rollout(
    game: Game,
    samples: int,
    *,
    policy: str = "repeat",
    seed: int = 0,
    num_envs: int = 8,
    frame_skip: int | None = None,
    after: int = 0,
    repeat_action_probability: float | None = None,
    whole_games: bool | None = None,
    game_mode: int | None = None,
    game_difficulty: int | None = None,
) -> Recording:
    """Play several instances of a game in parallel, and record states.

    A saved policy plays under the settings of its training, with unclipped rewards. Other policies
    have three emulated frames per step and no sticky actions. Explicit arguments override both.

    Args:
        samples: number of states of all instances together, at least `num_envs`.
        policy: see `make_policy`.
        seed: seed of the policy and of the first instance; the others get the following seeds.
        after: emulated frames that each instance plays before its first sample, rounded up to
            steps.
        repeat_action_probability: the probability that an emulated frame repeats the previous
            action.
        whole_games: whether each instance plays complete games, at least one. Samples are then
            drawn from all their states, uniformly and without replacement; the last sample of an
            instance is the end of its last game. Otherwise, samples are successive states. By
            default, saved policies play complete games.
        game_mode: ale-py's number of the game mode; by default the game's own.
        game_difficulty: ale-py's number of the difficulty; by default the game's own.

    Returns:
        A recording with frames, previous frames, returns, lives, resets, ends and settings,
        instance by instance. With `whole_games`, its frame skip is None, and `resets` marks the
        first sample of a game.
    """
    if samples < num_envs:
        raise ValueError(
            f"samples must be at least the number of instances {num_envs}, got {samples}"
        )
    needed = needs(policy, game)
    changes = {
        "frame_skip": frame_skip,
        "repeat_action_probability": repeat_action_probability,
        "clip_rewards": False,
    }
    settings = dataclasses.replace(
        needed.settings or DEFAULT,
        **{name: value for name, value in changes.items() if value is not None},
    )
    modes: dict[str, Any] = {"game_mode": game_mode, "game_difficulty": game_difficulty}
    with contextlib.closing(
        AlePool(game, num_envs, settings, screens=("screen", *needed.screens), **modes)
    ) as pool:
        act = make_policy(policy, game, len(pool.actions), num_envs, seed)
        with start_bar(num_envs) as report:
            pool.reset([seed + i for i in range(num_envs)], report=report)
        skipped = -(-after // min(settings.skip_range))
        if whole_games or (whole_games is None and policy not in BUILT_IN):
            states = _sample_games(
                pool, act, samples // num_envs, skipped, np.random.default_rng(seed)
            )
            return _recording(game, states, settings, None)
        states = _successive(pool, act, samples // num_envs, skipped)
        return _recording(
            game,
            states,
            settings,
            settings.frame_skip if isinstance(settings.frame_skip, int) else None,
        )


def _successive(pool: AlePool, act: Policy, count: int, skipped: int) -> list[list[State]]:
    states: list[list[State]] = [[] for _ in range(pool.num_envs)]
    turns = progress(range(-skipped, count), f"playing {pool.game.name}")
    for t, _ in zip(turns, steps(pool, act), strict=False):
        if t >= 0:
            for i, own in enumerate(states):
                own.append(_state(pool, i))
    return states


def _sample_games(
    pool: AlePool, act: Policy, count: int, skipped: int, rng: np.random.Generator
) -> list[list[State]]:
    samplers = [_Sampler(count, rng) for _ in range(pool.num_envs)]
    with progress_bar(f"playing {pool.game.name}", "complete games", transient=True) as report:
        for t, _ in enumerate(steps(pool, act)):
            for i, sampler in enumerate(samplers):
                if t >= skipped and not sampler.complete:
                    sampler.add(lambda i=i: _state(pool, i), last=bool(pool.game_over[i]))
            done = sum(sampler.complete for sampler in samplers)
            report(done, len(samplers))
            if done == len(samplers):
                return [sampler.states for sampler in samplers]
    raise AssertionError("steps end only when the caller stops")


class _Sampler:
    """A uniform sample of the states of complete games, by algorithm R (Vitter, 1985).

    It always includes the last state, and is `complete` when a game has ended after enough states.
    """

    def __init__(self, count: int, rng: np.random.Generator) -> None:
        self._count, self._rng, self._seen, self._games = count, rng, 0, 0
        self._kept: list[State] = []
        self.complete = False

    def add(self, state: Callable[[], State], *, last: bool) -> None:
        """Add the next state; `last` marks the end of its game.

        `state` is only called if the sample keeps the state.
        """
        self.complete = last and self._seen + 1 >= self._count
        k = self._count - 1 if self.complete else self._place()
        if k < self._count:
            self._kept[k : k + 1] = [state() | {"time": self._seen, "game": self._games}]
        self._seen += 1
        self._games += last

    def _place(self) -> int:
        """The index of the next state in the sample, or `count` if it is dropped.

        The last index is reserved for the last state.
        """
        random = self._count - 1
        if self._seen < random:
            return self._seen
        k = int(self._rng.integers(self._seen + 1))
        return k if k < random else self._count

    @property
    def states(self) -> list[State]:
        """The sample in order of time."""
        ordered = sorted(self._kept, key=lambda state: state["time"])
        games = [state["game"] for state in ordered]
        first = [game != before for game, before in zip(games, [None, *games], strict=False)]
        return [state | {"resets": new} for state, new in zip(ordered, first, strict=True)]


def _state(pool: AlePool, i: int) -> State:
    return {
        "rams": pool.ram[i].copy(),
        "screens": pool.screen[i, 1].copy(),
        "previous": pool.screen[i, 0].copy(),
        "rewards": pool.episode_return[i],
        "lives": pool.lives[i],
        "resets": pool.started[i],
        "ends": pool.terminated[i] | pool.truncated[i],
    }


def _recording(
    game: Game, states: list[list[State]], settings: Settings, frame_skip: int | None
) -> Recording:
    flat = [state for own in states for state in own]
    names = [name for name in flat[0] if name not in ("time", "game")]
    arrays = {name: np.stack([state[name] for state in flat]) for name in names}
    return Recording(game, **arrays, frame_skip=frame_skip, settings=settings.to_dict())
