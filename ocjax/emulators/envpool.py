"""The `envpool` backend: envpool's threads step the emulators.

Envpool crops screens to 210 rows and returns the maximum of the last two frames. A game begins with
at least one no-op, so `noop_max` 0 means 1, and with one FIRE if `fire_reset` is on. Episodes are
truncated only after whole steps.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import envpool
import numpy as np
from gymnasium.error import AlreadyPendingCallError, NoAsyncCallError

from ocjax.emulators.checks import NOT_RESET, action_array, index_array, seed_list
from ocjax.emulators.pool import EmulatorPool, StartReport
from ocjax.emulators.process import WorkerError
from ocjax.emulators.settings import Settings
from ocjax.emulators.start import action_set, load_emulator
from ocjax.emulators.worker.interface import EmulatorArrays
from ocjax.extraction.game import Game

ROWS = 210  # of envpool's frames
_SEEDS = 2**31  # number of seeds


class EnvpoolPool(EmulatorPool):
    """Emulators of one game that envpool steps.

    `screen` and `rgb` are the same array, uint8 `[N, 1, 210, 160, 3]`, and `frame_number` excludes
    the no-ops at the start of a game.

    Args:
        game: the game; its ROM is checked.
        frames: whether frames are recorded.
        options: further options of `envpool.make`.
    """

    def __init__(
        self, game: Game, num_envs: int, settings: Settings, *, frames: bool, **options: Any
    ) -> None:
        self.game, self.num_envs, self.settings = game, num_envs, settings
        self.actions = action_set(load_emulator(game), settings)
        self.shards = [slice(0, num_envs)]  # envpool's threads share all environments
        self.env: Any = None  # envpool's environments, or None before the first reset
        self._batch_size = options["batch_size"]
        # Environments with a pending result: their step or reset has begun.
        self._busy = np.zeros(num_envs, bool)
        self._steps = self._awaited_steps = 0
        self._closed = False
        self.ids = np.arange(num_envs)  # the environments of the last results
        assert isinstance(settings.frame_skip, int)  # `_refuse_unsupported` rejects pairs
        self._frame_skip, self._frames, self._options = settings.frame_skip, frames, options
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
            game_over=np.ones(num_envs, bool),
            executed=np.zeros(num_envs, np.int32),  # unknown
            started=np.ones(num_envs, bool),
        )

    def _start(self, seeds: Sequence[int | None] | None) -> None:
        """Make envpool's environments at the first call."""
        self.require_open()
        if self._busy.any():
            raise AlreadyPendingCallError(
                "a step or a reset is pending: receive its results first, by step_wait() or recv()",
                "step",
            )
        if self.env is not None:
            if seeds is not None:
                raise ValueError(
                    "envpool takes seeds when it starts, at the first reset: make new "
                    "environments for new seeds"
                )
            return
        if seeds is None:
            seeds = np.random.default_rng().integers(_SEEDS, size=self.num_envs).tolist()
        seeds = seed_list(seeds, self.num_envs)
        if any(s is None or s >= _SEEDS for s in seeds):
            raise ValueError(
                f"envpool needs a seed below 2**31 for every environment, or for none, got {seeds}"
            )
        s = self.settings
        height, width = (ROWS, 160) if self._frames else (1, 1)
        self.env = envpool.make(
            f"{self.game.name}-v5",
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
            max_episode_steps=min(
                s.max_episode_frames // self._frame_skip,
                s.max_episode_steps or s.max_episode_frames,
            ),
            **self._options,
        )

    def reset(
        self,
        seeds: Sequence[int | None] | None = None,
        mask: np.ndarray | None = None,
        report: StartReport | None = None,
    ) -> None:
        """Start new episodes in all environments.

        Only the first reset takes seeds; `report` is unused.
        """
        if mask is not None and not mask.all():
            raise ValueError(
                "envpool restarts all environments or none: use backend='ale' for reset_mask"
            )
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
        """Make the next result of each environment start a game."""
        self.terminated[:] = self.game_over[:] = True

    @contextmanager
    def _discarding(self) -> Iterator[None]:
        """Discard envpool's environments if a call is interrupted.

        The pending results are unknown then.
        """
        try:
            yield
        except BaseException:
            self.env, self._steps = None, self._awaited_steps
            self._busy[:] = False
            raise

    def send(
        self,
        actions: np.ndarray,
        ids: np.ndarray | None = None,
        *,
        strengths: np.ndarray | None = None,
    ) -> None:
        """Start a step of all environments, or of the given ones without pending results."""
        if strengths is not None:
            self._refuse("paddles' speeds")
        ids = np.arange(self.num_envs) if ids is None else index_array(ids, self.num_envs)
        actions = action_array(actions, len(ids), len(self.actions))
        self.require_open()
        if self.env is None:
            raise ValueError(NOT_RESET)
        if self._busy[ids].any():
            pending = ids[self._busy[ids]].tolist()
            raise AlreadyPendingCallError(
                f"a step of environments {pending} is pending: receive its results first", "step"
            )
        with self._discarding():
            self._busy[ids] = True
            self._steps += 1
            self.env.send(actions.astype(np.int32), ids.astype(np.int32))

    def as_completed(self) -> Iterator[int]:
        """Wait for the only shard; with a batch size, for the first environments to finish."""
        self.require_open()
        if self._busy.sum() < self._batch_size:
            raise NoAsyncCallError(
                f"{self._busy.sum()} environments are stepping, and results come for "
                f"{self._batch_size} together: start more steps",
                "step",
            )
        with self._discarding():
            frames, _, terminated, truncated, info = self.env.recv()
            self._store(frames, terminated, truncated, info)
            self._awaited_steps = self._steps
        yield 0

    @property
    def steps(self) -> int:
        """The number of started steps."""
        return self._steps

    def require_open(self) -> None:
        """See `EmulatorPool.require_open`."""
        if self._closed:
            raise WorkerError("the environments are closed: create new ones")

    def _store(
        self,
        frames: np.ndarray,
        terminated: np.ndarray,
        truncated: np.ndarray,
        info: dict[str, Any],
    ) -> None:
        """Write results to the rows of their environments."""
        arrays = self.arrays
        self.ids = i = np.asarray(info["env_id"])
        self._busy[i] = False
        arrays.started[i] = begins = arrays.terminated[i] | arrays.truncated[i]
        new_game = begins & arrays.game_over[i]
        arrays.reward[i] = info["reward"]
        arrays.terminated[i], arrays.truncated[i] = terminated, truncated
        arrays.game_over[i] = (np.asarray(info["terminated"]) != 0) | truncated
        arrays.ram[i], arrays.lives[i] = info["ram"], info["lives"]
        arrays.episode_return[i] = np.where(
            new_game, 0, arrays.episode_return[i] + arrays.reward[i]
        )
        arrays.episode_length[i] = np.where(new_game, 0, arrays.episode_length[i] + ~begins)
        arrays.frame_number[i] = arrays.episode_length[i] * self._frame_skip
        if arrays.rgb is not None:
            arrays.rgb[i, 0] = frames.transpose(0, 2, 3, 1)

    def close(self) -> None:
        """See `EmulatorPool.close`."""
        if self.env is not None:
            self.env.close()
        self.env, self._closed = None, True
