"""How environments are made: many with `make_vec`, one with `make`, and under gymnasium's names."""

from collections.abc import Sequence
from typing import Any, Literal

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import iterate

from ocjax.envs.ale import Hook, States
from ocjax.envs.observations import Wanted
from ocjax.envs.protocol import Protocol, protocol
from ocjax.envs.vector import AUTORESET, Mode, ObjectVectorEnv, make_pool
from ocjax.game import Game
from ocjax.objects import Objects
from ocjax.registry import env_id, load
from ocjax.views import GameObject


def _game(game: str | Game, hud: bool) -> Game:
    if isinstance(game, str):
        return load(game, hud=hud)
    return game if hud else game.without_hud()


def _spec(game: Game, mode: str, obs: Any, p: Protocol, **more: Any) -> EnvSpec:
    """What was made, for who asks the environment later."""
    kwargs = {
        "game": game.name,
        "mode": mode,
        "obs": obs,
        "hud": game.hud,
        **p.to_dict(),
        **{k: v for k, v in more.items() if v is not None},
    }
    return EnvSpec(env_id(game.name), entry_point="ocjax.envs.make:make", vector_entry_point="ocjax.envs.make:make_vec", kwargs=kwargs)


def make_vec(
    game: str | Game,
    num_envs: int = 1,
    *,
    mode: Mode = "rem",
    backend: Literal["ale", "envpool"] = "ale",
    obs: Wanted | None = None,
    hud: bool = True,
    preset: str = "v5",
    frame_skip: int | tuple[int, int] | None = None,
    repeat_action_probability: float | None = None,
    max_episode_frames: int | None = None,
    full_action_space: bool | None = None,
    noop_max: int | None = None,
    fire_reset: bool | None = None,
    clip_rewards: bool | None = None,
    episodic_life: bool | None = None,
    game_mode: int | Sequence[int | None] | None = None,
    game_difficulty: int | Sequence[int | None] | None = None,
    autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    num_workers: int | None = None,
    batch_size: int | None = None,
    hook: Hook | None = None,
    render_mode: str | None = None,
    ram_info: bool = False,
) -> ObjectVectorEnv:
    """Many instances of a game, stepped by worker processes, with objects as observations.

    Args:
        game: name in any of the field's spellings, or a `Game`.
        num_envs: how many.
        mode: "rem" (objects from RAM, no pixel is touched), "vem" (objects from the screen), "both", or "raw" (none).
        backend: "ale" (worker processes with ale-py), or "envpool" (the extra of that name; `ocjax.envs.envpool` tells what it cannot do).
        obs: "objects" (a Dict of the fields of `Objects`), "vector", "dqn", "pixels", "ram", "object_masks", "binary_masks",
            "class_masks", "planes"; one of the classes `ObjectFields`, `Vector`, `Dqn`, `Pixels`, `Ram`, `Masks` of `ocjax.envs`, with
            options; or several, as a list of names or a dict, for a Dict of observations. By default objects, in mode "raw" the RAM.
        hud: False leaves out score, lives and the like.
        preset: the protocol, by name: "v5" (gymnasium's), "v4", "deterministic-v4", "noframeskip", "dqn", "machado".
        frame_skip, repeat_action_probability, max_episode_frames, full_action_space: changes to it (see `Protocol`), and
        noop_max, fire_reset, clip_rewards, episodic_life: likewise.
        game_mode, game_difficulty: as ale-py numbers them; one for all or one an environment.
        autoreset_mode: gymnasium's NEXT_STEP, SAME_STEP or DISABLED.
        num_workers: processes (envpool: threads); by default one a core, 0 steps in this process.
        batch_size: envpool's: how many environments `recv` gives at a time.
        hook: edits the RAM of each environment before every emulated frame (see `AlePool` and `ocjax.envs.variations`).
        render_mode: "rgb_array", or "objects" for frames with the objects drawn over them.
        ram_info: whether `info` has the RAM.

    Raises:
        ValueError: an unknown game, option or ROM, or something that the backend cannot do.
        WorkerError: a worker process could not be started.
    """
    g, autoreset = _game(game, hud), AutoresetMode(autoreset_mode)
    p = protocol(
        preset, frame_skip=frame_skip, repeat_action_probability=repeat_action_probability, max_episode_frames=max_episode_frames,
        full_action_space=full_action_space, noop_max=noop_max, fire_reset=fire_reset, clip_rewards=clip_rewards,
        episodic_life=episodic_life,
    )  # fmt: skip
    if backend == "envpool":
        try:
            from ocjax.envs.envpool import EnvpoolVectorEnv
        except ModuleNotFoundError as error:
            raise ModuleNotFoundError(f"backend 'envpool' needs the extra of that name, pip install 'ocjax[envpool]': {error}") from error

        envs = EnvpoolVectorEnv(
            g, num_envs, mode, obs, p, autoreset_mode=autoreset, num_workers=num_workers, batch_size=batch_size, game_mode=game_mode,
            game_difficulty=game_difficulty, hook=hook, render_mode=render_mode, ram_info=ram_info,
        )  # fmt: skip
    elif backend == "ale":
        if batch_size is not None:
            raise ValueError("batch_size is envpool's: backend 'ale' steps all environments together (step_async and step_wait)")
        pool = make_pool(
            g, num_envs, mode, obs, p, render_mode=render_mode, num_workers=num_workers, autoreset=AUTORESET[autoreset], hook=hook,
            game_mode=game_mode, game_difficulty=game_difficulty,
        )  # fmt: skip
        envs = ObjectVectorEnv(pool, mode, obs, autoreset_mode=autoreset, render_mode=render_mode, ram_info=ram_info)
    else:
        raise ValueError(f"backend must be 'ale' or 'envpool', got {backend!r}")
    envs.spec = _spec(
        g, mode, obs, p, preset=preset, num_envs=num_envs, backend=backend, game_mode=game_mode, game_difficulty=game_difficulty,
        autoreset_mode=autoreset.value,
    )  # fmt: skip
    return envs


