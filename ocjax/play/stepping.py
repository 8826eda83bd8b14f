"""The loop in which a policy plays a pool of emulators."""

from collections.abc import Iterator

import numpy as np

from ocjax.emulators.ale import AlePool
from ocjax.play.saved import Policy, Seen


def seen(pool: AlePool) -> Seen:
    """What policies see of a pool."""
    pooled = pool.arrays.pooled
    return Seen(pool.ram, pool.started, None if pooled is None else pooled[:, -1])


def steps(pool: AlePool, act: Policy) -> Iterator[np.ndarray | None]:
    """Play a pool that has just been reset, without end.

    The pool's arrays hold the state that is reached: `started` tells the first states of episodes,
    `terminated` and `truncated` the last ones, and `episode_return` is the sum of the rewards of a
    game.

    With the setting `fire_reset`, a lost life that does not end the episode is followed by the
    actions with which episodes start, FIRE and the next one. Many policies learned with episodes of
    one life, which all begin with FIRE, so they never press it themselves.

    Args:
        pool: of emulators.
        act: the policy, a function of what it sees of the pool.

    Yields:
        None for the state after the reset, then after each step its actions, int `[N]`.
    """
    yield None
    start = np.array(pool.start_actions, int)
    pressed = np.full(
        pool.num_envs, len(start)
    )  # how many of the actions each instance has pressed since its last lost life
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
