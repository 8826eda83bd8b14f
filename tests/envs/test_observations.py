"""Observations and masks against their definitions."""

import contextlib
import dataclasses

import jax
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ocjax
from ocjax.envs import Dqn, Masks, Vector
from ocjax.envs.features import FEATURES
from ocjax.transforms import masks
from tests.support.states import excerpt

pytestmark = pytest.mark.usefixtures("quick_compilation")


@pytest.fixture(scope="module")
def pong():
    return ocjax.load("Pong")


@pytest.fixture(scope="module")
def gray():
    """Frames in various shades of grey."""
    return (excerpt("Pong")["screens"][:8].astype(int) * 37 % 256).astype(np.uint8)


@pytest.fixture(scope="module")
def objects(pong):
    return pong.rem(excerpt("Pong")["rams"][:8])


def area_average(image, size):
    """The mean over the area of each output pixel, with input pixels weighted by the overlap."""
    parts = []
    for n_in, n_out in zip(image.shape, size, strict=True):
        fine = np.repeat(np.arange(n_in), n_out).reshape(
            n_out, n_in
        )  # the input pixel of each of n_in * n_out steps
        parts.append(np.stack([np.bincount(row, minlength=n_in) / n_in for row in fine]))
    return parts[0] @ image @ parts[1].T


@pytest.mark.parametrize(
    ("shape", "size"),
    [
        ((210, 160), (84, 84)),
        ((250, 160), (84, 84)),
        ((210, 160), (105, 80)),
        ((214, 160), (42, 64)),
    ],
)
def test_resize_averages_over_areas(shape, size):
    images = np.random.default_rng(0).integers(256, size=(3, *shape)).astype(np.uint8)
    got = np.asarray(jax.jit(lambda x: masks.resize(x, size))(images))
    want = np.stack([area_average(i.astype(float), size) for i in images])
    assert got.shape == want.shape
    assert np.array_equal(got, np.round(np.round(want, 6))), (
        "rounded to the nearest, halves to even"
    )
    assert np.array_equal(masks.resize(images, shape), images)


