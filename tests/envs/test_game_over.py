"""Ends of games: `info["game_over"]`, and the lengths and limits of games with an episode per
life."""

import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import ocjax
from ocjax.emulators.settings import settings
from ocjax.envs import AlePool, make

LIVES = {"mode": "raw", "preset": "dqn"}


def single_games(name, actions, seed, **options):
    """The facts of each step of a single environment, which is reset after each end, with the steps
    counted here."""
    env = make(name, **LIVES, **options)
    env.reset(seed=seed)
    facts, length = [], 0
    for action in actions:
        _, _, terminated, truncated, info = env.step(int(action))
        length += 1
        facts.append((terminated, truncated, length, info["game_over"]))
        length *= not info["game_over"]
        if terminated or truncated:
            env.reset()
    env.close()
    return facts


def vector_games(name, actions, seed, mode, **options):
    """The same facts of a vector environment, which ignores the action of each step that starts an
    episode."""
    envs = ocjax.make_vec(name, 1, num_workers=0, autoreset_mode=mode, **LIVES, **options)
    envs.reset(seed=seed)
    facts, todo = [], list(actions)
    while todo:
        starts = bool(envs._ended[0]) and mode == AutoresetMode.NEXT_STEP
        action = 0 if starts else int(todo.pop(0))
        _, _, terminated, truncated, info = envs.step(np.array([action]))
        shown = info.get("final_info", info)
        if starts:
            assert not np.array([terminated, truncated, info["game_over"]]).any()
            continue
        assert not info["game_over"][0] or shown is info
        fact = terminated[0], truncated[0], shown["episode_length"][0], shown["game_over"][0]
        facts.append(fact)
    envs.close()
    return facts


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
@pytest.mark.parametrize("limit", [None, 100, 30])
def test_ignored_steps_do_not_count(mode, limit):
    """Single environments, where a reset is no step, have the same lengths, limits and ends."""
    actions = np.random.default_rng(0).integers(4, size=400)
    options = {} if limit is None else {"max_episode_steps": limit}
    want = single_games("Breakout", actions, 3, **options)
    assert vector_games("Breakout", actions, 3, mode, **options) == want
    assert any(over for *_, over in want)
    assert any(terminated and not over for terminated, _, _, over in want)
    if limit is not None:
        assert max(length for _, _, length, _ in want) == limit


def first_loss(actions):
    """The step, counted from 0, that loses the first life, and the limit of steps that coincides
    with it."""
    facts = single_games("Breakout", actions, 3)
    return next(t for t, (terminated, *_) in enumerate(facts) if terminated)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_a_life_lost_at_the_limit_of_steps_ends_the_game(mode):
    actions = np.random.default_rng(0).integers(4, size=200)
    t = first_loss(actions)
    for limit, over in ((t, True), (t + 1, True), (t + 2, False)):
        facts = vector_games("Breakout", actions[: t + 1], 3, mode, max_episode_steps=limit)
        end = facts[min(t, limit - 1)]
        assert end == (limit > t, limit <= t + 1, min(t + 1, limit), over)


def counted_games(pool, actions):
    """The lengths of games by `game_over`, and by the totals that the next game does not
    continue."""
    counted, found, last = [], [], None
    for action in actions:
        pool.step(np.array([action]))
        if pool.started[0] and pool.episode_length[0] == 0:
            found.append(last)
        if pool.game_over[0]:
            counted.append((pool.episode_return[0], pool.episode_length[0]))
        last = pool.episode_return[0], pool.episode_length[0]
    return counted, found


@pytest.mark.parametrize("skip", [4, (2, 5)])
def test_a_life_lost_just_before_the_limit_of_frames_ends_the_game(skip):
    """The frames between two lives may reach the limit, and then the next episode begins a new
    game."""
    actions = np.random.default_rng(0).integers(4, size=300)

    def pool(most):
        chosen = settings("dqn", max_episode_frames=most, frame_skip=skip)
        pool = AlePool(ocjax.load("Breakout"), 1, chosen, num_workers=0)
        pool.reset([3])
        return pool

    whole, cut = pool(108_000), 0
    for action in actions:
        whole.step(np.array([action]))
        if whole.terminated[0]:
            break
    lost = int(whole.frame_number[0])
    for most in range(lost - 2, lost + 20):
        counted, found = counted_games(pool(most), actions[:150])
        assert counted[: len(found)] == found
        assert len(counted) - len(found) in (0, 1)
        cut += len(found)
    assert cut > 20


def test_a_game_without_lives_ends():
    """ALE reports one life of Adventure for ever, also at the end of a game."""
    envs = ocjax.make_vec("Adventure", 2, mode="raw", num_workers=1, ram_info=True)
    _, info = envs.reset(seed=0)
    assert not info["game_over"].any()
    ram = info["ram"]
    ram[1, 0xE0 - 0x80] = 2  # the second player is lost
    envs.set_ram(ram)
    *_, terminated, _, info = envs.step(np.zeros(2, int))
    assert terminated.tolist() == info["game_over"].tolist() == [False, True]
    assert info["lives"].tolist() == [1, 1]
    *_, info = envs.step(np.zeros(2, int))
    assert not info["game_over"].any()
    envs.close()


def test_saved_states_know_that_the_game_is_over():
    pool = AlePool(ocjax.load("Breakout"), 1, settings("dqn", max_episode_steps=20), num_workers=0)
    pool.reset([3])
    while not pool.truncated[0]:
        pool.step(np.array([1]))
    saved = pool.clone_state()
    assert pool.game_over[0]
    pool.step(np.array([0]))
    assert not pool.game_over[0]
    pool.restore_state(saved)
    assert pool.game_over[0]
