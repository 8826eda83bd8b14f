"""The networks of saved policies by name, as functions of layers and inputs.

`B` is the number of states and `A` the number of actions. A layer is a pair of weights and biases:
`[n, m]` and `[m]`, or in a convolution `[channels, channels before, height, width]` and
`[channels]`.
"""

import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from ocjax.envs import Vector
from ocjax.extraction.game import Game

# Channels, kernel size and stride, as in Mnih et al. (2015).
CONVOLUTIONS = ((32, 8, 4), (64, 4, 2), (64, 3, 1))
CONVOLUTION_OUTPUT = 64 * 7 * 7
CODE = 32  # values that encode a slot
# Layers that encode a slot, by network.
ENCODER_LAYERS = {"deep_sets": 1, "shared": 2}
# The center and the unit of each input feature: pixels of a 160 x 210 screen, and compass points.
SCALES = {
    "x": (80.0, 40.0),
    "y": (105.0, 50.0),
    "dx": (0.0, 4.0),
    "dy": (0.0, 4.0),
    "nx": (0.0, 0.5),
    "ny": (0.0, 0.5),
}
SCALES |= {"mx": (0.0, 0.5), "my": (0.0, 0.5), "orientation": (0.0, 8.0), "valid": (0.0, 1.0)}
MOST_SCALED = 5.0  # limit of scaled features

Layers = Sequence[tuple[Any, Any]]
Shape = tuple[int, ...]


class Group(NamedTuple):
    """The slots of one category in the observation `Vector`."""

    first: int  # column of the first slot
    slots: int
    features: tuple[str, ...]

    @property
    def pooled(self) -> bool:
        """True if the slots share an encoder.

        A single slot, and slots with a single feature (the validity), are inputs themselves.
        """
        return self.slots > 1 and len(self.features) > 1

    @property
    def width(self) -> int:
        """The number of values that represent the slots, float32 `[B, width]`."""
        return 2 * CODE if self.pooled else self.slots * len(self.features)


Groups = tuple[Group, ...]


def groups_of(game: Game, vector: Vector) -> Groups:
    """The groups of an observation, one per category.

    Raises:
        ValueError: networks with groups do not support the observation.
    """
    if vector.history > 1 or vector.normalize:
        raise ValueError(
            f"networks with groups take one state, with lengths in pixels, got {vector.history} "
            "or normalised lengths"
        )
    names, groups, first = vector.features_of(game), [], 0
    for category in game.categories:
        features = tuple(f for _, name, i, f in names if name == category.name and i == 0)
        if "valid" not in features or not set(features) <= set(SCALES):
            raise ValueError(
                f"networks with groups take the feature valid and any of {', '.join(SCALES)}, got "
                f"{', '.join(features)}"
            )
        groups.append(Group(first, category.count, features))
        first += category.count * len(features)
    return tuple(groups)


class Network(NamedTuple):
    """A kind of network."""

    apply: Callable[[Layers, Any, Groups], Any]  # layers, inputs [B, ...], groups -> logits [B, A]
    # shape of an input, groups, shapes of the given weights -> required shapes of the weights
    shapes: Callable[[Shape, Groups, Sequence[Shape]], list[Shape]]
    pixels: bool = False  # takes the observation "dqn"
    standardized: bool = False  # needs standardised inputs
    grouped: bool = False  # needs groups


def perceptron(layers: Layers, x: Any, activation: Callable[[Any], Any]) -> Any:
    """A multilayer perceptron on float32 `[B, n]`, without activation after its last layer."""
    for i, (w, b) in enumerate(layers):
        x = x @ w + b[None]
        x = activation(x) if i + 1 < len(layers) else x
    return x


def convolved(layers: Layers, frames: jax.Array) -> jax.Array:
    """The convolutions of Mnih et al. (2015): uint8 `[B, stack, 84, 84]` -> float32 `[B, n]`."""
    x = frames.astype(jnp.float32) / jnp.float32(255)
    for (w, b), (_, _, stride) in zip(layers, CONVOLUTIONS, strict=True):
        x = jax.nn.relu(lax.conv(x, w, (stride, stride), "VALID") + b[None, :, None, None])
    return x.reshape(len(x), -1)


def mlp(layers: Layers, x: np.ndarray, groups: Groups = ()) -> np.ndarray:
    """A perceptron with tanh, in NumPy, which is faster for a few states."""
    return perceptron(layers, x, np.tanh)


def relu_mlp(layers: Layers, x: np.ndarray, groups: Groups = ()) -> np.ndarray:
    """A perceptron with relu."""
    return perceptron(layers, x, lambda numbers: np.maximum(numbers, 0))


@functools.partial(jax.jit, static_argnums=2)
def nature_cnn(layers: Layers, frames: jax.Array, groups: Groups = ()) -> jax.Array:
    """Convolutions, then a perceptron with relu."""
    n = len(CONVOLUTIONS)
    return perceptron(layers[n:], convolved(layers[:n], frames), jax.nn.relu)


