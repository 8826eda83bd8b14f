"""`OCAtari`, for code written for OCAtari 2.2.1.

In imports, `ocjax.ocatari` replaces `ocatari` and all its modules. `docs/neighbours.md` lists the
equal parts, the intended differences and the omissions.
"""

import re
from collections import deque
from collections.abc import Sequence
from typing import Any, Literal

import gymnasium as gym
import jax
import jax.numpy as jnp
import numpy as np
from gymnasium.envs.registration import EnvSpec

from ocjax.emulators.checks import Uncopied
from ocjax.emulators.hooks import HookedEmulator, Hooks, named_hooks
from ocjax.emulators.start import check_rom, log_errors_only
from ocjax.extraction.names import games
from ocjax.extraction.objects import Objects
from ocjax.extraction.registry import load
from ocjax.ocatari.helpers import (
    ABSENT,
    UPSCALE_FACTOR,
    RandomAgent,
    Window,
    _convert_number,  # noqa: F401  # for HackAtari
    command_line,
    draw_objects,
    load_agent,
    make_darker,
    make_deterministic,
    mark_bb,
    riverraid_score,  # noqa: F401  # for HackAtari
    to_rgba,
)
from ocjax.ocatari.slots import SlotTable
from ocjax.transforms.game_objects import GameObject, NoObject, Orientation, ValueObject
from ocjax.transforms.masks import resize
from ocjax.transforms.tracking import track

__all__ = [
    "AVAILABLE_GAMES",
    "UPSCALE_FACTOR",
    "GameObject",
    "NoObject",
    "OCAtari",
    "Orientation",
    "RandomAgent",
    "ValueObject",
    "load_agent",
    "make_darker",
    "make_deterministic",
    "mark_bb",
    "to_rgba",
]

AVAILABLE_GAMES = list(games())
# The methods of each mode, the first for `objects`. Before version 2, OCAtari called "revised"
# "ram".
_METHODS = {"ram": ("rem",), "revised": ("rem",), "vision": ("vem",), "both": ("rem", "vem")}
_OBSERVATIONS = ("ori", "dqn", "obj")
_FADE = (0.05, 0.1, 0.25, 0.6)  # weights of the last four frames in `aggregated_render`
_DQN_SIZE = (84, 84)
_DETERMINISTIC = "Deterministic"  # in the names of environments with a fixed frame skip

_shrink = jax.jit(lambda gray: resize(gray, _DQN_SIZE))


