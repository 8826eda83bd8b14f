"""The loop that lets a policy play a pool of emulators."""

from collections.abc import Iterator

import numpy as np

from ocjax.emulators.ale import AlePool
from ocjax.play.saved import Policy, Seen


def seen(pool: AlePool) -> Seen:
    """The values that a policy sees of a pool."""
    pooled = pool.arrays.pooled
    return Seen(pool.ram, pool.started, None if pooled is None else pooled[:, -1])


def steps(pool: AlePool, act: Policy) -> Iterator[np.ndarray | None]:
    """Play a pool without end, right after its reset.

    The pool's arrays show the state after each step: `started` marks the first states of episodes,
    `terminated` and `truncated` the last ones, and `episode_return` is the sum of a game's rewards.

    With the setting `fire_reset`, the start actions of episodes follow a lost life that does not
    end the episode: policies that were trained with episodes of one life never press FIRE
    themselves.

    Args:
        act: the policy, a function of `seen(pool)`.

    Yields:
        First None, for the state after the reset, then the actions of each step, int `[N]`.
    """
    yield None
    start = np.array(pool.start_actions, int)
    # The number of start actions that each instance has pressed since its last lost life.
    pressed = np.full(pool.num_envs, len(start))
    while True:
        lives, actions = pool.lives.copy(), np.array(act(seen(pool)))
        due = pressed < len(start)
        actions[due] = start[pressed[due]]
        pool.step(actions)
        lost = (
            (pool.lives > 0)
            & (pool.lives < lives)
            & ~(pool.started | pool.terminated | pool.truncated)
        )
        pressed = np.where(lost, 0, np.minimum(pressed + due, len(start)))
        yield actions
