"""Vector environments and single environments through Gymnasium's interface."""

import functools
import os
import subprocess
import sys
import warnings
from contextlib import closing
from pathlib import Path

import ale_py
import gymnasium
import jax
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import ocjax
from ocjax.emulators import ale, variations
from ocjax.envs import PRESETS, Dqn, Masks, Vector, WorkerError, make
from tests.support.marks import slow_but

pytestmark = pytest.mark.usefixtures("quick_compilation")

gymnasium.register_envs(ale_py)

# Every observation with a memory, and short episodes that end both by the game and by the limit of
# frames.
OBS = {
    "ram": "ram",
    "vector": Vector(history=2),
    "dqn": Dqn(stack=2),
    "masks": Masks("class", size=(42, 40), stack=2),
}
OPTIONS = {"obs": OBS, "max_episode_frames": 360, "ram_info": True}


@pytest.fixture(scope="module")
def actions():
    return np.random.default_rng(1).integers(4, size=(400, 4))


@pytest.fixture(params=["one shard", pytest.param("two shards", marks=pytest.mark.slow)])
def num_shards(request, monkeypatch):
    """Environments extract all results together, or each worker's results as soon as it has
    finished."""
    monkeypatch.setattr(ale, "_MIN_SHARD", 64 if request.param == "one shard" else 1)
    return 1 if request.param == "one shard" else 2


def equal(a, b):
    return jax.tree.all(jax.tree.map(np.array_equal, a, b))


def at(tree, i):
    return jax.tree.map(lambda a: a[i], tree)


@functools.cache
def alone(seed, steps=200):
    """The history of a single environment: ("step", observation, reward, terminated, truncated,
    info) or ("reset", observation, info)."""
    env = make("Breakout", **OPTIONS)
    column = np.random.default_rng(1).integers(4, size=(400, 4))[:, seed]
    observed, info = env.reset(seed=seed)
    out, t = [("reset", observed, info)], 0
    while t < steps:
        *result, info = env.step(column[t])
        out.append(("step", *result, info))
        t += 1
        if result[2] or result[3]:
            out.append(("reset", *env.reset()))
            t += 1  # next-step autoreset takes one step to reset
    env.close()
    return out


def same_info(vector, single, i):
    return all(np.array_equal(vector[k][i], v) and vector[f"_{k}"][i] for k, v in single.items())


def test_vector_environment_equals_single_environments(num_shards, actions):
    """A vector environment equals single environments with the same seeds, across the ends of
    episodes."""
    envs = ocjax.make_vec("Breakout", 4, num_workers=2, **OPTIONS)
    assert len(envs.pool.shards) == num_shards
    assert envs.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    observed, info = envs.reset(seed=[0, 1, 2, 3])
    rows, ends = [iter(alone(i)) for i in range(4)], 0
    for i in range(4):
        _, want, single = next(rows[i])
        assert equal(at(observed, i), want)
        assert same_info(info, single, i)
    for t in range(150):
        observed, reward, terminated, truncated, info = envs.step(actions[t])
        assert observed in envs.observation_space
        for i in range(4):
            kind, want, *rest = next(rows[i])
            assert equal(at(observed, i), want)
            if kind == "step":
                assert (reward[i], terminated[i], truncated[i]) == tuple(rest[:3])
            else:
                assert (reward[i], terminated[i], truncated[i]) == (0, False, False)
                ends += 1
            assert same_info(info, rest[-1], i)
    assert ends >= 4
    assert equal(envs.objects, envs.game.rem(envs.get_ram()))
    assert [tuple(o.xywh) for o in envs.views(-1)] == [
        (o["x"], o["y"], o["w"], o["h"]) for o in envs.objects[3].to_list()
    ]
    with pytest.raises(IndexError):
        envs.views(4)
    envs.close()


