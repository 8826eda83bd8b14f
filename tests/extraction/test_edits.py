"""Edits of objects in RAM and in saved states."""

import itertools
import re

import jax
import numpy as np
import pytest

import ocjax
from ocjax.extractors import pong
from tests.support.states import excerpt

NOOP = np.zeros(2, np.int64)


@pytest.fixture
def envs():
    made = ocjax.make_vec(
        "Pong", 2, num_workers=0, frame_skip=1, mode="both", repeat_action_probability=0
    )
    made.reset(seed=3)
    for action in itertools.islice(itertools.cycle((1, 2, 3)), 90):
        made.step(np.full(2, action))
    yield made
    made.close()


def ball(objects):
    return np.asarray(objects.of("Ball").xywh)[:, 0]


def test_what_if_the_ball_were_there(envs):
    game, states = ocjax.load("Pong"), envs.clone_state()
    envs.restore_state(states.set("Pong", "Ball", x=80, y=100))
    assert np.array_equal(ball(envs.objects["rem"]), [[80, 100, 2, 4]] * 2)
    assert np.array_equal(ball(game.rem(envs.get_ram())), [[80, 100, 2, 4]] * 2)
    envs.step(NOOP)
    rem, vem = (ball(envs.objects[method]) for method in ("rem", "vem"))
    assert np.array_equal(rem, vem)  # the emulator continues from there
    assert np.array_equal(rem, [[79, 101, 2, 4]] * 2)
    envs.restore_state(states)
    assert np.array_equal(envs.get_ram(), states.rows["ram"])


def test_states_of_another_game_are_not_edited(envs):
    with pytest.raises(ValueError, match="but the ROM of Breakout has"):
        envs.clone_state().set("Breakout", "Ball", x=80)


def test_only_what_is_wanted_changes(envs):
    game, ram = ocjax.load("Pong"), envs.get_ram()
    before, after = (
        jax.tree.map(np.asarray, game.rem(r))
        for r in (ram, ocjax.edit(game, ram, "EnemyScore", value=17))
    )
    assert (after.of("EnemyScore").value == 17).all()
    for category in ("Player", "Enemy", "Ball", "PlayerScore"):
        assert jax.tree.all(jax.tree.map(np.array_equal, before.of(category), after.of(category)))


@pytest.mark.parametrize(
    ("category", "slot", "wanted", "error", "text"),
    [
        ("Bal", None, {"x": 1}, ValueError, "Pong has no category 'Bal'"),
        ("Ball", 1, {"x": 1}, ValueError, "slot must be from 0 to 0 for Ball, got 1"),
        ("Ball", None, {}, TypeError, "got none"),
        ("Ball", None, {"speed": 1}, TypeError, "got speed"),
        ("Ball", None, {"x": 1.5}, TypeError, "x must be an integer, got 1.5"),
        (
            "Ball",
            None,
            {"w": 7},
            ValueError,
            "give Ball w=7 and leave everything else as it is; it has w=2",
        ),
    ],
)
def test_edits_that_are_refused(envs, category, slot, wanted, error, text):
    with pytest.raises(error, match=re.escape(text)):
        ocjax.edit(pong.GAME, envs.get_ram(), category, slot, **wanted)


def test_objects_that_are_absent_are_not_edited(envs):
    ram = np.zeros(128, np.uint8)
    with pytest.raises(ValueError, match="there is no Ball to edit in this state"):
        ocjax.edit(pong.GAME, ram, "Ball", x=80)


@pytest.mark.slow
@pytest.mark.parametrize("name", ocjax.games())
def test_every_game(name):
    """The first object of a recorded state moves by a pixel and nothing else changes, or the error
    gives the reason.

    The state is the last one that shows an object.
    """
    game, rams = ocjax.load(name), excerpt(name)["rams"]
    ram = rams[np.flatnonzero(np.asarray(game.rem(rams).valid).any(axis=1))[-1]]
    before = jax.tree.map(np.asarray, game.rem(ram))
    slot = int(before.valid.argmax())
    category = game.categories[game.slot_category[slot]].name
    number = slot - game.slices[category].start
    refusal = ""
    try:
        edited = ocjax.edit(game, ram, category, number, x=int(before.x[slot]) + 1)
    except ValueError as error:
        edited, refusal = ram, str(error)
    after = jax.tree.map(np.asarray, game.rem(edited))
    moved = 0 if refusal else 1
    assert (f"give {category} x=" in refusal) == (not moved)
    assert after.x[slot] == before.x[slot] + moved
    assert np.array_equal(np.delete(after.xywh, slot, axis=0), np.delete(before.xywh, slot, axis=0))
    assert np.array_equal(after.valid, before.valid)
    assert np.array_equal(after.value, before.value)
