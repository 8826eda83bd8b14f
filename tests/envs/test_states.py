"""Saved states replay exactly, and states with wrong contents raise errors."""

import contextlib
import dataclasses
import struct

import numpy as np
import pytest

import ocjax
from ocjax.emulators.settings import settings
from ocjax.emulators.worker import console
from ocjax.envs import AlePool, States
from tests.support.marks import slow_but

SHOWN = (
    "ram",
    "reward",
    "lives",
    "terminated",
    "truncated",
    "game_over",
    "started",
    "episode_length",
    "executed",
)


def shown(pool):
    names = (*SHOWN, *["screen"] * (pool.arrays.screen is not None))
    return {name: getattr(pool.arrays, name).copy() for name in names}


def replays(pool, actions, others=()):
    """True if pools that restore the pool's present state show the same next frames."""
    state, want = pool.clone_state(), []
    for some in actions:
        pool.step(some)
        want.append(shown(pool))
    for one in (pool, *others):
        one.restore_state(state)
        for some, expected in zip(actions, want, strict=True):
            one.step(some)
            assert all(
                np.array_equal(getattr(one.arrays, name), value) for name, value in expected.items()
            )
    return True


def check_replays(name, skip, p, autoreset="next step", preset="v5", times=6):
    chosen = settings(
        preset, frame_skip=skip, repeat_action_probability=p, max_episode_frames=150 * skip
    )
    options = {"screens": ("screen",), "autoreset": autoreset}
    pool, other = (AlePool(ocjax.load(name), 3, chosen, num_workers=n, **options) for n in (0, 1))
    pool.reset([1, 2, 3])
    rng = np.random.default_rng(0)
    for _ in range(times):  # the first time right after the reset
        assert replays(pool, rng.integers(len(pool.actions), size=(12, 3)), [other])
        for some in rng.integers(len(pool.actions), size=(20, 3)):
            pool.step(some)
    pool.close()
    other.close()


@pytest.mark.parametrize("name", ["Qbert", "Breakout", "Amidar", "Berzerk"])
@pytest.mark.parametrize(
    ("skip", "p"),
    [(1, 0.5), (4, 0.9), *slow_but([], [(1, 0.25), (4, 0.0), (1, 0.9), (4, 0.25), (4, 0.5)])],
)
def test_restored_states_replay_exactly(name, skip, p):
    check_replays(name, skip, p)


@pytest.mark.parametrize("autoreset", ["next step", "same step"])
def test_restored_states_replay_exactly_where_lives_are_lost(autoreset):
    check_replays("Breakout", 4, 0.5, autoreset, "dqn", times=8)


@pytest.mark.parametrize("name", ocjax.games())
def test_states_of_all_games_are_restored(name):
    pool = AlePool(ocjax.load(name), 1, settings("v5"), num_workers=0)
    pool.reset([1])
    assert replays(pool, np.zeros((1, 1), int))
    pool.close()


@pytest.mark.slow
@pytest.mark.parametrize(("skip", "p"), [(1, 0.5), (4, 0.9), (4, 0.0)])
@pytest.mark.parametrize("name", ocjax.games())
def test_restored_states_of_all_games_replay_exactly(name, skip, p):
    check_replays(name, skip, p, times=3)


@pytest.mark.parametrize("workers", [0, 1])
def test_executed_actions_are_those_of_the_emulator(workers):
    """An emulator without sticky actions that gets the executed actions shows the same frames."""
    sticky, plain = (settings("v5", frame_skip=1, repeat_action_probability=p) for p in (0.6, 0.0))
    pool = AlePool(ocjax.load("Pong"), 2, sticky, num_workers=workers)
    other = AlePool(ocjax.load("Pong"), 2, plain, num_workers=0)
    pool.reset([1, 2])
    other.reset([5, 6])
    rng, repeated = np.random.default_rng(0), 0
    for _ in range(1500):
        actions = rng.integers(6, size=2)
        pool.step(actions)
        repeated += (pool.executed_action != actions).sum()
        other.step(pool.executed_action)
        assert np.array_equal(pool.ram, other.ram)
    assert 0.4 < repeated / 3000 < 0.6
    pool.close()


