"""Environments of the `envpool` backend, which extract objects from the RAM that envpool returns.

Unsupported options and calls raise an error with the reason. envpool does not support

- frames with a frame skip (it returns the maximum of the last two) or other than 210 rows,
- saved states, writing RAM, and hooks,
- new seeds after the first reset, and resets of single environments,
- autoreset modes other than next-step.

`ocjax.emulators.envpool` names three settings that differ slightly.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from gymnasium.vector import AutoresetMode

from ocjax.emulators.checks import NOT_RESET, integer, is_integer, seeds_of
from ocjax.emulators.envpool import ROWS, EnvpoolPool
from ocjax.emulators.memory import check_memory
from ocjax.emulators.settings import Settings
from ocjax.envs.continuous import ContinuousActions
from ocjax.envs.observations import Computed
from ocjax.envs.requests import Kind, Mode, Request, requested_kinds, required_screens
from ocjax.envs.shards import Observed, at_rows, make_observer
from ocjax.envs.vector import ObjectVectorEnv
from ocjax.extraction.game import Game

_MOST = 2**31 - 1

# (state, actions int32 [N]) -> (state, (observation, reward, terminated, truncated, info))
XlaStep = Callable[
    [Any, jax.Array], tuple[Any, tuple[Any, jax.Array, jax.Array, jax.Array, dict[str, Any]]]
]


class EnvpoolVectorEnv(ObjectVectorEnv):
    """N instances of a game on envpool; see `make_vec` with `backend="envpool"`.

    With `batch_size` below N the environments are asynchronous, as in envpool: use `async_reset`,
    `recv` and `send` instead of `reset` and `step`. `info["env_id"]` contains the indices of the
    environments in the results.
    """

    pool: EnvpoolPool

    def __init__(
        self,
        game: Game,
        num_envs: int,
        mode: Mode,
        obs: Request | None,
        settings: Settings,
        *,
        autoreset_mode: AutoresetMode,
        num_workers: int | None,
        batch_size: int | None,
        game_mode: Any,
        game_difficulty: Any,
        hook: Any,
        render_mode: str | None,
        ram_info: bool,
        continuous: ContinuousActions | None = None,
    ) -> None:
        if continuous is not None:
            raise ValueError("envpool has no continuous actions: use backend='ale'")
        kinds, _ = requested_kinds(mode, obs)
        _refuse_unsupported(game, mode, kinds, settings, autoreset_mode, hook, render_mode)
        num_envs = integer("num_envs", num_envs, 1, _MOST)
        self.batch_size = num_envs if batch_size is None else batch_size
        if not is_integer(self.batch_size) or not 1 <= self.batch_size <= num_envs:
            raise ValueError(f"batch_size must be 1 to num_envs {num_envs}, got {batch_size}")
        check_memory(num_envs)
        options = {
            "batch_size": self.batch_size,
            "num_threads": integer("num_workers", num_workers or 0, 0, _MOST),
            "mode": _one_for_all("game_mode", game_mode),
            "difficulty": _one_for_all("game_difficulty", game_difficulty),
        }
        pool = EnvpoolPool(
            game, num_envs, settings, frames=bool(required_screens(mode, kinds)), **options
        )
        super().__init__(pool, mode, obs, autoreset_mode=autoreset_mode, ram_info=ram_info)

    def _require_synchronous(self) -> None:
        if self.batch_size < self.num_envs:
            raise ValueError(
                "with batch_size below num_envs use async_reset, recv and send instead of reset "
                "and step"
            )

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Reset all environments; a seed is possible the first time only."""
        self._require_synchronous()
        return super().reset(seed=seed, options=options)

    def step_async(self, actions: Any) -> None:
        """Start a step without waiting for it."""
        self._require_synchronous()
        super().step_async(actions)

    def async_reset(self, seed: int | Sequence[int | None] | None = None) -> None:
        """Reset all environments without waiting; `recv` returns the results."""
        self.pool.async_reset(seeds_of(seed, self.num_envs))

    def send(self, actions: np.ndarray, env_id: np.ndarray) -> None:
        """Start a step, integers `[n]`, of the environments with the indices `env_id`, `[n]`."""
        self.pool.send(actions, env_id)

    def recv(self) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """The results of the first `batch_size` environments to finish, as `step` returns them."""
        self.pool.wait()
        pool, ids, shard = self.pool, self.pool.ids, self._shards[0]
        arrays = {name: array[ids] for name, array in shard.arrays.items()}
        observed = self._observe(arrays, at_rows(shard.memory, ids))
        memory = self._scatter(ids, observed.memory, shard.memory)
        previous = (
            self._scatter(ids, at_rows(shard.objects, ids), shard.previous) if shard.objects else {}
        )
        objects = self._scatter(ids, observed.objects, shard.objects)
        self._shards = [replace(shard, memory=memory, previous=previous, objects=objects)]
        self._steps = pool.steps
        reward = pool.reward[ids]
        info = {name: array[ids] for name, array in self._info().items()} | {"env_id": ids}
        observation = self._assemble([(observed, arrays)])
        return (
            observation,
            np.sign(reward) if pool.settings.clip_rewards else reward,
            pool.terminated[ids],
            pool.truncated[ids],
            info,
        )

    def _scatter(self, ids: np.ndarray, new: Any, old: Any) -> Any:
        """Write rows `[n, ...]` to a copy of the arrays of all environments, `[N, ...]`.

        Without old arrays, the other rows are zero.
        """

        def scatter(a: Any, b: Any) -> np.ndarray:
            out = np.array(b)
            out[ids] = a
            return out

        zeros = jax.tree.map(lambda a: np.zeros((self.num_envs, *a.shape[1:]), a.dtype), new)
        return jax.tree.map(scatter, new, old or zeros)

    def xla(self) -> tuple[Any, XlaStep]:
        """The environments from now on, as a pure function for `jax.jit` and `jax.lax.scan`.

        Returns:
            `(state, step)`. `step(state, actions)`, with actions int32 `[N]`, returns the next
            state and (observation, reward, terminated, truncated, info). `info` contains `lives`,
            `ram` and `game_over`. `reset` and `step` control the same emulators, so do not mix them
            with this function.
        """
        self._require_synchronous()
        if self.pool.env is None:
            raise ValueError(NOT_RESET)
        if required_screens(self.mode, self.kinds):
            raise ValueError("xla() provides RAM and objects, but no frames")
        handle, _, _, env_step = self.pool.env.xla()
        observer = make_observer(self.game, self.mode, self.kinds)
        clip_rewards = self.pool.settings.clip_rewards

        def step(
            state: Any, actions: jax.Array
        ) -> tuple[Any, tuple[Any, jax.Array, jax.Array, jax.Array, dict[str, Any]]]:
            handle, memory, ended = state
            handle, (_, _, terminated, truncated, info) = env_step(handle, actions)
            order = jnp.argsort(info["env_id"])
            terminated, truncated, ram, lives, reward, game_over = (
                a[order]
                for a in (
                    terminated,
                    truncated,
                    info["ram"],
                    info["lives"],
                    info["reward"],
                    info["terminated"],
                )
            )
            observed = observer({"ram": ram, "started": ended}, memory)
            out = (
                self._traced_observation(ram, observed),
                jnp.sign(reward) if clip_rewards else reward,
                terminated,
                truncated,
            )
            facts = {"lives": lives, "ram": ram, "game_over": (game_over != 0) | truncated}
            return (handle, observed.memory, terminated | truncated), (*out, facts)

        ended = jnp.asarray(self.pool.terminated | self.pool.truncated)
        return (handle, jax.tree.map(jnp.asarray, self._shards[0].memory), ended), step

    def _traced_observation(self, ram: jax.Array, observed: Observed) -> Any:
        out = {
            name: observed.computed[name]
            if isinstance(kind, Computed)
            else kind.source({"ram": ram}, observed.objects)
            for name, kind in self.kinds.items()
        }
        return out[""] if self._single else out