@functools.partial(jax.jit, static_argnames=("groups", "depth"))
def deep_sets(layers: Layers, x: jax.Array, groups: Groups, *, depth: int) -> jax.Array:
    """A perceptron with tanh on the codes of the categories, from float32 `[B, n]`.

    `layers` contains the encoders of `encoded` with `depth` layers each, then the perceptron.
    """
    count = depth * sum(group.pooled for group in groups)
    return perceptron(layers[count:], encoded(layers[:count], x, groups), jnp.tanh)


def encoded(encoders: Layers, x: jax.Array, groups: Groups) -> jax.Array:
    """The codes of the categories, as in Deep Sets (Zaheer et al., 2017).

    The inputs are float32 `[B, n]`, the codes `[B, sum of the groups' widths]`. The slots of a
    category share an encoder, a perceptron with relu. The mean and the maximum of the valid slots'
    codes represent the category. `encoders` contains equally many layers for each group.
    """
    codes, layers = [], iter(encoders)
    depth = len(encoders) // max(1, sum(group.pooled for group in groups))
    for group in groups:
        slots, valid = _scaled(x, group)
        if group.pooled:
            encoder = list(itertools.islice(layers, depth))
            code = jax.nn.relu(
                perceptron(encoder, slots.reshape(-1, len(group.features)), jax.nn.relu)
            )
            code = code.reshape(len(x), group.slots, -1) * valid
            codes += [code.mean(axis=1), _largest(code)]
        else:
            codes.append(slots.reshape(len(x), -1))
    return jnp.concatenate(codes, axis=1)


def _max_over_slots(code: jax.Array) -> jax.Array:
    return code.max(axis=1)


def _forward(code: jax.Array) -> tuple[jax.Array, tuple[jax.Array, jax.Array]]:
    largest = _max_over_slots(code)
    return largest, (code, largest)


def _backward(saved: tuple[jax.Array, jax.Array], gradient: jax.Array) -> tuple[jax.Array]:
    code, largest = saved
    return (jnp.where(code == largest[:, None], gradient[:, None], jnp.float32(0)),)


# JAX's own gradient shares the gradient among equal codes, which takes a sixth of an update. Codes
# are rarely equal except at 0, where relu has no gradient.
_largest = jax.custom_vjp(_max_over_slots)
_largest.defvjp(_forward, _backward)


def _scaled(x: jax.Array, group: Group) -> tuple[jax.Array, jax.Array]:
    """A group's scaled features `[B, slots, features]`, and the validity `[B, slots, 1]`.

    The features are 0 in slots that are not valid.
    """
    n = len(group.features)
    center, unit = np.array([SCALES[name] for name in group.features], np.float32).T
    slots = x[:, group.first : group.first + group.slots * n].reshape(len(x), group.slots, n)
    valid = slots[:, :, group.features.index("valid"), None]
    return jnp.clip(
        (slots - center[None, None]) / unit[None, None], -MOST_SCALED, MOST_SCALED
    ) * valid, valid


def _of_perceptron(inputs: Shape, groups: Groups, given: Sequence[Shape]) -> list[Shape]:
    widths = [*inputs, *(shape[-1] if shape else 0 for shape in given)]
    return list(itertools.pairwise(widths))


def _of_nature_cnn(inputs: Shape, groups: Groups, given: Sequence[Shape]) -> list[Shape]:
    channels = (inputs[0], *(n for n, _, _ in CONVOLUTIONS))
    torso: list[Shape] = [
        (n, before, size, size)
        for before, (n, size, _) in zip(channels, CONVOLUTIONS, strict=False)
    ]
    return torso + _of_perceptron((CONVOLUTION_OUTPUT,), groups, given[len(torso) :] or [(0, 0)])


def encoder_sizes(group: Group, network: str) -> Shape:
    """The sizes of the inputs and of each layer of a pooled group's encoder."""
    return (len(group.features), *[CODE] * ENCODER_LAYERS[network])


def _of_deep_sets(
    network: str, inputs: Shape, groups: Groups, given: Sequence[Shape]
) -> list[Shape]:
    encoders = [
        shape
        for group in groups
        if group.pooled
        for shape in itertools.pairwise(encoder_sizes(group, network))
    ]
    width = sum(group.width for group in groups)
    return encoders + _of_perceptron((width,), groups, given[len(encoders) :] or [(0, 0)])


NETWORKS: Mapping[str, Network] = {
    "mlp": Network(mlp, _of_perceptron, standardized=True),
    "relu_mlp": Network(relu_mlp, _of_perceptron, standardized=True),
    **{
        name: Network(
            functools.partial(deep_sets, depth=depth),
            functools.partial(_of_deep_sets, name),
            grouped=True,
        )
        for name, depth in ENCODER_LAYERS.items()
    },
    "nature_cnn": Network(nature_cnn, _of_nature_cnn, pixels=True),
}