def test_info_has_the_executed_action():
    options = {
        "num_workers": 0,
        "mode": "raw",
        "frame_skip": 1,
        "max_episode_steps": 5,
        "autoreset_mode": "SameStep",
    }
    envs = ocjax.make_vec("Pong", 2, repeat_action_probability=0.9, **options)
    _, info = envs.reset(seed=0)
    assert info["executed_action"].tolist() == [0, 0]
    for _ in range(5):
        *_, info = envs.step(np.array([3, 4]))
    assert info["executed_action"].tolist() == [0, 0]  # a game has begun
    assert np.isin(info["final_info"]["executed_action"], [0, 3, 4]).all()
    assert info["_executed_action"].all()
    plain = ocjax.make_vec("Pong", 1, repeat_action_probability=0.0, **options)
    assert "executed_action" not in plain.reset(seed=0)[1]


# Joined states.


def test_states_of_different_times_can_be_joined():
    envs = ocjax.make_vec(
        "Breakout", 2, num_workers=0, obs=["ram", "vector"], autoreset_mode="Disabled"
    )
    early_observation, _ = envs.reset(seed=0)
    early = envs.clone_state()
    for t in range(30):
        late_observation, *_ = envs.step(np.full(2, t % 4))
    late = envs.clone_state()
    observed, _ = envs.restore_state(States.concatenate([late[1], early[0]]))
    for name, array in observed.items():
        assert np.array_equal(
            array, np.stack([late_observation[name][1], early_observation[name][0]])
        )
    assert len(States.concatenate([early, late, early[0]])) == 5
    for wrong, error, message in (
        ([], ValueError, "expected at least one States to join, got none"),
        ([early, b"states"], TypeError, "states must be States"),
        (
            [early, envs.pool.clone_state()],
            ValueError,
            "with the same mode and obs, got different arrays env 0",
        ),
        (
            [early, dataclasses.replace(late, md5="0" * 32)],
            ValueError,
            "expected states of one game",
        ),
    ):
        with pytest.raises(error, match=message):
            States.concatenate(wrong)


# Forged states.


def test_files_with_wrong_contents_are_refused():
    pool = AlePool(ocjax.load("Pong"), 1, num_workers=0)
    pool.reset([0])
    state = pool.clone_state()
    for change in (
        {"ram": np.array([None])},
        {"ram": np.zeros((2, 128), np.uint8)},
        {"ram": np.zeros((), np.uint8)},
        {"ram": np.zeros((1, 128), "M8[s]")},
        {"ram": np.zeros(1, "i4,i4")},
        {"ram": np.array(["text"])},
    ):
        rows = {**state.rows, **change}
        with pytest.raises(ValueError, match=r"the states are damaged|expected undamaged bytes"):
            States.from_bytes(dataclasses.replace(state, rows=rows).to_bytes())
    for name in ("ram", "state"):
        rows = {key: array for key, array in state.rows.items() if key != name}
        with pytest.raises(ValueError, match="the states are damaged: expected arrays of numbers"):
            States.from_bytes(dataclasses.replace(state, rows=rows).to_bytes())


def forged(state, change):
    """A state with changed emulator bytes."""
    rows = {name: array.copy() for name, array in state.rows.items()}
    size = int(rows["state_bytes"][0])
    data = change(rows["state"][0, :size].tobytes())
    rows["state"] = np.frombuffer(data, np.uint8)[None].copy()
    rows["state_bytes"] = np.array([len(data)])
    return dataclasses.replace(state, rows=rows)


