"""Code written for OCAtari and HackAtari runs on `ocjax.ocatari`."""

import copy
import pickle

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import ocjax
from ocjax import layouts, ocatari
from ocjax.emulators import variations
from ocjax.ocatari import GameObject, NoObject, OCAtari, Orientation, ValueObject
from tests.support.states import excerpt


@pytest.fixture
def make():
    made = []

    def make(*args, **options):
        made.append(OCAtari(*args, **options))
        return made[-1]

    yield make
    for env in made:
        env.close()


def test_arguments_and_attributes(make):
    env = make(
        "Pong",
        "both",
        True,
        "obj",
        "rgb_array",
        False,
        3,
        ["ori", "dqn"],
        frameskip=2,
        repeat_action_probability=0.0,
        difficulty=1,
    )
    observation, info = env.reset(seed=0)
    assert info.keys() >= {"lives", "episode_frame_number", "frame_number"}
    assert (
        observation.shape
        == env.observation_space.shape
        == env._env.observation_space.shape
        == (3, 10)
    )
    assert observation.dtype == np.int64
    assert (env.env_name, env.game_name, env.nb_actions) == ("Pong", "Pong", 6)
    assert (env.mode, env.hud, env.obs_mode, env.buffer_window_size, env.render_mode) == (
        "both",
        True,
        "obj",
        3,
        "rgb_array",
    )
    assert env.max_objects_per_cat == {
        "Player": 1,
        "Ball": 1,
        "Enemy": 1,
        "PlayerScore": 1,
        "EnemyScore": 1,
    }
    assert env.ns_meaning[1] == "Ball (['POSITION'])"
    assert [
        len(b) for b in (env._state_buffer_rgb, env._state_buffer_dqn, env._state_buffer_ns)
    ] == [3, 3, 3]
    for _ in range(60):
        observation, reward, terminated, truncated, info = env.step(3)
    assert (type(reward), type(terminated), type(truncated)) == (float, bool, bool)
    assert info["frame_number"] == 120
    assert observation[-1].tolist() == env.ns_state == [v for o in env.objects for v in o.nsrepr]
    assert [o.category for o in env.objects] == list(env.max_objects_per_cat)
    assert [o.xywh for o in env.objects_v] == [o.xywh for o in env.objects]
    assert np.array_equal(env.getScreenRGB(), env.get_rgb_state)
    assert np.array_equal(env.render(), env._ale.getScreenRGB())
    assert env._env.unwrapped.ale is env.ale is env.env.unwrapped.ale
    assert env.get_keys_to_action()["d", " "] == 4
    assert env.get_action_meanings()[:2] == ["NOOP", "FIRE"]
    assert env.aggregated_render().shape == (210, 160, 3)
    assert env.unwrapped is env


def test_frames_are_those_of_ale(make):
    env, ale = make("PongNoFrameskip-v4", obs_mode="ori"), gymnasium.make("PongNoFrameskip-v4")
    assert np.array_equal(env.reset(seed=3)[0], ale.reset(seed=3)[0])
    for t in range(50):
        mine, theirs = env.step(t % 6), ale.step(t % 6)
        assert np.array_equal(mine[0], theirs[0])
        assert mine[1:] == theirs[1:]
    ale.close()


@pytest.mark.parametrize(
    ("obs_mode", "shape", "dtype"),
    [("ori", (210, 160, 3), "uint8"), ("dqn", (4, 84, 84), "uint8"), ("obj", (4, 6), "int64")],
)
def test_gymnasium_api(make, obs_mode, shape, dtype):
    env = make("Pong", obs_mode=obs_mode, render_mode="rgb_array")
    observation, _ = env.reset(seed=0)
    assert (observation.shape, observation.dtype) == (shape, dtype)
    check_env(env, skip_render_check=True)
    again = gymnasium.make(env.spec)
    assert again.observation_space == env.observation_space
    again.close()


