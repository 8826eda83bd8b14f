"""The loop in which a policy plays a pool of emulators."""

from collections.abc import Iterator

import numpy as np

from ocjax.emulators.pool import EmulatorPool
from ocjax.play.policies import Policy


def steps(pool: EmulatorPool, act: Policy) -> Iterator[np.ndarray | None]:
    """Play a pool that has just been reset, without end.

    The pool's arrays hold the state that is reached: `started` tells the first states of episodes, `terminated` and `truncated` the last
    ones, and `episode_return` is the sum of the rewards of a game.

    Args:
        pool: of emulators.
        act: the policy, a function of RAM and of whether an episode has just begun.

    Yields:
        None for the state after the reset, then after each step its actions, int `[N]`.
    """
    yield None
    while True:
        actions = act(pool.ram, pool.started)
        pool.step(actions)
        yield actions