def test_same_step_autoreset(num_shards):
    """The step that ends an episode returns the next one's first observation, and the terminal
    state in final_obs and final_info."""
    envs = ocjax.make_vec(
        "Breakout", 2, autoreset_mode=AutoresetMode.SAME_STEP, num_workers=2, **OPTIONS
    )
    assert len(envs.pool.shards) == num_shards
    envs.reset(seed=[0, 0])
    history, t, ends = alone(0)[1:], 0, 0
    column = np.random.default_rng(1).integers(4, size=(400, 4))[:, 0]
    for k, (kind, *rest) in enumerate(history):
        if kind == "reset":
            t += 1
            continue
        observed, reward, terminated, truncated, info = envs.step(np.full(2, column[t]))
        t += 1
        over = rest[2] or rest[3]
        assert (reward[0], terminated[0], truncated[0]) == tuple(rest[1:4])
        assert ("final_obs" in info) == over
        if over:
            assert equal(info["final_obs"][0], rest[0])
            assert info["_final_obs"].all()
            assert same_info(info["final_info"], rest[4], 0)
            ball = [o for o in info["final_info"]["objects"][0] if o.category == "Player"]
            assert [tuple(b.xywh) for b in ball] == [
                (b["x"], b["y"], b["w"], b["h"]) for b in players(rest[0]["ram"])
            ]
            if k + 1 < len(history):
                assert equal(at(observed, 0), history[k + 1][1])
                assert same_info(info, history[k + 1][2], 0)
            ends += 1
        else:
            assert equal(at(observed, 0), rest[0])
    assert ends >= 2
    envs.close()


def players(ram):
    return [o for o in ocjax.load("Breakout").rem(ram).to_list() if o["category"] == "Player"]


def test_disabled_autoreset():
    """A step past an end raises an error; after a reset the environments continue as single
    environments do."""
    envs = ocjax.make_vec("Breakout", 2, autoreset_mode="Disabled", num_workers=0, **OPTIONS)
    envs.reset(seed=[0, 0])
    column = np.random.default_rng(1).integers(4, size=(400, 4))[:, 0]
    ends = 0
    for t, (kind, *rest) in enumerate(alone(0)[1:]):
        if kind == "step":
            observed, reward, terminated, truncated, _ = envs.step(np.full(2, column[t]))
            assert (reward[1], terminated[1], truncated[1]) == tuple(rest[1:4])
        else:
            with pytest.raises(ValueError, match=r"environments \[0, 1\] have ended"):
                envs.step(np.zeros(2, int))
            observed, _ = envs.reset(options={"reset_mask": np.array([True, True])})
            ends += 1
        assert equal(at(observed, 1), rest[0])
    assert ends >= 2
    envs.close()


def test_a_masked_reset_changes_no_other_environment(num_shards, actions):
    """Observations, rewards and memory of the other environments continue as without the reset."""
    runs = []
    for resets in (False, True):
        envs, out = ocjax.make_vec("Breakout", 4, num_workers=2, obs=OBS), []
        assert len(envs.pool.shards) == num_shards
        envs.reset(seed=5)
        for t in range(60):
            if resets and t % 7 == 3:
                before = envs.reset(options={"reset_mask": np.array([False, True, False, False])})[
                    0
                ]
                assert equal(at(before, np.array([0, 2, 3])), at(out[-1][0], np.array([0, 2, 3])))
            out.append(envs.step(actions[t]))
        runs.append(out)
        envs.close()
    others = np.array([0, 2, 3])
    assert all(equal(at(a[:4], others), at(b[:4], others)) for a, b in zip(*runs, strict=True))
    assert not all(equal(at(a[:4], 1), at(b[:4], 1)) for a, b in zip(*runs, strict=True))


@pytest.mark.parametrize(
    "obs",
    slow_but(
        ["vector", ["planes", "ram"]],
        ["objects", "vector", "dqn", "pixels", "ram", ["planes", "ram"]],
    ),
)
def test_gymnasium_checks_the_single_environment(obs):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make("ocjax/Pong-v5", obs=obs, render_mode="rgb_array")
        check_env(env.unwrapped, skip_close_check=False)
    assert env.spec.kwargs["preset"] == "v5"
    env.close()