def test_object(make):
    env = make("Pong", hud=True)
    env.reset(seed=0)
    player, before = env.objects[0], None
    for _ in range(40):
        before = {o.category: o.xy for o in env.objects}
        env.step(3)
        for o in filter(None, env.objects):
            assert o.prev_xy == (o.prev_x, o.prev_y) == before.get(o.category, o.xy)
            assert (o.dx, o.dy) == (o.x - o.prev_x, o.y - o.prev_y)
            assert o.h_coords == [o.xy, o.prev_xy]
    ball, player, score = env.objects[1], env.objects[0], env.objects[4]
    assert type(ball).__name__ == ball.category == "Ball"
    assert isinstance(ball, GameObject)
    assert isinstance(score, ValueObject)
    assert not isinstance(ball, ValueObject)
    assert (score.hud, score.value, score.value_diff, ball.hud, ball.value, ball.visible) == (
        True,
        score.prev_value,
        0,
        False,
        None,
        True,
    )
    assert ball.center == (ball.x + 1, ball.y + 2)
    assert (ball.xywh, ball._nsrepr, ball._ns_meaning) == (
        (*ball.xy, *ball.wh),
        [*ball.xy],
        ["POSITION"],
    )
    assert ball.closest_object(env.objects)[0] == 1
    assert ball.manhattan_distance(player) == abs(ball.center[0] - player.center[0]) + abs(
        ball.center[1] - player.center[1]
    )
    assert set(ball.properties) >= {"x", "prev_x", "rgb", "center"}
    assert repr(score) == f"EnemyScore at ({score.x}, {score.y}), ({score.w}, {score.h})"
    assert pickle.loads(pickle.dumps(env.objects)) == copy.deepcopy(env.objects) == env.objects
    ball.xy, ball.w = player.xy, 4
    ball.h = player.h
    assert ball.iou(player) == 1
    assert ball.is_on_top(player)
    assert not ball._is_equivalent(player)
    ball.rgb = (1, 2, 3)
    assert env.objects[1].rgb == (1, 2, 3)


def test_empty_slots(make):
    env = make("Pong")
    env.reset(seed=0)
    env.step(0)
    empty = env.objects[1]
    assert not empty
    assert empty == NoObject()
    assert (empty.category, repr(empty), empty.xywh, empty.nsrepr) == (
        "NoObject",
        "NaO",
        (0, 0, 0, 0),
        [0, 0],
    )
    assert empty.iou(NoObject()) == 1
    assert len(env.objects) == 3
    assert sum(map(bool, env.objects)) < 3


@pytest.mark.slow
def test_slots_of_other_games(make):
    seaquest, skiing = make("Seaquest"), make("Skiing", mode="revised")
    seaquest.reset(seed=0)
    assert "OxygenBar" in seaquest.max_objects_per_cat  # OCAtari counts it among the objects
    assert "OxygenBar (['WIDTH'])" in seaquest.ns_meaning
    assert len(seaquest.ns_state) == 2 * sum(seaquest.max_objects_per_cat.values()) - 1
    skiing.reset(seed=0)
    player = skiing.objects[0]
    assert player.nsrepr == [*player.xy, player.orientation.value]
    assert player.orientation in Orientation
    assert player.ns_types == [tuple[int, int], tuple[int]]


@pytest.mark.parametrize(
    ("name", "env_id"),
    [
        ("Pong", "Pong-v4"),
        ("pong", "Pong-v4"),
        ("ALE/Pong-v5", "ALE/Pong-v5"),
        ("ocjax/Pong-v5", "ALE/Pong-v5"),
        ("PongNoFrameskip", "PongNoFrameskip-v4"),
        ("PongDeterministic-v4", "Pong-v4"),
        ("PongDeterministic", "Pong-v4"),
    ],
)
def test_names(make, name, env_id):
    env = make(name, obs_mode="ori")
    assert (env.env_name, env._env.spec.id) == (name, env_id)
    assert env._env.unwrapped._frameskip == (
        (2, 5) if name.lower() == "pong" else 1 if "No" in name else 4
    )


