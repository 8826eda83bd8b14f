"""The `envpool` backend: envpool's threads step the emulators, REM reads the RAM that it gives.

What envpool cannot do is refused, with the reason: frames with a frame skip (it shows the brighter of two), screens that are not 210 rows
(it crops them), saved states, writing RAM, hooks, new seeds after the start, restarting some environments only, other autoreset modes than
next-step. It plays at least one no-op when a game begins, so `noop_max` 0 means 1, presses FIRE once where `fire_reset` is on, and
truncates episodes after a number of whole steps.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import envpool
import jax
import jax.numpy as jnp
import numpy as np
from ale_py import ALEInterface, LoggerMode
from gymnasium.vector import AutoresetMode

from ocjax.envs.ale import check_rom
from ocjax.envs.observations import Computed, Wanted
from ocjax.envs.protocol import Protocol
from ocjax.envs.vector import Mode, ObjectVectorEnv, look, wanted
from ocjax.game import Game

ROWS = 210


def _snake(name: str) -> str:
    return "".join(part.capitalize() for part in name.split("_"))


class EnvpoolPool:
    """Emulators of one game stepped by envpool; arrays as those of `AlePool`, in the order of the environments."""

    def __init__(self, game: Game, num_envs: int, protocol: Protocol, *, frames: bool, **options: Any) -> None:
        self.game, self.num_envs, self.protocol = game, num_envs, protocol
        path = check_rom(game)
        ALEInterface.setLoggerMode(LoggerMode.Error)
        ale = ALEInterface()
        ale.loadROM(path)
        self.actions = tuple(ale.getLegalActionSet() if protocol.full_action_space else ale.getMinimalActionSet())
        self._frames, self._options = frames, options
        self.env: Any = None
        self.ids = np.arange(num_envs)  # whose the last results are
        self.ram = np.zeros((num_envs, 128), np.uint8)
        self.reward = np.zeros(num_envs)
        self.terminated, self.truncated = np.zeros(num_envs, bool), np.zeros(num_envs, bool)
        self.started = np.ones(num_envs, bool)
        self.lives = np.zeros(num_envs, np.int32)
        self.episode_return, self.episode_length = np.zeros(num_envs), np.zeros(num_envs, np.int64)
        self._game_over = np.ones(num_envs, bool)
        if frames:
            self.screen = np.zeros((num_envs, 1, *game.screen, 3), np.uint8)

    @property
    def frame_number(self) -> np.ndarray:
        """Emulated frames of the game, the no-ops at its beginning left out; int64 `[N]`."""
        assert isinstance(self.protocol.frame_skip, int)  # pairs are refused
        return self.episode_length * self.protocol.frame_skip

    @property
    def rgb(self) -> np.ndarray:
        """The last frame, uint8 `[N, 1, 210, 160, 3]`."""
        return self.screen

    def start(self, seeds: Sequence[int | None] | None) -> None:
        """Make envpool's environments; seeds count at this time only.

        Raises:
            ValueError: seeds after the start.
        """
        if self.env is not None:
            if seeds is not None:
                raise ValueError("envpool takes seeds when it starts, at the first reset: make new environments for new seeds")
            return
        p = self.protocol
        seeds = [int(s) for s in np.random.default_rng().integers(2**31, size=self.num_envs)] if seeds is None else list(seeds)
        if any(s is None for s in seeds):
            raise ValueError("envpool wants a seed for every environment, or for none")
        assert isinstance(p.frame_skip, int)  # pairs are refused
        height, width = (ROWS, 160) if self._frames else (1, 1)
        self.env = envpool.make(
            f"{_snake(self.game.rom)}-v5", env_type="gymnasium", num_envs=self.num_envs, seed=seeds, frame_skip=p.frame_skip, stack_num=1,
            img_height=height, img_width=width, gray_scale=not self._frames, noop_max=max(1, p.noop_max), use_fire_reset=p.fire_reset,
            episodic_life=p.episodic_life, reward_clip=False, repeat_action_probability=p.repeat_action_probability,
            full_action_space=p.full_action_space, max_episode_steps=p.max_episode_frames // p.frame_skip, **self._options,
        )  # fmt: skip

    def reset(self, seeds: Sequence[int | None] | None = None, mask: np.ndarray | None = None) -> None:
        """Restart all environments."""
        if mask is not None and not mask.all():
            raise ValueError("envpool restarts all environments or none: use backend='ale' for reset_mask")
        self.start(seeds)
        seen, info = self.env.reset()
        self._expect_beginnings()
        self.take(seen, np.zeros(self.num_envs), np.zeros(self.num_envs, bool), np.zeros(self.num_envs, bool), info)

    def async_reset(self, seeds: Sequence[int | None] | None = None) -> None:
        """Restart all environments without waiting."""
        self.start(seeds)
        self.env.async_reset()
        self._expect_beginnings()

    def _expect_beginnings(self) -> None:
        """What comes next of each environment begins a game."""
        self.terminated[:] = self._game_over[:] = True

    def send(self, actions: np.ndarray, ids: np.ndarray | None = None) -> None:
        """Start a step of all environments, or of those named."""
        if self.env is None:
            raise ValueError("the environments have not been reset")
        self.env.send(np.asarray(actions, np.int32), np.arange(self.num_envs, dtype=np.int32) if ids is None else np.asarray(ids, np.int32))

    @property
    def parts(self) -> list[slice]:
        """One part: envpool's threads share all environments."""
        return [slice(0, self.num_envs)]

    def finished(self) -> Iterator[int]:
        """Wait for the step to end."""
        self.wait()
        yield 0

    def wait(self) -> None:
        """Wait for the step to end."""
        self.take(*self.env.recv())

    def take(self, seen: np.ndarray, reward: np.ndarray, terminated: np.ndarray, truncated: np.ndarray, info: dict[str, Any]) -> None:
        """Put the results in their places."""
        self.ids = i = np.asarray(info["env_id"])
        self.started[i] = begins = self.terminated[i] | self.truncated[i]
        new = begins & self._game_over[i]
        self.reward[i] = info["reward"]
        self.terminated[i], self.truncated[i] = terminated, truncated
        self._game_over[i] = (np.asarray(info["terminated"]) != 0) | truncated
        self.ram[i], self.lives[i] = info["ram"], info["lives"]
        self.episode_return[i] = np.where(new, 0, self.episode_return[i] + self.reward[i])
        self.episode_length[i] = np.where(new, 0, self.episode_length[i] + ~begins)
        if self._frames:
            self.screen[i, 0] = seen.transpose(0, 2, 3, 1)

    def close(self) -> None:
        """Give the emulators back."""
        if self.env is not None:
            self.env.close()