class OCAtari(Uncopied, gym.Env):
    """An environment with the arguments and attributes of OCAtari 2.2.1, and ocjax's objects.

    The environment is ale-py's. `objects` has an entry for each of OCAtari's slots, in its order,
    with a `NoObject` in empty ones. Objects without a slot in OCAtari follow.

    Args:
        env_name: the game, in any spelling of `ocjax.load`, or an id of ale-py's environments. As
            in OCAtari, "Pong" is "Pong-v4", which skips 2 to 4 frames at random and has no sticky
            actions.
        mode: "ram" or "revised" (REM), "vision" (VEM, tracked from step to step) or "both"
            (`objects` by REM, `objects_v` by VEM).
        hud: whether scores, lives and other display objects are included.
        obs_mode: "obj" (`ns_state` of the last steps, int64 `[buffer_window_size, n]`), "ori" (the
            screen, uint8 `[H, 160, 3]`) or "dqn" (grey frames of the last steps, uint8
            `[buffer_window_size, 84, 84]`).
        render_mode: "rgb_array", "human" or None.
        render_oc_overlay: whether `render` draws the objects over the enlarged frame. In render
            mode "human" this needs pygame.
        buffer_window_size: number of steps in the state buffers.
        create_buffer_stacks: the state buffers to keep, besides the observation's: "ori", "dqn" or
            "obj".
        hook: functions that edit the RAM before every emulated frame, or names of variations; see
            `ocjax.make_vec`.
        kwargs: options of ale-py's environments for `gymnasium.make`, such as `frameskip`,
            `difficulty`, `repeat_action_probability` and `full_action_space`.

    Raises:
        ValueError: the game, the mode, the observation or a buffer is unknown, the window is empty,
            or the ROM is the wrong one.
        TypeError: an option does not exist, or a hook is not a function or a name.
        ModuleNotFoundError: pygame is needed and not installed.
    """

    SAVED = (
        "_clone_state() for _restore_state(), which pickles, and the arguments, which `spec` has"
    )
    # Gymnasium declares it without ClassVar.
    metadata = {"render_modes": ["human", "rgb_array"], "render_fps": 30}  # noqa: RUF012

    def __init__(
        self,
        env_name: str,
        mode: Literal["ram", "revised", "vision", "both"] = "ram",
        hud: bool = False,
        obs_mode: Literal["ori", "dqn", "obj"] = "obj",
        render_mode: str | None = None,
        render_oc_overlay: bool = False,
        buffer_window_size: int = 4,
        create_buffer_stacks: Sequence[str] = ("ori",),
        *,
        hook: Hooks = None,
        **kwargs: Any,
    ) -> None:
        _check(mode, obs_mode, buffer_window_size)
        self.env_name = env_name
        self.mode = mode
        self.hud = hud
        self.obs_mode = obs_mode
        self.render_mode = render_mode
        self.render_oc_overlay = render_oc_overlay
        self.buffer_window_size = buffer_window_size
        # Gymnasium accepts ids without a version.
        self.game = load(re.sub("(Deterministic|NoFrameskip)$", "", env_name))
        self.game_name = self.game.name
        hooks = named_hooks(hook, self.game_name)
        check_rom(self.game)
        # ale-py no longer registers these ids; they only differ in the frame skip.
        if _DETERMINISTIC in env_name:
            kwargs.setdefault("frameskip", 4)
        self._window = (
            Window(self.game_name) if render_oc_overlay and render_mode == "human" else None
        )
        self._env = self._make_env(hooks, kwargs)
        self._ale = self.ale = self._env.unwrapped.ale  # pyright: ignore
        self._prepare_slots()
        self._make_buffers({*create_buffer_stacks} | ({obs_mode} - {"ori"}))
        self.action_space = self._env.action_space
        self.observation_space = self._env.observation_space = self._space()
        self._seed: int | None = None  # for the next reset, from `make_deterministic`
        names = (
            "env_name mode hud obs_mode render_mode render_oc_overlay buffer_window_size".split()
        )
        given = {"create_buffer_stacks": list(create_buffer_stacks)}
        given |= {"hook": hook} if hooks else {}
        self.spec = EnvSpec(
            f"OCAtari/{self.game_name}-v5",
            entry_point="ocjax.ocatari:OCAtari",
            kwargs={name: getattr(self, name) for name in names} | kwargs | given,
        )

    def _make_env(self, hooks: Any, options: dict[str, Any]) -> gym.Env[Any, Any]:
        log_errors_only()
        shown = "rgb_array" if self.render_oc_overlay else self.render_mode
        env: gym.Env[Any, Any] = gym.make(
            _env_id(self.env_name, self.game_name), render_mode=shown, **options
        )
        if hooks:
            env.unwrapped.ale = HookedEmulator(env.unwrapped.ale, hooks)  # pyright: ignore
        return env

    def _prepare_slots(self) -> None:
        self._table = SlotTable(self.game, self.hud)
        self.max_objects_per_cat = self._table.counts
        self.ns_meaning = self._table.meaning
        self._slots = self._table.empty()
        # The last two detections by method.
        self._seen: dict[str, tuple[Objects | None, Objects]] = {}
        # The results of `objects` and `objects_v` by method.
        self._lists: dict[str, list[GameObject]] = {}

    def _make_buffers(self, names: set[str]) -> None:
        self.create_rgb_stack, self.create_dqn_stack, self.create_ns_stack = (
            name in names for name in _OBSERVATIONS
        )
        size = self.buffer_window_size
        self._state_buffer_rgb = deque[np.ndarray](maxlen=size) if self.create_rgb_stack else None
        self._state_buffer_dqn = deque[np.ndarray](maxlen=size) if self.create_dqn_stack else None
        self._state_buffer_ns = deque[list[int]](maxlen=size) if self.create_ns_stack else None

    def _space(self) -> gym.spaces.Space[Any]:
        if self.obs_mode == "ori":
            return self._env.observation_space
        if self.obs_mode == "dqn":
            return gym.spaces.Box(0, 255, (self.buffer_window_size, *_DQN_SIZE), np.uint8)
        return gym.spaces.Box(
            0, 255, (self.buffer_window_size, len(self._table.ns_state(self._slots))), np.int64
        )

    def __getattr__(self, name: str) -> Any:
        """Attributes of ale-py's environment and of Gymnasium's wrappers around it."""
        if name == "_env" or name.startswith("__"):
            raise AttributeError(f"{type(self).__name__} has no attribute {name!r}")
        if name == "objects_v":
            raise AttributeError(f"objects_v needs mode 'both', and the mode is {self.mode!r}")
        return self._env.get_wrapper_attr(name)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode; see `gymnasium.Env.reset`.

        The first state fills the state buffers.
        """
        observation, info = self._env.reset(
            seed=self._seed if seed is None else seed, options=options
        )
        self._seed, self._seen = None, {}
        super().reset(seed=seed)
        self.detect_objects()
        self._reset_buffer()
        return self._observation(observation), info

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Take one agent step.

        Returns:
            The observation, reward, terminated, truncated and `info`, in Gymnasium's order.

        Raises:
            ValueError: the action does not exist.
        """
        space = self._env.action_space
        if isinstance(space, gym.spaces.Discrete) and not 0 <= action < space.n:
            raise ValueError(f"the action must be from 0 to {space.n - 1}, got {action!r}")
        observation, reward, terminated, truncated, info = self._env.step(action)
        self.detect_objects()
        self._fill_buffer()
        return self._observation(observation), float(reward), terminated, truncated, info

    def _observation(self, screen: np.ndarray) -> np.ndarray:
        return (
            screen
            if self.obs_mode == "ori"
            else np.array(
                self._state_buffer_dqn if self.obs_mode == "dqn" else self._state_buffer_ns
            )
        )

    def _fill_buffer(self) -> None:
        if self._state_buffer_rgb is not None:
            self._state_buffer_rgb.append(self.getScreenRGB())
        if self._state_buffer_dqn is not None:
            self._state_buffer_dqn.append(np.asarray(_shrink(self._ale.getScreenGrayscale())))
        if self._state_buffer_ns is not None:
            self._state_buffer_ns.append(self.ns_state)

    def _reset_buffer(self) -> None:
        for _ in range(self.buffer_window_size):
            self._fill_buffer()

    def detect_objects(self) -> None:
        """Detect the objects of the emulator's current state, as every step does.

        `prev_xy` then becomes the position at the previous detection.
        """
        for method in _METHODS[self.mode]:
            before = self._seen[method][1] if method in self._seen else None
            now = (
                self.game.rem(self._ale.getRAM()[None])
                if method == "rem"
                else self.game.vem(jnp.asarray(self._ale.getScreen()[None]))
            )
            self._seen[method] = (
                before,
                now if method == "rem" or before is None else track(before, now),
            )
        self._lists = {}

    def _objects(self, method: str) -> list[GameObject]:
        if method not in self._seen:
            self.detect_objects()
        if method not in self._lists:
            before, now = self._seen[method]
            self._lists[method] = self._table.arrange(
                _host(now), None if before is None else _host(before)
            )
        return self._lists[method]

    @property
    def objects(self) -> list[GameObject]:
        """The objects of the last detection, from RAM or, in mode "vision", from pixels.

        Each step makes new objects.
        """
        return self._objects(_METHODS[self.mode][0])

    @objects.setter
    def objects(self, objects: list[GameObject]) -> None:
        self._lists[_METHODS[self.mode][0]] = objects

    @property
    def objects_v(self) -> list[GameObject]:
        """The objects from pixels; this attribute only exists in mode "both", as in OCAtari."""
        if self.mode != "both":
            raise AttributeError
        return self._objects("vem")

    @property
    def ns_state(self) -> list[int]:
        """The concatenated numbers of all OCAtari slots; `ns_meaning` explains them."""
        return self._table.ns_state(self.objects)

    @property
    def nb_actions(self) -> int:
        """The number of actions."""
        return int(self.action_space.n)  # pyright: ignore[reportAttributeAccessIssue]

    @property
    def get_rgb_state(self) -> np.ndarray:
        """The screen, uint8 `[H, 160, 3]`."""
        return self.getScreenRGB()

    def getScreenRGB(self) -> np.ndarray:  # noqa: N802  # OCAtari's name
        """The screen, uint8 `[H, 160, 3]`."""
        return self._ale.getScreenRGB()

    def get_ram(self) -> np.ndarray:
        """The RAM, uint8 `[128]`."""
        return self._ale.getRAM()

    def set_ram(self, target_ram_position: int, new_value: int) -> None:
        """Write one byte of the RAM.

        The objects change with the next step or `detect_objects`.

        Raises:
            ValueError: the address or the value is out of range.
        """
        if not (0 <= target_ram_position < 128 and 0 <= new_value < 256):
            raise ValueError(
                f"an address is 0 to 127 and a value 0 to 255, got {target_ram_position} and "
                f"{new_value}"
            )
        self._ale.setRAM(int(target_ram_position), int(new_value))

    def _clone_state(self) -> Any:
        return self._ale.cloneSystemState()

    def _restore_state(self, state: Any) -> None:
        self._ale.restoreSystemState(state)

    def render(self, image: np.ndarray | None = None) -> Any:
        """Render the last frame, or another one.

        Returns:
            In render mode "rgb_array" the frame, uint8 `[H, 160, 3]`; with an overlay, uint8 `[160
            * 5, H * 5, 3]`, with the horizontal axis first as in pygame. In render mode "human"
            None.
        """
        if not self.render_oc_overlay:
            return self._env.render() if image is None else image
        picture = draw_objects(self.getScreenRGB() if image is None else image, self.objects)
        if self._window is not None:
            return self._window.show(picture)
        return np.asarray(picture).swapaxes(0, 1) if self.render_mode == "rgb_array" else None

    def aggregated_render(self, coefs: Sequence[float] = _FADE) -> np.ndarray:
        """The weighted sum of the last frames, int64 `[H, 160, 3]`.

        Raises:
            ValueError: the environment does not keep the frames.
        """
        if self._state_buffer_rgb is None:
            raise ValueError("the frames are not kept: add 'ori' to create_buffer_stacks")
        return sum(
            c * frame for c, frame in zip(coefs, self._state_buffer_rgb, strict=False)
        ).astype(int)  # pyright: ignore[reportAttributeAccessIssue]

    def render_explanations(self) -> None:
        """Show the weighted sum of the last frames with the objects' boxes.

        This needs Matplotlib.
        """
        import matplotlib.pyplot as plt

        frame = self.aggregated_render()
        for o in filter(None, self.objects):
            mark_bb(frame, o.xywh, o.rgb)
        plt.imshow(frame)
        plt.show()

    def close(self) -> None:
        """Close the environment and its window."""
        self._env.close()
        if self._window is not None:
            self._window.close()


