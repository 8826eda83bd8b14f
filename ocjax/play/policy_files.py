"""Reading saved policies from `.npz` files.

The files may come from other people, so every field and shape is checked.
"""

import dataclasses
import re
import reprlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ocjax._files import npz
from ocjax.emulators.checks import integer
from ocjax.envs import Dqn, Settings, Vector
from ocjax.extraction.categories import ATTRIBUTES
from ocjax.extraction.game import Game
from ocjax.extraction.registry import load
from ocjax.extraction.selection import Selection, Slots
from ocjax.play.networks import NETWORKS, Groups, Layers, Shape, groups_of
from ocjax.play.saved import PolicyError, SavedPolicy, slots_of

MOST_BYTES = 2**27  # size of all arrays of a saved policy
MOST_FRAMES = 2**53
MOST_SLOTS = 2**16  # per category
LARGEST, LEAST_DEVIATION = 1e15, 1e-6  # limits of numbers: products of larger ones overflow
CONVOLUTION = 4  # dimensions of the weights of a convolution
# The inputs of files without a description: boxes in units of 160 pixels, and validity.
PLAIN = Vector(("x", "y", "w", "h", "valid"), normalize=False)
PLAIN_UNITS = (160.0, 160.0, 160.0, 160.0, 1.0)


def read(path: str | Path, game: Game) -> SavedPolicy:
    """Read a policy from an .npz file.

    Args:
        path: a file with weights `w0` `[inputs, n]`, biases `b0` `[n]`, and so on for each layer.
            It may contain `mean` and `deviation` `[inputs]` and a JSON text `description`, as
            written by `SavedPolicy.write`. Without a description, the inputs are x, y, w, h in
            units of 160 pixels and the validity of each slot of the game.
    """
    arrays = _arrays(path)
    description = _description(path, arrays)
    if description and description.get("md5") != game.md5:
        raise PolicyError(
            f"{path}: the policy is for {description.get('game')}, not for {game.name}"
        )
    try:
        name, known = _network(description), _known(description)
        kind = Dqn() if NETWORKS[name].pixels else _observation(description)
        slots, hud = (None, game.hud) if isinstance(kind, Dqn) else _slots(description, game)
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise PolicyError(
            f"{path}: the description of the policy is damaged: {type(error).__name__}: {error}"
        ) from error
    if "w0" not in arrays:
        raise PolicyError(f"{path} is not a readable policy: it has no layer w0")
    if isinstance(kind, Dqn):
        return _on_pixels(path, game, kind, arrays, name, known)
    try:
        game, selection = _select(game, kind, slots, hud)
    except ValueError as error:
        raise PolicyError(f"{path}: the policy was trained with other objects: {error}") from error
    known |= {"slots": selection.slots, "network": name}
    if NETWORKS[name].grouped:
        return _grouped(path, selection.game, SavedPolicy(game, (), kind, **known), arrays)
    inputs = _count_inputs(path, selection.game, kind, arrays["w0"])
    layers = layers_of(path, game, arrays, name, (inputs,))
    mean, deviation = _moments(path, game, kind, arrays, inputs)
    return SavedPolicy(game, layers, kind, mean, deviation, **known)


def _arrays(path: str | Path) -> dict[str, np.ndarray]:
    try:
        headers = npz.headers(Path(path), _is_read)
        size = sum(header.size for header in headers.values())
        if size > MOST_BYTES:
            raise PolicyError(
                f"{path} holds {size:,} bytes of weights, and at most {MOST_BYTES:,} are read"
            )
        arrays = npz.read(Path(path), _is_read)
    except (OSError, npz.NpzError) as error:
        raise PolicyError(
            f"{path} is not a readable policy (.npz with w0, b0, w1, b1, ...): {error}"
        ) from error
    for name, array in arrays.items():
        if name != "description" and not (
            array.dtype.kind in "iuf" and (np.abs(array.astype(np.float64)) < LARGEST).all()
        ):
            raise PolicyError(
                f"{path}: {name} must hold finite numbers below {LARGEST:g}, got {array.dtype} "
                f"{list(array.shape)}"
            )
    return arrays


