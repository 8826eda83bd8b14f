"""Vector environments whose observations are objects."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import gymnasium as gym
import jax
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ocjax.envs import _worker
from ocjax.envs.ale import AlePool, States
from ocjax.envs.observations import Now, Observation, Wanted, parse
from ocjax.envs.protocol import Protocol
from ocjax.objects import Objects
from ocjax.render import overlay
from ocjax.spec import Game
from ocjax.views import GameObject, views

if TYPE_CHECKING:
    from ocjax.envs.envpool import EnvpoolPool

Mode = Literal["rem", "vem", "both", "raw"]
MODES = ("rem", "vem", "both", "raw")
RENDER_MODES = ("rgb_array", "objects")
AUTORESET = {
    AutoresetMode.NEXT_STEP: _worker.NEXT_STEP,
    AutoresetMode.SAME_STEP: _worker.SAME_STEP,
    AutoresetMode.DISABLED: _worker.DISABLED,
}
_INFO = ("lives", "frame_number", "episode_return", "episode_length")


def _row(objects: Objects, i: Any) -> Objects:
    """The objects of one environment, on the host."""
    return jax.tree.map(lambda a: np.asarray(a)[i], objects)


def merged(mask: np.ndarray, new: Any, old: Any) -> Any:
    """Trees of arrays `[num_envs, ...]`: rows of the new where the mask is set, else of the old."""

    def rows(a: Any, b: Any) -> np.ndarray:
        a, b = np.asarray(a), np.asarray(b)
        return np.where(mask.reshape(-1, *[1] * (a.ndim - 1)), a, b)

    return jax.tree.map(rows, new, old)


class ObjectVectorEnv(VectorEnv):
    """Many instances of a game; observations are the objects of each. Made by `make_vec`, which tells of the options.

    Everything that a step returns is of the same instant, the step's last emulated frame; arrays are the caller's to keep. `info` has, of
    the running game, `lives`, `frame_number` (emulated frames), `episode_return` (rewards as the game gives them) and `episode_length`
    (agent steps), `reward` (unclipped) where rewards are clipped, and `ram` on request. With same-step autoreset `final_obs` and
    `final_info` are as gymnasium's own vector environments have them; `final_info["objects"]` holds the objects of the terminal states.

    Attributes:
        tensors: the present objects as `Objects` of batch shape `[num_envs]`; in mode "both" a dict of both methods'. Their arrays are
            JAX's: `torch.from_dlpack(envs.tensors.xywh)` shares them with PyTorch.
        pool: the emulators and their arrays.
    """

    def __init__(
        self,
        pool: "AlePool | EnvpoolPool",
        mode: Mode,
        obs: Wanted | None = None,
        *,
        autoreset_mode: AutoresetMode = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        ram_info: bool = False,
    ) -> None:
        self.pool, self.game, self.mode, self.num_envs = pool, pool.game, mode, pool.num_envs
        self.metadata = {"autoreset_mode": autoreset_mode, "render_modes": list(RENDER_MODES), "render_fps": _fps(pool.protocol)}
        self.autoreset_mode, self.render_mode, self.ram_info = autoreset_mode, render_mode, ram_info
        kinds = wanted(mode, obs)
        self._single = not isinstance(kinds, dict)
        self.kinds: dict[str, Observation] = {"": kinds} if isinstance(kinds, Observation) else kinds
        spaces = {name: kind.space(self.game, mode) for name, kind in self.kinds.items()}
        self.single_observation_space = spaces[""] if self._single else gym.spaces.Dict(spaces)
        self.single_action_space = gym.spaces.Discrete(len(pool.actions))
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._look = look(self.game, mode, self.kinds)
        self._memory = {name: kind.initial(self.game, mode, self.num_envs) for name, kind in self.kinds.items()}
        self._objects: dict[str, Objects] = {}
        self._before: dict[str, Objects] = {}
        self._made: Any = None  # what the last observation was made of
        self._over = np.zeros(self.num_envs, bool)

    @property
    def tensors(self) -> Objects | dict[str, Objects]:
        """The present objects."""
        if not self._objects:
            raise ValueError("there are no objects: the mode is 'raw', or the environments have not been reset")
        return dict(self._objects) if self.mode == "both" else self._objects[self.mode]

    def objects(self, i: int, method: str | None = None) -> list[GameObject]:
        """The objects of one environment as OCAtari's users know them.

        Args:
            i: which environment.
            method: "rem" or "vem" in mode "both"; REM's by default.

        Raises:
            ValueError: nothing is extracted, or not by that method.
        """
        name = method or ("rem" if "rem" in self._objects else "vem")
        if name not in self._objects:
            raise ValueError(f"no objects by {name!r}: the mode is {self.mode!r}, or the environments have not been reset")
        before = self._before.get(name)
        continues = before is not None and not self.pool.started[i]
        return views(_row(self._objects[name], i), _row(before, i) if before is not None and continues else None)

    @property
    def features(self) -> Any:
        """What each number of a "vector" observation is: (steps ago, category, slot within it, feature); of several, a dict.

        Raises:
            AttributeError: no observation is a vector.
        """
        out = {name: kind.features_of(self.game) for name, kind in self.kinds.items() if hasattr(kind, "features_of")}  # pyright: ignore
        if not out:
            raise AttributeError("no observation is a vector: make the environments with obs='vector'")
        return out[""] if self._single else out

    def _arrays(self, final: np.ndarray | None = None) -> dict[str, np.ndarray]:
        """What observations are made of; where the mask is set, of the end of the episode."""
        names = {"ram", "started", *(s for kind in self.kinds.values() for s in kind.screens)}
        if self.mode in ("vem", "both"):
            names.add("screen")
        out = {name: getattr(self.pool, name) for name in names}
        if final is not None:
            out = {
                name: merged(final, getattr(self.pool, f"final_{name}"), a) if name != "started" else a & ~final for name, a in out.items()
            }
        return out

    def _observe(self, arrays: Mapping[str, np.ndarray]) -> tuple[Any, Any, dict[str, Objects]]:
        """What observations are made of, the new memory, and the objects."""
        screen = arrays["screen"][:, -1] if "screen" in arrays else None
        return jax.block_until_ready(self._look(arrays["ram"], screen, arrays.get("gray"), arrays["started"], self._memory))

    def _given(self, made: Any, arrays: Mapping[str, np.ndarray]) -> Any:
        """The observation, in arrays of the caller's own."""
        seen = {}
        for name, kind in self.kinds.items():
            if kind.copies:
                source = arrays[kind.copies]
                seen[name] = (source[:, -1] if kind.copies == "rgb" else source).copy()
            else:
                seen[name] = jax.tree.map(np.array, made[name])
        return seen[""] if self._single else seen

    def _update(self, mask: np.ndarray | None = None) -> Any:
        """Look at the emulators (only at those of the mask); the observation."""
        arrays = self._arrays()
        made, memory, objects = self._observe(arrays)
        before = self._objects
        if mask is not None and not mask.all():
            made, memory = merged(mask, made, self._made), merged(mask, memory, self._memory)
            objects, before = merged(mask, objects, self._objects), merged(mask, objects, self._before or self._objects)
        self._made, self._memory, self._objects, self._before = made, memory, objects, before
        return self._given(made, arrays)

    def _info(self, prefix: str = "", mask: np.ndarray | None = None) -> dict[str, Any]:
        there = np.ones(self.num_envs, bool) if mask is None else mask
        info = {name: np.copy(getattr(self.pool, prefix + name)) for name in _INFO}
        if self.pool.protocol.clip_rewards and not prefix:
            info["reward"] = np.copy(self.pool.reward)
        if self.ram_info:
            info["ram"] = np.copy(getattr(self.pool, prefix + "ram"))
        for name in list(info):
            if mask is not None:
                info[name][~mask] = 0
            info[f"_{name}"] = there.copy()
        return info

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
        if mask is not None and (
            not isinstance(mask, np.ndarray) or mask.dtype != bool or mask.shape != (self.num_envs,) or not mask.any()
        ):
            raise ValueError(f"reset_mask must be a bool array of shape ({self.num_envs},), not all False, got {mask!r}")
        if mask is not None and self._made is None and not mask.all():
            raise ValueError("the first reset must be of all environments, without reset_mask")
        seeds = None if seed is None else [seed + i for i in range(self.num_envs)] if isinstance(seed, int | np.integer) else list(seed)
        if seeds is not None and (len(seeds) != self.num_envs or any(s is not None and s < 0 for s in seeds)):
            raise ValueError(f"seed must be a number >= 0 or {self.num_envs} of them, got {seed!r}")
        self.pool.reset(seeds, mask)
        self._over[slice(None) if mask is None else mask] = False
        seen = self._update(mask)
        return seen, self._info()

    def step_async(self, actions: Any) -> None:
        """Start a step without waiting for it: the emulators run while the caller does something else."""
        actions = np.asarray(actions)
        if actions.shape != (self.num_envs,) or not np.issubdtype(actions.dtype, np.integer):
            raise ValueError(f"actions must be {self.num_envs} integers, got {actions.dtype} of shape {actions.shape}")
        if actions.min() < 0 or actions.max() >= len(self.pool.actions):
            raise ValueError(f"actions must be from 0 to {len(self.pool.actions) - 1}, got {actions.min()} to {actions.max()}")
        if self.autoreset_mode == AutoresetMode.DISABLED and self._over.any():
            raise ValueError(
                f"the episodes of environments {np.flatnonzero(self._over).tolist()} have ended and autoreset is disabled: "
                "reset them with reset(options={'reset_mask': ...})"
            )
        self.pool.send(actions)

    def step_wait(self) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Wait for the step that `step_async` started."""
        self.pool.wait()
        p = self.pool
        reward, terminated, truncated = np.array(p.reward), np.array(p.terminated), np.array(p.truncated)
        self._over = terminated | truncated
        final: dict[str, Any] = {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP and self._over.any():
            final = self._final(self._over)
        seen = self._update()
        if p.protocol.clip_rewards:
            reward = np.sign(reward)
        return seen, reward, terminated, truncated, self._info() | final

    def _final(self, over: np.ndarray) -> dict[str, Any]:
        """What was there at the end of the episodes that just ended, before the next ones began."""
        arrays = self._arrays(final=over)
        made, _, objects = self._observe(arrays)
        seen = self._given(made, arrays)
        last = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(over):
            last[i] = jax.tree.map(lambda a, i=i: a[i].copy(), seen)
        info = self._info("final_", over)
        if objects:
            name = "rem" if "rem" in objects else "vem"
            info["objects"], info["_objects"] = np.full(self.num_envs, None, object), over.copy()
            for i in np.flatnonzero(over):
                before = self._objects.get(name)
                info["objects"][i] = views(_row(objects[name], i), None if before is None else _row(before, i))
        return {"final_obs": last, "_final_obs": over.copy(), "final_info": info, "_final_info": over.copy()}

    def step(self, actions: Any) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """One agent step of all environments: observations, rewards, terminated, truncated, info."""
        self.step_async(actions)
        return self.step_wait()

    def get_ram(self) -> np.ndarray:
        """The RAM of all environments, uint8 `[num_envs, 128]`."""
        return np.array(self.pool.ram)

    def set_ram(self, ram: np.ndarray, mask: np.ndarray | None = None) -> None:
        """Write RAM (see `AlePool.set_ram`); REM's objects are extracted again, what is seen changes with the next step.

        Raises:
            TypeError, ValueError: a wrong dtype or shape, or a backend without this.
        """
        self._ale("RAM").set_ram(ram, mask)
        if "rem" in self._objects:
            self._objects = self._objects | {"rem": self.game.rem(self.pool.ram)}

    def clone_state(self) -> States:
        """Save the states of all environments, with what their observations remember."""
        states = self._ale("states").clone_state()
        kept = {f"env {i}": np.array(leaf) for i, leaf in enumerate(jax.tree.leaves(self._remembered()))}
        return replace(states, rows={**states.rows, **kept, "over": self._over.copy()})

    def restore_state(self, states: States, mask: np.ndarray | None = None) -> tuple[Any, dict[str, Any]]:
        """Put environments into saved states: one an environment, or a single one for all; observation and info as they were then.

        Raises:
            ValueError: states of another game, number or kind of observation (see `AlePool.restore_state`), or a backend without this.
        """
        pool = self._ale("states")
        leaves, tree = jax.tree.flatten(self._remembered())
        names = [f"env {i}" for i in range(len(leaves))]
        if not set(names) <= set(states.rows) or any(states.rows[n].shape[1:] != a.shape[1:] for n, a in zip(names, leaves, strict=True)):
            raise ValueError("the states are of environments with other observations")
        pool.restore_state(states, mask)
        chosen = np.ones(self.num_envs, bool) if mask is None else mask
        saved = jax.tree.unflatten(tree, [np.broadcast_to(states.rows[n], a.shape) for n, a in zip(names, leaves, strict=True)])
        self._memory, self._objects, self._before, self._made = merged(chosen, saved, self._remembered())
        self._over = np.where(chosen, states.rows["over"], self._over)
        return self._given(self._made, self._arrays()), self._info()

    def _remembered(self) -> tuple[Any, ...]:
        if self._made is None:
            raise ValueError("the environments have not been reset")
        return self._memory, self._objects, self._before or self._objects, self._made

    def _ale(self, what: str) -> AlePool:
        if not isinstance(self.pool, AlePool):
            raise ValueError(f"envpool gives no access to {what}: use backend='ale'")
        return self.pool

    def render(self) -> tuple[np.ndarray, ...] | None:
        """The last frame of every environment, uint8 `[H, 160, 3]`; in render mode "objects" larger, with the objects drawn over it."""
        if self.render_mode is None:
            return None
        frames = self.pool.rgb[:, -1].copy()
        if self.render_mode == "rgb_array":
            return tuple(frames)
        tensors = self.tensors
        host = jax.tree.map(np.asarray, tensors["rem"] if isinstance(tensors, dict) else tensors)
        return tuple(np.asarray(overlay(self.game, frame, host[i])) for i, frame in enumerate(frames))

    def close_extras(self, **kwargs: Any) -> None:
        """End the worker processes."""
        self.pool.close()


def _fps(p: Protocol) -> float:
    return 60 / p.frame_skip if isinstance(p.frame_skip, int) else 60.0


def wanted(mode: str, obs: Wanted | None) -> Observation | dict[str, Observation]:
    """The observations asked for; by default the objects, or the RAM where nothing is extracted.

    Raises:
        ValueError: an unknown mode or observation, or objects where nothing is extracted.
    """
    if mode not in MODES:
        raise ValueError(f"mode must be one of {MODES}, got {mode!r}")
    kinds = parse(obs if obs is not None else "ram" if mode == "raw" else "objects")
    for kind in kinds.values() if isinstance(kinds, dict) else [kinds]:
        if kind.needs_objects and mode == "raw":
            raise ValueError(f"{kind} shows objects, which mode 'raw' does not extract: use mode 'rem' or 'vem'")
    return kinds


def look(game: Game, mode: str, kinds: Mapping[str, Observation]) -> Any:
    """The jitted function from arrays and memory to observations, new memory and objects."""

    def f(ram: Any, screen: Any, gray: Any, started: Any, memory: Any) -> tuple[Any, Any, dict[str, Objects]]:
        objects = {}
        if mode in ("rem", "both"):
            objects["rem"] = game.rem(ram)
        if mode in ("vem", "both"):
            objects["vem"] = game.vem(screen)
        now = Now(objects.get("rem"), objects.get("vem"), gray, started)
        made, new = {}, dict(memory)
        for name, kind in kinds.items():
            if not kind.copies:
                made[name], new[name] = kind.update(game, mode, now, memory[name])
        return made, new, objects

    return jax.jit(f) if mode != "raw" or not all(k.copies for k in kinds.values()) else lambda *a: ({}, a[-1], {})


def make_pool(game: Game, num_envs: int, mode: str, obs: Wanted | None, p: Protocol, *, render_mode: str | None, **options: Any) -> AlePool:
    """The emulators, with the arrays of pixels that the mode and the observations need."""
    if render_mode is not None and render_mode not in RENDER_MODES:
        raise ValueError(f"render_mode must be one of {RENDER_MODES} or None, got {render_mode!r}")
    if render_mode == "objects" and mode == "raw":
        raise ValueError("render_mode 'objects' draws objects, which mode 'raw' does not extract")
    kinds = wanted(mode, obs)
    screens = {s for kind in (kinds.values() if isinstance(kinds, dict) else [kinds]) for s in kind.screens}
    screens |= {"screen"} if mode in ("vem", "both") else set()
    screens |= {"rgb"} if render_mode else set()
    return AlePool(game, num_envs, p, screens=tuple(s for s in _worker.SCREENS if s in screens), **options)