class EnvpoolVectorEnv(ObjectVectorEnv):
    """Many instances of a game on envpool. Made by `make_vec` with `backend="envpool"`.

    With `batch_size` below `num_envs` it is asynchronous, as envpool is: `async_reset`, then `recv` and `send` instead of `reset` and
    `step`; `info["env_id"]` tells whose the results are. What observations remember stays with its environment.
    """

    pool: EnvpoolPool

    def __init__(
        self,
        game: Game,
        num_envs: int,
        mode: Mode,
        obs: Wanted | None,
        p: Protocol,
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
        def refuse(condition: bool, reason: str) -> None:
            if condition:
                raise ValueError(f"{reason}: use backend='ale'")

        kinds = wanted(mode, obs)
        screens = {s for k in (kinds.values() if isinstance(kinds, dict) else [kinds]) for s in k.screens}
        frames = mode in ("vem", "both") or bool(screens)
        refuse("gray" in screens, "envpool gives no grey frames that are not pooled and resized")
        refuse(frames and p.frame_skip != 1, "envpool shows the brighter of two frames where it skips some, so frames need frame_skip=1")
        refuse(frames and game.screen[0] != ROWS, f"envpool crops screens to {ROWS} rows, {game.name} has {game.screen[0]}")
        refuse(autoreset_mode != AutoresetMode.NEXT_STEP, "envpool has next-step autoreset only")
        refuse(not isinstance(p.frame_skip, int), "envpool has no random frame skip")
        refuse(hook is not None, "envpool cannot write RAM, so there are no hooks")
        refuse(render_mode is not None, "envpool renders by itself only")
        for name, value in (("game_mode", game_mode), ("game_difficulty", game_difficulty)):
            refuse(value is not None and not isinstance(value, int | np.integer), f"envpool takes one {name} for all environments")
        options = {"batch_size": batch_size or num_envs, "num_threads": num_workers or 0}
        options |= {"mode": -1 if game_mode is None else game_mode, "difficulty": -1 if game_difficulty is None else game_difficulty}
        if not 1 <= options["batch_size"] <= num_envs:
            raise ValueError(f"batch_size must be 1 to num_envs {num_envs}, got {batch_size}")
        self.batch_size: int = options["batch_size"]
        pool = EnvpoolPool(game, num_envs, p, frames=frames, **options)
        super().__init__(pool, mode, obs, autoreset_mode=autoreset_mode, ram_info=ram_info)

    def _sync(self) -> None:
        if self.batch_size < self.num_envs:
            raise ValueError("with batch_size below num_envs use async_reset, recv and send instead of reset and step")

    def reset(self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Restart all environments; a seed only the first time.

        Raises:
            ValueError: a seed after the first reset, a reset_mask, or an asynchronous environment.
        """
        self._sync()
        return super().reset(seed=seed, options=options)

    def step_async(self, actions: Any) -> None:
        """Start a step without waiting for it."""
        self._sync()
        super().step_async(actions)

    def async_reset(self, seed: int | Sequence[int] | None = None) -> None:
        """Restart all environments; `recv` gives those that are ready first."""
        self.pool.async_reset(None if seed is None else [seed + i for i in range(self.num_envs)] if isinstance(seed, int) else seed)

    def send(self, actions: np.ndarray, env_id: np.ndarray) -> None:
        """Start a step of the environments named: actions int `[n]`, env_id int `[n]`."""
        self.pool.send(actions, env_id)

    def recv(self) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Results of the `batch_size` environments that are ready first; `info["env_id"]` says which."""
        self.pool.wait()
        p, ids = self.pool, self.pool.ids
        part = self._parts[0]
        arrays, memory = {name: a[ids] for name, a in part.arrays.items()}, jax.tree.map(lambda a: np.asarray(a)[ids], part.memory)
        made, memory, objects = self._look_at(arrays, memory)
        part.memory = self._placed(ids, memory, part.memory)
        part.before = self._placed(ids, jax.tree.map(lambda a: np.asarray(a)[ids], part.objects), part.before) if part.objects else {}
        part.objects = self._placed(ids, objects, part.objects)
        reward = p.reward[ids]
        info = {k: v[ids] for k, v in self._info().items()} | {"env_id": ids}
        seen = self._given([(made, arrays, objects)])
        return seen, np.sign(reward) if p.protocol.clip_rewards else reward, p.terminated[ids], p.truncated[ids], info

    def _placed(self, ids: np.ndarray, new: Any, old: Any) -> Any:
        """Rows of the new in their places among all environments'."""

        def place(a: Any, b: Any) -> np.ndarray:
            out = np.zeros((self.num_envs, *a.shape[1:]), a.dtype) if b is None else np.array(b)
            out[ids] = a
            return out

        return jax.tree.map(place, new, old) if old else jax.tree.map(lambda a: place(a, None), new)

    def xla(self) -> tuple[Any, Callable[[Any, jax.Array], tuple[Any, tuple[Any, jax.Array, jax.Array, jax.Array, dict[str, Any]]]]]:
        """The environments as a pure function for `jax.jit` and `jax.lax.scan`, from where they are now.

        Returns:
            `(state, step)`: `step(state, actions)`, actions int32 `[num_envs]`, gives the next state and (observation, reward, terminated,
            truncated, info), info with `lives` and `ram`. The emulators are the same as `reset` and `step` use: use one or the other.

        Raises:
            ValueError: they have not been reset, are asynchronous, or frames are wanted.
        """
        self._sync()
        if self.pool.env is None:
            raise ValueError("the environments have not been reset")
        if self.mode in ("vem", "both") or any(k.screens for k in self.kinds.values()):
            raise ValueError("xla() gives RAM and what comes of it, no frames")
        handle, _, _, env_step = self.pool.env.xla()
        seeing, kinds, clip = look(self.game, self.mode, self.kinds), self.kinds, self.pool.protocol.clip_rewards

        def step(state: Any, actions: jax.Array) -> tuple[Any, tuple[Any, jax.Array, jax.Array, jax.Array, dict[str, Any]]]:
            handle, memory, over = state
            handle, (_, _, terminated, truncated, info) = env_step(handle, actions)
            order = jnp.argsort(info["env_id"])
            terminated, truncated, ram, lives, reward = (
                a[order] for a in (terminated, truncated, info["ram"], info["lives"], info["reward"])
            )
            made, memory, objects = seeing(ram, None, None, over, memory)
            seen = {name: made[name] if isinstance(kind, Computed) else kind.source({"ram": ram}, objects) for name, kind in kinds.items()}
            out = (seen[""] if self._single else seen, jnp.sign(reward) if clip else reward, terminated, truncated)
            return (handle, memory, terminated | truncated), (*out, {"lives": lives, "ram": ram})

        over = jnp.asarray(self.pool.terminated | self.pool.truncated)
        return (handle, jax.tree.map(jnp.asarray, self._parts[0].memory), over), step
