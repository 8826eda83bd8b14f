"""Real ROMs behind the interface of JAXAtari (now JAXtari), to test policies trained there.

    env = ocjax.jaxatari.Environment("Pong")
    observation, state = env.reset(key)
    observation, state, reward, done, info = env.step(state, action)

The emulator runs on the host, in `jax.pure_callback`. The state contains the whole emulator as
bytes, so that `reset` and `step` are pure functions of their arguments. A step takes about 0.3 ms
to restore and save the emulator and 0.05 ms per emulated frame, in one thread: use `ocjax.make_vec`
for speed.
"""

import contextlib
import dataclasses
import functools
import importlib
import json
import threading
from collections import namedtuple
from collections.abc import Mapping
from importlib import resources
from typing import Any, NamedTuple

import ale_py
import jax
import jax.numpy as jnp
import numpy as np

from ocjax import _extras
from ocjax.console.ram import RAM_SIZE
from ocjax.emulators.settings import Settings
from ocjax.emulators.start import start_emulator
from ocjax.emulators.worker.console import facts
from ocjax.extraction.declaration import Declaration
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects, whose
from ocjax.extraction.records import constant
from ocjax.extraction.registry import load

__all__ = [
    "CAPACITY",
    "FIELDS",
    "Environment",
    "GymnaxEnvironment",
    "GymnaxParams",
    "ObjectObservation",
    "ObservedField",
    "State",
    "fields",
    "observation",
]

CAPACITY = 16_384  # bytes for a saved emulator, which takes 14.4 kB plus up to a few hundred bytes
_MAX_EPISODE_FRAMES = Settings().max_episode_frames
_DEGREES = 22.5  # per compass point
_KEEP = -1  # instead of a number of no-ops: an ended game stays over
_LENGTH = np.dtype("<u4")  # the length in front of a saved emulator
_GYMNAX_SPACES = "gymnax.environments.spaces"


@dataclasses.dataclass(frozen=True)
class ObservedField:
    """A field of JAXtari's observation of a game.

    Args:
        categories: the categories of the objects. Without any, the field is empty or 0.
        count: number of objects, or the shape of numbers, or None for one object without a
            dimension.
        constants: JAXtari's constant contents of `visual_id` and `orientation`.
        size: JAXtari's constant width and height, even if the edge of the field covers a part.
        absent: left and top of a missing object: JAXtari keeps it at this position, and active.
        value: whether the field is a number instead of an `ObjectObservation`: the value of the
            category's only object, or the number of objects if the category has several slots.
        slot: the field's first slot of the category.
    """

    categories: tuple[str, ...] = ()
    count: int | tuple[int, ...] | None = None
    constants: Mapping[str, tuple[float, ...]] = dataclasses.field(default_factory=dict)
    size: tuple[int, int] | None = None
    absent: tuple[int, int] | None = None
    value: bool = False
    slot: int = 0


def _read_fields() -> Mapping[str, Mapping[str, ObservedField]]:
    """The fields of each game, in the order of JAXtari 0.2.0's `jax_<game>.py`."""
    text = resources.files("ocjax").joinpath("jaxtari.json").read_text()
    games = json.loads(text, object_hook=_with_tuples)
    return {
        game: {name: ObservedField(**field) for name, field in named.items()}
        for game, named in games.items()
    }


def _with_tuples(entry: dict[str, Any]) -> dict[str, Any]:
    return {
        name: tuple(value) if isinstance(value, list) else value for name, value in entry.items()
    }


FIELDS = _read_fields()


class ObjectObservation(NamedTuple):
    """Objects of one kind, with the fields of JAXAtari's class in its order.

    Each field is `[...]` for one object and `[..., n]` for n objects.
    """

    x: jax.Array  # int32: left edge in pixels
    y: jax.Array  # int32: top edge in pixels
    width: jax.Array  # int32: in pixels
    height: jax.Array  # int32: in pixels
    active: jax.Array  # int32: 1 if the slot holds an object
    visual_id: jax.Array  # int32: 0, or JAXAtari's constant
    state: jax.Array  # int32: 0
    orientation: jax.Array  # float32: degrees clockwise from north; 0 if unknown, or a constant


class State(NamedTuple):
    """An emulated game."""

    emulator: jax.Array  # uint8 [..., CAPACITY]: the saved emulator
    ram: jax.Array  # uint8 [..., 128]
    lives: jax.Array  # int32 [...]
    frame: jax.Array  # int32 [...]: emulated frames since the game began
    time: jax.Array  # int32 [...]: steps since the game began


