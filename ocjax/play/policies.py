"""Policies that play: random actions, held random actions, and saved policies, which are data files.

`N` is the number of instances and `A` the number of actions.
"""

import dataclasses
import functools
import io
import json
import re
import reprlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np

from ocjax.emulators.checks import integer
from ocjax.envs import Settings
from ocjax.envs.features import Vector
from ocjax.envs.observations import Snapshot
from ocjax.extraction.categories import ATTRIBUTES
from ocjax.extraction.game import Game
from ocjax.extraction.registry import load
from ocjax.extraction.selection import Selection, Slots
from ocjax.files import npz, writing

HOLD = 8  # steps for which actions are held at most
BUILT_IN = {"random": {}, "repeat": {"hold": HOLD}, "idle": {"idle": 1.0}, "seldom": {"hold": HOLD, "idle": 0.95}}
MAX_INPUT = 10.0  # standardised inputs are clipped to this many standard deviations
MOST_BYTES = 2**27  # of the arrays of a saved policy
MOST_FRAMES = 2**53
MOST_SLOTS = 2**16  # of a category
LARGEST, LEAST_DEVIATION = 1e15, 1e-6  # of numbers in files: products of larger ones overflow
TRAINED = "trained"  # the name of the policy that ships with the package
SHIPPED = Path(__file__).parent / "trained"
# The inputs of files without a description: boxes in units of 160 pixels, and validity.
PLAIN = Vector(("x", "y", "w", "h", "valid"), normalize=False)
PLAIN_UNITS = (160.0, 160.0, 160.0, 160.0, 1.0)

# (RAM uint8 [N, 128], which instances have just begun an episode, bool [N]) -> int [N], indices into the action set
Policy = Callable[[np.ndarray, np.ndarray], np.ndarray]
Layers = Sequence[tuple[np.ndarray, np.ndarray]]  # weights [n, m] and biases [m]


class PolicyError(ValueError):
    """A policy does not exist, cannot be read, or was made for another game; the message says which."""


@dataclasses.dataclass
class RandomPolicy:
    """Random actions, each held for 1 to `hold` steps.

    Args:
        num_actions: size of the action set.
        num_envs: number of instances.
        rng: the source of randomness.
        hold: the largest number of steps.
        idle: the share of choices that are no action, the first of the set.
    """

    num_actions: int
    num_envs: int
    rng: np.random.Generator
    hold: int = 1
    idle: float = 0.0

    def __post_init__(self) -> None:
        self.action = np.zeros(self.num_envs, int)
        self.left = np.zeros(self.num_envs, int)

    def __call__(self, ram: np.ndarray, started: np.ndarray) -> np.ndarray:
        """The next actions, int `[N]`."""
        new = self.left == 0
        chosen = self.rng.integers(self.num_actions, size=self.num_envs)
        if self.idle:
            chosen = np.where(self.rng.random(self.num_envs) < self.idle, 0, chosen)
        self.action = np.where(new, chosen, self.action)
        self.left = np.where(new, self.rng.integers(1, self.hold + 1, size=self.num_envs), self.left) - 1
        return self.action


