"""The `envpool` backend: envpool's threads step the emulators, and REM reads the RAM that envpool returns.

Options and calls that envpool does not support raise an error that gives the reason: frames with a frame skip (envpool returns the maximum
of the last two), screens that are not 210 rows high (envpool crops them), saved states, writing RAM, hooks, new seeds after the first
reset, resets of single environments, and autoreset modes other than next-step. Three settings differ slightly: envpool plays at least one
no-op when a game begins, so `noop_max` 0 means 1; it presses FIRE once if `fire_reset` is on; and it truncates episodes only after whole
steps.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, NoReturn

import ale_py
import envpool
import jax
import jax.numpy as jnp
import numpy as np
from gymnasium.error import AlreadyPendingCallError, NoAsyncCallError
from gymnasium.vector import AutoresetMode

from ocjax.emulators.checks import NOT_RESET, action_array, index_array, integer, is_integer, seed_list
from ocjax.emulators.memory import check_memory
from ocjax.emulators.pool import EmulatorPool, Report, action_set, load_emulator
from ocjax.emulators.process import WorkerError
from ocjax.emulators.settings import Settings
from ocjax.emulators.states import States
from ocjax.emulators.worker.interface import EmulatorArrays
from ocjax.envs.observations import Computed, Kind, Mode, Request, requested_kinds, required_screens
from ocjax.envs.shards import Observed, make_observer
from ocjax.envs.vector import ObjectVectorEnv
from ocjax.extraction.game import Game

ROWS = 210  # of envpool's frames
_SEEDS = 2**31  # how many seeds there are
_MOST = 2**31 - 1

# (state, actions int32 [N]) -> (state, (observation, reward, terminated, truncated, info))
XlaStep = Callable[[Any, jax.Array], tuple[Any, tuple[Any, jax.Array, jax.Array, jax.Array, dict[str, Any]]]]


def _task_name(rom: str) -> str:
    """Envpool's name of a game: "space_invaders" -> "SpaceInvaders-v5"."""
    return "".join(part.capitalize() for part in rom.split("_")) + "-v5"


