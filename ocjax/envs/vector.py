"""Vector environments with objects as observations."""

import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import gymnasium as gym
import jax
import jax.numpy as jnp
import numpy as np
from gymnasium.error import AlreadyPendingCallError, NoAsyncCallError
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ocjax.emulators.checks import NOT_RESET, Uncopied, reset_mask, seeds_of
from ocjax.emulators.pool import EmulatorPool
from ocjax.emulators.progress import start_bar
from ocjax.emulators.states import States, check_carries
from ocjax.envs.continuous import ContinuousActions
from ocjax.envs.features import Vector
from ocjax.envs.observations import Computed
from ocjax.envs.requests import Mode, Request, requested_kinds, required_screens
from ocjax.envs.rewards import BatchedReward, RewardFunction, batched
from ocjax.envs.shards import (
    FRAMES,
    EnvShard,
    Observed,
    at_rows,
    concatenate_rows,
    make_observer,
    select_rows,
)
from ocjax.extraction.objects import Objects
from ocjax.transforms import game_objects
from ocjax.transforms.drawing import overlay
from ocjax.transforms.game_objects import GameObject

TENSORS = "environments' `tensors` is now called `objects`: use envs.objects"
RENDER_MODES = ("rgb_array", "objects")
_INFO = ("lives", "frame_number", "episode_return", "episode_length", "game_over")
_OVER = "over"  # the name in `States` of the flags of ended episodes


