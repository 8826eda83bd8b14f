"""Merging and tracking agree with plain Python that handles one state and one pair at a time."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ocjax
from ocjax.console.boxes import box
from ocjax.console.ram import RamMap, byte
from ocjax.console.rom import Rom
from ocjax.extraction.categories import Category
from ocjax.extraction.game import Game
from ocjax.extraction.objects import Objects
from ocjax.vision.rules import Blobs, Bounds, Cells
from tests.support.states import excerpt

pytestmark = pytest.mark.usefixtures("quick_compilation")

FIELDS = ["xywh", "valid", "orientation", "value", "rgb"]


class Ram(RamMap):
    x = byte(1)


COUNTS = {"One": 1, "Few": 3, "Cell": 4, "Many": 9, "Place": 2}
RULES = (
    Blobs(14),
    Blobs(20),
    Cells(22, (0, 9, 18, 27), (0, 0, 0, 0), 4, 4),
    Blobs(24),
    Bounds(26, ((0, 0, 9, 9), (9, 0, 18, 9))),
)
GAME = Game(
    name="Test",
    rom=Rom("pong", "0" * 32),
    ram=Ram,
    decode=lambda m: {
        name: box(m.x + jnp.zeros(n, jnp.int32), 10, 4, 4) for name, n in COUNTS.items()
    },
    categories=tuple(
        Category(name, rule, count=n) for (name, n), rule in zip(COUNTS.items(), RULES, strict=True)
    ),
)
MOVABLE = ("One", "Few", "Many")
SMALL = GAME.replaced(
    decode=lambda m: {
        name: box(m.x + jnp.zeros(COUNTS[name], jnp.int32), 10, 4, 4) for name in ("Few", "Cell")
    },
    categories=tuple(c for c in GAME.categories if c.name in ("Few", "Cell")),
)


def some(rng, batch, game=GAME, density=0.6, span=30):
    """Random objects that differ from each other."""
    shape = (*batch, game.num_slots)
    valid = rng.random(shape) < density
    xywh = rng.integers([0, 0, 1, 1], [span, span, 9, 9], (*shape, 4))
    fields = {
        "xywh": xywh,
        "orientation": rng.integers(0, 16, shape),
        "value": rng.integers(1, 2**31, shape),
    }
    fields["rgb"] = rng.integers(0, 256, (*shape, 3))
    dtypes = {"xywh": np.int16, "orientation": np.int8, "value": np.int32, "rgb": np.uint8}
    whole = {
        k: (v * valid.reshape(*shape, *[1] * (v.ndim - len(shape)))).astype(dtypes[k])
        for k, v in fields.items()
    }
    return Objects(valid=valid, **whole, game=game)


def host(objects):
    return jax.tree.map(np.asarray, objects)


def same(a, b):
    return all(
        p.dtype == q.dtype and np.array_equal(p, q)
        for p, q in zip(jax.tree.leaves(host(a)), jax.tree.leaves(host(b)), strict=True)
    )


def well_formed(game, objects, batch):
    o = host(objects)
    for name, dtype, tail in zip(
        FIELDS,
        (np.int16, np.bool_, np.int8, np.int32, np.uint8),
        ((4,), (), (), (), (3,)),
        strict=True,
    ):
        field = getattr(o, name)
        assert field.dtype == dtype
        assert field.shape == (*batch, game.num_slots, *tail)
        assert not field[~o.valid].any()


def record(objects, slot):
    return tuple(getattr(objects, name)[slot].tobytes() for name in FIELDS)


def records(objects):
    return sorted(record(objects, slot) for slot in np.flatnonzero(objects.valid))


def greedy(a, b, radius):
    """Match one category's slots of one state, nearest first; ties go by the slot of `a`, then of
    `b`."""
    (ax, ay, aw, ah), (bx, by, bw, bh) = a.xywh.T.astype(int), b.xywh.T.astype(int)
    pairs = []
    for i in np.flatnonzero(a.valid):
        for j in np.flatnonzero(b.valid):
            d = (2 * ax[i] + aw[i] - 2 * bx[j] - bw[j]) ** 2 + (
                2 * ay[i] + ah[i] - 2 * by[j] - bh[j]
            ) ** 2
            if d <= (2 * radius) ** 2:
                pairs.append((d, i, j))
    found = {}
    for _, i, j in sorted(pairs):
        if i not in found and j not in found.values():
            found[i] = j
    return found


def empty(like):
    return jax.tree.map(np.zeros_like, like)


def put(into, slot, objects, source):
    for name in FIELDS:
        getattr(into, name)[slot] = getattr(objects, name)[source]


def merged(game, earlier, later, radius):
    """`merge_frames` on one state, in plain Python."""
    out = jax.tree.map(np.copy, later)
    for c in game.categories:
        s = game.slices[c.name]
        a, b, here = (jax.tree.map(lambda f, s=s: f[s], o) for o in (earlier, later, out))
        if isinstance(c.rule, Blobs):
            pairs = greedy(a, b, radius)
            added = [i for i in np.flatnonzero(a.valid) if i not in pairs]
            moves = zip(added, np.flatnonzero(~b.valid), strict=False)
        else:
            moves = [(i, i) for i in np.flatnonzero(a.valid & ~b.valid)]
        for i, slot in moves:
            put(here, slot, a, i)
    return out


def tracked(game, previous, current, radius, first=False):
    """`track` on one state, in plain Python."""
    if first:
        return current
    out = jax.tree.map(np.copy, current)
    for c in game.categories:
        if not isinstance(c.rule, Blobs):
            continue
        s = game.slices[c.name]
        a, b, here = (jax.tree.map(lambda f, s=s: f[s], o) for o in (previous, current, out))
        pairs = greedy(a, b, radius)
        here.valid[:] = False
        for name in FIELDS:
            getattr(here, name)[:] = 0
        for i, j in pairs.items():
            put(here, i, b, j)
        free = [*np.flatnonzero(~a.valid), *(i for i in np.flatnonzero(a.valid) if i not in pairs)]
        new = [j for j in np.flatnonzero(b.valid) if j not in pairs.values()]
        for j, slot in zip(new, free, strict=False):
            put(here, slot, b, j)
    return out


def rows(f, *batches):
    """Apply a function of single states to every row of batches."""
    results = [
        f(*(jax.tree.map(lambda a, i=i: a[i], b) for b in batches))
        for i in range(len(batches[0].valid))
    ]
    return jax.tree.map(lambda *a: np.stack(a), *results)


@settings(max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    density=st.sampled_from([0.1, 0.6, 0.95, 1.0]),
    span=st.sampled_from([1, 4, 12, 30, 150]),
    radius=st.sampled_from([0, 2.5, 5, 16, float("inf")]),
)
def test_reference(seed, density, span, radius):
    """The number of positions ranges from few, with many ties, to many."""
    rng = np.random.default_rng(seed)
    a, b = (
        some(rng, (12,), density=density, span=span),
        some(rng, (12,), density=density, span=span),
    )
    first = rng.random(12) < 0.2
    merge, track = ocjax.merge_frames(a, b, radius), ocjax.track(a, b, radius, first)
    assert same(merge, rows(lambda p, q: merged(GAME, p, q, radius), a, b))
    plain = [
        tracked(GAME, *(jax.tree.map(lambda v, i=i: v[i], o) for o in (a, b)), radius, first[i])
        for i in range(12)
    ]
    assert same(track, jax.tree.map(lambda *v: np.stack(v), *plain))
    well_formed(GAME, merge, (12,))
    well_formed(GAME, track, (12,))
    assert all(records(host(track)[i]) == records(b[i]) for i in range(12)), (
        "no object is added or lost"
    )
    for name in MOVABLE:
        s = GAME.slices[name]
        now, before, after = (o.valid[:, s].sum(1) for o in (b, a, host(merge)))
        pairs = np.array(
            [
                len(greedy(*(jax.tree.map(lambda v, i=i, s=s: v[i, s], o) for o in (a, b)), radius))
                for i in range(12)
            ]
        )
        assert (after == np.minimum(before + now - pairs, COUNTS[name])).all()


def test_large_category():
    """Chains of ties with the largest number of slots of any game; each round settles only one
    pair."""
    n = 200
    game = GAME.replaced(
        decode=lambda m: {"A": box(m.x + jnp.zeros(n, jnp.int32), 10, 4, 4)},
        categories=(Category("A", Blobs(14), count=n),),
    )
    rng = np.random.default_rng(0)
    a, b = some(rng, (3,), game, 0.9, 150), some(rng, (3,), game, 0.9, 150)
    slot = np.arange(n)
    for o, shift in ((a, 0), (b, 4)):  # half a spacing further
        o.valid[0] = slot < 40
        o.xywh[0] = np.where(
            o.valid[0, :, None],
            np.stack([slot % 18 * 8 + shift, slot // 18 * 20, slot * 0 + 4, slot * 0 + 4], -1),
            0,
        )
        for name in ("orientation", "value", "rgb"):
            getattr(o, name)[0][40:] = 0
    assert same(ocjax.track(a, b), rows(lambda p, q: tracked(game, p, q, 16), a, b))
    assert same(ocjax.merge_frames(a, b), rows(lambda p, q: merged(game, p, q, 5), a, b))


FUNCTIONS = {
    "merge": lambda a, b, first: ocjax.merge_frames(a, b),
    "track": lambda a, b, first: ocjax.track(a, b, is_first=first),
}


@pytest.mark.slow
@pytest.mark.parametrize("f", FUNCTIONS.values(), ids=FUNCTIONS)
def test_batch_is_its_rows(f):
    """A batch gives the results of its single rows, also in other batch shapes, and under `vmap`,
    `jit`, `disable_jit` and `scan`."""
    rng = np.random.default_rng(1)
    a, b, first = jax.tree.map(
        jnp.asarray, (some(rng, (6,), SMALL), some(rng, (6,), SMALL), rng.random(6) < 0.5)
    )
    whole = f(a, b, first)

    def shaped(tree, *batch):
        return jax.tree.map(lambda v: v.reshape(*batch, *v.shape[1:]), tree)

    assert same(
        whole, jax.tree.map(lambda *v: jnp.stack(v), *(f(a[i], b[i], first[i]) for i in range(6)))
    )
    assert same(shaped(whole, 2, 3), f(*(shaped(t, 2, 3) for t in (a, b, first))))
    assert same(whole, jax.vmap(f)(a, b, first))
    assert same(
        shaped(whole, 2, 3), jax.vmap(jax.vmap(f))(*(shaped(t, 2, 3) for t in (a, b, first)))
    )
    assert same(whole, jax.jit(f)(a, b, first))
    assert same(whole, jax.lax.scan(lambda carry, row: (carry, f(*row)), None, (a, b, first))[1])
    assert f(a[:0], b[:0], first[:0]).valid.shape == (0, SMALL.num_slots)
    one_side = jax.vmap(f, in_axes=(None, 0, None))(a[0], b, first[0])
    assert same(one_side[2], f(a[0], b[2], first[0]))
    with jax.disable_jit():
        assert same(whole, f(a, b, first))


def test_scan_keeps_slots():
    """Moving objects with shuffled slots stay in their first slots."""
    rng = np.random.default_rng(2)
    n, steps = COUNTS["Many"], 20
    s = GAME.slices["Many"]
    frames = empty(some(rng, (steps,)))
    start, speed = (
        np.stack([np.arange(n) % 3 * 40 + 20, np.arange(n) // 3 * 50 + 20], -1),
        rng.integers(-1, 2, (n, 2)),
    )
    for t in range(steps):
        order = rng.permutation(n)
        frames.valid[t, s] = True
        frames.xywh[t, s] = np.concatenate([start + t * speed, np.full((n, 2), 4)], -1)[order]
        frames.value[t, s] = order + 1
    frames = jax.tree.map(jnp.asarray, frames)

    def step(before, now):
        now = ocjax.track(before, now)
        return now, (now, ocjax.velocity(before, now))

    first = frames[0]
    _, (whole, moved) = jax.jit(
        lambda: jax.lax.scan(step, first, jax.tree.map(lambda a: a[1:], frames))
    )()
    assert (host(whole).value[:, s] == np.asarray(first.value)[s]).all()
    assert (np.asarray(moved)[:, s] == speed[np.asarray(first.value)[s] - 1]).all()


def state(**boxes):
    """One state from top left corners by category, one entry per slot; an empty slot is None."""
    out = empty(some(np.random.default_rng(0), ()))
    for name, slots in boxes.items():
        for i, b in enumerate(slots):
            if b is not None:
                k = GAME.slices[name].start + i
                out.xywh[k], out.valid[k], out.value[k] = (*b, 4, 4), True, 100 * k + b[0]
    return out


def x_of(objects, name):
    o = host(objects)
    s = GAME.slices[name]
    return [int(x) if v else None for x, v in zip(o.xywh[s, 0], o.valid[s], strict=True)]


def test_merge_by_hand():
    earlier = state(
        Few=[(10, 10), (50, 10), (90, 10)],
        One=[(5, 5)],
        Cell=[(0, 0), (9, 0), None, None],
        Place=[(1, 1), (10, 1)],
    )
    later = state(
        Few=[None, (53, 10), None], Cell=[None, (10, 0), (18, 0), None], Place=[None, (12, 2)]
    )
    both = ocjax.merge_frames(earlier, later)
    assert x_of(both, "Few") == [10, 53, 90]
    assert x_of(both, "One") == [5]
    assert x_of(both, "Cell") == [0, 10, 18, None]
    assert x_of(both, "Place") == [1, 12]
    assert x_of(ocjax.merge_frames(earlier, later, radius=2), "Few") == [10, 53, 50], (
        "what does not fit is dropped"
    )
    assert x_of(ocjax.merge_frames(state(One=[(5, 5)]), state(One=[(80, 5)])), "One") == [80]


def test_track_by_hand():
    before = state(Few=[(10, 10), None, (50, 10)])
    assert x_of(ocjax.track(before, state(Few=[(52, 10), (12, 10), None])), "Few") == [12, None, 52]
    assert x_of(ocjax.track(before, state(Few=[(120, 10), (52, 10), None])), "Few") == [
        None,
        120,
        52,
    ], "slots that were empty before come first"
    assert x_of(ocjax.track(before, state(Few=[(120, 10), (130, 10), (52, 10)])), "Few") == [
        130,
        120,
        52,
    ], "then slots whose objects are gone"
    assert x_of(ocjax.track(before, state(Few=[(30, 10), None, None]), radius=100), "Few") == [
        30,
        None,
        None,
    ], "ties go by slot"
    shuffled = state(Few=[(52, 10), (12, 10), None])
    assert same(ocjax.track(before, shuffled, is_first=np.True_), shuffled)
    cells = state(Cell=[None, (9, 0), None, None], Place=[(5, 1), None])
    assert same(ocjax.track(state(Cell=[(9, 0)], Place=[None, (5, 1)]), cells), cells)


def test_wrong_input():
    rng = np.random.default_rng(0)
    a, b = some(rng, (2,)), some(rng, (3,))
    short = jax.tree.map(lambda v: v[:, :-1], a)
    for f, names in (
        (ocjax.merge_frames, ("earlier", "later")),
        (ocjax.track, ("previous", "current")),
    ):
        for left, right, name in (
            (short, short, names[0]),
            (a, short, names[1]),
            (a, b, names[1]),
            (a[0], a, names[1]),
        ):
            with pytest.raises(ValueError, match=f"Test: {name}.xywh must have shape"):
                f(left, right)
        with pytest.raises(ValueError, match=f"Test: {names[1]}.rgb must have shape"):
            f(a, dataclasses.replace(a, rgb=a.rgb[:1]))
        for radius in (-1, float("nan")):
            with pytest.raises(ValueError, match="radius must be"):
                f(a, a, radius)
    with pytest.raises(ValueError, match="is_first must have"):
        ocjax.track(a, a, is_first=True)
    with pytest.raises(TypeError, match="is_first must be bool"):
        ocjax.track(a, a, is_first=np.zeros(2, int))


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow) for name in ("Asteroids", "MsPacman")]
    + ["SpaceInvaders"],
)
def test_games(name):
    """Results on recorded frames are well-formed, equal plain Python's, and lose no object."""
    game, data = ocjax.load(name), excerpt(name)
    screens, previous = (
        jax.tree.map(lambda a: a[::8], host(game.vem(data[k]))) for k in ("screens", "previous")
    )
    n = len(screens.valid)
    both = ocjax.merge_frames(previous, screens)
    well_formed(game, both, (n,))
    assert same(both, rows(functools.partial(merged, game, radius=5), previous, screens))
    assert same(
        jax.tree.map(lambda a: a[screens.valid], host(both)),
        jax.tree.map(lambda a: a[screens.valid], screens),
    )
    assert same(
        ocjax.track(previous, screens),
        rows(functools.partial(tracked, game, radius=16), previous, screens),
    )
    assert same(ocjax.merge_frames(screens, screens), screens)
    assert same(ocjax.track(screens, screens), screens)


def test_flickering_ghosts():
    """Two merged frames never hold fewer ghosts than either of them, and in total a fifth more than
    the later one."""
    game, data = ocjax.load("MsPacman"), excerpt("MsPacman")
    previous, screens = game.vem(data["previous"]), game.vem(data["screens"])
    earlier, later, both = (
        host(o.of("Ghost")).valid.sum(1)
        for o in (previous, screens, ocjax.merge_frames(previous, screens))
    )
    assert (both >= np.maximum(earlier, later)).all()
    assert both.sum() > 1.2 * later.sum()