def test_environments_are_registered():
    """Importing ocjax registers the IDs; a module name in front of the ID imports it."""
    code = """if True:
        import gymnasium
        envs = gymnasium.make_vec('ocjax:ocjax/Pong-v5', num_envs=2, preset='machado')
        print(envs.spec.kwargs['preset'], envs.num_envs)
        envs.close()
    """
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["machado", "2"]
    assert all(f"ocjax/{name}-v5" in gymnasium.registry for name in ocjax.games())


def test_the_spec_contains_the_settings():
    envs = ocjax.make_vec("Pong", 1, preset="dqn", noop_max=7)
    assert envs.spec.id == "ocjax/Pong-v5"
    expected = {**PRESETS["dqn"].to_dict(), "noop_max": 7, "preset": "dqn"}
    assert {k: envs.spec.kwargs[k] for k in expected} == expected
    envs.close()


@pytest.mark.parametrize("preset", ["v4", "deterministic-v4", "noframeskip", "machado"])
def test_presets_equal_gymnasiums_environments(preset, actions):
    """ale-py's environment with the same options and seed has the same RAM, byte for byte."""
    p = PRESETS[preset]
    reference = gymnasium.make(
        "ALE/Breakout-v5",
        obs_type="ram",
        frameskip=p.frame_skip,
        repeat_action_probability=p.repeat_action_probability,
        full_action_space=p.full_action_space,
        max_num_frames_per_episode=p.max_episode_frames,
    )
    env = make("Breakout", mode="raw", preset=preset)
    assert np.array_equal(env.reset(seed=3)[0], reference.reset(seed=3)[0])
    for a in actions[:, 0]:
        got, want = env.step(a), reference.step(a)
        assert np.array_equal(got[0], want[0])
        assert got[1:4] == want[1:4]
        if got[2]:
            assert np.array_equal(env.reset()[0], reference.reset()[0])
    env.close()
    reference.close()


def test_dqn_preset_by_hand(actions):
    """No-op starts, FIRE, episodes of one life and clipped rewards match the usual wrappers on
    ale-py's environment."""
    reference = gymnasium.make(
        "ALE/Breakout-v5", obs_type="ram", frameskip=1, repeat_action_probability=0.0
    ).unwrapped
    env = make("Breakout", mode="raw", preset="dqn")

    def frames(action):
        total, over = 0.0, False
        for _ in range(4):
            ram, reward, over, _, info = reference.step(action)
            total += reward
        return ram, total, over, info["lives"]

    def fire():
        frames(1)
        return frames(2)[0]

    reference.reset(seed=11)
    for _ in range(int(reference.np_random.integers(1, 31))):
        reference.step(0)
    observed, _ = env.reset(seed=11)
    assert np.array_equal(observed, fire())
    lives, total, ends = 5, 0.0, []
    for a in actions[:, 1]:
        observed, reward, terminated, _, info = env.step(a)
        want, raw, over, left = frames(a)
        total += raw
        assert np.array_equal(observed, want)
        assert (reward, info["reward"], info["lives"], info["episode_return"]) == (
            np.sign(raw),
            raw,
            left,
            total,
        )
        assert terminated == (over or left < lives)
        lives = left
        if terminated:
            ends.append(over)
            if over:
                break
            observed, _ = env.reset()
            frames(0)
            assert np.array_equal(observed, fire())
    assert ends == [False] * 4 + [True]
    env.close()


