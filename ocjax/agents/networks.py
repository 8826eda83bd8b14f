"""The networks of agents, as pure functions of pytrees of parameters."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax.nn.initializers import orthogonal

from ocjax.play.networks import (
    CONVOLUTION_OUTPUT,
    CONVOLUTIONS,
    Groups,
    Layers,
    convolved,
    encoded,
    encoder_sizes,
    perceptron,
)

Params = dict[str, list[dict[str, jax.Array]]]

HIDDEN = (64, 64)
DENSE = 512
# Scales of initial weights, as in the PPO implementations that Huang et al. (2022) compare.
GAIN, ACTOR_GAIN, CRITIC_GAIN = 2**0.5, 0.01, 1.0


class Network(NamedTuple):
    """An actor and a critic."""

    init: Callable[[jax.Array], Params]  # random key -> parameters
    # Parameters, observations [B, ...] -> logits [B, A], values [B].
    apply: Callable[[Params, jax.Array], tuple[jax.Array, jax.Array]]


def _dense_layers(
    key: jax.Array, sizes: Sequence[int], last_gain: float
) -> list[dict[str, jax.Array]]:
    gains = [GAIN] * (len(sizes) - 2) + [last_gain]
    keys = jax.random.split(key, len(gains))
    return [
        {"w": orthogonal(gain)(k, (n, m), jnp.float32), "b": jnp.zeros(m, jnp.float32)}
        for k, gain, n, m in zip(keys, gains, sizes[:-1], sizes[1:], strict=True)
    ]


def _dense(
    layers: Sequence[dict[str, jax.Array]],
    x: jax.Array,
    activation: Callable[[jax.Array], jax.Array],
) -> jax.Array:
    return perceptron(_pairs(layers), x, activation)


def _pairs(layers: Sequence[dict[str, jax.Array]]) -> Layers:
    return [(layer["w"], layer["b"]) for layer in layers]


def mlp(num_inputs: int, num_actions: int, hidden: Sequence[int] = HIDDEN) -> Network:
    """Separate perceptrons with tanh for actor and critic, on float32 `[B, num_inputs]`."""

    def init(key: jax.Array) -> Params:
        actor, critic = jax.random.split(key)
        return {
            "actor": _dense_layers(actor, (num_inputs, *hidden, num_actions), ACTOR_GAIN),
            "critic": _dense_layers(critic, (num_inputs, *hidden, 1), CRITIC_GAIN),
        }

    def apply(params: Params, x: jax.Array) -> tuple[jax.Array, jax.Array]:
        return _dense(params["actor"], x, jnp.tanh), _dense(params["critic"], x, jnp.tanh)[:, 0]

    return Network(init, apply)


def deep_sets(groups: Groups, num_actions: int, hidden: Sequence[int] = HIDDEN) -> Network:
    """Perceptrons with tanh for actor and critic on the codes of `ocjax.play.networks.encoded`.

    They share the encoders, and take float32 `[B, num_inputs]`.
    """
    pooled = [group for group in groups if group.pooled]
    width = sum(group.width for group in groups)

    def init(key: jax.Array) -> Params:
        *keys, actor, critic = jax.random.split(key, len(pooled) + 2)
        encoders = [
            _dense_layers(k, encoder_sizes(group, "deep_sets"), GAIN)
            for k, group in zip(keys, pooled, strict=True)
        ]
        return {
            "encoders": [layer for encoder in encoders for layer in encoder],
            "actor": _dense_layers(actor, (width, *hidden, num_actions), ACTOR_GAIN),
            "critic": _dense_layers(critic, (width, *hidden, 1), CRITIC_GAIN),
        }

    def apply(params: Params, x: jax.Array) -> tuple[jax.Array, jax.Array]:
        codes = encoded(_pairs(params["encoders"]), x, groups)
        return _dense(params["actor"], codes, jnp.tanh), _dense(params["critic"], codes, jnp.tanh)[
            :, 0
        ]

    return Network(init, apply)


def nature_cnn(stack: int, num_actions: int) -> Network:
    """The convolutional network of Mnih et al. (2015) with heads for actor and critic.

    It takes uint8 `[B, stack, 84, 84]`.
    """

    def init(key: jax.Array) -> Params:
        keys = jax.random.split(key, len(CONVOLUTIONS) + 3)
        channels = (stack, *(n for n, _, _ in CONVOLUTIONS))
        # A filter's weights are [channels out, in, height, width].
        initial = orthogonal(GAIN, column_axis=0)
        torso = [
            {"w": initial(k, (n, before, size, size), jnp.float32), "b": jnp.zeros(n, jnp.float32)}
            for k, before, (n, size, _) in zip(keys, channels, CONVOLUTIONS, strict=False)
        ]
        return {
            "torso": torso,
            "dense": _dense_layers(keys[-3], (CONVOLUTION_OUTPUT, DENSE), GAIN),
            "actor": _dense_layers(keys[-2], (DENSE, num_actions), ACTOR_GAIN),
            "critic": _dense_layers(keys[-1], (DENSE, 1), CRITIC_GAIN),
        }

    def apply(params: Params, x: jax.Array) -> tuple[jax.Array, jax.Array]:
        x = convolved(_pairs(params["torso"]), x)
        x = jax.nn.relu(_dense(params["dense"], x, jax.nn.relu))
        return _dense(params["actor"], x, jax.nn.relu), _dense(params["critic"], x, jax.nn.relu)[
            :, 0
        ]

    return Network(init, apply)
