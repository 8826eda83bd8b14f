"""Environments for Stable-Baselines3: a `VecEnv` on ocjax's worker processes.

    envs = ocjax.sb3.make_vec_env("Pong", 16, preset="dqn")
    PPO("MlpPolicy", envs, device="cpu").learn(1_000_000)

Needs the extra `sb3`.
"""

import contextlib
import time
from collections.abc import Iterable, Sequence
from typing import Any

import jax
import numpy as np
from gymnasium.error import NoAsyncCallError
from gymnasium.vector import AutoresetMode

from ocjax._extras import extras
from ocjax.envs import ObjectVectorEnv, make_vec
from ocjax.extraction.game import Game

with extras():
    from stable_baselines3.common.monitor import Monitor  # pyright: ignore[reportMissingImports]
    from stable_baselines3.common.vec_env import VecEnv  # pyright: ignore[reportMissingImports]

__all__ = ["ObjectVecEnv", "make_vec_env"]

_INFO = ("lives", "frame_number", "episode_return", "episode_length", "game_over")


def make_vec_env(
    game: str | Game, n_envs: int = 1, seed: int | None = None, **options: Any
) -> "ObjectVecEnv":
    """Make environments for Stable-Baselines3.

    Args:
        game: the game's name in any of the usual spellings, or a `Game`.
        n_envs: number of instances.
        seed: instance i gets `seed + i` at the first reset; by default a random seed.
        options: of `ocjax.make_vec`, except `autoreset_mode` and `batch_size`; `obs` is "vector" by
            default.

    Raises:
        ValueError: the game or an option's value is unknown.
        TypeError: an option does not exist, or not for Stable-Baselines3.
    """
    for name in ("num_envs", "autoreset_mode", "batch_size"):
        if name in options:
            raise TypeError(
                f"make_vec_env has no option {name}: Stable-Baselines3 resets environments in "
                "the step that ends an episode"
            )
    envs = ObjectVecEnv(
        make_vec(
            game, n_envs, **{"obs": "vector", **options}, autoreset_mode=AutoresetMode.SAME_STEP
        )
    )
    if seed is not None:
        envs.seed(seed)
    return envs


class _Instance:
    def __init__(self, envs: ObjectVectorEnv, i: int) -> None:
        self._envs, self._i = envs, i
        self.observation_space = envs.single_observation_space
        self.action_space = envs.single_action_space
        for name in ("spec", "metadata", "render_mode", "game", "mode"):
            setattr(self, name, getattr(envs, name))

    @property
    def unwrapped(self) -> "_Instance":
        return self

    @property
    def features(self) -> Any:
        return self._envs.features

    @property
    def objects(self) -> Any:
        return jax.tree.map(lambda field: field[self._i], self._envs.objects)

    def views(self, method: str | None = None) -> list[Any]:
        return self._envs.views(self._i, method)

    def get_ram(self) -> np.ndarray:
        return self._envs.get_ram()[self._i]

    def get_action_meanings(self) -> list[str]:
        return [a.name for a in self._envs.pool.actions]

    def render(self) -> np.ndarray | None:
        frames = self._envs.render()
        return None if frames is None else frames[self._i]

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(
            f"environments of ocjax.sb3 have no attribute {name!r}; the vector environment "
            "behind them is `.envs`"
        )


