"""JAX's transformations and the forms of input, on a synthetic game that uses every rule and on three real ones."""

import functools
import os
import subprocess
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from conftest import excerpt
from synthetic import GAME as SYNTHETIC
from synthetic import drawn
from test_contract import check, host, random_frames, same

import ocjax
from ocjax.vision import palette

REAL = ("Pong", "MsPacman", "SpaceInvaders")
SAMPLES = 40


@functools.cache
def inputs(game):
    """RAM states and frames: half recorded ones where the game exists, the others random."""
    rng = np.random.default_rng(0)
    rams, frames = rng.integers(0, 256, (SAMPLES, 128), dtype=np.uint8), random_frames(game, rng, SAMPLES)
    if game is not SYNTHETIC:
        data = excerpt(game.name)
        rams[::2], frames[::2] = data["rams"][: SAMPLES // 2], data["screens"][: SAMPLES // 2]
    else:
        frames[0] = drawn()
    return {"rem": rams, "vem": frames}


@pytest.fixture(params=("Synthetic", *REAL), scope="module")
def sample(request):
    game = SYNTHETIC if request.param == "Synthetic" else ocjax.load(request.param)
    yield game
    jax.clear_caches()


@pytest.fixture(params=("rem", "vem"), scope="module")
def method(request):
    return request.param


@pytest.fixture(scope="module")
def whole(sample, method):
    """The objects of all samples."""
    return getattr(sample, method)(inputs(sample)[method])


def test_synthetic_game_uses_every_rule(sample, method, whole):
    check(sample, whole, (SAMPLES,))
    valid = np.asarray(whole.valid)
    used = {c.name for c in sample.categories if valid[:, sample.slices[c.name]].any()}
    assert sample is not SYNTHETIC or used == set(sample.slices)


def test_rows(sample, method, whole):
    f, x = getattr(sample, method), inputs(sample)[method]
    assert same(whole, f(x[::-1].copy())[::-1])
    assert same(whole[4], f(x[4]))


def test_batch_shapes(sample, method, whole):
    f, x = getattr(sample, method), inputs(sample)[method]
    assert same(whole, jax.tree.map(lambda a: a.reshape(SAMPLES, *a.shape[2:]), f(x.reshape(2, -1, *x.shape[1:]))))
    assert whole[:0].valid.shape == f(x[:0]).valid.shape


def test_vmap(sample, method, whole):
    x = inputs(sample)[method]
    assert same(whole, jax.vmap(getattr(sample, method))(x))
    nested = jax.vmap(jax.vmap(getattr(sample, method)))(x.reshape(2, -1, *x.shape[1:]))
    assert same(whole, jax.tree.map(lambda a: a.reshape(SAMPLES, *a.shape[2:]), nested))


def test_jit_and_scan(sample, method, whole):
    f, x = getattr(sample, method), jnp.asarray(inputs(sample)[method])
    assert same(whole, jax.jit(f)(x))
    assert same(whole[:6], jax.lax.scan(lambda carry, row: (carry, f(row)), None, x[:6])[1])


def test_input_is_not_kept(sample, method, whole):
    x = inputs(sample)[method].copy()
    objects = getattr(sample, method)(x)
    x[:] = 255
    assert same(whole, objects)


def test_x64(sample, method, whole):
    with jax.enable_x64(True):
        assert same(whole, getattr(sample, method)(inputs(sample)[method]))


def test_debug_nans(sample, method, whole):
    with jax.debug_nans(True):
        assert same(whole, getattr(sample, method)(inputs(sample)[method]))


def test_no_jit():
    ram = inputs(SYNTHETIC)["rem"][7]
    with jax.disable_jit():
        plain = SYNTHETIC.rem(ram)
    assert same(plain, SYNTHETIC.rem(ram))


def test_rgb_is_index(sample):
    frames = inputs(sample)["vem"]
    rgb = palette.NTSC[frames]
    palette.check_rgb(rgb)
    assert same(sample.vem(rgb), sample.vem(frames))


def test_chunks(monkeypatch):
    """A batch of several chunks and a remainder is its rows."""
    from ocjax import rem, vem

    monkeypatch.setattr(rem, "CHUNK", 16)
    monkeypatch.setattr(vem, "CHUNK", 16)
    fresh = SYNTHETIC.without_hud()
    for method in ("rem", "vem"):
        x = inputs(SYNTHETIC)[method]
        objects = host(getattr(SYNTHETIC, method)(x))
        part = jax.tree.map(lambda a: a[:, : fresh.num_slots], objects)
        assert same(part, getattr(fresh, method)(x))


def test_overflow_counts_what_has_no_slot():
    frame = np.zeros((1, 210, 160), np.uint8)
    for i in range(9):
        frame[0, 40:44, 10 + 16 * i : 14 + 16 * i] = 20
    objects, overflow = SYNTHETIC.vem_overflow(frame)
    assert objects.of(SYNTHETIC, "Walker").valid.sum() == 6
    assert overflow[0, list(SYNTHETIC.slices).index("Walker")] == 3


def test_wrong_input(sample):
    height, width = sample.screen
    for wrong, error in (
        (np.zeros((2, 128), np.int32), TypeError),
        (np.zeros((2, 128), float), TypeError),
        (np.zeros((2, 127), np.uint8), ValueError),
        ([0] * 128, TypeError),
    ):
        with pytest.raises(error, match=f"{sample.name}: ram must"):
            sample.rem(wrong)
    for wrong, error in (
        (np.zeros((height, width), np.int32), TypeError),
        (np.zeros((height - 1, width), np.uint8), ValueError),
        (np.zeros((height, width, 4), np.uint8), ValueError),
        (np.zeros((84, 84), np.uint8), ValueError),
    ):
        with pytest.raises(error, match=f"{sample.name}: frames must"):
            sample.vem(wrong)


SHARDED = """
import jax, numpy as np
from jax.sharding import AxisType, NamedSharding, PartitionSpec
from synthetic import GAME

mesh = jax.make_mesh((4,), ("batch",), axis_types=(AxisType.Auto,))
spec = PartitionSpec("batch")
rng = np.random.default_rng(0)
rams = rng.integers(0, 256, (64, 128), dtype=np.uint8)
frames = rng.choice(np.array([0, 20, 40, 60, 80, 100], np.uint8), (64, 210, 160))
for f, x in ((GAME.rem, rams), (GAME.vem, frames)):
    want = jax.tree.leaves(f(x))
    split = jax.device_put(x, NamedSharding(mesh, spec))
    local = jax.shard_map(f, mesh=mesh, in_specs=spec, out_specs=spec)
    for got in (f(split), local(split)):
        leaves = jax.tree.leaves(got)
        assert all(np.array_equal(a, b) for a, b in zip(want, leaves, strict=True))
        assert all(leaf.sharding.is_equivalent_to(NamedSharding(mesh, spec), leaf.ndim) for leaf in leaves)
    # VEM searches until no frame has a candidate left: without shard_map, devices have to agree on that.
    for g in (GAME.rem, local) if f == GAME.rem else (local,):
        text = jax.jit(g).lower(split).compile().as_text()
        assert not [word for word in ("all-gather", "all-reduce", "all-to-all", "collective-permute") if word in text]
"""


def test_sharding():
    """Results follow the sharding of the input; REM, and VEM inside `shard_map`, need no communication."""
    flags = {"XLA_FLAGS": "--xla_force_host_platform_device_count=4", "PYTHONPATH": str(Path(__file__).parent)}

    run = subprocess.run([sys.executable, "-c", SHARDED], env=os.environ | flags, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr[-2000:]
