"""Ids of environments name their protocols."""

import inspect

import ale_py
import gymnasium
import pytest

import ocjax
import ocjax.envs
from ocjax.emulators.settings import PRESETS
from ocjax.envs.protocols import preset_of
from ocjax.extraction import names


@pytest.mark.parametrize(
    "name", ["Pong-v0", "Pong-v4", "PongNoFrameskip-v0", "PongNoFrameskip-v4", "ALE/Pong-v5"]
)
def test_ids_are_those_of_ale_py(name):
    gymnasium.register_envs(ale_py)
    kwargs = gymnasium.spec(name).kwargs
    settings = PRESETS[preset_of(name, None)]
    assert settings.frame_skip == kwargs["frameskip"]
    assert settings.repeat_action_probability == kwargs["repeat_action_probability"]
    assert settings.full_action_space == kwargs["full_action_space"]
    assert settings.max_episode_frames == kwargs["max_num_frames_per_episode"]


@pytest.mark.parametrize(
    ("name", "preset"),
    [
        ("Pong", "v5"),
        ("pong", "v5"),
        ("ocjax/Pong-v5", "v5"),
        ("Pong-ram-v4", "v4"),
        ("Pong-ramNoFrameskip-v4", "noframeskip"),
        ("Pong-ramDeterministic-v0", "deterministic-v0"),
        ("PongDeterministic-v4", "deterministic-v4"),
        ("SpaceInvadersNoFrameskip-v4", "noframeskip"),
        ("space_invaders", "v5"),
        ("Ms. Pac-Man", "v5"),
        ("ale_py:ALE/Pong-v5", "v5"),
        ("ale_py:PongNoFrameskip-v4", "noframeskip"),
    ],
)
def test_presets_of_names(name, preset):
    assert preset_of(name, None) == preset


def test_environments_follow_the_id():
    envs = ocjax.make_vec("PongNoFrameskip-v4", num_workers=0)
    settings = envs.pool.settings
    envs.close()
    assert (settings.frame_skip, settings.repeat_action_probability) == (1, 0.0)
    assert envs.spec.kwargs["preset"] == "noframeskip"


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        (
            "PongNoFrameskip-v4",
            {"preset": "v5"},
            "preset='v5' contradicts: give the game as 'Pong'",
        ),
        ("PongNoFrameskip-v4", {"frame_skip": 4}, "frame_skip=4 contradicts"),
        (
            "Pong-v4",
            {"repeat_action_probability": 0.25},
            "repeat_action_probability=0.25 contradicts",
        ),
        ("PongDeterministic-v0", {"full_action_space": True}, "full_action_space=True contradicts"),
        ("Pong-v3", {}, "no environment 'Pong-v3'"),
        ("PongNoFrameskip-v5", {}, "no environment 'PongNoFrameskip-v5'"),
    ],
)
def test_contradictions_are_refused(name, options, message):
    with pytest.raises(ValueError, match=message):
        ocjax.make_vec(name, **options)


def test_what_an_id_leaves_open():
    assert (
        preset_of("ALE/Pong-v5", "dqn", frame_skip=1) == "dqn"
    )  # version 5 is the default, as in Gymnasium
    assert preset_of("PongNoFrameskip-v4", "noframeskip", frame_skip=1) == "noframeskip"


def test_single_and_vector_environments_have_the_same_options_in_the_same_order():
    single, vector = (inspect.signature(make).parameters for make in (ocjax.make, ocjax.make_vec))
    assert list(vector)[:2] == ["game", "num_envs"]
    assert list(single) == [name for name in vector if name in single]
    assert set(vector) - set(single) == {
        "num_envs",
        "backend",
        "num_workers",
        "batch_size",
        "worker_timeout",
        "autoreset_mode",
    }
    assert all(single[name].default == vector[name].default for name in single)


@pytest.mark.parametrize("make", [ocjax.make, lambda name: gymnasium.make(f"ocjax/{name}-v5")])
def test_specs_of_single_environments_make_them_again(make):
    env = make("Pong")
    again = gymnasium.make(env.spec)
    assert again.observation_space == env.observation_space
    assert again.spec.kwargs == env.spec.kwargs
    env.close()
    again.close()


@pytest.mark.filterwarnings("ignore:.*out of date")  # Gymnasium's, of every version except the last
@pytest.mark.parametrize("end", names.ENDINGS)
def test_ids_of_all_versions_are_registered(end):
    env = gymnasium.make(f"ocjax/Pong{end}")
    assert env.unwrapped.envs.pool.settings == ocjax.envs.PRESETS[names.ENDINGS[end]]
    env.close()
