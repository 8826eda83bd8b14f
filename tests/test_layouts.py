"""Layouts of other projects' object tensors."""

import dataclasses
import json
import subprocess

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import ocjax
from ocjax import Objects, layouts
from ocjax.ocatari import OCAtari
from tests.support.states import excerpt


def made(game, **categories):
    """A state with the given boxes of each category by slot; other fields are the slot's number."""
    n = game.num_slots
    xywh, valid = np.zeros((n, 4), np.int16), np.zeros(n, bool)
    for name, boxes in categories.items():
        for slot, box in boxes.items():
            xywh[game.slices[name].start + slot], valid[game.slices[name].start + slot] = box, True
    number = np.arange(n, dtype=np.int32) * valid
    fields = xywh, valid, number.astype(np.int8), number, np.zeros((n, 3), np.uint8)
    return Objects(*map(jnp.asarray, fields), game=game)


def test_ocatari_slots_are_those_of_its_tables():
    for name in ("Pong", "Kangaroo", "Seaquest"):
        game, table = ocjax.load(name), layouts._tables()[name.lower()]
        assert (
            layouts.ocatari_slots(name)
            == layouts.ocatari_slots(game)
            == table["objects"] | table["hud"]
        )
        assert (
            layouts.ocatari_slots(game.without_hud())
            == layouts.ocatari_slots(game, hud=False)
            == table["objects"]
        )
        assert table["objects"].keys() <= game.slices.keys()


def test_ocatari_of_pong():
    game = ocjax.load("Pong")
    state = made(
        game, Player={0: (140, 90, 4, 16)}, Ball={0: (70, 60, 2, 4)}, EnemyScore={0: (20, 1, 8, 20)}
    )
    assert list(layouts.ocatari_slots(game)) == [
        "Player",
        "Ball",
        "Enemy",
        "PlayerScore",
        "EnemyScore",
    ]
    assert layouts.ocatari(state).tolist() == [140, 90, 70, 60, 0, 0, 0, 0, 20, 1]
    objects = ocjax.load("Pong", hud=False).rem(excerpt("Pong")["rams"][:6].reshape(2, 3, 128))
    assert layouts.ocatari(objects).shape == (2, 3, 6)
    assert np.array_equal(jax.vmap(layouts.ocatari)(objects), layouts.ocatari(objects))


def test_ocatari_with_fewer_slots_and_other_fields():
    game = ocjax.load("Asteroids", hud=False)  # 40 asteroids; OCAtari has 30
    state = made(game, Player={0: (80, 90, 5, 10)}, Asteroid={3: (1, 2, 8, 8), 39: (5, 6, 8, 8)})
    out = layouts.ocatari(state)
    assert out.shape == (3 + 2 * 30 + 2 * 2,)
    assert out[:9].tolist() == [80, 90, 0, 1, 2, 5, 6, 0, 0]
    seaquest = layouts.ocatari(
        made(ocjax.load("Seaquest"), OxygenBar={0: (49, 170, 33, 5)}), hud=False
    )
    assert seaquest.shape == (83,)
    assert seaquest.sum() == 33


def test_blendrl():
    game = ocjax.load("Seaquest")
    state = made(
        game, Player={0: (10, 20, 5, 4)}, Shark={7: (30, 40, 8, 6)}, OxygenBar={0: (49, 170, 33, 5)}
    )
    out, first = layouts.blendrl(state), game.slices["Shark"].start
    assert out.shape == (43, 4)
    assert out.dtype == jnp.int32
    assert out[0].tolist() == [1, 12, 22, 0]
    assert out[5].tolist() == [
        1,
        34,
        43,
        first + 7,
    ]  # after Player and four Divers; slot 7 is the first visible one
    assert out[36].tolist() == [1, game.slices["OxygenBar"].start, 0, 0]
    assert out[:, 0].sum() == 3
    assert layouts.blendrl(ocjax.load("Kangaroo").rem(np.zeros((2, 128), np.uint8))).shape == (
        2,
        49,
        4,
    )
    assert layouts.blendrl(ocjax.load("Pong").rem(np.zeros(128, np.uint8))).shape == (3, 4)