def test_game_modes_and_difficulties_per_environment():
    envs = ocjax.make_vec(
        "Breakout", 3, mode="raw", game_mode=[0, 4, 0], game_difficulty=[0, 0, 1], num_workers=1
    )
    rams = envs.reset(seed=[0, 0, 0])[0]
    same = ocjax.make_vec("Breakout", 3, mode="raw", game_mode=4, num_workers=1)
    assert np.array_equal(same.reset(seed=[0, 0, 0])[0], np.repeat(rams[1:2], 3, axis=0))
    assert not np.array_equal(rams[0], rams[1])
    envs.close()
    same.close()
    with pytest.raises(ValueError, match="Breakout has no mode 3; it has"):
        ocjax.make_vec("Breakout", 2, game_mode=[0, 3])
    with pytest.raises(ValueError, match="must have one per environment, 2, got 3"):
        ocjax.make_vec("Breakout", 2, game_difficulty=[0, 0, 0])
    for wrong in (0.0, "0", True, {0}, np.float32(0), np.array(0), [0.0, 4.0], [0, "4"]):
        with pytest.raises(
            TypeError,
            match=(
                "game_mode must be an integer, or a sequence with one integer or None per "
                "environment, got"
            ),
        ):
            ocjax.make_vec("Breakout", 2, game_mode=wrong)
        with pytest.raises(TypeError, match="game_difficulty must be an integer"):
            ocjax.make_vec("Breakout", 2, game_difficulty=wrong)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_the_limit_of_steps_is_that_of_gymnasium(mode, actions):
    """The limit also holds after a state is restored in the middle of an episode."""
    limit, options = 23, {"mode": "raw", "repeat_action_probability": 0.0}
    reference = gymnasium.make("ocjax/Breakout-v5", max_episode_steps=limit, **options)
    envs = gymnasium.make_vec(
        "ocjax/Breakout-v5",
        2,
        max_episode_steps=limit,
        autoreset_mode=mode,
        num_workers=1,
        **options,
    )
    want, got = reference.reset(seed=5)[0], envs.reset(seed=[4, 5])[0][1]
    assert np.array_equal(got, want)
    steps = ends = 0
    while ends < 3:
        a = actions[steps, 0]
        want, _, terminated, truncated, _ = reference.step(a)
        got, _, over, cut, info = envs.step(np.array([0, a]))
        assert (over[1], cut[1]) == (terminated, truncated)
        assert np.array_equal(
            info["final_obs"][1] if mode == AutoresetMode.SAME_STEP and truncated else got[1], want
        )
        steps += 1
        if steps == 10:
            envs.restore_state(envs.clone_state())
        if truncated:
            ends += 1
            assert steps == ends * limit
            reference.reset()
            if mode == AutoresetMode.NEXT_STEP:
                envs.step(np.zeros(2, int))
            if mode == AutoresetMode.DISABLED:
                envs.reset(options={"reset_mask": np.array([True, True])})
    envs.close()
    with pytest.raises(ValueError, match="max_episode_steps must be an integer of at least 1"):
        ocjax.make_vec("Breakout", 1, max_episode_steps=0)


def test_gymnasium_makes_further_render_modes():
    """Gymnasium shows or collects the frames of the existing modes."""
    for name, size in (("rgb_array", (210, 160, 3)), ("objects", (630, 960, 3))):
        env = gymnasium.make("ocjax/Pong-v5", render_mode=f"{name}_list")
        env.reset(seed=0)
        env.step(0)
        assert [np.shape(frame) for frame in env.render()] == [size, size]
        env.close()
    with pytest.warns(UserWarning, match="The HumanRendering wrapper is being applied"):
        env = gymnasium.make("ocjax/Pong-v5", render_mode="human")
    assert isinstance(env, gymnasium.wrappers.HumanRendering)
    assert (env.render_mode, env.unwrapped.render_mode, env.unwrapped.metadata["render_fps"]) == (
        "human",
        "rgb_array",
        15,
    )
    for function in (ocjax.make_vec, make):
        with pytest.raises(
            ValueError, match=r"got 'human'; gymnasium\.make, not make_vec, adds 'human' and lists"
        ):
            function("Pong", render_mode="human")


@pytest.mark.parametrize(
    ("option", "hint"),
    [
        ("obs_type", "it is called obs"),
        ("seed", "an argument of reset"),
        ("rewardfn", "did you mean reward_fn"),
        ("palette", r"help\(ocjax.make_vec\)"),
    ],
)
def test_options_that_do_not_exist_are_refused(option, hint):
    message = f"environments of ocjax have no option {option}: .*{hint}"
    for function in (ocjax.make_vec, make):
        with pytest.raises(TypeError, match=message):
            function("Pong", **{option: 1})
    for function in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(TypeError, match=message):
            function("ocjax/Pong-v5", **{option: 1})