class ObjectVecEnv(VecEnv):
    """A vector environment of ocjax with the interface of Stable-Baselines3.

    The `infos` of a step contain the entries of `ObjectVectorEnv`'s `info`, except
    `executed_action`, and `TimeLimit.truncated`. At the end of an episode they describe the
    terminal state, and contain `terminal_observation`. At the end of a complete game they also
    contain `episode`, as from Stable-Baselines3's `Monitor`: the unclipped return `r`, the number
    of agent steps `l`, and the seconds `t` since the environments were made.

    Args:
        envs: a vector environment with same-step autoreset.

    Raises:
        ValueError: the environment has another autoreset mode.
    """

    def __init__(self, envs: ObjectVectorEnv) -> None:
        if envs.autoreset_mode != AutoresetMode.SAME_STEP:
            raise ValueError(
                "Stable-Baselines3 requires same-step autoreset, got "
                f"{envs.autoreset_mode.value}: use make_vec_env"
            )
        self.envs, self.spec, self._begun = envs, envs.spec, time.time()
        self._instances = [_Instance(envs, i) for i in range(envs.num_envs)]
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def __repr__(self) -> str:
        return f"ObjectVecEnv({self.envs!r})"

    def reset(self) -> Any:
        """Start new games in all environments, and return the observations.

        The seeds come from `seed`. A pending step is lost.

        Raises:
            ValueError: `set_options` has set options; resets have none.
        """
        if any(self._options):
            raise ValueError(f"unknown options {self._options}: resets have none")
        with contextlib.suppress(NoAsyncCallError):
            self.envs.step_wait()
        observation, info = self.envs.reset(seed=self._seeds)
        self.reset_infos = self._infos(info)
        self._reset_seeds()
        return observation

    def step_async(self, actions: np.ndarray) -> None:
        """Start a step; see `ObjectVectorEnv.step_async`."""
        self.envs.step_async(actions)

    def step_wait(self) -> tuple[Any, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """Wait for the step.

        Returns:
            Observations, rewards float32 `[N]`, ends of episodes bool `[N]`, and the infos.
        """
        observation, reward, terminated, truncated, info = self.envs.step_wait()
        ended, infos = terminated | truncated, self._infos(info)
        for i in np.flatnonzero(ended).tolist():
            final = info["final_info"]
            infos[i] |= {name: final[name][i].item() for name in _INFO} | (
                {"ram": final["ram"][i]} if "ram" in final else {}
            )
            infos[i]["terminal_observation"] = info["final_obs"][i]
            infos[i]["TimeLimit.truncated"] = bool(truncated[i] and not terminated[i])
            if final["game_over"][i]:
                total, length = infos[i]["episode_return"], infos[i]["episode_length"]
                infos[i]["episode"] = {
                    "r": total,
                    "l": length,
                    "t": round(time.time() - self._begun, 6),
                }
        return observation, reward.astype(np.float32), ended, infos

    def _infos(self, info: dict[str, Any]) -> list[dict[str, Any]]:
        names = [name for name in (*_INFO, "reward") if name in info]
        rows = zip(*(info[name].tolist() for name in names), strict=True)
        infos = [
            dict(zip(names, row, strict=True)) | {"TimeLimit.truncated": False} for row in rows
        ]
        if "ram" in info:
            for one, ram in zip(infos, info["ram"], strict=True):
                one["ram"] = ram
        return infos

    def close(self) -> None:
        """Release the emulators."""
        self.envs.close()

    def get_images(self) -> Sequence[np.ndarray | None]:
        """The last frame of each environment; None unless the render mode is "rgb_array"."""
        frames = self.envs.render() if self.render_mode == "rgb_array" else None
        return [None] * self.num_envs if frames is None else list(frames)

    def _selected(self, indices: int | Iterable[int] | None) -> list[_Instance]:
        return [self._instances[i] for i in self._get_indices(indices)]

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """An attribute of some environments.

        These are the spaces, `spec`, `metadata`, `render_mode`, `game`, `mode`, `features` and
        `objects`.

        Raises:
            AttributeError: the attribute does not exist.
        """
        return [getattr(one, attr_name) for one in self._selected(indices)]

    def set_attr(
        self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None
    ) -> None:
        """Raise AttributeError: options are set when the environments are made."""
        raise AttributeError(
            f"cannot set {attr_name!r}: options of ocjax's environments are set when they are made"
        )

    def env_method(
        self,
        method_name: str,
        *args: Any,
        indices: int | Iterable[int] | None = None,
        **kwargs: Any,
    ) -> list[Any]:
        """Call a method of some environments: `get_ram`, `get_action_meanings` or `render`.

        Raises:
            AttributeError: the method does not exist.
        """
        return [getattr(one, method_name)(*args, **kwargs) for one in self._selected(indices)]

    def env_is_wrapped(
        self, wrapper_class: type, indices: int | Iterable[int] | None = None
    ) -> list[bool]:
        """True for the wrapper `Monitor`, False for others.

        The infos contain the episodes that `Monitor` adds.
        """
        return [wrapper_class is Monitor for _ in self._selected(indices)]
