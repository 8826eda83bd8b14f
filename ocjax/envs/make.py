"""Functions that make environments: `make_vec` and `make`."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, Literal, Never

import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode

from ocjax._extras import extras
from ocjax.emulators.ale import WORKER_TIMEOUT, AlePool
from ocjax.emulators.hooks import Hooks
from ocjax.emulators.settings import Settings, settings
from ocjax.emulators.worker.interface import DISABLED, NEXT_STEP, SAME_STEP, SCREENS
from ocjax.envs.continuous import DEFAULT_THRESHOLD, ContinuousActions
from ocjax.envs.protocols import preset_of
from ocjax.envs.requests import Mode, Request, requested_kinds, required_screens
from ocjax.envs.rewards import RewardFunction
from ocjax.envs.single import ObjectEnv
from ocjax.envs.spelling import accepts_other_names, no_option
from ocjax.envs.vector import RENDER_MODES, ObjectVectorEnv
from ocjax.extraction.game import Game
from ocjax.extraction.names import env_id
from ocjax.extraction.registry import load

AUTORESET = {
    AutoresetMode.NEXT_STEP: NEXT_STEP,
    AutoresetMode.SAME_STEP: SAME_STEP,
    AutoresetMode.DISABLED: DISABLED,
}
# Options that `make` lacks.
_VECTOR_ONLY = (
    "num_envs",
    "num_workers",
    "worker_timeout",
    "autoreset_mode",
    "backend",
    "batch_size",
)


@accepts_other_names
def make_vec(
    game: str | Game,
    num_envs: int = 1,
    *,
    preset: str | None = None,
    frame_skip: int | tuple[int, int] | None = None,
    repeat_action_probability: float | None = None,
    max_episode_frames: int | None = None,
    max_episode_steps: int | None = None,
    full_action_space: bool | None = None,
    noop_max: int | None = None,
    fire_reset: bool | None = None,
    clip_rewards: bool | None = None,
    episodic_life: bool | None = None,
    game_mode: int | Sequence[int | None] | None = None,
    game_difficulty: int | Sequence[int | None] | None = None,
    continuous: bool = False,
    continuous_action_threshold: float = DEFAULT_THRESHOLD,
    hook: Hooks = None,
    reward_fn: RewardFunction | None = None,
    mode: Mode = "rem",
    obs: Request | None = None,
    hud: bool = True,
    ram_info: bool = False,
    render_mode: str | None = None,
    backend: Literal["ale", "envpool"] = "ale",
    num_workers: int | None = None,
    batch_size: int | None = None,
    worker_timeout: float | None = WORKER_TIMEOUT,
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    **unknown: Never,
) -> ObjectVectorEnv:
    """Make a vector environment: many instances of a game whose observations are objects.

    Worker processes step the instances. The options have three groups:

    - the game's behaviour: `preset` to `reward_fn`
    - the observation: `mode` to `render_mode`
    - the execution: `backend` to `autoreset_mode`

    ale-py's names `frameskip`, `difficulty` and `max_num_frames_per_episode`, an integer as `mode`,
    and OCAtari's modes "ram" and "vision" also work.

    Args:
        game: the game's name in any of the usual spellings, or a `Game`. An id of version 0 or 4
            ("PongNoFrameskip-v4") implies a preset, which other options must not contradict.
        num_envs: number of instances.
        preset: a named set of settings: "v5" (Gymnasium's, the default), "v4", "deterministic-v4",
            "noframeskip", "dqn", "machado", or "v0", "deterministic-v0" and "noframeskip-v0", which
            have sticky actions.
        frame_skip: see `Settings`. This option and the next eight override the preset.
        repeat_action_probability: see `Settings`.
        max_episode_frames: see `Settings`.
        max_episode_steps: see `Settings`.
        full_action_space: see `Settings`.
        noop_max: see `Settings`.
        fire_reset: see `Settings`.
        clip_rewards: see `Settings`.
        episodic_life: see `Settings`.
        game_mode: ale-py's number of the game mode: one for all instances, or one for each.
        game_difficulty: ale-py's number of the game difficulty, given in the same way.
        continuous: whether actions are continuous, as in ale-py, float32 `[3]`: the joystick's
            deflection from 0 to 1 (also the speed of a paddle), its angle in radians from -pi to
            pi, and its button from 0 to 1. All 18 actions are available.
        continuous_action_threshold: the deflection above which a joystick's contact closes, and the
            same for the button.
        hook: functions that edit the RAM of each instance before every emulated frame, or names of
            variations such as "Freeway:stop_all_cars"; see `AlePool`.
        reward_fn: a function, compiled by JAX, that returns one environment's reward from the
            objects before a step, the objects after it (REM's if the mode extracts them) and the
            action. `info["reward"]` is then the game's own reward. Next-step autoreset ignores the
            action of an episode's first step; this step has reward 0.
        mode: "rem" (objects from RAM, without pixels), "vem" (objects from the screen), "both", or
            "raw" (no objects).
        obs: the observation: "objects" (a Dict of the fields of `Objects`), "vector", "dqn",
            "pixels", "ram", "terrain", "object_masks", "binary_masks", "class_masks" or "planes",
            or an instance of a class of `ocjax.envs` with options. A list of names, or a dict of
            names or instances, gives a Dict of observations. The default is "objects", or "ram" in
            mode "raw".
        hud: whether score, lives and other display objects are included.
        ram_info: whether `info` contains the RAM.
        render_mode: "rgb_array", or "objects" for frames with the objects drawn over them.
        backend: "ale" (worker processes with ale-py) or "envpool" (needs the extra `envpool`;
            `ocjax.envs.envpool` lists its limits).
        num_workers: number of processes (envpool: threads); by default one per core. With 0,
            instances are stepped in this process.
        batch_size: envpool only: the number of environments whose results `recv` returns.
        worker_timeout: seconds that a worker process may take to reply, or None for no limit.
        autoreset_mode: Gymnasium's NEXT_STEP, SAME_STEP or DISABLED.
        unknown: other options raise TypeError.

    Raises:
        ValueError: the game or an option's value is unknown, an option contradicts the id, the ROM
            is the wrong one, a hook is a variation of another game, or the backend does not support
            an option.
        TypeError: an option does not exist or is given under two names, a hook is not a function or
            a name, a hook cannot be sent to worker processes, `reward_fn` is not a function, or a
            game mode or difficulty is not an integer.
        MemoryError: the instances do not fit into memory.
        MissingExtraError: the extra `envpool` is not installed; a ModuleNotFoundError.
        WorkerError: a worker process failed to start.
    """
    for name in unknown:
        raise no_option(name, list(inspect.signature(make_vec).parameters)[:-1])
    overrides: dict[str, Any] = {
        "frame_skip": frame_skip,
        "repeat_action_probability": repeat_action_probability,
        "max_episode_frames": max_episode_frames,
        "max_episode_steps": max_episode_steps,
        "full_action_space": full_action_space,
        "noop_max": noop_max,
        "fire_reset": fire_reset,
        "clip_rewards": clip_rewards,
        "episodic_life": episodic_life,
    }
    preset = (preset_of(game, preset, **overrides) if isinstance(game, str) else preset) or "v5"
    resolved, autoreset = _resolve(game, hud), AutoresetMode(autoreset_mode)
    if not isinstance(continuous, bool | np.bool):
        raise ValueError(f"continuous must be True or False, got {continuous!r}")
    chosen = settings(preset, **overrides | ({"full_action_space": True} if continuous else {}))
    if backend not in _BACKENDS:
        raise ValueError(f"backend must be 'ale' or 'envpool', got {backend!r}")
    thresholds = ContinuousActions(continuous_action_threshold)
    variant = {"game_mode": game_mode, "game_difficulty": game_difficulty}
    envs = _BACKENDS[backend](
        resolved,
        num_envs,
        mode,
        obs,
        chosen,
        num_workers=num_workers,
        batch_size=batch_size,
        hook=hook,
        worker_timeout=worker_timeout,
        reward_fn=reward_fn,
        autoreset_mode=autoreset,
        render_mode=render_mode,
        ram_info=ram_info,
        continuous=thresholds if continuous else None,
        **variant,
    )
    if continuous:
        variant |= {"continuous": True, "continuous_action_threshold": continuous_action_threshold}
    envs.spec = _spec(
        resolved,
        mode,
        obs,
        chosen,
        preset=preset,
        num_envs=num_envs,
        backend=backend,
        autoreset_mode=autoreset.value,
        **variant,
    )
    return envs


def _make_ale(
    game: Game,
    num_envs: int,
    mode: Mode,
    obs: Request | None,
    chosen: Settings,
    *,
    batch_size: int | None,
    reward_fn: RewardFunction | None,
    autoreset_mode: AutoresetMode,
    render_mode: str | None,
    ram_info: bool,
    continuous: ContinuousActions | None,
    **pool_options: Any,
) -> ObjectVectorEnv:
    if batch_size is not None:
        raise ValueError(
            "batch_size is envpool's: backend 'ale' steps all environments together (step_async "
            "and step_wait)"
        )
    screens = _recorded_screens(mode, obs, render_mode)
    pool = AlePool(
        game, num_envs, chosen, screens=screens, autoreset=AUTORESET[autoreset_mode], **pool_options
    )
    return ObjectVectorEnv(
        pool,
        mode,
        obs,
        reward_fn=reward_fn,
        autoreset_mode=autoreset_mode,
        render_mode=render_mode,
        ram_info=ram_info,
        continuous=continuous,
    )


def _make_envpool(
    *args: Any, reward_fn: RewardFunction | None, worker_timeout: float | None, **options: Any
) -> ObjectVectorEnv:
    if reward_fn is not None:
        raise ValueError(
            "backend 'envpool' has no reward_fn: its asynchronous steps return environments in "
            "any order"
        )
    with extras():
        from ocjax.envs.envpool import EnvpoolVectorEnv
    return EnvpoolVectorEnv(*args, **options)


_BACKENDS: Mapping[str, Callable[..., ObjectVectorEnv]] = {
    "ale": _make_ale,
    "envpool": _make_envpool,
}


def _resolve(game: str | Game, hud: bool) -> Game:
    if not isinstance(game, Game):
        return load(game, hud=hud)
    return game if hud else game.without_hud()


def _recorded_screens(mode: Mode, obs: Request | None, render_mode: str | None) -> tuple[str, ...]:
    if render_mode is not None and render_mode not in RENDER_MODES:
        raise ValueError(
            f"render_mode must be one of {RENDER_MODES} or None, got {render_mode!r}; "
            "gymnasium.make, not make_vec, adds 'human' and lists "
            "such as 'rgb_array_list' to them"
        )
    if render_mode == "objects" and mode == "raw":
        raise ValueError("render_mode 'objects' draws objects, which mode 'raw' does not extract")
    kinds, _ = requested_kinds(mode, obs)
    needed = required_screens(mode, kinds) | ({"rgb"} if render_mode else set())
    return tuple(name for name in SCREENS if name in needed)


def _spec(game: Game, mode: str, obs: Any, chosen: Settings, **options: Any) -> EnvSpec:
    given = {name: value for name, value in options.items() if value is not None}
    kwargs = {
        "game": game.name,
        "mode": mode,
        "obs": obs,
        "hud": game.hud,
        **chosen.to_dict(),
        **given,
    }
    return EnvSpec(
        env_id(game.name),
        entry_point="ocjax.envs.make:make",
        vector_entry_point="ocjax.envs.make:make_vec",
        kwargs=kwargs,
    )


@accepts_other_names
def make(
    game: str | Game,
    *,
    preset: str | None = None,
    frame_skip: int | tuple[int, int] | None = None,
    repeat_action_probability: float | None = None,
    max_episode_frames: int | None = None,
    max_episode_steps: int | None = None,
    full_action_space: bool | None = None,
    noop_max: int | None = None,
    fire_reset: bool | None = None,
    clip_rewards: bool | None = None,
    episodic_life: bool | None = None,
    game_mode: int | None = None,
    game_difficulty: int | None = None,
    continuous: bool = False,
    continuous_action_threshold: float = DEFAULT_THRESHOLD,
    hook: Hooks = None,
    reward_fn: RewardFunction | None = None,
    mode: Mode = "rem",
    obs: Request | None = None,
    hud: bool = True,
    ram_info: bool = False,
    render_mode: str | None = None,
    **unknown: Never,
) -> ObjectEnv:
    """Make a single environment: one instance of a game, stepped in this process.

    `make_vec` explains the options. `gymnasium.make("ocjax/Pong-v5")` makes the same environment
    inside Gymnasium's wrappers.

    Raises:
        ValueError: the game or an option's value is unknown, or the ROM is the wrong one.
        TypeError: an option does not exist, or only vector environments have it.
    """
    for name in unknown:
        if name in _VECTOR_ONLY:
            raise TypeError(f"{name} is an option of make_vec: a single environment has none")
        raise no_option(name, list(inspect.signature(make).parameters)[:-1])
    envs = make_vec(
        game,
        preset=preset,
        frame_skip=frame_skip,
        repeat_action_probability=repeat_action_probability,
        max_episode_frames=max_episode_frames,
        max_episode_steps=max_episode_steps,
        full_action_space=full_action_space,
        noop_max=noop_max,
        fire_reset=fire_reset,
        clip_rewards=clip_rewards,
        episodic_life=episodic_life,
        game_mode=game_mode,
        game_difficulty=game_difficulty,
        continuous=continuous,
        continuous_action_threshold=continuous_action_threshold,
        hook=hook,
        reward_fn=reward_fn,
        mode=mode,
        obs=obs,
        hud=hud,
        ram_info=ram_info,
        render_mode=render_mode,
        num_workers=0,
        autoreset_mode=AutoresetMode.DISABLED,
    )
    env = ObjectEnv(envs)
    assert envs.spec is not None
    env.spec = replace(
        envs.spec,
        kwargs={
            name: value for name, value in envs.spec.kwargs.items() if name not in _VECTOR_ONLY
        },
    )
    return env


# Gymnasium reads these modes to offer "human", "rgb_array_list" and "objects_list".
vars(make)["metadata"] = {"render_modes": list(RENDER_MODES)}