@pytest.mark.parametrize(
    ("theirs", "ours"),
    [
        ({"frameskip": 3}, {"frame_skip": 3}),
        pytest.param({"difficulty": 1}, {"game_difficulty": 1}, marks=pytest.mark.slow),
        pytest.param(
            {"max_num_frames_per_episode": 1000},
            {"max_episode_frames": 1000},
            marks=pytest.mark.slow,
        ),
        ({"mode": 1}, {"game_mode": 1}),
        ({"mode": "ram"}, {"mode": "rem"}),
        pytest.param({"mode": "vision"}, {"mode": "vem"}, marks=pytest.mark.slow),
    ],
)
def test_names_of_other_projects_are_accepted(theirs, ours):
    with (
        closing(ocjax.make_vec("Pong", num_workers=0, **theirs)) as envs,
        closing(ocjax.make_vec("Pong", num_workers=0, **ours)) as same,
    ):
        assert envs.spec == same.spec
    with (
        closing(gymnasium.make("ocjax/Pong-v5", **theirs)) as env,
        closing(make("Pong", **ours)) as same,
    ):
        assert str(env.reset(seed=0)) == str(same.reset(seed=0))
        assert str(env.step(2)) == str(same.step(2))


def test_an_option_is_given_by_one_name():
    for options in ({"frameskip": 3, "frame_skip": 3}, {"mode": 1, "game_mode": 1}):
        with pytest.raises(TypeError, match="are names of one option"):
            make("Pong", **options)


@pytest.mark.parametrize("mode", ["rem", "both"])
def test_objects_of_a_single_environment_have_no_batch(mode):
    with closing(make("Pong", mode=mode)) as env:
        with pytest.raises(ValueError, match="have not been reset"):
            _ = env.objects
        env.reset(seed=0)
        found = env.objects["rem"] if mode == "both" else env.objects
        assert found.batch_shape == ()
        assert equal(found, env.game.rem(env.get_ram()))
        with pytest.warns(DeprecationWarning, match=r"use envs\.objects"):
            assert equal(jax.tree.map(lambda a: a[0], env.tensors), env.objects)


def test_tensors_are_the_old_name_of_objects():
    with closing(ocjax.make_vec("Pong", 2, num_workers=0)) as envs:
        envs.reset(seed=0)
        with pytest.warns(DeprecationWarning, match=r"use envs\.objects"):
            assert equal(envs.tensors, envs.objects)


def test_views_have_ocataris_interface():
    env = make("Pong", mode="both", preset="deterministic-v4")
    env.reset(seed=0)
    before = {o.category: o.xy for o in env.views()}
    for _ in range(40):
        env.step(3)
        for o in env.views():
            assert (o.dx, o.dy) == (o.x - o.prev_xy[0], o.y - o.prev_xy[1])
            assert o.prev_xy == before.get(o.category, o.xy)
            assert o.visible
        before = {o.category: o.xy for o in env.views()}
    assert {o.category for o in env.views()} >= {"Player", "Enemy", "PlayerScore", "EnemyScore"}
    assert [(o.category, o.xywh) for o in env.views() if not o.hud] == [
        (o.category, o.xywh) for o in env.views("vem") if not o.hud
    ]
    with pytest.warns(DeprecationWarning, match=r'env\.views\("vem"\)'):
        assert env.objects_v == env.views("vem")
    env.set_ram(14, 7)
    assert (
        next(o for o in env.views() if o.category == "PlayerScore").value == env.get_ram()[14] == 7
    )
    for address, value in ((128, 0), (0, 256), (-1, 0)):
        with pytest.raises(ValueError, match="an address is 0 to 127"):
            env.set_ram(address, value)
    env.close()