def _on_pixels(
    path: str | Path,
    game: Game,
    kind: Dqn,
    arrays: Mapping[str, np.ndarray],
    name: str,
    known: Mapping[str, Any],
) -> SavedPolicy:
    _check_no_moments(path, arrays, name)
    shape = kind.space(game, "raw").shape
    assert shape is not None
    return SavedPolicy(
        game, layers_of(path, game, arrays, name, shape), kind, network=name, **known
    )


def _grouped(
    path: str | Path, described: Game, policy: SavedPolicy, arrays: Mapping[str, np.ndarray]
) -> SavedPolicy:
    """The policy with layers that share weights between slots.

    `described` is the game with the slots that the policy sees.
    """
    _check_no_moments(path, arrays, policy.network)
    assert isinstance(policy.observation, Vector)
    try:
        groups = groups_of(described, policy.observation)
    except ValueError as error:
        raise PolicyError(f"{path}: {error}") from error
    return dataclasses.replace(
        policy, layers=layers_of(path, policy.game, arrays, policy.network, (), groups)
    )


def _check_no_moments(path: str | Path, arrays: Mapping[str, np.ndarray], name: str) -> None:
    for moment in ("mean", "deviation"):
        if moment in arrays:
            raise PolicyError(
                f"{path}: {moment} must be absent, as the network {name} does not standardise "
                "its inputs"
            )


def _count_inputs(path: str | Path, game: Game, kind: Vector, first: np.ndarray) -> int:
    """Return the first layer's number of inputs, checked before arrays of that size are made."""
    if kind.history > first.size:
        raise PolicyError(
            f"{path}: layer 0 has {first.size:,} weights, too few for a history of "
            f"{kind.history:,} states"
        )
    inputs = kind.history * len(dataclasses.replace(kind, history=1).features_of(game))
    if first.shape[:1] != (inputs,):
        raise PolicyError(
            f"{path}: layer 0 must have w0 [{inputs}, n] for {game.name}, got {list(first.shape)}"
        )
    return inputs


def _moments(
    path: str | Path, game: Game, kind: Vector, arrays: Mapping[str, np.ndarray], inputs: int
) -> tuple[np.ndarray, np.ndarray]:
    """The mean and the deviation of the inputs, float32 `[inputs]`."""
    units = (
        np.tile(np.array(PLAIN_UNITS, np.float32), game.num_slots)
        if kind is PLAIN
        else np.ones(inputs, np.float32)
    )
    mean, deviation = (
        np.asarray(arrays.get(n, a), np.float32)
        for n, a in (("mean", np.zeros(inputs)), ("deviation", units))
    )
    if (
        mean.shape != (inputs,)
        or deviation.shape != (inputs,)
        or not (deviation >= LEAST_DEVIATION).all()
    ):
        raise PolicyError(
            f"{path}: mean and deviation must have shape [{inputs}] for {game.name}, and "
            "deviation must be positive"
        )
    return mean, deviation


def _network(description: Mapping[str, Any]) -> str:
    name = description.get("network", "mlp")  # older policies lack it
    if name not in tuple(NETWORKS):
        raise ValueError(f"network must be one of {', '.join(NETWORKS)}, got {reprlib.repr(name)}")
    return name


def _is_read(name: str) -> bool:
    return re.fullmatch(r"[wb]\d+|mean|deviation|description", name) is not None


def _description(path: str | Path, arrays: Mapping[str, np.ndarray]) -> dict[str, Any]:
    if "description" not in arrays:
        return {}
    description = npz.json_object(arrays["description"])
    if description is None:
        raise PolicyError(
            f"{path}: the description of the policy must be a JSON object, got "
            f"{str(arrays['description'])[:200]!r}"
        )
    return description


def _observation(description: Mapping[str, Any]) -> Vector:
    if not description:
        return PLAIN
    # Older policies have no grid_features.
    features = (description["features"], description.get("grid_features"))
    if not all(
        names is None or (isinstance(names, list) and all(isinstance(n, str) for n in names))
        for names in features
    ):
        raise ValueError(f"features must be lists of names, got {reprlib.repr(features)}")
    history = integer("history", description["history"], 1, MOST_FRAMES)
    return Vector(
        features[0],
        grid_features=features[1],
        history=history,
        normalize=_flag(description, "normalize"),
    )