@dataclasses.dataclass(frozen=True)
class SavedPolicy:
    """A multilayer perceptron with tanh between its layers, from the features of the objects in RAM to a score for each action.

    Args:
        game: the game, with or without its display.
        layers: weights and biases of each layer.
        observation: the features that it takes.
        mean, deviation: by which the features are standardised, float32 `[inputs]`.
        sampled: whether actions are drawn with the probabilities that the scores are logits of; otherwise the best one is taken.
        settings: under which it was trained; None if unknown.
        preset: the name of the preset that the settings are based on; None if unknown.
        frames: emulated frames of its training; 0 if unknown.
        slots: which it sees, in the order of its inputs; by default those of the game.
    """

    game: Game
    layers: Layers
    observation: Vector
    mean: np.ndarray
    deviation: np.ndarray
    sampled: bool = False
    settings: Settings | None = None
    preset: str | None = None
    frames: int = 0
    slots: tuple[Slots, ...] | None = None

    @functools.cached_property
    def selection(self) -> Selection:
        """The slots that it sees."""
        return Selection(self.game, _slots_of(self.game, self.observation) if self.slots is None else self.slots)

    @property
    def num_actions(self) -> int:
        """Size of the action set."""
        return self.layers[-1][0].shape[1]

    def logits(self, features: np.ndarray) -> np.ndarray:
        """The score of each action, float32 `[N, A]`, for features `[N, inputs]`."""
        x = np.clip((features - self.mean) / self.deviation, -MAX_INPUT, MAX_INPUT)
        for i, (w, b) in enumerate(self.layers):
            x = x @ w + b
            x = np.tanh(x) if i + 1 < len(self.layers) else x
        return x

    def choose(self, features: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Actions, int `[N]`, for features `[N, inputs]`."""
        logits = self.logits(features)
        if self.sampled:
            logits = logits + rng.gumbel(size=logits.shape)
        return logits.argmax(axis=-1)

    def on_ram(self, num_envs: int, seed: int) -> Policy:
        """The policy as a function of the RAM, which remembers what its features need from earlier steps."""
        game, kind, selection = self.game, self.observation, self.selection

        def features(ram: jax.Array, started: jax.Array, memory: Any) -> tuple[Any, Any]:
            snapshot = Snapshot(selection.of(game.rem(ram)), None, None, None, started)
            return kind.update(selection.game, "rem", snapshot, memory)

        observe, memory, rng = jax.jit(features), kind.initial(selection.game, "rem", num_envs), np.random.default_rng(seed)

        def act(ram: np.ndarray, started: np.ndarray) -> np.ndarray:
            nonlocal memory
            observed, memory = observe(ram, started, memory)
            return self.choose(np.asarray(observed), rng)

        return act

    def write(self, path: Path) -> None:
        """Write the policy to an .npz file, with weights in half precision and without code; see `read`."""
        description = {
            "game": self.game.name,
            "md5": self.game.md5,
            "hud": any(slots.hud for slots in self.selection.slots),
            "slots": [dataclasses.asdict(slots) for slots in self.selection.slots],
            "features": self.observation.features,
            "grid_features": self.observation.grid_features,
            "history": self.observation.history,
            "normalize": self.observation.normalize,
            "sampled": self.sampled,
            "settings": None if self.settings is None else self.settings.to_dict(),
            "preset": self.preset,
            "frames": self.frames,
        }
        arrays: dict[str, Any] = {"mean": self.mean.astype(np.float32), "deviation": self.deviation.astype(np.float32)}
        for i, (w, b) in enumerate(self.layers):
            arrays |= {f"w{i}": w.astype(np.float16), f"b{i}": b.astype(np.float16)}
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **arrays, description=np.array(json.dumps(description)))
        writing.write(path, lambda file: file.write(buffer.getvalue()))


def read(path: str | Path, game: Game) -> SavedPolicy:
    """Read a policy from an .npz file.

    Args:
        path: a file with weights `w0` `[inputs, n]`, biases `b0` `[n]`, and so on for each layer. It may contain `mean` and `deviation`
            `[inputs]` and a JSON text `description`, as `SavedPolicy.write` writes them. Without a description, the inputs are x, y, w, h
            in units of 160 pixels and validity of each slot of the game.
        game: the game that it plays.

    Raises:
        PolicyError: the file is missing, damaged, or does not fit the game.
    """
    try:
        headers = npz.headers(Path(path), _is_read)
        size = sum(header.size for header in headers.values())
        if size > MOST_BYTES:
            raise PolicyError(f"{path} holds {size:,} bytes of weights, and at most {MOST_BYTES:,} are read")
        arrays = npz.read(Path(path), _is_read)
    except (OSError, npz.NpzError) as error:
        raise PolicyError(f"{path} is not a readable policy (.npz with w0, b0, w1, b1, ...): {error}") from error
    description = _description(path, arrays)
    if description and description.get("md5") != game.md5:
        raise PolicyError(f"{path}: the policy is for {description.get('game')}, not for {game.name}")
    for name, array in arrays.items():
        if name != "description" and not (array.dtype.kind in "iuf" and (np.abs(array.astype(np.float64)) < LARGEST).all()):
            raise PolicyError(f"{path}: {name} must hold finite numbers below {LARGEST:g}, got {array.dtype} {list(array.shape)}")
    try:
        kind, known = _observation(description), _known(description)
        slots, hud = _slots(description, game)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise PolicyError(f"{path}: the description of the policy is damaged: {type(error).__name__}: {error}") from error
    try:
        game, selection = _select(game, kind, slots, hud)
    except ValueError as error:
        raise PolicyError(f"{path}: the policy was trained with other objects: {error}") from error
    if "w0" not in arrays:
        raise PolicyError(f"{path} is not a readable policy: it has no layer w0")
    if kind.history > arrays["w0"].size:
        raise PolicyError(f"{path}: layer 0 has {arrays['w0'].size:,} weights, too few for a history of {kind.history:,} states")
    inputs = kind.history * len(dataclasses.replace(kind, history=1).features_of(selection.game))
    if arrays["w0"].shape[:1] != (inputs,):  # before arrays of so many inputs are made
        raise PolicyError(f"{path}: layer 0 must have w0 [{inputs}, n] for {game.name}, got {list(arrays['w0'].shape)}")
    units = np.tile(np.array(PLAIN_UNITS, np.float32), game.num_slots) if kind is PLAIN else np.ones(inputs, np.float32)
    mean, deviation = (np.asarray(arrays.get(n, a), np.float32) for n, a in (("mean", np.zeros(inputs)), ("deviation", units)))
    if mean.shape != (inputs,) or deviation.shape != (inputs,) or not (deviation >= LEAST_DEVIATION).all():
        raise PolicyError(f"{path}: mean and deviation must have shape [{inputs}] for {game.name}, and deviation must be positive")
    return SavedPolicy(game, _layers(path, game, arrays, inputs), kind, mean, deviation, slots=selection.slots, **known)


def _is_read(name: str) -> bool:
    """Whether an array of this name is part of a policy."""
    return re.fullmatch(r"[wb]\d+|mean|deviation|description", name) is not None


def _description(path: str | Path, arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """What a file says of its policy, or nothing."""
    if "description" not in arrays:
        return {}
    description = npz.json_object(arrays["description"])
    if description is None:
        raise PolicyError(f"{path}: the description of the policy must be a JSON object, got {str(arrays['description'])[:200]!r}")
    return description


def _observation(description: Mapping[str, Any]) -> Vector:
    if not description:
        return PLAIN
    features = (description["features"], description.get("grid_features"))  # older policies have no grid_features
    if not all(names is None or (isinstance(names, list) and all(isinstance(n, str) for n in names)) for names in features):
        raise ValueError(f"features must be lists of names, got {reprlib.repr(features)}")
    history = integer("history", description["history"], 1, MOST_FRAMES)
    return Vector(features[0], grid_features=features[1], history=history, normalize=_flag(description, "normalize"))


def _slots_of(game: Game, kind: Vector) -> tuple[Slots, ...]:
    """The slots of all categories, and what an observation reads of them."""
    read = {(category, feature) for _, category, _, feature in dataclasses.replace(kind, history=1).features_of(game)}
    return tuple(Slots(c.name, c.count, c.hud, c.on_grid, tuple(a for a in c.attributes if (c.name, a) in read)) for c in game.categories)


def _slots(description: Mapping[str, Any], game: Game) -> tuple[list[Slots] | None, bool]:
    """The slots that a description names, None if it names none, as in older files; and whether some belong to the display."""
    hud = _flag(description, "hud") if description else game.hud
    entries = description.get("slots", [])
    if not isinstance(entries, list) or ("slots" in description and not entries):
        raise ValueError(f"slots must be a list with an entry for each category, got {reprlib.repr(entries)}")
    slots = [_slots_entry(entry) for entry in entries]
    if slots and hud != any(own.hud for own in slots):
        raise ValueError(f"hud must be {not hud}, as of the slots, got {hud}")
    return slots or None, hud


def _slots_entry(entry: Any) -> Slots:
    names = [field.name for field in dataclasses.fields(Slots)]
    if not isinstance(entry, dict) or set(entry) != set(names):
        raise ValueError(f"an entry of slots must have the fields {', '.join(names)}, got {reprlib.repr(entry)}")
    category, attributes = entry["category"], entry["attributes"]
    if not isinstance(category, str):
        raise ValueError(f"category must be a name, got {reprlib.repr(category)}")
    if not isinstance(attributes, list) or not all(a in ATTRIBUTES for a in attributes):
        raise ValueError(f"attributes must be a list of {', '.join(ATTRIBUTES)}, got {reprlib.repr(attributes)}")
    count = integer("count", entry["count"], 1, MOST_SLOTS)
    return Slots(category, count, _flag(entry, "hud"), _flag(entry, "on_grid"), tuple(attributes))


def _select(game: Game, kind: Vector, slots: Sequence[Slots] | None, hud: bool) -> tuple[Game, Selection]:
    """The game, without its display if the policy does not see it, and the slots that the policy sees.

    Raises:
        ValueError: the game lacks some of them.
    """
    if slots is None:
        game = _with_display(game, hud)
        return game, Selection(game, _slots_of(game, kind))
    plain = _with_display(game, False)
    game = plain if all(own.category in plain.slices for own in slots) else _with_display(game, True)
    return game, Selection(game, slots)


def _with_display(game: Game, hud: bool) -> Game:
    """The game with its display or without it."""
    if game.hud == hud:
        return game
    return load(game.name, hud=hud) if hud or game is load(game.name) else game.without_hud()


def _flag(description: Mapping[str, Any], name: str) -> bool:
    if not isinstance(description[name], bool):
        raise ValueError(f"{name} must be true or false, got {reprlib.repr(description[name])}")
    return description[name]


def _known(description: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments of `SavedPolicy` that a description gives."""
    if not description:
        return {}
    settings, preset = description["settings"], description["preset"]
    if preset is not None and not isinstance(preset, str):
        raise ValueError(f"preset must be a name, got {reprlib.repr(preset)}")
    return {
        "sampled": _flag(description, "sampled"),
        "preset": preset,
        "frames": integer("frames", description["frames"], 0, MOST_FRAMES),
        "settings": None if settings is None else Settings(**settings),
    }


def _layers(path: str | Path, game: Game, arrays: Mapping[str, np.ndarray], inputs: int) -> Layers:
    layers, width = [], inputs
    while f"w{len(layers)}" in arrays:
        i = len(layers)
        w, b = arrays[f"w{i}"], arrays.get(f"b{i}", np.zeros(0))
        if w.ndim != 2 or w.shape[0] != width or b.shape != w.shape[1:]:
            raise PolicyError(
                f"{path}: layer {i} must have w{i} [{width}, n] and b{i} [n] for {game.name}, got {list(w.shape)} and {list(b.shape)}"
            )
        layers.append((w.astype(np.float32), b.astype(np.float32)))
        width = w.shape[1]
    return layers


def find(name: str, game: Game) -> Path:
    """The file of a saved policy, by its path or by the name "trained".

    Raises:
        PolicyError: there is none.
    """
    if name == TRAINED:
        path = SHIPPED / f"{game.name}.npz"
        if not path.exists():
            games = ", ".join(sorted(p.stem for p in SHIPPED.glob("*.npz")))
            raise PolicyError(f"no trained policy of {game.name} ships with this version; there are those of {games or 'no game'}")
        return path
    if not Path(name).exists():
        raise PolicyError(f"no policy {name!r}: it must be {', '.join(BUILT_IN)}, {TRAINED}, or the path of an .npz file")
    return Path(name)


def trained_settings(name: str, game: Game) -> Settings | None:
    """The settings of the environments in which a policy was trained; None for random policies, and for files without settings.

    Raises:
        PolicyError: there is no such policy, or it does not fit the game.
    """
    return None if name in BUILT_IN else read(find(name, game), game).settings


def file_of(name: str) -> Path | None:
    """The file that the name of a policy refers to; None for the policies that ship with the package."""
    return None if name == TRAINED or name in BUILT_IN else Path(name)


def make_policy(name: str, game: Game, num_actions: int, num_envs: int, seed: int) -> Policy:
    """A policy by name.

    Args:
        name: "random" (a new action in every step), "repeat" (each action is held for 1 to 8 steps), "idle" (no action), "seldom" (each
            action is held for 1 to 8 steps, and nineteen of twenty are no action), "trained" (the policy that ships with the package), or
            the path of a saved policy.
        game: the game.
        num_actions: size of the action set.
        num_envs: number of instances.
        seed: seed of the random choices.

    Raises:
        PolicyError: there is no such policy, or it does not fit the game.
    """
    if name in BUILT_IN:
        return RandomPolicy(num_actions, num_envs, np.random.default_rng(seed), **BUILT_IN[name])
    path = find(name, game)
    policy = read(path, game)
    if policy.num_actions != num_actions:
        raise PolicyError(
            f"{path}: the last layer must have {num_actions} outputs, one for each action of {game.name}, got {policy.num_actions}"
        )
    return policy.on_ram(num_envs, seed)
