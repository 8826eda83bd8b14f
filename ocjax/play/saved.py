"""`SavedPolicy`: a policy that is data, a network on objects or pixels.

`N` is the number of instances and `A` the number of actions.
"""

import dataclasses
import functools
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import jax
import numpy as np

from ocjax.envs import Dqn, Settings, Vector
from ocjax.envs.observations import Snapshot
from ocjax.extraction.game import Game
from ocjax.extraction.selection import Selection, Slots
from ocjax.files import writing
from ocjax.play.networks import NETWORKS, Groups, Layers, groups_of

MAX_INPUT = 10.0  # standardised inputs are clipped to this many standard deviations


class PolicyError(ValueError):
    """A policy does not exist, is not readable, or was made for another game."""


class Seen(NamedTuple):
    """The values of N instances that policies see: arrays of NumPy or JAX."""

    ram: Any  # uint8 [N, 128]
    started: Any  # bool [N]: an episode has just begun
    # uint8 [N, H, 160], the maximum of the step's last two grey frames, or None
    pooled: Any = None

    def rows(self, rows: slice) -> "Seen":
        """The values of some instances."""
        return Seen(*(None if array is None else array[rows] for array in self))


Policy = Callable[[Seen], np.ndarray]  # -> int [N], indices into the action set


@dataclasses.dataclass(frozen=True)
class SavedPolicy:
    """A network that computes a score for each action from objects in RAM or from pixels.

    Args:
        game: the game, with or without its display.
        layers: weights and biases of each layer.
        observation: the network's input.
        mean, deviation: moments to standardise the features, float32 `[inputs]`, or None.
        sampled: whether actions are drawn at random with the scores as logits; otherwise the action
            with the best score is taken.
        settings: the settings of the training; None if unknown.
        preset: the name of the preset that the settings are based on; None if unknown.
        frames: emulated frames of the training; 0 if unknown.
        slots: the slots that the policy sees, in the order of its inputs; by default the game's.
        network: name in `ocjax.play.networks`.
    """

    game: Game
    layers: Layers
    observation: Vector | Dqn
    mean: np.ndarray | None = None
    deviation: np.ndarray | None = None
    sampled: bool = False
    settings: Settings | None = None
    preset: str | None = None
    frames: int = 0
    slots: tuple[Slots, ...] | None = None
    network: str = "mlp"

    @functools.cached_property
    def selection(self) -> Selection:
        """The slots that a policy on objects sees."""
        assert isinstance(self.observation, Vector)
        return Selection(
            self.game, slots_of(self.game, self.observation) if self.slots is None else self.slots
        )

    @functools.cached_property
    def groups(self) -> Groups:
        """The groups of the inputs, if the network needs them."""
        if not NETWORKS[self.network].grouped:
            return ()
        assert isinstance(self.observation, Vector)
        return groups_of(self.selection.game, self.observation)

    @property
    def screens(self) -> tuple[str, ...]:
        """The required pixel arrays, by their names in `EmulatorPool`."""
        return self.observation.screens

    @property
    def num_actions(self) -> int:
        """Size of the action set."""
        return self.layers[-1][0].shape[1]

    def logits(self, observed: np.ndarray) -> np.ndarray:
        """The score of each action, float32 `[N, A]`, for observations `[N, ...]`."""
        x = observed
        if self.mean is not None:
            x = np.clip((observed - self.mean) / self.deviation, -MAX_INPUT, MAX_INPUT)
        return np.asarray(NETWORKS[self.network].apply(self.layers, x, self.groups))

    def choose(self, observed: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Actions, int `[N]`, for observations `[N, ...]`."""
        logits = self.logits(observed)
        if self.sampled:
            logits = logits + rng.gumbel(size=logits.shape)
        return logits.argmax(axis=-1)

    def _observe(self, seen: Seen, memory: Any) -> tuple[Any, Any]:
        if isinstance(self.observation, Dqn):
            return self.observation.update(
                self.game, "raw", Snapshot(None, None, None, seen.pooled, seen.started), memory
            )
        selection = self.selection
        snapshot = Snapshot(selection.of(self.game.rem(seen.ram)), None, None, None, seen.started)
        return self.observation.update(selection.game, "rem", snapshot, memory)

    def playing(self, num_envs: int, seed: int) -> Policy:
        """The policy as a function of `Seen`, which carries the memory of the observation."""
        game = self.game if isinstance(self.observation, Dqn) else self.selection.game
        memory, rng = self.observation.initial(game, "rem", num_envs), np.random.default_rng(seed)
        observe = jax.jit(self._observe)

        def act(seen: Seen) -> np.ndarray:
            nonlocal memory
            observed, memory = observe(seen, memory)
            return self.choose(np.asarray(observed), rng)

        return act

    def _description(self) -> dict[str, Any]:
        about = {
            "game": self.game.name,
            "md5": self.game.md5,
            "network": self.network,
            "sampled": self.sampled,
            "settings": None if self.settings is None else self.settings.to_dict(),
            "preset": self.preset,
            "frames": self.frames,
        }
        if isinstance(self.observation, Dqn):
            return about
        return about | {
            "hud": any(slots.hud for slots in self.selection.slots),
            "slots": [dataclasses.asdict(slots) for slots in self.selection.slots],
            "features": self.observation.features,
            "grid_features": self.observation.grid_features,
            "history": self.observation.history,
            "normalize": self.observation.normalize,
        }

    def write(self, path: Path) -> None:
        """Write the policy to an .npz file, with weights in half precision and without code.

        `ocjax.play.policies.read` reads it.
        """
        moments = {"mean": self.mean, "deviation": self.deviation}
        arrays: dict[str, Any] = {
            name: a.astype(np.float32) for name, a in moments.items() if a is not None
        }
        for i, (w, b) in enumerate(self.layers):
            arrays |= {f"w{i}": w.astype(np.float16), f"b{i}": b.astype(np.float16)}
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **arrays, description=np.array(json.dumps(self._description())))
        writing.write(path, lambda file: file.write(buffer.getvalue()))


def slots_of(game: Game, kind: Vector) -> tuple[Slots, ...]:
    """The slots of all categories, with the attributes that an observation reads."""
    read = {
        (category, feature)
        for _, category, _, feature in dataclasses.replace(kind, history=1).features_of(game)
    }
    return tuple(
        Slots(
            c.name, c.count, c.hud, c.on_grid, tuple(a for a in c.attributes if (c.name, a) in read)
        )
        for c in game.categories
    )