class ObjectEnv(gym.Env):
    """One instance of a game, in this process; the options are those of `make_vec`, to which the observations are equal.

    Made by `gymnasium.make("ocjax/Pong-v5")`, or `ocjax.envs.make`, without gymnasium's wrappers around it.
    """

    def __init__(self, envs: ObjectVectorEnv) -> None:
        self.envs, self.game = envs, envs.game
        self.observation_space, self.action_space = envs.single_observation_space, envs.single_action_space
        self.metadata = {k: v for k, v in envs.metadata.items() if k != "autoreset_mode"}
        self.render_mode = envs.render_mode

    def _first(self, seen: Any) -> Any:
        return next(iter(iterate(self.envs.observation_space, seen)))

    @staticmethod
    def _info(info: dict[str, Any]) -> dict[str, Any]:
        return {k: v[0] for k, v in info.items() if not k.startswith("_")}

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Restart the game. There are no options.

        Raises:
            ValueError: a negative seed, or an option.
        """
        super().reset(seed=seed)
        if options:
            raise ValueError(f"unknown options {sorted(options)}: there are none")
        seen, info = self.envs.reset(seed=None if seed is None else [seed])
        return self._first(seen), self._info(info)

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """One agent step: observation, reward, terminated, truncated, info.

        Raises:
            ValueError: no such action, or the episode has ended.
        """
        seen, reward, terminated, truncated, info = self.envs.step(np.asarray(action).reshape(1))
        return self._first(seen), float(reward[0]), bool(terminated[0]), bool(truncated[0]), self._info(info)

    def render(self) -> Any:
        """The last frame, uint8 `[H, 160, 3]`, or larger with objects; None without a render mode."""
        frames = self.envs.render()
        return None if frames is None else frames[0]

    def close(self) -> None:
        """Give the emulator back."""
        self.envs.close()

    @property
    def objects(self) -> list[GameObject]:
        """The objects on the screen (from RAM, in mode "vem" from pixels), as OCAtari's users know them."""
        return self.envs.objects(0)

    @property
    def objects_v(self) -> list[GameObject]:
        """The objects from pixels, in modes "vem" and "both"."""
        return self.envs.objects(0, "vem")

    @property
    def tensors(self) -> Objects | dict[str, Objects]:
        """The objects as `Objects` of batch shape `[1]`, in mode "both" a dict of both methods'."""
        return self.envs.tensors

    @property
    def features(self) -> Any:
        """What each number of a "vector" observation is; see `ObjectVectorEnv.features`."""
        return self.envs.features

    @property
    def ale(self) -> Any:
        """The emulator, an `ale_py.ALEInterface`, once the game has been reset: wrappers made for ale-py's environments ask it."""
        return self.envs._ale("emulators").emulator(0)

    def get_action_meanings(self) -> list[str]:
        """Names of the actions, as ale-py's environments give them."""
        return [a.name for a in self.envs.pool.actions]

    def get_ram(self) -> np.ndarray:
        """The RAM, uint8 `[128]`."""
        return self.envs.get_ram()[0]

    def set_ram(self, address: int, value: int) -> None:
        """Write one byte; REM's objects change at once, the screen with the next step.

        Raises:
            ValueError: no such address or value.
        """
        if not (0 <= address < 128 and 0 <= value < 256):
            raise ValueError(f"an address is 0 to 127 and a value 0 to 255, got {address} and {value}")
        ram = self.envs.get_ram()
        ram[0, address] = value
        self.envs.set_ram(ram)

    def clone_state(self) -> States:
        """Save the state."""
        return self.envs.clone_state()

    def restore_state(self, states: States) -> tuple[Any, dict[str, Any]]:
        """Go back to a saved state: observation and info as they were then."""
        seen, info = self.envs.restore_state(states)
        return self._first(seen), self._info(info)


