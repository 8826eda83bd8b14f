"""Vector environments whose observations are objects."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import gymnasium as gym
import jax
import jax.numpy as jnp
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from ocjax.envs import _worker
from ocjax.envs.ale import AlePool, States
from ocjax.envs.observations import Computed, Kind, Now, Wanted, parse
from ocjax.envs.protocol import Protocol
from ocjax.game import Game
from ocjax.objects import Objects
from ocjax.render import overlay
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


@dataclass
class Part:
    """What was seen of some of the environments, which are looked at as soon as their own workers have stepped them."""

    rows: slice
    arrays: dict[str, np.ndarray]  # of the emulators: what observations are made of
    memory: dict[str, Any]  # what observations remember
    made: Any = None  # observations that are computed; None before the first
    objects: dict[str, Objects] = field(default_factory=dict)  # each method's
    before: dict[str, Objects] = field(default_factory=dict)  # at the step before

    def remembered(self) -> tuple[Any, ...]:
        """All that the next step depends on."""
        return self.memory, self.objects, self.before or self.objects, self.made


def joined(trees: Sequence[Any]) -> Any:
    """Trees of arrays `[n, ...]` of all parts as one of new arrays `[num_envs, ...]`."""
    return jax.tree.map(lambda *a: np.concatenate([np.asarray(x) for x in a]), *trees)


def _row(objects: Objects, i: Any) -> Objects:
    """The objects of one environment, on the host."""
    return jax.tree.map(lambda a: np.asarray(a)[i], objects)


def merged(mask: np.ndarray, new: Any, old: Any) -> Any:
    """Trees of arrays `[num_envs, ...]`: rows of the new where the mask is set, else of the old."""

    def rows(a: Any, b: Any) -> np.ndarray:
        a, b = np.asarray(a), np.asarray(b)
        return np.where(mask.reshape(-1, *[1] * (a.ndim - 1)), a, b)

    return jax.tree.map(rows, new, old)


Look = tuple[Any, Any, dict[str, Objects]]  # computed observations, the new memory, each method's objects


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
        self.kinds: dict[str, Kind] = {"": kinds} if isinstance(kinds, Kind) else kinds
        spaces = {name: kind.space(self.game, mode) for name, kind in self.kinds.items()}
        self.single_observation_space = spaces[""] if self._single else gym.spaces.Dict(spaces)
        self.single_action_space = gym.spaces.Discrete(len(pool.actions))
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._look = look(self.game, mode, self.kinds)
        computed = {name: kind for name, kind in self.kinds.items() if isinstance(kind, Computed)}
        self._parts = []
        for rows in pool.parts:
            arrays = {name: getattr(pool, name)[rows] for name in self._sources()}
            memory = {name: kind.initial(self.game, mode, rows.stop - rows.start) for name, kind in computed.items()}
            self._parts.append(Part(rows, arrays, memory))
        self._over = np.zeros(self.num_envs, bool)

    @property
    def tensors(self) -> Objects | dict[str, Objects]:
        """The present objects."""
        if not self._parts[0].objects:
            raise ValueError("there are no objects: the mode is 'raw', or the environments have not been reset")
        parts = [part.objects for part in self._parts]
        all_of_them = parts[0] if len(parts) == 1 else jax.tree.map(lambda *a: jnp.concatenate(a), *parts)
        return dict(all_of_them) if self.mode == "both" else all_of_them[self.mode]

    def objects(self, i: int, method: str | None = None) -> list[GameObject]:
        """The objects of one environment as OCAtari's users know them.

        Args:
            i: which environment.
            method: "rem" or "vem" in mode "both"; REM's by default.

        Raises:
            IndexError: no such environment.
            ValueError: nothing is extracted, or not by that method.
        """
        i = range(self.num_envs)[i]
        part = next(p for p in self._parts if i < p.rows.stop)
        name = method or ("rem" if "rem" in part.objects else "vem")
        if name not in part.objects:
            raise ValueError(f"no objects by {name!r}: the mode is {self.mode!r}, or the environments have not been reset")
        k, before = i - part.rows.start, part.before.get(name)
        continues = before is not None and not self.pool.started[i]
        return views(_row(part.objects[name], k), _row(before, k) if before is not None and continues else None)

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

    def _sources(self) -> set[str]:
        """The emulators' arrays that observations are made of."""
        return {
            "ram",
            "started",
            *(s for kind in self.kinds.values() for s in kind.screens),
            *(["screen"] * (self.mode in ("vem", "both"))),
        }

    def _look_at(self, arrays: Mapping[str, np.ndarray], memory: Any) -> Look:
        screen = arrays["screen"][:, -1] if "screen" in arrays else None
        return self._look(arrays["ram"], screen, arrays.get("gray"), arrays["started"], memory)

    def _given(self, pieces: Sequence[tuple[Any, Mapping[str, np.ndarray], Mapping[str, Objects]]]) -> Any:
        """The observation, in arrays of the caller's own; from each part's computed observations, arrays and objects."""
        out = {}
        for name, kind in self.kinds.items():
            if isinstance(kind, Computed):
                out[name] = joined([made[name] for made, _, _ in pieces])
            else:
                out[name] = joined([kind.source(arrays, jax.tree.map(np.asarray, objects)) for _, arrays, objects in pieces])
        return out[""] if self._single else out

    def _update(self, part: Part, mask: np.ndarray | None = None) -> None:
        """Look at the emulators of a part (only at those of the mask)."""
        made, memory, objects = self._look_at(part.arrays, part.memory)
        before = part.objects
        if mask is not None and not mask[part.rows].all():
            some = mask[part.rows]
            made, memory = merged(some, made, part.made), merged(some, memory, part.memory)
            objects, before = merged(some, objects, part.objects), merged(some, objects, part.before or part.objects)
        part.made, part.memory, part.objects, part.before = made, memory, objects, before

    def _seen(self) -> Any:
        """The present observation. What it is made of is computed while other parts are waited for, and never outlives the step."""
        jax.block_until_ready([part.remembered() for part in self._parts])
        return self._given([(part.made, part.arrays, part.objects) for part in self._parts])

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
        if mask is not None and self._parts[0].made is None and not mask.all():
            raise ValueError("the first reset must be of all environments, without reset_mask")
        seeds = None if seed is None else [seed + i for i in range(self.num_envs)] if isinstance(seed, int | np.integer) else list(seed)
        if seeds is not None and (len(seeds) != self.num_envs or any(s is not None and s < 0 for s in seeds)):
            raise ValueError(f"seed must be a number >= 0 or {self.num_envs} of them, got {seed!r}")
        self.pool.reset(seeds, mask)
        self._over[slice(None) if mask is None else mask] = False
        for part in self._parts:
            self._update(part, mask)
        return self._seen(), self._info()

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
        p, done, final = self.pool, self.pool.finished(), {}
        if self.autoreset_mode == AutoresetMode.SAME_STEP:
            done = list(done)
            over = p.terminated | p.truncated
            if over.any():
                final = self._final(over)
        for k in done:
            self._update(self._parts[k])
        reward, terminated, truncated = np.array(p.reward), np.array(p.terminated), np.array(p.truncated)
        self._over = terminated | truncated
        if p.protocol.clip_rewards:
            reward = np.sign(reward)
        return self._seen(), reward, terminated, truncated, self._info() | final

    def _final(self, over: np.ndarray) -> dict[str, Any]:
        """What was there at the end of the episodes that just ended, before the next ones began."""
        pieces = []
        for part in self._parts:
            some = over[part.rows]
            arrays = {
                k: a & ~some if k == "started" else merged(some, getattr(self.pool, f"final_{k}")[part.rows], a)
                for k, a in part.arrays.items()
            }
            made, _, objects = self._look_at(arrays, part.memory)
            pieces.append((made, arrays, objects))
        seen, objects = self._given(pieces), joined([objects for _, _, objects in pieces])
        last = np.full(self.num_envs, None, object)
        for i in np.flatnonzero(over):
            last[i] = jax.tree.map(lambda a, i=i: a[i].copy(), seen)
        info = self._info("final_", over)
        if objects:
            name = "rem" if "rem" in objects else "vem"
            before = joined([part.objects[name] for part in self._parts])
            info["objects"], info["_objects"] = np.full(self.num_envs, None, object), over.copy()
            for i in np.flatnonzero(over):
                info["objects"][i] = views(_row(objects[name], i), _row(before, i))
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
        for part in self._parts:
            if "rem" in part.objects:
                part.objects = part.objects | {"rem": self.game.rem(self.pool.ram[part.rows])}

    def clone_state(self) -> States:
        """Save the states of all environments, with what their observations remember."""
        states = self._ale("states").clone_state()
        kept = {f"env {i}": leaf for i, leaf in enumerate(jax.tree.leaves(joined(self._remembered())))}
        return replace(states, rows={**states.rows, **kept, "over": self._over.copy()})

    def restore_state(self, states: States, mask: np.ndarray | None = None) -> tuple[Any, dict[str, Any]]:
        """Put environments into saved states: one an environment, or a single one for all; observation and info as they were then.

        Raises:
            ValueError: states of another game, number or kind of observation (see `AlePool.restore_state`), or a backend without this.
        """
        pool = self._ale("states")
        leaves, tree = jax.tree.flatten(self._remembered()[0])
        names = [f"env {i}" for i in range(len(leaves))]
        if not set(names) <= set(states.rows) or any(states.rows[n].shape[1:] != a.shape[1:] for n, a in zip(names, leaves, strict=True)):
            raise ValueError("the states are of environments with other observations")
        pool.restore_state(states, mask)
        chosen = np.ones(self.num_envs, bool) if mask is None else mask
        saved = [np.broadcast_to(states.rows[n], (self.num_envs, *a.shape[1:])) for n, a in zip(names, leaves, strict=True)]
        for part in self._parts:
            rows = jax.tree.unflatten(tree, [a[part.rows] for a in saved])
            part.memory, part.objects, part.before, part.made = merged(chosen[part.rows], rows, part.remembered())
        self._over = np.where(chosen, states.rows["over"], self._over)
        return self._seen(), self._info()

    def _remembered(self) -> list[tuple[Any, ...]]:
        """Each part's."""
        if self._parts[0].made is None:
            raise ValueError("the environments have not been reset")
        return [part.remembered() for part in self._parts]

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


def wanted(mode: str, obs: Wanted | None) -> Kind | dict[str, Kind]:
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


def look(game: Game, mode: str, kinds: Mapping[str, Kind]) -> Any:
    """The jitted function from arrays and memory to observations, new memory and objects."""

    def f(ram: Any, screen: Any, gray: Any, started: Any, memory: Any) -> Look:
        objects = {}
        if mode in ("rem", "both"):
            objects["rem"] = game.rem(ram)
        if mode in ("vem", "both"):
            objects["vem"] = game.vem(screen)
        now = Now(objects.get("rem"), objects.get("vem"), gray, started)
        made, new = {}, dict(memory)
        for name, kind in kinds.items():
            if isinstance(kind, Computed):
                made[name], new[name] = kind.update(game, mode, now, memory[name])
        return made, new, objects

    return jax.jit(f) if mode != "raw" or any(isinstance(k, Computed) for k in kinds.values()) else lambda *a: ({}, a[-1], {})


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
