"""The networks with weights shared by slots."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import ocjax
from ocjax.agents import networks
from ocjax.agents.config import Config
from ocjax.envs import Vector, settings
from ocjax.play import policies
from ocjax.play.networks import ENCODER_LAYERS, NETWORKS, SCALES, groups_of
from ocjax.play.policies import PolicyError, SavedPolicy
from tests.support.policies import changed

GAME = ocjax.load("SpaceInvaders", hud=False)
CONFIG = Config("SpaceInvaders")
ACTIONS = 6


@pytest.fixture(params=ENCODER_LAYERS)
def network(request):
    return request.param


@pytest.fixture
def layers(network):
    """Random weights of an actor."""
    inputs = (len(CONFIG.vector.features_of(GAME)),)
    encoders = NETWORKS[network].shapes(inputs, CONFIG.groups, [])[:-1]
    width = sum(group.width for group in CONFIG.groups)
    rng = np.random.default_rng(0)
    shapes = [*encoders, (width, 64), (64, 64), (64, ACTIONS)]
    return [
        (
            rng.normal(scale=n**-0.5, size=(n, m)).astype(np.float16).astype(np.float32),
            rng.normal(size=m).astype(np.float16).astype(np.float32),
        )
        for n, m in shapes
    ]


@pytest.fixture
def path(network, layers, tmp_path):
    known = {
        "settings": settings("dqn", clip_rewards=False),
        "preset": "dqn",
        "sampled": True,
        "network": network,
    }
    SavedPolicy(GAME, layers, CONFIG.vector, **known).write(tmp_path / "policy.npz")
    return tmp_path / "policy.npz"


def observations(count, seed=0):
    """Random features `[count, inputs]`; invalid slots are 0."""
    rng, parts = np.random.default_rng(seed), []
    for group in CONFIG.groups:
        slots = rng.normal(50, 60, size=(count, group.slots, len(group.features))).astype(
            np.float32
        )
        valid = rng.random((count, group.slots, 1)) < 0.5
        slots = np.where(valid, slots, np.float32(0))
        slots[:, :, group.features.index("valid")] = valid[:, :, 0]
        parts.append(slots.reshape(count, -1))
    return np.concatenate(parts, axis=1)


def by_slots(network, layers, observed, groups):
    """The logits of one observation, slot by slot."""
    layers, codes = list(layers), []
    for group in groups:
        encoder = [layers.pop(0) for _ in range(ENCODER_LAYERS[network])] if group.pooled else []
        encoded = []
        for i in range(group.slots):
            start = group.first + i * len(group.features)
            own = dict(
                zip(group.features, observed[start : start + len(group.features)], strict=True)
            )
            code = np.array(
                [
                    np.clip((v - SCALES[f][0]) / SCALES[f][1], -5, 5) * own["valid"]
                    for f, v in own.items()
                ]
            )
            for w, b in encoder:
                code = np.maximum(code @ w + b, 0)
            encoded.append(code * own["valid"] if group.pooled else code)
        codes += [np.mean(encoded, axis=0), np.max(encoded, axis=0)] if group.pooled else encoded
    x = np.concatenate(codes)
    for w, b in layers[:-1]:
        x = np.tanh(x @ w + b)
    return x @ layers[-1][0] + layers[-1][1]


def test_slots_share_an_encoder(network, layers):
    """The network equals its definition in the docstring for every slot."""
    x = observations(5)
    logits = NETWORKS[network].apply(layers, x, CONFIG.groups)
    assert np.allclose(
        logits, [by_slots(network, layers, own, CONFIG.groups) for own in x], rtol=1e-4, atol=1e-4
    )


def test_gradient_of_the_encoders(network, layers):
    """It agrees with differences of the network's values."""
    x = observations(64)
    apply = NETWORKS[network].apply
    first, direction = layers[0][0], np.sign(layers[0][0])

    def total(step):
        moved = [(first + step * direction, layers[0][1]), *layers[1:]]
        return apply(moved, x, CONFIG.groups).sum()

    derivative = jax.grad(total)(jnp.float32(0))
    step = np.float32(1e-3)
    difference = (total(step) - total(-step)) / (2 * step)
    assert abs(derivative) > 1
    assert np.allclose(derivative, difference, rtol=0.02)


