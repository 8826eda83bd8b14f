"""JAX's transformations and the forms of input, on a synthetic game that uses every rule and on
three real ones."""

import functools
import os
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import ocjax
from ocjax.console import palette
from tests.support.checks import check, host, random_frames, same
from tests.support.states import ROOT, excerpt
from tests.support.synthetic import GAME as SYNTHETIC
from tests.support.synthetic import drawn

pytestmark = pytest.mark.usefixtures("quick_compilation")

REAL = [
    pytest.param(name, marks=pytest.mark.slow) for name in ("Pong", "MsPacman", "SpaceInvaders")
]
SAMPLES = 42  # a multiple of three


@functools.cache
def inputs(game):
    """RAM states and frames: half recorded ones where the game exists, the others random."""
    rng = np.random.default_rng(0)
    rams, frames = (
        rng.integers(0, 256, (SAMPLES, 128), dtype=np.uint8),
        random_frames(game, rng, SAMPLES),
    )
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
    assert same(
        whole,
        jax.tree.map(lambda a: a.reshape(SAMPLES, *a.shape[2:]), f(x.reshape(2, -1, *x.shape[1:]))),
    )
    assert whole[:0].valid.shape == f(x[:0]).valid.shape


def test_vmap(sample, method, whole):
    x = inputs(sample)[method]
    assert same(whole, jax.vmap(getattr(sample, method))(x))
    nested = jax.vmap(jax.vmap(getattr(sample, method)))(x.reshape(2, -1, *x.shape[1:]))
    assert same(whole, jax.tree.map(lambda a: a.reshape(SAMPLES, *a.shape[2:]), nested))


@pytest.mark.slow
def test_jit_and_scan(sample, method, whole):
    f, x = getattr(sample, method), jnp.asarray(inputs(sample)[method])
    assert same(whole, jax.jit(f)(x))
    assert same(whole[:6], jax.lax.scan(lambda carry, row: (carry, f(row)), None, x[:6])[1])


def aligned(x):
    """A copy at an address at which JAX reads an array in place, without copying it."""
    memory = np.empty(x.nbytes + 64, np.uint8)
    start = -memory.ctypes.data % 64
    copy = memory[start : start + x.nbytes].reshape(x.shape)
    copy[:] = x
    return copy


def test_input_is_not_kept(sample, method, whole):
    """A caller that overwrites its buffer gets the objects of the old contents, with any layout of
    the buffer."""
    f, x = getattr(sample, method), inputs(sample)[method]
    rows = np.arange(
        {"rem": 4096, "vem": 64}[method]
    )  # a program's full batch, which needs no copy and takes a while
    many = x[rows % SAMPLES]
    for buffer in (
        aligned(many),
        np.asfortranarray(many),
        np.repeat(many, 2, axis=0)[::2],
        many[::-1].copy()[::-1],
    ):
        objects = f(buffer)
        assert all(
            leaf.is_ready() for leaf in jax.tree.leaves(objects)
        )  # so that nothing reads the buffer any more
        buffer[:] = 255
        assert same(whole[rows % SAMPLES], objects)


def test_read_only_input(sample, method, whole):
    x = inputs(sample)[method].copy()
    x.flags.writeable = False
    assert same(whole, getattr(sample, method)(x))


@pytest.mark.slow
def test_closures_over_arrays(sample, method, whole):
    """An array that a compiled function closes over is a constant of it."""
    x = inputs(sample)[method].copy()
    f = jax.jit(lambda: getattr(sample, method)(x))
    objects = f()
    x[:] = 255
    assert same(whole, objects)
    assert same(whole, f())


def test_x64(sample, method, whole):
    with jax.enable_x64(True):
        assert same(whole, getattr(sample, method)(inputs(sample)[method]))


def test_debug_nans(sample, method, whole):
    with jax.debug_nans(True):
        assert same(whole, getattr(sample, method)(inputs(sample)[method]))


@pytest.mark.slow
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


@pytest.mark.parametrize("batch", [(2,), ()])
def test_rgb_with_channels_first_is_refused(sample, batch):
    frames = inputs(sample)["vem"][: len(batch) + 1].reshape(*batch, *sample.screen)
    rgb = palette.NTSC[frames]
    for wrong in (np.moveaxis(rgb, -1, -3), jnp.asarray(np.moveaxis(rgb, -1, -3))):
        with pytest.raises(ValueError, match=r"channels first.* numpy\.moveaxis\(frames, -3, -1\)"):
            sample.vem(wrong)


def test_three_frames_are_not_channels(sample):
    frames = inputs(sample)["vem"]
    groups = frames.reshape(-1, 3, *sample.screen)
    for batch in (groups, groups[0], np.zeros_like(groups)):
        rows = sample.vem(batch.reshape(-1, *sample.screen))
        assert same(
            rows,
            jax.tree.map(
                lambda a, n=batch.ndim - 2: a.reshape(-1, *a.shape[n:]), sample.vem(batch)
            ),
        )


def test_chunks(monkeypatch):
    """A batch of several chunks and a remainder gives the results of its rows."""
    from ocjax.extraction import rem, vem

    monkeypatch.setattr(rem, "CHUNK", 16)
    monkeypatch.setattr(vem, "CHUNK", 16)
    fresh = SYNTHETIC.without_hud()
    for method in ("rem", "vem"):
        x = inputs(SYNTHETIC)[method]
        objects = host(getattr(SYNTHETIC, method)(x))
        part = jax.tree.map(lambda a: a[:, : fresh.num_slots], objects)
        assert same(part, getattr(fresh, method)(x))


