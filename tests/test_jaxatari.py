"""JAXAtari's and gymnax's interfaces on the real ROM."""

import dataclasses
import importlib
import sys

import ale_py
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import ocjax
from ocjax import jaxatari
from ocjax.console.rom_files import rom_path
from ocjax.emulators.start import load_emulator
from ocjax.evaluation import parity
from ocjax.evaluation.jaxtari import Jaxtari

KEY = jax.random.key(0)


@pytest.fixture(scope="module")
def env():
    return jaxatari.Environment("Pong", noop_max=0)


@pytest.fixture(scope="module")
def ale():
    ale = ale_py.ALEInterface()
    ale.setFloat("repeat_action_probability", 0.0)
    ale.setInt("random_seed", 0)
    ale.loadROM(rom_path("pong"))
    return ale


def test_steps_are_the_emulators(env, ale):
    """Frame by frame in a scan, against an emulator that is never saved."""
    actions = np.random.default_rng(0).integers(6, size=40)
    _, state = jax.jit(env.reset)(KEY)

    def step(state, action):
        seen, state, reward, done, info = env.step(state, action)
        return state, (seen, state.ram, reward, done, info["frame"])

    _, (seen, rams, rewards, done, frames) = jax.lax.scan(step, state, jnp.asarray(actions))
    ale.reset_game()
    for t, action in enumerate(actions):
        assert ale.act(int(env.ACTION_SET[action])) == rewards[t]
        assert np.array_equal(ale.getRAM(), rams[t])
        assert (ale.getEpisodeFrameNumber(), ale.game_over()) == (frames[t], done[t])
    objects = env.game.rem(rams)
    assert np.array_equal(seen.player.x, objects.of("Player").x[:, 0])
    assert np.array_equal(seen.score_enemy, objects.of("EnemyScore").value[:, 0])


def test_games_begin_as_in_a_new_emulator():
    """Q*bert's first frame is incomplete, which ALE's saved states lack."""
    env = jaxatari.Environment("Qbert", noop_max=0)
    step = jax.jit(env.step)
    for _ in range(2):
        ale = load_emulator(env.game, random_seed=0, repeat_action_probability=0.0)
        ale.reset_game()
        _, state = env.reset(KEY)
        for action in (0, 1, 2, 3, 4, 5) * 3:
            ale.act(int(env.ACTION_SET[action]))
            _, state, *_ = step(state, action)
            assert np.array_equal(ale.getRAM(), state.ram)


def test_states_are_values(env):
    """A state can be stepped again, and batches are mapped."""
    _, state = env.reset(KEY)
    _, one, *_ = env.step(state, 2)
    _, other, *_ = env.step(state, 3)
    _, again, *_ = env.step(state, 2)
    assert np.array_equal(one.emulator, again.emulator)
    assert not np.array_equal(one.emulator, other.emulator)
    both = jax.tree.map(lambda a: jnp.stack([a, a]), state)
    _, batch, reward, done, _ = jax.jit(jax.vmap(env.step))(both, jnp.array([2, 3]))
    assert np.array_equal(batch.ram, [one.ram, other.ram])
    assert (reward.shape, done.shape) == ((2,), (2,))


def test_keys_choose_the_number_of_noops():
    env = jaxatari.Environment("Pong", noop_max=30)
    _, states = jax.vmap(env.reset)(jax.random.split(KEY, 20))
    assert 0 <= states.frame.min() < states.frame.max() <= 30
    _, again = env.reset(jax.random.split(KEY, 20)[3])
    assert again.frame == states.frame[3]