def test_perceptrons_of_any_depth(network, layers):
    """Files may have other numbers of hidden layers than `ocjax train`."""
    x = observations(5)
    shallow = [*layers[:-2], layers[-1]]
    logits = NETWORKS[network].apply(shallow, x, CONFIG.groups)
    slow = [by_slots(network, shallow, own, CONFIG.groups) for own in x]
    assert np.allclose(logits, slow, rtol=1e-4, atol=1e-4)


def test_the_order_of_slots_does_not_matter(network, layers):
    x = observations(5)
    group = next(g for g in CONFIG.groups if g.pooled)
    columns = slice(group.first, group.first + group.slots * len(group.features))
    y = x.copy()
    y[:, columns] = x[:, columns].reshape(5, group.slots, -1)[:, ::-1].reshape(5, -1)
    assert not np.array_equal(x, y)
    apply = NETWORKS[network].apply
    assert np.allclose(
        apply(layers, x, CONFIG.groups), apply(layers, y, CONFIG.groups), rtol=1e-5, atol=1e-5
    )


def test_a_file_gives_the_same_actions(network, layers, path):
    policy = policies.read(path, ocjax.load("SpaceInvaders"))
    x = observations(20)
    assert policy.groups == CONFIG.groups
    assert policy.mean is None
    logits = np.asarray(NETWORKS[network].apply(layers, x, CONFIG.groups))
    assert np.array_equal(policy.logits(x), logits)
    act = policies.make_policy(str(path), ocjax.load("SpaceInvaders"), ACTIONS, 3, 0)
    assert act(policies.Seen(jnp.zeros((3, 128), jnp.uint8), np.ones(3, bool))).shape == (3,)


@pytest.mark.parametrize(
    ("vector", "message"),
    [
        (Vector(("x", "y"), normalize=False), "the feature valid"),
        (Vector(("x", "value", "valid"), normalize=False), "got x, value, valid"),
        (Vector(("x", "valid"), normalize=False, history=2), "one state"),
        (Vector(("x", "valid")), "one state"),
    ],
)
def test_observations_that_it_cannot_take(vector, message):
    with pytest.raises(ValueError, match=message):
        groups_of(GAME, vector)


@pytest.mark.parametrize("network", ["deep_sets"], indirect=True)
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mean": np.zeros(3)}, "mean must be absent"),
        ({"w0": np.zeros((9, 32))}, r"w0 \[10, n\].*got \[9, 32\]"),
        ({"w1": np.zeros((9, 32))}, "w1"),
        ({"w3": np.zeros((221, 64))}, r"w3 \[222, n\]"),
        ({"w3": None}, "w3"),
        ({"w5": np.zeros((64, 5)), "b5": np.zeros(5)}, "must have 6 outputs"),
        ({"history": 2**53}, "one state"),
        ({"normalize": True}, "one state"),
        ({"features": ["x", "y"]}, "the feature valid"),
        ({"features": ["x", "w", "valid"]}, "got x, w, valid"),
    ],
)
def test_files_that_are_no_policies(path, tmp_path, change, message):
    changed(path, tmp_path / "p.npz", change)
    with pytest.raises(PolicyError, match=message):
        policies.make_policy(str(tmp_path / "p.npz"), ocjax.load("SpaceInvaders"), ACTIONS, 1, 0)


def test_trained_actor_and_critic_share_encoders():
    """A change of an encoder's weights changes logits and values."""
    network = networks.deep_sets(CONFIG.groups, ACTIONS)
    params = network.init(jax.random.key(0))
    x = jnp.asarray(observations(5))
    changed_params = params | {
        "encoders": [{"w": layer["w"] + 1, "b": layer["b"]} for layer in params["encoders"]]
    }
    before, after = network.apply(params, x), network.apply(changed_params, x)
    assert all(not np.allclose(b, a) for b, a in zip(before, after, strict=True))
    actor = [(layer["w"], layer["b"]) for layer in (*params["encoders"], *params["actor"])]
    played = NETWORKS["deep_sets"].apply(actor, x, CONFIG.groups)
    assert np.allclose(played, before[0], rtol=1e-5, atol=1e-6)