class ObjectVectorEnv(Uncopied, VectorEnv):
    """N instances of a game whose observations are objects; `make_vec` makes them.

    Everything that a step returns describes the step's last emulated frame. Later steps do not
    overwrite returned arrays. `info` describes the current game: `lives`, `frame_number` (emulated
    frames), `episode_return` (unclipped), `episode_length` (agent steps) and, with `ram_info`,
    `ram`. It also describes the step:

    - `game_over`: whether the game ended or reached a limit. A lost life does not set it.
    - `reward`: the game's unclipped reward, if rewards are clipped or computed from objects.
    - `executed_action`: with sticky actions, the action of the last emulated frame (not with
      envpool).

    With same-step autoreset, `final_obs` and `final_info` follow Gymnasium's vector environments:
    `game_over` is in `final_info`, and `final_info["objects"]` contains the objects of the terminal
    states.

    Args:
        pool: the emulators.
        mode: the methods that extract objects: "rem", "vem", "both" or "raw" (none).
        obs: the observations; by default the objects, or in mode "raw" the RAM.
        autoreset_mode: the mode that the pool implements.
        render_mode: "rgb_array" or "objects"; needs a pool that records "rgb".
        ram_info: whether `info` contains the RAM.
        reward_fn: see `make_vec`.
        continuous: maps continuous actions to the pool's 18 actions, or None for discrete actions.

    Attributes:
        objects: the current objects as `Objects` of batch shape `[N]`; in mode "both" a dict of
            both methods' objects. The arrays are JAX arrays: `torch.from_dlpack(envs.objects.xywh)`
            shares them with PyTorch.
        pool: the emulators and their arrays.
    """

    def __init__(
        self,
        pool: EmulatorPool,
        mode: Mode,
        obs: Request | None = None,
        *,
        autoreset_mode: AutoresetMode = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        ram_info: bool = False,
        reward_fn: RewardFunction | None = None,
        continuous: ContinuousActions | None = None,
    ) -> None:
        self.pool, self.game, self.mode, self.num_envs = pool, pool.game, mode, pool.num_envs
        if reward_fn is not None and mode == "raw":
            raise ValueError(
                "reward_fn is a function of objects, which mode 'raw' does not extract"
            )
        self._reward_fn = None if reward_fn is None else batched(reward_fn)
        self.metadata = {
            "autoreset_mode": autoreset_mode,
            "render_modes": list(RENDER_MODES),
            "render_fps": pool.settings.steps_per_second,
        }
        self.autoreset_mode, self.render_mode, self.ram_info = autoreset_mode, render_mode, ram_info
        self._shows_executed = (
            pool.settings.repeat_action_probability > 0 and pool.executed_action is not None
        )
        self.kinds, self._single = requested_kinds(mode, obs)
        self.continuous = continuous
        self._set_spaces()
        self._observer = make_observer(self.game, mode, self.kinds)
        self._shards = [self._make_shard(rows) for rows in pool.shards]
        self._ended = np.zeros(self.num_envs, bool)  # episodes that ended in the last step
        # True if the shards match the emulators, or matched them before a pending step.
        self._current = False
        self._steps = pool.steps  # number of the pool's steps in the shards
        # The actions of the last step; float32 [N, 3] if they are continuous.
        self._actions = np.zeros(self.num_envs, np.int32)

    def _set_spaces(self) -> None:
        spaces = {name: kind.space(self.game, self.mode) for name, kind in self.kinds.items()}
        self.single_observation_space = spaces[""] if self._single else gym.spaces.Dict(spaces)
        self.single_action_space = (
            self.continuous.space
            if self.continuous
            else gym.spaces.Discrete(len(self.pool.actions))
        )
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def _make_shard(self, rows: slice) -> EnvShard:
        sources = {"ram", "started", *required_screens(self.mode, self.kinds)}
        arrays = {name: getattr(self.pool, name)[rows] for name in sources}
        size = rows.stop - rows.start
        memory = {
            name: kind.initial(self.game, self.mode, size)
            for name, kind in self.kinds.items()
            if isinstance(kind, Computed)
        }
        return EnvShard(rows, arrays, memory)

    def _repr_html_(self) -> str:
        shown = self.objects if self._shards[0].objects else {}
        methods = shown if isinstance(shown, dict) else {self.mode: shown}
        about = f"<p>{self.num_envs} environments of {self.game.name}, mode {self.mode}</p>"
        return about + "".join(objects._repr_html_() for objects in methods.values())

    @property
    def tensors(self) -> Objects | dict[str, Objects]:
        """Deprecated name of `objects`."""
        warnings.warn(TENSORS, DeprecationWarning, stacklevel=2)
        return self.objects

    @property
    def objects(self) -> Objects | dict[str, Objects]:
        """The current objects, batch shape `[N]`; in mode "both" a dict of both methods' objects.

        Raises:
            ValueError: the mode is "raw", or the environments have not been reset.
        """
        if not self._shards[0].objects:
            raise ValueError(
                "there are no objects: the mode is 'raw', or the environments have not been reset"
            )
        blocks = [shard.objects for shard in self._shards]
        objects = (
            blocks[0] if len(blocks) == 1 else jax.tree.map(lambda *a: jnp.concatenate(a), *blocks)
        )
        return dict(objects) if self.mode == "both" else objects[self.mode]

    def views(self, i: int, method: str | None = None) -> list[GameObject]:
        """The objects of one environment as OCAtari's list of Python objects.

        Args:
            i: the index of the environment.
            method: "rem" or "vem"; by default REM's objects if they are extracted.

        Raises:
            IndexError: the index is out of range.
            ValueError: the method extracts no objects in this mode, or the environments have not
                been reset.
        """
        i = range(self.num_envs)[i]
        shard = next(s for s in self._shards if i < s.rows.stop)
        name = method or ("rem" if "rem" in shard.objects else "vem")
        if name not in shard.objects:
            raise ValueError(
                f"no objects by {name!r}: the mode is {self.mode!r}, or the environments have "
                "not been reset"
            )
        k, previous = i - shard.rows.start, shard.previous.get(name)
        continued = previous is not None and not self.pool.started[i]
        return game_objects.views(
            at_rows(shard.objects[name], k), at_rows(previous, k) if continued else None
        )

    @property
    def features(self) -> Any:
        """The meaning of each number of "vector" observations; see `Vector.features_of`.

        With several observations it is a dict by name.

        Raises:
            AttributeError: no observation is a vector.
        """
        out = {
            name: kind.features_of(self.game)
            for name, kind in self.kinds.items()
            if isinstance(kind, Vector)
        }
        if not out:
            raise AttributeError(
                "no observation is a vector: make the environments with obs='vector'"
            )
        return out[""] if self._single else out

    def _observe(self, arrays: Mapping[str, np.ndarray], memory: dict[str, Any]) -> Observed:
        latest = {name: arrays[name][:, -1] for name in FRAMES if name in arrays}
        return self._observer(
            {"ram": arrays["ram"], "started": arrays["started"], **latest}, memory
        )

    def _assemble(self, blocks: Sequence[tuple[Observed, Mapping[str, np.ndarray]]]) -> Any:
        out = {}
        for name, kind in self.kinds.items():
            if isinstance(kind, Computed):
                out[name] = concatenate_rows([observed.computed[name] for observed, _ in blocks])
            else:
                out[name] = concatenate_rows(
                    [
                        kind.source(arrays, jax.tree.map(np.asarray, observed.objects))
                        for observed, arrays in blocks
                    ]
                )
        return out[""] if self._single else out

    def _updated(self, shard: EnvShard, mask: np.ndarray | None = None) -> EnvShard:
        """A shard with its current state extracted, only where the mask, bool `[N]`, is set."""
        return shard.updated(
            self._observe(shard.arrays, shard.memory), None if mask is None else mask[shard.rows]
        )

    def _observation(self, shards: Sequence[EnvShard]) -> Any:
        """The observation of shards, after all computations of the step."""
        jax.block_until_ready([shard.carry() for shard in shards])
        return self._assemble(
            [(Observed(s.computed or {}, s.memory, s.objects), s.arrays) for s in shards]
        )

    def _replace(self, shards: list[EnvShard], ended: np.ndarray) -> None:
        """End a call: switch to the new state.

        CPython handles signals only at calls and jumps, so Ctrl-C cannot separate these
        assignments.
        """
        steps = self.pool.steps
        self._shards, self._ended, self._steps, self._current = shards, ended, steps, True

    def _info(self) -> dict[str, Any]:
        changed = self.pool.settings.clip_rewards or self._reward_fn is not None
        names = (*_INFO, *["reward"] * changed, *["ram"] * self.ram_info)
        info = {name: np.copy(getattr(self.pool.arrays, name)) for name in names}
        executed = self.pool.executed_action if self._shows_executed else None
        if executed is not None:
            info["executed_action"] = executed
        return info | {f"_{name}": np.ones(self.num_envs, bool) for name in info}

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Any, dict[str, Any]]:
        """Reset all environments.

        Args:
            seed: environment i gets `seed + i`, or the i-th of a sequence; with None, the current
                random state continues.
            options: may contain `reset_mask`, bool `[N]`, the environments to reset.

        Returns:
            The observation and `info`.

        Raises:
            ValueError: a seed is negative, the number of seeds or the mask is wrong, or an option
                is unknown.
            AlreadyPendingCallError: a step is pending.
        """
        mask, seeds = reset_mask(options, self.num_envs), seeds_of(seed, self.num_envs)
        if mask is not None and not self._current and not mask.all():
            raise ValueError(
                "the first reset must be of all environments, without reset_mask, and so must "
                "one after an interrupted call"
            )
        self._require_no_step()
        with start_bar(self.num_envs) as report, self._changing():
            self.pool.reset(seeds, mask, report)
        shards = [self._updated(shard, mask) for shard in self._shards]
        result = self._observation(shards), self._info()
        self._replace(
            shards, self._ended & ~mask if mask is not None else np.zeros(self.num_envs, bool)
        )
        return result

    @contextmanager
    def _changing(self) -> Iterator[None]:
        """Mark the shards as outdated while a call changes the emulators, until `_replace`.

        If the call raises an exception, the shards stay current.
        """
        current, self._current = self._current, False
        try:
            yield
        except Exception:
            self._current = current
            raise

    def _require_no_step(self) -> None:
        self.pool.require_open()
        if self._steps != self.pool.steps:
            raise AlreadyPendingCallError(
                "a step is pending: call step_wait(), which returns its results", "step"
            )

    def step_async(self, actions: Any) -> None:
        """Start a step without waiting for it, so that the emulators run while the caller computes.

        Args:
            actions: integers `[N]`; floats `[N, 3]` if they are continuous.

        Raises:
            ValueError: an action does not exist, the shape or dtype is wrong, the environments have
                not been reset, or autoreset is disabled and an episode has ended.
            AlreadyPendingCallError: a step is pending.
            WorkerError: a worker died.
        """
        self._require_no_step()
        if not self._current:
            raise ValueError(NOT_RESET)
        if self.autoreset_mode == AutoresetMode.DISABLED and self._ended.any():
            raise ValueError(
                f"the episodes of environments {np.flatnonzero(self._ended).tolist()} have ended "
                "and autoreset is disabled: "
                "reset them with reset(options={'reset_mask': ...})"
            )
        if self.continuous:
            pressed, strengths = self.continuous.to_discrete(actions, self.num_envs)
            self.pool.send(pressed, strengths=strengths)
        else:
            self.pool.send(actions)
        self._actions = np.array(actions, np.float32 if self.continuous else np.int32)

    def step_wait(self) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Wait for the step that `step_async` started.

        An interrupted call, for example by Ctrl-C, can be repeated.

        Returns:
            The observation, rewards float64 `[N]`, terminated bool `[N]`, truncated bool `[N]`, and
            `info`.

        Raises:
            NoAsyncCallError: no step is pending.
            WorkerError: a worker failed, died or did not reply in time.
        """
        pool, final, terminal = self.pool, {}, {}
        pool.require_open()
        if self._steps == pool.steps:
            raise NoAsyncCallError(
                "no step is pending: call step_async() before step_wait()", "step"
            )
        # An interrupted call may have waited for all emulators already.
        completed = pool.as_completed() if pool.pending else range(len(self._shards))
        if self.autoreset_mode == AutoresetMode.SAME_STEP:
            # Final states need the memory from before the update, so they come first.
            completed = list(completed)
            ended = pool.terminated | pool.truncated
            if ended.any():
                final, terminal = self._final(ended)
        new = {k: self._updated(self._shards[k]) for k in completed}
        shards = [new[k] for k in range(len(new))]
        reward, terminated, truncated = map(
            np.array, (pool.reward, pool.terminated, pool.truncated)
        )
        if self._reward_fn is not None:
            reward = self._object_reward(self._reward_fn, shards, terminal, terminated | truncated)
        elif pool.settings.clip_rewards:
            reward = np.sign(reward)
        result = self._observation(shards), reward, terminated, truncated, self._info() | final
        self._replace(shards, terminated | truncated)
        return result

    def _object_reward(
        self,
        reward_fn: BatchedReward,
        shards: Sequence[EnvShard],
        terminal: dict[str, Objects],
        ended: np.ndarray,
    ) -> np.ndarray:
        """The reward function's rewards of a step; 0 if the step began an episode.

        `terminal` are the objects of ended games.
        """
        name = "vem" if self.mode == "vem" else "rem"
        previous = concatenate_rows([shard.objects[name] for shard in self._shards])
        current = concatenate_rows([shard.objects[name] for shard in shards])
        if terminal:
            current = select_rows(ended, terminal[name], current)
        began = (
            self.pool.started
            if self.autoreset_mode != AutoresetMode.SAME_STEP
            else np.zeros(self.num_envs, bool)
        )
        return np.where(began, 0.0, reward_fn(previous, current, self._actions))

    def _final(self, ended: np.ndarray) -> tuple[dict[str, Any], dict[str, Objects]]:
        """Observations and info of the terminal states where `ended`, and their objects."""
        blocks = []
        for shard in self._shards:
            arrays = self._terminal_arrays(shard, ended[shard.rows])
            blocks.append((self._observe(arrays, shard.memory), arrays))
        assembled = self._assemble(blocks)
        observations = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(ended):
            observations[i] = jax.tree.map(lambda a, i=i: a[i].copy(), assembled)
        objects = concatenate_rows([observed.objects for observed, _ in blocks])
        info = self._final_info(ended) | self._final_objects(ended, objects)
        return {
            "final_obs": observations,
            "_final_obs": ended.copy(),
            "final_info": info,
            "_final_info": ended.copy(),
        }, objects

    def _terminal_arrays(self, shard: EnvShard, ended: np.ndarray) -> dict[str, np.ndarray]:
        """A shard's arrays before new episodes began where `ended`, bool `[B]`."""
        final = self.pool.arrays.final
        return {
            name: array & ~ended
            if name == "started"
            else select_rows(ended, getattr(final, name)[shard.rows], array)
            for name, array in shard.arrays.items()
        }

    def _final_info(self, ended: np.ndarray) -> dict[str, Any]:
        names, final = (*_INFO, *["ram"] * self.ram_info), self.pool.arrays.final
        assert final is not None  # with same-step autoreset the pool has it
        info = {name: np.copy(getattr(final, name)) for name in names}
        if self._shows_executed:
            info["executed_action"] = self.pool.action_index(final.executed)
        for array in info.values():
            array[~ended] = 0
        return info | {f"_{name}": ended.copy() for name in info}

    def _final_objects(self, ended: np.ndarray, objects: dict[str, Objects]) -> dict[str, Any]:
        if not objects:
            return {}
        name = "rem" if "rem" in objects else "vem"
        previous = concatenate_rows([shard.objects[name] for shard in self._shards])
        out = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(ended).tolist():
            out[i] = game_objects.views(at_rows(objects[name], i), at_rows(previous, i))
        return {"objects": out, "_objects": ended.copy()}

    def step(self, actions: Any) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Step all environments: `step_async`, then `step_wait`.

        After Ctrl-C, the step ends before the interrupt is raised.
        """
        try:
            self.step_async(actions)
            return self.step_wait()
        except KeyboardInterrupt:
            if self._steps != self.pool.steps:
                self.step_wait()
            raise

    def get_ram(self) -> np.ndarray:
        """The RAM, uint8 `[N, 128]`."""
        return np.array(self.pool.ram)

    def set_ram(self, ram: np.ndarray, mask: np.ndarray | None = None) -> None:
        """Write RAM; see `EmulatorPool.set_ram`.

        REM's objects change at once; observations change with the next step.

        Raises:
            TypeError: `ram` is not a uint8 array.
            ValueError: `ram` has the wrong shape, or the backend cannot write RAM.
        """
        self.pool.set_ram(ram, mask)
        self._shards = [self._with_new_ram(shard) for shard in self._shards]

    def _with_new_ram(self, shard: EnvShard) -> EnvShard:
        if "rem" not in shard.objects:
            return shard
        # JAX may read the RAM in place after this call returns, so wait for the extraction: the
        # next step changes the RAM.
        return replace(
            shard,
            objects=shard.objects
            | {"rem": jax.block_until_ready(self.game.rem(self.pool.ram[shard.rows]))},
        )

    def clone_state(self) -> States:
        """Save the state of every environment, with the memory of the observations.

        Raises:
            ValueError: the environments have not been reset, or the backend cannot save states.
            AlreadyPendingCallError: a step is pending.
        """
        self._require_no_step()
        carries = self._carries()
        states = self.pool.clone_state()
        carry = jax.tree.leaves(concatenate_rows(carries))
        named = {_carry_name(k): leaf for k, leaf in enumerate(carry)}
        return replace(states, rows={**states.rows, **named, _OVER: self._ended.copy()})

    def restore_state(
        self, states: States, mask: np.ndarray | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Restore saved states.

        Args:
            states: one per environment, or a single one for all.
            mask: bool `[N]`, the environments to restore; by default all.

        Returns:
            The observation and `info` at the time of saving.

        Raises:
            TypeError: `states` is not of type `States`.
            ValueError: the states are damaged or have another game, number or observation, the
                environments have not been reset, or the backend cannot restore states.
            AlreadyPendingCallError: a step is pending.
        """
        self._require_no_step()
        carries = self._carries()
        leaves, tree = jax.tree.flatten(carries[0])
        targets = {_carry_name(k): leaf for k, leaf in enumerate(leaves)} | {_OVER: self._ended}
        check_carries(states, targets)
        with self._changing():
            self.pool.restore_state(states, mask)
        chosen = np.ones(self.num_envs, bool) if mask is None else mask
        rows = {
            name: np.broadcast_to(states.rows[name], (self.num_envs, *target.shape[1:]))
            for name, target in targets.items()
        }
        ended, carry = rows.pop(_OVER), list(rows.values())
        restored = [
            jax.tree.unflatten(tree, [a[shard.rows] for a in carry]) for shard in self._shards
        ]
        shards = [
            shard.with_carry(select_rows(chosen[shard.rows], new, old))
            for shard, new, old in zip(self._shards, restored, carries, strict=True)
        ]
        result = self._observation(shards), self._info()
        # If the caller edited the states, their objects do not match their RAM.
        self._replace(
            [self._with_new_ram(shard) for shard in shards], np.where(chosen, ended, self._ended)
        )
        return result

    def _carries(self) -> list[tuple[Any, ...]]:
        if not self._current:
            raise ValueError(NOT_RESET)
        return [shard.carry() for shard in self._shards]

    def render(self) -> tuple[np.ndarray, ...] | None:
        """The last frame of every environment, uint8 `[H, 160, 3]`, or None without a render mode.

        In render mode "objects" the frames are enlarged, with the objects drawn over them.
        """
        if self.render_mode is None:
            gym.logger.warn(
                "render() returns None without a render mode; give one when you make the "
                'environment, such as render_mode="rgb_array"'
            )
            return None
        frames = self.pool.rgb[:, -1].copy()
        if self.render_mode == "rgb_array":
            return tuple(frames)
        found = self.objects
        objects = jax.tree.map(np.asarray, found["rem"] if isinstance(found, dict) else found)
        return tuple(
            np.asarray(overlay(self.game, frame, objects[i])) for i, frame in enumerate(frames)
        )

    def close_extras(self, **kwargs: Any) -> None:
        """Release the emulators."""
        if hasattr(self, "pool"):  # Gymnasium 1.2 closes environments that were not completed, too
            self.pool.close()


def _carry_name(k: int) -> str:
    return f"env {k}"