@functools.cache
def _observation_type(name: str, fields: tuple[str, ...]) -> Any:
    return namedtuple(f"{name}Observation", fields)


def fields(game: Declaration) -> Mapping[str, ObservedField]:
    """The fields of a game's observation, from `FIELDS`, or else a field per category."""
    named = {
        constant(c.name): ObservedField((c.name,), None if c.count == 1 else c.count)
        for c in game.categories
    }
    return FIELDS.get(game.name, named)


def observation(objects: Objects) -> Any:
    """JAXAtari's observation of a game: a named tuple of `ObjectObservation` and values.

    In the games of `FIELDS` it flattens to a vector with JAXtari's layout; fields without objects
    in ocjax are empty. Other games have a field per category, such as `player_missile`.

    In Pong and Freeway, boxes cover whole objects, even if the edge of the field covers a part.
    Pong's ball and enemy have JAXtari's positions while they are not in play. If JAXtari's slots
    differ from ocjax's, the valid objects come first.

    Args:
        objects: the result of `game.rem` or `game.vem`, of any batch shape.

    Raises:
        ValueError: the objects do not know their game, or lack the display that the observation
            shows.
    """
    game = whose(objects)
    named = fields(game)
    return _observation_type(game.name, tuple(named))(
        *(_field(objects, f, game) for f in named.values())
    )


def _shape(field: ObservedField) -> tuple[int, ...]:
    return (
        field.count
        if isinstance(field.count, tuple)
        else ()
        if field.count is None
        else (field.count,)
    )


def _number(objects: Objects, field: ObservedField, game: Declaration) -> jax.Array:
    """A field's number, int32 of shape `[...]` and `_shape`."""
    count = _shape(field)
    if not field.categories:
        return jnp.zeros((*objects.batch_shape, *count), jnp.int32)
    part = objects.of(field.categories[0])
    number = (
        part.value[..., 0]
        if part.valid.shape[-1] == 1
        else jnp.sum(part.valid, axis=-1, dtype=jnp.int32)
    )
    return number.reshape(*objects.batch_shape, *count)


def _slots(field: ObservedField, game: Declaration) -> np.ndarray:
    """The slots of the field's categories, int32 `[n]`."""
    slots = [
        np.arange(game.slices[name].start, game.slices[name].stop) for name in field.categories
    ]
    return np.concatenate([np.zeros(0, np.int64), *slots]).astype(np.int32)[field.slot :]


def _shown(objects: Objects, field: ObservedField, game: Declaration) -> Objects:
    """The objects of a field, the valid ones first if ocjax has more slots."""
    slots, count = _slots(field, game), field.count if isinstance(field.count, int) else 1
    part = objects.take(jnp.broadcast_to(slots, (*objects.batch_shape, len(slots))))
    order = (
        jnp.argsort(~part.valid, axis=-1, stable=True)[..., :count]
        if len(slots) > count
        else jnp.arange(count)
    )
    return part.take(jnp.broadcast_to(order, (*objects.batch_shape, count)).astype(jnp.int32))


def _field(objects: Objects, field: ObservedField, game: Declaration) -> Any:
    if field.value:
        return _number(objects, field, game)
    part = _shown(objects, field, game)
    numbers = [
        a.astype(jnp.int32) for a in (part.x, part.y, part.w, part.h, part.valid, part.orientation)
    ]
    x, y, w, h, active, compass = (a[..., 0] for a in numbers) if field.count is None else numbers
    if field.size is not None:
        height, width = game.screen
        x, w = _whole(x, w, active, field.size[0], width)
        y, h = _whole(y, h, active, field.size[1], height)
    if field.absent is not None:
        instead = (*field.absent, *(field.size or (0, 0)), 1)
        x, y, w, h, active = (
            jnp.where(active > 0, a, jnp.int32(b))
            for a, b in zip((x, y, w, h, active), instead, strict=True)
        )
    degrees = jnp.maximum(compass, jnp.int32(0)).astype(jnp.float32) * jnp.float32(_DEGREES)
    zero = jnp.zeros_like(x)
    fixed: dict[str, Any] = {
        name: jnp.broadcast_to(jnp.asarray(c, jnp.float32), x.shape)
        for name, c in field.constants.items()
    }
    visual = fixed.get("visual_id", zero).astype(jnp.int32)
    return ObjectObservation(x, y, w, h, active, visual, zero, fixed.get("orientation", degrees))