def _check(mode: str, obs_mode: str, window: int) -> None:
    if mode not in _METHODS:
        raise ValueError(f"mode must be one of {tuple(_METHODS)}, got {mode!r}")
    if obs_mode not in _OBSERVATIONS:
        raise ValueError(f"obs_mode must be one of {_OBSERVATIONS}, got {obs_mode!r}")
    if window < 1:
        raise ValueError(f"buffer_window_size must be at least 1, got {window!r}")


def _env_id(env_name: str, game: str) -> str:
    """The id of ale-py's environment for a name.

    A name without a version selects the latest one, as in Gymnasium: "Pong" is "Pong-v4".
    """
    name = env_name.replace("ocjax/", "ALE/").replace(_DETERMINISTIC, "")
    if re.search(r"-v\d+$", name):
        return name
    versions = {
        spec.version or 0: key
        for key, spec in gym.registry.items()
        if key.rpartition("-v")[0] in (name, game)
    }
    return versions[max(versions)] if versions else f"ALE/{game}-v5"


def _host(objects: Objects) -> Objects:
    return jax.tree.map(lambda a: np.asarray(a)[0], objects)


def __getattr__(name: str) -> Any:
    """Return a new `parser` for each script; explain why other names of OCAtari are absent."""
    if name == "parser":
        return command_line()
    if name in ABSENT:
        raise ImportError(f"ocjax.ocatari has no {name}: {ABSENT[name]}")
    raise AttributeError(f"module 'ocjax.ocatari' has no attribute {name!r}")