@pytest.mark.slow
def test_gymnax():
    env = jaxatari.GymnaxEnvironment("Breakout", frame_skip=16)
    assert (env.name, env.num_actions) == ("Breakout", 4)
    seen, state = env.reset(KEY, env.default_params)
    assert seen.shape == (
        sum(a.size for a in jax.tree.leaves(jaxatari.observation(env.game.rem(state.ram)))),
    )

    def step(state, key):
        seen, state, _, terminated, truncated, info = env.step(key, state, 1, env.default_params)
        return state, (terminated, truncated, info, seen, state.time)

    _, (terminated, truncated, info, seen, times) = jax.lax.scan(
        step, state, jax.random.split(KEY, 90)
    )
    ends = np.flatnonzero(terminated)
    assert len(ends) > 0
    assert not truncated.any()
    assert (info["frame"][ends] <= 30).all()  # of the next game
    assert (info["lives"][ends] == 5).all()
    same = (info["final_observation"] == seen).all(axis=1)
    assert np.array_equal(np.flatnonzero(~same), ends)
    assert (times[ends] == 0).all()


def test_gymnax_truncates():
    env = jaxatari.GymnaxEnvironment("Pong", frame_skip=4, noop_max=0)
    assert env.default_params.max_steps_in_episode == 27_000
    params = env.default_params.replace(max_steps_in_episode=3)
    _, state = env.reset(KEY, params)
    times = []
    for _ in range(6):
        _, state, _, terminated, truncated, info = env.step(KEY, state, 0, params)
        times.append((int(state.time), bool(terminated), bool(truncated), int(info["frame"])))
    assert times == 2 * [(1, False, False, 4), (2, False, False, 8), (0, False, True, 0)]


def empty(name, *batch):
    """Objects of a game, all invalid."""
    shapes = jax.eval_shape(ocjax.load(name).rem, jax.ShapeDtypeStruct((*batch, 128), jnp.uint8))
    return jax.tree.map(lambda s: jnp.zeros(s.shape, s.dtype), shapes)


@pytest.mark.slow
def test_observations_of_other_games():
    seen = jaxatari.observation(empty("Krull", 3))
    assert seen._fields[:3] == ("player", "lyssa", "slayers")
    assert seen.player.orientation.shape == (3,)


def test_fewer_slots():
    objects = empty("Freeway")
    valid = objects.valid.at[jnp.array([2 + 4, 2 + 29])].set(True)
    objects = dataclasses.replace(
        objects,
        valid=valid,
        xywh=jnp.where(valid[:, None], jnp.arange(34, dtype=jnp.int16)[:, None], jnp.int16(0)),
    )
    cars = jaxatari.observation(objects).car
    assert cars.active.tolist() == [1, 1] + [0] * 8
    assert cars.x.tolist() == [6 + 6 - 8, 31 + 31 - 8] + [0] * 8
    assert cars.width.tolist() == [8, 8] + [0] * 8
    assert cars.x.shape == (10,)
    assert cars.visual_id.tolist() == list(range(10))
    assert cars.orientation.tolist() == [270.0] * 5 + [90.0] * 5


def test_objects_are_whole_and_somewhere():
    """Boxes are JAXAtari's, even if the wall of the court covers a part. Objects also have
    positions before the first ball."""
    pong = ocjax.load("Pong")
    boxes = {
        "Player": [(140, 34, 4, 6), (140, 190, 4, 4), (140, 90, 4, 16)],
        "Ball": [(78, 100, 2, 4), (78, 34, 2, 1), None],
    }
    objects = empty("Pong", 3)
    xywh, valid = np.zeros((3, 5, 4), np.int16), np.zeros((3, 5), bool)
    for name, rows in boxes.items():
        for i, box in enumerate(rows):
            if box:
                xywh[i, pong.slices[name].start], valid[i, pong.slices[name].start] = box, True
    seen = jaxatari.observation(
        dataclasses.replace(objects, xywh=jnp.asarray(xywh), valid=jnp.asarray(valid))
    )
    assert seen.player.y.tolist() == [24, 190, 90]
    assert seen.player.height.tolist() == [16] * 3
    assert list(zip(seen.ball.x.tolist(), seen.ball.y.tolist(), strict=True)) == [
        (78, 100),
        (78, 31),
        (78, 115),
    ]
    assert (seen.ball.width.tolist(), seen.ball.active.tolist()) == ([2] * 3, [1] * 3)
    assert (seen.enemy.x.tolist(), seen.enemy.y.tolist()) == ([16] * 3, [115] * 3)


