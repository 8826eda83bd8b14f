"""Random errors of a detector."""

import dataclasses

import gymnasium
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import ocjax
from ocjax.envs import PerturbObjects
from tests.support.states import excerpt

pytestmark = pytest.mark.usefixtures("quick_compilation")

KEY = jax.random.key(3)
FIELDS = ("xywh", "valid", "orientation", "value", "rgb")


@pytest.fixture(scope="module")
def objects():
    return ocjax.load("Breakout").rem(np.resize(excerpt("Breakout")["rams"], (60, 128)))


def equal(a, b):
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in FIELDS)


def test_without_errors_nothing_changes(objects):
    assert equal(ocjax.perturb(KEY, objects), objects)


def test_dropped(objects):
    noisy = ocjax.perturb(KEY, objects, drop=0.25)
    assert not np.any(noisy.valid & ~objects.valid)
    assert 0.22 < 1 - noisy.valid.sum() / objects.valid.sum() < 0.28
    assert not np.any(np.asarray(noisy.xywh)[~np.asarray(noisy.valid)])
    assert np.array_equal(noisy.xywh[noisy.valid], objects.xywh[noisy.valid])
    assert not np.any(ocjax.perturb(KEY, objects, drop=1).valid)


def test_jittered(objects):
    noisy = ocjax.perturb(KEY, objects, jitter=3)
    assert np.array_equal(noisy.valid, objects.valid)
    by = np.asarray(noisy.xywh - objects.xywh)[np.asarray(objects.valid)]
    assert not np.any(by[:, 2:])
    assert set(np.unique(by[:, :2])) == set(range(-3, 4))
    corner = np.asarray(noisy.xywh)[..., :2]
    assert corner.min() >= 0
    assert (corner < [160, 210]).all()


def test_invented(objects):
    noisy = ocjax.perturb(KEY, objects, invent=0.5)
    new = np.asarray(noisy.valid & ~objects.valid)
    assert np.asarray(noisy.valid)[np.asarray(objects.valid)].all()
    assert 0.4 < new.sum() / (~np.asarray(objects.valid)).sum() < 0.6
    boxes = np.asarray(noisy.xywh)[new]
    assert boxes[:, 2:].min() == 2
    assert boxes[:, 2:].max() == 16
    assert ((boxes[:, :2] >= 0) & (boxes[:, :2] + boxes[:, 2:] <= [160, 210])).all()
    assert np.asarray(noisy.rgb)[new].any(axis=-1).all()


def test_swapped(objects):
    """Objects keep their category, none is lost, and with few slots taking part most stay."""
    game, valid = objects.game, np.asarray(objects.valid)
    for swap, stay in ((1.0, (0, 0.3)), (0.2, (0.7, 1))):
        noisy = ocjax.perturb(KEY, objects, swap=swap)
        for s in game.slices.values():
            got, want = (
                np.concatenate([np.asarray(o.xywh), np.asarray(o.rgb)], axis=-1)[:, s]
                for o in (noisy, objects)
            )
            for a, b in zip(got, want, strict=True):
                assert sorted(map(tuple, a.tolist())) == sorted(map(tuple, b.tolist()))
        blocks = game.slices["Block"]
        same = (np.asarray(noisy.xywh) == np.asarray(objects.xywh)).all(axis=-1)[:, blocks][
            valid[:, blocks]
        ]
        assert stay[0] <= same.mean() <= stay[1]


def test_keys_and_batches(objects):
    options = {"jitter": 2, "drop": 0.1, "swap": 0.1, "invent": 0.1}
    noisy = ocjax.perturb(KEY, objects, **options)
    assert equal(ocjax.perturb(KEY, objects, **options), noisy)
    assert not equal(ocjax.perturb(jax.random.key(4), objects, **options), noisy)
    mapped = jax.vmap(lambda key, o: ocjax.perturb(key, o, **options))(
        jax.random.split(KEY, 60), objects
    )
    assert mapped.xywh.shape == objects.xywh.shape
    assert mapped.xywh.dtype == jnp.int16
    assert len(noisy[0].to_list()) == noisy.valid[0].sum()


def test_misuse(objects):
    with pytest.raises(ValueError, match=r"drop must be a probability, got 1\.5"):
        ocjax.perturb(KEY, objects, drop=1.5)
    with pytest.raises(TypeError, match=r"objects must be ocjax\.Objects, .* got key"):
        ocjax.perturb(objects, KEY)
    with pytest.raises(TypeError, match=r"jitter must be a whole number of pixels, got 1\.5"):
        ocjax.perturb(KEY, objects, jitter=1.5)
    with pytest.raises(TypeError, match=r"drop must be a number from 0 to 1, got '0\.1'"):
        ocjax.perturb(KEY, objects, drop="0.1")
    with pytest.raises(ValueError, match="jitter must be a number of pixels"):
        ocjax.perturb(KEY, objects, jitter=-1)
    with pytest.raises(ValueError, match="no reference to their game"):
        ocjax.perturb(KEY, dataclasses.replace(objects, game=None))


@pytest.mark.slow
def test_environments_observe_perturbed_objects():
    runs = []
    for seed in (0, 0, 1):
        envs = ocjax.make_vec(
            "Pong", 3, num_workers=0, autoreset_mode="SameStep", max_episode_frames=40
        )
        noisy = PerturbObjects(envs, jax.random.key(seed), jitter=2, drop=0.3)
        noisy.reset(seed=0)
        shown, existing, moves, ends = [], 0, [], 0
        for _ in range(25):
            observation, _, _, _, info = noisy.step(np.zeros(3, int))
            assert noisy.observation_space.contains(observation)
            truth = jax.tree.map(np.asarray, envs.objects)
            shown.append(observation["valid"] != 0)
            assert not (shown[-1] & ~truth.valid).any()
            existing += truth.valid.sum()
            moves.append(np.abs(observation["xywh"] - truth.xywh)[shown[-1]])
            for i in np.flatnonzero(info.get("_final_obs", [])):
                assert noisy.single_observation_space.contains(info["final_obs"][i])
                ends += 1
        assert ends
        assert np.concatenate(moves).max() == 2
        assert 0.6 < np.sum(shown) / existing < 0.8
        runs.append(np.stack(shown))
        noisy.close()
    assert np.array_equal(runs[0], runs[1])
    assert not np.array_equal(runs[0], runs[2])


def test_environments_that_cannot_be_perturbed():
    envs = ocjax.make_vec("Pong", 2, num_workers=0, obs="vector")
    with pytest.raises(ValueError, match="the observation must be 'objects'"):
        PerturbObjects(envs, KEY, drop=0.1)
    with pytest.raises(TypeError, match="env must be a vector environment of ocjax"):
        PerturbObjects(gymnasium.make("ocjax/Pong-v5"), KEY)
    envs.close()
    envs = ocjax.make_vec("Pong", 2, num_workers=0)
    with pytest.raises(ValueError, match="drop must be a probability"):
        PerturbObjects(envs, KEY, drop=2)
    envs.close()
