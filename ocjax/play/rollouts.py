"""Rollouts of random actions, held random actions or a saved policy, kept as recordings."""

import numpy as np
from rich.progress import track

from ocjax.emulators.progress import start_bar
from ocjax.envs import AlePool, Settings
from ocjax.extraction.game import Game
from ocjax.play.policies import Policy, make_policy
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
    pool = AlePool(game, num_envs, settings, screens=("screen",), game_mode=game_mode, game_difficulty=game_difficulty)
    try:
        act = make_policy(policy, game, len(pool.actions), num_envs, seed)
        with start_bar(num_envs) as report:
            pool.reset([seed + i for i in range(num_envs)], report=report)
        arrays = _record(pool, act, samples // num_envs, -(-after // frame_skip))
    finally:
        pool.close()
    flat = {name: a.reshape(-1, *a.shape[2:]) for name, a in arrays.items()}
    return Recording(game, **flat, frame_skip=frame_skip, settings=settings.to_dict())


def _record(pool: AlePool, act: Policy, steps: int, skipped: int) -> dict[str, np.ndarray]:
    """Play a pool that has just been reset, and return the arrays of a recording of the steps after some, `[N, steps, ...]`."""
    n, (height, width) = pool.num_envs, pool.game.screen
    arrays = {
        "rams": np.empty((n, steps, 128), np.uint8),
        "screens": np.empty((n, steps, height, width), np.uint8),
        "previous": np.empty((n, steps, height, width), np.uint8),
        "rewards": np.empty((n, steps)),
        "lives": np.empty((n, steps), np.int32),
        "resets": np.zeros((n, steps), bool),
        "ends": np.zeros((n, steps), bool),
    }
    total, resets = np.zeros(n), np.ones(n, bool)
    for t in track(range(-skipped, steps), description=f"playing {pool.game.name}", transient=True):
        if t > -skipped:
            pool.send(act(pool.ram, pool.started))
            pool.wait()
        total = np.where(resets, 0, total + pool.reward)
        ends = pool.terminated | pool.truncated
        step = (pool.ram, pool.screen[:, 1], pool.screen[:, 0], total, pool.lives, resets, ends)
        if t >= 0:
            for array, value in zip(arrays.values(), step, strict=True):
                array[:, t] = value
        resets = ends
    return arrays