def test_blendrl_slots():
    assert layouts.blendrl_slots("Pong") == {"Player": 1, "Ball": 1, "Enemy": 1}
    assert sum(layouts.blendrl_slots(ocjax.load("Seaquest", hud=False)).values()) == 43
    layouts.blendrl_slots("Seaquest").clear()
    assert list(layouts.blendrl_slots("Seaquest"))[:2] == ["Player", "Diver"]
    with pytest.raises(ValueError, match="declares no slots of VideoPinball"):
        layouts.blendrl_slots("VideoPinball")


def test_unknown_orientations_are_zero():
    state = made(ocjax.load("Seaquest"), Player={0: (10, 20, 5, 4)})
    state = Objects(
        state.xywh, state.valid, state.orientation - jnp.int8(1), state.value, state.rgb, state.game
    )
    assert layouts.blendrl(state)[0].tolist() == [1, 12, 22, 0]


def test_nudge():
    freeway = ocjax.load("Freeway")
    out = layouts.nudge(
        made(freeway, Chicken={0: (44, 100, 6, 8), 1: (108, 90, 6, 8)}, Car={2: (7, 59, 8, 10)})
    )
    assert out.shape == (11, 6)
    assert out[0].tolist() == [1, 0, 0, 0, 44, 100]
    assert out[1].tolist() == [0, 1, 0, 0, 7, 59]
    assert not np.any(out[2:])
    asterix = ocjax.load("Asterix")
    out = layouts.nudge(
        made(
            asterix, Player={0: (1, 2, 8, 8)}, Enemy={5: (3, 4, 8, 8)}, Consumable={1: (5, 6, 8, 8)}
        )
    )
    assert out[:4].tolist() == [[1, 0, 0, 0, 1, 2], [0, 1, 0, 0, 3, 4], [0, 0, 0, 1, 5, 6], [0] * 6]


def test_games_that_have_no_such_layout():
    pong, pinball = ocjax.load("Pong"), ocjax.load("VideoPinball")
    with pytest.raises(ValueError, match="for Asterix and Freeway only, got Pong"):
        layouts.nudge(made(pong))
    for layout in (layouts.ocatari, layouts.blendrl):
        with pytest.raises(ValueError, match=r"OCAtari 2\.2\.1 declares no slots of VideoPinball"):
            layout(made(pinball))
    with pytest.raises(ValueError, match="no reference to their game"):
        layouts.ocatari(dataclasses.replace(made(pong), game=None))
    with pytest.raises(TypeError, match="must be a string"):
        layouts.ocatari_slots(3)


def test_what_is_no_objects_is_refused():
    views = OCAtari("Pong").objects
    for layout in (layouts.ocatari, layouts.blendrl, layouts.nudge):
        for wrong, name in (
            (np.zeros((2, 128), np.uint8), r"uint8 \[2, 128\]"),
            ("Pong", "'Pong'"),
            ([1], r"\[1\]"),
            (views, r"\["),
        ):
            with pytest.raises(
                TypeError,
                match=(
                    r"objects must be ocjax\.Objects, as game\.rem and game\.vem return them, "
                    rf"got {name}"
                ),
            ):
                layout(wrong)


PROGRAM = """
import json, warnings
warnings.filterwarnings("ignore")
import numpy as np
from ocatari.core import OCAtari
env = OCAtari("ALE/Seaquest-v5", hud=True, obs_mode="obj")
env.reset(seed=1)
out = []
for t in range(200):
    env.step([1, 3, 5, 2][t % 4])
    out += [[env.get_ram().tolist(), [int(v) for v in env.ns_state]]]
print(json.dumps(out[20::20]))
"""


def test_against_ocatari(request):
    python = request.config.getoption("--ocatari")
    if python is None:
        pytest.skip("needs --ocatari with an interpreter that has OCAtari 2.2.1")
    run = subprocess.run([python, "-c", PROGRAM], capture_output=True, text=True, check=True)
    rams, states = zip(*json.loads(run.stdout.splitlines()[-1]), strict=True)
    got = np.asarray(layouts.ocatari(ocjax.load("Seaquest").rem(np.array(rams, np.uint8))))
    assert got.shape == np.shape(states)
    assert np.mean(np.abs(got - np.array(states)) <= 8) > 0.9