def test_states_contain_the_memory_of_observations(num_shards, actions):
    envs = ocjax.make_vec("Breakout", 4, mode="both", obs=OBS, num_workers=2)
    assert len(envs.pool.shards) == num_shards
    envs.reset(seed=0)
    for t in range(20):
        observed, *_, info = envs.step(actions[t])
    states = envs.clone_state()
    first = [envs.step(a) for a in actions[20:40]]
    back, back_info = envs.restore_state(states)
    assert equal(back, observed)
    assert equal(back_info, info)
    again = [envs.step(a) for a in actions[20:40]]
    assert equal(first, again)
    some = np.array([True, False, False, False])
    late = again[-1][0]
    back, _ = envs.restore_state(states, some)
    assert equal(at(back, 0), at(observed, 0))
    assert equal(at(back, slice(1, 4)), at(late, slice(1, 4)))
    other = ocjax.make_vec("Breakout", 4, obs="vector", num_workers=0)
    other.reset(seed=0)
    with pytest.raises(ValueError, match="of environments with other observations"):
        other.restore_state(states)
    other.close()
    envs.close()


def test_set_ram_extracts_before_the_next_step(num_shards):
    """Steps overwrite the RAM in place, so all extraction from it must end before `set_ram`
    returns."""
    envs = ocjax.make_vec("Breakout", 6, num_workers=2)
    assert len(envs.pool.shards) == num_shards
    envs.reset(seed=0)
    rng = np.random.default_rng(0)
    for _ in range(50):
        envs.set_ram(rng.integers(256, size=(6, 128)).astype(np.uint8))
        ram = envs.get_ram()
        envs.pool.ram[:] = 255 - ram
        assert equal(envs.objects, envs.game.rem(ram))
    envs.close()


@pytest.mark.parametrize(
    ("name", "hook", "category", "most"),
    [
        ("Pong", variations.find("Pong:lazy_enemy"), "Enemy", 4),
        pytest.param(
            "Freeway", variations.find("Freeway:stopped_cars"), "Car", 1, marks=pytest.mark.slow
        ),
        pytest.param(
            "SpaceInvaders",
            variations.find("SpaceInvaders:no_shields"),
            "Shield",
            None,
            marks=pytest.mark.slow,
        ),
    ],
)
def test_variations(name, hook, category, most):
    """The pixels show the change of each hook: a frozen object moves by at most `most` pixels, and
    VEM does not detect a removed one."""
    observed = {}
    for changed in (True, False):
        envs = ocjax.make_vec(name, 2, mode="vem", hook=hook if changed else None, num_workers=2)
        envs.reset(seed=0)
        rng, places = np.random.default_rng(0), []
        for t in range(150):
            envs.step(rng.integers(envs.single_action_space.n, size=2))
            found = jax.tree.map(np.asarray, envs.objects.of(category))
            if t > 60:
                places.append(
                    np.ma.array(
                        found.xywh[..., :2], mask=np.repeat(~found.valid[..., None], 2, axis=-1)
                    )
                )
        observed[changed] = np.ma.stack(places)
        envs.close()
    assert observed[False].count()
    if most is None:
        assert not observed[True].count()
    else:
        moves = {k: np.ma.ptp(v, axis=0).max() for k, v in observed.items()}
        assert moves[True] <= most < moves[False]


def test_a_hook_that_fails_is_reported():
    def broken(ram):
        raise ArithmeticError(f"byte {ram[0]}")

    envs = ocjax.make_vec("Pong", 2, hook=broken, num_workers=1)
    envs.reset(seed=0)
    with pytest.raises(WorkerError, match="ArithmeticError: byte"):
        envs.step(np.zeros(2, int))


def test_render():
    envs = ocjax.make_vec("Pong", 2, render_mode="rgb_array", obs="pixels", num_workers=0)
    observed, _ = envs.reset(seed=0)
    assert np.array_equal(np.stack(envs.render()), observed)
    envs.close()
    env = make("Pong", render_mode="objects")
    env.reset(seed=0)
    for _ in range(20):
        env.step(0)
    drawn = env.render()
    assert drawn.shape == (630, 960, 3)
    plain = make("Pong", render_mode="rgb_array")
    plain.reset(seed=0)
    for _ in range(20):
        plain.step(0)
    large = plain.render().repeat(3, axis=0).repeat(6, axis=1)
    assert 0 < (drawn != large).any(axis=-1).mean() < 0.2
    for e in (env, plain):
        e.close()