def _slots(description: Mapping[str, Any], game: Game) -> tuple[list[Slots] | None, bool]:
    """The slots in a description (None in older files), and whether the policy sees the display."""
    hud = _flag(description, "hud") if description else game.hud
    entries = description.get("slots", [])
    if not isinstance(entries, list) or ("slots" in description and not entries):
        raise ValueError(
            f"slots must be a list with an entry for each category, got {reprlib.repr(entries)}"
        )
    slots = [_slots_entry(entry) for entry in entries]
    if slots and hud != any(own.hud for own in slots):
        raise ValueError(f"hud must be {not hud}, as in the slots, got {hud}")
    return slots or None, hud


def _slots_entry(entry: Any) -> Slots:
    names = [field.name for field in dataclasses.fields(Slots)]
    if not isinstance(entry, dict) or set(entry) != set(names):
        raise ValueError(
            f"an entry of slots must have the fields {', '.join(names)}, got {reprlib.repr(entry)}"
        )
    attributes = tuple(entry["attributes"])
    if not isinstance(entry["category"], str) or not set(attributes) <= set(ATTRIBUTES):
        raise ValueError(
            "category must be a name, and attributes must be of "
            f"{', '.join(ATTRIBUTES)}, got {reprlib.repr(entry)}"
        )
    count = integer("count", entry["count"], 1, MOST_SLOTS)
    flags = _flag(entry, "hud"), _flag(entry, "on_grid")
    return Slots(entry["category"], count, *flags, attributes)


def _select(
    game: Game, kind: Vector, slots: Sequence[Slots] | None, hud: bool
) -> tuple[Game, Selection]:
    """The game, without its display if the policy does not see it, and the slots that it sees."""
    if slots is None:
        game = _with_display(game, hud)
        return game, Selection(game, slots_of(game, kind))
    plain = _with_display(game, False)
    game = (
        plain if all(own.category in plain.slices for own in slots) else _with_display(game, True)
    )
    return game, Selection(game, slots)


def _with_display(game: Game, hud: bool) -> Game:
    if game.hud == hud:
        return game
    return load(game.name, hud=hud) if hud or game is load(game.name) else game.without_hud()


def _flag(description: Mapping[str, Any], name: str) -> bool:
    if not isinstance(description[name], bool):
        raise ValueError(f"{name} must be true or false, got {reprlib.repr(description[name])}")
    return description[name]


def _known(description: Mapping[str, Any]) -> dict[str, Any]:
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


def layers_of(
    path: str | Path,
    game: Game,
    arrays: Mapping[str, np.ndarray],
    name: str,
    inputs: Shape,
    groups: Groups = (),
) -> Layers:
    """The weights and biases, after a check of their shapes."""
    count = next(i for i in range(len(arrays) + 1) if f"w{i}" not in arrays)
    weights = [arrays[f"w{i}"] for i in range(count)]
    layers = []
    for i, shape in enumerate(NETWORKS[name].shapes(inputs, groups, [w.shape for w in weights])):
        w = weights[i] if i < count else np.zeros(0)
        b = arrays.get(f"b{i}", np.zeros(0))
        outputs = shape[0] if len(shape) == CONVOLUTION else shape[-1]
        if w.shape != shape or b.shape != (outputs,) or not w.size:
            raise PolicyError(
                f"{path}: layer {i} must have {_required(i, shape)} for {game.name}, "
                f"got {list(w.shape)} and {list(b.shape)}"
            )
        layers.append((w.astype(np.float32), b.astype(np.float32)))
    return layers


def _required(i: int, shape: Shape) -> str:
    """The shapes of a layer's arrays, with n for the outputs of layers that may have any number."""
    if len(shape) == CONVOLUTION:
        return f"w{i} {list(shape)} and b{i} [{shape[0]}]"
    return f"w{i} [{', '.join(map(str, (*shape[:-1], 'n')))}] and b{i} [n]"