@pytest.mark.parametrize(
    "name", ["Asterix", *slow_but([], ["Pong", "Pitfall2", "Tutankham", "Qbert", "Solaris"])]
)
def test_forged_fields_of_emulators_are_refused_or_harmless(name):
    """ALE trusts lengths, banks and positions. A worker that writes outside its memory dies."""
    pool = AlePool(ocjax.load(name), 1, num_workers=1)
    pool.reset([0])
    pool.step(np.array([1]))
    state, ram, rng = pool.clone_state(), pool.ram.copy(), np.random.default_rng(0)
    data = state.rows["state"][0].tobytes()
    texts = [data.index(b"System") + 14, data.rindex(b" ") - 6_600]  # the digits of random numbers
    fields = [k for k in range(len(data) - 3) if not any(text < k < text + 6_550 for text in texts)]
    refused = 0
    for k in rng.choice(fields, 150, replace=False).tolist():
        value = int(rng.choice([-1, 2**31 - 1, -(2**31), 200, 70_000, 5]))
        try:
            pool.restore_state(
                forged(
                    state,
                    lambda data, k=k, value=value: (
                        data[:k] + struct.pack("<i", value) + data[k + 4 :]
                    ),
                )
            )
        except ValueError:
            refused += 1
            assert np.array_equal(pool.ram, ram)
            continue
        for _ in range(3):
            pool.step(np.array([0]))
        pool.restore_state(state)
    assert refused > 75
    for change in (
        lambda data: data[:-8],
        lambda data: data + b"\0" * 4,
        lambda data: data[:24],
        lambda data: b"",
    ):
        with pytest.raises(ValueError, match="the states are damaged"):
            pool.restore_state(forged(state, change))
    assert replays(pool, np.zeros((3, 1), int))
    pool.close()


def test_forged_facts_are_refused_and_change_nothing():
    pool = AlePool(ocjax.load("Breakout"), 2, settings("dqn"), autoreset="disabled", num_workers=0)
    pool.reset([0, 1])
    while not pool.terminated.any():
        pool.step(np.full(2, 2))
    state, before = pool.clone_state(), pool.ram.copy()

    def with_rows(**changes):
        return dataclasses.replace(state, rows={**state.rows, **changes})

    two = np.full(2, 2, np.uint8).view(bool)
    for wrong, message in (
        (with_rows(terminated=two), "'terminated' has bools that are not 0 or 1"),
        (with_rows(terminated=np.zeros(2, bool)), "where an episode has ended"),
        (with_rows(executed=np.full(2, 18, np.int32)), "'executed' has numbers out of range"),
        (with_rows(episode_return=np.full(2, np.nan)), "'episode_return' has numbers out of range"),
        (with_rows(episode_length=np.full(2, -1)), "'episode_length' has numbers out of range"),
        (with_rows(state=np.zeros((), np.uint8)), "expected rows with arrays"),
        (with_rows(ram=None), "expected rows with arrays"),
        (dataclasses.replace(state, rows={}), "expected rows with arrays"),
        (dataclasses.replace(state, rows=None), "expected rows with arrays"),
    ):
        with pytest.raises(ValueError, match=message):
            pool.restore_state(wrong)
        assert np.array_equal(pool.ram, before)
    pool.restore_state(state)


@pytest.mark.parametrize("workers", [0, 2])
def test_environments_stay_usable_if_an_emulator_rejects_a_state(workers, monkeypatch):
    monkeypatch.setattr(console, "check", lambda data, good: None)
    envs = ocjax.make_vec("Pong", 2, mode="raw", num_workers=workers)
    first, _ = envs.reset(seed=3)
    good = envs.clone_state()
    for old in (b"M6502Low", b"Cartridge2K", b"TIASound", b"System"):
        bad = forged(good[0], lambda data, old=old: data.replace(old, b"?" * len(old)))
        with pytest.raises(
            ValueError,
            match=(
                r"emulators of environments \[0, 1\] rejected their states: reset all "
                r"environments"
            ),
        ):
            envs.restore_state(bad)
        with pytest.raises(ValueError, match="have not been reset"):
            envs.step(np.zeros(2, int))
        assert np.array_equal(envs.reset(seed=3)[0], first)
    envs.restore_state(good)
    envs.step(np.zeros(2, int))
    envs.close()


def test_repr_is_short():
    with contextlib.closing(ocjax.make_vec("Pong", 2, num_workers=0)) as envs:
        envs.reset(seed=0)
        shown = repr(envs.clone_state())
    assert shown == f"States of 2 emulators with the ROM of md5 {ocjax.load('Pong').md5}"