def drawn(game, objects, size):
    """Boxes rounded outwards and painted in a loop, bool [categories, *size]."""
    out = np.zeros((len(game.categories), *size), bool)
    for o in objects.to_list():
        (y0, y1), (x0, x1) = (
            (start * n // screen, -(-(start + length) * n // screen))
            for start, length, n, screen in zip(
                (o["y"], o["x"]), (o["h"], o["w"]), size, game.screen, strict=True
            )
        )
        out[[c.name for c in game.categories].index(o["category"]), y0:y1, x0:x1] = True
    return out


@pytest.mark.parametrize(
    "size",
    [
        pytest.param((84, 84), marks=pytest.mark.slow),
        pytest.param(None, marks=pytest.mark.slow),
        (30, 40),
    ],
)
@pytest.mark.parametrize("kind", masks.KINDS)
def test_masks(pong, objects, gray, kind, size):
    got = np.asarray(masks.masks(objects, kind, gray=gray, size=size, pixels=True))
    shown = np.asarray(masks.resize(gray, size or pong.screen))
    assert got.shape == (8, masks.num_planes(pong, kind, pixels=True), *shown.shape[1:])
    assert np.array_equal(got[:, -1], shown)
    for i in range(8):
        planes = drawn(pong, objects[i], shown.shape[1:])
        where = planes.any(axis=0)
        if kind == "planes":
            want = planes * 255
        elif kind == "object":
            want = np.where(where, shown[i], 0)[None]
        elif kind == "binary":
            want = where[None] * 255
        else:
            shades = np.array([255 * (c + 1) // len(planes) for c in range(len(planes))])
            want = (planes * shades[:, None, None]).max(axis=0)[None]
        assert np.array_equal(got[i, :-1], want)


def test_masks_drawn_at_screen_size(pong, objects, gray):
    """Masks painted at 210 x 160 are averaged by area: a box over half a pixel makes it half as
    bright."""
    got = np.asarray(masks.masks(objects, "planes", draw="screen"))
    for i in range(8):
        want = np.stack(
            [area_average(p * 255.0, (84, 84)) for p in drawn(pong, objects[i], pong.screen)]
        )
        assert np.abs(got[i] - want).max() < 0.501
    full = masks.masks(objects, "object", gray=gray, size=None, draw="screen")
    assert np.array_equal(full, masks.masks(objects, "object", gray=gray, size=None))


def test_masks_of_own_pixels():
    game, play = ocjax.load("MsPacman"), excerpt("MsPacman")
    objects, frames = game.rem(play["rams"][:4]), play["screens"][:4]
    gray, owners = frames.copy(), np.asarray(ocjax.segment(objects, frames))
    own = {"gray": gray, "frames": frames, "draw": "pixels", "size": None}
    planes = np.asarray(masks.masks(objects, "planes", **own))
    for plane, slots in zip(planes.swapaxes(0, 1), game.slices.values(), strict=True):
        wanted = np.isin(owners, np.arange(slots.start, slots.stop))
        assert np.array_equal(plane > 0, wanted)
    seen = np.asarray(masks.masks(objects, "object", **own))[:, 0]
    assert np.array_equal(seen, np.where(owners >= 0, gray, 0))
    small = masks.masks(objects, "planes", **own | {"size": (84, 84)})
    assert np.array_equal(small, masks.resize(jax.numpy.asarray(planes), (84, 84)))
    with pytest.raises(ValueError, match="give frames"):
        masks.masks(objects, "binary", draw="pixels")


@pytest.mark.parametrize("mode", ["rem", "vem"])
def test_masks_of_own_pixels_in_environments(mode):
    kinds = {"pixels": Masks("class", size=None, draw="pixels", stack=1), "rgb": "pixels"}
    envs = ocjax.make_vec("MsPacman", num_envs=2, mode=mode, obs=kinds, num_workers=0)
    observed, _ = envs.reset(seed=0)
    for _ in range(3):
        observed, *_ = envs.step(np.zeros(2, int))
    wanted = masks.masks(envs.objects, "class", frames=observed["rgb"], size=None, draw="pixels")
    assert np.array_equal(observed["pixels"], wanted)
    assert observed["pixels"].any()
    envs.close()


def test_empty_masks_and_wrong_options(pong, objects, gray):
    empty = jax.tree.map(np.zeros_like, objects)
    assert not np.asarray(masks.masks(empty, "object", gray=gray)).any()
    with pytest.raises(ValueError, match="kind must be one of"):
        masks.masks(objects, "pixel")
    with pytest.raises(ValueError, match="give gray"):
        masks.masks(objects, "object")
    with pytest.raises(ValueError, match="have no reference to their game"):
        masks.masks(dataclasses.replace(objects, game=None), "binary")
    with pytest.raises(ValueError, match="stack at least 1"):
        Masks("binary", stack=0)


@given(st.integers(1, 250), st.integers(1, 90))
def test_area_weights_are_a_partition(n_in, n_out):
    weights, common = masks.area_weights(n_in, n_out), np.gcd(n_in, n_out)
    assert weights.shape == (n_out // common, n_in // common)
    assert weights.min() >= 0
    assert (weights.sum(axis=1) == n_in // common).all()
    assert (weights.sum(axis=0) == n_out // common).all()


def test_vectors_match_their_feature_names():
    """The test compares every number with the objects by its name, in pixels and normalised, with
    two states."""
    kinds = {
        "plain": Vector(FEATURES, history=2, normalize=False),
        "unit": Vector(FEATURES, history=2),
    }
    envs = ocjax.make_vec("Pong", 3, obs=kinds, num_workers=1, max_episode_frames=200)
    game, rng, before = envs.game, np.random.default_rng(0), None
    observed, _ = envs.reset(seed=0)
    assert (
        len(envs.features["plain"])
        == 2 * game.num_slots * len(FEATURES)
        == observed["plain"].shape[1]
    )
    units = {
        "x": 160,
        "w": 160,
        "dx": 160,
        "y": 210,
        "h": 210,
        "dy": 210,
        "orientation": 16,
        "valid": 1,
    }
    states = []
    for t in range(130):
        objects, started = jax.tree.map(np.asarray, envs.objects), envs.pool.started.copy()
        rows = {
            name: np.asarray(getattr(objects, name), float)
            for name in ("x", "y", "w", "h", "orientation", "value", "valid")
        }
        moved = np.zeros((3, game.num_slots, 2))
        if before is not None:
            both = objects.valid & before.valid & ~started[:, None]
            moved = np.where(
                both[..., None], np.asarray(objects.center) - np.asarray(before.center), 0
            )
        centers, both = np.asarray(objects.center), objects.valid & objects.valid[:, :1]
        near, middle = (
            np.where(both[..., None], np.tanh((centers - centers[:, :1]) / scale), 0)
            for scale in (8, 32)
        )
        rows |= {
            n + axis: v[..., i]
            for n, v in {"d": moved, "n": near, "m": middle}.items()
            for i, axis in enumerate("xy")
        }
        earlier = states[-1] if states else rows
        states = [{f: np.where(started[:, None], rows[f], earlier[f]) for f in FEATURES}, rows]
        for k, (ago, category, i, feature) in enumerate(envs.features["plain"]):
            want = states[1 - ago][feature][:, game.slices[category].start + i]
            assert np.allclose(observed["plain"][:, k], want, atol=1e-6), (
                t,
                ago,
                category,
                feature,
            )
            if feature == "value":
                want = np.sign(want) * np.log1p(np.abs(want)) / np.log1p(1e6)
            assert np.allclose(observed["unit"][:, k], want / units.get(feature, 1), atol=1e-6)
        before = objects
        observed, *_ = envs.step(rng.integers(6, size=3))
    envs.close()


@pytest.mark.parametrize("kind", [Vector(), Vector(FEATURES), Vector(FEATURES, normalize=False)])
def test_vectors_of_recorded_objects_are_those_of_environments(kind):
    envs = ocjax.make_vec("Pong", 3, obs=kind, num_workers=0, max_episode_frames=120)
    rng, (first, _) = np.random.default_rng(0), envs.reset(seed=0)
    observed, rams, started = [first], [envs.get_ram()], [np.ones(3, bool)]
    for _ in range(70):
        observation, *_ = envs.step(rng.integers(6, size=3))
        observed.append(observation)
        rams.append(envs.get_ram())
        started.append(envs.pool.started.copy())
    envs.close()
    resets, objects = np.stack(started), envs.game.rem(np.stack(rams))
    assert resets[1:].any()
    found = kind.of(objects[1:], objects[:-1], is_first=resets[1:])
    assert np.array_equal(found, np.stack(observed)[1:])
    assert np.array_equal(kind.of(objects[0]), observed[0])


def test_wrong_recorded_objects(pong, objects):
    with pytest.raises(ValueError, match="history must be 1 for recorded objects, got 2"):
        Vector(history=2).of(objects)
    with pytest.raises(ValueError, match="with one batch shape for objects and previous"):
        Vector().of(objects[1:], objects)
    with pytest.raises(ValueError, match="is_first must have the objects' batch shape"):
        Vector().of(objects, objects, is_first=np.zeros(1, bool))
    with pytest.raises(TypeError, match=r"must be ocjax\.Objects"):
        Vector().of(np.zeros(3))
    assert Vector().of(objects[:0]).shape == (0, len(Vector().features_of(pong)))


def test_default_vectors_have_what_an_agent_can_use():
    """Default vectors contain values of scores instead of their boxes, and the orientations and
    values of objects."""
    pong, kind = ocjax.load("Pong"), Vector(normalize=False)
    names = kind.features_of(pong)
    box = ("x", "y", "w", "h", "dx", "dy")
    assert [f for _, category, _, f in names if category == "Ball"] == [*box, "valid"]
    assert [f for _, category, _, f in names if category == "EnemyScore"] == ["value", "valid"]
    seaquest = Vector(history=2).features_of(ocjax.load("Seaquest"))
    assert [f for ago, category, i, f in seaquest if (ago, category, i) == (1, "Player", 0)] == [
        *box,
        "orientation",
        "valid",
    ]
    envs = ocjax.make_vec(
        "Pong", 2, obs={"default": kind, "all": Vector(FEATURES, normalize=False)}, num_workers=0
    )
    observed, _ = envs.reset(seed=0)
    for _ in range(3):
        observed, *_ = envs.step(np.array([2, 3]))
    where = [envs.features["all"].index(name) for name in envs.features["default"]]
    assert np.array_equal(observed["default"], observed["all"][:, where])
    assert observed["default"] in envs.observation_space["default"]
    envs.close()


def test_vectors_from_pixels_track_objects():
    """dx and dy are the movement of one object in mode "vem", too."""
    envs = ocjax.make_vec(
        "Freeway", 2, mode="vem", obs=Vector(("x", "dx", "valid"), normalize=False), num_workers=1
    )
    envs.reset(seed=0)
    for _ in range(40):
        observed, *_ = envs.step(np.zeros(2, int))
    moves = observed.reshape(2, -1, 3)[..., 1]
    assert (moves != 0).sum() >= 10
    assert np.abs(moves).max() <= 10
    envs.close()


def test_orientations_from_pixels_are_in_the_spaces():
    kinds = {
        "objects": "objects",
        "plain": Vector(("orientation",), normalize=False),
        "unit": Vector(("orientation",)),
    }
    envs = ocjax.make_vec("MsPacman", 2, mode="vem", obs=kinds, num_workers=1)
    observed, _ = envs.reset(seed=0)
    assert observed in envs.observation_space
    player = envs.game.slices["Player"].start
    assert (observed["objects"]["orientation"][:, player] == -1).all()
    assert (observed["plain"][:, player] == -1).all()
    assert (observed["unit"][:, player] == -1 / 16).all()
    envs.close()


def test_dqn_frames():
    """Each frame is the brighter of the last two, or without pooling the last one; the oldest comes
    first."""
    envs = ocjax.make_vec(
        "Pong", 2, obs={"dqn": Dqn(), "one": Dqn(stack=1, max_pool=False)}, num_workers=1
    )
    observed, _ = envs.reset(seed=0)
    frames = [observed["dqn"][:, 3]] * 4
    for _ in range(30):
        observed, *_ = envs.step(np.array([2, 3]))
        frames = [*frames[1:], np.asarray(masks.resize(envs.pool.pooled[:, 0], (84, 84)))]
        assert np.array_equal(observed["dqn"], np.stack(frames, axis=1))
        assert np.array_equal(
            observed["one"][:, 0], np.asarray(masks.resize(envs.pool.gray[:, 0], (84, 84)))
        )
    envs.close()


def test_grids_have_features_of_their_own():
    """The features of other categories are the same, at other positions of the vector."""
    kinds = {
        "same": Vector(("y", "my", "valid")),
        "own": Vector(("y", "my", "valid"), grid_features=("valid",)),
    }
    envs = ocjax.make_vec("Breakout", 2, obs=kinds, num_workers=0)
    observed, _ = envs.reset(seed=0)
    for _ in range(5):
        observed, *_ = envs.step(np.array([1, 2]))
    names = {kind: list(envs.features[kind]) for kind in kinds}
    assert names["own"] == [
        name for name in names["same"] if name[1] != "Block" or name[-1] == "valid"
    ]
    assert np.array_equal(
        observed["own"], observed["same"][:, [names["same"].index(name) for name in names["own"]]]
    )
    envs.close()


def test_wrong_vector_options_are_refused():
    for features in ((), ("x", "speed"), ("x", "x")):
        with pytest.raises(ValueError, match=r"^features must be None or distinct names of"):
            Vector(features)
        with pytest.raises(ValueError, match=r"^grid_features must be None or distinct names of"):
            Vector(grid_features=features)
    with pytest.raises(ValueError, match="history must be at least 1"):
        Vector(history=0)
    with pytest.raises(ValueError, match="stack must be at least 1"):
        Dqn(stack=0)


def test_terrain_observation():
    """The cells of the screen, and those around the player, against the masks."""
    around = ocjax.envs.TerrainCells((4, 4), around=(5, 7))
    obs = {"screen": "terrain", "near": around, "ram": "ram"}
    with contextlib.closing(ocjax.make_vec("MsPacman", num_envs=2, obs=obs)) as envs:
        envs.reset(seed=0)
        for _ in range(80):
            seen = envs.step(envs.action_space.sample())[0]
        assert envs.observation_space.contains(seen)
        game, rams = envs.game, np.asarray(seen["ram"])
        terrain = game.terrain_of(rams)
        np.testing.assert_array_equal(seen["screen"], terrain.grid((8, 8)))
        player = envs.objects.of("Player")
        for i in range(2):
            x, y = (int(v) for v in player.center[i, 0])
            padded = np.pad(np.asarray(terrain.masks)[i], ((0, 0), (28, 28), (28, 28)))
            window = padded[:, y + 28 - 10 : y + 28 + 10, x + 28 - 14 : x + 28 + 14]
            cells = window.reshape(1, 5, 4, 7, 4).any((2, 4))
            np.testing.assert_array_equal(np.asarray(seen["near"])[i], cells)


def test_terrain_observation_of_wrong_games():
    with pytest.raises(ValueError, match="Pong has no terrain"):
        ocjax.make_vec("Pong", num_envs=1, obs="terrain")
    with pytest.raises(ValueError, match="at least 1"):
        ocjax.envs.TerrainCells((0, 8))