def _whole(
    start: jax.Array, length: jax.Array, active: jax.Array, full: int, screen: int
) -> tuple[jax.Array, jax.Array]:
    """Start and length of whole objects along one axis; the nearer edge may cover a part."""
    begin = jnp.where(start < screen // 2, start + length - full, start)
    return begin * active, full * active


class _Console:
    """An emulator in this process that continues saved games."""

    def __init__(self, game: Game, frame_skip: int) -> None:
        self._frame_skip, self._lock = frame_skip, threading.Lock()
        self._ale = start_emulator(game)
        self.actions = tuple(self._ale.getMinimalActionSet())
        self._initial = self._ale.cloneState(include_rng=True).serialize()

    def begin(self, noops: np.ndarray) -> tuple[np.ndarray, ...]:
        """New games `[...]` after the given numbers of no-ops."""
        return self._each(np.shape(noops), lambda i: self._start(int(np.ravel(noops)[i])))

    def step(
        self, emulator: np.ndarray, action: np.ndarray, noops: np.ndarray, last: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """Step saved games `[...]`.

        Games that end, and games in their `last` step, begin again after the given number of
        no-ops, unless it is `_KEEP`.
        """
        rows = np.reshape(emulator, (-1, CAPACITY))

        def one(i: int) -> tuple[float, bool, np.ndarray]:
            length = int(rows[i, : _LENGTH.itemsize].view(_LENGTH)[0])
            saved = rows[i, _LENGTH.itemsize : _LENGTH.itemsize + length].tobytes()
            self._restore(saved)
            reward = sum(self._ale.act(int(np.ravel(action)[i])) for _ in range(self._frame_skip))
            over, ram = self._ale.game_over(), self._ale.getRAM()
            if (over or np.ravel(last)[i]) and np.ravel(noops)[i] != _KEEP:
                self._start(int(np.ravel(noops)[i]))
            return float(reward), over, ram

        return self._each(np.shape(action), one)

    def _start(self, noops: int) -> tuple[float, bool, np.ndarray]:
        self._restore(self._initial)
        for _ in range(noops):
            self._ale.act(ale_py.Action.NOOP)
        return 0.0, False, self._ale.getRAM()

    def _restore(self, saved: bytes) -> None:
        # ALE's state lacks the incomplete frame that a reset leaves in Q*bert.
        if not facts(saved).frames:
            self._ale.reset_game()
        self._ale.restoreState(ale_py.ALEState(saved))

    def _each(self, batch: tuple[int, ...], run: Any) -> tuple[np.ndarray, ...]:
        """Run each game of a batch, and collect `_results`."""
        out = _results(batch)
        flat = [a.reshape(-1, *a.shape[len(batch) :]) for a in out]
        with self._lock:
            for i in range(flat[-1].shape[0]):
                reward, over, ram = run(i)
                saved = np.frombuffer(self._ale.cloneState(include_rng=True).serialize(), np.uint8)
                if len(saved) > CAPACITY - _LENGTH.itemsize:
                    raise ValueError(
                        f"a saved emulator has {len(saved)} bytes, more than the {CAPACITY} of "
                        "`CAPACITY`"
                    )
                flat[0][i, : _LENGTH.itemsize] = np.array([len(saved)], _LENGTH).view(np.uint8)
                flat[0][i, _LENGTH.itemsize : _LENGTH.itemsize + len(saved)] = saved
                flat[1][i] = self._ale.getRAM()
                for a, result in zip(
                    flat[2:],
                    (self._ale.lives(), self._ale.getEpisodeFrameNumber(), reward, over, ram),
                    strict=True,
                ):
                    a[i] = result
        return out


def _results(batch: tuple[int, ...]) -> tuple[np.ndarray, ...]:
    """Arrays for emulators, RAM, lives, frames, rewards, ends, and the RAM before a new game."""
    ram = (RAM_SIZE,), np.uint8
    kinds = (
        ((CAPACITY,), np.uint8),
        ram,
        ((), np.int32),
        ((), np.int32),
        ((), np.float32),
        ((), np.bool_),
        ram,
    )
    return tuple(np.zeros((*batch, *tail), dtype) for tail, dtype in kinds)


@functools.cache
def _console(game: Game, frame_skip: int) -> _Console:
    return _Console(game, frame_skip)


class Environment:
    """A game with the interface of JAXAtari's environments.

    JAXAtari's wrappers `AtariWrapper` and `ObjectCentricWrapper` accept it, and add sticky actions
    and episodes that end with a life. A step after the end of a game changes nothing. Pixels and
    `render` are not supported.

    Args:
        game: the game's name in any of the usual spellings, or a `Game` with its display.
        frame_skip: emulated frames per step. JAXAtari's environments have 1; its wrappers skip
            frames.
        noop_max: the largest number of random no-ops at the start of a game.

    Attributes:
        ACTION_SET: ale-py's number of each action, int32 `[A]`.

    Raises:
        ValueError: the game is unknown, the ROM is missing or the wrong one, or a number is out of
            range.
    """

    def __init__(self, game: str | Game, *, frame_skip: int = 1, noop_max: int = 30) -> None:
        if frame_skip < 1 or noop_max < 0:
            raise ValueError(
                f"frame_skip must be at least 1 and noop_max at least 0, got {frame_skip} and "
                f"{noop_max}"
            )
        self.game, self.noop_max = load(game) if isinstance(game, str) else game, noop_max
        self.frame_skip = frame_skip
        self._console = _console(self.game, frame_skip)
        self.ACTION_SET = jnp.array([a.value for a in self._console.actions], jnp.int32)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles share the emulator of their process."""
        return functools.partial(type(self), frame_skip=self.frame_skip, noop_max=self.noop_max), (
            self.game,
        )

    def _noops(self, key: jax.Array) -> jax.Array:
        return jax.random.randint(key, (), 0, self.noop_max + 1, jnp.int32)

    def reset(self, key: jax.Array) -> tuple[Any, State]:
        """Begin a game after a random number of no-ops.

        Returns:
            The observation (see `observation`) and the state.
        """
        out = _on_host(self._console.begin, self._noops(key))
        state = State(*out[:4], time=jnp.int32(0))
        return observation(self.game.rem(state.ram)), state

    def step(
        self, state: State, action: Any
    ) -> tuple[Any, State, jax.Array, jax.Array, dict[str, jax.Array]]:
        """Take one step with an index into `ACTION_SET`.

        Returns:
            The observation, the new state, the reward (float32), the end of the game (bool), and
            `lives` and `frame` as `info`.
        """
        state, reward, done, _ = self._step(state, action, jnp.int32(_KEEP), jnp.bool_(False))
        return (
            observation(self.game.rem(state.ram)),
            state,
            reward,
            done,
            {"lives": state.lives, "frame": state.frame},
        )

    def _step(
        self, state: State, action: Any, noops: jax.Array, last: jax.Array
    ) -> tuple[State, jax.Array, jax.Array, jax.Array]:
        """The new state, the reward, the end, and the RAM before a new game.

        See `_Console.step`.
        """
        chosen = jnp.take(self.ACTION_SET, jnp.asarray(action).astype(jnp.int32), mode="clip")
        *new, reward, done, ram = _on_host(self._console.step, state.emulator, chosen, noops, last)
        return State(*new, time=state.time + 1), reward, done, ram

    def observation_space(self) -> Any:
        """The space of observations, a `Dict` of JAXAtari's module `spaces`.

        Raises:
            ModuleNotFoundError: JAXAtari is not installed.
        """
        spaces = _spaces()
        numbers = np.iinfo(np.int32)

        def space(field: ObservedField) -> Any:
            if not field.value:
                return spaces.get_object_space(field.count, self.game.screen)
            return spaces.Box(
                low=numbers.min, high=numbers.max, shape=_shape(field), dtype=jnp.int32
            )

        return spaces.Dict({name: space(field) for name, field in fields(self.game).items()})

    def action_space(self) -> Any:
        """The space of actions, a `Discrete` of JAXAtari's module `spaces`.

        Raises:
            ModuleNotFoundError: JAXAtari is not installed.
        """
        return _spaces().Discrete(len(self.ACTION_SET))


def _spaces() -> Any:
    """JAXAtari's module `spaces`, in the package's current name or its name until 2026."""
    for package in ("jaxtari", "jaxatari"):
        # PyPI also has a package `jaxatari` without this module.
        with contextlib.suppress(ModuleNotFoundError):
            return importlib.import_module(f"{package}.spaces")
    raise ModuleNotFoundError("JAXAtari is not installed: pip install jaxtari", name="jaxtari")


def _on_host(function: Any, *arguments: jax.Array) -> Any:
    """Call a function of the console for one game, or under `vmap` for a batch."""
    shapes = [jax.ShapeDtypeStruct(a.shape, a.dtype) for a in _results(())]
    return jax.pure_callback(
        lambda *a: function(*map(np.asarray, a)), shapes, *arguments, vmap_method="broadcast_all"
    )


@functools.partial(
    jax.tree_util.register_dataclass, data_fields=["max_steps_in_episode"], meta_fields=[]
)
@dataclasses.dataclass(frozen=True)
class GymnaxParams:
    """The parameters of `GymnaxEnvironment`.

    Episodes are truncated after `max_steps_in_episode`.
    """

    max_steps_in_episode: int

    def replace(self, **changes: Any) -> "GymnaxParams":
        """A copy with other values."""
        return dataclasses.replace(self, **changes)


class GymnaxEnvironment(Environment):
    """A game with the interface of gymnax 1.0, for its wrappers.

    Keys and parameters are explicit, a game that ends begins again in the same step, and
    observations are flat. For programs written for gymnax 0.0.9 or older, such as PureJaxRL, use
    `gymnax.wrappers.compat.LegacyStepAPIWrapper`.
    """

    @property
    def name(self) -> str:
        """The game's name."""
        return self.game.name

    @property
    def num_actions(self) -> int:
        """Size of the action set."""
        return len(self.ACTION_SET)

    @property
    def default_params(self) -> GymnaxParams:
        """The default parameters: episodes are truncated after half an hour, as in ALE."""
        return GymnaxParams(_MAX_EPISODE_FRAMES // self.frame_skip)

    def reset(  # pyright: ignore
        self, key: jax.Array, params: GymnaxParams | None = None
    ) -> tuple[jax.Array, State]:
        """Begin a game.

        Returns:
            The observation, float32 `[n]`, with all fields concatenated, and the state.
        """
        seen, state = super().reset(key)
        return _flat(seen), state

    def step(  # pyright: ignore[reportIncompatibleMethodOverride]
        self, key: jax.Array, state: State, action: Any, params: GymnaxParams | None = None
    ) -> tuple[jax.Array, State, jax.Array, jax.Array, jax.Array, dict[str, Any]]:
        """Take one step. After the end of an episode, the results belong to the next game.

        Args:
            key: the key for the no-ops at the start of a new game.
            action: an index into `ACTION_SET`.
            params: the parameters; by default `default_params`.

        Returns:
            The observation (float32 `[n]`), the new state, the reward (float32), the end of the
            game and the truncation of the episode (both bool), and a dict of `terminated`,
            `truncated`, `final_observation` (of the last step, even if a new game has begun), and
            `lives` and `frame` of the new state.
        """
        limit = (params or self.default_params).max_steps_in_episode
        truncated = state.time + 1 >= limit
        new, reward, terminated, ram = self._step(state, action, self._noops(key), truncated)
        new = new._replace(time=jnp.where(terminated | truncated, jnp.int32(0), new.time))
        info = {
            "lives": new.lives,
            "frame": new.frame,
            "terminated": terminated,
            "truncated": truncated,
        }
        seen, final = (_flat(observation(self.game.rem(each))) for each in (new.ram, ram))
        return seen, new, reward, terminated, truncated, info | {"final_observation": final}

    def observation_space(self, params: GymnaxParams | None = None) -> Any:
        """The space of observations, a `Box` of gymnax.

        Raises:
            ModuleNotFoundError: gymnax is not installed, also in the methods below.
        """
        ram = jax.ShapeDtypeStruct((RAM_SIZE,), jnp.uint8)
        shape = jax.eval_shape(lambda ram: _flat(observation(self.game.rem(ram))), ram).shape
        return _extras.require(_GYMNAX_SPACES).Box(-jnp.inf, jnp.inf, shape, jnp.float32)

    def action_space(self, params: GymnaxParams | None = None) -> Any:
        """The space of actions, a `Discrete` of gymnax."""
        return _extras.require(_GYMNAX_SPACES).Discrete(self.num_actions)

    def state_space(self, params: GymnaxParams | None = None) -> Any:
        """The space of states, a `Dict` of gymnax."""
        spaces = _extras.require(_GYMNAX_SPACES)
        _, state = jax.eval_shape(self.reset, jax.random.key(0))
        limits = {name: np.iinfo(field.dtype) for name, field in state._asdict().items()}
        return spaces.Dict(
            {
                name: spaces.Box(limits[name].min, limits[name].max, field.shape, field.dtype)
                for name, field in state._asdict().items()
            }
        )


def _flat(seen: Any) -> jax.Array:
    return jnp.concatenate([a.astype(jnp.float32).ravel() for a in jax.tree.leaves(seen)])