@pytest.mark.parametrize("name", ["Pong", "Freeway", "BeamRider"])
def test_objects_without_a_slot_follow(name):
    """All objects that are present are listed once, each in a slot of its category or after the
    slots."""
    game = ocjax.load(name)
    objects = ocatari._host(game.rem(excerpt(name)["rams"][30:31]))
    for hud in (False, True):
        table = ocatari.SlotTable(game, hud)
        listed = table.arrange(objects, None)
        records = [r for r in objects.to_list() if hud or not r["hud"]]
        assert sorted(o.xywh for o in listed if o) == sorted(
            (r["x"], r["y"], r["w"], r["h"]) for r in records
        )
        for o, meaning in zip(listed, table.meaning, strict=False):
            assert not o or meaning.split(" ")[0] == o.category
        assert (
            len(table.ns_state(listed))
            == len(table.ns_state(table.empty()))
            == 2 * sum(table.counts.values())
        )


@pytest.mark.parametrize("name", ocjax.games())
def test_all_names_of_ocatari_are_known(name):
    game = ocjax.load(name)
    table = layouts.declared_slots(game, hud=True) or {}
    assert table.keys() <= {*game.slices, *(a for c in game.categories for a in c.aliases)}


def test_two_names_of_one_category():
    """The first name gets the objects."""
    game = ocjax.load("DemonAttack")
    objects = ocatari._host(game.rem(excerpt("DemonAttack")["rams"][30:31]))
    listed = [o for o in ocatari.SlotTable(game, True).arrange(objects, None) if o]
    assert [o.category for o in listed].count("Enemy") == np.count_nonzero(
        objects.of("EnemyPart").valid
    )
    assert "EnemyPart" not in {o.category for o in listed}
    assert layouts.places(game, ("Enemy", "EnemyPart"))["EnemyPart"] == slice(0, 0)


def test_objects_have_names_of_ocatari():
    game = ocjax.load("MarioBros")
    objects = ocatari._host(game.rem(excerpt("MarioBros")["rams"][30:31]))
    listed = ocatari.SlotTable(game, True).arrange(objects, None)
    (time,) = [o for o in listed if o.category == "Time"]
    assert isinstance(time, ValueObject)
    assert [time.value] == objects.of("Level").value.ravel().tolist()
    assert pickle.loads(pickle.dumps(time)) == time


def test_slots_of_games_that_differ():
    crazy_climber, kangaroo = (
        ocatari.SlotTable(ocjax.load("CrazyClimber"), True),
        ocatari.SlotTable(ocjax.load("Kangaroo"), False),
    )
    assert list(crazy_climber.counts) == [
        "Player",
        "Window",
        "Enemy_Red",
        "Enemy_Bird",
        "Projectile",
        "Helicopter",
    ]
    assert list(kangaroo.counts)[:3] == ["Player", "Child", "Monkey"]


def test_ram_and_states(make):
    env = make("PongDeterministic-v4", hud=True)
    env.reset(seed=0)
    env.set_ram(14, 7)
    assert env.get_ram()[14] == 7
    env.detect_objects()
    assert env.objects[3].value == 7
    state = env._clone_state()
    first = [env.step(3)[0].tolist() for _ in range(20)]
    env._restore_state(state)
    env._state_buffer_ns.clear()
    assert [env.step(3)[0].tolist()[-1] for _ in range(20)] == [rows[-1] for rows in first]
    for address, value in ((128, 0), (0, 256), (-1, 0)):
        with pytest.raises(ValueError, match="an address is 0 to 127"):
            env.set_ram(address, value)


def test_hooks(make):
    env = make(
        "Pong",
        hook=[variations.find("Pong:lazy_enemy"), lambda ram: ram.__setitem__(14, 5)],
        hud=True,
    )
    env.reset(seed=0)
    for _ in range(60):
        env.step(0)
    assert env.objects[3].value == 5
    assert 105 < env.objects[2].y < 125
    broken = make("Pong", hook=lambda ram: ram[200])
    broken.reset(seed=0)
    with pytest.raises(RuntimeError, match=r"the hook .*<lambda> failed: IndexError"):
        broken.step(0)


