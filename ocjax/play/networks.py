"""The networks of saved policies by name; applying one is a function of its layers and its inputs.

`B` is the number of states and `A` the number of actions. A layer is a pair of weights and biases: `[n, m]` and `[m]`, or in a convolution
`[channels, channels before, height, width]` and `[channels]`.
"""

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

CONVOLUTIONS = ((32, 8, 4), (64, 4, 2), (64, 3, 1))  # channels, kernel size and stride, as in Mnih et al. (2015)
CONVOLUTION_OUTPUT = 64 * 7 * 7

Layers = Sequence[tuple[Any, Any]]
Shape = tuple[int, ...]


class Network(NamedTuple):
    """A kind of network."""

    apply: Callable[[Layers, Any], Any]  # layers, inputs [B, ...] -> logits [B, A]
    shapes: Callable[[Shape, Sequence[Shape]], list[Shape]]  # shape of an input, those of the given weights -> those that weights must have
    pixels: bool = False  # whether its inputs are observations "dqn"


def perceptron(layers: Layers, x: Any, activation: Callable[[Any], Any]) -> Any:
    """A multilayer perceptron on float32 `[B, n]`, without activation after its last layer."""
    for i, (w, b) in enumerate(layers):
        x = x @ w + b[None]
        x = activation(x) if i + 1 < len(layers) else x
    return x


def convolved(layers: Layers, frames: jax.Array) -> jax.Array:
    """The convolutions of Mnih et al. (2015) on uint8 `[B, stack, 84, 84]`: float32 `[B, CONVOLUTION_OUTPUT]`."""
    x = frames.astype(jnp.float32) / jnp.float32(255)
    for (w, b), (_, _, stride) in zip(layers, CONVOLUTIONS, strict=True):
        x = jax.nn.relu(lax.conv(x, w, (stride, stride), "VALID") + b[None, :, None, None])
    return x.reshape(len(x), -1)


def mlp(layers: Layers, x: np.ndarray) -> np.ndarray:
    """A perceptron with tanh, in NumPy: a few states take less time than a call of a compiled function."""
    return perceptron(layers, x, np.tanh)


def relu_mlp(layers: Layers, x: np.ndarray) -> np.ndarray:
    """A perceptron with relu."""
    return perceptron(layers, x, lambda numbers: np.maximum(numbers, 0))


@jax.jit
def nature_cnn(layers: Layers, frames: jax.Array) -> jax.Array:
    """Convolutions, then a perceptron with relu."""
    n = len(CONVOLUTIONS)
    return perceptron(layers[n:], convolved(layers[:n], frames), jax.nn.relu)


def _of_perceptron(inputs: Shape, given: Sequence[Shape]) -> list[Shape]:
    widths = [*inputs, *(shape[-1] if shape else 0 for shape in given)]
    return list(itertools.pairwise(widths))


def _of_nature_cnn(inputs: Shape, given: Sequence[Shape]) -> list[Shape]:
    channels = (inputs[0], *(n for n, _, _ in CONVOLUTIONS))
    torso: list[Shape] = [(n, before, size, size) for before, (n, size, _) in zip(channels, CONVOLUTIONS, strict=False)]
    return torso + _of_perceptron((CONVOLUTION_OUTPUT,), given[len(torso) :] or [(0, 0)])


NETWORKS: Mapping[str, Network] = {
    "mlp": Network(mlp, _of_perceptron),
    "relu_mlp": Network(relu_mlp, _of_perceptron),
    "nature_cnn": Network(nature_cnn, _of_nature_cnn, pixels=True),
}
