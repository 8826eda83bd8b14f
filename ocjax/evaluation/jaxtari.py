"""JAXtari's games as simulators for `ocjax.evaluation.parity`."""

import contextlib
import inspect
from collections.abc import Iterator, Mapping, Sequence
from types import ModuleType
from typing import Any

import ale_py
import jax
import jax.numpy as jnp
import numpy as np

from ocjax import _extras
from ocjax.evaluation.parity import Frame
from ocjax.extraction.game import Game
from ocjax.jaxatari import FIELDS

__all__ = ["Jaxtari"]


class Jaxtari:
    """A game of JAXtari (`pip install jaxtari`) without rendering, so it needs no sprites.

    Attributes:
        fields: the categories that each field of JAXtari's observation shows, by the field's name.
        actions: names of the actions, as ALE has them.
        environment: JAXtari's environment.

    Raises:
        ValueError: JAXtari does not have the game, or needs its sprites for it.
        MissingExtraError: JAXtari is not installed.
    """

    name = "JAXtari"

    def __init__(self, game: Game) -> None:
        if game.name not in FIELDS:
            raise ValueError(
                f"the fields of JAXtari's {game.name} are not known; there are those of "
                f"{', '.join(FIELDS)}"
            )
        self.fields: Mapping[str, tuple[str, ...]] = {
            name: f.categories
            for name, f in FIELDS[game.name].items()
            if f.categories and not f.value
        }
        self._absent = {name: FIELDS[game.name][name].absent for name in self.fields}
        self.environment = _make(game)
        with _loose():
            self._reset = jax.jit(self.environment.reset)
            self._step = jax.jit(self.environment.step)
        numbers = getattr(
            self.environment,
            "ACTION_SET",
            getattr(self.environment, "action_set", range(self.environment.action_space().n)),
        )
        # JAXtari's numbers are ALE's.
        self.actions: Sequence[str] = tuple(ale_py.Action(int(number)).name for number in numbers)
        self._state: Any = None

    def reset(self, seed: int) -> Frame:
        """Begin a game."""
        with _loose():
            observation, self._state = self._reset(jax.random.key(seed))
        return self._frame(observation, 0.0, over=False)

    def step(self, action: str) -> Frame:
        """Emulate one frame with the action of that name."""
        with _loose():
            observation, self._state, reward, over, _ = self._step(
                self._state, jnp.int32(self.actions.index(action))
            )
        return self._frame(observation, float(reward), over=bool(over))

    def _frame(self, observation: Any, reward: float, *, over: bool) -> Frame:
        return Frame(
            {name: _boxes(getattr(observation, name), self._absent[name]) for name in self.fields},
            reward,
            over,
        )


def _boxes(shown: Any, absent: tuple[int, int] | None) -> np.ndarray:
    """The active objects of a field, float `[n, 4]`, without objects at the position `absent`."""
    x, y, w, h, active = (
        np.atleast_1d(np.asarray(a))
        for a in (shown.x, shown.y, shown.width, shown.height, shown.active)
    )
    boxes = np.stack(np.broadcast_arrays(x, y, w, h), axis=-1).astype(float)
    return boxes[
        (np.broadcast_to(active, len(boxes)) > 0)
        & (boxes[:, :2] != (np.nan if absent is None else absent)).any(axis=1)
    ]


def _loose() -> Any:
    """A context for JAXtari's code, which needs promotion of dtypes and ranks."""
    stack = contextlib.ExitStack()
    stack.enter_context(jax.numpy_dtype_promotion("standard"))
    stack.enter_context(jax.numpy_rank_promotion("allow"))
    return stack


def _make(game: Game) -> Any:
    base = _extras.require("jaxtari.environment").JaxEnvironment
    module = _extras.require(f"jaxtari.games.jax_{game.name.lower()}")
    renderer = _extras.require("jaxtari.renderers").JAXGameRenderer
    (made,) = (c for c in _classes(module, base) if c.__module__ == module.__name__)
    try:
        with _loose(), _unrendered(module, renderer):
            return made()
    except (FileNotFoundError, TypeError) as error:
        raise ValueError(
            f"JAXtari's {game.name} does not start without its sprites: {error}"
        ) from error


class _Unrendered:
    """A renderer that draws nothing: JAXtari's renderers read sprites, which few games need."""

    def __getattr__(self, name: str) -> "_Unrendered":
        return self

    def __call__(self, *args: Any, **kwargs: Any) -> "_Unrendered":
        return self


@contextlib.contextmanager
def _unrendered(module: ModuleType, base: type) -> Iterator[None]:
    """Replace the renderers of a game's module."""
    renderers = {c.__name__: c for c in _classes(module, base)}
    vars(module).update(dict.fromkeys(renderers, _Unrendered()))
    try:
        yield
    finally:
        vars(module).update(renderers)


def _classes(module: ModuleType, base: type) -> list[Any]:
    return [
        c
        for _, c in inspect.getmembers(module, inspect.isclass)
        if issubclass(c, base) and c is not base
    ]