def test_misuse():
    with pytest.raises(ValueError, match="frame_skip must be at least 1"):
        jaxatari.Environment("Pong", frame_skip=0)
    with pytest.raises(ValueError, match="no category 'PlayerScore'"):
        jaxatari.observation(ocjax.load("Pong", hud=False).rem(np.zeros(128, np.uint8)))


def test_without_jaxatari(env, monkeypatch):
    for package in ("jaxtari", "jaxatari"):
        monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(ModuleNotFoundError, match="pip install jaxtari"):
        env.action_space()


@pytest.fixture
def theirs(request, monkeypatch):
    """JAXAtari's package: from a checkout, or installed under its present name."""
    checkout = request.config.getoption("--jaxatari")
    if checkout is not None:
        monkeypatch.syspath_prepend(checkout / "src")
    name = next((n for n in ("jaxtari", "jaxatari") if importlib.util.find_spec(n)), None)
    if name is None:
        pytest.skip(
            "neither JAXtari is installed nor --jaxatari given, the path of a checkout of JAXAtari"
        )
    return lambda module: importlib.import_module(f"{name}.{module}")


@pytest.mark.filterwarnings("default")  # warnings of other projects
def test_with_jaxatari(theirs):
    """Observations flatten like JAXAtari's own, and its wrappers take the environment."""
    freeway, pong, wrappers = (
        theirs("games.jax_freeway"),
        theirs("games.jax_pong"),
        theirs("wrappers"),
    )
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        game = object.__new__(pong.JaxPong)  # without its renderer, which needs sprites
        game.consts = pong.PongConstants()
        want, _ = game.reset(KEY)
        env = jaxatari.Environment("Pong")
        got, _ = env.reset(KEY)
        assert got._fields == tuple(pong.PongObservation.__dataclass_fields__)
        assert [a.shape for a in jax.tree.leaves(got)] == [a.shape for a in jax.tree.leaves(want)]
        assert (got.player.x, got.player.width, got.player.height) == (
            want.player.x,
            want.player.width,
            want.player.height,
        )
        for name in ("enemy", "ball"):  # before the first serve
            assert jax.tree.leaves(getattr(got, name)) == jax.tree.leaves(getattr(want, name))
        assert (
            jaxatari.fields(ocjax.load("Freeway")).keys()
            == freeway.FreewayObservation.__dataclass_fields__.keys()
        )
        assert np.array_equal(env.ACTION_SET, pong.JaxPong.ACTION_SET)
        assert np.array_equal(
            jaxatari.Environment("Freeway").ACTION_SET, freeway.JaxFreeway.ACTION_SET
        )
        wrapped = wrappers.ObjectCentricWrapper(wrappers.AtariWrapper(env, noop_max=3))
        stack, state = wrapped.reset(KEY)
        assert stack.shape == wrapped.observation_space().shape == (4, 3 * 8 + 2)
        for action in (2, 3, 2):
            stack, state, _, terminated, _, _ = wrapped.step(state, jnp.int32(action))
        assert stack[-1, 0] == 140
        assert not terminated


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("name", jaxatari.FIELDS)
def test_fields_of_jaxtari(name):
    """Observations have the fields and shapes of JAXtari's own environments, and both play the same
    actions."""
    pytest.importorskip("jaxtari")
    game = ocjax.load(name)
    simulator = Jaxtari(game)
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        want, _ = simulator.environment.reset(KEY)
    got = jaxatari.observation(game.rem(np.zeros(128, np.uint8)))
    assert got._fields == tuple(type(want).__dataclass_fields__)
    assert [a.shape for a in jax.tree.leaves(got)] == [np.shape(a) for a in jax.tree.leaves(want)]
    p = parity.compare(game, simulator, frames=5)
    assert len(p.real) == len(p.simulated) == 6
    assert p.simulated.categories == p.real.categories
    jax.clear_caches()  # the compiled games take gigabytes


def test_games_without_known_fields():
    with pytest.raises(ValueError, match="the fields of JAXtari's Alien are not known"):
        Jaxtari(ocjax.load("Alien"))
