"""Hooks: functions that edit the RAM, for worker processes and for single emulators."""

import contextlib
import functools
import sys
import types
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import cloudpickle
import numpy as np

from ocjax.emulators.variations import Variation, find
from ocjax.emulators.worker.emulator import apply_hooks
from ocjax.extraction.registry import load

Hook = Callable[[np.ndarray], None]
Hooks = Hook | str | Sequence[Hook | str] | None  # a string is the name of a variation


def named_hooks(hook: Hooks, game: str) -> tuple[tuple[str, Hook], ...]:
    """Hooks with their names."""
    given: tuple[Any, ...] = (
        ()
        if hook is None
        else tuple(hook)
        if isinstance(hook, Sequence) and not isinstance(hook, str)
        else (hook,)
    )
    hooks = tuple(find(h, game) if isinstance(h, str) else h for h in given)
    for h in hooks:
        if not callable(h):
            raise TypeError(
                "hook must be a function of the RAM, the name of a variation, or a sequence of "
                f"these, got {h!r}"
            )
        if isinstance(h, Variation) and load(h.game).name != game:
            raise ValueError(
                f"the hook is a variation of {h.game} ({h.doc}), but the game is {game}"
            )
    return tuple((_name(h), h) for h in hooks)


def pickled_hooks(hook: Hooks, game: str) -> tuple[tuple[str, str], ...]:
    """The name of each hook, and the hook pickled in hexadecimal."""
    return tuple((name, _pickle_by_value(h).hex()) for name, h in named_hooks(hook, game))


def _core(hook: Any) -> Any:
    """The function or class behind a partial, a bound method or another callable."""
    while isinstance(hook, functools.partial | types.MethodType):
        hook = hook.func if isinstance(hook, functools.partial) else hook.__func__
    return hook if hasattr(hook, "__qualname__") else type(hook)


def _name(hook: Hook) -> str:
    core = _core(hook)
    return f"{core.__module__}.{core.__qualname__}"


def _pickle_by_value(hook: Hook) -> bytes:
    """Pickle a hook so that a process can load it without importing ocjax and JAX."""
    try:
        with _by_value(sys.modules.get(_core(hook).__module__)):
            return cloudpickle.dumps(hook)
    except Exception as error:
        raise TypeError(
            f"the hook {_name(hook)} cannot be sent to worker processes: {type(error).__name__}: "
            f"{error}. It may refer to modules and to "
            "data that can be pickled"
        ) from error


@contextlib.contextmanager
def _by_value(module: types.ModuleType | None) -> Iterator[None]:
    """Pickle functions and classes of a module by value.

    Built-in modules exist in every process, and cloudpickle handles `__main__` by value anyway.
    """
    if module is None or module.__name__ == "__main__" or getattr(module, "__file__", None) is None:
        yield
        return
    cloudpickle.register_pickle_by_value(module)
    try:
        yield
    finally:
        cloudpickle.unregister_pickle_by_value(module)


class HookedState(NamedTuple):
    """A state of ale-py, and the RAM before the last frame, after the hooks' edits."""

    ale: Any
    before: np.ndarray | None


class HookedEmulator:
    """An emulator with hooks that edit the RAM before every frame."""

    def __init__(self, ale: Any, hooks: Sequence[tuple[str, Hook]]) -> None:
        self._ale, self._hooks = ale, hooks
        self._before: np.ndarray | None = None

    def act(self, *args: Any) -> float:
        """Let the hooks edit the RAM, emulate one frame, and return its reward."""
        self._before = apply_hooks(self._ale, self._hooks, self._before)
        return self._ale.act(*args)

    def cloneState(self, **options: Any) -> HookedState:  # noqa: N802  # ale-py's name
        """Save the state."""
        return HookedState(self._ale.cloneState(**options), self._before)

    def cloneSystemState(self) -> HookedState:  # noqa: N802  # ale-py's name
        """Save the state, including ALE's random state."""
        return HookedState(self._ale.cloneSystemState(), self._before)

    def restoreState(self, state: HookedState) -> None:  # noqa: N802  # ale-py's name
        """Restore a state of `cloneState`."""
        self._ale.restoreState(state.ale)
        self._before = state.before

    def restoreSystemState(self, state: HookedState) -> None:  # noqa: N802  # ale-py's name
        """Restore a state of `cloneSystemState`."""
        self._ale.restoreSystemState(state.ale)
        self._before = state.before

    def __getattr__(self, name: str) -> Any:
        return getattr(self._ale, name)