def test_overlay_and_drawing(make):
    env = make("Pong", render_mode="rgb_array", render_oc_overlay=True, mode="vision")
    env.reset(seed=0)
    for _ in range(40):
        env.step(3)
    picture = env.render()
    assert picture.shape == (800, 1050, 3)
    player = env.objects[0]
    assert tuple(picture[5 * player.x, 5 * player.y]) == player.rgb
    frame = np.zeros((210, 160, 3), np.uint8)
    ocatari.mark_bb(frame, (10, 20, 4, 6), (9, 9, 9))
    assert np.argwhere(frame[..., 0])[[0, -1]].tolist() == [[19, 9], [26, 14]]
    ocatari.mark_bb(frame, (158, 208, 9, 9))
    with pytest.raises(
        ValueError, match=r"got shape \[4, 6\]: OCAtari returns frames with obs_mode='ori'"
    ):
        ocatari.mark_bb(np.zeros((4, 6)), (0, 0, 1, 1))
    assert ocatari.make_darker((100, 50, 11)) == [80, 40, 8]
    assert ocatari.to_rgba((255, 0, 51)).tolist() == [1, 0, 0.2, 0.7]
    assert ocatari.RandomAgent(1).draw_action() == 0


def test_seeding_as_ocatari_does(make):
    env = make("Breakout", obs_mode="ori")
    runs = []
    for _ in range(2):
        ocatari.make_deterministic(5, env)
        env.reset()
        runs.append([env.step(1 + t % 3)[0].sum() for t in range(40)])
    assert runs[0] == runs[1]


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"mode": "raw"}, ValueError, "mode must be one of"),
        ({"obs_mode": None}, ValueError, "obs_mode must be one of"),
        ({"buffer_window_size": 0}, ValueError, "buffer_window_size must be at least 1"),
        ({"hook": 3}, TypeError, "hook must be a function"),
        ({"frame_skip": 3}, TypeError, "frame_skip"),
        ({"env_name": "AEL/Pong"}, ocjax.errors.UnknownGameError, "no game 'AEL/Pong'"),
        ({"env_name": "Pong-v9"}, gymnasium.error.VersionNotFound, "`v9` for environment `Pong`"),
    ],
)
def test_misuse(options, error, message):
    with pytest.raises(error, match=message):
        OCAtari(**{"env_name": "Pong", **options})


def test_unknown_actions(make):
    env = make("Pong")
    env.reset(seed=0)
    for action in (99, -1):
        with pytest.raises(ValueError, match=f"the action must be from 0 to 5, got {action}"):
            env.step(action)


def test_score_of_riverraid():
    """HackAtari's name for it; the recording has the sums of rewards."""
    data = excerpt("Riverraid")
    for i in (0, len(data["rams"]) // 2, -1):
        assert ocatari.riverraid_score(data["rams"][i]) == data["rewards"][i]


def test_names_that_are_absent():
    with pytest.raises(ImportError, match="has no MAX_NB_OBJECTS: `OCAtari"):
        from ocjax.ocatari import MAX_NB_OBJECTS  # noqa: F401  # pyright: ignore
    with pytest.raises(ImportError, match="cannot import name 'nothing'"):
        from ocjax.ocatari import nothing  # noqa: F401  # pyright: ignore
    with pytest.raises(
        ValueError, match=r"does not load agents of OCAtari: .* load the model with the library"
    ):
        ocatari.load_agent("model.pt", None)
    first, second = ocatari.__getattr__("parser"), ocatari.__getattr__("parser")
    first.add_argument("-g", "--game")
    assert second.parse_args(["-p", "x"]).path == "x"
    with pytest.raises(AttributeError, match="objects_v needs mode 'both'"):
        env = OCAtari("Pong")
        env.objects_v  # noqa: B018
    env.close()


def test_imports_from_modules():
    from ocjax.ocatari import core, utils, vision
    from ocjax.ocatari.core import UPSCALE_FACTOR
    from ocjax.ocatari.core import OCAtari as Core
    from ocjax.ocatari.utils import load_agent, parser
    from ocjax.ocatari.vision.utils import make_darker, mark_bb

    assert Core is OCAtari
    assert UPSCALE_FACTOR == ocatari.UPSCALE_FACTOR
    assert (load_agent, mark_bb, make_darker) == (
        ocatari.load_agent,
        ocatari.mark_bb,
        ocatari.make_darker,
    )
    assert parser.parse_args(["-p", "model"]).path == "model"
    for module in (core, utils, vision.utils):
        assert set(module.__all__) <= set(ocatari.__all__)
        with pytest.raises(ImportError, match="has no find_objects: it is a part of OCAtari's"):
            module.find_objects  # noqa: B018
