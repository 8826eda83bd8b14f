"""Vector environments whose observations are objects."""

from collections.abc import Sequence
from typing import Any, Literal

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ocjax.envs.ale import AlePool
from ocjax.objects import Objects
from ocjax.registry import load
from ocjax.spec import Game

Mode = Literal["rem", "vem", "both", "raw"]
MODES = ("rem", "vem", "both", "raw")


def object_space(game: Game) -> gym.spaces.Dict:
    """The space of a game's `Objects` for one environment, as a Dict of its fields."""
    n, (height, width) = game.num_slots, game.screen
    integers = np.iinfo(np.int32)
    return gym.spaces.Dict(
        xywh=gym.spaces.Box(0, max(height, width), (n, 4), np.int16),
        valid=gym.spaces.MultiBinary(n),
        orientation=gym.spaces.Box(0, 15, (n,), np.int8),
        value=gym.spaces.Box(integers.min, integers.max, (n,), np.int32),
        rgb=gym.spaces.Box(0, 255, (n, 3), np.uint8),
    )


def _as_dict(objects: Objects) -> dict[str, np.ndarray]:
    fields = {name: np.array(getattr(objects, name)) for name in ("xywh", "valid", "orientation", "value", "rgb")}
    return fields | {"valid": fields["valid"].astype(np.int8)}


class ObjectVectorEnv(VectorEnv):
    """Many instances of a game; observations are the objects of each. Made by `make_vec`.

    Observations: the fields of `Objects` as a dict of arrays `[num_envs, N, ...]` (mode "rem" or "vem"), a dict of both ("both"), or
    the RAM, uint8 `[num_envs, 128]` ("raw"). VEM sees the last emulated frame of a step. `info` has `lives` and `frame_number` (emulated
    frames of the episode). An environment whose episode ended restarts in the step after, whose action is ignored (next-step
    autoreset).
    """

    def __init__(self, game: Game, num_envs: int, *, mode: Mode = "rem", **pool: Any) -> None:
        if mode not in MODES:
            raise ValueError(f"mode must be one of {MODES}, got {mode!r}")
        self.game, self.mode, self.num_envs = game, mode, num_envs
        self.pool = AlePool(game, num_envs, screens=mode in ("vem", "both"), **pool)
        self.metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP, "render_modes": []}
        space = object_space(game)
        spaces = {
            "rem": space,
            "vem": space,
            "both": gym.spaces.Dict(rem=space, vem=space),
            "raw": gym.spaces.Box(0, 255, (128,), np.uint8),
        }
        self.single_observation_space = spaces[mode]
        self.single_action_space = gym.spaces.Discrete(len(self.pool.actions))
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def objects(self) -> Objects | dict[str, Objects]:
        """The present objects as `Objects` of batch shape `[num_envs]`; a dict of both in mode "both"."""
        if self.mode == "raw":
            raise ValueError("mode 'raw' extracts no objects")
        out = {}
        if self.mode in ("rem", "both"):
            out["rem"] = self.game.rem(self.pool.ram)
        if self.mode in ("vem", "both"):
            out["vem"] = self.game.vem(self.pool.screen[:, 1])
        return out if self.mode == "both" else out[self.mode]

    def _observe(self) -> Any:
        if self.mode == "raw":
            return self.pool.ram.copy()
        seen = self.objects()
        return _as_dict(seen) if isinstance(seen, Objects) else {k: _as_dict(v) for k, v in seen.items()}

    def _info(self) -> dict[str, Any]:
        everywhere = np.ones(self.num_envs, bool)
        return {
            "lives": self.pool.lives.copy(), "_lives": everywhere,
            "frame_number": self.pool.frame_number.copy(), "_frame_number": everywhere,
        }  # fmt: skip

    def reset(self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Restart all environments.

        Args:
            seed: environment i gets `seed + i`, or the i-th of several.
            options: may hold `reset_mask`, bool `[num_envs]`: restart only these.

        Raises:
            ValueError: a negative seed, a wrong number of seeds, a wrong mask, an unknown option.
        """
        options = dict(options or {})
        mask = options.pop("reset_mask", None)
        if options:
            raise ValueError(f"unknown options {sorted(options)}; there is reset_mask")
        if mask is not None and (not isinstance(mask, np.ndarray) or mask.dtype != bool or mask.shape != (self.num_envs,)):
            raise ValueError(f"reset_mask must be a bool array of shape ({self.num_envs},), got {mask!r}")
        seeds = None if seed is None else [seed + i for i in range(self.num_envs)] if isinstance(seed, int | np.integer) else list(seed)
        if seeds is not None and (len(seeds) != self.num_envs or any(s is not None and s < 0 for s in seeds)):
            raise ValueError(f"seed must be a number >= 0 or {self.num_envs} of them, got {seed!r}")
        self.pool.reset(seeds, mask)
        return self._observe(), self._info()

    def step_async(self, actions: Any) -> None:
        """Start a step without waiting for it."""
        actions = np.asarray(actions)
        if actions.shape != (self.num_envs,) or not np.issubdtype(actions.dtype, np.integer):
            raise ValueError(f"actions must be {self.num_envs} integers, got {actions.dtype} of shape {actions.shape}")
        if actions.min() < 0 or actions.max() >= len(self.pool.actions):
            raise ValueError(f"actions must be from 0 to {len(self.pool.actions) - 1}, got {actions.min()} to {actions.max()}")
        self.pool.send(actions)

    def step_wait(self) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Wait for the step that `step_async` started."""
        self.pool.wait()
        p = self.pool
        return self._observe(), p.reward.copy(), p.terminated.copy(), p.truncated.copy(), self._info()

    def step(self, actions: Any) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """One agent step of all environments: observations, rewards, terminated, truncated, info."""
        self.step_async(actions)
        return self.step_wait()

    def close_extras(self, **kwargs: Any) -> None:
        """End the worker processes."""
        self.pool.close()


def make_vec(
    game: str | Game,
    num_envs: int,
    *,
    mode: Mode = "rem",
    hud: bool = True,
    num_workers: int | None = None,
    frame_skip: int = 4,
    repeat_action_probability: float = 0.25,
    max_episode_frames: int = 108_000,
    full_action_space: bool = False,
    game_mode: int | None = None,
    game_difficulty: int | None = None,
) -> ObjectVectorEnv:
    """Many instances of a game, stepped by worker processes, with objects as observations.

    Args:
        game: name in any of the field's spellings, or a `Game`.
        num_envs: how many.
        mode: "rem" (objects from RAM, no pixel is touched), "vem" (objects from the screen), "both", or "raw" (RAM itself).
        hud: False leaves out score, lives and the like.
        num_workers: processes; by default one a core.
        frame_skip, repeat_action_probability, max_episode_frames, full_action_space: the defaults are those of gymnasium's "v5".
        game_mode, game_difficulty: as ale-py numbers them.

    Raises:
        ValueError: an unknown game, option or ROM.
        WorkerError: a worker process could not be started.
    """
    if isinstance(game, str):
        game = load(game, hud=hud)
    elif not hud:
        game = game.without_hud()
    return ObjectVectorEnv(
        game,
        num_envs,
        mode=mode,
        num_workers=num_workers,
        frame_skip=frame_skip,
        repeat_action_probability=repeat_action_probability,
        max_episode_frames=max_episode_frames,
        full_action_space=full_action_space,
        game_mode=game_mode,
        game_difficulty=game_difficulty,
    )