def _refuse_unsupported(
    game: Game,
    mode: str,
    kinds: Mapping[str, Kind],
    settings: Settings,
    autoreset_mode: AutoresetMode,
    hook: Any,
    render_mode: str | None,
) -> None:
    screens = required_screens(mode, kinds)
    reasons = {
        "envpool gives no grey frames that are not pooled and resized": bool(
            screens & {"gray", "pooled"}
        ),
        "envpool shows the brighter of two frames where it skips some, so frames need "
        "frame_skip=1": screens and settings.frame_skip != 1,
        f"envpool crops screens to {ROWS} rows, {game.name} has {game.screen[0]}": screens
        and game.screen[0] != ROWS,
        "envpool has next-step autoreset only": autoreset_mode != AutoresetMode.NEXT_STEP,
        "envpool has no random frame skip": not isinstance(settings.frame_skip, int),
        "envpool cannot write RAM, so there are no hooks": hook is not None,
        "envpool's frames cannot be rendered": render_mode is not None,
    }
    for reason, applies in reasons.items():
        if applies:
            raise ValueError(f"{reason}: use backend='ale'")


def _one_for_all(name: str, value: Any) -> int:
    if value is None:
        return -1
    if np.ndim(value) > 0:
        raise ValueError(
            f"envpool takes one {name} for all environments, got {value}: use backend='ale'"
        )
    if not is_integer(value):
        raise TypeError(f"{name} must be an integer, got {value!r}")
    return int(value)