class EnvpoolPool(EmulatorPool):
    """Emulators of one game that envpool steps. Arrays are in the order of the environments.

    Differences to `EmulatorPool`: `screen` and `rgb` are the same array, uint8 `[N, 1, 210, 160, 3]`, and `frame_number` excludes the
    no-ops at the beginning of a game.

    Args:
        game: the game, whose ROM is checked.
        num_envs: number of emulators.
        settings: what a step and an episode are.
        frames: whether frames are recorded.
        options: further options of `envpool.make`.

    Raises:
        RomError: a ValueError; the ROM is missing, or is not the one that the game's decoder was written for.
    """

    def __init__(self, game: Game, num_envs: int, settings: Settings, *, frames: bool, **options: Any) -> None:
        self.game, self.num_envs, self.settings = game, num_envs, settings
        self.actions = action_set(load_emulator(game), settings)
        self.shards = [slice(0, num_envs)]  # envpool's threads share all environments
        self.env: Any = None  # envpool's environments, from the first reset on
        self._batch_size = options["batch_size"]
        self._busy = np.zeros(num_envs, bool)  # whose step or reset has begun, and its result has not been received
        self._steps = self._awaited_steps = 0
        self._closed = False
        self.ids = np.arange(num_envs)  # the environments that the last results belong to
        assert isinstance(settings.frame_skip, int)  # pairs are refused by `_refuse_unsupported`
        self._frame_skip, self._frames, self._options = settings.frame_skip, frames, options
        self._game_over = np.ones(num_envs, bool)
        frame = np.zeros((num_envs, 1, *game.screen, 3), np.uint8) if frames else None
        self.arrays = EmulatorArrays(
            ram=np.zeros((num_envs, 128), np.uint8),
            lives=np.zeros(num_envs, np.int32),
            frame_number=np.zeros(num_envs, np.int64),
            episode_return=np.zeros(num_envs),
            episode_length=np.zeros(num_envs, np.int64),
            screen=frame,
            rgb=frame,
            reward=np.zeros(num_envs),
            terminated=np.zeros(num_envs, bool),
            truncated=np.zeros(num_envs, bool),
            started=np.ones(num_envs, bool),
        )

    def _start(self, seeds: Sequence[int | None] | None) -> None:
        """Make envpool's environments, if this has not happened yet.

        Raises:
            ValueError: there are seeds after the start, for some environments only, or too large ones.
            AlreadyPendingCallError: a step or a reset is pending.
        """
        self.require_open()
        if self._busy.any():
            raise AlreadyPendingCallError("a step or a reset is pending: receive its results first, by step_wait() or recv()", "step")
        if self.env is not None:
            if seeds is not None:
                raise ValueError("envpool takes seeds when it starts, at the first reset: make new environments for new seeds")
            return
        if seeds is None:
            seeds = np.random.default_rng().integers(_SEEDS, size=self.num_envs).tolist()
        seeds = seed_list(seeds, self.num_envs)
        if any(s is None or s >= _SEEDS for s in seeds):
            raise ValueError(f"envpool needs a seed below 2**31 for every environment, or for none, got {seeds}")
        s = self.settings
        height, width = (ROWS, 160) if self._frames else (1, 1)
        self.env = envpool.make(
            _task_name(self.game.rom),
            env_type="gymnasium",
            num_envs=self.num_envs,
            seed=seeds,
            frame_skip=self._frame_skip,
            stack_num=1,
            img_height=height,
            img_width=width,
            gray_scale=not self._frames,
            noop_max=max(1, s.noop_max),
            use_fire_reset=s.fire_reset,
            episodic_life=s.episodic_life,
            reward_clip=False,
            repeat_action_probability=s.repeat_action_probability,
            full_action_space=s.full_action_space,
            max_episode_steps=min(s.max_episode_frames // self._frame_skip, s.max_episode_steps or s.max_episode_frames),
            **self._options,
        )

    def reset(self, seeds: Sequence[int | None] | None = None, mask: np.ndarray | None = None, report: Report | None = None) -> None:
        """Start new episodes in all environments; see `EmulatorPool.reset`. Seeds are possible the first time only; nothing is reported."""
        if mask is not None and not mask.all():
            raise ValueError("envpool restarts all environments or none: use backend='ale' for reset_mask")
        self._start(seeds)
        with self._discarding():
            frames, info = self.env.reset()
            self._expect_new_games()
            nothing = np.zeros(self.num_envs, bool)
            self._store(frames, nothing, nothing, info)

    def async_reset(self, seeds: Sequence[int | None] | None = None) -> None:
        """Start new episodes in all environments without waiting for them."""
        self._start(seeds)
        with self._discarding():
            self.env.async_reset()
            self._busy[:] = True
            self._expect_new_games()

    def _expect_new_games(self) -> None:
        """Make the next result of each environment count as the beginning of a game."""
        self.terminated[:] = self._game_over[:] = True

    @contextmanager
    def _discarding(self) -> Iterator[None]:
        """Discard envpool's environments if a call is interrupted, as pending results are unknown then. The next reset makes new ones."""
        try:
            yield
        except BaseException:
            self.env, self._steps = None, self._awaited_steps
            self._busy[:] = False
            raise

    def send(self, actions: np.ndarray, ids: np.ndarray | None = None) -> None:
        """Start a step of all environments, or of those with the given indices, whose results have been received.

        Raises:
            ValueError: an index or an action is wrong, or the environments have not been reset.
            AlreadyPendingCallError: a step or reset of one of these environments is pending.
        """
        ids = np.arange(self.num_envs) if ids is None else index_array(ids, self.num_envs)
        actions = action_array(actions, len(ids), len(self.actions))
        self.require_open()
        if self.env is None:
            raise ValueError(NOT_RESET)
        if self._busy[ids].any():
            pending = ids[self._busy[ids]].tolist()
            raise AlreadyPendingCallError(f"a step of environments {pending} is pending: receive its results first", "step")
        with self._discarding():
            self._busy[ids] = True
            self._steps += 1
            self.env.send(actions.astype(np.int32), ids.astype(np.int32))

    def as_completed(self) -> Iterator[int]:
        """Wait for the step; there is one shard."""
        self.wait()
        yield 0

    def wait(self) -> None:
        """Wait for the step, or for the environments that are ready first if there is a batch size.

        Raises:
            NoAsyncCallError: fewer steps are pending than results are returned.
        """
        self.require_open()
        if self._busy.sum() < self._batch_size:
            raise NoAsyncCallError(
                f"{self._busy.sum()} environments are stepping, and results come for {self._batch_size} together: start more steps", "step"
            )
        with self._discarding():
            frames, _, terminated, truncated, info = self.env.recv()
            self._store(frames, terminated, truncated, info)
            self._awaited_steps = self._steps

    @property
    def steps(self) -> int:
        """How many steps have been started."""
        return self._steps

    @property
    def pending(self) -> bool:
        """Whether a step has been started that has not been waited for."""
        return self._steps != self._awaited_steps

    def require_open(self) -> None:
        """Check that the pool can be used; see `EmulatorPool.require_open`."""
        if self._closed:
            raise WorkerError("the pool is closed: make the environments anew")

    def _store(self, frames: np.ndarray, terminated: np.ndarray, truncated: np.ndarray, info: dict[str, Any]) -> None:
        """Write results to the rows of their environments."""
        arrays = self.arrays
        self.ids = i = np.asarray(info["env_id"])
        self._busy[i] = False
        arrays.started[i] = begins = arrays.terminated[i] | arrays.truncated[i]
        new_game = begins & self._game_over[i]
        arrays.reward[i] = info["reward"]
        arrays.terminated[i], arrays.truncated[i] = terminated, truncated
        self._game_over[i] = (np.asarray(info["terminated"]) != 0) | truncated
        arrays.ram[i], arrays.lives[i] = info["ram"], info["lives"]
        arrays.episode_return[i] = np.where(new_game, 0, arrays.episode_return[i] + arrays.reward[i])
        arrays.episode_length[i] = np.where(new_game, 0, arrays.episode_length[i] + ~begins)
        arrays.frame_number[i] = arrays.episode_length[i] * self._frame_skip
        if arrays.rgb is not None:
            arrays.rgb[i, 0] = frames.transpose(0, 2, 3, 1)

    def close(self) -> None:
        """Release the emulators."""
        if self.env is not None:
            self.env.close()
        self.env, self._closed = None, True

    def clone_state(self) -> States:
        """Refused: envpool cannot save states."""
        self._refuse("states")

    def restore_state(self, states: States, mask: np.ndarray | None = None) -> None:
        """Refused: envpool cannot restore states."""
        self._refuse("states")

    def set_ram(self, ram: np.ndarray, mask: np.ndarray | None = None) -> None:
        """Refused: envpool cannot write RAM."""
        self._refuse("RAM")

    def emulator(self, i: int) -> ale_py.ALEInterface:
        """Refused: envpool keeps its emulators to itself."""
        self._refuse("emulators")

    def _refuse(self, what: str) -> NoReturn:
        raise ValueError(f"envpool gives no access to {what}: use backend='ale'")


class EnvpoolVectorEnv(ObjectVectorEnv):
    """N instances of a game on envpool. `make_vec` makes them with `backend="envpool"` and explains the options.

    With `batch_size` below N the environments are asynchronous, as in envpool: `async_reset`, `recv` and `send` take the place of `reset`
    and `step`, and `info["env_id"]` tells which environments the results belong to. Each environment keeps the memory of its observations.

    Raises:
        ValueError: an option is out of range, or envpool cannot implement it.
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
    ) -> None:
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
        pool = EnvpoolPool(game, num_envs, settings, frames=bool(required_screens(mode, kinds)), **options)
        super().__init__(pool, mode, obs, autoreset_mode=autoreset_mode, ram_info=ram_info)

    def _require_synchronous(self) -> None:
        if self.batch_size < self.num_envs:
            raise ValueError("with batch_size below num_envs use async_reset, recv and send instead of reset and step")

    def reset(self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Reset all environments; a seed is possible the first time only.

        Raises:
            ValueError: there is a seed after the first reset, or a reset_mask, or the environments are asynchronous.
        """
        self._require_synchronous()
        return super().reset(seed=seed, options=options)

    def step_async(self, actions: Any) -> None:
        """Start a step without waiting for it."""
        self._require_synchronous()
        super().step_async(actions)

    def async_reset(self, seed: int | Sequence[int | None] | None = None) -> None:
        """Reset all environments without waiting for them; `recv` returns those that are ready first."""
        self.pool.async_reset(self._seeds(seed))

    def send(self, actions: np.ndarray, env_id: np.ndarray) -> None:
        """Start a step of some environments: actions, integers `[n]`, and their indices, integers `[n]`.

        Raises:
            ValueError: an action or an index does not exist, or their shapes or dtypes are wrong.
            AlreadyPendingCallError: the results of one of these environments have not been received.
        """
        self.pool.send(actions, env_id)

    def recv(self) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """The results of the `batch_size` environments that are ready first, as `step` returns them; `info["env_id"]` has their indices.

        Raises:
            NoAsyncCallError: fewer environments are stepping.
        """
        self.pool.wait()
        pool, ids, shard = self.pool, self.pool.ids, self._shards[0]
        arrays = {name: array[ids] for name, array in shard.arrays.items()}
        observed = self._observe(arrays, _rows(shard.memory, ids))
        memory = self._scatter(ids, observed.memory, shard.memory)
        previous = self._scatter(ids, _rows(shard.objects, ids), shard.previous) if shard.objects else {}
        objects = self._scatter(ids, observed.objects, shard.objects)
        self._shards, self._steps = [replace(shard, memory=memory, previous=previous, objects=objects)], pool.steps
        reward = pool.reward[ids]
        info = {name: array[ids] for name, array in self._info().items()} | {"env_id": ids}
        observation = self._assemble([(observed, arrays)])
        return observation, np.sign(reward) if pool.settings.clip_rewards else reward, pool.terminated[ids], pool.truncated[ids], info

    def _scatter(self, ids: np.ndarray, new: Any, old: Any) -> Any:
        """Write rows `[n, ...]` to a copy of the arrays of all environments, `[N, ...]`; to zeros where there are none yet."""

        def scatter(a: Any, b: Any) -> np.ndarray:
            out = np.zeros((self.num_envs, *a.shape[1:]), a.dtype) if b is None else np.array(b)
            out[ids] = a
            return out

        return jax.tree.map(scatter, new, old) if old else jax.tree.map(lambda a: scatter(a, None), new)

    def xla(self) -> tuple[Any, XlaStep]:
        """The environments as a pure function for `jax.jit` and `jax.lax.scan`, starting from their present state.

        Returns:
            `(state, step)`. `step(state, actions)`, with actions int32 `[N]`, returns the next state and (observation, reward, terminated,
            truncated, info); info contains `lives` and `ram`. The emulators are those of `reset` and `step`, so use one or the other.

        Raises:
            ValueError: the environments have not been reset or are asynchronous, or the mode or an observation needs frames.
        """
        self._require_synchronous()
        if self.pool.env is None:
            raise ValueError(NOT_RESET)
        if required_screens(self.mode, self.kinds):
            raise ValueError("xla() provides RAM and what is computed from it, but no frames")
        handle, _, _, env_step = self.pool.env.xla()
        observer, clip_rewards = make_observer(self.game, self.mode, self.kinds), self.pool.settings.clip_rewards

        def step(state: Any, actions: jax.Array) -> tuple[Any, tuple[Any, jax.Array, jax.Array, jax.Array, dict[str, Any]]]:
            handle, memory, ended = state
            handle, (_, _, terminated, truncated, info) = env_step(handle, actions)
            order = jnp.argsort(info["env_id"])
            terminated, truncated, ram, lives, reward = (
                a[order] for a in (terminated, truncated, info["ram"], info["lives"], info["reward"])
            )
            observed = observer({"ram": ram, "started": ended}, memory)
            out = (self._traced_observation(ram, observed), jnp.sign(reward) if clip_rewards else reward, terminated, truncated)
            return (handle, observed.memory, terminated | truncated), (*out, {"lives": lives, "ram": ram})

        ended = jnp.asarray(self.pool.terminated | self.pool.truncated)
        return (handle, jax.tree.map(jnp.asarray, self._shards[0].memory), ended), step

    def _traced_observation(self, ram: jax.Array, observed: Observed) -> Any:
        """The observation inside a traced function."""
        out = {
            name: observed.computed[name] if isinstance(kind, Computed) else kind.source({"ram": ram}, observed.objects)
            for name, kind in self.kinds.items()
        }
        return out[""] if self._single else out


def _refuse_unsupported(
    game: Game, mode: str, kinds: Mapping[str, Kind], settings: Settings, autoreset_mode: AutoresetMode, hook: Any, render_mode: str | None
) -> None:
    """Raise a ValueError with the reason if envpool cannot do what is asked of it."""
    screens = required_screens(mode, kinds)
    reasons = {
        "envpool gives no grey frames that are not pooled and resized": bool(screens & {"gray", "pooled"}),
        "envpool shows the brighter of two frames where it skips some, so frames need frame_skip=1": screens and settings.frame_skip != 1,
        f"envpool crops screens to {ROWS} rows, {game.name} has {game.screen[0]}": screens and game.screen[0] != ROWS,
        "envpool has next-step autoreset only": autoreset_mode != AutoresetMode.NEXT_STEP,
        "envpool has no random frame skip": not isinstance(settings.frame_skip, int),
        "envpool cannot write RAM, so there are no hooks": hook is not None,
        "envpool's frames cannot be rendered": render_mode is not None,
    }
    for reason, applies in reasons.items():
        if applies:
            raise ValueError(f"{reason}: use backend='ale'")


def _one_for_all(name: str, value: Any) -> int:
    """A game mode or difficulty as envpool takes it."""
    if value is None:
        return -1
    if np.ndim(value) > 0:
        raise ValueError(f"envpool takes one {name} for all environments, got {value}: use backend='ale'")
    if not is_integer(value):
        raise TypeError(f"{name} must be an integer, got {value!r}")
    return int(value)


def _rows(tree: Any, ids: np.ndarray) -> Any:
    return jax.tree.map(lambda a: np.asarray(a)[ids], tree)
