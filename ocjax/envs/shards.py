"""Blocks of environments, and the compiled function that computes their observations."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np

from ocjax._xla.fork import require_threads
from ocjax.envs.observations import Computed, Snapshot
from ocjax.envs.requests import Kind
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects


class Observed(NamedTuple):
    """The results for a block of environments; all arrays are `[B, ...]`."""

    computed: dict[str, Any]  # `Computed` observations, by name
    memory: dict[str, Any]  # their memory, by name
    objects: dict[str, Objects]  # by method, "rem" or "vem"


# (arrays of the emulators, memory) -> Observed
Observer = Callable[[Mapping[str, Any], dict[str, Any]], Observed]
FRAMES = ("screen", "gray", "pooled")  # pixel arrays that extraction and observations use


def make_observer(game: Game, mode: str, kinds: Mapping[str, Kind]) -> Observer:
    """The function that extracts objects and computes observations.

    It is jit-compiled unless it computes nothing.

    Returns:
        A function of the emulators' arrays and of the memory. The arrays are "ram", uint8 `[B,
        128]`, "started", bool `[B]`, which marks new episodes, and those of `FRAMES` that the mode
        or an observation needs.
    """
    computed_kinds = {name: kind for name, kind in kinds.items() if isinstance(kind, Computed)}

    def compute(arrays: Mapping[str, Any], vem: Objects | None, memory: dict[str, Any]) -> Observed:
        rem = game.rem(arrays["ram"]) if mode in ("rem", "both") else None
        gray, pooled, screen = (arrays.get(name) for name in ("gray", "pooled", "screen"))
        snapshot = Snapshot(rem, vem, gray, pooled, arrays["started"], screen, arrays["ram"])
        computed, new_memory = {}, dict(memory)
        for name, kind in computed_kinds.items():
            computed[name], new_memory[name] = kind.update(game, mode, snapshot, memory[name])
        return Observed(
            computed,
            new_memory,
            {name: o for name, o in (("rem", rem), ("vem", vem)) if o is not None},
        )

    used = {"ram", "started", *(name for kind in computed_kinds.values() for name in kind.screens)}
    compiles = bool(computed_kinds) or mode in ("rem", "both")
    compiled = jax.jit(compute) if compiles else compute

    def observe(arrays: Mapping[str, Any], memory: dict[str, Any]) -> Observed:
        if compiles or mode == "vem":
            require_threads()
        # VEM is a separate program: with its compiler options it compiles twice as fast.
        vem = game.vem(jnp.asarray(arrays["screen"])) if mode in ("vem", "both") else None
        return compiled({name: a for name, a in arrays.items() if name in used}, vem, memory)

    return observe


@dataclass(frozen=True)
class EnvShard:
    """The state of one block of environments.

    Extraction for a block starts as soon as its workers have finished the step. A step makes new
    shards, which replace all old ones at once, so an interrupted step can be repeated.
    """

    rows: slice  # the block's environments
    arrays: dict[str, np.ndarray]  # views of these rows of the emulators' arrays
    memory: dict[str, Any]  # of computed observations, by name
    computed: dict[str, Any] | None = None  # observations by name, or None before the first reset
    objects: dict[str, Objects] = field(default_factory=dict)  # by method
    previous: dict[str, Objects] = field(default_factory=dict)  # of the previous step, by method

    def carry(self) -> tuple[Any, ...]:
        """All values that later results depend on."""
        return self.memory, self.objects, self.previous or self.objects, self.computed

    def with_carry(self, carry: tuple[Any, ...]) -> Self:
        """The shard with the values that `carry` returned."""
        memory, objects, previous, computed = carry
        return replace(self, memory=memory, objects=objects, previous=previous, computed=computed)

    def updated(self, new: Observed, mask: np.ndarray | None = None) -> Self:
        """The shard with new results; with a mask, bool `[B]`, only in its rows."""
        previous = self.objects
        if mask is not None and not mask.all():
            previous = select_rows(mask, new.objects, self.previous or self.objects)
            new = select_rows(mask, new, Observed(self.computed or {}, self.memory, self.objects))
        return replace(
            self, computed=new.computed, memory=new.memory, objects=new.objects, previous=previous
        )


def concatenate_rows(trees: Sequence[Any]) -> Any:
    """Concatenate pytrees of arrays `[n, ...]` into one pytree of new NumPy arrays."""
    return jax.tree.map(lambda *arrays: np.concatenate([np.asarray(a) for a in arrays]), *trees)


def select_rows(mask: np.ndarray, new: Any, old: Any) -> Any:
    """Merge pytrees of arrays `[n, ...]`: rows of `new` where the mask, bool `[n]`, is set."""

    def select(a: Any, b: Any) -> np.ndarray:
        a, b = np.asarray(a), np.asarray(b)
        return np.where(mask.reshape(-1, *[1] * (a.ndim - 1)), a, b)

    return jax.tree.map(select, new, old)


def at_rows(tree: Any, rows: int | np.ndarray) -> Any:
    """A row, or rows `[m]`, of a pytree of arrays `[n, ...]`, as NumPy arrays."""
    return jax.tree.map(lambda a: np.asarray(a)[rows], tree)
