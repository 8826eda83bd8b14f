"""Configurations of training runs, which need no extra."""

import dataclasses
import json

import numpy as np
import pytest

from ocjax.agents.config import EXPERIMENTS, Config, Hyperparameters, TrainingError

# Wrong values of each field, with a part of the message.
WRONG = {
    "game": [("Pung", "did you mean Pong"), ("", "no game ''")],
    "seed": [(-1, "at least 0"), (2**31, "at most"), (1.5, "1.5"), ("1", "'1'"), (True, "True")],
    "inputs": [
        ("ram", "objects or pixels, got 'ram'"),
        (None, "None"),
        (["objects"], "objects or pixels"),
    ],
    "preset": [
        ("v4", "fixed frame skip"),
        ("v0", "fixed frame skip"),
        ("v9", "there are v5"),
        (["v5"], "must be a name"),
        (None, "None"),
    ],
    "hyperparameters": [({}, "instance of Hyperparameters"), (None, "None")],
    "features": [
        (("q",), "distinct names"),
        ((), "distinct names"),
        ("x", "sequence of names"),
        (None, "None"),
        ((1,), "got (1,)"),
    ],
    "grid_features": [
        (("q",), "distinct names"),
        ((), "distinct names"),
        ("x", "sequence of names"),
        (3, "3"),
    ],
    "history": [(0, "at least 1"), (10**6, "at most"), ("2", "'2'"), (2.0, "2.0"), (None, "None")],
    "network": [
        ("cnn", "network must be deep_sets or mlp, got 'cnn'"),
        (None, "None"),
        (["mlp"], "got ['mlp']"),
    ],
    "variations": [
        ("lazy_enemy", "sequence of names"),
        (("lazy",), "did you mean lazy_enemy"),
        (("Freeway:stop_all_cars",), "Freeway"),
        ((3,), "sequence of names"),
        (None, "None"),
    ],
    "game_mode": [
        (7, "it has [0, 1]"),
        (-1, "it has [0, 1]"),
        ("1", "'1'"),
        (1.0, "1.0"),
        (True, "True"),
        ([1], "[1]"),
    ],
    "game_difficulty": [
        (9, "it has [0, 1, 2, 3]"),
        ("1", "'1'"),
        (False, "False"),
        ([0, 1], "it has"),
    ],
    "starts": [
        ({"ball_x": 1}, "sequence of mappings"),
        (["ball_x=1"], "sequence of mappings"),
        ([{"ball": 1}], "did you mean"),
        ([{"ball_x": 999}], "must be from"),
        ([{"128": 0}], "no field '128'"),
        ([{4: "a"}], "integer, got 'a'"),
        (None, "None"),
    ],
}


def test_every_field_has_wrong_values():
    assert WRONG.keys() == {field.name for field in dataclasses.fields(Config)}


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [(field, *case) for field, cases in WRONG.items() for case in cases],
)
def test_wrong_values(field, value, message):
    """Each wrong value raises an error of one line when the configuration is made, before a folder
    exists."""
    with pytest.raises(ValueError) as raised:  # noqa: PT011  # the messages are compared as texts
        Config(**{"game": "Pong"} | {field: value})
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_name_that_is_no_text():
    with pytest.raises(TypeError, match="a game's name must be a string"):
        Config(5)


def test_random_frame_skips_are_errors_of_training():
    with pytest.raises(TrainingError, match=r"such as dqn: v4 draws one of \(2, 5\)"):
        Config("Pong", preset="v4")


@pytest.mark.parametrize("name", [field.name for field in dataclasses.fields(Hyperparameters)])
@pytest.mark.parametrize(
    "value",
    [-1, 0, float("nan"), float("inf"), "1", None, True, [1], 10**400],
    ids=lambda value: str(value)[:9],
)
def test_wrong_hyperparameters(name, value):
    if value == 0 and name == "entropy_coefficient":
        assert Hyperparameters(entropy_coefficient=value).entropy_coefficient == 0
        return
    with pytest.raises(ValueError, match=f"^{name} must be"):
        Hyperparameters(**{name: value})


@pytest.mark.parametrize(
    "change",
    [{"num_envs": 5}, {"minibatch": 100}, {"gamma": 1.5}, {"gae_lambda": 2}, {"horizon": 2.5}],
)
def test_hyperparameters_that_do_not_fit(change):
    with pytest.raises(ValueError, match=f"^{next(iter(change))} must"):
        Hyperparameters(**change)


def test_equal_configurations_have_equal_files():
    given = Config(
        "pong",
        variations=["Pong:lazy_enemy"],
        game_mode=np.int64(1),
        starts=[{}, {4: 3}],
        features=["x", "valid"],
    )
    want = Config(
        "Pong",
        variations=("lazy_enemy",),
        game_mode=1,
        starts=({}, {"4": 3}),
        features=("x", "valid"),
    )
    assert given == want
    assert given.to_json() == want.to_json()
    assert json.loads(want.to_json()).keys() == {field.name for field in dataclasses.fields(Config)}


def test_experiments():
    """The default equals `Config`; the paper's experiment has its hyperparameters and sees x and y
    of all objects in two states."""
    assert Config.of("default", "Pong") == Config("Pong")
    paper = Config.of("paper", "Breakout", seed=3)
    h = paper.hyperparameters
    assert (h.num_envs, h.horizon, h.epochs, h.minibatch, h.learning_rate, h.clip) == (
        8,
        128,
        3,
        256,
        2.5e-4,
        0.1,
    )
    assert (h.gamma, h.gae_lambda, h.value_coefficient, h.entropy_coefficient) == (
        0.99,
        0.95,
        1.0,
        0.01,
    )
    assert (
        paper.vector.features,
        paper.vector.grid_features,
        paper.vector.history,
        paper.seed,
    ) == (("x", "y"), None, 2, 3)
    changed = Config.of("paper", "Breakout", {"clip": 0.2}, seed=3)
    assert changed == dataclasses.replace(paper, hyperparameters=dataclasses.replace(h, clip=0.2))
    assert Config.of("paper", "Breakout", history=4).history == 4
    with pytest.raises(ValueError, match="experiment must be default or paper, got 'ours'"):
        Config.of("ours", "Pong")
    assert all(
        EXPERIMENTS[name].keys() <= {field.name for field in dataclasses.fields(Config)}
        for name in EXPERIMENTS
    )