def make(game: str | Game, **options: Any) -> ObjectEnv:
    """One instance of a game in this process, with the options of `make_vec`.

    Raises:
        ValueError: an unknown game, option or ROM.
        TypeError: an option that only many instances have.
    """
    for name in ("num_envs", "num_workers", "autoreset_mode", "backend", "batch_size"):
        if name in options:
            raise TypeError(f"{name} is an option of make_vec: a single environment has none")
    envs = make_vec(game, 1, num_workers=0, autoreset_mode=AutoresetMode.DISABLED, **options)
    env = ObjectEnv(envs)
    env.spec = envs.spec
    return env


# OCAtari's names -> the protocol that an id means, and observations by its names.
_OBSERVATIONS: dict[str, Wanted] = {"ori": "pixels", "dqn": "dqn", "obj": "vector"}
_MODES: dict[str, Mode] = {"ram": "rem", "vision": "vem", "both": "both"}


def ocatari(
    env_name: str,
    mode: Literal["ram", "vision", "both"] = "ram",
    hud: bool = False,
    obs_mode: Literal["ori", "dqn", "obj"] = "ori",
    **options: Any,
) -> ObjectEnv:
    """An environment for code written on OCAtari: its constructor's names, with `.objects` as such code reads them.

    Args:
        env_name: a game in any spelling; ids of version 4 ("PongNoFrameskip-v4", "PongDeterministic-v4", "Pong-v4") mean that protocol.
        mode: "ram" (REM), "vision" (VEM), "both" (`.objects` and `.objects_v`).
        hud: whether score, lives and the like are objects.
        obs_mode: "ori" (the screen), "dqn" (four grey frames, 84 x 84), "obj" (a flat vector of the objects' features).
        options: of `make_vec`.

    Raises:
        ValueError: an unknown game, mode or option.
    """
    if mode not in _MODES or obs_mode not in _OBSERVATIONS:
        raise ValueError(f"mode must be one of {tuple(_MODES)}, obs_mode one of {tuple(_OBSERVATIONS)}, got {mode!r} and {obs_mode!r}")
    v4 = "noframeskip" if "NoFrameskip" in env_name else "deterministic-v4" if "Deterministic" in env_name else "v4"
    preset = v4 if env_name.endswith("-v4") else "v5"
    return make(env_name, mode=_MODES[mode], hud=hud, **{"preset": preset, "obs": _OBSERVATIONS[obs_mode], **options})
