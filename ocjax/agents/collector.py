"""Rollouts of two halves of the environments.

While the emulators of one half step, the policy acts in the other.
"""

import dataclasses
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ocjax.agents.ppo import Rollout
from ocjax.emulators.checks import integer
from ocjax.emulators.states import States
from ocjax.envs.vector import ObjectVectorEnv

MOST_STEPS = 2**31 - 1  # random numbers are drawn with an int32 number of the step
# (observations [n, *D], number of the step) -> actions int [n], log probabilities float32 [n]
Act = Callable[[np.ndarray, int], tuple[Any, Any]]


@dataclasses.dataclass
class _Half:
    envs: ObjectVectorEnv
    columns: slice  # the half's columns of a rollout
    obs: np.ndarray
    ended: np.ndarray  # bool [n]: the episode ended in the last step, so the next step only resets


class Collector:
    """Steps two vector environments alternately and collects rollouts.

    Episodes end as in Gymnasium's next-step autoreset: the observation after an episode's last step
    is the last one of that episode, and the next step ignores the action and begins a new episode.

    Each of the first rollouts begins with a new episode in one environment: the second rollout in
    environment 1, and so on. Otherwise games of a fixed length, such as Freeway, would begin at the
    same time in all environments, and every rollout would show one short part of a game.

    Args:
        first: half of the environments.
        horizon: steps of a rollout.
        seed: seed of the environments.

    Attributes:
        games: the returns of the games that ended in the last rollout.
        seconds: the time that the last rollout waited for the environments and for the policy.
    """

    def __init__(
        self, first: ObjectVectorEnv, second: ObjectVectorEnv, horizon: int, seed: int
    ) -> None:
        self.horizon, self.steps = horizon, 0
        self._halves, start = [], 0
        for envs in (first, second):
            obs, _ = envs.reset(seed=seed + start)
            columns = slice(start, start + envs.num_envs)
            self._halves.append(_Half(envs, columns, obs, np.zeros(envs.num_envs, bool)))
            start = columns.stop
        self.num_envs = start
        self.games: list[float] = []
        self.seconds = {"environments": 0.0, "policy": 0.0}

    def collect(self, act: Act) -> Rollout:
        """The next rollout."""
        self._restart_one()
        t, n, obs = self.horizon, self.num_envs, self._halves[0].obs
        out = Rollout(
            np.empty((t + 1, n, *obs.shape[1:]), obs.dtype),
            *(
                np.empty((t, n), dtype)
                for dtype in (np.int32, np.float32, np.float32, bool, bool, bool)
            ),
        )
        self.games, self.seconds = [], {"environments": 0.0, "policy": 0.0}
        for i in range(t):
            for half in self._halves:
                if i > 0:
                    self._finish(half, out, i - 1)
                self._begin(half, out, i, act)
        for half in self._halves:
            self._finish(half, out, t - 1)
            out.obs[t, half.columns] = half.obs
        return out

    def _restart_one(self) -> None:
        """Begin a new episode in the environment with the number of the rollout."""
        rollout = self.steps // (len(self._halves) * self.horizon)
        for half in self._halves:
            mask = np.arange(self.num_envs)[half.columns] == rollout
            if rollout > 0 and mask.any():
                half.obs, _ = half.envs.reset(options={"reset_mask": mask})
                half.ended = half.ended & ~mask

    def _begin(self, half: _Half, out: Rollout, i: int, act: Act) -> None:
        start = time.perf_counter()
        chosen, chosen_log_prob = act(half.obs, self.steps)
        action, log_prob = np.asarray(chosen), np.asarray(chosen_log_prob)
        self.seconds["policy"] += time.perf_counter() - start
        self.steps += 1
        half.envs.step_async(action)
        out.obs[i, half.columns], out.resets[i, half.columns] = half.obs, half.ended
        out.action[i, half.columns], out.log_prob[i, half.columns] = action, log_prob

    def _finish(self, half: _Half, out: Rollout, i: int) -> None:
        start = time.perf_counter()
        half.obs, reward, terminated, truncated, info = half.envs.step_wait()
        self.seconds["environments"] += time.perf_counter() - start
        self.games += info["episode_return"][info["game_over"]].tolist()
        half.ended = terminated | truncated
        out.reward[i, half.columns] = reward
        out.terminated[i, half.columns], out.truncated[i, half.columns] = terminated, truncated

    def save(self) -> dict[str, Any]:
        """All values that later rollouts depend on, as a pytree of numbers and arrays."""
        halves = [
            {
                "states": np.frombuffer(half.envs.clone_state().to_bytes(), np.uint8),
                "ended": half.ended,
            }
            for half in self._halves
        ]
        return {"steps": self.steps, "halves": halves}

    def restore(self, saved: Mapping[str, Any], rollouts: int) -> None:
        """Continue from the result of `save`, as if without an interruption."""
        steps = rollouts * len(self._halves) * self.horizon
        self.steps = integer(
            "the number of steps",
            np.asarray(saved["steps"]).tolist(),
            steps,
            min(steps, MOST_STEPS),
        )
        for half, own in zip(self._halves, saved["halves"], strict=True):
            ended = np.array(own["ended"])
            if (ended.dtype, ended.shape) != (bool, half.ended.shape):
                raise ValueError(
                    f"the ends of episodes must be bool {list(half.ended.shape)}, got "
                    f"{ended.dtype} {list(ended.shape)}"
                )
            half.obs, _ = half.envs.restore_state(
                States.from_bytes(np.asarray(own["states"]).tobytes())
            )
            half.ended = ended

    def close(self) -> None:
        """Close the environments."""
        for half in self._halves:
            half.envs.close()