@pytest.mark.slow
def test_overflow_counts_what_has_no_slot():
    frame = np.zeros((1, 210, 160), np.uint8)
    for i in range(9):
        frame[0, 40:44, 10 + 16 * i : 14 + 16 * i] = 20
    objects, overflow = SYNTHETIC.vem_overflow(frame)
    assert objects.of("Walker").valid.sum() == 6
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
import sys
import jax, numpy as np
from jax.sharding import AxisType, NamedSharding, PartitionSpec
from ocjax.extraction import rem, vem
from tests.support.synthetic import GAME, drawn

rem.CHUNK, vem.CHUNK = 8, 2  # a device has two chunks
method = sys.argv[1]
spec = PartitionSpec("batch")
rng = np.random.default_rng(0)
rams = rng.integers(0, 256, (64, 128), dtype=np.uint8)
frames = np.stack([np.roll(drawn(), 3 * i, axis=1) for i in range(16)])
f, x = {"rem": (GAME.rem, rams), "vem": (GAME.vem, frames)}[method]
want = jax.tree.leaves(f(x))


def check(got):
    leaves = jax.tree.leaves(got)
    assert all(np.array_equal(a, b) for a, b in zip(want, leaves, strict=True))
    assert all(leaf.sharding.is_equivalent_to(along_batch, leaf.ndim) for leaf in leaves)


def check_compiled(g):
    compiled = jax.jit(g).lower(split).compile()
    check(compiled(split))
    words = ("all-gather", "all-reduce", "all-to-all", "collective-permute")
    found = [word for word in words if word in compiled.as_text()]
    assert not found, found


# `make_mesh` by default makes explicit axes.
for kind, types in (("Auto", {"axis_types": (AxisType.Auto,)}), ("default", {})):
    mesh = jax.make_mesh((4,), ("batch",), **types)
    along_batch = NamedSharding(mesh, spec)
    split = jax.device_put(x, along_batch)
    check(f(split))
    check_compiled(f)
    if method == "rem":  # VEM's compilation takes long, and the rest is the same for both
        check(jax.vmap(f)(split))
        check_compiled(jax.vmap(f))
        for check_vma in (False, True):
            specs = {"in_specs": spec, "out_specs": spec}
            check_compiled(jax.shard_map(f, mesh=mesh, **specs, check_vma=check_vma))
        with jax.set_mesh(mesh):
            check(f(split))
            check_compiled(f)
    elif kind == "Auto":
        check_compiled(jax.shard_map(f, mesh=mesh, in_specs=spec, out_specs=spec))
"""


def in_a_process(code, *args, **variables):
    variables = (
        os.environ | {"PYTHONPATH": str(ROOT), "JAX_DISABLE_MOST_OPTIMIZATIONS": "1"} | variables
    )
    run = subprocess.run(
        [sys.executable, "-c", code, *args],
        env=variables,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr[-2000:]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rem", "vem"])
def test_sharding(name):
    """Results follow the sharding of the input along the batch without communication, with
    automatic and with explicit mesh axes."""
    in_a_process(SHARDED, name, XLA_FLAGS="--xla_force_host_platform_device_count=4")


MESHES = """
import jax, numpy as np
from jax.sharding import AxisType, NamedSharding, PartitionSpec
from tests.support.synthetic import GAME

rams = np.random.default_rng(0).integers(0, 256, (8, 8, 128), dtype=np.uint8)
want = jax.tree.leaves(GAME.rem(rams))
explicit, auto = AxisType.Explicit, AxisType.Auto
for types in ((explicit, explicit), (explicit, auto), (auto, auto)):
    mesh = jax.make_mesh((2, 2), ("a", "b"), axis_types=types)
    for spec in (("a", "b"), (None, "b"), (("a", "b"),), ("b",), (), (None, "b", "a")):
        split = jax.device_put(rams, NamedSharding(mesh, PartitionSpec(*spec)))
        along_batch = NamedSharding(mesh, PartitionSpec(*spec[:2]))
        for leaf, expected in zip(jax.tree.leaves(GAME.rem(split)), want, strict=True):
            assert np.array_equal(leaf, expected)
            equivalent = leaf.sharding.is_equivalent_to(along_batch, leaf.ndim)
            assert equivalent, (types, spec, leaf.sharding)
"""


@pytest.mark.slow
def test_sharding_over_two_mesh_axes():
    """Any axes of the batch may be divided; arrays divided within a state are gathered."""
    in_a_process(MESHES, XLA_FLAGS="--xla_force_host_platform_device_count=4")


X64 = """
import sys
import jax, numpy as np
if sys.argv[1] == "before":
    jax.config.update("jax_enable_x64", True)
from tests.support.synthetic import GAME

rams = np.random.default_rng(0).integers(0, 256, (4, 128), dtype=np.uint8)
if sys.argv[1] == "after":
    jax.config.update("jax_enable_x64", True)
for objects in (GAME.rem(rams), jax.jit(GAME.rem)(rams), jax.vmap(GAME.rem)(rams)):
    want = {"xywh": "int16", "valid": "bool", "orientation": "int8", "value": "int32"}
    want["rgb"] = "uint8"
    got = {name: str(getattr(objects, name).dtype) for name in want}
    assert got == want, got
    assert objects.center.dtype == np.float32
assert jax.numpy.arange(3).dtype == np.int64  # what the caller asked for stays
"""


@pytest.mark.slow
@pytest.mark.parametrize("when", ["before", "after"])
def test_x64_for_the_whole_process(when):
    in_a_process(X64, when)
