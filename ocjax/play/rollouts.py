"""Rollouts of random actions, held random actions or a saved policy, kept as recordings."""

import contextlib
from typing import Any

import numpy as np
from rich.progress import track

from ocjax.emulators.progress import start_bar
from ocjax.envs import AlePool, Settings
from ocjax.extraction.game import Game
from ocjax.play.policies import Policy, make_policy
from ocjax.play.stepping import steps
from ocjax.recordings import Recording


def rollout(
    game: Game,
    samples: int,
    *,
    policy: str = "repeat",
    seed: int = 0,
    num_envs: int = 8,
    frame_skip: int = 3,
    after: int = 0,
    repeat_action_probability: float = 0.0,
    game_mode: int | None = None,
    game_difficulty: int | None = None,
) -> Recording:
    """Step several instances of a game side by side, and record every state.

    Args:
        game: the game.
        samples: states of all instances together, at least `num_envs`.
        policy: see `make_policy`.
        seed: seed of the policy and of the first instance; the following instances get the following seeds.
        num_envs: number of instances.
        frame_skip: emulated frames per step; an odd number covers both phases of flickering objects.
        after: emulated frames that each instance plays before its first sample, rounded up to whole steps.
        repeat_action_probability: the probability that an emulated frame repeats the previous action.
        game_mode: game mode as ale-py numbers it; None for the game's default.
        game_difficulty: game difficulty, likewise.

    Returns:
        A recording with frames, previous frames, returns, lives, resets and ends: the samples of the first instance, then those of the
        second, and so on.

    Raises:
        PolicyError: a ValueError; there is no such policy, or it does not fit the game.
        RomError: a ValueError; the ROM is missing, or is not the one that the game's decoder was written for.
        ValueError: an argument is out of range.
    """
    if samples < num_envs:
        raise ValueError(f"samples must be at least the number of instances {num_envs}, got {samples}")
    settings = Settings(frame_skip=frame_skip, repeat_action_probability=repeat_action_probability)
    chosen: dict[str, Any] = {"game_mode": game_mode, "game_difficulty": game_difficulty}
    with contextlib.closing(AlePool(game, num_envs, settings, screens=("screen",), **chosen)) as pool:
        act = make_policy(policy, game, len(pool.actions), num_envs, seed)
        with start_bar(num_envs) as report:
            pool.reset([seed + i for i in range(num_envs)], report=report)
        arrays = _record(pool, act, samples // num_envs, -(-after // frame_skip))
    flat = {name: a.reshape(-1, *a.shape[2:]) for name, a in arrays.items()}
    return Recording(game, **flat, frame_skip=frame_skip, settings=settings.to_dict())


def _record(pool: AlePool, act: Policy, count: int, skipped: int) -> dict[str, np.ndarray]:
    """Play a pool that has just been reset, and return the arrays of a recording of `count` states after some, `[N, count, ...]`."""
    n, (height, width) = pool.num_envs, pool.game.screen
    arrays = {
        "rams": np.empty((n, count, 128), np.uint8),
        "screens": np.empty((n, count, height, width), np.uint8),
        "previous": np.empty((n, count, height, width), np.uint8),
        "rewards": np.empty((n, count)),
        "lives": np.empty((n, count), np.int32),
        "resets": np.zeros((n, count), bool),
        "ends": np.zeros((n, count), bool),
    }
    turns = track(range(-skipped, count), description=f"playing {pool.game.name}", transient=True)
    for t, _ in zip(turns, steps(pool, act), strict=False):
        if t >= 0:
            ends = pool.terminated | pool.truncated
            state = (pool.ram, pool.screen[:, 1], pool.screen[:, 0], pool.episode_return, pool.lives, pool.started, ends)
            for array, value in zip(arrays.values(), state, strict=True):
                array[:, t] = value
    return arrays