def test_wrong_options_are_refused():
    for kwargs, message in (
        ({"preset": "v6"}, "no preset 'v6': there are v5, v0, v4"),
        ({"obs": "pixel"}, "no observation 'pixel': there are objects"),
        ({"mode": "raw", "obs": "vector"}, "mode 'raw' does not extract"),
        ({"backend": "gym"}, "backend must be"),
        ({"batch_size": 2}, "batch_size is envpool's"),
        ({"render_mode": "human"}, "render_mode must be"),
        ({"mode": "raw", "render_mode": "objects"}, "draws objects"),
        ({"autoreset_mode": "later"}, "later"),
        ({"obs": []}, "obs must name at least one observation"),
    ):
        with pytest.raises(ValueError, match=message):
            ocjax.make_vec("Pong", 2, **kwargs)
    with pytest.raises(TypeError, match="num_workers is an option of make_vec"):
        make("Pong", num_workers=2)
    env = make("Pong")
    with pytest.raises(ValueError, match="there are none"):
        env.reset(options={"reset_mask": np.array([True])})
    env.close()
    envs = ocjax.make_vec("Pong", 2)
    with pytest.raises(ValueError, match="not been reset"):
        _ = envs.objects
    with pytest.raises(ValueError, match=r"call reset\(\) before the first step"):
        envs.step(np.zeros(2, int))
    with pytest.raises(AttributeError, match="no observation is a vector"):
        _ = envs.features
    with pytest.raises(ValueError, match="the first reset must be of all"):
        envs.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(ValueError, match="all False"):
        envs.reset(options={"reset_mask": np.array([False, False])})
    envs.close()


@pytest.mark.slow
@pytest.mark.skipif(
    not Path("/proc/self/statm").exists(), reason="needs the memory of a process from Linux's /proc"
)
def test_many_steps_do_not_leak(request):
    """Memory does not grow, and no process or shared memory remains."""
    num_envs = 64
    calls = request.config.getoption("--soak") // num_envs
    shared = set(Path("/dev/shm").iterdir())
    envs = ocjax.make_vec(
        "Pong",
        num_envs,
        frame_skip=1,
        num_workers=2,
        autoreset_mode="SameStep",
        max_episode_frames=400,
    )
    envs.reset(seed=0)
    pids = [w.process.pid for w in envs.pool._workers]
    sizes = {pid: [] for pid in (os.getpid(), *pids)}
    rng = np.random.default_rng(0)
    for t in range(1, calls + 1):
        envs.step(rng.integers(6, size=num_envs))
        if t in (calls // 3, 2 * calls // 3, calls):
            for pid, size in sizes.items():
                size.append(
                    int(Path(f"/proc/{pid}/statm").read_text().split()[1])
                    * os.sysconf("SC_PAGE_SIZE")
                )
    for pid, (first, _, last) in sizes.items():
        assert last - first < 8e6, f"{'worker' if pid in pids else 'main'}: {sizes[pid]}"
    envs.close()
    assert not any(Path(f"/proc/{pid}").exists() for pid in pids)
    assert set(Path("/dev/shm").iterdir()) <= shared


def test_environments_show_themselves_in_a_notebook():
    envs = ocjax.make_vec("Pong", 2, num_workers=0)
    assert envs._repr_html_() == "<p>2 environments of Pong, mode rem</p>"
    envs.reset(seed=0)
    assert envs._repr_html_().count("<svg") == 1
    assert envs.objects[0]._repr_html_().count("<rect") == envs._repr_html_().count("<rect")
    envs.close()


def test_rendering_without_a_mode_gives_a_warning():
    with closing(ocjax.make("Pong")) as env:
        env.reset(seed=0)
        with pytest.warns(UserWarning, match="without a render mode; give one when you make"):
            assert env.render() is None
