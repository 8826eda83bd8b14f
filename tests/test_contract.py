"""Contract tests for every game. What concerns the framework alone is in test_framework.py."""

import jax
import numpy as np

import ocjax
from ocjax._xla import kernels

FIELDS = {"xywh": (np.int16, (4,)), "valid": (np.bool_, ()), "orientation": (np.int8, ()), "value": (np.int32, ()), "rgb": (np.uint8, (3,))}


def host(objects):
    return jax.tree.map(np.asarray, objects)


def same(a, b):
    return all(np.array_equal(p, q) for p, q in zip(jax.tree.leaves(host(a)), jax.tree.leaves(host(b)), strict=True))


def unoptimized_jit(f):
    """`jax.jit` without optimization of the machine code, which takes a third of the time to compile and computes the same."""
    return jax.jit(f, compiler_options=(kernels.compiler_options() or {}) | {"xla_backend_optimization_level": 0})


def check(game, objects, batch):
    """Well-formed: dtypes and shapes, boxes on the screen, invalid slots zero, only declared attributes."""
    o = host(objects)
    height, width = game.screen
    for name, (dtype, tail) in FIELDS.items():
        assert getattr(o, name).dtype == dtype
        assert getattr(o, name).shape == (*batch, game.num_slots, *tail)
        assert not getattr(o, name)[~o.valid].any(), f"{name} of invalid slots"
    x, y, w, h = np.moveaxis(o.xywh.astype(int)[o.valid], -1, 0)
    assert ((x >= 0) & (y >= 0) & (w > 0) & (h > 0) & (x + w <= width) & (y + h <= height)).all()
    assert ((o.orientation >= -1) & (o.orientation < 16)).all()
    for c in game.categories:
        for attribute in {"value", "orientation"} - set(c.attributes):
            assert not getattr(o, attribute)[..., game.slices[c.name]].any()


def random_frames(game, rng, n):
    """Noise of all colours, of the game's own, and blocks of them (large, touching objects).

    A third is noise, which takes a hundred times as long as a frame of a game, because it has thousands of components.
    """
    height, width = game.screen
    own = np.array(sorted({c for category in game.categories for c in category.rule.palette}), np.uint8)
    kinds = rng.choice(3, size=n, p=(1 / 6, 1 / 6, 2 / 3))
    frames = np.empty((n, height, width), np.uint8)
    for i, kind in enumerate(kinds):
        if kind == 0:
            frames[i] = rng.integers(0, 128, (height, width)) * 2
        else:
            size = 1 if kind == 1 else int(rng.integers(2, 40))
            coarse = rng.choice(np.append(own, [0] * (2 * len(own))), (height // size + 1, width // size + 1))
            frames[i] = coarse.repeat(size, 0).repeat(size, 1)[:height, :width]
    return frames


def test_declaration(game):
    assert ocjax.load(game.name) is game
    assert game.num_slots == len(game.slot_category) == len(game.slot_hud)
    assert all(c.doc for c in game.categories), "every category has a line for people"


def test_truth_is_well_formed(game, truth):
    rem = game.rem(truth["rams"])
    check(game, rem, (len(truth["rams"]),))
    assert (host(rem).orientation >= 0).all()
    check(game, game.vem(truth["screens"]), (len(truth["screens"]),))


def test_random_ram(game, truth, fuzz):
    rng, n = np.random.default_rng(0), len(truth["rams"])  # a batch size that is compiled already
    for _ in range(0, fuzz, n):
        check(game, game.rem(rng.integers(0, 256, (n, 128), dtype=np.uint8)), (n,))


def test_random_frames(game, truth, fuzz):
    rng, n = np.random.default_rng(0), len(truth["screens"])
    for _ in range(0, fuzz, n):
        check(game, game.vem(random_frames(game, rng, n)), (n,))


def test_without_hud_is_a_prefix(game, truth):
    bare = ocjax.load(game.name, hud=False)
    assert not bare.slot_hud.any()
    for method, key in (("rem", "rams"), ("vem", "screens")):
        whole, part = host(getattr(game, method)(truth[key])), host(unoptimized_jit(getattr(bare, method))(truth[key]))
        assert same(jax.tree.map(lambda a: a[:, : bare.num_slots], whole), part)


def test_decode_is_pure(game):
    """No effects, callbacks or random numbers hide in a decoder."""
    jaxpr = jax.make_jaxpr(game.rem)(np.zeros(128, np.uint8))
    assert not jaxpr.effects
    text = str(jaxpr)
    assert not [word for word in ("callback", "random_bits", "float64", "io_") if word in text]


def test_tests_are_grouped(request):
    """pytest-xdist names a test's group in its ID; ungrouped, every process would compile every game."""
    assert ("@" in request.node.nodeid) == getattr(request.config.option, "loadgroup", False)
